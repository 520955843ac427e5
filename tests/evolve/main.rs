//! The evolutionary run as a whole: that it repeats, survives interruption, and refuses what it must.

mod augmentation;
mod cache;
mod checkpoints;
mod collapse;
mod common;
mod determinism;
mod folders;
mod schemes;
mod settings;
mod statistics;
