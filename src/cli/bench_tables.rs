//! The tables of `vsonar bench`.

use std::fmt::Write as _;

use vsonar::benchmark::{ExecutorReport, GenerationReport, Report, Spread};

use super::output::{count, grouped, percent};
use super::table::Table;

/// The report as tables.
pub(crate) fn text(report: &Report) -> String {
    let data = &report.data;
    let mut out = format!(
        "\n{} ({} in {} of {} x {} pixels), preset {}, population {}, seed {}\n{}{} {}, one thread\n",
        data.name,
        count(data.cases as u64, "case"),
        count(data.images as u64, "image"),
        data.width,
        data.height,
        report.settings.preset,
        grouped(report.settings.population.into()),
        report.settings.seed,
        report.machine.cpu.as_ref().map_or(String::new(), |cpu| format!("{cpu}, ")),
        report.machine.arch,
        report.machine.os,
    );
    for generation in &report.generations {
        out += &executors(generation);
    }
    // Writing to a string cannot fail.
    let _ = write!(
        out,
        "\nMilliseconds of an individual on all cases: medians over the individuals of the median of its rounds, and \
         quartiles, mean of lowering, compiling and executing together. Spread: half the range of the rounds' totals.\n\
         GPop/s: tree nodes that the walker evaluates, by the time together. Speed: the walker's time together by the\n\
         executor's. Both are quotients of the medians above.\n"
    );
    out += &break_even(report);
    out += &scaling(report);
    out
}

/// Seconds as milliseconds, with three digits or so.
fn ms(seconds: f64) -> String {
    let ms = seconds * 1e3;
    let digits = match ms {
        100.0.. => 0,
        10.0.. => 1,
        1.0.. => 2,
        _ => 3,
    };
    format!("{ms:.digits$}")
}

fn executors(generation: &GenerationReport) -> String {
    let mut table = Table::new(
        1,
        &[
            "executor",
            "programs",
            "rounds",
            "lower",
            "compile",
            "execute",
            "together",
            "quartiles",
            "mean",
            "spread",
            "GPop/s",
            "speed",
        ],
    );
    for e in &generation.executors {
        table.row([
            e.executor.clone(),
            e.individuals.to_string(),
            e.rounds.to_string(),
            ms(e.lower_s.median),
            ms(e.compile_s.median),
            ms(e.execute_s.median),
            ms(e.together_s.median),
            format!("{} to {}", ms(e.together_s.q1), ms(e.together_s.q3)),
            ms(e.mean_s.together),
            spread(e),
            format!("{:.3}", e.gpops),
            e.times_walker.map_or_else(|| "-".to_string(), |times| format!("{times:.1}")),
        ]);
    }
    format!(
        "\nGeneration {}: {} of {}, {} each; median {} operations, {} tree nodes a case\n{table}",
        generation.generation,
        generation.individuals,
        count(generation.fresh as u64, "fresh individual"),
        count(generation.cases as u64, "case"),
        generation.operations.median,
        grouped(generation.nodes_per_case.median.round() as u64),
    )
}

fn spread(e: &ExecutorReport) -> String {
    let totals = e.round_totals_s;
    format!("± {}", percent((totals.max - totals.min) / 2.0 / totals.median))
}

fn break_even(report: &Report) -> String {
    let rows: Vec<_> =
        report.generations.iter().flat_map(|g| g.break_even.iter().map(|b| (g.generation, b))).collect();
    if rows.is_empty() {
        return String::new();
    }
    let mut table = Table::new(
        3,
        &["executor", "against", "generation", "cases", "quartiles", "never", "from the first", "here"],
    );
    for (generation, b) in rows {
        let Spread { q1, median, q3 } = b.cases;
        table.row([
            b.executor.clone(),
            b.interpreter.clone(),
            generation.to_string(),
            cases(median),
            format!("{} to {}", cases(q1), cases(q3)),
            percent(b.always_interpret),
            percent(b.always_compile),
            percent(b.compile_here),
        ]);
    }
    format!(
        "\nBreak-even: the number of fitness cases from which compiling pays, against the fastest executor that does \
         not compile; and the share of the individuals for which it never does, does from the first case on, and does \
         with the cases measured\n{table}"
    )
}

/// A number of cases, rounded up.
fn cases(number: f64) -> String {
    if number.is_finite() { grouped(number.ceil() as u64) } else { "never".to_string() }
}

fn scaling(report: &Report) -> String {
    let scaling = &report.scaling;
    let numbers = scaling.points.iter().map(|p| count(p.cases as u64, "case"));
    let headings: Vec<String> = std::iter::once("executor".to_string()).chain(numbers).collect();
    let headings: Vec<&str> = headings.iter().map(String::as_str).collect();
    let mut table = Table::new(1, &headings);
    let Some(first) = scaling.points.first() else { return String::new() };
    for (number, executor) in first.executors.iter().enumerate() {
        let times = scaling.points.iter().map(|p| ms(p.executors[number].together_s.median));
        table.row(std::iter::once(executor.executor.clone()).chain(times));
    }
    format!(
        "\nMilliseconds by number of cases, medians over {} of generation {}\n{table}",
        count(scaling.individuals as u64, "individual"),
        scaling.generation
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_the_digits_they_deserve() {
        assert_eq!([0.000_012_34, 0.002_5, 0.025_06, 1.234_56].map(ms), ["0.012", "2.50", "25.1", "1235"]);
        assert_eq!([20.1, 0.0, f64::INFINITY, 12_345.0].map(cases), ["21", "0", "never", "12,345"]);
    }
}
