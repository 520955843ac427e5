//! Sources of cases that are rendered: the built-in corridor, and synthetic offices.

use serde::{Deserialize, Serialize};
use vsonar::dataset::Dataset;
use vsonar::world::office::World;
use vsonar::world::{Corridor, FRAMES};

use super::CliError;
use super::cases::Cases;

/// The building of the built-in corridor that is trained on.
pub(crate) const BUILDING: u64 = 1;
/// The building that is held out.
pub(crate) const OTHER_BUILDING: u64 = 2;

/// The built-in corridor: two of its buildings.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Synthetic {
    #[serde(default = "building")]
    pub(super) building: u64,
    /// The building that chooses the winner, if one is to.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) validation_building: Option<u64>,
    #[serde(default = "other_building")]
    pub(super) holdout_building: u64,
    #[serde(default = "frames")]
    pub(super) frames: usize,
}

impl Synthetic {
    /// Renders the cases.
    pub(super) fn load(&self) -> Result<Cases, CliError> {
        let render = |building| Corridor::default().render(building, self.frames);
        let train = render(self.building)?;
        let validation = self.validation_building.map(render).transpose()?;
        Ok(Cases { train, validation, holdout: Some(render(self.holdout_building)?), left_out: 0 })
    }
}

/// A synthetic office: what is recorded in it is trained on, and what is in two other buildings of the kind.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Recorded {
    pub(super) name: World,
    /// The building that chooses the winner.
    #[serde(default = "validation_office")]
    pub(super) validation_building: u64,
    #[serde(default = "other_office")]
    pub(super) holdout_building: u64,
    /// Pictures of each building, if not as many as the world has.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) frames: Option<usize>,
}

impl Recorded {
    pub(super) fn check(&self) -> Result<(), String> {
        if self.validation_building == self.holdout_building {
            return Err(format!(
                "`validation_building` and `holdout_building` of `world` are both {}; choose two buildings",
                self.holdout_building
            ));
        }
        match self.frames {
            Some(frames) if !(1..=10_000).contains(&frames) => {
                Err(format!("`frames` of `world` is {frames}; choose 1 to 10000"))
            }
            _ => Ok(()),
        }
    }

    /// All pictures of a world, the usual building held out.
    pub(crate) fn of(name: World) -> Recorded {
        let (validation_building, holdout_building) = (validation_office(), other_office());
        Recorded { name, validation_building, holdout_building, frames: None }
    }

    /// The world.
    pub(crate) fn world(&self) -> World {
        self.name
    }

    /// Pictures of each building, if not as many as the world has.
    pub(crate) fn frames(&self) -> Option<usize> {
        self.frames
    }

    /// The building that is held out.
    pub(crate) fn holdout_building(&self) -> u64 {
        self.holdout_building
    }

    /// The pictures to train on.
    pub(crate) fn training(&self) -> Result<Dataset, CliError> {
        Ok(self.name.recorded(None, false, self.frames)?)
    }

    /// Those that are held out.
    pub(crate) fn held_out(&self) -> Result<Dataset, CliError> {
        Ok(self.name.recorded(Some(self.holdout_building), false, self.frames)?)
    }

    /// Records the cases.
    pub(super) fn load(&self) -> Result<Cases, CliError> {
        let validation = Some(self.name.recorded(Some(self.validation_building), false, self.frames)?);
        Ok(Cases { train: self.training()?, validation, holdout: Some(self.held_out()?), left_out: 0 })
    }
}

fn validation_office() -> u64 {
    1
}

pub(crate) fn other_office() -> u64 {
    2
}

fn building() -> u64 {
    BUILDING
}

fn other_building() -> u64 {
    OTHER_BUILDING
}

fn frames() -> usize {
    FRAMES
}
