//! Fitness: which cases an individual solves, and what that is worth.
//!
//! What an individual solves is kept as a bit set, so that any way of selecting (on the share of cases solved,
//! on shared fitness, on single cases) can be computed from it without running anything again.

use std::sync::Arc;

/// Whether an answer counts as correct: within `tolerance` rows of the label, computed in binary64 from the
/// unrounded answer. A non-finite answer never does.
pub fn is_correct(answer: f32, label: f64, tolerance: f64) -> bool {
    answer.is_finite() && (f64::from(answer) - label).abs() <= tolerance
}

/// The set of fitness cases an individual solves.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct CaseBits {
    words: Arc<[u64]>,
    len: u32,
}

impl CaseBits {
    /// The set of those of `len` cases of which `solved` says yes.
    pub fn from_fn(len: usize, mut solved: impl FnMut(usize) -> bool) -> CaseBits {
        let words = (0..len.div_ceil(64)).map(|w| {
            let bits = (64 * w)..len.min(64 * w + 64);
            bits.fold(0u64, |word, i| word | u64::from(solved(i)) << (i % 64))
        });
        CaseBits { words: words.collect(), len: len as u32 }
    }

    /// The set stored as words of 64 cases, the first case in the lowest bit; `None` if their number does not
    /// fit `len` cases or a bit beyond the last case is set.
    pub fn from_words(words: &[u64], len: usize) -> Option<CaseBits> {
        let beyond = if len.is_multiple_of(64) { 0 } else { !0u64 << (len % 64) };
        let fits = words.len() == len.div_ceil(64) && words.last().is_none_or(|w| w & beyond == 0);
        fits.then(|| CaseBits { words: words.into(), len: len as u32 })
    }

    /// Bytes that a set of so many cases takes beside its own size: the words and two counts of references.
    pub(super) const fn heap_bytes(len: usize) -> usize {
        len.div_ceil(64) * size_of::<u64>() + 2 * size_of::<usize>()
    }

    /// The words of 64 cases, the first case in the lowest bit.
    pub fn words(&self) -> &[u64] {
        &self.words
    }

    /// How many cases there are, solved or not.
    pub fn len(&self) -> usize {
        self.len as usize
    }

    /// Whether there is no case at all.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// How many cases are solved.
    pub fn count(&self) -> u32 {
        self.words.iter().map(|w| w.count_ones()).sum()
    }

    /// How many of the first `n` cases are solved.
    pub fn count_of_first(&self, n: usize) -> u32 {
        let whole = self.words.len().min(n / 64);
        let rest = self.words.get(whole).map_or(0, |word| word & !(!0u64 << (n % 64)));
        self.words[..whole].iter().map(|w| w.count_ones()).sum::<u32>() + rest.count_ones()
    }

    /// The first `n` cases by themselves; all of them if there are fewer.
    pub fn first(&self, n: usize) -> CaseBits {
        CaseBits::from_fn(n.min(self.len()), |case| self.contains(case))
    }

    /// Raw fitness: the share of the cases that are solved, 0 to 1.
    pub fn fitness(&self) -> f64 {
        share(self.count(), self.len)
    }

    /// Whether case `i` is solved.
    pub fn contains(&self, i: usize) -> bool {
        i < self.len() && self.words[i / 64] >> (i % 64) & 1 == 1
    }

    /// The solved cases in ascending order.
    pub fn iter(&self) -> impl Iterator<Item = usize> + '_ {
        self.words.iter().enumerate().flat_map(|(w, &word)| {
            std::iter::successors((word != 0).then_some(word), |&rest| {
                let rest = rest & (rest - 1);
                (rest != 0).then_some(rest)
            })
            .map(move |rest| 64 * w + rest.trailing_zeros() as usize)
        })
    }
}

/// `part` of `whole` as a number from 0 to 1; 0 of 0 is 0.
pub(super) fn share(part: u32, whole: u32) -> f64 {
    f64::from(part) / f64::from(whole.max(1))
}

/// Case-wise shared fitness of each member of a population: a solved case counts 1 / number of members that
/// solve it, so that the whole population shares one unit for each case that anyone solves. The terms are summed in
/// the order of the cases.
///
/// Implicit fitness sharing: R. E. Smith, S. Forrest, A. S. Perelson, *Searching for diverse, cooperative
/// populations with genetic algorithms*, 1993; for GP, R. I. McKay, *Fitness sharing in genetic programming*,
/// 2000.
pub fn shared_fitness<'a>(population: impl Iterator<Item = &'a CaseBits> + Clone) -> Vec<f64> {
    let worth: Vec<f64> = solvers(population.clone()).iter().map(|&n| 1.0 / f64::from(n.max(1))).collect();
    population.map(|bits| bits.iter().fold(0.0, |sum, case| sum + worth[case])).collect()
}

/// How many members of a population solve each case, in the order of the cases.
///
/// Sixty-four cases are counted at once, in binary counters that lie across words: bit `i` of the k-th word is bit k of
/// the count of case `i`.
pub fn solvers<'a>(population: impl Iterator<Item = &'a CaseBits>) -> Vec<u32> {
    let sets: Vec<&CaseBits> = population.collect();
    let cases = sets.iter().map(|bits| bits.len()).max().unwrap_or(0);
    let mut counts = vec![0; cases];
    for (w, counts) in counts.chunks_mut(64).enumerate() {
        let mut counters = [0u64; u32::BITS as usize];
        for bits in &sets {
            let mut carry = bits.words.get(w).copied().unwrap_or(0);
            for counter in &mut counters {
                if carry == 0 {
                    break;
                }
                (*counter, carry) = (*counter ^ carry, *counter & carry);
            }
        }
        for (i, count) in counts.iter_mut().enumerate() {
            *count = (0..).zip(&counters).map(|(k, counter)| ((counter >> i & 1) as u32) << k).sum();
        }
    }
    counts
}

/// A 64-bit hash of a sequence of words, the same on every machine.
pub(super) fn hash64(words: impl Iterator<Item = u64>) -> u64 {
    // The finaliser of SplitMix64 (Steele, Lea, Flood 2014), chained.
    let mix = |mut z: u64| {
        z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ z >> 31
    };
    words.fold(0x9e37_79b9_7f4a_7c15, |hash, word| {
        mix(hash ^ mix(word.wrapping_add(0x9e37_79b9_7f4a_7c15))).wrapping_add(0x9e37_79b9_7f4a_7c15)
    })
}

/// A hash of what an individual answers: equal answers give equal hashes, all NaNs being one value.
pub(super) fn behaviour(answers: &[f32]) -> u64 {
    hash64(answers.iter().map(|a| u64::from(if a.is_nan() { f32::NAN.to_bits() } else { a.to_bits() })))
}

/// Whether all answers are one value, all NaNs being one, and so are both zeros.
pub(super) fn is_constant(answers: &[f32]) -> bool {
    let Some(&first) = answers.first() else { return true };
    answers.iter().all(|&a| a == first || (a.is_nan() && first.is_nan()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tolerance_is_exact() {
        assert!(is_correct(110.0, 100.0, 10.0) && is_correct(90.0, 100.0, 10.0));
        assert!(!is_correct(110.00001, 100.0, 10.0) && !is_correct(89.99999, 100.0, 10.0));
        assert!(!is_correct(f32::NAN, 0.0, 10.0) && !is_correct(f32::INFINITY, 0.0, 10.0));
    }

    #[test]
    fn bits_are_kept() {
        for len in [0usize, 1, 63, 64, 65, 130] {
            let bits = CaseBits::from_fn(len, |i| i % 3 == 0);
            let expected: Vec<usize> = (0..len).filter(|i| i % 3 == 0).collect();
            assert_eq!(bits.iter().collect::<Vec<_>>(), expected);
            assert_eq!(bits.count() as usize, expected.len());
            assert!((0..len + 3).all(|i| bits.contains(i) == (i < len && i % 3 == 0)));
            for n in [0, 1, 2, 63, 64, 65, 127, 128, 129, 1000] {
                assert_eq!(bits.count_of_first(n) as usize, expected.iter().filter(|&&i| i < n).count());
            }
            assert_eq!(CaseBits::from_words(bits.words(), len), Some(bits));
        }
        assert_eq!(CaseBits::from_words(&[0b1000], 3), None);
        assert_eq!(CaseBits::from_words(&[0, 0], 64), None);
    }

    #[test]
    fn sharing_by_hand() {
        let set = |bits: &'static [usize]| CaseBits::from_fn(4, move |i| bits.contains(&i));
        // Case 0 has three solvers, 1 has one, 2 has two, 3 has none.
        let population = [set(&[0, 1]), set(&[0, 2]), set(&[0, 2]), set(&[])];
        let third = 1.0 / 3.0;
        assert_eq!(shared_fitness(population.iter()), [third + 1.0, third + 0.5, third + 0.5, 0.0]);
    }

    #[test]
    fn solvers_are_counted_one_by_one() {
        for (members, cases) in [(0usize, 0usize), (1, 1), (3, 63), (300, 64), (70, 65), (257, 200)] {
            let solves =
                |member: usize, case: usize| (member * case + member / 3).is_multiple_of(1 + case % 7);
            let sets: Vec<CaseBits> =
                (0..members).map(|m| CaseBits::from_fn(cases, |case| solves(m, case))).collect();
            let count = |case| (0..members).filter(|&m| solves(m, case)).count() as u32;
            let expected: Vec<u32> = (0..cases).map(count).collect();
            assert_eq!(solvers(sets.iter()), expected, "{members} members, {cases} cases");
        }
    }

    #[test]
    fn behaviours_and_constants() {
        let other_nan = f32::from_bits(0x7fc0_0001);
        assert_eq!(behaviour(&[1.0, f32::NAN]), behaviour(&[1.0, other_nan]));
        assert_ne!(behaviour(&[1.0, 2.0]), behaviour(&[2.0, 1.0]));
        assert_ne!(behaviour(&[0.0]), behaviour(&[0.0, 0.0]));
        assert!(
            is_constant(&[f32::NAN, other_nan]) && is_constant(&[0.0, -0.0]) && !is_constant(&[0.0, 1.0])
        );
    }
}
