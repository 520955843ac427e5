//! The way of a run, drawn into the plan of the office, as SVG.

use std::fmt::Write as _;

use super::run::{End, Run};
use crate::world::geometry::Outline;
use crate::world::office::Office;

/// Pixels for a metre.
const SCALE: f64 = 40.0;
/// Around the plan, in metres.
const BORDER: f64 = 0.6;
/// Below it, for scale and words, in metres.
const FOOT: f64 = 1.2;

/// A map with the way of a run: start (ring), end (cross for a collision, square otherwise), a scale, and a line of words.
///
/// It has x to the right and y up. `caption` is any text.
pub fn svg(office: &Office, run: &Run, body_radius: f64, caption: &str) -> String {
    let rooms = office.rooms();
    let least = |value: fn(&crate::world::geometry::Room) -> f64| {
        rooms.iter().map(value).fold(f64::INFINITY, f64::min)
    };
    let (left, bottom) = (least(|room| room.x.0) - BORDER, least(|room| room.y.0) - BORDER);
    let (right, top) = (BORDER - least(|room| -room.x.1), BORDER - least(|room| -room.y.1));
    let (width, height) = ((right - left) * SCALE, (top - bottom + FOOT) * SCALE);
    let at = |x: f64, y: f64| ((x - left) * SCALE, (top - y) * SCALE);
    let mut out = String::new();
    // Writing to a string cannot fail.
    let mut put = |line: std::fmt::Arguments<'_>| {
        let _ = out.write_fmt(line).and_then(|()| out.write_char('\n'));
    };
    put(format_args!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width:.1} {height:.1}\" width=\"{width:.0}\" \
         height=\"{height:.0}\" font-family=\"sans-serif\" font-size=\"14\">"
    ));
    put(format_args!("<title>{}</title>", escaped(caption)));
    put(format_args!("<rect width=\"100%\" height=\"100%\" fill=\"#d8d8d8\"/>"));
    put(format_args!("<g fill=\"#ffffff\">"));
    for room in rooms {
        let (x, y) = at(room.x.0, room.y.1);
        let (w, h) = ((room.x.1 - room.x.0) * SCALE, (room.y.1 - room.y.0) * SCALE);
        put(format_args!("<rect x=\"{x:.1}\" y=\"{y:.1}\" width=\"{w:.1}\" height=\"{h:.1}\"/>"));
    }
    put(format_args!("</g>\n<g stroke=\"#404040\" stroke-width=\"2\" stroke-linecap=\"round\">"));
    for wall in office.walls() {
        let ((x, y), (u, v)) = (wall.foot(wall.span.0), wall.foot(wall.span.1));
        let ((x, y), (u, v)) = (at(x, y), at(u, v));
        put(format_args!("<line x1=\"{x:.1}\" y1=\"{y:.1}\" x2=\"{u:.1}\" y2=\"{v:.1}\"/>"));
    }
    put(format_args!("</g>\n<g fill=\"#b08050\" stroke=\"#604020\">"));
    for solid in office.solids() {
        match solid.outline {
            Outline::Box(room) => {
                let (x, y) = at(room.x.0, room.y.1);
                let (w, h) = ((room.x.1 - room.x.0) * SCALE, (room.y.1 - room.y.0) * SCALE);
                put(format_args!("<rect x=\"{x:.1}\" y=\"{y:.1}\" width=\"{w:.1}\" height=\"{h:.1}\"/>"));
            }
            Outline::Round { x, y, radius } => {
                let (x, y) = at(x, y);
                put(format_args!("<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{:.1}\"/>", radius * SCALE));
            }
        }
    }
    let points: Vec<String> =
        run.path.iter().map(|&(x, y)| at(x, y)).map(|(x, y)| format!("{x:.1},{y:.1}")).collect();
    put(format_args!("</g>\n<g fill=\"none\" stroke-width=\"2\">"));
    put(format_args!(
        "<polyline points=\"{}\" stroke=\"#1f5fbf\" stroke-opacity=\"0.7\" stroke-linejoin=\"round\"/>",
        points.join(" ")
    ));
    if let (Some(&first), Some(&last)) = (run.path.first(), run.path.last()) {
        let ((x, y), (u, v)) = (at(first.0, first.1), at(last.0, last.1));
        put(format_args!("<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"6\" stroke=\"#108030\"/>"));
        let r = body_radius * SCALE;
        put(format_args!("<circle cx=\"{u:.1}\" cy=\"{v:.1}\" r=\"{r:.1}\" stroke=\"#1f5fbf\"/>"));
        match (run.end, run.hit) {
            (End::Collision, Some(hit)) => {
                let (x, y) = at(hit.point.0, hit.point.1);
                put(format_args!(
                    "<path d=\"M{:.1} {:.1}l12 12m0 -12l-12 12\" stroke=\"#d00000\" stroke-width=\"3\"/>",
                    x - 6.0,
                    y - 6.0
                ));
            }
            _ => put(format_args!(
                "<rect x=\"{:.1}\" y=\"{:.1}\" width=\"10\" height=\"10\" stroke=\"#d08000\"/>",
                u - 5.0,
                v - 5.0
            )),
        }
    }
    put(format_args!("</g>"));
    let (x, y) = at(left + BORDER, bottom);
    let end = x + 5.0 * SCALE;
    put(format_args!(
        "<path d=\"M{x:.1} {:.1}v6h{:.1}v-6\" fill=\"none\" stroke=\"#000000\"/>",
        y - 6.0,
        5.0 * SCALE
    ));
    put(format_args!("<text x=\"{:.1}\" y=\"{:.1}\">5 m</text>", end + 8.0, y));
    put(format_args!("<text x=\"{x:.1}\" y=\"{:.1}\">{}</text>\n</svg>", y + 28.0, escaped(caption)));
    out
}

fn escaped(text: &str) -> String {
    let text = text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;");
    text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect()
}
