//! The genotype: individuals of one or two typed trees, their text form, creation and crossover.

mod error;
mod individual;
mod node;
mod parse;
mod print;
mod text;

pub use error::{ParseError, ParseErrorKind, Position, ProgramFileError};
pub use individual::{Individual, MAX_DEPTH, MAX_NODES, Tree, TreeError, TreeIndex, subtree};
pub use node::{Group, Node, NodeType, Place};
pub use print::Shortest;
