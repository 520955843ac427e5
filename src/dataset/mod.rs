//! Data sets: images of one size and the labelled columns in them.
//!
//! Everything that evolves or judges a detector starts here. A set is a folder with `labels.csv` (header
//! `image,x,y`, a row for each fitness case; y is the row, from the top, of the lowest pixel that is not
//! ground; a column `group` may name the place) and the images in its subfolder `images` or beside the table. A file is one
//! image, however its name is spelled. A set is read by [`Dataset::load`],
//! examined by [`check`], taken apart by [`Dataset::split`] and [`Dataset::hold_out`], and handed to the executors by
//! [`Dataset::case_set`]. A [`Transform`] makes of it what other light, another lens or view would have made, and a
//! [`Variation`] adds copies altered so. [`import`] reads what others have annotated. [`Constants`] tells what a detector that never looks would reach: the floor to beat; [`Transience`] whether errors
//! last.
//!
//! ```
//! use image::GrayImage;
//! use vsonar::dataset::{Case, Constants, Dataset, NamedImage};
//!
//! let images = (0..3)
//!     .map(|i| NamedImage { name: format!("frame_{i}.png"), pixels: GrayImage::new(32, 24) })
//!     .collect();
//! let cases = (0..3).map(|image| Case { image, x: 16, y: 6 * image as u32 }).collect();
//! let set = Dataset::new("tiny", images, cases)?;
//! assert_eq!((set.width(), set.height()), (32, 24));
//! assert_eq!(set.labels(), [0, 6, 12]);
//! assert_eq!(set.columns(), [16]);
//! // the answer 6 is within 6 rows of all three labels
//! assert_eq!(Constants::learn(&set, 6.0).overall().correct, 3);
//! # Ok::<(), vsonar::dataset::DatasetError>(())
//! ```

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use image::GrayImage;
use rayon::prelude::*;

use crate::memory;
use crate::vision::{CaseSet, Lane, Planes, WindowSums};

mod between;
mod check;
mod constants;
mod copies;
mod deeper;
mod fault;
pub(crate) mod image_name;
pub mod import;
mod part;
mod pixels;
mod reading;
mod save;
pub mod scale;
pub(crate) mod scan;
mod sequence;
mod split;
mod spread;
pub(crate) mod table;
mod transform;
mod transience;
mod variation;

pub use check::{CheckReport, ColumnReport, Distribution, check, check_within};
pub use constants::{BestConstant, Constants, Score, TOLERANCE, best_constant};
pub use copies::Copies;
pub use deeper::Deeper;
pub use fault::{DatasetError, Fault, FaultKind, Place};
pub use part::{DEFAULT_GAP, ParsePartError, Part, Unit};
pub use reading::{any_colour, has_turned_labels};
pub use save::SaveError;
pub use sequence::Sequence;
pub use split::SplitError;
pub use spread::spread;
pub use transform::{NothingLeft, Transform};
pub use transience::{Episode, Lasting, Transience};
pub use variation::Variation;

/// An image and the name it has in `labels.csv`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NamedImage {
    /// Path of the file below the folder, with `/` between its parts.
    pub name: String,
    /// The gray image.
    pub pixels: GrayImage,
}

/// A fitness case: a column of an image, and the answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Case {
    /// Index of the image in [`Dataset::images`].
    pub image: usize,
    /// The column, 0 to width - 1.
    pub x: u32,
    /// The label: row of the lowest non-ground pixel, 0 to height - 1, from the top.
    pub y: u32,
}

/// A set of labelled images: at least one case, all images of one size of at least 16 x 16, every case inside
/// its image, no image without a case, no column of an image labelled twice.
#[derive(Debug, Clone)]
pub struct Dataset {
    name: String,
    /// The folder that it was read from.
    folder: Option<PathBuf>,
    width: u32,
    height: u32,
    images: Vec<NamedImage>,
    cases: Vec<Case>,
    /// The groups of images, by their names, where there are any.
    groups: BTreeMap<String, String>,
    has_colour: bool,
}

/// Two sets are the same wherever they were read from.
impl PartialEq for Dataset {
    fn eq(&self, other: &Dataset) -> bool {
        (self.width, self.height) == (other.width, other.height)
            && self.name == other.name
            && self.images == other.images
            && self.cases == other.cases
            && self.groups == other.groups
    }
}

impl Eq for Dataset {}

impl Dataset {
    /// A set of these images and cases. The order of the cases is kept; the images are brought into the order
    /// in which the cases first mention them, and those without a case are left out (as a table would).
    ///
    /// # Errors
    /// [`DatasetError::Parts`] with every violation of what a [`Dataset`] promises.
    pub fn new(
        name: impl Into<String>,
        images: Vec<NamedImage>,
        cases: Vec<Case>,
    ) -> Result<Dataset, DatasetError> {
        scan::assemble(name.into(), images, cases)
    }

    /// Reads a folder: `labels.csv` and the images it names.
    ///
    /// The table is UTF-8, its columns `image`, `x` and `y` in any order, and perhaps `group`, the place an image is
    /// from (see [`Dataset::group`]); further columns are ignored. Images are looked for in the subfolder `images` first,
    /// then beside the table; a file that is named in several ways is one image, by the first of its names. The set is
    /// named after the folder.
    ///
    /// # Errors
    /// [`DatasetError::Folder`] with every fault found; [`check`] gives the same faults as a report.
    pub fn load(dir: impl AsRef<std::path::Path>) -> Result<Dataset, DatasetError> {
        Dataset::load_within(dir, memory::default_limit())
    }

    /// The same, with the images and their decoding below so many bytes of memory. Their headers are read first; if they
    /// would take more, no pixel is decoded.
    ///
    /// # Errors
    /// As [`Dataset::load`].
    pub fn load_within(dir: impl AsRef<std::path::Path>, limit: u64) -> Result<Dataset, DatasetError> {
        scan::scan(dir.as_ref(), limit).into_dataset()
    }

    /// Whether any of the files that the images are from has pixels in colour, whose gray depends on the weights of
    /// [`gray`](crate::vision::gray).
    pub fn has_colour(&self) -> bool {
        self.has_colour
    }

    /// The set's name: that of its folder, unless it was made otherwise.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The same under another name.
    #[must_use]
    pub fn named(self, name: impl Into<String>) -> Dataset {
        Dataset { name: name.into(), ..self }
    }

    /// The folder that it, or what it is a part of, was read from; `None` for a set made in memory.
    pub fn folder(&self) -> Option<&Path> {
        self.folder.as_deref()
    }

    /// Width of every image in pixels.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Height of every image in pixels.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// The images, in the order in which the cases first mention them.
    pub fn images(&self) -> &[NamedImage] {
        &self.images
    }

    /// The cases, in the order of `labels.csv`.
    pub fn cases(&self) -> &[Case] {
        &self.cases
    }

    /// The labels, in the order of the cases.
    pub fn labels(&self) -> Vec<u32> {
        self.cases.iter().map(|c| c.y).collect()
    }

    /// The distinct columns asked for, ascending.
    pub fn columns(&self) -> Vec<u32> {
        let mut columns: Vec<u32> = self.cases.iter().map(|c| c.x).collect();
        columns.sort_unstable();
        columns.dedup();
        columns
    }

    /// What the executors run on: the window sums of all images (computed in parallel) and a lane for each case,
    /// in order. It takes some 80 bytes a pixel, see [`Dataset::memory_needed`].
    pub fn case_set(&self) -> CaseSet {
        let images = self.images.par_iter().map(|i| Arc::new(WindowSums::new(&i.pixels))).collect();
        let lanes = self.cases.iter().map(|c| Lane { image: c.image as u32, column: c.x }).collect();
        CaseSet::new(images, lanes).expect("images of one size, cases inside them")
    }

    /// Bytes that [`Dataset::case_set`] and the programs that run on it take at most, to be held against the
    /// machine's memory before. It counts the window sums of all images, which stay; and whichever is more, the
    /// operator planes of as many images as are computed at a time (one on each thread of rayon's pool), or the
    /// strips of all cases for every rectangle that a program can ask for. The images themselves, 1 byte a pixel,
    /// are in memory already and not counted.
    ///
    /// ```
    /// use vsonar::world::Corridor;
    /// // 65 photographs of 4000 x 3000 pixels would take 62 GB: 80 bytes a pixel. This is a small set.
    /// let set = Corridor { width: 64, height: 48, ..Corridor::default() }.render(1, 4)?;
    /// let sums = 4 * 80 * 65 * 49;
    /// assert!(set.memory_needed() > sums && set.memory_needed() < 10 << 20);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn memory_needed(&self) -> u64 {
        self.memory_for(self.images.len(), self.cases.len())
    }

    /// The same for so many images and cases of this size.
    fn memory_for(&self, images: usize, cases: usize) -> u64 {
        let (width, height) = (self.width, self.height);
        let at_a_time = images.min(rayon::current_num_threads());
        let planes = at_a_time as u64 * Planes::memory_needed(width, height);
        let arenas = CaseSet::arenas_memory_needed(cases, height);
        images as u64 * WindowSums::memory_needed(width, height) + planes.max(arenas)
    }

    /// A hash of everything a run depends on: size, images (names and pixels) and cases, in order, but not the
    /// set's name. It is FNV-1a with 64 bits over the numbers as little-endian 64-bit words, each name
    /// preceded by its length in bytes, and each image's pixels row by row; so it is the same everywhere. It
    /// tells accidents (a run resumed on other data), not forgeries.
    pub fn fingerprint(&self) -> u64 {
        let mut hash = Fnv(0xcbf2_9ce4_8422_2325);
        hash.number(u64::from(self.width));
        hash.number(u64::from(self.height));
        hash.number(self.images.len() as u64);
        for image in &self.images {
            hash.number(image.name.len() as u64);
            hash.bytes(image.name.as_bytes());
            hash.bytes(image.pixels.as_raw());
        }
        hash.number(self.cases.len() as u64);
        for case in &self.cases {
            hash.number(case.image as u64);
            hash.number(u64::from(case.x));
            hash.number(u64::from(case.y));
        }
        hash.0
    }
}

/// FNV-1a (Fowler, Noll, Vo), 64 bits.
struct Fnv(u64);

impl Fnv {
    fn bytes(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3);
        }
    }

    fn number(&mut self, number: u64) {
        self.bytes(&number.to_le_bytes());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fnv_matches_published_vectors() {
        for (text, expected) in
            [("", 0xcbf29ce484222325u64), ("a", 0xaf63dc4c8601ec8c), ("foobar", 0x85944171f73967e8)]
        {
            let mut hash = Fnv(0xcbf29ce484222325);
            hash.bytes(text.as_bytes());
            assert_eq!(hash.0, expected, "{text}");
        }
    }
}
