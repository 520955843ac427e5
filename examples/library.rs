//! The library from end to end: load data, evolve, evaluate, write the program down, compile it, call it.
//!
//! `cargo run --release --example library [DATA]`, DATA being a folder with `labels.csv` and images; without it,
//! the built-in corridor serves.

use std::error::Error;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use vsonar::dataset::{Constants, Dataset};
use vsonar::detector::{CompiledDetector, Detector};
use vsonar::evolve::{Evolution, Settings};
use vsonar::exec::auto::AutoExecutor;

fn main() -> Result<(), Box<dyn Error>> {
    let data = match std::env::args_os().nth(1) {
        Some(folder) => Dataset::load(folder)?,
        None => vsonar::world::default_dataset(1),
    };
    let floor = Constants::learn(&data, vsonar::dataset::TOLERANCE).score(&data);
    println!(
        "{}: {} cases, best constant per column {:.1} %",
        data.name(),
        data.cases().len(),
        100.0 * floor.per_column_share()
    );

    let settings = Settings { population: 500, generations: 11, ..Settings::default_preset() };
    let executor = Arc::new(AutoExecutor::new());
    let mut run = Evolution::new(&data, settings, executor, 0)?;
    run.run(&AtomicBool::new(false), |record| {
        println!("generation {:2}: best {:.1} %", record.generation, 100.0 * record.best_fitness);
    })?;
    let Some(summary) = run.summary(None)? else { return Ok(()) };
    println!("{} of {} cases\n{}", summary.train.correct, summary.train.cases, summary.best);

    let detector = CompiledDetector::compile_individual(&summary.best, data.width(), data.height())?;
    let columns = data.columns();
    let mut rows = vec![0.0; columns.len()];
    let image = &data.images()[0];
    detector.detect(&image.pixels, &columns, &mut rows)?;
    println!("{}: columns {columns:?}, rows {rows:?}", image.name);
    Ok(())
}
