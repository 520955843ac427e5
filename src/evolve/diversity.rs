//! How alive a generation is: how its members are spread over behaviours and over the cases they solve.
//!
//! Logarithms are those of the pure Rust `libm` and sums run in index order, so that the numbers are the same on every
//! machine.

use serde::{Deserialize, Serialize};

use super::fitness::{share, solvers};
use super::population::Member;

/// The training case that the fewest members of a generation solve; of equal ones the first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct HardestCase {
    /// Its index in the training set's [`cases`](crate::dataset::Dataset::cases).
    pub case: u32,
    /// How many members solve it.
    pub solvers: u32,
}

/// The spread of a generation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Diversity {
    /// Members that differ in some answer.
    pub(super) behaviours: u32,
    /// Share of the members that show the most common behaviour.
    pub(super) largest: f64,
    /// See [`case_entropy`]; of all cases.
    pub(super) case_entropy: f64,
    /// Unaltered cases that no member solves.
    pub(super) solved_by_nobody: u32,
    /// Among the unaltered cases; `None` if there is none.
    pub(super) hardest: Option<HardestCase>,
}

impl Diversity {
    /// That of these members. The first `unaltered` cases are no altered copies: only they can be found in the data
    /// set, so only they are counted and named one by one.
    pub(super) fn of(population: &[Member], unaltered: usize) -> Diversity {
        let mut behaviours: Vec<u64> = population.iter().map(|m| m.outcome.behaviour).collect();
        behaviours.sort_unstable();
        let sizes = || behaviours.chunk_by(|a, b| a == b).map(<[u64]>::len);
        let counts = solvers(population.iter().map(|m| &m.outcome.solved));
        let named = &counts[..unaltered.min(counts.len())];
        let hardest = named.iter().zip(0..).min().map(|(&solvers, case)| HardestCase { case, solvers });
        Diversity {
            behaviours: sizes().count() as u32,
            largest: share(sizes().max().unwrap_or(0) as u32, population.len() as u32),
            case_entropy: case_entropy(&counts),
            solved_by_nobody: named.iter().filter(|&&n| n == 0).count() as u32,
            hardest,
        }
    }
}

/// Entropy of the cases solved, as a share of the largest possible: with `n[i]` members that solve case i and
/// p = n\[i\] / sum of n, the sum of -p log2 p over the cases, divided by log2 of their number. 0 for a single case, and
/// if none is solved.
fn case_entropy(n: &[u32]) -> f64 {
    let total = n.iter().copied().map(u64::from).sum::<u64>() as f64;
    let shares = n.iter().filter(|&&n| n > 0).map(|&n| f64::from(n) / total);
    let entropy = shares.fold(0.0, |sum, p| sum - p * libm::log2(p));
    // Rounding may carry the quotient beyond 1 by a hair.
    if n.len() > 1 { (entropy / libm::log2(n.len() as f64)).min(1.0) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evolve::fitness::CaseBits;
    use crate::evolve::population::{Genotype, Outcome};

    fn near(found: f64, expected: f64) {
        assert!((found - expected).abs() < 1e-12, "{found} is not {expected}");
    }

    #[test]
    fn entropy_by_hand() {
        // Equal counts: as much as there can be, whatever they are.
        for n in [1, 7, 4000] {
            for cases in [2, 3, 504, 600] {
                near(case_entropy(&vec![n; cases]), 1.0);
                assert!(case_entropy(&vec![n; cases]) <= 1.0);
            }
        }
        // Half of eight cases: two bits of three.
        near(case_entropy(&[5, 0, 5, 0, 0, 5, 5, 0]), 2.0 / 3.0);
        // p = 1/2, 1/4, 1/4, 0: one and a half bits of two.
        near(case_entropy(&[4, 2, 2, 0]), 0.75);
        // One case alone, none at all, and no choice.
        assert_eq!([&[0, 9, 0][..], &[0, 0, 0], &[3], &[]].map(case_entropy), [0.0; 4]);
    }

    #[test]
    fn the_spread_by_hand() {
        let member = |behaviour: u64, solved: &[usize]| Member {
            genotype: Genotype::new("(individual (iterate-up 2x2 1 y))".parse().expect("an individual")),
            outcome: Outcome {
                solved: CaseBits::from_fn(6, |case| solved.contains(&case)),
                behaviour,
                constant: false,
            },
        };
        // Solvers: 3 2 1 1 0 0.
        let members = [member(9, &[0, 1]), member(4, &[0, 2]), member(9, &[0, 1]), member(7, &[3])];
        let whole = Diversity::of(&members, 6);
        let entropy = case_entropy(&[3, 2, 1, 1, 0, 0]);
        assert_eq!((whole.behaviours, whole.largest, whole.case_entropy), (3, 0.5, entropy));
        let hardest = |case, solvers| Some(HardestCase { case, solvers });
        assert_eq!((whole.solved_by_nobody, whole.hardest), (2, hardest(4, 0)));
        // Altered copies count for the entropy, but are not named.
        let altered = Diversity::of(&members, 4);
        assert_eq!((altered.solved_by_nobody, altered.hardest), (0, hardest(2, 1)));
        assert_eq!(altered.case_entropy, entropy);
        let nobody = Diversity::of(&[], 0);
        assert_eq!((nobody.behaviours, nobody.largest, nobody.hardest), (0, 0.0, None));
    }
}
