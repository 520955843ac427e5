//! Values and conditions as a reader sees them.

use vsonar_ir::{Leaf, Op, Reg};

use super::listing::{Cond, Expr, Relation, Sign};
use super::order::{and, or, product, sum};
use super::structure::strip;
use super::view::View;
use super::writer::Writer;

impl Writer<'_> {
    /// A value, by its name where it has one by now.
    pub(super) fn expr(&mut self, reg: Reg) -> Expr {
        let i = reg.index();
        if self.named[i]
            && let Some(name) = self.name[i]
        {
            return Expr::Name(name);
        }
        match self.views[i] {
            View::Leaf(leaf) => self.leaf(leaf),
            View::Power(base, n) => Expr::Power(Box::new(self.expr(base)), n),
            View::Twice(a) => product(Expr::Const(2.0), self.expr(a)),
            View::Binary(Sign::Add, a, b) => sum(self.expr(a), self.expr(b)),
            View::Binary(Sign::Mul, a, b) => product(self.expr(a), self.expr(b)),
            View::Binary(sign, a, b) => Expr::Binary(sign, Box::new(self.expr(a)), Box::new(self.expr(b))),
            View::Call(function, args) => {
                Expr::Call(function, args[..function.arity()].iter().map(|&a| self.expr(a)).collect())
            }
            View::Select([mask, a, b]) => {
                let (mask, holds) = strip(self.block, mask, true);
                let first = matches!(self.cond(mask, true), Cond::First(false));
                let swap = first == holds;
                let (a, b) = if swap { (b, a) } else { (a, b) };
                let cond = self.cond(mask, holds != swap);
                Expr::If(0, Box::new(cond), Box::new(self.expr(a)), Box::new(self.expr(b)))
            }
            View::Compare(..) | View::Logic(..) | View::Not(_) => unreachable!("a mask is no value"),
        }
    }

    fn leaf(&self, leaf: Leaf) -> Expr {
        match leaf {
            Leaf::Const(value) => Expr::Const(value),
            Leaf::XObstacle => Expr::XObstacle,
            Leaf::Iter2(k) => Expr::Iter2(k),
            Leaf::X => Expr::X,
            Leaf::Y => Expr::Y,
            Leaf::FirstWindow => Expr::FirstWindow,
            Leaf::Read(k) => Expr::Register(self.registers[usize::from(k)]),
            Leaf::Window(operand) => Expr::Window(operand),
            Leaf::IConst(_) | Leaf::MConst(_) => unreachable!("operations on bit patterns were refused"),
        }
    }

    /// The condition that a mask holds, or that it does not.
    pub(super) fn cond(&mut self, mask: Reg, holds: bool) -> Cond {
        let (mask, holds) = strip(self.block, mask, holds);
        let i = mask.index();
        if self.named[i]
            && let Some(name) = self.name[i]
        {
            let name = Cond::Name(name);
            return if holds { name } else { Cond::Not(Box::new(name)) };
        }
        match self.views[i] {
            View::Compare(op, a, b) => self.compare(op, a, b, holds),
            View::Logic(op, p, q) => {
                let (p, q) = (self.cond(p, holds), self.cond(q, holds));
                if (op == Op::And) == holds { and(p, q) } else { or(p, q) }
            }
            _ => unreachable!("a value is no mask"),
        }
    }

    fn compare(&mut self, op: Op, a: Reg, b: Reg, holds: bool) -> Cond {
        let constant = |reg: Reg| match self.views[reg.index()] {
            View::Leaf(Leaf::Const(value)) => Some(value),
            _ => None,
        };
        let is_first = |reg: Reg| matches!(self.views[reg.index()], View::Leaf(Leaf::FirstWindow));
        // `first-window` is 1 or -1, and a constant between tells which.
        let between = |value: f32, strict_below: bool| match strict_below {
            true => (-1.0..1.0).contains(&value),
            false => value > -1.0 && value <= 1.0,
        };
        if is_first(a) && constant(b).is_some_and(|c| between(c, op == Op::Le)) && op != Op::Eq {
            return Cond::First(!holds);
        }
        if is_first(b) && constant(a).is_some_and(|c| between(c, op == Op::Lt)) && op != Op::Eq {
            return Cond::First(holds);
        }
        let nan = self.intervals[a.index()].nan || self.intervals[b.index()].nan;
        let mirror = constant(a).is_some() && constant(b).is_none();
        let relation = match (op, holds, nan) {
            (Op::Lt, true, _) => Relation::Lt,
            (Op::Le, true, _) => Relation::Le,
            (Op::Eq, true, _) => Relation::Eq,
            (Op::Lt, false, false) => Relation::Ge,
            (Op::Le, false, false) => Relation::Gt,
            (Op::Lt, false, true) => Relation::NotLt,
            (Op::Le, false, true) => Relation::NotLe,
            _ => Relation::Ne,
        };
        let mirrored = match relation {
            Relation::Lt => Some(Relation::Gt),
            Relation::Le => Some(Relation::Ge),
            Relation::Gt => Some(Relation::Lt),
            Relation::Ge => Some(Relation::Le),
            Relation::Eq | Relation::Ne => Some(relation),
            Relation::NotLt | Relation::NotLe => None,
        };
        match mirrored {
            Some(mirrored) if mirror => Cond::Compare(mirrored, self.expr(b), self.expr(a)),
            _ => Cond::Compare(relation, self.expr(a), self.expr(b)),
        }
    }
}
