//! What the page shows: the images of a folder, the columns, and the marks as they change.

mod error;
#[cfg(test)]
mod tests;

use std::cmp::Ordering;
use std::collections::{BTreeMap, BTreeSet};
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError, TryLockError};

use image::GrayImage;
use serde::Serialize;

use super::columns::Columns;
use super::images::{Images, LeftOut, Picture, confined};
use super::mark::{Change, Mark, Marks};
use super::store::{Store, StoreError};
use crate::dataset::{DatasetError, Deeper, Fault, FaultKind, Place};
use crate::detector::Detector;
use crate::support::printable;
use crate::vision::load_gray;

pub use error::SessionError;
pub(super) use error::ShowError;

/// A folder that is being labelled.
pub struct Session {
    dir: PathBuf,
    pictures: Vec<Picture>,
    places: BTreeMap<String, usize>,
    size: (u32, u32),
    columns: Vec<u32>,
    left_out: Vec<LeftOut>,
    in_subfolders: Option<Deeper>,
    detector: Option<Box<dyn Detector + Send + Sync>>,
    /// What else is to be known of the folder, in sentences.
    remarks: Vec<String>,
    table: PathBuf,
    /// Held while the files are read, written or waited for; before `state`, where both are.
    store: Mutex<Store>,
    state: Mutex<State>,
}

impl std::fmt::Debug for Session {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Session").field("dir", &self.dir).finish_non_exhaustive()
    }
}

struct State {
    marks: Marks,
    /// Counts the changes; each cell has the number of its last one.
    revision: u64,
    changed: BTreeMap<(String, u32), u64>,
}

/// How far a labelling has come.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Progress {
    /// Marks that there are to be: a label or a skip for each column of each image.
    pub asked: usize,
    /// Labels among those made.
    pub labels: usize,
    /// Skipped columns among those made.
    pub skipped: usize,
}

/// What has become of changes.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Applied {
    /// The number of the last change to the session.
    pub revision: u64,
    /// Changes that were not made, because the mark was another one than they had seen; with the mark that there is.
    pub refused: Vec<Cell>,
}

/// A column of an image and its mark.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Cell {
    /// Name of the image.
    pub image: String,
    /// The column.
    pub x: u32,
    /// The mark.
    pub mark: Option<Mark>,
}

impl Session {
    /// Finds the images of a folder and reads the marks that there are.
    ///
    /// # Errors
    /// If there is no such folder or nothing to be labelled in it, it cannot be written, its table is faulty or has
    /// labels outside of the images, the columns are not inside the images.
    pub fn open(dir: &Path, columns: &Columns) -> Result<Session, SessionError> {
        let faulty = |kind| {
            let faults = vec![Fault { at: Place::Set, kind }];
            SessionError::Folder(DatasetError::Folder { dir: dir.into(), faults })
        };
        let no_folder = || faulty(FaultKind::NoFolder(dir.into()));
        let real = dir.canonicalize().ok().filter(|real| real.is_dir()).ok_or_else(no_folder)?;
        let mut store = Store::new(&real)?;
        let contents = store.load()?;
        let named: BTreeSet<String> = contents.table.images().map(String::from).collect();
        let Images { pictures, width, height, left_out, in_subfolders } =
            Images::find(&real, &named).map_err(faulty)?;
        if pictures.is_empty() {
            return Err(SessionError::NoImages { dir: dir.into(), left_out, in_subfolders });
        }
        let outside: Vec<Fault> = pictures
            .iter()
            .flat_map(|picture| contents.table.outside(&picture.name, width, height))
            .collect();
        if !outside.is_empty() {
            return Err(store.faulty(outside).into());
        }
        let marks = contents.marks();
        let places: BTreeMap<String, usize> =
            pictures.iter().enumerate().map(|(i, picture)| (picture.name.clone(), i)).collect();
        // Images that are elsewhere may have another width.
        let here = marks.iter().filter(|((image, _), _)| places.contains_key(image));
        let here = here.map(|(key, mark)| (key.clone(), *mark)).collect();
        store.check_writable()?;
        let kept = store.columns();
        let asked = columns.of(width, kept.clone(), &here).map_err(SessionError::Columns)?;
        if !matches!(columns, Columns::AsBefore(_)) && kept.as_ref() != Some(&asked) {
            // They are kept again with the first mark.
            let _ = store.keep_columns(&asked);
        }
        let state = State { marks, revision: 1, changed: BTreeMap::new() };
        Ok(Session {
            dir: real,
            pictures,
            places,
            size: (width, height),
            columns: asked,
            left_out,
            in_subfolders,
            detector: None,
            remarks: Vec::new(),
            table: store.table().to_path_buf(),
            store: Mutex::new(store),
            state: Mutex::new(state),
        })
    }

    /// The folder, without links.
    pub fn dir(&self) -> &Path {
        &self.dir
    }

    /// Names of the images, in order.
    pub fn images(&self) -> impl Iterator<Item = &str> {
        self.pictures.iter().map(|picture| picture.name.as_str())
    }

    /// Names of the images with a tag that asks viewers to turn them. They are shown and labelled as they are stored, and
    /// so detectors see them.
    pub fn turned(&self) -> impl Iterator<Item = &str> {
        self.pictures.iter().filter(|picture| picture.turned).map(|picture| picture.name.as_str())
    }

    /// What whoever labels should know of the folder, in sentences.
    pub fn notes(&self) -> Vec<String> {
        let large = self.remarks.iter().cloned();
        let mut turned = self.turned();
        let turned = turned.next().map(|first| {
            let images = match 1 + turned.count() {
                1 => "1 image".to_string(),
                more => format!("{more} images"),
            };
            let first = printable::line(first);
            format!(
                "{images} with an orientation tag, {first} the first: shown and labelled as stored, not as viewers turn them (`vsonar data resize` turns them)"
            )
        });
        let deeper = self.in_subfolders.as_ref();
        let deeper = deeper.map(|deeper| format!("{deeper}; label such a folder by itself, or move them up"));
        large.chain(turned).chain(deeper).collect()
    }

    /// Adds a sentence to what whoever labels should know of the folder, which is shown before anything is marked.
    pub fn remark(&mut self, text: String) {
        self.remarks.push(text);
    }

    /// What was added to the notes.
    pub(super) fn remarks(&self) -> &[String] {
        &self.remarks
    }

    /// Width and height of the images as viewers show most of them, by their orientation tags.
    pub fn size_in_viewers(&self) -> (u32, u32) {
        let (width, height) = self.size;
        let on_their_side = self.pictures.iter().filter(|picture| picture.on_its_side).count();
        if 2 * on_their_side > self.pictures.len() { (height, width) } else { (width, height) }
    }

    /// Width and height of every image.
    pub fn size(&self) -> (u32, u32) {
        self.size
    }

    /// The columns asked for, from left to right.
    pub fn columns(&self) -> &[u32] {
        &self.columns
    }

    /// Image files that cannot be labelled.
    pub fn left_out(&self) -> &[LeftOut] {
        &self.left_out
    }

    /// Images in subfolders, which are not looked at unless the table names them.
    pub fn in_subfolders(&self) -> Option<&Deeper> {
        self.in_subfolders.as_ref()
    }

    /// Whether there is a detector to suggest labels.
    pub(super) fn suggests(&self) -> bool {
        self.detector.is_some()
    }

    /// Gives the session a detector that suggests labels; it is for images of [`Session::size`].
    pub fn suggest(&mut self, detector: Box<dyn Detector + Send + Sync>) {
        self.detector = Some(detector);
    }

    /// The file of labels.
    pub fn table(&self) -> PathBuf {
        self.table.clone()
    }

    /// What tells this folder from another one that is served under the same address; the same each time.
    pub(super) fn identity(&self) -> String {
        let mut hasher = DefaultHasher::new();
        self.dir.hash(&mut hasher);
        format!("{:016x}", hasher.finish())
    }

    /// How many of the marks asked for are made.
    pub fn progress(&self) -> Progress {
        let state = self.state();
        let asked = self.pictures.len() * self.columns.len();
        let made: Vec<Mark> =
            state.marks.iter().filter(|(key, _)| self.asks(key)).map(|(_, mark)| *mark).collect();
        let skipped = made.iter().filter(|mark| **mark == Mark::Skip).count();
        Progress { asked, labels: made.len() - skipped, skipped }
    }

    /// How many labels the table has, those of other columns and other images included.
    pub fn labels_in_table(&self) -> usize {
        self.state().marks.values().filter(|mark| **mark != Mark::Skip).count()
    }

    /// Whether a mark is wanted there.
    fn asks(&self, (image, x): &(String, u32)) -> bool {
        self.places.contains_key(image) && self.columns.binary_search(x).is_ok()
    }

    fn state(&self) -> MutexGuard<'_, State> {
        // A thread that panicked left marks as the files had them before or after.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Why this change makes no sense, if it does not.
    pub(super) fn fault(&self, change: &Change) -> Option<String> {
        let Change { image, x, .. } = change;
        if !self.places.contains_key(image) {
            return Some(format!("there is no image `{image}`"));
        }
        if self.columns.binary_search(x).is_err() {
            return Some(format!("column {x} is not one of those to be marked"));
        }
        let height = self.size.1;
        match change.to {
            Some(Mark::Row(y)) if y >= height => {
                Some(format!("row {y} is outside the image (0 to {})", height - 1))
            }
            _ => None,
        }
    }

    /// Makes changes and saves them: when this returns, they are on the disk. A change whose mark is not (any more)
    /// what it says in `from` or `also` is refused, unless it is already what it is to be.
    ///
    /// # Errors
    /// If the files cannot be read, are faulty, or cannot be written; then nothing has changed.
    ///
    /// # Panics
    /// If a change is not for an image and a column of the session, or its row is outside the image.
    pub fn apply(&self, changes: Vec<Change>) -> Result<Applied, StoreError> {
        for change in &changes {
            assert_eq!(self.fault(change), None);
        }
        let mut store = self.store.lock().unwrap_or_else(PoisonError::into_inner);
        // They are known from the first mark on, for the marks alone would not tell them.
        if store.columns().is_none()
            && let Err(error) = store.keep_columns(&self.columns)
            // Another command may have been first.
            && store.columns().is_none()
        {
            return Err(error);
        }
        let mut refused = Vec::new();
        let order = |name: &str| self.places.get(name).copied().unwrap_or(usize::MAX);
        let marks = store.change(order, |marks| {
            let mut wanted: BTreeMap<(String, u32), Option<Mark>> = BTreeMap::new();
            for Change { image, x, from, also, to } in changes {
                let key = (image, x);
                let now = wanted.get(&key).copied().unwrap_or_else(|| marks.get(&key).copied());
                if now == from || also.contains(&now) {
                    wanted.insert(key, to);
                } else if now != to {
                    refused.push(Cell { image: key.0, x, mark: now });
                }
            }
            wanted
        })?;
        let mut state = self.state();
        state.take(marks);
        Ok(Applied { revision: state.revision, refused })
    }

    /// The marks that have changed since a revision, with the current one; all of them since 0. Reads the files
    /// again if another program has written them, unless they are being written right now.
    ///
    /// # Errors
    /// If they cannot be read or are faulty.
    pub(super) fn since(&self, revision: u64) -> Result<(u64, Vec<Cell>), StoreError> {
        let store = match self.store.try_lock() {
            Ok(store) => Some(store),
            Err(TryLockError::Poisoned(error)) => Some(error.into_inner()),
            // Whoever writes reads first.
            Err(TryLockError::WouldBlock) => None,
        };
        let news = match store {
            Some(mut store) if store.is_stale() => Some((store.load()?.marks(), store)),
            _ => None,
        };
        let mut state = self.state();
        if let Some((marks, _store)) = news {
            state.take(marks);
        }
        let cell = |key: &(String, u32)| Cell {
            image: key.0.clone(),
            x: key.1,
            mark: state.marks.get(key).copied(),
        };
        let cells = if revision == 0 {
            state.marks.keys().filter(|key| self.asks(key)).map(cell).collect()
        } else {
            let new = state.changed.iter().filter(|(_, at)| **at > revision);
            new.map(|(key, _)| key).filter(|key| self.asks(key)).map(cell).collect()
        };
        Ok((state.revision, cells))
    }

    fn picture(&self, index: usize) -> Result<GrayImage, ShowError> {
        let picture = self.pictures.get(index).ok_or(ShowError::NoImage)?;
        // A file may have become a link since.
        let path = confined(&self.dir, &picture.name);
        let path = path.map_err(|why| ShowError::Moved(picture.name.clone(), why))?;
        let image = load_gray(&path)?;
        if image.dimensions() == self.size {
            return Ok(image);
        }
        let ((width, height), now) = (self.size, image.dimensions());
        let why =
            format!("has {}x{} pixels now, not {width}x{height}; start vsonar label again", now.0, now.1);
        Err(ShowError::Moved(picture.name.clone(), why))
    }

    /// An image as PNG, as detectors see it.
    pub(super) fn png(&self, index: usize) -> Result<Vec<u8>, ShowError> {
        let image = self.picture(index)?;
        let mut bytes = std::io::Cursor::new(Vec::new());
        let encoded = image.write_to(&mut bytes, image::ImageFormat::Png);
        encoded.map_err(|e| ShowError::Moved(self.pictures[index].name.clone(), e.to_string()))?;
        Ok(bytes.into_inner())
    }

    /// The detector's answers in all columns, as rows of the image; none where an answer is no number.
    pub(super) fn suggestions(&self, index: usize) -> Result<Vec<Option<u32>>, ShowError> {
        let detector = self.detector.as_ref().ok_or(ShowError::NoDetector)?;
        let mut rows = vec![0.0; self.columns.len()];
        detector.detect(&self.picture(index)?, &self.columns, &mut rows)?;
        let last = self.size.1.saturating_sub(1) as f32;
        Ok(rows.iter().map(|row| row.is_finite().then(|| row.round().clamp(0.0, last) as u32)).collect())
    }
}

impl State {
    /// Takes these marks for what there is, and notes which ones are new.
    fn take(&mut self, marks: Marks) {
        let before = std::mem::replace(&mut self.marks, marks);
        let new = differences(&before, &self.marks);
        if !new.is_empty() {
            self.revision += 1;
            self.changed.extend(new.into_iter().map(|key| (key, self.revision)));
        }
    }
}

/// Where two sets of marks differ. Both are gone through once, side by side.
fn differences(before: &Marks, after: &Marks) -> Vec<(String, u32)> {
    let (mut before, mut after) = (before.iter().peekable(), after.iter().peekable());
    let mut found = Vec::new();
    loop {
        let order = match (before.peek(), after.peek()) {
            (None, None) => return found,
            (Some(_), None) => Ordering::Less,
            (None, Some(_)) => Ordering::Greater,
            (Some((old, _)), Some((new, _))) => old.cmp(new),
        };
        let old = if order.is_le() { before.next() } else { None };
        let new = if order.is_ge() { after.next() } else { None };
        if old != new {
            found.extend(old.or(new).map(|(key, _)| key.clone()));
        }
    }
}
