//! Random well-formed programs, for tests of passes and back ends.
//!
//! A generator knows nothing of what is right: it only makes programs. Operations are drawn from the table, so
//! a new operation is generated as soon as it has its row.

use crate::builder::{Builder, LoopParts};
use crate::op::{Leaf, Op, Ty};
use crate::program::{Block, Direction, Program, Reg, Span};
use crate::window::{Operand, Rect};

/// A small generator of random numbers (SplitMix64, Steele, Lea and Flood 2014).
#[derive(Debug, Clone)]
pub struct Random(u64);

impl Random {
    /// A generator for this seed.
    pub const fn new(seed: u64) -> Random {
        Random(seed)
    }

    /// 64 random bits.
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// A number below `n`, which must not be 0.
    pub fn below(&mut self, n: usize) -> usize {
        (self.bits() % n as u64) as usize
    }

    /// Whether an event of probability 1 in `n` happens.
    pub fn one_in(&mut self, n: usize) -> bool {
        self.below(n) == 0
    }

    /// One of the elements.
    ///
    /// # Panics
    /// If there is none.
    pub fn pick<T: Copy>(&mut self, from: &[T]) -> T {
        from[self.below(from.len())]
    }

    /// A binary32: often a special value, often a plain one, sometimes any bit pattern.
    pub fn f32(&mut self) -> f32 {
        match self.below(4) {
            0 => self.pick(&SPECIAL),
            1 => self.below(512) as f32 - 128.0,
            2 => (self.below(20_001) as f32 - 10_000.0) / 64.0,
            _ => f32::from_bits(self.bits() as u32),
        }
    }
}

/// Values at which binary32 arithmetic differs from that of the reals.
pub const SPECIAL: [f32; 22] = [
    0.0,
    -0.0,
    1.0,
    -1.0,
    2.0,
    0.5,
    -2.0,
    3.0,
    -0.3,
    10.0,
    255.0,
    1e-45,
    -1e-45,
    1.1e-38,
    -1.1e-38,
    f32::MIN_POSITIVE,
    f32::MAX,
    f32::MIN,
    f32::INFINITY,
    f32::NEG_INFINITY,
    f32::NAN,
    16_777_216.0,
];

/// A random program for images of `width` x `height` pixels whose blocks have about `size` instructions.
///
/// ```
/// use vsonar_ir::{generate, text};
/// let program = generate::program(7, 64, 48, 20);
/// assert_eq!(text::parse(&text::print(&program)), Ok(program));
/// ```
pub fn program(seed: u64, width: u32, height: u32, size: usize) -> Program {
    let random = &mut Random::new(seed);
    let has_first = !random.one_in(3);
    let first = has_first.then(|| random_loop(random, false, size));
    let second = random_loop(random, has_first, size);
    Program::new(width, height, first, second)
        .unwrap_or_else(|fault| panic!("seed {seed}: the generator made a malformed program: {fault}"))
}

fn random_loop(random: &mut Random, iter2: bool, size: usize) -> LoopParts {
    let column_size = if random.one_in(2) { 0 } else { random.below(8) };
    let column = if random.one_in(2) {
        let mut b = Builder::new();
        b.leaf(Leaf::XObstacle);
        b.finish()
    } else {
        block(random, column_size, |leaf| leaf.in_column(), iter2)
    };
    let size = random.below(size.max(1)) + 1;
    let body = block(random, size, |_| true, iter2);
    let of = |block: &Block, ty| -> Vec<Reg> {
        block.iter().filter(|(_, inst)| inst.op().result() == ty).map(|(reg, _)| reg).collect()
    };
    let (floats, masks) = (of(&body, Ty::F32), of(&body, Ty::Mask));
    let next = std::array::from_fn(|_| (!random.one_in(4)).then(|| late(random, &floats)));
    let break_if = (!masks.is_empty() && random.one_in(2)).then(|| late(random, &masks));
    LoopParts {
        direction: random.pick(&[Direction::Up, Direction::Down]),
        rect: Rect::from_index(random.below(Rect::COUNT)).unwrap_or_else(|| unreachable!("below the count")),
        span: if random.one_in(8) { Span::Last } else { Span::All },
        column_result: late(random, &of(&column, Ty::F32)),
        column,
        body,
        invariant: 0,
        uniform: 0,
        next,
        break_if,
    }
}

/// One of the later registers, so that most of a block is used.
fn late(random: &mut Random, regs: &[Reg]) -> Reg {
    let from = if random.one_in(3) { 0 } else { regs.len() * 2 / 3 };
    random.pick(&regs[from..])
}

fn block(random: &mut Random, size: usize, allowed: impl Fn(Leaf) -> bool, iter2: bool) -> Block {
    let mut b = Builder::new();
    b.leaf(Leaf::Const(random.f32()));
    let formulas: Vec<Op> = Op::ALL.iter().copied().filter(|op| !op.is_leaf()).collect();
    let leaves: Vec<Op> = Op::ALL.iter().copied().filter(|op| op.is_leaf()).collect();
    while b.insts().len() <= size {
        if random.one_in(3) {
            let op = random.pick(&leaves);
            let leaf = random_leaf(random, op);
            if allowed(leaf) && (iter2 || !matches!(leaf, Leaf::Iter2(_))) {
                b.leaf(leaf);
            }
            continue;
        }
        let op = random.pick(&formulas);
        if op == Op::ToBits {
            // The bits of a NaN are unspecified, so random programs must not look at them.
            continue;
        }
        let operand = |random: &mut Random, ty: Ty| {
            let regs: Vec<Reg> =
                (0..b.insts().len() as u32).map(Reg).filter(|reg| b.ty(*reg) == ty).collect();
            (!regs.is_empty()).then(|| late(random, &regs))
        };
        let args: Option<Vec<Reg>> = op.operands().iter().map(|ty| operand(random, *ty)).collect();
        let imm = if op.has_shift() { random.below(32) as u32 } else { 0 };
        if let Some(args) = args {
            b.push_imm(op, &args, imm)
                .unwrap_or_else(|fault| unreachable!("operands were chosen by type: {fault}"));
        }
    }
    b.finish()
}

fn random_leaf(random: &mut Random, op: Op) -> Leaf {
    match op {
        Op::Const => Leaf::Const(random.f32()),
        Op::IConst => Leaf::IConst(random.bits() as i32),
        Op::MConst => Leaf::MConst(random.one_in(2)),
        Op::Read => Leaf::Read(random.below(5) as u8),
        Op::Iter2 => Leaf::Iter2(random.below(5) as u8),
        Op::Window => {
            let index = random.below(Operand::COUNT) as u32;
            Leaf::decode(op, index).unwrap_or_else(|| unreachable!("below the count"))
        }
        _ => Leaf::decode(op, 0).unwrap_or_else(|| unreachable!("the leaf has no payload")),
    }
}

/// Window averages that are different at every place, for programs that run on no real image: a hash of the
/// place, within the operand's range, whole or with a fraction.
pub fn windows(seed: u64) -> impl Fn(crate::WindowAt) -> f32 {
    move |at| {
        let place = (u64::from(at.x) << 32 | u64::from(at.y)) ^ (u64::from(at.operand.index()) << 58);
        let bits = Random::new(seed ^ place ^ (at.rect.index() as u64) << 24).bits();
        let area = u64::from(at.rect.area());
        let largest = at.operand.max() * area;
        // A sum over the window, divided as the language does; often zero, for the protected divisions, and at
        // times the largest or the least other there is, where ranges end.
        let sum = match bits >> 60 {
            0 => 0,
            1 => largest,
            2 => 1,
            _ => bits % (largest + 1),
        };
        sum as f32 / area as f32
    }
}
