//! Expansion: functions ([`Op::function`]: minimum, protected division, trigonometry) are written out as the machine's own
//! operations.
//!
//! The formulas are instantiated over a machine whose values are registers of the block being written, so the
//! expansion is by construction the formula that defines the operation.

use crate::builder::Builder;
use crate::machine::Machine;
use crate::op::{Leaf, Op, Ty, Value};
use crate::program::{Block, Program, Reg};

/// Expands every block; whether anything changed. Regions stay as they are.
pub fn run(program: &mut Program) -> bool {
    let mut changed = false;
    for l in program.first.iter_mut().chain(std::iter::once(&mut program.second)) {
        if let Some((block, map, _)) = expand(&l.column.block, [0; 2]) {
            l.column.block = block;
            l.column.result = map[l.column.result.index()];
            changed = true;
        }
        if let Some((block, map, ends)) = expand(&l.body, [l.invariant_end, l.uniform_end]) {
            l.body = block;
            l.next = l.next.map(|next| next.map(|reg| map[reg.index()]));
            l.break_if = l.break_if.map(|reg| map[reg.index()]);
            [l.invariant_end, l.uniform_end] = ends;
            changed = true;
        }
    }
    changed
}

/// How many of the machine's own operations an operation is made of; none for a leaf.
pub fn steps(op: Op) -> usize {
    let mut writer = Registers { builder: Builder::new() };
    let operand = |writer: &mut Registers, ty: &Ty| match ty {
        Ty::F32 => writer.builder.leaf(Leaf::XObstacle),
        Ty::I32 => writer.builder.leaf(Leaf::IConst(0)),
        Ty::Mask => writer.builder.leaf(Leaf::MConst(true)),
    };
    let args: Vec<Reg> = op.operands().iter().map(|ty| operand(&mut writer, ty)).collect();
    if !op.is_leaf() {
        writer.operation(op, args.into_iter(), 0);
    }
    writer.builder.insts().iter().filter(|inst| !inst.op().is_leaf()).count()
}

/// The expanded block, where each register is in it, and where the `ends` of regions are; `None` if nothing
/// had to be expanded.
fn expand(block: &Block, ends: [u32; 2]) -> Option<(Block, Vec<Reg>, [u32; 2])> {
    if block.insts().iter().all(|inst| inst.op().function().is_none()) {
        return None;
    }
    let mut writer = Registers { builder: Builder::new() };
    let mut map = Vec::with_capacity(block.len());
    let mut new_ends = [0; 2];
    for (reg, inst) in block.iter() {
        for (end, new_end) in ends.iter().zip(&mut new_ends) {
            if *end == reg.0 {
                *new_end = writer.builder.insts().len() as u32;
            }
        }
        let value = match inst.leaf() {
            Some(leaf) => writer.builder.leaf(leaf),
            None => writer.operation(inst.op(), inst.args().iter().map(|arg| map[arg.index()]), inst.imm()),
        };
        map.push(value);
    }
    for (end, new_end) in ends.iter().zip(&mut new_ends) {
        if *end as usize == block.len() {
            *new_end = writer.builder.insts().len() as u32;
        }
    }
    Some((writer.builder.finish(), map, new_ends))
}

/// The machine that writes instructions.
struct Registers {
    builder: Builder,
}

impl Registers {
    fn operation(&mut self, op: Op, args: impl Iterator<Item = Reg>, imm: u32) -> Reg {
        let values: Vec<Value<Registers>> = args
            .map(|reg| match self.builder.ty(reg) {
                Ty::F32 => Value::F32(reg),
                Ty::I32 => Value::I32(reg),
                Ty::Mask => Value::Mask(reg),
            })
            .collect();
        match op.apply(self, &values, imm) {
            Some(Value::F32(reg) | Value::I32(reg) | Value::Mask(reg)) => reg,
            None => unreachable!("leaves are written by the caller"),
        }
    }

    fn push(&mut self, op: Op, args: &[Reg], imm: u32) -> Reg {
        // The machine's methods have the types of the operations they stand for.
        self.builder.push_imm(op, args, imm).unwrap_or_else(|fault| unreachable!("{fault}"))
    }
}

macro_rules! instructions {
    ($($method:ident($($arg:ident),*) = $op:ident;)*) => {
        $( fn $method(&mut self, $($arg: Reg),*) -> Reg { self.push(Op::$op, &[$($arg),*], 0) } )*
    };
}

impl Machine for Registers {
    type F = Reg;
    type I = Reg;
    type M = Reg;

    fn f32(&mut self, value: f32) -> Reg {
        self.builder.leaf(Leaf::Const(value))
    }
    fn i32(&mut self, value: i32) -> Reg {
        self.builder.leaf(Leaf::IConst(value))
    }
    fn mask(&mut self, value: bool) -> Reg {
        self.builder.leaf(Leaf::MConst(value))
    }
    fn ishl(&mut self, a: Reg, bits: u32) -> Reg {
        self.push(Op::IShl, &[a], bits)
    }
    fn iushr(&mut self, a: Reg, bits: u32) -> Reg {
        self.push(Op::IUshr, &[a], bits)
    }
    instructions! {
        add(a, b) = Add; sub(a, b) = Sub; mul(a, b) = Mul; div(a, b) = Div;
        lt(a, b) = Lt; le(a, b) = Le; eq(a, b) = Eq;
        select(m, a, b) = Select; iselect(m, a, b) = ISelect;
        and(a, b) = And; or(a, b) = Or; not(a) = Not;
        to_bits(a) = ToBits; from_bits(a) = FromBits;
        iadd(a, b) = IAdd; isub(a, b) = ISub; iand(a, b) = IAnd; ior(a, b) = IOr; ixor(a, b) = IXor;
        ieq(a, b) = IEq; ilt(a, b) = ILt;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn functions_alone_are_made_of_several_steps() {
        for &op in Op::ALL {
            let expected = usize::from(!op.is_leaf());
            let steps = steps(op);
            assert!(
                if op.function().is_some() { steps > 1 } else { steps == expected },
                "{}: {steps}",
                op.name()
            );
        }
    }
}
