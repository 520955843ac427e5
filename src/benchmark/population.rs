//! The individuals that are measured: those of an evolved population that an evaluation would have to run.

use std::sync::atomic::AtomicBool;

use rustc_hash::FxHashSet;
use vsonar_ir::Program;

use crate::evolve::{Evolution, Record, RunError};
use crate::exec::Candidate;
use crate::tree::Individual;

/// The fresh individuals of a generation, in the order of the population.
#[derive(Debug, Clone, PartialEq)]
pub struct Fresh {
    /// The generation, counted from 0.
    pub generation: u32,
    /// Its individuals whose optimised programs no earlier one had.
    pub individuals: Vec<Individual>,
}

/// Tells fresh individuals: those that a cache of all programs so far would not know. An individual whose
/// answer is a constant needs no run and is never fresh.
#[derive(Debug)]
pub struct FreshFilter {
    width: u32,
    height: u32,
    seen: FxHashSet<Program>,
}

impl FreshFilter {
    /// A filter that has seen nothing, for images of `width` x `height` pixels.
    pub fn new(width: u32, height: u32) -> FreshFilter {
        FreshFilter { width, height, seen: FxHashSet::default() }
    }

    /// Whether the individual is fresh. Its optimised program counts as seen from here on.
    ///
    /// # Panics
    /// If there cannot be programs for images of this size ([`Program::fits`]).
    pub fn admits(&mut self, individual: &Individual) -> bool {
        let candidate = Candidate::new(individual, self.width, self.height);
        let program = candidate.program();
        program.constant_answer().is_none() && self.seen.insert(program.clone())
    }
}

/// Evolves until the last of `generations` (ascending) and gives the fresh individuals of each; `None` if `stop` was
/// set before. All generations of the run are looked at, whether asked for or not, so a run that goes on from a
/// later generation would not do. `observer` is told of each generation.
///
/// # Errors
/// If an individual cannot be evaluated.
pub fn evolve_fresh(
    evolution: &mut Evolution,
    generations: &[u32],
    stop: &AtomicBool,
    mut observer: impl FnMut(&Record),
) -> Result<Option<Vec<Fresh>>, RunError> {
    let mut filter: Option<FreshFilter> = None;
    let mut all = Vec::new();
    let last = generations.iter().copied().max();
    for generation in 0..last.map_or(0, |last| last + 1) {
        let Some(record) = evolution.step(stop)? else { return Ok(None) };
        observer(record);
        let (width, height) = evolution.image_size();
        let filter = filter.get_or_insert_with(|| FreshFilter::new(width, height));
        let members = evolution.state().map_or(&[][..], |state| &state.population);
        let mut fresh: Vec<&Individual> = members.iter().map(|member| member.individual()).collect();
        fresh.retain(|individual| filter.admits(individual));
        if generations.contains(&generation) {
            let individuals = fresh.into_iter().cloned().collect();
            all.push(Fresh { generation, individuals });
        }
    }
    Ok(Some(all))
}

/// `count` of the items, evenly spread over them; all of them, if there are no more.
pub fn even_sample<T>(items: &[T], count: usize) -> Vec<&T> {
    let count = count.min(items.len());
    (0..count).map(|i| &items[i * items.len() / count]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn individual(body: &str) -> Individual {
        let text = format!("(individual (iterate-up 3x3 x-obstacle {body}))");
        text.parse().expect("a program")
    }

    #[test]
    fn what_computes_the_same_is_fresh_once() {
        let mut filter = FreshFilter::new(32, 32);
        let mut fresh = |body| filter.admits(&individual(body));
        assert!(fresh("(set-a (+ raw y))"));
        assert!(!fresh("(set-a (+ raw y))") && !fresh("(set-a (prog2 3 (+ raw y)))"));
        assert!(fresh("(set-a (- raw y))"));
        assert!(!fresh("(set-a 7)") && !fresh("(set-b raw)"), "constants are never fresh");
    }

    #[test]
    fn samples_are_even() {
        let items: Vec<u32> = (0..10).collect();
        let sample = |count| even_sample(&items, count).into_iter().copied().collect::<Vec<u32>>();
        assert_eq!((sample(0), sample(3), sample(5)), (vec![], vec![0, 3, 6], vec![0, 2, 4, 6, 8]));
        assert_eq!(sample(99), items);
        assert!(even_sample::<u32>(&[], 3).is_empty());
    }
}
