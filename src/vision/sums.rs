//! Window averages in constant time.
//!
//! A summed-area table (F. C. Crow, *Summed-area tables for texture mapping*, 1984) holds at each corner the sum
//! of everything above and to the left of it; a window's sum is a difference of four entries. The tables are
//! column by column, so that the windows of a whole column are read from four contiguous streams.
//!
//! All sums are exact. The entries of most tables are 32-bit integers that wrap: a window has at most 64 pixels,
//! so its own sum fits, and the difference modulo 2³² is that sum. Only the squares of the Moravec operators
//! need 64 bits.

use image::GrayImage;
use vsonar_ir::{Moment, Operand, Operator, Rect, WindowAt, Windows};

use super::planes::{Column, Planes};

/// The window averages of one image, for all operands and rectangles.
///
/// Memory: 80 bytes for each corner of a pixel, 6.2 MB for an image of 320 x 240.
#[derive(Debug, Clone)]
pub struct WindowSums {
    width: usize,
    height: usize,
    /// Tables, by [`Table::Narrow`].
    narrow: Vec<u32>,
    /// Tables, by [`Table::Wide`].
    wide: Vec<u64>,
}

/// Where an operand's table is.
#[derive(Debug, Clone, Copy)]
enum Table {
    Narrow(usize),
    Wide(usize),
}

/// The tables by operand, and how many there are of each kind: narrow where the largest sum over a window is below 2^31.
/// Sums over the image may wrap, and their differences are exact again.
const TABLES: ([Table; Operand::COUNT], usize, usize) = {
    const AREA: u64 = 8 * 8;
    let (mut tables, mut narrow, mut wide, mut i) = ([Table::Narrow(0); Operand::COUNT], 0, 0, 0);
    while i < Operand::COUNT {
        let Some(operand) = Operand::from_index(i as u8) else { unreachable!() };
        if operand.max() * AREA < 1 << 31 {
            tables[i] = Table::Narrow(narrow);
            narrow += 1;
        } else {
            tables[i] = Table::Wide(wide);
            wide += 1;
        }
        i += 1;
    }
    (tables, narrow, wide)
};
const NARROW: usize = TABLES.1;
const WIDE: usize = TABLES.2;

const fn table(operand: Operand) -> Table {
    TABLES.0[operand.index() as usize]
}

impl WindowSums {
    /// Computes the operators' planes and sums them.
    pub fn new(image: &GrayImage) -> WindowSums {
        WindowSums::from_planes(&Planes::new(image))
    }

    /// Sums planes.
    pub fn from_planes(planes: &Planes) -> WindowSums {
        let (width, height) = (planes.width() as usize, planes.height() as usize);
        let size = (width + 1) * (height + 1);
        let mut sums =
            WindowSums { width, height, narrow: vec![0; size * NARROW], wide: vec![0; size * WIDE] };
        for operator in Operator::ALL {
            let mean = Operand { operator, moment: Moment::Mean };
            let square = Operand { operator, moment: Moment::MeanSquare };
            let Table::Narrow(mean) = table(mean) else { unreachable!("means are narrow") };
            let columns = |x: usize| planes.column(operator, x as u32);
            match table(square) {
                Table::Narrow(square) => {
                    debug_assert_eq!(square, mean + 1);
                    let both = &mut sums.narrow[mean * size..][..2 * size];
                    let (mean, square) = both.split_at_mut(size);
                    accumulate(columns, height, mean, square);
                }
                Table::Wide(square) => {
                    let mean = &mut sums.narrow[mean * size..][..size];
                    let square = &mut sums.wide[square * size..][..size];
                    accumulate(columns, height, mean, square);
                }
            }
        }
        sums
    }

    /// Bytes that the averages of an image of this size take.
    pub fn memory_needed(width: u32, height: u32) -> u64 {
        let corners = (u64::from(width) + 1) * (u64::from(height) + 1);
        corners * (NARROW * size_of::<u32>() + WIDE * size_of::<u64>()) as u64
    }

    /// Width of the image in pixels.
    pub fn width(&self) -> u32 {
        self.width as u32
    }

    /// Height of the image in pixels.
    pub fn height(&self) -> u32 {
        self.height as u32
    }

    /// The averages at every position of a column, from the top: `out[p * stride]` for the window centred on
    /// column `x` and row `rect.rows(height).0 + p`.
    ///
    /// # Panics
    /// If the rectangle does not lie wholly inside the image at column `x`, or `out` is too short, or `stride`
    /// is 0.
    pub fn strip(&self, operand: Operand, rect: Rect, x: u32, out: &mut [f32], stride: usize) {
        let positions = rect.positions(self.height()) as usize;
        assert!(out.len() > (positions - 1) * stride, "the strip has {positions} positions");
        if stride == 1 {
            self.strip_part(operand, rect, x, 0, &mut out[..positions]);
            return;
        }
        let mut part = [0.0; 64];
        for first in (0..positions).step_by(part.len()) {
            let part = &mut part[..(positions - first).min(64)];
            self.strip_part(operand, rect, x, first, part);
            for (value, out) in part.iter().zip(out[first * stride..].iter_mut().step_by(stride)) {
                *out = *value;
            }
        }
    }

    /// A run of a strip, from position `first` on.
    #[inline]
    pub(super) fn strip_part(&self, operand: Operand, rect: Rect, x: u32, first: usize, out: &mut [f32]) {
        let (left, right) = self.streams(operand, rect, x);
        let h = rect.height() as usize;
        let n = out.len();
        let area = rect.area() as f32;
        match table(operand) {
            Table::Narrow(_) => {
                let (left, right) = (&self.narrow[left + first..], &self.narrow[right + first..]);
                let (left_top, left_bottom) = (&left[..n], &left[h..h + n]);
                let (right_top, right_bottom) = (&right[..n], &right[h..h + n]);
                for p in 0..n {
                    let top = right_top[p].wrapping_sub(left_top[p]);
                    let bottom = right_bottom[p].wrapping_sub(left_bottom[p]);
                    out[p] = narrow_to_f32(bottom.wrapping_sub(top)) / area;
                }
            }
            Table::Wide(_) => {
                let (left, right) = (&self.wide[left + first..], &self.wide[right + first..]);
                let (left_top, left_bottom) = (&left[..n], &left[h..h + n]);
                let (right_top, right_bottom) = (&right[..n], &right[h..h + n]);
                for p in 0..n {
                    let top = right_top[p].wrapping_sub(left_top[p]);
                    let bottom = right_bottom[p].wrapping_sub(left_bottom[p]);
                    out[p] = wide_to_f32(bottom.wrapping_sub(top)) / area;
                }
            }
        }
    }

    /// Where the columns of corners left and right of a window begin in the operand's vector of tables.
    #[inline]
    fn streams(&self, operand: Operand, rect: Rect, x: u32) -> (usize, usize) {
        let (lo, hi) = rect.columns(self.width());
        assert!((lo..=hi).contains(&x), "column {x} is not in {lo}..={hi}");
        let (Table::Narrow(table) | Table::Wide(table)) = table(operand);
        let stride = self.height + 1;
        let left = table * (self.width + 1) * stride + (x - rect.left()) as usize * stride;
        (left, left + rect.width() as usize * stride)
    }
}

impl Windows for WindowSums {
    /// # Panics
    /// If the window does not lie wholly inside the image.
    #[inline]
    fn average(&self, at: WindowAt) -> f32 {
        let mut value = [0.0];
        let (lo, hi) = at.rect.rows(self.height());
        assert!((lo..=hi).contains(&at.y), "row {} is not in {lo}..={hi}", at.y);
        self.strip_part(at.operand, at.rect, at.x, (at.y - lo) as usize, &mut value);
        value[0]
    }
}

/// The sum of a window as a binary32. It is below 2³¹, so that the signed conversion, the one that every
/// processor has as a vector instruction, serves.
#[inline(always)]
fn narrow_to_f32(sum: u32) -> f32 {
    sum.cast_signed() as f32
}

/// The sum of a window as a binary32, rounded to nearest even. It is below 2³⁸, so it is exact in the low bits of
/// a binary64 and only the narrowing rounds: in vectors this needs no conversion from 64-bit integers, which
/// many processors lack.
#[inline(always)]
fn wide_to_f32(sum: u64) -> f32 {
    const BASE: f64 = 4_503_599_627_370_496.0; // 2⁵²
    (f64::from_bits(sum | BASE.to_bits()) - BASE) as f32
}

/// An entry of a table.
trait Entry: Copy + Default {
    fn from_value(value: u32) -> Self;
    fn add(self, other: Self) -> Self;
    fn square(self) -> Self;
}

impl Entry for u32 {
    #[inline(always)]
    fn from_value(value: u32) -> u32 {
        value
    }
    #[inline(always)]
    fn add(self, other: u32) -> u32 {
        self.wrapping_add(other)
    }
    #[inline(always)]
    fn square(self) -> u32 {
        self.wrapping_mul(self)
    }
}

impl Entry for u64 {
    #[inline(always)]
    fn from_value(value: u32) -> u64 {
        value.into()
    }
    #[inline(always)]
    fn add(self, other: u64) -> u64 {
        self.wrapping_add(other)
    }
    #[inline(always)]
    fn square(self) -> u64 {
        self.wrapping_mul(self)
    }
}

/// Fills the tables of an operator's values and of their squares, which come as zeros.
fn accumulate<'a, S: Entry>(
    columns: impl Fn(usize) -> Column<'a>,
    height: usize,
    mean: &mut [u32],
    square: &mut [S],
) {
    let stride = height + 1;
    let width = mean.len() / stride - 1;
    for x in 0..width {
        let (mean_left, mean) = mean[x * stride..][..2 * stride].split_at_mut(stride);
        let (square_left, square) = square[x * stride..][..2 * stride].split_at_mut(stride);
        match columns(x) {
            Column::Bytes(column) => add_column(column, mean_left, mean, square_left, square),
            Column::Words(column) => add_column(column, mean_left, mean, square_left, square),
        }
    }
}

/// A column of both tables from the column to its left.
#[inline]
fn add_column<V: Copy + Into<u32>, S: Entry>(
    column: &[V],
    mean_left: &[u32],
    mean: &mut [u32],
    square_left: &[S],
    square: &mut [S],
) {
    let n = column.len();
    let (mean_left, mean) = (&mean_left[1..n + 1], &mut mean[1..n + 1]);
    let (square_left, square) = (&square_left[1..n + 1], &mut square[1..n + 1]);
    let (mut sum, mut sum_square) = (0u32, S::default());
    for y in 0..n {
        let value: u32 = column[y].into();
        sum = sum.wrapping_add(value);
        sum_square = sum_square.add(S::from_value(value).square());
        mean[y] = mean_left[y].wrapping_add(sum);
        square[y] = square_left[y].add(sum_square);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_do_not_overlap() {
        let mut narrow = [0; NARROW];
        let mut wide = [0; WIDE];
        for operand in Operand::all() {
            match table(operand) {
                Table::Narrow(i) => narrow[i] += 1,
                Table::Wide(i) => wide[i] += 1,
            }
        }
        assert_eq!((narrow, wide), ([1; NARROW], [1; WIDE]));
    }

    #[test]
    fn the_memory_foretold_is_what_is_taken() {
        let sums = WindowSums::new(&GrayImage::new(31, 17));
        let taken = size_of_val(&sums.narrow[..]) + size_of_val(&sums.wide[..]);
        assert_eq!(WindowSums::memory_needed(31, 17), taken as u64);
    }

    #[test]
    fn window_sums_fit() {
        for operand in Operand::all() {
            let value = u64::from(operand.operator.max());
            let sum = 64 * if operand.moment == Moment::Mean { value } else { value * value };
            match table(operand) {
                Table::Narrow(_) => assert!(sum < 1 << 31, "{}", operand.name()),
                Table::Wide(_) => assert!(sum < 1 << 38, "{}", operand.name()),
            }
        }
    }

    #[test]
    fn conversions_round_to_nearest_even() {
        for shift in 0..38 {
            for offset in -300i64..300 {
                for base in [1u64 << shift, 3 << shift, 0x5a5a5a5a5a >> (38 - shift)] {
                    let sum = base.saturating_add_signed(offset) & ((1 << 38) - 1);
                    assert_eq!(wide_to_f32(sum).to_bits(), (sum as f32).to_bits(), "{sum}");
                    let sum = (sum & 0x7fff_ffff) as u32;
                    assert_eq!(narrow_to_f32(sum).to_bits(), (sum as f32).to_bits(), "{sum}");
                }
            }
        }
    }
}
