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

/// A compiled entry. The first argument points to the `x_obstacle` of the first lane to run in a [`LaneBlock`], the
/// second to the addresses of the operands' strips, by the operands' numbers (those that are not read are not
/// looked at), and the third is the first lane's offset in a row, in bytes.
pub(crate) type Entry = unsafe extern "C" fn(*mut f32, *const *const f32, usize);

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

/// Reads window operands from strips: row after row, [`LANES`] lanes a row, each operand at its own address.
pub(crate) struct StripSource {
    table: ir::Value,
    lane: ir::Value,
    operands: Vec<Operand>,
    /// Addresses of the strips that are read, at the first lane to run.
    strips: [Option<ir::Value>; Operand::COUNT],
    first: i64,
    last: i64,
    step: i64,
    position: Option<ir::Value>,
}

impl StripSource {
    /// The strips whose addresses stand at the address `table`, from the lane whose offset in bytes is `lane`, for a
    /// loop in an image `height` pixels high.
    pub(crate) fn new(table: ir::Value, lane: ir::Value, l: &Loop, height: u32) -> StripSource {
        let (top, bottom) = (0, (i64::from(l.rect().positions(height)) - 1) * ROW);
        let (start, last, step) = match l.direction() {
            Direction::Up => (bottom, top, -ROW),
            Direction::Down => (top, bottom, ROW),
        };
        let first = if l.span() == Span::Last { last } else { start };
        let strips = [None; Operand::COUNT];
        StripSource { table, lane, operands: l.operands(), strips, first, last, step, position: None }
    }
}

impl WindowSource for StripSource {
    fn begin(&mut self, e: &mut Emitter<'_, '_>) -> Vec<ir::Value> {
        let pointer = e.b.func.dfg.value_type(self.table);
        let flags = MemFlagsData::trusted().with_readonly();
        for operand in &self.operands {
            let offset = i32::from(operand.index()) * pointer.bytes() as i32;
            let strip = e.b.ins().load(pointer, flags, self.table, offset);
            self.strips[usize::from(operand.index())] = Some(e.b.ins().iadd(strip, self.lane));
        }
        vec![e.b.ins().iconst(pointer, self.first)]
    }

    fn enter(&mut self, carried: &[ir::Value]) {
        self.position = Some(carried[0]);
    }

    fn window(&mut self, e: &mut Emitter<'_, '_>, operand: Operand) -> ir::Value {
        let position = self.position.expect("a row has been entered");
        let strip = self.strips[usize::from(operand.index())].expect("the loop reads this operand");
        let address = e.b.ins().iadd(strip, position);
        let ty = e.shape().ty(Ty::F32);
        e.b.ins().load(ty, MemFlagsData::trusted().with_readonly(), address, 0)
    }

    fn advance(&mut self, e: &mut Emitter<'_, '_>) -> (Vec<ir::Value>, ir::Value) {
        let position = self.position.expect("a row has been entered");
        let more = e.b.ins().icmp_imm_s(IntCC::NotEqual, position, self.last);
        (vec![e.b.ins().iadd_imm_s(position, self.step)], more)
    }
}
