//! How those that drive do on labelled images: those that rivals are tuned on, and those of another building.

use std::path::Path;

use serde::Serialize;
use vsonar::baseline::{Rival, answers};
use vsonar::dataset::{Dataset, TOLERANCE};
use vsonar::detector::SequenceDetector;
use vsonar::drive::flow::Flow;
use vsonar::evolve::is_correct;
use vsonar::world::office::{Kind, World};

use super::CliError;
use super::drive_sensor::Sensor;
use super::eval_cases::run_of;
use super::settings::SettingsFile;
use super::source::Source;
use super::source_made::Recorded;
use super::tuning::Copies;

/// Which images, and what counts as correct.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct TunedOn {
    /// The world whose training images rivals are tuned on.
    pub(crate) world: World,
    /// How many images that is.
    pub(crate) images: usize,
    /// The building of the world that is held out, by seed.
    pub(crate) held_out_building: u64,
    /// Rows that an answer may be off.
    pub(crate) tolerance: f64,
    /// Whether that is what the program was evolved on.
    pub(crate) as_the_program: bool,
    /// Altered copies of each image that some rivals are tuned on too (`Rival::takes_copies`).
    pub(crate) altered_copies: u32,
    /// The rivals that were asked for.
    #[serde(skip)]
    pub(crate) rivals: Vec<Rival>,
}

/// The images themselves.
pub(crate) struct Sets {
    pub(crate) tuned_on: TunedOn,
    pub(crate) training: Dataset,
    pub(crate) held_out: Dataset,
    /// Copies that the run of the program has of its training images.
    pub(crate) copies: Copies,
    /// Where they are from.
    recorded: Recorded,
}

/// Shares of right answers, 0 to 1.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(crate) struct Scores {
    /// Of the images that rivals are tuned on.
    pub(crate) training: f64,
    /// Of another building.
    pub(crate) held_out: f64,
}

/// The world whose building the program's run was made in, if it is of a run and was made in one.
pub(crate) fn own_world(program: &Path) -> Result<Option<World>, CliError> {
    let Some(run) = run_of(program) else { return Ok(None) };
    let file = SettingsFile::read(&run.join("settings.toml"))?;
    Ok(Source::from_table(&file.data().cloned().unwrap_or_default(), file.path())?.office())
}

impl Sets {
    /// The images that the run of the program was evolved on, if it was in a world; those of `tune_on` if that is asked
    /// for; else those of the building's own world. The tolerance is that of the run; `rivals` are to be tuned on them.
    pub(crate) fn choose(
        program: &Path,
        kind: Kind,
        tune_on: Option<World>,
        rivals: Vec<Rival>,
    ) -> Result<Sets, CliError> {
        let (mut tolerance, mut own, mut copies) = (TOLERANCE, None, Copies::default());
        if let Some(run) = run_of(program) {
            let file = SettingsFile::read(&run.join("settings.toml"))?;
            let settings = file.recorded()?;
            tolerance = settings.tolerance;
            copies = Copies::of(&settings);
            let table = file.data().cloned().unwrap_or_default();
            if let Source::World(recorded) = Source::from_table(&table, file.path())? {
                own = Some(recorded);
            }
        }
        let building = match kind {
            Kind::Nsh => World::Nsh,
            Kind::Fmrb => World::Fmrb,
        };
        let recorded = match (tune_on, &own) {
            (Some(world), _) => Recorded::of(world),
            (None, Some(own)) => own.clone(),
            (None, None) => Recorded::of(building),
        };
        let (training, held_out) = (recorded.training()?, recorded.held_out()?);
        let tuned_on = TunedOn {
            world: recorded.world(),
            images: training.images().len(),
            held_out_building: recorded.holdout_building(),
            tolerance,
            as_the_program: own.as_ref() == Some(&recorded),
            altered_copies: copies.per_image(),
            rivals,
        };
        Ok(Sets { tuned_on, training, held_out, copies, recorded })
    }

    /// How one that drives does on them; none for what looks at no images.
    pub(crate) fn scores(&self, sensor: &Sensor) -> Result<Option<Scores>, CliError> {
        let mut detector: Box<dyn SequenceDetector> = match sensor {
            Sensor::Program(program) => Box::new(program.clone()),
            Sensor::Rival(tuned) => tuned.clone(),
            Sensor::Truth => return Ok(Some(Scores { training: 1.0, held_out: 1.0 })),
            Sensor::Sonar => return Ok(None),
            Sensor::Flow { flow, training } => {
                let building = Some(self.recorded.holdout_building());
                let (set, answers) = flow.answers(self.recorded.world(), building, self.recorded.frames())?;
                return Ok(Some(Scores { training: *training, held_out: self.share(&set, &answers) }));
            }
        };
        let mut share =
            |set: &Dataset| -> Result<f64, CliError> { Ok(self.share(set, &answers(&mut *detector, set)?)) };
        Ok(Some(Scores { training: share(&self.training)?, held_out: share(&self.held_out)? }))
    }

    /// The share of these answers that are right.
    fn share(&self, set: &Dataset, answers: &[f32]) -> f64 {
        let right = |(case, answer): (&vsonar::dataset::Case, &f32)| {
            is_correct(*answer, f64::from(case.y), self.tuned_on.tolerance)
        };
        let right = set.cases().iter().zip(answers).filter(|&pair| right(pair)).count();
        right as f64 / set.cases().len().max(1) as f64
    }

    /// The rival that compares frames, tuned on the same pictures with the frames before them.
    pub(crate) fn flow(&self) -> Result<Sensor, CliError> {
        let (world, frames) = (self.recorded.world(), self.recorded.frames());
        let (flow, choice) = Flow::tune(world, frames, self.tuned_on.tolerance)?;
        Ok(Sensor::Flow { flow, training: choice.correct as f64 / choice.cases.max(1) as f64 })
    }
}

impl TunedOn {
    /// In words.
    pub(crate) fn describe(&self) -> String {
        let TunedOn { world, images, held_out_building, tolerance, as_the_program, altered_copies, rivals } =
            self;
        let own = if *as_the_program { ", as the program was" } else { "" };
        let copies = Copies::words(*altered_copies, rivals.iter().copied());
        format!(
            "Rivals are tuned on the {images} training images of the world {world}{own}{copies}; an answer is right within \
             {tolerance} rows.\nTraining: the share of right answers there; held out: in building {held_out_building} \
             of that world."
        )
    }
}
