//! How far the rendering of a set is.

use std::sync::atomic::{AtomicUsize, Ordering};

/// Steps done of steps to do, for whoever looks on from another thread. Nothing is known until the rendering begins.
///
/// ```
/// use vsonar::world::{Corridor, Progress};
/// let progress = Progress::default();
/// Corridor { width: 32, height: 24, ..Corridor::default() }.render_told(1, 3, &progress)?;
/// assert_eq!(progress.steps(), (3, 3));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Default)]
pub struct Progress {
    done: AtomicUsize,
    total: AtomicUsize,
}

impl Progress {
    /// How many steps are done, and of how many.
    pub fn steps(&self) -> (usize, usize) {
        (self.done.load(Ordering::Relaxed), self.total.load(Ordering::Relaxed))
    }

    /// There will be so many more.
    pub(crate) fn expect(&self, steps: usize) {
        self.total.fetch_add(steps, Ordering::Relaxed);
    }

    pub(crate) fn step(&self) {
        self.done.fetch_add(1, Ordering::Relaxed);
    }
}
