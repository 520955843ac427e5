//! What several runs come to.

use std::fmt;
use std::path::PathBuf;

use serde::Serialize;
use vsonar::evolve::{Warning, rank};
use vsonar::report::page::Score;
use vsonar::statistics::Quartiles;
use vsonar::support::printable::ShownPath as _;

use super::output::{self, grouped, percent};
use super::source::Source;
use super::summary::steps;
use super::sweep::between;
use super::table::Table;
use super::terminal::Look;

/// How a run did on a part of the data.
#[derive(Debug, Clone, Copy, Serialize)]
pub(crate) struct Scored {
    fitness: f64,
    correct: u32,
    cases: u32,
    /// What the best constants of the training cases reach, one for each column.
    constant_per_column: f64,
}

impl Scored {
    pub(crate) fn of(score: &Score) -> Scored {
        let &Score { fitness, correct, cases, constant_per_column, .. } = score;
        Scored { fitness, correct, cases, constant_per_column }
    }
}

/// A run that is complete.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct One {
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) fold: Option<u32>,
    pub(crate) seed: u64,
    pub(crate) run: PathBuf,
    pub(crate) train: Scored,
    pub(crate) validation: Option<Scored>,
    pub(crate) holdout: Option<Scored>,
    pub(crate) nodes: usize,
    pub(crate) generation: u32,
    pub(crate) seconds: f64,
    /// Whether the run ended collapsed, and what to try.
    pub(crate) warning: Option<Warning>,
    /// Commands to go on with, if this is the best.
    #[serde(skip)]
    pub(crate) next: Vec<String>,
    /// A word on what the figures are worth.
    #[serde(skip)]
    pub(crate) caution: Option<String>,
}

impl One {
    fn part(&self, part: usize) -> Option<Scored> {
        [Some(self.train), self.validation, self.holdout][part]
    }
}

impl fmt::Display for One {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.fold.iter().try_for_each(|fold| write!(f, "fold {fold}, "))?;
        write!(f, "seed {}: training {}", self.seed, percent(self.train.fitness))?;
        self.validation.iter().try_for_each(|part| write!(f, ", validation {}", percent(part.fitness)))?;
        self.holdout.iter().try_for_each(|part| write!(f, ", held out {}", percent(part.fitness)))?;
        write!(f, " ({})", output::duration(self.seconds))
    }
}

const PARTS: [&str; 3] = ["training", "validation", "held out"];

/// All runs, as text and as JSON.
#[derive(Debug, Serialize)]
pub(crate) struct Report {
    /// How many runs were asked for; fewer are complete after an interruption.
    asked: usize,
    runs: Vec<One>,
    train: Option<Quartiles>,
    validation: Option<Quartiles>,
    holdout: Option<Quartiles>,
    /// With folds: the share of all held-out cases of all runs that are solved, and what the constants reach.
    #[serde(skip_serializing_if = "Option::is_none")]
    pooled: Option<Pooled>,
    /// The folder of the best run: best in validation, without such a part in training; none with folds.
    best: Option<PathBuf>,
    #[serde(skip)]
    next: Vec<String>,
}

/// Cross-validation: all held-out cases together.
#[derive(Debug, Clone, Copy, Serialize)]
struct Pooled {
    fitness: f64,
    constant_per_column: f64,
}

impl Pooled {
    fn of(runs: &[One]) -> Option<Pooled> {
        let parts: Vec<Scored> = runs.iter().filter_map(|one| one.holdout).collect();
        let cases: f64 = parts.iter().map(|part| f64::from(part.cases)).sum();
        let share = |of: &dyn Fn(&Scored) -> f64| {
            parts.iter().map(|part| of(part) * f64::from(part.cases)).sum::<f64>() / cases.max(1.0)
        };
        let folds = runs.iter().any(|one| one.fold.is_some());
        folds.then(|| Pooled {
            fitness: share(&|p| p.fitness),
            constant_per_column: share(&|p| p.constant_per_column),
        })
    }
}

impl Report {
    pub(crate) fn of(runs: Vec<One>, source: &Source, asked: usize) -> Report {
        let quartiles = |part: usize| {
            Quartiles::of(&runs.iter().filter_map(|one| Some(one.part(part)?.fitness)).collect::<Vec<_>>())
        };
        let pooled = Pooled::of(&runs);
        // The held-out cases have no say in it. Programs of different folds are trained on different images.
        let key = |one: &&One| {
            let chosen = one.validation.unwrap_or(one.train).fitness;
            rank(chosen, one.train.fitness, one.nodes as u64, one.seed)
        };
        let best = runs.iter().filter(|_| pooled.is_none()).min_by_key(key);
        let next = match (best, source.folder(), runs.first()) {
            (Some(best), ..) => best.next.clone(),
            (None, Some(folder), Some(one)) => vec![format!(
                "vsonar evolve --settings {} --data {} --validation 20%    # a program for use, trained on all of it",
                output::shell_word(&one.run.join("settings.toml")),
                output::shell_word(&output::from_here(folder)),
            )],
            _ => Vec::new(),
        };
        Report {
            asked,
            train: quartiles(0),
            validation: quartiles(1),
            holdout: quartiles(2),
            pooled,
            best: best.map(|one| one.run.clone()),
            next,
            runs,
        }
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let folds = self.pooled.is_some();
        let all = [self.train, self.validation, self.holdout];
        let there: Vec<usize> = (0..3).filter(|&part| all[part].is_some()).collect();
        let mut headings = vec![if folds { "fold, seed" } else { "seed" }];
        there.iter().for_each(|&part| headings.extend([PARTS[part], "constant"]));
        headings.extend(["nodes", "seconds", "run"]);
        let mut table = Table::new(1, &headings);
        for one in &self.runs {
            let mut cells =
                vec![one.fold.map_or(String::new(), |fold| format!("{fold}, ")) + &one.seed.to_string()];
            for &part in &there {
                let score = one.part(part);
                cells.push(score.map_or(String::new(), |part| percent(part.fitness)));
                cells.push(score.map_or(String::new(), |part| percent(part.constant_per_column)));
            }
            let path = one.run.shown();
            cells.extend([grouped(one.nodes as u64), format!("{:.1}", one.seconds), path]);
            table.row(cells);
        }
        let mut row = |name: &str, of: &dyn Fn(Quartiles) -> String| {
            let parts = there.iter().flat_map(|&part| [all[part].map_or(String::new(), of), String::new()]);
            table.row(std::iter::once(name.to_string()).chain(parts));
        };
        row("median", &|q| percent(q.median));
        row("quartiles", &between);
        row("highest", &|q| percent(q.max));
        if let Some(best) = self.runs.iter().find(|one| Some(&one.run) == self.best.as_ref()) {
            let parts = there.iter().flat_map(|&part| {
                [best.part(part).map_or(String::new(), |part| percent(part.fitness)), String::new()]
            });
            table.row(std::iter::once(format!("best: {}", best.seed)).chain(parts));
        }
        writeln!(f, "\n{table}")?;
        if let Some(Pooled { fitness, constant_per_column }) = self.pooled {
            writeln!(
                f,
                "All held-out cases together: {}; the best constants of the training parts, one for each column: {}",
                percent(fitness),
                percent(constant_per_column)
            )?;
        }
        let collapsed: Vec<&One> = self.runs.iter().filter(|one| one.warning.is_some()).collect();
        if let Some(warning) = collapsed.first().and_then(|one| one.warning.as_ref()) {
            let (some, all) = (collapsed.len(), self.runs.len());
            let runs: Vec<String> = collapsed.iter().map(|one| one.run.shown()).collect();
            writeln!(
                f,
                "Warning: {some} of {all} runs ended collapsed ({}). Of the first: {warning}",
                runs.join(", ")
            )?;
        }
        if let Some(best) = &self.best {
            let by = if self.validation.is_some() { "in validation" } else { "on the training cases" };
            writeln!(f, "The best {by}: {}", best.shown())?;
        }
        let caution = self.runs.iter().find_map(|one| one.caution.as_ref());
        caution.iter().try_for_each(|caution| writeln!(f, "\n{caution}"))?;
        write!(f, "\n{}", steps(&self.next, Look::stdout().width))
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    fn part(correct: u32) -> Scored {
        Scored { fitness: f64::from(correct) / 10.0, correct, cases: 10, constant_per_column: 0.25 }
    }

    fn one(seed: u64, train: u32, holdout: u32, nodes: usize) -> One {
        One {
            fold: None,
            seed,
            run: format!("runs/{seed}").into(),
            train: part(train),
            validation: None,
            holdout: Some(part(holdout)),
            nodes,
            generation: 1,
            seconds: 1.0,
            warning: None,
            next: vec![format!("vsonar eval runs/{seed}/best.gp")],
            caution: None,
        }
    }

    fn report(runs: Vec<One>) -> Report {
        let source = Source::Synthetic(toml::from_str("").expect("all fields have defaults"));
        let asked = runs.len();
        Report::of(runs, &source, asked)
    }

    #[test]
    fn the_best_is_chosen_by_training() {
        let report = report(vec![one(1, 7, 9, 9), one(2, 8, 1, 30), one(3, 8, 2, 20), one(4, 8, 8, 20)]);
        assert_eq!(report.best.as_deref(), Some(Path::new("runs/3")), "fewer nodes, then the first");
        assert!(report.next.iter().any(|command| command.contains("runs/3/best.gp")), "{:?}", report.next);
        let text = report.to_string();
        for part in ["80.0 %", "77.5 to 80.0", "median", "held out"] {
            assert!(text.contains(part), "{part}: {text}");
        }
    }

    #[test]
    fn the_best_is_chosen_by_validation_if_there_is_some() {
        let validated = |mut one: One, validation| {
            one.validation = Some(part(validation));
            one
        };
        let runs =
            vec![validated(one(1, 9, 9, 9), 5), validated(one(2, 6, 1, 9), 6), validated(one(3, 7, 2, 9), 6)];
        let report = report(runs);
        assert_eq!(report.best.as_deref(), Some(Path::new("runs/3")), "then by training");
        assert!(report.to_string().contains("The best in validation: runs/3"), "{report}");
    }

    #[test]
    fn folds_are_pooled_by_cases() {
        let mut runs = vec![one(1, 9, 9, 9), one(1, 9, 1, 9)];
        (runs[0].fold, runs[1].fold) = (Some(1), Some(2));
        runs[1].holdout = Some(Scored { fitness: 0.5, correct: 15, cases: 30, constant_per_column: 0.65 });
        let report = report(runs);
        let pooled = report.pooled.expect("folds");
        assert!((pooled.fitness - 0.6).abs() < 1e-12 && (pooled.constant_per_column - 0.55).abs() < 1e-12);
        assert_eq!(report.best, None);
        assert!(report.to_string().contains("All held-out cases together: 60.0 %"), "{report}");
    }
}
