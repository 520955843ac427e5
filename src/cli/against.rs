//! `vsonar eval --against`: an evolved program beside the rivals of the literature, in one table.

use std::fmt::Write as _;
use std::path::PathBuf;
use std::time::Instant;

use serde::Serialize;
use vsonar::baseline::{Rival, Tuned, UnknownRival};
use vsonar::dataset::{Constants, Dataset, Transience};
use vsonar::detector::{CompiledDetector, SequenceDetector};
use vsonar::evolve::{CaseBits, is_correct};
use vsonar::tree::Individual;

use super::CliError;
use super::executor::with_stack;
use super::output::{self, count, percent};
use super::part::Part;
use super::table::Table;

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

/// What is compared, and on what.
pub(super) struct Comparison<'a> {
    /// The evolved program and its file, if there is one.
    pub(super) program: Option<(PathBuf, &'a Individual)>,
    /// What the rivals are tuned on, and where it is from.
    pub(super) train: (PathBuf, &'a Dataset),
    /// What all are tested on, and where it is from.
    pub(super) test: (PathBuf, &'a Dataset),
    pub(super) tolerance: f64,
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
    detector: String,
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
    tuned_on: PathBuf,
    tested_on: PathBuf,
    tolerance: f64,
    /// Whether test and training are the same cases.
    same: bool,
    /// Tested images that are among the training images too.
    shared_images: usize,
    test_images: usize,
    detectors: Vec<Row>,
}

/// Tunes the rivals, tests all, and prints the table.
pub(super) fn run(comparison: &Comparison, rivals: &Rivals, json: bool) -> Result<(), CliError> {
    let (train, test) = (comparison.train.1, comparison.test.1);
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
    let report = with_stack(|| report(comparison, rivals))??;
    if json { output::print_json(&report) } else { output::print(&text(&report)) }
}

fn report(comparison: &Comparison, rivals: &Rivals) -> Result<Report, CliError> {
    let ((train_at, train), (test_at, test)) = (&comparison.train, &comparison.test);
    let mut detectors = Vec::new();
    if let Some((_, individual)) = &comparison.program {
        let mut detector = CompiledDetector::compile_individual(individual, test.width(), test.height())?;
        let row = Row::of("evolved".to_string(), None, &mut detector, comparison)?;
        detectors.push(row);
    }
    for &rival in &rivals.0 {
        let mut tuned = rival.tune(train, comparison.tolerance);
        let row = Row::of(rival.name().to_string(), rival.source(), &mut tuned, comparison)?;
        let (described, tried) = (Some(tuned.describe()), Some(tuned.tried()));
        detectors.push(Row { tuned: described, tried, settings: Some(tuned), ..row });
    }
    let known: std::collections::HashSet<&[u8]> =
        train.images().iter().map(|image| image.pixels.as_raw().as_slice()).collect();
    let shared = test.images().iter().filter(|image| known.contains(image.pixels.as_raw().as_slice()));
    Ok(Report {
        program: comparison.program.as_ref().map(|(path, _)| path.clone()),
        tuned_on: train_at.clone(),
        tested_on: test_at.clone(),
        tolerance: comparison.tolerance,
        same: train.fingerprint() == test.fingerprint(),
        shared_images: shared.count(),
        test_images: test.images().len(),
        detectors,
    })
}

impl Row {
    fn of(
        name: String,
        source: Option<&'static str>,
        detector: &mut dyn SequenceDetector,
        comparison: &Comparison,
    ) -> Result<Row, CliError> {
        let (train, test) = (comparison.train.1, comparison.test.1);
        let mut timed = Timed { detector, seconds: Vec::new() };
        let mut score = |set| -> Result<Scored, CliError> {
            timed.seconds.clear();
            let answers = vsonar::baseline::answers(&mut timed, set)?;
            Ok(Scored::of(set, &answers, comparison.tolerance))
        };
        let (training, test) = (score(train)?, score(test)?);
        timed.seconds.sort_by(f64::total_cmp);
        let median = timed.seconds.get(timed.seconds.len() / 2).map(|seconds| 1e6 * seconds);
        Ok(Row {
            detector: name,
            source,
            tuned: None,
            settings: None,
            tried: None,
            training,
            test,
            microseconds: median,
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
Rivals are tuned on the training cases alone. 95 %: bootstrap interval over stretches of five images. Median of 3: the
fitness if each answer is the median of this frame's and the last two's. One frame: share of the errors that are gone in
the next labelled frame of the column; longest: most frames in a row. Time: the labelled columns of an image.";

fn text(report: &Report) -> String {
    let mut out = String::new();
    // Writing to a string cannot fail.
    let _ = writeln!(
        out,
        "Tested on {}, {}, within {} rows; tuned on {}",
        report.tested_on.display(),
        count(report.test_images as u64, "image"),
        report.tolerance,
        report.tuned_on.display()
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
    let mut headings = vec!["detector", "training"];
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
            transience.and_then(Transience::single_errors).map_or_else(none, percent),
            transience.and_then(|t| t.longest.as_ref()).map_or_else(none, |l| l.frames.to_string()),
            row.microseconds.map_or_else(none, |us| format!("{us:.0} µs")),
        ];
        let first = [row.detector.clone(), percent(row.training.fitness)];
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
