//! What stands where: the walls of a plan, the pieces of its things, and what a ray or a robot meets.

use super::part::{Beam, Bounds, Part, Thing};
use super::people::{RADIUS, Standing};
use super::plan::{OpeningKind, Plan};
use crate::world::geometry::{Room, Solid, Vec3, Wall};
use crate::world::outline::outline;

/// Height of the robot's body in metres: what hovers lower is in its way.
pub const BODY_HEIGHT: f64 = 1.0;

/// Slack at the ends of walls, in metres, so that no ray slips through the crack between two of them.
const CRACK: f64 = 1e-7;

/// Floor, walls and things.
#[derive(Debug, Clone)]
pub(super) struct Space {
    pub(super) rooms: Vec<Room>,
    pub(super) walls: Vec<Wall>,
    /// The doors and panes of each wall.
    pub(super) openings: Vec<Vec<Leaf>>,
    pub(super) parts: Vec<Part>,
    /// Of which of the plan's things each part is.
    pub(super) items: Vec<usize>,
    /// The outlines of what stands around, to draw.
    pub(super) solids: Vec<Solid>,
    pub(super) ceiling: f64,
}

/// A door or pane in its wall.
#[derive(Debug, Clone, Copy)]
pub(super) struct Leaf {
    pub(super) kind: OpeningKind,
    /// Its middle along the wall.
    pub(super) along: f64,
    pub(super) width: f64,
    pub(super) albedo: f32,
}

/// Something a ray can meet before the floor, by its index.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Object {
    Wall(usize),
    Part(usize),
    /// A piece of somebody, among those of the moment.
    Walker(usize),
}

/// What is nearest to a point of the floor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Nearest {
    /// Distance in metres, at most the limit asked for.
    pub distance: f64,
    /// What it is; nothing within the limit gives none.
    pub thing: Option<Thing>,
    /// The point of it that is nearest; of somebody his middle.
    pub point: (f64, f64),
    /// Who it is if it is somebody: his place in [`Moment::people`](super::Moment::people).
    pub person: Option<usize>,
}

impl Space {
    pub(super) fn new(plan: &Plan) -> Space {
        let walls = outline(&plan.rooms);
        let mut openings = vec![Vec::new(); walls.len()];
        for opening in &plan.openings {
            if let Some(wall) = opening.wall(&walls) {
                openings[wall].push(Leaf {
                    kind: opening.kind,
                    along: if walls[wall].along_y { opening.y } else { opening.x },
                    width: opening.width,
                    albedo: opening.albedo as f32,
                });
            }
        }
        let of_items = plan
            .items
            .iter()
            .enumerate()
            .flat_map(|(i, item)| item.parts().into_iter().map(move |part| (part, i)));
        let (parts, items): (Vec<Part>, Vec<usize>) = of_items.unzip();
        let solids = parts.iter().filter(|part| part.low < BODY_HEIGHT);
        let solids = solids.map(|p| Solid { outline: p.outline, height: p.high.min(plan.ceiling) }).collect();
        Space { rooms: plan.rooms.clone(), walls, openings, parts, items, solids, ceiling: plan.ceiling }
    }

    /// The nearest point on the floor of a room, a little inside.
    pub(super) fn within(&self, x: f64, y: f64) -> Option<(f64, f64, f64)> {
        let inside = |room: &Room| {
            // rooms are 1 cm wide at least
            let near = 0.005;
            let (cx, cy) =
                (x.min(room.x.1 - near).max(room.x.0 + near), y.min(room.y.1 - near).max(room.y.0 + near));
            ((cx - x) * (cx - x) + (cy - y) * (cy - y), cx, cy)
        };
        self.rooms.iter().map(inside).min_by(|a, b| a.0.total_cmp(&b.0))
    }

    /// The box around an object.
    pub(super) fn bounds(&self, object: Object, walkers: &[Part]) -> Bounds {
        match object {
            Object::Part(i) => self.parts[i].bounds(),
            Object::Walker(i) => walkers[i].bounds(),
            Object::Wall(i) => {
                let wall = &self.walls[i];
                let z = (0.0, self.ceiling);
                if wall.along_y {
                    Bounds { x: (wall.at, wall.at), y: wall.span, z }
                } else {
                    Bounds { x: wall.span, y: (wall.at, wall.at), z }
                }
            }
        }
    }

    /// How far along a beam it meets an object, if it does before a limit.
    #[inline]
    pub(super) fn meet(&self, object: Object, walkers: &[Part], beam: &Beam, limit: f64) -> Option<f64> {
        let distance = match object {
            Object::Part(i) => self.parts[i].enter(beam)?,
            Object::Walker(i) => walkers[i].enter(beam)?,
            Object::Wall(i) => self.meet_wall(i, beam)?,
        };
        (distance < limit).then_some(distance)
    }

    #[inline]
    fn meet_wall(&self, i: usize, beam: &Beam) -> Option<f64> {
        let wall = &self.walls[i];
        let (step, other, slope) =
            if wall.along_y { (beam.d.x, beam.o.y, beam.d.y) } else { (beam.d.y, beam.o.x, beam.d.x) };
        if step * wall.facing >= 0.0 {
            return None;
        }
        let t = beam.meets(wall.along_y, wall.at);
        let along = other + slope * t;
        (t > 0.0 && along >= wall.span.0 - CRACK && along <= wall.span.1 + CRACK).then_some(t)
    }

    /// How far a level beam goes before it meets a wall or a part at its height, at most so far.
    pub(super) fn ahead(&self, walkers: &[Part], beam: &Beam, limit: f64) -> f64 {
        let walls = (0..self.walls.len()).filter_map(|i| self.meet_wall(i, beam));
        let parts = self.parts.iter().chain(walkers).filter_map(|part| part.enter(beam));
        walls.chain(parts).fold(limit, f64::min)
    }

    /// Distance along the floor from a point in a direction of length 1 to what the robot's body would meet.
    pub(super) fn range(&self, walkers: &[Standing], from: (f64, f64), way: (f64, f64), limit: f64) -> f64 {
        let beam = Beam::new(Vec3::new(from.0, from.1, 0.0), Vec3::new(way.0, way.1, 0.0));
        let walls = (0..self.walls.len()).filter_map(|i| self.meet_wall(i, &beam));
        let parts = self.parts.iter().filter(|p| p.low < BODY_HEIGHT).filter_map(|p| p.enter_flat(&beam));
        let people = walkers.iter().filter_map(|w| {
            let (px, py) = (from.0 - w.x, from.1 - w.y);
            let (b, c) = (px * way.0 + py * way.1, px * px + py * py - RADIUS * RADIUS);
            let root = b * b - c;
            match root {
                _ if c <= 0.0 => Some(0.0),
                r if r >= 0.0 && b < 0.0 => Some(-b - r.sqrt()),
                _ => None,
            }
        });
        walls.chain(parts).chain(people).fold(limit, f64::min)
    }

    /// What is nearest to a point of the floor and in the way of the robot's body.
    pub(super) fn nearest(&self, walkers: &[Standing], x: f64, y: f64, limit: f64) -> Nearest {
        let mut nearest = Nearest { distance: limit, thing: None, point: (x, y), person: None };
        let mut try_point = |thing, point: (f64, f64), person: Option<usize>| {
            let (dx, dy) = (point.0 - x, point.1 - y);
            let less = if person.is_some() { RADIUS } else { 0.0 };
            let distance = ((dx * dx + dy * dy).sqrt() - less).max(0.0);
            if distance < nearest.distance {
                nearest = Nearest { distance, thing: Some(thing), point, person };
            }
        };
        for wall in &self.walls {
            let along = if wall.along_y { y } else { x };
            try_point(Thing::Wall, wall.foot(along.clamp(wall.span.0, wall.span.1)), None);
        }
        for part in self.parts.iter().filter(|p| p.low < BODY_HEIGHT) {
            try_point(part.thing, part.nearest_point(x, y), None);
        }
        for (i, walker) in walkers.iter().enumerate() {
            try_point(Thing::Person, (walker.x, walker.y), Some(i));
        }
        nearest
    }
}
