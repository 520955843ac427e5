//! What the library warns of on the way.

use vsonar::support::{printable, warnings};

use super::output::say;

/// Tells of what a file system lacks, if anything has come up since the last call; each thing comes once.
pub(crate) fn print() {
    warnings::take().iter().for_each(|text| say(&format!("note: {}", printable::line(text))));
}
