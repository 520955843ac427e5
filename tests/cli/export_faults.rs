//! `vsonar export`: what it refuses, and that it leaves nothing behind then.

use std::io::Write;
use std::process::Stdio;

use crate::common::Place;

/// The lowest row whose gradient exceeds 300.
const PROGRAM: &str = "(individual (iterate-down 3x3 x-obstacle (if-le gradient 300 read-a (set-a y))))";

fn place() -> Place {
    let place = Place::new();
    place.write("p.gp", PROGRAM);
    place
}

#[test]
fn a_comment_of_an_impossible_size_is_told() {
    let place = place();
    for size in ["1x1", "15x240", "320x65537", "4294967295x4294967295"] {
        let comment = format!("; evolved with seed 1, on images of {size} pixels, of the data set d");
        place.write("q.gp", format!("{comment}\n{PROGRAM}\n"));
        let complaint = place.fails(1, &["export", "q.gp", "--out", "o"]);
        assert!(complaint.contains("q.gp") && complaint.contains(size), "{complaint}");
    }
}

/// What comes through a pipe can be read but once.
#[test]
#[cfg(unix)]
fn a_program_through_a_pipe_is_all_there() {
    let place = place();
    let arguments = ["export", "/dev/stdin", "--name", "p", "--out", "o", "--emit", "c", "--quiet"];
    let mut child =
        place.command(&arguments).stdin(Stdio::piped()).spawn().expect("the command can be started");
    let mut input = child.stdin.take().expect("it is piped");
    input.write_all(format!("; solves 12 of 30 training cases\n{PROGRAM}").as_bytes()).expect("it reads");
    drop(input);
    assert!(child.wait().expect("it ends").success());
    let source = place.read("o/p.c");
    assert!(source.contains("12, 30,") && source.contains("(iterate-down 3x3 x-obstacle"), "{source}");
}

#[test]
fn native_instructions_are_of_this_system_alone() {
    let (place, other) =
        (place(), if cfg!(windows) { "x86_64-unknown-linux-gnu" } else { "x86_64-pc-windows-msvc" });
    let arguments = ["export", "p.gp", "--out", "o", "--emit", "obj", "--target", other, "--cpu", "native"];
    let complaint = place.fails(2, &arguments);
    assert!(complaint.contains("\"native\" is no level of x86_64"), "{complaint}");
}

#[test]
#[cfg(unix)]
fn linkers_that_do_nothing_are_told() {
    let place = place();
    let export = |linker| place.fails(1, &["export", "p.gp", "--out", "o", "--linker", linker]);
    let complaint = export("./p.gp");
    assert!(
        complaint.contains("cannot start the linker ./p.gp") && complaint.contains("--linker"),
        "{complaint}"
    );
    let complaint = export("true");
    assert!(complaint.contains("the linker true fails") && complaint.contains("no library"), "{complaint}");
}

#[test]
fn a_folder_in_the_way_stays() {
    let place = place();
    std::fs::create_dir_all(place.path("o/p.h")).expect("folders can be made");
    let complaint = place.fails(1, &["export", "p.gp", "--out", "o", "--emit", "c,header", "--force"]);
    assert!(complaint.contains("p.h: is a folder") && !complaint.contains("--force"), "{complaint}");
}

/// Two programs whose files all differ.
fn two(place: &Place) -> [&'static str; 2] {
    place.write("q.gp", PROGRAM.replace("300", "200"));
    ["p.gp", "q.gp"]
}

/// What a folder holds, by name.
fn content(place: &Place, folder: &str) -> Vec<(std::ffi::OsString, Vec<u8>)> {
    let entries = std::fs::read_dir(place.path(folder)).expect("a folder");
    let mut files: Vec<_> = entries
        .map(|entry| entry.expect("readable"))
        .map(|entry| (entry.file_name(), std::fs::read(entry.path()).expect("readable")))
        .collect();
    files.sort();
    files
}

/// Exports all at once into one folder; whether each succeeded, and what it said.
fn at_once(place: &Place, programs: &[&str], flags: &[&str]) -> Vec<(bool, String)> {
    let start = |program: &&str| {
        let arguments = ["export", program, "--name", "eye", "--quiet", "--emit", "obj,c,header,ir,static"];
        let mut command = place.command(&[&arguments[..], flags].concat());
        command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().expect("the command can be started")
    };
    let running: Vec<_> = programs.iter().map(start).collect();
    let end = |child: std::process::Child| {
        let output = child.wait_with_output().expect("it ends");
        (output.status.success(), String::from_utf8_lossy(&output.stderr).into_owned())
    };
    running.into_iter().map(end).collect()
}

#[test]
fn of_exports_at_once_one_makes_the_folder() {
    let place = place();
    let programs = two(&place);
    for (program, folder) in programs.iter().zip(["alone-0", "alone-1"]) {
        assert!(at_once(&place, &[program], &["--out", folder])[0].0);
    }
    let alone = [content(&place, "alone-0"), content(&place, "alone-1")];
    assert!(alone[0].iter().zip(&alone[1]).all(|(one, other)| one.0 == other.0 && one.1 != other.1));
    for round in 0..4 {
        let out = format!("o{round}/deep");
        let ends = at_once(&place, &programs.repeat(3), &["--out", &out]);
        assert_eq!(ends.iter().filter(|(success, _)| *success).count(), 1, "{ends:?}");
        for (_, said) in ends.iter().filter(|(success, _)| !success) {
            assert!(said.contains("exists already; `--force` replaces it"), "{said}");
        }
        assert!(alone.contains(&content(&place, &out)), "a mixture");
        let ends = at_once(&place, &programs.repeat(3), &["--out", &out, "--force"]);
        assert!(ends.iter().all(|(success, said)| *success && said.is_empty()), "{ends:?}");
        assert!(alone.contains(&content(&place, &out)), "a mixture");
    }
}

#[test]
fn exports_of_other_names_do_not_disturb_each_other() {
    let place = place();
    let names = ["left", "right", "front", "rear"];
    let start = |name: &&str| {
        let arguments = ["export", "p.gp", "--out", "o", "--emit", "c,header", "--quiet", "--name", name];
        place.command(&arguments).spawn().expect("the command can be started")
    };
    let running: Vec<_> = names.iter().map(start).collect();
    assert!(running.into_iter().all(|mut child| child.wait().expect("it ends").success()));
    assert_eq!(content(&place, "o").len(), 8);
}

#[test]
#[cfg(unix)]
fn a_device_or_a_pipe_in_the_way_stays() {
    let place = place();
    std::fs::create_dir(place.path("o")).expect("folders can be made");
    std::os::unix::fs::symlink("/dev/zero", place.path("o/p.h")).expect("links can be made");
    let arguments = ["export", "p.gp", "--out", "o", "--emit", "c,header"];
    let mut forced = place.command(&[&arguments[..], &["--force"]].concat());
    let complaint = crate::common::one_error(&forced.output().expect("started"), 1);
    assert!(complaint.contains("p.h: is a device or a pipe"), "{complaint}");
    assert!(!place.path("o/p.c").exists());
    // A link that leads nowhere is replaced.
    std::fs::remove_file(place.path("o/p.h")).expect("there");
    std::os::unix::fs::symlink("nowhere", place.path("o/p.h")).expect("links can be made");
    assert!(!place.command(&arguments).output().expect("started").status.success());
    place.ok(&[&arguments[..], &["--force", "--quiet"]].concat());
    assert!(place.read("o/p.h").contains("P_WIDTH"));
}

/// Files of one name in one folder are of one program.
#[test]
fn files_of_two_programs_are_not_mixed() {
    let place = Place::new();
    place.write("a.gp", "(individual (iterate-up 3x3 x-obstacle (set-a gradient)))");
    place.write("b.gp", "(individual (iterate-up 3x3 x-obstacle (set-a raw)))");
    let export = |program: &'static str, emit: &'static str, more: &[&'static str]| {
        let all = ["export", program, "--name", "eye", "--out", "o", "--size", "64x48", "--emit", emit];
        [&all[..], more].concat()
    };
    place.ok(&export("a.gp", "obj,header", &[]));
    // What goes with it may come later, and in any order.
    place.ok(&export("a.gp", "c", &[]));
    place.ok(&export("a.gp", "ir,static", &[]));
    for (emit, named) in [("python", "eye.o"), ("shared,python,obj,static,c", "eye.h")] {
        let complaint = place.fails(1, &export("b.gp", emit, &[]));
        assert!(complaint.contains(named) && complaint.contains("another program"), "{complaint}");
    }
    assert!(!place.path("o/eye.py").exists());
    place.ok(&export("b.gp", "python", &["--force"]));
}
