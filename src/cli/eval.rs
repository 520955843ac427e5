//! `vsonar eval`: how a program does on a set of labelled images, case by case.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use serde::Serialize;
use vsonar::dataset::scale::in_proportion;
use vsonar::dataset::{BestConstant, Constants, Dataset, TOLERANCE, Transience};
use vsonar::evolve::is_correct;
use vsonar::support::printable::{self, ShownPath as _};
use vsonar::tree::{Individual, Shortest};

use super::CliError;
use super::against::{self, Comparison, Named, Rivals};
use super::eval_cases::{RunPart, What, no_data, what};
use super::executor::{Choice, answers};
use super::gray_note::note_gray;
use super::memory::MemoryArgs;
use super::output::{self, Own, count, percent};
use super::program;
use super::progress::{Bar, Style};
use super::sensitivity;
use super::table::Table;
use super::tuning::Copies;

const EXAMPLES: &str = "\
Examples:
  vsonar eval runs/photos-seed-1/best.gp --data photos
  vsonar eval best.gp --data photos --match 'run_C*' --json
  vsonar eval runs/photos-seed-1 --part validation
  vsonar eval best.gp --data photos --answers answers.csv
  vsonar eval best.gp --data photos --sensitivity
  vsonar eval runs/photos-seed-1 --against all
  vsonar eval best.gp --data photos --match 'run_C*' --tune-on photos --tune-on-match 'run_[AB]*' --against all

An answer is correct within the tolerance of the label. Too near: it sees the obstacle lower in the image than it \
is, so nearer to the camera. Too far: higher. An answer that is no finite number is wrong too, and counted apart.";

/// The file of answers.
const ANSWERS: Own = Own { what: "table of answers", begins: "image,x,label,answer", holds: "" };

/// Test a program on labelled images
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    /// The program, a .gp file; or a run folder, for its best program on its own data; not needed with `--against`
    #[arg(required_unless_present = "against")]
    pub(super) program: Option<PathBuf>,
    /// Folder with `labels.csv` and the images it names [default: the data of the run folder]
    #[arg(long, value_name = "DIR")]
    pub(super) data: Option<PathBuf>,
    /// Which part of the run folder's data [default: holdout if there is one and the run is complete, else train]
    #[arg(long, value_enum, value_name = "PART", conflicts_with_all = ["data", "pattern"])]
    pub(super) part: Option<RunPart>,
    /// Only the images whose names match this pattern, e.g. 'run_C*'
    #[arg(
        long = "match",
        value_name = "GLOB",
        requires = "data",
        alias = "holdout-match",
        alias = "train-match"
    )]
    pub(super) pattern: Option<String>,
    /// What runs the program; all give the same answers
    #[arg(long, value_name = "NAME", value_enum, default_value_t = Choice::Auto)]
    executor: Choice,
    #[command(flatten)]
    pub(super) memory: MemoryArgs,
    #[arg(long, value_name = "ROWS", value_parser = tolerance, allow_negative_numbers = true, help = tolerance_help())]
    pub(super) tolerance: Option<f64>,
    /// Test it also on changed images: light, brightness, contrast, gamma, noise, blur, moved up, down and aside, mirrored,
    /// and between the labelled columns
    ///
    /// Down by 10 pixels is about what a camera of 320 pixels and 90 degrees shows that is pitched up by 3.6 degrees.
    #[arg(long, conflicts_with = "answers")]
    sensitivity: bool,
    /// Compare with detectors of the literature, tuned on the training images: all, or some of constant, gradient, polly,
    /// lorigo and ulrich, as polly,ulrich
    #[arg(long, value_name = "NAMES", conflicts_with_all = ["answers", "sensitivity"])]
    pub(super) against: Option<Rivals>,
    /// Folder with the images that the rivals are tuned on [default: the training images of the run folder]
    #[arg(long, value_name = "DIR", requires = "against")]
    pub(super) tune_on: Option<PathBuf>,
    /// Only the images of it whose names match this pattern, e.g. 'run_[AB]*'
    #[arg(long, value_name = "GLOB", requires = "tune_on")]
    pub(super) tune_on_match: Option<String>,
    /// Print the report as JSON
    #[arg(long)]
    json: bool,
    /// Write every answer as CSV (image,x,label,answer) to this file, or to standard output (-)
    #[arg(long, value_name = "FILE")]
    answers: Option<PathBuf>,
}

pub(super) fn tolerance_help() -> String {
    format!(
        "An answer is correct within this many rows of the label; for a program in a run folder, by default, as many as the run's settings say \
         [default: {TOLERANCE}]"
    )
}

pub(super) fn tolerance(text: &str) -> Result<f64, String> {
    let rows = text.parse::<f64>().ok().filter(|rows| rows.is_finite() && *rows >= 0.0);
    rows.ok_or_else(|| "give a number of rows, 0 or more".to_string())
}

/// Verdicts counted.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
struct Counts {
    fitness: f64,
    correct: usize,
    cases: usize,
    too_near: usize,
    too_far: usize,
    not_finite: usize,
}

impl Counts {
    fn of<'a>(cases: impl Iterator<Item = (&'a f32, u32)>, tolerance: f64) -> Counts {
        let mut counts = Counts::default();
        for (&answer, label) in cases {
            let label = f64::from(label);
            counts.cases += 1;
            if is_correct(answer, label, tolerance) {
                counts.correct += 1;
            } else if !answer.is_finite() {
                counts.not_finite += 1;
            } else if f64::from(answer) > label {
                counts.too_near += 1;
            } else {
                counts.too_far += 1;
            }
        }
        counts.fitness = counts.correct as f64 / counts.cases.max(1) as f64;
        counts
    }

    fn cells(&self) -> [String; 6] {
        let numbers = [self.cases, self.correct, self.too_near, self.too_far, self.not_finite];
        let [cases, correct, near, far, other] = numbers.map(|n| n.to_string());
        [cases, correct, percent(self.fitness), near, far, other]
    }
}

#[derive(Debug, Clone, Serialize)]
struct Column {
    x: u32,
    #[serde(flatten)]
    counts: Counts,
    constant: BestConstant,
}

#[derive(Debug, Clone, Serialize)]
struct Image {
    image: String,
    #[serde(flatten)]
    counts: Counts,
}

/// What the best constants of the training cases reach on the same cases.
#[derive(Debug, Clone, Copy, Serialize)]
struct Trained {
    fitness: f64,
    per_column_fitness: f64,
}

/// What a constant answer reaches on the same cases, chosen with their labels in view.
#[derive(Debug, Clone, Serialize)]
struct Floor {
    answer: f64,
    correct: usize,
    fitness: f64,
    per_column_correct: usize,
    per_column_fitness: f64,
}

#[derive(Debug, Clone, Serialize)]
struct Report {
    program: PathBuf,
    data: PathBuf,
    /// What people call the images.
    #[serde(skip)]
    images_of: String,
    tolerance: f64,
    /// Height of the images in pixels.
    height: u32,
    #[serde(flatten)]
    counts: Counts,
    constant: Floor,
    /// Of a run folder's data, unless they are the training cases themselves.
    #[serde(skip_serializing_if = "Option::is_none")]
    trained_constant: Option<Trained>,
    columns: Vec<Column>,
    images: Vec<Image>,
    /// How long errors last; none without sequences.
    transience: Option<Transience>,
    #[serde(skip_serializing_if = "Option::is_none")]
    sensitivity: Option<Vec<sensitivity::Row>>,
}

/// Runs a program on a data set and reports.
pub(crate) fn run(args: Args) -> Result<(), CliError> {
    let to_stdout = args.answers.as_deref() == Some(Path::new("-"));
    if to_stdout && args.json {
        let text = "`--answers -` and `--json` both write to standard output; give the answers a file";
        return Err(CliError::Usage(text.to_string()));
    }
    if let Some(file) = args.answers.as_deref().filter(|_| !to_stdout) {
        ANSWERS.may_replace(file)?;
    }
    let program = args.program.as_deref().map(program::file).transpose()?;
    let _busy = Bar::spinner(Style::of(false), "preparing and evaluating the images");
    let What { set, name, tolerance, train, trained, copies } = what(&args)?;
    let loaded = program.as_deref().map(Individual::load_with_text).transpose()?;
    if let Some(program) = args.program.as_deref().filter(|_| args.data.is_some()) {
        note_gray(program);
    }
    if let Some((path, (_, text))) = program.as_deref().zip(loaded.as_ref()) {
        program::note_size(path, text, (set.width(), set.height()));
    }
    let individual = loaded.map(|(individual, _)| individual);
    if let Some(rivals) = &args.against {
        let program = program.as_deref().zip(individual.as_ref());
        return compare(&args, rivals, program, Named { name, set }, train, (tolerance, copies));
    }
    let (Some(program), Some(individual)) = (program, individual) else {
        return Err(no_data(None));
    };
    let executor = args.executor.make()?;
    args.memory.check([&set])?;
    let answers = answers(&*executor, &individual, &set)?;
    if let Some(file) = &args.answers {
        let csv = csv(&set, &answers)?;
        if to_stdout {
            return output::print_data(&csv);
        }
        ANSWERS.write(file, &csv)?;
    }
    let mut report = Report { images_of: name, ..report(&args, program, tolerance, &set, &answers) };
    report.trained_constant = trained.map(|constants| {
        let score = constants.score(&set);
        Trained { fitness: score.overall_share(), per_column_fitness: score.per_column_share() }
    });
    if args.sensitivity {
        let rows = sensitivity::rows(&*executor, &individual, &set, &answers, tolerance)?;
        report.sensitivity = Some(rows);
    }
    if args.json { output::print_json(&report) } else { output::print(&text(&report)) }
}

/// Compares with rivals.
fn compare(
    args: &Args,
    rivals: &Rivals,
    program: Option<(&Path, &Individual)>,
    test: Named,
    train: Option<Named>,
    (tolerance, copies): (f64, Copies),
) -> Result<(), CliError> {
    let Some(train) = train else {
        let text = "`--against` has to know what to tune the rivals on: give a run folder, whose training images they are \
                    then, or `--tune-on DIR`";
        return Err(CliError::Usage(text.to_string()));
    };
    let executor = args.executor.make()?;
    if program.is_some() {
        args.memory.check([&test.set, &train.set])?;
    }
    let own_training = args.tune_on.is_none();
    let comparison = Comparison {
        program,
        executor: &*executor,
        train: &train,
        own_training,
        test: &test,
        tolerance,
        copies,
    };
    against::run(&comparison, rivals, args.json)
}

/// The answers as CSV, in the order of the cases.
fn csv(set: &Dataset, answers: &[f32]) -> Result<String, CliError> {
    let mut csv = csv::Writer::from_writer(Vec::new());
    csv.write_record(["image", "x", "label", "answer"])?;
    for (case, &answer) in set.cases().iter().zip(answers) {
        let image = set.images()[case.image].name.as_str();
        csv.write_record([image, &case.x.to_string(), &case.y.to_string(), &Shortest(answer).to_string()])?;
    }
    let bytes = csv.into_inner().map_err(|e| CliError::Failed(e.to_string()))?;
    Ok(String::from_utf8(bytes)?)
}

fn report(args: &Args, program: PathBuf, tolerance: f64, set: &Dataset, answers: &[f32]) -> Report {
    let counts = |keep: &dyn Fn(&vsonar::dataset::Case) -> bool| {
        let cases = set.cases().iter().zip(answers).filter(|(case, _)| keep(case));
        Counts::of(cases.map(|(case, answer)| (answer, case.y)), tolerance)
    };
    let constants = Constants::learn(set, tolerance);
    let floor = constants.score(set);
    let column = |&(x, constant): &(u32, BestConstant)| Column { x, counts: counts(&|c| c.x == x), constant };
    let image = |(i, image): (usize, &vsonar::dataset::NamedImage)| Image {
        image: image.name.clone(),
        counts: counts(&|c| c.image == i),
    };
    Report {
        program,
        data: args.data.clone().unwrap_or_else(|| set.name().into()),
        images_of: String::new(),
        tolerance,
        height: set.height(),
        counts: counts(&|_| true),
        constant: Floor {
            answer: constants.overall().answer,
            correct: floor.overall,
            fitness: floor.overall_share(),
            per_column_correct: floor.per_column,
            per_column_fitness: floor.per_column_share(),
        },
        trained_constant: None,
        columns: constants.columns().iter().map(column).collect(),
        images: set.images().iter().enumerate().map(image).collect(),
        transience: Transience::of(set, answers, tolerance),
        sensitivity: None,
    }
}

const HEADINGS: [&str; 6] = ["cases", "correct", "fitness", "too near", "too far", "not finite"];

fn text(report: &Report) -> String {
    let mut out = String::new();
    // Writing to a string cannot fail.
    let _ = writeln!(
        out,
        "{} on {}: {} ({} of {} cases) within {}\n\
         {}constants chosen on these very images: per column {}; one for all columns {}\n",
        report.program.shown(),
        report.images_of,
        percent(report.counts.fitness),
        report.counts.correct,
        report.counts.cases,
        in_proportion(report.tolerance, report.height),
        report.trained_constant.map_or_else(String::new, |c| format!(
            "best constants of the training images: per column {}; one for all columns {}\n",
            percent(c.per_column_fitness),
            percent(c.fitness)
        )),
        percent(report.constant.per_column_fitness),
        percent(report.constant.fitness),
    );
    if let Some(transience) = &report.transience {
        let _ = writeln!(out, "{}\n", lasting(transience));
    }
    match &report.sensitivity {
        Some(rows) => out += &sensitivity::text(rows),
        None => parts(report, &mut out),
    }
    out
}

/// How long errors last, for people.
fn lasting(transience: &Transience) -> String {
    let median = format!("With a median over three frames: {}", percent(transience.median_fitness));
    let Some(longest) = transience.longest.as_ref() else { return median };
    let single =
        transience.single_of_errors.map_or_else(|| "none of which it can be told".to_string(), percent);
    let frames = count(longest.frames as u64, "labelled frame");
    let undecided = match transience.undecided {
        0 => String::new(),
        n => format!("; {n} in the last frame of a sequence count neither way"),
    };
    format!(
        "Errors that are gone in the next labelled frame: {single}{undecided}; the longest lasts {frames}: column {} from \
         {} on\n{median}",
        longest.column,
        printable::line(&longest.image)
    )
}

/// The tables of columns and of images with errors.
fn parts(report: &Report, out: &mut String) {
    let headings = |first| -> Vec<&str> { std::iter::once(first).chain(HEADINGS).collect() };
    let cells = |name: String, counts: &Counts| std::iter::once(name).chain(counts.cells());
    let mut columns = Table::new(1, &[&headings("column")[..], &["constant", "correct"]].concat());
    for c in &report.columns {
        let constant = [c.constant.answer.to_string(), c.constant.correct.to_string()];
        columns.row(cells(c.x.to_string(), &c.counts).chain(constant));
    }
    let all = [report.constant.answer.to_string(), report.constant.correct.to_string()];
    columns.row(cells("all".to_string(), &report.counts).chain(all));
    let mut wrong: Vec<&Image> = report.images.iter().filter(|i| i.counts.correct < i.counts.cases).collect();
    wrong.sort_by(|a, b| a.counts.fitness.total_cmp(&b.counts.fitness));
    let mut images = Table::new(1, &headings("image"));
    wrong.iter().for_each(|i| images.row(cells(i.image.clone(), &i.counts)));
    let _ = writeln!(out, "{columns}");
    let _ = if wrong.is_empty() {
        writeln!(out, "Every case of every image is correct.")
    } else {
        write!(
            out,
            "Images with errors, the worst first ({} of {}):\n{images}",
            wrong.len(),
            report.images.len()
        )
    };
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn near_is_lower_in_the_image() {
        let cases = [(20.0, 10), (111.0, 100), (89.0, 100), (f32::INFINITY, 0), (f32::NAN, 0), (90.0, 100)];
        let counts = Counts::of(cases.iter().map(|(answer, label)| (answer, *label)), 10.0);
        assert_eq!((counts.correct, counts.too_near, counts.too_far, counts.not_finite), (2, 1, 1, 2));
        assert_eq!(counts.fitness, 2.0 / 6.0);
    }
}
