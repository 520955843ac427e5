//! The scale of a plot's axis: from values to places along it, and its ticks.
//!
//! It takes every finite number: ranges from the least binary64 to the greatest, values that are all equal, and none at
//! all. A scale has no more ticks than it is asked for, whatever its range.

use std::ops::Range;

use plotters::coord::ranged1d::{KeyPointHint, NoDefaultFormatting, Ranged, ValueFormatter};

use crate::support::printable;

/// The least part of its greatest number that a linear range spans; less is widened, as nobody could read it.
const NARROWEST: f64 = 1e-9;
/// Room on both sides of the values of a logarithmic scale, as a factor.
const LOG_ROOM: f64 = 1.3;

/// How values lie along an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Spacing {
    Linear,
    Logarithmic,
}

/// The scale of an axis, with finite ends of which the first is the lower one.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Scale {
    range: Range<f64>,
    spacing: Spacing,
    /// Ticks asked for, in place of round numbers.
    chosen: Vec<f64>,
}

impl Scale {
    /// A linear scale between two numbers; from 0 to 1 if one of them is not finite.
    pub(crate) fn linear(start: f64, end: f64) -> Scale {
        let (low, high) =
            if start.is_finite() && end.is_finite() { (start.min(end), start.max(end)) } else { (0.0, 1.0) };
        let least = (NARROWEST * low.abs().max(high.abs())).max(f64::MIN_POSITIVE);
        let range = if high - low < least {
            (low - least).max(f64::MIN)..(high + least).min(f64::MAX)
        } else {
            low..high
        };
        Scale { range, spacing: Spacing::Linear, chosen: Vec::new() }
    }

    /// A logarithmic scale that holds the values which are finite and above 0, with some room on both sides.
    pub(crate) fn logarithmic(values: impl Iterator<Item = f64>) -> Scale {
        let positive = values.filter(|v| v.is_finite() && *v > 0.0).map(|v| v.max(f64::MIN_POSITIVE));
        let (low, high) = extent(positive).unwrap_or((LOG_ROOM, 10.0 / LOG_ROOM));
        let range = low / LOG_ROOM..(high * LOG_ROOM).min(f64::MAX);
        Scale { range, spacing: Spacing::Logarithmic, chosen: Vec::new() }
    }

    /// The scale with ticks at these places, as far as they are on it; round numbers if they are too many.
    pub(crate) fn with_ticks(self, mut chosen: Vec<f64>) -> Scale {
        chosen.sort_unstable_by(f64::total_cmp);
        chosen.dedup();
        Scale { chosen, ..self }
    }

    /// From the lower end to the higher one.
    pub(crate) fn range(&self) -> Range<f64> {
        self.range.clone()
    }

    /// The place of a value as a share of the axis, 0 to 1. What lies beyond an end, or is no number, is at that end.
    pub(crate) fn share(&self, value: f64) -> f64 {
        let Range { start, end } = self.range;
        let share = match self.spacing {
            // Halves, as the whole may be more than the greatest number.
            Spacing::Linear => (value / 2.0 - start / 2.0) / (end / 2.0 - start / 2.0),
            Spacing::Logarithmic if value > 0.0 => (value.ln() - start.ln()) / (end.ln() - start.ln()),
            Spacing::Logarithmic => 0.0,
        };
        if share.is_nan() { 0.0 } else { share.clamp(0.0, 1.0) }
    }

    /// Round numbers along the axis in ascending order, at most so many.
    pub(crate) fn ticks(&self, most: usize) -> Vec<f64> {
        if most == 0 {
            return Vec::new();
        }
        let inside = |tick: &f64| (self.range.start..=self.range.end).contains(tick);
        let chosen: Vec<f64> = self.chosen.iter().copied().filter(inside).collect();
        if !chosen.is_empty() && chosen.len() <= most {
            return chosen;
        }
        match self.spacing {
            Spacing::Linear => self.even_ticks(most),
            Spacing::Logarithmic => match self.powers(&[1, 2, 5], 1) {
                few if few.len() < 2 => self.even_ticks(most),
                fine if fine.len() <= most => fine,
                // Every power of ten, or every second, third ...
                fine => (1.max(fine.len() / (4 * most)) as i32..)
                    .map(|every| self.powers(&[1], every))
                    .find(|ticks| ticks.len() <= most)
                    .unwrap_or_default(),
            },
        }
    }

    /// Multiples of 1, 2 or 5 times a power of ten: of the least step that gives no more ticks than `most`.
    fn even_ticks(&self, most: usize) -> Vec<f64> {
        let Range { start, end } = self.range;
        // Divided one by one, as their difference may be more than the greatest number.
        let least = end / most as f64 - start / most as f64;
        let exponent = least.log10().floor();
        if !exponent.is_finite() {
            return Vec::new();
        }
        let steps = [0, 1].into_iter().flat_map(|up| [1, 2, 5].map(|digit| (digit, exponent as i32 + up)));
        let ticks = |(digit, exponent): (i64, i32)| -> Vec<f64> {
            let step = decimal(digit, exponent);
            // A range is no less than a billionth of its ends, so that these are small enough to be exact.
            let (first, last) = ((start / step).ceil() as i64, (end / step).floor() as i64);
            let all = (first..=last).take(most + 1).map(|i| decimal(i * digit, exponent));
            all.filter(|tick| tick.is_finite() && (start..=end).contains(tick)).collect()
        };
        steps.map(ticks).find(|ticks| ticks.len() <= most).unwrap_or_default()
    }

    /// These multiples of every so many powers of ten, as far as they are on the scale.
    fn powers(&self, digits: &[i64], every: i32) -> Vec<f64> {
        let Range { start, end } = self.range;
        let (first, last) = (start.log10().floor() as i32, end.log10().ceil() as i32);
        let powers = (first..=last).filter(|power| power.rem_euclid(every) == 0);
        let all = powers.flat_map(|power| digits.iter().map(move |&digit| decimal(digit, power)));
        all.filter(|tick| (start..=end).contains(tick)).collect()
    }
}

impl Ranged for Scale {
    type FormatOption = NoDefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, (from, to): (i32, i32)) -> i32 {
        from + (self.share(*value) * f64::from(to - from)).round() as i32
    }

    fn key_points<Hint: KeyPointHint>(&self, hint: Hint) -> Vec<f64> {
        self.ticks(hint.max_num_points())
    }

    fn range(&self) -> Range<f64> {
        self.range.clone()
    }
}

impl ValueFormatter<f64> for Scale {
    fn format(value: &f64) -> String {
        label(*value)
    }
}

/// The least and the greatest of the values that are finite; `None` if none is.
pub(crate) fn extent(values: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    let mut finite = values.filter(|value| value.is_finite());
    let first = finite.next()?;
    Some(finite.fold((first, first), |(low, high), value| (low.min(value), high.max(value))))
}

/// A number in few characters: with commas between thousands, and with an exponent where it is very large or small.
pub(crate) fn label(value: f64) -> String {
    match value.abs() {
        0.0 => "0".to_string(),
        1e-4..1e7 => {
            let text = value.to_string();
            let (whole, part) = text.split_at(text.find('.').unwrap_or(text.len()));
            let (sign, digits) = whole.split_at(usize::from(whole.starts_with('-')));
            format!("{sign}{}{part}", printable::grouped(digits))
        }
        _ => format!("{value:e}"),
    }
}

/// The binary64 nearest to a decimal; infinite beyond the greatest.
fn decimal(digits: i64, exponent: i32) -> f64 {
    // Every such text is a number.
    format!("{digits}e{exponent}").parse().unwrap_or(f64::INFINITY)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The numbers that arithmetic goes wrong at, and some ordinary ones.
    const NUMBERS: [f64; 19] = [
        f64::MIN,
        -1e300,
        -7.25,
        -1e-300,
        -f64::MIN_POSITIVE,
        -5e-324,
        -0.0,
        0.0,
        5e-324,
        f64::MIN_POSITIVE,
        1e-9,
        0.3,
        1.0,
        1.000_000_000_000_000_2,
        7.25,
        9_007_199_254_740_993.0,
        1e300,
        8.9e307,
        f64::MAX,
    ];

    fn check(scale: &Scale, values: &[f64]) {
        let Range { start, end } = scale.range();
        assert!(start.is_finite() && end.is_finite() && start < end, "{scale:?}");
        for most in [0, 1, 2, 3, 6, 7, 8, 14, 29] {
            let ticks = scale.ticks(most);
            assert!(ticks.len() <= most, "{most}: {scale:?}: {ticks:?}");
            assert!(most < 6 || ticks.len() >= 2, "{most}: {scale:?}: {ticks:?}");
            assert!(ticks.is_sorted_by(|a, b| a < b), "{scale:?}: {ticks:?}");
            assert!(ticks.iter().all(|tick| start <= *tick && *tick <= end), "{scale:?}: {ticks:?}");
            let labels: Vec<String> = ticks.iter().map(|tick| label(*tick)).collect();
            assert!(labels.iter().all(|label| label.len() <= 22), "{labels:?}");
            assert!(labels.windows(2).all(|pair| pair[0] != pair[1]), "{labels:?}");
        }
        for &value in values {
            let place = scale.map(&value, (0, 1000));
            assert!((0..=1000).contains(&place), "{value} in {scale:?}: {place}");
        }
        assert_eq!((scale.map(&start, (700, 20)), scale.map(&end, (700, 20))), (700, 20));
    }

    #[test]
    fn every_pair_of_numbers_is_a_range() {
        for low in NUMBERS {
            for high in NUMBERS {
                check(&Scale::linear(low, high), &NUMBERS);
                check(&Scale::logarithmic([low, high].into_iter()), &NUMBERS);
            }
        }
        for odd in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            assert_eq!(Scale::linear(odd, 3.0), Scale::linear(0.0, 1.0));
            assert_eq!(Scale::logarithmic([odd].into_iter()), Scale::logarithmic([].into_iter()));
            check(&Scale::linear(2.0, 3.0), &[odd]);
            check(&Scale::logarithmic([2.0, 3.0].into_iter()), &[odd]);
        }
        assert_eq!(Scale::logarithmic([].into_iter()).range(), 1.0..10.0);
    }

    /// Ranges of all widths at all places.
    #[test]
    fn ranges_at_random_are_ranges() {
        let mut state = 1u64;
        let mut random = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            f64::from_bits(state ^ (state >> 29))
        };
        for _ in 0..300 {
            let (a, b) = (random(), random());
            let near = a + a.abs() * (b.abs() % 1e-6);
            for (low, high) in [(a, b), (a, near)] {
                check(&Scale::linear(low, high), &[low, high]);
                check(&Scale::logarithmic([low, high].into_iter()), &[low, high]);
            }
        }
    }

    #[test]
    fn ticks_are_round_numbers() {
        let labels = |scale: Scale, most| -> String {
            scale.ticks(most).into_iter().map(label).collect::<Vec<_>>().join(" ")
        };
        assert_eq!(labels(Scale::linear(0.0, 1.0), 6), "0 0.2 0.4 0.6 0.8 1");
        assert_eq!(labels(Scale::linear(-0.35, 0.1), 5), "-0.3 -0.2 -0.1 0 0.1");
        assert_eq!(labels(Scale::linear(5.0, 5.0), 3), "4.999999995 5 5.000000005");
        assert_eq!(labels(Scale::linear(0.0, 2466.0), 6), "0 500 1,000 1,500 2,000");
        assert_eq!(labels(Scale::linear(0.0, f64::MAX), 4), "0 5e307 1e308 1.5e308");
        let log = |low: f64, high: f64| Scale::logarithmic([low * LOG_ROOM, high / LOG_ROOM].into_iter());
        assert_eq!(labels(log(0.03, 700.0), 13), "0.05 0.1 0.2 0.5 1 2 5 10 20 50 100 200 500");
        assert_eq!(labels(log(0.03, 700.0), 12), "0.1 1 10 100");
        assert_eq!(labels(log(0.03, 700.0), 3), "1 100");
        assert_eq!(labels(log(2.9, 5.2), 5), "3 3.5 4 4.5 5");
        let cases = log(20.0, 600.0).with_ticks(vec![32.0, 64.0, 505.0]);
        assert_eq!((labels(cases.clone(), 5), labels(cases, 2)), ("32 64 505".into(), "100".into()));
    }

    #[test]
    fn labels_are_short() {
        let texts = [0.3, -0.0, 1234.0, -12345.5, 1e7, f64::MAX, 5e-324, 0.0001].map(label);
        let expected =
            ["0.3", "0", "1,234", "-12,345.5", "1e7", "1.7976931348623157e308", "5e-324", "0.0001"];
        assert_eq!(texts, expected);
    }
}
