//! What several test programs share: executors, generators of images and individuals, comparison of answers.
//! Generators know nothing of what is right; the tests compare.

#![allow(dead_code, reason = "every test program uses a part of it")]

use std::sync::Arc;

use image::GrayImage;
use vsonar::exec::auto::AutoExecutor;
use vsonar::exec::batch::{BatchExecutor, Vectors};
use vsonar::exec::cranelift::{CraneliftExecutor, Shape};
use vsonar::exec::reference::ReferenceExecutor;
use vsonar::exec::tree::TreeExecutor;
use vsonar::exec::{Candidate, Executor};
use vsonar::ir::generate::Random;
use vsonar::tree::{self, CreateSettings, Creator, CrossoverSettings, Individual, subtree_crossover};
use vsonar::vision::{CaseSet, Lane, WindowSums};

/// Every executor, the judge first; the batch interpreter with every width that this machine has.
pub(crate) fn executors() -> Vec<Box<dyn Executor>> {
    let mut all: Vec<Box<dyn Executor>> = vec![
        Box::new(TreeExecutor),
        Box::new(ReferenceExecutor),
        Box::new(CraneliftExecutor::new(Shape::Scalar).expect("this machine has a back end")),
        Box::new(CraneliftExecutor::new(Shape::Lanes4).expect("this machine has a back end")),
    ];
    all.push(Box::new(AutoExecutor::new()));
    for vectors in Vectors::ALL.into_iter().filter(|v| v.is_available()) {
        all.push(Box::new(BatchExecutor::new(vectors).expect("it is available")));
    }
    all
}

/// The answers of one individual on all cases.
pub(crate) fn answers(executor: &dyn Executor, individual: &Individual, cases: &CaseSet) -> Vec<f32> {
    let mut out = vec![f32::from_bits(0x7fc0_dead); cases.len()];
    let candidate = Candidate::new(individual, cases.width(), cases.height());
    let mut worker = executor.worker().expect("a worker can be made");
    worker
        .answers(&candidate, cases, &mut out)
        .unwrap_or_else(|fault| panic!("{} on {individual}: {fault}", executor.name()));
    out
}

/// Equal bits, or both NaN.
pub(crate) fn same(a: f32, b: f32) -> bool {
    a.to_bits() == b.to_bits() || a.is_nan() && b.is_nan()
}

/// A case set over some images with these (image, column) pairs.
pub(crate) fn case_set(images: &[GrayImage], lanes: &[(usize, u32)]) -> CaseSet {
    let sums = images.iter().map(|image| Arc::new(WindowSums::new(image))).collect();
    let lanes = lanes.iter().map(|&(image, column)| Lane { image: image as u32, column }).collect();
    CaseSet::new(sums, lanes).expect("the images are of one size and the columns inside")
}

/// A random image: noise, blocks, gradients, flat, or the extremes.
pub(crate) fn image(random: &mut Random, width: u32, height: u32) -> GrayImage {
    let kind = random.below(5);
    let seed = random.bits();
    let mut pixel = Random::new(seed);
    let base = pixel.below(256) as u32;
    let mut out = GrayImage::from_fn(width, height, |x, y| {
        let value = match kind {
            0 => pixel.below(256) as u32,
            1 => base,
            2 => (x * 3 + y * 5 + base) % 256,
            3 => 255 * ((x / 3 + y / 2) % 2),
            _ => base / 2 + pixel.below(20) as u32,
        };
        image::Luma([value as u8])
    });
    for _ in 0..pixel.below(6) {
        let (x0, y0) = (pixel.below(width as usize) as u32, pixel.below(height as usize) as u32);
        let (w, h, value) = (1 + pixel.below(12) as u32, 1 + pixel.below(12) as u32, pixel.below(256) as u8);
        for y in y0..(y0 + h).min(height) {
            for x in x0..(x0 + w).min(width) {
                out.put_pixel(x, y, image::Luma([value]));
            }
        }
    }
    out
}

/// Individuals as evolution makes them: created, and crossed a few times so that they grow and mix.
pub(crate) fn individuals(seed: u64, count: usize) -> Vec<Individual> {
    let settings = CreateSettings { plain_column_probability: 0.5, ..CreateSettings::default() };
    let creator = Creator::new(&settings).expect("the settings are sound");
    let mut random = tree::Random::stream(seed, 0, 0);
    let mut out: Vec<Individual> = (0..count).map(|_| creator.individual(&mut random)).collect();
    for _ in 0..count {
        let (i, j) = (random.index(count), random.index(count));
        let [a, b] = subtree_crossover(&out[i], &out[j], &CrossoverSettings::default(), &mut random);
        (out[i], out[j]) = (a.individual, b.individual);
    }
    out
}
