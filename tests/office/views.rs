//! What is seen from a place: labels, distances, exposure.

use vsonar::camera::Camera;
use vsonar::world::SetupError;
use vsonar::world::geometry::Outline;
use vsonar::world::office::{
    ItemKind, Kind, Moment, Office, OfficeError, Part, Place, Plan, Setup, Thing, drive,
};

fn straight() -> Setup {
    let setup = Setup::default();
    Setup { width: 160, height: 120, camera: Camera { distortion: 0.0, ..setup.camera }, ..setup }
}

/// The direction of a pixel's ray by a camera of its own: straightened by the division model, turned by pitch, then by
/// heading.
fn direction(setup: &Setup, place: &Place, column: u32, row: u32) -> [f64; 3] {
    let (half, k) = (f64::from(setup.width) / 2.0, setup.camera.distortion);
    let left = -(f64::from(column) + 0.5 - half) / half;
    let up = -(f64::from(row) + 0.5 - f64::from(setup.height) / 2.0) / half;
    let scale = (setup.camera.field_of_view.to_radians() / 2.0).tan() * (1.0 + k)
        / (1.0 + k * (left * left + up * up));
    let (left, up) = (left * scale, up * scale);
    let (sin, cos) = setup.camera.pitch.to_radians().sin_cos();
    let (ahead, z) = (cos + up * sin, up * cos - sin);
    let (sin, cos) = place.heading.sin_cos();
    [ahead * cos - left * sin, ahead * sin + left * cos, z]
}

/// Whether a ray reaches the floor, by walking along it in small steps: no plane, no root, no normal is used.
fn walks_to_floor(office: &Office, parts: &[&Part], from: (f64, f64), d: [f64; 3]) -> bool {
    let height = office.camera().height;
    let (end, steps) = (-height / d[2], 1200);
    (0..=steps).all(|i| {
        let t = end * f64::from(i) / f64::from(steps);
        let (x, y, z) = (from.0 + d[0] * t, from.1 + d[1] * t, height + d[2] * t);
        let solid = parts.iter().any(|part| {
            let within = match part.outline {
                Outline::Box(room) => room.contains(x, y),
                Outline::Round { x: cx, y: cy, radius } => (x - cx).hypot(y - cy) <= radius,
            };
            within && part.low <= z && z <= part.high
        });
        !solid && office.rooms().iter().any(|room| room.contains(x, y))
    })
}

/// Which share of the labels of three buildings a walk agrees with, seen through lenses that bend so much.
fn agreeing(distortions: [f64; 3]) -> f64 {
    let (mut close, mut all) = (0, 0);
    let kinds = [(Kind::Nsh, false), (Kind::Fmrb, false), (Kind::Nsh, true)];
    for ((kind, unseen), distortion) in kinds.into_iter().zip(distortions) {
        let setup = straight();
        let setup = Setup { camera: Camera { distortion, ..setup.camera }, ..setup };
        let plan = if unseen { Plan::generate(kind, 5, true) } else { kind.plan() };
        // they walk: the plan does not tell where they are
        let plan = Plan { people: Vec::new(), ..plan };
        let office = Office::build(&plan, &setup, 1).unwrap();
        let moment = office.at(0.0);
        for shot in drive(&office, 36, 3).unwrap().iter().step_by(3) {
            let place = shot.place;
            let from = moment.camera(&place);
            let near = |part: &&Part| part.outline.distance(from.0, from.1) < 6.0;
            let parts: Vec<&Part> = office.parts().iter().filter(near).collect();
            for column in setup.labelled() {
                let ray = |row: u32| direction(&setup, &place, column, row);
                let blocked = |row: &u32| !walks_to_floor(&office, &parts, from, ray(*row));
                let walked = (0..setup.height).rev().find(blocked).unwrap_or(0);
                all += 1;
                // a step may jump over the very edge of a solid
                close += u32::from(walked.abs_diff(moment.label(&place, column)) <= 1);
            }
        }
    }
    f64::from(close) / f64::from(all)
}

#[test]
fn labels_agree_with_a_walk_through_the_plan() {
    let share = agreeing([0.0; 3]);
    assert!(share >= 0.995, "{share}");
}

#[test]
fn the_lens_bends_labels_as_the_camera_says() {
    assert!(Setup::default().camera.distortion != 0.0);
    let share = agreeing([-0.2, 0.1, Setup::default().camera.distortion]);
    assert!(share >= 0.995, "{share}");
}

#[test]
fn masks_and_labels_say_the_same() {
    let office = Office::preset(Kind::Nsh);
    for shot in drive(&office, 12, 4).unwrap() {
        let moment = shot.moment(&office);
        let floor = moment.floor(&shot.place);
        for column in (0..320).step_by(29) {
            let blocked = |row: &u32| !floor[(row * 320 + column) as usize];
            assert_eq!((0..240).rev().find(blocked).unwrap_or(0), moment.label(&shot.place, column));
        }
    }
}

const HALL: &str = "plan 1\nroom 0 40 -1 1\nlight 2 0 1.2 0.3 1\nlight 5 0 1.2 0.3 1\n";

fn hall(more: &str) -> Office {
    let plan: Plan = format!("{HALL}{more}").parse().unwrap();
    Office::build(&plan, &Setup::default(), 1).unwrap()
}

fn seen(moment: &Moment<'_>, x: f64) -> u32 {
    moment.label(&Place { x, y: 0.0, heading: 0.0 }, 160)
}

#[test]
fn what_hovers_is_in_the_way() {
    let office = hall("table 5 0 1 1 0.72 0.4\nperson 1 0.1 20 0 30 0\n");
    let moment = office.at(0.0);
    let nearest = moment.nearest(4.2, 0.0, 1.0);
    assert_eq!(nearest.thing, Some(Thing::Item(ItemKind::Table)));
    assert!((nearest.distance - 0.3).abs() < 1e-9 && (nearest.point.0 - 4.5).abs() < 1e-9);
    assert!((moment.range(3.0, 0.0, 0.0, 4.0) - 1.5).abs() < 1e-9);
    // from 1 m the camera sees floor between the legs as far as it sees; from 22 cm the edge of the top hides it
    assert_eq!(seen(&moment, 3.2), 0);
    let row = f64::from(seen(&moment, 4.0));
    let (ahead, _) = office.camera().floor((320, 240), 160.0, row).unwrap();
    assert!((1.58..1.75).contains(&ahead), "0.22 m * 0.8 / (0.8 - 0.69), and {ahead}");
    let person = moment.nearest(20.6, 0.0, 2.0);
    assert_eq!(person.thing, Some(Thing::Person));
    assert!((person.distance - 0.38).abs() < 1e-9 && moment.people() == [(20.0, 0.0, 0.22)]);
    assert!((moment.range(18.0, 0.0, 0.0, 4.0) - 1.78).abs() < 1e-9);
    assert!((office.at(3.0).people()[0].0 - 23.0).abs() < 1e-9, "he walks");
    // his legs, not what is between them
    let legs = moment.labels(&Place { x: 19.0, y: 0.0, heading: 0.0 }, [140, 160, 180]);
    assert!(legs[0] > 50 && legs[1] == 0 && legs[2] > 50, "{legs:?}");
}

#[test]
fn the_camera_does_not_pass_through_walls() {
    let office = hall("");
    let moment = office.at(0.0);
    let (x, _) = moment.camera(&Place { x: 39.8, y: 0.0, heading: 0.0 });
    assert!((x - 39.99).abs() < 1e-9);
    assert!(seen(&moment, 39.8) > 230, "the wall fills the picture");
    assert_eq!(seen(&moment, 20.0), 0, "nothing but floor");
}

#[test]
fn exposure_follows_slowly() {
    let office = hall("light 2 0.5 1.2 0.3 3\nlight 5 0.5 1.2 0.3 3\n");
    let mean = |picture: image::GrayImage| {
        picture.as_raw().iter().map(|&v| f64::from(v)).sum::<f64>() / f64::from(320 * 240)
    };
    let (bright, dim) = (Place { x: 3.5, y: 0.0, heading: 0.0 }, Place { x: 7.5, y: 0.0, heading: 0.0 });
    let mut grabber = office.grabber(1);
    grabber.take(&office.at(0.0), &bright);
    let mut sudden = grabber.clone();
    let sudden = mean(sudden.take(&office.at(0.6), &dim));
    grabber.look(&office.at(0.6), &dim);
    grabber.look(&office.at(3.0), &dim);
    let later = mean(grabber.take(&office.at(3.6), &dim));
    assert!(later > sudden + 5.0, "{sudden} {later}");
    // noise differs from frame to frame and from seed to seed, and nothing else is random
    let take = |seed| office.grabber(seed).take(&office.at(0.0), &bright);
    assert_eq!(take(1), take(1));
    assert_ne!(take(1), take(2));
}

#[test]
fn the_robot_casts_a_shadow() {
    // one light behind the robot: the floor before it is darker than beside its shadow
    let plan: Plan = "plan 1\nroom 0 9 -3 3\nlight 2 0 0.3 0.3 1\n".parse().unwrap();
    let quiet = Setup { noise: 0.0, interlace: 0.0, ..Setup::default() };
    let office = Office::build(&plan, &quiet, 1).unwrap();
    let picture = office.grabber(1).take(&office.at(0.0), &Place { x: 3.2, y: 0.0, heading: 0.0 });
    let mean = |from: u32| {
        let area = (from..from + 20).flat_map(|x| (190..220).map(move |y| (x, y)));
        area.map(|(x, y)| f64::from(picture.get_pixel(x, y).0[0])).sum::<f64>() / 600.0
    };
    assert!(mean(150) + 20.0 < mean(20), "{} {}", mean(150), mean(20));
}

#[test]
fn bad_settings_are_errors() {
    let fails = |setup: Setup| Office::build(&Kind::Nsh.plan(), &setup, 1).unwrap_err();
    assert!(matches!(
        fails(Setup { width: 15, ..Setup::default() }),
        OfficeError::Setup(SetupError::Size { .. })
    ));
    assert!(matches!(
        fails(Setup { height: 5000, ..Setup::default() }),
        OfficeError::Setup(SetupError::Size { .. })
    ));
    assert!(matches!(
        fails(Setup { columns: 0, ..Setup::default() }),
        OfficeError::Setup(SetupError::Columns { .. })
    ));
    let error = fails(Setup { noise: f64::NAN, ..Setup::default() });
    assert!(error.to_string().contains("noise"), "{error}");
    let bad = Plan { wall: 7.0, ..Kind::Nsh.plan() };
    assert!(matches!(Office::build(&bad, &Setup::default(), 1), Err(OfficeError::Plan(_))));
    for seed in 0..20 {
        let varied = Setup::default().varied(seed);
        varied.check().unwrap();
        let off = varied.camera.pitch - 51.0;
        assert!((2.0..=4.0).contains(&off.abs()) && (varied.camera.height - 0.8).abs() <= 0.04);
        assert!((0.7..=1.3).contains(&(varied.exposure / Setup::default().exposure)));
    }
}

#[test]
fn a_turning_robots_labels_are_those_of_its_picture() {
    // dark floor and light walls, so that the picture itself tells what is floor
    let plan: Plan = "plan 1\ncarpet 0.01 0\nwall 0.95 0\nskirting 0.95 0.1\nroom 0 6 -1.5 1.5\n\
                      box 2 0.8 0.6 0.4 0.5 0.95\nlight 1.5 0 1.2 0.3 1\nlight 4.5 0 1.2 0.3 1\n"
        .parse()
        .unwrap();
    let setup = Setup { noise: 0.0, interlace: 0.0, softness: 0.0, digitizer: false, ..Setup::default() };
    // what the lines' brightness is must not matter: it is the default that interlaces
    let interlaced = Setup { interlace: Setup::default().interlace, ..setup.clone() };
    let mut tried = 0;
    for setup in [setup, interlaced] {
        let office = Office::build(&plan, &setup, 1).unwrap();
        let mut grabber = office.grabber(1);
        for frame in 0..30 {
            let time = f64::from(frame) * 0.1;
            let place = Place { x: 3.0 + 0.05 * time, y: 0.0, heading: 0.9 * time };
            let moment = office.at(time);
            let picture = grabber.take(&moment, &place);
            let floor = moment.floor(&place);
            for column in (3..320).step_by(29) {
                let label = moment.label(&place, column);
                let value = |row: u32| u32::from(picture.get_pixel(column, row).0[0]);
                let below: Vec<u32> = (label + 1..240).map(value).collect();
                assert!((label + 1..240).all(|row| floor[(row * 320 + column) as usize]));
                if (1..239).contains(&label) {
                    tried += 1;
                    let most = below.iter().copied().max().unwrap_or(0);
                    assert!(value(label) > 2 * value(label + 1), "{frame} {column} {label}");
                    assert!(2 * most < 3 * value(label), "{frame} {column} {label}: {most}");
                }
            }
        }
    }
    assert!(tried > 300, "{tried}");
}

#[test]
fn above_the_horizon_is_no_carpet() {
    // black carpet and walls without lights, under a ceiling with some
    let plan: Plan =
        "plan 1\ncarpet 0.01 0\nroom 0 40 -3 3\nroom 39 40 -9 9\nlight 4 0 1.2 0.6 1\nlight 8 0 1.2 0.6 1\n\
                      light 12 0 1.2 0.6 1\n"
            .parse()
            .unwrap();
    let camera = Camera { pitch: 10.0, ..Setup::default().camera };
    let setup = Setup { camera, noise: 0.0, interlace: 0.0, ..Setup::default() };
    let office = Office::build(&plan, &setup, 1).unwrap();
    let (moment, place) = (office.at(0.0), Place { x: 1.0, y: 0.0, heading: 0.0 });
    let floor = moment.floor(&place);
    let picture = office.grabber(1).take(&moment, &place);
    let horizon =
        (0..240).find(|&row| office.camera().floor((320, 240), 160.0, f64::from(row)).is_some()).unwrap();
    assert!((60..110).contains(&horizon), "{horizon}");
    assert!(floor[..horizon as usize * 320 - 10 * 320].iter().all(|floor| !floor));
    assert!(floor[200 * 320..].iter().all(|floor| *floor));
    let bright = |rows: std::ops::Range<u32>| {
        rows.flat_map(|row| (0..320).map(move |x| (x, row)))
            .filter(|&(x, y)| picture.get_pixel(x, y).0[0] >= 250)
            .count()
    };
    assert!(bright(0..horizon) > 100, "panels are seen: {}", bright(0..horizon));
    assert_eq!(bright(horizon + 20..240), 0);
    assert!(
        moment.labels(&place, 0..320).iter().all(|&label| label + 1 >= horizon),
        "walls end at the floor"
    );
}

#[test]
fn runs_start_in_different_places() {
    for office in [Office::preset(Kind::Fmrb), Office::preset(Kind::Nsh), Office::new(Kind::Nsh, 3)] {
        let starts: Vec<Place> = (0..16).map(|run| office.start(run)).collect();
        for (i, a) in starts.iter().enumerate() {
            let moment = office.at(0.0);
            assert!(moment.nearest(a.x, a.y, 1.0).distance > 0.5);
            assert!(moment.range(a.x, a.y, a.heading, 9.0) > 1.2);
            assert!(starts[..i].iter().all(|b| (a.x - b.x).hypot(a.y - b.y) > 0.45), "{i}");
        }
        let spread =
            starts.iter().map(|a| a.x).fold(0.0, f64::max) - starts.iter().map(|a| a.x).fold(99.0, f64::min);
        assert!(spread > 10.0, "{spread}");
    }
}
