//! What computes a formula: a number, a vector of lanes, an instruction builder, C text.
//!
//! A [`Machine`] offers the basic operations of the language on three kinds of values. Everything above them
//! (minimum, protected division, the trigonometric functions, the meaning of [`crate::Op`]) is written once
//! over this trait, so that an interpreter, the JIT and exported code cannot disagree.

/// The basic operations, each exactly rounded and free of traps.
///
/// Implementors must honour IEEE 754 binary32 with rounding to nearest even and subnormals kept, and must not
/// contract a multiplication and an addition. Comparisons with a NaN are false. The payload and sign of a NaN
/// result are unspecified, so formulas must not let them show.
pub trait Machine {
    /// A binary32 value, or a vector of them.
    type F: Copy;
    /// A 32-bit integer value with wrapping arithmetic, or a vector of them.
    type I: Copy;
    /// A truth value, or a vector of them.
    type M: Copy;

    /// The constant `value`.
    fn f32(&mut self, value: f32) -> Self::F;
    /// The constant `value`.
    fn i32(&mut self, value: i32) -> Self::I;
    /// The constant `value`.
    fn mask(&mut self, value: bool) -> Self::M;

    /// `a + b`.
    fn add(&mut self, a: Self::F, b: Self::F) -> Self::F;
    /// `a - b`.
    fn sub(&mut self, a: Self::F, b: Self::F) -> Self::F;
    /// `a * b`.
    fn mul(&mut self, a: Self::F, b: Self::F) -> Self::F;
    /// `a / b`, IEEE division.
    fn div(&mut self, a: Self::F, b: Self::F) -> Self::F;

    /// `a < b`.
    fn lt(&mut self, a: Self::F, b: Self::F) -> Self::M;
    /// `a <= b`.
    fn le(&mut self, a: Self::F, b: Self::F) -> Self::M;
    /// `a == b`.
    fn eq(&mut self, a: Self::F, b: Self::F) -> Self::M;

    /// `a` where the mask holds, else `b`.
    fn select(&mut self, mask: Self::M, a: Self::F, b: Self::F) -> Self::F;
    /// `a` where the mask holds, else `b`.
    fn iselect(&mut self, mask: Self::M, a: Self::I, b: Self::I) -> Self::I;

    /// Both.
    fn and(&mut self, a: Self::M, b: Self::M) -> Self::M;
    /// Either.
    fn or(&mut self, a: Self::M, b: Self::M) -> Self::M;
    /// Negation.
    fn not(&mut self, a: Self::M) -> Self::M;

    /// The binary32's bit pattern.
    fn to_bits(&mut self, a: Self::F) -> Self::I;
    /// The binary32 with this bit pattern.
    #[expect(clippy::wrong_self_convention, reason = "the machine makes the value; `self` is not converted")]
    fn from_bits(&mut self, a: Self::I) -> Self::F;

    /// `a + b`, wrapping.
    fn iadd(&mut self, a: Self::I, b: Self::I) -> Self::I;
    /// `a - b`, wrapping.
    fn isub(&mut self, a: Self::I, b: Self::I) -> Self::I;
    /// Bitwise and.
    fn iand(&mut self, a: Self::I, b: Self::I) -> Self::I;
    /// Bitwise or.
    fn ior(&mut self, a: Self::I, b: Self::I) -> Self::I;
    /// Bitwise exclusive or.
    fn ixor(&mut self, a: Self::I, b: Self::I) -> Self::I;
    /// Shift left by a fixed number of bits, 0 to 31.
    fn ishl(&mut self, a: Self::I, bits: u32) -> Self::I;
    /// Logical (zero-filling) shift right by a fixed number of bits, 0 to 31.
    fn iushr(&mut self, a: Self::I, bits: u32) -> Self::I;
    /// `a == b`.
    fn ieq(&mut self, a: Self::I, b: Self::I) -> Self::M;
    /// `a < b`, signed.
    fn ilt(&mut self, a: Self::I, b: Self::I) -> Self::M;
}

/// The machine of plain numbers: one case at a time.
#[derive(Debug, Clone, Copy, Default)]
pub struct Scalar;

impl Machine for Scalar {
    type F = f32;
    type I = i32;
    type M = bool;

    #[inline(always)]
    fn f32(&mut self, value: f32) -> f32 {
        value
    }
    #[inline(always)]
    fn i32(&mut self, value: i32) -> i32 {
        value
    }
    #[inline(always)]
    fn mask(&mut self, value: bool) -> bool {
        value
    }
    #[inline(always)]
    fn add(&mut self, a: f32, b: f32) -> f32 {
        a + b
    }
    #[inline(always)]
    fn sub(&mut self, a: f32, b: f32) -> f32 {
        a - b
    }
    #[inline(always)]
    fn mul(&mut self, a: f32, b: f32) -> f32 {
        a * b
    }
    #[inline(always)]
    fn div(&mut self, a: f32, b: f32) -> f32 {
        a / b
    }
    #[inline(always)]
    fn lt(&mut self, a: f32, b: f32) -> bool {
        a < b
    }
    #[inline(always)]
    fn le(&mut self, a: f32, b: f32) -> bool {
        a <= b
    }
    #[inline(always)]
    fn eq(&mut self, a: f32, b: f32) -> bool {
        a == b
    }
    #[inline(always)]
    fn select(&mut self, mask: bool, a: f32, b: f32) -> f32 {
        if mask { a } else { b }
    }
    #[inline(always)]
    fn iselect(&mut self, mask: bool, a: i32, b: i32) -> i32 {
        if mask { a } else { b }
    }
    #[inline(always)]
    fn and(&mut self, a: bool, b: bool) -> bool {
        a & b
    }
    #[inline(always)]
    fn or(&mut self, a: bool, b: bool) -> bool {
        a | b
    }
    #[inline(always)]
    fn not(&mut self, a: bool) -> bool {
        !a
    }
    #[inline(always)]
    fn to_bits(&mut self, a: f32) -> i32 {
        a.to_bits().cast_signed()
    }
    #[inline(always)]
    fn from_bits(&mut self, a: i32) -> f32 {
        f32::from_bits(a.cast_unsigned())
    }
    #[inline(always)]
    fn iadd(&mut self, a: i32, b: i32) -> i32 {
        a.wrapping_add(b)
    }
    #[inline(always)]
    fn isub(&mut self, a: i32, b: i32) -> i32 {
        a.wrapping_sub(b)
    }
    #[inline(always)]
    fn iand(&mut self, a: i32, b: i32) -> i32 {
        a & b
    }
    #[inline(always)]
    fn ior(&mut self, a: i32, b: i32) -> i32 {
        a | b
    }
    #[inline(always)]
    fn ixor(&mut self, a: i32, b: i32) -> i32 {
        a ^ b
    }
    #[inline(always)]
    fn ishl(&mut self, a: i32, bits: u32) -> i32 {
        a.wrapping_shl(bits)
    }
    #[inline(always)]
    fn iushr(&mut self, a: i32, bits: u32) -> i32 {
        a.cast_unsigned().wrapping_shr(bits).cast_signed()
    }
    #[inline(always)]
    fn ieq(&mut self, a: i32, b: i32) -> bool {
        a == b
    }
    #[inline(always)]
    fn ilt(&mut self, a: i32, b: i32) -> bool {
        a < b
    }
}
