//! How large a difference is, whatever its significance.

use serde::Serialize;

/// Vargha and Delaney's measure of effect size: the probability that a value of the first sample is greater than one
/// of the second, where equal ones count half (*A Critique and Improvement of the CL Common Language Effect Size
/// Statistics of McGraw and Wong*, 2000). 0.5 is no difference.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(transparent)]
pub struct A12(pub f64);

/// An effect size in words, by the limits of Vargha and Delaney: 0.56, 0.64 and 0.71, or as far below 0.5.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Magnitude {
    /// Below 0.56.
    Negligible,
    /// From 0.56.
    Small,
    /// From 0.64.
    Medium,
    /// From 0.71.
    Large,
}

impl A12 {
    /// In words.
    pub fn magnitude(self) -> Magnitude {
        let beyond = (self.0 - 0.5).abs();
        // The limits are what stands in the paper; a value that is one of them but for rounding is one of them.
        let reaches = |limit: f64| beyond >= limit - 0.5 - 1e-12;
        match () {
            () if reaches(0.71) => Magnitude::Large,
            () if reaches(0.64) => Magnitude::Medium,
            () if reaches(0.56) => Magnitude::Small,
            () => Magnitude::Negligible,
        }
    }
}

impl std::fmt::Display for Magnitude {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.pad(match self {
            Magnitude::Negligible => "negligible",
            Magnitude::Small => "small",
            Magnitude::Medium => "medium",
            Magnitude::Large => "large",
        })
    }
}

/// The effect size between two samples; `None` if one is empty.
pub fn a12(first: &[f64], second: &[f64]) -> Option<A12> {
    if first.is_empty() || second.is_empty() {
        return None;
    }
    Some(A12(super::rank_sum::wins(first, second) / (first.len() * second.len()) as f64))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn by_hand() {
        let a = |first: &[f64], second: &[f64]| a12(first, second).map(|a| a.0);
        assert_eq!((a(&[], &[1.0]), a(&[1.0], &[])), (None, None));
        assert_eq!(a(&[1.0, 2.0], &[1.0, 2.0]), Some(0.5));
        assert_eq!(a(&[3.0, 4.0], &[1.0, 2.0, 2.5]), Some(1.0));
        // Of the six pairs 2 > 1, 4 > 1, 4 > 2 and 4 > 3 are won, and 2 = 2 is half won.
        assert_eq!(a(&[2.0, 4.0], &[1.0, 2.0, 3.0]), Some(4.5 / 6.0));
        assert_eq!(a(&[1.0, 2.0, 3.0], &[2.0, 4.0]), Some(1.5 / 6.0));
    }

    #[test]
    fn words() {
        let word = |a: f64| A12(a).magnitude();
        assert_eq!([0.5, 0.559, 0.441].map(word), [Magnitude::Negligible; 3]);
        assert_eq!([0.56, 0.44, 0.639].map(word), [Magnitude::Small; 3]);
        assert_eq!([0.64, 0.36, 0.709].map(word), [Magnitude::Medium; 3]);
        assert_eq!([0.71, 0.29, 1.0, 0.0].map(word), [Magnitude::Large; 4]);
    }
}
