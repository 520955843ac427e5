//! New files and folders beside their place.
//!
//! What is to appear as a whole is made under another name in the same folder first. That name holds 64 bits from the
//! system's random source and is created exclusively, so that nobody can have put a link there that would be written
//! through. While it is being filled it is locked; so what a process that was killed has left can be told from what
//! another is writing, and the next one of the same name removes it.

use std::ffi::{OsStr, OsString};
use std::fs::{self, File, Metadata, Permissions};
use std::io;
use std::path::{Path, PathBuf};

use tempfile::{Builder, NamedTempFile};

use super::lock::Attempt;

/// Digits of the random part of a name.
const DIGITS: usize = 16;
/// Bytes of a file's own name that are kept in the temporary one, which may have 255 of them.
const STEM: usize = 200;
/// Attempts before it is said that there is no free name; each is one in 2^64 to be taken by chance.
const ATTEMPTS: usize = 8;

/// What a temporary thing is, which tells how its name ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    File,
    Folder,
}

impl Kind {
    const fn ending(self) -> &'static str {
        match self {
            Kind::File => ".tmp",
            Kind::Folder => ".part",
        }
    }
}

/// Who may read a new file.
#[derive(Debug, Clone)]
pub enum Access {
    /// Whoever the process lets by default (the umask).
    Ordinary,
    /// Its owner alone, from the first byte on.
    Private,
    /// Whoever may read another file, which it is to replace; its owner alone until it has the group and the mode.
    Like(Metadata),
}

/// A new file that is not yet in its place. It is removed when it is dropped.
#[derive(Debug)]
pub struct TemporaryFile {
    file: NamedTempFile,
}

impl TemporaryFile {
    /// A file beside `path`, where it is to be put later.
    ///
    /// # Errors
    /// If `path` names no file, or the folder cannot be written.
    pub fn beside(path: &Path, access: &Access) -> io::Result<TemporaryFile> {
        let (folder, leaf) = place(path)?;
        let mut options = File::options();
        options.read(true).write(true).create_new(true);
        #[cfg(unix)]
        {
            let mode = if matches!(access, Access::Ordinary) { 0o666 } else { 0o600 };
            std::os::unix::fs::OpenOptionsExt::mode(&mut options, mode);
        }
        let file = claim(leaf, Kind::File, |name| {
            let made =
                Builder::new().prefix(name).rand_bytes(0).make_in(folder, |path| options.open(path))?;
            let is_ours = is_claimed(made.as_file(), made.path())?;
            Ok(is_ours.then_some(made))
        })?;
        if let Access::Like(other) = access {
            take_after(file.as_file(), other)?;
        }
        Ok(TemporaryFile { file })
    }

    /// The file, to be written.
    pub fn file(&mut self) -> &mut File {
        self.file.as_file_mut()
    }

    /// Where it is until it is put in its place.
    pub fn path(&self) -> &Path {
        self.file.path()
    }

    /// Puts the file in its place and replaces what is there. On failure it is removed.
    ///
    /// # Errors
    /// If the system refuses.
    pub fn replace(self, path: &Path) -> io::Result<()> {
        self.file.persist(path).map(drop).map_err(|error| error.error)
    }

    /// Puts the file in its place unless there is something.
    ///
    /// # Errors
    /// If there is something of that name, or the system refuses.
    pub fn place_new(self, path: &Path) -> io::Result<()> {
        self.file.persist_noclobber(path).map(drop).map_err(|error| error.error)
    }
}

/// A new folder that is not yet in its place. It is removed, with all that is in it, when it is dropped.
#[derive(Debug)]
pub struct TemporaryFolder {
    path: PathBuf,
    is_placed: bool,
    /// Locked, where that is possible.
    _handle: Option<File>,
}

impl TemporaryFolder {
    /// An empty folder beside `path`, where it is to be put later.
    ///
    /// # Errors
    /// If `path` names no folder, or that which it is in cannot be written.
    pub fn beside(path: &Path) -> io::Result<TemporaryFolder> {
        let (parent, leaf) = place(path)?;
        claim(leaf, Kind::Folder, |name| {
            let path = parent.join(name);
            fs::create_dir(&path)?;
            let mut folder = TemporaryFolder { path, is_placed: false, _handle: None };
            // Elsewhere than on Unix a folder cannot be opened.
            if cfg!(unix) {
                let handle = File::open(&folder.path)?;
                if !is_claimed(&handle, &folder.path)? {
                    return Ok(None);
                }
                folder._handle = Some(handle);
            }
            Ok(Some(folder))
        })
    }

    /// Where it is until it is put in its place.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Puts the folder in its place. On failure it is removed.
    ///
    /// # Errors
    /// If there is something of that name (an empty folder is replaced on some systems), or the system refuses.
    pub fn place(mut self, path: &Path) -> io::Result<()> {
        fs::rename(&self.path, path)?;
        self.is_placed = true;
        Ok(())
    }
}

impl Drop for TemporaryFolder {
    fn drop(&mut self) {
        if !self.is_placed {
            // What cannot be removed now is when the next one of this name is made.
            let _ = fs::remove_dir_all(&self.path);
        }
    }
}

/// Removes what processes that were killed have left of a file or folder that was to be put at `path`.
pub fn clear(path: &Path) {
    if let Ok((folder, leaf)) = place(path) {
        let own = stem(leaf);
        clear_in(folder, |stem| own.to_str() == Some(stem));
    }
}

/// Removes what processes that were killed have left in a folder, of the files and folders of these names (of which
/// the first 200 bytes are looked at). What a process still fills is left alone; so are names that are not UTF-8, and
/// everything on a file system that knows no locks, where leftovers cannot be told from what is being filled.
pub fn clear_in(folder: &Path, is_ours: impl Fn(&str) -> bool) {
    let Ok(entries) = fs::read_dir(folder) else { return };
    for entry in entries.flatten() {
        let name = entry.file_name();
        for kind in [Kind::File, Kind::Folder] {
            if stem_of(&name, kind).is_some_and(&is_ours) {
                // One that cannot be removed does no harm.
                let _ = remove(&entry.path(), kind);
            }
        }
    }
}

/// Removes a leftover, if it is of this kind and nobody fills it.
fn remove(path: &Path, kind: Kind) -> io::Result<()> {
    let there = path.symlink_metadata()?;
    if !(there.is_file() && kind == Kind::File || there.is_dir() && kind == Kind::Folder) {
        return Ok(());
    }
    let mut options = File::options();
    options.read(true).write(kind == Kind::File);
    #[cfg(unix)]
    {
        use nix::libc::{O_NOFOLLOW, O_NONBLOCK};
        std::os::unix::fs::OpenOptionsExt::custom_flags(&mut options, O_NOFOLLOW | O_NONBLOCK);
    }
    let handle = options.open(path)?;
    match (lock(&handle)?, kind) {
        (Attempt::Held, Kind::File) => fs::remove_file(path),
        (Attempt::Held, Kind::Folder) => fs::remove_dir_all(path),
        _ => Ok(()),
    }
}

/// The folder in which something is to be put, and its name there.
fn place(path: &Path) -> io::Result<(&Path, &OsStr)> {
    let no_name = || io::Error::new(io::ErrorKind::InvalidInput, "this does not name a file");
    let leaf = path.file_name().ok_or_else(no_name)?;
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    Ok((folder.unwrap_or(Path::new(".")), leaf))
}

/// The part of a name that is kept in the temporary one.
fn stem(leaf: &OsStr) -> OsString {
    match leaf.len() > STEM {
        false => leaf.to_os_string(),
        true => {
            let text = leaf.to_string_lossy();
            let end = (0..=STEM).rev().find(|&end| text.is_char_boundary(end)).unwrap_or(0);
            text[..end].into()
        }
    }
}

/// The part of a temporary name that is of the name to come: `NAME` of `.NAME.0123456789abcdef.tmp`.
fn stem_of(name: &OsStr, kind: Kind) -> Option<&str> {
    let rest = name.to_str()?.strip_prefix('.')?.strip_suffix(kind.ending())?;
    let (stem, digits) = rest.rsplit_once('.')?;
    let is_random = |b: u8| b.is_ascii_digit() || (b'a'..=b'f').contains(&b);
    (digits.len() == DIGITS && digits.bytes().all(is_random)).then_some(stem)
}

/// Makes something under a name that nobody has; `make` gives none if another process has removed it meanwhile.
fn claim<T>(leaf: &OsStr, kind: Kind, make: impl Fn(&OsStr) -> io::Result<Option<T>>) -> io::Result<T> {
    for _ in 0..ATTEMPTS {
        let random = getrandom::u64().map_err(|error| io::Error::other(error.to_string()))?;
        let mut name = OsString::from(".");
        name.push(stem(leaf));
        name.push(format!(".{random:016x}{}", kind.ending()));
        match make(&name) {
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
            Ok(None) => {}
            Ok(Some(made)) => return Ok(made),
            Err(error) => return Err(error),
        }
    }
    Err(io::Error::new(io::ErrorKind::AlreadyExists, "there is no free name for a temporary file"))
}

/// Locks what was just made, and says whether it is still there: between its making and its locking it may be taken
/// for a leftover.
fn is_claimed(handle: &File, path: &Path) -> io::Result<bool> {
    match lock(handle)? {
        Attempt::Taken => Ok(false),
        Attempt::Unknown => Ok(true),
        Attempt::Held => Ok(path.symlink_metadata().is_ok()),
    }
}

/// Tries to lock a file or folder. On some file systems only what is open for writing can be locked, which a folder
/// cannot be.
fn lock(handle: &File) -> io::Result<Attempt> {
    match Attempt::of(handle.try_lock()) {
        #[cfg(unix)]
        Err(error) if [Some(nix::libc::EBADF), Some(nix::libc::EINVAL)].contains(&error.raw_os_error()) => {
            Ok(Attempt::Unknown)
        }
        attempt => attempt,
    }
}

/// Gives a file the mode and the group of another. A group that cannot be given gets no rights, for they were meant
/// for another one.
#[cfg(unix)]
fn take_after(file: &File, other: &Metadata) -> io::Result<()> {
    use std::os::unix::fs::{MetadataExt, PermissionsExt, fchown};
    let mut mode = other.permissions().mode() & 0o777;
    if file.metadata()?.gid() != other.gid() && fchown(file, None, Some(other.gid())).is_err() {
        mode &= !0o070;
    }
    file.set_permissions(Permissions::from_mode(mode))
}

#[cfg(not(unix))]
fn take_after(file: &File, other: &Metadata) -> io::Result<()> {
    file.set_permissions(Permissions::clone(&other.permissions()))
}

#[cfg(test)]
mod tests;
