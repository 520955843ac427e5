//! `vsonar ir`: what the compiler makes of a program.

use std::io::Read;
use std::path::{Path, PathBuf};

use clap::ValueEnum;
use vsonar::exec::cranelift::{self, Shape};
use vsonar::ir::{Program, opt, text};
use vsonar::tree::Individual;

use super::executor::with_stack;
use super::{CliError, output};

/// Far above the text of any program.
const MAX_BYTES: u64 = 64 << 20;

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
    /// The program, .gp or .vir
    program: PathBuf,
    /// How far to compile
    #[arg(long, value_name = "STAGE", value_enum, default_value_t = Stage::Optimised)]
    stage: Stage,
    /// Size of the images it is compiled for; a .vir file states its own [default: 320x240]
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

/// The size unless the flag says otherwise: that of the method's images.
const SIZE: (u32, u32) = (320, 240);

fn size(text: &str) -> Result<(u32, u32), String> {
    let sides = Program::MIN_SIDE..=Program::MAX_SIDE;
    let parsed = text.split_once('x').and_then(|(w, h)| Some((w.parse().ok()?, h.parse().ok()?)));
    let size = parsed.ok_or("write width and height in pixels, as in 320x240")?;
    if sides.contains(&size.0) && sides.contains(&size.1) {
        return Ok(size);
    }
    Err(format!("each side must have {} to {} pixels", sides.start(), sides.end()))
}

/// Prints the program at the stage asked for.
pub(crate) fn run(args: Args) -> Result<(), CliError> {
    let text = with_stack(|| listing(&args))??;
    output::print(&text)
}

fn listing(args: &Args) -> Result<String, CliError> {
    let lowered = lowered(&args.program, args.size)?;
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

fn lowered(path: &Path, size: Option<(u32, u32)>) -> Result<Program, CliError> {
    if path.extension().is_none_or(|e| e != "vir") {
        let individual = Individual::load(path)?;
        let (width, height) = size.unwrap_or(SIZE);
        return Ok(vsonar::lower::lower(&individual, width, height));
    }
    let mut source = String::new();
    std::fs::File::open(path)
        .and_then(|file| file.take(MAX_BYTES).read_to_string(&mut source))
        .map_err(|e| CliError::file(path, "read the program", &e))?;
    let program = text::parse(&source).map_err(|e| CliError::Failed(format!("{}: {e}", path.display())))?;
    match size {
        Some(size) if size != (program.width(), program.height()) => Err(CliError::Usage(format!(
            "--size: {} states its own image size, {}x{}; change it there",
            path.display(),
            program.width(),
            program.height()
        ))),
        _ => Ok(program),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes() {
        assert_eq!(size("64x48"), Ok((64, 48)));
        for wrong in ["64", "64x", "x48", "15x48", "64x1000000", "-64x48", "64x48x3", ""] {
            assert!(size(wrong).is_err(), "{wrong}");
        }
    }
}
