//! How right the rows were on the way.

use super::source::Rows;
use crate::dataset::TOLERANCE;

/// A detector's answers on a run against the true ones.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize)]
pub struct Accuracy {
    /// Answers: frames times columns.
    pub answers: u64,
    /// Those within [`TOLERANCE`] rows of the truth.
    pub correct: u64,
    /// Wrong ones that see the obstacle nearer than it is: lower in the picture.
    pub too_near: u64,
    /// How many times a column began to be wrong.
    pub errors: u64,
    /// Those of them that were over within two frames.
    pub transient: u64,
}

impl Accuracy {
    /// Both together.
    pub fn and(self, other: Accuracy) -> Accuracy {
        Accuracy {
            answers: self.answers + other.answers,
            correct: self.correct + other.correct,
            too_near: self.too_near + other.too_near,
            errors: self.errors + other.errors,
            transient: self.transient + other.transient,
        }
    }

    /// The share of right answers, if there were any.
    pub fn share(&self) -> Option<f64> {
        (self.answers > 0).then(|| self.correct as f64 / self.answers as f64)
    }
}

/// Counts them, frame by frame.
#[derive(Debug, Clone, Default)]
pub(super) struct Counter {
    sum: Accuracy,
    /// For each column, for how many frames it has been wrong.
    wrong: Vec<u32>,
}

/// An error of so many frames is transient.
const TRANSIENT: u32 = 2;

impl Counter {
    pub(super) fn frame(&mut self, rows: &Rows, truth: impl Fn(u32) -> u32) {
        self.wrong.resize(rows.columns.len(), 0);
        for ((&column, &answer), wrong) in rows.columns.iter().zip(&rows.answers).zip(&mut self.wrong) {
            let label = f64::from(truth(column));
            let off = f64::from(answer) - label;
            self.sum.answers += 1;
            if off.abs() <= TOLERANCE {
                self.sum.correct += 1;
                self.sum.transient += u64::from((1..=TRANSIENT).contains(wrong));
                *wrong = 0;
                continue;
            }
            self.sum.too_near += u64::from(off > 0.0);
            self.sum.errors += u64::from(*wrong == 0);
            *wrong = wrong.saturating_add(1);
        }
    }

    pub(super) fn finish(self) -> Accuracy {
        self.sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_and_how_long_they_last() {
        let mut counter = Counter::default();
        let mut frame = |a: f32, b: f32| {
            let rows = Rows { columns: vec![1, 2], believed: vec![0.0; 2], answers: vec![a, b] };
            counter.frame(&rows, |column| 100 * column);
        };
        frame(110.0, 200.0);
        frame(110.5, f32::NAN);
        frame(89.0, f32::NAN);
        frame(90.0, f32::NAN);
        frame(100.0, 211.0);
        frame(100.0, 200.0);
        frame(0.0, 200.0);
        let sum = Accuracy { answers: 14, correct: 7, too_near: 2, errors: 3, transient: 1 };
        assert_eq!(counter.finish(), sum);
        assert_eq!((sum.share(), Accuracy::default().share()), (Some(0.5), None));
        assert_eq!(sum.and(sum).errors, 6);
    }
}
