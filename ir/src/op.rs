//! The one table of operations.
//!
//! Parser, printer, verifier, evaluators, random generation and every back end derive from this table; nowhere
//! is there a second list. A row gives an operation's name in `.vir` text, the types of its operands and
//! result, whether its first two operands may be exchanged, and its exact meaning as a formula over a
//! [`Machine`]. A *function* is an operation of binary32 values whose formula takes several steps of the machine; its row
//! says in words what it is, and whatever runs or shows programs handles all functions alike. Operations without a formula
//! are the *leaves*: constants, parameters of the case and the
//! position, carried registers, and window operands (see [`Leaf`]).

use crate::formula::{arith, trig};
use crate::machine::Machine;
use crate::window::Operand;

/// The type of a register.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Ty {
    /// IEEE 754 binary32.
    F32,
    /// 32-bit integer, wrapping; only the bit patterns inside formulas use it.
    I32,
    /// A truth value (of each lane, where there are lanes).
    Mask,
}

impl std::fmt::Display for Ty {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Ty::F32 => "f32",
            Ty::I32 => "i32",
            Ty::Mask => "mask",
        })
    }
}

/// A value on some machine, with its type.
#[derive(Debug)]
pub enum Value<M: Machine + ?Sized> {
    /// A binary32.
    F32(M::F),
    /// An integer.
    I32(M::I),
    /// A truth value.
    Mask(M::M),
}

impl<M: Machine + ?Sized> Clone for Value<M> {
    fn clone(&self) -> Self {
        *self
    }
}
impl<M: Machine + ?Sized> Copy for Value<M> {}

impl<M: Machine + ?Sized> Value<M> {
    /// The value's type.
    pub fn ty(self) -> Ty {
        match self {
            Value::F32(_) => Ty::F32,
            Value::I32(_) => Ty::I32,
            Value::Mask(_) => Ty::Mask,
        }
    }

    /// The binary32 inside.
    ///
    /// # Panics
    /// If it is of another type, which the verifier excludes for operands of a verified program.
    #[inline(always)]
    pub fn f32(self) -> M::F {
        let Value::F32(v) = self else { panic!("an f32 is expected here, not {}", self.ty()) };
        v
    }

    /// The integer inside.
    ///
    /// # Panics
    /// As [`Value::f32`].
    #[inline(always)]
    pub fn i32(self) -> M::I {
        let Value::I32(v) = self else { panic!("an i32 is expected here, not {}", self.ty()) };
        v
    }

    /// The truth value inside.
    ///
    /// # Panics
    /// As [`Value::f32`].
    #[inline(always)]
    pub fn mask(self) -> M::M {
        let Value::Mask(v) = self else { panic!("a mask is expected here, not {}", self.ty()) };
        v
    }
}

/// An operation that is no leaf, as a type.
pub trait Formula {
    /// Which operation.
    const OP: Op;

    /// Computes it; as [`Op::apply`].
    ///
    /// # Panics
    /// If the operands are not of the types of [`Op::operands`].
    fn apply<M: Machine + ?Sized>(machine: &mut M, args: &[Value<M>], imm: u32) -> Value<M>;
}

/// What wants an operation's formula as a type: see [`Op::visit`].
pub trait FormulaVisitor {
    /// What comes of it.
    type Output;

    /// Takes the formula.
    fn visit<F: Formula>(self) -> Self::Output;
}

macro_rules! take {
    (F32, $v:expr) => {
        $v.f32()
    };
    (I32, $v:expr) => {
        $v.i32()
    };
    (Mask, $v:expr) => {
        $v.mask()
    };
}

macro_rules! operations {
    (
        leaves { $( $(#[$ldoc:meta])* $leaf:ident $lname:literal -> $lty:ident; )* }
        formulas { $( $(#[$doc:meta])* $op:ident $name:literal
            ($($arg:ident : $aty:ident),* $(; $imm:ident)?) -> $ty:ident $([$kind:ident $($about:literal)?])?
            = |$m:ident| $body:expr; )* }
    ) => {
        /// An operation. The documentation of each gives its text form and meaning.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
        #[repr(u8)]
        pub enum Op {
            $( $(#[$ldoc])* $leaf, )*
            $( $(#[$doc])* $op, )*
        }

        impl Op {
            /// Every operation, leaves first, in the order of the table.
            pub const ALL: &'static [Op] = &[ $( Op::$leaf, )* $( Op::$op, )* ];

            /// The name in `.vir` text.
            pub const fn name(self) -> &'static str {
                match self {
                    $( Op::$leaf => $lname, )*
                    $( Op::$op => $name, )*
                }
            }

            /// The operands' types; none for a leaf.
            pub const fn operands(self) -> &'static [Ty] {
                match self {
                    $( Op::$leaf => &[], )*
                    $( Op::$op => &[ $( Ty::$aty ),* ], )*
                }
            }

            /// The result's type.
            pub const fn result(self) -> Ty {
                match self {
                    $( Op::$leaf => Ty::$lty, )*
                    $( Op::$op => Ty::$ty, )*
                }
            }

            /// Whether the operation is a leaf: it has no operands, and its meaning is a [`Leaf`].
            pub const fn is_leaf(self) -> bool {
                match self {
                    $( Op::$leaf => true, )*
                    $( Op::$op => false, )*
                }
            }

            /// Whether the first two operands may be exchanged without changing the result.
            pub const fn is_commutative(self) -> bool {
                match self {
                    $( Op::$leaf => false, )*
                    $( Op::$op => operations!(@commutative $($kind)?), )*
                }
            }

            /// What the operation is in words, for operands `a` and `b`, if it is a function: its formula is made of the
            /// machine's own operations, operands and result are binary32.
            pub const fn function(self) -> Option<&'static str> {
                match self {
                    $( Op::$leaf => None, )*
                    $( Op::$op => operations!(@function $($($about)?)?), )*
                }
            }

            /// Whether the instruction carries a shift count.
            pub const fn has_shift(self) -> bool {
                match self {
                    $( Op::$leaf => false, )*
                    $( Op::$op => operations!(@shift $($imm)?), )*
                }
            }

            /// Computes the operation on a machine; `None` for a leaf. `imm` is the instruction's immediate.
            ///
            /// # Panics
            /// If the operands are not of the types of [`Op::operands`].
            #[inline]
            pub fn apply<M: Machine + ?Sized>(
                self,
                machine: &mut M,
                args: &[Value<M>],
                imm: u32,
            ) -> Option<Value<M>> {
                match self {
                    $( Op::$leaf => None, )*
                    $( Op::$op => Some(formulas::$op::apply(machine, args, imm)), )*
                }
            }

            /// Hands the operation's formula to a visitor, as a type; `None` for a leaf. What the visitor does
            /// with it is compiled once for each operation.
            #[inline(always)]
            pub fn visit<V: FormulaVisitor>(self, visitor: V) -> Option<V::Output> {
                match self {
                    $( Op::$leaf => None, )*
                    $( Op::$op => Some(visitor.visit::<formulas::$op>()), )*
                }
            }
        }

        /// The formulas of the operations that are no leaves, each as a type, for loops that want one inlined.
        pub mod formulas {
            use super::*;

            $(
                $(#[$doc])*
                #[derive(Debug, Clone, Copy)]
                pub struct $op;

                impl Formula for $op {
                    const OP: Op = Op::$op;

                    #[inline(always)]
                    fn apply<M: Machine + ?Sized>($m: &mut M, args: &[Value<M>], imm: u32) -> Value<M> {
                        let _ = imm;
                        let mut _args = args.iter();
                        $( let $arg = take!($aty, _args.next().expect("the verifier counts operands")); )*
                        $( let $imm = imm; )?
                        Value::$ty($body)
                    }
                }
            )*
        }
    };
    (@commutative commutative) => { true };
    (@commutative $($function:ident)?) => { false };
    (@function $about:literal) => { Some($about) };
    (@function) => { None };
    (@shift $imm:ident) => { true };
    (@shift) => { false };
}

operations! {
    leaves {
        /// `const 0.5`: a binary32 constant.
        Const "const" -> F32;
        /// `iconst -7`: an integer constant.
        IConst "iconst" -> I32;
        /// `mconst true`: a constant mask.
        MConst "mconst" -> Mask;
        /// `x-obstacle`: the column asked for, in pixels.
        XObstacle "x-obstacle" -> F32;
        /// `iter2 a` … `iter2 e`: a final register of the first loop; in the second loop only.
        Iter2 "iter2" -> F32;
        /// `x`: the centre column of the window, in pixels, after clamping; in bodies only.
        X "x" -> F32;
        /// `y`: the centre row of the window, in pixels; in bodies only.
        Y "y" -> F32;
        /// `first-window`: 1 at the first position of the iteration, else -1; in bodies only.
        FirstWindow "first-window" -> F32;
        /// `read a` … `read e`: a carried register as the previous position left it; in bodies only.
        Read "read" -> F32;
        /// `window gradient-sq`: a window operand at the current position; in bodies only.
        Window "window" -> F32;
    }
    formulas {
        /// `add x y`: x + y.
        Add "add" (a: F32, b: F32) -> F32 [commutative] = |m| m.add(a, b);
        /// `sub x y`: x - y.
        Sub "sub" (a: F32, b: F32) -> F32 = |m| m.sub(a, b);
        /// `mul x y`: x · y.
        Mul "mul" (a: F32, b: F32) -> F32 [commutative] = |m| m.mul(a, b);
        /// `div x y`: x / y, IEEE division.
        Div "div" (a: F32, b: F32) -> F32 = |m| m.div(a, b);
        /// `pdiv x y`: protected division, 1 where y is zero of either sign (Koza 1992), else x / y.
        PDiv "pdiv" (a: F32, b: F32) -> F32 [function "a / b, but 1 where b is zero."]
            = |m| arith::protected_div(m, a, b);
        /// `min x y`: x where x < y, else y (so a NaN gives y).
        Min "min" (a: F32, b: F32) -> F32 [function "The smaller one; b where either is a NaN."]
            = |m| arith::min(m, a, b);
        /// `max x y`: x where x > y, else y (so a NaN gives y).
        Max "max" (a: F32, b: F32) -> F32 [function "The larger one; b where either is a NaN."]
            = |m| arith::max(m, a, b);
        /// `sin x`, x in radians ([`trig::sin`]).
        Sin "sin" (a: F32) -> F32 [function "Of an angle in radians."]
            = |m| trig::sin(m, a);
        /// `cos x`, x in radians ([`trig::cos`]).
        Cos "cos" (a: F32) -> F32 [function "Of an angle in radians."]
            = |m| trig::cos(m, a);
        /// `tan x`, x in radians ([`trig::tan`]).
        Tan "tan" (a: F32) -> F32 [function "Of an angle in radians."]
            = |m| trig::tan(m, a);
        /// `atan x`, in radians ([`trig::atan`]).
        Atan "atan" (a: F32) -> F32 [function "The arc tangent, in radians."]
            = |m| trig::atan(m, a);
        /// `atan2 y x`, in radians, the ordinate first ([`trig::atan2`]).
        Atan2 "atan2" (a: F32, b: F32) -> F32 [function "The angle of the point with ordinate a and abscissa b, in radians."]
            = |m| trig::atan2(m, a, b);
        /// `lt x y`: x < y, false with a NaN.
        Lt "lt" (a: F32, b: F32) -> Mask = |m| m.lt(a, b);
        /// `le x y`: x <= y, false with a NaN.
        Le "le" (a: F32, b: F32) -> Mask = |m| m.le(a, b);
        /// `eq x y`: x = y, false with a NaN; both zeros are equal.
        Eq "eq" (a: F32, b: F32) -> Mask [commutative] = |m| m.eq(a, b);
        /// `select c x y`: x where c holds, else y.
        Select "select" (c: Mask, a: F32, b: F32) -> F32 = |m| m.select(c, a, b);
        /// `iselect c x y`: x where c holds, else y.
        ISelect "iselect" (c: Mask, a: I32, b: I32) -> I32 = |m| m.iselect(c, a, b);
        /// `and p q`: both hold.
        And "and" (p: Mask, q: Mask) -> Mask [commutative] = |m| m.and(p, q);
        /// `or p q`: at least one holds.
        Or "or" (p: Mask, q: Mask) -> Mask [commutative] = |m| m.or(p, q);
        /// `not p`.
        Not "not" (p: Mask) -> Mask = |m| m.not(p);
        /// `bits x`: the bit pattern of a binary32. Of a NaN it is unspecified.
        ToBits "bits" (a: F32) -> I32 = |m| m.to_bits(a);
        /// `float i`: the binary32 with this bit pattern.
        FromBits "float" (a: I32) -> F32 = |m| m.from_bits(a);
        /// `iadd i j`: i + j, wrapping.
        IAdd "iadd" (a: I32, b: I32) -> I32 [commutative] = |m| m.iadd(a, b);
        /// `isub i j`: i - j, wrapping.
        ISub "isub" (a: I32, b: I32) -> I32 = |m| m.isub(a, b);
        /// `iand i j`, bitwise.
        IAnd "iand" (a: I32, b: I32) -> I32 [commutative] = |m| m.iand(a, b);
        /// `ior i j`, bitwise.
        IOr "ior" (a: I32, b: I32) -> I32 [commutative] = |m| m.ior(a, b);
        /// `ixor i j`, bitwise.
        IXor "ixor" (a: I32, b: I32) -> I32 [commutative] = |m| m.ixor(a, b);
        /// `ishl i n`: shift left by n bits, 0 to 31.
        IShl "ishl" (a: I32; bits) -> I32 = |m| m.ishl(a, bits);
        /// `iushr i n`: zero-filling shift right by n bits, 0 to 31.
        IUshr "iushr" (a: I32; bits) -> I32 = |m| m.iushr(a, bits);
        /// `ieq i j`: i = j.
        IEq "ieq" (a: I32, b: I32) -> Mask [commutative] = |m| m.ieq(a, b);
        /// `ilt i j`: i < j, signed.
        ILt "ilt" (a: I32, b: I32) -> Mask = |m| m.ilt(a, b);
    }
}

impl Op {
    /// The operation of this name.
    pub fn from_name(name: &str) -> Option<Op> {
        Op::ALL.iter().copied().find(|op| op.name() == name)
    }
}

/// Names of the five carried registers, by number.
pub const REGISTER_NAMES: [&str; 5] = ["a", "b", "c", "d", "e"];

/// What a leaf instruction stands for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Leaf {
    /// A binary32 constant.
    Const(f32),
    /// An integer constant.
    IConst(i32),
    /// A constant mask.
    MConst(bool),
    /// The column asked for.
    XObstacle,
    /// A final register of the first loop, 0 to 4.
    Iter2(u8),
    /// The window's centre column.
    X,
    /// The window's centre row.
    Y,
    /// 1 at the first position, else -1.
    FirstWindow,
    /// A carried register, 0 to 4.
    Read(u8),
    /// A window operand.
    Window(Operand),
}

impl Leaf {
    /// The leaf of operation `op` with immediate `imm`; `None` if `op` is no leaf or the immediate is out of
    /// its range.
    pub fn decode(op: Op, imm: u32) -> Option<Leaf> {
        let register = || (imm < 5).then_some(imm as u8);
        let bare = |leaf| (imm == 0).then_some(leaf);
        match op {
            Op::Const => Some(Leaf::Const(f32::from_bits(imm))),
            Op::IConst => Some(Leaf::IConst(imm.cast_signed())),
            Op::MConst => (imm < 2).then_some(Leaf::MConst(imm == 1)),
            Op::XObstacle => bare(Leaf::XObstacle),
            Op::Iter2 => register().map(Leaf::Iter2),
            Op::X => bare(Leaf::X),
            Op::Y => bare(Leaf::Y),
            Op::FirstWindow => bare(Leaf::FirstWindow),
            Op::Read => register().map(Leaf::Read),
            Op::Window => u8::try_from(imm).ok().and_then(Operand::from_index).map(Leaf::Window),
            _ => None,
        }
    }

    /// The operation and immediate of this leaf. A NaN constant is stored as the one canonical NaN.
    pub fn encode(self) -> (Op, u32) {
        match self {
            Leaf::Const(v) if v.is_nan() => (Op::Const, f32::NAN.to_bits()),
            Leaf::Const(v) => (Op::Const, v.to_bits()),
            Leaf::IConst(v) => (Op::IConst, v.cast_unsigned()),
            Leaf::MConst(v) => (Op::MConst, u32::from(v)),
            Leaf::XObstacle => (Op::XObstacle, 0),
            Leaf::Iter2(k) => (Op::Iter2, u32::from(k)),
            Leaf::X => (Op::X, 0),
            Leaf::Y => (Op::Y, 0),
            Leaf::FirstWindow => (Op::FirstWindow, 0),
            Leaf::Read(k) => (Op::Read, u32::from(k)),
            Leaf::Window(operand) => (Op::Window, u32::from(operand.index())),
        }
    }

    /// Whether the leaf makes sense in a column expression, which is evaluated once, before the loop.
    pub const fn in_column(self) -> bool {
        matches!(self, Leaf::Const(_) | Leaf::IConst(_) | Leaf::MConst(_) | Leaf::XObstacle | Leaf::Iter2(_))
    }

    /// What the leaf's value may change with.
    pub const fn depends(self) -> Depends {
        match self {
            Leaf::Const(_) | Leaf::IConst(_) | Leaf::MConst(_) => Depends::NOTHING,
            Leaf::XObstacle | Leaf::Iter2(_) | Leaf::X => Depends::LANE,
            Leaf::Y | Leaf::FirstWindow => Depends::ROW,
            Leaf::Read(_) | Leaf::Window(_) => Depends::LANE_AND_ROW,
        }
    }
}

/// What a value may change with: from lane to lane (fitness case to fitness case), from row to row, or both.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Depends(u8);

impl Depends {
    /// A constant.
    pub const NOTHING: Depends = Depends(0);
    /// The same at every row of a lane.
    pub const LANE: Depends = Depends(1);
    /// The same in every lane at a row.
    pub const ROW: Depends = Depends(2);
    /// Different everywhere.
    pub const LANE_AND_ROW: Depends = Depends(3);

    /// What a value computed from both may change with.
    #[must_use]
    pub const fn join(self, other: Depends) -> Depends {
        Depends(self.0 | other.0)
    }

    /// Whether every cause of change in `self` is in `other` too.
    pub const fn within(self, other: Depends) -> bool {
        self.0 & !other.0 == 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_unique() {
        for (i, op) in Op::ALL.iter().enumerate() {
            assert_eq!(Op::from_name(op.name()), Some(*op));
            assert_eq!(*op as usize, i);
        }
    }

    #[test]
    fn functions_are_of_binary32_values() {
        for op in Op::ALL.iter().filter(|op| op.function().is_some()) {
            assert!(op.result() == Ty::F32 && op.operands().iter().all(|ty| *ty == Ty::F32), "{}", op.name());
        }
    }

    #[test]
    fn leaves_round_trip() {
        for op in Op::ALL.iter().copied().filter(|op| op.is_leaf()) {
            let leaf = Leaf::decode(op, 0).expect("zero is every leaf's immediate");
            assert_eq!(leaf.encode(), (op, 0));
        }
        assert_eq!(Leaf::decode(Op::Read, 5), None);
        assert_eq!(Leaf::decode(Op::Window, 16), None);
        assert_eq!(Leaf::decode(Op::Add, 0), None);
    }
}
