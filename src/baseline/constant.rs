//! The best constant of each column: a detector that never looks.

use image::GrayImage;
use serde::Serialize;

use crate::dataset::{Constants, Dataset};
use crate::detector::{DetectError, Detector, check_arguments};

/// Answers for each column the best constant of the nearest column that was labelled in training.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Constant {
    #[serde(skip)]
    size: (u32, u32),
    #[serde(skip)]
    constants: Constants,
    /// Columns and their answers, in pixels.
    columns: Vec<(u32, f64)>,
}

impl Constant {
    /// The constants of these cases.
    pub fn tune(set: &Dataset, tolerance: f64) -> Constant {
        let constants = Constants::learn(set, tolerance);
        let columns = constants.columns().iter().map(|&(x, c)| (x, c.answer)).collect();
        Constant { size: (set.width(), set.height()), constants, columns }
    }

    pub(super) fn correct(&self) -> usize {
        self.constants.columns().iter().map(|(_, c)| c.correct).sum()
    }

    pub(super) fn describe(&self) -> String {
        let columns = self.columns.iter().map(|(x, row)| format!("{x}: {row}"));
        format!("rows by column {}", columns.collect::<Vec<_>>().join(", "))
    }
}

impl Detector for Constant {
    fn width(&self) -> u32 {
        self.size.0
    }

    fn height(&self) -> u32 {
        self.size.1
    }

    fn detect(&self, image: &GrayImage, columns: &[u32], rows: &mut [f32]) -> Result<(), DetectError> {
        check_arguments(self.size, image, columns, rows)?;
        for (&x, row) in columns.iter().zip(rows) {
            *row = self.constants.answer_near(x) as f32;
        }
        Ok(())
    }
}
