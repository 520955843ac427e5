//! What the page shows: the images of a folder, the columns, and the marks as they change.

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
use crate::dataset::{DatasetError, Fault, FaultKind, Place};
use crate::detector::{DetectError, Detector};
use crate::vision::{ImageError, load_gray};

/// Why a folder cannot be labelled.
#[derive(Debug, thiserror::Error)]
pub enum SessionError {
    /// There is no such folder.
    #[error(transparent)]
    Folder(DatasetError),
    /// There is nothing to be labelled in it.
    #[error(
        "{}: there is no image that can be labelled; PNG, JPEG, PNM, BMP and others are known by their endings{}",
        .dir.display(), because(.left_out)
    )]
    NoImages {
        /// The folder.
        dir: PathBuf,
        /// What there is.
        left_out: Vec<LeftOut>,
    },
    /// The columns are not inside the images, or too many.
    #[error("{0}")]
    Columns(String),
    /// The labels that there are cannot be read.
    #[error(transparent)]
    Store(#[from] StoreError),
}

fn because(left_out: &[LeftOut]) -> String {
    left_out.first().map_or(String::new(), |first| format!(" (`{}`: {})", first.name, first.why))
}

/// Why an image or the detector's answers to it cannot be shown.
#[derive(Debug, thiserror::Error)]
pub(super) enum ShowError {
    #[error("there is no image of this number")]
    NoImage,
    #[error("no detector has been given; start with `--suggest PROGRAM`")]
    NoDetector,
    #[error("`{0}`: {1}")]
    Moved(String, String),
    #[error(transparent)]
    Image(#[from] ImageError),
    #[error(transparent)]
    Detect(#[from] DetectError),
}

/// A folder that is being labelled.
pub struct Session {
    dir: PathBuf,
    pictures: Vec<Picture>,
    places: BTreeMap<String, usize>,
    size: (u32, u32),
    columns: Vec<u32>,
    left_out: Vec<LeftOut>,
    detector: Option<Box<dyn Detector + Send + Sync>>,
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
    /// If there is no such folder or nothing to be labelled in it, its table is faulty or has labels outside of the
    /// images, the columns are not inside the images.
    pub fn open(dir: &Path, columns: &Columns) -> Result<Session, SessionError> {
        let fault = |dir: &Path| Fault { at: Place::Set, kind: FaultKind::NoFolder(dir.into()) };
        let no_folder =
            || SessionError::Folder(DatasetError::Folder { dir: dir.into(), faults: vec![fault(dir)] });
        let real = dir.canonicalize().ok().filter(|real| real.is_dir()).ok_or_else(no_folder)?;
        let mut store = Store::new(&real)?;
        let contents = store.load()?;
        let named: BTreeSet<String> = contents.table.images().map(String::from).collect();
        let Images { pictures, width, height, left_out } = Images::find(&real, &named);
        if pictures.is_empty() {
            return Err(SessionError::NoImages { dir: dir.into(), left_out });
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
        let kept = store.columns();
        let asked = columns.of(width, kept.clone(), &here).map_err(SessionError::Columns)?;
        if !matches!(columns, Columns::AsBefore(_)) && kept.as_ref() != Some(&asked) {
            // A folder that cannot be written can still be looked at; the first mark tells.
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
            detector: None,
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
        if store.columns().is_none() {
            store.keep_columns(&self.columns)?;
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
        let keys: BTreeSet<&(String, u32)> = before.keys().chain(self.marks.keys()).collect();
        let new: Vec<_> =
            keys.into_iter().filter(|key| before.get(*key) != self.marks.get(*key)).cloned().collect();
        if !new.is_empty() {
            self.revision += 1;
            self.changed.extend(new.into_iter().map(|key| (key, self.revision)));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    fn folder(images: &[&str]) -> tempfile::TempDir {
        let dir = tempfile::tempdir().expect("a temporary folder");
        for name in images {
            let path = dir.path().join(name);
            fs::create_dir_all(path.parent().expect("below")).expect("writable");
            GrayImage::new(40, 30).save(path).expect("writable");
        }
        dir
    }

    fn change(image: &str, x: u32, from: Option<Mark>, to: Option<Mark>) -> Vec<Change> {
        vec![Change { image: image.into(), x, from, also: vec![], to }]
    }

    #[test]
    fn images_are_in_order_and_others_are_named() {
        let dir = folder(&[
            "f10.png",
            "f9.png",
            "images/f1.png",
            "images/f9.png",
            ".hidden.png",
            "deep/down/a.png",
        ]);
        GrayImage::new(41, 30).save(dir.path().join("f11.png")).expect("writable");
        fs::write(dir.path().join("f12.jpg"), "no image").expect("writable");
        fs::write(dir.path().join("labels.csv"), "image,x,y\ndown/a.png,1,2\ndeep/down/a.png,1,2\n")
            .expect("writable");
        let session = Session::open(dir.path(), &Columns::Spread(2)).expect("sound");
        assert_eq!(session.images().collect::<Vec<_>>(), ["deep/down/a.png", "f1.png", "f9.png", "f10.png"]);
        let left_out: Vec<&str> = session.left_out().iter().map(|file| file.name.as_str()).collect();
        assert_eq!(left_out, ["down/a.png", "f12.jpg", "f11.png"]);
        assert_eq!((session.size(), session.columns()), ((40, 30), &[10, 30][..]));
        assert_eq!(session.progress(), Progress { asked: 8, labels: 0, skipped: 0 });
    }

    #[test]
    fn columns_are_those_of_the_table_unless_given() {
        let dir = folder(&["a.png", "b.png", "c.png"]);
        let columns = |columns: Columns| Session::open(dir.path(), &columns).map(|s| s.columns().to_vec());
        assert_eq!(columns(Columns::AsBefore(4)).expect("sound"), [5, 15, 25, 35]);
        fs::write(dir.path().join("labels.csv"), "image,x,y\na.png,7,2\na.png,9,2\nb.png,7,1\nc.png,3,1\n")
            .expect("writable");
        assert_eq!(columns(Columns::AsBefore(4)).expect("sound"), [7]);
        assert_eq!(columns(Columns::These(vec![9, 3, 9])).expect("sound"), [3, 9]);
        // Those last asked for are kept, and are not lost to what is no list.
        assert_eq!(columns(Columns::AsBefore(4)).expect("sound"), [3, 9]);
        for (kept, expected) in [("", [7]), ("7,x", [7]), ("7,40", [7]), (" 8\n", [8])] {
            fs::write(dir.path().join(".labels.columns"), kept).expect("writable");
            assert_eq!(columns(Columns::AsBefore(4)).expect("sound"), expected, "{kept:?}");
        }
        for wrong in [Columns::Spread(41), Columns::Spread(0), Columns::These(vec![40])] {
            assert!(matches!(columns(wrong.clone()), Err(SessionError::Columns(_))), "{wrong:?}");
        }
    }

    #[test]
    fn threads_and_sessions_keep_each_others_marks() {
        let names: Vec<String> = (0..4).map(|i| format!("{i}.png")).collect();
        let dir = folder(&names.iter().map(String::as_str).collect::<Vec<_>>());
        let open = || Session::open(dir.path(), &Columns::Spread(4)).expect("sound");
        let sessions = [open(), open()];
        std::thread::scope(|scope| {
            for (i, name) in names.iter().enumerate() {
                let session = &sessions[i % 2];
                scope.spawn(move || {
                    for &x in session.columns() {
                        for row in 0..4u32 {
                            let from = row.checked_sub(1).map(Mark::Row);
                            let applied = session.apply(change(name, x, from, Some(Mark::Row(row))));
                            assert!(applied.expect("writable").refused.is_empty());
                        }
                    }
                });
            }
        });
        for session in &sessions {
            let (_, cells) = session.since(0).expect("readable");
            assert_eq!(cells.len(), 16);
            assert!(cells.iter().all(|cell| cell.mark == Some(Mark::Row(3))), "{cells:?}");
        }
        let set = crate::dataset::Dataset::load(dir.path()).expect("sound");
        assert_eq!((set.cases().len(), set.labels()), (16, vec![3; 16]));
    }

    #[test]
    fn a_change_that_has_not_seen_the_last_one_is_refused() {
        let dir = folder(&["a.png"]);
        let session = Session::open(dir.path(), &Columns::Spread(1)).expect("sound");
        let apply = |from, to| session.apply(change("a.png", 20, from, to)).expect("writable").refused;
        let (five, six) = (Some(Mark::Row(5)), Some(Mark::Row(6)));
        assert_eq!(apply(None, five), []);
        assert_eq!(apply(None, six), [Cell { image: "a.png".into(), x: 20, mark: five }]);
        // The same again, as when the answer was lost.
        assert_eq!(apply(None, five), []);
        assert_eq!(apply(five, Some(Mark::Skip)), []);
        assert_eq!(session.progress(), Progress { asked: 1, labels: 0, skipped: 1 });
        assert_eq!(apply(five, None), [Cell { image: "a.png".into(), x: 20, mark: Some(Mark::Skip) }]);
        assert_eq!(apply(Some(Mark::Skip), None), []);
        let (revision, cells) = session.since(1).expect("readable");
        assert_eq!(cells, [Cell { image: "a.png".into(), x: 20, mark: None }]);
        assert_eq!(session.since(revision).expect("readable"), (revision, vec![]));
        assert!(session.fault(&change("a.png", 20, None, Some(Mark::Row(30)))[0]).is_some());
        assert!(session.fault(&change("a.png", 20, None, Some(Mark::Row(29)))[0]).is_none());
    }

    #[test]
    fn the_first_mark_does_not_choose_the_columns() {
        let dir = folder(&["a.png", "b.png"]);
        let open = || Session::open(dir.path(), &Columns::AsBefore(4)).expect("sound");
        assert!(
            open().apply(change("a.png", 5, None, Some(Mark::Row(5)))).expect("writable").refused.is_empty()
        );
        assert_eq!(open().columns(), [5, 15, 25, 35]);
    }

    #[test]
    fn a_mark_whose_answer_was_lost_is_ones_own() {
        let dir = folder(&["a.png"]);
        let session = Session::open(dir.path(), &Columns::Spread(1)).expect("sound");
        let apply = |from, also: &[Option<Mark>], to| {
            let change = Change { image: "a.png".into(), x: 20, from, also: also.to_vec(), to };
            session.apply(vec![change]).expect("writable").refused.len()
        };
        let [five, six, seven] = [5, 6, 7].map(|row| Some(Mark::Row(row)));
        assert_eq!(apply(None, &[], five), 0);
        // Moved, and taken back, without knowing of the first one.
        assert_eq!(apply(None, &[five], six), 0);
        assert_eq!(apply(None, &[five, six], None), 0);
        assert_eq!(session.progress().labels, 0);
        // The first one never arrived.
        assert_eq!(apply(None, &[five], six), 0);
        // Somebody else's is another one.
        assert_eq!(apply(None, &[five], seven), 1);
        assert_eq!(apply(None, &[five], None), 1);
    }

    #[test]
    fn a_lock_that_another_program_keeps_ends_in_an_error() {
        let dir = folder(&["a.png"]);
        let session = Session::open(dir.path(), &Columns::Spread(1)).expect("sound");
        let path = dir.path().join(".labels.lock");
        let held = fs::File::create(&path).expect("writable");
        held.lock().expect("free");
        std::thread::scope(|scope| {
            let waiting = scope.spawn(|| session.apply(change("a.png", 20, None, Some(Mark::Row(5)))));
            std::thread::sleep(std::time::Duration::from_millis(100));
            // Nothing else waits for it.
            assert_eq!(session.progress().labels, 0);
            assert_eq!(session.since(0).expect("readable").1, []);
            assert!(!waiting.is_finished());
            let error = waiting.join().expect("no panic").expect_err("locked").to_string();
            assert!(error.contains(".labels.lock: another program has locked"), "{error}");
        });
        drop(held);
        session.apply(change("a.png", 20, None, Some(Mark::Row(5)))).expect("free again");
    }

    #[cfg(unix)]
    #[test]
    fn a_table_keeps_its_permissions_and_a_read_only_one_its_content() {
        use std::os::unix::fs::PermissionsExt;
        let dir = folder(&["a.png"]);
        let table = dir.path().join("labels.csv");
        fs::write(&table, "image,x,y\n").expect("writable");
        let allow = |mode| fs::set_permissions(&table, fs::Permissions::from_mode(mode)).expect("ours");
        allow(0o600);
        let session = Session::open(dir.path(), &Columns::Spread(1)).expect("sound");
        session.apply(change("a.png", 20, None, Some(Mark::Row(5)))).expect("writable");
        let mode = || fs::metadata(&table).expect("there").permissions().mode() & 0o777;
        assert_eq!(mode(), 0o600);
        allow(0o444);
        let refused = session.apply(change("a.png", 20, Some(Mark::Row(5)), Some(Mark::Row(6))));
        let error = refused.expect_err("read-only").to_string();
        assert!(error.contains("labels.csv: is read-only; make the file writable"), "{error}");
        assert_eq!((mode(), session.progress().labels), (0o444, 1));
        assert_eq!(fs::read_to_string(&table).expect("there"), "image,x,y\na.png,20,5\n");
    }

    #[test]
    fn an_image_that_is_replaced_is_not_shown() {
        let dir = folder(&["a.png"]);
        let session = Session::open(dir.path(), &Columns::Spread(1)).expect("sound");
        session.png(0).expect("shown");
        GrayImage::new(20, 15).save(dir.path().join("a.png")).expect("writable");
        let error = session.png(0).expect_err("another size").to_string();
        assert!(error.contains("has 20x15 pixels now, not 40x30"), "{error}");
    }

    #[test]
    fn a_failure_to_write_changes_nothing() {
        let dir = folder(&["a.png"]);
        let session = Session::open(dir.path(), &Columns::Spread(1)).expect("sound");
        for (name, mark) in [("labels.csv", Mark::Row(5)), ("labels.skip.csv", Mark::Skip)] {
            let way = dir.path().join(format!(".{name}.tmp"));
            fs::create_dir(&way).expect("writable");
            let error =
                session.apply(change("a.png", 20, None, Some(mark))).expect_err("in the way").to_string();
            assert!(error.contains(name) && error.contains("cannot write the file"), "{error}");
            assert_eq!(session.progress(), Progress { asked: 1, labels: 0, skipped: 0 });
            fs::remove_dir(&way).expect("there");
        }
        assert_eq!(session.apply(change("a.png", 20, None, Some(Mark::Skip))).expect("writable").refused, []);
    }
}
