//! Algebraic rewrites, one row of a table each, exact to the bit.
//!
//! A row says what to look for, under which side conditions, and what stands for it. Binary32 is not the reals:
//! `x + 0` is not `x` (for -0 it is +0), `x - x` is not 0 (infinities), `x * 0` is not 0; each row holds only
//! what its conditions make true, and a test tries every row on the cross product of both zeros, subnormals,
//! infinities, NaN and ordinary values.
//!
//! Rows of one operation are tried in order, after constants have been folded and commutative operands put in
//! order (constants last). A row's result is simplified again.

use crate::op::{Leaf, Op};
use crate::opt::interval::Interval;
use crate::opt::simplify::Writer;
use crate::program::{Inst, Reg};

/// What a row looks for, or what it puts there.
#[derive(Debug, Clone, Copy)]
pub enum Pattern {
    /// Any register; the same variable stands for the same register throughout the row.
    Var(u8),
    /// Any binary32 constant.
    Const(u8),
    /// This binary32 constant, to the bit (any NaN for a NaN).
    Is(f32),
    /// This constant mask.
    Truth(bool),
    /// An operation.
    Op(Op, &'static [Pattern]),
    /// On the right side: the constant's negation.
    Negated(u8),
    /// On the right side: 1 divided by the constant.
    Reciprocal(u8),
}

/// A side condition on a variable.
#[derive(Debug, Clone, Copy)]
pub enum Condition {
    /// Never the zero with a minus sign.
    NotNegativeZero(u8),
    /// Of both: never a NaN, nor zeros of different signs.
    EqualIsSame(u8, u8),
    /// A constant whose reciprocal is exact and normal: a power of two of either sign.
    PowerOfTwo(u8),
}

/// A row of the table.
#[derive(Debug, Clone, Copy)]
pub struct Rule {
    /// A name for people.
    pub name: &'static str,
    /// What to look for; always an operation.
    pub from: Pattern,
    /// What must hold besides.
    pub when: &'static [Condition],
    /// What stands for it.
    pub to: Pattern,
}

use Condition::{EqualIsSame, NotNegativeZero, PowerOfTwo};
use Pattern::{Const, Is, Negated, Reciprocal, Truth, Var};

const X: Pattern = Var(0);
const Y: Pattern = Var(1);
const Z: Pattern = Var(2);
const P: Pattern = Var(3);
const Q: Pattern = Var(4);
const C: Pattern = Const(0);

macro_rules! rules {
    ($( $name:literal: $op:ident($($arg:expr),*) $(when $($cond:expr),+)? => $to:expr; )*) => {
        /// The table.
        pub const RULES: &[Rule] = &[ $( Rule {
            name: $name,
            from: Pattern::Op(Op::$op, &[$($arg),*]),
            when: &[$($($cond),+)?],
            to: $to,
        }, )* ];
    };
}

const fn not(p: &'static [Pattern; 1]) -> Pattern {
    Pattern::Op(Op::Not, p)
}

rules! {
    "add -0": Add(X, Is(-0.0)) => X;
    "add +0": Add(X, Is(0.0)) when NotNegativeZero(0) => X;
    "sub constant": Sub(X, C) => Pattern::Op(Op::Add, &[X, Negated(0)]);
    "mul 1": Mul(X, Is(1.0)) => X;
    "mul 2": Mul(X, Is(2.0)) => Pattern::Op(Op::Add, &[X, X]);
    "div 1": Div(X, Is(1.0)) => X;
    "div power of two": Div(X, C) when PowerOfTwo(0) => Pattern::Op(Op::Mul, &[X, Reciprocal(0)]);
    "min itself": Min(X, X) => X;
    "min before, left": Min(X, Pattern::Op(Op::Min, &[X, Y])) => Pattern::Op(Op::Min, &[X, Y]);
    "min before, right": Min(X, Pattern::Op(Op::Min, &[Y, X])) => Pattern::Op(Op::Min, &[Y, X]);
    "min again, left": Min(Pattern::Op(Op::Min, &[X, Y]), X) when EqualIsSame(0, 1) => Pattern::Op(Op::Min, &[X, Y]);
    "min again": Min(Pattern::Op(Op::Min, &[X, Y]), Y) => Pattern::Op(Op::Min, &[X, Y]);
    "max itself": Max(X, X) => X;
    "max before, left": Max(X, Pattern::Op(Op::Max, &[X, Y])) => Pattern::Op(Op::Max, &[X, Y]);
    "max before, right": Max(X, Pattern::Op(Op::Max, &[Y, X])) => Pattern::Op(Op::Max, &[Y, X]);
    "max again, left": Max(Pattern::Op(Op::Max, &[X, Y]), X) when EqualIsSame(0, 1) => Pattern::Op(Op::Max, &[X, Y]);
    "max again": Max(Pattern::Op(Op::Max, &[X, Y]), Y) => Pattern::Op(Op::Max, &[X, Y]);
    "select the same": Select(P, X, X) => X;
    "select not": Select(not(&[P]), X, Y) => Pattern::Op(Op::Select, &[P, Y, X]);
    "select again, then": Select(P, Pattern::Op(Op::Select, &[P, X, Y]), Z) => Pattern::Op(Op::Select, &[P, X, Z]);
    "select again, else": Select(P, X, Pattern::Op(Op::Select, &[P, Y, Z])) => Pattern::Op(Op::Select, &[P, X, Z]);
    "select lesser": Select(Pattern::Op(Op::Lt, &[X, Y]), X, Y) => Pattern::Op(Op::Min, &[X, Y]);
    "select greater": Select(Pattern::Op(Op::Lt, &[X, Y]), Y, X) => Pattern::Op(Op::Max, &[Y, X]);
    "select least": Select(Pattern::Op(Op::Le, &[X, Y]), X, Y) when EqualIsSame(0, 1) => Pattern::Op(Op::Min, &[X, Y]);
    "select greatest": Select(Pattern::Op(Op::Le, &[X, Y]), Y, X) when EqualIsSame(0, 1) => Pattern::Op(Op::Max, &[Y, X]);
    "and itself": And(P, P) => P;
    "and true": And(P, Truth(true)) => P;
    "and not": And(P, not(&[P])) => Truth(false);
    "not and": And(not(&[P]), P) => Truth(false);
    "and again, left": And(Pattern::Op(Op::And, &[P, Q]), P) => Pattern::Op(Op::And, &[P, Q]);
    "and again, right": And(Pattern::Op(Op::And, &[P, Q]), Q) => Pattern::Op(Op::And, &[P, Q]);
    "and before, left": And(P, Pattern::Op(Op::And, &[P, Q])) => Pattern::Op(Op::And, &[P, Q]);
    "and before, right": And(P, Pattern::Op(Op::And, &[Q, P])) => Pattern::Op(Op::And, &[Q, P]);
    "and or, left": And(P, Pattern::Op(Op::Or, &[P, Q])) => P;
    "and or, right": And(P, Pattern::Op(Op::Or, &[Q, P])) => P;
    "and nots": And(not(&[P]), not(&[Q])) => not(&[Pattern::Op(Op::Or, &[P, Q])]);
    "and or not, left": And(P, Pattern::Op(Op::Or, &[not(&[P]), Q])) => Pattern::Op(Op::And, &[P, Q]);
    "and or not, right": And(P, Pattern::Op(Op::Or, &[Q, not(&[P])])) => Pattern::Op(Op::And, &[P, Q]);
    "and not or, left": And(not(&[P]), Pattern::Op(Op::Or, &[P, Q])) => Pattern::Op(Op::And, &[not(&[P]), Q]);
    "and not or, right": And(not(&[P]), Pattern::Op(Op::Or, &[Q, P])) => Pattern::Op(Op::And, &[not(&[P]), Q]);
    "and or before not, left": And(Pattern::Op(Op::Or, &[P, Q]), not(&[P])) => Pattern::Op(Op::And, &[not(&[P]), Q]);
    "and or before not, right": And(Pattern::Op(Op::Or, &[Q, P]), not(&[P])) => Pattern::Op(Op::And, &[not(&[P]), Q]);
    "and not and, left": And(P, not(&[Pattern::Op(Op::And, &[P, Q])])) => Pattern::Op(Op::And, &[P, not(&[Q])]);
    "and not and, right": And(P, not(&[Pattern::Op(Op::And, &[Q, P])])) => Pattern::Op(Op::And, &[P, not(&[Q])]);
    "and neither, left": And(P, not(&[Pattern::Op(Op::Or, &[P, Q])])) => Truth(false);
    "and neither, right": And(P, not(&[Pattern::Op(Op::Or, &[Q, P])])) => Truth(false);
    "or itself": Or(P, P) => P;
    "or false": Or(P, Truth(false)) => P;
    "or not": Or(P, not(&[P])) => Truth(true);
    "not or": Or(not(&[P]), P) => Truth(true);
    "or again, left": Or(Pattern::Op(Op::Or, &[P, Q]), P) => Pattern::Op(Op::Or, &[P, Q]);
    "or again, right": Or(Pattern::Op(Op::Or, &[P, Q]), Q) => Pattern::Op(Op::Or, &[P, Q]);
    "or before, left": Or(P, Pattern::Op(Op::Or, &[P, Q])) => Pattern::Op(Op::Or, &[P, Q]);
    "or before, right": Or(P, Pattern::Op(Op::Or, &[Q, P])) => Pattern::Op(Op::Or, &[Q, P]);
    "or and, left": Or(P, Pattern::Op(Op::And, &[P, Q])) => P;
    "or and, right": Or(P, Pattern::Op(Op::And, &[Q, P])) => P;
    "or nots": Or(not(&[P]), not(&[Q])) => not(&[Pattern::Op(Op::And, &[P, Q])]);
    "or and not, left": Or(P, Pattern::Op(Op::And, &[not(&[P]), Q])) => Pattern::Op(Op::Or, &[P, Q]);
    "or and not, right": Or(P, Pattern::Op(Op::And, &[Q, not(&[P])])) => Pattern::Op(Op::Or, &[P, Q]);
    "or not and, left": Or(not(&[P]), Pattern::Op(Op::And, &[P, Q])) => Pattern::Op(Op::Or, &[not(&[P]), Q]);
    "or not and, right": Or(not(&[P]), Pattern::Op(Op::And, &[Q, P])) => Pattern::Op(Op::Or, &[not(&[P]), Q]);
    "or and before not, left": Or(Pattern::Op(Op::And, &[P, Q]), not(&[P])) => Pattern::Op(Op::Or, &[not(&[P]), Q]);
    "or and before not, right": Or(Pattern::Op(Op::And, &[Q, P]), not(&[P])) => Pattern::Op(Op::Or, &[not(&[P]), Q]);
    "or not or, left": Or(P, not(&[Pattern::Op(Op::Or, &[P, Q])])) => Pattern::Op(Op::Or, &[P, not(&[Q])]);
    "or not or, right": Or(P, not(&[Pattern::Op(Op::Or, &[Q, P])])) => Pattern::Op(Op::Or, &[P, not(&[Q])]);
    "or not both, left": Or(P, not(&[Pattern::Op(Op::And, &[P, Q])])) => Truth(true);
    "or not both, right": Or(P, not(&[Pattern::Op(Op::And, &[Q, P])])) => Truth(true);
    "not not": Not(not(&[P])) => P;
}

/// The rows of each operation: `RULES[START[op]..]` while the operation is the same.
const START: [u16; Op::ALL.len()] = {
    let mut start = [u16::MAX; Op::ALL.len()];
    let mut i = RULES.len();
    while i > 0 {
        i -= 1;
        if let Pattern::Op(op, _) = RULES[i].from {
            start[op as usize] = i as u16;
        }
    }
    start
};

/// Rewrites an instruction by the first row that applies; the register that stands for it.
pub fn apply(writer: &mut Writer, inst: &Inst) -> Option<Reg> {
    let start = START[inst.op() as usize] as usize;
    let rules = RULES.get(start..)?.iter();
    let of_op = |rule: &&Rule| matches!(rule.from, Pattern::Op(op, _) if op == inst.op());
    for rule in rules.take_while(of_op) {
        let mut bindings = Bindings::default();
        let Pattern::Op(_, args) = rule.from else { continue };
        let found = args.iter().zip(inst.args()).all(|(p, reg)| bindings.matches(writer, p, *reg));
        if found && rule.when.iter().all(|c| bindings.holds(writer, c)) {
            return Some(bindings.build(writer, &rule.to));
        }
    }
    None
}

#[derive(Default)]
struct Bindings {
    vars: [Option<Reg>; 5],
    constants: [f32; 1],
}

impl Bindings {
    fn matches(&mut self, writer: &Writer, pattern: &Pattern, reg: Reg) -> bool {
        match *pattern {
            Var(v) => *self.vars[v as usize].get_or_insert(reg) == reg,
            Const(c) => match writer.constant(reg) {
                Some(Leaf::Const(value)) => {
                    self.constants[c as usize] = value;
                    true
                }
                _ => false,
            },
            Is(wanted) => {
                writer.constant(reg).is_some_and(|leaf| leaf.encode() == Leaf::Const(wanted).encode())
            }
            Truth(wanted) => writer.constant(reg) == Some(Leaf::MConst(wanted)),
            Pattern::Op(op, args) => {
                let inst = *writer.inst(reg);
                inst.op() == op && args.iter().zip(inst.args()).all(|(p, arg)| self.matches(writer, p, *arg))
            }
            Negated(_) | Reciprocal(_) => false,
        }
    }

    fn holds(&self, writer: &Writer, condition: &Condition) -> bool {
        let value = |v: u8| self.vars[v as usize].map_or(Interval::ANY, |reg| writer.value(reg));
        match *condition {
            NotNegativeZero(v) => !value(v).negative_zero,
            EqualIsSame(v, w) => value(v).equal_is_same(value(w)),
            PowerOfTwo(c) => is_exactly_invertible(self.constants[c as usize]),
        }
    }

    fn build(&self, writer: &mut Writer, pattern: &Pattern) -> Reg {
        match *pattern {
            Var(v) => self.vars[v as usize].expect("a row's right side uses its left side's variables"),
            Const(c) => writer.leaf(Leaf::Const(self.constants[c as usize])),
            Is(value) => writer.leaf(Leaf::Const(value)),
            Truth(value) => writer.leaf(Leaf::MConst(value)),
            Negated(c) => writer.leaf(Leaf::Const(-self.constants[c as usize])),
            Reciprocal(c) => writer.leaf(Leaf::Const(1.0 / self.constants[c as usize])),
            Pattern::Op(op, args) => {
                let mut regs = [Reg(0); 3];
                for (reg, arg) in regs.iter_mut().zip(args) {
                    *reg = self.build(writer, arg);
                }
                writer.push(Inst::new(op, regs, 0))
            }
        }
    }
}

/// Whether 1 / c is exact and both are normal: dividing by c is then multiplying by its reciprocal.
pub fn is_exactly_invertible(c: f32) -> bool {
    c.is_normal() && c.to_bits() & 0x007f_ffff == 0 && (1.0 / c).is_normal()
}
