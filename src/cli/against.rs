//! `vsonar eval --against`: an evolved program beside the rivals of the literature, in one table.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::time::Instant;

use serde::Serialize;
use vsonar::baseline::{Rival, Tuned, UnknownRival};
use vsonar::dataset::scale::in_proportion;
use vsonar::dataset::{Constants, Dataset, Transience};
use vsonar::detector::{CompiledDetector, SequenceDetector};
use vsonar::evolve::{CaseBits, is_correct};
use vsonar::exec::Executor;
use vsonar::report::page;
use vsonar::tree::Individual;

use super::CliError;
use super::executor::{answers, with_stack};
use super::output::{self, count, percent};
use super::part::Part;
use super::table::Table;
use super::tuning::Copies;

/// Which rivals.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Rivals(Vec<Rival>);

impl std::str::FromStr for Rivals {
    type Err = UnknownRival;

    /// `all`, or names between commas; each once, in the order of [`Rival::ALL`].
    fn from_str(text: &str) -> Result<Rivals, UnknownRival> {
        if text == "all" {
            return Ok(Rivals(Rival::ALL.to_vec()));
        }
        let named = text.split(',').map(|name| name.trim().parse()).collect::<Result<Vec<Rival>, _>>()?;
        Ok(Rivals(Rival::ALL.into_iter().filter(|rival| named.contains(rival)).collect()))
    }
}

/// Images, and what people call them.
pub(super) struct Named {
    pub(super) name: String,
    pub(super) set: Dataset,
}

/// What is compared, and on what.
pub(super) struct Comparison<'a> {
    /// The evolved program and its file, if there is one.
    pub(super) program: Option<(&'a Path, &'a Individual)>,
    /// What runs it.
    pub(super) executor: &'a dyn Executor,
    /// What the rivals are tuned on.
    pub(super) train: &'a Named,
    /// Whether that is the training part of the program's run, not another set.
    pub(super) own_training: bool,
    /// What all are tested on.
    pub(super) test: &'a Named,
    pub(super) tolerance: f64,
    /// The altered copies that the rivals are tuned on too.
    pub(super) copies: Copies,
}

/// A detector on one part of the data.
#[derive(Debug, Clone, Serialize)]
struct Scored {
    fitness: f64,
    correct: u32,
    cases: u32,
    interval: Option<(f64, f64)>,
    transience: Option<Transience>,
}

/// A line of the table.
#[derive(Debug, Clone, Serialize)]
struct Row {
    detector: &'static str,
    source: Option<&'static str>,
    /// The tuned settings in words, and how many were tried.
    #[serde(skip_serializing_if = "Option::is_none")]
    tuned: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    settings: Option<Tuned>,
    #[serde(skip_serializing_if = "Option::is_none")]
    tried: Option<usize>,
    training: Scored,
    test: Scored,
    /// The median time for the labelled columns of a tested image; none if the program cannot be compiled here.
    microseconds: Option<f64>,
}

#[derive(Debug, Clone, Serialize)]
struct Report {
    program: Option<PathBuf>,
    tuned_on: String,
    /// Whether that is the training part of the program's run.
    own_training: bool,
    /// Altered copies of each of these images that some rivals are tuned on too (`Rival::takes_copies`).
    altered_copies: u32,
    tested_on: String,
    tolerance: f64,
    /// Height of the images in pixels.
    height: u32,
    /// Whether test and training are the same cases.
    same: bool,
    /// Tested images that are among the training images too.
    shared_images: usize,
    test_images: usize,
    detectors: Vec<Row>,
}

/// Tunes the rivals, tests all, and prints the table.
pub(super) fn run(comparison: &Comparison, rivals: &Rivals, json: bool) -> Result<(), CliError> {
    let (train, test) = (&comparison.train.set, &comparison.test.set);
    let size = |set: &Dataset| (set.width(), set.height());
    if size(train) != size(test) {
        let text = format!(
            "the images to tune on have {} x {} pixels, those to test on {} x {}; give images of one size",
            train.width(),
            train.height(),
            test.width(),
            test.height()
        );
        return Err(CliError::Failed(text));
    }
    let report = report(comparison, rivals)?;
    if json { output::print_json(&report) } else { output::print(&text(&report)) }
}

/// All rivals beside the program, for a page; the test images are this part of the data.
pub(super) fn for_page(comparison: &Comparison, part: page::Part) -> Result<page::Rivals, CliError> {
    let report = report(comparison, &Rivals(Rival::ALL.to_vec()))?;
    let row = |row: Row| {
        let transience = row.test.transience.as_ref();
        page::Rival {
            name: row.detector.to_string(),
            source: row.source.map(str::to_string),
            tuned: row.tuned,
            train: row.training.fitness,
            test: row.test.fitness,
            interval: row.test.interval,
            median: transience.map(|t| t.median_fitness),
            single: transience.and_then(|t| t.single_of_errors),
            microseconds: row.microseconds,
        }
    };
    let copies = comparison.copies.per_image();
    Ok(page::Rivals { part, copies, rows: report.detectors.into_iter().map(row).collect() })
}

fn report(comparison: &Comparison, rivals: &Rivals) -> Result<Report, CliError> {
    let (train, test) = (&comparison.train.set, &comparison.test.set);
    let mut detectors = Vec::new();
    if let Some((_, individual)) = comparison.program {
        detectors.push(Row::evolved(individual, comparison)?);
    }
    let tuner = comparison.copies.tuner(train, comparison.tolerance);
    for &rival in &rivals.0 {
        let mut tuned = tuner.tune(rival);
        let scored = |detector: &mut dyn SequenceDetector, set| -> Result<Scored, CliError> {
            let answers = vsonar::baseline::answers(detector, set)?;
            Ok(Scored::of(set, &answers, comparison.tolerance))
        };
        let training = scored(&mut tuned, train)?;
        let mut timed = Timed { detector: &mut tuned, seconds: Vec::new() };
        let tested = scored(&mut timed, test)?;
        detectors.push(Row {
            detector: rival.name(),
            source: rival.source(),
            microseconds: timed.microseconds(),
            tuned: Some(tuned.describe()),
            tried: Some(tuned.tried()),
            settings: Some(tuned),
            training,
            test: tested,
        });
    }
    let known: std::collections::HashSet<&[u8]> =
        train.images().iter().map(|image| image.pixels.as_raw().as_slice()).collect();
    let shared = test.images().iter().filter(|image| known.contains(image.pixels.as_raw().as_slice()));
    Ok(Report {
        program: comparison.program.map(|(path, _)| path.to_path_buf()),
        tuned_on: comparison.train.name.clone(),
        own_training: comparison.own_training,
        altered_copies: comparison.copies.per_image(),
        tested_on: comparison.test.name.clone(),
        tolerance: comparison.tolerance,
        height: test.height(),
        same: train.fingerprint() == test.fingerprint(),
        shared_images: shared.count(),
        test_images: test.images().len(),
        detectors,
    })
}

impl Row {
    /// The evolved program. Its answers are the executor's; its time is that of native code, if there is any here.
    fn evolved(individual: &Individual, comparison: &Comparison) -> Result<Row, CliError> {
        let score = |set| -> Result<Scored, CliError> {
            let answers = answers(comparison.executor, individual, set)?;
            Ok(Scored::of(set, &answers, comparison.tolerance))
        };
        let test = &comparison.test.set;
        let time = || -> Option<f64> {
            let compiled = CompiledDetector::compile_individual(individual, test.width(), test.height());
            let mut timed = Timed { detector: &mut compiled.ok()?, seconds: Vec::new() };
            vsonar::baseline::answers(&mut timed, test).ok()?;
            timed.microseconds()
        };
        Ok(Row {
            detector: "evolved",
            source: None,
            tuned: None,
            settings: None,
            tried: None,
            training: score(&comparison.train.set)?,
            test: score(test)?,
            microseconds: with_stack(time)?,
        })
    }
}

impl Scored {
    fn of(set: &Dataset, answers: &[f32], tolerance: f64) -> Scored {
        let label = |i: usize| f64::from(set.cases()[i].y);
        let solved = CaseBits::from_fn(answers.len(), |i| is_correct(answers[i], label(i), tolerance));
        let part = Part::of(set, &solved, &Constants::learn(set, tolerance));
        Scored {
            fitness: part.fitness,
            correct: part.correct,
            cases: part.cases,
            interval: part.interval,
            transience: Transience::of(set, answers, tolerance),
        }
    }
}

/// A detector with a watch.
struct Timed<'a> {
    detector: &'a mut dyn SequenceDetector,
    seconds: Vec<f64>,
}

impl Timed<'_> {
    /// The median time of a frame.
    fn microseconds(&mut self) -> Option<f64> {
        self.seconds.sort_by(f64::total_cmp);
        self.seconds.get(self.seconds.len() / 2).map(|seconds| 1e6 * seconds)
    }
}

impl SequenceDetector for Timed<'_> {
    fn size(&self) -> (u32, u32) {
        self.detector.size()
    }

    fn restart(&mut self) {
        self.detector.restart();
    }

    fn next(
        &mut self,
        image: &image::GrayImage,
        motion: Option<vsonar::detector::Motion>,
        columns: &[u32],
        rows: &mut [f32],
    ) -> Result<(), vsonar::detector::DetectError> {
        let start = Instant::now();
        let done = self.detector.next(image, motion, columns, rows);
        self.seconds.push(start.elapsed().as_secs_f64());
        done
    }
}

/// What is said below the table.
const NOTE: &str = "\
Rivals are tuned on the images of the first column of numbers, never on those tested. 95 %: bootstrap interval over \
stretches of five images. Median of 3: the fitness if each answer is the median of this frame's and the last two's. \
One frame: share of the errors that are gone in the next labelled frame of the column, those in the last frame of a \
sequence left out, for they have no next one; longest: most frames in a row. Time: the labelled columns of an image.";

fn text(report: &Report) -> String {
    let mut out = String::new();
    // Writing to a string cannot fail.
    let _ = writeln!(
        out,
        "Tested on {}, {}, within {}; tuned on {}{}",
        report.tested_on,
        count(report.test_images as u64, "image"),
        in_proportion(report.tolerance, report.height),
        report.tuned_on,
        Copies::words(
            report.altered_copies,
            report.detectors.iter().filter_map(|row| row.detector.parse().ok())
        )
    );
    let _ = match (report.same, report.shared_images) {
        (true, _) => writeln!(out, "These are the same cases: nothing here is held out.\n"),
        (false, 0) => writeln!(out),
        (false, shared) => {
            writeln!(
                out,
                "{shared} of the tested images are among those tuned on: their cases are not held out.\n"
            )
        }
    };
    let mut headings = vec!["detector", if report.own_training { "training" } else { "tuned on" }];
    if !report.same {
        headings.push("tested");
    }
    headings.extend(["95 %", "median of 3", "errors", "one frame", "longest", "time"]);
    let mut table = Table::new(1, &headings);
    for row in &report.detectors {
        let none = || "-".to_string();
        let transience = row.test.transience.as_ref();
        let interval = |(low, high): (f64, f64)| format!("{:.1} to {:.1}", 100.0 * low, 100.0 * high);
        let tested = (!report.same).then(|| percent(row.test.fitness));
        let cells = [
            row.test.interval.map_or_else(none, interval),
            transience.map_or_else(none, |t| percent(t.median_fitness)),
            (row.test.cases - row.test.correct).to_string(),
            transience.and_then(|t| t.single_of_errors).map_or_else(none, percent),
            transience.and_then(|t| t.longest.as_ref()).map_or_else(none, |l| l.frames.to_string()),
            row.microseconds.map_or_else(none, |us| format!("{us:.0} µs")),
        ];
        let first = [row.detector.to_string(), percent(row.training.fitness)];
        table.row(first.into_iter().chain(tested).chain(cells));
    }
    let _ = writeln!(out, "{table}");
    for row in &report.detectors {
        if let Some(tuned) = &row.tuned {
            let source = row.source.map(|source| format!(" ({source})")).unwrap_or_default();
            let _ = writeln!(out, "{}{source}: {tuned}", row.detector);
        }
    }
    let _ = writeln!(out, "\n{NOTE}");
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rivals_are_named_once_each() {
        assert_eq!("all".parse(), Ok(Rivals(Rival::ALL.to_vec())));
        assert_eq!("polly, constant,polly".parse(), Ok(Rivals(vec![Rival::Constant, Rival::Polly])));
        assert!("polly,sonar".parse::<Rivals>().is_err() && "".parse::<Rivals>().is_err());
    }
}
