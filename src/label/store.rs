//! Marks on the disk: `labels.csv` for labels, `labels.skip.csv` for columns that are not to be labelled, and
//! `.labels.columns` for the columns asked for.
//!
//! A change reads both files, changes what it is about and puts them in their place as a whole, all under the lock of
//! `.labels.lock`, which every process that labels the folder takes. A program that knows nothing of the lock does no
//! harm unless it writes in the same few milliseconds, for the files are read again each time.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, SystemTime};

use super::mark::{Mark, Marks};
use super::table::Table;
use crate::csv_table::{CsvError, CsvReader, whole_number};
use crate::dataset::image_name::{cleaned, plain_name};
use crate::dataset::scan::TABLE;
use crate::dataset::table::LABELS;
use crate::dataset::{DatasetError, Fault};
use crate::support::bounded::Bounded;
use crate::support::durable::{as_before, replace_now, sync_file};
use crate::support::lock::Lock;
use crate::support::printable::ShownPath as _;
use crate::support::temporary::{self, TemporaryFile};

/// Name of the file for columns that are not to be labelled.
pub(super) const SKIPS: &str = "labels.skip.csv";
/// Name of the file that is locked while the others are written. It stays behind, empty.
const LOCK: &str = ".labels.lock";
/// Name of the file of the columns last asked for, separated by commas.
pub(super) const COLUMNS: &str = ".labels.columns";
/// How long another process may keep the lock.
const PATIENCE: Duration = Duration::from_secs(5);

/// Why marks could not be read or saved.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// A file could not be read or written.
    #[error("{}: cannot {action}: {source}{}", .path.shown(), remedy(action, source))]
    File {
        /// The file.
        path: PathBuf,
        /// What was to be done with it.
        action: &'static str,
        /// The system's words.
        source: io::Error,
    },
    /// `labels.csv` is faulty, and is left alone.
    #[error(transparent)]
    Table(DatasetError),
    /// The file of skipped columns is faulty.
    #[error("{} line {line}: {problem}; mend the line, or remove the file to forget what was skipped", .path.shown())]
    Skips {
        /// The file.
        path: PathBuf,
        /// The line, from 1.
        line: u64,
        /// What is wrong.
        problem: String,
    },
    /// A file that is a link to another folder, or no file at all.
    #[error(
        "{}: is a link that leads out of the folder, or no file; label the folder that holds the file", .0.shown()
    )]
    Link(PathBuf),
    /// A file that its owner does not want to be changed.
    #[error("{}: is read-only; make the file writable, or label a copy of the folder", .0.shown())]
    ReadOnly(PathBuf),
    /// Another process keeps the lock.
    #[error(
        "{}: another program has locked the labels for more than {} s; end the one that holds this file",
        .0.shown(), PATIENCE.as_secs()
    )]
    Locked(PathBuf),
}

fn remedy(action: &str, error: &io::Error) -> &'static str {
    match error.kind() {
        io::ErrorKind::PermissionDenied if action.starts_with("read") => "; make the file readable",
        io::ErrorKind::PermissionDenied | io::ErrorKind::ReadOnlyFilesystem => {
            "; make the folder writable, or label a copy of it"
        }
        io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded | io::ErrorKind::FileTooLarge => {
            "; make room on the disk"
        }
        _ => "",
    }
}

/// What tells that a file is not the one that was read.
type Stamp = Option<(SystemTime, u64, u64)>;

/// The files of a folder.
#[derive(Debug)]
pub(super) struct Store {
    /// The folder, without links.
    dir: PathBuf,
    table: PathBuf,
    skips: PathBuf,
    read: [Stamp; 2],
    /// The one name of each image that has been asked for, by the names that the files have for it.
    names: BTreeMap<String, String>,
}

/// What the files say.
pub(super) struct Contents {
    pub(super) table: Table,
    skipped: BTreeSet<(String, u32)>,
}

impl Contents {
    /// All marks; a label counts more than that the column was skipped.
    pub(super) fn marks(&self) -> Marks {
        let mut marks: Marks = self.skipped.iter().map(|key| (key.clone(), Mark::Skip)).collect();
        marks.extend(self.table.labels());
        marks
    }
}

impl Store {
    /// The files of this folder, which is given without links.
    pub(super) fn new(dir: &Path) -> Result<Store, StoreError> {
        let place = |name: &str| {
            let path = dir.join(name);
            match path.canonicalize() {
                Ok(real) if real.starts_with(dir) => Ok(real),
                Ok(_) => Err(StoreError::Link(path)),
                Err(_) if path.symlink_metadata().is_ok() => Err(StoreError::Link(path)),
                Err(_) => Ok(path),
            }
        };
        let (table, skips) = (place(TABLE)?, place(SKIPS)?);
        Ok(Store { dir: dir.into(), table, skips, read: [None, None], names: BTreeMap::new() })
    }

    /// The table, as a person is told of it.
    pub(super) fn table(&self) -> &Path {
        &self.table
    }

    /// An error that names faults of the table.
    pub(super) fn faulty(&self, faults: Vec<Fault>) -> StoreError {
        StoreError::Table(DatasetError::Folder { dir: self.dir.clone(), faults })
    }

    /// Whether another program has written since the files were read.
    pub(super) fn is_stale(&self) -> bool {
        self.read != self.stamps()
    }

    fn stamps(&self) -> [Stamp; 2] {
        [&self.table, &self.skips].map(|path| {
            let metadata = fs::metadata(path).ok()?;
            Some((metadata.modified().ok()?, metadata.len(), number(&metadata)))
        })
    }

    /// Reads the files.
    pub(super) fn load(&mut self) -> Result<Contents, StoreError> {
        // Taken before reading: a file that changes meanwhile is read again.
        let stamps = self.stamps();
        let (dir, names) = (&self.dir, &mut self.names);
        let mut name = |spelling: &str| match names.get(spelling) {
            Some(name) => name.clone(),
            None => {
                let name = plain_name(dir, spelling);
                names.insert(spelling.to_string(), name.clone());
                name
            }
        };
        let table = Table::read(read(&self.table)?, &mut name);
        let skipped = read_skips(&self.skips, &mut name);
        let table = table.map_err(|faults| self.faulty(faults))?;
        let skipped = skipped?;
        self.read = stamps;
        Ok(Contents { table, skipped })
    }

    /// Lets `decide` choose marks to be set or taken away, from what the files say, and writes them; gives the marks
    /// that there are then. No other process that uses this writes meanwhile.
    pub(super) fn change<K: Ord>(
        &mut self,
        order: impl Fn(&str) -> K,
        decide: impl FnOnce(&Marks) -> BTreeMap<(String, u32), Option<Mark>>,
    ) -> Result<Marks, StoreError> {
        let _lock = self.lock()?;
        let contents = self.load()?;
        let mut marks = contents.marks();
        let changes = decide(&marks);
        let labels = changes
            .iter()
            .map(|(key, mark)| (key.clone(), if let Some(Mark::Row(y)) = mark { Some(*y) } else { None }))
            .collect();
        let mut skipped = contents.skipped.clone();
        for (key, mark) in &changes {
            match mark {
                Some(Mark::Skip) => skipped.insert(key.clone()),
                _ => skipped.remove(key),
            };
        }
        let bytes = contents.table.with(&labels, order);
        // A label counts more than a skip, so what is there between two of these steps are marks of before or after.
        let both: BTreeSet<_> = contents.skipped.union(&skipped).cloned().collect();
        if both != contents.skipped {
            write(&self.skips, &skips_text(&both))?;
        }
        if let Some(bytes) = bytes {
            write(&self.table, &bytes)?;
        }
        if skipped != both {
            write(&self.skips, &skips_text(&skipped))?;
        }
        for (key, mark) in changes {
            match mark {
                Some(mark) => marks.insert(key, mark),
                None => marks.remove(&key),
            };
        }
        self.read = self.stamps();
        Ok(marks)
    }

    /// The columns last asked for, if they are kept. What is no list of columns is as good as none.
    pub(super) fn columns(&self) -> Option<Vec<u32>> {
        let path = self.dir.join(COLUMNS);
        path.symlink_metadata().ok().filter(|metadata| metadata.is_file())?;
        let text = Bounded::to(1 << 20).without_links().text(&path).ok()?;
        text.trim().split(',').map(|x| x.trim().parse().ok()).collect()
    }

    /// Keeps the columns asked for.
    pub(super) fn keep_columns(&self, columns: &[u32]) -> Result<(), StoreError> {
        write(&self.dir.join(COLUMNS), &columns_text(columns))
    }

    /// Makes sure that marks can be saved, and removes what a process that was killed has left; nothing is changed.
    pub(super) fn check_writable(&self) -> Result<(), StoreError> {
        let _lock = self.lock()?;
        temporary::clear(&self.dir.join(COLUMNS));
        for path in [&self.table, &self.skips] {
            temporary::clear(path);
            let access = as_before(before(path)?);
            // A disk that is full takes the file but nothing in it.
            let written = TemporaryFile::beside(path, &access).and_then(|mut new| {
                new.file().write_all(b"image,x,y\n")?;
                sync_file(new.file(), path)
            });
            written.map_err(|source| StoreError::File {
                path: path.clone(),
                action: "write the file",
                source,
            })?;
        }
        Ok(())
    }

    fn lock(&self) -> Result<Lock, StoreError> {
        let path = self.dir.join(LOCK);
        let start = Instant::now();
        loop {
            // A pipe would be waited for.
            if path.symlink_metadata().is_ok_and(|there| !there.is_file()) {
                return Err(StoreError::Link(path));
            }
            match Lock::take_file(&path) {
                Ok(Some(lock)) => return Ok(lock),
                Ok(None) if start.elapsed() > PATIENCE => return Err(StoreError::Locked(path)),
                Ok(None) => std::thread::sleep(Duration::from_millis(2)),
                Err(source) => return Err(StoreError::File { path, action: "lock the labels", source }),
            }
        }
    }
}

/// What tells one file of a name from the next.
#[cfg(unix)]
fn number(metadata: &fs::Metadata) -> u64 {
    std::os::unix::fs::MetadataExt::ino(metadata)
}

#[cfg(not(unix))]
fn number(_: &fs::Metadata) -> u64 {
    0
}

/// A file's content; none for a file that is not there.
fn read(path: &Path) -> Result<Vec<u8>, StoreError> {
    match LABELS.bytes(path) {
        Ok(bytes) => Ok(bytes),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(Vec::new()),
        Err(source) => Err(StoreError::File { path: path.into(), action: "read the file", source }),
    }
}

/// A file that is to be replaced, if it is there.
fn before(path: &Path) -> Result<Option<fs::Metadata>, StoreError> {
    let before = path.symlink_metadata().ok().filter(fs::Metadata::is_file);
    // A rename would replace it all the same.
    match before.as_ref().is_some_and(|there| there.permissions().readonly()) {
        true => Err(StoreError::ReadOnly(path.into())),
        false => Ok(before),
    }
}

/// Puts a file in its place as a whole, with the permissions it had.
fn write(path: &Path, bytes: &[u8]) -> Result<(), StoreError> {
    replace_now(path, bytes, &as_before(before(path)?)).map_err(|source| StoreError::File {
        path: path.into(),
        action: "write the file",
        source,
    })
}

fn read_skips(
    path: &Path,
    mut name: impl FnMut(&str) -> String,
) -> Result<BTreeSet<(String, u32)>, StoreError> {
    let bytes = read(path)?;
    let fault = |line, problem: String| StoreError::Skips { path: path.into(), line, problem };
    let malformed = |e: CsvError| fault(e.line, e.problem);
    let mut found = BTreeSet::new();
    for (i, record) in CsvReader::new(&bytes).map_err(malformed)?.enumerate() {
        let record = record.map_err(malformed)?;
        let (image, x) = (record.text(0).map_err(malformed)?, record.text(1).map_err(malformed)?);
        if i == 0 {
            if (image, x, record.len()) != ("image", "x", 2) {
                return Err(fault(record.line, "the header is not `image,x`".to_string()));
            }
            continue;
        }
        if record.len() != 2 {
            return Err(fault(record.line, format!("has {} fields, the header has 2", record.len())));
        }
        let x = whole_number(x)
            .and_then(|x| u32::try_from(x).ok())
            .ok_or_else(|| fault(record.line, "x is not a whole number".to_string()))?;
        found.insert((cleaned(image).map_or_else(|| image.to_string(), |image| name(&image)), x));
    }
    Ok(found)
}

/// The file of skipped columns.
pub(super) fn skips_text(skips: &BTreeSet<(String, u32)>) -> Vec<u8> {
    let mut table = csv::Writer::from_writer(Vec::new());
    // Nothing fails that is written to memory.
    let _ = table.write_record(["image", "x"]);
    for (image, x) in skips {
        let _ = table.write_record([image, &x.to_string()]);
    }
    table.into_inner().unwrap_or_default()
}

/// The file of the columns asked for.
pub(super) fn columns_text(columns: &[u32]) -> Vec<u8> {
    let text: Vec<String> = columns.iter().map(u32::to_string).collect();
    format!("{}\n", text.join(",")).into_bytes()
}
