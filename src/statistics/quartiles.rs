//! Quantiles of a sample.

use serde::Serialize;

/// The quantile of `sorted` (ascending, not empty) at probability `p`, 0 to 1: definition 7 of Hyndman & Fan (*Sample
/// Quantiles in Statistical Packages*, 1996), the default of R and NumPy. It lies at position p (n - 1), between two
/// values by linear interpolation.
///
/// # Panics
/// If there are no numbers.
pub fn quantile(sorted: &[f64], p: f64) -> f64 {
    let position = p.clamp(0.0, 1.0) * (sorted.len() - 1) as f64;
    let below = position.floor();
    let (low, high) = (sorted[below as usize], sorted[position.ceil() as usize]);
    let (part, difference) = (position - below, high - low);
    // Equal neighbours give themselves, without rounding; others may differ by more than the greatest number.
    match low == high {
        true => low,
        false if difference.is_finite() => low + part * difference,
        false => low * (1.0 - part) + high * part,
    }
}

/// A sample in five numbers.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Quartiles {
    /// The least.
    pub min: f64,
    /// The quantile at 1/4.
    pub lower: f64,
    /// The median.
    pub median: f64,
    /// The quantile at 3/4.
    pub upper: f64,
    /// The greatest.
    pub max: f64,
}

impl Quartiles {
    /// Those of a sample, by the definition of [`quantile`]; `None` if it is empty.
    pub fn of(sample: &[f64]) -> Option<Quartiles> {
        let mut sorted = sample.to_vec();
        sorted.sort_unstable_by(f64::total_cmp);
        let (&min, &max) = (sorted.first()?, sorted.last()?);
        let [lower, median, upper] = [0.25, 0.5, 0.75].map(|p| quantile(&sorted, p));
        Some(Quartiles { min, lower, median, upper, max })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Worked by hand from the definition: position p (n - 1).
    #[test]
    fn by_hand() {
        let five = |min, lower, median, upper, max| Some(Quartiles { min, lower, median, upper, max });
        assert_eq!(Quartiles::of(&[]), None);
        assert_eq!(Quartiles::of(&[3.0]), five(3.0, 3.0, 3.0, 3.0, 3.0));
        assert_eq!(Quartiles::of(&[4.0, 1.0]), five(1.0, 1.75, 2.5, 3.25, 4.0));
        assert_eq!(Quartiles::of(&[9.0, 1.0, 5.0, 2.0]), five(1.0, 1.75, 3.5, 6.0, 9.0));
        assert_eq!(Quartiles::of(&[7.0, 1.0, 3.0, 15.0, 5.0]), five(1.0, 3.0, 5.0, 7.0, 15.0));
        let sorted: Vec<f64> = (0..=10).map(f64::from).collect();
        assert_eq!([0.0, 0.125, 0.95, 1.0].map(|p| quantile(&sorted, p)), [0.0, 1.25, 9.5, 10.0]);
    }

    #[test]
    fn far_and_infinite_neighbours() {
        let of = |low: f64, high: f64| [0.0, 0.25, 0.5, 1.0].map(|p| quantile(&[low, high], p));
        let [least, lower, middle, most] = of(f64::MIN, f64::MAX);
        assert_eq!((least, middle, most), (f64::MIN, 0.0, f64::MAX));
        assert!((lower / f64::MAX + 0.5).abs() < 1e-15, "{lower}");
        assert_eq!(of(1.0, f64::INFINITY)[..3], [1.0, f64::INFINITY, f64::INFINITY]);
        assert_eq!(of(f64::INFINITY, f64::INFINITY), [f64::INFINITY; 4]);
        assert_eq!(of(-5e-324, 5e-324)[2], 0.0);
    }
}
