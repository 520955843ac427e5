//! The end of a run: what was found, how good it is, and what to do with it.

use std::fmt;
use std::path::{Path, PathBuf};

use serde::Serialize;
use vsonar::dataset::{Constants, TOLERANCE};
use vsonar::evolve::{Evolution, Preset, Settings, Warning};
use vsonar::report::page;
use vsonar::support::printable::ShownPath as _;

use super::CliError;
use super::cases::Cases;
use super::output::{count, duration, from_here, percent, shell_flag, shell_word};
use super::part::Part;
use super::source::Source;
use super::source_parts;
use super::table::Table;
use super::terminal::Look;
use super::untested;
use super::wrap::width;

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
    /// On the validation part, which chose the program.
    validation: Option<Part>,
    /// On the held-out part; absent before the run is complete, for nobody is to look at it before.
    holdout: Option<Part>,
    best: Best,
    /// Whether the run ended collapsed, and what to try.
    warnings: Vec<Warning>,
    /// Whether this was a run on built-in images that is smaller than the published ones.
    small: bool,
    /// A word on what the figures are worth.
    #[serde(skip)]
    caution: Option<String>,
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
        let settings = evolution.settings();
        let complete = evolution.generations() >= settings.generations;
        let holdout = cases.holdout.as_ref().filter(|_| complete);
        let Some(summary) = evolution.summary(holdout)? else { return Ok(None) };
        let constants = Constants::learn(&cases.train, settings.tolerance);
        let full = Settings::preset(Preset::Default);
        let solved = &summary.solved;
        let part = |(set, solved)| Part::of(set, solved, &constants);
        Ok(Some(Report {
            run: folder.to_path_buf(),
            complete,
            generations: summary.generations,
            population: settings.population,
            seed: settings.seed,
            evaluations: summary.evaluations,
            seconds,
            train: part((&cases.train, &solved.train)),
            augmented: summary.augmented.map(|s| Augmented {
                fitness: s.fitness,
                correct: s.correct,
                cases: s.cases,
            }),
            validation: cases.validation.as_ref().zip(solved.validation.as_ref()).map(part),
            holdout: holdout.zip(solved.holdout.as_ref()).map(part),
            best: Best {
                file: folder.join("best.gp"),
                nodes: summary.best.len(),
                depth: summary.best.depth(),
                generation: summary.generation,
                program: format!("{:#}", summary.best),
            },
            warnings: evolution.warning().into_iter().collect(),
            small: *source == Source::built_in()
                && (settings.population < full.population || settings.generations < full.generations),
            caution: untested::caution(source, cases),
            next: next(folder),
        }))
    }

    /// The parts there are, as a page has them.
    pub(crate) fn for_page(&self, cases: &Cases) -> Vec<page::Score> {
        let parts = [
            (page::Part::Training, Some(&self.train), Some(&cases.train)),
            (page::Part::Validation, self.validation.as_ref(), cases.validation.as_ref()),
            (page::Part::Holdout, self.holdout.as_ref(), cases.holdout.as_ref()),
        ];
        parts.into_iter().filter_map(|(part, score, set)| Some(score?.for_page(part, set?))).collect()
    }

    /// The parts there are, by name.
    fn parts(&self) -> Vec<(&'static str, &Part)> {
        let parts = [
            ("training", Some(&self.train)),
            ("validation", self.validation.as_ref()),
            ("held out", self.holdout.as_ref()),
        ];
        parts.into_iter().filter_map(|(name, part)| Some((name, part?))).collect()
    }

    fn scores(&self) -> Table {
        let parts = self.parts();
        let names = parts.iter().map(|(name, _)| *name);
        let mut table = Table::new(1, &std::iter::once("").chain(names).collect::<Vec<_>>());
        let mut row = |name: &str, cell: &dyn Fn(&Part) -> String| {
            table.row(std::iter::once(name.to_string()).chain(parts.iter().map(|(_, part)| cell(part))));
        };
        row("the evolved program", &|p| percent(p.fitness));
        row("95 % interval", &|p| {
            p.interval.map_or("-".to_string(), |(low, high)| format!("{} to {}", percent(low), percent(high)))
        });
        row("best constant per column", &|p| percent(p.constant_per_column));
        row("best constant", &|p| percent(p.constant));
        row("correct cases", &|p| format!("{} of {}", p.correct, p.cases));
        table
    }

    /// The program by column, each beside the constant for it.
    fn columns(&self) -> Table {
        let parts = self.parts();
        let names = parts.iter().flat_map(|(name, _)| [*name, "constant"]);
        let mut table = Table::new(1, &std::iter::once("column").chain(names).collect::<Vec<_>>());
        let mut columns: Vec<u32> =
            parts.iter().flat_map(|(_, part)| part.columns.iter().map(|c| c.x)).collect();
        columns.sort_unstable();
        columns.dedup();
        for x in columns {
            let cells = parts.iter().flat_map(|(_, part)| match part.columns.iter().find(|c| c.x == x) {
                Some(column) => [percent(column.fitness), percent(column.constant)],
                None => ["-", "-"].map(str::to_string),
            });
            table.row(std::iter::once(x.to_string()).chain(cells));
        }
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
        writeln!(f, "{}", self.columns())?;
        if self.validation.is_some() {
            writeln!(
                f,
                "Validation chose the program from the hall of fame, so that its figure flatters a little."
            )?;
        }
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
            self.best.file.shown()
        )?;
        self.warnings.iter().try_for_each(|warning| writeln!(f, "\nWarning: {warning}"))?;
        if self.small {
            writeln!(
                f,
                "\nThis was a small run on built-in images. At the scale of the published runs:\n  \
                 vsonar evolve --population {} --generations {}",
                full.population, full.generations
            )?;
        }
        self.caution.iter().try_for_each(|caution| writeln!(f, "\n{caution}"))?;
        write!(f, "\n{}", steps(&self.next, Look::stdout().width))
    }
}

/// What separates a command from its meaning.
const MEANING: &str = "    # ";

/// The commands that matter most when a run is complete, each with its meaning.
pub(crate) fn next(folder: &Path) -> Vec<String> {
    let (run, program) = (shell_word(folder), shell_word(&folder.join("best.gp")));
    let detector = shell_word(&folder.join("detector"));
    let commands = [
        (format!("vsonar report {run}"), "the run as a page: curves, errors, pictures"),
        (format!("vsonar explain {run}"), "what the program does, line by line"),
        (format!("vsonar export {program} --out {detector}"), "native code and C for a robot"),
    ];
    commands.into_iter().map(|(command, meaning)| format!("{command}{MEANING}{meaning}")).collect()
}

/// The commands with their meanings side by side; without meanings where they do not fit.
pub(crate) fn steps(next: &[String], room: Option<usize>) -> String {
    let parts = next.iter().map(|line| line.split_once(MEANING).unwrap_or((line, "")));
    let longest = parts.clone().map(|(command, _)| width(command)).max().unwrap_or(0);
    let line = |(command, meaning): (&str, &str)| {
        let gap = " ".repeat(longest - width(command));
        format!("  {command}{gap}{MEANING}{meaning}")
    };
    let full: Vec<String> = parts.clone().map(line).collect();
    let fits = room.is_none_or(|room| full.iter().all(|line| width(line) <= room));
    let short = || parts.map(|(command, _)| format!("  {command}")).collect();
    format!("Next:\n{}\n", if fits { full } else { short() }.join("\n"))
}

/// What else can be done with the result, as commands to copy. They come to the numbers of the summary.
pub(crate) fn commands(
    source: &Source,
    cases: &Cases,
    settings: &Settings,
    generations: u32,
    folder: &Path,
) -> Vec<String> {
    let program = shell_word(&folder.join("best.gp"));
    let flags = |part: &source_parts::Part| {
        let mut flags = format!("--data {}", shell_word(&part.folder));
        part.pattern.iter().for_each(|glob| flags += &format!(" {}", shell_flag("--match", glob)));
        if settings.tolerance != TOLERANCE {
            flags += &format!(" --tolerance {}", settings.tolerance);
        }
        flags
    };
    let synth = |part: &source_parts::Part, what: &str| {
        part.synth.as_ref().map(|command| format!("{command}    # {what} as a folder"))
    };
    let parts = [
        Some(("train", "in training")),
        cases.validation.as_ref().map(|_| ("validation", "in validation")),
        cases.holdout.as_ref().map(|_| ("holdout", "on the held-out images")),
    ];
    let mut next = Vec::new();
    if let Some(parts) = source.parts() {
        let words = [
            ("the built-in images", "its errors, column by column"),
            ("the building of validation", "the same on the validation images"),
            ("the held-out building", "the same on the held-out images"),
        ];
        for (part, (images, errors)) in
            parts.iter().zip(words).filter_map(|(part, words)| Some((part.as_ref()?, words)))
        {
            next.extend(synth(part, images));
            next.push(format!("vsonar eval {program} {}    # {errors}", flags(part)));
        }
        if let [Some(train), ..] = &parts {
            next.push(format!("vsonar show {program} {} --out pictures    # what it sees", flags(train)));
        }
    } else {
        // Only the run folder knows which images are in which part.
        let run = shell_word(folder);
        for (part, what) in parts.into_iter().flatten() {
            next.push(format!("vsonar eval {run} --part {part}    # its errors {what}"));
        }
        if let Some(data) = source.folder() {
            next.push(format!(
                "vsonar show {program} --data {} --out pictures    # what it sees",
                shell_word(&from_here(data))
            ));
        }
    }
    if let Some(world) = source.office() {
        next.push(format!(
            "vsonar drive {} --world {world} --against all    # on a robot in the building, beside others",
            shell_word(folder)
        ));
    }
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
