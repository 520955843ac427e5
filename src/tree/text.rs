//! The text form of individuals, `.gp`: S-expressions with comments, an exact round trip.
//!
//! `(individual T1 T2)`, or `(individual T)` with one tree; a tree is `(iterate-up RECT COLUMN BODY)` or
//! `(iterate-down RECT COLUMN BODY)`. Leaves are bare, functions stand in parentheses, `;` begins a comment that
//! ends with the line, and nothing may follow the individual. A constant is a decimal number with an optional
//! sign and exponent, rounded once, to the nearest binary32; it is printed with the fewest digits that read back
//! the same.
//!
//! ```
//! use vsonar::tree::Individual;
//!
//! let individual: Individual = "
//!     (individual            ; the lowest row whose gradient exceeds 300
//!       (iterate-down 3x3 x-obstacle
//!         (if-le gradient 3e2 read-a (set-a y))))".parse()?;
//! assert_eq!(
//!     format!("{individual:#}"),
//!     "(individual (iterate-down 3x3 x-obstacle (if-le gradient 300 read-a (set-a y))))"
//! );
//! let error = "(individual (iterate-down 3x3 y (set-a y)))".parse::<Individual>().unwrap_err();
//! assert_eq!((error.at.line, error.at.column), (1, 31));
//! # Ok::<(), vsonar::tree::ParseError>(())
//! ```

use std::path::Path;

use serde::{Deserialize, Deserializer, Serialize, Serializer, de::Error};

use super::error::{ParseError, ProgramFileError};
use super::individual::Individual;
use super::parse;
use crate::support::bounded::Bounded;

/// Reads far more than the text of the largest trees. A program may come through a pipe.
const PROGRAM: Bounded = Bounded::to(64 << 20).or_pipes();

impl std::str::FromStr for Individual {
    type Err = ParseError;

    fn from_str(text: &str) -> Result<Individual, ParseError> {
        parse::individual(text)
    }
}

impl Individual {
    /// Reads an individual from a `.gp` file.
    ///
    /// # Errors
    /// If the file cannot be read, or is not the text of an individual; the message names the file and, for
    /// faults of the text, line and column.
    pub fn load(path: impl AsRef<Path>) -> Result<Individual, ProgramFileError> {
        Individual::load_with_text(path).map(|(individual, _)| individual)
    }

    /// The same with the file's whole text, in whose comments may stand where the individual comes from.
    ///
    /// # Errors
    /// As [`Individual::load`].
    pub fn load_with_text(path: impl AsRef<Path>) -> Result<(Individual, String), ProgramFileError> {
        let path = path.as_ref();
        let bytes =
            PROGRAM.bytes(path).map_err(|source| ProgramFileError::Read { path: path.into(), source })?;
        let text = String::from_utf8(bytes).map_err(|error| {
            let valid = &error.as_bytes()[..error.utf8_error().valid_up_to()];
            let line = 1 + valid.iter().filter(|&&b| b == b'\n').count();
            ProgramFileError::NotText { path: path.into(), line }
        })?;
        let individual =
            text.parse().map_err(|source| ProgramFileError::Parse { path: path.into(), source })?;
        Ok((individual, text))
    }
}

/// As text on one line.
impl Serialize for Individual {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(&format_args!("{self:#}"))
    }
}

impl<'de> Deserialize<'de> for Individual {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Individual, D::Error> {
        let text = std::borrow::Cow::<'de, str>::deserialize(deserializer)?;
        text.parse().map_err(D::Error::custom)
    }
}
