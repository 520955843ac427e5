//! Compiled programs as the host calls them.

use std::marker::PhantomData;

use vsonar_ir::{Loop, Operand, Program};

use super::emit::Shape;
use super::entries::EntryKind;
use super::lanes::{Entry, LaneBlock};
use crate::exec::strips::StripTable;
use crate::vision::{LANES, strip_len};

/// The compiled parts of one loop.
#[derive(Debug, Clone, Copy)]
struct LoopCode {
    /// The column expression, where it needs code.
    column: Option<Entry>,
    body: Entry,
    /// The operands it reads, as bits by their numbers.
    operands: u32,
    /// Length of their strips.
    strip_len: usize,
}

/// Addresses of a program's entries, with what is needed to call them soundly.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Entries {
    shape: Shape,
    first: Option<LoopCode>,
    second: Option<LoopCode>,
}

impl Entries {
    /// The entries of a program at these addresses.
    pub(crate) fn new(
        program: &Program,
        shape: Shape,
        addresses: impl Iterator<Item = (EntryKind, *const u8)>,
    ) -> Entries {
        let mut columns = [None; 2];
        let mut bodies = [None; 2];
        for (kind, address) in addresses {
            // SAFETY: the functions are built by `entries::function` with exactly the signature of `Entry`, in
            // the host's own calling convention. Calling them stays unsafe.
            let entry = unsafe { std::mem::transmute::<*const u8, Entry>(address) };
            match kind {
                EntryKind::Column { first } => columns[usize::from(!first)] = Some(entry),
                EntryKind::Loop { first } => bodies[usize::from(!first)] = Some(entry),
            }
        }
        let code = |i: usize, l: Option<&Loop>| {
            let (l, body) = (l?, bodies[i]?);
            let operands = l.operands().iter().fold(0, |bits, operand| bits | 1 << operand.index());
            let strip_len = strip_len(l.rect(), program.height());
            Some(LoopCode { column: columns[i], body, operands, strip_len })
        };
        Entries { shape, first: code(0, program.first()), second: code(1, Some(program.second())) }
    }
}

/// Executable code of a program, alive for `'c`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Code<'c> {
    entries: Entries,
    memory: PhantomData<&'c ()>,
}

impl Code<'_> {
    /// Code at the addresses of `entries`.
    ///
    /// # Safety
    /// The addresses must be of finished functions of the program that stay executable for `'c`.
    pub(crate) const unsafe fn new<'c>(entries: Entries, memory: PhantomData<&'c ()>) -> Code<'c> {
        Code { entries, memory }
    }

    /// Evaluates the column expression of a loop for the first `len` cases of a group into `block.out[0]`.
    /// False, with nothing done, where the column is a leaf and has no code.
    pub(crate) fn run_column(&self, first: bool, block: &mut LaneBlock, len: usize) -> bool {
        let entry = self.part(first).and_then(|part| part.column);
        if let Some(entry) = entry {
            self.call(entry, block, len, &[&[]; Operand::COUNT]);
        }
        entry.is_some()
    }

    /// Runs a loop for the first `len` cases of a group, whose parameters stand in `block`; the final registers
    /// that anyone reads are in `block.out` afterwards. `strips` are those of the operands
    /// that the loop reads; others may be empty.
    ///
    /// # Panics
    /// If the program has no such loop, or the strips are too short.
    pub(crate) fn run_loop(&self, first: bool, block: &mut LaneBlock, len: usize, strips: &StripTable<'_>) {
        let part = self.part(first).expect("the program has this loop");
        for (number, strip) in
            strips.iter().enumerate().filter(|(number, _)| part.operands >> number & 1 == 1)
        {
            assert!(
                strip.len() >= part.strip_len,
                "strip {number}: {} values, not {}",
                strip.len(),
                part.strip_len
            );
        }
        self.call(part.body, block, len, strips);
    }

    fn part(&self, first: bool) -> Option<LoopCode> {
        if first { self.entries.first } else { self.entries.second }
    }

    fn call(&self, entry: Entry, block: &mut LaneBlock, len: usize, strips: &StripTable<'_>) {
        assert!(len <= LANES, "a group has {LANES} lanes, not {len}");
        let lanes = (&raw mut *block).cast::<f32>();
        let table = strips.map(<[f32]>::as_ptr);
        for lane in (0..len).step_by(self.entries.shape.lanes()) {
            // SAFETY: the code is alive and of this signature (`Code::new`). It reads and writes, at constant
            // offsets, its own lanes of the arrays of a `LaneBlock`, the first of which starts the block; LANES
            // is a multiple of the lanes at once, so they stay inside. It reads its lanes of those strips
            // whose length `run_loop` has checked, and no others.
            unsafe { entry(lanes.add(lane), table.as_ptr(), lane * size_of::<f32>()) };
        }
    }
}
