//! Buildings made up from a seed: hallways in a ring, perhaps with one across or a spur, alcoves, an open office.

use super::super::Kind;
use super::furnish::{self, Hall};
use super::{Item, Light, Opening, OpeningKind, Person, Plan, Stripe};
use crate::world::geometry::Room;
use crate::world::noise::Stream;
use crate::world::office::BODY_HEIGHT;
use crate::world::outline::outline;

/// Distance of ceiling lights along a hallway, in metres.
const LIGHTS_APART: f64 = 3.1;
/// Distance that things keep from the middle of those who walk by, in metres, and from one place where this is looked
/// at to the next.
const KEPT: f64 = 0.26;
const PACE: f64 = 0.05;
/// How far aside of a hallway's middle people may walk, in metres.
const LANES: [f64; 7] = [0.0, 0.1, -0.1, 0.2, -0.2, 0.3, -0.3];

impl Plan {
    /// Another building of a kind. `unseen` adds things that the buildings trained on never hold: plants, suitcases,
    /// cones, open drawers.
    pub fn generate(kind: Kind, seed: u64, unseen: bool) -> Plan {
        let purpose = match kind {
            Kind::Nsh => 100,
            Kind::Fmrb => 200,
        };
        let stream = |k: u64| Stream::new(seed, purpose + k);
        let layout = Layout::new(&mut stream(1));
        let mut plan = Plan::empty(layout.rooms());
        plan.seed = stream(2).bits();
        looks(&mut plan, kind, &mut stream(3));
        furnish::furnish(&mut plan, &layout.halls, layout.open, unseen, &mut stream(4));
        openings(&mut plan, &mut stream(5));
        lights(&mut plan, kind, &layout, &mut stream(6));
        if kind == Kind::Nsh {
            stripe(&mut plan, &layout, &mut stream(7));
            people(&mut plan, &layout, &mut stream(8));
        }
        round(&mut plan);
        plan
    }
}

/// Hallways and what opens from them.
struct Layout {
    /// The four of the ring first: south, east, north, west.
    halls: Vec<Hall>,
    alcoves: Vec<Room>,
    open: Room,
}

impl Layout {
    fn new(stream: &mut Stream) -> Layout {
        let (long, wide) = (stream.range(15.0, 22.0), stream.range(9.5, 13.5));
        let mut width = || stream.range(1.65, 2.1);
        let (south, east, north, west) = (width(), width(), width(), width());
        let hall = |x: (f64, f64), y: (f64, f64), along_x: bool| Hall { room: Room { x, y }, along_x };
        let mut halls = vec![
            hall((0.0, long), (0.0, south), true),
            hall((long - east, long), (0.0, wide), false),
            hall((0.0, long), (wide - north, wide), true),
            hall((0.0, west), (0.0, wide), false),
        ];
        let across = stream.unit();
        if across < 0.4 {
            let (at, width) = (stream.range(0.4, 0.6) * long, stream.range(1.65, 2.0));
            halls.push(hall((at, at + width), (0.0, wide), false));
        } else if across < 0.75 {
            let (at, far) = (stream.range(0.3, 0.55) * wide, stream.range(3.5, 6.0));
            halls.push(hall((long - 0.5, long + far), (at, at + stream.range(1.65, 2.0)), true));
        }
        let (at, span) = (stream.range(0.15, 0.5) * long, stream.range(3.8, 5.2));
        let deep = stream.range(2.8, 3.8);
        let open = Room { x: (at, at + span), y: (wide - 0.1, wide + deep) };
        let mut alcoves = Vec::new();
        for hall in &halls[..2] {
            let (from, to) = hall.span();
            for _ in 0..3 {
                let (start, span) = (stream.range(from + 2.6, to - 4.4), stream.range(1.0, 1.8));
                let deep = stream.range(0.2, 1.1);
                let room = hall.room;
                alcoves.push(if hall.along_x {
                    Room { x: (start, start + span), y: (room.y.0 - deep, room.y.0 + 0.1) }
                } else {
                    Room { x: (room.x.1 - 0.1, room.x.1 + deep), y: (start, start + span) }
                });
            }
        }
        Layout { halls, alcoves, open }
    }

    fn rooms(&self) -> Vec<Room> {
        let halls = self.halls.iter().map(|hall| hall.room);
        halls.chain(self.alcoves.iter().copied()).chain([self.open]).collect()
    }
}

fn looks(plan: &mut Plan, kind: Kind, stream: &mut Stream) {
    let (carpet, wall) = match kind {
        Kind::Nsh => ((0.13, 0.19), (0.42, 0.58)),
        Kind::Fmrb => ((0.13, 0.18), (0.38, 0.55)),
    };
    plan.carpet = stream.range(carpet.0, carpet.1);
    plan.grain = stream.range(0.22, 0.4);
    plan.wall = stream.range(wall.0, wall.1);
    plan.gloss = stream.range(0.2, 0.5);
    // dark or light, but never as light as the carpet: people see where the wall begins
    let (skirting, height) = match kind {
        Kind::Nsh => ((0.02, 0.03), (0.13, 0.17)),
        Kind::Fmrb => ((0.5, 0.65), (0.08, 0.12)),
    };
    plan.skirting = stream.range(skirting.0, skirting.1);
    plan.skirting_height = stream.range(height.0, height.1);
}

/// Doors along every wall that is long enough, and a pane now and then.
fn openings(plan: &mut Plan, stream: &mut Stream) {
    let dark = stream.range(0.07, 0.11);
    let light = stream.range(0.42, 0.55);
    for wall in outline(&plan.rooms) {
        let mut at = wall.span.0 + stream.range(0.9, 2.0);
        while at + 0.9 < wall.span.1 {
            let kind = stream.unit();
            let (x, y) = wall.foot(at);
            if kind < 0.55 {
                let albedo = if stream.chance(0.6) { dark } else { light };
                plan.openings.push(Opening { kind: OpeningKind::Door, x, y, width: 0.9, albedo });
            } else if kind < 0.63 {
                plan.openings.push(Opening { kind: OpeningKind::Glass, x, y, width: 1.1, albedo: 0.06 });
            }
            at += stream.range(2.0, 4.5);
        }
    }
}

fn lights(plan: &mut Plan, kind: Kind, layout: &Layout, stream: &mut Stream) {
    // one long hallway is dark but for its ends
    let dark = (kind == Kind::Fmrb).then(|| if stream.chance(0.5) { 0 } else { 2 });
    for (i, hall) in layout.halls.iter().enumerate() {
        let (from, to) = hall.span();
        let count = ((to - from) / LIGHTS_APART).floor().max(1.0);
        for k in 0..count as u32 {
            let along = from + (f64::from(k) + 0.5) * (to - from) / count;
            let burned = dark == Some(i) && along > from + 2.5 && along < to - 5.0;
            let power = if burned || stream.chance(0.04) { 0.0 } else { stream.range(0.85, 1.1) };
            let (x, y) = hall.point(along, 0.0);
            let (width, depth) = if hall.along_x { (1.2, 0.3) } else { (0.3, 1.2) };
            plan.lights.push(Light { x, y, width, depth, power });
        }
    }
    let open = layout.open;
    for k in 0..2 {
        let at = |part: f64, (a, b): (f64, f64)| a + (b - a) * part;
        let (x, y, power) = (at(0.25 + 0.5 * f64::from(k), open.x), at(0.5, open.y), stream.range(0.85, 1.1));
        // an open office in front of a dark hallway is dark too
        let power = if dark == Some(2) { 0.0 } else { power };
        plan.lights.push(Light { x, y, width: 1.2, depth: 0.3, power });
    }
}

/// A wide stripe near one end of a hallway.
fn stripe(plan: &mut Plan, layout: &Layout, stream: &mut Stream) {
    let hall = layout.halls[stream.whole(0, 3) as usize];
    let (from, to) = hall.span();
    let wide = stream.range(1.2, 2.4);
    let at = if stream.chance(0.5) { from + 2.8 } else { to - 2.8 - wide };
    let Room { x, y } = hall.room;
    let room = if hall.along_x { Room { x: (at, at + wide), y } } else { Room { x, y: (at, at + wide) } };
    let albedo =
        if stream.chance(0.7) { stream.range(0.3, 0.42) } else { stream.range(0.5, 0.55) } * plan.carpet;
    plan.stripes.push(Stripe { room, albedo });
}

/// Some who go up and down a hallway, there and back side by side, where most is free; what is in their way goes.
fn people(plan: &mut Plan, layout: &Layout, stream: &mut Stream) {
    for hall in &layout.halls {
        for _ in 0..2 {
            let (from, to) = hall.span();
            let aside = stream.range(0.05, 0.2) * if stream.chance(0.5) { 1.0 } else { -1.0 };
            let (a, b) = (stream.range(from + 1.2, from + 4.0), stream.range(to - 4.0, to - 1.2));
            let path = |lane: f64| {
                let way = [(a, aside), (b, aside), (b, -aside), (a, -aside)];
                way.map(|(along, aside)| hall.point(along, lane + aside)).to_vec()
            };
            let in_way = |lane: &f64| plan.items.iter().filter(|item| is_in_way(item, &path(*lane))).count();
            // of several the first, hence that nearest to the middle
            let path = path(LANES.into_iter().min_by_key(in_way).unwrap_or(0.0));
            plan.items.retain(|item| !is_in_way(item, &path));
            let (speed, albedo) = (stream.range(0.5, 1.2), stream.range(0.04, 0.3));
            plan.people.push(Person { speed, albedo, path });
        }
    }
}

/// Whether somebody on this path would touch the thing.
fn is_in_way(item: &Item, path: &[(f64, f64)]) -> bool {
    let parts: Vec<_> = item.parts().into_iter().filter(|part| part.low < BODY_HEIGHT).collect();
    path.iter().zip(path.iter().cycle().skip(1)).any(|(a, b)| {
        let (dx, dy) = (b.0 - a.0, b.1 - a.1);
        let paces = ((dx * dx + dy * dy).sqrt() / PACE).ceil().max(1.0);
        (0..=paces as u32).any(|k| {
            let (x, y) = (a.0 + dx * f64::from(k) / paces, a.1 + dy * f64::from(k) / paces);
            parts.iter().any(|part| part.outline.distance(x, y) < KEPT)
        })
    })
}

/// To millimetres and thousandths, so that the text is short.
fn round(plan: &mut Plan) {
    let to = |v: &mut f64| *v = (*v * 1000.0).round() / 1000.0;
    let room = |r: &mut Room| [&mut r.x.0, &mut r.x.1, &mut r.y.0, &mut r.y.1].into_iter().for_each(to);
    [&mut plan.carpet, &mut plan.grain, &mut plan.wall, &mut plan.gloss].into_iter().for_each(to);
    [&mut plan.skirting, &mut plan.skirting_height].into_iter().for_each(to);
    plan.rooms.iter_mut().for_each(room);
    for stripe in &mut plan.stripes {
        room(&mut stripe.room);
        to(&mut stripe.albedo);
    }
    for o in &mut plan.openings {
        [&mut o.x, &mut o.y, &mut o.width, &mut o.albedo].into_iter().for_each(to);
    }
    for i in &mut plan.items {
        let all = [&mut i.x, &mut i.y, &mut i.width, &mut i.depth, &mut i.height, &mut i.albedo, &mut i.turn];
        all.into_iter().for_each(to);
    }
    for l in &mut plan.lights {
        [&mut l.x, &mut l.y, &mut l.width, &mut l.depth, &mut l.power].into_iter().for_each(to);
    }
    for p in &mut plan.people {
        [&mut p.speed, &mut p.albedo].into_iter().for_each(to);
        p.path.iter_mut().for_each(|(x, y)| [x, y].into_iter().for_each(to));
    }
}
