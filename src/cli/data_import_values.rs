//! The report on the values that imported masks have.

use std::cmp::Reverse;
use std::fmt;

use serde::Serialize;
use vsonar::dataset::import::{Classes, Value, ValueCounts};

use super::output::count;

/// Values that the text names before it only counts.
const SHOWN: usize = 8;

/// A value of the masks.
#[derive(Debug, Clone, PartialEq, Serialize)]
struct Counted {
    value: String,
    pixels: u64,
    /// `ground`, `ignored` or `obstacle`; none for a value in no class, which counts as an obstacle.
    class: Option<&'static str>,
}

/// The values in the columns that were looked at.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct ValueReport {
    /// Pixels that were looked at.
    pixels: u64,
    /// The most frequent first.
    values: Vec<Counted>,
    /// Pixels whose values are in no class.
    in_no_class: u64,
}

impl ValueReport {
    pub(super) fn new(counts: &ValueCounts, classes: &Classes) -> ValueReport {
        let stray = counts.in_no_class(classes);
        let class = |value: Value| {
            if classes.ground.0.contains(&value) {
                Some("ground")
            } else if classes.ignored.0.contains(&value) {
                Some("ignored")
            } else {
                stray.iter().all(|(other, _)| *other != value).then_some("obstacle")
            }
        };
        let counted = |(value, occurrence): (Value, vsonar::dataset::import::Occurrence)| Counted {
            value: value.to_string(),
            pixels: occurrence.pixels,
            class: class(value),
        };
        let mut values: Vec<Counted> = counts.iter().map(counted).collect();
        values.sort_by_key(|counted| Reverse(counted.pixels));
        let in_no_class = stray.iter().map(|(_, occurrence)| occurrence.pixels).sum();
        ValueReport { pixels: counts.pixels(), values, in_no_class }
    }
}

impl fmt::Display for ValueReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let percent = |pixels: u64| format!("{:.1} %", 100.0 * pixels as f64 / self.pixels.max(1) as f64);
        let named = |counted: &&Counted| counted.class.is_some();
        let mut shown: Vec<String> = Vec::new();
        for Counted { value, pixels, class } in self.values.iter().filter(named).take(SHOWN) {
            shown.push(format!("{value} ({}, {})", class.unwrap_or_default(), percent(*pixels)));
        }
        let more = self.values.iter().filter(named).count().saturating_sub(SHOWN);
        if more > 0 {
            shown.push(format!("{more} more"));
        }
        writeln!(f, "values    {}", shown.join(", "))?;
        if self.in_no_class == 0 {
            return Ok(());
        }
        let stray: Vec<&Counted> = self.values.iter().filter(|counted| counted.class.is_none()).collect();
        let mut names: Vec<&str> = stray.iter().take(SHOWN).map(|counted| counted.value.as_str()).collect();
        if stray.len() > SHOWN {
            names.push("...");
        }
        writeln!(
            f,
            "note: {} ({}) have values in no class, which count as obstacles: {} ({}). Smoothed, scaled and compressed \
             masks have such values at edges, which moves labels: export the masks without that; or name all classes with \
             `--ground`, `--obstacle` and `--ignore`",
            count(self.in_no_class, "pixel"),
            percent(self.in_no_class),
            names.join(", "),
            count(stray.len() as u64, "value"),
        )
    }
}
