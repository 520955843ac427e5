//! The loop over the rows of a group of cases.

use pulp::{Simd, WithSimd};
use vsonar_ir::machine::Machine;

use super::lanes::Lanes;
use super::steps::{Step, load, load_mask, run, store, vectors};
use crate::exec::strips::StripTable;
use crate::vision::LANES;

/// A step's operand that is read from the strips: its address moves with the row.
#[derive(Debug, Clone, Copy)]
pub(super) struct WindowUse {
    pub(super) step: u32,
    pub(super) arg: u32,
    /// The operand's number.
    pub(super) operand: u8,
}

/// A value that is the same in every lane, and spread over them at each row.
#[derive(Debug, Clone, Copy)]
pub(super) struct Spread {
    /// 32 bits for each position, from the top.
    pub(super) table: *const u32,
    pub(super) to: *mut f32,
}

/// A carried register whose final value is wanted.
#[derive(Debug, Clone, Copy)]
pub(super) struct Final {
    pub(super) from: *const f32,
    pub(super) to: *mut f32,
}

/// Positions in the order they are visited: `count` of them from `first` on, downwards or upwards.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Positions {
    pub(super) first: usize,
    pub(super) count: usize,
    pub(super) up: bool,
}

impl Positions {
    /// The position visited after `n` others.
    #[inline(always)]
    fn at(self, n: usize) -> usize {
        if self.up { self.first - n } else { self.first + n }
    }

    /// These positions in parts of at most `most`.
    pub(super) fn parts(self, most: usize) -> impl Iterator<Item = Positions> {
        (0..self.count).step_by(most).map(move |n| Positions {
            first: self.at(n),
            count: (self.count - n).min(most),
            up: self.up,
        })
    }

    /// The position visited last.
    pub(super) fn last(self) -> usize {
        self.at(self.count - 1)
    }

    /// The positions as a range, from the top.
    pub(super) fn range(self) -> std::ops::Range<usize> {
        let (a, b) = (self.first, self.last());
        a.min(b)..a.max(b) + 1
    }
}

/// Rows of a loop and all that they read and write.
pub(super) struct Rows<'a> {
    pub(super) steps: &'a mut [Step],
    pub(super) windows: &'a [WindowUse],
    pub(super) spreads: &'a [Spread],
    pub(super) finals: &'a [Final],
    /// The mask of lanes that leave after a row.
    pub(super) break_if: Option<*const f32>,
    /// The mask of lanes that have not left, which is kept here from call to call.
    pub(super) alive: *mut f32,
    /// All lanes are alive at the beginning.
    pub(super) begin: bool,
    /// These are the last positions.
    pub(super) end: bool,
    /// The operands' strips, which cover these positions.
    pub(super) strips: &'a StripTable<'a>,
    pub(super) positions: Positions,
}

/// Runs rows until all positions are visited or every lane has left. With `HALF`, only the first half of the lanes is
/// there.
pub(super) struct Visit<'a, const HALF: bool>(Rows<'a>);

impl<'a, const HALF: bool> Visit<'a, HALF> {
    /// These rows, to be run.
    ///
    /// # Safety
    /// As long as this lives, the promise of [`super::steps`] holds for the steps, for the addresses of `finals`,
    /// `break_if` and `alive`, and for those of `spreads` that are written, with the instruction set that runs it;
    /// and the table of each spread has an entry for every position.
    pub(super) const unsafe fn new(rows: Rows<'a>) -> Visit<'a, HALF> {
        Visit(rows)
    }
}

impl<const HALF: bool> WithSimd for Visit<'_, HALF> {
    /// Whether every lane has left the loop.
    type Output = bool;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> bool {
        let rows = self.0;
        let all = Lanes(simd).mask(true);
        if rows.begin {
            each::<S, HALF>(|k| {
                // SAFETY: by the contract of `Visit::new`.
                unsafe { store(rows.alive, k, all) }
            });
        }
        for n in 0..rows.positions.count {
            let position = rows.positions.at(n);
            for window in rows.windows {
                let row = &rows.strips[usize::from(window.operand)][position * LANES..][..LANES];
                rows.steps[window.step as usize].args[window.arg as usize] = row.as_ptr();
            }
            for spread in rows.spreads {
                // SAFETY: by the contract.
                let bits = unsafe { spread.table.add(position).read() };
                let value = simd.splat_u32s(bits);
                each::<S, HALF>(|k| {
                    // SAFETY: by the contract.
                    unsafe { store(spread.to, k, value) }
                });
            }
            for step in rows.steps.iter() {
                // SAFETY: by the contract; the windows' rows are those of strips that are borrowed meanwhile.
                unsafe { run::<S, HALF>(simd, step) };
            }
            // SAFETY: by the contract.
            let left = |break_if| unsafe { leave::<S, HALF>(simd, break_if, rows.alive, rows.finals) };
            if rows.break_if.is_some_and(left) {
                return true;
            }
        }
        if rows.end {
            for last in rows.finals {
                each::<S, HALF>(|k| {
                    // SAFETY: by the contract.
                    unsafe { save(simd, load_mask::<S>(rows.alive, k), last, k) }
                });
            }
        }
        false
    }
}

/// Takes the lanes in which the break mask holds out of those alive and saves their registers. Whether none is left.
///
/// # Safety
/// The promise of [`super::steps`] holds for all of these addresses; both masks are masks.
#[inline(always)]
unsafe fn leave<S: Simd, const HALF: bool>(
    simd: S,
    break_if: *const f32,
    alive: *mut f32,
    finals: &[Final],
) -> bool {
    let mut some = Lanes(simd).mask(false);
    each::<S, HALF>(|k| {
        // SAFETY: by the contract.
        let leaving =
            unsafe { simd.and_m32s(load_mask::<S>(break_if, k), load_mask::<S>(alive.cast_const(), k)) };
        some = simd.or_m32s(some, leaving);
    });
    if !holds(simd, some) {
        return false;
    }
    let mut left = Lanes(simd).mask(false);
    each::<S, HALF>(|k| {
        // SAFETY: by the contract.
        unsafe {
            let before = load_mask::<S>(alive.cast_const(), k);
            let leaving = simd.and_m32s(load_mask::<S>(break_if, k), before);
            let after = simd.and_m32s(before, simd.not_m32s(leaving));
            store(alive, k, after);
            left = simd.or_m32s(left, after);
            for last in finals {
                save(simd, leaving, last, k);
            }
        }
    });
    !holds(simd, left)
}

/// Copies a carried register to where its final value is wanted, in the lanes of the mask.
///
/// # Safety
/// The addresses of `last` are those of slots, and `k` is the number of a vector in them.
#[inline(always)]
unsafe fn save<S: Simd>(simd: S, mask: S::m32s, last: &Final, k: usize) {
    // SAFETY: by the contract.
    unsafe {
        let old = load::<S>(last.to.cast_const(), k);
        store(last.to, k, simd.select_f32s(mask, load::<S>(last.from, k), old));
    }
}

/// Whether the mask holds in some lane.
#[inline(always)]
fn holds<S: Simd>(simd: S, mask: S::m32s) -> bool {
    simd.first_true_m32s(mask) < S::F32_LANES
}

/// Calls `work` for every vector of a slot, or of its first half.
#[inline(always)]
fn each<S: Simd, const HALF: bool>(work: impl FnMut(usize)) {
    (0..vectors::<S, HALF>()).for_each(work);
}
