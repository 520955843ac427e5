//! Medians and quartiles.

use serde::Serialize;

use crate::statistics::quantile;

/// Median and quartiles of a number of values. A value may be infinite; in JSON such a quantile is `null`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Spread {
    /// The first quartile.
    pub q1: f64,
    /// The median.
    pub median: f64,
    /// The third quartile.
    pub q3: f64,
}

impl Spread {
    /// Of these values, none of them NaN; of none at all, NaN.
    pub fn of(values: impl IntoIterator<Item = f64>) -> Spread {
        let mut values: Vec<f64> = values.into_iter().collect();
        values.sort_unstable_by(f64::total_cmp);
        let of = |share| if values.is_empty() { f64::NAN } else { quantile(&values, share) };
        Spread { q1: of(0.25), median: of(0.5), q3: of(0.75) }
    }
}

/// The median of these values; NaN of none.
pub(super) fn median(values: impl IntoIterator<Item = f64>) -> f64 {
    Spread::of(values).median
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quartiles_are_interpolated() {
        assert_eq!(Spread::of([5.0, 1.0, 3.0, 2.0, 4.0]), Spread { q1: 2.0, median: 3.0, q3: 4.0 });
        assert_eq!(Spread::of([1.0, 2.0]), Spread { q1: 1.25, median: 1.5, q3: 1.75 });
        assert_eq!(Spread::of([7.0]), Spread { q1: 7.0, median: 7.0, q3: 7.0 });
        assert!(Spread::of([]).median.is_nan());
    }

    #[test]
    fn infinities_are_values() {
        let spread = Spread::of([f64::INFINITY, 1.0, f64::INFINITY, 2.0]);
        assert_eq!(spread, Spread { q1: 1.75, median: f64::INFINITY, q3: f64::INFINITY });
        assert_eq!(Spread::of([1.0, 1.0, f64::INFINITY]).median, 1.0);
        assert_eq!(serde_json::to_value(spread).expect("JSON")["median"], serde_json::Value::Null);
    }
}
