//! Breeding: a generation's genotypes from the one before.
//!
//! Slots are filled in pairs, each pair from its own stream of random numbers, so that the result does not
//! depend on who fills which pair when.

use rayon::prelude::*;

use super::population::{Genotype, Member};
use super::selection::tournament;
use super::settings::Settings;
use crate::tree::{CrossoverSettings, Random, subtree_crossover};

/// A genotype of the next generation.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Offspring {
    pub(super) genotype: Genotype,
    /// The member it equals, if it is a copy of a parent: what it does is known.
    pub(super) copy_of: Option<usize>,
}

/// The genotypes of `generation`, as many as there are members. `scores` are the members' scores in selection.
pub(super) fn breed(
    members: &[Member],
    scores: &[f64],
    settings: &Settings,
    crossover_settings: &CrossoverSettings,
    generation: u32,
) -> Vec<Offspring> {
    let pairs = members.len().div_ceil(2);
    let pair = |pair: usize| {
        let mut random = Random::stream(settings.seed, generation, pair as u32);
        breed_pair(members, scores, settings, crossover_settings, &mut random)
    };
    let mut offspring: Vec<Offspring> = (0..pairs).into_par_iter().flat_map_iter(pair).collect();
    // Of an odd number of slots, the last pair fills one.
    offspring.truncate(members.len());
    offspring
}

fn breed_pair(
    members: &[Member],
    scores: &[f64],
    settings: &Settings,
    crossover_settings: &CrossoverSettings,
    random: &mut Random,
) -> [Offspring; 2] {
    let size = settings.selection.tournament;
    let exchange = random.chance(settings.breeding.crossover_probability);
    let first = tournament(scores, size, random);
    let mut second = tournament(scores, size, random);
    for _ in 0..settings.breeding.redraws {
        if second != first {
            break;
        }
        second = tournament(scores, size, random);
    }
    if !exchange {
        return [first, second].map(|i| copy(members, i));
    }
    let of = |i: usize| members[i].individual();
    let [a, b] = subtree_crossover(of(first), of(second), crossover_settings, random);
    [(a, first), (b, second)].map(|(child, parent)| {
        // An exchange of equals, or one that went too deep, leaves the parent.
        if child.replaced || child.individual == *of(parent) {
            return copy(members, parent);
        }
        Offspring { genotype: Genotype::new(child.individual), copy_of: None }
    })
}

fn copy(members: &[Member], i: usize) -> Offspring {
    Offspring { genotype: members[i].genotype.clone(), copy_of: Some(i) }
}
