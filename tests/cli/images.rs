//! Folders of images with what does not belong there, and images that are too large.

use std::fs;

use image::{GrayImage, Luma};
use serde_json::Value;

use crate::common::*;

/// A PNG file that says it has so many pixels, of 8 bits and these channels, and holds none.
fn enormous(width: u32, height: u32, colour: u8) -> Vec<u8> {
    let mut file = b"\x89PNG\r\n\x1a\n".to_vec();
    let mut chunk = |kind: &[u8], data: &[u8]| {
        let body = [kind, data].concat();
        file.extend((data.len() as u32).to_be_bytes());
        file.extend(&body);
        file.extend(crc32fast::hash(&body).to_be_bytes());
    };
    chunk(b"IHDR", &[&width.to_be_bytes()[..], &height.to_be_bytes()[..], &[8, colour, 0, 0, 0]].concat());
    chunk(b"IDAT", &[0x78, 0x9c, 0x03, 0, 0, 0, 0, 1]);
    chunk(b"IEND", &[]);
    file
}

fn folder_of(place: &Place, name: &str, images: usize, file: &[u8]) {
    fs::create_dir_all(place.path(&format!("{name}/images"))).expect("writable");
    let mut table = "image,x,y\n".to_string();
    for i in 0..images {
        place.write(&format!("{name}/images/f{i}.png"), file);
        table += &format!("f{i}.png,5,5\n");
    }
    place.write(&format!("{name}/labels.csv"), table);
}

#[test]
fn sizes_are_summed_before_any_pixel_is_decoded() {
    let place = Place::new();
    place.write("p.gp", "(individual (iterate-up 2x2 x-obstacle raw))");
    // Six of 462 MiB of gray, which cannot be decoded at all: had one been tried, that would be said.
    folder_of(&place, "gray", 6, &enormous(22_000, 22_000, 0));
    // Six of 115 MiB of gray, each of which takes four times that to decode.
    folder_of(&place, "rgba", 6, &enormous(11_000, 11_000, 6));
    for (data, size) in [("gray", "22000x22000"), ("rgba", "11000x11000")] {
        for arguments in [
            &["data", "check", data][..],
            &["eval", "p.gp", "--data", data],
            &["evolve", "--data", data, "--out", "run"],
            &["show", "p.gp", "--data", data, "--out", "pictures"],
            &["explain", "p.gp", "--data", data],
            &["bench", "--data", data],
        ] {
            let before = place.everything();
            let output =
                place.command(&[arguments, &["--memory", "0.9"]].concat()).output().expect("started");
            let said = [output.stdout, output.stderr].concat();
            let said = String::from_utf8_lossy(&said);
            assert_eq!(output.status.code(), Some(1), "{arguments:?}: {said}");
            for part in
                ["6 image(s)", "the limit is 0.9 GiB", "f0.png", size, "scale the images down", "--memory"]
            {
                assert!(said.contains(part), "{arguments:?}: no {part:?} in {said}");
            }
            assert!(!said.contains("damaged"), "{said}");
            assert!(before == place.everything(), "{arguments:?}");
        }
    }
    let report: Value = {
        let output =
            place.command(&["data", "check", "gray", "--memory", "0.9", "--json"]).output().expect("started");
        serde_json::from_slice(&output.stdout).expect("JSON")
    };
    assert_eq!(report["faults"][0]["kind"], "memory");
}

#[test]
fn an_image_that_is_too_large_by_itself_is_named() {
    let place = Place::new();
    place.write("p.gp", "(individual (iterate-up 2x2 x-obstacle raw))");
    // 1.8 GiB of samples.
    folder_of(&place, "deep", 1, &enormous(22_000, 22_000, 6));
    fs::create_dir(place.path("photos")).expect("writable");
    fs::create_dir(place.path("masks")).expect("writable");
    place.write("photos/a.png", enormous(22_000, 22_000, 6));
    GrayImage::from_pixel(16, 16, Luma([1])).save(place.path("masks/a.png")).expect("writable");
    for arguments in [
        &["data", "check", "deep"][..],
        &["label", "deep", "--json"],
        &["run", "p.gp", "--input", "deep/images/f0.png"],
        &["run", "p.gp", "--input", "deep"],
        &["data", "import", "masks", "photos", "masks", "--ground", "1", "--out", "x"],
    ] {
        let output = place.command(arguments).output().expect("started");
        let said = [output.stdout, output.stderr].concat();
        let said = String::from_utf8_lossy(&said);
        assert_eq!(output.status.code(), Some(1), "{arguments:?}: {said}");
        for part in [".png", "22000x22000 pixels are too many", "scale the image down"] {
            assert!(said.contains(part), "{arguments:?}: no {part:?} in {said}");
        }
    }
}

#[test]
fn memory_bounds_an_import_too() {
    let place = Place::new();
    for folder in ["photos", "masks"] {
        fs::create_dir(place.path(folder)).expect("writable");
        for i in 0..3 {
            let shade = |x: u32, y: u32| Luma([u8::from(y > 200 + x / 9 + i)]);
            GrayImage::from_fn(600, 400, shade)
                .save(place.path(&format!("{folder}/{i}.png")))
                .expect("writable");
        }
    }
    let import = |out, memory| {
        ["data", "import", "masks", "photos", "masks", "--ground", "1", "--memory", memory, "--out", out]
    };
    let said = place.fails(1, &import("x", "0.0002"));
    assert!(
        said.contains("0.png: reading the picture takes about 3 MiB") && said.contains("--memory"),
        "{said}"
    );
    // One at a time, and all at once.
    place.ok(&import("x", "0.003"));
    place.ok(&import("y", "1"));
    for name in ["labels.csv", "images/0.png", "images/2.png"] {
        let read = |out: &str| fs::read(place.path(out).join(name)).expect("there");
        assert_eq!(read("x"), read("y"), "{name}");
    }
}

/// What systems leave among images: hidden files, companions of files, folders of small copies.
fn litter(place: &Place, folder: &str) {
    let copy = fs::read(place.path("data/images/drive_a_0.png")).expect("there");
    for name in [".hidden.png", "._drive_a_0.png", "._drive_b_1.png"] {
        place.write(&format!("{folder}/{name}"), &copy);
    }
    place.write(&format!("{folder}/._text.png"), "\0\x05\x16\x07\0\x02\0\0Mac OS X");
    for below in ["__MACOSX", "@eaDir", ".thumbnails"] {
        fs::create_dir_all(place.path(&format!("{folder}/{below}"))).expect("writable");
        place.write(&format!("{folder}/{below}/drive_a_0.png"), &copy);
    }
    for name in ["Thumbs.db", "desktop.ini", ".DS_Store"] {
        place.write(&format!("{folder}/{name}"), "no image");
    }
}

#[test]
fn hidden_files_count_nowhere() {
    let place = Place::new();
    place.write("p.gp", "(individual (iterate-up 2x2 x-obstacle raw))");
    let label = |place: &Place| {
        let mut command = place.command(&["label", "data", "--json"]);
        command.stdout(std::process::Stdio::piped());
        let mut run = command.spawn().expect("started");
        let mut line = String::new();
        let mut out = std::io::BufReader::new(run.stdout.take().expect("piped"));
        std::io::BufRead::read_line(&mut out, &mut line).expect("a line");
        run.kill().expect("it runs");
        run.wait().expect("it ends");
        let mut ready: Value = serde_json::from_str(&line).expect("JSON");
        ready.as_object_mut().expect("an object").remove("address");
        ready.to_string()
    };
    let frames = |place: &Place| -> Vec<Value> {
        let lines = place.ok(&["run", "p.gp", "--input", "data", "--quiet"]);
        let frame = |line: &str| serde_json::from_str::<Value>(line).expect("JSON")["image"].clone();
        lines.lines().map(frame).collect()
    };
    let clean = (place.ok(&["data", "check", "data"]), label(&place), frames(&place));
    litter(&place, "data");
    litter(&place, "data/images");
    assert_eq!((place.ok(&["data", "check", "data"]), label(&place), frames(&place)), clean);
    assert!(!clean.0.contains("without labels") && !clean.0.contains("subfolder"), "{}", clean.0);
    // Imports look into folders within.
    for folder in ["photos", "masks"] {
        fs::create_dir(place.path(folder)).expect("writable");
        let shade = |_, y: u32| Luma([u8::from(y > 20)]);
        GrayImage::from_fn(64, 48, shade).save(place.path(&format!("{folder}/a.png"))).expect("writable");
        litter(&place, folder);
    }
    let import = ["data", "import", "masks", "photos", "masks", "--ground", "1", "--json", "--out", "x"];
    let summary: Value = serde_json::from_str(&place.ok(&import)).expect("JSON");
    assert_eq!((&summary["images"], &summary["left_out"]), (&1.into(), &serde_json::json!([])));
}

/// A link to itself stands for a folder that cannot be searched: permissions do not keep everybody out.
#[cfg(unix)]
#[test]
fn a_folder_that_cannot_be_searched_is_one_error() {
    let place = Place::new();
    place.write("p.gp", "(individual (iterate-up 2x2 x-obstacle raw))");
    fs::remove_dir_all(place.path("data/images")).expect("there");
    std::os::unix::fs::symlink("images", place.path("data/images")).expect("writable");
    for arguments in [
        &["data", "check", "data"][..],
        &["eval", "p.gp", "--data", "data"],
        &["evolve", "--data", "data", "--out", "run"],
        &["label", "data"],
    ] {
        let output = place.command(arguments).output().expect("started");
        let said = [output.stdout, output.stderr].concat();
        let said = String::from_utf8_lossy(&said);
        assert_eq!(output.status.code(), Some(1), "{arguments:?}: {said}");
        assert!(
            said.contains("data/images cannot be searched") && said.contains("1 fault:"),
            "{arguments:?}: {said}"
        );
        assert!(!said.contains("is missing"), "{said}");
    }
    for arguments in [
        &["run", "p.gp", "--input", "data"][..],
        &["data", "import", "masks", "data/images", "data", "--ground", "1", "--out", "x"],
    ] {
        let output = place.command(arguments).output().expect("started");
        let said = one_error(&output, 1);
        assert!(said.contains("data/images: cannot be read"), "{said}");
    }
    // An image that is a link to itself is the image's own fault.
    fs::remove_file(place.path("data/images")).expect("there");
    dataset(6, 0).save(place.path("other")).expect("writable");
    fs::remove_file(place.path("other/images/drive_a_0.png")).expect("there");
    std::os::unix::fs::symlink("drive_a_0.png", place.path("other/images/drive_a_0.png")).expect("writable");
    let output = place.command(&["data", "check", "other"]).output().expect("started");
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(said.contains("1 fault:") && said.contains("`drive_a_0.png` is missing"), "{said}");
}
