//! From a frame to answers: the detector, the median of the last frames, the camera.

use std::time::{Duration, Instant};

use vsonar::camera::ground::{Ground, Range, median_of_three};
use vsonar::detector::{DetectError, Detector, ProgramDetector};
use vsonar::frames::Frame;
use vsonar::ir::machine::Scalar;

/// The answers to a frame, column by column.
#[derive(Debug, Default)]
pub(crate) struct Answers {
    pub(crate) columns: Vec<u32>,
    /// The rows to believe: the detector's own, or their medians.
    pub(crate) rows: Vec<f32>,
    /// What the camera makes of them, if there is one.
    pub(crate) ranges: Vec<Range>,
}

/// From a frame to answers.
pub(crate) struct Worker {
    detector: ProgramDetector,
    ground: Option<Ground>,
    /// With a median the last answer of each column and the one before; NaN at first.
    before: Option<Vec<[f32; 2]>>,
    pub(crate) answers: Answers,
}

impl Worker {
    pub(crate) fn new(
        detector: ProgramDetector,
        columns: Vec<u32>,
        median: bool,
        ground: Option<Ground>,
    ) -> Worker {
        let before = median.then(|| vec![[f32::NAN; 2]; columns.len()]);
        let rows = vec![0.0; columns.len()];
        Worker { detector, ground, before, answers: Answers { columns, rows, ranges: Vec::new() } }
    }

    /// Answers, and says how long the detector alone took.
    pub(crate) fn answer(&mut self, frame: &Frame) -> Result<Duration, DetectError> {
        let Answers { columns, rows, ranges } = &mut self.answers;
        let start = Instant::now();
        self.detector.detect(&frame.pixels, columns, rows)?;
        let detection = start.elapsed();
        if let Some(before) = &mut self.before {
            for (row, [previous, one_before]) in rows.iter_mut().zip(before) {
                let answer = *row;
                *row = median_of_three(&mut Scalar, answer, *previous, *one_before);
                (*one_before, *previous) = (*previous, answer);
            }
        }
        if let Some(ground) = &self.ground {
            ranges.clear();
            ranges.extend(columns.iter().zip(&*rows).map(|(&column, &row)| ground.locate(column, row)));
        }
        Ok(detection)
    }
}
