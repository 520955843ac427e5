//! Where the fitness cases of a run come from, as flags and as the table `[data]` of its settings.toml.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use vsonar::dataset::{Dataset, Variation};
use vsonar::world::{Corridor, FRAMES};

use super::CliError;
use super::memory::Need;
use super::output::from_here;

/// The building of the built-in corridor that is trained on.
pub(crate) const BUILDING: u64 = 1;
/// The building that is held out.
pub(crate) const OTHER_BUILDING: u64 = 2;

/// The flags that say where the cases come from.
#[derive(clap::Args, Clone)]
#[command(next_help_heading = "Data")]
pub(crate) struct DataArgs {
    /// Folder with `labels.csv` and the images it names [default: the data of the `--settings` file, if it
    /// names any, else a built-in synthetic corridor]
    #[arg(long, value_name = "DIR")]
    pub(crate) data: Option<PathBuf>,
    /// A second such folder, on which the result is tested and nothing is trained
    #[arg(long, value_name = "DIR", requires = "data", conflicts_with = "holdout_match")]
    pub(crate) holdout: Option<PathBuf>,
    /// Train on the images whose names match this pattern only, e.g. 'run_[AB]*'
    #[arg(long, value_name = "GLOB", requires = "data")]
    pub(crate) train_match: Option<String>,
    /// Test on the images of the same folder whose names match this pattern, e.g. 'run_C*'
    ///
    /// Neighbouring frames are almost the same picture, so whole drives should go to one side or the other.
    #[arg(long, value_name = "GLOB", requires = "train_match")]
    pub(crate) holdout_match: Option<String>,
}

/// The field of the table `[data]` with the fingerprint of the held-out cases.
const FINGERPRINT: &str = "holdout_fingerprint";

/// Where the cases come from. Recorded in the run folder, so that a resume finds them.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Source {
    /// Folders of images.
    Folder(Folder),
    /// The built-in corridor.
    Synthetic(Synthetic),
}

/// Folders of images; the paths are absolute.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Folder {
    train: PathBuf,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    holdout: Option<PathBuf>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    train_match: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    holdout_match: Option<String>,
}

/// The built-in corridor: two of its buildings.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Synthetic {
    #[serde(default = "building")]
    building: u64,
    #[serde(default = "other_building")]
    holdout_building: u64,
    #[serde(default = "frames")]
    frames: usize,
}

fn building() -> u64 {
    BUILDING
}

fn other_building() -> u64 {
    OTHER_BUILDING
}

fn frames() -> usize {
    FRAMES
}

/// A part of the data, as the flags of other commands have it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Part {
    pub(crate) folder: PathBuf,
    /// The images that count, if not all do.
    pub(crate) pattern: Option<String>,
    /// For a folder that is yet to be made: building and frames.
    pub(crate) synth: Option<(u64, usize)>,
}

/// The cases themselves.
pub(crate) struct Cases {
    pub(crate) train: Dataset,
    pub(crate) holdout: Option<Dataset>,
}

impl Cases {
    /// The fingerprint of the held-out cases, as it is recorded.
    fn holdout_fingerprint(&self) -> Option<String> {
        self.holdout.as_ref().map(|set| format!("{:016x}", set.fingerprint()))
    }

    /// Whether the held-out cases are those that the table `[data]` of a run folder was made with; the training
    /// cases are guarded by the checkpoint.
    pub(crate) fn check_holdout(&self, table: &toml::Table, run: &Path) -> Result<(), CliError> {
        let now = self.holdout_fingerprint();
        match table.get(FINGERPRINT) {
            Some(then) if then.as_str() != now.as_deref() => Err(CliError::Failed(format!(
                "{}: the run was made with other held-out data; resume with the data named there, unchanged, or \
                 start a new run",
                run.join("settings.toml").display()
            ))),
            _ => Ok(()),
        }
    }

    /// What both sets, or the one there is, need in a run that alters copies of the training images so. At the end
    /// of a run both are in memory.
    pub(crate) fn needs(&self, variation: &Variation) -> impl Iterator<Item = Need> {
        std::iter::once(Need::grown(&self.train, variation)).chain(self.holdout.iter().map(Need::of))
    }
}

impl DataArgs {
    /// Whether there are any.
    pub(crate) fn given(&self) -> bool {
        // The others need it.
        self.data.is_some()
    }

    /// What the flags say.
    pub(crate) fn source(&self) -> Result<Source, CliError> {
        let Some(data) = &self.data else {
            let (building, holdout_building) = (BUILDING, OTHER_BUILDING);
            return Ok(Source::Synthetic(Synthetic { building, holdout_building, frames: FRAMES }));
        };
        Ok(Source::Folder(Folder {
            train: absolute(data)?,
            holdout: self.holdout.as_deref().map(absolute).transpose()?,
            train_match: self.train_match.clone(),
            holdout_match: self.holdout_match.clone(),
        }))
    }
}

/// The path from the root; the folder itself is looked at when it is loaded.
fn absolute(path: &Path) -> Result<PathBuf, CliError> {
    let absolute = std::path::absolute(path).map_err(|e| CliError::file(path, "find the folder", &e))?;
    match absolute.to_str() {
        Some(_) => Ok(absolute),
        None => Err(CliError::Failed(format!(
            "{}: the path is not UTF-8, so it cannot be recorded in the run folder; rename the folder",
            path.display()
        ))),
    }
}

impl Source {
    /// As the table `[data]`, for a run with these cases.
    pub(crate) fn to_table(&self, cases: &Cases) -> Result<toml::Table, CliError> {
        let mut table = toml::Table::try_from(self)?;
        if let Some(fingerprint) = cases.holdout_fingerprint() {
            table.insert(FINGERPRINT.to_string(), fingerprint.into());
        }
        Ok(table)
    }

    /// From the table `[data]` of a settings file.
    pub(crate) fn from_table(table: &toml::Table, file: &Path) -> Result<Source, CliError> {
        let mut table = table.clone();
        table.remove(FINGERPRINT);
        table.try_into().map_err(|error| {
            CliError::Failed(format!(
                "{}: the table [data] does not say where the fitness cases come from: {}; it needs a table \
                 [data.folder] with the path `train`",
                file.display(),
                error.to_string().trim_end().replace('\n', " ")
            ))
        })
    }

    /// The same source for a run of its own: paths count from the folder of the file that names them.
    pub(crate) fn named_in(self, file: &Path) -> Result<Source, CliError> {
        let place = file.parent().unwrap_or(Path::new(""));
        match self {
            Source::Folder(f) => Ok(Source::Folder(Folder {
                train: absolute(&place.join(&f.train))?,
                holdout: f.holdout.map(|dir| absolute(&place.join(dir))).transpose()?,
                ..f
            })),
            synthetic => Ok(synthetic),
        }
    }

    /// The folder of the training images, if they are in one.
    pub(crate) fn folder(&self) -> Option<&Path> {
        match self {
            Source::Folder(folder) => Some(&folder.train),
            Source::Synthetic(_) => None,
        }
    }

    /// The same with the training images in another folder; `None` if they are in none.
    pub(crate) fn with_folder(self, train: &Path) -> Result<Option<Source>, CliError> {
        Ok(match self {
            Source::Folder(folder) => Some(Source::Folder(Folder { train: absolute(train)?, ..folder })),
            Source::Synthetic(_) => None,
        })
    }

    /// Whether it is the built-in corridor.
    pub(crate) fn is_synthetic(&self) -> bool {
        matches!(self, Source::Synthetic(_))
    }

    /// A short name, for the run folder.
    pub(crate) fn name(&self) -> String {
        let name = match self {
            Source::Folder(folder) => folder.train.file_name().map(|n| n.to_string_lossy().into_owned()),
            Source::Synthetic(_) => Some("synthetic".to_string()),
        };
        let plain = |c: char| if c.is_alphanumeric() || "._-".contains(c) { c } else { '_' };
        let name: String = name.unwrap_or_default().chars().map(plain).collect();
        if name.trim_matches('.').is_empty() { "run".to_string() } else { name }
    }

    /// What `vsonar eval` has to be told to look at the training cases, and at those held out.
    pub(crate) fn parts(&self) -> (Part, Option<Part>) {
        match self {
            Source::Folder(f) => {
                let part = |dir: &Path, pattern: &Option<String>| Part {
                    folder: from_here(dir),
                    pattern: pattern.clone(),
                    synth: None,
                };
                let holdout = match (&f.holdout, &f.holdout_match) {
                    (Some(dir), _) => Some(part(dir, &None)),
                    (None, Some(_)) => Some(part(&f.train, &f.holdout_match)),
                    (None, None) => None,
                };
                (part(&f.train, &f.train_match), holdout)
            }
            Source::Synthetic(s) => {
                let part = |name: &str, building| Part {
                    folder: name.into(),
                    pattern: None,
                    synth: Some((building, s.frames)),
                };
                (part("corridor", s.building), Some(part("elsewhere", s.holdout_building)))
            }
        }
    }

    /// In words, for people.
    pub(crate) fn describe(&self) -> String {
        match self {
            Source::Synthetic(_) => "the built-in corridor, another building held out".to_string(),
            Source::Folder(f) => {
                let mut text = from_here(&f.train).display().to_string();
                f.train_match.iter().for_each(|glob| text += &format!(", images {glob}"));
                f.holdout.iter().for_each(|dir| text += &format!("; held out {}", from_here(dir).display()));
                f.holdout_match.iter().for_each(|glob| text += &format!("; held out {glob}"));
                text
            }
        }
    }

    /// Reads or renders the cases.
    pub(crate) fn load(&self) -> Result<Cases, CliError> {
        match self {
            Source::Synthetic(s) => {
                let corridor = Corridor::default();
                let train = corridor.render(s.building, s.frames)?;
                Ok(Cases { train, holdout: Some(corridor.render(s.holdout_building, s.frames)?) })
            }
            Source::Folder(f) => {
                let all = Dataset::load(&f.train)?;
                let (train, part) = match (&f.train_match, &f.holdout_match) {
                    (Some(train), Some(holdout)) => {
                        let (train, holdout) = all.split(train, holdout)?;
                        (train, Some(holdout))
                    }
                    (Some(train), None) => (all.select(train)?, None),
                    (None, _) => (all, None),
                };
                let holdout = match &f.holdout {
                    Some(dir) => Some(Dataset::load(dir)?),
                    None => part,
                };
                Ok(Cases { train, holdout })
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_source_is_found_again_in_its_table() {
        let args = DataArgs {
            data: Some("a/b c".into()),
            holdout: None,
            train_match: Some("x*".into()),
            holdout_match: Some("y*".into()),
        };
        let folder = args.source().expect("UTF-8");
        let synthetic = DataArgs { data: None, train_match: None, holdout_match: None, ..args };
        let small = Corridor { width: 16, height: 16, columns: 1, ..Corridor::default() };
        let set = |seed| small.render(seed, 1).expect("possible");
        let cases = |holdout| Cases { train: set(1), holdout };
        let file = Path::new("my.toml");
        for source in [folder, synthetic.source().expect("nothing to go wrong")] {
            for cases in [cases(Some(set(2))), cases(None)] {
                let table = source.to_table(&cases).expect("a table");
                assert_eq!(Source::from_table(&table, file).expect("the same"), source);
            }
        }
        let error = Source::from_table(&toml::Table::new(), file).expect_err("nothing in it");
        assert!(matches!(error, CliError::Failed(text) if text.contains("my.toml")));
    }

    #[test]
    fn held_out_cases_are_told_apart() {
        let small = Corridor { width: 16, height: 16, columns: 1, ..Corridor::default() };
        let cases = |holdout: Option<u64>| {
            let set = |seed| small.render(seed, 1).expect("possible");
            Cases { train: set(1), holdout: holdout.map(set) }
        };
        let source = Source::Synthetic(Synthetic { building: 1, holdout_building: 2, frames: 1 });
        let table = source.to_table(&cases(Some(2))).expect("a table");
        let check = |cases: Cases, table| cases.check_holdout(table, Path::new("run"));
        assert!(check(cases(Some(2)), &table).is_ok());
        for other in [Some(3), None] {
            let error = check(cases(other), &table).expect_err("another");
            assert!(matches!(error, CliError::Failed(text) if text.contains("run/settings.toml")));
        }
        let table = source.to_table(&cases(None)).expect("a table");
        assert!(check(cases(None), &table).is_ok());
    }

    #[test]
    fn names_suit_a_file_system() {
        let named = |path: &str| {
            let folder = Folder { train: path.into(), holdout: None, train_match: None, holdout_match: None };
            Source::Folder(folder).name()
        };
        assert_eq!([named("/x/My photos"), named("/x/.."), named("/")], ["My_photos", "run", "run"]);
    }
}
