//! Warnings about what a file system cannot do.
//!
//! The library goes on where a file system knows no locks or cannot bring files to the disk, as many on a network do
//! not. What that costs is noted here, each kind once in the life of the process, and a command that prints takes it.

use crate::support::printable::ShownPath as _;
use std::path::Path;
use std::sync::{Mutex, PoisonError};

/// What a file system lacks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Lack {
    /// It knows no locks.
    Locks,
    /// It cannot bring what is written to the disk at a given time.
    Sync,
}

/// The warnings of a process.
#[derive(Debug)]
struct Warnings {
    noted: Vec<Lack>,
    waiting: Vec<String>,
}

static WARNINGS: Mutex<Warnings> = Mutex::new(Warnings { noted: Vec::new(), waiting: Vec::new() });

impl Warnings {
    fn note(&mut self, lack: Lack, path: &Path) {
        if self.noted.contains(&lack) {
            return;
        }
        self.noted.push(lack);
        let consequence = match lack {
            Lack::Locks => {
                "the file system has no locks, so nothing keeps two commands from writing here at the same time; start \
                 one at a time"
            }
            Lack::Sync => {
                "the file system does not say when a file has reached the disk, so a crash of the machine may lose what \
                 was saved last"
            }
        };
        self.waiting.push(format!("{}: {consequence}", path.shown()));
    }
}

/// Notes that the file system of a file or folder lacks something.
pub(super) fn note(lack: Lack, path: &Path) {
    WARNINGS.lock().unwrap_or_else(PoisonError::into_inner).note(lack, path);
}

/// The warnings since the last call, as sentences for the user that begin with the file or folder.
pub fn take() -> Vec<String> {
    std::mem::take(&mut WARNINGS.lock().unwrap_or_else(PoisonError::into_inner).waiting)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_kind_is_told_once() {
        let mut warnings = Warnings { noted: Vec::new(), waiting: Vec::new() };
        for (lack, path) in [(Lack::Locks, "a"), (Lack::Sync, "b"), (Lack::Locks, "c"), (Lack::Sync, "a")] {
            warnings.note(lack, Path::new(path));
        }
        let [locks, sync] = &warnings.waiting[..] else { panic!("{:?}", warnings.waiting) };
        assert!(locks.starts_with("a: the file system has no locks"), "{locks}");
        assert!(sync.starts_with("b: the file system does not say"), "{sync}");
        warnings.waiting.clear();
        warnings.note(Lack::Locks, Path::new("d"));
        assert!(warnings.waiting.is_empty());
    }
}
