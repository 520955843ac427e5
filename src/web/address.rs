//! An address that stays the same when a server is started again.

use std::fs::Metadata;
use std::io;
use std::path::{Path, PathBuf};

use super::{Server, Token};
use crate::support::bounded::Bounded;
use crate::support::durable::replace_now;
use crate::support::printable::ShownPath as _;
use crate::support::temporary::{self, Access};

/// Reads the file of an address, which is a line. A link may lead to a file that others have put there.
const ADDRESS: Bounded = Bounded::to(4096).without_links();

/// Why a server could not have its old address.
#[derive(Debug, thiserror::Error)]
pub enum AddressError {
    /// The file cannot be read or written.
    #[error("{}: cannot {action}: {source}", .path.shown())]
    File {
        /// The file.
        path: PathBuf,
        /// What was to be done.
        action: &'static str,
        /// The system's words.
        source: io::Error,
    },
    /// The file holds something else.
    #[error("{}: does not hold an address of this kind; remove it, or choose another file", .0.shown())]
    Content(PathBuf),
    /// Others may read the file.
    #[error("{}: others may read the address in it; `chmod 600` it, or remove it", .0.shown())]
    Readable(PathBuf),
    /// It is somebody else's file, who knows the address in it.
    #[error("{}: belongs to another user, who knows the address in it; remove it, or choose another file", .0.shown())]
    Foreign(PathBuf),
    /// The port cannot be had.
    #[error(
        "{}: port {port} of 127.0.0.1 cannot be had: {source}; end the command that uses the same file, or remove the \
         file for another port", .file.shown()
    )]
    Port {
        /// The file.
        file: PathBuf,
        /// The port.
        port: u16,
        /// The system's words.
        source: io::Error,
    },
}

impl Server {
    /// The server of the address in this file, or, if there is no such file, a new one, whose address is written there
    /// for the owner alone to read. So a page that is open finds a server that was started again.
    ///
    /// # Errors
    /// If the file holds no address, is a link, others may read it or it is another user's, or the port is taken.
    pub fn bind_again(file: &Path, port: u16) -> Result<Server, AddressError> {
        let failed = |action| move |source| AddressError::File { path: file.to_path_buf(), action, source };
        let taken = |port| move |source| AddressError::Port { file: file.to_path_buf(), port, source };
        match ADDRESS.open(file) {
            Ok(open) => {
                // Asked of the file that is read, which another may replace meanwhile.
                check_owner(file, &open.metadata().map_err(failed("examine the file"))?)?;
                let bytes = ADDRESS.read(open).map_err(failed("read the file"))?;
                let (port, token) = parse(&bytes).ok_or_else(|| AddressError::Content(file.to_path_buf()))?;
                Server::with_token(port, token).map_err(taken(port))
            }
            Err(error) if error.kind() == io::ErrorKind::NotFound => {
                let server = Server::bind(port).map_err(taken(port))?;
                temporary::clear(file);
                replace_now(file, format!("{}\n", server.address()).as_bytes(), &Access::Private)
                    .map_err(failed("write the file"))?;
                Ok(server)
            }
            Err(error) => Err(failed("read the file")(error)),
        }
    }
}

/// Port and token of an address.
fn parse(bytes: &[u8]) -> Option<(u16, Token)> {
    let rest = str::from_utf8(bytes).ok()?.trim().strip_prefix("http://127.0.0.1:")?.strip_suffix('/')?;
    let (port, token) = rest.split_once('/')?;
    Some((port.parse().ok()?, token.parse().ok()?))
}

/// Refuses a file that is another user's, or that others may read.
#[cfg(unix)]
fn check_owner(file: &Path, metadata: &Metadata) -> Result<(), AddressError> {
    use std::os::unix::fs::MetadataExt;
    if metadata.uid() != nix::unistd::geteuid().as_raw() {
        return Err(AddressError::Foreign(file.to_path_buf()));
    }
    match metadata.mode() & 0o077 {
        0 => Ok(()),
        _ => Err(AddressError::Readable(file.to_path_buf())),
    }
}

#[cfg(not(unix))]
fn check_owner(_: &Path, _: &Metadata) -> Result<(), AddressError> {
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn the_same_address_again() {
        let dir = tempfile::tempdir().expect("a temporary folder");
        let file = dir.path().join("address");
        let first = Server::bind_again(&file, 0).expect("any port");
        let address = first.address();
        assert!(
            matches!(Server::bind_again(&file, 0), Err(AddressError::Port { port, .. }) if port == first.port())
        );
        let error = Server::bind_again(&file, 0).expect_err("taken").to_string();
        assert!(error.contains("address: port ") && error.contains("remove the file"), "{error}");
        drop(first);
        assert_eq!(Server::bind_again(&file, 0).expect("free again").address(), address);
        fs::write(&file, "http://127.0.0.1:80/x/").expect("writable");
        assert!(matches!(Server::bind_again(&file, 0), Err(AddressError::Content(_))));
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            fs::set_permissions(&file, fs::Permissions::from_mode(0o644)).expect("ours");
            assert!(matches!(Server::bind_again(&file, 0), Err(AddressError::Readable(_))));
        }
    }

    #[cfg(unix)]
    #[test]
    fn only_a_file_of_ones_own_is_believed() {
        use std::os::unix::fs::{MetadataExt, PermissionsExt, symlink};
        let dir = tempfile::tempdir().expect("a temporary folder");
        let [file, link, pipe] = ["address", "link", "pipe"].map(|name| dir.path().join(name));
        drop(Server::bind_again(&file, 0).expect("any port"));
        let there = file.symlink_metadata().expect("there");
        assert_eq!((there.is_file(), there.mode() & 0o777), (true, 0o600));
        symlink(&file, &link).expect("a link");
        let error = Server::bind_again(&link, 0).expect_err("a link").to_string();
        assert!(error.contains("link: cannot read the file: this is a link"), "{error}");
        // One that leads nowhere is not written through.
        fs::remove_file(&link).expect("there");
        symlink(dir.path().join("new"), &link).expect("a link");
        assert!(Server::bind_again(&link, 0).is_err() && !dir.path().join("new").exists());
        assert!(std::process::Command::new("mkfifo").arg(&pipe).status().expect("mkfifo is there").success());
        fs::set_permissions(&pipe, fs::Permissions::from_mode(0o600)).expect("ours");
        let error = Server::bind_again(&pipe, 0).expect_err("a pipe").to_string();
        assert!(error.contains("pipe: cannot read the file: this is a pipe"), "{error}");
        fs::write(&file, "x".repeat(5000)).expect("writable");
        let error = Server::bind_again(&file, 0).expect_err("too long").to_string();
        assert!(error.contains("larger than 4 KiB"), "{error}");
        // Who may give files away can try the file of somebody else.
        if std::os::unix::fs::chown(&file, Some(there.uid() + 1), None).is_ok() {
            let error = Server::bind_again(&file, 0).expect_err("not ours").to_string();
            assert!(error.contains("address: belongs to another user"), "{error}");
        }
    }
}
