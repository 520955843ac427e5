//! What a robot knows to be around it: points in its own frame, and how far it can go among them.

use super::robot::chord;
use super::wander::{Reach, Reading, View};
use crate::detector::Motion;

/// A point of an obstacle.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Point {
    /// Ahead of the centre of the body, in metres.
    x: f64,
    /// To the left of it, in metres.
    y: f64,
    /// Seconds since it was seen.
    age: f64,
}

/// How free an arc is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Way {
    /// Metres until the body would come nearer to a point than its margin.
    pub(super) free: f64,
    /// The least distance of the body's edge to a point beside the arc's first part, in metres.
    pub(super) clear: f64,
    /// The same where that part ends: what the arc leads to, however narrow it is here.
    pub(super) then: f64,
}

/// The points known, and the body among them.
#[derive(Debug, Clone)]
pub(super) struct Around {
    points: Vec<Point>,
}

impl Around {
    pub(super) fn new() -> Around {
        Around { points: Vec::new() }
    }

    /// The robot has moved: all points have, the other way.
    pub(super) fn moved(&mut self, motion: Motion, seconds: f64) {
        let (along, aside) = chord(motion);
        let (sin, cos) = libm::sincos(motion.turn);
        for point in &mut self.points {
            let (x, y) = (point.x - along, point.y - aside);
            *point = Point { x: cos * x + sin * y, y: cos * y - sin * x, age: point.age + seconds };
        }
    }

    /// Takes in what the sensor, so far ahead of the body's centre and with such a view, sees, and forgets what is out of
    /// date: a point in view after `fresh` seconds, another after `memory`. What hides behind an obstacle that is seen now
    /// is not in view.
    pub(super) fn seen(
        &mut self,
        readings: &[Reading],
        (ahead, view): (f64, &View),
        (fresh, memory): (f64, f64),
        far: f64,
    ) {
        self.points.retain(|point| {
            let (x, y) = (point.x - ahead, point.y);
            let most = if view.holds(x, y) && !hidden(x, y, readings) { fresh } else { memory };
            point.age <= most && libm::hypot(point.x, point.y) < far
        });
        for reading in readings {
            if let Reach::Obstacle(distance) = reading.reach
                && distance < far
            {
                let (sin, cos) = libm::sincos(reading.bearing);
                self.points.push(Point { x: ahead + distance * cos, y: distance * sin, age: 0.0 });
            }
        }
    }

    /// How far the centre of a body can go along an arc (1/radius, positive to the left) of at most `horizon` metres,
    /// staying `margin` away from all points. From one that is nearer already it need only not come nearer still.
    pub(super) fn way(&self, curvature: f64, radius: f64, margin: f64, horizon: f64) -> Way {
        let mut free = horizon;
        for point in &self.points {
            let keep = (radius + margin).min(libm::hypot(point.x, point.y) - SLACK).max(radius / 2.0);
            free = free.min(until(point, curvature, keep));
        }
        let beside = free.min(BESIDE);
        let clear =
            self.points.iter().filter_map(|point| aside(point, curvature, beside)).fold(horizon, f64::min);
        let (x, y) = chord(Motion { forward: beside, turn: beside * curvature });
        let end =
            self.points.iter().map(|point| libm::hypot(point.x - x, point.y - y)).fold(horizon, f64::min);
        Way { free, clear: (clear - radius).max(0.0), then: (end - radius).max(0.0) }
    }

    /// How free it is to the right and to the left: the sum, over sectors of the half circle ahead and a little more, of
    /// the distance to the nearest point in it, at most `horizon`.
    pub(super) fn sides(&self, horizon: f64) -> [f64; 2] {
        let mut sectors = [[horizon; SECTORS]; 2];
        for point in &self.points {
            let bearing = libm::atan2(point.y, point.x);
            let sector = (bearing.abs() / SECTOR) as usize;
            if let Some(nearest) = sectors[usize::from(bearing > 0.0)].get_mut(sector) {
                *nearest = nearest.min(libm::hypot(point.x, point.y));
            }
        }
        sectors.map(|side| side.iter().sum())
    }
}

/// Whether a place so far ahead of the sensor and to its left is behind the obstacles of the readings on either side of it.
/// Between an obstacle and what is free it is in view: thin things hide little.
fn hidden(x: f64, y: f64, readings: &[Reading]) -> bool {
    let (bearing, distance) = (libm::atan2(y, x), libm::hypot(x, y));
    let side = |left: bool| {
        let of = readings.iter().filter(|reading| (reading.bearing >= bearing) == left);
        of.min_by(|a, b| (a.bearing - bearing).abs().total_cmp(&(b.bearing - bearing).abs()))
    };
    let before = |reading: &Reading| matches!(reading.reach, Reach::Obstacle(o) if o + BEHIND < distance);
    if let Some(there) = readings.iter().find(|reading| reading.bearing == bearing) {
        return before(there);
    }
    match (side(true), side(false)) {
        (Some(left), Some(right)) => before(left) && before(right),
        (Some(only), None) | (None, Some(only)) => before(only),
        (None, None) => false,
    }
}

/// How far behind an obstacle, in metres, something else begins.
const BEHIND: f64 = 0.1;
/// How much nearer the body may come to a point within its margin: what rounding and noise make of nothing.
const SLACK: f64 = 0.003;
/// How much of an arc counts for what is beside it, in metres.
const BESIDE: f64 = 0.8;
/// Sectors of a side, and their width in radians.
const SECTORS: usize = 8;
const SECTOR: f64 = 0.27;

/// How far the centre goes along an arc until it is `keep` away from a point; infinite if it never is.
fn until(point: &Point, curvature: f64, keep: f64) -> f64 {
    let &Point { x, y, .. } = point;
    if curvature.abs() < 1e-6 {
        let square = keep * keep - y * y;
        return if square <= 0.0 || x <= 0.0 { f64::INFINITY } else { (x - square.sqrt()).max(0.0) };
    }
    let radius = 1.0 / curvature.abs();
    let (angle, away) = polar(point, curvature);
    let cosine = (radius * radius + away * away - keep * keep) / (2.0 * radius * away.max(1e-9));
    if cosine >= 1.0 {
        return f64::INFINITY;
    }
    let half = libm::acos(cosine.max(-1.0));
    // Behind, or left behind.
    if angle - half > std::f64::consts::PI || (angle < half && x <= 0.0) {
        return f64::INFINITY;
    }
    radius * (angle - half).max(0.0)
}

/// The distance of a point to an arc's first metres, where it is beside them.
fn aside(point: &Point, curvature: f64, length: f64) -> Option<f64> {
    if curvature.abs() < 1e-6 {
        return (0.0..=length).contains(&point.x).then_some(point.y.abs());
    }
    let radius = 1.0 / curvature.abs();
    let (angle, away) = polar(point, curvature);
    (angle * radius <= length).then_some((away - radius).abs())
}

/// A point as seen from the centre of the arc's circle: how far round it the robot has to go, 0 to 2 pi, and how far away
/// from that centre the point is.
fn polar(&Point { x, y, .. }: &Point, curvature: f64) -> (f64, f64) {
    let radius = 1.0 / curvature.abs();
    // Mirrored, so that the arc goes to the left.
    let below = radius - y * curvature.signum();
    let angle = libm::atan2(x, below);
    (if angle < 0.0 { angle + 2.0 * std::f64::consts::PI } else { angle }, libm::hypot(x, below))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::Camera;
    use crate::camera::ground::Ground;
    use crate::drive::robot::moved;
    use crate::world::office::{Kind, Office, Place};

    const FAN: View = View::Fan { half_angle: 0.6, farthest: 3.0 };

    fn at(x: f64, y: f64) -> Point {
        Point { x, y, age: 0.0 }
    }

    #[test]
    fn arcs_end_where_a_walk_along_them_does() {
        for (x, y) in [(1.0, 0.1), (0.5, -0.4), (1.2, 0.9), (0.3, 0.35), (-0.5, 0.1), (0.1, -0.6), (0.0, 1.0)]
        {
            for curvature in [0.0, 0.5, -0.5, 1.3, -2.0] {
                let keep = 0.3;
                let length = until(&at(x, y), curvature, keep);
                let most = if curvature == 0.0 { 3.0 } else { std::f64::consts::PI / f64::abs(curvature) };
                let walk = (0..3000).map(|i| f64::from(i) * 0.001).take_while(|&s| s < most).find(|&s| {
                    let place = Place { x: 0.0, y: 0.0, heading: 0.0 };
                    let place = moved(place, Motion { forward: s, turn: s * curvature });
                    libm::hypot(place.x - x, place.y - y) < keep
                });
                match walk {
                    Some(s) => assert!((s - length).abs() < 0.002, "{x} {y} {curvature}: {s} {length}"),
                    None => assert!(length >= most.min(3.0) - 0.5, "{x} {y} {curvature}: {length} of {most}"),
                }
            }
        }
    }

    #[test]
    fn points_stay_where_they_are_while_the_robot_moves() {
        let mut around = Around::new();
        let reading = Reading { bearing: 0.3, reach: Reach::Obstacle(1.0) };
        around.seen(&[reading], (0.28, &FAN), (1.0, 5.0), 3.0);
        let Point { x, y, .. } = around.points[0];
        let mut place = Place { x: 0.0, y: 0.0, heading: 0.0 };
        for (forward, turn) in [(0.3, 0.2), (0.0, -1.2), (-0.2, 0.7)] {
            around.moved(Motion { forward, turn }, 0.1);
            place = moved(place, Motion { forward, turn });
        }
        let Point { x: ahead, y: left, age } = around.points[0];
        let (sin, cos) = (place.heading.sin(), place.heading.cos());
        let world = (place.x + cos * ahead - sin * left, place.y + sin * ahead + cos * left);
        assert!((world.0 - x).abs() < 1e-12 && (world.1 - y).abs() < 1e-12 && (age - 0.3).abs() < 1e-12);
    }

    #[test]
    fn what_is_out_of_view_is_remembered_longer() {
        let free = [-0.6, 0.6].map(|bearing| Reading { bearing, reach: Reach::Free(3.0) });
        for (bearing, left_after) in [(0.1, 0), (1.5, 1)] {
            let mut around = Around::new();
            around.seen(&[Reading { bearing, reach: Reach::Obstacle(0.5) }], (0.28, &FAN), (0.3, 3.0), 3.0);
            for _ in 0..5 {
                around.moved(Motion::default(), 0.1);
                around.seen(&free, (0.28, &FAN), (0.3, 3.0), 3.0);
            }
            assert_eq!(around.points.len(), left_after, "{bearing}");
            around.moved(Motion::default(), 3.0);
            around.seen(&free, (0.28, &FAN), (0.3, 3.0), 3.0);
            assert!(around.points.is_empty());
        }
    }

    #[test]
    fn what_hides_behind_something_is_remembered() {
        let read = |reaches: [Reach; 3]| {
            let readings = [-0.3, 0.0, 0.3].into_iter().zip(reaches);
            readings.map(|(bearing, reach)| Reading { bearing, reach }).collect::<Vec<_>>()
        };
        let (near, free) = (Reach::Obstacle(0.5), Reach::Free(3.0));
        // a point 1 m ahead and a little to the left of the middle column
        for (reaches, kept) in [
            ([free, near, near], true),
            ([near, near, free], false),
            ([near, free, near], false),
            ([free, Reach::Obstacle(0.95), Reach::Obstacle(0.95)], false),
        ] {
            let mut around = Around { points: vec![Point { x: 1.28, y: 0.1, age: 1.0 }] };
            around.seen(&read(reaches), (0.28, &FAN), (0.5, 4.0), 3.0);
            assert_eq!(around.points.iter().any(|p| p.age == 1.0), kept, "{reaches:?}");
        }
        // on a reading's own bearing that one alone counts
        for (reaches, is_hidden) in [([free, near, free], true), ([near, free, near], false)] {
            assert_eq!(hidden(1.0, 0.0, &read(reaches)), is_hidden, "{reaches:?}");
        }
        // beyond the outermost reading that one counts
        assert!(hidden(0.9, 0.4, &read([free, free, near])) && !hidden(0.9, 0.4, &read([near, near, free])));
        assert!(!hidden(1.0, 0.0, &[]));
    }

    /// What a camera's columns 13, 160 and 306 say, of the office's camera, when these are their rows.
    fn seen_by_camera(around: &mut Around, camera: Camera, rows: [f32; 3]) {
        let size = (320, 240);
        let ground = Ground::new(&camera, size.0, size.1);
        let reading = |(column, row)| Reading::from(ground.locate(column, row));
        let readings = [13, 160, 306].into_iter().zip(rows).map(reading);
        let view = View::Picture { camera, size };
        around.moved(Motion::default(), 0.1);
        around.seen(&readings.collect::<Vec<_>>(), (0.28, &view), (0.5, 4.0), 3.0);
    }

    #[test]
    fn what_one_frame_of_a_camera_says_is_gone_soon_in_every_column() {
        let camera = Office::new(Kind::Fmrb, 1).camera();
        // A column's bearing depends on its row, so that of a false row may be beyond that of the true ones.
        for (wrong, row) in (0..3).flat_map(|wrong| [60.0, 120.0, 200.0, 238.0].map(|row| (wrong, row))) {
            for true_row in [0.0, 30.0, 150.0, 230.0] {
                let mut around = Around::new();
                let mut rows = [true_row; 3];
                rows[wrong] = row;
                seen_by_camera(&mut around, camera, rows);
                let [x, y] = around.points.iter().find(|_| true).map_or([9.0; 2], |p| [p.x, p.y]);
                assert!(libm::hypot(x, y) < 3.0, "{wrong} {row}: it is seen");
                for _ in 0..6 {
                    seen_by_camera(&mut around, camera, [0.0; 3]);
                }
                assert!(around.points.is_empty(), "{wrong} {row} after {true_row}: {:?}", around.points);
            }
        }
    }

    #[test]
    fn what_is_below_the_picture_or_beside_it_is_remembered() {
        let camera = Office::new(Kind::Fmrb, 1).camera();
        for (x, y) in [(0.28, 0.0), (0.2, 0.3), (0.28, -0.4), (-0.3, 0.0), (0.6, 1.5)] {
            assert!(!View::Picture { camera, size: (320, 240) }.holds(x - 0.28, y), "{x} {y}");
            // What is near is seen in wider directions: it does not make the picture any wider.
            for row in [0.0, 238.0] {
                let mut around = Around { points: vec![at(x, y)] };
                for _ in 0..30 {
                    seen_by_camera(&mut around, camera, [row; 3]);
                }
                assert_eq!(around.points.iter().filter(|p| p.age > 2.9).count(), 1, "{x} {y} {row}");
            }
        }
    }
}
