//! `vsonar eval`: the verdicts by hand, the answers as CSV.

use serde_json::Value;
use vsonar::dataset::Dataset;
use vsonar::tree::Individual;

use crate::common::*;

const EXECUTORS: [&str; 7] =
    ["tree", "reference", "cranelift-scalar", "cranelift", "batch-scalar", "batch", "auto"];

fn eval(place: &Place, program: &str, more: &[&str]) -> Value {
    let body = format!("(individual (iterate-up 3x3 x-obstacle {program}))");
    place.write("p.gp", body);
    let text = place.ok(&[&["eval", "p.gp", "--data", "data", "--json"], more].concat());
    serde_json::from_str(&text).expect("one JSON value")
}

/// The rows below the header of the answers.
fn rows(text: &str) -> Vec<Vec<&str>> {
    let mut lines = text.lines();
    assert_eq!(lines.next(), Some("image,x,label,answer"));
    lines.map(|line| line.split(',').collect()).collect()
}

#[test]
fn verdicts_are_those_by_hand() {
    let place = Place::new();
    let labels = dataset(6, 0).labels();
    for tolerance in [0.0, 2.5, 10.0] {
        let limit = tolerance.to_string();
        let report = eval(&place, "(set-a 20)", &["--tolerance", &limit]);
        let count = |holds: &dyn Fn(f64) -> bool| labels.iter().filter(|&&l| holds(f64::from(l))).count();
        assert_eq!(report["cases"], labels.len());
        assert_eq!(report["correct"], count(&|l| (20.0 - l).abs() <= tolerance));
        assert_eq!(report["too_near"], count(&|l| 20.0 - l > tolerance), "lower in the image than the label");
        assert_eq!(report["too_far"], count(&|l| l - 20.0 > tolerance));
        assert_eq!(report["not_finite"], 0);
        let fitness = report["correct"].as_f64().expect("a number") / labels.len() as f64;
        assert_eq!(report["fitness"], fitness);
        for parts in ["columns", "images"] {
            for field in ["cases", "correct", "too_near", "too_far"] {
                let sum: u64 = report[parts]
                    .as_array()
                    .expect("a list")
                    .iter()
                    .map(|p| p[field].as_u64().expect("a count"))
                    .sum();
                assert_eq!(report[field], sum, "{parts}, {field}");
            }
        }
        assert_eq!(report["columns"].as_array().map(Vec::len), Some(4));
        assert_eq!(report["images"].as_array().map(Vec::len), Some(6));
        assert!(report["constant"]["correct"].as_u64() >= report["correct"].as_u64());
        assert!(report["constant"]["per_column_correct"].as_u64() >= report["constant"]["correct"].as_u64());
    }
}

#[test]
fn answers_that_are_no_number_are_wrong_and_counted_apart() {
    let place = Place::new();
    for (program, word) in [
        ("(set-a (square 1e38))", "inf"),
        ("(set-a (* -1 (square 1e38)))", "-inf"),
        ("(set-a (- (square 1e38) (square 1e38)))", "NaN"),
    ] {
        for executor in EXECUTORS {
            let report = eval(&place, program, &["--executor", executor, "--answers", "a.csv"]);
            assert_eq!((&report["correct"], &report["not_finite"]), (&Value::from(0), &Value::from(24)));
            let text = place.read("a.csv");
            assert!(rows(&text).iter().all(|row| row[3] == word), "{executor}: {text}");
        }
    }
}

#[test]
fn answers_are_exact_and_in_the_order_of_the_table() {
    let place = Place::new();
    let program = "(set-a (% (+ (* gradient-sq 1e6) (sin (+ x-obstacle y))) (- raw 90)))";
    let mut first = None;
    for executor in EXECUTORS {
        eval(&place, program, &["--executor", executor, "--answers", "a.csv"]);
        let text = place.read("a.csv");
        assert_eq!(first.get_or_insert(text.clone()), &text, "{executor}");
        assert_eq!(
            text,
            place.ok(&["eval", "p.gp", "--data", "data", "--answers", "-", "--executor", executor])
        );
    }
    let text = first.expect("four executors");
    let set = Dataset::load(place.path("data")).expect("sound");
    let individual = Individual::load(place.path("p.gp")).expect("sound");
    let labels: Vec<String> = place.read("data/labels.csv").lines().skip(1).map(str::to_string).collect();
    let rows = rows(&text);
    assert_eq!(rows.len(), labels.len());
    let cases = set.case_set();
    for (i, (row, label)) in rows.iter().zip(&labels).enumerate() {
        assert_eq!(row[..3].join(","), *label);
        let program = vsonar::lower::lower(&individual, set.width(), set.height());
        let exact = vsonar::ir::reference::answer(&program, cases.image(i), set.cases()[i].x as f32);
        let answer: f32 = row[3].parse().expect("a number");
        assert_eq!(answer.to_bits(), exact.to_bits(), "{row:?}");
        assert!(row[3].len() <= format!("{exact:e}").len().max(format!("{exact}").len()));
    }
}

#[test]
fn a_part_of_the_images_and_a_table_for_people() {
    let place = Place::new();
    let report = eval(&place, "(set-a 20)", &["--match", "drive_a*"]);
    assert_eq!((&report["cases"], report["images"].as_array().map(Vec::len)), (&Value::from(12), Some(3)));
    let text = place.ok(&["eval", "p.gp", "--data", "data"]);
    assert!(
        plain(&text) && text.contains("on these very images: per column") && text.contains("too near"),
        "{text}"
    );
    assert!(text.contains("drive_a_4.png"), "{text}");
    // An earlier file of answers is replaced as a whole.
    place.write("a.csv", format!("image,x,label,answer\n{}", "old\n".repeat(10_000)));
    place.ok(&["eval", "p.gp", "--data", "data", "--answers", "a.csv"]);
    assert_eq!(place.read("a.csv").lines().count(), 25);
}

/// The rows of the sensitivity table for this kind of change.
fn changed<'r>(report: &'r Value, change: &str) -> Vec<&'r Value> {
    let rows = report["sensitivity"].as_array().expect("a list");
    rows.iter().filter(|row| row["change"] == change).collect()
}

#[test]
fn sensitivity_of_a_constant_answer_by_hand() {
    let place = Place::new();
    let set = Dataset::load(place.path("data")).expect("sound");
    let report = eval(&place, "(set-a 20)", &["--sensitivity", "--tolerance", "2"]);
    let solved = |label: u32| label.abs_diff(20) <= 2;
    let correct = set.labels().iter().filter(|&&label| solved(label)).count();
    assert!(correct > 0 && report["correct"] == correct);
    // An answer that does not look does not depend on what there is to see; nor do the constants.
    for change in ["light", "brightness", "contrast", "gamma", "noise", "blur", "mirrored"] {
        let rows = changed(&report, change);
        assert!(!rows.is_empty(), "{change}");
        for row in rows {
            assert_eq!((&row["correct"], &row["cases"]), (&report["correct"], &report["cases"]), "{row}");
            assert_eq!((&row["fitness"], &row["unmodified"]), (&report["fitness"], &report["fitness"]));
            if change != "mirrored" {
                assert_eq!(row["constant_per_column"], report["constant"]["per_column_fitness"]);
            }
        }
    }
    for row in changed(&report, "down") {
        let down = row["strength"].as_f64().expect("a number") as i64;
        let moved = |&&label: &&u32| match (label, down > 0) {
            (0, true) | (47, false) => solved(label),
            _ => solved((i64::from(label) + down).clamp(0, 47) as u32),
        };
        assert_eq!(row["correct"], set.labels().iter().filter(moved).count(), "{row}");
        assert_eq!(row["unmodified"], report["fitness"]);
    }
    for row in changed(&report, "right") {
        let right = row["strength"].as_f64().expect("a number") as i64;
        let stays = |x: u32| (0..64).contains(&(i64::from(x) + right));
        let left: Vec<_> = set.cases().iter().filter(|case| stays(case.x)).collect();
        assert_eq!(row["cases"], left.len());
        let correct = left.iter().filter(|case| solved(case.y)).count();
        assert_eq!(row["correct"], correct, "{row}");
        assert_eq!(row["fitness"], row["unmodified"], "labels keep their rows");
    }
    let between = changed(&report, "between columns");
    assert_eq!(between.len(), 3);
    for row in between {
        let fraction = row["strength"].as_f64().expect("a number");
        let (expected, _) = set.between(fraction, 2.0).expect("some agree");
        assert_eq!(row["cases"], expected.cases().len());
    }
}

#[test]
fn sensitivity_is_the_same_with_every_executor_and_has_a_table() {
    let place = Place::new();
    let program = "(set-a (if-le raw 150 (if-le read-b 0.5 y read-a) (prog2 (set-b 1) read-a)))";
    let part = ["--match", "drive_a*", "--tolerance", "3", "--sensitivity"];
    let mut first = None;
    for executor in ["tree", "cranelift", "batch", "auto"] {
        let report = eval(&place, program, &[&part[..], &["--executor", executor]].concat());
        assert_eq!(*first.get_or_insert(report.clone()), report, "{executor}");
    }
    let report = first.expect("four executors");
    let rows = report["sensitivity"].as_array().expect("a list");
    let differing = rows.iter().filter(|row| row["fitness"] != row["unmodified"]).count();
    assert!(differing > 5, "a threshold depends on the light: {rows:?}");
    let text = place.ok(&[&["eval", "p.gp", "--data", "data"], &part[..]].concat());
    assert!(plain(&text) && text.contains("on these very images: per column"), "{text}");
    for row in rows {
        let share = |field: &str| format!("{:.1} %", 100.0 * row[field].as_f64().expect("a share"));
        let line = text.lines().find(|line| {
            let words: Vec<&str> = line.split_whitespace().collect();
            let strength = row["strength"].to_string();
            let strength = strength.trim_end_matches(".0");
            let change = row["change"].as_str().expect("a name");
            line.starts_with(change)
                && (change == "mirrored" || words.iter().any(|w| w.trim_start_matches('+') == strength))
        });
        let line = line.unwrap_or_else(|| panic!("no line of {row} in {text}"));
        for field in ["fitness", "unmodified", "constant_per_column"] {
            assert!(line.contains(&share(field)), "{field}: {line}");
        }
    }
    assert!(
        place
            .fails(2, &["eval", "p.gp", "--data", "data", "--sensitivity", "--answers", "-"])
            .contains("--answers")
    );
    // Nothing is asked of the images by a report without it.
    assert!(eval(&place, program, &[])["sensitivity"].is_null());
}
