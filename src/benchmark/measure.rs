//! The measurement: every individual on every executor, round after round, and the answers held against the walker's.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use rayon::prelude::*;

use super::spread::median;
use crate::exec::tree::Walker;
use crate::exec::{Candidate, ExecError, Executor, Timing, Worker};
use crate::tree::Individual;
use crate::vision::CaseSet;

/// How much is measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Plan {
    /// Rounds in which the executors take turns.
    pub rounds: usize,
    /// Rounds of an executor that is slow, at most.
    pub slow_rounds: usize,
    /// A slow executor is measured on every n-th individual only, from the first on.
    pub slow_every: usize,
}

impl Default for Plan {
    fn default() -> Plan {
        Plan { rounds: 5, slow_rounds: 3, slow_every: 4 }
    }
}

/// Whether an executor is one that was made to be looked at, not to be fast; it is measured on fewer individuals.
pub fn is_slow(executor: &dyn Executor) -> bool {
    matches!(executor.name(), "tree" | "reference")
}

/// Times of an individual in seconds, each the median over the rounds.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Times {
    /// Lowering and optimising.
    pub lower: f64,
    /// Code generation.
    pub compile: f64,
    /// Running on all cases.
    pub execute: f64,
    /// All three; the median of the sums.
    pub together: f64,
}

impl Times {
    fn of(rounds: &[Timing]) -> Times {
        let of = |part: fn(&Timing) -> f64| median(rounds.iter().map(part));
        Times {
            lower: of(|t| t.lower.as_secs_f64()),
            compile: of(|t| t.compile.as_secs_f64()),
            execute: of(|t| t.execute.as_secs_f64()),
            together: of(together),
        }
    }
}

fn together(timing: &Timing) -> f64 {
    (timing.lower + timing.compile + timing.execute).as_secs_f64()
}

/// What is known of a measured individual.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Subject {
    /// Operations of its optimised program ([`Program::operations`](vsonar_ir::Program::operations)).
    pub operations: usize,
    /// Nodes of its trees that are evaluated on all cases together, counted by the walker.
    pub nodes: u64,
}

/// What an executor took.
#[derive(Debug, Clone, PartialEq)]
pub struct Runs {
    /// Its name.
    pub name: &'static str,
    /// Whether it runs lowered programs.
    pub lowers: bool,
    /// Rounds it was measured in.
    pub rounds: usize,
    /// Its times by individual; `None` where it was not measured.
    pub times: Vec<Option<Times>>,
    /// The sum over its individuals in each round, in seconds, compilation included.
    pub totals: Vec<f64>,
}

/// A measurement.
#[derive(Debug, Clone, PartialEq)]
pub struct Measured {
    /// Fitness cases that each individual was run on.
    pub cases: usize,
    /// The individuals.
    pub subjects: Vec<Subject>,
    /// The executors, in the order they were given in.
    pub runs: Vec<Runs>,
}

/// How far a measurement is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Step {
    /// The walker counts nodes and says what is right.
    Judge,
    /// The first round, which is not counted: it makes strips, and compares all answers.
    WarmUp,
    /// A round, counted from 1.
    Round(usize),
}

/// Why there is no measurement.
#[derive(Debug, thiserror::Error)]
pub enum BenchError {
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
    /// An executor answered something else than the walker does.
    #[error(
        "the executor {executor} answers {found:?} to case {case}, the walker {expected:?}; a benchmark of wrong \
         answers is void, and this is a fault of vsonar: please report it with the individual:\n{program}"
    )]
    Disagreement {
        /// Name of the executor.
        executor: &'static str,
        /// Number of the case, from 0.
        case: usize,
        /// Its answer.
        found: f32,
        /// The walker's answer.
        expected: f32,
        /// The individual as program text.
        program: String,
    },
}

/// Runs the individuals on all executors, which take turns round by round, on this thread. `None` if `stop` was set
/// before the end. `observer` is told what comes next.
///
/// Before that, the walker runs each individual on all cases, on all threads, and counts nodes; its answers are what
/// every executor's are held against, in every round, bit by bit (any NaN equals any NaN).
///
/// # Errors
/// If an executor cannot run, refuses a program, or answers otherwise than the walker.
pub fn measure(
    individuals: &[&Individual],
    cases: &CaseSet,
    executors: &[Arc<dyn Executor>],
    plan: &Plan,
    stop: &AtomicBool,
    mut observer: impl FnMut(Step),
) -> Result<Option<Measured>, BenchError> {
    observer(Step::Judge);
    let judged: Vec<Option<Judged>> =
        individuals.par_iter().map(|individual| Judged::of(individual, cases, stop)).collect();
    let Some(judged) = judged.into_iter().collect::<Option<Vec<Judged>>>() else { return Ok(None) };
    let mut contestants: Vec<Contestant> =
        executors.iter().map(|e| Contestant::new(&**e, individuals.len(), plan)).collect::<Result<_, _>>()?;
    for round in 0..=plan.rounds {
        observer(if round == 0 { Step::WarmUp } else { Step::Round(round) });
        for turn in 0..contestants.len() {
            // Each is the first, the second ... in turn, whatever that may mean for caches and clocks.
            let place = (turn + round) % contestants.len();
            if !contestants[place].round(round, individuals, cases, &judged, stop)? {
                return Ok(None);
            }
        }
    }
    Ok(Some(Measured {
        cases: cases.len(),
        subjects: judged.iter().map(|judged| judged.subject).collect(),
        runs: contestants.into_iter().map(Contestant::finish).collect(),
    }))
}

/// What the walker says of an individual.
struct Judged {
    subject: Subject,
    answers: Vec<f32>,
}

impl Judged {
    /// `None` if `stop` was set.
    fn of(individual: &Individual, cases: &CaseSet, stop: &AtomicBool) -> Option<Judged> {
        let (width, height) = (cases.width(), cases.height());
        let walker = Walker::new(individual, width, height);
        let mut nodes = 0;
        let mut answers = Vec::with_capacity(cases.len());
        for (case, lane) in cases.lanes().iter().enumerate() {
            if stop.load(Ordering::Relaxed) {
                return None;
            }
            let (walk, evaluated) = walker.walk_and_count(cases.image(case), lane.column as f32);
            nodes += evaluated;
            answers.push(walk.answer());
        }
        let operations = Candidate::new(individual, width, height).program().operations();
        Some(Judged { subject: Subject { operations, nodes }, answers })
    }
}

/// An executor in the measurement.
struct Contestant {
    name: &'static str,
    lowers: bool,
    worker: Box<dyn Worker>,
    rounds: usize,
    /// It is measured on every n-th individual.
    every: usize,
    /// By individual and round.
    timings: Vec<Vec<Timing>>,
    totals: Vec<f64>,
}

impl Contestant {
    fn new(executor: &dyn Executor, individuals: usize, plan: &Plan) -> Result<Contestant, BenchError> {
        let name = executor.name();
        let worker = executor.worker().map_err(|source| BenchError::Worker { executor: name, source })?;
        let (rounds, every) = match is_slow(executor) {
            true => (plan.rounds.min(plan.slow_rounds), plan.slow_every.max(1)),
            false => (plan.rounds, 1),
        };
        let timings = vec![Vec::new(); individuals];
        Ok(Contestant { name, lowers: executor.lowers(), worker, rounds, every, timings, totals: Vec::new() })
    }

    /// Runs a round, 0 being the one that is not counted, but in which every individual is run; `false` if `stop` was
    /// set.
    fn round(
        &mut self,
        round: usize,
        individuals: &[&Individual],
        cases: &CaseSet,
        judged: &[Judged],
        stop: &AtomicBool,
    ) -> Result<bool, BenchError> {
        if round > self.rounds {
            return Ok(true);
        }
        let every = if round == 0 { 1 } else { self.every };
        let mut answers = vec![0.0; cases.len()];
        let mut total = 0.0;
        for (number, (individual, judged)) in individuals.iter().zip(judged).enumerate().step_by(every) {
            if stop.load(Ordering::Relaxed) {
                return Ok(false);
            }
            let candidate = Candidate::new(individual, cases.width(), cases.height());
            let timing = self.worker.answers(&candidate, cases, &mut answers);
            let timing = timing.map_err(|source| BenchError::Program {
                executor: self.name,
                source,
                program: individual.to_string(),
            })?;
            if let Some((case, found, expected)) = difference(&answers, &judged.answers) {
                let program = individual.to_string();
                return Err(BenchError::Disagreement { executor: self.name, case, found, expected, program });
            }
            // What the next one does not write must not pass for an answer.
            answers.fill(f32::from_bits(0x7fc0_beef));
            if round > 0 {
                self.timings[number].push(timing);
                total += together(&timing);
            }
        }
        if round > 0 {
            self.totals.push(total);
        }
        Ok(true)
    }

    fn finish(self) -> Runs {
        let times = self.timings.iter().map(|t| (!t.is_empty()).then(|| Times::of(t))).collect();
        Runs { name: self.name, lowers: self.lowers, rounds: self.rounds, times, totals: self.totals }
    }
}

/// The first case whose answers differ, and both.
fn difference(found: &[f32], expected: &[f32]) -> Option<(usize, f32, f32)> {
    let same = |a: f32, b: f32| a.to_bits() == b.to_bits() || a.is_nan() && b.is_nan();
    let both = found.iter().copied().zip(expected.iter().copied());
    both.enumerate().find(|&(_, (a, b))| !same(a, b)).map(|(case, (a, b))| (case, a, b))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::exec::reference::ReferenceExecutor;
    use crate::exec::tree::TreeExecutor;
    use crate::world::Corridor;

    /// Answers as the reference does, but for one case from its second call on.
    struct Wrong;

    struct WrongWorker(Box<dyn Worker>, usize);

    impl Executor for Wrong {
        fn name(&self) -> &'static str {
            "wrong"
        }
        fn worker(&self) -> Result<Box<dyn Worker>, ExecError> {
            Ok(Box::new(WrongWorker(ReferenceExecutor.worker()?, 0)))
        }
    }

    impl Worker for WrongWorker {
        fn answers(
            &mut self,
            candidate: &Candidate<'_>,
            cases: &CaseSet,
            answers: &mut [f32],
        ) -> Result<Timing, ExecError> {
            let timing = self.0.answers(candidate, cases, answers)?;
            self.1 += 1;
            if self.1 > 1 {
                answers[3] = -answers[3];
            }
            Ok(timing)
        }
    }

    fn cases() -> CaseSet {
        let corridor = Corridor { width: 32, height: 32, ..Corridor::default() };
        corridor.render(1, 2).expect("possible").case_set()
    }

    fn individuals() -> Vec<Individual> {
        let bodies = ["(set-a (+ raw y))", "(set-a (% y 0))", "(if-le raw 90 break (set-a y))"];
        let program = |body| format!("(individual (iterate-up 3x3 x-obstacle {body}))");
        bodies.iter().map(|body| program(body).parse().expect("a program")).collect()
    }

    fn run(executors: &[Arc<dyn Executor>], stop: bool) -> Result<Option<Measured>, BenchError> {
        let individuals = individuals();
        let individuals: Vec<&Individual> = individuals.iter().collect();
        let plan = Plan { rounds: 4, slow_rounds: 2, slow_every: 2 };
        measure(&individuals, &cases(), executors, &plan, &AtomicBool::new(stop), |_| ())
    }

    #[test]
    fn slow_executors_have_less_to_do() {
        let both: [Arc<dyn Executor>; 2] = [Arc::new(TreeExecutor), Arc::new(ReferenceExecutor)];
        let measured = run(&both, false).expect("they agree").expect("nobody stops it");
        for runs in &measured.runs {
            assert_eq!((runs.rounds, runs.totals.len()), (2, 2));
            assert_eq!(runs.times.iter().map(Option::is_some).collect::<Vec<_>>(), [true, false, true]);
        }
        // `set-a`, `+`, `raw` and `y` at each of 30 positions, and the column once, for each case.
        assert_eq!(measured.subjects[0].nodes, (4 * 30 + 1) * cases().len() as u64);
        assert!(measured.runs[1].times[0].expect("measured").lower > 0.0);
        assert!(run(&both, true).expect("no fault").is_none());
    }

    #[test]
    fn a_wrong_answer_ends_it() {
        let error = run(&[Arc::new(Wrong)], false).expect_err("it lies").to_string();
        assert!(error.contains("executor wrong") && error.contains("to case 3,"), "{error}");
        assert!(error.contains("(set-a (% y 0))"), "{error}");
    }

    #[test]
    fn answers_are_compared_by_bits() {
        let nan = f32::from_bits(0x7fc0_0001);
        assert_eq!(difference(&[1.0, f32::NAN], &[1.0, nan]), None);
        assert_eq!(difference(&[1.0, 0.0], &[1.0, -0.0]), Some((1, 0.0, -0.0)));
    }
}
