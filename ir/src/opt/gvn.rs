//! Value numbering: equal instructions of equal operands are one.

use crate::program::{Inst, Reg};

/// The instructions of a block by what they compute: an open-addressed table of register numbers, of which those
/// of earlier blocks count as free.
#[derive(Debug, Default)]
pub struct Numbering {
    /// The block a slot belongs to, and the register in it.
    slots: Vec<(u32, Reg)>,
    block: u32,
}

impl Numbering {
    /// Forgets everything, keeping the memory, and makes room for a block of about `len` instructions.
    pub fn clear(&mut self, len: usize) {
        if self.slots.len() < 2 * len || self.block == u32::MAX {
            self.slots.clear();
            self.slots.resize((2 * len).next_power_of_two().max(64), (0, Reg(0)));
            self.block = 0;
        }
        self.block += 1;
    }

    /// The register that holds the instruction's value already, among `insts`.
    pub fn find(&self, inst: &Inst, insts: &[Inst]) -> Option<Reg> {
        let slot = self.slots[self.slot(inst, insts)];
        (slot.0 == self.block).then_some(slot.1)
    }

    /// Remembers that the last of `insts` holds its value. No equal one may be known.
    pub fn insert_last(&mut self, insts: &[Inst]) {
        if insts.len() * 2 > self.slots.len() {
            self.clear(insts.len());
            (1..insts.len()).for_each(|len| self.put_last(&insts[..len]));
        }
        self.put_last(insts);
    }

    fn put_last(&mut self, insts: &[Inst]) {
        let [earlier @ .., last] = insts else { return };
        let slot = self.slot(last, earlier);
        self.slots[slot] = (self.block, Reg(earlier.len() as u32));
    }

    /// The slot of an instruction, or the free one where it would stand.
    fn slot(&self, inst: &Inst, insts: &[Inst]) -> usize {
        let mask = self.slots.len() - 1;
        let mut at = (inst.mix() >> 16) as usize & mask;
        loop {
            let (block, reg) = self.slots[at];
            if block != self.block || insts[reg.index()] == *inst {
                return at;
            }
            at = (at + 1) & mask;
        }
    }
}

/// The form of an instruction that all its equals share: operands that may change places in a fixed order, constants
/// (as told by `is_const`) last.
#[must_use]
pub fn canonical(inst: Inst, may_exchange: bool, is_const: impl Fn(Reg) -> bool) -> Inst {
    if !may_exchange {
        return inst;
    }
    let [a, b] = [inst.args()[0], inst.args()[1]];
    let key = |reg| (is_const(reg), reg);
    if key(a) <= key(b) { inst } else { Inst::new(inst.op(), [b, a, Reg(0)], inst.imm()) }
}
