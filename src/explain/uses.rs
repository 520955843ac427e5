//! What a program really uses of what it was evolved with.

use serde::Serialize;
use vsonar_ir::op::REGISTER_NAMES;
use vsonar_ir::{Direction, Program};

use super::letters::{self, Letters};
use super::listing::Listing;
use super::reduce::Live;
use crate::tree::{Individual, Node};

/// What is used, tree by tree.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Uses {
    /// The trees as evolved, in the order they run.
    pub trees: Vec<TreeUses>,
    /// Operations of the program before the optimiser, without what plainly nobody reads.
    pub operations_before: usize,
    /// Operations after it.
    pub operations: usize,
    /// Whether all nodes were tried; if not, more may be introns.
    pub complete: bool,
}

/// One tree.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TreeUses {
    /// `first` or `second`, or `only`.
    pub tree: &'static str,
    /// How many nodes it has.
    pub nodes: usize,
    /// How many of them do anything.
    pub live: usize,
    /// The image operators (with `-sq` for the average of squares) of its live nodes.
    pub operators: Vec<&'static str>,
    /// Those that stand in the tree, but are not needed.
    pub idle_operators: Vec<&'static str>,
    /// The registers that its live nodes store, as they are called in the tree.
    pub stored: Vec<&'static str>,
    /// Those that they read.
    pub read: Vec<&'static str>,
    /// Those of the tree that no live node needs.
    pub idle_registers: Vec<&'static str>,
    /// How the listing's registers differ from these.
    pub listing: Renamed,
    /// The window's width and height.
    pub window: [u32; 2],
    /// `up` or `down`.
    pub direction: &'static str,
}

/// Registers of a listing beside those of the tree, compared by what they end with on random images.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct Renamed {
    /// Registers that the tree needs and that have another letter in the listing: the tree's and the listing's.
    pub other_letter: Vec<[&'static str; 2]>,
    /// Registers that the tree needs and the listing does not have.
    pub without: Vec<&'static str>,
    /// Registers of the listing that are none of those that the tree needs: the optimiser has made them of several, or
    /// they have other values where that makes no difference.
    pub own: Vec<&'static str>,
}

impl Renamed {
    /// Of the tree's registers `needed` and the listing's that are stored or read, `there`; `alike` has the tree's
    /// registers that the listing's are alike to.
    fn of(needed: [bool; 5], there: [bool; 5], alike: [u8; 5], has_answer: bool) -> Renamed {
        let is = |j: usize, k: usize| there[k] && alike[k] & (1 << j) != 0;
        let mut renamed = Renamed::default();
        for j in 0..5 {
            let name = REGISTER_NAMES[j];
            let other = (0..5).find(|&k| is(j, k)).map(|k| REGISTER_NAMES[k]);
            match other.filter(|_| needed[j] && !is(j, j)) {
                Some(other) => renamed.other_letter.push([name, other]),
                None if needed[j] && !there[j] => renamed.without.push(name),
                None => {}
            }
            // The answer is called a whatever the tree has.
            let is_answer = has_answer && j == 0;
            if there[j] && !is_answer && !(0..5).any(|k| needed[k] && is(k, j)) {
                renamed.own.push(name);
            }
        }
        renamed
    }
}

impl Uses {
    pub(super) fn of(
        individual: &Individual,
        (program, listing): (&Program, &Listing),
        before: usize,
        live: &Live,
        letters: &Letters,
    ) -> Uses {
        let two = individual.first().is_some();
        let renamed = |tree: usize| {
            let has_answer = !two || tree == 1;
            let (sweep, alike) = match &listing.first {
                _ if has_answer => (&listing.second, letters.alike[1]),
                Some(first) => (first, letters.alike[0]),
                None => return Renamed::default(),
            };
            let [stored, read] = sweep.registers();
            let there = std::array::from_fn(|k| stored[k] || read[k]);
            Renamed::of(letters::needed(individual, live, tree), there, alike, has_answer)
        };
        let trees = individual.trees().enumerate().map(|(i, tree)| {
            let name = if !two { "only" } else { ["first", "second"][i] };
            let register = |k: u8| REGISTER_NAMES.get(usize::from(k)).copied();
            let live_nodes = |of: &dyn Fn(Node) -> Option<&'static str>| {
                let nodes = tree.nodes().iter().zip(&live.nodes[i]);
                distinct(nodes.filter(|(_, live)| **live).filter_map(|(&node, _)| of(node)))
            };
            let all = |of: &dyn Fn(Node) -> Option<&'static str>| {
                distinct(tree.nodes().iter().filter_map(|&node| of(node)))
            };
            let operator = |node: Node| match node {
                Node::Image(operand) => Some(operand.name()),
                _ => None,
            };
            let operators = live_nodes(&operator);
            let idle_operators = all(&operator);
            let stored = live_nodes(&|node| match node {
                Node::Set(k) => register(k),
                _ => None,
            });
            let read = live_nodes(&|node| match node {
                Node::Read(k) => register(k),
                _ => None,
            });
            let idle_registers = all(&|node| match node {
                Node::Set(k) | Node::Read(k) => register(k),
                _ => None,
            });
            TreeUses {
                tree: name,
                nodes: tree.len(),
                live: live.count(i),
                idle_operators: without(idle_operators, &[&operators]),
                idle_registers: without(idle_registers, &[&stored, &read]),
                operators,
                stored,
                read,
                listing: renamed(i),
                window: [tree.rect().width(), tree.rect().height()],
                direction: match tree.direction() {
                    Direction::Up => "up",
                    Direction::Down => "down",
                },
            }
        });
        Uses {
            trees: trees.collect(),
            operations_before: before,
            operations: program.operations(),
            complete: live.complete,
        }
    }

    /// Nodes of all trees, and how many of them do anything.
    pub fn nodes(&self) -> (usize, usize) {
        let sum = |of: fn(&TreeUses) -> usize| self.trees.iter().map(of).sum();
        (sum(|t| t.nodes), sum(|t| t.live))
    }
}

/// What stands in a tree, each once, in order of name.
fn distinct(names: impl Iterator<Item = &'static str>) -> Vec<&'static str> {
    let mut names: Vec<&str> = names.collect();
    names.sort_unstable();
    names.dedup();
    names
}

fn without(mut names: Vec<&'static str>, used: &[&[&'static str]]) -> Vec<&'static str> {
    names.retain(|name| !used.iter().any(|used| used.contains(name)));
    names
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn registers_by_hand() {
        let of = |letters: &str| [b'a', b'b', b'c', b'd', b'e'].map(|c| letters.as_bytes().contains(&c));
        // The tree needs a, b and d; the listing has a, which ends as the tree's a and b do, and c, which ends as none of
        // them; its e is like the tree's e, which the tree does not need.
        let renamed = Renamed::of(of("abd"), of("ace"), [0b11, 0, 0, 0, 0b10000], true);
        assert_eq!(renamed.other_letter, [["b", "a"]]);
        assert_eq!((&renamed.without[..], &renamed.own[..]), (&["d"][..], &["c", "e"][..]));
        // The same letters with the same values: nothing to say.
        assert_eq!(Renamed::of(of("ab"), of("ab"), [0b1, 0b10, 0, 0, 0], true), Renamed::default());
        // An answer that nothing is stored in is a all the same, but a register of the first tree is not.
        assert_eq!(Renamed::of(of(""), of("a"), [0b1; 5], true), Renamed::default());
        assert_eq!(Renamed::of(of(""), of("a"), [0b1; 5], false).own, ["a"]);
    }
}
