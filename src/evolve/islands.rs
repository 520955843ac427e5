//! Islands: parts of the population that breed by themselves, and who migrates between them.
//!
//! D. Whitley, S. Rana, R. B. Heckendorn, *The island model genetic algorithm: on separability, population size and
//! convergence*, 1999. Which island an individual is on follows from its slot, and when there is migration from the
//! number of the generation, so that nothing is stored.

use std::cmp::Reverse;
use std::ops::Range;

use super::population::Member;
use super::settings::Islands;

/// The slots of island `i` of `count`, of a population of so many.
pub(super) fn slots(i: usize, count: usize, population: usize) -> Range<usize> {
    i * population / count..(i + 1) * population / count
}

/// The members that a generation of each island is bred from, by number.
pub(super) fn pools(members: &[Member], islands: &Islands, generation: u32) -> Vec<Vec<usize>> {
    let count = islands.count as usize;
    let mut pools: Vec<Vec<usize>> = (0..count).map(|i| slots(i, count, members.len()).collect()).collect();
    if count > 1 && islands.migrants > 0 && generation.is_multiple_of(islands.interval) {
        let ranked: Vec<Vec<usize>> = pools.iter().map(|pool| ranking(members, pool)).collect();
        for (i, pool) in pools.iter_mut().enumerate() {
            let (from, here) = (&ranked[(i + count - 1) % count], &ranked[i]);
            let worst = here.iter().rev();
            for (&place, &migrant) in worst.zip(from).take(islands.migrants as usize) {
                let start = slots(i, count, members.len()).start;
                pool[place - start] = migrant;
            }
        }
    }
    pools
}

/// The numbers of these members from the best to the worst: by cases solved, of equal ones the smaller first, then the
/// one that comes first.
pub(super) fn ranking(members: &[Member], of: &[usize]) -> Vec<usize> {
    let mut ranked = of.to_vec();
    ranked.sort_by_cached_key(|&i| (Reverse(members[i].correct()), members[i].individual().len()));
    ranked
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evolve::fitness::CaseBits;
    use crate::evolve::population::{Genotype, Outcome};

    /// Members that solve so many cases of 20 each; the number of nodes grows with the second number.
    fn members(of: &[(usize, usize)]) -> Vec<Member> {
        let member = |&(correct, sines): &(usize, usize)| {
            let body = format!("{}y{}", "(sin ".repeat(sines), ")".repeat(sines));
            let text = format!("(individual (iterate-up 2x2 1 {body}))");
            let solved = CaseBits::from_fn(20, |case| case < correct);
            Member {
                genotype: Genotype::new(text.parse().expect("an individual")),
                outcome: Outcome { solved, behaviour: 0, constant: false },
            }
        };
        of.iter().map(member).collect()
    }

    fn islands(count: u32, interval: u32, migrants: u32) -> Islands {
        Islands { count, interval, migrants }
    }

    #[test]
    fn slots_are_equal_parts() {
        for population in [2, 7, 60, 4000] {
            for count in 1..=(population / 2).min(9) {
                let parts: Vec<Range<usize>> = (0..count).map(|i| slots(i, count, population)).collect();
                assert_eq!((parts[0].start, parts[count - 1].end), (0, population));
                assert!(parts.windows(2).all(|w| w[0].end == w[1].start));
                let floor = population / count;
                assert!(parts.iter().all(|p| p.len() == floor || p.len() == floor + 1), "{parts:?}");
            }
        }
    }

    #[test]
    fn the_ranking_is_by_cases_then_nodes_then_order() {
        let members = members(&[(3, 2), (5, 4), (5, 1), (3, 2), (5, 1), (9, 7)]);
        assert_eq!(ranking(&members, &[0, 1, 2, 3, 4, 5]), [5, 2, 4, 1, 0, 3]);
        assert_eq!(ranking(&members, &[3, 0]), [3, 0], "the order of equals is that of the pool");
    }

    #[test]
    fn the_best_migrate_to_the_next_in_the_ring() {
        let members = members(&[(1, 0), (2, 0), (3, 0), (11, 0), (12, 0), (13, 0), (6, 0), (5, 0), (4, 0)]);
        let home = vec![vec![0, 1, 2], vec![3, 4, 5], vec![6, 7, 8]];
        assert_eq!(pools(&members, &islands(3, 4, 2), 7), home);
        assert_eq!(pools(&members, &islands(3, 4, 0), 8), home);
        // The best takes the place of the worst, the second best that of the second worst.
        let moved = [vec![6, 7, 2], vec![2, 1, 5], vec![6, 4, 5]];
        assert_eq!(pools(&members, &islands(3, 4, 2), 8), moved);
        assert_eq!(pools(&members, &islands(1, 1, 2), 8), [(0..9).collect::<Vec<_>>()]);
    }
}
