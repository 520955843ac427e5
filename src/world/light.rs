//! Light: ceiling panels, their shadows, and the darkness in corners, computed once for a building.
//!
//! Irradiance is relative: about 1 on the floor below a row of burning panels. It is stored in maps over the
//! floor and over each wall and read back by bilinear interpolation; only the robot's own shadow moves, and
//! is added picture by picture.
//!
//! ```
//! use vsonar::world::{building::Building, light::LightMap};
//! let building = Building::new(1);
//! let light = LightMap::new(&building);
//! let below = building.panels[0];
//! assert!(light.floor(below.x, below.y) > 0.3);
//! ```

use rayon::prelude::*;

use super::building::Building;
use super::geometry::{Geometry, Ray, Vec3};

/// A light panel in the ceiling, facing down.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Panel {
    /// Centre.
    pub x: f64,
    /// Centre.
    pub y: f64,
    /// Height in metres.
    pub z: f64,
    /// Half its extent along x and along y, in metres.
    pub half: (f64, f64),
    /// Relative brightness, about 1.
    pub power: f64,
}

/// Light that comes from everywhere.
const AMBIENT: f64 = 0.09;
/// Luminous intensity of a panel of power 1: with one every 2.4 m at 2.6 m the floor gets about 1.
const INTENSITY: f64 = 4.2;
/// A panel further away than this, in metres, is left out.
const REACH: f64 = 7.0;
/// Distance of texels on the floor and on walls, in metres.
const FLOOR_CELL: f64 = 0.05;
const WALL_CELL: f64 = 0.15;

impl Panel {
    /// What it alone gives to a small surface, shadows apart.
    pub fn unshadowed(&self, point: Vec3, normal: Vec3) -> f64 {
        self.toward(Vec3::new(self.x, self.y, self.z), point, normal)
    }

    fn toward(&self, source: Vec3, point: Vec3, normal: Vec3) -> f64 {
        let way = source - point;
        let square = way.dot(way);
        let facing = way.dot(normal);
        if facing <= 0.0 || way.z <= 0.0 || square > REACH * REACH {
            return 0.0;
        }
        // both cosines over the squared distance
        INTENSITY * self.power * facing * way.z / (square * square)
    }

    /// With shadows: three points of the panel are tried, which gives shadows a soft edge.
    fn gives(&self, geometry: &Geometry, point: Vec3, normal: Vec3) -> f64 {
        let long = self.half.0 > self.half.1;
        let mut sum = 0.0;
        for step in [-0.7, 0.0, 0.7] {
            let (dx, dy) = if long { (step * self.half.0, 0.0) } else { (0.0, step * self.half.1) };
            let source = Vec3::new(self.x + dx, self.y + dy, self.z);
            let light = self.toward(source, point, normal);
            if light > 0.0 {
                let start = point + normal * 1e-3;
                let free = geometry.cast(&Ray { origin: start, direction: source - start }).distance;
                sum += if free >= 1.0 - 1e-6 { light } else { 0.0 };
            }
        }
        sum / 3.0
    }
}

/// A rectangle of values.
#[derive(Debug, Clone)]
struct Grid {
    from: (f64, f64),
    cell: f64,
    size: (usize, usize),
    values: Vec<f64>,
}

impl Grid {
    /// The function at every texel's corner; rows in parallel, each by itself, so that threads do not matter.
    fn new(from: (f64, f64), to: (f64, f64), cell: f64, f: impl Fn(f64, f64) -> f64 + Sync) -> Grid {
        let texels = |a: f64, b: f64| ((b - a) / cell).ceil() as usize + 2;
        let size = (texels(from.0, to.0), texels(from.1, to.1));
        let row = |j: usize| {
            let y = from.1 + j as f64 * cell;
            (0..size.0).map(|i| f(from.0 + i as f64 * cell, y)).collect::<Vec<f64>>()
        };
        let rows: Vec<Vec<f64>> = (0..size.1).into_par_iter().map(row).collect();
        Grid { from, cell, size, values: rows.concat() }
    }

    fn at(&self, x: f64, y: f64) -> f64 {
        let place = |v: f64, from: f64, size: usize| {
            let v = ((v - from) / self.cell).clamp(0.0, (size - 1) as f64 - 1e-9);
            (v as usize, v - v.floor())
        };
        let (i, u) = place(x, self.from.0, self.size.0);
        let (j, v) = place(y, self.from.1, self.size.1);
        let row = |j: usize| {
            let k = j * self.size.0 + i;
            self.values[k] + (self.values[k + 1] - self.values[k]) * u
        };
        let (a, b) = (row(j), row(j + 1));
        a + (b - a) * v
    }
}

/// The light on every surface of a building.
#[derive(Debug, Clone)]
pub struct LightMap {
    floor: Grid,
    walls: Vec<Grid>,
}

impl LightMap {
    /// Computes the maps.
    pub fn new(building: &Building) -> LightMap {
        let (geometry, panels) = (&building.geometry, &building.panels);
        let irradiance = |point: Vec3, normal: Vec3| {
            panels.iter().fold(AMBIENT, |sum, panel| sum + panel.gives(geometry, point, normal))
        };
        let up = Vec3::new(0.0, 0.0, 1.0);
        let inside = |x: f64, y: f64| {
            let near = 2.0 * FLOOR_CELL;
            building
                .rooms
                .iter()
                .any(|r| x > r.x.0 - near && x < r.x.1 + near && y > r.y.0 - near && y < r.y.1 + near)
        };
        let low =
            |f: fn(&super::geometry::Room) -> f64| building.rooms.iter().map(f).fold(f64::INFINITY, f64::min);
        let high = |f: fn(&super::geometry::Room) -> f64| {
            building.rooms.iter().map(f).fold(f64::NEG_INFINITY, f64::max)
        };
        let from = (low(|r| r.x.0), low(|r| r.y.0));
        let to = (high(|r| r.x.1), high(|r| r.y.1));
        let floor = Grid::new(from, to, FLOOR_CELL, |x, y| {
            if !inside(x, y) {
                return 0.0;
            }
            // a corner sees less of the room, hence gets less of the light that comes from everywhere
            let corner = 1.0 - 0.45 * libm::exp(-geometry.clearance(x, y, 1.0) / 0.09);
            irradiance(Vec3::new(x, y, 0.0), up) * corner
        });
        let wall = |wall: &super::geometry::Wall| {
            Grid::new((wall.span.0, 0.0), (wall.span.1, geometry.ceiling()), WALL_CELL, |along, z| {
                let (x, y) = wall.foot(along);
                irradiance(Vec3::new(x, y, z.min(geometry.ceiling() - 0.02)), wall.normal())
            })
        };
        LightMap { floor, walls: geometry.walls().iter().map(wall).collect() }
    }

    /// Irradiance on the floor.
    pub fn floor(&self, x: f64, y: f64) -> f64 {
        self.floor.at(x, y)
    }

    /// Irradiance on a wall, by its index, so far along its axis and at this height.
    pub fn wall(&self, wall: usize, along: f64, z: f64) -> f64 {
        self.walls[wall].at(along, z)
    }
}

/// The robot's own shadow: how the body of the robot takes away the light of the nearest panels.
#[derive(Debug, Clone)]
pub struct OwnShadow {
    /// Centre of the body on the floor.
    body: (f64, f64),
    height: f64,
    /// The panels that count, and what share of all light each gives.
    panels: Vec<(Panel, f64)>,
}

/// Radius of the robot's body in metres, and how wide the edge of its shadow is.
const BODY: f64 = 0.22;
const EDGE: f64 = 0.1;

impl OwnShadow {
    /// The shadow of a robot whose body stands here and is so high.
    pub fn new(panels: &[Panel], body: (f64, f64), height: f64) -> OwnShadow {
        let (point, up) = (Vec3::new(body.0, body.1, 0.0), Vec3::new(0.0, 0.0, 1.0));
        let mut lit: Vec<(Panel, f64)> = panels.iter().map(|p| (*p, p.unshadowed(point, up))).collect();
        let all = lit.iter().fold(AMBIENT, |sum, (_, light)| sum + light);
        lit.sort_by(|a, b| b.1.total_cmp(&a.1));
        lit.truncate(3);
        lit.iter_mut().for_each(|(_, light)| *light /= all);
        OwnShadow { body, height, panels: lit }
    }

    /// What remains of the light on a point of the floor, 0 to 1.
    pub fn remains(&self, x: f64, y: f64) -> f64 {
        let mut remains = 1.0;
        for (panel, share) in &self.panels {
            // the way to the light, as far as it is below the top of the body
            let part = self.height / panel.z;
            let (wx, wy) = ((panel.x - x) * part, (panel.y - y) * part);
            let (bx, by) = (self.body.0 - x, self.body.1 - y);
            let square = wx * wx + wy * wy;
            let t = if square > 0.0 { ((bx * wx + by * wy) / square).clamp(0.0, 1.0) } else { 0.0 };
            let (dx, dy) = (bx - wx * t, by - wy * t);
            let edge = (((dx * dx + dy * dy).sqrt() - BODY) / EDGE + 0.5).clamp(0.0, 1.0);
            remains -= share * (1.0 - edge * edge * (3.0 - 2.0 * edge));
        }
        remains.max(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn grids_interpolate() {
        let grid = Grid::new((1.0, 2.0), (3.0, 4.0), 0.5, |x, y| 3.0 * x - y);
        for (x, y) in [(1.0, 2.0), (1.3, 2.9), (3.0, 4.0), (2.75, 3.01)] {
            assert!((grid.at(x, y) - (3.0 * x - y)).abs() < 1e-9);
        }
        assert!(grid.at(-100.0, 100.0).is_finite());
    }

    #[test]
    fn solids_and_the_robot_cast_shadows() {
        let panel = Panel { x: 0.0, y: 0.0, z: 2.6, half: (0.6, 0.15), power: 1.0 };
        let room = crate::world::geometry::Room { x: (-3.0, 3.0), y: (-3.0, 3.0) };
        let cube = crate::world::geometry::Solid {
            outline: crate::world::geometry::Outline::Round { x: 1.0, y: 0.0, radius: 0.2 },
            height: 1.0,
        };
        let geometry = Geometry::new(&[room], vec![cube], 2.6);
        let up = Vec3::new(0.0, 0.0, 1.0);
        let shaded = panel.gives(&geometry, Vec3::new(1.4, 0.0, 0.0), up);
        let free = panel.gives(&geometry, Vec3::new(-1.4, 0.0, 0.0), up);
        assert!(shaded < 0.1 * free, "{shaded} {free}");
        let own = OwnShadow::new(&[panel], (1.0, 0.0), 0.8);
        assert!(own.remains(1.0, 0.0) < 0.3 && own.remains(-1.0, 0.0) == 1.0);
    }
}
