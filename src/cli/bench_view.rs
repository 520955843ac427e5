//! What is seen of a benchmark while it runs: a bar on a terminal, a line for each measurement elsewhere.

use std::io::{self, Write};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use vsonar::benchmark::Step;

use super::CliError;
use super::view::Style;

/// Shows a benchmark.
pub(crate) struct Meter {
    style: Style,
    bar: ProgressBar,
}

impl Meter {
    /// The view of a benchmark of so many steps.
    pub(crate) fn start(style: Style, steps: u64) -> Meter {
        let target = match style {
            Style::Live => ProgressDrawTarget::stderr_with_hz(10),
            _ => ProgressDrawTarget::hidden(),
        };
        let bar = ProgressBar::with_draw_target(Some(steps), target);
        if let Ok(style) = ProgressStyle::with_template("{prefix} {wide_bar} {msg}") {
            bar.set_style(style.progress_chars("━╸─"));
        }
        Meter { style, bar }
    }

    /// A measurement begins.
    pub(crate) fn begin(&self, what: &str) -> Result<(), CliError> {
        self.bar.set_prefix(what.to_string());
        match self.style {
            Style::Lines => super::output::print(&format!("measuring {what}\n")),
            Style::LinesAside => {
                // The line is for whoever is there to see it.
                let _ = writeln!(io::stderr(), "measuring {what}");
                Ok(())
            }
            Style::Live | Style::Silent => Ok(()),
        }
    }

    /// A step of it begins.
    pub(crate) fn step(&self, step: Step, rounds: u32) {
        self.bar.set_message(match step {
            Step::Judge => "counting nodes".to_string(),
            Step::WarmUp => "comparing answers".to_string(),
            Step::Round(round) => format!("round {round}/{rounds}"),
        });
        self.bar.inc(1);
    }
}

impl Drop for Meter {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}
