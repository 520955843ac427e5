//! From a loop of the IR to steps: where each register is, and what runs when.
//!
//! Invariant instructions run once for a group of cases. Uniform ones run once for a program, with *positions* as
//! lanes; their results become tables, from which a row's value is spread over the lanes. Varying ones run at every
//! row; their slots are used again once nobody reads them any more, so that a program stays in the first-level
//! cache. A window operand costs no step: whoever uses it reads the strips.

use vsonar_ir::program::Region;
use vsonar_ir::{Inst, Leaf, Loop, Op, Operand, Reg, Ty};

use super::rows::{Final, Spread, WindowUse};
use super::slots::{self, SlotId, Slots};
use super::steps::Step;

/// A loop as steps. Its vectors are used again from program to program.
#[derive(Debug, Default)]
pub(super) struct LoopPlan {
    /// Computes the column expression, if that takes any step.
    pub(super) column: Vec<Step>,
    /// Where it leaves the column, if it is neither the case's own nor a constant.
    pub(super) column_value: Option<SlotId>,
    /// Once for a group.
    pub(super) invariant: Vec<Step>,
    /// Once for each position, with positions as lanes.
    pub(super) uniform: Vec<Step>,
    /// The slots of uniform values that become tables, as many as `spreads`.
    pub(super) tables: Vec<SlotId>,
    /// Where rows and first-window flags of the positions go before the uniform steps.
    pub(super) position_slots: Option<[SlotId; 2]>,
    /// At every row.
    pub(super) varying: Vec<Step>,
    pub(super) windows: Vec<WindowUse>,
    /// The addresses of the tables are for whoever fills them to set.
    pub(super) spreads: Vec<Spread>,
    pub(super) finals: Vec<Final>,
    pub(super) break_if: Option<*const f32>,
    /// Carried registers that the loop writes.
    pub(super) written: [bool; 5],
    /// Whether anything reads the window's centre column.
    pub(super) uses_x: bool,
    /// The operands that are read, each once.
    pub(super) operands: Vec<Operand>,
}

/// Where a register's value is.
#[derive(Debug, Clone, Copy, Default)]
enum Place {
    #[default]
    Nowhere,
    /// In a slot, for every lane.
    Slot(SlotId),
    /// In a slot while uniform steps run, and then spread into another, once a varying step has asked.
    Uniform(SlotId, Option<SlotId>),
    /// In the strips.
    Window(Operand),
}

/// How long a register is needed: the number of its last reader.
const FOREVER: usize = usize::MAX;

/// Makes plans; scratch space that is used again.
#[derive(Debug, Default)]
pub(super) struct Planner {
    /// Runs once for a program: masks that are constants.
    pub(super) prologue: Vec<Step>,
    next: u32,
    places: Vec<Place>,
    last_use: Vec<usize>,
    /// Slots of varying values that are needed no more.
    idle: Vec<SlotId>,
    zero: Option<SlotId>,
    one: Option<SlotId>,
}

/// How many slots the plans of these loops take at most.
pub(super) fn slots_needed<'a>(loops: impl Iterator<Item = &'a Loop>) -> usize {
    let all: usize = loops.map(|l| 4 * l.body().len() + l.column().block().len() + 16).sum();
    slots::FREE.0 as usize + all
}

impl Planner {
    /// Forgets the last program. The slots are reserved for the plans of the next one.
    pub(super) fn begin(&mut self, slots: &mut Slots) {
        self.prologue.clear();
        self.next = slots::FREE.0;
        (self.zero, self.one) = (None, None);
        for k in 0..5 {
            slots.splat(slots::carried(k), 0);
            slots.splat(slots::iter2(k), 0);
        }
    }

    /// Fills the plan of a loop whose wanted final registers are these.
    pub(super) fn plan(&mut self, l: &Loop, wanted: &[bool; 5], slots: &mut Slots, plan: &mut LoopPlan) {
        plan.clear();
        self.column(l, slots, plan);
        self.find_last_uses(l);
        self.places.clear();
        self.idle.clear();
        plan.written = l.next().map(|next| next.is_some());
        plan.operands = l.operands();
        let direct = self.direct_writes(l);
        for (reg, inst) in l.body().iter() {
            let place = match inst.leaf() {
                Some(leaf) => self.leaf(leaf, slots, plan),
                None => self.operation(reg, inst, l, &direct, slots, plan),
            };
            self.places.push(place);
        }
        self.assign(l, &direct, slots, plan);
        for k in (0..5).filter(|&k| wanted[k]) {
            let (from, to) = (slots.pointer(slots::carried(k)), slots.pointer(slots::out(k)));
            plan.finals.push(Final { from, to });
        }
        if let Some(reg) = l.break_if() {
            let slot = self.in_lanes(reg, Ty::Mask, slots, plan);
            plan.break_if = Some(slots.pointer(slot).cast_const());
        }
    }

    fn column(&mut self, l: &Loop, slots: &mut Slots, plan: &mut LoopPlan) {
        let column = l.column();
        if matches!(column.as_leaf(), Some(Leaf::XObstacle | Leaf::Const(_))) {
            return;
        }
        self.places.clear();
        for (_, inst) in column.block().iter() {
            let place = match inst.leaf() {
                Some(leaf) => self.leaf(leaf, slots, plan),
                None => {
                    let slot = self.fresh();
                    let mut step = new_step(&inst, slots.pointer(slot));
                    for (arg, reg) in step.args.iter_mut().zip(inst.args()) {
                        *arg = slots.pointer(self.slot_of(*reg));
                    }
                    plan.column.push(step);
                    Place::Slot(slot)
                }
            };
            self.places.push(place);
        }
        plan.column_value = Some(self.slot_of(column.result()));
    }

    fn find_last_uses(&mut self, l: &Loop) {
        self.last_use.clear();
        for (i, inst) in l.body().insts().iter().enumerate() {
            self.last_use.push(i);
            for arg in inst.args() {
                self.last_use[arg.index()] = i;
            }
        }
        for reg in l.next().iter().flatten().chain(&l.break_if()) {
            self.last_use[reg.index()] = FOREVER;
        }
    }

    /// The varying instructions that may write a carried register at once: those whose register is read by no
    /// later instruction.
    fn direct_writes(&self, l: &Loop) -> [Option<Reg>; 5] {
        let mut last_read = [0; 5];
        for (reg, inst) in l.body().iter() {
            if let Some(Leaf::Read(k)) = inst.leaf() {
                last_read[k as usize] = last_read[k as usize].max(self.last_use[reg.index()]);
            }
        }
        let mut direct: [Option<Reg>; 5] = [None; 5];
        for k in 0..5 {
            let candidate = l.next()[k].filter(|&reg| {
                let varying = l.region_of(reg) == Region::Varying && !l.body().inst(reg).op().is_leaf();
                varying && last_read[k] <= reg.index() && !direct.contains(&Some(reg))
            });
            direct[k] = candidate;
        }
        direct
    }

    fn leaf(&mut self, leaf: Leaf, slots: &mut Slots, plan: &mut LoopPlan) -> Place {
        let slot = match leaf {
            Leaf::Const(value) => self.constant(value.to_bits(), slots),
            Leaf::IConst(value) => self.constant(value.cast_unsigned(), slots),
            Leaf::MConst(value) => self.constant_mask(value, slots),
            Leaf::XObstacle => slots::X_OBSTACLE,
            Leaf::X => {
                plan.uses_x = true;
                slots::X
            }
            Leaf::Iter2(k) => slots::iter2(k.into()),
            Leaf::Read(k) => slots::carried(k.into()),
            Leaf::Window(operand) => return Place::Window(operand),
            Leaf::Y | Leaf::FirstWindow => {
                let [y, first] = *plan.position_slots.get_or_insert_with(|| [self.fresh(), self.fresh()]);
                return Place::Uniform(if leaf == Leaf::Y { y } else { first }, None);
            }
        };
        Place::Slot(slot)
    }

    fn operation(
        &mut self,
        reg: Reg,
        inst: Inst,
        l: &Loop,
        direct: &[Option<Reg>; 5],
        slots: &mut Slots,
        plan: &mut LoopPlan,
    ) -> Place {
        if l.region_of(reg) == Region::Varying {
            let mut step = new_step(&inst, std::ptr::null_mut());
            let windows = plan.windows.len();
            for (i, &arg) in inst.args().iter().enumerate() {
                step.args[i] = self.varying_operand(arg, &inst, i, slots, plan);
            }
            // Steps that spread a mask may have come before this one.
            let number = plan.varying.len() as u32;
            plan.windows[windows..].iter_mut().for_each(|window| window.step = number);
            // What dies here makes room for the result, since a step reads each vector before it writes it; but
            // masks lie closer than numbers, so that their slots would be written ahead of the reading.
            self.free(reg, &inst, |ty| ty != Ty::Mask, l, direct);
            let slot = match direct.iter().position(|&d| d == Some(reg)) {
                Some(k) => slots::carried(k),
                None => self.idle.pop().unwrap_or_else(|| self.fresh()),
            };
            self.free(reg, &inst, |ty| ty == Ty::Mask, l, direct);
            step.to = slots.pointer(slot);
            plan.varying.push(step);
            return Place::Slot(slot);
        }
        let slot = self.fresh();
        let mut step = new_step(&inst, slots.pointer(slot));
        for (arg, from) in step.args.iter_mut().zip(inst.args()) {
            *arg = slots.pointer(self.slot_of(*from));
        }
        if l.region_of(reg) == Region::Invariant {
            plan.invariant.push(step);
            Place::Slot(slot)
        } else {
            plan.uniform.push(step);
            Place::Uniform(slot, None)
        }
    }

    /// Gives back the slots of an instruction's operands, of some types, that nobody reads after it.
    fn free(
        &mut self,
        reg: Reg,
        inst: &Inst,
        of_type: impl Fn(Ty) -> bool,
        l: &Loop,
        direct: &[Option<Reg>; 5],
    ) {
        for (i, arg) in inst.args().iter().enumerate() {
            let dies = self.last_use[arg.index()] == reg.index() && !inst.args()[..i].contains(arg);
            let own = l.region_of(*arg) == Region::Varying
                && !l.body().inst(*arg).op().is_leaf()
                && !direct.contains(&Some(*arg));
            if let Place::Slot(slot) = self.places[arg.index()]
                && dies
                && own
                && of_type(inst.op().operands()[i])
            {
                self.idle.push(slot);
            }
        }
    }

    /// Assigns the carried registers that are not written directly, all at once in effect.
    fn assign(&mut self, l: &Loop, direct: &[Option<Reg>; 5], slots: &mut Slots, plan: &mut LoopPlan) {
        let mut moves: [Option<Step>; 5] = [None; 5];
        for k in 0..5 {
            let Some(reg) = l.next()[k].filter(|_| direct[k].is_none()) else { continue };
            let inst = l.body().inst(reg);
            if inst.leaf() == Some(Leaf::Read(k as u8)) {
                continue;
            }
            let copy = copy_step(slots.pointer(slots::carried(k)));
            if let Place::Window(operand) = self.places[reg.index()] {
                // Nothing else reads or moves it; the copy may as well be made now or later.
                moves[k] = Some(Step { imm: u32::from(operand.index()), op: Op::Window, ..copy });
                continue;
            }
            let mut from = self.in_lanes(reg, Ty::F32, slots, plan);
            if matches!(inst.leaf(), Some(Leaf::Read(_))) {
                // Another carried register, which may be overwritten before this one is written.
                let kept = self.fresh();
                let source = slots.pointer(from).cast_const();
                plan.varying.push(Step { args: [source; 3], ..copy_step(slots.pointer(kept)) });
                from = kept;
            }
            moves[k] = Some(Step { args: [slots.pointer(from); 3], ..copy });
        }
        for step in moves.into_iter().flatten() {
            if step.op == Op::Window {
                let number = plan.varying.len() as u32;
                plan.windows.push(WindowUse { step: number, arg: 0, operand: step.imm as u8 });
            }
            plan.varying.push(step);
        }
    }

    /// The address of a varying step's operand number `i`; that of a window is set row by row.
    fn varying_operand(
        &mut self,
        arg: Reg,
        inst: &Inst,
        i: usize,
        slots: &mut Slots,
        plan: &mut LoopPlan,
    ) -> *const f32 {
        let ty = inst.op().operands()[i];
        if let Place::Window(operand) = self.places[arg.index()] {
            // The caller knows the number of its step.
            plan.windows.push(WindowUse { step: u32::MAX, arg: i as u32, operand: operand.index() });
            return std::ptr::null();
        }
        let slot = self.in_lanes(arg, ty, slots, plan);
        slots.pointer(slot).cast_const()
    }

    /// The slot of a register for a step that runs for every lane. Uniform ones are spread.
    fn in_lanes(&mut self, reg: Reg, ty: Ty, slots: &mut Slots, plan: &mut LoopPlan) -> SlotId {
        let (uniform, spread) = match self.places[reg.index()] {
            Place::Slot(slot) => return slot,
            Place::Uniform(_, Some(spread)) => return spread,
            Place::Uniform(uniform, None) => (uniform, self.fresh()),
            Place::Window(_) | Place::Nowhere => unreachable!("windows have no slot"),
        };
        self.places[reg.index()] = Place::Uniform(uniform, Some(spread));
        if ty != Ty::Mask {
            plan.tables.push(uniform);
            plan.spreads.push(Spread { table: std::ptr::null(), to: slots.pointer(spread) });
            return spread;
        }
        // A mask travels as the number 1 or 0.
        let (number, numbers) = (self.fresh(), self.fresh());
        let (zero, one) = (self.zero(slots), self.one(slots));
        let number_args = [uniform, one, zero].map(|slot| slots.pointer(slot).cast_const());
        plan.uniform.push(Step { op: Op::Select, imm: 0, to: slots.pointer(number), args: number_args });
        plan.tables.push(number);
        plan.spreads.push(Spread { table: std::ptr::null(), to: slots.pointer(numbers) });
        let mask_args = [zero, numbers, zero].map(|slot| slots.pointer(slot).cast_const());
        plan.varying.push(Step { op: Op::Lt, imm: 0, to: slots.pointer(spread), args: mask_args });
        spread
    }

    /// The slot of a register that is computed in the same region, or in an earlier one.
    fn slot_of(&self, reg: Reg) -> SlotId {
        match self.places[reg.index()] {
            Place::Slot(slot) | Place::Uniform(slot, _) => slot,
            Place::Window(_) | Place::Nowhere => unreachable!("windows are read by varying instructions"),
        }
    }

    fn fresh(&mut self) -> SlotId {
        self.next += 1;
        SlotId(self.next - 1)
    }

    fn constant(&mut self, bits: u32, slots: &mut Slots) -> SlotId {
        let slot = self.fresh();
        slots.splat(slot, bits);
        slot
    }

    fn constant_mask(&mut self, value: bool, slots: &mut Slots) -> SlotId {
        let (slot, zero) = (self.fresh(), self.zero(slots));
        let zero = slots.pointer(zero).cast_const();
        let op = if value { Op::Le } else { Op::Lt };
        self.prologue.push(Step { op, imm: 0, to: slots.pointer(slot), args: [zero; 3] });
        slot
    }

    fn zero(&mut self, slots: &mut Slots) -> SlotId {
        self.zero.unwrap_or_else(|| {
            let slot = self.constant(0, slots);
            self.zero = Some(slot);
            slot
        })
    }

    fn one(&mut self, slots: &mut Slots) -> SlotId {
        self.one.unwrap_or_else(|| {
            let slot = self.constant(1f32.to_bits(), slots);
            self.one = Some(slot);
            slot
        })
    }
}

impl LoopPlan {
    fn clear(&mut self) {
        self.column.clear();
        self.column_value = None;
        self.invariant.clear();
        self.uniform.clear();
        self.tables.clear();
        self.position_slots = None;
        self.varying.clear();
        self.windows.clear();
        self.spreads.clear();
        self.finals.clear();
        self.break_if = None;
        self.uses_x = false;
    }
}

fn new_step(inst: &Inst, to: *mut f32) -> Step {
    Step { op: inst.op(), imm: inst.imm(), to, args: [std::ptr::null(); 3] }
}

/// A step that copies its first operand.
fn copy_step(to: *mut f32) -> Step {
    Step { op: Op::Read, imm: 0, to, args: [std::ptr::null(); 3] }
}
