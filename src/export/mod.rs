//! Export: a program becomes a detector that a robot's own program links or loads.
//!
//! ```text
//! Program ──┬─> native: Cranelift ──> object ──> static library, shared library        header, Python binding
//! Camera  ──┤                    └──> in process: detector::CompiledDetector
//!           └─> c: one C99 file
//! ```
//!
//! All forms take the raw pixels of a frame, compute the image operators only where the program's windows fall, and
//! give the same bits as every executor. Beside the rows they give ranges, where a [`Camera`] is known.

pub mod archive;
pub mod c;
pub mod header;
pub mod native;
mod provenance;
pub mod python;
mod reserved;
pub mod shared;
mod symbol;

pub use provenance::{OtherSize, Provenance};
pub use symbol::{Symbol, SymbolError};

use vsonar_ir::Program;

use crate::camera::Camera;

/// The version of the C interface: it grows when something in it changes its meaning.
pub const ABI: i32 = 1;

/// What [`Request::median`] may be, beside 1 for none: the rows of so many frames are kept.
pub const MEDIAN: u32 = 3;

/// What is exported: everything that the files are made of.
#[derive(Debug, Clone)]
pub struct Request {
    /// The name that all exported symbols begin with.
    pub symbol: Symbol,
    /// The optimised program.
    pub program: Program,
    /// Where it comes from.
    pub provenance: Provenance,
    /// The camera, without which there are rows but no ranges.
    pub camera: Option<Camera>,
    /// Whether ranges come from the median of the rows of three frames.
    pub median: bool,
}

/// What exported functions give for a null pointer.
pub const ERROR_NULL: i32 = -1;
/// What exported functions give for strides that cannot be.
pub const ERROR_STRIDE: i32 = -2;
/// What exported functions give for a column outside the image.
pub const ERROR_COLUMN: i32 = -3;
