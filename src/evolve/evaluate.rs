//! Evaluation: individuals in, what they do on the training cases out, on all cores.
//!
//! ```text
//! individuals ── all threads ──> lowered, optimised, hashed, looked up in the cache
//!             ── in order ─────> equal programs grouped; what is not known, in the order of its first occurrence
//!             ── all threads ──> these programs run, expensive ones first
//!             ── in order ─────> counted, and added to the cache
//! ```
//!
//! What is looked up, run, counted and remembered is decided in the order of the individuals, so it is the same
//! for any number of threads and any executor that runs lowered programs. One that does not is given every
//! individual; lowering then serves the statistics alone.

use std::cell::RefCell;
use std::cmp::Reverse;
use std::convert::Infallible;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use super::cache::ProgramCache;
use super::cases::{Cases, Verdict};
use super::fitness::CaseBits;
use super::population::Outcome;
use super::programs::{Fresh, Groups, Prepared, ProgramStatistics, Source, Verdicts};
use super::progress::Progress;
use super::threads::{Threads, Usage};
use crate::exec::{Candidate, ExecError, Executor, Timing, Worker};
use crate::tree::Individual;

/// Why individuals could not be evaluated.
#[derive(Debug, thiserror::Error)]
pub enum EvaluateError {
    /// The threads could not be started.
    #[error("cannot start {threads} worker threads: {source}; ask for fewer (`--threads`)")]
    Threads {
        /// How many were asked for.
        threads: usize,
        /// Why not.
        source: rayon::ThreadPoolBuildError,
    },
    /// The executor cannot run here.
    #[error("the executor {executor} cannot be used: {source}")]
    Worker {
        /// Its name.
        executor: &'static str,
        /// Why not.
        source: ExecError,
    },
    /// The executor refused a program.
    #[error("the executor {executor} failed: {source}\nThe individual:\n{program}")]
    Program {
        /// Its name.
        executor: &'static str,
        /// Why it failed.
        source: ExecError,
        /// The individual as program text.
        program: String,
    },
}

/// What a generation's evaluation is about, who watches it, and who may end it.
#[derive(Clone, Copy)]
pub(super) struct Task<'a> {
    pub(super) cases: &'a Cases,
    pub(super) generation: u32,
    /// Whether it matters what the answers look like.
    pub(super) looks: bool,
    pub(super) stop: &'a AtomicBool,
    pub(super) progress: &'a Progress,
}

/// What a generation's evaluation took and found.
#[derive(Debug, Default)]
pub(super) struct Tally {
    /// Where the time went, summed over the threads.
    pub(super) timing: Timing,
    pub(super) usage: Usage,
    /// Programs that were run.
    pub(super) executed: u64,
    /// Time for these alone, from lowering to the verdict.
    pub(super) uncached: Duration,
    /// The individuals' programs.
    pub(super) programs: ProgramStatistics,
}

/// An executor on a number of threads, with the results it had so far.
pub(super) struct Evaluator {
    executor: Arc<dyn Executor>,
    threads: Threads,
    cache: Mutex<ProgramCache<Verdict>>,
    /// Tells the workers of this evaluator from those another one left in the same thread.
    number: u64,
}

thread_local! {
    /// The thread's worker. Workers stay in their threads.
    static WORKER: RefCell<Option<Place>> = const { RefCell::new(None) };
}

/// A thread's worker, room for answers, and the number of the evaluator they are for.
struct Place {
    evaluator: u64,
    worker: Box<dyn Worker>,
    answers: Vec<f32>,
}

impl Evaluator {
    /// `threads` 0 means one for each core; results on so many cases are remembered in `cache_bytes` at most.
    pub(super) fn new(
        executor: Arc<dyn Executor>,
        threads: usize,
        cases: usize,
        cache_bytes: usize,
    ) -> Result<Evaluator, EvaluateError> {
        static NUMBER: AtomicU64 = AtomicU64::new(0);
        let number = NUMBER.fetch_add(1, Ordering::Relaxed);
        let cache = Mutex::new(ProgramCache::new(cache_bytes, CaseBits::heap_bytes(cases)));
        Ok(Evaluator { executor, threads: Threads::new(threads)?, cache, number })
    }

    /// Forgets all results, of so many cases each, and remembers others in `bytes` at most.
    pub(super) fn limit_cache(&mut self, cases: usize, bytes: usize) {
        self.cache = Mutex::new(ProgramCache::new(bytes, CaseBits::heap_bytes(cases)));
    }

    /// The threads, for other work.
    pub(super) fn threads(&self) -> &Threads {
        &self.threads
    }

    /// Whether the executor runs lowered programs, so that what they tell need not be run.
    pub(super) fn lowers(&self) -> bool {
        self.executor.lowers()
    }

    fn cache(&self) -> MutexGuard<'_, ProgramCache<Verdict>> {
        // A map whose holder panicked is still a map.
        self.cache.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// What these individuals do, each of which counts and fills a slot; `None` if stopped.
    pub(super) fn evaluate(
        &self,
        individuals: &[&Individual],
        task: Task<'_>,
        tally: &mut Tally,
    ) -> Result<Option<Vec<Outcome>>, EvaluateError> {
        let Some(prepared) = self.prepare(individuals, task, tally) else { return Ok(None) };
        let all: Vec<&Prepared<'_>> = prepared.iter().collect();
        let done = |individuals| {
            task.progress.evaluate(individuals);
            task.progress.fill(individuals);
        };
        let Some(verdicts) = self.judge(&all, task, tally, done)? else { return Ok(None) };
        self.count(&all, &verdicts, |_| true, task, tally);
        all.iter().for_each(|one| tally.programs.count(one));
        Ok(Some((0..all.len()).map(|i| verdicts.get(i).outcome.clone()).collect()))
    }

    /// Lowers and optimises individuals and looks up what is known of their programs; `None` if stopped.
    pub(super) fn prepare<'a>(
        &self,
        individuals: &[&'a Individual],
        task: Task<'_>,
        tally: &mut Tally,
    ) -> Option<Vec<Prepared<'a>>> {
        let cache = &*self.cache();
        let work = |i: usize| -> Result<_, Infallible> {
            let mut prepared = Prepared::new(task.cases.candidate(individuals[i]));
            let program = prepared.program();
            if !self.lowers() {
                return Ok(prepared);
            }
            prepared.known = match program.constant_answer() {
                Some(answer) => Some(task.cases.verdict(&vec![answer; task.cases.len()], task.looks)),
                None => {
                    let known = cache.get(prepared.hash, program, task.generation);
                    known.filter(|known| known.looks.is_some() || !task.looks).cloned()
                }
            };
            Ok(prepared)
        };
        let order: Vec<usize> = (0..individuals.len()).collect();
        let Ok(prepared) = self.threads.each(&order, task.stop, &mut tally.usage, work);
        let prepared = prepared?;
        tally.timing.lower += prepared.iter().map(|one| one.candidate.lowering()).sum::<Duration>();
        Some(prepared)
    }

    /// Runs what is not known, equal programs once, and gives all verdicts; `None` if stopped. `done` is called,
    /// by any thread, with how many more individuals have theirs.
    pub(super) fn judge(
        &self,
        prepared: &[&Prepared<'_>],
        task: Task<'_>,
        tally: &mut Tally,
        done: impl Fn(u64) + Sync,
    ) -> Result<Option<Verdicts>, EvaluateError> {
        let Groups { sources, firsts, sizes } = Groups::of(prepared, self.lowers());
        done(prepared.len() as u64 - sizes.iter().sum::<u64>());
        // The longest first, so that no thread is left with one when all others have nothing to do.
        let mut order: Vec<usize> = (0..firsts.len()).collect();
        order.sort_by_cached_key(|&n| Reverse(prepared[firsts[n]].cost()));
        let work = |n: usize| {
            let fresh = self.execute(&prepared[firsts[n]].candidate, task.cases, task.looks)?;
            task.progress.execute();
            done(sizes[n]);
            Ok(fresh)
        };
        let fresh = self.threads.each(&order, task.stop, &mut tally.usage, work)?;
        let Some(fresh) = fresh else { return Ok(None) };
        for one in &fresh {
            // Lowering is counted where it is done, whoever was the first to need it.
            tally.timing += Timing { lower: Duration::ZERO, ..one.timing };
        }
        Ok(Some(Verdicts { sources, fresh }))
    }

    /// Counts those of the individuals that count, in their order, and remembers what they do.
    pub(super) fn count(
        &self,
        prepared: &[&Prepared<'_>],
        verdicts: &Verdicts,
        counts: impl Fn(usize) -> bool,
        task: Task<'_>,
        tally: &mut Tally,
    ) {
        let mut cache = self.cache();
        let mut counted = vec![false; verdicts.fresh.len()];
        for (i, source) in verdicts.sources.iter().enumerate().filter(|&(i, _)| counts(i)) {
            let Source::Fresh(n) = *source else { continue };
            if std::mem::replace(&mut counted[n], true) {
                continue;
            }
            let fresh = &verdicts.fresh[n];
            tally.executed += 1;
            tally.uncached += fresh.time;
            if self.lowers() {
                cache.insert(prepared[i].hash, prepared[i].program(), fresh.verdict.clone(), task.generation);
            }
        }
    }

    /// What an individual does on cases of any kind. Nothing is remembered.
    pub(super) fn score(&self, individual: &Individual, cases: &Cases) -> Result<Verdict, EvaluateError> {
        let candidate = cases.candidate(individual);
        let fresh = self.threads.pool().install(|| self.execute(&candidate, cases, false));
        Ok(fresh?.verdict)
    }

    /// What the candidate does on the cases, by running it in this thread.
    fn execute(&self, candidate: &Candidate<'_>, cases: &Cases, looks: bool) -> Result<Fresh, EvaluateError> {
        let start = Instant::now();
        let executor = self.executor.name();
        let mut place = match WORKER.take().filter(|place| place.evaluator == self.number) {
            Some(place) => place,
            None => {
                let worker = self.executor.worker();
                let worker = worker.map_err(|source| EvaluateError::Worker { executor, source })?;
                Place { evaluator: self.number, worker, answers: Vec::new() }
            }
        };
        place.answers.resize(cases.len(), 0.0);
        let timing = place.worker.answers(candidate, cases.set(), &mut place.answers);
        let timing = timing.map_err(|source| {
            let program = candidate.individual().to_string();
            EvaluateError::Program { executor, source, program }
        })?;
        let verdict = cases.verdict(&place.answers, looks);
        WORKER.set(Some(place));
        let lowering = if self.lowers() { candidate.lowering() } else { Duration::ZERO };
        Ok(Fresh { verdict, timing, time: start.elapsed() + lowering })
    }
}
