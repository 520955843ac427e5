//! The eight image operators, over the 3 x 3 neighbourhood of a pixel.
//!
//! Each is written once, over a [`PixelMachine`]: a plain number, a vector of pixels, an instruction builder,
//! C text. There are no branches and no tables, so a formula is a fixed sequence of the machine's operations.
//! Everything is exact integer arithmetic. Pixels are 0 to 255.
//!
//! A [`Neighbourhood`] is row by row from the top left: index 0 is (x-1, y-1), 1 is (x, y-1), 4 the pixel
//! itself, 8 is (x+1, y+1). Outside the image the nearest border pixel stands in.
//!
//! The median family ([`truncated_median`], [`median_corner`]) needs no more than unsigned bytes; the differences
//! inside [`gradient`] fit signed 16-bit integers, its sum of squares and the Moravec differences need 32 bits (the
//! latter 16, unsigned).
//!
//! ```
//! use vsonar_ir::Operator;
//! use vsonar_ir::formula::image::{ScalarPixels, apply};
//!
//! // A vertical edge: dark on the left, bright in the middle and on the right.
//! let edge = [10, 90, 90, 10, 90, 90, 10, 90, 90];
//! assert_eq!(apply(&mut ScalarPixels, Operator::Gradient, &edge), 4 * 80);
//! assert_eq!(apply(&mut ScalarPixels, Operator::Median, &edge), 90);
//! ```

use crate::window::Operator;

/// A pixel and its eight neighbours, row by row from the top left; the pixel itself is number 4.
pub type Neighbourhood<P> = [P; 9];

/// The basic integer operations of the image operators.
///
/// A formula's documentation says how wide its values get; a machine may use any integers that hold them.
pub trait PixelMachine {
    /// An integer, or a vector of them.
    type P: Copy;
    /// A truth value, or a vector of them.
    type M: Copy;

    /// The constant `value`.
    fn constant(&mut self, value: i32) -> Self::P;
    /// `a + b`.
    fn add(&mut self, a: Self::P, b: Self::P) -> Self::P;
    /// `a - b`.
    fn sub(&mut self, a: Self::P, b: Self::P) -> Self::P;
    /// `a * b`.
    fn mul(&mut self, a: Self::P, b: Self::P) -> Self::P;
    /// `a < b`, signed.
    fn lt(&mut self, a: Self::P, b: Self::P) -> Self::M;
    /// `a` where the mask holds, else `b`.
    fn select(&mut self, mask: Self::M, a: Self::P, b: Self::P) -> Self::P;

    /// `a - b` where it is known that `a >= b`, so that a machine of unsigned integers can compute it.
    #[inline(always)]
    fn difference(&mut self, a: Self::P, b: Self::P) -> Self::P {
        self.sub(a, b)
    }

    /// `a * a + b * b`, which some machines have an instruction for.
    #[inline(always)]
    fn sum_of_squares(&mut self, a: Self::P, b: Self::P) -> Self::P {
        let aa = self.mul(a, a);
        let bb = self.mul(b, b);
        self.add(aa, bb)
    }

    /// The smaller one.
    #[inline(always)]
    fn min(&mut self, a: Self::P, b: Self::P) -> Self::P {
        let less = self.lt(a, b);
        self.select(less, a, b)
    }

    /// The larger one.
    #[inline(always)]
    fn max(&mut self, a: Self::P, b: Self::P) -> Self::P {
        let less = self.lt(a, b);
        self.select(less, b, a)
    }

    /// The square root of n, rounded to the nearest integer, for 0 <= n < 2²². No root of an integer lies
    /// halfway between two integers, so there are no ties.
    ///
    /// The provided definition finds the root's bits from the top with integers alone. A machine with a
    /// correctly rounded binary32 square root may use that instead: a root below 2048 lies at least 1/16384
    /// from every half, and rounding it to binary32 never crosses or reaches one.
    #[inline(always)]
    fn sqrt_round(&mut self, n: Self::P) -> Self::P {
        let mut root = self.constant(0);
        for bit in (0..11).rev() {
            let step = self.constant(1 << bit);
            let trial = self.add(root, step);
            let square = self.mul(trial, trial);
            let too_large = self.lt(n, square);
            root = self.select(too_large, root, trial);
        }
        // (root + 1/2)² = root² + root + 1/4, so the next integer is nearer where n - root² exceeds root.
        let square = self.mul(root, root);
        let rest = self.sub(n, square);
        let up = self.lt(root, rest);
        let one = self.constant(1);
        let next = self.add(root, one);
        self.select(up, next, root)
    }
}

/// The machine of plain numbers: one pixel at a time.
#[derive(Debug, Clone, Copy, Default)]
pub struct ScalarPixels;

impl PixelMachine for ScalarPixels {
    type P = i32;
    type M = bool;

    #[inline(always)]
    fn constant(&mut self, value: i32) -> i32 {
        value
    }
    #[inline(always)]
    fn add(&mut self, a: i32, b: i32) -> i32 {
        a + b
    }
    #[inline(always)]
    fn sub(&mut self, a: i32, b: i32) -> i32 {
        a - b
    }
    #[inline(always)]
    fn mul(&mut self, a: i32, b: i32) -> i32 {
        a * b
    }
    #[inline(always)]
    fn lt(&mut self, a: i32, b: i32) -> bool {
        a < b
    }
    #[inline(always)]
    fn select(&mut self, mask: bool, a: i32, b: i32) -> i32 {
        if mask { a } else { b }
    }
}

/// The value of `operator` at the pixel in the middle of `n`.
#[inline(always)]
pub fn apply<M: PixelMachine + ?Sized>(m: &mut M, operator: Operator, n: &Neighbourhood<M::P>) -> M::P {
    match operator {
        Operator::Raw => n[4],
        Operator::Median => truncated_median(m, n),
        Operator::MedianCorner => median_corner(m, n),
        Operator::Gradient => gradient(m, n),
        Operator::MoravecHorizontal => squared_difference(m, n[4], n[5]),
        Operator::MoravecVertical => squared_difference(m, n[4], n[7]),
        Operator::MoravecSlash => squared_difference(m, n[4], n[2]),
        Operator::MoravecBackslash => squared_difference(m, n[4], n[8]),
    }
}

/// Which pixels of a neighbourhood an operator looks at.
pub fn looks(operator: Operator) -> [bool; 9] {
    let seen = apply(&mut Looks, operator, &std::array::from_fn(|i| 1 << i));
    std::array::from_fn(|i| seen & 1 << i != 0)
}

/// The machine whose values are the pixels that they depend on, as bits.
struct Looks;

impl PixelMachine for Looks {
    type P = u16;
    type M = u16;

    fn constant(&mut self, _: i32) -> u16 {
        0
    }
    fn add(&mut self, a: u16, b: u16) -> u16 {
        a | b
    }
    fn sub(&mut self, a: u16, b: u16) -> u16 {
        a | b
    }
    fn mul(&mut self, a: u16, b: u16) -> u16 {
        a | b
    }
    fn lt(&mut self, a: u16, b: u16) -> u16 {
        a | b
    }
    fn select(&mut self, mask: u16, a: u16, b: u16) -> u16 {
        mask | a | b
    }
}

/// The nine values in ascending order; number 4 is their median. A machine computes both operators of the
/// median family from one sorted neighbourhood.
///
/// A sorting network of 25 comparators (R. W. Floyd; Knuth, *The Art of Computer Programming*, volume 3, section
/// 5.3.4), each of which puts the smaller value first. It is spelled out rather than looped over, because a
/// loop around it would keep compilers from turning loops over pixels into vector code.
#[inline(always)]
pub fn sorted<M: PixelMachine + ?Sized>(m: &mut M, n: &Neighbourhood<M::P>) -> Neighbourhood<M::P> {
    let mut s = *n;
    macro_rules! comparators {
        ($(($i:literal $j:literal))*) => {
            $( (s[$i], s[$j]) = (m.min(s[$i], s[$j]), m.max(s[$i], s[$j])); )*
        };
    }
    comparators! {
        (0 1) (3 4) (6 7) (1 2) (4 5) (7 8) (0 1) (3 4) (6 7)
        (2 5) (0 3) (1 4) (5 8) (3 6) (4 7) (2 5) (0 3) (1 4)
        (5 7) (2 6) (1 3) (4 6) (2 4) (5 6) (2 3)
    }
    s
}

/// The truncated median, an approximation of the neighbourhood's mode (E. R. Davies, *On the noise suppression
/// and image enhancement characteristics of the median, truncated median and mode filters*, 1988; Nixon and
/// Aguado, *Feature Extraction and Image Processing*, chapter 3).
///
/// With median m and the extreme nearer to m at distance d, it is the median of the values within d of m, the
/// lower of the middle two when their number is even. When both extremes are equally near, all values stay.
/// All values stay in 0 to 255.
#[inline(always)]
pub fn truncated_median<M: PixelMachine + ?Sized>(m: &mut M, n: &Neighbourhood<M::P>) -> M::P {
    let s = sorted(m, n);
    truncated_median_of_sorted(m, &s)
}

/// [`truncated_median`] of a neighbourhood in ascending order.
///
/// Values are dropped at one end only, and never the median: at most four. Dropping k at the upper end leaves
/// ranks 0 to 8-k, whose (lower) middle is rank 3 for k = 1 and 2, and 2 for k = 3 and 4; dropping k at the
/// lower end leaves ranks k to 8, whose middle is 4 for k = 1, 5 for k = 2 and 3, and 6 for k = 4.
#[inline(always)]
pub fn truncated_median_of_sorted<M: PixelMachine + ?Sized>(m: &mut M, s: &Neighbourhood<M::P>) -> M::P {
    let median = s[4];
    let below = m.difference(median, s[0]);
    let above = m.difference(s[8], median);
    let d = m.min(below, above);
    let mut value = median;
    let dropped = m.lt(d, above);
    value = m.select(dropped, s[3], value);
    let distance = m.difference(s[6], median);
    let dropped = m.lt(d, distance);
    value = m.select(dropped, s[2], value);
    let distance = m.difference(median, s[1]);
    let dropped = m.lt(d, distance);
    value = m.select(dropped, s[5], value);
    let distance = m.difference(median, s[3]);
    let dropped = m.lt(d, distance);
    m.select(dropped, s[6], value)
}

/// Absolute difference of the pixel and the median of its neighbourhood, which is large at corners (Paler,
/// Föglein, Illingworth and Kittler, *Local ordered grey levels as an aid to corner detection*, 1984).
/// All values stay in 0 to 255.
#[inline(always)]
pub fn median_corner<M: PixelMachine + ?Sized>(m: &mut M, n: &Neighbourhood<M::P>) -> M::P {
    let s = sorted(m, n);
    absolute_difference(m, n[4], s[4])
}

/// |a - b|.
#[inline(always)]
pub fn absolute_difference<M: PixelMachine + ?Sized>(m: &mut M, a: M::P, b: M::P) -> M::P {
    let larger = m.max(a, b);
    let smaller = m.min(a, b);
    m.difference(larger, smaller)
}

/// Magnitude of the Sobel gradient, sqrt(gx² + gy²), rounded to the nearest integer (I. Sobel and G. Feldman,
/// 1968; Nixon and Aguado, chapter 4). 0 to 1443; the sum of squares is at most 2 · 1020² = 2,080,800.
#[inline(always)]
pub fn gradient<M: PixelMachine + ?Sized>(m: &mut M, n: &Neighbourhood<M::P>) -> M::P {
    let right = weighted(m, n[2], n[5], n[8]);
    let left = weighted(m, n[0], n[3], n[6]);
    let gx = m.sub(right, left);
    let bottom = weighted(m, n[6], n[7], n[8]);
    let top = weighted(m, n[0], n[1], n[2]);
    let gy = m.sub(bottom, top);
    let sum = m.sum_of_squares(gx, gy);
    m.sqrt_round(sum)
}

/// a + 2b + c.
#[inline(always)]
fn weighted<M: PixelMachine + ?Sized>(m: &mut M, a: M::P, b: M::P, c: M::P) -> M::P {
    let ends = m.add(a, c);
    let middle = m.add(b, b);
    m.add(ends, middle)
}

/// (a - b)²: the difference of a pixel and its neighbour in one direction. Averaged over a window it is the
/// directional variance of H. P. Moravec's interest operator (*Obstacle avoidance and navigation in the real
/// world by a seeing robot rover*, 1980). 0 to 65025.
#[inline(always)]
pub fn squared_difference<M: PixelMachine + ?Sized>(m: &mut M, a: M::P, b: M::P) -> M::P {
    let d = m.sub(a, b);
    m.mul(d, d)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_network_sorts() {
        // A network that sorts every sequence of zeros and ones sorts everything.
        for bits in 0u32..512 {
            let n: [i32; 9] = std::array::from_fn(|i| (bits >> i & 1).cast_signed());
            let mut expected = n;
            expected.sort_unstable();
            assert_eq!(sorted(&mut ScalarPixels, &n), expected, "{bits:09b}");
        }
    }

    #[test]
    fn roots_are_nearest() {
        let m = &mut ScalarPixels;
        for n in 0..1 << 22 {
            let root = m.sqrt_round(n);
            // root - 1/2 < sqrt(n) < root + 1/2, squared and times four.
            let (low, high) = (2 * i64::from(root) - 1, 2 * i64::from(root) + 1);
            assert!(4 * i64::from(n) < high * high, "{n}");
            assert!(root == 0 || 4 * i64::from(n) > low * low, "{n}");
        }
    }

    #[test]
    fn truncated_medians_by_hand() {
        let cases: [([i32; 9], i32); 8] = [
            // Flat.
            ([7; 9], 7),
            // Both extremes equally near: all stay, the plain median.
            ([1, 2, 3, 4, 5, 6, 7, 8, 9], 5),
            // The lower extreme is nearer (d = 2): one outlier dropped, the lower of the middle two of eight.
            ([10, 10, 11, 11, 12, 12, 13, 13, 99], 11),
            // Three dropped above: the lower middle of six is rank 2.
            ([10, 11, 12, 13, 14, 15, 60, 70, 80], 12),
            // Four dropped above: the middle of five is rank 2.
            ([10, 11, 12, 13, 14, 50, 60, 70, 80], 12),
            // One dropped below: the lower middle of ranks 1 to 8 is rank 4.
            ([0, 90, 91, 92, 93, 94, 95, 96, 97], 93),
            // Two dropped below: the middle of ranks 2 to 8.
            ([0, 1, 91, 92, 93, 94, 95, 96, 97], 94),
            // Four dropped below: the middle of ranks 4 to 8.
            ([0, 1, 2, 3, 93, 94, 95, 96, 97], 95),
        ];
        for (n, expected) in cases {
            assert_eq!(truncated_median(&mut ScalarPixels, &n), expected, "{n:?}");
            let mut reversed = n;
            reversed.reverse();
            assert_eq!(truncated_median(&mut ScalarPixels, &reversed), expected, "{n:?} reversed");
        }
    }

    #[test]
    fn truncated_medians_match_the_definition() {
        // All multisets of nine values out of 0, 1, 2, 3, 5, 9, 255, rotated so that their order varies too.
        const VALUES: [i32; 7] = [0, 1, 2, 3, 5, 9, 255];
        let mut index = [0usize; 9];
        let mut count = 0;
        loop {
            let mut n = index.map(|i| VALUES[i]);
            let mut kept = n.to_vec();
            kept.sort_unstable();
            let median = kept[4];
            let d = (median - kept[0]).min(kept[8] - median);
            kept.retain(|v| (v - median).abs() <= d);
            let expected = kept[(kept.len() - 1) / 2];
            n.rotate_left(count % 9);
            assert_eq!(truncated_median(&mut ScalarPixels, &n), expected, "{n:?}");
            count += 1;
            let Some(i) = (0..9).rev().find(|&i| index[i] + 1 < VALUES.len()) else { break };
            let next = index[i] + 1;
            index[i..].fill(next);
        }
        assert_eq!(count, 5005);
    }

    /// Unsigned bytes that panic where a value would leave them.
    struct CheckedBytes;

    impl PixelMachine for CheckedBytes {
        type P = u8;
        type M = bool;

        fn constant(&mut self, value: i32) -> u8 {
            u8::try_from(value).expect("a byte")
        }
        fn add(&mut self, a: u8, b: u8) -> u8 {
            a.checked_add(b).expect("a byte")
        }
        fn sub(&mut self, a: u8, b: u8) -> u8 {
            a.checked_sub(b).expect("a byte")
        }
        fn mul(&mut self, a: u8, b: u8) -> u8 {
            a.checked_mul(b).expect("a byte")
        }
        fn lt(&mut self, a: u8, b: u8) -> bool {
            a < b
        }
        fn select(&mut self, mask: bool, a: u8, b: u8) -> u8 {
            if mask { a } else { b }
        }
    }

    #[test]
    fn the_median_family_fits_bytes() {
        let mut random = crate::generate::Random::new(1);
        for round in 0..100_000 {
            let spread = [256, 40, 3][round % 3];
            let n: [i32; 9] = std::array::from_fn(|_| random.below(spread) as i32);
            let bytes = n.map(|v| v as u8);
            let (m, b) = (&mut ScalarPixels, &mut CheckedBytes);
            assert_eq!(truncated_median(m, &n), i32::from(truncated_median(b, &bytes)), "{n:?}");
            assert_eq!(median_corner(m, &n), i32::from(median_corner(b, &bytes)), "{n:?}");
        }
    }

    #[test]
    fn operators_look_where_their_documentation_says() {
        let pixels = |operator| (0..9).filter(|&i| looks(operator)[i]).collect::<Vec<usize>>();
        assert_eq!(pixels(Operator::Raw), [4]);
        assert_eq!(pixels(Operator::Median), [0, 1, 2, 3, 4, 5, 6, 7, 8]);
        assert_eq!(pixels(Operator::Gradient), [0, 1, 2, 3, 5, 6, 7, 8]);
        assert_eq!(pixels(Operator::MoravecSlash), [2, 4]);
    }

    #[test]
    fn operators_stay_in_their_ranges() {
        // Every neighbourhood of black and white pixels reaches the extremes.
        for operator in Operator::ALL {
            let mut largest = 0;
            for bits in 0u32..512 {
                let n: [i32; 9] = std::array::from_fn(|i| 255 * (bits >> i & 1).cast_signed());
                let value = apply(&mut ScalarPixels, operator, &n);
                assert!(value >= 0);
                largest = largest.max(value.cast_unsigned());
            }
            assert!(largest <= operator.max(), "{}", operator.name());
            // No neighbourhood has both Sobel components at their extremes, so the bound is not reached there.
            assert!(operator == Operator::Gradient || largest == operator.max(), "{}", operator.name());
        }
    }
}
