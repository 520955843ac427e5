//! The executors against each other, on the fresh individuals of generations 0, 10 and 30 of a run on the corridor
//! images (the real ones where `VSONAR_DATA` names a folder of data sets that has them, else the synthetic ones).
//!
//! Compilation is part of what is measured. `cargo bench --bench executors` prints criterion's figures and, at the
//! end, ratios: the executors take turns, medians over the rounds. `vsonar bench` tells more, without criterion.

mod common;

use std::hint::black_box;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use criterion::Criterion;
use vsonar::benchmark::{Fresh, GenerationReport, Plan, even_sample, evolve_fresh, measure};
use vsonar::dataset::Dataset;
use vsonar::evolve::{Evolution, Settings};
use vsonar::exec::{Candidate, Worker};
use vsonar::tree::Individual;
use vsonar::vision::CaseSet;

/// How many fresh individuals of a generation are run; as many as slow executors run in `vsonar bench`.
const SAMPLE: usize = 50;

fn data() -> Dataset {
    let real = std::env::var_os("VSONAR_DATA").map(|folder| std::path::Path::new(&folder).join("corridor"));
    match real.filter(|folder| folder.is_dir()) {
        Some(folder) => Dataset::load(folder).expect("the corridor images can be read"),
        None => vsonar::world::default_dataset(1),
    }
}

fn fresh(data: &Dataset) -> Vec<Fresh> {
    let settings = Settings { population: 2000, generations: 31, seed: 1, ..Settings::default_preset() };
    let mut run =
        Evolution::new(data, settings, common::fast().remove(0), 0).expect("the settings are sound");
    let fresh = evolve_fresh(&mut run, &[0, 10, 30], &AtomicBool::new(false), |_| ());
    fresh.expect("the run goes on").expect("nobody stops it")
}

fn run(worker: &mut dyn Worker, individuals: &[&Individual], cases: &CaseSet) {
    let mut answers = vec![0.0; cases.len()];
    for individual in individuals {
        let candidate = Candidate::new(individual, cases.width(), cases.height());
        worker.answers(&candidate, cases, &mut answers).expect("the program compiles");
        black_box(&answers);
    }
}

fn main() {
    let mut criterion = Criterion::default()
        .configure_from_args()
        .sample_size(10)
        .warm_up_time(Duration::from_millis(300))
        .measurement_time(Duration::from_secs(3));
    let data = data();
    let cases = data.case_set();
    let executors = common::all();
    let fresh = fresh(&data);
    let samples: Vec<Vec<&Individual>> = fresh.iter().map(|f| even_sample(&f.individuals, SAMPLE)).collect();

    for (fresh, sample) in fresh.iter().zip(&samples) {
        let mut group = criterion.benchmark_group(format!("generation {}", fresh.generation));
        for executor in &executors {
            let mut worker = executor.worker().expect("a worker can be made");
            group.bench_function(executor.name(), |b| {
                b.iter(|| run(worker.as_mut(), black_box(sample), &cases));
            });
        }
        group.finish();
    }
    criterion.final_summary();

    // Every executor runs the same individuals.
    let plan = Plan { slow_every: 1, ..Plan::default() };
    for (fresh, sample) in fresh.iter().zip(&samples) {
        let measured = measure(sample, &cases, &executors, &plan, &AtomicBool::new(false), |_| ());
        let measured = measured.expect("all agree").expect("nobody stops it");
        let report = GenerationReport::of(fresh.generation, fresh.individuals.len(), &measured);
        println!(
            "generation {}, {} individuals x {} cases, means of an individual:",
            report.generation, report.individuals, report.cases
        );
        for e in &report.executors {
            let mean = e.mean_s;
            println!(
                "  {:<17} {:9.3} ms ({:.3} lowering, {:.3} compiling, {:.3} executing), {:6.1} times the walker's speed",
                e.executor,
                mean.together * 1e3,
                mean.lower * 1e3,
                mean.compile * 1e3,
                mean.execute * 1e3,
                e.times_walker.unwrap_or(f64::NAN)
            );
        }
    }
}
