//! What other commands have to be told to look at the same cases as a run, and the source in words.

use std::path::{Path, PathBuf};

use vsonar::support::printable::ShownPath as _;
use vsonar::world::FRAMES;

use super::output::from_here;
use super::source::Source;
use super::source_made::BUILDING;

/// A part of the data, as the flags of other commands have it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Part {
    pub(crate) folder: PathBuf,
    /// The images that count, if not all do.
    pub(crate) pattern: Option<String>,
    /// For a folder that is yet to be made: the command that makes it.
    pub(crate) synth: Option<String>,
}

impl Source {
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
                let mut text = from_here(&f.train).shown();
                f.train_match.iter().for_each(|glob| text += &format!(", images {glob}"));
                f.holdout.iter().for_each(|dir| text += &format!("; held out {}", from_here(dir).shown()));
                f.holdout_match.iter().for_each(|glob| text += &format!("; held out {glob}"));
                f.holdout_part.iter().for_each(|part| text += &format!("; held out {part}"));
                f.validation
                    .iter()
                    .for_each(|dir| text += &format!("; validation on {}", from_here(dir).shown()));
                f.validation_match.iter().for_each(|glob| text += &format!("; validation on {glob}"));
                f.validation_part
                    .iter()
                    .for_each(|part| text += &format!("; validation on {part} of the rest"));
                text
            }
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
