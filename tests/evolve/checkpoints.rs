//! Checkpoints: a whole one is read back exactly, anything else is refused.

use std::fs;
use std::path::Path;

use vsonar::evolve::checkpoint::{self, CheckpointError, Origin};
use vsonar::evolve::{Evolution, FolderError, Record, RunError, RunFolder, State};

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
    let line = format!(
        r#"{{"generation":0,"best_fitness":0.5,"mean_fitness":0.25,"median_fitness":0.0,"best_fitness_so_far":0.5,"evaluations":7,"evaluations_total":7,"best_nodes":70,"mean_nodes":12.5,"max_nodes":73,"mean_depth":8.5,"max_depth":9,"distinct_programs":7,"distinct_behaviours":3,"constant_share":0.0,"initial":{{"draws":7,"unfit_kept":0}},"timing":{timing}}}"#
    );
    let record: Record = serde_json::from_str(&line).expect("a record");
    assert_eq!((record.operations_before, record.operations_after), (None, None));
    assert_eq!((record.distinct_optimised, record.timing.evaluate, record.timing.busy), (None, 0.0, 0.0));
    assert_eq!((record.case_entropy, record.hardest_case, record.warning), (None, None, None));
    let mut state = small_state();
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
