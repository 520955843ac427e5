//! Fitness cases prepared for evaluation, and the verdict on answers to them.

use std::sync::Arc;

use super::fitness::{CaseBits, behaviour, is_constant, is_correct};
use super::population::Outcome;
use crate::dataset::Dataset;
use crate::exec::Candidate;
use crate::tree::Individual;
use crate::vision::CaseSet;

/// Fitness cases prepared for evaluation.
pub(super) struct Cases {
    set: Arc<CaseSet>,
    labels: Vec<f64>,
    /// How many of them, the first ones, are of images as they are; the others are of altered copies.
    unaltered: usize,
    width: u32,
    height: u32,
    columns: u32,
    distinct_labels: u32,
    tolerance: f64,
}

impl Cases {
    /// The cases of a set that was grown from another by altered copies, which come after those of the other; `set` is
    /// what [`Dataset::case_set`] makes of it.
    pub(super) fn grown(data: &Dataset, from: &Dataset, set: Arc<CaseSet>, tolerance: f64) -> Cases {
        let mut labels = from.labels();
        labels.sort_unstable();
        labels.dedup();
        Cases {
            set,
            labels: data.cases().iter().map(|case| f64::from(case.y)).collect(),
            unaltered: from.cases().len(),
            width: data.width(),
            height: data.height(),
            columns: from.columns().len() as u32,
            distinct_labels: labels.len() as u32,
            tolerance,
        }
    }

    /// How many cases there are.
    pub(super) fn len(&self) -> usize {
        self.labels.len()
    }

    /// How many of them are of images as they are: the first so many.
    pub(super) fn unaltered(&self) -> usize {
        self.unaltered
    }

    /// What the executors run on.
    pub(super) fn set(&self) -> &CaseSet {
        &self.set
    }

    /// Keeps strips of other columns in at most about so many bytes.
    pub(super) fn keep_strips(&self, bytes: usize) {
        self.set.keep_strips(bytes);
    }

    /// Width and height of the images.
    pub(super) fn image_size(&self) -> (u32, u32) {
        (self.width, self.height)
    }

    /// How many distinct columns the unaltered cases ask for.
    pub(super) fn columns(&self) -> u32 {
        self.columns
    }

    /// How many distinct labels the unaltered cases have.
    pub(super) fn distinct_labels(&self) -> u32 {
        self.distinct_labels
    }

    /// The candidate for these cases.
    pub(super) fn candidate<'a>(&self, individual: &'a Individual) -> Candidate<'a> {
        Candidate::new(individual, self.width, self.height)
    }

    /// What these answers, one for each case, are worth and, if asked for, look like on the unaltered cases.
    pub(super) fn verdict(&self, answers: &[f32], looks: bool) -> Verdict {
        let solved = |i: usize| is_correct(answers[i], self.labels[i], self.tolerance);
        let outcome = Outcome {
            solved: CaseBits::from_fn(self.len(), solved),
            behaviour: behaviour(answers),
            constant: is_constant(answers),
        };
        Verdict { outcome, looks: looks.then(|| Looks::of(&answers[..self.unaltered], self.height)) }
    }
}

/// What the answers look like, whether right or wrong.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Looks {
    /// How many lie within the image, 0 to height - 1.
    pub(super) in_range: u32,
    /// How many distinct finite values there are; both zeros are one.
    pub(super) distinct: u32,
}

impl Looks {
    pub(super) fn of(answers: &[f32], height: u32) -> Looks {
        let last = f64::from(height) - 1.0;
        let in_range = answers.iter().filter(|&&a| (0.0..=last).contains(&f64::from(a))).count();
        let mut finite: Vec<f32> = answers.iter().copied().filter(|a| a.is_finite()).collect();
        finite.sort_unstable_by(f32::total_cmp);
        finite.dedup();
        Looks { in_range: in_range as u32, distinct: finite.len() as u32 }
    }
}

/// The result of running an individual.
#[derive(Debug, Clone)]
pub(super) struct Verdict {
    pub(super) outcome: Outcome,
    /// Present if it was asked for.
    pub(super) looks: Option<Looks>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn looks_by_hand() {
        let answers = [0.0, -0.0, 47.0, 47.5, -0.5, f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 3.25, 3.25];
        // In range: both zeros, 47, and 3.25 twice. Distinct: 0, 47, 47.5, -0.5, 3.25.
        assert_eq!(Looks::of(&answers, 48), Looks { in_range: 5, distinct: 5 });
    }
}
