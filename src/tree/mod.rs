//! The genotype: individuals of one or two typed trees, their text form, creation, crossover and mutation.
//!
//! An [`Individual`] comes from a `.gp` file ([`Individual::load`]), from [`Creator`] at random, or from
//! [`subtree_crossover`] of two others or from another by a [`Mutator`]. It goes to `lower` to become a program of the register IR, or to
//! the tree walker of [`exec`](crate::exec), which runs it as it is. What nodes there are, and where each may
//! stand, is one table, the rows of which are the variants of [`Node`].
//!
//! ```
//! use vsonar::tree::{CreateSettings, Creator, CrossoverSettings, Individual, Random, subtree_crossover};
//!
//! let creator = Creator::new(&CreateSettings::default())?;
//! let parents = [0, 1].map(|slot| creator.individual(&mut Random::stream(7, 0, slot)));
//! let mut random = Random::stream(7, 1, 0);
//! let children = subtree_crossover(&parents[0], &parents[1], &CrossoverSettings::default(), &mut random);
//! let text = children[0].individual.to_string();
//! assert_eq!(text.parse::<Individual>()?, children[0].individual);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod create;
mod crossover;
mod error;
mod individual;
mod mutation;
mod node;
mod nodeset;
mod parse;
mod payload;
mod place;
mod print;
mod random;
mod text;

pub use create::{CreateError, CreateSettings, Creator};
pub use crossover::{CrossoverError, CrossoverSettings, Offspring, subtree_crossover};
pub use error::{ParseError, ParseErrorKind, Position, ProgramFileError};
pub use individual::{Individual, MAX_DEPTH, MAX_NODES, Tree, TreeError, TreeIndex, subtree};
pub use mutation::{Mutation, MutationError, MutationSettings, Mutator};
pub use node::{Node, NodeType};
pub use nodeset::{MAX_WEIGHT, NodeSet, NodeSetError};
pub use place::{Group, Place};
pub use print::Shortest;
pub use random::Random;
