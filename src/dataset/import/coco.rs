//! COCO: one JSON file with the annotated objects of many pictures, as polygons or as run lengths.
//!
//! Objects have no order in which they cover each other: what is not ground covers what is, and what is ignored covers
//! both. Crowds (`iscrowd`) count as any other object.

use std::collections::{BTreeMap, HashMap};
use std::path::Path;

use serde::Deserialize;

use super::item::{Found, Ground, Item, Picture};
use super::names::below;
use super::{ImportError, Labels, Named, Region, Runs, Surface, bounded};
use crate::frames::folder::natural;

/// Most bytes of a file.
const MAX_BYTES: u64 = 4 << 30;

#[derive(Deserialize)]
struct File {
    images: Vec<Image>,
    categories: Vec<Category>,
    annotations: Vec<Annotation>,
}

#[derive(Deserialize)]
struct Image {
    id: u64,
    file_name: String,
    width: Option<u64>,
    height: Option<u64>,
}

#[derive(Deserialize)]
struct Category {
    id: u64,
    name: String,
}

#[derive(Deserialize)]
struct Annotation {
    image_id: u64,
    category_id: u64,
    segmentation: Option<Segmentation>,
}

#[derive(Deserialize)]
#[serde(untagged, expecting = "a segmentation is a list of polygons or has `size` and `counts`")]
enum Segmentation {
    Polygons(Vec<Vec<f64>>),
    Runs { size: [u64; 2], counts: Counts },
}

#[derive(Deserialize)]
#[serde(untagged, expecting = "`counts` is a list of whole numbers or a text")]
enum Counts {
    Numbers(Vec<u64>),
    Text(String),
}

/// A picture while its objects are gathered.
struct Picked {
    image: Image,
    regions: Vec<(Region, Surface)>,
    /// The first fault of its objects.
    fault: Option<ImportError>,
}

/// Finds the pictures of an annotation file, in the natural order of their names, below the folder `images`.
///
/// # Errors
/// If the file is not of this form as a whole. What is wrong with a single picture or object is in [`Found::faulty`].
pub fn find(path: &Path, images: &Path, labels: &Labels) -> Result<Found, ImportError> {
    let file: File = bounded::json(path, MAX_BYTES)?;
    let categories: BTreeMap<u64, &str> = file.categories.iter().map(|c| (c.id, c.name.as_str())).collect();
    let mut found =
        Found { labels: file.categories.iter().map(|c| c.name.clone()).collect(), ..Found::default() };
    let mut places: HashMap<u64, usize> = HashMap::new();
    let mut pictures = Vec::with_capacity(file.images.len());
    for (i, image) in file.images.into_iter().enumerate() {
        if places.insert(image.id, i).is_some() {
            let text = format!("there is an image of the id {} before; give each its own", image.id);
            return Err(ImportError::at(path, format!("images[{i}].id"), text));
        }
        pictures.push(Picked { image, regions: Vec::new(), fault: None });
    }
    for (i, annotation) in file.annotations.into_iter().enumerate() {
        let place = |field: &str| format!("annotations[{i}].{field}");
        let Some(&at) = places.get(&annotation.image_id) else {
            let text = format!("there is no image of the id {}; export the file anew", annotation.image_id);
            return Err(ImportError::at(path, place("image_id"), text));
        };
        let Some(category) = categories.get(&annotation.category_id) else {
            let text =
                format!("there is no category of the id {}; export the file anew", annotation.category_id);
            return Err(ImportError::at(path, place("category_id"), text));
        };
        let picked = &mut pictures[at];
        match region(annotation.segmentation, &mut picked.image) {
            Ok(region) => picked.regions.push((region, labels.of(category))),
            Err(problem) => {
                let error = ImportError::at(path, place("segmentation"), problem);
                picked.fault.get_or_insert(error);
            }
        }
    }
    pictures.sort_by(|a, b| natural(&a.image.file_name, &b.image.file_name));
    for Picked { image, mut regions, fault } in pictures {
        let name = image.file_name.replace('\\', "/");
        let Some(below) = below(&image.file_name) else {
            let fault = ImportError::Outside {
                path: path.into(),
                place: "images[].file_name".to_string(),
                name: image.file_name,
                remedy: "write it as a path below that folder",
            };
            found.faulty.push((name, fault));
            continue;
        };
        if let Some(fault) = fault {
            found.faulty.push((name, fault));
            continue;
        }
        let picture = images.join(below);
        if !picture.is_file() {
            found.leave_out(name, format!("there is no picture {}", picture.display()));
            continue;
        }
        if regions.is_empty() && labels.named == Named::Ground {
            found.leave_out(name, "nothing is annotated in it");
            continue;
        }
        regions.sort_by_key(|(_, surface)| match surface {
            Surface::Ground => 0,
            Surface::Other => 1,
            Surface::Ignored => 2,
        });
        let said = image.width.zip(image.height);
        let ground = Ground::Regions { annotation: path.into(), said, base: labels.base(), regions };
        found.items.push(Item { name, picture: Picture::File(picture), ground });
    }
    Ok(found)
}

/// The region of an object; run lengths tell the size of an image that does not tell it itself.
fn region(segmentation: Option<Segmentation>, image: &mut Image) -> Result<Region, String> {
    match segmentation {
        None => {
            Err("is missing, so that nobody knows which pixels are meant; annotate the outline".to_string())
        }
        Some(Segmentation::Polygons(lists)) if lists.is_empty() => {
            Err("is empty, so that nobody knows which pixels are meant; annotate the outline".to_string())
        }
        Some(Segmentation::Polygons(lists)) => {
            let polygon = |(i, list): (usize, Vec<f64>)| {
                if list.len() < 6 || !list.len().is_multiple_of(2) {
                    return Err(format!(
                        "polygon {i} has {} numbers, and a polygon has two for each of three corners or more; draw it again",
                        list.len()
                    ));
                }
                match list.iter().all(|c| c.is_finite()) {
                    true => Ok(list.chunks_exact(2).map(|point| [point[0], point[1]]).collect()),
                    false => {
                        Err(format!("polygon {i} has a corner that is not a pair of numbers; draw it again"))
                    }
                }
            };
            Ok(Region::Polygons(lists.into_iter().enumerate().map(polygon).collect::<Result<_, String>>()?))
        }
        Some(Segmentation::Runs { size: [height, width], counts }) => {
            let said = (image.width.unwrap_or(width), image.height.unwrap_or(height));
            if said != (width, height) {
                return Err(format!(
                    "is of {width}x{height} pixels, and the image of {}x{}; export the file anew",
                    said.0, said.1
                ));
            }
            (image.width, image.height) = (Some(width), Some(height));
            let sides = u32::try_from(width).ok().zip(u32::try_from(height).ok());
            let sides =
                sides.ok_or_else(|| format!("{width}x{height} pixels are more than any picture has"))?;
            let runs = match counts {
                Counts::Numbers(counts) => Runs::new(&counts, sides),
                Counts::Text(text) => Runs::from_text(&text, sides),
            };
            runs.map(Region::Runs).map_err(|e| e.to_string())
        }
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use image::GrayImage;

    use super::super::View;
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
