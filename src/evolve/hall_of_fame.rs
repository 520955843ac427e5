//! The hall of fame: the best individuals found for their size.
//!
//! It is the front of fitness against size: an individual enters if none in it solves as many cases with as few
//! nodes, and those that it beats in both leave. The largest entry is the best individual in training: highest
//! fitness, ties broken by fewer nodes, then by which came first. It is the run's winner unless a validation part chooses.

use serde::{Deserialize, Serialize};

use super::fitness::{CaseBits, share};
use super::validation::Verdicts;
use crate::tree::Individual;

/// One of the hall of fame.
#[derive(Debug, Clone, PartialEq)]
pub struct Entry {
    /// The individual.
    pub individual: Individual,
    /// How many training cases it solves.
    pub correct: u32,
    /// The generation it came up in.
    pub generation: u32,
}

/// The front of fitness against size, over all generations so far.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct HallOfFame {
    /// Ascending both in nodes and in cases solved.
    entries: Vec<Entry>,
}

/// A line of `hall_of_fame.jsonl`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct EntryLine {
    /// Share of the training cases solved.
    pub fitness: f64,
    /// Training cases solved.
    pub correct: u32,
    /// Share of the validation cases solved; absent without a validation part.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub validation_fitness: Option<f64>,
    /// Validation cases solved; absent without a validation part.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub validation_correct: Option<u32>,
    /// Nodes of the individual.
    pub nodes: usize,
    /// The generation it came up in.
    pub generation: u32,
    /// The individual as program text.
    pub program: String,
}

impl HallOfFame {
    /// The most entries; beyond it the one of least fitness leaves.
    pub const CAPACITY: usize = 100;

    /// The entries, ascending both in nodes and in cases solved.
    pub fn entries(&self) -> &[Entry] {
        &self.entries
    }

    /// The hall of these entries; `None` if they do not ascend both in nodes and in cases solved.
    pub(super) fn from_entries(entries: Vec<Entry>) -> Option<HallOfFame> {
        let key = |e: &Entry| (e.individual.len(), e.correct);
        let ascend = |w: &[Entry]| key(&w[0]).0 < key(&w[1]).0 && key(&w[0]).1 < key(&w[1]).1;
        entries.windows(2).all(ascend).then_some(HallOfFame { entries })
    }

    /// The best individual so far.
    pub fn best(&self) -> Option<&Entry> {
        self.entries.last()
    }

    /// Whether an individual of so many nodes that solves so many cases would enter.
    pub(super) fn admits(&self, nodes: usize, correct: u32) -> bool {
        // The best of those that are not larger.
        let rival = self.entries.iter().rev().find(|e| e.individual.len() <= nodes);
        rival.is_none_or(|e| e.correct < correct)
    }

    /// Lets an individual enter, if it is better than all of its size or smaller.
    pub fn offer(&mut self, individual: &Individual, correct: u32, generation: u32) {
        let nodes = individual.len();
        if !self.admits(nodes, correct) {
            return;
        }
        self.entries.retain(|e| e.individual.len() < nodes || e.correct > correct);
        let at = self.entries.partition_point(|e| e.individual.len() < nodes);
        self.entries.insert(at, Entry { individual: individual.clone(), correct, generation });
        if self.entries.len() > HallOfFame::CAPACITY {
            self.entries.remove(0);
        }
    }

    /// The lines of `hall_of_fame.jsonl`, the fittest in training first, for a set of so many cases.
    pub(super) fn lines(&self, cases: u32, verdicts: Verdicts<'_>) -> Vec<EntryLine> {
        let line = |(i, e): (usize, &Entry)| EntryLine {
            fitness: share(e.correct, cases),
            correct: e.correct,
            validation_fitness: verdicts.of(i).map(CaseBits::fitness),
            validation_correct: verdicts.of(i).map(CaseBits::count),
            nodes: e.individual.len(),
            generation: e.generation,
            program: e.individual.to_string(),
        };
        self.entries.iter().enumerate().rev().map(line).collect()
    }
}
