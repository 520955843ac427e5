//! `vsonar sweep`: settings and seeds as a grid of runs, which can be interrupted, and what they come to.

mod cells;
mod recorded;
mod report;
mod results;
mod row;
mod runs;
pub(crate) mod seeds;
mod settings;
mod spec;
mod view;

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;

use vsonar::evolve::{Evolution, Lock, SharedSet};
use vsonar::support::temporary;

use super::cases::Cases;
use super::executor::Choice;
use super::jobs::{self, Cores};
use super::memory::MemoryArgs;
use super::output::{self, count, shell_word, write_file};
use super::progress::{Bar, Style};
use super::{CliError, interrupt, notices};
use cells::{Grid, Work};
pub(crate) use report::between;
use report::{OfData, Report};
use results::Results;
use row::Row;
use runs::On;
use spec::Spec;
pub(crate) use view::Meter;
use vsonar::support::printable::ShownPath as _;

/// The copy of the file in the folder of results.
const COPY: &str = "spec.toml";

/// The folder that folders of results are made in.
const SWEEPS: &str = "sweeps";

const EXAMPLES: &str = "\
Examples:
  vsonar sweep examples/sweeps/quick.toml
      a few settings on the built-in corridor; takes half a minute
  vsonar sweep examples/sweeps/ablation.toml --data corridor=photos --seeds 1-30
      the same experiment on images of your own, with thirty seeds
  vsonar sweep selection.toml --only default,lexicase --jobs 1
      two of the settings, one run at a time on all cores
  vsonar sweep selection.toml --test
      the winners on the held-out images; runs that are there already are not made again
  vsonar sweep selection.toml --dry-run
      what would be run

A file has `title`, `seeds` (\"1-10\"), `baseline` (the setting that the others are compared with), `preset` and \
`test = true`; tables [[data]] with a name and [data.folder] (`train`, `train_match`, `holdout`, `holdout_match`; paths count \
from the file) or [data.world] (`name`) or [data.synthetic]; [settings] for all; tables [[setting]] with a name and any keys of settings.toml, `preset`, \
and `edit_nodes` (as `--nodes`); and [grid], whose axes are lists of values: \"selection.tournament\" = [3, 7].

The folder of results holds results.csv, a row for each run, spec.toml, and settings/ with all fields of each setting. A run that has its row there is not made \
again, so a sweep that was stopped goes on with the same command.";

/// Run settings and seeds as a grid, and compare them
///
/// The held-out part of the data is looked at only if `--test` (or the file) says so: choose settings without it.
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    /// What to run, as TOML
    #[arg(value_name = "SPEC")]
    spec: PathBuf,
    /// The folder of results, made if need be [default: sweeps/NAME of the file]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// The folder of the images of a data set, in the place of the one that the file names; repeatable
    #[arg(long, value_name = "NAME=DIR")]
    data: Vec<String>,
    /// Seeds instead of those of the file, e.g. 1-30 or 1-5,9
    #[arg(long, value_name = "SEEDS")]
    seeds: Option<String>,
    /// Only settings of these names, which commas may part; repeatable
    #[arg(long, value_name = "SETTING")]
    only: Vec<String>,
    /// Evaluate the winners on the held-out cases too
    #[arg(long)]
    test: bool,
    /// Runs at a time, which share the threads [default: one for each thread]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    jobs: Option<u16>,
    /// Threads of all runs together [default: one for each core]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// What runs the programs; all give the same results
    #[arg(long, value_name = "NAME", value_enum, default_value_t = Choice::Auto)]
    executor: Choice,
    #[command(flatten)]
    memory: MemoryArgs,
    /// Keep windows of columns that programs choose themselves in at most this many MiB, within `--memory`; 0 keeps none
    #[arg(long, value_name = "MIB", default_value_t = (SharedSet::STRIP_BYTES >> 20) as u32)]
    strip_cache: u32,
    /// Say what would be run, and run nothing
    #[arg(long)]
    dry_run: bool,
    /// Show nothing before the tables
    #[arg(long, short)]
    quiet: bool,
    /// Print the tables as JSON
    #[arg(long)]
    json: bool,
}

/// Runs a sweep.
pub(crate) fn run(args: Args) -> Result<(), CliError> {
    let mut spec = Spec::read(&args.spec)?;
    adjust(&mut spec, &args)?;
    let grid = Grid::new(&spec, &args.only)?;
    let folder = match &args.out {
        Some(out) => out.clone(),
        None => Path::new(SWEEPS).join(spec.stem()),
    };
    let results = Results::read(&folder)?;
    grid.check_settings(&results)?;
    if args.dry_run {
        return grid.list(&results, &folder, args.json);
    }
    spec.data.iter().try_for_each(there)?;
    let style = Style::of(args.quiet);
    let busy = Bar::spinner(style, "preparing the images");
    let sets: Vec<Cases> = spec.data.iter().map(|data| load(data, args.memory)).collect::<Result<_, _>>()?;
    grid.check_data(&results, &sets)?;
    let executor = args.executor.make()?;
    let cores = Cores::new(args.jobs, args.threads, |threads| threads);
    let rooms: Vec<u64> = sets
        .iter()
        .map(|cases| args.memory.check_needs(grid.needs(cases, cores)))
        .collect::<Result<_, _>>()?;
    if !Results::are_in(&folder) {
        for path in [COPY, recorded::FOLDER].map(|name| folder.join(name)) {
            if path.symlink_metadata().is_ok() {
                let text = "is there, and the folder is not that of a sweep, which would write it; choose another `--out`";
                return Err(CliError::Failed(format!("{}: {text}", path.shown())));
            }
        }
    }
    fs::create_dir_all(&folder).map_err(|e| CliError::file(&folder, "make the folder", &e))?;
    let lock = Lock::take(&folder).map_err(|e| CliError::file(&folder, "lock the folder", &e))?;
    let Some(_lock) = lock else {
        let text =
            "another process is writing this folder; wait until it has ended, or choose another `--out`";
        return Err(CliError::Failed(format!("{}: {text}", folder.shown())));
    };
    temporary::clear_in(&folder, |name| [Results::NAME, COPY].contains(&name));
    // Again, now that nobody else writes it.
    let mut results = Results::read(&folder)?;
    grid.check_settings(&results)?;
    grid.check_data(&results, &sets)?;
    write_file(&folder.join(COPY), spec.text.as_bytes())?;
    recorded::write(&folder, grid.asked())?;
    notices::print();
    let stop = interrupt::stop_flag()?;
    let work = grid.work(&results);
    drop(busy);
    announce(&grid, &results, &work, &folder, cores, &args, style)?;
    let path = results.path().to_path_buf();
    let mut meter = Meter::start(style, work.len());
    for (number, cases) in sets.iter().enumerate() {
        let work: Vec<&Work> = work.iter().filter(|work| work.cell().data == number).collect();
        let cores = cores.for_runs(work.len());
        let strips = (u64::from(args.strip_cache) << 20).min(rooms[number]);
        let strips = usize::try_from(strips).unwrap_or(usize::MAX);
        // The jobs and what they share stay within it together.
        let strips = strips / grid.strip_caches(cores);
        let share = |data| SharedSet::new(data).keep_strips(strips);
        let on = On {
            grid: &grid,
            train: share(&cases.train),
            validation: cases.validation.as_ref().map(share),
            holdout: cases.holdout.as_ref().map(share),
            executor: &executor,
            results: &path,
            cache: Evolution::CACHE_BYTES / cores.jobs,
            stop: &stop,
        };
        let made = jobs::each_watched(
            &work,
            cores,
            &stop,
            |work, threads| on.work(work, threads),
            |ended: Option<(_, Row)>| {
                let Some((_, row)) = ended else { return results.write_at_times(|row| grid.rank(row)) };
                let line = report::line(&row, grid.spec.test);
                results.put(row);
                results.write_at_times(|row| grid.rank(row))?;
                meter.end(&line);
                Ok(())
            },
        );
        // However it ended, what was made is kept.
        let written = results.write(|row| grid.rank(row));
        made.and(written)?;
    }
    drop(meter);
    if stop.load(Ordering::Relaxed) {
        return Err(interrupted(&grid, &results, &args));
    }
    let report = tables(&grid, &results);
    if args.json {
        return output::print_json(&report);
    }
    output::print(&report.to_string())?;
    output::print(&format!("\nEvery run is a row of {}\n", results.path().shown()))?;
    if !grid.spec.test && sets.iter().any(|cases| cases.holdout.is_some()) {
        output::print("The held-out cases were not looked at; `--test` evaluates the winners on them.\n")?;
    }
    Ok(())
}

/// What the flags change.
fn adjust(spec: &mut Spec, args: &Args) -> Result<(), CliError> {
    spec.test |= args.test;
    if let Some(seeds) = &args.seeds {
        spec.seeds = seeds::of_text(seeds).map_err(|e| CliError::Usage(format!("--seeds: {e}")))?;
    }
    for assignment in &args.data {
        let usage = |text: String| CliError::Usage(format!("--data {assignment}: {text}"));
        let (name, dir) = assignment.split_once('=').ok_or_else(|| {
            usage("write it as NAME=DIR, with the name of a data set of the file".to_string())
        })?;
        let names = || spec.data.iter().map(|data| data.name.as_str()).collect::<Vec<_>>().join(", ");
        let Some(number) = spec.data.iter().position(|data| data.name == name) else {
            return Err(usage(format!("{} has no data set `{name}`, but {}", spec.path.shown(), names())));
        };
        let source = spec.data[number].source.clone().with_folder(Path::new(dir))?;
        spec.data[number].source =
            source.ok_or_else(|| usage(format!("the data set `{name}` is built in, and has no folder")))?;
    }
    Ok(())
}

/// Whether the folder of a data set is there.
fn there(data: &spec::DataSet) -> Result<(), CliError> {
    match data.source.folder() {
        Some(folder) if !folder.is_dir() => Err(CliError::Failed(format!(
            "{}: there is no such folder; the images of the data set `{name}` are not part of the file: name yours with \
             `--data {name}=DIR`",
            output::from_here(folder).shown(),
            name = data.name
        ))),
        _ => Ok(()),
    }
}

/// The cases of a data set.
fn load(data: &spec::DataSet, memory: MemoryArgs) -> Result<Cases, CliError> {
    let of = |text: String| format!("{}: data set `{}`: {text}", data.place, data.name);
    let apart = |cases: Cases| cases.check_apart().map(|()| cases);
    data.source.load(memory.limit()).and_then(apart).map_err(|error| match error {
        CliError::Failed(text) => CliError::Failed(of(text)),
        CliError::Usage(text) => CliError::Usage(of(text)),
        other => other,
    })
}

/// Says what is going to happen.
fn announce(
    grid: &Grid<'_>,
    results: &Results,
    work: &[Work],
    folder: &Path,
    cores: Cores,
    args: &Args,
    style: Style,
) -> Result<(), CliError> {
    if results.torn {
        let path = results.path().shown();
        output::say(&format!("note: {path}: the last row was torn; its run is made again"));
    }
    if style == Style::Silent || args.json {
        return Ok(());
    }
    let there = grid.cells.len() - work.iter().filter(|work| matches!(work, Work::Run(_))).count();
    let there = if there > 0 { format!(", {there} of them there already") } else { String::new() };
    output::print(&format!(
        "{}{}{there}; {} at a time, recorded in {}\n",
        grid.spec.title.as_ref().map_or(String::new(), |title| format!("{title}\n")),
        count(grid.cells.len() as u64, "run"),
        cores.for_runs(work.len()).jobs,
        folder.shown()
    ))
}

/// What is known so far.
fn tables(grid: &Grid<'_>, results: &Results) -> Report {
    let spec = grid.spec;
    let rows: Vec<&Row> = results.rows.iter().filter(|row| grid.is_shown(row)).collect();
    let names: Vec<&str> = spec.settings.iter().map(|setting| setting.name.as_str()).collect();
    let of = |data: &spec::DataSet| OfData::new(&data.name, &names, spec.baseline, &rows, spec.test);
    Report {
        title: spec.title.clone(),
        results: results.path().to_path_buf(),
        runs: rows.len(),
        complete: grid.work(results).is_empty(),
        test: spec.test,
        data: spec.data.iter().map(of).collect(),
    }
}

fn interrupted(grid: &Grid<'_>, results: &Results, args: &Args) -> CliError {
    let left = grid.work(results).iter().filter(|work| matches!(work, Work::Run(_))).count();
    let all = grid.cells.len();
    CliError::Interrupted(format!(
        "interrupted with {} of {all} runs saved in {}; go on with the same command: vsonar sweep {} ...",
        all - left,
        results.path().shown(),
        shell_word(&args.spec)
    ))
}
