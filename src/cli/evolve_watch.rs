//! `vsonar evolve --watch`: the page on which runs are seen while they go on.

use std::path::Path;
use std::sync::Arc;

use vsonar::evolve::Evolution;
use vsonar::report::page::Score;
use vsonar::watch::{self, Board, Served};
use vsonar::web::Server;

use super::source::Source;
use super::{CliError, output, serve};

/// Whether and where there is a page.
#[derive(Debug, clap::Args)]
pub(crate) struct WatchArgs {
    /// Show what there is so far as a page, live, to a browser on this machine
    ///
    /// It is the page of `vsonar report`, without what the images would have to be evaluated for; scores come when a run is
    /// complete. The address is printed; who knows it can look on. The page is served as long as the command runs; a browser that has it keeps it.
    #[arg(long)]
    watch: bool,
    /// The port of 127.0.0.1 of the page; 0 takes any that is free
    #[arg(long, value_name = "PORT", requires = "watch", default_value_t = 0)]
    port: u16,
    /// Show the page in the browser at once
    #[arg(long, requires = "watch")]
    open: bool,
}

/// The page, if one is asked for. What it is told is lost otherwise.
pub(crate) struct Page {
    board: Arc<Board>,
    /// Ends the page when it is dropped.
    _served: Option<Served>,
}

impl WatchArgs {
    /// Takes the port, before anything is begun.
    pub(crate) fn bind(&self) -> Result<Option<Server>, CliError> {
        if self.watch { serve::bind(self.port).map(Some) } else { Ok(None) }
    }

    /// Serves the page of so many runs of so many generations each, and tells its address.
    pub(crate) fn start(
        &self,
        server: Option<Server>,
        runs: usize,
        generations: u32,
    ) -> Result<Page, CliError> {
        let board = Board::new(runs, generations);
        let Some(server) = server else { return Ok(Page { board, _served: None }) };
        let address = server.address();
        let served = watch::serve(board.clone(), server)?;
        // Standard output has something else to say; and without the address the page is of no use, even with `--quiet`.
        output::say(&format!("watch: {address}"));
        if self.open {
            serve::open(&address);
        }
        Ok(Page { board, _served: Some(served) })
    }
}

impl Page {
    /// A run begins or goes on; gives its number.
    pub(crate) fn begin(&self, folder: &Path, source: &Source, evolution: &Evolution) -> usize {
        self.board.begin(&output::from_here(folder), source.describe(), evolution)
    }

    /// A generation of a run is recorded.
    pub(crate) fn generation(&self, run: usize) {
        self.board.generation(run);
    }

    /// The winner of a run reaches this.
    pub(crate) fn scored(&self, run: usize, scores: Vec<Score>) {
        self.board.scored(run, scores);
    }

    /// The runs are complete; `folders` are what a report on them is asked for with.
    pub(crate) fn complete(&self, folders: &[&Path]) {
        let words: String = folders.iter().map(|folder| format!(" {}", output::shell_word(folder))).collect();
        let run = if folders.len() == 1 { "run has" } else { "runs have" };
        self.board.end(&format!("The {run} ended; `vsonar report{words}` makes the whole page."));
    }

    /// It came to nothing more, for this reason.
    pub(crate) fn broken(&self, error: &CliError) {
        self.board.end(&match error {
            CliError::Interrupted(words) => format!("The command was {words}"),
            CliError::Usage(words) | CliError::Failed(words) => format!("The command has failed: {words}"),
            CliError::Negative | CliError::Closed => "The command has ended.".to_string(),
        });
    }
}
