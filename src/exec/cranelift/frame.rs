//! The registers of a block while it is emitted.

use cranelift_codegen::ir;
use vsonar_ir::machine::Machine;
use vsonar_ir::op::Value;
use vsonar_ir::{Inst, Op, Reg, Ty};

use super::emit::{Emitter, Shape};

/// A register's value while a block is emitted: for one case, in lanes, or both.
#[derive(Clone, Copy, Default)]
pub(super) struct Slot {
    pub(super) scalar: Option<ir::Value>,
    pub(super) lanes: Option<ir::Value>,
}

impl Slot {
    pub(super) fn of(self, shape: Shape) -> Option<ir::Value> {
        match shape {
            Shape::Scalar => self.scalar,
            Shape::Lanes4 => self.lanes,
        }
    }
}

/// The registers of a block while it is emitted.
pub(super) struct Frame<'p> {
    pub(super) insts: &'p [Inst],
    pub(super) slots: Vec<Slot>,
    pub(super) carried: [Option<ir::Value>; 5],
}

impl<'p> Frame<'p> {
    pub(super) fn new(insts: &'p [Inst]) -> Frame<'p> {
        Frame { insts, slots: vec![Slot::default(); insts.len()], carried: [None; 5] }
    }

    pub(super) fn set(&mut self, reg: Reg, shape: Shape, value: ir::Value) {
        let slot = &mut self.slots[reg.index()];
        match shape {
            Shape::Scalar => slot.scalar = Some(value),
            Shape::Lanes4 => slot.lanes = Some(value),
        }
    }

    /// A register in the emitter's shape. Constants are made where they are used, values of one case spread
    /// over the lanes where lanes are asked for.
    pub(super) fn get(&mut self, e: &mut Emitter<'_, '_>, reg: Reg) -> ir::Value {
        let inst = self.insts[reg.index()];
        let ty = inst.op().result();
        if let Some(bits) = constant(inst) {
            return e.constant(ty, bits);
        }
        let slot = self.slots[reg.index()];
        if let Some(value) = slot.of(e.shape()) {
            return value;
        }
        let scalar = slot.scalar.expect("registers are defined in order, and per row only from per row");
        if ty == Ty::Mask {
            // To compare again, in lanes, is cheaper than to turn a truth value into a mask.
            self.mask_in_lanes(e, reg);
            return self.slots[reg.index()].lanes.unwrap_or(scalar);
        }
        let value = e.splat(ty, scalar);
        self.set(reg, Shape::Lanes4, value);
        value
    }

    /// Emits a mask, of which there is only the truth value of one case, once more in lanes, after the masks that it
    /// is made of. They are as many as the program likes, so this does not recur.
    fn mask_in_lanes(&mut self, e: &mut Emitter<'_, '_>, reg: Reg) {
        let mut wanted = vec![reg];
        while let Some(&last) = wanted.last() {
            let before = wanted.len();
            let made_of = self.insts[last.index()].args().iter().copied();
            wanted.extend(made_of.filter(|arg| {
                let inst = self.insts[arg.index()];
                let there = constant(inst).is_some() || self.slots[arg.index()].lanes.is_some();
                inst.op().result() == Ty::Mask && !there
            }));
            if wanted.len() == before {
                wanted.pop();
                if self.slots[last.index()].lanes.is_none() {
                    self.operation(e, last);
                }
            }
        }
    }

    /// Emits an operation.
    pub(super) fn operation(&mut self, e: &mut Emitter<'_, '_>, reg: Reg) {
        let inst = self.insts[reg.index()];
        let zero = Value::I32(ir::Value::from_u32(0));
        let mut args = [zero; 3];
        for (slot, (&arg, &ty)) in args.iter_mut().zip(inst.args().iter().zip(inst.op().operands())) {
            *slot = Emitter::wrap(ty, self.get(e, arg));
        }
        let value = e.operation(inst.op(), &args[..inst.args().len()], inst.imm());
        self.set(reg, e.shape(), Emitter::unwrap(value));
    }

    /// Emits a carried register as the row finds it: the block's parameter, or 0 where it is never written.
    pub(super) fn read(&mut self, e: &mut Emitter<'_, '_>, reg: Reg, register: u8) {
        let value = self.carried[usize::from(register)].unwrap_or_else(|| e.f32(0.0));
        self.set(reg, e.shape(), value);
    }
}

/// The bits of a constant leaf.
pub(super) fn constant(inst: Inst) -> Option<u32> {
    matches!(inst.op(), Op::Const | Op::IConst | Op::MConst).then_some(inst.imm())
}
