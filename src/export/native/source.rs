//! The window operands of a loop, out of raw pixels: tiles of averages, filled as the loop comes to them.

use cranelift_codegen::ir::condcodes::IntCC;
use cranelift_codegen::ir::types::{I8X16, I32, I64};
use cranelift_codegen::ir::{FuncRef, InstBuilder, MemFlagsData, StackSlot, Value};
use vsonar_ir::{Direction, Loop, Operand, Span, Ty};

use super::copy;
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
    offsets: i32,
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
        let offsets = (fill + plan.fill_bytes + 7) & !7;
        Layout { lanes: rows, fill, offsets, bytes: offsets + plan.offset_bytes() }
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
    /// Positions left after the tile.
    left: Option<Value>,
    /// Offset in the tile of the row after its last.
    end: Option<Value>,
    /// Offset in the tile of the current row.
    at: Option<Value>,
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
            left: None,
            end: None,
            at: None,
        }
    }

    /// Bytes from one row of the tile to the next.
    const fn row_bytes(&self) -> i64 {
        4 * self.shape.lanes() as i64
    }

    /// The step from row to row of a tile, in bytes.
    const fn step(&self) -> i64 {
        match self.direction {
            Direction::Up => -self.row_bytes(),
            Direction::Down => self.row_bytes(),
        }
    }

    fn address(&self, e: &mut Emitter<'_, '_>, offset: i32) -> Value {
        e.b.ins().stack_addr(I64, self.scratch, offset)
    }

    /// Computes the tile whose first position is `top`.
    fn compute(&self, e: &mut Emitter<'_, '_>, plan: &Plan, top: Value) {
        let layout = Layout::new(plan, self.shape);
        let Some(fill) = self.fill else { unreachable!("what looks at windows has a fill") };
        let Frame { luma, row_stride, pixel_stride } = self.frame;
        let offsets = self.address(e, layout.offsets);
        let above = e.b.ins().iadd_imm_s(top, -1);
        copy::row_offsets(e.b, plan, row_stride, above, offsets);
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
        e.b.ins().call(fill, &[luma, pixel_stride, offsets, scratch, out, x]);
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
        vec![e.b.ins().iconst(I64, self.total)]
    }

    fn tiled(&self) -> bool {
        self.plan.is_some()
    }

    fn tile(&mut self, e: &mut Emitter<'_, '_>, carried: &[Value]) -> Vec<Value> {
        let Some(plan) = self.plan else { unreachable!("what looks at no window has no tiles") };
        if self.last_only {
            let top = if self.direction == Direction::Up { 0 } else { self.total - 1 };
            let top = e.b.ins().iconst(I64, top);
            self.compute(e, plan, top);
            return vec![e.b.ins().iconst(I64, 0)];
        }
        let (left, positions) = (carried[0], i64::from(plan.positions));
        let top = match self.direction {
            Direction::Up => e.b.ins().iadd_imm_s(left, -positions),
            Direction::Down => {
                let total = e.b.ins().iconst(I64, self.total);
                e.b.ins().isub(total, left)
            }
        };
        self.compute(e, plan, top);
        let whole = e.b.ins().iconst(I64, positions);
        let fewer = e.b.ins().icmp(IntCC::UnsignedLessThan, left, whole);
        let rows = e.b.ins().select(fewer, left, whole);
        self.left = Some(e.b.ins().isub(left, rows));
        let first = if self.direction == Direction::Up { (positions - 1) * self.row_bytes() } else { 0 };
        let first = e.b.ins().iconst(I64, first);
        let bytes = e.b.ins().imul_imm_s(rows, self.step());
        self.end = Some(e.b.ins().iadd(first, bytes));
        vec![first]
    }

    fn enter(&mut self, carried: &[Value]) {
        self.at = Some(carried[0]);
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
        let Some(at) = self.at else { unreachable!("a row has been entered") };
        // Without windows the positions themselves are counted.
        let step = if self.plan.is_some() { self.step() } else { -1 };
        let at = e.b.ins().iadd_imm_s(at, step);
        let more = match self.end {
            Some(end) => e.b.ins().icmp(IntCC::NotEqual, at, end),
            None => e.b.ins().icmp_imm_s(IntCC::NotEqual, at, 0),
        };
        (vec![at], more)
    }

    fn next_tile(&mut self, e: &mut Emitter<'_, '_>) -> (Vec<Value>, Value) {
        let Some(left) = self.left else { unreachable!("a tile has been computed") };
        let more = e.b.ins().icmp_imm_s(IntCC::NotEqual, left, 0);
        (vec![left], more)
    }
}
