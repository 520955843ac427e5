//! Benchmarks: all executors on the same evolved individuals, taking turns.
//!
//! ```text
//! Evolution ─> fresh individuals of some generations ─> sample ─> measure ─> Report ─> table, JSON, plot
//! ```
//!
//! - [`evolve_fresh`] evolves a population and collects, of some generations, the individuals that an evaluation
//!   would have had to run. [`StoreKey`] has the text form in which they are kept, so that everyone measures the same.
//! - [`measure`] runs them on every executor, round after round, and makes sure that all give the same answers.
//! - [`GenerationReport`] and [`ScalingReport`] are medians and quartiles of that, and break-even points.
//! - [`svg`] and [`png()`] plot a [`Report`].
//!
//! ```
//! use std::sync::{Arc, atomic::AtomicBool};
//! use vsonar::benchmark::{GenerationReport, Plan, evolve_fresh, even_sample, measure};
//! use vsonar::evolve::{Evolution, Settings};
//! use vsonar::exec::{Executor, reference::ReferenceExecutor, tree::TreeExecutor};
//!
//! let data = vsonar::world::Corridor { width: 32, height: 32, ..Default::default() }.render(1, 2)?;
//! let settings = Settings { population: 20, ..Settings::paper() };
//! let mut run = Evolution::new(&data, settings, Arc::new(ReferenceExecutor), 1)?;
//! let stop = AtomicBool::new(false);
//! let fresh = evolve_fresh(&mut run, &[0, 1], &stop, |_| ())?.expect("nobody stops it");
//!
//! let executors: [Arc<dyn Executor>; 2] = [Arc::new(ReferenceExecutor), Arc::new(TreeExecutor)];
//! let sample = even_sample(&fresh[0].individuals, 5);
//! let plan = Plan { rounds: 1, ..Plan::default() };
//! let measured = measure(&sample, &data.case_set(), &executors, &plan, &stop, |_| ())?.expect("nobody stops it");
//! let report = GenerationReport::of(0, fresh[0].individuals.len(), &measured);
//! assert_eq!(report.executors.len(), 2);
//! assert_eq!(report.executors[1].times_walker, Some(1.0));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod break_even;
mod measure;
mod plot;
mod population;
mod raster;
mod report;
mod spread;
mod store;

pub use break_even::{BreakEven, Cost};
pub use measure::{BenchError, Measured, Plan, Runs, Step, Subject, Times, is_slow, measure};
pub use plot::{PlotError, PlotSeries, png, svg};
pub use population::{Fresh, FreshFilter, even_sample, evolve_fresh};
pub use report::{
    DataReport, ExecutorReport, GenerationReport, IndividualReport, Machine, Parts, PointExecutor,
    PointReport, Report, RoundTotals, ScalingReport, SettingsReport, VERSION,
};
pub use spread::Spread;
pub use store::{StoreError, StoreKey};
