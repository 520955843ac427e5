//! The report of what is there so far, drawn when it is asked for and kept until there is something new.

use std::io;
use std::sync::Arc;
use std::time::{Duration, Instant};

use maud::html;

use super::board::{Begun, State};
use crate::evolve::{Settings, SettingsError};
use crate::report::page::{self, Comparison, PlotError, ReadError, Report, Run};

/// Room for programs as deep as they are nested.
const STACK_BYTES: usize = 64 << 20;

/// Time between two drawings, at least.
const REST: Duration = Duration::from_millis(900);

/// So many times as long as a drawing took nothing is drawn.
const REST_FACTOR: u32 = 10;

/// Why there is nothing to show.
#[derive(Debug, thiserror::Error)]
enum SheetError {
    #[error(transparent)]
    Read(#[from] ReadError),
    #[error(transparent)]
    Settings(#[from] SettingsError),
    #[error(transparent)]
    Plot(#[from] PlotError),
}

/// What was drawn.
#[derive(Debug, Clone)]
pub(super) struct Drawn {
    /// Of which revision of the board.
    pub(super) revision: u64,
    pub(super) title: Arc<str>,
    /// The report as the content of an element.
    pub(super) html: Arc<str>,
    /// When the next may be drawn.
    pub(super) next: Instant,
}

/// What was read and drawn last.
#[derive(Debug, Default)]
pub(super) struct Sheet {
    /// Of each run how many generations it had when it was read.
    done: Vec<u32>,
    runs: Vec<Run>,
    settings: Vec<Settings>,
    drawn: Option<Drawn>,
}

impl Sheet {
    /// The report as of this state; an older one, if one was drawn a moment ago.
    pub(super) fn of(&mut self, state: &State) -> io::Result<Drawn> {
        let now = Instant::now();
        let kept =
            |drawn: &&Drawn| drawn.revision == state.revision || drawn.next > now && state.end.is_none();
        if let Some(drawn) = self.drawn.as_ref().filter(kept) {
            return Ok(drawn.clone());
        }
        let title = match (state.asked, &state.runs[..]) {
            (1, [run]) => page::name(&run.folder),
            (1, _) => "The run".to_string(),
            (asked, _) => format!("{asked} runs"),
        };
        let content = std::thread::scope(|scope| {
            let draw = || self.draw(state, &title).unwrap_or_else(|error| told(&title, &error.to_string()));
            let thread = std::thread::Builder::new().stack_size(STACK_BYTES).spawn_scoped(scope, draw)?;
            thread.join().map_err(|_| io::Error::other("the page cannot be drawn"))
        })?;
        let rest = (now.elapsed() * REST_FACTOR).max(REST);
        let next = Instant::now() + rest;
        let drawn = Drawn { revision: state.revision, title: title.into(), html: content.into(), next };
        self.drawn = Some(drawn.clone());
        Ok(drawn)
    }

    fn draw(&mut self, state: &State, title: &str) -> Result<String, SheetError> {
        for (i, begun) in state.runs.iter().enumerate() {
            self.read(i, begun)?;
        }
        if self.runs.iter().all(|run| run.records.is_empty()) {
            return Ok(told(title, "There is no complete generation yet."));
        }
        let comparison = (state.asked > 1).then(|| Comparison::of(&self.runs, &self.settings));
        let runs = std::mem::take(&mut self.runs);
        let report = Report { title: title.to_string(), runs, comparison, command: None };
        let content = page::content(&report);
        self.runs = report.runs;
        Ok(page::clean(content?.into_string()))
    }

    /// Reads a run unless it is as it was.
    fn read(&mut self, i: usize, begun: &Begun) -> Result<(), SheetError> {
        if self.done.get(i) == Some(&begun.done) {
            self.runs[i].scores.clone_from(&begun.scores);
            return Ok(());
        }
        let mut run = Run::read(&begun.folder, begun.data.clone())?;
        run.scores.clone_from(&begun.scores);
        let settings = Settings::from_record(&run.settings, &run.folder)?;
        // They are read in their order, so that what is there is a beginning of them.
        if i < self.runs.len() {
            (self.done[i], self.runs[i], self.settings[i]) = (begun.done, run, settings);
        } else {
            self.done.push(begun.done);
            self.runs.push(run);
            self.settings.push(settings);
        }
        Ok(())
    }
}

/// A page that says only this.
fn told(title: &str, words: &str) -> String {
    let content = html! { header { h1 { (title) } } main { p.note { (words) } } };
    page::clean(content.into_string())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::watch::Board;

    #[test]
    fn it_is_drawn_now_and_then_and_at_the_end() {
        let board = Board::new(1, 5);
        let mut sheet = Sheet::default();
        let mut draw = || {
            let drawn = sheet.of(&board.state()).expect("drawn");
            assert!(drawn.html.contains("There is no complete generation yet."), "{}", drawn.html);
            drawn.revision
        };
        let first = draw();
        board.generation(0);
        assert_eq!(draw(), first, "it was drawn a moment ago");
        board.end("It has ended.");
        assert_eq!((draw(), draw()), (first + 2, first + 2), "the last is drawn at once");
    }

    #[test]
    fn a_folder_that_cannot_be_read_is_told() {
        let dir = tempfile::tempdir().expect("a temporary folder");
        let mut sheet = Sheet::default();
        let folder = dir.path().join("<b>");
        let state = State::of_one(&folder);
        let drawn = sheet.of(&state).expect("drawn");
        assert!(drawn.html.contains("&lt;b&gt;: there is no settings.toml"), "{}", drawn.html);
        assert_eq!(&*drawn.title, "<b>");
    }
}
