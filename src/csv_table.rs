//! Tables of separated values, as spreadsheets, pandas and people write them: the one reader for all of them.
//!
//! Read is what RFC 4180 allows and what is common beyond it: fields in quotes, a byte order mark, every kind of line
//! end, spaces around fields, blank rows, and semicolons or tabs between the fields, as the header has them or a first
//! line `sep=;` declares them for Excel.
//!
//! ```
//! use vsonar::csv_table::{CsvReader, whole_number};
//!
//! let mut reader = CsvReader::new(b"\xef\xbb\xbfimage;x\r\n\"a;b.png\"; 10.0\r\n")?;
//! let header = reader.next().expect("a row")?;
//! assert_eq!((header.text(0), header.text(1)), (Ok("image"), Ok("x")));
//! let row = reader.next().expect("a row")?;
//! assert_eq!((row.line, row.text(0), whole_number(row.text(1)?)), (2, Ok("a;b.png"), Some(10)));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use std::borrow::Cow;
use std::ops::Range;

/// Bytes that may stand between fields, the usual one first.
const DELIMITERS: [u8; 3] = [b',', b';', b'\t'];

/// A row, or the whole text, that is not in the form of a table.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("line {line}: {problem}")]
pub struct CsvError {
    /// Line, from 1.
    pub line: u64,
    /// What is wrong there, and the remedy.
    pub problem: String,
}

/// The rows of a text, the header among them, without blank ones.
#[derive(Debug, Clone)]
pub struct CsvReader<'t> {
    text: &'t [u8],
    /// Byte of the text that is read next, and its line.
    at: usize,
    line: u64,
    delimiter: u8,
    /// Whether the text declares the delimiter in a line of its own.
    is_declared: bool,
    comments: bool,
}

/// A row.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CsvRecord<'t> {
    /// Its line, from 1; the first of them if a field has line ends in it.
    pub line: u64,
    /// Bytes of the text, its line end and blank lines after it included.
    pub bytes: Range<usize>,
    fields: Vec<Field<'t>>,
}

#[derive(Debug, Clone, PartialEq, Eq)]
struct Field<'t> {
    /// Without the quotes, and without spaces around it.
    content: Cow<'t, [u8]>,
    /// Bytes of the text: between the quotes, if there are any.
    bytes: Range<usize>,
}

impl<'t> CsvReader<'t> {
    /// The rows of a text; the first one tells what stands between the fields.
    ///
    /// # Errors
    /// If the text is UTF-16, as some spreadsheets export it.
    pub fn new(text: &'t [u8]) -> Result<CsvReader<'t>, CsvError> {
        if text.starts_with(b"\xff\xfe") || text.starts_with(b"\xfe\xff") {
            let problem = "the table is UTF-16; save it as UTF-8".to_string();
            return Err(CsvError { line: 1, problem });
        }
        let at = if text.starts_with(b"\xef\xbb\xbf") { 3 } else { 0 };
        let delimiter = DELIMITERS[0];
        let mut reader = CsvReader { text, at, line: 1, delimiter, is_declared: false, comments: false };
        match &text[at..] {
            [b's', b'e', b'p', b'=', declared, rest @ ..]
                if DELIMITERS.contains(declared) && matches!(rest.first(), None | Some(b'\r' | b'\n')) =>
            {
                (reader.delimiter, reader.is_declared) = (*declared, true);
                reader.at += 5;
                reader.skip_line_end();
            }
            _ => reader.delimiter = reader.find_delimiter(),
        }
        Ok(reader)
    }

    /// The same without the lines that begin with `#`.
    #[must_use]
    pub fn with_comments(mut self) -> CsvReader<'t> {
        self.comments = true;
        if !self.is_declared {
            self.delimiter = self.find_delimiter();
        }
        self
    }

    /// The byte between fields: a comma, a semicolon or a tab.
    pub fn delimiter(&self) -> u8 {
        self.delimiter
    }

    /// The delimiter that the first row has most of, outside of quotes.
    fn find_delimiter(&self) -> u8 {
        let mut rest = self.clone();
        rest.skip_blank_lines();
        let mut counts = [0usize; DELIMITERS.len()];
        let mut quoted = false;
        for byte in &self.text[rest.at..] {
            match byte {
                b'"' => quoted = !quoted,
                b'\r' | b'\n' if !quoted => break,
                _ if quoted => {}
                byte => {
                    let known = DELIMITERS.iter().position(|delimiter| delimiter == byte);
                    known.into_iter().for_each(|known| counts[known] += 1);
                }
            }
        }
        // `max_by_key` takes the last one of equals, and the comma is the first.
        let most = (0..DELIMITERS.len()).rev().max_by_key(|&i| counts[i]).unwrap_or_default();
        DELIMITERS[most]
    }

    fn peek(&self) -> Option<u8> {
        self.text.get(self.at).copied()
    }

    /// Whether the text goes on, but the line does not.
    fn is_at_line_end(&self) -> bool {
        matches!(self.peek(), Some(b'\r' | b'\n'))
    }

    fn is_space(&self, byte: u8) -> bool {
        byte.is_ascii_whitespace() && byte != self.delimiter && byte != b'\r' && byte != b'\n'
    }

    fn skip_spaces(&mut self) {
        while self.peek().is_some_and(|byte| self.is_space(byte)) {
            self.at += 1;
        }
    }

    /// Goes behind the next byte, and counts the line if that ends one; a carriage return alone does, too.
    fn step(&mut self) {
        let ends = match self.peek() {
            Some(b'\n') => true,
            Some(b'\r') => self.text.get(self.at + 1) != Some(&b'\n'),
            _ => false,
        };
        self.line += u64::from(ends);
        self.at += usize::from(self.at < self.text.len());
    }

    fn skip_line_end(&mut self) {
        if self.peek() == Some(b'\r') && self.text.get(self.at + 1) == Some(&b'\n') {
            self.step();
        }
        self.step();
    }

    /// Goes to the first line with anything in it, or to the end.
    fn skip_blank_lines(&mut self) {
        loop {
            let start = self.at;
            self.skip_spaces();
            if self.comments && self.peek() == Some(b'#') {
                while self.peek().is_some() && !self.is_at_line_end() {
                    self.at += 1;
                }
            }
            match self.peek() {
                Some(b'\r' | b'\n') => self.skip_line_end(),
                Some(_) => {
                    self.at = start;
                    return;
                }
                None => return,
            }
        }
    }

    /// Reads a field, up to the delimiter or the line's end.
    fn field(&mut self) -> Result<Field<'t>, String> {
        let start = self.at;
        self.skip_spaces();
        if self.peek() == Some(b'"') {
            return self.quoted();
        }
        while self.peek().is_some_and(|byte| byte != self.delimiter) && !self.is_at_line_end() {
            self.at += 1;
        }
        Ok(self.trimmed(start..self.at))
    }

    fn quoted(&mut self) -> Result<Field<'t>, String> {
        self.at += 1;
        let start = self.at;
        // Of two quotes, which stand for one, the second is left out.
        let mut pieces: Vec<Range<usize>> = Vec::new();
        let mut piece = start;
        loop {
            match self.peek() {
                None => {
                    return Err(
                        "a quote is opened and never closed; close it, or write \"\" for a quote in a field in quotes"
                            .to_string(),
                    );
                }
                Some(b'"') if self.text.get(self.at + 1) == Some(&b'"') => {
                    pieces.push(piece..self.at + 1);
                    self.at += 2;
                    piece = self.at;
                }
                Some(b'"') => break,
                Some(_) => self.step(),
            }
        }
        let end = self.at;
        self.at += 1;
        self.skip_spaces();
        if self.peek().is_some_and(|byte| byte != self.delimiter) && !self.is_at_line_end() {
            return Err(
                "a field goes on after its closing quote; write \"\" for a quote in a field in quotes"
                    .to_string(),
            );
        }
        if pieces.is_empty() {
            return Ok(self.trimmed(start..end));
        }
        pieces.push(piece..end);
        let content: Vec<u8> = pieces.into_iter().flat_map(|piece| &self.text[piece]).copied().collect();
        let content = content.trim_ascii().to_vec();
        Ok(Field { content: Cow::Owned(content), bytes: self.trimmed(start..end).bytes })
    }

    fn trimmed(&self, bytes: Range<usize>) -> Field<'t> {
        let content = self.text[bytes.clone()].trim_ascii();
        let before = self.text[bytes.clone()].len() - self.text[bytes.clone()].trim_ascii_start().len();
        let start = if content.is_empty() { bytes.start } else { bytes.start + before };
        Field { content: Cow::Borrowed(content), bytes: start..start + content.len() }
    }

    /// The fields of the row that begins here, up to its line's end.
    fn fields(&mut self) -> Result<Vec<Field<'t>>, String> {
        let mut fields = vec![self.field()?];
        while self.peek() == Some(self.delimiter) {
            self.at += 1;
            fields.push(self.field()?);
        }
        Ok(fields)
    }
}

impl<'t> Iterator for CsvReader<'t> {
    type Item = Result<CsvRecord<'t>, CsvError>;

    fn next(&mut self) -> Option<Self::Item> {
        self.skip_blank_lines();
        loop {
            self.peek()?;
            let (start, line) = (self.at, self.line);
            let fields = self.fields();
            // After a fault the rest of the line means nothing.
            while self.peek().is_some() && !self.is_at_line_end() {
                self.at += 1;
            }
            self.skip_line_end();
            self.skip_blank_lines();
            let bytes = start..self.at;
            match fields {
                // Spreadsheets end a sheet with rows of commas.
                Ok(fields) if fields.iter().all(|field| field.content.is_empty()) => {}
                Ok(fields) => return Some(Ok(CsvRecord { line, bytes, fields })),
                Err(problem) => return Some(Err(CsvError { line, problem })),
            }
        }
    }
}

impl CsvRecord<'_> {
    /// Number of fields, at least 1.
    #[allow(clippy::len_without_is_empty)] // no row is
    pub fn len(&self) -> usize {
        self.fields.len()
    }

    /// The text of a field, without quotes and without spaces around it; empty if the row has fewer fields.
    ///
    /// # Errors
    /// If it is not UTF-8.
    pub fn text(&self, field: usize) -> Result<&str, CsvError> {
        let content = self.fields.get(field).map_or(&b""[..], |field| &field.content);
        std::str::from_utf8(content).map_err(|_| CsvError {
            line: self.line,
            problem: format!("field {} is not UTF-8; save the table as UTF-8", field + 1),
        })
    }

    /// The contents of all fields, without quotes and without spaces around them.
    pub fn fields(&self) -> impl Iterator<Item = &[u8]> {
        self.fields.iter().map(|field| field.content.as_ref())
    }

    /// The texts of all fields, with a sign in the place of what is not UTF-8.
    pub fn texts(&self) -> Vec<String> {
        self.fields.iter().map(|field| String::from_utf8_lossy(&field.content).into_owned()).collect()
    }

    /// Where the text of a field stands in the whole text: what takes its place leaves all else as it is.
    pub fn bytes_of(&self, field: usize) -> Option<Range<usize>> {
        self.fields.get(field).map(|field| field.bytes.clone())
    }
}

/// The whole number that a text is, also written as a fraction without one (`10.0`, as pandas writes whole numbers in a
/// column with gaps) or with an exponent (`1e+05`, as R does).
pub fn whole_number(text: &str) -> Option<i128> {
    text.parse().ok().or_else(|| text.parse().ok().and_then(whole))
}

/// The same number, if it is whole.
pub fn whole(number: f64) -> Option<i128> {
    (number.fract() == 0.0 && number.abs() < 1e30).then_some(number as i128)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rows(text: &str) -> Vec<Vec<String>> {
        let reader = CsvReader::new(text.as_bytes()).expect("UTF-8").with_comments();
        reader.map(|row| row.expect("sound").texts()).collect()
    }

    fn lines(text: &str) -> Vec<u64> {
        CsvReader::new(text.as_bytes())
            .expect("UTF-8")
            .map(|row| row.map_or_else(|e| e.line, |r| r.line))
            .collect()
    }

    #[test]
    fn one_table_in_many_spellings() {
        let expected = [["image", "x"], ["a,b \"c\".png", "3"]];
        for text in [
            "image,x\n\"a,b \"\"c\"\".png\",3\n",
            "image;x\n\"a,b \"\"c\"\".png\";3",
            "image\tx\r\n\"a,b \"\"c\"\".png\"\t3\r\n",
            "\u{feff}\n\n image , x \n , \n \"a,b \"\"c\"\".png\" , \"3\" \n,,,\n",
            "\"image\",\"x\"\r\"a,b \"\"c\"\".png\",\" 3\"\r",
            "# a; comment; \"with\n  # another\nimage,x\n#a,b\n\"a,b \"\"c\"\".png\",3\n#",
        ] {
            assert_eq!(rows(text), expected, "{text:?}");
        }
        assert_eq!(rows("a;b;c, d\n1;2,5;3\n"), [["a", "b", "c, d"], ["1", "2,5", "3"]]);
        assert_eq!(rows("\"a;b;c\",d\n"), [["a;b;c", "d"]]);
        assert_eq!(rows("19\" rack,b\n\"two\nlines\",\"\"\n"), [["19\" rack", "b"], ["two\nlines", ""]]);
        assert_eq!(rows(""), Vec::<Vec<String>>::new());
        assert_eq!(rows("\u{feff}"), Vec::<Vec<String>>::new());
    }

    #[test]
    fn a_first_line_declares_the_delimiter_as_excel_means_it() {
        for text in ["sep=;\na;b,c\n1;2\n", "\u{feff}sep=;\r\na;b,c\r\n1;2", "sep=;\r# d,e\ra;b,c\r1;2"] {
            assert_eq!(rows(text), [["a", "b,c"], ["1", "2"]], "{text:?}");
        }
        assert_eq!((lines("sep=,\na,b\n"), rows("sep=\t")), (vec![2], vec![]));
        assert_eq!(rows("sep=|\na|b\n"), [["sep=|"], ["a|b"]]);
    }

    #[test]
    fn lines_are_counted_whatever_ends_them() {
        assert_eq!(lines("a\nb\n\n\nc"), [1, 2, 5]);
        assert_eq!(lines("a\r\nb\r\n\r\n\r\nc\r\n"), [1, 2, 5]);
        assert_eq!(lines("a\rb\r\r\rc\r"), [1, 2, 5]);
        assert_eq!(lines("\n\n\"a\n\r\nb\"\r\nc"), [3, 6]);
        assert_eq!(lines("a\n,,\nb"), [1, 3]);
    }

    #[test]
    fn faults_are_named_with_their_line() {
        let fault = |text: &str| {
            let mut reader = CsvReader::new(text.as_bytes()).expect("UTF-8");
            let fault = reader.find_map(Result::err).expect("a fault");
            (fault, reader.count())
        };
        let (open, rest) = fault("a,b\n\"c,d\ne,f\n");
        assert_eq!((open.line, rest), (2, 0));
        assert!(open.to_string().starts_with("line 2: a quote is opened and never closed"), "{open}");
        let (after, rest) = fault("a,b\n\"c\"d,e\nf,g\n");
        assert_eq!((after.line, rest), (2, 1));
        assert!(after.problem.contains("after its closing quote"), "{after}");
        for utf16 in [&b"\xff\xfea\0,\0"[..], b"\xfe\xff\0a\0,"] {
            assert!(CsvReader::new(utf16).expect_err("UTF-16").problem.contains("UTF-16"));
        }
        let row = CsvReader::new(b"a,\xff\n").expect("no mark").next().expect("a row").expect("two fields");
        assert_eq!((row.text(0), row.text(7), row.len()), (Ok("a"), Ok(""), 2));
        assert!(row.text(1).expect_err("no UTF-8").problem.contains("field 2"));
    }

    #[test]
    fn bytes_are_those_of_the_content() {
        let text = "image,x,y\r\n\"a\"\"b\" , \" 3 \",\t4 \r\n\r\nlast,,";
        let rows: Vec<_> =
            CsvReader::new(text.as_bytes()).expect("UTF-8").map(|row| row.expect("sound")).collect();
        let bytes = |row: usize, field: usize| &text[rows[row].bytes_of(field).expect("there")];
        assert_eq!(
            [bytes(1, 0), bytes(1, 1), bytes(1, 2), bytes(2, 1), bytes(2, 2)],
            ["a\"\"b", "3", "4", "", ""]
        );
        assert_eq!(&text[rows[1].bytes.clone()], "\"a\"\"b\" , \" 3 \",\t4 \r\n\r\n");
        assert_eq!(rows[2].bytes.end, text.len());
    }

    #[test]
    fn whole_numbers_as_they_are_written() {
        for (text, number) in
            [("10", 10), ("10.0", 10), ("+4", 4), ("003", 3), ("-7.", -7), ("1e+05", 100_000), ("-0.0", 0)]
        {
            assert_eq!(whole_number(text), Some(number), "{text}");
        }
        assert_eq!(whole_number("99999999999999999999"), Some(99_999_999_999_999_999_999));
        for text in ["", "1.5", "nan", "inf", "1e999", "1,0", "ten", "0x10", "1 0"] {
            assert_eq!(whole_number(text), None, "{text}");
        }
    }
}
