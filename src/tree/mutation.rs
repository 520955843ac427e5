//! Mutation: an individual changed by itself.
//!
//! Whatever is changed, an expression stays in its place (rectangle, column, body, root), and new nodes are those of the
//! settings, so that a mutant is an individual that creation and crossover could have made.

use super::create::{CreateError, CreateSettings, Creator};
use super::crossover::{Offspring, offspring, point, tree};
use super::individual::{Individual, MAX_DEPTH, Tree, TreeIndex};
use super::node::Node;
use super::place::Place;
use super::random::Random;

/// The kinds of mutation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Mutation {
    /// A subtree gives way to a random one of the same place (Koza 1992): a whole tree, a rectangle, or an expression
    /// that is grown, a whole column as that of a new tree.
    Subtree,
    /// A node gives way to another with as many arguments, which stay (McKay, Willis and Barton 1995); a constant may
    /// give way to another one.
    Point,
    /// A constant of the individual, each equally likely, is multiplied by a log-normal factor (Schwefel 1995); the
    /// magnitude stays within that of random constants.
    Constant,
    /// A function of a column expression or a body, with all below it, gives way to a part of itself, so that the
    /// individual shrinks (after Kinnear 1993).
    Hoist,
}

impl Mutation {
    /// All kinds.
    pub const ALL: [Mutation; 4] = [Mutation::Subtree, Mutation::Point, Mutation::Constant, Mutation::Hoist];
}

/// How individuals mutate.
#[derive(Debug, Clone, PartialEq)]
pub struct MutationSettings {
    /// The probability that subtree and point mutation choose a function, the tree's root included, and not a leaf.
    pub internal_probability: f64,
    /// The deepest that a mutant may be; a root has depth 0.
    pub max_depth: usize,
    /// The depth that subtree mutation grows a part of a body within, counted from its own root; for a part of a column
    /// expression it is the depth of columns.
    pub subtree_depth: usize,
    /// Standard deviation of the natural logarithm of the factor of constant mutation.
    pub constant_step: f64,
}

impl Default for MutationSettings {
    fn default() -> MutationSettings {
        MutationSettings { internal_probability: 0.9, max_depth: 17, subtree_depth: 4, constant_step: 0.5 }
    }
}

/// Why individuals cannot mutate with some settings.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum MutationError {
    /// `internal_probability` is out of its range.
    #[error("internal_probability = {0} is no probability; it is from 0 to 1")]
    Probability(f64),
    /// `max_depth` is out of its range.
    #[error("max_depth = {0} of mutants: it is from 2 to {MAX_DEPTH}")]
    Depth(usize),
    /// `subtree_depth` is out of its range.
    #[error("subtree_depth = {0} is too deep; it is below {MAX_DEPTH}")]
    SubtreeDepth(usize),
    /// `constant_step` is out of its range.
    #[error("constant_step = {0} is no standard deviation; it is above 0 and finite")]
    Step(f64),
    /// Random individuals cannot be made.
    #[error(transparent)]
    Create(#[from] CreateError),
}

impl MutationSettings {
    /// Checks every setting.
    ///
    /// # Errors
    /// The first fault.
    pub fn check(&self) -> Result<(), MutationError> {
        if !(0.0..=1.0).contains(&self.internal_probability) {
            return Err(MutationError::Probability(self.internal_probability));
        }
        if !(2..=MAX_DEPTH).contains(&self.max_depth) {
            return Err(MutationError::Depth(self.max_depth));
        }
        if self.subtree_depth >= MAX_DEPTH {
            return Err(MutationError::SubtreeDepth(self.subtree_depth));
        }
        if !(self.constant_step > 0.0 && self.constant_step.is_finite()) {
            return Err(MutationError::Step(self.constant_step));
        }
        Ok(())
    }
}

/// Makes mutants.
///
/// ```
/// use vsonar::tree::{CreateSettings, Individual, Mutation, MutationSettings, Mutator, Random};
///
/// let mutator = Mutator::new(&CreateSettings::default(), &MutationSettings::default())?;
/// let parent: Individual = "(individual (iterate-up 3x3 x-obstacle (set-a (+ y 4))))".parse()?;
/// let mutant = mutator.mutate(&parent, Mutation::Hoist, &mut Random::stream(1, 1, 0));
/// assert!(mutant.individual.len() < parent.len());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct Mutator {
    creator: Creator,
    settings: MutationSettings,
}

impl Mutator {
    /// A mutator with these settings, whose new nodes are drawn as `create` says.
    ///
    /// # Errors
    /// The first fault of the settings.
    pub fn new(create: &CreateSettings, settings: &MutationSettings) -> Result<Mutator, MutationError> {
        settings.check()?;
        Ok(Mutator { creator: Creator::new(create)?, settings: settings.clone() })
    }

    /// A mutant of an individual. All kinds but [`Mutation::Constant`] change one of two trees, each with probability
    /// 1/2. A mutant that is too deep is replaced by its parent, and so is one in which there was nothing to change:
    /// no constant, no function to hoist from, no node that another could stand for.
    pub fn mutate(&self, parent: &Individual, kind: Mutation, random: &mut Random) -> Offspring {
        if kind == Mutation::Constant {
            return self.scale_constant(parent, random);
        }
        let in_first = parent.first().is_some() && random.chance(0.5);
        let made = match kind {
            Mutation::Subtree => Some(self.new_subtree(parent, in_first, random)),
            Mutation::Point => self.new_node(parent, in_first, random),
            Mutation::Hoist => self.hoist(parent, in_first, random),
            Mutation::Constant => None,
        };
        made.unwrap_or_else(|| Offspring::parent(parent))
    }

    fn new_subtree(&self, parent: &Individual, in_first: bool, random: &mut Random) -> Offspring {
        let old = tree(parent, in_first);
        let at = point(old.nodes(), self.settings.internal_probability, random);
        let place = old.place(at);
        let whole = at == old.range(place).start;
        let which = index(parent, in_first);
        let new = self.creator.subtree((place, whole), which, self.settings.subtree_depth, random);
        offspring(parent, in_first, old.subtree(at), &new, self.settings.max_depth)
    }

    fn new_node(&self, parent: &Individual, in_first: bool, random: &mut Random) -> Option<Offspring> {
        let (old, which) = (tree(parent, in_first), index(parent, in_first));
        let replaceable = |&at: &usize| self.creator.is_replaceable(old.nodes()[at], old.place(at), which);
        let candidates: Vec<usize> = (0..old.len()).filter(replaceable).collect();
        let nodes: Vec<Node> = candidates.iter().map(|&at| old.nodes()[at]).collect();
        let at = match nodes.iter().all(|node| node.is_function()) {
            // `point` leaves the choice among leaves, of which there are none.
            true if nodes.is_empty() => return None,
            true => candidates[random.index(candidates.len())],
            false => candidates[point(&nodes, self.settings.internal_probability, random)],
        };
        let new = self.creator.replacement(old.nodes()[at], old.place(at), which, random)?;
        Some(offspring(parent, in_first, at..at + 1, &[new], self.settings.max_depth))
    }

    fn hoist(&self, parent: &Individual, in_first: bool, random: &mut Random) -> Option<Offspring> {
        let old = tree(parent, in_first);
        let inside = old.range(Place::Column).start..old.len();
        let at = choose(inside.filter(|&at| old.nodes()[at].is_function()), random)?;
        let hole = old.subtree(at);
        let part = old.subtree(choose(at + 1..hole.end, random)?);
        Some(offspring(parent, in_first, hole, &old.nodes()[part], self.settings.max_depth))
    }

    fn scale_constant(&self, parent: &Individual, random: &mut Random) -> Offspring {
        let constants = |tree: &Tree| {
            let is_constant = |&at: &usize| matches!(tree.nodes()[at], Node::Constant(_));
            (0..tree.len()).filter(is_constant).collect::<Vec<usize>>()
        };
        let first: Vec<usize> = parent.first().map(constants).unwrap_or_default();
        let second = constants(parent.second());
        let Some(chosen) = choose(0..first.len() + second.len(), random) else {
            return Offspring::parent(parent);
        };
        let in_first = chosen < first.len();
        let at = if in_first { first[chosen] } else { second[chosen - first.len()] };
        let Node::Constant(constant) = tree(parent, in_first).nodes()[at] else {
            return Offspring::parent(parent);
        };
        let factor = libm::exp(self.settings.constant_step * normal(random));
        let new = Node::Constant(self.creator.scaled(constant, factor));
        offspring(parent, in_first, at..at + 1, &[new], self.settings.max_depth)
    }
}

/// What a tree of an individual is made to be.
fn index(of: &Individual, in_first: bool) -> TreeIndex {
    if in_first || of.first().is_none() { TreeIndex::First } else { TreeIndex::Second }
}

/// One of several, each equally likely.
fn choose(among: impl Iterator<Item = usize> + Clone, random: &mut Random) -> Option<usize> {
    let count = among.clone().count();
    if count == 0 {
        return None;
    }
    let mut among = among;
    among.nth(random.index(count))
}

/// A number from the standard normal distribution, with the platform's mathematics left out (Box and Muller 1958).
fn normal(random: &mut Random) -> f64 {
    // 1 - [0, 1) is never 0, so that the logarithm is finite.
    let radius = libm::sqrt(-2.0 * libm::log(1.0 - random.unit()));
    radius * libm::cos(2.0 * std::f64::consts::PI * random.unit())
}
