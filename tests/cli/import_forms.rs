//! `vsonar data import`: annotations in the forms that other tools write, and pictures that are annotated twice.

use image::{GrayImage, Luma};
use serde_json::{Value, json};

use crate::common::*;

/// A place with pictures of 64 x 48 pixels, all different.
fn place(pictures: &[&str]) -> Place {
    let place = Place::new();
    for (i, name) in pictures.iter().enumerate() {
        let path = place.path(name);
        std::fs::create_dir_all(path.parent().expect("a folder")).expect("writable");
        let picture = GrayImage::from_fn(64, 48, |x, y| Luma([(x + 3 * y) as u8 + i as u8]));
        picture.save(path).expect("writable");
    }
    place
}

/// The corners of what is below a row.
fn below(row: u32) -> Value {
    json!([[0, row], [64, row], [64, 48], [0, 48]])
}

fn shape(label: &str, kind: &str, points: Value) -> Value {
    json!({"label": label, "points": points, "shape_type": kind, "group_id": null, "flags": {}})
}

fn labelme(picture: &str, shapes: Value) -> String {
    json!({
        "version": "5.4.1", "flags": {}, "shapes": shapes, "imagePath": picture, "imageData": null, "imageHeight": 48,
        "imageWidth": 64
    })
    .to_string()
}

/// A COCO file of a picture with a floor below row 20.
fn coco(picture: &str) -> Value {
    json!({
        "images": [{"id": 1, "file_name": picture, "width": 64, "height": 48}],
        "categories": [{"id": 1, "name": "floor"}, {"id": 2, "name": "box"}],
        "annotations": [floor(1, 1, 20)]
    })
}

fn floor(id: i32, image: i32, row: u32) -> Value {
    json!({
        "id": id, "image_id": image, "category_id": 1, "segmentation": [[0, row, 64, row, 64, 48, 0, 48]], "area": 1,
        "bbox": [0, row, 64, 28], "iscrowd": 0
    })
}

fn push(file: &mut Value, list: &str, entry: Value) {
    file[list].as_array_mut().expect("a list").push(entry);
}

const FLAGS: [&str; 6] = ["--ground", "floor", "--columns", "3,15", "--out", "o"];

/// Imports what must do, and gives what was said and the table.
fn imported(place: &Place, import: &[&str]) -> (String, String) {
    let said = place.ok(&[&["data", "import"], import, &FLAGS].concat());
    let table = place.read("o/labels.csv");
    std::fs::remove_dir_all(place.path("o")).expect("there");
    (said, table)
}

fn refused(place: &Place, import: &[&str]) -> String {
    let said = place.fails(1, &[&["data", "import"], import, &FLAGS].concat());
    assert!(!place.path("o").exists());
    said
}

const COCO: [&str; 4] = ["coco", "c.json", "--images", "img"];
const TABLE: &str = "image,x,y\na.png,3,19\na.png,15,19\n";

fn coco_imported(place: &Place, file: &Value) -> (String, String) {
    place.write("c.json", file.to_string());
    imported(place, &COCO)
}

#[test]
fn closed_shapes_of_labelme_are_polygons() {
    let place = place(&["a.png"]);
    let corners = json!([[10, 22], [20, 22], [20, 40], [10, 40]]);
    for kind in ["oriented_rectangle", "rotation", "quadrilateral", "rectangle"] {
        let shapes = json!([shape("floor", "polygon", below(20)), shape("box", kind, corners.clone())]);
        place.write("a.json", labelme("a.png", shapes));
        let (said, table) = imported(&place, &["labelme", "a.json"]);
        assert_eq!(table, "image,x,y\na.png,3,19\na.png,15,39\n", "{kind}");
        assert!(!said.contains("skipped"), "{said}");
    }
    // What is not known does not count, unless it was asked for.
    let shapes = json!([
        shape("floor", "polygon", below(20)),
        shape("box", "cuboid", corners.clone()),
        shape("box", "cuboid", corners.clone()),
        shape("door", "line", json!([[1, 2], [3, 4]]))
    ]);
    place.write("a.json", labelme("a.png", shapes));
    let (said, table) = imported(&place, &["labelme", "a.json"]);
    assert_eq!(table, TABLE);
    assert!(said.contains("skipped   3 objects"), "{said}");
    assert!(said.contains(
        "2 labelled `box`, of the kind `cuboid`, of which no area is known, the first at a.json: shapes[1]"
    ));
    let complaint =
        place.fails(1, &["data", "import", "labelme", "a.json", "--obstacle", "box", "--out", "o"]);
    assert!(
        complaint.contains("a.json: shapes[1]: no area is known of a shape of the kind `cuboid`"),
        "{complaint}"
    );
    assert!(complaint.contains("and 1 fault more"), "{complaint}");
}

#[test]
fn a_faulty_shape_is_dropped_and_the_picture_stays() {
    let place = place(&["a.png"]);
    let floor = || shape("floor", "polygon", below(20));
    for faulty in [
        shape("box", "polygon", json!([[1, 2], [3, 4]])),
        shape("box", "polygon", json!([[1, 2], [3, null], [4, 4]])),
        shape("box", "circle", json!([[1, 2]])),
        shape("floor", "linestrip", json!([[1, 2], [3, 4], [5, 6]])),
        json!({"points": [[1, 2], [3, 4], [5, 6]]}),
    ] {
        place.write("a.json", labelme("a.png", json!([floor(), faulty])));
        let complaint = refused(&place, &["labelme", "a.json"]);
        assert!(
            complaint.contains("a.json: shapes[1]: ") && complaint.contains("--skip-faulty"),
            "{complaint}"
        );
        let (said, table) = imported(&place, &["labelme", "a.json", "--skip-faulty"]);
        assert_eq!(table, TABLE);
        assert!(said.contains("faulty    1 object") && said.contains("a.json: shapes[1]: "), "{said}");
    }
    // A picture without any of its ground would be blocked all over.
    place.write(
        "a.json",
        labelme("a.png", json!([shape("floor", "line", below(20)), shape("box", "polygon", below(30))])),
    );
    let said = refused(&place, &["labelme", "a.json", "--skip-faulty"]);
    assert!(said.contains("a.png: what is ground in it is faulty"), "{said}");
    // `NaN` stands where nothing is read, and sizes are whole numbers however they are written.
    let file =
        labelme("a.png", json!([floor()])).replace("null", "NaN").replace("48,\"imageP", "48.0,\"imageP");
    place.write("a.json", file);
    assert_eq!(imported(&place, &["labelme", "a.json"]).1, TABLE);
}

#[test]
fn numbers_and_ids_of_coco_as_tools_write_them() {
    let place = place(&["img/a.png"]);
    let change = |change: &dyn Fn(&mut Value)| {
        let mut file = coco("a.png");
        change(&mut file);
        assert_eq!(coco_imported(&place, &file).1, TABLE, "{file}");
    };
    change(&|f| (f["images"][0]["id"], f["images"][0]["width"]) = (json!(1.0), json!(64.0)));
    change(&|f| f["annotations"][0]["image_id"] = json!(1.0));
    change(&|f| f["annotations"][0]["category_id"] = json!("1"));
    change(&|f| (f["images"][0]["id"], f["annotations"][0]["image_id"]) = (json!("img_a"), json!("img_a")));
    change(&|f| (f["images"][0]["id"], f["annotations"][0]["image_id"]) = (json!(-5), json!(-5.0)));
    change(&|f| f["annotations"][0]["segmentation"] = json!([0, 20, 64, 20, 64, 48, 0, 48]));
    let counts: Vec<f64> = [20.0, 28.0].repeat(64);
    change(&|f| f["annotations"][0]["segmentation"] = json!({"size": [48.0, 64.0], "counts": counts}));
    let file = coco("a.png").to_string();
    for none in ["NaN", "Infinity", "-Infinity"] {
        place.write("c.json", file.replace("\"area\":1", &format!("\"area\":{none}")));
        assert_eq!(imported(&place, &COCO).1, TABLE, "{none}");
    }
    // What is no id is named with its place.
    for (wrong, shown) in [(json!(1.5), "1.5"), (json!(null), "null"), (json!([1]), "[1]")] {
        let mut file = coco("a.png");
        push(&mut file, "annotations", floor(7, 1, 30));
        file["annotations"][1]["image_id"] = wrong;
        place.write("c.json", file.to_string());
        let said = refused(&place, &COCO);
        let place =
            format!("c.json: annotations[1] (id 7): its `image_id` is {shown}, and an id is a whole number");
        assert!(said.contains(&place), "{said}");
    }
}

#[test]
fn coco_finds_moved_pictures_by_the_end_of_their_names() {
    let place = place(&["img/a.png", "img/hall/b.png"]);
    for name in ["/home/me/img/a.png", "C:\\Users\\me\\a.png", "..\\a.png", "./a.png", "train2017/a.png"] {
        assert_eq!(coco_imported(&place, &coco(name)).1, TABLE, "{name}");
    }
    let (_, table) = coco_imported(&place, &coco("D:\\photos\\hall\\b.png"));
    assert_eq!(table, TABLE.replace("a.png", "hall/b.png"));
    place.write("c.json", coco("/home/me/none.png").to_string());
    assert!(refused(&place, &COCO).contains("there is no picture img/none.png"));
    let nowhere = refused(&place, &["coco", "c.json", "--images", "nope"]);
    assert!(nowhere.contains("nope: there is no such folder; check the path\n"), "{nowhere}");
    let folder = refused(&place, &["coco", "img", "--images", "img"]);
    assert!(folder.contains("img: cannot be read: this is a folder; give a file\n"), "{folder}");
    // The same rule for LabelMe.
    let shapes = json!([shape("floor", "polygon", below(20))]);
    place.write("b.json", labelme("\\\\host\\hall\\b.png", shapes));
    let (_, table) = imported(&place, &["labelme", "b.json", "--images", "img"]);
    assert_eq!(table, TABLE.replace("a.png", "hall/b.png"));
    let nowhere = refused(&place, &["labelme", "b.json", "--images", "nope"]);
    assert!(nowhere.contains("nope: there is no such folder; check the path\n"), "{nowhere}");
    let nowhere = refused(&place, &["labelme", "nope"]);
    assert!(nowhere.contains("nope: cannot be read: ") && !nowhere.contains("--skip-faulty"), "{nowhere}");
}

#[test]
fn labelme_follows_paths_that_stay_below_the_folder() {
    let place = place(&["l/a.png", "l/sub/b.png"]);
    let file = |picture: &str| labelme(picture, json!([shape("floor", "polygon", below(20))]));
    for (picture, found) in [
        ("../a.png", "a.png"),
        ("b.png", "sub/b.png"),
        ("..\\photos\\b.png", "sub/b.png"),
        ("../../b.png", "sub/b.png"),
        ("/home/me/b.png", "sub/b.png"),
        ("C:\\me\\b.png", "sub/b.png"),
    ] {
        place.write("l/sub/b.json", file(picture));
        assert_eq!(imported(&place, &["labelme", "l"]).1, TABLE.replace("a.png", found), "{picture}");
    }
    // What is not there does not end the import.
    place.write("l/sub/b.json", file("..\\photos\\f4.jpg"));
    place.write("l/a.json", file("a.png"));
    let (said, table) = imported(&place, &["labelme", "l"]);
    assert_eq!(table, TABLE);
    let reason = "sub/f4.jpg: there is no picture l/sub/f4.jpg; `--images DIR` gives the folder with it";
    assert!(said.contains(reason), "{said}");
    // Another tool's file is named, and left out.
    place.write("l/dataset.json", r#"{"description": "", "objects": []}"#);
    let said = refused(&place, &["labelme", "l"]);
    assert!(said.contains("l/dataset.json: is not a LabelMe file, for it has no `shapes`"), "{said}");
    assert!(said.contains("--skip-faulty"), "{said}");
    assert_eq!(imported(&place, &["labelme", "l", "--skip-faulty"]).1, TABLE);
    // Alone it leaves nothing to be imported.
    let said = refused(&place, &["labelme", "l/dataset.json"]);
    assert!(said.contains("export the annotations as LabelMe") && !said.contains("--skip-faulty"), "{said}");
}

#[test]
fn stray_objects_of_coco_do_not_count() {
    let place = place(&["img/a.png"]);
    let object = |change: Value| {
        let mut object = json!({"id": 2, "image_id": 1, "category_id": 2, "segmentation": [[1, 2, 3, 4]], "bbox": [1, 2, 3, 4]});
        change.as_object().expect("an object").iter().for_each(|(key, value)| object[key] = value.clone());
        object
    };
    for (stray, reason) in [
        (object(json!({"image_id": 99})), "of an image that the file does not have"),
        (object(json!({"category_id": 99})), "of a category that the file does not have"),
        (object(json!({})), "named `box`, without an outline"),
        (object(json!({"segmentation": []})), "named `box`, without an outline"),
        (object(json!({"segmentation": null})), "named `box`, without an outline"),
        (object(json!({"category_id": 1, "segmentation": [], "bbox": [5, 5, 0, 0]})), "without any pixel"),
        // Also of what was asked for.
        (object(json!({"category_id": 1})), "named `floor`, without an outline"),
        (object(json!({"category_id": 1, "segmentation": []})), "named `floor`, without an outline"),
    ] {
        let mut file = coco("a.png");
        push(&mut file, "annotations", stray.clone());
        push(&mut file, "annotations", stray);
        let (said, table) = coco_imported(&place, &file);
        assert_eq!(table, TABLE, "{reason}");
        let line = format!("  2 {reason}, the first at annotations[1] (id 2)\n");
        assert!(said.contains("skipped   2 objects\n") && said.contains(&line), "{said}");
        // As JSON, too, and whether faulty ones are to be left out or not.
        let flags = [&["data", "import"], &COCO[..], &FLAGS, &["--skip-faulty", "--json"]].concat();
        let said: Value = serde_json::from_str(&place.ok(&flags)).expect("JSON");
        assert_eq!(said["skipped_objects"][reason], json!({"objects": 2, "first": "annotations[1] (id 2)"}));
        assert_eq!((&said["images"], &said["left_out"]), (&json!(1), &json!([])), "{said}");
        std::fs::remove_dir_all(place.path("o")).expect("there");
    }
    // A picture whose ground has no outline would be blocked all over.
    let mut file = coco("a.png");
    file["annotations"][0]["segmentation"] = json!([]);
    push(&mut file, "annotations", object(json!({"segmentation": [[1, 2, 3, 4, 5, 9]]})));
    place.write("c.json", file.to_string());
    assert!(refused(&place, &COCO).contains("what is ground in it is faulty"));
}

#[test]
fn coco_files_of_other_kinds_are_named() {
    let place = place(&["img/a.png"]);
    let complaint = |file: &Value| {
        place.write("c.json", file.to_string());
        refused(&place, &COCO)
    };
    let mut file = coco("a.png");
    push(&mut file, "categories", json!({"id": 1.0, "name": "wall"}));
    assert!(complaint(&file).contains("categories[2]: there is a category of the id 1 before"));
    file["categories"][2] = json!({"id": 3});
    assert!(complaint(&file).contains("categories[2]: has no `name`"));
    let mut file = coco("a.png");
    file["annotations"] =
        json!([{"image_id": 1, "file_name": "a.png", "segments_info": [{"id": 3, "category_id": 1}]}]);
    let said = complaint(&file);
    assert!(said.contains("c.json: annotations: this is a panoptic file"), "{said}");
    let said = complaint(&json!([{"image_id": 1, "category_id": 1, "score": 0.5}]));
    assert!(said.contains("COCO's form of results"), "{said}");
    for (bytes, kind) in [
        (
            &b"<?xml version=\"1.0\"?><annotations/>"[..],
            "is XML, as CVAT and Pascal VOC write it; export the annotations as COCO",
        ),
        (b"\xff\xfe{\0}\0", "is UTF-16; save it as UTF-8"),
        (b"", "is empty; export the annotations as COCO"),
    ] {
        place.write("c.json", bytes);
        let said = refused(&place, &COCO);
        assert!(said.contains(&format!("c.json: {kind}\n")), "{said}");
    }
    let mut file = coco("a.png");
    push(&mut file, "images", json!({"id": 2}));
    assert!(complaint(&file).contains("images[1]: has no `file_name`"));
    file["images"][1] = json!({"id": 2, "file_name": "b.png", "width": -3});
    assert!(complaint(&file).contains("images[1]: its `width` is -3, and a size is a number of pixels"));
}

#[test]
fn a_picture_that_is_annotated_twice_is_taken_once_or_not_at_all() {
    let place = place(&["a.png", "b.png", "img/a.png"]);
    let file = |row: u32| labelme("a.png", json!([shape("floor", "polygon", below(row))]));
    place.write("a.json", file(20));
    place.write("a (copy).json", file(30));
    place.write("b.json", file(20).replace("a.png", "b.png"));
    let said = refused(&place, &["labelme", "."]);
    assert!(said.contains("a.json: tells another ground of the picture"), "{said}");
    assert!(said.contains("a (copy).json does; remove the wrong one of the two"), "{said}");
    // Nobody knows which is right.
    let (said, table) = imported(&place, &["labelme", ".", "--skip-faulty"]);
    assert_eq!(table, TABLE.replace("a.png", "b.png"));
    assert!(said.contains("left out  1\n  a.png: "), "{said}");
    place.write("a (copy).json", file(20));
    let (said, table) = imported(&place, &["labelme", "a.json", "a (copy).json"]);
    assert_eq!(table, TABLE);
    assert!(said.contains("a.png: it is in a.json already, with the same ground"), "{said}");
    // A folder and a file in it.
    std::fs::remove_file(place.path("a (copy).json")).expect("there");
    let (said, table) = imported(&place, &["labelme", ".", "a.json", "./b.json"]);
    assert_eq!(table, format!("{TABLE}{}", TABLE.replace("a.png", "b.png").replace("image,x,y\n", "")));
    assert!(!said.contains("left out"), "{said}");

    let mut coco = coco("a.png");
    push(&mut coco, "images", json!({"id": 2, "file_name": "./a.png"}));
    push(&mut coco, "annotations", floor(2, 2, 30));
    place.write("c.json", coco.to_string());
    let said = refused(&place, &COCO);
    assert!(
        said.contains(
            "c.json: images[1]: tells another ground of the picture img/a.png than c.json: images[0] does"
        ),
        "{said}"
    );
    coco["annotations"][1] = floor(2, 2, 20);
    let (said, table) = coco_imported(&place, &coco);
    assert_eq!(table, TABLE);
    assert!(said.contains("left out  1\n"), "{said}");
}

#[test]
fn pictures_inside_two_files_are_told_by_their_content() {
    use base64::Engine;
    let place = place(&["a.png", "b.png"]);
    let embedded = |picture: &str, row: u32| {
        let bytes = std::fs::read(place.path(picture)).expect("there");
        let mut file: Value =
            serde_json::from_str(&labelme("x.png", json!([shape("floor", "polygon", below(row))])))
                .expect("JSON");
        file["imageData"] = base64::engine::general_purpose::STANDARD.encode(bytes).into();
        file.to_string()
    };
    std::fs::create_dir(place.path("j")).expect("writable");
    place.write("j/1.json", embedded("a.png", 20));
    place.write("j/2.json", embedded("b.png", 30));
    let (_, table) = imported(&place, &["labelme", "j"]);
    assert_eq!(table, "image,x,y\nx.png,3,19\nx.png,15,19\nx.png.png,3,29\nx.png.png,15,29\n");
    place.write("j/2.json", embedded("a.png", 30));
    assert!(refused(&place, &["labelme", "j"]).contains("j/2.json: tells another ground of the picture"));
    // No text is no picture.
    place.write("j/2.json", labelme("../b.png", json!([])).replace("null,\"imageH", "\"\",\"imageH"));
    let (said, _) = imported(&place, &["labelme", "j"]);
    assert!(said.contains("b.png: there is no picture j/b.png"), "{said}");
}

#[test]
#[cfg(unix)]
fn a_link_to_a_picture_is_that_picture() {
    let place = place(&["img/a.png", "masks/a.png"]);
    GrayImage::from_fn(64, 48, |_, y| Luma([u8::from(y >= 20)]))
        .save(place.path("masks/a.png"))
        .expect("writable");
    GrayImage::from_fn(64, 48, |_, y| Luma([u8::from(y >= 30)]))
        .save(place.path("masks/b.png"))
        .expect("writable");
    std::os::unix::fs::symlink("a.png", place.path("img/b.png")).expect("writable");
    let import =
        ["data", "import", "masks", "img", "masks", "--ground", "1", "--columns", "3,15", "--out", "o"];
    let said = place.fails(1, &import);
    assert!(
        said.contains("masks/b.png: tells another ground of the picture img/b.png than masks/a.png"),
        "{said}"
    );
}
