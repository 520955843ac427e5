//! The camera and the frame grabber, as settings.

use crate::camera::{Camera, CameraError};
use crate::world::camera::Lens;
use crate::world::noise::Stream;
use crate::world::setup_error::{SetupError, check_settings, check_size, labelled};

/// The largest side of a picture, in pixels.
const LARGEST: u32 = 2048;

/// Least and greatest height in metres, pitch and field of view in degrees of a camera that pictures are rendered by.
const CAMERAS: [(f64, f64); 3] = [(0.05, 1.8), (0.0, 85.0), (6.0, 170.0)];

/// Settings of the camera and of the frame grabber behind it. The default is that of the original robot.
#[derive(Debug, Clone, PartialEq)]
pub struct Setup {
    /// Width of the pictures in pixels, at least 16.
    pub width: u32,
    /// Height of the pictures in pixels, at least 16.
    pub height: u32,
    /// Labelled columns in each recorded picture, spread evenly: column i is at `(2 i + 1) width / (2 columns)`,
    /// rounded (halves down, so that all are different).
    pub columns: u32,
    /// Height, pitch, field of view and distortion of the camera.
    pub camera: Camera,
    /// Factor from light to the square of the relative gray value, before the automatic exposure.
    pub exposure: f64,
    /// Mean gray value that the automatic exposure strives for.
    pub target: f64,
    /// How much the automatic exposure can change the exposure at most, up or down: 1 for not at all.
    pub range: f64,
    /// Seconds in which it covers 63 % of the way to its aim.
    pub delay: f64,
    /// Share of a pixel's light that the lens gives to its neighbours, 0 to 1.
    pub softness: f64,
    /// Standard deviation of the sensor's noise, in gray values.
    pub noise: f64,
    /// Strength of interlace lines and moire, in gray values.
    pub interlace: f64,
    /// Whether the digitizer turns every gray value below 32 into 16.
    pub digitizer: bool,
}

/// 320 x 240 pixels, six columns; 0.8 m high, pitched 51 degrees down, 90 degrees of view.
impl Default for Setup {
    fn default() -> Setup {
        Setup {
            width: 320,
            height: 240,
            columns: 6,
            camera: Camera { height: 0.8, pitch: 51.0, field_of_view: 90.0, distortion: -0.04 },
            exposure: 1.95,
            target: 134.0,
            range: 1.5,
            delay: 0.8,
            softness: 0.6,
            noise: 2.2,
            interlace: 1.2,
            digitizer: true,
        }
    }
}

impl Setup {
    /// Another set-up of the same robot, by seed: pitch by up to 4 degrees, exposure by up to 30 % and height by
    /// up to 4 cm off, for held-out tests.
    #[must_use]
    pub fn varied(&self, seed: u64) -> Setup {
        let stream = &mut Stream::new(seed, 31);
        // half of the range at least, so that it is another set-up indeed
        let mut off = |most: f64| {
            let by = stream.range(0.5 * most, most);
            if stream.chance(0.5) { by } else { -by }
        };
        let camera = Camera {
            pitch: self.camera.pitch + off(4.0),
            height: self.camera.height + off(0.04),
            ..self.camera
        };
        let light = 1.0 + off(0.3);
        // gray values go with the root of the light
        Setup { camera, exposure: self.exposure * light, target: self.target * light.sqrt(), ..self.clone() }
    }

    /// The same grabber behind another camera.
    #[must_use]
    pub fn seen_by(self, camera: &Camera) -> Setup {
        Setup { camera: *camera, ..self }
    }

    /// Whether pictures of this size can be rendered as a camera sees: that [`Setup::check`] will have nothing against
    /// it.
    ///
    /// # Errors
    /// The first of the camera's numbers that is impossible, or that no pictures are rendered by.
    pub fn check_camera(&self, camera: &Camera) -> Result<(), CameraError> {
        camera.check_within(CAMERAS)?;
        camera.check(self.width, self.height)
    }

    /// The labelled columns.
    pub fn labelled(&self) -> impl Iterator<Item = u32> + use<> {
        labelled(self.width, self.columns)
    }

    pub(super) fn lens(&self) -> Lens {
        self.camera.lens(self.width, self.height)
    }

    /// Whether every setting is in its range.
    ///
    /// # Errors
    /// The first that is not.
    pub fn check(&self) -> Result<(), SetupError> {
        check_size(self.width, self.height, LARGEST, self.columns)?;
        let most = Camera::distortion_limit(self.width, self.height);
        let [height, pitch, view] = CAMERAS;
        check_settings([
            ("camera.distortion", self.camera.distortion, -most, most),
            ("camera.field_of_view", self.camera.field_of_view, view.0, view.1),
            ("camera.pitch", self.camera.pitch, pitch.0, pitch.1),
            ("camera.height", self.camera.height, height.0, height.1),
            ("exposure", self.exposure, 0.0, 1000.0),
            ("target", self.target, 1.0, 255.0),
            ("range", self.range, 1.0, 1000.0),
            ("delay", self.delay, 0.0, 1000.0),
            ("softness", self.softness, 0.0, 1.0),
            ("noise", self.noise, 0.0, 255.0),
            ("interlace", self.interlace, 0.0, 255.0),
        ])
    }
}
