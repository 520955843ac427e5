//! What is computed before any program runs: operator planes, window sums, arenas of strips.
//!
//! The images are noise over a gradient, 320 x 240; no operator's cost depends on the content.

use std::hint::black_box;
use std::sync::Arc;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use image::{GrayImage, Luma};
use rayon::prelude::*;
use vsonar::ir::{Operand, Rect};
use vsonar::vision::{Arena, CaseSet, LANES, Lane, Planes, WindowSums, arena_len};

const WIDTH: u32 = 320;
const HEIGHT: u32 = 240;
/// As many images and cases as a data set of the method has.
const IMAGES: u32 = 85;
const CASES: u32 = 505;

fn picture(number: u32) -> GrayImage {
    let mut state = number.wrapping_mul(2_654_435_761) | 1;
    GrayImage::from_fn(WIDTH, HEIGHT, |_, y| {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        Luma([(y / 2 + (state >> 25)) as u8])
    })
}

fn cases() -> CaseSet {
    let images = (0..IMAGES).into_par_iter().map(|i| Arc::new(WindowSums::new(&picture(i)))).collect();
    let lanes = (0..CASES).map(|i| Lane { image: i % IMAGES, column: (i * 53) % WIDTH }).collect();
    CaseSet::new(images, lanes).expect("images of one size, columns inside")
}

fn one_image(c: &mut Criterion) {
    let image = picture(1);
    let planes = Planes::new(&image);
    let mut group = c.benchmark_group("image");
    group.throughput(Throughput::Elements(u64::from(WIDTH * HEIGHT)));
    group.bench_function("planes", |b| b.iter(|| Planes::new(black_box(&image))));
    group.bench_function("sums", |b| b.iter(|| WindowSums::from_planes(black_box(&planes))));
    group.bench_function("planes-and-sums", |b| b.iter(|| WindowSums::new(black_box(&image))));
    group.finish();
}

fn whole_set(c: &mut Criterion) {
    let images: Vec<GrayImage> = (0..IMAGES).map(picture).collect();
    let mut group = c.benchmark_group("set");
    group.sample_size(10);
    group.bench_function("85-images", |b| {
        b.iter(|| images.par_iter().map(WindowSums::new).collect::<Vec<_>>());
    });
    group.bench_function("19-arenas-of-505-cases", |b| {
        let cases = cases();
        let (images, lanes) = (cases.images().to_vec(), cases.lanes().to_vec());
        b.iter_batched(
            || CaseSet::new(images.clone(), lanes.clone()).expect("it was a set before"),
            |cases| {
                let work: Vec<_> =
                    Rect::all().flat_map(|rect| (0..cases.groups()).map(move |g| (rect, g))).collect();
                work.into_par_iter().for_each(|(rect, g)| {
                    black_box(cases.x_obstacle_arena(rect, g));
                });
                cases
            },
            criterion::BatchSize::PerIteration,
        );
    });
    group.finish();
}

fn gather(c: &mut Criterion) {
    let cases = cases();
    let mut group = c.benchmark_group("gather");
    // One element is one operand's strip of one lane.
    group.throughput(Throughput::Elements(LANES as u64));
    for (name, rect) in [("2x2", Rect::new(2, 2)), ("3x8", Rect::new(3, 8)), ("8x8", Rect::new(8, 8))] {
        let rect = rect.expect("in the list");
        let rows = 0..rect.positions(HEIGHT) as usize;
        let mut out = Arena::zeroed(arena_len(rect, HEIGHT));
        for operand in ["raw", "moravec-slash-sq"] {
            let operand = [Operand::from_name(operand).expect("an operand")];
            let (mut group_number, mut turn) = (0, 0u32);
            group.bench_function(format!("{name}/{}", operand[0].name()), |b| {
                b.iter(|| {
                    // Another group each time, as in a run, so that the tables come from memory.
                    group_number = (group_number + 1) % (cases.groups() - 1);
                    turn += 1;
                    let columns = std::array::from_fn(|l| 10 + (turn * 7 + l as u32 * 29) % 300);
                    cases.gather(group_number, rect, &columns, &operand, rows.clone(), &mut out);
                });
            });
        }
    }
    group.finish();
}

criterion_group!(benches, one_image, whole_set, gather);
criterion_main!(benches);
