//! The function that finds the rows of any number of columns: the whole detector, from pixels to answers.
//!
//! It checks its arguments, then takes the columns in groups of as many lanes as the target has, and runs both loops
//! for each group.

use cranelift_codegen::ir::condcodes::IntCC;
use cranelift_codegen::ir::types::{I32, I64};
use cranelift_codegen::ir::{
    AbiParam, FuncRef, Function, InstBuilder, Signature, StackSlot, StackSlotData, StackSlotKind, Value,
};
use cranelift_codegen::isa::TargetIsa;
use cranelift_frontend::{FunctionBuilder, FunctionBuilderContext};
use vsonar_ir::formula::arith;
use vsonar_ir::machine::Machine;
use vsonar_ir::op::Depends;
use vsonar_ir::{Leaf, Loop, Program, Ty};

use super::pixels::PLAIN;
use super::plan::Plan;
use super::source::{Frame, Layout, TileSource};
use crate::exec::cranelift::Shape;
use crate::exec::cranelift::emit::Emitter;
use crate::exec::cranelift::emit_loop::{Inputs, emit_column, emit_loop};
use crate::exec::wanted;
use crate::export::{ERROR_COLUMN, ERROR_NULL, ERROR_STRIDE};

/// The signature: luma, row stride, pixel stride, columns, how many, where the rows go, and bytes from one row to the
/// next.
pub(super) fn signature(isa: &dyn TargetIsa) -> Signature {
    let mut signature = Signature::new(isa.default_call_conv());
    signature.params.extend([AbiParam::new(isa.pointer_type()); 7]);
    signature.returns.push(AbiParam::new(I32).sext());
    signature
}

/// The plans of the first and the second loop, as far as they look at windows.
pub(super) fn plans(program: &Program) -> [Option<Plan>; 2] {
    if program.constant_answer().is_some() {
        return [None, None];
    }
    let plan = |l: &Loop| {
        let single = l.span() == vsonar_ir::Span::Last;
        Plan::new(l, program.width(), program.height(), single)
    };
    [program.first().and_then(plan), plan(program.second())]
}

/// What the function is made of.
pub(super) struct Rows<'p> {
    pub(super) program: &'p Program,
    pub(super) plans: &'p [Option<Plan>; 2],
    pub(super) shape: Shape,
    pub(super) isa: &'p dyn TargetIsa,
}

/// Values that last for the whole function.
struct Call {
    frame: Frame,
    columns: Value,
    n: Value,
    out: Value,
    step: Value,
    fills: [Option<FuncRef>; 2],
    scratch: StackSlot,
    /// Four 32-bit integers: the columns asked for, then those that a loop iterates in, then the answers.
    lanes: StackSlot,
}

impl Rows<'_> {
    /// Builds the function; `fills` gives references to the fills of both loops.
    pub(super) fn function(
        &self,
        context: &mut FunctionBuilderContext,
        function: &mut Function,
        fills: impl FnOnce(&mut Function) -> [Option<FuncRef>; 2],
    ) {
        function.signature = signature(self.isa);
        let fills = fills(function);
        let mut b = FunctionBuilder::new(function, context);
        let entry = b.create_block();
        b.append_block_params_for_function_params(entry);
        let params: Vec<Value> = b.block_params(entry).to_vec();
        let &[luma, row_stride, pixel_stride, columns, n, out, step] = params.as_slice() else {
            unreachable!("the signature has seven parameters")
        };
        let bytes = self.plans.iter().flatten().map(|plan| Layout::new(plan, self.shape).bytes).max();
        let slot = |b: &mut FunctionBuilder<'_>, bytes: u32| {
            b.create_sized_stack_slot(StackSlotData::new(StackSlotKind::ExplicitSlot, bytes, 4))
        };
        let scratch = slot(&mut b, bytes.unwrap_or(0).max(16).cast_unsigned());
        let lanes = slot(&mut b, 16);
        let frame = Frame { luma, row_stride, pixel_stride };
        let call = Call { frame, columns, n, out, step, fills, scratch, lanes };

        let mut e = Emitter::new(&mut b, self.isa, self.shape, None);
        e.switch_to_block(entry);
        self.check(&mut e, &call);
        self.groups(&mut e, &call);
        let zero = e.b.ins().iconst(I32, 0);
        e.b.ins().return_(&[zero]);
        b.seal_all_blocks();
        b.finalize(self.isa.frontend_config());
    }

    /// Refuses arguments that cannot be; the current block afterwards is reached with sound ones alone.
    fn check(&self, e: &mut Emitter<'_, '_>, call: &Call) {
        let (width, height) = (i64::from(self.program.width()), i64::from(self.program.height()));
        let empty = e.b.ins().icmp_imm_u(IntCC::Equal, call.n, 0);
        refuse(e, empty, 0);
        for pointer in [call.frame.luma, call.columns, call.out] {
            let null = e.b.ins().icmp_imm_u(IntCC::Equal, pointer, 0);
            refuse(e, null, ERROR_NULL);
        }
        let Frame { row_stride, pixel_stride, .. } = call.frame;
        // Strides at which the address of no pixel overflows.
        let less = e.b.ins().iadd_imm_s(pixel_stride, -1);
        let wrong = e.b.ins().icmp_imm_u(IntCC::UnsignedGreaterThanOrEqual, less, i64::MAX / width);
        refuse(e, wrong, ERROR_STRIDE);
        let needed = e.b.ins().imul_imm_s(pixel_stride, width - 1);
        let wrong = e.b.ins().icmp(IntCC::UnsignedLessThanOrEqual, row_stride, needed);
        refuse(e, wrong, ERROR_STRIDE);
        let wrong = e.b.ins().icmp_imm_u(IntCC::UnsignedGreaterThan, row_stride, i64::MAX / height);
        refuse(e, wrong, ERROR_STRIDE);

        let (block, next, done) = (e.b.create_block(), e.b.create_block(), e.b.create_block());
        let i = e.b.append_block_param(block, I64);
        let zero = e.b.ins().iconst(I64, 0);
        e.b.ins().jump(block, &[zero.into()]);
        e.switch_to_block(block);
        let column = element(e, call.columns, i);
        let column = e.b.ins().load(I32, PLAIN, column, 0);
        let outside = e.b.ins().icmp_imm_u(IntCC::UnsignedGreaterThanOrEqual, column, width);
        refuse(e, outside, ERROR_COLUMN);
        e.b.ins().jump(next, &[]);
        e.switch_to_block(next);
        let following = e.b.ins().iadd_imm_s(i, 1);
        let more = e.b.ins().icmp(IntCC::UnsignedLessThan, following, call.n);
        e.b.ins().brif(more, block, &[following.into()], done, &[]);
        e.switch_to_block(done);
    }

    /// All columns, group after group.
    fn groups(&self, e: &mut Emitter<'_, '_>, call: &Call) {
        let lanes = self.shape.lanes() as i64;
        let (group, done) = (e.b.create_block(), e.b.create_block());
        let first = e.b.append_block_param(group, I64);
        let zero = e.b.ins().iconst(I64, 0);
        e.b.ins().jump(group, &[zero.into()]);
        e.switch_to_block(group);
        let left = e.b.ins().isub(call.n, first);
        let all = e.b.ins().iconst(I64, lanes);
        let fewer = e.b.ins().icmp(IntCC::UnsignedLessThan, left, all);
        let count = e.b.ins().select(fewer, left, all);

        let answer = match self.program.constant_answer() {
            Some(answer) => e.f32(answer),
            None => self.group(e, call, first, count),
        };

        let slot = e.b.ins().stack_addr(I64, call.lanes, 0);
        e.b.ins().store(PLAIN, answer, slot, 0);
        let (block, stored) = (e.b.create_block(), e.b.create_block());
        let lane = e.b.append_block_param(block, I64);
        let zero = e.b.ins().iconst(I64, 0);
        e.b.ins().jump(block, &[zero.into()]);
        e.switch_to_block(block);
        let from = element(e, slot, lane);
        // Moved as bits, for a number may be a NaN.
        let row = e.b.ins().load(I32, PLAIN, from, 0);
        let number = e.b.ins().iadd(first, lane);
        let offset = e.b.ins().imul(number, call.step);
        let to = e.b.ins().iadd(call.out, offset);
        e.b.ins().store(PLAIN, row, to, 0);
        let next = e.b.ins().iadd_imm_s(lane, 1);
        let more = e.b.ins().icmp(IntCC::UnsignedLessThan, next, count);
        e.b.ins().brif(more, block, &[next.into()], stored, &[]);
        e.switch_to_block(stored);

        let following = e.b.ins().iadd_imm_s(first, lanes);
        let more = e.b.ins().icmp(IntCC::UnsignedLessThan, following, call.n);
        // The number of columns may lie so high that the counter wraps.
        let ahead = e.b.ins().icmp(IntCC::UnsignedGreaterThan, following, first);
        let more = e.b.ins().band(more, ahead);
        e.b.ins().brif(more, group, &[following.into()], done, &[]);
        e.switch_to_block(done);
    }

    /// One group: the answers of its lanes. Lanes beyond `count` repeat the last column.
    fn group(&self, e: &mut Emitter<'_, '_>, call: &Call, first: Value, count: Value) -> Value {
        let most = e.b.ins().iadd_imm_s(count, -1);
        let slot = e.b.ins().stack_addr(I64, call.lanes, 0);
        for lane in 0..self.shape.lanes() as i64 {
            let number = e.b.ins().iconst(I64, lane);
            let within = e.b.ins().icmp(IntCC::UnsignedLessThan, number, most);
            let number = e.b.ins().select(within, number, most);
            let number = e.b.ins().iadd(first, number);
            let column = element(e, call.columns, number);
            let column = e.b.ins().load(I32, PLAIN, column, 0);
            e.b.ins().store(PLAIN, column, slot, 4 * lane as i32);
        }
        let (float, integer) = (self.shape.ty(Ty::F32), self.shape.ty(Ty::I32));
        let columns = e.b.ins().load(integer, PLAIN, slot, 0);
        let x_obstacle = e.b.ins().fcvt_from_sint(float, columns);
        let mut inputs = Lanes { x_obstacle, x: None, iter2: [None; 5] };
        if let Some(l) = self.program.first() {
            inputs.iter2 = self.run_loop(e, call, l, true, count, &mut inputs);
        }
        let finals = self.run_loop(e, call, self.program.second(), false, count, &mut inputs);
        finals[0].unwrap_or_else(|| unreachable!("the second loop's first register is wanted"))
    }

    fn run_loop(
        &self,
        e: &mut Emitter<'_, '_>,
        call: &Call,
        l: &Loop,
        first: bool,
        count: Value,
        inputs: &mut Lanes,
    ) -> [Option<Value>; 5] {
        let program = self.program;
        let value = emit_column(e, l.column(), inputs);
        let (lo, hi) = l.rect().columns(program.width());
        let x = arith::resolve_column(e, value, lo, hi);
        let slot = e.b.ins().stack_addr(I64, call.lanes, 0);
        e.b.ins().store(PLAIN, x, slot, 0);
        let float = self.shape.ty(Ty::F32);
        inputs.x = Some(e.b.ins().fcvt_from_sint(float, x));
        // Where all lanes iterate in the same column, one of them serves all.
        let same = l.column().block().dependences()[l.column().result().index()].within(Depends::NOTHING);
        let count = if same { e.b.ins().iconst(I64, 1) } else { count };
        let which = usize::from(!first);
        let mut source = TileSource::new(
            l,
            program.height(),
            self.plans[which].as_ref(),
            call.frame,
            call.scratch,
            call.fills[which],
            call.lanes,
            count,
            self.shape,
        );
        emit_loop(e, l, program.height(), wanted(program, first), &mut source, inputs)
    }
}

/// Returns `code` where the condition holds.
fn refuse(e: &mut Emitter<'_, '_>, condition: Value, code: i32) {
    let (wrong, sound) = (e.b.create_block(), e.b.create_block());
    e.b.set_cold_block(wrong);
    e.b.ins().brif(condition, wrong, &[], sound, &[]);
    e.switch_to_block(wrong);
    let code = e.b.ins().iconst(I32, i64::from(code));
    e.b.ins().return_(&[code]);
    e.switch_to_block(sound);
}

/// The address of a 32-bit element of an array.
fn element(e: &mut Emitter<'_, '_>, array: Value, number: Value) -> Value {
    let offset = e.b.ins().ishl_imm_u(number, 2);
    e.b.ins().iadd(array, offset)
}

/// The parameters of a group's lanes.
struct Lanes {
    x_obstacle: Value,
    x: Option<Value>,
    iter2: [Option<Value>; 5],
}

impl Inputs for Lanes {
    fn leaf(&mut self, e: &mut Emitter<'_, '_>, leaf: Leaf) -> Value {
        match leaf {
            Leaf::XObstacle => self.x_obstacle,
            Leaf::X => self.x.unwrap_or_else(|| unreachable!("in bodies alone")),
            Leaf::Iter2(k) => self.iter2[usize::from(k)].unwrap_or_else(|| e.f32(0.0)),
            _ => unreachable!("only parameters of the case are asked for here, not {leaf:?}"),
        }
    }
}
