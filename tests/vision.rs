//! Window averages, strips and arenas against a second, naive implementation of the image operators.

use std::sync::Arc;

use image::{GrayImage, Luma};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use vsonar::ir::{Moment, Operand, Rect, WindowAt, Windows};
use vsonar::vision::{CaseSet, CaseSetError, LANES, Lane, WindowSums, arena_len, strip_len};

/// The operators once more, one pixel at a time, by name and straight from their definitions.
struct Naive {
    image: GrayImage,
    /// By operator, then by row, then by column.
    values: Vec<Vec<Vec<u128>>>,
}

const NAMES: [&str; 8] = [
    "raw",
    "median",
    "median-corner",
    "gradient",
    "moravec-horizontal",
    "moravec-vertical",
    "moravec-slash",
    "moravec-backslash",
];

impl Naive {
    fn new(image: &GrayImage) -> Naive {
        let mut naive = Naive { image: image.clone(), values: Vec::new() };
        let (width, height) = (i64::from(image.width()), i64::from(image.height()));
        for name in NAMES {
            let row = |y| (0..width).map(|x| naive.value(name, x, y)).collect();
            let plane = (0..height).map(row).collect();
            naive.values.push(plane);
        }
        naive
    }

    fn pixel(&self, x: i64, y: i64) -> i64 {
        let x = x.clamp(0, i64::from(self.image.width()) - 1);
        let y = y.clamp(0, i64::from(self.image.height()) - 1);
        self.image.get_pixel(x as u32, y as u32).0[0].into()
    }

    fn value(&self, name: &str, x: i64, y: i64) -> u128 {
        let here = self.pixel(x, y);
        let mut around: Vec<i64> = (-1..=1)
            .flat_map(|dy| (-1..=1).map(move |dx| (dx, dy)))
            .map(|(dx, dy)| self.pixel(x + dx, y + dy))
            .collect();
        around.sort();
        let median = around[4];
        let squared = |dx, dy| (here - self.pixel(x + dx, y + dy)).pow(2);
        let value = match name {
            "raw" => here,
            "median" => {
                let nearer = (around[8] - median).min(median - around[0]);
                let kept: Vec<i64> = around.into_iter().filter(|v| (v - median).abs() <= nearer).collect();
                if kept.len() % 2 == 1 { kept[kept.len() / 2] } else { kept[kept.len() / 2 - 1] }
            }
            "median-corner" => (here - median).abs(),
            "gradient" => {
                let (mut gx, mut gy) = (0, 0);
                for (i, weight) in [(-1, 1), (0, 2), (1, 1)] {
                    gx += weight * (self.pixel(x + 1, y + i) - self.pixel(x - 1, y + i));
                    gy += weight * (self.pixel(x + i, y + 1) - self.pixel(x + i, y - 1));
                }
                ((gx * gx + gy * gy) as f64).sqrt().round() as i64
            }
            "moravec-horizontal" => squared(1, 0),
            "moravec-vertical" => squared(0, 1),
            "moravec-slash" => squared(1, -1),
            "moravec-backslash" => squared(1, 1),
            other => panic!("no operator {other}"),
        };
        u128::try_from(value).expect("no operator is negative")
    }

    fn average(&self, at: WindowAt) -> f32 {
        let plane = &self.values[NAMES.iter().position(|n| *n == at.operand.operator.name()).expect("known")];
        let (w, h) = (at.rect.width(), at.rect.height());
        let (x0, y0) = (at.x - (w - 1) / 2, at.y - (h - 1) / 2);
        let mut sum = 0u128;
        for row in &plane[y0 as usize..(y0 + h) as usize] {
            for value in &row[x0 as usize..(x0 + w) as usize] {
                sum += if at.operand.moment == Moment::MeanSquare { value * value } else { *value };
            }
        }
        sum as f32 / (w * h) as f32
    }
}

fn noise(seed: u64, width: u32, height: u32) -> GrayImage {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    GrayImage::from_fn(width, height, |_, _| Luma([rng.random_range(0..=255u32) as u8]))
}

/// Noise, few-valued noise (ties in the medians), flat images, and a checkerboard (the largest differences).
fn pictures(width: u32, height: u32) -> Vec<(String, GrayImage)> {
    let mut all = Vec::new();
    for seed in [1, 2] {
        all.push((format!("noise, seed {seed}"), noise(seed, width, height)));
    }
    let mut few = noise(3, width, height);
    few.pixels_mut().for_each(|p| p.0[0] = [0, 1, 2, 255][usize::from(p.0[0] % 4)]);
    all.push(("four values, seed 3".into(), few));
    let mut steps = noise(4, width, height);
    steps
        .enumerate_pixels_mut()
        .for_each(|(x, y, p)| p.0[0] = (p.0[0] % 8).wrapping_add((x * 5 + y * 3) as u8));
    all.push(("noisy ramp, seed 4".into(), steps));
    all.push(("all 0".into(), GrayImage::from_pixel(width, height, Luma([0]))));
    all.push(("all 255".into(), GrayImage::from_pixel(width, height, Luma([255]))));
    let board = GrayImage::from_fn(width, height, |x, y| Luma([if (x + y) % 2 == 0 { 0 } else { 255 }]));
    all.push(("checkerboard".into(), board));
    let columns = GrayImage::from_fn(width, height, |x, _| Luma([if x % 2 == 0 { 0 } else { 255 }]));
    all.push(("vertical stripes".into(), columns));
    all
}

fn check(name: &str, sums: &WindowSums, naive: &Naive, at: WindowAt) {
    let (got, expected) = (sums.average(at), naive.average(at));
    assert_eq!(
        got.to_bits(),
        expected.to_bits(),
        "{name}: {} {} at ({}, {}): {got}, brute force {expected}",
        at.operand.name(),
        at.rect,
        at.x,
        at.y
    );
}

#[test]
fn averages_are_those_of_brute_force() {
    for (width, height) in [(16, 16), (17, 23), (64, 48)] {
        for (name, image) in pictures(width, height) {
            let (sums, naive) = (WindowSums::new(&image), Naive::new(&image));
            assert_eq!((sums.width(), sums.height()), (width, height));
            for rect in Rect::all() {
                let ((x0, x1), (y0, y1)) = (rect.columns(width), rect.rows(height));
                for operand in Operand::all() {
                    for (x, y) in (x0..=x1).flat_map(|x| (y0..=y1).map(move |y| (x, y))) {
                        let name = format!("{width}x{height} {name}");
                        check(&name, &sums, &naive, WindowAt { operand, rect, x, y });
                    }
                }
            }
        }
    }
}

#[test]
fn averages_of_camera_sized_images_are_those_of_brute_force() {
    let (width, height) = (320, 240);
    for (number, (name, image)) in pictures(width, height).into_iter().enumerate() {
        let (sums, naive) = (WindowSums::new(&image), Naive::new(&image));
        let seed = 100 + number as u64;
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        for rect in Rect::all() {
            let ((x0, x1), (y0, y1)) = (rect.columns(width), rect.rows(height));
            for operand in Operand::all() {
                let corners = [(x0, y0), (x0, y1), (x1, y0), (x1, y1)];
                let random: Vec<_> =
                    (0..60).map(|_| (rng.random_range(x0..=x1), rng.random_range(y0..=y1))).collect();
                for (x, y) in corners.into_iter().chain(random) {
                    let name = format!("{name}, positions by seed {seed}");
                    check(&name, &sums, &naive, WindowAt { operand, rect, x, y });
                }
            }
        }
    }
}

#[test]
fn strips_are_averages() {
    let seed = 5;
    for (width, height) in [(16, 16), (40, 90), (24, 240)] {
        let sums = WindowSums::new(&noise(seed, width, height));
        for (rect, operand) in Rect::all().flat_map(|r| Operand::all().map(move |o| (r, o))) {
            let positions = rect.positions(height) as usize;
            let (lo, hi) = rect.columns(width);
            for (x, stride) in [(lo, 1), (hi, 1), ((lo + hi) / 2, 3)] {
                let mut out = vec![-1.0; positions * stride + 2];
                sums.strip(operand, rect, x, &mut out, stride);
                for (i, value) in out.iter().enumerate() {
                    let p = i / stride;
                    let expected = if i % stride == 0 && p < positions {
                        let y = rect.rows(height).0 + p as u32;
                        sums.average(WindowAt { operand, rect, x, y })
                    } else {
                        -1.0
                    };
                    assert_eq!(value.to_bits(), expected.to_bits(), "{} {rect} {x} {i}", operand.name());
                }
            }
        }
    }
}

/// 141 cases on three images, both edges among their columns.
fn case_set(seed: u64, width: u32, height: u32) -> CaseSet {
    let images = (0..3).map(|i| Arc::new(WindowSums::new(&noise(seed + i, width, height)))).collect();
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let lanes = (0..141u32)
        .map(|i| Lane {
            image: rng.random_range(0..3u32),
            column: match i {
                0 => 0,
                1 | 140 => width - 1,
                _ => rng.random_range(0..width),
            },
        })
        .collect();
    CaseSet::new(images, lanes).expect("a good set")
}

/// Holds the strips of `operands` in an arena against the averages one by one.
fn check_arena(
    cases: &CaseSet,
    group: usize,
    rect: Rect,
    columns: &[u32; LANES],
    operands: &[Operand],
    arena: &[f32],
) {
    let len = strip_len(rect, cases.height());
    for &operand in operands {
        for (p, row) in arena[usize::from(operand.index()) * len..][..len].chunks(LANES).enumerate() {
            for (l, value) in row.iter().enumerate() {
                let case = (group * LANES + l).min(cases.len() - 1);
                let y = rect.rows(cases.height()).0 + p as u32;
                let expected = cases.image(case).average(WindowAt { operand, rect, x: columns[l], y });
                assert_eq!(
                    value.to_bits(),
                    expected.to_bits(),
                    "{} {rect}, group {group}, lane {l}, position {p}",
                    operand.name()
                );
            }
        }
    }
}

#[test]
fn arenas_hold_the_columns_asked_for() {
    let (width, height) = (40, 90);
    let cases = case_set(11, width, height);
    assert_eq!((cases.width(), cases.height(), cases.len(), cases.groups()), (width, height, 141, 2));
    assert_eq!([0, 1].map(|g| cases.group_len(g)), [128, 13]);
    let all: Vec<Operand> = Operand::all().collect();
    for group in 0..2 {
        let asked: [u32; LANES] = std::array::from_fn(|l| cases.lanes()[(group * LANES + l).min(140)].column);
        assert_eq!(cases.x_obstacle(group), &asked.map(|c| c as f32));
        for rect in Rect::all() {
            let (lo, hi) = rect.columns(width);
            let arena = cases.x_obstacle_arena(rect, group);
            assert_eq!(arena.len(), arena_len(rect, height));
            assert_eq!(arena.as_ptr() as usize % 64, 0);
            check_arena(&cases, group, rect, &asked.map(|c| c.clamp(lo, hi)), &all, arena);
            assert_eq!(cases.x_obstacle_arena(rect, group).as_ptr(), arena.as_ptr());
        }
    }
}

#[test]
fn gathering_follows_each_lanes_column_and_touches_nothing_else() {
    let seed = 12;
    let (width, height) = (40, 161);
    let cases = case_set(seed, width, height);
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let all: Vec<Operand> = Operand::all().collect();
    for (group, rect) in (0..2).flat_map(|g| Rect::all().map(move |r| (g, r))) {
        let (lo, hi) = rect.columns(width);
        let columns: [u32; LANES] = std::array::from_fn(|_| rng.random_range(lo..=hi));
        let wanted: Vec<Operand> = all.iter().copied().filter(|_| rng.random_range(0..2u32) == 0).collect();
        let mut arena = vec![-7.0; arena_len(rect, height) + 5];
        let rows = 0..rect.positions(cases.height()) as usize;
        cases.gather(group, rect, &columns, &wanted, rows, &mut arena);
        check_arena(&cases, group, rect, &columns, &wanted, &arena);
        let len = strip_len(rect, height);
        for operand in all.iter().filter(|o| !wanted.contains(o)) {
            let strip = &arena[usize::from(operand.index()) * len..][..len];
            assert!(strip.iter().all(|v| *v == -7.0), "{} {rect}, seed {seed}", operand.name());
        }
        assert_eq!(arena[16 * len..], [-7.0; 5]);
    }
}

#[test]
fn gathering_some_positions_leaves_the_others() {
    let (width, height) = (40, 161);
    let cases = case_set(15, width, height);
    let (rect, operand) =
        (Rect::new(3, 6).expect("in the list"), Operand::from_name("median-sq").expect("one"));
    let columns: [u32; LANES] = std::array::from_fn(|l| 1 + (l as u32 * 7) % 38);
    let len = strip_len(rect, height);
    let strip = |arena: &[f32]| arena[usize::from(operand.index()) * len..][..len].to_vec();
    let mut whole = vec![0.0; arena_len(rect, height)];
    cases.gather(1, rect, &columns, &[operand], 0..156, &mut whole);
    for rows in [0..1, 155..156, 3..70, 90..156, 64..128, 5..5] {
        let mut part = vec![-7.0; arena_len(rect, height)];
        cases.gather(1, rect, &columns, &[operand], rows.clone(), &mut part);
        for (p, (got, want)) in strip(&part).chunks(LANES).zip(strip(&whole).chunks(LANES)).enumerate() {
            let expected = if rows.contains(&p) { want.to_vec() } else { vec![-7.0; LANES] };
            assert_eq!(got, expected, "position {p} of {rows:?}");
        }
    }
}

#[test]
fn strips_are_kept_once_they_are_asked_for_again() {
    let (width, height) = (40, 90);
    let cases = case_set(16, width, height);
    let rect = Rect::new(2, 4).expect("in the list");
    let all: Vec<Operand> = Operand::all().collect();
    let len = strip_len(rect, height);
    let columns = |shift: u32| std::array::from_fn::<u32, LANES, _>(|l| (l as u32 * 5 + shift) % 39);
    let ask = |shift, operands: &[Operand]| cases.cached_strips(1, rect, &columns(shift), operands);
    // Nothing is kept without a limit.
    assert!(ask(0, &all).is_none() && ask(0, &all).is_none());
    cases.keep_strips(64 << 20);
    assert!(ask(0, &all[..2]).is_none());
    // An operand that is new makes the caller gather once more.
    assert!(ask(0, &all[1..3]).is_none());
    let strips = ask(0, &all[1..3]).expect("asked for before");
    let mut arena = vec![0.0; arena_len(rect, height)];
    cases.gather(1, rect, &columns(0), &all[1..3], 0..87, &mut arena);
    for operand in &all[1..3] {
        assert_eq!(strips.strip(*operand)[..len], arena[usize::from(operand.index()) * len..][..len]);
    }
    assert!(strips.strip(all[0]).is_empty());
    // Other columns, other groups and other rectangles are others.
    assert!(ask(1, &all[1..2]).is_none());
    assert!(cases.cached_strips(0, rect, &columns(0), &all[1..2]).is_none());
    let other = Rect::new(2, 6).expect("in the list");
    assert!(cases.cached_strips(1, other, &columns(0), &all[1..2]).is_none());
}

#[test]
fn strips_are_forgotten_for_others() {
    let cases = case_set(17, 40, 90);
    let rect = Rect::new(2, 2).expect("in the list");
    let raw = [Operand::from_name("raw").expect("one")];
    // Room for a few of 46 kB.
    cases.keep_strips(800 << 10);
    let ask = |x: u32| cases.cached_strips(0, rect, &[x; LANES], &raw);
    let kept = |x: u32| (0..2).any(|_| ask(x).is_some());
    assert!(kept(0));
    let first = ask(0).expect("still there");
    let value = first.strip(raw[0])[17];
    (1..39).for_each(|x| assert!(kept(x)));
    assert!(ask(0).is_none(), "38 others of 46 kB came since, but there is room for 400 kB");
    // What is in use stays as it is.
    assert_eq!(first.strip(raw[0])[17], value);
}

#[test]
fn the_memory_foretold_is_what_arenas_take() {
    let cases = case_set(14, 40, 90);
    let all = (0..cases.groups()).flat_map(|group| Rect::all().map(move |rect| (group, rect)));
    let taken: usize = all.map(|(group, rect)| size_of_val(cases.x_obstacle_arena(rect, group))).sum();
    assert_eq!(CaseSet::arenas_memory_needed(cases.len(), 90), taken as u64);
}

#[test]
fn threads_share_one_arena() {
    let cases = case_set(13, 64, 48);
    let addresses: Vec<Vec<usize>> = std::thread::scope(|scope| {
        let work = || {
            let address = |r| cases.x_obstacle_arena(r, 1).as_ptr() as usize;
            Rect::all().map(address).collect::<Vec<_>>()
        };
        let threads: Vec<_> = (0..4).map(|_| scope.spawn(work)).collect();
        threads.into_iter().map(|t| t.join().expect("no panic")).collect()
    });
    assert!(addresses.iter().all(|a| *a == addresses[0]));
}

#[test]
fn faulty_sets_are_refused() {
    let image = |w, h| Arc::new(WindowSums::new(&GrayImage::new(w, h)));
    let lane = |image, column| Lane { image, column };
    let error = |images, lanes| CaseSet::new(images, lanes).expect_err("a faulty set");
    assert_eq!(error(vec![], vec![]), CaseSetError::NoImages);
    let sizes = error(vec![image(20, 16), image(20, 16), image(16, 20)], vec![]);
    assert_eq!(
        sizes.to_string(),
        "image 2 has 16x20 pixels but image 0 has 20x16; all images of a set must have one size"
    );
    let missing = error(vec![image(16, 16)], vec![lane(0, 15), lane(1, 0)]);
    assert_eq!(missing.to_string(), "case 1 is of image 1, but there are only 1 images");
    let outside = error(vec![image(16, 16)], vec![lane(0, 16)]);
    assert_eq!(outside.to_string(), "case 0 asks for column 16, but columns are 0 to 15");
    let empty = CaseSet::new(vec![image(16, 16)], vec![]).expect("no cases are a set too");
    assert!(empty.is_empty());
    assert_eq!(empty.groups(), 0);
}
