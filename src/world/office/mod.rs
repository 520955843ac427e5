//! The office: a building with what moves in it, seen by a robot that drives through it.
//!
//! A [`Plan`] says what the building is made of and a [`Setup`] what looks at it; [`Office::build`] lights it once, so
//! that a [`Grabber`] takes hundreds of pictures a second. An office at one time is a [`Moment`]: it knows what is in
//! the robot's way and what the true answer of each column is. Everything is a function of plan, set-up and seeds,
//! on every machine and with any number of threads.
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
//!
//! The parts: `plan` (text form and generator), `part` (pieces of things), `space` (what rays meet), `people`, `light`,
//! `carpet`, `rig` (the camera's rays), `sight` (one look), `paint` (surfaces), `shadow` (the robot's own), `grabber`,
//! `wander` and `record` (data sets).

use std::sync::Arc;

use crate::camera::Camera;
use crate::world::geometry::{Room, Solid, Vec3, Wall};
use crate::world::noise::{Stream, hash};
use carpet::Carpet;
use light::LightMap;
use part::Beam;
use people::Standing;
use rig::{Eye, Rig};
use sight::Sight;
use space::Space;

mod carpet;
mod error;
mod grabber;
mod light;
mod paint;
mod part;
mod people;
mod plan;
mod record;
mod rig;
mod setup;
mod shadow;
mod sight;
mod space;
mod wander;

pub use error::OfficeError;
pub use grabber::Grabber;
pub use part::{Part, Thing};
pub use people::Crowd;
pub use plan::{Item, ItemKind, Light, Opening, OpeningKind, Person, Plan, PlanError, Start, Stripe};
pub use record::{CHANGED_BUILDING, Earlier, ParseWorldError, Shot, World, drive, record, record_told};
pub use setup::Setup;
pub use space::{BODY_HEIGHT, Nearest};

/// Frames a second that the robot's camera gives.
pub const FRAME_RATE: f64 = 10.0;
/// How far the camera stands before the centre of the robot's body, in metres.
pub const CAMERA_AHEAD: f64 = 0.28;
/// How near to what blocks its way the camera comes, in metres.
const BUMPER: f64 = 0.01;
/// Radius of the robot's body, in metres.
const BODY: f64 = 0.24;
/// Light on the floor below which no run starts while there are other places: a quarter of what is usual.
const DARK: f32 = 0.25;

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

/// A building and the camera of the robot in it. A copy shares what was computed for it.
#[derive(Debug, Clone)]
pub struct Office {
    setup: Setup,
    plan: Arc<Plan>,
    space: Arc<Space>,
    light: Arc<LightMap>,
    rig: Arc<Rig>,
    carpet: Arc<Carpet>,
    looks: Looks,
    stripes: Arc<[Ground]>,
    lights: Arc<Lights>,
    starts: Arc<[Place]>,
}

/// What the renderer asks for at every pixel of floor and wall.
#[derive(Debug, Clone, Copy)]
struct Looks {
    seed: u64,
    carpet: f32,
    wall: f32,
    gloss: f32,
    skirting: f32,
    skirting_height: f64,
    /// The corner of the building with the least coordinates.
    corner: (f32, f32),
}

/// A stripe of other carpet.
#[derive(Debug, Clone, Copy)]
struct Ground {
    x: (f32, f32),
    y: (f32, f32),
    albedo: f32,
}

/// The panels that burn.
#[derive(Debug)]
struct Lights {
    ceiling: f64,
    panels: Vec<Light>,
}

/// The office at one time: what moves stands still.
#[derive(Debug, Clone)]
pub struct Moment<'a> {
    office: &'a Office,
    seconds: f64,
    people: Vec<Standing>,
}

impl Kind {
    /// The plan drawn by hand after what the paper tells of this building.
    pub fn plan(self) -> Plan {
        let text = match self {
            Kind::Nsh => include_str!("plans/nsh.plan"),
            Kind::Fmrb => include_str!("plans/fmrb.plan"),
        };
        text.parse().expect("the plans that come along are read in the tests")
    }
}

impl Office {
    /// A building of a kind, made up from a seed, seen by the default camera.
    pub fn new(kind: Kind, seed: u64) -> Office {
        let plan = Plan::generate(kind, seed, false);
        Office::build(&plan, &Setup::default(), seed).expect("generated plans are sound")
    }

    /// The building that the paper tells of, drawn by hand, seen by the default camera.
    pub fn preset(kind: Kind) -> Office {
        Office::build(&kind.plan(), &Setup::default(), 0).expect("the plans that come along are sound")
    }

    /// A building of any plan, with any camera. The seed is that of its patterns, with that of the plan.
    ///
    /// # Errors
    /// If the plan is beyond its limits or a setting out of its range.
    pub fn build(plan: &Plan, setup: &Setup, seed: u64) -> Result<Office, OfficeError> {
        setup.check()?;
        plan.check()?;
        let mut plan = plan.clone();
        plan.seed = hash(plan.seed, seed as i64, 61);
        let space = Space::new(&plan);
        let light = LightMap::new(&space, &plan);
        let bounds = plan.bounds();
        let looks = Looks {
            seed: plan.seed,
            carpet: plan.carpet as f32,
            wall: plan.wall as f32,
            gloss: plan.gloss as f32,
            skirting: plan.skirting as f32,
            skirting_height: plan.skirting_height,
            corner: (bounds.x.0 as f32, bounds.y.0 as f32),
        };
        let pair = |(a, b): (f64, f64)| (a as f32, b as f32);
        let stripes = plan.stripes.iter().map(|s| Ground {
            x: pair(s.room.x),
            y: pair(s.room.y),
            albedo: s.albedo as f32,
        });
        let panels = plan.lights.iter().filter(|light| light.power > 0.0).copied().collect();
        Ok(Office {
            setup: setup.clone(),
            rig: Arc::new(Rig::new(setup)),
            carpet: Arc::new(Carpet::new(plan.seed, plan.grain)),
            looks,
            stripes: stripes.collect(),
            lights: Arc::new(Lights { ceiling: plan.ceiling, panels }),
            starts: starts(&plan, &space, &light).into(),
            light: Arc::new(light),
            space: Arc::new(space),
            plan: Arc::new(plan),
        })
    }

    /// The same building seen by another camera.
    ///
    /// # Errors
    /// If a setting is out of its range.
    pub fn with_setup(&self, setup: &Setup) -> Result<Office, OfficeError> {
        setup.check()?;
        Ok(Office { setup: setup.clone(), rig: Arc::new(Rig::new(setup)), ..self.clone() })
    }

    /// The plan it was built of.
    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    /// The camera and the grabber.
    pub fn setup(&self) -> &Setup {
        &self.setup
    }

    /// Width and height of the pictures in pixels.
    pub fn size(&self) -> (u32, u32) {
        (self.setup.width, self.setup.height)
    }

    /// The camera as one would calibrate it.
    pub fn camera(&self) -> Camera {
        self.setup.camera
    }

    /// The free floor, as rectangles that overlap.
    pub fn rooms(&self) -> &[Room] {
        &self.space.rooms
    }

    /// The walls.
    pub fn walls(&self) -> &[Wall] {
        &self.space.walls
    }

    /// The outlines of what stands around and is in a robot's way, people apart.
    pub fn solids(&self) -> &[Solid] {
        &self.space.solids
    }

    /// The pieces of what stands around, those that hover too.
    pub fn parts(&self) -> &[Part] {
        &self.space.parts
    }

    /// Where the run of this number starts: where the plan says, further ones at free places, each at another until
    /// all were taken. Whether there is room for a robot tells [`Office::free_start`].
    pub fn start(&self, run: u64) -> Place {
        let drawn = self.plan.starts.len() as u64;
        if let Some(start) = usize::try_from(run).ok().and_then(|run| self.plan.starts.get(run)) {
            return Place { x: start.x, y: start.y, heading: start.heading.to_radians() };
        }
        let pick = (run - drawn) % self.starts.len().max(1) as u64;
        self.starts.get(pick as usize).copied().unwrap_or(Place { x: 0.0, y: 0.0, heading: 0.0 })
    }

    /// Where the run of this number starts, if a robot of this radius can stand there: whether people do is not asked, for
    /// they walk on.
    ///
    /// # Errors
    /// If a wall or a thing is nearer.
    pub fn free_start(&self, run: u64, radius: f64) -> Result<Place, OfficeError> {
        let place = self.start(run);
        let Place { x, y, .. } = place;
        let in_a_room = self.space.rooms.iter().any(|room| room.contains(x, y));
        if in_a_room && self.space.nearest(&[], x, y, radius).distance >= radius {
            return Ok(place);
        }
        let (start, width) = (usize::try_from(run).unwrap_or(usize::MAX), 2.0 * radius);
        Err(if start < self.plan.starts.len() {
            OfficeError::Start { start, x, y, width }
        } else {
            OfficeError::NoStart { width }
        })
    }

    /// The office so many seconds after its beginning, if nobody has to give way to a robot.
    pub fn at(&self, seconds: f64) -> Moment<'_> {
        let people = self.plan.people.iter().map(|person| person.at(seconds)).collect();
        Moment { office: self, seconds, people }
    }

    /// Those who walk about in it, at its beginning. Unlike those of [`Office::at`] they give way to a robot.
    pub fn crowd(&self) -> Crowd<'_> {
        Crowd::new(self)
    }

    /// A grabber; the seed is that of its noise.
    pub fn grabber(&self, seed: u64) -> Grabber {
        Grabber::new(seed)
    }

    /// Where the camera is: before the body, unless something holds it back.
    fn eye(&self, place: &Place, moment: &Moment<'_>) -> Eye {
        let (sin, cos) = libm::sincos(place.heading);
        let up = self.setup.camera.height;
        let beam = Beam::new(Vec3::new(place.x, place.y, up), Vec3::new(cos, sin, 0.0));
        let walkers = moment.people.iter().filter(|p| {
            let (dx, dy) = (p.x - place.x, p.y - place.y);
            dx * dx + dy * dy < 1.0
        });
        let walkers: Vec<Part> = walkers.flat_map(Standing::parts).collect();
        let free = self.space.ahead(&walkers, &beam, CAMERA_AHEAD + BUMPER);
        let ahead = (free - BUMPER).clamp(0.0, CAMERA_AHEAD);
        Eye { x: place.x + cos * ahead, y: place.y + sin * ahead, sin, cos }
    }
}

/// Free places to start from in an order of chance, each looking along the longest free way; those in the light come
/// before those in the dark.
fn starts(plan: &Plan, space: &Space, light: &LightMap) -> Vec<Place> {
    let standing: Vec<Standing> = plan.people.iter().map(|person| person.at(0.0)).collect();
    let (mut free, mut best): (Vec<Place>, Option<(f64, Place)>) = (Vec::new(), None);
    // from wide to narrow: most plans have wide places, and a few are enough
    for room in &plan.rooms {
        // close along a hallway; across it the middle counts
        let apart = |length: f64| if length > 4.0 { 0.6 } else { 0.9 };
        let steps = |(a, b): (f64, f64)| (((b - a) / apart(b - a)).floor() as usize).clamp(1, 60);
        let (nx, ny) = (steps(room.x), steps(room.y));
        for k in 0..nx * ny {
            let along = |i: usize, n: usize, (a, b): (f64, f64)| a + (b - a) * (i as f64 + 0.5) / n as f64;
            let (x, y) = (along(k % nx, nx, room.x), along(k / nx, ny, room.y));
            let clear = space.nearest(&standing, x, y, 0.75).distance;
            if clear < 0.55 && best.is_some_and(|(most, _)| clear <= most) {
                continue;
            }
            let way = |eighth: u32| {
                let heading = f64::from(eighth) * std::f64::consts::FRAC_PI_4;
                let (sin, cos) = libm::sincos(heading);
                (space.range(&standing, (x, y), (cos, sin), 20.0), heading)
            };
            let (mut longest, mut heading) = (0.0, 0.0);
            for (range, of) in (0..8).map(way) {
                if range > longest {
                    (longest, heading) = (range, of);
                }
            }
            let place = Place { x, y, heading };
            if best.is_none_or(|(most, _)| clear > most) {
                best = Some((clear, place));
            }
            // rooms overlap, and some places are the plan's
            let near = |ox: f64, oy: f64| (ox - x).abs().max((oy - y).abs()) < 0.5;
            let known = free.iter().any(|o| near(o.x, o.y)) || plan.starts.iter().any(|o| near(o.x, o.y));
            if clear >= 0.55 && longest > 1.0 + BODY && !known {
                free.push(place);
            }
        }
    }
    let stream = &mut Stream::new(plan.seed, 71);
    for last in (1..free.len()).rev() {
        free.swap(last, (stream.bits() % (last as u64 + 1)) as usize);
    }
    // a stable sort: the order of chance stays
    free.sort_by_key(|place| light.floor.at(place.x as f32, place.y as f32) < DARK);
    if free.is_empty() { best.into_iter().map(|(_, place)| place).collect() } else { free }
}

impl Moment<'_> {
    /// Seconds since the office's beginning.
    pub fn seconds(&self) -> f64 {
        self.seconds
    }

    /// Where somebody stands: centre and radius, in metres.
    pub fn people(&self) -> Vec<(f64, f64, f64)> {
        self.people.iter().map(|p| (p.x, p.y, people::RADIUS)).collect()
    }

    /// Distance along the floor from a point in a direction (radians) to what is in the way of a robot, at most
    /// `limit` metres.
    pub fn range(&self, x: f64, y: f64, direction: f64, limit: f64) -> f64 {
        let (sin, cos) = libm::sincos(direction);
        self.office.space.range(&self.people, (x, y), (cos, sin), limit)
    }

    /// What is nearest to a point of the floor and in the way of a robot, within `limit` metres.
    pub fn nearest(&self, x: f64, y: f64, limit: f64) -> Nearest {
        self.office.space.nearest(&self.people, x, y, limit)
    }

    /// The true answer for a column of the picture that the robot takes from a place: the first row from below whose
    /// pixel's ray meets something other than the floor; 0 if there is none.
    pub fn label(&self, place: &Place, column: u32) -> u32 {
        self.sight(place).label(column)
    }

    /// The true answers for several columns.
    pub fn labels(&self, place: &Place, columns: impl IntoIterator<Item = u32>) -> Vec<u32> {
        let sight = self.sight(place);
        columns.into_iter().map(|column| sight.label(column)).collect()
    }

    /// Whether each pixel of that picture, row by row, shows floor.
    pub fn floor(&self, place: &Place) -> Vec<bool> {
        self.sight(place).floor()
    }

    /// Whether the picture that the robot takes from a place shows what its body touches somewhat later: the thing within
    /// 5 cm of where it is touched, up to [`BODY_HEIGHT`], and not hidden. Somebody is looked for where he is at this
    /// moment.
    pub fn shows(&self, place: &Place, touched: &Nearest) -> bool {
        let somebody = touched.person.and_then(|i| self.people.get(i));
        let point = somebody.map_or(touched.point, |who| (who.x, who.y));
        self.sight(place).shows(&Nearest { point, ..*touched })
    }

    fn sight(&self, place: &Place) -> Sight<'_> {
        Sight::new(self, place)
    }

    /// Where the camera of a robot at a place is, in metres: before the middle of its body, unless something holds it
    /// back.
    pub fn camera(&self, place: &Place) -> (f64, f64) {
        let eye = self.office.eye(place, self);
        (eye.x, eye.y)
    }
}
