//! Text tables: columns as wide as they need to be.

/// Which side the cells of a column keep to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Align {
    Left,
    Right,
}

/// Rows of cells, printed in line.
#[derive(Debug, Clone)]
pub(crate) struct Table {
    align: Vec<Align>,
    rows: Vec<Vec<String>>,
}

impl Table {
    /// A table with these headings. Columns keep to the right, but for the first `left`.
    pub(crate) fn new(left: usize, headings: &[&str]) -> Table {
        let align = |i| if i < left { Align::Left } else { Align::Right };
        Table {
            align: (0..headings.len()).map(align).collect(),
            rows: vec![headings.iter().map(|h| h.to_string()).collect()],
        }
    }

    /// Adds a row; missing cells are empty.
    pub(crate) fn row<S: Into<String>>(&mut self, cells: impl IntoIterator<Item = S>) {
        self.rows.push(cells.into_iter().map(Into::into).collect());
    }
}

impl std::fmt::Display for Table {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let cell = |row: &[String], i: usize| row.get(i).cloned().unwrap_or_default();
        let width = |i: usize| self.rows.iter().map(|row| cell(row, i).chars().count()).max().unwrap_or(0);
        let widths: Vec<usize> = (0..self.align.len()).map(width).collect();
        for row in &self.rows {
            let mut line = String::new();
            for (i, (&width, align)) in widths.iter().zip(&self.align).enumerate() {
                let gap = if i == 0 { "" } else { "  " };
                let cell = cell(row, i);
                line += &match align {
                    Align::Left => format!("{gap}{cell:<width$}"),
                    Align::Right => format!("{gap}{cell:>width$}"),
                };
            }
            writeln!(f, "{}", line.trim_end())?;
        }
        Ok(())
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
        let expected = "              cases  µ\nall           1,200  ä\na longer one      7\n";
        assert_eq!(table.to_string(), expected);
    }
}
