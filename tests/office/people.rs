//! Those who walk about: past things, and never into a robot.

use vsonar::world::office::{BODY_HEIGHT, Kind, Office, Person, Place, Plan, Setup, drive};

/// Radii of a person and of the robot's body.
const PERSON: f64 = 0.22;
const ROBOT: f64 = 0.24;

fn small() -> Setup {
    Setup { width: 64, height: 48, ..Setup::default() }
}

/// Points of a path, 2 cm apart.
fn points(person: &Person) -> Vec<(f64, f64)> {
    let corners = person.path.iter().zip(person.path.iter().cycle().skip(1));
    let side = |(a, b): (&(f64, f64), &(f64, f64))| {
        let (a, b) = (*a, *b);
        let steps = ((b.0 - a.0).hypot(b.1 - a.1) / 0.02).ceil().max(1.0);
        (0..steps as u32).map(move |k| {
            let part = f64::from(k) / steps;
            (a.0 + (b.0 - a.0) * part, a.1 + (b.1 - a.1) * part)
        })
    };
    corners.flat_map(side).collect()
}

#[test]
fn nobody_walks_through_things_or_walls() {
    let generated = (0..12).map(|seed| Plan::generate(Kind::Nsh, seed, seed % 2 == 1));
    let mut things = 0;
    for (i, plan) in [Kind::Nsh.plan()].into_iter().chain(generated).enumerate() {
        let setup = Setup { width: 16, height: 16, columns: 1, ..Setup::default() };
        // light takes the time, and does not matter
        let office = Office::build(&Plan { lights: Vec::new(), ..plan.clone() }, &setup, 0).unwrap();
        things += plan.items.len();
        for person in &plan.people {
            for (x, y) in points(person) {
                for part in office.parts().iter().filter(|part| part.low < BODY_HEIGHT) {
                    let away = part.outline.distance(x, y);
                    assert!(away >= PERSON, "{i}: {:?} is {away} from ({x}, {y})", part.thing);
                }
                for wall in office.walls() {
                    let along = if wall.along_y { y } else { x };
                    let (wx, wy) = wall.foot(along.clamp(wall.span.0, wall.span.1));
                    assert!((wx - x).hypot(wy - y) >= PERSON, "{i}: a wall at ({x}, {y})");
                }
            }
        }
    }
    assert!(things > 13 * 15, "the ways are free, the hallways not empty: {things}");
}

/// Distance from the robot to the nearest person in all shots of a drive.
fn nearest(office: &Office, frames: usize, seed: u64) -> f64 {
    let shots = drive(office, frames, seed).unwrap();
    let mut least = f64::INFINITY;
    for shot in &shots {
        for (x, y, radius) in shot.moment(office).people() {
            least = least.min((x - shot.place.x).hypot(y - shot.place.y) - radius);
        }
    }
    least
}

#[test]
fn nobody_walks_into_a_robot_that_drives() {
    let build = |plan: &Plan, seed| Office::build(plan, &small(), seed).unwrap();
    let mut all = f64::INFINITY;
    for (name, office, frames, seed) in [
        ("nsh", build(&Kind::Nsh.plan(), 0), 69, 4),
        ("nsh again", build(&Kind::Nsh.plan(), 0), 140, 1),
        ("1", build(&Plan::generate(Kind::Nsh, 1, false), 1), 69, 1),
        ("2", build(&Plan::generate(Kind::Nsh, 2, true), 2), 69, 2),
        ("3", build(&Plan::generate(Kind::Nsh, 3, false), 3), 69, 3),
        ("4", build(&Plan::generate(Kind::Nsh, 4, true), 4), 69, 4),
    ] {
        let least = nearest(&office, frames, seed);
        assert!(least > ROBOT, "{name}: {least}");
        all = all.min(least);
    }
    assert!(all < 1.0, "they meet: {all}");
}

#[test]
fn they_wait_then_turn_round() {
    let plan: Plan = "plan 1\nroom 0 20 -1 1\nperson 1 0.1 1 0 19 0\nlight 5 0 1 1 1\n".parse().unwrap();
    let office = Office::build(&plan, &small(), 1).unwrap();
    let robot = Place { x: 6.0, y: 0.0, heading: 0.0 };
    let mut crowd = office.crowd();
    let mut at = Vec::new();
    for frame in 0..200 {
        crowd.advance(f64::from(frame) * 0.1, Some(&robot));
        at.push(crowd.moment().people()[0].0);
    }
    let most = at[..100].iter().copied().fold(0.0, f64::max);
    assert!((4.9..5.15).contains(&most), "0.75 m before the body: {most}");
    let waited = at[..100].iter().filter(|x| **x == most).count();
    assert!((30..=32).contains(&waited), "3 seconds: {waited} frames");
    assert!(at[110] < most - 2.0, "he walks back: {}", at[110]);
    // with nobody in the way he is where the script has him, however the time is cut
    let mut crowd = office.crowd();
    [0.3, 0.35, 7.0].into_iter().for_each(|t| crowd.advance(t, None));
    let (free, script) = (crowd.moment().people()[0].0, office.at(7.0).people()[0].0);
    assert!((free - script).abs() < 1e-9, "{free} {script}");
}
