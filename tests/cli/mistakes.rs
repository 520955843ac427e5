//! Slips of a person: the wrong name for an output, a folder instead of a program, data that have changed. None of them
//! costs anything, and each is told with what to do.

use std::io::{BufRead, BufReader};
use std::process::Stdio;

use image::GrayImage;
use serde_json::{Value, json};

use crate::common::*;

/// A run in `run`, trained on drive a and tested on drive b.
fn evolved(place: &Place) {
    let parts = ["--train-match", "drive_a*", "--holdout-match", "drive_b*"];
    place.ok(&tiny(&[&parts[..], &["--quiet", "--out", "run"]].concat()));
}

#[test]
fn outputs_replace_nothing_but_their_own_kind() {
    let place = Place::new();
    evolved(&place);
    let image = "data/images/drive_a_0.png";
    let image = if place.path(image).exists() { image } else { "data/drive_a_0.png" };
    for precious in
        ["data/labels.csv", "run/best.gp", "run/settings.toml", "run/checkpoint", "run/log.jsonl", image]
    {
        let eval = ["eval", "run/best.gp", "--data", "data", "--answers", precious];
        for command in [&eval[..], &["report", "run", "--no-rivals", "--out", precious]] {
            let complaint = place.fails(1, command);
            assert!(complaint.contains(precious) && complaint.contains("choose another name"), "{complaint}");
        }
    }
    for precious in ["data/labels.csv", "./run/best.gp", "run/settings.toml", image] {
        for flag in ["--markdown", "--svg", "--dot"] {
            let complaint = place.fails(1, &["explain", "run", flag, precious]);
            assert!(complaint.contains(precious) && complaint.contains("choose another name"), "{complaint}");
        }
    }
    for _ in 0..2 {
        place.ok(&["explain", "run", "--markdown", "e.md", "--svg", "e.svg", "--dot", "e.dot"]);
    }
    place.write("e.md", "# Notes\n\nof mine\n");
    assert!(
        place.fails(1, &["explain", "run", "--markdown", "e.md"]).contains("no explanation of a program")
    );
    // An earlier one is replaced, an empty file is filled.
    place.write("answers.csv", "");
    for _ in 0..2 {
        place.ok(&["eval", "run", "--answers", "answers.csv"]);
        place.ok(&["report", "run", "--no-rivals"]);
    }
}

#[test]
fn flags_of_explain_that_come_to_nothing_are_refused() {
    let place = Place::new();
    evolved(&place);
    let complaint = place.fails(2, &["explain", "run", "--full"]);
    assert!(complaint.contains("--trace"), "{complaint}");
    assert!(place.fails(2, &["explain", "run", "--markdown", "-"]).contains("`-`"));
    let complaint = place.fails(1, &["explain", "run/best.gp", "--size", "9000x9000", "--memory", "1"]);
    assert!(complaint.contains("GiB of memory are needed for an image of 9000 x 9000 pixels"), "{complaint}");
}

#[test]
fn several_runs_do_not_move_into_one() {
    let place = Place::new();
    evolved(&place);
    let complaint = place.fails(1, &tiny(&["--runs", "2", "--out", "run"]));
    assert!(complaint.contains("run: this is the folder of one run"), "{complaint}");
}

#[test]
fn a_run_folder_is_as_good_as_its_program() {
    let place = Place::new();
    evolved(&place);
    assert_eq!(place.ok(&["ir", "run"]), place.ok(&["ir", "run/best.gp"]));
    place.ok(&["show", "run", "--data", "data", "--out", "pictures"]);
    place.ok(&["export", "run", "--size", "64x48", "--emit", "c", "--out", "exported"]);
    for command in [
        &["show", "data", "--data", "data", "--out", "x"][..],
        &["ir", "data"],
        &["drive", "data"],
        &["eval", "data"],
    ] {
        let complaint = place.fails(1, command);
        assert!(complaint.contains("data") && complaint.contains("run folder"), "{complaint}");
    }
    let complaint = place.fails(1, &["report", "nowhere"]);
    assert!(complaint.contains("`vsonar evolve` has made"), "{complaint}");
}

#[test]
fn images_of_another_size_are_worth_a_note() {
    let place = Place::new();
    evolved(&place);
    place.ok(&["data", "synth", "large", "--size", "80x60", "--frames", "2"]);
    let eval = ["eval", "run/best.gp", "--data", "large"];
    for command in [&eval[..], &["show", "run", "--data", "large", "--out", "x"]] {
        let output = place.command(command).output().expect("started");
        let note = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{note}");
        assert!(note.contains("evolved on images of 64x48") && note.contains("these have 80x60"), "{note}");
    }
    let run = |command: &[&str]| {
        let output = place.command(command).output().expect("started");
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success(), "{said}");
        said
    };
    let frames = ["run", "run", "--input", "large/images"];
    let note = run(&frames);
    let scale = "these have 80x60; scale them to 64x48, as ffmpeg does by `-vf scale=64:48`";
    assert!(
        note.starts_with("note: run/best.gp was evolved on images of 64x48") && note.contains(scale),
        "{note}"
    );
    assert_eq!(run(&[&frames[..], &["--quiet"]].concat()), "");
    assert!(!run(&["run", "run", "--input", "data/images"]).contains("note"));
    let drive = ["drive", "run/best.gp", "--minutes", "0.01", "--runs", "1", "--quiet"];
    let note = run(&drive);
    assert!(
        note.contains("these have 320x240, as the robot's camera gives them") && !note.contains("scale"),
        "{note}"
    );
    // The compiler's form is for images of one size, and no others.
    place.write("small.vir", place.ok(&["ir", "run"]));
    for (command, size) in [
        (&["run", "small.vir", "--input", "large/images"][..], "80x60"),
        (&["drive", "small.vir"], "320x240"),
    ] {
        let complaint = place.fails(1, command);
        assert!(complaint.contains(size) && complaint.contains("64x48"), "{complaint}");
    }
}

#[test]
fn a_program_is_shown_for_the_images_it_was_evolved_on() {
    let place = Place::new();
    evolved(&place);
    assert!(place.ok(&["ir", "run"]).contains("image 64x48\n"));
    assert!(place.ok(&["ir", "run", "--size", "80x60"]).contains("image 80x60\n"));
    let best = place.read("run/best.gp");
    place.write("best.gp", &best);
    assert!(place.ok(&["explain", "best.gp"]).contains("images of 64 x 48 pixels"));
    assert!(place.ok(&["explain", "best.gp", "--size", "80x60"]).contains("images of 80 x 60 pixels"));
    place
        .write("plain.gp", best.lines().filter(|line| !line.starts_with(';')).collect::<Vec<_>>().join("\n"));
    assert!(place.ok(&["ir", "plain.gp"]).contains("image 320x240\n"));
    place.write("odd.gp", best.replace("images of 64x48", "images of 1x48"));
    assert!(place.fails(1, &["ir", "odd.gp"]).contains("odd.gp: its comment says"));
}

#[test]
fn constants_are_said_to_be_of_which_images() {
    let place = Place::new();
    evolved(&place);
    let text = place.ok(&["eval", "run"]);
    assert!(text.contains("best constants of the training images: per column"), "{text}");
    assert!(text.contains("constants chosen on these very images: per column"), "{text}");
    let value = |arguments: &[&str]| -> Value { serde_json::from_str(&place.ok(arguments)).expect("JSON") };
    let tested = value(&["eval", "run", "--json"]);
    let page = value(&["report", "run", "--no-rivals", "--json"]);
    let score = &page["runs"][0]["scores"][1];
    assert_eq!(tested["trained_constant"]["per_column_fitness"], score["constant_per_column"]);
    assert_eq!(tested["trained_constant"]["fitness"], score["constant"]);
    let training = place.ok(&["eval", "run", "--part", "train"]);
    assert!(!training.contains("of the training images"), "they are these: {training}");
}

#[test]
fn changed_data_are_told_with_what_works() {
    let place = Place::new();
    evolved(&place);
    let table = place.read("data/labels.csv");
    let (rest, _) = table.trim_end().rsplit_once('\n').expect("rows");
    place.write("data/labels.csv", format!("{rest}\n"));
    let complaint = place.fails(1, &["eval", "run"]);
    for part in ["run/settings.toml", "other held-out data", "data", "`vsonar eval run --data DIR`"] {
        assert!(complaint.contains(part), "{part}: {complaint}");
    }
    place.ok(&["eval", "run", "--data", "data"]);
    // The report says on the terminal what it lacks.
    let output = place.command(&["report", "run"]).output().expect("started");
    let note = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && note.contains("note: run: Scores, errors"), "{note}");
    assert!(!note.contains("says where the images are now"), "they are there: {note}");
}

#[test]
fn damaged_settings_are_no_settings() {
    let place = Place::new();
    evolved(&place);
    let whole = place.read("run/settings.toml");
    let cut = whole.find("[selection]").expect("a table");
    // Without the weights of the nodes it would be another run.
    let nodes = whole.find("[nodes]").expect("a table");
    let data = whole.find("[data]").expect("a table");
    let without_nodes = format!("{}{}", &whole[..nodes], &whole[data..]);
    for text in ["", &whole[..cut], &without_nodes] {
        place.write("run/settings.toml", text);
        for command in
            [&["report", "run"][..], &["evolve", "--resume", "run", "--generations", "9"], &["eval", "run"]]
        {
            let complaint = place.fails(1, command);
            assert!(complaint.contains("run/settings.toml"), "{complaint}");
            if command[0] != "eval" {
                assert!(complaint.contains("is missing") && complaint.contains("damaged"), "{complaint}");
            }
        }
    }
    place.write("run/settings.toml", &whole);
    let log = place.read("run/log.jsonl");
    place.write("run/log.jsonl", &log[..log.len() - 20]);
    let output = place.command(&["report", "run", "--no-rivals"]).output().expect("started");
    let note = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && note.contains("log.jsonl is cut off"), "{note}");
    place.write("run/log.jsonl", [log.as_bytes(), b"\xff\xfe\n"].concat());
    let complaint = place.fails(1, &["report", "run", "--no-rivals"]);
    assert!(complaint.contains(&format!("run/log.jsonl:{}: ", log.lines().count() + 1)), "{complaint}");
    assert!(complaint.contains("not text"), "{complaint}");
}

/// A JPEG file with an orientation tag.
fn photo(orientation: u8) -> Vec<u8> {
    let mut jpeg = std::io::Cursor::new(Vec::new());
    let pixels = GrayImage::from_fn(64, 48, |x, y| image::Luma([(x * 2 + y) as u8]));
    pixels.write_to(&mut jpeg, image::ImageFormat::Jpeg).expect("in memory");
    let jpeg = jpeg.into_inner();
    // TIFF header, one entry: tag 0x112, a short.
    let mut exif = b"Exif\0\0MM\0\x2a\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0".to_vec();
    exif.extend([orientation, 0, 0, 0, 0, 0, 0]);
    let length = (exif.len() + 2) as u16;
    [&jpeg[..2], b"\xff\xe1", &length.to_be_bytes(), &exif, &jpeg[2..]].concat()
}

#[test]
fn photographs_that_viewers_turn_are_not_imported() {
    let place = Place::new();
    std::fs::create_dir(place.path("photos")).expect("writable");
    std::fs::create_dir(place.path("masks")).expect("writable");
    let mask = GrayImage::from_fn(64, 48, |_, y| image::Luma([u8::from(y > 20)]));
    mask.save(place.path("masks/a.png")).expect("writable");
    let floor = json!([[0, 20], [64, 20], [64, 48], [0, 48]]);
    let shapes = json!([{"label": "floor", "points": floor, "shape_type": "polygon"}]);
    let labelme = json!({"imagePath": "a.jpg", "imageWidth": 64, "imageHeight": 48, "shapes": shapes});
    place.write("photos/a.json", labelme.to_string());
    let masks = ["data", "import", "masks", "photos", "masks", "--ground", "1", "--out"];
    let shapes = ["data", "import", "labelme", "photos", "--ground", "floor", "--out"];
    for orientation in [3, 6] {
        place.write("photos/a.jpg", photo(orientation));
        for command in [&masks[..], &shapes] {
            let complaint = place.fails(1, &[command, &["x"]].concat());
            assert!(complaint.contains("a.jpg: has an orientation tag"), "{complaint}");
        }
    }
    // A folder of them is labelled as it is stored, and says so.
    place.write("photos/labels.csv", "image,x,y\na.jpg,5,20\n");
    let said = place.ok(&["data", "check", "photos"]);
    assert!(said.contains("1 image(s) with an orientation tag, a.jpg the first"), "{said}");
    let mut label = place.command(&["label", "photos"]);
    let mut label = label.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().expect("started");
    let mut note = String::new();
    BufReader::new(label.stderr.take().expect("piped")).read_line(&mut note).expect("UTF-8");
    label.kill().and_then(|()| label.wait()).expect("it ends");
    assert!(note.starts_with("note: 1 image with an orientation tag, a.jpg the first"), "{note}");
    place.write("photos/a.jpg", photo(1));
    assert!(!place.ok(&["data", "check", "photos"]).contains("orientation"));
    place.ok(&[&masks[..], &["m"]].concat());
    place.ok(&[&shapes[..], &["s"]].concat());
}

/// A file of settings for something else says nothing of a program beside it.
#[test]
fn settings_beside_a_program_are_no_run() {
    let place = Place::new();
    place.write("up.gp", "(individual (iterate-up 3x3 x-obstacle (set-a y)))");
    let alone = place.ok(&["eval", "up.gp", "--data", "data"]);
    for settings in [
        "generations = 20\n",
        "seeds = \"1-5\"\n[[data]]\nname = \"x\"\n",
        "[window]\nwidth = 3\n",
        "no TOML [",
    ] {
        place.write("settings.toml", settings);
        assert_eq!(place.ok(&["eval", "up.gp", "--data", "data"]), alone);
        place.ok(&["eval", "up.gp", "--data", "data", "--tune-on", "data", "--against", "constant"]);
    }
    // Of a run it is one, though the rest of its folder is not there.
    evolved(&place);
    let best = place.read("run/best.gp");
    place.write("best.gp", &best);
    let settings = place.read("run/settings.toml");
    place.write("settings.toml", &settings);
    assert!(place.ok(&["eval", "best.gp", "--data", "data"]).contains("within 3 rows"));
}

#[test]
fn what_is_held_out_is_not_what_is_trained_on() {
    let place = Place::new();
    for part in ["--holdout", "--validation"] {
        let complaint = place.fails(1, &tiny(&[part, "data", "--quiet", "--out", "run"]));
        assert!(complaint.contains("are the training data") && complaint.contains("20%"), "{complaint}");
        let complaint = place.fails(1, &tiny(&[part, "data", "--runs", "2", "--quiet", "--out", "runs"]));
        assert!(complaint.contains("are the training data"), "{complaint}");
    }
    for buildings in
        ["building = 2", "validation_building = 1", "validation_building = 7\nholdout_building = 7"]
    {
        place.write("s.toml", format!("[data.synthetic]\n{buildings}\n"));
        let complaint = place.fails(1, &["evolve", "--settings", "s.toml", "--quiet", "--out", "run"]);
        assert!(complaint.contains(" data, case for case, and would say nothing"), "{complaint}");
    }
}

/// A named pipe is written to, as it is, whoever reads.
#[cfg(unix)]
#[test]
fn a_pipe_is_not_opened_to_be_looked_at() {
    let place = Place::new();
    evolved(&place);
    let pipe = place.path("pipe");
    let made = std::process::Command::new("mkfifo").arg(&pipe).status().expect("mkfifo is there");
    assert!(made.success());
    let reader = std::thread::spawn(move || std::fs::read_to_string(pipe).expect("what was written"));
    place.ok(&["eval", "run", "--answers", "pipe"]);
    let answers = reader.join().expect("it ends");
    assert!(answers.starts_with("image,x,label,answer\n"), "{answers}");
}
