//! Synthetic offices: what `vsonar` evolves on when no pictures are at hand.
//!
//! [`Corridor`] renders a robot's drive through a made-up corridor by casting a ray for every pixel into a model of
//! floor, walls, doors and things that stand around, lit by ceiling panels of which some are burned out. Labels
//! come from the geometry and are exact: the first pixel from below whose centre's ray meets something other
//! than the floor. The result is an ordinary [`Dataset`], and a pure function of settings and seed: integer
//! hashes for noise, `libm` and IEEE basic arithmetic for the rest, no matter how many threads.
//!
//! [`office`] has whole buildings with people in them, in which robots drive: the worlds that `vsonar evolve` takes by
//! name.
//!
//! The parts: [`geometry`] (what rays meet), [`building`] (which of it stands where), [`light`], [`texture`],
//! [`camera`], [`render`] (from ray to gray value), [`noise`].
//!
//! ```
//! use vsonar::world::Corridor;
//! let small = Corridor { width: 64, height: 48, columns: 4, ..Corridor::default() };
//! let set = small.render(1, 3)?;
//! assert_eq!((set.images().len(), set.cases().len()), (3, 12));
//! assert_eq!(set.images()[2].name, "corridor_0002.png");
//! assert_eq!(set.fingerprint(), small.render(1, 3)?.fingerprint());
//! # Ok::<(), vsonar::world::SetupError>(())
//! ```

use rayon::prelude::*;

use crate::camera::{Camera, CameraError};
use crate::dataset::{Case, Dataset, NamedImage};
use camera::Lens;
pub use progress::Progress;
use render::Scene;
pub use setup_error::SetupError;
use setup_error::{check_frames, check_settings, check_size, labelled};

pub mod building;
pub mod camera;
pub mod geometry;
pub mod light;
pub mod noise;
pub mod office;
mod outline;
mod path;
mod progress;
pub mod render;
mod setup_error;
pub mod texture;

/// Frames of the default set.
pub const FRAMES: usize = 60;

/// Settings of the camera. The building follows from the seed.
#[derive(Debug, Clone, PartialEq)]
pub struct Corridor {
    /// Width of the pictures in pixels, at least 16.
    pub width: u32,
    /// Height of the pictures in pixels, at least 16.
    pub height: u32,
    /// Labelled columns in each picture, spread evenly: column i is at `(2 i + 1) width / (2 columns)`, rounded
    /// (halves down, so that all are different).
    pub columns: u32,
    /// Horizontal field of view in radians, between 0 and pi. Pixels are square.
    pub field_of_view: f64,
    /// The lens's radial distortion (see [`crate::camera`]).
    pub distortion: f64,
    /// Angle of the camera below the horizontal, in radians.
    pub pitch: f64,
    /// Height of the camera above the floor, in metres.
    pub camera_height: f64,
    /// Factor from light to the square of the relative gray value.
    pub exposure: f64,
    /// Share of a pixel's light that the lens gives to its neighbours, 0 to 1.
    pub softness: f64,
    /// Standard deviation of the sensor's noise, in gray values.
    pub noise: f64,
    /// Strength of interlace lines and moire, in gray values.
    pub interlace: f64,
    /// Whether the digitizer turns every gray value below 32 into 16, as that of the original robot did.
    pub digitizer: bool,
}

/// Like the original robot: 320 x 240 pixels, six columns, 90 degrees of view, pitched 51 degrees down.
impl Default for Corridor {
    fn default() -> Corridor {
        Corridor {
            width: 320,
            height: 240,
            columns: 6,
            field_of_view: 90f64.to_radians(),
            distortion: 0.0,
            pitch: 51f64.to_radians(),
            camera_height: 0.8,
            exposure: 1.7,
            softness: 0.6,
            noise: 2.0,
            interlace: 0.8,
            digitizer: true,
        }
    }
}

/// The largest side of a picture, in pixels.
const LARGEST: u32 = 4096;

/// Least and greatest height in metres, pitch and field of view in degrees of a camera that pictures are rendered by:
/// what the limits of the settings, which are radians, come to.
const CAMERAS: [(f64, f64); 3] = [(0.05, 2.0), (0.0, 85.9), (5.8, 171.8)];

impl Corridor {
    /// The same building seen by a calibrated camera.
    #[must_use]
    pub fn seen_by(self, camera: &Camera) -> Corridor {
        Corridor {
            field_of_view: camera.field_of_view.to_radians(),
            distortion: camera.distortion,
            pitch: camera.pitch.to_radians(),
            camera_height: camera.height,
            ..self
        }
    }

    /// Whether pictures of this size can be rendered as a camera sees.
    ///
    /// # Errors
    /// The first of the camera's numbers that is impossible, or that no pictures are rendered by.
    pub fn check_camera(&self, camera: &Camera) -> Result<(), CameraError> {
        camera.check_within(CAMERAS)?;
        camera.check(self.width, self.height)
    }

    /// Drives through the building of this seed and takes so many pictures, named `corridor_0000.png` onward.
    /// Another seed is another building, so a set to hold out.
    ///
    /// # Errors
    /// If a setting is out of its range.
    pub fn render(&self, seed: u64, frames: usize) -> Result<Dataset, SetupError> {
        self.render_told(seed, frames, &Progress::default())
    }

    /// The same; meanwhile one can see how far it is, a step for each picture.
    ///
    /// # Errors
    /// As [`Corridor::render`].
    pub fn render_told(&self, seed: u64, frames: usize, progress: &Progress) -> Result<Dataset, SetupError> {
        self.check(frames)?;
        progress.expect(frames);
        let scene = Scene::new(self, seed);
        let poses = scene.poses(frames);
        let frame = |(i, pose)| {
            let labels: Vec<u32> = self.labelled().map(|x| scene.label(pose, x)).collect();
            let name = format!("corridor_{i:04}.png");
            let pixels = scene.picture(pose, i as u64);
            progress.step();
            (NamedImage { name, pixels }, labels)
        };
        let rendered: Vec<(NamedImage, Vec<u32>)> = poses.par_iter().enumerate().map(frame).collect();
        let (mut images, mut cases) = (Vec::new(), Vec::new());
        for (image, (picture, labels)) in rendered.into_iter().enumerate() {
            images.push(picture);
            cases.extend(self.labelled().zip(labels).map(|(x, y)| Case { image, x, y }));
        }
        Ok(Dataset::new("corridor", images, cases).expect("checked settings give a sound set"))
    }

    /// The labelled columns.
    pub fn labelled(&self) -> impl Iterator<Item = u32> + use<> {
        labelled(self.width, self.columns)
    }

    fn lens(&self) -> Lens {
        let Corridor { width, height, field_of_view, distortion, .. } = *self;
        Lens { width, height, field_of_view, distortion }
    }

    fn check(&self, frames: usize) -> Result<(), SetupError> {
        check_size(self.width, self.height, LARGEST, self.columns)?;
        check_frames(frames)?;
        let most = Camera::distortion_limit(self.width, self.height);
        check_settings([
            ("distortion", self.distortion, -most, most),
            ("field_of_view", self.field_of_view, 0.1, 3.0),
            ("pitch", self.pitch, 0.0, 1.5),
            ("camera_height", self.camera_height, 0.05, 2.0),
            ("exposure", self.exposure, 0.0, 1000.0),
            ("softness", self.softness, 0.0, 1.0),
            ("noise", self.noise, 0.0, 255.0),
            ("interlace", self.interlace, 0.0, 255.0),
        ])
    }
}

/// The set to evolve on when nothing else is given: 60 pictures of 320 x 240 pixels, six columns in each.
pub fn default_dataset(seed: u64) -> Dataset {
    Corridor::default().render(seed, FRAMES).expect("the default settings are in range")
}
