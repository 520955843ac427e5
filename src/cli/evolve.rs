//! `vsonar evolve`: a run from the flags to the summary.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

use vsonar::dataset::Dataset;
use vsonar::evolve::{Evolution, RunFolder, Settings, SharedSet, StopReason};
use vsonar::support::printable::ShownPath as _;

use super::cases::Cases;
use super::data_args::DataArgs;
use super::evolve_watch::WatchArgs;
use super::executor::Choice;
use super::memory::MemoryArgs;
use super::output::{self, count, grouped, shell_word};
use super::progress::{Bar, Style};
use super::settings::SettingsArgs;
use super::source::Source;
use super::summary::Report;
use super::terminal::{Look, has_unicode};
use super::view::View;
use super::{CliError, curve, evolve_runs, interrupt, large, notices};

/// The folder that run folders are made in.
pub(crate) const RUNS: &str = "runs";

const EXAMPLES: &str = "\
Examples:
  vsonar evolve
      a run on built-in images of an office; takes some ten seconds
  vsonar evolve --data photos --train-match 'run_[AB]*' --holdout-match 'run_C*'
      train on two drives, test on the third
  vsonar evolve --data photos --holdout 20% --validation 20%
      hold out the last fifth of each drive; of the rest another fifth chooses the winner
  vsonar evolve --world fmrb
      train on what a robot recorded in a synthetic office; other buildings choose the winner and test it
  vsonar evolve --data photos --preset paper --seed 3 --out runs/as-published
      the published method as it stands
  vsonar evolve --data photos --nodes -raw --trees 1 --set selection.tournament=3
      other settings
  vsonar evolve --data photos --set selection.kind=lexicase --set selection.elitism=5
      select parents by single cases, and keep the five best
  vsonar evolve --data photos --set augmentation.noise=4 --set augmentation.variants=2
      also on two altered copies of each image, not one, with noise beside other light; [augmentation] of settings.toml has more
  vsonar evolve --data photos --runs 10 --out runs/ten
      seeds 1 to 10, one after the other, and their median; the same command goes on with what was stopped
  vsonar evolve --settings runs/photos-seed-1/settings.toml --seed 2
      the same data and settings again, with another seed
  vsonar evolve --resume runs/photos-seed-1 --generations 100
      go on with a run that was stopped, or add generations
  vsonar evolve --data photos --watch --open
      curves, hall of fame and the best program in the browser, while it runs

The run folder holds best.gp (the best program so far), log.jsonl (a line a generation), hall_of_fame.jsonl, \
settings.toml (every setting in full, and the data) and the checkpoint that --resume goes on from. A run is a function of data, \
settings and seed: threads, executor and interruptions change nothing but the time it takes.";

/// Evolve a detector on labelled images
#[derive(clap::Args)]
#[command(after_help = EXAMPLES, allow_negative_numbers = true, group = clap::ArgGroup::new("several").multiple(true))]
pub(crate) struct Args {
    #[command(flatten)]
    data: DataArgs,
    #[command(flatten)]
    settings: SettingsArgs,
    /// The run folder to make [default: runs/NAME-seed-N with the next free number]; with `--runs` the folder of folders seed-N
    #[arg(long, value_name = "RUN", help_heading = "Run")]
    pub(crate) out: Option<PathBuf>,
    /// So many runs, with the seeds from `--seed` on, each in a run folder of its own [default: 1]
    ///
    /// What the images need to be prepared is done once, but for altered copies, which each run has of its own. With `--out`, runs that are in that folder already are gone on
    /// with, complete ones only shown.
    #[arg(long, value_name = "N", help_heading = "Run", group = "several", value_parser = clap::value_parser!(u16).range(1..))]
    runs: Option<u16>,
    /// Runs at a time, which share the threads [default: 1]
    #[arg(long, value_name = "N", help_heading = "Run", requires = "several", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub(crate) jobs: Option<u16>,
    /// Cross-validation: a run for each K-th of the images, trained on the others and tested on it
    ///
    /// Parts are taken as `--holdout fold:1/K` takes them.
    #[arg(
        long,
        value_name = "K",
        help_heading = "Run",
        requires = "data",
        conflicts_with_all = ["holdout", "holdout_match"],
        group = "several",
        value_parser = clap::value_parser!(u32).range(2..=1000)
    )]
    pub(crate) folds: Option<u32>,
    /// Go on with the run of this folder; accepts only more generations, threads, executor, memory, strip cache and quietness
    #[arg(
        long,
        value_name = "RUN",
        help_heading = "Run",
        conflicts_with_all = [
            "data", "world", "holdout", "train_match", "holdout_match", "validation", "validation_match", "split_by", "gap", "folds",
            "preset", "settings", "seed", "population", "trees", "tolerance", "nodes", "set", "out", "runs",
        ]
    )]
    resume: Option<PathBuf>,
    /// Threads that evaluate programs [default: one for each core]
    #[arg(long, value_name = "N", help_heading = "Run", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub(crate) threads: Option<u16>,
    /// What runs the programs; all give the same results
    #[arg(long, value_name = "NAME", help_heading = "Run", value_enum, default_value_t = Choice::Auto)]
    pub(crate) executor: Choice,
    #[command(flatten, next_help_heading = "Run")]
    pub(crate) memory: MemoryArgs,
    /// Keep windows of columns that programs choose themselves in at most this many MiB, within `--memory`; 0 keeps none
    #[arg(long, value_name = "MIB", help_heading = "Run", default_value_t = (Evolution::STRIP_BYTES >> 20) as u32)]
    strip_cache: u32,
    #[command(flatten, next_help_heading = "Run")]
    pub(crate) watch: WatchArgs,
    /// Show nothing before the summary
    #[arg(long, short, help_heading = "Run")]
    pub(crate) quiet: bool,
    /// Print the summary as JSON
    #[arg(long, help_heading = "Run")]
    pub(crate) json: bool,
}

/// What a new run is to be.
pub(crate) struct Plan {
    pub(crate) source: Source,
    pub(crate) settings: Settings,
    /// The settings file that names the source, if no flag does.
    pub(crate) named: Option<PathBuf>,
}

/// Where a run starts from.
enum Beginning<'a> {
    Fresh(Box<Plan>),
    /// The folder of a run that is not complete.
    Resumed(&'a Path),
}

/// A run ready to go.
struct Prepared {
    evolution: Evolution,
    cases: Cases,
    source: Source,
    /// The settings file that names the source, if no flag does.
    named: Option<PathBuf>,
    folder: PathBuf,
}

impl Args {
    /// Passes the limit of the strip cache on; `room` bytes are left under the limit of all memory.
    fn keep_strips(&self, evolution: &Evolution, room: u64) {
        evolution.keep_strips(usize::try_from(self.strip_bytes(room)).unwrap_or(usize::MAX));
    }

    /// The limit of the strip cache.
    pub(crate) fn strip_bytes(&self, room: u64) -> u64 {
        (u64::from(self.strip_cache) << 20).min(room)
    }

    /// A set whose strips are kept within the limit.
    fn shared<'a>(&self, set: &'a Dataset, room: u64) -> SharedSet<'a> {
        let bytes = usize::try_from(self.strip_bytes(room)).unwrap_or(usize::MAX);
        SharedSet::new(set).keep_strips(bytes)
    }

    /// Data and settings of a new run.
    pub(crate) fn plan(&self) -> Result<Plan, CliError> {
        let file = self.settings.file()?;
        let named = file.as_ref().filter(|_| !self.data.given()).and_then(|f| Some((f.data()?, f.path())));
        let source = match named {
            Some((data, path)) => Source::from_table(data, path)?.named_in(path)?,
            None => self.data.source(self.folds.is_some())?,
        };
        let small = named.is_none() && !self.data.given();
        let settings = self.settings.settings(file.as_ref(), small)?;
        Ok(Plan { source, settings, named: named.map(|(_, path)| path.to_path_buf()) })
    }
}

/// The step between reading the images and the first program.
const PREPARING: &str = "preparing the images";

/// Evolves.
pub(crate) fn run(args: Args) -> Result<(), CliError> {
    if args.runs.is_some() || args.folds.is_some() {
        return evolve_runs::run(&args, args.runs.unwrap_or(1));
    }
    let style = Style::of(args.quiet);
    // Settings may come through a pipe, which Ctrl-C has to end.
    let beginning = match &args.resume {
        Some(folder) => Beginning::Resumed(folder),
        None => Beginning::Fresh(Box::new(args.plan()?)),
    };
    let stop = interrupt::stop_flag()?;
    let server = args.watch.bind()?;
    let busy = Bar::spinner(style, "reading the settings");
    let mut prepared = match beginning {
        Beginning::Resumed(folder) => resume(&args, folder, &busy)?,
        Beginning::Fresh(plan) => fresh(&args, *plan, &busy)?,
    };
    drop(busy);
    notices::print();
    announce(&prepared, &args, style)?;
    let page = args.watch.start(server, 1, prepared.evolution.settings().generations)?;
    let run = page.begin(&prepared.folder, &prepared.source, &prepared.evolution);
    let started = Instant::now();
    let told = || page.generation(run);
    let reason = watch(&mut prepared.evolution, &prepared.cases.train, style, &stop, told);
    let reason = reason.inspect_err(|error| page.broken(error))?;
    let seconds = started.elapsed().as_secs_f64();
    let complete = reason == StopReason::Finished;
    let report =
        Report::of(&prepared.evolution, &prepared.cases, &prepared.source, &prepared.folder, seconds);
    let report = report.inspect_err(|error| page.broken(error))?;
    for report in report.iter().filter(|_| complete) {
        page.scored(run, report.for_page(&prepared.cases));
    }
    if complete {
        page.complete(&[&prepared.folder]);
    } else {
        page.broken(&interrupted(&prepared));
    }
    if let Some(report) = report {
        if args.json {
            output::print_json(&report)?;
        } else if complete {
            let screen = Look::stdout().width.filter(|_| !args.quiet);
            let records = prepared.evolution.state().map_or(&[][..], |state| &state.records);
            let curve = screen.map_or(String::new(), |width| curve::plot(records, width, has_unicode()));
            output::print(&format!("{curve}{report}"))?;
        }
    }
    if complete { Ok(()) } else { Err(interrupted(&prepared)) }
}

/// A new run. What can be wrong is found before the run folder is made.
fn fresh(args: &Args, Plan { source, settings, named }: Plan, busy: &Bar) -> Result<Prepared, CliError> {
    let executor = args.executor.make()?;
    if let Some(out) = &args.out
        && out.symlink_metadata().is_ok()
    {
        return Err(vsonar::evolve::FolderError::Exists(out.clone()).into());
    }
    busy.message(&format!("images: {}", source.describe()));
    let cases = source.load(args.memory.limit())?;
    cases.check_apart()?;
    let room = args.memory.check_needs(cases.needs(&settings.variation(), 1))?;
    if !args.quiet {
        large::note(&cases.train, settings.tolerance);
    }
    let threads = usize::from(args.threads.unwrap_or(0));
    let table = source.to_table(&cases)?;
    let folder = match &args.out {
        Some(out) => RunFolder::create(out, &settings, &table)?,
        None => RunFolder::create_numbered(Path::new(RUNS), &source.name(), &settings, &table)?,
    };
    busy.message(PREPARING);
    let (path, made) = (folder.path().to_path_buf(), folder.made());
    match Evolution::in_folder(folder, &cases.train, settings, executor, threads) {
        Ok(mut evolution) => {
            args.keep_strips(&evolution, room);
            cases.validation.iter().try_for_each(|set| evolution.validate_on(&args.shared(set, room)))?;
            Ok(Prepared { evolution, cases, source, named, folder: path })
        }
        Err(error) => {
            // Nothing was evolved, and the folder was made a moment ago: it is not left behind.
            made.take_back();
            Err(error.into())
        }
    }
}

/// A run that goes on.
fn resume(args: &Args, path: &Path, busy: &Bar) -> Result<Prepared, CliError> {
    let (folder, mut settings) = RunFolder::open(path)?;
    if let Some(generations) = args.settings.generations {
        settings = more(settings, generations)?;
    }
    let source = Source::from_table(folder.data(), &path.join("settings.toml"))?;
    let executor = args.executor.make()?;
    busy.message(&format!("images: {}", source.describe()));
    let cases = source.load(args.memory.limit())?;
    cases.check(folder.data(), path)?;
    let room = args.memory.check_needs(cases.needs(&settings.variation(), 1))?;
    let threads = usize::from(args.threads.unwrap_or(0));
    busy.message(PREPARING);
    let mut evolution = Evolution::in_folder(folder, &cases.train, settings, executor, threads)?;
    args.keep_strips(&evolution, room);
    cases.validation.iter().try_for_each(|set| evolution.validate_on(&args.shared(set, room)))?;
    Ok(Prepared { evolution, cases, source, named: None, folder: path.to_path_buf() })
}

fn more(settings: Settings, generations: u32) -> Result<Settings, CliError> {
    let settings =
        settings.extended(generations).map_err(|e| CliError::Usage(format!("--generations: {e}")))?;
    settings.validate().map_err(|e| CliError::Usage(e.to_string()))?;
    Ok(settings)
}

/// Says what is going to happen.
fn announce(run: &Prepared, args: &Args, style: Style) -> Result<(), CliError> {
    if style == Style::Silent || args.json {
        return Ok(());
    }
    let settings = run.evolution.settings();
    let done = run.evolution.generations();
    let cases = run.cases.train.cases().len() as u64;
    let again = if done == 0 {
        String::new()
    } else {
        format!(", resumed after {}", count(done.into(), "generation"))
    };
    let copies = u64::from(settings.variation().copies()) * run.cases.train.images().len() as u64;
    let altered = match copies {
        0 => String::new(),
        copies => format!(", and {} altered copies of them", grouped(copies)),
    };
    let named = run.named.as_ref().map_or(String::new(), |file| format!(", as {} says", file.shown()));
    let left_out = match run.cases.left_out as u64 {
        0 => String::new(),
        images => format!("; {} beside a cut in no part", count(images, "image")),
    };
    output::print(&format!(
        "Training on {}{named} ({} in {} of {} x {} pixels{altered}{left_out})\n{} individuals, {}, seed {}{again}; recorded in {}\n",
        run.source.describe(),
        count(cases, "case"),
        count(run.cases.train.images().len() as u64, "image"),
        run.cases.train.width(),
        run.cases.train.height(),
        grouped(settings.population.into()),
        count(settings.generations.into(), "generation"),
        settings.seed,
        run.folder.shown()
    ))
}

/// Runs and shows it; `told` is called after each generation.
fn watch(
    evolution: &mut Evolution,
    train: &Dataset,
    style: Style,
    stop: &Arc<AtomicBool>,
    told: impl Fn(),
) -> Result<StopReason, CliError> {
    let mut view = View::start(style, evolution, evolution.settings().generations, train);
    Ok(evolution.run(stop, |record| {
        told();
        view.generation(record);
        view.warn();
    })?)
}

fn interrupted(run: &Prepared) -> CliError {
    let done = run.evolution.generations();
    let saved = match done {
        0 => "before the first generation was complete".to_string(),
        _ => format!("with {} of {} generations saved", done, run.evolution.settings().generations),
    };
    CliError::Interrupted(format!(
        "interrupted {saved}; go on with:\n  vsonar evolve --resume {}",
        shell_word(&run.folder)
    ))
}
