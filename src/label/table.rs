//! `labels.csv` as a file to be changed: what is not changed stays as it is, to the byte. Of a row whose label changes
//! that is all but the number itself.

use std::collections::BTreeMap;
use std::ops::Range;

use super::mark::{Mark, Marks};
use crate::dataset::table::{Header, Named, Row, parse_table};
use crate::dataset::{Fault, FaultKind};

/// A table that has been read.
#[derive(Default)]
pub(super) struct Table {
    bytes: Vec<u8>,
    images: Vec<Named>,
    rows: Vec<Row>,
}

impl Table {
    /// Takes a table apart. One without a byte is as good as none.
    pub(super) fn read(bytes: Vec<u8>) -> Result<Table, Vec<Fault>> {
        let mut faults = Vec::new();
        let (images, rows, _) = parse_table(&bytes, &mut faults);
        let mut first = BTreeMap::new();
        for row in &rows {
            let Some(x) = row.x else { continue };
            let first = *first.entry((row.image, x)).or_insert(row.at);
            if first != row.at {
                let image = images[row.image].name.clone();
                faults.push(Fault { at: row.at, kind: FaultKind::Duplicate { image, x, first } });
            }
        }
        faults.sort_by_key(|fault| fault.at);
        if faults.is_empty() { Ok(Table { bytes, images, rows }) } else { Err(faults) }
    }

    /// The names of its images, in its order.
    pub(super) fn images(&self) -> impl Iterator<Item = &str> {
        self.images.iter().map(|image| image.name.as_str())
    }

    /// The labels of an image of this size that are not inside it.
    pub(super) fn outside<'t>(
        &'t self,
        image: &'t str,
        width: u32,
        height: u32,
    ) -> impl Iterator<Item = Fault> + 't {
        let of_image = self.rows.iter().filter(move |row| self.images[row.image].name == image);
        of_image.flat_map(move |row| {
            [('x', row.x, width), ('y', row.y, height)].into_iter().filter_map(
                move |(column, value, side)| {
                    let value = value.filter(|value| !(0..i128::from(side)).contains(value))?;
                    let kind = FaultKind::Outside { column, value, image: image.into(), max: side - 1 };
                    Some(Fault { at: row.at, kind })
                },
            )
        })
    }

    /// The labels.
    pub(super) fn labels(&self) -> Marks {
        let label = |row: &Row| {
            let (x, y) = (u32::try_from(row.x?).ok()?, u32::try_from(row.y?).ok()?);
            Some(((self.images[row.image].name.clone(), x), Mark::Row(y)))
        };
        self.rows.iter().filter_map(label).collect()
    }

    /// The file with these labels set, or taken away where there is none; nothing if it stays as it is. `order` tells whether a first image comes
    /// before a second one, by a key; new rows stand where that order and their columns put them among the others.
    pub(super) fn with<K: Ord>(
        &self,
        changes: &BTreeMap<(String, u32), Option<u32>>,
        order: impl Fn(&str) -> K,
    ) -> Option<Vec<u8>> {
        let lines = Lines::of(&self.bytes);
        // Ranges of the file and what takes their place, by where they begin.
        let mut edits: Vec<(Range<usize>, Vec<u8>)> = Vec::new();
        let mut new: Vec<(&str, u32, u32)> = Vec::new();
        for ((image, x), label) in changes {
            let there = self
                .rows
                .iter()
                .find(|row| row.x == Some(i128::from(*x)) && self.images[row.image].name == *image);
            match (there, label) {
                (Some(row), None) => edits.push((row.bytes.clone(), Vec::new())),
                (Some(row), Some(y)) if row.y == Some(i128::from(*y)) => {}
                (Some(row), Some(y)) => {
                    edits.push((row.bytes.clone(), lines.relabelled(&self.bytes[row.bytes.clone()], *y)))
                }
                (None, Some(y)) => new.push((image, *x, *y)),
                (None, None) => {}
            }
        }
        new.sort_by_key(|&(image, x, _)| (order(image), x));
        for (image, x, y) in new {
            let key = (order(image), i128::from(x));
            let place = |row: &Row| (order(&self.images[row.image].name), row.x.unwrap_or_default());
            let before = self.rows.iter().rfind(|row| place(row) < key);
            let after = || self.rows.iter().find(|row| place(row) > key);
            let at = match before {
                Some(row) => row.bytes.end,
                None => after().map_or(self.bytes.len(), |row| row.bytes.start),
            };
            let group =
                self.images.iter().find(|named| named.name == image).and_then(|named| named.group.as_deref());
            edits.push((at..at, lines.row(image, x, y, group)));
        }
        if edits.is_empty() {
            return None;
        }
        // Of those at one place, insertions stand before what begins there, and stay in their order.
        edits.sort_by_key(|(range, _)| (range.start, range.end));
        let (mut out, mut done) = (Vec::new(), 0);
        if !lines.headed {
            // Nothing but blank lines or a byte order mark, after which a header would not be found.
            out.extend(format!("image,x,y{}", lines.end).bytes());
            done = self.bytes.len();
        }
        for (range, bytes) in edits {
            out.extend(&self.bytes[done..range.start]);
            if !bytes.is_empty() && out.last().is_some_and(|&last| last != b'\n' && last != b'\r') {
                out.extend(lines.end.bytes());
            }
            out.extend(bytes);
            done = range.end;
        }
        out.extend(&self.bytes[done..]);
        Some(out)
    }
}

/// How the lines of a file are written.
struct Lines {
    header: Header,
    /// Whether there is a header.
    headed: bool,
    end: &'static str,
}

impl Lines {
    fn of(bytes: &[u8]) -> Lines {
        let plain = Header { columns: [0, 1, 2], group: None, fields: 3 };
        let header = first_record(bytes).and_then(|record| Header::read(&record).ok());
        let headed = header.is_some();
        let first_end = bytes.iter().position(|&byte| byte == b'\n');
        let end = if first_end.is_some_and(|at| at > 0 && bytes[at - 1] == b'\r') { "\r\n" } else { "\n" };
        Lines { header: header.unwrap_or(plain), headed, end }
    }

    /// A row with another label, the rest as it was, spaces and quotes included.
    fn relabelled(&self, row: &[u8], y: u32) -> Vec<u8> {
        let [_, _, column] = self.header.columns;
        let field = field(row, column);
        let (before, after) = (&row[..field.start], &row[field.end..]);
        [before, y.to_string().as_bytes(), after].concat()
    }

    /// A new row, with its line's end; further columns stay empty.
    fn row(&self, image: &str, x: u32, y: u32, group: Option<&str>) -> Vec<u8> {
        let mut fields = vec![String::new(); self.header.fields];
        for (&column, text) in
            self.header.columns.iter().zip([image.to_string(), x.to_string(), y.to_string()])
        {
            fields[column] = text;
        }
        if let (Some(column), Some(group)) = (self.header.group, group) {
            fields[column] = group.to_string();
        }
        let mut out = written(fields.iter().map(String::as_bytes));
        out.extend(self.end.bytes());
        out
    }
}

/// Where the content of a field stands in a row, without the quotes and spaces around it.
fn field(row: &[u8], column: usize) -> Range<usize> {
    let (mut quoted, mut fields, mut start, mut end) = (false, 0, 0, row.len());
    for (at, &byte) in row.iter().enumerate() {
        match byte {
            // Two of them inside quotes, which stand for one, change nothing.
            b'"' if quoted || at == start => quoted = !quoted,
            b',' | b'\r' | b'\n' if !quoted => {
                if fields == column {
                    end = at;
                    break;
                }
                fields += 1;
                start = at + 1;
            }
            _ => {}
        }
    }
    let is_around = |byte: &u8| *byte == b'"' || byte.is_ascii_whitespace();
    let content = &row[start..end];
    let before = content.iter().take_while(|byte| is_around(byte)).count();
    let after = content[before..].iter().rev().take_while(|byte| is_around(byte)).count();
    start + before..end - after
}

/// The first record of a text, its fields without spaces around them.
fn first_record(text: &[u8]) -> Option<csv::ByteRecord> {
    let mut reader =
        csv::ReaderBuilder::new().has_headers(false).flexible(true).trim(csv::Trim::All).from_reader(text);
    let mut record = csv::ByteRecord::new();
    reader.read_byte_record(&mut record).ok().filter(|there| *there).map(|_| record)
}

/// A record without its line's end.
fn written<'f>(fields: impl Iterator<Item = &'f [u8]>) -> Vec<u8> {
    let mut writer = csv::WriterBuilder::new().flexible(true).from_writer(Vec::new());
    // Nothing fails that is written to memory.
    let _ = writer.write_record(fields);
    let mut out = writer.into_inner().unwrap_or_default();
    out.pop();
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn changed(table: &str, changes: &[(&str, u32, Option<u32>)]) -> String {
        let table = Table::read(table.into()).expect("sound");
        let changes = changes.iter().map(|&(image, x, y)| ((image.to_string(), x), y)).collect();
        let out = table.with(&changes, |name| name.to_string());
        let text = String::from_utf8(out.unwrap_or(table.bytes)).expect("UTF-8");
        assert!(Table::read(text.clone().into_bytes()).is_ok(), "{text}");
        text
    }

    #[test]
    fn a_table_is_begun() {
        assert_eq!(changed("", &[("a.png", 3, Some(5))]), "image,x,y\na.png,3,5\n");
        // Neither is of use as a first line.
        for blank in ["\n", "\r\n", "\u{feff}", "\u{feff}\n\n"] {
            let text = changed(blank, &[("a.png", 3, Some(5)), ("b.png", 3, Some(6))]);
            let lines: Vec<&str> = text.lines().collect();
            assert_eq!(lines, ["image,x,y", "a.png,3,5", "b.png,3,6"], "{blank:?}");
        }
        assert_eq!(
            changed("image,x,y\n", &[("b", 3, Some(5)), ("a", 9, Some(6)), ("a", 10, Some(7))]),
            "image,x,y\na,9,6\na,10,7\nb,3,5\n"
        );
    }

    #[test]
    fn the_rest_stays_to_the_byte() {
        let table = "y,note, x,image,group\r\n 7,\"a, b\",3,c.png,hall\r\n\r\n8,,4,c.png,hall\r\n1,z ,99,other/e.png,";
        assert_eq!(changed(table, &[]), table);
        let text = changed(table, &[("c.png", 4, Some(9)), ("c.png", 5, Some(2)), ("z.png", 1, Some(0))]);
        assert_eq!(
            text,
            "y,note, x,image,group\r\n 7,\"a, b\",3,c.png,hall\r\n\r\n9,,4,c.png,hall\r\n2,,5,c.png,hall\r\n\
             1,z ,99,other/e.png,\r\n0,,1,z.png,\r\n"
        );
        let text = changed(table, &[("c.png", 3, None), ("other/e.png", 99, Some(2))]);
        assert_eq!(text, "y,note, x,image,group\r\n8,,4,c.png,hall\r\n2,z ,99,other/e.png,");
        let quoted = "image,note,x,y,by\n\"a.png\",\"1,\"\"2\"\"\",3, \t7 ,\"me\"\n\"b.png\",, 4 ,\"8\" ,\n";
        let text = changed(quoted, &[("a.png", 3, Some(12)), ("b.png", 4, Some(0))]);
        assert_eq!(text, quoted.replace("\t7 ", "\t12 ").replace("\"8\"", "\"0\""));
    }

    #[test]
    fn names_are_quoted_where_they_must_be() {
        let text = changed("image,x,y\nb,1,2", &[("a,\"b\".png", 3, Some(4))]);
        assert_eq!(text, "image,x,y\n\"a,\"\"b\"\".png\",3,4\nb,1,2");
        assert_eq!(Table::read(text.into_bytes()).expect("sound").labels().len(), 2);
    }

    #[test]
    fn faults_are_found() {
        for table in ["a,b\n", "image,x,y\na,1,2\na,1,3\n", "image,x,y\na,b,1\n", "image,x,y\na,1\n"] {
            assert!(Table::read(table.into()).is_err(), "{table}");
        }
    }
}
