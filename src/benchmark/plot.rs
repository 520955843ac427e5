//! The report as a picture: time against program size, and time against number of cases, both axes logarithmic.

use std::ops::Range;

use image::{ImageFormat, Rgb, RgbImage};
use plotters::coord::Shift;
use plotters::coord::ranged1d::{KeyPointHint, NoDefaultFormatting, ValueFormatter};
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::raster::Raster;
use super::report::Report;
use super::spread::median;

/// Size of a plot in units; a PNG has [`PNG_SCALE`] pixels a unit.
const SIZE: (u32, u32) = (1080, 480);
const PNG_SCALE: u32 = 2;
/// Dots of an executor, at most, so that an SVG stays small.
const DOTS: usize = 200;

/// The colours of executors, in their order: Okabe and Ito's, which differ for colour-blind people too, then
/// more for machines with many.
const COLOURS: [RGBColor; 12] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(86, 180, 233),
    RGBColor(230, 159, 0),
    RGBColor(0, 0, 0),
    RGBColor(150, 140, 20),
    RGBColor(140, 70, 30),
    RGBColor(110, 80, 180),
    RGBColor(130, 130, 130),
    RGBColor(190, 30, 60),
];

/// A plot could not be drawn.
#[derive(Debug, thiserror::Error)]
#[error("the plot cannot be drawn: {0}")]
pub struct PlotError(String);

impl<E: std::error::Error + Send + Sync> From<DrawingAreaErrorKind<E>> for PlotError {
    fn from(error: DrawingAreaErrorKind<E>) -> PlotError {
        PlotError(error.to_string())
    }
}

/// The plot as SVG, on a white ground, with a title and a description for those who do not see it.
///
/// # Errors
/// If it cannot be drawn.
pub fn svg(report: &Report) -> Result<String, PlotError> {
    let mut text = String::new();
    {
        let area = SVGBackend::with_string(&mut text, SIZE).into_drawing_area();
        draw(&area, report, 1)?;
        area.present()?;
    }
    let end = text.find('>').ok_or_else(|| PlotError("there is no element".to_string()))? + 1;
    let about = format!(
        "\n<title>{}</title>\n<desc>{}</desc>",
        escaped(&title(report)),
        escaped(&description(report))
    );
    text.insert_str(end, &about);
    Ok(text)
}

/// The plot as a PNG file.
///
/// # Errors
/// If it cannot be drawn.
pub fn png(report: &Report) -> Result<Vec<u8>, PlotError> {
    let (width, height) = SIZE;
    let mut image = RgbImage::from_pixel(width * PNG_SCALE, height * PNG_SCALE, Rgb([255; 3]));
    draw(&Raster(&mut image).into_drawing_area(), report, PNG_SCALE)?;
    let mut bytes = std::io::Cursor::new(Vec::new());
    image.write_to(&mut bytes, ImageFormat::Png).map_err(|e| PlotError(e.to_string()))?;
    Ok(bytes.into_inner())
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

fn title(report: &Report) -> String {
    let generations: Vec<String> = report.generations.iter().map(|g| g.generation.to_string()).collect();
    format!(
        "Time of an individual by executor: fresh individuals of generations {} on {}",
        generations.join(", "),
        report.data.name
    )
}

fn description(report: &Report) -> String {
    let mut text = "Two panels with logarithmic axes. Left: milliseconds of an individual on all cases, compilation \
                    included, against operations of its optimised program. Right: the median against the number of \
                    fitness cases."
        .to_string();
    for (number, name) in names(report).iter().enumerate() {
        let line: Vec<String> =
            scaling(report, number).iter().map(|(n, ms)| format!("{n} cases {ms:.3} ms")).collect();
        text += &format!(" {name}: {}.", line.join(", "));
    }
    text
}

fn names(report: &Report) -> Vec<&str> {
    let first = report.generations.first();
    first.map_or_else(Vec::new, |g| g.executors.iter().map(|e| e.executor.as_str()).collect())
}

/// A line of points, in milliseconds.
type Points = Vec<(f64, f64)>;

/// Operations and time of every individual that an executor ran.
fn dots(report: &Report, executor: usize) -> Points {
    let individuals = report.generations.iter().flat_map(|g| &g.measured);
    individuals
        .filter_map(|i| {
            Some((i.operations.max(1) as f64, i.together_s.get(executor).copied().flatten()? * 1e3))
        })
        .collect()
}

/// Median times by size: sizes are grouped by powers of the square root of 2, groups of fewer than three left out.
fn by_size(dots: &Points) -> Points {
    let group = |operations: f64| (operations.log2() * 2.0).round() as i32;
    let mut groups = std::collections::BTreeMap::<i32, Points>::new();
    dots.iter().for_each(|&(x, y)| groups.entry(group(x)).or_default().push((x, y)));
    let points = groups.into_values().filter(|points| points.len() >= 3);
    points.map(|p| (median(p.iter().map(|p| p.0)), median(p.iter().map(|p| p.1)))).collect()
}

fn scaling(report: &Report, executor: usize) -> Points {
    let points = report.scaling.points.iter();
    points
        .filter_map(|p| Some((p.cases as f64, p.executors.get(executor)?.together_s.median * 1e3)))
        .collect()
}

/// A logarithmic axis.
#[derive(Debug, Clone)]
struct LogAxis {
    range: Range<f64>,
    /// Where it has ticks; if nowhere in particular, at 1, 2 and 5 times the powers of ten, or at the powers alone if
    /// that is too many.
    ticks: Vec<f64>,
}

impl LogAxis {
    /// An axis that holds these values, with some room on both sides.
    fn around(values: impl Iterator<Item = f64>, ticks: Vec<f64>) -> LogAxis {
        let positive = values.filter(|v| v.is_finite() && *v > 0.0);
        let (low, high) = positive.fold((f64::INFINITY, 0.0f64), |(low, high), v| (low.min(v), high.max(v)));
        let range = if low > high { 1.0..10.0 } else { low / 1.3..high * 1.3 };
        LogAxis { range, ticks }
    }

    fn round_numbers(&self, steps: &[f64]) -> Vec<f64> {
        let powers = self.range.start.log10().floor() as i32..=self.range.end.log10().ceil() as i32;
        // A negative power is divided by, which rounds to the decimal as it is written.
        let power = |p: i32, step: f64| if p < 0 { step / 10f64.powi(-p) } else { step * 10f64.powi(p) };
        let all = powers.flat_map(|p| steps.iter().map(move |&step| power(p, step)));
        all.filter(|tick| self.range.contains(tick)).collect()
    }
}

impl Ranged for LogAxis {
    type FormatOption = NoDefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, (from, to): (i32, i32)) -> i32 {
        let share = (value / self.range.start).ln() / (self.range.end / self.range.start).ln();
        from + (share * f64::from(to - from)).round() as i32
    }

    fn key_points<Hint: KeyPointHint>(&self, hint: Hint) -> Vec<f64> {
        if !self.ticks.is_empty() && self.ticks.len() <= hint.max_num_points() {
            return self.ticks.clone();
        }
        let fine = self.round_numbers(&[1.0, 2.0, 5.0]);
        if fine.len() <= hint.max_num_points() { fine } else { self.round_numbers(&[1.0]) }
    }

    fn range(&self) -> Range<f64> {
        self.range.clone()
    }
}

impl ValueFormatter<f64> for LogAxis {
    fn format(value: &f64) -> String {
        format!("{value}")
    }
}

fn draw<DB: DrawingBackend>(
    area: &DrawingArea<DB, Shift>,
    report: &Report,
    unit: u32,
) -> Result<(), PlotError>
where
    DB::ErrorType: 'static,
{
    area.fill(&WHITE)?;
    let n = |units: u32| (units * unit) as i32;
    let heading = font(15, unit).pos(Pos::new(HPos::Center, VPos::Top));
    area.draw(&Text::new(title(report), (n(SIZE.0 / 2), n(10)), heading))?;
    let names = names(report);
    legend(area, &names, unit)?;
    let (_, panels) = area.split_vertically(n(56));
    let (left, right) = panels.split_horizontally(n(SIZE.0 / 2));
    let dots: Vec<Points> = (0..names.len()).map(|number| dots(report, number)).collect();
    let lines = dots.iter().map(by_size).collect();
    panel(&left, &dots, lines, ("operations of the optimised program", Vec::new()), "ms, all cases", unit)?;
    let lines = (0..names.len()).map(|number| scaling(report, number)).collect();
    let x = format!("fitness cases (generation {})", report.scaling.generation);
    let numbers = report.scaling.points.iter().map(|p| p.cases as f64).collect();
    panel(&right, &[], lines, (&x, numbers), "ms, median", unit)
}

fn font(size: u32, unit: u32) -> TextStyle<'static> {
    ("sans-serif", size * unit).into_font().color(&BLACK)
}

fn colour(number: usize) -> RGBColor {
    COLOURS[number % COLOURS.len()]
}

/// The executors' names beside their colours, in a row under the heading.
fn legend<DB: DrawingBackend>(
    area: &DrawingArea<DB, Shift>,
    names: &[&str],
    unit: u32,
) -> Result<(), PlotError>
where
    DB::ErrorType: 'static,
{
    let n = |units: u32| (units * unit) as i32;
    let style = font(13, unit).pos(Pos::new(HPos::Left, VPos::Center));
    // As wide as the project's font draws them; others are narrower.
    let width = |name: &str| 8 * name.chars().count() as u32 + 44;
    let mut x = (SIZE.0.saturating_sub(names.iter().map(|name| width(name)).sum())) / 2;
    for (number, name) in names.iter().enumerate() {
        let swatch = colour(number).filled();
        area.draw(&Rectangle::new([(n(x), n(40)), (n(x + 16), n(44))], swatch))?;
        area.draw(&Text::new(name.to_string(), (n(x + 22), n(42)), style.clone()))?;
        x += width(name);
    }
    Ok(())
}

/// Axes, dots and lines of each executor.
fn panel<DB: DrawingBackend>(
    area: &DrawingArea<DB, Shift>,
    dots: &[Points],
    lines: Vec<Points>,
    (x, ticks): (&str, Vec<f64>),
    y: &str,
    unit: u32,
) -> Result<(), PlotError>
where
    DB::ErrorType: 'static,
{
    let all = || dots.iter().chain(&lines).flatten();
    let across = LogAxis::around(all().map(|p| p.0), ticks);
    let up = LogAxis::around(all().map(|p| p.1), Vec::new());
    let mut chart = ChartBuilder::on(area)
        .margin(10 * unit)
        .x_label_area_size(40 * unit)
        .y_label_area_size(64 * unit)
        .build_cartesian_2d(across, up)?;
    chart
        .configure_mesh()
        .x_desc(x)
        .y_desc(y)
        .axis_desc_style(font(13, unit))
        .label_style(font(12, unit))
        .light_line_style(TRANSPARENT)
        .bold_line_style(RGBColor(220, 220, 220))
        .x_labels(12)
        .y_labels(14)
        .draw()?;
    for (number, points) in dots.iter().enumerate() {
        let few = super::population::even_sample(points, DOTS).into_iter();
        chart.draw_series(few.map(|&at| Circle::new(at, 2 * unit, colour(number).mix(0.35).filled())))?;
    }
    for (number, points) in lines.into_iter().enumerate() {
        let marks: Vec<_> =
            points.iter().map(|&at| Circle::new(at, 3 * unit, colour(number).filled())).collect();
        chart.draw_series([PathElement::new(points, colour(number).stroke_width(2 * unit))])?;
        chart.draw_series(marks)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_numbers_inside() {
        let axis = LogAxis { range: 0.03..700.0, ticks: Vec::new() };
        assert_eq!(axis.round_numbers(&[1.0]), [0.1, 1.0, 10.0, 100.0]);
        let names: Vec<String> = axis.round_numbers(&[1.0, 2.0, 5.0]).iter().map(LogAxis::format).collect();
        assert_eq!(names.join(" "), "0.05 0.1 0.2 0.5 1 2 5 10 20 50 100 200 500");
        assert_eq!(axis.map(&0.03, (100, 200)), 100);
        assert_eq!(axis.map(&(0.03f64 * 700.0).sqrt(), (100, 200)), 150);
        assert_eq!(LogAxis::around([].into_iter(), Vec::new()).range, 1.0..10.0);
    }

    #[test]
    fn sizes_are_grouped() {
        let dots = vec![(1.0, 5.0), (16.0, 1.0), (16.0, 3.0), (17.0, 2.0), (64.0, 9.0)];
        assert_eq!(by_size(&dots), [(16.0, 2.0)]);
    }
}
