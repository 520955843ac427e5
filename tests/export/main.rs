//! Exported detectors: compiled by what robots' programmers use, run, and held against the reference evaluator.

mod c;
#[path = "../common/mod.rs"]
mod common;
mod harness;
mod interface;
mod native;
mod python;
mod tools;
