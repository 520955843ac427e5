//! Native code against the reference evaluator, on every level of this machine's instructions.

use image::GrayImage;
use vsonar_ir::generate::{self, Random};
use vsonar_ir::{Program, opt, reference};

use super::jit::JitRows;
use super::target::{KNOWN, Target};
use super::{NativeError, Object};
use crate::exec::MAX_COMPILED;
use crate::exec::cranelift::Shape;
use crate::export::{Provenance, Request, Symbol};
use crate::vision::WindowSums;

/// This machine's levels, each with the shapes it can run.
fn variants() -> Vec<(Target, Shape)> {
    let levels: &[&str] = if cfg!(target_arch = "x86_64") { &["v1", "v2", "v3"] } else { &["generic"] };
    let mut out = vec![(Target::host(), Shape::Scalar), (Target::native(), Shape::Lanes4)];
    for level in levels {
        let runs = *level != "v3" || std::arch::is_x86_feature_detected!("avx2");
        if runs {
            out.push((Target::new(None, Some(level)).expect("this machine's"), Shape::Lanes4));
        }
    }
    out
}

/// Noise, blocks, and the extremes.
fn image(random: &mut Random, width: u32, height: u32) -> GrayImage {
    let kind = random.below(4);
    GrayImage::from_fn(width, height, |x, y| {
        image::Luma([match kind {
            0 => random.below(256) as u8,
            1 => 255 * (random.below(2) as u8),
            2 => ((x * 7 + y * 13) % 256) as u8,
            _ => 128 + random.below(9) as u8,
        }])
    })
}

fn same(a: f32, b: f32) -> bool {
    a.to_bits() == b.to_bits() || a.is_nan() && b.is_nan()
}

/// Compares all columns, asked for in a shuffled order, in an image with something behind each row of pixels.
fn compare(program: &Program, image: &GrayImage, target: &Target, shape: Shape, seed: u64) {
    let (width, height) = image.dimensions();
    let code = JitRows::compile_for(program, target, shape)
        .unwrap_or_else(|e| panic!("seed {seed}: {e}\n{program}"));
    let stride = width as usize + seed as usize % 5;
    let mut luma = vec![(seed % 251) as u8; stride * (height as usize - 1) + width as usize];
    for (row, pixels) in image.rows().enumerate() {
        for (x, pixel) in pixels.enumerate() {
            luma[row * stride + x] = pixel.0[0];
        }
    }
    let columns: Vec<u32> = (0..width).map(|i| (i * 7 + seed as u32 % 13) % width).collect();
    let mut rows = vec![f32::from_bits(0x7fc0_dead); columns.len()];
    assert_eq!(code.run(&luma, stride, &columns, &mut rows), 0);
    let sums = WindowSums::new(image);
    for (&column, &row) in columns.iter().zip(&rows) {
        let expected = reference::answer(program, &sums, column as f32);
        assert!(
            same(row, expected),
            "seed {seed}, {target} {shape:?}, column {column}: {row:?}, not {expected:?}\n{program}"
        );
    }
}

#[test]
fn native_code_gives_the_reference_s_bits() {
    let variants = variants();
    for seed in 0..150 {
        let random = &mut Random::new(seed);
        let (width, height) = (16 + random.below(30) as u32, 16 + random.below(100) as u32);
        let program = generate::program(seed, width, height, 30);
        let program = if seed % 3 == 0 { program } else { opt::optimise(&program) };
        let image = image(random, width, height);
        for (target, shape) in &variants {
            compare(&program, &image, target, *shape, seed);
        }
    }
}

#[test]
#[should_panic(expected = "the image is all there")]
fn a_stride_whose_product_overflows_is_refused() {
    let program = generate::program(1, 17, 16, 30);
    let code = JitRows::compile_for(&program, &Target::host(), Shape::Scalar).expect("compiles");
    // Fifteen times this wraps to a few bytes.
    let stride = usize::MAX / 15 + 1;
    code.run(&[0; 64], stride, &[0], &mut [0.0]);
}

fn request(program: Program) -> Request {
    let symbol = Symbol::new("lengthy").expect("a symbol");
    Request { symbol, program, provenance: Provenance::default(), camera: None, median: false }
}

/// A program of so many additions, each of which takes the one before.
fn chain(additions: usize) -> Program {
    let mut text = "vir 1\nimage 16x16\nloop 2 up 2x2\ncolumn\n  v0 = x-obstacle\n  result v0\nbody\n  varying\n    v0 = y\n"
        .to_string();
    (1..=additions).for_each(|reg| text.push_str(&format!("    v{reg} = add v{} v0\n", reg - 1)));
    text.push_str(&format!("  next a v{additions}\n"));
    vsonar_ir::text::parse(&text).expect("a program")
}

#[test]
fn long_programs_are_made_for_every_target() {
    let additions = 3_000;
    let varied = (0..).map(|seed| generate::program(seed, 40, 24, 3_000)).find(|p| p.len() > 2_500);
    let (varied, chain) = (request(varied.expect("some seed gives a long one")), request(chain(additions)));
    for triple in KNOWN {
        let target = Target::new(Some(triple), None).expect("known");
        let object = |request| Object::compile(request, &target).unwrap_or_else(|e| panic!("{target}: {e}"));
        object(&varied);
        // No processor adds in fewer than two bytes.
        assert!(object(&chain).bytes.len() > 2 * additions, "{target}");
    }
}

#[test]
fn what_is_too_long_for_an_object_is_an_error() {
    let request = request(chain(MAX_COMPILED));
    let instructions = request.program.len();
    let refused = Object::compile(&request, &Target::host()).map(|object| object.bytes.len());
    assert_eq!(refused, Err(NativeError::TooLong { instructions }));
}
