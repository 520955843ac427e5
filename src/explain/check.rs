//! Holding a listing's text against the program's detector.

use image::{GrayImage, Luma};
use serde::Serialize;
use vsonar_ir::generate::Random;
use vsonar_ir::{Program, Windows};

use super::ExplainError;
use super::listing::Listing;
use crate::dataset::Dataset;
use crate::detector::{Detector, ProgramDetector};
use crate::vision::WindowSums;

/// What a listing was held against.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Checked {
    /// How many answers were compared, all of them the same to the bit.
    pub answers: usize,
    /// On which images.
    pub on: String,
}

/// Random images beside which a program without data is run.
const IMAGES: usize = 6;
/// Columns of each.
const COLUMNS: u32 = 24;
/// Pixels of all of them together, about.
const PIXELS: usize = 4 << 20;

/// The text, read back, and the detector it is held against.
pub(super) struct Check {
    listing: Listing,
    detector: ProgramDetector,
}

impl Check {
    pub(super) fn new(text: &str, program: &Program) -> Result<Check, ExplainError> {
        let listing = text.parse().map_err(ExplainError::Unreadable)?;
        Ok(Check { listing, detector: ProgramDetector::new(program) })
    }

    /// Why the program is interpreted and not compiled, if it is.
    pub(super) fn why_interpreted(&self) -> Option<String> {
        self.detector.why_interpreted().map(ToString::to_string)
    }

    fn compare<W: Windows + ?Sized>(
        &self,
        image: &GrayImage,
        name: &str,
        windows: &W,
        columns: &[u32],
    ) -> Result<(), ExplainError> {
        let mut rows = vec![0.0; columns.len()];
        self.detector.detect(image, columns, &mut rows)?;
        for (&column, &compiled) in columns.iter().zip(&rows) {
            let read = self.listing.answer(windows, column as f32);
            if read.to_bits() != compiled.to_bits() && !(read.is_nan() && compiled.is_nan()) {
                return Err(ExplainError::Mismatch { image: name.to_string(), column, read, compiled });
            }
        }
        Ok(())
    }

    /// All cases of a data set.
    pub(super) fn on_data(&self, set: &Dataset) -> Result<Checked, ExplainError> {
        let cases = set.case_set();
        for (i, case) in set.cases().iter().enumerate() {
            let image = &set.images()[case.image];
            self.compare(&image.pixels, &image.name, cases.image(i), &[case.x])?;
        }
        Ok(Checked { answers: set.cases().len(), on: set.name().to_string() })
    }

    /// Random images ([`random_images`]).
    pub(super) fn on_images(&self, images: &[GrayImage]) -> Result<Checked, ExplainError> {
        let width = self.detector.width();
        let mut answers = 0;
        for image in images {
            let columns: Vec<u32> = (0..COLUMNS).map(|i| i * (width - 1) / (COLUMNS - 1)).collect();
            self.compare(image, "a random image", &WindowSums::new(image), &columns)?;
            answers += columns.len();
        }
        let plural = if images.len() == 1 { "" } else { "s" };
        Ok(Checked { answers, on: format!("{} random image{plural}", images.len()) })
    }
}

/// Images of noise, ramps and blocks, always the same.
pub(super) fn random_images(width: u32, height: u32) -> Vec<GrayImage> {
    let images = (PIXELS / (width as usize * height as usize)).clamp(1, IMAGES);
    (0..images as u64).map(|seed| random_image(seed, width, height)).collect()
}

/// Noise above a ramp, with a few even blocks, so that every operator has small and large values.
fn random_image(seed: u64, width: u32, height: u32) -> GrayImage {
    let mut random = Random::new(seed);
    let (noise, dark) = (1 + random.below(120) as u32, random.below(100) as u32);
    let mut image = GrayImage::from_fn(width, height, |x, y| {
        let ramp = (x * 60 / width) + (y * 60 / height);
        Luma([(dark + ramp + random.below(noise as usize) as u32).min(255) as u8])
    });
    for _ in 0..12 {
        let (left, top) = (random.below(width as usize) as u32, random.below(height as usize) as u32);
        let (w, h) =
            (1 + random.below(width as usize / 3) as u32, 1 + random.below(height as usize / 3) as u32);
        let value = Luma([random.below(256) as u8]);
        for y in top..(top + h).min(height) {
            for x in left..(left + w).min(width) {
                image.put_pixel(x, y, value);
            }
        }
    }
    image
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dataset::{Case, NamedImage};
    use crate::lower::lower;
    use crate::tree::Individual;

    #[test]
    fn a_text_that_means_something_else_is_found_out() {
        let individual: Individual =
            "(individual (iterate-up 3x3 x-obstacle (if-le gradient 50 0 (prog2 (set-a y) break))))"
                .parse()
                .expect("a program");
        let program = vsonar_ir::opt::optimise(&lower(&individual, 40, 30));
        let text = Listing::of(&program).expect("readable").to_string();
        let images = random_images(40, 30);
        let named = images.iter().enumerate();
        let named = named.map(|(i, pixels)| NamedImage { name: i.to_string(), pixels: pixels.clone() });
        let cases = (0..images.len()).flat_map(|image| [3, 20].map(|x| Case { image, x, y: 9 })).collect();
        let set = Dataset::new("set", named.collect(), cases).expect("sound");
        let right = Check::new(&text, &program).expect("reads");
        assert_eq!(right.on_images(&images).expect("the same").answers, images.len() * COLUMNS as usize);
        assert_eq!(right.on_data(&set).expect("the same").answers, 2 * images.len());
        for wrong in
            [text.replace("> 50", "> 90"), text.replace(":= y", ":= y + 1"), text.replace("stop", "b := 1")]
        {
            let check = Check::new(&wrong, &program).expect("reads");
            assert!(matches!(check.on_images(&images), Err(ExplainError::Mismatch { .. })), "{wrong}");
            assert!(matches!(check.on_data(&set), Err(ExplainError::Mismatch { .. })), "{wrong}");
        }
        assert!(matches!(Check::new("images", &program), Err(ExplainError::Unreadable(_))));
    }
}
