//! The registers of a block while it is emitted.

use cranelift_codegen::ir;
use vsonar_ir::machine::Machine;
use vsonar_ir::op::Value;
use vsonar_ir::{Inst, Op, Reg, Ty};

use super::emit::{Emitter, Shape};
use super::homes::{Home, Homes};

/// Blocks of more instructions are emitted in parts ([`Homes`]) …
pub(super) const LONG: usize = 1000;
/// … of about so many of Cranelift's instructions.
const PART: usize = 200;

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

/// What is in memory of a block that is emitted in parts.
struct Parts {
    homes: Homes,
    /// Where each register waits, if it does.
    at: Vec<Option<Home>>,
    /// The number of the last instruction that reads each register; results are read after all of them.
    last_use: Vec<usize>,
    /// Registers below keep their homes: they are read in every row.
    pinned: usize,
    /// Registers with values in the current part; some may be there twice.
    touched: Vec<Reg>,
    /// How many of Cranelift's instructions there were when the part began.
    began: usize,
}

impl Parts {
    fn new(e: &mut Emitter<'_, '_>, insts: &[Inst], results: impl Iterator<Item = Reg>) -> Parts {
        let mut last_use = vec![0; insts.len()];
        for (i, inst) in insts.iter().enumerate() {
            inst.args().iter().for_each(|arg| last_use[arg.index()] = i);
        }
        results.for_each(|reg| last_use[reg.index()] = usize::MAX);
        let began = e.b.func.dfg.num_insts();
        let at = vec![None; insts.len()];
        Parts { homes: Homes::new(e), at, last_use, pinned: 0, touched: Vec::new(), began }
    }
}

/// The registers of a block while it is emitted.
pub(super) struct Frame<'p> {
    pub(super) insts: &'p [Inst],
    pub(super) slots: Vec<Slot>,
    pub(super) carried: [Option<ir::Value>; 5],
    /// Where the block is long.
    parts: Option<Parts>,
}

impl<'p> Frame<'p> {
    /// The registers of a block about to be emitted, of which `results` are read after it.
    pub(super) fn new(
        e: &mut Emitter<'_, '_>,
        insts: &'p [Inst],
        results: impl Iterator<Item = Reg>,
    ) -> Frame<'p> {
        let parts = (insts.len() > LONG).then(|| Parts::new(e, insts, results));
        Frame { insts, slots: vec![Slot::default(); insts.len()], carried: [None; 5], parts }
    }

    /// To be called before each instruction: ends the current part where it is long enough.
    pub(super) fn before(&mut self, e: &mut Emitter<'_, '_>, next: Reg) {
        if self.parts.as_ref().is_some_and(|parts| e.b.func.dfg.num_insts() - parts.began >= PART) {
            self.end_part(e, next);
        }
    }

    /// Ends the region that stands before the loop; `next` is the first register after it.
    pub(super) fn end_invariant(&mut self, e: &mut Emitter<'_, '_>, next: Reg) {
        self.end_part(e, next);
        if let Some(parts) = &mut self.parts {
            parts.pinned = next.index();
        }
    }

    /// Where the block is emitted in parts: puts the values that are read from `next` on into memory.
    fn end_part(&mut self, e: &mut Emitter<'_, '_>, next: Reg) {
        let Some(parts) = &mut self.parts else { return };
        for reg in parts.touched.drain(..) {
            let slot = std::mem::take(&mut self.slots[reg.index()]);
            let home = &mut parts.at[reg.index()];
            if parts.last_use[reg.index()] >= next.index() {
                // What is one value for all lanes is spread over them again.
                if let (None, Some(value)) = (&home, slot.scalar.or(slot.lanes)) {
                    *home = Some(parts.homes.store(e, value));
                }
            } else if reg.index() >= parts.pinned
                && let Some(home) = home.take()
            {
                parts.homes.release(home);
            }
        }
        parts.homes.begin_part(e);
        parts.began = e.b.func.dfg.num_insts();
    }

    /// Loads a register from its home, if it has one and no value in this part.
    fn fetch(&mut self, e: &mut Emitter<'_, '_>, reg: Reg) {
        let slot = self.slots[reg.index()];
        let Some(parts) = self.parts.as_mut().filter(|_| slot.scalar.is_none() && slot.lanes.is_none())
        else {
            return;
        };
        if let Some(home) = parts.at[reg.index()] {
            let value = parts.homes.load(e, home);
            let shape = if home.is_vector() { Shape::Lanes4 } else { Shape::Scalar };
            self.set(reg, shape, value);
        }
    }

    pub(super) fn set(&mut self, reg: Reg, shape: Shape, value: ir::Value) {
        if let Some(parts) = &mut self.parts {
            parts.touched.push(reg);
        }
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
        self.fetch(e, reg);
        let slot = self.slots[reg.index()];
        if let Some(value) = slot.of(e.shape()) {
            return value;
        }
        let scalar = slot.scalar.expect("registers are defined in order, and per row only from per row");
        if ty == Ty::Mask && self.parts.is_none() {
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
