//! Lorigo: floor is what looks like the bottom of the image.
//!
//! L. M. Lorigo, *Visually-guided obstacle avoidance in unstructured environments*, MSc thesis, MIT, 1996; L. M. Lorigo,
//! R. A. Brooks, W. E. L. Grimson, the same title, IROS 1997. In a 64 x 64 image a window of 20 x 10 pixels is taken for
//! ground where it stands at the bottom of a column, and slides up; the first position at which its histogram differs by
//! more than a threshold is the obstacle. Three modules do so on their own (brightness gradients, RGB, HSV), and what
//! they say is combined.
//!
//! The same here: the small image, the sliding window, histograms compared by their area of difference, a module of
//! gradients and one of intensity, and their combination. The images being gray, the two modules of colour are one of
//! intensity; with two modules there is no median, so the mean, the nearer and the farther are tried, and either module
//! alone. The small image is not tuned: about 64 columns, as in the source. What the method supposes stays: an obstacle
//! that fills the window at the bottom is taken for ground.

use image::GrayImage;
use serde::Serialize;

use super::pixels::{LEVEL, Plane};
use super::tune::{Choice, Tally, first_above, ladder};
use crate::dataset::Dataset;
use crate::detector::{DetectError, Detector, check_arguments};

/// Widths and heights of the windows that are tried, in pixels of the small image; the first is the original's.
const WINDOWS: [(usize, usize); 6] = [(20, 10), (10, 10), (20, 5), (10, 5), (5, 5), (5, 3)];
/// Numbers of intensity bins that are tried.
const BINS: [usize; 2] = [8, 16];
/// Where in the window the obstacle is reported, in quarters of its height from its upper edge.
const QUARTERS: [u32; 3] = [0, 1, 2];
/// Ways of combining the two modules that are tried.
const COMBINED: [Combination; 3] = [Combination::Mean, Combination::Nearer, Combination::Farther];
/// How many thresholds are tried for each module.
const THRESHOLDS: usize = 12;
/// Bins of the magnitude of the gradient: below 4, below 8, below 16 ...
const GRADIENT_BINS: usize = 10;

fn thresholds() -> [f64; THRESHOLDS] {
    ladder(0.05, 0.8)
}

/// How the rows of the modules become one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Combination {
    /// The module of intensity alone.
    Intensity,
    /// The module of gradients alone.
    Gradient,
    /// The mean of both.
    Mean,
    /// The larger row, which is that of the nearer obstacle.
    Nearer,
    /// The smaller row.
    Farther,
}

/// The first window, going up, whose histogram differs from that of the window at the bottom.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Lorigo {
    /// Width and height of the images, in pixels.
    #[serde(skip)]
    pub size: (u32, u32),
    /// Width and height of the window, in pixels of an image reduced to about 64 columns.
    pub window: (usize, usize),
    /// Bins of the histogram of intensities.
    pub bins: usize,
    /// The obstacle's place in the window, in quarters of its height from its upper edge.
    pub quarters: u32,
    /// How the modules are combined.
    pub combination: Combination,
    /// Share of the window by which the histograms of intensities must differ, 0 to 1.
    pub intensity_threshold: f64,
    /// The same of the gradients.
    pub gradient_threshold: f64,
}

/// A reduced image, sorted into bins.
struct View {
    intensity: Plane,
    gradient: Plane,
    scale: usize,
    /// Rows above the first row of squares.
    top: usize,
}

impl View {
    fn new(image: &GrayImage, bins: usize) -> View {
        // At most what a sum of a square's pixels has room for.
        let scale = ((image.width() as usize + 32) / 64).clamp(1, (image.height() as usize).min(512));
        let plane = Plane::reduced(image, scale);
        let top = image.height() as usize - plane.height * scale;
        let intensity = plane.map(|v| (v as usize * bins / (256 * LEVEL as usize)) as i32);
        let octave = |v: i32| (v / (4 * LEVEL)).checked_ilog2().map_or(0, |log| log as i32 + 1);
        View { intensity, gradient: plane.sobel().map(octave), scale, top }
    }

    /// The window's upper rows in the small image and how far its histogram is from that at the bottom, going up.
    fn differences<'p>(
        &self,
        plane: &'p Plane,
        bins: usize,
        x: u32,
        (width, height): (usize, usize),
    ) -> impl Iterator<Item = (usize, f64)> + use<'p> {
        let (width, height) = (width.min(plane.width), height.min(plane.height));
        let left = (x as usize / self.scale).saturating_sub(width / 2).min(plane.width - width);
        // How many more pixels of a bin there are than at the bottom.
        let mut more = vec![0i32; bins];
        let area = (width * height) as f64;
        (0..=plane.height - height).rev().map(move |top| {
            if top + height < plane.height {
                plane.row(top, left..left + width).iter().for_each(|&bin| more[bin as usize] += 1);
                plane.row(top + height, left..left + width).iter().for_each(|&bin| more[bin as usize] -= 1);
            }
            // The histograms are smoothed by 1 2 1, so that noise at the border of a bin is no difference.
            let at = |i: Option<usize>| i.and_then(|i| more.get(i)).copied().unwrap_or(0);
            let smooth = |i: usize| at(i.checked_sub(1)) + 2 * at(Some(i)) + at(Some(i + 1));
            let difference: i32 = (0..bins).map(|i| smooth(i).abs()).sum();
            (top, f64::from(difference) / (8.0 * area))
        })
    }

    /// The row of the image for a window whose upper row is `top`.
    fn row(&self, top: usize, window: (usize, usize), quarters: u32) -> usize {
        self.top + top * self.scale + window.1.min(self.intensity.height) * self.scale * quarters as usize / 4
    }

    fn first<const N: usize>(
        &self,
        module: Module,
        bins: usize,
        x: u32,
        window: (usize, usize),
        quarters: u32,
        thresholds: &[f64; N],
    ) -> [f32; N] {
        let (plane, bins) = match module {
            Module::Intensity => (&self.intensity, bins),
            Module::Gradient => (&self.gradient, GRADIENT_BINS),
        };
        let differences = self.differences(plane, bins, x, window);
        first_above(differences.map(|(top, d)| (self.row(top, window, quarters), d)), thresholds)
    }
}

#[derive(Clone, Copy)]
enum Module {
    Intensity,
    Gradient,
}

impl Combination {
    fn of(self, intensity: f32, gradient: f32) -> f32 {
        match self {
            Combination::Intensity => intensity,
            Combination::Gradient => gradient,
            Combination::Mean => (intensity + gradient) / 2.0,
            Combination::Nearer => intensity.max(gradient),
            Combination::Farther => intensity.min(gradient),
        }
    }
}

/// The combinations of a window, each with what is on the ladder: the modules alone, then every threshold of intensity
/// with every combination.
fn combinations() -> Vec<(Combination, usize)> {
    let alone = [(Combination::Intensity, 0), (Combination::Gradient, 0)];
    let both = COMBINED.into_iter().flat_map(|c| (0..THRESHOLDS).map(move |i| (c, i)));
    alone.into_iter().chain(both).collect()
}

impl Lorigo {
    /// The best of its grid on these cases: six windows, 8 or 16 bins, three places in the window, the modules alone and
    /// combined in three ways, 12 thresholds from 0.05 to 0.8 for each module.
    pub(super) fn tune(set: &Dataset, tolerance: f64) -> (Lorigo, Choice) {
        let thresholds = thresholds();
        let combinations = combinations();
        let mut shapes = Vec::new();
        for bins in BINS {
            for window in WINDOWS {
                shapes.extend(QUARTERS.map(|quarters| (bins, window, quarters)));
            }
        }
        let settings = shapes.len() * combinations.len();
        let tally = Tally::of(set, tolerance, settings, THRESHOLDS, |image, cases, tally| {
            let views = BINS.map(|bins| (bins, View::new(&set.images()[image].pixels, bins)));
            for (i, &(bins, window, quarters)) in shapes.iter().enumerate() {
                let Some((_, view)) = views.iter().find(|(b, _)| *b == bins) else { continue };
                for case in cases {
                    let first = |module| view.first(module, bins, case.x, window, quarters, &thresholds);
                    let (intensity, gradient) = (first(Module::Intensity), first(Module::Gradient));
                    for (j, &(combination, at)) in combinations.iter().enumerate() {
                        for (threshold, &gradient) in gradient.iter().enumerate() {
                            let at = if j < 2 { threshold } else { at };
                            let answer = combination.of(intensity[at], gradient);
                            tally.answer(i * combinations.len() + j, threshold, answer, case);
                        }
                    }
                }
            }
        });
        let choice = tally.choose();
        let (bins, window, quarters) = shapes[choice.setting / combinations.len()];
        let (combination, at) = combinations[choice.setting % combinations.len()];
        let at = if COMBINED.contains(&combination) { at } else { choice.threshold };
        let lorigo = Lorigo {
            size: (set.width(), set.height()),
            window,
            bins,
            quarters,
            combination,
            intensity_threshold: thresholds[at],
            gradient_threshold: thresholds[choice.threshold],
        };
        (lorigo, choice)
    }

    pub(super) fn describe(&self) -> String {
        let Lorigo { window: (width, height), bins, intensity_threshold, gradient_threshold, .. } = *self;
        let intensity = format!("intensity ({bins} bins) off by {intensity_threshold}");
        let gradient = format!("gradient off by {gradient_threshold}");
        let modules = match self.combination {
            Combination::Intensity => intensity,
            Combination::Gradient => gradient,
            Combination::Mean => format!("mean of {intensity} and {gradient}"),
            Combination::Nearer => format!("nearer of {intensity} and {gradient}"),
            Combination::Farther => format!("farther of {intensity} and {gradient}"),
        };
        let place = ["at its upper edge", "a quarter down", "in its middle", "three quarters down"];
        let place = place.get(self.quarters as usize).copied().unwrap_or("at its lower edge");
        format!("window of {width} x {height} at 64 columns, {modules}, reported {place}")
    }
}

impl Detector for Lorigo {
    fn width(&self) -> u32 {
        self.size.0
    }

    fn height(&self) -> u32 {
        self.size.1
    }

    fn detect(&self, image: &GrayImage, columns: &[u32], rows: &mut [f32]) -> Result<(), DetectError> {
        check_arguments(self.size, image, columns, rows)?;
        let view = View::new(image, self.bins);
        for (&x, row) in columns.iter().zip(rows) {
            let first = |module, threshold| {
                let [row] = view.first(module, self.bins, x, self.window, self.quarters, &[threshold]);
                row
            };
            // A module that is not asked does not look.
            let intensity = match self.combination {
                Combination::Gradient => 0.0,
                _ => first(Module::Intensity, self.intensity_threshold),
            };
            let gradient = match self.combination {
                Combination::Intensity => 0.0,
                _ => first(Module::Gradient, self.gradient_threshold),
            };
            *row = self.combination.of(intensity, gradient);
        }
        Ok(())
    }
}
