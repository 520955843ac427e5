//! Evaluation: individuals in, what they do on the training cases out, on all cores.
//!
//! Threads take one individual after the other from a shared counter, for their costs differ by a factor of a
//! thousand, and put the result where the individual stands; so the order of work changes no result. Each
//! thread has its own [`Worker`]. An executor that runs lowered programs is spared those that were run before
//! (see the cache) and those whose answer is a constant.

use std::cell::RefCell;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use super::cache::ProgramCache;
use super::fitness::{CaseBits, behaviour, is_constant, is_correct};
use super::population::Outcome;
use super::progress::Progress;
use crate::dataset::Dataset;
use crate::exec::{Candidate, ExecError, Executor, Timing, Worker};
use crate::tree::Individual;
use crate::vision::CaseSet;

/// Bytes of programs whose results are remembered.
const CACHE_BYTES: usize = 256 << 20;
/// Stack of a worker thread: whoever walks trees may recurse.
const STACK_BYTES: usize = 16 << 20;

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

/// Fitness cases prepared for evaluation.
pub(super) struct Cases {
    set: CaseSet,
    labels: Vec<f64>,
    width: u32,
    height: u32,
    columns: u32,
    distinct_labels: u32,
    tolerance: f64,
}

impl Cases {
    pub(super) fn new(data: &Dataset, tolerance: f64) -> Cases {
        let mut labels = data.labels();
        let exact = labels.iter().map(|&label| f64::from(label)).collect();
        labels.sort_unstable();
        labels.dedup();
        Cases {
            set: data.case_set(),
            labels: exact,
            width: data.width(),
            height: data.height(),
            columns: data.columns().len() as u32,
            distinct_labels: labels.len() as u32,
            tolerance,
        }
    }

    /// How many cases there are.
    pub(super) fn len(&self) -> usize {
        self.labels.len()
    }

    /// Keeps strips of other columns in at most about so many bytes.
    pub(super) fn keep_strips(&self, bytes: usize) {
        self.set.keep_strips(bytes);
    }

    /// Width and height of the images.
    pub(super) fn image_size(&self) -> (u32, u32) {
        (self.width, self.height)
    }

    /// How many distinct columns are asked for.
    pub(super) fn columns(&self) -> u32 {
        self.columns
    }

    /// How many distinct labels there are.
    pub(super) fn distinct_labels(&self) -> u32 {
        self.distinct_labels
    }

    /// The candidate for these cases.
    pub(super) fn candidate<'a>(&self, individual: &'a Individual) -> Candidate<'a> {
        Candidate::new(individual, self.width, self.height)
    }

    fn verdict(&self, answers: &[f32], looks: bool) -> Verdict {
        let solved = |i: usize| is_correct(answers[i], self.labels[i], self.tolerance);
        let outcome = Outcome {
            solved: CaseBits::from_fn(self.len(), solved),
            behaviour: behaviour(answers),
            constant: is_constant(answers),
        };
        Verdict { outcome, looks: looks.then(|| Looks::of(answers, self.height)) }
    }
}

/// What the answers look like, whether right or wrong.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Looks {
    /// How many lie within the image, 0 to height - 1.
    pub(super) in_range: u32,
    /// How many distinct finite values there are; both zeros are one.
    pub(super) distinct: u32,
}

impl Looks {
    pub(super) fn of(answers: &[f32], height: u32) -> Looks {
        let last = f64::from(height) - 1.0;
        let in_range = answers.iter().filter(|&&a| (0.0..=last).contains(&f64::from(a))).count();
        let mut finite: Vec<f32> = answers.iter().copied().filter(|a| a.is_finite()).collect();
        finite.sort_unstable_by(f32::total_cmp);
        finite.dedup();
        Looks { in_range: in_range as u32, distinct: finite.len() as u32 }
    }
}

/// The result of running an individual.
#[derive(Debug, Clone)]
pub(super) struct Verdict {
    pub(super) outcome: Outcome,
    /// Present if it was asked for.
    pub(super) looks: Option<Looks>,
}

/// Where the time of an evaluation went, summed over the threads.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Tally {
    pub(super) timing: Timing,
    /// Programs that were run.
    pub(super) executed: u64,
    /// Time for these alone, from lowering to the verdict.
    pub(super) uncached: Duration,
}

impl Tally {
    fn add(&mut self, other: Tally) {
        self.timing += other.timing;
        self.executed += other.executed;
        self.uncached += other.uncached;
    }
}

/// An executor on a number of threads, with the results it had so far.
pub(super) struct Evaluator {
    executor: Arc<dyn Executor>,
    pool: rayon::ThreadPool,
    cache: ProgramCache<Verdict>,
    /// Tells the workers of this evaluator from those another one left in the same thread.
    number: u64,
}

thread_local! {
    /// The thread's worker and the number of the evaluator it is for. Workers stay in their threads.
    static WORKER: RefCell<Option<(u64, Box<dyn Worker>)>> = const { RefCell::new(None) };
}

impl Evaluator {
    /// `threads` 0 means one for each core.
    pub(super) fn new(executor: Arc<dyn Executor>, threads: usize) -> Result<Evaluator, EvaluateError> {
        static NUMBER: AtomicU64 = AtomicU64::new(0);
        let threads = if threads > 0 {
            threads
        } else {
            std::thread::available_parallelism().map_or(1, std::num::NonZero::get)
        };
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).stack_size(STACK_BYTES);
        let pool = pool.build().map_err(|source| EvaluateError::Threads { threads, source })?;
        let number = NUMBER.fetch_add(1, Ordering::Relaxed);
        Ok(Evaluator { executor, pool, cache: ProgramCache::new(CACHE_BYTES), number })
    }

    /// The threads, for other work.
    pub(super) fn pool(&self) -> &rayon::ThreadPool {
        &self.pool
    }

    /// Calls `work` for each of 0 to `count` - 1 on all threads and gives the results in that order, or `None`
    /// if `stop` was set before all was done. Of several errors the one of the lowest number is given.
    pub(super) fn each<T: Send>(
        &self,
        count: usize,
        cases: &Cases,
        stop: &AtomicBool,
        progress: &Progress,
        work: impl Fn(&mut Session<'_>, usize) -> Result<Option<T>, EvaluateError> + Sync,
    ) -> Result<(Option<Vec<T>>, Tally), EvaluateError> {
        let next = AtomicUsize::new(0);
        let shares = self.pool.broadcast(|_| self.share(count, &next, cases, stop, progress, &work));
        let mut results: Vec<Option<T>> = (0..count).map(|_| None).collect();
        let mut tally = Tally::default();
        let mut failed: Option<(usize, EvaluateError)> = None;
        for share in shares {
            tally.add(share.tally);
            share.done.into_iter().for_each(|(i, result)| results[i] = Some(result));
            if let Some((i, error)) = share.failed
                && failed.as_ref().is_none_or(|&(j, _)| i < j)
            {
                failed = Some((i, error));
            }
        }
        match failed {
            Some((_, error)) => Err(error),
            None => Ok((results.into_iter().collect(), tally)),
        }
    }

    /// One thread's share of the work.
    fn share<T>(
        &self,
        count: usize,
        next: &AtomicUsize,
        cases: &Cases,
        stop: &AtomicBool,
        progress: &Progress,
        work: &impl Fn(&mut Session<'_>, usize) -> Result<Option<T>, EvaluateError>,
    ) -> Share<T> {
        let mut share = Share { done: Vec::new(), tally: Tally::default(), failed: None };
        let kept = WORKER.take().filter(|&(number, _)| number == self.number).map(|(_, worker)| worker);
        let worker = match kept.map_or_else(|| self.executor.worker(), Ok) {
            Ok(worker) => worker,
            Err(source) => {
                let error = EvaluateError::Worker { executor: self.executor.name(), source };
                share.failed = Some((0, error));
                return share;
            }
        };
        let answers = vec![0.0; cases.len()];
        let mut session =
            Session { evaluator: self, worker, cases, answers, stop, progress, tally: Tally::default() };
        while !stop.load(Ordering::Relaxed) {
            let i = next.fetch_add(1, Ordering::Relaxed);
            if i >= count {
                break;
            }
            match work(&mut session, i) {
                Ok(Some(result)) => share.done.push((i, result)),
                Ok(None) => break,
                Err(error) => {
                    share.failed = Some((i, error));
                    // The others need not go on.
                    next.store(count, Ordering::Relaxed);
                    break;
                }
            }
            progress.fill();
        }
        share.tally = session.tally;
        WORKER.set(Some((self.number, session.worker)));
        share
    }
}

struct Share<T> {
    done: Vec<(usize, T)>,
    tally: Tally,
    failed: Option<(usize, EvaluateError)>,
}

/// A thread at work: its worker, its scratch space, its share of the time.
pub(super) struct Session<'a> {
    evaluator: &'a Evaluator,
    worker: Box<dyn Worker>,
    cases: &'a Cases,
    answers: Vec<f32>,
    stop: &'a AtomicBool,
    progress: &'a Progress,
    tally: Tally,
}

impl Session<'_> {
    /// Whether the run shall end.
    pub(super) fn stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    /// The fitness cases.
    pub(super) fn cases(&self) -> &Cases {
        self.cases
    }

    /// Whether the executor runs lowered programs, so that looking at them costs nothing.
    pub(super) fn lowers(&self) -> bool {
        self.evaluator.executor.lowers()
    }

    /// Counts an individual that was evaluated, in whatever way.
    pub(super) fn count_evaluation(&mut self) {
        self.progress.evaluate();
    }

    /// Counts the lowering of a candidate that is not handed to [`Session::judge`].
    pub(super) fn count_lowering(&mut self, candidate: &Candidate<'_>) {
        self.tally.timing.lower += candidate.lowering();
    }

    /// What the candidate does on the cases, and if asked for, what its answers look like.
    pub(super) fn judge(&mut self, candidate: &Candidate<'_>, looks: bool) -> Result<Verdict, EvaluateError> {
        let lowered = self.lowers().then(|| candidate.program());
        self.count_lowering(candidate);
        if let Some(program) = lowered {
            if let Some(answer) = program.constant_answer() {
                self.answers.fill(answer);
                return Ok(self.cases.verdict(&self.answers, looks));
            }
            let known = self.evaluator.cache.get(program);
            if let Some(known) = known.filter(|k| k.looks.is_some() || !looks) {
                return Ok(known);
            }
        }
        let verdict = self.execute(candidate, looks)?;
        if let Some(program) = lowered {
            self.evaluator.cache.insert(program, verdict.clone());
        }
        Ok(verdict)
    }

    /// What the candidate does on the cases, by running it. Results of other cases than the training set must
    /// not meet the cache.
    pub(super) fn execute(
        &mut self,
        candidate: &Candidate<'_>,
        looks: bool,
    ) -> Result<Verdict, EvaluateError> {
        let start = Instant::now();
        let timing = self.worker.answers(candidate, &self.cases.set, &mut self.answers);
        let timing = timing.map_err(|source| EvaluateError::Program {
            executor: self.evaluator.executor.name(),
            source,
            program: candidate.individual().to_string(),
        })?;
        let verdict = self.cases.verdict(&self.answers, looks);
        // Lowering is counted above, whoever was the first to need it.
        self.tally.timing += Timing { lower: Duration::ZERO, ..timing };
        self.tally.executed += 1;
        self.tally.uncached += start.elapsed() + candidate.lowering();
        self.progress.execute();
        Ok(verdict)
    }
}
