//! A traced case as a picture: the image with the window's way, and beside it, row by row, what the window saw, what
//! was stored and which branches were taken.

use std::fmt::Write as _;
use std::io::Cursor;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use image::{GrayImage, ImageFormat};

use super::svg::{escape, frame};
use super::trace::{SweepTrace, Trace, short};

/// Width of a curve's field, in pixels.
const FIELD: f64 = 96.0;
const GAP: f64 = 14.0;
const MARGIN: f64 = 14.0;
/// Above the image, for the names of the curves.
const HEAD: f64 = 62.0;
/// Width of the strip of a line that chooses.
const STRIP: f64 = 9.0;

/// The picture, an SVG with the image in it. Rows of the image and of all curves are at the same height.
///
/// # Errors
/// If the image cannot be encoded.
pub fn trace_svg(trace: &Trace, image: &GrayImage) -> Result<String, image::ImageError> {
    let (width, height) = (f64::from(image.width()), f64::from(image.height()));
    let scale = (480.0 / height).clamp(0.25, 8.0);
    let mut png = Cursor::new(Vec::new());
    image.write_to(&mut png, ImageFormat::Png)?;
    let (w, h) = (width * scale, height * scale);
    let mut out = String::new();
    let _ = writeln!(
        out,
        "<text x=\"{MARGIN}\" y=\"22\">{}</text>\n<image x=\"{MARGIN}\" y=\"{HEAD}\" width=\"{w:.1}\" height=\"{h:.1}\" \
         style=\"image-rendering:pixelated\" href=\"data:image/png;base64,{}\"/>",
        escape(&format!("{}, column {}", trace.image, trace.column)),
        STANDARD.encode(png.get_ref())
    );
    let row = |y: f64| HEAD + (y + 0.5) * scale;
    for sweep in &trace.sweeps {
        way(sweep, scale, &mut out);
    }
    let mut x = MARGIN + w + 2.0 * GAP;
    for (number, sweep) in trace.sweeps.iter().enumerate() {
        let from = x;
        for (i, name) in sweep.operators.iter().enumerate() {
            let values: Vec<f32> = sweep.positions.iter().map(|at| at.averages[i]).collect();
            field(x, number + i, name, "image", sweep, &values, scale, h, &mut out);
            x += FIELD + GAP;
        }
        for (i, name) in sweep.registers.iter().enumerate() {
            let values: Vec<f32> = sweep.positions.iter().map(|at| at.registers[i]).collect();
            field(x, i + sweep.operators.len(), name, "memory", sweep, &values, scale, h, &mut out);
            x += FIELD + GAP;
        }
        for (i, choice) in sweep.choices.iter().enumerate() {
            strip(x, choice, sweep, i, scale, h, &mut out);
            x += STRIP + 8.0;
        }
        let _ = writeln!(out, "<text x=\"{from:.1}\" y=\"22\">{} tree</text>", sweep.tree);
        x += 2.0 * GAP;
    }
    let total = x.max(MARGIN + w + 260.0);
    let answer = f64::from(trace.answer);
    let mut marks = vec![("label", f64::from(trace.label), format!("label {}", trace.label))];
    if answer.is_finite() && (-1.0..=height).contains(&answer) {
        marks.push(("answer", answer, format!("answer {}", short(trace.answer))));
    }
    let below = HEAD + h + 18.0;
    for (i, (class, y, text)) in marks.iter().enumerate() {
        let at = row(*y);
        let _ = writeln!(
            out,
            "<line class=\"{class}\" x1=\"{MARGIN}\" y1=\"{at:.1}\" x2=\"{:.1}\" y2=\"{at:.1}\"/>\
             <text class=\"{class}\" x=\"{:.1}\" y=\"{below:.1}\">{}</text>",
            total - MARGIN,
            MARGIN + i as f64 * 110.0,
            escape(text)
        );
    }
    if marks.len() == 1 {
        let why = if answer.is_finite() { "outside the image" } else { "no row" };
        let text = format!("answer {}: {why}", short(trace.answer));
        let x = MARGIN + 110.0;
        let _ = writeln!(out, "<text class=\"answer\" x=\"{x}\" y=\"{below:.1}\">{}</text>", escape(&text));
    }
    let legend =
        "Yellow: where the window went. Strips: filled where the condition in that line of the listing held.";
    let _ = writeln!(out, "<text class=\"small\" x=\"{MARGIN}\" y=\"{:.1}\">{legend}</text>", below + 18.0);
    Ok(frame(total, below + 18.0 + MARGIN, &format!("Trace of {}", trace.image), &out))
}

/// The window's way in the image: the column of its pixels, and the window at its last position.
fn way(sweep: &SweepTrace, scale: f64, out: &mut String) {
    let [w, h] = sweep.window.map(f64::from);
    let left = MARGIN + (f64::from(sweep.x) - ((w - 1.0) / 2.0).floor()) * scale;
    let top = |y: u32| HEAD + (f64::from(y) - ((h - 1.0) / 2.0).floor()) * scale;
    let mut ys = sweep.positions.iter().map(|at| at.y);
    let (Some(least), Some(greatest)) = (ys.clone().min(), ys.clone().max()) else { return };
    let bottom = top(greatest) + h * scale;
    let _ = writeln!(
        out,
        "<rect class=\"window\" stroke-opacity=\"0.45\" x=\"{left:.1}\" y=\"{:.1}\" width=\"{:.1}\" height=\"{:.1}\"/>",
        top(least),
        w * scale,
        bottom - top(least)
    );
    if let Some(last) = ys.next_back() {
        let _ = writeln!(
            out,
            "<rect class=\"window\" x=\"{left:.1}\" y=\"{:.1}\" width=\"{:.1}\" height=\"{:.1}\"/>",
            top(last),
            w * scale,
            h * scale
        );
    }
}

/// A curve over rows: to the right is more. What is not finite leaves a gap.
#[allow(clippy::too_many_arguments, reason = "what is drawn, and where")]
fn field(
    x: f64,
    number: usize,
    name: &str,
    class: &str,
    sweep: &SweepTrace,
    values: &[f32],
    scale: f64,
    height: f64,
    out: &mut String,
) {
    let finite = || values.iter().copied().filter(|v| v.is_finite()).map(f64::from);
    let (low, high) = (finite().fold(0.0, f64::min), finite().fold(0.0, f64::max));
    let span = if high > low { high - low } else { 1.0 };
    let range = match finite().next() {
        Some(_) => format!("{} … {}", short(low as f32), short(high as f32)),
        None => "not finite".to_string(),
    };
    let _ = writeln!(
        out,
        "<rect class=\"faint\" x=\"{x:.1}\" y=\"{HEAD}\" width=\"{FIELD}\" height=\"{height:.1}\"/>\
         <text class=\"small\" x=\"{x:.1}\" y=\"{}\">{}</text>\
         <text class=\"small dim\" x=\"{x:.1}\" y=\"{}\">{range}</text>",
        // Long names take turns in height.
        if number.is_multiple_of(2) { 38 } else { 48 },
        escape(name),
        HEAD - 4.0
    );
    let mut runs: Vec<Vec<String>> = vec![Vec::new()];
    for (at, &value) in sweep.positions.iter().zip(values) {
        if value.is_finite() {
            let px = x + (f64::from(value) - low) / span * FIELD;
            let py = HEAD + (f64::from(at.y) + 0.5) * scale;
            if let Some(run) = runs.last_mut() {
                run.push(format!("{px:.1},{py:.1}"));
            }
        } else {
            runs.push(Vec::new());
        }
    }
    for run in runs.iter().filter(|run| !run.is_empty()) {
        let _ = writeln!(out, "<polyline class=\"{class}\" points=\"{}\"/>", run.join(" "));
    }
}

/// Where the condition of a line held.
fn strip(x: f64, name: &str, sweep: &SweepTrace, choice: usize, scale: f64, height: f64, out: &mut String) {
    let _ = writeln!(
        out,
        "<rect class=\"faint\" x=\"{x:.1}\" y=\"{HEAD}\" width=\"{STRIP}\" height=\"{height:.1}\"/>\
         <text class=\"small\" x=\"{x:.1}\" y=\"{}\">{name}</text>",
        HEAD - 4.0
    );
    for at in sweep.positions.iter().filter(|at| at.branches[choice] == Some(true)) {
        let y = HEAD + f64::from(at.y) * scale;
        let _ = writeln!(
            out,
            "<rect class=\"held\" x=\"{x:.1}\" y=\"{y:.1}\" width=\"{STRIP}\" height=\"{scale:.2}\"/>"
        );
    }
}
