//! Intervals: between which bounds a register's value lies, whatever the image.
//!
//! Rounding to nearest is monotone, so the bounds of a sum, a product or a quotient are the binary32 results at
//! the ends of the operands' intervals: nothing is lost to rounding and nothing is left out. The bounds of the
//! trigonometric functions are those that hold for every argument ([`trig`](crate::formula::trig)); nothing finer
//! is claimed of a polynomial.
//!
//! A mask has an interval too, of 0 for false and 1 for true, so that `and`, `or` and `not` are minimum, maximum
//! and complement.

use std::f32::consts::{FRAC_PI_2, PI};

use crate::formula::trig::{TAN_LARGEST, TAN_REDUCED};
use crate::op::{Leaf, Op, Ty};

const INF: f32 = f32::INFINITY;

/// What values a register may hold: the numbers from `lo` to `hi`, and a NaN if `nan`.
///
/// A bound is never a NaN and never -0; where the interval holds zero, that zero may be -0 only if `negative_zero`.
/// Where `lo` exceeds `hi` no number is possible (a NaN always). No number other than zero is smaller in magnitude than
/// `least`: a quotient by averages of pixels is bounded, because they are at least 1/64 where they are not zero.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interval {
    /// The least number.
    pub lo: f32,
    /// The greatest number.
    pub hi: f32,
    /// A bound below the magnitudes of the numbers other than zero; infinite where there is none.
    pub least: f32,
    /// It may be a NaN.
    pub nan: bool,
    /// It may be the zero with a minus sign.
    pub negative_zero: bool,
}

impl Interval {
    /// Nothing is excluded.
    pub const ANY: Interval = Interval { lo: -INF, hi: INF, least: 0.0, nan: true, negative_zero: true };
    /// Always a NaN.
    pub const NAN: Interval = Interval { lo: INF, hi: -INF, least: INF, nan: true, negative_zero: false };
    /// Always +0.
    pub const ZERO: Interval = Interval::new(0.0, 0.0);
    /// A mask that always holds.
    pub const TRUE: Interval = Interval::new(1.0, 1.0);
    /// A mask that never holds.
    pub const FALSE: Interval = Interval::ZERO;
    /// A mask of which nothing is known.
    pub const MASK: Interval = Interval::new(0.0, 1.0);

    /// The numbers from `lo` to `hi`, -0 not among them. Neither bound may be a NaN.
    pub const fn new(lo: f32, hi: f32) -> Interval {
        let least = if lo > 0.0 {
            lo
        } else if hi < 0.0 {
            -hi
        } else if lo == hi {
            INF
        } else {
            0.0
        };
        // Adding +0 turns -0 into +0 and changes nothing else.
        Interval { lo: lo + 0.0, hi: hi + 0.0, least, nan: false, negative_zero: false }
    }

    /// The same numbers, those other than zero known to be at least `least` in magnitude.
    #[must_use]
    pub const fn coarse(self, least: f32) -> Interval {
        if least > self.least { Interval { least, ..self } } else { self }
    }

    /// What is known of a constant.
    pub fn of(value: f32) -> Interval {
        if value.is_nan() {
            return Interval::NAN;
        }
        let negative_zero = value == 0.0 && value.is_sign_negative();
        Interval { negative_zero, ..Interval::new(value, value) }
    }

    /// The interval of a constant leaf; [`Interval::ANY`] for any other.
    pub fn of_constant(leaf: Leaf) -> Interval {
        match leaf {
            Leaf::Const(value) => Interval::of(value),
            Leaf::MConst(true) => Interval::TRUE,
            Leaf::MConst(false) => Interval::FALSE,
            _ => Interval::ANY,
        }
    }

    /// The one value of this type that a register can hold, if there is but one.
    pub fn constant(self, ty: Ty) -> Option<Leaf> {
        match ty {
            Ty::Mask if self.lo == self.hi => Some(Leaf::MConst(self.lo == 1.0)),
            Ty::F32 if self.is_empty() => Some(Leaf::Const(f32::NAN)),
            Ty::F32 if self.lo == self.hi && !self.nan && !self.negative_zero => Some(Leaf::Const(self.lo)),
            _ => None,
        }
    }

    /// Whether `value` is among the values.
    pub fn contains(self, value: f32) -> bool {
        if value.is_nan() {
            return self.nan;
        }
        let negative_zero = value == 0.0 && value.is_sign_negative();
        let (sized, signed) =
            (value == 0.0 || value.abs() >= self.least, self.negative_zero || !negative_zero);
        self.lo <= value && value <= self.hi && sized && signed
    }

    /// Whether no number is possible.
    pub fn is_empty(self) -> bool {
        self.lo > self.hi
    }

    /// Neither a NaN nor an infinity.
    pub fn finite(self) -> bool {
        !self.nan && !self.may_be_infinite()
    }

    /// A finite number, at least +0.
    pub fn natural(self) -> bool {
        self.finite() && self.lo >= 0.0 && !self.negative_zero
    }

    /// Whether a zero, of either sign, is possible.
    pub fn may_be_zero(self) -> bool {
        self.lo <= 0.0 && self.hi >= 0.0
    }

    /// Whether an infinity is possible.
    pub fn may_be_infinite(self) -> bool {
        self.lo == -INF || self.hi == INF
    }

    /// Whether two values of these intervals that compare equal have the same bits, and no NaN is among them.
    pub fn equal_is_same(self, b: Interval) -> bool {
        let zeros_differ = self.may_be_zero() && b.may_be_zero() && (self.negative_zero || b.negative_zero);
        !self.nan && !b.nan && !zeros_differ
    }

    fn sign_may_be_negative(self) -> bool {
        self.lo < 0.0 || self.negative_zero
    }

    fn sign_may_be_positive(self) -> bool {
        self.hi >= 0.0
    }

    /// What is known of a value that is in one or the other.
    #[must_use]
    pub fn either(self, other: Interval) -> Interval {
        Interval {
            lo: self.lo.min(other.lo),
            hi: self.hi.max(other.hi),
            least: self.least.min(other.least),
            nan: self.nan | other.nan,
            negative_zero: self.negative_zero | other.negative_zero,
        }
    }

    /// What is known of `op`'s result, given the same of its operands. `same`: the first two operands are one
    /// register. For a leaf or an integer nothing is known.
    pub fn infer(op: Op, [a, b, c]: [Interval; 3], same: bool) -> Interval {
        match op {
            Op::Lt => a.lt(b, same),
            Op::Le => a.le(b, same),
            Op::Eq => a.eq(b, same),
            Op::And => Interval::new(a.lo.min(b.lo), a.hi.min(b.hi)),
            Op::Or => Interval::new(a.lo.max(b.lo), a.hi.max(b.hi)),
            Op::Not => Interval::new(1.0 - a.hi, 1.0 - a.lo),
            Op::IEq | Op::ILt => Interval::MASK,
            Op::Select if a.lo == 1.0 => b,
            Op::Select if a.hi == 0.0 => c,
            Op::Select => b.either(c),
            // The two give b for a NaN in a.
            Op::Min | Op::Max if a.is_empty() => b,
            Op::Min => {
                let hi = if a.nan { b.hi } else { a.hi.min(b.hi) };
                a.one_of(b, Interval::new(a.lo.min(b.lo), hi))
            }
            Op::Max => {
                let lo = if a.nan { b.lo } else { a.lo.max(b.lo) };
                a.one_of(b, Interval::new(lo, a.hi.max(b.hi)))
            }
            Op::PDiv if b.lo == 0.0 && b.hi == 0.0 => Interval { nan: b.nan, ..Interval::TRUE },
            // Of a NaN nothing but a NaN comes.
            Op::Add | Op::Sub | Op::Mul | Op::Div | Op::PDiv | Op::Atan2 if a.is_empty() || b.is_empty() => {
                // Protected division alone lets a zero stand above a NaN.
                if op == Op::PDiv && b.may_be_zero() {
                    Interval::new(1.0, 1.0).or_nan()
                } else {
                    Interval::NAN
                }
            }
            Op::Sin | Op::Cos | Op::Tan | Op::Atan if a.is_empty() => Interval::NAN,
            Op::Add => a.add(b, same),
            Op::Sub => a.sub(b, same),
            Op::Mul => a.mul(b, same),
            Op::Div => a.div(b, same),
            Op::PDiv => a.protected_div(b, same),
            // These keep a zero and its sign.
            Op::Sin | Op::Tan | Op::Atan if a.lo == 0.0 && a.hi == 0.0 => a,
            Op::Sin | Op::Cos => {
                let nan = a.nan || a.may_be_infinite();
                Interval { nan, negative_zero: true, ..Interval::new(-1.0, 1.0) }
            }
            Op::Tan if -TAN_REDUCED <= a.lo && a.hi <= TAN_REDUCED => {
                Interval { nan: a.nan, negative_zero: true, ..Interval::new(-TAN_LARGEST, TAN_LARGEST) }
            }
            Op::Tan => Interval { nan: a.nan || a.may_be_infinite(), ..Interval::ANY },
            // Never greater than the operand.
            Op::Atan => Interval {
                nan: a.nan,
                negative_zero: a.sign_may_be_negative(),
                ..Interval::new(a.lo.clamp(-FRAC_PI_2, 0.0), a.hi.clamp(0.0, FRAC_PI_2))
            },
            Op::Atan2 => a.atan2(b),
            _ => Interval::ANY,
        }
    }

    fn or_nan(self) -> Interval {
        Interval { nan: true, ..self }
    }

    /// The rest of what is known of a minimum or maximum of `self` and `b` with these bounds.
    fn one_of(self, b: Interval, bounds: Interval) -> Interval {
        let negative_zero = self.negative_zero | b.negative_zero;
        Interval { nan: b.nan, negative_zero, ..bounds }.coarse(self.least.min(b.least))
    }

    /// From the least to the greatest result of `f` at the corners. A corner that gives a NaN (0 times infinity,
    /// infinity over infinity, 0 over 0) stands for results that reach 0: those beside it are at the other corners.
    fn corners(self, b: Interval, f: impl Fn(f32, f32) -> f32) -> Interval {
        let at = |x: f32, y: f32| {
            let value = f(x, y);
            if value.is_nan() { 0.0 } else { value }
        };
        let [p, q, r, s] = [at(self.lo, b.lo), at(self.lo, b.hi), at(self.hi, b.lo), at(self.hi, b.hi)];
        Interval::new(p.min(q).min(r.min(s)), p.max(q).max(r.max(s)))
    }

    /// Whether a product or quotient can have a minus sign.
    fn signs_may_differ(self, b: Interval) -> bool {
        self.sign_may_be_negative() && b.sign_may_be_positive()
            || self.sign_may_be_positive() && b.sign_may_be_negative()
    }

    fn add(self, b: Interval, same: bool) -> Interval {
        let opposite = self.hi == INF && b.lo == -INF || self.lo == -INF && b.hi == INF;
        let (lo, hi) = (self.lo + b.lo, self.hi + b.hi);
        let sum = Interval {
            nan: self.nan || b.nan || opposite && !same,
            // x + -x is +0, and a tiny sum is exact: only two negative zeros make one.
            negative_zero: self.negative_zero && b.negative_zero,
            ..Interval::new(if lo.is_nan() { -INF } else { lo }, if hi.is_nan() { INF } else { hi })
        };
        // Without a subtraction it is as large as one of the two.
        let grows = self.lo >= 0.0 && b.lo >= 0.0 || self.hi <= 0.0 && b.hi <= 0.0;
        if grows { sum.coarse(self.least.min(b.least)) } else { sum }
    }

    fn sub(self, b: Interval, same: bool) -> Interval {
        if same {
            return Interval { nan: !self.finite(), ..Interval::ZERO };
        }
        let negated = Interval { nan: b.nan, negative_zero: b.may_be_zero(), ..Interval::new(-b.hi, -b.lo) };
        let negated = negated.coarse(b.least);
        self.add(negated, false)
    }

    fn mul(self, b: Interval, same: bool) -> Interval {
        let mut product = self.corners(b, |x, y| x * y);
        if same {
            // A square: at least +0, and no zero meets an infinity.
            let (p, q) = (self.lo * self.lo, self.hi * self.hi);
            product = Interval::new(if self.may_be_zero() { 0.0 } else { p.min(q) }, p.max(q));
            return Interval { nan: self.nan, ..product }.coarse(self.least * self.least);
        }
        let zero_times_infinity =
            self.may_be_zero() && b.may_be_infinite() || self.may_be_infinite() && b.may_be_zero();
        Interval {
            nan: self.nan || b.nan || zero_times_infinity,
            negative_zero: self.signs_may_differ(b) && product.may_be_zero(),
            ..product
        }
        .coarse(self.least * b.least)
    }

    /// The quotients by the numbers of `b` other than zeros.
    fn quotient(self, b: Interval) -> Interval {
        let mut quotient = Interval::ANY;
        if b.lo >= 0.0 {
            // Where nothing is known of the least divisor, the corner at +0 is the limit.
            let divisors = Interval { lo: b.lo.max(b.least), ..b };
            quotient = self.corners(divisors, |x, y| x / y);
        } else if b.hi <= 0.0 {
            // The same at -0.
            let divisors = Interval { hi: b.hi.min(-b.least), ..b };
            quotient = self.corners(divisors, |x, y| x / if y == 0.0 { -0.0 } else { y });
        } else if b.least > 0.0 {
            let largest = self.lo.abs().max(self.hi.abs()) / b.least;
            let largest = if largest.is_nan() { INF } else { largest };
            quotient = Interval::new(-largest, largest);
        }
        Interval {
            nan: self.nan || b.nan || self.may_be_infinite() && b.may_be_infinite(),
            negative_zero: self.signs_may_differ(b) && quotient.may_be_zero(),
            ..quotient
        }
        .coarse(self.least / b.lo.abs().max(b.hi.abs()))
    }

    fn div(self, b: Interval, same: bool) -> Interval {
        if same {
            return Interval { nan: !self.finite() || self.may_be_zero(), ..Interval::TRUE };
        }
        let mut quotient = self.quotient(b);
        if b.may_be_zero() {
            quotient.nan |= self.may_be_zero();
            // A divisor +0 keeps the sign; -0, if it can be, turns it round.
            if self.hi > 0.0 || b.negative_zero {
                quotient.hi = INF;
            }
            if self.lo < 0.0 || b.negative_zero {
                quotient.lo = -INF;
            }
        }
        quotient
    }

    fn protected_div(self, b: Interval, same: bool) -> Interval {
        let one = Interval::new(1.0, 1.0);
        if same {
            return Interval { nan: !self.finite(), ..one };
        }
        let quotient = self.quotient(b);
        if b.may_be_zero() { quotient.either(one) } else { quotient }
    }

    fn atan2(self, b: Interval) -> Interval {
        let nan = self.nan || b.nan;
        if self.lo == 0.0 && self.hi == 0.0 && b.lo >= 0.0 {
            return Interval { nan, ..self };
        }
        let furthest = if b.lo >= 0.0 { FRAC_PI_2 } else { PI };
        let negative = self.sign_may_be_negative();
        Interval {
            nan,
            negative_zero: negative,
            ..Interval::new(if negative { -furthest } else { 0.0 }, furthest)
        }
    }

    fn lt(self, b: Interval, same: bool) -> Interval {
        if same || self.lo >= b.hi || self.is_empty() || b.is_empty() {
            Interval::FALSE
        } else if self.hi < b.lo && !self.nan && !b.nan {
            Interval::TRUE
        } else {
            Interval::MASK
        }
    }

    fn le(self, b: Interval, same: bool) -> Interval {
        if self.is_empty() || b.is_empty() || !same && self.lo > b.hi {
            Interval::FALSE
        } else if (same || self.hi <= b.lo) && !self.nan && !b.nan {
            Interval::TRUE
        } else {
            Interval::MASK
        }
    }

    fn eq(self, b: Interval, same: bool) -> Interval {
        let point = self.lo == self.hi && b.lo == b.hi && self.lo == b.lo;
        if self.is_empty() || b.is_empty() || !same && (self.lo > b.hi || self.hi < b.lo) {
            Interval::FALSE
        } else if (same || point) && !self.nan && !b.nan {
            Interval::TRUE
        } else {
            Interval::MASK
        }
    }
}
