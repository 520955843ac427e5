//! Puts things along the walls of hallways and into an open office, always leaving a passage.

use super::{Item, ItemKind, Plan};
use crate::world::geometry::Room;
use crate::world::noise::Stream;

/// Free way beside anything that stands in a hallway, in metres.
const PASSAGE: f64 = 1.0;

/// A hallway and the axis it runs along.
#[derive(Debug, Clone, Copy)]
pub(super) struct Hall {
    pub(super) room: Room,
    pub(super) along_x: bool,
}

impl Hall {
    /// From where to where it runs.
    pub(super) fn span(&self) -> (f64, f64) {
        if self.along_x { self.room.x } else { self.room.y }
    }

    fn width(&self) -> f64 {
        let (a, b) = if self.along_x { self.room.y } else { self.room.x };
        b - a
    }

    /// The point so far along and so far aside from its middle.
    pub(super) fn point(&self, along: f64, aside: f64) -> (f64, f64) {
        let middle = |(a, b): (f64, f64)| (a + b) / 2.0;
        if self.along_x { (along, middle(self.room.y) + aside) } else { (middle(self.room.x) + aside, along) }
    }

    /// A thing so long along the hallway and so deep, at a wall of it or before that wall.
    fn at_wall(&self, kind: ItemKind, along: f64, side: f64, gap: f64, size: (f64, f64, f64)) -> Item {
        let (long, deep, height) = size;
        let (x, y) = self.point(along, side * (self.width() / 2.0 - gap - deep / 2.0));
        let (width, depth) = if self.along_x { (long, deep) } else { (deep, long) };
        Item { kind, x, y, width, depth, height, albedo: 0.3, turn: 0.0 }
    }
}

pub(super) fn furnish(plan: &mut Plan, halls: &[Hall], open: Room, unseen: bool, stream: &mut Stream) {
    for hall in halls {
        let (from, to) = hall.span();
        let mut at = from + stream.range(2.9, 4.2);
        while at < to - 2.9 {
            if let Some(item) = beside(hall, at, unseen, stream) {
                // hallways cross and open into each other: nothing stands in the middle of another one
                let free = |other: &&Hall| other.room == hall.room || !near(&other.room, &item, 0.7);
                if halls.iter().all(|other| free(&other)) {
                    plan.items.push(item);
                }
            }
            at += stream.range(1.6, 3.4);
        }
    }
    desks(plan, open, unseen, stream);
}

fn near(room: &Room, item: &Item, margin: f64) -> bool {
    let (hx, hy) = (item.width / 2.0 + margin, item.depth / 2.0 + margin);
    item.x + hx > room.x.0 && item.x - hx < room.x.1 && item.y + hy > room.y.0 && item.y - hy < room.y.1
}

/// Something at a wall of a hallway, if there is room for it.
fn beside(hall: &Hall, along: f64, unseen: bool, stream: &mut Stream) -> Option<Item> {
    let side = if stream.chance(0.5) { 1.0 } else { -1.0 };
    let most = hall.width() - PASSAGE;
    let (kind, gap, a, b, c) =
        (stream.unit(), stream.range(0.0, 0.1), stream.unit(), stream.unit(), stream.unit());
    let between = |part: f64, low: f64, high: f64| low + (high - low) * part;
    let new = unseen && stream.chance(0.55);
    let (kind, long, deep, height, albedo) = match kind {
        k if new && k < 0.3 => {
            let size = between(a, 0.45, 0.75);
            (ItemKind::Plant, size, size, between(b, 0.6, 1.3), between(c, 0.15, 0.4))
        }
        k if new && k < 0.55 => {
            (ItemKind::Suitcase, between(a, 0.35, 0.5), 0.26, between(b, 0.5, 0.7), between(c, 0.05, 0.35))
        }
        k if new && k < 0.8 => (ItemKind::Cone, 0.36, 0.36, between(a, 0.4, 0.65), 0.42),
        _ if new => {
            (ItemKind::Drawer, between(a, 0.4, 0.5), 0.5, between(b, 0.65, 0.9), between(c, 0.2, 0.5))
        }
        k if k < 0.3 => (
            ItemKind::Box,
            between(a, 0.3, 0.7),
            between(b, 0.3, 0.6),
            between(c, 0.25, 0.8),
            between(a, 0.42, 0.58),
        ),
        k if k < 0.5 => {
            let size = between(a, 0.26, 0.38);
            (ItemKind::Bin, size, size, between(b, 0.3, 0.6), between(c, 0.06, 0.16))
        }
        k if k < 0.72 => (ItemKind::Chair, 0.42, 0.42, between(a, 0.8, 0.95), between(b, 0.06, 0.25)),
        k if k < 0.86 => (
            ItemKind::Cabinet,
            between(a, 0.45, 0.9),
            between(b, 0.35, 0.5),
            between(c, 0.7, 1.5),
            if b < 0.4 { between(b, 0.08, 0.12) } else { between(b, 0.45, 0.6) },
        ),
        k if k < 0.93 => (
            ItemKind::Table,
            between(a, 0.9, 1.4),
            between(b, 0.5, 0.7),
            between(c, 0.68, 0.74),
            between(a, 0.25, 0.5),
        ),
        _ => {
            let size = between(a, 0.3, 0.45);
            (ItemKind::Pillar, size, size, 2.6, between(b, 0.45, 0.6))
        }
    };
    // chairs and round things stand a little before the wall
    let gap =
        if matches!(kind, ItemKind::Chair | ItemKind::Plant | ItemKind::Cone) { gap + 0.06 } else { gap };
    if gap + deep > most {
        return None;
    }
    let mut item = hall.at_wall(kind, along, side, gap, (long, deep, height));
    item.albedo = albedo;
    item.turn = match (kind, hall.along_x) {
        (ItemKind::Chair, _) => between(a, 0.0, 360.0),
        // the drawer opens along the hallway
        (ItemKind::Drawer, true) => {
            if b < 0.5 {
                0.0
            } else {
                180.0
            }
        }
        (ItemKind::Drawer, false) => {
            if b < 0.5 {
                90.0
            } else {
                -90.0
            }
        }
        _ => 0.0,
    };
    Some(item)
}

/// Desks with chairs along the far wall of an open office, a cabinet and a bin.
fn desks(plan: &mut Plan, open: Room, unseen: bool, stream: &mut Stream) {
    let mut at = open.x.0 + 0.9;
    while at < open.x.1 - 0.9 {
        let height = stream.range(0.70, 0.74);
        let (x, y) = (at, open.y.1 - 0.42);
        let albedo = stream.range(0.3, 0.5);
        let table = Item { kind: ItemKind::Table, x, y, width: 1.4, depth: 0.7, height, albedo, turn: 0.0 };
        plan.items.push(table);
        let turn = stream.range(0.0, 360.0);
        let (x, y) = (at + stream.range(-0.3, 0.3), open.y.1 - stream.range(0.95, 1.3));
        let chair =
            Item { kind: ItemKind::Chair, x, y, width: 0.44, depth: 0.44, height: 0.9, albedo: 0.09, turn };
        plan.items.push(chair);
        at += stream.range(1.9, 2.6);
    }
    let kind = if unseen { ItemKind::Drawer } else { ItemKind::Cabinet };
    let (x, y) = (open.x.0 + 0.25, open.y.0 + stream.range(1.2, 1.8));
    plan.items.push(Item { kind, x, y, width: 0.45, depth: 0.8, height: 1.1, albedo: 0.5, turn: 0.0 });
    let kind = if unseen { ItemKind::Plant } else { ItemKind::Bin };
    let (x, y) = (open.x.1 - 0.4, open.y.0 + stream.range(1.0, 1.6));
    plan.items.push(Item { kind, x, y, width: 0.36, depth: 0.36, height: 0.45, albedo: 0.1, turn: 0.0 });
}
