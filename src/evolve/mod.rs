//! Evolution: a population of individuals, selected and bred generation after generation.
//!
//! ```text
//! settings + training data ─> initial generation ─> scores ─> tournaments ─> crossover ─> evaluation ─┐
//!                                                      ^──────────── the next generation <────────────┘
//! ```
//!
//! [`Evolution`] is the run, [`Settings`] all that shapes it, [`RunFolder`] where it is recorded. A run is a
//! pure function of settings (the seed is one) and training data: the same with any executor, at any number of
//! threads, and however often it was interrupted and resumed.

pub mod checkpoint;
pub mod fitness;
pub mod selection;

mod breed;
mod cache;
mod durable;
mod evaluate;
mod folder;
mod hall_of_fame;
mod initial;
mod lock;
mod population;
mod progress;
mod record;
mod run;
mod settings;
mod settings_check;

pub use checkpoint::{CheckpointError, State};
pub use durable::FileError;
pub use evaluate::EvaluateError;
pub use fitness::{CaseBits, is_correct, shared_fitness};
pub use folder::{FolderError, RunFolder};
pub use hall_of_fame::{Entry, EntryLine, HallOfFame};
pub use population::{Genotype, Member, Outcome};
pub use progress::Progress;
pub use record::{GenerationTiming, InitialDraws, Record};
pub use run::{Evolution, RunError, Score, StopReason, Summary};
pub use selection::SelectionKind;
pub use settings::{Breeding, Creation, Fault, Filter, Preset, Selection, Settings, SettingsError};
