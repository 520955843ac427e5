//! Files that are wholly there or not at all, and words and numbers for people.

use std::fs::{self, File};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};

use vsonar::support::durable;
use vsonar::support::printable::{self, ShownPath as _, is_hidden};
use vsonar::support::temporary::{self, Access, TemporaryFile};

use super::CliError;
use super::exclusive::{self, Aside};
pub(crate) use super::terminal::{print, print_data, print_json, print_json_line, print_listing, say};

/// Puts a file in its place as a whole: it is written under a temporary name in the same folder, brought to the
/// disk and renamed. A device or a pipe is written to as it is.
pub(crate) fn write_file(path: &Path, bytes: &[u8]) -> Result<(), CliError> {
    // A link is followed, so that it is not replaced by what it should lead to.
    let path = &fs::canonicalize(path).unwrap_or_else(|_| path.to_path_buf());
    let written = match fs::metadata(path) {
        Ok(there) if !there.is_file() && !there.is_dir() => {
            fs::OpenOptions::new().write(true).open(path).and_then(|mut file| file.write_all(bytes))
        }
        _ => replace(path, bytes),
    };
    match written {
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Err(CliError::Closed),
        written => written.map_err(|error| CliError::file(path, "write the file", &error)),
    }
}

/// How much of a file is looked at to know it again, in bytes.
const START: u64 = 4096;

/// By what a file that a command made is known again.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Own {
    /// What it is, in words.
    pub(crate) what: &'static str,
    /// How it begins.
    pub(crate) begins: &'static str,
    /// What is near its beginning.
    pub(crate) holds: &'static str,
}

impl Own {
    /// Refuses a file that is there already and is something else: nobody wants his labels replaced by a report. To be
    /// asked before there is work that would be lost. What is no file, or empty, is written to.
    pub(crate) fn may_replace(self, path: &Path) -> Result<(), CliError> {
        // Looked at before it is opened: to open a pipe is to wait for who writes to it.
        if !fs::metadata(path).is_ok_and(|there| there.is_file() && there.len() > 0) {
            return Ok(());
        }
        let Ok(file) = File::open(path) else { return Ok(()) };
        let mut start = Vec::new();
        file.take(START)
            .read_to_end(&mut start)
            .map_err(|e| CliError::file(path, "read what is there", &e))?;
        let start = String::from_utf8_lossy(&start);
        if start.starts_with(self.begins) && start.contains(self.holds) {
            return Ok(());
        }
        let text = format!("{}: exists already, and is no {}; choose another name", path.shown(), self.what);
        Err(CliError::Failed(text))
    }

    /// Puts the file in its place, unless something else is there.
    pub(crate) fn write(self, path: &Path, text: &str) -> Result<(), CliError> {
        self.may_replace(path)?;
        write_file(path, text.as_bytes())
    }
}

fn replace(path: &Path, bytes: &[u8]) -> io::Result<()> {
    temporary::clear(path);
    written(path, bytes)?.replace(path)
}

/// A file that is written and on the disk, but not yet in its place.
fn written(path: &Path, bytes: &[u8]) -> io::Result<TemporaryFile> {
    let mut new = TemporaryFile::beside(path, &Access::Ordinary)?;
    new.file().write_all(bytes)?;
    durable::sync_file(new.file(), path)?;
    Ok(new)
}

/// Puts files into a folder, all of them or none: each is written under a temporary name, and only when all are there
/// are their places cleared and taken; if one cannot be, what stood there comes back. The folder is made if need be,
/// and one process at a time fills it. Without `force` none of them may be there already.
pub(crate) fn write_files(folder: &Path, files: &[(String, Vec<u8>)], force: bool) -> Result<(), CliError> {
    if folder.exists() && !folder.is_dir() {
        let text = format!("{}: is no folder; choose another `--out`", folder.shown());
        return Err(CliError::Failed(text));
    }
    let made: Vec<&Path> =
        folder.ancestors().take_while(|f| !f.as_os_str().is_empty() && !f.exists()).collect();
    let mut lock = None;
    let mut write = || -> Result<(), CliError> {
        lock = exclusive::hold(folder)?;
        let mut old = Vec::new();
        for (name, _) in files {
            let path = folder.join(name);
            if exclusive::is_replaced(&path, force)? {
                old.push(path);
            }
        }
        // Only who writes clears what a killed command has left: old files may be among it.
        temporary::clear_in(folder, |stem| files.iter().any(|(name, _)| name == stem));
        let mut all = Vec::new();
        for (name, bytes) in files {
            let path = folder.join(name);
            let new = written(&path, bytes).map_err(|e| CliError::file(&path, "write the file", &e))?;
            all.push((path, new));
        }
        // What stood there goes first: who is killed in between leaves gaps, never files of two programs.
        let (mut aside, mut placed) = (Aside::default(), Vec::new());
        let put = || {
            for path in old {
                aside.put(&path).map_err(|e| CliError::file(&path, "replace the file", &e))?;
            }
            for (path, new) in all {
                new.replace(&path).map_err(|e| CliError::file(&path, "write the file", &e))?;
                placed.push(path);
            }
            Ok(())
        };
        let put = put();
        if put.is_err() {
            placed.iter().for_each(|path| drop(fs::remove_file(path)));
            aside.put_back();
        }
        put
    };
    let done = write();
    if done.is_err() {
        // The failure that counts is the first one.
        for folder in made {
            let _ = fs::remove_dir(folder);
        }
    }
    drop(lock);
    done
}

/// The path as one word of a shell's command line, so that what is printed can be copied.
pub(crate) fn shell_word(path: &Path) -> String {
    let text = path.display().to_string();
    // Quotes do not keep a command from taking what begins with a dash for a flag.
    quoted(&if text.starts_with('-') { format!("./{text}") } else { text })
}

/// A flag with its value, of which one does not know what it begins with, as words of a shell's command line.
pub(crate) fn shell_flag(flag: &str, value: &str) -> String {
    let between = if value.starts_with('-') { "=" } else { " " };
    format!("{flag}{between}{}", quoted(value))
}

/// The text as it is, or between quotes if a shell would take it for something else.
fn quoted(text: &str) -> String {
    let plain = |c: char| c.is_alphanumeric() || "/._-+,:@%=".contains(c);
    let safe = !text.is_empty() && !text.starts_with('=') && text.chars().all(plain);
    if text.contains(is_hidden) {
        return format!("$'{}'", text.chars().map(ansi_c).collect::<String>());
    }
    if safe { text.to_string() } else { format!("'{}'", text.replace('\'', "'\\''")) }
}

/// A character between the quotes `$'` and `'` of bash, zsh and ksh.
fn ansi_c(c: char) -> String {
    match c {
        '\\' | '\'' => format!("\\{c}"),
        c if c.is_ascii() && is_hidden(c) => format!("\\x{:02x}", u32::from(c)),
        c if is_hidden(c) => format!("\\u{:04x}", u32::from(c)),
        c => c.to_string(),
    }
}

/// The path as it is shortest to type: from the current folder on, if it is in it.
pub(crate) fn from_here(path: &Path) -> PathBuf {
    let here = std::env::current_dir().ok();
    let below = here.and_then(|here| path.strip_prefix(here).ok().map(Path::to_path_buf));
    below.filter(|below| !below.as_os_str().is_empty()).unwrap_or_else(|| path.to_path_buf())
}

/// A share as a percentage with one decimal.
pub(crate) fn percent(share: f64) -> String {
    format!("{:.1} %", 100.0 * share)
}

/// A whole number with commas between its thousands.
pub(crate) fn grouped(number: u64) -> String {
    printable::grouped(&number.to_string())
}

/// A number and what it counts: `1 image`, `2 images`.
pub(crate) fn count(number: u64, noun: &str) -> String {
    format!("{} {noun}{}", grouped(number), if number == 1 { "" } else { "s" })
}

/// A time for people: `45 s`, `3 min 5 s`, `2 h 10 min`.
pub(crate) fn duration(seconds: f64) -> String {
    let whole = if seconds.is_finite() { seconds.max(0.0).round() as u64 } else { return "?".to_string() };
    match whole {
        0..60 => format!("{whole} s"),
        60..3600 => format!("{} min {} s", whole / 60, whole % 60),
        _ => format!("{} h {} min", whole / 3600, whole % 3600 / 60),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_for_people() {
        assert_eq!(
            [0, 999, 1000, 204_000, 1_234_567].map(grouped),
            ["0", "999", "1,000", "204,000", "1,234,567"]
        );
        assert_eq!(
            [0.4, 59.6, 3599.0, 7265.0].map(duration),
            ["0 s", "1 min 0 s", "59 min 59 s", "2 h 1 min"]
        );
        assert_eq!(duration(f64::INFINITY), "?");
        assert_eq!(
            (count(1, "case"), count(1200, "case")),
            ("1 case".to_string(), "1,200 cases".to_string())
        );
        assert_eq!(percent(0.98095), "98.1 %");
    }

    #[test]
    fn words_of_a_shell() {
        let word = |text: &str| shell_word(Path::new(text));
        assert_eq!(word("runs/a-1.gp"), "runs/a-1.gp");
        assert_eq!(word("my runs/it's"), r"'my runs/it'\''s'");
        assert_eq!([word("-x"), word("- x"), word("")], ["./-x", "'./- x'", "''"]);
        assert_eq!(word("a\nb'\u{1b}\u{202e}"), r"$'a\x0ab\'\x1b\u202e'");
        let flag = |value| shell_flag("--match", value);
        assert_eq!(flag("run_[AB]*"), "--match 'run_[AB]*'");
        assert_eq!([flag("-a"), flag("-*"), flag("=a")], ["--match=-a", "--match='-*'", "--match '=a'"]);
        assert_eq!(flag("it's {a,b}"), r"--match 'it'\''s {a,b}'");
    }

    #[test]
    fn files_are_replaced_as_a_whole() {
        let dir = tempfile::tempdir().expect("a temporary folder");
        let path = dir.path().join("file");
        write_file(&path, b"old").expect("writable");
        write_file(&path, b"new").expect("writable");
        assert_eq!(fs::read(&path).expect("there"), b"new");
        assert!(write_file(&dir.path().join("no/such"), b"").is_err());
        assert!(write_file(dir.path(), b"").is_err(), "a folder is not replaced");
        assert_eq!(fs::read_dir(dir.path()).expect("there").count(), 1, "nothing is left behind");
    }
}
