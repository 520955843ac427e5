//! The office: a building with what moves in it, seen by a robot that drives through it.
//!
//! ```
//! use vsonar::world::office::{Kind, Office};
//! let office = Office::new(Kind::Fmrb, 1);
//! let moment = office.at(0.0);
//! let place = office.start(0);
//! assert!(moment.nearest(place.x, place.y, 1.0).distance > 0.25);
//! let picture = office.grabber(1).take(&moment, &place);
//! assert_eq!(picture.dimensions(), office.size());
//! ```

use image::GrayImage;

use super::Corridor;
use super::camera::Pose;
use super::geometry::{Ray, Room, Solid, Vec3, Wall};
use super::render::Scene;
use crate::camera::Camera;

/// Frames a second that the robot's camera gives.
pub const FRAME_RATE: f64 = 10.0;
/// How far the camera stands before the centre of the robot's body, in metres.
pub const CAMERA_AHEAD: f64 = 0.28;

/// Which of the two buildings of Martin (2006), or another of their kind.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Newell Simon Hall: people, and a wide stripe of other carpet.
    Nsh,
    /// The Field & Mobile Robotics Building: a stretch of hallway whose lights are burned out.
    Fmrb,
}

/// Where a robot stands: the centre of its body on the floor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// In metres.
    pub x: f64,
    /// In metres.
    pub y: f64,
    /// Direction it looks and drives in, in radians; 0 is along x, positive turns to the left.
    pub heading: f64,
}

/// What a robot can run into.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Thing {
    /// A wall or a door in it.
    Wall,
    /// A thing that stands around.
    Box,
    /// Somebody.
    Person,
}

/// What is nearest to a point of the floor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Nearest {
    /// Distance in metres, at most the limit asked for.
    pub distance: f64,
    /// What it is; nothing within the limit gives none.
    pub thing: Option<Thing>,
    /// The point of it that is nearest.
    pub point: (f64, f64),
}

/// A building and the camera of the robot in it.
#[derive(Debug, Clone)]
pub struct Office {
    scene: Scene,
    settings: Corridor,
}

/// The office at one time: what moves stands still.
#[derive(Debug, Clone)]
pub struct Moment<'a> {
    office: &'a Office,
}

/// The robot's camera and frame grabber. It remembers its exposure, so that one sequence has one grabber.
#[derive(Debug, Clone)]
pub struct Grabber {
    frame: u64,
}

impl Office {
    /// The building of a kind and a seed.
    pub fn new(_kind: Kind, seed: u64) -> Office {
        let settings = Corridor::default();
        Office { scene: Scene::new(&settings, seed), settings }
    }

    /// Width and height of the pictures in pixels.
    pub fn size(&self) -> (u32, u32) {
        (self.settings.width, self.settings.height)
    }

    /// The camera as one would calibrate it.
    pub fn camera(&self) -> Camera {
        let Corridor { camera_height: height, pitch, field_of_view, distortion, .. } = self.settings;
        Camera { height, pitch: pitch.to_degrees(), field_of_view: field_of_view.to_degrees(), distortion }
    }

    /// The free floor, as rectangles that overlap.
    pub fn rooms(&self) -> &[Room] {
        &self.scene.building().rooms
    }

    /// The walls.
    pub fn walls(&self) -> &[Wall] {
        self.scene.building().geometry.walls()
    }

    /// What stands around, people apart.
    pub fn solids(&self) -> &[Solid] {
        self.scene.building().geometry.solids()
    }

    /// A free place to start the run of this number from.
    pub fn start(&self, run: u64) -> Place {
        let poses = self.scene.poses(16);
        let pose = poses[(run % 16) as usize];
        Place { x: pose.x, y: pose.y, heading: pose.yaw }
    }

    /// The office so many seconds after its beginning.
    pub fn at(&self, _seconds: f64) -> Moment<'_> {
        Moment { office: self }
    }

    /// A grabber; the seed is that of its noise.
    pub fn grabber(&self, _seed: u64) -> Grabber {
        Grabber { frame: 0 }
    }

    fn pose(&self, place: &Place) -> Pose {
        let (sin, cos) = libm::sincos(place.heading);
        Pose {
            x: place.x + cos * CAMERA_AHEAD,
            y: place.y + sin * CAMERA_AHEAD,
            z: self.settings.camera_height,
            yaw: place.heading,
            pitch: self.settings.pitch,
        }
    }
}

impl Moment<'_> {
    /// Where somebody stands: centre and radius, in metres.
    pub fn people(&self) -> Vec<(f64, f64, f64)> {
        Vec::new()
    }

    /// Distance along the floor from a point in a direction (radians) to what stands there, at most `limit` metres.
    pub fn range(&self, x: f64, y: f64, direction: f64, limit: f64) -> f64 {
        let (sin, cos) = libm::sincos(direction);
        let ray = Ray { origin: Vec3::new(x, y, 0.02), direction: Vec3::new(cos, sin, 0.0) };
        self.office.scene.building().geometry.cast(&ray).distance.min(limit)
    }

    /// What is nearest to a point of the floor, within `limit` metres.
    pub fn nearest(&self, x: f64, y: f64, limit: f64) -> Nearest {
        let distance = self.office.scene.building().geometry.clearance(x, y, limit);
        let thing = (distance < limit).then_some(Thing::Wall);
        Nearest { distance, thing, point: (x, y) }
    }

    /// The true answer for a column of the picture that the robot takes from a place: the first row from below whose
    /// pixel's ray meets something other than the floor; 0 if there is none.
    pub fn label(&self, place: &Place, column: u32) -> u32 {
        self.office.scene.label(&self.office.pose(place), column)
    }
}

impl Grabber {
    /// The picture that the robot takes from a place.
    pub fn take(&mut self, moment: &Moment<'_>, place: &Place) -> GrayImage {
        self.frame += 1;
        moment.office.scene.picture(&moment.office.pose(place), self.frame)
    }
}
