//! The synthetic offices: the same on every machine, their labels true to the geometry, their sets as the paper tells.

mod people;
mod plans;
mod sets;
mod views;
