//! The terminal: the one place where text goes to standard output and standard error.
//!
//! Whatever hides in names and texts from outside is escaped here. On a terminal lines of prose, which are those that
//! do not begin with a space, are wrapped at its width; only then colours of our own are added.

use std::io::{self, IsTerminal, Write};

use terminal_size::{Width, terminal_size_of};
use vsonar::support::printable;

use super::CliError;
use super::progress::aside;
use super::wrap::{LongWord, wrap};

/// The narrowest width that text is laid out for, in cells.
const NARROWEST: usize = 20;

/// How a stream shows text.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Look {
    /// Cells in a line; none where it is no terminal, which has no limit.
    pub(crate) width: Option<usize>,
    colour: bool,
}

impl Look {
    /// The look of standard output.
    pub(crate) fn stdout() -> Look {
        let size = terminal_size_of(io::stdout());
        Look::of(io::stdout().is_terminal(), size.map(|(Width(width), _)| width))
    }

    /// The look of standard error.
    fn stderr() -> Look {
        let size = terminal_size_of(io::stderr());
        Look::of(io::stderr().is_terminal(), size.map(|(Width(width), _)| width))
    }

    fn of(terminal: bool, width: Option<u16>) -> Look {
        // https://no-color.org: set, and not empty.
        let refused = std::env::var_os("NO_COLOR").is_some_and(|value| !value.is_empty());
        let dumb = std::env::var_os("TERM").is_some_and(|term| term == "dumb");
        Look {
            width: width.filter(|_| terminal).map(|width| usize::from(width).max(NARROWEST)),
            colour: terminal && !refused && !dumb,
        }
    }
}

/// Whether the terminal shows more than ASCII.
pub(crate) fn has_unicode() -> bool {
    let set = |name| std::env::var(name).ok().filter(|value| !value.is_empty());
    let locale = ["LC_ALL", "LC_CTYPE", "LANG"].into_iter().find_map(set).unwrap_or_default().to_lowercase();
    cfg!(windows) || locale.contains("utf-8") || locale.contains("utf8")
}

/// Beginnings of lines that have a colour, as parameters of the sequence SGR of ECMA-48.
const LABELS: [(&str, &str); 5] =
    [("error:", "1;31"), ("warning:", "1;33"), ("Warning:", "1;33"), ("note:", "1;36"), ("Next:", "1")];

/// The text as it is written to a stream that looks so.
fn laid_out(text: &str, look: Look) -> String {
    let line = |line: &str| {
        let line = printable::line(line).into_owned();
        let lines = match look.width {
            Some(width) if !line.starts_with(' ') => wrap(&line, width, LongWord::Whole),
            _ => vec![line],
        };
        painted(lines.join("\n"), look)
    };
    text.split('\n').map(line).collect::<Vec<_>>().join("\n")
}

fn painted(line: String, look: Look) -> String {
    match LABELS.iter().find_map(|(label, colour)| Some((label, line.strip_prefix(label)?, colour))) {
        Some((label, rest, colour)) if look.colour => format!("\u{1b}[{colour}m{label}\u{1b}[0m{rest}"),
        _ => line,
    }
}

/// Writes text to standard output.
pub(crate) fn print(text: &str) -> Result<(), CliError> {
    write(&laid_out(text, Look::stdout()))
}

/// Writes a listing or a script to standard output, whose lines are not wrapped.
pub(crate) fn print_listing(text: &str) -> Result<(), CliError> {
    write(&printable::lines(text))
}

/// Writes a table for other programs to standard output: exactly as it is, unless somebody looks at it on a terminal.
pub(crate) fn print_data(text: &str) -> Result<(), CliError> {
    if io::stdout().is_terminal() { print_listing(text) } else { write(text) }
}

/// Writes a value to standard output as JSON.
pub(crate) fn print_json(value: &impl serde::Serialize) -> Result<(), CliError> {
    write(&printable::json(&format!("{}\n", serde_json::to_string_pretty(value)?)))
}

/// Writes a value to standard output as JSON on one line.
pub(crate) fn print_json_line(value: &impl serde::Serialize) -> Result<(), CliError> {
    write(&printable::json(&format!("{}\n", serde_json::to_string(value)?)))
}

fn write(text: &str) -> Result<(), CliError> {
    let written = aside(|| {
        let mut out = io::stdout().lock();
        out.write_all(text.as_bytes()).and_then(|()| out.flush())
    });
    written.map_err(|error| CliError::output(&error))
}

/// Says something on standard error, on lines of its own. If that is closed, nobody wants to know.
pub(crate) fn say(text: &str) {
    let text = laid_out(text.trim_end(), Look::stderr()) + "\n";
    let _ = aside(|| io::stderr().write_all(text.as_bytes()));
}

#[cfg(test)]
mod tests {
    use super::*;

    const PIPE: Look = Look { width: None, colour: false };

    #[test]
    fn what_hides_is_escaped_before_colours_are_added() {
        let evil = "error: a\u{1b}]0;x\u{7}\u{9b}31m\u{202e}b.png\n  kept\u{7f}\n";
        assert_eq!(
            laid_out(evil, PIPE),
            "error: a\\u{1b}]0;x\\u{7}\\u{9b}31m\\u{202e}b.png\n  kept\\u{7f}\n"
        );
        let coloured = laid_out(evil, Look { colour: true, ..PIPE });
        assert!(coloured.starts_with("\u{1b}[1;31merror:\u{1b}[0m a\\u{1b}]0;x"), "{coloured}");
        assert_eq!(coloured.matches('\u{1b}').count(), 2, "ours alone");
    }

    #[test]
    fn prose_is_wrapped_and_what_is_indented_is_not() {
        let text =
            "note: a line of prose that is too long\n  vsonar evolve --data a/very/long/path --holdout 20%\n";
        let narrow = Look { width: Some(20), colour: false };
        assert_eq!(
            laid_out(text, narrow),
            "note: a line of\nprose that is too\nlong\n  vsonar evolve --data a/very/long/path --holdout 20%\n"
        );
        assert_eq!(laid_out(text, PIPE), text);
    }
}
