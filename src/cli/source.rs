//! Where the fitness cases of a run come from, as flags and as the table `[data]` of its settings.toml.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use vsonar::dataset::Dataset;
use vsonar::world::{Corridor, FRAMES};

use super::CliError;
use super::output::from_here;

/// The building of the built-in corridor that is trained on.
pub(crate) const BUILDING: u64 = 1;
/// The building that is held out.
pub(crate) const OTHER_BUILDING: u64 = 2;

/// The flags that say where the cases come from.
#[derive(clap::Args, Clone)]
#[command(next_help_heading = "Data")]
pub(crate) struct DataArgs {
    /// Folder with `labels.csv` and the images it names [default: a built-in synthetic corridor]
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
    building: u64,
    holdout_building: u64,
    frames: usize,
}

/// The cases themselves.
pub(crate) struct Cases {
    pub(crate) train: Dataset,
    pub(crate) holdout: Option<Dataset>,
}

impl Cases {
    /// Both sets, or the one there is. At the end of a run both are in memory.
    pub(crate) fn sets(&self) -> impl Iterator<Item = &Dataset> {
        std::iter::once(&self.train).chain(&self.holdout)
    }
}

impl DataArgs {
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
    /// As the table `[data]`.
    pub(crate) fn to_table(&self) -> Result<toml::Table, CliError> {
        Ok(toml::Table::try_from(self)?)
    }

    /// From the table `[data]` of the settings.toml of a run folder.
    pub(crate) fn from_table(table: &toml::Table, run: &Path) -> Result<Source, CliError> {
        table.clone().try_into().map_err(|error| {
            let file = run.join("settings.toml");
            CliError::Failed(format!(
                "{}: the table [data] does not say where the fitness cases come from: {}; it needs a table \
                 [data.folder] with the path `train`",
                file.display(),
                error.to_string().trim_end().replace('\n', " ")
            ))
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

    /// The folder that is trained on, if it is one.
    pub(crate) fn train_folder(&self) -> Option<&Path> {
        match self {
            Source::Folder(folder) => Some(&folder.train),
            Source::Synthetic(_) => None,
        }
    }

    /// The folder that is held out, if it is one.
    pub(crate) fn holdout_folder(&self) -> Option<&Path> {
        match self {
            Source::Folder(folder) => folder.holdout.as_deref(),
            Source::Synthetic(_) => None,
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
        for source in [folder, synthetic.source().expect("nothing to go wrong")] {
            let table = source.to_table().expect("a table");
            assert_eq!(Source::from_table(&table, Path::new("run")).expect("the same"), source);
        }
        let error = Source::from_table(&toml::Table::new(), Path::new("run")).expect_err("nothing in it");
        assert!(matches!(error, CliError::Failed(text) if text.contains("settings.toml")));
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
