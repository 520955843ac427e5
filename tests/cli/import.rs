//! `vsonar data import`: a scene of known geometry, annotated in every way, comes back with its labels.

use std::path::Path;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use image::{GrayImage, Luma, Rgb, RgbImage};
use serde_json::{Value, json};
use vsonar::dataset::Dataset;

use crate::common::*;

pub(crate) const SIZE: (u32, u32) = (96, 80);

/// A floor with two boxes on it, by its corners; rows and columns of the picture.
pub(crate) struct Scene {
    floor: Vec<[f64; 2]>,
    boxes: Vec<Vec<[f64; 2]>>,
}

/// Scenes that differ from picture to picture, with no corner in the middle of a pixel.
pub(crate) fn scene(i: u32) -> Scene {
    let i = f64::from(i);
    let floor = vec![[-3.0, 20.3 + i], [50.2, 14.6], [99.0, 30.9 - i], [99.0, 90.0], [-3.0, 90.0]];
    let first = vec![[10.3, 5.0], [30.8, 5.0], [33.4, 40.7 + 3.0 * i], [12.1, 44.2 + i]];
    let second = vec![[60.7, 10.0], [80.2, 12.0], [79.9, 79.9], [61.3, 55.4 + 2.0 * i]];
    Scene { floor, boxes: vec![first, second] }
}

/// Whether a point is inside a convex polygon, by the side of each edge it is on.
fn inside(polygon: &[[f64; 2]], [x, y]: [f64; 2]) -> bool {
    let side = |i: usize| {
        let ([x0, y0], [x1, y1]) = (polygon[i], polygon[(i + 1) % polygon.len()]);
        (x1 - x0) * (y - y0) - (y1 - y0) * (x - x0) > 0.0
    };
    (0..polygon.len()).all(|i| side(i) == side(0))
}

impl Scene {
    fn is_ground(&self, x: u32, y: u32) -> bool {
        let centre = [f64::from(x) + 0.5, f64::from(y) + 0.5];
        // The outline of the floor is convex but for its two upper edges.
        let under = {
            let ([x0, y0], [x1, y1], [x2, y2]) = (self.floor[0], self.floor[1], self.floor[2]);
            let edge = if centre[0] < x1 {
                y0 + (centre[0] - x0) / (x1 - x0) * (y1 - y0)
            } else {
                y1 + (centre[0] - x1) / (x2 - x1) * (y2 - y1)
            };
            centre[1] > edge
        };
        under && !self.boxes.iter().any(|outline| inside(outline, centre))
    }

    /// The label of a column, where row `y` of `height` shows the original row `row(y)`.
    fn label(&self, x: u32, height: u32, row: impl Fn(u32) -> u32) -> u32 {
        (0..height).rev().find(|&y| !self.is_ground(x, row(y))).unwrap_or(0)
    }

    pub(crate) fn picture(&self, i: u32) -> GrayImage {
        GrayImage::from_fn(SIZE.0, SIZE.1, |x, y| {
            Luma([if self.is_ground(x, y) { 90 } else { 180 } + ((x * 7 + y * 3 + i) % 23) as u8])
        })
    }
}

/// A place with pictures of some scenes in `photos`.
pub(crate) fn place(scenes: u32) -> Place {
    let place = Place::new();
    std::fs::create_dir(place.path("photos")).expect("writable");
    for i in 0..scenes {
        scene(i).picture(i).save(place.path(&format!("photos/scene_{i}.png"))).expect("writable");
    }
    place
}

fn masks(place: &Place, scenes: u32, save: impl Fn(&Scene, &Path)) {
    std::fs::create_dir(place.path("masks")).expect("writable");
    (0..scenes).for_each(|i| save(&scene(i), &place.path(&format!("masks/scene_{i}.png"))));
}

pub(crate) fn id_masks(place: &Place, scenes: u32) {
    masks(place, scenes, |scene, path| {
        let mask =
            GrayImage::from_fn(SIZE.0, SIZE.1, |x, y| Luma([if scene.is_ground(x, y) { 7 } else { 24 }]));
        mask.save(path).expect("writable");
    });
}

fn shape(label: &str, points: &[[f64; 2]]) -> Value {
    json!({"label": label, "points": points, "shape_type": "polygon", "group_id": null, "flags": {}})
}

/// LabelMe's file for a scene.
pub(crate) fn labelme(i: u32) -> Value {
    let scene = scene(i);
    let mut shapes = vec![shape("floor", &scene.floor)];
    shapes.extend(scene.boxes.iter().map(|outline| shape("box", outline)));
    json!({
        "version": "5.2.1", "flags": {}, "shapes": shapes, "imagePath": format!("scene_{i}.png"), "imageData": null,
        "imageHeight": SIZE.1, "imageWidth": SIZE.0
    })
}

pub(crate) fn labelme_files(place: &Place, scenes: u32) {
    (0..scenes).for_each(|i| place.write(&format!("photos/scene_{i}.json"), labelme(i).to_string()));
}

/// COCO's run lengths of the pixels for which `wanted` holds.
fn runs(wanted: impl Fn(u32, u32) -> bool) -> Vec<u64> {
    let mut counts = vec![0];
    let mut last = false;
    for (x, y) in (0..SIZE.0).flat_map(|x| (0..SIZE.1).map(move |y| (x, y))) {
        if wanted(x, y) != last {
            last = !last;
            counts.push(0);
        }
        *counts.last_mut().expect("one at least") += 1;
    }
    counts
}

/// COCO's text form of run lengths, as its definition says.
fn text(counts: &[u64]) -> String {
    let mut text = String::new();
    for (i, &count) in counts.iter().enumerate() {
        let mut number = count as i64 - if i > 2 { counts[i - 2] as i64 } else { 0 };
        loop {
            let group = number & 31;
            number >>= 5;
            let last = number == if group & 16 != 0 { -1 } else { 0 };
            text.push(char::from(b'0' + (group | if last { 0 } else { 32 }) as u8));
            if last {
                break;
            }
        }
    }
    text
}

/// A COCO file of the scenes: the floor as a polygon, or as run lengths of one of the two forms.
pub(crate) fn coco(scenes: u32, form: &str) -> Value {
    let mut annotations = Vec::new();
    for i in 0..scenes {
        let scene = scene(i);
        let flat = |points: &[[f64; 2]]| points.concat();
        // Objects in an order in which a later one does not cover an earlier one.
        let boxes: Vec<_> = scene.boxes.iter().map(|outline| flat(outline)).collect();
        annotations
            .push(json!({"image_id": i, "category_id": 5, "segmentation": boxes, "iscrowd": 0, "id": 2 * i}));
        let counts = runs(|x, y| scene.is_ground(x, y));
        let size = [SIZE.1, SIZE.0];
        let segmentation = match form {
            "polygons" => json!([flat(&scene.floor)]),
            "numbers" => json!({"size": size, "counts": counts}),
            _ => json!({"size": size, "counts": text(&counts)}),
        };
        let crowd = u32::from(form != "polygons");
        annotations.push(json!({
            "image_id": i, "category_id": 9, "segmentation": segmentation, "iscrowd": crowd, "id": 2 * i + 1
        }));
    }
    let image = |i| json!({"id": i, "file_name": format!("scene_{i}.png"), "width": SIZE.0, "height": SIZE.1, "license": 1});
    json!({
        "info": {}, "images": (0..scenes).map(image).collect::<Vec<_>>(),
        "categories": [{"id": 5, "name": "box"}, {"id": 9, "name": "floor", "supercategory": "x"}],
        "annotations": annotations
    })
}

/// Every case of the new folder against the scenes, at the original size.
fn is_exact(place: &Place, folder: &str, scenes: u32, columns: usize) {
    let set = Dataset::load(place.path(folder)).expect("sound");
    assert_eq!(
        (set.width(), set.height(), set.images().len()),
        (SIZE.0, SIZE.1, scenes as usize),
        "{folder}"
    );
    assert_eq!(set.cases().len(), scenes as usize * columns, "{folder}");
    for case in set.cases() {
        let name = &set.images()[case.image].name;
        let i: u32 = name["scene_".len()..name.len() - 4].parse().expect("a number");
        assert_eq!(set.images()[case.image].pixels, scene(i).picture(i), "{folder} {name}");
        assert_eq!(case.y, scene(i).label(case.x, SIZE.1, |y| y), "{folder} {name} column {}", case.x);
    }
}

#[test]
fn every_format_gives_the_labels_of_the_scene() {
    let place = place(3);
    id_masks(&place, 3);
    labelme_files(&place, 3);
    let all = (0..SIZE.0).map(|x| x.to_string()).collect::<Vec<_>>().join(",");
    let import = |arguments: &[&str], out: &str| {
        let said = place.ok(&[&["data", "import"], arguments, &["--columns", &all, "--out", out]].concat());
        assert!(said.contains("no faults") && said.contains("imported  3 images, 288 cases"), "{said}");
        assert!(said.ends_with(&format!("Next: vsonar evolve --data {out}\n")), "{said}");
        is_exact(&place, out, 3, SIZE.0 as usize);
    };
    import(&["masks", "photos", "masks", "--ground", "7"], "a");
    import(&["labelme", "photos", "--ground", "floor"], "b");
    for (i, form) in ["polygons", "numbers", "text"].into_iter().enumerate() {
        place.write("coco.json", coco(3, form).to_string());
        let out = format!("c{i}");
        import(&["coco", "coco.json", "--images", "photos", "--ground", "floor"], &out);
    }
    // The picture inside the file, whatever is beside it.
    for i in 0..3 {
        let picture = std::fs::read(place.path(&format!("photos/scene_{i}.png"))).expect("there");
        let mut file = labelme(i);
        file["imageData"] = STANDARD.encode(picture).into();
        place.write(&format!("scene_{i}.json"), file.to_string());
    }
    import(&["labelme", "scene_0.json", "scene_1.json", "scene_2.json", "--ground", "floor"], "d");
    // The same answers to the same question, asked from the other side.
    let others = ["labelme", "photos", "--obstacle", "box", "--columns", &all, "--out", "e"];
    place.ok(&[&["data", "import"], &others[..]].concat());
    let set = Dataset::load(place.path("e")).expect("sound");
    let boxes_only = |i: u32, x: u32| {
        let covered = |y: u32| {
            scene(i).boxes.iter().any(|outline| inside(outline, [f64::from(x) + 0.5, f64::from(y) + 0.5]))
        };
        (0..SIZE.1).rev().find(|&y| covered(y)).unwrap_or(0)
    };
    assert!(set.cases().iter().all(|case| case.y == boxes_only(case.image as u32, case.x)));
    assert!(set.cases().iter().any(|case| case.y == 0));
}

#[test]
fn labels_are_those_of_the_picture_as_it_is_scaled() {
    let place = place(2);
    id_masks(&place, 2);
    let flags = ["--crop", "8,10,80,64", "--size", "40x32", "--columns", "0,7,13,20,31,39", "--out", "half"];
    place.ok(&[&["data", "import", "masks", "photos", "masks", "--ground", "7"], &flags[..]].concat());
    let set = Dataset::load(place.path("half")).expect("sound");
    assert_eq!((set.width(), set.height(), set.cases().len()), (40, 32, 12));
    for case in set.cases() {
        // The middle of pixel 3 of 40 is the edge of pixels 6 and 7 of 80: the second of them counts.
        let expected = scene(case.image as u32).label(8 + 2 * case.x + 1, 32, |y| 10 + 2 * y + 1);
        assert_eq!(case.y, expected, "column {}", case.x);
    }
    // Polygons say the same.
    labelme_files(&place, 2);
    let flags = [&flags[..7], &["polygons"]].concat();
    place.ok(&[&["data", "import", "labelme", "photos", "--ground", "floor"], &flags[..]].concat());
    let other = Dataset::load(place.path("polygons")).expect("sound");
    assert_eq!((other.cases(), other.images()), (set.cases(), set.images()));
    // Gray levels are averages of the neighbourhood.
    let (original, small) = (scene(0).picture(0), &set.images()[0].pixels);
    for (x, y, pixel) in small.enumerate_pixels() {
        let around = (0..4).flat_map(|dx| (0..4).map(move |dy| (dx, dy)));
        let levels: Vec<u8> = around
            .filter_map(|(dx, dy)| {
                original
                    .get_pixel_checked((8 + 2 * x + dx).wrapping_sub(1), (10 + 2 * y + dy).wrapping_sub(1))
            })
            .map(|p| p.0[0])
            .collect();
        let (min, max) = (levels.iter().min().expect("some"), levels.iter().max().expect("some"));
        assert!((min..=max).contains(&&pixel.0[0]), "{x} {y}");
    }
}

#[test]
fn colours_suffixes_and_ignored_pixels() {
    let place = place(0);
    std::fs::create_dir_all(place.path("photos/hall")).expect("writable");
    for (i, name) in ["hall/a_left", "hall/b_left", "c_left", "c_right"].into_iter().enumerate() {
        scene(0).picture(i as u32).save(place.path(&format!("photos/{name}.png"))).expect("writable");
    }
    std::fs::create_dir_all(place.path("masks/hall")).expect("writable");
    let mask = RgbImage::from_fn(SIZE.0, SIZE.1, |x, y| {
        // Column 8 is ignored all over, 24 at the top, where it does not matter, 40 in the middle, where it does.
        match (x, y) {
            (8, _) | (24, 0..3) | (40, 40..50) => Rgb([0, 0, 0]),
            _ if y > 30 => Rgb([128, 64, 128]),
            _ => Rgb([1, 2, 3]),
        }
    });
    for name in ["hall/a_color", "c_color", "hall/left_over_color"] {
        mask.save(place.path(&format!("masks/{name}.png"))).expect("writable");
    }
    let flags =
        ["--ground", "#804080", "--ignore", "#000000", "--columns", "8,24,40,56", "--json", "--out", "new"];
    let suffixes = ["--image-suffix", "_left", "--mask-suffix", "_color"];
    let said = place.ok(&[&["data", "import", "masks", "photos", "masks"], &flags[..], &suffixes].concat());
    let said: Value = serde_json::from_str(&said).expect("JSON");
    assert_eq!(
        (&said["images"], &said["cases"], &said["undecided"]),
        (&json!(2), &json!(4), &json!(4)),
        "{said}"
    );
    assert_eq!(said["check"]["faults"], json!([]), "{said}");
    let left_out: Vec<&str> =
        said["left_out"].as_array().expect("a list").iter().filter_map(|o| o["name"].as_str()).collect();
    assert_eq!(left_out, ["hall/b_left.png", "hall/left_over_color.png"], "{said}");
    assert_eq!(
        place.read("new/labels.csv"),
        "image,x,y\nc_left.png,24,30\nc_left.png,56,30\nhall/a_left.png,24,30\nhall/a_left.png,56,30\n"
    );
    // Nothing but ignored pixels: no image is left.
    let all = ["--ground", "#804080", "--ignore", "#000000", "--columns", "8,", "--out", "x"];
    let complaint =
        place.fails(1, &[&["data", "import", "masks", "photos", "masks"], &all[..], &suffixes].concat());
    assert!(complaint.contains("no image to import") && complaint.contains("ignored"), "{complaint}");
}

#[test]
fn later_shapes_cover_earlier_ones_and_all_kinds_are_read() {
    let place = place(1);
    let full = |label: &str| shape(label, &[[0.0, 0.0], [96.0, 0.0], [96.0, 80.0], [0.0, 80.0]]);
    let mut file = labelme(0);
    let mask = GrayImage::from_fn(2, 3, |x, _| Luma([255 * x as u8]));
    let mut png = std::io::Cursor::new(Vec::new());
    mask.write_to(&mut png, image::ImageFormat::Png).expect("room");
    file["shapes"] = json!([
        full("box"),
        full("floor"),
        {"label": "box", "points": [[30.0, 20.0], [10.0, 10.0]], "shape_type": "rectangle"},
        {"label": "box", "points": [[50.5, 30.5], [53.0, 30.5]], "shape_type": "circle"},
        {"label": "box", "points": [[70.0, 40.0], [71.0, 42.0]], "shape_type": "mask", "mask": STANDARD.encode(png.into_inner())},
        {"label": "box", "points": [[80.0, 0.0], [80.0, 79.0]], "shape_type": "line"},
        {"label": "box", "points": [[85.0, 50.0]], "shape_type": "point"},
        {"label": "mirror", "points": [[90.0, 60.0], [96.0, 60.0], [96.0, 80.0]]}
    ]);
    place.write("photos/scene_0.json", file.to_string());
    let flags = ["--columns", "9,10,29,30,50,52,53,70,71,80,85,95", "--ignore", "mirror", "--out", "new"];
    let said =
        place.ok(&[&["data", "import", "labelme", "photos", "--ground", "floor"], &flags[..]].concat());
    assert!(said.contains("1 column, which depend on ignored pixels"), "{said}");
    let set = Dataset::load(place.path("new")).expect("sound");
    let labels: Vec<(u32, u32)> = set.cases().iter().map(|case| (case.x, case.y)).collect();
    let expected = [
        (9, 0),
        (10, 19),
        (29, 19),
        (30, 0),
        (50, 32),
        (52, 31),
        (53, 0),
        (70, 0),
        (71, 42),
        (80, 0),
        (85, 0),
    ];
    assert_eq!(labels, expected);
}

#[test]
fn names_are_kept_sane() {
    let place = place(1);
    let picture = std::fs::read(place.path("photos/scene_0.png")).expect("there");
    place.write("photos/my photo.png", &picture);
    scene(0).picture(0).save(place.path("photos/scene_0.bmp")).expect("writable");
    for (file, path) in [("1", "scene_0.png"), ("2", "scene_0.bmp"), ("3", "./my photo.png")] {
        let mut annotated = labelme(0);
        annotated["imagePath"] = path.into();
        place.write(&format!("photos/{file}.json"), annotated.to_string());
    }
    place.ok(&["data", "import", "labelme", "photos", "--ground", "floor", "--out", "new"]);
    let mut names: Vec<_> = std::fs::read_dir(place.path("new/images")).expect("there").collect();
    names.sort_by_key(|entry| entry.as_ref().expect("readable").file_name());
    let names: Vec<_> =
        names.into_iter().map(|e| e.expect("readable").file_name().into_string().expect("text")).collect();
    assert_eq!(names, ["my_photo.png", "scene_0.bmp.png", "scene_0.png"]);
    // Paths of another machine: only the name counts, in the folder that is given.
    let mut annotated = labelme(0);
    annotated["imagePath"] = "..\\elsewhere\\scene_0.png".into();
    place.write("far.json", annotated.to_string());
    let refused =
        place.fails(1, &["data", "import", "labelme", "far.json", "--ground", "floor", "--out", "x"]);
    assert!(
        refused.contains("scene_0.png: there is no picture scene_0.png; `--images DIR` gives"),
        "{refused}"
    );
    let given = ["--images", "photos", "--ground", "floor", "--out", "far"];
    place.ok(&[&["data", "import", "labelme", "far.json"], &given[..]].concat());
    assert!(place.path("far/images/scene_0.png").exists());
}
