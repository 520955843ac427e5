//! Pictures and masks in two folders, which belong together by their names.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::item::{Found, Ground, Item, Picture};
use super::names::stem;
use super::{Classes, ImportError};
use crate::frames::folder::{is_hidden, is_image, natural};
use crate::support::printable::ShownPath as _;

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
pub fn find(folders: &Folders, classes: &Classes) -> Result<Found, ImportError> {
    ImportError::unless_folder(&folders.images)?;
    ImportError::unless_folder(&folders.masks)?;
    let classes = Arc::new(classes.clone());
    let mut found = Found::default();
    let mut masks: BTreeMap<String, String> = BTreeMap::new();
    for name in files(&folders.masks, is_image, &mut found)? {
        let Some(key) = stem(&name).strip_suffix(&folders.mask_suffix) else { continue };
        if let Some(first) = masks.insert(key.to_string(), name.clone()) {
            let text = format!("is a second mask for the picture `{key}`, beside `{first}`; leave one");
            // In one folder without suffixes every picture is its own mask; then this is about pictures.
            return Err(ImportError::mask(&folders.masks.join(name), text));
        }
    }
    let mut alone = Vec::new();
    let one_folder = folders.images == folders.masks && !folders.mask_suffix.is_empty();
    let mut unused = masks.clone();
    for name in files(&folders.images, is_image, &mut found)? {
        let stem = stem(&name);
        if one_folder && stem.ends_with(&folders.mask_suffix) {
            continue;
        }
        let Some(key) = stem.strip_suffix(&folders.image_suffix) else { continue };
        let Some(mask) = masks.get(key) else {
            alone.push((key.to_string(), name));
            continue;
        };
        unused.remove(key);
        let mask = folders.masks.join(mask);
        found.items.push(Item {
            source: mask.shown(),
            picture: Picture::File(folders.images.join(&name)),
            ground: Ground::Mask { path: mask, classes: classes.clone() },
            name,
        });
    }
    for (key, name) in alone {
        // Of a mask that is named after the picture only the part behind the name is in the way.
        let named_after = |other: &String| {
            other.strip_prefix(&key).is_some_and(|rest| rest.starts_with(['_', '-', '.', ' ']))
        };
        let near = unused.keys().find(|other| named_after(other)).cloned();
        let suffix = &folders.mask_suffix;
        let mut reason = format!(
            "there is no mask `{key}{suffix}` of any image format; names must be the same but for the ending"
        );
        if let Some((near, mask)) = near.and_then(|near| unused.remove_entry(&near)) {
            reason +=
                &format!(", and `{mask}` is not: `--mask-suffix {}{suffix}` takes it", &near[key.len()..]);
        }
        found.leave_out(name, reason);
    }
    // Of what has a suffix of its own, or is in a folder of its own.
    for mask in unused.into_values() {
        found.leave_out(mask, "a mask without a picture");
    }
    Ok(found.unite())
}

/// The files in a folder and those within that are `wanted`, as paths below it with `/`, in natural order. What is hidden
/// does not count, and links to folders are not followed; names that are no text are left out.
pub(super) fn files(
    folder: &Path,
    wanted: impl Fn(&Path) -> bool,
    found: &mut Found,
) -> Result<Vec<String>, ImportError> {
    let mut names = Vec::new();
    let mut folders = vec![(folder.to_path_buf(), String::new(), 0)];
    while let Some((folder, prefix, depth)) = folders.pop() {
        let failed = |e| ImportError::read(&folder, e);
        for entry in fs::read_dir(&folder).map_err(failed)? {
            let entry = entry.map_err(failed)?;
            let path = entry.path();
            let name = match entry.file_name().into_string() {
                _ if is_hidden(&path) => continue,
                Ok(name) => format!("{prefix}{name}"),
                Err(_) if !wanted(&path) && !path.is_dir() => continue,
                Err(name) => {
                    found.leave_out(
                        format!("{prefix}{}", Path::new(&name).shown()),
                        "its name is not UTF-8; rename it",
                    );
                    continue;
                }
            };
            if entry.file_type().map_err(failed)?.is_dir() {
                if depth < DEPTH {
                    folders.push((path, format!("{name}/"), depth + 1));
                } else {
                    found.leave_out(name, format!("it is a folder in {DEPTH} others, which is too deep"));
                }
            } else if wanted(&path) && path.is_file() {
                names.push(name);
            }
        }
    }
    names.sort_by(|a, b| natural(a, b));
    Ok(names)
}

#[cfg(test)]
mod tests {
    use super::super::{Surface, View};
    use super::*;
    use image::{GrayImage, Luma};

    fn save(path: PathBuf, image: &GrayImage) {
        fs::create_dir_all(path.parent().expect("a folder")).expect("writable");
        image.save(path).expect("writable");
    }

    fn ground(text: &str) -> Classes {
        Classes { ground: text.parse().expect("a list of values"), ..Classes::default() }
    }

    #[test]
    fn pairs_are_found_by_name() {
        let dir = tempfile::tempdir().expect("a temporary folder");
        let image = GrayImage::new(16, 16);
        for name in [
            "a_10.png",
            "a_9.bmp",
            "hall/a_9.png",
            ".hidden.png",
            "._a_9.png",
            "__MACOSX/a_9.png",
            "alone.png",
        ] {
            save(dir.path().join("photos").join(name), &image);
        }
        for name in ["a_9_m.png", "a_10_m.pgm", "hall/a_9_m.png", "a_11_m.png", "a_9.png"] {
            save(dir.path().join("masks").join(name), &image);
        }
        fs::write(dir.path().join("photos/notes.txt"), "x").expect("writable");
        let folders = Folders {
            images: dir.path().join("photos"),
            masks: dir.path().join("masks"),
            image_suffix: String::new(),
            mask_suffix: "_m".to_string(),
        };
        let found = find(&folders, &ground("1")).expect("readable");
        let names: Vec<&str> = found.items.iter().map(|item| item.name.as_str()).collect();
        assert_eq!(names, ["a_9.bmp", "a_10.png", "hall/a_9.png"], "in natural order");
        let left_out: Vec<&str> = found.left_out.iter().map(|out| out.name.as_str()).collect();
        assert_eq!(left_out, ["alone.png", "a_11_m.png"]);
        // Pictures and masks in one folder.
        save(dir.path().join("photos/alone_m.png"), &image);
        let one = Folders { masks: folders.images.clone(), ..folders.clone() };
        let found = find(&one, &ground("1")).expect("readable");
        assert_eq!(found.items.iter().map(|item| item.name.as_str()).collect::<Vec<_>>(), ["alone.png"]);
        save(dir.path().join("masks/a_9_m.bmp"), &image);
        let error = find(&folders, &ground("1")).expect_err("two of them").to_string();
        assert!(error.contains("second mask for the picture `a_9`"), "{error}");
        let nowhere = Folders { images: dir.path().join("none"), ..folders };
        assert!(matches!(find(&nowhere, &ground("1")), Err(ImportError::NoFolder(_))));
        let nowhere = Folders { images: dir.path().join("masks"), masks: dir.path().join("none"), ..nowhere };
        assert!(matches!(find(&nowhere, &ground("1")), Err(ImportError::NoFolder(_))));
    }

    #[test]
    fn labels_are_those_of_the_mask() {
        let dir = tempfile::tempdir().expect("a temporary folder");
        let foot = |x: u32| 3 + x % 7;
        save(dir.path().join("p/a.png"), &GrayImage::from_fn(20, 16, |x, y| Luma([(x * y) as u8])));
        let mask = |x: u32, y: u32| Luma([if y > foot(x) { 7 } else { 200 + (x % 3) as u8 }]);
        save(dir.path().join("m/a.png"), &GrayImage::from_fn(20, 16, mask));
        let folders =
            Folders { images: dir.path().join("p"), masks: dir.path().join("m"), ..Folders::default() };
        let columns: Vec<u32> = (0..20).collect();
        let read = |classes: Classes| {
            let found = find(&folders, &classes).expect("readable");
            found.items[0].labelled(&View::default(), (20, 16), &columns).expect("sound")
        };
        let labelled = read(ground("7"));
        assert_eq!(labelled.labels, columns.iter().map(|&x| (x, foot(x))).collect::<Vec<_>>());
        assert!(labelled.any_ground && labelled.undecided == 0);
        let met: Vec<String> = labelled.values.iter().map(|(value, _)| value.to_string()).collect();
        assert_eq!(met, ["7", "200", "201", "202"]);
        // Columns of the value 201 depend on it.
        let ignored = "201".parse().expect("a value");
        let labelled = read(Classes { ignored, ..ground("7") });
        assert_eq!((labelled.labels.len(), labelled.undecided), (13, 7));
        assert!(labelled.labels.iter().all(|(x, _)| x % 3 != 1));
        assert!(!read(ground("8")).any_ground);
        let both = Classes { ignored: "7".parse().expect("a value"), ..ground("7") };
        assert_eq!(both.surface(super::super::Value::Id(7)), Surface::Ignored);
    }
}
