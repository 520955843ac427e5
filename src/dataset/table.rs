//! Reading `labels.csv`: rows as they stand, with their lines, not yet held against the images.

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::{Component, Path};

use super::fault::{Fault, FaultKind, Place};
use crate::support::bounded::Bounded;

/// Reads a table of labels.
pub(crate) const LABELS: Bounded = Bounded::to(1 << 30);

/// One row, its numbers not yet held against an image.
pub(crate) struct Row {
    pub(crate) at: Place,
    /// Index in the list of images.
    pub(crate) image: usize,
    pub(crate) x: Option<i128>,
    pub(crate) y: Option<i128>,
    /// Where it stands in the file, with the end of its line and blank lines after it.
    pub(crate) bytes: Range<usize>,
}

/// An image that the table names.
pub(crate) struct Named {
    /// Its first row.
    pub(crate) at: Place,
    pub(crate) name: String,
    /// The place it is from, if the table says so.
    pub(crate) group: Option<String>,
}

/// The distinct images of the table, the rows that name a confined image, and the number of all rows.
pub(super) fn read_table(path: &Path, faults: &mut Vec<Fault>) -> (Vec<Named>, Vec<Row>, usize) {
    let nothing = (Vec::new(), Vec::new(), 0);
    if !path.is_file() {
        faults.push(Fault { at: Place::Set, kind: FaultKind::NoTable(path.into()) });
        return nothing;
    }
    let bytes = match LABELS.bytes(path) {
        Ok(bytes) => bytes,
        Err(e) => {
            faults.push(Fault { at: Place::Set, kind: FaultKind::Table(e.to_string()) });
            return nothing;
        }
    };
    let (images, rows, count) = parse_table(&bytes, faults);
    if count == Some(0) {
        faults.push(Fault { at: Place::Set, kind: FaultKind::Empty });
    }
    (images, rows, count.unwrap_or_default())
}

/// The same of a file's content. The number is none where the header is faulty.
pub(crate) fn parse_table(bytes: &[u8], faults: &mut Vec<Fault>) -> (Vec<Named>, Vec<Row>, Option<usize>) {
    // The header is read as a row of its own, for its line is needed too.
    let mut reader =
        csv::ReaderBuilder::new().has_headers(false).flexible(true).trim(csv::Trim::All).from_reader(bytes);
    let mut lines = Lines { bytes, counted: 0, line: 1 };
    let mut record = csv::ByteRecord::new();
    let mut header: Option<Header> = None;
    let mut images: Vec<Named> = Vec::new();
    let mut index: BTreeMap<String, usize> = BTreeMap::new();
    let (mut rows, mut count): (Vec<Row>, usize) = (Vec::new(), 0);
    // Whether the last row read is still without its end.
    let mut open = false;
    loop {
        match reader.read_byte_record(&mut record) {
            Ok(true) => {}
            Ok(false) => break,
            Err(e) => {
                faults.push(Fault { at: Place::Set, kind: FaultKind::Table(e.to_string()) });
                break;
            }
        }
        let at = Place::Line(lines.of(record.position().map_or(0, csv::Position::byte)));
        let start = lines.counted;
        if let Some(row) = rows.last_mut().filter(|_| open) {
            row.bytes.end = start;
        }
        open = false;
        let Some(header) = &header else {
            match Header::read(&record) {
                Ok(read) => header = Some(read),
                Err(kind) => {
                    faults.push(Fault { at, kind });
                    return (Vec::new(), Vec::new(), None);
                }
            }
            continue;
        };
        count += 1;
        let fields = match header.fields(&record) {
            Ok(fields) => fields,
            Err(kind) => {
                faults.push(Fault { at, kind });
                continue;
            }
        };
        let ([name, x, y], group) = fields;
        let mut number = |column, text: &str| {
            let value = text.parse::<i128>().ok();
            if value.is_none() {
                faults.push(Fault { at, kind: FaultKind::Number { column, text: text.into() } });
            }
            value
        };
        let (x, y) = (number('x', x), number('y', y));
        if !is_confined(name) {
            faults.push(Fault { at, kind: FaultKind::Name(name.into()) });
            continue;
        }
        let image = *index.entry(name.into()).or_insert_with(|| {
            images.push(Named { at, name: name.into(), group: group.map(Into::into) });
            images.len() - 1
        });
        if images[image].group.as_deref() != group {
            let [first, second] =
                [images[image].group.as_deref(), group].map(|g| g.unwrap_or_default().into());
            faults.push(Fault { at, kind: FaultKind::Group { image: name.into(), first, second } });
        }
        rows.push(Row { at, image, x, y, bytes: start..bytes.len() });
        open = true;
    }
    (images, rows, Some(count))
}

/// Counts lines. The reader's own count stops before blank lines, which it skips.
struct Lines<'b> {
    bytes: &'b [u8],
    counted: usize,
    line: u64,
}

impl Lines<'_> {
    /// The line of the record that the reader found at this byte or after the line ends there.
    fn of(&mut self, byte: u64) -> u64 {
        let byte = self.bytes.len().min(byte as usize);
        let skipped = self.bytes[byte..].iter().take_while(|&&b| b == b'\r' || b == b'\n').count();
        while self.counted < byte + skipped {
            let rest = &self.bytes[self.counted..];
            // a carriage return alone ends a line, too
            let ends = rest[0] == b'\n' || (rest[0] == b'\r' && rest.get(1) != Some(&b'\n'));
            self.line += u64::from(ends);
            self.counted += 1;
        }
        self.line
    }
}

/// Where the three columns stand, and the fourth if there is one.
pub(crate) struct Header {
    /// Those of `image`, `x` and `y`.
    pub(crate) columns: [usize; 3],
    pub(crate) group: Option<usize>,
    pub(crate) fields: usize,
}

impl Header {
    pub(crate) fn read(record: &csv::ByteRecord) -> Result<Header, FaultKind> {
        let names: Vec<_> = record.iter().map(String::from_utf8_lossy).collect();
        let optional = |wanted: &str| {
            let mut places = names.iter().enumerate().filter(|(_, n)| n.as_ref() == wanted).map(|(i, _)| i);
            let place = places.next();
            if places.next().is_some() { Err(format!("with `{wanted}` twice")) } else { Ok(place) }
        };
        let column = |wanted: &str| optional(wanted)?.ok_or(format!("without `{wanted}`"));
        let fault = |problem| FaultKind::Header { found: names.join(","), problem };
        let mut columns = [0; 3];
        for (place, wanted) in columns.iter_mut().zip(["image", "x", "y"]) {
            *place = column(wanted).map_err(fault)?;
        }
        let group = optional("group").map_err(fault)?;
        Ok(Header { columns, group, fields: record.len() })
    }

    /// Image, x and y; and the group, if there is the column and it is not empty.
    fn fields<'r>(&self, record: &'r csv::ByteRecord) -> Result<([&'r str; 3], Option<&'r str>), FaultKind> {
        if record.len() != self.fields {
            let (found, expected) = (record.len(), self.fields);
            return Err(FaultKind::Row(format!("{found} fields, the header has {expected}")));
        }
        let text = |column: usize| {
            std::str::from_utf8(&record[column])
                .map_err(|_| FaultKind::Row(format!("field {} is not UTF-8", column + 1)))
        };
        let mut fields = [""; 3];
        for (field, &column) in fields.iter_mut().zip(&self.columns) {
            *field = text(column)?;
        }
        let group = self.group.map(text).transpose()?;
        Ok((fields, group.filter(|name| !name.is_empty())))
    }
}

/// A plain relative path: nothing that leads out of the folder on any platform, no second spelling of the
/// same file, nothing the table would not give back.
pub(crate) fn is_confined(name: &str) -> bool {
    let parts: Option<Vec<&str>> = Path::new(name)
        .components()
        .map(|part| match part {
            Component::Normal(part) => part.to_str(),
            _ => None,
        })
        .collect();
    let drive = name.as_bytes().get(1) == Some(&b':');
    !name.is_empty()
        && !drive
        && name.trim() == name
        && !name.contains(['\\', '\0'])
        && parts.is_some_and(|p| p.join("/") == name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_confined() {
        for good in ["a.png", "run 1/a.png", "..a.png", "ä.png", "a,b.png"] {
            assert!(is_confined(good), "{good}");
        }
        for bad in [
            "",
            "/etc/passwd",
            "../a.png",
            "a/../b.png",
            "./a.png",
            "a/./b.png",
            "a//b.png",
            "a/",
            "..",
            " a.png",
            "C:a.png",
            "C:/a.png",
            "a\\b.png",
            "a\0.png",
        ] {
            assert!(!is_confined(bad), "{bad}");
        }
    }
}
