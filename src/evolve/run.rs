//! The run: generation after generation, recorded as it goes.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use super::breed::{Offspring, Variation, breed};
use super::cases::Cases;
use super::checkpoint::{Origin, State};
use super::collapse::{Collapse, Warning};
use super::evaluate::{EvaluateError, Evaluator, Tally, Task};
use super::fitness::CaseBits;
use super::folder::{FolderError, RunFolder};
use super::hall_of_fame::HallOfFame;
use super::initial::{self, Initial};
use super::population::{Genotype, Member};
use super::progress::Progress;
use super::record::{GenerationTiming, InitialDraws, Record};
use super::settings::{Settings, SettingsError};
use super::shared::SharedSet;
use super::summary::{Score, Solved, Summary};
use super::validation::{Validation, Verdicts};
use crate::dataset::Dataset;
use crate::exec::Executor;
use crate::export::Provenance;
use crate::tree::{CreateError, Creator, Individual, MutationError};

/// Why a run could not go on. What was recorded before stays.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// The settings are impossible.
    #[error(transparent)]
    Settings(#[from] SettingsError),
    /// Individuals cannot be made with the settings.
    #[error(transparent)]
    Create(#[from] CreateError),
    /// Individuals cannot mutate with the settings.
    #[error(transparent)]
    Mutate(#[from] MutationError),
    /// Individuals could not be evaluated.
    #[error(transparent)]
    Evaluate(#[from] EvaluateError),
    /// The run folder could not be used.
    #[error(transparent)]
    Folder(#[from] FolderError),
}

/// Why a run ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StopReason {
    /// It has all its generations.
    Finished,
    /// The stop flag was set: the running generation is discarded, all before it is recorded.
    Interrupted,
}

/// A run of evolution.
///
/// It is a pure function of settings and training data: threads, executor and interruptions change nothing but
/// the time it takes.
pub struct Evolution {
    settings: Settings,
    creator: Creator,
    variation: Variation,
    cases: Cases,
    evaluator: Evaluator,
    origin: Origin,
    validation: Option<Validation>,
    state: Option<State>,
    folder: Option<RunFolder>,
    progress: Arc<Progress>,
    save_seconds: f64,
}

impl Evolution {
    /// A run that is not recorded, on so many threads (0: one for each core). Altered copies of the training images
    /// are made here, if the settings ask for them.
    ///
    /// # Errors
    /// If the settings are impossible or the threads cannot be started.
    pub fn new(
        train: &Dataset,
        settings: Settings,
        executor: Arc<dyn Executor>,
        threads: usize,
    ) -> Result<Evolution, RunError> {
        Evolution::on(&SharedSet::new(train), settings, executor, threads)
    }

    /// The same on a set that several runs share.
    ///
    /// # Errors
    /// As [`Evolution::new`].
    pub fn on(
        train: &SharedSet<'_>,
        settings: Settings,
        executor: Arc<dyn Executor>,
        threads: usize,
    ) -> Result<Evolution, RunError> {
        settings.validate()?;
        let creator = Creator::new(&settings.create_settings())?;
        let (cases, data) = train.training(&settings);
        Ok(Evolution {
            creator,
            variation: Variation::new(&settings)?,
            evaluator: Evaluator::new(executor, threads, cases.len(), Evolution::CACHE_BYTES)?,
            cases,
            origin: Origin { settings: settings.fingerprint(), data },
            settings,
            validation: None,
            state: None,
            folder: None,
            progress: Arc::default(),
            save_seconds: 0.0,
        })
    }

    /// The run, recorded in a folder: from its checkpoint on, if it has one, else from the beginning. The
    /// settings are those of the folder, or the same with more generations.
    ///
    /// # Errors
    /// As [`Evolution::new`]; if the settings are not the folder's, or the checkpoint cannot be used, or belongs
    /// to other data or settings.
    pub fn in_folder(
        folder: RunFolder,
        train: &Dataset,
        settings: Settings,
        executor: Arc<dyn Executor>,
        threads: usize,
    ) -> Result<Evolution, RunError> {
        Evolution::in_folder_on(folder, &SharedSet::new(train), settings, executor, threads)
    }

    /// The same on a set that several runs share.
    ///
    /// # Errors
    /// As [`Evolution::in_folder`].
    pub fn in_folder_on(
        mut folder: RunFolder,
        train: &SharedSet<'_>,
        settings: Settings,
        executor: Arc<dyn Executor>,
        threads: usize,
    ) -> Result<Evolution, RunError> {
        let mut run = Evolution::on(train, settings, executor, threads)?;
        run.state = folder.load(run.origin, &run.settings, run.cases.len())?;
        if let Some(made) = run.state.as_ref().map(|s| s.records.len() as u32)
            && made > run.settings.generations
        {
            return Err(SettingsError::FewerGenerations { made, asked: run.settings.generations }.into());
        }
        let data = train.data();
        let (width, height) = (data.width(), data.height());
        folder.set_origin(Provenance::comment(data.name(), run.settings.seed, width, height));
        folder.set_unaltered(run.cases.unaltered());
        folder.write_settings(&run.settings)?;
        folder.repair(run.state.as_ref(), Verdicts::NONE)?;
        run.folder = Some(folder);
        Ok(run)
    }

    /// Lets these cases choose the winner from the hall of fame: who solves most of them; ties go to training, then to size.
    /// They shape nothing else of the run. A run that is resumed has to be given them again.
    ///
    /// # Errors
    /// If the hall of fame there is cannot be evaluated or the folder cannot be written.
    pub fn validate_on(&mut self, data: &SharedSet<'_>) -> Result<(), RunError> {
        let mut validation = Validation::new(data.cases(self.settings.tolerance));
        if let Some(state) = &self.state {
            validation.judge(&self.evaluator, &state.hall_of_fame)?;
            if let Some(folder) = &self.folder {
                folder.repair(Some(state), validation.verdicts())?;
            }
        }
        self.validation = Some(validation);
        Ok(())
    }

    /// Bytes in which strips of columns other than the cases' own are kept, unless [`Evolution::keep_strips`] says
    /// otherwise.
    pub const STRIP_BYTES: usize = SharedSet::STRIP_BYTES;

    /// Keeps strips of columns other than the cases' own in at most about so many bytes
    /// ([`CaseSet::keep_strips`](crate::vision::CaseSet::keep_strips)), together with all runs that share its set. It
    /// changes nothing but the time.
    pub fn keep_strips(&self, bytes: usize) {
        self.cases.keep_strips(bytes);
    }

    /// Bytes for results of programs that were run, unless [`Evolution::limit_cache`] says otherwise.
    pub const CACHE_BYTES: usize = 256 << 20;

    /// Bounds the memory for results of programs that were run, and forgets those there are. It changes nothing but the time the run takes.
    pub fn limit_cache(&mut self, bytes: usize) {
        self.evaluator.limit_cache(self.cases.len(), bytes);
    }

    /// The settings.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Width and height of the training images, in pixels.
    pub fn image_size(&self) -> (u32, u32) {
        self.cases.image_size()
    }

    /// The state after the last complete generation, if there is one.
    pub fn state(&self) -> Option<&State> {
        self.state.as_ref()
    }

    /// The warning of the last complete generation, if the run has collapsed.
    pub fn warning(&self) -> Option<Warning> {
        Warning::of(&self.state.as_ref()?.records, &self.settings)
    }

    /// The folder in which the run is recorded, if it is.
    pub fn folder(&self) -> Option<&RunFolder> {
        self.folder.as_ref()
    }

    /// Counters of the running generation, to be read from another thread.
    pub fn progress(&self) -> Arc<Progress> {
        self.progress.clone()
    }

    /// Complete generations.
    pub fn generations(&self) -> u32 {
        self.state.as_ref().map_or(0, |s| s.records.len() as u32)
    }

    /// Runs until all generations are there or `stop` is set, which is looked at between individuals.
    /// `observer` is told of each generation once it is recorded.
    ///
    /// # Errors
    /// If an individual cannot be evaluated or the folder cannot be written; the run is kept as of its last
    /// complete generation.
    pub fn run(
        &mut self,
        stop: &AtomicBool,
        mut observer: impl FnMut(&Record),
    ) -> Result<StopReason, RunError> {
        while self.generations() < self.settings.generations {
            match self.step(stop)? {
                Some(record) => observer(record),
                None => {
                    self.sync()?;
                    return Ok(StopReason::Interrupted);
                }
            }
        }
        self.sync()?;
        Ok(StopReason::Finished)
    }

    /// Runs one generation and records it; `None` if `stop` was set before it was complete.
    ///
    /// # Errors
    /// As [`Evolution::run`].
    pub fn step(&mut self, stop: &AtomicBool) -> Result<Option<&Record>, RunError> {
        let start = Instant::now();
        if stop.load(Ordering::Relaxed) {
            return Ok(None);
        }
        let next = match &self.state {
            None => self.first(stop)?,
            Some(state) => self.next(state, stop)?,
        };
        let Some(next) = next else { return Ok(None) };
        let mut state = self.record(next, start);
        if let Some(validation) = &mut self.validation {
            validation.judge(&self.evaluator, &state.hall_of_fame)?;
            let winner = validation.verdicts().winner(&state.hall_of_fame).and_then(|(_, solved)| solved);
            let fitness = winner.map(CaseBits::fitness);
            state
                .records
                .iter_mut()
                .last()
                .into_iter()
                .for_each(|record| record.validation_fitness = fitness);
        }
        let saving = Instant::now();
        if let Some(folder) = &self.folder {
            folder.save(&state, self.origin, self.verdicts())?;
        }
        self.save_seconds = saving.elapsed().as_secs_f64();
        Ok(self.state.insert(state).records.last())
    }

    fn verdicts(&self) -> Verdicts<'_> {
        self.validation.as_ref().map_or(Verdicts::NONE, Validation::verdicts)
    }

    fn sync(&self) -> Result<(), FolderError> {
        self.folder.as_ref().map_or(Ok(()), RunFolder::sync)
    }

    /// The evaluation of a generation.
    fn task<'a>(&'a self, generation: u32, looks: bool, stop: &'a AtomicBool) -> Task<'a> {
        Task { cases: &self.cases, generation, looks, stop, progress: &self.progress }
    }

    /// The initial generation.
    fn first(&self, stop: &AtomicBool) -> Result<Option<Generation>, RunError> {
        let start = Instant::now();
        self.progress.begin(0, self.settings.population as usize);
        let task = self.task(0, self.settings.filter.enabled, stop);
        let mut tally = Tally::default();
        let initial = initial::create(&self.evaluator, &self.settings, &self.creator, task, &mut tally)?;
        let Some(Initial { members, draws }) = initial else { return Ok(None) };
        let evaluate = start.elapsed();
        let (evaluations, initial) = (draws.draws, Some(draws));
        Ok(Some(Generation { members, evaluations, initial, tally, evaluate, breed: Duration::ZERO }))
    }

    /// The generation after `state`.
    fn next(&self, state: &State, stop: &AtomicBool) -> Result<Option<Generation>, RunError> {
        let start = Instant::now();
        let parents = &state.population;
        let generation = state.records.len() as u32;
        let breed = || breed(parents, &self.settings, &self.variation, generation);
        let offspring = self.evaluator.threads().pool().install(breed);
        // What equals a parent or an earlier offspring needs no evaluation of its own.
        let all: Vec<&Genotype> =
            parents.iter().map(|m| &m.genotype).chain(offspring.iter().map(|o| &o.genotype)).collect();
        let firsts = Genotype::representatives(&all);
        let new: Vec<usize> = (parents.len()..all.len()).filter(|&i| firsts[i] == i).collect();
        let breed = start.elapsed();
        self.progress.begin(generation, new.len());
        let individuals: Vec<&Individual> = new.iter().map(|&i| all[i].individual()).collect();
        let mut tally = Tally::default();
        let task = self.task(generation, false, stop);
        let outcomes = self.evaluator.evaluate(&individuals, task, &mut tally)?;
        let Some(outcomes) = outcomes else { return Ok(None) };
        let evaluate = start.elapsed().saturating_sub(breed);
        let evaluations = offspring.iter().filter(|o| o.copy_of.is_none()).count() as u64;
        let outcome = |i: usize| match firsts[parents.len() + i] {
            first if first < parents.len() => parents[first].outcome.clone(),
            // `new` ascends, and holds every representative beyond the parents.
            first => outcomes[new.partition_point(|&n| n < first)].clone(),
        };
        let member = |(i, o): (usize, Offspring)| Member { genotype: o.genotype, outcome: outcome(i) };
        let members = offspring.into_iter().enumerate().map(member).collect();
        Ok(Some(Generation { members, evaluations, initial: None, tally, evaluate, breed }))
    }

    /// The state with one generation more.
    fn record(&self, new: Generation, start: Instant) -> State {
        let recording = Instant::now();
        let (mut records, mut hall_of_fame) = self
            .state
            .as_ref()
            .map_or((Vec::new(), HallOfFame::default()), |s| (s.records.clone(), s.hall_of_fame.clone()));
        let generation = records.len() as u32;
        let so_far = hall_of_fame.best().map_or(0, |e| e.correct);
        let before = records.last().map_or(0, |r: &Record| r.evaluations_total);
        let (unaltered, evaluations) = (self.cases.unaltered(), (new.evaluations, before));
        let mut record = Record::of(generation, &new.members, unaltered, so_far, evaluations, new.initial);
        for member in &new.members {
            hall_of_fame.offer(member.individual(), member.correct(), generation);
        }
        let Tally { timing, usage, executed, uncached, programs } = new.tally;
        programs.tell(&mut record);
        let (threads, evaluate) = (self.evaluator.threads().count() as f64, new.evaluate.as_secs_f64());
        // Between the shares of all threads one is at work.
        let busy = usage.work + new.evaluate.saturating_sub(usage.wall);
        record.timing = GenerationTiming {
            lower: timing.lower.as_secs_f64(),
            compile: timing.compile.as_secs_f64(),
            execute: timing.execute.as_secs_f64(),
            evaluate,
            busy: (busy.as_secs_f64() / (threads * evaluate).max(1e-9)).min(1.0),
            breed: new.breed.as_secs_f64(),
            record: recording.elapsed().as_secs_f64(),
            save: self.save_seconds,
            wall: start.elapsed().as_secs_f64(),
            executed,
            ms_per_uncached: 1e3 * uncached.as_secs_f64() / executed.max(1) as f64,
        };
        records.push(record);
        let warning = Collapse::of(&records, &self.settings, self.cases.len());
        if let Some(last) = records.last_mut() {
            last.warning = warning;
        }
        State { population: new.members, records, hall_of_fame }
    }

    /// The winner so far and how it does; `None` before the first generation is complete.
    ///
    /// # Errors
    /// If it cannot be evaluated on the held-out cases.
    pub fn summary(&self, holdout: Option<&Dataset>) -> Result<Option<Summary>, RunError> {
        let Some(state) = &self.state else { return Ok(None) };
        let Some((best, validation)) = self.verdicts().winner(&state.hall_of_fame) else { return Ok(None) };
        let all = self.evaluator.score(&best.individual, &self.cases)?.outcome.solved;
        let train = all.first(self.cases.unaltered());
        let holdout = match holdout {
            Some(data) => Some(self.solved(&best.individual, data)?),
            None => None,
        };
        Ok(Some(Summary {
            best: best.individual.clone(),
            generation: best.generation,
            train: Score::of(&train),
            augmented: (train.len() < all.len()).then(|| Score::of(&all)),
            validation: validation.map(Score::of),
            holdout: holdout.as_ref().map(Score::of),
            solved: Solved { train, validation: validation.cloned(), holdout },
            generations: self.generations(),
            evaluations: state.records.last().map_or(0, |r| r.evaluations_total),
        }))
    }

    /// Which cases of a data set an individual solves, with the run's executor and tolerance.
    ///
    /// # Errors
    /// If it cannot be evaluated.
    pub fn solved(&self, individual: &Individual, data: &Dataset) -> Result<CaseBits, RunError> {
        let cases = SharedSet::new(data).cases(self.settings.tolerance);
        Ok(self.evaluator.score(individual, &cases)?.outcome.solved)
    }

    /// How an individual does on a data set, with the run's executor and tolerance.
    ///
    /// # Errors
    /// If it cannot be evaluated.
    pub fn score(&self, individual: &Individual, data: &Dataset) -> Result<Score, RunError> {
        Ok(Score::of(&self.solved(individual, data)?))
    }
}

/// A generation just evaluated.
struct Generation {
    members: Vec<Member>,
    evaluations: u64,
    initial: Option<InitialDraws>,
    tally: Tally,
    evaluate: Duration,
    breed: Duration,
}
