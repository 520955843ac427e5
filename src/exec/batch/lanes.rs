//! The machine of vectors: every operation of the language on as many fitness cases as a vector has lanes.

use pulp::Simd;
use vsonar_ir::machine::Machine;

/// The operations of one instruction set as a [`Machine`].
#[derive(Debug, Clone, Copy)]
pub(super) struct Lanes<S>(pub(super) S);

impl<S: Simd> Machine for Lanes<S> {
    type F = S::f32s;
    type I = S::u32s;
    type M = S::m32s;

    #[inline(always)]
    fn f32(&mut self, value: f32) -> S::f32s {
        self.0.splat_f32s(value)
    }
    #[inline(always)]
    fn i32(&mut self, value: i32) -> S::u32s {
        self.0.splat_u32s(value.cast_unsigned())
    }
    #[inline(always)]
    fn mask(&mut self, value: bool) -> S::m32s {
        let (zero, other) = (self.0.splat_u32s(0), self.0.splat_u32s(u32::from(!value)));
        self.0.equal_u32s(zero, other)
    }

    #[inline(always)]
    fn add(&mut self, a: S::f32s, b: S::f32s) -> S::f32s {
        self.0.add_f32s(a, b)
    }
    #[inline(always)]
    fn sub(&mut self, a: S::f32s, b: S::f32s) -> S::f32s {
        self.0.sub_f32s(a, b)
    }
    #[inline(always)]
    fn mul(&mut self, a: S::f32s, b: S::f32s) -> S::f32s {
        self.0.mul_f32s(a, b)
    }
    #[inline(always)]
    fn div(&mut self, a: S::f32s, b: S::f32s) -> S::f32s {
        self.0.div_f32s(a, b)
    }

    #[inline(always)]
    fn lt(&mut self, a: S::f32s, b: S::f32s) -> S::m32s {
        self.0.less_than_f32s(a, b)
    }
    #[inline(always)]
    fn le(&mut self, a: S::f32s, b: S::f32s) -> S::m32s {
        self.0.less_than_or_equal_f32s(a, b)
    }
    #[inline(always)]
    fn eq(&mut self, a: S::f32s, b: S::f32s) -> S::m32s {
        self.0.equal_f32s(a, b)
    }

    #[inline(always)]
    fn select(&mut self, mask: S::m32s, a: S::f32s, b: S::f32s) -> S::f32s {
        self.0.select_f32s(mask, a, b)
    }
    #[inline(always)]
    fn iselect(&mut self, mask: S::m32s, a: S::u32s, b: S::u32s) -> S::u32s {
        self.0.select_u32s(mask, a, b)
    }

    #[inline(always)]
    fn and(&mut self, a: S::m32s, b: S::m32s) -> S::m32s {
        self.0.and_m32s(a, b)
    }
    #[inline(always)]
    fn or(&mut self, a: S::m32s, b: S::m32s) -> S::m32s {
        self.0.or_m32s(a, b)
    }
    #[inline(always)]
    fn not(&mut self, a: S::m32s) -> S::m32s {
        self.0.not_m32s(a)
    }

    #[inline(always)]
    fn to_bits(&mut self, a: S::f32s) -> S::u32s {
        self.0.transmute_u32s_f32s(a)
    }
    #[inline(always)]
    fn from_bits(&mut self, a: S::u32s) -> S::f32s {
        self.0.transmute_f32s_u32s(a)
    }

    #[inline(always)]
    fn iadd(&mut self, a: S::u32s, b: S::u32s) -> S::u32s {
        self.0.add_u32s(a, b)
    }
    #[inline(always)]
    fn isub(&mut self, a: S::u32s, b: S::u32s) -> S::u32s {
        self.0.sub_u32s(a, b)
    }
    #[inline(always)]
    fn iand(&mut self, a: S::u32s, b: S::u32s) -> S::u32s {
        self.0.and_u32s(a, b)
    }
    #[inline(always)]
    fn ior(&mut self, a: S::u32s, b: S::u32s) -> S::u32s {
        self.0.or_u32s(a, b)
    }
    #[inline(always)]
    fn ixor(&mut self, a: S::u32s, b: S::u32s) -> S::u32s {
        self.0.xor_u32s(a, b)
    }
    #[inline(always)]
    fn ishl(&mut self, a: S::u32s, bits: u32) -> S::u32s {
        self.0.wrapping_dyn_shl_u32s(a, self.0.splat_u32s(bits))
    }
    #[inline(always)]
    fn iushr(&mut self, a: S::u32s, bits: u32) -> S::u32s {
        self.0.wrapping_dyn_shr_u32s(a, self.0.splat_u32s(bits))
    }
    #[inline(always)]
    fn ieq(&mut self, a: S::u32s, b: S::u32s) -> S::m32s {
        self.0.equal_u32s(a, b)
    }
    #[inline(always)]
    fn ilt(&mut self, a: S::u32s, b: S::u32s) -> S::m32s {
        self.0.less_than_i32s(self.0.transmute_i32s_u32s(a), self.0.transmute_i32s_u32s(b))
    }
}
