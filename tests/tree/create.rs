//! Random individuals: always sound, and distributed as they should be.

use std::collections::BTreeMap;

use vsonar::tree::{
    CreateError, CreateSettings, Creator, Group, Individual, Node, NodeType, Place, Random, Tree,
};

use super::check;

fn creator(change: impl FnOnce(&mut CreateSettings)) -> Creator {
    let mut settings = CreateSettings::default();
    change(&mut settings);
    Creator::new(&settings).unwrap_or_else(|error| panic!("{error}"))
}

fn sample(creator: &Creator, count: u32) -> impl Iterator<Item = Individual> + '_ {
    (0..count).map(|slot| creator.individual(&mut Random::stream(99, 0, slot)))
}

/// Depths of all nodes of a part that is one tree in preorder.
fn depths(nodes: &[Node]) -> Vec<usize> {
    let mut pending = vec![1usize];
    let mut depths = Vec::new();
    for node in nodes {
        while pending.last() == Some(&0) {
            pending.pop();
        }
        depths.push(pending.len() - 1);
        *pending.last_mut().expect("one tree") -= 1;
        pending.push(node.arity());
    }
    depths
}

/// Asserts that `count` of `total` is within six standard deviations of its expectation.
fn assert_share(count: usize, total: usize, share: f64, what: &str) {
    let (expected, deviation) = (share * total as f64, (share * (1.0 - share) * total as f64).sqrt());
    assert!(
        (count as f64 - expected).abs() <= 6.0 * deviation,
        "{what}: {count} of {total}, expected {expected:.0} with a deviation of {deviation:.0}"
    );
}

#[test]
fn thousands_are_sound() {
    let creator = creator(|_| {});
    for individual in sample(&creator, 4000) {
        check(&individual);
        assert!(individual.first().is_some());
        assert!(individual.depth() <= 9);
        for tree in individual.trees() {
            assert!(tree.body()[0].is_function());
            assert!(depths(tree.column()).into_iter().max() <= Some(3));
        }
    }
}

#[test]
fn other_settings_are_sound_too() {
    let changes: [fn(&mut CreateSettings); 5] = [
        |s| s.trees = 1,
        |s| (s.min_depth, s.max_depth) = (2, 2),
        |s| (s.column_depth, s.grow_leaf_probability) = (0, 0.0),
        |s| s.nodes = "-set* -read* -prog* -if-le -break -moravec* constant=50".parse().expect("sound"),
        |s| (s.min_depth, s.max_depth, s.nodes) = (40, 60, "prog3=1000 -square".parse().expect("sound")),
    ];
    for (number, change) in changes.into_iter().enumerate() {
        for individual in sample(&creator(change), 30) {
            check(&individual);
            match number {
                0 => assert!(individual.first().is_none()),
                1 => assert_eq!(individual.second().body().len(), 1 + individual.second().body()[0].arity()),
                2 => assert!(individual.trees().all(|tree| tree.column().len() == 1)),
                3 => assert!(individual.trees().flat_map(Tree::nodes).all(|n| n.group() != Group::Memory)),
                // The method full would give 3^60 nodes.
                _ => assert!(individual.trees().all(|tree| tree.len() <= vsonar::tree::MAX_NODES)),
            }
        }
    }
}

#[test]
fn the_shapes_are_ramped_half_and_half() {
    let creator = creator(|_| {});
    // By depth of the tree, how many bodies are full: every leaf on the last level.
    let mut full = BTreeMap::new();
    let (mut trees, mut arguments, mut leaves) = (0, 0, 0);
    for individual in sample(&creator, 3000) {
        for tree in individual.trees() {
            trees += 1;
            let body = depths(tree.body());
            let last = body.iter().copied().max().unwrap_or_default();
            let mut nodes = tree.body().iter().zip(&body);
            // Shallower ones are full by chance.
            if last + 1 >= 6 && nodes.clone().all(|(node, &depth)| node.is_function() || depth == last) {
                *full.entry(last + 1).or_insert(0) += 1;
            }
            let first = nodes.by_ref().filter(|(_, depth)| **depth == 1);
            for (node, _) in first {
                arguments += 1;
                leaves += usize::from(!node.is_function());
            }
        }
    }
    let all: usize = full.values().sum();
    // Half are full, and a few grown ones happen to be.
    assert!((0.48..0.54).contains(&(all as f64 / trees as f64)), "{all} of {trees}");
    for depth in 6..=9 {
        let share = full[&depth] as f64 / all as f64;
        assert!((0.22..0.28).contains(&share), "{full:?}");
    }
    // An argument of a body's root is a leaf with probability 1/4 in the half that is grown.
    let share = leaves as f64 / arguments as f64;
    assert!((0.11..0.14).contains(&share), "{leaves} of {arguments}");
}

#[test]
fn the_method_can_be_chosen() {
    let is_full = |tree: &Tree| {
        let body = depths(tree.body());
        tree.body().iter().zip(&body).all(|(node, depth)| node.is_function() != (*depth == 8))
    };
    let count = |probability| {
        let creator = creator(|s| (s.min_depth, s.full_probability) = (9, probability));
        sample(&creator, 200).map(|i| i.trees().filter(|&tree| is_full(tree)).count()).sum::<usize>()
    };
    assert_eq!(count(1.0), 400);
    // A grown body is full to the ninth level only if every one of many draws says so.
    assert!(count(0.0) < 4);
}

#[test]
fn columns_are_grown() {
    let creator = creator(|_| {});
    let mut counts = [[0usize; 2]; 4];
    for individual in sample(&creator, 3000) {
        for tree in individual.trees() {
            for (node, depth) in tree.column().iter().zip(depths(tree.column())) {
                counts[depth][usize::from(node.is_function())] += 1;
            }
        }
    }
    for (depth, [leaves, functions]) in counts.into_iter().enumerate() {
        let share = if depth == 3 { 1.0 } else { 0.25 };
        assert_share(leaves, leaves + functions, share, &format!("leaves of columns at depth {depth}"));
    }
}

#[test]
fn types_are_equally_likely_within_functions_and_leaves() {
    let creator = creator(|_| {});
    let mut counts = vec![[[0usize; 2]; 4]; NodeType::count()];
    let mut totals = BTreeMap::new();
    for individual in sample(&creator, 1500) {
        for (which, tree) in individual.trees().enumerate() {
            for (i, node) in tree.nodes().iter().enumerate() {
                let place = tree.place(i);
                counts[node.node_type().index()][place as usize][which] += 1;
                *totals.entry((place, which, node.is_function())).or_insert(0) += 1;
            }
        }
    }
    for place in [Place::Root, Place::Rect, Place::Column, Place::Body] {
        for which in 0..2 {
            let fits = |t: &NodeType| t.fits(place) && (which == 1 || t.node().group() != Group::Iter2);
            for t in NodeType::all() {
                let count = counts[t.index()][place as usize][which];
                if !fits(&t) {
                    assert_eq!(count, 0, "{t} in the {place}");
                    continue;
                }
                let function = t.node().is_function();
                let rivals =
                    NodeType::all().filter(fits).filter(|r| r.node().is_function() == function).count();
                let total = totals[&(place, which, function)];
                assert_share(
                    count,
                    total,
                    1.0 / rivals as f64,
                    &format!("{t} in the {place} of tree {which}"),
                );
            }
        }
    }
}

#[test]
fn weights_count() {
    let creator = creator(|s| s.nodes = "gradient=5 raw=2 -median".parse().expect("sound"));
    let mut counts = BTreeMap::new();
    for individual in sample(&creator, 600) {
        for node in individual.trees().flat_map(Tree::body).filter(|n| n.group() == Group::Image) {
            *counts.entry(node.name()).or_insert(0) += 1;
        }
    }
    let total: usize = counts.values().sum();
    assert_eq!(counts.get("median"), None);
    for (name, weight) in [("gradient", 5.0), ("raw", 2.0), ("raw-sq", 1.0)] {
        assert_share(counts[name], total, weight / 20.0, name);
    }
}

#[test]
fn constants_are_log_uniform() {
    let creator = creator(|_| {});
    let mut decades = [0usize; 5];
    let (mut negative, mut total) = (0, 0);
    for individual in sample(&creator, 2000) {
        for node in individual.trees().flat_map(Tree::nodes) {
            if let Node::Constant(value) = node {
                total += 1;
                negative += usize::from(*value < 0.0);
                let magnitude = value.abs();
                assert!((0.01..=1000.0).contains(&magnitude), "{value}");
                decades[[0.1, 1.0, 10.0, 100.0].iter().filter(|&&bound| magnitude >= bound).count()] += 1;
            }
        }
    }
    assert!(total > 2000, "{total}");
    assert_share(negative, total, 0.5, "negative constants");
    for (decade, count) in decades.into_iter().enumerate() {
        assert_share(count, total, 0.2, &format!("decade {decade}"));
    }
}

#[test]
fn columns_are_plain_with_the_probability_asked_for() {
    let plain = |probability| {
        let creator = creator(|s| s.plain_column_probability = probability);
        sample(&creator, 1500)
            .flat_map(|i| i.trees().map(|t| t.column() == [Node::XObstacle]).collect::<Vec<_>>())
            .filter(|&plain| plain)
            .count()
    };
    assert_eq!(plain(1.0), 3000);
    // Grown, a column is a leaf with probability 1/4, and that one of 5 leaves, or of 10 in a second tree.
    let by_chance = 0.25 * (1.0 / 5.0 + 1.0 / 10.0) / 2.0;
    assert_share(plain(0.0), 3000, by_chance, "plain columns by chance");
    assert_share(plain(0.7), 3000, 0.7 + 0.3 * by_chance, "plain columns");
}

#[test]
fn individuals_repeat() {
    let creator = creator(|_| {});
    let one = |slot| creator.individual(&mut Random::stream(3, 0, slot));
    assert_eq!(one(5), one(5));
    assert_ne!(one(5), one(6));
}

#[test]
fn impossible_settings_are_refused() {
    let message = |change: fn(&mut CreateSettings)| {
        let mut settings = CreateSettings::default();
        change(&mut settings);
        Creator::new(&settings).expect_err("impossible settings").to_string()
    };
    assert_eq!(
        message(|s| s.min_depth = 10),
        "depths of new trees from 10 to 9: write min_depth <= max_depth, both from 2 to 1000"
    );
    assert_eq!(
        message(|s| (s.min_depth, s.max_depth) = (1, 1)),
        "depths of new trees from 1 to 1: write min_depth <= max_depth, both from 2 to 1000"
    );
    assert_eq!(
        message(|s| s.full_probability = -1.0),
        "full_probability = -1 is no probability; it is from 0 to 1"
    );
    assert_eq!(message(|s| s.column_depth = 1000), "column_depth = 1000 is too deep; it is below 1000");
    assert_eq!(
        message(|s| s.grow_leaf_probability = f64::NAN),
        "grow_leaf_probability = NaN is no probability; it is from 0 to 1"
    );
    assert_eq!(
        message(|s| s.plain_column_probability = 1.5),
        "plain_column_probability = 1.5 is no probability; it is from 0 to 1"
    );
    assert_eq!(
        message(|s| s.constant_min = 0.0),
        "magnitudes of constants from 0 to 1000: write 0 < constant_min <= constant_max, both finite"
    );
    assert_eq!(message(|s| s.trees = 3), "trees = 3: an individual has 1 tree or 2");
    let without = |probability| {
        let mut settings =
            CreateSettings { plain_column_probability: probability, ..CreateSettings::default() };
        settings.nodes.edit("-constant -x-obstacle").expect("sound edits");
        Creator::new(&settings)
    };
    assert_eq!(
        without(0.7).expect_err("impossible settings").to_string(),
        "plain_column_probability = 0.7, but the node set leaves out `x-obstacle`, which plain columns are made \
         of; write plain_column_probability = 0, or put the node back, as in `+x-obstacle`"
    );
    let creator = without(0.0).expect("no plain columns");
    assert!(sample(&creator, 100).all(|i| i.trees().all(|t| !t.nodes().contains(&Node::XObstacle))));
    let mut settings = CreateSettings::default();
    settings.nodes.edit("-2x* -3x* -4x* -5x* -6x* -7x* -8x*").expect("sound edits");
    assert!(matches!(Creator::new(&settings), Err(CreateError::Nodes(_))));
}

#[test]
fn settings_round_trip() {
    let settings = CreateSettings {
        plain_column_probability: 0.7,
        nodes: "-raw* if-le=2".parse().expect("sound"),
        ..CreateSettings::default()
    };
    let text = toml::to_string(&settings).expect("settings have a TOML form");
    assert!(text.contains("nodes = \"if-le=2 -raw -raw-sq\""), "{text}");
    assert_eq!(toml::from_str::<CreateSettings>(&text).expect("sound"), settings);
    assert_eq!(toml::from_str::<CreateSettings>("").expect("sound"), CreateSettings::default());
    let fault = toml::from_str::<CreateSettings>("min_dept = 3").expect_err("no such field").to_string();
    assert!(fault.contains("min_dept"), "{fault}");
    let fault = toml::from_str::<CreateSettings>("nodes = '-rawr'").expect_err("no such node").to_string();
    assert!(fault.contains("unknown node `rawr` in `-rawr`; did you mean `raw`?"), "{fault}");
}
