//! The language of visual obstacle detectors.
//!
//! A detector is a [`Program`]: two [`Loop`]s over the rows of one image column each. A loop slides a
//! rectangle along its column, one pixel at a time, and runs a straight-line body at every position; five
//! registers are carried from one position to the next, and a *break mask* says when the loop has had enough.
//! The first loop's final registers can be read by the second (`iter2 a` … `iter2 e`); the answer is the final
//! register `a` of the second. There is no other control flow: choices are [`Op::Select`]s under masks, so the
//! same body serves one fitness case, four as vector lanes, or a hundred in an interpreter.
//!
//! This crate knows nothing of image files, genetic programming, Cranelift or the command line. It holds
//!
//! * [`op`]: the one table of operations, with their types, printed names and exact meaning;
//! * [`program`]: programs, loops, blocks, instructions and registers;
//! * [`builder`]: the only way to make a block of instructions; it checks types as it goes;
//! * [`verify`]: well-formedness of whole programs, with precise messages;
//! * [`text`]: the `.vir` form, an exact round trip;
//! * [`reference`](mod@reference): the slow, obvious evaluator, the oracle of the language;
//! * [`generate`]: random well-formed programs for tests;
//! * [`machine`] and [`formula`]: every formula written once, over whatever computes it;
//! * [`opt`]: the passes of the optimiser.
//!
//! # Values
//!
//! Every register has one [`Ty`]: `f32` (IEEE 754 binary32), `i32`, or `mask` (a truth value). Operations round
//! to nearest, ties to even; subnormals are kept; nothing is contracted or reassociated. All NaNs are one
//! value: no operation lets a program tell them apart. Nothing traps.
//!
//! # One program, end to end
//!
//! ```
//! use vsonar_ir::{reference, text, opt};
//!
//! let source = "\
//! vir 1
//! image 64x48
//! loop 2 down 3x3
//! column
//!   v0 = x-obstacle
//!   result v0
//! body
//!   varying
//!     v0 = y
//!     v1 = window gradient
//!     v2 = const 239
//!     v3 = lt v2 v1
//!     v4 = read a
//!     v5 = select v3 v0 v4
//!   next a v5
//!   break v3
//! ";
//! let program = text::parse(source)?;
//! let optimised = opt::optimise(&program);
//! // Run it on an image whose gradient average is 300 everywhere: it stops at the first row.
//! let answer = reference::answer(&optimised, &|_window: vsonar_ir::WindowAt| 300.0f32, 20.0);
//! assert_eq!(answer, 1.0);
//! # Ok::<(), text::ParseError>(())
//! ```

pub mod builder;
pub mod formula;
pub mod generate;
pub mod machine;
pub mod op;
pub mod opt;
pub mod program;
pub mod reference;
pub mod text;
pub mod verify;
pub mod window;

pub use builder::Builder;
pub use op::{Leaf, Op, Ty};
pub use program::{Block, Direction, Inst, Loop, Program, Reg, Region, Span};
pub use window::{Moment, Operand, Operator, Rect, WindowAt, Windows};

/// The README, whose example is run with the tests.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
