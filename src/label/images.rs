//! The images of a folder that can be labelled, and those that cannot.

use std::collections::{BTreeMap, BTreeSet};
use std::io::ErrorKind::{NotADirectory, NotFound};
use std::path::{Path, PathBuf};

use image::metadata::Orientation;
use rayon::prelude::*;

use crate::dataset::image_name::{is_confined, plain_name};
use crate::dataset::scan::IMAGES;
use crate::dataset::{Deeper, FaultKind};
use crate::frames::folder::{files, is_hidden, is_image, natural};
use crate::memory::{default_limit, stretches};
use crate::vision::{ImageError, ImageHeader, load_gray, orientation};

/// An image file that cannot be labelled.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct LeftOut {
    /// Its name.
    pub name: String,
    /// Why.
    pub why: String,
}

/// An image that can be labelled.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Picture {
    /// The name that it has in the table.
    pub(super) name: String,
    /// Where it is, without links.
    pub(super) path: PathBuf,
    /// Whether it has a tag that asks viewers to turn it.
    pub(super) turned: bool,
    /// Whether it is turned by a quarter then.
    pub(super) on_its_side: bool,
}

/// What a folder holds.
#[derive(Debug)]
pub(super) struct Images {
    /// In natural order, all of one size.
    pub(super) pictures: Vec<Picture>,
    pub(super) width: u32,
    pub(super) height: u32,
    pub(super) left_out: Vec<LeftOut>,
    /// Those that are not looked at.
    pub(super) in_subfolders: Option<Deeper>,
}

impl Images {
    /// The images right in the folder and in its subfolder `images`, and those that the table names, each by its one name.
    /// `dir` is without links; a file that is outside of it is left out, as is one of another size than most.
    ///
    /// # Errors
    /// If one of the folders cannot be read.
    pub(super) fn find(dir: &Path, named: &BTreeSet<String>) -> Result<Images, FaultKind> {
        let (listed, mut left_out) = listed(dir)?;
        let in_subfolders = Deeper::find(dir, |name| named.contains(name));
        let listed: BTreeSet<String> = listed.iter().map(|name| plain_name(dir, name)).collect();
        let mut names: Vec<String> = listed.union(named).cloned().collect();
        names.sort_by(|a, b| natural(a, b));
        let found = examine(dir, names);
        let mut sound = Vec::new();
        for found in found {
            match found {
                Ok(found) => sound.push(found),
                Err(fault) => left_out.push(fault),
            }
        }
        let mut sizes: BTreeMap<(u32, u32), usize> = BTreeMap::new();
        for (_, size) in &sound {
            *sizes.entry(*size).or_default() += 1;
        }
        let most = sizes.values().max().copied().unwrap_or_default();
        // Of equally frequent sizes that met first, as in a data set.
        let common = sound.iter().map(|(_, size)| *size).find(|size| sizes[size] == most);
        let (width, height) = common.unwrap_or_default();
        let mut pictures = Vec::with_capacity(sound.len());
        for (picture, size) in sound {
            if size == (width, height) {
                pictures.push(picture);
            } else {
                let why = format!("{}x{} pixels, most are {width}x{height}", size.0, size.1);
                left_out.push(LeftOut { name: picture.name, why });
            }
        }
        Ok(Images { pictures, width, height, left_out, in_subfolders })
    }
}

/// Endings of pictures as phones and cameras save them, which no decoder here reads.
const UNREAD: [&str; 12] =
    ["heic", "heif", "hif", "avif", "jxl", "dng", "cr2", "cr3", "nef", "arw", "raf", "orf"];

/// Whether a file is a picture that cannot be read, by its ending.
fn is_unread(path: &Path) -> bool {
    let ending = path.extension().map(|ending| ending.to_string_lossy().to_lowercase());
    !is_hidden(path) && ending.is_some_and(|ending| UNREAD.contains(&ending.as_str()))
}

/// Names of the files that look like images; those that are no text cannot stand in a table.
pub(super) fn listed(dir: &Path) -> Result<(BTreeSet<String>, Vec<LeftOut>), FaultKind> {
    let (mut names, mut left_out) = (BTreeSet::new(), Vec::new());
    for folder in [dir.join(IMAGES), dir.into()] {
        let found = match files(&folder, |path| is_image(path) || is_unread(path)) {
            Err(error) if folder != dir && matches!(error.kind(), NotFound | NotADirectory) => continue,
            found => {
                found.map_err(|error| FaultKind::NoAccess { folder, cause: error.to_string(), images: 0 })?
            }
        };
        for path in found {
            let name = path.file_name().unwrap_or_default();
            let unusable = |why: &str| LeftOut { name: name.to_string_lossy().into_owned(), why: why.into() };
            match name.to_str() {
                _ if is_unread(&path) => {
                    left_out.push(unusable("pictures of this format are not read; save it as JPEG or PNG"));
                }
                Some(name) => drop(names.insert(name.to_string())),
                None => left_out.push(unusable("the name is not UTF-8; rename the file")),
            }
        }
    }
    left_out.sort_by(|a, b| natural(&a.name, &b.name));
    Ok((names, left_out))
}

/// Whether an orientation exchanges width and height.
fn quarters(orientation: Orientation) -> bool {
    use Orientation::{Rotate90, Rotate90FlipH, Rotate270, Rotate270FlipH};
    matches!(orientation, Rotate90 | Rotate270 | Rotate90FlipH | Rotate270FlipH)
}

/// Where the image of this name is, without links, if it is in the folder.
pub(super) fn confined(dir: &Path, name: &str) -> Result<PathBuf, String> {
    if !is_confined(name) {
        return Err("the name cannot stand in a table; rename the file".to_string());
    }
    let places = [dir.join(IMAGES).join(name), dir.join(name)];
    let path = places.iter().find(|path| path.symlink_metadata().is_ok());
    let path = path.ok_or("the file is missing")?;
    let path = path.canonicalize().map_err(|e| format!("cannot be found: {e}"))?;
    if !path.starts_with(dir) {
        return Err("a link that leads out of the folder".to_string());
    }
    // A pipe would be waited for.
    if path.is_file() { Ok(path) } else { Err("is not a plain file".to_string()) }
}

/// An image with its width and height, or why it cannot be labelled.
type Examined = Result<(Picture, (u32, u32)), LeftOut>;

/// Looks at images. Each is decoded, to find damage, as many at a time as fit into memory.
fn examine(dir: &Path, names: Vec<String>) -> Vec<Examined> {
    let header = |name: &String| {
        let path = confined(dir, name)?;
        let header = ImageHeader::read(&path).map_err(|error| error.to_string())?;
        Ok::<_, String>((path, header))
    };
    let headers: Vec<_> = names.par_iter().map(header).collect();
    let memory = |header: &Result<(PathBuf, ImageHeader), String>| {
        header.as_ref().map_or(0, |(_, header)| header.memory_needed())
    };
    let costs: Vec<u64> = headers.iter().map(memory).collect();
    let mut images: Vec<_> = names.into_iter().zip(headers).collect();
    let decoded = |(name, header): (String, Result<(PathBuf, ImageHeader), String>)| {
        let looked_at = header.and_then(|(path, _)| {
            let image = load_gray(&path).map_err(|error: ImageError| error.to_string())?;
            Ok((path, image.dimensions()))
        });
        match looked_at {
            Ok((path, size)) => {
                let tag = orientation(&path);
                let (turned, on_its_side) = (tag != Orientation::NoTransforms, quarters(tag));
                Ok((Picture { name, turned, on_its_side, path }, size))
            }
            Err(why) => Err(LeftOut { name, why }),
        }
    };
    let mut examined = Vec::with_capacity(images.len());
    for stretch in stretches(&costs, default_limit()) {
        let part: Vec<_> = images.drain(..stretch.len()).collect();
        examined.par_extend(part.into_par_iter().map(decoded));
    }
    examined
}
