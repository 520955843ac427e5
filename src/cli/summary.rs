//! The end of a run: what was found, how good it is, and what to do with it.

use std::fmt;
use std::path::{Path, PathBuf};

use serde::Serialize;
use vsonar::dataset::{Constants, Dataset};
use vsonar::evolve::{Evolution, Preset, Score, Settings};

use super::CliError;
use super::output::{count, duration, from_here, percent, shell_word};
use super::source::{Cases, Source};
use super::table::Table;

/// How the best program does on a set, beside what a detector that never looks would reach.
#[derive(Debug, Clone, Serialize)]
struct Part {
    fitness: f64,
    correct: u32,
    cases: u32,
    /// The best constant of the training cases.
    constant: f64,
    /// The best constants of the training cases, one for each column.
    constant_per_column: f64,
}

impl Part {
    fn of(score: Score, constants: &Constants, set: &Dataset) -> Part {
        let floor = constants.score(set);
        Part {
            fitness: score.fitness,
            correct: score.correct,
            cases: score.cases,
            constant: floor.overall_share(),
            constant_per_column: floor.per_column_share(),
        }
    }
}

#[derive(Debug, Clone, Serialize)]
struct Best {
    file: PathBuf,
    nodes: usize,
    depth: usize,
    generation: u32,
    program: String,
}

/// The summary, as text and as JSON.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct Report {
    run: PathBuf,
    complete: bool,
    generations: u32,
    population: u32,
    seed: u64,
    evaluations: u64,
    seconds: f64,
    train: Part,
    holdout: Option<Part>,
    best: Best,
    /// Whether this was a run on the built-in corridor that is smaller than the published ones.
    small: bool,
    #[serde(skip)]
    data: Option<PathBuf>,
    #[serde(skip)]
    other: Option<PathBuf>,
}

impl Report {
    /// The report on a run; `None` before its first generation is complete.
    pub(crate) fn of(
        evolution: &Evolution,
        cases: &Cases,
        source: &Source,
        folder: &Path,
        seconds: f64,
    ) -> Result<Option<Report>, CliError> {
        let Some(summary) = evolution.summary(cases.holdout.as_ref())? else { return Ok(None) };
        let settings = evolution.settings();
        let constants = Constants::learn(&cases.train, settings.tolerance);
        let full = Settings::preset(Preset::Default);
        let holdout = cases.holdout.as_ref().zip(summary.holdout);
        Ok(Some(Report {
            run: folder.to_path_buf(),
            complete: summary.generations >= settings.generations,
            generations: summary.generations,
            population: settings.population,
            seed: settings.seed,
            evaluations: summary.evaluations,
            seconds,
            train: Part::of(summary.train, &constants, &cases.train),
            holdout: holdout.map(|(set, score)| Part::of(score, &constants, set)),
            best: Best {
                file: folder.join("best.gp"),
                nodes: summary.best.len(),
                depth: summary.best.depth(),
                generation: summary.generation,
                program: format!("{:#}", summary.best),
            },
            small: source.is_synthetic()
                && (settings.population < full.population || settings.generations < full.generations),
            data: source.train_folder().map(from_here),
            other: source.holdout_folder().map(from_here),
        }))
    }

    fn scores(&self) -> Table {
        let mut table = match self.holdout {
            Some(_) => Table::new(1, &["", "training", "held out"]),
            None => Table::new(1, &["", "training"]),
        };
        let parts: Vec<&Part> = std::iter::once(&self.train).chain(&self.holdout).collect();
        let mut row = |name: &str, cell: &dyn Fn(&Part) -> String| {
            table.row(std::iter::once(name.to_string()).chain(parts.iter().map(|part| cell(part))));
        };
        row("the evolved program", &|p| percent(p.fitness));
        row("best constant per column", &|p| percent(p.constant_per_column));
        row("best constant", &|p| percent(p.constant));
        row("correct cases", &|p| format!("{} of {}", p.correct, p.cases));
        table
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let program = shell_word(&self.best.file);
        let full = Settings::preset(Preset::Default);
        writeln!(
            f,
            "\n{}, {} evaluated, {}\n",
            count(self.generations.into(), "generation"),
            count(self.evaluations, "individual"),
            duration(self.seconds)
        )?;
        writeln!(f, "{}", self.scores())?;
        writeln!(
            f,
            "The program has {} and came up in generation {}: {}",
            count(self.best.nodes as u64, "node"),
            self.best.generation,
            self.best.file.display()
        )?;
        if self.small {
            writeln!(
                f,
                "\nThis was a small run on built-in images. At the scale of the published runs:\n  \
                 vsonar evolve --population {} --generations {}",
                full.population, full.generations
            )?;
        }
        writeln!(f, "\nNext:")?;
        let data = match &self.data {
            Some(data) => shell_word(data),
            None => {
                writeln!(f, "  vsonar data synth corridor    # the built-in images as a folder")?;
                "corridor".to_string()
            }
        };
        writeln!(f, "  vsonar eval {program} --data {data}    # every error, column by column")?;
        if let Some(other) = &self.other {
            writeln!(
                f,
                "  vsonar eval {program} --data {}    # the same on the held-out folder",
                shell_word(other)
            )?;
        }
        writeln!(f, "  vsonar show {program} --data {data} --out pictures    # what it sees")?;
        writeln!(f, "  vsonar ir {program}    # what the compiler makes of it")?;
        writeln!(
            f,
            "  vsonar evolve --resume {} --generations {}    # more generations",
            shell_word(&self.run),
            self.generations + 50
        )
    }
}
