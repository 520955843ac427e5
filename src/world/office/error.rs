//! What no office can be built or recorded by.

use super::plan::PlanError;
use crate::world::SetupError;

/// Why an office cannot be built or recorded.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum OfficeError {
    /// The pictures cannot be rendered.
    #[error(transparent)]
    Setup(#[from] SetupError),
    /// The plan is none.
    #[error("the plan, printed: {0}")]
    Plan(#[from] PlanError),
    /// A robot cannot stand where the plan lets a run begin.
    #[error(
        "a robot {width} m wide cannot stand at ({x}, {y}), where a run begins; move the `start` farther from walls and \
         things"
    )]
    Start {
        /// Its place among the plan's starts.
        start: usize,
        /// In metres.
        x: f64,
        /// In metres.
        y: f64,
        /// Width of the robot, in metres.
        width: f64,
    },
    /// The plan has no start, and none was found.
    #[error(
        "no place was found at which a robot {width} m wide can stand; make room between walls and things, or give a \
         `start`"
    )]
    NoStart {
        /// Width of the robot, in metres.
        width: f64,
    },
}
