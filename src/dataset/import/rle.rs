//! Run lengths of the COCO format: pixels down the columns, alternately outside and inside a region.

use std::ops::Range;

/// The pixels of a region, in a picture of a certain size.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Runs {
    height: u64,
    /// Those inside, numbered down the columns from the upper left one; ascending, none empty.
    inside: Vec<Range<u64>>,
}

/// Why run lengths make no region.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum RunsError {
    /// They are of more or fewer pixels than the picture has.
    #[error("the run lengths are of {}{sum} pixels, and {width}x{height} are {}; the file is damaged, export it anew",
        least(.at_least), width * height)]
    Sum {
        /// Pixels in all.
        sum: u64,
        /// Whether there are more, which were not counted.
        at_least: bool,
        /// Width of the picture in pixels.
        width: u64,
        /// Height of the picture in pixels.
        height: u64,
    },
    /// The text form has a character that does not occur in it, ends within a number, or has a run below 0.
    #[error(
        "the run lengths are not in COCO's text form, at character {0}; the file is damaged, export it anew"
    )]
    Text(usize),
}

const fn least(more: &bool) -> &'static str {
    if *more { "at least " } else { "" }
}

impl Runs {
    /// Runs of so many pixels, the first one outside, in a picture of this size, which is below 2^32 each way.
    ///
    /// # Errors
    /// If they are not of as many pixels as the picture has.
    pub fn new(counts: &[u64], (width, height): (u32, u32)) -> Result<Runs, RunsError> {
        let (width, height) = (u64::from(width), u64::from(height));
        let (mut at, mut inside) = (0u64, Vec::new());
        for (i, &count) in counts.iter().enumerate() {
            let next = at.saturating_add(count);
            if next > width * height {
                return Err(RunsError::Sum { sum: next, at_least: i + 1 < counts.len(), width, height });
            }
            if i % 2 == 1 && count > 0 {
                inside.push(at..next);
            }
            at = next;
        }
        match at == width * height {
            true => Ok(Runs { height, inside }),
            false => Err(RunsError::Sum { sum: at, at_least: false, width, height }),
        }
    }

    /// The same from COCO's text form: each number in groups of five bits, the lowest first, as characters from `0` on, with
    /// 32 in all but the last group and the sign in the last one's highest bit; from the fourth number on the difference to
    /// the one before the last.
    ///
    /// # Errors
    /// If the text is not of this form, and as [`Runs::new`].
    pub fn from_text(text: &str, size: (u32, u32)) -> Result<Runs, RunsError> {
        let mut counts: Vec<u64> = Vec::new();
        let (mut number, mut bits) = (0i64, 0u32);
        for (i, byte) in text.bytes().enumerate() {
            let wrong = RunsError::Text(i + 1);
            let group = byte.checked_sub(b'0').filter(|&group| group < 64).ok_or(wrong.clone())?;
            // No length of a run takes more.
            if bits > 50 {
                return Err(wrong);
            }
            number |= i64::from(group & 31) << bits;
            bits += 5;
            if group & 32 != 0 {
                continue;
            }
            if group & 16 != 0 {
                number |= -1 << bits;
            }
            if counts.len() > 2 {
                number += counts[counts.len() - 2] as i64;
            }
            counts.push(u64::try_from(number).map_err(|_| wrong)?);
            (number, bits) = (0, 0);
        }
        if bits > 0 {
            return Err(RunsError::Text(text.len()));
        }
        Runs::new(&counts, size)
    }

    /// Calls `each` with the rows of every run in a column of the picture.
    pub(super) fn in_column(&self, x: u32, mut each: impl FnMut(Range<usize>)) {
        let column = u64::from(x) * self.height..(u64::from(x) + 1) * self.height;
        let first = self.inside.partition_point(|run| run.end <= column.start);
        for run in self.inside[first..].iter().take_while(|run| run.start < column.end) {
            let (from, to) = (run.start.max(column.start), run.end.min(column.end));
            each((from - column.start) as usize..(to - column.start) as usize);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pixels(runs: &Runs, width: u32, height: usize) -> Vec<Vec<bool>> {
        let mut columns = vec![vec![false; height]; width as usize];
        for (x, column) in columns.iter_mut().enumerate() {
            runs.in_column(x as u32, |rows| column[rows].fill(true));
        }
        columns
    }

    /// COCO's text form, written from its definition.
    fn text(counts: &[u64]) -> String {
        let mut text = String::new();
        for (i, &count) in counts.iter().enumerate() {
            let mut number = count as i64 - if i > 2 { counts[i - 2] as i64 } else { 0 };
            loop {
                let group = number & 31;
                number >>= 5;
                let last = number == if group & 16 != 0 { -1 } else { 0 };
                text.push(char::from(b'0' + (group | if last { 0 } else { 32 }) as u8));
                if last {
                    break;
                }
            }
        }
        text
    }

    #[test]
    fn runs_go_down_the_columns() {
        let runs = Runs::new(&[2, 5, 1, 1], (3, 3)).expect("nine pixels");
        assert_eq!(pixels(&runs, 3, 3), [[false, false, true], [true, true, true], [true, false, true]]);
        let all = Runs::new(&[0, 9], (3, 3)).expect("nine pixels");
        assert!(pixels(&all, 3, 3).concat().iter().all(|&inside| inside));
        let none = Runs::new(&[9], (3, 3)).expect("nine pixels");
        assert!(pixels(&none, 3, 3).concat().iter().all(|&inside| !inside));
        let empty = Runs::new(&[4, 0, 5], (3, 3)).expect("nine pixels");
        assert_eq!(pixels(&empty, 3, 3), pixels(&none, 3, 3));
    }

    #[test]
    fn text_and_numbers_say_the_same() {
        // The text that pycocotools writes for a 9 x 10 mask of these runs, among them numbers of two groups and below 0.
        assert_eq!(text(&[6, 1, 40, 4, 5, 4, 5, 4, 21]), "61X13mN000`0");
        for counts in [&[6u64, 1, 40, 4, 5, 4, 5, 4, 21][..], &[0, 90], &[90], &[1, 1, 1, 1, 80, 6]] {
            let runs = Runs::new(counts, (9, 10)).expect("ninety pixels");
            assert_eq!(Runs::from_text(&text(counts), (9, 10)), Ok(runs));
        }
        let large = [1_000_000u64, 3, 70_000_000, 5, 2, 28_999_990];
        assert!(Runs::from_text(&text(&large), (10_000, 10_000)).is_ok());
    }

    #[test]
    fn what_is_no_region_is_refused() {
        for counts in [&[][..], &[8], &[10], &[u64::MAX, u64::MAX], &[4, u64::MAX, 5], &[3, 3, 3, 3]] {
            assert!(matches!(Runs::new(counts, (3, 3)), Err(RunsError::Sum { .. })), "{counts:?}");
        }
        let said = Runs::new(&[4, 7, 5], (3, 3)).expect_err("too many").to_string();
        assert!(said.contains("at least 11 pixels") && said.contains("3x3 are 9"), "{said}");
        // Foreign characters, an unfinished number, one of too many groups, a run below 0.
        for (text, at) in [
            ("9/", 2),
            ("9 ", 2),
            ("é", 1),
            ("9p", 2),
            ("5X", 2),
            ("PPPPPPPPPPPPPPP0", 12),
            ("O", 1),
            ("11OO", 3),
        ] {
            assert_eq!(Runs::from_text(text, (3, 3)), Err(RunsError::Text(at)), "{text}");
        }
        assert!(matches!(Runs::from_text("", (3, 3)), Err(RunsError::Sum { sum: 0, .. })));
    }
}
