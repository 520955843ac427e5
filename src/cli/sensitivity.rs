//! How a program does when light, lens or view are not what they were: the table of `vsonar eval --sensitivity`.

use serde::Serialize;
use vsonar::dataset::{Constants, Dataset, Transform};
use vsonar::evolve::is_correct;
use vsonar::exec::Executor;
use vsonar::tree::Individual;

use super::CliError;
use super::executor::answers;
use super::output::percent;
use super::table::Table;

/// Seed of the noise; each image has a stream of its own.
const SEED: u64 = 1;

/// What is said below the table.
const NOTE: &str = "\
Same cases: the program on the unmodified images, on those cases that the change leaves (a column may leave the image; \
between columns: both neighbours). Constant: the best answer of each column of the unmodified images, where columns have \
moved that of the nearest. Labels move with the picture. Between two labelled columns they are interpolated, where these \
differ by no more than the tolerance: a guess, and on the easier part of the cases.";

/// A kind of change and how strongly it is tried.
struct Kind {
    name: &'static str,
    unit: &'static str,
    strengths: &'static [f64],
    change: fn(f64) -> Change,
}

/// What is done to the set.
enum Change {
    Transform(Transform),
    /// Cases so far between labelled columns.
    Between(f64),
}

fn by(transform: Transform) -> Change {
    Change::Transform(transform)
}

fn shift(right: f64, down: f64) -> Change {
    by(Transform::Shift { right: right as i32, down: down as i32 })
}

const KINDS: &[Kind] = &[
    Kind {
        name: "light",
        unit: "times",
        strengths: &[0.5, 0.7, 0.85, 1.2, 1.4, 2.0],
        change: |factor| by(Transform::Gain(factor)),
    },
    Kind {
        name: "brightness",
        unit: "levels",
        strengths: &[-60.0, -30.0, -15.0, 15.0, 30.0, 60.0],
        change: |levels| by(Transform::Brightness(levels)),
    },
    Kind {
        name: "contrast",
        unit: "times",
        strengths: &[0.5, 0.75, 1.25, 1.5],
        change: |factor| by(Transform::Contrast(factor)),
    },
    Kind {
        name: "gamma",
        unit: "exponent",
        strengths: &[0.5, 0.75, 1.33, 2.0],
        change: |exponent| by(Transform::Gamma(exponent)),
    },
    Kind {
        name: "noise",
        unit: "levels",
        strengths: &[2.0, 5.0, 10.0, 20.0],
        change: |deviation| by(Transform::Noise { deviation, seed: SEED }),
    },
    Kind {
        name: "blur",
        unit: "pixels",
        strengths: &[0.5, 1.0, 2.0, 4.0],
        change: |deviation| by(Transform::Blur(deviation)),
    },
    Kind {
        name: "down",
        unit: "pixels",
        strengths: &[-20.0, -10.0, -5.0, 5.0, 10.0, 20.0],
        change: |pixels| shift(0.0, pixels),
    },
    Kind {
        name: "right",
        unit: "pixels",
        strengths: &[-32.0, -16.0, -4.0, 4.0, 16.0, 32.0],
        change: |pixels| shift(pixels, 0.0),
    },
    Kind {
        name: "between columns",
        unit: "of the way",
        strengths: &[0.25, 0.5, 0.75],
        change: Change::Between,
    },
    Kind { name: "mirrored", unit: "", strengths: &[1.0], change: |_| by(Transform::Mirror) },
];

/// How the program does under one change.
#[derive(Debug, Clone, Serialize)]
pub(super) struct Row {
    change: &'static str,
    /// How strong it is, in its unit.
    strength: f64,
    unit: &'static str,
    correct: usize,
    cases: usize,
    /// None where no case is left.
    fitness: Option<f64>,
    /// The fitness on the same cases of the unmodified set.
    unmodified: Option<f64>,
    /// What the best constants of the columns of the unmodified set reach.
    constant_per_column: Option<f64>,
}

impl Row {
    /// Without any case.
    fn empty(kind: &Kind, strength: f64) -> Row {
        Row {
            change: kind.name,
            strength,
            unit: kind.unit,
            correct: 0,
            cases: 0,
            fitness: None,
            unmodified: None,
            constant_per_column: None,
        }
    }
}

/// Runs the program under all changes, one after the other: each takes as much memory as the set itself. `original` are
/// its answers to the set as it is.
pub(super) fn rows(
    executor: &dyn Executor,
    individual: &Individual,
    set: &Dataset,
    original: &[f32],
    tolerance: f64,
) -> Result<Vec<Row>, CliError> {
    let constants = Constants::learn(set, tolerance);
    let solved = solved(set, original, tolerance);
    let mut rows = Vec::new();
    for kind in KINDS {
        for &strength in kind.strengths {
            let mut row = Row::empty(kind, strength);
            if let Some((changed, sources)) = changed(set, (kind.change)(strength), tolerance) {
                let answers = answers(executor, individual, &changed)?;
                row.cases = answers.len();
                row.correct = self::solved(&changed, &answers, tolerance).iter().filter(|&&s| s).count();
                let share = |part: f64| Some(part / row.cases as f64);
                row.fitness = share(row.correct as f64);
                let before = |[a, b]: &[usize; 2]| (f64::from(solved[*a]) + f64::from(solved[*b])) / 2.0;
                row.unmodified = share(sources.iter().map(before).sum());
                row.constant_per_column = share(constants.score_near(&changed) as f64);
            }
            rows.push(row);
        }
    }
    Ok(rows)
}

/// The changed set, and for each of its cases the two cases of the set (as a rule one and the same) that it comes from;
/// `None` if no case is left.
fn changed(set: &Dataset, change: Change, tolerance: f64) -> Option<(Dataset, Vec<[usize; 2]>)> {
    match change {
        Change::Between(fraction) => set.between(fraction, tolerance),
        Change::Transform(transform) => {
            let left = |(i, &case)| transform.case(case, set.width(), set.height()).map(|_| [i, i]);
            let sources = set.cases().iter().enumerate().filter_map(left).collect();
            Some((set.transformed(transform).ok()?, sources))
        }
    }
}

/// Which cases these answers solve.
fn solved(set: &Dataset, answers: &[f32], tolerance: f64) -> Vec<bool> {
    let solved =
        |(case, answer): (&vsonar::dataset::Case, &f32)| is_correct(*answer, case.y.into(), tolerance);
    set.cases().iter().zip(answers).map(solved).collect()
}

/// The table for people, and what its columns mean.
pub(super) fn text(rows: &[Row]) -> String {
    let mut table =
        Table::new(1, &["change", "", "cases", "fitness", "same cases", "difference", "constant"]);
    for row in rows {
        let sign = matches!(row.change, "brightness" | "down" | "right") && row.strength > 0.0;
        let strength = match row.unit {
            "" => String::new(),
            unit => format!("{}{} {unit}", if sign { "+" } else { "" }, row.strength),
        };
        let share = |share: Option<f64>| share.map_or("-".to_string(), percent);
        let difference = row.fitness.zip(row.unmodified).map(|(new, old)| 100.0 * (new - old));
        // A difference that would be printed as -0.0 is none.
        let difference = difference.map(|d| if d.abs() < 0.05 { 0.0 } else { d });
        table.row([
            row.change.to_string(),
            strength,
            row.cases.to_string(),
            share(row.fitness),
            share(row.unmodified),
            difference.map_or(String::new(), |d| format!("{d:+.1}")),
            share(row.constant_per_column),
        ]);
    }
    format!("{table}\n{NOTE}\n")
}
