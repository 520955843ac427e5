//! The strips a loop reads, wherever they are kept.

use std::sync::Arc;

use vsonar_ir::{Operand, Rect};

use crate::vision::{CachedStrips, strip_len};

/// A strip for each operand, by its number; empty where a loop does not read it. The layout is that of
/// [`crate::vision::strips`].
pub(crate) type StripTable<'a> = [&'a [f32]; Operand::COUNT];

/// What holds the strips of a loop for a group of cases.
pub(crate) enum Strips<'a> {
    /// The loop reads no window.
    None,
    /// An arena with all operands.
    Own(&'a [f32]),
    /// Strips of other columns.
    Cached(Arc<CachedStrips>),
}

impl Strips<'_> {
    /// The strips of these operands, each as long as [`strip_len`].
    ///
    /// # Panics
    /// If one of them is not there.
    pub(crate) fn table(&self, rect: Rect, height: u32, operands: &[Operand]) -> StripTable<'_> {
        let len = strip_len(rect, height);
        let mut table: StripTable<'_> = [&[]; Operand::COUNT];
        for &operand in operands {
            let number = usize::from(operand.index());
            table[number] = match self {
                Strips::None => &[],
                Strips::Own(arena) => &arena[number * len..][..len],
                Strips::Cached(strips) => &strips.strip(operand)[..len],
            };
        }
        table
    }
}
