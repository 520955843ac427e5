//! The examples for robots (`examples/robot`): built by what robots' programmers use, run on frames, and held against
//! the library, bit for bit.

mod c;
mod languages;
mod readme;
mod sample;
mod scan;
mod tools;
