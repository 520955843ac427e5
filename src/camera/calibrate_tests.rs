use super::*;

const SIZE: (u32, u32) = (320, 240);
const TRUTH: Camera = Camera { height: 0.8, pitch: 51.0, field_of_view: 90.0, distortion: 0.0 };

/// Noise in -1..1, near enough to normal: its standard deviation is 1/3 (the mean of three, and so on).
struct Dice(u64);

impl Dice {
    fn even(&mut self) -> f64 {
        // SplitMix64.
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ z >> 31) >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    /// With this standard deviation.
    fn normal(&mut self, deviation: f64) -> f64 {
        (self.even() + self.even() + self.even()) * deviation
    }
}

/// The points at these places that are in the image, off by noise of this standard deviation in pixels.
fn points(camera: &Camera, aheads: &[f64], lefts: &[f64], deviation: f64, seed: u64) -> Vec<Point> {
    let mut dice = Dice(seed);
    let mut points = Vec::new();
    for &ahead in aheads {
        for &left in lefts {
            let Some((column, row)) = camera.project(SIZE, ahead, left) else { continue };
            let (column, row) = (column + dice.normal(deviation), row + dice.normal(deviation));
            if (0.0..=319.0).contains(&column) && (0.0..=239.0).contains(&row) {
                points.push(Point { line: points.len() + 2, column, row, ahead, left: Some(left) });
            }
        }
    }
    points
}

const AHEADS: [f64; 6] = [0.05, 0.3, 0.6, 1.0, 1.6, 2.5];
const LEFTS: [f64; 7] = [-1.0, -0.5, -0.2, 0.0, 0.2, 0.5, 1.0];

fn numbers(camera: &Camera) -> [f64; 4] {
    [camera.height, camera.pitch, camera.field_of_view, camera.distortion]
}

#[test]
fn exact_points_give_the_camera_back() {
    for pitch in [5.0, 20.0, 51.0, 75.0] {
        for field_of_view in [45.0, 90.0, 125.0] {
            for distortion in [0.0, -0.3, 0.2] {
                for height in [0.15, 1.2] {
                    let truth = Camera { height, pitch, field_of_view, distortion };
                    let of_height = |places: &[f64]| places.iter().map(|p| p * height).collect::<Vec<_>>();
                    let aheads = of_height(&[0.1, 0.4, 0.8, 1.3, 2.0, 4.0, 8.0]);
                    let points =
                        points(&truth, &aheads, &of_height(&[-2.0, -1.0, -0.4, 0.0, 0.4, 1.0, 2.0]), 0.0, 1);
                    let found = calibrate(&points, &Known::default(), SIZE);
                    let found = found.unwrap_or_else(|e| panic!("{truth:?}: {e}"));
                    if found.numbers[3].source == Source::Fitted || distortion == 0.0 {
                        for (a, b) in numbers(&found.camera).iter().zip(numbers(&truth)) {
                            assert!(
                                (a - b).abs() < 1e-6 * b.abs().max(1.0),
                                "{:?}, not {truth:?}",
                                found.camera
                            );
                        }
                        assert!(found.rms_pixels < 1e-6 && found.rms_metres.expect("floor") < 1e-6);
                    }
                    let wide = (51.0..76.0).contains(&pitch) && field_of_view == 90.0;
                    assert!(
                        !wide || (found.numbers[3].source == Source::Fitted) == (distortion != 0.0),
                        "{found:?}"
                    );
                }
            }
        }
    }
}

#[test]
fn noisy_points_give_it_within_the_errors_stated() {
    for distortion in [0.0, -0.25] {
        let truth = Camera { distortion, ..TRUTH };
        let (mut beyond, mut all) = (0, 0);
        for seed in 0..60 {
            let points = points(&truth, &AHEADS, &LEFTS, 0.5, seed);
            // A distortion that counts only where it is found would be found too large.
            let known = Known { distortion: (distortion == 0.0).then_some(0.0), ..Known::default() };
            let found = calibrate(&points, &known, SIZE).expect("sound");
            let camera = calibrate(&points, &Known::default(), SIZE).expect("sound").camera;
            assert!((camera.height - 0.8).abs() < 0.02 && (camera.pitch - 51.0).abs() < 1.5, "{camera:?}");
            assert!(camera.distortion == 0.0 || (camera.distortion - distortion).abs() < 0.05, "{camera:?}");
            assert!((0.4..1.0).contains(&found.rms_pixels), "{found:?}");
            for (number, truth) in found.numbers.iter().zip(numbers(&truth)) {
                if let Some(error) = number.standard_error {
                    let off = (number.value - truth).abs() / error;
                    assert!(off < 5.0, "{number:?}, not {truth}");
                    (beyond, all) = (beyond + i32::from(off > 2.0), all + 1);
                }
            }
        }
        // Of normal errors 4.6 % are beyond two standard errors.
        assert!(beyond * 100 <= all * 10, "{beyond} of {all}");
        assert!(beyond > 0, "standard errors are too large: {beyond} of {all}");
    }
}

#[test]
fn a_yardstick_and_a_protractor_suffice() {
    let known = Known { height: Some(0.8), pitch: Some(51.0), ..Known::default() };
    let row = points(&TRUTH, &[0.5], &[-0.4, -0.2, 0.0, 0.2, 0.4], 0.3, 7);
    assert_eq!(row.len(), 5);
    let found = calibrate(&row, &known, SIZE).expect("enough");
    assert!((found.camera.field_of_view - 90.0).abs() < 1.5, "{found:?}");
    let sources = found.numbers.map(|n| n.source);
    assert_eq!(sources, [Source::Given, Source::Given, Source::Fitted, Source::TooFewPoints]);
    // Without places to the left there is still the row itself, if it is far enough from the middle.
    let bare: Vec<Point> =
        points(&TRUTH, &[0.1, 1.5], &[0.0], 0.0, 7).iter().map(|p| Point { left: None, ..*p }).collect();
    let found = calibrate(&bare, &known, SIZE).expect("enough");
    assert!((found.camera.field_of_view - 90.0).abs() < 1e-6, "{found:?}");
    // One tape straight ahead gives all three.
    let tape: Vec<Point> =
        points(&TRUTH, &AHEADS, &[0.0], 0.0, 7).iter().map(|p| Point { left: None, ..*p }).collect();
    let found = calibrate(&tape, &Known::default(), SIZE).expect("enough");
    assert!(
        (found.camera.height - 0.8).abs() < 1e-5 && (found.camera.pitch - 51.0).abs() < 1e-3,
        "{found:?}"
    );
    assert_eq!(found.numbers[3].source, Source::TooFewPoints);
}

#[test]
fn a_given_distortion_is_held() {
    let truth = Camera { distortion: -0.2, ..TRUTH };
    let points = points(&truth, &AHEADS, &LEFTS, 0.0, 1);
    let given = |distortion| Known { distortion: Some(distortion), ..Known::default() };
    let found = calibrate(&points, &given(-0.2), SIZE).expect("sound");
    assert!((found.camera.field_of_view - 90.0).abs() < 1e-6 && found.numbers[3].source == Source::Given);
    let found = calibrate(&points, &given(0.0), SIZE).expect("sound");
    assert!(found.camera.distortion == 0.0 && found.rms_pixels > 2.0, "{found:?}");
    assert!(found.warnings.contains(&Warning::Rough), "{found:?}");
    // Nothing unknown: only compared.
    let known =
        Known { height: Some(0.8), pitch: Some(51.0), field_of_view: Some(90.0), distortion: Some(-0.2) };
    let found = calibrate(&points, &known, SIZE).expect("sound");
    assert!(found.camera == truth && found.rms_pixels < 1e-9 && found.warnings.is_empty(), "{found:?}");
}

#[test]
fn a_distortion_at_its_limit_is_warned_of_and_has_no_standard_error() {
    let limit = Camera::distortion_limit(SIZE.0, SIZE.1);
    let lefts = [&LEFTS[..], &[-2.5, -1.6, 1.6, 2.5]].concat();
    for (bent, at) in [(-0.62, -limit), (0.62, limit)] {
        let truth = Camera { distortion: bent, ..TRUTH };
        let found = calibrate(&points(&truth, &AHEADS, &lefts, 0.0, 1), &Known::default(), SIZE);
        let found = found.unwrap_or_else(|e| panic!("{bent}: {e}"));
        assert!(found.warnings.contains(&Warning::AtLimit { number: "distortion" }), "{found:?}");
        let distortion = found.numbers[3];
        assert!((distortion.value - at).abs() < 1e-5 && distortion.source == Source::Fitted, "{found:?}");
        assert_eq!(distortion.standard_error, None);
        assert!(found.numbers[..3].iter().all(|n| n.standard_error.is_some_and(|e| e > 0.0)), "{found:?}");
        found.camera.check(SIZE.0, SIZE.1).expect("possible");
    }
    let within = Camera { distortion: 0.005 - limit, ..TRUTH };
    let found = calibrate(&points(&within, &AHEADS, &LEFTS, 0.0, 1), &Known::default(), SIZE).expect("sound");
    assert!(found.warnings.is_empty() && found.numbers[3].standard_error.is_some(), "{found:?}");
}

#[test]
fn points_that_do_not_span_the_image_leave_distortion_alone() {
    let narrow = points(&TRUTH, &[0.4, 0.5, 0.6, 0.7, 0.8], &[-0.2, 0.0, 0.2], 0.0, 1);
    let found = calibrate(&narrow, &Known { height: Some(0.8), ..Known::default() }, SIZE).expect("sound");
    assert_eq!(found.numbers[3].source, Source::TooNarrow);
}

#[test]
fn an_outlier_is_named() {
    for wrong in [3, 10, 20] {
        let mut points = points(&TRUTH, &AHEADS, &LEFTS, 0.4, 5);
        assert!(calibrate(&points, &Known::default(), SIZE).expect("sound").warnings.is_empty());
        points[wrong].row -= 9.0;
        let found = calibrate(&points, &Known::default(), SIZE).expect("sound");
        let line = points[wrong].line;
        let Some(Warning::Outlier { line: named, rms_without }) = found.warnings.first() else {
            panic!("{found:?}")
        };
        assert_eq!(*named, line);
        points.remove(wrong);
        let rest =
            calibrate(&points, &Known { distortion: Some(0.0), ..Known::default() }, SIZE).expect("sound");
        assert!((rest.rms_pixels - rms_without).abs() < 0.3, "{rms_without} {rest:?}");
    }
}

#[test]
fn what_the_points_leave_open_is_said() {
    let complaint = |points: &[Point], known: &Known| calibrate(points, known, SIZE).expect_err("no camera");
    // One line across: height and pitch can make up for each other.
    let row = points(&TRUTH, &[0.5], &[-0.4, -0.2, 0.0, 0.2, 0.4], 0.0, 1);
    let error = complaint(&row, &Known::default());
    assert!(
        matches!(error, CalibrateError::Undetermined { .. }) && error.to_string().contains("--"),
        "{error}"
    );
    // The same point again and again.
    let same = vec![row[1]; 9];
    assert!(matches!(complaint(&same, &Known::default()), CalibrateError::Undetermined { .. }));
    // In the middle of the image nothing shows the field of view.
    let middle = [Point { line: 2, column: 159.5, row: 119.5, ahead: 0.648, left: Some(0.0) }];
    let known = Known { height: Some(0.8), pitch: Some(51.0), ..Known::default() };
    let error = complaint(&middle, &known);
    assert_eq!(error, CalibrateError::Undetermined { number: "field_of_view" });
    // Hardly determined, but determined.
    let short = points(&TRUTH, &[0.6, 0.8], &[-0.05, 0.05], 0.1, 3);
    let found = calibrate(&short, &Known::default(), SIZE).expect("sound");
    assert!(found.warnings.iter().any(|w| matches!(w, Warning::Poor { .. })), "{found:?}");
}

#[test]
fn points_that_cannot_be() {
    let sound = points(&TRUTH, &AHEADS, &LEFTS, 0.0, 1);
    let complaint = |points: &[Point], known: &Known| calibrate(points, known, SIZE).expect_err("no camera");
    let error = complaint(&sound[..1], &Known::default());
    assert!(
        error.to_string().contains("2 measurements cannot give 3 numbers (height, pitch, field_of_view)")
    );
    let error =
        complaint(&[Point { left: None, ..sound[0] }], &Known { height: Some(0.8), ..Known::default() });
    assert!(error.to_string().contains("1 measurements cannot give 2 numbers"), "{error}");

    let mut outside = sound.clone();
    outside[4].column = 320.0;
    let error = complaint(&outside, &Known::default());
    assert!(error.line() == Some(outside[4].line) && error.to_string().contains("319, 239"), "{error}");

    // With the camera level, the upper half of the image is above the horizon.
    let known =
        Known { height: Some(0.8), pitch: Some(0.0), field_of_view: Some(90.0), distortion: Some(0.0) };
    let level = Camera { pitch: 0.0, ..TRUTH };
    let mut above = points(&level, &[1.0, 2.0, 3.0], &[-0.5, 0.5], 0.0, 1);
    above[2].row = 80.0;
    let error = complaint(&above, &known);
    assert_eq!(error, CalibrateError::AboveHorizon { line: above[2].line, row: 80.0 });

    // Rows counted from the bottom; left and right exchanged.
    let flipped: Vec<Point> = sound.iter().map(|p| Point { row: 239.0 - p.row, ..*p }).collect();
    let error = complaint(&flipped, &Known { height: Some(0.8), pitch: Some(51.0), ..Known::default() });
    assert!(error.line().is_some() && error.to_string().contains("rows count from the top"), "{error}");
    let mirrored: Vec<Point> = sound.iter().map(|p| Point { left: p.left.map(|l| -l), ..*p }).collect();
    let error = complaint(&mirrored, &Known::default());
    assert!(
        matches!(error, CalibrateError::Unexplained { .. })
            && error.to_string().contains("left of the middle"),
        "{error}"
    );
    // All behind a camera that looks level.
    let behind: Vec<Point> = sound.iter().map(|p| Point { ahead: -3.0, ..*p }).collect();
    assert_eq!(complaint(&behind, &Known { pitch: Some(0.0), ..known }), CalibrateError::Nowhere);

    for known in [
        Known { height: Some(0.0), ..Known::default() },
        Known { pitch: Some(f64::NAN), ..Known::default() },
        Known { field_of_view: Some(180.0), ..Known::default() },
        Known { distortion: Some(0.7), ..Known::default() },
        Known { pitch: Some(-60.0), field_of_view: Some(90.0), ..Known::default() },
    ] {
        assert!(matches!(complaint(&sound, &known), CalibrateError::Camera(_)), "{known:?}");
    }
}

#[test]
fn many_points_take_no_time() {
    let aheads: Vec<f64> = (0..60).map(|i| 0.05 + 0.04 * f64::from(i)).collect();
    let lefts: Vec<f64> = (-40..=40).map(|i| 0.025 * f64::from(i)).collect();
    let points = points(&TRUTH, &aheads, &lefts, 0.5, 9);
    assert!(points.len() > 3000);
    let found = calibrate(&points, &Known::default(), SIZE).expect("sound");
    assert!((found.camera.height - 0.8).abs() < 0.002, "{found:?}");
}
