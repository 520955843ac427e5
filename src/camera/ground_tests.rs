use std::f64::consts::PI;

use super::*;

const SIZE: (u32, u32) = (320, 240);

fn camera(height: f64, pitch: f64, field_of_view: f64, distortion: f64) -> Camera {
    let camera = Camera { height, pitch, field_of_view, distortion };
    camera.check(SIZE.0, SIZE.1).expect("a possible camera");
    camera
}

fn ground(height: f64, pitch: f64, field_of_view: f64, distortion: f64) -> Ground {
    Ground::new(&camera(height, pitch, field_of_view, distortion), SIZE.0, SIZE.1)
}

/// Bearing and distance in binary64, from spherical angles instead of a rotation: the oracle. `None` at and above the
/// horizon.
fn oracle(camera: &Camera, (width, height): (u32, u32), column: f64, row: f64) -> Option<(f64, f64)> {
    let (width, height) = (f64::from(width), f64::from(height));
    let (x, y) = (column + 0.5 - width / 2.0, row + 0.5 - height / 2.0);
    let r = x.hypot(y) / (width / 2.0);
    let k = camera.distortion;
    let slope = (camera.field_of_view / 2.0).to_radians().tan() * (1.0 + k) * r / (1.0 + k * r * r);
    // The ray leaves the axis by `off`, towards `turn` in the image (0 is right, a quarter is down).
    let (off, turn) = (slope.atan(), y.atan2(x));
    let pitch = camera.pitch.to_radians();
    let down = off.cos() * pitch.sin() + off.sin() * turn.sin() * pitch.cos();
    let forward = off.cos() * pitch.cos() - off.sin() * turn.sin() * pitch.sin();
    let left = -off.sin() * turn.cos();
    (down > 0.0).then(|| (left.atan2(forward), camera.height * forward.hypot(left) / down))
}

/// How far the distance may be off, as a share of itself, and the bearing in radians.
fn allowed(camera: &Camera, distance: f64) -> (f64, f64) {
    let heights = distance / camera.height;
    (2e-7 / heights + 1e-6 + 1.5e-7 * heights, 1e-6 * (1.0 + 0.5 / heights))
}

/// Cameras of every kind: pitch from slightly upwards to straight down, all fields of view, both distortions.
fn cameras() -> Vec<Camera> {
    let mut all = Vec::new();
    for pitch in [-10.0, 0.0, 12.5, 30.0, 51.0, 75.0, 89.9, 90.0] {
        for field_of_view in [25.0, 60.0, 90.0, 120.0, 150.0] {
            for distortion in [-0.5, -0.2, 0.0, 1e-3, 0.4] {
                let camera = Camera { height: 0.8, pitch, field_of_view, distortion };
                all.extend(camera.check(SIZE.0, SIZE.1).is_ok().then_some(camera));
            }
        }
    }
    assert!(all.len() > 150, "{}", all.len());
    all
}

#[test]
fn agrees_with_binary64_at_every_distance() {
    let mut worst = (0.0f64, 0.0f64, 0.0f64);
    for camera in cameras() {
        let ground = Ground::new(&camera, SIZE.0, SIZE.1);
        for column in (0..SIZE.0).step_by(29).chain([159, 160, 319]) {
            for row in (0..SIZE.1 * 4).map(|quarter| 0.5 + quarter as f32 / 4.0).filter(|&row| row <= 239.0) {
                let found = ground.locate(column, row);
                let Some((bearing, distance)) = oracle(&camera, SIZE, f64::from(column), f64::from(row))
                else {
                    // The roundings may take a row on the very horizon to either side of it.
                    assert!(found.distance > 1e5, "{camera:?} {column} {row}: {found:?}");
                    continue;
                };
                if distance > 1e5 {
                    assert!(found.distance > 2e4, "{camera:?} {column} {row}: {found:?}, not {distance}");
                    continue;
                }
                let off = (f64::from(found.distance) - distance).abs() / distance;
                // Bearings of -pi and pi are one.
                let turn = (f64::from(found.bearing) - bearing).abs();
                let turn = turn.min(2.0 * PI - turn);
                let (distance_bound, bearing_bound) = allowed(&camera, distance);
                worst = (
                    worst.0.max(off / distance_bound),
                    worst.1.max(turn / bearing_bound),
                    worst.2.max(if (0.1..25.0).contains(&(distance / camera.height)) { off } else { 0.0 }),
                );
                let line = format!("{camera:?} {column} {row}: {found:?}, not {bearing} {distance}");
                assert!(off <= distance_bound && turn <= bearing_bound, "{line}");
            }
        }
    }
    println!("share of the bound that is used: distance {:.2}, bearing {:.2}", worst.0, worst.1);
    println!("largest relative error from 0.1 to 25 heights: {:.2e}", worst.2);
    assert!(worst.2 <= 1e-5);
}

#[test]
fn agrees_with_the_rays_of_the_simulated_camera() {
    for (pitch, field_of_view) in [(0.0, 60.0), (20.0, 90.0), (51.0, 90.0), (80.0, 110.0)] {
        let ground = ground(0.8, pitch, field_of_view, 0.0);
        let camera = camera(0.8, pitch, field_of_view, 0.0);
        let view = camera.lens(SIZE.0, SIZE.1).view(&camera.pose(0.0, 0.0, 0.0));
        for column in (0..320).step_by(7) {
            for row in 1..240 {
                let found = ground.locate(column, row as f32);
                let ray = view.ray(column, row).direction;
                if ray.z >= -1e-6 {
                    assert_eq!(found.status, Status::NoneInView);
                    continue;
                }
                let distance = 0.8 * ray.x.hypot(ray.y) / -ray.z;
                let off = (f64::from(found.distance) / distance - 1.0).abs();
                assert!(
                    off <= 2e-6 + 1.5e-7 * distance / 0.8,
                    "{pitch} {column} {row}: {found:?}, not {distance}"
                );
                let turn = (f64::from(found.bearing) - ray.y.atan2(ray.x)).abs();
                assert!(turn <= 1e-6 * (1.0 + 0.4 / distance), "{pitch} {column} {row}: {turn}");
            }
        }
    }
}

#[test]
fn farther_obstacles_stand_higher_in_the_image() {
    for camera in cameras().into_iter().filter(|c| c.distortion == 0.0) {
        let ground = Ground::new(&camera, SIZE.0, SIZE.1);
        for column in [0, 77, 160, 319] {
            let mut below = 0.0;
            for row in (1..240).rev() {
                let found = ground.locate(column, row as f32);
                let ahead = found.bearing.abs() < std::f32::consts::FRAC_PI_2;
                assert!(
                    !ahead || found.distance > below,
                    "{camera:?} {column} {row}: {found:?} after {below}"
                );
                below = if ahead { found.distance } else { 0.0 };
                if found.distance.is_infinite() {
                    break;
                }
            }
        }
    }
}

#[test]
fn distances_are_in_order() {
    for camera in cameras() {
        let ground = Ground::new(&camera, SIZE.0, SIZE.1);
        for column in [0, 77, 160, 319] {
            for row in -4..1000 {
                let found = ground.locate(column, row as f32 / 4.0);
                assert!(
                    0.0 <= found.nearest
                        && found.nearest <= found.distance
                        && found.distance <= found.farthest,
                    "{camera:?} {column}: {found:?}"
                );
            }
        }
    }
}

#[test]
fn an_obstacle_is_between_its_neighbours() {
    let ground = ground(0.8, 51.0, 90.0, -0.1);
    for row in [1.0, 17.25, 120.0, 200.5, 238.0] {
        let found = ground.locate(40, row);
        assert_eq!((found.row, found.status), (row, Status::Obstacle));
        let below = ground.locate(40, row + 1.0).distance;
        assert_eq!(found.nearest, below, "{found:?}");
        if row > 1.5 {
            assert_eq!(found.farthest, ground.locate(40, row - 1.0).distance, "{found:?}");
        }
        assert!(found.bearing > 0.0 && ground.locate(279, row).bearing < 0.0, "left is positive");
        assert_eq!(found.bearing, -ground.locate(279, row).bearing);
    }
}

#[test]
fn behind_the_camera_the_order_is_the_other_way_round() {
    let ground = ground(1.0, 85.0, 90.0, 0.0);
    let found = ground.locate(150, 230.0);
    assert!(found.bearing > std::f32::consts::FRAC_PI_2, "{found:?}");
    assert_eq!(found.farthest, ground.locate(150, 231.0).distance);
    assert_eq!(found.nearest, ground.locate(150, 229.0).distance);
}

#[test]
fn rows_beyond_the_last_count_as_the_last() {
    let ground = ground(0.8, 51.0, 90.0, 0.0);
    let last = ground.locate(10, 239.0);
    // The row below the last is seen by no pixel, but the formula reaches it.
    let (_, below) = oracle(&camera(0.8, 51.0, 90.0, 0.0), SIZE, 10.0, 240.0).expect("floor");
    assert!((f64::from(last.nearest) / below - 1.0).abs() < 1e-5);
    for row in [239.01, 240.0, 1e9, f32::MAX] {
        assert_eq!(ground.locate(10, row), Range { row, ..last });
    }
}

#[test]
fn ground_all_the_way_up_is_none_in_view() {
    let ground = ground(0.8, 51.0, 90.0, 0.0);
    let top = ground.locate(10, 0.5);
    assert_eq!(top.status, Status::Obstacle);
    let (bearing, edge) = oracle(&camera(0.8, 51.0, 90.0, 0.0), SIZE, 10.0, 0.0).expect("floor");
    let first = ground.locate(10, 0.0);
    for row in [0.499_999_97, 0.0, -0.0, -3.0, -1e30, f32::MIN] {
        let found = ground.locate(10, row);
        assert_eq!(found.status, Status::NoneInView);
        assert_eq!((found.row, found.distance, found.farthest), (row, f32::INFINITY, f32::INFINITY));
        assert_eq!((found.nearest, found.bearing), (first.nearest, first.bearing));
        assert!((f64::from(found.nearest) / edge - 1.0).abs() < 1e-5, "{found:?} {edge}");
        assert!((f64::from(found.bearing) - bearing).abs() < 1e-6);
        assert!(found.nearest > top.distance);
    }
}

#[test]
fn at_and_above_the_horizon_nothing_is_in_view() {
    // Without pitch the horizon is the middle of the image, between rows 119 and 120.
    let ground = ground(0.8, 0.0, 90.0, 0.0);
    for row in [1.0, 60.0, 119.0, 119.5] {
        let found = ground.locate(160, row);
        assert_eq!(found.status, Status::NoneInView);
        assert_eq!([found.distance, found.nearest, found.farthest], [f32::INFINITY; 3]);
        assert_eq!(found.bearing, ground.locate(160, 0.0).bearing);
    }
    let first = ground.locate(160, 120.0);
    assert_eq!((first.status, first.farthest), (Status::Obstacle, f32::INFINITY));
    assert!((first.distance - 0.8 * 320.0).abs() < 0.01, "{first:?}");
    assert!((first.nearest - 0.8 * 320.0 / 3.0).abs() < 0.01, "{first:?}");
}

#[test]
fn distances_beyond_measure_are_none() {
    // Below the horizon by less than the least normal number.
    let ground = Ground::new(
        &Camera { height: 1000.0, pitch: 1e-35, field_of_view: 90.0, distortion: 0.0 },
        SIZE.0,
        SIZE.1,
    );
    let found = ground.locate(0, 119.5);
    assert_eq!((found.status, found.distance), (Status::NoneInView, f32::INFINITY));
}

#[test]
fn no_number_is_invalid() {
    let ground = ground(0.8, 51.0, 90.0, 0.3);
    for row in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let found = ground.locate(300, row);
        assert_eq!(found.status, Status::Invalid);
        assert!(found.distance.is_nan() && found.nearest.is_nan() && found.farthest.is_nan(), "{found:?}");
        assert_eq!(found.bearing, ground.locate(300, 0.0).bearing);
        assert!(found.bearing < 0.0);
        assert_eq!(found.row.to_bits(), row.to_bits());
    }
}

#[test]
fn straight_below_the_lens() {
    // An odd size has a middle pixel, and looking straight down it shows the point under the lens.
    let camera = Camera { height: 2.0, pitch: 90.0, field_of_view: 60.0, distortion: 0.0 };
    let found = Ground::new(&camera, 33, 33).locate(16, 16.0);
    assert_eq!(found.status, Status::Obstacle);
    assert!(found.distance.abs() < 1e-6 && found.bearing.abs() < 1e-6, "{found:?}");
    assert!(found.nearest <= found.distance && found.farthest > 0.06, "{found:?}");
}

#[test]
fn medians() {
    let (nan, inf) = (f32::NAN, f32::INFINITY);
    let median = |current, previous, before| median_of_three(&mut Scalar, current, previous, before);
    let rows = [1.0, 2.0, 3.0];
    for order in [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]] {
        let [a, b, c] = order.map(|i| rows[i]);
        assert_eq!(median(a, b, c), 2.0);
    }
    assert_eq!(median(5.0, 5.0, 1.0), 5.0);
    for missing in [nan, inf, -inf] {
        // Of two the larger, whichever is missing.
        assert_eq!([median(1.0, 7.0, missing), median(7.0, 1.0, missing)], [7.0, 7.0]);
        assert_eq!([median(1.0, missing, 7.0), median(7.0, missing, 1.0)], [7.0, 7.0]);
        assert_eq!(median(-8.0, missing, nan), -8.0);
        assert_eq!(median(1e30, nan, missing), 1e30);
        assert_eq!(median(missing, 4.0, 5.0).to_bits(), missing.to_bits(), "old rows do not stand in");
    }
}

#[test]
fn the_largest_images() {
    let camera = Camera { height: 0.8, pitch: 40.0, field_of_view: 90.0, distortion: -0.2 };
    for size in [(16, 16), (65536, 65536), (16, 4096), (4096, 16)] {
        let camera =
            Camera { distortion: camera.distortion.max(-Camera::distortion_limit(size.0, size.1)), ..camera };
        camera.check(size.0, size.1).expect("possible");
        let ground = Ground::new(&camera, size.0, size.1);
        for (column, row) in [(0, size.1 - 1), (size.0 / 2, size.1 / 2), (size.0 - 1, size.1 - 2)] {
            let found = ground.locate(column, row as f32);
            let (_, distance) = oracle(&camera, size, f64::from(column), f64::from(row)).expect("floor");
            assert!(
                (f64::from(found.distance) / distance - 1.0).abs() < 1e-5,
                "{size:?}: {found:?} {distance}"
            );
            assert!(found.nearest <= found.distance && found.distance <= found.farthest);
        }
    }
}

#[test]
fn cameras_that_cannot_be() {
    let sound = Camera { height: 0.8, pitch: 51.0, field_of_view: 90.0, distortion: 0.0 };
    let said = |camera: Camera, size: (u32, u32)| match camera.check(size.0, size.1) {
        Ok(()) => String::new(),
        Err(error) => error.to_string(),
    };
    assert_eq!(said(sound, SIZE), "");
    for (camera, part) in [
        (Camera { height: 0.0, ..sound }, "`height` is 0, but must be 0.001 to 1000 metres"),
        (Camera { height: f64::NAN, ..sound }, "`height` is NaN"),
        (Camera { height: 1001.0, ..sound }, "`height`"),
        (Camera { pitch: 90.1, ..sound }, "`pitch` is 90.1, but must be -90 to 90 degrees"),
        (Camera { field_of_view: 180.0, ..sound }, "`field_of_view`"),
        (Camera { field_of_view: f64::INFINITY, ..sound }, "`field_of_view`"),
        (Camera { distortion: -1.0, ..sound }, "`distortion`"),
        (Camera { distortion: -0.6, ..sound }, "images of 320 x 240 pixels"),
        (Camera { distortion: 0.6, ..sound }, "images of 320 x 240 pixels"),
        (Camera { pitch: -51.0, ..sound }, "below the horizontal is positive"),
    ] {
        assert!(said(camera, SIZE).contains(part), "{camera:?}: {}", said(camera, SIZE));
    }
    // Whether a distortion goes depends on the shape of the image.
    assert_eq!(said(Camera { distortion: 0.6, ..sound }, (320, 160)), "");
}
