//! Files that are either wholly there or not at all.

use std::fs::{File, Metadata, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use super::temporary::{Access, TemporaryFile};
use super::warnings::{self, Lack};
use crate::support::printable::ShownPath as _;

/// A file or folder could not be read or written.
#[derive(Debug, thiserror::Error)]
#[error("{}: cannot {action}: {source}", path.shown())]
pub struct FileError {
    /// The file or folder.
    pub path: PathBuf,
    /// What was to be done with it.
    pub action: &'static str,
    /// Why it failed.
    pub source: io::Error,
}

/// Names the file and the action in an error of the system.
pub trait Naming<T> {
    /// The error, if there is one, with its context.
    ///
    /// # Errors
    /// The same.
    fn naming(self, path: &Path, action: &'static str) -> Result<T, FileError>;
}

impl<T> Naming<T> for io::Result<T> {
    fn naming(self, path: &Path, action: &'static str) -> Result<T, FileError> {
        self.map_err(|source| FileError { path: path.to_path_buf(), action, source })
    }
}

/// Whether a file that is replaced has reached the disk when the call returns.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sync {
    /// It has: neither a crash of the process nor of the machine brings back less.
    Now,
    /// It is whole whenever it is read, but a crash of the machine may bring back an older state.
    Later,
}

/// Replaces a file as a whole: written under a temporary name in the same folder, brought to the disk, renamed. On
/// failure the old file stays as it was.
///
/// # Errors
/// If the system refuses.
pub fn replace(path: &Path, bytes: &[u8], sync: Sync) -> Result<(), FileError> {
    put(path, bytes, sync, &Access::Ordinary).naming(path, "write the file")?;
    if sync == Sync::Now { sync_folder_of(path) } else { Ok(()) }
}

/// Replaces a file as a whole and brings it to the disk; `access` says who may read it, from its first byte on.
///
/// # Errors
/// If the system refuses.
pub fn replace_now(path: &Path, bytes: &[u8], access: &Access) -> io::Result<()> {
    put(path, bytes, Sync::Now, access)?;
    sync_folder_of(path).map_err(|error| error.source)
}

/// Without bringing the folder's names to the disk.
fn put(path: &Path, bytes: &[u8], sync: Sync, access: &Access) -> io::Result<()> {
    let mut new = TemporaryFile::beside(path, access)?;
    new.file().write_all(bytes)?;
    if sync == Sync::Now {
        sync_file(new.file(), path)?;
    }
    new.replace(path)
}

/// Brings the names in the folder that holds `path` to the disk.
///
/// # Errors
/// If the system fails to, unless the file system cannot do that at all.
pub fn sync_folder_of(path: &Path) -> Result<(), FileError> {
    let folder = match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    sync_path(folder)
}

/// Brings a file's content, or a folder's names, to the disk.
///
/// # Errors
/// If the system fails to, unless the file system cannot do that at all.
pub fn sync_path(path: &Path) -> Result<(), FileError> {
    if cfg!(windows) && path.is_dir() {
        // Folders cannot be opened there; renames are journaled.
        return Ok(());
    }
    File::open(path).and_then(|file| sync_file(&file, path)).naming(path, "bring to the disk")
}

/// Brings an open file to the disk; `path` is its name for a [warning](super::warnings) that the file system cannot.
///
/// # Errors
/// If the system fails to, unless the file system cannot do that at all.
pub fn sync_file(file: &File, path: &Path) -> io::Result<()> {
    match is_done(file.sync_all())? {
        true => {}
        false => warnings::note(Lack::Sync, path),
    }
    Ok(())
}

/// Whether what was written is on the disk; not where the file system cannot say.
fn is_done(answer: io::Result<()>) -> io::Result<bool> {
    match answer {
        Ok(()) => Ok(true),
        Err(error) if cannot_sync(&error) => Ok(false),
        Err(error) => Err(error),
    }
}

#[cfg(unix)]
fn cannot_sync(error: &io::Error) -> bool {
    use nix::libc::{EINVAL, ENOSYS, ENOTSUP, EOPNOTSUPP};
    // Two of them are the same on some systems.
    error.raw_os_error().is_some_and(|code| [EINVAL, ENOSYS, ENOTSUP, EOPNOTSUPP].contains(&code))
}

#[cfg(not(unix))]
fn cannot_sync(error: &io::Error) -> bool {
    error.kind() == io::ErrorKind::Unsupported
}

/// Adds a line to a file; on failure the file is cut back to what it was.
///
/// # Errors
/// If the system refuses.
pub fn append_line(path: &Path, line: &str) -> Result<(), FileError> {
    let append = || -> io::Result<()> {
        let mut file = OpenOptions::new().create(true).append(true).open(path)?;
        let before = file.metadata()?.len();
        let written = file.write_all(format!("{line}\n").as_bytes());
        if written.is_err() {
            let _ = file.set_len(before);
        }
        written
    };
    append().naming(path, "add a line")
}

/// Who may read a file that replaces another: as it was, or by default if there is none.
pub fn as_before(before: Option<Metadata>) -> Access {
    before.map_or(Access::Ordinary, Access::Like)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn a_failed_replacement_leaves_the_old_file() {
        let dir = tempfile::tempdir().expect("a temporary folder");
        let path = dir.path().join("file");
        replace(&path, b"old", Sync::Now).expect("writable");
        replace(&path, b"new", Sync::Later).expect("writable");
        assert_eq!(fs::read(&path).expect("there"), b"new");
        // A folder that is not empty is not replaced by a file.
        let folder = dir.path().join("folder");
        fs::create_dir_all(folder.join("inner")).expect("writable");
        let error = replace(&folder, b"new", Sync::Now).expect_err("in the way").to_string();
        assert!(error.contains("folder: cannot write the file"), "{error}");
        assert!(folder.join("inner").exists());
        assert_eq!(fs::read_dir(dir.path()).expect("there").count(), 2, "nothing is left behind");
    }

    #[cfg(unix)]
    #[test]
    fn a_private_file_replaces_what_was_open_to_all() {
        use std::os::unix::fs::{PermissionsExt, symlink};
        let dir = tempfile::tempdir().expect("a temporary folder");
        let (path, victim) = (dir.path().join("file"), dir.path().join("victim"));
        fs::write(&victim, "precious").expect("writable");
        symlink(&victim, &path).expect("a link");
        replace_now(&path, b"new", &Access::Private).expect("writable");
        assert_eq!(fs::read(&victim).expect("still there"), b"precious");
        let metadata = path.symlink_metadata().expect("there");
        assert!(metadata.is_file() && metadata.permissions().mode() & 0o777 == 0o600);
    }

    #[test]
    fn a_full_disk_is_named() {
        let full = Path::new("/dev/full");
        if full.exists() {
            let error = append_line(full, "line").expect_err("always full");
            assert_eq!(error.source.kind(), io::ErrorKind::StorageFull);
        }
    }

    #[cfg(unix)]
    #[test]
    fn a_file_system_that_cannot_sync_is_no_failure() {
        use nix::libc::{EDQUOT, EINVAL, EIO, ENOSPC, ENOSYS, ENOTSUP};
        let answer = |code| is_done(Err(io::Error::from_raw_os_error(code)));
        for code in [EINVAL, ENOTSUP, ENOSYS] {
            assert!(!answer(code).expect("it goes on"), "{code}");
        }
        for code in [EIO, ENOSPC, EDQUOT] {
            assert_eq!(answer(code).expect_err("a failure").raw_os_error(), Some(code));
        }
        assert!(is_done(Ok(())).expect("done"));
        // There is one on every such machine.
        if cfg!(target_os = "linux") {
            assert!(File::open("/proc").and_then(|folder| folder.sync_all()).is_err());
            sync_path(Path::new("/proc")).expect("it goes on");
        }
    }
}
