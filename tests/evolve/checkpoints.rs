//! Checkpoints: a whole one is read back exactly, anything else is refused.

use std::fs;
use std::path::Path;

use vsonar::evolve::checkpoint::{self, CheckpointError, Origin};
use vsonar::evolve::{Evolution, FolderError, RunError, RunFolder, State};

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
