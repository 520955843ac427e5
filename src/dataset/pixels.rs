//! Changes of gray images that a camera, its light or its place may bring about: exact, and the same on every machine.
//!
//! Results are rounded to the nearest gray level (halves away from 0) and clamped to 0 to 255. Where a logarithm, an
//! exponential or a cosine is needed it is that of the pure Rust `libm`, never the platform's.

use std::f64::consts::TAU;

use image::{GrayImage, Luma};

use crate::tree::Random;

/// The gray level in the middle, about which contrast is changed.
const MIDDLE: f64 = 127.5;

/// What becomes of each gray level.
pub(super) type Tones = [u8; 256];

fn tones(tone: impl Fn(f64) -> f64) -> Tones {
    // The conversion saturates, and takes no number for 0.
    std::array::from_fn(|level| tone(level as f64).round() as u8)
}

/// Every level times a factor: more light, a longer exposure, a wider iris.
pub(super) fn gain(factor: f64) -> Tones {
    tones(|level| level * factor)
}

/// So many levels added.
pub(super) fn offset(levels: f64) -> Tones {
    tones(|level| level + levels)
}

/// The distance from the middle level times a factor.
pub(super) fn contrast(factor: f64) -> Tones {
    tones(|level| MIDDLE + (level - MIDDLE) * factor)
}

/// The level as a share of white to a power: below 1 lifts the dark, above 1 lowers it. Black and white stay.
pub(super) fn gamma(exponent: f64) -> Tones {
    tones(|level| 255.0 * libm::pow(level / 255.0, exponent))
}

/// The image with other tones.
pub(super) fn toned(image: &GrayImage, tones: &Tones) -> GrayImage {
    let mut image = image.clone();
    image.iter_mut().for_each(|level| *level = tones[usize::from(*level)]);
    image
}

/// The image as a mirror shows it: column x becomes width - 1 - x.
pub(super) fn mirrored(image: &GrayImage) -> GrayImage {
    image::imageops::flip_horizontal(image)
}

/// The picture moved so many pixels to the right and down; what comes in at a border repeats its outermost pixel.
pub(super) fn shifted(image: &GrayImage, right: i32, down: i32) -> GrayImage {
    let (width, height) = image.dimensions();
    let from =
        |at: u32, by: i32, side: u32| (i64::from(at) - i64::from(by)).clamp(0, i64::from(side) - 1) as u32;
    GrayImage::from_fn(width, height, |x, y| *image.get_pixel(from(x, right, width), from(y, down, height)))
}

/// Gaussian noise of this standard deviation, in levels, on every pixel by itself. Two pixels, in the order of rows,
/// share a pair of normal numbers (Box and Muller 1958).
pub(super) fn noisy(image: &GrayImage, deviation: f64, random: &mut Random) -> GrayImage {
    let mut image = image.clone();
    for pair in image.chunks_mut(2) {
        // 1 - u is never 0.
        let radius = libm::sqrt(-2.0 * libm::log(1.0 - random.unit()));
        let angle = TAU * random.unit();
        let normal = [radius * libm::cos(angle), radius * libm::sin(angle)];
        for (level, normal) in pair.iter_mut().zip(normal) {
            *level = (f64::from(*level) + deviation * normal).round() as u8;
        }
    }
    image
}

/// Scale of the weights of a blur: they are whole numbers with this sum.
const ONE: u64 = 1 << 16;

/// A Gaussian blur of this standard deviation in pixels, cut off at three of them; the border is repeated outwards.
/// Weights are whole, so nothing but their own making and the one rounding at the end is inexact.
pub(super) fn blurred(image: &GrayImage, deviation: f64) -> GrayImage {
    let side = side(deviation);
    let (width, height) = image.dimensions();
    let (columns, rows) = (width as usize, height as usize);
    let mut across = vec![0u64; columns * rows];
    for (row, out) in image.chunks_exact(columns).zip(across.chunks_exact_mut(columns)) {
        for (x, out) in out.iter_mut().enumerate() {
            *out = weighted(&side, x, columns, |x| u64::from(row[x]));
        }
    }
    GrayImage::from_fn(width, height, |x, y| {
        let sum = weighted(&side, y as usize, rows, |y| across[y * columns + x as usize]);
        Luma([((sum + ONE * ONE / 2) / (ONE * ONE)) as u8])
    })
}

/// The weights of a blur from the centre to one side; with those of the other side they sum to [`ONE`].
fn side(deviation: f64) -> Vec<u64> {
    let radius = (3.0 * deviation).ceil() as usize;
    let bell = |distance: usize| {
        let deviations = distance as f64 / deviation;
        libm::exp(-0.5 * deviations * deviations)
    };
    let outer: Vec<f64> = (1..=radius).map(bell).collect();
    let sum = 1.0 + 2.0 * outer.iter().sum::<f64>();
    let mut side = vec![ONE];
    for share in outer.iter().map(|weight| weight / sum) {
        let weight = (share * ONE as f64).round() as u64;
        side[0] -= 2 * weight;
        side.push(weight);
    }
    side
}

/// The weighted sum about a place on a line of so many values.
fn weighted(side: &[u64], at: usize, length: usize, value: impl Fn(usize) -> u64) -> u64 {
    let both = |(distance, weight): (usize, &u64)| {
        let (before, after) = (at.saturating_sub(distance), (at + distance).min(length - 1));
        weight * (value(before) + value(after))
    };
    side[0] * value(at) + side.iter().enumerate().skip(1).map(both).sum::<u64>()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tones_by_hand() {
        assert_eq!([10, 101, 200].map(|v: usize| gain(1.5)[v]), [15, 152, 255]);
        assert_eq!([10, 100, 250].map(|v: usize| offset(-20.0)[v]), [0, 80, 230]);
        // 127.5 - 0.5 * 27.5 = 113.75, 127.5 + 0.5 * 72.5 = 163.75
        assert_eq!([0, 100, 200, 255].map(|v: usize| contrast(0.5)[v]), [64, 114, 164, 191]);
        // 255 sqrt(64 / 255) = 127.75
        assert_eq!([0, 64, 255].map(|v: usize| gamma(0.5)[v]), [0, 128, 255]);
        let same: Tones = std::array::from_fn(|v| v as u8);
        assert_eq!([gain(1.0), offset(0.0), contrast(1.0), gamma(1.0)], [same; 4]);
    }

    #[test]
    fn weights_sum_to_one_and_fall() {
        for deviation in [0.1, 0.5, 1.0, 2.3, 20.0] {
            let side = side(deviation);
            assert_eq!(side[0] + 2 * side[1..].iter().sum::<u64>(), ONE, "{deviation}");
            assert!(side[1..].windows(2).all(|w| w[0] >= w[1]), "{deviation}: {side:?}");
            assert_eq!(side.len() as f64, 1.0 + (3.0 * deviation).ceil());
        }
        assert_eq!(side(0.0), [ONE]);
        // e^-0.5 = 0.60653, e^-2 = 0.13534, e^-4.5 = 0.01111; all seven sum to 2.50596.
        assert_eq!(side(1.0)[1..], [15862, 3539, 291]);
    }

    #[test]
    fn a_blur_by_hand() {
        let dot = GrayImage::from_fn(16, 16, |x, y| Luma([if (x, y) == (8, 8) { 255 } else { 0 }]));
        let blurred = blurred(&dot, 1.0);
        let at = |x, y| blurred.get_pixel(x, y).0[0];
        // 255 times 0.39905 squared, and times 0.24203 (one step) and 0.05400 (two).
        assert_eq!([at(8, 8), at(9, 8), at(8, 7), at(9, 9), at(10, 8), at(12, 8)], [41, 25, 25, 15, 5, 0]);
    }

    #[test]
    fn noise_has_the_deviation_it_is_asked_for() {
        let gray = GrayImage::from_pixel(200, 151, Luma([128]));
        let noisy = noisy(&gray, 6.0, &mut Random::stream(1, 0, 0));
        let count = noisy.len() as f64;
        let mean = noisy.iter().map(|&v| f64::from(v)).sum::<f64>() / count;
        let square = noisy.iter().map(|&v| (f64::from(v) - mean).powi(2)).sum::<f64>() / count;
        // Rounding adds a twelfth to the variance; 30,200 pixels leave a hundredth or so.
        assert!((mean - 128.0).abs() < 0.15 && (libm::sqrt(square) - 6.01).abs() < 0.1, "{mean}, {square}");
        let beyond = noisy.iter().filter(|&&v| v.abs_diff(128) > 12).count() as f64 / count;
        assert!((beyond - 0.037).abs() < 0.005, "beyond 12.5, 2.083 deviations: 3.7 %; {beyond}");
    }
}
