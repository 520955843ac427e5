//! What is seen of drives while they go on: a bar on a terminal, a line for each run elsewhere.

use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

use vsonar::world::office::FRAME_RATE;

use super::output::{count, duration, say};
use super::progress::{Bar, Style};

/// Shows drives.
pub(crate) struct Meter {
    style: Style,
    bar: Bar,
    /// Frames of all runs so far.
    frames: AtomicU64,
    /// How many frames a run can have.
    most: u64,
    runs: u64,
    start: Instant,
}

/// How many runs have ended, and the frames they had.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Ended {
    pub(crate) runs: u64,
    pub(crate) frames: u64,
}

impl Meter {
    /// The view of so many runs of so many frames at most.
    pub(crate) fn start(style: Style, runs: u64, most: u64) -> Meter {
        let bar = Bar::new(style, runs * most.max(1));
        bar.name(&count(runs, "run"));
        Meter { style, bar, frames: AtomicU64::new(0), most, runs, start: Instant::now() }
    }

    /// A frame is done.
    pub(crate) fn frame(&self) {
        self.frames.fetch_add(1, Ordering::Relaxed);
    }

    /// Seconds of real time and of simulated time so far.
    pub(crate) fn times(&self) -> (f64, f64) {
        (self.start.elapsed().as_secs_f64(), self.frames.load(Ordering::Relaxed) as f64 / FRAME_RATE)
    }

    /// Shows how far it is.
    pub(crate) fn show(&self, ended: Ended) {
        let (real, simulated) = self.times();
        let frames = self.frames.load(Ordering::Relaxed);
        // A run that has ended counts as a whole.
        let position = frames - ended.frames + ended.runs * self.most;
        self.bar.at(position, self.runs * self.most.max(1));
        let rate = frames as f64 / real.max(1e-9);
        let left = (self.runs * self.most).saturating_sub(position) as f64 / rate.max(1e-9);
        self.bar.message(&format!(
            "{} of {} ended, {:.0} times real time, at most {} left",
            ended.runs,
            self.runs,
            simulated / real.max(1e-9),
            duration(left)
        ));
    }

    /// Says that a run has ended.
    pub(crate) fn say(&self, line: &str) {
        if self.style != Style::Silent {
            say(line);
        }
    }
}
