//! The C form gives the reference evaluator's bits, whatever compiles it.

use std::path::Path;

use vsonar::camera::Camera;
use vsonar::dataset::Dataset;
use vsonar::export::{Provenance, Request, Symbol};
use vsonar::ir::generate::{self, Random as Small};
use vsonar::ir::{Direction, Op, Operand, Program, Rect, Span, opt, reference};
use vsonar::lower::lower;
use vsonar::vision::WindowSums;

use crate::common;
use crate::harness::{Images, Sample};
use crate::tools::{Compiler, folder, has, run};

const SEED: u64 = 41_000;
const SIZES: [(u32, u32); 5] = [(16, 16), (17, 70), (33, 21), (40, 24), (19, 65)];

/// A camera like that of the paper's robot.
pub(crate) const CAMERA: Camera = Camera { height: 0.6, pitch: 51.0, field_of_view: 90.0, distortion: -0.1 };

fn request(symbol: String, program: Program, kind: usize) -> Request {
    Request {
        symbol: Symbol::new(&symbol).expect("an identifier"),
        provenance: Provenance { program: program.to_string(), ..Provenance::default() },
        program,
        camera: (!kind.is_multiple_of(3)).then_some(CAMERA),
        median: kind % 3 == 2,
    }
}

/// How many programs of each kind: written by the generator, and lowered from individuals.
const COUNT: usize = 100;

/// Programs, of which at most one in six gives the same answer in all columns.
fn programs(images: &[Images; 5]) -> Vec<(String, Program)> {
    let sums: Vec<Vec<WindowSums>> =
        images.iter().map(|set| set.images.iter().map(WindowSums::new).collect()).collect();
    let choose = |drawn: &mut dyn Iterator<Item = (String, Program)>| {
        let (mut chosen, mut flat) = (Vec::new(), 0);
        for (i, (about, program)) in drawn.enumerate() {
            let (optimised, width) = (opt::optimise(&program), SIZES[i % SIZES.len()].0);
            let columns = (0..width).step_by(3);
            let lanes = columns.flat_map(|x| sums[i % SIZES.len()].iter().map(move |sums| (sums, x)));
            let mut answers = lanes.map(|(sums, x)| reference::answer(&optimised, sums, x as f32));
            let first = answers.next().expect("there are columns");
            if answers.all(|answer| common::same(answer, first)) {
                flat += 1;
                if flat > COUNT / 6 {
                    continue;
                }
            }
            chosen.push((about, program));
            if chosen.len() == COUNT {
                break;
            }
        }
        chosen
    };
    let sizes = |i: usize| SIZES[i % SIZES.len()];
    let mut generated = (0..10 * COUNT).map(|i| {
        let seed = SEED + i as u64;
        (format!("program of seed {seed}"), generate::program(seed, sizes(i).0, sizes(i).1, 10 + i % 40))
    });
    let mut lowered = common::individuals(SEED, 10 * COUNT).into_iter().enumerate().map(|(i, individual)| {
        let (width, height) = sizes(i);
        (format!("individual {i} of seed {SEED}: {individual}"), lower(&individual, width, height))
    });
    [choose(&mut generated), choose(&mut lowered)].concat()
}

/// Of every program the optimised form, and of half of them the form before the optimiser.
pub(crate) fn samples() -> [Sample; 2] {
    let mut random = Small::new(SEED);
    let images = SIZES.map(|(width, height)| {
        let images = (0..3).map(|_| common::image(&mut random, width, height)).collect();
        Images { width, height, images }
    });
    let (mut plain, mut optimised) = (Vec::new(), Vec::new());
    for (i, (about, program)) in programs(&images).into_iter().enumerate() {
        optimised.push((about.clone(), request(format!("p{i}"), opt::optimise(&program), i)));
        if i % 2 == 0 {
            plain.push((about, request(format!("u{i}"), program, i)));
        }
    }
    [optimised, plain].map(|requests| Sample { requests, images: images.to_vec(), column_step: 1 })
}

const ARM: Compiler = Compiler {
    command: "arm-linux-gnueabihf-gcc",
    options: &["-O2", "-Wall", "-Wextra", "-Werror"],
    emulator: &["qemu-arm", "-L", "/usr/arm-linux-gnueabihf"],
};
/// Every processor of this kind multiplies and adds in one instruction, where it is let.
const ARM64: Compiler = Compiler {
    command: "aarch64-linux-gnu-gcc",
    options: &["-O3", "-ffp-contract=fast", "-Wall", "-Wextra", "-Werror"],
    emulator: &["qemu-aarch64", "-L", "/usr/aarch64-linux-gnu"],
};
/// Programs before the optimiser may compare a value with itself, of which compilers warn.
const OPTIMISING: Compiler = Compiler::native("gcc", &["-O3", "-march=native"]);
const FAST: Compiler =
    Compiler::native("gcc", &["-O3", "-march=native", "-ffp-contract=fast", "-Wall", "-Wextra", "-Werror"]);
const QUICK: [Compiler; 6] = [
    Compiler::native("gcc", &["-O0"]),
    Compiler::native("clang", &["-O0"]),
    Compiler::native("tcc", &[]),
    Compiler::native("gcc", &["-O2", "-Wall", "-Wextra", "-Werror"]),
    FAST,
    ARM,
];
const CLANG_FAST: Compiler =
    Compiler::native("clang", &["-O3", "-march=native", "-Wall", "-Wextra", "-Werror"]);
/// These take their time over programs before the optimiser, and are spared them.
const SLOW: [Compiler; 5] = [
    ARM64,
    Compiler::native("clang", &["-O2", "-Wall", "-Wextra", "-Werror"]),
    CLANG_FAST,
    Compiler::native("gcc", &["-O1", "-fsanitize=address,undefined", "-fno-sanitize-recover=all"]),
    Compiler::native("clang", &["-O1", "-fsanitize=address,undefined", "-fno-sanitize-recover=all"]),
];

/// What keeps to the letter of the standard; the others compile in their own language mode.
const STRICT: [&str; 6] = ["-fsyntax-only", "-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Werror"];

#[test]
fn the_source_keeps_to_the_standard() {
    let [optimised, _] = samples();
    let files = optimised.write(folder("strict"), 1);
    for compiler in ["gcc", "clang"].into_iter().filter(|compiler| has(compiler, &["--version"])) {
        run(std::process::Command::new(compiler).args(STRICT).arg(files.folder.join("unit0.c")));
    }
}

#[test]
fn compiled_c_gives_the_reference_bits() {
    let [optimised, plain] = samples();
    covers([&optimised, &plain]);
    check("optimised", &optimised, &[&QUICK[..], &SLOW].concat());
    check("plain", &plain, &[QUICK[1], QUICK[2], OPTIMISING]);
}

/// Checks that everything there is occurs.
fn covers(samples: [&Sample; 2]) {
    let programs = || samples.into_iter().flat_map(|s| &s.requests).map(|(_, request)| &request.program);
    let loops = || programs().flat_map(Program::loops);
    for op in Op::ALL.iter().filter(|op| **op != Op::ToBits) {
        let found = loops().any(|l| l.body().insts().iter().any(|inst| inst.op() == *op));
        assert!(found, "`{}` does not occur", op.name());
    }
    for operand in Operand::all() {
        assert!(loops().any(|l| l.operands().contains(&operand)), "`{}` does not occur", operand.name());
    }
    for rect in Rect::all() {
        assert!(loops().any(|l| l.rect() == rect && !l.operands().is_empty()), "{rect} does not occur");
    }
    for (direction, span) in [Direction::Up, Direction::Down].iter().zip([Span::All, Span::Last]) {
        assert!(loops().any(|l| l.direction() == *direction && l.span() == span));
    }
    assert!(loops().any(|l| l.break_if().is_some() && l.direction() == Direction::Up));
}

fn check(name: &str, sample: &Sample, compilers: &[Compiler]) {
    let expected = check_values(name, sample, compilers, 8);
    let rows = |i: usize| sample.rows(i, &expected[i]);
    let varied =
        (0..expected.len()).filter(|&i| rows(i).iter().any(|v| !common::same(*v, rows(i)[0]))).count();
    let finite = expected.iter().flatten().filter(|v| v.is_finite()).count();
    let all = expected.iter().flatten().count();
    println!("{name}: {all} values, {finite} of them finite, {varied} detectors whose answers vary");
    assert!(all > 5_000 && 2 * finite > all && 4 * varied > 3 * expected.len(), "the sample says little");
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
    check_values("fmrb", &fmrb(), &[FAST, CLANG_FAST, ARM, ARM64], 1);
}
