//! Lexicase selection: parents chosen by single cases, one after the other in random order.
//!
//! T. Helmuth, L. Spector, J. Matheson, *Solving uncompromising problems with lexicase selection*, 2015; on a random part
//! of the cases: J. G. Hernandez, A. Lalejini, E. Dolson, C. Ofria, *Random subsampling improves performance in
//! lexicase selection*, 2019.
//!
//! A case is solved or not, so individuals that solve the same cases stay or go together: they are one class. For each
//! case the classes that solve it are a bit set, and a step of a selection is the intersection of two of them. Cases
//! that all classes solve, or none, never decide and are left out.

use rustc_hash::FxHashMap;

use super::fitness::CaseBits;
use crate::tree::Random;

/// Lexicase selection from a population.
///
/// ```
/// use vsonar::evolve::CaseBits;
/// use vsonar::evolve::selection::Lexicase;
/// use vsonar::tree::Random;
///
/// let set = |solved: &'static [usize]| CaseBits::from_fn(3, move |case| solved.contains(&case));
/// // The third solves the fewest cases, but one that nobody else does.
/// let population = [set(&[0, 1]), set(&[0]), set(&[2]), set(&[])];
/// let lexicase = Lexicase::new(population.iter(), None);
/// let mut random = Random::stream(1, 1, 0);
/// let mut selected = [0; 4];
/// (0..300).for_each(|_| selected[lexicase.select(&mut random)] += 1);
/// assert!(selected[0] > 150 && selected[2] > 70 && selected[1] == 0 && selected[3] == 0);
/// ```
#[derive(Debug, Clone)]
pub struct Lexicase {
    /// The individuals of each class, ascending.
    classes: Vec<Vec<u32>>,
    /// For each case that decides, `words` words: the classes that solve it.
    solvers: Vec<u64>,
    words: usize,
    /// The numbers of the cases that decide, 0 to their number - 1.
    cases: Vec<u32>,
}

impl Lexicase {
    /// Selection from individuals that solve these cases; if `sample` is there, only these cases count.
    ///
    /// # Panics
    /// If there are no individuals.
    pub fn new<'a>(population: impl Iterator<Item = &'a CaseBits>, sample: Option<&CaseBits>) -> Lexicase {
        let mut numbers: FxHashMap<Vec<u64>, usize> = FxHashMap::default();
        let mut classes: Vec<Vec<u32>> = Vec::new();
        let mut keys: Vec<Vec<u64>> = Vec::new();
        let mut count = 0;
        for (i, solved) in population.enumerate() {
            count = count.max(solved.len());
            let mut key = solved.words().to_vec();
            if let Some(sample) = sample {
                key.iter_mut().zip(sample.words()).for_each(|(word, mask)| *word &= mask);
            }
            // Classes are numbered as they come up, so that nothing depends on the order of a hash map.
            let number = *numbers.entry(key).or_insert_with_key(|key| {
                keys.push(key.clone());
                classes.push(Vec::new());
                classes.len() - 1
            });
            classes[number].push(i as u32);
        }
        assert!(!classes.is_empty(), "there is nobody to select from");
        let words = classes.len().div_ceil(64);
        let mut all = vec![0u64; count * words];
        for (class, key) in keys.iter().enumerate() {
            for (w, &word) in key.iter().enumerate() {
                let mut rest = word;
                while rest != 0 {
                    let case = 64 * w + rest.trailing_zeros() as usize;
                    all[case * words + class / 64] |= 1 << (class % 64);
                    rest &= rest - 1;
                }
            }
        }
        let mut solvers = Vec::new();
        for case in all.chunks_exact(words) {
            let solving: u32 = case.iter().map(|word| word.count_ones()).sum();
            if solving > 0 && (solving as usize) < classes.len() {
                solvers.extend_from_slice(case);
            }
        }
        let cases = (0..(solvers.len() / words) as u32).collect();
        Lexicase { classes, solvers, words, cases }
    }

    /// Keeps of each class only the individuals of the least `size`, so that those who solve the same are decided by
    /// it.
    pub(super) fn keep_smallest(&mut self, size: impl Fn(usize) -> usize) {
        for class in &mut self.classes {
            let least = class.iter().map(|&i| size(i as usize)).min();
            class.retain(|&i| Some(size(i as usize)) == least);
        }
    }

    /// How many classes of individuals that solve the same cases there are.
    pub fn classes(&self) -> usize {
        self.classes.len()
    }

    /// Selects an individual: all are candidates at first; case by case, in random order, those that solve it remain if
    /// any does; of those that remain at last each is equally likely.
    pub fn select(&self, random: &mut Random) -> usize {
        let class = &self.classes[self.select_class(random)];
        class[random.index(class.len())] as usize
    }

    fn select_class(&self, random: &mut Random) -> usize {
        if self.cases.is_empty() {
            // Nothing tells classes apart only where there is one.
            return 0;
        }
        let mut candidates = vec![u64::MAX; self.words];
        // Bits beyond the last class are those of nobody.
        candidates[self.words - 1] >>= 64 * self.words - self.classes.len();
        let mut order = self.cases.clone();
        for at in 0..order.len() {
            // The order is shuffled as far as it is needed (Fisher and Yates).
            let other = at + random.index(order.len() - at);
            order.swap(at, other);
            let case = order[at] as usize * self.words;
            let solvers = &self.solvers[case..case + self.words];
            let any = candidates.iter().zip(solvers).fold(0, |any, (c, s)| any | (c & s));
            if any == 0 {
                continue;
            }
            candidates.iter_mut().zip(solvers).for_each(|(c, s)| *c &= s);
            if is_single(&candidates) {
                break;
            }
        }
        // Classes differ in a case that decides, so that only one remains when all cases have been looked at.
        debug_assert!(is_single(&candidates));
        let word = candidates.iter().position(|&c| c != 0).unwrap_or_default();
        64 * word + candidates[word].trailing_zeros() as usize
    }
}

/// Whether a set holds exactly one element.
fn is_single(words: &[u64]) -> bool {
    let mut found = false;
    for &word in words {
        if word == 0 {
            continue;
        }
        if found || word & (word - 1) != 0 {
            return false;
        }
        found = true;
    }
    found
}

/// A random part of `cases` cases: `share` of them, but one at least.
pub(super) fn draw_sample(cases: usize, share: f64, random: &mut Random) -> CaseBits {
    let size = ((cases as f64 * share).round() as usize).clamp(1.min(cases), cases);
    let mut order: Vec<usize> = (0..cases).collect();
    let mut drawn = vec![false; cases];
    for at in 0..size {
        let other = at + random.index(cases - at);
        order.swap(at, other);
        drawn[order[at]] = true;
    }
    CaseBits::from_fn(cases, |case| drawn[case])
}
