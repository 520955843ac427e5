//! The live view of a run on a terminal: a bar with the counters of the running generation, below it how alive the
//! last one was, and above it what is said for good.

use std::io::{self, Write};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use indicatif::{MultiProgress, ProgressBar, ProgressDrawTarget, ProgressStyle};
use vsonar::evolve::Progress;

use super::output::{duration, grouped};

/// How often the live lines are drawn again.
const TICK: Duration = Duration::from_millis(150);
/// Steps of the bar to a generation.
const STEPS: u64 = 1000;

/// A complete generation in the live lines.
#[derive(Debug, Clone)]
pub(crate) struct Last {
    /// How good it is, beside the bar.
    pub(crate) fitness: String,
    /// How alive it is, a line each.
    pub(crate) signs: [String; 2],
}

/// What the live lines show beside the counters of the running generation.
#[derive(Debug, Clone)]
struct State {
    /// The last complete generation.
    last: Option<Last>,
    left: Option<f64>,
    /// When `left` was estimated.
    at: Instant,
}

struct Shared {
    state: Mutex<State>,
    /// Lines to be printed above the live ones, to stay.
    lines: Mutex<Vec<String>>,
    done: AtomicBool,
}

impl Shared {
    fn set(&self, state: State) {
        *self.state.lock().unwrap_or_else(PoisonError::into_inner) = state;
    }

    fn get(&self) -> State {
        self.state.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    fn said(&self) -> Vec<String> {
        std::mem::take(&mut self.lines.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

/// The live lines, drawn by a thread of its own until it is dropped.
pub(crate) struct Live {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

impl Live {
    /// Starts to draw a run of `total` generations, of which the last one is known if it goes on.
    pub(crate) fn start(progress: Arc<Progress>, total: u32, last: Option<Last>) -> Live {
        let state = Mutex::new(State { last, left: None, at: Instant::now() });
        let shared = Arc::new(Shared { state, lines: Mutex::default(), done: AtomicBool::new(false) });
        let watched = shared.clone();
        // Without a thread there are no live lines, and the run goes on without it.
        let thread = std::thread::Builder::new().spawn(move || draw(&watched, &progress, total)).ok();
        Live { shared, thread }
    }

    /// Shows a complete generation from now on, and the seconds that are left.
    pub(crate) fn show(&self, last: Last, left: Option<f64>) {
        self.shared.set(State { last: Some(last), left, at: Instant::now() });
    }

    /// Prints a line above the live ones, where it stays.
    pub(crate) fn say(&self, line: String) {
        self.shared.lines.lock().unwrap_or_else(PoisonError::into_inner).push(line);
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
    let screen = MultiProgress::with_draw_target(ProgressDrawTarget::stderr_with_hz(10));
    let bar = screen.add(ProgressBar::new(u64::from(total.max(1)) * STEPS));
    let below = [(); 2].map(|()| screen.add(ProgressBar::new_spinner()));
    if let Ok(style) = ProgressStyle::with_template("{wide_msg}") {
        below.iter().for_each(|line| line.set_style(style.clone()));
    }
    let say = || {
        let lines = shared.said();
        if !lines.is_empty() {
            // They are for whoever is there to see them.
            screen.suspend(|| lines.iter().try_for_each(|line| writeln!(io::stderr(), "{line}")).ok());
        }
    };
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
        let state = shared.get();
        bar.set_message(message(&state, rate, now));
        if let Some(last) = state.last {
            below.iter().zip(last.signs).for_each(|(line, signs)| line.set_message(signs));
        }
        say();
        std::thread::park_timeout(TICK);
    }
    say();
    bar.finish_and_clear();
    below.iter().for_each(ProgressBar::finish_and_clear);
}

fn message(state: &State, rate: f64, now: Instant) -> String {
    let mut parts: Vec<String> = state.last.iter().map(|last| last.fitness.clone()).collect();
    parts.push(format!("{} programs/s", grouped(rate as u64)));
    if let Some(left) = state.left {
        let left = left - now.duration_since(state.at).as_secs_f64();
        parts.push(format!("{} left", duration(left)));
    }
    parts.join(", ")
}
