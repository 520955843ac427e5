//! Data, settings, checkpoints and flags that do not make sense.

use image::{GrayImage, Luma};

use crate::common::*;

/// A folder with one image and these rows of labels.
fn folder(place: &Place, name: &str, width: u32, height: u32, rows: &str) {
    std::fs::create_dir(place.path(name)).expect("writable");
    let image = GrayImage::from_fn(width, height, |x, y| Luma([(x * 7 + y * 13) as u8]));
    image.save(place.path(name).join("a.png")).expect("writable");
    place.write(&format!("{name}/labels.csv"), format!("image,x,y\n{rows}"));
}

#[test]
fn data_that_cannot_be_used() {
    let place = Place::new();
    place.write("up.gp", "(individual (iterate-up 3x3 x-obstacle (set-a y)))");
    folder(&place, "small", 15, 48, "a.png,3,4\n");
    folder(&place, "outside", 64, 48, "a.png,64,4\na.png,3,48\na.png,-1,4\n");
    folder(&place, "cut", 64, 48, "a.png,3,4\n");
    let png = std::fs::read(place.path("cut/a.png")).expect("there");
    place.write("cut/a.png", &png[..png.len() / 2]);
    folder(&place, "unlabelled", 64, 48, "");
    std::fs::remove_file(place.path("unlabelled/labels.csv")).expect("there");
    folder(&place, "empty", 64, 48, "");
    folder(&place, "elsewhere", 64, 48, "b.png,3,4\n");
    for (name, said) in [
        ("small", "15x48"),
        ("outside", "labels.csv line 2: x is 64"),
        ("outside", "labels.csv line 3: y is 48"),
        ("outside", "labels.csv line 4: x is -1"),
        ("cut", "`a.png` cannot be used"),
        ("unlabelled", "labels.csv is missing"),
        ("empty", "no cases"),
        ("elsewhere", "`b.png` is missing"),
        ("nowhere", "there is no folder"),
    ] {
        for arguments in [["evolve", "--data", name].to_vec(), ["eval", "up.gp", "--data", name].to_vec()] {
            let complaint = place.fails(1, &arguments);
            assert!(complaint.contains(said) && complaint.contains(name), "{arguments:?}: {complaint}");
        }
        let complaint = place.fails(1, &["evolve", "--data", "data", "--holdout", name]);
        assert!(complaint.contains(said), "{complaint}");
        // The check tells the same, as its result.
        let check = place.command(&["data", "check", name]).output().expect("started");
        assert_eq!(check.status.code(), Some(1));
        assert!(String::from_utf8_lossy(&check.stdout).contains(said) && check.stderr.is_empty());
    }
}

#[test]
fn patterns_that_match_nothing_or_too_much() {
    let place = Place::new();
    for (train, holdout, said) in [
        ("x*", "drive_b*", "matches `x*`"),
        ("drive*", "drive_b*", "match both"),
        ("[", "drive_b*", "malformed"),
    ] {
        let arguments = ["evolve", "--data", "data", "--train-match", train, "--holdout-match", holdout];
        assert!(place.fails(1, &arguments).contains(said));
    }
}

#[test]
fn settings_that_are_wrong() {
    let place = Place::new();
    for (text, said) in [
        ("seed = 1\npopulatoin = 5\n", ":2:1: unknown field `populatoin`"),
        ("[selection]\nsize = 5\n", ":2:1: unknown field `size`"),
        ("population = 1\n", ":1:14: the setting `population` is 1"),
        ("population = \"many\"\n", ":1:14:"),
        ("[nodes]\ngradeint = 0\n", ":2:12:"),
        ("preset = \"best\"\n", ":1:10:"),
        ("seed = \n", ":1:"),
    ] {
        place.write("my.toml", text);
        let complaint = place.fails(1, &["evolve", "--data", "data", "--settings", "my.toml"]);
        assert!(complaint.contains(&format!("my.toml{said}")), "{text}: {complaint}");
    }
    assert!(place.fails(1, &["evolve", "--settings", "none.toml"]).contains("none.toml"));
    place.write("my.toml", "preset = \"paper\"\n");
    let both = ["evolve", "--settings", "my.toml", "--preset", "default"];
    assert!(place.fails(2, &both).contains("--preset"));
}

#[test]
fn a_run_folder_is_never_overwritten() {
    let place = Place::new();
    place.ok(&tiny(&["--out", "run"]));
    let complaint = place.fails(1, &tiny(&["--out", "run"]));
    assert!(complaint.contains("run") && complaint.contains("never overwritten"), "{complaint}");
    std::fs::create_dir(place.path("empty")).expect("writable");
    assert!(place.fails(1, &tiny(&["--out", "empty"])).contains("never overwritten"));
    assert!(place.fails(1, &["evolve", "--resume", "empty"]).contains("not a run folder"));
    assert!(place.fails(1, &["evolve", "--resume", "nowhere"]).contains("nowhere"));
    assert!(place.fails(1, &["data", "synth", "data"]).contains("never overwritten"));
    for size in ["320", "320x", "x", "15x240", "320x65537", "0x5", "1e3x10"] {
        let complaint = place.fails(2, &["data", "synth", "new", "--size", size]);
        assert!(complaint.contains("as in 320x240") && !place.path("new").exists(), "{complaint}");
    }
}

#[test]
fn checkpoints_that_cannot_be_used() {
    let place = Place::new();
    place.ok(&tiny(&["--out", "run"]));
    let checkpoint = std::fs::read(place.path("run/checkpoint")).expect("there");
    let resume = ["evolve", "--resume", "run", "--generations", "6", "--quiet"];
    let mut later = checkpoint.clone();
    later[8] += 1;
    let mut flipped = checkpoint.clone();
    *flipped.last_mut().expect("not empty") ^= 1;
    for (bytes, said) in [
        (&checkpoint[..checkpoint.len() - 1], "cut"),
        (&checkpoint[..10], "checkpoint"),
        (&later, "version"),
        (&flipped, "damaged"),
        (b"something else entirely, and longer than a header is" as &[u8], "not a checkpoint"),
    ] {
        place.write("run/checkpoint", bytes);
        let complaint = place.fails(1, &resume);
        assert!(complaint.contains("run/checkpoint") && complaint.contains(said), "{said}: {complaint}");
    }
    place.write("run/checkpoint", &checkpoint);

    // Of other data: one label is another.
    let labels = place.read("data/labels.csv");
    let (head, tail) = labels.trim_end().rsplit_once(',').expect("a table");
    let other: u32 = tail.parse::<u32>().expect("a label") ^ 1;
    place.write("data/labels.csv", format!("{head},{other}\n"));
    assert!(place.fails(1, &resume).contains("other training data"));
    place.write("data/labels.csv", labels);

    // Of other settings.
    let settings = place.read("run/settings.toml");
    place.write("run/settings.toml", settings.replace("tournament = 7", "tournament = 6"));
    assert!(place.fails(1, &resume).contains("settings.toml"));
    place.write("run/settings.toml", settings.replace("[data.folder]", "[data.flder]"));
    assert!(place.fails(1, &resume).contains("[data]"));
    place.write("run/settings.toml", &settings);

    // And the sound one is still good.
    place.ok(&resume);
    assert_eq!(recorded(&place.path("run")).log.len(), 6);
    let complaint = place.fails(2, &["evolve", "--resume", "run", "--generations", "3"]);
    assert!(complaint.contains("--generations") && complaint.contains('6'), "{complaint}");
}

#[test]
fn held_out_data_are_those_of_the_run() {
    let place = Place::new();
    dataset(4, 1).save(place.path("other")).expect("writable");
    place.ok(&tiny(&["--holdout", "other", "--out", "run", "--quiet"]));
    let resume = ["evolve", "--resume", "run", "--generations", "6", "--quiet"];
    let labels = place.read("other/labels.csv");
    let (head, tail) = labels.trim_end().rsplit_once(',').expect("a table");
    let other: u32 = tail.parse::<u32>().expect("a label") ^ 1;
    place.write("other/labels.csv", format!("{head},{other}\n"));
    let complaint = place.fails(1, &resume);
    assert!(complaint.contains("run/settings.toml") && complaint.contains("held-out"), "{complaint}");
    place.write("other/labels.csv", labels);
    place.ok(&resume);
}

#[test]
fn a_resume_accepts_nothing_that_changes_the_run() {
    let place = Place::new();
    for flag in [
        ["--data", "data"],
        ["--preset", "paper"],
        ["--settings", "x.toml"],
        ["--seed", "2"],
        ["--population", "10"],
        ["--trees", "1"],
        ["--tolerance", "5"],
        ["--nodes", "-raw"],
        ["--set", "seed=2"],
        ["--out", "x"],
    ] {
        let complaint = place.fails(2, &["evolve", "--resume", "run", flag[0], flag[1]]);
        assert!(complaint.contains(flag[0]) && complaint.contains("--resume"), "{complaint}");
    }
}

#[test]
fn flags_that_are_wrong() {
    let place = Place::new();
    place.write("up.gp", "(individual (iterate-up 3x3 x-obstacle (set-a y)))");
    for (arguments, said) in [
        (&["evolve", "--poplation", "3"] as &[&str], "--poplation"),
        (&["evolve", "--population", "1"], "population"),
        (&["evolve", "--population", "many"], "--population"),
        (&["evolve", "--generations", "0"], "generations"),
        (&["evolve", "--threads", "0"], "--threads"),
        (&["evolve", "--memory", "0"], "--memory"),
        (&["eval", "up.gp", "--data", "data", "--memory", "-1"], "--memory"),
        (&["show", "up.gp", "--out", "x", "--memory", "much"], "--memory"),
        (&["evolve", "--trees", "3"], "trees"),
        (&["evolve", "--tolerance", "-1"], "tolerance"),
        (&["evolve", "--tolerance", "nan"], "tolerance"),
        (&["evolve", "--seed", "-1"], "--seed"),
        (&["evolve", "--seed", "18446744073709551615"], "seed"),
        (&["evolve", "--executor", "fast"], "cranelift"),
        (&["evolve", "--nodes", "-gradeint"], "`gradient`"),
        (&["evolve", "--set", "selection.size=3"], "unknown field"),
        (&["evolve", "--nodes", "-constant,-x-obstacle"], "--set creation.plain_column_probability=0"),
        (&["evolve", "--set", "creation.min_depth=10"], "--set creation.min_depth=10: "),
        (&["evolve", "--holdout", "data"], "--data"),
        (&["evolve", "--data", "data", "--holdout-match", "x*"], "--train-match"),
        (&["eval", "up.gp"], "--data"),
        (&["eval", "up.gp", "--data", "data", "--tolerance", "-1"], "--tolerance"),
        (&["eval", "up.gp", "--data", "data", "--json", "--answers", "-"], "--answers"),
        (&["ir", "up.gp", "--size", "8x8"], "16"),
        (&["ir", "up.gp", "--stage", "source"], "--stage"),
        (&["data", "synth"], "DIR"),
        (&["completions", "basic"], "basic"),
        (&["evlove"], "evolve"),
    ] {
        let complaint = place.fails(2, arguments);
        assert!(complaint.contains(said), "{arguments:?}: {complaint}");
        assert!(complaint.contains("--help"), "{arguments:?}: {complaint}");
    }
    assert!(place.fails(2, &["data", "synth", "new", "--frames", "0"]).contains("frames"));
}

#[test]
fn images_that_need_too_much_memory() {
    let place = Place::new();
    place.write("up.gp", "(individual (iterate-up 3x3 x-obstacle (set-a y)))");
    place.ok(&tiny(&["--out", "run"]));
    let commands: [&[&str]; 4] = [
        &["evolve", "--data", "data", "--preset", "paper", "--out", "new"],
        &["evolve", "--resume", "run", "--generations", "5"],
        &["eval", "up.gp", "--data", "data"],
        &["show", "up.gp", "--data", "data", "--out", "pictures"],
    ];
    for command in commands {
        let complaint = place.fails(1, &[command, &["--memory", "0.001"]].concat());
        for said in [
            "needed for 6 images of 64 x 48 pixels",
            "the limit is 0.001 GiB",
            "scale the images down",
            "fewer",
        ] {
            assert!(complaint.contains(said), "{command:?}: {complaint}");
        }
        assert!(complaint.contains("raise the limit with `--memory 0."), "{complaint}");
    }
    // Held-out images count too.
    dataset(6, 1).save(place.path("other")).expect("writable");
    let both = ["evolve", "--data", "data", "--holdout", "other", "--preset", "paper", "--memory", "0.005"];
    assert!(place.fails(1, &both).contains("6 images of 64 x 48 pixels and 6 images"));
    // With enough, all goes its way; it is no setting, and a resume accepts it.
    place.ok(&["evolve", "--resume", "run", "--generations", "5", "--quiet", "--memory", "0.02"]);
    assert!(!place.read("run/settings.toml").contains("memory"));
    place.ok(&["eval", "up.gp", "--data", "data", "--memory", "0.02"]);
    place.ok(&["show", "up.gp", "--data", "data", "--out", "pictures", "--memory", "0.02"]);
}
