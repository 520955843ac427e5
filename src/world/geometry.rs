//! Shapes and what a ray meets: vectors, upright walls, boxes and pillars on a flat floor below a flat ceiling.
//!
//! Materials and light are elsewhere; a [`Hit`] only names the surface and the place on it.
//!
//! ```
//! use vsonar::world::geometry::{Geometry, Ray, Room, Surface, Vec3};
//! let hall = Geometry::new(&[Room { x: (0.0, 8.0), y: (-1.0, 1.0) }], Vec::new(), 2.6);
//! let down = Ray { origin: Vec3::new(2.0, 0.0, 1.0), direction: Vec3::new(1.0, 0.0, -0.5) };
//! let hit = hall.cast(&down);
//! assert_eq!(hit.surface, Surface::Floor);
//! assert_eq!(hit.point, Vec3::new(4.0, 0.0, 0.0));
//! ```

use std::ops::{Add, Mul, Sub};

/// A point or a direction, in metres.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Vec3 {
    /// Along the floor.
    pub x: f64,
    /// Along the floor.
    pub y: f64,
    /// Up.
    pub z: f64,
}

impl Vec3 {
    /// The vector of these coordinates.
    pub const fn new(x: f64, y: f64, z: f64) -> Vec3 {
        Vec3 { x, y, z }
    }

    /// The inner product.
    pub fn dot(self, other: Vec3) -> f64 {
        self.x * other.x + self.y * other.y + self.z * other.z
    }

    /// The Euclidean length.
    pub fn length(self) -> f64 {
        self.dot(self).sqrt()
    }
}

impl Add for Vec3 {
    type Output = Vec3;
    fn add(self, o: Vec3) -> Vec3 {
        Vec3::new(self.x + o.x, self.y + o.y, self.z + o.z)
    }
}

impl Sub for Vec3 {
    type Output = Vec3;
    fn sub(self, o: Vec3) -> Vec3 {
        Vec3::new(self.x - o.x, self.y - o.y, self.z - o.z)
    }
}

impl Mul<f64> for Vec3 {
    type Output = Vec3;
    fn mul(self, k: f64) -> Vec3 {
        Vec3::new(self.x * k, self.y * k, self.z * k)
    }
}

/// A half-line. The direction need not have length 1.
#[derive(Debug, Clone, Copy)]
pub struct Ray {
    /// Where it starts.
    pub origin: Vec3,
    /// Where it goes.
    pub direction: Vec3,
}

/// A rectangle of free floor. Rooms that overlap are one space: walls stand around their union.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Room {
    /// Extent along x, lower end first.
    pub x: (f64, f64),
    /// Extent along y, lower end first.
    pub y: (f64, f64),
}

impl Room {
    /// Whether the point is inside or on the edge.
    pub fn contains(&self, x: f64, y: f64) -> bool {
        (self.x.0..=self.x.1).contains(&x) && (self.y.0..=self.y.1).contains(&y)
    }
}

/// An upright wall of the full height, parallel to an axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wall {
    /// Whether the wall runs along y (and its normal along x).
    pub along_y: bool,
    /// Its coordinate on the axis of its normal.
    pub at: f64,
    /// Its extent on the other axis, lower end first.
    pub span: (f64, f64),
    /// +1 if free space is on the side of larger coordinates, else -1.
    pub facing: f64,
}

impl Wall {
    /// The normal, into the room.
    pub fn normal(&self) -> Vec3 {
        if self.along_y { Vec3::new(self.facing, 0.0, 0.0) } else { Vec3::new(0.0, self.facing, 0.0) }
    }

    /// Length in metres.
    pub fn length(&self) -> f64 {
        self.span.1 - self.span.0
    }

    /// The point of the floor at a place along the wall.
    pub fn foot(&self, along: f64) -> (f64, f64) {
        if self.along_y { (self.at, along) } else { (along, self.at) }
    }
}

/// The outline of a solid seen from above.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Outline {
    /// An upright box.
    Box(Room),
    /// An upright cylinder.
    Round {
        /// Centre.
        x: f64,
        /// Centre.
        y: f64,
        /// Radius in metres.
        radius: f64,
    },
}

impl Outline {
    /// The centre and the squared radius of a circle around it, a little too large to be on the safe side.
    fn circle(&self) -> (f64, f64, f64) {
        let (x, y, square) = match *self {
            Outline::Box(Room { x, y }) => {
                let (dx, dy) = ((x.1 - x.0) / 2.0, (y.1 - y.0) / 2.0);
                (x.0 + dx, y.0 + dy, dx * dx + dy * dy)
            }
            Outline::Round { x, y, radius } => (x, y, radius * radius),
        };
        (x, y, square * 1.001 + 1e-9)
    }

    /// Distance of a point of the floor to the outline, 0 inside.
    pub fn distance(&self, x: f64, y: f64) -> f64 {
        match *self {
            Outline::Box(room) => {
                let dx = (room.x.0 - x).max(x - room.x.1).max(0.0);
                let dy = (room.y.0 - y).max(y - room.y.1).max(0.0);
                (dx * dx + dy * dy).sqrt()
            }
            Outline::Round { x: cx, y: cy, radius } => {
                let (dx, dy) = (x - cx, y - cy);
                ((dx * dx + dy * dy).sqrt() - radius).max(0.0)
            }
        }
    }
}

/// Something that stands on the floor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Solid {
    /// Its outline.
    pub outline: Outline,
    /// Its height in metres.
    pub height: f64,
}

impl Solid {
    /// How far along the ray it is entered, and the normal there. A ray that starts inside does not enter.
    pub fn enter(&self, ray: &Ray) -> Option<(f64, Vec3)> {
        let (o, d) = (ray.origin, ray.direction);
        match self.outline {
            Outline::Box(room) => {
                let (mut near, mut far, mut normal) = (0.0, f64::INFINITY, None);
                let slabs = [
                    (o.x, d.x, room.x, Vec3::new(1.0, 0.0, 0.0)),
                    (o.y, d.y, room.y, Vec3::new(0.0, 1.0, 0.0)),
                    (o.z, d.z, (0.0, self.height), Vec3::new(0.0, 0.0, 1.0)),
                ];
                for (start, step, (low, high), axis) in slabs {
                    if step == 0.0 {
                        if start < low || start > high {
                            return None;
                        }
                        continue;
                    }
                    let (a, b) = ((low - start) / step, (high - start) / step);
                    let (a, b, sign) = if a <= b { (a, b, -1.0) } else { (b, a, 1.0) };
                    if a > near {
                        (near, normal) = (a, Some(axis * sign));
                    }
                    far = if b < far { b } else { far };
                    if near > far {
                        return None;
                    }
                }
                normal.map(|n| (near, n))
            }
            Outline::Round { x, y, radius } => {
                let (px, py) = (o.x - x, o.y - y);
                let a = d.x * d.x + d.y * d.y;
                let b = px * d.x + py * d.y;
                let c = px * px + py * py - radius * radius;
                let root = b * b - a * c;
                let side = (c > 0.0 && a > 0.0 && root >= 0.0).then(|| (-b - root.sqrt()) / a);
                if let Some(t) = side.filter(|&t| t > 0.0) {
                    let z = o.z + d.z * t;
                    if (0.0..=self.height).contains(&z) {
                        let normal = Vec3::new((px + d.x * t) / radius, (py + d.y * t) / radius, 0.0);
                        return Some((t, normal));
                    }
                }
                // from above through the lid
                let t = (self.height - o.z) / d.z;
                let (hx, hy) = (px + d.x * t, py + d.y * t);
                let lid = d.z < 0.0 && t > 0.0 && hx * hx + hy * hy <= radius * radius;
                lid.then_some((t, Vec3::new(0.0, 0.0, 1.0)))
            }
        }
    }
}

/// Which surface a ray meets.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Surface {
    /// The ground: what a detector calls free.
    Floor,
    /// The ceiling.
    Ceiling,
    /// A wall, by its index.
    Wall(usize),
    /// A solid, by its index.
    Solid(usize),
}

/// The first thing a ray meets.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// How far, in lengths of the ray's direction.
    pub distance: f64,
    /// Where.
    pub point: Vec3,
    /// The surface's normal, towards the free side, of length 1.
    pub normal: Vec3,
    /// The surface.
    pub surface: Surface,
}

/// Slack at the ends of walls, in metres, so that no ray slips through the crack between two of them.
const CRACK: f64 = 1e-7;

/// Everything a ray can meet.
#[derive(Debug, Clone)]
pub struct Geometry {
    walls: Vec<Wall>,
    solids: Vec<Solid>,
    /// A circle around each solid: centre and squared radius.
    circles: Vec<(f64, f64, f64)>,
    ceiling: f64,
}

impl Geometry {
    /// The walls around the union of the rooms, the solids, and a ceiling at this height.
    pub fn new(rooms: &[Room], solids: Vec<Solid>, ceiling: f64) -> Geometry {
        let circles = solids.iter().map(|s| s.outline.circle()).collect();
        Geometry { walls: super::outline::outline(rooms), solids, circles, ceiling }
    }

    /// The walls.
    pub fn walls(&self) -> &[Wall] {
        &self.walls
    }

    /// The solids.
    pub fn solids(&self) -> &[Solid] {
        &self.solids
    }

    /// Height of the ceiling in metres.
    pub fn ceiling(&self) -> f64 {
        self.ceiling
    }

    /// What a ray from inside meets first. A horizontal ray that meets nothing gives the ceiling, infinitely far.
    pub fn cast(&self, ray: &Ray) -> Hit {
        let (o, d) = (ray.origin, ray.direction);
        let (mut distance, mut normal, mut surface) = if d.z < 0.0 {
            (-o.z / d.z, Vec3::new(0.0, 0.0, 1.0), Surface::Floor)
        } else {
            ((self.ceiling - o.z) / d.z, Vec3::new(0.0, 0.0, -1.0), Surface::Ceiling)
        };
        for (i, wall) in self.walls.iter().enumerate() {
            let (from, step, other, slope) =
                if wall.along_y { (o.x, d.x, o.y, d.y) } else { (o.y, d.y, o.x, d.x) };
            if step * wall.facing >= 0.0 {
                continue;
            }
            let t = (wall.at - from) / step;
            if t <= 0.0 || t >= distance {
                continue;
            }
            let along = other + slope * t;
            if along >= wall.span.0 - CRACK && along <= wall.span.1 + CRACK {
                (distance, normal, surface) = (t, wall.normal(), Surface::Wall(i));
            }
        }
        let reach = d.x * d.x + d.y * d.y;
        for (i, (solid, circle)) in self.solids.iter().zip(&self.circles).enumerate() {
            // most rays pass by most solids: seen from above, the line misses the circle
            let miss = (circle.0 - o.x) * d.y - (circle.1 - o.y) * d.x;
            if miss * miss > circle.2 * reach {
                continue;
            }
            if let Some((t, n)) = solid.enter(ray)
                && t < distance
            {
                (distance, normal, surface) = (t, n, Surface::Solid(i));
            }
        }
        Hit { distance, point: o + d * distance, normal, surface }
    }

    /// Distance along the floor from a point to the nearest wall or solid, at most `limit`.
    pub fn clearance(&self, x: f64, y: f64, limit: f64) -> f64 {
        let mut least = limit;
        for wall in &self.walls {
            let (px, py) = if wall.along_y { (x, y) } else { (y, x) };
            let along = (wall.span.0 - py).max(py - wall.span.1).max(0.0);
            let across = px - wall.at;
            least = least.min((across * across + along * along).sqrt());
        }
        self.solids.iter().fold(least, |least, s| least.min(s.outline.distance(x, y)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ray(origin: (f64, f64, f64), direction: (f64, f64, f64)) -> Ray {
        let v = |(x, y, z)| Vec3::new(x, y, z);
        Ray { origin: v(origin), direction: v(direction) }
    }

    #[test]
    fn boxes_are_entered_through_the_right_face() {
        let cube = Solid { outline: Outline::Box(Room { x: (1.0, 2.0), y: (-0.5, 0.5) }), height: 1.0 };
        let front = cube.enter(&ray((0.0, 0.0, 0.5), (1.0, 0.0, 0.0)));
        assert_eq!(front, Some((1.0, Vec3::new(-1.0, 0.0, 0.0))));
        let lid = cube.enter(&ray((1.5, 0.0, 3.0), (0.0, 0.0, -1.0)));
        assert_eq!(lid, Some((2.0, Vec3::new(0.0, 0.0, 1.0))));
        assert_eq!(cube.enter(&ray((0.0, 0.0, 1.5), (1.0, 0.0, 0.0))), None, "above");
        assert_eq!(cube.enter(&ray((0.0, 0.0, 0.5), (-1.0, 0.0, 0.0))), None, "behind");
        assert_eq!(cube.enter(&ray((0.0, 0.6, 0.5), (1.0, 0.0, 0.0))), None, "beside");
    }

    #[test]
    fn cylinders_have_a_side_and_a_lid() {
        let bin = Solid { outline: Outline::Round { x: 2.0, y: 0.0, radius: 0.5 }, height: 1.0 };
        let side = bin.enter(&ray((0.0, 0.0, 0.5), (1.0, 0.0, 0.0)));
        assert_eq!(side, Some((1.5, Vec3::new(-1.0, 0.0, 0.0))));
        let lid = bin.enter(&ray((0.0, 0.0, 2.0), (2.0, 0.0, -1.0)));
        assert_eq!(lid, Some((1.0, Vec3::new(0.0, 0.0, 1.0))));
        assert_eq!(bin.enter(&ray((2.0, 0.0, 3.0), (0.0, 0.0, -1.0))).map(|h| h.0), Some(2.0));
        assert_eq!(bin.enter(&ray((0.0, 0.6, 0.5), (1.0, 0.0, 0.0))), None);
        assert_eq!(bin.enter(&ray((0.0, 0.0, 0.5), (-1.0, 0.0, 0.0))), None);
    }

    #[test]
    fn the_nearest_surface_is_met() {
        let hall = [Room { x: (0.0, 10.0), y: (-1.0, 1.0) }];
        let bin = Solid { outline: Outline::Round { x: 4.0, y: 0.0, radius: 0.2 }, height: 0.5 };
        let geometry = Geometry::new(&hall, vec![bin], 2.5);
        let surface = |direction| geometry.cast(&ray((1.0, 0.0, 1.0), direction)).surface;
        assert_eq!(surface((1.0, 0.0, -0.25)), Surface::Solid(0));
        assert_eq!(surface((1.0, 0.0, -0.6)), Surface::Floor);
        assert_eq!(surface((1.0, 0.0, 0.9)), Surface::Ceiling);
        let Surface::Wall(i) = surface((1.0, 0.0, -0.01)) else { panic!("the far wall stands there") };
        assert_eq!(geometry.walls()[i].normal(), Vec3::new(-1.0, 0.0, 0.0));
        assert!((geometry.clearance(4.0, 0.5, 9.0) - 0.3).abs() < 1e-12);
        assert_eq!(geometry.clearance(1.0, 0.2, 9.0), 0.8);
    }
}
