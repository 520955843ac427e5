use image::Luma;

use super::*;
use crate::dataset::{Case, NamedImage};

const WIDTH: u32 = 96;
const HEIGHT: u32 = 72;
const COLUMNS: [u32; 4] = [5, 33, 60, 90];

fn noise(x: u32, y: u32) -> u32 {
    let mixed = (x.wrapping_mul(0x9e37_79b9) ^ y.wrapping_mul(0x85eb_ca6b)).wrapping_mul(0xc2b2_ae35);
    mixed >> 16
}

/// Pictures of a drive: what is in column x of picture i below and above the foot of the wall, whose row is the label.
fn drive(
    pictures: u32,
    foot: impl Fn(u32, u32) -> u32,
    pixel: impl Fn(u32, u32, u32, bool) -> u8,
) -> Dataset {
    let image = |i| {
        let pixels = GrayImage::from_fn(WIDTH, HEIGHT, |x, y| Luma([pixel(i, x, y, y > foot(i, x))]));
        NamedImage { name: format!("drive_{i:02}.png"), pixels }
    };
    let case = |i| COLUMNS.map(|x| Case { image: i as usize, x, y: foot(i, x) });
    let cases = (0..pictures).flat_map(case).collect();
    Dataset::new("drive", (0..pictures).map(image).collect(), cases).expect("sound")
}

fn foot(i: u32, x: u32) -> u32 {
    (11 * i + x / 6) % 44 + 4
}

/// A floor of even gray below a wall with texture.
fn plain_floor() -> Dataset {
    drive(8, foot, |i, x, y, floor| if floor { 90 } else { 150 + (noise(x + 7 * i, y) % 60) as u8 })
}

fn correct(set: &Dataset, answers: &[f32], tolerance: f64) -> usize {
    let cases = set.cases().iter().zip(answers);
    cases.filter(|(case, row)| (f64::from(**row) - f64::from(case.y)).abs() <= tolerance).count()
}

#[test]
fn names_are_found() {
    for rival in Rival::ALL {
        assert_eq!(rival.name().parse(), Ok(rival));
    }
    let error = "sonar".parse::<Rival>().expect_err("no rival").to_string();
    assert!(Rival::ALL.iter().all(|rival| error.contains(rival.name())), "{error}");
}

#[test]
fn a_tuned_rival_may_go_to_another_thread() {
    fn sendable<T: Send + Sync + Clone + 'static>() {}
    sendable::<Tuned>();
}

#[test]
fn what_was_counted_in_tuning_is_what_the_detector_answers() {
    // Two sequences of unequal length in the table's own order, a floor that changes.
    let set = drive(11, foot, |i, x, y, floor| {
        let gray = if floor { 60 + 8 * (i % 4) } else { 60 + 20 * (i % 3) };
        (gray + noise(x + 5 * i, y) % if floor { 12 } else { 50 }) as u8
    });
    let set = set.with_groups(|name| Some(if name > "drive_06.png" { "b" } else { "a" }.to_string()));
    for rival in Rival::ALL {
        let mut tuned = rival.tune(&set, 3.0);
        let answers = answers(&mut tuned, &set).expect("of one size");
        assert_eq!(correct(&set, &answers, 3.0), tuned.correct(), "{rival:?}: {}", tuned.describe());
        assert!(tuned.correct() > 10, "{rival:?}: {} of 44", tuned.correct());
    }
}

#[test]
fn an_easy_floor_is_solved_by_all_who_look() {
    let set = plain_floor();
    for rival in [Rival::Gradient, Rival::Polly, Rival::Lorigo, Rival::Ulrich] {
        let tuned = rival.tune(&set, 4.0);
        assert_eq!(tuned.fitness(), 1.0, "{}", tuned.describe());
        // And on pictures never seen, in columns never asked for.
        let other_foot = |i: u32, x: u32| 8 + 7 * i + x / 8;
        let other = drive(
            5,
            other_foot,
            |i, x, y, floor| {
                if floor { 95 } else { 150 + (noise(x + 31 * i, y) % 60) as u8 }
            },
        );
        let mut tuned = tuned;
        for (i, image) in other.images().iter().enumerate() {
            let columns: Vec<u32> = (3..93).collect();
            let mut rows = vec![f32::NAN; columns.len()];
            tuned.next(&image.pixels, None, &columns, &mut rows).expect("of its size");
            for (&x, row) in columns.iter().zip(rows) {
                let label = f64::from(other_foot(i as u32, x));
                assert!((f64::from(row) - label).abs() <= 8.0, "{}: {x} {row} {label}", tuned.describe());
            }
        }
    }
}

#[test]
fn a_floor_up_to_the_top_is_row_0_and_wrong_arguments_are_refused() {
    let set = plain_floor();
    for rival in Rival::ALL {
        let mut tuned = rival.tune(&set, 4.0);
        let floor = GrayImage::from_pixel(WIDTH, HEIGHT, Luma([90]));
        let mut rows = [f32::NAN; 3];
        tuned.restart();
        tuned.next(&floor, None, &[0, 50, WIDTH - 1], &mut rows).expect("of its size");
        assert!(rival == Rival::Constant || rows == [0.0; 3], "{rival:?}: {rows:?}");
        let next = |tuned: &mut Tuned, image: &GrayImage, column| {
            tuned.next(image, None, &[column], &mut [0.0]).expect_err("wrong")
        };
        assert!(matches!(next(&mut tuned, &floor, WIDTH), DetectError::Column { .. }));
        let small = GrayImage::new(16, 16);
        assert!(matches!(next(&mut tuned, &small, 3), DetectError::ImageSize { .. }));
        let rows = tuned.next(&floor, None, &[1, 2], &mut [0.0]).expect_err("wrong");
        assert!(matches!(rows, DetectError::Rows { .. }));
    }
}

#[test]
fn the_smallest_images_are_answered() {
    for (width, height) in [(16, 16), (16, 300), (300, 16), (16, 600), (40, 1400)] {
        let pixels = GrayImage::from_fn(width, height, |x, y| Luma([(noise(x, y) % 256) as u8]));
        let images = (0..3).map(|i| NamedImage { name: format!("a_{i}.png"), pixels: pixels.clone() });
        let cases = (0..3).map(|image| Case { image, x: width - 1, y: height / 2 }).collect();
        let set = Dataset::new("small", images.collect(), cases).expect("sound");
        for rival in Rival::ALL {
            let mut tuned = rival.tune(&set, 2.0);
            let rows = answers(&mut tuned, &set).expect("of one size");
            assert_eq!(correct(&set, &rows, 2.0), tuned.correct(), "{rival:?}");
            assert!(rows.iter().all(|row| (0.0..height as f32).contains(row)), "{rows:?}");
        }
    }
}

#[test]
fn a_planted_threshold_is_recovered() {
    // Steps of 10 gray levels in the floor, of 40 at the foot of the wall: Sobel's masks make 40 and 160 of them.
    let stripes = |y: u32| if (y / 5).is_multiple_of(2) { 100 } else { 110 };
    let set = drive(
        8,
        foot,
        |i, x, y, floor| {
            if floor { stripes(y) } else { stripes(foot(i, x) + 1).wrapping_add(40) }
        },
    );
    let (gradient, choice) = Gradient::tune(&set, 1.0);
    assert_eq!(choice.correct, set.cases().len());
    let Gradient { window: (_, height), threshold, .. } = gradient;
    let spread = f64::from(height.clamp(2, 3)) / 2.0;
    assert!(threshold > 40.0 / spread && threshold < 165.0, "{gradient:?}");
}

#[test]
fn tuning_does_not_depend_on_the_number_of_threads() {
    let set = plain_floor();
    let tuned = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| Rival::ALL.map(|rival| format!("{:?}", rival.tune(&set, 1.0))))
    };
    assert_eq!(tuned(1), tuned(5));
}

/// A detector of the third kind whose trapezoid is the lower third of the image.
fn ulrich() -> Ulrich {
    Ulrich::new(UlrichSettings {
        size: (48, 48),
        bins: 16,
        trapezoid: (100, 100, 33),
        delay: 2,
        reach: 0.5,
        kept: 4,
        support: (4, 3),
        threshold: 0.02,
    })
}

#[test]
fn a_new_floor_is_an_obstacle_until_it_has_been_driven_over() {
    let mut detector = ulrich();
    // A mat comes nearer from frame to frame; above row 6 there is a wall.
    let frame = |mat: u32| {
        let gray = |y| {
            if y <= 6 {
                250
            } else if y <= mat {
                40
            } else {
                120
            }
        };
        GrayImage::from_fn(48, 48, |_, y| Luma([gray(y)]))
    };
    let mut row = |mat: u32, motion: Option<Motion>, expected: f32, why: &str| {
        let mut row = [f32::NAN];
        // A frame without a mat begins a drive.
        if mat == 0 {
            detector.restart();
        }
        detector.next(&frame(mat), motion, &[20], &mut row).expect("of its size");
        // The edges are smoothed.
        assert!((row[0] - expected).abs() <= 2.0, "{why}: {row:?}, not {expected}");
    };
    row(0, None, 6.0, "the wall");
    row(20, None, 20.0, "the mat");
    row(40, None, 40.0, "the mat, in the area that is a candidate now");
    row(47, None, 47.0, "a frame later");
    row(47, None, 6.0, "after two frames it has been driven over");
    // By odometry it is the way that counts.
    let drive = |forward, turn| Some(Motion { forward, turn });
    row(0, None, 6.0, "the wall");
    row(40, drive(0.3, 0.0), 40.0, "the mat");
    for _ in 0..9 {
        row(40, drive(0.0, 0.0), 40.0, "standing still, nothing is driven over");
    }
    row(40, drive(0.4, 0.0), 40.0, "0.4 m since");
    row(40, drive(0.1, 0.0), 6.0, "0.5 m since");
    // A turn throws candidates away.
    row(0, None, 6.0, "the wall");
    row(40, drive(0.3, 0.0), 40.0, "the mat");
    row(40, drive(0.2, 0.4), 40.0, "23 degrees");
    row(40, drive(0.3, 0.0), 40.0, "the candidate of before the turn is gone");
    row(40, drive(0.2, 0.0), 6.0, "that of after it is not");
}

#[test]
fn memory_is_of_the_way_driven_not_of_the_frames_seen() {
    // A floor that is dark for a while, in all of the trapezoid.
    let frame = |gray: u8| GrayImage::from_fn(48, 48, |_, y| Luma([if y <= 6 { 250 } else { gray }]));
    let mut detector = ulrich();
    let mut row = [f32::NAN];
    let mut drive = |gray: u8, frames: u32| {
        for i in 0..frames {
            let motion = (i > 0 || gray == 40).then_some(Motion { forward: 0.03, turn: 0.0 });
            detector.next(&frame(gray), motion, &[20], &mut row).expect("of its size");
        }
        row[0]
    };
    assert!((drive(120, 50) - 6.0).abs() <= 2.0);
    // Four references are kept, and those of the last metre at ten frames a second are far more.
    assert!((drive(40, 34) - 6.0).abs() <= 2.0, "the mat has been driven over");
    assert!((drive(120, 1) - 6.0).abs() <= 2.0, "the floor before it has not been forgotten");
}
