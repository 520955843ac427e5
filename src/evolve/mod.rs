//! Evolution: a population of individuals, selected and bred generation after generation.
//!
//! ```text
//! settings + training data ─> initial generation ─> scores ─> selection ─> variation ─> evaluation ─┐
//!                                                      ^──────────── the next generation <────────────┘
//! ```
//!
//! [`Evolution`] is the run, [`Settings`] all that shapes it, [`RunFolder`] where it is recorded. A run is a
//! pure function of settings (the seed is one) and training data: the same with any executor, at any number of
//! threads, and however often it was interrupted and resumed.
//!
//! ```
//! use std::sync::Arc;
//! use std::sync::atomic::AtomicBool;
//!
//! use image::{GrayImage, Luma};
//! use vsonar::dataset::{Case, Dataset, NamedImage};
//! use vsonar::evolve::{Evolution, Settings, StopReason};
//! use vsonar::exec::tree::TreeExecutor;
//!
//! // Floor up to a wall, the foot of which is at row 8, 12 or 16.
//! let foot = |i| 8 + 4 * i;
//! let draw = |i| GrayImage::from_fn(24, 24, |_, y| Luma([if y > foot(i) { 60 } else { 200 }]));
//! let images = (0..3).map(|i| NamedImage { name: format!("{i}.png"), pixels: draw(i) }).collect();
//! let cases = (0..3).map(|i| Case { image: i, x: 12, y: foot(i as u32) }).collect();
//! let train = Dataset::new("steps", images, cases)?;
//!
//! let settings = Settings::from_toml("population = 20\ngenerations = 3\n[filter]\nmax_draws = 5", "example")?;
//! let mut run = Evolution::new(&train, settings, Arc::new(TreeExecutor), 1)?;
//! let mut lines = Vec::new();
//! let reason = run.run(&AtomicBool::new(false), |record| lines.push(record.best_fitness))?;
//! assert_eq!((reason, lines.len()), (StopReason::Finished, 3));
//! let summary = run.summary(None)?.expect("there are generations");
//! assert_eq!(summary.train.cases, 3);
//! assert_eq!(summary.train.fitness, lines.iter().copied().fold(0.0, f64::max));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod checkpoint;
pub mod fitness;
pub mod selection;

mod breed;
mod cache;
mod cases;
mod collapse;
mod consistency;
mod diversity;
mod evaluate;
mod folder;
mod hall_of_fame;
mod initial;
mod islands;
mod lexicase;
mod population;
mod programs;
mod progress;
mod rank;
mod record;
mod run;
mod settings;
mod settings_check;
mod settings_draft;
mod settings_table;
mod shared;
mod summary;
mod threads;
mod validation;

pub use checkpoint::{CheckpointError, State};
pub use collapse::{Collapse, Warning};
pub use consistency::Contradiction;
pub use diversity::HardestCase;
pub use evaluate::EvaluateError;
pub use fitness::{CaseBits, is_correct, shared_fitness, solvers};
pub use folder::{FolderError, Made, RunFolder};
pub use hall_of_fame::{Entry, EntryLine, HallOfFame};
pub use population::{Genotype, Member, Outcome};
pub use progress::Progress;
pub use rank::rank;
pub use record::{GenerationTiming, InitialDraws, Record};
pub use run::{Evolution, RunError, StopReason};
pub use selection::{Parsimony, SelectionKind};
pub use settings::{
    Augmentation, Breeding, Creation, Fault, Filter, Islands, Preset, Selection, Settings, SettingsError,
};
pub use settings_draft::Draft;
pub use shared::SharedSet;
pub use summary::{Score, Solved, Summary};

pub use crate::support::{durable::FileError, lock::Lock};
