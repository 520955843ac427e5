//! How a command ends when it does not end well.

use std::io;
use std::path::Path;
use std::process::ExitCode;

use vsonar::support::printable::ShownPath as _;

/// Why a command did not do what it was asked.
#[derive(Debug)]
pub(crate) enum CliError {
    /// The flags do not make sense: exit code 2.
    Usage(String),
    /// Anything else: exit code 1.
    Failed(String),
    /// What was asked was done, and the answer is no; it has been printed. Exit code 1.
    Negative,
    /// Ctrl-C, and how to go on, if there is anything to say: exit code 130.
    Interrupted(String),
    /// Whoever read the output has gone; nothing is wrong.
    Closed,
}

/// Exit code after Ctrl-C: 128 and the number of the signal, as shells have it.
pub(crate) const INTERRUPTED: u8 = 130;

impl<E: std::error::Error> From<E> for CliError {
    fn from(error: E) -> CliError {
        CliError::Failed(error.to_string())
    }
}

impl CliError {
    /// A file that could not be read or written.
    pub(crate) fn file(path: &Path, action: &str, error: &io::Error) -> CliError {
        CliError::Failed(format!("{}: cannot {action}: {error}{}", path.shown(), remedy(error)))
    }

    /// Standard output that could not be written.
    pub(crate) fn output(error: &io::Error) -> CliError {
        match error.kind() {
            io::ErrorKind::BrokenPipe => CliError::Closed,
            _ => CliError::Failed(format!("cannot write to standard output: {error}{}", remedy(error))),
        }
    }

    /// What went wrong, in words.
    pub(crate) fn words(&self) -> String {
        match self {
            CliError::Usage(text) | CliError::Failed(text) | CliError::Interrupted(text) => {
                text.trim_end().to_string()
            }
            CliError::Negative | CliError::Closed => String::new(),
        }
    }

    /// Tells the user, and gives the exit code.
    pub(crate) fn report(self) -> ExitCode {
        let (text, code) = match self {
            CliError::Usage(text) => (format!("error: {text}\n\nFor more information, try '--help'.\n"), 2),
            CliError::Failed(text) => (format!("error: {}\n", text.trim_end()), 1),
            CliError::Interrupted(text) if text.is_empty() => return ExitCode::from(INTERRUPTED),
            CliError::Interrupted(text) => (format!("{text}\n"), INTERRUPTED),
            CliError::Negative => return ExitCode::from(1),
            CliError::Closed => return ExitCode::SUCCESS,
        };
        // If standard error is closed, the exit code has to do.
        super::terminal::say(&text);
        ExitCode::from(code)
    }
}

fn remedy(error: &io::Error) -> &'static str {
    match error.kind() {
        io::ErrorKind::NotFound => "; check the path",
        io::ErrorKind::PermissionDenied | io::ErrorKind::ReadOnlyFilesystem => {
            "; choose a place where you may write"
        }
        io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => "; make room on the disk",
        io::ErrorKind::FileTooLarge => {
            "; make room on the disk, or raise the limit on the size of files (`ulimit -f`)"
        }
        _ => "",
    }
}
