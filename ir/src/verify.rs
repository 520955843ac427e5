//! Well-formedness.
use crate::program::Program;
/// A fault.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{message}")]
pub struct VerifyError {
    message: String,
}
/// Checks.
pub fn verify(_p: &Program) -> Result<(), VerifyError> {
    Ok(())
}
