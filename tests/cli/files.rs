//! Files that are no files, far too large, or left behind by a command that was killed.
#![cfg(unix)]

use std::io::Write;
use std::os::unix::fs::{OpenOptionsExt, PermissionsExt, symlink};
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use crate::common::*;
use crate::interruption::signal;

/// Longer than anything here takes.
const LIMIT: Duration = Duration::from_secs(120);

/// What a command says that has to end by itself; one that waits for ever fails the test.
fn ends(run: Child) -> Output {
    let mut run = run;
    let start = Instant::now();
    while run.try_wait().expect("it can be asked").is_none() {
        if start.elapsed() > LIMIT {
            run.kill().expect("it can be killed");
            panic!("it waits");
        }
        std::thread::sleep(Duration::from_millis(2));
    }
    run.wait_with_output().expect("it has ended")
}

fn start(place: &Place, arguments: &[&str]) -> Child {
    let mut command = place.command(arguments);
    command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("started")
}

/// The one complaint of a command that neither waits nor fills the memory.
fn refused(place: &Place, arguments: &[&str]) -> String {
    one_error(&ends(start(place, arguments)), 1)
}

fn pipe(path: &Path) {
    let _ = std::fs::remove_file(path);
    assert!(Command::new("mkfifo").arg(path).status().expect("mkfifo is there").success());
}

fn endless(path: &Path) {
    let _ = std::fs::remove_file(path);
    symlink("/dev/zero", path).expect("a link");
}

/// A file that takes no room on the disk and would take all there is in memory.
fn huge(path: &Path) {
    let _ = std::fs::remove_file(path);
    std::fs::File::create_new(path).and_then(|file| file.set_len(1 << 42)).expect("a sparse file");
}

/// Puts something at a path.
type Make = fn(&Path);

/// In the way of a file that is read, and what is said of it.
const ODD: [(Make, &str); 3] =
    [(pipe, "this is a pipe"), (endless, "this is a device"), (huge, "it is larger than ")];

#[test]
fn files_of_a_run_are_files() {
    let place = Place::new();
    place.ok(&tiny(&["--quiet", "--out", "run"]));
    let run = place.path("run");
    for (name, arguments) in [
        ("checkpoint", &["evolve", "--resume", "run", "--generations", "5", "--quiet"][..]),
        ("settings.toml", &["evolve", "--resume", "run", "--quiet"]),
        ("settings.toml", &["report", "run", "--out", "page.html"]),
        ("log.jsonl", &["report", "run", "--out", "page.html"]),
        ("hall_of_fame.jsonl", &["report", "run", "--out", "page.html"]),
        ("best.gp", &["explain", "run"]),
        ("best.gp", &["report", "run", "--out", "page.html"]),
        ("best.gp", &["export", "run", "--name", "eye", "--out", "o"]),
    ] {
        let kept = place.path("kept");
        std::fs::rename(run.join(name), &kept).expect("there");
        for (make, said) in ODD {
            make(&run.join(name));
            let complaint = refused(&place, arguments);
            assert!(complaint.contains(name) && complaint.contains(said), "{arguments:?}: {complaint}");
        }
        std::fs::rename(&kept, run.join(name)).expect("writable");
    }
    // What can be made again is, whatever stands in its place.
    for (name, (make, _)) in ["log.jsonl", "best.gp", "hall_of_fame.jsonl"].into_iter().zip(ODD) {
        let before = place.read(&format!("run/{name}"));
        make(&run.join(name));
        let output = ends(start(&place, &["evolve", "--resume", "run", "--quiet"]));
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        assert_eq!(place.read(&format!("run/{name}")), before);
    }
}

#[test]
fn locks_and_tables_are_files() {
    let place = Place::new();
    place.ok(&tiny(&["--quiet", "--out", "run"]));
    for (make, said) in &ODD[..2] {
        let said = said.replace("a device", "a link");
        make(&place.path("run/lock"));
        let complaint = refused(&place, &["evolve", "--resume", "run", "--generations", "5", "--quiet"]);
        assert!(complaint.contains("lock") && complaint.contains(&said), "{complaint}");
    }
    for (make, said) in ODD {
        make(&place.path("data/labels.csv"));
        let complaint = refused(&place, &["eval", "run", "--data", "data"]);
        assert!(complaint.contains(said) && !complaint.contains("missing"), "{complaint}");
    }
}

#[test]
fn files_that_commands_find_are_files() {
    let place = Place::new();
    let spec = "data = { tiny = { dir = \"data\" } }\nseeds = 1\n";
    place.write("sweep.toml", spec);
    std::fs::create_dir(place.path("results")).expect("writable");
    std::fs::create_dir(place.path("bare")).expect("writable");
    std::fs::copy(place.path("data/images/drive_a_0.png"), place.path("bare/a.png")).expect("writable");
    place.write("bare/labels.csv", "image,x,y\na.png,3,5\n");
    let coco =
        ["data", "import", "coco", "c.json", "--images", "data/images", "--ground", "floor", "--out", "o"];
    for (name, arguments) in [
        ("c.json", &coco[..]),
        (
            "l.json",
            &["data", "import", "labelme", "l.json", "--ground", "floor", "--columns", "3", "--out", "o"],
        ),
        ("bare/labels.csv", &["label", "bare"]),
        ("bare/labels.skip.csv", &["label", "bare"]),
    ] {
        for (make, said) in ODD {
            make(&place.path(name));
            let complaint = refused(&place, arguments);
            let leaf = name.rsplit('/').next().expect("a name");
            // A link out of the folder is none that is followed there.
            let said = if name.starts_with("bare") && said.contains("device") {
                "a link that leads out"
            } else {
                said
            };
            assert!(complaint.contains(leaf) && complaint.contains(said), "{arguments:?}: {complaint}");
        }
        std::fs::remove_file(place.path(name)).expect("there");
    }
}

#[test]
fn what_is_typed_may_come_through_a_pipe_and_has_an_end() {
    let place = Place::new();
    let program = "(individual (iterate-up 3x3 x-obstacle (set-a y)))";
    place.write("up.gp", program);
    let through = |text: &str, arguments: &[&str]| {
        let mut command = place.command(arguments);
        let mut run = command
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("started");
        run.stdin.take().expect("piped").write_all(text.as_bytes()).expect("read");
        let output = ends(run);
        assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
        output.stdout
    };
    let eval = |program| ["eval", program, "--data", "data", "--json"];
    let without_name = |bytes: &[u8]| String::from_utf8_lossy(bytes).replace("/dev/stdin", "up.gp");
    assert_eq!(without_name(&through(program, &eval("/dev/stdin"))), place.ok(&eval("up.gp")));
    through("generations = 2\n", &tiny(&["--settings", "/dev/stdin", "--quiet", "--out", "piped"]));
    assert_eq!(logged(&place.path("piped")), 4, "the flag counts more");
    for (said, arguments) in [
        ("64 MiB", &eval("/dev/zero")[..]),
        ("16 MiB", &tiny(&["--settings", "/dev/zero", "--out", "o"])),
        ("16 MiB", &["sweep", "/dev/zero"]),
        ("16 MiB", &["calibrate", "/dev/zero", "--size", "320x240"]),
        ("1 MiB", &["synth", "--plan", "/dev/zero", "--out", "o"]),
        ("1 MiB", &["run", "up.gp", "--input", "data", "--output", "ranges", "--camera", "/dev/zero"]),
    ] {
        let complaint = refused(&place, arguments);
        assert!(complaint.contains("/dev/zero") && complaint.contains(said), "{arguments:?}: {complaint}");
    }
    // Whoever waits for a pipe can be stopped.
    pipe(&place.path("pipe"));
    for arguments in [
        &tiny(&["--settings", "pipe", "--out", "o"])[..],
        &["eval", "pipe", "--data", "data"],
        &["sweep", "pipe"],
        &["export", "pipe", "--name", "a", "--size", "64x48", "--out", "o"],
    ] {
        let run = start(&place, arguments);
        // It can be written to as soon as it is read; what is written is not all, so it goes on waiting.
        let begin = Instant::now();
        let writer = loop {
            let mut options = std::fs::OpenOptions::new();
            match options.write(true).custom_flags(libc::O_NONBLOCK).open(place.path("pipe")) {
                Ok(mut writer) => {
                    writer.write_all(b"(").expect("read");
                    break writer;
                }
                Err(_) => assert!(begin.elapsed() < LIMIT, "{arguments:?}: it does not read"),
            }
        };
        // Jobs in the background of a shell have Ctrl-C ignored until they watch for it themselves.
        signal(&run, libc::SIGTERM);
        let output = ends(run);
        assert!(!output.status.success() && output.stdout.is_empty(), "{arguments:?}");
        drop(writer);
    }
}

/// The hidden names below a folder.
fn hidden(folder: &Path) -> Vec<String> {
    let mut names = Vec::new();
    for entry in std::fs::read_dir(folder).expect("readable").flatten() {
        let name = entry.file_name().to_string_lossy().into_owned();
        if name.starts_with('.') {
            names.push(name.clone());
        }
        if entry.path().is_dir() {
            names.extend(hidden(&entry.path()));
        }
    }
    names
}

#[test]
fn what_killed_commands_leave_is_removed_by_the_next() {
    let place = Place::new();
    place.write("up.gp", "(individual (iterate-up 3x3 x-obstacle (set-a y)))");
    place.write("p.csv", "row,distance\n10,3\n20,2\n40,1\n");
    let root = place.path("");
    const RANDOM: &str = "0123456789abcdef";
    let file = |name: &str| place.write(&format!("{}.{RANDOM}.tmp", dotted(name)), "half");
    let folder = |name: &str| {
        let path = format!("{}.{RANDOM}.part", dotted(name));
        std::fs::create_dir_all(place.path(&path).join("images")).expect("writable");
        place.write(&format!("{path}/images/half.png"), "half");
    };
    let cases: [(&dyn Fn(), Vec<&str>); 7] = [
        (&|| folder("run"), tiny(&["--quiet", "--out", "run"])),
        (
            &|| {
                ["settings.toml", "checkpoint", "log.jsonl"]
                    .iter()
                    .for_each(|name| file(&format!("run/{name}")))
            },
            vec!["evolve", "--resume", "run", "--quiet"],
        ),
        (&|| file("answers.csv"), vec!["eval", "up.gp", "--data", "data", "--answers", "answers.csv"]),
        (&|| folder("pictures"), vec!["show", "up.gp", "--data", "data", "--out", "pictures"]),
        (&|| folder("v.y4m"), vec!["show", "up.gp", "--data", "data", "--video", "v.y4m"]),
        (&|| folder("corridor"), vec!["data", "synth", "corridor", "--frames", "1"]),
        (
            &|| {
                std::fs::create_dir(place.path("kept")).expect("writable");
                file("kept/frame_000003.png");
            },
            vec!["run", "up.gp", "--input", "data/images", "--record", "kept", "--every", "1f", "--quiet"],
        ),
    ];
    for (leave, arguments) in cases {
        leave();
        assert!(!hidden(&root).is_empty());
        let output = ends(start(&place, &arguments));
        assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
        assert_eq!(hidden(&root), [""; 0], "{arguments:?}");
    }
}

/// A path whose last part begins with a dot.
fn dotted(path: &str) -> String {
    match path.rsplit_once('/') {
        Some((folder, leaf)) => format!("{folder}/.{leaf}"),
        None => format!(".{path}"),
    }
}

#[test]
fn a_command_that_is_killed_is_cleared_up_after_and_one_that_runs_is_left_alone() {
    let place = Place::new();
    place.write("up.gp", "(individual (iterate-up 3x3 x-obstacle (set-a y)))");
    // Large pictures, which take their time.
    let large = ["show", "up.gp", "--data", "data", "--scale", "16", "--out", "pictures"];
    let mut killed = start(&place, &large);
    let left = place.part_of("pictures");
    killed.kill().expect("it can be killed");
    killed.wait().expect("it ends");
    assert!(left.exists());
    // Stopped, so that it is in the midst of its work for as long as this takes.
    let mut first = start(&place, &large);
    let busy = loop {
        let part = place.part_of("pictures");
        if part != left {
            break part;
        }
    };
    signal(&first, libc::SIGSTOP);
    let small = ["show", "up.gp", "--data", "data", "--out", "pictures"];
    let output = ends(start(&place, &small));
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(!left.exists() && busy.exists());
    signal(&first, libc::SIGCONT);
    let code = first.wait().expect("it ends").code();
    assert_eq!(code, Some(1), "the folder is there already");
    assert_eq!(hidden(&place.path("")), [""; 0]);
}

#[test]
fn files_have_the_mode_that_the_umask_says() {
    let place = Place::new();
    place.write("up.gp", "(individual (iterate-up 3x3 x-obstacle (set-a y)))");
    for (mask, file, folder) in [(0o022, 0o644, 0o755), (0o077, 0o600, 0o700), (0o002, 0o664, 0o775)] {
        let run = |arguments: &[&str]| {
            use std::os::unix::process::CommandExt;
            let mut command = place.command(arguments);
            let set = move || {
                // SAFETY: a plain system call, which cannot fail.
                unsafe { libc::umask(mask) };
                Ok(())
            };
            // SAFETY: the closure only makes a system call; it neither allocates nor locks.
            unsafe { command.pre_exec(set) };
            assert!(command.output().expect("started").status.success());
        };
        run(&["eval", "up.gp", "--data", "data", "--answers", "answers.csv"]);
        run(&["show", "up.gp", "--data", "data", "--out", "pictures"]);
        run(&tiny(&["--quiet", "--out", "run"]));
        let mode = |name: &str| place.path(name).metadata().expect("there").permissions().mode() & 0o777;
        for name in ["answers.csv", "run/checkpoint", "run/best.gp", "run/settings.toml"] {
            assert_eq!(mode(name), file, "{name}, {mask:o}");
        }
        for name in ["pictures", "run"] {
            assert_eq!(mode(name), folder, "{name}, {mask:o}");
            std::fs::remove_dir_all(place.path(name)).expect("ours");
        }
        std::fs::remove_file(place.path("answers.csv")).expect("ours");
    }
}
