//! The smaller commands: listings, data folders, completions.

use serde_json::Value;
use vsonar::dataset::Dataset;

use crate::common::*;

const PROGRAM: &str =
    "(individual (iterate-down 3x3 x-obstacle (if-le gradient (* 3 100) read-a (set-a (+ y (* 0 y))))))";

#[test]
fn every_stage_of_a_program() {
    let place = Place::new();
    place.write("p.gp", PROGRAM);
    let stage = |file: &str, stage: &str, more: &[&str]| {
        place.ok(&[&["ir", file, "--size", "64x48", "--stage", stage], more].concat())
    };
    let (lowered, optimised) = (stage("p.gp", "lowered", &[]), stage("p.gp", "optimised", &[]));
    assert!(lowered.lines().count() > optimised.lines().count(), "{lowered}{optimised}");
    assert!(lowered.contains("image 64x48"));
    // The listings are programs themselves.
    place.write("low.vir", &lowered);
    place.write("opt.vir", &optimised);
    assert_eq!(stage("low.vir", "lowered", &[]), lowered);
    assert_eq!(stage("low.vir", "optimised", &[]), optimised);
    assert_eq!(place.ok(&["ir", "opt.vir"]), optimised);
    assert!(place.fails(2, &["ir", "opt.vir", "--size", "65x48"]).contains("64x48"));
    let mut forms = Vec::new();
    for executor in ["cranelift", "cranelift-scalar"] {
        let clif = stage("p.gp", "clif", &["--executor", executor]);
        assert!(clif.contains("function"), "{clif}");
        assert_eq!(stage("opt.vir", "clif", &["--executor", executor]), clif);
        assert!(!stage("p.gp", "asm", &["--executor", executor]).is_empty());
        forms.push(clif);
    }
    assert!(forms[0].contains("f32x4") && !forms[1].contains("f32x4"));
}

#[test]
fn a_reader_that_leaves_is_no_error() {
    let place = Place::new();
    place.write("p.gp", PROGRAM);
    for arguments in
        [&["ir", "p.gp"] as &[&str], &["completions", "bash"], &["eval", "p.gp", "--data", "data"]]
    {
        let (reader, writer) = std::io::pipe().expect("a pipe");
        drop(reader);
        let output = place.command(arguments).stdout(writer).output().expect("started");
        assert!(output.status.success() && output.stderr.is_empty(), "{arguments:?}: {output:?}");
    }
}

#[test]
fn data_is_checked() {
    let place = Place::new();
    let text = place.ok(&["data", "check", "data"]);
    assert!(
        text.contains("24 cases") && text.contains("no faults") && text.contains("best constant"),
        "{text}"
    );
    let report: Value = serde_json::from_str(&place.ok(&["data", "check", "data", "--json"])).expect("JSON");
    assert_eq!(report["faults"].as_array().map(Vec::len), Some(0));
    let labels = place.read("data/labels.csv");
    place.write("data/labels.csv", labels + "none.png,1,1\ndrive_a_0.png,64,1\n");
    let check = place.command(&["data", "check", "data", "--json"]).output().expect("started");
    let report: Value = serde_json::from_slice(&check.stdout).expect("JSON");
    assert_eq!((check.status.code(), report["faults"].as_array().map(Vec::len)), (Some(1), Some(2)));
}

#[test]
fn a_corridor_is_an_ordinary_folder() {
    let place = Place::new();
    let text = place.ok(&["data", "synth", "corridor", "--frames", "2", "--seed", "5"]);
    assert!(text.contains("2 images of 320 x 240 pixels, 12 cases"), "{text}");
    place.ok(&["data", "check", "corridor"]);
    place.ok(&["data", "synth", "again", "--frames", "2", "--seed", "5"]);
    place.ok(&["data", "synth", "other", "--frames", "2", "--seed", "6"]);
    let fingerprint = |name: &str| Dataset::load(place.path(name)).expect("sound").fingerprint();
    assert_eq!(fingerprint("corridor"), fingerprint("again"));
    assert_ne!(fingerprint("corridor"), fingerprint("other"));
}

#[test]
fn a_corridor_is_seen_by_a_calibrated_camera() {
    let place = Place::new();
    place.write("same.toml", "height = 0.8\npitch = 51\nfield_of_view = 90\n");
    place.write("bent.toml", "height = 0.8\npitch = 51\nfield_of_view = 90\ndistortion = -0.2\n");
    place.write("high.toml", "height = 20\npitch = 51\nfield_of_view = 90\n");
    let synth = |name: &str, more: &[&str]| {
        place.ok(&[&["data", "synth", name, "--frames", "2"], more].concat());
        Dataset::load(place.path(name)).expect("sound").fingerprint()
    };
    let plain = synth("plain", &[]);
    assert_eq!(plain, synth("same", &["--camera", "same.toml"]));
    assert_ne!(plain, synth("bent", &["--camera", "bent.toml"]));
    let complaint = place.fails(1, &["data", "synth", "new", "--camera", "high.toml"]);
    assert!(complaint.contains("high.toml: ") && complaint.contains("`height` is 20"), "{complaint}");
    let complaint = place.fails(1, &["data", "synth", "new", "--camera", "none.toml"]);
    assert!(complaint.contains("none.toml"), "{complaint}");
}

#[test]
fn completions_for_every_shell() {
    let place = Place::new();
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let script = place.ok(&["completions", shell]);
        assert!(
            script.contains("vsonar") && script.contains("evolve") && script.contains("generations"),
            "{shell}"
        );
    }
}

#[test]
fn the_version_is_the_package_s() {
    assert_eq!(Place::new().ok(&["--version"]), format!("vsonar {}\n", env!("CARGO_PKG_VERSION")));
}
