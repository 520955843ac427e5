//! Files read up to a limit.
//!
//! ```
//! use vsonar::support::bounded::Bounded;
//!
//! const SETTINGS: Bounded = Bounded::to(16 << 20);
//! let dir = tempfile::tempdir()?;
//! let path = dir.path().join("settings.toml");
//! std::fs::write(&path, "seed = 7\n")?;
//! assert_eq!(SETTINGS.text(&path)?, "seed = 7\n");
//! let error = Bounded::to(4).text(&path).unwrap_err();
//! assert!(error.to_string().contains("larger than 4 bytes"));
//! assert!(SETTINGS.text(dir.path()).is_err(), "a folder is no file");
//! # Ok::<(), std::io::Error>(())
//! ```

use std::fmt;
use std::fs::{File, FileType, OpenOptions};
use std::io::{self, Read};
use std::path::Path;

/// A way of reading files: how much of one is read at most, and whether it may be a pipe.
///
/// Only regular files are read: a device may have no end, and whoever opens a pipe waits for its writer. What is
/// longer than the limit is an error, never cut, for what is cut may still make sense, and another one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Bounded {
    limit: u64,
    links: bool,
    pipes: bool,
}

/// Why a file was not read, as the cause in an [`io::Error`] of the kind [`io::ErrorKind::InvalidInput`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum ReadFault {
    /// It is longer than is read of such a file.
    #[error("it is larger than {}, the most that is read of such a file; is it the right one?", Size(*.0))]
    TooLong(u64),
    /// It is something else than a file.
    #[error("this is {0}; give a file")]
    NotAFile(&'static str),
}

impl ReadFault {
    /// For something of this kind, which is no regular file.
    pub(crate) fn kind(kind: FileType) -> ReadFault {
        ReadFault::NotAFile(name(kind))
    }
}

impl From<ReadFault> for io::Error {
    fn from(fault: ReadFault) -> io::Error {
        io::Error::new(io::ErrorKind::InvalidInput, fault)
    }
}

/// What an error in reading a file says, with a remedy: its own, or to check the path.
pub(crate) fn with_remedy(error: &io::Error) -> String {
    match error.get_ref().is_some_and(|cause| cause.is::<ReadFault>()) {
        true => error.to_string(),
        false => format!("{error}; check the path and the permissions"),
    }
}

impl Bounded {
    /// Reads regular files of at most so many bytes.
    pub const fn to(limit: u64) -> Bounded {
        Bounded { limit, links: true, pipes: false }
    }

    /// Reads pipes and devices as well, up to the limit: for what a user types, who may mean `/dev/stdin`. It may wait
    /// for who writes.
    pub const fn or_pipes(self) -> Bounded {
        Bounded { pipes: true, ..self }
    }

    /// Does not follow a link in the last part of a path.
    pub const fn without_links(self) -> Bounded {
        Bounded { links: false, ..self }
    }

    /// The file's content.
    ///
    /// # Errors
    /// If the system refuses, the file is longer than the limit, or it is no regular file and may not be a pipe.
    pub fn bytes(self, path: &Path) -> io::Result<Vec<u8>> {
        self.read(self.open(path)?)
    }

    /// The file's content as text.
    ///
    /// # Errors
    /// As [`Bounded::bytes`], and with the line if it is not UTF-8.
    pub fn text(self, path: &Path) -> io::Result<String> {
        let bytes = self.bytes(path)?;
        String::from_utf8(bytes).map_err(|error| {
            let valid = &error.as_bytes()[..error.utf8_error().valid_up_to()];
            let line = 1 + valid.iter().filter(|&&byte| byte == b'\n').count();
            io::Error::new(io::ErrorKind::InvalidData, format!("line {line} is not text in UTF-8"))
        })
    }

    /// Opens the file, without waiting unless it may be a pipe.
    ///
    /// # Errors
    /// If the system refuses, or it is no regular file and may not be a pipe.
    pub fn open(self, path: &Path) -> io::Result<File> {
        let mut options = OpenOptions::new();
        options.read(true);
        #[cfg(unix)]
        {
            use nix::libc::{O_NOCTTY, O_NOFOLLOW, O_NONBLOCK};
            let link = if self.links { 0 } else { O_NOFOLLOW };
            // To open a pipe is to wait for its writer; what it is can only be asked once it is open.
            let wait = if self.pipes { 0 } else { O_NONBLOCK };
            std::os::unix::fs::OpenOptionsExt::custom_flags(&mut options, O_NOCTTY | link | wait);
        }
        #[cfg(not(unix))]
        if !self.links && path.symlink_metadata()?.is_symlink() {
            return Err(ReadFault::kind(there.file_type()).into());
        }
        let file = options.open(path).map_err(|error| self.explain(path, error))?;
        let kind = file.metadata()?.file_type();
        match kind.is_file() || self.pipes && !kind.is_dir() {
            true => Ok(file),
            false => Err(ReadFault::kind(kind).into()),
        }
    }

    /// What is left of an open file.
    ///
    /// # Errors
    /// If the system refuses, or it is longer than the limit.
    pub fn read(self, file: File) -> io::Result<Vec<u8>> {
        let expected = file.metadata()?.len();
        if expected > self.limit {
            return Err(ReadFault::TooLong(self.limit).into());
        }
        let mut bytes = Vec::new();
        // A hint alone: a file may grow, and devices have no length.
        bytes.try_reserve_exact(usize::try_from(expected).unwrap_or(usize::MAX))?;
        file.take(self.limit.saturating_add(1)).read_to_end(&mut bytes)?;
        match bytes.len() as u64 > self.limit {
            true => Err(ReadFault::TooLong(self.limit).into()),
            false => Ok(bytes),
        }
    }

    /// An error in opening, in words that tell what is there.
    fn explain(self, path: &Path, error: io::Error) -> io::Error {
        match path.symlink_metadata() {
            Ok(there) if !self.links && there.is_symlink() => ReadFault::NotAFile("a link").into(),
            // Elsewhere than on Unix a folder cannot be opened; a socket nowhere.
            Ok(there)
                if !there.is_file()
                    && !there.is_symlink()
                    && error.kind() != io::ErrorKind::PermissionDenied =>
            {
                ReadFault::kind(there.file_type()).into()
            }
            _ => error,
        }
    }
}

/// A word for what is no regular file.
fn name(kind: FileType) -> &'static str {
    #[cfg(unix)]
    {
        use std::os::unix::fs::FileTypeExt;
        if kind.is_fifo() {
            return "a pipe";
        }
        if kind.is_socket() {
            return "a socket";
        }
    }
    match (kind.is_symlink(), kind.is_dir()) {
        (true, _) => "a link",
        (_, true) => "a folder",
        _ => "a device",
    }
}

/// A number of bytes in words.
struct Size(u64);

impl fmt::Display for Size {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            0..1024 => write!(f, "{} bytes", self.0),
            1024..0x10_0000 => write!(f, "{} KiB", self.0 >> 10),
            0x10_0000..0x4000_0000 => write!(f, "{} MiB", self.0 >> 20),
            _ => write!(f, "{} GiB", self.0 >> 30),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn the_limit_is_exact_and_named() {
        let dir = tempfile::tempdir().expect("a temporary folder");
        let path = dir.path().join("file");
        for (length, fits) in [(0, true), (2047, true), (2048, true), (2049, false), (100_000, false)] {
            fs::write(&path, "x".repeat(length)).expect("writable");
            let read = Bounded::to(2048).text(&path);
            match read {
                Ok(text) => assert!(fits && text.len() == length, "{length}"),
                Err(error) => assert!(!fits && error.to_string().contains("larger than 2 KiB"), "{error}"),
            }
        }
        // A file that takes no room on the disk, and much in memory.
        fs::File::options().write(true).open(&path).expect("there").set_len(1 << 42).expect("sparse");
        let error = Bounded::to(16 << 20).bytes(&path).expect_err("too long").to_string();
        assert!(error.contains("larger than 16 MiB"), "{error}");
    }

    #[test]
    fn what_is_no_text_is_told_with_its_line() {
        let dir = tempfile::tempdir().expect("a temporary folder");
        let path = dir.path().join("file");
        fs::write(&path, b"one\ntwo\n\xff").expect("writable");
        let error = Bounded::to(100).text(&path).expect_err("no text");
        assert_eq!(
            (error.kind(), error.to_string().as_str()),
            (io::ErrorKind::InvalidData, "line 3 is not text in UTF-8")
        );
        assert_eq!(Bounded::to(100).bytes(&path).expect("there").len(), 9);
        let kind = |path: &Path| Bounded::to(9).bytes(path).expect_err("nothing").kind();
        assert_eq!(kind(&dir.path().join("none")), io::ErrorKind::NotFound);
    }

    #[cfg(unix)]
    #[test]
    fn only_files_are_read_unless_pipes_are_meant() {
        let dir = tempfile::tempdir().expect("a temporary folder");
        let [pipe, socket, link] = ["pipe", "socket", "link"].map(|name| dir.path().join(name));
        let made = std::process::Command::new("mkfifo").arg(&pipe).status().expect("mkfifo is there");
        assert!(made.success());
        let _listener = std::os::unix::net::UnixListener::bind(&socket).expect("a socket");
        std::os::unix::fs::symlink("/dev/zero", &link).expect("a link");
        for (path, word) in [
            (&*pipe, "a pipe"),
            (&*socket, "a socket"),
            (dir.path(), "a folder"),
            (Path::new("/dev/zero"), "a device"),
            (&*link, "a device"),
        ] {
            let error = Bounded::to(100).bytes(path).expect_err("no file").to_string();
            assert!(error.contains(word), "{}: {error}", path.display());
        }
        let given = Bounded::to(100).or_pipes();
        let error = given.bytes(Path::new("/dev/zero")).expect_err("endless").to_string();
        assert!(error.contains("larger than 100 bytes"), "{error}");
        assert!(given.bytes(dir.path()).expect_err("a folder").to_string().contains("a folder"));
        assert_eq!(given.bytes(Path::new("/dev/null")).expect("empty"), b"");
        let writer = std::thread::spawn(move || fs::write(pipe, "through a pipe"));
        assert_eq!(given.text(&dir.path().join("pipe")).expect("written"), "through a pipe");
        writer.join().expect("no panic").expect("read");
    }

    #[cfg(unix)]
    #[test]
    fn links_are_followed_unless_they_are_not_to_be() {
        let dir = tempfile::tempdir().expect("a temporary folder");
        let [file, link, astray] = ["file", "link", "astray"].map(|name| dir.path().join(name));
        fs::write(&file, "text").expect("writable");
        std::os::unix::fs::symlink(&file, &link).expect("a link");
        std::os::unix::fs::symlink(dir.path().join("none"), &astray).expect("a link");
        assert_eq!(Bounded::to(9).text(&link).expect("followed"), "text");
        let strict = Bounded::to(9).without_links();
        assert_eq!(strict.text(&file).expect("no link"), "text");
        for path in [&link, &astray] {
            assert!(strict.text(path).expect_err("a link").to_string().contains("a link"));
        }
    }
}
