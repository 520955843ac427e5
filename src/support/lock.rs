//! The lock of a folder: one process writes it at a time.

use std::fs::{File, OpenOptions, TryLockError};
use std::io;
use std::path::Path;

use super::bounded::ReadFault;
use super::warnings::{self, Lack};

/// Held while a run folder, or another that one process at a time is to write, is written. It is released when it is
/// dropped, and by the system when the process ends in whatever way.
///
/// Where the file system knows no locks, as some on a network, there is nothing to hold: the lock is had by everybody,
/// and a [warning](super::warnings) tells of it.
#[derive(Debug)]
pub struct Lock {
    _file: File,
}

/// What became of the attempt to lock a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Attempt {
    /// The lock is held from now on.
    Held,
    /// Another process, or another handle of this one, holds it.
    Taken,
    /// The file system knows no locks.
    Unknown,
}

impl Attempt {
    /// What the system's answer means.
    pub(super) fn of(answer: Result<(), TryLockError>) -> io::Result<Attempt> {
        match answer {
            Ok(()) => Ok(Attempt::Held),
            Err(TryLockError::WouldBlock) => Ok(Attempt::Taken),
            Err(TryLockError::Error(error)) if knows_no_locks(&error) => Ok(Attempt::Unknown),
            Err(TryLockError::Error(error)) => Err(error),
        }
    }
}

impl Lock {
    /// The name of the file that is locked. It stays behind, empty.
    pub const NAME: &str = "lock";

    /// Takes the lock of a folder; `None` if another process (or another run of this one) holds it.
    ///
    /// # Errors
    /// If the folder is not there or cannot be written.
    pub fn take(folder: &Path) -> io::Result<Option<Lock>> {
        Lock::take_file(&folder.join(Lock::NAME))
    }

    /// Takes the lock that is this file, which is made if it is not there; a link is not followed.
    ///
    /// # Errors
    /// If the file cannot be made or opened for writing, or is no regular file.
    pub fn take_file(path: &Path) -> io::Result<Option<Lock>> {
        Lock::take_by(path, File::try_lock)
    }

    fn take_by(
        path: &Path,
        lock: impl FnOnce(&File) -> Result<(), TryLockError>,
    ) -> io::Result<Option<Lock>> {
        if let Ok(there) = path.symlink_metadata().map(|there| there.file_type())
            && !there.is_file()
        {
            return Err(ReadFault::kind(there).into());
        }
        let mut options = OpenOptions::new();
        options.create(true).truncate(false).write(true);
        // Without waiting, should a pipe have come there since.
        #[cfg(unix)]
        std::os::unix::fs::OpenOptionsExt::custom_flags(
            &mut options,
            nix::libc::O_NOFOLLOW | nix::libc::O_NONBLOCK,
        );
        let file = options.open(path)?;
        match Attempt::of(lock(&file))? {
            Attempt::Taken => return Ok(None),
            Attempt::Held => {}
            Attempt::Unknown => warnings::note(Lack::Locks, path.parent().unwrap_or(path)),
        }
        Ok(Some(Lock { _file: file }))
    }
}

/// Whether an error says that there are no locks on this file system, as opposed to one that is held. So the build tool
/// of this language has it as well.
#[cfg(unix)]
fn knows_no_locks(error: &io::Error) -> bool {
    use nix::libc::{ENOLCK, ENOSYS, ENOTSUP, EOPNOTSUPP};
    // Two of them are the same on some systems.
    error.raw_os_error().is_some_and(|code| [ENOLCK, ENOSYS, ENOTSUP, EOPNOTSUPP].contains(&code))
}

#[cfg(not(unix))]
fn knows_no_locks(error: &io::Error) -> bool {
    error.kind() == io::ErrorKind::Unsupported
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_at_a_time() {
        let dir = tempfile::tempdir().expect("a temporary folder");
        let take = || Lock::take(dir.path()).expect("writable");
        let held = take().expect("free");
        assert!(take().is_none());
        drop(held);
        assert!(take().is_some());
    }

    #[cfg(unix)]
    #[test]
    fn without_locks_all_goes_on() {
        use nix::libc::{EACCES, EIO, ENOLCK, ENOSYS, ENOTSUP, EOPNOTSUPP};
        let dir = tempfile::tempdir().expect("a temporary folder");
        let path = dir.path().join(Lock::NAME);
        let with =
            |code| Lock::take_by(&path, |_| Err(TryLockError::Error(io::Error::from_raw_os_error(code))));
        for code in [ENOLCK, ENOSYS, ENOTSUP, EOPNOTSUPP] {
            assert!(with(code).expect("it goes on").is_some(), "{code}");
        }
        for code in [EACCES, EIO] {
            assert_eq!(with(code).expect_err("a failure").raw_os_error(), Some(code));
        }
        let taken = Lock::take_by(&path, |_| Err(TryLockError::WouldBlock));
        assert!(taken.expect("no failure").is_none(), "a lock that is held is no file system without locks");
    }

    #[cfg(unix)]
    #[test]
    fn a_link_is_not_followed() {
        let dir = tempfile::tempdir().expect("a temporary folder");
        let target = dir.path().join("target");
        std::os::unix::fs::symlink(&target, dir.path().join(Lock::NAME)).expect("a link");
        assert!(Lock::take(dir.path()).is_err() && !target.exists());
    }
}
