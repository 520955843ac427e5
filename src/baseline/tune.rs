//! Tuning: a grid of settings, counted on the training cases alone.
//!
//! Every grid is a list of settings (window sizes and the like) and, for each of them, a ladder of thresholds. Counts are
//! whole numbers, so the choice does not depend on the number of threads.

use rayon::prelude::*;

use crate::dataset::{Case, Dataset};

/// Correct cases for each setting and threshold.
#[derive(Debug, Clone)]
pub(crate) struct Tally {
    tolerance: f64,
    thresholds: usize,
    correct: Vec<u32>,
}

/// What was chosen.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Choice {
    pub(crate) setting: usize,
    pub(crate) threshold: usize,
    /// Training cases it gets right.
    pub(crate) correct: usize,
    /// Settings and thresholds that there were.
    pub(crate) tried: usize,
}

impl Tally {
    /// Asks `judge` about every image: its index and its cases.
    pub(crate) fn of(
        set: &Dataset,
        tolerance: f64,
        settings: usize,
        thresholds: usize,
        judge: impl Fn(usize, &[Case], &mut Tally) + Sync,
    ) -> Tally {
        let mut cases = vec![Vec::new(); set.images().len()];
        set.cases().iter().for_each(|&case| cases[case.image].push(case));
        let empty = || Tally { tolerance, thresholds, correct: vec![0; settings * thresholds] };
        let one = |mut tally: Tally, (image, cases): (usize, &Vec<Case>)| {
            judge(image, cases, &mut tally);
            tally
        };
        let sum = |mut a: Tally, b: Tally| {
            a.correct.iter_mut().zip(b.correct).for_each(|(a, b)| *a += b);
            a
        };
        cases.par_iter().enumerate().fold(empty, one).reduce(empty, sum)
    }

    /// Takes down an answer.
    #[inline]
    pub(crate) fn answer(&mut self, setting: usize, threshold: usize, answer: f32, case: &Case) {
        let correct = (f64::from(answer) - f64::from(case.y)).abs() <= self.tolerance;
        self.correct[setting * self.thresholds + threshold] += u32::from(correct);
    }

    /// The first setting that gets most cases right with any threshold, and of its equally good thresholds the middle
    /// (rounded down) of the first unbroken stretch: the fairest guess for other images, as of the best constants.
    pub(crate) fn choose(&self) -> Choice {
        let best = self.correct.iter().copied().max().unwrap_or(0);
        let first = self.correct.iter().position(|&c| c == best).unwrap_or(0);
        let (setting, start) = (first / self.thresholds, first % self.thresholds);
        let ladder = &self.correct[setting * self.thresholds..][start..self.thresholds];
        let stretch = ladder.iter().take_while(|&&c| c == best).count();
        Choice {
            setting,
            threshold: start + (stretch - 1) / 2,
            correct: best as usize,
            tried: self.correct.len(),
        }
    }
}

/// A ladder of `N` thresholds from `low` to `high`, each the same factor above the one before, to three significant
/// digits.
pub(crate) fn ladder<const N: usize>(low: f64, high: f64) -> [f64; N] {
    std::array::from_fn(|i| {
        let value = low * libm::pow(high / low, i as f64 / (N - 1) as f64);
        let digits = 2.0 - libm::floor(libm::log10(value));
        // Divided by a power of ten, a whole number becomes the one that prints shortest.
        let (up, down) = (libm::pow(10.0, digits.max(0.0)), libm::pow(10.0, (-digits).max(0.0)));
        (value * up / down).round() * down / up
    })
}

/// For each of the ascending thresholds the row of the first of these values that exceeds it, 0 if none does.
pub(crate) fn first_above<const N: usize>(
    values: impl IntoIterator<Item = (usize, f64)>,
    thresholds: &[f64; N],
) -> [f32; N] {
    let mut rows = [0.0; N];
    let mut next = 0;
    for (row, value) in values {
        while next < N && value > thresholds[next] {
            rows[next] = row as f32;
            next += 1;
        }
        if next == N {
            break;
        }
    }
    rows
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_middle_of_the_first_stretch_is_chosen() {
        let tally = |correct: &[u32]| Tally { tolerance: 0.0, thresholds: 4, correct: correct.to_vec() };
        let chosen = |correct: &[u32]| {
            let choice = tally(correct).choose();
            (choice.setting, choice.threshold, choice.correct, choice.tried)
        };
        assert_eq!(chosen(&[1, 2, 2, 0, 1, 3, 3, 3]), (1, 2, 3, 8));
        assert_eq!(chosen(&[3, 1, 3, 3, 3, 3, 3, 3]), (0, 0, 3, 8));
        assert_eq!(chosen(&[0, 0, 0, 0]), (0, 1, 0, 4));
        assert_eq!(chosen(&[0, 1, 1, 1, 1, 0, 0, 0]), (0, 2, 1, 8), "a stretch ends with its setting");
    }

    #[test]
    fn ladders_ascend() {
        let steps = ladder::<48>(0.5, 200.0);
        assert_eq!([steps[0], steps[47]], [0.5, 200.0]);
        assert!(steps.windows(2).all(|w| w[0] < w[1]), "{steps:?}");
    }

    #[test]
    fn the_first_above_is_found_for_every_threshold() {
        let values = [(9, 1.0), (8, 5.0), (7, 3.0), (6, 7.0)];
        assert_eq!(first_above(values, &[0.5, 1.0, 4.0, 6.0, 7.0]), [9.0, 8.0, 8.0, 6.0, 0.0]);
    }
}
