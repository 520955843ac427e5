//! `vsonar evolve --runs` and `--folds`: the same run with several seeds, on data that are prepared once, and on several
//! parts of them.

use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::PoisonError;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use vsonar::dataset::{self, Constants, Dataset, Variation};
use vsonar::evolve::{CaseBits, Evolution, FolderError, RunFolder, Settings, SharedSet, StopReason};
use vsonar::report::page;
use vsonar::support::printable::ShownPath as _;

use super::cases::Cases;
use super::evolve::{Args, Plan, RUNS};
use super::evolve_watch::Page;
use super::jobs::{self, Cores};
use super::output::{self, count, grouped, shell_word};
use super::part::Part;
use super::progress::{Bar, Style};
use super::runs_report::{One, Report, Scored};
use super::source::Source;
use super::sweep::Meter;
use super::{CliError, interrupt, large};

/// A way to part the data: one of the folds, or the only one. Its cases are loaded when it is its turn, so that the
/// images of one fold are in memory at a time.
struct Fold {
    number: Option<u32>,
    source: Source,
    /// Bytes left under the limit of all memory.
    room: u64,
}

/// What is told of runs while they go on.
struct Told {
    /// Where those are that were begun, so that it can be said how to go on.
    begun: Mutex<Vec<Begun>>,
    page: Page,
}

/// A run of a fold that was begun.
struct Begun {
    fold: Option<u32>,
    seed: u64,
    path: PathBuf,
}

/// Runs with the seed of the settings and those after it, on each fold.
pub(crate) fn run(args: &Args, runs: u16) -> Result<(), CliError> {
    let Plan { source, settings, named, .. } = args.plan()?;
    let seeds: Vec<u64> = (0..u64::from(runs)).map(|i| settings.seed.saturating_add(i)).collect();
    let all: Vec<Settings> = seeds.iter().map(|&seed| Settings { seed, ..settings.clone() }).collect();
    all.iter()
        .try_for_each(Settings::validate)
        .map_err(|e| CliError::Usage(format!("--runs {runs}: {e}")))?;
    if let Some(out) = args.out.as_deref().filter(|out| out.join("settings.toml").exists()) {
        return Err(CliError::Failed(format!(
            "{}: this is the folder of one run; choose another name for several (`--out`)",
            out.shown()
        )));
    }
    let cores = Cores::new(args.jobs, args.threads, |_| 1);
    let server = args.watch.bind()?;
    let style = Style::of(args.quiet);
    let busy = Bar::spinner(style, &format!("images: {}", source.describe()));
    let folds = folds(args, &source, &all, cores)?;
    drop(busy);
    let stop = interrupt::stop_flag()?;
    let total = all.len() * folds.len();
    if style != Style::Silent && !args.json {
        let named = named.as_ref().map_or(String::new(), |file| format!(", as {} says", file.shown()));
        let folds = args
            .folds
            .map_or(String::new(), |k| format!(", each without one of {k} parts that it is tested on"));
        output::print(&format!(
            "Training on {}{named}\n{}{folds} of {} individuals and {}, seeds {} to {}, {} at a time\n",
            source.describe(),
            count(total as u64, "run"),
            grouped(settings.population.into()),
            count(settings.generations.into(), "generation"),
            settings.seed,
            seeds.last().copied().unwrap_or(settings.seed),
            cores.jobs.min(all.len()),
        ))?;
    }
    let page = args.watch.start(server, total, settings.generations)?;
    let told = Told { begun: Mutex::default(), page };
    let mut done: Vec<One> = Vec::new();
    let mut meter = Meter::start(style, total);
    for fold in &folds {
        let all_done = on_fold(args, fold, &all, cores, &stop, &told, |one| {
            let line = one.to_string();
            done.push(one);
            meter.end(&line);
            Ok(())
        });
        all_done.inspect_err(|error| told.page.broken(error))?;
    }
    drop(meter);
    done.sort_by_key(|one| (one.fold, one.seed));
    if stop.load(Ordering::Relaxed) && done.len() < total {
        let begun = told.begun.into_inner().unwrap_or_else(PoisonError::into_inner);
        let interrupted = interrupted(args, &all, total, &done, &begun);
        told.page.broken(&interrupted);
        if args.json {
            output::print_json(&Report::of(done, &source, total))?;
        }
        return Err(interrupted);
    }
    let paths: Vec<&Path> = done.iter().map(|one| one.run.as_path()).collect();
    told.page.complete(&args.out.as_deref().map_or(paths, |out| vec![out]));
    let report = Report::of(done, &source, total);
    if args.json { output::print_json(&report) } else { output::print(&report.to_string()) }
}

/// The folds. What cannot be is found before anything is run: each fits into memory, and its runs that are there already
/// can be gone on with.
fn folds(args: &Args, source: &Source, all: &[Settings], cores: Cores) -> Result<Vec<Fold>, CliError> {
    let without = |number: u32, count: u32| source.clone().without(&dataset::Part::Fold(number, count));
    let sources: Vec<(Option<u32>, Source)> = match args.folds {
        None => vec![(None, source.clone())],
        Some(count) => (1..=count).filter_map(|i| Some((Some(i), without(i, count)?))).collect(),
    };
    let variation = all.first().map_or(Variation::NONE, Settings::variation);
    let fold = |(number, source): (Option<u32>, Source)| {
        let cases = source.load(args.memory.limit())?;
        cases.check_apart()?;
        let room = args.memory.check_needs(cases.needs(&variation, cores.jobs.min(all.len())))?;
        if !args.quiet && number.is_none_or(|number| number == 1) {
            all.iter().take(1).for_each(|settings| large::note(&cases.train, settings.tolerance));
        }
        for settings in all.iter().filter(|_| args.out.is_some()) {
            let path = args.out.as_deref().map(|out| place(out, number, settings.seed));
            if let Some(path) = path.filter(|path| path.exists()) {
                goes_on(&path, settings, &cases)?;
            }
        }
        Ok(Fold { number, source, room })
    };
    sources.into_iter().map(fold).collect()
}

/// All runs of a fold, as many at a time as there are jobs.
fn on_fold(
    args: &Args,
    fold: &Fold,
    all: &[Settings],
    cores: Cores,
    stop: &AtomicBool,
    told: &Told,
    mut done: impl FnMut(One) -> Result<(), CliError>,
) -> Result<(), CliError> {
    let Fold { number, source, room } = fold;
    let cases = &source.load(args.memory.limit())?;
    let executor = args.executor.make()?;
    let table = source.to_table(cases)?;
    let strips = usize::try_from(args.strip_bytes(*room)).unwrap_or(usize::MAX);
    let share = |data| SharedSet::new(data).keep_strips(strips);
    let train = share(&cases.train);
    let (validation, holdout) = (cases.validation.as_ref().map(share), cases.holdout.as_ref().map(share));
    let name = source.name() + &number.map_or(String::new(), |fold| format!("-fold-{fold}"));
    let work = |settings: &Settings, threads: usize| -> Result<Option<One>, CliError> {
        let start = Instant::now();
        let folder = match &args.out {
            Some(out) => match place(out, *number, settings.seed) {
                path if path.exists() => goes_on(&path, settings, cases)?,
                path => RunFolder::create(&path, settings, &table)?,
            },
            None => RunFolder::create_numbered(Path::new(RUNS), &name, settings, &table)?,
        };
        let (path, made) = (folder.path().to_path_buf(), folder.made());
        let evolution = Evolution::in_folder_on(folder, &train, settings.clone(), executor.clone(), threads);
        let mut evolution = evolution.inspect_err(|_| made.take_back())?;
        validation.iter().try_for_each(|set| evolution.validate_on(set))?;
        let one = Begun { fold: *number, seed: settings.seed, path: path.clone() };
        told.begun.lock().unwrap_or_else(PoisonError::into_inner).push(one);
        let run = told.page.begin(&path, source, &evolution);
        if evolution.run(stop, |_| told.page.generation(run))? == StopReason::Interrupted {
            return Ok(None);
        }
        let Some(summary) = evolution.summary(None)? else { return Ok(None) };
        let constants = Constants::learn(&cases.train, settings.tolerance);
        let solved = match &holdout {
            Some(set) => Some(set.solved(&summary.best, executor.clone(), settings.tolerance)?),
            None => None,
        };
        let part = |of: page::Part, set: Option<&Dataset>, solved: Option<&CaseBits>| {
            Some(Part::of(set?, solved?, &constants).for_page(of, set?))
        };
        let parts = [
            part(page::Part::Training, Some(&cases.train), Some(&summary.solved.train)),
            part(page::Part::Validation, cases.validation.as_ref(), summary.solved.validation.as_ref()),
            part(page::Part::Holdout, cases.holdout.as_ref(), solved.as_ref()),
        ];
        told.page.scored(run, parts.iter().flatten().cloned().collect());
        let [train, validation, holdout] = parts.map(|part| part.map(|score| Scored::of(&score)));
        let Some(train) = train else { return Ok(None) };
        Ok(Some(One {
            fold: *number,
            seed: settings.seed,
            run: path,
            train,
            validation,
            holdout,
            nodes: summary.best.len(),
            generation: summary.generation,
            seconds: start.elapsed().as_secs_f64(),
            warning: evolution.warning(),
            next: super::summary::next(evolution.folder().map_or(Path::new(""), RunFolder::path)),
            caution: super::untested::caution(source, cases),
        }))
    };
    jobs::each(all, cores, stop, work, |_, one: One| done(one))
}

/// The folder of a run among several.
fn place(out: &Path, fold: Option<u32>, seed: u64) -> PathBuf {
    let out = fold.map_or_else(|| out.to_path_buf(), |fold| out.join(format!("fold-{fold}")));
    out.join(format!("seed-{seed}"))
}

/// A run folder that is there already, if it is of a run with these settings and data, or such a run with fewer
/// generations.
fn goes_on(path: &Path, settings: &Settings, cases: &Cases) -> Result<RunFolder, CliError> {
    let (folder, made) = RunFolder::open(path)?;
    if made.fingerprint() != settings.fingerprint() {
        return Err(FolderError::OtherSettings(path.to_path_buf()).into());
    }
    if made.generations > settings.generations {
        return Err(CliError::Usage(format!(
            "--generations: {} is a run of {} generations; ask for as many or more",
            path.shown(),
            made.generations
        )));
    }
    cases.check_all(folder.data(), path)?;
    Ok(folder)
}

fn interrupted(args: &Args, all: &[Settings], total: usize, done: &[One], begun: &[Begun]) -> CliError {
    let mut text = format!(
        "interrupted with {} of {} complete, others saved as far as they were begun; go on with",
        done.len(),
        count(total as u64, "run")
    );
    if let Some(out) = &args.out {
        let folds = args.folds.map_or(String::new(), |k| format!(" --folds {k}"));
        text += &format!(
            " the same command: vsonar evolve --runs {}{folds} --out {} ...",
            all.len(),
            shell_word(out)
        );
        return CliError::Interrupted(text);
    }
    text += ":";
    let is_done = |run: &Begun| done.iter().any(|one| one.seed == run.seed && one.fold == run.fold);
    for run in begun.iter().filter(|run| !is_done(run)) {
        text += &format!("\n  vsonar evolve --resume {}", shell_word(&run.path));
    }
    if args.folds.is_some() {
        text += "\n  (with `--out` the same command would go on with all of them)";
        return CliError::Interrupted(text);
    }
    let left: Vec<u64> =
        all.iter().map(|s| s.seed).filter(|seed| begun.iter().all(|run| run.seed != *seed)).collect();
    if let (Some(first), n) = (left.first(), left.len()) {
        text += &format!("\n  the same command with --seed {first} --runs {n}");
    }
    CliError::Interrupted(text)
}
