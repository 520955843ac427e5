//! A program on the simulated robot: tables, JSON, the folder.

use serde_json::Value;

use crate::common::*;

/// Sees an obstacle where the gradient is more than 60.
const PROGRAM: &str = "(individual (iterate-up 3x3 x-obstacle
    (if-le gradient 60 read-a (prog2 (set-a y) break))))";

fn place() -> Place {
    let place = Place::new();
    place.write("p.gp", PROGRAM);
    place
}

/// The flags of a drive that takes next to no time.
fn short<'a>(flags: &[&'a str]) -> Vec<&'a str> {
    [&["drive", "p.gp", "--minutes", "0.05", "--runs", "2"], flags].concat()
}

#[test]
fn tables_put_all_beside_what_was_published() {
    let text = place().ok(&short(&["--against", "all"]));
    assert!(plain(&text), "{text:?}");
    for sensor in ["p.gp", "sonar", "truth", "constant", "gradient", "polly", "lorigo", "ulrich"] {
        let rows = text.lines().filter(|line| line.split_whitespace().next() == Some(sensor)).count();
        assert_eq!(rows, 3, "two runs and their sum: {text}");
        assert!(text.contains(&format!("{sensor}, run 2: ")), "{text}");
    }
    for published in [["133", "260", "20:01", "39:32"].as_slice(), &["72", "10:00"]] {
        let row = text.lines().find(|line| line.starts_with("published") && line.contains(published[0]));
        let row = row.unwrap_or_else(|| panic!("{text}"));
        assert!(published.iter().all(|number| row.contains(number)), "{row}");
    }
    assert!(text.contains("times real time"), "{text}");
}

#[test]
fn json_and_the_folder_say_the_same_whatever_the_threads() {
    let place = place();
    let json = |flags: &[&str]| -> Value {
        let all = [&["--json", "--quiet", "--against", "truth"], flags].concat();
        let mut value: Value = serde_json::from_str(&place.ok(&short(&all))).expect("JSON");
        let timing = value.as_object_mut().expect("an object").remove("timing").expect("it is there");
        assert!(timing["simulated_seconds"].as_f64().is_some_and(|s| s > 0.0), "{timing}");
        value
    };
    let one = json(&["--threads", "1"]);
    let two = json(&["--threads", "2", "--out", "out", "--video"]);
    assert_eq!(one, two);
    assert_eq!(one["sensors"][0]["runs"][1]["number"], 2);
    assert_eq!(one["sensors"][1]["summary"]["accuracy"]["errors"], 0);
    assert_eq!(one["published"][0]["metres"], 133.0);
    assert_ne!(json(&["--seed", "2"])["sensors"], one["sensors"], "another building");

    let mut written: Value = serde_json::from_str(&place.read("out/drive.json")).expect("JSON");
    written.as_object_mut().expect("an object").remove("timing");
    assert_eq!(written, one);
    let names = ["p.gp-run-1", "p.gp-run-2", "truth-run-1", "truth-run-2"];
    assert!(names.iter().all(|name| place.read(&format!("out/{name}.svg")).starts_with("<svg ")));
    assert!(place.read("out/paths.csv").starts_with("sensor,run,seconds,x,y\np.gp,1,0,"));
    let film = std::fs::read(place.path("out/run-1.y4m")).expect("there");
    let frame = 6 + 320 * 240 * 3 / 2;
    assert!(film.starts_with(b"YUV4MPEG2 W320 H240 F10:1 ") && film.len() > 30 * frame, "{}", film.len());
    let files = std::fs::read_dir(place.path("out")).expect("a folder").count();
    assert_eq!(files, 7, "and nothing else");
}

#[test]
fn a_run_folder_stands_for_its_best_program() {
    let place = place();
    std::fs::create_dir(place.path("a-run")).expect("writable");
    place.write("a-run/best.gp", PROGRAM);
    let of = |program: &str| {
        let text = place.ok(&["drive", program, "--minutes", "0.02", "--runs", "1", "--json", "--quiet"]);
        serde_json::from_str::<Value>(&text).expect("JSON")["sensors"][0]["runs"].clone()
    };
    assert_eq!(of("a-run"), of("p.gp"));
    place.write("p.vir", place.ok(&["ir", "p.gp"]));
    assert_eq!(of("p.vir"), of("p.gp"));
}

#[test]
fn what_cannot_be_done_is_refused() {
    let place = place();
    place.write("small.vir", place.ok(&["ir", "p.gp", "--size", "64x48"]));
    for (code, flags, said) in [
        (2, &["p.gp", "--world", "mars"][..], "choose fmrb or nsh"),
        (2, &["p.gp", "--world", "combined"], "--tune-on combined"),
        (2, &["p.gp", "--against", "radar"], "radar"),
        (2, &["p.gp", "--tune-on", "nsh"], "--against"),
        (2, &["p.gp", "--runs", "0"], "0"),
        (2, &["p.gp", "--minutes", "nan"], "minutes"),
        (2, &["p.gp", "--columns", "400,"], "400 is outside"),
        (2, &["p.gp", "--video"], "--out"),
        (2, &[], "PROGRAM"),
        (1, &["p.gp", "--out", "data"], "exists already"),
        (1, &["p.gp", "--out", "no/such"], "cannot make the folder"),
        (1, &["none.gp"], "none.gp"),
        (1, &["data"], "best.gp"),
        (1, &["small.vir"], "64x48"),
    ] {
        let complaint = place.fails(code, &[&["drive"], flags].concat());
        assert!(complaint.contains(said), "{flags:?}: {complaint}");
    }
}
