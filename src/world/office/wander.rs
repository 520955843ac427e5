//! A robot that wanders by sonar, as the original did while its camera recorded.
//!
//! Reactive: it drives towards the freer side, slows down before what stands ahead, and turns on the spot where there
//! is no way. Its sonars are ideal; what it wants drifts slowly, so that it does not always keep to the middle.

use super::{FRAME_RATE, Moment, Place};
use crate::world::noise::{Stream, smooth};

/// Directions of the sonars, in degrees to the left.
const SONARS: [f64; 11] = [-90.0, -70.0, -50.0, -32.0, -15.0, 0.0, 15.0, 32.0, 50.0, 70.0, 90.0];
/// How far they reach, in metres.
const REACH: f64 = 4.0;
/// Speed in metres a second, and the fastest turn in radians a second.
const SPEED: f64 = 0.3;
const TURN: f64 = 0.9;
/// Distance from the middle of the body that is kept, in metres.
const CLEARANCE: f64 = 0.40;
/// Where it stops to turn on the spot, and where it goes on, in metres ahead.
const STOP: f64 = 0.55;
const GO: f64 = 0.95;

/// The robot on its way.
pub(super) struct Wanderer {
    place: Place,
    /// The side it turns to until the way ahead is free, +1 for the left.
    turning: Option<f64>,
    seed: u64,
    driven: f64,
}

impl Wanderer {
    pub(super) fn new(place: Place, seed: u64) -> Wanderer {
        Wanderer { place, turning: None, seed: Stream::new(seed, 81).bits(), driven: 0.0 }
    }

    pub(super) fn place(&self) -> &Place {
        &self.place
    }

    /// A frame's time later.
    pub(super) fn step(&mut self, moment: &Moment<'_>) {
        let Place { x, y, heading } = self.place;
        let radians = std::f64::consts::PI / 180.0;
        let sonar = |degrees: f64| moment.range(x, y, heading + degrees * radians, REACH);
        let ranges = SONARS.map(sonar);
        // sides count for less than what is ahead, and far things for less than near ones
        let side = |from: usize, to: usize| ranges[from..to].iter().map(|r| r.min(2.0)).sum::<f64>();
        let (right, left) = (side(0, 5), side(6, 11));
        let ahead = ranges[4].min(ranges[5]).min(ranges[6]).min(ranges[3] + 0.15).min(ranges[7] + 0.15);
        let nearest = moment.nearest(x, y, REACH);
        let free = match self.turning {
            None => ahead > STOP,
            Some(_) => ahead > GO,
        };
        let (mut speed, turn) = if free {
            self.turning = None;
            let wish = 2.0 * smooth(self.seed, self.driven / 2.1, 0.5) - 1.0;
            let slow = 2.0 * smooth(self.seed, self.driven / 6.3, 7.5) - 1.0;
            let mut turn = 0.06 * (left - right) + 0.7 * wish + 0.4 * slow;
            // away from what is too near
            if nearest.distance < CLEARANCE + 0.12 {
                let (dx, dy) = (nearest.point.0 - x, nearest.point.1 - y);
                let (sin, cos) = libm::sincos(heading);
                let to_left = dy * cos - dx * sin;
                let push = (CLEARANCE + 0.12 - nearest.distance) * 9.0;
                turn += if to_left > 0.0 { -push } else { push };
            }
            (SPEED * ((ahead - 0.35) / 0.8).clamp(0.25, 1.0), turn)
        } else {
            // the side is kept until the way is free, so that corners are no trap
            let side = *self.turning.get_or_insert(if left >= right { 1.0 } else { -1.0 });
            (0.0, side * 0.7)
        };
        let turn = turn.clamp(-TURN, TURN);
        let time = 1.0 / FRAME_RATE;
        let new = heading + turn * time;
        let (sin, cos) = libm::sincos(new);
        let (nx, ny) = (x + cos * speed * time, y + sin * speed * time);
        let clear = moment.nearest(nx, ny, REACH).distance;
        if clear < CLEARANCE && clear < nearest.distance {
            // it would come too near: it turns on the spot instead
            if self.turning.is_none() {
                self.turning = Some(if left >= right { 1.0 } else { -1.0 });
            }
            speed = 0.0;
        }
        let (x, y) = if speed > 0.0 { (nx, ny) } else { (x, y) };
        self.place = Place { x, y, heading: new };
        self.driven += speed * time + 0.02 * turn.abs() * time;
    }
}
