//! Which cases `vsonar eval` looks at, and which the rivals are tuned on: folders, or parts of a run's data.

use std::path::{Path, PathBuf};

use vsonar::dataset::{Constants, Dataset, TOLERANCE};
use vsonar::evolve::{RunFolder, Settings};

use super::CliError;
use super::against::Named;
use super::cases::Cases;
use super::eval::Args;
use super::memory::MemoryArgs;
use super::settings::SettingsFile;
use super::source::Source;
use super::tuning::Copies;
use vsonar::support::printable::ShownPath as _;

/// A part of the data of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub(super) enum RunPart {
    Train,
    Validation,
    Holdout,
}

impl RunPart {
    fn name(self) -> &'static str {
        match self {
            RunPart::Train => "training",
            RunPart::Validation => "validation",
            RunPart::Holdout => "held-out",
        }
    }
}

/// The cases that are asked about, and what counts as correct.
pub(super) struct What {
    pub(super) set: Dataset,
    pub(super) tolerance: f64,
    /// What people call the cases.
    pub(super) name: String,
    /// The training cases, if they are known and needed.
    pub(super) train: Option<Named>,
    /// The best constants of the training cases of the run whose other cases are asked about.
    pub(super) trained: Option<Constants>,
    /// The altered copies that the program's run has of its training images.
    pub(super) copies: Copies,
}

/// The folder of the run that a program is of, if it is given as its folder or is in it. Settings of something else may
/// lie beside a program.
pub(super) fn run_of(program: &Path) -> Option<PathBuf> {
    let folder = if program.is_dir() { program } else { program.parent()? };
    let settings = folder.join("settings.toml");
    let is_run = || {
        ["log.jsonl", "checkpoint"].iter().any(|name| folder.join(name).is_file())
            || RunFolder::SETTINGS.text(&settings).is_ok_and(|text| text.contains("\ntrain_fingerprint"))
    };
    (settings.is_file() && (program.is_dir() || is_run())).then(|| folder.to_path_buf())
}

/// The settings of the run that a program is of, if it is of one.
pub(super) fn settings_of(program: &Path) -> Result<Option<Settings>, CliError> {
    let read = |run: PathBuf| SettingsFile::read(&run.join("settings.toml"))?.recorded();
    run_of(program).map(read).transpose()
}

fn load(dir: &Path, pattern: Option<&String>, memory: MemoryArgs) -> Result<Dataset, CliError> {
    let set = Dataset::load_within(dir, memory.limit())?;
    Ok(match pattern {
        Some(pattern) => set.select(pattern)?,
        None => set,
    })
}

/// A folder, or those of its images that match.
fn named(dir: &Path, pattern: Option<&String>, memory: MemoryArgs) -> Result<Named, CliError> {
    let images = pattern.map(|glob| format!(", images {glob}")).unwrap_or_default();
    Ok(Named { name: format!("{}{images}", dir.shown()), set: load(dir, pattern, memory)? })
}

pub(super) fn what(args: &Args) -> Result<What, CliError> {
    let program = args.program.as_deref();
    let data = args.data.as_deref().map(|dir| named(dir, args.pattern.as_ref(), args.memory)).transpose()?;
    let tune_on = args
        .tune_on
        .as_deref()
        .map(|dir| named(dir, args.tune_on_match.as_ref(), args.memory))
        .transpose()?;
    let needs_train = args.against.is_some() && tune_on.is_none();
    let run = match &data {
        Some(_) if needs_train => program.and_then(run_of),
        Some(_) => None,
        None => {
            Some(program.filter(|program| program.is_dir()).ok_or_else(|| no_data(program))?.to_path_buf())
        }
    };
    let Some(run) = run else {
        let Some(Named { name, set }) = data else { return Err(no_data(program)) };
        // With the tolerance and without rivals nothing is wanted of the run.
        let wanted = args.tolerance.is_none() || args.against.is_some();
        let own = program.filter(|_| wanted).map(settings_of).transpose()?.flatten();
        let tolerance =
            args.tolerance.unwrap_or_else(|| own.as_ref().map_or(TOLERANCE, |settings| settings.tolerance));
        let copies = own.as_ref().map(Copies::of).unwrap_or_default();
        return Ok(What { set, name, tolerance, train: tune_on, trained: None, copies });
    };
    let (cases, settings) = cases_of_run(&run, args.memory)?;
    let tolerance = args.tolerance.unwrap_or(settings.tolerance);
    let name = |part: RunPart| images_of(part, &run);
    let train = needs_train.then(|| Named { name: name(RunPart::Train), set: cases.train.clone() });
    let (Named { name, set }, trained) = match data {
        Some(data) => (data, None),
        None => {
            let constants = Constants::learn(&cases.train, tolerance);
            let (part, set) = part_of_run(&run, cases, settings.generations, args.part)?;
            (Named { name: name(part), set }, Some(constants).filter(|_| part != RunPart::Train))
        }
    };
    let copies = Copies::of(&settings);
    Ok(What { set, name, tolerance, train: train.or(tune_on), trained, copies })
}

/// What people call a part of a run's images.
fn images_of(part: RunPart, run: &Path) -> String {
    format!("the {} images of {}", part.name(), run.shown())
}

/// Nothing says which images.
pub(super) fn no_data(program: Option<&Path>) -> CliError {
    match program {
        Some(program) if !program.exists() => CliError::Failed(format!(
            "{}: there is neither a program nor a run folder; check the path",
            program.shown()
        )),
        Some(program) => CliError::Usage(format!(
            "{} is no run folder, so `--data` has to say which images",
            program.shown()
        )),
        None => CliError::Usage("without a run folder `--data` has to say which images".to_string()),
    }
}

fn cases_of_run(run: &Path, memory: MemoryArgs) -> Result<(Cases, Settings), CliError> {
    let file = SettingsFile::read(&run.join("settings.toml"))?;
    let table = file.data().cloned().unwrap_or_default();
    let cases = Source::from_table(&table, file.path())?.load(memory.limit())?;
    cases.check(&table, run)?;
    Ok((cases, file.recorded()?))
}

/// The cases that a program is to be explained on: a folder, or a part of the data of its run.
pub(super) fn cases_of(
    program: &Path,
    data: Option<&Path>,
    pattern: Option<&String>,
    part: Option<RunPart>,
    memory: MemoryArgs,
) -> Result<Option<(Dataset, f64)>, CliError> {
    if let Some(dir) = data {
        let own = settings_of(program)?.map(|settings| settings.tolerance);
        return Ok(Some((load(dir, pattern, memory)?, own.unwrap_or(TOLERANCE))));
    }
    if !program.is_dir() {
        return Ok(None);
    }
    let (cases, settings) = cases_of_run(program, memory)?;
    let (part, set) = part_of_run(program, cases, settings.generations, part)?;
    Ok(Some((set.named(images_of(part, program)), settings.tolerance)))
}

fn part_of_run(
    run: &Path,
    cases: Cases,
    generations: u32,
    part: Option<RunPart>,
) -> Result<(RunPart, Dataset), CliError> {
    // The held-out part of a run that is not complete is not looked at by accident.
    let log = RunFolder::RECORDED.text(&run.join("log.jsonl")).unwrap_or_default();
    // A last line without its end is of a generation that was being written.
    let complete = log.matches('\n').count() >= generations as usize;
    let part =
        part.unwrap_or(if cases.holdout.is_some() && complete { RunPart::Holdout } else { RunPart::Train });
    let set = match part {
        RunPart::Train => Some(cases.train),
        RunPart::Validation => cases.validation,
        RunPart::Holdout => cases.holdout,
    };
    set.map(|set| (part, set)).ok_or_else(|| {
        CliError::Usage(format!("--part: the run {} has no such part of its data", run.shown()))
    })
}
