//! Random individuals on random images: the walker of trees is the judge, and every executor must give its bits,
//! from the raw individual through lowering and optimiser.

mod common;

use vsonar::ir::generate::Random as Small;
use vsonar::ir::{Op, Rect, reference};
use vsonar::lower::lower;
use vsonar::tree::{Individual, NodeType};

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
                        vsonar::ir::opt::optimise(&lower(&individual, width, height)),
                    );
                }
            }
            pairs += cases.len() as u64;
            finite += judged.iter().filter(|a| a.is_finite()).count() as u64;
            distinct += u64::from(judged.iter().any(|a| !common::same(*a, judged[0])));
            for node in individual.trees().flat_map(|tree| tree.nodes()) {
                node_types[node.node_type().index()] += 1;
            }
            for l in vsonar::ir::opt::optimise(&lower(&individual, width, height)).loops() {
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
    // What lowering can write. The integer operations are those of expanded formulas, which
    // tests/backends.rs covers operation by operation.
    let written = [
        Op::Const,
        Op::XObstacle,
        Op::Iter2,
        Op::X,
        Op::Y,
        Op::FirstWindow,
        Op::Read,
        Op::Window,
        Op::Add,
        Op::Sub,
        Op::Mul,
        Op::Div,
        Op::PDiv,
        Op::Min,
        Op::Max,
        Op::Sin,
        Op::Cos,
        Op::Tan,
        Op::Atan,
        Op::Atan2,
        Op::Le,
        Op::Select,
        Op::And,
        Op::Or,
        Op::Not,
    ];
    for op in written {
        assert!(ops[op as usize] > 0, "`{}` never ran after the optimiser", op.name());
    }
    // Whatever they stand for is decided before the program runs.
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
