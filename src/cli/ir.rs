//! `vsonar ir`: what the compiler makes of a program.

use std::path::PathBuf;

use clap::ValueEnum;
use vsonar::exec::cranelift::{self, Shape};
use vsonar::ir::{opt, text};

use super::executor::with_stack;
use super::program::{Loaded, file, size};
use super::{CliError, output};

const EXAMPLES: &str = "\
Examples:
  vsonar ir best.gp                      the optimised program
  vsonar ir best.gp --stage lowered      before the optimiser
  vsonar ir best.gp --stage asm          the machine code
  vsonar ir best.gp > best.vir && vsonar ir best.vir --stage clif";

/// Show what the compiler makes of a program
///
/// Reads a program as evolved (.gp), or the compiler's own text form (.vir).
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    /// The program, .gp or .vir; or a run folder, for its best one
    program: PathBuf,
    /// How far to compile
    #[arg(long, value_name = "STAGE", value_enum, default_value_t = Stage::Optimised)]
    stage: Stage,
    /// Size of the images it is compiled for; a .vir file states its own [default: that of the images it was evolved on,
    /// else 320x240]
    #[arg(long, value_name = "WxH", value_parser = size)]
    size: Option<(u32, u32)>,
    /// Which form of native code, for clif and asm
    #[arg(long, value_name = "NAME", value_enum, default_value_t = Native::Cranelift)]
    executor: Native,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Stage {
    /// The program as it is written, in the compiler's form
    Lowered,
    /// After the optimiser: what is run
    Optimised,
    /// The input of the code generator Cranelift
    Clif,
    /// Machine code of this machine
    Asm,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Native {
    /// Four fitness cases at a time
    Cranelift,
    /// One case at a time
    CraneliftScalar,
}

/// Prints the program at the stage asked for.
pub(crate) fn run(args: Args) -> Result<(), CliError> {
    let text = with_stack(|| listing(&args))??;
    output::print_listing(&text)
}

fn listing(args: &Args) -> Result<String, CliError> {
    let file = file(&args.program)?;
    let loaded = Loaded::load(&file)?;
    let size = loaded.size_for(&file, args.size)?;
    let lowered = loaded.lowered(size);
    if args.stage == Stage::Lowered {
        return Ok(text::print(&lowered));
    }
    let optimised = opt::optimise(&lowered);
    let shape = match args.executor {
        Native::Cranelift => Shape::Lanes4,
        Native::CraneliftScalar => Shape::Scalar,
    };
    Ok(match args.stage {
        Stage::Lowered | Stage::Optimised => text::print(&optimised),
        Stage::Clif => cranelift::clif(&optimised, shape)?,
        Stage::Asm => cranelift::asm(&optimised, shape)?,
    })
}
