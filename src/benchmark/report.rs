//! The report: what was measured, in medians and quartiles. Its JSON form is this file's structures as they stand.
//!
//! Field names and what they mean are stable within a [`VERSION`]; fields may be added to one. Times end in `_s` and are
//! seconds. Whatever compares executors is made of medians, as the times are, so that neither a noisy round nor a few
//! large programs make it say something else than they do.

use serde::Serialize;

use super::break_even::BreakEven;
use super::measure::{Measured, Runs, Times};
use super::spread::{Spread, median};

/// The version of the report's fields.
pub const VERSION: u32 = 2;

/// The whole report.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Report {
    /// [`VERSION`].
    pub version: u32,
    /// The version of vsonar that measured.
    pub vsonar: &'static str,
    /// Where it was measured.
    pub machine: Machine,
    /// The fitness cases.
    pub data: DataReport,
    /// How the individuals were evolved.
    pub settings: SettingsReport,
    /// Individuals asked for of each generation.
    pub sample: usize,
    /// Rounds asked for.
    pub rounds: usize,
    /// A measurement for each generation.
    pub generations: Vec<GenerationReport>,
    /// Time against number of cases.
    pub scaling: ScalingReport,
}

/// The machine that measured.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Machine {
    /// Architecture, as `x86_64`.
    pub arch: &'static str,
    /// Operating system, as `linux`.
    pub os: &'static str,
    /// Model of the processor, if the system tells it.
    pub cpu: Option<String>,
    /// Threads that it runs at a time. Times are of one.
    pub threads: usize,
}

impl Machine {
    /// The machine this runs on.
    pub fn this() -> Machine {
        let info = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
        let line = info.lines().find_map(|line| line.strip_prefix("model name"));
        let cpu = line.map(|line| line.trim_start_matches([' ', '\t', ':']).to_string());
        Machine {
            arch: std::env::consts::ARCH,
            os: std::env::consts::OS,
            cpu,
            threads: std::thread::available_parallelism().map_or(1, std::num::NonZero::get),
        }
    }
}

/// The fitness cases.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct DataReport {
    /// Name of the set.
    pub name: String,
    /// Its fingerprint, 16 hexadecimal digits.
    pub fingerprint: String,
    /// Images.
    pub images: usize,
    /// Cases.
    pub cases: usize,
    /// Width of the images in pixels.
    pub width: u32,
    /// Height of the images in pixels.
    pub height: u32,
}

/// The settings of the run that the individuals are from.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct SettingsReport {
    /// Name of the preset.
    pub preset: String,
    /// Fingerprint of all settings, 16 hexadecimal digits.
    pub fingerprint: String,
    /// Individuals in a generation.
    pub population: u32,
    /// Seed.
    pub seed: u64,
}

/// What was measured on a generation's individuals.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct GenerationReport {
    /// The generation, counted from 0.
    pub generation: u32,
    /// Its fresh individuals.
    pub fresh: usize,
    /// Those of them that were measured.
    pub individuals: usize,
    /// Fitness cases each was run on.
    pub cases: usize,
    /// Operations of their optimised programs.
    pub operations: Spread,
    /// Tree nodes that are evaluated for one of them on one case.
    pub nodes_per_case: Spread,
    /// Each executor, in the order asked for.
    pub executors: Vec<ExecutorReport>,
    /// From how many cases on compiling pays, for each executor that compiles.
    pub break_even: Vec<BreakEven>,
    /// Each individual, in the order of the population.
    pub measured: Vec<IndividualReport>,
}

/// An executor on a generation's individuals.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ExecutorReport {
    /// Its name.
    pub executor: String,
    /// Individuals it was measured on; a slow one has fewer, evenly chosen.
    pub individuals: usize,
    /// Rounds it was measured in.
    pub rounds: usize,
    /// Lowering and optimising, over the individuals.
    pub lower_s: Spread,
    /// Code generation.
    pub compile_s: Spread,
    /// Running on all cases.
    pub execute_s: Spread,
    /// All three together.
    pub together_s: Spread,
    /// Mean of an individual.
    pub mean_s: Parts,
    /// Sum over its individuals, by round.
    pub round_totals_s: RoundTotals,
    /// The median of the tree nodes of all individuals (as the walker evaluates them on all cases) by the median of this
    /// executor's whole times, in 10⁹ a second.
    pub gpops: f64,
    /// The same by the median of the times of execution alone.
    pub gpops_execute: f64,
    /// The median of the walker's whole times by that of this executor's; `null` without the walker.
    pub times_walker: Option<f64>,
}

/// Parts of a time.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct Parts {
    /// Lowering and optimising.
    pub lower: f64,
    /// Code generation.
    pub compile: f64,
    /// Running on all cases.
    pub execute: f64,
    /// All three together.
    pub together: f64,
}

/// How the rounds differ: a measure of how quiet the machine was.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct RoundTotals {
    /// The fastest round.
    pub min: f64,
    /// The one in the middle.
    pub median: f64,
    /// The slowest.
    pub max: f64,
}

/// An individual.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct IndividualReport {
    /// Operations of its optimised program.
    pub operations: usize,
    /// Tree nodes evaluated on all cases together.
    pub nodes: u64,
    /// Time of each executor, lowering and compiling included, in the order of the executors; `null` where it was not
    /// measured.
    pub together_s: Vec<Option<f64>>,
}

/// Time against number of cases.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ScalingReport {
    /// The generation that the individuals are from.
    pub generation: u32,
    /// Individuals, the same for every executor.
    pub individuals: usize,
    /// A measurement for each number of cases, ascending.
    pub points: Vec<PointReport>,
}

/// The executors on so many cases.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PointReport {
    /// Fitness cases, evenly chosen from the set.
    pub cases: usize,
    /// Each executor, in the order asked for.
    pub executors: Vec<PointExecutor>,
}

/// An executor on so many cases.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PointExecutor {
    /// Its name.
    pub executor: String,
    /// Time of an individual, lowering and compiling included.
    pub together_s: Spread,
}

fn sum<'a>(times: impl Iterator<Item = &'a Times>) -> Parts {
    times.fold(Parts::default(), |sum, times| Parts {
        lower: sum.lower + times.lower,
        compile: sum.compile + times.compile,
        execute: sum.execute + times.execute,
        together: sum.together + times.together,
    })
}

impl ExecutorReport {
    fn of(runs: &Runs, measured: &Measured) -> ExecutorReport {
        let spread = |part: fn(&Times) -> f64| Spread::of(runs.times.iter().flatten().map(part));
        let individuals = runs.times.iter().flatten().count();
        let total = sum(runs.times.iter().flatten());
        let nodes = median(measured.subjects.iter().map(|subject| subject.nodes as f64));
        let (execute_s, together_s) = (spread(|t| t.execute), spread(|t| t.together));
        let part = |sum: f64| sum / individuals.max(1) as f64;
        ExecutorReport {
            executor: runs.name.to_string(),
            individuals,
            rounds: runs.rounds,
            lower_s: spread(|t| t.lower),
            compile_s: spread(|t| t.compile),
            execute_s,
            together_s,
            mean_s: Parts {
                lower: part(total.lower),
                compile: part(total.compile),
                execute: part(total.execute),
                together: part(total.together),
            },
            round_totals_s: RoundTotals {
                min: runs.totals.iter().copied().fold(f64::INFINITY, f64::min),
                median: median(runs.totals.iter().copied()),
                max: runs.totals.iter().copied().fold(0.0, f64::max),
            },
            gpops: nodes / together_s.median / 1e9,
            gpops_execute: nodes / execute_s.median / 1e9,
            times_walker: measured.runs.iter().find(|other| other.name == "tree").map(|walker| {
                median(walker.times.iter().flatten().map(|times| times.together)) / together_s.median
            }),
        }
    }
}

impl GenerationReport {
    /// Of the measurement of a generation that has so many fresh individuals.
    pub fn of(generation: u32, fresh: usize, measured: &Measured) -> GenerationReport {
        let cases = measured.cases.max(1) as f64;
        let individual = |(number, subject): (usize, &super::measure::Subject)| IndividualReport {
            operations: subject.operations,
            nodes: subject.nodes,
            together_s: measured.runs.iter().map(|runs| runs.times[number].map(|t| t.together)).collect(),
        };
        GenerationReport {
            generation,
            fresh,
            individuals: measured.subjects.len(),
            cases: measured.cases,
            operations: Spread::of(measured.subjects.iter().map(|s| s.operations as f64)),
            nodes_per_case: Spread::of(measured.subjects.iter().map(|s| s.nodes as f64 / cases)),
            executors: measured.runs.iter().map(|runs| ExecutorReport::of(runs, measured)).collect(),
            break_even: BreakEven::all(measured),
            measured: measured.subjects.iter().enumerate().map(individual).collect(),
        }
    }
}

impl PointReport {
    /// Of a measurement.
    pub fn of(measured: &Measured) -> PointReport {
        let executor = |runs: &Runs| PointExecutor {
            executor: runs.name.to_string(),
            together_s: Spread::of(runs.times.iter().flatten().map(|t| t.together)),
        };
        PointReport { cases: measured.cases, executors: measured.runs.iter().map(executor).collect() }
    }
}

#[cfg(test)]
mod tests {
    use super::super::measure::Subject;
    use super::*;

    #[test]
    fn a_generation_in_numbers() {
        let times = |together: f64| Some(Times { lower: 0.0, compile: 0.0, execute: together, together });
        let runs = |name, times: Vec<Option<Times>>| Runs {
            name,
            lowers: true,
            rounds: 3,
            times,
            totals: vec![3.0, 1.0, 2.0],
        };
        let measured = Measured {
            cases: 2,
            subjects: [10, 20, 30]
                .map(|nodes| Subject { operations: 1, nodes: nodes * 1_000_000_000 })
                .into(),
            runs: vec![
                runs("fast", vec![times(1.0), times(100.0), times(3.0)]),
                runs("tree", vec![times(10.0), None, times(30.0)]),
            ],
        };
        let report = GenerationReport::of(7, 9, &measured);
        let [fast, tree] = &report.executors[..] else { panic!("two") };
        assert_eq!((fast.times_walker, tree.times_walker), (Some(20.0 / 3.0), Some(1.0)));
        assert_eq!((fast.individuals, tree.individuals), (3, 2));
        assert_eq!((fast.gpops, tree.gpops), (20.0 / 3.0, 1.0));
        assert_eq!(fast.round_totals_s, RoundTotals { min: 1.0, median: 2.0, max: 3.0 });
        assert_eq!(report.measured[1].together_s, [Some(100.0), None]);
        assert_eq!(report.nodes_per_case.median, 1e10);
    }

    /// What is as fast in the middle is as fast in the report, whatever one individual or round took.
    #[test]
    fn speeds_agree_with_the_medians() {
        let runs = |name, seconds: &[f64]| {
            let times = |&s: &f64| Times { lower: 0.0, compile: 0.0, execute: s, together: s };
            let (times, totals) =
                (seconds.iter().map(|s| Some(times(s))).collect(), vec![seconds.iter().sum()]);
            Runs { name, lowers: true, rounds: 1, times, totals }
        };
        let (usual, noisy) = ([2.0, 2.0, 3.0, 4.0, 5.0], [2.0, 2.0, 3.0, 4.0, 5000.0]);
        let measured = Measured {
            cases: 1,
            subjects: [6, 6, 6, 6, 600_000].map(|nodes| Subject { operations: 1, nodes }).into(),
            runs: vec![runs("quiet", &usual), runs("noisy", &noisy), runs("tree", &[30.0; 5])],
        };
        let report = GenerationReport::of(0, 5, &measured);
        let [quiet, noisy, tree] = &report.executors[..] else { panic!("three") };
        assert_eq!(quiet.together_s.median, noisy.together_s.median);
        assert_eq!((quiet.gpops, quiet.times_walker), (noisy.gpops, noisy.times_walker));
        assert_eq!((quiet.gpops, tree.gpops), (2e-9, 2e-10));
        for executor in &report.executors {
            let by_hand = tree.together_s.median / executor.together_s.median;
            assert_eq!(executor.times_walker, Some(by_hand), "{}", executor.executor);
        }
    }
}
