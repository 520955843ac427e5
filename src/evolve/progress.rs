//! How far the running generation is, for whoever watches from another thread.

use std::sync::atomic::{AtomicU32, AtomicU64, Ordering};

/// Counters of the running generation. They are read while workers add to them, so they are a view, not a
/// result.
#[derive(Debug, Default)]
pub struct Progress {
    generation: AtomicU32,
    slots: AtomicU64,
    filled: AtomicU64,
    evaluations: AtomicU64,
    executed: AtomicU64,
}

impl Progress {
    /// The generation that is being evaluated.
    pub fn generation(&self) -> u32 {
        self.generation.load(Ordering::Relaxed)
    }

    /// How many of its individuals have to be evaluated.
    pub fn slots(&self) -> u64 {
        self.slots.load(Ordering::Relaxed)
    }

    /// How many of them are done.
    pub fn filled(&self) -> u64 {
        self.filled.load(Ordering::Relaxed)
    }

    /// Individuals evaluated since this process began the run, rejected draws and known results included.
    pub fn evaluations(&self) -> u64 {
        self.evaluations.load(Ordering::Relaxed)
    }

    /// Programs run since this process began the run, those that turned out not to be needed included.
    pub fn executed(&self) -> u64 {
        self.executed.load(Ordering::Relaxed)
    }

    pub(super) fn begin(&self, generation: u32, slots: usize) {
        self.generation.store(generation, Ordering::Relaxed);
        self.filled.store(0, Ordering::Relaxed);
        self.slots.store(slots as u64, Ordering::Relaxed);
    }

    pub(super) fn fill(&self, slots: u64) {
        self.filled.fetch_add(slots, Ordering::Relaxed);
    }

    pub(super) fn evaluate(&self, individuals: u64) {
        self.evaluations.fetch_add(individuals, Ordering::Relaxed);
    }

    pub(super) fn execute(&self) {
        self.executed.fetch_add(1, Ordering::Relaxed);
    }
}
