//! The end of a run: what was found, how good it is, and what to do with it.

use std::fmt;
use std::path::{Path, PathBuf};

use serde::Serialize;
use vsonar::dataset::{Constants, Dataset, TOLERANCE};
use vsonar::evolve::{Evolution, Preset, Score, Settings};
use vsonar::world::FRAMES;

use super::CliError;
use super::output::{count, duration, percent, shell_flag, shell_word};
use super::source::{self, Cases, Source};
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

/// How the best program does on images and altered copies together.
#[derive(Debug, Clone, Serialize)]
struct Augmented {
    fitness: f64,
    correct: u32,
    cases: u32,
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
    /// On the training images as they are.
    train: Part,
    /// With augmentation: what selection saw, the training images and their altered copies.
    #[serde(skip_serializing_if = "Option::is_none")]
    augmented: Option<Augmented>,
    holdout: Option<Part>,
    best: Best,
    /// Whether this was a run on the built-in corridor that is smaller than the published ones.
    small: bool,
    #[serde(skip)]
    next: Vec<String>,
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
            augmented: summary.augmented.map(|s| Augmented {
                fitness: s.fitness,
                correct: s.correct,
                cases: s.cases,
            }),
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
            next: next(source, settings, summary.generations, folder),
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
        let full = Settings::preset(Preset::Default);
        writeln!(
            f,
            "\n{}, {} evaluated, {}\n",
            count(self.generations.into(), "generation"),
            count(self.evaluations, "individual"),
            duration(self.seconds)
        )?;
        writeln!(f, "{}", self.scores())?;
        if let Some(all) = &self.augmented {
            writeln!(
                f,
                "With the altered copies of the training images, as selection saw them: {} ({} of {} cases)",
                percent(all.fitness),
                all.correct,
                all.cases
            )?;
        }
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
        self.next.iter().try_for_each(|command| writeln!(f, "  {command}"))
    }
}

/// What to do with the result, as commands to copy. They come to the numbers of the summary.
pub(crate) fn next(source: &Source, settings: &Settings, generations: u32, folder: &Path) -> Vec<String> {
    let program = shell_word(&folder.join("best.gp"));
    let flags = |part: &source::Part| {
        let mut flags = format!("--data {}", shell_word(&part.folder));
        part.pattern.iter().for_each(|glob| flags += &format!(" {}", shell_flag("--match", glob)));
        if settings.tolerance != TOLERANCE {
            flags += &format!(" --tolerance {}", settings.tolerance);
        }
        flags
    };
    let synth = |part: &source::Part, what: &str| {
        part.synth.map(|(building, frames)| {
            let mut command = format!("vsonar data synth {}", shell_word(&part.folder));
            if building != source::BUILDING {
                command += &format!(" --seed {building}");
            }
            if frames != FRAMES {
                command += &format!(" --frames {frames}");
            }
            format!("{command}    # {what} as a folder")
        })
    };
    let (train, holdout) = source.parts();
    let mut next = Vec::new();
    next.extend(synth(&train, "the built-in images"));
    next.push(format!("vsonar eval {program} {}    # every error, column by column", flags(&train)));
    if let Some(holdout) = &holdout {
        next.extend(synth(holdout, "the held-out building"));
        next.push(format!("vsonar eval {program} {}    # the same on the held-out images", flags(holdout)));
    }
    next.push(format!("vsonar show {program} {} --out pictures    # what it sees", flags(&train)));
    next.push(format!("vsonar ir {program}    # what the compiler makes of it"));
    let detector = shell_word(&folder.join("detector"));
    next.push(format!("vsonar export {program} --out {detector}    # native code and C for a robot"));
    next.push(format!(
        "vsonar evolve --resume {} --generations {}    # more generations",
        shell_word(folder),
        generations + 50
    ));
    next
}
