//! The window operands of a loop, out of raw pixels: tiles of averages, filled as the loop comes to them.

use cranelift_codegen::ir::condcodes::IntCC;
use cranelift_codegen::ir::types::{I8X16, I32, I64};
use cranelift_codegen::ir::{FuncRef, InstBuilder, MemFlagsData, StackSlot, Value};
use vsonar_ir::{Direction, Loop, Operand, Span, Ty};

use super::fill::repeat;
use super::pixels::{PLAIN, interleave, shuffle};
use super::plan::Plan;
use crate::exec::cranelift::Shape;
use crate::exec::cranelift::emit::Emitter;
use crate::exec::cranelift::emit_loop::WindowSource;

/// The frame, as the detector's caller gave it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Frame {
    pub(super) luma: Value,
    pub(super) row_stride: Value,
    pub(super) pixel_stride: Value,
}

/// Where things lie in the detector's scratch memory: rows of lanes, averages lane by lane, then what a fill uses.
#[derive(Debug, Clone, Copy)]
pub(super) struct Layout {
    lanes: i32,
    fill: i32,
    /// Bytes in all.
    pub(super) bytes: i32,
}

impl Layout {
    /// The layout for a loop with this plan.
    pub(super) fn new(plan: &Plan, shape: Shape) -> Layout {
        let lanes = shape.lanes() as i32;
        // One lane's averages are rows already.
        let rows = if lanes == 1 { 0 } else { lanes * plan.lane_bytes() };
        let fill = rows + lanes * plan.lane_bytes();
        Layout { lanes: rows, fill, bytes: fill + plan.fill_bytes }
    }
}

/// Fills tiles and reads them, for one loop and one group of lanes.
pub(super) struct TileSource<'p> {
    pub(super) plan: Option<&'p Plan>,
    pub(super) frame: Frame,
    pub(super) scratch: StackSlot,
    pub(super) fill: Option<FuncRef>,
    /// The centre columns, as 32-bit integers, lane by lane.
    pub(super) columns: StackSlot,
    /// How many lanes have a column of their own.
    pub(super) count: Value,
    direction: Direction,
    /// Whether the last position alone is visited.
    last_only: bool,
    /// How many positions there are.
    total: i64,
    shape: Shape,
    /// Addresses of the averages of each lane.
    lanes: Vec<Value>,
    /// Offset of the current row in the tile, and how many positions are left with it.
    at: Option<Value>,
    left: Option<Value>,
}

impl<'p> TileSource<'p> {
    #[expect(clippy::too_many_arguments, reason = "each is another thing that a source needs")]
    pub(super) fn new(
        l: &Loop,
        height: u32,
        plan: Option<&'p Plan>,
        frame: Frame,
        scratch: StackSlot,
        fill: Option<FuncRef>,
        columns: StackSlot,
        count: Value,
        shape: Shape,
    ) -> TileSource<'p> {
        TileSource {
            plan,
            frame,
            scratch,
            fill,
            columns,
            count,
            direction: l.direction(),
            last_only: l.span() == Span::Last,
            total: i64::from(l.rect().positions(height)),
            shape,
            lanes: Vec::new(),
            at: None,
            left: None,
        }
    }

    /// Bytes from one row of the tile to the next.
    const fn row_bytes(&self) -> i64 {
        4 * self.shape.lanes() as i64
    }

    /// The offsets of the first row of a tile, of the row after its last, and the step between rows.
    fn walk(&self, plan: &Plan) -> (i64, i64, i64) {
        let (row, positions) = (self.row_bytes(), i64::from(plan.positions));
        match self.direction {
            Direction::Up => ((positions - 1) * row, -row, -row),
            Direction::Down => (0, positions * row, row),
        }
    }

    fn address(&self, e: &mut Emitter<'_, '_>, offset: i32) -> Value {
        e.b.ins().stack_addr(I64, self.scratch, offset)
    }

    /// Computes the tile whose first position is `top`.
    fn tile(&self, e: &mut Emitter<'_, '_>, plan: &Plan, top: Value) {
        let layout = Layout::new(plan, self.shape);
        let Some(fill) = self.fill else { unreachable!("what looks at windows has a fill") };
        let block = e.b.create_block();
        let done = e.b.create_block();
        let lane = e.b.append_block_param(block, I64);
        let zero = e.b.ins().iconst(I64, 0);
        e.b.ins().jump(block, &[zero.into()]);
        e.switch_to_block(block);
        let bytes = e.b.ins().imul_imm_s(lane, i64::from(plan.lane_bytes()));
        let out = self.address(e, layout.lanes);
        let out = e.b.ins().iadd(out, bytes);
        let scratch = self.address(e, layout.fill);
        let column = e.b.ins().stack_addr(I64, self.columns, 0);
        let offset = e.b.ins().ishl_imm_u(lane, 2);
        let column = e.b.ins().iadd(column, offset);
        let x = e.b.ins().load(I32, PLAIN, column, 0);
        let Frame { luma, row_stride, pixel_stride } = self.frame;
        e.b.ins().call(fill, &[luma, row_stride, pixel_stride, scratch, out, x, top]);
        let next = e.b.ins().iadd_imm_s(lane, 1);
        let more = e.b.ins().icmp(IntCC::UnsignedLessThan, next, self.count);
        e.b.ins().brif(more, block, &[next.into()], done, &[]);
        e.switch_to_block(done);
        if self.shape == Shape::Lanes4 {
            self.interleave(e, plan);
        }
    }

    /// Turns the averages of four lanes into rows: squares of four rows by four lanes at a time.
    fn interleave(&self, e: &mut Emitter<'_, '_>, plan: &Plan) {
        let rows = self.address(e, 0);
        let lanes = self.lanes.clone();
        repeat(e.b, i64::from(plan.rows) * 4, 16, |b, i| {
            let to = b.ins().ishl_imm_u(i, 2);
            let to = b.ins().iadd(rows, to);
            for operand in 0..plan.operands.len() as i32 {
                let from = operand * plan.strip_bytes();
                let squares: Vec<Value> = lanes
                    .iter()
                    .map(|&lane| {
                        let address = b.ins().iadd(lane, i);
                        b.ins().load(I8X16, PLAIN, address, from)
                    })
                    .collect();
                let mut pair = |x, y, unit, upper| shuffle(b, x, y, interleave(unit, upper));
                let (a, c) = (pair(squares[0], squares[1], 4, false), pair(squares[2], squares[3], 4, false));
                let (d, f) = (pair(squares[0], squares[1], 4, true), pair(squares[2], squares[3], 4, true));
                let turned = [pair(a, c, 8, false), pair(a, c, 8, true), pair(d, f, 8, false), pair(d, f, 8, true)];
                for (row, value) in turned.into_iter().enumerate() {
                    b.ins().store(PLAIN, value, to, from * 4 + 16 * row as i32);
                }
            }
        });
        let here = e.b.create_block();
        e.b.ins().jump(here, &[]);
        e.switch_to_block(here);
    }
}

impl WindowSource for TileSource<'_> {
    fn begin(&mut self, e: &mut Emitter<'_, '_>) -> Vec<Value> {
        let Some(plan) = self.plan else {
            return vec![e.b.ins().iconst(I64, self.total)];
        };
        let layout = Layout::new(plan, self.shape);
        // Lanes without a column of their own look at the last one that has.
        let most = e.b.ins().iadd_imm_s(self.count, -1);
        self.lanes = (0..self.shape.lanes() as i64)
            .map(|lane| {
                let lane = e.b.ins().iconst(I64, lane);
                let within = e.b.ins().icmp(IntCC::UnsignedLessThan, lane, most);
                let lane = e.b.ins().select(within, lane, most);
                let bytes = e.b.ins().imul_imm_s(lane, i64::from(plan.lane_bytes()));
                let base = self.address(e, layout.lanes);
                e.b.ins().iadd(base, bytes)
            })
            .collect();
        // The first row finds a tile at its end.
        let (_, end, _) = self.walk(plan);
        vec![e.b.ins().iconst(I64, self.total), e.b.ins().iconst(I64, end)]
    }

    fn enter(&mut self, e: &mut Emitter<'_, '_>, carried: &[Value]) {
        self.left = Some(carried[0]);
        let Some(plan) = self.plan else { return };
        let (first, end, _) = self.walk(plan);
        if self.last_only {
            let top = if self.direction == Direction::Up { 0 } else { self.total - 1 };
            let top = e.b.ins().iconst(I32, top);
            self.tile(e, plan, top);
            self.at = Some(e.b.ins().iconst(I64, 0));
            return;
        }
        let (refill, on) = (e.b.create_block(), e.b.create_block());
        let at = e.b.append_block_param(on, I64);
        let ended = e.b.ins().icmp_imm_s(IntCC::Equal, carried[1], end);
        e.b.ins().brif(ended, refill, &[], on, &[carried[1].into()]);
        e.switch_to_block(refill);
        let top = match self.direction {
            Direction::Up => e.b.ins().iadd_imm_s(carried[0], -i64::from(plan.positions)),
            Direction::Down => {
                let total = e.b.ins().iconst(I64, self.total);
                e.b.ins().isub(total, carried[0])
            }
        };
        let top = e.b.ins().ireduce(I32, top);
        self.tile(e, plan, top);
        let start = e.b.ins().iconst(I64, first);
        e.b.ins().jump(on, &[start.into()]);
        e.switch_to_block(on);
        self.at = Some(at);
    }

    fn window(&mut self, e: &mut Emitter<'_, '_>, operand: Operand) -> Value {
        let (Some(plan), Some(at)) = (self.plan, self.at) else { unreachable!("a row has been entered") };
        let number = plan.operands.iter().position(|p| p.operand == operand);
        let Some(number) = number else { unreachable!("the plan holds all operands of the loop") };
        let rows = self.address(e, 0);
        let address = e.b.ins().iadd(rows, at);
        let ty = e.shape().ty(Ty::F32);
        let offset = number as i64 * i64::from(plan.rows) * self.row_bytes();
        e.b.ins().load(ty, MemFlagsData::trusted(), address, offset as i32)
    }

    fn advance(&mut self, e: &mut Emitter<'_, '_>) -> (Vec<Value>, Value) {
        let Some(left) = self.left else { unreachable!("a row has been entered") };
        let left = e.b.ins().iadd_imm_s(left, -1);
        let more = e.b.ins().icmp_imm_s(IntCC::NotEqual, left, 0);
        let mut carried = vec![left];
        if let (Some(plan), Some(at)) = (self.plan, self.at) {
            let (_, _, step) = self.walk(plan);
            carried.push(e.b.ins().iadd_imm_s(at, step));
        }
        (carried, more)
    }
}
