//! The letters that registers had in the trees.
//!
//! The optimiser numbers the carried registers anew. For a reader who has the trees beside the listing they get their
//! letters back, where that can be seen: a register that ends with the same values as one of the program before the
//! optimiser, on random images, takes its letter. Whatever the letters, the listing means the same.

use image::GrayImage;
use vsonar_ir::{Loop, Program, reference};

use super::build::RegisterNames;
use crate::vision::WindowSums;

/// Columns of each image that are run.
const COLUMNS: u32 = 3;

/// The letters of the carried registers of `optimised`, as `lowered` has them.
pub(super) fn letters(lowered: &Program, optimised: &Program, images: &[GrayImage]) -> RegisterNames {
    let mut runs = Vec::new();
    for image in images {
        let windows = WindowSums::new(image);
        for i in 1..=COLUMNS {
            let x = (i * (image.width() - 1) / (COLUMNS + 1)) as f32;
            runs.push((reference::run(lowered, &windows, x), reference::run(optimised, &windows, x)));
        }
    }
    let first: Vec<_> = runs.iter().map(|(before, after)| (before.first, after.first)).collect();
    let second: Vec<_> = runs.iter().map(|(before, after)| (before.second, after.second)).collect();
    [of(optimised.first(), &first, false), of(Some(optimised.second()), &second, true)]
}

/// The letters of one loop's registers, given final registers before and after the optimiser.
fn of(l: Option<&Loop>, runs: &[([f32; 5], [f32; 5])], has_answer: bool) -> [u8; 5] {
    let mut letters: [Option<u8>; 5] = [None; 5];
    let Some(l) = l else { return [0, 1, 2, 3, 4] };
    if has_answer {
        letters[0] = Some(0);
    }
    let taken = |letters: &[Option<u8>; 5], j: u8| letters.contains(&Some(j));
    for k in (0..5usize).filter(|&k| l.next()[k].is_some()) {
        let alike = |j: u8| runs.iter().all(|(b, a)| same(b[usize::from(j)], a[k]));
        let found = (0..5u8).find(|&j| !taken(&letters, j) && alike(j));
        letters[k] = letters[k].or(found);
    }
    for k in 0..5 {
        if letters[k].is_none() {
            let own = Some(k as u8).filter(|&j| !taken(&letters, j));
            letters[k] = own.or_else(|| (0..5u8).find(|&j| !taken(&letters, j)));
        }
    }
    letters.map(|letter| letter.unwrap_or(0))
}

fn same(a: f32, b: f32) -> bool {
    a.to_bits() == b.to_bits() || a.is_nan() && b.is_nan()
}
