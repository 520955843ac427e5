//! Text in lines of a given width, broken between words.

use unicode_width::UnicodeWidthStr;

/// A word that is longer than a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum LongWord {
    /// Sticks out, so that it can be copied.
    Whole,
    /// Is cut where the line ends, so that nothing sticks out.
    Cut,
}

/// Cells of a terminal that the text takes.
pub(crate) fn width(text: &str) -> usize {
    UnicodeWidthStr::width(text)
}

/// The text in lines of at most `room` cells; at least one line. Spaces at the ends of lines are left out.
pub(crate) fn wrap(text: &str, room: usize, long: LongWord) -> Vec<String> {
    let mut lines = Vec::new();
    let mut line = String::new();
    for word in text.split_inclusive(' ') {
        if !line.is_empty() && width(&line) + width(word.trim_end()) > room {
            lines.push(std::mem::take(&mut line));
        }
        line += word;
        while long == LongWord::Cut && width(line.trim_end()) > room {
            let fits = fitting(&line, room);
            if fits == line.len() {
                break;
            }
            let rest = line.split_off(fits);
            lines.push(std::mem::replace(&mut line, rest));
        }
    }
    lines.push(line);
    lines.iter().map(|line| line.trim_end().to_string()).collect()
}

/// Bytes of the longest beginning of at most `room` cells; at least one character.
fn fitting(text: &str, room: usize) -> usize {
    let ends = text.char_indices().map(|(i, c)| i + c.len_utf8());
    let mut fits = ends.clone().take_while(|&end| width(&text[..end]) <= room);
    fits.by_ref().last().or_else(|| ends.clone().next()).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_break_between_words() {
        let text = "the floor to beat, within 10 rows";
        assert_eq!(wrap(text, 12, LongWord::Whole), ["the floor to", "beat, within", "10 rows"]);
        assert_eq!(wrap(text, 80, LongWord::Whole), [text]);
        assert_eq!(wrap("", 5, LongWord::Cut), [""]);
        assert_eq!(wrap("a  b", 80, LongWord::Whole), ["a  b"], "spaces in a line stay");
    }

    #[test]
    fn long_words_stick_out_or_are_cut() {
        let text = "see runs/a-long-name now";
        assert_eq!(wrap(text, 8, LongWord::Whole), ["see", "runs/a-long-name", "now"]);
        assert_eq!(wrap(text, 8, LongWord::Cut), ["see", "runs/a-l", "ong-name", "now"]);
        assert_eq!(wrap("写真写真", 5, LongWord::Cut), ["写真", "写真"], "two cells each");
        assert_eq!(wrap("写", 1, LongWord::Cut), ["写"], "an end is reached all the same");
    }
}
