//! The main job: a run from the flags to the run folder and the summary.

use std::io::Read;
use std::process::Stdio;

use serde_json::Value;

use crate::common::*;

#[test]
fn a_run_prints_lines_and_a_summary() {
    let place = Place::new();
    let (text, aside) =
        place.ok_with_progress(&tiny(&["--train-match", "drive_a*", "--holdout-match", "drive_b*"]));
    assert!(plain(&text) && plain(&aside), "control characters in {text:?} or {aside:?}");
    assert!(!text.contains("generation 0") && aside.lines().count() == 4, "progress goes aside: {aside}");
    for part in ["training", "held out", "best constant per column", "Next:"] {
        assert!(text.contains(part), "no {part:?} in {text}");
    }
    let log = recorded(&place.path("runs/data-seed-1")).log;
    for (line, record) in aside.lines().zip(&log) {
        assert!(["best ", "mean ", "programs/s"].iter().all(|part| line.contains(part)), "{line}");
        let [entropy, nodes] =
            ["case_entropy", "mean_nodes"].map(|field| record[field].as_f64().expect("a number"));
        let spread = format!(
            ", {} behaviours, entropy {entropy:.2}, {} unsolved, {nodes:.0} nodes, ",
            record["distinct_behaviours"], record["solved_by_nobody"]
        );
        assert!(line.contains(&spread) && line.len() <= 130, "no {spread:?} in {line}");
    }
    let next: Vec<&str> = text.lines().filter_map(|line| line.strip_prefix("  vsonar ")).collect();
    let words = |line: &&str| line.split_whitespace().take(2).collect::<Vec<_>>().join(" ");
    let expected = ["report runs/data-seed-1", "explain runs/data-seed-1", "export runs/data-seed-1/best.gp"];
    assert_eq!(next.iter().map(words).collect::<Vec<_>>(), expected, "the three that matter: {text}");
    for file in ["settings.toml", "log.jsonl", "best.gp", "hall_of_fame.jsonl", "checkpoint"] {
        assert!(place.path("runs/data-seed-1").join(file).is_file(), "{file}");
    }
}

/// What a shell prints when it is given a line of the summary.
#[cfg(unix)]
fn copied(place: &Place, line: &str) -> String {
    let script = format!("vsonar() {{ '{}' \"$@\"; }}\n{line}", env!("CARGO_BIN_EXE_vsonar"));
    let output = std::process::Command::new("sh")
        .current_dir(place.path(""))
        .args(["-c", &script])
        .output()
        .expect("a shell");
    assert!(output.status.success(), "{line}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("UTF-8")
}

/// The commands of the summary run as they stand, and what a run folder is for comes to its numbers.
#[cfg(unix)]
#[test]
fn commands_to_copy_repeat_the_numbers() {
    let place = Place::new();
    let check = |arguments: &[&str], parts: &[&str]| {
        let text = place.ok(arguments);
        let row = text.lines().find_map(|l| l.trim().strip_prefix("correct cases")).expect("a row");
        // As in "10 of 12   7 of 12".
        let words: Vec<&str> = row.split_whitespace().collect();
        let mut numbers = words.split(|word| *word == "of").flatten();
        let (_, next) = text.split_once("\nNext:\n").expect("what to do next");
        let lines: Vec<&str> = next.lines().collect();
        assert_eq!(lines.len(), 3, "{text}");
        // A report with rivals takes its time.
        let report = lines[0].replace("    #", " --no-rivals    #");
        assert!(copied(&place, &report).contains("report.html: "), "{report}");
        assert!(copied(&place, lines[1]).contains("answer: a"), "{}", lines[1]);
        let run = lines[1].split("    #").next().expect("a command").replace("explain", "eval");
        for part in parts {
            let printed = copied(&place, &format!("{} --part {part}", run.trim_end()));
            let (correct, cases) = (numbers.next().expect("two"), numbers.next().expect("two"));
            assert!(printed.contains(&format!("({correct} of {cases} cases")), "{part}\n{row}\n{printed}");
        }
        assert_eq!(numbers.next(), None, "{text}");
        assert!(copied(&place, lines[2]).contains("best: images of"), "{}", lines[2]);
    };
    // Other parts have other numbers of cases.
    let parts = ["--train-match", "drive_[a]*", "--holdout-match", "drive_b_{1,3}*"];
    check(&tiny(&parts), &["train", "holdout"]);
    check(&tiny(&["--train-match", "*_[!0].png"]), &["train"]);
    // Names that a shell, or the command itself, would take for something else.
    for name in ["-odd", "it's $HOME; a \"#1\""] {
        dataset(4, 1).save(place.path(name)).expect("writable");
        let (data, holdout) = ("--data=data".to_string(), format!("--holdout={name}"));
        let out = format!("--out={name}-run");
        let set = ["evolve", &data, &holdout, &out];
        check(&[&set[..], TINY].concat(), &["train", "holdout"]);
    }
    let office = ["evolve", "--population", "10", "--generations", "1", "--set", "filter.max_draws=2"];
    check(&office, &["train", "validation", "holdout"]);
}

#[test]
fn a_summary_as_json_is_one_object() {
    let place = Place::new();
    dataset(6, 1).save(place.path("other")).expect("writable");
    let output =
        place.command(&tiny(&["--json", "--holdout", "other", "--out", "x"])).output().expect("started");
    assert!(output.status.success());
    let lines = String::from_utf8(output.stderr).expect("UTF-8");
    assert_eq!(lines.lines().count(), 4, "a line a generation, aside: {lines}");
    let summary: Value = serde_json::from_slice(&output.stdout).expect("JSON alone");
    assert_eq!(summary["complete"], true);
    assert_eq!(summary["generations"], 4);
    assert_eq!(summary["best"]["file"], "x/best.gp");
    assert_eq!(summary["train"]["cases"], 24);
    for (part, data) in [("train", "data"), ("holdout", "other")] {
        let report: Value =
            serde_json::from_str(&place.ok(&["eval", "x/best.gp", "--data", data, "--json"])).expect("JSON");
        assert_eq!(summary[part]["fitness"], report["fitness"], "{part}");
    }
    assert!(summary["train"]["constant_per_column"].as_f64() >= summary["train"]["constant"].as_f64());
    let log = recorded(&place.path("x")).log;
    assert_eq!(log.last().expect("four lines")["best_fitness_so_far"], summary["train"]["fitness"]);
    // Quiet: nothing but the object.
    let output = place.command(&tiny(&["--json", "--quiet", "--out", "y"])).output().expect("started");
    assert!(output.status.success() && output.stderr.is_empty());
    serde_json::from_slice::<Value>(&output.stdout).expect("JSON alone");
}

#[test]
fn a_collapse_is_warned_of_once_and_in_the_summary() {
    let place = Place::new();
    let run = |more: &[&'static str]| {
        let output = place
            .command(&tiny(&[HOPELESS, &["--population", "60"], more].concat()))
            .output()
            .expect("started");
        let [text, complaint] = [output.stdout, output.stderr].map(|b| String::from_utf8(b).expect("UTF-8"));
        assert!(output.status.success() && plain(&text) && plain(&complaint), "{complaint}");
        (text, complaints(&complaint).join("\n"))
    };
    let (text, complaint) = run(&["--out", "lines"]);
    let log = recorded(&place.path("lines")).log;
    let kinds: std::collections::BTreeSet<_> =
        log.iter().filter_map(|line| line["warning"].as_str()).collect();
    assert!(!kinds.is_empty() && log.last().is_some_and(|line| line["warning"].is_string()), "{log:?}");
    assert_eq!(complaint.matches("warning: ").count(), kinds.len(), "{complaint}");
    assert_eq!(complaint.lines().count(), kinds.len(), "{complaint}");
    assert!(complaint.contains("; try `--preset default`, "), "{complaint}");
    assert_eq!(text.matches("Warning: ").count(), 1, "{text}");
    // Beside JSON too; but nothing before the summary of a quiet run.
    let (json, aside) = run(&["--out", "aside", "--json"]);
    let said: Vec<&str> = aside.lines().filter(|line| line.starts_with("warning: ")).collect();
    assert_eq!(said, complaint.lines().collect::<Vec<_>>());
    let summary: Value = serde_json::from_str(&json).expect("JSON alone");
    let warnings = summary["warnings"].as_array().expect("a list");
    assert_eq!((warnings.len(), &warnings[0]["kind"]), (1, &log.last().expect("lines")["warning"]));
    assert!(warnings[0]["remedies"].as_array().is_some_and(|list| list.contains(&"--preset default".into())));
    let (quiet, nothing) = run(&["--out", "quiet", "--quiet"]);
    assert!(nothing.is_empty() && quiet.matches("Warning: ").count() == 1, "{nothing}{quiet}");
    // A complete run that is looked at again says what it said.
    let again = place.ok(&["evolve", "--resume", "quiet"]);
    assert!(again.contains("Warning: "), "{again}");
    let fine = place.ok(&tiny(&["--out", "fine", "--quiet", "--json"]));
    let fine: Value = serde_json::from_str(&fine).expect("JSON");
    assert_eq!(fine["warnings"], serde_json::json!([]));
}

#[test]
fn altered_copies_are_announced_counted_and_recorded() {
    let place = Place::new();
    let copies = ["--set", "augmentation.variants=2", "--set", "augmentation.mirror=1"];
    let (text, aside) = place.ok_with_progress(&tiny(&[&copies[..], &["--out", "one"]].concat()));
    assert!(text.contains("6 images of 64 x 48 pixels, and 12 altered copies of them"), "{text}");
    assert!(
        text.contains("With the altered copies of the training images") && aside.contains(" unaltered)"),
        "{text}{aside}"
    );
    let summary = place.ok(&tiny(&[&copies[..], &["--out", "two", "--quiet", "--json"]].concat()));
    let summary: Value = serde_json::from_str(&summary).expect("JSON");
    assert_eq!((&summary["train"]["cases"], &summary["augmented"]["cases"]), (&24.into(), &72.into()));
    assert_eq!(recorded(&place.path("one")), recorded(&place.path("two")));
    let log = recorded(&place.path("two")).log;
    let last = log.last().expect("four lines");
    assert_eq!(last["best_fitness_so_far"], summary["augmented"]["fitness"]);
    assert!(log.iter().all(|line| line["best_fitness_unaltered"].is_f64()));
    let judged = place.ok(&["eval", "two/best.gp", "--data", "data", "--tolerance", "3", "--json"]);
    let judged: Value = serde_json::from_str(&judged).expect("JSON");
    assert_eq!(
        judged["fitness"], summary["train"]["fitness"],
        "training fitness is of the images as they are"
    );
    let settings = place.read("two/settings.toml");
    assert!(settings.contains("[augmentation]") && settings.contains("mirror = 1.0"), "{settings}");
    // A run without says nothing of them.
    let (text, aside) = place.ok_with_progress(&tiny(&["--out", "plain"]));
    assert!(!text.contains("altered") && !aside.contains("altered"), "{text}{aside}");
    assert!(!place.read("plain/log.jsonl").contains("unaltered"));

    // They need memory, which is asked for before they are made.
    let many = ["--set", "augmentation.variants=100", "--set", "augmentation.mirror=1", "--memory", "0.05"];
    place.ok(&tiny(&["--out", "small", "--quiet", "--memory", "0.05"]));
    let complaint = place.fails(1, &tiny(&[&many[..], &["--out", "large"]].concat()));
    assert!(complaint.contains("6 images with 600 altered copies of 64 x 48 pixels"), "{complaint}");
    let complaint = place.fails(2, &tiny(&["--set", "augmentation.mirror=2"]));
    assert!(complaint.contains("augmentation.mirror") && complaint.contains("from 0 to 1"), "{complaint}");
}

#[test]
fn quiet_prints_only_the_summary() {
    let place = Place::new();
    let text = place.ok(&tiny(&["-q"]));
    assert!(
        !text.contains("generation 0") && !text.contains("Training on") && text.contains("Next:"),
        "{text}"
    );
}

#[test]
fn threads_and_executors_change_nothing() {
    let place = Place::new();
    let mut expected = None;
    for executor in ["auto", "batch", "batch-scalar", "cranelift", "cranelift-scalar", "reference", "tree"] {
        for threads in ["1", "2"] {
            let out = format!("{executor}-{threads}");
            place.ok(&tiny(&["--executor", executor, "--threads", threads, "--out", &out]));
            let found = recorded(&place.path(&out));
            assert_eq!(found.log.len(), 4);
            assert_eq!(expected.get_or_insert(recorded(&place.path(&out))), &found, "{out}");
        }
    }
}

#[test]
fn runs_are_numbered_and_named() {
    let place = Place::new();
    for _ in 0..2 {
        place.ok(&tiny(&["--quiet", "--generations", "1", "--seed", "7"]));
    }
    let (one, two) = (place.path("runs/data-seed-7"), place.path("runs/data-seed-7-2"));
    assert_eq!(recorded(&one), recorded(&two), "the same seed gives the same run");
    place.ok(&tiny(&["--quiet", "--generations", "1", "--seed", "8"]));
    assert!(recorded(&one) != recorded(&place.path("runs/data-seed-8")));
}

#[test]
fn a_resumed_run_equals_one_that_was_not_interrupted() {
    let place = Place::new();
    place.ok(&tiny(&["--out", "whole", "--generations", "5"]));
    place.ok(&tiny(&["--out", "parts", "--generations", "2", "--executor", "tree"]));
    // From another folder, so the data must be found by what the run folder says.
    std::fs::create_dir(place.path("elsewhere")).expect("writable");
    let resume = ["evolve", "--resume", "../parts", "--generations", "5", "--threads", "1", "--quiet"];
    let output = place.command(&resume).current_dir(place.path("elsewhere")).output().expect("started");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert_eq!(recorded(&place.path("whole")), recorded(&place.path("parts")));
    assert_eq!(place.read("whole/settings.toml"), place.read("parts/settings.toml"));
    // A complete run has nothing left to do, and says how it went.
    let again = place.ok(&["evolve", "--resume", "parts"]);
    assert!(again.contains("resumed after 5 generations") && again.contains("Next:"), "{again}");
}

#[test]
fn settings_of_a_run_repeat_it() {
    let place = Place::new();
    place.ok(&tiny(&[
        "--out",
        "one",
        "--preset",
        "paper",
        "--trees",
        "1",
        "--nodes",
        "-raw*,-tan",
        "--seed",
        "3",
    ]));
    place.ok(&["evolve", "--data", "data", "--settings", "one/settings.toml", "--out", "two"]);
    assert_eq!(recorded(&place.path("one")), recorded(&place.path("two")));
    assert_eq!(place.read("one/settings.toml"), place.read("two/settings.toml"));
    let settings = place.read("one/settings.toml");
    for line in ["raw = 0", "raw-sq = 0", "tan = 0", "trees = 1", "seed = 3"] {
        assert!(settings.lines().any(|l| l.replace('"', "") == line), "no {line} in {settings}");
    }
    // A flag goes before the file.
    place.ok(&[
        "evolve",
        "--data",
        "data",
        "--settings",
        "one/settings.toml",
        "--out",
        "three",
        "--seed",
        "4",
    ]);
    assert!(place.read("three/settings.toml").contains("seed = 4"));
}

/// A run's settings file names its data too.
#[test]
fn settings_of_a_run_bring_its_data() {
    let place = Place::new();
    let without_fingerprint = |name: &str| {
        let text = place.read(&format!("{name}/settings.toml"));
        text.lines().filter(|l| !l.starts_with("holdout_fingerprint")).collect::<Vec<_>>().join("\n")
    };
    let parts = ["--train-match", "drive_a*", "--holdout-match", "drive_b*", "--out", "one"];
    place.ok(&tiny(&parts));
    // From another folder, and with the population and generations of the file.
    std::fs::create_dir(place.path("elsewhere")).expect("writable");
    let repeat = ["evolve", "--settings", "../one/settings.toml", "--out", "../two"];
    let output = place.command(&repeat).current_dir(place.path("elsewhere")).output().expect("started");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8(output.stdout).expect("UTF-8");
    let first = text.lines().next().expect("a line");
    assert!(first.starts_with("Training on ") && first.contains("drive_a*; held out drive_b*"), "{text}");
    assert!(first.contains("as ../one/settings.toml says (12 cases"), "{text}");
    assert!(text.contains("held out"), "{text}");
    assert_eq!(recorded(&place.path("one")), recorded(&place.path("two")));
    assert_eq!(place.read("one/settings.toml"), place.read("two/settings.toml"));
    // Data on the command line replace the file's as a whole.
    let settings = "one/settings.toml";
    let text = place.ok(&["evolve", "--settings", settings, "--data", "data", "--out", "three"]);
    assert!(text.starts_with("Training on data (24 cases"), "{text}");
    assert!(!place.read("three/settings.toml").contains("match"));
    // A folder that is gone is an error like any other.
    std::fs::rename(place.path("data"), place.path("moved")).expect("writable");
    let complaint = place.fails(1, &["evolve", "--settings", settings]);
    assert!(complaint.contains("there is no folder") && complaint.contains("data"), "{complaint}");
    // Paths count from the file; what the table does not say is not guessed.
    let moved = without_fingerprint("one").replace(&place.path("data").display().to_string(), "../moved");
    assert!(moved.contains("\"../moved\""), "{moved}");
    place.write("one/moved.toml", &moved);
    place.ok(&["evolve", "--settings", "one/moved.toml", "--out", "four"]);
    let mut four = recorded(&place.path("four"));
    // The folder's new name stands beside the program.
    assert!(four.best.contains("of the data set moved["), "{}", four.best);
    four.best = four.best.replace("moved[", "data[");
    assert_eq!(recorded(&place.path("one")), four);
    place.write("one/moved.toml", moved.replace("[data.folder]", "[data.flder]"));
    let complaint = place.fails(1, &["evolve", "--settings", "one/moved.toml"]);
    assert!(complaint.contains("one/moved.toml") && complaint.contains("[data]"), "{complaint}");
}

#[test]
fn without_data_there_is_an_office() {
    let place = Place::new();
    let small = ["--population", "10", "--generations", "1", "--set", "filter.max_draws=2"];
    let text = place.ok(&[&["evolve"], &small[..]].concat());
    assert!(text.contains("small run") && text.contains("--population 4000 --generations 51"), "{text}");
    assert!(text.contains("held out") && text.contains("vsonar report runs/fmrb-seed-1"), "{text}");
    assert!(place.path("runs/fmrb-seed-1/best.gp").is_file());
    // A resume finds it again.
    place.ok(&["evolve", "--resume", "runs/fmrb-seed-1", "--generations", "2", "--quiet"]);
    // So does a run that repeats it.
    place.ok(&["evolve", "--settings", "runs/fmrb-seed-1/settings.toml", "--out", "again"]);
    assert_eq!(recorded(&place.path("again")), recorded(&place.path("runs/fmrb-seed-1")));
    // The corridor that was there before can be written still.
    let text = place.ok(&["data", "synth", "small", "--size", "48x32", "--frames", "2"]);
    assert!(text.contains("2 images of 48 x 32 pixels, 12 cases"), "{text}");
    // The same images as a folder give the same run.
    place.ok(&["synth", "--world", "fmrb", "--out", "office"]);
    place.ok(&["synth", "--world", "fmrb", "--out", "between", "--seed", "1"]);
    let folders = ["evolve", "--data", "office", "--validation", "between", "--out", "folder"];
    place.ok(&[&folders, &small[..]].concat());
    assert_eq!(recorded(&place.path("folder")).log[0], recorded(&place.path("runs/fmrb-seed-1")).log[0]);
}

#[test]
fn a_reader_that_leaves_ends_the_run_quietly() {
    let place = Place::new();
    let mut run = place.command(&tiny(&["--generations", "400", "--out", "run"]));
    let mut run = run.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("started");
    drop(run.stdout.take());
    let status = run.wait().expect("it ends");
    let mut complaint = String::new();
    run.stderr.take().expect("piped").read_to_string(&mut complaint).expect("UTF-8");
    assert!(status.success() && complaints(&complaint).is_empty(), "{status}: {complaint}");
}
