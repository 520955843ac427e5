//! One walk down each block: fold constants, decide what the intervals decide, apply the algebraic table, reuse equal
//! values.

use crate::op::{Leaf, Op, Ty};
use crate::opt::gvn::{self, Numbering};
use crate::opt::interval::Interval;
use crate::opt::ranges::{self, Leaves};
use crate::opt::{algebra, choice, columns, fold};
use crate::program::{Block, Column, Inst, Loop, Program, Reg};

/// Simplifies every block of a program; whether anything changed.
pub fn run(program: &mut Program, writer: &mut Writer, columns: &mut columns::Columns) -> bool {
    let (width, height) = (program.width, program.height);
    let mut changed = false;
    // Without a first loop nothing can read its registers.
    let (mut iter2, mut iter2_same) = ([Interval::ZERO; 5], SELF);
    for l in program.first.iter_mut().chain(std::iter::once(&mut program.second)) {
        let same = Same { iter2: iter2_same, read: twins(l) };
        writer.leaves = Leaves::new(l, width, height, iter2);
        changed |= writer.rewrite_column(&mut l.column, |leaf| same.leaf(leaf));
        writer.leaves.enter(writer.values[l.column.result.index()], width);
        changed |= name_column(l, writer.leaves.x) || columns::run(l, width, columns);
        writer.leaves.find_reads(l, &mut writer.scratch);
        changed |= writer.rewrite_body(l, |leaf| same.leaf(leaf));
        // At least one position is visited, so the last one's values are all there are.
        iter2 = l.next.map(|next| next.map_or(Interval::ZERO, |reg| writer.values[reg.index()]));
        iter2_same = twins(l);
    }
    changed
}

/// A column expression that is resolved to one column is that column's number.
fn name_column(l: &mut Loop, x: Interval) -> bool {
    let leaf = Leaf::Const(x.lo);
    if x.lo != x.hi || l.column.as_leaf().map(Leaf::encode) == Some(leaf.encode()) {
        return false;
    }
    l.column.set(leaf);
    true
}

/// Each register's own number.
const SELF: [u8; 5] = [0, 1, 2, 3, 4];

/// For each carried register the first one that takes the same value after every position: all start alike, so
/// they are always equal.
fn twins(l: &Loop) -> [u8; 5] {
    SELF.map(|k| (0..k).find(|&j| l.next[j as usize] == l.next[k as usize]).unwrap_or(k))
}

/// Registers that stand for their equals.
struct Same {
    iter2: [u8; 5],
    read: [u8; 5],
}

impl Same {
    fn leaf(&self, leaf: Leaf) -> Leaf {
        match leaf {
            Leaf::Iter2(k) => Leaf::Iter2(self.iter2[k as usize]),
            Leaf::Read(k) => Leaf::Read(self.read[k as usize]),
            _ => leaf,
        }
    }
}

/// How many rewrites may follow from each other; what would take more stays as it is.
const MAX_DEPTH: usize = 64;

/// A block being written, with what is known of its registers.
#[derive(Debug, Default)]
pub struct Writer {
    insts: Vec<Inst>,
    values: Vec<Interval>,
    numbering: Numbering,
    map: Vec<Reg>,
    /// The intervals of the leaves of the block.
    pub leaves: Leaves,
    /// Space for intervals of other blocks.
    pub scratch: Vec<Interval>,
    /// How many rewrites are under way, each for the sake of the one before.
    depth: usize,
    /// How many instructions a block may have for choices to be taken apart in it.
    room: usize,
    /// Whether one was not taken apart because of that.
    full: bool,
}

impl Writer {
    /// Rewrites `block` into this writer, passing each leaf through `leaf` first. Returns where each of the
    /// block's registers is now.
    fn rewrite(&mut self, block: &Block, leaf: impl Fn(Leaf) -> Leaf) -> &[Reg] {
        self.insts.clear();
        self.values.clear();
        self.numbering.clear(block.len());
        self.map.clear();
        for inst in block.insts() {
            let reg = match inst.leaf() {
                Some(l) => self.leaf(leaf(l)),
                None => self.push(inst.renumber(&self.map)),
            };
            self.map.push(reg);
        }
        &self.map
    }

    /// Rewrites a column expression in its place, passing each leaf through `leaf`; whether that changes it.
    pub fn rewrite_column(&mut self, column: &mut Column, leaf: impl Fn(Leaf) -> Leaf) -> bool {
        let map = self.rewrite(&column.block, leaf);
        let before = column.result;
        column.result = map[before.index()];
        self.replace(&mut column.block) || before != column.result
    }

    /// Rewrites a body in its place, passing each leaf through `leaf`; whether that changes it.
    pub fn rewrite_body(&mut self, l: &mut Loop, leaf: impl Fn(Leaf) -> Leaf) -> bool {
        let map = self.rewrite(&l.body, leaf);
        l.renumber_results(map);
        let changed = self.replace(&mut l.body);
        if changed {
            // What was computed out of order may stand anywhere; regions are split again at the end.
            (l.invariant_end, l.uniform_end) = (0, 0);
        }
        changed
    }

    /// Exchanges what was written with `block`; whether that changes it.
    fn replace(&mut self, block: &mut Block) -> bool {
        let changed = self.insts != block.insts();
        if changed {
            std::mem::swap(&mut self.insts, block.insts_mut());
        }
        changed
    }

    /// The register of a leaf.
    pub fn leaf(&mut self, leaf: Leaf) -> Reg {
        let value = self.leaves.of(leaf);
        let (op, imm) = leaf.encode();
        let (op, imm) = value.constant(op.result()).map_or((op, imm), Leaf::encode);
        let inst = Inst::new(op, [Reg(0); 3], imm);
        self.numbering.find(&inst, &self.insts).unwrap_or_else(|| self.append(inst, value))
    }

    /// The register of an operation's value, simplified. The operands are registers of this writer.
    pub fn push(&mut self, inst: Inst) -> Reg {
        let inst = gvn::canonical(inst, self.may_exchange(&inst), |reg| self.constant(reg).is_some());
        // What stands there has been through all of this.
        if let Some(reg) = self.numbering.find(&inst, &self.insts) {
            return reg;
        }
        if let Some(constant) = fold::fold(&inst, |i| self.constant(inst.args()[i])) {
            return self.leaf(constant);
        }
        let value = ranges::of_operation(&inst, |reg| self.value(reg));
        if let Some(constant) = value.constant(inst.op().result()) {
            return self.leaf(constant);
        }
        if let Some(operand) = self.decided(&inst) {
            return inst.args()[operand];
        }
        if inst.op() == Op::PDiv && !self.value(inst.args()[1]).may_be_zero() {
            return self.push(Inst::new(Op::Div, [inst.args()[0], inst.args()[1], Reg(0)], 0));
        }
        if self.depth < MAX_DEPTH {
            self.depth += 1;
            let rewritten = algebra::apply(self, &inst).or_else(|| choice::apply(self, &inst));
            self.depth -= 1;
            if let Some(reg) = rewritten {
                return reg;
            }
        }
        self.append(inst, value)
    }

    /// Whether the first two operands may change places: always, or where the intervals say so.
    fn may_exchange(&self, inst: &Inst) -> bool {
        match inst.op() {
            Op::Min | Op::Max => self.value(inst.args()[0]).equal_is_same(self.value(inst.args()[1])),
            op => op.is_commutative(),
        }
    }

    /// Which operand a choice always takes, if the intervals decide.
    fn decided(&self, inst: &Inst) -> Option<usize> {
        let value = |i: usize| self.value(inst.args()[i]);
        match inst.op() {
            Op::Select | Op::ISelect => {
                let chosen = value(0);
                (chosen.lo == chosen.hi).then_some(if chosen.lo == 1.0 { 1 } else { 2 })
            }
            Op::Min => {
                let (a, b) = (value(0), value(1));
                if a.lo >= b.hi { Some(1) } else { (a.hi <= b.lo && a.equal_is_same(b)).then_some(0) }
            }
            Op::Max => {
                let (a, b) = (value(0), value(1));
                if a.hi <= b.lo { Some(1) } else { (a.lo >= b.hi && a.equal_is_same(b)).then_some(0) }
            }
            _ => None,
        }
    }

    /// Sets how many instructions a block may have, those included that nobody will read, for choices to be taken
    /// apart in it.
    pub const fn set_room(&mut self, room: usize) {
        (self.room, self.full) = (room, false);
    }

    /// Whether there was too little room since it was set.
    pub const fn was_full(&self) -> bool {
        self.full
    }

    /// Whether there is room left, which the caller would take.
    pub const fn take_room(&mut self) -> bool {
        self.full |= self.insts.len() >= self.room;
        !self.full
    }

    /// The constant a register holds, if it is one.
    pub fn constant(&self, reg: Reg) -> Option<Leaf> {
        let inst = &self.insts[reg.index()];
        matches!(inst.op(), Op::Const | Op::IConst | Op::MConst).then(|| inst.leaf()).flatten()
    }

    /// The instruction that defines a register.
    pub fn inst(&self, reg: Reg) -> &Inst {
        &self.insts[reg.index()]
    }

    /// What is known of a register's value.
    pub fn value(&self, reg: Reg) -> Interval {
        self.values[reg.index()]
    }

    fn append(&mut self, inst: Inst, value: Interval) -> Reg {
        debug_assert!(
            inst.op().result() != Ty::Mask || value.lo >= 0.0 && value.hi <= 1.0,
            "{inst:?} {value:?}"
        );
        let reg = Reg(self.insts.len() as u32);
        self.insts.push(inst);
        self.values.push(value);
        self.numbering.insert_last(&self.insts);
        reg
    }
}
