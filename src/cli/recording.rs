//! A data folder of pictures that are made up, not found.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use clap::builder::RangedU64ValueParser;
use vsonar::dataset::Dataset;
use vsonar::support::printable::ShownPath as _;
use vsonar::world::Progress;

use super::new_folder::NewFolder;
use super::output::{self, count, shell_word};
use super::progress::{Bar, Style};
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
    let style = Style::of(false);
    let set = rendered(render, style, &stop)?;
    let bar = Bar::counting(style, set.images().len() as u64, "images written");
    for (name, bytes) in set.files() {
        if stop.load(Ordering::Relaxed) {
            return Err(interrupted());
        }
        folder.write(&name, &bytes)?;
        bar.advance(1);
    }
    drop(bar);
    folder.finish()?;
    output::print(&format!(
        "{}: {} of {} x {} pixels, {}\nNext: vsonar evolve --data {}\n",
        dir.shown(),
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
    let bar = Bar::new(style, 1);
    bar.name("rendering");
    let thread = {
        let progress = progress.clone();
        thread::Builder::new()
            .spawn(move || render(&progress))
            .map_err(|e| CliError::Failed(format!("cannot start a thread: {e}")))?
    };
    while !thread.is_finished() {
        if stop.load(Ordering::Relaxed) {
            return Err(interrupted());
        }
        let (done, total) = progress.steps();
        // Before the first picture the building itself is made, of which nothing is done yet.
        bar.at(done as u64, total.max(1) as u64);
        bar.message(&format!("{} %, {done} of {total} images", 100 * done / total.max(1)));
        thread::sleep(LOOK);
    }
    thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
}

fn interrupted() -> CliError {
    CliError::Interrupted("interrupted; nothing was written".to_string())
}
