//! LabelMe: a JSON file for each picture, with polygons and other shapes, of which later ones cover earlier ones.
//!
//! Read are all closed shapes and masks; points, lines and shapes that are not known have no area: one of a label that is
//! asked for is a fault, others do not count. The picture is the file of its name in the folder of images that is given,
//! found by the last parts of its path; without one, or where it has no such file, the picture inside the annotation, and
//! else the file that it names, or that the last parts of its path name next to it.

use std::collections::BTreeSet;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::{Path, PathBuf};

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use image::GrayImage;
use serde::Deserialize;
use serde_json::Value;

use super::item::{Found, Ground, Item, Picture};
use super::json::{pair, shown, whole_value};
use super::masks::files;
use super::names::{below, by_last_parts, from_within, leaf};
use super::{ImportError, Labels, Region, Surface, bounded};
use crate::support::printable::ShownPath as _;
use crate::vision::{decode_gray, is_turned_bytes};

/// Most bytes of a file, the picture in it included.
const MAX_BYTES: u64 = 512 << 20;

/// What to do about a file of another form.
const REMEDY: &str = "move it elsewhere, or export the annotations as LabelMe";

#[derive(Deserialize)]
struct File {
    shapes: Option<Vec<Shape>>,
    #[serde(rename = "imagePath")]
    path: Option<String>,
    #[serde(rename = "imageData")]
    data: Option<Embedded>,
    #[serde(rename = "imageWidth")]
    width: Option<Value>,
    #[serde(rename = "imageHeight")]
    height: Option<Value>,
}

/// The picture in a file: what tells it from others, none where the text of it is empty.
#[derive(Deserialize)]
#[serde(from = "Value")]
struct Embedded(Option<u64>);

impl From<Value> for Embedded {
    fn from(value: Value) -> Embedded {
        if value.as_str().is_some_and(|text| text.trim().is_empty()) {
            return Embedded(None);
        }
        let mut hasher = DefaultHasher::new();
        value.as_str().unwrap_or_default().trim().hash(&mut hasher);
        Embedded(Some(hasher.finish()))
    }
}

/// A shape, or what is wrong with it.
#[derive(Deserialize)]
#[serde(from = "Value")]
struct Shape {
    /// Empty where there is none.
    label: String,
    region: Result<Region, Unusable>,
}

/// Why a shape has no region.
#[derive(Debug, Clone, PartialEq)]
enum Unusable {
    /// It has no area, or one that is not known; which kind it is.
    NoArea(String),
    /// What is wrong.
    Faulty(String),
}

impl From<Value> for Shape {
    fn from(value: Value) -> Shape {
        match value.get("label").and_then(Value::as_str) {
            Some(label) => Shape { label: label.to_string(), region: region(&value) },
            None => {
                let problem = "has no `label`; give it one, or remove it".to_string();
                Shape { label: String::new(), region: Err(Unusable::Faulty(problem)) }
            }
        }
    }
}

#[derive(Deserialize)]
struct Data {
    #[serde(rename = "imageData")]
    data: Option<String>,
}

/// Finds the pictures of these files, and of all files `.json` in these folders and those within. A picture that is not
/// inside the file is looked for under the path that stands there, or by the last parts of that in `images` or else beside
/// the file. A file that is given twice counts once.
///
/// # Errors
/// If a folder cannot be read, or one of the paths is not there. What is wrong with a single file or shape is in
/// [`Found::faulty`] and [`Found::faulty_objects`].
pub fn find(paths: &[PathBuf], images: Option<&Path>, labels: &Labels) -> Result<Found, ImportError> {
    images.map_or(Ok(()), ImportError::unless_folder)?;
    let (mut found, mut seen) = (Found::default(), BTreeSet::new());
    for path in paths {
        path.metadata().map_err(|error| ImportError::read(path, error))?;
        if path.is_dir() {
            let is_json = |path: &Path| path.extension().is_some_and(|e| e.eq_ignore_ascii_case("json"));
            for name in files(path, is_json, &mut found)? {
                // The path below the folder tells pictures of the same name apart.
                let within = name.rfind('/').map_or("", |slash| &name[..=slash]);
                let file = path.join(&name);
                if seen.insert(file.canonicalize().unwrap_or_else(|_| file.clone())) {
                    one(&file, (path, within), images, labels, &mut found);
                }
            }
        } else if seen.insert(path.canonicalize().unwrap_or_else(|_| path.clone())) {
            let root = path.parent().unwrap_or(Path::new(""));
            one(path, (root, ""), images, labels, &mut found);
        }
    }
    Ok(found.unite())
}

/// Notes what a file holds; it is `within` a folder of the first one.
fn one(
    path: &Path,
    (root, within): (&Path, &str),
    images: Option<&Path>,
    labels: &Labels,
    found: &mut Found,
) {
    let own = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    match read(path, (root, within), images, labels, found) {
        Ok(Some(item)) => found.items.push(item),
        Ok(None) => {}
        Err(error) => found.faulty.push((format!("{within}{own}"), error)),
    }
}

fn read(
    path: &Path,
    (root, within): (&Path, &str),
    images: Option<&Path>,
    labels: &Labels,
    found: &mut Found,
) -> Result<Option<Item>, ImportError> {
    let file: File = bounded::json(path, MAX_BYTES, REMEDY)?;
    let Some(shapes) = file.shapes else {
        let text = "is not a LabelMe file, for it has no `shapes`";
        return Err(ImportError::form(path, format!("{text}; {REMEDY}")));
    };
    let labelled = shapes.iter().filter(|shape| !shape.label.is_empty());
    found.labels.extend(labelled.map(|shape| shape.label.clone()));
    let given = file.path.unwrap_or_default();
    let own = || path.with_extension("").file_name().unwrap_or_default().to_string_lossy().into_owned();
    // A folder that is given counts more than a copy inside.
    let there = images.and_then(|images| by_last_parts(images, &given));
    let (name, picture) = if let Some((there, name)) = there {
        (format!("{within}{name}"), Picture::File(there))
    } else if let Some(digest) = file.data.and_then(|data| data.0) {
        let name = Some(leaf(&given)).filter(|name| !name.is_empty()).map_or_else(own, str::to_string);
        (format!("{within}{name}"), Picture::Embedded { path: path.into(), digest })
    } else {
        let leaf = below(leaf(&given)).ok_or_else(|| outside(path, &given))?;
        let named = from_within(within, &given).map(|name| (root.join(&name), name));
        let named = named.filter(|(picture, _)| images.is_none() && picture.is_file());
        let beside = root.join(within);
        let moved = || by_last_parts(&beside, &given).map(|(there, name)| (there, format!("{within}{name}")));
        let Some((picture, name)) = named.or_else(|| images.is_none().then(moved)?) else {
            let picture = images.unwrap_or(&beside).join(&leaf);
            let remedy = if images.is_none() { "; `--images DIR` gives the folder with it" } else { "" };
            let name = format!("{within}{}", leaf.display());
            found.leave_out(name, format!("there is no picture {}{remedy}", picture.shown()));
            return Ok(None);
        };
        (name, Picture::File(picture))
    };
    let faults = found.faulty_objects.len();
    let mut regions: Vec<(Region, Surface)> = Vec::with_capacity(shapes.len());
    for (i, Shape { label, region }) in shapes.into_iter().enumerate() {
        let mut fault =
            |problem| found.faulty_objects.push(ImportError::at(path, format!("shapes[{i}]"), problem));
        match region {
            Ok(region) => regions.push((region, labels.of(&label))),
            Err(Unusable::Faulty(problem)) => fault(problem),
            // Of what is asked for nothing is dropped in silence.
            Err(Unusable::NoArea(kind)) if labels.asks(&label) => fault(format!(
                "no area is known of a shape of the kind `{kind}`, and it is labelled `{label}`; draw a polygon instead, or \
                 remove it"
            )),
            Err(Unusable::NoArea(kind)) => {
                let place = || format!("{}: shapes[{i}]", path.shown());
                found.skip(
                    format!("labelled `{label}`, of the kind `{kind}`, of which no area is known"),
                    place,
                );
            }
        }
    }
    if let Some(reason) = labels.nothing_left(&regions, found.faulty_objects.len() > faults) {
        found.leave_out(name, reason);
        return Ok(None);
    }
    let side = |side: Option<Value>, name: &str| match side {
        None | Some(Value::Null) => Ok(None),
        Some(side) => {
            let pixels = whole_value(&side).and_then(|side| u64::try_from(side).ok());
            pixels.map(Some).ok_or_else(|| {
                ImportError::at(
                    path,
                    name,
                    format!("is {}, not a number of pixels; save the file again", shown(&side)),
                )
            })
        }
    };
    let said = side(file.width, "imageWidth")?.zip(side(file.height, "imageHeight")?);
    let ground = Ground::Regions { annotation: path.into(), said, base: labels.base(), regions };
    Ok(Some(Item { name, picture, ground, source: path.shown() }))
}

fn outside(path: &Path, name: &str) -> ImportError {
    ImportError::Outside {
        path: path.into(),
        place: "imagePath".to_string(),
        name: name.to_string(),
        remedy: "give the folder of the pictures with `--images DIR`, where they are looked for by their names alone",
    }
}

/// The region of a shape.
fn region(shape: &Value) -> Result<Region, Unusable> {
    let faulty = |problem: String| Err(Unusable::Faulty(problem));
    let list = shape.get("points").and_then(Value::as_array);
    let Some(list) = list else { return faulty("has no `points`; draw it again, or remove it".to_string()) };
    let kind = match shape.get("shape_type") {
        None | Some(Value::Null) => "polygon",
        Some(kind) => kind.as_str().unwrap_or("unknown"),
    };
    // What takes a whole number of corners of its own, and what is read as a polygon.
    let wanted = match (kind, list.len()) {
        ("rectangle", ..3) | ("circle" | "mask", _) => Some(2),
        ("polygon" | "rectangle" | "oriented_rectangle" | "rotated_rectangle" | "rotation", _) => None,
        ("quad" | "quadrangle" | "quadrilateral" | "parallelogram" | "trapezoid" | "triangle", _) => None,
        _ => return Err(Unusable::NoArea(kind.to_string())),
    };
    let mut points = Vec::with_capacity(list.len());
    for (i, point) in list.iter().enumerate() {
        match pair(point) {
            Some(point) => points.push(point),
            None => return faulty(format!("points[{i}] is not a pair of numbers; draw the shape again")),
        }
    }
    match (wanted, points.as_slice()) {
        (Some(_), &[[x0, y0], [x1, y1]]) => Ok(match kind {
            "rectangle" => Region::Polygons(vec![vec![[x0, y0], [x1, y0], [x1, y1], [x0, y1]]]),
            "circle" => Region::Disc {
                centre: [x0, y0],
                radius: ((x1 - x0) * (x1 - x0) + (y1 - y0) * (y1 - y0)).sqrt(),
            },
            _ => {
                let mask = shape.get("mask").and_then(Value::as_str).unwrap_or_default();
                bitmap([x0, y0], mask).map_err(Unusable::Faulty)?
            }
        }),
        (Some(wanted), points) => faulty(format!(
            "has {} points, and {wanted} are needed; draw it again or remove it",
            points.len()
        )),
        (None, points) if points.len() < 3 => {
            faulty(format!("the {kind} has {} points, and no area; draw it again or remove it", points.len()))
        }
        (None, _) => Ok(Region::Polygons(vec![points])),
    }
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
    let file: Data = bounded::json(path, MAX_BYTES, REMEDY)?;
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

    use super::super::{Named, View};
    use super::*;

    fn labels(named: Named, names: &[&str]) -> Labels {
        let names = names.iter().map(ToString::to_string).collect();
        Labels { named, names, ignored: Default::default() }
    }

    fn shape(text: &str) -> Result<Region, Unusable> {
        region(&serde_json::from_str(text).expect("a shape"))
    }

    #[test]
    fn shapes_become_regions() {
        let rectangle = shape(r#"{"label": "a", "points": [[3, 4], [1, 2]], "shape_type": "rectangle"}"#);
        let corners = vec![[3.0, 4.0], [1.0, 4.0], [1.0, 2.0], [3.0, 2.0]];
        assert_eq!(rectangle, Ok(Region::Polygons(vec![corners.clone()])));
        let circle = shape(r#"{"label": "a", "points": [[3, 4], [6, 8]], "shape_type": "circle"}"#);
        assert_eq!(circle, Ok(Region::Disc { centre: [3.0, 4.0], radius: 5.0 }));
        let old = shape(r#"{"label": "a", "points": [[0, 0], [1, 0], [1, 1]], "line_color": null}"#);
        assert!(matches!(old, Ok(Region::Polygons(_))));
        for kind in ["polygon", "rectangle", "oriented_rectangle", "rotation", "quad", "quadrilateral"] {
            let text = r#"{"label": "a", "points": [[3, 4], [1, 4], [1, 2], [3, 2]], "shape_type": "KIND"}"#;
            let all = Ok(Region::Polygons(vec![corners.clone()]));
            assert_eq!(shape(&text.replace("KIND", kind)), all, "{kind}");
        }
        for kind in ["point", "points", "line", "linestrip", "blob", "cuboid"] {
            let text = format!(r#"{{"label": "a", "points": [[0, 0]], "shape_type": "{kind}"}}"#);
            assert_eq!(shape(&text), Err(Unusable::NoArea(kind.to_string())), "{kind}");
        }
        let mask = r#"{"label": "a", "points": [[1, 2], [3, 4]], "shape_type": "mask", "mask": "AAAA"}"#;
        let fault = |text: &str| match shape(text) {
            Err(Unusable::Faulty(problem)) => problem,
            other => panic!("{text}: {other:?}"),
        };
        assert!(fault(mask).contains("its mask cannot be read"));
        assert!(fault(&mask.replace("AAAA", "A A")).contains("draw it again"));
        assert!(fault(&mask.replace("[3, 4]", "[3, null]")).contains("points[1] is not a pair of numbers"));
        assert!(fault(&mask.replace(", [3, 4]", "")).contains("has 1 points, and 2 are needed"));
        assert!(fault(r#"{"label": "a"}"#).contains("no `points`"));
        let two = r#"{"points": [[1, 2], [3, 4]], "shape_type": "oriented_rectangle"}"#;
        assert!(fault(two).contains("the oriented_rectangle has 2 points, and no area"));
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
        assert_eq!(names, ["in/a.png"]);
        let left_out: Vec<&str> = found.left_out.iter().map(|out| out.name.as_str()).collect();
        assert_eq!(left_out, ["in/b.png", "in/a.png"]);
        assert!(found.left_out[1].reason.contains("c.JSON already, with the same ground"));
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
