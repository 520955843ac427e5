//! Reading `labels.csv`: rows as they stand, with their lines, not yet held against the images.

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::Path;

use super::fault::{Fault, FaultKind, Place};
use super::image_name::{cleaned, identity};
use crate::csv_table::{CsvError, CsvReader, CsvRecord, whole_number};
use crate::support::bounded::Bounded;

/// Reads a table of labels.
pub(crate) const LABELS: Bounded = Bounded::to(1 << 30);

/// One row, its numbers not yet held against an image.
pub(crate) struct Row {
    pub(crate) at: Place,
    /// Index in the list of images.
    pub(crate) image: usize,
    /// The image's name in this row, if it is not that of its first row.
    pub(crate) spelling: Option<String>,
    pub(crate) x: Option<i128>,
    pub(crate) y: Option<i128>,
    /// Where it stands in the file, with the end of its line and blank lines after it.
    pub(crate) bytes: Range<usize>,
    /// Where the number y stands in the file.
    pub(crate) y_bytes: Range<usize>,
}

/// An image that the table names.
pub(crate) struct Named {
    /// Its first row.
    pub(crate) at: Place,
    /// A plain path, as in its first row.
    pub(crate) name: String,
    /// The place it is from, if the table says so.
    pub(crate) group: Option<String>,
}

/// What stands in a table.
#[derive(Default)]
pub(crate) struct LabelTable {
    /// None where it is faulty, or there is none.
    pub(crate) header: Option<Header>,
    /// The distinct images.
    pub(crate) images: Vec<Named>,
    /// All names of images, each with the index of its image.
    pub(crate) spellings: BTreeMap<String, usize>,
    /// The rows that name a confined image.
    pub(crate) rows: Vec<Row>,
    /// Number of all rows below the header.
    pub(crate) count: usize,
}

/// Reads the table of a folder.
pub(super) fn read_table(dir: &Path, path: &Path, faults: &mut Vec<Fault>) -> LabelTable {
    if path.symlink_metadata().is_err() {
        faults.push(Fault { at: Place::Set, kind: FaultKind::NoTable(path.into()) });
        return LabelTable::default();
    }
    let bytes = match LABELS.bytes(path) {
        Ok(bytes) => bytes,
        Err(e) => {
            faults.push(Fault { at: Place::Set, kind: FaultKind::Table(e.to_string()) });
            return LabelTable::default();
        }
    };
    let before = faults.len();
    let table = parse_table(&bytes, |name| identity(dir, name), faults);
    if table.count == 0 && faults.len() == before {
        faults.push(Fault { at: Place::Set, kind: FaultKind::Empty });
    }
    table
}

/// The same of a file's content. Names that `identify` gives the same key are of one image.
pub(crate) fn parse_table<K: Ord>(
    bytes: &[u8],
    mut identify: impl FnMut(&str) -> K,
    faults: &mut Vec<Fault>,
) -> LabelTable {
    let mut table = LabelTable::default();
    let malformed = |e: CsvError| Fault { at: Place::Line(e.line), kind: FaultKind::Row(e.problem) };
    let reader = match CsvReader::new(bytes) {
        Ok(reader) => reader,
        Err(e) => {
            faults.push(malformed(e));
            return table;
        }
    };
    let delimiter = reader.delimiter();
    let mut index: BTreeMap<K, usize> = BTreeMap::new();
    for record in reader {
        let record = match record {
            Ok(record) => record,
            Err(e) => {
                table.count += usize::from(table.header.is_some());
                faults.push(malformed(e));
                continue;
            }
        };
        let at = Place::Line(record.line);
        let Some(header) = &table.header else {
            match Header::read(&record, delimiter) {
                Ok(read) => table.header = Some(read),
                Err(kind) => {
                    faults.push(Fault { at, kind });
                    return table;
                }
            }
            continue;
        };
        table.count += 1;
        let ([name, x, y], group) = match header.fields(&record) {
            Ok(fields) => fields,
            Err(kind) => {
                faults.push(Fault { at, kind });
                continue;
            }
        };
        let mut number = |column, text: &str| {
            let value = whole_number(text);
            if value.is_none() {
                faults.push(Fault { at, kind: FaultKind::Number { column, text: text.into() } });
            }
            value
        };
        let (x, y) = (number('x', x), number('y', y));
        let Some(name) = cleaned(name) else {
            faults.push(Fault { at, kind: FaultKind::Name(name.into()) });
            continue;
        };
        let images = &mut table.images;
        let image = *table.spellings.entry(name.clone()).or_insert_with(|| {
            *index.entry(identify(&name)).or_insert_with(|| {
                images.push(Named { at, name: name.clone(), group: group.map(Into::into) });
                images.len() - 1
            })
        });
        let first = &images[image];
        if first.group.as_deref() != group {
            let [first, second] = [first.group.as_deref(), group].map(|g| g.unwrap_or_default().into());
            faults.push(Fault { at, kind: FaultKind::Group { image: name.clone(), first, second } });
        }
        let y_bytes = record.bytes_of(header.columns[2]).unwrap_or_default();
        let spelling = Some(name).filter(|name| *name != images[image].name);
        table.rows.push(Row { at, image, spelling, x, y, bytes: record.bytes, y_bytes });
    }
    table
}

impl Row {
    /// The fault of a second label in a column of an image.
    pub(crate) fn duplicate(&self, image: &str, x: i128, first: Place) -> Fault {
        let image = image.to_string();
        let kind = match &self.spelling {
            None => FaultKind::Duplicate { image, x, first },
            Some(spelling) => FaultKind::DuplicateFile { spelling: spelling.clone(), image, x, first },
        };
        Fault { at: self.at, kind }
    }
}

/// Where the three columns stand, and the fourth if there is one.
pub(crate) struct Header {
    /// Those of `image`, `x` and `y`.
    pub(crate) columns: [usize; 3],
    pub(crate) group: Option<usize>,
    pub(crate) fields: usize,
    /// The byte between fields.
    pub(crate) delimiter: u8,
}

impl Header {
    fn read(record: &CsvRecord<'_>, delimiter: u8) -> Result<Header, FaultKind> {
        let names = record.texts();
        let separator = char::from(delimiter).to_string();
        let optional = |wanted: &str| {
            let mut places = names.iter().enumerate().filter(|(_, n)| *n == wanted).map(|(i, _)| i);
            let place = places.next();
            if places.next().is_some() { Err(format!("with `{wanted}` twice")) } else { Ok(place) }
        };
        let column = |wanted: &str| optional(wanted)?.ok_or(format!("without `{wanted}`"));
        let fault = |problem| FaultKind::Header { found: names.join(&separator), problem };
        let mut columns = [0; 3];
        for (place, wanted) in columns.iter_mut().zip(["image", "x", "y"]) {
            *place = column(wanted).map_err(fault)?;
        }
        let group = optional("group").map_err(fault)?;
        Ok(Header { columns, group, fields: record.len(), delimiter })
    }

    /// Image, x and y; and the group, if there is the column and it is not empty.
    fn fields<'r>(&self, record: &'r CsvRecord<'_>) -> Result<([&'r str; 3], Option<&'r str>), FaultKind> {
        if record.len() != self.fields {
            let (found, expected) = (record.len(), self.fields);
            return Err(FaultKind::Row(format!("{found} fields, the header has {expected}")));
        }
        let text = |column: usize| record.text(column).map_err(|e| FaultKind::Row(e.problem));
        let mut fields = [""; 3];
        for (field, &column) in fields.iter_mut().zip(&self.columns) {
            *field = text(column)?;
        }
        let group = self.group.map(text).transpose()?;
        Ok((fields, group.filter(|name| !name.is_empty())))
    }
}
