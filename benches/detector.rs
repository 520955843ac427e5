//! What a frame costs: the published detector (`examples/fmrb.gp`), 320 x 240 pixels, twelve columns, from raw pixels
//! to rows, in every form it is exported in, taken in turns in one run.
//!
//! `cargo bench --bench detector [-- DATA]`, DATA being a folder with a data set of that size; without it the built-in
//! corridor serves. Beside the exported forms stands what the image operators of the whole image would cost (all
//! eight planes, and with their window sums, as evolution computes them). Instructions are counted by valgrind and, for
//! aarch64, in an emulator. Compilers and tools that are missing are left out.

use std::error::Error;
use std::fmt::Write as _;
use std::hint::black_box;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

use image::GrayImage;
use vsonar::dataset::Dataset;
use vsonar::detector::{CompiledDetector, Detector};
use vsonar::export::native::{Object, Target};
use vsonar::export::{Provenance, Request, Symbol, c, shared};
use vsonar::vision::{Planes, WindowSums};

/// As `NAME_detect`.
type Detect = unsafe extern "C" fn(*const u8, usize, usize, *const i32, usize, *mut f32) -> i32;

const COLUMNS: usize = 12;
/// Every form sees every image so often.
const ROUNDS: usize = 15;

fn main() -> Result<(), Box<dyn Error>> {
    // Cargo's own flags are not ours.
    let data = std::env::args().skip(1).find(|arg| !arg.starts_with('-'));
    let data = match data {
        Some(folder) => Dataset::load(folder)?,
        None => vsonar::world::default_dataset(1),
    };
    let (width, height) = (data.width(), data.height());
    let individual: vsonar::tree::Individual = include_str!("../examples/fmrb.gp").parse()?;
    let program = vsonar::ir::opt::optimise(&vsonar::lower::lower(&individual, width, height));
    let request = Request {
        symbol: Symbol::new("fmrb")?,
        provenance: Provenance::of_individual(&individual),
        program,
        camera: None,
        median: false,
    };
    let scratch = tempfile::tempdir()?;
    let images: Vec<&GrayImage> = data.images().iter().take(40).map(|image| &image.pixels).collect();
    let columns: Vec<i32> = (0..COLUMNS).map(|i| ((2 * i + 1) * width as usize / (2 * COLUMNS)) as i32).collect();

    let compiled = CompiledDetector::compile(&request.program)?;
    let unsigned: Vec<u32> = columns.iter().map(|c| c.cast_unsigned()).collect();
    let mut forms: Vec<(String, Box<dyn FnMut(&GrayImage, &mut [f32])>)> = vec![(
        "in process (CompiledDetector)".into(),
        Box::new(move |image, rows| compiled.detect(image, &unsigned, rows).expect("it fits")),
    )];
    let mut libraries = libraries(&request, scratch.path())?;
    for (name, path) in &libraries {
        // SAFETY: the library was made a moment ago, and has nothing that runs when it is loaded.
        let library = unsafe { libloading::Library::new(path) }?;
        let columns = columns.clone();
        forms.push((
            name.clone(),
            Box::new(move |image, rows| {
                // SAFETY: the symbol is of this type; the image has the detector's size and its rows have no gaps; there
                // are as many rows as columns.
                let code = unsafe {
                    let detect: libloading::Symbol<'_, Detect> = library.get(b"fmrb_detect").expect("exported");
                    let stride = image.width() as usize;
                    detect(image.as_ptr(), stride, 1, columns.as_ptr(), columns.len(), rows.as_mut_ptr())
                };
                assert_eq!(code, 0);
            }),
        ));
    }
    forms.push((
        "the eight operators of the whole image".into(),
        Box::new(|image, _| _ = black_box(Planes::new(image))),
    ));
    forms.push(("the same with window sums".into(), Box::new(|image, _| _ = black_box(WindowSums::new(image)))));

    let detectors = 1 + libraries.len();
    let mut times: Vec<Vec<f64>> = vec![Vec::new(); forms.len()];
    for _ in 0..ROUNDS {
        for image in &images {
            let mut answers = Vec::new();
            for (number, (form, times)) in forms.iter_mut().zip(&mut times).enumerate() {
                let mut rows = vec![0.0; COLUMNS];
                let start = Instant::now();
                form.1(image, &mut rows);
                times.push(1e6 * start.elapsed().as_secs_f64());
                if number < detectors {
                    answers.push(rows.iter().map(|row| row.to_bits()).collect::<Vec<u32>>());
                }
            }
            assert!(answers.iter().all(|rows| *rows == answers[0]), "the forms differ");
        }
    }
    println!(
        "{}: {} images of {width}x{height} pixels, {COLUMNS} columns, {ROUNDS} rounds; microseconds a frame",
        data.name(),
        images.len()
    );
    println!("{:44} {:>8} {:>8} {:>8} {:>13}", "", "best", "median", "95 %", "instructions");
    libraries.insert(0, (String::new(), PathBuf::new()));
    for (number, ((name, _), times)) in forms.iter().zip(&mut times).enumerate() {
        times.sort_unstable_by(f64::total_cmp);
        let at = |share: f64| times[((times.len() - 1) as f64 * share) as usize];
        let path = libraries.get(number).map(|(_, path)| path.as_path());
        let count = path.filter(|path| path.is_file()).and_then(|path| counted(path, images[0], &columns, scratch.path()));
        let count = count.map_or_else(String::new, |count| count.to_string());
        println!("{name:44} {:8.1} {:8.1} {:8.1} {count:>13}", at(0.0), at(0.5), at(0.95));
    }
    for (triple, compiler, emulator) in [
        ("aarch64-unknown-linux-gnu", "aarch64-linux-gnu-gcc", ["qemu-aarch64", "-L", "/usr/aarch64-linux-gnu"]),
        ("riscv64gc-unknown-linux-gnu", "riscv64-linux-gnu-gcc", ["qemu-riscv64", "-L", "/usr/riscv64-linux-gnu"]),
    ] {
        let target = Target::new(Some(triple), None)?;
        let object = scratch.path().join("cross.o");
        std::fs::write(&object, Object::compile(&request, &target)?.bytes)?;
        if let Some(count) = emulated(&object, compiler, &emulator, images[0], &columns, scratch.path()) {
            println!("{:71} {count:>13}", format!("object, {target}"));
        }
    }
    Ok(())
}

/// The exported forms as shared libraries.
fn libraries(request: &Request, folder: &Path) -> Result<Vec<(String, PathBuf)>, Box<dyn Error>> {
    let mut out = Vec::new();
    let levels: &[&str] = if cfg!(target_arch = "x86_64") { &["v1", "v2", "v3"] } else { &["generic"] };
    for level in levels.iter().chain(&["native"]) {
        let target = Target::new(None, Some(level))?;
        let object = Object::compile(request, &target)?;
        match shared::link(&request.symbol, &object.bytes, &target, None, &["detect", "info"]) {
            Ok(bytes) => {
                let path = folder.join(format!("{level}.so"));
                std::fs::write(&path, bytes)?;
                out.push((format!("object, {level}"), path));
            }
            Err(error) => eprintln!("left out: {error}"),
        }
    }
    let source = folder.join("fmrb.c");
    std::fs::write(&source, c::source(request))?;
    for (compiler, level) in [("gcc", "-O3"), ("gcc", "-O2"), ("clang", "-O3")] {
        let path = folder.join(format!("{compiler}{level}.so"));
        let flags = [level, "-march=native", "-shared", "-fPIC", "-o"];
        let done = Command::new(compiler).args(flags).arg(&path).arg(&source).status();
        if done.is_ok_and(|status| status.success()) {
            out.push((format!("C source, {compiler} {level} -march=native"), path));
        } else {
            eprintln!("left out: {compiler} does not compile here");
        }
    }
    Ok(out)
}

/// A program in C that looks at an image as often as its argument says.
fn driver(image: &GrayImage, columns: &[i32]) -> String {
    let mut out = String::from("#include <stdint.h>\n#include <stdlib.h>\nstatic const uint8_t luma[] = {");
    for pixel in image.as_raw() {
        let _ = write!(out, "{pixel},");
    }
    let columns: Vec<String> = columns.iter().map(ToString::to_string).collect();
    let _ = write!(
        out,
        "}};\nstatic const int32_t columns[] = {{{}}};\n\
         int fmrb_detect(const uint8_t *, size_t, size_t, const int32_t *, size_t, float *);\n\
         int main(int argc, char **argv) {{\n    float rows[{n}];\n    for (int i = atoi(argv[argc - 1]); i > 0; i--)\n\
         \x20       if (fmrb_detect(luma, {}, 1, columns, {n}, rows)) return 1;\n    return 0;\n}}\n",
        columns.join(","),
        image.width(),
        n = columns.len(),
    );
    out
}

/// Instructions of a call, by valgrind: those of two calls less those of one.
fn counted(library: &Path, image: &GrayImage, columns: &[i32], folder: &Path) -> Option<u64> {
    // Under the name by which the program looks for it.
    let named = folder.join("libfmrb.so");
    std::fs::copy(library, &named).ok()?;
    let program = built("gcc", &[&named], image, columns, folder)?;
    let count = |calls: &str| -> Option<u64> {
        let out = folder.join("callgrind.out");
        let done = Command::new("valgrind")
            .args(["--tool=callgrind", &format!("--callgrind-out-file={}", out.display())])
            .arg(&program)
            .arg(calls)
            .env("LD_LIBRARY_PATH", folder)
            .output()
            .ok()?;
        if !done.status.success() {
            return None;
        }
        let said = String::from_utf8_lossy(&done.stderr).into_owned();
        let total = said.lines().find_map(|line| line.split_once("Collected : "))?.1;
        total.trim().parse().ok()
    };
    Some(count("2")?.checked_sub(count("1")?)?)
}

/// Instructions of a call in an emulator that logs each.
fn emulated(
    object: &Path,
    compiler: &str,
    emulator: &[&str],
    image: &GrayImage,
    columns: &[i32],
    folder: &Path,
) -> Option<u64> {
    let program = built(compiler, &[object], image, columns, folder)?;
    let count = |calls: &str| -> Option<u64> {
        let log = folder.join("executed");
        let done = Command::new(emulator[0])
            .args(&emulator[1..])
            .args(["-singlestep", "-d", "exec,nochain", "-D"])
            .arg(&log)
            .arg(&program)
            .arg(calls)
            .status()
            .ok()?;
        let lines = std::fs::read(&log).ok()?.iter().filter(|&&byte| byte == b'\n').count();
        done.success().then_some(lines as u64)
    };
    count("2")?.checked_sub(count("1")?)
}

fn built(compiler: &str, detector: &[&Path], image: &GrayImage, columns: &[i32], folder: &Path) -> Option<PathBuf> {
    let (source, program) = (folder.join("driver.c"), folder.join("driver"));
    std::fs::write(&source, driver(image, columns)).ok()?;
    let mut command = Command::new(compiler);
    command.args(["-O1", "-o"]).arg(&program).arg(&source).args(detector);
    command.status().is_ok_and(|status| status.success()).then_some(program)
}
