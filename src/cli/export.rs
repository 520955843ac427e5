//! `vsonar export`: a program as native code, C source and what goes with them.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;

use clap::ValueEnum;
use serde::Serialize;
use vsonar::camera::Camera;
use vsonar::export::native::{NativeError, Object, Target};
use vsonar::export::{self, MEDIAN, Request, Symbol};
use vsonar::ir::{opt, text};
use vsonar::support::bounded::Bounded;

use super::executor::with_stack;
use super::program::{self, Loaded, size};
use super::{CliError, interrupt, output};
use vsonar::support::printable::ShownPath as _;

const EXAMPLES: &str = "\
Examples:
  vsonar export best.gp --out detector --name front
  vsonar export best.gp --out detector --camera camera.toml --median 3
  vsonar export best.gp --out arm --target aarch64-unknown-linux-gnu
  vsonar export best.gp --out mcu --emit c,header       for a microcontroller
  cc robot.c -Idetector detector/libfront.a -o robot

Targets: x86_64 (levels v1, v2, v3), aarch64, riscv64gc (generic, v) and s390x, each as in aarch64-unknown-linux-gnu; \
x86_64 and aarch64 also for Apple's systems, x86_64 for Windows. For any other processor there is the C source.";

/// Turn a program into files that a robot's own program links or loads
///
/// Writes native code of the whole detector, from raw camera pixels to rows, as object file, static and shared
/// library, the same as one C99 source file, a C header, and a Python module. None of them needs a library, a heap or
/// Rust. With a camera (see `vsonar calibrate`) they give distances as well.
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    /// The program, .gp or .vir; or a run folder, for its best one
    program: PathBuf,
    /// Folder for the files; made if need be
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Machine to compile for [default: this one]
    #[arg(long, value_name = "TRIPLE")]
    target: Option<String>,
    /// How much of its instruction set to use; `native` is all that this machine has [default: the least]
    #[arg(long, value_name = "LEVEL")]
    cpu: Option<String>,
    /// What to write, with commas between [default: all; without shared and python for another machine]
    #[arg(long, value_name = "KINDS", value_enum, value_delimiter = ',')]
    emit: Vec<Kind>,
    /// What the names of the exported functions begin with [default: the file's name]
    #[arg(long, value_name = "SYMBOL")]
    name: Option<String>,
    /// The camera, as written by `vsonar calibrate`; without it there are rows but no distances
    #[arg(long, value_name = "FILE")]
    camera: Option<PathBuf>,
    /// Take distances from the median of the rows of 3 frames; 1 takes each frame by itself
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = median, requires = "camera")]
    median: u32,
    /// Size of the camera's images [default: that of the images it was evolved on, else 320x240]
    #[arg(long, value_name = "WxH", value_parser = size)]
    size: Option<(u32, u32)>,
    /// Linker for the shared library [default: one that is installed]
    #[arg(long, value_name = "PROGRAM")]
    linker: Option<PathBuf>,
    /// Replace files that are there; killed while they take their places it leaves some of them out, never a mixture
    #[arg(long)]
    force: bool,
    /// Print nothing
    #[arg(long, conflicts_with = "json")]
    quiet: bool,
    /// Print what was written as JSON
    #[arg(long)]
    json: bool,
}

/// What can be written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Kind {
    /// Object file, NAME.o
    Obj,
    /// Static library, libNAME.a
    Static,
    /// Shared library, libNAME.so
    Shared,
    /// C99 source, NAME.c
    C,
    /// C and C++ header, NAME.h
    Header,
    /// Python module that loads the shared library, NAME.py
    Python,
    /// The compiler's own form, NAME.vir
    Ir,
}

impl Kind {
    const NATIVE: [Kind; 3] = [Kind::Obj, Kind::Static, Kind::Shared];

    /// The file's name.
    fn file(self, symbol: &Symbol, target: &Target) -> String {
        match (self, target.is_windows()) {
            (Kind::Obj, false) => format!("{symbol}.o"),
            (Kind::Obj, true) => format!("{symbol}.obj"),
            (Kind::Static, false) => format!("lib{symbol}.a"),
            // The import library of a DLL would be called NAME.lib.
            (Kind::Static, true) => format!("{symbol}_static.lib"),
            (Kind::Shared, _) => export::shared::file_name(symbol, target),
            (Kind::C, _) => format!("{symbol}.c"),
            (Kind::Header, _) => format!("{symbol}.h"),
            (Kind::Python, _) => format!("{symbol}.py"),
            (Kind::Ir, _) => format!("{symbol}.vir"),
        }
    }
}

fn median(text: &str) -> Result<u32, String> {
    match text.parse() {
        Ok(frames) if frames == 1 || frames == MEDIAN => Ok(frames),
        _ => Err(format!("take 1 or {MEDIAN} frames")),
    }
}

/// What was written, for programs.
#[derive(Serialize)]
struct Summary {
    name: String,
    width: u32,
    height: u32,
    ranges: bool,
    median: u32,
    target: String,
    cpu: &'static str,
    stack_bytes: Option<usize>,
    folder: PathBuf,
    files: Vec<FileSummary>,
}

#[derive(Serialize)]
struct FileSummary {
    name: String,
    bytes: usize,
}

/// Exports the program.
pub(crate) fn run(args: Args) -> Result<(), CliError> {
    let target = Target::new(args.target.as_deref(), args.cpu.as_deref())
        .map_err(|error| CliError::Usage(error.to_string()))?;
    let kinds = kinds(&args, &target);
    let request = with_stack(|| request(&args))??;
    let native = kinds.iter().any(|kind| Kind::NATIVE.contains(kind));
    let object = if native { Some(object(&request, &target)?) } else { None };
    let stack = object.as_ref().map(|object| object.stack);
    let mut files = Vec::new();
    for &kind in &kinds {
        let bytes = content(kind, &args, &request, &target, object.as_ref())?;
        files.push((kind.file(&request.symbol, &target), bytes));
    }
    if !args.force {
        refuse_mixture(&args.out, &kinds, &request, &target)?;
    }
    // From here on Ctrl-C waits until the files are in their places.
    let stop = interrupt::stop_flag()?;
    output::write_files(&args.out, &files, args.force)?;
    if stop.load(Ordering::Relaxed) {
        return Err(CliError::Interrupted(format!("{}: all is written", args.out.shown())));
    }
    if args.quiet {
        return Ok(());
    }
    let summary = Summary {
        name: request.symbol.to_string(),
        width: request.program.width(),
        height: request.program.height(),
        ranges: request.camera.is_some(),
        median: args.median,
        target: target.triple(),
        cpu: target.cpu(),
        stack_bytes: stack,
        folder: args.out.clone(),
        files: files
            .iter()
            .map(|(name, bytes)| FileSummary { name: name.clone(), bytes: bytes.len() })
            .collect(),
    };
    if args.json {
        output::print_json(&summary)
    } else {
        output::print(&table(&summary, &kinds, &request, &target))
    }
}

/// The object file.
fn object(request: &Request, target: &Target) -> Result<Object, CliError> {
    Object::compile(request, target).map_err(|error| {
        let remedy = match &error {
            NativeError::TooLong { .. } => {
                "; `--emit c,header` exports it as C source, which C compilers take long over, least at -O1; \
                 `vsonar run` interprets it"
            }
            NativeError::Compile(_) | NativeError::Call { .. } => {
                "; `--emit c,header` exports it as C source"
            }
            NativeError::Target(_) | NativeError::Memory(_) | NativeError::Stack { .. } => "",
        };
        CliError::Failed(format!("{error}{remedy}"))
    })
}

/// What to write, in the order of the list, each once.
fn kinds(args: &Args, target: &Target) -> Vec<Kind> {
    let all = Kind::value_variants().iter().copied();
    let loads = |kind: &Kind| !matches!(kind, Kind::Shared | Kind::Python);
    if args.emit.is_empty() {
        return all.filter(|kind| target.is_host() || loads(kind)).collect();
    }
    all.filter(|kind| args.emit.contains(kind)).collect()
}

fn request(args: &Args) -> Result<Request, CliError> {
    let symbol = symbol(args)?;
    let file = program::file(&args.program)?;
    let loaded = Loaded::load(&file)?;
    let (size, provenance) = (loaded.size_for(&file, args.size)?, loaded.provenance());
    provenance.check_size(size).map_err(|other| {
        CliError::Usage(format!(
            "--size: {} {other}; give it such images, or, if it is to look at others all the same, remove that comment \
             from the file",
            file.shown()
        ))
    })?;
    let camera = args.camera.as_deref().map(Camera::load).transpose()?;
    if let (Some(camera), Some(path)) = (&camera, &args.camera) {
        camera
            .check(size.0, size.1)
            .map_err(|error| CliError::Failed(format!("{}: {error}", path.shown())))?;
    }
    let program = opt::optimise(&loaded.lowered(size));
    Ok(Request { symbol, program, provenance, camera, median: args.median > 1 })
}

/// The prefix asked for, or one out of the file's name.
fn symbol(args: &Args) -> Result<Symbol, CliError> {
    if let Some(name) = &args.name {
        return Symbol::new(name).map_err(|error| CliError::Usage(format!("--name: {error}")));
    }
    let stem = args.program.file_stem().unwrap_or_default().to_string_lossy();
    let name: String = stem.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
    Symbol::new(&name).map_err(|error| {
        CliError::Usage(format!("--name is needed, for the file's name does not do: {error}"))
    })
}

fn content(
    kind: Kind,
    args: &Args,
    request: &Request,
    target: &Target,
    object: Option<&Object>,
) -> Result<Vec<u8>, CliError> {
    let code = || -> &[u8] { object.map_or(&[], |object| &object.bytes) };
    Ok(match kind {
        Kind::Obj => code().to_vec(),
        Kind::Static => export::archive::archive(request.symbol.as_str(), code(), target)?,
        Kind::Shared => {
            let exports: &[&str] = if request.camera.is_some() {
                &["detect", "ranges", "reset", "info"]
            } else {
                &["detect", "info"]
            };
            export::shared::link(&request.symbol, code(), target, args.linker.as_deref(), exports)?
        }
        Kind::C => export::c::source(request).into_bytes(),
        Kind::Header => export::header::header(request, object.map(|object| object.stack)).into_bytes(),
        Kind::Python => export::python::python(request).into_bytes(),
        Kind::Ir => text::print(&request.program).into_bytes(),
    })
}

/// Refuses to write beside files of the same name that are of another program, camera or median.
fn refuse_mixture(folder: &Path, kinds: &[Kind], request: &Request, target: &Target) -> Result<(), CliError> {
    for kind in Kind::value_variants().iter().filter(|kind| !kinds.contains(kind)) {
        let path = folder.join(kind.file(&request.symbol, target));
        // What cannot be read is not of an export.
        if PART.bytes(&path).is_ok_and(|there| !belongs(*kind, &there, request)) {
            return Err(CliError::Failed(format!(
                "{}: is of another program or was exported in another way, and what is asked for would not go with it; export \
                 it along (`--emit`), choose another `--out` or `--name`, or leave it there with `--force`",
                path.shown()
            )));
        }
    }
    Ok(())
}

/// Reads far more than any exported file has.
const PART: Bounded = Bounded::to(256 << 20);

/// Whether a file is what this request would be written as: a text to the letter, and of native code the program inside.
fn belongs(kind: Kind, there: &[u8], request: &Request) -> bool {
    match kind {
        Kind::C => there == export::c::source(request).as_bytes(),
        Kind::Python => there == export::python::python(request).as_bytes(),
        Kind::Ir => there == text::print(&request.program).as_bytes(),
        Kind::Header => {
            // How much stack native code takes only who makes it knows.
            let text = String::from_utf8_lossy(there);
            let stack =
                text.split("_STACK_BYTES ").skip(1).find_map(|rest| rest.split(' ').next()?.parse().ok());
            text == export::header::header(request, stack)
        }
        Kind::Obj | Kind::Static | Kind::Shared => {
            let program = request.provenance.program.as_bytes();
            program.is_empty() || there.windows(program.len()).any(|part| part == program)
        }
    }
}

/// Programs of more instructions take a C compiler several seconds at `-O2`.
const LONG_FOR_C: usize = 4000;

fn table(summary: &Summary, kinds: &[Kind], request: &Request, target: &Target) -> String {
    let mut out = format!("{}: images of {}x{} pixels", summary.name, summary.width, summary.height);
    match (summary.ranges, summary.median) {
        (false, _) => out.push_str(", rows"),
        (true, 1) => out.push_str(", rows and distances"),
        (true, frames) => {
            let _ = write!(out, ", rows, and distances from the median of {frames} frames");
        }
    }
    if let Some(stack) = summary.stack_bytes {
        let stack = output::grouped(stack as u64);
        let _ = write!(out, "; {} ({}), {stack} bytes of stack", summary.target, summary.cpu);
    }
    out.push('\n');
    for file in &summary.files {
        let path = summary.folder.join(&file.name);
        let _ = writeln!(out, "  {:>9}  {}", output::grouped(file.bytes as u64), path.shown());
    }
    let folder = output::shell_word(&summary.folder);
    // What links for another machine has another name.
    let compiler = if target.is_host() { "cc" } else { "CC" };
    let library = |kind| kinds.contains(&kind) && kinds.contains(&Kind::Header);
    if library(Kind::Static) {
        let _ = writeln!(
            out,
            "{compiler} robot.c -I{folder} {folder}/{} -o robot",
            Kind::Static.file(&request.symbol, target)
        );
    } else if library(Kind::C) {
        // What a C compiler takes for long functions grows faster than they do, but less so at the lower level.
        let level = if request.program.len() > LONG_FOR_C { 1 } else { 2 };
        let name = &request.symbol;
        let _ = writeln!(out, "{compiler} -O{level} robot.c -I{folder} {folder}/{name}.c -o robot");
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_have_names_of_their_own() {
        for triple in export::native::KNOWN {
            let target = Target::new(Some(triple), None).expect("known");
            let symbol = Symbol::new("x").expect("a symbol");
            let mut names: Vec<String> =
                Kind::value_variants().iter().map(|k| k.file(&symbol, &target)).collect();
            names.sort();
            names.dedup();
            assert_eq!(names.len(), Kind::value_variants().len());
        }
    }
}
