//! Files that are either wholly there or not at all.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// A file or folder could not be read or written.
#[derive(Debug, thiserror::Error)]
#[error("{}: cannot {action}: {source}{}", path.display(), remedy(source))]
pub struct FileError {
    /// The file or folder.
    pub path: PathBuf,
    /// What was to be done with it.
    pub action: &'static str,
    /// Why it failed.
    pub source: io::Error,
}

fn remedy(error: &io::Error) -> &'static str {
    match error.kind() {
        io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded | io::ErrorKind::FileTooLarge => {
            "; the run is kept as of its last complete generation: make room on the disk, then go on with `--resume`"
        }
        io::ErrorKind::PermissionDenied | io::ErrorKind::ReadOnlyFilesystem => {
            "; choose a place that can be written: by `--out`, or, to go on with a run, by copying its folder there"
        }
        _ => "",
    }
}

/// Names the file and the action in an error of the system.
pub(super) trait Naming<T> {
    /// The error, if there is one, with its context.
    fn naming(self, path: &Path, action: &'static str) -> Result<T, FileError>;
}

impl<T> Naming<T> for io::Result<T> {
    fn naming(self, path: &Path, action: &'static str) -> Result<T, FileError> {
        self.map_err(|source| FileError { path: path.to_path_buf(), action, source })
    }
}

/// Whether a file that is replaced has reached the disk when the call returns.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Sync {
    /// It has: neither a crash of the process nor of the machine brings back less.
    Now,
    /// It is whole whenever it is read, but a crash of the machine may bring back an older state.
    Later,
}

/// The temporary name a file is written under before it takes its place.
fn temporary(path: &Path) -> PathBuf {
    let mut name = std::ffi::OsString::from(".");
    name.push(path.file_name().unwrap_or_default());
    name.push(".tmp");
    path.with_file_name(name)
}

/// Replaces a file as a whole: written under a temporary name in the same folder, brought to the disk, renamed.
/// On failure the old file stays as it was.
pub(super) fn replace(path: &Path, bytes: &[u8], sync: Sync) -> Result<(), FileError> {
    put(path, bytes, sync, None).naming(path, "write the file")?;
    if sync == Sync::Now { sync_folder_of(path) } else { Ok(()) }
}

/// The same for files that are not of a run, whose remedies are others; with these permissions, which it has from its
/// first byte on.
pub(crate) fn replace_now(path: &Path, bytes: &[u8], permissions: Option<fs::Permissions>) -> io::Result<()> {
    put(path, bytes, Sync::Now, permissions)?;
    sync_folder_of(path).map_err(|error| error.source)
}

/// Without bringing the folder's names to the disk.
fn put(path: &Path, bytes: &[u8], sync: Sync, permissions: Option<fs::Permissions>) -> io::Result<()> {
    let new = temporary(path);
    let written = write_new(&new, bytes, sync, permissions).and_then(|()| fs::rename(&new, path));
    if written.is_err() {
        // The failure that counts is the first one.
        let _ = fs::remove_file(&new);
    }
    written
}

fn write_new(path: &Path, bytes: &[u8], sync: Sync, permissions: Option<fs::Permissions>) -> io::Result<()> {
    // What an interrupted replacement has left, or a link that somebody has put there: it is removed, never followed.
    // What cannot be removed is in the way of the next line, which says so.
    let _ = fs::remove_file(path);
    let mut file = OpenOptions::new().write(true).create_new(true).open(path)?;
    if let Some(permissions) = permissions {
        file.set_permissions(permissions)?;
    }
    file.write_all(bytes)?;
    if sync == Sync::Now { file.sync_all() } else { Ok(()) }
}

/// Brings the names in the folder that holds `path` to the disk.
pub(super) fn sync_folder_of(path: &Path) -> Result<(), FileError> {
    let folder = match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    sync_path(folder)
}

/// Brings a file's content, or a folder's names, to the disk.
pub(super) fn sync_path(path: &Path) -> Result<(), FileError> {
    if cfg!(windows) && path.is_dir() {
        // Folders cannot be opened there; renames are journaled.
        return Ok(());
    }
    File::open(path).and_then(|file| file.sync_all()).naming(path, "bring to the disk")
}

/// Adds a line to a file; on failure the file is cut back to what it was.
pub(super) fn append_line(path: &Path, line: &str) -> Result<(), FileError> {
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

/// Removes what an interrupted [`replace`] may have left beside these files.
pub(super) fn remove_leftovers(paths: &[PathBuf]) {
    for path in paths {
        // Most often there is none; one that cannot be removed is overwritten by the next replacement.
        let _ = fs::remove_file(temporary(path));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failed_replacement_leaves_the_old_file() {
        let dir = tempfile::tempdir().expect("a temporary folder");
        let path = dir.path().join("file");
        replace(&path, b"old", Sync::Now).expect("writable");
        // A folder in the way of the temporary file makes writing fail.
        fs::create_dir(temporary(&path)).expect("writable");
        let error = replace(&path, b"new", Sync::Now).expect_err("in the way").to_string();
        assert!(error.contains("cannot write the file"), "{error}");
        assert_eq!(fs::read(&path).expect("still there"), b"old");
    }

    #[cfg(unix)]
    #[test]
    fn a_link_under_the_temporary_name_is_not_followed() {
        use std::os::unix::fs::{PermissionsExt, symlink};
        let dir = tempfile::tempdir().expect("a temporary folder");
        let (path, victim) = (dir.path().join("file"), dir.path().join("victim"));
        fs::write(&victim, "precious").expect("writable");
        for target in [victim.clone(), dir.path().join("none")] {
            symlink(&target, temporary(&path)).expect("a link");
            replace_now(&path, b"new", Some(fs::Permissions::from_mode(0o600))).expect("writable");
            assert_eq!(fs::read(&victim).expect("still there"), b"precious");
            assert!(!dir.path().join("none").exists());
            let metadata = path.symlink_metadata().expect("there");
            assert!(metadata.is_file() && metadata.permissions().mode() & 0o777 == 0o600);
        }
    }

    #[test]
    fn a_full_disk_is_named() {
        let full = Path::new("/dev/full");
        if full.exists() {
            let error = append_line(full, "line").expect_err("always full").to_string();
            assert!(error.contains("make room on the disk"), "{error}");
        }
    }
}
