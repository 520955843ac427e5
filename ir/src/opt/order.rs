//! Canonical order: programs that compute the same by the same steps become equal, however the steps were
//! written down, and every instruction moves to the earliest region it can stand in, so that what is the same for
//! a whole lane or a whole row is computed once.
//!
//! Each instruction has a hash of what it computes. Operands of a commutative operation stand in the order of
//! their hashes, constants last; instructions stand in the order in which a depth-first walk from the results
//! leaves them (so operands close to their use), region by region. Carried registers are numbered in the order in
//! which that walk meets them; so that their numbers have no part in the hashes, a read's hash is that of what the
//! register is set to, in which in turn all reads count as one. A hash that two different instructions share costs
//! nothing but the chance of being found equal.
//!
//! What is dead is removed first: it has no place in a walk from the results.

use crate::op::{Depends, Leaf, Op};
use crate::opt::dce::{self, Sweeper};
use crate::opt::interval::Interval;
use crate::opt::ranges::{self, Leaves};
use crate::program::{Block, Inst, Loop, Program, Reg, Region, mix};

/// Space for the walks, kept from program to program.
#[derive(Debug, Default)]
pub struct Sorter {
    hashes: Vec<u64>,
    stack: Vec<(Reg, bool)>,
    visited: Vec<bool>,
    /// Registers in the order of the walk.
    order: Vec<Reg>,
    /// Where each register is now.
    map: Vec<Reg>,
    depends: Vec<Depends>,
    insts: Vec<Inst>,
    intervals: Vec<Interval>,
}

/// Orders every block; whether anything changed.
pub fn run(program: &mut Program, sorter: &mut Sorter, sweeper: &mut Sweeper) -> bool {
    let mut changed = dce::run(program, sweeper);
    // What may exchange its operands shows in the intervals; nobody asks for them in most programs.
    let asks = program.loops().flat_map(|l| [&l.body, &l.column.block]).any(chooses);
    let of_first =
        program.first.as_ref().filter(|_| asks).map(|l| sorter.leaves(l, program, [Interval::ANY; 5]));
    let finals = match (&program.first, &of_first) {
        (Some(first), Some(leaves)) => ranges::finals(first, leaves, &mut sorter.intervals),
        _ => [Interval::ANY; 5],
    };
    let of_second = asks.then(|| sorter.leaves(&program.second, program, finals));

    let iter2 = program.first.as_ref().map_or([0; 5], |first| {
        sorter.find_intervals(&first.body, of_first.as_ref());
        sorter.hash_loop(first, [1; 5], [0; 5])
    });
    // The answer is register a, whose number therefore stays.
    let mut answer = Numbers::default();
    answer.give(0);
    let mut asked = Numbers::default();
    let second = &mut program.second;
    changed |= sorter.sort_loop(second, of_second.as_ref(), [1, 0, 0, 0, 0], iter2, answer, &mut asked);
    if let Some(first) = &mut program.first {
        let nothing = &mut Numbers::default();
        changed |= sorter.sort_loop(first, of_first.as_ref(), [1; 5], [0; 5], asked, nothing);
    }
    changed
}

/// Whether a block has a minimum or maximum.
fn chooses(block: &Block) -> bool {
    block.insts().iter().any(|inst| matches!(inst.op(), Op::Min | Op::Max))
}

/// New numbers of carried registers, given in the order of asking.
#[derive(Debug, Clone, Copy, Default)]
struct Numbers {
    given: [Option<u8>; 5],
    old: [u8; 5],
    count: usize,
}

impl Numbers {
    fn give(&mut self, k: u8) {
        if self.given[k as usize].is_none() {
            self.given[k as usize] = Some(self.count as u8);
            self.old[self.count] = k;
            self.count += 1;
        }
    }

    fn of(&self, k: u32) -> u32 {
        self.given[k as usize].map_or(k, u32::from)
    }
}

impl Sorter {
    /// Orders a loop. `outputs` marks the registers read after it, `numbers` gives theirs; `iter2` has the hashes
    /// of the first loop's registers, which get their numbers in `of_first`.
    fn sort_loop(
        &mut self,
        l: &mut Loop,
        leaves: Option<&Leaves>,
        outputs: [u64; 5],
        iter2: [u64; 5],
        mut numbers: Numbers,
        of_first: &mut Numbers,
    ) -> bool {
        let column = &mut l.column;
        let mut changed = false;
        if column.block.len() > 1 || column.as_leaf().is_some_and(|leaf| matches!(leaf, Leaf::Iter2(_))) {
            self.find_intervals(&column.block, leaves);
            self.hash(&column.block, &[0; 5], &iter2);
            self.start(column.block.len());
            self.visit(&column.block, column.result, &mut numbers, of_first);
            changed |= self.write(&mut column.block, &numbers, of_first);
            let result = self.map[column.result.index()];
            changed |= std::mem::replace(&mut column.result, result) != result;
        }

        self.find_intervals(&l.body, leaves);
        self.hash_loop(l, outputs, iter2);
        self.start(l.body.len());
        // First the results, then what they read as they come to it, then what the break adds.
        let mut done = 0;
        let mut break_if = l.break_if;
        loop {
            if done < numbers.count {
                let next = l.next[numbers.old[done] as usize];
                next.iter().for_each(|reg| self.visit(&l.body, *reg, &mut numbers, of_first));
                done += 1;
            } else if let Some(reg) = break_if.take() {
                self.visit(&l.body, reg, &mut numbers, of_first);
            } else {
                break;
            }
        }
        debug_assert_eq!(self.order.len(), l.body.len(), "nothing is dead");
        let before = (l.next, l.break_if, l.invariant_end, l.uniform_end);
        [l.invariant_end, l.uniform_end] = self.place_by_region(&l.body);
        changed |= self.write(&mut l.body, &numbers, of_first);
        l.renumber_results(&self.map);
        let old = std::mem::take(&mut l.next);
        for (new, &k) in numbers.old[..numbers.count].iter().enumerate() {
            l.next[new] = old[k as usize];
        }
        changed | (before != (l.next, l.break_if, l.invariant_end, l.uniform_end))
    }

    /// The intervals of a loop's leaves.
    fn leaves(&mut self, l: &Loop, program: &Program, iter2: [Interval; 5]) -> Leaves {
        let values = &mut self.intervals;
        let mut leaves = Leaves::with_column(l, program.width, program.height, iter2, values);
        leaves.find_reads(l, values);
        leaves
    }

    /// Finds the block's intervals if they matter.
    fn find_intervals(&mut self, block: &Block, leaves: Option<&Leaves>) {
        if let Some(leaves) = leaves.filter(|_| chooses(block)) {
            ranges::run(block, leaves, &mut self.intervals);
        }
    }

    /// Whether the first two operands may change places.
    fn may_exchange(&self, inst: &Inst) -> bool {
        let interval = |i: usize| self.intervals[inst.args()[i].index()];
        match inst.op() {
            Op::Min | Op::Max => interval(0).equal_is_same(interval(1)),
            op => op.is_commutative(),
        }
    }

    /// Computes the hash of each register.
    fn hash(&mut self, block: &Block, reads: &[u64; 5], iter2: &[u64; 5]) {
        self.hashes.clear();
        for inst in block.insts() {
            let mut args = [0; 3];
            for (to, from) in args.iter_mut().zip(inst.args()) {
                *to = self.hashes[from.index()];
            }
            let hash = match inst.op() {
                Op::Read => mix(2, reads[inst.imm() as usize]),
                Op::Iter2 => mix(3, iter2[inst.imm() as usize]),
                op => {
                    if args[0] > args[1] && self.may_exchange(inst) {
                        args.swap(0, 1);
                    }
                    let own = (op as u64) << 32 | u64::from(inst.imm());
                    args[..inst.args().len()].iter().fold(mix(1, own), |hash, &arg| mix(hash, arg))
                }
            };
            self.hashes.push(hash);
        }
    }

    /// Computes the hash of each register of a body; those of what the carried registers are set to.
    fn hash_loop(&mut self, l: &Loop, outputs: [u64; 5], iter2: [u64; 5]) -> [u64; 5] {
        self.hash(&l.body, &outputs, &iter2);
        if l.body.insts().iter().any(|inst| inst.op() == Op::Read) {
            let reads = std::array::from_fn(|k| mix(outputs[k], self.final_hash(l, k)));
            self.hash(&l.body, &reads, &iter2);
        }
        std::array::from_fn(|k| self.final_hash(l, k))
    }

    fn final_hash(&self, l: &Loop, k: usize) -> u64 {
        l.next[k].map_or(0, |reg| self.hashes[reg.index()])
    }

    fn start(&mut self, len: usize) {
        self.order.clear();
        self.visited.clear();
        self.visited.resize(len, false);
    }

    /// The operands of an instruction in their final order.
    fn operands(&self, block: &Block, inst: &Inst) -> [Reg; 3] {
        let mut args = [Reg(0); 3];
        args[..inst.args().len()].copy_from_slice(inst.args());
        if self.may_exchange(inst) {
            let key = |reg: Reg| (is_constant(&block.insts()[reg.index()]), self.hashes[reg.index()]);
            if key(args[0]) > key(args[1]) {
                args.swap(0, 1);
            }
        }
        args
    }

    /// Walks from a register down.
    fn visit(&mut self, block: &Block, root: Reg, numbers: &mut Numbers, of_first: &mut Numbers) {
        self.stack.push((root, false));
        while let Some((reg, operands_done)) = self.stack.pop() {
            if operands_done {
                self.order.push(reg);
                continue;
            }
            if std::mem::replace(&mut self.visited[reg.index()], true) {
                continue;
            }
            let inst = &block.insts()[reg.index()];
            match inst.op() {
                Op::Read => numbers.give(inst.imm() as u8),
                Op::Iter2 => of_first.give(inst.imm() as u8),
                _ => {}
            }
            self.stack.push((reg, true));
            let args = self.operands(block, inst);
            self.stack.extend(args[..inst.args().len()].iter().rev().map(|arg| (*arg, false)));
        }
    }

    /// Places the registers region by region, each in the order of the walk; where the first two regions end.
    fn place_by_region(&mut self, block: &Block) -> [u32; 2] {
        self.depends.clear();
        for inst in block.insts() {
            let own = inst.leaf().map_or(Depends::NOTHING, Leaf::depends);
            let all = inst.args().iter().fold(own, |d, arg| d.join(self.depends[arg.index()]));
            self.depends.push(all);
        }
        // Stable, and at most a few dozen registers of three kinds.
        let region = |reg: &Reg| Region::earliest(self.depends[reg.index()]);
        self.order.sort_by_key(region);
        [Region::Invariant, Region::Uniform]
            .map(|last| self.order.iter().filter(|reg| region(reg) <= last).count() as u32)
    }

    /// Writes the block anew with its registers in their order and new numbers; whether that changes it.
    fn write(&mut self, block: &mut Block, numbers: &Numbers, of_first: &Numbers) -> bool {
        self.map.clear();
        self.map.resize(block.len(), Reg(0));
        for (i, reg) in self.order.iter().enumerate() {
            self.map[reg.index()] = Reg(i as u32);
        }
        self.insts.clear();
        for reg in &self.order {
            let inst = &block.insts()[reg.index()];
            let imm = match inst.op() {
                Op::Read => numbers.of(inst.imm()),
                Op::Iter2 => of_first.of(inst.imm()),
                _ => inst.imm(),
            };
            let args = self.operands(block, inst);
            let sorted = Inst::new(inst.op(), args, imm).renumber(&self.map);
            self.insts.push(sorted);
        }
        let changed = self.insts != block.insts();
        if changed {
            std::mem::swap(&mut self.insts, block.insts_mut());
        }
        changed
    }
}

fn is_constant(inst: &Inst) -> bool {
    matches!(inst.op(), Op::Const | Op::IConst | Op::MConst)
}
