//! Executable memory is given back: alone in its process, so that nothing else moves its size.
#![cfg(target_os = "linux")]

mod common;

use common::{case_set, image};
use vsonar::detector::CompiledDetector;
use vsonar::exec::cranelift::{CraneliftExecutor, Shape};
use vsonar::ir::generate::{self, Random};
use vsonar::ir::{Program, opt};

/// Resident memory of this process, in bytes.
fn resident() -> usize {
    let status = std::fs::read_to_string("/proc/self/status").expect("the system tells");
    let line = status.lines().find(|line| line.starts_with("VmRSS:")).expect("the system tells");
    let kib: usize = line.split_whitespace().nth(1).and_then(|n| n.parse().ok()).expect("a number");
    kib << 10
}

#[test]
fn memory_stays_flat_over_a_hundred_thousand_compilations() {
    let picture = image(&mut Random::new(3), 16, 16);
    let set = case_set(&[picture], &[(0, 0), (0, 5), (0, 10), (0, 15)]);
    let programs: Vec<Program> = (0..50)
        .map(|seed| opt::optimise(&generate::program(seed, 16, 16, 12)))
        .filter(|program| program.constant_answer().is_none())
        .collect();
    let executor = CraneliftExecutor::new(Shape::Lanes4).expect("this machine has a back end");
    let mut worker = executor.cranelift_worker().expect("a worker can be made");
    let mut answers = vec![0.0; set.len()];
    let mut run = |count: usize| {
        for i in 0..count {
            worker.run(&programs[i % programs.len()], &set, &mut answers).expect("runs");
        }
    };
    run(5_000);
    let before = resident();
    run(95_000);
    let after = resident();
    // Leaking the code alone would take a page a program, 380 MB.
    assert!(after < before + (24 << 20), "{before} bytes grew to {after}");

    // Detectors own their code one by one.
    let compile = |count: usize| {
        for i in 0..count {
            CompiledDetector::compile(&programs[i % programs.len()]).expect("compiles");
        }
    };
    compile(500);
    let before = resident();
    compile(5_000);
    let after = resident();
    assert!(after < before + (8 << 20), "{before} bytes grew to {after} with detectors");
}
