//! Programs: two loops, each a header, a column block and a body of three regions.

use crate::op::{Depends, Leaf, Op};
use crate::window::{Operand, Rect};

/// A register: the result of the instruction of this number in its block.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Reg(pub u32);

impl Reg {
    /// The instruction's position in its block.
    pub const fn index(self) -> usize {
        self.0 as usize
    }
}

impl std::fmt::Display for Reg {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "v{}", self.0)
    }
}

/// One instruction: an operation, its operand registers, and an immediate (a leaf's payload or a shift count).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Inst {
    op: Op,
    args: [Reg; 3],
    imm: u32,
}

impl Inst {
    pub(crate) const fn new(op: Op, args: [Reg; 3], imm: u32) -> Inst {
        Inst { op, args, imm }
    }

    /// The instruction of a leaf.
    pub(crate) fn of(leaf: Leaf) -> Inst {
        let (op, imm) = leaf.encode();
        Inst::new(op, [Reg(0); 3], imm)
    }

    /// The operation.
    pub const fn op(&self) -> Op {
        self.op
    }

    /// The operand registers, as many as the operation has.
    pub fn args(&self) -> &[Reg] {
        &self.args[..self.op.operands().len()]
    }

    /// The immediate: zero where the operation has none.
    pub const fn imm(&self) -> u32 {
        self.imm
    }

    /// What the instruction stands for, if it is a leaf.
    #[inline]
    pub fn leaf(&self) -> Option<Leaf> {
        if self.op.is_leaf() { Leaf::decode(self.op, self.imm) } else { None }
    }

    /// The instruction with its operands where `map` says they are.
    pub(crate) fn renumber(&self, map: &[Reg]) -> Inst {
        let mut inst = *self;
        for arg in &mut inst.args[..self.op.operands().len()] {
            *arg = map[arg.index()];
        }
        inst
    }

    /// A hash for tables, well mixed in its upper half.
    pub(crate) const fn mix(&self) -> u64 {
        let a = (self.op as u64) << 56 ^ (self.args[0].0 as u64) << 28 ^ self.args[1].0 as u64;
        let b = (self.args[2].0 as u64) << 32 ^ self.imm as u64;
        mix(mix(0, a), b)
    }
}

/// One step of a hash of 64-bit words (a 128-bit product, folded).
pub(crate) const fn mix(hash: u64, word: u64) -> u64 {
    const ODD: u64 = 0x9e37_79b9_7f4a_7c15;
    let product = ((hash ^ word) as u128 + 1) * ODD as u128;
    (product as u64) ^ (product >> 64) as u64
}

/// A straight line of instructions; instruction i defines register i, from registers below i.
#[derive(Debug, Clone, Default, PartialEq, Eq, Hash)]
pub struct Block {
    insts: Vec<Inst>,
}

impl Block {
    pub(crate) const fn from_insts(insts: Vec<Inst>) -> Block {
        Block { insts }
    }

    /// The instructions in order.
    pub fn insts(&self) -> &[Inst] {
        &self.insts
    }

    /// The instructions, for passes to rewrite in place.
    pub(crate) const fn insts_mut(&mut self) -> &mut Vec<Inst> {
        &mut self.insts
    }

    /// The instruction that defines a register.
    ///
    /// # Panics
    /// If the register is not of this block.
    pub fn inst(&self, reg: Reg) -> Inst {
        self.insts[reg.index()]
    }

    /// Registers and their instructions in order.
    pub fn iter(&self) -> impl DoubleEndedIterator<Item = (Reg, Inst)> + '_ {
        self.insts.iter().enumerate().map(|(i, inst)| (Reg(i as u32), *inst))
    }

    /// How many instructions.
    pub fn len(&self) -> usize {
        self.insts.len()
    }

    /// Whether there is no instruction.
    pub fn is_empty(&self) -> bool {
        self.insts.is_empty()
    }

    /// What each register's value may change with, by register number.
    pub fn dependences(&self) -> Vec<Depends> {
        let mut out: Vec<Depends> = Vec::with_capacity(self.len());
        for inst in &self.insts {
            let own = inst.leaf().map_or(Depends::NOTHING, Leaf::depends);
            let all = inst.args().iter().fold(own, |d, arg| d.join(out[arg.index()]));
            out.push(all);
        }
        out
    }
}

/// The way an iteration goes. Rows count from the top of the image.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Direction {
    /// From the largest row to the smallest.
    Up,
    /// From the smallest row to the largest.
    Down,
}

impl Direction {
    /// The name in program text.
    pub const fn name(self) -> &'static str {
        match self {
            Direction::Up => "up",
            Direction::Down => "down",
        }
    }
}

/// Which positions of the iteration are visited.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Span {
    /// Every row at which the rectangle lies wholly inside the image.
    All,
    /// The last of them alone: what the optimiser leaves of a loop whose result depends on nothing else.
    Last,
}

/// The part of a body an instruction stands in. A body lists its regions in this order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Region {
    /// Computed once for each lane, before the loop.
    Invariant,
    /// Computed once for each row, the same in every lane.
    Uniform,
    /// Computed for every lane at every row.
    Varying,
}

impl Region {
    /// The three regions in order.
    pub const ALL: [Region; 3] = [Region::Invariant, Region::Uniform, Region::Varying];

    /// The name in program text.
    pub const fn name(self) -> &'static str {
        match self {
            Region::Invariant => "invariant",
            Region::Uniform => "uniform",
            Region::Varying => "varying",
        }
    }

    /// The earliest region in which a value that changes with `depends` can stand.
    pub fn earliest(depends: Depends) -> Region {
        if depends.within(Depends::LANE) {
            Region::Invariant
        } else if depends.within(Depends::ROW) {
            Region::Uniform
        } else {
            Region::Varying
        }
    }
}

/// The expression for the column in which a loop iterates, evaluated once for each lane before the loop. Its
/// value is rounded and clamped by [`Rect::resolve_column`].
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Column {
    pub(crate) block: Block,
    pub(crate) result: Reg,
}

impl Column {
    /// The instructions: no window, no position, no carried register.
    pub const fn block(&self) -> &Block {
        &self.block
    }

    /// The register that holds the value, an f32.
    pub const fn result(&self) -> Reg {
        self.result
    }

    /// Makes a leaf the whole expression.
    pub(crate) fn set(&mut self, leaf: Leaf) {
        self.block.insts.clear();
        self.block.insts.push(Inst::of(leaf));
        self.result = Reg(0);
    }

    /// The leaf that the whole expression is, if it is one.
    pub fn as_leaf(&self) -> Option<Leaf> {
        self.block.inst(self.result).leaf()
    }
}

/// One loop over the rows of a column.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Loop {
    pub(crate) direction: Direction,
    pub(crate) rect: Rect,
    pub(crate) span: Span,
    pub(crate) column: Column,
    pub(crate) body: Block,
    pub(crate) invariant_end: u32,
    pub(crate) uniform_end: u32,
    pub(crate) next: [Option<Reg>; 5],
    pub(crate) break_if: Option<Reg>,
}

impl Loop {
    /// The way the rectangle moves.
    pub const fn direction(&self) -> Direction {
        self.direction
    }

    /// The rectangle's size.
    pub const fn rect(&self) -> Rect {
        self.rect
    }

    /// Which positions are visited.
    pub const fn span(&self) -> Span {
        self.span
    }

    /// The column expression.
    pub const fn column(&self) -> &Column {
        &self.column
    }

    /// The body's instructions, all three regions in order.
    pub const fn body(&self) -> &Block {
        &self.body
    }

    /// The registers of a region, as a range of instruction numbers of the body.
    pub const fn region(&self, region: Region) -> std::ops::Range<usize> {
        let (a, b) = (self.invariant_end as usize, self.uniform_end as usize);
        match region {
            Region::Invariant => 0..a,
            Region::Uniform => a..b,
            Region::Varying => b..self.body.insts.len(),
        }
    }

    /// The region an instruction of the body stands in.
    pub const fn region_of(&self, reg: Reg) -> Region {
        if reg.0 < self.invariant_end {
            Region::Invariant
        } else if reg.0 < self.uniform_end {
            Region::Uniform
        } else {
            Region::Varying
        }
    }

    /// For each carried register the value it takes after a position. `None`: the register is never written
    /// and stays 0. All carried registers start at 0.
    pub const fn next(&self) -> &[Option<Reg>; 5] {
        &self.next
    }

    /// The break mask: where it holds, the loop ends after this position (the carried registers having taken
    /// their next values). `None`: the loop visits all its positions.
    pub const fn break_if(&self) -> Option<Reg> {
        self.break_if
    }

    /// The rows of the window's centre that are visited in an image `height` pixels high, in order.
    pub fn rows(&self, height: u32) -> impl Iterator<Item = u32> + use<> {
        let (lo, hi) = self.rect.rows(height);
        let (direction, span) = (self.direction, self.span);
        let (lo, hi) = match (span, direction) {
            (Span::All, _) => (lo, hi),
            (Span::Last, Direction::Up) => (lo, lo),
            (Span::Last, Direction::Down) => (hi, hi),
        };
        (lo..=hi).map(move |y| if direction == Direction::Up { lo + hi - y } else { y })
    }

    /// The value of `first-window` at the first position visited: 1, or -1 if only the last of several
    /// positions is visited.
    pub fn first_window_at_start(&self, height: u32) -> f32 {
        if self.span == Span::Last && self.rect.positions(height) > 1 { -1.0 } else { 1.0 }
    }

    /// The window operands the body reads, each once, in the order of their numbers.
    pub fn operands(&self) -> Vec<Operand> {
        let used = self.body.insts.iter().filter_map(|inst| match inst.leaf() {
            Some(Leaf::Window(operand)) => Some(operand.index()),
            _ => None,
        });
        let bits = used.fold(0u32, |bits, index| bits | 1 << index);
        Operand::all().filter(|o| bits >> o.index() & 1 == 1).collect()
    }

    /// Says where the body's results are now.
    pub(crate) fn renumber_results(&mut self, map: &[Reg]) {
        self.next = self.next.map(|next| next.map(|reg| map[reg.index()]));
        self.break_if = self.break_if.map(|reg| map[reg.index()]);
    }

    /// The first loop's final registers that the column expression or the body reads, by number.
    pub fn reads_first_loop(&self) -> [bool; 5] {
        let mut out = [false; 5];
        for inst in self.body.insts.iter().chain(self.column.block.insts()) {
            if let Some(Leaf::Iter2(k)) = inst.leaf() {
                out[k as usize] = true;
            }
        }
        out
    }
}

/// A whole detector for images of one size.
///
/// The answer is the final register `a` of the second loop. The first loop is absent where nothing of it is
/// read (and for individuals of a single tree); its final registers then count as 0.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Program {
    pub(crate) width: u32,
    pub(crate) height: u32,
    pub(crate) first: Option<Loop>,
    pub(crate) second: Loop,
}

impl Program {
    /// The smallest image side, in pixels.
    pub const MIN_SIDE: u32 = 16;
    /// The largest image side, in pixels.
    pub const MAX_SIDE: u32 = 1 << 16;

    /// Whether there can be programs for images of `width` x `height` pixels: each side is
    /// [`Program::MIN_SIDE`] to [`Program::MAX_SIDE`].
    pub const fn fits(width: u32, height: u32) -> bool {
        let (min, max) = (Program::MIN_SIDE, Program::MAX_SIDE);
        width >= min && width <= max && height >= min && height <= max
    }

    /// Width of the images, in pixels.
    pub const fn width(&self) -> u32 {
        self.width
    }

    /// Height of the images, in pixels.
    pub const fn height(&self) -> u32 {
        self.height
    }

    /// The first loop, if anything of it is needed.
    pub const fn first(&self) -> Option<&Loop> {
        self.first.as_ref()
    }

    /// The second loop, whose final `a` is the answer.
    pub const fn second(&self) -> &Loop {
        &self.second
    }

    /// The loops that are there, in the order they run.
    pub fn loops(&self) -> impl Iterator<Item = &Loop> {
        self.first.iter().chain(std::iter::once(&self.second))
    }

    /// How many instructions all blocks hold together, leaves included.
    pub fn len(&self) -> usize {
        self.loops().map(|l| l.body.len() + l.column.block.len()).sum()
    }

    /// Whether the program holds no instruction; never true, since a column has one.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// How many instructions compute something: all but the leaves.
    pub fn operations(&self) -> usize {
        let blocks = self.loops().flat_map(|l| [&l.body, &l.column.block]);
        blocks.flat_map(Block::insts).filter(|inst| !inst.op.is_leaf()).count()
    }

    /// The answer, where it is the same for every image and column: the second loop never writes `a`, or
    /// writes the same constant at every position (there is at least one).
    pub fn constant_answer(&self) -> Option<f32> {
        let Some(next) = self.second.next[0] else { return Some(0.0) };
        match self.second.body.inst(next).leaf() {
            Some(Leaf::Const(value)) => Some(value),
            _ => None,
        }
    }
}
