//! COCO: one JSON file with the annotated objects of many pictures, as polygons or as run lengths.
//!
//! Objects have no order in which they cover each other: what is not ground covers what is, and what is ignored covers
//! both. Crowds (`iscrowd`) count as any other object. What has no outline, or is of a picture or a category that the file
//! does not have, does not count.

use std::collections::{BTreeMap, HashMap, HashSet};
use std::path::Path;

use super::coco_file::{Annotation, Category, Counts, Entry, File, Id, Image, Outline};
use super::item::{Found, Ground, Item, Picture};
use super::names::{below, by_last_parts, leaf};
use super::{ImportError, Labels, Region, Runs, Surface, bounded};
use crate::frames::folder::natural;
use crate::support::printable::ShownPath as _;

/// Most bytes of a file.
const MAX_BYTES: u64 = 4 << 30;

/// What to do about a file of another form.
const REMEDY: &str = "export the annotations as COCO";

/// A picture while its objects are gathered.
struct Picked {
    image: Image,
    /// Its index in the file.
    index: usize,
    regions: Vec<(Region, Surface)>,
    /// Whether objects that were asked for are faulty.
    is_faulty: bool,
}

/// Finds the pictures of an annotation file, in the natural order of their names, below the folder `images`. A name that
/// leads elsewhere is looked for by its last parts.
///
/// # Errors
/// If the file is not of this form as a whole. What is wrong with a single picture or object is in [`Found::faulty`] and
/// [`Found::faulty_objects`].
pub fn find(path: &Path, images: &Path, labels: &Labels) -> Result<Found, ImportError> {
    ImportError::unless_folder(images)?;
    let file: File = bounded::json(path, MAX_BYTES, REMEDY)?;
    let lack = |list: &str| {
        let text = format!("has no `{list}`, and a COCO file has `images`, `categories` and `annotations`");
        ImportError::form(path, format!("{text}; {REMEDY}"))
    };
    let entries = file.images.ok_or_else(|| lack("images"))?;
    let annotations = file.annotations.ok_or_else(|| lack("annotations"))?;
    if annotations.iter().any(|annotation| annotation.is_panoptic) {
        let text = "this is a panoptic file, whose regions are in PNG files of their own (`segments_info`); convert it to \
                    COCO's detection format, or import the PNG files as masks";
        return Err(ImportError::at(path, "annotations", text));
    }
    let mut found = Found::default();
    let categories = categories(path, file.categories.ok_or_else(|| lack("categories"))?)?;
    found.labels = categories.values().cloned().collect();
    let mut pictures = pictures(path, entries, &mut found)?;
    let places: HashMap<Id, usize> =
        pictures.iter().enumerate().map(|(i, picked)| (picked.image.id.clone(), i)).collect();
    for (i, annotation) in annotations.into_iter().enumerate() {
        let Annotation { id, image, category, outline, .. } = annotation;
        let place = || format!("annotations[{i}]{}", id.map_or(String::new(), |id| format!(" (id {id})")));
        let (image, category) = match (image, category) {
            (Ok(image), Ok(category)) => (image, category),
            (Err(problem), _) | (_, Err(problem)) => {
                found.faulty_objects.push(ImportError::at(path, place(), problem));
                continue;
            }
        };
        let Some(&at) = places.get(&image) else {
            found.skip("of an image that the file does not have", place);
            continue;
        };
        let Some(name) = categories.get(&category) else {
            found.skip("of a category that the file does not have", place);
            continue;
        };
        let picked = &mut pictures[at];
        match region(outline, &mut picked.image) {
            Ok(region) => picked.regions.push((region, labels.of(name))),
            Err(Unusable::Nothing) => found.skip("without any pixel", place),
            Err(Unusable::Unknown) => {
                // A picture whose ground has no outline would be blocked all over.
                picked.is_faulty |= labels.of(name) == Surface::Ground;
                found.skip(format!("named `{name}`, without an outline"), place);
            }
            Err(Unusable::Faulty(problem)) => {
                picked.is_faulty = true;
                found.faulty_objects.push(ImportError::at(path, place(), problem));
            }
        }
    }
    for Picked { image, index, mut regions, is_faulty } in pictures {
        let name = image.file_name.replace('\\', "/");
        if below(leaf(&image.file_name)).is_none() {
            let fault = ImportError::Outside {
                path: path.into(),
                place: format!("images[{index}].file_name"),
                name: image.file_name,
                remedy: "write it as a path below that folder",
            };
            found.faulty.push((name, fault));
            continue;
        }
        let Some((picture, name)) = by_last_parts(images, &image.file_name) else {
            let leaf = leaf(&image.file_name);
            found.leave_out(&name, format!("there is no picture {}", images.join(leaf).shown()));
            continue;
        };
        if let Some(reason) = labels.nothing_left(&regions, is_faulty) {
            found.leave_out(name, reason);
            continue;
        }
        regions.sort_by_key(|(_, surface)| match surface {
            Surface::Ground => 0,
            Surface::Other => 1,
            Surface::Ignored => 2,
        });
        let said = image.width.zip(image.height);
        let ground = Ground::Regions { annotation: path.into(), said, base: labels.base(), regions };
        let source = format!("{}: images[{index}]", path.shown());
        found.items.push(Item { name, picture: Picture::File(picture), ground, source });
    }
    found.items.sort_by(|a, b| natural(&a.name, &b.name));
    Ok(found.unite())
}

/// The names of the categories.
fn categories(path: &Path, entries: Vec<Entry<Category>>) -> Result<BTreeMap<Id, String>, ImportError> {
    let mut names = BTreeMap::new();
    for (i, Entry(entry)) in entries.into_iter().enumerate() {
        let fault = |problem| ImportError::at(path, format!("categories[{i}]"), problem);
        let category = entry.map_err(fault)?;
        let text = format!(
            "there is a category of the id {} before; give each its own, and export the file anew",
            category.id
        );
        if names.insert(category.id, category.name).is_some() {
            return Err(fault(text));
        }
    }
    Ok(names)
}

/// The pictures, without their objects.
fn pictures(path: &Path, entries: Vec<Entry<Image>>, found: &mut Found) -> Result<Vec<Picked>, ImportError> {
    let mut seen = HashSet::new();
    let mut pictures = Vec::with_capacity(entries.len());
    for (index, Entry(entry)) in entries.into_iter().enumerate() {
        let place = format!("images[{index}]");
        match entry {
            Err(problem) => found.faulty.push((place.clone(), ImportError::at(path, place, problem))),
            Ok(image) if !seen.insert(image.id.clone()) => {
                let text = format!("there is an image of the id {} before; give each its own", image.id);
                return Err(ImportError::at(path, format!("{place}.id"), text));
            }
            Ok(image) => pictures.push(Picked { image, index, regions: Vec::new(), is_faulty: false }),
        }
    }
    Ok(pictures)
}

/// Why an object has no region.
enum Unusable {
    Nothing,
    Unknown,
    Faulty(String),
}

/// The region of an object; run lengths tell the size of an image that does not tell it itself.
fn region(outline: Outline, image: &mut Image) -> Result<Region, Unusable> {
    let (size, counts) = match outline {
        Outline::Polygons(polygons) => return Ok(Region::Polygons(polygons)),
        Outline::Runs { size, counts } => (size, counts),
        Outline::Nothing => return Err(Unusable::Nothing),
        Outline::Unknown => return Err(Unusable::Unknown),
        Outline::Faulty(problem) => return Err(Unusable::Faulty(problem)),
    };
    let [height, width] = size;
    let said = (image.width.unwrap_or(width), image.height.unwrap_or(height));
    if said != (width, height) {
        return Err(Unusable::Faulty(format!(
            "its segmentation is of {width}x{height} pixels, and the image of {}x{}; export the file anew",
            said.0, said.1
        )));
    }
    let sides = u32::try_from(width).ok().zip(u32::try_from(height).ok());
    let sides = sides.ok_or_else(|| {
        Unusable::Faulty(format!("its segmentation is of {width}x{height} pixels, more than any picture has"))
    })?;
    let runs = match counts {
        Counts::Numbers(counts) => Runs::new(&counts, sides),
        Counts::Text(text) => Runs::from_text(&text, sides),
    };
    let runs = runs.map_err(|e| Unusable::Faulty(e.to_string()))?;
    (image.width, image.height) = (Some(width), Some(height));
    Ok(Region::Runs(runs))
}

#[cfg(test)]
mod tests {
    use std::fs;

    use image::GrayImage;

    use super::super::{Named, View};
    use super::*;

    const COCO: &str = r#"{
        "images": [
            {"id": 3, "file_name": "b_10.png", "width": 16, "height": 20},
            {"id": 2, "file_name": "b_9.png"},
            {"id": 1, "file_name": "empty.png"}
        ],
        "categories": [{"id": 1, "name": "floor"}, {"id": 2, "name": "box"}, {"id": 3, "name": "glass"}],
        "annotations": [
            {"image_id": 3, "category_id": 2, "segmentation": [[4, 0, 8, 0, 8, 12, 4, 12], [9, 0, 10, 0, 10, 7, 9, 7]]},
            {"image_id": 3, "category_id": 1, "segmentation": [[0, 5, 16, 5, 16, 20, 0, 20]], "iscrowd": 0},
            {"image_id": 2, "category_id": 1, "iscrowd": 1, "segmentation": {"size": [20, 16], "counts": [5, 15, 300]}},
            {"image_id": 2, "category_id": 3, "segmentation": {"size": [20, 16], "counts": "d05W9"}}
        ]
    }"#;

    fn found(named: Named, names: &[&str], ignored: &[&str]) -> (tempfile::TempDir, Found) {
        let dir = tempfile::tempdir().expect("a temporary folder");
        for name in ["b_9.png", "b_10.png", "empty.png"] {
            GrayImage::new(16, 20).save(dir.path().join(name)).expect("writable");
        }
        let file = dir.path().join("coco.json");
        fs::write(&file, COCO).expect("writable");
        let set = |names: &[&str]| names.iter().map(ToString::to_string).collect();
        let labels = Labels { named, names: set(names), ignored: set(ignored) };
        let found = find(&file, dir.path(), &labels).expect("sound");
        (dir, found)
    }

    #[test]
    fn obstacles_cover_ground_whatever_the_order() {
        let (_dir, found) = found(Named::Ground, &["floor"], &[]);
        let names: Vec<&str> = found.items.iter().map(|item| item.name.as_str()).collect();
        assert_eq!(names, ["b_9.png", "b_10.png"], "in natural order");
        assert_eq!(found.left_out[0].name, "empty.png");
        let labels = |i: usize, columns: &[u32]| {
            found.items[i].labelled(&View::default(), (16, 20), columns).expect("sound").labels
        };
        assert_eq!(labels(1, &[3, 4, 7, 8, 9]), [(3, 4), (4, 11), (7, 11), (8, 4), (9, 6)]);
        assert_eq!(labels(0, &[0, 1]), [(0, 4), (1, 19)]);
    }

    #[test]
    fn without_obstacles_all_is_ground() {
        let (_dir, found) = found(Named::Other, &["box"], &["glass"]);
        assert_eq!(found.items.len(), 3);
        let labelled =
            |i: usize| found.items[i].labelled(&View::default(), (16, 20), &[0, 1, 4]).expect("sound");
        assert_eq!(labelled(2).labels, [(0, 0), (1, 0), (4, 0)]);
        assert_eq!(labelled(1).labels, [(0, 0), (1, 0), (4, 11)]);
        // Glass, of which nobody knows: 20 pixels, 5 of it, and the rest not.
        assert_eq!((labelled(0).labels, labelled(0).undecided), (vec![(0, 0), (4, 0)], 1));
    }
}
