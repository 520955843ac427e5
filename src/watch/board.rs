//! What is known of the runs, between whoever runs them and the page.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use tokio::sync::watch::{Receiver, Sender};

use super::pace::Pace;
use crate::evolve::{Evolution, Progress};
use crate::report::page::Score;

/// How far the runs of a command are. Telling it something takes no time to speak of.
#[derive(Debug)]
pub struct Board {
    state: Sender<State>,
}

/// All that a board knows.
#[derive(Debug, Clone)]
pub(super) struct State {
    /// Grows whenever there is something new for the page.
    pub(super) revision: u64,
    /// Runs asked for.
    pub(super) asked: usize,
    /// Generations of each of them.
    generations: u32,
    /// Those that have begun, in that order.
    pub(super) runs: Vec<Begun>,
    pace: Pace,
    /// How it ended, in words, once it has.
    pub(super) end: Option<String>,
}

/// A run that has begun.
#[derive(Debug, Clone)]
pub(super) struct Begun {
    pub(super) folder: PathBuf,
    /// The data, in words.
    pub(super) data: String,
    /// Generations recorded.
    pub(super) done: u32,
    /// What its winner reaches, once that is known.
    pub(super) scores: Vec<Score>,
    progress: Arc<Progress>,
}

impl Board {
    /// A board for so many runs of so many generations each.
    pub fn new(runs: usize, generations: u32) -> Arc<Board> {
        let (pace, runs_begun) = (Pace::default(), Vec::new());
        let state = State { revision: 1, asked: runs, generations, runs: runs_begun, pace, end: None };
        Arc::new(Board { state: Sender::new(state) })
    }

    /// A run, recorded in this folder, begins or goes on; `data` are its data in words. Gives its number.
    pub fn begin(&self, folder: &Path, data: String, evolution: &Evolution) -> usize {
        let (done, progress) = (evolution.generations(), evolution.progress());
        let mut number = 0;
        self.state.send_modify(|state| {
            number = state.runs.len();
            let (folder, scores) = (folder.to_path_buf(), Vec::new());
            state.runs.push(Begun { folder, data, done, scores, progress });
            state.revision += 1;
        });
        number
    }

    /// One more generation of a run is recorded.
    pub fn generation(&self, run: usize) {
        self.state.send_modify(|state| {
            if let Some(run) = state.runs.get_mut(run) {
                run.done += 1;
            }
            state.pace.tick(Instant::now());
            state.revision += 1;
        });
    }

    /// The winner of a run reaches this on the parts of its data.
    pub fn scored(&self, run: usize, scores: Vec<Score>) {
        self.state.send_modify(|state| {
            if let Some(run) = state.runs.get_mut(run) {
                run.scores = scores;
            }
            state.revision += 1;
        });
    }

    /// It is over, and this is to be said of it. What is said first stays.
    pub fn end(&self, words: &str) {
        self.state.send_if_modified(|state| {
            let first = state.end.is_none();
            if first {
                state.end = Some(words.to_string());
                state.revision += 1;
            }
            first
        });
    }

    /// How far it is, as in "17 of 51 generations, 34 s left".
    pub fn line(&self) -> String {
        self.state.borrow().line(Instant::now())
    }

    pub(super) fn state(&self) -> State {
        self.state.borrow().clone()
    }

    pub(super) fn subscribe(&self) -> Receiver<State> {
        self.state.subscribe()
    }
}

impl State {
    /// That of one run, in this folder.
    #[cfg(test)]
    pub(super) fn of_one(folder: &Path) -> State {
        let board = Board::new(1, 5);
        let (progress, data) = (Arc::default(), "photos".to_string());
        board.state.send_modify(|state| {
            let (folder, scores) = (folder.to_path_buf(), Vec::new());
            state.runs.push(Begun { folder, data, done: 0, scores, progress });
        });
        board.state()
    }

    /// Generations recorded, of all runs, and those there are to be.
    fn generations(&self) -> (u64, u64) {
        let done = self.runs.iter().map(|run| u64::from(run.done)).sum();
        (done, self.asked as u64 * u64::from(self.generations))
    }

    pub(super) fn line(&self, now: Instant) -> String {
        let (done, total) = self.generations();
        let mut line = format!("{done} of {total} generations");
        if self.asked > 1 {
            let complete = self.runs.iter().filter(|run| run.done >= self.generations).count();
            line = format!("{complete} of {} runs complete, {line}", self.asked);
        }
        let left = total.saturating_sub(done);
        if let Some(left) = self.pace.left(left, now).filter(|_| left > 0 && self.end.is_none()) {
            line += &format!(", {} left", words(left.as_secs()));
        }
        line
    }

    /// How much of it is done, 0 to 1, with what is done of generations that are not complete.
    pub(super) fn share(&self) -> f64 {
        let (done, total) = self.generations();
        let part = |run: &Begun| run.progress.filled() as f64 / run.progress.slots().max(1) as f64;
        let running = self.runs.iter().filter(|run| run.done < self.generations);
        // What is counted while workers count is a view; it never goes beyond the generation.
        let parts: f64 = match self.end {
            None => running.map(|run| part(run).clamp(0.0, 1.0)).sum(),
            Some(_) => 0.0,
        };
        ((done as f64 + parts) / total.max(1) as f64).min(1.0)
    }
}

/// A time in words, as in `34 s` or `2 h 10 min`.
fn words(seconds: u64) -> String {
    match seconds {
        0..60 => format!("{seconds} s"),
        60..3600 => format!("{} min {} s", seconds / 60, seconds % 60),
        _ => format!("{} h {} min", seconds / 3600, seconds % 3600 / 60),
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    fn begun(done: u32) -> Begun {
        Begun { folder: "r".into(), data: String::new(), done, scores: Vec::new(), progress: Arc::default() }
    }

    #[test]
    fn how_far_it_is_in_words() {
        let board = Board::new(1, 4);
        assert_eq!((board.line(), board.state().share()), ("0 of 4 generations".to_string(), 0.0));
        board.state.send_modify(|state| state.runs.push(begun(0)));
        let revisions: Vec<u64> =
            [0, 0].map(|run| board.generation(run)).map(|()| board.state().revision).into();
        assert_eq!((board.state().runs[0].done, revisions[1]), (2, 3));
        assert!(board.line().starts_with("2 of 4 generations, 0 s left"), "{}", board.line());
        assert_eq!(board.state().share(), 0.5);
        board.end("It was interrupted.");
        board.end("Something else.");
        assert_eq!(
            (board.line(), board.state().end),
            ("2 of 4 generations".into(), Some("It was interrupted.".into()))
        );
        assert_eq!(board.state().revision, 4, "the second end is no news");
    }

    #[test]
    fn several_runs_are_counted_together() {
        let board = Board::new(3, 10);
        let now = Instant::now();
        board.state.send_modify(|state| {
            state.runs = vec![begun(10), begun(5)];
            state.pace.tick(now);
            state.pace.tick(now + Duration::from_secs(500));
        });
        let state = board.state();
        let line = state.line(now + Duration::from_secs(501));
        assert_eq!(line, "1 of 3 runs complete, 15 of 30 generations, 2 h 4 min left");
        assert_eq!(state.share(), 0.5);
    }
}
