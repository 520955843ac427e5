//! The robot's body: two driven wheels, what they can do, and where they take it.
//!
//! ```
//! use vsonar::drive::robot::{Body, Robot};
//! use vsonar::drive::wander::Command;
//! use vsonar::world::office::Place;
//!
//! let mut robot = Robot::new(Body::default(), Place { x: 0.0, y: 0.0, heading: 0.0 });
//! for _ in 0..100 {
//!     robot.step(Command { forward: 0.2, turn: 0.0 }, 0.02);
//! }
//! // Two seconds at 0.2 m/s, less what it took to get there.
//! assert!(robot.place().x > 0.35 && robot.place().x < 0.4);
//! ```

use super::wander::Command;
use crate::detector::Motion;
use crate::world::office::Place;

/// What does not change of a robot: a round body on two wheels, with castors.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Body {
    /// Radius of the circle that it covers, in metres. The wheels' axle runs through its centre.
    pub radius: f64,
    /// Distance between the two wheels, in metres.
    pub axle: f64,
    /// The most that a wheel's rim goes, in m/s.
    pub max_speed: f64,
    /// The most that the speed of a wheel's rim changes, up or down, in m/s².
    pub acceleration: f64,
}

/// About a Pioneer, an indoor robot of the time: 0.48 m wide.
impl Default for Body {
    fn default() -> Body {
        Body { radius: 0.24, axle: 0.33, max_speed: 0.5, acceleration: 0.6 }
    }
}

/// A robot on its way.
#[derive(Debug, Clone, PartialEq)]
pub struct Robot {
    body: Body,
    place: Place,
    /// Speeds of the left and the right wheel's rim, in m/s.
    wheels: [f64; 2],
}

impl Robot {
    /// A robot that stands still.
    pub fn new(body: Body, place: Place) -> Robot {
        Robot { body, place, wheels: [0.0; 2] }
    }

    /// What does not change of it.
    pub fn body(&self) -> &Body {
        &self.body
    }

    /// Where it is.
    pub fn place(&self) -> Place {
        self.place
    }

    /// How fast it goes.
    pub fn speed(&self) -> Command {
        let [left, right] = self.wheels;
        Command { forward: (left + right) / 2.0, turn: (right - left) / self.body.axle }
    }

    /// Goes on for a short time towards a command: the wheels change their speeds at once, as far as they can in this
    /// time, and then keep them. Says how it moved. A command that is not finite is taken for standing still.
    pub fn step(&mut self, command: Command, seconds: f64) -> Motion {
        let wanted = self.wanted(command);
        let most = self.body.acceleration * seconds;
        // As one, so that a brake or a start does not bend the path.
        let differences = [wanted[0] - self.wheels[0], wanted[1] - self.wheels[1]];
        let greatest = differences[0].abs().max(differences[1].abs());
        let share = if greatest > most { most / greatest } else { 1.0 };
        for (wheel, difference) in self.wheels.iter_mut().zip(differences) {
            *wheel += share * difference;
        }
        let speed = self.speed();
        let motion = Motion { forward: speed.forward * seconds, turn: speed.turn * seconds };
        self.place = moved(self.place, motion);
        motion
    }

    /// The wheels' speeds for a command. Where one would be too fast, both are reduced alike: the curve stays the same.
    fn wanted(&self, Command { forward, turn }: Command) -> [f64; 2] {
        if !(forward.is_finite() && turn.is_finite()) {
            return [0.0; 2];
        }
        let difference = turn * self.body.axle / 2.0;
        let wheels = [forward - difference, forward + difference];
        let fastest = wheels[0].abs().max(wheels[1].abs());
        let share = if fastest > self.body.max_speed { self.body.max_speed / fastest } else { 1.0 };
        wheels.map(|wheel| share * wheel)
    }
}

/// Where a motion along an arc leads to, from where the robot was, ahead and to the left, in metres.
pub fn chord(Motion { forward, turn }: Motion) -> (f64, f64) {
    // sin(t) / t and (1 - cos(t)) / t; their series where the quotient would lose digits.
    let (along, aside) = if turn.abs() < 1e-4 {
        (1.0 - turn * turn / 6.0, turn / 2.0)
    } else {
        let (sin, cos) = libm::sincos(turn);
        (sin / turn, (1.0 - cos) / turn)
    };
    (forward * along, forward * aside)
}

/// Where a robot is after a motion along an arc: exactly, whatever the arc's length.
pub fn moved(place: Place, motion: Motion) -> Place {
    let (along, aside) = chord(motion);
    let (sin, cos) = libm::sincos(place.heading);
    Place {
        x: place.x + cos * along - sin * aside,
        y: place.y + sin * along + cos * aside,
        heading: place.heading + motion.turn,
    }
}

/// Two motions, one after the other, as odometry adds them up.
pub(super) fn add(a: Motion, b: Motion) -> Motion {
    Motion { forward: a.forward + b.forward, turn: a.turn + b.turn }
}

#[cfg(test)]
mod tests {
    use super::*;

    const START: Place = Place { x: 1.0, y: 2.0, heading: 0.5 };

    #[test]
    fn arcs_are_circles() {
        for (forward, turn) in [(1.0, 0.7), (1.0, -2.5), (-0.3, 1e-5), (0.2, 6.0), (2.0, 1.1e-4)] {
            let place = moved(START, Motion { forward, turn });
            // The centre of the circle is to the left by the radius.
            let radius = forward / turn;
            let (sin, cos) = (0.5f64.sin(), 0.5f64.cos());
            let centre = (1.0 - sin * radius, 2.0 + cos * radius);
            let end = 0.5 + turn;
            let x = centre.0 + radius * end.sin();
            let y = centre.1 - radius * end.cos();
            assert!((place.x - x).abs() < 1e-9 && (place.y - y).abs() < 1e-9, "{forward} {turn}: {place:?}");
            assert!((place.heading - end).abs() < 1e-15);
            // Many short arcs are the long one.
            let mut many = START;
            for _ in 0..1000 {
                many = moved(many, Motion { forward: forward / 1000.0, turn: turn / 1000.0 });
            }
            assert!((many.x - x).abs() < 1e-9 && (many.y - y).abs() < 1e-9);
        }
        let straight = moved(START, Motion { forward: 2.0, turn: 0.0 });
        assert_eq!((straight.x, straight.y), (1.0 + 2.0 * libm::cos(0.5), 2.0 + 2.0 * libm::sin(0.5)));
        let turned = moved(START, Motion { forward: 0.0, turn: 1.0 });
        assert_eq!((turned.x, turned.y, turned.heading), (1.0, 2.0, 1.5));
    }

    #[test]
    fn wheels_keep_their_limits() {
        let body = Body::default();
        let mut robot = Robot::new(body, START);
        let commands =
            [(0.3, 0.0), (0.3, 1.0), (-5.0, 9.0), (0.0, -2.0), (f64::NAN, 0.0), (9.0, 0.0), (0.1, 0.1)];
        for (forward, turn) in commands {
            for _ in 0..70 {
                let before = robot.wheels;
                robot.step(Command { forward, turn }, 0.02);
                for (now, before) in robot.wheels.iter().zip(before) {
                    assert!((now - before).abs() <= body.acceleration * 0.02 + 1e-12);
                    assert!(now.abs() <= body.max_speed + 1e-12);
                }
            }
        }
        let speed = robot.speed();
        assert!((speed.forward - 0.1).abs() < 1e-9 && (speed.turn - 0.1).abs() < 1e-9, "{speed:?}");
        // Too much of both: slower on the same curve.
        for _ in 0..200 {
            robot.step(Command { forward: 2.0, turn: 4.0 }, 0.02);
        }
        let speed = robot.speed();
        assert!((speed.turn / speed.forward - 2.0).abs() < 1e-9 && speed.forward < 0.5, "{speed:?}");
    }

    #[test]
    fn braking_is_as_long_as_the_formula() {
        let mut robot = Robot::new(Body::default(), START);
        let run = |robot: &mut Robot, forward, steps: usize| -> f64 {
            (0..steps).map(|_| robot.step(Command { forward, turn: 0.0 }, 0.001).forward).sum()
        };
        run(&mut robot, 0.3, 1000);
        let braking = run(&mut robot, 0.0, 1000);
        assert!((braking - 0.3 * 0.3 / (2.0 * 0.6)).abs() < 1e-3, "{braking}");
        assert_eq!(robot.speed().forward, 0.0);
    }
}
