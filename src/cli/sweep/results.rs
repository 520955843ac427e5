//! The results of a sweep: a row of `results.csv` for each run.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use vsonar::evolve::{Score, Settings};

use super::super::CliError;
use super::super::output::write_file;

/// A run. What is said of a part of the data is empty where there is no such part, or it was not looked at.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Row {
    pub(crate) data: String,
    pub(crate) setting: String,
    pub(crate) seed: u64,
    /// Tells other settings of the same name.
    pub(crate) settings_fingerprint: String,
    pub(crate) train_fingerprint: String,
    pub(crate) validation_fingerprint: Option<String>,
    pub(crate) holdout_fingerprint: Option<String>,
    pub(crate) train_correct: u32,
    pub(crate) train_cases: u32,
    pub(crate) train_fitness: f64,
    /// The share that the best constant of each column reaches, learned on the training cases.
    pub(crate) train_constant: f64,
    pub(crate) validation_correct: Option<u32>,
    pub(crate) validation_cases: Option<u32>,
    pub(crate) validation_fitness: Option<f64>,
    pub(crate) validation_constant: Option<f64>,
    pub(crate) holdout_correct: Option<u32>,
    pub(crate) holdout_cases: Option<u32>,
    pub(crate) holdout_fitness: Option<f64>,
    pub(crate) holdout_constant: Option<f64>,
    pub(crate) generations: u32,
    pub(crate) evaluations: u64,
    /// Programs that had to be run; all other results were known.
    pub(crate) fresh: u64,
    pub(crate) nodes: u64,
    pub(crate) generation_of_best: u32,
    /// The winner, as program text in one line.
    pub(crate) program: String,
    /// Last, for it is the one column that differs from one sweep to the next.
    pub(crate) seconds: f64,
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

    /// Whether it is the row of this cell.
    pub(crate) fn is_of(&self, data: &str, setting: &str, seed: u64) -> bool {
        self.seed == seed && self.data == data && self.setting == setting
    }
}

/// What tells settings apart, the number of generations included.
pub(crate) fn settings_fingerprint(settings: &Settings) -> String {
    format!("{:016x}-{}", settings.fingerprint(), settings.generations)
}

/// The file of results.
#[derive(Debug)]
pub(crate) struct Results {
    path: PathBuf,
    pub(crate) rows: Vec<Row>,
    /// Whether the last row was torn, and is left out.
    pub(crate) torn: bool,
}

impl Results {
    pub(crate) const NAME: &str = "results.csv";

    /// The results so far; none if there is no file. A last row that is not whole is left out: the process, or the
    /// machine, ended while it was written or copied.
    pub(crate) fn read(folder: &Path) -> Result<Results, CliError> {
        let path = folder.join(Results::NAME);
        let text = match fs::read_to_string(&path) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => String::new(),
            text => text.map_err(|e| CliError::file(&path, "read the file", &e))?,
        };
        let whole = text.rfind('\n').map_or("", |end| &text[..=end]);
        let mut torn = whole.len() < text.len();
        let mut reader = csv::ReaderBuilder::new().flexible(true).from_reader(whole.as_bytes());
        let (mut rows, mut fault) = (Vec::new(), None);
        for (number, row) in reader.deserialize::<Row>().enumerate() {
            if let Some(fault) = fault.take() {
                return Err(fault);
            }
            match row {
                Ok(row) => rows.push(row),
                Err(error) => {
                    let line = error.position().map_or(number as u64 + 2, csv::Position::line);
                    let reason = match error.kind() {
                        csv::ErrorKind::Deserialize { err, .. } => err.to_string(),
                        _ => error.to_string(),
                    };
                    fault = Some(CliError::Failed(format!(
                        "{}:{line}: this is no row of a sweep: {reason}; take the line out, so that the run is made \
                         again, or choose another `--out`",
                        path.display()
                    )));
                }
            }
        }
        // Only the last row can be torn; before it there are others, or the header is another one.
        match fault {
            Some(fault) if rows.is_empty() && whole.lines().count() > 1 => return Err(fault),
            Some(_) => torn = true,
            None => {}
        }
        Ok(Results { path, rows, torn })
    }

    /// Puts the results in their place as a whole, in an order in which `rank` ascends.
    pub(crate) fn write(&mut self, rank: impl Fn(&Row) -> usize) -> Result<(), CliError> {
        self.rows.sort_by_key(rank);
        let mut csv = csv::Writer::from_writer(Vec::new());
        for row in &self.rows {
            csv.serialize(row)?;
        }
        let bytes = csv.into_inner().map_err(|e| CliError::Failed(e.to_string()))?;
        write_file(&self.path, &bytes)
    }

    /// Where the file is.
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// The row of a cell.
    pub(crate) fn of(&self, data: &str, setting: &str, seed: u64) -> Option<&Row> {
        self.rows.iter().find(|row| row.is_of(data, setting, seed))
    }

    /// Takes up a row, in the place of an earlier one of the same cell.
    pub(crate) fn put(&mut self, row: Row) {
        match self.rows.iter_mut().find(|old| old.is_of(&row.data, &row.setting, row.seed)) {
            Some(old) => *old = row,
            None => self.rows.push(row),
        }
    }

    /// Removes what writers that were killed have left behind. To be called by the process that holds the lock.
    pub(crate) fn remove_leftovers(folder: &Path) {
        let Ok(entries) = fs::read_dir(folder) else { return };
        for entry in entries.flatten() {
            let name = entry.file_name();
            let name = name.to_string_lossy();
            if name.starts_with(&format!(".{}.", Results::NAME)) && name.ends_with(".tmp") {
                // One that cannot be removed does no harm.
                let _ = fs::remove_file(entry.path());
            }
        }
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    pub(crate) fn row(setting: &str, seed: u64, correct: u32) -> Row {
        Row {
            data: "corridor".into(),
            setting: setting.into(),
            seed,
            settings_fingerprint: "00".into(),
            train_fingerprint: "01".into(),
            validation_fingerprint: None,
            holdout_fingerprint: None,
            train_correct: correct,
            train_cases: 100,
            train_fitness: f64::from(correct) / 100.0,
            train_constant: 0.4,
            validation_correct: None,
            validation_cases: None,
            validation_fitness: None,
            validation_constant: None,
            holdout_correct: None,
            holdout_cases: None,
            holdout_fitness: None,
            holdout_constant: None,
            generations: 3,
            evaluations: 60,
            fresh: 30,
            nodes: 12,
            generation_of_best: 2,
            program: "(individual (iterate-up 3x3 x-obstacle (set-a y)))".into(),
            seconds: 0.125,
        }
    }

    fn written(rows: &[Row]) -> (tempfile::TempDir, String) {
        let dir = tempfile::tempdir().expect("a temporary folder");
        let mut results = Results::read(dir.path()).expect("none yet");
        rows.iter().for_each(|row| results.put(row.clone()));
        results.write(|row| row.seed as usize).expect("writable");
        let text = fs::read_to_string(dir.path().join(Results::NAME)).expect("there");
        (dir, text)
    }

    #[test]
    fn rows_are_found_again() {
        let mut tested = row("lexicase, selection.tournament=3", 1, 90);
        let score = Score { correct: 4, cases: 9, fitness: 4.0 / 9.0 };
        tested.set(Part::Holdout, PartScore { fingerprint: "02".into(), score, constant: 0.25 });
        let (dir, _) = written(&[row("a", 7, 80), tested.clone(), row("a", 7, 81)]);
        let read = Results::read(dir.path()).expect("sound");
        assert_eq!((read.rows.clone(), read.torn), (vec![tested.clone(), row("a", 7, 81)], false));
        assert_eq!(read.of("corridor", &tested.setting, 1), Some(&tested));
        assert_eq!(read.of("street", &tested.setting, 1), None);
    }

    #[test]
    fn a_torn_last_row_is_left_out() {
        let rows = [row("a", 1, 80), row("a", 2, 81)];
        let (dir, text) = written(&rows);
        let second = text.lines().take(2).map(|line| line.len() + 1).sum::<usize>();
        for end in second + 1..text.len() {
            fs::write(dir.path().join(Results::NAME), &text[..end]).expect("writable");
            let read = Results::read(dir.path()).expect("only torn");
            assert_eq!((&read.rows[..], read.torn), (&rows[..1], true), "{end}");
        }
        // With an end of line after it, it is no better.
        fs::write(dir.path().join(Results::NAME), format!("{}\n", &text[..second + 20])).expect("writable");
        let read = Results::read(dir.path()).expect("only torn");
        assert_eq!((&read.rows[..], read.torn), (&rows[..1], true));
        fs::write(dir.path().join(Results::NAME), &text[..9]).expect("writable");
        assert!(Results::read(dir.path()).expect("only torn").rows.is_empty());
    }

    #[test]
    fn a_fault_before_the_last_row_is_named() {
        let (dir, text) = written(&[row("a", 1, 80), row("a", 2, 81)]);
        let wrong = text.replacen("corridor,a,1,", "corridor,a,one,", 1);
        fs::write(dir.path().join(Results::NAME), wrong).expect("writable");
        let error = Results::read(dir.path()).expect_err("no number");
        assert!(
            matches!(error, CliError::Failed(text) if text.contains("results.csv:2: ") && text.contains("--out"))
        );
        fs::write(dir.path().join(Results::NAME), "image,x,y\na.png,1,2\n").expect("writable");
        assert!(Results::read(dir.path()).is_err(), "another table");
    }
}
