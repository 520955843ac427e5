//! Where ranges come from: a camera with a detector, or with the true rows in its place.

use image::GrayImage;

use super::wander::{Reading, View};
use crate::camera::ground::{Ground, median_of_three};
use crate::detector::{DetectError, Motion, SequenceDetector};
use crate::ir::machine::Scalar;
use crate::world::office::{CAMERA_AHEAD, Moment, Office, Place};

/// The robot and its surroundings at the time of a frame.
#[derive(Debug, Clone, Copy)]
pub struct Sight<'a> {
    /// The office.
    pub moment: &'a Moment<'a>,
    /// Where the robot is.
    pub place: &'a Place,
    /// What its camera sees; none if nobody asked for pictures.
    pub picture: Option<&'a GrayImage>,
    /// How it has moved since the frame before; none in the first one.
    pub motion: Option<Motion>,
}

/// What a camera's columns say.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Rows {
    /// The columns.
    pub columns: Vec<u32>,
    /// The row that is believed in each of them.
    pub believed: Vec<f32>,
    /// What the detector itself answered, before any median.
    pub answers: Vec<f32>,
}

/// A sensor of the robot.
pub trait RangeSource: Send {
    /// How far the sensor stands before the centre of the body, in metres.
    fn ahead(&self) -> f64;

    /// Whether it needs pictures.
    fn sees(&self) -> bool;

    /// The floor that it sees.
    fn view(&self) -> View;

    /// Another run begins, of this number.
    fn restart(&mut self, run: u64);

    /// What it says now, in place of what is in `readings`.
    ///
    /// # Errors
    /// If a detector does not take the picture.
    fn readings(&mut self, sight: &Sight<'_>, readings: &mut Vec<Reading>) -> Result<(), DetectError>;

    /// The rows that the last readings come from, for a camera.
    fn rows(&self) -> Option<&Rows>;
}

/// Finds the rows of a frame.
trait Eye: Send {
    fn needs_picture(&self) -> bool;
    fn restart(&mut self);
    fn look(&mut self, sight: &Sight<'_>, columns: &[u32], rows: &mut [f32]) -> Result<(), DetectError>;
}

/// A camera whose rows become distances by its geometry.
pub struct Camera {
    eye: Box<dyn Eye>,
    ground: Ground,
    view: View,
    rows: Rows,
    /// With a median the last answer of each column and the one before; NaN at first.
    before: Option<Vec<[f32; 2]>>,
}

impl Camera {
    fn new(eye: Box<dyn Eye>, office: &Office, columns: Vec<u32>, median: bool) -> Camera {
        let (width, height) = office.size();
        let nothing = vec![f32::NAN; columns.len()];
        Camera {
            eye,
            ground: Ground::new(&office.camera(), width, height),
            view: View::Picture { camera: office.camera(), size: (width, height) },
            before: median.then(|| vec![[f32::NAN; 2]; columns.len()]),
            rows: Rows { columns, believed: nothing.clone(), answers: nothing },
        }
    }

    /// The camera of this office with a detector behind it, asked about these columns; with `median`, the median of a
    /// column's last three answers is believed.
    pub fn with(
        detector: Box<dyn SequenceDetector + Send>,
        office: &Office,
        columns: Vec<u32>,
        median: bool,
    ) -> Camera {
        Camera::new(Box::new(Detecting(detector)), office, columns, median)
    }

    /// The same with the true rows, by the geometry of the office: what a detector without error would do, and so an
    /// upper bound for all that look at these columns.
    pub fn with_truth(office: &Office, columns: Vec<u32>) -> Camera {
        Camera::new(Box::new(Truth), office, columns, false)
    }
}

struct Detecting(Box<dyn SequenceDetector + Send>);

impl Eye for Detecting {
    fn needs_picture(&self) -> bool {
        true
    }

    fn restart(&mut self) {
        self.0.restart();
    }

    fn look(&mut self, sight: &Sight<'_>, columns: &[u32], rows: &mut [f32]) -> Result<(), DetectError> {
        match sight.picture {
            Some(picture) => self.0.next(picture, sight.motion, columns, rows),
            None => {
                rows.fill(f32::NAN);
                Ok(())
            }
        }
    }
}

struct Truth;

impl Eye for Truth {
    fn needs_picture(&self) -> bool {
        false
    }

    fn restart(&mut self) {}

    fn look(&mut self, sight: &Sight<'_>, columns: &[u32], rows: &mut [f32]) -> Result<(), DetectError> {
        let labels = sight.moment.labels(sight.place, columns.iter().copied());
        rows.iter_mut().zip(labels).for_each(|(row, label)| *row = label as f32);
        Ok(())
    }
}

impl RangeSource for Camera {
    fn ahead(&self) -> f64 {
        CAMERA_AHEAD
    }

    fn sees(&self) -> bool {
        self.eye.needs_picture()
    }

    fn view(&self) -> View {
        self.view
    }

    fn restart(&mut self, _: u64) {
        self.eye.restart();
        if let Some(before) = &mut self.before {
            before.fill([f32::NAN; 2]);
        }
    }

    fn readings(&mut self, sight: &Sight<'_>, readings: &mut Vec<Reading>) -> Result<(), DetectError> {
        let Rows { columns, believed, answers } = &mut self.rows;
        self.eye.look(sight, columns, answers)?;
        believed.copy_from_slice(answers);
        if let Some(before) = &mut self.before {
            for ((row, &answer), [previous, one_before]) in believed.iter_mut().zip(&*answers).zip(before) {
                *row = median_of_three(&mut Scalar, answer, *previous, *one_before);
                (*one_before, *previous) = (*previous, answer);
            }
        }
        readings.clear();
        let ground = &self.ground;
        readings.extend(
            columns.iter().zip(&*believed).map(|(&column, &row)| Reading::from(ground.locate(column, row))),
        );
        Ok(())
    }

    fn rows(&self) -> Option<&Rows> {
        Some(&self.rows)
    }
}
