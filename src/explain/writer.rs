//! The values of one block as statements.

use std::collections::BTreeSet;

use vsonar_ir::opt::interval::Interval;
use vsonar_ir::{Block, Leaf, Reg, Ty};

use super::listing::{Arm, Cond, Expr, Name, Stmt};
use super::names::Names;
use super::order::{and, conjuncts};
use super::structure::{Step, strip};
use super::view::{View, views};

/// Blocks are nested no deeper than this: further to the right nobody reads.
const DEEPEST: usize = 100;
/// So many conditions may stand in one line for being nested in one another.
const TOGETHER: usize = 64;

/// Writes the values of one block.
pub(super) struct Writer<'a> {
    pub(super) block: &'a Block,
    pub(super) intervals: &'a [Interval],
    pub(super) registers: [u8; 5],
    pub(super) views: Vec<View>,
    /// Whether a value is to have a name.
    pub(super) named: Vec<bool>,
    /// The name it has, once it is there.
    pub(super) name: Vec<Option<Name>>,
    /// Whether names are given before all that needs them, not only before what needs them for sure.
    early: bool,
    names: &'a mut Names,
}

impl<'a> Writer<'a> {
    pub(super) fn new(
        block: &'a Block,
        intervals: &'a [Interval],
        registers: [u8; 5],
        names: &'a mut Names,
    ) -> Writer<'a> {
        let views = views(block);
        let n = block.len();
        let (named, name) = (vec![false; n], vec![None; n]);
        Writer { block, intervals, registers, views, named, name, early: false, names }
    }

    /// Gives all names early, so that no `else if` has to become an `else:` with a name and an `if` below it.
    pub(super) fn early(self) -> Writer<'a> {
        Writer { early: true, ..self }
    }

    /// One value by itself, and the names it needs.
    pub(super) fn value(&mut self, reg: Reg) -> (Vec<Stmt>, Expr) {
        self.decide(&[reg]);
        let mut lets = Vec::new();
        self.lets(&self.closure(&[reg]), &mut lets);
        (lets, self.expr(reg))
    }

    /// A block's statements; `None` if they are nested too deeply to be read.
    pub(super) fn body(&mut self, steps: &[Step]) -> Option<Vec<Stmt>> {
        let mut roots = Vec::new();
        heads(steps, &mut roots);
        self.decide(&roots);
        self.statements(steps, 0)
    }

    /// The values with names that these need, directly or not, and that have none yet.
    fn closure(&self, roots: &[Reg]) -> BTreeSet<Reg> {
        let mut found = BTreeSet::new();
        let mut seen = vec![false; self.views.len()];
        self.walk(roots.to_vec(), |reg| {
            if self.named[reg.index()] {
                found.insert(reg);
            }
            !std::mem::replace(&mut seen[reg.index()], true)
        });
        found
    }

    /// Gives these values their names.
    fn lets(&mut self, regs: &BTreeSet<Reg>, out: &mut Vec<Stmt>) {
        for &reg in regs {
            let i = reg.index();
            if self.name[i].is_some() {
                continue;
            }
            let mask = self.block.inst(reg).op().result() == Ty::Mask;
            // The value is written as if it had no name.
            self.named[i] = false;
            let stmt = if mask {
                let cond = self.cond(reg, true);
                let name = self.names.condition();
                self.name[i] = Some(name);
                Stmt::LetCond(name, cond)
            } else {
                let expr = self.expr(reg);
                let name = match self.views[i] {
                    View::Leaf(Leaf::Window(operand)) => self.names.operand(operand),
                    _ => self.names.value(),
                };
                self.name[i] = Some(name);
                Stmt::Let(name, expr)
            };
            self.named[i] = true;
            out.push(stmt);
        }
    }

    /// What of these steps' values has to have its name before each of them: what everything that uses it sees there, and
    /// would not see if it were given later.
    fn needed(&self, steps: &[Step]) -> Vec<BTreeSet<Reg>> {
        let n = self.views.len();
        // By which step, and which part of it, a value is come to first.
        let mut first: Vec<Option<(usize, usize)>> = vec![None; n];
        // What further steps or parts come to as well. What it is computed from is shared with it, and not gone through
        // again here.
        let mut shared = Vec::new();
        for (number, step) in steps.iter().enumerate() {
            for (part, roots) in parts(step).into_iter().enumerate() {
                if part == HEAD {
                    shared.extend(&roots);
                }
                self.walk(roots, |reg| match first[reg.index()] {
                    None => {
                        first[reg.index()] = Some((number, part));
                        true
                    }
                    Some(known) => {
                        if known != (number, part) {
                            shared.push(reg);
                        }
                        false
                    }
                });
            }
        }
        let mut here = vec![self.early; n];
        self.walk(shared, |reg| !std::mem::replace(&mut here[reg.index()], true));
        let mut out = vec![BTreeSet::new(); steps.len()];
        for (i, first) in first.iter().enumerate().filter(|(i, _)| here[*i] && self.named[*i]) {
            if let Some((number, _)) = *first {
                out[number].insert(Reg(i as u32));
            }
        }
        out
    }

    /// Goes through values that have no name yet and what they are computed from, further where the function says so.
    fn walk(&self, mut open: Vec<Reg>, mut further: impl FnMut(Reg) -> bool) {
        while let Some(reg) = open.pop() {
            if self.name[reg.index()].is_none() && further(reg) {
                open.extend(self.views[reg.index()].operands());
            }
        }
    }

    /// Statements, each name given where everything that uses it sees it and not earlier; `None` if they are nested too
    /// deeply.
    fn statements(&mut self, steps: &[Step], depth: usize) -> Option<Vec<Stmt>> {
        if depth > DEEPEST {
            return None;
        }
        let mut out = Vec::new();
        for (step, needed) in steps.iter().zip(self.needed(steps)) {
            self.lets(&needed, &mut out);
            out.push(match step {
                Step::Assign(k, reg) => Stmt::Assign(0, self.registers[usize::from(*k)], self.expr(*reg)),
                Step::Stop => Stmt::Stop(0),
                Step::If(mask, then, or_else) => self.choice(*mask, then, or_else, depth)?,
            });
        }
        Some(out)
    }

    /// A choice, and those that come to be made where it does not hold.
    fn choice(&mut self, mask: Reg, then: &[Step], or_else: &[Step], depth: usize) -> Option<Stmt> {
        let (mut mask, mut then, mut or_else) = (mask, then, or_else);
        let mut arms = Vec::new();
        let last = loop {
            // The shorter branch comes first, so that the longer one can go on with `else if`.
            let nested = |steps: &[Step]| matches!(steps, [Step::If(..)]);
            let swap = then.is_empty() || (!or_else.is_empty() && nested(then) && !nested(or_else));
            let (of, holds) = strip(self.block, mask, !swap);
            if swap {
                (then, or_else) = (or_else, then);
            }
            let cond = self.cond(of, holds);
            arms.push(Arm { site: 0, cond, then: self.statements(then, depth + 1)? });
            match or_else {
                [Step::If(next, holding, otherwise)] if self.needed(or_else)[0].is_empty() => {
                    (mask, then, or_else) = (*next, holding, otherwise);
                }
                _ => break self.statements(or_else, depth + 1)?,
            }
        };
        if let Some(Arm { cond, then, .. }) = arms.last_mut().filter(|_| last.is_empty()) {
            // Two conditions of one thing.
            if let [Stmt::If(inner, others)] = &mut then[..]
                && let ([Arm { cond: inner, then: deeper, .. }], []) = (&mut inner[..], &others[..])
                && conjuncts(cond) + conjuncts(inner) <= TOGETHER
            {
                let (inner, deeper) = (std::mem::replace(inner, Cond::First(true)), std::mem::take(deeper));
                *cond = and(std::mem::replace(cond, Cond::First(true)), inner);
                *then = deeper;
            }
        }
        Some(Stmt::If(arms, last))
    }
}

/// Of the parts of a statement, its head.
const HEAD: usize = 0;

/// The values and masks of a statement's head and of its two branches.
fn parts(step: &Step) -> [Vec<Reg>; 3] {
    let of = |steps: &[Step]| {
        let mut roots = Vec::new();
        heads(steps, &mut roots);
        roots
    };
    match step {
        Step::Assign(_, reg) => [vec![*reg], Vec::new(), Vec::new()],
        Step::Stop => Default::default(),
        Step::If(mask, then, or_else) => [vec![*mask], of(then), of(or_else)],
    }
}

/// The values and masks at the heads of statements.
fn heads(steps: &[Step], out: &mut Vec<Reg>) {
    for step in steps {
        match step {
            Step::Assign(_, reg) => out.push(*reg),
            Step::Stop => {}
            Step::If(mask, then, or_else) => {
                out.push(*mask);
                heads(then, out);
                heads(or_else, out);
            }
        }
    }
}
