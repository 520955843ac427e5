//! People who walk: where they are at a time, and the pieces a ray can meet.

use super::part::{Part, Pattern, Thing};
use super::plan::Person;
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
        let corners = self.path.len();
        let side = |i: usize| {
            let (a, b) = (self.path[i], self.path[(i + 1) % corners]);
            let (dx, dy) = (b.0 - a.0, b.1 - a.1);
            (a, dx, dy, (dx * dx + dy * dy).sqrt())
        };
        let around: f64 = (0..corners).map(|i| side(i).3).sum();
        let walked = self.speed * seconds;
        let albedo = self.albedo;
        let mut rest = if around > 0.0 { walked - (walked / around).floor() * around } else { 0.0 };
        for i in 0..corners {
            let (from, dx, dy, length) = side(i);
            if length > 0.0 && (rest <= length || i + 1 == corners) {
                let part = (rest / length).clamp(0.0, 1.0);
                let way = (dy / length, dx / length);
                return Standing { x: from.0 + dx * part, y: from.1 + dy * part, way, walked, albedo };
            }
            rest -= length;
        }
        let (x, y) = self.path.first().copied().unwrap_or((0.0, 0.0));
        Standing { x, y, way: (0.0, 1.0), walked, albedo }
    }
}

impl Standing {
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
