//! What surfaces are made of: paint, doors and panes of walls, and what is drawn on things.

use super::part::{Part, Pattern, Thing};
use super::plan::{ItemKind, OpeningKind};
use super::space::Leaf;
use super::{Looks, Office};
use crate::world::geometry::{Vec3, Wall};
use crate::world::noise::smooth;

/// The place as far before a wall as another is behind it.
pub(super) fn mirrored(wall: &Wall, x: f64, y: f64) -> (f64, f64) {
    if wall.along_y { (2.0 * wall.at - x, y) } else { (x, 2.0 * wall.at - y) }
}

/// Albedo and gloss of a wall so far along its axis and at this height.
pub(super) fn paint(openings: &[Leaf], looks: &Looks, along: f64, z: f64) -> (f32, f32) {
    for opening in openings {
        let middle = opening.along;
        let inner = opening.width / 2.0 - (along - middle).abs();
        let albedo = opening.albedo;
        match opening.kind {
            OpeningKind::Door => {
                let inner = inner.min(2.05 - z);
                // a frame, a dark gap, the leaf with its handle
                let handle =
                    (z - 1.0).abs() < 0.03 && (along - middle - opening.width / 2.0 + 0.12).abs() < 0.06;
                match inner {
                    i if i < -0.06 => continue,
                    i if i < 0.0 => return (albedo * 0.6 + 0.1, 0.5 * looks.gloss),
                    i if i < 0.012 || z < 0.012 => return (0.02, 0.0),
                    _ if handle => return (0.7, 0.0),
                    _ => return (albedo, 0.6 * looks.gloss),
                }
            }
            OpeningKind::Glass => match inner {
                i if i < -0.05 => continue,
                i if i < 0.0 || z < 0.06 => return (0.12, 0.0),
                // glass mirrors well before what is dark behind it
                _ => return (albedo, 0.8),
            },
        }
    }
    if z < looks.skirting_height {
        // its upper edge catches the light
        let edge = z > looks.skirting_height - 0.012;
        return (if edge { looks.skirting * 1.8 } else { looks.skirting }, 0.3 * looks.gloss);
    }
    (looks.wall, looks.gloss)
}

impl Office {
    /// Albedo of a part at a point of its surface.
    pub(super) fn finish(&self, part: &Part, p: Vec3, n: Vec3) -> f32 {
        let z = (p.z - part.low) / (part.high - part.low);
        let bounds = part.bounds();
        let factor = match part.pattern {
            Pattern::Taped if n.z > 0.0 => {
                let middle = (bounds.y.0 + bounds.y.1) / 2.0;
                if (p.y - middle).abs() < 0.03 { 1.3 } else { 1.08 }
            }
            Pattern::Taped if (0.44..0.52).contains(&z) => 1.25,
            Pattern::Drawers if n.z == 0.0 => {
                let drawer = z * 3.0 - (z * 3.0).floor();
                let along = if n.x == 0.0 {
                    p.x - (bounds.x.0 + bounds.x.1) / 2.0
                } else {
                    p.y - (bounds.y.0 + bounds.y.1) / 2.0
                };
                match drawer {
                    d if d < 0.04 => 0.35,
                    d if (0.45..0.55).contains(&d) && along.abs() < 0.07 => 1.7,
                    _ => 1.0,
                }
            }
            // a bin is open
            Pattern::Rimmed if n.z > 0.0 => {
                let (dx, dy) = (p.x - (bounds.x.0 + bounds.x.1) / 2.0, p.y - (bounds.y.0 + bounds.y.1) / 2.0);
                let inner = 0.42 * (bounds.x.1 - bounds.x.0);
                if dx * dx + dy * dy < inner * inner && part.thing == Thing::Item(ItemKind::Bin) {
                    0.3
                } else {
                    1.8
                }
            }
            Pattern::Rimmed if z > 0.9 => 1.8,
            Pattern::Footed if p.z < 0.08 => 0.3,
            Pattern::Wood => {
                let vein = smooth(self.looks.seed, p.x * 3.0, p.y * 40.0) as f32;
                if n.z > 0.0 { 0.9 + 0.2 * vein } else { 0.5 }
            }
            Pattern::Leaves => {
                let spots = smooth(self.looks.seed, p.x * 25.0 + p.z * 19.0, p.y * 25.0);
                0.3 + 1.5 * (spots * spots) as f32
            }
            _ => 1.0,
        };
        (part.albedo as f32 * factor).min(0.95)
    }
}
