//! What can be said of a value without running the program: the side conditions of the rewrite table.

use crate::op::{Leaf, Op};
use crate::program::Inst;

/// Which special values an f32 register may hold. Everything that is not excluded is possible.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Facts {
    /// It may be a NaN.
    pub nan: bool,
    /// It may be an infinity.
    pub infinite: bool,
    /// It may be less than zero.
    pub negative: bool,
    /// It may be the zero with a minus sign.
    pub negative_zero: bool,
}

impl Facts {
    /// Nothing is excluded.
    pub const ANY: Facts = Facts { nan: true, infinite: true, negative: true, negative_zero: true };
    /// A finite number, at least +0.
    pub const NATURAL: Facts = Facts { nan: false, infinite: false, negative: false, negative_zero: false };

    /// What is known of a constant.
    pub fn of(value: f32) -> Facts {
        Facts {
            nan: value.is_nan(),
            infinite: value.is_infinite(),
            negative: value < 0.0,
            negative_zero: value == 0.0 && value.is_sign_negative(),
        }
    }

    /// Neither a NaN nor an infinity.
    pub const fn finite(self) -> bool {
        !self.nan && !self.infinite
    }

    /// What is known of a value that is one or the other.
    #[must_use]
    pub const fn either(self, other: Facts) -> Facts {
        Facts {
            nan: self.nan | other.nan,
            infinite: self.infinite | other.infinite,
            negative: self.negative | other.negative,
            negative_zero: self.negative_zero | other.negative_zero,
        }
    }

    /// What is known of an instruction's result, given the same of its f32 operands.
    pub fn infer(inst: &Inst, operand: impl Fn(usize) -> Facts) -> Facts {
        if let Some(leaf) = inst.leaf() {
            return match leaf {
                Leaf::Const(value) => Facts::of(value),
                // Columns, rows and averages of unsigned pixels are finite and at least +0.
                Leaf::XObstacle | Leaf::X | Leaf::Y | Leaf::Window(_) => Facts::NATURAL,
                Leaf::FirstWindow => Facts { negative: true, ..Facts::NATURAL },
                _ => Facts::ANY,
            };
        }
        match inst.op() {
            Op::Add => {
                let (a, b) = (operand(0), operand(1));
                Facts {
                    // Infinities of both signs cancel to a NaN.
                    nan: a.nan || b.nan || a.infinite && b.infinite && (a.negative || b.negative),
                    // Two finite numbers may overflow.
                    infinite: true,
                    negative: a.negative || b.negative,
                    // x + -x is +0; only two negative zeros make one, or a tiny negative sum, which is exact.
                    negative_zero: a.negative_zero && b.negative_zero,
                }
            }
            Op::Mul => {
                let (a, b) = (operand(0), operand(1));
                let square = inst.args()[0] == inst.args()[1];
                let signed = (a.negative || b.negative || a.negative_zero || b.negative_zero) && !square;
                Facts {
                    // Zero times infinity; a square has no such pair.
                    nan: a.nan || b.nan || (a.infinite || b.infinite) && !square,
                    infinite: true,
                    negative: signed,
                    negative_zero: signed,
                }
            }
            // min and max give b for a NaN in a, and either operand otherwise.
            Op::Min | Op::Max => Facts { nan: operand(1).nan, ..operand(0).either(operand(1)) },
            Op::Select => operand(1).either(operand(2)),
            // Bounded by 1, but NaN for a NaN or an infinity.
            Op::Sin | Op::Cos => {
                Facts { nan: !operand(0).finite(), infinite: false, negative: true, negative_zero: true }
            }
            Op::Atan => Facts { infinite: false, ..operand(0) }.with_signed_zero(operand(0)),
            _ => Facts::ANY,
        }
    }

    const fn with_signed_zero(self, operand: Facts) -> Facts {
        Facts { negative_zero: operand.negative || operand.negative_zero, ..self }
    }
}
