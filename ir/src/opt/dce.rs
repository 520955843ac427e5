//! Dead code: instructions nobody reads, carried registers nobody needs, the first loop when nothing of it is
//! read.

use crate::op::Leaf;
use crate::program::{Block, Inst, Loop, Program, Reg};

/// Removes what is dead; whether anything was.
pub fn run(program: &mut Program) -> bool {
    let mut changed = sweep_loop(&mut program.second, [true, false, false, false, false]);
    let needed = program.second.reads_first_loop();
    if needed == [false; 5] {
        changed |= program.first.take().is_some();
    } else if let Some(first) = &mut program.first {
        changed |= sweep_loop(first, needed);
    }
    changed
}

fn sweep_loop(l: &mut Loop, outputs: [bool; 5]) -> bool {
    let mut changed = sweep_column(l);
    let live = live_body(l, outputs);
    let mut registers = outputs;
    for (reg, inst) in l.body.iter() {
        if let (true, Some(Leaf::Read(k))) = (live[reg.index()], inst.leaf()) {
            registers[k as usize] = true;
        }
    }
    for (next, needed) in l.next.iter_mut().zip(registers) {
        if !needed && next.is_some() {
            *next = None;
            changed = true;
        }
    }
    if live.iter().all(|&live| live) {
        return changed;
    }
    let kept_below = |end: u32| live[..end as usize].iter().filter(|&&live| live).count() as u32;
    (l.invariant_end, l.uniform_end) = (kept_below(l.invariant_end), kept_below(l.uniform_end));
    let map = compact(&mut l.body, &live);
    l.next = l.next.map(|next| next.map(|reg| map[reg.index()]));
    l.break_if = l.break_if.map(|reg| map[reg.index()]);
    true
}

fn sweep_column(l: &mut Loop) -> bool {
    let block = &mut l.column.block;
    let mut live = vec![false; block.len()];
    live[l.column.result.index()] = true;
    mark(block, &mut live);
    if live.iter().all(|&live| live) {
        return false;
    }
    let map = compact(block, &live);
    l.column.result = map[l.column.result.index()];
    true
}

/// The instructions of the body that the outputs, the break, or a carried register one of them reads need.
fn live_body(l: &Loop, outputs: [bool; 5]) -> Vec<bool> {
    let mut live = vec![false; l.body.len()];
    let mut registers = outputs;
    if let Some(reg) = l.break_if {
        live[reg.index()] = true;
    }
    loop {
        for (next, needed) in l.next.iter().zip(registers) {
            if let (Some(reg), true) = (next, needed) {
                live[reg.index()] = true;
            }
        }
        mark(&l.body, &mut live);
        let before = registers;
        for (reg, inst) in l.body.iter() {
            if let (true, Some(Leaf::Read(k))) = (live[reg.index()], inst.leaf()) {
                registers[k as usize] = true;
            }
        }
        if registers == before {
            return live;
        }
    }
}

/// Marks what the marked instructions read.
fn mark(block: &Block, live: &mut [bool]) {
    for (reg, inst) in block.iter().rev() {
        if live[reg.index()] {
            for arg in inst.args() {
                live[arg.index()] = true;
            }
        }
    }
}

/// Keeps the live instructions; where each register is now (meaningless for dead ones).
fn compact(block: &mut Block, live: &[bool]) -> Vec<Reg> {
    let mut map = vec![Reg(0); block.len()];
    let mut insts: Vec<Inst> = Vec::with_capacity(block.len());
    for (reg, inst) in block.iter() {
        if live[reg.index()] {
            map[reg.index()] = Reg(insts.len() as u32);
            insts.push(renumber(&inst, &map));
        }
    }
    *block = Block::from_insts(insts);
    map
}

/// The instruction with its operands where `map` says they are.
pub(crate) fn renumber(inst: &Inst, map: &[Reg]) -> Inst {
    let mut args = [Reg(0); 3];
    for (to, from) in args.iter_mut().zip(inst.args()) {
        *to = map[from.index()];
    }
    Inst::new(inst.op(), args, inst.imm())
}
