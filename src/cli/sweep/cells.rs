//! The grid of a sweep: which runs there are, which of them are there already, and which are left.

use std::collections::{BTreeSet, HashSet};
use std::path::Path;

use vsonar::dataset::Variation;
use vsonar::evolve::Settings;
use vsonar::support::printable::ShownPath as _;

use super::super::CliError;
use super::super::cases::Cases;
use super::super::jobs::Cores;
use super::super::memory::Need;
use super::super::output::{self, count};
use super::super::table::Table;
use super::recorded;
use super::results::Results;
use super::row::{Row, settings_fingerprint};
use super::settings::Setting;
use super::spec::Spec;

/// A run: numbers of data set and setting, and the seed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) struct Cell {
    pub(crate) data: usize,
    pub(crate) setting: usize,
    pub(crate) seed: u64,
}

/// What is left to do.
#[derive(Debug, Clone)]
pub(crate) enum Work {
    /// A run.
    Run(Cell),
    /// The winner of a run, on the held-out cases.
    Test(Cell, Box<Row>),
}

impl Work {
    /// The run.
    pub(crate) fn cell(&self) -> &Cell {
        match self {
            Work::Run(cell) | Work::Test(cell, _) => cell,
        }
    }
}

/// All runs of a sweep.
#[derive(Debug)]
pub(crate) struct Grid<'a> {
    pub(crate) spec: &'a Spec,
    /// Those that are asked for: one data set after the other, and of each all settings with the first seed, then with
    /// the next, so that early results cover all settings.
    pub(crate) cells: Vec<Cell>,
}

impl<'a> Grid<'a> {
    /// The runs of a sweep with settings of these names only, if any are given.
    pub(crate) fn new(spec: &'a Spec, only: &[String]) -> Result<Grid<'a>, CliError> {
        let is = |number: usize, name: &str| {
            spec.settings[number].name == name || spec.settings[number].base == name
        };
        let all = 0..spec.settings.len();
        let mut chosen = vec![only.is_empty(); spec.settings.len()];
        for given in only {
            // The name of a point of the grid has commas in it.
            let whole = all.clone().any(|i| is(i, given));
            let names = if whole { vec![given.as_str()] } else { given.split(',').map(str::trim).collect() };
            for name in names {
                let found: Vec<usize> = all.clone().filter(|&i| is(i, name)).collect();
                if found.is_empty() {
                    let names: Vec<&str> = spec.settings.iter().map(|s| s.base.as_str()).collect();
                    let mut names: Vec<String> = names.iter().map(|name| format!("`{name}`")).collect();
                    names.dedup();
                    let text = format!(
                        "--only: {} has no setting `{name}`, but {}",
                        spec.path.shown(),
                        names.join(", ")
                    );
                    return Err(CliError::Usage(text));
                }
                found.into_iter().for_each(|i| chosen[i] = true);
            }
        }
        let mut cells = Vec::new();
        for data in 0..spec.data.len() {
            for &seed in &spec.seeds {
                let chosen = all.clone().filter(|&setting| chosen[setting]);
                cells.extend(chosen.map(|setting| Cell { data, setting, seed }));
            }
        }
        Ok(Grid { spec, cells })
    }

    /// The settings that are asked for.
    pub(crate) fn asked(&self) -> impl Iterator<Item = &Setting> {
        let asked: BTreeSet<usize> = self.cells.iter().map(|cell| cell.setting).collect();
        asked.into_iter().map(|number| &self.spec.settings[number])
    }

    /// The settings of a run.
    pub(crate) fn settings(&self, cell: &Cell) -> Settings {
        Settings { seed: cell.seed, ..self.spec.settings[cell.setting].settings.clone() }
    }

    /// The names of data set and setting of a run.
    pub(crate) fn names(&self, cell: &Cell) -> (&str, &str) {
        (&self.spec.data[cell.data].name, &self.spec.settings[cell.setting].name)
    }

    fn row<'r>(&self, cell: &Cell, results: &'r Results) -> Option<&'r Row> {
        let (data, setting) = self.names(cell);
        results.of(data, setting, cell.seed)
    }

    /// The run of a row, if the sweep has it, asked for or not.
    fn cell(&self, row: &Row) -> Option<Cell> {
        let data = self.spec.data.iter().position(|data| data.name == row.data)?;
        let setting = self.spec.settings.iter().position(|setting| setting.name == row.setting)?;
        Some(Cell { data, setting, seed: row.seed })
    }

    /// Whether a row is part of the tables: settings that are not asked for now may have been run before.
    pub(crate) fn is_shown(&self, row: &Row) -> bool {
        self.cell(row).is_some_and(|cell| self.spec.seeds.contains(&cell.seed))
    }

    /// The place of a row in the file: that of its run, all others at the end.
    pub(crate) fn rank(&self, row: &Row) -> usize {
        let place = |cell: Cell| {
            let seed = self.spec.seeds.binary_search(&cell.seed).ok()?;
            Some((cell.data * self.spec.seeds.len() + seed) * self.spec.settings.len() + cell.setting)
        };
        self.cell(row).and_then(place).unwrap_or(usize::MAX)
    }

    /// Refuses rows that were made with other settings of the same name.
    pub(crate) fn check_settings(&self, results: &Results) -> Result<(), CliError> {
        for row in &results.rows {
            let Some(cell) = self.cell(row) else { continue };
            if row.settings_fingerprint != settings_fingerprint(&self.settings(&cell)) {
                let folder = results.path().parent().unwrap_or(Path::new(""));
                let differences = recorded::differences(folder, &self.spec.settings[cell.setting]);
                let differences = match &differences[..] {
                    [] => String::new(),
                    some => format!(" ({})", some.join(", ")),
                };
                let text = format!("the setting `{}` was another one then{differences}", row.setting);
                return Err(self.stale(results, row, &text));
            }
        }
        Ok(())
    }

    /// Refuses rows that were made with other data of the same name.
    pub(crate) fn check_data(&self, results: &Results, sets: &[Cases]) -> Result<(), CliError> {
        for (number, (data, cases)) in self.spec.data.iter().zip(sets).enumerate() {
            let mut rows =
                results.rows.iter().filter(|row| self.cell(row).is_some_and(|c| c.data == number)).peekable();
            if rows.peek().is_none() {
                continue;
            }
            let hex = |set: &vsonar::dataset::Dataset| format!("{:016x}", set.fingerprint());
            let (train, validation) = (hex(&cases.train), cases.validation.as_ref().map(hex));
            let holdout = cases.holdout.as_ref().map(hex);
            for row in rows {
                let other_holdout = row.holdout_fingerprint.is_some() && row.holdout_fingerprint != holdout;
                let other_validation = row.validation_fingerprint != validation;
                if row.train_fingerprint != train || other_validation || other_holdout {
                    let coloured = cases.train.has_colour();
                    let gray =
                        if coloured { " (colour became gray by other weights before BT.601)" } else { "" };
                    let text = format!(
                        "the images or labels of the data set `{}` were others then{gray}",
                        data.name
                    );
                    return Err(self.stale(results, row, &text));
                }
            }
        }
        Ok(())
    }

    fn stale(&self, results: &Results, row: &Row, text: &str) -> CliError {
        CliError::Failed(format!(
            "{}: there is a row of `{}`, `{}`, seed {}, but {text}, and results are never mixed; choose another `--out`, or \
             take the rows of it out of the file",
            results.path().shown(),
            row.data,
            row.setting,
            row.seed
        ))
    }

    /// What is left to do, in order.
    pub(crate) fn work(&self, results: &Results) -> Vec<Work> {
        let mut work = Vec::new();
        for &cell in &self.cells {
            match self.row(&cell, results) {
                None => work.push(Work::Run(cell)),
                Some(row) => {
                    let has_holdout = self.spec.data[cell.data].source.has_holdout();
                    if self.spec.test && has_holdout && row.holdout_fingerprint.is_none() {
                        work.push(Work::Test(cell, Box::new(row.clone())));
                    }
                }
            }
        }
        work
    }

    /// What the runs on a data set need in memory, as many at a time as there are jobs.
    pub(crate) fn needs(&self, cases: &Cases, cores: Cores) -> Vec<Need> {
        let settings = self.cells.iter().map(|cell| &self.spec.settings[cell.setting].settings);
        let greatest = settings.map(Settings::variation).max_by_key(Variation::copies);
        let variation = greatest.unwrap_or(Variation::NONE);
        // Every data set has as many runs as another.
        let runs = self.cells.len() / self.spec.data.len();
        let mut needs: Vec<Need> = cases.needs(&variation, cores.for_runs(runs).jobs).collect();
        if variation.copies() > 0 {
            // Other settings may share the images as they are.
            needs.push(Need::of(&cases.train));
        }
        needs
    }

    /// How many sets on which programs run may keep strips at a time: that which the runs share, and one for each job
    /// whose run alters copies.
    pub(crate) fn strip_caches(&self, cores: Cores) -> usize {
        let copies = |cell: &Cell| self.spec.settings[cell.setting].settings.variation().copies() > 0;
        let altered = self.cells.iter().filter(|cell| copies(cell)).count();
        let own = if altered > 0 { cores.jobs } else { 0 };
        own + usize::from(altered < self.cells.len())
    }

    /// Says what there is to run.
    pub(crate) fn list(&self, results: &Results, folder: &Path, json: bool) -> Result<(), CliError> {
        let (mut left, mut untested) = (HashSet::new(), HashSet::new());
        for work in self.work(results) {
            match work {
                Work::Run(cell) => left.insert(cell),
                Work::Test(cell, _) => untested.insert(cell),
            };
        }
        if json {
            let cells: Vec<serde_json::Value> = self
                .cells
                .iter()
                .map(|cell| {
                    let (data, setting) = self.names(cell);
                    let (done, tests) = (!left.contains(cell), untested.contains(cell));
                    serde_json::json!({
                        "data": data, "setting": setting, "seed": cell.seed, "done": done, "to_test": tests,
                    })
                })
                .collect();
            return output::print_json(&cells);
        }
        let mut table = Table::new(2, &["data", "setting", "seeds", "left", "population", "generations"]);
        let (mut runs, mut evaluations) = (0u64, 0u64);
        for (data, set) in self.spec.data.iter().enumerate() {
            for (setting, of) in self.spec.settings.iter().enumerate() {
                let cells: Vec<&Cell> =
                    self.cells.iter().filter(|c| c.data == data && c.setting == setting).collect();
                if cells.is_empty() {
                    continue;
                }
                let left = cells.iter().filter(|cell| left.contains(**cell)).count() as u64;
                let s = &of.settings;
                runs += left;
                evaluations += left * u64::from(s.population) * u64::from(s.generations);
                let (seeds, left) = (cells.len().to_string(), left.to_string());
                let sizes = [output::grouped(s.population.into()), s.generations.to_string()];
                table.row([set.name.clone(), of.name.clone(), seeds, left].into_iter().chain(sizes));
            }
        }
        let tests = match untested.len() as u64 {
            0 => String::new(),
            tests => format!("{} to test on the held-out cases, ", count(tests, "winner")),
        };
        output::print(&format!(
            "{table}\n{tests}{} to make, at most {} and the draws of the initial filters; results in {}\n",
            count(runs, "run"),
            count(evaluations, "individual"),
            folder.shown()
        ))
    }
}
