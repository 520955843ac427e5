//! Colour becomes gray as cameras give it, and runs that saw it otherwise are told apart.

use std::path::Path;
use std::process::Command;

use image::{GrayImage, Luma, Rgb, RgbImage};
use vsonar::dataset::Dataset;

use crate::common::*;

/// The answer is the brightness of the picture in the middle of the column.
const BRIGHTNESS: &str = "(individual (iterate-up 2x2 x-obstacle (set-a raw)))";

fn regression(name: &str) -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/regressions/gray-weights").join(name)
}

/// A red wall and a gray floor, of equal brightness by the weights of BT.709 (69.8) and not by those of BT.601 (82).
fn red_wall(foot: u32, x: u32, y: u32) -> Rgb<u8> {
    Rgb(if y > foot + x / 16 { [70; 3] } else { [180, 40, 40] })
}

/// A data set of red walls, or of the same in gray.
fn walls(place: &Place, name: &str, gray: bool) {
    std::fs::create_dir_all(place.path(&format!("{name}/images"))).expect("writable");
    let mut table = "image,x,y\n".to_string();
    for i in 0..4u32 {
        let foot = 8 + 6 * i;
        let picture = RgbImage::from_fn(64, 48, |x, y| red_wall(foot, x, y));
        let path = place.path(&format!("{name}/images/w_{i}.png"));
        match gray {
            false => picture.save(path),
            true => image::DynamicImage::ImageRgb8(picture).to_luma8().save(path),
        }
        .expect("writable");
        for x in [8, 32, 56] {
            table += &format!("w_{i}.png,{x},{}\n", foot + x / 16);
        }
    }
    place.write(&format!("{name}/labels.csv"), table);
}

#[test]
fn files_streams_and_films_of_one_colour_are_equally_bright() {
    let place = Place::new();
    place.write("p.gp", BRIGHTNESS);
    let mut inputs = vec![regression("red.png"), regression("red.jpg")];
    for (format, name) in [("bmp", "red.bmp"), ("tiff", "red.tiff"), ("webp", "red.webp"), ("qoi", "red.qoi")]
    {
        let path = place.path(name);
        RgbImage::from_pixel(64, 48, Rgb([255, 0, 0]))
            .save(&path)
            .unwrap_or_else(|e| panic!("{format}: {e}"));
        inputs.push(path);
    }
    if has_ffmpeg() {
        let film = place.path("red.y4m");
        let made = Command::new("ffmpeg")
            .args(["-v", "error", "-i"])
            .arg(regression("red.mp4"))
            .args(["-pix_fmt", "gray", "-f", "yuv4mpegpipe"])
            .arg(&film)
            .status();
        assert!(made.expect("started").success());
        inputs.push(film);
    }
    for (i, input) in inputs.iter().enumerate() {
        let (input, out) = (input.display().to_string(), format!("o{i}"));
        let lines = place.ok(&[
            "run",
            "p.gp",
            "--input",
            &input,
            "--columns",
            "9,30",
            "--record",
            &out,
            "--every",
            "1f",
            "--quiet",
        ]);
        let line: serde_json::Value =
            serde_json::from_str(lines.lines().next().expect("a frame")).expect("JSON");
        assert_eq!(line["rows"], serde_json::json!([76.0, 76.0]), "{input}");
        let recorded = std::fs::read_dir(place.path(&out)).expect("a folder").flatten();
        let recorded: Vec<_> =
            recorded.map(|entry| entry.path()).filter(|path| path.extension().is_some()).collect();
        let picture =
            image::open(recorded.iter().find(|path| path.extension() == Some("png".as_ref())).expect("one"));
        assert!(picture.expect("sound").into_luma8().pixels().all(|pixel| pixel.0 == [76]), "{input}");
    }
}

#[test]
fn a_red_wall_is_no_floor() {
    let place = Place::new();
    walls(&place, "walls", false);
    let set = Dataset::load(place.path("walls")).expect("sound");
    let picture = &set.images()[0].pixels;
    assert_eq!((picture.get_pixel(3, 2).0, picture.get_pixel(3, 40).0), ([82], [70]));
    assert!(set.has_colour() && !Dataset::load(place.path("data")).expect("sound").has_colour());
}

/// A run that an earlier release made on a folder: it recorded no weights, and its images in colour were others.
fn earlier(place: &Place, run: &str, other_images: bool) {
    let file = place.path(run).join("settings.toml");
    let text = std::fs::read_to_string(&file).expect("there");
    let line = "gray = \"BT.601\"\n";
    assert_eq!(text.matches(line).count(), 1, "{text}");
    let mut text = text.replace(line, "");
    if other_images {
        let at = text.find("train_fingerprint = \"").expect("recorded") + "train_fingerprint = \"".len();
        text.replace_range(at..at + 4, if &text[at..at + 4] == "0000" { "1111" } else { "0000" });
    }
    std::fs::write(&file, text).expect("writable");
}

fn outcome(place: &Place, arguments: &[&str]) -> (bool, String, String) {
    let output = place.command(arguments).output().expect("started");
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (output.status.success(), text(&output.stdout), text(&output.stderr))
}

#[test]
fn a_run_that_saw_colour_otherwise_says_so_where_it_meets_it() {
    let place = Place::new();
    walls(&place, "walls", false);
    let evolve = ["evolve", "--data", "walls", "--population", "20", "--generations", "2", "--seed", "1"];
    place.command(&[&evolve[..], &["--out", "new"]].concat()).output().expect("started");
    place.command(&[&evolve[..], &["--out", "old"]].concat()).output().expect("started");
    earlier(&place, "old", true);
    // What is of now goes on.
    let (done, _, complaint) =
        outcome(&place, &["evolve", "--resume", "new", "--generations", "3", "--quiet"]);
    assert!(done, "{complaint}");
    let other = place.path("data").display().to_string();
    let data = ["eval", "new", "--data", &other];
    assert!(!outcome(&place, &data).2.contains("BT."), "nothing to be said");
    // What is of an earlier release does not, and says why.
    for arguments in [
        &["evolve", "--resume", "old", "--generations", "3"][..],
        &["eval", "old", "--part", "train"],
        &["show", "old", "--out", "pictures"],
        &["explain", "old"],
    ] {
        let said = place.fails(1, arguments);
        for part in
            ["old/settings.toml", "colour", "BT.709", "BT.601", "start a new run", "vsonar eval old --data"]
        {
            assert!(said.contains(part), "{arguments:?}: no {part:?} in {said}");
        }
    }
    let (done, _, complaint) = outcome(&place, &["report", "old", "--out", "page.html"]);
    assert!(done, "{complaint}");
    let page = place.read("page.html");
    assert!(page.contains("BT.709") && page.contains("BT.601"), "the page says what is missing and why");
    // On other images, and on frames, it is warned of.
    let red = regression("red.png").display().to_string();
    for arguments in [
        &["eval", "old", "--data", &other][..],
        &["show", "old", "--data", &other, "--out", "pictures"],
        &["explain", "old", "--data", &other],
        &["run", "old", "--input", &red],
    ] {
        let (done, _, note) = outcome(&place, arguments);
        assert!(
            done && note.contains("note: old was evolved with gray by the weights of BT.709"),
            "{arguments:?}: {note}"
        );
    }
    // Where its images have gone, it depends.
    std::fs::remove_dir_all(place.path("walls")).expect("there");
    let note = outcome(&place, &["eval", "old", "--data", &other]).2;
    assert!(note.contains("if its images had colour"), "{note}");
}

#[test]
fn gray_runs_of_earlier_releases_go_on() {
    let place = Place::new();
    walls(&place, "walls", true);
    let evolve = ["evolve", "--data", "walls", "--population", "20", "--generations", "2", "--seed", "1"];
    assert!(outcome(&place, &[&evolve[..], &["--out", "old"]].concat()).0);
    earlier(&place, "old", false);
    let other = place.path("data").display().to_string();
    for arguments in [
        &["evolve", "--resume", "old", "--generations", "3", "--quiet"][..],
        &["eval", "old", "--part", "train"],
        &["eval", "old", "--data", &other],
        &["explain", "old"],
    ] {
        let (done, _, complaint) = outcome(&place, arguments);
        assert!(done && !complaint.contains("BT."), "{arguments:?}: {complaint}");
    }
    // Data that were changed are no matter of weights.
    GrayImage::from_pixel(64, 48, Luma([9])).save(place.path("walls/images/w_0.png")).expect("writable");
    let said = place.fails(1, &["eval", "old", "--part", "train"]);
    assert!(said.contains("other training data") && !said.contains("BT."), "{said}");
}
