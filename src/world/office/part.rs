//! What rays meet besides floor and walls: boxes and cylinders between two heights, and how a ray enters them.

use super::plan::{Item, ItemKind};
use crate::world::geometry::{Outline, Room, Vec3};

/// What a robot can run into.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Thing {
    /// A wall or a door in it.
    Wall,
    /// Something that stands around: any part of it, be it a leg, a back or an open drawer.
    Item(ItemKind),
    /// Somebody.
    Person,
}

impl std::fmt::Display for Thing {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Thing::Wall => f.write_str("wall"),
            Thing::Item(kind) => kind.fmt(f),
            Thing::Person => f.write_str("person"),
        }
    }
}

/// What is drawn on a part.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Pattern {
    /// One tone.
    Plain,
    /// Cardboard with a strip of tape.
    Taped,
    /// Drawers with gaps between them, and handles.
    Drawers,
    /// A lighter rim.
    Rimmed,
    /// A dark foot.
    Footed,
    /// A wooden top with a dark edge.
    Wood,
    /// Leaves, light and dark.
    Leaves,
}

/// A piece of a thing: an upright box or cylinder between two heights.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Part {
    /// Seen from above.
    pub outline: Outline,
    /// Height of its lower end above the floor, in metres: 0 where it stands, more where it hovers.
    pub low: f64,
    /// Height of its upper end.
    pub high: f64,
    /// Of what it is a part.
    pub thing: Thing,
    pub(super) albedo: f64,
    pub(super) pattern: Pattern,
}

/// A ray with what the intersections need again and again.
#[derive(Debug, Clone, Copy)]
pub(super) struct Beam {
    pub(super) o: Vec3,
    pub(super) d: Vec3,
    inverse: Vec3,
    /// Squared length of its shadow on the floor.
    pub(super) flat: f64,
}

impl Beam {
    pub(super) fn new(o: Vec3, d: Vec3) -> Beam {
        let inverse = Vec3::new(1.0 / d.x, 1.0 / d.y, 1.0 / d.z);
        Beam { o, d, inverse, flat: d.x * d.x + d.y * d.y }
    }

    /// Where it meets the plane across x (or y) at a coordinate.
    pub(super) fn meets(&self, across_x: bool, at: f64) -> f64 {
        if across_x { (at - self.o.x) * self.inverse.x } else { (at - self.o.y) * self.inverse.y }
    }

    /// Between which distances it is above an outline, if ever.
    fn span(&self, outline: &Outline) -> Option<(f64, f64)> {
        let (near, far) = match *outline {
            Outline::Box(Room { x, y }) => {
                let (ax, bx) = (self.meets(true, x.0), self.meets(true, x.1));
                let (ay, by) = (self.meets(false, y.0), self.meets(false, y.1));
                (ax.min(bx).max(ay.min(by)), ax.max(bx).min(ay.max(by)))
            }
            Outline::Round { x, y, radius } => {
                let (px, py) = (self.o.x - x, self.o.y - y);
                let b = px * self.d.x + py * self.d.y;
                let c = px * px + py * py - radius * radius;
                if self.flat == 0.0 {
                    return (c <= 0.0).then_some((f64::NEG_INFINITY, f64::INFINITY));
                }
                let root = b * b - self.flat * c;
                if root < 0.0 {
                    return None;
                }
                let root = root.sqrt();
                ((-b - root) / self.flat, (-b + root) / self.flat)
            }
        };
        (near <= far && far > 0.0).then_some((near, far))
    }
}

impl Part {
    /// How far along the beam it is entered: 0 if the beam starts inside.
    #[inline]
    pub(super) fn enter(&self, beam: &Beam) -> Option<f64> {
        let (near, far) = beam.span(&self.outline)?;
        let (low, high) = ((self.low - beam.o.z) * beam.inverse.z, (self.high - beam.o.z) * beam.inverse.z);
        if beam.d.z == 0.0 {
            return (self.low <= beam.o.z && beam.o.z <= self.high).then_some(near.max(0.0));
        }
        let (near, far) = (near.max(low.min(high)), far.min(low.max(high)));
        (near <= far && far > 0.0).then_some(near.max(0.0))
    }

    /// The same of a beam along the floor, whatever the heights.
    pub(super) fn enter_flat(&self, beam: &Beam) -> Option<f64> {
        beam.span(&self.outline).map(|(near, _)| near.max(0.0))
    }

    /// The normal at a point of its surface.
    pub(super) fn normal(&self, p: Vec3, from: Vec3) -> Vec3 {
        let slack = 1e-6;
        if from.z > self.high && p.z >= self.high - slack {
            return Vec3::new(0.0, 0.0, 1.0);
        }
        if from.z < self.low && p.z <= self.low + slack {
            return Vec3::new(0.0, 0.0, -1.0);
        }
        match self.outline {
            Outline::Round { x, y, radius } => Vec3::new((p.x - x) / radius, (p.y - y) / radius, 0.0),
            Outline::Box(Room { x, y }) => {
                let sides = [
                    (p.x - x.0, Vec3::new(-1.0, 0.0, 0.0)),
                    (x.1 - p.x, Vec3::new(1.0, 0.0, 0.0)),
                    (p.y - y.0, Vec3::new(0.0, -1.0, 0.0)),
                    (y.1 - p.y, Vec3::new(0.0, 1.0, 0.0)),
                ];
                let nearest = sides.iter().min_by(|a, b| a.0.abs().total_cmp(&b.0.abs()));
                nearest.map_or(Vec3::new(0.0, 0.0, 1.0), |side| side.1)
            }
        }
    }

    /// The box around it.
    pub(super) fn bounds(&self) -> Bounds {
        let (x, y) = match self.outline {
            Outline::Box(Room { x, y }) => (x, y),
            Outline::Round { x, y, radius } => ((x - radius, x + radius), (y - radius, y + radius)),
        };
        Bounds { x, y, z: (self.low, self.high) }
    }

    /// The point of its outline that is nearest to a point of the floor.
    pub(super) fn nearest_point(&self, x: f64, y: f64) -> (f64, f64) {
        match self.outline {
            Outline::Box(room) => (x.clamp(room.x.0, room.x.1), y.clamp(room.y.0, room.y.1)),
            Outline::Round { x: cx, y: cy, radius } => {
                let (dx, dy) = (x - cx, y - cy);
                let length = (dx * dx + dy * dy).sqrt();
                if length <= radius {
                    return (x, y);
                }
                (cx + dx * radius / length, cy + dy * radius / length)
            }
        }
    }
}

/// A box that something is in.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Bounds {
    pub(super) x: (f64, f64),
    pub(super) y: (f64, f64),
    pub(super) z: (f64, f64),
}

/// Height that pillars are given: above every ceiling.
const UP: f64 = 10.0;

impl Item {
    /// Its pieces.
    pub(super) fn parts(&self) -> Vec<Part> {
        let thing = Thing::Item(self.kind);
        let (half_x, half_y) = (self.width / 2.0, self.depth / 2.0);
        let mut parts = Vec::new();
        let mut add = |outline, low, high, albedo, pattern| {
            parts.push(Part { outline, low, high, thing, albedo, pattern });
        };
        let whole = self.rectangle((-half_x, half_x), (-half_y, half_y));
        let top = self.height;
        match self.kind {
            ItemKind::Box => add(whole, 0.0, top, self.albedo, Pattern::Taped),
            ItemKind::Cabinet => add(whole, 0.0, top, self.albedo, Pattern::Drawers),
            ItemKind::Table => {
                let leg = 0.025;
                for (sx, sy) in [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)] {
                    let (x, y) = (sx * (half_x - 0.06), sy * (half_y - 0.06));
                    let outline = self.rectangle((x - leg, x + leg), (y - leg, y + leg));
                    add(outline, 0.0, top - 0.03, 0.1, Pattern::Plain);
                }
                add(whole, top - 0.03, top, self.albedo, Pattern::Wood);
            }
            ItemKind::Chair => {
                let seat = (0.5 * top).min(0.46);
                let (deep, wide) = (half_x * 0.8, half_y * 0.8);
                for (ahead, left) in [(-deep, -wide), (deep, -wide), (-deep, wide), (deep, wide)] {
                    let up = if ahead < 0.0 { top } else { seat };
                    add(self.round(ahead, left, 0.014), 0.0, up, 0.12, Pattern::Plain);
                }
                add(self.round(0.0, 0.0, half_x), seat - 0.05, seat, self.albedo, Pattern::Plain);
                for step in [-0.66, -0.33, 0.0, 0.33, 0.66] {
                    let slat = self.round(-deep, step * wide, 0.17 * wide);
                    add(slat, seat + 0.16, top, self.albedo, Pattern::Plain);
                }
            }
            ItemKind::Bin => add(self.round(0.0, 0.0, half_x), 0.0, top, self.albedo, Pattern::Rimmed),
            ItemKind::Pillar => add(self.round(0.0, 0.0, half_x), 0.0, UP, self.albedo, Pattern::Footed),
            ItemKind::Plant => {
                let pot = 0.35 * top;
                add(self.round(0.0, 0.0, 0.55 * half_x), 0.0, pot, self.albedo, Pattern::Rimmed);
                add(self.round(0.0, 0.0, 0.1 * half_x), pot, top * 0.55, 0.1, Pattern::Plain);
                add(self.round(0.0, 0.0, half_x), top * 0.55, top, 0.14, Pattern::Leaves);
            }
            ItemKind::Suitcase => {
                add(whole, 0.04, top, self.albedo, Pattern::Rimmed);
                for (sx, sy) in [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)] {
                    let (x, y) = (sx * (half_x - 0.03), sy * (half_y - 0.03));
                    add(self.round(x, y, 0.02), 0.0, 0.04, 0.05, Pattern::Plain);
                }
            }
            ItemKind::Cone => {
                add(whole, 0.0, 0.03, self.albedo * 0.6, Pattern::Plain);
                for step in 0..6 {
                    let up = f64::from(step) / 6.0;
                    let outline = self.round(0.0, 0.0, half_x * (0.75 - 0.6 * up));
                    let (low, high) = (0.03 + (top - 0.03) * up, 0.03 + (top - 0.03) * (up + 1.0 / 6.0));
                    let light = if step % 3 == 2 { 0.8 } else { self.albedo };
                    add(outline, low, high, light, Pattern::Plain);
                }
            }
            ItemKind::Drawer => {
                add(whole, 0.0, top, self.albedo, Pattern::Drawers);
                let (sin, cos) = quarter(self.turn);
                let out = 0.35;
                let reach = |half: f64, way: f64| match way {
                    w if w > 0.0 => (half, half + out),
                    w if w < 0.0 => (-half - out, -half),
                    _ => (-half * 0.9, half * 0.9),
                };
                let open = self.rectangle(reach(half_x, cos), reach(half_y, sin));
                let low = 0.45 * top;
                add(open, low, low + 0.3 * top, self.albedo * 0.9, Pattern::Plain);
            }
        }
        parts
    }

    fn rectangle(&self, x: (f64, f64), y: (f64, f64)) -> Outline {
        Outline::Box(Room { x: (self.x + x.0, self.x + x.1), y: (self.y + y.0, self.y + y.1) })
    }

    /// A circle so far ahead and to the left of the centre, turned with the thing.
    fn round(&self, ahead: f64, left: f64, radius: f64) -> Outline {
        let (sin, cos) = libm::sincos(self.turn * (std::f64::consts::PI / 180.0));
        Outline::Round { x: self.x + ahead * cos - left * sin, y: self.y + ahead * sin + left * cos, radius }
    }
}

/// Sine and cosine of the nearest quarter turn.
fn quarter(turn: f64) -> (f64, f64) {
    let quarters = [(0.0, 1.0), (1.0, 0.0), (0.0, -1.0), (-1.0, 0.0)];
    let turn = (turn / 90.0).round() as i64;
    quarters[turn.rem_euclid(4) as usize]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table() -> Vec<Part> {
        let kind = ItemKind::Table;
        Item { kind, x: 2.0, y: 0.0, width: 1.0, depth: 0.6, height: 0.7, albedo: 0.4, turn: 0.0 }.parts()
    }

    #[test]
    fn rays_pass_below_a_table_and_meet_its_top_from_above() {
        let first = |o: Vec3, d: Vec3| {
            let beam = Beam::new(o, d);
            table().iter().filter_map(|p| p.enter(&beam)).fold(f64::INFINITY, f64::min)
        };
        let ahead = Vec3::new(1.0, 0.0, 0.0);
        assert_eq!(first(Vec3::new(0.0, 0.0, 0.3), ahead), f64::INFINITY, "between the legs");
        assert!((first(Vec3::new(0.0, 0.24, 0.3), ahead) - 1.535).abs() < 1e-12, "a leg");
        assert!((first(Vec3::new(0.0, 0.0, 0.68), ahead) - 1.5).abs() < 1e-12, "the edge of the top");
        let down = Vec3::new(0.0, 0.0, -1.0);
        assert!((first(Vec3::new(2.0, 0.0, 1.0), down) - 0.3).abs() < 1e-12, "the top");
        assert_eq!(first(Vec3::new(2.0, 0.0, 0.5), down), f64::INFINITY, "below the top");
        assert_eq!(first(Vec3::new(2.0, 0.0, 0.69), ahead), 0.0, "inside of it");
    }

    #[test]
    fn normals_point_at_the_viewer() {
        let top = table()[4];
        assert_eq!(top.normal(Vec3::new(2.0, 0.1, 0.7), Vec3::new(0.0, 0.0, 1.0)), Vec3::new(0.0, 0.0, 1.0));
        assert_eq!(
            top.normal(Vec3::new(1.5, 0.1, 0.69), Vec3::new(0.0, 0.0, 0.69)),
            Vec3::new(-1.0, 0.0, 0.0)
        );
    }
}
