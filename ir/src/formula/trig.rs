//! Trigonometry (placeholder until the formulas land).
use crate::machine::Machine;
/// sin
pub fn sin<M: Machine + ?Sized>(_m: &mut M, a: M::F) -> M::F {
    a
}
/// cos
pub fn cos<M: Machine + ?Sized>(_m: &mut M, a: M::F) -> M::F {
    a
}
/// tan
pub fn tan<M: Machine + ?Sized>(_m: &mut M, a: M::F) -> M::F {
    a
}
/// atan
pub fn atan<M: Machine + ?Sized>(_m: &mut M, a: M::F) -> M::F {
    a
}
/// atan2
pub fn atan2<M: Machine + ?Sized>(_m: &mut M, a: M::F, _b: M::F) -> M::F {
    a
}
