//! What stands in a COCO file, entry by entry, so that a fault of one leaves the others alone.

use std::fmt;

use serde_json::Value;

use super::json::{shown, whole_value};

/// A COCO file with its objects, or another one without some of the lists.
#[derive(serde::Deserialize)]
pub(super) struct File {
    pub(super) images: Option<Vec<Entry<Image>>>,
    pub(super) categories: Option<Vec<Entry<Category>>>,
    pub(super) annotations: Option<Vec<Annotation>>,
}

/// An entry, or what is wrong with it.
#[derive(serde::Deserialize)]
#[serde(from = "Value", bound = "T: Read")]
pub(super) struct Entry<T>(pub(super) Result<T, String>);

/// What can be read from an entry's value.
pub(super) trait Read: Sized {
    fn read(value: &Value) -> Result<Self, String>;
}

impl<T: Read> From<Value> for Entry<T> {
    fn from(value: Value) -> Entry<T> {
        Entry(T::read(&value))
    }
}

/// What one entry calls another: a number, or a text that is none.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(super) enum Id {
    Number(i128),
    Text(String),
}

impl Id {
    /// The id that a value is: `7`, `7.0` and `"7"` are one.
    fn of(value: &Value) -> Option<Id> {
        match value.as_str() {
            Some("") => None,
            Some(text) => {
                let number = text.parse().ok().filter(|number: &i128| number.to_string() == text);
                Some(number.map_or_else(|| Id::Text(text.to_string()), Id::Number))
            }
            None => whole_value(value).map(Id::Number),
        }
    }

    fn field(entry: &Value, field: &str) -> Result<Id, String> {
        let value = entry.get(field).ok_or_else(|| format!("has no `{field}`; export the file anew"))?;
        Id::of(value).ok_or_else(|| {
            format!(
                "its `{field}` is {}, and an id is a whole number or a text; export the file anew",
                shown(value)
            )
        })
    }
}

impl fmt::Display for Id {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Id::Number(number) => write!(f, "{number}"),
            Id::Text(text) => write!(f, "`{text}`"),
        }
    }
}

pub(super) struct Image {
    pub(super) id: Id,
    pub(super) file_name: String,
    pub(super) width: Option<u64>,
    pub(super) height: Option<u64>,
}

impl Read for Image {
    fn read(value: &Value) -> Result<Image, String> {
        let side = |field: &str| match value.get(field) {
            None | Some(Value::Null) => Ok(None),
            Some(side) => {
                whole_value(side).and_then(|side| u64::try_from(side).ok()).map(Some).ok_or_else(|| {
                    format!(
                        "its `{field}` is {}, and a size is a number of pixels; export the file anew",
                        shown(side)
                    )
                })
            }
        };
        let name = value.get("file_name").and_then(Value::as_str);
        Ok(Image {
            id: Id::field(value, "id")?,
            file_name: name.ok_or("has no `file_name`; export the file anew")?.to_string(),
            width: side("width")?,
            height: side("height")?,
        })
    }
}

pub(super) struct Category {
    pub(super) id: Id,
    pub(super) name: String,
}

impl Read for Category {
    fn read(value: &Value) -> Result<Category, String> {
        let name = value.get("name").and_then(Value::as_str).ok_or("has no `name`; export the file anew")?;
        Ok(Category { id: Id::field(value, "id")?, name: name.to_string() })
    }
}

/// An object.
#[derive(serde::Deserialize)]
#[serde(from = "Value")]
pub(super) struct Annotation {
    pub(super) id: Option<Id>,
    pub(super) image: Result<Id, String>,
    pub(super) category: Result<Id, String>,
    pub(super) outline: Outline,
    /// Whether it is of a panoptic file.
    pub(super) is_panoptic: bool,
}

impl From<Value> for Annotation {
    fn from(value: Value) -> Annotation {
        Annotation {
            id: value.get("id").and_then(Id::of),
            image: Id::field(&value, "image_id"),
            category: Id::field(&value, "category_id"),
            outline: Outline::of(&value),
            is_panoptic: value.get("segments_info").is_some(),
        }
    }
}

/// The pixels of an object.
#[derive(Debug, PartialEq)]
pub(super) enum Outline {
    Polygons(Vec<Vec<[f64; 2]>>),
    Runs {
        size: [u64; 2],
        counts: Counts,
    },
    /// A box at most, of which nobody knows which of its pixels are meant.
    Unknown,
    /// None at all.
    Nothing,
    /// What is not of the form of an outline.
    Faulty(String),
}

#[derive(Debug, PartialEq)]
pub(super) enum Counts {
    Numbers(Vec<u64>),
    Text(String),
}

impl Outline {
    fn of(entry: &Value) -> Outline {
        let segmentation = entry.get("segmentation").unwrap_or(&Value::Null);
        let is_empty = |list: &Vec<Value>| {
            list.iter().all(|polygon| polygon.as_array().is_some_and(|numbers| numbers.is_empty()))
        };
        let outline = match segmentation {
            Value::Null => Err(Outline::unknown(entry)),
            Value::Array(list) if is_empty(list) => Err(Outline::unknown(entry)),
            Value::Array(list) if list.iter().all(Value::is_number) => {
                polygon(0, list).map(|one| Outline::Polygons(vec![one]))
            }
            Value::Array(list) => polygons(list),
            Value::Object(_) => runs(segmentation),
            _ => Err(Outline::Faulty(format!(
                "its segmentation is {}, and one is a list of polygons or has `size` and `counts`; export the file anew",
                shown(segmentation)
            ))),
        };
        outline.unwrap_or_else(|fault| fault)
    }

    /// What there is without a segmentation: nothing where the box has no area, as tools leave behind of what was removed.
    fn unknown(entry: &Value) -> Outline {
        let sides = entry.get("bbox").and_then(Value::as_array).and_then(|numbers| numbers.get(2..4));
        match sides.is_some_and(|sides| sides.iter().any(|side| side.as_f64() == Some(0.0))) {
            true => Outline::Nothing,
            false => Outline::Unknown,
        }
    }
}

fn polygons(list: &[Value]) -> Result<Outline, Outline> {
    let read = |(i, numbers): (usize, &Value)| match numbers.as_array() {
        Some(numbers) => polygon(i, numbers),
        None => Err(Outline::Faulty(format!(
            "its polygon {i} is {}, and one is a list of numbers; export the file anew",
            shown(numbers)
        ))),
    };
    Ok(Outline::Polygons(list.iter().enumerate().map(read).collect::<Result<_, _>>()?))
}

fn polygon(i: usize, numbers: &[Value]) -> Result<Vec<[f64; 2]>, Outline> {
    let count = numbers.len();
    // As a box has.
    if count == 4 {
        return Err(Outline::Unknown);
    }
    if count < 6 || !count.is_multiple_of(2) {
        return Err(Outline::Faulty(format!(
            "its polygon {i} has {count} numbers, and a polygon has two for each of three corners or more; draw it again"
        )));
    }
    let corners = numbers.chunks_exact(2).map(|pair| Some([pair[0].as_f64()?, pair[1].as_f64()?]));
    corners.collect::<Option<_>>().ok_or_else(|| {
        Outline::Faulty(format!("its polygon {i} has a corner that is not a pair of numbers; draw it again"))
    })
}

fn runs(segmentation: &Value) -> Result<Outline, Outline> {
    let faulty = |field: &str, form: &str| {
        let value = segmentation.get(field).map_or_else(|| "missing".to_string(), shown);
        Outline::Faulty(format!(
            "the `{field}` of its segmentation is {value}, and {form}; export the file anew"
        ))
    };
    let lengths = |value: &Value| -> Option<Vec<u64>> {
        value.as_array()?.iter().map(|number| u64::try_from(whole_value(number)?).ok()).collect()
    };
    let size = segmentation.get("size").and_then(lengths).and_then(|size| <[u64; 2]>::try_from(size).ok());
    let size = size.ok_or_else(|| faulty("size", "it is height and width"))?;
    let counts = match segmentation.get("counts") {
        Some(Value::String(text)) => Some(Counts::Text(text.clone())),
        counts => counts.and_then(lengths).map(Counts::Numbers),
    };
    let counts =
        counts.ok_or_else(|| faulty("counts", "it is a list of whole numbers from 0 on, or a text"))?;
    Ok(Outline::Runs { size, counts })
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn ids_are_one_however_they_are_written() {
        let id = |value: Value| Id::of(&value);
        for seven in [json!(7), json!(7.0), json!("7")] {
            assert_eq!(id(seven), Some(Id::Number(7)));
        }
        assert_eq!(id(json!(-3)), Some(Id::Number(-3)));
        for text in ["007", "img_1", "1.5"] {
            assert_eq!(id(json!(text)), Some(Id::Text(text.into())));
        }
        for none in [json!(""), json!(null), json!(1.5), json!([1]), json!(true)] {
            assert_eq!(id(none.clone()), None, "{none}");
        }
        let said = Id::field(&json!({"image_id": [1, 2]}), "image_id").expect_err("a list");
        assert!(said.starts_with("its `image_id` is [1,2], and an id is"), "{said}");
    }

    #[test]
    fn outlines_of_all_forms() {
        let outline = |segmentation: Value| Outline::of(&json!({"segmentation": segmentation}));
        let triangle = vec![[0.0, 0.0], [4.0, 0.0], [4.0, 3.5]];
        assert_eq!(outline(json!([[0, 0, 4, 0, 4, 3.5]])), Outline::Polygons(vec![triangle.clone()]));
        assert_eq!(outline(json!([0, 0, 4, 0, 4, 3.5])), Outline::Polygons(vec![triangle]));
        let runs = Outline::Runs { size: [2, 3], counts: Counts::Numbers(vec![2, 4]) };
        assert_eq!(outline(json!({"size": [2.0, "3"], "counts": [2.0, 4]})), runs);
        for unknown in [json!(null), json!([]), json!([[]]), json!([[1, 2, 3, 4]]), json!([1, 2, 3, 4])] {
            assert_eq!(outline(unknown.clone()), Outline::Unknown, "{unknown}");
        }
        assert_eq!(Outline::of(&json!({"segmentation": [], "bbox": [5, 6, 0, 0]})), Outline::Nothing);
        for (faulty, said) in [
            (json!("text"), "a list of polygons or has `size` and `counts`"),
            (json!([[1, 2, 3, 4, 5, 6, 7]]), "polygon 0 has 7 numbers"),
            (json!([[1, 2, 3, 4, 5, 6], [1]]), "polygon 1 has 1 numbers"),
            (json!([[1, 2, 3, 4, 5, null]]), "not a pair of numbers"),
            (json!([[1, 2, 3, 4, 5, 6], 7]), "polygon 1 is 7"),
            (json!({"size": [2, 3]}), "`counts` of its segmentation is missing"),
            (json!({"size": [2, 3], "counts": [1.5]}), "`counts` of its segmentation is [1.5]"),
            (json!({"size": [2, 3], "counts": [-1]}), "whole numbers from 0 on"),
            (json!({"size": [2], "counts": [1]}), "`size` of its segmentation is [2]"),
        ] {
            let outline = outline(faulty);
            assert!(matches!(&outline, Outline::Faulty(text) if text.contains(said)), "{said}: {outline:?}");
        }
    }
}
