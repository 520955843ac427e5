//! What drives: the program, and what it is held against.

use std::str::FromStr;
use std::sync::Arc;

use vsonar::baseline::{Rival, Tuned};
use vsonar::detector::ProgramDetector;
use vsonar::drive::flow::{Flow, FlowDetector};
use vsonar::drive::sonar::Sonar;
use vsonar::drive::source::{Camera, RangeSource};
use vsonar::world::office::{CHANGED_BUILDING, Kind, Office, Plan, Setup};

use super::CliError;

/// What the program can be held against.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Against {
    /// A ring of ideal sonars.
    Sonar,
    /// The true rows of the same columns: a detector without error.
    Truth,
    /// A rival of the literature, tuned on a world's training set.
    Rival(Rival),
    /// The rival that compares a frame with an earlier one by the robot's motion, tuned likewise.
    Flow,
}

impl Against {
    fn all() -> Vec<Against> {
        let rivals = Rival::ALL.into_iter().map(Against::Rival);
        [Against::Sonar, Against::Truth].into_iter().chain(rivals).chain([Against::Flow]).collect()
    }

    fn name(self) -> &'static str {
        match self {
            Against::Sonar => "sonar",
            Against::Truth => "truth",
            Against::Rival(rival) => rival.name(),
            Against::Flow => "flow",
        }
    }
}

/// What the program is held against: each once, in the order of [`Against::all`].
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Others(pub(crate) Vec<Against>);

impl Others {
    /// Those among them that are tuned on images.
    pub(crate) fn rivals(&self) -> Vec<Rival> {
        let rival = |one: &Against| match one {
            Against::Rival(rival) => Some(*rival),
            Against::Sonar | Against::Truth | Against::Flow => None,
        };
        self.0.iter().filter_map(rival).collect()
    }
}

impl FromStr for Others {
    type Err = String;

    /// `all`, or names between commas.
    fn from_str(text: &str) -> Result<Others, String> {
        let all = Against::all();
        if text == "all" {
            return Ok(Others(all));
        }
        let names: Vec<&str> = text.split(',').map(str::trim).collect();
        if let Some(unknown) = names.iter().find(|name| all.iter().all(|one| one.name() != **name)) {
            let known: Vec<&str> = all.iter().map(|one| one.name()).collect();
            return Err(format!("there is no `{unknown}`; choose all, or some of {}", known.join(", ")));
        }
        Ok(Others(all.into_iter().filter(|one| names.contains(&one.name())).collect()))
    }
}

/// One that drives.
#[derive(Debug, Clone)]
pub(crate) enum Sensor {
    /// The program's detector.
    Program(Arc<ProgramDetector>),
    /// A ring of ideal sonars.
    Sonar,
    /// The true rows.
    Truth,
    /// A rival, tuned.
    Rival(Box<Tuned>),
    /// The one that compares frames, tuned, and its share of right answers where it was: those pictures were recorded for
    /// the tuning.
    Flow { flow: Flow, training: f64 },
}

impl Sensor {
    /// Its name in tables and files.
    pub(crate) fn name(&self) -> &'static str {
        match self {
            Sensor::Program(_) => "program",
            Sensor::Sonar => Against::Sonar.name(),
            Sensor::Truth => Against::Truth.name(),
            Sensor::Rival(tuned) => tuned.rival().name(),
            Sensor::Flow { .. } => Against::Flow.name(),
        }
    }

    /// What it was tuned to, in words.
    pub(crate) fn tuned(&self) -> Option<String> {
        match self {
            Sensor::Rival(tuned) => Some(tuned.describe()),
            Sensor::Flow { flow, .. } => Some(flow.describe()),
            Sensor::Program(_) | Sensor::Sonar | Sensor::Truth => None,
        }
    }

    /// The sensor for a run; the seed is that of the building.
    pub(crate) fn make(
        &self,
        office: &Office,
        columns: &[u32],
        median: bool,
        seed: u64,
    ) -> Result<Box<dyn RangeSource>, CliError> {
        let columns = columns.to_vec();
        Ok(match self {
            Sensor::Program(program) => {
                Box::new(Camera::with(Box::new(program.clone()), office, columns, median))
            }
            Sensor::Sonar => Box::new(Sonar::new(seed)),
            Sensor::Truth => Box::new(Camera::with_truth(office, columns)),
            Sensor::Rival(tuned) => Box::new(Camera::with(tuned.clone(), office, columns, median)),
            Sensor::Flow { flow, .. } => {
                // It knows its camera, as all do whose rows become distances.
                let flow = Flow { camera: office.camera(), size: office.size(), ..*flow };
                Box::new(Camera::with(Box::new(FlowDetector::new(flow)), office, columns, median))
            }
        })
    }
}

/// The building to drive in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Building {
    pub(crate) kind: Kind,
    /// None for the building of the world's training set, else another one of the kind.
    pub(crate) seed: Option<u64>,
    /// Whether it holds things that no training set shows, seen by a camera of another pitch, height and exposure.
    pub(crate) changed: bool,
}

impl Building {
    pub(crate) fn office(self) -> Result<Office, CliError> {
        let Building { kind, changed, .. } = self;
        Ok(match (self.effective_seed(), changed) {
            (None, _) => Office::preset(kind),
            (Some(seed), false) => Office::new(kind, seed),
            (Some(seed), true) => {
                Office::build(&Plan::generate(kind, seed, true), &Setup::default().varied(seed), seed)?
            }
        })
    }

    /// The seed that counts; none for the building of the world's training set.
    pub(crate) fn effective_seed(self) -> Option<u64> {
        self.seed.or(self.changed.then_some(CHANGED_BUILDING))
    }

    /// In words.
    pub(crate) fn describe(self) -> String {
        let which = self.effective_seed().map_or_else(
            || "the building of the training set".to_string(),
            |seed| format!("building {seed}{}", if self.changed { ", changed" } else { "" }),
        );
        format!("{}, {which}", self.kind.name())
    }
}

/// Reads the name of a kind of building.
pub(crate) fn kind(text: &str) -> Result<Kind, String> {
    let found = Kind::ALL.into_iter().find(|kind| kind.name() == text);
    found.ok_or_else(|| match text {
        "combined" => {
            "that is pictures of two buildings; drive in fmrb or nsh, with `--tune-on combined`".to_string()
        }
        _ => "there is no such building; choose fmrb or nsh".to_string(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn kinds_by_name() {
        for one in Kind::ALL {
            assert_eq!(kind(one.name()), Ok(one));
        }
        assert!(kind("mars").expect_err("none").contains("fmrb or nsh"));
        assert!(kind("combined").expect_err("none").contains("--tune-on"));
    }

    #[test]
    fn each_once_and_in_order() {
        use Against::{Sonar, Truth};
        let read = |text: &str| text.parse::<Others>();
        assert_eq!(read("truth, sonar,truth"), Ok(Others(vec![Sonar, Truth])));
        assert_eq!(read("all").expect("all").0.len(), 3 + Rival::ALL.len());
        assert_eq!(read("lorigo,sonar"), Ok(Others(vec![Sonar, Against::Rival(Rival::Lorigo)])));
        let error = read("radar").expect_err("none");
        assert!(error.contains("`radar`") && error.contains("sonar, truth, constant"), "{error}");
    }
}
