//! Which nodes of the trees do anything.
//!
//! A subtree is taken away (0 stands for it), or one of its arguments put in its place, wherever the optimised program
//! stays the same; from the root on, until no more can go. What is left is live, all else are introns.

use vsonar_ir::opt::Optimiser;
use vsonar_ir::{Direction, Program, Rect};

use crate::lower::lower;
use crate::tree::{Individual, Node, Tree, TreeIndex};

/// How many nodes may be lowered in all, which bounds the time that large trees take.
const WORK: usize = 4_000_000;

/// The nodes of an individual that matter.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Live {
    /// For each tree, by the node's position in preorder, whether it is live.
    pub nodes: Vec<Vec<bool>>,
    /// Whether all was tried; if not, more nodes may be introns than are found.
    pub complete: bool,
}

/// A node and where it came from; none for what stands in a subtree's place.
type Origin = (Node, Option<usize>);

struct Reducer<'a> {
    trees: Vec<Vec<Origin>>,
    target: &'a Program,
    optimiser: Optimiser,
    left: usize,
}

impl Live {
    /// Finds them for images of the size of `optimised`, the individual's program.
    pub fn of(individual: &Individual, optimised: &Program) -> Live {
        let origins = |tree: &Tree| -> Vec<Origin> {
            tree.nodes().iter().enumerate().map(|(i, &node)| (node, Some(i))).collect()
        };
        let trees: Vec<Vec<Origin>> = individual.trees().map(origins).collect();
        let lens: Vec<usize> = trees.iter().map(Vec::len).collect();
        let mut reducer = Reducer { trees, target: optimised, optimiser: Optimiser::default(), left: WORK };
        let nothing: Vec<Origin> = [
            Node::Iterate(Direction::Down),
            Node::Rect(Rect::default()),
            Node::XObstacle,
            Node::Constant(0.0),
        ]
        .map(|node| (node, None))
        .into();
        if lens.len() == 2 {
            reducer.accept(0, nothing);
        }
        for tree in 0..lens.len() {
            // The column expression, then the body.
            reducer.reduce(tree, 2);
            let body = reducer.end(tree, 2);
            reducer.reduce(tree, body);
        }
        let nodes = reducer.trees.iter().zip(lens).map(|(tree, len)| {
            let mut live = vec![false; len];
            tree.iter().filter_map(|(_, origin)| *origin).for_each(|i| live[i] = true);
            live
        });
        Live { nodes: nodes.collect(), complete: reducer.left > 0 }
    }

    /// How many nodes of a tree are live.
    pub fn count(&self, tree: usize) -> usize {
        self.nodes[tree].iter().filter(|&&live| live).count()
    }
}

impl Reducer<'_> {
    fn end(&self, tree: usize, at: usize) -> usize {
        let mut open = 1;
        let mut end = at;
        while open > 0 {
            open = open + self.trees[tree][end].0.arity() - 1;
            end += 1;
        }
        end
    }

    /// Puts other nodes in a tree's place if that leaves the program as it is.
    fn accept(&mut self, tree: usize, nodes: Vec<Origin>) -> bool {
        let work: usize = self.trees.iter().map(Vec::len).sum();
        if self.left == 0 {
            return false;
        }
        self.left = self.left.saturating_sub(work);
        let before = std::mem::replace(&mut self.trees[tree], nodes);
        let same = self.individual().is_some_and(|individual| {
            let program = lower(&individual, self.target.width(), self.target.height());
            self.optimiser.optimise(program) == *self.target
        });
        if !same {
            self.trees[tree] = before;
        }
        same
    }

    fn individual(&self) -> Option<Individual> {
        let tree = |nodes: &Vec<Origin>, which| {
            Tree::from_nodes(nodes.iter().map(|(node, _)| *node).collect(), which).ok()
        };
        match &self.trees[..] {
            [second] => Individual::new(None, tree(second, TreeIndex::First)?).ok(),
            [first, second] => {
                let first = tree(first, TreeIndex::First)?;
                Individual::new(Some(first), tree(second, TreeIndex::Second)?).ok()
            }
            _ => None,
        }
    }

    /// The tree with other nodes in the place of the subtree at `at`.
    fn with(&self, tree: usize, at: usize, nodes: &[Origin]) -> Vec<Origin> {
        let all = &self.trees[tree];
        [&all[..at], nodes, &all[self.end(tree, at)..]].concat()
    }

    fn reduce(&mut self, tree: usize, at: usize) {
        let (node, origin) = self.trees[tree][at];
        // Nothing is tried any more once all work is done.
        if origin.is_none() || self.left == 0 {
            return;
        }
        let stand_in = if node == Node::Constant(0.0) { 1.0 } else { 0.0 };
        if self.accept(tree, self.with(tree, at, &[(Node::Constant(stand_in), None)])) {
            return;
        }
        let mut arguments = Vec::with_capacity(node.arity());
        let mut next = at + 1;
        for _ in 0..node.arity() {
            let end = self.end(tree, next);
            arguments.push(next..end);
            next = end;
        }
        // Of a choice the branches come first.
        for argument in arguments.into_iter().rev() {
            let nodes = self.trees[tree][argument].to_vec();
            if self.accept(tree, self.with(tree, at, &nodes)) {
                return self.reduce(tree, at);
            }
        }
        let mut next = at + 1;
        for _ in 0..node.arity() {
            self.reduce(tree, next);
            next = self.end(tree, next);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The live nodes of the trees, each tree as the names of its own.
    fn live(text: &str) -> Vec<Vec<&'static str>> {
        let individual: Individual = text.parse().expect("a program");
        let program = vsonar_ir::opt::optimise(&lower(&individual, 64, 48));
        let live = Live::of(&individual, &program);
        assert!(live.complete);
        let names = |(tree, live): (&Tree, &Vec<bool>)| {
            tree.nodes().iter().zip(live).filter(|(_, live)| **live).map(|(node, _)| node.name()).collect()
        };
        individual.trees().zip(&live.nodes).map(names).collect()
    }

    #[test]
    fn introns_by_hand() {
        // A branch that is never taken, a sum of which one part is stored, a register nobody reads.
        let found = live(
            "(individual (iterate-up 3x3 x-obstacle
               (prog2 (if-le y -1 (set-a gradient) (+ (set-a median) (set-b raw))) (set-c x))))",
        );
        assert_eq!(found, [vec!["iterate-up", "3x3", "x-obstacle", "set-a", "median"]]);
        // A first tree that nothing is read of.
        let found = live(
            "(individual (iterate-up 3x3 x-obstacle (set-a raw)) (iterate-down 2x2 (+ x-obstacle 1) (set-a raw)))",
        );
        assert_eq!(found[0], Vec::<&str>::new());
        assert_eq!(found[1], ["iterate-down", "2x2", "+", "x-obstacle", "constant", "set-a", "raw"]);
    }
}
