//! `vsonar show`: pictures in a folder that appears complete or not at all.

use crate::common::*;

const PROGRAM: &str = "(individual (iterate-up 3x3 x-obstacle (if-le gradient 50 read-a (set-a y))))";

fn place() -> Place {
    let place = Place::new();
    place.write("p.gp", PROGRAM);
    place
}

/// The names of the files of a folder, in order.
fn names(place: &Place, folder: &str) -> Vec<String> {
    let entries = std::fs::read_dir(place.path(folder)).expect("a folder");
    let name = |e: std::io::Result<std::fs::DirEntry>| e.expect("readable").file_name();
    let mut names: Vec<String> = entries.map(|e| name(e).to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

#[test]
fn a_picture_for_each_image_and_a_sheet() {
    let place = place();
    let text = place.ok(&["show", "p.gp", "--data", "data", "--out", "pictures", "--scale", "2"]);
    assert!(text.starts_with("pictures: 6 pictures, all of them on contact-sheet.png\n"), "{text}");
    let report = place.ok(&["eval", "p.gp", "--data", "data", "--json"]);
    let report: serde_json::Value = serde_json::from_str(&report).expect("JSON");
    let correct = format!("\n{} of 24 answers correct", report["correct"]);
    assert!(text.contains(&correct), "{text}");
    let mut expected: Vec<String> = dataset(6, 0).images().iter().map(|i| i.name.clone()).collect();
    expected.push("contact-sheet.png".to_string());
    expected.sort();
    assert_eq!(names(&place, "pictures"), expected);
    for name in &expected {
        let picture = image::open(place.path("pictures").join(name)).expect("a picture");
        let (width, height) = (picture.width(), picture.height());
        let size = (2 * WIDTH, 2 * HEIGHT);
        assert!((width, height) == size || name == "contact-sheet.png", "{name}: {width} x {height}");
    }
    // A part of them.
    let more = ["--match", "drive_b*", "--out", "part"];
    place.ok(&[&["show", "p.gp", "--data", "data"], &more[..]].concat());
    let part = ["contact-sheet.png", "drive_b_1.png", "drive_b_3.png", "drive_b_5.png"];
    assert_eq!(names(&place, "part"), part);
}

#[test]
fn errors_leave_nothing_behind() {
    let place = place();
    place.write("bad.gp", "(individual");
    for (arguments, said) in [
        (["p.gp", "--data", "data", "--out", "data"], "never overwritten"),
        (["p.gp", "--data", "nowhere", "--out", "x"], "there is no folder"),
        (["bad.gp", "--data", "data", "--out", "x"], "bad.gp"),
        (["none.gp", "--data", "data", "--out", "x"], "none.gp"),
        (["p.gp", "--data", "data", "--out", "no/x"], "cannot make the folder"),
        (["p.gp", "--data", "data", "--out", ".."], "does not name"),
    ] {
        let complaint = place.fails(1, &[&["show"], &arguments[..]].concat());
        assert!(complaint.contains(said), "{arguments:?}: {complaint}");
    }
    assert!(place.fails(2, &["show", "p.gp", "--data", "data"]).contains("--out"));
}
