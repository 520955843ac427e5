//! What a report says, before it is a page: plain data, also as JSON.

use std::collections::BTreeMap;

use serde::Serialize;

use crate::dataset::Transience;
use crate::evolve::Record;
use crate::explain::{self, Explanation, text};
use crate::statistics::Quartiles;
use crate::tree::Individual;

/// A report on one run or several.
#[derive(Debug, Clone, Serialize)]
pub struct Report {
    /// What it is headed with.
    pub title: String,
    /// The runs, in the order they were asked for.
    pub runs: Vec<Run>,
    /// How they compare, if there are several.
    pub comparison: Option<Comparison>,
    /// The command that makes this report again.
    pub command: Option<String>,
}

/// A run.
#[derive(Debug, Clone, Serialize)]
pub struct Run {
    /// The name of its folder.
    pub name: String,
    /// Its folder.
    pub folder: String,
    /// The data, in words.
    pub data: String,
    /// Each entry of the data's table in its settings, by dotted name: what tells data apart that are called the same.
    #[serde(skip)]
    pub data_table: BTreeMap<String, String>,
    /// The images that it is tested on in place of those held out, if others were asked for.
    pub tested_on: Option<String>,
    /// The preset that its settings are nearest to.
    pub preset: &'static str,
    /// The seed.
    pub seed: u64,
    /// Individuals in a generation.
    pub population: u32,
    /// Generations asked for.
    pub generations: u32,
    /// Rows within which an answer is correct.
    pub tolerance: f64,
    /// What was set otherwise than in the preset; the seed is no part of it.
    pub differing: Vec<Difference>,
    /// All settings, as the text of `settings.toml`.
    pub settings: String,
    /// Its generations, as `log.jsonl` has them.
    pub records: Vec<Record>,
    /// The warning that the run ended with, if it did.
    pub warning: Option<String>,
    /// The hall of fame, the fittest in training first.
    pub hall_of_fame: Vec<Member>,
    /// The winner; none before there is a generation.
    pub program: Option<Program>,
    /// What the winner reaches on each part of the data.
    pub scores: Vec<Score>,
    /// Its answers looked at one by one.
    pub answers: Option<Answers>,
    /// Detectors of the literature on the same images.
    pub rivals: Option<Rivals>,
    /// What the report does not say, and why.
    pub missing: Vec<String>,
    /// Commands that repeat it all.
    pub commands: Vec<Command>,
}

impl Run {
    /// Whether all generations that were asked for are there.
    pub fn is_complete(&self) -> bool {
        self.records.len() >= self.generations as usize
    }
}

/// A setting that is not what the preset has.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Difference {
    /// The setting, by its dotted name in `settings.toml`.
    pub name: String,
    /// What it is.
    pub value: String,
    /// What it is in the preset.
    pub preset: String,
}

/// One of the hall of fame. Fitnesses are shares, 0 to 1.
#[derive(Debug, Clone, Serialize)]
pub struct Member {
    /// Nodes.
    pub nodes: usize,
    /// The generation it came up in.
    pub generation: u32,
    /// Share of the training cases, altered copies included.
    pub fitness: f64,
    /// Share of the training cases as they were given, where that was evaluated.
    pub train: Option<f64>,
    /// Share of the validation cases.
    pub validation: Option<f64>,
    /// Share of the held-out cases. It chose nothing.
    pub holdout: Option<f64>,
    /// Whether it is the run's winner.
    pub winner: bool,
    /// Its text.
    pub program: String,
}

/// A program.
#[derive(Debug, Clone, Serialize)]
pub struct Program {
    /// Its text as it evolved.
    pub text: String,
    /// Nodes.
    pub nodes: usize,
    /// Depth; a root's is 0.
    pub depth: usize,
    /// Its image operators, by name.
    pub operators: Vec<String>,
    /// The compiler's view of it, where the size of the images is known.
    pub compiled: Option<Compiled>,
    /// It in words.
    pub explanation: Option<ProgramText>,
}

/// What the compiler makes of a program.
#[derive(Debug, Clone, Serialize)]
pub struct Compiled {
    /// Live operations as it was lowered.
    pub operations_before: usize,
    /// Live operations after the optimiser.
    pub operations: usize,
    /// The optimised program, as text.
    pub text: String,
}

/// A program explained, as `vsonar explain` does it.
#[derive(Debug, Clone, Serialize)]
pub struct ProgramText {
    /// The simplified program, and in the margin how often each line counts.
    pub listing: String,
    /// What it was held against.
    pub checked: String,
    /// How to read the listing, what the program uses, and what it does on the data, a line each.
    pub lines: Vec<String>,
    /// What each part contributes: a heading and rows, each of loss, fitness, line, part and what is in its place.
    pub contributions: Vec<[String; 5]>,
    /// What these leave out.
    pub more: String,
    /// The trees as an SVG document.
    #[serde(skip)]
    pub trees: String,
}

/// Characters across a listing, which has half of the first screen.
const LISTING: usize = 76;

impl ProgramText {
    /// From an explanation of the individual.
    pub fn of(explanation: &Explanation, individual: &Individual) -> ProgramText {
        let mut lines = text::notes(&explanation.listing);
        lines.extend(text::uses(explanation));
        lines.extend(text::data(explanation));
        lines.extend(text::sweeps(explanation));
        ProgramText {
            listing: text::listing_within(explanation, LISTING),
            checked: text::checked(explanation),
            lines,
            contributions: text::contributions(explanation),
            more: text::more(explanation),
            trees: explain::trees_svg(individual, &explanation.live),
        }
    }
}

/// The parts of a run's data.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Part {
    /// What selection saw.
    Training,
    /// What chose the winner.
    Validation,
    /// What nothing was chosen by.
    Holdout,
}

impl Part {
    /// In words.
    pub fn name(self) -> &'static str {
        match self {
            Part::Training => "training",
            Part::Validation => "validation",
            Part::Holdout => "held out",
        }
    }
}

/// What the winner reaches on a part of the data. Fitnesses are shares, 0 to 1.
#[derive(Debug, Clone, Serialize)]
pub struct Score {
    /// The part.
    pub part: Part,
    /// Share of the cases that it solves.
    pub fitness: f64,
    /// Cases it solves.
    pub correct: u32,
    /// All cases.
    pub cases: u32,
    /// Images.
    pub images: usize,
    /// The 95 % bootstrap interval of the fitness.
    pub interval: Option<(f64, f64)>,
    /// What the best constant of the training cases reaches.
    pub constant: f64,
    /// What the best constants of the training cases reach, one for each column.
    pub constant_per_column: f64,
}

/// Verdicts counted.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct Tally {
    /// Cases.
    pub cases: usize,
    /// Those answered correctly.
    pub correct: usize,
    /// Wrong answers that see the obstacle nearer than it is: lower in the image.
    pub too_near: usize,
    /// Wrong answers that see it farther.
    pub too_far: usize,
    /// Answers that are no finite number.
    pub not_finite: usize,
}

impl Tally {
    /// Share of the cases answered correctly, 0 to 1.
    pub fn fitness(&self) -> f64 {
        self.correct as f64 / self.cases.max(1) as f64
    }
}

/// Some of the cases.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Group {
    /// What they have in common: a column, an image, a stretch of distances.
    pub name: String,
    /// How they were answered.
    pub tally: Tally,
    /// What the best constants of the training cases solve of them, one for each column, as a share.
    pub constant: Option<f64>,
}

/// The winner's answers on a part of the data.
#[derive(Debug, Clone, Serialize)]
pub struct Answers {
    /// Which part.
    pub part: Part,
    /// All of them.
    pub all: Tally,
    /// By column, from the left.
    pub columns: Vec<Group>,
    /// By image, the worst first.
    pub images: Vec<Group>,
    /// By how far off the obstacle is.
    pub distances: Vec<Group>,
    /// What the distances are measured in.
    pub measure: Measure,
    /// Signed errors in rows, finite answers alone.
    pub errors: Histogram,
    /// How long errors last; none without sequences.
    pub transience: Option<Transience>,
    /// Images that stand for the part, with the answers drawn into them.
    pub views: Vec<Picture>,
    /// Some images with the answers drawn into them, the worst first and then some of the best.
    pub pictures: Vec<Picture>,
}

/// How distance is told.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Measure {
    /// Metres along the floor, by the camera's calibration.
    Metres,
    /// Rows above the lower border, where no calibration is known.
    Rows,
}

/// How often each error occurs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Histogram {
    /// Width of a bin in rows.
    pub width: f64,
    /// Bins in their order: the middle of each, answer less label, and how many. The first and the last hold all beyond.
    pub bins: Vec<(f64, usize)>,
    /// Median of the errors, none without finite answers.
    pub median: Option<f64>,
    /// Median of their magnitudes.
    pub median_magnitude: Option<f64>,
}

/// A picture of a program's answers to an image.
#[derive(Debug, Clone, Serialize)]
pub struct Picture {
    /// The image.
    pub name: String,
    /// Its answers.
    pub tally: Tally,
    /// Width and height of the picture.
    pub size: (u32, u32),
    /// The picture as a PNG file, in base 64.
    #[serde(skip)]
    pub png: String,
}

impl Picture {
    /// The image and its answers, in words.
    pub(super) fn words(&self) -> String {
        format!("{}: {} of {} answers correct", self.name, self.tally.correct, self.tally.cases)
    }
}

/// The table of the rivals.
#[derive(Debug, Clone, Serialize)]
pub struct Rivals {
    /// What all were tested on.
    pub part: Part,
    /// Altered copies of each training image that some were tuned on too (see [`Rival`](crate::baseline::Rival)).
    pub copies: u32,
    /// The rows, the evolved program first.
    pub rows: Vec<Rival>,
}

/// A detector on the same images.
#[derive(Debug, Clone, Serialize)]
pub struct Rival {
    /// Its name.
    pub name: String,
    /// Where it is from.
    pub source: Option<String>,
    /// Its tuned settings in words.
    pub tuned: Option<String>,
    /// Share of the training cases that it solves.
    pub train: f64,
    /// Share of the tested cases.
    pub test: f64,
    /// The 95 % bootstrap interval of it.
    pub interval: Option<(f64, f64)>,
    /// Share of the tested cases with a median over three frames.
    pub median: Option<f64>,
    /// Share of the errors that last one frame.
    pub single: Option<f64>,
    /// Microseconds an image.
    pub microseconds: Option<f64>,
}

/// A command to copy.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Command {
    /// What it does.
    pub what: String,
    /// The command.
    pub command: String,
}

/// Several runs compared.
#[derive(Debug, Clone, Serialize)]
pub struct Comparison {
    /// The settings, each with its runs.
    pub settings: Vec<Setting>,
    /// The part of the data that the tests below are of; none with a single setting.
    pub part: Option<Part>,
    /// The settings against each other.
    pub pairs: Vec<Pair>,
    /// Runs that are another one once more, with the same seed and settings on the same data, and which one: by their
    /// numbers in [`Report::runs`]. They count for nothing.
    pub again: Vec<(usize, usize)>,
}

/// Runs that differ in nothing but the seed.
#[derive(Debug, Clone, Serialize)]
pub struct Setting {
    /// What tells it from the others.
    pub name: String,
    /// Numbers of its runs in [`Report::runs`].
    pub runs: Vec<usize>,
    /// What differs between the settings, in this one.
    pub values: Vec<(String, String)>,
    /// The winners' fitness on each part of the data.
    pub parts: Vec<(Part, Quartiles)>,
    /// Best fitness in training so far, by generation.
    pub best: Vec<Quartiles>,
    /// Mean fitness, by generation.
    pub mean: Vec<Quartiles>,
    /// Mean nodes, by generation.
    pub nodes: Vec<Quartiles>,
    /// Nodes of the winner.
    pub winner_nodes: Option<Quartiles>,
    /// Seconds of a run.
    pub seconds: Option<Quartiles>,
}

/// A setting against another.
#[derive(Debug, Clone, Serialize)]
pub struct Pair {
    /// Number of the one in [`Comparison::settings`].
    pub first: usize,
    /// Number of the other.
    pub second: usize,
    /// The probability that a run of the first is better (ties count half).
    pub a12: f64,
    /// The rank-sum test's p value.
    pub p: f64,
    /// The same corrected for all pairs (Holm).
    pub corrected: f64,
}
