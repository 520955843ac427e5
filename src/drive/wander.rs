//! From ranges to speeds: a controller that wanders about without hitting anything.
//!
//! It is reactive, as that of Martin (2001) for sonar was: it has no map and no goal. What it does:
//!
//! - The way ahead is an arc. Of a fan of arcs it takes the one that is free the farthest, with the most room beside
//!   it, and not too bent: so it turns to the freer side and keeps to the middle of a corridor (after D. Fox, W.
//!   Burgard, S. Thrun, *The Dynamic Window Approach to Collision Avoidance*, 1997).
//! - The forward speed is one from which it can stop within what is free of that arc.
//! - Where every arc is blocked, it turns in place, to the side that is freer at that time, and keeps turning that way
//!   until there is room ahead. It never goes backwards, for it has no eyes there; as its body is round, turning in
//!   place is always safe.
//! - Blocked again and again, it is in a dead end and turns about. Where nothing is free enough all round, it is
//!   content with less and less.
//! - Driving, it does not go round in circles: after most of one it prefers the other side for a while.
//! - A slight preference for one side, which changes at random every now and then, makes it explore; all it does
//!   follows from its readings and its seed.
//!
//! The nearest that a camera sees is ahead of the body, not beside it. So the controller remembers for some seconds where
//! it has seen obstacles, moves them by the wheels' odometry, and does not turn into what it is passing. What is in view
//! and not hidden is believed to be as it was seen last, with a little persistence: thin things may stand between two
//! columns.
//!
//! Nothing in here knows of images or of a simulation: a real robot calls [`Wander::steer`] with the ranges of a
//! detector (those of [`crate::camera::ground::Ground::locate`], or what a detector exported by `vsonar export` gives)
//! or of a ring of sonars, every time that there are new ones.
//!
//! ```
//! use vsonar::detector::Motion;
//! use vsonar::drive::wander::{Reach, Reading, Settings, View, Wander};
//!
//! let mut wander = Wander::new(Settings::default(), View::Fan { half_angle: 0.6, farthest: 3.0 });
//! let bearings = [-0.6, -0.3, 0.0, 0.3, 0.6];
//! let open = bearings.map(|bearing| Reading { bearing, reach: Reach::Free(3.0) });
//! let command = wander.steer(&open, Motion::default(), 0.1);
//! assert_eq!(command.forward, wander.settings().max_speed);
//! // A wall across the view, a hand's width before the lens: it turns in place.
//! let wall = bearings.map(|b: f64| Reading { bearing: b, reach: Reach::Obstacle(0.1 / b.cos()) });
//! let command = wander.steer(&wall, Motion::default(), 0.1);
//! assert!(command.forward == 0.0 && command.turn != 0.0);
//! ```

use super::around::{Around, Way};
use crate::camera::Camera;
use crate::camera::ground::{Range, Status};
use crate::detector::Motion;
use crate::world::noise::Stream;

/// What a sensor says of a direction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reading {
    /// In radians, to the left positive; 0 is straight ahead.
    pub bearing: f64,
    /// What is there.
    pub reach: Reach,
}

impl Reading {
    /// The same, or that nothing is known where the distance is none; nothing if there is no direction.
    fn sound(self) -> Option<Reading> {
        let known = match self.reach {
            Reach::Obstacle(metres) | Reach::Free(metres) => metres >= 0.0,
            Reach::Unknown => false,
        };
        let reach = if known { self.reach } else { Reach::Unknown };
        self.bearing.is_finite().then_some(Reading { reach, ..self })
    }
}

/// How far it is to something.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Reach {
    /// An obstacle so many metres from the sensor, along the floor. An infinite distance is no obstacle in reach, as drivers
    /// of range sensors mean it; one that is negative or no number is as good as [`Reach::Unknown`].
    Obstacle(f64),
    /// Nothing for so many metres; beyond, it cannot see.
    Free(f64),
    /// Nothing is known.
    Unknown,
}

/// Of a column of a camera.
impl From<Range> for Reading {
    fn from(range: Range) -> Reading {
        let reach = match range.status {
            Status::Obstacle => Reach::Obstacle(f64::from(range.distance)),
            Status::NoneInView => Reach::Free(f64::from(range.nearest)),
            Status::Invalid => Reach::Unknown,
        };
        Reading { bearing: f64::from(range.bearing), reach }
    }
}

/// The floor that a sensor sees, from where it stands. What is remembered there is forgotten unless it is seen again.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum View {
    /// What is inside the picture of a camera, whose width and height are in pixels.
    Picture {
        /// The camera.
        camera: Camera,
        /// Width and height.
        size: (u32, u32),
    },
    /// What is in a fan of directions.
    Fan {
        /// How far it reaches to either side of straight ahead, in radians.
        half_angle: f64,
        /// How far away it ends, in metres.
        farthest: f64,
    },
}

impl View {
    /// Whether a place so many metres ahead of the sensor and to the left of it is in view.
    pub fn holds(&self, ahead: f64, left: f64) -> bool {
        match *self {
            View::Picture { camera, size } => {
                let inside = |at: f64, size: u32| (-0.5..f64::from(size) - 0.5).contains(&at);
                let seen = camera.project(size, ahead, left);
                seen.is_some_and(|(column, row)| inside(column, size.0) && inside(row, size.1))
            }
            View::Fan { half_angle, farthest } => {
                libm::atan2(left, ahead).abs() <= half_angle && libm::hypot(ahead, left) <= farthest
            }
        }
    }
}

/// How fast to go.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Command {
    /// In m/s.
    pub forward: f64,
    /// In rad/s, to the left positive.
    pub turn: f64,
}

/// The controller's parameters.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Settings {
    /// Radius of the robot's body, in metres.
    pub body_radius: f64,
    /// How far the sensor stands before the body's centre, in metres.
    pub sensor_ahead: f64,
    /// What the body's edge keeps away from everything if it can, in metres.
    pub margin: f64,
    /// The fastest it goes, in m/s.
    pub max_speed: f64,
    /// The fastest it turns, in rad/s.
    pub max_turn: f64,
    /// How hard it counts on braking, in m/s².
    pub braking: f64,
    /// It stands still with this much left free, in metres.
    pub stop: f64,
    /// A turn in place ends with this much free ahead, in metres.
    pub release: f64,
    /// What is farther does not matter, in metres.
    pub horizon: f64,
    /// The narrowest arc, as 1/radius in 1/m.
    pub max_curvature: f64,
    /// Seconds that an obstacle is remembered that is not in view.
    pub memory: f64,
    /// Seconds that an obstacle in view is believed in after it was seen last.
    pub fresh: f64,
    /// Of what is left to chance.
    pub seed: u64,
}

impl Default for Settings {
    fn default() -> Settings {
        Settings {
            body_radius: 0.24,
            sensor_ahead: crate::world::office::CAMERA_AHEAD,
            margin: 0.1,
            max_speed: 0.3,
            max_turn: 0.9,
            braking: 0.3,
            stop: 0.03,
            release: 0.7,
            horizon: 1.8,
            max_curvature: 2.0,
            memory: 4.0,
            fresh: 0.5,
            seed: 0,
        }
    }
}

/// What it is doing.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Doing {
    Driving,
    /// Turning in place: to which side (1 is left), how far it has come, and the least it is to turn, in radians.
    Turning {
        side: f64,
        turned: f64,
        least: f64,
    },
}

/// The controller with what it remembers.
#[derive(Debug, Clone)]
pub struct Wander {
    settings: Settings,
    view: View,
    around: Around,
    doing: Doing,
    chance: Stream,
    /// The curvature it prefers for the time being, and for how many seconds more.
    taste: (f64, f64),
    /// The curvature it took last.
    last: f64,
    /// How far it has wound round while driving, in radians to the left, fading; and the side that it avoids for that (0
    /// for none).
    wound: (f64, f64),
    /// Metres and seconds since the last times that it was blocked.
    blocked: Vec<(f64, f64)>,
}

/// Arcs to either side of straight ahead.
const ARCS: i32 = 10;
/// An arc that is free for less than this, in metres, is blocked.
const BLOCKED: f64 = 0.12;
/// Room beside an arc beyond this, in metres, is enough.
const ROOMY: f64 = 0.7;
/// Blocked so many times within so many metres and seconds, it is in a dead end.
const DEAD_END: (usize, f64, f64) = (3, 2.0, 40.0);
/// Seconds in which winding fades to 1/e, the angle in radians from which on it is too much, and that at which it is
/// forgotten; and what an arc to the avoided side loses.
const WINDING: (f64, f64, f64) = (25.0, 4.5, 1.0);
const AVOIDED: f64 = 1.0;
/// How far it turns to leave a dead end, and how far it turns at least elsewhere, in radians.
const ABOUT: f64 = 2.6;
const LEAST: f64 = 0.35;

impl Wander {
    /// A controller that has seen nothing yet, of a robot whose sensor sees this much.
    pub fn new(settings: Settings, view: View) -> Wander {
        Wander {
            settings,
            view,
            around: Around::new(),
            doing: Doing::Driving,
            chance: Stream::new(settings.seed, 11),
            taste: (0.0, 0.0),
            last: 0.0,
            wound: (0.0, 0.0),
            blocked: Vec::new(),
        }
    }

    /// Its parameters.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Whether it turns in place.
    pub fn is_turning(&self) -> bool {
        matches!(self.doing, Doing::Turning { .. })
    }

    /// How fast to go until the next readings.
    ///
    /// `readings` are the newest ones, in any order. `motion` is how the wheels have moved the robot since the call
    /// before, `seconds` how long ago that was. If nothing is known of any direction, or of how the robot has moved (one of
    /// the numbers is infinite or NaN), it stands still. A direction of which nothing is known, among others, is held for free.
    pub fn steer(&mut self, readings: &[Reading], motion: Motion, seconds: f64) -> Command {
        if ![motion.forward, motion.turn, seconds].iter().all(|number| number.is_finite()) {
            return Command::default();
        }
        let readings: Vec<Reading> = readings.iter().filter_map(|reading| reading.sound()).collect();
        let readings = readings.as_slice();
        let Settings { sensor_ahead, fresh, memory, horizon, .. } = self.settings;
        self.around.moved(motion, seconds);
        self.around.seen(readings, (sensor_ahead, &self.view), (fresh, memory), horizon + 1.0);
        for (metres, ago) in &mut self.blocked {
            *metres += motion.forward.abs();
            *ago += seconds;
        }
        self.blocked.retain(|&(metres, ago)| metres < DEAD_END.1 && ago < DEAD_END.2);
        self.wind(motion, seconds);
        self.taste.1 -= seconds;
        if self.taste.1 <= 0.0 {
            self.taste = (self.chance.range(-0.5, 0.5), self.chance.range(4.0, 12.0));
        }
        if readings.iter().all(|reading| reading.reach == Reach::Unknown) {
            return Command::default();
        }
        if let Doing::Turning { side, turned, least } = self.doing {
            let turned = turned + motion.turn.abs();
            self.doing = Doing::Turning { side, turned, least };
            if turned < least || self.way(0.0).free < self.release(turned) {
                return self.turning(side);
            }
            self.doing = Doing::Driving;
            self.last = 0.0;
        }
        let (curvature, way) = self.best();
        if way.free < BLOCKED {
            let side = self.freer_side();
            self.blocked.push((0.0, 0.0));
            let dead_end = self.blocked.len() >= DEAD_END.0;
            if dead_end {
                self.blocked.clear();
            }
            self.doing = Doing::Turning { side, turned: 0.0, least: if dead_end { ABOUT } else { LEAST } };
            return self.turning(side);
        }
        self.last = curvature;
        self.driving(curvature, way)
    }

    fn way(&self, curvature: f64) -> Way {
        let Settings { body_radius, margin, horizon, .. } = self.settings;
        self.around.way(curvature, body_radius, margin, horizon)
    }

    /// Notices when it goes round in a circle.
    fn wind(&mut self, motion: Motion, seconds: f64) {
        let (wound, avoided) = &mut self.wound;
        let driven = if self.doing == Doing::Driving { motion.turn } else { 0.0 };
        *wound = *wound * (1.0 - seconds / WINDING.0).max(0.0) + driven;
        if wound.abs() > WINDING.1 {
            *avoided = wound.signum();
        } else if wound.abs() < WINDING.2 {
            *avoided = 0.0;
        }
    }

    /// What has to be free for a turn in place to end: less if it has gone all round in vain.
    fn release(&self, turned: f64) -> f64 {
        let rounds = (turned / (2.0 * std::f64::consts::PI)).floor();
        (self.settings.release / (1.0 + rounds)).max(BLOCKED + 0.05)
    }

    fn turning(&self, side: f64) -> Command {
        Command { forward: 0.0, turn: side * self.settings.max_turn }
    }

    /// 1 for the left, -1 for the right.
    fn freer_side(&self) -> f64 {
        let [right, left] = self.around.sides(self.settings.horizon);
        // On even sides taste decides.
        if left == right { 1f64.copysign(self.taste.0) } else { 1f64.copysign(left - right) }
    }

    /// The best of the arcs.
    fn best(&self) -> (f64, Way) {
        let Settings { max_curvature, horizon, .. } = self.settings;
        let mut best = (f64::NEG_INFINITY, 0.0, Way { free: 0.0, clear: 0.0, then: 0.0 });
        for i in -ARCS..=ARCS {
            let share = f64::from(i) / f64::from(ARCS);
            // Closer together near straight ahead.
            let curvature = max_curvature * share * share.abs();
            let way = self.way(curvature);
            let bent = (curvature - self.taste.0).abs() / max_curvature;
            let change = (curvature - self.last).abs() / max_curvature;
            let room = 0.4 * way.clear.min(ROOMY) + 0.6 * way.then.min(ROOMY);
            let circling = if share * self.wound.1 > 0.0 { AVOIDED * share.abs() } else { 0.0 };
            let score = way.free / horizon + room / ROOMY - 0.2 * bent - 0.1 * change - circling;
            if score > best.0 {
                best = (score, curvature, way);
            }
        }
        (best.1, best.2)
    }

    fn driving(&self, curvature: f64, way: Way) -> Command {
        let Settings { max_speed, max_turn, braking, stop, margin, .. } = self.settings;
        let stopping = (2.0 * braking * (way.free - stop).max(0.0)).sqrt();
        let narrow = (0.4 + 0.6 * way.clear / (2.0 * margin)).min(1.0);
        let bent = if curvature == 0.0 { f64::INFINITY } else { max_turn / curvature.abs() };
        let forward = stopping.min(max_speed * narrow).min(bent);
        Command { forward, turn: curvature * forward }
    }
}

#[cfg(test)]
#[path = "wander_tests.rs"]
mod tests;
