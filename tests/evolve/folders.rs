//! Run folders: made fresh, locked, repaired.

use std::fs;

use vsonar::evolve::{Evolution, FolderError, RunError, RunFolder, SettingsError};

use crate::common::*;

#[test]
fn never_overwritten() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let path = dir.path().join("run");
    fs::create_dir(&path).expect("writable");
    fs::write(path.join("precious"), "mine").expect("writable");
    let error = RunFolder::create(&path, &settings(), &toml::Table::new()).expect_err("exists");
    assert!(matches!(error, FolderError::Exists(_)));
    let text = error.to_string();
    assert!(text.contains("--resume") && text.contains("--out"), "{text}");
    assert_eq!(fs::read_dir(&path).expect("readable").count(), 1);
}

#[test]
fn numbered() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let runs = dir.path().join("runs");
    let make = || {
        let folder =
            RunFolder::create_numbered(&runs, "street", &settings(), &toml::Table::new()).expect("a folder");
        folder.path().file_name().expect("a name").to_string_lossy().into_owned()
    };
    assert_eq!([make(), make(), make()], ["street-seed-1", "street-seed-1-2", "street-seed-1-3"]);
}

/// Folders above it are made too, and taken back if the run folder cannot be made.
#[test]
fn nothing_is_left_of_a_folder_that_cannot_be_made() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let create = |path: &str| RunFolder::create(&dir.path().join(path), &settings(), &toml::Table::new());
    fs::create_dir(dir.path().join("run")).expect("writable");
    fs::write(dir.path().join("file"), "mine").expect("writable");
    let entries = || fs::read_dir(dir.path()).expect("readable").count();
    assert!(matches!(create("new/../run"), Err(FolderError::Exists(_))));
    assert_eq!(entries(), 2);
    // No file system has names as long as this.
    create(&format!("a/b/{}", "x".repeat(300))).expect_err("too long");
    create("a/../file/run").expect_err("below a file");
    assert_eq!(entries(), 2);
    // What others have put there meanwhile stays.
    let folder = create("a/b/run").expect("a fresh folder");
    let made = folder.made();
    drop(folder);
    fs::write(dir.path().join("a/other"), "theirs").expect("writable");
    made.take_back();
    assert!(!dir.path().join("a/b").exists() && dir.path().join("a/other").exists());
    // A folder that is only opened was made by somebody else.
    drop(create("c/run").expect("a fresh folder"));
    let (opened, _) = RunFolder::open(&dir.path().join("c/run")).expect("a run folder");
    opened.made().take_back();
    assert!(dir.path().join("c/run/settings.toml").exists());
}

#[test]
fn locked_while_in_use() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let path = dir.path().join("run");
    let folder = RunFolder::create(&path, &settings(), &toml::Table::new()).expect("a fresh folder");
    assert!(matches!(RunFolder::open(&path), Err(FolderError::Locked(_))));
    drop(folder);
    RunFolder::open(&path).expect("free again");
}

#[test]
fn no_run_folder() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    assert!(matches!(RunFolder::open(dir.path()), Err(FolderError::NotARun(_))));
    assert!(matches!(RunFolder::open(&dir.path().join("none")), Err(FolderError::NotARun(_))));
    assert_eq!(fs::read_dir(dir.path()).expect("readable").count(), 0);
}

#[test]
fn settings_and_data_are_kept() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let path = dir.path().join("run");
    let data: toml::Table = "train = \"shared/data/street\"\nfingerprint = \"12\"".parse().expect("TOML");
    drop(RunFolder::create(&path, &settings(), &data).expect("a fresh folder"));
    let (folder, kept) = RunFolder::open(&path).expect("a run folder");
    assert_eq!((folder.data(), &kept), (&data, &settings()));

    let text = read(&path, "settings.toml") + "surprise = 1\n[more]\n";
    fs::write(path.join("settings.toml"), text).expect("writable");
    drop(folder);
    let error = RunFolder::open(&path).expect_err("unknown table").to_string();
    assert!(error.contains("settings.toml:") && error.contains("more"), "{error}");
}

/// However log, best and hall of fame were left, resuming makes them what the checkpoint says.
#[test]
fn repaired_from_the_checkpoint() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let path = dir.path().join("run");
    run_in(&path, &settings(), reference(), 2);
    let expected = content(&path);
    let log = read(&path, "log.jsonl");
    let cut = &log[..log.len() - 30];
    let twice = format!("{log}{}\n", log.lines().last().expect("lines"));
    for damaged in ["", cut, &twice, "rubbish"] {
        fs::write(path.join("log.jsonl"), damaged).expect("writable");
        fs::remove_file(path.join("best.gp")).expect("there");
        fs::write(path.join("hall_of_fame.jsonl"), "half").expect("writable");
        // As a process leaves it that is killed.
        let left = path.join(".checkpoint.0123456789abcdef.tmp");
        fs::write(&left, "half").expect("writable");
        drop(resume(&path));
        assert_eq!(content(&path), expected);
        assert!(!left.exists());
    }
}

/// A run that ended before its first checkpoint begins again.
#[test]
fn without_a_checkpoint_from_the_beginning() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let (whole, again) = (dir.path().join("whole"), dir.path().join("again"));
    run_in(&whole, &settings(), reference(), 2);
    drop(RunFolder::create(&again, &settings(), &toml::Table::new()).expect("a fresh folder"));
    fs::write(again.join("log.jsonl"), "a line that had no checkpoint\n").expect("writable");
    resume(&again).run(&never(), |_| ()).expect("no error");
    assert_eq!(content(&again), content(&whole));
}

#[test]
fn other_settings_are_refused() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let path = dir.path().join("run");
    let folder = RunFolder::create(&path, &settings(), &toml::Table::new()).expect("a fresh folder");
    let mut other = settings();
    other.population = 50;
    let error = Evolution::in_folder(folder, &dataset(), other, reference(), 1).err().expect("refused");
    assert!(matches!(error, RunError::Folder(FolderError::OtherSettings(_))), "{error}");
    assert_eq!(RunFolder::open(&path).expect("a run folder").1, settings());
}

#[test]
fn fewer_generations_are_refused() {
    let error = settings().extended(4).expect_err("fewer");
    assert!(matches!(error, SettingsError::FewerGenerations { made: 5, asked: 4 }));
}

#[test]
fn what_is_recorded() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let path = dir.path().join("run");
    let state = run_in(&path, &settings(), reference(), 2);
    let lines: Vec<serde_json::Value> =
        read(&path, "log.jsonl").lines().map(|l| serde_json::from_str(l).expect("JSON")).collect();
    assert_eq!(lines.len(), 5);
    let (mut total, mut operations) = (0, 0.0);
    for (generation, line) in lines.iter().enumerate() {
        assert_eq!(line["generation"], generation);
        total += line["evaluations"].as_u64().expect("a number");
        assert_eq!(line["evaluations_total"], total);
        assert_eq!(line.get("initial").is_some(), generation == 0);
        for field in ["lower", "compile", "execute", "evaluate", "busy", "breed", "wall", "ms_per_uncached"] {
            assert!(line["timing"][field].as_f64().expect("a number") >= 0.0, "{field}");
        }
        let number = |field: &str| line[field].as_f64().expect("a number");
        let (before, after) = (number("operations_before"), number("operations_after"));
        assert!(after < before, "{after} operations of {before}");
        operations += after;
        let distinct = number("distinct_optimised");
        assert!(distinct >= 1.0 && distinct <= number("evaluations"), "{distinct}");
        let timing = |field: &str| line["timing"][field].as_f64().expect("a number");
        assert!(timing("busy") > 0.0 && timing("busy") <= 1.0, "{}", timing("busy"));
        assert!(timing("evaluate") <= timing("wall"));
    }
    assert!(operations > 0.0);
    assert_eq!(lines[0]["initial"]["draws"], lines[0]["evaluations"]);
    let best = state.hall_of_fame.best().expect("a best");
    assert_eq!(lines[4]["best_fitness_so_far"], f64::from(best.correct) / 24.0);
    let parsed: vsonar::tree::Individual = read(&path, "best.gp").parse().expect("program text");
    assert_eq!(parsed, best.individual);
    for line in read(&path, "hall_of_fame.jsonl").lines() {
        let line: serde_json::Value = serde_json::from_str(line).expect("JSON");
        let parsed: vsonar::tree::Individual =
            line["program"].as_str().expect("text").parse().expect("program text");
        assert_eq!(line["nodes"], parsed.len());
    }
}
