//! Transforms of a labelled set: what would have been labelled, had the light, the lens or the view been another.
//!
//! A transform changes images and moves the cases along with what they point at. What it does to an image is exact and
//! the same on every machine; noise comes from a stream of its own for each image.
//!
//! ```
//! use image::{GrayImage, Luma};
//! use vsonar::dataset::{Case, Dataset, NamedImage, Transform};
//!
//! let pixels = GrayImage::from_fn(32, 24, |x, y| Luma([(8 * x + y) as u8]));
//! let image = NamedImage { name: "a.png".into(), pixels };
//! let set = Dataset::new("one", vec![image], vec![Case { image: 0, x: 4, y: 10 }])?;
//!
//! let mirrored = set.transformed(Transform::Mirror)?;
//! assert_eq!(mirrored.cases(), [Case { image: 0, x: 27, y: 10 }]);
//! assert_eq!(mirrored.transformed(Transform::Mirror)?, set);
//! let lower = set.transformed(Transform::Shift { right: 0, down: 20 })?;
//! assert_eq!(lower.cases()[0].y, 23, "the foot of the obstacle is below the image");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use image::GrayImage;
use rayon::prelude::*;

use super::{Case, Dataset, NamedImage, pixels};
use crate::tree::Random;

/// A change of a labelled image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Transform {
    /// Left and right exchanged: column x becomes width - 1 - x, and cases with it.
    Mirror,
    /// Every gray level times a factor, clamped: the light, the exposure, or the area of the iris.
    Gain(f64),
    /// So many gray levels added, clamped.
    Brightness(f64),
    /// The distance of every level from 127.5 times a factor, clamped.
    Contrast(f64),
    /// 255 (level / 255)^exponent: another response of the sensor. Below 1 lifts what is dark.
    Gamma(f64),
    /// Gaussian noise, rounded and clamped, on each pixel by itself.
    Noise {
        /// Standard deviation in gray levels.
        deviation: f64,
        /// Number that the noise is drawn from; each image of a set has a stream of its own.
        seed: u64,
    },
    /// A Gaussian blur: its standard deviation in pixels. It is cut off at three of them, and the border repeated.
    Blur(f64),
    /// The picture moved by whole pixels, the border repeated into what becomes free. Down is about what a camera
    /// that looks up a little does to the picture, right what one does that turns left.
    ///
    /// Cases move along. One whose column leaves the image is dropped, for nobody can ask for it. One whose row
    /// leaves at the bottom has its obstacle in the bottom pixel, so the label is height - 1; one that leaves at the top
    /// has ground as far as the image goes, so the label is 0. For the same reasons a label of 0 stays 0 when the
    /// picture moves down, and height - 1 stays when it moves up: what is repeated into the image is ground there, and
    /// obstacle here. (A label 0 may also mean an obstacle in the topmost row alone; such a case is wrong by at most
    /// the shift.)
    Shift {
        /// Pixels to the right; negative ones to the left.
        right: i32,
        /// Pixels down; negative ones up.
        down: i32,
    },
}

/// No case is left of a set, for all columns were moved out of the image.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("no case of the set `{0}` is left within the image; shift it by less than its width")]
pub struct NothingLeft(String);

/// The generation that noise is drawn as: one that no run has.
const NOISE: u32 = u32::MAX;

impl Transform {
    /// The image, changed. `number` tells images of a set apart, which matters to noise alone.
    pub fn image(self, image: &GrayImage, number: u32) -> GrayImage {
        match self {
            Transform::Mirror => pixels::mirrored(image),
            Transform::Gain(factor) => pixels::toned(image, &pixels::gain(factor)),
            Transform::Brightness(levels) => pixels::toned(image, &pixels::offset(levels)),
            Transform::Contrast(factor) => pixels::toned(image, &pixels::contrast(factor)),
            Transform::Gamma(exponent) => pixels::toned(image, &pixels::gamma(exponent)),
            Transform::Noise { deviation, seed } => {
                pixels::noisy(image, deviation, &mut Random::stream(seed, NOISE, number))
            }
            Transform::Blur(deviation) => pixels::blurred(image, deviation),
            Transform::Shift { right, down } => pixels::shifted(image, right, down),
        }
    }

    /// The case of an image of this size after the change; none if its column leaves the image.
    pub fn case(self, case: Case, width: u32, height: u32) -> Option<Case> {
        match self {
            Transform::Mirror => Some(Case { x: width - 1 - case.x, ..case }),
            Transform::Shift { right, down } => {
                let x = i64::from(case.x) + i64::from(right);
                let inside = (0..i64::from(width)).contains(&x);
                inside.then(|| Case { x: x as u32, y: lowered(case.y, down, height), ..case })
            }
            _ => Some(case),
        }
    }
}

/// A label after the picture moved down; see [`Transform::Shift`].
fn lowered(label: u32, down: i32, height: u32) -> u32 {
    let last = height - 1;
    if (label == 0 && down > 0) || (label == last && down < 0) {
        return label;
    }
    (i64::from(label) + i64::from(down)).clamp(0, i64::from(last)) as u32
}

impl Dataset {
    /// The set with every image and its cases changed; names and order stay, cases whose columns leave the image do
    /// not.
    ///
    /// # Errors
    /// If no case is left.
    pub fn transformed(&self, transform: Transform) -> Result<Dataset, NothingLeft> {
        let change = |(number, image): (usize, &NamedImage)| NamedImage {
            name: image.name.clone(),
            pixels: transform.image(&image.pixels, number as u32),
        };
        let images = self.images.par_iter().enumerate().map(change).collect();
        let cases = self.cases.iter().filter_map(|&case| transform.case(case, self.width, self.height));
        // All promises of a set are kept but that it has a case.
        Dataset::new(self.name.clone(), images, cases.collect()).map_err(|_| NothingLeft(self.name.clone()))
    }
}
