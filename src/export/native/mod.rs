//! Native code of a whole detector, from raw pixels to rows, for this machine or another, through Cranelift.
//!
//! ```text
//! Program ──> plan: tiles, sums ──> fill: pixels to window averages ──┐
//!        └──> rows: checks, groups of lanes ──> emit_loop (shared with the executor) over source: the tiles
//!                                        └──> module: an object file, or code of this process
//! ```
//!
//! Both loops' bodies come from the emitter of [`crate::exec::cranelift`], the image operators and trigonometry from
//! the formulas of [`vsonar_ir`]. Nothing outside is called: that is checked on every relocation.

mod copy;
mod fill;
mod jit;
mod module;
mod object;
mod pixels;
mod plan;
mod rows;
mod sensor;
mod source;
mod target;
#[cfg(test)]
mod tests;

use crate::exec::{MAX_COMPILED, MAX_STACK};
pub(crate) use jit::JitRows;
pub use object::Object;
pub use target::{KNOWN, Target, TargetError};

/// Why there is no native code.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum NativeError {
    /// The target is none.
    #[error(transparent)]
    Target(#[from] TargetError),
    /// The code generator refuses the program.
    #[error("the code generator refuses the program: {0}")]
    Compile(String),
    /// The system refuses memory for code.
    #[error("no executable memory: {0}")]
    Memory(String),
    /// The program has more than [`MAX_COMPILED`] instructions.
    #[error("the program has {instructions} instructions, and native code is made of at most {MAX_COMPILED}")]
    TooLong {
        /// How many it has.
        instructions: usize,
    },
    /// The code would take more stack than a thread may have.
    #[error("its code takes {bytes} bytes of stack; {MAX_STACK} is the limit in this process")]
    Stack {
        /// How many it takes.
        bytes: usize,
    },
    /// An instruction is missing on the target, and the code generator would call a library for it.
    #[error("{function} would call {callee}, which detectors must not")]
    Call {
        /// The function that would.
        function: String,
        /// What it would call.
        callee: String,
    },
}
