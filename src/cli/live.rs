//! The live view of a run on a terminal: a bar with the counters of the running generation, and below it how alive the
//! last one was.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use vsonar::evolve::Progress;

use super::output::{duration, grouped};
use super::progress::{Bar, Style};

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

/// The live lines, drawn by a thread of its own until it is dropped.
pub(crate) struct Live {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

impl Live {
    /// Starts to draw a run of `total` generations, of which the last one is known if it goes on.
    pub(crate) fn start(progress: Arc<Progress>, total: u32, last: Option<Last>) -> Live {
        let state = Mutex::new(State { last, left: None, at: Instant::now() });
        let shared = Arc::new(Shared { state, done: AtomicBool::new(false) });
        let watched = shared.clone();
        // Without a thread there are no live lines, and the run goes on without it.
        let thread = std::thread::Builder::new().spawn(move || draw(&watched, &progress, total)).ok();
        Live { shared, thread }
    }

    /// Shows a complete generation from now on, and the seconds that are left.
    pub(crate) fn show(&self, last: Last, left: Option<f64>) {
        self.shared.set(State { last: Some(last), left, at: Instant::now() });
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
    let steps = u64::from(total.max(1)) * STEPS;
    let bar = Bar::new(Style::Live, steps);
    let below = [(); 2].map(|()| Bar::text(Style::Live));
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
        bar.at((position * STEPS as f64) as u64, steps);
        bar.name(&format!("generation {generation}/{}", total.saturating_sub(1)));
        let state = shared.get();
        bar.message(&message(&state, rate, now));
        if let Some(last) = state.last {
            below.iter().zip(&last.signs).for_each(|(line, signs)| line.message(signs));
        }
        std::thread::park_timeout(TICK);
    }
}

fn message(state: &State, rate: f64, now: Instant) -> String {
    // What matters most comes first: the end is cut on a narrow terminal.
    let left = state.left.map(|left| left - now.duration_since(state.at).as_secs_f64());
    let mut parts: Vec<String> = left.iter().map(|&left| format!("{} left", duration(left))).collect();
    parts.extend(state.last.iter().map(|last| last.fitness.clone()));
    parts.push(format!("{} programs/s", grouped(rate as u64)));
    parts.join(", ")
}
