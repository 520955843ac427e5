//! The letters that registers had in the trees.
//!
//! The optimiser numbers the carried registers anew. For a reader who has the trees beside the listing they get their
//! letters back, where that can be seen: a register that ends with the same values as one of the program before the
//! optimiser, on random images, takes its letter; of several such letters that of a register which the tree needs.
//! Whatever the letters, the listing means the same.

use image::GrayImage;
use vsonar_ir::{Loop, Program, reference};

use super::build::RegisterNames;
use super::reduce::Live;
use crate::tree::{Individual, Node};
use crate::vision::WindowSums;

/// Columns of each image that are run.
const COLUMNS: u32 = 3;

/// How the registers of the trees and those of the listing belong together.
pub(super) struct Letters {
    /// The letters of the carried registers.
    pub(super) names: RegisterNames,
    /// For each loop and letter of the listing the letters of the tree's registers that end with the same values, as
    /// bits.
    pub(super) alike: [[u8; 5]; 2],
}

impl Letters {
    /// Those of `optimised`, as far as its runs and those of `lowered`, the same program before, tell.
    pub(super) fn of(
        individual: &Individual,
        live: &Live,
        lowered: &Program,
        optimised: &Program,
        images: &[GrayImage],
    ) -> Letters {
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
        let needed: Vec<[bool; 5]> =
            (0..individual.trees().count()).map(|i| needed(individual, live, i)).collect();
        let of_second = needed.last().copied().unwrap_or_default();
        let of_first = if needed.len() == 2 { needed[0] } else { [false; 5] };
        let of_second = of(Some(optimised.second()), &second, of_second, true);
        let of_first = of(optimised.first(), &first, of_first, false);
        Letters { names: [of_first.0, of_second.0], alike: [of_first.1, of_second.1] }
    }
}

/// The registers that a tree's live nodes store or read.
pub(super) fn needed(individual: &Individual, live: &Live, tree: usize) -> [bool; 5] {
    let mut out = [false; 5];
    for (node, live) in individual.trees().nth(tree).iter().flat_map(|t| t.nodes()).zip(&live.nodes[tree]) {
        if let (Node::Set(k) | Node::Read(k), true) = (node, live) {
            out[usize::from(*k)] = true;
        }
    }
    out
}

/// The letters of one loop's registers, given final registers before and after the optimiser and which registers the
/// tree needs; and, by letter, what they are alike to.
fn of(
    l: Option<&Loop>,
    runs: &[([f32; 5], [f32; 5])],
    needed: [bool; 5],
    has_answer: bool,
) -> ([u8; 5], [u8; 5]) {
    let mut letters: [Option<u8>; 5] = [None; 5];
    let Some(l) = l else { return ([0, 1, 2, 3, 4], [0; 5]) };
    let stored = |k: usize| l.next()[k].is_some();
    let alike = |j: usize, k: usize| runs.iter().all(|(before, after)| same(before[j], after[k]));
    if has_answer {
        letters[0] = Some(0);
    }
    let mut give = |wanted: &dyn Fn(usize, usize) -> bool| {
        for k in 0..5 {
            let free = |j: &usize| !letters.contains(&Some(*j as u8));
            let found = (0..5).filter(free).find(|&j| wanted(j, k));
            letters[k] = letters[k].or(found.map(|j| j as u8));
        }
    };
    give(&|j, k| stored(k) && needed[j] && alike(j, k));
    give(&|j, k| stored(k) && alike(j, k));
    // The others take what the tree needs and nothing else is, if there is any; then their own, then what is left.
    give(&|j, k| stored(k) && needed[j] && j == k);
    give(&|j, k| stored(k) && needed[j]);
    give(&|j, k| j == k);
    give(&|_, _| true);
    let letters = letters.map(|letter| letter.unwrap_or(0));
    let mut like = [0u8; 5];
    for k in (0..5).filter(|&k| stored(k)) {
        like[usize::from(letters[k])] = (0..5).filter(|&j| alike(j, k)).map(|j| 1 << j).sum();
    }
    (letters, like)
}

fn same(a: f32, b: f32) -> bool {
    a.to_bits() == b.to_bits() || a.is_nan() && b.is_nan()
}
