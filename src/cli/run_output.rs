//! What `vsonar run` writes for each frame: a line of JSON, or the frame with the answers drawn over it.

use std::io::{self, StdoutLock, Write};

use serde::{Serialize, Serializer};
use vsonar::camera::ground::{Range, Status};
use vsonar::frames::y4m::{Chroma, Header, Writer};
use vsonar::frames::{Frame, Rate};
use vsonar::report::{Mark, Overlay};
use vsonar::support::printable;

use super::run_worker::Answers;

/// When a frame was, and how long it took.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Timing {
    pub(crate) seconds: Option<f64>,
    pub(crate) latency_us: u64,
}

/// Where the answers go.
pub(crate) enum Sink {
    /// A line of JSON a frame, with ranges or without.
    Lines { out: StdoutLock<'static>, ranges: bool },
    /// A Y4M stream.
    Overlay { writer: Writer<StdoutLock<'static>>, overlay: Overlay, marks: Vec<Mark> },
}

/// The rate that is written where none is known.
const RATE: Option<Rate> = Rate::new(30, 1);

impl Sink {
    pub(crate) fn lines(ranges: bool) -> Sink {
        Sink::Lines { out: io::stdout().lock(), ranges }
    }

    /// A stream of frames of `width` x `height` pixels, enlarged `scale` times.
    pub(crate) fn overlay((width, height): (u32, u32), scale: u32, rate: Option<Rate>) -> io::Result<Sink> {
        let header = Header {
            width: width * scale,
            height: height * scale,
            rate: rate.or(RATE),
            chroma: Chroma::C444,
            limited: Some(false),
        };
        let writer = Writer::new(io::stdout().lock(), header)?;
        Ok(Sink::Overlay { writer, overlay: Overlay::new(scale), marks: Vec::new() })
    }

    /// Writes the answers to a frame, and flushes them.
    pub(crate) fn write(&mut self, frame: &Frame, answers: &Answers, timing: Timing) -> io::Result<()> {
        match self {
            Sink::Lines { out, ranges } => {
                let line = serde_json::to_string(&Line::new(frame, answers, timing, *ranges))?;
                writeln!(out, "{}", printable::json(&line))?;
                out.flush()
            }
            Sink::Overlay { writer, overlay, marks } => {
                mark(answers, marks);
                writer.write_rgb(overlay.draw(&frame.pixels, marks))
            }
        }
    }
}

/// A frame as a line. JSON has no infinities and no NaN: they are null.
#[derive(Serialize)]
struct Line<'a> {
    frame: u64,
    #[serde(skip_serializing_if = "str::is_empty")]
    image: &'a str,
    time: Option<f64>,
    latency_us: u64,
    columns: &'a [u32],
    rows: &'a [f32],
    #[serde(flatten)]
    ranges: Option<Ranges<'a>>,
}

#[derive(Serialize)]
struct Ranges<'a> {
    bearing: Each<'a, f32>,
    distance: Each<'a, f32>,
    nearest: Each<'a, f32>,
    farthest: Each<'a, f32>,
    status: Each<'a, &'static str>,
}

/// One number of each range.
struct Each<'a, T>(&'a [Range], fn(&Range) -> T);

impl<T: Serialize> Serialize for Each<'_, T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(self.0.iter().map(self.1))
    }
}

impl<'a> Line<'a> {
    fn new(frame: &'a Frame, answers: &'a Answers, timing: Timing, ranges: bool) -> Line<'a> {
        let all = &answers.ranges;
        let ranges = ranges.then(|| Ranges {
            bearing: Each(all, |range| range.bearing),
            distance: Each(all, |range| range.distance),
            nearest: Each(all, |range| range.nearest),
            farthest: Each(all, |range| range.farthest),
            status: Each(all, |range| word(range.status)),
        });
        Line {
            frame: frame.index,
            image: &frame.name,
            // To the microsecond.
            time: timing.seconds.map(|seconds| (seconds * 1e6).round() / 1e6),
            latency_us: timing.latency_us,
            columns: &answers.columns,
            rows: &answers.rows,
            ranges,
        }
    }
}

fn word(status: Status) -> &'static str {
    match status {
        Status::Obstacle => "obstacle",
        Status::NoneInView => "none-in-view",
        Status::Invalid => "invalid",
    }
}

/// What is drawn for the answers. Without a camera the floor goes on where a column is floor all the way up.
fn mark(answers: &Answers, marks: &mut Vec<Mark>) {
    marks.resize_with(answers.columns.len(), Mark::default);
    for (i, mark) in marks.iter_mut().enumerate() {
        let range = answers.ranges.get(i);
        mark.x = answers.columns[i];
        mark.answer = answers.rows[i];
        mark.free = range.map_or(mark.answer < 0.5, |range| range.status == Status::NoneInView);
        mark.note.clear();
        if let Some(range) = range.filter(|range| range.status == Status::Obstacle) {
            metres(range.distance, &mut mark.note);
        }
    }
}

/// A distance with as many digits as can be believed, in at most four characters.
fn metres(distance: f32, text: &mut String) {
    use std::fmt::Write as _;
    let decimals = if distance < 0.995 { 2 } else { usize::from(distance < 9.95) };
    // Writing to a string cannot fail; what is beyond four characters is beyond any camera's sight.
    let _ = if distance < 9999.5 { write!(text, "{distance:.decimals$}") } else { write!(text, "far") };
}

#[cfg(test)]
mod tests {
    use super::*;

    fn range(row: f32, distance: f32, status: Status) -> Range {
        Range { row, bearing: 0.25, distance, nearest: 0.5, farthest: f32::INFINITY, status }
    }

    fn answers() -> Answers {
        let rows = vec![0.1, f32::NAN, -3.0];
        let ranges = vec![
            range(0.1, 1.5, Status::Obstacle),
            range(f32::NAN, f32::NAN, Status::Invalid),
            range(-3.0, f32::INFINITY, Status::NoneInView),
        ];
        Answers { columns: vec![1, 2, 3], rows, ranges }
    }

    fn line(ranges: bool) -> String {
        let frame = Frame { index: 7, ..Frame::default() };
        let timing = Timing { seconds: Some(7.0 / 30.0), latency_us: 42 };
        serde_json::to_string(&Line::new(&frame, &answers(), timing, ranges)).expect("JSON")
    }

    #[test]
    fn lines_are_json() {
        let rows = r#"{"frame":7,"time":0.233333,"latency_us":42,"columns":[1,2,3],"rows":[0.1,null,-3.0]"#;
        assert_eq!(line(false), format!("{rows}}}"));
        let ranges = r#""bearing":[0.25,0.25,0.25],"distance":[1.5,null,null],"nearest":[0.5,0.5,0.5],"farthest":[null,null,null],"status":["obstacle","invalid","none-in-view"]"#;
        assert_eq!(line(true), format!("{rows},{ranges}}}"));
    }

    #[test]
    fn marks_tell_what_is_known() {
        let mut marks = Vec::new();
        let mut answers = answers();
        mark(&answers, &mut marks);
        let notes: Vec<_> = marks.iter().map(|mark| (mark.x, mark.free, mark.note.as_str())).collect();
        assert_eq!(notes, [(1, false, "1.5"), (2, false, ""), (3, true, "")]);
        answers.ranges.clear();
        mark(&answers, &mut marks);
        let notes: Vec<_> = marks.iter().map(|mark| (mark.free, mark.note.as_str())).collect();
        assert_eq!(notes, [(true, ""), (false, ""), (true, "")]);
    }

    #[test]
    fn distances_have_four_characters_at_most() {
        for (distance, text) in [
            (0.004, "0.00"),
            (0.994, "0.99"),
            (0.996, "1.0"),
            (9.94, "9.9"),
            (9.96, "10"),
            (9999.4, "9999"),
            (1e30, "far"),
        ] {
            let mut said = String::new();
            metres(distance, &mut said);
            assert_eq!(said, text);
        }
    }
}
