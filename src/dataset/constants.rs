//! The floor to beat: how many cases a constant answer gets right, one for all columns or one for each.
//!
//! A detector is worth something only as far as it is above this floor, for obstacles tend to stand at the
//! same height in many pictures of a set.
//!
//! ```
//! use vsonar::dataset::best_constant;
//! // 25 is within 10 rows of 20, 30 and 35; no answer is within 10 rows of all four
//! let best = best_constant(&[20, 30, 35, 90], 10.0);
//! assert_eq!((best.answer, best.correct, best.cases), (27.0, 3, 4));
//! ```

use serde::Serialize;

use super::Dataset;

/// How far an answer may be from the label and still be correct, in rows, unless a setting says otherwise.
pub const TOLERANCE: f64 = 10.0;

/// The constant answer that gets most cases right.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct BestConstant {
    /// The answer, a row.
    pub answer: f64,
    /// Cases it gets right.
    pub correct: usize,
    /// All cases.
    pub cases: usize,
}

impl BestConstant {
    /// Share of the cases it gets right, 0 to 1; 0 without cases.
    pub fn share(&self) -> f64 {
        share(self.correct, self.cases)
    }
}

fn share(correct: usize, cases: usize) -> f64 {
    if cases == 0 { 0.0 } else { correct as f64 / cases as f64 }
}

/// The rule of a correct answer: `|answer - label| <= tolerance`, in binary64.
fn is_correct(answer: f64, label: u32, tolerance: f64) -> bool {
    (answer - f64::from(label)).abs() <= tolerance
}

/// The answer that is within `tolerance` rows of most labels.
///
/// Searched are the whole numbers between the smallest and the largest label, and the half steps too where the
/// fraction of the tolerance is a half or more: an answer `c` reaches the labels in `[c - t, c + t]`, at most
/// `floor(2 t) + 1` neighbouring rows, and a whole `c` reaches that many unless the fraction is a half or
/// more, when a half step does. So no real number does better. Of equally good answers it takes the middle
/// (rounded down) of the first unbroken stretch, which is the fairest guess for other images.
///
/// Without labels the answer is 0 with nothing correct.
pub fn best_constant(labels: &[u32], tolerance: f64) -> BestConstant {
    let mut sorted = labels.to_vec();
    sorted.sort_unstable();
    let (Some(&low), Some(&high)) = (sorted.first(), sorted.last()) else {
        return BestConstant { answer: 0.0, correct: 0, cases: 0 };
    };
    let steps = if tolerance - tolerance.floor() >= 0.5 { 2 } else { 1 };
    let count = |answer: f64| {
        // both bounds by the rule itself, so that rounding cannot make them differ from it
        let below = sorted.partition_point(|&l| f64::from(l) < answer && !is_correct(answer, l, tolerance));
        let reached = sorted.partition_point(|&l| f64::from(l) <= answer || is_correct(answer, l, tolerance));
        reached.saturating_sub(below)
    };
    let (first, last) = (u64::from(low) * steps, u64::from(high) * steps);
    let (mut best, mut start, mut end) = (0, first, first);
    for step in first..=last {
        let correct = if tolerance >= 0.0 { count(step as f64 / steps as f64) } else { 0 };
        if correct > best {
            (best, start, end) = (correct, step, step);
        } else if correct == best && end + 1 == step {
            end = step;
        }
    }
    let answer = ((start + end) / 2) as f64 / steps as f64;
    BestConstant { answer, correct: best, cases: labels.len() }
}

/// The best constants of a set: one for everything, and one for each column.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Constants {
    tolerance: f64,
    overall: BestConstant,
    columns: Vec<(u32, BestConstant)>,
}

/// How constants do on a set of cases.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Score {
    /// Cases the one constant for everything gets right.
    pub overall: usize,
    /// Cases the constants of the columns get right.
    pub per_column: usize,
    /// All cases.
    pub cases: usize,
}

impl Score {
    /// Share the one constant gets right, 0 to 1.
    pub fn overall_share(&self) -> f64 {
        share(self.overall, self.cases)
    }

    /// Share the constants of the columns get right, 0 to 1.
    pub fn per_column_share(&self) -> f64 {
        share(self.per_column, self.cases)
    }
}

impl Constants {
    /// The constants that do best on this set, with answers correct within `tolerance` rows.
    pub fn learn(set: &Dataset, tolerance: f64) -> Constants {
        let column = |x: u32| -> Vec<u32> { set.cases().iter().filter(|c| c.x == x).map(|c| c.y).collect() };
        let columns = set.columns().into_iter().map(|x| (x, best_constant(&column(x), tolerance))).collect();
        Constants { tolerance, overall: best_constant(&set.labels(), tolerance), columns }
    }

    /// The tolerance they were learned for, in rows.
    pub fn tolerance(&self) -> f64 {
        self.tolerance
    }

    /// The one constant for everything.
    pub fn overall(&self) -> BestConstant {
        self.overall
    }

    /// The constant of each column that occurs, by ascending column.
    pub fn columns(&self) -> &[(u32, BestConstant)] {
        &self.columns
    }

    /// The answer for a column: its own constant, or the overall one if the column was never seen.
    pub fn answer(&self, x: u32) -> f64 {
        match self.columns.binary_search_by_key(&x, |&(column, _)| column) {
            Ok(i) => self.columns[i].1.answer,
            Err(_) => self.overall.answer,
        }
    }

    /// Whether the constant of its column is right about a case.
    pub fn is_correct(&self, case: &super::Case) -> bool {
        is_correct(self.answer(case.x), case.y, self.tolerance)
    }

    /// The answer for a column of an image that was moved or mirrored: the constant of the nearest column that was
    /// seen, of two equally near ones the left.
    pub fn answer_near(&self, x: u32) -> f64 {
        let nearest = self.columns.iter().min_by_key(|(column, _)| column.abs_diff(x));
        nearest.map_or(self.overall.answer, |(_, constant)| constant.answer)
    }

    /// How many cases of a set the constants of the nearest columns get right.
    pub fn score_near(&self, set: &Dataset) -> usize {
        let correct = |c: &&super::Case| is_correct(self.answer_near(c.x), c.y, self.tolerance);
        set.cases().iter().filter(correct).count()
    }

    /// How these constants do on a set, be it that they were learned on or another.
    pub fn score(&self, set: &Dataset) -> Score {
        let correct = |answer: &dyn Fn(u32) -> f64| {
            set.cases().iter().filter(|c| is_correct(answer(c.x), c.y, self.tolerance)).count()
        };
        Score {
            overall: correct(&|_| self.overall.answer),
            per_column: set.cases().iter().filter(|case| self.is_correct(case)).count(),
            cases: set.cases().len(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_beats_the_best_constant() {
        let mut state = 1u32;
        let mut next = |below: u32| {
            state = state.wrapping_mul(1664525).wrapping_add(1013904223);
            (state >> 16) % below
        };
        for round in 0..200 {
            let labels: Vec<u32> = (0..1 + next(40)).map(|_| next(60)).collect();
            for tolerance in [0.0, 0.25, 0.5, 1.0, 2.75, 3.0, 3.5, 10.0, 100.0] {
                let best = best_constant(&labels, tolerance);
                let count =
                    |answer: f64| labels.iter().filter(|&&l| is_correct(answer, l, tolerance)).count();
                assert_eq!(count(best.answer), best.correct, "round {round}, {labels:?}, {tolerance}");
                let brute = (-800..1600).map(|i| count(f64::from(i) / 8.0)).max().unwrap();
                assert_eq!(best.correct, brute, "round {round}, {labels:?}, {tolerance}");
            }
        }
    }

    #[test]
    fn odd_tolerances_and_no_labels() {
        assert_eq!(best_constant(&[], 10.0).cases, 0);
        assert_eq!(best_constant(&[5, 5], -1.0).correct, 0);
        assert_eq!(best_constant(&[5, 5], f64::NAN).correct, 0);
        assert_eq!(best_constant(&[5, 239], f64::INFINITY).correct, 2);
        assert_eq!(best_constant(&[0, 1], 0.5), BestConstant { answer: 0.5, correct: 2, cases: 2 });
    }

    #[test]
    fn ties_take_the_middle_of_the_first_stretch() {
        assert_eq!(best_constant(&[100], 10.0).answer, 100.0);
        assert_eq!(best_constant(&[0, 10, 100, 110], 10.0).answer, 5.0);
    }
}
