//! `vsonar sweep`: a grid of runs, their results, and going on with it.

use std::collections::BTreeMap;
use std::path::Path;

use crate::common::*;

/// Settings of a run so small that the walker takes no time.
pub(crate) const SMALL: &str = "\
[settings]
tolerance = 10
population = 40
generations = 3
creation = { min_depth = 2, max_depth = 4 }
filter.max_draws = 30
augmentation = { mirror = 0, gain = 0, brightness = 0 }
";

/// The place's data in two drives, one held out.
pub(crate) const DATA: &str = "\
[[data]]
name = \"made up\"
[data.folder]
train = \"data\"
train_match = \"drive_a*\"
holdout_match = \"drive_b*\"
";

const TWO: &str = "\
[[setting]]
name = \"default\"
[[setting]]
name = \"sharing\"
selection.kind = \"sharing\"
";

fn place(spec: &[&str]) -> Place {
    let place = Place::new();
    place.write("spec.toml", spec.concat());
    place
}

/// The rows of the results by column.
fn rows(place: &Place, file: &str) -> Vec<BTreeMap<String, String>> {
    let text = place.read(file);
    let mut reader = csv::Reader::from_reader(text.as_bytes());
    let header = reader.headers().expect("a header").clone();
    let row = |record: csv::StringRecord| {
        header.iter().zip(&record).map(|(name, value)| (name.to_string(), value.to_string())).collect()
    };
    reader.records().map(|record| row(record.expect("as wide as the header"))).collect()
}

/// The same without what differs from one sweep to the next.
fn timeless(place: &Place, file: &str) -> Vec<BTreeMap<String, String>> {
    let mut rows = rows(place, file);
    rows.iter_mut().for_each(|row| assert!(row.remove("seconds").is_some()));
    rows
}

#[test]
fn validation_chooses_the_winner_of_a_run() {
    let parts = "validation_part = \"fold:1/2\"\nsplit_by = \"image\"\n";
    let place = place(&["seeds = [5]\n", SMALL, DATA, parts, TWO]);
    let text = place.ok(&["sweep", "spec.toml", "--test"]);
    assert!(text.contains("validation"), "{text}");
    for row in rows(&place, "sweeps/spec/results.csv") {
        let kind = if row["setting"] == "default" { "lexicase" } else { "sharing" };
        let kind = format!("selection.kind={kind}");
        let parts = ["--train-match", "drive_a*", "--holdout-match", "drive_b*", "--validation", "fold:1/2"];
        let more =
            ["--split-by", "image", "--seed", "5", "--tolerance", "10", "--generations", "3", "--set", &kind];
        let flags = tiny(&[&parts[..], &more, &["--json", "--quiet", "--out", &row["setting"]]].concat());
        let summary: serde_json::Value = serde_json::from_str(&place.ok(&flags)).expect("JSON");
        for part in ["train", "validation", "holdout"] {
            for field in ["correct", "cases"] {
                assert_eq!(
                    row[&format!("{part}_{field}")],
                    summary[part][field].to_string(),
                    "{part} {field}"
                );
            }
        }
        assert_eq!(row["nodes"], summary["best"]["nodes"].to_string());
    }
    // Other validation images are other data.
    place.write("spec.toml", place.read("spec.toml").replace("fold:1/2", "fold:2/2"));
    let complaint = place.fails(1, &["sweep", "spec.toml"]);
    assert!(complaint.contains("results.csv") && complaint.contains("made up"), "{complaint}");
}

fn individual(text: &str) -> vsonar::tree::Individual {
    text.parse().expect("a program")
}

#[test]
fn every_run_is_that_of_evolve() {
    let spec = ["title = \"Two ways\"\nseeds = \"2-3\"\n", SMALL, DATA, TWO];
    let place = place(&spec);
    let text = place.ok(&["sweep", "spec.toml"]);
    for part in
        ["Two ways", "made up", "sharing", "training", "against `default`", "A12", "sweeps/spec/results.csv"]
    {
        assert!(text.contains(part), "{part}: {text}");
    }
    let rows = rows(&place, "sweeps/spec/results.csv");
    let names: Vec<(&str, &str)> =
        rows.iter().map(|row| (row["seed"].as_str(), row["setting"].as_str())).collect();
    assert_eq!(
        names,
        [("2", "default"), ("2", "sharing"), ("3", "default"), ("3", "sharing")],
        "seed by seed"
    );
    assert_eq!(place.read("sweeps/spec/spec.toml"), spec.concat());
    for row in &rows {
        let (out, kind) = (format!("{}-{}", row["setting"], row["seed"]), &row["setting"]);
        let kind = format!("selection.kind={}", if kind == "default" { "lexicase" } else { kind });
        let flags = [
            "--train-match",
            "drive_a*",
            "--holdout-match",
            "drive_b*",
            "--tolerance",
            "10",
            "--generations",
            "3",
        ];
        let more = ["--seed", &row["seed"], "--set", &kind, "--out", &out, "--json", "--quiet"];
        let json: serde_json::Value =
            serde_json::from_str(&place.ok(&tiny(&[&flags[..], &more].concat()))).expect("JSON");
        assert_eq!(individual(&row["program"]), individual(&place.read(&format!("{out}/best.gp"))));
        assert_eq!(row["train_fitness"].parse::<f64>().ok(), json["train"]["fitness"].as_f64());
        assert_eq!(row["train_constant"].parse::<f64>().ok(), json["train"]["constant_per_column"].as_f64());
        assert_eq!(row["evaluations"], json["evaluations"].to_string());
        assert_eq!(row["generation_of_best"], json["best"]["generation"].to_string());
        assert_eq!(row["nodes"], json["best"]["nodes"].to_string());
        let executed = |value: serde_json::Value| value["timing"]["executed"].as_u64().expect("a number");
        let log = place.read(&format!("{out}/log.jsonl"));
        let fresh: u64 = log.lines().map(|line| executed(serde_json::from_str(line).expect("JSON"))).sum();
        assert_eq!(row["fresh"], fresh.to_string());
        assert_ne!(row["train_correct"], "0", "else much would be equal by chance");
        assert!(row["holdout_correct"].is_empty() && row["validation_correct"].is_empty());
    }
}

#[test]
fn jobs_and_threads_change_nothing() {
    let augmented = "[[setting]]\nname = \"mirrored\"\naugmentation.mirror = 0.5\n";
    let grid = "[grid]\n\"selection.tournament\" = [2, 7]\nbreeding.max_depth = [8]\n";
    let place = place(&["seeds = [1, 4]\n", SMALL, DATA, TWO, augmented, grid]);
    place.ok(&["sweep", "spec.toml", "--jobs", "1", "--threads", "1", "--quiet"]);
    place.ok(&[
        "sweep",
        "spec.toml",
        "--jobs",
        "3",
        "--threads",
        "5",
        "--out",
        "three",
        "--executor",
        "batch",
    ]);
    let one = timeless(&place, "sweeps/spec/results.csv");
    assert_eq!(one.len(), 2 * 3 * 2);
    assert_eq!(one, timeless(&place, "three/results.csv"));
    assert_eq!(one[1]["setting"], "default, selection.tournament=7, breeding.max_depth=8");
    assert_ne!(one[0]["settings_fingerprint"], one[1]["settings_fingerprint"]);
}

#[test]
fn what_is_there_is_not_run_again() {
    let place = place(&["seeds = \"1-3\"\n", SMALL, DATA, TWO]);
    let file = "sweeps/spec/results.csv";
    let sweep = ["sweep", "spec.toml", "--quiet"];
    place.ok(&sweep);
    let (whole, text) = (rows(&place, file), place.read(file));
    place.ok(&sweep);
    assert_eq!(place.read(file), text, "nothing was left to do");
    // A row is missing, and the last one is torn in two.
    let mut lines: Vec<&str> = text.lines().collect();
    let last = lines.pop().expect("there are lines");
    lines.remove(2);
    place.write(file, format!("{}\n{}", lines.join("\n"), &last[..last.len() - 30]));
    let output = place.command(&sweep).output().expect("started");
    assert!(output.status.success());
    assert!(String::from_utf8_lossy(&output.stderr).contains("torn"), "it is said");
    let again = rows(&place, file);
    assert_eq!(timeless(&place, file), {
        let mut whole = whole.clone();
        whole.iter_mut().for_each(|row| drop(row.remove("seconds")));
        whole
    });
    let same: Vec<bool> = whole.iter().zip(&again).map(|(a, b)| a["seconds"] == b["seconds"]).collect();
    assert_eq!(same[..1], [true]);
    assert_eq!(same[2..5], [true; 3], "these were kept: {same:?}");
    // More seeds, and fewer settings: rows that are not asked for stay.
    let text = place.ok(&["sweep", "spec.toml", "--seeds", "3-4", "--only", "sharing", "--dry-run"]);
    assert!(text.contains("1 run to make"), "{text}");
    place.ok(&["sweep", "spec.toml", "--seeds", "3-4", "--only", "sharing", "--quiet"]);
    assert_eq!(rows(&place, file).len(), 7);
}

#[test]
fn the_held_out_part_is_looked_at_only_when_asked_for() {
    let place = place(&["seeds = \"1-2\"\n", SMALL, DATA, TWO]);
    let file = "sweeps/spec/results.csv";
    let text = place.ok(&["sweep", "spec.toml"]);
    assert!(text.contains("--test") && !text.contains("  held out"), "{text}");
    let before = rows(&place, file);
    let text = place.ok(&["sweep", "spec.toml", "--test", "--dry-run"]);
    assert!(text.contains("4 winners to test") && text.contains("0 runs to make"), "{text}");
    let text = place.ok(&["sweep", "spec.toml", "--test"]);
    assert!(text.contains("held out"), "{text}");
    let after = rows(&place, file);
    for (before, after) in before.iter().zip(&after) {
        assert_eq!(before["seconds"], after["seconds"], "the run was not made again");
        place.write("best.gp", &after["program"]);
        let flags = ["--data", "data", "--match", "drive_b*", "--tolerance", "10", "--json"];
        let json = place.ok(&[&["eval", "best.gp"], &flags[..]].concat());
        let json: serde_json::Value = serde_json::from_str(&json).expect("JSON");
        assert_eq!(after["holdout_correct"], json["correct"].to_string(), "{json}");
    }
    // At once, it comes to the same; and so it does when the file says it.
    place.ok(&["sweep", "spec.toml", "--test", "--out", "once", "--quiet"]);
    assert_eq!(timeless(&place, file), timeless(&place, "once/results.csv"));
    place.write("told.toml", ["test = true\nseeds = \"1-2\"\n", SMALL, DATA, TWO].concat());
    place.ok(&["sweep", "told.toml", "--quiet"]);
    assert_eq!(timeless(&place, file), timeless(&place, "sweeps/told/results.csv"));
    // Known results are not shown without being asked for.
    let json = place.ok(&["sweep", "spec.toml", "--json", "--quiet"]);
    let json: serde_json::Value = serde_json::from_str(&json).expect("JSON");
    let setting = &json["data"][0]["settings"][1];
    assert_eq!(
        (&setting["name"], &setting["runs"], &json["complete"]),
        (&"sharing".into(), &2.into(), &true.into())
    );
    assert!(setting["holdout"].is_null() && setting["train"]["median"].is_number(), "{setting}");
    assert!(json["data"][0]["comparisons"][0]["train"]["p_holm"].is_number(), "{json}");
}

#[test]
fn data_can_be_somewhere_else() {
    let place = place(&["seeds = 1\n", SMALL, &DATA.replace("\"data\"", "\"nowhere\""), TWO]);
    let error = place.fails(1, &["sweep", "spec.toml"]);
    for part in ["nowhere", "`made up`", "--data made up=DIR"] {
        assert!(error.contains(part), "{part}: {error}");
    }
    place.ok(&["sweep", "spec.toml", "--data", "made up=data", "--quiet"]);
    // Paths count from the file, not from where the command is started.
    std::fs::create_dir(place.path("specs")).expect("writable");
    place.write(
        "specs/far.toml",
        ["seeds = 1\n", SMALL, &DATA.replace("\"data\"", "\"../data\""), TWO].concat(),
    );
    place.ok(&["sweep", "specs/far.toml", "--quiet"]);
    assert_eq!(timeless(&place, "sweeps/far/results.csv"), timeless(&place, "sweeps/spec/results.csv"));
}

#[test]
fn built_in_data_need_no_fields() {
    let tiny =
        SMALL.replace("population = 40", "population = 4").replace("generations = 3", "generations = 1");
    let place = place(&["seeds = 1\n", &tiny, "[[data]]\nname = \"built in\"\nsynthetic.frames = 2\n"]);
    place.ok(&["sweep", "spec.toml", "--quiet"]);
    assert_eq!(rows(&place, "sweeps/spec/results.csv")[0]["setting"], "default");
}

#[test]
fn example_specs_are_sound() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/sweeps");
    let place = Place::new();
    let mut specs = 0;
    for entry in std::fs::read_dir(folder).expect("there") {
        let path = entry.expect("readable").path();
        let path = path.to_str().expect("UTF-8");
        if path.ends_with(".toml") {
            specs += 1;
            let text = place.ok(&["sweep", path, "--dry-run"]);
            assert!(text.contains("to make"), "{path}: {text}");
            let cells: serde_json::Value =
                serde_json::from_str(&place.ok(&["sweep", path, "--dry-run", "--json"])).expect("JSON");
            assert!(cells.as_array().is_some_and(|cells| cells.len() > 5), "{path}");
        }
    }
    assert!(specs >= 3, "{specs}");
    assert!(!place.path("sweeps").exists(), "nothing is made");
}

#[cfg(unix)]
#[test]
fn ctrl_c_keeps_what_is_done() {
    use std::process::Stdio;
    let slow =
        SMALL.replace("population = 40", "population = 300").replace("generations = 3", "generations = 6");
    let place = place(&["seeds = \"1-6\"\n", &slow, DATA, TWO]);
    place.ok(&["sweep", "spec.toml", "--out", "whole", "--quiet"]);
    let mut command = place.command(&["sweep", "spec.toml", "--executor", "tree", "--jobs", "2"]);
    let mut sweep = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("started");
    let file = place.path("sweeps/spec/results.csv");
    while !file.exists() {
        assert!(sweep.try_wait().expect("it can be asked").is_none(), "it ended early");
        std::thread::sleep(std::time::Duration::from_millis(2));
    }
    // Nobody else writes the folder meanwhile.
    let error = one_error(&place.command(&["sweep", "spec.toml"]).output().expect("started"), 1);
    assert!(error.contains("another process"), "{error}");
    crate::interruption::interrupt(&sweep);
    let output = sweep.wait_with_output().expect("it ends");
    let said = String::from_utf8(output.stderr).expect("UTF-8");
    assert_eq!(output.status.code(), Some(130), "{said}");
    assert!(said.contains("of 12 runs saved") && said.contains("vsonar sweep spec.toml"), "{said}");
    let saved = rows(&place, "sweeps/spec/results.csv").len();
    assert!((1..12).contains(&saved), "{saved}");
    assert_eq!(said.lines().filter(|line| line.contains("/12: ")).count(), saved, "{said}");
    place.ok(&["sweep", "spec.toml", "--quiet"]);
    let fresh = |mut rows: Vec<BTreeMap<String, String>>| {
        // The walker runs every individual.
        rows.iter_mut().for_each(|row| drop(row.remove("fresh")));
        rows
    };
    assert_eq!(
        fresh(timeless(&place, "whole/results.csv")),
        fresh(timeless(&place, "sweeps/spec/results.csv"))
    );
}
