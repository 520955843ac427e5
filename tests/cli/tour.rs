//! The guided tour says what happens: each command that `examples/tour.md` and the README show is run, in order, and what
//! it prints is held against what stands there.

use std::collections::BTreeMap;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Command, Stdio};

/// The commands of a text and what it says they print: blocks of ```console that begin with `$ `.
fn told(text: &str) -> Vec<(String, Vec<String>)> {
    let mut found: Vec<(String, Vec<String>)> = Vec::new();
    let mut inside = false;
    for line in text.lines() {
        match line {
            "```console" => inside = true,
            "```" => inside = false,
            line if inside => match (line.strip_prefix("$ "), found.last_mut()) {
                (Some(command), _) => found.push((command.to_string(), Vec::new())),
                (None, Some((_, lines))) => lines.push(line.to_string()),
                (None, None) => panic!("a block begins without a command: {line}"),
            },
            _ => {}
        }
    }
    found
}

/// Whether a line is as it was told; `[..]` is for anything.
fn is_line(told: &str, line: &str) -> bool {
    let Some((head, rest)) = told.split_once("[..]") else { return told == line };
    let Some(line) = line.strip_prefix(head) else { return false };
    (0..=line.len()).any(|i| line.is_char_boundary(i) && is_line(rest, &line[i..]))
}

/// Whether lines are as they were told; a line of dots is for any number of lines.
fn are_lines(told: &[String], lines: &[String]) -> bool {
    match told {
        [] => lines.is_empty(),
        [dots, rest @ ..] if dots == "..." => (0..=lines.len()).any(|i| are_lines(rest, &lines[i..])),
        [first, rest @ ..] => {
            lines.first().is_some_and(|l| is_line(first, l) && are_lines(rest, &lines[1..]))
        }
    }
}

/// Runs `vsonar ...` in a folder and gives the lines on its standard output. What serves a page until it is told to end
/// is told so after as many lines as are expected.
fn run(command: &str, dir: &Path, expected: usize) -> Vec<String> {
    let mut words = command.split(' ');
    assert_eq!(words.next(), Some("vsonar"), "{command}");
    let words: Vec<&str> = words.collect();
    let mut vsonar = Command::new(env!("CARGO_BIN_EXE_vsonar"));
    vsonar.args(&words).current_dir(dir).stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut process = vsonar.spawn().expect("the command can be started");
    let lines: Vec<String>;
    if words[0] == "label" {
        let out = BufReader::new(process.stdout.take().expect("piped"));
        lines = out.lines().take(expected).map(|line| line.expect("readable")).collect();
        // SAFETY: the process is ours and has not been waited for, so its number is its own.
        assert_eq!(unsafe { libc::kill(process.id().cast_signed(), libc::SIGINT) }, 0);
        let status = process.wait().expect("waited for");
        assert!(matches!(status.code(), Some(0 | 130)), "{command}: {status}");
    } else {
        let output = process.wait_with_output().expect("waited for");
        let complaint = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{command}: {complaint}");
        let text = String::from_utf8(output.stdout).expect("UTF-8");
        lines = text.lines().map(str::to_string).collect();
    }
    // What has no end on screen has none here.
    lines.into_iter().map(|line| line.trim_end().to_string()).collect()
}

#[test]
fn the_tour_is_true() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let read = |name: &str| std::fs::read_to_string(root.join(name)).expect("part of the project");
    let tour = told(&read("examples/tour.md"));
    assert_eq!(tour.len(), 10, "ten commands");
    let dir = tempfile::tempdir().expect("a temporary folder");
    let mut printed = BTreeMap::new();
    for (command, told) in &tour {
        let lines = run(command, dir.path(), told.len());
        assert!(
            are_lines(told, &lines),
            "{command}\nprints\n{}\nbut the tour says\n{}",
            lines.join("\n"),
            told.join("\n")
        );
        printed.insert(command.as_str(), lines);
    }
    for file in ["run/report.html", "pictures/contact-sheet.png", "detector/libbest.a", "detector/best.h"] {
        assert!(dir.path().join(file).is_file(), "{file}");
    }
    let short = told(&read("README.md"));
    assert_eq!(short.len(), 10, "the README has them all");
    for (command, told) in &short {
        let lines = printed.get(command.as_str()).unwrap_or_else(|| panic!("{command} is not of the tour"));
        assert!(
            are_lines(told, lines),
            "{command}\nprints\n{}\nbut the README says\n{}",
            lines.join("\n"),
            told.join("\n")
        );
    }
}

#[test]
fn what_is_told_is_compared() {
    let lines = |text: &str| text.lines().map(str::to_string).collect::<Vec<_>>();
    let same = |told: &str, printed: &str| are_lines(&lines(told), &lines(printed));
    assert!(
        same("a\n...\nz", "a\nb\nc\nz") && same("a\n...\nz", "a\nz") && same("took [..] s", "took 3.2 s")
    );
    assert!(
        !same("a\n...\nz", "a\nb")
            && !same("a", "a\nb")
            && !same("a\nb", "a")
            && !same("took [..] s", "took 3")
    );
    assert_eq!(
        told("x\n```console\n$ vsonar a b\nout\n```\n"),
        [("vsonar a b".to_string(), vec!["out".to_string()])]
    );
}
