//! The camera on the robot: where it is, where it looks, and the ray of every pixel. The model is that of
//! [`crate::camera`]; a calibrated [`Camera`] gives its lens and its pose.
//!
//! The world has x and y along the floor and z up, in metres; angles are radians. Yaw 0 looks along x, positive
//! yaw turns towards y (to the left); pitch is downwards.
//!
//! ```
//! use vsonar::camera::Camera;
//! let camera = Camera { height: 0.8, pitch: 51.0, field_of_view: 90.0, distortion: 0.0 };
//! let (lens, pose) = (camera.lens(320, 240), camera.pose(0.0, 0.0, 0.0));
//! let ray = lens.view(&pose).ray(160, 120);
//! assert!(ray.direction.z < 0.0 && ray.direction.x > 0.0);
//! ```

use super::geometry::{Ray, Vec3};
use crate::camera::Camera;

/// What does not change from picture to picture: size and opening angle. Pixels are square.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lens {
    /// Width of the picture in pixels.
    pub width: u32,
    /// Height of the picture in pixels.
    pub height: u32,
    /// Horizontal field of view from the left edge to the right edge, in radians, below pi.
    pub field_of_view: f64,
    /// Radial distortion (the division model of [`crate::camera`]), 0 for none.
    pub distortion: f64,
}

/// Where the camera is and where it looks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose {
    /// Position on the floor, in metres.
    pub x: f64,
    /// Position on the floor, in metres.
    pub y: f64,
    /// Height of the camera above the floor, in metres.
    pub z: f64,
    /// Direction on the floor, in radians.
    pub yaw: f64,
    /// Angle below the horizontal, in radians.
    pub pitch: f64,
}

/// A lens at a pose: gives the rays.
#[derive(Debug, Clone, Copy)]
pub struct View {
    origin: Vec3,
    forward: Vec3,
    /// To the right by one pixel.
    right: Vec3,
    /// Down by one pixel.
    down: Vec3,
    centre: (f64, f64),
    distortion: f64,
}

impl Camera {
    /// What of this camera does not change from picture to picture, for pictures of `width` x `height` pixels.
    pub fn lens(&self, width: u32, height: u32) -> Lens {
        let field_of_view = self.field_of_view.to_radians();
        Lens { width, height, field_of_view, distortion: self.distortion }
    }

    /// This camera above a point of the floor, in metres, looking in a direction, in radians.
    pub fn pose(&self, x: f64, y: f64, yaw: f64) -> Pose {
        Pose { x, y, z: self.height, yaw, pitch: self.pitch.to_radians() }
    }
}

impl Lens {
    /// The rays of this lens at a pose.
    pub fn view(&self, pose: &Pose) -> View {
        let (sin_yaw, cos_yaw) = libm::sincos(pose.yaw);
        let (sin_pitch, cos_pitch) = libm::sincos(pose.pitch);
        let pixel = libm::tan(self.field_of_view / 2.0) / (f64::from(self.width) / 2.0);
        View {
            origin: Vec3::new(pose.x, pose.y, pose.z),
            forward: Vec3::new(cos_yaw * cos_pitch, sin_yaw * cos_pitch, -sin_pitch),
            right: Vec3::new(sin_yaw, -cos_yaw, 0.0) * pixel,
            down: Vec3::new(-cos_yaw * sin_pitch, -sin_yaw * sin_pitch, -cos_pitch) * pixel,
            centre: (f64::from(self.width) / 2.0, f64::from(self.height) / 2.0),
            distortion: self.distortion,
        }
    }
}

impl View {
    /// The ray through the centre of a pixel. Its direction has length 1 along the optical axis, so that it is
    /// not a unit vector elsewhere.
    pub fn ray(&self, column: u32, row: u32) -> Ray {
        let mut u = f64::from(column) + 0.5 - self.centre.0;
        let mut v = f64::from(row) + 0.5 - self.centre.1;
        if self.distortion != 0.0 {
            let square = (u * u + v * v) / (self.centre.0 * self.centre.0);
            let scale = (1.0 + self.distortion) / (1.0 + self.distortion * square);
            (u, v) = (u * scale, v * scale);
        }
        Ray { origin: self.origin, direction: self.forward + self.right * u + self.down * v }
    }

    /// Where the camera is.
    pub fn origin(&self) -> Vec3 {
        self.origin
    }

    /// Size of a pixel as a tangent: metres covered at one metre along the axis, distortion left aside.
    pub fn pixel(&self) -> f64 {
        self.right.length()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn edges_of_the_picture_span_the_field_of_view() {
        let lens = Lens { width: 320, height: 240, field_of_view: 90f64.to_radians(), distortion: 0.0 };
        let view = lens.view(&Pose { x: 1.0, y: 2.0, z: 0.8, yaw: 0.0, pitch: 0.0 });
        // the centre of the first pixel is half a pixel inside of 45 degrees to the left, which is +y
        let ray = view.ray(0, 120);
        assert!((ray.direction.y - (1.0 - 0.5 / 160.0)).abs() < 1e-12 && ray.direction.x == 1.0);
        assert!(view.ray(0, 0).direction.z > 0.0 && view.ray(0, 239).direction.z < 0.0);
        assert_eq!(view.origin(), Vec3::new(1.0, 2.0, 0.8));
    }

    #[test]
    fn yaw_turns_left_and_pitch_looks_down() {
        let lens = Lens { width: 32, height: 32, field_of_view: 1.0, distortion: 0.0 };
        let half = std::f64::consts::FRAC_PI_2;
        let view = lens.view(&Pose { x: 0.0, y: 0.0, z: 1.0, yaw: half, pitch: 0.5 });
        let (a, b) = (view.ray(15, 16).direction, view.ray(16, 16).direction);
        assert!(a.y > 0.0 && a.z < 0.0);
        // looking along y, the right is +x
        assert!(b.x > a.x && a.x < 0.0 && b.x > 0.0);
    }
    #[test]
    fn rays_of_a_calibrated_camera() {
        let camera = Camera { height: 0.8, pitch: 51.0, field_of_view: 90.0, distortion: -0.3 };
        let view = camera.lens(320, 240).view(&camera.pose(0.0, 0.0, 0.0));
        let ground = crate::camera::ground::Ground::new(&camera, 320, 240);
        for (column, row) in [(0, 1), (77, 130), (160, 239), (319, 200)] {
            let (found, ray) = (ground.locate(column, row as f32), view.ray(column, row).direction);
            let distance = camera.height * ray.x.hypot(ray.y) / -ray.z;
            assert!((f64::from(found.distance) / distance - 1.0).abs() < 1e-5, "{found:?} {distance}");
            assert!((f64::from(found.bearing) - ray.y.atan2(ray.x)).abs() < 1e-5, "{found:?}");
        }
        // The field of view is that of the edges whatever the distortion is.
        let straight = Camera { distortion: 0.0, ..camera };
        let straight = straight.lens(320, 240).view(&straight.pose(0.0, 0.0, 0.0));
        let apart = |x, y| (view.ray(x, y).direction - straight.ray(x, y).direction).length();
        assert!(apart(0, 120) < 0.01 && apart(0, 0) > 0.1 && apart(80, 120) > 0.05);
    }
}
