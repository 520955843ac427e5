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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tournaments_win_as_often_as_they_should() {
        let seed = 11;
        let mut random = Random::stream(seed, 0, 0);
        let (n, size, rounds) = (10usize, 3u32, 200_000u32);
        // Scores in disorder: the rank of index i is 7 i mod 10.
        let scores: Vec<f64> = (0..n).map(|i| (7 * i % n) as f64).collect();
        let mut wins = vec![0u32; n];
        for _ in 0..rounds {
            wins[scores[tournament(&scores, size, &mut random)] as usize] += 1;
        }
        for (rank, &wins) in wins.iter().enumerate() {
            // All drawn are at most of this rank, less all drawn are below it.
            let below = |r: usize| (r as f64 / n as f64).powi(size as i32);
            let p = below(rank + 1) - below(rank);
            let (mean, deviation) = (p * f64::from(rounds), (p * (1.0 - p) * f64::from(rounds)).sqrt());
            assert!(
                (f64::from(wins) - mean).abs() < 5.0 * deviation,
                "seed {seed}: rank {rank} won {wins} times"
            );
        }
    }

    #[test]
    fn ties_go_to_the_first_drawn() {
        let scores = [0.5; 20];
        for seed in 0..100 {
            let first = Random::stream(seed, 0, 0).below(20) as usize;
            assert_eq!(tournament(&scores, 7, &mut Random::stream(seed, 0, 0)), first, "seed {seed}");
        }
    }

    #[test]
    fn a_tournament_of_one_is_a_draw() {
        let mut random = Random::stream(5, 0, 0);
        let mut wins = [0u32; 4];
        for _ in 0..40_000 {
            wins[tournament(&[0.0, 1.0, 2.0, 3.0], 1, &mut random)] += 1;
        }
        assert!(wins.iter().all(|&w| (9_500..10_500).contains(&w)), "{wins:?}");
    }
}
