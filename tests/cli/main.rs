//! The command as a user has it: started as a process, on small made-up data.

mod against;
mod bad_input;
mod bad_programs;
mod bench;
mod calibrate;
mod common;
mod drive;
mod eval;
mod evolve;
mod explain;
mod export;
mod export_faults;
mod help;
mod interruption;
mod kill;
mod live;
mod other;
mod parts;
mod report;
mod run;
mod runs;
mod show;
mod sweep;
mod sweep_faults;
mod synth;
mod watch;
