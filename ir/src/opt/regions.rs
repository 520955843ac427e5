//! Region splitting: every instruction moves to the earliest region it can stand in, so that what is the same
//! for a whole lane or a whole row is computed once.

use crate::opt::dce::renumber;
use crate::program::{Block, Inst, Loop, Program, Reg, Region};

/// Splits the bodies; whether anything moved.
pub fn run(program: &mut Program) -> bool {
    let mut changed = false;
    for l in program.first.iter_mut().chain(std::iter::once(&mut program.second)) {
        changed |= split(l);
    }
    changed
}

fn split(l: &mut Loop) -> bool {
    let regions: Vec<Region> = l.body.dependences().into_iter().map(Region::earliest).collect();
    if l.body.iter().all(|(reg, _)| l.region_of(reg) == regions[reg.index()]) {
        return false;
    }
    let mut map = vec![Reg(0); l.body.len()];
    let mut insts: Vec<Inst> = Vec::with_capacity(l.body.len());
    let mut ends = [0u32; 3];
    // Within a region the order stays. Operands of a region's values stand in it or in an earlier one, but for
    // constants, which are invariant.
    for (region, end) in Region::ALL.into_iter().zip(&mut ends) {
        for (reg, inst) in l.body.iter().filter(|(reg, _)| regions[reg.index()] == region) {
            map[reg.index()] = Reg(insts.len() as u32);
            insts.push(renumber(&inst, &map));
        }
        *end = insts.len() as u32;
    }
    [l.invariant_end, l.uniform_end, _] = ends;
    l.body = Block::from_insts(insts);
    l.next = l.next.map(|next| next.map(|reg| map[reg.index()]));
    l.break_if = l.break_if.map(|reg| map[reg.index()]);
    true
}
