//! The way of a run, drawn into the plan of the office, as SVG: light or dark as the reader has it.

use std::fmt::Write as _;

use super::run::{End, Run};
use crate::report::scale::{Scale, label};
use crate::support::printable;
use crate::world::geometry::{Outline, Room};
use crate::world::office::Office;

/// Pixels for a metre.
const SCALE: f64 = 40.0;
/// Around the plan, in metres.
const BORDER: f64 = 0.6;
/// Above the plan, for the heading, in pixels.
const HEAD: f64 = 56.0;
/// A line of the legend, in pixels, and the width of an entry.
const LINE: (f64, f64) = (26.0, 152.0);
/// Marks of time along the way, at most, and how far apart they are at least, in pixels.
const MARKS: (usize, f64) = (8, 30.0);

/// Colours for light and dark, by class.
const STYLE: &str = "\
.page{fill:#fff}.out{fill:#d8dbdf}.room{fill:#fff}.wall{stroke:#3b4046;stroke-width:2;stroke-linecap:round}\
.thing{fill:#d9b98c;stroke:#7a5c2e}text{fill:#1d2126}.way{fill:none;stroke:#0067a3;stroke-width:2;stroke-opacity:.75;\
stroke-linejoin:round}.mark{fill:#0067a3}.time{font-size:13px;stroke:#fff;stroke-width:3;paint-order:stroke}\
.body{fill:none;stroke:#0067a3;stroke-width:2}.start{fill:none;stroke:#007f5c;stroke-width:3}\
.end{fill:none;stroke:#9a6b00;stroke-width:3}.hit{fill:none;stroke:#c21f00;stroke-width:3}.scale{fill:none;stroke:#1d2126}\
@media (prefers-color-scheme:dark){.page{fill:#15181c}.out{fill:#0c0e10}.room{fill:#262c33}.wall{stroke:#aab2bb}\
.thing{fill:#6e5a38;stroke:#c9a76b}text{fill:#e6e8eb}.way,.body{stroke:#5cb8f2}.mark{fill:#5cb8f2}.time{stroke:#15181c}\
.start{stroke:#3fcf9f}.end{stroke:#f0c04a}.hit{stroke:#ff7a5c}.scale{stroke:#e6e8eb}}";

/// A map with the way of a run, marks of time along it, and below it what all signs mean. It has x to the right and y up.
/// Heading and caption are any text.
pub fn svg(office: &Office, run: &Run, body_radius: f64, heading: &str, caption: &str) -> String {
    let rooms = office.rooms();
    let least = |value: fn(&Room) -> f64| rooms.iter().map(value).fold(f64::INFINITY, f64::min);
    let (left, bottom) = (least(|room| room.x.0) - BORDER, least(|room| room.y.0) - BORDER);
    let (right, top) = (BORDER - least(|room| -room.x.1), BORDER - least(|room| -room.y.1));
    let (width, plan) = ((right - left) * SCALE, (top - bottom) * SCALE);
    let legend = Legend::new(width, HEAD + plan, run.end);
    let mut map = Map { out: String::new(), left, top };
    map.put(format_args!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width:.1} {0:.1}\" width=\"{width:.0}\" \
         height=\"{0:.0}\" role=\"img\" font-family=\"system-ui,sans-serif\" font-size=\"14\">\n\
         <title>{1}</title>\n<desc>{2}</desc>\n<style>{STYLE}</style>\n\
         <rect class=\"page\" width=\"100%\" height=\"100%\"/>\n\
         <text x=\"{3:.1}\" y=\"26\" font-size=\"18\" font-weight=\"600\">{1}</text>\n\
         <text x=\"{3:.1}\" y=\"46\">{2}</text>\n\
         <rect class=\"out\" y=\"{HEAD}\" width=\"100%\" height=\"{plan:.1}\"/>",
        legend.bottom(),
        escaped(heading),
        escaped(caption),
        BORDER * SCALE
    ));
    map.plan(office);
    map.way(run, body_radius);
    legend.draw(&mut map);
    map.put(format_args!("</svg>"));
    map.out
}

/// The picture while it is drawn.
struct Map {
    out: String,
    /// The left and the upper border of the plan, in metres.
    left: f64,
    top: f64,
}

impl Map {
    fn put(&mut self, line: std::fmt::Arguments<'_>) {
        // Writing to a string cannot fail.
        let _ = self.out.write_fmt(line).and_then(|()| self.out.write_char('\n'));
    }

    fn at(&self, (x, y): (f64, f64)) -> (f64, f64) {
        ((x - self.left) * SCALE, (self.top - y) * SCALE + HEAD)
    }

    fn rect(&mut self, class: &str, room: &Room) {
        let (x, y) = self.at((room.x.0, room.y.1));
        let (w, h) = ((room.x.1 - room.x.0) * SCALE, (room.y.1 - room.y.0) * SCALE);
        self.put(format_args!(
            "<rect class=\"{class}\" x=\"{x:.1}\" y=\"{y:.1}\" width=\"{w:.1}\" height=\"{h:.1}\"/>"
        ));
    }

    fn plan(&mut self, office: &Office) {
        office.rooms().iter().for_each(|room| self.rect("room", room));
        for wall in office.walls() {
            let ((x, y), (u, v)) = (self.at(wall.foot(wall.span.0)), self.at(wall.foot(wall.span.1)));
            self.put(format_args!(
                "<line class=\"wall\" x1=\"{x:.1}\" y1=\"{y:.1}\" x2=\"{u:.1}\" y2=\"{v:.1}\"/>"
            ));
        }
        for solid in office.solids() {
            match solid.outline {
                Outline::Box(room) => self.rect("thing", &room),
                Outline::Round { x, y, radius } => {
                    let ((x, y), r) = (self.at((x, y)), radius * SCALE);
                    self.put(format_args!(
                        "<circle class=\"thing\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{r:.1}\"/>"
                    ));
                }
            }
        }
    }

    fn way(&mut self, run: &Run, body_radius: f64) {
        let points: Vec<(f64, f64)> = run.path.iter().map(|&point| self.at(point)).collect();
        let (Some(&start), Some(&end)) = (points.first(), points.last()) else { return };
        let line: Vec<String> = points.iter().map(|(x, y)| format!("{x:.1},{y:.1}")).collect();
        self.put(format_args!("<polyline class=\"way\" points=\"{}\"/>", line.join(" ")));
        let mut last = start;
        for seconds in times(run) {
            let after = ((seconds / Run::PATH_SECONDS) as usize).min(points.len() - 1);
            let (x, y) = points[after];
            if (x - last.0).hypot(y - last.1) < MARKS.1 {
                continue;
            }
            last = (x, y);
            self.mark(last, points[after.saturating_sub(1)]);
            self.put(format_args!(
                "<text class=\"time\" x=\"{:.1}\" y=\"{:.1}\">{}</text>",
                x + 7.0,
                y - 7.0,
                clock(seconds)
            ));
        }
        self.sign(Sign::Start, start);
        let (x, y) = end;
        self.put(format_args!(
            "<circle class=\"body\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{:.1}\"/>",
            body_radius * SCALE
        ));
        match (run.end, run.hit) {
            (End::Collision, Some(hit)) => self.sign(Sign::Hit, self.at(hit.point)),
            _ => self.sign(Sign::End, end),
        }
    }

    /// An arrow head at a place, in the direction from another one.
    fn mark(&mut self, (x, y): (f64, f64), (u, v): (f64, f64)) {
        let degrees = (y - v).atan2(x - u).to_degrees();
        self.put(format_args!(
            "<path class=\"mark\" d=\"M-5 -6L8 0L-5 6z\" transform=\"translate({x:.1} {y:.1}) rotate({degrees:.0})\"/>"
        ));
    }

    fn sign(&mut self, sign: Sign, (x, y): (f64, f64)) {
        match sign {
            Sign::Start => {
                self.put(format_args!("<circle class=\"start\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"6\"/>"))
            }
            Sign::End => self.put(format_args!(
                "<rect class=\"end\" x=\"{:.1}\" y=\"{:.1}\" width=\"10\" height=\"10\"/>",
                x - 5.0,
                y - 5.0
            )),
            Sign::Hit => self.put(format_args!(
                "<path class=\"hit\" d=\"M{:.1} {:.1}l12 12m0 -12l-12 12\"/>",
                x - 6.0,
                y - 6.0
            )),
            Sign::Time => {
                self.put(format_args!("<path class=\"way\" d=\"M{:.1} {y:.1}h24\"/>", x - 12.0));
                self.mark((x, y), (x - 1.0, y));
            }
            Sign::Thing => self.put(format_args!(
                "<rect class=\"thing\" x=\"{:.1}\" y=\"{:.1}\" width=\"20\" height=\"12\"/>",
                x - 10.0,
                y - 6.0
            )),
            Sign::Metres => self.put(format_args!(
                "<path class=\"scale\" d=\"M{:.1} {:.1}v6h{:.1}v-6\"/>",
                x - 12.0,
                y - 3.0,
                2.0 * SCALE
            )),
        }
    }
}

/// A sign that the legend explains.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Sign {
    Start,
    Time,
    End,
    Hit,
    Thing,
    Metres,
}

/// What the signs mean, below the plan.
struct Legend {
    top: f64,
    /// Entries side by side.
    columns: usize,
    entries: Vec<(Sign, &'static str)>,
}

impl Legend {
    fn new(width: f64, top: f64, end: End) -> Legend {
        let end = match end {
            End::Collision => (Sign::Hit, "touched here"),
            End::Stuck => (Sign::End, "end: stuck"),
            End::Limit => (Sign::End, "end: time over"),
        };
        let columns = ((width - 2.0 * BORDER * SCALE) / LINE.1).floor().max(1.0) as usize;
        let others = [(Sign::Start, "start"), (Sign::Time, "way and time")];
        let entries =
            others.into_iter().chain([end, (Sign::Thing, "thing"), (Sign::Metres, "2 m")]).collect();
        Legend { top, columns, entries }
    }

    fn bottom(&self) -> f64 {
        self.top + 14.0 + self.entries.len().div_ceil(self.columns) as f64 * LINE.0
    }

    fn draw(&self, map: &mut Map) {
        for (i, &(sign, words)) in self.entries.iter().enumerate() {
            let x = BORDER * SCALE + (i % self.columns) as f64 * LINE.1 + 12.0;
            let y = self.top + 20.0 + (i / self.columns) as f64 * LINE.0;
            map.sign(sign, (x, y));
            let beside = if sign == Sign::Metres { 2.0 * SCALE - 12.0 } else { 14.0 } + 8.0;
            map.put(format_args!("<text x=\"{:.1}\" y=\"{:.1}\">{words}</text>", x + beside, y + 5.0));
        }
    }
}

/// The times of a run that are marked, in seconds: round ones, and not its start.
fn times(run: &Run) -> Vec<f64> {
    let (unit, length) = if run.seconds < 60.0 { (1.0, run.seconds) } else { (60.0, run.seconds / 60.0) };
    let ticks = Scale::linear(0.0, length).ticks(MARKS.0).into_iter().map(|tick| tick * unit);
    ticks.filter(|&seconds| seconds >= Run::PATH_SECONDS && seconds <= run.seconds).collect()
}

/// Minutes and seconds, or seconds with their fraction.
fn clock(seconds: f64) -> String {
    match seconds {
        0.0..60.0 => format!("{} s", label(seconds)),
        _ => format!("{:.0}:{:02.0}", (seconds / 60.0).floor(), (seconds % 60.0).floor()),
    }
}

fn escaped(text: &str) -> String {
    printable::line(text).replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drive::run::Hit;
    use crate::world::office::{Kind, Thing};

    fn run(seconds: f64, end: End) -> Run {
        let places = (seconds / Run::PATH_SECONDS) as usize + 1;
        let hit = Hit { thing: Thing::Wall, point: (1.0, 1.0), in_view: true, walked_into: false };
        Run {
            number: 1,
            end,
            hit: (end == End::Collision).then_some(hit),
            metres: 1.0,
            seconds,
            turning: 0.0,
            squares: 1,
            accuracy: None,
            path: (0..places).map(|i| (1.0 + 0.5 * i as f64, 1.0)).collect(),
        }
    }

    fn drawn(run: &Run) -> String {
        svg(&Office::new(Kind::Fmrb, 1), run, 0.24, "a <run>", "how & where")
    }

    #[test]
    fn a_map_says_what_is_on_it() {
        let map = drawn(&run(639.0, End::Collision));
        assert!(map.contains("<title>a &lt;run&gt;</title>") && map.matches("how &amp; where").count() == 2);
        assert!(map.contains("prefers-color-scheme:dark") && !map.contains("NaN"), "{map}");
        for words in ["start", "way and time", "touched here", "thing", "2 m", "2:00", "10:00"] {
            assert!(map.contains(&format!(">{words}</text>")), "{words}: {map}");
        }
        assert!(!map.contains("time over"));
        assert_eq!(map.matches("class=\"time\"").count(), 5, "2, 4, 6, 8 and 10 minutes");
        assert!(drawn(&run(639.0, End::Limit)).contains(">end: time over</text>"));
        assert!(drawn(&run(70.0, End::Stuck)).contains(">end: stuck</text>"));
    }

    #[test]
    fn runs_of_every_length_have_few_marks() {
        for seconds in [0.0, 0.1, 0.5, 3.0, 59.9, 60.0, 61.0, 2700.0, 60_000.0] {
            let run = run(seconds, End::Limit);
            let times = times(&run);
            assert!(times.len() <= MARKS.0 && times.iter().all(|t| *t <= seconds), "{seconds}: {times:?}");
            assert!(seconds < 2.0 || times.len() >= 2, "{seconds}: {times:?}");
            let marks = drawn(&run).matches("class=\"time\"").count();
            assert!(marks <= times.len() && (times.len() < 2 || marks > 0), "{seconds}: {marks}");
        }
        // One that turns in place has no heap of marks.
        let mut still = run(600.0, End::Stuck);
        still.path.iter_mut().for_each(|place| *place = (1.0, 1.0));
        assert_eq!(drawn(&still).matches("class=\"time\"").count(), 0);
        let nowhere = Run { path: Vec::new(), ..run(60.0, End::Limit) };
        assert!(!drawn(&nowhere).contains("<polyline"));
        assert_eq!([0.5, 30.0, 60.0, 150.0, 6000.0].map(clock), ["0.5 s", "30 s", "1:00", "2:30", "100:00"]);
    }
}
