//! Values and texts as C spells them.

use std::fmt::Write;

/// The longest string literal that every C99 compiler takes, less some room.
const LONGEST: usize = 4000;

/// A binary32 constant. What has no plain decimal form (NaN, infinities, -0, subnormals, which not every compiler reads
/// exactly) is made from its bits by the function `PREFIX_float`.
pub(super) fn float(prefix: &str, value: f32) -> String {
    if !value.is_normal() && value.to_bits() != 0 {
        return format!("{prefix}_float(0x{:08x}u)", value.to_bits());
    }
    // The shortest decimal that reads back as the same binary32: at most nine digits.
    if value < 0.0 { format!("({value:?}f)") } else { format!("{value:?}f") }
}

/// A byte inside the quotes of a literal. A question mark is escaped so that no trigraph comes about.
fn escaped(byte: u8) -> String {
    match byte {
        b'\n' => "\\n".into(),
        b'"' | b'\\' | b'\'' | b'?' => format!("\\{}", char::from(byte)),
        b' '..=b'~' => char::from(byte).to_string(),
        _ => format!("\\{byte:03o}"),
    }
}

/// A text as one string literal.
pub(in crate::export) fn quoted(text: &str) -> String {
    format!("\"{}\"", text.bytes().map(escaped).collect::<String>())
}

/// What initialises an array of `char` with a text: string literals, or single characters where the text is longer
/// than a literal may be. Lines begin with `indent`.
pub(super) fn text(text: &str, indent: &str) -> String {
    let mut out = String::new();
    if text.len() > LONGEST {
        out.push('{');
        for (i, byte) in text.bytes().enumerate() {
            if i % 16 == 0 {
                let _ = write!(out, "\n{indent}");
            }
            let _ = write!(out, "'{}', ", escaped(byte));
        }
        let _ = write!(out, "0\n}}");
        return out;
    }
    if text.is_empty() {
        return "\"\"".into();
    }
    for line in text.split_inclusive('\n') {
        for piece in line.as_bytes().chunks(90) {
            let _ = write!(out, "\n{indent}\"");
            piece.iter().for_each(|&byte| out.push_str(&escaped(byte)));
            out.push('"');
        }
    }
    out
}

/// A text inside a comment, each line beginning with `indent`. Nothing in it ends or begins a comment, makes a
/// trigraph, or is invisible.
pub(in crate::export) fn comment(text: &str, indent: &str) -> String {
    let mut out = String::new();
    for line in text.lines() {
        let mut shown = String::new();
        for c in line.chars() {
            match c {
                '\t' => shown.push(' '),
                ' '..='~' => {
                    if matches!(
                        (shown.chars().next_back(), c),
                        (Some('*'), '/') | (Some('/'), '*') | (Some('?'), '?')
                    ) {
                        shown.push(' ');
                    }
                    shown.push(c);
                }
                _ => {
                    let _ = write!(shown, "<U+{:04X}>", u32::from(c));
                }
            }
        }
        let _ = writeln!(out, "{}", format!("{indent}{shown}").trim_end());
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers() {
        assert_eq!(float("p", 0.5), "0.5f");
        assert_eq!(float("p", -3.40282e38), "(-3.40282e38f)");
        assert_eq!(float("p", 0.0), "0.0f");
        assert_eq!(float("p", -0.0), "p_float(0x80000000u)");
        assert_eq!(float("p", f32::INFINITY), "p_float(0x7f800000u)");
        assert_eq!(float("p", 1e-45), "p_float(0x00000001u)");
    }

    #[test]
    fn texts() {
        assert_eq!(text("a\"b\\c??/é\nd", " "), "\n \"a\\\"b\\\\c\\?\\?/\\303\\251\\n\"\n \"d\"");
        assert_eq!(text("", " "), "\"\"");
        assert!(text(&"x".repeat(4001), " ").starts_with("{\n 'x', "));
    }

    #[test]
    fn comments_stay_open() {
        assert_eq!(
            comment("a */ b /* c */ ??/\nsécond", " * "),
            " * a * / b / * c * / ? ?/\n * s<U+00E9>cond\n"
        );
        assert!(!comment("**/ */* /*/ ???/", "").contains("*/"));
        assert!(!comment("**/ */* /*/ ???/", "").contains("/*"));
    }
}
