//! A folder that one command at a time puts files into, with files of others in it.

use std::fs::{self, File, TryLockError};
use std::io;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use vsonar::support::printable::ShownPath as _;
use vsonar::support::temporary::{Access, TemporaryFile};

use super::CliError;

/// Whether something stands at a path that is to be written, which may be replaced.
pub(super) fn is_replaced(path: &Path, force: bool) -> Result<bool, CliError> {
    let refused =
        |text: &str| Err(CliError::Failed(format!("{}: {text}, or choose another `--out`", path.shown())));
    if path.symlink_metadata().is_err() {
        return Ok(false);
    }
    match fs::metadata(path) {
        Ok(there) if there.is_dir() => refused("is a folder; remove it"),
        _ if !force => refused("exists already; `--force` replaces it"),
        Ok(there) if !there.is_file() => refused("is a device or a pipe; remove it"),
        // A link that leads nowhere is replaced, too.
        _ => Ok(true),
    }
}

/// What stood at some paths, out of the way under temporary names until this is dropped, and with it removed.
#[derive(Debug, Default)]
pub(super) struct Aside(Vec<(PathBuf, TemporaryFile)>);

impl Aside {
    /// Puts what stands at a path out of the way.
    pub(super) fn put(&mut self, path: &Path) -> io::Result<()> {
        let place = TemporaryFile::beside(path, &Access::Ordinary)?;
        fs::rename(path, place.path())?;
        self.0.push((path.to_path_buf(), place));
        Ok(())
    }

    /// Puts everything back. If not even this can be done, the failure that led here is still the one that counts.
    pub(super) fn put_back(self) {
        for (path, place) in self.0 {
            let _ = fs::rename(place.path(), path);
        }
    }
}

/// The longest time that one command fills a folder while another one waits.
const PATIENCE: Duration = Duration::from_secs(60);

/// Makes a folder if need be, and waits until no other process fills it; the folder is released when the file is
/// dropped. The lock is on the folder itself, so that nothing stays behind in it. Where a folder cannot be locked, no
/// process waits for another.
pub(super) fn hold(folder: &Path) -> Result<Option<File>, CliError> {
    let start = Instant::now();
    loop {
        fs::create_dir_all(folder).map_err(|e| CliError::file(folder, "make the folder", &e))?;
        let Ok(file) = File::open(folder) else { return Ok(None) };
        match file.try_lock() {
            // Unless who held it has taken it away again, because nothing came of it.
            Ok(()) if is_at(&file, folder) => return Ok(Some(file)),
            Err(TryLockError::Error(_)) => return Ok(None),
            Ok(()) | Err(TryLockError::WouldBlock) if start.elapsed() < PATIENCE => {
                std::thread::sleep(Duration::from_millis(5));
            }
            Ok(()) | Err(TryLockError::WouldBlock) => {
                let text = format!(
                    "{}: another command writes into this folder; wait until it has ended",
                    folder.shown()
                );
                return Err(CliError::Failed(text));
            }
        }
    }
}

/// Whether an open folder is still the one of this path.
fn is_at(open: &File, path: &Path) -> bool {
    #[cfg(unix)]
    {
        use std::os::unix::fs::MetadataExt;
        let place = |found: fs::Metadata| (found.dev(), found.ino());
        open.metadata().map(place).ok() == fs::metadata(path).map(place).ok()
    }
    #[cfg(not(unix))]
    {
        let _ = open;
        path.exists()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_stood_there_comes_back_or_goes() {
        let dir = tempfile::tempdir().expect("a temporary folder");
        let path = dir.path().join("a");
        let aside = || {
            let mut aside = Aside::default();
            fs::write(&path, "old").expect("writable");
            aside.put(&path).expect("writable");
            assert!(!path.exists());
            aside
        };
        aside().put_back();
        assert_eq!(fs::read(&path).expect("there"), b"old");
        drop(aside());
        assert_eq!(fs::read_dir(dir.path()).expect("there").count(), 0, "nothing is left behind");
    }

    #[test]
    #[cfg(unix)]
    fn a_folder_is_held_by_one_at_a_time() {
        let dir = tempfile::tempdir().expect("a temporary folder");
        let folder = dir.path().join("new/folder");
        let held = hold(&folder).expect("writable").expect("this file system has locks");
        assert!(matches!(File::open(&folder).expect("there").try_lock(), Err(TryLockError::WouldBlock)));
        let (sender, receiver) = std::sync::mpsc::channel();
        std::thread::scope(|scope| {
            scope.spawn(|| {
                let held = hold(&folder).expect("writable");
                sender.send(()).expect("somebody listens");
                assert!(is_at(&held.expect("a lock"), &folder));
            });
            assert!(receiver.try_recv().is_err(), "it waits");
            // Taken away by who held it, the folder is made again.
            fs::remove_dir(&folder).expect("empty");
            drop(held);
            receiver.recv().expect("it comes to an end");
        });
        assert_eq!(fs::read_dir(&folder).expect("there").count(), 0, "nothing is left behind");
    }
}
