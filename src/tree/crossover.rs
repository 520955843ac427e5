//! Subtree crossover: two individuals exchange subtrees of the same kind.

use std::ops::Range;

use serde::{Deserialize, Serialize};

use super::individual::{Individual, MAX_DEPTH, MAX_NODES, Tree};
use super::node::Node;
use super::random::Random;

/// How individuals exchange subtrees. The default is the published set-up.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct CrossoverSettings {
    /// The probability that the point of exchange is a function, the tree's root included, and not a leaf.
    pub internal_probability: f64,
    /// The deepest that an offspring may be; a root has depth 0.
    pub max_depth: usize,
}

impl Default for CrossoverSettings {
    fn default() -> CrossoverSettings {
        CrossoverSettings { internal_probability: 0.9, max_depth: 17 }
    }
}

/// Why the settings of crossover cannot be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CrossoverError {
    /// `internal_probability` is out of its range.
    #[error("internal_probability = {0} is no probability; it is from 0 to 1")]
    Probability(f64),
    /// `max_depth` is out of its range.
    #[error("max_depth = {0} of offspring: it is from 2 to {MAX_DEPTH}")]
    Depth(usize),
}

impl CrossoverSettings {
    /// Checks every setting.
    ///
    /// # Errors
    /// The first fault.
    pub fn check(&self) -> Result<(), CrossoverError> {
        if !(0.0..=1.0).contains(&self.internal_probability) {
            return Err(CrossoverError::Probability(self.internal_probability));
        }
        if !(2..=MAX_DEPTH).contains(&self.max_depth) {
            return Err(CrossoverError::Depth(self.max_depth));
        }
        Ok(())
    }
}

/// What one parent becomes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Offspring {
    /// The individual, or a copy of the parent that it comes from.
    pub individual: Individual,
    /// Whether crossover or mutation would have made the individual too deep, or had nothing to change, so that it is
    /// the parent again.
    pub replaced: bool,
}

impl Offspring {
    pub(super) fn parent(parent: &Individual) -> Offspring {
        Offspring { individual: parent.clone(), replaced: true }
    }
}

/// Exchanges a subtree of one individual with one of another, in their first trees or in their second, each with
/// probability 1/2 (in the second if one of them has no other). The first point is a function with the given
/// probability, else a leaf; the second is chosen by the same rule among the nodes in the same place (rectangle,
/// column expression, body, root), a leaf if there is no function.
///
/// An offspring that is too deep is replaced by the parent it comes from: the one that gives all but the subtree.
/// So is one with more nodes than [`MAX_NODES`], and one that would read a first tree that it does not have.
///
/// ```
/// use vsonar::tree::{CrossoverSettings, Individual, Random, subtree_crossover};
///
/// let a: Individual = "(individual (iterate-up 3x3 x-obstacle (set-a y)))".parse()?;
/// let b: Individual = "(individual (iterate-down 2x8 4 (+ read-a 1)))".parse()?;
/// let settings = CrossoverSettings::default();
/// let [c, d] = subtree_crossover(&a, &b, &settings, &mut Random::stream(1, 1, 0));
/// assert_eq!(c.individual.len() + d.individual.len(), a.len() + b.len());
/// # Ok::<(), vsonar::tree::ParseError>(())
/// ```
pub fn subtree_crossover(
    a: &Individual,
    b: &Individual,
    settings: &CrossoverSettings,
    random: &mut Random,
) -> [Offspring; 2] {
    let both_have_first = a.first().is_some() && b.first().is_some();
    let in_first = both_have_first && random.chance(0.5);
    let (tree_a, tree_b) = (tree(a, in_first), tree(b, in_first));
    let point_a = point(tree_a.nodes(), settings.internal_probability, random);
    let among = tree_b.range(tree_a.place(point_a));
    let point_b = among.start + point(&tree_b.nodes()[among], settings.internal_probability, random);
    let (at_a, at_b) = (tree_a.subtree(point_a), tree_b.subtree(point_b));
    let (part_a, part_b) = (&tree_a.nodes()[at_a.clone()], &tree_b.nodes()[at_b.clone()]);
    [
        offspring(a, in_first, at_a, part_b, settings.max_depth),
        offspring(b, in_first, at_b, part_a, settings.max_depth),
    ]
}

pub(super) fn tree(of: &Individual, first: bool) -> &Tree {
    of.first().filter(|_| first).unwrap_or(of.second())
}

/// A node of a tree, or of a part of one: a function with the given probability if there is one, else a leaf.
pub(super) fn point(nodes: &[Node], internal_probability: f64, random: &mut Random) -> usize {
    // Where there is no choice, nothing is drawn. A root by itself is a function without a leaf.
    if nodes.len() == 1 {
        return 0;
    }
    let functions = nodes.iter().filter(|node| node.is_function()).count();
    let function = functions > 0 && random.chance(internal_probability);
    let candidates = if function { functions } else { nodes.len() - functions };
    let chosen = random.index(candidates);
    let mut of_kind = (0..nodes.len()).filter(|&i| nodes[i].is_function() == function);
    of_kind.nth(chosen).expect("fewer are skipped than there are")
}

/// `parent` with a part of one of its trees replaced by other nodes, or the parent again if that cannot be.
pub(super) fn offspring(
    parent: &Individual,
    in_first: bool,
    hole: Range<usize>,
    part: &[Node],
    max_depth: usize,
) -> Offspring {
    let into = tree(parent, in_first);
    if into.len() - hole.len() + part.len() > MAX_NODES {
        return Offspring::parent(parent);
    }
    let (before, after) = (&into.nodes()[..hole.start], &into.nodes()[hole.end..]);
    let nodes = [before, part, after].concat();
    match Tree::within_depth(nodes, max_depth).map(|tree| parent.with_tree(in_first, tree)) {
        Some(Ok(individual)) if individual.depth() <= max_depth => Offspring { individual, replaced: false },
        _ => Offspring::parent(parent),
    }
}
