//! What an evolved program does, for people: the paper's Figure 3, made and checked by machine.
//!
//! From the optimised program comes a [`Listing`], a text of `if`s, formulas and names. It is a small language of its
//! own, with its own parser and evaluator, and every explanation runs the printed text against the compiled detector:
//! a text that gives other answers is an error, never shown.

mod build;
mod evaluate;
pub mod listing;
mod parse;
mod print;
mod structure;

pub use build::NotReadable;
pub use evaluate::{Observer, Outcome, Position};
pub use listing::Listing;
pub use parse::ListingError;
pub use print::Line;
