//! An ideal sonar: a fan of cones, each of which hears the nearest thing in it.
//!
//! What is ideal about it: every wall is heard at every angle of incidence (a real one sends the sound away from beyond
//! about half the cone's width, and then hears a far echo or none), things of any material and height, no cross-talk,
//! and all cones at once.

use super::source::{RangeSource, Rows, Sight};
use super::wander::{Reach, Reading, View};
use crate::detector::DetectError;
use crate::world::noise::{Stream, normal};

/// Directions, evenly spread over the half circle ahead: as many as a robot's front half has in a ring of 24.
pub const BEAMS: u32 = 12;
/// Width of a cone in radians: 15 degrees, so that the cones tile.
pub const CONE: f64 = std::f64::consts::PI / 12.0;
/// Rays by which a cone is sampled.
const RAYS: u32 = 5;
/// Standard deviation of a range, as a share of it.
pub const NOISE: f64 = 0.01;
/// The farthest echo, in metres.
pub const FARTHEST: f64 = 5.0;

/// The sonars of a robot, in its middle.
#[derive(Debug, Clone)]
pub struct Sonar {
    seed: u64,
    noise: Stream,
}

impl Sonar {
    /// Sonars; the seed is that of their noise.
    pub fn new(seed: u64) -> Sonar {
        Sonar { seed, noise: Stream::new(seed, 0) }
    }
}

impl RangeSource for Sonar {
    fn ahead(&self) -> f64 {
        0.0
    }

    fn sees(&self) -> bool {
        false
    }

    fn view(&self) -> View {
        View::Fan { half_angle: CONE * f64::from(BEAMS) / 2.0, farthest: FARTHEST }
    }

    fn restart(&mut self, run: u64) {
        self.noise = Stream::new(self.seed, run);
    }

    fn readings(&mut self, sight: &Sight<'_>, readings: &mut Vec<Reading>) -> Result<(), DetectError> {
        readings.clear();
        for beam in 0..BEAMS {
            let bearing = CONE * (f64::from(beam) - f64::from(BEAMS - 1) / 2.0);
            let ray = |i: u32| {
                let off = CONE * (f64::from(i) / f64::from(RAYS - 1) - 0.5);
                let direction = sight.place.heading + bearing + off;
                sight.moment.range(sight.place.x, sight.place.y, direction, FARTHEST)
            };
            let least = (0..RAYS).map(ray).fold(f64::INFINITY, f64::min);
            // Drawn in any case, so that one echo more does not change all that follow.
            let heard = least * (1.0 + NOISE * normal(self.noise.bits()));
            let reach = if least < FARTHEST { Reach::Obstacle(heard) } else { Reach::Free(FARTHEST) };
            readings.push(Reading { bearing, reach });
        }
        Ok(())
    }

    fn rows(&self) -> Option<&Rows> {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::office::{Kind, Office};

    #[test]
    fn cones_hear_what_is_nearest_in_them() {
        let office = Office::new(Kind::Fmrb, 1);
        let (moment, place) = (office.at(0.0), office.start(0));
        let sight = Sight { moment: &moment, place: &place, picture: None, motion: None };
        let (mut sonar, mut readings, mut again) = (Sonar::new(1), Vec::new(), Vec::new());
        sonar.readings(&sight, &mut readings).expect("it needs no picture");
        assert_eq!(readings.len(), BEAMS as usize);
        assert!((readings[0].bearing + readings[11].bearing).abs() < 1e-12 && readings[11].bearing > 1.4);
        let nearest = moment.nearest(place.x, place.y, 9.0).distance;
        for reading in &readings {
            let Reach::Obstacle(heard) = reading.reach else { continue };
            let middle = moment.range(place.x, place.y, place.heading + reading.bearing, FARTHEST);
            assert!(heard > nearest * 0.95 && heard < middle * 1.05, "{reading:?} {nearest} {middle}");
        }
        sonar.restart(0);
        sonar.readings(&sight, &mut readings).expect("it needs no picture");
        sonar.readings(&sight, &mut again).expect("it needs no picture");
        assert_ne!(readings, again, "there is noise");
        sonar.restart(0);
        sonar.readings(&sight, &mut again).expect("it needs no picture");
        assert_eq!(readings, again, "a run repeats");
    }
}
