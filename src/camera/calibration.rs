//! What a calibration gives: the camera, how far to trust it, and why there may be none.

use serde::Serialize;

use super::{Camera, CameraError};

/// Where a number has its value from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Source {
    /// From the points.
    Fitted,
    /// It was known.
    Given,
    /// Taken as 0: fewer than [`DISTORTION_POINTS`](super::calibrate::DISTORTION_POINTS) points, or too few measurements.
    TooFewPoints,
    /// Taken as 0: the points do not span the image.
    TooNarrow,
    /// Taken as 0: what was found is less than twice its standard error.
    NotSignificant,
}

/// One of the camera's numbers.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Number {
    /// Its name in the camera's file.
    pub name: &'static str,
    /// Its value.
    pub value: f64,
    /// Its standard error, if it was fitted and is not at the limit of what it may be.
    pub standard_error: Option<f64>,
    /// Where it comes from.
    pub source: Source,
}

/// How far a point is from where the camera would show it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Residual {
    /// The point's line in the table.
    pub line: usize,
    /// Distance in the image, in pixels; in rows alone where `left` is not known.
    pub pixels: f64,
    /// Distance on the floor between the place given and the one seen at the pixel, in metres; ahead alone where `left`
    /// is not known, and `None` at and above the horizon.
    pub metres: Option<f64>,
}

/// What deserves a second look.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Warning {
    /// A point that does not go with the others.
    Outlier {
        /// Its line in the table.
        line: usize,
        /// How far the others are off without it, in pixels (RMS).
        rms_without: f64,
    },
    /// A number that the points push against the limit of what it may be.
    AtLimit {
        /// Its name.
        number: &'static str,
    },
    /// A number that the points hardly determine.
    Poor {
        /// Its name.
        number: &'static str,
    },
    /// The points are off by much more than one can mistake a pixel.
    Rough,
    /// As many measurements as unknowns: nothing tells a wrong one.
    NoRedundancy,
    /// A point at or above the camera's horizon.
    AboveHorizon {
        /// Its line in the table.
        line: usize,
    },
}

impl std::fmt::Display for Warning {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Warning::Outlier { line, rms_without } => write!(
                f,
                "line {line} does not go with the other points, which without it are off by {rms_without:.2} \
                 pixels; check it"
            ),
            Warning::AtLimit { number: number @ "distortion" } => write!(
                f,
                "`{number}` came out at the limit of what it may be, and the other numbers make up for the rest; check \
                 the points, and if the lens does bend so much, cut the images to their middle, where it bends less"
            ),
            Warning::AtLimit { number } => write!(
                f,
                "`{number}` came out at the limit of what it may be, and the other numbers make up for the rest; \
                 check the points, or {}",
                remedy(number)
            ),
            Warning::Poor { number } => {
                write!(f, "the points hardly determine `{number}`; {}", remedy(number))
            }
            Warning::Rough => f.write_str(
                "the points are off by more than they should; measure again, or let the lens bend, which takes six \
                 points or more from the middle to the corners, and no `--distortion`",
            ),
            Warning::NoRedundancy => f.write_str(
                "there are no more measurements than unknowns, so that a wrong one cannot show; add points",
            ),
            Warning::AboveHorizon { line } => {
                write!(f, "line {line} is at or above the camera's horizon; take points that are nearer")
            }
        }
    }
}

fn remedy(number: &str) -> &'static str {
    match number {
        "height" => "measure it and give it with `--height`, or add points at other distances",
        "pitch" => "measure it and give it with `--pitch`, or add points at other distances",
        "field_of_view" => {
            "give it with `--fov`, or add points to the far left and right, with their places `left`"
        }
        _ => "give it with `--distortion 0`, or add points in the corners and in the middle of the image",
    }
}

/// Why there is no calibration.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CalibrateError {
    /// A number given is impossible.
    #[error("{0}")]
    Camera(#[from] CameraError),
    /// The camera that fits best is impossible.
    #[error(
        "the camera that shows these points so is impossible: {0}; check the points and the numbers given"
    )]
    Impossible(CameraError),
    /// Fewer measurements than unknowns.
    #[error(
        "{measurements} measurements cannot give {unknowns} numbers ({names}); add points (one with `left` counts \
         twice), or give what you can measure with `--height`, `--pitch` or `--fov`"
    )]
    TooFew {
        /// How many there are.
        measurements: usize,
        /// How many are needed.
        unknowns: usize,
        /// What is unknown.
        names: String,
    },
    /// A point outside the image.
    #[error(
        "column {column}, row {row} is outside the image, whose last pixel is {}, {}; check the point, and `--size`",
        size.0.saturating_sub(1), size.1.saturating_sub(1)
    )]
    Outside {
        /// The point's line in the table.
        line: usize,
        /// Its column.
        column: f64,
        /// Its row.
        row: f64,
        /// Width and height of the image.
        size: (u32, u32),
    },
    /// A point above the horizon.
    #[error(
        "row {row} is above the horizon, where no floor can be; check the point: rows count from the top, and a pitch \
         below the horizontal is positive"
    )]
    AboveHorizon {
        /// The point's line in the table.
        line: usize,
        /// Its row.
        row: f64,
    },
    /// The points leave a number open.
    #[error("the points leave `{number}` open: many cameras show them so; {}", remedy(number))]
    Undetermined {
        /// Its name.
        number: &'static str,
    },
    /// No camera has all points in front of it.
    #[error(
        "no camera with the numbers given sees all these points; check `--height`, `--pitch` and `--fov`"
    )]
    Nowhere,
    /// The points lie nowhere near where the best camera shows them.
    #[error(
        "no camera shows these points so: the best is off by {rms:.1} pixels, and most here; check the table (rows \
         count from the top, `ahead` and `left` are metres, left of the middle is positive) and the numbers given"
    )]
    Unexplained {
        /// The line of the point that is farthest off.
        line: usize,
        /// How far all are off, in pixels (RMS).
        rms: f64,
    },
}

impl CalibrateError {
    /// The line of the table that it is about.
    pub fn line(&self) -> Option<usize> {
        match self {
            CalibrateError::Outside { line, .. }
            | CalibrateError::AboveHorizon { line, .. }
            | CalibrateError::Unexplained { line, .. } => Some(*line),
            _ => None,
        }
    }
}

/// A calibrated camera, and how far to trust it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Calibration {
    /// The camera.
    pub camera: Camera,
    /// Width and height of the images, in pixels.
    pub size: (u32, u32),
    /// Its numbers: height, pitch, field of view, distortion.
    pub numbers: [Number; 4],
    /// Of each point.
    pub residuals: Vec<Residual>,
    /// Root of the mean squared distance of the points in the image, in pixels.
    pub rms_pixels: f64,
    /// The same on the floor, in metres, of the points below the horizon.
    pub rms_metres: Option<f64>,
    /// What deserves a second look.
    pub warnings: Vec<Warning>,
}

impl Calibration {
    /// The point that is farthest off in the image.
    pub fn worst(&self) -> Option<&Residual> {
        self.residuals.iter().max_by(|a, b| a.pixels.total_cmp(&b.pixels))
    }

    /// The point that is farthest off on the floor.
    pub fn worst_on_floor(&self) -> Option<&Residual> {
        let metres = |r: &Residual| r.metres.unwrap_or(-1.0);
        let worst = self.residuals.iter().max_by(|a, b| metres(a).total_cmp(&metres(b)));
        worst.filter(|r| r.metres.is_some())
    }
}
