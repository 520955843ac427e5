//! The end of a run in numbers.

use super::fitness::CaseBits;
use crate::tree::Individual;

/// The end of a run in numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct Summary {
    /// The winner: highest fitness in training, ties broken by fewer nodes, then by which came first; with a
    /// validation part that of the hall of fame which does best there, ties broken by training, then by fewer nodes.
    pub best: Individual,
    /// The generation it came up in.
    pub generation: u32,
    /// How it does on the training cases as they were given.
    pub train: Score,
    /// How it does on all that selection saw, altered copies included; none without augmentation, where it is the same.
    pub augmented: Option<Score>,
    /// How it does on the validation cases, if there are any. It was chosen by them.
    pub validation: Option<Score>,
    /// How it does on the held-out cases, if there are any.
    pub holdout: Option<Score>,
    /// Which cases it solves.
    pub solved: Solved,
    /// Complete generations.
    pub generations: u32,
    /// Individuals evaluated.
    pub evaluations: u64,
}

/// The cases that the winner solves, in the order of the data sets.
#[derive(Debug, Clone, PartialEq)]
pub struct Solved {
    /// Of the training cases as they were given.
    pub train: CaseBits,
    /// Of the validation cases.
    pub validation: Option<CaseBits>,
    /// Of the held-out cases.
    pub holdout: Option<CaseBits>,
}

/// How an individual does on a set of cases.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Score {
    /// Cases it solves.
    pub correct: u32,
    /// Cases there are.
    pub cases: u32,
    /// The share of them it solves.
    pub fitness: f64,
}

impl Score {
    pub(super) fn of(solved: &CaseBits) -> Score {
        Score { correct: solved.count(), cases: solved.len() as u32, fitness: solved.fitness() }
    }
}
