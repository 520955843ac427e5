//! The table of a calibration: points of the floor, where they are and where they are seen.
//!
//! ```
//! use vsonar::camera::points;
//!
//! let table = "column,row,ahead,left\n# the yardstick, from the left\n40,200,0.5,0.3\n160,201.5,0.5,\n";
//! let points = points::read(table, "points.csv")?;
//! assert_eq!((points[0].line, points[0].left), (3, Some(0.3)));
//! assert_eq!((points[1].row, points[1].left), (201.5, None));
//! # Ok::<(), vsonar::camera::points::TableError>(())
//! ```

use crate::csv_table::{CsvError, CsvReader};

/// A point of the floor, and the pixel that shows it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    /// Its line in the table, for messages.
    pub line: usize,
    /// Column of the pixel from the left edge, from 0; whole numbers are centres of pixels, fractions are welcome.
    pub column: f64,
    /// Row of the pixel from the top edge, from 0.
    pub row: f64,
    /// Metres ahead of the point under the lens.
    pub ahead: f64,
    /// Metres to the left of the camera's middle line, negative to the right; `None` if not measured.
    pub left: Option<f64>,
}

impl Point {
    /// How many measurements it is: two if it is known on the floor in both directions, else one.
    pub fn measurements(&self) -> usize {
        if self.left.is_some() { 2 } else { 1 }
    }
}

/// A table that cannot be read.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{file}:{line}: {problem}")]
pub struct TableError {
    /// Where the text comes from.
    pub file: String,
    /// Line, from 1.
    pub line: usize,
    /// What is wrong there, and the remedy.
    pub problem: String,
}

/// Metres that no floor in sight exceeds.
const FARTHEST: f64 = 10_000.0;
const NAMES: [&str; 4] = ["column", "row", "ahead", "left"];

/// The points of a table: values between commas, semicolons or tabs under the header `column,row,ahead,left`, in any
/// order. The column `left`, or any value in it, may be missing. Blank lines, and lines that begin with `#`, are passed
/// over; `file` names the table in errors.
///
/// # Errors
/// The first line that is not as above, or has a value that is not a number, not finite, or beyond 10 km.
pub fn read(text: &str, file: &str) -> Result<Vec<Point>, TableError> {
    let fault =
        |line: u64, problem: String| TableError { file: file.to_string(), line: line as usize, problem };
    let malformed = |e: CsvError| fault(e.line, e.problem);
    let mut rows = CsvReader::new(text.as_bytes()).map_err(malformed)?.with_comments();
    let Some(header) = rows.next().transpose().map_err(malformed)? else {
        return Err(fault(1, "the table is empty; begin it with the header `column,row,ahead,left`".into()));
    };
    let (at, names) = (header.line, header.texts());
    let mut places = [None; 4];
    for (i, name) in names.iter().enumerate() {
        let known = NAMES.iter().position(|n| n == name);
        let place = known.and_then(|known| places.get_mut(known)).filter(|place| place.is_none());
        let Some(place) = place else {
            let problem = format!(
                "`{}` has no place in the header, which names each of `column,row,ahead,left` once",
                name.escape_debug()
            );
            return Err(fault(at, problem));
        };
        *place = Some(i);
    }
    let missing = NAMES.iter().zip(places).take(3).find(|(_, place)| place.is_none());
    if let Some((name, _)) = missing {
        return Err(fault(at, format!("the header lacks `{name}`; it is `column,row,ahead,left`")));
    }

    let mut points = Vec::new();
    for row in rows {
        let row = row.map_err(malformed)?;
        let line = row.line;
        // A value that is not known may be left out at the end.
        let without_left = places[3] == Some(names.len() - 1) && row.len() + 1 == names.len();
        if row.len() != names.len() && !without_left {
            let problem = format!(
                "{} values where the header has {}; put commas between them, and write fractions with a point",
                row.len(),
                names.len()
            );
            return Err(fault(line, problem));
        }
        let number = |which: usize| -> Result<Option<f64>, TableError> {
            let value = places[which].map_or(Ok(""), |place| row.text(place)).map_err(malformed)?;
            if value.is_empty() {
                return Ok(None);
            }
            let number = value.parse::<f64>().ok().filter(|number| number.abs() <= FARTHEST.max(65_536.0));
            let number = number.filter(|number| which < 2 || number.abs() <= FARTHEST);
            number.map(Some).ok_or_else(|| {
                let unit = if which < 2 { "pixels" } else { "metres, at most 10,000" };
                let remedy = if value.contains(',') { "; write fractions with a point" } else { "" };
                let value = value.escape_debug();
                fault(line, format!("`{}` is `{value}`, not a number of {unit}{remedy}", NAMES[which]))
            })
        };
        let needed = |which: usize| {
            number(which)?
                .ok_or_else(|| fault(line, format!("`{}` is missing; only `left` may be", NAMES[which])))
        };
        let [column, row, ahead] = [needed(0)?, needed(1)?, needed(2)?];
        points.push(Point { line: line as usize, column, row, ahead, left: number(3)? });
    }
    if points.is_empty() {
        return Err(fault(at, "the table has a header and no points; give at least one".into()));
    }
    Ok(points)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_are_read() {
        let points =
            read("\u{feff} left , ahead,row,column\r\n\r\n0.1,2,3,4\r\n,1e0,-0.5,7\r\n", "t").expect("sound");
        let first = Point { line: 3, column: 4.0, row: 3.0, ahead: 2.0, left: Some(0.1) };
        assert_eq!(points, [first, Point { line: 4, column: 7.0, row: -0.5, ahead: 1.0, left: None }]);
        assert_eq!([points[0].measurements(), points[1].measurements()], [2, 1]);
        assert_eq!(read("column,row,ahead\n1,2,3", "t").expect("sound")[0].left, None);
        assert_eq!(read("column,row,ahead,left\n1,2,3", "t").expect("sound")[0].left, None);
    }

    #[test]
    fn quotes_semicolons_and_tabs_change_nothing() {
        let plain = "# by hand; twice, \"again\"\ncolumn,row,ahead,left\n40,200,0.5,0.3\n160,201.5,0.5,\n";
        let expected = read(plain, "t").expect("sound");
        for text in [
            plain.replace(',', ";"),
            plain.replace(',', "\t"),
            plain.replace("column,row", "\"column\", \"row\"").replace("40,200", "\"40\",\"200\""),
            plain.replace('\n', "\r\n").replace("40,", "40.0 ,"),
            format!("\u{feff}{plain},,,\n"),
        ] {
            assert_eq!(read(&text, "t"), Ok(expected.clone()), "{text}");
        }
    }

    #[test]
    fn errors_name_the_line() {
        for (text, line, said) in [
            ("", 1, "empty"),
            ("# nothing\n\n", 1, "empty"),
            ("\ncolumn,row\n1,2\n", 2, "lacks `ahead`"),
            ("column,row,ahead,left,colour\n", 1, "`colour` has no place"),
            ("column,row,ahead,row\n", 1, "`row` has no place"),
            ("column;row;ahead\n", 1, "no points"),
            ("column|row|ahead\n1|2|3\n", 1, "`column|row|ahead` has no place in the header"),
            (
                "column;row;ahead\n1;2;0,3\n",
                2,
                "`ahead` is `0,3`, not a number of metres, at most 10,000; write fractions",
            ),
            ("# a \"\ncolumn,row,ahead\n\"1,2,3\n4,5,6", 3, "a quote is opened and never closed"),
            ("column,row,ahead\n1,\"2\"5,3\n", 2, "after its closing quote"),
            ("column,row,ahead,left\n", 1, "no points"),
            ("column,row,ahead,left\n1,2,3,4\n\n1,2\n", 4, "2 values where the header has 4"),
            ("column,row,ahead,left\n1,2,3,4,5\n", 2, "5 values"),
            ("column,row,ahead,left\n1,two,3,4\n", 2, "`row` is `two`, not a number"),
            ("column,row,ahead,left\n1,,3,4\n", 2, "`row` is missing"),
            ("column,row,ahead,left\n1,2,nan,4\n", 2, "`ahead` is `nan`"),
            ("column,row,ahead,left\n1,2,3,inf\n", 2, "`left` is `inf`"),
            ("column,row,ahead,left\n1,2,12000,0\n", 2, "metres"),
            ("column,row,ahead,left\n1,2,\u{1b}[2J,0\n", 2, "\\u{1b}"),
        ] {
            let error = read(text, "t.csv").expect_err("unsound");
            assert_eq!(error.line, line, "{text}: {error}");
            assert!(error.to_string().starts_with(&format!("t.csv:{line}: ")), "{error}");
            assert!(error.to_string().contains(said), "{text}: {error}");
        }
    }
}
