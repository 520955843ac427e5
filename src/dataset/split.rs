//! Taking a set apart by the names of its images: neighbouring frames of a run are near-duplicates, so whole
//! runs go to one side or the other.
//!
//! ```
//! use image::GrayImage;
//! use vsonar::dataset::{Case, Dataset, NamedImage};
//!
//! let images = ["run_A_1.png", "run_A_2.png", "run_B_1.png"]
//!     .map(|name| NamedImage { name: name.into(), pixels: GrayImage::new(16, 16) });
//! let cases = (0..3).map(|image| Case { image, x: 8, y: 8 }).collect();
//! let set = Dataset::new("runs", images.into(), cases)?;
//! let (train, holdout) = set.split("run_A*", "run_[BC]*")?;
//! assert_eq!((train.images().len(), holdout.images().len()), (2, 1));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use std::collections::BTreeMap;

use globset::{GlobBuilder, GlobMatcher};

use super::{Dataset, NamedImage};
use crate::support::printable::line;

/// Why a set could not be taken apart.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum SplitError {
    /// The pattern is malformed.
    #[error("the pattern `{pattern}` is malformed: {cause}; `*`, `?`, `[AB]` and `{{a,b}}` are understood")]
    Pattern {
        /// The pattern.
        pattern: String,
        /// What is wrong with it.
        cause: String,
    },
    /// No image has such a name.
    #[error("no image of the set `{}` matches `{pattern}`; its images are named like {}", line(.set), line(.examples))]
    Nothing {
        /// The pattern.
        pattern: String,
        /// Name of the set.
        set: String,
        /// Some of the names there are.
        examples: String,
    },
    /// Every image has such a name, so nothing is left to train on.
    #[error(
        "every image of the set `{set}` matches `{pattern}`, so none is left to train on; choose a narrower pattern"
    )]
    Everything {
        /// The pattern.
        pattern: String,
        /// Name of the set.
        set: String,
    },
    /// No part can be taken from the set as it was asked for.
    #[error("the set `{}` cannot be taken apart by `{part}`: {}", line(.set), line(.cause))]
    Part {
        /// The part.
        part: String,
        /// Name of the set.
        set: String,
        /// Why not, and what would do.
        cause: String,
    },
    /// Some images match both patterns.
    #[error(
        "{count} image(s), the first `{}`, match both `{train}` and `{holdout}`; \
         choose patterns that have no image in common", line(.image)
    )]
    Overlap {
        /// How many.
        count: usize,
        /// The first of them.
        image: String,
        /// The pattern for training.
        train: String,
        /// The pattern for the held-out part.
        holdout: String,
    },
}

fn matcher(pattern: &str) -> Result<GlobMatcher, SplitError> {
    // set here, for the default depends on the platform
    let glob = GlobBuilder::new(pattern).backslash_escape(true).build();
    let glob =
        glob.map_err(|e| SplitError::Pattern { pattern: pattern.into(), cause: e.kind().to_string() })?;
    Ok(glob.compile_matcher())
}

impl Dataset {
    /// The part of the set whose images' names, as they stand in the table, match a glob pattern as a whole
    /// (`*` any characters, `?` one, `[AB]` one of these, `{a,b}` either). The part keeps the set's name, with
    /// the pattern in brackets, and the order.
    ///
    /// # Errors
    /// If the pattern is malformed or matches nothing.
    pub fn select(&self, pattern: &str) -> Result<Dataset, SplitError> {
        let matcher = matcher(pattern)?;
        let chosen = |image: usize| matcher.is_match(&self.images[image].name);
        self.subset(format!("{}[{pattern}]", self.name), chosen).ok_or_else(|| {
            let (pattern, set) = (pattern.into(), self.name.clone());
            SplitError::Nothing { pattern, set, examples: self.examples() }
        })
    }

    /// What matches a pattern, and all the rest, which goes first.
    ///
    /// # Errors
    /// If the pattern is malformed, or matches nothing or everything.
    pub fn split_off(&self, pattern: &str) -> Result<(Dataset, Dataset), SplitError> {
        let part = self.select(pattern)?;
        let matcher = matcher(pattern)?;
        let rest =
            self.subset(format!("{}[not {pattern}]", self.name), |i| !matcher.is_match(&self.images[i].name));
        let everything = || SplitError::Everything { pattern: pattern.into(), set: self.name.clone() };
        Ok((rest.ok_or_else(everything)?, part))
    }

    /// The chosen images, by their numbers, with their cases, in order; `None` if no image is chosen.
    pub(super) fn subset(&self, name: String, chosen: impl Fn(usize) -> bool) -> Option<Dataset> {
        let mut place = vec![None; self.images.len()];
        let mut images: Vec<NamedImage> = Vec::new();
        for (i, image) in self.images.iter().enumerate().filter(|&(i, _)| chosen(i)) {
            place[i] = Some(images.len());
            images.push(image.clone());
        }
        let cases = self.cases.iter();
        let cases = cases.filter_map(|&c| Some(super::Case { image: place[c.image]?, ..c })).collect();
        let groups = BTreeMap::new();
        let set = Dataset { name, images, cases, groups, folder: self.folder.clone(), ..*self };
        (!set.images.is_empty()).then(|| Dataset { groups: set.kept(&self.groups), ..set })
    }

    /// A part to train on and a part to hold out. Images that match neither pattern are in neither part.
    ///
    /// # Errors
    /// If a pattern is malformed or matches nothing, or an image matches both.
    pub fn split(&self, train: &str, holdout: &str) -> Result<(Dataset, Dataset), SplitError> {
        let (a, b) = (matcher(train)?, matcher(holdout)?);
        let mut both = self.images.iter().filter(|i| a.is_match(&i.name) && b.is_match(&i.name));
        if let Some(first) = both.next() {
            return Err(SplitError::Overlap {
                count: 1 + both.count(),
                image: first.name.clone(),
                train: train.into(),
                holdout: holdout.into(),
            });
        }
        Ok((self.select(train)?, self.select(holdout)?))
    }

    /// First, middle and last name.
    fn examples(&self) -> String {
        let last = self.images.len() - 1;
        let mut picks = vec![0, last / 2, last];
        picks.dedup();
        let names: Vec<String> = picks.iter().map(|&i| format!("`{}`", self.images[i].name)).collect();
        names.join(", ")
    }
}
