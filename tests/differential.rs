//! Random individuals on random images: the walker of trees is the judge, and every executor must give its bits,
//! from the raw individual through lowering and optimiser.

mod common;

use vsonar::detector::{CompiledDetector, Detector};
use vsonar::explain::Explanation;
use vsonar::export::{Provenance, Request, Symbol, c};
use vsonar::ir::generate::Random as Small;
use vsonar::ir::{Op, Rect, Ty, opt, reference};
use vsonar::lower::lower;
use vsonar::tree::{Individual, Node, NodeType};

const SEED: u64 = 20_260;

/// Images of one size and columns in them.
fn cases(seed: u64, width: u32, height: u32, lanes: usize) -> vsonar::vision::CaseSet {
    let mut random = Small::new(seed);
    let images: Vec<_> = (0..6).map(|_| common::image(&mut random, width, height)).collect();
    let lanes: Vec<(usize, u32)> =
        (0..lanes).map(|i| (i % images.len(), random.below(width as usize) as u32)).collect();
    common::case_set(&images, &lanes)
}

#[test]
fn all_executors_agree_with_the_walker() {
    let executors = common::executors();
    let (mut pairs, mut finite, mut distinct) = (0u64, 0u64, 0u64);
    let mut node_types = vec![0u32; NodeType::count()];
    let mut ops = vec![0u32; Op::ALL.len()];
    let sizes = [(16, 16), (40, 24), (64, 48), (33, 57)];
    for batch in 0..24u64 {
        let seed = SEED + batch;
        let (width, height) = sizes[batch as usize % sizes.len()];
        // Group remainders of every kind.
        let cases = cases(seed, width, height, 65 + (batch as usize * 7) % 32);
        for individual in common::individuals(seed, 300) {
            let judged = common::answers(executors[0].as_ref(), &individual, &cases);
            for executor in &executors[1..] {
                let found = common::answers(executor.as_ref(), &individual, &cases);
                for (lane, (a, b)) in judged.iter().zip(&found).enumerate() {
                    assert!(
                        common::same(*a, *b),
                        "seed {seed}, {}, case {lane} of {width}x{height}: {b:e} instead of {a:e}\n{individual}\n{}",
                        executor.name(),
                        opt::optimise(&lower(&individual, width, height)),
                    );
                }
            }
            pairs += cases.len() as u64;
            finite += judged.iter().filter(|a| a.is_finite()).count() as u64;
            distinct += u64::from(judged.iter().any(|a| !common::same(*a, judged[0])));
            for node in individual.trees().flat_map(|tree| tree.nodes()) {
                node_types[node.node_type().index()] += 1;
            }
            for l in opt::optimise(&lower(&individual, width, height)).loops() {
                for inst in l.body().insts().iter().chain(l.column().block().insts()) {
                    ops[inst.op() as usize] += 1;
                }
            }
        }
    }
    println!("{pairs} pairs, {finite} finite answers, {distinct} individuals whose answers differ by case");
    assert!(pairs >= 500_000, "only {pairs} pairs");
    assert!(
        finite * 2 > pairs && distinct > 500,
        "the sample says little: {finite} finite, {distinct} varied"
    );
    for node_type in NodeType::all() {
        assert!(node_types[node_type.index()] > 0, "{} never ran", node_type.name());
    }
    // What lowering can write: what functions are made of is covered operation by operation in tests/backends.rs, and the
    // optimiser leaves no constant mask, for whatever it stands for is decided before the program runs.
    let absent = |op: Op| op == Op::MConst || op.result() == Ty::I32 || op.operands().contains(&Ty::I32);
    let decided = [Op::Lt, Op::Eq];
    let written = Op::ALL.iter().copied().filter(|&op| !absent(op) && !decided.contains(&op));
    for op in written {
        assert!(ops[op as usize] > 0, "`{}` never ran after the optimiser", op.name());
    }
    assert_eq!(ops[Op::MConst as usize], 0, "the optimiser leaves no constant mask");
}

#[test]
fn lowering_keeps_the_meaning_before_the_optimiser() {
    let walker = common::executors().remove(0);
    for batch in 0..4u64 {
        let seed = SEED + 1000 + batch;
        let cases = cases(seed, 40, 24, 33);
        for individual in common::individuals(seed, 250) {
            let judged = common::answers(walker.as_ref(), &individual, &cases);
            let program = lower(&individual, 40, 24);
            for (i, lane) in cases.lanes().iter().enumerate() {
                let found = reference::answer(&program, cases.image(i), lane.column as f32);
                assert!(
                    common::same(judged[i], found),
                    "seed {seed}, case {i}: {found:e} instead of {:e}\n{individual}\n{program}",
                    judged[i]
                );
            }
        }
    }
}

#[test]
fn every_rectangle_direction_and_operand_agrees() {
    let executors = common::executors();
    for (width, height) in [(16, 16), (40, 24)] {
        let cases = cases(SEED + 7, width, height, 40);
        for rect in Rect::all() {
            for direction in ["up", "down"] {
                for operand in vsonar::ir::Operand::all() {
                    let text = format!(
                        "(individual (iterate-{direction} {rect} x-obstacle (set-a (+ {} (* 0.5 read-a)))))",
                        operand.name()
                    );
                    let individual: Individual = text.parse().expect("a program");
                    let judged = common::answers(executors[0].as_ref(), &individual, &cases);
                    for executor in &executors[1..] {
                        let found = common::answers(executor.as_ref(), &individual, &cases);
                        let equal = judged.iter().zip(&found).all(|(a, b)| common::same(*a, *b));
                        assert!(equal, "{} on {text}: {found:?} instead of {judged:?}", executor.name());
                    }
                }
            }
        }
    }
}

/// The least individual in which a node of this type computes the answer.
fn with_node(node_type: NodeType) -> Individual {
    let leaves = ["gradient", "median", "y", "raw"];
    let name = if node_type.name() == "constant" { "1.5" } else { node_type.name() };
    let node = match node_type.arity() {
        0 => name.to_string(),
        arity => format!("({name} {})", leaves[..arity].join(" ")),
    };
    let first = "(iterate-down 2x2 x-obstacle (prog2 (set-b gradient) (set-a (+ read-a median))))";
    let text = match node_type.node() {
        Node::Iterate(_) => format!("(individual ({name} 3x3 x-obstacle (set-a (+ read-a gradient))))"),
        Node::Rect(_) => format!("(individual (iterate-up {name} x-obstacle (set-a (+ read-a gradient))))"),
        _ => format!(
            "(individual {first} (iterate-up 3x3 x-obstacle (prog2 (set-a (- y read-b)) (set-a {node}))))"
        ),
    };
    text.parse().unwrap_or_else(|fault| panic!("{text}: {fault}"))
}

/// Whatever stands in the table of nodes is taken by everything that takes programs; the table of operations is held
/// against C and native code by the programs of tests/export, against the rest by tests/backends.rs.
#[test]
fn every_node_is_known_everywhere() {
    let executors = common::executors();
    let (width, height) = (24, 20);
    let mut random = Small::new(SEED + 8);
    let images: Vec<_> = (0..6).map(|_| common::image(&mut random, width, height)).collect();
    let lanes: Vec<(usize, u32)> = (0..40).map(|i| (i % images.len(), (i * 5) as u32 % width)).collect();
    let cases = common::case_set(&images, &lanes);
    for node_type in NodeType::all() {
        let individual = with_node(node_type);
        assert!(individual.trees().flat_map(|tree| tree.nodes()).any(|node| node.node_type() == node_type));
        let judged = common::answers(executors[0].as_ref(), &individual, &cases);
        let held = |found: &[f32], by: &str| {
            let equal = judged.iter().zip(found).all(|(a, b)| common::same(*a, *b));
            assert!(equal, "{by} on {individual}: {found:?} instead of {judged:?}");
        };
        for executor in &executors[1..] {
            held(&common::answers(executor.as_ref(), &individual, &cases), executor.name());
        }
        let program = opt::optimise(&lower(&individual, width, height));
        let native = CompiledDetector::compile(&program).expect("this machine has a back end");
        let rows = lanes.iter().map(|&(image, column)| {
            let mut rows = [0.0];
            native.detect(&images[image], &[column], &mut rows).expect("the image fits");
            rows[0]
        });
        held(&rows.collect::<Vec<f32>>(), "native code");
        let listing = Explanation::new(&individual, width, height).expect("a listing that holds").listing;
        let read = cases.lanes().iter().enumerate();
        let read = read.map(|(i, lane)| listing.answer(cases.image(i), lane.column as f32));
        held(&read.collect::<Vec<f32>>(), "the listing");
        let symbol = Symbol::new("node_of_a_tree").expect("free");
        let provenance = Provenance::default();
        let request = Request { symbol, program, provenance, camera: None, median: false };
        assert!(c::source(&request).contains("int node_of_a_tree_detect("), "{individual}");
    }
}
