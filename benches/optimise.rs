//! What an individual costs before it runs, in an evolved population: lowering, optimising, and hashing the program
//! as the key of the evaluation cache. Prints quantiles over the individuals of generation 10.
//!
//! `cargo bench --bench optimise -- [SEED [DATA]]`, DATA being a folder with `labels.csv` and images; without it, the
//! built-in corridor serves.

use std::error::Error;
use std::hash::BuildHasher;
use std::hint::black_box;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

use rustc_hash::FxBuildHasher;
use vsonar::dataset::Dataset;
use vsonar::evolve::{Evolution, Preset, Settings};
use vsonar::exec::cranelift::{CraneliftExecutor, Shape};
use vsonar::ir::opt::Optimiser;
use vsonar::lower::lower;
use vsonar::tree::Individual;

/// How often each individual is taken; the fastest counts, as the others were disturbed.
const ROUNDS: usize = 15;

fn main() -> Result<(), Box<dyn Error>> {
    // Cargo passes `--bench`.
    let mut args = std::env::args().skip(1).filter(|arg| !arg.starts_with("--"));
    let seed = args.next().map_or(Ok(1), |seed| seed.parse())?;
    let data = match args.next() {
        Some(folder) => Dataset::load(folder)?,
        None => vsonar::world::default_dataset(1),
    };
    [Preset::Paper, Preset::Default].into_iter().try_for_each(|preset| measure(preset, seed, &data))
}

fn measure(preset: Preset, seed: u64, data: &Dataset) -> Result<(), Box<dyn Error>> {
    let settings = Settings { seed, generations: 11, ..Settings::preset(preset) };
    let executor = Arc::new(CraneliftExecutor::new(Shape::Lanes4)?);
    let mut run = Evolution::new(data, settings, executor, 0)?;
    run.run(&AtomicBool::new(false), |_| ())?;
    let Some(state) = run.state() else { return Ok(()) };
    let individuals: Vec<&Individual> = state.population.iter().map(|member| member.individual()).collect();

    let (width, height) = (data.width(), data.height());
    let mut optimiser = Optimiser::default();
    let mut fastest = vec![[f64::INFINITY; 4]; individuals.len()];
    let (mut before, mut after) = (0, 0);
    for round in 0..ROUNDS {
        // One after the other, as in a run: no individual finds its own traces in the processor.
        for (individual, fastest) in individuals.iter().zip(&mut fastest) {
            let start = Instant::now();
            let lowered = lower(black_box(individual), width, height);
            let lowering = start.elapsed().as_secs_f64();
            let program = black_box(optimiser.optimise(lowered));
            let optimising = start.elapsed().as_secs_f64();
            black_box(FxBuildHasher.hash_one(&program));
            let all = start.elapsed().as_secs_f64();
            let times = [lowering, optimising - lowering, all - optimising, all];
            fastest.iter_mut().zip(times).for_each(|(fastest, time)| *fastest = time.min(*fastest));
            if round == 0 {
                before += optimiser.live_operations();
                after += program.operations();
            }
        }
    }
    let count = individuals.len();
    println!(
        "{count} individuals of generation 10, {preset:?}, seed {seed}; {:.1} live operations before, {:.1} after, on average",
        before as f64 / count as f64,
        after as f64 / count as f64
    );
    println!("microseconds    median    mean    90 %    99 %");
    for (which, name) in ["lower", "optimise", "key", "together"].iter().enumerate() {
        let mut times: Vec<f64> = fastest.iter().map(|times| 1e6 * times[which]).collect();
        times.sort_unstable_by(f64::total_cmp);
        let quantile = |share: f64| times[((count - 1) as f64 * share) as usize];
        let mean = times.iter().sum::<f64>() / count as f64;
        println!("{name:<12}{:>10.2}{mean:>8.2}{:>8.2}{:>8.2}", quantile(0.5), quantile(0.9), quantile(0.99));
    }
    Ok(())
}
