//! `vsonar bench`: the executors of this machine against each other.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use clap::ValueEnum;
use vsonar::benchmark::{
    self, BenchError, DataReport, Fresh, GenerationReport, Machine, Measured, Plan, PlotSeries, PointReport,
    Report, ScalingReport, SettingsReport, Step, even_sample, measure,
};
use vsonar::dataset::Dataset;
use vsonar::evolve::Settings;
use vsonar::exec::Executor;
use vsonar::tree::Individual;
use vsonar::vision::CaseSet;
use vsonar::world::{Corridor, FRAMES};

use super::bench_population::individuals;
use super::bench_tables::text;
use super::bench_view::Meter;
use super::executor::{Choice, with_stack};
use super::memory::MemoryArgs;
use super::output::{self, count};
use super::progress::{Bar, Style};
use super::settings::PresetName;
use super::source_made::BUILDING;
use super::{CliError, interrupt};

/// Numbers of cases that time is measured against, where the set has as many; and all of them.
const CASES: [usize; 4] = [32, 64, 128, 256];

const EXAMPLES: &str = "\
Examples:
  vsonar bench
      every executor, on individuals evolved on the built-in corridor; some minutes
  vsonar bench --data photos --plot bench.svg --out bench.json
      on images of your own, with a plot and everything that was measured
  vsonar bench --executors cranelift,tree --generations 0,50 --sample 1000 --rounds 9
      two executors, more closely

Measured are fresh individuals: those whose optimised program no earlier individual of the run had. They are kept \
(--store) and found again by data, settings, seed and generation, so that everyone measures the same. The executors \
take turns on one thread; all their answers are held against the tree walker's, and a difference is an error. \
`reference` and `tree` are slow: they are measured in 3 rounds and on every 4th individual, and the table says so; \
break-evens are of individuals that both executors ran. Close other programs: the rounds' spread tells how quiet it was.";

/// Compare the executors of this machine: compile time, execution time, break-even
#[derive(clap::Args)]
#[command(after_help = EXAMPLES, allow_negative_numbers = true)]
pub(crate) struct Args {
    /// Folder with `labels.csv` and the images it names [default: the built-in synthetic corridor]
    #[arg(long, value_name = "DIR", help_heading = "Individuals")]
    data: Option<PathBuf>,
    /// Only the images whose names match this pattern, e.g. 'run_C*'
    #[arg(
        long = "match",
        value_name = "GLOB",
        alias = "train-match",
        requires = "data",
        help_heading = "Individuals"
    )]
    pattern: Option<String>,
    /// The settings they are evolved with
    #[arg(long, value_name = "NAME", default_value = "default", help_heading = "Individuals")]
    preset: PresetName,
    /// Seed of the run that they are from
    #[arg(long, value_name = "N", default_value_t = 1, help_heading = "Individuals")]
    seed: u64,
    /// Individuals in a generation of that run
    #[arg(long, value_name = "N", default_value_t = 2000, help_heading = "Individuals")]
    population: u32,
    /// Generations that are measured, with commas between them; the initial one is 0
    #[arg(long, value_name = "LIST", default_value = "0,10,30", value_delimiter = ',', help_heading = "Individuals",
        value_parser = clap::value_parser!(u32).range(..100_000))]
    generations: Vec<u32>,
    /// Individuals measured of each generation, evenly chosen from the fresh ones
    #[arg(long, value_name = "N", default_value_t = 200, value_parser = clap::value_parser!(u32).range(1..),
        help_heading = "Individuals")]
    sample: u32,
    /// Folder in which evolved individuals are kept and looked for
    #[arg(long, value_name = "DIR", default_value = "bench-populations", help_heading = "Individuals")]
    store: PathBuf,
    /// Executors, with commas between them [default: all that run on this machine]
    #[arg(long, value_name = "LIST", value_enum, value_delimiter = ',', help_heading = "Measurement")]
    executors: Vec<Choice>,
    /// Rounds in which the executors take turns
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..=10_000),
        help_heading = "Measurement")]
    rounds: u32,
    /// Numbers of fitness cases that time is measured against; `all` is the whole set [default: 32,64,128,256,all as
    /// far as there are as many]
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = case_count, help_heading = "Measurement")]
    cases: Vec<CaseCount>,
    #[command(flatten, next_help_heading = "Measurement")]
    memory: MemoryArgs,
    /// Plot time against program size and number of cases, as .svg or .png; repeatable. It shows the executors asked for by
    /// name, else those that one chooses between: no widths of vectors, and of the slow ones `tree` alone
    #[arg(long, value_name = "FILE", value_parser = plot_file, help_heading = "Output")]
    plot: Vec<Plot>,
    /// Write everything that was measured to this file, as JSON
    #[arg(long, value_name = "FILE", help_heading = "Output")]
    out: Option<PathBuf>,
    /// Print JSON instead of the tables
    #[arg(long, help_heading = "Output")]
    json: bool,
    /// Show nothing before the tables
    #[arg(long, short, help_heading = "Output")]
    quiet: bool,
}

/// A number of cases as it is asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum CaseCount {
    Number(usize),
    All,
}

fn case_count(text: &str) -> Result<CaseCount, String> {
    match (text, text.parse()) {
        ("all", _) => Ok(CaseCount::All),
        (_, Ok(number)) if number > 0 => Ok(CaseCount::Number(number)),
        _ => Err("give numbers from 1 on, or `all`".to_string()),
    }
}

/// A picture to be drawn.
#[derive(Debug, Clone)]
struct Plot {
    file: PathBuf,
    draw: fn(&Report, PlotSeries) -> Result<Vec<u8>, benchmark::PlotError>,
}

fn plot_file(text: &str) -> Result<Plot, String> {
    let file = PathBuf::from(text);
    let extension = file.extension().map(|e| e.to_string_lossy().to_lowercase());
    match extension.as_deref() {
        Some("svg") => {
            Ok(Plot { file, draw: |report, series| Ok(benchmark::svg(report, series)?.into_bytes()) })
        }
        Some("png") => Ok(Plot { file, draw: benchmark::png }),
        _ => Err("the name must end in .svg or .png".to_string()),
    }
}

/// Measures and reports.
pub(crate) fn run(mut args: Args) -> Result<(), CliError> {
    args.generations.sort_unstable();
    args.generations.dedup();
    let style = Style::of(args.quiet);
    let settings = settings(&args)?;
    let stop = interrupt::stop_flag()?;
    let executors = executors(&args)?;
    let busy = Bar::spinner(style, "preparing the images");
    let data = data(&args)?;
    drop(busy);
    let counts = case_counts(&args.cases, data.cases().len())?;
    args.memory.check([&data])?;
    let fresh = individuals(&args.store, &args.generations, &data, &settings, &stop, style)?;
    let bench = Bench { args: &args, executors: &executors, stop: &stop };
    let meter = Meter::start(style, (fresh.len() + counts.len()) as u64 * (2 + u64::from(args.rounds)));
    // The walker recurses, and one thread of its own does nothing but measure.
    let (generations, scaling) = with_stack(|| bench.measure(&data, &fresh, &counts, &meter))??;
    drop(meter);
    let report = Report {
        version: benchmark::VERSION,
        vsonar: env!("CARGO_PKG_VERSION"),
        machine: Machine::this(),
        data: DataReport {
            name: data.name().to_string(),
            fingerprint: format!("{:016x}", data.fingerprint()),
            images: data.images().len(),
            cases: data.cases().len(),
            width: data.width(),
            height: data.height(),
        },
        settings: SettingsReport {
            preset: args.preset.to_possible_value().map_or_else(String::new, |v| v.get_name().to_string()),
            fingerprint: format!("{:016x}", settings.fingerprint()),
            population: args.population,
            seed: args.seed,
        },
        sample: args.sample as usize,
        rounds: args.rounds as usize,
        generations,
        scaling,
    };
    publish(&args, &report)
}

/// Writes what was asked for.
fn publish(args: &Args, report: &Report) -> Result<(), CliError> {
    let series = if args.executors.is_empty() { PlotSeries::Main } else { PlotSeries::All };
    for plot in &args.plot {
        output::write_file(&plot.file, &(plot.draw)(report, series)?)?;
    }
    if let Some(out) = &args.out {
        output::write_file(out, format!("{}\n", serde_json::to_string_pretty(report)?).as_bytes())?;
    }
    if args.json { output::print_json(report) } else { output::print(&text(report)) }
}

fn settings(args: &Args) -> Result<Settings, CliError> {
    let generations = args.generations.last().map_or(1, |last| last + 1);
    let settings = Settings {
        seed: args.seed,
        population: args.population,
        generations,
        ..Settings::preset(args.preset.into())
    };
    settings.validate().map_err(|error| CliError::Usage(error.to_string()))?;
    Ok(settings)
}

/// The executors asked for, each once. What is asked for by name must run; of all, those count that do.
fn executors(args: &Args) -> Result<Vec<Arc<dyn Executor>>, CliError> {
    if args.executors.is_empty() {
        return Ok(Choice::all_runnable());
    }
    let first = |(i, choice): &(usize, &Choice)| !args.executors[..*i].contains(choice);
    args.executors.iter().enumerate().filter(first).map(|(_, choice)| choice.make()).collect()
}

fn data(args: &Args) -> Result<Dataset, CliError> {
    let Some(folder) = &args.data else { return Ok(Corridor::default().render(BUILDING, FRAMES)?) };
    let data = Dataset::load_within(folder, args.memory.limit())?;
    Ok(match &args.pattern {
        Some(pattern) => data.select(pattern)?,
        None => data,
    })
}

/// Numbers of cases, ascending, of a set that has so many.
fn case_counts(asked: &[CaseCount], all: usize) -> Result<Vec<usize>, CliError> {
    let mut counts: Vec<usize> = if asked.is_empty() {
        CASES.into_iter().filter(|&n| n < all).chain([all]).collect()
    } else {
        asked.iter().map(|count| if let CaseCount::Number(number) = *count { number } else { all }).collect()
    };
    if let Some(many) = counts.iter().find(|&&n| n > all) {
        let there = count(all as u64, "fitness case");
        return Err(CliError::Usage(format!(
            "--cases {many}: there are only {there}; `all` stands for them"
        )));
    }
    counts.sort_unstable();
    counts.dedup();
    Ok(counts)
}

pub(super) fn interrupted() -> CliError {
    CliError::Interrupted("interrupted; nothing was reported".to_string())
}

/// What all measurements share.
struct Bench<'a> {
    args: &'a Args,
    executors: &'a [Arc<dyn Executor>],
    stop: &'a AtomicBool,
}

impl Bench<'_> {
    fn measure(
        &self,
        data: &Dataset,
        fresh: &[Fresh],
        counts: &[usize],
        meter: &Meter,
    ) -> Result<(Vec<GenerationReport>, ScalingReport), CliError> {
        let all = data.case_set();
        // The same part of the sample is run by slow executors, and on other numbers of cases.
        let every = Plan::default().slow_every;
        let mut generations = Vec::new();
        for Fresh { generation, individuals } in fresh {
            let sample = even_sample(individuals, self.args.sample as usize);
            meter.begin(&format!("generation {generation}: {}", count(sample.len() as u64, "individual")));
            let measured = self.on(&sample, &all, every, meter)?;
            generations.push(GenerationReport::of(*generation, individuals.len(), &measured));
        }
        // The strips of all cases are let go before those of a part are made.
        let (images, lanes) = (all.images().to_vec(), all.lanes().to_vec());
        drop(all);
        let last = fresh.last();
        let sample = last.map_or_else(Vec::new, |f| even_sample(&f.individuals, self.args.sample as usize));
        let sample: Vec<&Individual> = sample.into_iter().step_by(every).collect();
        let mut points = Vec::new();
        for &number in counts {
            meter.begin(&count(number as u64, "case"));
            let lanes = even_sample(&lanes, number).into_iter().copied().collect();
            let measured = self.on(&sample, &CaseSet::new(images.clone(), lanes)?, 1, meter)?;
            points.push(PointReport::of(&measured));
        }
        let generation = last.map_or(0, |f| f.generation);
        Ok((generations, ScalingReport { generation, individuals: sample.len(), points }))
    }

    /// Slow executors run every n-th individual.
    fn on(
        &self,
        individuals: &[&Individual],
        cases: &CaseSet,
        slow_every: usize,
        meter: &Meter,
    ) -> Result<Measured, CliError> {
        let plan = Plan { rounds: self.args.rounds as usize, slow_every, ..Plan::default() };
        let step = |step: Step| meter.step(step, self.args.rounds);
        let measured: Result<Option<Measured>, BenchError> =
            measure(individuals, cases, self.executors, &plan, self.stop, step);
        measured?.ok_or_else(interrupted)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_help_says_what_slow_executors_are_spared() {
        let Plan { slow_rounds, slow_every, .. } = Plan::default();
        let said = format!("measured in {slow_rounds} rounds and on every {slow_every}th individual");
        assert!(EXAMPLES.contains(&said), "{EXAMPLES}");
    }

    #[test]
    fn numbers_of_cases() {
        let counts = |asked: &[&str], all| {
            let asked: Vec<CaseCount> = asked.iter().map(|a| case_count(a).expect("one")).collect();
            case_counts(&asked, all).map_err(|e| format!("{e:?}"))
        };
        assert_eq!(counts(&[], 505), Ok(vec![32, 64, 128, 256, 505]));
        assert_eq!((counts(&[], 64), counts(&[], 5)), (Ok(vec![32, 64]), Ok(vec![5])));
        assert_eq!(counts(&["all", "7", "3", "7"], 9), Ok(vec![3, 7, 9]));
        assert!(counts(&["10"], 9).expect_err("too many").contains("--cases 10: there are only 9"));
        for text in ["0", "-1", "many", "", "1.5"] {
            assert!(case_count(text).is_err(), "{text}");
        }
    }
}
