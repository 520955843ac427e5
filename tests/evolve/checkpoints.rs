//! Checkpoints: a whole one is read back exactly, anything else is refused.

use std::fs;
use std::path::Path;

use vsonar::dataset::Dataset;
use vsonar::evolve::checkpoint::{self, CheckpointError, Origin};
use vsonar::evolve::{Evolution, FolderError, HallOfFame, Record, RunError, RunFolder, Settings, State};

use crate::common::*;

const ORIGIN: Origin = Origin { settings: 1, data: 2 };

fn small_state() -> State {
    let mut settings = settings();
    settings.population = 7;
    settings.generations = 2;
    settings.filter.enabled = false;
    let mut run = Evolution::new(&dataset(), settings, reference(), 1).expect("a run");
    run.run(&never(), |_| ()).expect("no error");
    run.state().expect("a state").clone()
}

fn decode(bytes: &[u8]) -> Result<State, CheckpointError> {
    checkpoint::decode(bytes, ORIGIN, Path::new("runs/x/checkpoint"))
}

#[test]
fn round_trip() {
    let state = small_state();
    assert!(decode(&checkpoint::encode(&state, ORIGIN)).expect("sound") == state);
}

/// Releases that did not count operations wrote such lines; a checkpoint holds them as they stand in the log.
#[test]
fn records_of_earlier_releases() {
    let timing = r#"{"lower":0.5,"compile":0.25,"execute":2.5,"breed":0.0,"record":0.125,"save":0.0,"wall":1.5,"executed":9,"ms_per_uncached":0.5}"#;
    let mut state = small_state();
    let Record { best_fitness: best, best_fitness_so_far: so_far, max_nodes: most, .. } = state.records[0];
    let line = format!(
        r#"{{"generation":0,"best_fitness":{best},"mean_fitness":0.0,"median_fitness":0.0,"best_fitness_so_far":{so_far},"evaluations":7,"evaluations_total":7,"best_nodes":3,"mean_nodes":3.5,"max_nodes":{most},"mean_depth":2.5,"max_depth":9,"distinct_programs":7,"distinct_behaviours":3,"constant_share":0.0,"initial":{{"draws":7,"unfit_kept":0}},"timing":{timing}}}"#
    );
    let record: Record = serde_json::from_str(&line).expect("a record");
    assert_eq!((record.operations_before, record.operations_after), (None, None));
    assert_eq!((record.distinct_optimised, record.timing.evaluate, record.timing.busy), (None, 0.0, 0.0));
    assert_eq!((record.case_entropy, record.hardest_case, record.warning), (None, None, None));
    state.records[0] = record.clone();
    let read = decode(&checkpoint::encode(&state, ORIGIN)).expect("sound");
    assert!(read == state);
    // What was not counted is not made up when the log is written again.
    let again = serde_json::to_value(&read.records[0]).expect("JSON");
    assert!(again.get("operations_before").is_none() && again.get("distinct_optimised").is_none());
    for field in ["largest_behaviour", "case_entropy", "solved_by_nobody", "hardest_case", "warning"] {
        assert!(again.get(field).is_none(), "{field}");
    }
}

/// A run begun by such a release goes on, and only its earlier records lack the numbers.
#[test]
fn a_run_of_an_earlier_release_goes_on() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let (whole, begun) = (dir.path().join("whole"), dir.path().join("begun"));
    let expected = run_in(&whole, &settings(), reference(), 2).without_timing();
    let mut short = settings();
    short.generations = 2;
    let mut state = run_in(&begun, &short, reference(), 2);
    for record in &mut state.records {
        (record.operations_before, record.operations_after, record.distinct_optimised) = (None, None, None);
        (record.largest_behaviour, record.case_entropy) = (None, None);
        (record.solved_by_nobody, record.hardest_case) = (None, None);
    }
    let origin = Origin { settings: short.fingerprint(), data: dataset().fingerprint() };
    fs::write(begun.join("checkpoint"), checkpoint::encode(&state, origin)).expect("writable");
    let (folder, recorded) = RunFolder::open(&begun).expect("a run folder");
    let longer = recorded.extended(5).expect("more is allowed");
    let mut run = Evolution::in_folder(folder, &dataset(), longer, reference(), 2).expect("a run");
    run.run(&never(), |_| ()).expect("no error");
    let found = run.state().expect("a state").without_timing();
    assert!(found.population == expected.population && found.records[2..] == expected.records[2..]);
    assert!(found.records[..2].iter().all(|r| r.operations_before.is_none()));
}

#[test]
fn cut_anywhere() {
    let bytes = checkpoint::encode(&small_state(), ORIGIN);
    for len in 0..bytes.len() {
        let error = decode(&bytes[..len]).expect_err("cut").to_string();
        assert!(
            error.contains("runs/x/checkpoint") && error.contains("start the run again"),
            "{len}: {error}"
        );
    }
    assert!(matches!(decode(&[&bytes[..], b"x"].concat()), Err(CheckpointError::Length { .. })));
}

#[test]
fn any_flipped_byte() {
    let bytes = checkpoint::encode(&small_state(), ORIGIN);
    for i in 0..bytes.len() {
        let mut changed = bytes.clone();
        changed[i] ^= 1 << (i % 8);
        let error = decode(&changed).expect_err("changed");
        match i {
            0..8 => assert!(matches!(error, CheckpointError::Magic(_)), "{i}: {error}"),
            8..12 => assert!(matches!(error, CheckpointError::Version { .. }), "{i}: {error}"),
            12..20 => assert!(matches!(error, CheckpointError::Length { .. }), "{i}: {error}"),
            _ => assert!(matches!(error, CheckpointError::Damaged { .. }), "{i}: {error}"),
        }
    }
}

/// Changes that carry a right checksum: whatever they decode to, it is no panic.
#[test]
fn nonsense_with_a_right_checksum() {
    let bytes = checkpoint::encode(&small_state(), ORIGIN);
    let mut refused = 0;
    for i in 24..bytes.len() {
        for bit in 0..8 {
            let mut changed = bytes.clone();
            changed[i] ^= 1 << bit;
            let checksum = crc32fast::hash(&changed[24..]);
            changed[20..24].copy_from_slice(&checksum.to_le_bytes());
            refused += usize::from(decode(&changed).is_err());
        }
    }
    assert!(refused > bytes.len() / 2);
}

/// A change to a state that makes it contradict itself, and what is said of it.
type Change = (fn(&mut State), &'static str);

/// Checkpoints of a right checksum whose parts do not fit together.
#[test]
fn contradictions_are_refused() {
    let state = small_state();
    assert_eq!(state.records.len(), 2);
    let changes: &[Change] = &[
        (|s| s.records.truncate(1), "generation 0: "),
        (|s| s.records.rotate_left(1), "record 0 is of generation 1"),
        (|s| s.records[0].generation = 4_000_000_000, "record 0 is of generation 4000000000"),
        (|s| s.records[1].generation = 0, "record 1 is of generation 0"),
        (|s| s.records.push(s.records[1].clone()), "record 2 is of generation 1"),
        (|s| s.hall_of_fame = HallOfFame::default(), "the hall of fame is empty"),
        (|s| s.records[0].best_fitness = 7.0, "generation 0: best_fitness is 7, but must be 0 to 1"),
        (|s| s.records[1].mean_fitness = -0.5, "generation 1: mean_fitness is -0.5"),
        (|s| s.records[0].mean_fitness = 1.0, "generation 0: mean_fitness is 1"),
        (|s| s.records[0].mean_depth = 1e308, "generation 0: mean_depth is 1"),
        (|s| s.records[0].mean_nodes = 1e300, "generation 0: mean_nodes is 1"),
        (|s| s.records[0].distinct_programs = 8, "distinct_programs is 8, but must be 1 to 7"),
        (|s| s.records[1].case_entropy = Some(1.5), "case_entropy is 1.5"),
        (|s| s.records[1].solved_by_nobody = Some(1_000_000), "solved_by_nobody is 1000000"),
        (|s| s.records[1].timing.wall = -1.0, "generation 1: timing.wall is -1"),
        (|s| s.records[1].evaluations_total += 1, "evaluations_total"),
        (|s| s.records[0].evaluations = u64::MAX, "generation 0: evaluations is 1"),
        (|s| s.records[0].evaluations += 1, "evaluations_total"),
        (|s| s.records[1].case_entropy = Some(0.123), "by its population"),
        (|s| s.records[1].largest_behaviour = Some(0.987), "by its population"),
        (|s| s.population.iter_mut().for_each(|m| m.outcome.behaviour = 0), "by its population"),
        (|s| s.records[1].best_fitness_so_far = 1.0, "best_fitness_so_far is 1"),
        (|s| s.records[1].max_nodes += 1, "generation 1: max_nodes"),
        (|s| s.records[1].max_depth += 1, "by its population"),
        (|s| drop(s.population.pop()), "generation "),
        (|s| s.population.push(s.population[0].clone()), "generation 1: "),
        (
            |s| {
                let mut hall = HallOfFame::default();
                s.hall_of_fame.entries().iter().for_each(|e| hall.offer(&e.individual, e.correct, 9));
                s.hall_of_fame = hall;
            },
            "but the run has not come so far",
        ),
        (
            |s| {
                let best = s.hall_of_fame.best().expect("one").clone();
                s.hall_of_fame.offer(&best.individual, 1_000, 1);
            },
            "solves 1000 cases since generation 1, but there are fewer",
        ),
        (
            |s| {
                let best = s.hall_of_fame.best().expect("one").clone();
                s.hall_of_fame.offer(&best.individual, best.correct + 1, 1);
            },
            "but nobody did in that generation",
        ),
    ];
    for (change, said) in changes {
        let mut changed = state.clone();
        change(&mut changed);
        let error = decode(&checkpoint::encode(&changed, ORIGIN)).expect_err(said);
        let text = error.to_string();
        assert!(matches!(error, CheckpointError::Contradiction { .. }), "{said}: {text}");
        assert!(
            text.contains(said) && text.contains("start the run again in a new folder"),
            "{said}: {text}"
        );
    }
}

/// Checkpoints that are sound by themselves, of a run with other settings or data.
#[test]
fn a_checkpoint_has_to_fit_its_run() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let mut own = settings();
    own.generations = 2;
    let state = run_in(&dir.path().join("run"), &own, reference(), 1);
    let with = |change: fn(&mut Settings)| {
        let mut other = own.clone();
        change(&mut other);
        other
    };
    // The settings that the checkpoint is put to, and what is said.
    for (number, (other, said)) in [
        (with(|s| s.population = 61), "there are 60 individuals, but the settings ask for 61"),
        (with(|s| s.trees = 1), "2 trees, but the settings ask for 1"),
        (
            with(|s| {
                (s.creation.max_depth, s.creation.column_depth, s.breeding.max_depth) = (2, 1, 2);
            }),
            "but the settings allow 2",
        ),
        (
            with(|s| s.nodes.edit("-x-obstacle").expect("an edit")),
            "the node `x-obstacle`, which the settings leave out",
        ),
    ]
    .into_iter()
    .enumerate()
    {
        let mut other = other;
        other.creation.plain_column_probability = 0.0;
        let path = dir.path().join(number.to_string());
        drop(RunFolder::create(&path, &other, &toml::Table::new()).expect("a fresh folder"));
        let origin = Origin { settings: other.fingerprint(), data: dataset().fingerprint() };
        fs::write(path.join("checkpoint"), checkpoint::encode(&state, origin)).expect("writable");
        let (folder, recorded) = RunFolder::open(&path).expect("a run folder");
        let error = Evolution::in_folder(folder, &dataset(), recorded, reference(), 1).err().expect(said);
        assert!(error.to_string().contains(said), "{said}: {error}");
        assert!(
            matches!(error, RunError::Folder(FolderError::Checkpoint(CheckpointError::Contradiction { .. }))),
            "{error}"
        );
    }
    // On fewer cases.
    let path = dir.path().join("cases");
    drop(RunFolder::create(&path, &own, &toml::Table::new()).expect("a fresh folder"));
    let all = dataset();
    let fewer = Dataset::new("fewer", all.images().to_vec(), all.cases()[1..].to_vec()).expect("a sound set");
    let origin = Origin { settings: own.fingerprint(), data: fewer.fingerprint() };
    fs::write(path.join("checkpoint"), checkpoint::encode(&state, origin)).expect("writable");
    let (folder, recorded) = RunFolder::open(&path).expect("a run folder");
    let error = Evolution::in_folder(folder, &fewer, recorded, reference(), 1).err().expect("fewer cases");
    assert!(error.to_string().contains("evaluated on 24 cases, but there are 23 training cases"), "{error}");
}

#[test]
fn other_version() {
    let mut bytes = checkpoint::encode(&small_state(), ORIGIN);
    bytes[8..12].copy_from_slice(&(checkpoint::VERSION + 1).to_le_bytes());
    let error = decode(&bytes).expect_err("another version").to_string();
    assert!(error.contains("has version 2") && error.contains("reads version 1"), "{error}");
}

#[test]
fn other_data_and_other_settings() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let path = dir.path().join("run");
    let mut small = settings();
    small.generations = 1;
    run_in(&path, &small, reference(), 1);

    let (folder, recorded) = RunFolder::open(&path).expect("a run folder");
    let error =
        Evolution::in_folder(folder, &dataset_with(1), recorded, reference(), 1).err().expect("other data");
    assert!(
        matches!(error, RunError::Folder(FolderError::Checkpoint(CheckpointError::OtherData(_)))),
        "{error}"
    );

    let text = read(&path, "settings.toml").replace("tournament = 7", "tournament = 3");
    fs::write(path.join("settings.toml"), text).expect("writable");
    let (folder, changed) = RunFolder::open(&path).expect("a run folder");
    assert_eq!(changed.selection.tournament, 3);
    let error =
        Evolution::in_folder(folder, &dataset(), changed, reference(), 1).err().expect("other settings");
    assert!(
        matches!(error, RunError::Folder(FolderError::Checkpoint(CheckpointError::OtherSettings(_)))),
        "{error}"
    );
}
