//! People who walk: where they are at a time, and the pieces a ray can meet.

use super::part::{Part, Pattern, Thing};
use super::plan::Person;
use super::{BODY, Moment, Office, Place};
use crate::world::geometry::{Outline, Vec3};

/// Radius of a person, in metres.
pub(super) const RADIUS: f64 = 0.22;
/// Metres from one step of a leg to its next.
const STRIDE: f64 = 1.3;
/// How far feet are to the side of the middle, how far they swing, and the radii of leg and shoe.
const APART: f64 = 0.085;
const SWING: f64 = 0.1;
const LEG: f64 = 0.062;
const SHOE: f64 = 0.075;
/// How near to the robot's body the middle of a person comes: straight ahead, and on either side, in metres.
const AHEAD: f64 = 0.75;
const ASIDE: f64 = 0.5;
/// How far aside of his way the robot's body may be to be ahead of him.
const LANE: f64 = RADIUS + 0.1;
/// Seconds that he waits before he turns round.
const PATIENCE: f64 = 3.0;
/// The longest step that is walked at once, in seconds.
const STEP: f64 = 0.1;

/// Somebody at a time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Standing {
    pub(super) x: f64,
    pub(super) y: f64,
    /// Sine and cosine of the direction he walks in.
    way: (f64, f64),
    /// Metres walked.
    walked: f64,
    albedo: f64,
}

impl Person {
    /// Where he is so many seconds after the beginning.
    pub(super) fn at(&self, seconds: f64) -> Standing {
        self.along(self.speed * seconds, false, self.speed * seconds)
    }

    /// Where he is so far along his path, which goes round, with so many metres in his legs.
    fn along(&self, along: f64, back: bool, walked: f64) -> Standing {
        let corners = self.path.len();
        let side = |i: usize| {
            let (a, b) = (self.path[i], self.path[(i + 1) % corners]);
            let (dx, dy) = (b.0 - a.0, b.1 - a.1);
            (a, dx, dy, (dx * dx + dy * dy).sqrt())
        };
        let around: f64 = (0..corners).map(|i| side(i).3).sum();
        let albedo = self.albedo;
        let mut rest = if around > 0.0 { along - (along / around).floor() * around } else { 0.0 };
        for i in 0..corners {
            let (from, dx, dy, length) = side(i);
            if length > 0.0 && (rest <= length || i + 1 == corners) {
                let part = (rest / length).clamp(0.0, 1.0);
                let length = if back { -length } else { length };
                let way = (dy / length, dx / length);
                return Standing { x: from.0 + dx * part, y: from.1 + dy * part, way, walked, albedo };
            }
            rest -= length;
        }
        let (x, y) = self.path.first().copied().unwrap_or((0.0, 0.0));
        Standing { x, y, way: (0.0, 1.0), walked, albedo }
    }
}

/// Those who walk about in an office while a robot drives: they wait for it, and turn round if it stays.
///
/// ```
/// use vsonar::world::office::{Kind, Office, Place};
/// let office = Office::preset(Kind::Nsh);
/// let mut crowd = office.crowd();
/// // somebody comes along this hallway and stops before the robot
/// let robot = Place { x: 5.0, y: 1.2, heading: 0.0 };
/// for frame in 0..80 {
///     crowd.advance(f64::from(frame) * 0.1, Some(&robot));
/// }
/// let away = |&(x, y, _): &(f64, f64, f64)| (x - robot.x).hypot(y - robot.y);
/// assert!(crowd.moment().people().iter().all(|person| away(person) > 0.7));
/// assert!(office.at(8.0).people().iter().any(|person| away(person) < 2.0));
/// ```
#[derive(Debug, Clone)]
pub struct Crowd<'a> {
    office: &'a Office,
    seconds: f64,
    walkers: Vec<Walker>,
}

/// How far along his path somebody is.
#[derive(Debug, Clone, Copy)]
struct Walker {
    along: f64,
    /// Whether he walks back.
    back: bool,
    /// Metres walked.
    walked: f64,
    /// Seconds that he has stood still.
    waited: f64,
}

impl Walker {
    fn standing(&self, person: &Person) -> Standing {
        person.along(self.along, self.back, self.walked)
    }

    fn step(&mut self, person: &Person, seconds: f64, robot: Option<&Place>) {
        if robot.is_some_and(|robot| self.standing(person).yields(robot)) {
            self.waited += seconds;
            if self.waited >= PATIENCE {
                (self.waited, self.back) = (0.0, !self.back);
            }
            return;
        }
        let way = person.speed * seconds;
        self.waited = 0.0;
        self.walked += way;
        self.along += if self.back { -way } else { way };
    }
}

impl<'a> Crowd<'a> {
    pub(super) fn new(office: &'a Office) -> Crowd<'a> {
        let walker = Walker { along: 0.0, back: false, walked: 0.0, waited: 0.0 };
        Crowd { office, seconds: 0.0, walkers: vec![walker; office.plan.people.len()] }
    }

    /// Lets them walk on until so many seconds after the office's beginning, while the robot stands at a place. Times
    /// ascend from one call to the next.
    pub fn advance(&mut self, seconds: f64, robot: Option<&Place>) {
        let passed = seconds - self.seconds;
        if passed > 0.0 {
            // a little less, so that a tenth of a second is one step however it is rounded
            let steps = (passed / STEP - 1e-6).ceil().max(1.0);
            for _ in 0..steps as u64 {
                for (walker, person) in self.walkers.iter_mut().zip(&self.office.plan.people) {
                    walker.step(person, passed / steps, robot);
                }
            }
            self.seconds = seconds;
        }
    }

    /// The office with these people where they are now.
    pub fn moment(&self) -> Moment<'a> {
        let people = self.walkers.iter().zip(&self.office.plan.people);
        let people = people.map(|(walker, person)| walker.standing(person)).collect();
        Moment { office: self.office, seconds: self.seconds, people }
    }
}

impl Standing {
    /// Whether he waits for a robot. He goes on if that takes him away from it.
    fn yields(&self, robot: &Place) -> bool {
        let (sin, cos) = self.way;
        let (dx, dy) = (robot.x - self.x, robot.y - self.y);
        let (ahead, aside) = (dx * cos + dy * sin, dy * cos - dx * sin);
        let gap = (dx * dx + dy * dy).sqrt() - BODY;
        ahead > 0.0 && (gap < ASIDE || (gap < AHEAD && aside.abs() < BODY + LANE))
    }

    /// Legs, shoes and body.
    pub(super) fn parts(&self) -> Vec<Part> {
        let (sin, cos) = self.way;
        let phase = self.walked * (2.0 * std::f64::consts::PI / STRIDE);
        let mut parts = Vec::new();
        for side in [-1.0, 1.0] {
            let ahead = side * SWING * libm::sin(phase);
            let place = |ahead: f64, radius: f64| Outline::Round {
                x: self.x + ahead * cos - side * APART * sin,
                y: self.y + ahead * sin + side * APART * cos,
                radius,
            };
            let part = |outline, low, high, albedo| Part {
                outline,
                low,
                high,
                thing: Thing::Person,
                albedo,
                pattern: Pattern::Plain,
            };
            // the lifted foot swings forward a hand above the floor
            let lifted = (0.05 * side * libm::cos(phase)).max(0.0);
            parts.push(part(place(ahead + 0.03, SHOE), lifted, 0.07 + lifted, 0.03));
            parts.push(part(place(ahead, LEG), 0.07 + lifted, 0.5, self.albedo));
            parts.push(part(place(0.5 * ahead, LEG + 0.02), 0.5, 0.85, self.albedo));
        }
        let body = Outline::Round { x: self.x, y: self.y, radius: 0.2 };
        let pattern = Pattern::Plain;
        parts.push(Part { outline: body, low: 0.85, high: 1.7, thing: Thing::Person, albedo: 0.4, pattern });
        parts
    }

    /// How much of the light he leaves to a point of the floor, 0 to 1.
    pub(super) fn shade(&self, p: Vec3) -> f32 {
        let (dx, dy) = (p.x - self.x, p.y - self.y);
        let t = (1.0 - (dx * dx + dy * dy) * (1.0 / 0.36)).max(0.0);
        (1.0 - 0.6 * t * t) as f32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_person_goes_round_and_stays_within_his_radius() {
        let path = vec![(0.0, 0.0), (4.0, 0.0), (4.0, 3.0)];
        let person = Person { speed: 1.0, albedo: 0.2, path };
        assert_eq!((person.at(0.0).x, person.at(4.0).x, person.at(7.0).y), (0.0, 4.0, 3.0));
        assert!((person.at(12.5).x - 0.5).abs() < 1e-9 && person.at(1e9).x.is_finite());
        for step in 0..200 {
            let at = person.at(f64::from(step) * 0.1);
            for part in at.parts() {
                let Outline::Round { x, y, radius } = part.outline else { panic!("legs are round") };
                assert!((x - at.x).hypot(y - at.y) + radius < RADIUS + 0.02);
            }
        }
        let still = Person { speed: 1.0, albedo: 0.2, path: vec![(1.0, 1.0); 2] };
        assert_eq!((still.at(5.0).x, still.at(5.0).parts().len()), (1.0, 7));
    }
}
