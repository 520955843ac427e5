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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evolve::fitness::CaseBits;
    use crate::evolve::population::Outcome;
    use crate::tree::Creator;

    /// Members with nothing in common but that they solve no case.
    fn members(settings: &Settings, count: u32) -> Vec<Member> {
        let creator = Creator::new(&settings.create_settings()).expect("sound settings");
        let outcome = Outcome { solved: CaseBits::from_fn(8, |_| false), behaviour: 0, constant: false };
        let member = |slot| Member {
            genotype: Genotype::new(creator.individual(&mut Random::stream(99, 0, slot))),
            outcome: outcome.clone(),
        };
        (0..count).map(member).collect()
    }

    fn small() -> Settings {
        let mut settings = Settings::paper();
        settings.creation.min_depth = 4;
        settings.creation.max_depth = 5;
        settings
    }

    fn offspring(settings: &Settings, count: u32, generation: u32) -> Vec<Offspring> {
        let members = members(settings, count);
        let scores = vec![0.0; members.len()];
        breed(&members, &scores, settings, &settings.crossover_settings(), generation)
    }

    #[test]
    fn a_tenth_is_copied() {
        let offspring = offspring(&small(), 4000, 1);
        let copied = |pair: &&[Offspring]| pair.iter().all(|o| o.copy_of.is_some());
        let pairs = offspring.chunks(2).filter(copied).count();
        // 2,000 pairs, 0.1 each: 200 with a standard deviation of 13.4; a few more that exchanged equals.
        assert!((133..280).contains(&pairs), "{pairs} pairs copied");
    }

    #[test]
    fn copies_are_their_parents() {
        let settings = small();
        let members = members(&settings, 300);
        for child in offspring(&settings, 300, 2) {
            match child.copy_of {
                Some(parent) => assert!(child.genotype == members[parent].genotype),
                None => assert!(child.genotype.individual().depth() <= 17),
            }
        }
    }

    #[test]
    fn the_second_parent_is_drawn_again_if_it_is_the_first() {
        let mut settings = small();
        settings.breeding.crossover_probability = 0.0;
        let twins = |settings: &Settings| {
            let all: Vec<Offspring> = (1..200).flat_map(|g| offspring(settings, 4, g)).collect();
            all.chunks(2).filter(|pair| pair[0].copy_of == pair[1].copy_of).count()
        };
        // Of 398 pairs a quarter by chance; ten redraws leave less than one in a million.
        assert_eq!(twins(&settings), 0);
        settings.breeding.redraws = 0;
        let found = twins(&settings);
        assert!((60..140).contains(&found), "{found} of 398");
    }

    #[test]
    fn an_odd_population_stays_odd() {
        let settings = small();
        let (odd, even) = (offspring(&settings, 31, 1), offspring(&settings, 32, 1));
        assert_eq!((odd.len(), even.len()), (31, 32));
    }

    #[test]
    fn the_best_breed_most() {
        let mut settings = small();
        settings.breeding.crossover_probability = 0.0;
        let members = members(&settings, 100);
        let scores: Vec<f64> = (0..100).map(f64::from).collect();
        let next = breed(&members, &scores, &settings, &settings.crossover_settings(), 1);
        let mean = next.iter().filter_map(|o| o.copy_of).sum::<usize>() as f64 / 100.0;
        // The largest of seven of 0..100 is 87 on average.
        assert!((80.0..93.0).contains(&mean), "{mean}");
    }

    #[test]
    fn threads_change_nothing() {
        let settings = small();
        let on = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
            pool.install(|| offspring(&settings, 101, 3))
        };
        assert!(on(1) == on(3));
    }
}
