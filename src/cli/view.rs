//! What is seen of a run while it goes on: a live line on a terminal, a line a generation elsewhere.

use std::io::{self, IsTerminal, Write};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use vsonar::evolve::{Progress, Record};

use super::output::{duration, grouped, percent};

/// How often the live line is drawn again.
const TICK: Duration = Duration::from_millis(150);
/// Steps of the bar to a generation.
const STEPS: u64 = 1000;

/// How a run is shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Style {
    /// Not at all.
    Silent,
    /// A line a generation on standard output.
    Lines,
    /// A line a generation on standard error, for standard output has something else to say.
    LinesAside,
    /// A line that changes, on a terminal.
    Live,
}

impl Style {
    /// The style for these flags and whatever standard output and error are.
    pub(crate) fn of(quiet: bool, json: bool) -> Style {
        let terminal = io::stderr().is_terminal() && (json || io::stdout().is_terminal());
        match (quiet, terminal, json) {
            (true, ..) => Style::Silent,
            (_, true, _) => Style::Live,
            (_, _, true) => Style::LinesAside,
            _ => Style::Lines,
        }
    }
}

/// Shows a run. Its generations are told to it one by one.
pub(crate) struct View {
    style: Style,
    total: u32,
    clock: Clock,
    live: Option<Live>,
}

/// Estimates the time left from the generations this process has seen.
#[derive(Debug, Default, Clone)]
struct Clock {
    /// Seconds of each generation.
    walls: Vec<f64>,
}

impl Clock {
    /// How many generations an estimate looks back on.
    const WINDOW: usize = 8;

    /// Seconds for so many generations; the initial one is unlike the others, so it takes two to tell.
    fn left(&self, generations: u32) -> Option<f64> {
        if generations == 0 {
            return Some(0.0);
        }
        let recent = &self.walls[self.walls.len().saturating_sub(Clock::WINDOW)..];
        let mean = recent.iter().sum::<f64>() / recent.len().max(1) as f64;
        (self.walls.len() >= 2).then_some(mean * f64::from(generations))
    }
}

impl View {
    /// The view of a run of `total` generations; one that was resumed has a record of its last one.
    pub(crate) fn start(style: Style, progress: Arc<Progress>, total: u32, last: Option<&Record>) -> View {
        let live = (style == Style::Live).then(|| Live::start(progress, total, last));
        View { style, total, clock: Clock::default(), live }
    }

    /// Shows a complete generation.
    ///
    /// # Errors
    /// If standard output cannot be written.
    pub(crate) fn generation(&mut self, record: &Record) -> io::Result<()> {
        self.clock.walls.push(record.timing.wall);
        let left = self.clock.left(self.total.saturating_sub(record.generation + 1));
        match self.style {
            Style::Silent => Ok(()),
            Style::Live => {
                if let Some(live) = &self.live {
                    live.shared.set(State { best: Some(fitness(record)), left, at: Instant::now() });
                }
                Ok(())
            }
            Style::Lines => writeln!(io::stdout(), "{}", line(record, self.total, left)),
            Style::LinesAside => {
                // The line is for whoever is there to see it.
                let _ = writeln!(io::stderr(), "{}", line(record, self.total, left));
                Ok(())
            }
        }
    }
}

fn fitness(record: &Record) -> String {
    // With augmentation the others are of altered copies too.
    let unaltered = record.best_fitness_unaltered;
    let unaltered = unaltered.map_or(String::new(), |share| format!(" ({} unaltered)", percent(share)));
    format!("best {}{unaltered}, mean {}", percent(record.best_fitness), percent(record.mean_fitness))
}

/// A generation as a line. Generations are counted from 0, so the last of 51 is 50.
fn line(record: &Record, total: u32, left: Option<f64>) -> String {
    let width = total.saturating_sub(1).to_string().len();
    let rate = record.evaluations as f64 / record.timing.wall.max(1e-9);
    let left = left.map_or(String::new(), |s| format!(", {} left", duration(s)));
    format!(
        "generation {:>width$}/{}: {}, {} programs/s{left}",
        record.generation,
        total.saturating_sub(1),
        fitness(record),
        grouped(rate as u64)
    )
}

/// What the live line shows beside the counters of the running generation.
#[derive(Debug, Clone)]
struct State {
    best: Option<String>,
    left: Option<f64>,
    /// When `left` was estimated.
    at: Instant,
}

struct Shared {
    state: Mutex<State>,
    done: AtomicBool,
}

impl Shared {
    fn set(&self, state: State) {
        *self.state.lock().unwrap_or_else(PoisonError::into_inner) = state;
    }

    fn get(&self) -> State {
        self.state.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

/// The live line, drawn by a thread of its own until it is dropped.
struct Live {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

impl Live {
    fn start(progress: Arc<Progress>, total: u32, last: Option<&Record>) -> Live {
        let state = State { best: last.map(fitness), left: None, at: Instant::now() };
        let shared = Arc::new(Shared { state: Mutex::new(state), done: AtomicBool::new(false) });
        let watched = shared.clone();
        // Without a thread there is no live line, and the run goes on without it.
        let thread = std::thread::Builder::new().spawn(move || draw(&watched, &progress, total)).ok();
        Live { shared, thread }
    }
}

impl Drop for Live {
    fn drop(&mut self) {
        self.shared.done.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            thread.thread().unpark();
            // It only draws; whatever went wrong there is no loss.
            let _ = thread.join();
        }
    }
}

fn draw(shared: &Shared, progress: &Progress, total: u32) {
    let bar = ProgressBar::with_draw_target(
        Some(u64::from(total.max(1)) * STEPS),
        ProgressDrawTarget::stderr_with_hz(10),
    );
    if let Ok(style) = ProgressStyle::with_template("{prefix} {wide_bar} {msg}") {
        bar.set_style(style.progress_chars("━╸─"));
    }
    let mut samples = std::collections::VecDeque::from([(Instant::now(), progress.evaluations())]);
    while !shared.done.load(Ordering::Relaxed) {
        let (now, evaluations) = (Instant::now(), progress.evaluations());
        samples.push_back((now, evaluations));
        if samples.len() > 20 {
            samples.pop_front();
        }
        let (then, before) = samples[0];
        let rate = (evaluations - before) as f64 / now.duration_since(then).as_secs_f64().max(1e-9);
        let generation = progress.generation();
        let share = progress.filled() as f64 / progress.slots().max(1) as f64;
        let position = f64::from(generation) + share.clamp(0.0, 1.0);
        bar.set_position((position * STEPS as f64) as u64);
        bar.set_prefix(format!("generation {generation}/{}", total.saturating_sub(1)));
        bar.set_message(message(&shared.get(), rate, now));
        std::thread::park_timeout(TICK);
    }
    bar.finish_and_clear();
}

fn message(state: &State, rate: f64, now: Instant) -> String {
    let mut parts: Vec<String> = state.best.iter().cloned().collect();
    parts.push(format!("{} programs/s", grouped(rate as u64)));
    if let Some(left) = state.left {
        let left = left - now.duration_since(state.at).as_secs_f64();
        parts.push(format!("{} left", duration(left)));
    }
    parts.join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_left_is_that_of_recent_generations() {
        let mut clock = Clock { walls: vec![100.0] };
        assert_eq!((clock.left(3), clock.left(0)), (None, Some(0.0)));
        clock.walls.extend([2.0; Clock::WINDOW]);
        assert_eq!(clock.left(3), Some(6.0));
    }
}
