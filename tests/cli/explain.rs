//! `vsonar explain`: the readable form, what happens on the data, traces and files.

use crate::common::*;

/// Goes up until the gradient exceeds 50; a constant stands where nothing is done.
const PROGRAM: &str =
    "(individual (iterate-up 3x3 x-obstacle (if-le gradient 50 (+ read-c 0) (prog2 (set-a y) break))))";

fn place() -> Place {
    let place = Place::new();
    place.write("p.gp", PROGRAM);
    place
}

const LISTING: &str = "  \
  1  images of 64 x 48 pixels
  2
  3  the tree: a 3 x 3 window moves up column x-obstacle
  4      if gradient > 50:
  5          a := y
  6          stop
  7
  8  answer: a
";

#[test]
fn a_program_by_itself() {
    let place = place();
    let text = place.ok(&["explain", "p.gp", "--size", "64x48"]);
    assert!(text.contains(LISTING), "{text}");
    // However lines are broken.
    let text = text.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(
        text.contains("the same 144 answers as the compiled program on 6 random images, bit for bit"),
        "{text}"
    );
    // All but (+ read-c 0), for which a single node would do.
    assert!(text.contains("10 of 13 nodes do anything"), "{text}");
    assert!(
        text.contains("operators gradient; registers stored a, read none (in the tree, but not needed: c)"),
        "{text}"
    );
    assert!(!text.contains("Without each part"), "{text}");
    // The same for the usual size.
    assert!(place.ok(&["explain", "p.gp"]).contains("images of 320 x 240 pixels"));
}

#[test]
fn on_data_the_margins_count() {
    let place = place();
    let json = place.ok(&["explain", "p.gp", "--data", "data", "--json", "--trace"]);
    let report: serde_json::Value = serde_json::from_str(&json).expect("JSON");
    let eval = place.ok(&["eval", "p.gp", "--data", "data", "--json"]);
    let eval: serde_json::Value = serde_json::from_str(&eval).expect("JSON");
    assert_eq!(report["profile"]["correct"], eval["correct"]);
    assert_eq!((&report["checked"]["answers"], &report["checked"]["on"]), (&24.into(), &"data".into()));
    let sweep = &report["profile"]["sweeps"][0];
    let [choice, store, stop] = [0, 1, 2].map(|i| &sweep["sites"][i]);
    // Each position comes to the choice; where it holds, the rest is done.
    let number = |v: &serde_json::Value| v.as_u64().expect("a number");
    assert_eq!(number(&choice["held"]) + number(&choice["not"]), number(&sweep["positions"]));
    assert_eq!([&choice["held"], &store["held"], &stop["held"]], [&sweep["stopped"]; 3]);
    let text = place.ok(&["explain", "p.gp", "--data", "data"]);
    assert!(text.contains(&format!("stops {} of 24 cases", sweep["stopped"])), "{text}");
    // Without the only branch nothing is left but the answer 0.
    let tried = report["contributions"]["tried"].as_array().expect("a list");
    let never = tried.iter().find(|c| c["without"] == "never holds");
    assert_eq!(report["contributions"]["left_out"], 0);
    let zero = place_zero(&place);
    assert_eq!(never.expect("tried")["correct"], zero);
    // The trace ends where the first case's answer is.
    let last =
        report["trace"]["sweeps"][0]["positions"].as_array().expect("a list").last().expect("one").clone();
    assert_eq!(last["y"].as_f64(), report["trace"]["answer"].as_f64());
    assert_eq!(last["stopped"], true);
}

/// Correct answers of a program that answers 0.
fn place_zero(place: &Place) -> serde_json::Value {
    place.write("zero.gp", "(individual (iterate-up 3x3 x-obstacle 1))");
    let eval = place.ok(&["eval", "zero.gp", "--data", "data", "--json"]);
    serde_json::from_str::<serde_json::Value>(&eval).expect("JSON")["correct"].clone()
}

#[test]
fn a_trace_of_a_case() {
    let place = place();
    let text = place.ok(&["explain", "p.gp", "--data", "data", "--trace", "drive_b_1.png,33"]);
    assert!(text.contains("\nTrace of drive_b_1.png, column 33: answer "), "{text}");
    // By number, and of the column that comes first.
    assert!(
        place
            .ok(&["explain", "p.gp", "--data", "data", "--trace", "2"])
            .contains("\nTrace of drive_b_1.png, column 8:")
    );
    let rows = |full: &[&str]| {
        let all = [&["explain", "p.gp", "--data", "data", "--trace", "1,20"], full].concat();
        place.ok(&all).lines().filter(|line| line.ends_with("4 no")).count()
    };
    assert!(rows(&["--full"]) > rows(&[]), "some are alike");
    for (trace, said) in [
        ("drive_b_1.png,34", "the labelled columns of drive_b_1.png are 8, 20, 33, 51"),
        (
            "none.png,8",
            "has no image none.png,8; give a name, such as drive_a_0.png, or a number from 1 to 6",
        ),
        ("7,8", "has no image 7,8"),
        ("0,8", "has no image 0,8"),
    ] {
        let complaint = place.fails(1, &["explain", "p.gp", "--data", "data", "--trace", trace]);
        assert!(complaint.contains(said), "{trace}: {complaint}");
    }
}

#[test]
fn all_of_it_in_a_folder() {
    let place = place();
    place.ok(&["explain", "p.gp", "--data", "data", "--out", "x"]);
    let files = ["explanation.json", "explanation.md", "trace.svg", "trace.txt", "trees.dot", "trees.svg"];
    let mut found: Vec<String> = std::fs::read_dir(place.path("x"))
        .expect("a folder")
        .map(|e| e.expect("readable").file_name().to_string_lossy().into_owned())
        .collect();
    found.sort();
    assert_eq!(found, files);
    assert!(place.read("x/explanation.md").contains("```text\n  1  images of 64 x 48 pixels\n"));
    for name in ["trace.svg", "trees.svg"] {
        let svg = place.read(&format!("x/{name}"));
        assert!(svg.starts_with("<svg xmlns=") && svg.ends_with("</svg>\n"), "{name}");
        assert!(svg.contains("prefers-color-scheme"), "{name}");
    }
    // A node of the tree that does nothing is pale, one that does is not.
    let dot = place.read("x/trees.dot");
    assert!(dot.contains("[label=\"read-c\", color=gray"), "{dot}");
    assert!(dot.contains("[label=\"gradient\"];"), "{dot}");
    // The folder's files are not replaced unasked.
    let again = ["explain", "p.gp", "--data", "data", "--out", "x"];
    assert!(place.fails(1, &again).contains("exists already"));
    place.ok(&[&again[..], &["--force"]].concat());
    // One by one; without data there are no traces.
    place.ok(&["explain", "p.gp", "--markdown", "e.md", "--dot", "t.dot", "--svg", "t.svg"]);
    assert_eq!(place.read("t.dot"), dot);
    assert!(place.read("e.md").starts_with("# p.gp\n"));
}

#[test]
fn what_cannot_be_explained() {
    let place = place();
    place.write("bad.gp", "(individual\n  (iterate-up 3x3 x-obstacle (if-le gradient)))");
    place.write("p.vir", "vir 1\n");
    for (arguments, code, said) in [
        (&["bad.gp"][..], 1, "bad.gp: line 2, column 30"),
        (&["none.gp"], 1, "none.gp"),
        (&["p.vir"], 1, "explain the program as it was evolved"),
        (&["p.gp", "--data", "nowhere"], 1, "there is no folder"),
        (&["p.gp", "--trace"], 2, "say which with `--data`"),
        (&["p.gp", "--trace-svg", "t.svg"], 2, "say which with `--data`"),
        (&["p.gp", "--part", "train"], 2, "is no run folder"),
        (&["p.gp", "--size", "8x8"], 2, "--size"),
        (&["p.gp", "--data", "data", "--size", "64x48"], 2, "--size"),
        (&["p.gp", "--data", "data", "--out", "p.gp"], 1, "is no folder"),
        (&["p.gp", "--markdown", "p.gp"], 2, "p.gp: named twice, or the program itself"),
        (&["p.gp", "--svg", "s", "--dot", "s"], 2, "s: named twice"),
    ] {
        let complaint = place.fails(code, &[&["explain"], arguments].concat());
        assert!(complaint.contains(said), "{arguments:?}: {complaint}");
    }
}

#[test]
fn a_run_is_explained_on_its_own_data() {
    let place = place();
    let evolve = ["evolve", "--data", "data", "--holdout-match", "drive_b*", "--train-match", "drive_a*"];
    let short = ["--out", "run", "--population", "4", "--generations", "1", "--quiet"];
    place.ok(&[&evolve[..], &short].concat());
    let on = |arguments: &[&str]| {
        let json = place.ok(&[&["explain", "--json"], arguments].concat());
        let report: serde_json::Value = serde_json::from_str(&json).expect("JSON");
        (report["profile"]["cases"].clone(), report["profile"]["data"].as_str().expect("a name").to_string())
    };
    let lines = |arguments: &[&str]| {
        let text = place.ok(&[&["explain"], arguments].concat());
        // All but the names of the images.
        text.lines()
            .filter(|line| !line.contains(" of run") && !line.contains("data["))
            .map(str::to_string)
            .collect::<Vec<_>>()
    };
    // The held-out part, once the run is over; or the one that is asked for; or other data.
    for (flags, name, images) in [
        (&[][..], "the held-out images of run", "drive_b*"),
        (&["--part", "train"], "the training images of run", "drive_a*"),
    ] {
        let own = [&["run"], flags].concat();
        assert_eq!(on(&own), (12.into(), name.to_string()));
        assert_eq!(lines(&own), lines(&["run", "--data", "data", "--match", images]));
    }
    assert_eq!(on(&["run", "--data", "data"]), (24.into(), "data".to_string()));
    assert_eq!(on(&["run/best.gp", "--data", "data", "--match", "drive_a_0*"]).0, 4);
}
