//! `vsonar show`: pictures in a folder that appears complete or not at all.

use std::fs::File;
use std::io::BufReader;

use vsonar::frames::y4m::Reader;
use vsonar::frames::{Frame, FrameSource};

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
    assert!(text.starts_with("pictures: 6 pictures of data, all of them on contact-sheet.png\n"), "{text}");
    let report = place.ok(&["eval", "p.gp", "--data", "data", "--json"]);
    let report: serde_json::Value = serde_json::from_str(&report).expect("JSON");
    let correct = format!("\n{} of 24 answers (", report["correct"]);
    assert!(text.contains(&correct), "{text}");
    assert!(text.contains(" %) correct within 10 rows (20.8 % of the height)"), "{text}");
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

/// Another program: it always answers a row.
const CONSTANT: &str = "(individual (iterate-up 2x2 x-obstacle (set-a 20)))";

fn several() -> Place {
    let place = place();
    std::fs::create_dir(place.path("other")).expect("writable");
    place.write("other/p.gp", CONSTANT);
    place
}

#[test]
fn a_run_is_shown_on_what_it_holds_out() {
    let place = Place::new();
    let parts = ["--train-match", "drive_a*", "--holdout-match", "drive_b*"];
    place.ok(&tiny(&[&parts[..], &["--quiet", "--out", "run"]].concat()));
    let text = place.ok(&["show", "run", "--out", "pictures", "--scale", "2"]);
    assert_eq!(
        place.ok(&["show", "run/best.gp", "--out", "again", "--scale", "2"]).replace("again", "pictures"),
        text
    );
    assert!(text.starts_with("pictures: 3 pictures of the held-out images of run, all of them"), "{text}");
    let report = place.ok(&["eval", "run", "--json"]);
    let report: serde_json::Value = serde_json::from_str(&report).expect("JSON");
    assert!(text.contains(&format!("\n{} of 12 answers (", report["correct"])), "{text}");
    assert!(text.contains(" %) correct within 3 rows (6.2 % of the height)"), "{text}");
    assert!(
        names(&place, "pictures")
            .iter()
            .all(|name| name.starts_with("drive_b") || name == "contact-sheet.png")
    );
}

#[test]
fn several_programs_are_side_by_side() {
    let place = several();
    let flags = ["--data", "data", "--out", "pictures", "--scale", "8"];
    let text = place.ok(&[&["show", "p.gp", "other/p.gp"], &flags[..]].concat());
    let correct = |program: &str| {
        let report = place.ok(&["eval", program, "--data", "data", "--json"]);
        serde_json::from_str::<serde_json::Value>(&report).expect("JSON")["correct"].clone()
    };
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines[0], "pictures: 6 pictures of data, all of them on contact-sheet.png");
    assert!(lines[1].starts_with(&format!("A p.gp: {} of 24 answers", correct("p.gp"))), "{text}");
    assert!(
        lines[2].starts_with(&format!("B other/p.gp: {} of 24 answers", correct("other/p.gp"))),
        "{text}"
    );
    assert_eq!(names(&place, "pictures").len(), 7);
    let open = |name: &str| image::open(place.path(name)).expect("a picture").into_rgb8();
    let picture = open("pictures/drive_a_0.png");
    assert_eq!(picture.width(), 8 * WIDTH);
    assert!(picture.height() > 8 * HEIGHT && picture.height() < 8 * HEIGHT + 80, "{}", picture.height());
    // Both colours are in every picture and on the sheet; the second program's ground begins below row 20 everywhere.
    let has = |picture: &image::RgbImage, colour: [u8; 3]| picture.pixels().filter(|p| p.0 == colour).count();
    let (first, second) = ([90, 190, 255], [255, 160, 30]);
    let sheet = open("pictures/contact-sheet.png");
    for colour in [first, second] {
        assert!(has(&picture, colour) > 500 && has(&sheet, colour) > 500, "{colour:?}");
    }
    let wide = |y: u32| (0..picture.width()).filter(|&x| picture.get_pixel(x, y).0 == second).count();
    assert!((4..=12).contains(&wide(50)) && wide(300) >= 40, "{} {}", wide(50), wide(300));
    // The same as ever of a single one.
    place.ok(&["show", "p.gp", "--data", "data", "--out", "one", "--scale", "8"]);
    assert_eq!(open("one/drive_a_0.png").dimensions(), (8 * WIDTH, 8 * HEIGHT));
    let seven = ["p.gp"; 7];
    let complaint = place.fails(2, &[&["show"], &seven[..], &["--data", "data", "--out", "x"]].concat());
    assert!(complaint.contains("6 at most"), "{complaint}");
}

#[test]
fn pictures_as_frames_of_a_video() {
    let place = several();
    let flags = ["--data", "data", "--scale", "2", "--fps", "12.5"];
    let text =
        place.ok(&[&["show", "p.gp", "--video", "answers.y4m", "--out", "pictures"], &flags[..]].concat());
    assert!(text.contains("\nanswers.y4m: 6 frames\n") && text.contains("pictures: 6 pictures"), "{text}");
    let file = BufReader::new(File::open(place.path("answers.y4m")).expect("there"));
    let mut reader = Reader::new(file, "answers.y4m").expect("a video");
    assert_eq!((reader.width(), reader.height()), (2 * WIDTH, 2 * HEIGHT));
    assert_eq!(reader.rate().expect("known").to_string(), "25:2");
    let mut frame = Frame::default();
    for image in dataset(6, 0).images() {
        assert!(reader.read(&mut frame).expect("sound"));
        // The luma of the picture, but for rounding.
        let picture = image::open(place.path("pictures").join(&image.name)).expect("a picture").into_rgb8();
        for (luma, colour) in frame.pixels.pixels().zip(picture.pixels()) {
            let [r, g, b] = colour.0.map(f64::from);
            assert!((f64::from(luma.0[0]) - (0.299 * r + 0.587 * g + 0.114 * b)).abs() <= 0.6);
        }
    }
    assert!(!reader.read(&mut frame).expect("sound"), "no more frames");
    // Of several programs with the lines below, of even sides.
    place.ok(&[&["show", "p.gp", "other/p.gp", "--video", "both.y4m"], &flags[..]].concat());
    let file = BufReader::new(File::open(place.path("both.y4m")).expect("there"));
    let both = Reader::new(file, "both.y4m").expect("a video");
    assert!(both.height() > 2 * HEIGHT && both.height().is_multiple_of(2));
}

#[test]
fn videos_through_ffmpeg() {
    if !has_ffmpeg() {
        return;
    }
    let place = several();
    for name in ["answers.mp4", "-answers.webm", "a:%d.mkv"] {
        // An odd width, which most formats do not have.
        let video = format!("--video={name}");
        place.ok(&["show", "p.gp", "--data", "data", "--scale", "1", "--sheet-columns", "1", &video]);
        place.ok(&["data", "video", &format!("./{name}"), "--every", "1f", "--out", "frames"]);
        assert_eq!(names(&place, "frames").len(), 6, "{name}");
        let frame = image::open(place.path("frames/frame_000001.png")).expect("a picture");
        assert_eq!((frame.width(), frame.height()), (WIDTH, HEIGHT), "{name}");
        std::fs::remove_dir_all(place.path("frames")).expect("there");
    }
}

#[test]
fn videos_that_cannot_be_written_leave_nothing_behind() {
    let place = several();
    place.write("there.mp4", "mine");
    let show = ["show", "p.gp", "--data", "data"];
    for (code, flags, said) in [
        (2, &["--video", "a.avi"][..], ".mp4, .mkv"),
        (2, &["--video", "a"], ".mp4, .mkv"),
        (2, &["--fps", "3", "--out", "x"], "--video"),
        (2, &["--video", "a.mp4", "--fps", "0"], "frames a second"),
        (2, &[], "--out"),
        (1, &["--video", "there.mp4"], "never overwritten"),
        (1, &["--video", "no/a.y4m"], "no/a.y4m: cannot write the video"),
        (1, &["--video", "a.y4m", "--out", "data"], "never overwritten"),
    ] {
        let before = place.everything();
        let output = place.command(&[&show[..], flags].concat()).output().expect("started");
        let complaint = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(code), "{flags:?}: {complaint}");
        assert!(complaint.contains(said), "{flags:?}: {complaint}");
        assert!(before == place.everything(), "{flags:?}");
    }
    let before = place.everything();
    let without = |flags: &[&str]| {
        let mut command = place.command(&[&show[..], flags].concat());
        command.env("VSONAR_FFMPEG", "no/ffmpeg").output().expect("started")
    };
    for flags in [&["--video", "a.mp4"][..], &["--video", "a.webm", "--out", "x"]] {
        let complaint = one_error(&without(flags), 1);
        assert!(
            complaint.contains("cannot run `no/ffmpeg`") && complaint.contains("install ffmpeg"),
            "{complaint}"
        );
        assert!(before == place.everything(), "{flags:?}");
    }
    assert!(without(&["--video", "a.y4m"]).status.success(), "Y4M needs no ffmpeg");
}

#[test]
#[cfg(unix)]
fn ctrl_c_leaves_no_half_of_a_video() {
    use std::process::Stdio;
    let place = place();
    let before = place.everything();
    // Large ones, which take their time.
    let mut command = place.command(&["show", "p.gp", "--scale", "16", "--video", "v.y4m"]);
    let run = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("started");
    place.part_of("v.y4m");
    crate::interruption::interrupt(&run);
    let output = run.wait_with_output().expect("it ends");
    let said = String::from_utf8(output.stderr).expect("UTF-8");
    assert_eq!((output.status.code(), said.as_str()), (Some(130), "interrupted; no video was written\n"));
    assert!(before == place.everything());
}
