//! What can be wrong with a data set: one [`Fault`] for each thing found, with the place it was found at.
//!
//! A scan collects all faults of a folder instead of stopping at the first, so that a set is repaired in one
//! go; [`DatasetError`] carries them to a caller who wanted the set itself.
//!
//! ```
//! use vsonar::dataset::{Fault, FaultKind, Place};
//! let fault = Fault { at: Place::Line(7), kind: FaultKind::Number { column: 'y', text: "low".into() } };
//! let text = "labels.csv line 7: y is `low`, not a whole number; write the pixel's number, counted from 0";
//! assert_eq!(fault.to_string(), text);
//! ```

use std::fmt;
use std::path::{Path, PathBuf};

use crate::support::printable::{self, ShownPath as _};

use serde::ser::{Serialize, SerializeStruct, Serializer};

use crate::memory::{gib_allowed, gib_needed};

/// Where a fault was found. Orders as a reader meets them: the folder, then line by line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Place {
    /// The folder or the table as a whole.
    Set,
    /// A line of `labels.csv`, counted from 1.
    Line(u64),
    /// An image of a set built in memory, counted from 0.
    Image(usize),
    /// A case of a set built in memory, counted from 0.
    Case(usize),
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Place::Set => write!(f, "the set"),
            Place::Line(line) => write!(f, "labels.csv line {line}"),
            Place::Image(index) => write!(f, "image {index}"),
            Place::Case(index) => write!(f, "case {index}"),
        }
    }
}

/// One thing that is wrong with a data set, and where.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Fault {
    /// Where it was found. For a fault of an image: the first line that names the image.
    pub at: Place,
    /// What it is.
    pub kind: FaultKind,
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.at {
            Place::Set => {}
            at => write!(f, "{at}: ")?,
        }
        // A fault is one line, whatever the names and texts in it hold.
        f.write_str(&printable::line(&self.kind.to_string()))
    }
}

/// What is wrong.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum FaultKind {
    /// The folder is not there, or is no folder.
    #[error("there is no folder {}; check the path", .0.shown())]
    NoFolder(PathBuf),
    /// A folder cannot be searched, so that nothing in it can be found.
    #[error(
        "the folder {} cannot be searched{}: {cause}; check its permissions, and whether its disk is there",
        .folder.shown(), looked_for(*.images)
    )]
    NoAccess {
        /// The folder.
        folder: PathBuf,
        /// The system's error.
        cause: String,
        /// How many images of the table are looked for in it.
        images: usize,
    },
    /// Decoding the images would take more memory than is allowed.
    #[error(
        "the {images} image(s) take about {} GiB of memory while they are read, and the limit is {} GiB; the largest, \
         `{largest}`, has {width}x{height} pixels: scale the images down (`vsonar data resize`), use fewer, or raise the \
         limit (`--memory {}`)",
        gib_needed(*.needed), gib_allowed(*.limit), gib_needed(*.needed)
    )]
    Memory {
        /// How many images there are.
        images: usize,
        /// Bytes that are needed.
        needed: u64,
        /// Bytes that are allowed.
        limit: u64,
        /// The name of the largest image.
        largest: String,
        /// Its width in pixels.
        width: u32,
        /// Its height in pixels.
        height: u32,
    },
    /// The folder has no `labels.csv`.
    #[error("{} is missing; it needs the header `image,x,y` and a row for each case (`vsonar label` makes it)", .0.shown())]
    NoTable(PathBuf),
    /// `labels.csv` cannot be read.
    #[error("labels.csv cannot be read: {0}; check the file and its permissions")]
    Table(String),
    /// The header lacks columns or has one of them twice.
    #[error(
        "the header is `{found}`, {problem}; it must name the columns image, x and y, with commas, semicolons or tabs \
         between them"
    )]
    Header {
        /// The header as it stands.
        found: String,
        /// What is wrong with it.
        problem: String,
    },
    /// There is no case at all.
    #[error("the table has no cases")]
    Empty,
    /// A row has more or fewer fields than the header, or is not UTF-8.
    #[error("malformed row: {0}")]
    Row(String),
    /// An image name that may lead out of the folder, or cannot be written to a table and read back.
    #[error(
        "the image name `{0}` is not a path below the folder; write one, without `..`, a drive or a `/` at its start"
    )]
    Name(String),
    /// Two images of a set built in memory have one name.
    #[error("a second image is named `{0}`")]
    NameTwice(String),
    /// The image file is neither in `images` nor beside the table.
    #[error("the image `{0}` is missing, both in `images` and beside the table")]
    MissingImage(String),
    /// The image file cannot be decoded.
    #[error("the image `{image}` cannot be used: {cause}")]
    Image {
        /// Its name.
        image: String,
        /// The decoder's words.
        cause: String,
    },
    /// The image is smaller than the method allows.
    #[error("the image `{image}` is {width}x{height} pixels, smaller than 16x16")]
    Small {
        /// Its name.
        image: String,
        /// Its width in pixels.
        width: u32,
        /// Its height in pixels.
        height: u32,
    },
    /// The image has another size than most.
    #[error("the image `{image}` is {width}x{height} pixels, most are {common_width}x{common_height}")]
    Size {
        /// Its name.
        image: String,
        /// Its width in pixels.
        width: u32,
        /// Its height in pixels.
        height: u32,
        /// The most frequent width.
        common_width: u32,
        /// The most frequent height.
        common_height: u32,
    },
    /// x or y is not a whole number.
    #[error("{column} is `{text}`, not a whole number; {}", number_remedy(.text))]
    Number {
        /// `x` or `y`.
        column: char,
        /// The field as it stands.
        text: String,
    },
    /// x or y lies outside the image.
    #[error("{column} is {value}, outside the image `{image}` (0 to {max})")]
    Outside {
        /// `x` or `y`.
        column: char,
        /// The number as it stands.
        value: i128,
        /// The image.
        image: String,
        /// The largest value allowed.
        max: u32,
    },
    /// Rows of one image name different groups.
    #[error(
        "the image `{image}` is of {} here and of {} before; an image is of one group in all its rows",
        group_named(.second), group_named(.first)
    )]
    Group {
        /// The image.
        image: String,
        /// The group its first row names; empty for none.
        first: String,
        /// The group this row names.
        second: String,
    },
    /// A case refers to an image that the set built in memory does not have.
    #[error("there is no image number {0}")]
    NoImage(usize),
    /// The same image and x have a label already.
    #[error("the image `{image}` has a label at x = {x} already ({first})")]
    Duplicate {
        /// The image.
        image: String,
        /// The column.
        x: i128,
        /// Where the first label stands.
        first: Place,
    },
    /// The same, under another name of the same file.
    #[error(
        "the image `{spelling}` is the same file as `{image}`, which has a label at x = {x} already ({first}); leave one of \
         the two rows"
    )]
    DuplicateFile {
        /// The name in this row.
        spelling: String,
        /// The name in the first row of the image.
        image: String,
        /// The column.
        x: i128,
        /// Where the first label stands.
        first: Place,
    },
}

impl FaultKind {
    /// A short fixed name, for programs that read a report.
    pub fn code(&self) -> &'static str {
        match self {
            FaultKind::NoFolder(_) => "no-folder",
            FaultKind::NoAccess { .. } => "no-access",
            FaultKind::Memory { .. } => "memory",
            FaultKind::NoTable(_) => "no-table",
            FaultKind::Table(_) => "table",
            FaultKind::Header { .. } => "header",
            FaultKind::Empty => "empty",
            FaultKind::Row(_) => "row",
            FaultKind::Name(_) => "name",
            FaultKind::NameTwice(_) => "name-twice",
            FaultKind::MissingImage(_) => "missing-image",
            FaultKind::Image { .. } => "image",
            FaultKind::Small { .. } => "small",
            FaultKind::Size { .. } => "size",
            FaultKind::Number { .. } => "number",
            FaultKind::Outside { .. } => "outside",
            FaultKind::Group { .. } => "group",
            FaultKind::NoImage(_) => "no-image",
            FaultKind::Duplicate { .. } | FaultKind::DuplicateFile { .. } => "duplicate",
        }
    }
}

/// A fault is written as its line (or nothing), its [`FaultKind::code`] and the message for people.
impl Serialize for Fault {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let line = match self.at {
            Place::Line(line) => Some(line),
            _ => None,
        };
        let mut out = serializer.serialize_struct("Fault", 3)?;
        out.serialize_field("line", &line)?;
        out.serialize_field("kind", self.kind.code())?;
        out.serialize_field("message", &self.kind.to_string())?;
        out.end()
    }
}

fn number_remedy(text: &str) -> &'static str {
    let number = text.replacen(',', ".", 1).parse::<f64>();
    match number {
        _ if text.is_empty() || text.eq_ignore_ascii_case("na") => "leave the row out if there is no label",
        Ok(number) if number.is_nan() => "leave the row out if there is no label",
        Ok(number) if number.fract() == 0.0 && text.contains(',') => "write fractions with a point",
        Ok(number) if number.is_finite() => "round it: pixels are counted in whole numbers",
        _ => "write the pixel's number, counted from 0",
    }
}

fn looked_for(images: usize) -> String {
    match images {
        0 => String::new(),
        1 => " for an image of the table".to_string(),
        images => format!(" for {images} images of the table"),
    }
}

fn group_named(name: &str) -> String {
    if name.is_empty() { "no group".to_string() } else { format!("group `{name}`") }
}

/// How many faults an error message shows before it only counts.
const SHOWN: usize = 3;

/// Why there is no data set. Holds every fault found, in the order of the table.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum DatasetError {
    /// The folder is faulty.
    #[error("the data set {} {}{}", .dir.shown(), summary(.faults), whole_report(.dir, .faults))]
    Folder {
        /// The folder.
        dir: PathBuf,
        /// All that was found.
        faults: Vec<Fault>,
    },
    /// The images and cases handed over do not make a set.
    #[error("the data set `{name}` {}", summary(.faults))]
    Parts {
        /// Name of the set.
        name: String,
        /// All that was found.
        faults: Vec<Fault>,
    },
}

impl DatasetError {
    /// All faults, in the order of the table.
    pub fn faults(&self) -> &[Fault] {
        match self {
            DatasetError::Folder { faults, .. } | DatasetError::Parts { faults, .. } => faults,
        }
    }
}

fn summary(faults: &[Fault]) -> String {
    let count = faults.len();
    let mut out = format!("has {count} fault{}:", if count == 1 { "" } else { "s" });
    for fault in faults.iter().take(SHOWN) {
        out += &format!("\n  {fault}");
    }
    if count > SHOWN {
        out += &format!("\n  and {} more", count - SHOWN);
    }
    out
}

/// The command that reports on the whole folder, if there is anything to report on.
fn whole_report(dir: &Path, faults: &[Fault]) -> String {
    let nothing = |fault: &Fault| matches!(fault.kind, FaultKind::NoFolder(_) | FaultKind::NoTable(_));
    match faults.iter().any(nothing) {
        true => String::new(),
        false => format!("\nrun `vsonar data check {}` for the whole report", shell_word(dir)),
    }
}

/// The path as one word of a shell's command line, so that the remedy can be pasted.
fn shell_word(path: &Path) -> String {
    let text = path.display().to_string();
    let plain = |c: char| c.is_ascii_alphanumeric() || "/._-+,:@%=".contains(c);
    if !text.is_empty() && text.chars().all(plain) {
        text
    } else {
        format!("'{}'", text.replace('\'', "'\\''"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn error_lists_the_first_and_counts_the_rest() {
        let faults: Vec<Fault> = (2..7)
            .map(|l| Fault { at: Place::Line(l), kind: FaultKind::MissingImage(format!("{l}.png")) })
            .collect();
        let error = DatasetError::Folder { dir: "my data".into(), faults };
        let text = error.to_string();
        assert!(text.contains("has 5 faults:"), "{text}");
        assert!(text.contains("labels.csv line 4") && !text.contains("line 5"), "{text}");
        assert!(text.contains("and 2 more"), "{text}");
        assert!(text.contains("`vsonar data check 'my data'`"), "{text}");
        assert_eq!(error.faults().len(), 5);
        for kind in [FaultKind::NoFolder("no".into()), FaultKind::NoTable("no/labels.csv".into())] {
            let faults = vec![Fault { at: Place::Set, kind }];
            let text = DatasetError::Folder { dir: "no".into(), faults }.to_string();
            assert!(!text.contains("data check"), "it would say the same: {text}");
        }
    }

    #[test]
    fn serialises_with_code_and_line() {
        let fault = Fault { at: Place::Line(3), kind: FaultKind::Row("two fields".into()) };
        let json = serde_json::to_string(&fault).unwrap();
        assert_eq!(json, r#"{"line":3,"kind":"row","message":"malformed row: two fields"}"#);
        let fault = Fault { at: Place::Set, kind: FaultKind::Empty };
        assert!(serde_json::to_string(&fault).unwrap().starts_with(r#"{"line":null,"kind":"empty""#));
    }
}
