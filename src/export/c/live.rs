//! What of a program is needed for its answer: a C compiler warns of everything else.

use vsonar_ir::{Leaf, Loop, Operand, Program, Reg, Span};

/// What of a loop is needed.
#[derive(Debug)]
pub(super) struct Live<'p> {
    /// The loop.
    pub(super) l: &'p Loop,
    /// Which final registers are asked for.
    pub(super) wanted: [bool; 5],
    /// Which registers are carried from row to row: written, and read or asked for.
    pub(super) kept: [bool; 5],
    /// Which instructions of the body are needed, by number.
    pub(super) body: Vec<bool>,
    /// Which instructions of the column are needed, by number.
    pub(super) column: Vec<bool>,
}

/// What of the first loop (where any of it is) and of the second is needed.
pub(super) fn live(program: &Program) -> (Option<Live<'_>>, Live<'_>) {
    let second = Live::new(program.second(), [true, false, false, false, false]);
    let mut wanted = [false; 5];
    for leaf in second.leaves() {
        if let Leaf::Iter2(k) = leaf {
            wanted[usize::from(k)] = true;
        }
    }
    let first = program.first().filter(|_| wanted.contains(&true)).map(|l| Live::new(l, wanted));
    (first, second)
}

impl<'p> Live<'p> {
    fn new(l: &'p Loop, wanted: [bool; 5]) -> Live<'p> {
        let body = vec![false; l.body().len()];
        let column = vec![false; l.column().block().len()];
        let mut live = Live { l, wanted, kept: [false; 5], body, column };
        if let Some(reg) = live.break_if() {
            live.body[reg.index()] = true;
        }
        // A register that is read needs its next value, which may read others.
        loop {
            let read = |k: usize| live.reads().any(|leaf| leaf == Leaf::Read(k as u8));
            let kept: [bool; 5] = std::array::from_fn(|k| l.next()[k].is_some() && (wanted[k] || read(k)));
            for (_, reg) in kept.iter().zip(l.next()).filter(|(kept, _)| **kept) {
                reg.iter().for_each(|reg| live.body[reg.index()] = true);
            }
            mark(l.body(), &mut live.body);
            if kept == live.kept {
                break;
            }
            live.kept = kept;
        }
        if live.has_column() {
            live.column[l.column().result().index()] = true;
            mark(l.column().block(), &mut live.column);
        }
        live
    }

    /// The break mask, where rows follow that it can keep from being visited.
    pub(super) fn break_if(&self) -> Option<Reg> {
        self.l.break_if().filter(|_| self.l.span() == Span::All)
    }

    /// Whether the loop's column matters: for a window or by itself.
    pub(super) fn has_column(&self) -> bool {
        self.reads().any(|leaf| matches!(leaf, Leaf::X | Leaf::Window(_)))
    }

    fn reads(&self) -> impl Iterator<Item = Leaf> + '_ {
        let needed = self.l.body().iter().filter(|(reg, _)| self.body[reg.index()]);
        needed.filter_map(|(_, inst)| inst.leaf())
    }

    /// The leaves of the body and the column that are needed.
    pub(super) fn leaves(&self) -> impl Iterator<Item = Leaf> + '_ {
        let column = self.l.column().block().iter().filter(|(reg, _)| self.column[reg.index()]);
        self.reads().chain(column.filter_map(|(_, inst)| inst.leaf()))
    }

    /// Whether a leaf of the body or the column is needed.
    pub(super) fn has(&self, leaf: Leaf) -> bool {
        self.leaves().any(|l| l == leaf)
    }

    /// The window operands that are needed, in the order of their numbers.
    pub(super) fn operands(&self) -> Vec<Operand> {
        Operand::all().filter(|operand| self.has(Leaf::Window(*operand))).collect()
    }
}

/// Marks what the marked instructions need.
fn mark(block: &vsonar_ir::Block, live: &mut [bool]) {
    for (reg, inst) in block.iter().rev() {
        if live[reg.index()] {
            inst.args().iter().for_each(|arg: &Reg| live[arg.index()] = true);
        }
    }
}
