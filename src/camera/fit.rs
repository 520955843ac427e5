//! Least squares: the camera whose pixels lie nearest to the measured ones.
//!
//! What is minimised is the sum of squared distances in the image, in pixels, not on the floor: there, what is near the
//! horizon would count for everything. The method is that of Levenberg and Marquardt (D. W. Marquardt, *An algorithm
//! for least-squares estimation of nonlinear parameters*, 1963) over the logarithms of height and of the tangent of half
//! the field of view, the pitch in radians and the distortion, with derivatives by central differences.

use super::points::Point;
use super::{Camera, LIMITS};

/// Numbers of a camera.
pub(super) const NUMBERS: usize = 4;
/// Each in the unknown's own scale: ln metres, radians, ln tangent, none.
type Vector = [f64; NUMBERS];
type Matrix = [[f64; NUMBERS]; NUMBERS];

/// Which numbers are unknown.
pub(super) type Free = [bool; NUMBERS];

/// Half the step of a derivative. Every unknown's natural scale is 1.
const DELTA: f64 = 1e-6;
/// After so many steps the place is good enough or never will be.
const STEPS: usize = 100;
/// A normal matrix, scaled to ones on its diagonal, is singular if a pivot falls below this.
const SINGULAR: f64 = 1e-9;

/// A number is at its limit if it is as near as this share of it.
const AT_LIMIT: f64 = 1e-6;

/// What there is to fit to.
#[derive(Debug, Clone, Copy)]
pub(super) struct Problem<'p> {
    pub(super) points: &'p [Point],
    pub(super) size: (u32, u32),
    pub(super) free: Free,
}

/// A fit: camera, and the sum of the squared residuals in pixels.
#[derive(Debug, Clone, Copy)]
pub(super) struct Fit {
    pub(super) camera: Camera,
    pub(super) squares: f64,
}

/// How the measurements hang on the unknowns at a fit.
#[derive(Debug, Clone)]
pub(super) struct Sensitivity {
    /// Of each measurement, by unknown.
    jacobian: Vec<Vector>,
    /// The inverse of the normal matrix, 0 for what is fixed.
    inverse: Matrix,
}

/// The number that the points do not determine.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Undetermined(pub(super) usize);

fn vector(camera: &Camera) -> Vector {
    [libm::log(camera.height), camera.pitch.to_radians(), libm::log(camera.tangent()), camera.distortion]
}

/// The camera with the free numbers of a vector, kept within what is possible, and its own of the rest.
fn with(camera: &Camera, vector: &Vector, problem: &Problem) -> Camera {
    let [h, pitch, tangent, k] = *vector;
    let new = [libm::exp(h), pitch.to_degrees(), (2.0 * libm::atan(libm::exp(tangent))).to_degrees(), k];
    let mut numbers = [camera.height, camera.pitch, camera.field_of_view, camera.distortion];
    for i in (0..NUMBERS).filter(|&i| problem.free[i]) {
        let (min, max) = problem.limits(i);
        numbers[i] = new[i].clamp(min, max);
    }
    let [height, pitch, field_of_view, distortion] = numbers;
    Camera { height, pitch, field_of_view, distortion }
}

impl Problem<'_> {
    /// The least and the greatest that a number may be in the fit.
    fn limits(&self, i: usize) -> (f64, f64) {
        let (_, min, max, _) = LIMITS[i];
        let bend = Camera::distortion_limit(self.size.0, self.size.1);
        if i == 3 { (min.max(-bend), max.min(bend)) } else { (min, max) }
    }

    /// Whether a number of a fit is where the fit would not let it go on: as near as makes no difference.
    pub(super) fn at_limit(&self, camera: &Camera, i: usize) -> bool {
        let number = [camera.height, camera.pitch, camera.field_of_view, camera.distortion][i];
        let (min, max) = self.limits(i);
        number <= min + AT_LIMIT * min.abs() || number >= max - AT_LIMIT * max.abs()
    }

    /// Calculated less measured column and row of every point, but the row alone where `left` is not known. `None`
    /// where a point is not in front of the camera.
    pub(super) fn residuals(&self, camera: &Camera) -> Option<Vec<f64>> {
        let mut all = Vec::with_capacity(2 * self.points.len());
        for point in self.points {
            match point.left {
                Some(left) => {
                    let (column, row) = camera.project(self.size, point.ahead, left)?;
                    all.extend([column - point.column, row - point.row]);
                }
                None => all.push(camera.row_of(self.size, point.column, point.ahead)? - point.row),
            }
        }
        all.iter().all(|r| r.is_finite()).then_some(all)
    }

    /// The best fit in the valley that a start lies in; `None` if it sees not all points.
    pub(super) fn descend(&self, start: Camera) -> Option<Fit> {
        let mut at = start;
        let mut residuals = self.residuals(&at)?;
        let mut squares = sum_of_squares(&residuals);
        let mut damping = 1e-3;
        for _ in 0..STEPS {
            let jacobian = self.jacobian(&at, &residuals);
            let (normal, slope) = self.normal(&jacobian, &residuals);
            let Some((next, better, new)) = self.step(&at, &normal, &slope, squares, &mut damping) else {
                break;
            };
            let gain = squares - better;
            (at, residuals, squares) = (next, new, better);
            if gain <= 1e-14 * squares || squares < 1e-24 {
                break;
            }
        }
        Some(Fit { camera: at, squares })
    }

    /// A step that lowers the sum of squares, tried with more and more damping.
    fn step(
        &self,
        at: &Camera,
        normal: &Matrix,
        slope: &Vector,
        squares: f64,
        damping: &mut f64,
    ) -> Option<(Camera, f64, Vec<f64>)> {
        while *damping < 1e12 {
            let mut damped = *normal;
            for (i, row) in damped.iter_mut().enumerate() {
                row[i] *= 1.0 + *damping;
            }
            let candidate = inverse(&damped, &self.free, 0.0).ok().map(|inverse| {
                let mut to = vector(at);
                for (i, to) in to.iter_mut().enumerate() {
                    // Longer steps leave the range in which the model is nearly linear.
                    *to -= dot(&inverse[i], slope).clamp(-1.0, 1.0);
                }
                with(at, &to, self)
            });
            let tried = candidate.and_then(|camera| Some((camera, self.residuals(&camera)?)));
            if let Some((camera, residuals)) = tried {
                let better = sum_of_squares(&residuals);
                if better < squares {
                    *damping = (*damping / 10.0).max(1e-12);
                    return Some((camera, better, residuals));
                }
            }
            *damping *= 10.0;
        }
        None
    }

    fn jacobian(&self, camera: &Camera, residuals: &[f64]) -> Vec<Vector> {
        let mut jacobian = vec![[0.0; NUMBERS]; residuals.len()];
        let at = vector(camera);
        for i in (0..NUMBERS).filter(|&i| self.free[i]) {
            let side = |delta: f64| {
                let mut to = at;
                to[i] += delta;
                let camera = with(camera, &to, self);
                // How far it went, which at a limit is less.
                Some((vector(&camera)[i] - at[i], self.residuals(&camera)?))
            };
            let here = || (0.0, residuals.to_vec());
            let (up, above) = side(DELTA).unwrap_or_else(here);
            let (down, below) = side(-DELTA).unwrap_or_else(here);
            if up - down > 0.0 {
                for (j, row) in jacobian.iter_mut().enumerate() {
                    row[i] = (above[j] - below[j]) / (up - down);
                }
            }
        }
        jacobian
    }

    fn normal(&self, jacobian: &[Vector], residuals: &[f64]) -> (Matrix, Vector) {
        let (mut normal, mut slope) = ([[0.0; NUMBERS]; NUMBERS], [0.0; NUMBERS]);
        for (row, residual) in jacobian.iter().zip(residuals) {
            for i in 0..NUMBERS {
                slope[i] += row[i] * residual;
                for j in 0..NUMBERS {
                    normal[i][j] += row[i] * row[j];
                }
            }
        }
        (normal, slope)
    }

    /// How the measurements hang on the unknowns.
    ///
    /// # Errors
    /// If they leave an unknown open.
    pub(super) fn sensitivity(&self, camera: &Camera) -> Result<Sensitivity, Undetermined> {
        let residuals = self.residuals(camera).unwrap_or_default();
        let jacobian = self.jacobian(camera, &residuals);
        let (normal, _) = self.normal(&jacobian, &residuals);
        let inverse = inverse(&normal, &self.free, SINGULAR)?;
        Ok(Sensitivity { jacobian, inverse })
    }
}

impl Sensitivity {
    /// The standard error of each number in the units of [`Camera`], 0 for what is fixed, if a measurement has that of
    /// `pixels`.
    pub(super) fn standard_errors(&self, camera: &Camera, pixels: f64) -> Vector {
        let tangent = camera.tangent();
        let units =
            [camera.height, 1f64.to_degrees(), (2.0 * tangent / (1.0 + tangent * tangent)).to_degrees(), 1.0];
        std::array::from_fn(|i| units[i] * pixels * self.inverse[i][i].max(0.0).sqrt())
    }

    /// By how much the sum of squares would fall if the measurements `first..first + count` (one or two) were left out,
    /// to first order; `None` if the fit would then be undetermined.
    pub(super) fn without(&self, first: usize, residuals: &[f64]) -> Option<f64> {
        let rows = &self.jacobian[first..first + residuals.len()];
        let free =
            |a: &Vector, b: &Vector| -> f64 { (0..NUMBERS).map(|i| a[i] * dot(&self.inverse[i], b)).sum() };
        match (rows, residuals) {
            ([row], [e]) => {
                let rest = 1.0 - free(row, row);
                (rest > 1e-6).then(|| e * e / rest)
            }
            ([a, b], [e, f]) => {
                let (aa, ab, bb) = (1.0 - free(a, a), -free(a, b), 1.0 - free(b, b));
                let determinant = aa * bb - ab * ab;
                (determinant > 1e-6).then(|| (bb * e * e - 2.0 * ab * e * f + aa * f * f) / determinant)
            }
            _ => None,
        }
    }
}

/// The sum of the squares.
pub(super) fn sum_of_squares(values: &[f64]) -> f64 {
    values.iter().map(|v| v * v).sum()
}

fn dot(a: &Vector, b: &Vector) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// The inverse of a symmetric matrix over the free numbers, 0 elsewhere, by Gauss and Jordan's elimination after the
/// diagonal is scaled to ones; the unknown left open if a pivot is not above `singular`.
fn inverse(matrix: &Matrix, free: &Free, singular: f64) -> Result<Matrix, Undetermined> {
    let mut left = [[0.0; NUMBERS]; NUMBERS];
    let mut right = left;
    let scale: Vector = std::array::from_fn(|i| matrix[i][i].max(0.0).sqrt());
    for i in 0..NUMBERS {
        right[i][i] = 1.0;
        left[i][i] = 1.0;
        if !free[i] {
            continue;
        }
        if scale[i] <= 1e-9 {
            return Err(Undetermined(i));
        }
        for j in (0..NUMBERS).filter(|&j| j != i && free[j]) {
            left[i][j] = matrix[i][j] / (scale[i] * scale[j].max(1e-300));
        }
    }
    let mut open = *free;
    while let Some(pivot) =
        (0..NUMBERS).filter(|&i| open[i]).max_by(|&a, &b| left[a][a].total_cmp(&left[b][b]))
    {
        let value = left[pivot][pivot];
        if value.is_nan() || value <= singular {
            return Err(Undetermined(pivot));
        }
        open[pivot] = false;
        for j in 0..NUMBERS {
            left[pivot][j] /= value;
            right[pivot][j] /= value;
        }
        let (left_row, right_row) = (left[pivot], right[pivot]);
        for i in (0..NUMBERS).filter(|&i| i != pivot) {
            let factor = left[i][pivot];
            for j in 0..NUMBERS {
                left[i][j] -= factor * left_row[j];
                right[i][j] -= factor * right_row[j];
            }
        }
    }
    let mut out = [[0.0; NUMBERS]; NUMBERS];
    for i in (0..NUMBERS).filter(|&i| free[i]) {
        for j in (0..NUMBERS).filter(|&j| free[j]) {
            out[i][j] = right[i][j] / (scale[i] * scale[j]);
        }
    }
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inverses() {
        let matrix = [[4.0, 1.0, 0.5, 0.0], [1.0, 3.0, 0.2, 0.0], [0.5, 0.2, 2e6, 0.0], [0.0, 0.0, 0.0, 0.0]];
        let free = [true, true, true, false];
        let inverse = inverse(&matrix, &free, SINGULAR).expect("regular");
        for (i, j) in (0..9).map(|n| (n / 3, n % 3)) {
            let product: f64 = (0..3).map(|k| matrix[i][k] * inverse[k][j]).sum();
            assert!((product - f64::from(u8::from(i == j))).abs() < 1e-12, "{i} {j} {product}");
        }
        assert_eq!(super::inverse(&matrix, &[true; 4], SINGULAR), Err(Undetermined(3)));
        let dependent = [[1.0, 1.0, 0.0, 0.0], [1.0, 1.0, 0.0, 0.0], [0.0; 4], [0.0; 4]];
        assert!(super::inverse(&dependent, &[true, true, false, false], SINGULAR).is_err());
    }
}
