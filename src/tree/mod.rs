//! The genotype: individuals of one or two typed trees, their text form, creation and crossover.

mod individual;
mod node;

pub use individual::{Individual, MAX_DEPTH, MAX_NODES, Tree, TreeError, TreeIndex, subtree};
pub use node::{Group, Node, NodeType, Place};
