//! What the library warns of on the way.

use std::io::{self, Write};

use vsonar::support::warnings;

/// Tells of what a file system lacks, if anything has come up since the last call; each thing comes once.
pub(crate) fn print() {
    for text in warnings::take() {
        let shown: String = text.chars().map(|c| if c.is_control() { '?' } else { c }).collect();
        // Without standard error nobody is there to be warned.
        let _ = writeln!(io::stderr(), "note: {shown}");
    }
}
