//! Evolves visual obstacle detectors by genetic programming and compiles each of them to native code.
//!
//! A detector takes a grayscale camera image and a column, and returns the row of the lowest non-ground pixel
//! in it: a "visual sonar" (Martin, *Evolving Visual Sonar: Depth From Monocular Images*, 2006).

pub mod dataset;
pub mod detector;
pub mod evolve;
pub mod exec;
pub mod lower;
pub mod report;
pub mod tree;
pub mod vision;
pub mod world;

pub use vsonar_ir as ir;
