//! The programs of a batch of individuals: which are equal, what is known of them, what they cost.

use std::collections::hash_map::DefaultHasher;
use std::hash::{BuildHasher, Hash, Hasher};
use std::time::Duration;

use rustc_hash::{FxBuildHasher, FxHashMap};
use vsonar_ir::{Leaf, Loop, Program, Span};

use super::cases::Verdict;
use super::record::Record;
use crate::exec::{Candidate, Timing};

/// An individual whose program is there.
pub(super) struct Prepared<'a> {
    pub(super) candidate: Candidate<'a>,
    pub(super) hash: u64,
    /// What the program does, if that is known without running it.
    pub(super) known: Option<Verdict>,
    fingerprint: u128,
}

impl<'a> Prepared<'a> {
    /// Lowers, optimises and hashes; nothing is known yet.
    pub(super) fn new(candidate: Candidate<'a>) -> Prepared<'a> {
        let hash = FxBuildHasher.hash_one(candidate.program());
        let mut other = DefaultHasher::new();
        candidate.program().hash(&mut other);
        let fingerprint = u128::from(hash) << 64 | u128::from(other.finish());
        Prepared { candidate, hash, known: None, fingerprint }
    }

    /// The optimised program.
    pub(super) fn program(&self) -> &Program {
        self.candidate.program()
    }

    /// About how long it runs, in instructions of a lane. It orders the work, and changes nothing else.
    pub(super) fn cost(&self) -> usize {
        let cost = |l: &Loop| {
            let positions = match l.span() {
                Span::All => l.rect().positions(self.program().height()) as usize,
                Span::Last => 1,
            };
            // The windows of other columns than the case's own are gathered, some instructions for each.
            let own = l.column().as_leaf() == Some(Leaf::XObstacle);
            let gathered = if own { 0 } else { l.operands().len() };
            (l.body().len() + 8 * gathered) * positions
        };
        self.program().loops().map(cost).sum()
    }
}

/// Individuals by what they do.
#[derive(Default)]
pub(super) struct Groups {
    /// Of each individual.
    pub(super) sources: Vec<Source>,
    /// Of each program that has to be run: the first individual that has it.
    pub(super) firsts: Vec<usize>,
    /// How many have it.
    pub(super) sizes: Vec<u64>,
}

impl Groups {
    /// Of these individuals; equal programs are one if they are `shared`, else each individual is run for
    /// itself.
    pub(super) fn of(prepared: &[&Prepared<'_>], shared: bool) -> Groups {
        let mut groups = Groups { sources: Vec::with_capacity(prepared.len()), ..Groups::default() };
        let mut by_hash: FxHashMap<u64, Vec<usize>> = FxHashMap::default();
        for (i, one) in prepared.iter().enumerate() {
            if let Some(known) = &one.known {
                groups.sources.push(Source::Known(known.clone()));
                continue;
            }
            let met = by_hash.entry(one.hash).or_default();
            let equal = |&&n: &&usize| shared && prepared[groups.firsts[n]].program() == one.program();
            let n = met.iter().find(equal).copied().unwrap_or(groups.firsts.len());
            if n == groups.firsts.len() {
                met.push(n);
                groups.firsts.push(i);
                groups.sizes.push(0);
            }
            groups.sizes[n] += 1;
            groups.sources.push(Source::Fresh(n));
        }
        groups
    }
}

/// The verdicts on a list of individuals.
pub(super) struct Verdicts {
    pub(super) sources: Vec<Source>,
    pub(super) fresh: Vec<Fresh>,
}

/// Where an individual's verdict comes from.
pub(super) enum Source {
    /// It was known.
    Known(Verdict),
    /// The program of this number was run.
    Fresh(usize),
}

/// A program that was run.
pub(super) struct Fresh {
    pub(super) verdict: Verdict,
    pub(super) timing: Timing,
    /// From lowering to the verdict.
    pub(super) time: Duration,
}

impl Verdicts {
    /// That on individual `i`.
    pub(super) fn get(&self, i: usize) -> &Verdict {
        match &self.sources[i] {
            Source::Known(verdict) => verdict,
            Source::Fresh(n) => &self.fresh[*n].verdict,
        }
    }
}

/// The programs of a generation's individuals, before and after the optimiser.
#[derive(Debug, Default)]
pub(super) struct ProgramStatistics {
    individuals: u64,
    before: u64,
    after: u64,
    /// Equal programs have equal fingerprints; of a million programs, two that differ have one less than once in
    /// ten million generations, by half of its bits alone.
    fingerprints: Vec<u128>,
}

impl ProgramStatistics {
    /// Counts an individual.
    pub(super) fn count(&mut self, one: &Prepared<'_>) {
        self.individuals += 1;
        self.before += one.candidate.operations_before() as u64;
        self.after += one.program().operations() as u64;
        self.fingerprints.push(one.fingerprint);
    }

    /// How many programs differ after the optimiser.
    fn distinct(mut self) -> u64 {
        self.fingerprints.sort_unstable();
        self.fingerprints.dedup();
        self.fingerprints.len() as u64
    }

    /// Puts the numbers into a record.
    pub(super) fn tell(self, record: &mut Record) {
        let mean = |sum: u64| sum as f64 / self.individuals.max(1) as f64;
        record.operations_before = Some(mean(self.before));
        record.operations_after = Some(mean(self.after));
        record.distinct_optimised = Some(self.distinct());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evolve::fitness::CaseBits;
    use crate::evolve::population::Outcome;
    use crate::tree::Individual;

    fn individuals(texts: &[&str]) -> Vec<Individual> {
        let text = |text: &&str| format!("(individual (iterate-down 3x3 x-obstacle (set-a {text})))");
        texts.iter().map(|t| text(t).parse().unwrap_or_else(|e| panic!("{t}: {e}"))).collect()
    }

    fn prepared(individuals: &[Individual]) -> Vec<Prepared<'_>> {
        individuals.iter().map(|i| Prepared::new(Candidate::new(i, 64, 48))).collect()
    }

    fn sources(groups: &Groups) -> Vec<Option<usize>> {
        let number = |source: &Source| match source {
            Source::Known(_) => None,
            Source::Fresh(n) => Some(*n),
        };
        groups.sources.iter().map(number).collect()
    }

    /// The third says what the first says, in other words; what is known of the last makes no group.
    const TEXTS: [&str; 5] = ["(+ y raw)", "(* y raw)", "(+ raw y)", "(- y raw)", "(* raw raw)"];

    #[test]
    fn equal_programs_are_run_once() {
        let individuals = individuals(&TEXTS);
        let mut prepared = prepared(&individuals);
        let solved = CaseBits::from_fn(3, |_| true);
        let outcome = Outcome { solved, behaviour: 0, constant: false };
        prepared[4].known = Some(Verdict { outcome, looks: None });
        // Whether the hashes tell the programs apart, or are all the same.
        for collide in [false, true] {
            if collide {
                prepared.iter_mut().for_each(|one| one.hash = 7);
            }
            let all: Vec<&Prepared<'_>> = prepared.iter().collect();
            let groups = Groups::of(&all, true);
            assert_eq!(sources(&groups), [Some(0), Some(1), Some(0), Some(2), None]);
            assert_eq!((&groups.firsts[..], &groups.sizes[..]), (&[0, 1, 3][..], &[2, 1, 1][..]));
            let each = Groups::of(&all, false);
            assert_eq!(sources(&each), [Some(0), Some(1), Some(2), Some(3), None]);
        }
    }

    #[test]
    fn statistics_by_hand() {
        let individuals = individuals(&TEXTS);
        let mut statistics = ProgramStatistics::default();
        prepared(&individuals).iter().for_each(|one| statistics.count(one));
        assert_eq!((statistics.individuals, statistics.before, statistics.after), (5, 5, 5));
        assert_eq!(statistics.distinct(), 4);
        assert_eq!(ProgramStatistics::default().distinct(), 0);
    }

    #[test]
    fn the_longer_the_dearer() {
        let individuals = individuals(&["(+ read-a raw)", "(+ read-a (* raw gradient))", "(+ y raw)"]);
        let costs: Vec<usize> = prepared(&individuals).iter().map(Prepared::cost).collect();
        // What is not carried from row to row is that of the last row alone: one position.
        assert!(costs[2] < costs[0] / 10 && costs[0] < costs[1], "{costs:?}");
    }
}
