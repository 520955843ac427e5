//! A data folder of pictures that are made up, not found.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use clap::builder::RangedU64ValueParser;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use vsonar::dataset::Dataset;
use vsonar::world::Progress;

use super::new_folder::NewFolder;
use super::output::{self, count, shell_word};
use super::view::Style;
use super::{CliError, interrupt};

/// How often one looks whether the pictures are rendered, or Ctrl-C was pressed.
const LOOK: Duration = Duration::from_millis(20);

/// How many pictures can be asked for.
pub(crate) fn frames() -> RangedU64ValueParser<usize> {
    RangedU64ValueParser::new().range(1..=10_000)
}

/// Renders a set and writes it as a new folder, which appears complete or not at all. That it can be made is known before
/// anything is rendered.
pub(crate) fn write(
    dir: &Path,
    render: impl FnOnce(&Progress) -> Result<Dataset, CliError> + Send + 'static,
) -> Result<(), CliError> {
    let mut folder = NewFolder::check(dir)?;
    let stop = interrupt::stop_flag()?;
    folder.make()?;
    let style = Style::of(false, false);
    let set = rendered(render, style, &stop)?;
    let bar = bar(style, "writing {pos}/{len} images {wide_bar} {eta}");
    bar.set_length(set.images().len() as u64);
    for (name, bytes) in set.files() {
        if stop.load(Ordering::Relaxed) {
            bar.finish_and_clear();
            return Err(interrupted());
        }
        folder.write(&name, &bytes)?;
        bar.inc(1);
    }
    bar.finish_and_clear();
    folder.finish()?;
    output::print(&format!(
        "{}: {} of {} x {} pixels, {}\nNext: vsonar evolve --data {}\n",
        dir.display(),
        count(set.images().len() as u64, "image"),
        set.width(),
        set.height(),
        count(set.cases().len() as u64, "case"),
        shell_word(dir)
    ))
}

/// The set. It is made by a thread of its own, which Ctrl-C leaves behind: it has nothing to put in order.
fn rendered(
    render: impl FnOnce(&Progress) -> Result<Dataset, CliError> + Send + 'static,
    style: Style,
    stop: &AtomicBool,
) -> Result<Dataset, CliError> {
    let progress = Arc::new(Progress::default());
    let bar = bar(style, "rendering {wide_bar} {percent} %, {eta} left");
    let thread = {
        let progress = progress.clone();
        thread::Builder::new()
            .spawn(move || render(&progress))
            .map_err(|e| CliError::Failed(format!("cannot start a thread: {e}")))?
    };
    while !thread.is_finished() {
        if stop.load(Ordering::Relaxed) {
            bar.finish_and_clear();
            return Err(interrupted());
        }
        let (done, total) = progress.steps();
        // Before the first picture the building itself is made, of which nothing is done yet.
        bar.set_length(total.max(1) as u64);
        bar.set_position(done as u64);
        thread::sleep(LOOK);
    }
    bar.finish_and_clear();
    thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
}

fn interrupted() -> CliError {
    CliError::Interrupted("interrupted; nothing was written".to_string())
}

fn bar(style: Style, template: &str) -> ProgressBar {
    let target = match style {
        Style::Live => ProgressDrawTarget::stderr_with_hz(10),
        _ => ProgressDrawTarget::hidden(),
    };
    let bar = ProgressBar::with_draw_target(Some(1), target);
    if let Ok(style) = ProgressStyle::with_template(template) {
        bar.set_style(style.progress_chars("━╸─"));
    }
    bar
}
