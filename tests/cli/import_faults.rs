//! `vsonar data import`: flags, pictures and annotations that make no sense.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use image::{GrayImage, RgbImage};
use serde_json::{Value, json};

use crate::common::plain;
use crate::import::*;

#[test]
fn flags_that_make_no_sense() {
    let place = place(1);
    id_masks(&place, 1);
    labelme_files(&place, 1);
    let masks = ["data", "import", "masks", "photos", "masks"];
    let labelme = ["data", "import", "labelme", "photos"];
    for (command, flags, said) in [
        (&masks[..], &["--out", "x"][..], "--ground"),
        (&masks, &["--ground", "red", "--out", "x"], "numbers from 0"),
        (&masks, &["--ground", "1,#000000", "--out", "x"], "numbers from 0"),
        (&masks, &["--ground", "7", "--ignore", "#000000", "--out", "x"], "--ignore"),
        (&masks, &["--ground", "7", "--ignore", "7,8", "--out", "x"], "7 is ground too"),
        (&masks, &["--ground", "7", "--columns", "97", "--out", "x"], "96 pixels wide"),
        (&masks, &["--ground", "7", "--columns", "5,96", "--out", "x"], "0 to 95"),
        (&masks, &["--ground", "7", "--columns", "5,6,5", "--out", "x"], "5 is there twice"),
        (&masks, &["--ground", "7", "--crop", "1,2,3", "--out", "x"], "four whole numbers"),
        (&masks, &["--ground", "7", "--size", "10x10", "--out", "x"], "16 to"),
        (&masks, &["--ground", "7"], "--out"),
        (&labelme, &["--out", "x"], "--ground"),
        (&labelme, &["--ground", "floor", "--obstacle", "box", "--out", "x"], "cannot be used with"),
        (&["data", "import"], &[], "masks"),
    ] {
        let before = place.everything();
        let output = place.command(&[command, flags].concat()).output().expect("started");
        let complaint = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{flags:?}: {complaint}");
        assert!(complaint.contains(said), "{flags:?}: {complaint}");
        assert!(before == place.everything(), "{flags:?}");
    }
}

#[test]
fn pictures_and_masks_that_cannot_be_used() {
    let place = place(2);
    id_masks(&place, 2);
    let import = |flags: &[&str]| {
        place.fails(1, &[&["data", "import", "masks", "photos", "masks", "--out", "x"], flags].concat())
    };
    assert!(import(&["--ground", "5"]).contains("the values there are 7, 24"));
    assert!(import(&["--ground", "#070707", "--crop", "0,0,97,20"]).contains("reaches out of the picture"));
    assert!(import(&["--ground", "7", "--crop", "0,0,15,20"]).contains("15x20 pixels are left"));
    let said =
        place.fails(1, &["data", "import", "masks", "photos", "nowhere", "--ground", "7", "--out", "x"]);
    assert!(said.contains("nowhere: there is no such folder; check the path"), "{said}");
    let said = place.fails(1, &["data", "import", "masks", "masks", "data", "--ground", "7", "--out", "x"]);
    assert!(said.contains("no image to import") && said.contains("there is no mask `scene_0`"), "{said}");
    let said =
        place.fails(1, &["data", "import", "masks", "photos", "masks", "--ground", "7", "--out", "data"]);
    assert!(said.contains("never overwritten"), "{said}");
    std::fs::create_dir(place.path("after")).expect("writable");
    std::fs::copy(place.path("masks/scene_0.png"), place.path("after/scene_0_mask.png")).expect("writable");
    let said = place.fails(1, &["data", "import", "masks", "photos", "after", "--ground", "7", "--out", "x"]);
    let reason = "names must be the same but for the ending, and `scene_0_mask.png` is not: `--mask-suffix _mask` takes it";
    assert!(said.contains(reason) && !said.contains("a mask without a picture"), "{said}");
    // Of another size, cut off, in colour, twice.
    let mask = std::fs::read(place.path("masks/scene_1.png")).expect("there");
    GrayImage::new(96, 79).save(place.path("masks/scene_1.png")).expect("writable");
    let said = import(&["--ground", "7"]);
    assert!(said.contains("scene_1.png: is of 96x79 pixels") && said.contains("has 96x80"), "{said}");
    assert!(said.contains("--skip-faulty"), "{said}");
    place.write("masks/scene_1.png", &mask[..mask.len() / 2]);
    assert!(import(&["--ground", "7"]).contains("masks/scene_1.png"));
    let colours = RgbImage::from_pixel(96, 80, image::Rgb([128, 64, 128]));
    colours.save(place.path("masks/scene_1.png")).expect("writable");
    assert!(import(&["--ground", "7"]).contains("is in colour; say which colours"));
    place.write("masks/scene_1.png", &mask);
    GrayImage::new(96, 80).save(place.path("masks/scene_1.bmp")).expect("writable");
    assert!(import(&["--ground", "7"]).contains("second mask for the picture `scene_1`"));
    std::fs::remove_file(place.path("masks/scene_1.bmp")).expect("there");
    // The picture is cut off; all others are taken if one wishes.
    let picture = std::fs::read(place.path("photos/scene_1.png")).expect("there");
    place.write("photos/scene_1.png", &picture[..picture.len() / 2]);
    assert!(import(&["--ground", "7"]).contains("photos/scene_1.png"));
    let flags = ["--ground", "7", "--skip-faulty", "--out", "rest"];
    let said = place.ok(&[&["data", "import", "masks", "photos", "masks"], &flags[..]].concat());
    assert!(
        said.contains("left out  1\n  scene_1.png: ") && said.contains("imported  1 image, 6 cases"),
        "{said}"
    );
    // Another size than the first one's.
    GrayImage::new(96, 79).save(place.path("photos/scene_1.png")).expect("writable");
    GrayImage::new(96, 79).save(place.path("masks/scene_1.png")).expect("writable");
    assert!(import(&["--ground", "7"]).contains("becomes 96x79 pixels, and the first picture 96x80"));
}

#[test]
fn labelme_files_that_make_no_sense() {
    let place = place(1);
    let import = |text: &str, said: &str| {
        place.write("photos/scene_0.json", text);
        let complaint =
            place.fails(1, &["data", "import", "labelme", "photos", "--ground", "floor", "--out", "x"]);
        assert!(complaint.contains("photos/scene_0.json") && complaint.contains(said), "{said}: {complaint}");
    };
    let with = |change: &dyn Fn(&mut Value)| {
        let mut file = labelme(0);
        change(&mut file);
        file.to_string()
    };
    import("", "is empty; move it elsewhere, or export the annotations as LabelMe");
    import("{\"shapes\": [", "line 1");
    import("{}", "is not a LabelMe file, for it has no `shapes`; move it elsewhere");
    import("[{}]", "is a list");
    import("<annotation/>", "is XML");
    import(
        &with(&|f| f["shapes"][0]["points"] = json!([[1, 2], [3]])),
        "shapes[0]: points[1] is not a pair of numbers",
    );
    import(
        &with(&|f| f["shapes"][1]["points"] = json!([[1, 2], [3, 4]])),
        "shapes[1]: the polygon has 2 points, and no area",
    );
    import(&labelme(0).to_string().replace("50.2", "NaN"), "shapes[0]: points[1] is not a pair of numbers");
    import(&labelme(0).to_string().replace("50.2", "1e999"), "line 1 column");
    import(
        &with(&|f| f["shapes"][0]["shape_type"] = "blob".into()),
        "shapes[0]: no area is known of a shape of the kind `blob`",
    );
    import(&with(&|f| f["imageHeight"] = "high".into()), "imageHeight: is \"high\", not a number of pixels");
    import(&with(&|f| f["shapes"][2]["shape_type"] = "circle".into()), "shapes[2]: has 4 points, and 2");
    import(&with(&|f| f["imageWidth"] = 97.into()), "is of 97x80 pixels");
    for path in ["..", "photos/", "", "C:a.png"] {
        import(&with(&|f| f["imagePath"] = path.into()), "not a path below the folder");
    }
    import(&with(&|f| f["imageData"] = "%%%".into()), "imageData: ");
    import(
        &with(&|f| f["imageData"] = STANDARD.encode("no picture").into()),
        "not an image of a known format",
    );
    import(&format!("{{\"shapes\": {}", "[".repeat(100_000)), "line 1");
    // What is only missing is left out, and then nothing is left.
    let complaint = |text: String| {
        place.write("photos/scene_0.json", text);
        place.fails(1, &["data", "import", "labelme", "photos", "--ground", "floor", "--out", "x"])
    };
    assert!(
        complaint(with(&|f| f["imagePath"] = "none.png".into()))
            .contains("there is no picture photos/none.png")
    );
    assert!(
        complaint(with(&|f| f["shapes"] = json!([])))
            .contains("no shape is labelled \"floor\"; there are: none")
    );
    let said = complaint(with(&|f| f["shapes"][0]["label"] = "Floor".into()));
    assert!(said.contains("no shape is labelled \"floor\"; there are: \"Floor\", \"box\""), "{said}");
    let outside = json!([[200, 200], [300, 200], [300, 300]]);
    assert!(complaint(with(&|f| f["shapes"][0]["points"] = outside.clone())).contains("nothing is ground"));
    let said =
        place.fails(1, &["data", "import", "labelme", "masks.json", "--ground", "floor", "--out", "x"]);
    assert!(said.contains("masks.json: cannot be read") && !said.contains("--skip-faulty"), "{said}");
}

#[test]
fn what_is_asked_for_and_has_no_area_is_named() {
    let place = place(1);
    labelme_files(&place, 1);
    let mut file: Value = serde_json::from_str(&place.read("photos/scene_0.json")).expect("JSON");
    let count = file["shapes"].as_array().map_or(0, Vec::len);
    let line = json!({"label": "floor", "points": [[1, 1], [9, 9], [9, 1]], "shape_type": "linestrip"});
    file["shapes"].as_array_mut().expect("a list").push(line);
    place.write("photos/scene_0.json", file.to_string());
    let flags = ["data", "import", "labelme", "photos", "--out", "x"];
    let said = place.fails(1, &[&flags[..], &["--ground", "floor"]].concat());
    let place_of = format!("photos/scene_0.json: shapes[{count}]");
    assert!(
        said.contains(&place_of) && said.contains("no area is known of a shape of the kind `linestrip`"),
        "{said}"
    );
    assert!(said.contains("`floor`") && said.contains("--skip-faulty"), "{said}");
    // Of what is not asked for it does not matter.
    place.ok(&[&flags[..], &["--obstacle", "box"]].concat());
}

#[test]
fn a_name_with_a_comma_can_be_given() {
    let place = place(1);
    let mut file = coco(1, "polygons");
    let categories = file["categories"].as_array_mut().expect("a list");
    let floor = categories.iter_mut().find(|one| one["name"] == "floor").expect("there");
    floor["name"] = "tiles, wet".into();
    place.write("coco.json", file.to_string());
    let import = ["data", "import", "coco", "coco.json", "--images", "photos"];
    let said = place.fails(1, &[&import[..], &["--ground", "tiles, wet", "--out", "x"]].concat());
    assert!(said.contains(r#"no category is named "tiles"; there are: "box", "tiles, wet""#), "{said}");
    place.ok(&[&import[..], &["--ground", r#""tiles, wet",box"#, "--out", "both"]].concat());
    place.ok(&[&import[..], &["--ground", r#""tiles, wet""#, "--ground", "box", "--out", "again"]].concat());
    assert_eq!(place.read("both/labels.csv"), place.read("again/labels.csv"));
    let said = place.fails(2, &[&import[..], &["--ground", r#""tiles, wet"#, "--out", "x"]].concat());
    assert!(said.contains("--ground") && said.contains("not closed"), "{said}");
}

#[test]
fn coco_files_that_make_no_sense() {
    let place = place(2);
    let import = |change: &dyn Fn(&mut Value), said: &str| {
        let mut file = coco(2, "polygons");
        change(&mut file);
        place.write("coco.json", file.to_string());
        let flags = ["coco.json", "--images", "photos", "--ground", "floor", "--out", "x"];
        let complaint = place.fails(1, &[&["data", "import", "coco"], &flags[..]].concat());
        assert!(complaint.contains(said), "{said}: {complaint}");
        complaint
    };
    let segment = |value: Value| move |f: &mut Value| f["annotations"][1]["segmentation"] = value.clone();
    import(&|f| *f = json!([]), "coco.json: is a list");
    for list in ["images", "categories", "annotations"] {
        import(&|f| f[list] = Value::Null, &format!("coco.json: has no `{list}`, and a COCO file has"));
    }
    import(&|f| f["images"] = 3.into(), "invalid type");
    import(&|f| f["images"][1]["id"] = 0.into(), "images[1].id: there is an image of the id 0 before");
    import(
        &|f| f["categories"][1]["name"] = "flor".into(),
        "no category is named \"floor\"; there are: \"box\", \"flor\"",
    );
    for name in ["..", "", "photos/", "C:scene_0.png"] {
        import(&|f| f["images"][0]["file_name"] = name.into(), "images[0].file_name: ");
    }
    import(&|f| f["images"][0]["width"] = 95.into(), "is of 95x80 pixels");
    import(&segment(json!([[1, 2, 3, 4, 5, 6, 7]])), "polygon 0 has 7 numbers");
    let deep = (0..500).fold(json!(1), |inner, _| json!([inner]));
    import(&segment(deep), "recursion limit exceeded at line 1");
    import(&segment(json!("text")), "a list of polygons or has `size` and `counts`");
    let runs = |counts: Value| segment(json!({"size": [SIZE.1, SIZE.0], "counts": counts}));
    import(&runs(json!([1, 2])), "run lengths are of 3 pixels, and 96x80 are 7680");
    import(&runs(json!([0, u64::MAX, u64::MAX])), "run lengths are of at least");
    import(&runs(json!("~~")), "not in COCO's text form, at character 1");
    import(
        &segment(json!({"size": [96, 80], "counts": [7680]})),
        "its segmentation is of 80x96 pixels, and the image of 96x80",
    );
    // A single fault leaves the others alone if one wishes.
    let said = import(&segment(json!("text")), "--skip-faulty");
    assert!(said.matches("error").count() == 1, "{said}");
    let flags = ["--images", "photos", "--ground", "floor", "--skip-faulty", "--out", "rest"];
    let said = place.ok(&[&["data", "import", "coco", "coco.json"], &flags[..]].concat());
    assert!(
        said.contains("imported  1 image")
            && said.contains("left out  1")
            && said.contains("annotations[1] (id 1): its segmentation"),
        "{said}"
    );
    // Pictures that are not there, or have no object.
    let mut file = coco(2, "polygons");
    file["annotations"].as_array_mut().expect("a list").truncate(2);
    file["images"].as_array_mut().expect("a list").push(json!({"id": 7, "file_name": "none.png"}));
    place.write("coco.json", file.to_string());
    let flags = ["--images", "photos", "--ground", "floor", "--out", "one"];
    let said = place.ok(&[&["data", "import", "coco", "coco.json"], &flags[..]].concat());
    assert!(said.contains("left out  2") && said.contains("nothing is annotated in it"), "{said}");
}

#[test]
#[cfg(unix)]
fn ctrl_c_leaves_nothing_behind() {
    use std::process::Stdio;
    let place = place(1);
    // Large ones, which take their time, a few at a time.
    let picture = GrayImage::from_fn(1600, 1200, |x, y| image::Luma([((x * x + y * y) / 64) as u8]));
    picture.save(place.path("photos/scene_0.png")).expect("writable");
    std::fs::create_dir(place.path("masks")).expect("writable");
    image::GrayImage::new(1600, 1200).save(place.path("masks/scene_0.png")).expect("writable");
    for i in 1..200 {
        for folder in ["photos", "masks"] {
            let name = |i: u32| place.path(&format!("{folder}/scene_{i}.png"));
            std::fs::hard_link(name(0), name(i)).expect("writable");
        }
    }
    let mut command =
        place.command(&["data", "import", "masks", "photos", "masks", "--ground", "0", "--out", "x"]);
    let run = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("started");
    let hidden = place.part_of("x");
    let start = std::time::Instant::now();
    while !hidden.join("images").exists() {
        assert!(start.elapsed().as_secs() < 300, "no image was written");
        std::thread::sleep(std::time::Duration::from_millis(2));
    }
    crate::interruption::interrupt(&run);
    let output = run.wait_with_output().expect("it ends");
    let said = String::from_utf8(output.stderr).expect("UTF-8");
    assert_eq!((output.status.code(), said.as_str()), (Some(130), "interrupted; nothing was written\n"));
    assert!(!place.path("x").exists() && !hidden.exists());
}

#[test]
#[cfg(target_os = "linux")]
fn names_that_are_no_text_are_left_out() {
    use std::os::unix::ffi::OsStrExt;
    let place = place(1);
    id_masks(&place, 1);
    let odd = place.path("photos").join(std::ffi::OsStr::from_bytes(b"a\xff\x1b[2J.png"));
    std::fs::copy(place.path("photos/scene_0.png"), odd).expect("writable");
    let said = place.ok(&["data", "import", "masks", "photos", "masks", "--ground", "7", "--out", "new"]);
    assert!(said.contains("left out  1\n") && said.contains("its name is not UTF-8"), "{said}");
    assert!(plain(&said), "{said:?}");
}

/// A floor between a soft edge above and one below, as smoothing a mask of 0 and 255 leaves it.
fn smoothed() -> GrayImage {
    let edge = [80, 175, 231, 247, 255];
    GrayImage::from_fn(64, 48, |_, y| {
        let level = match y {
            0..16 => 0,
            16..21 => edge[y as usize - 16],
            21..44 => 255,
            _ => [247, 231, 175, 80][y as usize - 44],
        };
        image::Luma([level])
    })
}

#[test]
fn values_in_no_class_are_counted_and_reported() {
    let place = place(0);
    std::fs::create_dir(place.path("masks")).expect("writable");
    GrayImage::new(64, 48).save(place.path("photos/a.png")).expect("writable");
    smoothed().save(place.path("masks/a.png")).expect("writable");
    let import = |flags: &[&str]| {
        place.ok(&[&["data", "import", "masks", "photos", "masks", "--columns", "3,15"], flags].concat())
    };
    let said = import(&["--ground", "255", "--out", "o1"]);
    assert!(said.contains("values    255 (ground, 50.0 %), 0 (obstacle, 33.3 %)\n"), "{said}");
    assert!(said.contains("note: 16 pixels (16.7 %) have values in no class"), "{said}");
    assert!(said.contains("80, 175, 231, 247 (4 values)"), "{said}");
    // Classes that are named are all there are.
    let said = import(&["--ground", "255,175,231", "--obstacle", "0,80", "--out", "o2"]);
    assert!(
        said.contains("4 pixels (4.2 %) have values in no class") && said.contains("247 (1 value)"),
        "{said}"
    );
    let said = import(&["--ground", "255,80,175,231,247", "--obstacle", "0", "--out", "o3"]);
    assert!(!said.contains("in no class"), "{said}");
    // Rare classes of whole areas are none that are missing.
    GrayImage::from_fn(64, 48, |x, y| image::Luma([if y > 30 { 7 } else { (x / 8 + y / 4) as u8 + 20 }]))
        .save(place.path("masks/a.png"))
        .expect("writable");
    let said = import(&["--ground", "7", "--out", "o4"]);
    assert!(said.contains("values    7 (ground") && !said.contains("in no class"), "{said}");
    let json = import(&["--ground", "7", "--obstacle", "20,21", "--out", "o5", "--json"]);
    let summary: Value = serde_json::from_str(&json).expect("JSON");
    let values = &summary["values"];
    assert_eq!((&values["pixels"], &values["values"][0]["class"]), (&96.into(), &"ground".into()));
    assert_eq!(values["in_no_class"], 96 - 2 * 17 - (8 + 4), "{values}");
    for (flags, said) in
        [(["--obstacle", "#000000"], "--obstacle: give numbers"), (["--obstacle", "7"], "7 is ground too")]
    {
        let arguments =
            [&["data", "import", "masks", "photos", "masks", "--ground", "7", "--out", "x"], &flags[..]]
                .concat();
        let error = place.fails(2, &arguments);
        assert!(error.contains(said), "{error}");
    }
}
