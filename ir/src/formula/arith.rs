//! Arithmetic above the machine's basic operations.

use crate::machine::{Machine, Scalar};
use crate::window::Rect;

/// `a` where a < b, else `b`.
#[inline(always)]
pub fn min<M: Machine + ?Sized>(m: &mut M, a: M::F, b: M::F) -> M::F {
    let less = m.lt(a, b);
    m.select(less, a, b)
}

/// `a` where a > b, else `b`.
#[inline(always)]
pub fn max<M: Machine + ?Sized>(m: &mut M, a: M::F, b: M::F) -> M::F {
    let greater = m.lt(b, a);
    m.select(greater, a, b)
}

/// Protected division: 1 where b is zero of either sign, whatever a is, else a / b (Koza 1992).
#[inline(always)]
pub fn protected_div<M: Machine + ?Sized>(m: &mut M, a: M::F, b: M::F) -> M::F {
    let zero = m.f32(0.0);
    let one = m.f32(1.0);
    let by_zero = m.eq(b, zero);
    let quotient = m.div(a, b);
    m.select(by_zero, one, quotient)
}

/// The centre column that the value of a column expression stands for: rounded to the nearest integer, ties to
/// even, and clamped to `lo..=hi` (a NaN gives `lo`).
///
/// Clamping comes first, which changes nothing because the bounds are integers; then adding and subtracting
/// 1.5 · 2²³ rounds, since a binary32 of that size has no fraction bits. Needs `0 <= lo <= hi < 2²²`.
#[inline(always)]
pub fn resolve_column<M: Machine + ?Sized>(m: &mut M, value: M::F, lo: u32, hi: u32) -> M::I {
    const ROUNDER: f32 = 12_582_912.0;
    let (low, high) = (m.f32(lo as f32), m.f32(hi as f32));
    let value = max(m, value, low);
    let value = min(m, value, high);
    let rounder = m.f32(ROUNDER);
    let sum = m.add(value, rounder);
    let bits = m.to_bits(sum);
    let base = m.i32(ROUNDER.to_bits().cast_signed());
    m.isub(bits, base)
}

impl Rect {
    /// The centre column that the value of a column expression stands for in an image `width` pixels wide
    /// ([`resolve_column`]).
    pub fn resolve_column(self, value: f32, width: u32) -> u32 {
        let (lo, hi) = self.columns(width);
        resolve_column(&mut Scalar, value, lo, hi).cast_unsigned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_round_to_even_and_clamp() {
        let rect = Rect::new(3, 3).expect("in the list");
        let cases: [(f32, u32); 14] = [
            (0.0, 1),
            (-1e30, 1),
            (f32::NEG_INFINITY, 1),
            (f32::NAN, 1),
            (1.5, 2),
            (2.5, 2),
            (3.5, 4),
            (2.499_999_8, 2),
            (2.500_000_2, 3),
            (317.5, 318),
            (318.4, 318),
            (319.0, 318),
            (f32::INFINITY, 318),
            (-0.0, 1),
        ];
        for (value, column) in cases {
            assert_eq!(rect.resolve_column(value, 320), column, "{value}");
        }
    }

    #[test]
    fn columns_agree_with_round_ties_even() {
        let rect = Rect::new(8, 8).expect("in the list");
        for i in -2000..=8000 {
            let value = i as f32 / 16.0 + (i % 7) as f32 * 1e-4;
            let expected = value.round_ties_even().clamp(3.0, 315.0) as u32;
            assert_eq!(rect.resolve_column(value, 320), expected, "{value}");
        }
    }

    #[test]
    fn minimum_and_maximum_follow_the_comparison() {
        let m = &mut Scalar;
        assert_eq!(min(m, f32::NAN, 2.0), 2.0);
        assert!(min(m, 2.0, f32::NAN).is_nan());
        assert_eq!(max(m, f32::NAN, 2.0), 2.0);
        assert_eq!(min(m, -0.0, 0.0).to_bits(), 0.0f32.to_bits());
        assert_eq!(max(m, 0.0, -0.0).to_bits(), (-0.0f32).to_bits());
        assert_eq!(protected_div(m, f32::NAN, -0.0), 1.0);
        assert_eq!(protected_div(m, 1.0, 4.0), 0.25);
    }
}
