//! A rival that needs a robot: what does not move as the floor should, when the robot moves, is no floor.
//!
//! Each pixel is taken for a point of the floor. From the camera's geometry and the wheels' odometry follows where the
//! same point was in an earlier picture, and what was there should look the same; what stands off the floor looks
//! different, for it was elsewhere. So a pair of pictures taken one after the other does what a pair of cameras does (as in
//! K. Storjohann, Th. Zielke, H. A. Mallot, W. von Seelen, *Visual obstacle detection for automatically guided vehicles*,
//! ICRA 1990). It stands for the stereo and flow systems that detectors from single pictures are meant to replace.
//!
//! Differences are those from the nearest value within half a pixel (S. Birchfield, C. Tomasi, *A pixel dissimilarity
//! measure that is insensitive to image sampling*, 1998), so that fine texture does not count, and without the mean
//! difference of the window, so that the exposure does not.
//!
//! What is left out: no disparity is searched for, so that it says where floor ends and not how high things are; the
//! odometry is taken for exact, which in the simulation it is; nothing that moves by itself is told from what stands. Where
//! the robot has not moved, or looks at what it has not seen before, it believes in floor. A wall without texture looks the
//! same from everywhere: it is seen by the edge of its skirting alone.
//!
//! ```
//! use vsonar::drive::flow::Flow;
//! use vsonar::world::office::World;
//!
//! let (flow, choice) = Flow::tune(World::Fmrb, Some(4), 10.0)?;
//! assert!(choice.correct <= choice.cases && choice.cases == 24);
//! assert!(flow.baseline >= 0.1);
//! # Ok::<(), vsonar::world::office::OfficeError>(())
//! ```

use std::collections::VecDeque;

use image::GrayImage;
use serde::Serialize;

use super::robot::moved;
use crate::baseline::tune::{Tally, first_above, ladder};
use crate::camera::Camera;
use crate::dataset::Dataset;
use crate::detector::{DetectError, Motion, SequenceDetector, check_arguments};
use crate::world::office::{CAMERA_AHEAD, Earlier, OfficeError, Place, World};

/// Distances between the two places of the camera that are tried, in metres.
const BASELINES: [f64; 3] = [0.1, 0.2, 0.3];
/// Widths and heights of the window that are tried, in pixels.
const WINDOWS: [(u32, u32); 5] = [(5, 3), (5, 7), (9, 5), (15, 5), (15, 9)];
/// How many thresholds are tried.
const THRESHOLDS: usize = 48;
/// Frames that are remembered: two seconds.
const KEPT: usize = 20;

fn thresholds() -> [f64; THRESHOLDS] {
    ladder(0.2, 60.0)
}

/// Settings of the detector.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Flow {
    /// Width and height of the images, in pixels.
    #[serde(skip)]
    pub size: (u32, u32),
    /// The camera.
    #[serde(skip)]
    pub camera: Camera,
    /// The least distance between the places of the camera for the two pictures, in metres.
    pub baseline: f64,
    /// Width and height of the window over which differences are averaged, in pixels, both odd.
    pub window: (u32, u32),
    /// What the average has to exceed, in gray levels.
    pub threshold: f64,
}

/// How the settings were chosen.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FlowChoice {
    /// Training cases it gets right.
    pub correct: usize,
    /// Training cases.
    pub cases: usize,
    /// Settings that were tried.
    pub tried: usize,
}

impl Flow {
    /// The best of its grid on a world's training set, or so many pictures of its drive, each with the frames that the camera saw
    /// in the two seconds before: 3 baselines, 5 windows, 48 thresholds from 0.2 to 60. An answer is correct within
    /// `tolerance` rows.
    ///
    /// # Errors
    /// If no pictures are asked for, or more than 10,000.
    pub fn tune(
        world: World,
        pictures: Option<usize>,
        tolerance: f64,
    ) -> Result<(Flow, FlowChoice), OfficeError> {
        let (set, earlier) = world.recorded_with_earlier(None, false, pictures, KEPT)?;
        let camera = world.camera();
        let thresholds = thresholds();
        let settings: Vec<(f64, (u32, u32))> =
            BASELINES.iter().flat_map(|&b| WINDOWS.map(|window| (b, window))).collect();
        let tally = Tally::of(&set, tolerance, settings.len(), THRESHOLDS, |image, cases, tally| {
            let Earlier { place, frames } = &earlier[image];
            let picture = &set.images()[image].pixels;
            for (i, &(baseline, window)) in settings.iter().enumerate() {
                let reference = frames.iter().rev().find(|(then, _)| apart(then, place) >= baseline);
                for case in cases {
                    let rows = match reference {
                        None => [0.0; THRESHOLDS],
                        Some((then, reference)) => {
                            let pair = Pair { camera, now: *place, then: *then, picture, reference };
                            first_above(pair.differences(case.x, window), &thresholds)
                        }
                    };
                    for (j, row) in rows.into_iter().enumerate() {
                        tally.answer(i, j, row, case);
                    }
                }
            }
        });
        let choice = tally.choose();
        let (baseline, window) = settings[choice.setting];
        let (size, threshold) = ((set.width(), set.height()), thresholds[choice.threshold]);
        let flow = Flow { size, camera, baseline, window, threshold };
        Ok((flow, FlowChoice { correct: choice.correct, cases: set.cases().len(), tried: choice.tried }))
    }

    /// The settings in words.
    pub fn describe(&self) -> String {
        let (width, height) = self.window;
        format!(
            "pictures {} m apart, window of {width} x {height}, difference above {} gray levels",
            self.baseline, self.threshold
        )
    }

    /// A recorded set, and its answers to all of its cases, each picture with the frames before it. The building is the
    /// one trained in, or another one by seed.
    ///
    /// # Errors
    /// As [`Flow::tune`].
    pub fn answers(
        &self,
        world: World,
        building: Option<u64>,
        pictures: Option<usize>,
    ) -> Result<(Dataset, Vec<f32>), OfficeError> {
        let (set, earlier) = world.recorded_with_earlier(building, false, pictures, KEPT)?;
        let answer = |case: &crate::dataset::Case| {
            let Earlier { place, frames } = &earlier[case.image];
            self.row(&set.images()[case.image].pixels, place, frames.iter().map(|(p, i)| (p, i)), case.x)
        };
        let answers = set.cases().iter().map(answer).collect();
        Ok((set, answers))
    }

    /// The row in a column, by the latest of the earlier frames that was taken far enough away.
    fn row<'a>(
        &self,
        picture: &GrayImage,
        now: &Place,
        earlier: impl DoubleEndedIterator<Item = (&'a Place, &'a GrayImage)>,
        column: u32,
    ) -> f32 {
        let Some((then, reference)) = earlier.rev().find(|(then, _)| apart(then, now) >= self.baseline)
        else {
            return 0.0;
        };
        let pair = Pair { camera: self.camera, now: *now, then: *then, picture, reference };
        let [row] = first_above(pair.differences(column, self.window), &[self.threshold]);
        row
    }
}

/// Where the lens is over the floor.
fn lens(place: &Place) -> (f64, f64) {
    let (sin, cos) = libm::sincos(place.heading);
    (place.x + cos * CAMERA_AHEAD, place.y + sin * CAMERA_AHEAD)
}

/// How far apart the lens was in two places.
fn apart(a: &Place, b: &Place) -> f64 {
    let ((ax, ay), (bx, by)) = (lens(a), lens(b));
    libm::hypot(ax - bx, ay - by)
}

/// Two pictures and where they were taken.
struct Pair<'a> {
    camera: Camera,
    now: Place,
    then: Place,
    picture: &'a GrayImage,
    reference: &'a GrayImage,
}

/// A pixel now, and what was at its place on the floor then.
#[derive(Clone, Copy)]
struct Match {
    now: f32,
    then: f32,
    /// The least and the greatest value within half a pixel.
    around: (f32, f32),
}

impl Pair<'_> {
    /// Where a pixel's point of the floor was in the earlier picture.
    fn before(&self, column: u32, row: u32) -> Option<(f64, f64)> {
        let size = self.picture.dimensions();
        let (ahead, left) = self.camera.floor(size, column.into(), row.into())?;
        let (sin, cos) = libm::sincos(self.now.heading);
        let (x, y) = lens(&self.now);
        let (x, y) = (x + cos * ahead - sin * left, y + sin * ahead + cos * left);
        let (then_x, then_y) = lens(&self.then);
        let (dx, dy) = (x - then_x, y - then_y);
        let (sin, cos) = libm::sincos(self.then.heading);
        self.camera.project(size, cos * dx + sin * dy, cos * dy - sin * dx)
    }

    fn matched(&self, column: u32, row: u32) -> Option<Match> {
        let (x, y) = self.before(column, row)?;
        let then = sample(self.reference, x, y)?;
        let mut around = (then, then);
        for (dx, dy) in [(-0.5, 0.0), (0.5, 0.0), (0.0, -0.5), (0.0, 0.5)] {
            if let Some(value) = sample(self.reference, x + dx, y + dy) {
                around = (around.0.min(value), around.1.max(value));
            }
        }
        Some(Match { now: f32::from(self.picture.get_pixel(column, row)[0]), then, around })
    }

    /// Going up, the rows and the average difference in the window around each of them; 0 where less than half of the
    /// window was in the earlier picture.
    fn differences(
        &self,
        column: u32,
        (across, down): (u32, u32),
    ) -> impl Iterator<Item = (usize, f64)> + use<> {
        let (width, height) = self.picture.dimensions();
        let (half_x, half_y) = (across / 2, down / 2);
        let columns = column.saturating_sub(half_x)..=(column + half_x).min(width - 1);
        let strip: Vec<Vec<Option<Match>>> = (0..height)
            .map(|row| columns.clone().map(|column| self.matched(column, row)).collect())
            .collect();
        let half = (across * down).div_ceil(2) as usize;
        (half_y..height.saturating_sub(half_y)).rev().map(move |row| {
            let rows = &strip[(row - half_y) as usize..=(row + half_y) as usize];
            let known = || rows.iter().flatten().flatten();
            let count = known().count();
            if count < half {
                return (row as usize, 0.0);
            }
            let offset = known().map(|m| m.now - m.then).sum::<f32>() / count as f32;
            let difference = |m: &Match| {
                let now = m.now - offset;
                (now - m.around.1).max(m.around.0 - now).max(0.0)
            };
            (row as usize, f64::from(known().map(difference).sum::<f32>() / count as f32))
        })
    }
}

/// The gray value between four pixels; none outside the image.
fn sample(image: &GrayImage, x: f64, y: f64) -> Option<f32> {
    let (width, height) = image.dimensions();
    let inside = |at: f64, size: u32| (0.0..=f64::from(size - 1)).contains(&at);
    if !(inside(x, width) && inside(y, height)) {
        return None;
    }
    let (left, top) = (x as u32, y as u32);
    let (right, bottom) = ((left + 1).min(width - 1), (top + 1).min(height - 1));
    let (u, v) = ((x - f64::from(left)) as f32, (y - f64::from(top)) as f32);
    let at = |x, y| f32::from(image.get_pixel(x, y)[0]);
    let upper = at(left, top) * (1.0 - u) + at(right, top) * u;
    let lower = at(left, bottom) * (1.0 - u) + at(right, bottom) * u;
    Some(upper * (1.0 - v) + lower * v)
}

/// The detector with its memory of the last two seconds.
#[derive(Debug, Clone)]
pub struct FlowDetector {
    flow: Flow,
    place: Place,
    frames: VecDeque<(Place, GrayImage)>,
}

impl FlowDetector {
    /// A detector that has seen nothing yet.
    pub fn new(flow: Flow) -> FlowDetector {
        FlowDetector { flow, place: Place { x: 0.0, y: 0.0, heading: 0.0 }, frames: VecDeque::new() }
    }
}

impl SequenceDetector for FlowDetector {
    fn size(&self) -> (u32, u32) {
        self.flow.size
    }

    fn restart(&mut self) {
        *self = FlowDetector::new(self.flow);
    }

    fn next(
        &mut self,
        image: &GrayImage,
        motion: Option<Motion>,
        columns: &[u32],
        rows: &mut [f32],
    ) -> Result<(), DetectError> {
        check_arguments(self.flow.size, image, columns, rows)?;
        match motion {
            Some(motion) => self.place = moved(self.place, motion),
            // Nobody knows how far apart they are.
            None => self.frames.clear(),
        }
        for (&column, row) in columns.iter().zip(rows) {
            *row = self.flow.row(image, &self.place, self.frames.iter().map(|(p, i)| (p, i)), column);
        }
        if self.frames.len() == KEPT {
            self.frames.pop_front();
        }
        self.frames.push_back((self.place, image.clone()));
        Ok(())
    }
}

#[cfg(test)]
#[path = "flow_tests.rs"]
mod tests;
