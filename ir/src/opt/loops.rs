//! What the shape of a loop says about its values.
//!
//! * A carried register that every position leaves as it is, or sets to 0, is 0 throughout: its reads are
//!   forwarded to the constant.
//! * A loop that breaks at its first position visits one row: reads are 0, `y` and `first-window` are known.
//! * A loop without a break whose needed registers read no carried register depends on its last position
//!   alone: [`Span::Last`].
//! * A first-loop register that every position sets to the same constant, or none sets, is that constant in
//!   the second loop.

use crate::op::Leaf;
use crate::opt::simplify::Writer;
use crate::program::{Loop, Program, Span};

/// Applies all of it; whether anything changed.
pub fn run(program: &mut Program) -> bool {
    let height = program.height;
    let mut changed = false;
    let mut writer = Writer::default();
    for l in program.first.iter_mut().chain(std::iter::once(&mut program.second)) {
        changed |= shorten(l);
        changed |= forward(l, height, &mut writer);
    }
    changed | forward_first_loop(program, &mut writer)
}

/// Narrows the span or drops a break that cannot come or says nothing.
fn shorten(l: &mut Loop) -> bool {
    if let Some(reg) = l.break_if
        && (l.body.inst(reg).leaf() == Some(Leaf::MConst(false)) || l.span == Span::Last)
    {
        l.break_if = None;
        return true;
    }
    let reads = l.body.insts().iter().any(|inst| matches!(inst.leaf(), Some(Leaf::Read(_))));
    if l.break_if.is_none() && l.span == Span::All && !reads {
        l.span = Span::Last;
        return true;
    }
    false
}

/// Whether the loop ends at its first position.
fn breaks_at_once(l: &Loop) -> bool {
    l.break_if.is_some_and(|reg| l.body.inst(reg).leaf() == Some(Leaf::MConst(true)))
}

fn forward(l: &mut Loop, height: u32, writer: &mut Writer) -> bool {
    let one_position = l.span == Span::Last || breaks_at_once(l);
    let (row, first_window) = (l.rows(height).next(), l.first_window_at_start(height));
    let leaf_of_next = l.next.map(|next| next.map(|reg| l.body.inst(reg).leaf()));
    let constant_zero = |k: u8| match leaf_of_next[k as usize] {
        None => true,
        Some(Some(Leaf::Read(of))) => of == k,
        Some(Some(Leaf::Const(value))) => value.to_bits() == 0,
        Some(_) => false,
    };
    let replace = |leaf: Leaf| match (leaf, row) {
        (Leaf::Read(k), _) if one_position || constant_zero(k) => Leaf::Const(0.0),
        (Leaf::Y, Some(row)) if one_position => Leaf::Const(row as f32),
        (Leaf::FirstWindow, _) if one_position => Leaf::Const(first_window),
        _ => leaf,
    };
    // Compared by bits: a NaN equals itself here.
    if l.body
        .insts()
        .iter()
        .all(|inst| inst.leaf().is_none_or(|leaf| replace(leaf).encode() == leaf.encode()))
    {
        return false;
    }
    writer.rewrite_body(l, replace)
}

/// The value of each first-loop register that is known.
fn known_finals(first: Option<&Loop>) -> [Option<f32>; 5] {
    let Some(l) = first else { return [Some(0.0); 5] };
    let mut known = [None; 5];
    for (k, (known, next)) in known.iter_mut().zip(l.next).enumerate() {
        *known = match next.map(|reg| l.body.inst(reg).leaf()) {
            None => Some(0.0),
            Some(Some(Leaf::Const(value))) => Some(value),
            Some(Some(Leaf::Read(of))) if of as usize == k => Some(0.0),
            Some(_) => None,
        };
    }
    known
}

fn forward_first_loop(program: &mut Program, writer: &mut Writer) -> bool {
    let known = known_finals(program.first.as_ref());
    let reads = program.second.reads_first_loop();
    if !reads.iter().zip(known).any(|(&read, known)| read && known.is_some()) {
        return false;
    }
    let replace = |leaf: Leaf| match leaf {
        Leaf::Iter2(k) => known[k as usize].map_or(leaf, Leaf::Const),
        _ => leaf,
    };
    let l = &mut program.second;
    writer.rewrite_column(&mut l.column, replace) | writer.rewrite_body(l, replace)
}
