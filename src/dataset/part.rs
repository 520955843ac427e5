//! Parts of a set that are held out: by whole groups or stretches, so that no held-out image has a near-duplicate among
//! the others.

use std::cmp::Reverse;
use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use super::{Dataset, Sequence, SplitError};

/// Images beside a cut through a sequence that are in neither part, unless it is said otherwise: the nearest
/// neighbours of the held-out ones.
pub const DEFAULT_GAP: u32 = 2;

/// A part of a set, as it is asked for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Part {
    /// About so many hundredths of the images, `25%`.
    Percent(u8),
    /// The fold of this number, from 1, of so many of about equal size, `fold:2/5`.
    Fold(u32, u32),
    /// The groups of these names, `group:hall,lab`; without groups the sequences.
    Groups(Vec<String>),
}

/// Why a text names no part.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("`{0}` names no part of a data set; `25%`, `fold:2/5` and `group:hall,lab` do")]
pub struct ParsePartError(pub String);

/// What is never torn when a part is taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Unit {
    /// Groups: a place or a drive is in one part as a whole.
    Group,
    /// Stretches of consecutive images. Each sequence is cut at most twice.
    Stretch,
    /// Single images; neighbours may come to both sides, so that the result flatters.
    Image,
}

impl FromStr for Part {
    type Err = ParsePartError;

    fn from_str(text: &str) -> Result<Part, ParsePartError> {
        let fail = || ParsePartError(text.to_string());
        if let Some(percent) = text.strip_suffix('%') {
            let percent = percent.trim().parse().ok().filter(|p| (1..=99).contains(p));
            return percent.map(Part::Percent).ok_or_else(fail);
        }
        match text.split_once(':').ok_or_else(fail)? {
            ("fold", fold) => {
                let (number, count) = fold.split_once('/').ok_or_else(fail)?;
                let (number, count) = (number.trim().parse(), count.trim().parse());
                let (Ok(number), Ok(count)) = (number, count) else { return Err(fail()) };
                let sound = count >= 2 && (1..=count).contains(&number);
                sound.then_some(Part::Fold(number, count)).ok_or_else(fail)
            }
            ("group", names) => {
                let names: Vec<String> = names.split(',').map(|name| name.trim().to_string()).collect();
                let sound = names.iter().all(|name| !name.is_empty());
                sound.then_some(Part::Groups(names)).ok_or_else(fail)
            }
            _ => Err(fail()),
        }
    }
}

impl fmt::Display for Part {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Part::Percent(percent) => write!(f, "{percent}%"),
            Part::Fold(number, count) => write!(f, "fold:{number}/{count}"),
            Part::Groups(names) => write!(f, "group:{}", names.join(",")),
        }
    }
}

impl Dataset {
    /// What is never torn unless it is said: groups, if the table names any, else stretches.
    pub fn unit(&self) -> Unit {
        if self.has_groups() { Unit::Group } else { Unit::Stretch }
    }

    /// Takes a part away: what remains, and the part.
    ///
    /// | | by group | by stretch | by image |
    /// |---|---|---|---|
    /// | `N%` | the last groups by name, at least one | the last images of each sequence | evenly spread images |
    /// | `fold:I/K` | whole groups, folds as even as they can be | the I-th of K stretches of all sequences one after the other | every K-th image |
    ///
    /// `gap` images beside held-out ones, in a sequence or as their names count on (time stamps; a drive from one group
    /// into another), are in neither part. Groups are sequences ([`Dataset::sequences`]) whatever the unit.
    ///
    /// ```
    /// use image::GrayImage;
    /// use vsonar::dataset::{Case, Dataset, NamedImage, Unit};
    ///
    /// let image = |i| NamedImage { name: format!("drive_{i}.png"), pixels: GrayImage::new(16, 16) };
    /// let cases = (0..20).map(|image| Case { image, x: 8, y: 8 }).collect();
    /// let set = Dataset::new("drive", (0..20).map(image).collect(), cases)?;
    /// let (rest, part) = set.hold_out(&"25%".parse()?, Unit::Stretch, 2)?;
    /// assert_eq!(part.images()[0].name, "drive_15.png");
    /// assert_eq!((rest.images().len(), part.images().len()), (13, 5));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// If one of the two would be empty, there are fewer groups than folds, no group of a name, or images without a group
    /// among such with one where groups are the unit.
    pub fn hold_out(&self, part: &Part, unit: Unit, gap: u32) -> Result<(Dataset, Dataset), SplitError> {
        let fail = |cause: String| SplitError::Part { part: part.to_string(), set: self.name.clone(), cause };
        let sequences = self.sequences();
        let named = matches!(part, Part::Groups(_));
        if unit == Unit::Group
            && self.has_groups()
            && !named
            && let Some(image) = (0..self.images.len()).find(|&image| self.group(image).is_none())
        {
            let image = &self.images[image].name;
            return Err(fail(format!(
                "the image `{image}` has no group, while others have one; give it one in the table, or take parts by stretches \
                 (`--split-by stretch`)"
            )));
        }
        let mut held = vec![false; self.images.len()];
        let mut hold = |image: &usize| held[*image] = true;
        match (part, unit) {
            (Part::Groups(names), _) => {
                for name in names {
                    let found = sequences.iter().find(|s| s.name == *name);
                    found.ok_or_else(|| fail(unknown(name, &sequences)))?.images.iter().for_each(&mut hold);
                }
            }
            (_, Unit::Group) => {
                let groups = whole(part, &sequences, self.images.len()).map_err(fail)?;
                groups.iter().flat_map(|s| &s.images).for_each(&mut hold);
            }
            (Part::Percent(percent), Unit::Stretch) => {
                // What one sequence has too few or too many by rounding, the next makes up for.
                let mut before = 0;
                for Sequence { images, .. } in &sequences {
                    let count = share(before + images.len(), *percent) - share(before, *percent);
                    before += images.len();
                    images[images.len() - count..].iter().for_each(&mut hold);
                }
            }
            (Part::Percent(percent), Unit::Image) => {
                let owed = |i: usize| share(i, *percent);
                let all = sequences.iter().flat_map(|s| &s.images).enumerate();
                all.filter(|&(i, _)| owed(i + 1) > owed(i)).for_each(|(_, image)| hold(image));
            }
            (&Part::Fold(number, count), Unit::Stretch) => {
                let bound = |fold: u32| self.images.len() * fold as usize / count as usize;
                let all = sequences.iter().flat_map(|s| &s.images);
                all.take(bound(number)).skip(bound(number - 1)).for_each(hold);
            }
            (&Part::Fold(number, count), Unit::Image) => {
                let all = sequences.iter().flat_map(|s| &s.images);
                all.skip(number as usize - 1).step_by(count as usize).for_each(hold);
            }
        }
        let gap = if unit == Unit::Image { 0 } else { gap as usize };
        let orders = sequences.into_iter().map(|sequence| sequence.images).chain(self.by_numbers());
        let beside = beside(orders, &held, gap);
        let (rest, held) = (
            self.subset(format!("{}[not {part}]", self.name), |image| !held[image] && !beside[image]),
            self.subset(format!("{}[{part}]", self.name), |image| held[image]),
        );
        match (rest, held) {
            (Some(rest), Some(held)) => Ok((rest, held)),
            (None, _) => Err(fail(format!(
                "nothing would be left to train on, of {} with {gap} on either side of a cut left out; take a smaller part",
                images(self.images.len())
            ))),
            (_, None) => {
                Err(fail(format!("it holds none of the {}; take a larger part", images(self.images.len()))))
            }
        }
    }
}

/// So many hundredths of a number of images, rounded.
fn share(images: usize, percent: u8) -> usize {
    (images * usize::from(percent) + 50) / 100
}

fn images(count: usize) -> String {
    format!("{count} image{}", if count == 1 { "" } else { "s" })
}

fn unknown(name: &str, sequences: &[Sequence]) -> String {
    let names: Vec<&str> = sequences.iter().take(12).map(|s| s.name.as_str()).collect();
    let more = if sequences.len() > names.len() { " and others" } else { "" };
    format!("there is no group `{name}`; there are {}{more}", names.join(", "))
}

/// The groups of a part, none of which is torn.
fn whole<'a>(part: &Part, groups: &'a [Sequence], images: usize) -> Result<Vec<&'a Sequence>, String> {
    let asked = if let Part::Fold(_, count) = part { *count as usize } else { 2 };
    if groups.len() < asked {
        return Err(format!(
            "there are {} group(s) to take from and no fewer than {asked} will do; name groups (`group:NAME`), or take \
             parts by stretches (`--split-by stretch`)",
            groups.len()
        ));
    }
    Ok(match part {
        Part::Percent(percent) => {
            // As many as come nearest to the share, but neither none nor all.
            let wanted = images * usize::from(*percent);
            let size = |count: usize| -> usize {
                100 * groups[groups.len() - count..].iter().map(|s| s.images.len()).sum::<usize>()
            };
            let count = (1..groups.len()).min_by_key(|&count| size(count).abs_diff(wanted)).unwrap_or(1);
            groups[groups.len() - count..].iter().collect()
        }
        Part::Fold(number, count) => {
            // The largest first, each to the fold that has least.
            let mut order: Vec<&Sequence> = groups.iter().collect();
            order.sort_by_key(|s| Reverse(s.images.len()));
            let mut folds: Vec<(usize, Vec<&Sequence>)> = vec![(0, Vec::new()); *count as usize];
            for group in order {
                if let Some((size, fold)) = folds.iter_mut().min_by_key(|(size, _)| *size) {
                    *size += group.images.len();
                    fold.push(group);
                }
            }
            folds.swap_remove(*number as usize - 1).1
        }
        Part::Groups(_) => Vec::new(),
    })
}

/// The images that are not held out but within `gap` images of one that is, in any of these orders.
fn beside(orders: impl Iterator<Item = Vec<usize>>, held: &[bool], gap: usize) -> Vec<bool> {
    let mut beside = vec![false; held.len()];
    for images in orders {
        for (place, &image) in images.iter().enumerate() {
            let around = &images
                [place.saturating_sub(gap)..images.len().min(place.saturating_add(gap).saturating_add(1))];
            beside[image] |= !held[image] && around.iter().any(|&other| held[other]);
        }
    }
    beside
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dataset::{Case, NamedImage};

    /// A set of one image for each name.
    fn named(names: &[impl ToString]) -> Dataset {
        let image =
            |name: &_| NamedImage { name: ToString::to_string(name), pixels: image::GrayImage::new(16, 16) };
        let cases = (0..names.len()).map(|image| Case { image, x: 8, y: 8 }).collect();
        Dataset::new("set", names.iter().map(image).collect(), cases).expect("sound")
    }

    /// Sequences of these lengths, named a, b, c.
    fn set(lengths: &[usize]) -> Dataset {
        let names = lengths.iter().zip("abcdefgh".chars());
        let names = names.flat_map(|(&n, letter)| (0..n).map(move |i| format!("{letter}_{i:02}.png")));
        named(&names.collect::<Vec<_>>())
    }

    fn names(set: &Dataset) -> Vec<&str> {
        set.images().iter().map(|image| image.name.trim_end_matches(".png")).collect()
    }

    fn part(text: &str) -> Part {
        text.parse().expect("a part")
    }

    #[test]
    fn parts_are_written_as_they_are_read() {
        for text in ["1%", "99%", "fold:1/2", "fold:5/5", "group:a", "group:a,b c"] {
            assert_eq!(part(text).to_string(), text);
        }
        for text in [
            "",
            "0%",
            "100%",
            "-3%",
            "x%",
            "25",
            "fold:0/3",
            "fold:4/3",
            "fold:1/1",
            "fold:1",
            "group:",
            "group:a,,b",
            "groups:a",
        ] {
            assert_eq!(text.parse::<Part>(), Err(ParsePartError(text.to_string())));
        }
    }

    #[test]
    fn the_end_of_each_sequence_is_held_out_with_a_gap() {
        let set = set(&[8, 4]);
        let (rest, held) = set.hold_out(&part("25%"), Unit::Stretch, 1).expect("possible");
        assert_eq!(names(&held), ["a_06", "a_07", "b_03"]);
        assert_eq!(names(&rest), ["a_00", "a_01", "a_02", "a_03", "a_04", "b_00", "b_01"]);
    }

    #[test]
    fn photographs_that_are_no_sequence_are_held_out_too() {
        let photos =
            ["hall", "lab", "door", "desk", "bin", "box", "leg", "wall"].map(|name| format!("{name}.png"));
        let set = named(&photos);
        let (rest, held) = set.hold_out(&part("25%"), Unit::Stretch, 2).expect("possible");
        assert_eq!((rest.images().len(), held.images().len()), (6, 2));
    }

    #[test]
    fn folds_are_a_partition() {
        for unit in [Unit::Group, Unit::Stretch, Unit::Image] {
            let set = set(&[5, 7, 3, 6]);
            let mut all = Vec::new();
            for number in 1..=3 {
                let (rest, held) = set.hold_out(&Part::Fold(number, 3), unit, 0).expect("possible");
                assert_eq!(rest.images().len() + held.images().len(), 21);
                assert!((6..=8).contains(&held.images().len()), "{unit:?}: {:?}", names(&held));
                all.extend(names(&held).into_iter().map(str::to_string));
                if unit == Unit::Group {
                    let of = |set: &Dataset| set.sequences().into_iter().map(|s| s.name).collect::<Vec<_>>();
                    assert!(of(&rest).iter().all(|name| !of(&held).contains(name)));
                }
            }
            all.sort();
            assert_eq!(all, names(&set), "{unit:?}");
        }
    }

    #[test]
    fn groups_are_not_torn() {
        let set = set(&[5, 7, 3, 6]);
        let held = |text: &str| -> Vec<String> {
            let (_, held) = set.hold_out(&part(text), Unit::Group, 2).expect("possible");
            held.sequences().into_iter().map(|s| s.name).collect()
        };
        assert_eq!(held("20%"), ["d_"]);
        assert_eq!(held("1%"), ["d_"]);
        assert_eq!(held("40%"), ["c_", "d_"]);
        assert_eq!(held("99%"), ["b_", "c_", "d_"]);
        assert_eq!(held("group:b_,a_"), ["a_", "b_"]);
    }

    #[test]
    fn what_cannot_be_is_said() {
        let one = set(&[6]);
        let cause = |set: &Dataset, text: &str, unit| {
            set.hold_out(&part(text), unit, 2).expect_err("impossible").to_string()
        };
        assert!(cause(&one, "25%", Unit::Group).contains("1 group(s)"));
        assert!(cause(&one, "fold:1/3", Unit::Group).contains("no fewer than 3"));
        assert!(cause(&one, "1%", Unit::Stretch).contains("larger"));
        assert!(cause(&one, "90%", Unit::Stretch).contains("smaller"));
        assert!(cause(&one, "group:b", Unit::Stretch).contains("no group `b`; there are a_"));
    }

    #[test]
    fn what_was_taken_one_after_the_other_is_not_parted() {
        // A second is a sequence of its own; its last image is beside the first of the next.
        let stamps =
            named(&["1.0.png", "1.1.png", "1.2.png", "1.3.png", "2.0.png", "2.1.png", "2.2.png", "2.3.png"]);
        let (rest, held) = stamps.hold_out(&part("fold:2/2"), Unit::Stretch, 1).expect("possible");
        assert_eq!(
            (names(&held), names(&rest)),
            (vec!["2.0", "2.1", "2.2", "2.3"], vec!["1.0", "1.1", "1.2"])
        );
        // A drive through two groups.
        let drive =
            set(&[8]).with_groups(|name| Some(if name < "a_04" { "hall" } else { "lab" }.to_string()));
        let (rest, _) = drive.hold_out(&part("group:lab"), Unit::Group, 2).expect("possible");
        assert_eq!(names(&rest), ["a_00", "a_01"]);
        // Two eyes see the same.
        let eyes = named(&["d_1_l.png", "d_1_r.png", "d_2_l.png", "d_2_r.png"]);
        let (rest, held) = eyes.hold_out(&part("fold:2/2"), Unit::Stretch, 0).expect("possible");
        assert_eq!((names(&rest), names(&held)), (vec!["d_1_l", "d_1_r"], vec!["d_2_l", "d_2_r"]));
    }

    #[test]
    fn images_without_a_group_among_others_with_one_are_named() {
        let some = set(&[8]).with_groups(|name| (name > "a_03").then(|| "hall".to_string()));
        let error = some.hold_out(&part("25%"), Unit::Group, 0).expect_err("no groups").to_string();
        assert!(error.contains("`a_00.png` has no group") && error.contains("--split-by stretch"), "{error}");
        assert!(some.hold_out(&part("group:hall"), Unit::Group, 0).is_ok());
        assert!(some.hold_out(&part("25%"), Unit::Stretch, 0).is_ok());
    }

    #[test]
    fn single_images_are_spread() {
        let set = set(&[12]);
        let (rest, held) = set.hold_out(&part("25%"), Unit::Image, 2).expect("possible");
        assert_eq!((rest.images().len(), names(&held)), (9, vec!["a_01", "a_05", "a_09"]));
    }
}
