//! Signals. The first Ctrl-C asks the command to stop and leave things in order, the second ends the process at once. A
//! file that grows beyond what is allowed fails to be written.

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

/// Has writing beyond the largest size of files (`ulimit -f`) fail with an error, as it does on a full disk, instead of
/// ending the process half-way. To be called before there are other threads, which then do the same.
pub(crate) fn limits_are_errors() {
    #[cfg(unix)]
    {
        use nix::sys::signal::{SigSet, Signal};
        // Blocked, not ignored: that takes no unsafe code, and commands started from here are not concerned. Where it cannot
        // be done all is as without it.
        let _ = SigSet::from(Signal::SIGXFSZ).thread_block();
    }
}
