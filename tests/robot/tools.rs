//! The tools that the tests run.

use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

/// Whether a tool is there. One that is not is reported with the Debian package that has it, and is a failure where
/// VSONAR_REQUIRE_TOOLS is set.
pub(crate) fn has(tool: &str, package: &str) -> bool {
    let version = if tool == "ffmpeg" { "-version" } else { "--version" };
    let found = Command::new(tool).arg(version).output().is_ok_and(|output| output.status.success());
    missing(found, tool, package)
}

/// The same for anything whose presence is known.
pub(crate) fn missing(found: bool, tool: &str, package: &str) -> bool {
    if !found {
        let required = std::env::var_os("VSONAR_REQUIRE_TOOLS").is_some();
        assert!(
            !required,
            "`{tool}` does not run, but VSONAR_REQUIRE_TOOLS is set: install Debian's {package}"
        );
        eprintln!("skipped: `{tool}` does not run; Debian's {package} has it");
    }
    found
}

/// The folder of the examples.
pub(crate) fn examples() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/robot")
}

/// An empty folder of this name for a test's files.
pub(crate) fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("robot").join(name);
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).expect("the target folder can be written");
    folder
}

/// Runs a command that must succeed without a word of complaint.
pub(crate) fn run(command: &mut Command) -> Output {
    let output = command.output().unwrap_or_else(|fault| panic!("{command:?}: {fault}"));
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{command:?}: {}\n{}{said}", output.status, text(&output.stdout));
    output
}

/// What a program prints that takes this file as its input.
pub(crate) fn fed(command: &mut Command, input: &Path) -> String {
    let input = File::open(input).unwrap_or_else(|fault| panic!("{}: {fault}", input.display()));
    let output = run(command.stdin(Stdio::from(input)));
    assert!(output.stderr.is_empty(), "{command:?}: {}", text(&output.stderr));
    text(&output.stdout)
}

/// The complaint of a program that is to fail with this exit code and one line on this input.
pub(crate) fn fails(command: &mut Command, code: i32, input: &Path) -> String {
    let input = File::open(input).unwrap_or_else(|fault| panic!("{}: {fault}", input.display()));
    let output =
        command.stdin(Stdio::from(input)).output().unwrap_or_else(|fault| panic!("{command:?}: {fault}"));
    let complaint = text(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{command:?}: {complaint}");
    assert!(complaint.starts_with("error: ") && complaint.lines().count() == 1, "{command:?}: {complaint}");
    complaint
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).expect("UTF-8")
}
