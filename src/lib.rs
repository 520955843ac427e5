//! Evolves visual obstacle detectors by genetic programming, and compiles them to native code.
//!
//! A detector takes a grayscale camera image and a column, and returns the row of the lowest non-ground pixel
//! in it: a "visual sonar" (Martin, *Evolving Visual Sonar: Depth From Monocular Images*, 2006).
//!
//! What flows through the library:
//!
//! ```text
//! images + labels --> operator planes --> strips of window averages --+
//!   (dataset, world)     (vision)             (vision)                 +--> executor --> answers --> fitness
//! individual --> lower --> IR program --> optimise --> interpreted, ---+     (exec)                  (evolve)
//!   (tree)                   (ir)           (ir::opt)    or compiled
//! ```
//!
//! From data to a compiled detector, in the library's terms:
//!
//! ```
//! use std::sync::{Arc, atomic::AtomicBool};
//! use vsonar::detector::{CompiledDetector, Detector};
//! use vsonar::evolve::{Evolution, Settings};
//! use vsonar::exec::auto::AutoExecutor;
//! use vsonar::world::Corridor;
//!
//! // Data: a folder with labels.csv (`Dataset::load`), or here a few small synthetic pictures.
//! let corridor = Corridor { width: 64, height: 48, ..Corridor::default() };
//! let (train, holdout) = (corridor.render(1, 4)?, corridor.render(2, 4)?);
//!
//! // A very small run, each program interpreted or compiled, whichever is done sooner.
//! let settings = Settings { population: 40, generations: 3, ..Settings::default_preset() };
//! let executor = Arc::new(AutoExecutor::new());
//! let mut run = Evolution::new(&train, settings, executor, 0)?;
//! run.run(&AtomicBool::new(false), |record| assert!(record.best_fitness <= 1.0))?;
//! let summary = run.summary(Some(&holdout))?.expect("generations were made");
//! assert!(summary.train.fitness > 0.0 && summary.holdout.is_some());
//!
//! // The winner as native code, called on a picture.
//! let detector = CompiledDetector::compile_individual(&summary.best, 64, 48)?;
//! let mut rows = [0.0; 3];
//! detector.detect(&holdout.images()[0].pixels, &[8, 32, 55], &mut rows)?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod baseline;
pub mod benchmark;
pub mod camera;
pub mod csv_table;
pub mod dataset;
pub mod detector;
pub mod drive;
pub mod evolve;
pub mod exec;
pub mod explain;
pub mod export;
pub mod frames;
pub mod label;
pub mod lower;
pub mod memory;
pub mod report;
pub mod statistics;
pub mod support;
pub mod tree;
pub mod vision;
pub mod watch;
pub mod web;
pub mod world;

/// The crate `image`, in the version whose types stand in signatures here.
///
/// ```
/// use vsonar::detector::{CompiledDetector, Detector};
/// use vsonar::image::{GrayImage, Luma};
///
/// let program = "(individual (iterate-up 3x3 x-obstacle (if-le gradient 50 read-a (prog2 (set-a y) break))))";
/// let detector = CompiledDetector::compile_individual(&program.parse()?, 64, 48)?;
/// // A bright wall ends at row 19; the floor below is dark.
/// let image = GrayImage::from_fn(64, 48, |_, y| Luma([if y < 20 { 200 } else { 40 }]));
/// let mut rows = [0.0; 2];
/// detector.detect(&image, &[20, 40], &mut rows)?;
/// assert_eq!(rows, [21.0; 2]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub use ::image;
pub use vsonar_ir as ir;
