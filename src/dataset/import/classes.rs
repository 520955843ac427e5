//! The classes that the values of masks stand for, and how often each value occurs.

use std::collections::BTreeMap;

use super::{Surface, Value, Values};

/// Distinct values that are told apart when they are counted. Masks of classes have far fewer.
const DISTINCT: usize = 4096;

/// Values of masks that stand for the same.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Classes {
    /// The ground.
    pub ground: Values,
    /// Obstacles; empty where every other value is one.
    pub obstacles: Values,
    /// Surfaces of which nobody knows whether they are ground.
    pub ignored: Values,
}

impl Classes {
    /// The surface that a value stands for. One in no class is no ground.
    pub(super) fn surface(&self, value: Value) -> Surface {
        if self.ignored.0.contains(&value) {
            Surface::Ignored
        } else if self.ground.0.contains(&value) {
            Surface::Ground
        } else {
            Surface::Other
        }
    }

    /// Whether any of the classes names a value.
    fn name(&self, value: Value) -> bool {
        [&self.ground, &self.obstacles, &self.ignored].iter().any(|values| values.0.contains(&value))
    }
}

/// How often a value occurs.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Occurrence {
    /// Number of pixels.
    pub pixels: u64,
    /// Pixels among them whose upper and lower neighbours both have other values.
    pub lone: u64,
}

/// How often each value occurs in the columns of masks that were looked at.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct ValueCounts {
    counts: BTreeMap<Value, Occurrence>,
    /// Pixels of values beyond those that are told apart.
    others: u64,
}

impl ValueCounts {
    /// Counts the pixels of a column.
    pub(super) fn add(&mut self, column: &[Value]) {
        for (i, &value) in column.iter().enumerate() {
            let above = i.checked_sub(1).map(|above| column[above]);
            let lone = above != Some(value) && column.get(i + 1) != Some(&value);
            self.note(value, Occurrence { pixels: 1, lone: lone.into() });
        }
    }

    /// Adds the counts of other masks.
    pub fn extend(&mut self, other: &ValueCounts) {
        other.counts.iter().for_each(|(&value, &occurrence)| self.note(value, occurrence));
        self.others += other.others;
    }

    fn note(&mut self, value: Value, Occurrence { pixels, lone }: Occurrence) {
        if self.counts.len() < DISTINCT || self.counts.contains_key(&value) {
            let known = self.counts.entry(value).or_default();
            (known.pixels, known.lone) = (known.pixels + pixels, known.lone + lone);
        } else {
            self.others += pixels;
        }
    }

    /// The values, in order, with how often they occur.
    pub fn iter(&self) -> impl Iterator<Item = (Value, Occurrence)> {
        self.counts.iter().map(|(&value, &occurrence)| (value, occurrence))
    }

    /// Number of all pixels.
    pub fn pixels(&self) -> u64 {
        self.counts.values().map(|occurrence| occurrence.pixels).sum::<u64>() + self.others
    }

    /// The values that are in no class. Where obstacles are not named, a value counts as one if it occurs mostly in
    /// single pixels: what smoothing, scaling and lossy compression leave at the edges of classes.
    pub fn in_no_class(&self, classes: &Classes) -> Vec<(Value, Occurrence)> {
        let stray = |&(value, occurrence): &(Value, Occurrence)| {
            let all_named = !classes.obstacles.0.is_empty();
            !classes.name(value) && (all_named || 2 * occurrence.lone > occurrence.pixels)
        };
        self.iter().filter(stray).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ids(values: &[u16]) -> Vec<Value> {
        values.iter().map(|&id| Value::Id(id)).collect()
    }

    fn stray(counts: &ValueCounts, classes: &Classes) -> Vec<String> {
        counts.in_no_class(classes).iter().map(|(value, _)| value.to_string()).collect()
    }

    #[test]
    fn values_between_classes_are_in_no_class() {
        let classes = Classes { ground: "255".parse().expect("values"), ..Classes::default() };
        let mut counts = ValueCounts::default();
        // A soft edge, a hard one, and an object of one row that is as thick elsewhere.
        counts.add(&ids(&[0, 0, 0, 80, 175, 231, 255, 255, 255]));
        counts.add(&ids(&[0, 0, 0, 7, 255, 255, 255, 255, 255]));
        counts.add(&ids(&[0, 0, 7, 7, 7, 255, 255, 255, 255]));
        assert_eq!(stray(&counts, &classes), ["80", "175", "231"]);
        assert_eq!(counts.pixels(), 27);
        // Ground and what is ignored are named, lone or not.
        let ignored = Classes { ignored: "80,175".parse().expect("values"), ..classes.clone() };
        assert_eq!(stray(&counts, &ignored), ["231"]);
        let named = Classes { obstacles: "0".parse().expect("values"), ..classes };
        assert_eq!(stray(&counts, &named), ["7", "80", "175", "231"], "all that is not named");
        let mut twice = counts.clone();
        twice.extend(&counts);
        assert_eq!(twice.pixels(), 54);
        assert_eq!(twice.iter().next(), Some((Value::Id(0), Occurrence { pixels: 16, lone: 0 })));
    }

    #[test]
    fn a_value_for_every_pixel_is_counted_too() {
        let mut counts = ValueCounts::default();
        counts.add(&(0..=u16::MAX).map(Value::Id).collect::<Vec<_>>());
        assert_eq!((counts.iter().count(), counts.pixels()), (DISTINCT, 65_536));
    }
}
