//! One run: from its start until the robot hits something, gets stuck, or its time is over.

use std::collections::{BTreeSet, VecDeque};
use std::sync::atomic::{AtomicBool, Ordering};

use image::GrayImage;

use super::accuracy::{Accuracy, Counter};
use super::robot::{Body, Robot, add};
use super::source::{RangeSource, Rows, Sight};
use super::wander::{self, Wander};
use crate::detector::{DetectError, Motion};
use crate::world::office::{FRAME_RATE, Moment, Office, OfficeError, Place, Thing};

/// Steps of the wheels between two frames: 50 a second.
const STEPS: u32 = 5;
/// Frames from one place of a path to the next.
const PATH: u64 = 5;
/// It is stuck if in so many seconds it has not left a circle of this radius in metres.
const STUCK: (f64, f64) = (60.0, 0.5);
/// Slower than this, in m/s, it stands still, and what hits it has walked into it.
const STANDING: f64 = 0.03;
/// Frames before a collision in which what is hit may have been in view: a second.
const LOOK_BACK: usize = FRAME_RATE as usize;

/// What all runs have in common.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Settings {
    /// The limit on time, in seconds.
    pub seconds: f64,
    /// The body.
    pub body: Body,
    /// The controller; its sensor's place and its seed are set for each run.
    pub wander: wander::Settings,
    /// Whether pictures are made even for sensors that need none, for a video.
    pub pictures: bool,
}

/// 45 minutes: beyond the longest run that is published.
impl Default for Settings {
    fn default() -> Settings {
        let (body, wander) = (Body::default(), wander::Settings::default());
        Settings { seconds: 2700.0, body, wander, pictures: false }
    }
}

/// How a run ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum End {
    /// The body touched something.
    Collision,
    /// Its time was over.
    Limit,
    /// It did not get away from where it was for a minute.
    Stuck,
}

/// What a run ended at.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Hit {
    /// What it is.
    #[serde(serialize_with = "word")]
    pub thing: Thing,
    /// Where it was touched; of somebody his middle.
    pub point: (f64, f64),
    /// Whether the picture showed it there within the last second (see [`Moment::shows`]).
    pub in_view: bool,
    /// Whether it was somebody who walked into a robot that stood still or turned in place. It is a collision all the
    /// same.
    pub walked_into: bool,
}

fn word<S: serde::Serializer>(thing: &Thing, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_str(thing)
}

/// A run that has ended.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Run {
    /// Its number.
    pub number: u64,
    /// How it ended.
    pub end: End,
    /// What was hit.
    pub hit: Option<Hit>,
    /// The way it went, in metres.
    pub metres: f64,
    /// The time it took, in seconds.
    pub seconds: f64,
    /// The share of time that it turned in place.
    pub turning: f64,
    /// Squares of 1 m that its centre has been in, looked at twice a second: how much of the building it has seen. One who
    /// goes round in circles drives far and gets nowhere.
    pub squares: usize,
    /// The detector's answers on the way, if it is one.
    pub accuracy: Option<Accuracy>,
    /// Where it was, twice a second and at the end: x and y in metres.
    #[serde(skip)]
    pub path: Vec<(f64, f64)>,
}

impl Run {
    /// Seconds from one place of its path to the next.
    pub const PATH_SECONDS: f64 = PATH as f64 / FRAME_RATE;
}

/// A frame of a run.
#[derive(Debug, Clone, Copy)]
pub struct Frame<'a> {
    /// Its number.
    pub number: u64,
    /// Where the robot is.
    pub place: Place,
    /// What its camera sees, if pictures are made.
    pub picture: Option<&'a GrayImage>,
    /// The rows found in it.
    pub rows: Option<&'a Rows>,
    /// Metres so far.
    pub metres: f64,
}

/// Why there is no run.
#[derive(Debug, thiserror::Error)]
pub enum DriveError {
    /// The detector is for other pictures.
    #[error(transparent)]
    Detect(#[from] DetectError),
    /// It cannot stand where the run begins.
    #[error(transparent)]
    Start(#[from] OfficeError),
    /// Whoever watches could not write.
    #[error(transparent)]
    Watch(#[from] std::io::Error),
}

/// Drives run `number` in an office. `watch` is told of every frame. None if `stop` was set before the end.
///
/// The run is a function of office, sensor, settings and number.
///
/// # Errors
/// If the body cannot stand where the run begins, the detector does not take the office's pictures, or `watch` fails.
pub fn drive(
    office: &Office,
    source: &mut dyn RangeSource,
    settings: &Settings,
    number: u64,
    stop: &AtomicBool,
    mut watch: impl FnMut(&Frame<'_>) -> std::io::Result<()>,
) -> Result<Option<Run>, DriveError> {
    let mut robot = Robot::new(settings.body, office.free_start(number, settings.body.radius)?);
    let seed = settings.wander.seed.wrapping_add(number);
    let sensor_ahead = source.ahead();
    let body_radius = settings.body.radius;
    let controller = wander::Settings { body_radius, sensor_ahead, seed, ..settings.wander };
    let mut wander = Wander::new(controller, source.view());
    let mut grabber = office.grabber(number);
    let mut crowd = office.crowd();
    let mut odometer = Odometer::new(robot.place());
    let mut counter = Counter::default();
    let mut motion: Option<Motion> = None;
    let (mut readings, mut turning) = (Vec::new(), 0u64);
    source.restart(number);
    let frames = (settings.seconds * FRAME_RATE).round() as u64;
    for frame in 0..frames {
        if stop.load(Ordering::Relaxed) {
            return Ok(None);
        }
        let time = frame as f64 / FRAME_RATE;
        let (moment, place) = (crowd.moment(), robot.place());
        let picture = (source.sees() || settings.pictures).then(|| grabber.take(&moment, &place));
        let picture = picture.as_ref();
        source.readings(&Sight { moment: &moment, place: &place, picture, motion }, &mut readings)?;
        if let Some(rows) = source.rows() {
            counter.frame(rows, &moment.labels(&place, rows.columns.iter().copied()));
        }
        watch(&Frame { number: frame, place, picture, rows: source.rows(), metres: odometer.metres })?;
        let command = wander.steer(&readings, motion.unwrap_or_default(), 1.0 / FRAME_RATE);
        turning += u64::from(wander.is_turning());
        odometer.frame(time, place, moment);
        let ended = |odometer: Odometer<'_>, end, hit, frames: u64| Run {
            number,
            end,
            hit,
            metres: odometer.metres,
            seconds: frames as f64 / FRAME_RATE,
            turning: turning as f64 / (frame + 1) as f64,
            squares: squares(&odometer.path),
            accuracy: source.rows().map(|_| counter.clone().finish()),
            path: odometer.path,
        };
        if odometer.is_stuck() {
            if !frame.is_multiple_of(PATH) {
                odometer.path.push((place.x, place.y));
            }
            return Ok(Some(ended(odometer, End::Stuck, None, frame)));
        }
        let mut moved = Motion::default();
        for step in 1..=STEPS {
            let part = 1.0 / (FRAME_RATE * f64::from(STEPS));
            let speed = robot.speed();
            let motion = robot.step(command, part);
            moved = add(moved, motion);
            odometer.metres += motion.forward.abs();
            let place = robot.place();
            crowd.advance(time + f64::from(step) * part, Some(&place));
            let now = crowd.moment();
            let radius = settings.body.radius;
            let nearest = now.nearest(place.x, place.y, radius);
            if let Some(thing) = nearest.thing.filter(|_| nearest.distance < radius) {
                let hit = Hit {
                    thing,
                    point: nearest.point,
                    in_view: odometer.recent.iter().any(|(then, place)| then.shows(place, &nearest)),
                    walked_into: thing == Thing::Person && speed.forward.abs() < STANDING,
                };
                odometer.path.push((place.x, place.y));
                let mut run = ended(odometer, End::Collision, Some(hit), frame + 1);
                run.seconds = time + f64::from(step) * part;
                return Ok(Some(run));
            }
        }
        motion = Some(moved);
    }
    odometer.path.push((robot.place().x, robot.place().y));
    let accuracy = source.rows().map(|_| counter.finish());
    let (metres, path) = (odometer.metres, odometer.path);
    let seconds = frames as f64 / FRAME_RATE;
    let turning = turning as f64 / frames.max(1) as f64;
    let squares = squares(&path);
    Ok(Some(Run { number, end: End::Limit, hit: None, metres, seconds, turning, squares, accuracy, path }))
}

fn squares(path: &[(f64, f64)]) -> usize {
    let square = |&(x, y): &(f64, f64)| (x.floor() as i64, y.floor() as i64);
    path.iter().map(square).collect::<BTreeSet<_>>().len()
}

/// The way so far.
struct Odometer<'a> {
    metres: f64,
    path: Vec<(f64, f64)>,
    /// Frames of the last second: the office as it was, and place.
    recent: VecDeque<(Moment<'a>, Place)>,
    /// Where the robot was when it last left a circle, and when.
    left: (f64, Place),
    now: f64,
}

impl<'a> Odometer<'a> {
    fn new(place: Place) -> Odometer<'a> {
        Odometer { metres: 0.0, path: Vec::new(), recent: VecDeque::new(), left: (0.0, place), now: 0.0 }
    }

    fn frame(&mut self, time: f64, place: Place, moment: Moment<'a>) {
        self.now = time;
        if self.recent.len() == LOOK_BACK {
            self.recent.pop_front();
        }
        self.recent.push_back((moment, place));
        if ((time * FRAME_RATE).round() as u64).is_multiple_of(PATH) {
            self.path.push((place.x, place.y));
        }
        if libm::hypot(place.x - self.left.1.x, place.y - self.left.1.y) > STUCK.1 {
            self.left = (time, place);
        }
    }

    fn is_stuck(&self) -> bool {
        self.now - self.left.0 >= STUCK.0
    }
}

#[cfg(test)]
#[path = "run_tests.rs"]
mod tests;
