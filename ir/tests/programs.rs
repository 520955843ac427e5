//! Properties of random programs: text round trips, the verifier after every pass, the meaning kept.

use vsonar_ir::generate::{self, Random};
use vsonar_ir::opt::{self, Pass};
use vsonar_ir::{Op, Program, Region, reference, text, verify};

const WIDTH: u32 = 40;
const HEIGHT: u32 = 24;

fn same(a: f32, b: f32) -> bool {
    a.to_bits() == b.to_bits() || a.is_nan() && b.is_nan()
}

/// Answers in a few columns over a few made-up images.
fn assert_same_meaning(seed: u64, what: &str, before: &Program, after: &Program) {
    let mut random = Random::new(seed ^ 0x5eed);
    for image in 0..4 {
        let windows = generate::windows(seed + image);
        // The columns at the sides are where ranges end.
        let x = match image {
            0 => 0,
            1 => WIDTH - 1,
            _ => random.below(WIDTH as usize) as u32,
        } as f32;
        let (a, b) = (reference::answer(before, &windows, x), reference::answer(after, &windows, x));
        assert!(
            same(a, b),
            "seed {seed}, {what}, column {x}, image {image}: {a:e} became {b:e}\n{before}\n{after}"
        );
    }
}

fn programs(count: u64) -> impl Iterator<Item = (u64, Program)> {
    (0..count).map(|seed| (seed, generate::program(seed, WIDTH, HEIGHT, 8 + (seed % 40) as usize)))
}

#[test]
fn text_round_trips() {
    for (seed, program) in programs(2000) {
        for program in [opt::optimise(&program), program] {
            let printed = text::print(&program);
            assert_eq!(text::parse(&printed).as_ref(), Ok(&program), "seed {seed}\n{printed}");
        }
    }
}

#[test]
fn every_pass_keeps_programs_well_formed_and_their_meaning() {
    for (seed, program) in programs(20_000) {
        let mut random = Random::new(seed);
        let mut current = program.clone();
        for pass in Pass::ALL {
            let mut alone = program.clone();
            pass.run(&mut alone);
            assert_same_meaning(seed, &format!("{pass:?} alone"), &program, &alone);
        }
        for _ in 0..6 {
            let pass = random.pick(&Pass::ALL);
            let before = current.clone();
            let changed = pass.run(&mut current);
            assert_eq!(verify::verify(&current), Ok(()), "seed {seed}, {pass:?}\n{before}\n{current}");
            assert_eq!(changed, before != current, "seed {seed}, {pass:?}: says whether it changed anything");
            assert_same_meaning(seed, &format!("{pass:?}"), &before, &current);
        }
        assert_same_meaning(seed, "all passes", &program, &current);
    }
}

#[test]
fn the_optimiser_keeps_meaning_and_comes_to_rest() {
    let (mut before, mut after) = (0, 0);
    for (seed, program) in programs(20_000) {
        let optimised = opt::optimise(&program);
        assert_eq!(verify::verify(&optimised), Ok(()), "seed {seed}");
        assert_same_meaning(seed, "optimise", &program, &optimised);
        let again = opt::optimise(&optimised);
        assert_eq!(again, optimised, "seed {seed}: a second time finds more");
        before += program.len();
        after += optimised.len();
    }
    assert!(after * 3 < before * 2, "random programs are largely dead: {after} of {before} left");
}

#[test]
fn optimised_programs_hold_nothing_dead_or_misplaced() {
    for (seed, program) in programs(2000) {
        let mut optimised = opt::optimise(&program);
        let printed = text::print(&optimised);
        assert!(!Pass::Dce.run(&mut optimised), "seed {seed}: dead code in\n{printed}");
        for l in optimised.loops() {
            for ((reg, _), depends) in l.body().iter().zip(l.body().dependences()) {
                assert_eq!(l.region_of(reg), Region::earliest(depends), "seed {seed}, {reg}\n{printed}");
            }
        }
    }
}

#[test]
fn expansion_leaves_basic_operations_alone() {
    for (seed, mut program) in programs(1000) {
        Pass::Expand.run(&mut program);
        let blocks = program.loops().flat_map(|l| [l.body(), l.column().block()]);
        let left: Vec<Op> = blocks.flat_map(|b| b.insts()).map(|inst| inst.op()).collect();
        assert!(left.iter().all(|op| op.function().is_none()), "seed {seed}");
    }
}

#[test]
fn random_programs_use_every_operation() {
    let mut seen = vec![false; Op::ALL.len()];
    for (_, program) in programs(500) {
        for inst in program.loops().flat_map(|l| [l.body(), l.column().block()]).flat_map(|b| b.insts()) {
            seen[inst.op() as usize] = true;
        }
    }
    let missing: Vec<&str> = Op::ALL.iter().filter(|op| !seen[**op as usize]).map(|op| op.name()).collect();
    assert_eq!(missing, ["bits"], "`bits` alone is left out, because a NaN's are unspecified");
}
