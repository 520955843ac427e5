//! What is run and what is known: the cache saves time and changes nothing.

use std::collections::HashSet;
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex, PoisonError};

use vsonar::evolve::{EvaluateError, Evolution, RunError, Settings, State};
use vsonar::exec::tree::TreeExecutor;
use vsonar::exec::{Candidate, ExecError, Executor, Timing, Worker};
use vsonar::ir::Program;
use vsonar::vision::CaseSet;

use crate::common::*;

/// An executor that notes whom it runs, and refuses programs on which `refuses` says yes.
struct Spy {
    executor: Arc<dyn Executor>,
    runs: Arc<Mutex<Vec<Run>>>,
    refuses: fn(&Program) -> bool,
}

#[derive(Clone)]
struct Run {
    individual: String,
    program: String,
}

struct SpyWorker {
    worker: Box<dyn Worker>,
    runs: Arc<Mutex<Vec<Run>>>,
    refuses: fn(&Program) -> bool,
}

impl Spy {
    fn on(executor: Arc<dyn Executor>) -> Spy {
        Spy { executor, runs: Arc::default(), refuses: |_| false }
    }
}

/// The notes since this was last asked.
fn taken(runs: &Mutex<Vec<Run>>) -> Vec<Run> {
    std::mem::take(&mut runs.lock().unwrap_or_else(PoisonError::into_inner))
}

impl Executor for Spy {
    fn name(&self) -> &'static str {
        "spy"
    }

    fn lowers(&self) -> bool {
        self.executor.lowers()
    }

    fn worker(&self) -> Result<Box<dyn Worker>, ExecError> {
        let worker = self.executor.worker()?;
        Ok(Box::new(SpyWorker { worker, runs: self.runs.clone(), refuses: self.refuses }))
    }
}

impl Worker for SpyWorker {
    fn answers(
        &mut self,
        candidate: &Candidate<'_>,
        cases: &CaseSet,
        answers: &mut [f32],
    ) -> Result<Timing, ExecError> {
        if (self.refuses)(candidate.program()) {
            return Err(ExecError::Compile("refused".to_string()));
        }
        let (individual, program) = (candidate.individual().to_string(), candidate.program().to_string());
        self.runs.lock().unwrap_or_else(PoisonError::into_inner).push(Run { individual, program });
        self.worker.answers(candidate, cases, answers)
    }
}

fn unfiltered() -> Settings {
    let mut settings = settings();
    settings.filter.enabled = false;
    settings
}

fn texts(state: &State) -> Vec<String> {
    state.population.iter().map(|m| m.individual().to_string()).collect()
}

/// Steps through a run; `each` is told of the texts of the parents (none for the initial generation), the state
/// and who was run.
fn step_through(
    settings: Settings,
    executor: Arc<dyn Executor>,
    mut each: impl FnMut(&[String], &State, &[Run]),
) {
    let spy = Spy::on(executor);
    let runs = spy.runs.clone();
    let mut run = Evolution::new(&dataset(), settings.clone(), Arc::new(spy), 2).expect("a run");
    let mut parents = Vec::new();
    for _ in 0..settings.generations {
        run.step(&never()).expect("no error").expect("not stopped");
        let state = run.state().expect("a state");
        each(&parents, state, &taken(&runs));
        parents = texts(state);
    }
}

#[test]
fn copies_are_never_run() {
    let mut copied = 0;
    step_through(settings(), Arc::new(TreeExecutor), |parents, state, runs| {
        if parents.is_empty() {
            return;
        }
        let walked: HashSet<&String> = runs.iter().map(|run| &run.individual).collect();
        assert_eq!(walked.len(), runs.len(), "an individual was walked twice");
        assert!(parents.iter().all(|parent| !walked.contains(parent)), "a parent was walked again");
        let members = texts(state);
        let new: HashSet<&String> = members.iter().filter(|member| !parents.contains(member)).collect();
        assert_eq!(new, walked);
        copied += members.iter().filter(|member| parents.contains(member)).count();
    });
    assert!(copied > 20, "{copied} copies");
}

#[test]
fn reproduction_alone_runs_nothing() {
    let mut settings = settings();
    settings.breeding.crossover_probability = 0.0;
    for executor in executors() {
        step_through(settings.clone(), executor, |parents, state, runs| {
            let record = state.records.last().expect("records");
            if parents.is_empty() {
                assert!(!runs.is_empty());
                return;
            }
            assert_eq!((runs.len(), record.evaluations, record.timing.executed), (0, 0, 0));
            let numbers = (record.operations_before, record.operations_after, record.distinct_optimised);
            assert_eq!(numbers, (Some(0.0), Some(0.0), Some(0)));
        });
    }
}

#[test]
fn a_program_is_run_once() {
    let mut met = HashSet::new();
    step_through(unfiltered(), reference(), |_, state, runs| {
        assert_eq!(runs.len() as u64, state.records.last().expect("records").timing.executed);
        for run in runs {
            assert!(met.insert(run.program.clone()), "run again: {}", run.program);
        }
    });
}

/// Draws ahead are run, but do not count.
#[test]
fn no_more_counts_than_was_run() {
    let (mut counted, mut run) = (0, 0);
    for seed in 1..=8 {
        let mut settings = settings();
        (settings.seed, settings.population, settings.generations) = (seed, 10, 1);
        step_through(settings, reference(), |_, state, runs| {
            let record = &state.records[0];
            assert!(record.timing.executed <= runs.len() as u64);
            assert!(record.distinct_optimised.expect("counted") >= record.timing.executed);
            counted += record.timing.executed;
            run += runs.len() as u64;
        });
    }
    assert!(counted < run, "nothing was drawn ahead");
}

/// The fewer slots there are, the more each draws ahead.
#[test]
fn drawing_ahead_changes_nothing() {
    let first = |population: u32| {
        let mut settings = settings();
        (settings.population, settings.generations) = (population, 1);
        let mut run = Evolution::new(&dataset(), settings, reference(), 2).expect("a run");
        run.run(&never(), |_| ()).expect("no error");
        run.state().expect("a state").clone()
    };
    let many = first(300);
    let mut draws = 0;
    for population in [2, 3, 70] {
        let few = first(population);
        assert!(few.population[..] == many.population[..population as usize], "of {population}");
        let initial = few.records[0].initial.expect("of the initial generation");
        assert!(initial.draws > draws && initial.draws < many.records[0].evaluations);
        draws = initial.draws;
    }
}

#[test]
fn records_count_operations() {
    let (mut all_operations, mut all_programs) = (0, 0);
    step_through(unfiltered(), reference(), |parents, state, _| {
        let mut met: HashSet<String> = parents.iter().cloned().collect();
        let (mut before, mut after, mut programs, mut count) = (0, 0, HashSet::new(), 0);
        for member in &state.population {
            let new = met.insert(member.individual().to_string());
            // Of the initial generation every draw counts.
            if new || parents.is_empty() {
                let candidate = Candidate::new(member.individual(), WIDTH, HEIGHT);
                before += candidate.operations_before();
                after += candidate.program().operations();
                programs.insert(candidate.program().to_string());
                count += 1;
            }
        }
        let record = state.records.last().expect("records");
        assert_eq!(record.operations_before, Some(before as f64 / f64::from(count)));
        assert_eq!(record.operations_after, Some(after as f64 / f64::from(count)));
        assert_eq!(record.distinct_optimised, Some(programs.len() as u64));
        all_operations += after;
        all_programs += programs.len();
    });
    assert!(all_programs > 20 && all_operations > 20, "{all_programs} programs, {all_operations} operations");
}

#[test]
fn a_small_cache_changes_nothing_but_what_is_run() {
    let run = |bytes: Option<usize>, threads: usize| {
        let mut run = Evolution::new(&dataset(), settings(), reference(), threads).expect("a run");
        bytes.into_iter().for_each(|bytes| run.limit_cache(bytes));
        run.run(&never(), |_| ()).expect("no error");
        let state = run.state().expect("a state").clone();
        (executed(&state), state.without_timing())
    };
    let (roomy, expected) = run(None, 2);
    let mut last = roomy.iter().sum::<u64>();
    for bytes in [16_000, 4_000, 0] {
        let (cramped, state) = run(Some(bytes), 1);
        assert!(state == expected, "{bytes} bytes");
        let runs = cramped.iter().sum::<u64>();
        assert!(runs > last, "{bytes} bytes: {runs} programs, {last} with more room");
        last = runs;
        for threads in [2, 5] {
            assert_eq!(run(Some(bytes), threads).0, cramped, "{bytes} bytes, {threads} threads");
        }
    }
}

/// Of several programs that fail the first individual's is told of, whatever is run first.
#[test]
fn the_first_failure_is_told() {
    fn refuses(program: &Program) -> bool {
        program.operations() % 3 == 1
    }
    let mut settings = unfiltered();
    (settings.creation.min_depth, settings.creation.max_depth) = (6, 8);
    (settings.population, settings.generations) = (200, 1);
    let mut sound = Evolution::new(&dataset(), settings.clone(), reference(), 2).expect("a run");
    sound.run(&never(), |_| ()).expect("no error");
    let members = &sound.state().expect("a state").population;
    let refused = members.iter().map(|m| m.individual()).filter(|individual| {
        let candidate = Candidate::new(individual, WIDTH, HEIGHT);
        candidate.program().constant_answer().is_none() && refuses(candidate.program())
    });
    let refused: Vec<String> = refused.map(|individual| individual.to_string()).collect();
    assert!(refused.len() > 10, "{} refused", refused.len());
    for threads in [1, 2, 5] {
        let spy = Spy { refuses, ..Spy::on(reference()) };
        let mut run = Evolution::new(&dataset(), settings.clone(), Arc::new(spy), threads).expect("a run");
        let error = run.run(&AtomicBool::new(false), |_| ()).expect_err("programs are refused");
        let RunError::Evaluate(EvaluateError::Program { executor, program, .. }) = error else {
            panic!("{error}")
        };
        assert_eq!((executor, program), ("spy", refused[0].clone()));
    }
}
