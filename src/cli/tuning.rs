//! What rivals are tuned on: what evolution is given.

use std::cell::OnceCell;

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

    /// Which of these rivals are tuned on so many copies of each image too, in words that follow those for the images;
    /// nothing if none is.
    pub(crate) fn words(per_image: u32, rivals: impl IntoIterator<Item = Rival>) -> String {
        let names: Vec<&str> =
            rivals.into_iter().filter(|rival| rival.takes_copies()).map(Rival::name).collect();
        match (names.is_empty(), per_image) {
            (true, _) | (_, 0) => String::new(),
            (false, 1) => format!(" ({} on an altered copy of each, too)", names.join(", ")),
            (false, copies) => format!(" ({} on {copies} altered copies of each, too)", names.join(", ")),
        }
    }

    /// Tunes rivals one after the other on these images.
    pub(crate) fn tuner(self, train: &Dataset, tolerance: f64) -> Tuner<'_> {
        Tuner { train, copies: self, grown: OnceCell::new(), tolerance }
    }
}

/// Training images without and with the copies.
pub(crate) struct Tuner<'a> {
    train: &'a Dataset,
    copies: Copies,
    grown: OnceCell<Dataset>,
    tolerance: f64,
}

impl Tuner<'_> {
    /// Tunes one, with the copies if they are of use to it.
    pub(crate) fn tune(&self, rival: Rival) -> Tuned {
        let grown = || self.grown.get_or_init(|| self.copies.variation.grow(self.train, self.copies.seed));
        rival.tune(if rival.takes_copies() { grown() } else { self.train }, self.tolerance)
    }
}
