//! The order in which a program is chosen among several: those of a hall of fame, or the winners of several runs.

use std::cmp::Reverse;

/// The key of the order; the least is chosen: the program that is best by `chosen` (validation, or training where
/// there is none), on ties the one that is best in training, then the smallest, then the first.
///
/// `chosen` and `train` are shares or numbers of solved cases, not negative; `first` is a position or a seed.
pub fn rank(chosen: f64, train: f64, nodes: u64, first: u64) -> impl Ord {
    // Of numbers that are not negative the bits are in the same order.
    (Reverse(chosen.to_bits()), Reverse(train.to_bits()), nodes, first)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ties_go_to_training_then_to_size_then_to_the_first() {
        let chosen = |programs: &[(f64, f64, u64)]| {
            let of = |i: &usize| rank(programs[*i].0, programs[*i].1, programs[*i].2, *i as u64);
            (0..programs.len()).min_by_key(of)
        };
        assert_eq!(chosen(&[(0.9, 0.671, 9), (0.9, 0.877, 10)]), Some(1), "training before size");
        assert_eq!(chosen(&[(0.9, 0.5, 90), (0.8, 1.0, 9)]), Some(0), "what chooses before training");
        assert_eq!(chosen(&[(0.9, 0.5, 10), (0.9, 0.5, 9)]), Some(1), "then size");
        assert_eq!(chosen(&[(0.0, 0.0, 9), (0.0, 0.0, 9)]), Some(0), "then the first");
        assert_eq!(chosen(&[]), None);
    }
}
