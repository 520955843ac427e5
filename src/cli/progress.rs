//! What is seen of work that goes on: bars and spinners on the one screen there is, standard error.

use std::sync::LazyLock;
use std::time::Duration;

use indicatif::{MultiProgress, ProgressBar, ProgressDrawTarget, ProgressStyle};
use vsonar::support::printable;

use super::terminal;

/// How work that goes on is shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Style {
    /// Not at all.
    Silent,
    /// In lines, where standard error is no terminal.
    Lines,
    /// In lines that change.
    Live,
}

impl Style {
    /// The style for whatever standard error is.
    pub(crate) fn of(quiet: bool) -> Style {
        match (quiet, std::io::IsTerminal::is_terminal(&std::io::stderr())) {
            (true, _) => Style::Silent,
            (false, true) => Style::Live,
            (false, false) => Style::Lines,
        }
    }
}

/// How often bars are drawn again, for the time that goes by.
const TICK: Duration = Duration::from_millis(100);

/// All bars. What is written between them goes through [`aside`], so that neither disturbs the other.
static SCREEN: LazyLock<MultiProgress> =
    LazyLock::new(|| MultiProgress::with_draw_target(ProgressDrawTarget::stderr_with_hz(10)));

/// Writes something while no bar is in the way.
pub(crate) fn aside<T>(write: impl FnOnce() -> T) -> T {
    SCREEN.suspend(write)
}

/// A line on the screen that changes, until it is dropped; nothing unless the style is live.
pub(crate) struct Bar(ProgressBar);

impl Bar {
    /// A bar of so many steps: its name, the bar, and a message, cut where the terminal ends.
    pub(crate) fn new(style: Style, steps: u64) -> Bar {
        Bar::drawn(style, Some(steps), "{prefix} {bar} {wide_msg}", "")
    }

    /// A bar that counts its steps by themselves.
    pub(crate) fn counting(style: Style, steps: u64, noun: &str) -> Bar {
        Bar::drawn(style, Some(steps), &format!("{{pos}}/{{len}} {noun} {{bar}} {{wide_msg}}"), "")
    }

    /// A sign that something is at work, and what.
    pub(crate) fn spinner(style: Style, what: &str) -> Bar {
        Bar::drawn(style, None, "{spinner} {wide_msg}", what)
    }

    /// A line of text alone.
    pub(crate) fn text(style: Style) -> Bar {
        Bar::drawn(style, None, "{wide_msg}", "")
    }

    fn drawn(style: Style, steps: Option<u64>, template: &str, message: &str) -> Bar {
        if style != Style::Live {
            return Bar(ProgressBar::hidden());
        }
        let bar = SCREEN.add(ProgressBar::with_draw_target(steps, ProgressDrawTarget::hidden()));
        if let Ok(style) = ProgressStyle::with_template(template) {
            bar.set_style(match terminal::has_unicode() {
                true => style.progress_chars("━╸─"),
                false => style.progress_chars("=>-").tick_chars("|/-\\ "),
            });
        }
        // What is drawn first has its message.
        let bar = Bar(bar);
        bar.message(message);
        bar.0.enable_steady_tick(TICK);
        bar
    }

    /// Names the bar.
    pub(crate) fn name(&self, text: &str) {
        self.0.set_prefix(printable::line(text).into_owned());
    }

    /// Says how it stands.
    pub(crate) fn message(&self, text: &str) {
        self.0.set_message(printable::line(text).into_owned());
    }

    /// Sets how many of so many steps are done.
    pub(crate) fn at(&self, step: u64, of: u64) {
        self.0.set_length(of);
        self.0.set_position(step);
    }

    /// Counts steps.
    pub(crate) fn advance(&self, steps: u64) {
        self.0.inc(steps);
    }
}

impl Drop for Bar {
    fn drop(&mut self) {
        self.0.finish_and_clear();
        SCREEN.remove(&self.0);
    }
}
