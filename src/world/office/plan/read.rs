//! A plan from text: one item a line, `#` starts a comment.

use std::str::FromStr;

use super::{ITEMS, Item, ItemKind, Light, Opening, OpeningKind, Person, Plan, PlanError, Start, Stripe};
use crate::support::printable;
use crate::world::geometry::{Room, Wall};
use crate::world::outline::outline;

/// The longest text that is read, in bytes.
const LONGEST: usize = 1 << 20;
/// The most rooms, things, doors and panes, lights, stripes, people and corners of a path.
const ROOMS: usize = 200;
const MANY: usize = 500;
const FEW: usize = 32;
/// The most walls around them.
const WALLS: usize = 2000;
/// Their length in metres: hallways 1.7 m wide of the largest area have 3,000.
const LENGTH: f64 = 6000.0;
/// The most floor that is built, in square metres: by the rooms, and by the rectangle around them.
const AREA: f64 = 2500.0;
const BOUNDS: f64 = 10_000.0;
/// How far from a wall the middle of an opening may be.
const NEAR: f64 = 0.1;

/// A number: its name and its range.
type Field = (&'static str, f64, f64);

const FAR: f64 = 500.0;
const X: Field = ("x", -FAR, FAR);
const Y: Field = ("y", -FAR, FAR);
const X_FROM: Field = ("x from", -FAR, FAR);
const X_TO: Field = ("x to", -FAR, FAR);
const Y_FROM: Field = ("y from", -FAR, FAR);
const Y_TO: Field = ("y to", -FAR, FAR);
const ALBEDO: Field = ("albedo", 0.01, 0.95);
const WIDTH: Field = ("width", 0.05, 20.0);
const DEPTH: Field = ("depth", 0.05, 20.0);
const HEIGHT: Field = ("height", 0.05, 5.0);
/// The lowest chair.
const CHAIR: f64 = 0.35;
const TURN: Field = ("turn", -360.0, 360.0);

/// One line: its number and its words.
struct Line<'a> {
    number: usize,
    keyword: &'a str,
    rest: Vec<&'a str>,
}

impl Line<'_> {
    /// The numbers that follow the keyword: these, of which the last may be missing if it has a default.
    fn numbers<const N: usize>(&self, fields: [Field; N], last: Option<f64>) -> Result<[f64; N], PlanError> {
        let found = self.rest.len();
        if found != N && !(last.is_some() && found + 1 == N) {
            let mut wanted: Vec<&str> = fields.iter().map(|f| f.0).collect();
            let optional = last.and_then(|_| wanted.pop());
            let mut wanted = wanted.join(", ");
            optional.iter().for_each(|name| wanted += &format!(" and perhaps {name}"));
            return Err(PlanError::Count { line: self.number, keyword: self.keyword.into(), found, wanted });
        }
        let mut numbers = [last.unwrap_or(0.0); N];
        for ((number, field), text) in numbers.iter_mut().zip(fields).zip(&self.rest) {
            *number = self.number(field, text)?;
        }
        Ok(numbers)
    }

    fn number(&self, (name, low, high): Field, text: &str) -> Result<f64, PlanError> {
        let line = self.number;
        let value: f64 = text.parse().map_err(|_| PlanError::Number { line, name, text: shown(text) })?;
        if (low..=high).contains(&value) {
            Ok(value)
        } else {
            Err(PlanError::Range { line, name, value, low, high })
        }
    }

    fn room(&self, [x0, x1, y0, y1]: [f64; 4]) -> Result<Room, PlanError> {
        if x1 - x0 >= 0.01 && y1 - y0 >= 0.01 {
            Ok(Room { x: (x0, x1), y: (y0, y1) })
        } else {
            Err(PlanError::Empty { line: self.number })
        }
    }

    fn item(&self, kind: ItemKind) -> Result<Item, PlanError> {
        // the slats of a chair begin above its seat
        let height = if kind == ItemKind::Chair { (HEIGHT.0, CHAIR, HEIGHT.2) } else { HEIGHT };
        let fields = [X, Y, WIDTH, DEPTH, height, ALBEDO, TURN];
        let [x, y, width, depth, height, albedo, turn] = self.numbers(fields, Some(0.0))?;
        Ok(Item { kind, x, y, width, depth, height, albedo, turn })
    }

    fn person(&self) -> Result<Person, PlanError> {
        let found = self.rest.len();
        if !(6..=2 + 2 * FEW).contains(&found) || !found.is_multiple_of(2) {
            let wanted = format!("speed, albedo, and x and y of 2 to {FEW} corners");
            return Err(PlanError::Count { line: self.number, keyword: self.keyword.into(), found, wanted });
        }
        let speed = self.number(("speed", 0.0, 5.0), self.rest[0])?;
        let albedo = self.number(ALBEDO, self.rest[1])?;
        let corner = |pair: &[&str]| -> Result<_, PlanError> {
            Ok((self.number(X, pair[0])?, self.number(Y, pair[1])?))
        };
        let path = self.rest[2..].chunks_exact(2).map(corner).collect::<Result<_, _>>()?;
        Ok(Person { speed, albedo, path })
    }

    /// Puts one more into a list that holds so many at most.
    fn push<T>(&self, list: &mut Vec<T>, most: usize, one: T) -> Result<(), PlanError> {
        if list.len() >= most {
            return Err(PlanError::TooMany { line: self.number, most });
        }
        list.push(one);
        Ok(())
    }
}

/// A word as a message may have it.
fn shown(word: &str) -> String {
    let short: String = word.chars().take(40).collect();
    let more = if short.len() < word.len() { "..." } else { "" };
    printable::line(&short).into_owned() + more
}

impl FromStr for Plan {
    type Err = PlanError;

    fn from_str(text: &str) -> Result<Plan, PlanError> {
        if text.len() > LONGEST {
            return Err(PlanError::TooLong { bytes: text.len(), most: LONGEST });
        }
        // A byte order mark is what some editors begin with.
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        let lines = text.lines().enumerate().filter_map(|(i, line)| {
            let mut words = line.split('#').next().unwrap_or("").split_whitespace();
            let keyword = words.next()?;
            Some(Line { number: i + 1, keyword, rest: words.collect() })
        });
        let mut lines = lines.peekable();
        match lines.next() {
            Some(line) if line.keyword == "plan" && line.rest == ["1"] => {}
            other => return Err(PlanError::Header { line: other.map_or(1, |line| line.number) }),
        }
        let mut plan = Plan::empty(Vec::new());
        let mut once: Vec<&str> = Vec::new();
        // where the line of each opening, item, light and person is, for what can only be checked at the end
        let mut openings: Vec<usize> = Vec::new();
        let mut places: Vec<(usize, f64, f64)> = Vec::new();
        for line in lines {
            if ["seed", "ceiling", "carpet", "wall", "skirting"].contains(&line.keyword) {
                if once.contains(&line.keyword) {
                    return Err(PlanError::Twice { line: line.number, keyword: line.keyword.into() });
                }
                once.push(line.keyword);
            }
            match line.keyword {
                "seed" => plan.seed = seed(&line)?,
                "ceiling" => [plan.ceiling] = line.numbers([("height", 2.0, 5.0)], None)?,
                "carpet" => [plan.carpet, plan.grain] = line.numbers([ALBEDO, ("grain", 0.0, 1.0)], None)?,
                "wall" => [plan.wall, plan.gloss] = line.numbers([ALBEDO, ("gloss", 0.0, 1.0)], None)?,
                "skirting" => {
                    [plan.skirting, plan.skirting_height] =
                        line.numbers([ALBEDO, ("height", 0.0, 1.0)], None)?;
                }
                "room" => {
                    let room = line.room(line.numbers([X_FROM, X_TO, Y_FROM, Y_TO], None)?)?;
                    line.push(&mut plan.rooms, ROOMS, room)?;
                }
                "stripe" => {
                    let [x0, x1, y0, y1, albedo] =
                        line.numbers([X_FROM, X_TO, Y_FROM, Y_TO, ALBEDO], None)?;
                    let room = line.room([x0, x1, y0, y1])?;
                    line.push(&mut plan.stripes, FEW, Stripe { room, albedo })?;
                }
                "door" | "glass" => {
                    let kind = if line.keyword == "door" { OpeningKind::Door } else { OpeningKind::Glass };
                    let [x, y, width, albedo] = line.numbers([X, Y, WIDTH, ALBEDO], None)?;
                    line.push(&mut plan.openings, MANY, Opening { kind, x, y, width, albedo })?;
                    openings.push(line.number);
                }
                "light" => {
                    let fields = [X, Y, WIDTH, DEPTH, ("power", 0.0, 10.0)];
                    let [x, y, width, depth, power] = line.numbers(fields, None)?;
                    line.push(&mut plan.lights, MANY, Light { x, y, width, depth, power })?;
                    places.push((line.number, x, y));
                }
                "person" => {
                    let person = line.person()?;
                    places.extend(person.path.iter().map(|&(x, y)| (line.number, x, y)));
                    line.push(&mut plan.people, FEW, person)?;
                }
                "start" => {
                    let [x, y, heading] = line.numbers([X, Y, ("heading", -360.0, 360.0)], None)?;
                    line.push(&mut plan.starts, FEW, Start { x, y, heading })?;
                    places.push((line.number, x, y));
                }
                word => match ITEMS.iter().find(|(name, _)| *name == word) {
                    Some(&(_, kind)) => {
                        let item = line.item(kind)?;
                        places.push((line.number, item.x, item.y));
                        line.push(&mut plan.items, MANY, item)?;
                    }
                    None => {
                        let others =
                            "seed ceiling carpet wall skirting room stripe door glass light person start";
                        let names: Vec<&str> =
                            others.split(' ').chain(ITEMS.iter().map(|(name, _)| *name)).collect();
                        let (word, known) = (shown(word), names.join(", "));
                        return Err(PlanError::Unknown { line: line.number, word, known });
                    }
                },
            }
        }
        plan.is_sound(&openings, &places)?;
        Ok(plan)
    }
}

fn seed(line: &Line<'_>) -> Result<u64, PlanError> {
    let [text] = line.rest[..] else {
        let (keyword, wanted) = ("seed".to_string(), "one whole number".to_string());
        return Err(PlanError::Count { line: line.number, keyword, found: line.rest.len(), wanted });
    };
    text.parse().map_err(|_| PlanError::Number { line: line.number, name: "the seed", text: shown(text) })
}

impl Plan {
    /// What only the whole tells.
    fn is_sound(&self, openings: &[usize], places: &[(usize, f64, f64)]) -> Result<(), PlanError> {
        if self.rooms.is_empty() {
            return Err(PlanError::NoRoom);
        }
        let size = |room: &Room| (room.x.1 - room.x.0) * (room.y.1 - room.y.0);
        let (area, bounds) = (self.rooms.iter().map(size).sum::<f64>(), size(&self.bounds()));
        if area > AREA || bounds > BOUNDS {
            return Err(PlanError::TooLarge { area, bounds, most_area: AREA, most_bounds: BOUNDS });
        }
        let walls = outline(&self.rooms);
        if walls.len() > WALLS {
            return Err(PlanError::Walls { walls: walls.len(), most: WALLS });
        }
        let length = walls.iter().map(Wall::length).sum::<f64>();
        if length > LENGTH {
            return Err(PlanError::Length { length, most: LENGTH });
        }
        for (opening, &line) in self.openings.iter().zip(openings) {
            if opening.wall(&walls).is_none() {
                return Err(PlanError::NoWall { line, x: opening.x, y: opening.y });
            }
        }
        match places.iter().find(|&&(_, x, y)| !self.rooms.iter().any(|room| room.contains(x, y))) {
            Some(&(line, x, y)) => Err(PlanError::Outside { line, x, y }),
            None => Ok(()),
        }
    }
}

impl Opening {
    /// The wall it is in, by its index.
    pub(in crate::world::office) fn wall(&self, walls: &[Wall]) -> Option<usize> {
        let away = |wall: &Wall| {
            let (across, along) = if wall.along_y { (self.x, self.y) } else { (self.y, self.x) };
            let beyond = (wall.span.0 - along).max(along - wall.span.1).max(0.0);
            (across - wall.at).abs().max(beyond)
        };
        let nearest = walls.iter().map(away).enumerate().min_by(|a, b| a.1.total_cmp(&b.1));
        nearest.filter(|&(_, away)| away <= NEAR).map(|(i, _)| i)
    }
}
