//! Trees made from nodes: what is refused, and how parts are found.

use std::collections::HashSet;

use vsonar::ir::{Direction, Rect};
use vsonar::tree::{Individual, MAX_NODES, Node, Place, Tree, TreeError, TreeIndex};

use super::{parse, random_individual};

fn rect() -> Node {
    Node::Rect(Rect::new(2, 2).expect("in the list"))
}

fn tree(rest: &[Node], which: TreeIndex) -> Result<Tree, TreeError> {
    let nodes = [&[Node::Iterate(Direction::Up), rect()], rest].concat();
    Tree::from_nodes(nodes, which)
}

#[test]
fn faulty_nodes_are_refused() {
    use TreeIndex::{First, Second};
    let nan = Node::Constant(f32::NAN);
    let iterate = Node::Iterate(Direction::Down);
    let whole = [Node::Set(0), iterate, rect(), Node::X, Node::Y];
    let below = [&[Node::XObstacle], &whole[..]].concat();
    let cases: [(&[Node], TreeIndex, TreeError); 9] = [
        (&[Node::XObstacle], First, TreeError::Truncated { len: 3 }),
        (&[Node::XObstacle, Node::Add, Node::Y], First, TreeError::Truncated { len: 5 }),
        (&[Node::XObstacle, Node::Y, Node::Y], First, TreeError::Trailing { end: 4 }),
        (&below, Second, TreeError::IterateBelowRoot { node: iterate, index: 4 }),
        (&[Node::Y, Node::Y], First, TreeError::Misplaced { node: Node::Y, place: Place::Column, index: 2 }),
        (&[Node::X, rect()], Second, TreeError::Misplaced { node: Node::X, place: Place::Column, index: 2 }),
        (&[Node::XObstacle, Node::Iter2(0)], First, TreeError::Iter2),
        (&[nan, Node::Y], First, TreeError::Unsound { node: nan, index: 2 }),
        (&[Node::XObstacle, Node::Read(5)], First, TreeError::Unsound { node: Node::Read(5), index: 3 }),
    ];
    for (rest, which, error) in cases {
        assert_eq!(tree(rest, which), Err(error), "{rest:?}");
        // A message never fails, whatever the nodes are.
        assert!(!error.to_string().is_empty());
    }
    assert_eq!(Tree::from_nodes(vec![], First), Err(TreeError::Truncated { len: 0 }));
    assert_eq!(Tree::from_nodes(vec![Node::Y], First), Err(TreeError::Root(Node::Y)));
    assert_eq!(Tree::from_nodes(vec![Node::Add, Node::Y, Node::Y], First), Err(TreeError::Root(Node::Add)));
    let huge = vec![Node::Sin; MAX_NODES + 1];
    assert_eq!(Tree::from_nodes(huge, First), Err(TreeError::TooLarge(MAX_NODES + 1)));

    let deep = |depth: usize| {
        let mut rest = vec![Node::XObstacle];
        rest.resize(depth, Node::Sin);
        rest.push(Node::Y);
        tree(&rest, First)
    };
    assert_eq!(deep(1000).map(|tree| tree.depth()), Ok(1000));
    assert_eq!(deep(1001), Err(TreeError::TooDeep));
}

#[test]
fn only_the_second_of_two_trees_reads_the_first() {
    let reader = tree(&[Node::Iter2(2), Node::Y], TreeIndex::Second).expect("sound");
    let plain = tree(&[Node::XObstacle, Node::Y], TreeIndex::First).expect("sound");
    assert_eq!(Individual::new(None, reader.clone()), Err(TreeError::Iter2));
    assert_eq!(Individual::new(Some(reader.clone()), plain.clone()), Err(TreeError::Iter2));
    let both = Individual::new(Some(plain.clone()), reader.clone()).expect("sound");
    assert_eq!((both.first(), both.second(), both.len()), (Some(&plain), &reader, 8));
}

#[test]
fn parts_are_found() {
    let individual = parse(
        "(individual (iterate-down 3x8 (- x-obstacle (sin 2)) (prog2 (set-c (* y 3)) (if-le x y 0 break))))",
    );
    let tree = individual.second();
    assert_eq!((individual.first(), individual.len(), individual.depth()), (None, 16, 4));
    assert_eq!((tree.direction(), tree.rect()), (Direction::Down, Rect::new(3, 8).expect("in the list")));
    assert_eq!(tree.column(), &[Node::Sub, Node::XObstacle, Node::Sin, Node::Constant(2.0)]);
    assert_eq!(tree.body().first(), Some(&Node::Prog2));
    assert_eq!([0, 1, 2, 5, 6, 14].map(|i| tree.place(i)), {
        use Place::{Body, Column, Rect, Root};
        [Root, Rect, Column, Column, Body, Body]
    });
    assert_eq!(
        [0, 1, 2, 4, 6, 7, 10, 14].map(|i| tree.subtree(i)),
        [0..16, 1..2, 2..6, 4..6, 6..16, 7..11, 10..11, 14..15]
    );
}

#[test]
fn equality_is_by_bits() {
    let constant = |text: &str| parse(&format!("(individual (iterate-up 2x2 1 {text}))"));
    assert_ne!(constant("0"), constant("-0"));
    assert_eq!(constant("0.5"), constant("5e-1"));
    let texts = ["0", "-0", "0.0", "1", "1e0", "y", "x"];
    let distinct: HashSet<Individual> = texts.map(constant).into();
    assert_eq!(distinct.len(), 5);
    let many: HashSet<Individual> = (0..500).map(random_individual).collect();
    let texts: HashSet<String> = many.iter().map(Individual::to_string).collect();
    assert_eq!(many.len(), texts.len());
    assert_eq!(many.len(), 500);
}
