//! The lock of a folder: one process writes it at a time.

use std::fs::{File, OpenOptions, TryLockError};
use std::io;
use std::path::Path;

/// Held while a run folder (or another that one process at a time is to write) is written; released when dropped, and by the system when the process ends in
/// whatever way.
#[derive(Debug)]
pub struct Lock {
    _file: File,
}

impl Lock {
    /// The name of the file that is locked. It stays behind, empty.
    pub const NAME: &str = "lock";

    /// Takes the lock of a folder; `None` if another process (or another run of this one) holds it.
    ///
    /// # Errors
    /// If the folder is not there, cannot be written, or its file system knows no locks.
    pub fn take(folder: &Path) -> io::Result<Option<Lock>> {
        let file =
            OpenOptions::new().create(true).truncate(false).write(true).open(folder.join(Lock::NAME))?;
        match file.try_lock() {
            Ok(()) => Ok(Some(Lock { _file: file })),
            Err(TryLockError::WouldBlock) => Ok(None),
            Err(TryLockError::Error(error)) => Err(error),
        }
    }
}
