//! The report as a picture: time against program size, and time against number of cases, both axes logarithmic, with the
//! number of cases from which compiling pays.

use image::{ImageFormat, Rgb, RgbImage};
use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::break_even::BreakEven;
use super::raster::Raster;
use super::report::Report;
use super::spread::median;
use crate::report::scale::{Scale, extent};

/// Size of a plot in units; a PNG has [`PNG_SCALE`] pixels a unit.
const SIZE: (u32, u32) = (1080, 480);
const PNG_SCALE: u32 = 2;
/// Dots of an executor, at most, so that an SVG stays small.
const DOTS: usize = 200;
/// Ticks of the axes, at most.
const TICKS: (usize, usize) = (12, 14);
/// How far beyond the largest number of cases measured an axis goes on to show a break-even, as a factor.
const BEYOND: f64 = 10.0;

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

/// Which executors a plot shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PlotSeries {
    /// Those that one chooses between: no variant of another that was measured too, as `batch-256` is one of `batch`, and
    /// of those that are slow the walker alone.
    Main,
    /// All that were measured.
    All,
}

impl PlotSeries {
    /// The numbers of the executors shown, in their order.
    fn of(self, names: &[&str]) -> Vec<usize> {
        let is_variant = |name: &str| {
            let of = |other: &&str| name.strip_prefix(*other).is_some_and(|rest| rest.starts_with('-'));
            names.iter().any(of) || name == "reference" && names.contains(&"tree")
        };
        (0..names.len()).filter(|&i| self == PlotSeries::All || !is_variant(names[i])).collect()
    }
}

/// The plot as SVG, on a white ground, with a title and a description for those who do not see it.
///
/// # Errors
/// If it cannot be drawn.
pub fn svg(report: &Report, series: PlotSeries) -> Result<String, PlotError> {
    let mut text = String::new();
    {
        let area = SVGBackend::with_string(&mut text, SIZE).into_drawing_area();
        draw(&area, report, series, 1)?;
        area.present()?;
    }
    let end = text.find('>').ok_or_else(|| PlotError("there is no element".to_string()))? + 1;
    let about = format!(
        "\n<title>{}</title>\n<desc>{}</desc>",
        escaped(&title(report)),
        escaped(&description(report, series))
    );
    text.insert_str(end, &about);
    Ok(text)
}

/// The plot as a PNG file.
///
/// # Errors
/// If it cannot be drawn.
pub fn png(report: &Report, series: PlotSeries) -> Result<Vec<u8>, PlotError> {
    let (width, height) = SIZE;
    let mut image = RgbImage::from_pixel(width * PNG_SCALE, height * PNG_SCALE, Rgb([255; 3]));
    draw(&Raster(&mut image).into_drawing_area(), report, series, PNG_SCALE)?;
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

fn description(report: &Report, series: PlotSeries) -> String {
    let mut text = "Two panels with logarithmic axes. Left: milliseconds of an individual on all cases, compilation \
                    included, against operations of its optimised program. Right: the median against the number of \
                    fitness cases."
        .to_string();
    let names = names(report);
    for number in series.of(&names) {
        let line: Vec<String> =
            scaling(report, number).iter().map(|(n, ms)| format!("{n} cases {ms:.3} ms")).collect();
        text += &format!(" {}: {}.", names[number], line.join(", "));
    }
    if let Some(break_even) = break_even(report, &names) {
        text += &format!(" {}.", pays(break_even));
    }
    text
}

/// The break-even of the first executor that compiles, on the individuals of the panel of numbers of cases.
fn break_even<'a>(report: &'a Report, names: &[&str]) -> Option<&'a BreakEven> {
    let generation = report.generations.iter().find(|g| g.generation == report.scaling.generation)?;
    names.iter().find_map(|name| generation.break_even.iter().find(|b| b.executor == *name))
}

/// From where compiling pays, in words.
fn pays(BreakEven { executor, interpreter, cases, .. }: &BreakEven) -> String {
    match cases.median.is_finite() {
        true => format!(
            "Break-even: for half of the programs {executor} beats {interpreter} from {} cases on",
            crate::report::scale::label(cases.median.ceil())
        ),
        false => format!("Break-even: for half of the programs {executor} never beats {interpreter}"),
    }
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
        .filter(|(_, ms)| ms.is_finite())
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
        .filter(|(_, ms)| ms.is_finite())
        .collect()
}

fn draw<DB: DrawingBackend>(
    area: &DrawingArea<DB, Shift>,
    report: &Report,
    series: PlotSeries,
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
    let shown = series.of(&names);
    legend(area, &shown.iter().map(|&number| names[number]).collect::<Vec<_>>(), unit)?;
    let (_, panels) = area.split_vertically(n(56));
    let (left, right) = panels.split_horizontally(n(SIZE.0 / 2));
    let dots: Vec<Points> = shown.iter().map(|&number| dots(report, number)).collect();
    let lines: Vec<Points> = dots.iter().map(by_size).collect();
    let all = || dots.iter().chain(&lines).flatten();
    let size = Panel {
        x: Scale::logarithmic(all().map(|p| p.0)),
        y: Scale::logarithmic(all().map(|p| p.1)),
        x_label: "operations of the optimised program".to_string(),
        y_label: "ms, all cases",
        mark: None,
    };
    size.draw(&left, &dots, &lines, unit)?;
    let lines: Vec<Points> = shown.iter().map(|&number| scaling(report, number)).collect();
    let numbers: Vec<f64> = report.scaling.points.iter().map(|p| p.cases as f64).collect();
    let break_even = break_even(report, &names);
    let at = break_even.and_then(|found| on_panel(found.cases.median, &numbers));
    let cases = Panel {
        x: Scale::logarithmic(numbers.iter().copied().chain(at))
            .with_ticks(numbers.into_iter().chain(at).collect()),
        y: Scale::logarithmic(lines.iter().flatten().map(|p| p.1)),
        x_label: format!("fitness cases (generation {})", report.scaling.generation),
        y_label: "ms, median",
        mark: break_even.map(|found| (at, pays(found))),
    };
    cases.draw(&right, &[], &lines, unit)
}

/// The number of cases, if the panel with these can hold it; less than a case is one.
fn on_panel(cases: f64, numbers: &[f64]) -> Option<f64> {
    let (_, most) = extent(numbers.iter().copied())?;
    (cases <= BEYOND * most).then_some(cases.ceil().max(1.0))
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

/// Two axes and what is marked between them.
struct Panel {
    x: Scale,
    y: Scale,
    x_label: String,
    y_label: &'static str,
    /// A place on the x-axis, if it is on it, and what it means.
    mark: Option<(Option<f64>, String)>,
}

impl Panel {
    /// Axes, dots and lines of each executor.
    fn draw<DB: DrawingBackend>(
        self,
        area: &DrawingArea<DB, Shift>,
        dots: &[Points],
        lines: &[Points],
        unit: u32,
    ) -> Result<(), PlotError>
    where
        DB::ErrorType: 'static,
    {
        let (low, high) = (self.y.range().start, self.y.range().end);
        let mut chart = ChartBuilder::on(area)
            .margin(10 * unit)
            .margin_top(if self.mark.is_some() { 26 * unit } else { 10 * unit })
            .x_label_area_size(40 * unit)
            .y_label_area_size(64 * unit)
            .build_cartesian_2d(self.x, self.y)?;
        chart
            .configure_mesh()
            .x_desc(&self.x_label)
            .y_desc(self.y_label)
            .axis_desc_style(font(13, unit))
            .label_style(font(12, unit))
            .light_line_style(TRANSPARENT)
            .bold_line_style(RGBColor(220, 220, 220))
            .x_labels(TICKS.0)
            .y_labels(TICKS.1)
            .draw()?;
        for (number, points) in dots.iter().enumerate() {
            let few = super::population::even_sample(points, DOTS).into_iter();
            chart.draw_series(few.map(|&at| Circle::new(at, 2 * unit, colour(number).mix(0.35).filled())))?;
        }
        if let Some((at, words)) = self.mark {
            if let Some(x) = at {
                let line = vec![(x, low), (x, high)];
                chart.draw_series([PathElement::new(line, BLACK.stroke_width(unit))])?;
            }
            let style = font(12, unit).pos(Pos::new(HPos::Right, VPos::Top));
            let (width, _) = area.dim_in_pixel();
            area.draw(&Text::new(words, ((width - 10 * unit) as i32, (8 * unit) as i32), style))?;
        }
        for (number, points) in lines.iter().enumerate() {
            let marks = points.iter().map(|&at| Circle::new(at, 3 * unit, colour(number).filled()));
            let marks: Vec<_> = marks.collect();
            chart.draw_series([PathElement::new(points.clone(), colour(number).stroke_width(2 * unit))])?;
            chart.draw_series(marks)?;
        }
        Ok(())
    }
}

#[cfg(test)]
#[path = "plot_tests.rs"]
mod tests;
