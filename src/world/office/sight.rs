//! One look: which objects each part of the picture can meet, what its rays meet, and the light they bring.

use super::light::AMBIENT;
use super::paint::{mirrored, paint};
use super::part::{Beam, Part, Thing};
use super::people::{RADIUS, Standing};
use super::plan::Light;
use super::rig::{Eye, Rig};
use super::shadow::OwnShadow;
use super::space::{BODY_HEIGHT, Nearest, Object};
use super::{Moment, Office, Place};
use crate::world::geometry::Vec3;

/// Pixels between the points at which the robot's shadow is computed.
const LATTICE: usize = 4;
/// Light of a panel of power 1 that one looks into; albedo of the ceiling, and the share of the floor's light that
/// comes up to it.
const PANEL: f32 = 6.0;
const CEILING: f32 = 0.7;
const UPWARDS: f32 = 0.25;
/// How far from the point that was touched a thing still is what was touched, in metres.
const TOUCHED: f64 = 0.05;

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

    /// Whether a pixel shows what touched the robot's body: the thing within [`TOUCHED`] of the point that was touched,
    /// and no higher than the body; of somebody anything up to that height, for he moves.
    pub(super) fn shows(&self, touched: &Nearest) -> bool {
        let Some(thing) = touched.thing else { return false };
        let (width, height) = (self.office.rig.width, self.office.rig.height);
        // from below, where what is near is
        (0..width * height).rev().any(|k| {
            let met = self.meet(k % width, k / width);
            let Some(object) = met.object else { return false };
            let of = match object {
                Object::Wall(_) => Thing::Wall,
                Object::Part(i) => self.office.space.parts[i].thing,
                Object::Walker(_) => Thing::Person,
            };
            let p = met.beam.o + met.beam.d * met.distance;
            let reach = if thing == Thing::Person { RADIUS } else { TOUCHED };
            let (dx, dy) = (p.x - touched.point.0, p.y - touched.point.1);
            of == thing && p.z <= BODY_HEIGHT && dx * dx + dy * dy <= reach * reach
        })
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

#[cfg(test)]
mod tests {
    use super::super::{CAMERA_AHEAD, Office, Setup};
    use super::*;
    use crate::world::office::Plan;

    /// A hall of 8 m x 4 m with more lines of a plan in it.
    fn hall(more: &str) -> Office {
        let text = format!("plan 1\nroom 0 8 0 4\nlight 4 2 1.2 0.3 1\n{more}\n");
        let plan: Plan = text.parse().expect("a plan");
        Office::build(&plan, &Setup::default(), 1).expect("it is built")
    }

    /// Whether a robot whose lens is at a place and looks along x sees what it touches at the point `at`.
    fn sees(office: &Office, lens: (f64, f64), at: (f64, f64)) -> bool {
        let place = Place { x: lens.0 - CAMERA_AHEAD, y: lens.1, heading: 0.0 };
        let moment = office.at(0.0);
        let touched = moment.nearest(at.0, at.1, 0.02);
        assert!(touched.thing.is_some(), "nothing is at {at:?}");
        moment.shows(&place, &touched)
    }

    #[test]
    fn walls_are_seen_before_the_camera_and_not_beside_or_behind_it() {
        let office = hall("");
        assert!(sees(&office, (6.0, 2.0), (8.0, 2.0)) && sees(&office, (6.0, 2.0), (8.0, 3.0)));
        assert!(!sees(&office, (6.0, 2.0), (6.0, 4.0)) && !sees(&office, (6.0, 2.0), (0.0, 2.0)));
        assert!(!sees(&office, (1.0, 2.0), (8.0, 2.0)), "too far: it looks down");
        // 0.05 m ahead: its foot is below the picture, but what stands on it is not
        assert!(sees(&office, (7.95, 2.0), (8.0, 2.0)));
    }

    #[test]
    fn what_hides_behind_something_is_not_seen() {
        let office = hall("box 5 2 0.6 1.4 1.5 0.4\nbin 6 2 0.3 0.3 0.4 0.2");
        assert!(!sees(&office, (4.0, 2.0), (5.85, 2.0)), "behind a box");
        assert!(sees(&office, (4.0, 2.0), (4.7, 2.0)));
        assert!(!sees(&office, (4.0, 2.0), (5.3, 2.0)), "the far side of the box");
    }

    #[test]
    fn the_edge_of_a_table_is_seen_where_it_is_and_not_where_it_would_be_on_the_floor() {
        let office = hall("table 5 2 1.0 1.0 0.7 0.4");
        // the lens is 0.8 m up, the top 0.7 m, and the picture begins 14 degrees below the horizon: beyond 0.4 m its edge is
        // above the picture
        assert!(sees(&office, (4.4, 2.0), (4.5, 2.0)));
        assert!(!sees(&office, (3.9, 2.0), (4.5, 2.0)));
        // the floor below the edge is in that picture
        let place = Place { x: 3.9 - CAMERA_AHEAD, y: 2.0, heading: 0.0 };
        let foot = office.camera().project(office.size(), 0.6, 0.0).expect("it is ahead");
        assert!((0.0..240.0).contains(&foot.1), "{foot:?}");
        assert!(office.at(0.0).label(&place, 160) < 240);
    }

    #[test]
    fn somebody_is_looked_for_where_he_was() {
        let office = hall("person 1 0.2 5 2 5 2.5\nperson 1 0.2 7 1 7 1.5");
        let (now, place) = (office.at(0.0), Place { x: 3.5, y: 2.0, heading: 0.0 });
        let later = office.at(0.5);
        let touched = later.nearest(5.0, 2.5, 0.3);
        assert_eq!((touched.thing, touched.person), (Some(Thing::Person), Some(0)));
        assert!(now.shows(&place, &touched));
        assert!(!now.shows(&Place { heading: 3.0, ..place }, &touched));
    }
}
