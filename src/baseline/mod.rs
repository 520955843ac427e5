//! Rivals: detectors of the literature, written by hand, which an evolved one has to beat.
//!
//! The paper that this project follows names three that look for the lowest obstacle in a column; they are here with the
//! two that anybody would try first. Every one has a small grid of settings, documented with it, and is tuned by the
//! fitness on training cases alone. Of these they can be given what evolution has, altered copies of the images
//! included ([`Variation::grow`](crate::dataset::Variation::grow)); what they do not get is a second set that chooses
//! among several winners, for a grid has one.
//!
//! | rival | floor is | source |
//! |---|---|---|
//! | [`Constant`] | up to the same row as ever | |
//! | [`Gradient`] | up to the first strong gradient | |
//! | [`Polly`] | what has no texture | Horswill 1993 |
//! | [`Lorigo`] | what looks like the bottom of the image | Lorigo 1996 |
//! | [`Ulrich`] | what looks like ground driven over before | Ulrich and Nourbakhsh 2000 |
//!
//! The originals had colour where these have gray levels, and their thresholds were set by hand; each module says what is
//! the same and what is left out. All answer 0 where they see floor up to the top.
//!
//! ```
//! use vsonar::baseline::{Rival, answers};
//! use vsonar::dataset::TOLERANCE;
//! use vsonar::world::Corridor;
//!
//! let corridor = Corridor { width: 64, height: 48, ..Corridor::default() };
//! let (train, test) = (corridor.render(1, 6)?, corridor.render(2, 6)?);
//! let mut polly = Rival::Polly.tune(&train, TOLERANCE);
//! assert!(polly.correct() > 0 && polly.tried() > 100);
//! assert_eq!(answers(&mut polly, &test)?.len(), test.cases().len());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use std::str::FromStr;

use image::GrayImage;
use serde::Serialize;

use crate::dataset::Dataset;
use crate::detector::{DetectError, Motion, SequenceDetector};

mod constant;
mod gradient;
mod lorigo;
mod pixels;
mod polly;
pub(crate) mod tune;
mod ulrich;

pub use constant::Constant;
pub use gradient::Gradient;
pub use lorigo::{Combination, Lorigo};
pub use polly::Polly;
pub use ulrich::{Ulrich, UlrichSettings};

/// A detector to compare with.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Rival {
    /// The best constant of each column.
    Constant,
    /// A threshold on the gradient.
    Gradient,
    /// Texture against a floor without any (Horswill 1993).
    Polly,
    /// Difference from the bottom of the image (Lorigo 1996).
    Lorigo,
    /// Difference from ground already driven over (Ulrich and Nourbakhsh 2000).
    Ulrich,
}

/// A name that no rival has.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("there is no rival `{name}`; there are constant, gradient, polly, lorigo and ulrich")]
pub struct UnknownRival {
    /// The name.
    pub name: String,
}

impl FromStr for Rival {
    type Err = UnknownRival;

    fn from_str(name: &str) -> Result<Rival, UnknownRival> {
        let found = Rival::ALL.into_iter().find(|rival| rival.name() == name);
        found.ok_or_else(|| UnknownRival { name: name.to_string() })
    }
}

impl Rival {
    /// All of them, the simplest first.
    pub const ALL: [Rival; 5] =
        [Rival::Constant, Rival::Gradient, Rival::Polly, Rival::Lorigo, Rival::Ulrich];

    /// The name it is asked for by.
    pub const fn name(self) -> &'static str {
        match self {
            Rival::Constant => "constant",
            Rival::Gradient => "gradient",
            Rival::Polly => "polly",
            Rival::Lorigo => "lorigo",
            Rival::Ulrich => "ulrich",
        }
    }

    /// Where it is from; nothing if it is anybody's.
    pub const fn source(self) -> Option<&'static str> {
        match self {
            Rival::Constant | Rival::Gradient => None,
            Rival::Polly => Some("Horswill 1993"),
            Rival::Lorigo => Some("Lorigo 1996"),
            Rival::Ulrich => Some("Ulrich and Nourbakhsh 2000"),
        }
    }

    /// Whether altered copies of the images are of use to it. What remembers frames needs them in their order, and the best
    /// constants are what they are called: those of the images themselves.
    pub const fn takes_copies(self) -> bool {
        matches!(self, Rival::Gradient | Rival::Polly | Rival::Lorigo)
    }

    /// The best of its grid on these cases, an answer being correct within `tolerance` rows. It is for images of the
    /// set's size.
    ///
    /// It runs on rayon's pool; the result does not depend on the number of threads.
    pub fn tune(self, set: &Dataset, tolerance: f64) -> Tuned {
        let tuned = |detector, choice: tune::Choice| Tuned {
            rival: self,
            detector,
            correct: choice.correct,
            cases: set.cases().len(),
            tried: choice.tried,
        };
        match self {
            Rival::Constant => {
                let constant = Constant::tune(set, tolerance);
                let correct = constant.correct();
                let choice = tune::Choice { setting: 0, threshold: 0, correct, tried: set.height() as usize };
                tuned(Settings::Constant(constant), choice)
            }
            Rival::Gradient => {
                let (gradient, choice) = Gradient::tune(set, tolerance);
                tuned(Settings::Gradient(gradient), choice)
            }
            Rival::Polly => {
                let (polly, choice) = Polly::tune(set, tolerance);
                tuned(Settings::Polly(polly), choice)
            }
            Rival::Lorigo => {
                let (lorigo, choice) = Lorigo::tune(set, tolerance);
                tuned(Settings::Lorigo(lorigo), choice)
            }
            Rival::Ulrich => {
                let (ulrich, choice) = Ulrich::tune(set, tolerance);
                tuned(Settings::Ulrich(Box::new(ulrich)), choice)
            }
        }
    }
}

/// A tuned detector of each kind.
#[derive(Debug, Clone)]
enum Settings {
    Constant(Constant),
    Gradient(Gradient),
    Polly(Polly),
    Lorigo(Lorigo),
    Ulrich(Box<Ulrich>),
}

/// A rival with the settings that were best in training. As a [`SequenceDetector`] it is for images of the size it was
/// tuned on, and answers any column of them.
#[derive(Debug, Clone)]
pub struct Tuned {
    rival: Rival,
    detector: Settings,
    correct: usize,
    cases: usize,
    tried: usize,
}

impl Tuned {
    /// Which rival it is.
    pub const fn rival(&self) -> Rival {
        self.rival
    }

    /// Training cases it gets right.
    pub const fn correct(&self) -> usize {
        self.correct
    }

    /// Share of the training cases it gets right, 0 to 1.
    pub fn fitness(&self) -> f64 {
        self.correct as f64 / self.cases.max(1) as f64
    }

    /// How many settings were tried; for constants how many answers for each column.
    pub const fn tried(&self) -> usize {
        self.tried
    }

    /// The tuned settings in words.
    pub fn describe(&self) -> String {
        match &self.detector {
            Settings::Constant(constant) => constant.describe(),
            Settings::Gradient(gradient) => gradient.describe(),
            Settings::Polly(polly) => polly.describe(),
            Settings::Lorigo(lorigo) => lorigo.describe(),
            Settings::Ulrich(ulrich) => ulrich.describe(),
        }
    }

    fn detector(&mut self) -> &mut dyn SequenceDetector {
        match &mut self.detector {
            Settings::Constant(constant) => constant,
            Settings::Gradient(gradient) => gradient,
            Settings::Polly(polly) => polly,
            Settings::Lorigo(lorigo) => lorigo,
            Settings::Ulrich(ulrich) => &mut **ulrich,
        }
    }
}

/// The tuned settings as data, by the names of their fields.
impl Serialize for Tuned {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match &self.detector {
            Settings::Constant(constant) => constant.serialize(serializer),
            Settings::Gradient(gradient) => gradient.serialize(serializer),
            Settings::Polly(polly) => polly.serialize(serializer),
            Settings::Lorigo(lorigo) => lorigo.serialize(serializer),
            Settings::Ulrich(ulrich) => ulrich.settings().serialize(serializer),
        }
    }
}

impl SequenceDetector for Tuned {
    fn size(&self) -> (u32, u32) {
        match &self.detector {
            Settings::Constant(constant) => constant.size(),
            Settings::Gradient(gradient) => gradient.size,
            Settings::Polly(polly) => polly.size,
            Settings::Lorigo(lorigo) => lorigo.size,
            Settings::Ulrich(ulrich) => ulrich.settings().size,
        }
    }

    fn restart(&mut self) {
        self.detector().restart();
    }

    fn next(
        &mut self,
        image: &GrayImage,
        motion: Option<Motion>,
        columns: &[u32],
        rows: &mut [f32],
    ) -> Result<(), DetectError> {
        self.detector().next(image, motion, columns, rows)
    }
}

/// The answers of a detector to all cases of a set, in their order. It sees the images sequence by sequence, each
/// sequence from its start, in order, and is not told how the robot moved.
///
/// # Errors
/// If the set's images are not of the detector's size.
pub fn answers(detector: &mut dyn SequenceDetector, set: &Dataset) -> Result<Vec<f32>, DetectError> {
    let mut cases = vec![Vec::new(); set.images().len()];
    for (i, case) in set.cases().iter().enumerate() {
        cases[case.image].push(i);
    }
    let mut answers = vec![0.0; set.cases().len()];
    for sequence in set.sequences() {
        detector.restart();
        for image in sequence.images {
            let columns: Vec<u32> = cases[image].iter().map(|&i| set.cases()[i].x).collect();
            let mut rows = vec![0.0; columns.len()];
            detector.next(&set.images()[image].pixels, None, &columns, &mut rows)?;
            cases[image].iter().zip(rows).for_each(|(&i, row)| answers[i] = row);
        }
    }
    Ok(answers)
}

#[cfg(test)]
mod tests;
