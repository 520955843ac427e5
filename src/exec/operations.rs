//! Every operation on special values in every place of a program, for tests of the executors.

use vsonar_ir::builder::LoopParts;
use vsonar_ir::generate::SPECIAL;
use vsonar_ir::machine::Scalar;
use vsonar_ir::op::Value;
use vsonar_ir::{Builder, Direction, Leaf, Op, Program, Rect, Reg, Span, Ty};

use crate::vision::LANES;

/// Where the operation under test stands.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Place {
    /// In the loop, operands different in each lane.
    Varying,
    /// Before the loop, operands different in each lane.
    Invariant,
    /// In the loop, once for all lanes, on constants.
    Uniform,
    /// In a column expression.
    Column,
}

/// Operand bits for a type: special values, which as bit patterns are special integers too.
fn samples(ty: Ty) -> Vec<u32> {
    match ty {
        Ty::F32 => SPECIAL.iter().map(|v| v.to_bits()).collect(),
        Ty::I32 => {
            let own =
                [0, 1, -1, 2, 31, 1 << 23, i32::MAX, i32::MIN, 0x5555_5555, -77].map(i32::cast_unsigned);
            own.into_iter().chain([1.5f32.to_bits(), f32::INFINITY.to_bits()]).collect()
        }
        Ty::Mask => vec![0, 1],
    }
}

/// All combinations of operands.
fn combinations(op: Op) -> Vec<Vec<u32>> {
    op.operands().iter().fold(vec![vec![]], |all, &ty| {
        all.iter().flat_map(|head| samples(ty).into_iter().map(move |v| [&head[..], &[v]].concat())).collect()
    })
}

/// The operation's meaning: the result's bits, a mask's as 0 or 1.
fn meaning(op: Op, args: &[u32], imm: u32) -> u32 {
    let args: Vec<Value<Scalar>> = args
        .iter()
        .zip(op.operands())
        .map(|(&bits, ty)| match ty {
            Ty::F32 => Value::F32(f32::from_bits(bits)),
            Ty::I32 => Value::I32(bits.cast_signed()),
            Ty::Mask => Value::Mask(bits == 1),
        })
        .collect();
    match op.apply(&mut Scalar, &args, imm).expect("no leaf") {
        Value::F32(v) => v.to_bits(),
        Value::I32(v) => v.cast_unsigned(),
        Value::Mask(v) => u32::from(v),
    }
}

/// A leaf or two that stand for an operand.
fn operand(b: &mut Builder, ty: Ty, number: usize, constant: Option<u32>) -> Reg {
    let build = |b: &mut Builder, op, args: &[Reg]| b.push(op, args).expect("well typed");
    match (ty, constant) {
        (Ty::F32, Some(bits)) => b.leaf(Leaf::Const(f32::from_bits(bits))),
        (Ty::I32, Some(bits)) => b.leaf(Leaf::IConst(bits.cast_signed())),
        (Ty::Mask, Some(bits)) => b.leaf(Leaf::MConst(bits == 1)),
        (_, None) => {
            let value = b.leaf(Leaf::Iter2(number as u8));
            match ty {
                Ty::F32 => value,
                Ty::I32 => build(b, Op::ToBits, &[value]),
                Ty::Mask => {
                    let zero = b.leaf(Leaf::Const(0.0));
                    build(b, Op::Lt, &[zero, value])
                }
            }
        }
    }
}

/// A program whose answer (or second column's value) is the operation's result.
fn program(op: Op, imm: u32, place: Place, constants: Option<&[u32]>) -> Program {
    let mut b = Builder::new();
    let args: Vec<Reg> = op
        .operands()
        .iter()
        .enumerate()
        .map(|(i, &ty)| operand(&mut b, ty, i, constants.map(|c| c[i])))
        .collect();
    let value = b.push_imm(op, &args, imm).expect("well typed");
    let value = match op.result() {
        Ty::F32 => value,
        Ty::I32 => b.push(Op::FromBits, &[value]).expect("well typed"),
        Ty::Mask => {
            let (one, zero) = (b.leaf(Leaf::Const(1.0)), b.leaf(Leaf::Const(0.0)));
            b.push(Op::Select, &[value, one, zero]).expect("well typed")
        }
    };
    let mut leaf = Builder::new();
    let own = leaf.leaf(Leaf::XObstacle);
    let (column, column_result) =
        if place == Place::Column { (b.block(), value) } else { (leaf.finish(), own) };
    let (body, next) = if place == Place::Column {
        let mut b = Builder::new();
        let y = b.leaf(Leaf::Y);
        (b.finish(), y)
    } else {
        (b.finish(), value)
    };
    let len = body.len();
    let parts = |column, column_result, body, next, invariant, uniform| LoopParts {
        direction: Direction::Down,
        rect: Rect::new(3, 3).expect("in the list"),
        span: Span::All,
        column,
        column_result,
        body,
        invariant,
        uniform,
        next: [Some(next), None, None, None, None],
        break_if: None,
    };
    let mut b = Builder::new();
    let x = b.leaf(Leaf::XObstacle);
    let first = parts(b.block(), x, b.block(), x, 0, 0);
    let invariant = if place == Place::Invariant { len } else { 0 };
    let uniform = if place == Place::Uniform { len } else { 0 };
    let second = parts(column, column_result, body, next, invariant, uniform);
    Program::new(16, 16, Some(first), second).expect("well formed")
}

fn check(op: Op, imm: u32, args: &[u32], found: f32, what: &str) {
    let expected = meaning(op, args, imm);
    let found = match op.result() {
        Ty::Mask => u32::from(found == 1.0),
        _ => found.to_bits(),
    };
    let nan = |bits| f32::from_bits(bits).is_nan();
    let same = expected == found || op.result() == Ty::F32 && nan(expected) && nan(found);
    assert!(same, "{} {args:08x?} {imm} {what}: {found:08x}, not {expected:08x}", op.name());
}

/// What an executor makes of operands, by lane.
pub(crate) trait Subject {
    /// The value that the program's second loop or, in [`Place::Column`], its column expression has in each lane, with
    /// these final registers of the first loop.
    fn run(&mut self, program: &Program, place: Place, iter2: &[[f32; LANES]; 5]) -> [f32; LANES];
}

/// The final registers of a first loop that stand for one group of operands.
fn registers(op: Op, group: &[Vec<u32>]) -> [[f32; LANES]; 5] {
    let mut out = [[0.0; LANES]; 5];
    for lane in 0..LANES {
        let args = &group[lane.min(group.len() - 1)];
        for (i, (&bits, &ty)) in args.iter().zip(op.operands()).enumerate() {
            out[i][lane] = if ty == Ty::Mask { bits as f32 } else { f32::from_bits(bits) };
        }
    }
    out
}

/// Holds every operation against its meaning on numbers, bit for bit.
pub(crate) fn check_all(subject: &mut impl Subject, name: &str) {
    let mut compared = 0usize;
    for &op in Op::ALL.iter().filter(|op| !op.is_leaf()) {
        // The bits of a NaN are unspecified.
        let known = |args: &Vec<u32>| op != Op::ToBits || !f32::from_bits(args[0]).is_nan();
        let seen: Vec<Vec<u32>> = combinations(op).into_iter().filter(known).collect();
        let shifts: &[u32] = if op.has_shift() { &[0, 1, 7, 23, 31] } else { &[0] };
        for &imm in shifts {
            for place in [Place::Varying, Place::Invariant, Place::Column] {
                let program = program(op, imm, place, None);
                for group in seen.chunks(LANES) {
                    let found = subject.run(&program, place, &registers(op, group));
                    for (lane, args) in group.iter().enumerate() {
                        check(op, imm, args, found[lane], &format!("{name} {place:?}"));
                        compared += 1;
                    }
                }
            }
            for args in &seen {
                let program = program(op, imm, Place::Uniform, Some(args));
                let found = subject.run(&program, Place::Uniform, &[[0.0; LANES]; 5]);
                for lane in [0, LANES - 1] {
                    check(op, imm, args, found[lane], &format!("{name} uniform"));
                    compared += 1;
                }
            }
        }
    }
    assert!(compared > 5_000, "only {compared} comparisons");
}
