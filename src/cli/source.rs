//! Where the fitness cases of a run come from, as the table `[data]` of its settings.toml has it.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use vsonar::dataset::{self, DEFAULT_GAP, Dataset, ParsePartError, Unit};
use vsonar::world::office::World;
use vsonar::world::{Corridor, FRAMES};

use super::CliError;
use super::cases::Cases;
use super::output::from_here;

/// The building of the built-in corridor that is trained on.
pub(crate) const BUILDING: u64 = 1;
/// The building that is held out.
pub(crate) const OTHER_BUILDING: u64 = 2;

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

/// Folders of images; the paths are absolute.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Folder {
    pub(crate) train: PathBuf,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) holdout: Option<PathBuf>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) train_match: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) holdout_match: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) holdout_part: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) validation: Option<PathBuf>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) validation_match: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) validation_part: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) split_by: Option<Unit>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) gap: Option<u32>,
}

/// The built-in corridor: two of its buildings.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Synthetic {
    #[serde(default = "building")]
    building: u64,
    /// The building that chooses the winner, if one is to.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    validation_building: Option<u64>,
    #[serde(default = "other_building")]
    holdout_building: u64,
    #[serde(default = "frames")]
    frames: usize,
}

/// A synthetic office: what is recorded in it is trained on, and what is in two other buildings of the kind.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Recorded {
    name: World,
    /// The building that chooses the winner.
    #[serde(default = "validation_office")]
    validation_building: u64,
    #[serde(default = "other_office")]
    holdout_building: u64,
    /// Pictures of each building, if not as many as the world has.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    frames: Option<usize>,
}

impl Recorded {
    fn check(&self) -> Result<(), String> {
        if self.validation_building == self.holdout_building {
            return Err(format!(
                "`validation_building` and `holdout_building` of `world` are both {}; choose two buildings",
                self.holdout_building
            ));
        }
        match self.frames {
            Some(frames) if !(1..=10_000).contains(&frames) => {
                Err(format!("`frames` of `world` is {frames}; choose 1 to 10000"))
            }
            _ => Ok(()),
        }
    }

    /// All pictures of a world, the usual building held out.
    pub(crate) fn of(name: World) -> Recorded {
        let (validation_building, holdout_building) = (validation_office(), other_office());
        Recorded { name, validation_building, holdout_building, frames: None }
    }

    /// The world.
    pub(crate) fn world(&self) -> World {
        self.name
    }

    /// Pictures of each building, if not as many as the world has.
    pub(crate) fn frames(&self) -> Option<usize> {
        self.frames
    }

    /// The building that is held out.
    pub(crate) fn holdout_building(&self) -> u64 {
        self.holdout_building
    }

    /// The pictures to train on.
    pub(crate) fn training(&self) -> Result<Dataset, CliError> {
        Ok(self.name.recorded(None, false, self.frames)?)
    }

    /// Those that are held out.
    pub(crate) fn held_out(&self) -> Result<Dataset, CliError> {
        Ok(self.name.recorded(Some(self.holdout_building), false, self.frames)?)
    }
}

fn validation_office() -> u64 {
    1
}

pub(crate) fn other_office() -> u64 {
    2
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
    /// For a folder that is yet to be made: the command that makes it.
    pub(crate) synth: Option<String>,
}

/// The path from the root; the folder itself is looked at when it is loaded.
pub(crate) fn absolute(path: &Path) -> Result<PathBuf, CliError> {
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
        table.extend(cases.fingerprints());
        Ok(table)
    }

    /// From the table `[data]` of a settings file.
    pub(crate) fn from_table(table: &toml::Table, file: &Path) -> Result<Source, CliError> {
        let source = Source::parse(table, file)?;
        source.check().map_err(|e| CliError::Failed(format!("{}: the table [data]: {e}", file.display())))?;
        Ok(source)
    }

    /// Whether what a file says of the parts goes together, as the flags that say the same have to.
    pub(crate) fn check(&self) -> Result<(), String> {
        let f = match self {
            Source::Folder(f) => f,
            Source::World(world) => return world.check(),
            Source::Synthetic(_) => return Ok(()),
        };
        let parts = [
            ("holdout", [f.holdout.is_some(), f.holdout_match.is_some(), f.holdout_part.is_some()]),
            (
                "validation",
                [f.validation.is_some(), f.validation_match.is_some(), f.validation_part.is_some()],
            ),
        ];
        for (name, given) in parts {
            if given.iter().filter(|given| **given).count() > 1 {
                return Err(format!("of `{name}`, `{name}_match` and `{name}_part` only one can be given"));
            }
        }
        if f.holdout_match.is_some() && f.train_match.is_none() {
            return Err("`holdout_match` needs `train_match`, which says what to train on".to_string());
        }
        for (name, part) in [("holdout_part", &f.holdout_part), ("validation_part", &f.validation_part)] {
            if let Some(Err(error)) = part.as_ref().map(|part| part.parse::<dataset::Part>()) {
                return Err(format!("`{name}`: {error}"));
            }
        }
        Ok(())
    }

    fn parse(table: &toml::Table, file: &Path) -> Result<Source, CliError> {
        let mut table = table.clone();
        Cases::FINGERPRINTS.iter().for_each(|name| drop(table.remove(*name)));
        table.try_into().map_err(|error| {
            CliError::Failed(format!(
                "{}: the table [data] does not say where the fitness cases come from: {}; it has a table [data.folder] \
                 with the path `train`, and perhaps {}, or a table [data.world] with the `name` of a world",
                file.display(),
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
    pub(crate) fn office(&self) -> Option<&'static str> {
        match self {
            Source::World(Recorded { name: World::Nsh, .. }) => Some("nsh"),
            Source::World(Recorded { name: World::Fmrb | World::Combined, .. }) => Some("fmrb"),
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

    /// What `vsonar eval` has to be told to look at the training cases, at those of validation and at those held out;
    /// nothing if a part of the folder was taken away that no pattern names, for then only the run folder knows.
    pub(crate) fn parts(&self) -> Option<[Option<Part>; 3]> {
        match self {
            Source::Folder(f) => {
                let part = |dir: &Path, pattern: &Option<String>| Part {
                    folder: from_here(dir),
                    pattern: pattern.clone(),
                    synth: None,
                };
                if f.holdout_part.is_some() || f.validation_part.is_some() || f.validation_match.is_some() {
                    return None;
                }
                let holdout = match (&f.holdout, &f.holdout_match) {
                    (Some(dir), _) => Some(part(dir, &None)),
                    (None, Some(_)) => Some(part(&f.train, &f.holdout_match)),
                    (None, None) => None,
                };
                let validation = f.validation.as_ref().map(|dir| part(dir, &None));
                Some([Some(part(&f.train, &f.train_match)), validation, holdout])
            }
            Source::Synthetic(s) => {
                let part = |name: &str, building| Part {
                    folder: name.into(),
                    pattern: None,
                    synth: Some(corridor_command(name, building, s.frames)),
                };
                let validation = s.validation_building.map(|building| part("between", building));
                Some([
                    Some(part("corridor", s.building)),
                    validation,
                    Some(part("elsewhere", s.holdout_building)),
                ])
            }
            Source::World(w) => {
                let part = |folder: &str, building: Option<u64>| {
                    let folder =
                        if building.is_none() { w.name.to_string() } else { format!("{}-{folder}", w.name) };
                    let mut command = format!("vsonar synth --world {} --out {folder}", w.name);
                    building.iter().for_each(|seed| command += &format!(" --seed {seed}"));
                    w.frames.iter().for_each(|frames| command += &format!(" --frames {frames}"));
                    Some(Part { folder: folder.into(), pattern: None, synth: Some(command) })
                };
                Some([
                    part("", None),
                    part("between", Some(w.validation_building)),
                    part("elsewhere", Some(w.holdout_building)),
                ])
            }
        }
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

    /// In words, for people.
    pub(crate) fn describe(&self) -> String {
        match self {
            Source::Synthetic(s) => match s.validation_building {
                Some(_) => {
                    "the built-in corridor; one other building chooses the winner, another is held out"
                        .to_string()
                }
                None => "the built-in corridor, another building held out".to_string(),
            },
            Source::World(w) => {
                format!("the world {}; one other building chooses the winner, another is held out", w.name)
            }
            Source::Folder(f) => {
                let mut text = from_here(&f.train).display().to_string();
                f.train_match.iter().for_each(|glob| text += &format!(", images {glob}"));
                f.holdout.iter().for_each(|dir| text += &format!("; held out {}", from_here(dir).display()));
                f.holdout_match.iter().for_each(|glob| text += &format!("; held out {glob}"));
                f.holdout_part.iter().for_each(|part| text += &format!("; held out {part}"));
                f.validation
                    .iter()
                    .for_each(|dir| text += &format!("; validation on {}", from_here(dir).display()));
                f.validation_match.iter().for_each(|glob| text += &format!("; validation on {glob}"));
                f.validation_part
                    .iter()
                    .for_each(|part| text += &format!("; validation on {part} of the rest"));
                text
            }
        }
    }

    /// Reads or renders the cases.
    pub(crate) fn load(&self) -> Result<Cases, CliError> {
        match self {
            Source::Synthetic(s) => {
                let render = |building| Corridor::default().render(building, s.frames);
                let train = render(s.building)?;
                let validation = s.validation_building.map(render).transpose()?;
                Ok(Cases { train, validation, holdout: Some(render(s.holdout_building)?), left_out: 0 })
            }
            Source::World(w) => Ok(Cases {
                train: w.training()?,
                validation: Some(w.name.recorded(Some(w.validation_building), false, w.frames)?),
                holdout: Some(w.held_out()?),
                left_out: 0,
            }),
            Source::Folder(f) => f.load(),
        }
    }
}

/// The command that writes a building of the corridor into a folder.
fn corridor_command(folder: &str, building: u64, frames: usize) -> String {
    let mut command = format!("vsonar data synth {folder}");
    if building != BUILDING {
        command += &format!(" --seed {building}");
    }
    if frames != FRAMES {
        command += &format!(" --frames {frames}");
    }
    command
}

impl Folder {
    fn load(&self) -> Result<Cases, CliError> {
        let all = Dataset::load(&self.train)?;
        let unit = self.split_by.unwrap_or_else(|| all.unit());
        let gap = self.gap.unwrap_or(DEFAULT_GAP);
        let (mut train, mut holdout) = match (&self.train_match, &self.holdout_match) {
            (Some(train), Some(holdout)) => {
                let (train, holdout) = all.split(train, holdout)?;
                (train, Some(holdout))
            }
            (Some(train), None) => (all.select(train)?, None),
            (None, _) => (all, None),
        };
        let mut left_out = 0;
        let mut take = |train: &mut Dataset, part: &str| -> Result<Dataset, CliError> {
            // A recorded text is looked at as a flag is.
            let part: dataset::Part =
                part.parse().map_err(|e: ParsePartError| CliError::Failed(e.to_string()))?;
            let (rest, part) = train.hold_out(&part, unit, gap)?;
            left_out += train.images().len() - rest.images().len() - part.images().len();
            *train = rest;
            Ok(part)
        };
        if let Some(part) = &self.holdout_part {
            holdout = Some(take(&mut train, part)?);
        }
        if let Some(dir) = &self.holdout {
            holdout = Some(Dataset::load(dir)?);
        }
        let validation = match (&self.validation, &self.validation_match, &self.validation_part) {
            (Some(dir), ..) => Some(Dataset::load(dir)?),
            (None, Some(glob), _) => {
                let (rest, part) = train.split_off(glob)?;
                train = rest;
                Some(part)
            }
            (None, None, Some(part)) => Some(take(&mut train, part)?),
            (None, None, None) => None,
        };
        Ok(Cases { train, validation, holdout, left_out })
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
        let cases = source.load().expect("in range");
        assert!(source.has_holdout() && cases.validation.is_some() && cases.holdout.is_some());
        let table = source.to_table(&cases).expect("a table");
        let again = Source::from_table(&table, file).expect("the same");
        assert_eq!(again, source);
        // a resume loads the same, and would notice others
        again.load().expect("in range").check(&table, file).expect("nothing has changed");
        let other =
            read("[world]\nname = \"fmrb\"\nframes = 1\nholdout_building = 9").load().expect("in range");
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
