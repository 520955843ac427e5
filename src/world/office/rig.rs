//! What the camera sees wherever it stands: the rays of its pixels, the floor they would meet, and vignetting.

use super::carpet::Carpet;
use super::part::Bounds;
use super::setup::Setup;
use crate::world::camera::Pose;
use crate::world::geometry::Vec3;
use crate::world::noise::{hash, unit};

/// Side of the squares of pixels that share their candidates, in pixels.
pub(super) const TILE: usize = 16;
/// Depth below which nothing is projected, in metres.
const NEAR: f64 = 0.004;

/// Where a pixel's ray meets the floor, seen from the point below the camera.
#[derive(Debug, Clone, Copy)]
pub(super) struct Foot {
    pub(super) ahead: f32,
    pub(super) left: f32,
    /// Level of the carpet's texture, dithered so that no edge shows between two.
    pub(super) level: u8,
}

/// Extent of a square of pixels on the plane at depth 1: to the right and down.
type Extent = ((f64, f64), (f64, f64));

/// The camera on the robot.
#[derive(Debug, Clone)]
pub(super) struct Rig {
    pub(super) width: usize,
    pub(super) height: usize,
    /// Height of the camera in metres.
    pub(super) up: f64,
    /// Direction of each pixel's ray: ahead, to the left, up.
    pub(super) rays: Vec<Vec3>,
    pub(super) feet: Vec<Foot>,
    /// What a pixel gets of the light, 0 to 1.
    pub(super) vignette: Vec<f32>,
    tiles: (usize, usize),
    extents: Vec<Extent>,
    /// Sine and cosine of the pitch.
    pitch: (f64, f64),
    /// How far the floor is seen at most, in metres.
    reach: f64,
}

/// Where the camera is, and the direction it looks in.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Eye {
    pub(super) x: f64,
    pub(super) y: f64,
    pub(super) sin: f64,
    pub(super) cos: f64,
}

impl Eye {
    /// A direction of the robot's as one of the world's.
    #[inline]
    pub(super) fn turned(&self, d: Vec3) -> Vec3 {
        Vec3::new(d.x * self.cos - d.y * self.sin, d.x * self.sin + d.y * self.cos, d.z)
    }
}

impl Rig {
    pub(super) fn new(setup: &Setup) -> Rig {
        let (width, height) = (setup.width as usize, setup.height as usize);
        let up = setup.camera.height;
        let pitch = setup.camera.pitch.to_radians();
        let view = setup.lens().view(&Pose { x: 0.0, y: 0.0, z: up, yaw: 0.0, pitch });
        let ray = |k: usize| view.ray((k % width) as u32, (k / width) as u32).direction;
        let rays: Vec<Vec3> = (0..width * height).map(ray).collect();
        let mut reach: f64 = 0.0;
        let foot = |(k, d): (usize, &Vec3)| {
            if d.z >= -1e-3 {
                reach = f64::INFINITY;
                return Foot { ahead: 0.0, left: 0.0, level: 255 };
            }
            let t = -up / d.z;
            reach = reach.max(t * (d.x * d.x + d.y * d.y).sqrt());
            // between how wide and how long the pixel is on the floor
            let slant = (d.dot(*d)).sqrt() / -d.z;
            let level = Carpet::level(t * view.pixel() * slant.sqrt()) - 0.35;
            let dither = unit(hash(1, (k % width) as i64, (k / width) as i64));
            let level = (level.max(0.0) + dither).floor() as u8;
            Foot { ahead: (d.x * t) as f32, left: (d.y * t) as f32, level }
        };
        let feet = rays.iter().enumerate().map(foot).collect();
        let (sin, cos) = libm::sincos(pitch);
        // the fourth power of the cosine would darken corners to a quarter; lenses are corrected for half of it
        let cosine = |d: &Vec3| (d.x * cos - d.z * sin) / d.length();
        let vignette = rays.iter().map(|d| cosine(d) as f32).collect();
        let tiles = (width.div_ceil(TILE), height.div_ceil(TILE));
        let mut rig = Rig {
            width,
            height,
            up,
            rays,
            feet,
            vignette,
            tiles,
            extents: Vec::new(),
            pitch: (sin, cos),
            reach,
        };
        rig.extents = (0..tiles.0 * tiles.1).map(|t| rig.extent(t)).collect();
        rig
    }

    /// The tile of a pixel.
    #[inline]
    pub(super) fn tile(&self, column: usize, row: usize) -> usize {
        row / TILE * self.tiles.0 + column / TILE
    }

    pub(super) fn tiles(&self) -> usize {
        self.tiles.0 * self.tiles.1
    }

    /// Columns and rows of a tile.
    pub(super) fn pixels(&self, tile: usize) -> (std::ops::Range<usize>, std::ops::Range<usize>) {
        let (x, y) = (tile % self.tiles.0 * TILE, tile / self.tiles.0 * TILE);
        (x..(x + TILE).min(self.width), y..(y + TILE).min(self.height))
    }

    /// Depth, to the right and down of a direction of the robot's.
    fn seen(&self, d: Vec3) -> (f64, f64, f64) {
        let (sin, cos) = self.pitch;
        (d.x * cos - d.z * sin, -d.y, -d.x * sin - d.z * cos)
    }

    fn extent(&self, tile: usize) -> Extent {
        let none = (f64::INFINITY, f64::NEG_INFINITY);
        let (mut right, mut down) = (none, none);
        let (columns, rows) = self.pixels(tile);
        for row in rows {
            for column in columns.clone() {
                let (depth, u, v) = self.seen(self.rays[row * self.width + column]);
                let (u, v) = (u / depth, v / depth);
                right = (right.0.min(u), right.1.max(u));
                down = (down.0.min(v), down.1.max(v));
            }
        }
        // a little more, so that rounding leaves nothing out
        let wider = |(a, b): (f64, f64)| (a - 1e-6, b + 1e-6);
        (wider(right), wider(down))
    }

    /// Squared distance along the floor from the eye to a box.
    pub(super) fn away(eye: &Eye, b: &Bounds) -> f64 {
        let dx = (b.x.0 - eye.x).max(eye.x - b.x.1).max(0.0);
        let dy = (b.y.0 - eye.y).max(eye.y - b.y.1).max(0.0);
        dx * dx + dy * dy
    }

    /// Calls back with every tile in which a box may be seen.
    pub(super) fn tiles_of(&self, eye: &Eye, b: &Bounds, mut found: impl FnMut(usize)) {
        if Rig::away(eye, b) > self.reach * self.reach {
            return;
        }
        let mut corners = [(0.0, 0.0, 0.0); 8];
        for (k, corner) in corners.iter_mut().enumerate() {
            let pick = |bit: usize, (low, high): (f64, f64)| if k >> bit & 1 == 0 { low } else { high };
            let (dx, dy) = (pick(0, b.x) - eye.x, pick(1, b.y) - eye.y);
            let (ahead, left) = (dx * eye.cos + dy * eye.sin, dy * eye.cos - dx * eye.sin);
            *corner = self.seen(Vec3::new(ahead, left, pick(2, b.z) - self.up));
        }
        let none = (f64::INFINITY, f64::NEG_INFINITY);
        let (mut right, mut down) = (none, none);
        let mut see = |depth: f64, u: f64, v: f64| {
            let (u, v) = (u / depth, v / depth);
            right = (right.0.min(u), right.1.max(u));
            down = (down.0.min(v), down.1.max(v));
        };
        for (k, &(depth, u, v)) in corners.iter().enumerate() {
            if depth >= NEAR {
                see(depth, u, v);
            }
            for bit in 0..3 {
                // the edge to the corner that differs in one coordinate, cut where it comes too near
                let (other, ou, ov) = corners[k | 1 << bit];
                if k >> bit & 1 == 0 && (depth < NEAR) != (other < NEAR) {
                    let t = (NEAR - depth) / (other - depth);
                    see(NEAR, u + (ou - u) * t, v + (ov - v) * t);
                }
            }
        }
        if right.0 > right.1 {
            return;
        }
        for (tile, (r, d)) in self.extents.iter().enumerate() {
            if right.0 <= r.1 && right.1 >= r.0 && down.0 <= d.1 && down.1 >= d.0 {
                found(tile);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_box_is_in_the_tiles_of_the_rays_that_meet_it() {
        let setup = Setup::default();
        let rig = Rig::new(&setup);
        let eye = Eye { x: 1.0, y: 2.0, sin: 0.6, cos: 0.8 };
        for k in 0..40 {
            let (x, y) = (f64::from(k % 8) * 0.4, 1.0 + f64::from(k / 8) * 0.5);
            let b = Bounds { x: (x, x + 0.2), y: (y, y + 0.1), z: (0.0, 0.1 + f64::from(k) * 0.03) };
            let mut tiles = vec![false; rig.tiles()];
            rig.tiles_of(&eye, &b, |tile| tiles[tile] = true);
            let part = super::super::part::Part {
                outline: crate::world::geometry::Outline::Box(crate::world::geometry::Room {
                    x: b.x,
                    y: b.y,
                }),
                low: b.z.0,
                high: b.z.1,
                thing: super::super::Thing::Wall,
                albedo: 0.5,
                pattern: super::super::part::Pattern::Plain,
            };
            for (i, d) in rig.rays.iter().enumerate().step_by(7) {
                let beam = super::super::part::Beam::new(Vec3::new(eye.x, eye.y, rig.up), eye.turned(*d));
                if part.enter(&beam).is_some() {
                    assert!(tiles[rig.tile(i % rig.width, i / rig.width)], "box {k}, pixel {i}");
                }
            }
        }
    }
}
