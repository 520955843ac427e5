//! Reading JSON files that others wrote.

use std::path::Path;

use serde::de::DeserializeOwned;

use super::{ImportError, json};
use crate::support::bounded::Bounded;

/// Reads a file of at most so many bytes as JSON. A file that is something else is an error with this remedy. Deep nesting
/// is an error of the parser's.
pub(super) fn json<T: DeserializeOwned>(path: &Path, most: u64, remedy: &str) -> Result<T, ImportError> {
    let bytes = Bounded::to(most).bytes(path).map_err(|e| ImportError::read(path, e))?;
    if let Some(problem) = json::foreign(&bytes, remedy) {
        return Err(ImportError::form(path, problem));
    }
    json::parse(&bytes).map_err(|source| ImportError::Json { path: path.into(), source })
}
