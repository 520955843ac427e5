//! `labels.csv` as a file to be changed: what is not changed stays as it is, to the byte. Of a row whose label changes
//! that is all but the number itself.

use std::collections::BTreeMap;
use std::ops::Range;

use super::mark::{Mark, Marks};
use crate::csv_table::CsvReader;
use crate::dataset::table::{Header, LabelTable, Row, parse_table};
use crate::dataset::{Fault, FaultKind};

/// A table that has been read.
pub(super) struct Table {
    bytes: Vec<u8>,
    content: LabelTable,
    /// The one name of each of its images, however the table spells it.
    names: Vec<String>,
}

impl Table {
    /// Takes a table apart. One without a byte is as good as none. `name` gives the one name of an image for any name
    /// that the table may have for it.
    pub(super) fn read(bytes: Vec<u8>, mut name: impl FnMut(&str) -> String) -> Result<Table, Vec<Fault>> {
        let mut faults = Vec::new();
        let content = parse_table(&bytes, &mut name, &mut faults);
        let names: Vec<String> = content.images.iter().map(|image| name(&image.name)).collect();
        let mut first = BTreeMap::new();
        for row in &content.rows {
            let Some(x) = row.x else { continue };
            let first = *first.entry((row.image, x)).or_insert(row.at);
            if first != row.at {
                faults.push(row.duplicate(&content.images[row.image].name, x, first));
            }
        }
        faults.sort_by_key(|fault| fault.at);
        if faults.is_empty() { Ok(Table { bytes, content, names }) } else { Err(faults) }
    }

    /// The names of its images, in its order.
    pub(super) fn images(&self) -> impl Iterator<Item = &str> {
        self.names.iter().map(String::as_str)
    }

    fn name(&self, row: &Row) -> &str {
        &self.names[row.image]
    }

    /// The labels of an image of this size that are not inside it.
    pub(super) fn outside<'t>(
        &'t self,
        image: &'t str,
        width: u32,
        height: u32,
    ) -> impl Iterator<Item = Fault> + 't {
        let of_image = self.content.rows.iter().filter(move |row| self.name(row) == image);
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
            Some(((self.name(row).to_string(), x), Mark::Row(y)))
        };
        self.content.rows.iter().filter_map(label).collect()
    }

    /// A table of the same columns: `carry` tells what image, column and row become of the label at a column of an image,
    /// and `None` drops it; the other fields stay. `None` if no row is left.
    pub(super) fn carried<'n>(
        &self,
        carry: impl Fn(&str, u32) -> Option<(&'n str, u32, u32)>,
    ) -> Option<Vec<u8>> {
        let header = self.content.header.as_ref()?;
        let mut records = CsvReader::new(&self.bytes).ok()?.map_while(Result::ok);
        let mut writer =
            csv::WriterBuilder::new().delimiter(header.delimiter).flexible(true).from_writer(Vec::new());
        // Nothing fails that is written to memory.
        let _ = writer.write_record(records.next()?.fields());
        let mut left = false;
        // A table without faults has a row for each record.
        for (row, record) in self.content.rows.iter().zip(records) {
            let label = row.x.and_then(|x| carry(self.name(row), u32::try_from(x).ok()?));
            let Some((image, x, y)) = label else { continue };
            let (x, y) = (x.to_string(), y.to_string());
            let of = |i: usize| header.columns.iter().position(|&column| column == i);
            let fields = record.fields().enumerate().map(|(i, field)| match of(i) {
                Some(which) => [image, &x, &y][which].as_bytes(),
                None => field,
            });
            let _ = writer.write_record(fields);
            left = true;
        }
        writer.into_inner().ok().filter(|_| left)
    }

    /// The file with these labels set, or taken away where there is none; nothing if it stays as it is. `order` tells
    /// whether a first image comes before a second one, by a key; new rows stand where that order and their columns put
    /// them among the others.
    pub(super) fn with<K: Ord>(
        &self,
        changes: &BTreeMap<(String, u32), Option<u32>>,
        order: impl Fn(&str) -> K,
    ) -> Option<Vec<u8>> {
        let lines = Lines::of(&self.bytes, self.content.header.as_ref());
        let rows = &self.content.rows;
        // Ranges of the file and what takes their place, by where they begin.
        let mut edits: Vec<(Range<usize>, Vec<u8>)> = Vec::new();
        let mut new: Vec<(&str, u32, u32)> = Vec::new();
        for ((image, x), label) in changes {
            let there =
                rows.iter().find(|row| row.x == Some(i128::from(*x)) && self.name(row) == image.as_str());
            match (there, label) {
                (Some(row), None) => edits.push((row.bytes.clone(), Vec::new())),
                (Some(row), Some(y)) if row.y == Some(i128::from(*y)) => {}
                // The rest of the row stays as it is, spaces and quotes included.
                (Some(row), Some(y)) => edits.push((row.y_bytes.clone(), y.to_string().into_bytes())),
                (None, Some(y)) => new.push((image, *x, *y)),
                (None, None) => {}
            }
        }
        new.sort_by_key(|&(image, x, _)| (order(image), x));
        for (image, x, y) in new {
            let key = (order(image), i128::from(x));
            let place = |row: &Row| (order(self.name(row)), row.x.unwrap_or_default());
            let before = rows.iter().rfind(|row| place(row) < key);
            let after = || rows.iter().find(|row| place(row) > key);
            let at = match before {
                Some(row) => row.bytes.end,
                None => after().map_or(self.bytes.len(), |row| row.bytes.start),
            };
            // As the table has it already, if it has it.
            let known = self.names.iter().position(|name| name == image).map(|i| &self.content.images[i]);
            let name = known.map_or(image, |named| &named.name);
            edits.push((at..at, lines.row(name, x, y, known.and_then(|named| named.group.as_deref()))));
        }
        if edits.is_empty() {
            return None;
        }
        // Of those at one place, insertions stand before what begins there, and stay in their order.
        edits.sort_by_key(|(range, _)| (range.start, range.end));
        let (mut out, mut done) = (Vec::new(), 0);
        if lines.header.is_none() {
            // Nothing but blank lines or a byte order mark, after which a header would not be found.
            out.extend(format!("image,x,y{}", lines.end).bytes());
            done = self.bytes.len();
        }
        for (range, bytes) in edits {
            out.extend(&self.bytes[done..range.start]);
            let begins_line = bytes.ends_with(b"\n");
            if begins_line && out.last().is_some_and(|&last| last != b'\n' && last != b'\r') {
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
struct Lines<'t> {
    header: Option<&'t Header>,
    end: &'static str,
}

impl<'t> Lines<'t> {
    fn of(bytes: &[u8], header: Option<&'t Header>) -> Lines<'t> {
        let first_end = bytes.iter().position(|&byte| byte == b'\n');
        let end = if first_end.is_some_and(|at| at > 0 && bytes[at - 1] == b'\r') { "\r\n" } else { "\n" };
        Lines { header, end }
    }

    /// A new row, with its line's end; further columns stay empty.
    fn row(&self, image: &str, x: u32, y: u32, group: Option<&str>) -> Vec<u8> {
        let plain = Header { columns: [0, 1, 2], group: None, fields: 3, delimiter: b',' };
        let header = self.header.unwrap_or(&plain);
        let mut fields = vec![String::new(); header.fields];
        for (&column, text) in header.columns.iter().zip([image.to_string(), x.to_string(), y.to_string()]) {
            fields[column] = text;
        }
        if let (Some(column), Some(group)) = (header.group, group) {
            fields[column] = group.to_string();
        }
        let mut out = written(fields.iter().map(String::as_bytes), header.delimiter);
        out.extend(self.end.bytes());
        out
    }
}

/// A record without its line's end.
fn written<'f>(fields: impl Iterator<Item = &'f [u8]>, delimiter: u8) -> Vec<u8> {
    let mut writer = csv::WriterBuilder::new().delimiter(delimiter).flexible(true).from_writer(Vec::new());
    // Nothing fails that is written to memory.
    let _ = writer.write_record(fields);
    let mut out = writer.into_inner().unwrap_or_default();
    out.pop();
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A table of a folder in which all files are in `images`.
    fn read(table: &str) -> Result<Table, Vec<Fault>> {
        Table::read(table.into(), |name| name.strip_prefix("images/").unwrap_or(name).to_string())
    }

    fn changed(table: &str, changes: &[(&str, u32, Option<u32>)]) -> String {
        let table = read(table).expect("sound");
        let changes = changes.iter().map(|&(image, x, y)| ((image.to_string(), x), y)).collect();
        let out = table.with(&changes, |name| name.to_string());
        let text = String::from_utf8(out.unwrap_or(table.bytes)).expect("UTF-8");
        assert!(read(&text).is_ok(), "{text}");
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
    fn semicolons_and_tabs_stay() {
        for delimiter in [";", "\t"] {
            let with = |text: &str| text.replace(',', delimiter);
            let table = with("\u{feff}image,x,y,note\nb.png,3.0,10.0,ok\n");
            let text =
                changed(&table, &[("b.png", 3, Some(11)), ("a.png", 3, Some(4)), ("c d.png", 3, Some(5))]);
            let expected = "\u{feff}image,x,y,note\na.png,3,4,\nb.png,3.0,11,ok\nc d.png,3,5,\n";
            assert_eq!(text, with(expected));
        }
        assert_eq!(
            changed("image,x,y\na.png,3.0,10.0\n", &[("a.png", 3, Some(10))]),
            "image,x,y\na.png,3.0,10.0\n",
            "the same label"
        );
    }

    #[test]
    fn an_image_keeps_the_name_that_the_table_has_for_it() {
        let table = "image,x,y\nimages/a.png,3,10\n./b.png,3,4\na.png,20,12\n";
        let text = changed(
            table,
            &[("a.png", 20, Some(9)), ("a.png", 7, Some(1)), ("b.png", 5, Some(2)), ("c.png", 1, Some(0))],
        );
        assert_eq!(
            text,
            "image,x,y\nimages/a.png,3,10\nimages/a.png,7,1\n./b.png,3,4\na.png,20,9\nb.png,5,2\nc.png,1,0\n"
        );
        let faults = read("image,x,y\na.png,3,20\nimages/a.png,3,10\n").map(drop).expect_err("contradictory");
        assert_eq!(
            faults[0].to_string(),
            "labels.csv line 3: the image `images/a.png` is the same file as `a.png`, which has a label at x = 3 already \
             (labels.csv line 2); leave one of the two rows"
        );
    }

    #[test]
    fn a_table_is_carried_with_all_its_columns() {
        let table = "y, note ,x,image,group\r\n7,\"a, b\",3,\"c,1.jpg\",hall\r\n\r\n8,,4,c.jpg,\r\n1,\"say \"\"z\"\"\",5,d.jpg,lab";
        let table = read(table).expect("sound");
        let carry = |image: &str, x: u32| (image != "d.jpg" || x > 5).then_some(("new.png", x / 2, 10 * x));
        let text = table.carried(carry).map(|bytes| String::from_utf8(bytes).expect("UTF-8"));
        let expected = "y,note,x,image,group\n30,\"a, b\",1,new.png,hall\n40,,2,new.png,\n";
        assert_eq!(text.as_deref(), Some(expected));
        let all = table.carried(|_, x| Some(("a \"b\".png", x, x))).expect("rows");
        let all = String::from_utf8(all).expect("UTF-8");
        assert!(all.ends_with("\n5,\"say \"\"z\"\"\",5,\"a \"\"b\"\".png\",lab\n"), "{all}");
        assert_eq!(table.carried(|_, _| None), None);
        assert_eq!(read("").expect("sound").carried(|_, x| Some(("a", x, x))), None);
    }

    #[test]
    fn names_are_quoted_where_they_must_be() {
        let text = changed("image,x,y\nb,1,2", &[("a,\"b\".png", 3, Some(4))]);
        assert_eq!(text, "image,x,y\n\"a,\"\"b\"\".png\",3,4\nb,1,2");
        assert_eq!(read(&text).expect("sound").labels().len(), 2);
    }

    #[test]
    fn faults_are_found() {
        for table in ["a,b\n", "image,x,y\na,1,2\na,1,3\n", "image,x,y\na,b,1\n", "image,x,y\na,1\n"] {
            assert!(read(table).is_err(), "{table}");
        }
    }
}
