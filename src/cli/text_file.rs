//! Text files that are given, read up to a limit: a path may name an endless device.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

use super::CliError;

/// Reads a text of at most so many MiB; `what` it is goes into the messages, as in "the table". What is longer is
/// refused, for a text that is cut may well be one, and another.
pub(crate) fn read(path: &Path, what: &str, most: u64) -> Result<String, CliError> {
    let cannot = |e: io::Error| CliError::file(path, &format!("read {what}"), &e);
    let mut bytes = Vec::new();
    File::open(path).and_then(|file| file.take((most << 20) + 1).read_to_end(&mut bytes)).map_err(cannot)?;
    if bytes.len() as u64 > most << 20 {
        let text = format!(
            "{}: larger than {most} MiB, the most that is read of {what}; is it the right file?",
            path.display()
        );
        return Err(CliError::Failed(text));
    }
    String::from_utf8(bytes).map_err(|e| cannot(io::Error::new(io::ErrorKind::InvalidData, e.utf8_error())))
}
