//! Reading JSON files that others wrote.

use std::path::Path;

use serde::de::DeserializeOwned;

use super::{ImportError, json};
use crate::support::bounded::Bounded;

/// Reads a file of at most so many bytes as JSON. Deep nesting is an error of the parser's.
pub(super) fn json<T: DeserializeOwned>(path: &Path, most: u64) -> Result<T, ImportError> {
    let bytes = Bounded::to(most).bytes(path).map_err(|e| ImportError::read(path, e))?;
    json::parse(&bytes).map_err(|source| ImportError::Json { path: path.into(), source })
}
