//! What a program costs before it runs: lowering, optimising, and code generation in both forms, for individuals as
//! they are created (generation 0) and for random IR programs by size.

use std::hint::black_box;
use std::time::Duration;

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use vsonar::exec::cranelift::{CraneliftExecutor, Shape};
use vsonar::ir::{Program, generate, opt};
use vsonar::lower::lower;
use vsonar::tree::{CreateSettings, Creator, Individual, Random};
use vsonar::vision::{CaseSet, Lane, WindowSums};

const SIDES: (u32, u32) = (320, 240);

fn individuals(count: u32) -> Vec<Individual> {
    let creator = Creator::new(&CreateSettings::default()).expect("the settings are sound");
    (0..count).map(|slot| creator.individual(&mut Random::stream(1, 0, slot))).collect()
}

fn front(c: &mut Criterion) {
    let individuals = individuals(200);
    let lowered: Vec<Program> = individuals.iter().map(|i| lower(i, SIDES.0, SIDES.1)).collect();
    let mut group = c.benchmark_group("200 individuals");
    group.bench_function("lower", |b| {
        b.iter(|| individuals.iter().map(|i| lower(black_box(i), SIDES.0, SIDES.1).len()).sum::<usize>());
    });
    group.bench_function("optimise", |b| {
        b.iter(|| lowered.iter().map(|p| opt::optimise(black_box(p)).len()).sum::<usize>());
    });
    group.finish();
}

/// One case on a flat image: next to nothing to execute.
fn one_case() -> CaseSet {
    let image = image::GrayImage::from_pixel(SIDES.0, SIDES.1, image::Luma([100]));
    CaseSet::new(vec![WindowSums::new(&image).into()], vec![Lane { image: 0, column: 160 }])
        .expect("the column is inside")
}

fn code(c: &mut Criterion) {
    let cases = one_case();
    let mut group = c.benchmark_group("code generation");
    for size in [10, 40, 160] {
        let programs: Vec<Program> =
            (0..50).map(|seed| opt::optimise(&generate::program(seed, SIDES.0, SIDES.1, size))).collect();
        let operations = programs.iter().map(Program::operations).sum::<usize>() / programs.len();
        for shape in [Shape::Scalar, Shape::Lanes4] {
            let executor = CraneliftExecutor::new(shape).expect("this machine has a back end");
            let mut worker = executor.cranelift_worker().expect("a worker can be made");
            let id = BenchmarkId::new(format!("{shape:?}, 50 programs"), format!("{operations} operations"));
            group.bench_function(id, |b| {
                b.iter_custom(|rounds| {
                    let mut spent = Duration::ZERO;
                    let mut answers = [0.0];
                    for _ in 0..rounds {
                        for program in &programs {
                            spent += worker.run(program, &cases, &mut answers).expect("it compiles").compile;
                        }
                    }
                    spent
                });
            });
        }
    }
    group.finish();
}

criterion_group! {
    name = compile;
    config = Criterion::default().sample_size(20).measurement_time(Duration::from_secs(3));
    targets = front, code
}
criterion_main!(compile);
