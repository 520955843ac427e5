//! Where the fitness cases of a run come from, as flags.

use std::path::{Path, PathBuf};
use std::str::FromStr;

use vsonar::dataset::{self, ParsePartError, Unit};
use vsonar::world::office::World;

use super::CliError;
use super::source::{Source, absolute};
use super::source_folder::Folder;

/// The flags that say where the cases come from.
#[derive(clap::Args, Clone)]
#[command(next_help_heading = "Data")]
pub(crate) struct DataArgs {
    /// Folder with `labels.csv` and the images it names [default: the data of the `--settings` file, if it
    /// names any, else the world fmrb]
    #[arg(long, value_name = "DIR")]
    pub(crate) data: Option<PathBuf>,
    /// Train on what a robot's camera recorded in a synthetic office: nsh, fmrb, or combined for every other image of
    /// both; one other building of the kind chooses the winner, another one is held out
    #[arg(
        long,
        value_name = "NAME",
        // each by itself: clap does not ask for `--data`, which the others need, beside what conflicts with it
        conflicts_with_all = [
            "data", "holdout", "train_match", "holdout_match", "validation", "validation_match", "split_by", "gap", "folds",
        ]
    )]
    pub(crate) world: Option<World>,
    /// What the result is tested on and nothing is trained on: a second such folder, or a part of the first, as
    /// 25%, fold:2/5 or group:hall,lab
    ///
    /// 25% takes whole groups if the table has a column `group`, else the last stretch of each sequence of images
    /// (names that differ in their last number); fold:2/5 the second of five such parts; group:hall the group, or the
    /// sequence, of that name. Neighbouring frames are almost the same picture: images beside a cut are left out (`--gap`).
    #[arg(long, value_name = "DIR|PART", requires = "data", conflicts_with = "holdout_match")]
    pub(crate) holdout: Option<Place>,
    /// Train on the images whose names match this pattern only, e.g. 'run_[AB]*'
    #[arg(long, value_name = "GLOB", requires = "data")]
    pub(crate) train_match: Option<String>,
    /// Test on the images of the same folder whose names match this pattern, e.g. 'run_C*'
    ///
    /// Neighbouring frames are almost the same picture, so whole drives should go to one side or the other.
    #[arg(long, value_name = "GLOB", requires = "train_match")]
    pub(crate) holdout_match: Option<String>,
    /// What chooses the winner from the hall of fame: a folder, or a part of what is left to train on, as for
    /// `--holdout`
    #[arg(long, value_name = "DIR|PART", requires = "data", conflicts_with = "validation_match")]
    pub(crate) validation: Option<Place>,
    /// The same as the images left to train on whose names match this pattern
    #[arg(long, value_name = "GLOB", requires = "data")]
    pub(crate) validation_match: Option<String>,
    /// What a part never tears apart [default: group if the table has groups, else stretch]
    #[arg(long, value_name = "UNIT", requires = "data", value_parser = unit)]
    pub(crate) split_by: Option<Unit>,
    /// Images beside held-out ones that are in neither part, where a part is taken as 25% or fold:2/5 [default: 2]
    #[arg(long, value_name = "N", requires = "data")]
    pub(crate) gap: Option<u32>,
}

/// A folder, or a part of another.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Place {
    Folder(PathBuf),
    Part(dataset::Part),
}

impl FromStr for Place {
    type Err = ParsePartError;

    /// A folder whose name could be a part is written with `./` before it.
    fn from_str(text: &str) -> Result<Place, ParsePartError> {
        let number = !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit());
        let meant = text.ends_with('%') || text.starts_with("fold:") || text.starts_with("group:");
        let meant = meant || number || text.is_empty();
        match text.parse() {
            Ok(part) => Ok(Place::Part(part)),
            Err(error) if meant => Err(error),
            Err(_) => Ok(Place::Folder(text.into())),
        }
    }
}

impl Place {
    fn folder(&self) -> Option<&Path> {
        match self {
            Place::Folder(folder) => Some(folder),
            Place::Part(_) => None,
        }
    }

    fn part(&self) -> Option<String> {
        match self {
            Place::Folder(_) => None,
            Place::Part(part) => Some(part.to_string()),
        }
    }
}

fn unit(text: &str) -> Result<Unit, String> {
    Ok(match text {
        "group" => Unit::Group,
        "stretch" => Unit::Stretch,
        "image" => Unit::Image,
        _ => {
            return Err(
                "give group, stretch, or image (neighbouring frames may then come to both sides)".into()
            );
        }
    })
}

impl DataArgs {
    /// Whether there are any.
    pub(crate) fn given(&self) -> bool {
        // The others need the first.
        self.data.is_some() || self.world.is_some()
    }

    /// What the flags say; with `folds` the parts to be held out are still to be named.
    pub(crate) fn source(&self, folds: bool) -> Result<Source, CliError> {
        let parts = [&self.holdout, &self.validation].into_iter().flatten();
        let taken = folds || parts.into_iter().any(|place| place.part().is_some());
        for (flag, given) in [("--gap", self.gap.is_some()), ("--split-by", self.split_by.is_some())] {
            if given && !taken {
                let text = "is about parts, and none is taken; ask for one with `--holdout 25%` or `--validation 25%`";
                return Err(CliError::Usage(format!("{flag} {text}")));
            }
        }
        if self.gap.is_some_and(|gap| gap > 0) && self.split_by == Some(Unit::Image) {
            let text =
                "--gap: with `--split-by image` neighbours come to both sides, so that there is no gap";
            return Err(CliError::Usage(text.to_string()));
        }
        let Some(data) = &self.data else {
            return Ok(self.world.map_or_else(Source::built_in, Source::world));
        };
        let folder = |place: &Option<Place>| place.as_ref().and_then(Place::folder).map(absolute).transpose();
        let part = |place: &Option<Place>| place.as_ref().and_then(Place::part);
        Ok(Source::Folder(Folder {
            train: absolute(data)?,
            holdout: folder(&self.holdout)?,
            train_match: self.train_match.clone(),
            holdout_match: self.holdout_match.clone(),
            holdout_part: part(&self.holdout),
            validation: folder(&self.validation)?,
            validation_match: self.validation_match.clone(),
            validation_part: part(&self.validation),
            split_by: self.split_by,
            gap: self.gap,
        }))
    }
}

#[cfg(test)]
mod tests {
    use vsonar::dataset::Dataset;
    use vsonar::world::Corridor;

    use super::super::cases::Cases;
    use super::*;

    #[test]
    fn a_source_is_found_again_in_its_table() {
        let args = DataArgs {
            data: Some("a/b c".into()),
            world: None,
            holdout: None,
            train_match: Some("x*".into()),
            holdout_match: Some("y*".into()),
            validation: Some("fold:1/3".parse().expect("a place")),
            validation_match: None,
            split_by: Some(Unit::Group),
            gap: Some(1),
        };
        let folder = args.source(false).expect("UTF-8");
        let world = DataArgs { data: None, world: Some(World::Nsh), ..args.clone() };
        let synthetic = DataArgs { data: None, train_match: None, holdout_match: None, ..args };
        let small = Corridor { width: 16, height: 16, columns: 1, ..Corridor::default() };
        let set = |seed| small.render(seed, 1).expect("possible");
        let cases = |holdout: Option<Dataset>| Cases {
            train: set(1),
            validation: holdout.clone(),
            holdout,
            left_out: 0,
        };
        let file = Path::new("my.toml");
        let made = |args: &DataArgs| args.source(false).expect("nothing to go wrong");
        for source in [folder, made(&synthetic), made(&world)] {
            for cases in [cases(Some(set(2))), cases(None)] {
                let table = source.to_table(&cases).expect("a table");
                assert_eq!(Source::from_table(&table, file).expect("the same"), source);
            }
        }
        let error = Source::from_table(&toml::Table::new(), file).expect_err("nothing in it");
        assert!(matches!(error, CliError::Failed(text) if text.contains("my.toml")));
    }
}
