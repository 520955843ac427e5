//! One look: which objects each part of the picture can meet, what its rays meet, and the light they bring.

use super::light::AMBIENT;
use super::part::{Beam, Part, Pattern, Thing};
use super::people::Standing;
use super::plan::ItemKind;
use super::plan::{Light, OpeningKind};
use super::rig::{Eye, Rig};
use super::shadow::OwnShadow;
use super::space::{Leaf, Object};
use super::{Moment, Office, Place};
use crate::world::geometry::{Vec3, Wall};

/// Pixels between the points at which the robot's shadow is computed.
const LATTICE: usize = 4;
/// Light of a panel of power 1 that one looks into; albedo of the ceiling, and the share of the floor's light that
/// comes up to it.
const PANEL: f32 = 6.0;
const CEILING: f32 = 0.7;
const UPWARDS: f32 = 0.25;

/// What the camera sees from a place at a time.
pub(super) struct Sight<'a> {
    office: &'a Office,
    eye: Eye,
    /// The middle of the robot's body on the floor.
    body: (f64, f64),
    walkers: Vec<Part>,
    people: &'a [Standing],
    /// The objects, with the squared distance at which they begin, nearest first.
    objects: Vec<(Object, f64)>,
    /// For each tile its candidates, by their place in `objects`.
    tiles: Vec<Vec<u32>>,
}

/// What a ray meets: how far it goes, and which object stops it before the floor.
struct Met {
    beam: Beam,
    distance: f64,
    object: Option<Object>,
}

impl Met {
    fn is_floor(&self) -> bool {
        self.object.is_none() && self.beam.d.z < 0.0
    }
}

impl<'a> Sight<'a> {
    /// What the camera of a robot at a place sees: pictures and labels have these rays and no others.
    pub(super) fn new(moment: &'a Moment<'_>, place: &Place) -> Sight<'a> {
        let (office, people) = (moment.office, &moment.people[..]);
        let (rig, space) = (&*office.rig, &*office.space);
        let eye = office.eye(place, moment);
        let near = |p: &&Standing| (p.x - eye.x).abs().max((p.y - eye.y).abs()) < 30.0;
        let walkers: Vec<Part> = people.iter().filter(near).flat_map(Standing::parts).collect();
        let all = (0..space.walls.len()).map(Object::Wall);
        let all = all.chain((0..space.parts.len()).map(Object::Part));
        let all = all.chain((0..walkers.len()).map(Object::Walker));
        let mut objects: Vec<(Object, f64, Vec<usize>)> = Vec::new();
        for object in all {
            let bounds = space.bounds(object, &walkers);
            let mut tiles = Vec::new();
            rig.tiles_of(&eye, &bounds, |tile| tiles.push(tile));
            if !tiles.is_empty() {
                objects.push((object, Rig::away(&eye, &bounds), tiles));
            }
        }
        objects.sort_by(|a, b| a.1.total_cmp(&b.1));
        let mut tiles: Vec<Vec<u32>> = vec![Vec::new(); rig.tiles()];
        for (k, (.., of)) in objects.iter().enumerate() {
            for &tile in of {
                tiles[tile].push(k as u32);
            }
        }
        let objects = objects.into_iter().map(|(object, away, _)| (object, away)).collect();
        Sight { office, eye, body: (place.x, place.y), walkers, people, objects, tiles }
    }

    #[inline]
    fn meet(&self, column: usize, row: usize) -> Met {
        let rig = &*self.office.rig;
        let eye = &self.eye;
        let ray = rig.rays[row * rig.width + column];
        let beam = Beam::new(Vec3::new(eye.x, eye.y, rig.up), eye.turned(ray));
        // to the floor, or to the ceiling, above which nothing is met
        let distance = match ray.z {
            z if z < 0.0 => -rig.up / z,
            z if z > 0.0 => (self.office.lights.ceiling - rig.up) / z,
            _ => f64::INFINITY,
        };
        let mut met = Met { beam, distance, object: None };
        for &k in &self.tiles[rig.tile(column, row)] {
            let (object, away) = self.objects[k as usize];
            // rounding must not part what stands exactly where the ray ends
            if away > met.distance * met.distance * beam.flat + 1e-6 {
                break;
            }
            if let Some(t) = self.office.space.meet(object, &self.walkers, &beam, met.distance) {
                (met.distance, met.object) = (t, Some(object));
            }
        }
        met
    }

    /// The first row from below whose ray meets something other than the floor, 0 if there is none.
    pub(super) fn label(&self, column: u32) -> u32 {
        let is_floor = |&row: &usize| self.meet(column as usize, row).is_floor();
        (0..self.office.rig.height).rev().find(|row| !is_floor(row)).unwrap_or(0) as u32
    }

    /// Whether each pixel's ray meets the floor first.
    pub(super) fn floor(&self) -> Vec<bool> {
        let (width, height) = (self.office.rig.width, self.office.rig.height);
        let is_floor = |k: usize| self.meet(k % width, k / width).is_floor();
        (0..width * height).map(is_floor).collect()
    }

    /// The light at some pixels, vignetting included: the mean of the roots, as the exposure meter has it.
    pub(super) fn meter(&self, step: usize) -> f32 {
        let rig = &*self.office.rig;
        let (mut sum, mut count) = (0.0, 0.0);
        for row in (step / 2..rig.height).step_by(step) {
            for column in (step / 2..rig.width).step_by(step) {
                let k = row * rig.width + column;
                sum += (self.light(column, row) * rig.vignette[k]).sqrt();
                count += 1.0;
            }
        }
        sum / count
    }

    /// The light of every pixel, row by row.
    pub(super) fn picture(&self) -> Vec<f32> {
        let rig = &*self.office.rig;
        let mut light = vec![0.0; rig.width * rig.height];
        let shade = self.shade();
        for tile in 0..rig.tiles() {
            let (columns, rows) = rig.pixels(tile);
            for row in rows {
                let from = row * rig.width;
                if self.tiles[tile].is_empty() {
                    for column in columns.clone() {
                        light[from + column] = self.bare(column, row) * shade[from + column];
                    }
                } else {
                    for column in columns.clone() {
                        let met = self.meet(column, row);
                        light[from + column] = match met.object {
                            None => self.bare(column, row) * shade[from + column],
                            Some(object) => self.surface(&met, object, from + column),
                        };
                    }
                }
            }
        }
        light
    }

    fn light(&self, column: usize, row: usize) -> f32 {
        let k = row * self.office.rig.width + column;
        let met = self.meet(column, row);
        match met.object {
            None => self.bare(column, row),
            Some(object) => self.surface(&met, object, k),
        }
    }

    /// What the robot and people leave of the light on the floor, for every pixel: computed at some and spread out.
    fn shade(&self) -> Vec<f32> {
        let rig = &*self.office.rig;
        let eye = &self.eye;
        let own = OwnShadow::new(&self.office.lights, eye, &self.body);
        let (across, down) = (rig.width.div_ceil(LATTICE) + 1, rig.height.div_ceil(LATTICE) + 1);
        let point = |i: usize, j: usize| {
            let foot =
                rig.feet[(j * LATTICE).min(rig.height - 1) * rig.width + (i * LATTICE).min(rig.width - 1)];
            if foot.level == u8::MAX {
                return 1.0;
            }
            let way = eye.turned(Vec3::new(f64::from(foot.ahead), f64::from(foot.left), 0.0));
            let p = Vec3::new(eye.x + way.x, eye.y + way.y, 0.0);
            self.people
                .iter()
                .fold(own.remains(p.x as f32, p.y as f32), |rest, person| rest * person.shade(p))
        };
        let lattice: Vec<f32> = (0..across * down).map(|k| point(k % across, k / across)).collect();
        let mut shade = vec![0.0; rig.width * rig.height];
        let mut between = vec![0.0; across];
        for (row, out) in shade.chunks_exact_mut(rig.width).enumerate() {
            let (j, v) = (row / LATTICE, (row % LATTICE) as f32 / LATTICE as f32);
            let (above, below) = (&lattice[j * across..], &lattice[(j + 1) * across..]);
            for ((b, a), c) in between.iter_mut().zip(above).zip(below) {
                *b = a + (c - a) * v;
            }
            for (pair, cell) in between.windows(2).zip(out.chunks_mut(LATTICE)) {
                let step = (pair[1] - pair[0]) / LATTICE as f32;
                for (u, value) in cell.iter_mut().enumerate() {
                    *value = pair[0] + step * u as f32;
                }
            }
        }
        shade
    }

    /// What floor or ceiling give at a pixel before which nothing stands.
    #[inline]
    fn bare(&self, column: usize, row: usize) -> f32 {
        let k = row * self.office.rig.width + column;
        if self.office.rig.feet[k].level == u8::MAX { self.ceiling(k) } else { self.carpet(k) }
    }

    /// What the ceiling gives at a pixel: its panels, or what the floor scatters up to it. Rays so flat that they meet
    /// neither anywhere near end in the little light that is everywhere.
    fn ceiling(&self, k: usize) -> f32 {
        let (rig, lights) = (&*self.office.rig, &*self.office.lights);
        let d = self.eye.turned(rig.rays[k]);
        if d.z <= 1e-3 {
            return AMBIENT as f32;
        }
        let t = (lights.ceiling - rig.up) / d.z;
        let (x, y) = (self.eye.x + d.x * t, self.eye.y + d.y * t);
        let on = |l: &&Light| (x - l.x).abs() <= l.width / 2.0 && (y - l.y).abs() <= l.depth / 2.0;
        match lights.panels.iter().find(on) {
            Some(panel) => PANEL * panel.power as f32,
            None => CEILING * (AMBIENT as f32 + UPWARDS * self.office.light.floor.at(x as f32, y as f32)),
        }
    }

    /// What the floor gives back at a pixel that sees it, shadows of those who move apart.
    #[inline]
    fn carpet(&self, k: usize) -> f32 {
        let (eye, foot) = (&self.eye, self.office.rig.feet[k]);
        let (sin, cos) = (eye.sin as f32, eye.cos as f32);
        let x = eye.x as f32 + foot.ahead * cos - foot.left * sin;
        let y = eye.y as f32 + foot.ahead * sin + foot.left * cos;
        self.carpet_at(x, y, foot.level)
    }

    #[inline]
    fn carpet_at(&self, x: f32, y: f32, level: u8) -> f32 {
        let office = self.office;
        let on = |s: &&super::Ground| s.x.0 <= x && x <= s.x.1 && s.y.0 <= y && y <= s.y.1;
        let albedo = office.stripes.iter().find(on).map_or(office.looks.carpet, |s| s.albedo);
        let grain = office.carpet.at(x - office.looks.corner.0, y - office.looks.corner.1, level);
        albedo * grain * office.light.floor.at(x, y)
    }

    /// What anything but the floor gives back.
    fn surface(&self, met: &Met, object: Object, k: usize) -> f32 {
        let p = met.beam.o + met.beam.d * met.distance;
        match object {
            Object::Wall(i) => self.wall(i, p, &met.beam, k),
            Object::Part(i) => {
                self.part(&self.office.space.parts[i], Some(self.office.light.tops[i]), p, &met.beam)
            }
            Object::Walker(i) => self.part(&self.walkers[i], None, p, &met.beam),
        }
    }

    fn wall(&self, i: usize, p: Vec3, beam: &Beam, k: usize) -> f32 {
        let (office, wall) = (self.office, &self.office.space.walls[i]);
        let along = if wall.along_y { p.y } else { p.x };
        let (albedo, gloss) = paint(&office.space.openings[i], &office.looks, along, p.z);
        let own = albedo * office.light.walls[i].at(along as f32, p.z as f32);
        if gloss == 0.0 || beam.d.z >= 0.0 {
            return own;
        }
        // it mirrors more the flatter one looks at it (Schlick 1994); what it mirrors is the floor, for the camera
        // looks down: the place that the ray would meet without the wall, on this side of it
        let cosine = (beam.d.dot(wall.normal()) / beam.d.length()).abs() as f32;
        let flat = 1.0 - cosine;
        let share = gloss * (0.25 + 0.75 * flat * flat * flat * flat * flat);
        let t = -beam.o.z / beam.d.z;
        let (x, y) = mirrored(wall, beam.o.x + beam.d.x * t, beam.o.y + beam.d.y * t);
        let level = office.rig.feet[k].level.saturating_add(2);
        own * (1.0 - share) + self.carpet_at(x as f32, y as f32, level) * share
    }

    fn part(&self, part: &Part, top: Option<f32>, p: Vec3, beam: &Beam) -> f32 {
        let n = part.normal(p, beam.o);
        // the floor just before a side stands for the light that reaches it
        let floor = self.office.light.floor.at((p.x + 0.12 * n.x) as f32, (p.y + 0.12 * n.y) as f32);
        let light = match top {
            Some(top) if n.z > 0.0 => top,
            _ => {
                // sides get less the nearer they are to the floor, and differ by where they look
                let up = (0.75 + 0.25 * (p.z * 2.0).min(1.0)) as f32;
                floor * up * (0.62 + 0.5 * n.z + 0.09 * n.x - 0.13 * n.y) as f32
            }
        };
        self.office.finish(part, p, n) * light
    }
}

/// The place as far before a wall as another is behind it.
fn mirrored(wall: &Wall, x: f64, y: f64) -> (f64, f64) {
    if wall.along_y { (2.0 * wall.at - x, y) } else { (x, 2.0 * wall.at - y) }
}

/// Albedo and gloss of a wall so far along its axis and at this height.
fn paint(openings: &[Leaf], looks: &super::Looks, along: f64, z: f64) -> (f32, f32) {
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
    fn finish(&self, part: &Part, p: Vec3, n: Vec3) -> f32 {
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
                let vein = crate::world::noise::smooth(self.looks.seed, p.x * 3.0, p.y * 40.0) as f32;
                if n.z > 0.0 { 0.9 + 0.2 * vein } else { 0.5 }
            }
            Pattern::Leaves => {
                let spots = crate::world::noise::smooth(self.looks.seed, p.x * 25.0 + p.z * 19.0, p.y * 25.0);
                0.3 + 1.5 * (spots * spots) as f32
            }
            _ => 1.0,
        };
        (part.albedo as f32 * factor).min(0.95)
    }
}
