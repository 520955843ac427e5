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
    #[error("the code generator refuses the program: {0}; `--emit c` exports it as C source")]
    Compile(String),
    /// The system refuses memory for code.
    #[error("no executable memory: {0}")]
    Memory(String),
    /// An instruction is missing on the target, and the code generator would call a library for it.
    #[error("{function} would call {callee}; `--emit c` exports the program as C source, which calls nothing")]
    Call {
        /// The function that would.
        function: String,
        /// What it would call.
        callee: String,
    },
}
