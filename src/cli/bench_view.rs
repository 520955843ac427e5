//! What is seen of a benchmark while it runs: a bar on a terminal, a line for each measurement elsewhere.

use vsonar::benchmark::Step;

use super::output::say;
use super::progress::{Bar, Style};

/// Shows a benchmark.
pub(crate) struct Meter {
    style: Style,
    bar: Bar,
}

impl Meter {
    /// The view of a benchmark of so many steps.
    pub(crate) fn start(style: Style, steps: u64) -> Meter {
        Meter { style, bar: Bar::new(style, steps) }
    }

    /// A measurement begins.
    pub(crate) fn begin(&self, what: &str) {
        self.bar.name(what);
        if self.style == Style::Lines {
            say(&format!("measuring {what}"));
        }
    }

    /// A step of it begins.
    pub(crate) fn step(&self, step: Step, rounds: u32) {
        self.bar.message(&match step {
            Step::Judge => "counting nodes".to_string(),
            Step::WarmUp => "comparing answers".to_string(),
            Step::Round(round) => format!("round {round}/{rounds}"),
        });
        self.bar.advance(1);
    }
}
