//! Instructions as a reader sees them.

use vsonar_ir::{Block, Leaf, Op, Reg};

use super::listing::{Function, Sign};
use crate::tree::Shortest;

/// What an instruction is, as a reader sees it.
#[derive(Debug, Clone, Copy)]
pub(super) enum View {
    Leaf(Leaf),
    Power(Reg, u8),
    Twice(Reg),
    Binary(Sign, Reg, Reg),
    Call(Function, [Reg; 3]),
    Select([Reg; 3]),
    Compare(Op, Reg, Reg),
    Logic(Op, Reg, Reg),
    Not(Reg),
}

impl View {
    pub(super) fn operands(&self) -> Vec<Reg> {
        match *self {
            View::Leaf(_) => Vec::new(),
            View::Power(a, _) | View::Twice(a) | View::Not(a) => vec![a],
            View::Binary(_, a, b) | View::Compare(_, a, b) | View::Logic(_, a, b) => vec![a, b],
            View::Call(function, args) => args[..function.arity()].to_vec(),
            View::Select(args) => args.to_vec(),
        }
    }
}

impl View {
    /// About how many characters it takes, without its operands.
    pub(super) fn length(&self) -> usize {
        match *self {
            View::Leaf(Leaf::Const(value)) => Shortest(value).to_string().len(),
            View::Leaf(Leaf::Window(operand)) => operand.name().len(),
            View::Leaf(Leaf::XObstacle | Leaf::FirstWindow) => 11,
            View::Leaf(Leaf::Iter2(_)) => 7,
            View::Leaf(_) | View::Power(..) => 1,
            View::Twice(_) | View::Not(_) => 4,
            View::Binary(..) | View::Compare(..) => 3,
            View::Logic(..) => 5,
            View::Call(function, _) => function.name().len() + 2 * function.arity(),
            View::Select(_) => 16,
        }
    }
}

/// The product as a power, if it is one of those that are written so.
fn power(views: &[View], a: Reg, b: Reg) -> Option<View> {
    let of = |reg: Reg| match views[reg.index()] {
        View::Power(base, n) => (base, n),
        _ => (reg, 1),
    };
    let ((base_a, n_a), (base_b, n_b)) = (of(a), of(b));
    if a == b {
        return Some(if n_a == 2 { View::Power(base_a, 4) } else { View::Power(a, 2) });
    }
    match (base_a == base_b, n_a.min(n_b), n_a.max(n_b)) {
        (true, 1, 2) => Some(View::Power(base_a, 3)),
        (true, 1, 4) => Some(View::Power(base_a, 5)),
        _ => None,
    }
}

/// The views of a block's instructions.
///
/// # Panics
/// On an operation on bit patterns; such programs have no listing.
pub(super) fn views(block: &Block) -> Vec<View> {
    let mut views: Vec<View> = Vec::with_capacity(block.len());
    for (_, inst) in block.iter() {
        let arg = |i: usize| inst.args()[i];
        let view = match inst.op() {
            Op::Add if arg(0) == arg(1) => View::Twice(arg(0)),
            Op::Add => View::Binary(Sign::Add, arg(0), arg(1)),
            Op::Sub => View::Binary(Sign::Sub, arg(0), arg(1)),
            Op::Mul => power(&views, arg(0), arg(1)).unwrap_or(View::Binary(Sign::Mul, arg(0), arg(1))),
            Op::Div => View::Binary(Sign::Div, arg(0), arg(1)),
            Op::PDiv => View::Binary(Sign::Protected, arg(0), arg(1)),
            Op::Lt | Op::Le | Op::Eq => View::Compare(inst.op(), arg(0), arg(1)),
            Op::And | Op::Or => View::Logic(inst.op(), arg(0), arg(1)),
            Op::Not => View::Not(arg(0)),
            Op::Select => View::Select([arg(0), arg(1), arg(2)]),
            op => match (inst.leaf(), Function::of(op)) {
                (Some(leaf), _) => View::Leaf(leaf),
                (None, Some(function)) => {
                    let mut args = [arg(0); 3];
                    args[..function.arity()].copy_from_slice(inst.args());
                    View::Call(function, args)
                }
                (None, None) => unreachable!("operations on bit patterns were refused"),
            },
        };
        views.push(view);
    }
    views
}
