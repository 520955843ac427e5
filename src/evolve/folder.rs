//! The run folder: everything that is recorded of a run.
//!
//! | file | content |
//! |---|---|
//! | `settings.toml` | every setting in full, and the table `[data]`: where the fitness cases come from |
//! | `log.jsonl` | a line a generation, see [`Record`](super::Record) |
//! | `best.gp` | the best individual so far, as program text |
//! | `hall_of_fame.jsonl` | the best individual of each size, see [`EntryLine`](super::EntryLine) |
//! | `checkpoint` | the whole state after the last complete generation |
//! | `lock` | empty; locked by the process that writes the folder |
//!
//! The checkpoint is the truth: the other files can be made from it (and its settings), and are when a run is
//! resumed. So however a run ended, the resumed run's files are those of a run that was never interrupted.

use std::fmt::Write as _;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use serde::Deserialize;

use super::checkpoint::{self, CheckpointError, Origin, State};
use super::consistency;
use super::settings::{Settings, SettingsError};
use super::validation::Verdicts;
use crate::support::bounded::Bounded;
use crate::support::durable::{self, FileError, Naming, Sync, append_line, replace};
use crate::support::lock::Lock;
use crate::support::printable::ShownPath as _;
use crate::support::temporary::{self, TemporaryFolder};

/// The files that are replaced as a whole.
const REPLACED: [&str; 5] = ["settings.toml", "log.jsonl", "best.gp", "hall_of_fame.jsonl", "checkpoint"];

/// Why a run folder cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum FolderError {
    /// It could not be read or written.
    #[error("{}{}", .0, remedy(&.0.source))]
    File(#[from] FileError),
    /// There is something of that name already.
    #[error(
        "{}: the run folder exists already and is never overwritten; go on with that run (`--resume {}`), or choose another name (`--out`)", .0.shown(), .0.shown()
    )]
    Exists(PathBuf),
    /// It is not a run folder.
    #[error("{}: there is no settings.toml, so this is not a run folder; give a folder that `vsonar evolve` has made", .0.shown())]
    NotARun(PathBuf),
    /// Another process writes it.
    #[error("{}: another process is writing this run folder; wait until it has ended, or stop it", .0.shown())]
    Locked(PathBuf),
    /// The run was to go on with other settings than its folder's.
    #[error(
        "{}: a run goes on with the settings in its folder; only more generations can be asked for (for other settings, start a new run with `--settings`)", .0.shown()
    )]
    OtherSettings(PathBuf),
    /// Its settings cannot be read.
    #[error(transparent)]
    Settings(#[from] SettingsError),
    /// Its checkpoint cannot be used.
    #[error(transparent)]
    Checkpoint(#[from] CheckpointError),
}

fn remedy(error: &io::Error) -> &'static str {
    match error.kind() {
        io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded | io::ErrorKind::FileTooLarge => {
            "; the run is kept as of its last complete generation: make room on the disk, then go on with `--resume`"
        }
        io::ErrorKind::PermissionDenied | io::ErrorKind::ReadOnlyFilesystem => {
            "; choose a place that can be written: by `--out`, or, to go on with a run, by copying its folder there"
        }
        _ => "",
    }
}

/// A run folder, locked for as long as the value lives.
#[derive(Debug)]
pub struct RunFolder {
    path: PathBuf,
    data: toml::Table,
    /// Fingerprint of the settings in the folder.
    settings: u64,
    /// Where its programs come from, as a comment in their files.
    origin: String,
    /// How many of the training cases are no altered copies; 0 if that was not said.
    unaltered: usize,
    made: Made,
    _lock: Lock,
}

/// What was made to make a run folder, so that it can be taken back if the run cannot begin.
#[derive(Debug, Clone, Default)]
#[must_use = "it does nothing unless it is taken back"]
pub struct Made {
    run: Option<PathBuf>,
    /// Folders above it that were not there before, the outermost first.
    parents: Vec<PathBuf>,
}

impl Made {
    /// Makes the folders above `path` that are not there.
    fn parents_of(path: &Path) -> Result<Made, FolderError> {
        let mut made = Made::default();
        let above = path.ancestors().skip(1);
        let missing: Vec<&Path> =
            above.take_while(|folder| !folder.as_os_str().is_empty() && !folder.exists()).collect();
        for folder in missing.into_iter().rev() {
            let done = match fs::create_dir(folder) {
                // Another process was faster, or the path goes up again, as in `new/..`.
                Err(_) if folder.is_dir() => continue,
                done => done.naming(folder, "make the folder"),
            };
            if let Err(error) = done {
                made.take_back();
                return Err(error.into());
            }
            made.parents.push(folder.to_path_buf());
        }
        Ok(made)
    }

    /// Removes the run folder, and the folders above it that were made for it and hold nothing else by now.
    pub fn take_back(self) {
        // Whatever cannot be removed stays: the error that brought us here is the one to report.
        if let Some(run) = self.run {
            let _ = fs::remove_dir_all(run);
        }
        for folder in self.parents.iter().rev() {
            let _ = fs::remove_dir(folder);
        }
    }
}

#[derive(Deserialize)]
struct DataTable {
    #[serde(default)]
    data: toml::Table,
}

impl RunFolder {
    /// Reads a file of settings.
    pub const SETTINGS: Bounded = Bounded::to(16 << 20);
    /// Reads what grows with a run: its checkpoint, log and hall of fame.
    pub const RECORDED: Bounded = Bounded::to(4 << 30);

    /// Makes a fresh run folder with its `settings.toml`. `data` says where the fitness cases come from, in
    /// the caller's terms; it is given back by [`RunFolder::open`].
    ///
    /// # Errors
    /// If there is anything of that name already, or the folder cannot be written; then nothing is left behind.
    pub fn create(path: &Path, settings: &Settings, data: &toml::Table) -> Result<RunFolder, FolderError> {
        must_be_free(path)?;
        let made = Made::parents_of(path)?;
        match RunFolder::create_below(path, settings, data) {
            Ok(folder) => {
                let made = Made { run: Some(path.to_path_buf()), ..made };
                Ok(RunFolder { made, ..folder })
            }
            Err(error) => {
                made.take_back();
                Err(error)
            }
        }
    }

    /// Makes a fresh run folder in a folder that is there.
    fn create_below(path: &Path, settings: &Settings, data: &toml::Table) -> Result<RunFolder, FolderError> {
        // Again, for a path like `new/../run` leads nowhere before `new` is there.
        must_be_free(path)?;
        // Filled under another name first, so that a run folder has its settings from its first moment on.
        temporary::clear(path);
        let hidden = TemporaryFolder::beside(path).naming(path, "make the run folder")?;
        let there = hidden.path().to_path_buf();
        let in_place = |error| match error {
            FolderError::File(error) => {
                let path = error.path.strip_prefix(&there).map_or(error.path.clone(), |name| path.join(name));
                FolderError::File(FileError { path, ..error })
            }
            other => other,
        };
        let mut folder = RunFolder::lock(hidden.path(), data.clone(), settings).map_err(in_place)?;
        folder.write_settings(settings).map_err(in_place)?;
        put_in_place(hidden, path)?;
        folder.path = path.to_path_buf();
        durable::sync_folder_of(path)?;
        Ok(folder)
    }

    /// Makes a fresh run folder `NAME-seed-S` below `parent`, or the first of `NAME-seed-S-2`, `NAME-seed-S-3`
    /// and so on that is free.
    ///
    /// # Errors
    /// As [`RunFolder::create`].
    pub fn create_numbered(
        parent: &Path,
        name: &str,
        settings: &Settings,
        data: &toml::Table,
    ) -> Result<RunFolder, FolderError> {
        let base = format!("{name}-seed-{}", settings.seed);
        let mut number = 1u32;
        loop {
            let leaf = if number == 1 { base.clone() } else { format!("{base}-{number}") };
            match RunFolder::create(&parent.join(leaf), settings, data) {
                Err(FolderError::Exists(_)) if number < u32::MAX => number += 1,
                made => return made,
            }
        }
    }

    /// Opens a run folder to go on with its run, and gives its settings.
    ///
    /// # Errors
    /// If it is no run folder, another process writes it, or its settings cannot be read.
    pub fn open(path: &Path) -> Result<(RunFolder, Settings), FolderError> {
        let file = path.join("settings.toml");
        let text = match RunFolder::SETTINGS.text(&file) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => {
                return Err(FolderError::NotARun(path.to_path_buf()));
            }
            text => text.naming(&file, "read the file")?,
        };
        let settings = Settings::from_record(&text, &file.shown())?;
        // The text was just read as settings, so it is TOML.
        let data = toml::from_str::<DataTable>(&text).map(|t| t.data).unwrap_or_default();
        let folder = RunFolder::lock(path, data, &settings)?;
        temporary::clear_in(path, |name| REPLACED.contains(&name));
        Ok((folder, settings))
    }

    fn lock(path: &Path, data: toml::Table, settings: &Settings) -> Result<RunFolder, FolderError> {
        let lock = Lock::take(path).naming(path, "lock the run folder")?;
        let lock = lock.ok_or_else(|| FolderError::Locked(path.to_path_buf()))?;
        let (path, settings) = (path.to_path_buf(), settings.fingerprint());
        Ok(RunFolder {
            path,
            data,
            settings,
            origin: String::new(),
            unaltered: 0,
            made: Made::default(),
            _lock: lock,
        })
    }

    /// Says where its programs come from, for the files that hold them.
    pub(super) fn set_origin(&mut self, comment: String) {
        self.origin = comment;
    }

    /// Says how many of the training cases, which come first, are no altered copies.
    pub(super) fn set_unaltered(&mut self, unaltered: usize) {
        self.unaltered = unaltered;
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Where the fitness cases come from, as the maker of the folder described it.
    pub fn data(&self) -> &toml::Table {
        &self.data
    }

    /// What was made to make it; nothing if it was opened.
    pub fn made(&self) -> Made {
        self.made.clone()
    }

    fn file(&self, name: &str) -> PathBuf {
        self.path.join(name)
    }

    /// Writes the settings in full; they may differ from those there in the number of generations alone.
    pub(super) fn write_settings(&self, settings: &Settings) -> Result<(), FolderError> {
        if settings.fingerprint() != self.settings {
            return Err(FolderError::OtherSettings(self.path.clone()));
        }
        let mut text = String::from(
            "# The settings of this run, in full, and its data; it can be repeated with `--settings`.\n\n",
        );
        text.push_str(&settings.to_toml());
        let mut data = toml::Table::new();
        data.insert("data".to_string(), toml::Value::Table(self.data.clone()));
        let _ = write!(text, "\n# Where the fitness cases come from.\n{data}");
        Ok(replace(&self.file("settings.toml"), text.as_bytes(), Sync::Now)?)
    }

    /// Records a state whose last generation is not recorded yet. The checkpoint comes last: until it is in
    /// place, the run stands where it stood before.
    pub(super) fn save(
        &self,
        state: &State,
        origin: Origin,
        verdicts: Verdicts<'_>,
    ) -> Result<(), FolderError> {
        if let Some(record) = state.records.last() {
            append_line(&self.file("log.jsonl"), &line(record))?;
        }
        self.write_best(state, verdicts)?;
        Ok(replace(&self.file("checkpoint"), &checkpoint::encode(state, origin), Sync::Now)?)
    }

    /// The state of the last complete generation, if there is one, of a run with so many training cases.
    pub(super) fn load(
        &self,
        origin: Origin,
        settings: &Settings,
        cases: usize,
    ) -> Result<Option<State>, FolderError> {
        let path = self.file("checkpoint");
        let bytes = match RunFolder::RECORDED.bytes(&path) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
            bytes => bytes.naming(&path, "read the checkpoint")?,
        };
        let state = checkpoint::decode(&bytes, origin, &path)?;
        consistency::check_against(&state, settings, cases)
            .map_err(|fault| CheckpointError::Contradiction { path, fault })?;
        Ok(Some(state))
    }

    /// Makes log, best individual and hall of fame what they were when the state was recorded (`None`: before
    /// the first generation).
    pub(super) fn repair(&self, state: Option<&State>, verdicts: Verdicts<'_>) -> Result<(), FolderError> {
        let records = state.map_or(&[][..], |s| &s.records);
        let log: String = records.iter().map(|record| line(record) + "\n").collect();
        replace(&self.file("log.jsonl"), log.as_bytes(), Sync::Now)?;
        if let Some(state) = state {
            return self.write_best(state, verdicts);
        }
        for name in ["best.gp", "hall_of_fame.jsonl"] {
            match fs::remove_file(self.file(name)) {
                Err(error) if error.kind() == io::ErrorKind::NotFound => {}
                removed => removed.naming(&self.file(name), "remove the file")?,
            }
        }
        Ok(())
    }

    /// Brings everything to the disk at the end of a run.
    pub(super) fn sync(&self) -> Result<(), FolderError> {
        for name in ["log.jsonl", "best.gp", "hall_of_fame.jsonl"] {
            let path = self.file(name);
            if path.exists() {
                durable::sync_path(&path)?;
            }
        }
        Ok(durable::sync_path(&self.path)?)
    }

    fn write_best(&self, state: &State, verdicts: Verdicts<'_>) -> Result<(), FolderError> {
        let (Some((best, validated)), Some(member)) =
            (verdicts.winner(&state.hall_of_fame), state.population.first())
        else {
            return Ok(());
        };
        let validated = validated.map_or(String::new(), |solved| {
            format!("; {} of {} validation cases", solved.count(), solved.len())
        });
        let cases = member.outcome.solved.len();
        let nodes = best.individual.len();
        let copies = match cases.saturating_sub(self.unaltered) {
            0 => String::new(),
            _ if self.unaltered == 0 => String::new(),
            altered => format!(" ({altered} of them of altered copies)"),
        };
        let text = format!(
            "; solves {} of {cases} training cases{copies}{validated}; {nodes} nodes; from generation {}\n{}\n{}\n",
            best.correct, best.generation, self.origin, best.individual
        );
        replace_if_new(&self.file("best.gp"), &text)?;
        let lines = state.hall_of_fame.lines(cases as u32, verdicts);
        let hall: String = lines.iter().map(|entry| line(entry) + "\n").collect();
        replace_if_new(&self.file("hall_of_fame.jsonl"), &hall)
    }
}

fn must_be_free(path: &Path) -> Result<(), FolderError> {
    match path.symlink_metadata() {
        Ok(_) => Err(FolderError::Exists(path.to_path_buf())),
        Err(_) => Ok(()),
    }
}

/// Gives a filled folder its name, unless another process was faster.
fn put_in_place(hidden: TemporaryFolder, path: &Path) -> Result<(), FolderError> {
    match hidden.place(path) {
        Err(error)
            if matches!(error.kind(), io::ErrorKind::AlreadyExists | io::ErrorKind::DirectoryNotEmpty) =>
        {
            Err(FolderError::Exists(path.to_path_buf()))
        }
        renamed => Ok(renamed.naming(path, "make the run folder")?),
    }
}

fn line(value: &impl serde::Serialize) -> String {
    // Structs of numbers and strings always have a JSON form.
    serde_json::to_string(value).unwrap_or_default()
}

fn replace_if_new(path: &Path, text: &str) -> Result<(), FolderError> {
    if RunFolder::RECORDED.bytes(path).is_ok_and(|old| old == text.as_bytes()) {
        return Ok(());
    }
    Ok(replace(path, text.as_bytes(), Sync::Later)?)
}
