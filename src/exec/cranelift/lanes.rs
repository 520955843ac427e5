//! What compiled code reads and writes for a group of cases, and how a compiled entry gets at it.

use cranelift_codegen::ir::condcodes::IntCC;
use cranelift_codegen::ir::{self, InstBuilder, MemFlagsData};
use vsonar_ir::{Direction, Leaf, Loop, Operand, Span, Ty};

use super::emit::Emitter;
use super::emit_loop::{Inputs, WindowSource};
use crate::vision::LANES;

/// The parameters and results of a group of cases, in the layout compiled code is made for.
#[derive(Debug, Clone)]
#[repr(C, align(64))]
pub(crate) struct LaneBlock {
    /// The columns asked for.
    pub(crate) x_obstacle: [f32; LANES],
    /// The centre columns the current loop iterates in.
    pub(crate) x: [f32; LANES],
    /// The first loop's final registers.
    pub(crate) iter2: [[f32; LANES]; 5],
    /// The current loop's final registers, as far as they are wanted. A column entry writes the first.
    pub(crate) out: [[f32; LANES]; 5],
}

impl LaneBlock {
    pub(crate) const fn new() -> LaneBlock {
        LaneBlock {
            x_obstacle: [0.0; LANES],
            x: [0.0; LANES],
            iter2: [[0.0; LANES]; 5],
            out: [[0.0; LANES]; 5],
        }
    }
}

/// A compiled entry. The first argument points to the `x_obstacle` of the first lane to run in a [`LaneBlock`],
/// the second to that lane's element of the first strip's first row (unused by entries that read no window).
pub(crate) type Entry = unsafe extern "C" fn(*mut f32, *const f32);

const ROW: i64 = (LANES * size_of::<f32>()) as i64;

/// Offset of an array of the lane block, from the same lane of `x_obstacle`.
fn field(offset: usize) -> i32 {
    const { assert!(size_of::<LaneBlock>() < i32::MAX as usize) };
    offset as i32
}

/// Reads the case's parameters from the lane block.
pub(crate) struct BlockInputs {
    /// Address of the lane's `x_obstacle`.
    pub(crate) lane: ir::Value,
}

impl BlockInputs {
    /// Stores the final value of a register, or of a column expression as the first.
    pub(crate) fn store(&self, e: &mut Emitter<'_, '_>, register: usize, value: ir::Value) {
        let offset = std::mem::offset_of!(LaneBlock, out) + register * size_of::<[f32; LANES]>();
        e.b.ins().store(MemFlagsData::trusted(), value, self.lane, field(offset));
    }
}

impl Inputs for BlockInputs {
    fn leaf(&mut self, e: &mut Emitter<'_, '_>, leaf: Leaf) -> ir::Value {
        let offset = match leaf {
            Leaf::XObstacle => std::mem::offset_of!(LaneBlock, x_obstacle),
            Leaf::X => std::mem::offset_of!(LaneBlock, x),
            Leaf::Iter2(k) => {
                std::mem::offset_of!(LaneBlock, iter2) + usize::from(k) * size_of::<[f32; LANES]>()
            }
            _ => unreachable!("only parameters of the case are asked for here, not {leaf:?}"),
        };
        let ty = e.shape().ty(Ty::F32);
        e.b.ins().load(ty, MemFlagsData::trusted(), self.lane, field(offset))
    }
}

/// Reads window operands from strips: operand after operand, row after row, [`LANES`] lanes a row.
pub(crate) struct StripSource {
    strips: ir::Value,
    /// Bytes from one operand's strip to the next.
    stride: i64,
    first: i64,
    last: i64,
    step: i64,
    position: Option<ir::Value>,
    end: Option<ir::Value>,
}

impl StripSource {
    /// The strips at the address `strips` for a loop in an image `height` pixels high.
    pub(crate) fn new(strips: ir::Value, l: &Loop, height: u32) -> StripSource {
        let positions = i64::from(l.rect().positions(height));
        let (top, bottom) = (0, (positions - 1) * ROW);
        let (start, last, step) = match l.direction() {
            Direction::Up => (bottom, top, -ROW),
            Direction::Down => (top, bottom, ROW),
        };
        let first = if l.span() == Span::Last { last } else { start };
        StripSource { strips, stride: positions * ROW, first, last, step, position: None, end: None }
    }
}

impl WindowSource for StripSource {
    fn begin(&mut self, e: &mut Emitter<'_, '_>) -> Vec<ir::Value> {
        self.end = Some(e.b.ins().iadd_imm_s(self.strips, self.last));
        vec![e.b.ins().iadd_imm_s(self.strips, self.first)]
    }

    fn enter(&mut self, carried: &[ir::Value]) {
        self.position = Some(carried[0]);
    }

    fn window(&mut self, e: &mut Emitter<'_, '_>, operand: Operand) -> ir::Value {
        let position = self.position.expect("a row has been entered");
        let offset = i64::from(operand.index()) * self.stride;
        let ty = e.shape().ty(Ty::F32);
        let flags = MemFlagsData::trusted().with_readonly();
        match i32::try_from(offset) {
            Ok(offset) => e.b.ins().load(ty, flags, position, offset),
            Err(_) => {
                let address = e.b.ins().iadd_imm_s(position, offset);
                e.b.ins().load(ty, flags, address, 0)
            }
        }
    }

    fn advance(&mut self, e: &mut Emitter<'_, '_>) -> (Vec<ir::Value>, ir::Value) {
        let position = self.position.expect("a row has been entered");
        let end = self.end.expect("the loop has begun");
        let more = e.b.ins().icmp(IntCC::NotEqual, position, end);
        (vec![e.b.ins().iadd_imm_s(position, self.step)], more)
    }
}
