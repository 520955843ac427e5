//! The results of a sweep: a row of `results.csv` for each run.

use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::time::Instant;

use vsonar::csv_table::CsvReader;
use vsonar::evolve::Lock;
use vsonar::support::bounded::Bounded;

use super::super::CliError;
use super::super::jobs::IDLE;
use super::super::output::write_file;
use super::row::{Row, csv_of};
use vsonar::support::printable::ShownPath as _;

/// Reads the results.
const RESULTS: Bounded = Bounded::to(1 << 30);

/// The file of results.
#[derive(Debug)]
pub(crate) struct Results {
    path: PathBuf,
    pub(crate) rows: Vec<Row>,
    /// The places of the rows, by data set, setting and seed.
    places: HashMap<(String, String, u64), usize>,
    /// Whether there are rows that are not in the file.
    unsaved: bool,
    saved: Option<Instant>,
    /// Whether the last row was torn, and is left out.
    pub(crate) torn: bool,
}

impl Results {
    pub(crate) const NAME: &str = "results.csv";

    /// The results so far; none if there is no file. A last row that is not whole is left out: the process, or the
    /// machine, ended while it was written or copied. A row that is there twice counts once.
    ///
    /// # Errors
    /// With file and line: if it is no file of results, a row is none, or there are different ones of a run.
    pub(crate) fn read(folder: &Path) -> Result<Results, CliError> {
        let path = folder.join(Results::NAME);
        let text = match RESULTS.text(&path) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => String::new(),
            text => text.map_err(|e| CliError::file(&path, "read the file", &e))?,
        };
        let whole = text.rfind('\n').map_or("", |end| &text[..=end]);
        let mut torn = whole.len() < text.len();
        let columns = Row::columns()?;
        let earlier: Vec<String> = columns.iter().filter(|&name| name != "warning").cloned().collect();
        let fault = |line: u64, text: String| CliError::Failed(format!("{}:{line}: {text}", path.shown()));
        let remedy = "take the line out, so that the run is made again, or choose another `--out`";
        let mut reader = CsvReader::new(whole.as_bytes())
            .map_err(|e| fault(e.line, format!("{}; {remedy}", e.problem)))?;
        let header = match reader.next() {
            Some(Ok(header)) => header.texts(),
            _ => Vec::new(),
        };
        let is_sound = match whole {
            // The torn beginning of the first line.
            "" => [&columns, &earlier].iter().any(|columns| columns.join(",").starts_with(&text)),
            _ => header == columns || header == earlier,
        };
        if !is_sound {
            return Err(CliError::Failed(format!(
                "{}:1: these are not the columns of the results of a sweep; choose another `--out`, or move the file away",
                path.shown()
            )));
        }
        let header = csv::StringRecord::from(header);
        let last = whole.trim_end().lines().count() as u64;
        let mut results = Results {
            path: path.clone(),
            rows: Vec::new(),
            places: HashMap::new(),
            unsaved: false,
            saved: None,
            torn: false,
        };
        let mut records = reader.peekable();
        while let Some(record) = records.next() {
            let (line, row) = match record {
                Ok(record) => {
                    let fields = csv::StringRecord::from(record.texts());
                    let row = fields.deserialize::<Row>(Some(&header)).map_err(|error| match error.kind() {
                        csv::ErrorKind::Deserialize { err, .. } => err.to_string(),
                        _ => error.to_string(),
                    });
                    (record.line, row)
                }
                Err(error) => (error.line, Err(error.problem)),
            };
            let row = match row {
                Ok(row) => row,
                // Only the last row can be torn, and it is in one line.
                Err(_) if records.peek().is_none() && line == last => {
                    torn = true;
                    continue;
                }
                Err(reason) => {
                    return Err(fault(line, format!("this is no row of a sweep: {reason}; {remedy}")));
                }
            };
            if let Some(text) = row.fault() {
                return Err(fault(line, format!("{text}; {remedy}")));
            }
            match results.of(&row.data, &row.setting, row.seed) {
                None => results.put(row),
                Some(there) if (Row { seconds: there.seconds, ..row.clone() }) == *there => {}
                Some(_) => {
                    return Err(fault(
                        line,
                        format!(
                            "there is a row of `{}`, `{}`, seed {} already, and it says something else; take one of \
                             them out, or both, so that the run is made again",
                            row.data, row.setting, row.seed
                        ),
                    ));
                }
            }
        }
        Ok(Results { torn, unsaved: false, ..results })
    }

    /// Whether a folder is that of a sweep, so that what has the name of its files is its own: it has results, or a lock.
    pub(crate) fn are_in(folder: &Path) -> bool {
        let empty =
            |name: &str| fs::metadata(folder.join(name)).is_ok_and(|file| file.is_file() && file.len() == 0);
        let results = folder.join(Results::NAME);
        // Those of something else are refused when they are read.
        results.is_file() && !empty(Results::NAME) || empty(Lock::NAME)
    }

    /// Puts the results in their place as a whole, in an order in which `rank` ascends, if there are new ones.
    pub(crate) fn write(&mut self, rank: impl Fn(&Row) -> usize) -> Result<(), CliError> {
        if self.unsaved {
            let mut rows: Vec<&Row> = self.rows.iter().collect();
            rows.sort_by_cached_key(|row| rank(row));
            write_file(&self.path, &csv_of(rows)?)?;
            (self.unsaved, self.saved) = (false, Some(Instant::now()));
        }
        Ok(())
    }

    /// The same, but at most once a second, for the file is written anew each time.
    pub(crate) fn write_at_times(&mut self, rank: impl Fn(&Row) -> usize) -> Result<(), CliError> {
        match self.saved {
            Some(saved) if saved.elapsed() < IDLE => Ok(()),
            _ => self.write(rank),
        }
    }

    /// Where the file is.
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// The row of a cell.
    pub(crate) fn of(&self, data: &str, setting: &str, seed: u64) -> Option<&Row> {
        let place = self.places.get(&(data.to_string(), setting.to_string(), seed))?;
        self.rows.get(*place)
    }

    /// Takes up a row, in the place of an earlier one of the same cell.
    pub(crate) fn put(&mut self, row: Row) {
        self.unsaved = true;
        match self.places.entry((row.data.clone(), row.setting.clone(), row.seed)) {
            Entry::Occupied(place) => self.rows[*place.get()] = row,
            Entry::Vacant(place) => {
                place.insert(self.rows.len());
                self.rows.push(row);
            }
        }
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use vsonar::evolve::{Collapse, Score};

    use super::super::row::{Part, PartScore};
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
            warning: None,
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
    fn results_are_written_at_times() {
        let dir = tempfile::tempdir().expect("a temporary folder");
        let mut results = Results::read(dir.path()).expect("none yet");
        let rank = |row: &Row| row.seed as usize;
        let saved = || Results::read(dir.path()).expect("sound").rows.len();
        results.put(row("a", 2, 80));
        results.write_at_times(rank).expect("writable");
        assert_eq!(saved(), 1, "the first is at once");
        for seed in 3..9 {
            results.put(row("a", seed, 80));
            results.saved = Some(Instant::now());
            results.write_at_times(rank).expect("writable");
        }
        assert_eq!(saved(), 1);
        results.saved = Instant::now().checked_sub(IDLE);
        results.write_at_times(rank).expect("writable");
        assert_eq!(saved(), 7, "a second later all are");
        results.put(row("a", 1, 80));
        results.write(rank).expect("writable");
        let rows = Results::read(dir.path()).expect("sound").rows;
        assert_eq!(rows.iter().map(|row| row.seed).collect::<Vec<_>>(), [1, 2, 3, 4, 5, 6, 7, 8]);
        fs::remove_file(dir.path().join(Results::NAME)).expect("there");
        results.write(rank).expect("nothing to do");
        assert!(!dir.path().join(Results::NAME).exists(), "nothing is new");
    }

    #[test]
    fn results_of_earlier_releases_are_read() {
        let collapsed = Row { warning: Some(Collapse::Converged), ..row("a", 2, 81) };
        let (dir, text) = written(&[row("a", 1, 80), collapsed.clone()]);
        assert_eq!(Results::read(dir.path()).expect("sound").rows, [row("a", 1, 80), collapsed]);
        let path = dir.path().join(Results::NAME);
        assert!(
            text.contains(",generation_of_best,warning,program,") && text.contains(",2,converged,("),
            "{text}"
        );
        let earlier =
            text.replacen(",warning,", ",", 1).replace(",2,,(", ",2,(").replace(",2,converged,(", ",2,(");
        for (end, rows) in
            [(earlier.len(), 2), (earlier.len() - 3, 1), (earlier.find("seconds").expect("there"), 0)]
        {
            fs::write(&path, &earlier[..end]).expect("writable");
            let read = Results::read(dir.path()).expect("of an earlier release");
            assert_eq!(read.rows, [row("a", 1, 80), row("a", 2, 81)][..rows], "{end}");
        }
    }

    #[test]
    fn results_that_a_spreadsheet_has_written_again_are_read() {
        let rows = [row("a", 1, 80), row("a, b", 2, 81)];
        let (dir, text) = written(&rows);
        let path = dir.path().join(Results::NAME);
        for again in [
            text.replace(",1,00", ",1.0,00").replace(",60,30,", ",60.0,30.0,"),
            text.replace("\"a, b\"", "a+ b").replace(',', ";").replace("a+ b", "a, b"),
            format!("\u{feff}{}", text.replace('\n', "\r\n").replace("corridor", "\"corridor\"")),
        ] {
            assert_ne!(again, text);
            fs::write(&path, &again).expect("writable");
            let read = Results::read(dir.path()).expect("the same table");
            assert_eq!((read.rows, read.torn), (rows.to_vec(), false), "{again}");
        }
        let (dir, text) = written(&[row("a", 1, 80), row("a", 2, 81)]);
        let open = text.replacen("corridor", "\"corridor", 1);
        assert!(refused(&dir, &open).contains("results.csv:2: this is no row of a sweep: a quote is opened"));
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
    }

    fn refused(dir: &tempfile::TempDir, text: &str) -> String {
        fs::write(dir.path().join(Results::NAME), text).expect("writable");
        match Results::read(dir.path()) {
            Err(CliError::Failed(text)) => text,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn a_run_counts_once() {
        let (dir, text) = written(&[row("a", 1, 80), row("a", 2, 81)]);
        let first = text.lines().nth(1).expect("a row");
        fs::write(dir.path().join(Results::NAME), format!("{text}{}\n", first.replace(",0.125", ",9.5")))
            .expect("writable");
        let read = Results::read(dir.path()).expect("the same run");
        assert_eq!(read.rows, [row("a", 1, 80), row("a", 2, 81)]);
        let other = refused(&dir, &format!("{text}{}\n", first.replace(",60,30,", ",61,30,")));
        for part in
            ["results.csv:4: there is a row of `corridor`, `a`, seed 1 already", "take one of them out"]
        {
            assert!(other.contains(part), "{part}: {other}");
        }
    }

    #[test]
    fn numbers_that_contradict_each_other_are_refused() {
        let (dir, text) = written(&[row("a", 1, 80), row("a", 2, 81)]);
        for (from, to, said) in [
            ("80,100,0.8,0.4", "80,100,0.9,0.4", "80 of 100"),
            ("80,100,0.8,0.4", "80,100,NaN,0.4", "80 of 100"),
            ("80,100,0.8,0.4", "80,100,inf,0.4", "80 of 100"),
            ("80,100,0.8,0.4", "0,0,NaN,0.4", "0 of 0"),
            ("80,100,0.8,0.4", "101,100,1.01,0.4", "101 of 100"),
            ("80,100,0.8,0.4", "80,100,0.8,NaN", "no share"),
            ("80,100,0.8,0.4,,", "80,100,0.8,0.4,9,", "validation part some columns are empty"),
        ] {
            assert!(text.contains(from), "{text}");
            let error = refused(&dir, &text.replacen(from, to, 1));
            assert!(error.contains("results.csv:2: ") && error.contains(said), "{said}: {error}");
            assert!(error.contains("take the line out"), "{error}");
        }
        let (dir, text) = written(&[row("a", 1, 80)]);
        assert!(refused(&dir, &text.replace(",0.125", ",inf")).contains("seconds"), "the last row too");
    }

    #[test]
    fn other_tables_are_no_results() {
        let dir = tempfile::tempdir().expect("a temporary folder");
        for text in [
            "image,x,y\na.png,1,2\n",
            "image,x,y\na.png,1,2",
            "image,x",
            "image,x,y\n",
            "data,setting,seed\n",
        ] {
            let error = refused(&dir, text);
            assert!(error.contains("results.csv:1: ") && error.contains("--out"), "{text}: {error}");
            assert_eq!(fs::read_to_string(dir.path().join(Results::NAME)).expect("there"), text);
        }
    }
}
