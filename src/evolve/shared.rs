//! Training data prepared once for several runs.

use std::sync::{Arc, OnceLock};

use rayon::prelude::*;

use super::cases::Cases;
use super::evaluate::{EvaluateError, Evaluator};
use super::fitness::CaseBits;
use super::settings::Settings;
use super::summary::Score;
use crate::dataset::Dataset;
use crate::exec::Executor;
use crate::tree::Individual;
use crate::vision::{CaseSet, Lane, WindowSums};

/// A data set whose planes, window sums and strips are prepared once, at the first use, for all runs on it, one after
/// the other or at the same time. It changes no result, only the time and the memory that runs take.
///
/// A run with augmentation shares the window sums of the images as they are; all else is its own, for its altered copies
/// depend on its seed.
///
/// ```
/// use std::sync::{Arc, atomic::AtomicBool};
/// use vsonar::evolve::{Evolution, Settings, SharedSet};
/// use vsonar::exec::auto::AutoExecutor;
/// use vsonar::world::Corridor;
///
/// let corridor = Corridor { width: 64, height: 48, ..Corridor::default() }.render(1, 4)?;
/// let train = SharedSet::new(&corridor);
/// let executor = Arc::new(AutoExecutor::new());
/// for seed in 1..=2 {
///     let settings = Settings { seed, population: 20, generations: 2, ..Settings::paper() };
///     let mut run = Evolution::on(&train, settings, executor.clone(), 1)?;
///     run.run(&AtomicBool::new(false), |_| ())?;
/// }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct SharedSet<'a> {
    data: &'a Dataset,
    /// Of [`Dataset::fingerprint`], which reads every pixel.
    fingerprint: OnceLock<u64>,
    set: OnceLock<Arc<CaseSet>>,
    strip_bytes: usize,
}

impl<'a> SharedSet<'a> {
    /// Bytes in which strips of columns other than the cases' own are kept, unless [`SharedSet::keep_strips`] says
    /// otherwise.
    pub const STRIP_BYTES: usize = 256 << 20;

    /// The set, not prepared yet.
    pub fn new(data: &'a Dataset) -> SharedSet<'a> {
        let (fingerprint, set) = (OnceLock::new(), OnceLock::new());
        SharedSet { data, fingerprint, set, strip_bytes: SharedSet::STRIP_BYTES }
    }

    /// The same with strips of columns other than the cases' own kept in at most about so many bytes, for all runs
    /// together ([`CaseSet::keep_strips`]); a run with augmentation keeps as many of its own.
    pub fn keep_strips(mut self, bytes: usize) -> SharedSet<'a> {
        self.strip_bytes = bytes;
        if let Some(set) = self.set.get() {
            set.keep_strips(bytes);
        }
        self
    }

    /// The images and cases.
    pub fn data(&self) -> &'a Dataset {
        self.data
    }

    /// [`Dataset::fingerprint`], computed once.
    pub fn fingerprint(&self) -> u64 {
        *self.fingerprint.get_or_init(|| self.data.fingerprint())
    }

    fn set(&self) -> &Arc<CaseSet> {
        self.set.get_or_init(|| {
            let set = self.data.case_set();
            set.keep_strips(self.strip_bytes);
            Arc::new(set)
        })
    }

    /// The cases that a run with these settings trains on, and their fingerprint.
    pub(super) fn training(&self, settings: &Settings) -> (Cases, u64) {
        let variation = settings.variation();
        if variation.copies() == 0 {
            return (self.cases(settings.tolerance), self.fingerprint());
        }
        let grown = variation.grow(self.data, settings.seed);
        let set = Arc::new(self.grown_set(&grown));
        set.keep_strips(self.strip_bytes);
        (Cases::grown(&grown, self.data, set, settings.tolerance), grown.fingerprint())
    }

    /// What [`Dataset::case_set`] makes of a set that was grown from this one by altered copies, which come after the
    /// images as they are.
    fn grown_set(&self, grown: &Dataset) -> CaseSet {
        let shared = self.set().images();
        let copies: Vec<_> = grown.images()[shared.len()..]
            .par_iter()
            .map(|image| Arc::new(WindowSums::new(&image.pixels)))
            .collect();
        let lanes =
            grown.cases().iter().map(|case| Lane { image: case.image as u32, column: case.x }).collect();
        CaseSet::new([shared, &copies].concat(), lanes).expect("images of one size, cases inside them")
    }

    /// The cases as they are.
    pub(super) fn cases(&self, tolerance: f64) -> Cases {
        Cases::grown(self.data, self.data, self.set().clone(), tolerance)
    }

    /// Which cases of the set an individual solves, an answer being correct within `tolerance` rows of the label;
    /// computed in one thread of its own.
    ///
    /// # Errors
    /// If it cannot be evaluated.
    pub fn solved(
        &self,
        individual: &Individual,
        executor: Arc<dyn Executor>,
        tolerance: f64,
    ) -> Result<CaseBits, EvaluateError> {
        let cases = self.cases(tolerance);
        let evaluator = Evaluator::new(executor, 1, cases.len(), 0)?;
        Ok(evaluator.score(individual, &cases)?.outcome.solved)
    }

    /// How an individual does on the set: see [`SharedSet::solved`].
    ///
    /// # Errors
    /// If it cannot be evaluated.
    pub fn score(
        &self,
        individual: &Individual,
        executor: Arc<dyn Executor>,
        tolerance: f64,
    ) -> Result<Score, EvaluateError> {
        Ok(Score::of(&self.solved(individual, executor, tolerance)?))
    }
}

#[cfg(test)]
mod tests {
    use vsonar_ir::Rect;

    use super::*;
    use crate::world::Corridor;

    #[test]
    fn altered_runs_share_the_images_as_they_are() {
        let data = Corridor { width: 64, height: 48, ..Corridor::default() }.render(1, 3).expect("possible");
        let shared = SharedSet::new(&data);
        let settings = |seed| Settings { seed, ..Settings::default_preset() };
        let variation = settings(1).variation();
        assert!(variation.copies() > 0);
        let sets = [1, 2].map(|seed| {
            let (cases, fingerprint) = shared.training(&settings(seed));
            let grown = variation.grow(&data, seed);
            assert_eq!(fingerprint, grown.fingerprint());
            let alone = grown.case_set();
            assert_eq!(cases.set().lanes(), alone.lanes());
            let values = |set: &CaseSet| -> Vec<u32> {
                let rects = Rect::all().flat_map(|rect| (0..set.groups()).map(move |group| (rect, group)));
                let bits = |(rect, group)| set.x_obstacle_arena(rect, group).iter().map(|v| v.to_bits());
                rects.flat_map(bits).collect()
            };
            assert!(values(cases.set()) == values(&alone), "seed {seed}");
            cases
        });
        let images = shared.cases(1.0);
        for (number, image) in images.set().images().iter().enumerate() {
            assert!(sets.iter().all(|cases| Arc::ptr_eq(image, &cases.set().images()[number])), "{number}");
        }
    }
}
