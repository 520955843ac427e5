//! Runs on altered copies of the training images beside these.

use std::path::Path;
use std::sync::Arc;

use vsonar::evolve::{
    Augmentation, Evolution, FolderError, RunError, RunFolder, SelectionKind, Settings, State,
};
use vsonar::exec::Executor;

use crate::common::*;

fn augmented() -> Settings {
    let mut settings = settings();
    settings.augmentation = Augmentation {
        variants: 2,
        mirror: 0.5,
        brightness: 20.0,
        noise: 3.0,
        shift_x: 4,
        ..Augmentation::OFF
    };
    settings
}

fn finished(settings: &Settings, executor: Arc<dyn Executor>, threads: usize) -> Evolution {
    let mut run = Evolution::new(&dataset(), settings.clone(), executor, threads).expect("a run");
    run.run(&never(), |_| ()).expect("no error");
    run
}

#[test]
fn threads_and_executors_change_nothing() {
    let mut expected: Option<State> = None;
    for executor in executors() {
        for threads in [1, 3] {
            let run = finished(&augmented(), executor.clone(), threads);
            let state = run.state().expect("a state").without_timing();
            assert!(*expected.get_or_insert(state.clone()) == state, "{} on {threads}", executor.name());
        }
    }
}

#[test]
fn selection_sees_all_cases_and_the_record_tells_both() {
    let run = finished(&augmented(), reference(), 2);
    let state = run.state().expect("a state");
    let grown = augmented().variation().grow(&dataset(), 1);
    let (all, given) = (grown.cases().len(), dataset().cases().len());
    assert!(all > 2 * given);
    assert!(state.population.iter().all(|member| member.outcome.solved.len() == all));
    let record = state.records.last().expect("records");
    let best = state
        .population
        .iter()
        .max_by(|a, b| (a.correct(), b.individual().len()).cmp(&(b.correct(), a.individual().len())));
    let best = best.expect("members");
    assert_eq!(record.best_fitness, f64::from(best.correct()) / all as f64);
    let unaltered = run.score(best.individual(), &dataset()).expect("no error");
    assert_eq!(record.best_fitness_unaltered, Some(unaltered.fitness));
    assert_eq!(unaltered.cases as usize, given);
    // The summary is of the training images as they are, and of all.
    let summary = run.summary(Some(&dataset())).expect("no error").expect("generations");
    assert_eq!(Some(summary.train), summary.holdout);
    let everything = run.score(&summary.best, &grown).expect("no error");
    assert_eq!(summary.augmented, Some(everything));
    assert_eq!(everything.fitness, record.best_fitness_so_far);

    let plain = finished(&settings(), reference(), 2);
    assert_eq!(plain.summary(None).expect("no error").expect("generations").augmented, None);
    let line = serde_json::to_string(&plain.state().expect("a state").records[0]).expect("JSON");
    assert!(!line.contains("unaltered"), "{line}");
}

/// The filter asks for different answers on the images as they are: copies in other columns make none of them.
#[test]
fn copies_change_nothing_of_the_initial_individuals() {
    let first = |settings: &Settings| {
        let run = finished(&Settings { generations: 1, ..settings.clone() }, reference(), 2);
        let state = run.state().expect("a state");
        let individuals: Vec<String> =
            state.population.iter().map(|member| member.individual().to_string()).collect();
        (individuals, state.records[0].initial)
    };
    assert_eq!(first(&augmented()), first(&settings()));
}

#[test]
fn a_resumed_run_has_the_same_copies() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let (whole, begun) = (dir.path().join("whole"), dir.path().join("begun"));
    run_in(&whole, &augmented(), reference(), 2);
    run_in(&begun, &Settings { generations: 2, ..augmented() }, reference(), 1);
    let (folder, settings) = RunFolder::open(&begun).expect("a run folder");
    let settings = settings.extended(5).expect("more");
    let mut run = Evolution::in_folder(folder, &dataset(), settings, reference(), 2).expect("a run");
    run.run(&never(), |_| ()).expect("no error");
    drop(run);
    assert!(content(&whole) == content(&begun));
    let best = read(&whole, "best.gp");
    let copies = augmented().variation().grow(&dataset(), 1).cases().len() - dataset().cases().len();
    assert!(best.contains(&format!("({copies} of them of altered copies)")), "{best}");
    // Other copies are other training data.
    let settings = read(&begun, "settings.toml").replace("brightness = 20.0", "brightness = 30.0");
    std::fs::write(begun.join("settings.toml"), settings).expect("writable");
    let (folder, settings) = RunFolder::open(&begun).expect("a run folder");
    let error = Evolution::in_folder(folder, &dataset(), settings, reference(), 2).err().expect("refused");
    assert!(matches!(error, RunError::Folder(FolderError::Checkpoint(_))), "{error}");
}

/// The folder of a release that did not augment: its settings lack the table.
#[test]
fn a_run_of_an_earlier_release_goes_on() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let (whole, begun) = (dir.path().join("whole"), dir.path().join("begun"));
    run_in(&whole, &settings(), reference(), 2);
    run_in(&begun, &Settings { generations: 2, ..settings() }, reference(), 2);
    let text = read(&begun, "settings.toml");
    let (before, table) = text.split_once("[augmentation]").expect("every setting in full");
    let (_, after) = table.split_once("\n[").expect("nodes follow");
    std::fs::write(begun.join("settings.toml"), format!("{before}\n[{after}")).expect("writable");
    let (folder, settings) = RunFolder::open(Path::new(&begun)).expect("a run folder");
    assert_eq!(settings.augmentation, Augmentation::OFF);
    let settings = settings.extended(5).expect("more");
    let mut run = Evolution::in_folder(folder, &dataset(), settings, reference(), 2).expect("goes on");
    run.run(&never(), |_| ()).expect("no error");
    drop(run);
    assert!(content(&whole) == content(&begun));
}

/// What checkpoints of releases that did not augment hold as the fingerprint of what was the default then.
#[test]
fn the_fingerprint_without_augmentation_stays() {
    let mut settings_then = Settings::paper();
    (settings_then.creation.plain_column_probability, settings_then.filter.enabled) = (0.7, true);
    settings_then.selection.kind = SelectionKind::Sharing;
    assert_eq!(settings_then.fingerprint(), FINGERPRINT);
    assert_ne!(augmented().fingerprint(), settings().fingerprint());
}

const FINGERPRINT: u64 = 17032393430529293151;
