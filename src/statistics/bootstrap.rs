//! How uncertain a share of correct cases is, where cases come in clusters.
//!
//! Neighbouring frames of a drive are almost the same picture, so their cases are right or wrong together: to draw
//! single cases would make a score look far more certain than it is. So whole clusters (stretches of a drive) are
//! drawn (Davison & Hinkley, *Bootstrap Methods and their Application*, 1997, section 3.8).

use super::quantile;
use crate::tree::Random;

/// Cases that belong together.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Cluster {
    /// Cases that are solved.
    pub correct: u32,
    /// Cases there are.
    pub cases: u32,
}

/// The percentile interval (Efron 1979) of the share of correct cases over all clusters: as many clusters as there are
/// are drawn with replacement, `resamples` times, and of the shares the quantiles (1 - level) / 2 and (1 + level) / 2
/// are taken, by the definition of [`quantile`].
///
/// `level` is the probability that the interval is to have, 0 to 1, e.g. 0.95. The result is a function of the
/// arguments alone. `None` if fewer than two clusters have cases, for then nothing can be drawn, or `resamples` is 0.
///
/// ```
/// use vsonar::statistics::{Cluster, interval};
///
/// let drives = [9, 10, 4, 10, 8, 10].map(|correct| Cluster { correct, cases: 10 });
/// let (low, high) = interval(&drives, 0.95, 2000, 1).expect("there are clusters");
/// assert!(0.6 < low && low < 0.85 && 0.85 < high && high < 1.0, "{low} to {high}");
/// ```
pub fn interval(clusters: &[Cluster], level: f64, resamples: usize, seed: u64) -> Option<(f64, f64)> {
    let clusters: Vec<Cluster> = clusters.iter().copied().filter(|cluster| cluster.cases > 0).collect();
    if clusters.len() < 2 || resamples == 0 {
        return None;
    }
    let mut random = Random::stream(seed, 0, 0);
    let mut draw = || {
        let (mut correct, mut cases) = (0u64, 0u64);
        for _ in 0..clusters.len() {
            let cluster = clusters[random.index(clusters.len())];
            correct += u64::from(cluster.correct);
            cases += u64::from(cluster.cases);
        }
        correct as f64 / cases as f64
    };
    let mut shares: Vec<f64> = (0..resamples).map(|_| draw()).collect();
    shares.sort_unstable_by(f64::total_cmp);
    let tail = (1.0 - level.clamp(0.0, 1.0)) / 2.0;
    Some((quantile(&shares, tail), quantile(&shares, 1.0 - tail)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn clusters(numbers: &[(u32, u32)]) -> Vec<Cluster> {
        numbers.iter().map(|&(correct, cases)| Cluster { correct, cases }).collect()
    }

    /// All n^n samples of three clusters, each equally likely: the distribution that draws approach.
    #[test]
    fn draws_approach_the_exact_distribution() {
        let three = clusters(&[(1, 10), (18, 20), (30, 30)]);
        let mut exact = Vec::new();
        for i in 0..27 {
            let drawn = [i % 3, i / 3 % 3, i / 9].map(|k| three[k]);
            let (correct, cases) =
                drawn.iter().fold((0, 0), |(a, b), cluster| (a + cluster.correct, b + cluster.cases));
            exact.push(f64::from(correct) / f64::from(cases));
        }
        exact.sort_by(f64::total_cmp);
        // 27 values: no quantile of these levels is near a step, so the drawn one is exactly a value of the 27.
        for level in [0.5, 0.8] {
            let (low, high) = interval(&three, level, 40_000, 3).expect("three clusters");
            let at = |p: f64| exact[(p * 27.0) as usize];
            assert_eq!((low, high), (at((1.0 - level) / 2.0), at((1.0 + level) / 2.0)), "{level}");
        }
    }

    #[test]
    fn of_many_single_cases_it_is_the_normal_interval() {
        // 70 of 100 cases by themselves: 0.7 +- 1.96 sqrt(0.7 * 0.3 / 100) = 0.610 to 0.790.
        let cases: Vec<Cluster> =
            (0..100).map(|i| Cluster { correct: u32::from(i < 70), cases: 1 }).collect();
        let (low, high) = interval(&cases, 0.95, 10_000, 1).expect("clusters");
        assert!((low - 0.610).abs() < 0.015 && (high - 0.790).abs() < 0.015, "{low} {high}");
        // The same cases in clusters of ten that stand or fall together are far less certain.
        let clusters: Vec<Cluster> =
            (0..10).map(|i| Cluster { correct: 10 * u32::from(i < 7), cases: 10 }).collect();
        let (low, high) = interval(&clusters, 0.95, 10_000, 1).expect("clusters");
        assert!(low <= 0.4 && high >= 0.9, "{low} {high}");
    }

    #[test]
    fn it_repeats_and_knows_its_limits() {
        let some = clusters(&[(3, 9), (5, 7), (0, 0), (2, 8)]);
        assert_eq!(interval(&some, 0.9, 500, 7), interval(&some, 0.9, 500, 7));
        let many: Vec<Cluster> = (0..40).map(|i| Cluster { correct: i * i % 17, cases: 17 + i }).collect();
        assert_ne!(interval(&many, 0.9, 50, 7), interval(&many, 0.9, 50, 8));
        assert_eq!(interval(&some, 0.9, 500, 7), interval(&clusters(&[(3, 9), (5, 7), (2, 8)]), 0.9, 500, 7));
        for few in [&[][..], &[(3, 9)], &[(3, 9), (0, 0)]] {
            assert_eq!(interval(&clusters(few), 0.9, 500, 7), None);
        }
        assert_eq!(interval(&some, 0.9, 0, 7), None);
        assert_eq!(interval(&clusters(&[(9, 9); 4]), 0.95, 100, 1), Some((1.0, 1.0)));
    }
}
