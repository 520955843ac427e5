//! A folder of results.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use super::CliError;

/// A folder that appears complete or not at all: it is filled under another name beside its place.
#[derive(Debug)]
pub(crate) struct NewFolder {
    path: PathBuf,
    part: PathBuf,
    made: bool,
}

impl NewFolder {
    /// Plans a folder; nothing is written yet.
    pub(crate) fn check(path: &Path) -> Result<NewFolder, CliError> {
        let Some(leaf) = path.file_name() else {
            return Err(CliError::Failed(format!("{}: does not name a new folder", path.display())));
        };
        if path.symlink_metadata().is_ok() {
            let text =
                format!("{}: exists already and is never overwritten; choose another name", path.display());
            return Err(CliError::Failed(text));
        }
        let mut hidden = std::ffi::OsString::from(".");
        hidden.push(leaf);
        hidden.push(format!(".part-{}", std::process::id()));
        Ok(NewFolder { path: path.into(), part: path.with_file_name(hidden), made: false })
    }

    pub(crate) fn make(&mut self) -> Result<(), CliError> {
        fs::create_dir(&self.part).map_err(|e| CliError::file(&self.path, "make the folder", &e))?;
        self.made = true;
        Ok(())
    }

    pub(crate) fn write(&self, name: &str, bytes: &[u8]) -> Result<(), CliError> {
        let path = self.part.join(name);
        path.parent()
            .map_or(Ok(()), fs::create_dir_all)
            .and_then(|()| fs::write(&path, bytes))
            .map_err(|e| CliError::file(&self.path.join(name), "write the file", &e))
    }

    /// Where it is while it is filled.
    pub(crate) fn part(&self) -> &Path {
        &self.part
    }

    /// A file that is written bit by bit.
    pub(crate) fn create(&self, name: &str) -> Result<fs::File, CliError> {
        let created = fs::File::create(self.part.join(name));
        created.map_err(|e| CliError::file(&self.path.join(name), "write the file", &e))
    }

    /// Takes a file away again, if it is there.
    pub(crate) fn remove(&self, name: &str) {
        // What cannot be removed now goes with the folder, or stays.
        let _ = fs::remove_file(self.part.join(name));
    }

    /// A file in it that could not be written.
    pub(crate) fn cannot_write(&self, name: &str, error: &io::Error) -> CliError {
        CliError::file(&self.path.join(name), "write the file", error)
    }

    pub(crate) fn finish(mut self) -> Result<(), CliError> {
        let moved = match self.path.symlink_metadata() {
            Ok(_) => Err(io::Error::new(io::ErrorKind::AlreadyExists, "something of this name has appeared")),
            Err(_) => fs::rename(&self.part, &self.path),
        };
        self.made = moved.is_err();
        moved.map_err(|e| CliError::file(&self.path, "put the folder in its place", &e))
    }
}

impl Drop for NewFolder {
    fn drop(&mut self) {
        if self.made {
            // The error that brought us here is the one to report.
            let _ = fs::remove_dir_all(&self.part);
        }
    }
}
