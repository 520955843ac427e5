//! The executors against each other, on the fresh individuals of generations 0 and 10 of a run on the corridor
//! images (the real ones where `VSONAR_DATA` names a folder of data sets that has them, else the synthetic ones).
//!
//! Compilation is part of what is measured. `cargo bench --bench executors` prints criterion's figures and, at the
//! end, interleaved ratios: the best of several rounds in which the executors take turns.

use std::collections::HashSet;
use std::hint::black_box;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

use criterion::Criterion;
use vsonar::dataset::Dataset;
use vsonar::evolve::{Evolution, Settings};
use vsonar::exec::batch::BatchExecutor;
use vsonar::exec::cranelift::{CraneliftExecutor, Shape};
use vsonar::exec::reference::ReferenceExecutor;
use vsonar::exec::tree::TreeExecutor;
use vsonar::exec::{Candidate, Executor, Timing, Worker};
use vsonar::tree::Individual;
use vsonar::vision::CaseSet;

/// How many fresh individuals of a generation are run.
const SAMPLE: usize = 200;
/// How often the executors take turns.
const ROUNDS: usize = 3;

fn data() -> Dataset {
    let real = std::env::var_os("VSONAR_DATA").map(|folder| std::path::Path::new(&folder).join("corridor"));
    match real.filter(|folder| folder.is_dir()) {
        Some(folder) => Dataset::load(folder).expect("the corridor images can be read"),
        None => vsonar::world::default_dataset(1),
    }
}

fn executors() -> Vec<Arc<dyn Executor>> {
    vec![
        Arc::new(BatchExecutor::widest()),
        Arc::new(CraneliftExecutor::new(Shape::Lanes4).expect("this machine has a back end")),
        Arc::new(CraneliftExecutor::new(Shape::Scalar).expect("this machine has a back end")),
        Arc::new(ReferenceExecutor),
        Arc::new(TreeExecutor),
    ]
}

/// Individuals of generations 0 and 10 that were not in the generation before: every n-th of them.
fn populations(data: &Dataset) -> Vec<(u32, Vec<Individual>)> {
    let settings = Settings { population: 2000, generations: 11, seed: 1, ..Settings::default_preset() };
    let mut run = Evolution::new(data, settings, executors().remove(0), 2).expect("the settings are sound");
    let mut before: HashSet<String> = HashSet::new();
    let mut out = Vec::new();
    for generation in 0..11 {
        run.step(&AtomicBool::new(false)).expect("the run goes on").expect("nobody stops it");
        let population = &run.state().expect("a generation is made").population;
        let texts: Vec<String> = population.iter().map(|m| m.individual().to_string()).collect();
        if generation == 0 || generation == 10 {
            let fresh: Vec<&Individual> = population
                .iter()
                .zip(&texts)
                .filter(|(_, text)| !before.contains(*text))
                .map(|(member, _)| member.individual())
                .collect();
            let every = (fresh.len() / SAMPLE).max(1);
            out.push((generation, fresh.into_iter().step_by(every).take(SAMPLE).cloned().collect()));
        }
        before = texts.into_iter().collect();
    }
    out
}

fn run(worker: &mut dyn Worker, individuals: &[Individual], cases: &CaseSet) -> Timing {
    let mut answers = vec![0.0; cases.len()];
    let mut timing = Timing::default();
    for individual in individuals {
        let candidate = Candidate::new(individual, cases.width(), cases.height());
        timing += worker.answers(&candidate, cases, &mut answers).expect("the program compiles");
        black_box(&answers);
    }
    timing
}

fn main() {
    let mut criterion = Criterion::default()
        .configure_from_args()
        .sample_size(10)
        .warm_up_time(Duration::from_millis(300))
        .measurement_time(Duration::from_secs(3));
    let data = data();
    let cases = data.case_set();
    let executors = executors();
    let mut workers: Vec<Box<dyn Worker>> =
        executors.iter().map(|e| e.worker().expect("a worker can be made")).collect();
    let populations = populations(&data);

    for (generation, individuals) in &populations {
        let mut group = criterion.benchmark_group(format!("generation {generation}"));
        for (executor, worker) in executors.iter().zip(&mut workers) {
            group.bench_function(executor.name(), |b| {
                b.iter(|| run(worker.as_mut(), black_box(individuals), &cases));
            });
        }
        group.finish();
    }
    criterion.final_summary();

    for (generation, individuals) in &populations {
        let mut best = vec![(Duration::MAX, Timing::default()); workers.len()];
        for _ in 0..ROUNDS {
            for (worker, best) in workers.iter_mut().zip(&mut best) {
                let start = Instant::now();
                let timing = run(worker.as_mut(), individuals, &cases);
                let elapsed = start.elapsed();
                if elapsed < best.0 {
                    *best = (elapsed, timing);
                }
            }
        }
        println!(
            "generation {generation}, {} individuals x {} cases, compilation included, best of {ROUNDS} rounds:",
            individuals.len(),
            cases.len()
        );
        let tree = best[best.len() - 1].0;
        let each = |time: Duration| time.as_secs_f64() * 1e3 / individuals.len() as f64;
        for (executor, (elapsed, timing)) in executors.iter().zip(&best) {
            println!(
                "  {:<17} {:9.3} ms an individual ({:.3} lowering, {:.3} compiling, {:.3} executing), {:6.1} times the walker's speed",
                executor.name(),
                each(*elapsed),
                each(timing.lower),
                each(timing.compile),
                each(timing.execute),
                tree.as_secs_f64() / elapsed.as_secs_f64()
            );
        }
    }
}
