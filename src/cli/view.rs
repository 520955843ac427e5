//! What is seen of a run while it goes on: live lines on a terminal, a line a generation elsewhere. A warning that
//! the run has collapsed is shown once for each kind.

use vsonar::dataset::Dataset;
use vsonar::evolve::{Collapse, Evolution, Record, Settings, Warning};
use vsonar::support::printable;

use super::live::{Last, Live};
use super::output::{count, duration, grouped, percent, say};
use super::progress::Style;

/// Shows a run. Its generations are told to it one by one.
pub(crate) struct View<'a> {
    style: Style,
    total: u32,
    settings: Settings,
    /// The training set, for the names of cases.
    train: &'a Dataset,
    /// Of all generations so far.
    records: Vec<Record>,
    /// What was warned of.
    warned: Vec<Collapse>,
    clock: Clock,
    live: Option<Live>,
}

/// Estimates the time left from the generations this process has seen.
#[derive(Debug, Default, Clone)]
struct Clock {
    /// Seconds of each generation.
    walls: Vec<f64>,
}

impl Clock {
    /// How many generations an estimate looks back on.
    const WINDOW: usize = 8;

    /// Seconds for so many generations; the initial one is unlike the others, so it takes two to tell.
    fn left(&self, generations: u32) -> Option<f64> {
        if generations == 0 {
            return Some(0.0);
        }
        let recent = &self.walls[self.walls.len().saturating_sub(Clock::WINDOW)..];
        let mean = recent.iter().sum::<f64>() / recent.len().max(1) as f64;
        (self.walls.len() >= 2).then_some(mean * f64::from(generations))
    }
}

impl<'a> View<'a> {
    /// The view of a run on this training set up to `total` generations, before it starts or goes on.
    pub(crate) fn start(style: Style, evolution: &Evolution, total: u32, train: &'a Dataset) -> View<'a> {
        let settings = evolution.settings().clone();
        let records = evolution.state().map_or(Vec::new(), |state| state.records.clone());
        let last = records.last().map(|record| last(record, train));
        let live = (style == Style::Live).then(|| Live::start(evolution.progress(), total, last));
        View { style, total, settings, train, records, warned: Vec::new(), clock: Clock::default(), live }
    }

    /// Shows a complete generation.
    pub(crate) fn generation(&mut self, record: &Record) {
        self.clock.walls.push(record.timing.wall);
        self.records.push(record.clone());
        let left = self.clock.left(self.total.saturating_sub(record.generation + 1));
        match self.style {
            Style::Silent => {}
            Style::Live => {
                if let Some(live) = &self.live {
                    live.show(last(record, self.train), left);
                }
            }
            Style::Lines => say(&line(record, self.total, left)),
        }
    }

    /// Warns of what the run has come to with the last generation, unless that was said before.
    pub(crate) fn warn(&mut self) {
        if self.style == Style::Silent {
            return;
        }
        let Some(warning) = Warning::of(&self.records, &self.settings) else { return };
        if self.warned.contains(&warning.kind) {
            return;
        }
        self.warned.push(warning.kind);
        say(&format!("warning: {warning}"));
    }
}

fn fitness(record: &Record) -> String {
    // With augmentation the others are of altered copies too.
    let unaltered = record.best_fitness_unaltered;
    let unaltered = unaltered.map_or(String::new(), |share| format!(" ({} unaltered)", percent(share)));
    let validation = record.validation_fitness;
    let validation = validation.map_or(String::new(), |share| format!(", validation {}", percent(share)));
    format!(
        "best {}{unaltered}{validation}, mean {}",
        percent(record.best_fitness),
        percent(record.mean_fitness)
    )
}

/// How alive the generation is, in short; without what an earlier release did not record.
fn spread(record: &Record) -> String {
    let mut parts = vec![count(record.distinct_behaviours.into(), "behaviour")];
    parts.extend(record.case_entropy.map(|entropy| format!("entropy {entropy:.2}")));
    parts.extend(record.solved_by_nobody.map(|cases| format!("{} unsolved", grouped(cases.into()))));
    parts.push(format!("{:.0} nodes", record.mean_nodes));
    parts.join(", ")
}

/// The same in full, as two lines: the spread of the generation, and the cases that it fails on.
fn signs(record: &Record, train: &Dataset) -> [String; 2] {
    let mut parts = vec![count(record.distinct_behaviours.into(), "behaviour")];
    parts.extend(record.largest_behaviour.map(|share| format!("the largest {}", percent(share))));
    parts.push(format!("{} constant", percent(record.constant_share)));
    parts.extend(record.case_entropy.map(|entropy| format!("entropy {entropy:.2}")));
    parts.push(format!("{:.0} nodes", record.mean_nodes));
    let hardest = record.hardest_case.and_then(|h| Some((h.solvers, train.cases().get(h.case as usize)?)));
    let failed = hardest.map_or(String::new(), |(solvers, case)| {
        let name = format!("{} column {}", printable::line(&train.images()[case.image].name), case.x);
        match (solvers, record.solved_by_nobody) {
            (0, Some(unsolved)) => {
                let cases = count(train.cases().len() as u64, "case");
                format!("nobody solves {} of {cases}, such as {name}", grouped(unsolved.into()))
            }
            _ => format!("fewest ({}) solve {name}", grouped(solvers.into())),
        }
    });
    [parts.join(", "), failed]
}

/// The generation in the live lines.
fn last(record: &Record, train: &Dataset) -> Last {
    Last { fitness: fitness(record), signs: signs(record, train) }
}

/// A generation as a line. Generations are counted from 0, so the last of 51 is 50.
fn line(record: &Record, total: u32, left: Option<f64>) -> String {
    let width = total.saturating_sub(1).to_string().len();
    let rate = record.evaluations as f64 / record.timing.wall.max(1e-9);
    let left = left.map_or(String::new(), |s| format!(", {} left", duration(s)));
    format!(
        "generation {:>width$}/{}: {}, {}, {} programs/s{left}",
        record.generation,
        total.saturating_sub(1),
        fitness(record),
        spread(record),
        grouped(rate as u64)
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_left_is_that_of_recent_generations() {
        let mut clock = Clock { walls: vec![100.0] };
        assert_eq!((clock.left(3), clock.left(0)), (None, Some(0.0)));
        clock.walls.extend([2.0; Clock::WINDOW]);
        assert_eq!(clock.left(3), Some(6.0));
    }
}
