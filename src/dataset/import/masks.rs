//! Pictures and masks in two folders, which belong together by their names.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use image::ImageFormat;

use super::item::{Found, Ground, Item, Picture};
use super::names::stem;
use super::{ImportError, Values};
use crate::frames::folder::natural;

/// Folders within folders that are looked into.
const DEPTH: usize = 16;

/// Where pictures and masks are.
#[derive(Debug, Clone, Default)]
pub struct Folders {
    /// The folder with the pictures.
    pub images: PathBuf,
    /// The folder with the masks; it may be the same one.
    pub masks: PathBuf,
    /// What the names of pictures end with, before the ending; others do not count.
    pub image_suffix: String,
    /// What the names of masks end with.
    pub mask_suffix: String,
}

/// Finds the pictures and their masks, in these folders and those within. A mask belongs to the picture with the same path
/// and name without ending and suffix.
///
/// # Errors
/// If a folder cannot be read, or there are two masks for a picture.
pub fn find(folders: &Folders, ground: &Values, ignored: &Values) -> Result<Found, ImportError> {
    let (ground, ignored) = (Arc::new(ground.clone()), Arc::new(ignored.clone()));
    let mut found = Found::default();
    let mut masks: BTreeMap<String, String> = BTreeMap::new();
    for name in files(&folders.masks, is_image)? {
        let Some(key) = stem(&name).strip_suffix(&folders.mask_suffix) else { continue };
        if let Some(first) = masks.insert(key.to_string(), name.clone()) {
            let text = format!("is a second mask for the picture `{key}`, beside `{first}`; leave one");
            // In one folder without suffixes every picture is its own mask; then this is about pictures.
            return Err(ImportError::mask(&folders.masks.join(name), text));
        }
    }
    let one_folder = folders.images == folders.masks && !folders.mask_suffix.is_empty();
    let mut unused = masks.clone();
    for name in files(&folders.images, is_image)? {
        let stem = stem(&name);
        if one_folder && stem.ends_with(&folders.mask_suffix) {
            continue;
        }
        let Some(key) = stem.strip_suffix(&folders.image_suffix) else { continue };
        let Some(mask) = masks.get(key) else {
            let mask = format!("{key}{}", folders.mask_suffix);
            found.leave_out(&name, format!("there is no mask `{mask}` of any image format"));
            continue;
        };
        unused.remove(key);
        found.items.push(Item {
            picture: Picture::File(folders.images.join(&name)),
            ground: Ground::Mask {
                path: folders.masks.join(mask),
                ground: ground.clone(),
                ignored: ignored.clone(),
            },
            name,
        });
    }
    // Of what has a suffix of its own, or is in a folder of its own.
    for mask in unused.into_values() {
        found.leave_out(mask, "a mask without a picture");
    }
    Ok(found)
}

fn is_image(path: &Path) -> bool {
    ImageFormat::from_path(path).is_ok()
}

/// The files in a folder and those within that are `wanted`, as paths below it with `/`, in natural order. What is hidden
/// does not count, links to folders are not followed, and neither do names count that are no text.
pub(super) fn files(folder: &Path, wanted: impl Fn(&Path) -> bool) -> Result<Vec<String>, ImportError> {
    let mut names = Vec::new();
    let mut folders = vec![(folder.to_path_buf(), String::new(), 0)];
    while let Some((folder, prefix, depth)) = folders.pop() {
        let failed = |e| ImportError::read(&folder, e);
        for entry in fs::read_dir(&folder).map_err(failed)? {
            let entry = entry.map_err(failed)?;
            let Ok(name) = entry.file_name().into_string() else { continue };
            if name.starts_with('.') {
                continue;
            }
            let path = entry.path();
            let name = format!("{prefix}{name}");
            if entry.file_type().map_err(failed)?.is_dir() {
                if depth < DEPTH {
                    folders.push((path, format!("{name}/"), depth + 1));
                }
            } else if wanted(&path) && path.is_file() {
                names.push(name);
            }
        }
    }
    names.sort_by(|a, b| natural(a, b));
    Ok(names)
}
