//! LabelMe: a JSON file for each picture, with polygons and other shapes, of which later ones cover earlier ones.
//!
//! Read are polygons, rectangles, circles and masks; points, lines and strips of lines have no area: one of a label that is
//! asked for is a fault, others do not count. The picture is the file of its name in the folder of images that is given;
//! without one, or where it has no such file, the picture inside the annotation, and else the file that it names.

use std::path::{Path, PathBuf};

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use image::GrayImage;
use serde::Deserialize;
use serde::de::IgnoredAny;

use super::item::{Found, Ground, Item, Picture};
use super::masks::files;
use super::names::{below, leaf};
use super::{ImportError, Labels, Named, Region, Surface, bounded};
use crate::vision::{decode_gray, is_turned_bytes};

/// Most bytes of a file, the picture in it included.
const MAX_BYTES: u64 = 512 << 20;

#[derive(Deserialize)]
struct File {
    shapes: Vec<Shape>,
    #[serde(rename = "imagePath")]
    path: Option<String>,
    #[serde(rename = "imageData")]
    data: Option<IgnoredAny>,
    #[serde(rename = "imageWidth")]
    width: Option<u64>,
    #[serde(rename = "imageHeight")]
    height: Option<u64>,
}

#[derive(Deserialize)]
struct Shape {
    label: String,
    points: Vec<[f64; 2]>,
    #[serde(rename = "shape_type")]
    kind: Option<String>,
    mask: Option<String>,
}

#[derive(Deserialize)]
struct Data {
    #[serde(rename = "imageData")]
    data: Option<String>,
}

/// Finds the pictures of these files, and of all files `.json` in these folders and those within. A picture that is not
/// inside the file is looked for beside it, under the path that stands there, or under its name alone in `images`.
///
/// # Errors
/// If a folder cannot be read. What is wrong with a single file is in [`Found::faulty`].
pub fn find(paths: &[PathBuf], images: Option<&Path>, labels: &Labels) -> Result<Found, ImportError> {
    let mut found = Found::default();
    for path in paths {
        if path.is_dir() {
            let is_json = |path: &Path| path.extension().is_some_and(|e| e.eq_ignore_ascii_case("json"));
            for name in files(path, is_json, &mut found)? {
                // The path below the folder tells pictures of the same name apart.
                let folder = name.rfind('/').map_or("", |slash| &name[..=slash]);
                one(&path.join(&name), folder, images, labels, &mut found);
            }
        } else {
            one(path, "", images, labels, &mut found);
        }
    }
    Ok(found)
}

/// Notes what a file holds.
fn one(path: &Path, folder: &str, images: Option<&Path>, labels: &Labels, found: &mut Found) {
    let own = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    match read(path, folder, images, labels, found) {
        Ok(Some(item)) => found.items.push(item),
        Ok(None) => {}
        Err(error) => found.faulty.push((format!("{folder}{own}"), error)),
    }
}

fn read(
    path: &Path,
    folder: &str,
    images: Option<&Path>,
    labels: &Labels,
    found: &mut Found,
) -> Result<Option<Item>, ImportError> {
    let file: File = bounded::json(path, MAX_BYTES)?;
    found.labels.extend(file.shapes.iter().map(|shape| shape.label.clone()));
    let given = file.path.unwrap_or_default();
    // A folder that is given counts more than a copy inside.
    let there =
        images.and_then(|images| Some(images.join(below(leaf(&given))?))).filter(|path| path.is_file());
    let (name, picture) = if let Some(there) = there {
        (format!("{folder}{}", leaf(&given)), Picture::File(there))
    } else if file.data.is_some() {
        let own = path.with_extension("").file_name().unwrap_or_default().to_string_lossy().into_owned();
        let name = Some(leaf(&given)).filter(|name| !name.is_empty()).unwrap_or(&own);
        (format!("{folder}{name}"), Picture::Embedded(path.into()))
    } else if let Some(images) = images {
        let name = below(leaf(&given)).ok_or_else(|| outside(path, &given))?;
        (format!("{folder}{}", leaf(&given)), Picture::File(images.join(name)))
    } else {
        let below = below(&given).ok_or_else(|| outside(path, &given))?;
        let parent = path.parent().unwrap_or(Path::new(""));
        (format!("{folder}{}", given.replace('\\', "/")), Picture::File(parent.join(below)))
    };
    if let Picture::File(picture) = &picture
        && !picture.is_file()
    {
        found.leave_out(name, format!("there is no picture {}", picture.display()));
        return Ok(None);
    }
    if file.shapes.is_empty() && labels.named == Named::Ground {
        found.leave_out(name, "nothing is annotated in it");
        return Ok(None);
    }
    let mut regions: Vec<(Region, Surface)> = Vec::with_capacity(file.shapes.len());
    for (i, shape) in file.shapes.iter().enumerate() {
        let at = |problem| ImportError::at(path, format!("shapes[{i}]"), problem);
        match region(shape).map_err(at)? {
            Some(region) => regions.push((region, labels.of(&shape.label))),
            // Of what is asked for nothing is dropped in silence.
            None if labels.names.contains(&shape.label) || labels.ignored.contains(&shape.label) => {
                let kind = shape.kind.as_deref().unwrap_or_default();
                return Err(at(format!(
                    "a {kind} has no area, and it is labelled `{}`; draw a polygon instead, or remove it",
                    shape.label
                )));
            }
            None => {}
        }
    }
    let said = file.width.zip(file.height);
    let ground = Ground::Regions { annotation: path.into(), said, base: labels.base(), regions };
    Ok(Some(Item { name, picture, ground }))
}

fn outside(path: &Path, name: &str) -> ImportError {
    ImportError::Outside {
        path: path.into(),
        place: "imagePath".to_string(),
        name: name.to_string(),
        remedy: "give the folder of the pictures with `--images DIR`, where they are looked for by their names alone",
    }
}

/// The region of a shape, if it has an area.
fn region(shape: &Shape) -> Result<Option<Region>, String> {
    let points = &shape.points;
    if let Some(i) = points.iter().position(|point| !point.iter().all(|c| c.is_finite())) {
        return Err(format!("points[{i}] is not a pair of numbers; draw the shape again"));
    }
    let number = |wanted: usize| match points.len() == wanted {
        true => Ok(()),
        false => {
            Err(format!("has {} points, and {wanted} are needed; draw it again or remove it", points.len()))
        }
    };
    Ok(Some(match shape.kind.as_deref().unwrap_or("polygon") {
        "polygon" if points.len() < 3 => {
            return Err(format!(
                "a polygon of {} points has no area; draw it again or remove it",
                points.len()
            ));
        }
        "polygon" => Region::Polygons(vec![points.clone()]),
        "rectangle" => {
            number(2)?;
            let [[x0, y0], [x1, y1]] = [points[0], points[1]];
            Region::Polygons(vec![vec![[x0, y0], [x1, y0], [x1, y1], [x0, y1]]])
        }
        "circle" => {
            number(2)?;
            let ([x0, y0], [x1, y1]) = (points[0], points[1]);
            Region::Disc { centre: points[0], radius: ((x1 - x0) * (x1 - x0) + (y1 - y0) * (y1 - y0)).sqrt() }
        }
        "mask" => {
            number(2)?;
            bitmap(points[0], shape.mask.as_deref().unwrap_or_default())?
        }
        "point" | "points" | "line" | "linestrip" => return Ok(None),
        other => {
            let known = "polygon, rectangle, circle, mask, point, line and linestrip are read; convert it";
            return Err(format!("the shape_type `{other}` is not known: {known}"));
        }
    }))
}

/// The region of a mask in a shape: a picture whose pixels above 0 belong to it, its upper left one at a point.
fn bitmap([x, y]: [f64; 2], text: &str) -> Result<Region, String> {
    let wrong =
        |problem: &dyn std::fmt::Display| format!("its mask cannot be read: {problem}; draw it again");
    let bytes = STANDARD.decode(text.trim()).map_err(|e| wrong(&e))?;
    let mut reader =
        image::ImageReader::new(std::io::Cursor::new(bytes)).with_guessed_format().map_err(|e| wrong(&e))?;
    let mut limits = image::Limits::default();
    limits.max_alloc = Some(MAX_BYTES);
    reader.limits(limits);
    let mask = reader.decode().map_err(|e| wrong(&e))?.into_luma8();
    let inside = mask.iter().map(|&value| value > 0).collect();
    // What is far outside stays there.
    Ok(Region::Pixels {
        corner: [x.round() as i32, y.round() as i32].map(i64::from),
        width: mask.width(),
        inside,
    })
}

/// The picture inside a file.
pub(super) fn embedded(path: &Path) -> Result<GrayImage, ImportError> {
    let file: Data = bounded::json(path, MAX_BYTES)?;
    let bytes = STANDARD.decode(file.data.unwrap_or_default().trim());
    let bytes = bytes.map_err(|e| {
        ImportError::at(
            path,
            "imageData",
            format!("{e}; save it again, or set it to null to take the file of imagePath"),
        )
    })?;
    if is_turned_bytes(&bytes) {
        return Err(ImportError::Turned { path: path.into() });
    }
    Ok(decode_gray(&bytes, path)?)
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::super::View;
    use super::*;

    fn labels(named: Named, names: &[&str]) -> Labels {
        let names = names.iter().map(ToString::to_string).collect();
        Labels { named, names, ignored: Default::default() }
    }

    fn shape(text: &str) -> Result<Option<Region>, String> {
        region(&serde_json::from_str(text).expect("a shape"))
    }

    #[test]
    fn shapes_become_regions() {
        let rectangle = shape(r#"{"label": "a", "points": [[3, 4], [1, 2]], "shape_type": "rectangle"}"#);
        let corners = vec![[3.0, 4.0], [1.0, 4.0], [1.0, 2.0], [3.0, 2.0]];
        assert_eq!(rectangle, Ok(Some(Region::Polygons(vec![corners]))));
        let circle = shape(r#"{"label": "a", "points": [[3, 4], [6, 8]], "shape_type": "circle"}"#);
        assert_eq!(circle, Ok(Some(Region::Disc { centre: [3.0, 4.0], radius: 5.0 })));
        let old = shape(r#"{"label": "a", "points": [[0, 0], [1, 0], [1, 1]], "line_color": null}"#);
        assert!(matches!(old, Ok(Some(Region::Polygons(_)))));
        for kind in ["point", "line", "linestrip"] {
            let text = format!(r#"{{"label": "a", "points": [[0, 0]], "shape_type": "{kind}"}}"#);
            assert_eq!(shape(&text), Ok(None), "{kind}");
        }
        let mask = r#"{"label": "a", "points": [[1, 2], [3, 4]], "shape_type": "mask", "mask": "AAAA"}"#;
        assert!(shape(mask).expect_err("no picture").contains("its mask cannot be read"));
        assert!(shape(&mask.replace("AAAA", "A A")).expect_err("no base64").contains("draw it again"));
    }

    #[test]
    fn files_name_their_pictures() {
        let dir = tempfile::tempdir().expect("a temporary folder");
        fs::create_dir(dir.path().join("in")).expect("writable");
        GrayImage::new(16, 20).save(dir.path().join("in/a.png")).expect("writable");
        let floor = r#"{"label": "floor", "points": [[0, 5], [16, 5], [16, 20], [0, 20]]}"#;
        let file = |path: &str| format!(r#"{{"shapes": [{floor}], "imagePath": "{path}"}}"#);
        fs::write(dir.path().join("in/a.json"), file("a.png")).expect("writable");
        fs::write(dir.path().join("in/b.json"), file("b.png")).expect("writable");
        fs::write(dir.path().join("c.JSON"), file("in/a.png")).expect("writable");
        fs::write(dir.path().join("d.json"), "{").expect("writable");
        let ground = labels(Named::Ground, &["floor"]);
        let found = find(&[dir.path().to_path_buf()], None, &ground).expect("readable");
        let names: Vec<&str> = found.items.iter().map(|item| item.name.as_str()).collect();
        assert_eq!(names, ["in/a.png", "in/a.png"]);
        assert_eq!((found.left_out.len(), found.left_out[0].name.as_str()), (1, "in/b.png"));
        assert_eq!((found.faulty.len(), found.faulty[0].0.as_str()), (1, "d.json"));
        assert_eq!(found.labels.iter().collect::<Vec<_>>(), ["floor"]);
        let labelled = found.items[0].labelled(&View::default(), (16, 20), &[0, 9]).expect("sound");
        assert_eq!(labelled.labels, [(0, 4), (9, 4)]);
        // Of 20 rows 16 are made: the fourth shows row 4, the fifth row 5.
        let fewer = View { crop: None, size: Some((16, 16)) };
        let labelled = found.items[0].labelled(&fewer, (16, 16), &[3]).expect("sound");
        assert_eq!(labelled.labels, [(3, 3)]);
    }
}
