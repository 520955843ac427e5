//! Sine, cosine, tangent and the two arc tangents.

use crate::machine::Machine;

/// 1.5 · 2²³. Adding it to |t| <= 2²² rounds t to an integer, whose low bits are then the low bits of the sum.
const ROUNDER: f32 = 12_582_912.0;

/// 1 / π.
const PER_HALF_TURN: f32 = std::f32::consts::FRAC_1_PI;
/// π = 6433 / 2¹¹ + the rest. Multiples up to 2608 have at most 24 bits; both parts are positive so that -0 stays -0.
const HALF_TURN: [f32; 2] = [3.141_113_3, 4.793_723_3e-4];

/// 2 / π.
const PER_QUARTER_TURN: f32 = std::f32::consts::FRAC_2_PI;
/// π / 2 = 201 / 2⁷ + 2029 / 2²² + the rest. Multiples of the first two up to 5215 are exact.
const QUARTER_TURN: [f32; 3] = [1.570_312_5, 4.837_513e-4, 7.549_79e-8];

/// sin r / r by powers of r², from the highest: absolute error of sin r below 5.93e-7 up to π/2.
const SIN: [f32; 4] = [-1.836_199_5e-4, 8.306_265e-3, -0.166_648_22, 0.999_996_6];
/// cos r by powers of r², from the highest: absolute error below 5.4e-8 up to π/2.
const COS: [f32; 5] = [2.318_903_4e-5, -1.385_570_9e-3, 4.166_396_3e-2, -0.499_999_3, 1.0];
/// True tangents up to this magnitude have the promised accuracy; beyond, the argument is at a pole.
pub const TAN_ACCURATE: f32 = 1024.0;

/// tan r / r: numerator and denominator by powers of r², from the highest: relative error below 1.8e-8 up to π/4.
const TAN: ([f32; 2], [f32; 2]) = ([-9.864_943_5, 102.995_41], [-44.196_796, 102.995_41]);
/// atan t = t + t³ (c₃ + t² (c₅ + t² (c₇ + c₈ t + c₉ t²))), from the highest: absolute error below 3.1e-7 for 0 <= t <= 1.
const ATAN: [f32; 5] = [-3.293_337e-2, 0.139_913_42, -0.190_935_25, 0.202_794_05, -0.333_440_66];

/// The polynomial with these coefficients, from the highest power, in Horner's form.
#[inline(always)]
fn horner<M: Machine + ?Sized>(m: &mut M, t: M::F, coefficients: &[f32]) -> M::F {
    let mut sum = m.f32(coefficients[0]);
    for &coefficient in &coefficients[1..] {
        let product = m.mul(sum, t);
        let coefficient = m.f32(coefficient);
        sum = m.add(product, coefficient);
    }
    sum
}

/// An angle less the nearest multiple n of a period.
struct Reduced<M: Machine + ?Sized> {
    /// The rest.
    r: M::F,
    /// Its square.
    square: M::F,
    /// The sign bit alone where n is odd, else no bit.
    odd: M::I,
}

/// `x` less the nearest multiple of a period that is the sum of `parts` (Cody and Waite 1980).
#[inline(always)]
fn reduce<M: Machine + ?Sized>(m: &mut M, x: M::F, per_period: f32, parts: &[f32]) -> Reduced<M> {
    let (per_period, rounder) = (m.f32(per_period), m.f32(ROUNDER));
    let periods = m.mul(x, per_period);
    let sum = m.add(periods, rounder);
    let n = m.sub(sum, rounder);
    let mut r = x;
    for &part in parts {
        let part = m.f32(part);
        let multiple = m.mul(n, part);
        r = m.sub(r, multiple);
    }
    let square = m.mul(r, r);
    let bits = m.to_bits(sum);
    let odd = m.ishl(bits, 31);
    Reduced { r, square, odd }
}

/// `y`, but 0 where the square of the reduced angle exceeds `limit`: the reduction has failed on an argument too
/// large for it. Where that square is a NaN, `y` is one too and stays.
#[inline(always)]
fn tame<M: Machine + ?Sized>(m: &mut M, square: M::F, limit: f32, y: M::F) -> M::F {
    let (limit, zero) = (m.f32(limit), m.f32(0.0));
    let failed = m.lt(limit, square);
    m.select(failed, zero, y)
}

/// `a` with the bits of `sign` flipped.
#[inline(always)]
fn flip<M: Machine + ?Sized>(m: &mut M, a: M::F, sign: M::I) -> M::F {
    let bits = m.to_bits(a);
    let bits = m.ixor(bits, sign);
    m.from_bits(bits)
}

/// The bits of `a` that `mask` has.
#[inline(always)]
fn keep<M: Machine + ?Sized>(m: &mut M, a: M::F, mask: i32) -> M::I {
    let (bits, mask) = (m.to_bits(a), m.i32(mask));
    m.iand(bits, mask)
}

/// The magnitude of `a`.
#[inline(always)]
fn magnitude<M: Machine + ?Sized>(m: &mut M, a: M::F) -> M::F {
    let bits = keep(m, a, i32::MAX);
    m.from_bits(bits)
}

/// The sine of `x` radians: 19 operations.
#[inline(always)]
pub fn sin<M: Machine + ?Sized>(m: &mut M, x: M::F) -> M::F {
    let Reduced { r, square, odd } = reduce(m, x, PER_HALF_TURN, &HALF_TURN);
    let ratio = horner(m, square, &SIN);
    let r = flip(m, r, odd);
    let y = m.mul(r, ratio);
    tame(m, square, 4.0, y)
}

/// The cosine of `x` radians: 20 operations.
#[inline(always)]
pub fn cos<M: Machine + ?Sized>(m: &mut M, x: M::F) -> M::F {
    let Reduced { r: _, square, odd } = reduce(m, x, PER_HALF_TURN, &HALF_TURN);
    let y = horner(m, square, &COS);
    let y = flip(m, y, odd);
    tame(m, square, 4.0, y)
}

/// The tangent of `x` radians: 24 operations, one of them a division.
#[inline(always)]
pub fn tan<M: Machine + ?Sized>(m: &mut M, x: M::F) -> M::F {
    let Reduced { r, square, odd } = reduce(m, x, PER_QUARTER_TURN, &QUARTER_TURN);
    let above = horner(m, square, &TAN.0);
    let above = m.mul(above, r);
    let below = m.f32(TAN.1[0]);
    let below = m.add(square, below);
    let below = m.mul(below, square);
    let constant = m.f32(TAN.1[1]);
    let below = m.add(below, constant);
    // An odd number of quarter turns further the tangent is -1 / tan r.
    let above = flip(m, above, odd);
    let zero = m.i32(0);
    let swap = m.ilt(odd, zero);
    let numerator = m.select(swap, below, above);
    let denominator = m.select(swap, above, below);
    let y = m.div(numerator, denominator);
    tame(m, square, 2.0, y)
}

/// The arc tangent of `t`, 0 <= t <= 1: 12 operations. Gives π/4, rounded, for 1 and t for a tiny t.
#[inline(always)]
fn atan_unit<M: Machine + ?Sized>(m: &mut M, t: M::F) -> M::F {
    let square = m.mul(t, t);
    let (c9, c8, c7) = (m.f32(ATAN[0]), m.f32(ATAN[1]), m.f32(ATAN[2]));
    let sum = m.mul(c9, t);
    let sum = m.add(sum, c8);
    let sum = m.mul(sum, t);
    let mut sum = m.add(sum, c7);
    for &coefficient in &ATAN[3..] {
        let product = m.mul(sum, square);
        let coefficient = m.f32(coefficient);
        sum = m.add(product, coefficient);
    }
    let cube = m.mul(t, square);
    let bend = m.mul(cube, sum);
    m.add(t, bend)
}

/// The arc tangent of `x`, from -π/2 to π/2: 20 operations, one of them a division.
#[inline(always)]
pub fn atan<M: Machine + ?Sized>(m: &mut M, x: M::F) -> M::F {
    let (sign, size) = (keep(m, x, i32::MIN), magnitude(m, x));
    let one = m.f32(1.0);
    let large = m.lt(one, size);
    let inverse = m.div(one, size);
    let t = m.select(large, inverse, size);
    let angle = atan_unit(m, t);
    let quarter = m.f32(std::f32::consts::FRAC_PI_2);
    let rest = m.sub(quarter, angle);
    let angle = m.select(large, rest, angle);
    flip(m, angle, sign)
}

/// The angle of the point with ordinate `a` and abscissa `b`, from -π to π: 29 operations, one of them a division.
#[inline(always)]
pub fn atan2<M: Machine + ?Sized>(m: &mut M, a: M::F, b: M::F) -> M::F {
    let sign = keep(m, a, i32::MIN);
    let (rise, run) = (magnitude(m, a), magnitude(m, b));
    let steep = m.lt(run, rise);
    let less = m.select(steep, run, rise);
    let more = m.select(steep, rise, run);
    let (zero, one) = (m.f32(0.0), m.f32(1.0));
    let quotient = m.div(less, more);
    let equal = m.eq(rise, run);
    let t = m.select(equal, one, quotient);
    let angle = atan_unit(m, t);
    let quarter = m.f32(std::f32::consts::FRAC_PI_2);
    let rest = m.sub(quarter, angle);
    let angle = m.select(steep, rest, angle);
    let half = m.f32(std::f32::consts::PI);
    let rest = m.sub(half, angle);
    let behind = m.lt(b, zero);
    let angle = m.select(behind, rest, angle);
    let angle = flip(m, angle, sign);
    let origin = m.eq(more, zero);
    m.select(origin, zero, angle)
}
