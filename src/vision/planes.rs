//! The eight image operators at every pixel.
//!
//! The formulas are those of [`vsonar_ir::formula::image`], instantiated with 16- and 32-bit integers in loops
//! down the columns that the compiler turns into vector code.

use image::GrayImage;
use vsonar_ir::Operator;
use vsonar_ir::formula::image::{
    self as formula, Neighbourhood, PixelMachine, absolute_difference, sorted, truncated_median_of_sorted,
};

/// The planes of an image: one value for each operator and pixel. Outside the image the border is replicated.
///
/// A plane is stored column by column, because everything that follows walks down columns.
#[derive(Debug, Clone)]
pub struct Planes {
    width: usize,
    height: usize,
    /// Raw, median and median-corner.
    bytes: [Vec<u8>; 3],
    /// The gradient and the four Moravec differences.
    words: [Vec<u16>; 5],
}

/// A column of a plane, from the top.
#[derive(Debug, Clone, Copy)]
pub enum Column<'a> {
    /// Of the operators whose values fit a byte.
    Bytes(&'a [u8]),
    /// Of the others.
    Words(&'a [u16]),
}

/// 16-bit integers, for the operators that never leave them.
struct Narrow;

impl PixelMachine for Narrow {
    type P = i16;
    type M = bool;

    #[inline(always)]
    fn constant(&mut self, value: i32) -> i16 {
        value as i16
    }
    #[inline(always)]
    fn add(&mut self, a: i16, b: i16) -> i16 {
        a.wrapping_add(b)
    }
    #[inline(always)]
    fn sub(&mut self, a: i16, b: i16) -> i16 {
        a.wrapping_sub(b)
    }
    #[inline(always)]
    fn mul(&mut self, a: i16, b: i16) -> i16 {
        a.wrapping_mul(b)
    }
    #[inline(always)]
    fn lt(&mut self, a: i16, b: i16) -> bool {
        a < b
    }
    #[inline(always)]
    fn select(&mut self, mask: bool, a: i16, b: i16) -> i16 {
        if mask { a } else { b }
    }
    #[inline(always)]
    fn min(&mut self, a: i16, b: i16) -> i16 {
        a.min(b)
    }
    #[inline(always)]
    fn max(&mut self, a: i16, b: i16) -> i16 {
        a.max(b)
    }
}

/// 32-bit integers, with the square root of the floating-point unit.
struct Wide;

impl PixelMachine for Wide {
    type P = i32;
    type M = bool;

    #[inline(always)]
    fn constant(&mut self, value: i32) -> i32 {
        value
    }
    #[inline(always)]
    fn add(&mut self, a: i32, b: i32) -> i32 {
        a.wrapping_add(b)
    }
    #[inline(always)]
    fn sub(&mut self, a: i32, b: i32) -> i32 {
        a.wrapping_sub(b)
    }
    #[inline(always)]
    fn mul(&mut self, a: i32, b: i32) -> i32 {
        a.wrapping_mul(b)
    }
    #[inline(always)]
    fn lt(&mut self, a: i32, b: i32) -> bool {
        a < b
    }
    #[inline(always)]
    fn select(&mut self, mask: bool, a: i32, b: i32) -> i32 {
        if mask { a } else { b }
    }
    #[inline(always)]
    fn sqrt_round(&mut self, n: i32) -> i32 {
        // Adding 2²³ leaves no fraction bits, so it rounds to the nearest integer, which then stands in the low
        // bits. The trait says why the root's own rounding does no harm.
        const ROUNDER: f32 = 8_388_608.0;
        ((n as f32).sqrt() + ROUNDER).to_bits().cast_signed() - ROUNDER.to_bits().cast_signed()
    }
}

impl Planes {
    /// Computes the planes.
    pub fn new(image: &GrayImage) -> Planes {
        let (width, height) = (image.width() as usize, image.height() as usize);
        let size = width * height;
        let mut planes = Planes {
            width,
            height,
            bytes: std::array::from_fn(|_| vec![0; size]),
            words: std::array::from_fn(|_| vec![0; size]),
        };
        if size == 0 {
            return planes;
        }
        let padded = pad(image);
        let stride = height + 2;
        for x in 0..width {
            let columns = [0, 1, 2].map(|i| &padded[(x + i) * stride..][..stride]);
            let at = x * height..(x + 1) * height;
            let [raw, median, corner] = planes.bytes.each_mut().map(|plane| &mut plane[at.clone()]);
            median_family(columns, raw, median, corner);
            let words = planes.words.each_mut().map(|plane| &mut plane[at.clone()]);
            differences(columns, words);
        }
        planes
    }

    /// Bytes that the planes of an image of this size take while they are computed.
    pub fn memory_needed(width: u32, height: u32) -> u64 {
        let (width, height) = (u64::from(width), u64::from(height));
        // Three planes of bytes and five of 16 bits, and the image with its border in 16 bits.
        width * height * (3 + 5 * 2) + (width + 2) * (height + 2) * 2
    }

    /// Width of the image in pixels.
    pub fn width(&self) -> u32 {
        self.width as u32
    }

    /// Height of the image in pixels.
    pub fn height(&self) -> u32 {
        self.height as u32
    }

    /// A column of an operator's plane.
    ///
    /// # Panics
    /// If `x` is outside the image.
    pub fn column(&self, operator: Operator, x: u32) -> Column<'_> {
        let at = x as usize * self.height..(x as usize + 1) * self.height;
        let operator = operator as usize;
        match self.bytes.get(operator) {
            Some(plane) => Column::Bytes(&plane[at]),
            None => Column::Words(&self.words[operator - self.bytes.len()][at]),
        }
    }

    /// An operator's value at a pixel.
    ///
    /// # Panics
    /// If the pixel is outside the image.
    pub fn get(&self, operator: Operator, x: u32, y: u32) -> u32 {
        match self.column(operator, x) {
            Column::Bytes(column) => column[y as usize].into(),
            Column::Words(column) => column[y as usize].into(),
        }
    }
}

/// The image column by column, with a border of one replicated pixel all round.
fn pad(image: &GrayImage) -> Vec<i16> {
    let (width, height) = (image.width() as usize, image.height() as usize);
    let pixels = image.as_raw();
    let mut padded = vec![0i16; (width + 2) * (height + 2)];
    for (x, column) in padded.chunks_exact_mut(height + 2).enumerate() {
        let x = x.saturating_sub(1).min(width - 1);
        for (value, row) in column[1..].iter_mut().zip(pixels.chunks_exact(width)) {
            *value = row[x].into();
        }
        column[0] = column[1];
        column[height + 1] = column[height];
    }
    padded
}

/// The neighbourhood at row `y` of three columns padded by one pixel at either end.
#[inline(always)]
fn neighbourhood<P: From<i16>>([left, here, right]: [&[i16]; 3], y: usize) -> Neighbourhood<P> {
    let (above, row, below) = (y, y + 1, y + 2);
    [
        P::from(left[above]),
        P::from(here[above]),
        P::from(right[above]),
        P::from(left[row]),
        P::from(here[row]),
        P::from(right[row]),
        P::from(left[below]),
        P::from(here[below]),
        P::from(right[below]),
    ]
}

/// The three operators of a column that fit a byte.
fn median_family(columns: [&[i16]; 3], raw: &mut [u8], median: &mut [u8], corner: &mut [u8]) {
    let height = raw.len();
    let columns = columns.map(|c| &c[..height + 2]);
    let (median, corner) = (&mut median[..height], &mut corner[..height]);
    let m = &mut Narrow;
    for y in 0..height {
        let n: Neighbourhood<i16> = neighbourhood(columns, y);
        let s = sorted(m, &n);
        raw[y] = n[4] as u8;
        median[y] = truncated_median_of_sorted(m, &s) as u8;
        corner[y] = absolute_difference(m, n[4], s[4]) as u8;
    }
}

/// The five operators of a column that need two bytes.
fn differences(columns: [&[i16]; 3], [gradient, horizontal, vertical, slash, backslash]: [&mut [u16]; 5]) {
    let height = gradient.len();
    let columns = columns.map(|c| &c[..height + 2]);
    let m = &mut Wide;
    for (y, value) in gradient.iter_mut().enumerate() {
        *value = formula::gradient(m, &neighbourhood(columns, y)) as u16;
    }
    let moravec = [
        (Operator::MoravecHorizontal, horizontal),
        (Operator::MoravecVertical, vertical),
        (Operator::MoravecSlash, slash),
        (Operator::MoravecBackslash, backslash),
    ];
    for (operator, plane) in moravec {
        for (y, value) in plane.iter_mut().enumerate() {
            *value = formula::apply(m, operator, &neighbourhood(columns, y)) as u16;
        }
    }
}

#[cfg(test)]
mod tests {
    use vsonar_ir::formula::image::ScalarPixels;

    use super::*;

    #[test]
    fn the_memory_foretold_is_what_is_taken() {
        let image = GrayImage::new(31, 17);
        let planes = Planes::new(&image);
        let bytes: usize = planes.bytes.iter().map(|plane| size_of_val(&plane[..])).sum();
        let words: usize = planes.words.iter().map(|plane| size_of_val(&plane[..])).sum();
        let taken = bytes + words + size_of_val(&pad(&image)[..]);
        assert_eq!(Planes::memory_needed(31, 17), taken as u64);
    }

    #[test]
    fn fast_roots_are_the_formula() {
        for n in 0..1 << 22 {
            assert_eq!(Wide.sqrt_round(n), ScalarPixels.sqrt_round(n), "{n}");
        }
    }

    #[test]
    fn planes_are_the_formulas() {
        let image = GrayImage::from_fn(37, 29, |x, y| {
            image::Luma([(x * x * 7 + y * 31 + x * y * 13).wrapping_mul(2_654_435_761) as u8])
        });
        let planes = Planes::new(&image);
        let pixel =
            |x: i64, y: i64| i32::from(image.get_pixel(x.clamp(0, 36) as u32, y.clamp(0, 28) as u32).0[0]);
        for (x, y) in (0..37i64).flat_map(|x| (0..29).map(move |y| (x, y))) {
            let n: Neighbourhood<i32> =
                std::array::from_fn(|i| pixel(x + i as i64 % 3 - 1, y + i as i64 / 3 - 1));
            for operator in Operator::ALL {
                let expected = formula::apply(&mut ScalarPixels, operator, &n);
                let value = planes.get(operator, x as u32, y as u32);
                assert_eq!(value, expected.cast_unsigned(), "{} at ({x}, {y})", operator.name());
            }
        }
    }
}
