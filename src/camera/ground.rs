//! From a column and a row to a place on the floor: one formula for every executor and every exported form.
//!
//! [`Ground::range`] is written over a [`Machine`], so that an exported detector, whether native code or C, gives the
//! bits that [`Ground::locate`] gives here. Its constants are computed once in binary64 and rounded; at run time there
//! are additions, multiplications, divisions, comparisons and the arc tangent, sine and cosine of
//! [`vsonar_ir::formula::trig`], and no mathematical library. The distance is
//! `forward cos(bearing) + left sin(bearing)`, which needs no square root.
//!
//! Against a binary64 computation a distance d is off by at most 2e-7 h + 1e-6 d + 1.5e-7 d²/h, h being the height of
//! the lens (1e-5 of itself from 0.1 h to 25 h), and a bearing by 2e-6 beyond half a height; the tests hold it to that.
//!
//! ```
//! use vsonar::camera::{Camera, ground::{Ground, Status}};
//!
//! let camera = Camera { height: 0.8, pitch: 51.0, field_of_view: 90.0, distortion: 0.0 };
//! camera.check(320, 240)?;
//! let ground = Ground::new(&camera, 320, 240);
//! let range = ground.locate(160, 120.0);
//! assert_eq!(range.status, Status::Obstacle);
//! // The middle of the image is seen along the axis: 0.8 m / tan 51 degrees.
//! assert!((range.distance - 0.648).abs() < 0.01 && range.bearing.abs() < 0.01);
//! assert!(range.nearest < range.distance && range.distance < range.farthest);
//! # Ok::<(), vsonar::camera::CameraError>(())
//! ```

use vsonar_ir::formula::arith::{max, min};
use vsonar_ir::formula::trig;
use vsonar_ir::machine::{Machine, Scalar};

use super::Camera;

/// What is known of a column.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(i32)]
pub enum Status {
    /// An obstacle, at the distance given.
    Obstacle = 0,
    /// Floor as far as the camera sees.
    NoneInView = 1,
    /// The detector gave no number: nothing is known.
    Invalid = 2,
}

/// What is known of a column, as numbers. Rows are those of [`Ground::range`], where the rules stand.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Range {
    /// The row that the rest follows from, as it was given.
    pub row: f32,
    /// Direction in radians, to the left positive.
    pub bearing: f32,
    /// Distance in metres along the floor from the point under the lens; infinite where no obstacle is in view, NaN
    /// where nothing is known.
    pub distance: f32,
    /// The least distance if the row is off by one.
    pub nearest: f32,
    /// The greatest distance if the row is off by one.
    pub farthest: f32,
    /// What is known.
    pub status: Status,
}

/// A camera's numbers as the formula uses them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ground {
    /// 0.5 less half the width and half the height: what takes a pixel's number to its centre's place.
    shift: (f32, f32),
    /// A pixel, in halves of the image's width.
    pixel: f32,
    /// t (1 + k).
    slope: f32,
    /// k.
    distortion: f32,
    /// Of the pitch.
    sin: f32,
    cos: f32,
    /// Of the lens, in metres.
    height: f32,
    /// The last row.
    last: f32,
}

/// What the formula gives, as values of a machine.
#[derive(Debug, Clone, Copy)]
pub struct GroundRange<M: Machine + ?Sized> {
    /// Direction in radians, to the left positive.
    pub bearing: M::F,
    /// Distance along the floor, in metres.
    pub distance: M::F,
    /// The least distance if the obstacle stood one row lower or higher in the image.
    pub nearest: M::F,
    /// The greatest distance if the obstacle stood one row lower or higher.
    pub farthest: M::F,
    /// A [`Status`], as a number.
    pub status: M::I,
}

/// Where a ray goes: not of unit length.
struct Ray<M: Machine + ?Sized> {
    forward: M::F,
    left: M::F,
    /// Distance along the floor for each unit of the ray's horizontal part.
    reach: M::F,
    /// Whether it meets the floor.
    meets: M::M,
}

/// Distances from here on count as none: so no product overflows.
const BEYOND: f32 = 1e30;

impl Ground {
    /// For images of `width` x `height` pixels, of a camera that has passed [`Camera::check`] for them. With another
    /// the results mean nothing, but nothing traps.
    pub fn new(camera: &Camera, width: u32, height: u32) -> Ground {
        let (sin, cos) = libm::sincos(camera.pitch.to_radians());
        let slope = camera.tangent() * (1.0 + camera.distortion);
        let half = |side: u32| f64::from(side) / 2.0;
        Ground {
            shift: ((0.5 - half(width)) as f32, (0.5 - half(height)) as f32),
            pixel: (1.0 / half(width)) as f32,
            slope: slope as f32,
            distortion: camera.distortion as f32,
            sin: sin as f32,
            cos: cos as f32,
            height: camera.height as f32,
            last: (f64::from(height) - 1.0) as f32,
        }
    }

    /// The range of an obstacle whose lowest pixel in `column` (a whole number inside the image) is `row`, which may be
    /// any number. The image point is the pixel's centre, (`column` + 0.5, `row` + 0.5).
    ///
    /// - A row that is not finite: invalid. All distances are NaN; the bearing is that of row 0.
    /// - A row below 0.5 (ground all the way up, or more), one at or above the horizon, or one so near to it that the
    ///   distance exceeds 1e30 m: none in view. Distance and farthest are infinite, nearest is that of the floor at
    ///   row 0 (infinite if it is not floor that is seen there), and so is the bearing.
    /// - Else an obstacle. A row beyond the last counts as the last. Nearest and farthest are the least and the greatest
    ///   of the distances at `row` - 1, `row` and `row` + 1, infinite at or above the horizon. Ahead of the camera
    ///   these are those of `row` + 1 and of `row` - 1; a camera that looks steeply down sees the floor behind it at
    ///   the bottom of the image, where it is the other way round.
    ///
    /// The bearing is atan2(left, forward) of the ray's horizontal part, so that what is behind has one beyond ±π/2.
    /// Straight below it is 0.
    pub fn range<M: Machine + ?Sized>(&self, m: &mut M, column: M::F, row: M::F) -> GroundRange<M> {
        let (zero, infinity, nan) = (m.f32(0.0), m.f32(f32::INFINITY), m.f32(f32::NAN));
        let finite = finite(m, row);
        let last = m.f32(self.last);
        let within = min(m, row, last);
        let ray = self.ray(m, column, within);
        let highest = m.f32(0.5);
        let inside = m.le(highest, within);
        let seen = m.and(inside, ray.meets);
        let obstacle = m.and(finite, seen);

        // Where there is none, what is needed is the floor at row 0.
        let centre = m.select(obstacle, within, zero);
        let ray = self.ray(m, column, centre);
        let bearing = trig::atan2(m, ray.left, ray.forward);
        let distance = along(m, &ray, bearing);
        let one = m.f32(1.0);
        let lower = m.add(centre, one);
        let lower = self.distance(m, column, lower);
        let higher = m.sub(centre, one);
        let higher = self.distance(m, column, higher);
        let least = min(m, lower, higher);
        let least = min(m, least, distance);
        let greatest = max(m, lower, higher);
        let greatest = max(m, greatest, distance);

        let nearest = m.select(obstacle, least, distance);
        let farthest = m.select(obstacle, greatest, infinity);
        let distance = m.select(obstacle, distance, infinity);
        let [is, none, invalid] = [Status::Obstacle, Status::NoneInView, Status::Invalid].map(|s| s as i32);
        let (is, none, invalid) = (m.i32(is), m.i32(none), m.i32(invalid));
        let status = m.iselect(obstacle, is, none);
        GroundRange {
            bearing,
            distance: m.select(finite, distance, nan),
            nearest: m.select(finite, nearest, nan),
            farthest: m.select(finite, farthest, nan),
            status: m.iselect(finite, status, invalid),
        }
    }

    /// [`Ground::range`] as numbers: what is known of `column` when the lowest pixel of an obstacle in it is `row`.
    pub fn locate(&self, column: u32, row: f32) -> Range {
        let found = self.range(&mut Scalar, column as f32, row);
        let status = match found.status {
            0 => Status::Obstacle,
            1 => Status::NoneInView,
            _ => Status::Invalid,
        };
        let GroundRange { bearing, distance, nearest, farthest, status: _ } = found;
        Range { row, bearing, distance, nearest, farthest, status }
    }

    /// The last row of the images.
    pub fn last_row(&self) -> f32 {
        self.last
    }

    /// The ray through the centre of a pixel.
    fn ray<M: Machine + ?Sized>(&self, m: &mut M, column: M::F, row: M::F) -> Ray<M> {
        let pixel = m.f32(self.pixel);
        let x = off_middle(m, column, self.shift.0, pixel);
        let y = off_middle(m, row, self.shift.1, pixel);
        let mut scale = m.f32(self.slope);
        // Without distortion the division would be one by 1.
        if self.distortion != 0.0 {
            let (xx, yy) = (m.mul(x, x), m.mul(y, y));
            let square = m.add(xx, yy);
            let distortion = m.f32(self.distortion);
            let bend = m.mul(distortion, square);
            let one = m.f32(1.0);
            let bend = m.add(one, bend);
            scale = m.div(scale, bend);
        }
        let right = m.mul(x, scale);
        let below = m.mul(y, scale);

        let (sin, cos, zero) = (m.f32(self.sin), m.f32(self.cos), m.f32(0.0));
        let back = m.mul(below, sin);
        let forward = m.sub(cos, back);
        let steeper = m.mul(below, cos);
        let down = m.add(sin, steeper);
        let left = m.sub(zero, right);
        let height = m.f32(self.height);
        let reach = m.div(height, down);
        let beyond = m.f32(BEYOND);
        let (falls, near) = (m.lt(zero, down), m.lt(reach, beyond));
        Ray { forward, left, reach, meets: m.and(falls, near) }
    }

    /// The distance of the floor that a pixel shows; infinite if it shows none.
    fn distance<M: Machine + ?Sized>(&self, m: &mut M, column: M::F, row: M::F) -> M::F {
        let ray = self.ray(m, column, row);
        let bearing = trig::atan2(m, ray.left, ray.forward);
        along(m, &ray, bearing)
    }
}

/// How far from the middle of the image a pixel's centre is, in halves of its width.
fn off_middle<M: Machine + ?Sized>(m: &mut M, pixels: M::F, shift: f32, pixel: M::F) -> M::F {
    let shift = m.f32(shift);
    let pixels = m.add(pixels, shift);
    m.mul(pixels, pixel)
}

/// The distance along the floor to where the ray of this bearing meets it; infinite if it does not.
fn along<M: Machine + ?Sized>(m: &mut M, ray: &Ray<M>, bearing: M::F) -> M::F {
    let (cos, sin) = (trig::cos(m, bearing), trig::sin(m, bearing));
    let (ahead, aside) = (m.mul(ray.forward, cos), m.mul(ray.left, sin));
    let length = m.add(ahead, aside);
    let distance = m.mul(ray.reach, length);
    let infinity = m.f32(f32::INFINITY);
    m.select(ray.meets, distance, infinity)
}

/// Whether this is a number, and finite.
fn finite<M: Machine + ?Sized>(m: &mut M, a: M::F) -> M::M {
    let (low, high) = (m.f32(f32::NEG_INFINITY), m.f32(f32::INFINITY));
    let (above, below) = (m.lt(low, a), m.lt(a, high));
    m.and(above, below)
}

/// The row to believe after three frames, `current` being the newest.
///
/// If `current` is not finite, it is `current` itself, and the column invalid: old rows do not stand in for a missing
/// one. Else it is the median of those of the three that are finite, and of two the larger row, which is that of the
/// nearer obstacle.
pub fn median_of_three<M: Machine + ?Sized>(m: &mut M, current: M::F, previous: M::F, before: M::F) -> M::F {
    let (low, high) = (m.f32(f32::NEG_INFINITY), m.f32(f32::INFINITY));
    let (is_known, has_previous, has_before) = (finite(m, current), finite(m, previous), finite(m, before));
    // One that is missing stands above all others, so that of two the larger is in the middle; a second one below.
    let missing = m.select(has_previous, high, low);
    let previous = m.select(has_previous, previous, high);
    let before = m.select(has_before, before, missing);
    let (less, more) = (min(m, current, previous), max(m, current, previous));
    let middle = min(m, more, before);
    let median = max(m, less, middle);
    m.select(is_known, median, current)
}

#[cfg(test)]
#[path = "ground_tests.rs"]
mod tests;
