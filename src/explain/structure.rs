//! From masks back to choices: the body of a loop as statements.
//!
//! What a register holds after a position is a chain of `select`s. Where both sides of one go back to a common value,
//! that value is stored first and the choice is a statement that changes it or does not: a sequence of `if`s, as
//! the trees were written. Statements of different registers under the same condition are put together. Since a
//! listing's registers are read as the position before left them, their order does not matter.

use std::collections::{BTreeMap, HashMap};

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

/// The same without choices between statements: values, and where it ends. This is flat however the choices are nested.
pub(super) fn values(l: &Loop) -> Vec<Step> {
    let mut steps = Vec::new();
    for (k, next) in l.next().iter().enumerate() {
        steps.extend(next.map(|next| Step::Assign(k as u8, next)));
    }
    if let Some(mask) = l.break_if() {
        steps.extend(choice(l.body(), mask, true, vec![Step::Stop], Vec::new()));
    }
    steps
}

/// What may be looked at in all to find common values.
const WORK: usize = 20_000_000;

/// What makes one register's next value.
struct Planner<'a> {
    block: &'a Block,
    register: u8,
    /// How many more statements there may be: shared choices are written out each time they are come to.
    left: usize,
    /// What may still be looked at.
    work: usize,
}

impl<'a> Planner<'a> {
    fn new(block: &'a Block, register: u8) -> Planner<'a> {
        Planner { block, register, left: 0, work: WORK }
    }

    fn target(&mut self, value: Reg) -> Vec<Step> {
        self.left = 3 * self.choices(value) + 8;
        // Where choices are shared too much to be written out, they are values with names.
        self.plan(value, None).unwrap_or_else(|| vec![Step::Assign(self.register, value)])
    }

    /// The two values of a choice.
    fn sides(&self, value: Reg) -> Option<[Reg; 2]> {
        let inst = self.block.inst(value);
        (inst.op() == Op::Select).then(|| [inst.args()[1], inst.args()[2]])
    }

    /// How many choices a value may come from, itself included.
    fn choices(&self, value: Reg) -> usize {
        let mut seen = vec![false; self.block.len()];
        let mut open = vec![value];
        let mut count = 0;
        while let Some(reg) = open.pop() {
            if let Some(sides) = self.sides(reg)
                && !std::mem::replace(&mut seen[reg.index()], true)
            {
                count += 1;
                open.extend(sides);
            }
        }
        count
    }

    /// The last choice that both values come from, if there is one; `None` outside if that takes too long to find.
    fn common(&mut self, x: Reg, y: Reg) -> Option<Option<Reg>> {
        const BOTH: u8 = 3;
        // Choices still to be followed, and from which of the values they are come to. A value's operands have lesser
        // numbers than itself, so that of the greatest all ways to it are known.
        let mut open: BTreeMap<Reg, u8> = BTreeMap::new();
        let mut from = [0usize; 2];
        let mut next = vec![(x, 1), (y, 2)];
        loop {
            for (reg, ways) in next.drain(..).filter(|(reg, _)| self.sides(*reg).is_some()) {
                let known = open.entry(reg).or_default();
                (0..2).filter(|i| ways & !*known & (1 << i) != 0).for_each(|i| from[i] += 1);
                *known |= ways;
            }
            if from.contains(&0) {
                return Some(None);
            }
            self.work = self.work.checked_sub(1)?;
            let Some((reg, ways)) = open.pop_last() else { return Some(None) };
            if ways == BOTH {
                return Some(Some(reg));
            }
            (0..2).filter(|i| ways & (1 << i) != 0).for_each(|i| from[i] -= 1);
            next.extend(self.sides(reg).into_iter().flatten().map(|side| (side, ways)));
        }
    }

    /// The statements after which the register holds `value` if it held `before` (what the position before left, if
    /// none is given); `None` if they are too many.
    fn plan(&mut self, mut value: Reg, before: Option<Reg>) -> Option<Vec<Step>> {
        // A sequence of choices, from the last one back.
        let mut choices = Vec::new();
        let mut steps = loop {
            let inst = self.block.inst(value);
            let unchanged = before == Some(value);
            if unchanged || (before.is_none() && inst.leaf() == Some(Leaf::Read(self.register))) {
                break Vec::new();
            }
            self.left = self.left.checked_sub(1)?;
            if inst.op() != Op::Select {
                break vec![Step::Assign(self.register, value)];
            }
            let [mask, x, y] = [inst.args()[0], inst.args()[1], inst.args()[2]];
            let common = self.common(x, y)?.filter(|&c| Some(c) != before);
            choices.push((mask, x, y, common.or(before)));
            match common {
                Some(common) => value = common,
                None => break Vec::new(),
            }
        };
        for (mask, x, y, before) in choices.into_iter().rev() {
            let (then, or_else) = (self.plan(x, before)?, self.plan(y, before)?);
            steps.extend(choice(self.block, mask, true, then, or_else));
        }
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
