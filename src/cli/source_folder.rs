//! Folders of images as the source of a run's cases: which parts of them are trained on, held out, or choose the winner.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};
use vsonar::dataset::{self, DEFAULT_GAP, Dataset, ParsePartError, Unit};

use super::CliError;
use super::cases::Cases;

/// Folders of images; the paths are absolute.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Folder {
    pub(crate) train: PathBuf,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) holdout: Option<PathBuf>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) train_match: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) holdout_match: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) holdout_part: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) validation: Option<PathBuf>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) validation_match: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) validation_part: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) split_by: Option<Unit>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) gap: Option<u32>,
}

impl Folder {
    /// Whether what is said of the parts goes together.
    pub(super) fn check(&self) -> Result<(), String> {
        let f = self;
        let parts = [
            ("holdout", [f.holdout.is_some(), f.holdout_match.is_some(), f.holdout_part.is_some()]),
            (
                "validation",
                [f.validation.is_some(), f.validation_match.is_some(), f.validation_part.is_some()],
            ),
        ];
        for (name, given) in parts {
            if given.iter().filter(|given| **given).count() > 1 {
                return Err(format!("of `{name}`, `{name}_match` and `{name}_part` only one can be given"));
            }
        }
        if f.holdout_match.is_some() && f.train_match.is_none() {
            return Err("`holdout_match` needs `train_match`, which says what to train on".to_string());
        }
        for (name, part) in [("holdout_part", &f.holdout_part), ("validation_part", &f.validation_part)] {
            if let Some(Err(error)) = part.as_ref().map(|part| part.parse::<dataset::Part>()) {
                return Err(format!("`{name}`: {error}"));
            }
        }
        Ok(())
    }

    /// Reads the images, each folder below `limit` bytes of memory.
    pub(super) fn load(&self, limit: u64) -> Result<Cases, CliError> {
        let all = Dataset::load_within(&self.train, limit)?;
        let unit = self.split_by.unwrap_or_else(|| all.unit());
        let gap = self.gap.unwrap_or(DEFAULT_GAP);
        let (mut train, mut holdout) = match (&self.train_match, &self.holdout_match) {
            (Some(train), Some(holdout)) => {
                let (train, holdout) = all.split(train, holdout)?;
                (train, Some(holdout))
            }
            (Some(train), None) => (all.select(train)?, None),
            (None, _) => (all, None),
        };
        let mut left_out = 0;
        let mut take = |train: &mut Dataset, part: &str| -> Result<Dataset, CliError> {
            // A recorded text is looked at as a flag is.
            let part: dataset::Part =
                part.parse().map_err(|e: ParsePartError| CliError::Failed(e.to_string()))?;
            let (rest, part) = train.hold_out(&part, unit, gap)?;
            left_out += train.images().len() - rest.images().len() - part.images().len();
            *train = rest;
            Ok(part)
        };
        if let Some(part) = &self.holdout_part {
            holdout = Some(take(&mut train, part)?);
        }
        if let Some(dir) = &self.holdout {
            holdout = Some(Dataset::load_within(dir, limit)?);
        }
        let validation = match (&self.validation, &self.validation_match, &self.validation_part) {
            (Some(dir), ..) => Some(Dataset::load_within(dir, limit)?),
            (None, Some(glob), _) => {
                let (rest, part) = train.split_off(glob)?;
                train = rest;
                Some(part)
            }
            (None, None, Some(part)) => Some(take(&mut train, part)?),
            (None, None, None) => None,
        };
        Ok(Cases { train, validation, holdout, left_out })
    }
}
