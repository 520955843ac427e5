//! The synthetic corridor: the same on every machine, its labels true to the geometry, worth learning.

use vsonar::camera::Camera;
use vsonar::dataset::{Constants, Dataset, TOLERANCE};
use vsonar::world::camera::Pose;
use vsonar::world::geometry::{Geometry, Outline, Ray, Surface, Vec3};
use vsonar::world::render::Scene;
use vsonar::world::{Corridor, FRAMES, SetupError, default_dataset};

fn small() -> Corridor {
    Corridor { width: 64, height: 48, ..Corridor::default() }
}

#[test]
fn a_seed_is_a_set() {
    let set = small().render(1, 5).unwrap();
    assert_eq!(
        set.fingerprint(),
        PINNED,
        "the rendered pictures or labels changed: {:#018x}",
        set.fingerprint()
    );
    let threads = |n| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap();
        pool.install(|| small().render(1, 5).unwrap())
    };
    assert_eq!(threads(1), set);
    assert_eq!(threads(2), set);
    assert_ne!(small().render(2, 5).unwrap().fingerprint(), set.fingerprint());
}

/// Of the small pictures of seed 1. A change of it is a change of every set rendered by seed: say so in the
/// change log.
const PINNED: u64 = 0x953a_7c6b_b4e1_13f5;

/// A camera of its own: turns the pixel's direction by pitch and then by yaw.
fn ray(corridor: &Corridor, pose: &Pose, column: u32, row: u32) -> Ray {
    let half = (corridor.field_of_view / 2.0).tan();
    let scale = half * 2.0 / f64::from(corridor.width);
    let left = -(f64::from(column) + 0.5 - f64::from(corridor.width) / 2.0) * scale;
    let up = -(f64::from(row) + 0.5 - f64::from(corridor.height) / 2.0) * scale;
    let (sin, cos) = pose.pitch.sin_cos();
    let (ahead, z) = (cos + up * sin, up * cos - sin);
    let (sin, cos) = pose.yaw.sin_cos();
    let direction = Vec3::new(ahead * cos - left * sin, ahead * sin + left * cos, z);
    Ray { origin: Vec3::new(pose.x, pose.y, pose.z), direction }
}

fn is_floor(geometry: &Geometry, ray: &Ray) -> bool {
    geometry.cast(ray).surface == Surface::Floor
}

#[test]
fn labels_are_the_first_row_that_is_not_floor() {
    let corridor = small();
    let frames = 12;
    for seed in 1..4 {
        let set = corridor.render(seed, frames).unwrap();
        let scene = Scene::new(&corridor, seed);
        let poses = scene.poses(frames);
        let geometry = &scene.building().geometry;
        for case in set.cases() {
            let floor = |row| is_floor(geometry, &ray(&corridor, &poses[case.image], case.x, row));
            let below = (case.y + 1..corridor.height).all(floor);
            assert!(below && (case.y == 0 || !floor(case.y)), "seed {seed}, {case:?}");
        }
    }
}

/// Whether a ray reaches the floor, by walking along it in small steps through the plan: no wall, no normal, no
/// equation is used.
fn walks_to_floor(scene: &Scene, ray: &Ray) -> bool {
    let building = scene.building();
    let inside = |x: f64, y: f64| building.rooms.iter().any(|r| r.contains(x, y));
    let end = -ray.origin.z / ray.direction.z;
    let steps = 2000;
    (0..=steps).all(|i| {
        let p = ray.origin + ray.direction * (end * f64::from(i) / f64::from(steps));
        let solid = |s: &vsonar::world::geometry::Solid| {
            let within = match s.outline {
                Outline::Box(room) => room.contains(p.x, p.y),
                Outline::Round { x, y, radius } => (p.x - x).hypot(p.y - y) <= radius,
            };
            within && p.z <= s.height
        };
        inside(p.x, p.y) && !building.geometry.solids().iter().any(solid)
    })
}

#[test]
fn labels_agree_with_a_walk_through_the_plan() {
    let corridor = small();
    let mut close = 0;
    let mut all = 0;
    for seed in 1..4 {
        let scene = Scene::new(&corridor, seed);
        for pose in scene.poses(12) {
            for x in corridor.labelled() {
                let floor = |row: &u32| walks_to_floor(&scene, &ray(&corridor, &pose, x, *row));
                let walked = (0..corridor.height).rev().find(|row| !floor(row)).unwrap_or(0);
                all += 1;
                // a step may jump over the very edge of a solid
                close += u32::from(walked.abs_diff(scene.label(&pose, x)) <= 1);
            }
        }
    }
    assert!(close * 1000 >= all * 995, "{close} of {all}");
}

#[test]
fn the_default_sets_are_worth_learning() {
    for seed in 0..4 {
        let set = default_dataset(seed);
        assert_eq!((set.width(), set.height(), set.images().len()), (320, 240, FRAMES));
        assert_eq!(set.cases().len(), 6 * FRAMES);
        assert_eq!(set.columns(), [27, 80, 133, 187, 240, 293]);
        let share = Constants::learn(&set, TOLERANCE).score(&set).per_column_share();
        assert!(share < 0.5, "seed {seed}: the best constants get {share}");
        let mut labels = set.labels();
        labels.sort_unstable();
        labels.dedup();
        assert!(labels.len() > 60, "seed {seed}: only {} different labels", labels.len());
        let edge = set.cases().iter().filter(|c| sees_edge(&set, c.image, c.x, c.y)).count();
        let inner = set.cases().iter().filter(|c| c.y >= 4 && c.y <= 235).count();
        assert!(edge * 2 >= inner, "seed {seed}: {edge} of {inner} labels are at a visible edge");
    }
}

/// Whether the mean gray value of some rows just above the label differs from that of those just below.
fn sees_edge(set: &Dataset, image: usize, x: u32, y: u32) -> bool {
    if !(4..=235).contains(&y) {
        return false;
    }
    let pixels = &set.images()[image].pixels;
    let mean = |from: u32, to: u32| {
        let rows = (from..=to).flat_map(|y| (x - 2..=x + 2).map(move |x| (x, y)));
        rows.map(|(x, y)| f64::from(pixels.get_pixel(x, y).0[0])).sum::<f64>()
            / f64::from(5 * (to - from + 1))
    };
    (mean(y - 3, y - 1) - mean(y + 2, y + 4)).abs() > 8.0
}

#[test]
fn the_digitizer_leaves_no_value_below_32_but_16() {
    let values = |corridor: &Corridor| {
        let set = corridor.render(2, 8).unwrap();
        let mut values: Vec<u8> = set.images().iter().flat_map(|i| i.pixels.as_raw().clone()).collect();
        values.sort_unstable();
        values.dedup();
        values
    };
    assert!(values(&small()).iter().all(|&v| v == 16 || v >= 32));
    let plain = Corridor { digitizer: false, ..small() };
    assert!(values(&plain).iter().any(|&v| v < 32 && v != 16));
}

#[test]
fn bad_settings_are_errors() {
    let fails = |corridor: Corridor, frames| corridor.render(1, frames).unwrap_err();
    assert!(matches!(fails(Corridor { width: 15, ..small() }, 1), SetupError::Size { .. }));
    assert!(matches!(fails(Corridor { height: 5000, ..small() }, 1), SetupError::Size { .. }));
    assert!(matches!(fails(Corridor { columns: 0, ..small() }, 1), SetupError::Columns { .. }));
    assert!(matches!(fails(Corridor { columns: 65, ..small() }, 1), SetupError::Columns { .. }));
    assert!(matches!(fails(small(), 0), SetupError::Frames(0)));
    // What a camera's file may give is within the settings' limits.
    for (height, pitch, field_of_view, sound) in
        [(0.05, 0.0, 5.8, true), (2.0, 85.9, 171.8, true), (1.0, 86.0, 90.0, false), (1.0, 9.0, 171.9, false)]
    {
        let camera = Camera { height, pitch, field_of_view, distortion: 0.0 };
        assert_eq!(small().check_camera(&camera).is_ok(), sound, "{camera:?}");
        assert!(!sound || small().seen_by(&camera).render(1, 1).is_ok(), "{camera:?}");
    }
    let error = fails(Corridor { pitch: f64::NAN, ..small() }, 1);
    assert!(error.to_string().contains("pitch"), "{error}");
    // every column can be labelled
    let full = Corridor { width: 16, height: 16, columns: 16, ..Corridor::default() };
    assert_eq!(full.render(1, 1).unwrap().columns(), (0..16).collect::<Vec<u32>>());
}
