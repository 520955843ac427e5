//! The `vsonar` command.

// Text for people goes through `cli::terminal`, which escapes what comes from outside.
#![warn(clippy::print_stdout, clippy::print_stderr)]

mod cli;

fn main() -> std::process::ExitCode {
    cli::main()
}
