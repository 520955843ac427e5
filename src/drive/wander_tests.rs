//! The controller in rooms and corridors of its own.

use super::*;
use crate::drive::robot::{Body, Robot};
use crate::world::geometry::{Geometry, Outline, Ray, Room, Solid, Vec3};
use crate::world::office::Place;

const BEARINGS: [f64; 13] = [-0.9, -0.75, -0.6, -0.45, -0.3, -0.15, 0.0, 0.15, 0.3, 0.45, 0.6, 0.75, 0.9];

/// What they look at.
const FAN: View = View::Fan { half_angle: 0.9, farthest: 5.0 };

/// A wander through a hall with exact ranges from where the camera would be.
struct Walk {
    hall: Geometry,
    robot: Robot,
    wander: Wander,
    motion: Motion,
}

impl Walk {
    fn new(rooms: &[Room], solids: Vec<Solid>, (x, y, heading): (f64, f64, f64), seed: u64) -> Walk {
        let robot = Robot::new(Body::default(), Place { x, y, heading });
        let wander = Wander::new(Settings { seed, ..Settings::default() }, FAN);
        let hall = Geometry::new(rooms, solids, 2.5);
        Walk { hall, robot, wander, motion: Motion::default() }
    }

    fn readings(&self) -> Vec<Reading> {
        let place = self.robot.place();
        let (sin, cos) = libm::sincos(place.heading);
        let ahead = self.wander.settings().sensor_ahead;
        let origin = Vec3::new(place.x + ahead * cos, place.y + ahead * sin, 0.05);
        let reading = |&bearing: &f64| {
            let (sin, cos) = libm::sincos(place.heading + bearing);
            let distance = self.hall.cast(&Ray { origin, direction: Vec3::new(cos, sin, 0.0) }).distance;
            let reach = if distance < 3.0 { Reach::Obstacle(distance) } else { Reach::Free(3.0) };
            Reading { bearing, reach }
        };
        BEARINGS.iter().map(reading).collect()
    }

    /// A tenth of a second; gives the command and the distance to what is nearest.
    fn step(&mut self) -> (Command, f64) {
        let command = self.wander.steer(&self.readings(), self.motion, 0.1);
        self.motion = Motion::default();
        for _ in 0..5 {
            let part = self.robot.step(command, 0.02);
            self.motion.forward += part.forward;
            self.motion.turn += part.turn;
        }
        let place = self.robot.place();
        (command, self.hall.clearance(place.x, place.y, 5.0))
    }
}

fn room(x: (f64, f64), y: (f64, f64)) -> Room {
    Room { x, y }
}

fn all(reach: impl Fn(f64) -> Reach) -> Vec<Reading> {
    BEARINGS.iter().map(|&bearing| Reading { bearing, reach: reach(bearing) }).collect()
}

#[test]
fn where_all_is_free_it_goes_at_full_speed_and_nearly_straight() {
    let mut wander = Wander::new(Settings::default(), FAN);
    for _ in 0..300 {
        let command = wander.steer(&all(|_| Reach::Free(3.0)), Motion::default(), 0.1);
        assert_eq!(command.forward, 0.3);
        assert!(command.turn.abs() < 0.2, "{command:?}");
    }
}

/// What a broken sensor says is no free floor.
#[test]
fn numbers_that_are_none_tell_nothing() {
    for reach in [Reach::Obstacle(f64::NAN), Reach::Obstacle(-1.0), Reach::Free(f64::NAN), Reach::Free(-0.5)]
    {
        let mut wander = Wander::new(Settings::default(), FAN);
        assert_eq!(wander.steer(&all(|_| reach), Motion::default(), 0.1), Command::default(), "{reach:?}");
    }
    let mut wander = Wander::new(Settings::default(), FAN);
    let nowhere = [Reading { bearing: f64::NAN, reach: Reach::Free(3.0) }];
    assert_eq!(wander.steer(&nowhere, Motion::default(), 0.1), Command::default());
    let free = all(|_| Reach::Obstacle(f64::INFINITY));
    for motion in [Motion { forward: f64::NAN, turn: 0.0 }, Motion { forward: 0.0, turn: f64::INFINITY }] {
        assert_eq!(wander.steer(&free, motion, 0.1), Command::default());
    }
    assert_eq!(wander.steer(&free, Motion::default(), f64::NAN), Command::default());
    assert_eq!(wander.steer(&free, Motion::default(), 0.1).forward, 0.3);
    // One that is wrong takes nothing from the others.
    let blocked = |b: f64| if b == 0.0 { Reach::Obstacle(f64::NAN) } else { Reach::Obstacle(0.1) };
    assert_eq!(wander.steer(&all(blocked), Motion::default(), 0.1).forward, 0.0);
}

#[test]
fn a_wall_straight_ahead_is_never_hit() {
    for heading in [-0.7, -0.3, 0.0, 0.01, 0.5, 1.2] {
        for seed in 0..4 {
            let mut walk = Walk::new(&[room((0.0, 9.0), (-4.0, 4.0))], vec![], (6.0, 0.0, heading), seed);
            let mut nearest = f64::INFINITY;
            for _ in 0..1200 {
                nearest = nearest.min(walk.step().1);
            }
            assert!((0.25..1.0).contains(&nearest), "{heading} {seed}: {nearest}");
        }
    }
}

#[test]
fn blocked_it_turns_to_the_freer_side_and_keeps_turning() {
    for side in [1.0, -1.0] {
        let mut wander = Wander::new(Settings::default(), FAN);
        // Close to a wall that is open on one side.
        let open = |b: f64| if b > 0.2 { Reach::Free(3.0) } else { Reach::Obstacle(0.1) };
        let first = wander.steer(&all(|b| open(b * side)), Motion::default(), 0.1);
        assert_eq!(first, Command { forward: 0.0, turn: side * 0.9 });
        // The other side seems freer now and then: it does not dither.
        for i in 0..20 {
            let now = if i % 2 == 0 { -side } else { side };
            let command =
                wander.steer(&all(|b| open(b * now)), Motion { forward: 0.0, turn: side * 0.05 }, 0.1);
            assert_eq!(command, first, "{i}");
        }
        assert!(wander.is_turning());
    }
}

#[test]
fn a_corridor_is_kept_to_its_middle() {
    for (y, heading) in [(0.55, 0.0), (-0.6, -0.2), (0.3, 0.5)] {
        let mut walk = Walk::new(&[room((0.0, 60.0), (-1.0, 1.0))], vec![], (1.0, y, heading), 3);
        let mut off: f64 = 0.0;
        for i in 0..1500 {
            walk.step();
            if i > 150 {
                off = off.max(walk.robot.place().y.abs());
            }
        }
        assert!(off < 0.45, "{off} from {y}");
        assert!(walk.robot.place().x > 30.0, "{:?}", walk.robot.place());
    }
}

#[test]
fn it_does_not_go_round_in_circles() {
    for side in [3.0, 4.5, 12.0] {
        for seed in 0..4 {
            let rooms = [room((0.0, side), (0.0, side)), room((side - 0.1, side + 20.0), (0.0, 2.0))];
            let mut walk = Walk::new(&rooms, vec![], (side / 2.0, side / 2.0, 0.4), seed);
            let mut squares = std::collections::BTreeSet::new();
            for _ in 0..3000 {
                assert!(walk.step().1 > 0.24);
                let Place { x, y, .. } = walk.robot.place();
                squares.insert((x.floor() as i64, y.floor() as i64));
            }
            assert!(squares.len() > 15, "{side} {seed}: {squares:?}");
        }
    }
}

#[test]
fn a_dead_end_is_left() {
    // An alley of 1 m, closed at its end, off a hall.
    let rooms = [room((0.0, 6.0), (-3.0, 3.0)), room((5.9, 9.0), (-0.5, 0.5))];
    for seed in 0..6 {
        let mut walk = Walk::new(&rooms, vec![], (6.5, 0.0, 0.0), seed);
        let (mut nearest, mut left) = (f64::INFINITY, None);
        for i in 0..1200 {
            nearest = nearest.min(walk.step().1);
            if left.is_none() && walk.robot.place().x < 5.0 {
                left = Some(i);
            }
        }
        assert!(left.is_some() && nearest > 0.24, "{seed}: {left:?} {nearest}");
    }
}

#[test]
fn what_has_been_passed_is_not_turned_into() {
    // A pillar beside the body, out of view: the freest way is to that side, if one has forgotten it.
    let pillar = Solid { outline: Outline::Round { x: 3.0, y: 0.55, radius: 0.1 }, height: 1.0 };
    for seed in 0..8 {
        let rooms = [room((0.0, 4.2), (-0.5, 6.0))];
        let mut walk = Walk::new(&rooms, vec![pillar], (1.0, 0.0, 0.0), seed);
        let nearest = (0..900).map(|_| walk.step().1).fold(f64::INFINITY, f64::min);
        assert!(nearest > 0.24, "{seed}: {nearest}");
    }
}

#[test]
fn unknown_readings_count_for_nothing() {
    let mut wander = Wander::new(Settings::default(), FAN);
    assert_eq!(wander.steer(&all(|_| Reach::Unknown), Motion::default(), 0.1), Command::default());
    assert_eq!(wander.steer(&[], Motion::default(), 0.1), Command::default());
    let command = wander.steer(
        &all(|b| if b > 0.0 { Reach::Free(3.0) } else { Reach::Unknown }),
        Motion::default(),
        0.1,
    );
    assert!(command.forward > 0.0);
}

#[test]
fn it_follows_from_readings_and_seed() {
    let walked = |seed| {
        let mut walk = Walk::new(&[room((0.0, 8.0), (-3.0, 3.0))], vec![], (2.0, 0.0, 0.3), seed);
        for _ in 0..600 {
            walk.step();
        }
        walk.robot.place()
    };
    assert_eq!(walked(1), walked(1));
    assert_ne!(walked(1), walked(2));
}
