//! Individuals: their text, their making, their crossing, and what they mean when walked.

mod create;
mod crossover;
mod errors;
mod fmrb;
mod mutation;
mod shape;
mod text;
mod walker;

use vsonar::tree::{CreateSettings, Creator, Individual, Node, Place, Random, Tree, TreeIndex};

/// An individual of the default settings; `slot` is printed by whoever fails on it.
fn random_individual(slot: u32) -> Individual {
    let creator = Creator::new(&CreateSettings::default()).expect("the default settings are sound");
    creator.individual(&mut Random::stream(20, 0, slot))
}

fn parse(text: &str) -> Individual {
    text.parse().unwrap_or_else(|error| panic!("{error} in {text}"))
}

/// Checks a tree against a second, recursive reading of the rules; returns its depth.
fn check_tree(tree: &Tree, which: TreeIndex) -> usize {
    fn walk(nodes: &[Node], at: &mut usize, place: Place, which: TreeIndex) -> usize {
        let node = nodes[*at];
        *at += 1;
        let allowed = match node {
            Node::Iterate(_) => place == Place::Root,
            Node::Rect(_) => place == Place::Rect,
            Node::Constant(value) => value.is_finite() && matches!(place, Place::Column | Place::Body),
            Node::Add | Node::Sub | Node::Mul | Node::Div | Node::Square | Node::Sin | Node::Cos => {
                matches!(place, Place::Column | Place::Body)
            }
            Node::Tan | Node::Atan | Node::Atan2 | Node::Min | Node::Max => {
                matches!(place, Place::Column | Place::Body)
            }
            Node::XObstacle | Node::WindowArea | Node::ImageMaxX | Node::ImageMaxY => {
                matches!(place, Place::Column | Place::Body)
            }
            Node::Iter2(_) => which == TreeIndex::Second && matches!(place, Place::Column | Place::Body),
            Node::FirstWindow | Node::X | Node::Y | Node::Image(_) | Node::Read(_) | Node::Set(_) => {
                place == Place::Body
            }
            Node::Prog2 | Node::Prog3 | Node::Break | Node::IfLe => place == Place::Body,
        };
        assert!(allowed, "{node:?} stands in the {place}");
        let places = [Place::Rect, Place::Column, Place::Body];
        let mut deepest = 0;
        for of_root in places.into_iter().cycle().take(node.arity()) {
            let place = if place == Place::Root { of_root } else { place };
            deepest = deepest.max(1 + walk(nodes, at, place, which));
        }
        deepest
    }
    let mut at = 0;
    let depth = walk(tree.nodes(), &mut at, Place::Root, which);
    assert_eq!(at, tree.len());
    assert_eq!(depth, tree.depth());
    depth
}

/// Checks both trees of an individual.
fn check(individual: &Individual) {
    if let Some(first) = individual.first() {
        check_tree(first, TreeIndex::First);
        check_tree(individual.second(), TreeIndex::Second);
    } else {
        check_tree(individual.second(), TreeIndex::First);
    }
}
