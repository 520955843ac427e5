//! A plan as text.

use std::fmt;

use super::{OpeningKind, Plan};

impl fmt::Display for Plan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "plan 1")?;
        writeln!(f, "seed {}", self.seed)?;
        writeln!(f, "ceiling {}", self.ceiling)?;
        writeln!(f, "carpet {} {}", self.carpet, self.grain)?;
        writeln!(f, "wall {} {}", self.wall, self.gloss)?;
        writeln!(f, "skirting {} {}", self.skirting, self.skirting_height)?;
        for room in &self.rooms {
            writeln!(f, "room {} {} {} {}", room.x.0, room.x.1, room.y.0, room.y.1)?;
        }
        for stripe in &self.stripes {
            let room = stripe.room;
            writeln!(f, "stripe {} {} {} {} {}", room.x.0, room.x.1, room.y.0, room.y.1, stripe.albedo)?;
        }
        for opening in &self.openings {
            let name = match opening.kind {
                OpeningKind::Door => "door",
                OpeningKind::Glass => "glass",
            };
            writeln!(f, "{name} {} {} {} {}", opening.x, opening.y, opening.width, opening.albedo)?;
        }
        for item in &self.items {
            write!(f, "{} {} {} {} {}", item.kind, item.x, item.y, item.width, item.depth)?;
            write!(f, " {} {}", item.height, item.albedo)?;
            if item.turn.to_bits() != 0 {
                write!(f, " {}", item.turn)?;
            }
            writeln!(f)?;
        }
        for light in &self.lights {
            writeln!(f, "light {} {} {} {} {}", light.x, light.y, light.width, light.depth, light.power)?;
        }
        for person in &self.people {
            write!(f, "person {} {}", person.speed, person.albedo)?;
            for (x, y) in &person.path {
                write!(f, " {x} {y}")?;
            }
            writeln!(f)?;
        }
        for start in &self.starts {
            writeln!(f, "start {} {} {}", start.x, start.y, start.heading)?;
        }
        Ok(())
    }
}
