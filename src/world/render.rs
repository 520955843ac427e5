//! One picture: a ray for every pixel, its light, and what a cheap camera and its digitizer make of it.
//!
//! ```
//! use vsonar::world::Corridor;
//! use vsonar::world::render::Scene;
//! let settings = Corridor { width: 64, height: 48, ..Corridor::default() };
//! let scene = Scene::new(&settings, 1);
//! let pose = scene.poses(1)[0];
//! let picture = scene.picture(&pose, 0);
//! assert_eq!(picture.dimensions(), (64, 48));
//! assert!(scene.label(&pose, 10) < 48);
//! ```

use image::GrayImage;
use rayon::prelude::*;

use super::Corridor;
use super::building::Building;
use super::camera::{Pose, View};
use super::geometry::{Geometry, Hit, Ray, Surface, Vec3};
use super::light::{LightMap, OwnShadow};
use super::noise;

/// How far the camera stands before the centre of the robot's body, in metres.
const CAMERA_AHEAD: f64 = 0.28;
/// Radiance of a light panel looked into.
const PANEL: f64 = 3.0;

/// A lit building and a camera to look at it.
#[derive(Debug, Clone)]
pub struct Scene {
    settings: Corridor,
    seed: u64,
    building: Building,
    light: LightMap,
}

impl Scene {
    /// The building of a seed, lit.
    pub fn new(settings: &Corridor, seed: u64) -> Scene {
        let building = Building::new(seed);
        let light = LightMap::new(&building);
        Scene { settings: settings.clone(), seed, building, light }
    }

    /// The building.
    pub fn building(&self) -> &Building {
        &self.building
    }

    /// The poses of a drive of this many frames through the corridor.
    pub fn poses(&self, frames: usize) -> Vec<Pose> {
        super::path::poses(&self.building, &self.settings, self.seed, frames)
    }

    /// The label of a column: the first row from below whose pixel's ray meets something other than the floor;
    /// 0 if there is none.
    pub fn label(&self, pose: &Pose, column: u32) -> u32 {
        let view = self.settings.lens().view(pose);
        let is_floor = |row| self.building.geometry.cast(&view.ray(column, row)).surface == Surface::Floor;
        (0..self.settings.height).rev().find(|&row| !is_floor(row)).unwrap_or(0)
    }

    /// The picture from a pose. The number of the frame only seeds the sensor's noise.
    pub fn picture(&self, pose: &Pose, frame: u64) -> GrayImage {
        let (width, height) = (self.settings.width, self.settings.height);
        let view = self.settings.lens().view(pose);
        let (sin, cos) = libm::sincos(pose.yaw);
        let body = (pose.x - cos * CAMERA_AHEAD, pose.y - sin * CAMERA_AHEAD);
        let shadow = OwnShadow::new(&self.building.panels, body, pose.z);
        let mut light = vec![0.0; width as usize * height as usize];
        light.par_chunks_mut(width as usize).enumerate().for_each(|(row, pixels)| {
            for (column, pixel) in pixels.iter_mut().enumerate() {
                *pixel = self.radiance(&view, &shadow, &view.ray(column as u32, row as u32));
            }
        });
        let soft = soften(&light, width as usize, height as usize, self.settings.softness);
        let mut picture = GrayImage::new(width, height);
        let sensor = noise::hash(self.seed, frame as i64, -1);
        for (x, y, pixel) in picture.enumerate_pixels_mut() {
            let value = soft[(y * width + x) as usize];
            pixel.0 = [self.digitize(value, x, y, sensor)];
        }
        picture
    }

    /// Light towards the camera along a ray.
    fn radiance(&self, view: &View, shadow: &OwnShadow, ray: &Ray) -> f64 {
        let geometry: &Geometry = &self.building.geometry;
        let hit = geometry.cast(ray);
        let pixel = view.pixel() * hit.distance;
        let own = self.diffuse(&hit, pixel, shadow);
        let gloss = self.building.looks.gloss;
        let Surface::Wall(_) = hit.surface else { return own };
        // a glossy wall mirrors more the flatter one looks at it (Schlick 1994)
        let along = ray.direction.dot(hit.normal);
        let cosine = -along / ray.direction.length();
        let flat = 1.0 - cosine;
        let share = gloss * (0.08 + 0.92 * flat * flat * flat * flat * flat);
        let mirrored = Ray {
            origin: hit.point + hit.normal * 1e-6,
            direction: ray.direction - hit.normal * (2.0 * along),
        };
        let second = geometry.cast(&mirrored);
        let far = pixel + view.pixel() * second.distance;
        own * (1.0 - share) + self.diffuse(&second, 4.0 * far, shadow) * share
    }

    /// Light a surface scatters.
    fn diffuse(&self, hit: &Hit, pixel: f64, shadow: &OwnShadow) -> f64 {
        let building = &self.building;
        let Vec3 { x, y, z } = hit.point;
        match hit.surface {
            Surface::Floor => {
                let light = self.light.floor(x, y) * shadow.remains(x, y);
                building.looks.floor(x, y, pixel) * light
            }
            Surface::Wall(i) => {
                let wall = &building.geometry.walls()[i];
                let along = if wall.along_y { y } else { x };
                // the lowest part also gets the light of the floor, or its darkness
                building.looks.wall(&building.doors[i], along, z) * self.light.wall(i, along, z)
            }
            Surface::Solid(i) => {
                let height = building.geometry.solids()[i].height;
                let n = hit.normal;
                // the floor just before the face stands for the light that reaches it from its side
                let floor = self.light.floor(x + 0.12 * n.x, y + 0.12 * n.y);
                let side = 0.45 + 0.65 * n.z + 0.06 * n.x - 0.09 * n.y;
                building.finishes[i].albedo(hit.point, n, height) * floor * side
            }
            Surface::Ceiling => {
                let inside =
                    |p: &super::light::Panel| (x - p.x).abs() <= p.half.0 && (y - p.y).abs() <= p.half.1;
                if building.panels.iter().any(inside) { PANEL } else { 0.35 }
            }
        }
    }

    /// From light to a gray value: vignetting, tone curve, noise, interlace, and the digitizer's floor.
    fn digitize(&self, light: f64, x: u32, y: u32, sensor: u64) -> u8 {
        let s = &self.settings;
        let half = f64::from(s.width) / 2.0;
        let (u, v) =
            ((f64::from(x) + 0.5 - half) / half, (f64::from(y) + 0.5 - f64::from(s.height) / 2.0) / half);
        // the fourth power of the cosine would darken corners to a quarter; lenses are corrected for half of it
        let tangent = libm::tan(s.field_of_view / 2.0);
        let cosine_square = 1.0 / (1.0 + (u * u + v * v) * tangent * tangent);
        let value = 255.0 * (light * cosine_square.sqrt() * s.exposure).sqrt();
        let noise = noise::normal(noise::hash(sensor, i64::from(x), i64::from(y))) * s.noise;
        let lines = if y.is_multiple_of(2) { s.interlace } else { -s.interlace };
        let moire = s.interlace * libm::sin(0.83 * f64::from(x) + 0.31 * f64::from(y));
        let value = (value + noise + lines + moire).round().clamp(0.0, 255.0) as u8;
        if s.digitizer && value < 32 { 16 } else { value }
    }
}

/// A slightly unsharp lens: each pixel gives this share away to its neighbours, as a 3 x 3 binomial.
fn soften(light: &[f64], width: usize, height: usize, share: f64) -> Vec<f64> {
    let side = share / 4.0;
    let centre = 1.0 - 2.0 * side;
    let mut across = vec![0.0; light.len()];
    for (row, out) in light.chunks(width).zip(across.chunks_mut(width)) {
        for x in 0..width {
            let (left, right) = (row[x.saturating_sub(1)], row[(x + 1).min(width - 1)]);
            out[x] = centre * row[x] + side * (left + right);
        }
    }
    let mut out = vec![0.0; light.len()];
    for y in 0..height {
        let (above, below) = (y.saturating_sub(1), (y + 1).min(height - 1));
        for x in 0..width {
            let sum = across[above * width + x] + across[below * width + x];
            out[y * width + x] = centre * across[y * width + x] + side * sum;
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn softening_keeps_even_light_and_spreads_a_point() {
        let even = soften(&[2.0; 20], 5, 4, 0.6);
        assert!(even.iter().all(|v| (v - 2.0).abs() < 1e-12));
        let mut point = vec![0.0; 25];
        point[12] = 1.0;
        let out = soften(&point, 5, 5, 0.6);
        assert!(
            (out.iter().sum::<f64>() - 1.0).abs() < 1e-12 && out[7] > 0.0 && out[6] > 0.0 && out[2] == 0.0
        );
    }

    #[test]
    fn the_digitizer_has_a_floor() {
        let scene = Scene::new(&Corridor { width: 32, height: 32, ..Corridor::default() }, 1);
        assert_eq!(scene.digitize(0.0, 16, 16, 1), 16);
        assert!(scene.digitize(0.3, 16, 16, 1) > 60);
        let plain =
            Scene::new(&Corridor { width: 32, height: 32, digitizer: false, ..Corridor::default() }, 1);
        assert!(plain.digitize(0.0, 16, 16, 1) < 16);
    }
}
