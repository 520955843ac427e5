//! The images of a folder: where they are, what their headers say, and their pixels, within a limit of memory.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

use rayon::prelude::*;

use super::fault::{Fault, FaultKind, Place};
use super::image_name::{identity, image_path};
use super::scan::{IMAGES, TABLE};
use super::table::Named;
use crate::frames::folder::images;
use crate::memory::stretches;
use crate::vision::{DecodedImage, ImageError, ImageHeader, is_turned, load};

/// Reads the images that a table names; those that cannot be had are `None`, and why is in `faults`. All headers are read
/// before the first pixel.
pub(super) fn read_images(
    dir: &Path,
    named: &[Named],
    limit: u64,
    faults: &mut Vec<Fault>,
) -> Vec<Option<DecodedImage>> {
    let headers: Vec<_> = named.par_iter().map(|image| header(dir, &image.name)).collect();
    let mut unsearched: BTreeMap<(PathBuf, String), usize> = BTreeMap::new();
    let mut known: Vec<(usize, PathBuf, ImageHeader)> = Vec::with_capacity(named.len());
    for (i, header) in headers.into_iter().enumerate() {
        match header {
            Ok((path, header)) => known.push((i, path, header)),
            // One fault for a folder, not one for each image in it.
            Err(FaultKind::NoAccess { folder, cause, .. }) => {
                *unsearched.entry((folder, cause)).or_default() += 1;
            }
            Err(kind) => faults.push(Fault { at: named[i].at, kind }),
        }
    }
    faults.extend(unsearched.into_iter().map(|((folder, cause), images)| Fault {
        at: Place::Set,
        kind: FaultKind::NoAccess { folder, cause, images },
    }));
    let mut found: Vec<Option<DecodedImage>> = vec![None; named.len()];
    // The gray images stay; beside them a decoder needs its own.
    let kept = known.iter().fold(0u64, |sum, (.., header)| sum.saturating_add(header.pixels()));
    let decoding: Vec<u64> = known.iter().map(|(.., header)| header.memory_needed()).collect();
    let needed = kept.saturating_add(decoding.iter().copied().max().unwrap_or_default());
    if needed > limit {
        let largest = known.iter().max_by_key(|(i, _, header)| (header.memory_needed(), usize::MAX - i));
        faults.extend(largest.map(|(i, _, header)| Fault {
            at: Place::Set,
            kind: FaultKind::Memory {
                images: known.len(),
                needed,
                limit,
                largest: named[*i].name.clone(),
                width: header.width,
                height: header.height,
            },
        }));
        return found;
    }
    for stretch in stretches(&decoding, limit - kept) {
        let decoded: Vec<_> = known[stretch]
            .par_iter()
            .map(|(i, path, _)| (*i, load(path).map_err(|error| unusable(&named[*i].name, error))))
            .collect();
        for (i, decoded) in decoded {
            match decoded {
                Ok(image) => found[i] = Some(image),
                Err(kind) => faults.push(Fault { at: named[i].at, kind }),
            }
        }
    }
    found
}

fn header(dir: &Path, name: &str) -> Result<(PathBuf, ImageHeader), FaultKind> {
    let path = path_of(dir, name)?;
    let header = ImageHeader::read(&path).map_err(|error| unusable(name, error))?;
    Ok((path, header))
}

fn unusable(name: &str, error: ImageError) -> FaultKind {
    let image = name.to_owned();
    match error {
        ImageError::TooSmall { width, height, .. } => FaultKind::Small { image, width, height },
        other => FaultKind::Image { image, cause: other.to_string() },
    }
}

/// Where an image is.
fn path_of(dir: &Path, name: &str) -> Result<PathBuf, FaultKind> {
    image_path(dir, name).ok_or_else(|| {
        let candidates = [dir.join(IMAGES).join(name), dir.join(name)];
        let unsearched = candidates.iter().find_map(|path| no_access(path.parent().unwrap_or(dir), path));
        unsearched.unwrap_or_else(|| FaultKind::MissingImage(name.into()))
    })
}

/// The fault of a folder in which a file cannot be looked for, whether it is there or not.
pub(super) fn no_access(folder: &Path, file: &Path) -> Option<FaultKind> {
    let is_there =
        |error: &io::Error| !matches!(error.kind(), ErrorKind::NotFound | ErrorKind::NotADirectory);
    fs::metadata(file).err().filter(is_there)?;
    // The file alone may be at fault: a name too long, a link in a circle.
    let cause = fs::metadata(folder.join(".")).err().filter(is_there)?.to_string();
    Some(FaultKind::NoAccess { folder: folder.into(), cause, images: 0 })
}

/// The images of a set from this folder with a tag that asks viewers to turn them.
pub(super) fn turned(dir: &Path, names: &[String]) -> Vec<String> {
    let turned = |name: &&String| path_of(dir, name).is_ok_and(|path| is_turned(&path));
    names.par_iter().filter(turned).cloned().collect()
}

/// Width and height of the first of these images whose header can be read.
pub(super) fn size_of(dir: &Path, names: &[String]) -> Option<(u32, u32)> {
    let header = |name: &String| ImageHeader::read(&path_of(dir, name).ok()?).ok();
    names.iter().find_map(header).map(|header| (header.width, header.height))
}

/// Files in the folder and in its subfolder that count as images by their names, and whose identities are not among
/// those of the images that the table names.
pub(super) fn unlabelled(dir: &Path, named: &BTreeSet<PathBuf>) -> Vec<String> {
    let mut out: Vec<String> = files(dir)
        .filter(|path| path.is_file())
        .filter_map(|path| path.file_name().map(|name| name.to_string_lossy().into_owned()))
        .filter(|name| !named.contains(&identity(dir, name)))
        .collect();
    out.sort_unstable();
    out.dedup();
    out
}

/// The image files in the subfolder and in the folder itself.
fn files(dir: &Path) -> impl Iterator<Item = PathBuf> {
    [dir.join(IMAGES), dir.into()].into_iter().flat_map(|folder| images(&folder).unwrap_or_default())
}

/// Whether a folder has a table of labels and images with a tag that asks viewers to turn them, so that it counts of
/// which image the labels are.
pub fn has_turned_labels(dir: impl AsRef<Path>) -> bool {
    let dir = dir.as_ref();
    dir.join(TABLE).exists() && files(dir).any(|path| is_turned(&path))
}

/// Whether any image file of a folder has pixels in colour; none if there is no image file in it.
pub fn any_colour(dir: impl AsRef<Path>) -> Option<bool> {
    let mut files = files(dir.as_ref()).peekable();
    files.peek()?;
    let stores = |path: &PathBuf| ImageHeader::read(path).is_ok_and(|header| header.stores_colour);
    Some(files.any(|path| stores(&path) && load(&path).is_ok_and(|image| image.has_colour)))
}
