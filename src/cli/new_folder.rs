//! A folder of results.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use vsonar::support::temporary::{self, TemporaryFolder};

use super::CliError;
use vsonar::support::printable::ShownPath as _;

/// A folder that appears complete or not at all: it is filled under another name beside its place.
#[derive(Debug)]
pub(crate) struct NewFolder {
    path: PathBuf,
    part: Option<TemporaryFolder>,
}

impl NewFolder {
    /// Plans a folder; nothing is written yet.
    pub(crate) fn check(path: &Path) -> Result<NewFolder, CliError> {
        if path.file_name().is_none() {
            return Err(CliError::Failed(format!("{}: does not name a new folder", path.shown())));
        }
        if path.symlink_metadata().is_ok() {
            let text =
                format!("{}: exists already and is never overwritten; choose another name", path.shown());
            return Err(CliError::Failed(text));
        }
        Ok(NewFolder { path: path.into(), part: None })
    }

    /// Makes the folder under its other name, and removes what a process that was killed has left of it.
    pub(crate) fn make(&mut self) -> Result<(), CliError> {
        temporary::clear(&self.path);
        let part = TemporaryFolder::beside(&self.path);
        self.part = Some(part.map_err(|e| CliError::file(&self.path, "make the folder", &e))?);
        Ok(())
    }

    pub(crate) fn write(&self, name: &str, bytes: &[u8]) -> Result<(), CliError> {
        let path = self.part().join(name);
        path.parent()
            .map_or(Ok(()), fs::create_dir_all)
            .and_then(|()| fs::write(&path, bytes))
            .map_err(|e| CliError::file(&self.path.join(name), "write the file", &e))
    }

    /// Where it is while it is filled; its own place as long as it has not been made.
    pub(crate) fn part(&self) -> &Path {
        self.part.as_ref().map_or(&self.path, TemporaryFolder::path)
    }

    /// A file that is written bit by bit.
    pub(crate) fn create(&self, name: &str) -> Result<fs::File, CliError> {
        let created = fs::File::create(self.part().join(name));
        created.map_err(|e| CliError::file(&self.path.join(name), "write the file", &e))
    }

    /// Takes a file away again, if it is there.
    pub(crate) fn remove(&self, name: &str) {
        // What cannot be removed now goes with the folder, or stays.
        let _ = fs::remove_file(self.part().join(name));
    }

    /// A file in it that could not be written.
    pub(crate) fn cannot_write(&self, name: &str, error: &io::Error) -> CliError {
        CliError::file(&self.path.join(name), "write the file", error)
    }

    pub(crate) fn finish(self) -> Result<(), CliError> {
        let moved = match self.path.symlink_metadata() {
            Ok(_) => Err(io::Error::new(io::ErrorKind::AlreadyExists, "something of this name has appeared")),
            Err(_) => self.part.map_or(Ok(()), |part| part.place(&self.path)),
        };
        moved.map_err(|e| CliError::file(&self.path, "put the folder in its place", &e))
    }
}
