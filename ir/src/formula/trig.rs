//! Sine, cosine, tangent and the two arc tangents, in binary32 alone.
//!
//! These are part of the language: each is a fixed sequence of the operations of a [`Machine`], without a fused
//! multiply-add and without a branch, so that every executor and every exported program gives the same bits. They
//! are tuned for throughput, to a promise of max(4 ulp, 1e-6) and no more:
//!
//! | function | operations | divisions | largest absolute error | promised where |
//! |---|---|---|---|---|
//! | [`sin`] | 19 | 0 | 7.34e-7 | \|x\| <= 8192 |
//! | [`cos`] | 20 | 0 | 2.56e-7 | \|x\| <= 8192 |
//! | [`tan`] | 24 | 1 | 8.0e-7 below 4 in magnitude, else 3.2 ulp | \|x\| <= 8192 and \|tan x\| <= 4096 ([`TAN_ACCURATE`]) |
//! | [`atan`] | 20 | 1 | 4.6e-7 | everywhere |
//! | [`atan2`] | 29 | 1 | below 6.5e-7 | everywhere |
//!
//! Constants and changes between a number and its bits are not counted. The errors of the first four are those of
//! *every* binary32 (`examples/trig_every_binary32.rs`, a run over all 2³² inputs of each function with no violation);
//! that of `atan2` was measured at every quotient from 2⁻³⁰ to 1 in each octant of the upper half plane (5.65e-7) and
//! allows for the rounding of the quotient. In short, and with the signs of zeros as in C:
//!
//! * An infinity gives `sin`, `cos` and `tan` a NaN, `atan` ±π/2. A NaN gives a NaN; no finite result depends on one.
//! * `sin` and `cos` lie within -1 to 1 for every finite argument, by the same run. `cos 0` is 1, `atan 1` the binary32
//!   next to π/4, and `sin`, `tan` and `atan` keep the sign of a zero; |atan x| never exceeds |x|. For |x| <= 8192 `cos` is exactly even, `sin` and
//!   `tan` are exactly odd, as is `atan` everywhere.
//! * Beyond 8192 the reduction loses accuracy gradually; beyond about 10⁷ the results mean nothing. They are the same
//!   everywhere all the same, and never a NaN; `tan` may be infinite there.
//! * `atan2` follows C in every quadrant, at zeros and at infinities, except that two zeros of any sign give +0.
//!
//! # How they work
//!
//! *Reduction.* x times the reciprocal of the period, plus 1.5 · 2²³, less it again, is the number n of the nearest
//! multiple, and the lowest bit of the sum is the parity of n. Subtracting n times each part of the period in turn is
//! exact but for the last step (Cody and Waite, *Software Manual for the Elementary Functions*, 1980): the parts have so
//! few bits that n times each has at most 24 up to 8192, and `HALF_TURN`'s last, which is rounded, leaves an error
//! below 1.4e-7. `tan` reduces by π/2 in three parts because a relative error counts at its poles. All parts are
//! positive: -0 less +0 is -0, while a negative part would lose the sign.
//!
//! *Range.* An argument too large to reduce leaves a rest outside the polynomial's interval, where it could be anything,
//! so that a rest |r| > 2 (√2 in `tan`) gives 0. The comparison is on r², which every function has at hand, and it
//! lets a NaN pass.
//!
//! *Polynomials.* The coefficients minimise the largest error (absolute; relative for `tan`) over the reduced interval:
//! a linear program over 1,500 Chebyshev nodes, solved again after each coefficient, from the lowest power up, was
//! rounded to binary32. `tan` is a quotient, for which the program is repeated with the denominator's last values as
//! weights; one division serves both tan r and -1 / tan r, numerator and denominator changing places. The arc tangent's
//! powers 1, 3, 5, 7, 8, 9 are the best of all sets of six below 12 that contain 1, with the first coefficient 1 and
//! the sum π/4 imposed; six odd powers reach only 1.7e-6.
//!
//! ```
//! use vsonar_ir::{formula::trig, machine::Scalar};
//!
//! assert!((trig::sin(&mut Scalar, 2.0) - 0.909_297_4).abs() <= 1e-6);
//! assert_eq!(trig::atan2(&mut Scalar, 0.0, -1.0), std::f32::consts::PI);
//! assert_eq!(trig::atan2(&mut Scalar, -0.0, -0.0).to_bits(), 0);
//! ```

use crate::machine::Machine;

/// 1.5 · 2²³. Adding it to |t| <= 2²² rounds t to an integer, whose low bits are then the low bits of the sum.
const ROUNDER: f32 = 12_582_912.0;

/// 1 / π.
const PER_HALF_TURN: f32 = std::f32::consts::FRAC_1_PI;
/// π = 6433 / 2¹¹ + the rest. Multiples up to 2608 have at most 24 bits; both parts are positive so that -0 stays -0.
const HALF_TURN: [f32; 2] = [6433.0 / 2048.0, 4.793_723_3e-4];

/// 2 / π.
const PER_QUARTER_TURN: f32 = std::f32::consts::FRAC_2_PI;
/// π / 2 = 201 / 2⁷ + 2029 / 2²² + the rest. Multiples of the first two up to 5215 are exact.
const QUARTER_TURN: [f32; 3] = [201.0 / 128.0, 2029.0 / 4_194_304.0, 7.549_79e-8];

/// sin r / r by powers of r², from the highest: absolute error of sin r below 5.93e-7 up to π/2.
const SIN: [f32; 4] = [-1.836_199_5e-4, 8.306_265e-3, -0.166_648_22, 0.999_996_6];
/// cos r by powers of r², from the highest: absolute error below 5.4e-8 up to π/2.
const COS: [f32; 5] = [2.318_903_4e-5, -1.385_570_9e-3, 4.166_396_3e-2, -0.499_999_3, 1.0];
/// What "away from its poles" means for [`tan`]: true values up to this magnitude have the promised accuracy.
pub const TAN_ACCURATE: f32 = 4096.0;

/// A bound on the magnitude of [`tan`] for |x| <= [`TAN_REDUCED`]: a run over all of them reached 2.39e8.
pub const TAN_LARGEST: f32 = 2.5e8;
/// The largest argument up to which every reduction is as accurate as promised.
pub const TAN_REDUCED: f32 = 8192.0;

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

/// The sine of `x` radians: 19 operations. Within 1e-6 for |x| <= 8192, within -1 to 1 for every finite x, NaN for the
/// rest.
#[inline(always)]
pub fn sin<M: Machine + ?Sized>(m: &mut M, x: M::F) -> M::F {
    let Reduced { r, square, odd } = reduce(m, x, PER_HALF_TURN, &HALF_TURN);
    let ratio = horner(m, square, &SIN);
    let r = flip(m, r, odd);
    let y = m.mul(r, ratio);
    tame(m, square, 4.0, y)
}

/// The cosine of `x` radians: 20 operations. Within 1e-6 for |x| <= 8192, within -1 to 1 for every finite x, NaN for
/// the rest.
#[inline(always)]
pub fn cos<M: Machine + ?Sized>(m: &mut M, x: M::F) -> M::F {
    let Reduced { r: _, square, odd } = reduce(m, x, PER_HALF_TURN, &HALF_TURN);
    let y = horner(m, square, &COS);
    let y = flip(m, y, odd);
    tame(m, square, 4.0, y)
}

/// The tangent of `x` radians: 24 operations, one of them a division. Within max(4 ulp, 1e-6) for |x| <= 8192 where the
/// true value is at most [`TAN_ACCURATE`] in magnitude, never NaN for a finite x, NaN for the rest.
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

/// The arc tangent of `x`, from -π/2 to π/2: 20 operations, one of them a division. Within 1e-6; ±π/2 for infinities.
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
/// Within 1e-6; quadrants, signed zeros and infinities as in C, but two zeros of any sign give +0.
#[inline(always)]
pub fn atan2<M: Machine + ?Sized>(m: &mut M, a: M::F, b: M::F) -> M::F {
    let sign = keep(m, a, i32::MIN);
    let (rise, run) = (magnitude(m, a), magnitude(m, b));
    let steep = m.lt(run, rise);
    let less = m.select(steep, run, rise);
    let more = m.select(steep, rise, run);
    let (zero, one) = (m.f32(0.0), m.f32(1.0));
    // Two infinities have no quotient; the diagonal they stand for does.
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
    // Where `more` is 0, `less` is +0, or the NaN that the comparison above passed over.
    let origin = m.eq(more, zero);
    m.select(origin, less, angle)
}
