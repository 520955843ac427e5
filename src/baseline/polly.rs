//! Polly: floor is what has no texture.
//!
//! I. Horswill, *Polly: a vision-based artificial agent*, AAAI-93; *Specialization of perceptual processes*, PhD thesis,
//! MIT, 1993. The robot's habitat has carpets without texture but at the highest spatial frequencies (his background
//! texture constraint), so that a smoothed and subsampled image (64 x 48 there) shows no edges on the floor. In each
//! column the lowest pixel with an edge is where the floor ends.
//!
//! The same here: the low-pass by averaging squares of pixels, further smoothing, a difference operator, one threshold,
//! and the search up the column. His numbers were set by hand for one building; here the size of the squares, the
//! smoothing and the threshold are tuned. Left out: the vanishing point, the landmarks and everything else by which Polly
//! found its way.

use image::GrayImage;
use serde::Serialize;

use super::pixels::{LEVEL, Plane, scaled};
use super::tune::{Choice, Tally, first_above, ladder};
use crate::dataset::Dataset;
use crate::detector::{DetectError, Detector, check_arguments};

/// Sides of the squares that are tried, in pixels of an image 240 pixels high.
const SCALES: [u32; 6] = [1, 2, 3, 4, 5, 8];
/// Most passes of smoothing that are tried.
const PASSES: u32 = 2;
/// How many thresholds are tried.
const THRESHOLDS: usize = 64;

fn thresholds() -> [f64; THRESHOLDS] {
    ladder(0.5, 200.0)
}

/// The first place, going up, at which a smoothed and subsampled image has an edge.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Polly {
    /// Width and height of the images, in pixels.
    #[serde(skip)]
    pub size: (u32, u32),
    /// Side of the squares that become one pixel, in pixels.
    pub scale: usize,
    /// How often the smaller image is smoothed by 1 2 1 along rows and columns.
    pub passes: u32,
    /// What the sum of the absolute differences to the next pixels above and to the right has to exceed, in gray levels.
    pub threshold: f64,
}

impl Polly {
    /// The best of its grid on these cases: squares of 1, 2, 3, 4, 5 or 8 pixels in an image 240 pixels high (of 5, the
    /// original's 64 x 48), no wider than the image, smoothed up to twice, 64 thresholds from 0.5 to 200 gray levels.
    pub(super) fn tune(set: &Dataset, tolerance: f64) -> (Polly, Choice) {
        let thresholds = thresholds();
        // One square at least beside the others: a tall image may be narrower than squares in scale with its height.
        let scale = |&scale: &u32| scaled(scale, set.height(), 240).min(set.width() as usize);
        let mut scales: Vec<usize> = SCALES.iter().map(scale).collect();
        scales.dedup();
        let passes = PASSES as usize + 1;
        let tally = Tally::of(set, tolerance, scales.len() * passes, THRESHOLDS, |image, cases, tally| {
            let image = &set.images()[image].pixels;
            for (i, &scale) in scales.iter().enumerate() {
                let mut plane = Plane::reduced(image, scale);
                for pass in 0..passes {
                    if pass > 0 {
                        plane = plane.smoothed();
                    }
                    for case in cases {
                        let edges = edges(&plane, scale, image.height(), case.x);
                        for (j, row) in first_above(edges, &thresholds).into_iter().enumerate() {
                            tally.answer(i * passes + pass, j, row, case);
                        }
                    }
                }
            }
        });
        let choice = tally.choose();
        let polly = Polly {
            size: (set.width(), set.height()),
            scale: scales[choice.setting / passes],
            passes: (choice.setting % passes) as u32,
            threshold: thresholds[choice.threshold],
        };
        (polly, choice)
    }

    pub(super) fn describe(&self) -> String {
        let Polly { size, scale, passes, threshold } = *self;
        let (width, height) = (size.0 as usize / scale, size.1 as usize / scale);
        let times = ["not smoothed", "smoothed once", "smoothed twice"];
        let smoothed = times.get(passes as usize).copied().unwrap_or("smoothed more");
        format!("{width} x {height} pixels, {smoothed}, edges above {threshold} gray levels")
    }
}

/// Rows of the image and the strength of the edge there, from below. The row is that of the upper end of a square: an
/// edge is between it and the next one above, or to the right.
fn edges(plane: &Plane, scale: usize, height: u32, x: u32) -> impl Iterator<Item = (usize, f64)> {
    let x = (x as usize / scale).min(plane.width - 1) as isize;
    let top = height as usize - plane.height * scale;
    (0..plane.height).rev().map(move |y| {
        let up = y as isize;
        let here = plane.at(x, up);
        let edge = (here - plane.at(x, up - 1)).abs() + (here - plane.at(x + 1, up)).abs();
        (top + y * scale, f64::from(edge) / f64::from(LEVEL))
    })
}

impl Detector for Polly {
    fn width(&self) -> u32 {
        self.size.0
    }

    fn height(&self) -> u32 {
        self.size.1
    }

    fn detect(&self, image: &GrayImage, columns: &[u32], rows: &mut [f32]) -> Result<(), DetectError> {
        check_arguments(self.size, image, columns, rows)?;
        let mut plane = Plane::reduced(image, self.scale);
        for _ in 0..self.passes {
            plane = plane.smoothed();
        }
        for (&x, row) in columns.iter().zip(rows) {
            [*row] = first_above(edges(&plane, self.scale, image.height(), x), &[self.threshold]);
        }
        Ok(())
    }
}
