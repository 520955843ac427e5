//! `vsonar calibrate`: the camera's height, pitch, field of view and distortion, from points on the floor.

use std::path::{Path, PathBuf};

use vsonar::camera::calibrate::{self, CalibrateError, Calibration, Known, Number, Source};
use vsonar::camera::{Camera, points};
use vsonar::support::bounded::Bounded;

use super::CliError;
use super::output::{self, count, from_here};
use super::program::size;
use super::table::Table;
use vsonar::support::printable::ShownPath as _;

/// Reads far more than any table of points. It may come through a pipe.
const TABLE: Bounded = Bounded::to(16 << 20).or_pipes();

const EXAMPLES: &str = "\
Examples:
  vsonar calibrate points.csv --out camera.toml                  all from points at known places
  vsonar calibrate points.csv --height 0.8 --pitch 51            only what was not measured by hand
  vsonar calibrate points.csv --height 0.8 --pitch 51 --fov 90   compare the points with a known camera

The table has the header `column,row,ahead,left`: a pixel (column from the left edge, row from the top edge, both \
from 0), and where the floor that it shows lies, in metres ahead of the point under the lens and to the left of \
the middle line (to the right negative). `left` may be missing. A yardstick across the camera's view, and the same \
farther ahead, make a good table. Height, pitch and field of view need one number each, column or row; distortion \
six points from the middle to the corners, else it is taken as 0.";

/// Find a camera's height, pitch and field of view from points on the floor
///
/// Reads a table of pixels and the places on the floor that they show, fits the camera to it, and prints each number
/// with its standard error and how far the points are off.
#[derive(clap::Args)]
#[command(after_help = EXAMPLES, allow_negative_numbers = true)]
pub(crate) struct Args {
    /// The table of points, column,row,ahead,left
    table: PathBuf,
    /// Height of the lens above the floor in metres, if it is known
    #[arg(long, value_name = "M", value_parser = number)]
    height: Option<f64>,
    /// Angle of the optical axis below the horizontal in degrees, if it is known
    #[arg(long, value_name = "DEG", value_parser = number)]
    pitch: Option<f64>,
    /// Horizontal field of view in degrees, if it is known
    #[arg(long, value_name = "DEG", value_parser = number)]
    fov: Option<f64>,
    /// Radial distortion, if it is known; 0 for none
    #[arg(long, value_name = "K", value_parser = number)]
    distortion: Option<f64>,
    /// Width and height of the images in pixels
    #[arg(long, value_name = "WxH", value_parser = size, default_value = "320x240")]
    size: (u32, u32),
    /// Write the camera to this file
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Replace the file if there is one
    #[arg(long, requires = "out")]
    force: bool,
    /// Print the result as JSON
    #[arg(long, conflicts_with = "quiet")]
    json: bool,
    /// Print warnings alone, on standard error
    #[arg(long)]
    quiet: bool,
}

fn number(text: &str) -> Result<f64, String> {
    let number = text.parse::<f64>().ok().filter(|number| number.is_finite());
    number.ok_or_else(|| "give a number, as in 0.8".to_string())
}

/// Calibrates and reports.
pub(crate) fn run(args: Args) -> Result<(), CliError> {
    let known = Known {
        height: args.height,
        pitch: args.pitch,
        field_of_view: args.fov,
        distortion: args.distortion,
    };
    if let Some(out) = &args.out {
        may_write(out, &args.table, args.force)?;
    }
    let points = read(&args.table)?;
    let found = calibrate::calibrate(&points, &known, args.size).map_err(|e| complaint(&args.table, &e))?;
    let found = Calibration { camera: rounded(&found), ..found };
    if let Some(out) = &args.out {
        output::write_file(out, found.camera.to_toml(&note(&found)).as_bytes())?;
    }
    if args.json {
        output::print_json(&found)
    } else if args.quiet {
        for warning in &found.warnings {
            output::say(&format!("warning: {}: {warning}", args.table.shown()));
        }
        Ok(())
    } else {
        output::print(&report(&args, &found))
    }
}

/// Whether the camera's file may be written, asked before there is anything to write.
fn may_write(out: &Path, table: &Path, force: bool) -> Result<(), CliError> {
    let same =
        std::fs::canonicalize(out).is_ok_and(|out| std::fs::canonicalize(table).is_ok_and(|t| t == out));
    if same {
        let text = format!("--out: {} is the table itself; choose another name", out.shown());
        return Err(CliError::Usage(text));
    }
    // A device or a pipe is written to as it is.
    if !force && out.metadata().is_ok_and(|there| there.is_file()) {
        let text =
            format!("{}: exists already; choose another name, or replace it with `--force`", out.shown());
        return Err(CliError::Failed(text));
    }
    Ok(())
}

fn read(table: &Path) -> Result<Vec<points::Point>, CliError> {
    let text = TABLE.text(table).map_err(|e| CliError::file(table, "read the table", &e))?;
    Ok(points::read(&text, &table.shown())?)
}

fn complaint(table: &Path, error: &CalibrateError) -> CliError {
    let table = table.shown();
    match (error, error.line()) {
        // They were typed.
        (CalibrateError::Camera(error), _) => CliError::Usage(error.to_string()),
        (_, Some(line)) => CliError::Failed(format!("{table}:{line}: {error}")),
        (_, None) => CliError::Failed(format!("{table}: {error}")),
    }
}

/// The camera as it is written: what was fitted to as many places as can mean something, what was given as it was. A
/// camera at the edge of the possible is not rounded over it.
fn rounded(found: &Calibration) -> Camera {
    let round = |number: &Number, unit: f64| match number.source {
        Source::Fitted => (number.value * unit).round() / unit,
        _ => number.value,
    };
    let [height, pitch, field_of_view, distortion] = &found.numbers;
    let camera = Camera {
        height: round(height, 1e5),
        pitch: round(pitch, 1e4),
        field_of_view: round(field_of_view, 1e4),
        distortion: round(distortion, 1e6),
    };
    let (width, height) = found.size;
    if camera.check(width, height).is_ok() { camera } else { found.camera }
}

/// What the camera's file says of its origin.
fn note(found: &Calibration) -> String {
    let (width, height) = found.size;
    format!(
        "Calibrated on {} for images of {width} x {height} pixels; it holds for all of this shape.\n{}",
        count(found.residuals.len() as u64, "point"),
        off(found)
    )
}

fn off(found: &Calibration) -> String {
    let mut text = format!("Off by {:.2} pixels (RMS)", found.rms_pixels);
    if let Some(worst) = found.worst() {
        text += &format!(", {:.2} at most (line {})", worst.pixels, worst.line);
    }
    if let (Some(rms), Some(worst)) = (found.rms_metres, found.worst_on_floor()) {
        let most = worst.metres.unwrap_or_default();
        text += &format!("; on the floor {rms:.3} m, {most:.3} m at most (line {})", worst.line);
    }
    text + "."
}

fn report(args: &Args, found: &Calibration) -> String {
    let (width, height) = found.size;
    let points = count(found.residuals.len() as u64, "point");
    let mut text = format!("{}: {points} in images of {width} x {height} pixels\n\n", args.table.shown());
    let mut table = Table::new(2, &["", "", "value", "± std. error"]);
    for (number, (unit, digits)) in found.numbers.iter().zip([("m", 4), ("deg", 2), ("deg", 2), ("", 4)]) {
        let error = number.standard_error.map_or(String::new(), |e| format!("± {e:.digits$}"));
        let value = match number.source {
            Source::Fitted => format!("{:.digits$}", number.value),
            _ => number.value.to_string(),
        };
        let unit = if unit.is_empty() { String::new() } else { format!(" {unit}") };
        table.row([number.name.replace('_', " "), origin(number).to_string(), value + &unit, error]);
    }
    text += &format!("{table}\n{}\n{}\n", off(found), in_view(found));
    for warning in &found.warnings {
        text += &format!("Warning: {warning}.\n");
    }
    match &args.out {
        Some(out) => text += &format!("\n{}: written\n", from_here(out).shown()),
        None => text += "\nTo keep the camera, add `--out camera.toml`.\n",
    }
    text
}

fn origin(number: &Number) -> &'static str {
    match number.source {
        Source::Fitted => "fitted",
        Source::Given => "given",
        Source::TooFewPoints => "too few points to fit it",
        Source::TooNarrow => "the points do not span the image",
        Source::NotSignificant => "none within its error",
    }
}

/// What the camera sees of the floor along its middle.
fn in_view(found: &Calibration) -> String {
    let (camera, size) = (&found.camera, found.size);
    let middle = f64::from(size.0) / 2.0 - 0.5;
    let seen = |row: f64| camera.floor(size, middle, row).map(|(ahead, _)| ahead);
    let near = seen(f64::from(size.1) - 1.0).map_or(String::new(), |near| format!("from {near:.2} m ahead "));
    match seen(0.0) {
        Some(far) => format!("In view is the floor {near}to {far:.2} m."),
        None => {
            // As good as infinitely far.
            let horizon = camera.row_of(size, middle, 1e9);
            let row = horizon.map_or(String::new(), |row| format!(", at row {row:.0}"));
            format!("In view is the floor {near}to the horizon{row}.")
        }
    }
}
