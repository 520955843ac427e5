//! The robot in the loop: a detector sees, a controller steers, a body drives through the office.
//!
//! The published detectors were tried on a robot: rows became distances by the camera's geometry, and an algorithm that
//! had been written for sonar avoided what was near. Here the same is done in the synthetic [`Office`], ten frames a
//! second, until the robot hits something:
//!
//! ```text
//! Office --picture--> SequenceDetector --rows--> Ground --ranges--> Wander --speeds--> Robot --place--> Office
//!     \-----------------------ranges (sonar), true rows (truth)------^
//! ```
//!
//! [`wander`] is the controller, for real robots too; [`robot`] the body; [`source`], [`sonar`] and [`flow`] are where ranges
//! come from; [`run`] is a run from a start to its end; [`map`] and [`video`] show it.
//!
//! What the simulation leaves out: slip, so that odometry is exact; what a command takes to get to the wheels; a robot
//! that nods when it brakes. A detector's answer is there when the frame is.
//!
//! ```
//! use std::sync::atomic::AtomicBool;
//! use vsonar::drive::run::{Settings, drive};
//! use vsonar::drive::sonar::Sonar;
//! use vsonar::world::office::{Kind, Office};
//!
//! let office = Office::new(Kind::Fmrb, 1);
//! let settings = Settings { seconds: 5.0, ..Settings::default() };
//! let run = drive(&office, &mut Sonar::new(1), &settings, 0, &AtomicBool::new(false), |_| Ok(()))?;
//! assert!(run.is_some_and(|run| run.metres > 0.1));
//! # Ok::<(), vsonar::drive::run::DriveError>(())
//! ```
//!
//! [`Office`]: crate::world::office::Office

pub mod accuracy;
mod around;
pub mod flow;
pub mod map;
pub mod published;
pub mod robot;
pub mod run;
pub mod sonar;
pub mod source;
pub mod summary;
pub mod video;
pub mod wander;
