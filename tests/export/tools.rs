//! The tools that the tests run: compilers, emulators, Python.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// Whether a tool is there. One that is not is reported, and is a failure where VSONAR_REQUIRE_TOOLS is set.
pub(crate) fn has(tool: &str, arguments: &[&str]) -> bool {
    let found = Command::new(tool).args(arguments).output().is_ok_and(|output| output.status.success());
    if !found {
        let required = std::env::var_os("VSONAR_REQUIRE_TOOLS").is_some();
        assert!(!required, "`{tool} {}` does not run, but VSONAR_REQUIRE_TOOLS is set", arguments.join(" "));
        eprintln!("skipped: `{tool} {}` does not run", arguments.join(" "));
    }
    found
}

/// An empty folder of this name for a test's files.
pub(crate) fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("export").join(name);
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).expect("the target folder can be written");
    folder
}

/// Runs a command that must succeed.
pub(crate) fn run(command: &mut Command) -> Output {
    let output = command.output().unwrap_or_else(|fault| panic!("{command:?}: {fault}"));
    assert!(
        output.status.success(),
        "{command:?}: {}\n{}{}",
        output.status,
        String::from_utf8_lossy(&output.stdout),
        String::from_utf8_lossy(&output.stderr)
    );
    output
}

/// Does things, two at a time.
pub(crate) fn in_parallel<T: Sync>(things: &[T], what: impl Fn(&T) + Sync) {
    let next = std::sync::atomic::AtomicUsize::new(0);
    std::thread::scope(|scope| {
        for _ in 0..2 {
            scope.spawn(|| {
                while let Some(thing) = things.get(next.fetch_add(1, std::sync::atomic::Ordering::Relaxed)) {
                    what(thing);
                }
            });
        }
    });
}

/// A compiler with its options, and what runs its programs.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Compiler {
    /// The command.
    pub(crate) command: &'static str,
    /// Options.
    pub(crate) options: &'static [&'static str],
    /// An emulator and its options; empty for none.
    pub(crate) emulator: &'static [&'static str],
}

impl Compiler {
    /// A compiler for this machine.
    pub(crate) const fn native(command: &'static str, options: &'static [&'static str]) -> Compiler {
        Compiler { command, options, emulator: &[] }
    }

    /// Whether it can be used here.
    pub(crate) fn is_there(&self) -> bool {
        let version = if self.command == "tcc" { "-v" } else { "--version" };
        has(self.command, &[version]) && self.emulator.first().is_none_or(|e| has(e, &["--version"]))
    }

    /// The compiler and its options.
    pub(crate) fn command(&self) -> Command {
        let mut command = Command::new(self.command);
        command.args(self.options);
        command
    }

    /// What runs a program.
    pub(crate) fn runner(&self, program: &Path) -> Command {
        match self.emulator {
            [] => Command::new(program),
            [emulator, options @ ..] => {
                let mut command = Command::new(emulator);
                command.args(options).arg(program);
                command
            }
        }
    }
}

impl std::fmt::Display for Compiler {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} {}", self.command, self.options.join(" "))
    }
}
