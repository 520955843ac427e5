//! Selection: which individuals become parents.

use serde::{Deserialize, Serialize};

use super::fitness::shared_fitness;
use super::population::Member;
use crate::tree::Random;

/// What tournaments compare.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum SelectionKind {
    /// The share of the cases solved.
    Tournament,
    /// Case-wise shared fitness, see [`shared_fitness`]. It keeps different behaviours alive: to solve what
    /// few others solve is worth more.
    Sharing,
}

/// The score of each member that tournaments compare; higher is better.
pub(super) fn scores(kind: SelectionKind, population: &[Member]) -> Vec<f64> {
    match kind {
        SelectionKind::Tournament => population.iter().map(Member::fitness).collect(),
        SelectionKind::Sharing => shared_fitness(population.iter().map(|m| &m.outcome.solved)),
    }
}

/// The winner of a tournament: of `size` individuals, drawn with replacement, the one of highest score; of
/// equal ones the first drawn.
///
/// # Panics
/// If there are no scores.
pub fn tournament(scores: &[f64], size: u32, random: &mut Random) -> usize {
    let mut winner = random.below(scores.len() as u64) as usize;
    for _ in 1..size {
        let rival = random.below(scores.len() as u64) as usize;
        if scores[rival] > scores[winner] {
            winner = rival;
        }
    }
    winner
}
