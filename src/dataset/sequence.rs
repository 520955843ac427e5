//! Sequences: which images belong together in time or place, and in which order.
//!
//! Neighbouring frames of a drive are near-duplicates, and what is learned in one place may hold nowhere else. So a set
//! is taken apart, and judged, by whole sequences and by stretches of them.

use std::collections::BTreeMap;

use super::Dataset;

/// Images that belong together, in order.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Sequence {
    /// The group that the table names, else what the images' names have in common before their numbers.
    pub name: String,
    /// Indices in [`Dataset::images`], by the number at the end of the name.
    pub images: Vec<usize>,
}

impl Dataset {
    /// The set with its images in groups; `group` is asked for the group of each image by its name.
    pub fn with_groups(mut self, group: impl Fn(&str) -> Option<String>) -> Dataset {
        let grouped = self.images.iter().filter_map(|image| Some((image.name.clone(), group(&image.name)?)));
        self.groups = grouped.collect();
        self
    }

    /// The group of an image: the place it is from, or the drive, as the column `group` of the table has it.
    ///
    /// # Panics
    /// If there is no such image.
    pub fn group(&self, image: usize) -> Option<&str> {
        self.groups.get(&self.images[image].name).map(String::as_str)
    }

    /// Whether any image has a group.
    pub fn has_groups(&self) -> bool {
        !self.groups.is_empty()
    }

    /// Those of the groups that images of this set have.
    pub(super) fn kept(&self, groups: &BTreeMap<String, String>) -> BTreeMap<String, String> {
        let kept = self.images.iter().filter_map(|image| groups.get_key_value(&image.name));
        kept.map(|(name, group)| (name.clone(), group.clone())).collect()
    }

    /// The sequences, by name. Images are of one sequence if they have the same group; without groups, if their names
    /// are the same up to their last number (`drive_A_001.png`, `drive_A_002.png` and `drive_A_002_left.png`). Within a
    /// sequence the images ascend by that number, those of equal numbers by name.
    ///
    /// ```
    /// use image::GrayImage;
    /// use vsonar::dataset::{Case, Dataset, NamedImage};
    ///
    /// let images = ["b_9.png", "b_10.png", "a_1.png"];
    /// let images = images.map(|name| NamedImage { name: name.into(), pixels: GrayImage::new(16, 16) });
    /// let cases = (0..3).map(|image| Case { image, x: 8, y: 8 }).collect();
    /// let sequences = Dataset::new("drives", images.into(), cases)?.sequences();
    /// assert_eq!(sequences[0].name, "a_");
    /// assert_eq!(sequences[1].images, [0, 1]); // 9 before 10
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn sequences(&self) -> Vec<Sequence> {
        let mut sequences: BTreeMap<&str, Vec<usize>> = BTreeMap::new();
        for (i, image) in self.images.iter().enumerate() {
            let name = self.group(i).unwrap_or(around_number(&image.name)[0]);
            sequences.entry(name).or_default().push(i);
        }
        let order = |image: usize| {
            let name = &self.images[image].name;
            let [before, number, after] = around_number(name);
            // Numbers as text, for none is too long so.
            let number = number.trim_start_matches('0');
            (before, number.len(), number, after, name)
        };
        let sequence = |(name, mut images): (&str, Vec<usize>)| {
            images.sort_by(|&a, &b| order(a).cmp(&order(b)));
            Sequence { name: name.to_string(), images }
        };
        sequences.into_iter().map(sequence).collect()
    }

    /// Images whose names are the same but for all their numbers, in the order of these: time stamps, say, which no single
    /// number tells. Whatever the groups, neighbours in it may have been taken one after the other.
    pub(super) fn by_numbers(&self) -> Vec<Vec<usize>> {
        let mut alike: BTreeMap<String, Vec<usize>> = BTreeMap::new();
        for (i, image) in self.images.iter().enumerate() {
            let text = image.name.split(|c: char| c.is_ascii_digit()).filter(|text| !text.is_empty());
            alike.entry(text.collect::<Vec<_>>().join("0")).or_default().push(i);
        }
        let numbers = |image: usize| -> Vec<(usize, &str)> {
            let digits = self.images[image].name.split(|c: char| !c.is_ascii_digit());
            let digits =
                digits.filter(|digits| !digits.is_empty()).map(|digits| digits.trim_start_matches('0'));
            digits.map(|digits| (digits.len(), digits)).collect()
        };
        alike
            .into_values()
            .map(|mut images| {
                images.sort_by_cached_key(|&image| numbers(image));
                images
            })
            .collect()
    }

    /// Stretches of at most so many consecutive images of a sequence, as equal as can be: what a bootstrap draws, as
    /// neighbouring frames are not independent of each other. Each is a list of indices in [`Dataset::images`].
    ///
    /// # Panics
    /// If `length` is 0.
    pub fn stretches(&self, length: usize) -> Vec<Vec<usize>> {
        let mut stretches = Vec::new();
        for Sequence { images, .. } in self.sequences() {
            let count = images.len().div_ceil(length);
            let bound = |i: usize| i * images.len() / count;
            stretches.extend((0..count).map(|i| images[bound(i)..bound(i + 1)].to_vec()));
        }
        stretches
    }
}

/// What stands before the last number in a file's name, the number, and what stands after it, the ending left out.
/// Without a number all of it stands before.
fn around_number(name: &str) -> [&str; 3] {
    let ending = name.rfind('.').filter(|&dot| dot > name.rfind('/').map_or(0, |slash| slash + 1));
    let stem = &name[..ending.unwrap_or(name.len())];
    let leaf = stem.rfind('/').map_or(0, |slash| slash + 1);
    let digit = |c: char| c.is_ascii_digit();
    let Some(last) = stem[leaf..].rfind(digit) else { return [stem, "", ""] };
    let end = leaf + last + 1;
    let start = leaf + stem[leaf..end].trim_end_matches(digit).len();
    [&stem[..start], &stem[start..end], &stem[end..]]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dataset::{Case, NamedImage};

    fn set(names: &[&str]) -> Dataset {
        let image =
            |name: &&str| NamedImage { name: name.to_string(), pixels: image::GrayImage::new(16, 16) };
        let cases = (0..names.len()).map(|image| Case { image, x: 8, y: 8 }).collect();
        Dataset::new("set", names.iter().map(image).collect(), cases).expect("sound")
    }

    #[test]
    fn numbers_are_found() {
        for (name, parts) in [
            ("a_001.png", ["a_", "001", ""]),
            ("run.7/b12_left.jpeg", ["run.7/b", "12", "_left"]),
            ("run7/photo.png", ["run7/photo", "", ""]),
            ("1hz_0006R0_01200.png", ["1hz_0006R0_", "01200", ""]),
            ("9.png", ["", "9", ""]),
            (".5", [".", "5", ""]),
        ] {
            assert_eq!(around_number(name).map(str::to_string), parts.map(str::to_string), "{name}");
        }
    }

    #[test]
    fn groups_go_before_names() {
        let set = set(&["a_2.png", "a_1.png", "b_3.png", "c.png"]);
        let names = |set: &Dataset| -> Vec<(String, Vec<usize>)> {
            set.sequences().into_iter().map(|s| (s.name, s.images)).collect()
        };
        let own = |name: &str, images: &[usize]| (name.to_string(), images.to_vec());
        assert_eq!(names(&set), [own("a_", &[1, 0]), own("b_", &[2]), own("c", &[3])]);
        let eyes = self::set(&["d_1_r.png", "d_2_l.png", "d_1_l.png", "d_2_r.png"]);
        assert_eq!(names(&eyes), [own("d_", &[2, 0, 1, 3])], "of one moment, side by side");
        let grouped = set.with_groups(|name| (name != "c.png").then(|| "hall".to_string()));
        assert_eq!(names(&grouped), [own("c", &[3]), own("hall", &[1, 0, 2])]);
        assert_eq!(grouped.select("b*").expect("one").group(0), Some("hall"));
    }

    #[test]
    fn time_stamps_are_in_order() {
        let names =
            ["12-31-00.png", "12-30-59.png", "9-59-59.png", "left_1.png", "left_10.png", "left_9.png"];
        assert_eq!(set(&names).by_numbers(), [vec![2, 1, 0], vec![3, 5, 4]]);
    }

    #[test]
    fn stretches_are_even_and_stay_within_a_sequence() {
        let names: Vec<String> =
            (0..13).map(|i| format!("{}_{i:02}.png", if i < 11 { "a" } else { "b" })).collect();
        let set = set(&names.iter().map(String::as_str).collect::<Vec<_>>());
        let stretches = set.stretches(5);
        assert_eq!(stretches.iter().map(Vec::len).collect::<Vec<_>>(), [3, 4, 4, 2]);
        assert_eq!(stretches.concat(), (0..13).collect::<Vec<_>>());
    }
}
