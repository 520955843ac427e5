//! Light in an office, computed once: maps over the floor and the walls, read back by bilinear interpolation.
//!
//! Irradiance is relative: about 1 on the floor below a row of burning panels. What light walls and floor scatter is
//! not followed; each panel gives some to all surfaces around it, which fades with distance, so that a burned-out
//! stretch is dark indeed.

use rayon::prelude::*;

use super::part::{Beam, Bounds};
use super::plan::{Light, Plan};
use super::space::{Object, Space};
use crate::world::geometry::{Room, Vec3};
use crate::world::noise::{smooth, white};

/// Luminous intensity of a panel of power 1: with one every 3.1 m at 2.6 m the floor gets about 1.
const INTENSITY: f64 = 4.6;
/// What comes from everywhere: below it no place is.
pub(super) const AMBIENT: f64 = 0.022;
/// What a panel gives to everything just below it by way of walls and floor.
const SCATTERED: f64 = 0.12;
/// Panels further away than this, in metres, are left out.
const REACH: f64 = 7.0;
/// So many of the nearest panels count for a place at most.
const PANELS: usize = 16;
/// Where on a panel light comes from, besides its middle: so far from there, as a share of its length.
const TRIED: f64 = 0.35;
/// Distance of texels on the floor, and on walls along and up, in metres.
const FLOOR_CELL: f64 = 0.05;
const WALL_CELL: (f64, f64) = (0.1, 0.25);
/// Side of the squares of floor that share their candidates for casting shadows, in texels.
const BLOCK: usize = 20;

/// A rectangle of values.
#[derive(Debug, Clone)]
pub(super) struct Grid {
    from: (f32, f32),
    per_cell: (f32, f32),
    size: (usize, usize),
    most: (f32, f32),
    values: Vec<f32>,
}

impl Grid {
    fn new(from: (f64, f64), cell: (f64, f64), size: (usize, usize), values: Vec<f32>) -> Grid {
        let per_cell = (1.0 / cell.0 as f32, 1.0 / cell.1 as f32);
        let most = (size.0 as f32 - 1.001, size.1 as f32 - 1.001);
        Grid { from: (from.0 as f32, from.1 as f32), per_cell, size, most, values }
    }

    #[inline]
    pub(super) fn at(&self, x: f32, y: f32) -> f32 {
        // clamped, so that the indices are in range
        let u = ((x - self.from.0) * self.per_cell.0).max(0.0).min(self.most.0);
        let v = ((y - self.from.1) * self.per_cell.1).max(0.0).min(self.most.1);
        let (i, j) = (u as i32, v as i32);
        let (u, v) = (u - i as f32, v - j as f32);
        let k = j as usize * self.size.0 + i as usize;
        let (above, below) = (&self.values[k..k + 2], &self.values[k + self.size.0..k + self.size.0 + 2]);
        let (a, b) = (above[0] + (above[1] - above[0]) * u, below[0] + (below[1] - below[0]) * u);
        a + (b - a) * v
    }
}

fn texels(length: f64, cell: f64) -> usize {
    (length / cell).ceil() as usize + 2
}

/// The light on every surface.
#[derive(Debug, Clone)]
pub(super) struct LightMap {
    pub(super) floor: Grid,
    pub(super) walls: Vec<Grid>,
    /// On the upper side of each part.
    pub(super) tops: Vec<f32>,
}

/// What lights a small region.
struct Lamps<'a> {
    space: &'a Space,
    ceiling: f64,
    near: Vec<(&'a Light, Vec<Object>)>,
    /// Those that only scatter.
    all: Vec<&'a Light>,
}

impl<'a> Lamps<'a> {
    fn new(space: &'a Space, plan: &'a Plan, region: Room) -> Lamps<'a> {
        let middle = ((region.x.0 + region.x.1) / 2.0, (region.y.0 + region.y.1) / 2.0);
        let away = |light: &&Light| {
            let (dx, dy) = (light.x - middle.0, light.y - middle.1);
            dx * dx + dy * dy
        };
        let mut all: Vec<&Light> = plan.lights.iter().filter(|light| light.power > 0.0).collect();
        // a stable sort: equally far ones stay in the plan's order
        all.sort_by(|a, b| away(a).total_cmp(&away(b)));
        all.truncate(PANELS);
        let half = (region.x.1 - region.x.0).max(region.y.1 - region.y.0);
        // the furthest point of a panel that is tried
        let along = |light: &Light| TRIED * light.width.max(light.depth);
        let near =
            all.iter().filter(|light| away(light).sqrt() < REACH + half + along(light)).map(|&light| {
                let x = (
                    region.x.0.min(light.x - light.width / 2.0),
                    region.x.1.max(light.x + light.width / 2.0),
                );
                let y = (
                    region.y.0.min(light.y - light.depth / 2.0),
                    region.y.1.max(light.y + light.depth / 2.0),
                );
                let touches = |b: &Bounds| b.x.0 <= x.1 && b.x.1 >= x.0 && b.y.0 <= y.1 && b.y.1 >= y.0;
                let walls = (0..space.walls.len()).map(Object::Wall);
                let objects = walls.chain((0..space.parts.len()).map(Object::Part));
                (light, objects.filter(|&object| touches(&space.bounds(object, &[]))).collect())
            });
        let near = near.collect();
        Lamps { space, ceiling: plan.ceiling, near, all }
    }

    /// Irradiance, with shadows: three points of a panel are tried, which gives shadows a soft edge.
    fn irradiance(&self, point: Vec3, normal: Vec3) -> f64 {
        let mut sum = AMBIENT;
        for light in &self.all {
            let (dx, dy) = (light.x - point.x, light.y - point.y);
            let far = (dx * dx + dy * dy) / 5.0;
            sum += SCATTERED * light.power / (1.0 + far * far);
        }
        let start = point + normal * 1e-3;
        for (light, objects) in &self.near {
            for step in [-TRIED, 0.0, TRIED] {
                let along = if light.width > light.depth {
                    (step * light.width, 0.0)
                } else {
                    (0.0, step * light.depth)
                };
                let source = Vec3::new(light.x + along.0, light.y + along.1, self.ceiling);
                let way = source - start;
                let (square, facing) = (way.dot(way), way.dot(normal));
                if facing <= 0.0 || way.z <= 0.0 || square > REACH * REACH {
                    continue;
                }
                let beam = Beam::new(start, way);
                let limit = 1.0 - 1e-6;
                if !objects.iter().any(|&object| self.space.meet(object, &[], &beam, limit).is_some()) {
                    // both cosines over the squared distance; it fades out towards the end of its reach
                    let fade = 1.0 - square / (REACH * REACH);
                    sum += INTENSITY / 3.0 * light.power * facing * way.z / (square * square) * fade;
                }
            }
        }
        sum
    }
}

impl LightMap {
    pub(super) fn new(space: &Space, plan: &Plan) -> LightMap {
        let walls = (0..space.walls.len()).into_par_iter().map(|i| wall(space, plan, i)).collect();
        let top = |(i, part): (usize, &super::part::Part)| {
            let b = part.bounds();
            let (x, y) = ((b.x.0 + b.x.1) / 2.0, (b.y.0 + b.y.1) / 2.0);
            let mut lamps = Lamps::new(space, plan, Room { x: (x, x), y: (y, y) });
            // one point stands for the whole top: what the thing itself puts on its middle does not darken all of it
            let own =
                |object: &Object| matches!(*object, Object::Part(k) if space.items[k] == space.items[i]);
            lamps.near.iter_mut().for_each(|(_, objects)| objects.retain(|object| !own(object)));
            let below = plan.ceiling - 0.05;
            lamps.irradiance(Vec3::new(x, y, part.high.min(below)), Vec3::new(0.0, 0.0, 1.0)) as f32
        };
        LightMap {
            floor: floor(space, plan),
            walls,
            tops: space.parts.par_iter().enumerate().map(top).collect(),
        }
    }
}

/// The floor's map: light, times what differs slowly from carpet tile to carpet tile.
fn floor(space: &Space, plan: &Plan) -> Grid {
    let bounds = plan.bounds();
    let size = (texels(bounds.x.1 - bounds.x.0, FLOOR_CELL), texels(bounds.y.1 - bounds.y.0, FLOOR_CELL));
    let blocks = (size.0.div_ceil(BLOCK), size.1.div_ceil(BLOCK));
    let up = Vec3::new(0.0, 0.0, 1.0);
    let block = |b: usize| -> Vec<f32> {
        let (bi, bj) = (b % blocks.0 * BLOCK, b / blocks.0 * BLOCK);
        let place =
            |i: usize, j: usize| (bounds.x.0 + i as f64 * FLOOR_CELL, bounds.y.0 + j as f64 * FLOOR_CELL);
        let ((x0, y0), (x1, y1)) = (place(bi, bj), place(bi + BLOCK, bj + BLOCK));
        let touches = |r: &Room| {
            let near = 2.0 * FLOOR_CELL;
            x1 > r.x.0 - near && x0 < r.x.1 + near && y1 > r.y.0 - near && y0 < r.y.1 + near
        };
        if !space.rooms.iter().any(touches) {
            return Vec::new();
        }
        let lamps = Lamps::new(space, plan, Room { x: (x0, x1), y: (y0, y1) });
        let texel = |k: usize| {
            let (x, y) = place(bi + k % BLOCK, bj + k / BLOCK);
            let Some((away, cx, cy)) = space.within(x, y) else { return 0.0 };
            if away > 4.0 * FLOOR_CELL * FLOOR_CELL {
                return 0.0;
            }
            // a corner sees less of the room, hence gets less of the scattered light
            let near = space.nearest(&[], cx, cy, 1.0).distance;
            let corner = 1.0 - 0.5 * libm::exp(-near / 0.07);
            let slow = smooth(plan.seed ^ 21, x / 0.7, y / 0.7) - 0.5;
            let tile = white(plan.seed ^ 7, (x * 2.0).floor() as i64, (y * 2.0).floor() as i64) - 0.5;
            let carpet = 1.0 + plan.grain * (0.3 * slow + 0.15 * tile);
            (lamps.irradiance(Vec3::new(cx, cy, 0.0), up) * corner * carpet) as f32
        };
        (0..BLOCK * BLOCK).map(texel).collect()
    };
    let done: Vec<Vec<f32>> = (0..blocks.0 * blocks.1).into_par_iter().map(block).collect();
    let mut values = vec![0.0; size.0 * size.1];
    for (k, value) in values.iter_mut().enumerate() {
        let (i, j) = (k % size.0, k / size.0);
        if let Some(&texel) = done[j / BLOCK * blocks.0 + i / BLOCK].get(j % BLOCK * BLOCK + i % BLOCK) {
            *value = texel;
        }
    }
    Grid::new((bounds.x.0, bounds.y.0), (FLOOR_CELL, FLOOR_CELL), size, values)
}

/// A wall's map: light, times the slight unevenness of its plaster.
fn wall(space: &Space, plan: &Plan, i: usize) -> Grid {
    let wall = space.walls[i];
    let size = (texels(wall.length(), WALL_CELL.0), texels(plan.ceiling, WALL_CELL.1));
    let mut values = vec![0.0; size.0 * size.1];
    for first in (0..size.0).step_by(BLOCK) {
        let last = (first + BLOCK).min(size.0);
        // walls may be shorter than the margin at their ends
        let along =
            |k: usize| (wall.span.0 + k as f64 * WALL_CELL.0).min(wall.span.1 - 0.01).max(wall.span.0 + 0.01);
        let (a, b) = (wall.foot(along(first)), wall.foot(along(last - 1)));
        let region = Room { x: (a.0.min(b.0), a.0.max(b.0)), y: (a.1.min(b.1), a.1.max(b.1)) };
        let lamps = Lamps::new(space, plan, region);
        for k in first..last {
            let (x, y) = wall.foot(along(k));
            for j in 0..size.1 {
                let z = (j as f64 * WALL_CELL.1).clamp(0.01, plan.ceiling - 0.02);
                let plaster =
                    1.0 + 0.05 * (smooth(plan.seed ^ 11, along(k) / 1.3, z / 1.1 + i as f64 * 9.0) - 0.5);
                // the floor before it scatters light upwards
                let light = lamps.irradiance(Vec3::new(x, y, z), wall.normal());
                values[j * size.0 + k] = (light * plaster) as f32;
            }
        }
    }
    Grid::new((wall.span.0, 0.0), WALL_CELL, size, values)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn grids_interpolate() {
        let values = (0..12).map(|k| (k % 4) as f32 + 10.0 * (k / 4) as f32).collect();
        let grid = Grid::new((1.0, 2.0), (0.5, 0.5), (4, 3), values);
        assert!((grid.at(1.25, 2.5) - 10.5).abs() < 1e-5 && (grid.at(2.0, 2.25) - 7.0).abs() < 1e-5);
        assert!(grid.at(-9.0, 99.0).is_finite() && grid.at(f32::NAN, 0.0).is_finite());
    }
}
