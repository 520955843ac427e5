//! Trees and the individuals made of them.
//!
//! A tree is its nodes in preorder, in one vector; every subtree is a slice of it. Trees and individuals are
//! made only through checks, so that whoever holds one may rely on its shape.

use std::hash::{BuildHasher, Hash, Hasher};
use std::ops::Range;
use std::sync::Arc;

use rustc_hash::FxBuildHasher;
use vsonar_ir::{Direction, Rect};

use super::node::Node;
use super::place::Place;

/// The deepest a tree may be; its root has depth 0. Whoever walks trees may recurse.
pub const MAX_DEPTH: usize = 1_000;

/// The most nodes a tree may have, far above what evolution within depth 17 produces.
pub const MAX_NODES: usize = 100_000;

/// Which of an individual's trees a tree is made to be.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum TreeIndex {
    /// The tree that runs first, or the only one: without `iter2-*`.
    First,
    /// The tree that runs second, whose register `a` is the answer.
    Second,
}

/// Why nodes are not a tree, or trees not an individual.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum TreeError {
    /// The nodes end inside a tree.
    #[error("the tree lacks arguments: its {len} nodes in preorder end too early")]
    Truncated {
        /// How many nodes there are.
        len: usize,
    },
    /// There are nodes after the tree's last.
    #[error("the tree ends at node {end}, and nodes follow")]
    Trailing {
        /// How many nodes the tree has.
        end: usize,
    },
    /// The root is not an iterate node.
    #[error("a tree begins with iterate-up or iterate-down, not with {0:?}")]
    Root(Node),
    /// An iterate node below the root.
    #[error(
        "{node:?}, node {index} in preorder, is below the root; an iterate node is the root and nowhere else"
    )]
    IterateBelowRoot {
        /// The iterate node.
        node: Node,
        /// Where it is.
        index: usize,
    },
    /// A node that may not stand where it does.
    #[error("{node:?}, node {index} in preorder, cannot stand in a {place}")]
    Misplaced {
        /// The node.
        node: Node,
        /// The place.
        place: Place,
        /// Where it is.
        index: usize,
    },
    /// An `iter2-*` node outside a second tree.
    #[error("iter2-* reads the first tree's registers; only a second tree can hold it")]
    Iter2,
    /// A constant that is not finite, or a register that does not exist.
    #[error(
        "{node:?}, node {index} in preorder, is not of the language: constants are finite, registers 0 to 4"
    )]
    Unsound {
        /// The node.
        node: Node,
        /// Where it is.
        index: usize,
    },
    /// The tree is deeper than [`MAX_DEPTH`].
    #[error("the tree is deeper than {MAX_DEPTH}")]
    TooDeep,
    /// The tree has more than [`MAX_NODES`] nodes.
    #[error("the tree has {0} nodes; {MAX_NODES} is the limit")]
    TooLarge(usize),
}

/// One tree: an iterate node, its rectangle, its column expression and its body.
///
/// Equality and hashing are by the bits of constants.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Tree {
    /// Of the nodes; hashing a tree hashes this. Of two trees that differ, it is as a rule all that is compared.
    hash: u64,
    /// Preorder: the iterate node, the rectangle, the column expression, the body.
    nodes: Vec<Node>,
    /// Where the body begins.
    body: u32,
    depth: u32,
}

impl Tree {
    /// The tree of these nodes in preorder.
    ///
    /// ```
    /// use vsonar::ir::{Direction, Rect};
    /// use vsonar::tree::{Node, Tree, TreeIndex};
    ///
    /// // (iterate-down 3x3 x-obstacle (set-a y))
    /// let rect = Node::Rect(Rect::new(3, 3).unwrap());
    /// let nodes = vec![Node::Iterate(Direction::Down), rect, Node::XObstacle, Node::Set(0), Node::Y];
    /// let tree = Tree::from_nodes(nodes, TreeIndex::First)?;
    /// assert_eq!((tree.len(), tree.depth()), (5, 2));
    /// assert_eq!(tree.body(), &[Node::Set(0), Node::Y]);
    /// # Ok::<(), vsonar::tree::TreeError>(())
    /// ```
    ///
    /// # Errors
    /// If the nodes are not exactly one tree, a node stands where it may not, or the tree is too deep or too
    /// large.
    pub fn from_nodes(nodes: Vec<Node>, which: TreeIndex) -> Result<Tree, TreeError> {
        if nodes.len() > MAX_NODES {
            return Err(TreeError::TooLarge(nodes.len()));
        }
        let depth = depth(&nodes)?;
        let tree = Tree::with_depth(nodes, depth);
        for (index, &node) in tree.nodes.iter().enumerate() {
            let place = tree.place(index);
            if !node.is_sound() {
                return Err(TreeError::Unsound { node, index });
            }
            if !node.fits(place) {
                return Err(match (node, place) {
                    (_, Place::Root) => TreeError::Root(node),
                    (Node::Iterate(_), _) => TreeError::IterateBelowRoot { node, index },
                    _ => TreeError::Misplaced { node, place, index },
                });
            }
            if matches!(node, Node::Iter2(_)) && which == TreeIndex::First {
                return Err(TreeError::Iter2);
            }
        }
        Ok(tree)
    }

    /// The tree of nodes that are known to be one, if it is not deeper than `max_depth` and [`MAX_DEPTH`].
    pub(super) fn within_depth(nodes: Vec<Node>, max_depth: usize) -> Option<Tree> {
        let depth = depth(&nodes).ok().filter(|&depth| depth <= max_depth)?;
        let tree = Tree::with_depth(nodes, depth);
        debug_assert_eq!(Tree::from_nodes(tree.nodes.clone(), TreeIndex::Second).as_ref(), Ok(&tree));
        Some(tree)
    }

    fn with_depth(nodes: Vec<Node>, depth: usize) -> Tree {
        // Of fewer than three nodes none is a tree with an iterate root; the checks say so.
        let body = if nodes.len() > 2 { subtree(&nodes, 2).end } else { nodes.len() };
        Tree { hash: FxBuildHasher.hash_one(&nodes), nodes, body: body as u32, depth: depth as u32 }
    }

    /// All nodes, in preorder.
    #[inline]
    pub fn nodes(&self) -> &[Node] {
        &self.nodes
    }

    /// How many nodes there are.
    #[allow(clippy::len_without_is_empty, reason = "no tree is empty")]
    pub fn len(&self) -> usize {
        self.nodes.len()
    }

    /// Depth of the deepest node; the root's is 0.
    pub fn depth(&self) -> usize {
        self.depth as usize
    }

    /// Which way the iteration goes.
    pub fn direction(&self) -> Direction {
        let Node::Iterate(direction) = self.nodes[0] else { unreachable!("checked when the tree was made") };
        direction
    }

    /// The rectangle that is moved over the image.
    pub fn rect(&self) -> Rect {
        let Node::Rect(rect) = self.nodes[1] else { unreachable!("checked when the tree was made") };
        rect
    }

    /// The column expression, in preorder.
    pub fn column(&self) -> &[Node] {
        &self.nodes[2..self.body as usize]
    }

    /// The body, in preorder.
    pub fn body(&self) -> &[Node] {
        &self.nodes[self.body as usize..]
    }

    /// The nodes, as positions in preorder, of a place.
    pub fn range(&self, place: Place) -> Range<usize> {
        let body = self.body as usize;
        match place {
            Place::Root => 0..1,
            Place::Rect => 1..2,
            Place::Column => 2..body,
            Place::Body => body..self.nodes.len(),
        }
    }

    /// The place of the node at this position in preorder.
    pub fn place(&self, index: usize) -> Place {
        match index {
            0 => Place::Root,
            1 => Place::Rect,
            _ if index < self.body as usize => Place::Column,
            _ => Place::Body,
        }
    }

    /// The positions in preorder of the subtree whose root is at `index`.
    ///
    /// # Panics
    /// If there is no such node.
    pub fn subtree(&self, index: usize) -> Range<usize> {
        subtree(&self.nodes, index)
    }

    /// Whether the tree reads the first tree's registers.
    pub fn reads_first(&self) -> bool {
        self.nodes.iter().any(|node| matches!(node, Node::Iter2(_)))
    }
}

impl Hash for Tree {
    fn hash<H: Hasher>(&self, state: &mut H) {
        state.write_u64(self.hash);
    }
}

/// The subtree at `index` of nodes in preorder, which may be part of a tree.
pub fn subtree(nodes: &[Node], index: usize) -> Range<usize> {
    let mut pending = 1;
    let mut end = index;
    while pending > 0 && end < nodes.len() {
        pending += nodes[end].arity();
        pending -= 1;
        end += 1;
    }
    index..end
}

/// The depth of nodes that are one tree in preorder.
fn depth(nodes: &[Node]) -> Result<usize, TreeError> {
    // For every open function, how many of its arguments are still to come.
    let mut pending = [0u8; MAX_DEPTH];
    let mut open = 0;
    let mut deepest = 0;
    let mut nodes_left = nodes.iter();
    while let Some(node) = nodes_left.next() {
        deepest = deepest.max(open);
        if node.is_function() {
            // An argument will be one deeper.
            *pending.get_mut(open).ok_or(TreeError::TooDeep)? = node.arity() as u8;
            open += 1;
            continue;
        }
        while open > 0 {
            pending[open - 1] -= 1;
            if pending[open - 1] > 0 {
                break;
            }
            open -= 1;
        }
        if open == 0 {
            return match nodes_left.len() {
                0 => Ok(deepest),
                left => Err(TreeError::Trailing { end: nodes.len() - left }),
            };
        }
    }
    Err(TreeError::Truncated { len: nodes.len() })
}

/// A candidate detector: two trees, or the second alone. The answer is the final register `a` of the second.
///
/// Trees are shared: a clone costs next to nothing, and an offspring has the tree that it did not change in common
/// with its parent.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Individual {
    first: Option<Arc<Tree>>,
    second: Arc<Tree>,
}

impl Individual {
    /// The individual of these trees; without a first, `second` stands alone.
    ///
    /// # Errors
    /// [`TreeError::Iter2`] if the first tree, or a tree that stands alone, holds `iter2-*`.
    pub fn new(first: Option<Tree>, second: Tree) -> Result<Individual, TreeError> {
        if first.as_ref().unwrap_or(&second).reads_first() {
            return Err(TreeError::Iter2);
        }
        Ok(Individual { first: first.map(Arc::new), second: Arc::new(second) })
    }

    /// The individual with its first tree, or else its second, replaced.
    pub(super) fn with_tree(&self, first: bool, tree: Tree) -> Result<Individual, TreeError> {
        if (first || self.first.is_none()) && tree.reads_first() {
            return Err(TreeError::Iter2);
        }
        let tree = Arc::new(tree);
        Ok(match first {
            true => Individual { first: Some(tree), second: Arc::clone(&self.second) },
            false => Individual { first: self.first.clone(), second: tree },
        })
    }

    /// The tree that runs first, if there are two.
    pub fn first(&self) -> Option<&Tree> {
        self.first.as_deref()
    }

    /// The tree that gives the answer.
    pub fn second(&self) -> &Tree {
        &self.second
    }

    /// The trees, in the order in which they run.
    pub fn trees(&self) -> impl Iterator<Item = &Tree> {
        self.first.iter().chain(std::iter::once(&self.second)).map(|tree| &**tree)
    }

    /// How many nodes the trees have together.
    #[allow(clippy::len_without_is_empty, reason = "no individual is empty")]
    pub fn len(&self) -> usize {
        self.trees().map(Tree::len).sum()
    }

    /// Depth of the deeper tree; a root's is 0.
    pub fn depth(&self) -> usize {
        self.trees().map(Tree::depth).max().unwrap_or_default()
    }
}
