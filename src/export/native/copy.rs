//! Pixels into byte columns, the border replicated: what a fill begins with.

use cranelift_codegen::ir::condcodes::IntCC;
use cranelift_codegen::ir::types::{F64, F64X2, I8, I8X16, I32, I64};
use cranelift_codegen::ir::{Endianness, InstBuilder, MemFlagsData, Value};
use cranelift_frontend::FunctionBuilder;

use super::fill::{repeat, repeat_from};
use super::pixels::{PLAIN, interleave, shuffle};
use super::plan::{CHUNK, Plan};

/// The frame and the place in it.
pub(super) struct Image {
    pub(super) luma: Value,
    pub(super) pixel_stride: Value,
    /// Address of the rows' offsets.
    pub(super) rows: Value,
    /// The centre column.
    pub(super) x: Value,
}

/// Pixels that are loaded at a time from a row. Lanes count from the lowest address.
const GROUP: u32 = 8;
const PIXELS: MemFlagsData = PLAIN.with_endianness(Endianness::Little);

/// Emits the offsets, from luma, of the rows that a tile copies, the first of them being row `above`, a 64-bit integer
/// that may lie outside the image.
pub(super) fn row_offsets(
    b: &mut FunctionBuilder<'_>,
    plan: &Plan,
    row_stride: Value,
    above: Value,
    to: Value,
) {
    let (lowest, highest) = (b.ins().iconst(I64, 0), b.ins().iconst(I64, i64::from(plan.height) - 1));
    repeat(b, plan.copied_rows(), 1, |b, i| {
        let row = b.ins().iadd(above, i);
        let row = larger(b, row, lowest);
        let row = smaller(b, row, highest);
        let offset = b.ins().imul(row, row_stride);
        let at = b.ins().ishl_imm_u(i, 3);
        let at = b.ins().iadd(to, at);
        b.ins().store(PLAIN, offset, at, 0);
    });
}

/// Copies the pixels of a tile into byte columns.
pub(super) fn copy(b: &mut FunctionBuilder<'_>, plan: &Plan, vectors: bool, image: &Image, scratch: Value) {
    let columns = plan.columns();
    let first = b.ins().iadd_imm_s(image.x, -i64::from(plan.rect.left() + plan.beside[0]));
    let (lowest, highest) = (b.ins().iconst(I32, 0), b.ins().iconst(I32, i64::from(plan.width) - 1));
    let addresses: Vec<Value> = (0..columns)
        .map(|i| {
            let mut column = b.ins().iadd_imm_s(first, i64::from(i));
            // The window lies inside the image; only what is beside it may not.
            if i == 0 && plan.beside[0] == 1 {
                column = larger(b, column, lowest);
            }
            if i == columns - 1 && plan.beside[1] == 1 {
                column = smaller(b, column, highest);
            }
            let column = b.ins().sextend(I64, column);
            let offset = b.ins().imul(column, image.pixel_stride);
            b.ins().iadd(image.luma, offset)
        })
        .collect();
    let mut start = b.ins().iconst(I64, 0);
    if vectors && plan.width >= GROUP {
        start = by_groups(b, plan, image, first, addresses[0], scratch);
    }
    let rows = image.rows;
    repeat_from(b, start, plan.copied_rows(), 1, |b, i| {
        let at = b.ins().ishl_imm_u(i, 3);
        let at = b.ins().iadd(rows, at);
        let row = b.ins().load(I64, PLAIN, at, 0);
        let to = b.ins().iadd(scratch, i);
        for (c, &address) in addresses.iter().enumerate() {
            let from = b.ins().iadd(address, row);
            let pixel = b.ins().load(I8, PLAIN, from, 0);
            b.ins().store(PLAIN, pixel, to, c as i32 * plan.column_bytes);
        }
    });
}

/// Where the pixels of a row lie side by side and far enough from the border, squares of them are turned round in
/// registers. The number of rows that have been copied.
fn by_groups(
    b: &mut FunctionBuilder<'_>,
    plan: &Plan,
    image: &Image,
    first: Value,
    address: Value,
    scratch: Value,
) -> Value {
    let columns = plan.columns();
    let (fast, done) = (b.create_block(), b.create_block());
    let copied = b.append_block_param(done, I64);
    // All pixels of a group lie inside the image. (As an unsigned number, one to the left of it is large.)
    let last = plan.width - columns.max(GROUP);
    let inside = b.ins().icmp_imm_u(IntCC::UnsignedLessThanOrEqual, first, i64::from(last));
    let dense = b.ins().icmp_imm_u(IntCC::Equal, image.pixel_stride, 1);
    let both = b.ins().band(inside, dense);
    let none = b.ins().iconst(I64, 0);
    b.ins().brif(both, fast, &[], done, &[none.into()]);
    b.switch_to_block(fast);
    // The groups of a wide window overlap.
    let groups: &[u32] = if columns > GROUP { &[0, columns - GROUP] } else { &[0] };
    let rows = image.rows;
    repeat(b, i64::from(plan.rows), i64::from(CHUNK), |b, i| {
        let at = b.ins().ishl_imm_u(i, 3);
        let at = b.ins().iadd(rows, at);
        let to = b.ins().iadd(scratch, i);
        let from: Vec<Value> = (0..CHUNK as i32)
            .map(|row| {
                let offset = b.ins().load(I64, PLAIN, at, 8 * row);
                b.ins().iadd(address, offset)
            })
            .collect();
        for &group in groups {
            let loaded = from
                .iter()
                .map(|&from| {
                    // As a number of 64 bits, which is not computed with.
                    let pixels = b.ins().load(F64, PIXELS, from, group as i32);
                    let pixels = b.ins().scalar_to_vector(F64X2, pixels);
                    b.ins().bitcast(I8X16, MemFlagsData::new().with_endianness(Endianness::Little), pixels)
                })
                .collect();
            for (c, column) in turned(b, loaded).into_iter().enumerate() {
                let c = c as u32 + group;
                if c < columns {
                    b.ins().store(PLAIN, column, to, c as i32 * plan.column_bytes);
                }
            }
        }
    });
    let copied_rows = b.ins().iconst(I64, i64::from(plan.rows));
    b.ins().jump(done, &[copied_rows.into()]);
    b.switch_to_block(done);
    copied
}

/// Eight columns of sixteen rows out of sixteen rows of eight columns. Each step takes the bytes of two vectors in
/// turn, of those that are half of all apart, so that after four steps the rows stand in order.
fn turned(b: &mut FunctionBuilder<'_>, rows: Vec<Value>) -> Vec<Value> {
    let mut vectors: Vec<Value> =
        (0..8).map(|i| shuffle(b, rows[i], rows[i + 8], interleave(1, false))).collect();
    // After the first step there is one block of columns, 0 to 7; then two of four, four of two, eight of one.
    let mut blocks = vec![std::mem::take(&mut vectors)];
    while blocks[0].len() > 1 {
        blocks = blocks
            .into_iter()
            .flat_map(|block| {
                let half = block.len() / 2;
                [false, true].map(|upper| {
                    (0..half).map(|i| shuffle(b, block[i], block[i + half], interleave(1, upper))).collect()
                })
            })
            .collect();
    }
    blocks.concat()
}

/// The larger of two signed integers. (Some machines have no instruction for it.)
fn larger(b: &mut FunctionBuilder<'_>, x: Value, y: Value) -> Value {
    let greater = b.ins().icmp(IntCC::SignedGreaterThan, x, y);
    b.ins().select(greater, x, y)
}

/// The smaller of two signed integers.
fn smaller(b: &mut FunctionBuilder<'_>, x: Value, y: Value) -> Value {
    let less = b.ins().icmp(IntCC::SignedLessThan, x, y);
    b.ins().select(less, x, y)
}
