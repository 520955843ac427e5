//! What the shape of a loop says about its values.
//!
//! * A loop without a break whose needed registers read no carried register depends on its last position
//!   alone: [`Span::Last`].
//! * A loop that breaks at its first position visits that alone: it is the last of the other direction. Whether it
//!   does is seen with the intervals of the first position, where carried registers are 0 and `y` is one row.
//! * A second loop whose answer is one of the first one's registers adds nothing to it.
//! * What a loop does not look at is set to the same in all such loops, so that they are equal: the column where
//!   neither `x` nor a window is read, the rectangle's width besides, and where a single position is visited and
//!   no row matters, its height and the direction.

use crate::op::{Leaf, Op};
use crate::opt::interval::Interval;
use crate::opt::ranges::{self, Leaves};
use crate::opt::simplify::Writer;
use crate::program::{Direction, Inst, Loop, Program, Span};
use crate::window::Rect;

/// Applies all of it; whether anything changed.
pub fn run(program: &mut Program, writer: &mut Writer) -> bool {
    let (width, height) = (program.width, program.height);
    let mut changed = false;
    let mut iter2 = [Interval::ANY; 5];
    if let Some(first) = &mut program.first {
        changed |= reshape(first, width, height, iter2, writer);
        if program.second.break_if.is_some() && program.second.reads_first_loop() != [false; 5] {
            let values = &mut writer.scratch;
            let mut leaves = Leaves::with_column(first, width, height, iter2, values);
            leaves.find_reads(first, values);
            iter2 = ranges::finals(first, &leaves, values);
        }
    }
    changed |= reshape(&mut program.second, width, height, iter2, writer);
    changed | merge(program)
}

/// Applies what concerns a single loop. `iter2`: the first loop's final registers.
fn reshape(l: &mut Loop, width: u32, height: u32, iter2: [Interval; 5], writer: &mut Writer) -> bool {
    let mut changed = shorten(l);
    changed |= run_once(l, width, height, iter2, writer);
    changed | forget_header(l, width)
}

/// Makes the first loop the only one where the answer is one of its registers.
fn merge(program: &mut Program) -> bool {
    let second = &program.second;
    let answer = second.next[0].and_then(|reg| second.body.inst(reg).leaf());
    let (Some(Leaf::Iter2(k)), Some(first)) = (answer, program.first.as_ref()) else { return false };
    let mut l = first.clone();
    l.next.swap(0, k as usize);
    for inst in l.body.insts_mut() {
        match inst.leaf() {
            Some(Leaf::Read(0)) => *inst = Inst::of(Leaf::Read(k)),
            Some(Leaf::Read(of)) if of == k => *inst = Inst::of(Leaf::Read(0)),
            _ => {}
        }
    }
    (program.first, program.second) = (None, l);
    true
}

fn reads(l: &Loop, wanted: impl Fn(Op) -> bool) -> bool {
    l.body.insts().iter().any(|inst| wanted(inst.op()))
}

/// Narrows the span or drops a break that cannot come or says nothing.
fn shorten(l: &mut Loop) -> bool {
    if let Some(reg) = l.break_if
        && (l.body.inst(reg).leaf() == Some(Leaf::MConst(false)) || l.span == Span::Last)
    {
        l.break_if = None;
        return true;
    }
    if l.break_if.is_none() && l.span == Span::All && !reads(l, |op| op == Op::Read) {
        l.span = Span::Last;
        return true;
    }
    false
}

/// Turns a loop that ends at its first position round, so that this is its last.
fn run_once(l: &mut Loop, width: u32, height: u32, iter2: [Interval; 5], writer: &mut Writer) -> bool {
    let Some(break_if) = l.break_if else { return false };
    let leaves =
        Leaves::with_column(l, width, height, iter2, &mut writer.scratch).at_first_position(l, height);
    ranges::run(&l.body, &leaves, &mut writer.scratch);
    if writer.scratch[break_if.index()] != Interval::TRUE {
        return false;
    }
    let (first_window, row) = (l.first_window_at_start(height), l.rows(height).next());
    l.break_if = None;
    l.span = Span::Last;
    l.direction = match l.direction {
        Direction::Up => Direction::Down,
        Direction::Down => Direction::Up,
    };
    writer.leaves = leaves;
    writer.rewrite_body(l, |leaf| match (leaf, row) {
        (Leaf::Read(_), _) => Leaf::Const(0.0),
        (Leaf::Y, Some(row)) => Leaf::Const(row as f32),
        (Leaf::FirstWindow, _) => Leaf::Const(first_window),
        _ => leaf,
    });
    true
}

/// Sets what the body does not look at.
fn forget_header(l: &mut Loop, width: u32) -> bool {
    if reads(l, |op| matches!(op, Op::X | Op::Window)) {
        return false;
    }
    // Without a column the rectangle's width says nothing, without rows its height neither. `first-window` asks
    // only whether there is more than one position.
    let no_rows = l.span == Span::Last && !reads(l, |op| matches!(op, Op::Y | Op::FirstWindow));
    let alike = |rect: &Rect| no_rows || rect.height() == l.rect.height();
    let rect = Rect::all().find(alike).unwrap_or(l.rect);
    let direction = if no_rows { Direction::Down } else { l.direction };
    let column = Leaf::Const(rect.columns(width).0 as f32);
    let changed = (rect, direction, Some(column)) != (l.rect, l.direction, l.column.as_leaf());
    (l.rect, l.direction) = (rect, direction);
    if changed {
        l.column.set(column);
    }
    changed
}
