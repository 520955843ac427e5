//! A building made up from a seed: legs of corridor that meet at right angles, with recesses, doors, things that
//! stand around, lights (some burned out) and the looks of its surfaces.
//!
//! ```
//! use vsonar::world::building::Building;
//! let building = Building::new(1);
//! let leg = building.legs[0];
//! assert!(leg.length() > 4.0);
//! // the middle of a corridor's axis can be walked on
//! let (x, y) = leg.point(leg.length() / 2.0, 0.0);
//! assert!(building.geometry.clearance(x, y, 1.0) > 0.2);
//! ```

use super::geometry::{Geometry, Outline, Room, Solid, Wall};
use super::light::Panel;
use super::noise::Stream;
use super::texture::{Finish, Looks, Pattern};

/// Height of the ceiling in metres.
const CEILING: f64 = 2.6;
/// Distance of ceiling lights along a leg, in metres.
const LIGHTS_APART: f64 = 2.4;
/// Free way beside anything that stands around, in metres.
const PASSAGE: f64 = 0.85;

/// A straight piece of corridor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Leg {
    /// Start of its axis.
    pub from: (f64, f64),
    /// Direction: (1, 0), (0, 1) or (0, -1).
    pub heading: (f64, f64),
    /// Length of its axis in metres.
    length: f64,
    /// Width in metres.
    pub width: f64,
}

impl Leg {
    /// Length of the axis in metres.
    pub fn length(&self) -> f64 {
        self.length
    }

    /// The point so far along the axis and so far to the left of it.
    pub fn point(&self, along: f64, left: f64) -> (f64, f64) {
        let (hx, hy) = self.heading;
        (self.from.0 + hx * along - hy * left, self.from.1 + hy * along + hx * left)
    }

    /// The rectangle between two places along the axis and two to the left of it.
    fn room(&self, along: (f64, f64), left: (f64, f64)) -> Room {
        let (a, b) = (self.point(along.0, left.0), self.point(along.1, left.1));
        Room { x: (a.0.min(b.0), a.0.max(b.0)), y: (a.1.min(b.1), a.1.max(b.1)) }
    }
}

/// A door in a wall.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Door {
    /// Its extent along the wall.
    pub span: (f64, f64),
    /// Its height in metres.
    pub height: f64,
    /// How light its leaf is.
    pub albedo: f64,
}

/// All there is to see, apart from the camera.
#[derive(Debug, Clone)]
pub struct Building {
    /// The corridor's legs, each starting where the one before ends.
    pub legs: Vec<Leg>,
    /// The free floor.
    pub rooms: Vec<Room>,
    /// What rays meet.
    pub geometry: Geometry,
    /// The doors of each wall.
    pub doors: Vec<Vec<Door>>,
    /// The finish of each solid.
    pub finishes: Vec<Finish>,
    /// The ceiling lights that burn.
    pub panels: Vec<Panel>,
    /// The looks of floor and walls.
    pub looks: Looks,
}

impl Building {
    /// The building of a seed.
    pub fn new(seed: u64) -> Building {
        let legs = legs(&mut Stream::new(seed, 1));
        let rooms = rooms(&legs, &mut Stream::new(seed, 2));
        let (solids, finishes) = solids(&legs, &mut Stream::new(seed, 3));
        let geometry = Geometry::new(&rooms, solids, CEILING);
        let stream = &mut Stream::new(seed, 4);
        let doors = geometry.walls().iter().map(|wall| doors(wall, stream)).collect();
        let panels = panels(&legs, &mut Stream::new(seed, 5));
        let looks = looks(&legs, &mut Stream::new(seed, 6));
        Building { legs, rooms, geometry, doors, finishes, panels, looks }
    }
}

/// Legs along x take turns with legs along y; as x only grows, the corridor cannot meet itself.
fn legs(stream: &mut Stream) -> Vec<Leg> {
    let mut legs: Vec<Leg> = Vec::new();
    let mut from = (0.0, 0.0);
    for i in 0..4 {
        let heading = match (i % 2, stream.chance(0.5)) {
            (0, _) => (1.0, 0.0),
            (_, true) => (0.0, 1.0),
            (_, false) => (0.0, -1.0),
        };
        let leg = Leg { from, heading, length: stream.range(6.5, 10.5), width: stream.range(1.7, 2.7) };
        from = leg.point(leg.length, 0.0);
        legs.push(leg);
    }
    legs
}

fn rooms(legs: &[Leg], stream: &mut Stream) -> Vec<Room> {
    let mut rooms = Vec::new();
    for (i, leg) in legs.iter().enumerate() {
        // a leg reaches to the far walls of its neighbours, so that corners are whole
        let before = if i == 0 { 0.8 } else { legs[i - 1].width / 2.0 };
        let after = legs.get(i + 1).map_or(0.8, |next| next.width / 2.0);
        let half = leg.width / 2.0;
        rooms.push(leg.room((-before, leg.length + after), (-half, half)));
        for side in [-1.0, 1.0] {
            if stream.chance(0.75) {
                let at = stream.range(2.2, leg.length - 3.4);
                let (wide, deep) = (stream.range(1.0, 1.5), stream.range(0.15, 0.9));
                rooms.push(leg.room((at, at + wide), (side * (half - 0.05), side * (half + deep))));
            }
        }
    }
    rooms
}

/// Things along the walls of every leg, and now and then in the way, always leaving a passage.
fn solids(legs: &[Leg], stream: &mut Stream) -> (Vec<Solid>, Vec<Finish>) {
    let (mut solids, mut finishes): (Vec<Solid>, Vec<Finish>) = Default::default();
    for leg in legs {
        for slot in 0..4 {
            let at = leg.length * (0.12 + 0.2 * f64::from(slot) + stream.range(0.0, 0.12));
            let side = if stream.chance(0.5) { 1.0 } else { -1.0 };
            let most = leg.width - PASSAGE;
            let kind = stream.unit();
            let gap = stream.range(0.0, 0.12);
            let dark = stream.range(0.06, 0.18);
            let light = stream.range(0.3, 0.6);
            let (outline, height, finish) = if kind < 0.45 {
                let deep = stream.range(0.3, 0.7).min(most - gap);
                let wide = stream.range(0.3, 0.9);
                let inner = leg.width / 2.0 - gap;
                let room = leg.room((at, at + wide), (side * inner, side * (inner - deep)));
                (
                    Outline::Box(room),
                    stream.range(0.25, 1.1),
                    Finish { albedo: light, pattern: Pattern::Taped },
                )
            } else if kind < 0.7 {
                let radius = stream.range(0.13, 0.2);
                let (x, y) = leg.point(at, side * (leg.width / 2.0 - gap - radius));
                let outline = Outline::Round { x, y, radius };
                (outline, stream.range(0.3, 0.6), Finish { albedo: dark, pattern: Pattern::Rimmed })
            } else if kind < 0.85 {
                let radius = stream.range(0.12, 0.2);
                let (x, y) = leg.point(at, side * (leg.width / 2.0 - radius - 0.1));
                let outline = Outline::Round { x, y, radius };
                (outline, CEILING, Finish { albedo: light, pattern: Pattern::Footed })
            } else {
                let size = stream.range(0.25, 0.45);
                let inner = leg.width / 2.0 - PASSAGE;
                let room = leg.room((at, at + size), (side * inner, side * (inner - size)));
                let albedo = if stream.chance(0.5) { dark } else { light };
                (Outline::Box(room), stream.range(0.2, 0.9), Finish { albedo, pattern: Pattern::Taped })
            };
            solids.push(Solid { outline, height });
            finishes.push(finish);
        }
    }
    (solids, finishes)
}

fn doors(wall: &Wall, stream: &mut Stream) -> Vec<Door> {
    let mut doors = Vec::new();
    let albedo = stream.range(0.12, 0.5);
    let mut at = wall.span.0 + stream.range(0.15, 1.2);
    while at + 1.05 < wall.span.1 {
        if stream.chance(0.6) {
            doors.push(Door { span: (at, at + 0.9), height: 2.05, albedo });
        }
        at += stream.range(1.3, 3.5);
    }
    doors
}

fn panels(legs: &[Leg], stream: &mut Stream) -> Vec<Panel> {
    // one leg has a burned-out stretch, longer than the reach of a light
    let dark = stream.whole(0, legs.len() as u32 - 1) as usize;
    let mut panels = Vec::new();
    for (i, leg) in legs.iter().enumerate() {
        let count = (leg.length / LIGHTS_APART).floor() as u32;
        let burned = stream.range(0.1, 0.4) * leg.length;
        for k in 0..count {
            let along = (f64::from(k) + 0.5) * leg.length / f64::from(count);
            let power = stream.range(0.75, 1.15);
            if i == dark && along > burned && along < burned + 5.0 {
                continue;
            }
            let (x, y) = leg.point(along, 0.0);
            let half = if leg.heading.0 != 0.0 { (0.6, 0.15) } else { (0.15, 0.6) };
            panels.push(Panel { x, y, z: CEILING, half, power });
        }
    }
    panels
}

fn looks(legs: &[Leg], stream: &mut Stream) -> Looks {
    let striped = legs[stream.whole(0, legs.len() as u32 - 1) as usize];
    let at = stream.range(0.55, 0.8) * striped.length;
    let wide = stream.range(0.7, 1.4);
    let half = striped.width / 2.0;
    let carpet = stream.range(0.10, 0.24);
    Looks {
        seed: stream.bits(),
        carpet,
        carpet_contrast: stream.range(0.15, 0.4),
        stripe: striped.room((at, at + wide), (-half, half)),
        stripe_albedo: if stream.chance(0.5) { carpet * 0.5 } else { carpet * 1.9 },
        wall: stream.range(0.45, 0.75),
        skirting: if stream.chance(0.75) { stream.range(0.03, 0.08) } else { stream.range(0.4, 0.55) },
        skirting_height: stream.range(0.06, 0.12),
        gloss: stream.range(0.05, 0.35),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::geometry::{Ray, Vec3};

    #[test]
    fn every_building_is_closed_and_passable() {
        for seed in 0..50 {
            let building = Building::new(seed);
            assert_eq!(building.doors.len(), building.geometry.walls().len());
            assert_eq!(building.finishes.len(), building.geometry.solids().len());
            for leg in &building.legs {
                for step in 0..20 {
                    let along = leg.length() * (f64::from(step) + 0.5) / 20.0;
                    // somewhere across the corridor a robot of 0.4 m gets through
                    let widest = (-20..=20)
                        .map(|i| leg.point(along, f64::from(i) * 0.05))
                        .map(|(x, y)| building.geometry.clearance(x, y, 1.0))
                        .fold(0.0, f64::max);
                    assert!(widest > 0.2, "seed {seed}: {widest} at {along}");
                    let (x, y) = leg.point(along, 0.0);
                    let origin = Vec3::new(x, y, 0.5);
                    for k in 0..64 {
                        let (sin, cos) = libm::sincos(f64::from(k) * 0.1);
                        let hit =
                            building.geometry.cast(&Ray { origin, direction: Vec3::new(cos, sin, -0.01) });
                        let inside = building.rooms.iter().any(|r| {
                            r.contains(hit.point.x, hit.point.y)
                                || r.contains(
                                    hit.point.x + hit.normal.x * 1e-6,
                                    hit.point.y + hit.normal.y * 1e-6,
                                )
                        });
                        assert!(inside, "seed {seed}: {hit:?} is outside");
                    }
                }
            }
        }
    }
}
