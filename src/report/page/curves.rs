//! Over the generations: fitness, size, diversity, cache hits, time.

use maud::{Markup, html};

use super::chart::{Axis, Ink, Plot, PlotError, Series, Shape, Unit};
use super::model::Run;
use super::parts::{Figure, POINTS, Table, count, duration, grouped, maybe, number, percent, rows, thinned};
use crate::evolve::Record;

/// Bars of a plot of time, at most.
const BARS: usize = 100;

/// A number of each generation, where it is recorded.
type Reading<'a> = &'a dyn Fn(&Record) -> Option<f64>;

/// Lines over the generations, with the numbers in a table.
fn lines(
    id: String,
    title: &str,
    description: String,
    records: &[Record],
    mut y: Axis,
    readings: &[(&str, Reading)],
) -> Result<Markup, PlotError> {
    let points = |reading: Reading| -> Vec<(f64, f64)> {
        let shown = thinned(records.len(), POINTS).into_iter().map(|i| &records[i]);
        shown.filter_map(|r| Some((f64::from(r.generation), reading(r)?))).collect()
    };
    let there: Vec<&(&str, Reading)> =
        readings.iter().filter(|(_, reading)| records.iter().any(|r| reading(r).is_some())).collect();
    let shares = y.unit == Unit::Percent;
    if y.range.is_empty() {
        let all = there.iter().flat_map(|(_, reading)| points(*reading)).map(|(_, y)| y);
        y = Axis::around(&y.label, y.unit, true, all);
    }
    let mut series: Vec<Series> = Vec::new();
    for (i, (name, reading)) in there.iter().enumerate() {
        let points = points(*reading);
        let ink = Ink::Series(i as u8);
        if let [point] = points[..] {
            series.push(Series { name: Some(name.to_string()), ink, shape: Shape::Dots(vec![point], 4) });
        } else {
            series.push(Series { name: Some(name.to_string()), ink, shape: Shape::Line(points) });
        }
    }
    let headings: Vec<&str> =
        std::iter::once("generation").chain(there.iter().map(|(name, _)| *name)).collect();
    let mut numbers = Table::new(title, &headings);
    for i in rows(records.len()) {
        let record = &records[i];
        let cell = |value: Option<f64>| {
            if shares { maybe(value) } else { value.map_or_else(super::parts::none, number) }
        };
        let cells = there.iter().map(|(_, reading)| cell(reading(record)));
        numbers.row(std::iter::once(record.generation.to_string()).chain(cells));
    }
    let plot = Plot { x: Axis::generations(records.len()), y, series };
    Figure { id, title, description, plot, numbers }.html()
}

/// An axis whose range is found from what it shows.
fn open(label: &str, unit: Unit) -> Axis {
    Axis { label: label.to_string(), unit, range: 0.0..0.0, names: Vec::new() }
}

/// Fitness, size and depth.
pub(super) fn growth(run: &Run, prefix: &str) -> Result<Markup, PlotError> {
    let records = &run.records;
    let (Some(first), Some(last)) = (records.first(), records.last()) else { return Ok(html! {}) };
    let mut fitness = format!(
        "The best goes from {} in generation 0 to {} in generation {}; the mean ends at {}, the median at {}.",
        percent(first.best_fitness),
        percent(last.best_fitness_so_far),
        last.generation,
        percent(last.mean_fitness),
        percent(last.median_fitness)
    );
    if let Some(validation) = last.validation_fitness {
        fitness += &format!(" The run's winner ends at {} in validation.", percent(validation));
    }
    if last.best_fitness_unaltered.is_some() {
        fitness += " Training cases include the altered copies of the images.";
    }
    let size = format!(
        "On average {} nodes at first, {} at the end; the largest of all had {}, the last generation's best has {}.",
        number(first.mean_nodes),
        number(last.mean_nodes),
        grouped(records.iter().map(|r| f64::from(r.max_nodes)).fold(0.0, f64::max)),
        last.best_nodes
    );
    let largest = format!(
        "The largest individual of a generation, {} to {} nodes.",
        grouped(records.iter().map(|r| f64::from(r.max_nodes)).fold(f64::INFINITY, f64::min)),
        grouped(records.iter().map(|r| f64::from(r.max_nodes)).fold(0.0, f64::max))
    );
    let depth = format!(
        "Mean depth from {} to {}; the deepest at the end has {}.",
        number(first.mean_depth),
        number(last.mean_depth),
        last.max_depth
    );
    Ok(html! {
        div.plots {
            (lines(format!("{prefix}fitness"), "Fitness", fitness, records, Axis::shares("cases solved"), &[
                ("best so far", &|r| Some(r.best_fitness_so_far)),
                ("best of the generation", &|r| Some(r.best_fitness)),
                ("mean", &|r| Some(r.mean_fitness)),
                ("median", &|r| Some(r.median_fitness)),
                ("best, unaltered images", &|r| r.best_fitness_unaltered),
                ("winner in validation", &|r| r.validation_fitness),
            ])?)
            (lines(format!("{prefix}size"), "Size", size, records, open("nodes", Unit::Plain), &[
                ("mean", &|r| Some(r.mean_nodes)),
                ("best", &|r| Some(f64::from(r.best_nodes))),
            ])?)
            (lines(format!("{prefix}largest"), "Largest individual", largest, records, open("nodes", Unit::Plain), &[
                ("largest", &|r| Some(f64::from(r.max_nodes))),
            ])?)
            (lines(format!("{prefix}depth"), "Depth", depth, records, open("depth", Unit::Plain), &[
                ("mean", &|r| Some(r.mean_depth)),
                ("deepest", &|r| Some(f64::from(r.max_depth))),
            ])?)
        }
    })
}

/// The share of the results that were known without running a program.
fn hits(record: &Record) -> Option<f64> {
    let all = record.evaluations as f64;
    (all > 0.0).then(|| (1.0 - record.timing.executed as f64 / all).max(0.0))
}

/// Distinct programs, behaviours, entropy, constants, cache hits.
pub(super) fn life(run: &Run, prefix: &str) -> Result<Markup, PlotError> {
    let records = &run.records;
    let Some(last) = records.last() else { return Ok(html! {}) };
    let all = f64::from(run.population.max(1));
    let distinct = format!(
        "In the last generation {} of {} individuals differ as programs, {} in some answer.",
        grouped(f64::from(last.distinct_programs)),
        grouped(all),
        grouped(f64::from(last.distinct_behaviours))
    );
    let mut shares =
        format!("At the end {} of the individuals answer a constant", percent(last.constant_share));
    match last.largest_behaviour {
        Some(largest) => shares += &format!(", and {} share the most common behaviour.", percent(largest)),
        None => shares.push('.'),
    }
    if last.case_entropy.is_some() {
        shares += " The entropy is that of the cases solved: 100 % if all are solved equally often.";
    }
    let evaluations: u64 = records.iter().map(|r| r.evaluations).sum();
    let executed: u64 = records.iter().map(|r| r.timing.executed).sum();
    let cached = format!(
        "{} individuals were evaluated; {} programs had to be run, all other results ({}) were known.",
        grouped(evaluations as f64),
        grouped(executed as f64),
        percent((1.0 - executed as f64 / evaluations.max(1) as f64).max(0.0))
    );
    let nobody = last.solved_by_nobody.map(|cases| {
        let hardest = last.hardest_case.as_ref();
        let hardest = hardest.map_or(String::new(), |hardest| {
            format!(
                " The hardest, case {}, is solved by {}.",
                hardest.case,
                count(hardest.solvers as usize, "individual")
            )
        });
        let nobody = match cases {
            0 => "In the last generation every training case is solved by somebody.".to_string(),
            1 => "In the last generation one training case is solved by nobody.".to_string(),
            _ => format!("In the last generation {cases} training cases are solved by nobody."),
        };
        nobody + &hardest
    });
    Ok(html! {
        @if let Some(nobody) = nobody { p { (nobody) } }
        div.plots {
            (lines(format!("{prefix}distinct"), "Distinct individuals", distinct, records, open("individuals", Unit::Plain), &[
                ("programs", &|r| Some(f64::from(r.distinct_programs))),
                ("behaviours", &|r| Some(f64::from(r.distinct_behaviours))),
            ])?)
            (lines(format!("{prefix}shares"), "Diversity", shares, records, Axis::shares("share"), &[
                ("entropy of the cases solved", &|r| r.case_entropy),
                ("most common behaviour", &|r| r.largest_behaviour),
                ("constant answers", &|r| Some(r.constant_share)),
            ])?)
            (lines(format!("{prefix}hits"), "Cache hits", cached, records, Axis::shares("results known"), &[
                ("results known without a run", &hits),
            ])?)
            @if records.iter().any(|r| r.operations_before.is_some()) {
                (lines(format!("{prefix}operations"), "Operations of a program", "Live operations of the programs lowered for a generation, \
                     on average, before and after the optimiser.".to_string(), records, open("operations", Unit::Plain), &[
                    ("before the optimiser", &|r| r.operations_before),
                    ("after", &|r| r.operations_after),
                ])?)
            }
        }
    })
}

const PHASES: [&str; 6] =
    ["running programs", "lowering", "code generation", "breeding", "statistics", "saving"];

/// Seconds of a generation by phase, as the clock has it. What evaluation took is parted as the threads' time was.
fn phases(record: &Record) -> [f64; 6] {
    let t = &record.timing;
    let threads = t.lower + t.compile + t.execute;
    let evaluate =
        if t.evaluate > 0.0 { t.evaluate } else { (t.wall - t.breed - t.record - t.save).max(0.0) };
    let part = |of: f64| if threads > 0.0 { evaluate * (of / threads) } else { 0.0 };
    let execute = if threads > 0.0 { part(t.execute) } else { evaluate };
    [execute, part(t.lower), part(t.compile), t.breed, t.record, t.save]
}

/// Time by phase.
pub(super) fn time(run: &Run, prefix: &str) -> Result<Markup, PlotError> {
    let records = &run.records;
    if records.is_empty() {
        return Ok(html! {});
    }
    let shown = thinned(records.len(), BARS);
    let mut bars: [Vec<(f64, f64, f64, f64)>; 6] = Default::default();
    let mut highest: f64 = 0.0;
    for &i in &shown {
        let x = f64::from(records[i].generation);
        let half = 0.4 * (records.len() as f64 / shown.len() as f64);
        let mut below = 0.0;
        for (bar, seconds) in bars.iter_mut().zip(phases(&records[i])) {
            bar.push((x - half, x + half, below, below + seconds));
            below += seconds;
        }
        highest = highest.max(below);
    }
    let sums = records
        .iter()
        .map(phases)
        .fold([0.0; 6], |sums, phases| std::array::from_fn(|i| sums[i] + phases[i]));
    let mut total = Table::new("All generations together", &["phase", "time", "share"]);
    let all: f64 = sums.iter().sum();
    for (name, seconds) in PHASES.iter().zip(sums) {
        total.row([name.to_string(), duration(seconds), percent(seconds / all.max(1e-9))]);
    }
    let mut numbers = Table::new("Milliseconds by phase", &[&["generation"][..], &PHASES].concat());
    for i in rows(records.len()) {
        let cells = phases(&records[i]).map(|seconds| number(1e3 * seconds));
        numbers.row(std::iter::once(records[i].generation.to_string()).chain(cells));
    }
    let series = PHASES.iter().zip(bars).enumerate().map(|(i, (name, bars))| Series {
        name: Some(name.to_string()),
        ink: Ink::Series(i as u8),
        shape: Shape::Bars(bars),
    });
    let mut x = Axis::generations(records.len());
    x.range = x.range.start - 0.6..x.range.end + 0.6;
    let y = Axis::around("seconds", Unit::Plain, true, std::iter::once(highest));
    let busy: f64 = records.iter().map(|r| r.timing.busy * r.timing.evaluate).sum::<f64>()
        / records.iter().map(|r| r.timing.evaluate).sum::<f64>().max(1e-9);
    let description = format!(
        "{} in all. Time of evaluation is parted as that of its threads, which were at work {} of it.",
        duration(all),
        percent(busy)
    );
    let plot = Plot { x, y, series: series.collect() };
    Ok(html! {
        div.plots {
            (Figure { id: format!("{prefix}time"), title: "Time of a generation", description, plot, numbers }.html()?)
            div { (total.html()) }
        }
    })
}
