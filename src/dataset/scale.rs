//! The scale of images: the size beyond which they only cost time, and the tolerance in proportion to their height.
//!
//! ```
//! use vsonar::dataset::scale::{in_proportion, useful_size};
//!
//! assert_eq!(useful_size((4032, 3024)), Some((320, 240)));
//! assert_eq!(useful_size((640, 480)), None);
//! assert_eq!(in_proportion(10.0, 240), "10 rows (4.2 % of the height)");
//! ```

use vsonar_ir::Program;

use super::TOLERANCE;

/// The largest size of use, by its number of pixels. The paper's images have a quarter of them. More pixels take memory and
/// time in proportion, and a window of at most 8 x 8 of them sees ever less of the scene.
pub const LARGEST_USEFUL: (u32, u32) = (640, 480);

/// The longer side of the size that larger images should be scaled to.
const LONGER_SIDE: u32 = 320;

/// Height of the images for which the tolerance of [`TOLERANCE`] rows was chosen.
const HEIGHT: u32 = 240;

/// Factor between the tolerance and the usual share of the height beyond which it deserves a remark.
const OUT_OF_PROPORTION: f64 = 3.0;

/// The size that images of this one, in pixels, should be scaled to, with about the same proportions; `None` if they have
/// no more pixels than [`LARGEST_USEFUL`].
pub fn useful_size((width, height): (u32, u32)) -> Option<(u32, u32)> {
    let pixels = |(width, height): (u32, u32)| u64::from(width) * u64::from(height);
    if pixels((width, height)) <= pixels(LARGEST_USEFUL) {
        return None;
    }
    let longer = u64::from(width.max(height));
    let scaled = |side: u32| {
        let side = (u64::from(side) * u64::from(LONGER_SIDE) + longer / 2) / longer;
        (side as u32).max(Program::MIN_SIDE)
    };
    Some((scaled(width), scaled(height)))
}

/// A tolerance in words, with the share of the height of the images that it is.
pub fn in_proportion(tolerance: f64, height: u32) -> String {
    let share = 100.0 * tolerance / f64::from(height.max(1));
    format!("{tolerance} row{} ({share:.1} % of the height)", if tolerance == 1.0 { "" } else { "s" })
}

/// The tolerance that is the usual share of this height, in whole rows, if the given one is less than a third or more
/// than three times of that.
///
/// ```
/// use vsonar::dataset::scale::usual_tolerance;
///
/// assert_eq!(usual_tolerance(10.0, 3024), Some(126));
/// assert_eq!([240, 120, 480].map(|height| usual_tolerance(10.0, height)), [None; 3]);
/// ```
pub fn usual_tolerance(tolerance: f64, height: u32) -> Option<u32> {
    let usual = TOLERANCE * f64::from(height) / f64::from(HEIGHT);
    // Whoever asks for exact answers means it.
    let odd =
        tolerance > 0.0 && !(usual / OUT_OF_PROPORTION..=usual * OUT_OF_PROPORTION).contains(&tolerance);
    odd.then(|| usual.round().max(1.0) as u32).filter(|&rows| f64::from(rows) != tolerance)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_keep_their_proportions() {
        for (size, useful) in [
            ((3024, 4032), (240, 320)),
            ((1920, 1080), (320, 180)),
            ((641, 480), (320, 240)),
            ((65_535, 16), (320, 16)),
            ((16, 65_535), (16, 320)),
            ((u32::MAX, u32::MAX), (320, 320)),
        ] {
            assert_eq!(useful_size(size), Some(useful), "{size:?}");
            assert_eq!(useful_size(useful), None);
        }
        for small in [(320, 240), (480, 640), (16, 16), (19_200, 16)] {
            assert_eq!(useful_size(small), None, "{small:?}");
        }
    }

    #[test]
    fn tolerances_in_proportion() {
        assert_eq!(in_proportion(1.0, 100), "1 row (1.0 % of the height)");
        assert_eq!(in_proportion(2.5, 48), "2.5 rows (5.2 % of the height)");
        assert_eq!(in_proportion(10.0, 3024), "10 rows (0.3 % of the height)");
        assert_eq!(usual_tolerance(10.0, 48), Some(2), "10 are a fifth of it");
        assert_eq!(usual_tolerance(126.0, 240), Some(10));
        assert_eq!(usual_tolerance(1.0, 16), None, "there is no smaller one");
        for fitting in [(3.0, 48), (10.0, 720), (0.0, 240), (30.0, 240)] {
            assert_eq!(usual_tolerance(fitting.0, fitting.1), None, "{fitting:?}");
        }
    }
}
