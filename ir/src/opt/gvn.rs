//! Value numbering: equal instructions of equal operands are one.

use rustc_hash::FxHashMap;

use crate::program::{Inst, Reg};

/// The instructions of a block by what they compute.
#[derive(Debug, Default)]
pub struct Numbering {
    known: FxHashMap<Inst, Reg>,
}

impl Numbering {
    /// Forgets everything, keeping the memory.
    pub fn clear(&mut self) {
        self.known.clear();
    }

    /// The register that holds the instruction's value already.
    pub fn find(&self, inst: &Inst) -> Option<Reg> {
        self.known.get(inst).copied()
    }

    /// Remembers where an instruction's value is.
    pub fn insert(&mut self, inst: Inst, reg: Reg) {
        self.known.insert(inst, reg);
    }
}

/// The form of an instruction that all its equals share: operands of a commutative operation in a fixed order,
/// constants (as told by `is_const`) last.
#[must_use]
pub fn canonical(inst: Inst, is_const: impl Fn(Reg) -> bool) -> Inst {
    if !inst.op().is_commutative() {
        return inst;
    }
    let [a, b] = [inst.args()[0], inst.args()[1]];
    let key = |reg| (is_const(reg), reg);
    if key(a) <= key(b) { inst } else { Inst::new(inst.op(), [b, a, Reg(0)], inst.imm()) }
}
