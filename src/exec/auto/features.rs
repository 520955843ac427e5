//! What the cost of running a program is made of.

use std::sync::LazyLock;

use vsonar_ir::opt::expand;
use vsonar_ir::program::Region;
use vsonar_ir::{Leaf, Loop, Op, Program, Span};

/// How many numbers describe a program.
pub(super) const COUNT: usize = 9;

/// Numbers that the time of a program is a sum over, each with a weight of the executor.
///
/// Those that count work in loops come twice: for loops that visit all their positions, and for loops that may break,
/// whose weights thereby hold the share of positions that is visited on average.
pub(super) type Features = [f64; COUNT];

/// The features of a program that is run on `cases` cases. They are scaled so that each weight is microseconds for a
/// common amount.
pub(super) fn features(program: &Program, cases: usize) -> Features {
    let thousand_lanes = cases as f64 / 1e3;
    let mut out = [0.0; COUNT];
    out[0] = 1.0;
    // Code generation goes by instructions; trigonometry is called, so it counts as any other.
    out[1] = program.len() as f64 / 10.0;
    for l in program.loops() {
        // Strips of other columns are found or gathered.
        if l.column().as_leaf() != Some(Leaf::XObstacle) {
            out[2] += l.operands().len() as f64 * thousand_lanes;
        }
        let rows = match l.span() {
            Span::All => l.rect().positions(program.height()),
            Span::Last => 1,
        };
        let lane_rows = f64::from(rows) / 100.0 * thousand_lanes;
        let (cheap, dear) = operations(l);
        let first = if l.break_if().is_some() { 6 } else { 3 };
        out[first] += lane_rows;
        out[first + 1] += lane_rows * cheap;
        out[first + 2] += lane_rows * dear;
    }
    out
}

/// Operations of more steps than this count as dear.
const FEW: usize = 8;

/// Whether each operation, by its number, is made of many steps, as trigonometry is.
static DEAR: LazyLock<Vec<bool>> =
    LazyLock::new(|| Op::ALL.iter().map(|op| expand::steps(*op) > FEW).collect());

/// Operations at each row, those of one instruction or few and those of many.
fn operations(l: &Loop) -> (f64, f64) {
    let varying = &l.body().insts()[l.region(Region::Varying)];
    let mut counts = (0.0, 0.0);
    for inst in varying.iter().filter(|inst| !inst.op().is_leaf()) {
        match DEAR[inst.op() as usize] {
            true => counts.1 += 1.0,
            false => counts.0 += 1.0,
        }
    }
    counts
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn trigonometry_is_dear() {
        let dear: Vec<&str> = Op::ALL.iter().filter(|op| DEAR[**op as usize]).map(|op| op.name()).collect();
        assert_eq!(dear, ["sin", "cos", "tan", "atan", "atan2"]);
    }
}
