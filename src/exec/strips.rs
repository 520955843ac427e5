//! The strips a loop reads, wherever they are kept.

use std::sync::Arc;

use vsonar_ir::{Operand, Rect};

use crate::vision::{CachedStrips, CaseSet, LANES, strip_len};

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

impl<'a> Strips<'a> {
    /// The strips of `operands` for a group in these columns, where they need not be gathered: none are read, they are
    /// the cases' `own` columns, or the set keeps them ([`CaseSet::cached_strips`]).
    pub(crate) fn find(
        cases: &'a CaseSet,
        group: usize,
        rect: Rect,
        own: bool,
        columns: &[u32; LANES],
        operands: &[Operand],
    ) -> Option<Strips<'a>> {
        match (operands.is_empty(), own) {
            (true, _) => Some(Strips::None),
            (false, true) => Some(Strips::Own(cases.x_obstacle_arena(rect, group))),
            (false, false) => cases.cached_strips(group, rect, columns, operands).map(Strips::Cached),
        }
    }

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
