//! The machine of the image operators: Cranelift integers, as narrow as the values allow.
//!
//! A value stands for the same pixel column in sixteen rows (or in one, where the target has no vectors). Its range
//! is known from the operations it comes from, and says how wide its lanes must be: the median family stays in
//! bytes, one vector for sixteen rows; the Sobel sums take two vectors of 16 bits, squares four of 32.

use cranelift_codegen::ir::condcodes::IntCC;
use cranelift_codegen::ir::types::{F32, F32X4, I8X16, I16X8, I32, I32X4};
use cranelift_codegen::ir::{self, Endianness, InstBuilder, MemFlagsData, Type};
use cranelift_frontend::FunctionBuilder;
use vsonar_ir::formula::image::PixelMachine;

/// Width of a lane, in bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Lane {
    Byte,
    Half,
    Word,
}

impl Lane {
    /// The narrowest lane for values from `low` to `high`: unsigned bytes, 16 bits of either sign, 32 bits.
    fn of(low: i64, high: i64) -> Lane {
        if low >= 0 && high <= 0xff {
            Lane::Byte
        } else if high <= 0x7fff && low >= -0x8000 || low >= 0 && high <= 0xffff {
            Lane::Half
        } else {
            Lane::Word
        }
    }

    const fn vector(self) -> Type {
        match self {
            Lane::Byte => I8X16,
            Lane::Half => I16X8,
            Lane::Word => I32X4,
        }
    }

    /// How many vectors hold sixteen rows.
    const fn parts(self) -> usize {
        1 << self as usize
    }
}

/// Values of sixteen rows from the top, in one, two or four vectors; or of one row.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pixels {
    parts: [ir::Value; 4],
    lane: Lane,
    low: i64,
    high: i64,
}

impl Pixels {
    /// The vectors.
    pub(super) fn parts(&self) -> &[ir::Value] {
        &self.parts[..self.lane.parts()]
    }
}

/// Truth values, in lanes of this width.
#[derive(Debug, Clone, Copy)]
pub(super) struct Truth {
    parts: [ir::Value; 4],
    lane: Lane,
    /// Whether the lanes say the opposite.
    inverted: bool,
}

/// Writes the operators' instructions into a function.
pub(super) struct PixelEmitter<'b, 'f> {
    pub(super) b: &'b mut FunctionBuilder<'f>,
    /// Sixteen rows at a time, else one.
    vectors: bool,
}

/// Vectors are reinterpreted lane by lane, whatever the byte order of the machine.
const REINTERPRET: MemFlagsData = MemFlagsData::new().with_endianness(Endianness::Little);
/// Memory of unknown alignment that is there.
pub(super) const PLAIN: MemFlagsData = MemFlagsData::new().with_notrap();

/// The bytes of two vectors, taken in turn from their lower halves: units of so many bytes.
pub(super) fn interleave(unit: u8, upper: bool) -> [u8; 16] {
    let first = if upper { 8 } else { 0 };
    std::array::from_fn(|i| {
        let (i, unit) = (i as u8, unit);
        let (pair, within) = (i / (2 * unit), i % (2 * unit));
        let second = within >= unit;
        first + pair * unit + within % unit + if second { 16 } else { 0 }
    })
}

/// One shuffle of the bytes of two vectors.
pub(super) fn shuffle(
    b: &mut FunctionBuilder<'_>,
    x: ir::Value,
    y: ir::Value,
    bytes: [u8; 16],
) -> ir::Value {
    let mask = b.func.dfg.immediates.push(bytes.as_slice().into());
    b.ins().shuffle(x, y, mask)
}

impl<'b, 'f> PixelEmitter<'b, 'f> {
    pub(super) fn new(b: &'b mut FunctionBuilder<'f>, vectors: bool) -> PixelEmitter<'b, 'f> {
        PixelEmitter { b, vectors }
    }

    /// How many rows a value stands for.
    pub(super) const fn rows(&self) -> i64 {
        if self.vectors { 16 } else { 1 }
    }

    /// The bytes at an address and, with vectors, the fifteen after it.
    pub(super) fn load(&mut self, address: ir::Value, offset: i32) -> Pixels {
        let value = if self.vectors {
            self.b.ins().load(I8X16, PLAIN, address, offset)
        } else {
            self.b.ins().uload8(I32, PLAIN, address, offset)
        };
        self.pixels([value; 4], 0, 255)
    }

    /// A value of this range, in the lanes that the range asks for.
    fn pixels(&self, parts: [ir::Value; 4], low: i64, high: i64) -> Pixels {
        let lane = if self.vectors { Lane::of(low, high) } else { Lane::Byte };
        Pixels { parts, lane, low, high }
    }

    /// The same values in lanes of at least this width.
    pub(super) fn widen(&mut self, p: Pixels, lane: Lane) -> Pixels {
        if !self.vectors || p.lane >= lane {
            return p;
        }
        let mut parts = p.parts;
        for (i, &part) in p.parts().iter().enumerate() {
            let signed = p.low < 0;
            parts[2 * i] = if signed { self.b.ins().swiden_low(part) } else { self.b.ins().uwiden_low(part) };
            parts[2 * i + 1] = if signed { self.b.ins().swiden_high(part) } else { self.b.ins().uwiden_high(part) };
        }
        let wider = if p.lane == Lane::Byte { Lane::Half } else { Lane::Word };
        self.widen(Pixels { parts, lane: wider, ..p }, lane)
    }

    fn widen_truth(&mut self, t: Truth, lane: Lane) -> Truth {
        if !self.vectors || t.lane >= lane {
            return t;
        }
        let mut parts = t.parts;
        for i in 0..t.lane.parts() {
            parts[2 * i] = self.b.ins().swiden_low(t.parts[i]);
            parts[2 * i + 1] = self.b.ins().swiden_high(t.parts[i]);
        }
        let wider = if t.lane == Lane::Byte { Lane::Half } else { Lane::Word };
        self.widen_truth(Truth { parts, lane: wider, ..t }, lane)
    }

    /// An operation on values in lanes wide enough for its result.
    fn binary(
        &mut self,
        a: Pixels,
        b: Pixels,
        (low, high): (i64, i64),
        op: impl Fn(&mut FunctionBuilder<'_>, ir::Value, ir::Value) -> ir::Value,
    ) -> Pixels {
        let lane = if self.vectors { Lane::of(low, high).max(a.lane).max(b.lane) } else { Lane::Byte };
        let (a, b) = (self.widen(a, lane), self.widen(b, lane));
        let mut parts = a.parts;
        for (part, (&x, &y)) in parts.iter_mut().zip(a.parts().iter().zip(b.parts())) {
            *part = op(self.b, x, y);
        }
        Pixels { parts, lane, low, high }
    }

    /// The lower and the upper 16 bits, of values that may use all 32.
    pub(super) fn halves(&mut self, p: Pixels) -> [Pixels; 2] {
        let p = self.widen(p, Lane::Word);
        let (mut low, mut high) = (p.parts, p.parts);
        let mask = self.b.ins().iconst(I32, 0xffff);
        let count = self.b.ins().iconst(I32, 16);
        let mask = if self.vectors { self.b.ins().splat(I32X4, mask) } else { mask };
        for (i, &part) in p.parts().iter().enumerate() {
            low[i] = self.b.ins().band(part, mask);
            high[i] = self.b.ins().ushr(part, count);
        }
        [low, high].map(|parts| Pixels { parts, lane: p.lane, low: 0, high: 0xffff })
    }

    /// The square root of one vector or number of 32 bits, rounded.
    fn root(&mut self, n: ir::Value) -> ir::Value {
        // Adding 2²³ leaves no fraction bits, so it rounds to the nearest integer, which then stands in the low
        // bits. The trait says why the root's own rounding does no harm.
        const ROUNDER: f32 = 8_388_608.0;
        let (float, integer) = if self.vectors { (F32X4, I32X4) } else { (F32, I32) };
        let rounder = self.b.ins().f32const(ROUNDER);
        let base = self.b.ins().iconst(I32, i64::from(ROUNDER.to_bits()));
        let (rounder, base) = if self.vectors {
            (self.b.ins().splat(F32X4, rounder), self.b.ins().splat(I32X4, base))
        } else {
            (rounder, base)
        };
        let n = self.b.ins().fcvt_from_sint(float, n);
        let root = self.b.ins().sqrt(n);
        let sum = self.b.ins().fadd(root, rounder);
        let bits = self.b.ins().bitcast(integer, REINTERPRET, sum);
        self.b.ins().isub(bits, base)
    }
}

impl PixelMachine for PixelEmitter<'_, '_> {
    type P = Pixels;
    type M = Truth;

    fn constant(&mut self, value: i32) -> Pixels {
        let value = i64::from(value);
        let lane = if self.vectors { Lane::of(value, value) } else { Lane::Word };
        let ty = lane.vector().lane_type();
        let bits = value & (i64::MAX.cast_unsigned() >> (63 - ty.bits())).cast_signed();
        let mut part = self.b.ins().iconst(ty, bits);
        if self.vectors {
            part = self.b.ins().splat(lane.vector(), part);
        }
        self.pixels([part; 4], value, value)
    }

    fn add(&mut self, a: Pixels, b: Pixels) -> Pixels {
        self.binary(a, b, (a.low + b.low, a.high + b.high), |f, x, y| f.ins().iadd(x, y))
    }

    fn sub(&mut self, a: Pixels, b: Pixels) -> Pixels {
        self.binary(a, b, (a.low - b.high, a.high - b.low), |f, x, y| f.ins().isub(x, y))
    }

    fn difference(&mut self, a: Pixels, b: Pixels) -> Pixels {
        let range = ((a.low - b.high).max(0), a.high - b.low);
        self.binary(a, b, range, |f, x, y| f.ins().isub(x, y))
    }

    fn mul(&mut self, a: Pixels, b: Pixels) -> Pixels {
        let products = [a.low * b.low, a.low * b.high, a.high * b.low, a.high * b.high];
        let mut low = products.into_iter().min().unwrap_or_default();
        let high = products.into_iter().max().unwrap_or_default();
        if a.parts == b.parts {
            low = low.max(0);
        }
        self.binary(a, b, (low, high), |f, x, y| f.ins().imul(x, y))
    }

    fn sum_of_squares(&mut self, a: Pixels, b: Pixels) -> Pixels {
        let (a, b) = (self.widen(a, Lane::Half), self.widen(b, Lane::Half));
        let fits = |p: Pixels| p.lane == Lane::Half && p.high <= 0x7fff;
        if !self.vectors || !fits(a) || !fits(b) {
            let (aa, bb) = (self.mul(a, a), self.mul(b, b));
            return self.add(aa, bb);
        }
        // Pairs of 16 bits side by side are multiplied and added by one instruction on most machines.
        let mut parts = a.parts;
        for (i, (&x, &y)) in a.parts().iter().zip(b.parts()).enumerate() {
            let [x, y] = [x, y].map(|v| self.b.ins().bitcast(I8X16, REINTERPRET, v));
            for upper in [false, true] {
                let pairs = shuffle(self.b, x, y, interleave(2, upper));
                let pairs = self.b.ins().bitcast(I16X8, REINTERPRET, pairs);
                let (low, high) = (self.b.ins().swiden_low(pairs), self.b.ins().swiden_high(pairs));
                let (low, high) = (self.b.ins().imul(low, low), self.b.ins().imul(high, high));
                parts[2 * i + usize::from(upper)] = self.b.ins().iadd_pairwise(low, high);
            }
        }
        let square = |p: Pixels| (p.low * p.low).max(p.high * p.high);
        Pixels { parts, lane: Lane::Word, low: 0, high: square(a) + square(b) }
    }

    fn lt(&mut self, a: Pixels, b: Pixels) -> Truth {
        if !self.vectors {
            let value = self.b.ins().icmp(IntCC::SignedLessThan, a.parts[0], b.parts[0]);
            return Truth { parts: [value; 4], lane: Lane::Byte, inverted: false };
        }
        let (low, high) = (a.low.min(b.low), a.high.max(b.high));
        let lane = Lane::of(low, high).max(a.lane).max(b.lane);
        let (a, b) = (self.widen(a, lane), self.widen(b, lane));
        let unsigned = lane == Lane::Byte || lane == Lane::Half && high > 0x7fff;
        // Of unsigned comparisons this one takes x86 the fewest instructions.
        let condition = if unsigned { IntCC::UnsignedGreaterThanOrEqual } else { IntCC::SignedLessThan };
        let mut parts = a.parts;
        for (part, (&x, &y)) in parts.iter_mut().zip(a.parts().iter().zip(b.parts())) {
            *part = self.b.ins().icmp(condition, x, y);
        }
        Truth { parts, lane, inverted: unsigned }
    }

    fn select(&mut self, mask: Truth, a: Pixels, b: Pixels) -> Pixels {
        let (low, high) = (a.low.min(b.low), a.high.max(b.high));
        if !self.vectors {
            let value = self.b.ins().select(mask.parts[0], a.parts[0], b.parts[0]);
            return self.pixels([value; 4], low, high);
        }
        let lane = Lane::of(low, high).max(a.lane).max(b.lane).max(mask.lane);
        let (a, b) = if mask.inverted { (b, a) } else { (a, b) };
        let (a, b, mask) = (self.widen(a, lane), self.widen(b, lane), self.widen_truth(mask, lane));
        let mut parts = a.parts;
        for (i, part) in parts.iter_mut().enumerate().take(lane.parts()) {
            *part = self.b.ins().bitselect(mask.parts[i], a.parts[i], b.parts[i]);
        }
        Pixels { parts, lane, low, high }
    }

    fn min(&mut self, a: Pixels, b: Pixels) -> Pixels {
        let range = (a.low.min(b.low), a.high.min(b.high));
        if !self.vectors {
            let less = self.lt(a, b);
            return Pixels { low: range.0, high: range.1, ..self.select(less, a, b) };
        }
        if range.0 < 0 {
            return self.binary(a, b, range, |f, x, y| f.ins().smin(x, y));
        }
        self.binary(a, b, range, |f, x, y| f.ins().umin(x, y))
    }

    fn max(&mut self, a: Pixels, b: Pixels) -> Pixels {
        let range = (a.low.max(b.low), a.high.max(b.high));
        if !self.vectors {
            let less = self.lt(a, b);
            return Pixels { low: range.0, high: range.1, ..self.select(less, b, a) };
        }
        if a.low.min(b.low) < 0 {
            return self.binary(a, b, range, |f, x, y| f.ins().smax(x, y));
        }
        self.binary(a, b, range, |f, x, y| f.ins().umax(x, y))
    }

    fn sqrt_round(&mut self, n: Pixels) -> Pixels {
        let n = self.widen(n, Lane::Word);
        let mut parts = n.parts;
        for (part, &value) in parts.iter_mut().zip(n.parts()) {
            *part = self.root(value);
        }
        let high = (n.high as f64).sqrt().round() as i64;
        if self.vectors {
            // What has become small again takes half the vectors.
            let packed = [0, 2].map(|i| self.b.ins().snarrow(parts[i], parts[i + 1]));
            parts[..2].copy_from_slice(&packed);
            return Pixels { parts, lane: Lane::Half, low: 0, high };
        }
        self.pixels([parts[0]; 4], 0, high)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shuffles_are_those_that_machines_have() {
        assert_eq!(interleave(1, false), [0, 16, 1, 17, 2, 18, 3, 19, 4, 20, 5, 21, 6, 22, 7, 23]);
        assert_eq!(interleave(2, true), [8, 9, 24, 25, 10, 11, 26, 27, 12, 13, 28, 29, 14, 15, 30, 31]);
        assert_eq!(interleave(4, false), [0, 1, 2, 3, 16, 17, 18, 19, 4, 5, 6, 7, 20, 21, 22, 23]);
        assert_eq!(interleave(8, true), [8, 9, 10, 11, 12, 13, 14, 15, 24, 25, 26, 27, 28, 29, 30, 31]);
    }

    #[test]
    fn lanes_hold_their_values() {
        assert_eq!(Lane::of(0, 255), Lane::Byte);
        assert_eq!(Lane::of(-1, 255), Lane::Half);
        assert_eq!(Lane::of(0, 65535), Lane::Half);
        assert_eq!(Lane::of(-1, 65535), Lane::Word);
        assert_eq!(Lane::of(-32769, 0), Lane::Word);
    }
}
