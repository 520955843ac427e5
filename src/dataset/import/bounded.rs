//! Reading JSON files that others wrote.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use serde::de::DeserializeOwned;

use super::ImportError;

/// Reads a file of at most so many bytes as JSON. Deep nesting is an error of the parser's.
pub(super) fn json<T: DeserializeOwned>(path: &Path, most: u64) -> Result<T, ImportError> {
    let mut bytes = Vec::new();
    File::open(path)
        .and_then(|file| file.take(most + 1).read_to_end(&mut bytes))
        .map_err(|e| ImportError::read(path, e))?;
    if bytes.len() as u64 > most {
        return Err(ImportError::TooLong { path: path.into(), most });
    }
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(&bytes);
    serde_json::from_slice(bytes).map_err(|source| ImportError::Json { path: path.into(), source })
}
