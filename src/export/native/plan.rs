//! What a loop needs of the pixels, tile by tile, and where it lies in scratch memory.
//!
//! A column is walked in tiles of some dozens of positions. For each tile and lane, a *fill* copies the pixels of the
//! window columns and their neighbours into byte columns, computes the operators down those columns, adds what stands
//! side by side in a window into row sums, and those into window averages. The averages of four lanes are then
//! interleaved, a row of the tile after the other, for the loop's body to read.
//!
//! ```text
//! pixels ──> byte columns ──> operators, row sums ──> window averages of a lane ──> rows of lanes
//! ```
//!
//! So memory does not grow with the image, and a loop that ends early leaves the rest of the column alone.

use vsonar_ir::formula::image::looks;
use vsonar_ir::{Loop, Moment, Operand, Operator, Rect};

/// Rows in a tile's row sums are a multiple of this.
pub(super) const CHUNK: u32 = 16;

/// How the sums of an operand are held.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum SumKind {
    /// Window sums fit 16 bits, unsigned.
    Half,
    /// They fit 31 bits.
    Word,
    /// They do not: the lower and the upper 16 bits of the values are summed apart.
    Split,
}

/// One operand of a loop.
#[derive(Debug, Clone, Copy)]
pub(super) struct PlannedOperand {
    pub(super) operand: Operand,
    pub(super) kind: SumKind,
    /// Offset of its row sums in the scratch memory of a fill, in bytes.
    pub(super) row_sums: i32,
}

/// The tiles of a loop.
#[derive(Debug, Clone)]
pub(super) struct Plan {
    pub(super) rect: Rect,
    pub(super) width: u32,
    pub(super) height: u32,
    /// Positions in a tile.
    pub(super) positions: u32,
    /// Image rows whose row sums a tile needs, a multiple of [`CHUNK`]: `positions + rect.height() - 1`.
    pub(super) rows: u32,
    pub(super) operands: Vec<PlannedOperand>,
    /// Columns beside the window that neighbourhoods reach, to the left and to the right: 0 or 1.
    pub(super) beside: [u32; 2],
    /// Bytes from one byte column to the next. A column begins with the row above the tile's first.
    pub(super) column_bytes: i32,
    /// Bytes of scratch memory that a fill needs.
    pub(super) fill_bytes: i32,
}

impl Plan {
    /// The plan of a loop in images `width` x `height` pixels; `None` if it looks at no window. `single`
    /// says that one position alone is visited.
    pub(super) fn new(l: &Loop, width: u32, height: u32, single: bool) -> Option<Plan> {
        let (rect, operands) = (l.rect(), l.operands());
        if operands.is_empty() {
            return None;
        }
        let extra = rect.height() - 1;
        let needed = if single { 1 } else { rect.positions(height) };
        // The fewest rows in all; of equals the smallest tiles, which waste least where a loop ends early.
        let chunks = (1..=4).min_by_key(|&chunks| needed.div_ceil(chunks * CHUNK - extra) * chunks);
        let rows = chunks.unwrap_or(1) * CHUNK;
        let positions = rows - extra;

        // The columns of neighbourhoods to the left and to the right, as far as any operator looks there.
        let reaches = |column: usize| {
            operands.iter().any(|o| looks(o.operator).iter().skip(column).step_by(3).any(|looks| *looks))
        };
        let beside = [0, 2].map(|column| u32::from(reaches(column)));

        // The rows above and below, and what the last vector reads beyond them.
        let column_bytes = (rows + CHUNK) as i32;
        let mut end = column_bytes * (rect.width() + beside[0] + beside[1]) as i32;
        let operands = operands
            .into_iter()
            .map(|operand| {
                let kind = SumKind::of(operand, rect);
                let row_sums = end;
                end += (rows + CHUNK) as i32 * kind.bytes();
                PlannedOperand { operand, kind, row_sums }
            })
            .collect();
        Some(Plan { rect, width, height, positions, rows, operands, beside, column_bytes, fill_bytes: end })
    }

    /// Columns of pixels that a fill copies.
    pub(super) const fn columns(&self) -> u32 {
        self.rect.width() + self.beside[0] + self.beside[1]
    }

    /// Rows of pixels that a fill copies: the row above the tile's first, its rows, and the one below.
    pub(super) fn copied_rows(&self) -> i64 {
        i64::from(self.rows) + 2
    }

    /// Bytes of the offsets of those rows.
    pub(super) const fn offset_bytes(&self) -> i32 {
        8 * (self.rows as i32 + 2)
    }

    /// Whether one fill serves both: the loops differ in nothing that a fill knows of.
    pub(super) fn fills_like(&self, other: &Plan) -> bool {
        let operands = |plan: &Plan| plan.operands.iter().map(|p| p.operand).collect::<Vec<_>>();
        (self.rect, self.rows) == (other.rect, other.rows) && operands(self) == operands(other)
    }

    /// Bytes of the window averages of one lane: for each operand a binary32 for each of `rows`.
    pub(super) fn lane_bytes(&self) -> i32 {
        self.operands.len() as i32 * self.strip_bytes()
    }

    /// Bytes of one operand's averages of one lane.
    pub(super) const fn strip_bytes(&self) -> i32 {
        self.rows as i32 * 4
    }

    /// The operators, each with the moments that are wanted: the number of the operand, or none.
    pub(super) fn moments(&self) -> Vec<(Operator, [Option<usize>; 2])> {
        let number =
            |operator, moment| self.operands.iter().position(|p| p.operand == Operand { operator, moment });
        let both = |operator| [number(operator, Moment::Mean), number(operator, Moment::MeanSquare)];
        Operator::ALL
            .into_iter()
            .map(|o| (o, both(o)))
            .filter(|(_, m)| m.iter().any(Option::is_some))
            .collect()
    }
}

impl SumKind {
    /// The narrowest that holds every window's sum.
    fn of(operand: Operand, rect: Rect) -> SumKind {
        match operand.max() * u64::from(rect.area()) {
            0..=0xffff => SumKind::Half,
            0x1_0000..=0x7fff_ffff => SumKind::Word,
            _ => SumKind::Split,
        }
    }

    /// Bytes of a row sum. (Those of `Split` are two arrays of words.)
    pub(super) const fn bytes(self) -> i32 {
        match self {
            SumKind::Half => 2,
            SumKind::Word => 4,
            SumKind::Split => 8,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_fit_their_kind() {
        for rect in Rect::all() {
            for operand in Operand::all() {
                let largest = operand.max() * u64::from(rect.area());
                match SumKind::of(operand, rect) {
                    SumKind::Half => assert!(u16::try_from(largest).is_ok()),
                    SumKind::Word => assert!(i32::try_from(largest).is_ok()),
                    // The halves of the values sum to words, and the whole to a 64-bit integer.
                    SumKind::Split => assert!(operand.max() <= u64::from(u32::MAX) && rect.area() <= 64),
                }
            }
        }
    }
}
