//! What the files of a run folder tell by themselves, without the data.

use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};

use serde::de::DeserializeOwned;

use super::model::{Compiled, Difference, Member, Program, Run};
use crate::evolve::{EntryLine, FolderError, Preset, Record, RunFolder, Settings, SettingsError, Warning};
use crate::exec::Candidate;
use crate::ir::text;
use crate::support::printable::ShownPath as _;
use crate::tree::{Individual, Node, ProgramFileError};

/// A run folder that cannot be reported on.
#[derive(Debug, thiserror::Error)]
pub enum ReadError {
    /// It is no run folder.
    #[error(transparent)]
    Folder(#[from] FolderError),
    /// A file cannot be read.
    #[error("{}: cannot read the file: {error}", .path.shown())]
    File {
        /// The file.
        path: PathBuf,
        /// Why.
        error: io::Error,
    },
    /// Its settings cannot be read.
    #[error(transparent)]
    Settings(#[from] SettingsError),
    /// Its program cannot be read.
    #[error(transparent)]
    Program(#[from] ProgramFileError),
    /// A line of a file is damaged.
    #[error(
        "{}:{line}: this is no {what}: {fault}; the file is damaged (`vsonar evolve --resume {}` makes it again from the checkpoint)", .path.shown(), .path.parent().unwrap_or(.path).shown()
    )]
    Line {
        /// The file.
        path: PathBuf,
        /// The line, from 1.
        line: usize,
        /// What it should be.
        what: &'static str,
        /// What is wrong.
        fault: String,
    },
    /// The generations in the log do not follow one another.
    #[error(
        "{}:{line}: generation {found} where {line_before} should stand; the file is damaged (`vsonar evolve --resume {}` makes it again from the checkpoint)", .path.shown(), .path.parent().unwrap_or(.path).shown(), line_before = .line - 1
    )]
    Order {
        /// The file.
        path: PathBuf,
        /// The line, from 1.
        line: usize,
        /// The generation that stands there.
        found: u32,
    },
}

impl Run {
    /// What a run folder tells by itself: settings, generations, hall of fame, winner. The rest is what the data have to
    /// be evaluated for. `data` are the data in words.
    ///
    /// It only reads, and a folder that is being written is as good as another.
    ///
    /// # Errors
    /// If it is no run folder, or a file of it is damaged; the error names the line.
    pub fn read(folder: &Path, data: String) -> Result<Run, ReadError> {
        let path = folder.join("settings.toml");
        let text = match RunFolder::SETTINGS.text(&path) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => {
                return Err(FolderError::NotARun(folder.to_path_buf()).into());
            }
            text => text.map_err(|error| ReadError::File { path: path.clone(), error })?,
        };
        let settings = Settings::from_record(&text, &path.shown())?;
        let log = folder.join("log.jsonl");
        let records: Vec<Record> = lines(&log, "generation of a run")?;
        if let Some(wrong) = (0..records.len()).find(|&i| records[i].generation as usize != i) {
            let found = records[wrong].generation;
            return Err(ReadError::Order { path: log, line: wrong + 1, found });
        }
        let hall: Vec<EntryLine> = lines(&folder.join("hall_of_fame.jsonl"), "entry of a hall of fame")?;
        let best = folder.join("best.gp");
        let winner = if best.exists() { Some(Individual::load(&best)?) } else { None };
        let mut run = Run::progress(folder, data, &settings, text, records);
        for name in ["log.jsonl", "hall_of_fame.jsonl"] {
            if is_cut_off(&folder.join(name)) {
                run.missing.push(format!(
                    "The last line of {name} is cut off: the run is being recorded right now, or the file is damaged (`vsonar \
                     evolve --resume` makes it again from the checkpoint)."
                ));
            }
        }
        if winner.is_none() {
            run.missing.push("There is no best program yet (best.gp).".to_string());
        }
        if hall.is_empty() {
            run.missing.push("The hall of fame (hall_of_fame.jsonl) is not there or empty.".to_string());
        }
        run.hall_of_fame = hall.into_iter().map(|entry| Member::of(entry, winner.as_ref())).collect();
        run.program = winner.as_ref().map(Program::of);
        Ok(run)
    }

    /// A run as far as its log goes: settings and curves alone. `text` is all of the settings as TOML.
    pub fn progress(
        folder: &Path,
        data: String,
        settings: &Settings,
        text: String,
        records: Vec<Record>,
    ) -> Run {
        let (preset, differing) = differing(settings);
        Run {
            name: name(folder),
            folder: folder.display().to_string(),
            data,
            data_table: BTreeMap::new(),
            tested_on: None,
            preset,
            seed: settings.seed,
            population: settings.population,
            generations: settings.generations,
            tolerance: settings.tolerance,
            differing,
            settings: text,
            warning: Warning::of(&records, settings).map(|warning| warning.to_string()),
            records,
            hall_of_fame: Vec::new(),
            program: None,
            scores: Vec::new(),
            answers: None,
            rivals: None,
            missing: Vec::new(),
            commands: Vec::new(),
        }
    }
}

/// The name of a folder, of one without a name in its path (as `.`) the name that it has.
pub(crate) fn name(folder: &Path) -> String {
    let leaf = |path: &Path| path.file_name().map(|leaf| leaf.to_string_lossy().into_owned());
    let real = || std::fs::canonicalize(folder).ok().as_deref().and_then(leaf);
    leaf(folder).or_else(real).unwrap_or_else(|| folder.display().to_string())
}

impl Member {
    fn of(entry: EntryLine, winner: Option<&Individual>) -> Member {
        let is_winner = || winner.is_some_and(|winner| entry.program.parse().ok().as_ref() == Some(winner));
        Member {
            winner: is_winner(),
            nodes: entry.nodes,
            generation: entry.generation,
            fitness: entry.fitness,
            train: None,
            validation: entry.validation_fitness,
            holdout: None,
            program: entry.program,
        }
    }
}

impl Program {
    /// A program as it is written.
    pub fn of(individual: &Individual) -> Program {
        let mut operators: Vec<String> = Vec::new();
        for node in individual.trees().flat_map(|tree| tree.nodes()) {
            let name = node.name();
            if matches!(node, Node::Image(_)) && !operators.iter().any(|there| there == name) {
                operators.push(name.to_string());
            }
        }
        Program {
            text: individual.to_string(),
            nodes: individual.len(),
            depth: individual.depth(),
            operators,
            compiled: None,
            explanation: None,
        }
    }
}

impl Compiled {
    /// What the compiler makes of a program for images of this size. It recurses as deep as the program is nested.
    pub fn of(individual: &Individual, (width, height): (u32, u32)) -> Compiled {
        let candidate = Candidate::new(individual, width, height);
        let program = candidate.program();
        Compiled {
            operations: program.operations(),
            text: text::print(program),
            operations_before: candidate.operations_before(),
        }
    }
}

/// Whether there is something after the last whole line of a file.
fn is_cut_off(path: &Path) -> bool {
    RunFolder::RECORDED.bytes(path).is_ok_and(|bytes| bytes.last().is_some_and(|last| *last != b'\n'))
}

/// The lines of a file; none if there is no such file. A last line that is cut off before its end is not there yet.
fn lines<T: DeserializeOwned>(path: &Path, what: &'static str) -> Result<Vec<T>, ReadError> {
    let bytes = match RunFolder::RECORDED.bytes(path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Vec::new()),
        bytes => bytes.map_err(|error| ReadError::File { path: path.to_path_buf(), error })?,
    };
    let text = String::from_utf8(bytes).map_err(|error| {
        let before = &error.as_bytes()[..error.utf8_error().valid_up_to()];
        let line = 1 + before.iter().filter(|byte| **byte == b'\n').count();
        ReadError::Line { path: path.to_path_buf(), line, what, fault: "it is not text (UTF-8)".to_string() }
    })?;
    let whole = text.rfind('\n').map_or(0, |end| end + 1);
    let line = |(i, line): (usize, &str)| {
        serde_json::from_str(line).map_err(|fault| ReadError::Line {
            path: path.to_path_buf(),
            line: i + 1,
            what,
            fault: fault.to_string(),
        })
    };
    text[..whole].lines().enumerate().map(line).collect()
}

/// The preset that needs the fewest changes, and these.
fn differing(settings: &Settings) -> (&'static str, Vec<Difference>) {
    let here = flat(settings);
    let against = |name, preset: &Settings| {
        let there = flat(preset);
        let keys: std::collections::BTreeSet<&String> = here.keys().chain(there.keys()).collect();
        let value = |of: &BTreeMap<String, String>, key: &str| {
            of.get(key).cloned().unwrap_or_else(|| "-".to_string())
        };
        let changed = keys.into_iter().filter(|key| *key != "seed" && here.get(*key) != there.get(*key));
        let difference = |key: &String| Difference {
            name: key.clone(),
            value: value(&here, key),
            preset: value(&there, key),
        };
        (name, changed.map(difference).collect::<Vec<_>>())
    };
    let default = against("default", &Settings::preset(Preset::Default));
    let paper = against("paper", &Settings::preset(Preset::Paper));
    if paper.1.len() < default.1.len() { paper } else { default }
}

/// Every setting by its dotted name.
pub(super) fn flat(settings: &Settings) -> BTreeMap<String, String> {
    // The text is the library's own.
    let table: toml::Table = toml::from_str(&settings.to_toml()).unwrap_or_default();
    let mut out = BTreeMap::new();
    for (key, value) in table {
        match value {
            toml::Value::Table(inner) => {
                out.extend(
                    inner.into_iter().map(|(leaf, value)| (format!("{key}.{leaf}"), value.to_string())),
                );
            }
            value => drop(out.insert(key, value.to_string())),
        }
    }
    out
}
