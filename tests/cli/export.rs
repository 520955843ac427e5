//! `vsonar export`: what it writes, and what it refuses.

use std::process::Command;

use crate::common::{Place, tiny};

/// Answers the lowest row at which the gradient is more than 50.
const PROGRAM: &str = "; solves 12 of 24 training cases; 9 nodes; from generation 3
; evolved with seed 7, on images of 64x48 pixels, of the data set corridor
(individual (iterate-up 3x3 x-obstacle (if-le gradient 50 read-a (prog2 (set-a y) break))))
";
const CAMERA: &str = "height = 0.6\npitch = 51\nfield_of_view = 90\n";

fn place() -> Place {
    let place = Place::new();
    place.write("eye.gp", PROGRAM);
    place.write("camera.toml", CAMERA);
    place
}

fn files(place: &Place, folder: &str) -> Vec<String> {
    let entries = std::fs::read_dir(place.path(folder)).expect("a folder");
    let mut names: Vec<String> =
        entries.map(|e| e.expect("readable").file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

#[test]
fn writes_what_is_asked_for() {
    let place = place();
    let said = place.ok(&["export", "eye.gp", "--out", "a/b", "--emit", "c,header,obj,static,ir"]);
    assert_eq!(files(&place, "a/b"), ["eye.c", "eye.h", "eye.o", "eye.vir", "libeye.a"]);
    assert!(said.contains("images of 64x48 pixels, rows;") && said.contains("a/b/libeye.a"), "{said}");
    let header = place.read("a/b/eye.h");
    for text in ["EYE_WIDTH 64", "EYE_HEIGHT 48", "EYE_HAS_RANGES 0", "corridor"] {
        assert!(header.contains(text), "{text}: {header}");
    }
    // what it writes as IR is a program again, of the same size
    place.ok(&["export", "a/b/eye.vir", "--out", "again", "--emit", "ir", "--quiet"]);
    assert_eq!(place.read("again/eye.vir"), place.read("a/b/eye.vir"));

    let arguments = ["export", "eye.gp", "--out", "c", "--name", "front", "--emit", "c,header,obj", "--json"];
    let said = place.ok(&[&arguments[..], &["--camera", "camera.toml", "--median", "3"]].concat());
    let said: serde_json::Value = serde_json::from_str(&said).expect("JSON");
    assert_eq!((&said["name"], &said["median"], &said["ranges"]), (&"front".into(), &3.into(), &true.into()));
    assert!(said["stack_bytes"].as_u64().is_some_and(|bytes| bytes > 100));
    let listed: Vec<_> =
        said["files"].as_array().expect("a list").iter().map(|f| f["name"].clone()).collect();
    assert_eq!(listed, ["front.o", "front.c", "front.h"]);
    assert!(place.read("c/front.h").contains("front_ranges"));
}

#[test]
fn another_machine_gets_no_shared_library_unless_asked() {
    let place = place();
    let target =
        if cfg!(target_arch = "s390x") { "aarch64-unknown-linux-gnu" } else { "s390x-unknown-linux-gnu" };
    place.ok(&["export", "eye.gp", "--out", "x", "--target", target]);
    assert_eq!(files(&place, "x"), ["eye.c", "eye.h", "eye.o", "eye.vir", "libeye.a"]);
    place.ok(&["export", "eye.gp", "--out", "w", "--target", "x86_64-pc-windows-msvc"]);
    assert_eq!(files(&place, "w"), ["eye.c", "eye.h", "eye.obj", "eye.vir", "eye_static.lib"]);
}

#[test]
fn everything_is_written_where_there_is_a_linker() {
    if !Command::new("ld").arg("--version").output().is_ok_and(|out| out.status.success()) {
        assert!(std::env::var_os("VSONAR_REQUIRE_TOOLS").is_none(), "there is no ld");
        eprintln!("skipped: there is no ld");
        return;
    }
    let place = place();
    place.ok(&["export", "eye.gp", "--out", "x"]);
    let library = if cfg!(target_os = "macos") { "libeye.dylib" } else { "libeye.so" };
    assert_eq!(files(&place, "x"), ["eye.c", "eye.h", "eye.o", "eye.py", "eye.vir", "libeye.a", library]);
}

#[test]
fn files_that_are_there_are_kept_unless_forced() {
    let place = place();
    let arguments = ["export", "eye.gp", "--out", "x", "--emit", "c,header", "--quiet"];
    place.write("eye.vir", "mine");
    assert_eq!(place.ok(&arguments), "");
    std::fs::write(place.path("x/eye.h"), "mine").expect("writable");
    std::fs::remove_file(place.path("x/eye.c")).expect("there");
    let complaint = place.fails(1, &arguments);
    assert!(complaint.contains("x/eye.h") && complaint.contains("--force"), "{complaint}");
    place.ok(&[&arguments[..], &["--force"]].concat());
    assert!(place.read("x/eye.h").contains("EYE_WIDTH"));
    assert_eq!(files(&place, "x"), ["eye.c", "eye.h"]);
}

#[test]
fn bad_input_is_told_and_leaves_nothing() {
    let place = place();
    place.write("broken.gp", "(individual (iterate-up 3x3");
    place.write("2.gp", PROGRAM);
    place.write("bad.toml", "height = -1\npitch = 51\nfield_of_view = 90\n");
    place.write("file", "");
    let fails = |arguments: &[&str], code: i32, texts: &[&str]| {
        let complaint = place.fails(code, &[&["export"], arguments].concat());
        assert!(texts.iter().all(|text| complaint.contains(text)), "{texts:?}: {complaint}");
    };
    let known = ["aarch64-unknown-linux-gnu", "riscv64gc-unknown-linux-gnu", "x86_64-pc-windows-msvc"];
    fails(&["eye.gp", "--out", "x", "--target", "vax"], 2, &known);
    fails(&["eye.gp", "--out", "x", "--target", "x86_64-unknown-linux-gnu", "--cpu", "v7"], 2, &["v1", "v3"]);
    fails(&["eye.gp", "--out", "x", "--name", "3d"], 2, &["--name", "C identifier"]);
    fails(&["eye.gp", "--out", "x", "--name", "int"], 2, &["keyword"]);
    for (name, owner) in [
        ("json", "a module of Python"),
        ("ctypes", "a module of Python"),
        ("numpy", "a module of Python"),
        ("stdio", "a header of the C library"),
        ("c", "a library that linkers look for"),
        ("libm", "a library that linkers look for"),
        ("co_yield", "a keyword"),
        ("size", "a macro of C"),
    ] {
        fails(&["eye.gp", "--out", "x", "--name", name], 2, &["--name", name, owner, "`front_camera`"]);
    }
    place.write("math.gp", PROGRAM);
    fails(&["math.gp", "--out", "x"], 2, &["--name is needed", "a module of Python"]);
    fails(&["2.gp", "--out", "x"], 2, &["--name is needed"]);
    fails(&["eye.gp", "--out", "x", "--size", "320x240"], 2, &["64x48", "eye.gp"]);
    fails(&["eye.gp", "--out", "x", "--emit", "c,java"], 2, &["java"]);
    fails(&["eye.gp", "--out", "x", "--median", "3"], 2, &["--camera"]);
    fails(&["eye.gp", "--out", "x", "--camera", "camera.toml", "--median", "2"], 2, &["1 or 3"]);
    fails(&["eye.gp", "--out", "x", "--camera", "bad.toml"], 1, &["bad.toml:1", "height"]);
    fails(&["eye.gp", "--out", "x", "--camera", "no.toml"], 1, &["no.toml"]);
    fails(&["no.gp", "--out", "x"], 1, &["no.gp"]);
    fails(&["broken.gp", "--out", "x"], 1, &["broken.gp: line 1"]);
    fails(&["eye.gp", "--out", "file", "--emit", "c"], 1, &["file", "--out"]);
    fails(&["eye.gp", "--out", "file/x", "--emit", "c"], 1, &["file"]);
    fails(
        &["eye.gp", "--out", "x", "--emit", "c,shared", "--linker", "no-such-linker"],
        1,
        &["no-such-linker"],
    );
    fails(
        &["eye.gp", "--out", "x/y", "--emit", "c,shared", "--linker", "false"],
        1,
        &["the linker false fails"],
    );
    fails(&["eye.gp"], 2, &["--out"]);
}

#[test]
fn a_run_s_best_program_knows_where_it_comes_from() {
    let place = Place::new();
    place.ok(&tiny(&["--seed", "3", "--quiet", "--out", "run"]));
    place.ok(&["export", "run/best.gp", "--out", "x", "--emit", "header", "--name", "eye"]);
    let header = place.read("x/eye.h");
    for text in ["EYE_WIDTH 64", "EYE_SEED UINT64_C(3)", "EYE_CASES 24", "\"data\""] {
        assert!(header.contains(text), "{text}: {header}");
    }
}

/// C compilers take long over long functions, least at the lower level.
#[test]
fn a_long_program_as_c_is_to_be_compiled_with_less_effort() {
    let place = Place::new();
    let mut terms: Vec<String> = (0..2500).map(|i| format!("(* gradient {i}.5)")).collect();
    while terms.len() > 1 {
        terms = terms
            .chunks(2)
            .map(
                |pair| if pair.len() == 2 { format!("(+ {} {})", pair[0], pair[1]) } else { pair[0].clone() },
            )
            .collect();
    }
    for (name, body, level) in [("brief", "gradient".to_string(), "-O2"), ("lengthy", terms.remove(0), "-O1")]
    {
        place.write(
            &format!("{name}.gp"),
            format!("(individual (iterate-up 3x3 x-obstacle (set-a (+ read-b {body}))))"),
        );
        let out = place.ok(&[
            "export",
            &format!("{name}.gp"),
            "--emit",
            "c,header",
            "--out",
            name,
            "--size",
            "64x48",
        ]);
        assert!(out.contains(&format!("cc {level} robot.c")), "{name}: {out}");
    }
}
