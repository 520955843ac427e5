//! A folder of photographs at another size, with the marks that were made in it.
//!
//! An image is turned as its orientation tag asks, cut to the proportions wanted and scaled ([`View`]). Its marks go with it:
//!
//! | mark of the original | becomes |
//! |---|---|
//! | a column | the column in which its middle lies; none if it is cut off |
//! | a label | the lowest row whose middle is at the labelled row or above it |
//! | 0, ground all the way up | 0 |
//! | height - 1, an obstacle at the bottom | height - 1, unless the bottom is cut off |
//! | a label below what is cut out | none, for it does not tell what the rows above are |
//! | several marks that come to one column | the one nearest to its middle, of equally near ones the left; a label rather than a skip |
//!
//! The other fields of a row stay as they are.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use image::GrayImage;
use image::metadata::Orientation;
use rayon::prelude::*;

use super::images::{LeftOut, confined, listed};
use super::mark::Mark;
use super::session::SessionError;
use super::store::{COLUMNS, Contents, SKIPS, Store, StoreError, columns_text, skips_text};
use crate::dataset::image_name::plain_name;
use crate::dataset::import::{Crop, Names, View, ViewError};
use crate::dataset::scan::{IMAGES, TABLE};
use crate::dataset::{DatasetError, Deeper, Fault, FaultKind, Place};
use crate::frames::folder::natural;
use crate::support::printable::ShownPath as _;
use crate::vision::{ImageError, load_gray, orientation, upright};

/// Size and part of the images, and what becomes of orientation tags.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Wanted {
    /// Width and height of every result in pixels.
    pub size: (u32, u32),
    /// The part that is cut out of each image, of the turned one if it is turned; `None` for the largest part in the middle
    /// with the proportions of `size`.
    pub crop: Option<Crop>,
    /// What becomes of orientation tags.
    pub tags: Tags,
}

/// What becomes of the tags that ask viewers to turn an image.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Tags {
    /// Images without marks are turned. Marks of an image with a tag could be meant either way, and are an error.
    #[default]
    Unmarked,
    /// All are turned, and marks are of the turned image, as viewers show it.
    Apply,
    /// None is turned, and marks are of the image as it is stored, as the label page shows it.
    Ignore,
}

/// What keeps a folder from being resized.
#[derive(Debug, thiserror::Error)]
pub enum ResizeError {
    /// There is no such folder, nothing in it, or its marks cannot be read.
    #[error(transparent)]
    Folder(#[from] SessionError),
    /// An image of the folder cannot be used.
    #[error("{}: {}", .dir.join(&.image.name).shown(), .image.why)]
    Unusable {
        /// The folder.
        dir: PathBuf,
        /// The image.
        image: LeftOut,
    },
    /// An image cannot be decoded.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// An image has marks, and a tag that asks viewers to turn it.
    #[error(
        "{}: has {marks} mark{} and an orientation tag, and nothing says whether the marks are of the image as it is stored (as \
         `vsonar label` shows it) or as viewers turn it", .path.shown(), if *.marks == 1 { "" } else { "s" }
    )]
    Tagged {
        /// The image.
        path: PathBuf,
        /// How many labels and skipped columns it has.
        marks: usize,
    },
    /// The wanted part is not in the image.
    #[error("{}: {source}", .path.shown())]
    View {
        /// The image.
        path: PathBuf,
        /// Why not.
        source: ViewError,
    },
}

impl From<StoreError> for ResizeError {
    fn from(error: StoreError) -> ResizeError {
        ResizeError::Folder(error.into())
    }
}

/// A folder to be resized.
pub struct Resizing {
    dir: PathBuf,
    originals: Vec<Original>,
    left_out: Vec<LeftOut>,
    store: Store,
    contents: Contents,
    columns: Option<Vec<u32>>,
    wanted: Wanted,
}

impl std::fmt::Debug for Resizing {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Resizing")
            .field("dir", &self.dir)
            .field("wanted", &self.wanted)
            .finish_non_exhaustive()
    }
}

/// An image of the folder.
struct Original {
    name: String,
    path: PathBuf,
    /// Its name among the results.
    png: String,
    tag: Orientation,
    /// Its marks, by column.
    marks: BTreeMap<u32, Mark>,
}

/// An image as it becomes.
#[derive(Debug)]
pub struct Resized {
    /// Its path in the new folder.
    pub file: String,
    /// Its pixels.
    pub pixels: GrayImage,
    /// What has become of its marks.
    pub carried: Carried,
}

/// What has become of the marks of an image.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Carried {
    /// The name of the original.
    name: String,
    png: String,
    /// Column and mark of the result, by the original's column.
    marks: BTreeMap<u32, (u32, Mark)>,
    /// What was cut out, and of what size the image was.
    view: View,
    original: (u32, u32),
    /// Whether the image was turned as its tag asks.
    pub turned: bool,
    /// Marks in columns that were cut off.
    pub beside: usize,
    /// Labels below the part that was cut out.
    pub below: usize,
    /// Marks that came to the column of another one.
    pub merged: usize,
}

impl Resizing {
    /// Finds the images of a folder and reads their marks.
    ///
    /// # Errors
    /// If there is no such folder, no image in it, its table is faulty, or marks could be meant either way.
    pub fn open(dir: &Path, wanted: Wanted) -> Result<Resizing, ResizeError> {
        let no_folder = Fault { at: Place::Set, kind: FaultKind::NoFolder(dir.into()) };
        let real = dir.canonicalize().ok().filter(|real| real.is_dir()).ok_or_else(|| {
            SessionError::Folder(DatasetError::Folder { dir: dir.into(), faults: vec![no_folder] })
        })?;
        let mut store = Store::new(&real)?;
        let contents = store.load()?;
        let named: BTreeSet<String> = contents.table.images().map(String::from).collect();
        let unread = |fault: FaultKind| {
            let faults = vec![Fault { at: Place::Set, kind: fault }];
            SessionError::Folder(DatasetError::Folder { dir: dir.into(), faults })
        };
        let (files, mut left_out) = listed(&real).map_err(unread)?;
        let files: BTreeSet<String> = files.iter().map(|name| plain_name(&real, name)).collect();
        let mut names: Vec<&String> = files.union(&named).collect();
        names.sort_by(|a, b| natural(a, b));
        let (mut originals, mut pngs) = (Vec::with_capacity(names.len()), Names::default());
        for name in names {
            match confined(&real, name) {
                Ok(path) => originals.push(Original {
                    name: name.clone(),
                    path,
                    png: pngs.png(name),
                    tag: Orientation::NoTransforms,
                    marks: BTreeMap::new(),
                }),
                Err(why) => left_out.push(LeftOut { name: name.clone(), why }),
            }
        }
        if originals.is_empty() {
            let in_subfolders = Deeper::find(&real, |name| named.contains(name));
            return Err(SessionError::NoImages { dir: dir.into(), left_out, in_subfolders }.into());
        }
        let mut marks: BTreeMap<String, BTreeMap<u32, Mark>> = BTreeMap::new();
        for ((image, x), mark) in contents.marks() {
            marks.entry(image).or_default().insert(x, mark);
        }
        originals.iter_mut().for_each(|image| image.marks = marks.remove(&image.name).unwrap_or_default());
        if wanted.tags != Tags::Ignore {
            originals.par_iter_mut().for_each(|image| image.tag = orientation(&image.path));
        }
        let tagged = |image: &&Original| image.tag != Orientation::NoTransforms && !image.marks.is_empty();
        if let Some(Original { path, marks, .. }) =
            originals.iter().find(tagged).filter(|_| wanted.tags == Tags::Unmarked)
        {
            return Err(ResizeError::Tagged { path: path.clone(), marks: marks.len() });
        }
        let columns = store.columns();
        Ok(Resizing { dir: dir.into(), originals, left_out, store, contents, columns, wanted })
    }

    /// How many images there are.
    pub fn images(&self) -> usize {
        self.originals.len()
    }

    /// The name of an image, by its number.
    pub fn name(&self, index: usize) -> &str {
        &self.originals[index].name
    }

    /// The first file that looks like an image and cannot be one, as an error.
    ///
    /// # Errors
    /// If there is one.
    pub fn all_usable(&self) -> Result<(), ResizeError> {
        let unusable =
            |image: &LeftOut| ResizeError::Unusable { dir: self.dir.clone(), image: image.clone() };
        self.left_out.first().map_or(Ok(()), |image| Err(unusable(image)))
    }

    /// Files that look like images and cannot be.
    pub fn left_out(&self) -> &[LeftOut] {
        &self.left_out
    }

    /// An image, by its number, as it becomes.
    ///
    /// # Errors
    /// If it cannot be decoded, does not hold what is to be cut out, or has labels outside of it.
    ///
    /// # Panics
    /// If there is no image of this number.
    pub fn image(&self, index: usize) -> Result<Resized, ResizeError> {
        let Original { name, path, png, tag, marks } = &self.originals[index];
        let picture = upright(load_gray(path)?, *tag);
        let original @ (width, height) = picture.dimensions();
        let outside: Vec<Fault> = self.contents.table.outside(name, width, height).collect();
        if !outside.is_empty() {
            return Err(self.store.faulty(outside).into());
        }
        let Wanted { size, crop, .. } = self.wanted;
        let view = match crop {
            None => View::filling(original, size),
            crop => View { crop, size: Some(size) },
        };
        let pixels = view.of(picture).map_err(|source| ResizeError::View { path: path.clone(), source })?;
        let carried = Carried {
            turned: *tag != Orientation::NoTransforms,
            ..carried(name, png, marks, view, original)
        };
        Ok(Resized { file: format!("{IMAGES}/{png}"), pixels, carried })
    }

    /// The files of marks for the new folder, by name, if these images are in it: what was marked, and which columns are
    /// asked for.
    pub fn files(&self, images: &[Carried]) -> Vec<(String, Vec<u8>)> {
        let by_name: BTreeMap<&str, &Carried> =
            images.iter().map(|image| (image.name.as_str(), image)).collect();
        let label = |image: &str, x: u32| {
            let image = by_name.get(image)?;
            match *image.marks.get(&x)? {
                (x, Mark::Row(y)) => Some((image.png.as_str(), x, y)),
                (_, Mark::Skip) => None,
            }
        };
        let mut files: Vec<(String, Vec<u8>)> = Vec::new();
        files.extend(self.contents.table.carried(label).map(|bytes| (TABLE.to_string(), bytes)));
        let skips: BTreeSet<(String, u32)> = images
            .iter()
            .flat_map(|image| image.marks.values().map(move |&(x, mark)| (image.png.clone(), x, mark)))
            .filter_map(|(png, x, mark)| (mark == Mark::Skip).then_some((png, x)))
            .collect();
        if !skips.is_empty() {
            files.push((SKIPS.to_string(), skips_text(&skips)));
        }
        if let (Some(columns), Some(Carried { view, original, .. })) = (&self.columns, images.first()) {
            let columns: BTreeSet<u32> =
                columns.iter().filter_map(|&x| view.column_of(*original, x)).collect();
            if !columns.is_empty() {
                files.push((COLUMNS.to_string(), columns_text(&Vec::from_iter(columns))));
            }
        }
        files
    }
}

impl Carried {
    /// Labels of the result.
    pub fn labels(&self) -> usize {
        self.marks.values().filter(|(_, mark)| *mark != Mark::Skip).count()
    }

    /// Skipped columns of the result.
    pub fn skipped(&self) -> usize {
        self.marks.len() - self.labels()
    }

    /// Whether a part of the image was cut off.
    pub fn is_cut(&self) -> bool {
        self.view.crop.is_some()
    }
}

/// The marks of an image as they are in its view.
fn carried(name: &str, png: &str, marks: &BTreeMap<u32, Mark>, view: View, original: (u32, u32)) -> Carried {
    let middles: Vec<u32> = view.columns(original).collect();
    let (mut beside, mut below) = (0, 0);
    // What is best comes first: by column of the result, a label before a skip, the nearest to the middle.
    let mut found: Vec<(u32, bool, u32, u32, Mark)> = Vec::with_capacity(marks.len());
    for (&x, &mark) in marks {
        let Some(column) = view.column_of(original, x) else {
            beside += 1;
            continue;
        };
        let mark = match mark {
            Mark::Skip => Some(Mark::Skip),
            Mark::Row(y) => view.label_of(original, y).map(Mark::Row),
        };
        match mark {
            Some(mark) => {
                found.push((column, mark == Mark::Skip, middles[column as usize].abs_diff(x), x, mark));
            }
            None => below += 1,
        }
    }
    found.sort_unstable_by_key(|&(column, skip, distance, x, _)| (column, skip, distance, x));
    let all = found.len();
    found.dedup_by_key(|(column, ..)| *column);
    Carried {
        name: name.into(),
        png: png.into(),
        merged: all - found.len(),
        marks: found.into_iter().map(|(column, _, _, x, mark)| (x, (column, mark))).collect(),
        view,
        original,
        turned: false,
        beside,
        below,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn marks(of: &[(u32, Mark)], view: View, size: (u32, u32)) -> (Vec<(u32, u32, Mark)>, [usize; 3]) {
        let carried = carried("a.jpg", "a.png", &of.iter().copied().collect(), view, size);
        let marks = carried.marks.iter().map(|(&x, &(column, mark))| (x, column, mark)).collect();
        (marks, [carried.beside, carried.below, carried.merged])
    }

    #[test]
    fn the_nearest_mark_of_a_column_stays() {
        let view = View::filling((400, 300), (40, 30));
        // The middle of column 3 is 35.
        let of = [(30, Mark::Row(9)), (33, Mark::Row(99)), (37, Mark::Row(200)), (39, Mark::Skip)];
        assert_eq!(marks(&of, view, (400, 300)), (vec![(33, 3, Mark::Row(9))], [0, 0, 3]));
        let of = [(30, Mark::Row(99)), (35, Mark::Skip), (40, Mark::Skip)];
        let kept = vec![(30, 3, Mark::Row(9)), (40, 4, Mark::Skip)];
        assert_eq!(marks(&of, view, (400, 300)), (kept, [0, 0, 1]), "a label rather than a skip");
    }

    #[test]
    fn what_is_cut_off_is_counted() {
        // A quarter of the columns at either side.
        let view = View::filling((400, 200), (20, 20));
        let of = [(99, Mark::Row(5)), (100, Mark::Row(0)), (299, Mark::Row(199)), (300, Mark::Skip)];
        let kept = vec![(100, 0, Mark::Row(0)), (299, 19, Mark::Row(19))];
        assert_eq!(marks(&of, view, (400, 200)), (kept, [2, 0, 0]));
        // A quarter of the rows above and below.
        let view = View::filling((200, 400), (20, 20));
        let of = [(5, Mark::Row(99)), (15, Mark::Row(300)), (25, Mark::Row(299)), (35, Mark::Row(399))];
        let kept = vec![(5, 0, Mark::Row(0)), (25, 2, Mark::Row(19))];
        assert_eq!(marks(&of, view, (200, 400)), (kept, [0, 2, 0]));
    }
}
