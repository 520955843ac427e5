//! Transforms and copies of labelled images: labels follow the picture, and everything is the same everywhere.

use image::{GrayImage, Luma};
use proptest::prelude::*;
use vsonar::dataset::{Case, Dataset, NamedImage, Transform, Variation};

const FLOOR: u8 = 60;
const WALL: u8 = 200;

/// A picture of a wall on a floor: the lowest row of wall in each column, or none where it is floor all the way up.
fn picture(feet: &[Option<u32>], height: u32) -> GrayImage {
    GrayImage::from_fn(feet.len() as u32, height, |x, y| {
        Luma([if feet[x as usize].is_some_and(|foot| y <= foot) { WALL } else { FLOOR }])
    })
}

/// The label by its definition: the first pixel from the bottom that is not floor, else 0.
fn label(image: &GrayImage, x: u32) -> u32 {
    (0..image.height()).rev().find(|&y| image.get_pixel(x, y).0[0] != FLOOR).unwrap_or(0)
}

/// All columns of a picture as cases.
fn labelled(pixels: GrayImage) -> Dataset {
    let cases = (0..pixels.width()).map(|x| Case { image: 0, x, y: label(&pixels, x) }).collect();
    Dataset::new("one", vec![NamedImage { name: "a.png".into(), pixels }], cases).expect("sound")
}

/// A picture with walls that do not end in the topmost row, which the label alone cannot tell from an open column.
fn scenes() -> impl Strategy<Value = Dataset> {
    (16usize..40, 16u32..40).prop_flat_map(|(width, height)| {
        let foot = prop_oneof![1 => Just(None), 1 => Just(Some(height - 1)), 4 => (1..height).prop_map(Some)];
        proptest::collection::vec(foot, width).prop_map(move |feet| labelled(picture(&feet, height)))
    })
}

/// Three images of noise with a few cases each.
fn grainy(images: usize) -> Dataset {
    let mut state = 7u32;
    let mut next = || {
        state = state.wrapping_mul(1664525).wrapping_add(1013904223);
        (state >> 24) as u8
    };
    let named = (0..images).map(|i| NamedImage {
        name: format!("{i}.png"),
        pixels: GrayImage::from_fn(33, 24, |_, _| Luma([next()])),
    });
    let named = named.collect();
    let case = |n: usize| Case { image: n % images, x: (n / images) as u32 * 8, y: (5 * n % 24) as u32 };
    Dataset::new("grainy", named, (0..4 * images).map(case).collect()).expect("sound")
}

const EVERYTHING: Variation = Variation {
    copies: 3,
    mirror: 0.5,
    gain: 0.4,
    brightness: 20.0,
    contrast: 0.3,
    gamma: 0.3,
    noise: 6.0,
    blur: 1.5,
    shift_x: 9,
    shift_y: 5,
};

proptest! {
    #[test]
    fn labels_follow_the_picture(set in scenes(), right in -50i32..50, down in -50i32..50) {
        for transform in [Transform::Mirror, Transform::Shift { right, down }] {
            let Ok(changed) = set.transformed(transform) else {
                prop_assert!(right.unsigned_abs() >= set.width());
                continue;
            };
            let image = &changed.images()[0].pixels;
            for case in changed.cases() {
                prop_assert_eq!(case.y, label(image, case.x), "{:?}, column {}", transform, case.x);
            }
            let left = set.cases().iter().filter(|c| transform.case(**c, set.width(), set.height()).is_some());
            prop_assert_eq!(changed.cases().len(), left.count());
        }
        let moved = set.transformed(Transform::Shift { right, down: 0 });
        let width = set.width() as i32;
        prop_assert_eq!(moved.map_or(0, |s| s.cases().len() as i32), (width - right.abs()).max(0));
    }

    #[test]
    fn mirrored_twice_is_as_before(set in scenes()) {
        let once = set.transformed(Transform::Mirror).expect("all columns stay");
        prop_assert_eq!(once.transformed(Transform::Mirror).expect("all columns stay"), set);
    }

    #[test]
    fn what_is_not_at_the_border_is_moved_exactly(right in -12i32..12, down in -12i32..12) {
        let set = grainy(1);
        let image = &set.images()[0].pixels;
        let moved = Transform::Shift { right, down }.image(image, 0);
        for (x, y, pixel) in image.enumerate_pixels() {
            let (to_x, to_y) = (x as i32 + right, y as i32 + down);
            if (0..33).contains(&to_x) && (0..24).contains(&to_y) {
                prop_assert_eq!(moved.get_pixel(to_x as u32, to_y as u32), pixel);
            }
        }
    }

    #[test]
    fn tones_keep_their_order(strength in 0.05f64..4.0, levels in -255.0f64..255.0) {
        let ramp = GrayImage::from_fn(256, 16, |x, _| Luma([x as u8]));
        for transform in [
            Transform::Gain(strength),
            Transform::Contrast(strength),
            Transform::Gamma(strength),
            Transform::Brightness(levels),
        ] {
            let changed = transform.image(&ramp, 0);
            let row: Vec<u8> = (0..256).map(|x| changed.get_pixel(x, 3).0[0]).collect();
            prop_assert!(row.is_sorted(), "{:?}", transform);
        }
    }

    #[test]
    fn blur_keeps_even_ground_and_the_range(level: u8, deviation in 0.0f64..6.0) {
        let even = GrayImage::from_pixel(20, 17, Luma([level]));
        prop_assert_eq!(&Transform::Blur(deviation).image(&even, 0), &even);
        let set = grainy(1);
        let grain = &set.images()[0].pixels;
        let (least, most) = (grain.iter().min(), grain.iter().max());
        let blurred = Transform::Blur(deviation).image(grain, 0);
        prop_assert!(blurred.iter().min() >= least && blurred.iter().max() <= most);
        // A mirrored image has a mirrored blur.
        let mirror = |image| Transform::Mirror.image(image, 0);
        prop_assert_eq!(Transform::Blur(deviation).image(&mirror(grain), 0), mirror(&blurred));
    }
}

#[test]
fn light_and_lens_move_no_label() {
    let set = grainy(3);
    for transform in [
        Transform::Gain(1.5),
        Transform::Brightness(9.0),
        Transform::Contrast(0.5),
        Transform::Gamma(2.0),
        Transform::Noise { deviation: 4.0, seed: 1 },
        Transform::Blur(1.0),
    ] {
        let changed = set.transformed(transform).expect("all columns stay");
        assert_eq!(changed.cases(), set.cases());
        for (new, old) in changed.images().iter().zip(set.images()) {
            assert!(new.name == old.name && new.pixels != old.pixels, "{transform:?}");
        }
    }
    assert_eq!(set.transformed(Transform::Noise { deviation: 0.0, seed: 1 }).expect("all stay"), set);
    assert_eq!(set.transformed(Transform::Blur(0.0)).expect("all stay"), set);
    let noise = |seed| Transform::Noise { deviation: 4.0, seed };
    let gray = GrayImage::from_pixel(16, 16, Luma([99]));
    let drawn = [(1, 0), (1, 1), (2, 0)].map(|(seed, number)| noise(seed).image(&gray, number));
    assert!(drawn[0] != drawn[1] && drawn[0] != drawn[2] && drawn[0] == noise(1).image(&gray, 0));
    let error = set.transformed(Transform::Shift { right: -33, down: 0 }).expect_err("nothing left");
    assert!(error.to_string().contains("grainy"), "{error}");
}

#[test]
fn copies_come_after_the_set_and_do_not_depend_on_it() {
    let set = grainy(3);
    let grown = EVERYTHING.grow(&set, 5);
    assert_eq!((&grown.images()[..3], &grown.cases()[..12]), (set.images(), set.cases()));
    assert_eq!(grown.images().len(), 12);
    assert!(grown.cases().len() > 12 && grown.cases().len() <= 48);
    // What it promises of itself is so.
    let rebuilt = Dataset::new("grainy", grown.images().to_vec(), grown.cases().to_vec());
    assert_eq!(rebuilt.expect("sound"), grown);
    assert_ne!(EVERYTHING.grow(&set, 6).fingerprint(), grown.fingerprint());
    // The first copies of a larger set's first images are those of the smaller one.
    let larger = EVERYTHING.grow(&grainy(5), 5);
    for image in 0..3 {
        assert_eq!(larger.images()[5 + image].pixels, grown.images()[3 + image].pixels);
    }
    assert_eq!(Variation { copies: 9, ..Variation::NONE }.grow(&set, 5), set);
}

#[test]
fn leaving_one_alteration_out_changes_no_other() {
    let set = grainy(3);
    let without = Variation { mirror: 0.0, blur: 0.0, shift_x: 0, shift_y: 0, noise: 0.0, ..EVERYTHING };
    let with = Variation { mirror: 1.0, ..without };
    let (without, with) = (without.grow(&set, 5), with.grow(&set, 5));
    for (a, b) in without.images()[3..].iter().zip(&with.images()[3..]) {
        assert_eq!(Transform::Mirror.image(&a.pixels, 0), b.pixels);
    }
}

#[test]
fn copies_stay_within_their_limits() {
    let set = grainy(40);
    let levels = |variation: Variation| -> Vec<i32> {
        let grown = Variation { copies: 5, ..variation }.grow(&set, 1);
        assert_eq!(grown.cases().len(), 6 * set.cases().len());
        let copies = grown.images()[40..].iter().enumerate();
        // One level of each, by which one sees what was done to all.
        let change = |(n, copy): (usize, &NamedImage)| {
            let old = &set.images()[n % 40].pixels;
            let at = old.iter().position(|v| (100..140).contains(v)).expect("noise has all levels");
            i32::from(copy.pixels.as_raw()[at]) - i32::from(old.as_raw()[at])
        };
        copies.map(change).collect()
    };
    for (variation, low, high) in [
        (Variation { brightness: 20.0, ..Variation::NONE }, -20, 20),
        // 139 * 1.5 - 139 and 139 / 1.5 - 139
        (Variation { gain: 0.5, ..Variation::NONE }, -47, 70),
    ] {
        let found = levels(variation);
        let (least, most) = (found.iter().min().copied(), found.iter().max().copied());
        assert!(least >= Some(low) && least < Some(low / 2), "{variation:?}: {least:?}");
        assert!(most <= Some(high) && most > Some(high / 2), "{variation:?}: {most:?}");
    }
    let shifted = Variation { copies: 5, shift_x: 3, shift_y: 2, ..Variation::NONE }.grow(&set, 1);
    let mut seen = std::collections::BTreeSet::new();
    for case in shifted.cases().iter().filter(|c| c.image >= 40) {
        let original = set.cases().iter().find(|c| c.image == case.image % 40 && c.x.abs_diff(case.x) <= 3);
        let original = original.expect("within 3 columns");
        if (2..22).contains(&original.y) {
            seen.insert((case.x as i32 - original.x as i32, case.y as i32 - original.y as i32));
        }
    }
    assert_eq!(seen.len(), 7 * 5, "{seen:?}");
}

/// The same on every machine, at any number of threads.
#[test]
fn copies_are_the_same_everywhere() {
    let pool = |threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
    for threads in [1, 2, 5] {
        let grown = pool(threads).install(|| EVERYTHING.grow(&grainy(6), 11));
        assert_eq!(grown.fingerprint(), GROWN, "{threads} threads");
    }
}

/// Written down when the transforms were made; a run with augmentation can only go on while it stays.
const GROWN: u64 = 16049674233206539817;

#[test]
fn cases_between_columns() {
    let pixels = GrayImage::new(64, 48);
    let images = ["a.png", "b.png"].map(|name| NamedImage { name: name.into(), pixels: pixels.clone() });
    let case = |image, x, y| Case { image, x, y };
    // Not in the order of columns; the last of the first image and the first of the second are no neighbours.
    let cases = vec![case(0, 30, 20), case(0, 10, 10), case(1, 40, 20), case(1, 41, 20), case(0, 50, 31)];
    let set = Dataset::new("two", images.into(), cases).expect("sound");
    let (between, neighbours) = set.between(0.25, 10.0).expect("one pair agrees");
    assert_eq!((between.cases(), &neighbours[..]), (&[case(0, 15, 13)][..], &[[1, 0]][..]));
    let (between, neighbours) = set.between(0.75, 11.0).expect("two pairs agree");
    assert_eq!(between.cases(), [case(0, 25, 18), case(0, 45, 28)]);
    assert_eq!(neighbours, [[1, 0], [0, 4]]);
    // Nothing lies between two columns side by side, nor at the columns themselves.
    assert!(set.between(0.5, 1.0).is_none() && set.between(0.0, 20.0).is_none());
}
