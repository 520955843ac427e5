//! Populations: individuals with what is known of them.

use std::hash::BuildHasher;
use std::sync::Arc;

use rustc_hash::FxBuildHasher;

use super::fitness::CaseBits;
use crate::tree::Individual;

/// What an individual does on the training cases.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Outcome {
    /// The cases it solves.
    pub solved: CaseBits,
    /// A hash of its answers: equal answers have equal hashes.
    pub behaviour: u64,
    /// Whether it answers the same to every case.
    pub constant: bool,
}

/// An individual of a population and what it does.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Member {
    /// The genotype and its hash.
    pub genotype: Genotype,
    /// What it does on the training cases.
    pub outcome: Outcome,
}

impl Member {
    /// The individual.
    pub fn individual(&self) -> &Individual {
        &self.genotype.individual
    }

    /// How many training cases it solves.
    pub fn correct(&self) -> u32 {
        self.outcome.solved.count()
    }

    /// Raw fitness: the share of the training cases it solves.
    pub fn fitness(&self) -> f64 {
        self.outcome.solved.fitness()
    }
}

/// An individual, shared between generations, with a hash of it.
#[derive(Debug, Clone)]
pub struct Genotype {
    individual: Arc<Individual>,
    hash: u64,
}

impl PartialEq for Genotype {
    fn eq(&self, other: &Genotype) -> bool {
        self.hash == other.hash
            && (Arc::ptr_eq(&self.individual, &other.individual) || self.individual == other.individual)
    }
}

impl Eq for Genotype {}

impl Genotype {
    /// Of this individual.
    pub fn new(individual: Individual) -> Genotype {
        let hash = FxBuildHasher.hash_one(&individual);
        Genotype { individual: Arc::new(individual), hash }
    }

    /// The individual.
    pub fn individual(&self) -> &Individual {
        &self.individual
    }

    /// For each genotype the index of the first that equals it: its own, if it is that one.
    pub(super) fn representatives(genotypes: &[&Genotype]) -> Vec<usize> {
        let mut order: Vec<usize> = (0..genotypes.len()).collect();
        order.sort_unstable_by_key(|&i| (genotypes[i].hash, i));
        let mut first: Vec<usize> = (0..genotypes.len()).collect();
        // Among genotypes of one hash (as a rule all equal): those met first of their kind.
        let mut kinds: Vec<usize> = Vec::new();
        for &i in &order {
            if kinds.first().is_some_and(|&k| genotypes[k].hash != genotypes[i].hash) {
                kinds.clear();
            }
            match kinds.iter().find(|&&k| genotypes[k] == genotypes[i]) {
                Some(&k) => first[i] = k,
                None => kinds.push(i),
            }
        }
        first
    }
}
