//! How light or dark surfaces are: carpet, walls with skirting and doors, and what stands around.
//!
//! Albedo is the share of light given back, 0 to 1. Patterns are functions of the place in the world, so that they
//! stay where they are when the robot moves; what is finer than a pixel fades away instead of flickering.
//!
//! ```
//! use vsonar::world::building::Building;
//! let looks = Building::new(1).looks;
//! let fine = looks.floor(1.0, 0.2, 0.001);
//! assert!(fine > 0.0 && fine < 1.0);
//! ```

use super::building::Door;
use super::geometry::{Room, Vec3};
use super::noise::{smooth, white};

/// The looks of a building's floor and walls.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Looks {
    /// Seed of the patterns.
    pub seed: u64,
    /// Mean albedo of the carpet.
    pub carpet: f64,
    /// How much it varies, as a share of the mean.
    pub carpet_contrast: f64,
    /// Where a wide stripe crosses the floor.
    pub stripe: Room,
    /// Mean albedo of the stripe.
    pub stripe_albedo: f64,
    /// Albedo of the walls.
    pub wall: f64,
    /// Albedo of the skirting board.
    pub skirting: f64,
    /// Height of the skirting board in metres.
    pub skirting_height: f64,
    /// How much walls mirror: share of light mirrored at grazing angles.
    pub gloss: f64,
}

/// What is drawn on a solid.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Pattern {
    /// Cardboard with a strip of tape.
    Taped,
    /// A bin with a lighter rim.
    Rimmed,
    /// A pillar with a dark foot.
    Footed,
}

/// The finish of a solid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Finish {
    /// Mean albedo.
    pub albedo: f64,
    /// What is drawn on it.
    pub pattern: Pattern,
}

impl Looks {
    /// Albedo of the floor at a place, seen with pixels of this size in metres.
    pub fn floor(&self, x: f64, y: f64, pixel: f64) -> f64 {
        let base = if self.stripe.contains(x, y) { self.stripe_albedo } else { self.carpet };
        let fade = |scale: f64| {
            let ratio = pixel / scale;
            1.0 / (1.0 + ratio * ratio)
        };
        let layer = |salt: u64, scale: f64| {
            let noise = smooth(self.seed.wrapping_add(salt), x / scale, y / scale) - 0.5;
            2.0 * noise * fade(scale)
        };
        let grain = white(self.seed, (x * 200.0).floor() as i64, (y * 200.0).floor() as i64) - 0.5;
        // tiles of half a metre, laid by hand, differ a little
        let tile = white(self.seed ^ 7, (x * 2.0).floor() as i64, (y * 2.0).floor() as i64) - 0.5;
        let pattern = 0.35 * layer(1, 0.7)
            + 0.5 * layer(2, 0.035)
            + 0.4 * layer(3, 0.014)
            + 0.9 * grain * fade(0.005)
            + 0.2 * tile;
        (base * (1.0 + self.carpet_contrast * pattern)).max(0.01)
    }

    /// Albedo of a wall so far along its axis and at this height.
    pub fn wall(&self, doors: &[Door], along: f64, z: f64) -> f64 {
        for door in doors {
            let inner = (along - door.span.0).min(door.span.1 - along).min(door.height - z);
            if inner > -0.06 {
                // a frame, a dark gap, the leaf with its handle
                let handle = (z - 1.0).abs() < 0.03 && (along - door.span.1 + 0.12).abs() < 0.06;
                return match inner {
                    i if i < 0.0 => door.albedo * 0.6 + 0.1,
                    i if i < 0.012 || z < 0.012 => 0.02,
                    _ if handle => 0.7,
                    _ => door.albedo,
                };
            }
        }
        if z < self.skirting_height {
            return self.skirting;
        }
        // plaster is nearly even
        self.wall * (1.0 + 0.05 * (smooth(self.seed ^ 11, along / 1.3, z / 1.1) - 0.5))
    }
}

impl Finish {
    /// Albedo at a place of a solid of this height.
    pub fn albedo(&self, point: Vec3, normal: Vec3, height: f64) -> f64 {
        let z = point.z / height;
        let factor = match self.pattern {
            Pattern::Taped if normal.z > 0.0 => 1.1,
            Pattern::Taped if (0.44..0.56).contains(&z) => 1.25,
            Pattern::Rimmed if z > 0.92 => 2.0,
            Pattern::Footed if point.z < 0.08 => 0.3,
            _ => 1.0,
        };
        (self.albedo * factor).min(0.95)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::building::Building;

    #[test]
    fn detail_fades_with_distance() {
        let looks = Building::new(3).looks;
        let spread = |pixel: f64| {
            let values: Vec<f64> = (0..500).map(|i| looks.floor(0.1, f64::from(i) * 0.0011, pixel)).collect();
            let mean = values.iter().sum::<f64>() / 500.0;
            values.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>()
        };
        assert!(spread(0.1) < 0.25 * spread(0.001));
    }

    #[test]
    fn a_wall_has_skirting_and_doors() {
        let looks = Building::new(3).looks;
        let door = Door { span: (1.0, 1.9), height: 2.05, albedo: 0.4 };
        assert_eq!(looks.wall(&[door], 0.3, 0.01), looks.skirting);
        assert_eq!(looks.wall(&[door], 1.4, 0.5), 0.4);
        assert_eq!(looks.wall(&[door], 1.4, 0.005), 0.02);
        assert!(looks.wall(&[door], 1.4, 2.3) > 0.3);
    }
}
