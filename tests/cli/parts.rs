//! Training, validation and held-out parts, as they are asked for and reported.

use serde_json::Value;

use crate::common::*;

/// Twelve images: two drives of six, in turns.
fn place() -> Place {
    let place = Place::new();
    std::fs::remove_dir_all(place.path("data")).expect("there");
    dataset(12, 0).save(place.path("data")).expect("writable");
    place
}

fn json(place: &Place, arguments: &[&str]) -> Value {
    let text = place.ok(&tiny(&[arguments, &["--json", "--quiet"]].concat()));
    serde_json::from_str(&text).expect("JSON")
}

#[test]
fn validation_chooses_from_the_hall_of_fame() {
    let place = place();
    let parts = ["--holdout", "25%", "--validation", "fold:2/3", "--gap", "0"];
    let summary = json(&place, &[&parts[..], &["--out", "run"]].concat());
    // Drives a and b lose 2 and 1 of 6 images; of the 9 that are left the middle 3 validate.
    let cases = |part: &str| summary[part]["cases"].as_u64();
    assert_eq!(
        (cases("train"), cases("validation"), cases("holdout")),
        (Some(24), Some(12), Some(12)),
        "{summary}"
    );
    let hall: Vec<Value> = place
        .read("run/hall_of_fame.jsonl")
        .lines()
        .map(|l| serde_json::from_str(l).expect("JSON"))
        .collect();
    let key = |e: &Value| {
        (e["validation_correct"].as_u64().expect("a number"), -e["nodes"].as_i64().expect("a number"))
    };
    let best = hall.iter().max_by_key(|e| key(e)).expect("entries");
    assert_eq!(summary["best"]["nodes"], best["nodes"]);
    assert_eq!(summary["validation"]["correct"], best["validation_correct"]);
    assert_eq!(summary["train"]["correct"], best["correct"]);
    let first = place.read("run/best.gp");
    let said = format!("; {} of 12 validation cases; ", best["validation_correct"]);
    assert!(first.lines().next().expect("a comment").contains(&said), "{first}");
    let log = recorded(&place.path("run")).log;
    assert_eq!(log.last().expect("lines")["validation_fitness"], summary["validation"]["fitness"]);
    for (part, name) in [("train", "train"), ("validation", "validation"), ("holdout", "holdout")] {
        // The tolerance is that of the run.
        let judged = place.ok(&["eval", "run", "--part", part, "--json"]);
        let judged: Value = serde_json::from_str(&judged).expect("JSON");
        assert_eq!(
            (&judged["correct"], &judged["cases"]),
            (&summary[name]["correct"], &summary[name]["cases"])
        );
        let columns = summary[name]["columns"].as_array().expect("a list");
        assert_eq!(columns.len(), 4);
        for (column, judged) in columns.iter().zip(judged["columns"].as_array().expect("a list")) {
            assert_eq!((&column["x"], &column["correct"]), (&judged["x"], &judged["correct"]));
        }
        let interval: Vec<f64> =
            serde_json::from_value(summary[name]["interval"].clone()).unwrap_or_default();
        let fitness = summary[name]["fitness"].as_f64().expect("a number");
        assert!(interval.is_empty() || (interval[0] <= fitness && fitness <= interval[1]), "{summary}");
    }

    // Interrupted half way, it is the same run.
    place.ok(&tiny(&[&parts[..], &["--out", "half", "--quiet", "--generations", "2"]].concat()));
    place.ok(&["evolve", "--resume", "half", "--generations", "4", "--quiet"]);
    assert_eq!(recorded(&place.path("half")), recorded(&place.path("run")));
    assert_eq!(place.read("half/best.gp"), first);

    // Without validation it is the same evolution, and the fittest in training wins.
    let labels = place.read("data/labels.csv");
    let plain = json(&place, &["--out", "plain", "--train-match", "*"]);
    assert_eq!((plain["validation"].is_null(), plain["holdout"].is_null()), (true, true));
    assert_eq!(plain["train"]["cases"].as_u64(), Some(labels.lines().count() as u64 - 1));
}

#[test]
fn the_parts_are_announced_and_the_commands_lead_to_them() {
    let place = place();
    let text = place.ok(&tiny(&["--holdout", "25%", "--validation", "25%", "--gap", "1", "--out", "run"]));
    for said in [
        "held out 25%",
        "validation on 25% of the rest",
        "beside a cut in no part",
        "training",
        "validation  ",
        "held out",
        "95 % interval",
        "column",
        "vsonar report run ",
        "vsonar explain run ",
        "vsonar export run/best.gp ",
    ] {
        assert!(text.contains(said), "no {said:?} in {text}");
    }
    let table = place.read("run/settings.toml");
    assert!(table.contains("validation_fingerprint") && table.contains("holdout_fingerprint"), "{table}");
    // The same again from the settings file.
    place.ok(&["evolve", "--settings", "run/settings.toml", "--out", "again", "--quiet"]);
    assert_eq!(recorded(&place.path("again")), recorded(&place.path("run")));
}

#[cfg(unix)]
#[test]
fn the_held_out_part_is_not_looked_at_before_the_end() {
    let place = place();
    let (parts, out) = (["--holdout", "25%", "--json", "--out", "run"], place.path("run"));
    let summary = json(&place, &["--holdout", "25%", "--out", "whole"]);
    assert!(summary["holdout"]["fitness"].is_f64());
    let mut child = place
        .command(&tiny(&[&parts[..], &["--generations", "100000"]].concat()))
        .stdout(std::process::Stdio::piped())
        .stderr(std::process::Stdio::null())
        .spawn()
        .expect("started");
    let log = || std::fs::read_to_string(out.join("log.jsonl")).unwrap_or_default();
    while log().lines().count() < 3 {
        assert_eq!(child.try_wait().expect("known"), None);
        std::thread::sleep(std::time::Duration::from_millis(10));
    }
    crate::interruption::interrupt(&child);
    let output = child.wait_with_output().expect("ended");
    assert_eq!(output.status.code(), Some(130));
    let summary: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!((&summary["complete"], &summary["holdout"]), (&false.into(), &Value::Null));
}

#[test]
fn groups_of_the_table_are_not_torn() {
    let place = place();
    let labels = place.read("data/labels.csv");
    let with_groups = |group: &dyn Fn(usize, &str) -> String| {
        let rows = labels.lines().enumerate().map(|(i, line)| match i {
            0 => format!("{line},group\n"),
            _ => format!("{line},{}\n", group(i, line)),
        });
        rows.collect::<String>()
    };
    let hall = |_: usize, line: &str| if line.contains("drive_a") { "hall" } else { "lab" }.to_string();
    place.write("data/labels.csv", with_groups(&hall));
    let summary = json(&place, &["--holdout", "20%", "--out", "one"]);
    assert_eq!(
        (summary["train"]["cases"].as_u64(), summary["holdout"]["cases"].as_u64()),
        (Some(24), Some(24))
    );
    let judged = place.ok(&["eval", "one", "--answers", "-"]);
    assert!(judged.lines().skip(1).all(|line| line.contains("drive_b")), "{judged}");
    let summary = json(
        &place,
        &["--holdout", "group:hall", "--validation", "25%", "--split-by", "stretch", "--out", "two"],
    );
    assert_eq!(
        (summary["validation"]["cases"].as_u64(), summary["holdout"]["cases"].as_u64()),
        (Some(8), Some(24))
    );
    let judged = place.ok(&["eval", "two", "--answers", "-"]);
    assert!(judged.lines().skip(1).all(|line| line.contains("drive_a")), "{judged}");

    let complaint = place.fails(1, &tiny(&["--holdout", "group:attic"]));
    assert!(complaint.contains("no group `attic`; there are hall, lab"), "{complaint}");
    let complaint = place.fails(1, &tiny(&["--holdout", "fold:1/3"]));
    assert!(complaint.contains("2 group(s)"), "{complaint}");
    // One image in two groups.
    place.write(
        "data/labels.csv",
        with_groups(&|i, line| if i == 2 { "attic".to_string() } else { hall(i, line) }),
    );
    let complaint = place.fails(1, &tiny(&[]));
    assert!(complaint.contains("labels.csv line 3") && complaint.contains("`attic`"), "{complaint}");
}

#[test]
fn parts_that_are_none() {
    let place = place();
    for (flag, part) in [("--holdout", "0%"), ("--validation", "fold:4/3"), ("--holdout", "group:")] {
        let complaint = place.fails(2, &tiny(&[flag, part]));
        assert!(complaint.contains(flag) && complaint.contains("names no part"), "{complaint}");
    }
    let complaint = place.fails(2, &tiny(&["--validation", "20%", "--split-by", "frame"]));
    assert!(complaint.contains("--split-by") && complaint.contains("stretch"), "{complaint}");
    let complaint = place.fails(1, &tiny(&["--validation", "95%"]));
    assert!(complaint.contains("nothing would be left"), "{complaint}");
    let complaint = place.fails(1, &tiny(&["--validation-match", "nothing*"]));
    assert!(complaint.contains("nothing*"), "{complaint}");
    let complaint = place.fails(2, &["eval", "data/labels.csv"]);
    assert!(complaint.contains("--data"), "{complaint}");
    place.ok(&tiny(&["--out", "run", "--quiet"]));
    let complaint = place.fails(2, &["eval", "run", "--part", "validation"]);
    assert!(complaint.contains("--part") && complaint.contains("no such part"), "{complaint}");
}

#[test]
fn folds_test_every_image_once() {
    let place = place();
    let flags = ["--folds", "3", "--gap", "0", "--validation", "20%", "--runs", "2", "--jobs", "2"];
    let report = json(&place, &[&flags[..], &["--out", "all"]].concat());
    let runs = report["runs"].as_array().expect("a list");
    let place_of = |run: &Value| (run["fold"].as_u64(), run["seed"].as_u64());
    let expected = [(1, 1), (1, 2), (2, 1), (2, 2), (3, 1), (3, 2)].map(|(f, s)| (Some(f), Some(s)));
    assert_eq!(runs.iter().map(place_of).collect::<Vec<_>>(), expected);
    let mut tested = Vec::new();
    for run in runs {
        let folder = run["run"].as_str().expect("a path");
        let answers = place.ok(&["eval", folder, "--answers", "-"]);
        if run["seed"] == 1 {
            tested.extend(
                answers.lines().skip(1).map(|line| line.split(',').take(2).collect::<Vec<_>>().join(",")),
            );
        }
        let judged = place.ok(&["eval", folder, "--part", "validation", "--tolerance", "3", "--json"]);
        let judged: Value = serde_json::from_str(&judged).expect("JSON");
        assert_eq!(judged["correct"], run["validation"]["correct"]);
    }
    tested.sort();
    let labels = place.read("data/labels.csv");
    let mut all: Vec<String> =
        labels.lines().skip(1).map(|line| line.split(',').take(2).collect::<Vec<_>>().join(",")).collect();
    all.sort();
    assert_eq!(tested, all);
    let correct: u64 = runs.iter().map(|run| run["holdout"]["correct"].as_u64().expect("a number")).sum();
    let pooled = report["pooled"]["fitness"].as_f64().expect("a number");
    assert!((pooled - correct as f64 / (2 * all.len()) as f64).abs() < 1e-12);

    // A fold is a run like any other.
    place.ok(&tiny(&[
        "--holdout",
        "fold:2/3",
        "--gap",
        "0",
        "--validation",
        "20%",
        "--seed",
        "2",
        "--out",
        "own",
    ]));
    assert_eq!(recorded(&place.path("own")), recorded(&place.path("all/fold-2/seed-2")));
    // The same command goes on.
    let again = json(&place, &[&flags[..], &["--out", "all"]].concat());
    assert_eq!(again["pooled"], report["pooled"]);
    let text = place.ok(&tiny(&["--folds", "2", "--quiet"]));
    assert!(
        text.contains("All held-out cases together") && text.contains("runs/data-fold-2-seed-1"),
        "{text}"
    );
    let complaint = place.fails(2, &tiny(&["--folds", "2", "--holdout", "20%"]));
    assert!(complaint.contains("--folds") && complaint.contains("--holdout"), "{complaint}");
}

#[test]
fn of_several_runs_the_best_in_validation_is_taken() {
    let place = place();
    let flags = ["--runs", "4", "--validation", "30%", "--out", "all"];
    let report = json(&place, &flags);
    let runs = report["runs"].as_array().expect("a list");
    let key = |run: &Value| {
        let number = |value: &Value| value.as_u64().expect("a number") as i64;
        let (validation, train) = (number(&run["validation"]["correct"]), number(&run["train"]["correct"]));
        (validation, train, -number(&run["nodes"]), -number(&run["seed"]))
    };
    let best = runs.iter().max_by_key(|run| key(run)).expect("four");
    assert_eq!(report["best"], best["run"]);
    let text = place.ok(&tiny(&[&flags[..], &["--quiet"]].concat()));
    let path = best["run"].as_str().expect("a path");
    for said in [
        "validation",
        "constant",
        &format!("The best in validation: {path}"),
        &format!("vsonar explain {path} "),
    ] {
        assert!(text.contains(said), "no {said:?} in {text}");
    }
}

#[test]
fn several_runs_go_on_with_the_same_parts_only() {
    let place = place();
    dataset(5, 3).save(place.path("other")).expect("writable");
    place.ok(&tiny(&["--runs", "2", "--out", "all", "--quiet"]));
    for parts in [["--validation", "other"], ["--holdout", "other"]] {
        let complaint = place.fails(1, &tiny(&[&parts[..], &["--runs", "2", "--out", "all"]].concat()));
        assert!(complaint.contains("all/seed-1/settings.toml"), "{complaint}");
    }
    // Begun, but without a generation: the training data are guarded too.
    std::fs::remove_file(place.path("all/seed-1/checkpoint")).expect("there");
    let mut other = tiny(&["--runs", "2", "--out", "all"]);
    other[2] = "other";
    let complaint = place.fails(1, &other);
    assert!(complaint.contains("all/seed-1") && complaint.contains("training"), "{complaint}");
    let complaint = place.fails(2, &tiny(&["--runs", "2", "--out", "all", "--generations", "2"]));
    assert!(complaint.contains("all/seed-1") && complaint.contains("--generations"), "{complaint}");
}

#[test]
fn parts_of_a_file_go_together_as_flags_have_to() {
    let place = place();
    place.ok(&tiny(&["--validation", "25%", "--out", "run", "--quiet"]));
    let settings = place.read("run/settings.toml");
    for (more, said) in [
        ("validation = \"x\"", "only one"),
        ("holdout_match = \"drive_a*\"", "`train_match`"),
        ("holdout_part = \"99x%\"", "`holdout_part`: `99x%`"),
        ("split_by = \"frame\"", "split_by"),
    ] {
        let text = settings.replace("[data.folder]", &format!("[data.folder]\n{more}"));
        place.write("my.toml", text);
        let complaint = place.fails(1, &["evolve", "--settings", "my.toml", "--out", "x"]);
        assert!(complaint.contains("my.toml") && complaint.contains(said), "{complaint}");
    }
}

#[test]
fn flags_about_parts_need_one() {
    let place = place();
    for flags in [&["--gap", "1"][..], &["--split-by", "image"], &["--holdout", "data", "--gap", "1"]] {
        let complaint = place.fails(2, &tiny(flags));
        assert!(complaint.contains("none is taken"), "{complaint}");
    }
    let complaint = place.fails(2, &tiny(&["--holdout", "25%", "--split-by", "image", "--gap", "2"]));
    assert!(complaint.contains("--gap"), "{complaint}");
    for part in ["25", ""] {
        let complaint = place.fails(2, &tiny(&[&format!("--holdout={part}")]));
        assert!(complaint.contains("names no part"), "{complaint}");
    }
    let complaint = place.fails(1, &["eval", "runs/none"]);
    assert!(complaint.contains("runs/none") && complaint.contains("check the path"), "{complaint}");
}

#[test]
fn the_held_out_part_of_an_unfinished_run_is_not_looked_at_by_accident() {
    let place = place();
    place.ok(&tiny(&["--holdout", "25%", "--out", "run", "--quiet"]));
    let cases = |flags: &[&str]| -> u64 {
        let text = place.ok(&[&["eval", "run", "--json"], flags].concat());
        serde_json::from_str::<Value>(&text).expect("JSON")["cases"].as_u64().expect("a number")
    };
    assert_eq!(cases(&[]), 12);
    let settings = place.read("run/settings.toml");
    place.write("run/settings.toml", settings.replace("generations = 4", "generations = 9"));
    assert_eq!(cases(&[]), 20, "two frames of each drive are beside the cut, in no part");
    assert_eq!(cases(&["--part", "holdout"]), 12);
}
