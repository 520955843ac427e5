//! Tables as other programs write them, and images that a table names in several ways.

use serde_json::Value;

use crate::common::*;

const TABLE: &str = "image,x,y\na.png,3,10\na.png,20,12\nb.png,3,11\nb.png,20,9\n";

/// A place with two images of a data folder `d`.
fn place() -> Place {
    let place = Place::new();
    std::fs::create_dir_all(place.path("d/images")).expect("writable");
    for (i, image) in dataset(2, 1).images().iter().enumerate() {
        image.pixels.save(place.path(&format!("d/images/{}.png", ["a", "b"][i]))).expect("writable");
    }
    place
}

fn check(place: &Place, table: impl AsRef<[u8]>) -> Value {
    place.write("d/labels.csv", table);
    let output = place.command(&["data", "check", "d", "--json"]).output().expect("started");
    serde_json::from_slice(&output.stdout).expect("JSON")
}

#[test]
fn numbers_quotes_and_separators_change_nothing() {
    let place = place();
    let expected = check(&place, TABLE);
    assert_eq!((&expected["rows"], &expected["faults"]), (&4.into(), &serde_json::json!([])), "{expected}");
    for table in [
        TABLE.replace(",3,", ",3.0,").replace(",20,", ",20.0,").replace("10\n", "10.0\n"),
        TABLE.replace(",12", ",1.2e+01").replace(",9", ",\"9.0\""),
        TABLE.replace(',', ";"),
        TABLE.replace(',', "\t"),
        format!("sep=;\r\n{}", TABLE.replace(',', ";")),
        format!("\u{feff}{}", TABLE.replace('\n', "\r\n")),
        TABLE.replace("image,x,y", "\"image\", \"x\" ,\"y\"").replace("a.png", " \"a.png\" "),
        format!("\n{}", TABLE.replace('\n', "\n,,\n")),
        TABLE.replace("a.png,20", "./a.png,20").replace("b.png,20", "images\\b.png,20"),
        TABLE.replace("a.png,20", "images/a.png,20").replace("b.png,20", "images//b.png,20"),
    ] {
        assert_eq!(check(&place, &table), expected, "{table}");
    }
    // All of the names are spelled so.
    let spelled = check(&place, TABLE.replace("a.png", "images/a.png").replace("b.png", "images/b.png"));
    assert_eq!(spelled, expected);
    let said = place.ok(&["data", "check", "d"]);
    assert!(said.contains("content   2 images, 4 cases") && !said.contains("without labels"), "{said}");
}

#[test]
fn tables_that_are_none_say_why() {
    let place = place();
    let fault = |table: &[u8]| {
        let report = check(&place, table);
        let fault = &report["faults"][0];
        (fault["line"].as_u64(), fault["message"].as_str().expect("a text").to_string())
    };
    for (table, line, said) in [
        (&b"image,x,y\na.png,3,10.5\n"[..], 2, "y is `10.5`, not a whole number; round it"),
        (b"image;x;y\na.png;3;1,5\n", 2, "y is `1,5`, not a whole number; round it"),
        (b"image;x;y\na.png;3;3,0\n", 2, "y is `3,0`, not a whole number; write fractions with a point"),
        (b"image,x,y\na.png,3,\n", 2, "y is ``, not a whole number; leave the row out"),
        (b"image,x,y\na.png,3,NaN\n", 2, "y is `NaN`, not a whole number; leave the row out"),
        (b"image,x,y\na.png,3,low\n", 2, "y is `low`, not a whole number; write the pixel's number"),
        (b"image;y\na.png;3\n", 1, "the header is `image;y`, without `x`"),
        (b"image|x|y\na.png|3|1\n", 1, "with commas, semicolons or tabs between them"),
        (b"image,x,y\n\"a.png,3,10\nb.png,3,1\n", 2, "a quote is opened and never closed"),
        (b"image,x,y\n\"a\".png,3,10\n", 2, "after its closing quote"),
        (b"\xff\xfei\0m\0a\0g\0e\0", 1, "UTF-16; save it as UTF-8"),
        (b"image,x,y\n..\\a.png,3,10\n", 2, "`..\\a.png` is not a path below the folder"),
    ] {
        let (at, message) = fault(table);
        assert_eq!(at, Some(line), "{said}: {message}");
        assert!(message.contains(said), "{said}: {message}");
    }
}

#[test]
fn contradictory_labels_of_one_file_name_both_lines() {
    let place = place();
    for (spelling, extra) in
        [("images/a.png", ""), ("./a.png", ""), (".\\images\\a.png", ""), ("images//a.png", ",note")]
    {
        let rows =
            format!("image,x,y{extra}\na.png,3,20{extra}\nb.png,3,11{extra}\n{spelling},3,10{extra}\n");
        place.write("d/labels.csv", rows);
        let output = place.command(&["data", "check", "d"]).output().expect("started");
        let said = String::from_utf8(output.stdout).expect("UTF-8");
        assert_eq!(output.status.code(), Some(1), "{said}");
        let fault = "labels.csv line 4: the image `";
        assert!(said.contains(fault) && said.contains("already (labels.csv line 2)"), "{said}");
        assert!(said.contains("the same file as `a.png`") || spelling.ends_with("./a.png"), "{said}");
        for command in [&["evolve", "--data", "d", "--out", "run"][..], &["label", "d"]] {
            let complaint = place.fails(1, command);
            assert!(complaint.contains(fault) && complaint.contains("(labels.csv line 2)"), "{complaint}");
        }
    }
}

#[test]
#[cfg(unix)]
fn a_link_is_the_file_it_leads_to() {
    let place = place();
    std::os::unix::fs::symlink("images/a.png", place.path("d/c.png")).expect("writable");
    let report = check(&place, TABLE.replace("a.png,20", "c.png,20"));
    assert_eq!((&report["images"], &report["unlabelled"]), (&2.into(), &serde_json::json!([])), "{report}");
    let report = check(&place, format!("{TABLE}c.png,3,19\n"));
    assert_eq!(report["faults"][0]["line"], 6, "{report}");
}

#[test]
fn the_same_picture_under_two_names_is_noted() {
    let place = place();
    std::fs::copy(place.path("d/images/a.png"), place.path("d/images/c.png")).expect("writable");
    let report = check(&place, format!("{TABLE}c.png,3,10\n"));
    assert_eq!(report["copies"], serde_json::json!([{"images": ["a.png", "c.png"], "contradiction": null}]));
    let said = place.ok(&["data", "check", "d"]);
    assert!(said.contains("note: a.png and c.png are the same picture\n"), "{said}");
    check(&place, format!("{TABLE}c.png,20,31\n"));
    let said = place.ok(&["data", "check", "d"]);
    assert!(
        said.contains("a.png and c.png are the same picture, and differ in the label of column 20\n"),
        "{said}"
    );
}
