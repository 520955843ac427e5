//! Which values of a block have names in its listing.

use vsonar_ir::{Leaf, Reg};

use super::structure::strip;
use super::view::View;
use super::writer::Writer;

/// Of an expression longer than this, in characters, the longest parts are given names.
const LONG: usize = 104;
/// A choice longer than this inside of another expression is given a name.
const LONG_CHOICE: usize = 60;
/// A window average read so often is given a short name.
const OFTEN: usize = 5;

impl Writer<'_> {
    /// Which values have names: those that are used more than once, unless that would be longer, and long ones.
    pub(super) fn decide(&mut self, roots: &[Reg]) {
        let long = self.long(roots);
        let mut uses = vec![0usize; self.views.len()];
        roots.iter().for_each(|reg| uses[reg.index()] += 1);
        for i in (0..self.views.len()).rev() {
            let view = self.views[i];
            let leaf = |reg: &Reg| matches!(self.views[reg.index()], View::Leaf(_));
            let simple = view.operands().iter().all(leaf);
            self.named[i] = match view {
                View::Leaf(Leaf::Window(_)) => uses[i] >= OFTEN,
                View::Leaf(_) | View::Not(_) => false,
                View::Power(..) | View::Twice(_) if simple => false,
                View::Compare(..) if simple => uses[i] > 3,
                View::Binary(..) if simple => uses[i] > 2,
                _ => uses[i] > 1 || (long[i] && uses[i] > 0),
            };
            let times = if self.named[i] { uses[i].min(1) } else { uses[i] };
            view.operands().iter().for_each(|reg| uses[reg.index()] += times);
        }
    }

    /// Which values would make an expression too long.
    fn long(&self, roots: &[Reg]) -> Vec<bool> {
        let mut reached = vec![false; self.views.len()];
        roots.iter().for_each(|reg| reached[reg.index()] = true);
        for i in (0..self.views.len()).rev() {
            if reached[i] {
                self.views[i].operands().iter().for_each(|reg| reached[reg.index()] = true);
            }
        }
        let mut readers = vec![0usize; self.views.len()];
        let views = self.views.iter().zip(&reached).filter(|(_, reached)| **reached);
        views.flat_map(|(view, _)| view.operands()).for_each(|reg| readers[reg.index()] += 1);
        let mut size = vec![0usize; self.views.len()];
        let mut long = vec![false; self.views.len()];
        for (i, view) in self.views.iter().enumerate().filter(|(i, _)| reached[*i]) {
            // `else if` can be read on and on.
            let chain = if let View::Select([_, _, or_else]) = *view { Some(or_else) } else { None };
            // A `not` has no name of its own.
            let inside = |reg: Reg| strip(self.block, reg, true).0;
            let mut parts: Vec<Reg> = view.operands().into_iter().map(inside).collect();
            for reg in &parts {
                let choice = matches!(self.views[reg.index()], View::Select(_)) && Some(*reg) != chain;
                long[reg.index()] |= choice && size[reg.index()] > LONG_CHOICE;
            }
            parts.sort_by_key(|reg| size[reg.index()]);
            let of = |long: &[bool], reg: &Reg| if long[reg.index()] { 1 } else { size[reg.index()] };
            let length = |long: &[bool]| view.length() + parts.iter().map(|reg| of(long, reg)).sum::<usize>();
            for reg in parts.iter().rev() {
                let leaf = matches!(self.views[reg.index()], View::Leaf(_));
                if length(&long) > LONG && !leaf {
                    long[reg.index()] = true;
                }
            }
            // What several values read is likely to be read so often that it has a short name.
            let short = matches!(view, View::Leaf(Leaf::Window(_))) && readers[i] + 1 >= OFTEN;
            size[i] = if short { 1 } else { length(&long) };
        }
        long
    }
}
