//! Calibration: a camera's four numbers from points of the floor at known places.
//!
//! A point is a pixel and where on the floor it lies, ahead of the point under the lens and to the left of the middle
//! line ([`Point`]). What is known of the camera otherwise is held; the rest is fitted, so that the points, as the
//! camera would show them, lie nearest to their pixels (least squares, from many starts, the same each time).
//!
//! Which numbers are fitted:
//!
//! - height, pitch and field of view unless they are given. They need one measurement each at least; a point with both
//!   its places counts as two.
//! - the distortion unless it is given, and only if there are [`DISTORTION_POINTS`] points or more, three measurements
//!   more than unknowns, and points both within half of the image's half width from its middle and beyond 0.8 of it.
//!   It stays 0, too, if what is found is less than twice its standard error.
//!
//! A number that the points push against the limit of what it may be stays there, without a standard error and with a
//! warning, and the others are fitted to it.
//!
//! ```
//! use vsonar::camera::calibrate::{Known, calibrate};
//! use vsonar::camera::points;
//!
//! // Height and pitch by yardstick and protractor; then one yardstick on the floor, 50 cm ahead, gives the rest.
//! let table = "column,row,ahead,left\n72,156,0.5,0.5\n116,156,0.5,0.25\n160,156,0.5,0\n203,156,0.5,-0.25\n";
//! let known = Known { height: Some(0.8), pitch: Some(45.0), ..Known::default() };
//! let found = calibrate(&points::read(table, "points.csv")?, &known, (320, 240))?;
//! assert!((found.camera.field_of_view - 90.0).abs() < 2.0 && found.camera.distortion == 0.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub use super::calibration::{CalibrateError, Calibration, Number, Residual, Source, Warning};
use super::fit::{Fit, Free, Problem, Sensitivity, Undetermined, sum_of_squares};
use super::points::Point;
use super::{Camera, CameraError, LIMITS};

/// Points that the distortion needs.
pub const DISTORTION_POINTS: usize = 6;
/// The least standard error of a measurement, in pixels: that of rounding to whole pixels.
pub const ROUNDING: f64 = 0.29;
/// The standard error of a measurement, in pixels, where there are no more of them than unknowns.
pub const ASSUMED: f64 = 1.0;
/// More points add nothing to where the fit starts.
const START_POINTS: usize = 100;
/// A standard error from which on a number counts as open, and from which on it deserves a warning: height and field of
/// view as a share of themselves, pitch in degrees, distortion.
const OPEN: [f64; 4] = [0.5, 15.0, 0.5, 1.0];
const POOR: [f64; 4] = [0.05, 2.0, 0.05, 0.1];
/// A point is an outlier if its squares are this many times what the rest leaves to expect: three times as many where
/// the rest has but [`OUTLIER_SPARE`] measurements more than unknowns, which is little to expect from.
const OUTLIER: f64 = 25.0;
const OUTLIER_SPARE: usize = 4;
/// A good table is off by less than this share of the image's width: 2 pixels in 320.
const ROUGH: f64 = 1.0 / 160.0;

/// What is known of the camera beforehand, in the units of [`Camera`].
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Known {
    /// Height of the lens.
    pub height: Option<f64>,
    /// Angle below the horizontal.
    pub pitch: Option<f64>,
    /// Horizontal field of view.
    pub field_of_view: Option<f64>,
    /// Radial distortion.
    pub distortion: Option<f64>,
}

/// Finds the camera that shows the points where they are, in images of `size` (width and height) pixels. What counts as
/// known is held; with nothing unknown, it is only compared.
///
/// # Errors
/// Points that are too few, outside the image, above the horizon, or leave a number open; points that no camera
/// explains (off by more than a twentieth of the image's width); known numbers that are impossible.
pub fn calibrate(points: &[Point], known: &Known, size: (u32, u32)) -> Result<Calibration, CalibrateError> {
    check(points, known, size)?;
    let (mut free, mut reason) = unknowns(points, known, size)?;
    let mut problem = Problem { points, size, free };
    let mut fit = best(&problem, known).ok_or(CalibrateError::Nowhere)?;
    let mut sensitivity = problem.sensitivity(&fit.camera);
    if free[3] {
        let insignificant = match &sensitivity {
            Ok(s) => {
                fit.camera.distortion.abs() < 2.0 * s.standard_errors(&fit.camera, noise(&problem, &fit))[3]
            }
            Err(_) => true,
        };
        if insignificant {
            (free[3], reason) = (false, Source::NotSignificant);
            problem.free = free;
            fit = best(&problem, known).ok_or(CalibrateError::Nowhere)?;
            sensitivity = problem.sensitivity(&fit.camera);
        }
    }
    judge(&problem, &fit)?;
    let mut sensitivity = determined(sensitivity)?;
    let (mut errors, mut shares) = errors(&problem, &fit, &sensitivity);
    if let Some(i) = (0..4).find(|&i| shares[i] > OPEN[i]) {
        return Err(CalibrateError::Undetermined { number: LIMITS[i].0 });
    }
    // What is at its limit does not follow the points: the others are fitted to it, as to what is given.
    let held: [bool; 4] = std::array::from_fn(|i| free[i] && problem.at_limit(&fit.camera, i));
    if held.contains(&true) {
        problem.free = std::array::from_fn(|i| free[i] && !held[i]);
        fit = problem.descend(fit.camera).ok_or(CalibrateError::Nowhere)?;
        sensitivity = determined(problem.sensitivity(&fit.camera))?;
        (errors, shares) = self::errors(&problem, &fit, &sensitivity);
    }
    let camera = fit.camera;
    let values = [camera.height, camera.pitch, camera.field_of_view, camera.distortion];
    camera.check(size.0, size.1).map_err(CalibrateError::Impossible)?;

    let mut warnings = Vec::new();
    warnings.extend((0..4).filter(|&i| held[i]).map(|i| Warning::AtLimit { number: LIMITS[i].0 }));
    warnings.extend((0..4).filter(|&i| shares[i] > POOR[i]).map(|i| Warning::Poor { number: LIMITS[i].0 }));
    let unknowns = free.iter().filter(|f| **f).count();
    if unknowns > 0 && measurements(points) == unknowns {
        warnings.push(Warning::NoRedundancy);
    }
    warnings.extend(outlier(&problem, &fit, &sensitivity));
    let residuals = residuals(&problem, &camera);
    warnings.extend(
        residuals.iter().filter(|r| r.metres.is_none()).map(|r| Warning::AboveHorizon { line: r.line }),
    );
    let rms = |values: &[f64]| (sum_of_squares(values) / values.len() as f64).sqrt();
    let pixels: Vec<f64> = residuals.iter().map(|r| r.pixels).collect();
    let metres: Vec<f64> = residuals.iter().filter_map(|r| r.metres).collect();
    let given = [known.height, known.pitch, known.field_of_view, known.distortion];
    let numbers = std::array::from_fn(|i| Number {
        name: LIMITS[i].0,
        value: values[i],
        standard_error: problem.free[i].then_some(errors[i]),
        source: match (free[i], given[i]) {
            (true, _) => Source::Fitted,
            (false, Some(_)) => Source::Given,
            (false, None) => reason,
        },
    });
    let rms_pixels = rms(&pixels);
    if rms_pixels > ROUGH * f64::from(size.0) {
        warnings.push(Warning::Rough);
    }
    Ok(Calibration {
        camera,
        size,
        numbers,
        rms_pixels,
        rms_metres: (!metres.is_empty()).then(|| rms(&metres)),
        residuals,
        warnings,
    })
}

fn determined(sensitivity: Result<Sensitivity, Undetermined>) -> Result<Sensitivity, CalibrateError> {
    sensitivity.map_err(|Undetermined(i)| CalibrateError::Undetermined { number: LIMITS[i].0 })
}

/// The standard errors, and the same as [`OPEN`] and [`POOR`] count them.
fn errors(problem: &Problem, fit: &Fit, sensitivity: &Sensitivity) -> ([f64; 4], [f64; 4]) {
    let Camera { height, field_of_view, .. } = fit.camera;
    let errors = sensitivity.standard_errors(&fit.camera, noise(problem, fit));
    // Height and field of view are measured against themselves.
    (errors, [errors[0] / height, errors[1], errors[2] / field_of_view, errors[3]])
}

fn measurements(points: &[Point]) -> usize {
    points.iter().map(Point::measurements).sum()
}

/// Whether the points can be those of such images, and the numbers those of a camera.
fn check(points: &[Point], known: &Known, size: (u32, u32)) -> Result<(), CalibrateError> {
    let camera = Camera {
        height: known.height.unwrap_or(1.0),
        pitch: known.pitch.unwrap_or(90.0),
        field_of_view: known.field_of_view.unwrap_or(90.0),
        distortion: known.distortion.unwrap_or(0.0),
    };
    match camera.check(size.0, size.1) {
        // With another field of view there may be some.
        Err(CameraError::NoFloor { .. }) if known.field_of_view.is_none() => {}
        checked => checked?,
    }
    let (width, height) = (f64::from(size.0), f64::from(size.1));
    for &Point { line, column, row, .. } in points {
        if !(-0.5..=width - 0.5).contains(&column) || !(-0.5..=height - 0.5).contains(&row) {
            return Err(CalibrateError::Outside { line, column, row, size });
        }
    }
    Ok(())
}

/// What is to be fitted, and if not the distortion, why.
fn unknowns(points: &[Point], known: &Known, size: (u32, u32)) -> Result<(Free, Source), CalibrateError> {
    let mut free = [
        known.height.is_none(),
        known.pitch.is_none(),
        known.field_of_view.is_none(),
        known.distortion.is_none(),
    ];
    let count = measurements(points);
    let unknowns = free[..3].iter().filter(|f| **f).count();
    if count < unknowns {
        let names: Vec<_> = LIMITS.iter().zip(free).take(3).filter(|(_, f)| *f).map(|(l, _)| l.0).collect();
        return Err(CalibrateError::TooFew { measurements: count, unknowns, names: names.join(", ") });
    }
    let mut reason = Source::Fitted;
    if free[3] {
        let (half, middle) = (f64::from(size.0) / 2.0, f64::from(size.1) / 2.0);
        let off = |p: &Point| libm::hypot(p.column + 0.5 - half, p.row + 0.5 - middle) / half;
        let spans = points.iter().any(|p| off(p) < 0.5) && points.iter().any(|p| off(p) > 0.8);
        if points.len() < DISTORTION_POINTS || count < unknowns + 4 {
            (free[3], reason) = (false, Source::TooFewPoints);
        } else if !spans {
            (free[3], reason) = (false, Source::TooNarrow);
        }
    }
    Ok((free, reason))
}

/// The best of the fits from starts all over the range of cameras: the sum of squares has several valleys.
fn best(problem: &Problem, known: &Known) -> Option<Fit> {
    let mut ahead: Vec<f64> = problem.points.iter().map(|p| p.ahead.abs()).collect();
    ahead.sort_by(f64::total_cmp);
    let typical = ahead.get(ahead.len() / 2).copied().unwrap_or(1.0).max(0.02);
    let choices =
        |known: Option<f64>, range: &[f64]| known.map_or_else(|| range.to_vec(), |value| vec![value]);
    // A few points tell the valleys apart.
    let every = problem.points.len().div_ceil(START_POINTS).max(1);
    let some: Vec<Point> = problem.points.iter().copied().step_by(every).collect();
    let sketch = Problem { points: &some, ..*problem };
    let distortions = if problem.free[3] { vec![0.0, -0.3] } else { vec![known.distortion.unwrap_or(0.0)] };
    let mut fits = Vec::new();
    for &height in &choices(known.height, &[0.1, 0.3, 1.0, 3.0].map(|share| share * typical)) {
        for &pitch in &choices(known.pitch, &[0.0, 15.0, 30.0, 45.0, 60.0, 75.0]) {
            for &field_of_view in &choices(known.field_of_view, &[35.0, 65.0, 100.0]) {
                for &distortion in &distortions {
                    let start = Camera { height, pitch, field_of_view, distortion };
                    fits.extend(sketch.descend(start));
                }
            }
        }
    }
    // What is smooth on a few points may not see them all: the next best then.
    fits.sort_by(|a, b| a.squares.total_cmp(&b.squares));
    fits.into_iter().find_map(|fit| problem.descend(fit.camera))
}

/// The standard error of a measurement, in pixels.
fn noise(problem: &Problem, fit: &Fit) -> f64 {
    let unknowns = problem.free.iter().filter(|f| **f).count();
    match measurements(problem.points).saturating_sub(unknowns) {
        0 => ASSUMED,
        spare => (fit.squares / spare as f64).sqrt().max(ROUNDING),
    }
}

/// Whether the fit explains the points at all.
fn judge(problem: &Problem, fit: &Fit) -> Result<(), CalibrateError> {
    let residuals = residuals(problem, &fit.camera);
    let limit = f64::from(problem.size.0) / 20.0;
    let rms = |values: &[f64]| (sum_of_squares(values) / values.len().max(1) as f64).sqrt();
    let (off, rest): (Vec<_>, Vec<_>) =
        residuals.iter().zip(problem.points).partition(|(r, _)| r.metres.is_none() && r.pixels > 3.0);
    let possible: Vec<f64> = rest.iter().map(|(r, _)| r.pixels).collect();
    // If the rest fits, these points are wrong; else all may be.
    if let Some((residual, point)) = off.first().filter(|_| rms(&possible) <= limit) {
        return Err(CalibrateError::AboveHorizon { line: residual.line, row: point.row });
    }
    let rms = (fit.squares / problem.points.len() as f64).sqrt();
    let worst = residuals.iter().max_by(|a, b| a.pixels.total_cmp(&b.pixels));
    match worst {
        Some(worst) if rms > limit => Err(CalibrateError::Unexplained { line: worst.line, rms }),
        _ => Ok(()),
    }
}

fn residuals(problem: &Problem, camera: &Camera) -> Vec<Residual> {
    let mut all = problem.residuals(camera).unwrap_or_default().into_iter();
    let residual = |point: &Point| {
        let off: Vec<f64> = all.by_ref().take(point.measurements()).collect();
        let seen = camera.floor(problem.size, point.column, point.row);
        let metres = seen.map(|(ahead, left)| {
            libm::hypot(ahead - point.ahead, point.left.map_or(0.0, |given| left - given))
        });
        Residual { line: point.line, pixels: sum_of_squares(&off).sqrt(), metres }
    };
    problem.points.iter().map(residual).collect()
}

/// The point without which the others fit best, if they then fit much better: an F test of two fits, with each point's
/// weight in the fit taken into account (R. D. Cook, *Detection of influential observation in linear regression*, 1977).
fn outlier(problem: &Problem, fit: &Fit, sensitivity: &Sensitivity) -> Option<Warning> {
    let all = problem.residuals(&fit.camera)?;
    let unknowns = problem.free.iter().filter(|f| **f).count();
    let mut first = 0;
    let mut worst: Option<(f64, Warning)> = None;
    for point in problem.points {
        let count = point.measurements();
        let own = &all[first..first + count];
        let spare = all.len().saturating_sub(count + unknowns);
        if let Some(drop) = sensitivity.without(first, own).filter(|_| spare >= OUTLIER_SPARE) {
            let rest = (fit.squares - drop).max(0.0);
            let expected = (rest / spare as f64).max(ROUNDING * ROUNDING);
            let few = 1.0 + 2.0 * OUTLIER_SPARE as f64 / spare as f64;
            let ratio = drop / count as f64 / expected / few;
            if ratio > worst.map_or(OUTLIER, |(ratio, _)| ratio) {
                let points = (problem.points.len() - 1) as f64;
                let rms_without = (rest / points).sqrt();
                worst = Some((ratio, Warning::Outlier { line: point.line, rms_without }));
            }
        }
        first += count;
    }
    worst.map(|(_, warning)| warning)
}

#[cfg(test)]
#[path = "calibrate_tests.rs"]
mod tests;
