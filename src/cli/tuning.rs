//! What rivals are tuned on: what evolution is given.

use vsonar::baseline::{Rival, Tuned};
use vsonar::dataset::{Dataset, Variation};
use vsonar::evolve::Settings;

/// The altered copies of training images that a run has.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Copies {
    variation: Variation,
    seed: u64,
}

/// Those of a run by default, for a program that is of no run.
impl Default for Copies {
    fn default() -> Copies {
        Copies::of(&Settings::default_preset())
    }
}

impl Copies {
    pub(crate) fn of(settings: &Settings) -> Copies {
        Copies { variation: settings.variation(), seed: settings.seed }
    }

    /// How many there are of each image.
    pub(crate) fn per_image(self) -> u32 {
        self.variation.copies()
    }

    /// So many copies of each image, in words that follow those for the images.
    pub(crate) fn words(per_image: u32) -> &'static str {
        match per_image {
            0 => "",
            1 => " and, but for constant and ulrich, on an altered copy of each",
            _ => " and, but for constant and ulrich, on altered copies of each",
        }
    }

    /// Tunes rivals one after the other on these images.
    pub(crate) fn tuner(self, train: &Dataset, tolerance: f64) -> Tuner<'_> {
        Tuner { train, grown: self.variation.grow(train, self.seed), tolerance }
    }
}

/// Training images without and with the copies.
pub(crate) struct Tuner<'a> {
    train: &'a Dataset,
    grown: Dataset,
    tolerance: f64,
}

impl Tuner<'_> {
    /// Tunes one, with the copies if they are of use to it.
    pub(crate) fn tune(&self, rival: Rival) -> Tuned {
        rival.tune(if rival.takes_copies() { &self.grown } else { self.train }, self.tolerance)
    }
}
