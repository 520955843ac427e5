//! How a program does on a part of the data, beside what a detector that never looks would reach.

use serde::Serialize;
use vsonar::dataset::{Constants, Dataset};
use vsonar::evolve::CaseBits;
use vsonar::report::page;
use vsonar::statistics::{Cluster, interval};

/// Images of a stretch that the bootstrap draws as a whole.
const STRETCH: usize = 5;
/// Draws of the bootstrap.
const RESAMPLES: usize = 2000;

/// How a program does on a part of the data.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct Part {
    pub(crate) fitness: f64,
    pub(crate) correct: u32,
    pub(crate) cases: u32,
    /// The 95 % bootstrap interval of the fitness over stretches of five consecutive images; none if there is but one.
    pub(crate) interval: Option<(f64, f64)>,
    /// The best constant of the training cases.
    pub(crate) constant: f64,
    /// The best constants of the training cases, one for each column.
    pub(crate) constant_per_column: f64,
    /// The same by column.
    pub(crate) columns: Vec<Column>,
}

/// How a program does on the cases of a column.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct Column {
    pub(crate) x: u32,
    pub(crate) fitness: f64,
    /// The best constant of the training cases for this column.
    pub(crate) constant: f64,
    correct: u32,
    cases: u32,
}

impl Part {
    /// The score of a program that solves these cases of a set.
    pub(crate) fn of(set: &Dataset, solved: &CaseBits, constants: &Constants) -> Part {
        let floor = constants.score(set);
        let mut images = vec![Cluster { correct: 0, cases: 0 }; set.images().len()];
        for (i, case) in set.cases().iter().enumerate() {
            images[case.image].cases += 1;
            images[case.image].correct += u32::from(solved.contains(i));
        }
        let stretch = |stretch: Vec<usize>| Cluster {
            correct: stretch.iter().map(|&image| images[image].correct).sum(),
            cases: stretch.iter().map(|&image| images[image].cases).sum(),
        };
        let stretches: Vec<Cluster> = set.stretches(STRETCH).into_iter().map(stretch).collect();
        Part {
            fitness: solved.fitness(),
            correct: solved.count(),
            cases: solved.len() as u32,
            interval: interval(&stretches, 0.95, RESAMPLES, 0),
            constant: floor.overall_share(),
            constant_per_column: floor.per_column_share(),
            columns: set.columns().into_iter().map(|x| Column::of(set, x, solved, constants)).collect(),
        }
    }
}

impl Part {
    /// The same as a page has it.
    pub(crate) fn for_page(&self, part: page::Part, set: &Dataset) -> page::Score {
        page::Score {
            part,
            fitness: self.fitness,
            correct: self.correct,
            cases: self.cases,
            images: set.images().len(),
            interval: self.interval,
            constant: self.constant,
            constant_per_column: self.constant_per_column,
        }
    }
}

impl Column {
    fn of(set: &Dataset, x: u32, solved: &CaseBits, constants: &Constants) -> Column {
        let cases = set.cases().iter().enumerate().filter(|(_, case)| case.x == x);
        let (mut correct, mut count, mut constant) = (0, 0, 0);
        for (i, case) in cases {
            count += 1;
            correct += u32::from(solved.contains(i));
            constant += u32::from(constants.is_correct(case));
        }
        let share = |part: u32| f64::from(part) / f64::from(count.max(1));
        Column { x, fitness: share(correct), constant: share(constant), correct, cases: count }
    }
}
