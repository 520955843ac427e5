//! Breeding: a generation's genotypes from the one before.
//!
//! Slots are filled in pairs, each pair from its own stream of random numbers, so that the result does not
//! depend on who fills which pair when.

use rayon::prelude::*;

use super::islands;
use super::population::{Genotype, Member};
use super::selection::{Selector, sample};
use super::settings::Settings;
use crate::tree::{
    CrossoverSettings, Individual, Mutation, MutationError, Mutator, Random, subtree_crossover,
};

/// A genotype of the next generation.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Offspring {
    pub(super) genotype: Genotype,
    /// The member it equals, if it is a copy of a parent: what it does is known.
    pub(super) copy_of: Option<usize>,
}

/// How parents vary.
pub(super) struct Variation {
    crossover: CrossoverSettings,
    mutator: Mutator,
    /// Each operator with the sum of its probability and those before it; beyond the last, parents are copied.
    operators: Vec<(Operator, f64)>,
}

#[derive(Debug, Clone, Copy)]
enum Operator {
    Crossover,
    Mutation(Mutation),
}

impl Variation {
    pub(super) fn new(settings: &Settings) -> Result<Variation, MutationError> {
        let b = &settings.breeding;
        let mut operators = vec![(Operator::Crossover, b.crossover_probability)];
        let mut sum = b.crossover_probability;
        for kind in Mutation::ALL {
            sum += match kind {
                Mutation::Subtree => b.subtree_mutation_probability,
                Mutation::Point => b.point_mutation_probability,
                Mutation::Constant => b.constant_mutation_probability,
                Mutation::Hoist => b.hoist_mutation_probability,
            };
            operators.push((Operator::Mutation(kind), sum));
        }
        let mutator = Mutator::new(&settings.create_settings(), &settings.mutation_settings())?;
        Ok(Variation { crossover: settings.crossover_settings(), mutator, operators })
    }

    /// The operator for a pair; `None` if the parents are copied.
    fn draw(&self, random: &mut Random) -> Option<Operator> {
        let ticket = random.unit();
        self.operators.iter().find(|&&(_, end)| ticket < end).map(|&(operator, _)| operator)
    }

    fn apply(&self, operator: Operator, parents: [&Individual; 2], random: &mut Random) -> [Child; 2] {
        match operator {
            Operator::Crossover => subtree_crossover(parents[0], parents[1], &self.crossover, random),
            Operator::Mutation(kind) => parents.map(|parent| self.mutator.mutate(parent, kind, random)),
        }
    }
}

type Child = crate::tree::Offspring;

/// A pair of slots to be filled on an island; the last of an odd number of slots is a pair of which one counts.
struct Pair {
    island: usize,
    slots: usize,
}

/// The genotypes of `generation`, as many as there are members.
pub(super) fn breed(
    members: &[Member],
    settings: &Settings,
    variation: &Variation,
    generation: u32,
) -> Vec<Offspring> {
    let pools = islands::pools(members, &settings.islands, generation);
    let cases = members.first().map_or(0, |member| member.outcome.solved.len());
    let sample = sample(settings, cases, generation);
    let select = |pool| Selector::new(members, pool, settings, sample.as_ref());
    let selectors: Vec<Selector<'_>> = pools.par_iter().map(|pool| select(pool)).collect();
    // Pairs are numbered through all islands; the number says which stream of random numbers is theirs.
    let elitism = settings.selection.elitism as usize;
    let mut pairs = Vec::new();
    for (island, pool) in pools.iter().enumerate() {
        let slots = pool.len().saturating_sub(elitism);
        pairs.extend((0..slots).step_by(2).map(|i| Pair { island, slots: (slots - i).min(2) }));
    }
    let fill = |(number, pair): (usize, &Pair)| {
        let mut random = Random::stream(settings.seed, generation, number as u32);
        let redraws = settings.breeding.redraws;
        breed_pair(members, &selectors[pair.island], variation, redraws, &mut random)
    };
    let bred: Vec<[Offspring; 2]> = pairs.par_iter().enumerate().map(fill).collect();
    let mut offspring = Vec::with_capacity(members.len());
    let mut bred = pairs.iter().zip(bred).peekable();
    for (island, pool) in pools.iter().enumerate() {
        if elitism > 0 {
            let best = islands::ranking(members, pool);
            offspring.extend(best.iter().take(elitism).map(|&i| copy(members, i)));
        }
        while let Some((pair, both)) = bred.next_if(|(pair, _)| pair.island == island) {
            offspring.extend(both.into_iter().take(pair.slots));
        }
    }
    offspring
}

fn breed_pair(
    members: &[Member],
    selector: &Selector<'_>,
    variation: &Variation,
    redraws: u32,
    random: &mut Random,
) -> [Offspring; 2] {
    let operator = variation.draw(random);
    let first = selector.select(random);
    let mut second = selector.select(random);
    for _ in 0..redraws {
        if second != first {
            break;
        }
        second = selector.select(random);
    }
    let Some(operator) = operator else { return [first, second].map(|i| copy(members, i)) };
    let of = |i: usize| members[i].individual();
    let [a, b] = variation.apply(operator, [of(first), of(second)], random);
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
        breed(&members, settings, &Variation::new(settings).expect("sound settings"), generation)
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
    fn operators_take_their_shares() {
        let mut settings = small();
        settings.breeding.crossover_probability = 0.2;
        settings.breeding.hoist_mutation_probability = 0.5;
        let share = |of: &dyn Fn(&[Offspring]) -> bool| {
            let offspring = offspring(&settings, 4000, 1);
            offspring.chunks(2).filter(|pair| of(pair)).count() as f64 / 2000.0
        };
        // A few that exchanged equals, or had nothing to hoist, are copies too.
        let copied = share(&|pair| pair.iter().all(|o| o.copy_of.is_some()));
        assert!((0.27..0.36).contains(&copied), "{copied}");
        settings.breeding.crossover_probability = 0.0;
        settings.breeding.hoist_mutation_probability = 1.0;
        // From twins only smaller ones come, and from each pair two of their own.
        let twins = vec![members(&settings, 1).remove(0); 400];
        let nodes = twins[0].individual().len();
        let variation = Variation::new(&settings).expect("sound settings");
        let next = breed(&twins, &settings, &variation, 1);
        assert!(next.iter().all(|o| o.copy_of.is_none() && o.genotype.individual().len() < nodes));
        assert!(next.chunks(2).filter(|pair| pair[0] != pair[1]).count() > 100);
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
        let mut members = members(&settings, 100);
        for (i, member) in members.iter_mut().enumerate() {
            member.outcome.solved = CaseBits::from_fn(100, |case| case < i);
        }
        let next = breed(&members, &settings, &Variation::new(&settings).expect("sound settings"), 1);
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
