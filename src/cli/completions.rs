//! `vsonar completions`: what a shell needs to complete commands and flags.

use clap::CommandFactory;
use clap_complete::Shell;

use super::{Cli, CliError, output};

const EXAMPLES: &str = "\
Examples:
  vsonar completions bash > ~/.local/share/bash-completion/completions/vsonar
  vsonar completions zsh > \"${fpath[1]}/_vsonar\"
  vsonar completions fish > ~/.config/fish/completions/vsonar.fish";

/// Print a completion script for a shell
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    /// The shell
    shell: Shell,
}

/// Prints the script.
pub(crate) fn run(args: Args) -> Result<(), CliError> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut Cli::command(), "vsonar", &mut script);
    output::print_listing(&String::from_utf8_lossy(&script))
}
