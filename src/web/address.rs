//! An address that stays the same when a server is started again.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use super::{Server, Token};
use crate::evolve::durable::replace_now;

/// Why a server could not have its old address.
#[derive(Debug, thiserror::Error)]
pub enum AddressError {
    /// The file cannot be read or written.
    #[error("{}: cannot {action}: {source}", .path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// What was to be done.
        action: &'static str,
        /// The system's words.
        source: io::Error,
    },
    /// The file holds something else.
    #[error("{}: does not hold an address of this kind; remove it, or choose another file", .0.display())]
    Content(PathBuf),
    /// Others may read the file.
    #[error("{}: others may read the address in it; `chmod 600` it, or remove it", .0.display())]
    Readable(PathBuf),
    /// The port cannot be had.
    #[error(
        "{}: port {port} of 127.0.0.1 cannot be had: {source}; end the command that uses the same file, or remove the \
         file for another port", .file.display()
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
    /// If the file holds no address, others may read it, or the port is taken.
    pub fn bind_again(file: &Path, port: u16) -> Result<Server, AddressError> {
        let failed = |action| move |source| AddressError::File { path: file.to_path_buf(), action, source };
        let taken = |port| move |source| AddressError::Port { file: file.to_path_buf(), port, source };
        match fs::read_to_string(file) {
            Ok(text) => {
                if !is_private(file).map_err(failed("examine the file"))? {
                    return Err(AddressError::Readable(file.to_path_buf()));
                }
                let (port, token) = parse(&text).ok_or_else(|| AddressError::Content(file.to_path_buf()))?;
                Server::with_token(port, token).map_err(taken(port))
            }
            Err(error) if error.kind() == io::ErrorKind::NotFound => {
                let server = Server::bind(port).map_err(taken(port))?;
                write(file, &server.address()).map_err(failed("write the file"))?;
                Ok(server)
            }
            Err(error) => Err(failed("read the file")(error)),
        }
    }
}

/// Port and token of an address.
fn parse(text: &str) -> Option<(u16, Token)> {
    let rest = text.trim().strip_prefix("http://127.0.0.1:")?.strip_suffix('/')?;
    let (port, token) = rest.split_once('/')?;
    Some((port.parse().ok()?, token.parse().ok()?))
}

fn write(file: &Path, address: &str) -> io::Result<()> {
    #[cfg(unix)]
    let private = Some(std::os::unix::fs::PermissionsExt::from_mode(0o600));
    #[cfg(not(unix))]
    let private = None;
    replace_now(file, format!("{address}\n").as_bytes(), private)
}

#[cfg(unix)]
fn is_private(file: &Path) -> io::Result<bool> {
    use std::os::unix::fs::PermissionsExt;
    Ok(fs::metadata(file)?.permissions().mode() & 0o077 == 0)
}

#[cfg(not(unix))]
fn is_private(_: &Path) -> io::Result<bool> {
    Ok(true)
}

#[cfg(test)]
mod tests {
    use super::*;

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
}
