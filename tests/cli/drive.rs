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
    let (text, aside) = place().ok_with_progress(&short(&["--against", "all"]));
    assert!(plain(&text), "{text:?}");
    for sensor in ["program", "sonar", "truth", "constant", "gradient", "polly", "lorigo", "ulrich", "flow"] {
        let rows = text.lines().filter(|line| line.split_whitespace().next() == Some(sensor)).count();
        assert_eq!(rows, 3, "two runs and their sum: {text}");
        assert!(aside.contains(&format!("{sensor}, run 2: ")), "{aside}");
    }
    for published in [["133", "260", "20:01", "39:32"].as_slice(), &["72", "10:00"]] {
        let row = text.lines().find(|line| line.starts_with("published") && line.contains(published[0]));
        let row = row.unwrap_or_else(|| panic!("{text}"));
        assert!(published.iter().all(|number| row.contains(number)), "{row}");
    }
    assert!(text.contains("times real time"), "{text}");
    assert!(text.contains("p.gp in fmrb, the building of the training set"), "{text}");
    assert!(
        text.contains(
            "the 71 training images of the world fmrb (gradient, polly, lorigo on an altered copy of each, too); "
        ),
        "{text}"
    );
    let sums = text.lines().position(|line| line.contains("held out  runs")).expect("the table");
    let cells = |sensor: &str| -> Vec<String> {
        let row = text.lines().skip(sums).find(|line| line.split_whitespace().next() == Some(sensor));
        row.expect("a row").split_whitespace().map(str::to_string).collect()
    };
    assert_eq!(cells("truth")[1..5], ["100.0", "%", "100.0", "%"]);
    assert_eq!(cells("sonar")[1..4], ["-", "-", "2"]);
    assert!(cells("program")[5] == "2" && cells("ulrich")[5] == "2", "{text}");
    let headings = text.lines().nth(sums).expect("there");
    for heading in
        ["training", "held out", "metres per collision", "walked into", "median right", "one frame"]
    {
        assert!(headings.contains(heading), "{headings}");
    }
    assert!(text.contains("+: runs that got stuck"), "{text}");
}

#[test]
fn a_run_drives_in_its_own_building() {
    let place = Place::new();
    let small = ["--population", "20", "--generations", "1", "--set", "filter.enabled=false", "--quiet"];
    for (world, own) in [("nsh", "nsh"), ("combined", "fmrb")] {
        place.ok(&[&["evolve", "--world", world, "--out", world], &small[..]].concat());
        let drive = ["drive", world, "--minutes", "0.01", "--runs", "1", "--quiet", "--json"];
        let report: Value = serde_json::from_str(&place.ok(&drive)).expect("JSON");
        assert_eq!(report["world"], own);
        let elsewhere = [&drive[..], &["--world", if own == "nsh" { "fmrb" } else { "nsh" }]].concat();
        let report: Value = serde_json::from_str(&place.ok(&elsewhere)).expect("JSON");
        assert_ne!(report["world"], own);
    }
}

#[test]
fn scores_are_those_of_eval_and_rivals_follow_the_program() {
    let place = place();
    let json = |flags: &[&str]| -> Value {
        serde_json::from_str(&place.ok(&[flags, &["--json"]].concat())).expect("JSON")
    };
    place.ok(&["synth", "--world", "nsh", "--out", "nsh"]);
    place.ok(&["synth", "--world", "nsh", "--seed", "2", "--out", "nsh-elsewhere"]);
    let drive = ["--minutes", "0.01", "--runs", "1", "--quiet", "--against", "constant"];
    let report = json(&[&["drive", "p.gp", "--tune-on", "nsh"], &drive[..]].concat());
    assert_eq!(
        (&report["tuned_on"]["world"], &report["tuned_on"]["tolerance"]),
        (&"nsh".into(), &10.0.into())
    );
    for (part, folder) in [("training", "nsh"), ("held_out", "nsh-elsewhere")] {
        let judged = json(&["eval", "p.gp", "--data", folder]);
        assert_eq!(report["sensors"][0]["scores"][part], judged["fitness"], "{part}");
        let rivals = ["eval", "--data", folder, "--tune-on", "nsh", "--against", "constant"];
        let judged = json(&rivals);
        assert_eq!(report["sensors"][1]["scores"][part], judged["detectors"][0]["test"]["fitness"], "{part}");
    }
    // A run of its own in another world than the one it drives in.
    let run =
        ["evolve", "--world", "nsh", "--population", "20", "--generations", "1", "--quiet", "--out", "run"];
    place.ok(&[&run[..], &["--tolerance", "7"]].concat());
    for program in ["run", "run/best.gp"] {
        let own = &json(&[&["drive", program], &drive[..]].concat())["tuned_on"];
        assert_eq!((&own["world"], &own["tolerance"]), (&"nsh".into(), &7.0.into()), "{program}");
        assert_eq!(own["as_the_program"], true);
    }
    let other = json(&[&["drive", "run", "--tune-on", "combined"], &drive[..]].concat());
    assert_eq!(other["tuned_on"]["world"], "combined");
    assert_eq!(other["tuned_on"]["as_the_program"], false);
    let plain = json(&[&["drive", "p.gp"], &drive[..]].concat());
    assert_eq!(plain["tuned_on"]["world"], "fmrb");
}

/// A program that always gives the same row.
fn always(row: u32) -> String {
    format!("(individual (iterate-up 3x3 x-obstacle (set-a {row})))")
}

#[test]
fn one_who_sees_nothing_collides_and_one_who_sees_walls_is_stuck() {
    let place = place();
    let sum = |row: u32, seed: &str| -> Value {
        place.write("a.gp", always(row));
        let flags = ["drive", "a.gp", "--minutes", "5", "--runs", "2", "--json", "--quiet", "--changed"];
        let report: Value =
            serde_json::from_str(&place.ok(&[&flags[..], &["--seed", seed]].concat())).expect("JSON");
        assert_eq!((&report["asked"], &report["interrupted"]), (&2.into(), &false.into()));
        assert_eq!((&report["program"], &report["seed"]), (&"a.gp".into(), &1.into()));
        report["sensors"][0]["summary"].clone()
    };
    let blind = sum(0, "1");
    assert_eq!((&blind["collisions"], &blind["stuck"]), (&2.into(), &0.into()));
    let total = blind["total_metres"].as_f64().expect("metres");
    assert_eq!(blind["metres_per_collision"].as_f64(), Some(total / 2.0));
    let scared = sum(239, "1");
    assert_eq!((&scared["collisions"], &scared["stuck"]), (&0.into(), &2.into()));
    assert_eq!(scared["metres_per_collision"], Value::Null);
    let text = place.ok(&["drive", "a.gp", "--minutes", "5", "--runs", "1", "--median"]);
    assert!(text.contains("no collision in 0.0 m") && text.contains("0.0+"), "{text}");
    assert!(text.contains("The robot believed the medians"), "{text}");
}

#[test]
fn a_changed_building_has_a_seed_and_names_are_no_commands() {
    let place = place();
    place.write("sonar\u{1b}[2J", PROGRAM);
    let flags = ["drive", "sonar\u{1b}[2J", "--minutes", "0.01", "--runs", "1", "--changed"];
    let all = [&flags[..], &["--against", "sonar", "--out", "out"]].concat();
    let text = place.ok(&all);
    assert!(plain(&text) && text.contains(r"sonar\u{1b}[2J in fmrb, building 3, changed"), "{text:?}");
    let written: Value = serde_json::from_str(&place.read("out/drive.json")).expect("JSON");
    assert_eq!((&written["seed"], &written["program"]), (&3.into(), &"sonar\u{1b}[2J".into()));
    for name in ["program", "sonar"] {
        assert!(place.read(&format!("out/{name}-run-1.svg")).contains("<svg "));
        assert!(place.read("out/paths.csv").contains(&format!("\n{name},1,0,")));
    }
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
    assert_eq!(one, json(&["--threads", "4096"]));
    assert_eq!(one["sensors"][0]["runs"][1]["number"], 2);
    assert_eq!(one["sensors"][1]["summary"]["accuracy"]["errors"], 0);
    assert_eq!(one["published"][0]["metres"], 133.0);
    assert_ne!(json(&["--seed", "2"])["sensors"], one["sensors"], "another building");

    let mut written: Value = serde_json::from_str(&place.read("out/drive.json")).expect("JSON");
    written.as_object_mut().expect("an object").remove("timing");
    assert_eq!(written, one);
    let names = ["program-run-1", "program-run-2", "truth-run-1", "truth-run-2"];
    assert!(names.iter().all(|name| place.read(&format!("out/{name}.svg")).starts_with("<svg ")));
    assert!(place.read("out/paths.csv").starts_with("sensor,run,seconds,x,y\nprogram,1,0,"));
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
