//! Ulrich and Nourbakhsh: floor is what looks like ground that has been driven over.
//!
//! I. Ulrich, I. Nourbakhsh, *Appearance-based obstacle detection with monocular color vision*, AAAI-2000. A trapezoid
//! before the robot is a candidate; once the robot has driven over it, its histograms become a reference. A pixel whose
//! bin is rare in the references (joined by the greatest count of each bin) is an obstacle. A turn of more than 18 degrees
//! throws the candidates away, for they will not be driven over.
//!
//! The same here: the smoothed image, the trapezoid, the smoothed histogram, the queues of candidates and references, the
//! turn. The images being gray, there is a histogram of intensity and none of hue. Where nobody tells how the robot moved
//! (labelled images), a candidate becomes a reference after a number of frames, which is tuned. Until anything has been
//! driven over, the trapezoid of the first frame is the reference: the robot is set down on free floor.
//!
//! Left out: the drive by which the authors train it before it is let go. In a simulated drive it starts with that one
//! trapezoid, and whoever does not get a metre far on it learns nothing more.
//!
//! Where the motion is known, a frame is a candidate only once the robot has driven 0.3 m or turned 10 degrees since the
//! last one: at ten frames a second the memory would otherwise reach back no farther than a second or two, where in
//! training it spans many metres.

use std::collections::VecDeque;

use image::GrayImage;
use rayon::prelude::*;
use serde::Serialize;

use super::pixels::{LEVEL, Plane, scaled};
use super::tune::{Choice, Tally, ladder};
use crate::dataset::{Dataset, NamedImage};
use crate::detector::{DetectError, Motion, SequenceDetector, check_arguments};

/// Numbers of bins that are tried.
const BINS: [usize; 3] = [16, 32, 64];
/// Lower width, upper width and height of the trapezoids that are tried, in hundredths of the image's width and height.
const TRAPEZOIDS: [(u32, u32, u32); 4] = [(30, 20, 8), (50, 30, 15), (70, 40, 25), (90, 60, 35)];
/// Frames after which a candidate becomes a reference, where nobody tells how the robot moved.
const DELAYS: [u32; 3] = [1, 2, 4];
/// Most references that are kept.
const KEPT: [usize; 3] = [1, 4, 16];
/// Of so many pixels going up, so many have to be obstacle; in pixels of an image 240 pixels high.
const SUPPORTS: [(u32, u32); 4] = [(1, 1), (5, 4), (10, 8), (20, 15)];
/// How many thresholds are tried.
const THRESHOLDS: usize = 16;
/// How far the robot has to drive until it has driven over what is a candidate now, in metres, unless said otherwise.
const REACH: f64 = 1.0;
/// The turn after which a candidate will not be driven over, in radians: 18 degrees.
const TURN: f64 = std::f64::consts::PI / 10.0;

/// How far the robot has to drive, in metres, or to turn, in radians, until there is another candidate.
const SPACING: (f64, f64) = (0.3, std::f64::consts::PI / 18.0);

fn thresholds() -> [f64; THRESHOLDS] {
    ladder(0.0002, 0.1)
}

/// Settings of [`Ulrich`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct UlrichSettings {
    /// Width and height of the images, in pixels.
    #[serde(skip)]
    pub size: (u32, u32),
    /// Bins of the histogram.
    pub bins: usize,
    /// Lower width, upper width and height of the reference area at the bottom of the image, in hundredths of the
    /// image's width and height.
    pub trapezoid: (u32, u32, u32),
    /// Frames after which a candidate becomes a reference, where the motion is not known.
    pub delay: u32,
    /// Metres after which it does, where the motion is known.
    pub reach: f64,
    /// Most references that are kept.
    pub kept: usize,
    /// Of so many pixels going up, so many have to be obstacle, the lowest among them.
    pub support: (usize, usize),
    /// Share of the reference area below which a bin is obstacle.
    pub threshold: f64,
}

/// A smoothed histogram: for each bin four times the number of pixels, those of its neighbours partly counted.
type Histogram = Vec<u32>;

/// The smoothed image, sorted into bins.
fn view(image: &GrayImage, bins: usize) -> Plane {
    Plane::reduced(image, 1).blurred().map(|v| (v as usize * bins / (256 * LEVEL as usize)) as i32)
}

/// The columns of each row of a trapezoid, from its top to the bottom of an image of this size.
fn trapezoid(
    (width, height): (usize, usize),
    (lower, upper, share): (u32, u32, u32),
) -> impl Iterator<Item = (usize, std::ops::Range<usize>)> {
    let rows = (height * share as usize / 100).clamp(1, height);
    (0..rows).map(move |i| {
        let hundredths = upper as usize * (rows - i) + lower as usize * i;
        let across = (width * hundredths / (100 * rows)).clamp(1, width);
        let left = (width - across) / 2;
        (height - rows + i, left..left + across)
    })
}

/// The histogram of a trapezoid.
fn histogram(view: &Plane, bins: usize, shape: (u32, u32, u32)) -> Histogram {
    let mut counts = vec![0u32; bins];
    for (y, columns) in trapezoid((view.width, view.height), shape) {
        view.row(y, columns).iter().for_each(|&bin| counts[bin as usize] += 1);
    }
    let at = |i: Option<usize>| i.and_then(|i| counts.get(i)).copied().unwrap_or(0);
    (0..bins).map(|i| at(i.checked_sub(1)) + 2 * at(Some(i)) + at(Some(i + 1))).collect()
}

/// The shares of the bins in the references together: for each the greatest.
fn joined<'h>(
    size: (usize, usize),
    shape: (u32, u32, u32),
    references: impl IntoIterator<Item = &'h Histogram>,
) -> Vec<f64> {
    let area: usize = trapezoid(size, shape).map(|(_, columns)| columns.len()).sum();
    let mut most: Vec<u32> = Vec::new();
    for reference in references {
        most.resize(reference.len(), 0);
        most.iter_mut().zip(reference).for_each(|(most, &count)| *most = (*most).max(count));
    }
    most.iter().map(|&count| f64::from(count) / (4.0 * area as f64)).collect()
}

/// The lowest row whose pixel is an obstacle, and of those above it enough; 0 if there is none. `shares` are those of the
/// pixels' bins, from the top.
fn lowest(shares: &[f64], threshold: f64, (of, need): (usize, usize)) -> f32 {
    let obstacle = |y: usize| shares[y] < threshold;
    let bottom = shares.len() - 1;
    // How many of the `of` pixels from here on up are obstacle.
    let mut count = (shares.len().saturating_sub(of)..=bottom).filter(|&y| obstacle(y)).count();
    for y in (0..=bottom).rev() {
        if count >= need && obstacle(y) {
            return y as f32;
        }
        count -= usize::from(obstacle(y));
        if y >= of {
            count += usize::from(obstacle(y - of));
        }
    }
    0.0
}

/// The shares of the bins of a column's pixels, from the top.
fn shares(view: &Plane, joined: &[f64], x: u32) -> Vec<f64> {
    (0..view.height).map(|y| joined[view.row(y, x as usize..x as usize + 1)[0] as usize]).collect()
}

/// A trapezoid that has not been driven over.
#[derive(Debug, Clone)]
struct Candidate {
    histogram: Histogram,
    /// How much of the way to it has been driven; at 1 it is a reference.
    driven: f64,
    /// How far the robot has turned since, in radians.
    turned: f64,
}

/// The lowest pixel that looks unlike the ground that has been driven over.
#[derive(Debug, Clone)]
pub struct Ulrich {
    settings: UlrichSettings,
    /// The trapezoid of the sequence's first frame.
    first: Option<Histogram>,
    candidates: VecDeque<Candidate>,
    references: VecDeque<Histogram>,
    /// How far the robot has driven and turned since the last candidate.
    since: Motion,
}

impl Ulrich {
    /// A detector that has seen nothing.
    pub fn new(settings: UlrichSettings) -> Ulrich {
        let (candidates, references) = (VecDeque::new(), VecDeque::new());
        Ulrich { settings, first: None, candidates, references, since: Motion::default() }
    }

    /// Its settings.
    pub const fn settings(&self) -> &UlrichSettings {
        &self.settings
    }

    /// The best of its grid on these cases, without odometry: 16, 32 or 64 bins, four trapezoids, candidates of 1, 2 or 4
    /// frames ago, at most 1, 4 or 16 references, four rules of support, 16 thresholds from 0.0002 to 0.1.
    pub(super) fn tune(set: &Dataset, tolerance: f64) -> (Ulrich, Choice) {
        let thresholds = thresholds();
        let size = (set.width(), set.height());
        let support = |&(of, need): &(u32, u32)| {
            let of = scaled(of, set.height(), 240);
            (of, scaled(need, set.height(), 240).min(of))
        };
        let supports: Vec<(usize, usize)> = SUPPORTS.iter().map(support).collect();
        let mut settings = Vec::new();
        for bins in BINS {
            for trapezoid in TRAPEZOIDS {
                for delay in DELAYS {
                    for kept in KEPT {
                        settings.extend(supports.iter().map(|&support| UlrichSettings {
                            size,
                            bins,
                            trapezoid,
                            delay,
                            reach: REACH,
                            kept,
                            support,
                            threshold: 0.0,
                        }));
                    }
                }
            }
        }
        // For each image its sequence and its place there.
        let sequences = set.sequences();
        let mut places = vec![(0, 0); set.images().len()];
        for (i, sequence) in sequences.iter().enumerate() {
            for (j, &image) in sequence.images.iter().enumerate() {
                places[image] = (i, j);
            }
        }
        let shapes: Vec<(usize, (u32, u32, u32))> =
            BINS.iter().flat_map(|&bins| TRAPEZOIDS.map(|trapezoid| (bins, trapezoid))).collect();
        let histograms: Vec<Vec<Histogram>> = {
            let of = |image: &NamedImage| {
                let views = BINS.map(|bins| view(&image.pixels, bins));
                let of = |(i, &(bins, shape)): (usize, &(usize, _))| {
                    histogram(&views[i / TRAPEZOIDS.len()], bins, shape)
                };
                shapes.iter().enumerate().map(of).collect()
            };
            set.images().par_iter().map(of).collect()
        };
        let per_shape = DELAYS.len() * KEPT.len() * supports.len();
        let tally = Tally::of(set, tolerance, settings.len(), THRESHOLDS, |image, cases, tally| {
            let views = BINS.map(|bins| view(&set.images()[image].pixels, bins));
            let (sequence, place) = places[image];
            // The images up to this one.
            let before = &sequences[sequence].images[..=place];
            for (i, group) in settings.chunks(supports.len()).enumerate() {
                let shape = i * supports.len() / per_shape;
                let view = &views[shape / TRAPEZOIDS.len()];
                let UlrichSettings { trapezoid, delay, kept, .. } = group[0];
                let driven = before.len().saturating_sub(delay as usize);
                let references = match driven {
                    0 => &before[..1],
                    _ => &before[driven.saturating_sub(kept)..driven],
                };
                let references = references.iter().map(|&image| &histograms[image][shape]);
                let joined = joined((view.width, view.height), trapezoid, references);
                for case in cases {
                    let shares = shares(view, &joined, case.x);
                    for (j, setting) in group.iter().enumerate() {
                        for (k, &threshold) in thresholds.iter().enumerate() {
                            let answer = lowest(&shares, threshold, setting.support);
                            tally.answer(i * supports.len() + j, k, answer, case);
                        }
                    }
                }
            }
        });
        let choice = tally.choose();
        let threshold = thresholds[choice.threshold];
        (Ulrich::new(UlrichSettings { threshold, ..settings[choice.setting] }), choice)
    }

    pub(super) fn describe(&self) -> String {
        let UlrichSettings { bins, trapezoid: (lower, upper, height), delay, kept, .. } = self.settings;
        let UlrichSettings { support: (of, need), threshold, .. } = self.settings;
        format!(
            "{bins} bins, reference area {lower} to {upper} % wide and {height} % high, after {delay} frame{}, at most \
             {kept} kept, obstacle below {threshold}, {need} of {of} pixels",
            if delay == 1 { "" } else { "s" }
        )
    }

    /// Whether the robot is far enough from the last candidate for another one. Where nobody tells how it moved, each
    /// frame is one.
    fn is_candidate(&mut self, motion: Option<Motion>) -> bool {
        let Some(Motion { forward, turn }) = motion else {
            self.since = Motion::default();
            return true;
        };
        self.since.forward += forward.abs();
        self.since.turn += turn;
        // Sums of steps may fall short by their rounding.
        let far = self.since.forward >= SPACING.0 - 1e-9 || self.since.turn.abs() >= SPACING.1 - 1e-9;
        if far {
            self.since = Motion::default();
        }
        far
    }

    /// Takes note of how the robot moved: candidates become references, or are thrown away.
    fn moved(&mut self, motion: Option<Motion>) {
        let UlrichSettings { delay, reach, kept, .. } = self.settings;
        let share = motion.map_or(1.0 / f64::from(delay.max(1)), |m| m.forward / reach);
        let turn = motion.map_or(0.0, |m| m.turn);
        for candidate in &mut self.candidates {
            candidate.driven += share;
            candidate.turned += turn;
        }
        self.candidates.retain(|c| c.turned.abs() <= TURN);
        // Sums of steps may fall short of 1 by their rounding.
        let there = |c: &Candidate| c.driven >= 1.0 - 1e-9;
        while self.candidates.front().is_some_and(there) {
            self.references.extend(self.candidates.pop_front().map(|c| c.histogram));
        }
        while self.references.len() > kept {
            self.references.pop_front();
        }
    }
}

impl SequenceDetector for Ulrich {
    fn size(&self) -> (u32, u32) {
        self.settings.size
    }

    fn restart(&mut self) {
        *self = Ulrich::new(self.settings);
    }

    fn next(
        &mut self,
        image: &GrayImage,
        motion: Option<Motion>,
        columns: &[u32],
        rows: &mut [f32],
    ) -> Result<(), DetectError> {
        check_arguments(self.settings.size, image, columns, rows)?;
        let UlrichSettings { bins, trapezoid, threshold, support, .. } = self.settings;
        let view = view(image, bins);
        let histogram = histogram(&view, bins, trapezoid);
        self.moved(motion);
        let begins = self.first.is_none();
        let first = &*self.first.get_or_insert_with(|| histogram.clone());
        let size = (view.width, view.height);
        let joined = match self.references.is_empty() {
            true => joined(size, trapezoid, [first]),
            false => joined(size, trapezoid, &self.references),
        };
        if begins || self.is_candidate(motion) {
            self.candidates.push_back(Candidate { histogram, driven: 0.0, turned: 0.0 });
        }
        for (&x, row) in columns.iter().zip(rows) {
            *row = lowest(&shares(&view, &joined, x), threshold, support);
        }
        Ok(())
    }
}
