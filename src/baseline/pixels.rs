//! What the rivals look at: smaller and smoother pictures, gradients. All of it in whole numbers, so that an answer is
//! the same on every machine.

use image::GrayImage;

/// Parts of a gray level that a [`Plane`] counts in, for means to keep more than whole levels.
pub(super) const LEVEL: i32 = 16;

/// Numbers in rows and columns, each [`LEVEL`] to a gray level.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Plane {
    pub(super) width: usize,
    pub(super) height: usize,
    values: Vec<i32>,
}

impl Plane {
    /// The means of squares of `scale` x `scale` pixels. The squares begin at the left and at the lower edge; rows and
    /// columns that fill no square are left out.
    pub(super) fn reduced(image: &GrayImage, scale: usize) -> Plane {
        let (full_width, full_height) = (image.width() as usize, image.height() as usize);
        let (width, height) = (full_width / scale, full_height / scale);
        let mut values = vec![0; width * height];
        let top = full_height - height * scale;
        let used = image.as_raw().chunks_exact(full_width).skip(top);
        for (y, row) in used.enumerate() {
            let sums = &mut values[y / scale * width..][..width];
            for (sum, square) in sums.iter_mut().zip(row.chunks_exact(scale)) {
                *sum += square.iter().map(|&v| i32::from(v)).sum::<i32>();
            }
        }
        let area = (scale * scale) as i32;
        values.iter_mut().for_each(|v| *v = (*v * LEVEL + area / 2) / area);
        Plane { width, height, values }
    }

    /// The number in a column and row; outside the plane that of its border.
    #[inline]
    pub(super) fn at(&self, x: isize, y: isize) -> i32 {
        let x = x.clamp(0, self.width as isize - 1) as usize;
        let y = y.clamp(0, self.height as isize - 1) as usize;
        self.values[y * self.width + x]
    }

    /// Smoothed by 1 2 1 along rows and columns.
    pub(super) fn smoothed(&self) -> Plane {
        self.weighted([1, 2, 1])
    }

    /// Smoothed by 1 4 6 4 1 along rows and columns: about a Gaussian of standard deviation 1.
    pub(super) fn blurred(&self) -> Plane {
        self.weighted([1, 4, 6, 4, 1])
    }

    fn weighted<const N: usize>(&self, weights: [i32; N]) -> Plane {
        let total: i32 = weights.iter().sum();
        let (width, height, middle) = (self.width, self.height, N / 2);
        let mut along = Vec::with_capacity(self.values.len());
        let mut padded = Vec::with_capacity(width + N);
        for row in self.values.chunks_exact(width) {
            padded.clear();
            padded.extend(std::iter::repeat_n(row[0], middle));
            padded.extend_from_slice(row);
            padded.extend(std::iter::repeat_n(row[width - 1], middle));
            let sum = |window: &[i32]| weights.iter().zip(window).map(|(w, v)| w * v).sum::<i32>();
            along.extend(padded.windows(N).map(|window| (sum(window) + total / 2) / total));
        }
        let mut values = Vec::with_capacity(self.values.len());
        let mut sums = vec![0; width];
        for y in 0..height {
            sums.fill(total / 2);
            for (i, weight) in weights.iter().enumerate() {
                let y = (y + i).saturating_sub(middle).min(height - 1);
                let row = &along[y * width..][..width];
                sums.iter_mut().zip(row).for_each(|(sum, v)| *sum += weight * v);
            }
            values.extend(sums.iter().map(|sum| sum / total));
        }
        Plane { width, height, values }
    }

    /// The magnitude of the gradient by Sobel's masks at every place.
    pub(super) fn sobel(&self) -> Plane {
        self.map_places(|x, y| sobel(|dx, dy| self.at(x + dx, y + dy)))
    }

    fn map_places(&self, value: impl Fn(isize, isize) -> i32) -> Plane {
        let (width, height) = (self.width, self.height);
        let values = (0..height).flat_map(|y| (0..width).map(move |x| (x as isize, y as isize)));
        Plane { width, height, values: values.map(|(x, y)| value(x, y)).collect() }
    }

    /// The same with every number replaced.
    pub(super) fn map(&self, value: impl Fn(i32) -> i32) -> Plane {
        Plane { values: self.values.iter().map(|&v| value(v)).collect(), ..*self }
    }

    /// Part of a row.
    pub(super) fn row(&self, y: usize, columns: std::ops::Range<usize>) -> &[i32] {
        &self.values[y * self.width..][columns]
    }
}

/// The magnitude of the gradient by Sobel's masks, rounded, of a neighbourhood given by steps to the right and down.
#[inline]
pub(super) fn sobel(at: impl Fn(isize, isize) -> i32) -> i32 {
    let gx = at(1, -1) + 2 * at(1, 0) + at(1, 1) - at(-1, -1) - 2 * at(-1, 0) - at(-1, 1);
    let gy = at(-1, 1) + 2 * at(0, 1) + at(1, 1) - at(-1, -1) - 2 * at(0, -1) - at(1, -1);
    // The root of IEEE 754 is rounded correctly everywhere.
    f64::from(gx * gx + gy * gy).sqrt().round() as i32
}

/// A length that is `length` in an image of `full` pixels, in one of `size` pixels: at least 1.
pub(super) fn scaled(length: u32, size: u32, full: u32) -> usize {
    let scaled = (u64::from(length) * u64::from(size) + u64::from(full) / 2) / u64::from(full);
    scaled.max(1) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn squares_begin_below() {
        let image = GrayImage::from_fn(5, 5, |x, y| image::Luma([(10 * y + x) as u8]));
        let plane = Plane::reduced(&image, 2);
        assert_eq!((plane.width, plane.height), (2, 2));
        // Rows 1 and 2, columns 0 and 1: 10, 11, 20, 21.
        assert_eq!(plane.at(0, 0), 31 * LEVEL / 2);
        assert_eq!(plane.at(-3, 9), plane.at(0, 1));
        assert_eq!(Plane::reduced(&image, 1).row(4, 1..3), [41 * LEVEL, 42 * LEVEL]);
    }

    #[test]
    fn smoothing_keeps_what_is_even() {
        let ramp = GrayImage::from_fn(16, 16, |x, y| image::Luma([(5 * x + 3 * y) as u8]));
        let plane = Plane::reduced(&ramp, 1);
        for smooth in [plane.smoothed(), plane.blurred()] {
            assert_eq!(smooth.at(8, 8), plane.at(8, 8));
        }
        assert_eq!(plane.smoothed().at(0, 8), plane.at(0, 8) + 5 * LEVEL / 4, "the border is replicated");
        assert_eq!(plane.smoothed().at(8, 15), plane.at(8, 15) - 3 * LEVEL / 4);
        let step = GrayImage::from_fn(16, 16, |_, y| image::Luma([if y < 8 { 160 } else { 0 }]));
        let step = Plane::reduced(&step, 1);
        assert_eq!([step.smoothed().at(5, 8), step.smoothed().at(5, 7)], [40 * LEVEL, 120 * LEVEL]);
        assert_eq!([step.sobel().at(5, 8), step.sobel().at(5, 9)], [640 * LEVEL, 0]);
        assert_eq!([scaled(5, 240, 240), scaled(5, 48, 240), scaled(1, 16, 240)], [5, 1, 1]);
    }
}
