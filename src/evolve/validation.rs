//! Validation: cases that selection never sees choose the run's winner from the hall of fame.
//!
//! What is fittest in training has often learned the training images by heart; a smaller program of the hall of fame,
//! less fit there, may be fitter elsewhere. The validation part tells. It is no test: the winner was chosen by it.

use super::cases::Cases;
use super::evaluate::{EvaluateError, Evaluator};
use super::fitness::CaseBits;
use super::hall_of_fame::{Entry, HallOfFame};
use super::rank::rank;
use crate::tree::Individual;

/// The validation part, and what it said of the entries of the hall of fame.
pub(super) struct Validation {
    cases: Cases,
    known: Vec<(Individual, CaseBits)>,
}

impl Validation {
    pub(super) fn new(cases: Cases) -> Validation {
        Validation { cases, known: Vec::new() }
    }

    /// Judges the entries, those that are new by running them.
    pub(super) fn judge(&mut self, evaluator: &Evaluator, hall: &HallOfFame) -> Result<(), EvaluateError> {
        let mut known = Vec::with_capacity(hall.entries().len());
        for Entry { individual, .. } in hall.entries() {
            let place = self.known.iter().position(|(other, _)| other == individual);
            known.push(match place {
                Some(place) => self.known.swap_remove(place),
                None => {
                    let solved = evaluator.score(individual, &self.cases)?.outcome.solved;
                    (individual.clone(), solved)
                }
            });
        }
        self.known = known;
        Ok(())
    }

    /// The verdicts on the entries that were judged last, in their order.
    pub(super) fn verdicts(&self) -> Verdicts<'_> {
        Verdicts(Some(&self.known))
    }
}

/// What validation says of the entries of a hall of fame, in their order; nothing without a validation part.
#[derive(Clone, Copy)]
pub(super) struct Verdicts<'a>(Option<&'a [(Individual, CaseBits)]>);

impl<'a> Verdicts<'a> {
    pub(super) const NONE: Verdicts<'static> = Verdicts(None);

    /// The validation cases that an entry solves.
    pub(super) fn of(&self, entry: usize) -> Option<&'a CaseBits> {
        Some(&self.0?.get(entry)?.1)
    }

    /// The winner by [`rank`]: the entry that solves most validation cases, without a validation part most training cases;
    /// ties go to training, then to size.
    pub(super) fn winner<'h>(&self, hall: &'h HallOfFame) -> Option<(&'h Entry, Option<&'a CaseBits>)> {
        let entries = hall.entries().iter().enumerate().map(|(i, entry)| (i, entry, self.of(i)));
        let key = |(i, entry, solved): &(usize, &Entry, Option<&CaseBits>)| {
            let chosen = solved.map_or(entry.correct, CaseBits::count);
            rank(chosen.into(), entry.correct.into(), entry.individual.len() as u64, *i as u64)
        };
        entries.min_by_key(key).map(|(_, entry, solved)| (entry, solved))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hall(nodes_and_correct: &[(usize, u32)]) -> HallOfFame {
        let mut hall = HallOfFame::default();
        for &(additions, correct) in nodes_and_correct {
            let body = (0..additions).fold("x".to_string(), |body, _| format!("(+ {body} y)"));
            let tree = format!("(iterate-up 2x2 x-obstacle (set-a {body}))");
            let individual: Individual = format!("(individual {tree} {tree})").parse().expect("a program");
            hall.offer(&individual, correct, 0);
        }
        hall
    }

    #[test]
    fn of_equal_ones_in_validation_the_fittest_in_training_wins() {
        let hall = hall(&[(0, 5), (1, 6), (2, 7), (3, 9)]);
        let verdicts: Vec<(Individual, CaseBits)> = [3, 8, 8, 4]
            .iter()
            .zip(hall.entries())
            .map(|(&n, entry)| (entry.individual.clone(), CaseBits::from_fn(10, |case| case < n)))
            .collect();
        let (winner, solved) = Verdicts(Some(&verdicts)).winner(&hall).expect("entries");
        assert_eq!((winner.correct, solved.map(CaseBits::count)), (7, Some(8)));
        let (winner, solved) = Verdicts::NONE.winner(&hall).expect("entries");
        assert_eq!((winner.correct, solved), (9, None));
        assert!(Verdicts::NONE.winner(&HallOfFame::default()).is_none());
    }
}
