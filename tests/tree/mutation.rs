//! Mutation: mutants are sound, of the settings' nodes, and each kind does what it says.

use std::collections::BTreeMap;

use proptest::prelude::*;
use vsonar::tree::{
    CreateError, CreateSettings, Creator, Individual, Mutation, MutationError, MutationSettings, Mutator,
    Node, Offspring, Place, Random, Tree, subtree_crossover,
};

use super::{check, parse, random_individual};

fn create_settings(nodes: &str, trees: usize) -> CreateSettings {
    let nodes = nodes.parse().expect("edits of the node set");
    CreateSettings { min_depth: 3, max_depth: 6, trees, nodes, ..CreateSettings::default() }
}

fn mutator(create: &CreateSettings, max_depth: usize) -> Mutator {
    let settings = MutationSettings { max_depth, ..MutationSettings::default() };
    Mutator::new(create, &settings).expect("sound settings")
}

fn default_mutator() -> Mutator {
    mutator(&CreateSettings::default(), 17)
}

/// Mutants of one kind from many streams.
fn mutants(text: &str, kind: Mutation, count: u32) -> Vec<Offspring> {
    let (parent, mutator) = (parse(text), default_mutator());
    (0..count).map(|slot| mutator.mutate(&parent, kind, &mut Random::stream(41, 1, slot))).collect()
}

/// The trees in which two individuals differ.
fn changed_trees(a: &Individual, b: &Individual) -> usize {
    a.trees().zip(b.trees()).filter(|(a, b)| a != b).count()
}

/// The nodes of the two trees that differ, after what they have in common at the beginning and at the end.
fn difference<'a>(a: &'a [Node], b: &'a [Node]) -> (&'a [Node], &'a [Node]) {
    let begin = a.iter().zip(b).take_while(|(a, b)| a == b).count();
    let rest = a.len().min(b.len()) - begin;
    let end = a.iter().rev().zip(b.iter().rev()).take(rest).take_while(|(a, b)| a == b).count();
    (&a[begin..a.len() - end], &b[begin..b.len() - end])
}

/// What a kind of mutation says of parent and mutant.
fn check_kind(kind: Mutation, parent: &Individual, mutant: &Individual) {
    let (old, new): (Vec<&Tree>, Vec<&Tree>) = (parent.trees().collect(), mutant.trees().collect());
    let Some((old, new)) = old.into_iter().zip(new).find(|(old, new)| old != new) else { return };
    let (from, to) = difference(old.nodes(), new.nodes());
    match kind {
        Mutation::Subtree => {}
        Mutation::Point => {
            assert_eq!((from.len(), to.len()), (1, 1), "one node");
            assert_eq!(from[0].arity(), to[0].arity(), "arguments stay");
            assert_eq!(old.depth(), new.depth());
            let both_constants = matches!((from[0], to[0]), (Node::Constant(_), Node::Constant(_)));
            assert!(both_constants || from[0].node_type() != to[0].node_type());
        }
        Mutation::Constant => {
            let ([Node::Constant(from)], [Node::Constant(to)]) = (from, to) else {
                panic!("{from:?} became {to:?}");
            };
            assert_eq!(from.is_sign_negative(), to.is_sign_negative());
            assert!((0.01..=1000.0).contains(&to.abs()), "{to}");
        }
        Mutation::Hoist => {
            assert!(new.len() < old.len(), "it shrinks");
            assert!(new.depth() <= old.depth());
            assert_eq!((new.direction(), new.rect()), (old.direction(), old.rect()));
            assert!(new.column() == old.column() || new.body() == old.body());
            // It is made of nothing that was not there: what is left is the old with some nodes taken out.
            let mut rest = old.nodes().iter();
            assert!(new.nodes().iter().all(|node| rest.any(|other| other == node)));
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    /// Chains of mutants and crossings stay individuals of the node set within the depth.
    #[test]
    fn every_mutant_is_an_individual_of_the_settings(
        seed in any::<u64>(),
        trees in 1usize..=2,
        nodes in prop::sample::select(vec!["", "-raw* -sin -3x3 if-le=5", "-prog3 -break -constant", "-iterate-up -atan2 -median*"]),
        max_depth in 6usize..=17,
        kinds in prop::collection::vec(prop::sample::select(Mutation::ALL.to_vec()), 1..12),
    ) {
        let create = create_settings(nodes, trees);
        let (creator, mutator) = (Creator::new(&create).expect("sound"), mutator(&create, max_depth));
        let mut random = Random::stream(seed, 0, 0);
        let mut individual = creator.individual(&mut random);
        for kind in kinds {
            let child = mutator.mutate(&individual, kind, &mut random);
            check(&child.individual);
            prop_assert_eq!(child.individual.trees().count(), trees);
            prop_assert!(child.individual.depth() <= max_depth);
            let known = |node: &Node| create.nodes.weight(node.node_type()) > 0;
            prop_assert!(child.individual.trees().flat_map(Tree::nodes).all(known), "{}", child.individual);
            if child.replaced {
                prop_assert_eq!(&child.individual, &individual);
            } else {
                prop_assert!(changed_trees(&individual, &child.individual) <= 1);
                check_kind(kind, &individual, &child.individual);
            }
            // It crosses and reads back as any other.
            let text = child.individual.to_string();
            prop_assert_eq!(&text.parse::<Individual>().expect("its own text"), &child.individual);
            let other = creator.individual(&mut random);
            let [crossed, _] = subtree_crossover(&child.individual, &other, &Default::default(), &mut random);
            individual = if crossed.individual.depth() <= max_depth { crossed.individual } else { child.individual };
        }
    }
}

#[test]
fn mutants_repeat_and_are_seldom_their_parents() {
    let mutator = default_mutator();
    for kind in Mutation::ALL {
        let mut same = 0;
        for slot in 0..300 {
            let parent = random_individual(slot);
            let mutate = || mutator.mutate(&parent, kind, &mut Random::stream(42, 1, slot));
            let child = mutate();
            assert_eq!(child, mutate());
            let is_constant = |node: &Node| matches!(node, Node::Constant(_));
            let has_constant = parent.trees().flat_map(Tree::nodes).any(is_constant);
            if kind == Mutation::Constant && !has_constant {
                assert!(child.replaced);
                continue;
            }
            same += u32::from(child.individual == parent);
        }
        assert!(same < 30, "{kind:?}: {same} of 300");
    }
}

#[test]
fn subtrees_of_every_place_give_way() {
    let text = "(individual (iterate-up 2x2 (+ 1 2) (prog2 (set-a (sin y)) (set-b 3))))";
    let parent = parse(text);
    let (mut roots, mut by_place) = (0, BTreeMap::new());
    let total = 20_000;
    for child in mutants(text, Mutation::Subtree, total) {
        let (old, new) = (parent.second(), child.individual.second());
        let parts = [
            (Place::Rect, old.rect() != new.rect()),
            (Place::Column, old.column() != new.column()),
            (Place::Body, old.body() != new.body()),
        ];
        let changed: Vec<Place> = parts.into_iter().filter(|part| part.1).map(|part| part.0).collect();
        match changed[..] {
            [place] => *by_place.entry(place).or_insert(0u32) += 1,
            [] => {}
            // A whole new tree has almost never a part of the old.
            _ => roots += 1,
        }
        if changed == [Place::Body] {
            // Grown within 4 of the point, which is at most at depth 4.
            assert!(new.depth() <= 8, "{}", child.individual);
        }
        if changed == [Place::Column] {
            assert!(new.depth() <= 2 + 3, "{}", child.individual);
        }
    }
    let share = |count: u32| f64::from(count) / f64::from(total);
    // Functions: the root, +, prog2, set-a, sin, set-b. Leaves: the rectangle, 1, 2, y, 3.
    assert!((share(roots) - 0.9 / 6.0).abs() < 0.02, "{}", share(roots));
    let expected = [
        (Place::Rect, 0.1 / 5.0 * 18.0 / 19.0),
        (Place::Column, 0.9 / 6.0 + 0.2 / 5.0),
        (Place::Body, 0.9 * 4.0 / 6.0 + 0.2 / 5.0),
    ];
    for (place, expected) in expected {
        assert!((share(by_place[&place]) - expected).abs() < 0.02, "{place}: {by_place:?}");
    }
}

/// A whole column is made as that of a new tree: plain with its probability.
#[test]
fn new_columns_are_those_of_new_trees() {
    let create = CreateSettings { plain_column_probability: 0.7, ..CreateSettings::default() };
    let mutator = mutator(&create, 17);
    let parent = parse("(individual (iterate-up 2x2 (square 5) (set-a y)))");
    let (mut plain, mut whole) = (0, 0);
    for slot in 0..20_000 {
        let child = mutator.mutate(&parent, Mutation::Subtree, &mut Random::stream(43, 1, slot)).individual;
        let (old, new) = (parent.second(), child.second());
        let only_column =
            old.body() == new.body() && old.rect() == new.rect() && old.column() != new.column();
        if only_column && new.column()[0] != Node::Square {
            whole += 1;
            plain += u32::from(new.column() == [Node::XObstacle]);
        }
    }
    let share = f64::from(plain) / f64::from(whole);
    assert!(whole > 2000 && (share - 0.7).abs() < 0.05, "{share} of {whole}");
}

#[test]
fn points_become_others_of_their_kind() {
    let text = "(individual (iterate-up 2x2 x-obstacle (+ (if-le y 1 2 x) 7)))";
    let parent = parse(text);
    let (mut directions, mut constants, mut functions) = (0, 0, BTreeMap::new());
    for child in mutants(text, Mutation::Point, 5000) {
        assert!(!child.replaced && child.individual != parent);
        let (old, new) = (parent.second(), child.individual.second());
        let (from, to) = difference(old.nodes(), new.nodes());
        assert!(!matches!(from[0], Node::IfLe), "nothing else has four arguments");
        directions += u32::from(old.direction() != new.direction());
        constants += u32::from(matches!((from[0], to[0]), (Node::Constant(_), Node::Constant(_))));
        if from[0] == Node::Add {
            *functions.entry(to[0].name()).or_insert(0u32) += 1;
        }
    }
    // With 0.9 the root or +, as likely; leaves are the rectangle, x-obstacle, y, 1, 2, x, 7.
    assert!((2100..2400).contains(&directions), "{directions}");
    assert!((2..60).contains(&constants), "{constants}");
    // In a body: - * % atan2 min max prog2.
    assert_eq!(functions.len(), 7, "{functions:?}");
    assert!(functions.values().all(|count| (220..430).contains(count)), "{functions:?}");
}

#[test]
fn constants_take_log_normal_steps() {
    let text = "(individual (iterate-up 2x2 8 (set-a y)) (iterate-up 2x2 x-obstacle (+ -8 y)))";
    let mut logarithms = Vec::new();
    let mut in_first = 0;
    for child in mutants(text, Mutation::Constant, 20_000) {
        let constant = |tree: &Tree| {
            tree.nodes().iter().find_map(|n| if let Node::Constant(c) = n { Some(*c) } else { None })
        };
        let (first, second) =
            (child.individual.first().and_then(constant), constant(child.individual.second()));
        let (first, second) = (first.expect("there"), second.expect("there"));
        assert!(first > 0.0 && second < 0.0 && (first == 8.0 || second == -8.0));
        in_first += u32::from(first != 8.0);
        let moved = if first == 8.0 { -second } else { first };
        logarithms.push((f64::from(moved) / 8.0).ln());
    }
    assert!((9_500..10_500).contains(&in_first), "{in_first}");
    let n = logarithms.len() as f64;
    let mean = logarithms.iter().sum::<f64>() / n;
    let deviation = (logarithms.iter().map(|l| (l - mean).powi(2)).sum::<f64>() / n).sqrt();
    assert!(mean.abs() < 0.02 && (deviation - 0.5).abs() < 0.02, "{mean} {deviation}");
    // Beyond one standard deviation either way lies what lies there in a normal distribution.
    let beyond = logarithms.iter().filter(|l| l.abs() > 0.5).count() as f64 / n;
    assert!((beyond - 0.3173).abs() < 0.02, "{beyond}");
    // The ends of the range hold.
    for constant in ["1000", "0.01", "-1000"] {
        for child in mutants(&format!("(individual (iterate-up 2x2 {constant} y))"), Mutation::Constant, 200)
        {
            check_kind(
                Mutation::Constant,
                &parse(&format!("(individual (iterate-up 2x2 {constant} y))")),
                &child.individual,
            );
        }
    }
}

#[test]
fn parts_are_hoisted() {
    let text = "(individual (iterate-up 2x2 (+ 1 2) (set-a (sin y))))";
    let mut seen: BTreeMap<String, u32> = BTreeMap::new();
    for child in mutants(text, Mutation::Hoist, 6000) {
        assert!(!child.replaced);
        *seen
            .entry(child.individual.to_string().split_whitespace().collect::<Vec<_>>().join(" "))
            .or_insert(0) += 1;
    }
    // Of the functions +, set-a and sin each is as likely, and so is each part below it.
    let expected = [
        ("(individual (iterate-up 2x2 1 (set-a (sin y))))", 1000),
        ("(individual (iterate-up 2x2 2 (set-a (sin y))))", 1000),
        ("(individual (iterate-up 2x2 (+ 1 2) (sin y)))", 1000),
        ("(individual (iterate-up 2x2 (+ 1 2) y))", 1000),
        ("(individual (iterate-up 2x2 (+ 1 2) (set-a y)))", 2000),
    ];
    assert_eq!(seen.len(), expected.len(), "{seen:?}");
    for (text, count) in expected {
        assert!(seen.get(text).is_some_and(|n| n.abs_diff(count) < 200), "{text}: {seen:?}");
    }
}

#[test]
fn what_has_nothing_to_change_is_its_parent() {
    let text = "(individual (iterate-up 2x2 x-obstacle y))";
    for kind in [Mutation::Constant, Mutation::Hoist] {
        assert!(
            mutants(text, kind, 50).iter().all(|c| c.replaced && c.individual == parse(text)),
            "{kind:?}"
        );
    }
    // One node of each sort: nothing stands for another.
    let mut create = create_settings("", 1);
    create.nodes = format!("{} +iterate-up +2x2 ++ +x-obstacle", all_out()).parse().expect("edits");
    let lonely = Mutator::new(&create, &MutationSettings::default()).expect("sound settings");
    let parent = parse("(individual (iterate-up 2x2 x-obstacle (+ x-obstacle x-obstacle)))");
    for slot in 0..50 {
        assert!(lonely.mutate(&parent, Mutation::Point, &mut Random::stream(44, 1, slot)).replaced);
    }
}

/// Edits that take every node type out.
fn all_out() -> String {
    vsonar::tree::NodeType::all().map(|t| format!("-{t} ")).collect()
}

#[test]
fn what_is_too_deep_is_replaced() {
    let create = CreateSettings::default();
    let mutator = mutator(&create, 9);
    let (mut replaced, mut kept) = (0, 0);
    for slot in 0..500 {
        let parent = random_individual(slot);
        let child = mutator.mutate(&parent, Mutation::Subtree, &mut Random::stream(45, 1, slot));
        assert!(child.individual.depth() <= 9);
        (replaced, kept) = (replaced + u32::from(child.replaced), kept + u32::from(!child.replaced));
    }
    assert!(replaced > 20 && kept > 200, "{replaced}, {kept}");
}

#[test]
fn settings_of_mutation_are_checked() {
    let create = CreateSettings::default();
    let fault =
        |settings: MutationSettings| Mutator::new(&create, &settings).expect_err("impossible").to_string();
    let base = MutationSettings::default;
    assert_eq!(
        fault(MutationSettings { internal_probability: 1.5, ..base() }),
        "internal_probability = 1.5 is no probability; it is from 0 to 1"
    );
    assert_eq!(
        fault(MutationSettings { max_depth: 1, ..base() }),
        "max_depth = 1 of mutants: it is from 2 to 1000"
    );
    assert_eq!(
        fault(MutationSettings { subtree_depth: 1000, ..base() }),
        "subtree_depth = 1000 is too deep; it is below 1000"
    );
    assert!(fault(MutationSettings { constant_step: f64::NAN, ..base() }).contains("constant_step"));
    let create = CreateSettings { trees: 3, ..create };
    let error = Mutator::new(&create, &base()).expect_err("three trees");
    assert_eq!(error, MutationError::Create(CreateError::Trees(3)));
}
