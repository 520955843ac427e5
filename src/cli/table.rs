//! Text tables, which fit the terminal they are printed on.
//!
//! A table is as wide as its cells. One that is wider than the terminal has its headings broken into lines, then the text
//! of its first columns; if that is not enough, it is folded: columns that do not fit follow in a block below, with the
//! first columns again.

use vsonar::support::printable;

use super::terminal::Look;
use super::wrap::{LongWord, width, wrap};

/// The gap between two columns, in cells.
const GAP: usize = 2;
/// The narrowest that a column of text is made to spare the table a fold, in cells.
const NARROW: usize = 12;

/// Rows of cells, printed in line.
#[derive(Debug, Clone)]
pub(crate) struct Table {
    /// How many columns keep to the left and are repeated where the table is folded.
    left: usize,
    /// The headings and the rows.
    rows: Vec<Vec<String>>,
    columns: usize,
}

impl Table {
    /// A table with these headings. Columns keep to the right, but for the first `left`.
    pub(crate) fn new(left: usize, headings: &[&str]) -> Table {
        let mut table = Table { left: left.min(headings.len()), rows: Vec::new(), columns: headings.len() };
        table.row(headings.iter().copied());
        table
    }

    /// Adds a row; missing cells are empty.
    pub(crate) fn row<S: AsRef<str>>(&mut self, cells: impl IntoIterator<Item = S>) {
        let mut row: Vec<String> =
            cells.into_iter().map(|cell| printable::line(cell.as_ref()).into_owned()).collect();
        row.resize(self.columns, String::new());
        self.rows.push(row);
    }

    /// The table in lines of at most `room` cells.
    fn fitted(&self, room: usize) -> String {
        let whole: Vec<usize> = (0..self.columns).map(|i| self.widest(i, width)).collect();
        if total(&whole) <= room {
            return self.block(&(0..self.columns).collect::<Vec<_>>(), &whole);
        }
        let mut widths: Vec<usize> = (0..self.columns).map(|i| self.least(i)).collect();
        if total(&widths) <= room {
            widen(&mut widths, &whole, room);
            return self.block(&(0..self.columns).collect::<Vec<_>>(), &widths);
        }
        self.folded(widths, &whole, room)
    }

    /// The table in blocks below each other, which all have the first columns.
    fn folded(&self, mut widths: Vec<usize>, whole: &[usize], room: usize) -> String {
        let left = self.left;
        // The first columns leave half of the room to the others, and each other fits beside them.
        let share = (room / 2 / left.max(1)).saturating_sub(GAP).max(1);
        widths[..left].iter_mut().for_each(|width| *width = (*width).min(share));
        let beside = room.saturating_sub(widths[..left].iter().map(|width| width + GAP).sum()).max(1);
        widths[left..].iter_mut().for_each(|width| *width = (*width).min(beside));
        let mut blocks: Vec<Vec<usize>> = Vec::new();
        let mut taken = 0;
        for (i, &width) in widths.iter().enumerate().skip(left) {
            match blocks.last_mut() {
                Some(block) if taken + GAP + width <= beside => {
                    block.push(i);
                    taken += GAP + width;
                }
                _ => {
                    blocks.push((0..left).chain([i]).collect());
                    taken = width;
                }
            }
        }
        let block = |columns: Vec<usize>| {
            let mut here: Vec<usize> = columns.iter().map(|&i| widths[i]).collect();
            let most: Vec<usize> = columns.iter().map(|&i| whole[i]).collect();
            widen(&mut here, &most, room);
            self.block(&columns, &here)
        };
        blocks.into_iter().map(block).collect::<Vec<_>>().join("\n")
    }

    /// The greatest measure of the cells of a column, its heading among them.
    fn widest(&self, column: usize, measure: impl Fn(&str) -> usize) -> usize {
        self.rows.iter().map(|row| measure(&row[column])).max().unwrap_or(0)
    }

    /// The least width that a column looks well in: its longest word, but numbers are not broken.
    fn least(&self, column: usize) -> usize {
        let word = |text: &str| text.split(' ').map(width).max().unwrap_or(0);
        if column < self.left {
            return self.widest(column, word).max(NARROW).min(self.widest(column, width));
        }
        let cells = self.rows.iter().skip(1).map(|row| width(&row[column])).max().unwrap_or(0);
        cells.max(word(&self.rows[0][column]))
    }

    /// Some of the columns, in these widths.
    fn block(&self, columns: &[usize], widths: &[usize]) -> String {
        let mut out = String::new();
        for (number, row) in self.rows.iter().enumerate() {
            let cells: Vec<Vec<String>> =
                columns.iter().zip(widths).map(|(&i, &width)| wrap(&row[i], width, LongWord::Cut)).collect();
            let height = cells.iter().map(Vec::len).max().unwrap_or(1);
            for i in 0..height {
                let mut line = String::new();
                for ((&column, &room), cell) in columns.iter().zip(widths).zip(&cells) {
                    // Headings stand on their columns.
                    let above = if number == 0 { height - cell.len() } else { 0 };
                    let text = i.checked_sub(above).and_then(|i| cell.get(i)).map_or("", String::as_str);
                    let space = " ".repeat(room.saturating_sub(width(text)));
                    let gap = if line.is_empty() && column == columns[0] { 0 } else { GAP };
                    line += &" ".repeat(gap);
                    line +=
                        &if column < self.left { format!("{text}{space}") } else { format!("{space}{text}") };
                }
                out += line.trim_end();
                out += "\n";
            }
        }
        out
    }
}

/// The width of a table whose columns have these.
fn total(widths: &[usize]) -> usize {
    widths.iter().sum::<usize>() + GAP * widths.len().saturating_sub(1)
}

/// Gives columns that were made narrow what room is left.
fn widen(widths: &mut [usize], whole: &[usize], room: usize) {
    let mut left = room.saturating_sub(total(widths));
    for (width, &whole) in widths.iter_mut().zip(whole) {
        let more = whole.saturating_sub(*width).min(left);
        *width += more;
        left -= more;
    }
}

impl std::fmt::Display for Table {
    /// In lines that fit the terminal, if standard output is one.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.fitted(Look::stdout().width.unwrap_or(usize::MAX)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_line_up() {
        let mut table = Table::new(1, &["", "cases", "µ"]);
        table.row(["all", "1,200", "ä"]);
        table.row(["a longer one", "7"]);
        table.row(["写真", "8", "9"]);
        let expected =
            "              cases  µ\nall           1,200  ä\na longer one      7\n写真              8  9\n";
        assert_eq!(table.fitted(usize::MAX), expected);
        assert_eq!(table.fitted(24), expected, "it just fits");
    }

    #[test]
    fn headings_are_broken_first() {
        let mut table = Table::new(1, &["", "metres per collision", "rows right"]);
        table.row(["program", "35.6", "93.1 %"]);
        let expected = "            metres\n               per    rows\n         collision   right\n\
                        program       35.6  93.1 %\n";
        assert_eq!(table.fitted(30).lines().count(), 3, "{}", table.fitted(30));
        assert_eq!(table.fitted(26), expected);
    }

    #[test]
    fn a_wide_table_is_folded_below_the_width() {
        let headings: Vec<String> = (0..12).map(|i| format!("heading {i}")).collect();
        let headings: Vec<&str> =
            std::iter::once("setting").chain(headings.iter().map(String::as_str)).collect();
        let mut table = Table::new(1, &headings);
        for name in ["default", "a setting with a long name of its own"] {
            table.row(std::iter::once(name.to_string()).chain((0..12).map(|i| format!("{i}2.5 to 9{i}.5"))));
        }
        for room in [40, 60, 80, 120, 500] {
            let text = table.fitted(room);
            assert!(text.lines().all(|line| width(line) <= room), "{room}:\n{text}");
            for i in 0..12 {
                assert!(text.contains(&format!("{i}2.5 to 9{i}.5")), "{room}, column {i}:\n{text}");
            }
            assert_eq!(text.matches("default").count(), text.split("\n\n").count(), "{room}:\n{text}");
        }
        assert!(!table.fitted(500).contains("\n\n"));
    }

    #[test]
    fn what_is_wider_than_the_terminal_is_cut() {
        let mut table = Table::new(1, &["image", "run"]);
        table.row(["a".repeat(50), "runs/".to_string() + &"b".repeat(60)]);
        let text = table.fitted(40);
        assert!(text.lines().all(|line| width(line) <= 40), "{text}");
        assert_eq!((text.matches('a').count() - 1, text.matches('b').count()), (50, 60), "{text}");
    }

    #[test]
    fn a_cell_is_one_line_whatever_is_in_it() {
        let mut table = Table::new(1, &["image", "cases"]);
        table.row(["evil\n\u{1b}[2Jall correct", "1"]);
        assert_eq!(
            table.fitted(usize::MAX),
            "image                       cases\nevil\\n\\u{1b}[2Jall correct      1\n"
        );
    }
}
