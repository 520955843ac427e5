//! A page for a browser on this machine: taking a port, showing the address.

use std::process::{Command, Stdio};

use vsonar::web::Server;

use super::CliError;
use super::output::say;

/// A server on `--port`.
pub(crate) fn bind(port: u16) -> Result<Server, CliError> {
    Server::bind(port).map_err(|error| {
        CliError::Failed(format!(
            "--port: {port} of 127.0.0.1 cannot be had: {error}; choose another, or 0 for any"
        ))
    })
}

/// Shows the address in a browser; without one the printed address has to do.
pub(crate) fn open(address: &str) {
    let opener = if cfg!(target_os = "macos") { "open" } else { "xdg-open" };
    let mut command = Command::new(opener);
    command.arg(address).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    if let Err(error) = command.spawn() {
        say(&format!("note: --open: cannot start {opener}: {error}; open the address yourself"));
    }
}
