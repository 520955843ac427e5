//! A run is a pure function of settings and data.

use std::hash::Hasher;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use vsonar::evolve::{Evolution, RunFolder, Settings, SharedSet, State, StopReason};
use vsonar::exec::{Candidate, ExecError, Executor, Timing, Worker};
use vsonar::vision::CaseSet;

use crate::common::*;

#[test]
fn threads_and_executors_change_nothing() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let mut expected = None;
    let mut runs = [None, None];
    for executor in executors() {
        for threads in [1, 2, 5] {
            let name = format!("{}-{threads}", executor.name());
            let path = dir.path().join(&name);
            let state = run_in(&path, &settings(), executor.clone(), threads);
            let executed = executed(&state);
            let expected_runs = runs[usize::from(executor.lowers())].get_or_insert(executed.clone());
            assert_eq!(*expected_runs, executed, "programs run by {name}");
            let found = (state.without_timing(), content(&path));
            match &expected {
                None => expected = Some(found),
                Some(expected) => {
                    assert!(expected.1 == found.1, "log, best or hall of {name} differ");
                    assert!(expected.0 == found.0, "the population of {name} differs");
                }
            }
        }
    }
    // The walker runs every individual, the others every program.
    let [walked, run] = runs.map(|runs| runs.expect("executors of both kinds").iter().sum::<u64>());
    assert!(run < walked / 2, "{run} programs of {walked} individuals");
}

/// Programs, what they solve, and the log, as a number; without what the optimiser made of the programs, which
/// may change, and where the time went.
fn fingerprint(state: &State) -> u64 {
    let mut hash = Fnv(0xcbf2_9ce4_8422_2325);
    for member in &state.population {
        hash.write(member.individual().to_string().as_bytes());
        hash.write(&member.correct().to_le_bytes());
        member.outcome.solved.iter().for_each(|case| hash.write(&[case as u8]));
    }
    for record in &state.records {
        let mut record = record.without_timing();
        (record.operations_before, record.operations_after, record.distinct_optimised) = (None, None, None);
        // What was not in the log yet.
        (record.largest_behaviour, record.case_entropy) = (None, None);
        (record.solved_by_nobody, record.hardest_case) = (None, None);
        // The fields of timing that were there when the number was written down; all are 0.
        let text = serde_json::to_string(&record).expect("JSON").replace(r#""evaluate":0.0,"busy":0.0,"#, "");
        hash.write(text.as_bytes());
    }
    hash.finish()
}

struct Fnv(u64);

impl Hasher for Fnv {
    fn finish(&self) -> u64 {
        self.0
    }
    fn write(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3);
        }
    }
}

/// Pins the third generation of a small run. If it changes, recorded runs no longer repeat: change the number
/// only together with a line in the change log that says why.
#[test]
fn golden_third_generation() {
    let mut settings = settings();
    settings.generations = 3;
    settings.seed = 3;
    let dir = tempfile::tempdir().expect("a temporary folder");
    let state = run_in(&dir.path().join("run"), &settings, reference(), 2);
    assert_eq!(state.records.len(), 3);
    let found = fingerprint(&state);
    assert_eq!(found, 0x21a1_25be_533d_f7b7, "found {found:#018x}");
    // Logarithms have to be the same everywhere too.
    let entropy = state.records[2].case_entropy.expect("counted").to_bits();
    assert_eq!(entropy, 0x3fe7_87c5_e42c_320d, "found {entropy:#018x}");
}

#[test]
fn another_seed_is_another_run() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let mut settings = settings();
    settings.generations = 1;
    let one = run_in(&dir.path().join("1"), &settings, reference(), 2);
    settings.seed = 2;
    let two = run_in(&dir.path().join("2"), &settings, reference(), 2);
    assert!(one.population != two.population);
}

#[test]
fn interrupted_at_every_generation_equals_uninterrupted() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let (whole, parts) = (dir.path().join("whole"), dir.path().join("parts"));
    let expected = run_in(&whole, &settings(), reference(), 2).without_timing();
    drop(RunFolder::create(&parts, &settings(), &toml::Table::new()).expect("a fresh folder"));
    for generation in 0..5 {
        let mut run = resume(&parts);
        assert_eq!(run.generations(), generation);
        let stop = AtomicBool::new(false);
        let reason = run.run(&stop, |_| stop.store(true, Ordering::Relaxed)).expect("no error");
        let last = generation == 4;
        assert_eq!(reason, if last { StopReason::Finished } else { StopReason::Interrupted });
    }
    assert!(resume(&parts).state().expect("a state").without_timing() == expected);
    assert_eq!(content(&parts), content(&whole));
}

/// The reference evaluator, which asks for a stop once it has run so many programs.
struct Impatient {
    left: Arc<AtomicU64>,
    stop: Arc<AtomicBool>,
}

struct ImpatientWorker {
    worker: Box<dyn Worker>,
    left: Arc<AtomicU64>,
    stop: Arc<AtomicBool>,
}

impl Executor for Impatient {
    fn name(&self) -> &'static str {
        "impatient"
    }

    fn worker(&self) -> Result<Box<dyn Worker>, ExecError> {
        let worker = reference().worker()?;
        Ok(Box::new(ImpatientWorker { worker, left: self.left.clone(), stop: self.stop.clone() }))
    }
}

impl Worker for ImpatientWorker {
    fn answers(
        &mut self,
        candidate: &Candidate<'_>,
        cases: &CaseSet,
        answers: &mut [f32],
    ) -> Result<Timing, ExecError> {
        let less = self.left.fetch_update(Ordering::Relaxed, Ordering::Relaxed, |left| left.checked_sub(1));
        if less.is_err() {
            self.stop.store(true, Ordering::Relaxed);
        }
        self.worker.answers(candidate, cases, answers)
    }
}

#[test]
fn interrupted_within_generations_equals_uninterrupted() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let (whole, parts) = (dir.path().join("whole"), dir.path().join("parts"));
    let expected = run_in(&whole, &settings(), reference(), 2).without_timing();
    drop(RunFolder::create(&parts, &settings(), &toml::Table::new()).expect("a fresh folder"));
    let mut interruptions = 0;
    // The flag is raised after ever more programs; a process that gets through goes on to the end.
    for patience in (0u64..).map(|i| 4 * i * i) {
        let stop = Arc::new(AtomicBool::new(false));
        let executor = Arc::new(Impatient { left: Arc::new(AtomicU64::new(patience)), stop: stop.clone() });
        let (folder, settings) = RunFolder::open(&parts).expect("a run folder");
        let mut run = Evolution::in_folder(folder, &dataset(), settings, executor, 2).expect("a run");
        if run.run(&stop, |_| ()).expect("no error") == StopReason::Finished {
            break;
        }
        interruptions += 1;
    }
    assert!(interruptions > 3, "only {interruptions} interruptions");
    assert!(resume(&parts).state().expect("a state").without_timing() == expected);
    assert_eq!(content(&parts), content(&whole));
}

#[test]
fn more_generations_on_resume_equal_a_longer_run() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let (long, grown) = (dir.path().join("long"), dir.path().join("grown"));
    let expected = run_in(&long, &settings(), reference(), 2).without_timing();
    let mut short = settings();
    short.generations = 2;
    run_in(&grown, &short, reference(), 1);
    let (folder, recorded) = RunFolder::open(&grown).expect("a run folder");
    assert_eq!(recorded, short);
    let settings = recorded.extended(5).expect("more is allowed");
    let mut run = Evolution::in_folder(folder, &dataset(), settings, reference(), 3).expect("a run");
    assert_eq!(run.run(&never(), |_| ()).expect("no error"), StopReason::Finished);
    assert!(run.state().expect("a state").without_timing() == expected);
    drop(run);
    assert_eq!(content(&grown), content(&long));
    assert_eq!(read(&grown, "settings.toml"), read(&long, "settings.toml"));
}

#[test]
fn runs_that_share_a_set_are_as_if_alone() {
    let data = dataset();
    let executor: Arc<dyn Executor> = Arc::new(vsonar::exec::batch::BatchExecutor::widest());
    let mut altered = settings();
    (altered.seed, altered.augmentation.mirror) = (3, 0.5);
    let all = [settings(), Settings { seed: 2, tolerance: 8.0, ..settings() }, altered];
    // Alone, each on a set of its own; together, at the same time on one, whose strips are soon forgotten or never kept.
    let finish = |mut run: Evolution| {
        assert_eq!(run.run(&never(), |_| ()).expect("no error"), StopReason::Finished);
        let state = run.state().expect("a state");
        (state.without_timing(), executed(state))
    };
    let alone = |settings: &Settings| {
        finish(Evolution::new(&data, settings.clone(), executor.clone(), 2).expect("a run"))
    };
    let expected = all.each_ref().map(alone);
    for strips in [SharedSet::STRIP_BYTES, 1 << 16, 0] {
        let shared = SharedSet::new(&data).keep_strips(strips);
        let together = |settings: &Settings| {
            finish(Evolution::on(&shared, settings.clone(), executor.clone(), 2).expect("a run"))
        };
        let found = std::thread::scope(|scope| {
            let together = &together;
            let runs = all.each_ref().map(|settings| scope.spawn(move || together(settings)));
            runs.map(|run| run.join().expect("no panic"))
        });
        assert!(found == expected, "with {strips} bytes of strips");
        let best = &found[1].0.hall_of_fame.best().expect("there is one");
        let score = shared.score(&best.individual, executor.clone(), 8.0).expect("it can be run");
        assert_eq!(score.correct, best.correct);
    }
}
