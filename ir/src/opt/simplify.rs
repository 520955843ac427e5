//! One walk down a block: fold constants, apply the algebraic table, reuse equal values.

use crate::op::Leaf;
use crate::opt::facts::Facts;
use crate::opt::gvn::{self, Numbering};
use crate::opt::{algebra, fold};
use crate::program::{Block, Column, Inst, Loop, Program, Reg};

/// Simplifies every block of a program; whether anything changed.
pub fn run(program: &mut Program) -> bool {
    let mut changed = false;
    let mut writer = Writer::default();
    for l in program.first.iter_mut().chain(std::iter::once(&mut program.second)) {
        changed |= run_loop(l, &mut writer);
    }
    changed
}

fn run_loop(l: &mut Loop, writer: &mut Writer) -> bool {
    writer.rewrite_column(&mut l.column, |leaf| leaf) | writer.rewrite_body(l, |leaf| leaf)
}

/// A block being written, with what is known of its registers.
#[derive(Debug, Default)]
pub struct Writer {
    insts: Vec<Inst>,
    facts: Vec<Facts>,
    numbering: Numbering,
    map: Vec<Reg>,
}

impl Writer {
    /// Rewrites `block` into this writer, passing each leaf through `leaf` first. Returns where each of the
    /// block's registers is now.
    pub fn rewrite(&mut self, block: &Block, leaf: impl Fn(Leaf) -> Leaf) -> &[Reg] {
        self.insts.clear();
        self.facts.clear();
        self.numbering.clear();
        let mut map = std::mem::take(&mut self.map);
        map.clear();
        for inst in block.insts() {
            let reg = match inst.leaf() {
                Some(l) => self.leaf(leaf(l)),
                None => {
                    let mut args = [Reg(0); 3];
                    for (to, from) in args.iter_mut().zip(inst.args()) {
                        *to = map[from.index()];
                    }
                    self.push(Inst::new(inst.op(), args, inst.imm()))
                }
            };
            map.push(reg);
        }
        self.map = map;
        &self.map
    }

    /// Rewrites a column expression in its place, passing each leaf through `leaf`; whether that changes it.
    pub fn rewrite_column(&mut self, column: &mut Column, leaf: impl Fn(Leaf) -> Leaf) -> bool {
        let map = self.rewrite(&column.block, leaf);
        column.result = map[column.result.index()];
        self.replace(&mut column.block)
    }

    /// Rewrites a body in its place, passing each leaf through `leaf`; whether that changes it.
    pub fn rewrite_body(&mut self, l: &mut Loop, leaf: impl Fn(Leaf) -> Leaf) -> bool {
        let map = self.rewrite(&l.body, leaf);
        l.next = l.next.map(|next| next.map(|reg| map[reg.index()]));
        l.break_if = l.break_if.map(|reg| map[reg.index()]);
        let changed = self.replace(&mut l.body);
        if changed {
            // What was computed out of order may stand anywhere; regions are split again at the end.
            (l.invariant_end, l.uniform_end) = (0, 0);
        }
        changed
    }

    /// The instructions written.
    pub fn insts(&self) -> &[Inst] {
        &self.insts
    }

    /// Puts what was written in the place of `block`; whether that changes it.
    pub fn replace(&mut self, block: &mut Block) -> bool {
        let changed = self.insts != block.insts();
        if changed {
            *block = Block::from_insts(self.insts.clone());
        }
        changed
    }

    /// The register of a leaf.
    pub fn leaf(&mut self, leaf: Leaf) -> Reg {
        let (op, imm) = leaf.encode();
        self.number(Inst::new(op, [Reg(0); 3], imm))
    }

    /// The register of an operation's value, simplified. The operands are registers of this writer.
    pub fn push(&mut self, inst: Inst) -> Reg {
        let inst = gvn::canonical(inst, |reg| self.constant(reg).is_some());
        if let Some(constant) = fold::fold(&inst, |i| self.constant(inst.args()[i])) {
            return self.leaf(constant);
        }
        if let Some(reg) = algebra::apply(self, &inst) {
            return reg;
        }
        self.number(inst)
    }

    /// The constant a register holds, if it is one.
    pub fn constant(&self, reg: Reg) -> Option<Leaf> {
        self.insts[reg.index()]
            .leaf()
            .filter(|leaf| matches!(leaf, Leaf::Const(_) | Leaf::IConst(_) | Leaf::MConst(_)))
    }

    /// The instruction that defines a register.
    pub fn inst(&self, reg: Reg) -> &Inst {
        &self.insts[reg.index()]
    }

    /// What is known of a register.
    pub fn facts(&self, reg: Reg) -> Facts {
        self.facts[reg.index()]
    }

    fn number(&mut self, inst: Inst) -> Reg {
        if let Some(reg) = self.numbering.find(&inst) {
            return reg;
        }
        let reg = Reg(self.insts.len() as u32);
        let facts = match inst.op().result() {
            crate::Ty::F32 => Facts::infer(&inst, |i| self.facts(inst.args()[i])),
            _ => Facts::ANY,
        };
        self.insts.push(inst);
        self.facts.push(facts);
        self.numbering.insert(inst, reg);
        reg
    }
}
