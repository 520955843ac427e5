//! How right the rows were on the way, and how long errors lasted.

use super::source::Rows;
use crate::camera::ground::median_of_three;
use crate::dataset::{Lasting, TOLERANCE};
use crate::ir::machine::Scalar;

/// A detector's answers on a run against the true ones, before any median; frames follow each other in
/// 1/[`FRAME_RATE`] s.
///
/// [`FRAME_RATE`]: crate::world::office::FRAME_RATE
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize)]
pub struct Accuracy {
    /// Answers: frames times columns.
    pub answers: usize,
    /// Those within [`TOLERANCE`] rows of the truth.
    pub correct: usize,
    /// Wrong ones that see the obstacle nearer than it is: lower in the picture.
    pub too_near: usize,
    /// Wrong ones that see it farther.
    pub too_far: usize,
    /// Wrong ones that are no finite number.
    pub not_finite: usize,
    /// Answers that are right if each is replaced by the median of this and the last two frames.
    pub median_correct: usize,
    /// How long the wrong ones last; a run is a sequence. In JSON beside the others.
    #[serde(flatten)]
    pub lasting: Lasting,
}

impl Accuracy {
    /// Both together.
    pub fn and(self, other: Accuracy) -> Accuracy {
        Accuracy {
            answers: self.answers + other.answers,
            correct: self.correct + other.correct,
            too_near: self.too_near + other.too_near,
            too_far: self.too_far + other.too_far,
            not_finite: self.not_finite + other.not_finite,
            median_correct: self.median_correct + other.median_correct,
            lasting: self.lasting.and(other.lasting),
        }
    }

    /// The share of right answers, if there were any.
    pub fn share(&self) -> Option<f64> {
        (self.answers > 0).then(|| self.correct as f64 / self.answers as f64)
    }

    /// The share of right answers with a median over three frames, if there were any.
    pub fn median_share(&self) -> Option<f64> {
        (self.answers > 0).then(|| self.median_correct as f64 / self.answers as f64)
    }
}

/// A column on the way.
#[derive(Debug, Clone)]
struct Column {
    /// For how many frames it has been wrong.
    wrong: usize,
    /// The last answer and the one before; NaN at first.
    before: [f32; 2],
}

/// Counts them, frame by frame.
#[derive(Debug, Clone, Default)]
pub(super) struct Counter {
    sum: Accuracy,
    columns: Vec<Column>,
}

impl Counter {
    /// The next frame: the answers of its columns, and the true rows.
    pub(super) fn frame(&mut self, rows: &Rows, truth: &[u32]) {
        self.columns.resize(rows.columns.len(), Column { wrong: 0, before: [f32::NAN; 2] });
        for ((&label, &answer), column) in truth.iter().zip(&rows.answers).zip(&mut self.columns) {
            let label = f64::from(label);
            let correct = |row: f32| row.is_finite() && (f64::from(row) - label).abs() <= TOLERANCE;
            let [previous, one_before] = column.before;
            column.before = [answer, previous];
            let sum = &mut self.sum;
            sum.answers += 1;
            let median = median_of_three(&mut Scalar, answer, previous, one_before);
            sum.median_correct += usize::from(correct(median));
            if correct(answer) {
                sum.correct += 1;
                sum.lasting.episode(std::mem::take(&mut column.wrong), false);
                continue;
            }
            column.wrong += 1;
            let kind = match answer {
                row if !row.is_finite() => &mut sum.not_finite,
                row if f64::from(row) > label => &mut sum.too_near,
                _ => &mut sum.too_far,
            };
            *kind += 1;
        }
    }

    /// The run is over.
    pub(super) fn finish(mut self) -> Accuracy {
        self.columns.iter().for_each(|column| self.sum.lasting.episode(column.wrong, true));
        self.sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dataset::{Case, Dataset, NamedImage, Transience};

    const TRUTH: [u32; 2] = [100, 200];

    fn counted(answers: &[[f32; 2]]) -> Accuracy {
        let mut counter = Counter::default();
        for answers in answers {
            let rows = Rows { columns: vec![1, 2], believed: vec![0.0; 2], answers: answers.to_vec() };
            counter.frame(&rows, &TRUTH);
        }
        counter.finish()
    }

    const ANSWERS: [[f32; 2]; 8] = [
        [110.0, 200.0],
        [110.5, f32::NAN],
        [89.0, f32::INFINITY],
        [90.0, f32::NAN],
        [100.0, 211.0],
        [100.0, 200.0],
        [0.0, 200.0],
        [100.0, 0.0],
    ];

    #[test]
    fn errors_and_how_long_they_last() {
        let sum = counted(&ANSWERS);
        let lasting = Lasting { errors: 8, episodes: 4, single: 1, undecided: 1, longest: 4 };
        assert_eq!((sum.answers, sum.correct, sum.lasting), (16, 8, lasting));
        assert_eq!((sum.too_near, sum.too_far, sum.not_finite), (2, 3, 3));
        assert_eq!((sum.share(), Accuracy::default().share()), (Some(0.5), None));
        assert_eq!((sum.and(sum).lasting.errors, sum.and(sum).lasting.longest), (16, 4));
    }

    #[test]
    fn they_are_those_of_labelled_images() {
        let pixels = || image::GrayImage::new(256, 240);
        let images = (0..8).map(|i| NamedImage { name: format!("a_{i}.png"), pixels: pixels() });
        let case = |image| [1, 2].map(|x| Case { image, x, y: TRUTH[x as usize - 1] });
        let set = Dataset::new("drive", images.collect(), (0..8).flat_map(case).collect()).expect("sound");
        let found = Transience::of(&set, ANSWERS.as_flattened(), TOLERANCE).expect("a sequence");
        let sum = counted(&ANSWERS);
        let Lasting { errors, episodes, single, undecided, longest } = sum.lasting;
        assert_eq!((errors, episodes), (found.errors, found.episodes));
        assert_eq!((single, undecided), (found.single, found.undecided));
        assert_eq!(Some(longest), found.longest.map(|longest| longest.frames));
        assert_eq!(sum.median_correct, found.median_correct);
    }
}
