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
