//! Expressions put together so that they read well, where that leaves every bit as it is.

use super::listing::{Cond, Expr, Sign};

fn binary(sign: Sign, a: Expr, b: Expr) -> Expr {
    Expr::Binary(sign, Box::new(a), Box::new(b))
}

fn level(expr: &Expr) -> u8 {
    match expr {
        Expr::Binary(sign, ..) => sign.level(),
        Expr::If(..) => 0,
        _ => 3,
    }
}

/// How many conditions have to hold together.
pub(super) fn conjuncts(cond: &Cond) -> usize {
    match cond {
        Cond::And(p, q) => conjuncts(p) + conjuncts(q),
        _ => 1,
    }
}

/// Both, without parentheses on the right.
pub(super) fn and(p: Cond, q: Cond) -> Cond {
    match q {
        Cond::And(q1, q2) => Cond::And(Box::new(and(p, *q1)), q2),
        q => Cond::And(Box::new(p), Box::new(q)),
    }
}

/// One or the other, without parentheses on the right.
pub(super) fn or(p: Cond, q: Cond) -> Cond {
    match q {
        Cond::Or(q1, q2) => Cond::Or(Box::new(or(p, *q1)), q2),
        q => Cond::Or(Box::new(p), Box::new(q)),
    }
}

/// a + b or b + a, which are the same to the bit; a negative number is taken away.
pub(super) fn sum(a: Expr, b: Expr) -> Expr {
    let (a, b) = match (&a, &b) {
        (Expr::Const(_), Expr::Const(_)) => (a, b),
        (Expr::Const(_), _) => (b, a),
        (_, Expr::Const(_)) => (a, b),
        _ if level(&b) == 1 && level(&a) != 1 => (b, a),
        _ => (a, b),
    };
    match b {
        Expr::Const(value) if value < 0.0 => binary(Sign::Sub, a, Expr::Const(-value)),
        _ => binary(Sign::Add, a, b),
    }
}

/// a · b or b · a, which are the same to the bit; a number comes first, unless that needs parentheses.
pub(super) fn product(a: Expr, b: Expr) -> Expr {
    let number = |e: &Expr| matches!(e, Expr::Const(_));
    let swap = match (number(&a), number(&b)) {
        (true, false) => level(&b) == 2,
        (false, true) => level(&a) != 2,
        _ => level(&b) == 2 && level(&a) != 2,
    };
    if swap { binary(Sign::Mul, b, a) } else { binary(Sign::Mul, a, b) }
}
