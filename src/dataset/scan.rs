//! Reading a folder as far as it goes and noting every fault on the way. [`Dataset::load`] and
//! [`super::check`] both stand on [`scan`], so that neither accepts what the other rejects.
//!
//! ```
//! let report = vsonar::dataset::check("no/such/folder");
//! assert_eq!(report.faults()[0].kind.code(), "no-folder");
//! ```

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use image::GrayImage;

use super::deeper::Deeper;
use super::fault::{DatasetError, Fault, FaultKind, Place};
use super::image_name::{identity, is_confined};
use super::reading::{no_access, read_images, unlabelled};
use super::table::{LabelTable, Named, Row, read_table};
use super::{Case, Dataset, NamedImage};
use vsonar_ir::Program;

/// Name of the table in a folder.
pub(crate) const TABLE: &str = "labels.csv";
/// Name of the subfolder for images.
pub(crate) const IMAGES: &str = "images";

/// What a folder holds: the sound part of it, and the faults.
pub(super) struct Scan {
    pub(super) dir: PathBuf,
    pub(super) name: String,
    /// Distinct images named in the table, whether sound or not.
    pub(super) images_named: usize,
    /// Rows of the table below the header, whether sound or not.
    pub(super) rows: usize,
    /// Image files no row names.
    pub(super) unlabelled: Vec<String>,
    /// Image files in subfolders that no row names.
    pub(super) in_subfolders: Option<Deeper>,
    pub(super) faults: Vec<Fault>,
    /// The sound cases and their images, unless there is none.
    pub(super) sound: Option<Dataset>,
}

impl Scan {
    pub(super) fn into_dataset(self) -> Result<Dataset, DatasetError> {
        match self.sound {
            Some(set) if self.faults.is_empty() => Ok(set),
            _ => Err(DatasetError::Folder { dir: self.dir, faults: self.faults }),
        }
    }
}

/// An image as far as it could be had: without pixels its fault is noted already.
struct Picture {
    at: Place,
    name: String,
    pixels: Option<GrayImage>,
}

/// Reads the folder, with its images below `limit` bytes of memory. Never fails: what is wrong is in `faults`, sorted by
/// place.
pub(super) fn scan(dir: &Path, limit: u64) -> Scan {
    let name = folder_name(dir);
    let mut faults = Vec::new();
    let LabelTable { images: named, spellings, rows, count: row_count, .. } =
        if let Some(kind) = no_access(dir, &dir.join(TABLE)) {
            faults.push(Fault { at: Place::Set, kind });
            LabelTable::default()
        } else if !dir.is_dir() {
            faults.push(Fault { at: Place::Set, kind: FaultKind::NoFolder(dir.into()) });
            LabelTable::default()
        } else {
            read_table(dir, &dir.join(TABLE), &mut faults)
        };
    let found = read_images(dir, &named, limit, &mut faults);
    let mut pictures = Vec::with_capacity(named.len());
    let (mut groups, mut has_colour) = (BTreeMap::new(), false);
    for (Named { at, name, group }, found) in named.into_iter().zip(found) {
        has_colour |= found.as_ref().is_some_and(|image| image.has_colour);
        groups.extend(group.map(|group| (name.clone(), group)));
        pictures.push(Picture { at, name, pixels: found.map(|image| image.pixels) });
    }
    let named = pictures.iter().map(|p| identity(dir, &p.name)).collect();
    let unlabelled = unlabelled(dir, &named);
    let in_subfolders = Deeper::find(dir, |name| spellings.contains_key(name));
    let images_named = pictures.len();
    let sound = examine(name.clone(), pictures, rows, &mut faults);
    let sound =
        sound.map(|set| Dataset { groups: set.kept(&groups), folder: Some(dir.into()), has_colour, ..set });
    faults.sort_by_key(|f| f.at);
    Scan { dir: dir.into(), name, images_named, rows: row_count, unlabelled, in_subfolders, faults, sound }
}

/// A set from parts in memory, held to the same rules as a folder.
pub(super) fn assemble(
    name: String,
    images: Vec<NamedImage>,
    cases: Vec<Case>,
) -> Result<Dataset, DatasetError> {
    let mut faults = Vec::new();
    let mut seen = std::collections::BTreeSet::new();
    for (i, image) in images.iter().enumerate() {
        let at = Place::Image(i);
        if !is_confined(&image.name) {
            faults.push(Fault { at, kind: FaultKind::Name(image.name.clone()) });
        }
        if !seen.insert(image.name.as_str()) {
            faults.push(Fault { at, kind: FaultKind::NameTwice(image.name.clone()) });
        }
    }
    let mut rows = Vec::with_capacity(cases.len());
    for (i, case) in cases.iter().enumerate() {
        let at = Place::Case(i);
        if case.image < images.len() {
            let (x, y) = (Some(case.x.into()), Some(case.y.into()));
            let (spelling, bytes, y_bytes) = (None, 0..0, 0..0);
            rows.push(Row { at, image: case.image, spelling, x, y, bytes, y_bytes });
        } else {
            faults.push(Fault { at, kind: FaultKind::NoImage(case.image) });
        }
    }
    if cases.is_empty() {
        faults.push(Fault { at: Place::Set, kind: FaultKind::Empty });
    }
    let pictures = images.into_iter().enumerate();
    let pictures = pictures
        .map(|(i, image)| Picture { at: Place::Image(i), name: image.name, pixels: Some(image.pixels) })
        .collect();
    let sound = examine(name.clone(), pictures, rows, &mut faults);
    faults.sort_by_key(|f| f.at);
    match sound {
        Some(set) if faults.is_empty() => Ok(set),
        _ => Err(DatasetError::Parts { name, faults }),
    }
}

/// The last part of the path, also for `.` and `..`.
pub(super) fn folder_name(dir: &Path) -> String {
    let named = |p: &Path| p.file_name().map(|n| n.to_string_lossy().into_owned());
    named(dir).or_else(|| named(&dir.canonicalize().ok()?)).unwrap_or_else(|| "data".into())
}

/// The size most images have; of equally frequent ones that met first.
fn common_size(pictures: &[Picture]) -> Option<(u32, u32)> {
    let mut counts: Vec<((u32, u32), usize)> = Vec::new();
    for size in pictures.iter().filter_map(|p| p.pixels.as_ref()).map(GrayImage::dimensions) {
        match counts.iter_mut().find(|(s, _)| *s == size) {
            Some((_, count)) => *count += 1,
            None => counts.push((size, 1)),
        }
    }
    let most = counts.iter().map(|&(_, count)| count).max()?;
    counts.iter().find(|&&(_, count)| count == most).map(|&(size, _)| size)
}

/// Holds images and rows against each other; gives the set of the sound ones, if there is any.
fn examine(
    name: String,
    mut pictures: Vec<Picture>,
    rows: Vec<Row>,
    faults: &mut Vec<Fault>,
) -> Option<Dataset> {
    let common = common_size(&pictures);
    let sizes: Vec<Option<(u32, u32)>> =
        pictures.iter().map(|p| p.pixels.as_ref().map(GrayImage::dimensions).or(common)).collect();
    for picture in &mut pictures {
        let (Some((common_width, common_height)), Some(pixels)) = (common, &picture.pixels) else { continue };
        let ((width, height), image, at) = (pixels.dimensions(), picture.name.clone(), picture.at);
        let kind = if width.min(height) < Program::MIN_SIDE {
            FaultKind::Small { image, width, height }
        } else if width.max(height) > Program::MAX_SIDE {
            let cause = format!("{width}x{height} pixels are more than {} a side", Program::MAX_SIDE);
            FaultKind::Image { image, cause }
        } else if (width, height) != (common_width, common_height) {
            FaultKind::Size { image, width, height, common_width, common_height }
        } else {
            continue;
        };
        faults.push(Fault { at, kind });
        picture.pixels = None;
    }
    let mut cases = Vec::with_capacity(rows.len());
    let mut first_at: BTreeMap<(usize, i128), Place> = BTreeMap::new();
    for row in rows {
        let Row { at, image, x, y, .. } = row;
        let name = &pictures[image].name;
        let mut duplicate = false;
        if let Some(x) = x {
            let first = *first_at.entry((image, x)).or_insert(at);
            duplicate = first != at;
            if duplicate {
                faults.push(row.duplicate(name, x, first));
            }
        }
        let Some((width, height)) = sizes[image] else { continue };
        let mut inside = |column, value: Option<i128>, size: u32| {
            let value = value?;
            if (0..i128::from(size)).contains(&value) {
                return Some(value as u32);
            }
            let kind = FaultKind::Outside { column, value, image: name.clone(), max: size.saturating_sub(1) };
            faults.push(Fault { at, kind });
            None
        };
        let (x, y) = (inside('x', x, width), inside('y', y, height));
        if let (Some(x), Some(y), true, false) = (x, y, pictures[image].pixels.is_some(), duplicate) {
            cases.push(Case { image, x, y });
        }
    }
    let (width, height) = common?;
    sound(name, width, height, pictures, cases)
}

/// Drops images without a case and orders the others by their first case.
fn sound(
    name: String,
    width: u32,
    height: u32,
    mut pictures: Vec<Picture>,
    mut cases: Vec<Case>,
) -> Option<Dataset> {
    let mut images = Vec::new();
    let mut place: Vec<Option<usize>> = vec![None; pictures.len()];
    for case in &mut cases {
        let picture = &mut pictures[case.image];
        let new = match place[case.image] {
            Some(new) => new,
            None => {
                let pixels = picture.pixels.take()?;
                images.push(NamedImage { name: std::mem::take(&mut picture.name), pixels });
                images.len() - 1
            }
        };
        place[case.image] = Some(new);
        case.image = new;
    }
    let (groups, has_colour) = (BTreeMap::new(), false);
    (!cases.is_empty()).then_some(Dataset {
        name,
        folder: None,
        width,
        height,
        images,
        cases,
        groups,
        has_colour,
    })
}
