//! Selection: which individuals become parents.
//!
//! A parent is the winner of a tournament, on the share of cases solved or on shared fitness, or is chosen by
//! single cases ([`Lexicase`]). Against bloat, size decides between equals, or in a tournament of its own.

use std::cmp::Ordering;

use serde::{Deserialize, Serialize};

pub use super::lexicase::Lexicase;

use super::fitness::{CaseBits, shared_fitness};
use super::lexicase::draw_sample;
use super::population::Member;
use super::settings::Settings;
use crate::tree::Random;

/// How a parent is selected.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum SelectionKind {
    /// A tournament on the share of the cases solved.
    Tournament,
    /// A tournament on case-wise shared fitness, see [`shared_fitness`]. It keeps different behaviours alive: to
    /// solve what few others solve is worth more.
    Sharing,
    /// By single cases in random order, see [`Lexicase`].
    Lexicase,
}

/// What is done against bloat when parents are selected.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Parsimony {
    /// Nothing.
    None,
    /// Of individuals of equal score, or that solve the same cases in lexicase selection, the smallest is selected.
    /// S. Luke, L. Panait, *Lexicographic parsimony pressure*, 2002.
    Lexicographic,
    /// Two individuals are selected, and the smaller of them is taken with a certain probability: the tournament on
    /// fitness first, that on size after it. S. Luke, L. Panait, *A comparison of bloat control methods for genetic
    /// programming*, 2006.
    Double,
}

/// The part of the cases that lexicase selection looks at for a generation; `None` if it looks at all.
pub(super) fn sample(settings: &Settings, cases: usize, generation: u32) -> Option<CaseBits> {
    let selection = &settings.selection;
    // No pair of slots has the last of all numbers.
    let mut random = Random::stream(settings.seed, generation, u32::MAX);
    (selection.kind == SelectionKind::Lexicase && selection.case_share < 1.0)
        .then(|| draw_sample(cases, selection.case_share, &mut random))
}

/// Selects parents from a pool of members.
pub(super) struct Selector<'a> {
    pool: &'a [usize],
    /// Nodes of each of the pool.
    sizes: Vec<usize>,
    scheme: Scheme,
    parsimony: Parsimony,
    /// Probability that the smaller of two wins a tournament on size.
    smaller: f64,
}

enum Scheme {
    Tournament { scores: Vec<f64>, size: u32 },
    Lexicase(Lexicase),
}

impl<'a> Selector<'a> {
    /// A selector from the members of these numbers; `sample` are the cases that lexicase selection looks at.
    pub(super) fn new(
        members: &[Member],
        pool: &'a [usize],
        settings: &Settings,
        sample: Option<&CaseBits>,
    ) -> Selector<'a> {
        let selection = &settings.selection;
        let solved = pool.iter().map(|&i| &members[i].outcome.solved);
        let sizes: Vec<usize> = pool.iter().map(|&i| members[i].individual().len()).collect();
        let size = selection.tournament;
        let scheme = match selection.kind {
            SelectionKind::Tournament => {
                Scheme::Tournament { scores: solved.map(CaseBits::fitness).collect(), size }
            }
            SelectionKind::Sharing => Scheme::Tournament { scores: shared_fitness(solved), size },
            SelectionKind::Lexicase => {
                let mut lexicase = Lexicase::new(solved, sample);
                if selection.parsimony == Parsimony::Lexicographic {
                    lexicase.keep_smallest(|i| sizes[i]);
                }
                Scheme::Lexicase(lexicase)
            }
        };
        let smaller = selection.size_tournament / 2.0;
        Selector { pool, sizes, scheme, parsimony: selection.parsimony, smaller }
    }

    /// The number of the member that is selected.
    pub(super) fn select(&self, random: &mut Random) -> usize {
        let first = self.by_fitness(random);
        if self.parsimony != Parsimony::Double {
            return self.pool[first];
        }
        let second = self.by_fitness(random);
        let smaller_wins = random.chance(self.smaller);
        let second_wins = match self.sizes[second].cmp(&self.sizes[first]) {
            Ordering::Less => smaller_wins,
            Ordering::Equal => false,
            Ordering::Greater => !smaller_wins,
        };
        self.pool[if second_wins { second } else { first }]
    }

    /// Selects by fitness; gives the place in the pool.
    fn by_fitness(&self, random: &mut Random) -> usize {
        match &self.scheme {
            Scheme::Tournament { scores, size } if self.parsimony == Parsimony::Lexicographic => {
                let better = |a: usize, b: usize| {
                    scores[a] > scores[b] || (scores[a] == scores[b] && self.sizes[a] < self.sizes[b])
                };
                contest(scores.len(), *size, better, random)
            }
            Scheme::Tournament { scores, size } => tournament(scores, *size, random),
            Scheme::Lexicase(lexicase) => lexicase.select(random),
        }
    }
}

/// The winner of a tournament: of `size` individuals, drawn with replacement, the one of highest score; of
/// equal ones the first drawn.
///
/// # Panics
/// If there are no scores.
pub fn tournament(scores: &[f64], size: u32, random: &mut Random) -> usize {
    contest(scores.len(), size, |rival, winner| scores[rival] > scores[winner], random)
}

/// Of `size` numbers below `count`, drawn with replacement, the one that no other is better than; of several the first
/// drawn.
fn contest(count: usize, size: u32, better: impl Fn(usize, usize) -> bool, random: &mut Random) -> usize {
    let mut winner = random.below(count as u64) as usize;
    for _ in 1..size {
        let rival = random.below(count as u64) as usize;
        if better(rival, winner) {
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
