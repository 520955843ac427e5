//! `vsonar eval --against`: rivals beside the evolved program; and how long errors last.

use serde_json::Value;
use vsonar::baseline::{Rival, answers};
use vsonar::dataset::{Dataset, TOLERANCE, Variation};

use crate::common::*;

fn json(place: &Place, arguments: &[&str]) -> Value {
    let text = place.ok(&[arguments, &["--json"]].concat());
    serde_json::from_str(&text).expect("one JSON value")
}

/// The detectors of a report by name.
fn detectors(report: &Value) -> Vec<(&str, &Value)> {
    let rows = report["detectors"].as_array().expect("a list");
    rows.iter().map(|row| (row["detector"].as_str().expect("a name"), row)).collect()
}

/// The first headings of the table.
fn headings(text: &str) -> Vec<&str> {
    let line = text.lines().find(|line| line.starts_with("detector")).expect("a table");
    line.split_whitespace().take(4).collect()
}

/// A run on drive a, tested on drive b, in `run`.
fn evolved() -> Place {
    let place = Place::new();
    std::fs::remove_dir_all(place.path("data")).expect("there");
    dataset(12, 0).save(place.path("data")).expect("writable");
    place.ok(&tiny(&[
        "--train-match",
        "drive_a*",
        "--holdout-match",
        "drive_b*",
        "--out",
        "run",
        "--quiet",
        "--json",
    ]));
    place
}

/// They get what evolution gets, copies included; what remembers frames needs them in their order.
#[test]
fn rivals_are_tuned_on_the_altered_copies_too() {
    let place = Place::new();
    place.ok(&[
        "evolve",
        "--data",
        "data",
        "--population",
        "20",
        "--generations",
        "1",
        "--seed",
        "5",
        "--set",
        "filter.enabled=false",
        "--set",
        "augmentation.variants=3",
        "--set",
        "augmentation.gain=0.9",
        "--out",
        "run",
        "--quiet",
    ]);
    let set = Dataset::load(place.path("data")).expect("sound");
    let variation = Variation { copies: 3, mirror: 0.5, gain: 0.9, brightness: 20.0, ..Variation::NONE };
    let grown = variation.grow(&set, 5);
    let report = json(&place, &["eval", "run", "--part", "train", "--against", "all"]);
    assert_eq!(report["altered_copies"], 3);
    let found = detectors(&report);
    let mut differ = 0;
    for (rival, (_, row)) in Rival::ALL.into_iter().zip(&found[1..]) {
        let on = |set: &Dataset| serde_json::to_value(rival.tune(set, TOLERANCE)).expect("JSON");
        let (plain, with_copies) = (on(&set), on(&grown));
        differ += u32::from(plain != with_copies);
        assert_eq!(
            row["settings"],
            if [Rival::Constant, Rival::Ulrich].contains(&rival) { plain } else { with_copies },
            "{row}"
        );
        assert_eq!(row["training"]["cases"], 24);
    }
    assert!(differ >= 2, "the copies make a difference: {differ}");
    let text = place.ok(&["eval", "run", "--part", "train", "--against", "constant,polly"]);
    assert!(text.contains("images of run (polly on 3 altered copies of each, too)\n"), "{text}");
    let text = place.ok(&["eval", "run", "--part", "train", "--against", "constant,ulrich"]);
    assert!(!text.contains("altered"), "{text}");
}

#[test]
fn all_are_beside_the_evolved_program_of_a_run() {
    let place = evolved();
    let report = json(&place, &["eval", "run", "--against", "all"]);
    let set = Dataset::load(place.path("data")).expect("sound");
    let (train, test) = set.split("drive_a*", "drive_b*").expect("both");
    let found = detectors(&report);
    let names: Vec<&str> = found.iter().map(|(name, _)| *name).collect();
    assert_eq!(names, ["evolved", "constant", "gradient", "polly", "lorigo", "ulrich"]);
    for (rival, (_, row)) in Rival::ALL.into_iter().zip(&found[1..]) {
        // The tolerance is that of the run.
        let mut tuned = rival.tune(&train, 3.0);
        let right = answers(&mut tuned, &test).expect("of one size");
        let right = right.iter().zip(test.labels()).filter(|(a, l)| (**a - *l as f32).abs() <= 3.0).count();
        assert_eq!(row["training"]["correct"], tuned.correct(), "{row}");
        assert_eq!(row["test"]["correct"], right, "{row}");
        assert_eq!((&row["training"]["cases"], &row["test"]["cases"]), (&24.into(), &24.into()));
        assert_eq!(row["tuned"], tuned.describe());
        assert_eq!(row["settings"], serde_json::to_value(&tuned).expect("JSON"));
        assert!(row["microseconds"].as_f64() > Some(0.0), "{row}");
    }
    for (part, name) in [("train", "training"), ("holdout", "test")] {
        let judged = json(&place, &["eval", "run", "--part", part]);
        let row = &found[0].1[name];
        assert_eq!((&row["correct"], &row["cases"]), (&judged["correct"], &judged["cases"]));
        assert_eq!(row["transience"], judged["transience"]);
    }
    assert_eq!((&report["same"], &report["shared_images"]), (&false.into(), &0.into()));
    // The file in the folder is of the run too; the images may be others.
    let file =
        ["eval", "run/best.gp", "--data", "data", "--match", "drive_b*", "--against", "polly,constant"];
    let file = json(&place, &file);
    let test_of = |report: &Value, name: &str| {
        let row = detectors(report).into_iter().find(|(n, _)| *n == name).expect("there").1.clone();
        (row["training"]["correct"].clone(), row["test"]["correct"].clone())
    };
    assert_eq!(detectors(&file).len(), 3);
    for name in ["evolved", "constant", "polly"] {
        assert_eq!(test_of(&file, name), test_of(&report, name), "{name}");
    }
    // With and without rivals the tolerance is that of the run, whatever the images.
    for program in ["run", "run/best.gp"] {
        let judged = json(&place, &["eval", program, "--data", "data", "--match", "drive_b*"]);
        assert_eq!((&judged["tolerance"], &report["tolerance"]), (&3.0.into(), &3.0.into()), "{program}");
        let tuned = ["eval", program, "--data", "data", "--tune-on", "data", "--against", "constant"];
        assert_eq!(json(&place, &tuned)["tolerance"], 3.0, "{program}");
    }
    let other = place.ok(&["eval", "run", "--tune-on", "data", "--against", "constant"]);
    assert_eq!(headings(&other), ["detector", "tuned", "on", "tested"], "{other}");
    let text = place.ok(&["eval", "run", "--against", "all"]);
    assert_eq!(headings(&text)[..3], ["detector", "training", "tested"], "{text}");
    assert!(plain(&text) && text.contains("the held-out images of run"), "{text}");
    for (name, row) in found {
        let line = text.lines().find(|line| line.starts_with(&format!("{name} "))).expect("a line");
        for part in ["training", "test"] {
            let share = row[part]["fitness"].as_f64().expect("a share");
            assert!(line.contains(&format!("{:.1} %", 100.0 * share)), "{line}");
        }
    }
    assert!(text.contains("polly (Horswill 1993): "), "{text}");
}

#[test]
fn other_programs_need_images_to_tune_on() {
    let place = Place::new();
    place.write("p.gp", "(individual (iterate-up 3x3 x-obstacle (set-a 20)))");
    let data = ["eval", "p.gp", "--data", "data"];
    let complaint = place.fails(2, &[&data[..], &["--against", "all"]].concat());
    assert!(complaint.contains("--tune-on"), "{complaint}");
    let complaint = place.fails(2, &[&data[..], &["--against", "polly,sonar"]].concat());
    assert!(complaint.contains("`sonar`"), "{complaint}");
    assert!(Rival::ALL.iter().all(|rival| complaint.contains(rival.name())), "{complaint}");
    let complaint = place.fails(2, &[&data[..], &["--tune-on", "data"]].concat());
    assert!(complaint.contains("--against"), "{complaint}");
    place.fails(2, &[&data[..], &["--against", "all", "--tune-on", "data", "--sensitivity"]].concat());
    place.fails(2, &["eval", "--data", "data"]);
    let complaint = place.fails(2, &["eval", "--against", "all"]);
    assert!(complaint.contains("--data"), "{complaint}");
    let complaint = place.fails(1, &[&data[..], &["--against", "all", "--tune-on", "nowhere"]].concat());
    assert!(complaint.contains("nowhere"), "{complaint}");
    place.ok(&["data", "synth", "small", "--frames", "2", "--size", "32x24"]);
    let complaint = place.fails(1, &[&data[..], &["--against", "all", "--tune-on", "small"]].concat());
    assert!(complaint.contains("32 x 24") && complaint.contains("64 x 48"), "{complaint}");
}

#[test]
fn rivals_by_themselves_and_images_that_are_not_held_out() {
    let place = Place::new();
    let tune = ["eval", "--data", "data", "--tune-on", "data", "--against", "constant,lorigo"];
    let report = json(&place, &tune);
    assert_eq!((&report["same"], &report["program"]), (&true.into(), &Value::Null));
    for (name, row) in detectors(&report) {
        assert_eq!(row["training"], row["test"], "{name}");
    }
    let text = place.ok(&tune);
    assert!(text.contains("nothing here is held out") && !text.contains("evolved"), "{text}");
    let part = [&tune[..], &["--tune-on-match", "drive_a*"]].concat();
    assert_eq!(json(&place, &part)["shared_images"], 3);
    let text = place.ok(&part);
    assert!(text.contains("3 of the tested images") && text.contains("images drive_a*"), "{text}");
}

#[test]
fn how_long_errors_last_by_hand() {
    let place = Place::new();
    place.write("p.gp", "(individual (iterate-up 3x3 x-obstacle (set-a 20)))");
    let set = Dataset::load(place.path("data")).expect("sound");
    let label = |image: usize, x: u32| {
        let name = format!("drive_{}_{image}.png", if image.is_multiple_of(2) { "a" } else { "b" });
        let case = set.cases().iter().find(|c| set.images()[c.image].name == name && c.x == x);
        f64::from(case.expect("labelled").y)
    };
    let mut seen = [0; 4];
    for tolerance in [2.0, 6.0, 9.0, 15.0] {
        // Drive a has the images 0, 2 and 4, drive b 1, 3 and 5.
        let (mut single, mut longest, mut errors) = (0, 0, 0);
        for drive in [[0, 2, 4], [1, 3, 5]] {
            for x in [8, 20, 33, 51] {
                let wrong = drive.map(|image| (20.0 - label(image, x)).abs() > tolerance);
                // In the last frame nobody can tell.
                let (alone, run) = match wrong {
                    [false, false, false] => (0, 0),
                    [false, false, true] => (0, 1),
                    [true, true, true] => (0, 3),
                    [true, true, false] | [false, true, true] => (0, 2),
                    [true, false, true] => (1, 1),
                    _ => (1, 1),
                };
                seen[run] += 1;
                single += alone;
                longest = longest.max(run);
                errors += wrong.iter().filter(|&&w| w).count();
            }
        }
        let limit = tolerance.to_string();
        let judged = ["eval", "p.gp", "--data", "data", "--tolerance", &limit];
        let report = json(&place, &judged);
        let found = &report["transience"];
        assert_eq!((&found["errors"], &found["single"]), (&errors.into(), &single.into()), "{found}");
        assert_eq!(found["longest"]["frames"].as_u64().unwrap_or(0), longest as u64, "{found}");
        // A constant is its own median.
        assert_eq!(found["median_correct"], report["correct"]);
        let text = place.ok(&judged);
        assert!(text.contains("With a median over three frames: "), "{text}");
    }
    assert!(seen.iter().filter(|&&n| n > 0).count() > 2, "not only one kind: {seen:?}");
    // Images by themselves have no next frame.
    let alone = json(&place, &["eval", "p.gp", "--data", "data", "--match", "drive_a_0*"]);
    assert_eq!(alone["transience"], Value::Null);
}
