//! Text from outside, made safe to show.
//!
//! Names of files and texts in them may hold what a terminal takes for commands, a line break that fakes a message, or
//! an invisible character that turns the direction of writing. Such characters are shown escaped, as Rust writes
//! them: `\n`, `\u{1b}`, `\u{202e}`. All other text stays as it is.
//!
//! ```
//! use vsonar::support::printable;
//! assert_eq!(printable::line("a\u{1b}[2J\nb.png"), r"a\u{1b}[2J\nb.png");
//! assert_eq!(printable::lines("a\nb\u{202e}"), "a\nb\\u{202e}");
//! ```

use std::borrow::Cow;
use std::fmt::Write as _;
use std::path::Path;

/// Whether a character acts on the display instead of being seen: control characters (C0, DEL, C1), line and
/// paragraph separators, and overrides, embeddings and isolates of the direction of writing.
pub fn is_hidden(c: char) -> bool {
    c.is_control() || matches!(c, '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}

/// The text on one line: every hidden character is escaped, line breaks too.
pub fn line(text: &str) -> Cow<'_, str> {
    escaped(text, is_hidden, |c, out| out.extend(c.escape_default()))
}

/// A text of several lines: every hidden character but the line break is escaped.
pub fn lines(text: &str) -> Cow<'_, str> {
    escaped(text, |c| c != '\n' && is_hidden(c), |c, out| out.extend(c.escape_default()))
}

/// What messages show of a path.
pub trait ShownPath {
    /// The path on one line.
    fn shown(&self) -> String;
}

impl ShownPath for Path {
    fn shown(&self) -> String {
        line(&self.to_string_lossy()).into_owned()
    }
}

/// A JSON text with the same value, in which every hidden character but the line break is an escape of JSON.
pub fn json(text: &str) -> Cow<'_, str> {
    // All hidden characters have four digits. Writing to a string cannot fail.
    escaped(
        text,
        |c| c != '\n' && is_hidden(c),
        |c, out| {
            let _ = write!(out, "\\u{:04x}", u32::from(c));
        },
    )
}

/// Decimal digits with commas between the thousands.
pub fn grouped(digits: &str) -> String {
    let mut out = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            out.push(',');
        }
        out.push(digit);
    }
    out
}

fn escaped(text: &str, hidden: impl Fn(char) -> bool, escape: impl Fn(char, &mut String)) -> Cow<'_, str> {
    let Some(first) = text.find(&hidden) else { return Cow::Borrowed(text) };
    let mut out = String::with_capacity(text.len() + 16);
    out.push_str(&text[..first]);
    for c in text[first..].chars() {
        if hidden(c) { escape(c, &mut out) } else { out.push(c) }
    }
    Cow::Owned(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hidden_characters_are_escaped_and_no_others() {
        for (text, shown) in [
            ("\u{1b}[31mred", r"\u{1b}[31mred"),
            ("a\nb\tc\r", r"a\nb\tc\r"),
            ("\0\u{7f}", r"\u{0}\u{7f}"),
            ("\u{9b}31m", r"\u{9b}31m"),
            ("gpj.\u{202e}exe", r"gpj.\u{202e}exe"),
            ("\u{2066}x\u{2069}", r"\u{2066}x\u{2069}"),
            ("a\u{2028}b", r"a\u{2028}b"),
        ] {
            assert_eq!(line(text), shown);
        }
        for plain in ["", "photos/drive 1.png", "Büro-ä.png", "写真", "צילום", "a\\n", "🙂"] {
            assert!(matches!(line(plain), Cow::Borrowed(same) if same == plain));
        }
        assert_eq!(lines("a\nb\u{7}\n"), "a\nb\\u{7}\n");
        assert_eq!(Path::new("a\nb").shown(), r"a\nb");
        assert!(
            (0..=0x10_ffff).filter_map(char::from_u32).all(|c| !line(&c.to_string()).contains(is_hidden))
        );
    }

    #[test]
    fn json_keeps_its_value() {
        let value = serde_json::json!({ "a\u{7f}\u{9b}": ["\u{202e}x\n", "\u{1b}", "ä"] });
        for text in [value.to_string(), format!("{value:#}")] {
            let safe = json(&text);
            assert!(!safe.chars().any(|c| c != '\n' && is_hidden(c)), "{safe}");
            assert_eq!(serde_json::from_str::<serde_json::Value>(&safe).expect("JSON"), value);
        }
    }
}
