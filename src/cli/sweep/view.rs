//! What is seen of several runs while they go on: a bar on a terminal, a line for each run elsewhere.

use std::time::Instant;

use super::super::output::{duration, say};
use super::super::progress::{Bar, Style};

/// Shows runs as they end.
pub(crate) struct Meter {
    style: Style,
    bar: Bar,
    total: usize,
    done: usize,
    start: Instant,
}

impl Meter {
    /// The view of so many runs.
    pub(crate) fn start(style: Style, total: usize) -> Meter {
        let bar = Bar::counting(style, total as u64, "runs");
        Meter { style, bar, total, done: 0, start: Instant::now() }
    }

    /// A run has ended.
    pub(crate) fn end(&mut self, what: &str) {
        self.done += 1;
        self.bar.at(self.done as u64, self.total as u64);
        let seconds = self.start.elapsed().as_secs_f64();
        let left = seconds / self.done as f64 * self.total.saturating_sub(self.done) as f64;
        let rate = 60.0 * self.done as f64 / seconds.max(1e-9);
        let rate = format!("{rate:.1} runs/min, {} left", duration(left));
        self.bar.message(&format!("{what}, {rate}"));
        let width = self.total.to_string().len();
        if self.style == Style::Lines {
            say(&format!("{:>width$}/{}: {what}, {rate}", self.done, self.total));
        }
    }
}
