//! Where the fitness cases of a run come from, as the table `[data]` of its settings.toml has it.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use vsonar::dataset;
use vsonar::vision::GRAY_WEIGHTS;
use vsonar::world::office::World;

use super::CliError;
use super::cases::{Cases, GRAY};
use super::source_folder::Folder;
use super::source_made::{Recorded, Synthetic};
use vsonar::support::printable::ShownPath as _;

/// Where the cases come from. Recorded in the run folder, so that a resume finds them.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Source {
    /// Folders of images.
    Folder(Folder),
    /// The built-in corridor.
    Synthetic(Synthetic),
    /// What a robot's camera recorded in a synthetic office.
    World(Recorded),
}

/// The path from the root; the folder itself is looked at when it is loaded.
pub(crate) fn absolute(path: &Path) -> Result<PathBuf, CliError> {
    let absolute = std::path::absolute(path).map_err(|e| CliError::file(path, "find the folder", &e))?;
    match absolute.to_str() {
        Some(_) => Ok(absolute),
        None => Err(CliError::Failed(format!(
            "{}: the path is not UTF-8, so it cannot be recorded in the run folder; rename the folder",
            path.shown()
        ))),
    }
}

impl Source {
    /// What there is without data: an office whose hallway has a dark stretch.
    pub(crate) fn built_in() -> Source {
        Source::world(World::Fmrb)
    }

    /// A synthetic office: its recording to train on, one other building that chooses the winner, one that is held out.
    pub(crate) fn world(name: World) -> Source {
        Source::World(Recorded::of(name))
    }

    /// As the table `[data]`, for a run with these cases.
    pub(crate) fn to_table(&self, cases: &Cases) -> Result<toml::Table, CliError> {
        let mut table = toml::Table::try_from(self)?;
        if let Source::Folder(_) = self {
            table.insert(GRAY.to_string(), GRAY_WEIGHTS.into());
        }
        table.extend(cases.fingerprints());
        Ok(table)
    }

    /// From the table `[data]` of a settings file.
    pub(crate) fn from_table(table: &toml::Table, file: &Path) -> Result<Source, CliError> {
        let source = Source::parse(table, file)?;
        source.check().map_err(|e| CliError::Failed(format!("{}: the table [data]: {e}", file.shown())))?;
        Ok(source)
    }

    /// Whether what a file says of the parts goes together, as the flags that say the same have to.
    pub(crate) fn check(&self) -> Result<(), String> {
        match self {
            Source::Folder(folder) => folder.check(),
            Source::World(world) => world.check(),
            Source::Synthetic(_) => Ok(()),
        }
    }

    fn parse(table: &toml::Table, file: &Path) -> Result<Source, CliError> {
        let mut table = table.clone();
        Cases::FINGERPRINTS.iter().chain(&[GRAY]).for_each(|name| drop(table.remove(*name)));
        table.try_into().map_err(|error| {
            CliError::Failed(format!(
                "{}: the table [data] does not say where the fitness cases come from: {}; it has a table [data.folder] \
                 with the path `train`, and perhaps {}, or a table [data.world] with the `name` of a world",
                file.shown(),
                error.to_string().trim_end().replace('\n', " "),
                "`holdout`, `holdout_match`, `holdout_part`, the same of `validation`, `split_by` and `gap`"
            ))
        })
    }

    /// The same source for a run of its own: paths count from the folder of the file that names them.
    pub(crate) fn named_in(self, file: &Path) -> Result<Source, CliError> {
        let place = file.parent().unwrap_or(Path::new(""));
        match self {
            Source::Folder(f) => Ok(Source::Folder(Folder {
                train: absolute(&place.join(&f.train))?,
                holdout: f.holdout.as_ref().map(|dir| absolute(&place.join(dir))).transpose()?,
                validation: f.validation.as_ref().map(|dir| absolute(&place.join(dir))).transpose()?,
                ..f
            })),
            other => Ok(other),
        }
    }

    /// The folder of the training images, if they are in one.
    pub(crate) fn folder(&self) -> Option<&Path> {
        match self {
            Source::Folder(folder) => Some(&folder.train),
            Source::Synthetic(_) | Source::World(_) => None,
        }
    }

    /// The same with the training images in another folder; `None` if they are in none.
    pub(crate) fn with_folder(self, train: &Path) -> Result<Option<Source>, CliError> {
        Ok(match self {
            Source::Folder(folder) => Some(Source::Folder(Folder { train: absolute(train)?, ..folder })),
            Source::Synthetic(_) | Source::World(_) => None,
        })
    }

    /// The office that a robot can drive in; of pictures of two buildings, that of the paper's drives.
    pub(crate) fn office(&self) -> Option<World> {
        self.world_name().map(|world| if world == World::Combined { World::Fmrb } else { world })
    }

    /// The world, if the pictures are of one.
    pub(crate) fn world_name(&self) -> Option<World> {
        match self {
            Source::World(recorded) => Some(recorded.world()),
            Source::Folder(_) | Source::Synthetic(_) => None,
        }
    }

    /// A short name, for the run folder.
    pub(crate) fn name(&self) -> String {
        let name = match self {
            Source::Folder(folder) => folder.train.file_name().map(|n| n.to_string_lossy().into_owned()),
            Source::Synthetic(_) => Some("synthetic".to_string()),
            Source::World(world) => Some(world.name.to_string()),
        };
        let plain = |c: char| if c.is_alphanumeric() || "._-".contains(c) { c } else { '_' };
        let name: String = name.unwrap_or_default().chars().map(plain).collect();
        if name.trim_matches('.').is_empty() { "run".to_string() } else { name }
    }

    /// The same with a part of the training images held out; `None` if they are in no folder.
    pub(crate) fn without(self, part: &dataset::Part) -> Option<Source> {
        match self {
            Source::Folder(folder) => {
                Some(Source::Folder(Folder { holdout_part: Some(part.to_string()), ..folder }))
            }
            Source::Synthetic(_) | Source::World(_) => None,
        }
    }

    /// Whether a part is held out.
    pub(crate) fn has_holdout(&self) -> bool {
        match self {
            Source::Folder(f) => f.holdout.is_some() || f.holdout_match.is_some() || f.holdout_part.is_some(),
            Source::Synthetic(_) | Source::World(_) => true,
        }
    }

    /// Reads or renders the cases; a folder that is read stays below `limit` bytes of memory.
    pub(crate) fn load(&self, limit: u64) -> Result<Cases, CliError> {
        match self {
            Source::Synthetic(corridor) => corridor.load(),
            Source::World(office) => office.load(),
            Source::Folder(folder) => folder.load(limit),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_world_is_found_again_in_its_table() {
        let file = Path::new("my.toml");
        let read =
            |text: &str| Source::from_table(&toml::from_str(text).expect("TOML"), file).expect("a world");
        let source = read("[world]\nname = \"fmrb\"\nframes = 1");
        let cases = source.load(u64::MAX).expect("in range");
        assert!(source.has_holdout() && cases.validation.is_some() && cases.holdout.is_some());
        let table = source.to_table(&cases).expect("a table");
        let again = Source::from_table(&table, file).expect("the same");
        assert_eq!(again, source);
        // a resume loads the same, and would notice others
        again.load(u64::MAX).expect("in range").check(&table, file).expect("nothing has changed");
        let other = read("[world]\nname = \"fmrb\"\nframes = 1\nholdout_building = 9")
            .load(u64::MAX)
            .expect("in range");
        assert!(other.check(&table, file).is_err());
        assert_eq!(read("[world]\nname = \"nsh\""), Source::world(World::Nsh));
        assert_eq!(Source::world(World::Nsh).name(), "nsh");
        let parts =
            source.parts().expect("known").map(|part| part.and_then(|part| part.synth).expect("a command"));
        assert_eq!(parts[0], "vsonar synth --world fmrb --out fmrb --frames 1");
        assert_eq!(parts[2], "vsonar synth --world fmrb --out fmrb-elsewhere --seed 2 --frames 1");
    }

    #[test]
    fn names_suit_a_file_system() {
        let named = |path: &str| {
            let folder = Folder { train: path.into(), ..Folder::default() };
            Source::Folder(folder).name()
        };
        assert_eq!([named("/x/My photos"), named("/x/.."), named("/")], ["My_photos", "run", "run"]);
    }
}
