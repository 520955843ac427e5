//! Dead code: instructions nobody reads, carried registers nobody needs, the first loop when nothing of it is
//! read.

use crate::op::Op;
use crate::program::{Block, Loop, Program, Reg};

/// Space for the walks, kept from program to program.
#[derive(Debug, Default)]
pub struct Sweeper {
    live: Vec<bool>,
    map: Vec<Reg>,
}

/// Removes what is dead; whether anything was.
pub fn run(program: &mut Program, sweeper: &mut Sweeper) -> bool {
    let mut changed = sweeper.sweep_loop(&mut program.second, [true, false, false, false, false]);
    let needed = program.second.reads_first_loop();
    if needed == [false; 5] {
        changed |= program.first.take().is_some();
    } else if let Some(first) = &mut program.first {
        changed |= sweeper.sweep_loop(first, needed);
    }
    changed
}

impl Sweeper {
    fn sweep_loop(&mut self, l: &mut Loop, outputs: [bool; 5]) -> bool {
        let mut changed = self.sweep_column(l);
        let registers = self.mark_body(l, outputs);
        for (next, needed) in l.next.iter_mut().zip(registers) {
            if !needed && next.is_some() {
                *next = None;
                changed = true;
            }
        }
        if !self.live.contains(&false) {
            return changed;
        }
        let kept_below =
            |end: u32| self.live[..end as usize].iter().map(|&live| u32::from(live)).sum::<u32>();
        (l.invariant_end, l.uniform_end) = (kept_below(l.invariant_end), kept_below(l.uniform_end));
        self.compact(&mut l.body);
        l.renumber_results(&self.map);
        true
    }

    fn sweep_column(&mut self, l: &mut Loop) -> bool {
        let block = &mut l.column.block;
        if block.len() == 1 {
            return false;
        }
        self.live.clear();
        self.live.resize(block.len(), false);
        self.live[l.column.result.index()] = true;
        self.mark(block, &mut [false; 5]);
        if !self.live.contains(&false) {
            return false;
        }
        self.compact(block);
        l.column.result = self.map[l.column.result.index()];
        true
    }

    /// Marks the instructions of the body that the outputs, the break, or a carried register one of them reads
    /// need; which carried registers these are.
    fn mark_body(&mut self, l: &Loop, outputs: [bool; 5]) -> [bool; 5] {
        self.live.clear();
        self.live.resize(l.body.len(), false);
        if let Some(reg) = l.break_if {
            self.live[reg.index()] = true;
        }
        let mut needed = outputs;
        let mut marked = [false; 5];
        loop {
            for ((next, needed), marked) in l.next.iter().zip(needed).zip(&mut marked) {
                if needed && !*marked {
                    *marked = true;
                    next.iter().for_each(|reg| self.live[reg.index()] = true);
                }
            }
            self.mark(&l.body, &mut needed);
            if needed == marked {
                return needed;
            }
        }
    }

    /// Marks what the marked instructions read, and which carried registers.
    fn mark(&mut self, block: &Block, reads: &mut [bool; 5]) {
        for (i, inst) in block.insts().iter().enumerate().rev() {
            if self.live[i] {
                for arg in inst.args() {
                    self.live[arg.index()] = true;
                }
                if inst.op() == Op::Read {
                    reads[inst.imm() as usize] = true;
                }
            }
        }
    }

    /// Keeps the marked instructions; `map` then says where each is (nothing meaningful for the others).
    fn compact(&mut self, block: &mut Block) {
        self.map.clear();
        let insts = block.insts_mut();
        let mut kept = 0;
        for i in 0..insts.len() {
            self.map.push(Reg(kept as u32));
            if self.live[i] {
                insts[kept] = insts[i].renumber(&self.map);
                kept += 1;
            }
        }
        insts.truncate(kept);
    }
}
