//! What `vsonar report` has to evaluate the data for: scores on each part, the hall of fame, errors, rivals, commands.

use std::path::Path;
use std::sync::Arc;

use vsonar::camera::Camera;
use vsonar::dataset::{Constants, Dataset};
use vsonar::evolve::{CaseBits, Settings, is_correct};
use vsonar::exec::{Candidate, Executor};
use vsonar::explain::{ExplainError, Explanation};
use vsonar::report::page::{Answers, Command, Compiled, Look, Part, PictureRoom, ProgramText, Run};
use vsonar::support::printable::ShownPath as _;
use vsonar::tree::Individual;
use vsonar::vision::strips::CaseSet;
use vsonar::world::office::World;

use super::against::{self, Comparison, Named};
use super::cases::Cases;
use super::eval_cases::settings_of;
use super::executor::with_stack;
use super::memory::MemoryArgs;
use super::output::shell_word;
use super::program::note_interpreted;
use super::progress::Bar;
use super::source::Source;
use super::tuning::Copies;
use super::{CliError, part, summary};

/// What is to be found out beside what the folder tells.
pub(super) struct Wanted<'a> {
    /// Where the training images are now.
    pub(super) data: Option<&'a Path>,
    /// Images to test on instead of those held out.
    pub(super) holdout: Option<&'a Path>,
    /// The camera, if it is told.
    pub(super) camera: Option<Camera>,
    pub(super) rivals: bool,
    /// What the pictures of a run may take.
    pub(super) pictures: PictureRoom,
    /// Whether the program is explained.
    pub(super) explained: bool,
    pub(super) executor: Arc<dyn Executor>,
    pub(super) memory: MemoryArgs,
    pub(super) progress: &'a Bar,
}

/// The data of the last run, for the next that has the same.
#[derive(Default)]
pub(super) struct Data {
    last: Option<(toml::Table, Loaded)>,
}

/// The parts of the data, and what is prepared once for all programs.
struct Loaded {
    cases: Cases,
    sets: Vec<(Part, CaseSet)>,
}

impl Loaded {
    fn parts(&self) -> impl Iterator<Item = (Part, &Dataset)> {
        [
            (Part::Training, Some(&self.cases.train)),
            (Part::Validation, self.cases.validation.as_ref()),
            (Part::Holdout, self.cases.holdout.as_ref()),
        ]
        .into_iter()
        .filter_map(|(part, set)| Some((part, set?)))
    }
}

impl Data {
    /// Adds to a run what its data tell. Data that are gone are no error, unless it was said where they are: the run says
    /// what is missing.
    pub(super) fn fill(
        &mut self,
        run: &mut Run,
        folder: &Path,
        source: Source,
        table: &toml::Table,
        settings: &Settings,
        wanted: &Wanted,
    ) -> Result<(), CliError> {
        // Where the images are now, if they have moved.
        let source = match wanted.data {
            Some(dir) => source.with_folder(dir)?.ok_or_else(made)?,
            None => source,
        };
        if self.last.as_ref().is_none_or(|(last, _)| last != table) {
            wanted.progress.message(&format!("{}: its data", folder.shown()));
            self.last = None;
            match load(&source, table, folder, wanted) {
                Ok(cases) => self.last = Some((table.clone(), Loaded { cases, sets: Vec::new() })),
                Err(error) if wanted.data.is_some() || wanted.holdout.is_some() => return Err(error),
                Err(error) => {
                    let gone = source.folder().is_some_and(|dir| !dir.exists());
                    let moved = if gone { " (`--data DIR` says where the images are now)" } else { "" };
                    run.missing.push(format!(
                        "Scores, errors, pictures and rivals are missing, for the data cannot be had: {}{moved}.",
                        error.words()
                    ));
                }
            }
        }
        run.tested_on = wanted.holdout.map(|folder| folder.shown());
        run.commands = vec![evolve(run, folder, wanted.data)];
        let Some((_, loaded)) = self.last.as_mut() else {
            run.commands.extend(without_data(folder));
            return Ok(());
        };
        let generations = run.records.len() as u32;
        let next = summary::commands(&source, &loaded.cases, settings, generations, folder);
        run.commands.extend(next.iter().map(|line| as_command(line)));
        if wanted.data.is_none() && wanted.holdout.is_none() {
            let rivals =
                format!("vsonar eval {} --against all    # the table of the rivals", shell_word(folder));
            run.commands.insert(1, as_command(&rivals));
        }
        evaluate(run, folder, &source, loaded, wanted)
    }
}

fn made() -> CliError {
    CliError::Usage("--data: the images of this run are made when they are needed; leave it out".to_string())
}

fn load(source: &Source, table: &toml::Table, folder: &Path, wanted: &Wanted) -> Result<Cases, CliError> {
    let mut cases = source.load(wanted.memory.limit())?;
    cases.check(table, folder)?;
    if let Some(dir) = wanted.holdout {
        let set = Dataset::load_within(dir, wanted.memory.limit())?;
        if (set.width(), set.height()) != (cases.train.width(), cases.train.height()) {
            return Err(CliError::Failed(format!(
                "{}: the images have {} x {} pixels, those of the run {} x {}; give images of one size",
                dir.shown(),
                set.width(),
                set.height(),
                cases.train.width(),
                cases.train.height()
            )));
        }
        cases.holdout = Some(set);
    }
    wanted.memory.check(std::iter::once(&cases.train).chain(&cases.validation).chain(&cases.holdout))?;
    Ok(cases)
}

/// Evaluates what is in the run on its data.
fn evaluate(
    run: &mut Run,
    folder: &Path,
    source: &Source,
    loaded: &mut Loaded,
    wanted: &Wanted,
) -> Result<(), CliError> {
    if run.program.is_none() {
        return Ok(());
    }
    wanted.progress.message(&format!("{}: evaluating", folder.shown()));
    let file = super::program::file(folder)?;
    let best = Individual::load(&file)?;
    // What is held out is not looked at before the run is complete, unless it was asked for.
    let looked_at = |part: Part| part != Part::Holdout || run.is_complete() || wanted.holdout.is_some();
    if loaded.sets.is_empty() {
        let sets = loaded.parts().map(|(part, set)| (part, set.case_set())).collect();
        loaded.sets = sets;
    }
    let mut worker = wanted.executor.worker()?;
    let mut answer =
        |individual: &Individual, set: &Dataset, cases: &CaseSet| -> Result<Vec<f32>, CliError> {
            let candidate = Candidate::new(individual, set.width(), set.height());
            let mut answers = vec![0.0; set.cases().len()];
            worker.answers(&candidate, cases, &mut answers)?;
            Ok(answers)
        };
    let tolerance = run.tolerance;
    let solved = |set: &Dataset, answers: &[f32]| {
        let right = |i: usize| is_correct(answers[i], f64::from(set.cases()[i].y), tolerance);
        CaseBits::from_fn(answers.len(), right)
    };
    let constants = Constants::learn(&loaded.cases.train, tolerance);
    let parts: Vec<(Part, &Dataset, &CaseSet)> = (loaded.parts().zip(&loaded.sets))
        .filter(|((part, _), _)| looked_at(*part))
        .map(|((part, set), (_, cases))| (part, set, cases))
        .collect();
    let mut last = None;
    for &(part, set, cases) in &parts {
        let answers = answer(&best, set, cases)?;
        run.scores.push(part::Part::of(set, &solved(set, &answers), &constants).for_page(part, set));
        last = Some((part, set, answers));
    }
    for member in &mut run.hall_of_fame {
        let Ok(individual) = member.program.parse::<Individual>() else { continue };
        for &(part, set, cases) in &parts {
            let place = match part {
                Part::Training => &mut member.train,
                Part::Validation => &mut member.validation,
                Part::Holdout => &mut member.holdout,
            };
            *place = Some(solved(set, &answer(&individual, set, cases)?).fitness());
        }
    }
    let size = (loaded.cases.train.width(), loaded.cases.train.height());
    if let Some(program) = &mut run.program {
        program.compiled = Some(Compiled::of(&best, size));
    }
    if let Some((part, set, _)) = last.as_ref().filter(|_| wanted.explained) {
        wanted.progress.message(&format!("{}: explaining", folder.shown()));
        let set = (*set).clone().named(format!("the {} images", part.name()));
        match explain(&best, &set, tolerance)? {
            Ok(explanation) => {
                if let Some(program) = &mut run.program {
                    program.explanation = Some(ProgramText::of(&explanation, &best));
                }
            }
            Err(error) => run.missing.push(format!("The program is not explained: {error}.")),
        }
    }
    let Some((part, set, answers)) = last else { return Ok(()) };
    let of_world = || source.world_name().filter(|_| wanted.holdout.is_none()).map(World::camera);
    let camera = wanted.camera.or_else(of_world);
    if let Some(camera) = &camera {
        camera.check(set.width(), set.height())?;
    }
    wanted.progress.message(&format!("{}: errors and pictures", folder.shown()));
    let look = Look {
        part,
        tolerance,
        camera: camera.as_ref(),
        constants: &constants,
        window: Some(best.second().rect()),
        pictures: wanted.pictures,
    };
    run.answers = Some(Answers::of(set, &answers, &look));
    if wanted.rivals {
        wanted.progress.message(&format!("{}: tuning the rivals", folder.shown()));
        let named = |part: Part, set: &Dataset| Named { name: part.name().to_string(), set: set.clone() };
        let comparison = Comparison {
            program: Some((&file, &best)),
            executor: &*wanted.executor,
            train: &named(Part::Training, &loaded.cases.train),
            own_training: true,
            test: &named(part, set),
            tolerance,
            copies: settings_of(folder)?.as_ref().map(Copies::of).unwrap_or_default(),
        };
        run.rivals = Some(against::for_page(&comparison, part)?);
    }
    Ok(())
}

/// What the program does on these images; a listing that does not hold is none.
fn explain(
    best: &Individual,
    set: &Dataset,
    tolerance: f64,
) -> Result<Result<Explanation, ExplainError>, CliError> {
    with_stack(|| {
        let mut explanation = Explanation::new(best, set.width(), set.height())?;
        if let Some(why) = &explanation.why_interpreted {
            note_interpreted(why);
        }
        explanation.add_data(set, tolerance)?;
        Ok(explanation)
    })
}

/// The command that makes the run again.
fn evolve(run: &Run, folder: &Path, data: Option<&Path>) -> Command {
    let mut again = folder.as_os_str().to_owned();
    again.push("-again");
    Command {
        what: "The same run again: the same settings, seed and data, so the same result".to_string(),
        command: format!(
            "vsonar evolve --settings {}{} --seed {} --out {}",
            shell_word(&folder.join("settings.toml")),
            data.map_or_else(String::new, |dir| format!(" --data {}", shell_word(dir))),
            run.seed,
            shell_word(Path::new(&again))
        ),
    }
}

fn without_data(folder: &Path) -> Vec<Command> {
    let program = shell_word(&folder.join("best.gp"));
    vec![
        as_command(&format!("vsonar ir {program}    # what the compiler makes of it")),
        as_command(&format!(
            "vsonar export {program} --out {}    # native code and C for a robot",
            shell_word(&folder.join("detector"))
        )),
    ]
}

/// A command with its meaning behind it, taken apart.
fn as_command(line: &str) -> Command {
    let (command, what) = line.split_once("    # ").unwrap_or((line, ""));
    let mut letters = what.chars();
    let what = letters.next().map_or(String::new(), |first| first.to_uppercase().chain(letters).collect());
    Command { what, command: command.to_string() }
}
