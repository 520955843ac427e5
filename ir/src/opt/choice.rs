//! Operations on a choice (`select`) of which one side needs no computing.
//!
//! * A comparison that one of the sides decides, by its interval, is the choice's mask and the other side's
//!   comparison: of `a <= select p x y` with `a <= y` always false, `p` and `a <= x` is left.
//! * An operation on a choice of constants, all else constant, is a choice of results.
//!
//! Where many comparisons look at one chain of choices, each takes the chain apart for itself. What all of them take
//! together grows as the square of the program, wherefore there is only so much [room](Writer::set_room).

use crate::op::{Leaf, Op, Ty};
use crate::opt::fold;
use crate::opt::interval::Interval;
use crate::opt::ranges;
use crate::opt::simplify::Writer;
use crate::program::{Inst, Reg};

/// The register that stands for an operation on a choice, if it can be taken apart.
pub fn apply(writer: &mut Writer, inst: &Inst) -> Option<Reg> {
    let chooses = |reg: &Reg| writer.inst(*reg).op() == Op::Select;
    if inst.op() == Op::Select {
        return None;
    }
    let position = inst.args().iter().position(chooses)?;
    let another = inst.args()[position + 1..].iter().any(chooses);
    if !writer.take_room() {
        return None;
    }
    match inst.op() {
        Op::Lt | Op::Le | Op::Eq => {
            // Where both are choices the second may do.
            compare(writer, inst, position).or_else(|| if another { compare(writer, inst, 1) } else { None })
        }
        _ => constants(writer, inst, position),
    }
}

/// The instruction with another operand.
fn with(inst: &Inst, position: usize, operand: Reg) -> Inst {
    let mut args = [Reg(0); 3];
    args[..inst.args().len()].copy_from_slice(inst.args());
    args[position] = operand;
    Inst::new(inst.op(), args, inst.imm())
}

fn compare(writer: &mut Writer, inst: &Inst, position: usize) -> Option<Reg> {
    let choice = *writer.inst(inst.args()[position]);
    let [mask, x, y] = [choice.args()[0], choice.args()[1], choice.args()[2]];
    let sides = [x, y].map(|side| with(inst, position, side));
    let decided = sides.map(|side| match writer.infer(&side).constant(Ty::Mask) {
        Some(Leaf::MConst(value)) => Some(value),
        _ => None,
    });
    let (op, mask_holds, side) = match decided {
        [Some(true), Some(true)] => return Some(writer.leaf(Leaf::MConst(true))),
        [Some(false), Some(false)] => return Some(writer.leaf(Leaf::MConst(false))),
        [Some(true), Some(false)] => return Some(mask),
        [Some(false), Some(true)] => return Some(writer.not(mask)),
        [Some(true), None] => (Op::Or, true, 1),
        [Some(false), None] => (Op::And, false, 1),
        [None, Some(true)] => (Op::Or, false, 0),
        [None, Some(false)] => (Op::And, true, 0),
        [None, None] => return None,
    };
    let other = writer.push(sides[side]);
    let mask = if mask_holds { mask } else { writer.not(mask) };
    Some(writer.push(Inst::new(op, [mask, other, Reg(0)], 0)))
}

fn constants(writer: &mut Writer, inst: &Inst, position: usize) -> Option<Reg> {
    if inst.op().result() != Ty::F32 {
        return None;
    }
    let choice = *writer.inst(inst.args()[position]);
    let side = |i: usize| {
        let side = with(inst, position, choice.args()[i]);
        fold::fold(&side, |i| writer.constant(side.args()[i]))
    };
    let (x, y) = (side(1)?, side(2)?);
    let (x, y) = (writer.leaf(x), writer.leaf(y));
    Some(writer.push(Inst::new(Op::Select, [choice.args()[0], x, y], 0)))
}

impl Writer {
    fn not(&mut self, mask: Reg) -> Reg {
        self.push(Inst::new(Op::Not, [mask, Reg(0), Reg(0)], 0))
    }

    fn infer(&self, inst: &Inst) -> Interval {
        ranges::of_operation(inst, |reg| self.value(reg))
    }
}
