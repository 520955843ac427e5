//! The initial generation.
//!
//! Most random individuals do not answer at all: they say 0, or one number far outside the image, whatever they
//! see. The filter draws again until the answers look like answers, right or wrong.

use super::evaluate::{EvaluateError, Looks, Session};
use super::fitness::share;
use super::population::{Genotype, Member};
use super::record::InitialDraws;
use super::settings::{Filter, Settings};
use crate::tree::{Creator, Random};

/// A slot of the initial generation, filled.
pub(super) struct Filled {
    pub(super) member: Member,
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

/// Fills a slot from its own stream of random numbers; `None` if the run shall stop.
pub(super) fn fill(
    session: &mut Session<'_>,
    settings: &Settings,
    creator: &Creator,
    slot: u32,
) -> Result<Option<Filled>, EvaluateError> {
    let mut random = Random::stream(settings.seed, 0, slot);
    let filter = &settings.filter;
    let bar = Bar::new(filter, session.cases().len() as u32, session.cases().distinct_labels());
    let most = if filter.enabled { filter.max_draws } else { 1 };
    let mut draws = InitialDraws::default();
    loop {
        if session.stopped() {
            return Ok(None);
        }
        let individual = creator.individual(&mut random);
        draws.draws += 1;
        session.count_evaluation();
        let last = draws.draws >= u64::from(most);
        let candidate = session.cases().candidate(&individual);
        // What looks at nothing answers by the column alone; with few columns, it need not be run to know that
        // it does not pass. (Executors that do not lower run it, and come to the same.)
        if !last && session.lowers() && session.cases().columns() < bar.distinct {
            let blind = candidate.program().loops().all(|l| l.operands().is_empty());
            if blind {
                session.count_lowering(&candidate);
                continue;
            }
        }
        let verdict = session.judge(&candidate, filter.enabled)?;
        let fit = verdict.looks.is_none_or(|looks| bar.passes(looks));
        if fit || last {
            draws.unfit_kept = u64::from(!fit);
            let member = Member { genotype: Genotype::new(individual), outcome: verdict.outcome };
            return Ok(Some(Filled { member, draws }));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn looks_by_hand() {
        let answers = [0.0, -0.0, 47.0, 47.5, -0.5, f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 3.25, 3.25];
        // In range: both zeros, 47, and 3.25 twice. Distinct: 0, 47, 47.5, -0.5, 3.25.
        assert_eq!(Looks::of(&answers, 48), Looks { in_range: 5, distinct: 5 });
    }

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
