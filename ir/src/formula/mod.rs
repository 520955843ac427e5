//! Every formula of the language, written once over the [`Machine`](crate::machine::Machine) that computes it.
//!
//! * [`arith`]: minimum, maximum, protected division, the rounding and clamping of a column;
//! * [`trig`]: sine, cosine, tangent, arc tangents;
//! * [`image`]: the eight image operators, over pixels.

pub mod arith;
pub mod image;
pub mod trig;
