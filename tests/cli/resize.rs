//! `vsonar data resize`: photographs become small, with their labels, and whoever has some is told of it at once.

use std::io::{BufRead, BufReader, Cursor};
use std::process::Stdio;

use image::{GrayImage, ImageFormat, Luma};
use serde_json::Value;
use vsonar::dataset::Dataset;

use crate::common::*;

/// A JPEG file with the orientation tag: bright above and dark below, the more so the further to the right.
fn photo(width: u32, height: u32, orientation: u8) -> Vec<u8> {
    let pixels = GrayImage::from_fn(width, height, |x, y| {
        Luma([(if y < height / 2 { 150 } else { 40 }) + (60 * x / width) as u8])
    });
    let mut jpeg = Cursor::new(Vec::new());
    pixels.write_to(&mut jpeg, ImageFormat::Jpeg).expect("in memory");
    let jpeg = jpeg.into_inner();
    // TIFF header, one entry: tag 0x112, a short.
    let mut exif = b"Exif\0\0MM\0\x2a\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0".to_vec();
    exif.extend([orientation, 0, 0, 0, 0, 0, 0]);
    let length = (exif.len() + 2) as u16;
    [&jpeg[..2], b"\xff\xe1", &length.to_be_bytes(), &exif, &jpeg[2..]].concat()
}

/// A place with photographs `photos/IMG_1.jpg` and on, of these sizes and orientations.
fn photos(of: &[(u32, u32, u8)]) -> Place {
    let place = Place::new();
    std::fs::create_dir(place.path("photos")).expect("writable");
    for (i, &(width, height, orientation)) in of.iter().enumerate() {
        place.write(&format!("photos/IMG_{}.jpg", i + 1), photo(width, height, orientation));
    }
    place
}

const UPRIGHT: (u32, u32, u8) = (960, 720, 1);
const RESIZE: [&str; 7] = ["data", "resize", "photos", "--size", "160x120", "--out", "small"];

fn resize<'a>(more: &[&'a str]) -> Vec<&'a str> {
    [&RESIZE[..], more].concat()
}

fn small(place: &Place, image: u32) -> GrayImage {
    let path = place.path(&format!("small/images/IMG_{image}.png"));
    image::open(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display())).into_luma8()
}

#[test]
fn labels_come_along() {
    let place = photos(&[UPRIGHT, UPRIGHT]);
    // Rows 6 y to 6 y + 5 become y, and the middle one of them is 6 y + 3.
    place.write(
        "photos/labels.csv",
        "by,image,x,group,y\nme,IMG_2.jpg,80,hall,0\n\"a, b\",IMG_2.jpg,240,hall,362\n,IMG_1.jpg,240,lab,363\n,IMG_1.jpg,880,lab,719\n",
    );
    place.write("photos/labels.skip.csv", "image,x\nIMG_1.jpg,80\nIMG_2.jpg,881\n");
    place.write("photos/.labels.columns", "80,240,880\n");
    let said = place.ok(&RESIZE);
    assert_eq!(
        said,
        "small: 2 images of 160 x 120 pixels, 4 labels, 2 skipped columns\nNext: vsonar evolve --data small\n"
    );
    assert_eq!(
        place.read("small/labels.csv"),
        "by,image,x,group,y\nme,IMG_2.png,13,hall,0\n\"a, b\",IMG_2.png,40,hall,59\n,IMG_1.png,40,lab,60\n,IMG_1.png,146,lab,119\n"
    );
    assert_eq!(place.read("small/labels.skip.csv"), "image,x\nIMG_1.png,13\nIMG_2.png,146\n");
    assert_eq!(place.read("small/.labels.columns"), "13,40,146\n");
    let set = Dataset::load(place.path("small")).expect("sound");
    assert_eq!((set.width(), set.height(), set.cases().len()), (160, 120, 4));
    assert_eq!(set.group(0), Some("hall"));
    // A second time there is something of the name already, and it is left alone.
    let complaint = place.fails(1, &RESIZE);
    assert!(complaint.contains("small: exists already"), "{complaint}");
    // The result is as small as is useful, and sound; scaled up again, it has the same columns.
    let check = place.ok(&["data", "check", "small"]);
    assert!(
        !check.contains("data resize") && check.contains("within 10 rows (8.3 % of the height)"),
        "{check}"
    );
    place.ok(&["data", "resize", "small", "--size", "960x720", "--out", "large"]);
    assert!(
        place.read("large/labels.csv").contains("IMG_2.png,81,hall,0\n"),
        "{}",
        place.read("large/labels.csv")
    );
    assert!(place.read("large/labels.csv").contains("IMG_1.png,879,lab,719\n"));
}

#[test]
fn unlabelled_photographs_are_turned() {
    let place = photos(&[UPRIGHT, (720, 960, 6), (720, 960, 8), (960, 720, 3), (960, 720, 2)]);
    let said = place.ok(&RESIZE);
    assert!(said.contains("\nturned    4 images, as their orientation tags ask\n"), "{said}");
    assert!(said.ends_with("Next: vsonar label small\n"), "{said}");
    assert!(!place.path("small/labels.csv").exists());
    let corners = |i| {
        let image = small(&place, i);
        assert_eq!(image.dimensions(), (160, 120), "{i}");
        [(10, 10), (150, 10), (10, 110), (150, 110)].map(|(x, y)| image.get_pixel(x, y).0[0])
    };
    let near = |i, expected: [u8; 4]| {
        let found = corners(i);
        assert!(
            found.iter().zip(expected).all(|(a, b)| a.abs_diff(b) < 6),
            "{i}: {found:?}, not {expected:?}"
        );
    };
    near(1, [154, 206, 44, 96]);
    // Stored above and right: to the right and below, a quarter clockwise.
    near(2, [44, 154, 96, 206]);
    near(3, [206, 96, 154, 44]);
    near(4, [96, 44, 206, 154]);
    near(5, [206, 154, 96, 44]);
}

#[test]
fn labels_of_a_turned_photograph_could_be_meant_either_way() {
    let place = photos(&[(960, 720, 6), UPRIGHT]);
    // Inside the image as it is stored, not as it is shown; and the other way round, where the middle 540 rows of 960 are left.
    let (x, y) = (
        "x is 900, outside the image `IMG_1.jpg` (0 to 719)",
        "y is 740, outside the image `IMG_1.jpg` (0 to 719)",
    );
    for (row, ignored, applied) in [
        ("IMG_1.jpg,900,363", Ok("IMG_1.png,150,60\n"), Err(x)),
        ("IMG_1.jpg,603,740", Err(y), Ok("IMG_1.png,134,117\n")),
    ] {
        place.write("photos/labels.csv", format!("image,x,y\n{row}\nIMG_2.jpg,3,9\n"));
        let complaint = place.fails(1, &RESIZE);
        assert!(complaint.contains("photos/IMG_1.jpg: has 1 mark and an orientation tag"), "{complaint}");
        assert!(complaint.contains("--orientation ignore"), "{complaint}");
        assert!(complaint.contains("--orientation apply"), "{complaint}");
        for (how, expected) in [("ignore", ignored), ("apply", applied)] {
            let arguments = resize(&["--orientation", how]);
            match expected {
                Ok(row) => {
                    place.ok(&arguments);
                    assert_eq!(
                        place.read("small/labels.csv"),
                        format!("image,x,y\n{row}IMG_2.png,0,1\n"),
                        "{how}"
                    );
                    std::fs::remove_dir_all(place.path("small")).expect("there");
                }
                Err(words) => assert!(place.fails(1, &arguments).contains(words), "{how}: {words}"),
            }
        }
    }
    // A column that is not to be labelled is of one of the two as well.
    place.write("photos/labels.csv", "image,x,y\nIMG_2.jpg,3,9\n");
    place.ok(&RESIZE);
    std::fs::remove_dir_all(place.path("small")).expect("there");
    place.write("photos/labels.skip.csv", "image,x\nIMG_1.jpg,5\n");
    assert!(place.fails(1, &RESIZE).contains("IMG_1.jpg: has 1 mark"));
}

#[test]
fn what_is_cut_off_is_counted_and_told() {
    // 1200x720: a tenth at either side is too much. 960x900: a tenth above and below.
    let place = photos(&[(1200, 720, 1), (960, 900, 1)]);
    place.write(
        "photos/labels.csv",
        "image,x,y\nIMG_1.jpg,119,300\nIMG_1.jpg,120,300\nIMG_1.jpg,1079,300\nIMG_1.jpg,1080,300\nIMG_1.jpg,121,310\nIMG_2.jpg,10,40\nIMG_2.jpg,20,809\nIMG_2.jpg,30,810\n",
    );
    let report: Value = serde_json::from_str(&place.ok(&resize(&["--json"]))).expect("JSON");
    assert_eq!((&report["images"], &report["labels"], &report["cut"]), (&2.into(), &4.into(), &2.into()));
    assert_eq!(report["lost"], serde_json::json!({ "beside": 2, "below": 1, "merged": 1 }));
    assert_eq!(report["check"]["faults"], serde_json::json!([]));
    // Of 120 and 121 the second is nearer to the middle, 123.
    assert_eq!(
        place.read("small/labels.csv"),
        "image,x,y\nIMG_1.png,159,49\nIMG_1.png,0,51\nIMG_2.png,1,0\nIMG_2.png,3,119\n"
    );
    std::fs::remove_dir_all(place.path("small")).expect("there");
    let said = place.ok(&RESIZE);
    for words in [
        "cut       2 images: the middle is left",
        "lost      2 marks in columns that were cut off",
        "lost      1 label below what is left",
        "lost      1 mark that came to the column of another one",
    ] {
        assert!(said.contains(words), "{words}: {said}");
    }
    std::fs::remove_dir_all(place.path("small")).expect("there");
    // A part that is asked for is stretched, as everywhere.
    place.ok(&resize(&["--crop", "0,0,960,720"]));
    assert!(place.read("small/labels.csv").starts_with("image,x,y\nIMG_1.png,19,49\n"));
    std::fs::remove_dir_all(place.path("small")).expect("there");
    let complaint = place.fails(1, &resize(&["--crop", "0,0,1200,720"]));
    assert!(complaint.contains("IMG_2.jpg: the part of 1200x720 pixels"), "{complaint}");
}

#[test]
fn all_of_it_or_nothing() {
    let place = photos(&[UPRIGHT, UPRIGHT]);
    place.write("photos/labels.csv", "image,x,y\nIMG_1.jpg,80,300\nIMG_3.jpg,80,300\n");
    let complaint = place.fails(1, &RESIZE);
    assert!(complaint.contains("photos/IMG_3.jpg: the file is missing"), "{complaint}");
    assert!(complaint.contains("--skip-faulty"), "{complaint}");
    let whole = photo(960, 720, 1);
    place.write("photos/IMG_3.jpg", &whole[..whole.len() / 2]);
    assert!(place.fails(1, &RESIZE).contains("IMG_3.jpg"));
    place.write("photos/IMG_4.HEIC", "ftypheic");
    place.write("photos/._IMG_1.jpg", "AppleDouble");
    let complaint = place.fails(1, &RESIZE);
    assert!(
        complaint.contains("IMG_4.HEIC: pictures of this format are not read; save it as JPEG"),
        "{complaint}"
    );
    let said = place.ok(&resize(&["--skip-faulty"]));
    assert!(said.contains("left out  2\n  IMG_4.HEIC: "), "{said}");
    assert!(said.contains("\n  IMG_3.jpg: ") && !said.contains("._IMG"), "{said}");
    assert_eq!(place.read("small/labels.csv"), "image,x,y\nIMG_1.png,13,49\n");
    std::fs::remove_dir_all(place.path("small")).expect("there");
    // What the table says wrong is said with its line, and nothing is left out for it.
    place.write("photos/labels.csv", "image,x,y\nIMG_1.jpg,80,300\nIMG_2.jpg,960,300\n");
    std::fs::remove_file(place.path("photos/IMG_3.jpg")).expect("there");
    std::fs::remove_file(place.path("photos/IMG_4.HEIC")).expect("there");
    let complaint = place.fails(1, &RESIZE);
    assert!(complaint.contains("labels.csv line 3: x is 960, outside the image"), "{complaint}");
    std::fs::create_dir(place.path("empty")).expect("writable");
    for (folder, words) in [("empty", "there is no image"), ("nowhere", "there is no folder nowhere")] {
        let complaint = place.fails(1, &["data", "resize", folder, "--size", "160x120", "--out", "small"]);
        assert!(complaint.contains(words), "{complaint}");
    }
    place.fails(2, &["data", "resize", "photos", "--out", "small"]);
    place.fails(2, &["data", "resize", "photos", "--size", "160x12", "--out", "small"]);
    place.fails(2, &resize(&["--orientation", "sideways"]));
    let complaint = place.fails(1, &["data", "resize", "photos", "--size", "160x120", "--out", "photos"]);
    assert!(complaint.contains("photos: exists already"), "{complaint}");
}

/// The command that the advice names, as it stands in a text.
fn advised(text: &str) -> Vec<String> {
    let from = text.find("vsonar data resize ").unwrap_or_else(|| panic!("no advice: {text}"));
    let line = text[from..].split(['\n', '`', '"']).next().unwrap_or_default();
    line.split(' ').skip(1).map(|word| word.trim_end_matches(',').to_string()).collect()
}

#[test]
fn whoever_has_large_images_is_told_at_once() {
    let place = photos(&[(1440, 1080, 1), (1440, 1080, 1)]);
    let label = |wanted: &str| -> (Value, String) {
        let mut command = place.command(&["label", "photos"]);
        if wanted == "json" {
            command.arg("--json");
        }
        let mut label = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("started");
        let mut line = String::new();
        if wanted == "json" {
            BufReader::new(label.stdout.take().expect("piped")).read_line(&mut line).expect("UTF-8");
        } else {
            BufReader::new(label.stderr.take().expect("piped")).read_line(&mut line).expect("UTF-8");
        }
        label.kill().and_then(|()| label.wait()).expect("it ends");
        (serde_json::from_str(&line).unwrap_or_default(), line)
    };
    assert_eq!(label("json").0["useful_size"], serde_json::json!([320, 240]));
    let note = label("words").1;
    assert!(note.starts_with("note: 1440 x 1080 pixels are more than is of use"), "{note}");
    let command = ["data", "resize", "photos", "--size", "320x240", "--out", "photos-320x240"];
    assert_eq!(advised(&note), command);
    let check = |place: &Place| {
        let output = place.command(&["data", "check", "photos"]).output().expect("started");
        String::from_utf8(output.stdout).expect("UTF-8")
    };
    let unlabelled = check(&place);
    assert!(unlabelled.contains("size      1440 x 1080 pixels"), "{unlabelled}");
    assert_eq!(advised(&unlabelled), command);
    // Labelled all the same; every command names the same remedy, and it is one.
    place.write("photos/labels.csv", "image,x,y\nIMG_1.jpg,80,600\nIMG_2.jpg,80,601\n");
    let check = check(&place);
    assert_eq!(advised(&check), command);
    assert!(check.contains("within 10 rows (0.9 % of the height)"), "{check}");
    let bins = check
        .lines()
        .filter(|line| line.trim_start().starts_with(|c: char| c.is_ascii_digit()) && line.contains('-'));
    assert!(bins.count() <= 24, "{check}");
    let evolve = tiny(&["--out", "run", "--preset", "paper"]);
    let evolve: Vec<&str> =
        evolve.into_iter().map(|word| if word == "data" { "photos" } else { word }).collect();
    let complaint = place.fails(1, &[&evolve[..], &["--memory", "0.2"]].concat());
    assert!(complaint.contains("scale the images down, labels and all, with `"), "{complaint}");
    assert_eq!(advised(&complaint), command);
    place.write("up.gp", "(individual (iterate-up 3x3 x-obstacle (set-a y)))");
    let complaint = place.fails(1, &["eval", "up.gp", "--data", "photos", "--memory", "0.2"]);
    assert_eq!(advised(&complaint), command);
    let report: Value =
        serde_json::from_str(&place.ok(&["data", "check", "photos", "--json"])).expect("JSON");
    assert_eq!(report["useful_size"], serde_json::json!([320, 240]));
    place.ok(&command);
    assert!(!place.ok(&["data", "check", "photos-320x240"]).contains("data resize"));
}

#[test]
fn advice_on_labelled_photographs_with_a_tag_can_be_followed() {
    let place = photos(&[(1440, 1080, 1), (1440, 1080, 3)]);
    let check = || {
        let output = place.command(&["data", "check", "photos"]).output().expect("started");
        String::from_utf8(output.stdout).expect("UTF-8")
    };
    let unlabelled = check();
    assert!(unlabelled.contains("1 image(s) with an orientation tag, IMG_2.jpg the first"), "{unlabelled}");
    place.write("photos/labels.csv", "image,x,y\nIMG_1.jpg,80,600\nIMG_2.jpg,80,601\n");
    let command = advised(&check());
    let command: Vec<&str> = command.iter().map(String::as_str).collect();
    assert!(command.contains(&"ignore"), "{command:?}");
    place.ok(&command);
    // The marks are of the picture as it is stored: below the half it is dark.
    let small = Dataset::load(place.path("photos-320x240")).expect("sound");
    assert!(small.images().iter().all(|image| image.pixels.get_pixel(10, 200).0[0] < 80));
}

#[test]
fn a_run_says_what_is_out_of_proportion() {
    let place = Place::new();
    let said = |more: &[&str]| {
        let output = place.command(&tiny(more)).output().expect("started");
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let lines = String::from_utf8(output.stderr).expect("UTF-8");
        lines.lines().filter(|line| line.starts_with("note: ")).collect::<String>()
    };
    let note = said(&["--out", "a", "--tolerance", "10"]);
    assert!(
        note.starts_with("note: an answer within 10 rows (20.8 % of the height) counts as correct"),
        "{note}"
    );
    assert!(note.contains("`--tolerance 2`"), "{note}");
    for (out, more) in [
        ("b", &["--tolerance", "3"][..]),
        ("c", &["--tolerance", "0"]),
        ("d", &["--tolerance", "10", "--quiet"]),
    ] {
        assert_eq!(said(&[&["--out", out], more].concat()), "", "{more:?}");
    }
    let check = place.ok(&["data", "check", "data"]);
    assert!(
        check.contains("within 10 rows (20.8 % of the height)") && check.contains("--tolerance 2"),
        "{check}"
    );
    let two = said(&["--out", "e", "--runs", "2", "--tolerance", "10"]);
    assert_eq!(two.matches("20.8 %").count(), 1, "{two}");
}
