//! A whole loop or column of the language in Cranelift instructions, over an [`Emitter`].
//!
//! A loop becomes one basic block for its body: invariant instructions stand before it, uniform ones are
//! computed for one case and spread over the lanes where a varying one uses them. Carried registers are
//! parameters of the block. With lanes, a break mask takes lanes out of the *alive* mask, under which registers
//! keep their values; the block is left when no lane is alive. Where the window operands, the case's parameters
//! and the results live is the business of a [`WindowSource`] and an [`Inputs`], so that strips and raw pixels,
//! JIT and exported code share this file.

use cranelift_codegen::ir::{self, BlockArg, InstBuilder};
use vsonar_ir::machine::Machine;
use vsonar_ir::op::{Depends, Value};
use vsonar_ir::program::{Column, Region};
use vsonar_ir::{Direction, Inst, Leaf, Loop, Op, Operand, Reg, Ty};

use super::emit::{Emitter, Shape};

/// Where the window operands come from, and with it the loop's position and end.
pub(crate) trait WindowSource {
    /// Before the loop: the values the source carries from row to row, as they start.
    fn begin(&mut self, e: &mut Emitter<'_, '_>) -> Vec<ir::Value>;

    /// At the top of a row, which the source may leave for another block: the carried values of this row.
    fn enter(&mut self, e: &mut Emitter<'_, '_>, carried: &[ir::Value]);

    /// A window operand at this row, in the emitter's shape.
    fn window(&mut self, e: &mut Emitter<'_, '_>, operand: Operand) -> ir::Value;

    /// At the end of a row: the carried values of the next one, and whether there is one (an integer that is
    /// zero at the last row).
    fn advance(&mut self, e: &mut Emitter<'_, '_>) -> (Vec<ir::Value>, ir::Value);
}

/// Where the parameters of a case come from.
pub(crate) trait Inputs {
    /// The value, in the emitter's shape, of a leaf that changes from lane to lane alone: `x-obstacle`,
    /// `x`, `iter2 a` … `iter2 e`.
    fn leaf(&mut self, e: &mut Emitter<'_, '_>, leaf: Leaf) -> ir::Value;
}

/// A register's value while a block is emitted: for one case, in lanes, or both.
#[derive(Clone, Copy, Default)]
struct Slot {
    scalar: Option<ir::Value>,
    lanes: Option<ir::Value>,
}

/// The registers of a block while it is emitted.
struct Frame<'p> {
    insts: &'p [Inst],
    slots: Vec<Slot>,
    carried: [Option<ir::Value>; 5],
}

impl<'p> Frame<'p> {
    fn new(insts: &'p [Inst]) -> Frame<'p> {
        Frame { insts, slots: vec![Slot::default(); insts.len()], carried: [None; 5] }
    }

    fn set(&mut self, reg: Reg, shape: Shape, value: ir::Value) {
        let slot = &mut self.slots[reg.index()];
        match shape {
            Shape::Scalar => slot.scalar = Some(value),
            Shape::Lanes4 => slot.lanes = Some(value),
        }
    }

    /// A register in the emitter's shape. Constants are made where they are used, values of one case spread
    /// over the lanes where lanes are asked for.
    fn get(&mut self, e: &mut Emitter<'_, '_>, reg: Reg) -> ir::Value {
        let inst = self.insts[reg.index()];
        let ty = inst.op().result();
        if let Some(bits) = constant(inst) {
            return e.constant(ty, bits);
        }
        let slot = self.slots[reg.index()];
        let value = match e.shape() {
            Shape::Scalar => slot.scalar,
            Shape::Lanes4 => slot.lanes,
        };
        if let Some(value) = value {
            return value;
        }
        let scalar = slot.scalar.expect("registers are defined in order, and per row only from per row");
        let value = e.splat(ty, scalar);
        self.set(reg, Shape::Lanes4, value);
        value
    }

    /// Emits an operation.
    fn operation(&mut self, e: &mut Emitter<'_, '_>, reg: Reg) {
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
    fn read(&mut self, e: &mut Emitter<'_, '_>, reg: Reg, register: u8) {
        let value = self.carried[usize::from(register)].unwrap_or_else(|| e.f32(0.0));
        self.set(reg, e.shape(), value);
    }
}

/// The bits of a constant leaf.
fn constant(inst: Inst) -> Option<u32> {
    matches!(inst.op(), Op::Const | Op::IConst | Op::MConst).then_some(inst.imm())
}

/// Emits a column expression in the current block; its value, in the emitter's shape.
pub(crate) fn emit_column(e: &mut Emitter<'_, '_>, column: &Column, inputs: &mut dyn Inputs) -> ir::Value {
    let mut frame = Frame::new(column.block().insts());
    for (reg, inst) in column.block().iter() {
        match inst.leaf() {
            None => frame.operation(e, reg),
            Some(_) if constant(inst).is_some() => {}
            Some(leaf) => {
                let value = inputs.leaf(e, leaf);
                frame.set(reg, e.shape(), value);
            }
        }
    }
    frame.get(e, column.result())
}

/// Emits a loop in an image `height` pixels high, beginning in the current block; the final values of the
/// registers `wanted`, in the emitter's shape, for the block that is current at the end.
pub(crate) fn emit_loop(
    e: &mut Emitter<'_, '_>,
    l: &Loop,
    height: u32,
    wanted: [bool; 5],
    source: &mut dyn WindowSource,
    inputs: &mut dyn Inputs,
) -> [Option<ir::Value>; 5] {
    let mut loop_ =
        LoopEmitter { l, frame: Frame::new(l.body().insts()), source, inputs, y: None, first_window: None };
    loop_.invariant(e);
    let mut rows = l.rows(height);
    let first_row = rows.next().expect("a rectangle fits into the image at least once") as f32;
    let start = Start { y: first_row, first_window: l.first_window_at_start(height) };
    if rows.next().is_none() { loop_.single(e, start, wanted) } else { loop_.many(e, start, wanted) }
}

/// The leaves of the first row.
#[derive(Clone, Copy)]
struct Start {
    y: f32,
    first_window: f32,
}

struct LoopEmitter<'p, 's> {
    l: &'p Loop,
    frame: Frame<'p>,
    source: &'s mut dyn WindowSource,
    inputs: &'s mut dyn Inputs,
    /// `y` and `first-window` of the row being emitted, where the body asks for them.
    y: Option<ir::Value>,
    first_window: Option<ir::Value>,
}

impl LoopEmitter<'_, '_> {
    fn uses(&self, op: Op) -> bool {
        self.frame.insts.iter().any(|inst| inst.op() == op)
    }

    fn invariant(&mut self, e: &mut Emitter<'_, '_>) {
        let shape = e.shape();
        let dependences = self.l.body().dependences();
        for index in self.l.region(Region::Invariant) {
            let (reg, inst) = (Reg(index as u32), self.frame.insts[index]);
            match inst.leaf() {
                None => {
                    // What depends on no lane is computed once, so that the uniform region can use it too.
                    let same = dependences[index].within(Depends::NOTHING);
                    e.set_shape(if same { Shape::Scalar } else { shape });
                    self.frame.operation(e, reg);
                    e.set_shape(shape);
                }
                Some(leaf) => self.leaf(e, reg, leaf),
            }
        }
    }

    /// The uniform and varying regions of one row.
    fn row(&mut self, e: &mut Emitter<'_, '_>) {
        let shape = e.shape();
        for region in [Region::Uniform, Region::Varying] {
            if region == Region::Uniform {
                e.set_shape(Shape::Scalar);
            }
            for index in self.l.region(region) {
                let (reg, inst) = (Reg(index as u32), self.frame.insts[index]);
                match inst.leaf() {
                    None => self.frame.operation(e, reg),
                    Some(leaf) => self.leaf(e, reg, leaf),
                }
            }
            e.set_shape(shape);
        }
    }

    fn leaf(&mut self, e: &mut Emitter<'_, '_>, reg: Reg, leaf: Leaf) {
        match leaf {
            Leaf::Const(_) | Leaf::IConst(_) | Leaf::MConst(_) => {}
            Leaf::XObstacle | Leaf::Iter2(_) | Leaf::X => {
                let value = self.inputs.leaf(e, leaf);
                self.frame.set(reg, e.shape(), value);
            }
            Leaf::Y => self.frame.set(reg, Shape::Scalar, self.y.expect("not in the invariant region")),
            Leaf::FirstWindow => {
                self.frame.set(reg, Shape::Scalar, self.first_window.expect("not in the invariant region"));
            }
            Leaf::Read(register) => self.frame.read(e, reg, register),
            Leaf::Window(operand) => {
                let value = self.source.window(e, operand);
                self.frame.set(reg, e.shape(), value);
            }
        }
    }

    /// A loop of a single row: no loop at all.
    fn single(&mut self, e: &mut Emitter<'_, '_>, start: Start, wanted: [bool; 5]) -> [Option<ir::Value>; 5] {
        let carried = self.source.begin(e);
        self.source.enter(e, &carried);
        self.y = Some(self.scalar(e, start.y));
        self.first_window = Some(self.scalar(e, start.first_window));
        self.row(e);
        std::array::from_fn(|k| wanted[k].then(|| self.next(e, k)))
    }

    /// A loop of several rows.
    fn many(&mut self, e: &mut Emitter<'_, '_>, start: Start, wanted: [bool; 5]) -> [Option<ir::Value>; 5] {
        let f32 = e.shape().ty(Ty::F32);
        let (uses_y, uses_first) = (self.uses(Op::Y), self.uses(Op::FirstWindow));
        let read = |k: usize| self.frame.insts.iter().any(|inst| inst.leaf() == Some(Leaf::Read(k as u8)));
        // Registers that are written and of use; the others are 0, or nobody's concern.
        let kept: Vec<usize> =
            (0..5).filter(|&k| self.l.next()[k].is_some() && (wanted[k] || read(k))).collect();
        let breaks = self.breaks(e.shape());

        // The entry's end: what the first row finds.
        let mut args = self.source.begin(e);
        let source_values = args.len();
        let zero = e.f32(0.0);
        args.extend(kept.iter().map(|_| zero));
        if breaks == Breaks::Lanes {
            args.push(e.mask(true));
        }
        if uses_y {
            args.push(self.scalar(e, start.y));
        }
        if uses_first {
            args.push(self.scalar(e, start.first_window));
        }
        let body = e.b.create_block();
        let params: Vec<ir::Value> = args
            .iter()
            .map(|&arg| {
                let ty = e.b.func.dfg.value_type(arg);
                e.b.append_block_param(body, ty)
            })
            .collect();
        let exit = e.b.create_block();
        let outputs: Vec<usize> = kept.iter().copied().filter(|&k| wanted[k]).collect();
        let results: Vec<ir::Value> = outputs.iter().map(|_| e.b.append_block_param(exit, f32)).collect();
        e.b.ins().jump(body, &block_args(&args));

        // The body.
        e.switch_to_block(body);
        let mut rest = params.iter().copied();
        let carried: Vec<ir::Value> = rest.by_ref().take(source_values).collect();
        self.source.enter(e, &carried);
        for &k in &kept {
            self.frame.carried[k] = rest.next();
        }
        let alive = if breaks == Breaks::Lanes { rest.next() } else { None };
        self.y = if uses_y { rest.next() } else { None };
        self.first_window = if uses_first { rest.next() } else { None };
        self.row(e);

        // What the next row finds.
        let mut next = [None; 5];
        for &k in &kept {
            let value = self.next(e, k);
            next[k] = Some(match (alive, self.frame.carried[k]) {
                (Some(alive), Some(before)) if value != before => e.select(alive, value, before),
                _ => value,
            });
        }
        let stop = self.l.break_if().map(|reg| match breaks {
            Breaks::Lanes => self.frame.get(e, reg),
            _ => self.in_scalar(e, |frame, e| frame.get(e, reg)),
        });
        let (mut args, more) = self.source.advance(e);
        args.extend(kept.iter().filter_map(|&k| next[k]));
        let mut go_on = more;
        if let (Some(alive), Some(stop)) = (alive, stop) {
            let running = e.not(stop);
            let alive = e.and(alive, running);
            args.push(alive);
            let any = e.b.ins().vany_true(alive);
            go_on = e.b.ins().band(any, more);
        }
        if let Some(y) = self.y {
            let up = self.l.direction() == Direction::Up;
            let step = self.scalar(e, if up { -1.0 } else { 1.0 });
            args.push(e.b.ins().fadd(y, step));
        }
        if uses_first {
            args.push(self.scalar(e, -1.0));
        }
        let outs: Vec<BlockArg> = outputs.iter().filter_map(|&k| next[k]).map(BlockArg::Value).collect();
        if let (Breaks::All, Some(stop)) = (breaks, stop) {
            let on = e.b.create_block();
            e.b.ins().brif(stop, exit, &outs, on, &[]);
            e.switch_to_block(on);
        }
        e.b.ins().brif(go_on, body, &block_args(&args), exit, &outs);
        e.switch_to_block(exit);

        let mut finals = [None; 5];
        for k in (0..5).filter(|&k| wanted[k]) {
            let result = outputs.iter().position(|&o| o == k).map(|i| results[i]);
            finals[k] = Some(result.unwrap_or_else(|| e.f32(0.0)));
        }
        finals
    }

    /// The value of carried register `k` after this row, 0 where it is never written.
    fn next(&mut self, e: &mut Emitter<'_, '_>, k: usize) -> ir::Value {
        match self.l.next()[k] {
            Some(reg) => self.frame.get(e, reg),
            None => e.f32(0.0),
        }
    }

    fn breaks(&self, shape: Shape) -> Breaks {
        let Some(reg) = self.l.break_if() else { return Breaks::Never };
        let dependence = self.l.body().dependences()[reg.index()];
        let together = self.l.region_of(reg) != Region::Varying && dependence.within(Depends::ROW);
        if together || shape == Shape::Scalar { Breaks::All } else { Breaks::Lanes }
    }

    fn in_scalar<T>(
        &mut self,
        e: &mut Emitter<'_, '_>,
        f: impl FnOnce(&mut Frame<'_>, &mut Emitter<'_, '_>) -> T,
    ) -> T {
        let shape = e.shape();
        e.set_shape(Shape::Scalar);
        let value = f(&mut self.frame, e);
        e.set_shape(shape);
        value
    }

    fn scalar(&mut self, e: &mut Emitter<'_, '_>, value: f32) -> ir::Value {
        self.in_scalar(e, |_, e| e.f32(value))
    }
}

/// Which lanes a break mask stops at once.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Breaks {
    /// There is none.
    Never,
    /// All of them: it does not depend on the lane, or there is but one.
    All,
    /// Each by itself.
    Lanes,
}

fn block_args(values: &[ir::Value]) -> Vec<BlockArg> {
    values.iter().copied().map(BlockArg::Value).collect()
}
