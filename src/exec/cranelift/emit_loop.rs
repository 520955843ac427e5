//! A whole loop or column of the language in Cranelift instructions, over an [`Emitter`].
//!
//! A loop becomes one basic block for its body: invariant instructions stand before it, uniform ones are
//! computed for one case and spread over the lanes where a varying one uses them. Carried registers are
//! parameters of the block. With lanes, a break mask takes lanes out of the *alive* mask, under which registers
//! keep their values; the block is left when no lane is alive. Where the window operands, the case's parameters
//! and the results live is the business of a [`WindowSource`] and an [`Inputs`], so that strips and raw pixels,
//! JIT and exported code share this file.

use cranelift_codegen::ir::{self, BlockArg, InstBuilder, StackSlotData, StackSlotKind};
use vsonar_ir::machine::Machine;
use vsonar_ir::op::Depends;
use vsonar_ir::program::{Column, Region};
use vsonar_ir::{Direction, Leaf, Loop, Op, Operand, Reg, Ty};

use super::emit::{Emitter, Shape};
use super::frame::{Frame, constant};
use super::kept::Kept;

/// Where the window operands come from, and with it the loop's position and end.
///
/// A source may hand the rows out in *tiles*: then there is a loop around that over the rows, and what is costly to
/// prepare, or calls functions, stands there.
pub(crate) trait WindowSource {
    /// Before the loop: the values the source carries from row to row, or from tile to tile, as they start.
    fn begin(&mut self, e: &mut Emitter<'_, '_>) -> Vec<ir::Value>;

    /// Whether there are tiles.
    fn tiled(&self) -> bool {
        false
    }

    /// At the top of a tile, with the values carried from tile to tile: the values carried from row to row, as they
    /// start.
    fn tile(&mut self, _e: &mut Emitter<'_, '_>, carried: &[ir::Value]) -> Vec<ir::Value> {
        carried.to_vec()
    }

    /// At the top of a row: the carried values of this row.
    fn enter(&mut self, carried: &[ir::Value]);

    /// A window operand at this row, in the emitter's shape.
    fn window(&mut self, e: &mut Emitter<'_, '_>, operand: Operand) -> ir::Value;

    /// At the end of a row: the carried values of the next one, and whether there is one in this tile (an integer
    /// that is zero at the last row).
    fn advance(&mut self, e: &mut Emitter<'_, '_>) -> (Vec<ir::Value>, ir::Value);

    /// After a tile: the carried values of the next one, and whether there is one.
    fn next_tile(&mut self, _e: &mut Emitter<'_, '_>) -> (Vec<ir::Value>, ir::Value) {
        unreachable!("of tiled sources alone")
    }
}

/// Where the parameters of a case come from.
pub(crate) trait Inputs {
    /// The value, in the emitter's shape, of a leaf that changes from lane to lane alone: `x-obstacle`,
    /// `x`, `iter2 a` … `iter2 e`.
    fn leaf(&mut self, e: &mut Emitter<'_, '_>, leaf: Leaf) -> ir::Value;
}

/// Emits a column expression in the current block; its value, in the emitter's shape.
pub(crate) fn emit_column(e: &mut Emitter<'_, '_>, column: &Column, inputs: &mut dyn Inputs) -> ir::Value {
    let mut frame = Frame::new(e, column.block().insts(), std::iter::once(column.result()));
    for (reg, inst) in column.block().iter() {
        frame.before(e, reg);
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
    let results = l.next().iter().copied().chain([l.break_if()]).flatten();
    let frame = Frame::new(e, l.body().insts(), results);
    let mut loop_ = LoopEmitter { l, frame, source, inputs, y: None, first_window: None };
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
            self.frame.before(e, reg);
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
        self.frame.end_invariant(e, Reg(self.l.region(Region::Invariant).end as u32));
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
                self.frame.before(e, reg);
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
        let carried = if self.source.tiled() { self.source.tile(e, &carried) } else { carried };
        self.source.enter(&carried);
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

        // The entry's end: what the first row or tile finds.
        let tiled = self.source.tiled();
        let mut args = self.source.begin(e);
        let mut source_values = args.len();
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
        let tile = tiled.then(|| {
            let kept = self.keep(e, &args[source_values..]);
            let tile = block_for(e, &args[..source_values]);
            e.b.ins().jump(tile, &block_args(&args[..source_values]));
            e.switch_to_block(tile);
            let own = e.b.block_params(tile).to_vec();
            let start = self.source.tile(e, &own);
            source_values = start.len();
            args = [start, self.find(e, &kept)].concat();
            (tile, kept)
        });
        let body = block_for(e, &args);
        let params: Vec<ir::Value> = e.b.block_params(body).to_vec();
        let exit = e.b.create_block();
        let outputs: Vec<usize> = kept.iter().copied().filter(|&k| wanted[k]).collect();
        let results: Vec<ir::Value> = outputs.iter().map(|_| e.b.append_block_param(exit, f32)).collect();
        e.b.ins().jump(body, &block_args(&args));

        // The body.
        e.switch_to_block(body);
        let mut rest = params.iter().copied();
        let carried: Vec<ir::Value> = rest.by_ref().take(source_values).collect();
        self.source.enter(&carried);
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
        let source_values = args.len();
        args.extend(kept.iter().filter_map(|&k| next[k]));
        let mut any = None;
        if let (Some(alive), Some(stop)) = (alive, stop) {
            let running = e.not(stop);
            let alive = e.and(alive, running);
            args.push(alive);
            any = Some(e.b.ins().vany_true(alive));
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
        let and_any = |e: &mut Emitter<'_, '_>, more| any.map_or(more, |any| e.b.ins().band(any, more));
        let go_on = and_any(e, more);
        if let Some((tile, kept)) = tile {
            let ended = e.b.create_block();
            e.b.ins().brif(go_on, body, &block_args(&args), ended, &[]);
            e.switch_to_block(ended);
            kept.store(e, &args[source_values..]);
            let (found, more) = self.source.next_tile(e);
            let go_on = and_any(e, more);
            e.b.ins().brif(go_on, tile, &block_args(&found), exit, &outs);
        } else {
            e.b.ins().brif(go_on, body, &block_args(&args), exit, &outs);
        }
        e.switch_to_block(exit);

        let mut finals = [None; 5];
        for k in (0..5).filter(|&k| wanted[k]) {
            let result = outputs.iter().position(|&o| o == k).map(|i| results[i]);
            finals[k] = Some(result.unwrap_or_else(|| e.f32(0.0)));
        }
        finals
    }

    /// Keeps values in memory that the rows of a tile want in registers: those that are carried, and the invariant
    /// ones. Left to itself, the register allocator would have them in memory in every row, because a tile begins with
    /// a call.
    fn keep(&self, e: &mut Emitter<'_, '_>, carried: &[ir::Value]) -> Kept {
        let mut values = carried.to_vec();
        let invariants: Vec<(usize, Shape)> = (self.l.region(Region::Invariant))
            .flat_map(|index| [(index, Shape::Scalar), (index, Shape::Lanes4)])
            .filter(|&(index, shape)| self.frame.slots[index].of(shape).is_some())
            .collect();
        values.extend(invariants.iter().filter_map(|&(index, shape)| self.frame.slots[index].of(shape)));
        let types = values.iter().map(|&value| e.b.func.dfg.value_type(value)).collect();
        let bytes = (Kept::BYTES as usize * values.len()) as u32;
        let slot =
            e.b.create_sized_stack_slot(StackSlotData::new(StackSlotKind::ExplicitSlot, bytes, Kept::ALIGN));
        let kept = Kept { slot, types, carried: carried.len(), invariants };
        kept.store(e, &values);
        kept
    }

    /// What was kept: the carried values; the invariant ones are put where they are looked for.
    fn find(&mut self, e: &mut Emitter<'_, '_>, kept: &Kept) -> Vec<ir::Value> {
        let mut values = kept.load(e);
        for (&(index, shape), value) in kept.invariants.iter().zip(values.split_off(kept.carried)) {
            self.frame.set(Reg(index as u32), shape, value);
        }
        values
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

/// A block with a parameter for each of the values.
fn block_for(e: &mut Emitter<'_, '_>, values: &[ir::Value]) -> ir::Block {
    let block = e.b.create_block();
    for &value in values {
        let ty = e.b.func.dfg.value_type(value);
        e.b.append_block_param(block, ty);
    }
    block
}

fn block_args(values: &[ir::Value]) -> Vec<BlockArg> {
    values.iter().copied().map(BlockArg::Value).collect()
}
