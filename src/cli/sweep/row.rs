//! A row of the results of a sweep: a run and what came of it.

use serde::{Deserialize, Deserializer, Serialize, de};
use vsonar::csv_table::{CsvReader, whole_number};
use vsonar::evolve::{Collapse, Score, Settings};

use super::super::CliError;

/// A run. What is said of a part of the data is empty where there is no such part, or it was not looked at.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Row {
    pub(crate) data: String,
    pub(crate) setting: String,
    #[serde(deserialize_with = "whole_field")]
    pub(crate) seed: u64,
    /// Tells other settings of the same name.
    pub(crate) settings_fingerprint: String,
    pub(crate) train_fingerprint: String,
    pub(crate) validation_fingerprint: Option<String>,
    pub(crate) holdout_fingerprint: Option<String>,
    #[serde(deserialize_with = "whole_field")]
    pub(crate) train_correct: u32,
    #[serde(deserialize_with = "whole_field")]
    pub(crate) train_cases: u32,
    pub(crate) train_fitness: f64,
    /// The share that the best constant of each column reaches, learned on the training cases.
    pub(crate) train_constant: f64,
    #[serde(deserialize_with = "whole_field_if_any")]
    pub(crate) validation_correct: Option<u32>,
    #[serde(deserialize_with = "whole_field_if_any")]
    pub(crate) validation_cases: Option<u32>,
    pub(crate) validation_fitness: Option<f64>,
    pub(crate) validation_constant: Option<f64>,
    #[serde(deserialize_with = "whole_field_if_any")]
    pub(crate) holdout_correct: Option<u32>,
    #[serde(deserialize_with = "whole_field_if_any")]
    pub(crate) holdout_cases: Option<u32>,
    pub(crate) holdout_fitness: Option<f64>,
    pub(crate) holdout_constant: Option<f64>,
    #[serde(deserialize_with = "whole_field")]
    pub(crate) generations: u32,
    #[serde(deserialize_with = "whole_field")]
    pub(crate) evaluations: u64,
    /// Programs that had to be run; all other results were known.
    #[serde(deserialize_with = "whole_field")]
    pub(crate) fresh: u64,
    #[serde(deserialize_with = "whole_field")]
    pub(crate) nodes: u64,
    #[serde(deserialize_with = "whole_field")]
    pub(crate) generation_of_best: u32,
    /// How the run has collapsed, if it has; earlier releases did not tell.
    #[serde(default)]
    pub(crate) warning: Option<Collapse>,
    /// The winner, as program text in one line.
    pub(crate) program: String,
    /// Last, for it is the one column that differs from one sweep to the next.
    pub(crate) seconds: f64,
}

/// A whole number as tables have it, which other programs may have written again as `4.0`.
fn whole_field<'de, D: Deserializer<'de>, N: TryFrom<i128>>(from: D) -> Result<N, D::Error> {
    let missing = || de::Error::custom("a number is missing");
    whole_field_if_any(from)?.ok_or_else(missing)
}

fn whole_field_if_any<'de, D: Deserializer<'de>, N: TryFrom<i128>>(from: D) -> Result<Option<N>, D::Error> {
    let text = String::deserialize(from)?;
    if text.is_empty() {
        return Ok(None);
    }
    let number = whole_number(&text).and_then(|number| N::try_from(number).ok());
    number.map(Some).ok_or_else(|| de::Error::custom(format!("`{text}` is not a whole number")))
}

/// What the winner does on a part of the data, and what a constant per column does.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct PartScore {
    pub(crate) fingerprint: String,
    pub(crate) score: Score,
    pub(crate) constant: f64,
}

/// A part of the data.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Part {
    Train,
    Validation,
    Holdout,
}

impl Part {
    pub(crate) const ALL: [Part; 3] = [Part::Train, Part::Validation, Part::Holdout];

    /// As the tables have it.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Part::Train => "training",
            Part::Validation => "validation",
            Part::Holdout => "held out",
        }
    }
}

impl Row {
    /// The share of a part's cases that the winner solves.
    pub(crate) fn fitness(&self, part: Part) -> Option<f64> {
        match part {
            Part::Train => Some(self.train_fitness),
            Part::Validation => self.validation_fitness,
            Part::Holdout => self.holdout_fitness,
        }
    }

    /// The share of a part's cases that the best constants solve.
    pub(crate) fn constant(&self, part: Part) -> Option<f64> {
        match part {
            Part::Train => Some(self.train_constant),
            Part::Validation => self.validation_constant,
            Part::Holdout => self.holdout_constant,
        }
    }

    /// Notes what the winner does on a part that it was not trained on.
    pub(crate) fn set(&mut self, part: Part, PartScore { fingerprint, score, constant }: PartScore) {
        let (correct, cases) = (Some(score.correct), Some(score.cases));
        let (fitness, constant) = (Some(score.fitness), Some(constant));
        match part {
            Part::Train => {}
            Part::Validation => {
                self.validation_fingerprint = Some(fingerprint);
                (self.validation_correct, self.validation_cases) = (correct, cases);
                (self.validation_fitness, self.validation_constant) = (fitness, constant);
            }
            Part::Holdout => {
                self.holdout_fingerprint = Some(fingerprint);
                (self.holdout_correct, self.holdout_cases) = (correct, cases);
                (self.holdout_fitness, self.holdout_constant) = (fitness, constant);
            }
        }
    }

    /// The names of the columns.
    pub(crate) fn columns() -> Result<Vec<String>, CliError> {
        let bytes = csv_of([&Row::default()])?;
        let header = CsvReader::new(&bytes)?.next().transpose()?;
        Ok(header.map(|header| header.texts()).unwrap_or_default())
    }

    /// What is wrong with the numbers, which a hand may have changed.
    pub(crate) fn fault(&self) -> Option<String> {
        let train = (Some(&self.train_fingerprint), Some(self.train_correct), Some(self.train_cases));
        let validation =
            (self.validation_fingerprint.as_ref(), self.validation_correct, self.validation_cases);
        let holdout = (self.holdout_fingerprint.as_ref(), self.holdout_correct, self.holdout_cases);
        for (part, (fingerprint, correct, cases)) in Part::ALL.into_iter().zip([train, validation, holdout]) {
            let (fitness, constant) = (self.fitness(part), self.constant(part));
            match (fingerprint, correct, cases, fitness, constant) {
                (None, None, None, None, None) => {}
                (Some(_), Some(correct), Some(cases), Some(fitness), Some(constant)) => {
                    // A fitness that is no number is not near either.
                    let near = (fitness - f64::from(correct) / f64::from(cases)).abs() < 1e-9;
                    if !near || correct > cases {
                        return Some(format!(
                            "the fitness {fitness} ({}) is not {correct} of {cases} cases",
                            part.name()
                        ));
                    }
                    if !(0.0..=1.0).contains(&constant) {
                        return Some(format!("the constants' {constant} ({}) is no share", part.name()));
                    }
                }
                _ => return Some(format!("of the {} part some columns are empty", part.name())),
            }
        }
        (!self.seconds.is_finite()).then(|| format!("{} is no number of seconds", self.seconds))
    }
}

/// Rows as CSV, below the names of the columns.
pub(crate) fn csv_of<'a>(rows: impl IntoIterator<Item = &'a Row>) -> Result<Vec<u8>, CliError> {
    let mut csv = csv::Writer::from_writer(Vec::new());
    rows.into_iter().try_for_each(|row| csv.serialize(row))?;
    csv.into_inner().map_err(|e| CliError::Failed(e.to_string()))
}

/// What tells settings apart, the number of generations included.
pub(crate) fn settings_fingerprint(settings: &Settings) -> String {
    format!("{:016x}-{}", settings.fingerprint(), settings.generations)
}
