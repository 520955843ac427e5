//! What people type: flags, default data, the terminal. Everything else is the library's.
//!
//! One file for each command; a command is an `Args` and a `run` that returns what went wrong, and only
//! [`main`] turns that into a message and an exit code.

mod against;
mod bench;
mod bench_population;
mod bench_tables;
mod bench_view;
mod calibrate;
mod cases;
mod completions;
mod curve;
mod data;
mod data_args;
mod data_import;
mod data_import_names;
mod data_import_values;
mod data_import_write;
mod data_resize;
mod data_video;
mod drive;
mod drive_scores;
mod drive_sensor;
mod drive_tables;
mod drive_view;
mod error;
mod eval;
mod eval_cases;
mod evolve;
mod evolve_runs;
mod evolve_watch;
mod exclusive;
mod executor;
mod explain;
mod export;
mod ffmpeg;
mod gray_note;
mod interrupt;
mod ir;
mod jobs;
mod label;
mod large;
mod live;
mod memory;
mod new_folder;
mod notices;
mod output;
mod part;
mod program;
mod progress;
mod recording;
mod report;
mod report_data;
mod run;
mod run_columns;
mod run_input;
mod run_latency;
mod run_output;
mod run_worker;
mod runs_report;
mod sensitivity;
mod serve;
mod settings;
mod show;
mod show_drawing;
mod show_video;
mod source;
mod source_folder;
mod source_made;
mod source_parts;
mod summary;
mod sweep;
mod synth;
mod table;
mod terminal;
mod tuning;
mod untested;
mod view;
mod wrap;

use std::io::{self, Write};
use std::process::ExitCode;

use clap::error::ErrorKind;
use clap::{Parser, Subcommand};

pub(crate) use error::CliError;

const EXAMPLES: &str = "\
Examples:
  vsonar evolve                                 a first run, on built-in images of an office
  vsonar evolve --data photos                   evolve on images and labels of your own
  vsonar sweep settings.toml                    compare settings over many seeds
  vsonar label photos                           make labels of your own, in the browser
  vsonar eval runs/photos-seed-1/best.gp --data photos
  vsonar show runs/photos-seed-1/best.gp --data photos --out pictures
  vsonar explain runs/photos-seed-1             what the program does, in readable form
  vsonar report runs/photos-seed-1              all of it as one page
  vsonar run runs/photos-seed-1/best.gp --input photos    its answers to a camera's frames
  vsonar drive runs/photos-seed-1/best.gp       on a simulated robot, until it hits something
  vsonar evolve --help                          the flags of a command, with examples

A data folder holds `labels.csv` (header `image,x,y`; y is the row, counted from the top, of the lowest pixel of \
column x that is not ground) and the images it names. Exit codes: 0 done, 1 failed, 2 wrong usage, 130 Ctrl-C.";

/// Evolves programs that see obstacles: given a gray camera image and a column, a program finds the lowest pixel
/// that is not ground. Programs are bred by genetic programming and run as native code.
#[derive(Parser)]
#[command(name = "vsonar", version, after_help = EXAMPLES, max_term_width = 110, arg_required_else_help = true)]
pub(crate) struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    Evolve(Box<evolve::Args>),
    Sweep(Box<sweep::Args>),
    Eval(Box<eval::Args>),
    Show(show::Args),
    Explain(Box<explain::Args>),
    Report(Box<report::Args>),
    Run(Box<run::Args>),
    Drive(drive::Args),
    Ir(ir::Args),
    Export(Box<export::Args>),
    Bench(Box<bench::Args>),
    Calibrate(calibrate::Args),
    Label(label::Args),
    Data(data::Args),
    Synth(synth::Args),
    Completions(completions::Args),
}

/// The help for a command that was given nothing.
const SHORT_HELP: ErrorKind = ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand;

/// Runs the command that was typed.
pub(crate) fn main() -> ExitCode {
    interrupt::limits_are_errors();
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        // Help and version are clap's own words; a complaint may repeat what came from outside.
        Err(error) if error.use_stderr() && error.kind() != SHORT_HELP => {
            terminal::say(&error.render().to_string());
            return ExitCode::from(u8::try_from(error.exit_code()).unwrap_or(2));
        }
        Err(error) => {
            let printed = error.print().and_then(|()| io::stdout().flush());
            return match printed {
                // What was asked for, help or the version; a complaint that cannot be written has its exit code.
                Err(failed) if !error.use_stderr() => CliError::output(&failed).report(),
                _ => ExitCode::from(u8::try_from(error.exit_code()).unwrap_or(2)),
            };
        }
    };
    let done = match cli.command {
        Command::Evolve(args) => evolve::run(*args),
        Command::Sweep(args) => sweep::run(*args),
        Command::Eval(args) => eval::run(*args),
        Command::Show(args) => show::run(args),
        Command::Explain(args) => explain::run(*args),
        Command::Report(args) => report::run(*args),
        Command::Run(args) => run::run(*args),
        Command::Drive(args) => drive::run(args),
        Command::Ir(args) => ir::run(args),
        Command::Export(args) => export::run(*args),
        Command::Bench(args) => bench::run(*args),
        Command::Calibrate(args) => calibrate::run(args),
        Command::Label(args) => label::run(args),
        Command::Data(args) => data::run(args),
        Command::Synth(args) => synth::run(args),
        Command::Completions(args) => completions::run(args),
    };
    notices::print();
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => error.report(),
    }
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;

    #[test]
    fn flags_are_consistent() {
        Cli::command().debug_assert();
    }
}
