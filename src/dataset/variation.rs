//! Augmentation: altered copies of the images of a set, each drawn at random within limits.
//!
//! ```
//! use vsonar::dataset::Variation;
//! use vsonar::world::Corridor;
//!
//! let set = Corridor { width: 64, height: 48, ..Corridor::default() }.render(1, 3)?;
//! let variation = Variation { copies: 2, mirror: 0.5, gain: 0.2, ..Variation::NONE };
//! let grown = variation.grow(&set, 7);
//! assert_eq!(grown.images().len(), 9);
//! assert_eq!(grown.cases()[..set.cases().len()], *set.cases());
//! assert_eq!(Variation::NONE.grow(&set, 7), set);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use std::collections::BTreeSet;

use rayon::prelude::*;

use super::transform::Transform;
use super::{Case, Dataset, NamedImage};
use crate::tree::Random;

/// How far the copies of an image may differ from it. Every copy has its own draw from each of the limits; 0 leaves
/// that alteration out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Variation {
    /// Altered copies of each image.
    pub copies: u32,
    /// Probability that a copy is mirrored.
    pub mirror: f64,
    /// Greatest change of the light, as a share: the levels are multiplied by a factor from 1 / (1 + gain) to
    /// 1 + gain, log-uniform.
    pub gain: f64,
    /// Greatest change of brightness in gray levels, either way, uniform.
    pub brightness: f64,
    /// Greatest change of contrast, as a share, drawn like the gain.
    pub contrast: f64,
    /// Greatest change of the exponent of the response, as a share, drawn like the gain.
    pub gamma: f64,
    /// Greatest standard deviation of Gaussian noise, in gray levels; uniform from 0.
    pub noise: f64,
    /// Greatest standard deviation of a Gaussian blur, in pixels; uniform from 0.
    pub blur: f64,
    /// Greatest shift to the right or left, in whole pixels, uniform.
    pub shift_x: u32,
    /// Greatest shift up or down, in whole pixels, uniform.
    pub shift_y: u32,
}

/// Copies are drawn from the streams of generations that no run has, counted down from this one.
const COPY: u32 = u32::MAX - 1;

impl Variation {
    /// No alteration, so no copies.
    pub const NONE: Variation = Variation {
        copies: 0,
        mirror: 0.0,
        gain: 0.0,
        brightness: 0.0,
        contrast: 0.0,
        gamma: 0.0,
        noise: 0.0,
        blur: 0.0,
        shift_x: 0,
        shift_y: 0,
    };

    /// How many copies of an image are made: none where there is no alteration.
    pub fn copies(&self) -> u32 {
        let unaltered = Variation { copies: self.copies, ..Variation::NONE };
        if *self == unaltered { 0 } else { self.copies }
    }

    /// The changes of a copy, in the order in which a camera makes them: view, lens, light, sensor.
    ///
    /// As many numbers are drawn whatever is left out, so that leaving one alteration out changes no other.
    fn draw(&self, random: &mut Random) -> Vec<Transform> {
        let mirrored = random.chance(self.mirror);
        let [right, down] = [self.shift_x, self.shift_y].map(|most| {
            let drawn = random.below(2 * u64::from(most) + 1);
            (drawn as i64 - i64::from(most)) as i32
        });
        let blur = self.blur * random.unit();
        let [gain, gamma, contrast] = [self.gain, self.gamma, self.contrast].map(|share| {
            let half_range = libm::log1p(share);
            libm::exp(half_range * (2.0 * random.unit() - 1.0))
        });
        let brightness = self.brightness * (2.0 * random.unit() - 1.0);
        let (deviation, seed) = (self.noise * random.unit(), random.bits());
        let all = [
            (mirrored, Transform::Mirror),
            (right != 0 || down != 0, Transform::Shift { right, down }),
            (self.blur > 0.0, Transform::Blur(blur)),
            (self.gain > 0.0, Transform::Gain(gain)),
            (self.gamma > 0.0, Transform::Gamma(gamma)),
            (self.contrast > 0.0, Transform::Contrast(contrast)),
            (self.brightness > 0.0, Transform::Brightness(brightness)),
            (self.noise > 0.0, Transform::Noise { deviation, seed }),
        ];
        all.into_iter().filter_map(|(is_on, transform)| is_on.then_some(transform)).collect()
    }

    /// The set with its copies: first the set as it is, then a copy of every image, then the next copies. Cases whose
    /// columns were moved out of the image are left out, and so are images without any.
    ///
    /// A function of set, limits and seed alone. Each copy of each image draws from its own stream of random
    /// numbers; in a set with more images these have the same copies.
    pub fn grow(&self, set: &Dataset, seed: u64) -> Dataset {
        let images = set.images.len();
        let plans: Vec<Vec<Transform>> = (0..self.copies())
            .flat_map(|copy| (0..images).map(move |image| (copy, image)))
            .map(|(copy, image)| self.draw(&mut Random::stream(seed, COPY - copy, image as u32)))
            .collect();
        let mut of_image: Vec<Vec<Case>> = vec![Vec::new(); images];
        set.cases.iter().for_each(|&case| of_image[case.image].push(case));
        let mut grown = set.clone();
        let mut taken: BTreeSet<String> = set.images.iter().map(|image| image.name.clone()).collect();
        let mut made: Vec<(usize, &[Transform])> = Vec::new();
        for (n, plan) in plans.iter().enumerate() {
            let original = n % images;
            let moved = |case: &Case| {
                plan.iter().try_fold(*case, |case, change| change.case(case, set.width, set.height))
            };
            let cases: Vec<Case> = of_image[original].iter().filter_map(moved).collect();
            if !cases.is_empty() {
                let image = images + made.len();
                grown.cases.extend(cases.into_iter().map(|case| Case { image, ..case }));
                made.push((n, plan));
            }
        }
        let copies = made.par_iter().map(|&(n, plan)| {
            let change = |pixels, transform: &Transform| transform.image(&pixels, 0);
            plan.iter().fold(set.images[n % images].pixels.clone(), change)
        });
        let copies: Vec<_> = copies.collect();
        for (&(n, _), pixels) in made.iter().zip(copies) {
            let mut name = format!("{}~{}", set.images[n % images].name, 1 + n / images);
            while !taken.insert(name.clone()) {
                name.push('~');
            }
            grown.images.push(NamedImage { name, pixels });
        }
        grown
    }

    /// Bytes that a set takes with its copies at most: as [`Dataset::memory_needed`], and the pixels of the copies.
    pub fn memory_needed(&self, set: &Dataset) -> u64 {
        let times = 1 + self.copies() as usize;
        let (images, cases) = (set.images.len() * times, set.cases.len() * times);
        let pixels = u64::from(set.width) * u64::from(set.height);
        set.memory_for(images, cases) + (images - set.images.len()) as u64 * pixels
    }
}
