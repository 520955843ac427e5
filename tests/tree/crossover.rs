//! Subtree crossover: offspring are sound, nothing is lost, and the points are chosen as they should be.

use std::collections::BTreeMap;

use vsonar::tree::{
    CrossoverSettings, Group, Individual, Node, Place, Random, Tree, TreeIndex, subtree_crossover,
};

use super::{check, parse, random_individual};

/// How often every node occurs.
fn count_nodes(individuals: &[&Individual]) -> BTreeMap<String, usize> {
    let mut counts = BTreeMap::new();
    for node in individuals.iter().flat_map(|i| i.trees()).flat_map(Tree::nodes) {
        *counts.entry(format!("{node:?}")).or_insert(0) += 1;
    }
    counts
}

fn depth_limit(max_depth: usize) -> CrossoverSettings {
    CrossoverSettings { max_depth, ..CrossoverSettings::default() }
}

#[test]
fn generations_of_offspring_are_sound() {
    let settings = CrossoverSettings::default();
    let mut population: Vec<Individual> = (0..200).map(random_individual).collect();
    let (mut replaced, mut exchanged) = (0, 0);
    for generation in 1..=20 {
        let mut next = Vec::new();
        for pair in 0..100 {
            let mut random = Random::stream(4, generation, pair);
            let (a, b) = (&population[random.index(200)], &population[random.index(200)]);
            let children = subtree_crossover(a, b, &settings, &mut random);
            let what = format!("generation {generation}, pair {pair}");
            for (child, parent) in children.iter().zip([a, b]) {
                check(&child.individual);
                assert!(child.individual.depth() <= 17, "{what}");
                if child.replaced {
                    assert_eq!(&child.individual, parent, "{what}");
                }
            }
            if children.iter().any(|child| child.replaced) {
                replaced += 1;
            } else {
                exchanged += 1;
                let individuals = [&children[0].individual, &children[1].individual];
                assert_eq!(count_nodes(&individuals), count_nodes(&[a, b]), "{what}");
            }
            next.extend(children.map(|child| child.individual));
        }
        population = next;
    }
    // Both happen, so both were checked.
    assert!(replaced > 10 && exchanged > 1000, "{replaced}, {exchanged}");
}

#[test]
fn what_is_too_deep_is_replaced_by_its_own_parent() {
    // Exchanging parts of bodies of depth 2 and of depth 4 makes one deeper than 4 and one shallower.
    let a = parse("(individual (iterate-up 2x2 1 (sin (sin (sin y)))))");
    let b = parse("(individual (iterate-up 3x3 2 (cos (cos (cos x)))))");
    assert_eq!((a.depth(), b.depth()), (4, 4));
    let mut seen = [[0; 2]; 2];
    for pair in 0..500 {
        let [c, d] = subtree_crossover(&a, &b, &depth_limit(4), &mut Random::stream(5, 1, pair));
        for (child, parent) in [(&c, &a), (&d, &b)] {
            assert!(child.individual.depth() <= 4, "pair {pair}");
            assert!(!child.replaced || child.individual == *parent, "pair {pair}");
        }
        seen[usize::from(c.replaced)][usize::from(d.replaced)] += 1;
    }
    // Never both: the one gets what the other loses.
    assert!(seen[0][0] > 100 && seen[0][1] > 100 && seen[1][0] > 100, "{seen:?}");
    assert_eq!(seen[1][1], 0);
}

#[test]
fn points_are_chosen_by_the_rule() {
    // Nodes of `a` occur nowhere in `b`, so what moved is plain to see.
    let a = parse("(individual (iterate-up 2x2 (+ 1 2) (prog2 (set-a (sin y)) (set-b 3))))");
    let b = parse("(individual (iterate-down 3x3 (* 4 5) (prog3 (set-c x) (set-d (cos 6)) raw)))");
    let from_b = |node: &Node| b.second().nodes().contains(node);
    let total = 40_000;
    let (mut roots, mut leaves, mut by_place) = (0, 0, BTreeMap::new());
    for pair in 0..total {
        let [c, _] =
            subtree_crossover(&a, &b, &CrossoverSettings::default(), &mut Random::stream(6, 1, pair));
        let tree = c.individual.second();
        let moved =
            tree.nodes().iter().position(from_b).unwrap_or_else(|| panic!("pair {pair}: nothing moved"));
        let place = tree.place(moved);
        assert_eq!(place == Place::Root, c.individual == b, "pair {pair}");
        roots += u32::from(place == Place::Root);
        leaves += u32::from(!a.second().nodes()[moved].is_function());
        *by_place.entry(place).or_insert(0u32) += 1;
        // What moved is one whole subtree; what surrounds it is as it was.
        let part = tree.subtree(moved);
        assert!(tree.nodes()[part.clone()].iter().all(from_b), "pair {pair}");
        let outside = tree.nodes().iter().enumerate().filter(|(i, _)| !part.contains(i));
        assert!(outside.into_iter().all(|(_, node)| !from_b(node)), "pair {pair}");
    }
    let share = |count: u32| f64::from(count) / f64::from(total);
    // Functions of `a`: the root, +, prog2, set-a, sin, set-b. Leaves: the rectangle, 1, 2, y, 3. Shares are
    // of 40,000 with standard deviations below 0.0025.
    assert!((share(leaves) - 0.1).abs() < 0.01, "{}", share(leaves));
    assert!((share(roots) - 0.9 / 6.0).abs() < 0.015, "{}", share(roots));
    let expected = [
        (Place::Rect, 0.1 / 5.0),
        (Place::Column, 0.9 / 6.0 + 0.2 / 5.0),
        (Place::Body, 0.9 * 4.0 / 6.0 + 0.2 / 5.0),
    ];
    for (place, expected) in expected {
        assert!((share(by_place[&place]) - expected).abs() < 0.015, "{place}: {by_place:?}");
    }
}

#[test]
fn the_second_point_follows_the_same_rule() {
    // `a` gives a body's part always; in `b` functions and leaves of the body are easily told apart.
    let a =
        parse("(individual (iterate-up 2x2 x-obstacle (sin (sin (sin (sin (sin (sin (sin (sin y))))))))))");
    let b = parse("(individual (iterate-up 2x2 window-area (cos (+ 1 2))))");
    let (mut functions, mut leaves) = (0, 0);
    for pair in 0..20_000 {
        let [c, _] =
            subtree_crossover(&a, &b, &CrossoverSettings::default(), &mut Random::stream(7, 1, pair));
        match c
            .individual
            .second()
            .body()
            .iter()
            .find(|n| matches!(n, Node::Cos | Node::Add | Node::Constant(_)))
        {
            Some(Node::Constant(_)) => leaves += 1,
            Some(_) if c.individual != b => functions += 1,
            _ => {}
        }
    }
    let share = f64::from(leaves) / f64::from(leaves + functions);
    assert!((share - 0.1).abs() < 0.015, "{leaves}, {functions}");
    // A column without functions gives a leaf, whatever was drawn in the other.
    let a = parse("(individual (iterate-up 2x2 (sin (cos 1)) (set-a y)))");
    for pair in 0..2000 {
        let [c, d] =
            subtree_crossover(&a, &b, &CrossoverSettings::default(), &mut Random::stream(8, 1, pair));
        check(&c.individual);
        check(&d.individual);
    }
}

#[test]
fn trees_of_one_index_exchange() {
    let a = parse("(individual (iterate-up 2x2 1 (sin 1)) (iterate-up 2x2 1 (sin 1)))");
    let b = parse("(individual (iterate-up 3x3 2 (cos 2)) (iterate-up 4x4 3 (tan 3)))");
    let mut in_first = 0;
    for pair in 0..10_000 {
        let [c, d] =
            subtree_crossover(&a, &b, &CrossoverSettings::default(), &mut Random::stream(9, 1, pair));
        let unchanged = |of: &Individual, parent: &Individual, first: bool| {
            if first { of.first() == parent.first() } else { of.second() == parent.second() }
        };
        let first = unchanged(&c.individual, &a, false);
        in_first += u32::from(first);
        assert!(unchanged(&c.individual, &a, !first) && unchanged(&d.individual, &b, !first), "pair {pair}");
        assert!(!unchanged(&c.individual, &a, first) && !unchanged(&d.individual, &b, first), "pair {pair}");
    }
    assert!((4700..5300).contains(&in_first), "{in_first}");
}

#[test]
fn an_only_tree_never_gets_what_it_cannot_read() {
    let one = parse("(individual (iterate-up 2x2 1 (set-a y)))");
    let two = parse("(individual (iterate-up 2x2 1 (set-a y)) (iterate-up 2x2 iter2-a (set-a iter2-b)))");
    let mut replaced = 0;
    for pair in 0..500 {
        let [c, d] =
            subtree_crossover(&one, &two, &CrossoverSettings::default(), &mut Random::stream(10, 1, pair));
        check(&c.individual);
        check(&d.individual);
        assert!(c.individual.first().is_none() && d.individual.first() == two.first(), "pair {pair}");
        replaced += u32::from(c.replaced);
        let reads = |i: &Individual| i.second().nodes().iter().any(|n| n.group() == Group::Iter2);
        assert!(!reads(&c.individual), "pair {pair}");
    }
    assert!(replaced > 300, "{replaced}");
    assert!(Tree::from_nodes(two.second().nodes().to_vec(), TreeIndex::First).is_err());
}

#[test]
fn crossover_repeats_and_checks_its_settings() {
    let (a, b) = (random_individual(1), random_individual(2));
    let cross = || subtree_crossover(&a, &b, &CrossoverSettings::default(), &mut Random::stream(1, 1, 1));
    assert_eq!(cross(), cross());
    assert_eq!(CrossoverSettings::default().check(), Ok(()));
    let fault = |settings: CrossoverSettings| settings.check().expect_err("impossible").to_string();
    assert_eq!(fault(depth_limit(1001)), "max_depth = 1001 of offspring: it is from 2 to 1000");
    let settings = CrossoverSettings { internal_probability: -0.1, ..CrossoverSettings::default() };
    assert_eq!(fault(settings), "internal_probability = -0.1 is no probability; it is from 0 to 1");
}
