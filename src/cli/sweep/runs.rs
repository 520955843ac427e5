//! The runs of a sweep on one data set.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

use vsonar::dataset::Constants;
use vsonar::evolve::{Evolution, Settings, SharedSet, StopReason};
use vsonar::exec::Executor;
use vsonar::support::printable::ShownPath as _;
use vsonar::tree::Individual;

use super::super::CliError;
use super::cells::{Cell, Grid, Work};
use super::row::{Part, PartScore, Row, settings_fingerprint};

/// What the runs on a data set work with.
pub(crate) struct On<'a> {
    pub(crate) grid: &'a Grid<'a>,
    pub(crate) train: SharedSet<'a>,
    pub(crate) validation: Option<SharedSet<'a>>,
    pub(crate) holdout: Option<SharedSet<'a>>,
    pub(crate) executor: &'a Arc<dyn Executor>,
    /// The file of results, to be named where it is at fault.
    pub(crate) results: &'a Path,
    /// Bytes for results of programs in each of the runs at a time.
    pub(crate) cache: usize,
    pub(crate) stop: &'a AtomicBool,
}

impl On<'_> {
    /// Makes a run, or evaluates its winner on the held-out cases; `None` if stopped.
    pub(crate) fn work(&self, work: &Work, threads: usize) -> Result<Option<Row>, CliError> {
        let row = match work {
            Work::Run(cell) => self.run(cell, threads)?,
            Work::Test(_, row) => Some((**row).clone()),
        };
        let Some(mut row) = row else { return Ok(None) };
        if self.grid.spec.test
            && row.holdout_fingerprint.is_none()
            && let Some(holdout) = &self.holdout
        {
            row.set(Part::Holdout, self.score(holdout, &row, &self.grid.settings(work.cell()))?);
        }
        Ok(Some(row))
    }

    fn run(&self, cell: &Cell, threads: usize) -> Result<Option<Row>, CliError> {
        let start = Instant::now();
        let settings = self.grid.settings(cell);
        let mut evolution = Evolution::on(&self.train, settings.clone(), self.executor.clone(), threads)?;
        evolution.limit_cache(self.cache);
        self.validation.iter().try_for_each(|set| evolution.validate_on(set))?;
        if evolution.run(self.stop, |_| ())? == StopReason::Interrupted {
            return Ok(None);
        }
        let (Some(summary), Some(state)) = (evolution.summary(None)?, evolution.state()) else {
            return Ok(None);
        };
        let (data, setting) = self.grid.names(cell);
        let constants = Constants::learn(self.train.data(), settings.tolerance);
        let mut row = Row {
            data: data.to_string(),
            setting: setting.to_string(),
            seed: cell.seed,
            settings_fingerprint: settings_fingerprint(&settings),
            train_fingerprint: hex(&self.train),
            validation_fingerprint: None,
            holdout_fingerprint: None,
            train_correct: summary.train.correct,
            train_cases: summary.train.cases,
            train_fitness: summary.train.fitness,
            train_constant: constants.score(self.train.data()).per_column_share(),
            validation_correct: None,
            validation_cases: None,
            validation_fitness: None,
            validation_constant: None,
            holdout_correct: None,
            holdout_cases: None,
            holdout_fitness: None,
            holdout_constant: None,
            generations: summary.generations,
            evaluations: summary.evaluations,
            fresh: state.records.iter().map(|record| record.timing.executed).sum(),
            nodes: summary.best.len() as u64,
            generation_of_best: summary.generation,
            warning: evolution.warning().map(|warning| warning.kind),
            program: one_line(&summary.best),
            seconds: start.elapsed().as_secs_f64(),
        };
        if let Some((set, score)) = self.validation.as_ref().zip(summary.validation) {
            let constant = constants.score(set.data()).per_column_share();
            row.set(Part::Validation, PartScore { fingerprint: hex(set), score, constant });
        }
        Ok(Some(row))
    }

    /// What the winner of a row does on a part of the data.
    fn score(&self, part: &SharedSet<'_>, row: &Row, settings: &Settings) -> Result<PartScore, CliError> {
        let winner: Individual = row.program.parse().map_err(|error| {
            CliError::Failed(format!(
                "{}: the program in the row of `{}`, `{}`, seed {} is none: {error}; take the line out, so that the run \
                 is made again",
                self.results.shown(),
                row.data,
                row.setting,
                row.seed
            ))
        })?;
        let constants = Constants::learn(self.train.data(), settings.tolerance);
        Ok(PartScore {
            fingerprint: hex(part),
            score: part.score(&winner, self.executor.clone(), settings.tolerance)?,
            constant: constants.score(part.data()).per_column_share(),
        })
    }
}

/// The program in one line, so that every row of the results is one.
fn one_line(individual: &Individual) -> String {
    individual.to_string().split_whitespace().collect::<Vec<_>>().join(" ")
}

/// A fingerprint as it stands in the results.
fn hex(set: &SharedSet<'_>) -> String {
    format!("{:016x}", set.fingerprint())
}
