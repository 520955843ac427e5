//! The exported functions around the one that finds rows: `NAME_detect`, `NAME_ranges`, `NAME_reset`, `NAME_info`.

use cranelift_codegen::ir::condcodes::IntCC;
use cranelift_codegen::ir::types::{F32, I32, I64};
use cranelift_codegen::ir::{AbiParam, FuncRef, Function, GlobalValue, InstBuilder, Signature, Value};
use cranelift_codegen::isa::TargetIsa;
use cranelift_frontend::{FunctionBuilder, FunctionBuilderContext};
use vsonar_ir::machine::Machine;

use super::pixels::PLAIN;
use crate::camera::ground::{Ground, GroundRange, median_of_three};
use crate::exec::cranelift::Shape;
use crate::exec::cranelift::emit::Emitter;
use crate::export::ERROR_NULL;

/// Bytes of a `NAME_range`: row, bearing, distance, nearest, farthest, status.
const RANGE_BYTES: i64 = 24;

/// Begins a function with so many pointer-sized parameters; runs `body` with their values.
fn function(
    isa: &dyn TargetIsa,
    context: &mut FunctionBuilderContext,
    function: &mut Function,
    params: usize,
    result: Option<AbiParam>,
    body: impl FnOnce(&mut Emitter<'_, '_>, &[Value]),
) {
    function.signature = Signature::new(isa.default_call_conv());
    function.signature.params.extend(vec![AbiParam::new(isa.pointer_type()); params]);
    function.signature.returns.extend(result);
    let mut b = FunctionBuilder::new(function, context);
    let entry = b.create_block();
    b.append_block_params_for_function_params(entry);
    let params: Vec<Value> = b.block_params(entry).to_vec();
    let mut e = Emitter::new(&mut b, isa, Shape::Scalar, None);
    e.switch_to_block(entry);
    body(&mut e, &params);
    b.seal_all_blocks();
    b.finalize(isa.frontend_config());
}

/// `NAME_detect(luma, row_stride, pixel_stride, columns, n, rows)`.
pub(super) fn detect(
    isa: &dyn TargetIsa,
    context: &mut FunctionBuilderContext,
    target: &mut Function,
    rows: impl FnOnce(&mut Function) -> FuncRef,
) {
    let rows = rows(target);
    function(isa, context, target, 6, Some(AbiParam::new(I32).sext()), |e, params| {
        let step = e.b.ins().iconst(I64, 4);
        let call = e.b.ins().call(rows, &[params, &[step]].concat());
        let code = e.b.inst_results(call)[0];
        e.b.ins().return_(&[code]);
    });
}

/// `NAME_ranges(luma, row_stride, pixel_stride, columns, n, state, ranges)`.
pub(super) fn ranges(
    isa: &dyn TargetIsa,
    context: &mut FunctionBuilderContext,
    target: &mut Function,
    ground: &Ground,
    median: bool,
    rows: impl FnOnce(&mut Function) -> FuncRef,
) {
    let rows = rows(target);
    function(isa, context, target, 7, Some(AbiParam::new(I32).sext()), |e, params| {
        let &[luma, row_stride, pixel_stride, columns, n, state, out] = params else {
            unreachable!("there are seven parameters")
        };
        if median {
            let (missing, there) = (e.b.create_block(), e.b.create_block());
            let null = e.b.ins().icmp_imm_u(IntCC::Equal, state, 0);
            let some = e.b.ins().icmp_imm_u(IntCC::NotEqual, n, 0);
            let wrong = e.b.ins().band(null, some);
            e.b.ins().brif(wrong, missing, &[], there, &[]);
            e.switch_to_block(missing);
            let code = e.b.ins().iconst(I32, i64::from(ERROR_NULL));
            e.b.ins().return_(&[code]);
            e.switch_to_block(there);
        }
        let step = e.b.ins().iconst(I64, RANGE_BYTES);
        let call = e.b.ins().call(rows, &[luma, row_stride, pixel_stride, columns, n, out, step]);
        let code = e.b.inst_results(call)[0];
        let some = e.b.ins().icmp_imm_u(IntCC::NotEqual, n, 0);
        let sound = e.b.ins().icmp_imm_s(IntCC::Equal, code, 0);
        let go_on = e.b.ins().band(some, sound);
        each(e, n, go_on, |e, i| {
            let offset = e.b.ins().ishl_imm_u(i, 2);
            let column = e.b.ins().iadd(columns, offset);
            let column = e.b.ins().load(I32, PLAIN, column, 0);
            let column = e.b.ins().fcvt_from_sint(F32, column);
            let offset = e.b.ins().imul_imm_s(i, RANGE_BYTES);
            let range = e.b.ins().iadd(out, offset);
            let mut row = e.b.ins().load(F32, PLAIN, range, 0);
            if median {
                let offset = e.b.ins().ishl_imm_u(i, 3);
                let state = e.b.ins().iadd(state, offset);
                let previous = e.b.ins().load(F32, PLAIN, state, 0);
                let before = e.b.ins().load(F32, PLAIN, state, 4);
                e.b.ins().store(PLAIN, previous, state, 4);
                e.b.ins().store(PLAIN, row, state, 0);
                row = median_of_three(e, row, previous, before);
            }
            let GroundRange { bearing, distance, nearest, farthest, status } = ground.range(e, column, row);
            for (k, value) in [row, bearing, distance, nearest, farthest, status].into_iter().enumerate() {
                e.b.ins().store(PLAIN, value, range, 4 * k as i32);
            }
        });
        e.b.ins().return_(&[code]);
    });
}

/// `NAME_reset(state, n)`.
pub(super) fn reset(
    isa: &dyn TargetIsa,
    context: &mut FunctionBuilderContext,
    target: &mut Function,
    median: bool,
) {
    function(isa, context, target, 2, None, |e, params| {
        let &[state, n] = params else { unreachable!("there are two parameters") };
        if median {
            let there = e.b.ins().icmp_imm_u(IntCC::NotEqual, state, 0);
            let some = e.b.ins().icmp_imm_u(IntCC::NotEqual, n, 0);
            let go_on = e.b.ins().band(there, some);
            each(e, n, go_on, |e, i| {
                let offset = e.b.ins().ishl_imm_u(i, 3);
                let at = e.b.ins().iadd(state, offset);
                let nan = e.f32(f32::NAN);
                e.b.ins().store(PLAIN, nan, at, 0);
                e.b.ins().store(PLAIN, nan, at, 4);
            });
        }
        e.b.ins().return_(&[]);
    });
}

/// `NAME_info()`: the address of the data.
pub(super) fn info(
    isa: &dyn TargetIsa,
    context: &mut FunctionBuilderContext,
    target: &mut Function,
    data: impl FnOnce(&mut Function) -> GlobalValue,
) {
    let data = data(target);
    function(isa, context, target, 0, Some(AbiParam::new(isa.pointer_type())), |e, _| {
        let address = e.b.ins().symbol_value(I64, data);
        e.b.ins().return_(&[address]);
    });
}

/// Where `go_on` holds, runs `body` for each number below `n`, which is not 0 then.
fn each(e: &mut Emitter<'_, '_>, n: Value, go_on: Value, body: impl FnOnce(&mut Emitter<'_, '_>, Value)) {
    let (block, done) = (e.b.create_block(), e.b.create_block());
    let i = e.b.append_block_param(block, I64);
    let zero = e.b.ins().iconst(I64, 0);
    e.b.ins().brif(go_on, block, &[zero.into()], done, &[]);
    e.switch_to_block(block);
    body(e, i);
    let next = e.b.ins().iadd_imm_s(i, 1);
    let more = e.b.ins().icmp(IntCC::UnsignedLessThan, next, n);
    e.b.ins().brif(more, block, &[next.into()], done, &[]);
    e.switch_to_block(done);
}
