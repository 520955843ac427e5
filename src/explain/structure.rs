//! From masks back to choices: the body of a loop as statements.
//!
//! What a register holds after a position is a chain of `select`s. Where both sides of one go back to a common value,
//! that value is stored first and the choice is a statement that changes it or does not: a sequence of `if`s, as
//! the trees were written. Statements of different registers under the same condition are put together. Since a
//! listing's registers are read as the position before left them, their order does not matter.

use std::collections::{BTreeSet, HashMap};
use std::rc::Rc;

use vsonar_ir::{Block, Leaf, Loop, Op, Reg};

/// A statement over the registers of the program's body.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Step {
    /// A carried register takes this value.
    Assign(u8, Reg),
    /// The loop ends here.
    Stop,
    /// A mask that is no `not`, what is done where it holds, and where not.
    If(Reg, Vec<Step>, Vec<Step>),
}

/// The statements of a loop's body.
pub(super) fn steps(l: &Loop) -> Vec<Step> {
    let mut steps = Vec::new();
    for (k, next) in l.next().iter().enumerate() {
        let Some(next) = *next else { continue };
        merge(&mut steps, Planner::new(l.body(), k as u8).target(next));
    }
    if let Some(mask) = l.break_if() {
        let mut conditions = HashMap::new();
        collect(&steps, 0, &mut conditions);
        merge(&mut steps, stop(l.body(), mask, true, &conditions));
    }
    steps
}

/// The mask without the `not`s around it, and whether it is meant as it stands.
pub(super) fn strip(block: &Block, mut mask: Reg, mut holds: bool) -> (Reg, bool) {
    while block.inst(mask).op() == Op::Not {
        mask = block.inst(mask).args()[0];
        holds = !holds;
    }
    (mask, holds)
}

fn choice(block: &Block, mask: Reg, holds: bool, then: Vec<Step>, or_else: Vec<Step>) -> Vec<Step> {
    if then.is_empty() && or_else.is_empty() {
        return Vec::new();
    }
    match strip(block, mask, holds) {
        (mask, true) => vec![Step::If(mask, then, or_else)],
        (mask, false) => vec![Step::If(mask, or_else, then)],
    }
}

/// What makes one register's next value.
struct Planner<'a> {
    block: &'a Block,
    register: u8,
    reached: HashMap<Reg, Rc<BTreeSet<Reg>>>,
    /// How many more statements there may be: shared choices are written out each time they are come to.
    left: usize,
}

impl<'a> Planner<'a> {
    fn new(block: &'a Block, register: u8) -> Planner<'a> {
        Planner { block, register, reached: HashMap::new(), left: 0 }
    }

    fn target(&mut self, value: Reg) -> Vec<Step> {
        let selects = self.reach(value).len();
        self.left = 3 * selects + 8;
        // Where choices are shared too much to be written out, they are values with names.
        self.plan(value, None).unwrap_or_else(|| vec![Step::Assign(self.register, value)])
    }

    /// The choices that a value may come from, itself included.
    fn reach(&mut self, value: Reg) -> Rc<BTreeSet<Reg>> {
        if let Some(known) = self.reached.get(&value) {
            return Rc::clone(known);
        }
        let inst = self.block.inst(value);
        let mut set = BTreeSet::new();
        if inst.op() == Op::Select {
            set.insert(value);
            for side in [inst.args()[1], inst.args()[2]] {
                set.extend(self.reach(side).iter().copied());
            }
        }
        let set = Rc::new(set);
        self.reached.insert(value, Rc::clone(&set));
        set
    }

    /// The statements after which the register holds `value` if it held `before` (what the position before left, if
    /// none is given); `None` if they are too many.
    fn plan(&mut self, value: Reg, before: Option<Reg>) -> Option<Vec<Step>> {
        let inst = self.block.inst(value);
        let unchanged = before == Some(value);
        if unchanged || (before.is_none() && inst.leaf() == Some(Leaf::Read(self.register))) {
            return Some(Vec::new());
        }
        self.left = self.left.checked_sub(1)?;
        if inst.op() != Op::Select {
            return Some(vec![Step::Assign(self.register, value)]);
        }
        let [mask, x, y] = [inst.args()[0], inst.args()[1], inst.args()[2]];
        let (from_x, from_y) = (self.reach(x), self.reach(y));
        let common = from_x.intersection(&from_y).max().copied().filter(|&c| Some(c) != before);
        let (mut steps, before) = match common {
            Some(common) => (self.plan(common, before)?, Some(common)),
            None => (Vec::new(), before),
        };
        let (then, or_else) = (self.plan(x, before)?, self.plan(y, before)?);
        steps.extend(choice(self.block, mask, true, then, or_else));
        Some(steps)
    }
}

/// The conditions of statements, each with how deep it first stands.
fn collect(steps: &[Step], depth: usize, out: &mut HashMap<Reg, usize>) {
    for step in steps {
        if let Step::If(mask, then, or_else) = step {
            let first = out.entry(*mask).or_insert(depth);
            *first = (*first).min(depth);
            collect(then, depth + 1, out);
            collect(or_else, depth + 1, out);
        }
    }
}

/// Stops where the mask holds (or does not): taken apart where a part of it is a condition of other statements, of two
/// such parts by the outer one.
fn stop(block: &Block, mask: Reg, holds: bool, conditions: &HashMap<Reg, usize>) -> Vec<Step> {
    let (mask, holds) = strip(block, mask, holds);
    let whole = || choice(block, mask, holds, vec![Step::Stop], Vec::new());
    let inst = block.inst(mask);
    if conditions.contains_key(&mask) || !matches!(inst.op(), Op::And | Op::Or) {
        return whole();
    }
    let [p, q] = [inst.args()[0], inst.args()[1]];
    let depth = |part: Reg| conditions.get(&strip(block, part, true).0);
    let (part, rest) = match (depth(p), depth(q)) {
        (None, None) => return whole(),
        (None, Some(_)) => (q, p),
        (Some(outer), Some(inner)) if inner < outer => (q, p),
        _ => (p, q),
    };
    let rest = stop(block, rest, holds, conditions);
    // With `holds` as the sign of both parts, one of them is enough, or both are needed.
    if (inst.op() == Op::Or) == holds {
        choice(block, part, holds, vec![Step::Stop], rest)
    } else {
        choice(block, part, holds, rest, Vec::new())
    }
}

/// Adds the statements of another register (or of `stop`), under conditions that are there already where possible.
fn merge(steps: &mut Vec<Step>, others: Vec<Step>) {
    let mut from = 0;
    for other in others {
        let Step::If(mask, then, or_else) = other else {
            steps.push(other);
            from = steps.len();
            continue;
        };
        let same = |step: &Step| matches!(step, Step::If(m, ..) if *m == mask);
        let Some(at) = steps[from..].iter().position(same).map(|i| from + i) else {
            steps.push(Step::If(mask, then, or_else));
            from = steps.len();
            continue;
        };
        if let Step::If(_, have_then, have_else) = &mut steps[at] {
            merge(have_then, then);
            merge(have_else, or_else);
        }
        // What follows may stand in no earlier place than this.
        from = at + 1;
    }
}
