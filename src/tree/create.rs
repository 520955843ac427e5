//! Random individuals by ramped half-and-half (Koza 1992), each tree by itself.

use serde::{Deserialize, Serialize};

use super::individual::{Individual, MAX_DEPTH, MAX_NODES, Tree, TreeIndex};
use super::node::Node;
use super::nodeset::{NodeSet, NodeSetError};
use super::place::Place;
use super::random::Random;

/// How random individuals are made. The default is the published set-up.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct CreateSettings {
    /// The least of the maximum depths of trees, among which each is equally likely; a root has depth 0. At
    /// least 2.
    pub min_depth: usize,
    /// The largest of the maximum depths.
    pub max_depth: usize,
    /// How deep a column expression may grow, its own root having depth 0.
    pub column_depth: usize,
    /// The probability that a body is made by the method full, else by grow.
    pub full_probability: f64,
    /// The probability of a leaf wherever a tree is grown and may have either.
    pub grow_leaf_probability: f64,
    /// The probability that a column expression is plain `x-obstacle` instead of grown.
    pub plain_column_probability: f64,
    /// The least magnitude of random constants.
    pub constant_min: f32,
    /// The largest magnitude of random constants; logarithms of magnitudes are evenly distributed.
    pub constant_max: f32,
    /// How many trees an individual has, 1 or 2.
    pub trees: usize,
    /// The node types, with their weights.
    pub nodes: NodeSet,
}

impl Default for CreateSettings {
    fn default() -> CreateSettings {
        CreateSettings {
            min_depth: 6,
            max_depth: 9,
            column_depth: 3,
            full_probability: 0.5,
            grow_leaf_probability: 0.25,
            plain_column_probability: 0.0,
            constant_min: 0.01,
            constant_max: 1000.0,
            trees: 2,
            nodes: NodeSet::default(),
        }
    }
}

/// Why no individuals can be made with some settings.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CreateError {
    /// The range of maximum depths is empty, or out of bounds.
    #[error(
        "depths of new trees from {min} to {max}: write min_depth <= max_depth, both from 2 to {MAX_DEPTH}"
    )]
    Depths {
        /// `min_depth`.
        min: usize,
        /// `max_depth`.
        max: usize,
    },
    /// `column_depth` is out of bounds.
    #[error("column_depth = {0} is too deep; it is below {MAX_DEPTH}")]
    ColumnDepth(usize),
    /// A probability is out of its range.
    #[error("{name} = {value} is no probability; it is from 0 to 1")]
    Probability {
        /// The setting.
        name: &'static str,
        /// Its value.
        value: f64,
    },
    /// Columns are to be plain `x-obstacle`, which is not in the node set.
    #[error(
        "plain_column_probability = {0}, but the node set leaves out `x-obstacle`, which plain columns are made of; \
         write plain_column_probability = 0, or put the node back, as in `+x-obstacle`"
    )]
    PlainColumn(f64),
    /// The range of constants is empty or out of bounds.
    #[error(
        "magnitudes of constants from {min} to {max}: write 0 < constant_min <= constant_max, both finite"
    )]
    Constants {
        /// `constant_min`.
        min: f32,
        /// `constant_max`.
        max: f32,
    },
    /// The number of trees is neither 1 nor 2.
    #[error("trees = {0}: an individual has 1 tree or 2")]
    Trees(usize),
    /// The node set leaves a place empty.
    #[error(transparent)]
    Nodes(#[from] NodeSetError),
}

impl CreateSettings {
    /// Checks every setting.
    ///
    /// # Errors
    /// The first fault.
    pub fn check(&self) -> Result<(), CreateError> {
        let (min, max) = (self.min_depth, self.max_depth);
        if min < 2 || min > max || max > MAX_DEPTH {
            return Err(CreateError::Depths { min, max });
        }
        if self.column_depth >= MAX_DEPTH {
            return Err(CreateError::ColumnDepth(self.column_depth));
        }
        check_probability("full_probability", self.full_probability)?;
        check_probability("grow_leaf_probability", self.grow_leaf_probability)?;
        check_probability("plain_column_probability", self.plain_column_probability)?;
        let (min, max) = (self.constant_min, self.constant_max);
        // A NaN fails the comparison.
        if !(min > 0.0 && min <= max && max.is_finite()) {
            return Err(CreateError::Constants { min, max });
        }
        if !(1..=2).contains(&self.trees) {
            return Err(CreateError::Trees(self.trees));
        }
        self.nodes.check()?;
        if self.plain_column_probability > 0.0 && self.nodes.weight(Node::XObstacle.node_type()) == 0 {
            return Err(CreateError::PlainColumn(self.plain_column_probability));
        }
        Ok(())
    }
}

fn check_probability(name: &'static str, value: f64) -> Result<(), CreateError> {
    if (0.0..=1.0).contains(&value) { Ok(()) } else { Err(CreateError::Probability { name, value }) }
}

/// Nodes to draw from.
#[derive(Debug, Clone)]
struct Pool {
    nodes: Vec<Node>,
    /// Running sums of the weights.
    ends: Vec<u64>,
}

impl Pool {
    fn new(set: &NodeSet, place: Place, which: TreeIndex, function: bool) -> Pool {
        let (mut nodes, mut ends, mut end) = (Vec::new(), Vec::new(), 0);
        for (node, weight) in set.fitting(place, which, function) {
            end += u64::from(weight);
            nodes.push(node);
            ends.push(end);
        }
        Pool { nodes, ends }
    }

    fn draw(&self, random: &mut Random) -> Node {
        let total = *self.ends.last().expect("the settings' check finds empty pools");
        let ticket = random.below(total);
        self.nodes[self.ends.partition_point(|&end| end <= ticket)]
    }

    /// The nodes that may stand for `node`, with their weights: those with as many arguments but itself, and constants.
    fn alternatives(&self, node: Node) -> impl Iterator<Item = (Node, u64)> + '_ {
        let starts = std::iter::once(&0).chain(&self.ends);
        let weights = self.ends.iter().zip(starts).map(|(end, start)| end - start);
        self.nodes.iter().copied().zip(weights).filter(move |&(other, _)| {
            let is_constant = matches!(other, Node::Constant(_));
            other.arity() == node.arity() && (is_constant || other.node_type() != node.node_type())
        })
    }
}

/// The functions and the leaves that fit a place.
#[derive(Debug, Clone)]
struct Choice {
    functions: Pool,
    leaves: Pool,
}

impl Choice {
    fn new(set: &NodeSet, place: Place, which: TreeIndex) -> Choice {
        Choice { functions: Pool::new(set, place, which, true), leaves: Pool::new(set, place, which, false) }
    }
}

/// Makes random individuals.
///
/// ```
/// use vsonar::tree::{CreateSettings, Creator, Random};
///
/// let creator = Creator::new(&CreateSettings::default())?;
/// let individual = creator.individual(&mut Random::stream(1, 0, 0));
/// assert!(individual.first().is_some() && individual.depth() <= 9);
/// # Ok::<(), vsonar::tree::CreateError>(())
/// ```
#[derive(Debug, Clone)]
pub struct Creator {
    settings: CreateSettings,
    roots: Pool,
    rectangles: Pool,
    /// By [`TreeIndex`].
    columns: [Choice; 2],
    bodies: [Choice; 2],
}

/// How an expression is made.
struct Shape<'a> {
    choice: &'a Choice,
    /// The depth, in the tree, at which only leaves may stand.
    last: usize,
    /// The probability of a leaf above it: 0 for the method called full.
    leaf: f64,
}

impl Creator {
    /// A creator with these settings.
    ///
    /// # Errors
    /// The first fault of the settings.
    pub fn new(settings: &CreateSettings) -> Result<Creator, CreateError> {
        settings.check()?;
        let set = &settings.nodes;
        let choices =
            |place| [TreeIndex::First, TreeIndex::Second].map(|which| Choice::new(set, place, which));
        Ok(Creator {
            roots: Pool::new(set, Place::Root, TreeIndex::First, true),
            rectangles: Pool::new(set, Place::Rect, TreeIndex::First, false),
            columns: choices(Place::Column),
            bodies: choices(Place::Body),
            settings: settings.clone(),
        })
    }

    /// A random individual. An only tree is made as a first is.
    pub fn individual(&self, random: &mut Random) -> Individual {
        let first = self.tree(TreeIndex::First, random);
        let made = if self.settings.trees == 1 {
            Individual::new(None, first)
        } else {
            Individual::new(Some(first), self.tree(TreeIndex::Second, random))
        };
        made.expect("no node of a first tree reads the first tree")
    }

    /// A random tree. Drawn in this order: maximum depth, method, direction, rectangle, whether the column is
    /// plain, the column expression, the body.
    pub fn tree(&self, which: TreeIndex, random: &mut Random) -> Tree {
        let CreateSettings { min_depth, max_depth, grow_leaf_probability: leaf, .. } = self.settings;
        let depth = min_depth + random.index(max_depth - min_depth + 1);
        let full = random.chance(self.settings.full_probability);
        let mut nodes = vec![self.roots.draw(random), self.rectangles.draw(random)];
        self.column(&mut nodes, which, random);
        let choice = &self.bodies[which as usize];
        let shape = Shape { choice, last: depth, leaf: if full { 0.0 } else { leaf } };
        self.call(&mut nodes, &shape, 1, random);
        Tree::within_depth(nodes, MAX_DEPTH).expect("the settings bound the depth")
    }

    /// Appends a column expression of a new tree.
    fn column(&self, nodes: &mut Vec<Node>, which: TreeIndex, random: &mut Random) {
        if random.chance(self.settings.plain_column_probability) {
            nodes.push(Node::XObstacle);
        } else {
            self.grow(nodes, Place::Column, which, self.settings.column_depth, random);
        }
    }

    /// Appends an expression for this place, grown within `depth` of its own root.
    fn grow(&self, nodes: &mut Vec<Node>, place: Place, which: TreeIndex, depth: usize, random: &mut Random) {
        let leaf = self.settings.grow_leaf_probability;
        let shape = Shape { choice: self.choice(place, which), last: 1 + depth, leaf };
        self.expression(nodes, &shape, 1, random);
    }

    /// The nodes for a column expression or a body.
    fn choice(&self, place: Place, which: TreeIndex) -> &Choice {
        let choices = if place == Place::Column { &self.columns } else { &self.bodies };
        &choices[which as usize]
    }

    /// A new subtree for this place: a whole tree for the root, a rectangle, a column expression of a new tree if it
    /// is to be a `whole` one, else an expression grown within the depth of columns, or for a body within `depth`.
    pub(super) fn subtree(
        &self,
        (place, whole): (Place, bool),
        which: TreeIndex,
        depth: usize,
        random: &mut Random,
    ) -> Vec<Node> {
        let mut nodes = Vec::new();
        match place {
            Place::Root => return self.tree(which, random).nodes().to_vec(),
            Place::Rect => nodes.push(self.rectangles.draw(random)),
            Place::Column if whole => self.column(&mut nodes, which, random),
            Place::Column => self.grow(&mut nodes, place, which, self.settings.column_depth, random),
            Place::Body => self.grow(&mut nodes, place, which, depth, random),
        }
        nodes
    }

    /// Where the nodes that may stand for `node` in this place are drawn from.
    fn pool(&self, node: Node, place: Place, which: TreeIndex) -> &Pool {
        match place {
            Place::Root => &self.roots,
            Place::Rect => &self.rectangles,
            _ if node.is_function() => &self.choice(place, which).functions,
            _ => &self.choice(place, which).leaves,
        }
    }

    /// Whether [`Creator::replacement`] finds another node for this one.
    pub(super) fn is_replaceable(&self, node: Node, place: Place, which: TreeIndex) -> bool {
        self.pool(node, place, which).alternatives(node).next().is_some()
    }

    /// Another node with as many arguments for this place, drawn by the weights; a constant may give way to another
    /// constant. `None` if there is none.
    pub(super) fn replacement(
        &self,
        node: Node,
        place: Place,
        which: TreeIndex,
        random: &mut Random,
    ) -> Option<Node> {
        let pool = self.pool(node, place, which);
        let total: u64 = pool.alternatives(node).map(|(_, weight)| weight).sum();
        let mut ticket = random.below(total.max(1));
        for (other, weight) in pool.alternatives(node) {
            if ticket < weight {
                return Some(if let Node::Constant(_) = other { self.constant(random) } else { other });
            }
            ticket -= weight;
        }
        None
    }

    /// A constant times `factor`, its magnitude kept within that of random constants.
    pub(super) fn scaled(&self, constant: f32, factor: f64) -> f32 {
        let CreateSettings { constant_min: min, constant_max: max, .. } = self.settings;
        let magnitude = (f64::from(constant).abs() * factor) as f32;
        magnitude.clamp(min, max).copysign(constant)
    }

    /// Appends an expression whose root is at `depth`.
    fn expression(&self, nodes: &mut Vec<Node>, shape: &Shape<'_>, depth: usize, random: &mut Random) {
        // What is still to come is at most a few leaves for each level, so the limit is never reached.
        let only_leaf = depth >= shape.last || nodes.len() >= MAX_NODES / 2;
        if only_leaf || random.chance(shape.leaf) {
            let leaf = shape.choice.leaves.draw(random);
            nodes.push(if let Node::Constant(_) = leaf { self.constant(random) } else { leaf });
        } else {
            self.call(nodes, shape, depth, random);
        }
    }

    /// Appends an expression whose root, a function, is at `depth`.
    fn call(&self, nodes: &mut Vec<Node>, shape: &Shape<'_>, depth: usize, random: &mut Random) {
        let function = shape.choice.functions.draw(random);
        nodes.push(function);
        for _ in 0..function.arity() {
            self.expression(nodes, shape, depth + 1, random);
        }
    }

    /// A constant whose magnitude's logarithm is evenly distributed, of either sign.
    fn constant(&self, random: &mut Random) -> Node {
        let CreateSettings { constant_min: min, constant_max: max, .. } = self.settings;
        let (low, high) = (libm::log(f64::from(min)), libm::log(f64::from(max)));
        let magnitude = libm::exp(low + random.unit() * (high - low)) as f32;
        // The exponential of a logarithm may miss by a rounding.
        let magnitude = magnitude.clamp(min, max);
        Node::Constant(if random.chance(0.5) { magnitude } else { -magnitude })
    }
}
