//! What is seen of a run while it goes on: live lines on a terminal, a line a generation elsewhere. A warning that
//! the run has collapsed is shown once for each kind.

use std::io::{self, IsTerminal, Write};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use indicatif::{MultiProgress, ProgressBar, ProgressDrawTarget, ProgressStyle};
use vsonar::dataset::Dataset;
use vsonar::evolve::{Collapse, Evolution, Progress, Record, Settings, Warning};

use super::output::{count, duration, grouped, percent};

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
    /// Three lines that change, on a terminal.
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
pub(crate) struct View<'a> {
    style: Style,
    total: u32,
    settings: Settings,
    /// The training set, for the names of cases.
    train: &'a Dataset,
    /// Of all generations so far.
    records: Vec<Record>,
    /// What was warned of.
    warned: Vec<Collapse>,
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

impl<'a> View<'a> {
    /// The view of a run on this training set up to `total` generations, before it starts or goes on.
    pub(crate) fn start(style: Style, evolution: &Evolution, total: u32, train: &'a Dataset) -> View<'a> {
        let settings = evolution.settings().clone();
        let records = evolution.state().map_or(Vec::new(), |state| state.records.clone());
        let last = records.last().map(|record| Last::of(record, train));
        let live = (style == Style::Live).then(|| Live::start(evolution.progress(), total, last));
        View { style, total, settings, train, records, warned: Vec::new(), clock: Clock::default(), live }
    }

    /// Shows a complete generation.
    ///
    /// # Errors
    /// If standard output cannot be written.
    pub(crate) fn generation(&mut self, record: &Record) -> io::Result<()> {
        self.clock.walls.push(record.timing.wall);
        self.records.push(record.clone());
        let left = self.clock.left(self.total.saturating_sub(record.generation + 1));
        match self.style {
            Style::Silent => {}
            Style::Live => {
                if let Some(live) = &self.live {
                    let last = Some(Last::of(record, self.train));
                    live.shared.set(State { last, left, at: Instant::now() });
                }
            }
            Style::Lines => writeln!(io::stdout(), "{}", line(record, self.total, left))?,
            Style::LinesAside => {
                // The line is for whoever is there to see it.
                let _ = writeln!(io::stderr(), "{}", line(record, self.total, left));
            }
        }
        Ok(())
    }

    /// Warns of what the run has come to with the last generation, unless that was said before.
    pub(crate) fn warn(&mut self) {
        if self.style == Style::Silent {
            return;
        }
        let Some(warning) = Warning::of(&self.records, &self.settings) else { return };
        if self.warned.contains(&warning.kind) {
            return;
        }
        self.warned.push(warning.kind);
        let text = format!("warning: {warning}");
        match &self.live {
            Some(live) => live.shared.say(text),
            None => {
                let _ = writeln!(io::stderr(), "{text}");
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

/// How alive the generation is, in short; without what an earlier release did not record.
fn spread(record: &Record) -> String {
    let mut parts = vec![count(record.distinct_behaviours.into(), "behaviour")];
    parts.extend(record.case_entropy.map(|entropy| format!("entropy {entropy:.2}")));
    parts.extend(record.solved_by_nobody.map(|cases| format!("{} unsolved", grouped(cases.into()))));
    parts.push(format!("{:.0} nodes", record.mean_nodes));
    parts.join(", ")
}

/// The same in full, as two lines: the spread of the generation, and the cases that it fails on.
fn signs(record: &Record, train: &Dataset) -> [String; 2] {
    let mut parts = vec![count(record.distinct_behaviours.into(), "behaviour")];
    parts.extend(record.largest_behaviour.map(|share| format!("the largest {}", percent(share))));
    parts.push(format!("{} constant", percent(record.constant_share)));
    parts.extend(record.case_entropy.map(|entropy| format!("entropy {entropy:.2}")));
    parts.push(format!("{:.0} nodes", record.mean_nodes));
    let hardest = record.hardest_case.and_then(|h| Some((h.solvers, train.cases().get(h.case as usize)?)));
    let failed = hardest.map_or(String::new(), |(solvers, case)| {
        let name = format!("{} column {}", train.images()[case.image].name, case.x);
        match (solvers, record.solved_by_nobody) {
            (0, Some(unsolved)) => {
                let cases = count(train.cases().len() as u64, "case");
                format!("nobody solves {} of {cases}, such as {name}", grouped(unsolved.into()))
            }
            _ => format!("fewest ({}) solve {name}", grouped(solvers.into())),
        }
    });
    [parts.join(", "), failed]
}

/// A generation as a line. Generations are counted from 0, so the last of 51 is 50.
fn line(record: &Record, total: u32, left: Option<f64>) -> String {
    let width = total.saturating_sub(1).to_string().len();
    let rate = record.evaluations as f64 / record.timing.wall.max(1e-9);
    let left = left.map_or(String::new(), |s| format!(", {} left", duration(s)));
    format!(
        "generation {:>width$}/{}: {}, {}, {} programs/s{left}",
        record.generation,
        total.saturating_sub(1),
        fitness(record),
        spread(record),
        grouped(rate as u64)
    )
}

/// A complete generation in the live lines.
#[derive(Debug, Clone)]
struct Last {
    fitness: String,
    signs: [String; 2],
}

impl Last {
    fn of(record: &Record, train: &Dataset) -> Last {
        Last { fitness: fitness(record), signs: signs(record, train) }
    }
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

    fn say(&self, line: String) {
        self.lines.lock().unwrap_or_else(PoisonError::into_inner).push(line);
    }

    fn said(&self) -> Vec<String> {
        std::mem::take(&mut self.lines.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

/// The live lines, drawn by a thread of its own until it is dropped.
struct Live {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

impl Live {
    fn start(progress: Arc<Progress>, total: u32, last: Option<Last>) -> Live {
        let state = Mutex::new(State { last, left: None, at: Instant::now() });
        let shared = Arc::new(Shared { state, lines: Mutex::default(), done: AtomicBool::new(false) });
        let watched = shared.clone();
        // Without a thread there are no live lines, and the run goes on without it.
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
    let screen = MultiProgress::with_draw_target(ProgressDrawTarget::stderr_with_hz(10));
    let bar = screen.add(ProgressBar::new(u64::from(total.max(1)) * STEPS));
    let below = [(); 2].map(|()| screen.add(ProgressBar::new_spinner()));
    if let Ok(style) = ProgressStyle::with_template("{wide_msg}") {
        below.iter().for_each(|line| line.set_style(style.clone()));
    }
    let say = || {
        let lines = shared.said();
        if !lines.is_empty() {
            screen.suspend(|| lines.iter().for_each(|line| eprintln!("{line}")));
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
