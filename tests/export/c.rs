//! The C form gives the reference evaluator's bits, whatever compiles it.

use std::path::Path;

use vsonar::camera::Camera;
use vsonar::dataset::Dataset;
use vsonar::export::{Provenance, Request, Symbol};
use vsonar::ir::generate::{self, Random as Small};
use vsonar::ir::{Program, opt};
use vsonar::lower::lower;
use vsonar::tree::{CreateSettings, Creator, CrossoverSettings, Individual, Random, subtree_crossover};

use crate::common;
use crate::harness::{Images, Sample};
use crate::tools::{Compiler, folder, has};

const SEED: u64 = 41_000;
const SIZES: [(u32, u32); 5] = [(16, 16), (17, 70), (33, 21), (40, 24), (19, 65)];

/// A camera like that of the paper's robot.
pub(crate) const CAMERA: Camera = Camera { height: 0.6, pitch: 51.0, field_of_view: 90.0, distortion: -0.1 };

fn individuals(seed: u64, count: usize) -> Vec<Individual> {
    let settings = CreateSettings { plain_column_probability: 0.5, ..CreateSettings::default() };
    let creator = Creator::new(&settings).expect("the settings are sound");
    let mut random = Random::stream(seed, 0, 0);
    let mut out: Vec<Individual> = (0..count).map(|_| creator.individual(&mut random)).collect();
    for _ in 0..count {
        let (i, j) = (random.index(count), random.index(count));
        let [a, b] = subtree_crossover(&out[i], &out[j], &CrossoverSettings::default(), &mut random);
        (out[i], out[j]) = (a.individual, b.individual);
    }
    out
}

fn request(symbol: String, program: Program, kind: usize) -> Request {
    Request {
        symbol: Symbol::new(&symbol).expect("an identifier"),
        provenance: Provenance { program: program.to_string(), ..Provenance::default() },
        program,
        camera: (!kind.is_multiple_of(3)).then_some(CAMERA),
        median: kind % 3 == 2,
    }
}

/// Optimised programs: generated ones and lowered individuals; and half of them before the optimiser.
pub(crate) fn samples() -> [Sample; 2] {
    let mut plain = Vec::new();
    let mut optimised = Vec::new();
    let sizes = |i: usize| SIZES[i % SIZES.len()];
    let generated = (0..130).map(|i| {
        let seed = SEED + i as u64;
        (format!("program of seed {seed}"), generate::program(seed, sizes(i).0, sizes(i).1, 10 + i % 40))
    });
    let lowered = individuals(SEED, 70).into_iter().enumerate().map(|(i, individual)| {
        let (width, height) = sizes(i);
        (format!("individual {i} of seed {SEED}: {individual}"), lower(&individual, width, height))
    });
    for (i, (about, program)) in generated.chain(lowered).enumerate() {
        optimised.push((about.clone(), request(format!("p{i}"), opt::optimise(&program), i)));
        if i % 2 == 0 {
            plain.push((about, request(format!("u{i}"), program, i)));
        }
    }
    [optimised, plain].map(|requests| {
        let mut random = Small::new(SEED);
        let images = SIZES.map(|(width, height)| {
            let images = (0..4).map(|_| common::image(&mut random, width, height)).collect();
            Images { width, height, images }
        });
        Sample { requests, images: images.into(), column_step: 1 }
    })
}

const ARM: Compiler = Compiler {
    command: "arm-linux-gnueabihf-gcc",
    options: &["-O2", "-Wall", "-Wextra", "-Werror"],
    emulator: &["qemu-arm", "-L", "/usr/arm-linux-gnueabihf"],
};
/// Programs before the optimiser may compare a value with itself, of which compilers warn.
const OPTIMISING: Compiler = Compiler::native("gcc", &["-O3", "-march=native"]);
const STRICT: [Compiler; 3] = [
    Compiler::native("gcc", &["-O2", "-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Werror"]),
    Compiler::native("clang", &["-O2", "-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Werror"]),
    Compiler::native("gcc", &["-O3", "-march=native", "-Wall", "-Wextra", "-Werror"]),
];
/// Clang takes its time over sorting networks in vectors.
const SLOW: Compiler = Compiler::native("clang", &["-O3", "-march=native", "-Wall", "-Wextra", "-Werror"]);
const PLAIN: [Compiler; 3] =
    [Compiler::native("gcc", &["-O0"]), Compiler::native("clang", &["-O0"]), Compiler::native("tcc", &[])];
const SANITIZERS: [Compiler; 2] = [
    Compiler::native("gcc", &["-O1", "-g0", "-fsanitize=address,undefined", "-fno-sanitize-recover=all"]),
    Compiler::native("clang", &["-O1", "-fsanitize=address,undefined", "-fno-sanitize-recover=all"]),
];

#[test]
fn compiled_c_gives_the_reference_bits() {
    let [optimised, plain] = samples();
    check("optimised", &optimised, &[&PLAIN[..], &STRICT, &SANITIZERS, &[SLOW, ARM]].concat());
    check("plain", &plain, &[&PLAIN[1..], &[OPTIMISING]].concat());
}

fn check(name: &str, sample: &Sample, compilers: &[Compiler]) {
    let expected = check_values(name, sample, compilers, 8);
    let rows = |i: usize| sample.rows(i, &expected[i]);
    let varied =
        (0..expected.len()).filter(|&i| rows(i).iter().any(|v| !common::same(*v, rows(i)[0]))).count();
    let finite = expected.iter().flatten().filter(|v| v.is_finite()).count();
    let all = expected.iter().flatten().count();
    println!("{name}: {all} values, {finite} of them finite, {varied} detectors whose answers vary");
    assert!(all > 10_000 && 4 * finite > all && 3 * varied > expected.len(), "the sample says little");
}

/// What is expected and was found.
fn check_values(name: &str, sample: &Sample, compilers: &[Compiler], units: usize) -> Vec<Vec<f32>> {
    let expected = sample.expected();
    let files = sample.write(folder(name), units);
    for compiler in compilers.iter().filter(|c| c.is_there()) {
        let start = std::time::Instant::now();
        sample.compare(compiler, &expected, &files.run(compiler));
        if !compiler.options.iter().any(|option| option.starts_with("-fsanitize"))
            && has("nm", &["--version"])
        {
            files.check_symbols(compiler);
        }
        println!("{name}, {compiler}: {:.1} s", start.elapsed().as_secs_f64());
    }
    expected
}

/// The published detector on whole images: textures, and the real corridor where it is present.
pub(crate) fn fmrb() -> Sample {
    let root = std::env::var_os("VSONAR_DATA").map_or_else(
        || Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data"),
        std::path::PathBuf::from,
    );
    let mut random = Small::new(SEED);
    let mut images: Vec<_> = (0..3).map(|_| common::image(&mut random, 320, 240)).collect();
    let corridor = root.join("corridor");
    if corridor.is_dir() {
        let data = Dataset::load(&corridor).expect("the corridor is sound");
        images.extend(data.images().iter().map(|image| image.pixels.clone()));
    } else {
        eprintln!("skipped: {} is not there", corridor.display());
    }
    let text = include_str!("../../examples/fmrb.gp");
    let program = opt::optimise(&lower(&text.parse().expect("an individual"), 320, 240));
    let requests = vec![("fmrb".to_string(), request("fmrb".into(), program, 2))];
    let images = vec![Images { width: 320, height: 240, images }];
    Sample { requests, images, column_step: 29 }
}

#[test]
fn the_published_detector_sees_the_same() {
    check_values("fmrb", &fmrb(), &[STRICT[2], SLOW, ARM], 1);
}
