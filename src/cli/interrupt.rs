//! Ctrl-C: the first asks the command to stop and leave things in order, the second ends the process at once.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use super::CliError;
use super::error::INTERRUPTED;

/// The flag that Ctrl-C (or a request of the system to end) sets.
pub(crate) fn stop_flag() -> Result<Arc<AtomicBool>, CliError> {
    let stop = Arc::new(AtomicBool::new(false));
    let flag = stop.clone();
    ctrlc::set_handler(move || {
        if flag.swap(true, Ordering::Relaxed) {
            std::process::exit(i32::from(INTERRUPTED));
        }
    })
    .map_err(|e| CliError::Failed(format!("cannot watch for Ctrl-C: {e}")))?;
    Ok(stop)
}
