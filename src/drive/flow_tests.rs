//! A floor with texture, and a box that stands on it.

use super::*;
use crate::world::noise::smooth;

const SIZE: (u32, u32) = (160, 120);

fn camera() -> Camera {
    Camera { height: 0.6, pitch: 51.0, field_of_view: 70.0, distortion: -0.1 }
}

fn place(x: f64, heading: f64) -> Place {
    Place { x, y: 0.0, heading }
}

/// A textured floor up to `wall` metres along x, where a textured wall stands across.
fn picture(place: &Place, wall: f64) -> GrayImage {
    let camera = camera();
    let (sin, cos) = libm::sincos(place.heading);
    let (x, y) = lens(place);
    GrayImage::from_fn(SIZE.0, SIZE.1, |column, row| {
        let Some((ahead, left)) = camera.floor(SIZE, column.into(), row.into()) else {
            return image::Luma([128]);
        };
        let (dx, dy) = (cos * ahead - sin * left, sin * ahead + cos * left);
        // Where the ray goes through the wall, if it does so before it meets the floor.
        let through = (wall - x) / dx;
        let (u, v) = if dx > 0.0 && through < 1.0 {
            (y + dy * through, 50.0 + camera.height * (1.0 - through))
        } else {
            (x + dx, y + dy)
        };
        image::Luma([(40.0 + 170.0 * smooth(3, u * 20.0, v * 20.0)) as u8])
    })
}

fn flow() -> Flow {
    Flow { size: SIZE, camera: camera(), baseline: 0.1, window: (9, 5), threshold: 4.0 }
}

/// The row of the wall's foot, by the geometry.
fn foot(place: &Place, wall: f64, column: u32) -> f32 {
    let (x, _) = lens(place);
    let row = camera().row_of(SIZE, column.into(), wall - x).expect("in view");
    row as f32
}

#[test]
fn a_wall_is_seen_where_it_stands_and_a_floor_nowhere() {
    let wall = 1.1;
    let mut detector = FlowDetector::new(flow());
    let columns = [30, 80, 120];
    let mut rows = [f32::NAN; 3];
    detector.next(&picture(&place(0.0, 0.0), wall), None, &columns, &mut rows).expect("its size");
    assert_eq!(rows, [0.0; 3], "one picture says nothing");
    let motion = Motion { forward: 0.05, turn: 0.0 };
    detector.next(&picture(&place(0.05, 0.0), wall), Some(motion), &columns, &mut rows).expect("its size");
    assert_eq!(rows, [0.0; 3], "too near to the first one");
    let motion = Motion { forward: 0.15, turn: 0.0 };
    detector.next(&picture(&place(0.2, 0.0), wall), Some(motion), &columns, &mut rows).expect("its size");
    for (row, column) in rows.into_iter().zip(columns) {
        // What stands only a little higher than the floor moves only a little otherwise.
        let foot = foot(&place(0.2, 0.0), wall, column);
        assert!(
            (foot - 12.0..foot + 3.0).contains(&row),
            "column {column}: {row}, the wall stands at {foot}"
        );
    }
    detector.restart();
    for x in [0.0, 0.2] {
        let motion = (x > 0.0).then_some(Motion { forward: x, turn: 0.0 });
        detector.next(&picture(&place(x, 0.0), 50.0), motion, &columns, &mut rows).expect("its size");
    }
    assert_eq!(rows, [0.0; 3], "a floor is no obstacle");
}

#[test]
fn a_turn_moves_the_lens_as_well() {
    // It stands 0.28 m before the axle: half a radian moves it by 0.14 m.
    let turned = place(0.0, 0.5);
    assert!((apart(&place(0.0, 0.0), &turned) - 2.0 * CAMERA_AHEAD * libm::sin(0.25)).abs() < 1e-12);
    let (before, now) = (picture(&place(0.0, 0.0), 50.0), picture(&turned, 50.0));
    let pair =
        Pair { camera: camera(), now: turned, then: place(0.0, 0.0), picture: &now, reference: &before };
    // The same floor looks the same, where both see it.
    let most = pair.differences(110, (9, 5)).map(|(_, difference)| difference).fold(0.0, f64::max);
    assert!(most < 6.0, "{most}");
    assert!(pair.matched(110, 60).is_some());
}

#[test]
fn a_brighter_picture_is_no_obstacle() {
    let (a, b) = (place(0.0, 0.0), place(0.15, 0.0));
    let (before, now) = (picture(&a, 50.0), picture(&b, 50.0));
    let mut brighter = now.clone();
    brighter.iter_mut().for_each(|p| *p += 30);
    let differences = |picture| {
        let pair = Pair { camera: camera(), now: b, then: a, picture, reference: &before };
        pair.differences(80, (9, 5)).collect::<Vec<_>>()
    };
    for (same, brighter) in differences(&now).into_iter().zip(differences(&brighter)) {
        assert!((same.1 - brighter.1).abs() < 1e-3, "{same:?} {brighter:?}");
    }
}

#[test]
fn between_pixels_and_outside() {
    let image = GrayImage::from_fn(3, 2, |x, y| image::Luma([(10 * x + 100 * y) as u8]));
    assert_eq!(sample(&image, 1.5, 0.5), Some(65.0));
    assert_eq!(sample(&image, 2.0, 1.0), Some(120.0));
    assert_eq!(
        [sample(&image, -0.1, 0.0), sample(&image, 2.1, 0.0), sample(&image, f64::NAN, 0.0)],
        [None; 3]
    );
}

#[test]
fn the_frames_before_a_picture_are_those_of_its_drive() {
    let (set, earlier) = World::Fmrb.recorded_with_earlier(None, false, Some(2), 5).expect("in range");
    let alone = World::Fmrb.recorded(None, false, Some(2)).expect("in range");
    assert_eq!(set.images(), alone.images(), "the pictures are the same");
    assert_eq!(set.cases(), alone.cases());
    for earlier in &earlier {
        assert_eq!(earlier.frames.len(), 5);
        let last = &earlier.frames[4].0;
        let step = libm::hypot(last.x - earlier.place.x, last.y - earlier.place.y);
        assert!(step <= 0.035 && *last != earlier.place, "a tenth of a second at 0.3 m/s: {step}");
    }
}
