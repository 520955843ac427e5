//! Images of a set that are the same picture under several names.

use std::collections::{BTreeMap, HashMap};

use serde::Serialize;

use super::Dataset;

/// Names that the text shows before it only counts.
const NAMED: usize = 5;

/// Images whose pixels are all the same.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Copies {
    /// Their names, two at least, in the order of the set.
    pub images: Vec<String>,
    /// A column in which two of them have different labels.
    pub contradiction: Option<u32>,
}

impl Copies {
    /// All of a set, in its order.
    pub(super) fn find(set: &Dataset) -> Vec<Copies> {
        let mut first: HashMap<&[u8], usize> = HashMap::new();
        let mut same: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
        for (i, image) in set.images().iter().enumerate() {
            let first = *first.entry(image.pixels.as_raw()).or_insert(i);
            same.entry(first).or_default().push(i);
        }
        same.retain(|_, images| images.len() > 1);
        let groups = same.iter().flat_map(|(first, images)| images.iter().map(move |image| (*image, *first)));
        let groups: HashMap<usize, usize> = groups.collect();
        let mut labels: HashMap<(usize, u32), u32> = HashMap::new();
        let mut contradictions: HashMap<usize, u32> = HashMap::new();
        for case in set.cases() {
            let Some(&group) = groups.get(&case.image) else { continue };
            if *labels.entry((group, case.x)).or_insert(case.y) != case.y {
                contradictions.entry(group).or_insert(case.x);
            }
        }
        let name = |image: &usize| set.images()[*image].name.clone();
        let copies = |(first, images): (usize, Vec<usize>)| Copies {
            images: images.iter().map(name).collect(),
            contradiction: contradictions.get(&first).copied(),
        };
        same.into_iter().map(copies).collect()
    }
}

impl std::fmt::Display for Copies {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Copies { images, contradiction } = self;
        write!(f, "{}", images.iter().take(NAMED).map(String::as_str).collect::<Vec<_>>().join(" and "))?;
        if images.len() > NAMED {
            write!(f, " and {} more", images.len() - NAMED)?;
        }
        write!(f, " are the same picture")?;
        contradiction.map_or(Ok(()), |x| write!(f, ", and differ in the label of column {x}"))
    }
}

#[cfg(test)]
mod tests {
    use image::{GrayImage, Luma};

    use super::*;
    use crate::dataset::{Case, NamedImage};

    #[test]
    fn equal_pixels_are_found_under_all_names() {
        let image = |(name, shade): (&str, u8)| NamedImage {
            name: name.into(),
            pixels: GrayImage::from_pixel(16, 16, Luma([shade])),
        };
        let images = [("a", 1), ("b", 2), ("c", 1), ("d", 3), ("e", 2), ("f", 1)].map(image).to_vec();
        let case = |(image, x, y)| Case { image, x, y };
        let cases = [(0, 1, 5), (1, 1, 5), (2, 2, 7), (3, 1, 0), (4, 1, 6), (5, 1, 5)].map(case).to_vec();
        let copies = Copies::find(&Dataset::new("set", images, cases).expect("sound"));
        assert_eq!(
            copies.iter().map(ToString::to_string).collect::<Vec<_>>(),
            [
                "a and c and f are the same picture",
                "b and e are the same picture, and differ in the label of column 1"
            ]
        );
    }
}
