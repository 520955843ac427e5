//! Floor plans: what a building is made of, as numbers that a person can draw with.
//!
//! A plan is free floor (rectangles that overlap), doors and panes in the walls around it, things that stand on it,
//! people who walk on it, lights above it, and the looks of its surfaces. It is written as text, one item a line:
//!
//! ```
//! use vsonar::world::office::Plan;
//! let text = "plan 1\n\
//!             carpet 0.16 0.3        # albedo, grain\n\
//!             room 0 12 -1.2 1.2     # x from, to, y from, to, in metres\n\
//!             door 3 1.2 0.9 0.3     # its middle on a wall, width, albedo\n\
//!             bin 6 0.9 0.3 0.3 0.5 0.12\n\
//!             light 6 0 1.2 0.3 1\n";
//! let plan: Plan = text.parse()?;
//! assert_eq!((plan.rooms.len(), plan.items.len()), (1, 1));
//! assert_eq!(plan.to_string().parse::<Plan>()?, plan);
//! # Ok::<(), vsonar::world::office::PlanError>(())
//! ```

use crate::world::geometry::Room;

mod error;
mod furnish;
mod generate;
mod print;
mod read;

pub use error::PlanError;

/// A building on paper. Lengths are metres, albedos shares of light given back.
///
/// Its text begins with the line `plan 1`. The others are in any order, each a word and numbers; `#` starts a comment.
/// x is to the right and y up on paper; `heading` and `turn` are degrees from x to the left.
///
/// | Line | Numbers | How often |
/// |---|---|---|
/// | `room` | x from, x to, y from, y to | 1 to 200; free floor is what any of them covers |
/// | `stripe` | x from, x to, y from, y to, albedo | to 32 |
/// | `door`, `glass` | x, y of the middle on a wall, width, albedo | to 500 |
/// | `box`, `cabinet`, `table`, `chair`, `bin`, `pillar`, `plant`, `suitcase`, `cone`, `drawer` | x, y, width, depth, height, albedo, perhaps turn | to 500 |
/// | `light` | x, y, width, depth, power (0 is burned out) | to 500 |
/// | `person` | speed in m/s, albedo of the trousers, x and y of 2 to 32 corners | to 32 |
/// | `start` | x, y, heading | to 32 |
/// | `seed` | a whole number | once, or 1 |
/// | `ceiling` | height | once, or 2.6 |
/// | `carpet` | albedo, grain | once |
/// | `wall` | albedo, gloss | once |
/// | `skirting` | albedo, height | once |
///
/// The middle of whatever stands, hangs or walks is in a room. Chairs are 0.35 m high at least. A robot 0.48 m wide has
/// room at a start, if a robot is to drive from it.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// Seed of the patterns on its surfaces.
    pub seed: u64,
    /// Height of the ceiling.
    pub ceiling: f64,
    /// Mean albedo of the carpet.
    pub carpet: f64,
    /// How much the carpet's fine texture varies, as a share of the mean.
    pub grain: f64,
    /// Albedo of the walls.
    pub wall: f64,
    /// Share of light that the walls mirror at grazing angles.
    pub gloss: f64,
    /// Albedo of the skirting board.
    pub skirting: f64,
    /// Height of the skirting board.
    pub skirting_height: f64,
    /// The free floor.
    pub rooms: Vec<Room>,
    /// Stretches of other carpet; where two overlap the first one lies on top.
    pub stripes: Vec<Stripe>,
    /// Doors and panes in walls.
    pub openings: Vec<Opening>,
    /// What stands around.
    pub items: Vec<Item>,
    /// The light panels in the ceiling.
    pub lights: Vec<Light>,
    /// Who walks about.
    pub people: Vec<Person>,
    /// Where runs begin, the first run at the first.
    pub starts: Vec<Start>,
}

/// Where a run begins.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Start {
    /// In metres.
    pub x: f64,
    /// In metres.
    pub y: f64,
    /// Direction in degrees from x to the left.
    pub heading: f64,
}

/// A stretch of other carpet.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stripe {
    /// Where it lies.
    pub room: Room,
    /// Its mean albedo.
    pub albedo: f64,
}

/// What is let into a wall.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OpeningKind {
    /// A door, shut.
    Door,
    /// A pane of glass from the floor up.
    Glass,
}

/// A door or a pane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Opening {
    /// Which of them.
    pub kind: OpeningKind,
    /// Its middle, on a wall.
    pub x: f64,
    /// Its middle, on a wall.
    pub y: f64,
    /// Its width along the wall.
    pub width: f64,
    /// Albedo of the leaf, or of what is behind the glass.
    pub albedo: f64,
}

/// What can stand around.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ItemKind {
    /// A cardboard box.
    Box,
    /// A cabinet of drawers, or a bookcase.
    Cabinet,
    /// A table or desk: a top on four thin legs.
    Table,
    /// A chair: a seat and a back on thin legs.
    Chair,
    /// A waste bin, round.
    Bin,
    /// A pillar up to the ceiling, round.
    Pillar,
    /// A plant in a pot whose leaves hang over it.
    Plant,
    /// A suitcase on its wheels.
    Suitcase,
    /// A traffic cone.
    Cone,
    /// A cabinet with a drawer left open.
    Drawer,
}

/// The names of the kinds in the text form.
pub(super) const ITEMS: [(&str, ItemKind); 10] = [
    ("box", ItemKind::Box),
    ("cabinet", ItemKind::Cabinet),
    ("table", ItemKind::Table),
    ("chair", ItemKind::Chair),
    ("bin", ItemKind::Bin),
    ("pillar", ItemKind::Pillar),
    ("plant", ItemKind::Plant),
    ("suitcase", ItemKind::Suitcase),
    ("cone", ItemKind::Cone),
    ("drawer", ItemKind::Drawer),
];

/// Its name in the text form.
impl std::fmt::Display for ItemKind {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(ITEMS.iter().find(|(_, kind)| kind == self).map_or("item", |(name, _)| name))
    }
}

impl ItemKind {
    /// Whether it is of those that the buildings trained on never hold.
    pub fn is_unseen(self) -> bool {
        matches!(self, ItemKind::Plant | ItemKind::Suitcase | ItemKind::Cone | ItemKind::Drawer)
    }
}

/// A thing that stands on the floor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Item {
    /// What it is.
    pub kind: ItemKind,
    /// Its centre.
    pub x: f64,
    /// Its centre.
    pub y: f64,
    /// Its extent along x; of round things the diameter.
    pub width: f64,
    /// Its extent along y; of round things without meaning.
    pub depth: f64,
    /// Its height.
    pub height: f64,
    /// Its mean albedo.
    pub albedo: f64,
    /// Where a chair, and an open drawer, looks: degrees from x to the left.
    pub turn: f64,
}

/// A light panel in the ceiling.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Light {
    /// Its centre.
    pub x: f64,
    /// Its centre.
    pub y: f64,
    /// Its extent along x.
    pub width: f64,
    /// Its extent along y.
    pub depth: f64,
    /// Relative brightness, about 1; 0 is burned out.
    pub power: f64,
}

/// Somebody who walks along a closed path again and again.
#[derive(Debug, Clone, PartialEq)]
pub struct Person {
    /// In metres a second.
    pub speed: f64,
    /// Albedo of the trousers.
    pub albedo: f64,
    /// The corners of the path; from the last he goes to the first.
    pub path: Vec<(f64, f64)>,
}

impl Plan {
    /// Free floor without anything, with the looks of an ordinary office.
    pub fn empty(rooms: Vec<Room>) -> Plan {
        Plan {
            seed: 1,
            ceiling: 2.6,
            carpet: 0.16,
            grain: 0.3,
            wall: 0.5,
            gloss: 0.35,
            skirting: 0.05,
            skirting_height: 0.09,
            rooms,
            stripes: Vec::new(),
            openings: Vec::new(),
            items: Vec::new(),
            lights: Vec::new(),
            people: Vec::new(),
            starts: Vec::new(),
        }
    }

    /// Holds a plan made by a program to the limits of the text form.
    ///
    /// # Errors
    /// What its text, line by line, would be refused for.
    pub fn check(&self) -> Result<(), PlanError> {
        self.to_string().parse::<Plan>().map(drop)
    }

    /// The rectangle around the free floor.
    pub fn bounds(&self) -> Room {
        let mut bounds = self.rooms.first().copied().unwrap_or(Room { x: (0.0, 0.0), y: (0.0, 0.0) });
        for room in &self.rooms {
            bounds.x = (bounds.x.0.min(room.x.0), bounds.x.1.max(room.x.1));
            bounds.y = (bounds.y.0.min(room.y.0), bounds.y.1.max(room.y.1));
        }
        bounds
    }
}
