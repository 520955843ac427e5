//! The initial generation.
//!
//! Most random individuals do not answer at all: they say 0, or one number far outside the image, whatever they
//! see. The filter draws again until the answers look like answers, right or wrong.
//!
//! Each slot draws from its own stream of random numbers. All open slots draw and are judged together, round
//! after round; when few are left, each draws several individuals ahead so that no thread is idle, and those
//! after the first that passes are as if they had never been drawn.

use std::convert::Infallible;

use super::cases::Looks;
use super::evaluate::{EvaluateError, Evaluator, Tally, Task};
use super::fitness::share;
use super::population::{Genotype, Member};
use super::programs::Prepared;
use super::record::InitialDraws;
use super::settings::{Filter, Settings};
use crate::tree::{Creator, Individual, Random};

/// Individuals that a round has at least, if the slots may still draw as many. It must not depend on the number
/// of threads: the order in which programs come into the cache depends on it.
const ROUND: usize = 128;

/// The initial generation, complete.
pub(super) struct Initial {
    pub(super) members: Vec<Member>,
    pub(super) draws: InitialDraws,
}

/// What the filter asks of a set of cases.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Bar {
    in_range: f64,
    distinct: u32,
    cases: u32,
}

impl Bar {
    pub(super) fn new(filter: &Filter, cases: u32, distinct_labels: u32) -> Bar {
        // At least half the labels: of an odd number the larger half.
        Bar { in_range: filter.in_range, distinct: filter.distinct.min(distinct_labels.div_ceil(2)), cases }
    }

    pub(super) fn passes(&self, looks: Looks) -> bool {
        share(looks.in_range, self.cases) >= self.in_range && looks.distinct >= self.distinct
    }
}

/// A slot that still draws.
struct Slot {
    number: usize,
    random: Random,
}

/// What fills a slot: the first of its individuals that passes, or the last that may be drawn.
#[derive(Clone, Copy)]
struct Choice {
    /// Number of the individual in the round.
    individual: usize,
    /// Number of its verdict.
    verdict: usize,
    fit: bool,
}

/// Draws the initial generation; `None` if the run shall stop.
pub(super) fn create(
    evaluator: &Evaluator,
    settings: &Settings,
    creator: &Creator,
    task: Task<'_>,
    tally: &mut Tally,
) -> Result<Option<Initial>, EvaluateError> {
    let filter = &settings.filter;
    let most = if filter.enabled { filter.max_draws as usize } else { 1 };
    let bar = Bar::new(filter, task.cases.unaltered() as u32, task.cases.distinct_labels());
    // What looks at nothing answers by the column alone; with few columns, it need not be run to know that it
    // does not pass. (Executors that do not lower run it, and come to the same.)
    let tells = evaluator.lowers() && task.cases.columns() < bar.distinct;
    let blind = |one: &Prepared<'_>| tells && one.program().loops().all(|l| l.operands().is_empty());

    let slot = |number| Slot { number, random: Random::stream(settings.seed, 0, number as u32) };
    let mut open: Vec<Slot> = (0..settings.population as usize).map(slot).collect();
    let mut members: Vec<Option<Member>> = open.iter().map(|_| None).collect();
    let mut draws = InitialDraws::default();
    // All open slots have drawn as often.
    let mut drawn = 0;
    while !open.is_empty() {
        let ahead = ROUND.div_ceil(open.len()).min(most - drawn);
        let Some(individuals) = draw(evaluator, &mut open, ahead, creator, task, tally) else {
            return Ok(None);
        };
        let references: Vec<&Individual> = individuals.iter().collect();
        let Some(prepared) = evaluator.prepare(&references, task, tally) else { return Ok(None) };
        let is_last = |i: usize| drawn + i % ahead + 1 == most;
        let seen: Vec<usize> = (0..prepared.len()).filter(|&i| is_last(i) || !blind(&prepared[i])).collect();
        let judged: Vec<&Prepared<'_>> = seen.iter().map(|&i| &prepared[i]).collect();
        // Only if none is drawn ahead it is known by now that it counts.
        let done = |individuals| task.progress.evaluate(if ahead == 1 { individuals } else { 0 });
        let Some(verdicts) = evaluator.judge(&judged, task, tally, done)? else { return Ok(None) };

        let mut chosen: Vec<Option<Choice>> = open.iter().map(|_| None).collect();
        for (verdict, &i) in seen.iter().enumerate() {
            let fit = verdicts.get(verdict).looks.is_none_or(|looks| bar.passes(looks));
            if chosen[i / ahead].is_none() && (fit || is_last(i)) {
                chosen[i / ahead] = Some(Choice { individual: i, verdict, fit });
            }
        }
        let counts = |i: usize| chosen[i / ahead].as_ref().is_none_or(|choice| i <= choice.individual);
        evaluator.count(&judged, &verdicts, |n| counts(seen[n]), task, tally);
        let counted = (0..prepared.len()).filter(|&i| counts(i));
        let counted = counted.inspect(|&i| tally.programs.count(&prepared[i])).count() as u64;
        draws.draws += counted;
        task.progress.evaluate(counted - if ahead == 1 { judged.len() as u64 } else { 0 });
        drop(prepared);

        let mut individuals: Vec<Option<Individual>> = individuals.into_iter().map(Some).collect();
        let mut filled = 0;
        for (slot, choice) in open.iter().zip(&chosen) {
            let Some(Choice { individual, verdict, fit }) = *choice else { continue };
            let Some(individual) = individuals[individual].take() else { continue };
            let outcome = verdicts.get(verdict).outcome.clone();
            members[slot.number] = Some(Member { genotype: Genotype::new(individual), outcome });
            draws.unfit_kept += u64::from(!fit);
            filled += 1;
        }
        task.progress.fill(filled);
        open.retain(|slot| members[slot.number].is_none());
        drawn += ahead;
    }
    Ok(members.into_iter().collect::<Option<Vec<Member>>>().map(|members| Initial { members, draws }))
}

/// The next `ahead` individuals of each slot, slot by slot; `None` if stopped.
fn draw(
    evaluator: &Evaluator,
    open: &mut [Slot],
    ahead: usize,
    creator: &Creator,
    task: Task<'_>,
    tally: &mut Tally,
) -> Option<Vec<Individual>> {
    let order: Vec<usize> = (0..open.len()).collect();
    let work = |n: usize| -> Result<_, Infallible> {
        let mut random = open[n].random.clone();
        let individuals: Vec<Individual> = (0..ahead).map(|_| creator.individual(&mut random)).collect();
        Ok((individuals, random))
    };
    let Ok(drawn) = evaluator.threads().each(&order, task.stop, &mut tally.usage, work);
    let mut all = Vec::with_capacity(open.len() * ahead);
    for (slot, (individuals, random)) in open.iter_mut().zip(drawn?) {
        slot.random = random;
        all.extend(individuals);
    }
    Some(all)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bar() {
        let filter = Settings::default_preset().filter;
        let looks = |in_range, distinct| Looks { in_range, distinct };
        let many = Bar::new(&filter, 100, 200);
        assert!(many.passes(looks(50, 20)) && !many.passes(looks(49, 20)) && !many.passes(looks(50, 19)));
        // With 11 distinct labels at least half of them are 6.
        let few = Bar::new(&filter, 100, 11);
        assert!(few.passes(looks(50, 6)) && !few.passes(looks(50, 5)));
    }
}
