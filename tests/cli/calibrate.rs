//! `vsonar calibrate`: points on the floor in, a camera out.

use vsonar::camera::Camera;

use crate::common::*;

const SIZE: (u32, u32) = (320, 240);
const TRUTH: Camera = Camera { height: 0.8, pitch: 51.0, field_of_view: 90.0, distortion: -0.15 };
const LEFTS: [f64; 5] = [0.8, 0.4, 0.0, -0.4, -0.8];

/// A table of yardsticks across the view at these distances, with pixels as one would read them.
fn table(camera: &Camera, aheads: &[f64]) -> String {
    let mut table = "column,row,ahead,left\n".to_string();
    for ahead in aheads {
        for left in LEFTS {
            let (column, row) = camera.project(SIZE, *ahead, left).expect("in front");
            if (0.0..=319.0).contains(&column) {
                table += &format!("{},{},{ahead},{left}\n", column.round(), row.round());
            }
        }
    }
    table
}

fn place() -> Place {
    let place = Place::new();
    place.write("points.csv", table(&TRUTH, &[0.1, 0.3, 0.6, 1.0, 1.5, 2.2]));
    place
}

#[test]
fn a_camera_comes_out() {
    let place = place();
    let text = place.ok(&["calibrate", "points.csv", "--out", "camera.toml"]);
    assert!(plain(&text), "{text}");
    for said in [
        "points in images",
        "320 x 240",
        "fitted",
        "Off by 0.",
        "on the floor",
        "at most (line",
        "camera.toml: written",
    ] {
        assert!(text.contains(said), "no {said}: {text}");
    }
    assert!(!text.contains("Warning"), "{text}");
    let camera = Camera::load(&place.path("camera.toml")).expect("sound");
    assert!(
        (camera.height - TRUTH.height).abs() < 0.01 && (camera.pitch - TRUTH.pitch).abs() < 0.5,
        "{camera:?}"
    );
    assert!(
        (camera.field_of_view - 90.0).abs() < 1.0 && (camera.distortion + 0.15).abs() < 0.03,
        "{camera:?}"
    );
    let written = place.read("camera.toml");
    assert!(written.contains("# Off by 0.") && written.contains("320 x 240"), "{written}");
    // Again: the same, byte for byte.
    place.ok(&["calibrate", "points.csv", "--out", "again.toml", "--quiet"]);
    assert_eq!(place.read("again.toml"), written);
}

#[test]
fn the_example_gives_the_camera_it_was_made_with() {
    let place = Place::new();
    let example = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/points.csv");
    let text = place.ok(&["calibrate", example, "--out", "camera.toml"]);
    assert!(text.contains("19 points") && !text.contains("Warning"), "{text}");
    let camera = Camera::load(&place.path("camera.toml")).expect("sound");
    assert!((camera.height - 0.8).abs() < 0.005 && (camera.pitch - 51.0).abs() < 0.2, "{camera:?}");
    assert!(
        (camera.field_of_view - 90.0).abs() < 0.4 && (camera.distortion + 0.12).abs() < 0.01,
        "{camera:?}"
    );
}

#[test]
fn tables_of_spreadsheets_give_the_same_camera() {
    let place = place();
    let table = format!("# \"by hand\"; twice\n{}", place.read("points.csv"));
    place.write("points.csv", &table);
    let expected = place.ok(&["calibrate", "points.csv", "--json"]);
    let quoted = table.replace("column,row,ahead,left", "\"column\",\"row\",\"ahead\",\"left\"");
    let fields =
        |line: &str| line.split(',').map(|field| format!("\"{field}\"")).collect::<Vec<_>>().join(",");
    let (comment, rows) = table.split_once('\n').expect("two lines");
    let all_quoted = rows.lines().map(fields).collect::<Vec<_>>().join("\r\n");
    for again in [
        quoted,
        format!("{comment}\n{all_quoted}"),
        table.replace(',', ";"),
        table.replace(',', "\t"),
        format!("\u{feff}{}", table.replace('\n', "\r\n")),
    ] {
        assert_ne!(again, table);
        place.write("points.csv", &again);
        assert_eq!(place.ok(&["calibrate", "points.csv", "--json"]), expected, "{again}");
    }
    place.write("points.csv", table.replace(',', ";").replace("0.8\n", "0,8\n"));
    let said = place.fails(1, &["calibrate", "points.csv"]);
    assert!(said.contains("points.csv:") && said.contains("write fractions with a point"), "{said}");
}

#[test]
fn what_is_known_is_held() {
    let place = place();
    place.write("row.csv", table(&Camera { distortion: 0.0, ..TRUTH }, &[0.5]));
    let text =
        place.ok(&["calibrate", "row.csv", "--height", "0.8", "--pitch", "51", "--out", "camera.toml"]);
    assert!(text.contains("given") && text.contains("too few points to fit it"), "{text}");
    let camera = Camera::load(&place.path("camera.toml")).expect("sound");
    assert_eq!((camera.height, camera.pitch, camera.distortion), (0.8, 51.0, 0.0));
    assert!((camera.field_of_view - 90.0).abs() < 1.0, "{camera:?}");
    // A negative number is one, not a flag.
    let all = ["--height", "0.8", "--pitch", "51", "--fov", "90", "--distortion", "-0.15"];
    let text = place.ok(&[&["calibrate", "points.csv"], &all[..]].concat());
    assert!(
        text.contains("-0.15") && !text.contains("fitted") && text.contains("--out camera.toml"),
        "{text}"
    );
}

#[test]
fn the_result_as_json() {
    let place = place();
    let text = place.ok(&["calibrate", "points.csv", "--json", "--out", "camera.toml"]);
    let value: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    let camera = Camera::load(&place.path("camera.toml")).expect("sound");
    assert_eq!(value["camera"]["field_of_view"].as_f64(), Some(camera.field_of_view));
    assert_eq!(value["numbers"][0]["name"], "height");
    assert_eq!(value["numbers"][0]["source"], "fitted");
    assert!(value["numbers"][0]["standard_error"].as_f64().expect("a number") < 0.05);
    let residuals = value["residuals"].as_array().expect("a list");
    assert_eq!(residuals.len(), place.read("points.csv").lines().count() - 1);
    assert_eq!(residuals[0]["line"], 2);
    assert!(value["rms_pixels"].as_f64().expect("a number") < 0.6 && value["rms_metres"].is_number());
    assert_eq!(value["warnings"], serde_json::json!([]));
}

#[test]
fn warnings() {
    let place = place();
    let sound = place.read("points.csv");
    let tenth = sound.lines().nth(9).expect("there");
    let (column, rest) = tenth.split_once(',').expect("a row");
    let wrong = format!("{},{rest}", column.parse::<f64>().expect("a number") + 15.0);
    place.write("points.csv", sound.replace(tenth, &wrong));
    let text = place.ok(&["calibrate", "points.csv"]);
    assert!(text.contains("Warning: line 10 does not go with the other points"), "{text}");
    let output = place.command(&["calibrate", "points.csv", "--quiet"]).output().expect("started");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && output.stdout.is_empty(), "{output:?}");
    assert!(said.starts_with("warning: points.csv: line 10 "), "{said}");
    // As many measurements as unknowns.
    place.write("three.csv", "column,row,ahead\n160,200,0.2\n160,125,0.6\n160,64,1.2\n");
    assert!(place.ok(&["calibrate", "three.csv"]).contains("a wrong one cannot show"));
}

#[test]
fn a_distortion_at_its_limit_is_written_so_that_it_can_be_read() {
    let place = Place::new();
    let (size, bent) = ((640, 480), Camera { distortion: -0.62, ..TRUTH });
    let mut table = "column,row,ahead,left\n".to_string();
    for ahead in [0.1, 0.3, 0.6, 1.0, 1.5, 2.2] {
        for (left, (column, row)) in
            LEFTS.iter().filter_map(|&left| Some((left, bent.project(size, ahead, left)?)))
        {
            if (0.0..=639.0).contains(&column) && (0.0..=479.0).contains(&row) {
                table += &format!("{column:.3},{row:.3},{ahead},{left}\n");
            }
        }
    }
    place.write("points.csv", table);
    let text = place.ok(&["calibrate", "points.csv", "--size", "640x480", "--out", "camera.toml"]);
    assert!(text.contains("Warning: `distortion` came out at the limit"), "{text}");
    let distortion = text.lines().find(|line| line.contains("distortion")).unwrap_or_default();
    assert!(distortion.contains("-0.5743") && !distortion.contains('±'), "{text}");
    let camera = Camera::load(&place.path("camera.toml")).expect("sound");
    camera.check(640, 480).expect("possible");
}

#[test]
fn a_camera_is_not_overwritten_unasked() {
    let place = place();
    place.write("camera.toml", "mine");
    let complaint = place.fails(1, &["calibrate", "points.csv", "--out", "camera.toml"]);
    assert!(
        complaint.contains("camera.toml: exists already") && complaint.contains("--force"),
        "{complaint}"
    );
    place.ok(&["calibrate", "points.csv", "--out", "camera.toml", "--force"]);
    assert!(Camera::load(&place.path("camera.toml")).is_ok());
    let complaint = place.fails(2, &["calibrate", "points.csv", "--out", "./points.csv", "--force"]);
    assert!(complaint.contains("the table itself"), "{complaint}");
    assert!(
        place.fails(1, &["calibrate", "points.csv", "--out", "no/camera.toml"]).contains("no/camera.toml")
    );
}

#[test]
fn flags_that_are_wrong() {
    let place = place();
    for (flags, said) in [
        (&["--height", "tall"] as &[&str], "--height"),
        (&["--height", "0"], "0.001 to 1000 metres"),
        (&["--height", "-1"], "0.001 to 1000 metres"),
        (&["--height", "nan"], "--height"),
        (&["--pitch", "91"], "-90 to 90 degrees"),
        (&["--pitch", "-60", "--fov", "90"], "a pitch below the horizontal is positive"),
        (&["--fov", "180"], "1 to 179 degrees"),
        (&["--distortion", "0.6"], "images of 320 x 240 pixels"),
        (&["--size", "320"], "as in 320x240"),
        (&["--force"], "--out"),
        (&["--json", "--quiet"], "--quiet"),
        (&["another.csv"], "another.csv"),
    ] {
        let complaint = place.fails(2, &[&["calibrate", "points.csv"], flags].concat());
        assert!(complaint.contains(said) && complaint.contains("--help"), "{flags:?}: {complaint}");
    }
    assert!(place.fails(2, &["calibrate", "--out", "camera.toml"]).contains("TABLE"));
}

#[test]
fn tables_that_cannot_be_used() {
    let place = place();
    for (table, said) in [
        ("", "t.csv:1: the table is empty"),
        ("column,row,ahead,left\n", "t.csv:1: "),
        ("x,y,ahead,left\n1,2,3,4\n", "t.csv:1: `x`"),
        ("column,row,ahead,left\n1,2,3,4\n\n1;2;3;4\n", "t.csv:4: "),
        ("column,row,ahead,left\n1,2,much,4\n", "t.csv:2: `ahead` is `much`"),
        ("column,row,ahead,left\n1,2,3,4\n", "t.csv: 2 measurements cannot give 3 numbers"),
        ("column,row,ahead,left\n1,2,3,4\n1,2,3,4\n1,2,3,4\n", "t.csv: the points leave `"),
        (
            "column,row,ahead,left\n1,200,0.3,0\n1,240,3,4\n",
            "t.csv:3: column 1, row 240 is outside the image",
        ),
        ("column,row,ahead,left\n20,20,0.3,0\n300,20,0.3,-5\n160,239,8,0\n10,239,8,9\n", "t.csv:"),
    ] {
        place.write("t.csv", table);
        let complaint = place.fails(1, &["calibrate", "t.csv", "--out", "camera.toml"]);
        assert!(complaint.contains(said), "{table}: {complaint}");
    }
    place.write("t.csv", "column,row,ahead,left\n80,200,0.3,0.2\n160,130,1,0\n160,20,3,0\n");
    let level = ["calibrate", "t.csv", "--height", "0.8", "--pitch", "0", "--fov", "90"];
    assert!(place.fails(1, &level).starts_with("error: t.csv:"));
    // Nobody typed the pitch that comes out.
    place.write("t.csv", "column,row,ahead\n160,239.4,10000\n");
    let up = ["calibrate", "t.csv", "--height", "0.8", "--fov", "90", "--distortion", "0"];
    let complaint = place.fails(1, &up);
    assert!(complaint.starts_with("error: t.csv: ") && complaint.contains("check the points"), "{complaint}");
    // What is behind the limit counts, too.
    let cut = format!("{}#{}\ngarbage\n", place.read("points.csv"), "x".repeat(16 << 20));
    place.write("t.csv", cut);
    let complaint = place.fails(1, &["calibrate", "t.csv"]);
    assert!(complaint.contains("t.csv: cannot read the table: it is larger than 16 MiB"), "{complaint}");
    place.write("t.csv", b"column,row\xff");
    assert!(place.fails(1, &["calibrate", "t.csv"]).contains("t.csv: cannot read the table"));
    assert!(place.fails(1, &["calibrate", "none.csv"]).contains("none.csv: cannot read the table"));
}
