//! What is seen of several runs while they go on: a bar on a terminal, a line for each run elsewhere.

use std::io::{self, Write};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use super::super::CliError;
use super::super::output::{duration, print};
use super::super::view::Style;

/// Shows runs as they end.
pub(crate) struct Meter {
    style: Style,
    bar: ProgressBar,
    total: usize,
    done: usize,
    start: Instant,
}

impl Meter {
    /// The view of so many runs.
    pub(crate) fn start(style: Style, total: usize) -> Meter {
        let target = match style {
            Style::Live => ProgressDrawTarget::stderr_with_hz(10),
            _ => ProgressDrawTarget::hidden(),
        };
        let bar = ProgressBar::with_draw_target(Some(total as u64), target);
        if let Ok(style) = ProgressStyle::with_template("{pos}/{len} runs {wide_bar} {msg}") {
            bar.set_style(style.progress_chars("━╸─"));
        }
        if style == Style::Live {
            bar.enable_steady_tick(Duration::from_millis(200));
        }
        Meter { style, bar, total, done: 0, start: Instant::now() }
    }

    /// A run has ended.
    pub(crate) fn end(&mut self, what: &str) -> Result<(), CliError> {
        self.done += 1;
        self.bar.set_position(self.done as u64);
        let seconds = self.start.elapsed().as_secs_f64();
        let left = seconds / self.done as f64 * self.total.saturating_sub(self.done) as f64;
        let rate = 60.0 * self.done as f64 / seconds.max(1e-9);
        let rate = format!("{rate:.1} runs/min, {} left", duration(left));
        self.bar.set_message(format!("{what}, {rate}"));
        let width = self.total.to_string().len();
        let line = format!("{:>width$}/{}: {what}, {rate}\n", self.done, self.total);
        match self.style {
            Style::Lines => print(&line),
            Style::LinesAside => {
                // The line is for whoever is there to see it.
                let _ = io::stderr().write_all(line.as_bytes());
                Ok(())
            }
            Style::Live | Style::Silent => Ok(()),
        }
    }
}

impl Drop for Meter {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}
