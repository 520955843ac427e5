//! The camera on the robot: from a row of an image to a place on the floor.
//!
//! The floor is flat. The camera looks ahead, pitched down, without roll; pixels are square, the optical axis meets
//! the middle of the image, and one radial term bends it (the division model, A. W. Fitzgibbon, *Simultaneous linear
//! estimation of multiple view geometry and lens distortion*, 2001). With half the image's width as the unit of
//! length, a pixel at the distance r from the middle is seen along a ray of slope
//!
//! ```text
//! t (1 + k) r / (1 + k r²),      t = tan(field_of_view / 2),      k = distortion
//! ```
//!
//! away from the axis, so that the field of view holds whatever the distortion is.
//!
//! ```text
//! from the side                                       from above
//!
//!      lens                                           \                 |                 /
//!    __[]>- - - - - - - - -  horizontal                \     x=========x=========x  yardstick
//!     ^ |\ `.  ) pitch                                  \               |               /
//!     | | \   `.                                         \   x=========x=========x     /
//!  height  \    `. optical axis                           \  |         |             /
//!     | |   \      `.            +---+                     \ |<- left ->|            /
//!     v |    \        `.         |   | obstacle             \           |           /  ^
//!  -----+-----\---x-----`.-------+---+---- floor             \---------|----------/   | ahead
//!       |<-ahead->| yardstick    its lowest pixel                        + under the lens v
//! ```
//!
//! The same as a picture: `examples/camera.svg`. What flows here:
//!
//! ```text
//! points.csv --points--> calibrate --> Camera <--file--> camera.toml
//!                                        |
//! row of a detector -------------> ground::Ground --> ground::Range --> scan::LaserScan
//! ```
//!
//! A protractor and a yardstick suffice: measure height and pitch, put the yardstick on the floor across the view, and
//! [`calibrate`] finds the rest; with more points it finds all four numbers. The formula of [`ground`] is the one that
//! every exported detector has inside.
//!
//! What the flat floor costs: what stands off the floor by e is seen at h / (h - e) of its distance (h being the
//! height of the lens), so that the overhanging edge of a table seems farther than it is; and a pitch that is off by
//! an angle a, because the robot nods or the floor slopes, shifts a distance d by about a (d² + h²) / h.

pub mod calibrate;
mod calibration;
mod file;
mod fit;
pub mod ground;
pub mod points;
pub mod scan;

pub use file::CameraFileError;

/// A camera and how it is mounted.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Camera {
    /// Height of the lens above the floor, in metres.
    pub height: f64,
    /// Angle of the optical axis below the horizontal, in degrees.
    pub pitch: f64,
    /// Horizontal field of view, from the left edge to the right edge of the image, in degrees.
    pub field_of_view: f64,
    /// The radial distortion k, without unit: negative for a barrel, positive for a pincushion, 0 for none.
    pub distortion: f64,
}

/// A camera that cannot be, or of no use.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum CameraError {
    /// A number outside its range.
    #[error("the camera's `{field}` is {value}, but must be {min} to {max} {unit}")]
    Number {
        /// Name of the number.
        field: &'static str,
        /// Its value.
        value: f64,
        /// The least it may be.
        min: f64,
        /// The most it may be.
        max: f64,
        /// What it counts.
        unit: &'static str,
    },
    /// A distortion for which the image folds onto itself before its corners.
    #[error(
        "the camera's `distortion` is {value}, but must be -{most} to {most} for images of {width} x {height} pixels: beyond, \
         rays of different pixels would cross",
        most = (limit * 1e4).floor() / 1e4
    )]
    Distortion {
        /// Its value.
        value: f64,
        /// The most its magnitude may be.
        limit: f64,
        /// Width of the images.
        width: u32,
        /// Height of the images.
        height: u32,
    },
    /// The whole image is above the horizon.
    #[error(
        "the camera's `pitch` is {pitch} degrees: even the lowest row of the image is above the horizon, and no floor \
         is in view; a pitch below the horizontal is positive"
    )]
    NoFloor {
        /// The pitch, in degrees.
        pitch: f64,
    },
}

/// Name, least and greatest value and unit of each number of a camera.
const LIMITS: [(&str, f64, f64, &str); 4] = [
    ("height", 0.001, 1000.0, "metres"),
    ("pitch", -90.0, 90.0, "degrees"),
    ("field_of_view", 1.0, 179.0, "degrees"),
    ("distortion", -0.9, 0.9, "(no unit)"),
];

/// How near the distortion may come to where rays of different pixels cross.
const DISTORTION_MARGIN: f64 = 0.9;

impl Camera {
    /// Whether each number by itself is possible: height 0.001 to 1000 m, pitch -90 to 90 degrees, field of view 1 to
    /// 179 degrees, distortion -0.9 to 0.9.
    ///
    /// # Errors
    /// The first that is not.
    pub fn check_numbers(&self) -> Result<(), CameraError> {
        let values = [self.height, self.pitch, self.field_of_view, self.distortion];
        for (value, (field, min, max, unit)) in values.into_iter().zip(LIMITS) {
            if !(min..=max).contains(&value) {
                return Err(CameraError::Number { field, value, min, max, unit });
            }
        }
        Ok(())
    }

    /// Whether height, pitch and field of view are within narrower limits, least and greatest.
    ///
    /// # Errors
    /// The first that is not.
    pub(crate) fn check_within(&self, limits: [(f64, f64); 3]) -> Result<(), CameraError> {
        let values = [self.height, self.pitch, self.field_of_view];
        for ((value, (min, max)), (field, _, _, unit)) in values.into_iter().zip(limits).zip(LIMITS) {
            if !(min..=max).contains(&value) {
                return Err(CameraError::Number { field, value, min, max, unit });
            }
        }
        Ok(())
    }

    /// Whether this can be the camera that takes images of `width` x `height` pixels: [`Camera::check_numbers`], rays
    /// that do not cross from the middle to a row beyond each corner, and floor in view.
    ///
    /// # Errors
    /// The first of these that does not hold.
    pub fn check(&self, width: u32, height: u32) -> Result<(), CameraError> {
        self.check_numbers()?;
        let limit = Camera::distortion_limit(width, height);
        if self.distortion.abs() > limit {
            return Err(CameraError::Distortion { value: self.distortion, limit, width, height });
        }
        let (width, height) = (f64::from(width), f64::from(height));
        let [_, down, _] = self.ray((width, height), (width / 2.0, height - 0.5));
        if down <= 0.0 {
            return Err(CameraError::NoFloor { pitch: self.pitch });
        }
        Ok(())
    }

    /// The greatest magnitude of the distortion for images of this size.
    ///
    /// The slope r / (1 + k r²) has a pole where k r² = -1 and turns where k r² = 1; both have to stay outside the
    /// image, and outside the row below it, which [`ground`] looks at.
    pub fn distortion_limit(width: u32, height: u32) -> f64 {
        let corner = (f64::from(height) + 2.0) / f64::from(width);
        DISTORTION_MARGIN / (1.0 + corner * corner)
    }

    /// The tangent of half the field of view.
    fn tangent(&self) -> f64 {
        libm::tan(self.field_of_view.to_radians() / 2.0)
    }

    /// The place on the floor that is seen at an image point: metres ahead of the point under the lens, and to the
    /// left. Columns and rows may be fractional, whole numbers being the centres of pixels; `size` is in pixels. `None`
    /// at and above the horizon.
    pub fn floor(&self, size: (u32, u32), column: f64, row: f64) -> Option<(f64, f64)> {
        let size = (f64::from(size.0), f64::from(size.1));
        let [forward, down, left] = self.ray(size, (column + 0.5, row + 0.5));
        let reach = self.height / down;
        (down > 0.0 && reach.is_finite()).then_some((forward * reach, left * reach))
    }

    /// The image point, column and row, where a place on the floor is seen: the reverse of [`Camera::floor`]. It may be
    /// outside the image. `None` where the place is not in front of the camera.
    pub fn project(&self, size: (u32, u32), ahead: f64, left: f64) -> Option<(f64, f64)> {
        let [depth, below] = self.in_lens(ahead);
        if depth <= 0.0 {
            return None;
        }
        let (x, y) = (-left / depth, below / depth);
        let k = self.distortion;
        let slope = self.tangent() * (1.0 + k);
        // k s r² - slope r + s = 0, of which the root that is s / slope without distortion.
        let discriminant = slope * slope - 4.0 * k * (x * x + y * y);
        if discriminant < 0.0 {
            return None;
        }
        let scale = 2.0 / (slope + discriminant.sqrt());
        Some(pixel(size, x * scale, y * scale))
    }

    /// The row in which `column` sees what is so many metres ahead, however far to the side. `None` where there is
    /// none.
    pub fn row_of(&self, size: (u32, u32), column: f64, ahead: f64) -> Option<f64> {
        let [depth, below] = self.in_lens(ahead);
        if depth <= 0.0 {
            return None;
        }
        let y = below / depth;
        let half = f64::from(size.0) / 2.0;
        let x = (column + 0.5) / half - 1.0;
        let k = self.distortion;
        let slope = self.tangent() * (1.0 + k);
        let stretch = 1.0 + k * x * x;
        let discriminant = slope * slope - 4.0 * y * y * k * stretch;
        if discriminant < 0.0 {
            return None;
        }
        let v = 2.0 * y * stretch / (slope + discriminant.sqrt());
        Some(pixel(size, x, v).1)
    }

    /// What is so far ahead on the floor, as seen from the lens: metres along the optical axis, and below it.
    fn in_lens(&self, ahead: f64) -> [f64; 2] {
        let (sin, cos) = libm::sincos(self.pitch.to_radians());
        [ahead * cos + self.height * sin, self.height * cos - ahead * sin]
    }

    /// Forward, down and left of the ray through an image point, in binary64. The size and the point (from the left
    /// and the top edge) are in pixels.
    fn ray(&self, (width, height): (f64, f64), (column, row): (f64, f64)) -> [f64; 3] {
        let (x, y) = ((2.0 * column - width) / width, (2.0 * row - height) / width);
        let k = self.distortion;
        let scale = self.tangent() * (1.0 + k) / (1.0 + k * (x * x + y * y));
        let (sin, cos) = libm::sincos(self.pitch.to_radians());
        [cos - y * scale * sin, sin + y * scale * cos, -x * scale]
    }
}

/// The pixel at a place counted from the middle in halves of the image's width.
fn pixel((width, height): (u32, u32), x: f64, y: f64) -> (f64, f64) {
    let half = f64::from(width) / 2.0;
    (half * (x + 1.0) - 0.5, half * y + f64::from(height) / 2.0 - 0.5)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_limit_as_it_is_printed_may_be_typed() {
        for (width, height) in [(320, 240), (640, 480), (100, 700), (16, 16)] {
            let camera = |distortion| Camera { height: 0.8, pitch: 51.0, field_of_view: 90.0, distortion };
            let error = camera(0.9).check(width, height).expect_err("beyond").to_string();
            let printed = error.split(" to ").nth(1).and_then(|rest| rest.split(' ').next());
            let limit: f64 = printed.and_then(|text| text.parse().ok()).expect("a number");
            camera(limit).check(width, height).expect("as printed");
            camera(limit + 1e-4).check(width, height).expect_err("more than printed");
        }
    }

    #[test]
    fn floor_and_image_are_each_others_reverse() {
        for (pitch, distortion) in [(0.0, 0.0), (51.0, -0.3), (51.0, 0.4), (88.0, 0.1), (20.0, -0.5)] {
            let camera = Camera { height: 0.8, pitch, field_of_view: 100.0, distortion };
            let size = (320, 240);
            camera.check(size.0, size.1).expect("possible");
            for (column, row) in
                [(0.0, 130.0), (160.0, 121.5), (319.0, 239.0), (12.25, 200.0), (159.5, 239.0)]
            {
                let (ahead, left) = camera.floor(size, column, row).expect("floor");
                let (back, down) = camera.project(size, ahead, left).expect("in front");
                assert!(
                    (back - column).abs() < 1e-9 && (down - row).abs() < 1e-9,
                    "{camera:?} {column} {row}"
                );
                let again = camera.row_of(size, column, ahead).expect("in front");
                assert!((again - row).abs() < 1e-9, "{camera:?} {column} {row} {again}");
            }
            assert_eq!(camera.project(size, -5.0, 0.0), None, "behind");
            assert!(camera.row_of(size, 3.0, -5.0).is_none(), "behind");
        }
        let level = Camera { height: 0.8, pitch: 0.0, field_of_view: 90.0, distortion: 0.0 };
        assert_eq!(level.floor((320, 240), 10.0, 119.0), None, "above the horizon");
    }
}
