//! Compiles programs to native code with Cranelift and runs them.
//!
//! ```text
//! Program ── entries ──> emit_loop ──> emit (a Machine) ──> Cranelift ──> compiler: executable memory
//!                                         │                                     │
//!                                    Op::apply: the one                    code: column 1, loop 1,
//!                                    table of operations                   column 2, loop 2 per group
//! ```
//!
//! One emitter serves two [`Shape`]s: one case at a time, or four cases as the lanes of 128-bit vectors, with
//! masks for choices and `break`. [`CraneliftExecutor`] compiles each candidate, runs it over all cases and
//! forgets it; [`crate::detector::CompiledDetector`] keeps one. [`clif`] and [`asm`] show what becomes of a
//! program.
//!
//! Code never is writable and executable at once. Memory is given back with whatever owns the code. Any number
//! of workers compile and run at the same time, each with its own contexts and memory.

mod code;
mod compiler;
pub(crate) mod emit;
pub(crate) mod emit_loop;
mod entries;
mod executor;
mod frame;
mod helpers;
mod homes;
mod kept;
mod lanes;
mod listing;
pub(crate) mod owned;
mod run;
mod target;
#[cfg(test)]
mod tests;

pub use emit::Shape;
pub use executor::{CraneliftExecutor, CraneliftWorker};
pub use listing::{asm, clif};
pub(crate) use target::Effort;
