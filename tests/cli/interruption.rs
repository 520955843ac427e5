//! Ctrl-C, and a disk that is full.
#![cfg(unix)]

use std::io::{BufRead, BufReader};
use std::os::unix::fs::OpenOptionsExt;
use std::os::unix::process::CommandExt;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use crate::common::*;

/// Far longer than anything here takes.
const LIMIT: Duration = Duration::from_secs(300);

pub(crate) fn interrupt(run: &Child) {
    signal(run, libc::SIGINT);
}

pub(crate) fn signal(run: &Child, number: libc::c_int) {
    // SAFETY: sends a signal to a child that has not been waited for, so its number is its own.
    let sent = unsafe { libc::kill(run.id() as libc::pid_t, number) };
    assert_eq!(sent, 0);
}

pub(crate) fn wait_until(what: &str, mut holds: impl FnMut() -> bool) {
    let start = Instant::now();
    while !holds() {
        assert!(start.elapsed() < LIMIT, "{what} did not happen");
        std::thread::sleep(Duration::from_millis(2));
    }
}

const SLOW: &[&str] = &["--population", "600", "--threads", "1"];

/// A run that was interrupted comes to the same end as one that was left alone.
fn goes_on(place: &Place) {
    let generations = logged(&place.path("parts")) + 2;
    end_after(&place.path("parts"), generations);
    place.ok(&["evolve", "--resume", "parts", "--quiet"]);
    let generations = ["--generations", &generations.to_string(), "--quiet", "--out", "whole"];
    place.ok(&tiny(&[SLOW, &generations].concat()));
    assert_eq!(recorded(&place.path("whole")), recorded(&place.path("parts")));
}

#[test]
fn ctrl_c_saves_and_says_how_to_go_on() {
    let place = Place::new();
    let endless = [SLOW, ENDLESS, &["--out", "parts", "--executor", "tree"]].concat();
    let mut command = place.command(&tiny(&endless));
    let run = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("started");
    wait_until("a generation", || logged(&place.path("parts")) > 0);
    interrupt(&run);
    let output = run.wait_with_output().expect("it ends");
    let said = String::from_utf8(output.stderr).expect("UTF-8");
    assert_eq!(output.status.code(), Some(130), "{said}");
    assert!(said.contains("vsonar evolve --resume parts"), "{said}");
    assert!(logged(&place.path("parts")) >= 1 && said.contains("of 1000000 generations saved"), "{said}");
    goes_on(&place);
}

#[test]
fn ctrl_c_in_the_first_generation_can_be_resumed() {
    let place = Place::new();
    let endless = [SLOW, ENDLESS, &["--out", "parts", "--executor", "tree", "--json"]].concat();
    let mut command = place.command(&tiny(&endless));
    let run = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("started");
    wait_until("the folder", || place.path("parts").exists());
    // A second Ctrl-C may end it at once; either way the exit code is the same.
    interrupt(&run);
    interrupt(&run);
    let output = run.wait_with_output().expect("it ends");
    assert_eq!(output.status.code(), Some(130), "{}", String::from_utf8_lossy(&output.stderr));
    goes_on(&place);
}

#[test]
fn ctrl_c_among_several_runs_leaves_those_that_are_complete() {
    let place = Place::new();
    let several = [
        "--generations",
        "200",
        "--runs",
        "3",
        "--jobs",
        "1",
        "--executor",
        "tree",
        "--out",
        "several",
        "--json",
    ];
    let mut command = place.command(&tiny(&[SLOW, &several].concat()));
    let run = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("started");
    // The second run begins once the first is complete.
    wait_until("the second run", || place.path("several/seed-2/log.jsonl").exists());
    interrupt(&run);
    let output = run.wait_with_output().expect("it ends");
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(130), "{said}");
    assert!(said.contains("interrupted with"), "{said}");
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let complete = json["runs"].as_array().expect("a list");
    assert_eq!((json["asked"].as_u64(), complete[0]["seed"].as_u64()), (Some(3), Some(1)), "{json}");
    assert!(complete.len() < 3, "{json}");
}

#[test]
fn ctrl_c_ends_a_benchmark() {
    let place = Place::new();
    let flags = ["--data", "data", "--preset", "paper", "--population", "60", "--generations", "0,1"];
    let more = ["--rounds", "10000", "--json", "--out", "report.json", "--plot", "plot.svg"];
    let mut command = place.command(&[&["bench"], &flags[..], &more].concat());
    let run = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("started");
    wait_until("the population", || {
        std::fs::read_dir(place.path("bench-populations")).is_ok_and(|files| files.count() >= 2)
    });
    interrupt(&run);
    let output = run.wait_with_output().expect("it ends");
    let said = String::from_utf8(output.stderr).expect("UTF-8");
    assert_eq!(output.status.code(), Some(130), "{said}");
    assert!(said.contains("interrupted") && output.stdout.is_empty(), "{said}");
    assert!(!place.path("report.json").exists() && !place.path("plot.svg").exists());
    // What was evolved is kept as a whole.
    let arguments = ["bench", "--quiet", "--rounds", "1", "--executors", "reference", "--cases", "1"];
    place.ok(&[&arguments, &flags[..]].concat());
}

#[test]
fn ctrl_c_leaves_no_half_of_the_pictures() {
    let place = Place::new();
    place.write("up.gp", "(individual (iterate-up 3x3 x-obstacle (set-a y)))");
    // Large ones, which take their time.
    let mut command = place.command(&["show", "up.gp", "--scale", "16", "--out", "pictures"]);
    let before = place.everything();
    let run = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("started");
    place.part_of("pictures");
    interrupt(&run);
    let output = run.wait_with_output().expect("it ends");
    let said = String::from_utf8(output.stderr).expect("UTF-8");
    assert_eq!(output.status.code(), Some(130), "{said}");
    assert!(said.contains("interrupted"), "{said}");
    assert!(before == place.everything(), "something is left behind");
}

#[test]
fn ctrl_c_leaves_no_half_of_a_recording() {
    let place = Place::new();
    let before = place.everything();
    let world = ["synth", "--world", "fmrb", "--frames", "600", "--out", "x"];
    let corridor = ["data", "synth", "x", "--frames", "300"];
    for (arguments, writing) in
        [(&world[..], None), (&corridor, None), (&world, Some("fmrb")), (&corridor, Some("corridor"))]
    {
        let mut command = place.command(arguments);
        let mut run = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("started");
        let hidden = place.part_of("x");
        match writing {
            None => interrupt(&run),
            Some(name) => {
                // It cannot write past a pipe that nobody reads.
                let image = |i: u32| hidden.join(format!("images/{name}_{i:04}.png"));
                std::fs::create_dir(hidden.join("images")).expect("while it renders");
                assert!(Command::new("mkfifo").arg(image(3)).status().expect("mkfifo is there").success());
                wait_until("a picture", || image(2).exists());
                interrupt(&run);
                // Opened for both, so that neither side waits for the other.
                let mut pipe = std::fs::OpenOptions::new();
                pipe.read(true).write(true).custom_flags(libc::O_NONBLOCK);
                // It may have ended before it came to it.
                let mut pipe = pipe.open(image(3)).ok();
                wait_until("the end", || {
                    let _ = pipe.as_mut().map(|pipe| std::io::copy(pipe, &mut std::io::sink()));
                    run.try_wait().expect("it can be asked").is_some()
                });
            }
        }
        let output = run.wait_with_output().expect("it ends");
        let said = String::from_utf8(output.stderr).expect("UTF-8");
        assert_eq!(output.status.code(), Some(130), "{arguments:?}, {writing:?}: {said}");
        assert!(said.contains("interrupted; nothing was written") && output.stdout.is_empty(), "{said}");
        assert!(before == place.everything(), "{arguments:?}, {writing:?}: something is left behind");
    }
}

/// Runs a command that can write no file beyond so many bytes, as on a full disk.
fn on_a_full_disk(place: &Place, bytes: u64, arguments: &[&str]) -> std::process::Output {
    let mut command = place.command(arguments);
    let limit = move || {
        let limit = libc::rlimit { rlim_cur: bytes, rlim_max: bytes };
        // SAFETY: plain system calls with valid arguments, allowed between fork and exec. The signal would end the process
        // if the command did nothing about it, as it does when a shell has set the limit.
        let set = unsafe {
            libc::signal(libc::SIGXFSZ, libc::SIG_DFL);
            libc::setrlimit(libc::RLIMIT_FSIZE, &limit)
        };
        if set == 0 { Ok(()) } else { Err(std::io::Error::last_os_error()) }
    };
    // SAFETY: the closure only makes system calls; it neither allocates nor locks.
    unsafe { command.pre_exec(limit) };
    command.output().expect("started")
}

#[test]
fn a_full_disk_stops_a_run_as_of_its_last_generation() {
    let place = Place::new();
    let arguments = |out| tiny(&["--population", "200", "--quiet", "--out", out]);
    place.ok(&arguments("whole"));
    let size = |name: &str| std::fs::metadata(place.path("whole").join(name)).expect("there").len();
    // Room for the settings but not for a checkpoint.
    assert!(size("settings.toml") + 500 < size("checkpoint"));
    let complaint = one_error(&on_a_full_disk(&place, size("settings.toml") + 200, &arguments("parts")), 1);
    assert!(complaint.contains("make room on the disk"), "{complaint}");
    for entry in std::fs::read_dir(place.path("parts")).expect("there") {
        let name = entry.expect("readable").file_name().to_string_lossy().into_owned();
        assert!(!name.ends_with(".tmp"), "{name} is left behind");
    }
    place.ok(&["evolve", "--resume", "parts", "--quiet"]);
    assert_eq!(recorded(&place.path("whole")), recorded(&place.path("parts")));
}

#[test]
fn a_full_disk_leaves_nothing_half_written() {
    let place = Place::new();
    place.write("up.gp", "(individual (iterate-up 3x3 x-obstacle (set-a y)))");
    let before = place.everything();
    let start = tiny(&["--out", "run"]);
    for arguments in [
        &start[..],
        &["data", "synth", "corridor", "--frames", "1"],
        &["synth", "--world", "fmrb", "--frames", "1", "--out", "corridor"],
        &["eval", "up.gp", "--data", "data", "--answers", "answers.csv"],
    ] {
        let complaint = one_error(&on_a_full_disk(&place, 100, arguments), 1);
        assert!(complaint.contains("make room on the disk") && !complaint.contains(".part"), "{complaint}");
        assert!(before == place.everything(), "{arguments:?} left something behind: {complaint}");
    }
}

#[test]
fn a_full_disk_ends_a_recording() {
    let place = Place::new();
    place.write("up.gp", "(individual (iterate-up 3x3 x-obstacle (set-a y)))");
    let output = on_a_full_disk(
        &place,
        100,
        &["run", "up.gp", "--input", "data", "--record", "kept", "--every", "2f"],
    );
    let complaint = one_error(&output, 1);
    assert!(
        complaint.contains("frame_000000.png") && complaint.contains("make room on the disk"),
        "{complaint}"
    );
    assert_eq!(std::fs::read_dir(place.path("kept")).expect("made").count(), 0, "nothing half written");
}

#[test]
fn a_full_device_is_an_error() {
    if !std::path::Path::new("/dev/full").exists() {
        return;
    }
    let place = Place::new();
    place.write("up.gp", "(individual (iterate-up 3x3 x-obstacle (set-a y)))");
    let complaint = place.fails(1, &["eval", "up.gp", "--data", "data", "--answers", "/dev/full"]);
    assert!(complaint.contains("/dev/full") && complaint.contains("make room"), "{complaint}");
    use std::os::unix::fs::FileTypeExt;
    let kind = std::fs::metadata("/dev/full").expect("still there").file_type();
    assert!(kind.is_char_device(), "the device was replaced");
    let full = std::fs::OpenOptions::new().write(true).open("/dev/full").expect("writable");
    let output = place.command(&["ir", "up.gp"]).stdout(full).output().expect("started");
    assert!(one_error(&output, 1).contains("standard output"));
    for arguments in [&["help"][..], &["--version"], &["evolve", "--help"], &["completions", "bash"]] {
        let full = std::fs::OpenOptions::new().write(true).open("/dev/full").expect("writable");
        let output = place.command(arguments).stdout(full).output().expect("started");
        assert!(one_error(&output, 1).contains("standard output: No space"), "{arguments:?}");
        // Nobody reads.
        let (reader, writer) = std::io::pipe().expect("a pipe");
        drop(reader);
        let output = place.command(arguments).stdout(writer).output().expect("started");
        assert_eq!((output.status.code(), output.stderr), (Some(0), Vec::new()), "{arguments:?}");
    }
}

/// Sees walls everywhere: a run of a minute, most of which is taking pictures.
const SCARED: &str = "(individual (iterate-up 3x3 x-obstacle (set-a 239)))";

#[test]
fn a_drive_that_is_cut_short_says_so() {
    let place = Place::new();
    place.write("p.gp", SCARED);
    let flags = ["drive", "p.gp", "--minutes", "3", "--runs", "1", "--threads", "2", "--against", "sonar"];
    let all = [&flags[..], &["--out", "out", "--video", "--json"]].concat();
    let mut run = place.command(&all).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("started");
    // The sonar needs no pictures, and has ended long before the other.
    let mut said = BufReader::new(run.stderr.take().expect("a pipe"));
    let mut line = String::new();
    said.read_line(&mut line).expect("UTF-8");
    assert!(line.starts_with("sonar, run 1: "), "{line}");
    interrupt(&run);
    let output = run.wait_with_output().expect("it ends");
    assert_eq!(output.status.code(), Some(130));
    let report: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!((&report["asked"], &report["interrupted"]), (&2.into(), &true.into()));
    assert!(place.path("out/drive.json").exists() && !place.path("out/run-1.y4m").exists());
}

#[test]
fn a_drive_outlives_its_disk_and_its_reader() {
    let place = Place::new();
    place.write("p.gp", SCARED);
    let drive = |out: &'static str| {
        let flags = ["drive", "p.gp", "--minutes", "0.05", "--runs", "1", "--quiet", "--out", out];
        flags.to_vec()
    };
    // No room for the video.
    let output = on_a_full_disk(&place, 1 << 20, &[drive("film"), vec!["--video"]].concat());
    let said = String::from_utf8(output.stderr).expect("UTF-8");
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(said.contains("film/run-1.y4m: cannot write") && said.contains("make room"), "{said}");
    assert!(String::from_utf8_lossy(&output.stdout).contains("times real time"));
    assert!(place.path("film/drive.json").exists() && !place.path("film/run-1.y4m").exists());
    // No room for anything.
    let output = on_a_full_disk(&place, 100, &drive("none"));
    let said = String::from_utf8(output.stderr).expect("UTF-8");
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(said.contains("none/drive.json: cannot write"), "{said}");
    assert!(String::from_utf8_lossy(&output.stdout).contains("times real time"));
    assert!(!place.path("none").exists());
    // Nobody reads.
    for more in [vec![], vec!["--json"]] {
        let out = if more.is_empty() { "text" } else { "json" };
        let flags: Vec<&str> = [drive(out), more].concat().into_iter().filter(|f| *f != "--quiet").collect();
        let mut run =
            place.command(&flags).stdout(Stdio::piped()).stderr(Stdio::null()).spawn().expect("started");
        drop(run.stdout.take());
        assert_eq!(run.wait().expect("it ends").code(), Some(0), "{out}");
        assert!(place.path(out).join("drive.json").exists());
    }
}
