//! `vsonar evolve --runs`: the same run with several seeds, on data that are prepared once.

use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::PoisonError;
use std::sync::atomic::Ordering;
use std::time::Instant;

use serde::Serialize;
use vsonar::evolve::{Evolution, FolderError, RunFolder, Score, Settings, SharedSet, StopReason};
use vsonar::statistics::Quartiles;

use super::evolve::{Args, Plan, RUNS};
use super::jobs::{self, Cores};
use super::memory::Need;
use super::output::{self, count, grouped, percent, shell_word};
use super::source::{Cases, Source};
use super::sweep::{Meter, between};
use super::table::Table;
use super::view::Style;
use super::{CliError, interrupt, summary};

/// How a run did on a part of the data.
#[derive(Debug, Clone, Copy, Serialize)]
struct Part {
    fitness: f64,
    correct: u32,
    cases: u32,
}

impl From<Score> for Part {
    fn from(Score { correct, cases, fitness }: Score) -> Part {
        Part { fitness, correct, cases }
    }
}

/// A run that is complete.
#[derive(Debug, Clone, Serialize)]
struct One {
    seed: u64,
    run: PathBuf,
    train: Part,
    holdout: Option<Part>,
    nodes: usize,
    generation: u32,
    seconds: f64,
}

/// All runs, as text and as JSON.
#[derive(Debug, Serialize)]
struct Report {
    runs: Vec<One>,
    train: Option<Quartiles>,
    holdout: Option<Quartiles>,
    /// The folder of the run that is best on the training cases.
    best: Option<PathBuf>,
    #[serde(skip)]
    next: Vec<String>,
}

/// Runs with the seed of the settings and those after it.
pub(crate) fn run(args: &Args, runs: u16) -> Result<(), CliError> {
    let Plan { source, settings, named, .. } = args.plan()?;
    let executor = args.executor.make()?;
    let seeds: Vec<u64> = (0..u64::from(runs)).map(|i| settings.seed.saturating_add(i)).collect();
    let all: Vec<Settings> = seeds.iter().map(|&seed| Settings { seed, ..settings.clone() }).collect();
    all.iter()
        .try_for_each(Settings::validate)
        .map_err(|e| CliError::Usage(format!("--runs {runs}: {e}")))?;
    let cases = source.load()?;
    let cores = Cores::new(args.jobs, args.threads, |_| 1);
    let variation = settings.variation();
    let mut needs: Vec<Need> = std::iter::once(&cases.train).chain(&cases.holdout).map(Need::of).collect();
    if variation.copies() > 0 {
        needs.extend((0..cores.jobs).map(|_| Need::grown(&cases.train, &variation)));
    }
    let room = args.memory.check_needs(needs)?;
    let table = source.to_table(&cases)?;
    if let Some(out) = &args.out {
        // Those that are there are gone on with; what cannot be is found before anything is run.
        for settings in &all {
            let path = of_seed(out, settings.seed);
            if path.exists() {
                goes_on(&path, settings, &cases)?;
            }
        }
    }
    let strips = usize::try_from(args.strip_bytes(room)).unwrap_or(usize::MAX);
    let train = SharedSet::new(&cases.train).keep_strips(strips);
    let holdout = cases.holdout.as_ref().map(|set| SharedSet::new(set).keep_strips(strips));
    let stop = interrupt::stop_flag()?;
    let style = Style::of(args.quiet, args.json);
    if style != Style::Silent && !args.json {
        let named = named.as_ref().map_or(String::new(), |file| format!(", as {} says", file.display()));
        output::print(&format!(
            "Training on {}{named}\n{} of {} individuals and {}, seeds {} to {}, {} at a time\n",
            source.describe(),
            count(runs.into(), "run"),
            grouped(settings.population.into()),
            count(settings.generations.into(), "generation"),
            settings.seed,
            seeds.last().copied().unwrap_or(settings.seed),
            cores.jobs.min(runs.into()),
        ))?;
    }
    // Where the runs are that were begun, so that it can be said how to go on.
    let begun: Mutex<Vec<(u64, PathBuf)>> = Mutex::default();
    let work = |settings: &Settings, threads: usize| -> Result<Option<One>, CliError> {
        let start = Instant::now();
        let folder = match &args.out {
            Some(out) => match of_seed(out, settings.seed) {
                path if path.exists() => goes_on(&path, settings, &cases)?,
                path => RunFolder::create(&path, settings, &table)?,
            },
            None => RunFolder::create_numbered(Path::new(RUNS), &source.name(), settings, &table)?,
        };
        let (path, made) = (folder.path().to_path_buf(), folder.made());
        let evolution = Evolution::in_folder_on(folder, &train, settings.clone(), executor.clone(), threads);
        let mut evolution = evolution.inspect_err(|_| made.take_back())?;
        begun.lock().unwrap_or_else(PoisonError::into_inner).push((settings.seed, path.clone()));
        if evolution.run(&stop, |_| ())? == StopReason::Interrupted {
            return Ok(None);
        }
        let Some(summary) = evolution.summary(None)? else { return Ok(None) };
        let score = |set: &SharedSet<'_>| set.score(&summary.best, executor.clone(), settings.tolerance);
        Ok(Some(One {
            seed: settings.seed,
            run: path,
            train: summary.train.into(),
            holdout: holdout.as_ref().map(score).transpose()?.map(Part::from),
            nodes: summary.best.len(),
            generation: summary.generation,
            seconds: start.elapsed().as_secs_f64(),
        }))
    };
    let mut done: Vec<One> = Vec::new();
    let mut meter = Meter::start(style, all.len());
    jobs::each(&all, cores, &stop, work, |_, one: One| {
        let line = one.to_string();
        done.push(one);
        meter.end(&line)
    })?;
    drop(meter);
    if stop.load(Ordering::Relaxed) {
        let begun = begun.into_inner().unwrap_or_else(PoisonError::into_inner);
        return Err(interrupted(args, &all, &done, &begun));
    }
    done.sort_by_key(|one| one.seed);
    let report = Report::of(done, &source, &settings);
    if args.json { output::print_json(&report) } else { output::print(&report.to_string()) }
}

/// The folder of a run among several.
fn of_seed(out: &Path, seed: u64) -> PathBuf {
    out.join(format!("seed-{seed}"))
}

/// A run folder that is there already, if it is of a run with these settings and data, or such a run with fewer
/// generations.
fn goes_on(path: &Path, settings: &Settings, cases: &Cases) -> Result<RunFolder, CliError> {
    let (folder, made) = RunFolder::open(path)?;
    if made.fingerprint() != settings.fingerprint() {
        return Err(FolderError::OtherSettings(path.to_path_buf()).into());
    }
    cases.check_holdout(folder.data(), path)?;
    Ok(folder)
}

fn interrupted(args: &Args, all: &[Settings], done: &[One], begun: &[(u64, PathBuf)]) -> CliError {
    let mut text = format!(
        "interrupted with {} of {} complete and the others saved; go on with",
        done.len(),
        count(all.len() as u64, "run")
    );
    if let Some(out) = &args.out {
        text +=
            &format!(" the same command: vsonar evolve --runs {} --out {} ...", all.len(), shell_word(out));
        return CliError::Interrupted(text);
    }
    text += ":";
    for (_, run) in begun.iter().filter(|(seed, _)| done.iter().all(|one| one.seed != *seed)) {
        text += &format!("\n  vsonar evolve --resume {}", shell_word(run));
    }
    let left: Vec<u64> =
        all.iter().map(|s| s.seed).filter(|seed| begun.iter().all(|(other, _)| other != seed)).collect();
    if let (Some(first), n) = (left.first(), left.len()) {
        text += &format!("\n  the same command with --seed {first} --runs {n}");
    }
    CliError::Interrupted(text)
}

impl fmt::Display for One {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "seed {}: training {}", self.seed, percent(self.train.fitness))?;
        self.holdout.iter().try_for_each(|part| write!(f, ", held out {}", percent(part.fitness)))?;
        write!(f, " ({})", output::duration(self.seconds))
    }
}

impl Report {
    fn of(runs: Vec<One>, source: &Source, settings: &Settings) -> Report {
        let holdout: Vec<f64> = runs.iter().filter_map(|one| Some(one.holdout?.fitness)).collect();
        // The held-out cases have no say in it.
        let best = runs.iter().min_by(|a, b| {
            (b.train.fitness.total_cmp(&a.train.fitness))
                .then(a.nodes.cmp(&b.nodes))
                .then(a.seed.cmp(&b.seed))
        });
        let next = best.map(|one| {
            let settings = Settings { seed: one.seed, ..settings.clone() };
            summary::next(source, &settings, settings.generations, &one.run)
        });
        Report {
            train: Quartiles::of(&runs.iter().map(|one| one.train.fitness).collect::<Vec<_>>()),
            holdout: Quartiles::of(&holdout),
            best: best.map(|one| one.run.clone()),
            next: next.unwrap_or_default(),
            runs,
        }
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let parts: &[&str] = if self.holdout.is_some() { &["training", "held out"] } else { &["training"] };
        let mut table = Table::new(1, &[&["seed"], parts, &["nodes", "seconds", "run"]].concat());
        for one in &self.runs {
            let scores = std::iter::once(one.train).chain(one.holdout).map(|part| percent(part.fitness));
            let rest =
                [grouped(one.nodes as u64), format!("{:.1}", one.seconds), one.run.display().to_string()];
            table.row(std::iter::once(one.seed.to_string()).chain(scores).chain(rest));
        }
        let mut row = |name: &str, of: &dyn Fn(Quartiles) -> String| {
            table.row(
                std::iter::once(name.to_string())
                    .chain([self.train, self.holdout].into_iter().flatten().map(of)),
            );
        };
        row("median", &|q| percent(q.median));
        row("quartiles", &between);
        row("best", &|q| percent(q.max));
        writeln!(f, "\n{table}")?;
        if let Some(best) = &self.best {
            writeln!(f, "The best on the training cases: {}\n\nNext:", best.display())?;
        }
        self.next.iter().try_for_each(|command| writeln!(f, "  {command}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_best_is_chosen_by_training() {
        let part = |correct: u32| Part { fitness: f64::from(correct) / 10.0, correct, cases: 10 };
        let one = |seed: u64, train: u32, holdout: u32, nodes| One {
            seed,
            run: format!("runs/{seed}").into(),
            train: part(train),
            holdout: Some(part(holdout)),
            nodes,
            generation: 1,
            seconds: 1.0,
        };
        let source = Source::Synthetic(toml::from_str("").expect("all fields have defaults"));
        let runs = vec![one(1, 7, 9, 9), one(2, 8, 1, 30), one(3, 8, 2, 20), one(4, 8, 8, 20)];
        let report = Report::of(runs, &source, &Settings::paper());
        assert_eq!(report.best.as_deref(), Some(Path::new("runs/3")), "fewer nodes, then the first");
        assert!(report.next.iter().any(|command| command.contains("runs/3/best.gp")), "{:?}", report.next);
        let text = report.to_string();
        for part in ["80.0 %", "77.5 to 80.0", "median", "held out"] {
            assert!(text.contains(part), "{part}: {text}");
        }
    }
}
