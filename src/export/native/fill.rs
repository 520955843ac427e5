//! The function that computes the window averages of one lane and tile.

use cranelift_codegen::ir::condcodes::IntCC;
use cranelift_codegen::ir::types::{F32, F32X4, I16X8, I32, I32X4, I64};
use cranelift_codegen::ir::{AbiParam, Block, Function, InstBuilder, Signature, Value};
use cranelift_codegen::isa::TargetIsa;
use cranelift_frontend::{FunctionBuilder, FunctionBuilderContext};
use vsonar_ir::Operator;
use vsonar_ir::formula::image::{self as formula, Neighbourhood, PixelMachine};

use super::copy::{self, Image};
use super::pixels::{Lane, PLAIN, PixelEmitter, Pixels};
use super::plan::{CHUNK, Plan, PlannedOperand, SumKind};

/// The signature of a fill: luma, pixel stride, the offsets of the tile's rows from luma, beginning with the row above
/// its first window ([`Plan::copied_rows`]), scratch memory, where the averages go; then as a 32-bit integer the centre
/// column.
pub(super) fn signature(isa: &dyn TargetIsa) -> Signature {
    let mut signature = Signature::new(isa.default_call_conv());
    signature.params.extend([AbiParam::new(isa.pointer_type()); 5]);
    signature.params.push(AbiParam::new(I32).sext());
    signature
}

/// Builds the fill of a loop.
pub(super) fn function(
    plan: &Plan,
    vectors: bool,
    isa: &dyn TargetIsa,
    context: &mut FunctionBuilderContext,
    function: &mut Function,
) {
    function.signature = signature(isa);
    let mut b = FunctionBuilder::new(function, context);
    let entry = b.create_block();
    b.append_block_params_for_function_params(entry);
    b.switch_to_block(entry);
    let params: Vec<Value> = b.block_params(entry).to_vec();
    let &[luma, pixel_stride, rows, scratch, out, x] = params.as_slice() else {
        unreachable!("the signature has six parameters")
    };
    copy::copy(&mut b, plan, vectors, &Image { luma, pixel_stride, rows, x }, scratch);
    let mut fill = Fill { plan, b: &mut b, vectors, scratch, out };
    fill.row_sums();
    fill.averages();
    b.ins().return_(&[]);
    b.seal_all_blocks();
    b.finalize(isa.frontend_config());
}

/// Emits a loop that runs its body at least once, for a counter from 0 in steps up to, but without, `end`.
pub(super) fn repeat(
    b: &mut FunctionBuilder<'_>,
    end: i64,
    step: i64,
    body: impl FnOnce(&mut FunctionBuilder<'_>, Value),
) {
    let start = b.ins().iconst(I64, 0);
    repeat_from(b, start, end, step, body);
}

/// The same from `start`, which is below `end`.
pub(super) fn repeat_from(
    b: &mut FunctionBuilder<'_>,
    start: Value,
    end: i64,
    step: i64,
    body: impl FnOnce(&mut FunctionBuilder<'_>, Value),
) {
    let (block, done): (Block, Block) = (b.create_block(), b.create_block());
    let i = b.append_block_param(block, I64);
    b.ins().jump(block, &[start.into()]);
    b.switch_to_block(block);
    body(b, i);
    let next = b.ins().iadd_imm_s(i, step);
    let end = b.ins().iconst(I64, end);
    let more = b.ins().icmp(IntCC::UnsignedLessThan, next, end);
    b.ins().brif(more, block, &[next.into()], done, &[]);
    b.switch_to_block(done);
}

struct Fill<'p, 'b, 'f> {
    plan: &'p Plan,
    b: &'b mut FunctionBuilder<'f>,
    vectors: bool,
    scratch: Value,
    out: Value,
}

impl Fill<'_, '_, '_> {
    /// Computes the operators of all rows of the tile, and sums them over the width of the window.
    fn row_sums(&mut self) {
        let (plan, scratch, vectors) = (self.plan, self.scratch, self.vectors);
        let step = if vectors { i64::from(CHUNK) } else { 1 };
        repeat(self.b, i64::from(plan.rows), step, |b, i| {
            let column = b.ins().iadd(scratch, i);
            let mut m = PixelEmitter::new(b, vectors);
            let mut bytes: Vec<[Option<Pixels>; 3]> = vec![[None; 3]; plan.columns() as usize];
            for (operator, moments) in plan.moments() {
                let mut sums: [Option<[Pixels; 2]>; 2] = [None; 2];
                for c in 0..plan.rect.width() {
                    let n = neighbourhood(&mut m, plan, column, &mut bytes, c, operator);
                    let value = formula::apply(&mut m, operator, &n);
                    for (sum, number) in sums.iter_mut().zip(moments) {
                        let Some(number) = number else { continue };
                        let mean = plan.operands[number].operand.moment == vsonar_ir::Moment::Mean;
                        let value = if mean { value } else { m.mul(value, value) };
                        let parts = match plan.operands[number].kind {
                            SumKind::Split => m.halves(value),
                            _ => [value; 2],
                        };
                        *sum = Some(match *sum {
                            None => parts,
                            Some(sum) => [m.add(sum[0], parts[0]), m.add(sum[1], parts[1])],
                        });
                    }
                }
                for (sum, number) in sums.into_iter().zip(moments) {
                    if let (Some(sum), Some(number)) = (sum, number) {
                        store_sums(&mut m, plan, &plan.operands[number], sum, scratch, i);
                    }
                }
            }
        });
    }

    /// Sums the row sums over the height of the window, and divides by the area.
    fn averages(&mut self) {
        let (plan, scratch, out, vectors) = (self.plan, self.scratch, self.out, self.vectors);
        let step = if vectors { 8 } else { 1 };
        repeat(self.b, i64::from(plan.rows), step, |b, i| {
            let to = b.ins().ishl_imm_u(i, 2);
            let to = b.ins().iadd(out, to);
            for (number, p) in plan.operands.iter().enumerate() {
                let offset = number as i32 * plan.strip_bytes();
                match p.kind {
                    SumKind::Split if vectors => {}
                    _ if vectors => vector_averages(b, plan, p, scratch, i, to, offset),
                    _ => scalar_average(b, plan, p, scratch, i, to, offset),
                }
            }
        });
        if !vectors || !plan.operands.iter().any(|p| p.kind == SumKind::Split) {
            return;
        }
        repeat(self.b, i64::from(plan.rows), 1, |b, i| {
            let to = b.ins().ishl_imm_u(i, 2);
            let to = b.ins().iadd(out, to);
            for (number, p) in plan.operands.iter().enumerate().filter(|(_, p)| p.kind == SumKind::Split) {
                scalar_average(b, plan, p, scratch, i, to, number as i32 * plan.strip_bytes());
            }
        });
    }
}

/// The neighbourhood of window column `c`, of which only what the operator looks at is loaded.
fn neighbourhood(
    m: &mut PixelEmitter<'_, '_>,
    plan: &Plan,
    column: Value,
    bytes: &mut [[Option<Pixels>; 3]],
    c: u32,
    operator: Operator,
) -> Neighbourhood<Pixels> {
    let centre = (c + plan.beside[0]) as usize;
    let mut load = |across: usize, down: usize| {
        // The number of the byte column, to the left or the right of the centre.
        let at = (centre + across).saturating_sub(1);
        *bytes[at][down].get_or_insert_with(|| m.load(column, at as i32 * plan.column_bytes + down as i32))
    };
    let mut n = [load(1, 1); 9];
    let looks = formula::looks(operator);
    for i in (0..9).filter(|&i| i != 4 && looks[i]) {
        // The medians do not care for the order, and column by column the sorting of three pixels above each other
        // serves three neighbourhoods.
        let turned = matches!(operator, Operator::Median | Operator::MedianCorner);
        let (across, down) = if turned { (i / 3, i % 3) } else { (i % 3, i / 3) };
        n[i] = load(across, down);
    }
    n
}

/// Where row `i` of the tile stands in an operand's row sums, but for their own place in the scratch memory.
fn row_sums_from(b: &mut FunctionBuilder<'_>, p: &PlannedOperand, scratch: Value, i: Value) -> Value {
    let bytes = b.ins().ishl_imm_u(i, if p.kind == SumKind::Half { 1 } else { 2 });
    b.ins().iadd(scratch, bytes)
}

/// Stores row sums from row `i` of the tile on.
fn store_sums(
    m: &mut PixelEmitter<'_, '_>,
    plan: &Plan,
    p: &PlannedOperand,
    sum: [Pixels; 2],
    scratch: Value,
    i: Value,
) {
    let (lane, arrays) = match p.kind {
        SumKind::Half => (Lane::Half, 1),
        SumKind::Word => (Lane::Word, 1),
        SumKind::Split => (Lane::Word, 2),
    };
    let to = row_sums_from(m.b, p, scratch, i);
    for (array, &sum) in sum.iter().enumerate().take(arrays) {
        let offset = p.row_sums + (array as u32 * (plan.rows + CHUNK) * 4) as i32;
        if m.rows() == 1 {
            let value = sum.parts()[0];
            if p.kind == SumKind::Half {
                m.b.ins().istore16(PLAIN, value, to, offset);
            } else {
                m.b.ins().store(PLAIN, value, to, offset);
            }
            continue;
        }
        let sum = m.widen(sum, lane);
        for (part, &value) in sum.parts().iter().enumerate() {
            m.b.ins().store(PLAIN, value, to, offset + 16 * part as i32);
        }
    }
}

/// The averages of eight positions from `i` on.
fn vector_averages(
    b: &mut FunctionBuilder<'_>,
    plan: &Plan,
    p: &PlannedOperand,
    scratch: Value,
    i: Value,
    to: Value,
    offset: i32,
) {
    let half = p.kind == SumKind::Half;
    let from = row_sums_from(b, p, scratch, i);
    let sum = |b: &mut FunctionBuilder<'_>, ty, first: i32| {
        let row = |b: &mut FunctionBuilder<'_>, k: i32| {
            b.ins().load(ty, PLAIN, from, p.row_sums + first + k * p.kind.bytes())
        };
        let mut sum = row(b, 0);
        for k in 1..plan.rect.height() as i32 {
            let next = row(b, k);
            sum = b.ins().iadd(sum, next);
        }
        sum
    };
    let words = if half {
        let sum = sum(b, I16X8, 0);
        [b.ins().uwiden_low(sum), b.ins().uwiden_high(sum)]
    } else {
        [sum(b, I32X4, 0), sum(b, I32X4, 16)]
    };
    let area = plan.rect.area();
    for (part, word) in words.into_iter().enumerate() {
        let value = b.ins().fcvt_from_sint(F32X4, word);
        // The reciprocal of a power of two is exact, and so is the product with it.
        let exact = area.is_power_of_two();
        let divisor = b.ins().f32const(if exact { 1.0 / area as f32 } else { area as f32 });
        let divisor = b.ins().splat(F32X4, divisor);
        let value = if exact { b.ins().fmul(value, divisor) } else { b.ins().fdiv(value, divisor) };
        b.ins().store(PLAIN, value, to, offset + 16 * part as i32);
    }
}

/// The average of position `i`.
fn scalar_average(
    b: &mut FunctionBuilder<'_>,
    plan: &Plan,
    p: &PlannedOperand,
    scratch: Value,
    i: Value,
    to: Value,
    offset: i32,
) {
    let half = p.kind == SumKind::Half;
    let from = row_sums_from(b, p, scratch, i);
    let sum = |b: &mut FunctionBuilder<'_>, first: i32| {
        let mut sum = None;
        for k in 0..plan.rect.height() as i32 {
            let at = p.row_sums + first + k * if half { 2 } else { 4 };
            let value =
                if half { b.ins().uload16(I32, PLAIN, from, at) } else { b.ins().load(I32, PLAIN, from, at) };
            sum = Some(sum.map_or(value, |sum| b.ins().iadd(sum, value)));
        }
        sum.unwrap_or_else(|| unreachable!("a rectangle has rows"))
    };
    let value = if p.kind == SumKind::Split {
        let (low, high) = (sum(b, 0), sum(b, ((plan.rows + CHUNK) * 4) as i32));
        let (low, high) = (b.ins().uextend(I64, low), b.ins().uextend(I64, high));
        let high = b.ins().ishl_imm_u(high, 16);
        let whole = b.ins().iadd(low, high);
        b.ins().fcvt_from_sint(F32, whole)
    } else {
        let whole = sum(b, 0);
        b.ins().fcvt_from_sint(F32, whole)
    };
    let area = b.ins().f32const(plan.rect.area() as f32);
    let value = b.ins().fdiv(value, area);
    b.ins().store(PLAIN, value, to, offset);
}
