//! The optimiser: passes over programs, each exact to the bit.
//!
//! | pass | what it does |
//! |---|---|
//! | [`simplify`] | one walk down each block that folds constants ([`fold`]), decides what the ranges of its values decide ([`interval`], [`ranges`]), applies the table of algebraic rewrites ([`algebra`]), takes choices apart ([`choice`]), tries columns ([`columns`]) and reuses equal values ([`gvn`]) |
//! | [`loops`] | loops that end at their first position or depend on their last alone; columns, sizes and directions nothing depends on |
//! | [`dce`] | instructions and registers nobody reads; the whole first loop when nothing of it is read |
//! | [`order`] | one order of instructions, operands and registers for all programs that differ in it alone; every instruction in the earliest region it can stand in |
//! | [`expand`] | formulas above the machine's basic operations, written out (for back ends without out-of-line helpers) |
//!
//! [`optimise`] runs the first three until nothing changes, then puts things in order. No pass ever changes what a
//! program computes: not a bit of any answer, for any image, column, NaN or infinity. What the passes assume is that
//! window averages and columns keep to their ranges ([`Windows::average`](crate::Windows::average),
//! [`reference::answer`](crate::reference::answer)).

pub mod algebra;
pub mod choice;
pub mod columns;
pub mod dce;
pub mod expand;
pub mod fold;
pub mod gvn;
pub mod interval;
pub mod loops;
pub mod order;
pub mod ranges;
pub mod simplify;

use crate::program::Program;
use crate::verify;

/// A pass, by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Pass {
    /// [`simplify::run`].
    Simplify,
    /// [`loops::run`].
    Loops,
    /// [`dce::run`].
    Dce,
    /// [`order::run`].
    Order,
    /// [`expand::run`].
    Expand,
}

impl Pass {
    /// Every pass.
    pub const ALL: [Pass; 5] = [Pass::Simplify, Pass::Loops, Pass::Dce, Pass::Order, Pass::Expand];

    /// Runs the pass; whether the program changed.
    pub fn run(self, program: &mut Program) -> bool {
        Optimiser::default().run(self, program)
    }
}

/// How often the passes may go round. Each round that changes anything removes an instruction or a register, narrows
/// a range, or moves along the order of the rewrite table, so the rounds end by themselves; this bounds the work.
const MAX_ROUNDS: usize = 16;

/// Programs of more instructions than this may not grow to more than twice their length on the way; what shorter ones
/// can grow to takes milliseconds.
const LONG: usize = 1024;

/// How many instructions a block of the program may have for choices to be taken apart in it.
fn room(program: &Program) -> usize {
    if program.len() > LONG { 2 * program.len() } else { usize::MAX }
}

/// The optimiser with the space it works in, which it keeps: after the first programs it allocates nothing (but for a
/// copy of those longer than a thousand instructions).
///
/// ```
/// use vsonar_ir::{generate, opt};
/// let mut optimiser = opt::Optimiser::default();
/// for seed in 0..10 {
///     let program = generate::program(seed, 64, 48, 20);
///     let same = opt::optimise(&program);
///     assert_eq!(optimiser.optimise(program), same);
/// }
/// ```
#[derive(Debug, Default)]
pub struct Optimiser {
    writer: simplify::Writer,
    columns: columns::Columns,
    sweeper: dce::Sweeper,
    sorter: order::Sorter,
    live_operations: usize,
}

impl Optimiser {
    /// The optimised form of a program.
    pub fn optimise(&mut self, mut program: Program) -> Program {
        self.run(Pass::Dce, &mut program);
        self.live_operations = program.operations();
        let before = (program.len() > LONG).then(|| program.clone());
        self.writer.set_room(room(&program));
        self.rounds(&mut program);
        if let Some(before) = before.filter(|_| self.writer.was_full()) {
            // Half of them taken apart, choices are longer than whole.
            program = before;
            self.writer.set_room(0);
            self.rounds(&mut program);
        }
        self.pass(Pass::Order, &mut program);
        program
    }

    fn rounds(&mut self, program: &mut Program) {
        for _ in 0..MAX_ROUNDS {
            let mut changed = self.pass(Pass::Simplify, program);
            changed |= self.pass(Pass::Loops, program);
            changed |= self.pass(Pass::Dce, program);
            if !changed {
                break;
            }
        }
    }

    /// How many operations of the program last optimised were live before: not counted are leaves and what
    /// plainly nobody reads.
    pub const fn live_operations(&self) -> usize {
        self.live_operations
    }

    /// Runs one pass; whether the program changed.
    ///
    /// # Panics
    /// In debug builds, if the pass leaves a malformed program.
    pub fn run(&mut self, pass: Pass, program: &mut Program) -> bool {
        self.writer.set_room(room(program));
        self.pass(pass, program)
    }

    fn pass(&mut self, pass: Pass, program: &mut Program) -> bool {
        let changed = match pass {
            Pass::Simplify => simplify::run(program, &mut self.writer, &mut self.columns),
            Pass::Loops => loops::run(program, &mut self.writer),
            Pass::Dce => dce::run(program, &mut self.sweeper),
            Pass::Order => order::run(program, &mut self.sorter, &mut self.sweeper),
            Pass::Expand => expand::run(program),
        };
        if cfg!(debug_assertions)
            && let Err(fault) = verify::verify(program)
        {
            panic!("{pass:?} left a malformed program: {fault}\n{program}");
        }
        changed
    }
}

/// The optimised form of a program; for many of them keep an [`Optimiser`].
pub fn optimise(program: &Program) -> Program {
    Optimiser::default().optimise(program.clone())
}
