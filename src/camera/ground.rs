//! From a column and a row to a place on the floor: one formula for every executor and every exported form.

use vsonar_ir::machine::Machine;

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

/// A camera's numbers as the formula uses them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ground {
    width: u32,
    height: u32,
}

/// What the formula gives, as values of a machine.
#[derive(Debug, Clone, Copy)]
pub struct GroundRange<M: Machine + ?Sized> {
    /// Direction in radians, to the left positive.
    pub bearing: M::F,
    /// Distance along the floor, in metres.
    pub distance: M::F,
    /// The distance if the obstacle stood one row lower in the image.
    pub nearest: M::F,
    /// The distance if the obstacle stood one row higher.
    pub farthest: M::F,
    /// A [`Status`], as a number.
    pub status: M::I,
}

impl Ground {
    /// For images of `width` x `height` pixels.
    pub fn new(_camera: &Camera, width: u32, height: u32) -> Ground {
        Ground { width, height }
    }

    /// The range of an obstacle whose lowest pixel in `column` (a whole number inside the image) is `row`.
    pub fn range<M: Machine + ?Sized>(&self, m: &mut M, column: M::F, row: M::F) -> GroundRange<M> {
        let status = m.i32(Status::Obstacle as i32);
        GroundRange { bearing: column, distance: row, nearest: row, farthest: row, status }
    }
}

// Stand-ins, which the camera's own files replace.

/// Stand-in.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Range {
    /// As given.
    pub row: f32,
    /// Stand-in.
    pub bearing: f32,
    /// Stand-in.
    pub distance: f32,
    /// Stand-in.
    pub nearest: f32,
    /// Stand-in.
    pub farthest: f32,
    /// Stand-in.
    pub status: Status,
}

impl Ground {
    /// Stand-in.
    pub fn locate(&self, column: u32, row: f32) -> Range {
        let status = if row.is_finite() { Status::Obstacle } else { Status::Invalid };
        Range { row, bearing: column as f32, distance: row, nearest: row - 1.0, farthest: row + 1.0, status }
    }
}

/// The row to believe after three frames, `current` being the newest: see the module's documentation.
pub fn median_of_three<M: Machine + ?Sized>(m: &mut M, current: M::F, previous: M::F, before: M::F) -> M::F {
    use vsonar_ir::formula::arith::{max, min};
    let (none, zero) = (m.f32(f32::INFINITY), m.f32(0.0));
    let finite = |m: &mut M, a: M::F| {
        let difference = m.sub(a, a);
        m.eq(difference, zero)
    };
    // One that is no number counts as the largest: then the middle one is the larger of the two others.
    let [known, of_previous, of_before] = [current, previous, before].map(|row| finite(m, row));
    let (previous, before) = (m.select(of_previous, previous, none), m.select(of_before, before, none));
    let (low, high) = (min(m, previous, before), max(m, previous, before));
    let middle = min(m, current, high);
    let middle = max(m, middle, low);
    let alone = m.eq(low, none);
    let middle = m.select(alone, current, middle);
    m.select(known, middle, current)
}
