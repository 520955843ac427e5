//! The intervals of the leaves of a block: what is known before anything is computed.
//!
//! Columns and rows follow from the image's size, window averages from their operators
//! ([`Rect::largest_average`]). What a carried register holds is found by running the body on intervals instead of numbers:
//! from +0, what the body leaves is joined until nothing changes, and a bound that keeps growing is given up.

use crate::op::{Leaf, Op};
use crate::opt::fold;
use crate::opt::interval::Interval;
use crate::program::{Block, Inst, Loop, Reg, Span};
use crate::window::{Operand, Rect};

/// How often the carried registers' intervals may grow before their growing bounds become infinite.
const PATIENCE: usize = 2;
/// How often after that, before nothing is claimed; each time another bound or flag of the five registers changes.
const MAX_ROUNDS: usize = 16;

/// The interval of each leaf.
#[derive(Debug, Clone)]
pub struct Leaves {
    rect: Rect,
    /// The column asked for.
    pub x_obstacle: Interval,
    /// The first loop's final registers.
    pub iter2: [Interval; 5],
    /// The window's centre column.
    pub x: Interval,
    /// The window's centre row.
    pub y: Interval,
    /// The mark of the first position.
    pub first_window: Interval,
    /// The carried registers before a position.
    pub read: [Interval; 5],
}

impl Default for Leaves {
    /// Nothing is known but what holds in every program.
    fn default() -> Leaves {
        let natural = Interval::new(0.0, f32::MAX).coarse(1.0 / 64.0);
        Leaves {
            rect: Rect::default(),
            x_obstacle: natural,
            iter2: [Interval::ANY; 5],
            x: natural,
            y: natural,
            first_window: first_window(),
            read: [Interval::ANY; 5],
        }
    }
}

impl Leaves {
    /// The leaves of a loop's column expression, with the first loop's final registers as given. Those of the
    /// body follow with [`Leaves::enter`].
    pub fn new(l: &Loop, width: u32, height: u32, iter2: [Interval; 5]) -> Leaves {
        let (top, bottom) = l.rect.rows(height);
        let last = l.rows(height).next().filter(|_| l.span == Span::Last);
        let (top, bottom) = last.map_or((top, bottom), |y| (y, y));
        let first_window = if l.span == Span::Last {
            Interval::of(l.first_window_at_start(height))
        } else if top == bottom {
            Interval::new(1.0, 1.0)
        } else {
            first_window()
        };
        // A single position reads what the registers start with.
        let read = if top == bottom { Interval::ZERO } else { Interval::ANY };
        Leaves {
            rect: l.rect,
            x_obstacle: whole(0, width - 1),
            iter2,
            x: Interval::ANY,
            y: whole(top, bottom),
            first_window,
            read: [read; 5],
        }
    }

    /// The same at the first position alone.
    #[must_use]
    pub fn at_first_position(&self, l: &Loop, height: u32) -> Leaves {
        let row = l.rows(height).next().map_or(self.y, |y| Interval::of(y as f32));
        let first_window = Interval::of(l.first_window_at_start(height));
        Leaves { y: row, first_window, read: [Interval::ZERO; 5], ..self.clone() }
    }

    /// Sets the range of `x` for a column expression with this result, in an image `width` wide.
    pub fn enter(&mut self, column: Interval, width: u32) {
        let resolve = |value| self.rect.resolve_column(value, width);
        // Clamping and rounding are monotone; a NaN stands for the lowest column.
        let lo = if column.nan { f32::NAN } else { column.lo };
        let hi = if column.is_empty() { f32::NAN } else { column.hi };
        self.x = whole(resolve(lo), resolve(hi));
    }

    /// The leaves of a loop's column expression and body, what is carried from position to position excepted: see
    /// [`Leaves::find_reads`]. `values` is scratch space.
    pub fn with_column(
        l: &Loop,
        width: u32,
        height: u32,
        iter2: [Interval; 5],
        values: &mut Vec<Interval>,
    ) -> Leaves {
        let mut leaves = Leaves::new(l, width, height, iter2);
        run(&l.column.block, &leaves, values);
        leaves.enter(values[l.column.result.index()], width);
        leaves
    }

    /// The interval of a leaf.
    pub fn of(&self, leaf: Leaf) -> Interval {
        match leaf {
            Leaf::Const(_) | Leaf::IConst(_) | Leaf::MConst(_) => Interval::of_constant(leaf),
            Leaf::XObstacle => self.x_obstacle,
            Leaf::Iter2(k) => self.iter2[k as usize],
            Leaf::X => self.x,
            Leaf::Y => self.y,
            Leaf::FirstWindow => self.first_window,
            Leaf::Read(k) => self.read[k as usize],
            Leaf::Window(operand) => average(self.rect, operand),
        }
    }

    /// Finds the intervals of the carried registers that the body reads; `values` is scratch space.
    pub fn find_reads(&mut self, l: &Loop, values: &mut Vec<Interval>) {
        if self.read[0] != Interval::ANY || !l.body.insts().iter().any(|inst| inst.op() == Op::Read) {
            return;
        }
        self.read = [Interval::ZERO; 5];
        for round in 0..PATIENCE + MAX_ROUNDS {
            run(&l.body, self, values);
            let mut grown = false;
            for (read, next) in self.read.iter_mut().zip(l.next) {
                let Some(next) = next else { continue };
                let mut joined = read.either(values[next.index()]);
                if joined == *read {
                    continue;
                }
                grown = true;
                if round >= PATIENCE {
                    joined.lo = if joined.lo < read.lo { f32::NEG_INFINITY } else { joined.lo };
                    joined.hi = if joined.hi > read.hi { f32::INFINITY } else { joined.hi };
                    joined.least = if joined.least < read.least { 0.0 } else { joined.least };
                }
                *read = joined;
            }
            if !grown {
                return;
            }
        }
        self.read = [Interval::ANY; 5];
    }
}

/// Whole numbers of pixels.
fn whole(lo: u32, hi: u32) -> Interval {
    Interval::new(lo as f32, hi as f32).coarse(1.0)
}

/// 1 or -1.
fn first_window() -> Interval {
    Interval::new(-1.0, 1.0).coarse(1.0)
}

/// The range of a window average.
fn average(rect: Rect, operand: Operand) -> Interval {
    // Where it is not zero, the sum is at least 1.
    Interval::new(0.0, rect.largest_average(operand)).coarse(1.0 / rect.area() as f32)
}

/// The intervals of a loop's final registers, given those of its leaves; `values` is scratch space.
pub fn finals(l: &Loop, leaves: &Leaves, values: &mut Vec<Interval>) -> [Interval; 5] {
    run(&l.body, leaves, values);
    // At least one position is visited, so the last one's values are all there are.
    l.next.map(|next| next.map_or(Interval::ZERO, |reg| values[reg.index()]))
}

/// The intervals of a block's registers, by number.
pub fn run(block: &Block, leaves: &Leaves, values: &mut Vec<Interval>) {
    values.clear();
    for inst in block.insts() {
        let value = infer(inst, leaves, values);
        values.push(value);
    }
}

fn infer(inst: &Inst, leaves: &Leaves, values: &[Interval]) -> Interval {
    if let Some(leaf) = inst.leaf() {
        return leaves.of(leaf);
    }
    let value = |reg: Reg| values[reg.index()];
    // Of single values the result is known to the bit, whatever is known of the operation in general.
    let constant = |i: usize| value(inst.args()[i]).constant(inst.op().operands()[i]);
    match fold::fold(inst, constant) {
        Some(leaf) => Interval::of_constant(leaf),
        None => of_operation(inst, value),
    }
}

/// The interval of an instruction that is no leaf, from those of its operands.
#[inline]
pub fn of_operation(inst: &Inst, value: impl Fn(Reg) -> Interval) -> Interval {
    let mut args = [Interval::ANY; 3];
    for (to, from) in args.iter_mut().zip(inst.args()) {
        *to = value(*from);
    }
    let same = matches!(inst.args(), [a, b] if a == b);
    Interval::infer(inst.op(), args, same)
}
