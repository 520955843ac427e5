//! The optimiser: passes over programs, each exact to the bit.
//!
//! | pass | what it does |
//! |---|---|
//! | [`simplify`] | one walk down a block that folds constants ([`fold`]), applies the table of algebraic rewrites ([`algebra`]) and reuses equal values ([`gvn`]) |
//! | [`loops`] | carried registers that never change, loops that end at their first position or depend on their last alone, first-loop registers of known value |
//! | [`dce`] | instructions and registers nobody reads; the whole first loop when nothing of it is read |
//! | [`regions`] | every instruction to the earliest region it can stand in |
//! | [`expand`] | formulas above the machine's basic operations, written out (for back ends without out-of-line helpers) |
//!
//! [`optimise`] runs the first three until nothing changes, then splits the regions. No pass ever changes what a
//! program computes: not a bit of any answer, for any image, column, NaN or infinity.

pub mod algebra;
pub mod dce;
pub mod expand;
pub mod facts;
pub mod fold;
pub mod gvn;
pub mod loops;
pub mod regions;
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
    /// [`regions::run`].
    Regions,
    /// [`expand::run`].
    Expand,
}

impl Pass {
    /// Every pass.
    pub const ALL: [Pass; 5] = [Pass::Simplify, Pass::Loops, Pass::Dce, Pass::Regions, Pass::Expand];

    /// Runs the pass; whether the program changed.
    pub fn run(self, program: &mut Program) -> bool {
        let changed = match self {
            Pass::Simplify => simplify::run(program),
            Pass::Loops => loops::run(program),
            Pass::Dce => dce::run(program),
            Pass::Regions => regions::run(program),
            Pass::Expand => expand::run(program),
        };
        if cfg!(debug_assertions)
            && let Err(fault) = verify::verify(program)
        {
            panic!("{self:?} left a malformed program: {fault}\n{program}");
        }
        changed
    }
}

/// How often the passes may go round. Each round that changes anything removes an instruction or a register, or
/// moves along the order of the rewrite table, so the rounds end by themselves; this bounds the work.
const MAX_ROUNDS: usize = 16;

/// The optimised form of a program.
pub fn optimise(program: &Program) -> Program {
    let mut program = program.clone();
    for _ in 0..MAX_ROUNDS {
        let mut changed = Pass::Simplify.run(&mut program);
        changed |= Pass::Loops.run(&mut program);
        changed |= Pass::Dce.run(&mut program);
        if !changed {
            break;
        }
    }
    Pass::Regions.run(&mut program);
    program
}
