//! Several commands on one folder, commands that are stopped and killed, and what is refused at the beginning.

use std::process::{Command, Output};

use serde_json::{Value, json};

use crate::common::*;

#[test]
fn two_commands_keep_each_others_marks() {
    let dir = images(4);
    let both = [(); 2].map(|()| Label::start(dir.path(), &["--columns", "10,40,70,100"]));
    std::thread::scope(|scope| {
        for (which, label) in both.iter().enumerate() {
            scope.spawn(move || {
                for image in 1..=4 {
                    for x in [10, 40, 70, 100].into_iter().skip(which).step_by(2) {
                        for row in 1..=5 {
                            let from = if row == 1 { Value::Null } else { json!(row - 1) };
                            let name = format!("frame_{image}.png");
                            let answer = label.mark(&name, x, from, json!(row));
                            assert_eq!(answer["refused"], json!([]));
                        }
                    }
                }
            });
        }
    });
    let found = labels(dir.path());
    assert_eq!(found.len(), 16);
    assert!(found.values().all(|row| *row == 5), "{found:?}");
    // Each sees the other's, and neither changes unseen what the other did.
    let [first, second] = &both;
    first.mark("frame_1.png", 10, json!(5), json!(9));
    let refused = second.mark("frame_1.png", 10, json!(5), json!(7));
    assert_eq!(refused["refused"], json!([{ "image": "frame_1.png", "x": 10, "mark": 9 }]));
    let news = second.json("GET", "changes?since=1", "");
    let marks = news["marks"].as_array().expect("a list");
    assert_eq!(marks.len(), 16);
    assert!(marks.contains(&json!({ "image": "frame_1.png", "x": 10, "mark": 9 })), "{news}");
}

#[test]
fn marks_of_other_programs_are_seen_and_kept() {
    let dir = images(2);
    let table = below(&dir, "labels.csv");
    std::fs::write(&table, "image,x,y,group,note\nframe_2.png,99,3,hall,by hand\nelsewhere.png,1,2,,\n")
        .expect("writable");
    let label = Label::start(dir.path(), &["--columns", "20,60"]);
    assert_eq!(label.ready["progress"], json!({ "asked": 4, "labels": 0, "skipped": 0 }));
    label.mark("frame_1.png", 20, Value::Null, json!(50));
    label.mark("frame_2.png", 60, Value::Null, json!("skip"));
    label.mark("frame_2.png", 20, Value::Null, json!(0));
    let expected = "image,x,y,group,note\nframe_1.png,20,50,,\nframe_2.png,20,0,hall,\n\
                    frame_2.png,99,3,hall,by hand\nelsewhere.png,1,2,,\n";
    assert_eq!(std::fs::read_to_string(&table).expect("there"), expected);
    assert_eq!(
        std::fs::read_to_string(below(&dir, "labels.skip.csv")).expect("there"),
        "image,x\nframe_2.png,60\n"
    );
    // Another program changes a label, and a mark that has seen the old one is refused.
    std::fs::write(&table, expected.replace("frame_1.png,20,50", "frame_1.png,20,51")).expect("writable");
    let refused = label.mark("frame_1.png", 20, json!(50), json!(52));
    assert_eq!(refused["refused"][0]["mark"], 51);
    label.mark("frame_1.png", 20, json!(51), json!(52));
    label.mark("frame_2.png", 60, json!("skip"), Value::Null);
    assert_eq!(
        std::fs::read_to_string(&table).expect("there"),
        expected.replace("frame_1.png,20,50", "frame_1.png,20,52")
    );
    assert_eq!(std::fs::read_to_string(below(&dir, "labels.skip.csv")).expect("there"), "image,x\n");
    // One that is spoilt meanwhile is left alone, and the page is told.
    let body = label.marks(json!([{ "image": "frame_1.png", "x": 20, "from": 52, "to": 53 }]));
    std::fs::write(&table, "image,x,y\nframe_1.png,twenty,5\n").expect("writable");
    let (status, body) = label.ask("POST", "marks", &body);
    let text = String::from_utf8(body).expect("UTF-8");
    assert!(status == 500 && text.contains("labels.csv line 2: x is `twenty`"), "{status} {text}");
    assert_eq!(std::fs::read_to_string(&table).expect("there"), "image,x,y\nframe_1.png,twenty,5\n");
}

/// Lets a process write no more to any file than so many bytes, as on a full disk.
#[cfg(target_os = "linux")]
fn limit_files(process: u32, bytes: u64) {
    let limit = libc::rlimit { rlim_cur: bytes, rlim_max: libc::RLIM_INFINITY };
    // SAFETY: a plain system call with valid arguments, on a child that has not been waited for.
    let set =
        unsafe { libc::prlimit(process as libc::pid_t, libc::RLIMIT_FSIZE, &limit, std::ptr::null_mut()) };
    assert_eq!(set, 0, "{}", std::io::Error::last_os_error());
}

#[cfg(target_os = "linux")]
#[test]
fn a_mark_that_cannot_be_written_is_an_error_and_changes_nothing() {
    let dir = images(1);
    let label = Label::start(dir.path(), &["--columns", "20,60"]);
    label.mark("frame_1.png", 20, Value::Null, json!(50));
    limit_files(label.process.id(), 1);
    let body = label.marks(json!([{ "image": "frame_1.png", "x": 60, "from": null, "to": 5 }]));
    let (status, answer) = label.ask("POST", "marks", &body);
    let text = String::from_utf8(answer).expect("UTF-8");
    assert!(status == 500 && text.contains("cannot write the file"), "{status} {text}");
    let marks = |label: &Label| label.json("GET", "session", "")["marks"].as_array().map(Vec::len);
    assert_eq!((labels(dir.path()).len(), marks(&label)), (1, Some(1)));
    limit_files(label.process.id(), libc::RLIM_INFINITY);
    assert_eq!(label.ask("POST", "marks", &body).0, 200);
    assert_eq!((labels(dir.path()).len(), marks(&label)), (2, Some(2)));
    // The half that could not be written is not there any more either.
    let mut names: Vec<_> = std::fs::read_dir(dir.path())
        .expect("readable")
        .map(|entry| entry.expect("readable").file_name())
        .collect();
    names.sort();
    assert_eq!(names, [".labels.columns", ".labels.lock", "frame_1.png", "labels.csv"]);
}

/// The complaint of the command, which does not come to show its page; exit code 1.
#[cfg(target_os = "linux")]
fn refused(
    dir: &std::path::Path,
    prepare: impl FnMut() -> std::io::Result<()> + Send + Sync + 'static,
) -> String {
    use std::os::unix::process::CommandExt;
    let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_vsonar"));
    command.arg("label").arg(dir).stdin(std::process::Stdio::null());
    // SAFETY: the closures only make system calls; they neither allocate nor lock.
    unsafe { command.pre_exec(prepare) };
    let output = command.output().expect("the command can be started");
    let complaint = String::from_utf8(output.stderr).expect("UTF-8");
    assert_eq!((output.status.code(), output.stdout.len()), (Some(1), 0), "{complaint}");
    complaint
}

/// Takes the right to write where the mode says otherwise from the system's administrator, who these tests may be run by.
#[cfg(target_os = "linux")]
fn obey_modes() -> std::io::Result<()> {
    const CAP_DAC_OVERRIDE: libc::c_ulong = 1;
    // SAFETY: a plain system call with valid arguments. For anybody else it fails, and there is nothing to be taken.
    unsafe { libc::prctl(libc::PR_CAPBSET_DROP, CAP_DAC_OVERRIDE, 0, 0, 0) };
    Ok(())
}

#[cfg(target_os = "linux")]
#[test]
fn a_folder_that_cannot_be_written_is_refused_at_once() {
    use std::os::unix::fs::PermissionsExt;
    let set_mode = |path: &std::path::Path, mode| {
        std::fs::set_permissions(path, std::fs::Permissions::from_mode(mode)).expect("ours");
    };
    let dir = images(1);
    set_mode(dir.path(), 0o555);
    let complaint = refused(dir.path(), obey_modes);
    assert!(complaint.contains("make the folder writable, or label a copy of it"), "{complaint}");
    set_mode(dir.path(), 0o755);
    // A lock that an earlier command has left does not make it writable.
    std::fs::write(below(&dir, ".labels.lock"), "").expect("writable");
    set_mode(dir.path(), 0o555);
    let complaint = refused(dir.path(), obey_modes);
    assert!(complaint.contains("labels.csv: cannot write the file"), "{complaint}");
    assert!(complaint.contains("make the folder writable, or label a copy of it"), "{complaint}");
    set_mode(dir.path(), 0o755);
    // A disk that is full takes files, but nothing in them.
    let full = || {
        let limit = libc::rlimit { rlim_cur: 0, rlim_max: 0 };
        // SAFETY: a plain system call with valid arguments.
        match unsafe { libc::setrlimit(libc::RLIMIT_FSIZE, &limit) } {
            0 => Ok(()),
            _ => Err(std::io::Error::last_os_error()),
        }
    };
    let complaint = refused(dir.path(), full);
    assert!(complaint.contains("labels.csv: cannot write the file"), "{complaint}");
    assert!(complaint.contains("make room on the disk"), "{complaint}");
    // A table that is not to be changed.
    std::fs::write(below(&dir, "labels.csv"), "image,x,y\n").expect("writable");
    set_mode(&below(&dir, "labels.csv"), 0o444);
    let complaint = refused(dir.path(), obey_modes);
    assert!(complaint.contains("labels.csv: is read-only"), "{complaint}");
    let mut names: Vec<_> = std::fs::read_dir(dir.path())
        .expect("readable")
        .map(|entry| entry.expect("readable").file_name())
        .collect();
    names.sort();
    assert_eq!(names, [".labels.lock", "frame_1.png", "labels.csv"], "nothing is left behind");
}

#[cfg(unix)]
#[test]
fn ctrl_c_says_what_is_saved() {
    let dir = images(1);
    let mut label = Label::start(dir.path(), &["--columns", "20,60,100"]);
    label.mark("frame_1.png", 20, Value::Null, json!(50));
    label.mark("frame_1.png", 60, Value::Null, json!("skip"));
    // SAFETY: sends a signal to a child that has not been waited for, so its number is its own.
    let sent = unsafe { libc::kill(label.process.id() as libc::pid_t, libc::SIGINT) };
    assert_eq!(sent, 0);
    assert_eq!(label.process.wait().expect("it ends").code(), Some(130));
    let mut said = String::new();
    std::io::Read::read_to_string(&mut label.process.stderr.take().expect("piped"), &mut said)
        .expect("UTF-8");
    assert!(said.contains("2 of 3 marks made: 1 label in ") && said.contains("1 column skipped"), "{said}");
    assert!(said.contains("Go on with: vsonar label ") && said.contains(" --columns 20,60,100\n"), "{said}");
    vsonar::dataset::Dataset::load(dir.path()).expect("a sound data set");
}

#[cfg(unix)]
#[test]
fn suggestions_of_a_program_for_other_images_are_worth_a_note() {
    let dir = images(1);
    let program = below(&dir, "p.gp");
    let comment =
        |size: &str| format!("; evolved with seed 1, on images of {size} pixels, of the data set d");
    let tree = "(individual (iterate-up 2x2 x-obstacle (set-a (* x-obstacle 0.5))))";
    for (size, noted) in [("160x120", false), ("320x240", true), ("120x160", true)] {
        std::fs::write(&program, format!("{}\n{tree}\n", comment(size))).expect("writable");
        let mut label = Label::start(dir.path(), &["--suggest", program.to_str().expect("UTF-8")]);
        assert_eq!(label.ready["width"], 160);
        // SAFETY: sends a signal to a child that has not been waited for, so its number is its own.
        let sent = unsafe { libc::kill(label.process.id() as libc::pid_t, libc::SIGINT) };
        assert_eq!((sent, label.process.wait().expect("it ends").code()), (0, Some(130)));
        let mut said = String::new();
        std::io::Read::read_to_string(&mut label.process.stderr.take().expect("piped"), &mut said)
            .expect("UTF-8");
        let note = format!(
            "p.gp was evolved on images of {size} pixels and knows their rows by number; these have 160x120"
        );
        assert_eq!(said.contains(&note), noted, "{said}");
    }
}

#[cfg(unix)]
#[test]
fn ctrl_c_tells_labels_of_other_columns_too() {
    let dir = images(2);
    std::fs::write(
        below(&dir, "labels.csv"),
        "image,x,y\nframe_1.png,20,5\nframe_2.png,20,6\nframe_2.png,60,7\n",
    )
    .expect("writable");
    for (columns, words) in
        [("80,", "0 of 2 marks made: 0 of the 3 labels in "), ("20,60", "3 of 4 marks made: 3 labels in ")]
    {
        let mut label = Label::start(dir.path(), &["--columns", columns]);
        // SAFETY: sends a signal to a child that has not been waited for, so its number is its own.
        let sent = unsafe { libc::kill(label.process.id() as libc::pid_t, libc::SIGINT) };
        assert_eq!((sent, label.process.wait().expect("it ends").code()), (0, Some(130)));
        let mut said = String::new();
        std::io::Read::read_to_string(&mut label.process.stderr.take().expect("piped"), &mut said)
            .expect("UTF-8");
        assert!(said.contains(words), "{said}");
    }
}

#[cfg(unix)]
#[test]
fn what_is_not_looked_at_is_named() {
    use std::os::unix::ffi::OsStrExt;
    let dir = images(1);
    let nested = tempfile::tempdir().expect("a temporary folder");
    for folder in ["a", "with space/b"] {
        std::fs::create_dir_all(below(&nested, folder)).expect("writable");
        std::fs::copy(below(&dir, "frame_1.png"), below(&nested, folder).join("x.png")).expect("writable");
    }
    let (code, said) = complaint(nested.path(), &[]);
    assert!(
        code == Some(1) && said.contains("2 images in subfolders (a, with space/b) are not looked at"),
        "{said}"
    );
    let odd = nested.path().join(std::ffi::OsStr::from_bytes(b"bad\xff.png"));
    // Some file systems refuse such a name.
    let odd = std::fs::copy(below(&dir, "frame_1.png"), odd).is_ok();
    std::fs::copy(below(&dir, "frame_1.png"), below(&nested, "here.png")).expect("writable");
    std::fs::write(below(&nested, "labels.csv"), "image,x,y\na/x.png,20,5\n").expect("writable");
    let label = Label::start(nested.path(), &[]);
    assert_eq!(label.ready["images"], 2);
    assert_eq!(
        label.ready["in_subfolders"],
        json!({ "images": 1, "folders": ["with space/b"], "at_least": false })
    );
    let left_out = &label.ready["left_out"];
    if odd {
        assert!(
            left_out[0]["why"].as_str().is_some_and(|why| why.contains("not UTF-8; rename")),
            "{left_out}"
        );
    }
    assert_eq!(left_out.as_array().map(Vec::len), Some(usize::from(odd)));
    drop(label);
    let mut command = Command::new(env!("CARGO_BIN_EXE_vsonar"));
    let mut process = command
        .arg("label")
        .arg(nested.path())
        .stdout(std::process::Stdio::piped())
        .stderr(std::process::Stdio::piped())
        .spawn()
        .expect("started");
    let mut line = String::new();
    let mut out = std::io::BufReader::new(process.stdout.take().expect("piped"));
    std::io::BufRead::read_line(&mut out, &mut line).expect("UTF-8");
    let _ = process.kill();
    let said = process.wait_with_output().expect("it ends").stderr;
    let said = String::from_utf8(said).expect("UTF-8");
    assert!(said.contains("note: 1 image in a subfolder (with space/b) is not looked at; "), "{said}");
    let mut command = Command::new(env!("CARGO_BIN_EXE_vsonar"));
    let check = command.args(["data", "check"]).arg(nested.path()).output().expect("started");
    let said = String::from_utf8(check.stdout).expect("UTF-8");
    assert!(said.contains("note: 1 image in a subfolder (with space/b) is not looked at"), "{said}");
}

#[test]
fn marks_outlive_a_command_that_is_killed() {
    let dir = images(2);
    let first = Label::start(dir.path(), &["--columns", "20,60"]);
    first.mark("frame_1.png", 20, Value::Null, json!(50));
    first.mark("frame_1.png", 60, Value::Null, json!("skip"));
    drop(first);
    // The columns are those of before.
    let again = Label::start(dir.path(), &[]);
    assert_eq!(again.ready["columns"], json!([20, 60]));
    assert_eq!(again.ready["progress"], json!({ "asked": 4, "labels": 1, "skipped": 1 }));
}

#[test]
fn the_help_says_who_sees_an_opened_address() {
    let help =
        Command::new(env!("CARGO_BIN_EXE_vsonar")).args(["label", "--help"]).output().expect("started");
    let words = String::from_utf8(help.stdout).expect("UTF-8");
    let words = words.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(words.contains("other users of this machine can read it"), "{words}");
}

#[test]
fn columns_outlive_a_command_with_one_mark() {
    for columns in [&[][..], &["--columns", "20,60,100"]] {
        let dir = images(3);
        let first = Label::start(dir.path(), columns);
        let x = first.ready["columns"][0].as_u64().expect("a column") as u32;
        first.mark("frame_1.png", x, Value::Null, json!(50));
        let asked = first.ready["columns"].clone();
        drop(first);
        assert_eq!(Label::start(dir.path(), &[]).ready["columns"], asked);
        // Others, once asked for, take their place.
        assert_eq!(Label::start(dir.path(), &["--columns", "30,"]).ready["columns"], json!([30]));
        assert_eq!(Label::start(dir.path(), &[]).ready["columns"], json!([30]));
    }
}

#[cfg(unix)]
#[test]
fn a_lock_that_another_program_keeps_stops_neither_page_nor_command() {
    let dir = images(1);
    let mut label = Label::start(dir.path(), &["--columns", "20,60"]);
    let held = std::fs::File::create(below(&dir, ".labels.lock")).expect("writable");
    held.lock().expect("free");
    let body = label.marks(json!([{ "image": "frame_1.png", "x": 20, "from": null, "to": 5 }]));
    let start = std::time::Instant::now();
    let (status, answer) = std::thread::scope(|scope| {
        let waiting = scope.spawn(|| label.ask("POST", "marks", &body));
        std::thread::sleep(std::time::Duration::from_millis(200));
        assert_eq!(label.json("GET", "session", "")["marks"], json!([]));
        assert!(!waiting.is_finished());
        waiting.join().expect("no panic")
    });
    let text = String::from_utf8_lossy(&answer);
    assert!(status == 500 && text.contains(".labels.lock: another program has locked"), "{status} {text}");
    // SAFETY: sends a signal to a child that has not been waited for, so its number is its own.
    let sent = unsafe { libc::kill(label.process.id() as libc::pid_t, libc::SIGINT) };
    assert_eq!(sent, 0);
    assert_eq!(label.process.wait().expect("it ends").code(), Some(130));
    assert!(start.elapsed().as_secs() < 50, "{:?}", start.elapsed());
}

fn complaint(dir: &std::path::Path, more: &[&str]) -> (Option<i32>, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_vsonar"));
    let Output { status, stderr, .. } = command.arg("label").arg(dir).args(more).output().expect("started");
    let text = String::from_utf8(stderr).expect("UTF-8");
    assert!(text.starts_with("error: "), "{text}");
    (status.code(), text)
}

#[test]
fn what_cannot_be_labelled_is_refused_with_a_remedy() {
    let dir = images(1);
    let told = |dir: &std::path::Path, more: &[&str], code, words: &[&str]| {
        let (status, text) = complaint(dir, more);
        assert_eq!(status, Some(code), "{text}");
        for word in words {
            assert!(text.contains(word), "{word:?} is not in {text}");
        }
    };
    told(&below(&dir, "no"), &[], 1, &["there is no folder"]);
    told(&below(&dir, "frame_1.png"), &[], 1, &["there is no folder"]);
    told(dir.path(), &["--columns", "20,160"], 2, &["column 160 is outside the images", "0 to 159"]);
    told(dir.path(), &["--columns", "200"], 2, &["--columns"]);
    told(dir.path(), &["--columns", "5,9,5"], 2, &["--columns: 5 is there twice"]);
    told(dir.path(), &["--columns", "x"], 2, &["write how many"]);
    told(dir.path(), &["--port", "70000"], 2, &["70000"]);
    told(dir.path(), &["--suggest", "no.gp"], 1, &["no.gp"]);
    let folder = dir.path().to_str().expect("UTF-8");
    told(dir.path(), &["--suggest", folder], 1, &["no best.gp", "no run folder"]);
    let vir = below(&dir, "p.vir");
    let program = "(individual (iterate-up 2x2 x-obstacle (set-a y)))".parse().expect("a program");
    let lowered = vsonar::lower::lower(&program, 64, 48);
    std::fs::write(&vir, vsonar::ir::text::print(&lowered)).expect("writable");
    let suggest = ["--suggest", vir.to_str().expect("UTF-8")];
    told(dir.path(), &suggest, 1, &["for images of 64x48", "these have 160x120", ".gp file"]);
    let taken = std::net::TcpListener::bind("127.0.0.1:0").expect("a port");
    let port = taken.local_addr().expect("bound").port().to_string();
    told(dir.path(), &["--port", &port], 1, &["--port", "cannot be had", "choose another"]);
    let empty = tempfile::tempdir().expect("a temporary folder");
    told(empty.path(), &[], 1, &["there is no image that can be labelled"]);
    std::fs::write(below(&empty, "a.png"), "no image").expect("writable");
    told(empty.path(), &[], 1, &["there is no image that can be labelled", "a.png"]);
    // What the decoder says is two lines.
    std::fs::write(below(&empty, "a.jpg"), "").expect("writable");
    std::fs::remove_file(below(&empty, "a.png")).expect("there");
    let (_, text) = complaint(empty.path(), &[]);
    assert!(
        text.contains("a.jpg") && text.contains("damaged") && text.trim_end().lines().count() == 1,
        "{text}"
    );
    for (table, words) in [
        ("image,y\n", vec!["labels.csv line 1", "without `x`", "vsonar data check"]),
        ("image,x,y\nframe_1.png,20,5\nframe_1.png,20,6\n", vec!["labels.csv line 3", "already"]),
        ("image,x,y\nframe_1.png,20,120\n", vec!["labels.csv line 2", "outside the image"]),
        ("image,x,y\n../a.png,20,1\n", vec!["labels.csv line 2", "not a path below the folder"]),
    ] {
        std::fs::write(below(&dir, "labels.csv"), table).expect("writable");
        told(dir.path(), &[], 1, &words);
        assert_eq!(std::fs::read_to_string(below(&dir, "labels.csv")).expect("there"), table);
    }
    std::fs::remove_file(below(&dir, "labels.csv")).expect("there");
    std::fs::write(below(&dir, "labels.skip.csv"), "image,x\nframe_1.png,x\n").expect("writable");
    told(dir.path(), &[], 1, &["labels.skip.csv line 2", "mend the line"]);
}
