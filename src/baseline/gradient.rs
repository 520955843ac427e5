//! A plain threshold on the gradient: what anybody would try first.

use image::GrayImage;
use serde::Serialize;

use super::pixels::sobel;
use super::tune::{Choice, Tally, first_above, ladder};
use crate::dataset::Dataset;
use crate::detector::{DetectError, Detector, check_arguments};

/// Widths of the window that are tried, in pixels.
const WIDTHS: [u32; 4] = [1, 3, 5, 9];
/// Heights that are tried.
const HEIGHTS: [u32; 3] = [1, 3, 5];
/// How many thresholds are tried.
const THRESHOLDS: usize = 80;

fn thresholds() -> [f64; THRESHOLDS] {
    ladder(2.0, 1000.0)
}

/// The first row, going up, at which the magnitude of the gradient (Sobel), averaged over a window, exceeds a threshold.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Gradient {
    /// Width and height of the images, in pixels.
    #[serde(skip)]
    pub size: (u32, u32),
    /// Width and height of the window, in pixels, both odd; it is centred on the column and the row, and moves where it
    /// lies wholly inside the rows.
    pub window: (u32, u32),
    /// What the average has to exceed, 0 to 1443.
    pub threshold: f64,
}

impl Gradient {
    /// The best of its grid on these cases: windows of 1, 3, 5 or 9 columns and 1, 3 or 5 rows, 80 thresholds from 2 to
    /// 1000.
    pub(super) fn tune(set: &Dataset, tolerance: f64) -> (Gradient, Choice) {
        let thresholds = thresholds();
        let windows: Vec<(u32, u32)> = WIDTHS.iter().flat_map(|&w| HEIGHTS.map(|h| (w, h))).collect();
        let tally = Tally::of(set, tolerance, windows.len(), THRESHOLDS, |image, cases, tally| {
            let image = &set.images()[image].pixels;
            for case in cases {
                for (i, &window) in windows.iter().enumerate() {
                    let averages = averages(image, case.x, window);
                    for (j, row) in first_above(averages, &thresholds).into_iter().enumerate() {
                        tally.answer(i, j, row, case);
                    }
                }
            }
        });
        let choice = tally.choose();
        let size = (set.width(), set.height());
        let chosen =
            Gradient { size, window: windows[choice.setting], threshold: thresholds[choice.threshold] };
        (chosen, choice)
    }

    pub(super) fn describe(&self) -> String {
        let (width, height) = self.window;
        format!("gradient over {width} x {height} pixels above {}", self.threshold)
    }
}

/// Rows and the average gradient of the window there, from below.
fn averages(image: &GrayImage, x: u32, (width, height): (u32, u32)) -> impl Iterator<Item = (usize, f64)> {
    let (image_width, rows) = (image.width() as isize, image.height() as isize);
    let pixels = image.as_raw();
    let pixel = move |x: isize, y: isize| {
        let (x, y) = (x.clamp(0, image_width - 1), y.clamp(0, rows - 1));
        i32::from(pixels[(y * image_width + x) as usize])
    };
    let half = (width / 2) as isize;
    let columns = (x as isize - half).max(0)..=(x as isize + half).min(image_width - 1);
    let area = columns.clone().count() as f64 * f64::from(height);
    let row_sum = move |y: isize| columns.clone().map(|x| sobel(|dx, dy| pixel(x + dx, y + dy))).sum::<i32>();
    let half = (height / 2) as isize;
    let mut sum: i32 = (rows - 2 * half..rows).map(&row_sum).sum();
    (half..rows - half).rev().map(move |y| {
        sum += row_sum(y - half);
        let average = f64::from(sum) / area;
        sum -= row_sum(y + half);
        (y as usize, average)
    })
}

impl Detector for Gradient {
    fn width(&self) -> u32 {
        self.size.0
    }

    fn height(&self) -> u32 {
        self.size.1
    }

    fn detect(&self, image: &GrayImage, columns: &[u32], rows: &mut [f32]) -> Result<(), DetectError> {
        check_arguments(self.size, image, columns, rows)?;
        for (&x, row) in columns.iter().zip(rows) {
            [*row] = first_above(averages(image, x, self.window), &[self.threshold]);
        }
        Ok(())
    }
}
