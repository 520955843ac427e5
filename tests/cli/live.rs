//! The live view, on a terminal that the test pretends to be.
#![cfg(unix)]

use std::fs::File;
use std::io::Read;
use std::os::fd::{FromRawFd, OwnedFd};
use std::process::Stdio;
use std::ptr::null_mut;

use crate::common::*;

/// Both ends of a new terminal of so many columns: ours, and that of the program.
fn terminal(columns: u16) -> (File, OwnedFd) {
    let (mut ours, mut theirs) = (-1, -1);
    let mut size = libc::winsize { ws_row: 40, ws_col: columns, ws_xpixel: 0, ws_ypixel: 0 };
    // SAFETY: the places for the results and the size outlive the call; a name and settings are not asked for.
    let made = unsafe { libc::openpty(&mut ours, &mut theirs, null_mut(), null_mut(), &raw mut size) };
    assert_eq!(made, 0, "{}", std::io::Error::last_os_error());
    // SAFETY: both were opened just now and belong to nobody else.
    unsafe { (File::from_raw_fd(ours), OwnedFd::from_raw_fd(theirs)) }
}

/// All that a command writes on a terminal of so many columns.
pub(crate) fn seen(place: &Place, arguments: &[&str], columns: u16) -> String {
    seen_with(place, arguments, columns, &[])
}

/// The same with more variables in its environment.
pub(crate) fn seen_with(
    place: &Place,
    arguments: &[&str],
    columns: u16,
    variables: &[(&str, &str)],
) -> String {
    let (mut ours, theirs) = terminal(columns);
    let mut command = place.command(arguments);
    let out = theirs.try_clone().expect("another of the same");
    command.env("TERM", "xterm").env("LC_ALL", "C.UTF-8").env_remove("NO_COLOR");
    command.envs(variables.iter().copied()).stdout(Stdio::from(out)).stderr(Stdio::from(theirs));
    let mut run = command.spawn().expect("started");
    // It holds the other end open.
    drop(command);
    let mut bytes = Vec::new();
    let mut part = [0; 4096];
    // The end is an error here: the other side has gone.
    while let Ok(n @ 1..) = ours.read(&mut part) {
        bytes.extend(&part[..n]);
    }
    let text = String::from_utf8_lossy(&bytes).into_owned();
    assert!(run.wait().expect("it ends").success(), "{text}");
    text
}

#[test]
fn a_recording_shows_how_far_it_is() {
    let place = Place::new();
    for arguments in [
        &["synth", "--world", "fmrb", "--frames", "150", "--out", "x"][..],
        &["data", "synth", "y", "--frames", "200"],
    ] {
        let text = seen(&place, arguments, 100);
        assert!(
            text.contains("rendering") && text.contains(" images ") && text.contains("\u{1b}["),
            "{text:?}"
        );
        let shares = text.split(" %, ").filter_map(|before| before.rsplit(' ').next()?.parse::<u32>().ok());
        assert!(shares.clone().any(|share| (1..100).contains(&share)), "{text:?}");
        assert!(shares.clone().all(|share| share <= 100), "{text:?}");
        assert!(text.trim_end().ends_with("--data x") || text.trim_end().ends_with("--data y"), "{text:?}");
    }
}

#[test]
fn a_terminal_shows_signs_of_life_and_keeps_a_warning() {
    let place = Place::new();
    // A second and more, where lines are drawn every 0.15 s.
    let slow = ["--executor", "tree", "--threads", "1", "--population", "4000", "--trees", "2"];
    let text = seen(&place, &tiny(&[HOPELESS, &slow].concat()), 200);
    for part in
        ["generation ", "behaviours, the largest ", " constant, entropy ", " nodes", "drive_", " column "]
    {
        assert!(text.contains(part), "no {part:?} in {text:?}");
    }
    let named = text.contains("nobody solves ") || text.contains("fewest (");
    assert!(named && text.contains("\u{1b}["), "{text:?}");
    let log = recorded(&place.path("runs/data-seed-1")).log;
    let kinds: std::collections::BTreeSet<_> =
        log.iter().filter_map(|line| line["warning"].as_str()).collect();
    assert!(!kinds.is_empty());
    assert_eq!(text.matches("warning:").count(), kinds.len(), "once for each kind: {text:?}");
    // What follows the live lines begins on a clean line.
    let summary = text.find("individuals evaluated").expect("a summary");
    let before = text[..summary].rfind("behaviours, the largest").expect("live lines");
    assert!(text[before..summary].contains("\u{1b}[2K"), "{:?}", &text[before..summary]);
}
