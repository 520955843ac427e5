//! `vsonar synth`, and worlds where other commands take data.

use vsonar::dataset::Dataset;

use crate::common::*;

#[test]
fn a_recording_is_an_ordinary_folder() {
    let place = Place::new();
    let synth = |name: &str, more: &[&str]| {
        let text = place.ok(&[&["synth", "--world", "nsh", "--frames", "2", "--out", name], more].concat());
        assert!(text.contains("2 images of 320 x 240 pixels, 12 cases"), "{text}");
        let set = Dataset::load(place.path(name)).expect("sound");
        assert_eq!(set.images()[1].name, "nsh_0001.png", "in the order of time");
        set.fingerprint()
    };
    let own = synth("own", &[]);
    place.ok(&["data", "check", "own"]);
    assert_eq!(own, synth("again", &[]));
    let elsewhere = synth("elsewhere", &["--seed", "1"]);
    let changed = synth("changed", &["--changed"]);
    assert_eq!(changed, synth("changed too", &["--changed", "--seed", "3"]));
    assert!(own != elsewhere && own != changed && elsewhere != changed);
}

#[test]
fn a_building_of_ones_own() {
    let place = Place::new();
    place.write("own.plan", "plan 1\nroom 0 12 -1.2 1.2\nbin 6 0.9 0.3 0.3 0.5 0.12\nlight 6 0 1.2 0.3 1\n");
    place.write("camera.toml", "height = 0.7\npitch = 45.0\nfield_of_view = 80.0\ndistortion = 0.0\n");
    let synth = |name: &'static str, more: &[&'static str]| {
        let args = [&["synth", "--plan", "own.plan", "--frames", "2", "--out", name], more].concat();
        assert!(place.ok(&args).contains("2 images"));
        Dataset::load(place.path(name)).expect("sound").fingerprint()
    };
    let own = synth("own", &[]);
    assert_eq!(own, synth("again", &["--seed", "1"]));
    assert_ne!(own, synth("another camera", &["--camera", "camera.toml"]));
    place.write("bad.plan", "plan 1\nroom 0 12 -1.2 1.2\nbin 6 0.9 tall\n");
    let bad = place.fails(1, &["synth", "--plan", "bad.plan", "--out", "new"]);
    assert!(bad.contains("bad.plan:3: `bin` has 3 numbers"), "{bad}");
    // The limit lies within a character of two bytes.
    place.write("long.plan", format!("plan 1\nroom 0 12 -1.2 1.2\n#{}", "é".repeat(1 << 19)));
    let long = place.fails(1, &["synth", "--plan", "long.plan", "--out", "new"]);
    assert!(long.contains("long.plan: cannot read the plan: it is larger than 1 MiB"), "{long}");
    place.write("none.plan", "plan 1\n");
    assert!(
        place
            .fails(1, &["synth", "--plan", "none.plan", "--out", "new"])
            .contains("none.plan: there is no `room`")
    );
    assert!(place.fails(1, &["synth", "--plan", "not there", "--out", "new"]).contains("not there"));
    for more in [["--world", "nsh"], ["--changed", "--frames=1"]] {
        let args = [&["synth", "--plan", "own.plan", "--out", "new"], &more[..]].concat();
        assert!(place.fails(2, &args).contains("cannot be used with"));
    }
    assert!(
        place
            .fails(2, &["synth", "--world", "nsh", "--camera", "camera.toml", "--out", "new"])
            .contains("cannot be used with")
    );
}

#[test]
fn a_robot_that_cannot_stand_at_its_start_is_an_error() {
    let place = Place::new();
    let fails = |plan: &str| {
        place.write("own.plan", plan);
        place.fails(1, &["synth", "--plan", "own.plan", "--frames", "1", "--out", "new"])
    };
    // On a wall, next to one, in a box, before the second start; a comment is none.
    for (line, x, y) in [(4, 6.0, 1.2), (4, 6.0, -1.2), (4, 6.0, 1.0), (6, 9.0, 0.0)] {
        let filled = "# start 1 1 1\n".repeat(line - 4);
        let plan = "plan 1\nroom 0 12 -1.2 1.2\nbox 9 0 1 1 1 0.2\n";
        let said = fails(&format!("{plan}{filled}  start {x} {y} 90 # here\nstart 6 0 0\n"));
        let place = format!("error: own.plan:{line}: a robot 0.48 m wide cannot stand at ({x}, {y})");
        assert!(said.starts_with(&place) && said.contains("move the `start`"), "{said}");
    }
    let said = fails("plan 1\nroom 0 0.3 0 0.3\n");
    assert!(said.starts_with("error: own.plan: no place was found") && said.contains("0.48 m"), "{said}");
    place.write("own.plan", "plan 1\nroom 0 12 -1.2 1.2\nstart 6 0.95 0\n");
    place.ok(&["synth", "--plan", "own.plan", "--frames", "1", "--out", "new"]);
}

#[test]
fn a_camera_that_no_pictures_are_rendered_by_is_named_with_its_file() {
    let place = Place::new();
    place.write("own.plan", "plan 1\nroom 0 12 -1.2 1.2\n");
    for (height, pitch, view, said) in [
        (
            "0.8",
            "51.0",
            "175.0",
            ["`field_of_view` is 175, but must be 6 to 170 degrees", "5.8 to 171.8 degrees"],
        ),
        ("0.8", "-10.0", "90.0", ["`pitch` is -10, but must be 0 to 85 degrees", "0 to 85.9 degrees"]),
        ("2.5", "51.0", "90.0", ["`height` is 2.5, but must be 0.05 to 1.8 metres", "0.05 to 2 metres"]),
    ] {
        place.write("c.toml", format!("height = {height}\npitch = {pitch}\nfield_of_view = {view}\n"));
        let office = ["synth", "--plan", "own.plan", "--camera", "c.toml", "--out", "new"];
        let corridor = ["data", "synth", "new", "--camera", "c.toml"];
        for (command, said) in [&office[..], &corridor].into_iter().zip(said) {
            let complaint = place.fails(1, command);
            assert!(complaint.starts_with("error: c.toml: ") && complaint.contains(said), "{complaint}");
        }
    }
}

#[test]
fn a_folder_that_cannot_be_made_is_told_by_its_name() {
    let place = Place::new();
    // So many images would take far longer than a test may.
    for arguments in [
        &["synth", "--world", "fmrb", "--frames", "10000", "--out", "no/x"][..],
        &["data", "synth", "no/x", "--frames", "10000", "--size", "2000x2000"],
    ] {
        let complaint = place.fails(1, arguments);
        assert!(complaint.starts_with("error: no/x: cannot make the folder"), "{complaint}");
        assert!(complaint.contains("check the path") && !complaint.contains(".part"), "{complaint}");
    }
}

#[test]
fn numbers_out_of_range_are_wrong_usage() {
    let place = Place::new();
    let world = ["synth", "--world", "fmrb", "--out", "x"];
    for (command, flag, value) in [
        (&world[..], "--frames", "0"),
        (&world, "--frames", "99999999"),
        (&world, "--frames", "-1"),
        (&world, "--seed", "-1"),
        (&["data", "synth", "x"], "--frames", "0"),
        (&["drive", "x.gp"], "--seed", "-1"),
        (&["drive", "x.gp"], "--minutes", "-3"),
    ] {
        let complaint = place.fails(2, &[command, &[flag, value]].concat());
        let named = complaint.contains(&format!("invalid value '{value}' for '{flag}"));
        assert!(named && !complaint.contains("-- -"), "{complaint}");
    }
    let complaint = place.fails(2, &[&world[..], &["--frames", "10001"]].concat());
    assert!(complaint.contains("1..=10000"), "{complaint}");
}

#[test]
fn faults_name_a_remedy() {
    let place = Place::new();
    let synth = |more: &[&'static str]| [&["synth", "--out", "new"], more].concat();
    assert!(place.fails(2, &synth(&["--world", "mars"])).contains("choose nsh, fmrb or combined"));
    assert!(place.fails(2, &synth(&[])).contains("--world"));
    assert!(place.fails(2, &synth(&["--world", "nsh", "--frames", "0"])).contains("1..=10000"));
    let taken = ["synth", "--world", "nsh", "--out", "data"];
    assert!(place.fails(1, &taken).contains("never overwritten"));
    assert!(place.fails(2, &["evolve", "--world", "mars"]).contains("nsh, fmrb or combined"));
    for (flag, value) in [
        ("--data", "data"),
        ("--holdout", "25%"),
        ("--train-match", "x*"),
        ("--validation", "25%"),
        ("--split-by", "group"),
        ("--gap", "1"),
        ("--folds", "3"),
    ] {
        // the file that is not there keeps a flag that slips through from starting a run
        let complaint = place.fails(2, &["evolve", "--world", "nsh", flag, value, "--settings", "none.toml"]);
        assert!(complaint.contains("cannot be used with") && complaint.contains(flag), "{complaint}");
    }
    for (text, parts) in [
        ("validation_building = 4\nholdout_building = 4", ["bad.toml", "both 4"]),
        ("holdout_building = 1", ["bad.toml", "both 1"]),
        ("frames = 0", ["`frames`", "choose 1 to 10000"]),
        ("frames = 10001", ["bad.toml", "`frames`"]),
    ] {
        place.write("bad.toml", format!("[data.world]\nname = \"fmrb\"\n{text}\n"));
        let complaint = place.fails(1, &["evolve", "--settings", "bad.toml"]);
        assert!(parts.iter().all(|part| complaint.contains(part)), "{complaint}");
    }
    place.write("mars.toml", "[data.world]\nname = \"mars\"\n");
    let complaint = place.fails(1, &["evolve", "--settings", "mars.toml"]);
    assert!(complaint.contains("mars.toml") && complaint.contains("`fmrb`"), "{complaint}");
}

#[test]
fn a_sweep_can_name_a_world() {
    let place = Place::new();
    let spec = |data: &str| {
        place.write(
            "spec.toml",
            format!("seeds = 1\n[[data]]\nname = \"x\"\n{data}\n[[setting]]\nname = \"y\"\n"),
        );
    };
    spec("world.name = \"fmrb\"");
    assert!(place.ok(&["sweep", "spec.toml", "--dry-run"]).contains("to make"));
    spec("world.name = \"fmrb\"\nsynthetic = {}");
    assert!(place.fails(1, &["sweep", "spec.toml", "--dry-run"]).contains("[data.world]"));
    spec("world.nome = \"fmrb\"");
    assert!(place.fails(1, &["sweep", "spec.toml", "--dry-run"]).contains("nome"));
}
