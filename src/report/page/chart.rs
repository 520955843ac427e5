//! Plots of a page, as SVG whose colours are the page's: light or dark as the reader has it. Every finite number can be
//! plotted, and what is not finite is left out ([`Scale`]).
//!
//! `plotters` draws with colours that stand for roles (a number that no reader ever sees); in its text they are replaced
//! by classes, to which the style sheet gives the colours of each theme, and series their dashes.

use std::ops::Range;

use plotters::coord::Shift;
use plotters::prelude::*;

use crate::report::scale::{self, Scale};
use crate::support::printable;

/// Ticks of the axes, at most.
const TICKS: (usize, usize) = (8, 7);
/// Names along an axis, at most; of more, some are left out.
const NAMES: usize = 40;
/// Size of a plot in units; the page shows it as wide as there is room.
const SIZE: (u32, u32) = (480, 270);

/// A plot could not be drawn.
#[derive(Debug, thiserror::Error)]
#[error("a plot cannot be drawn: {0}")]
pub struct PlotError(String);

impl<E: std::error::Error + Send + Sync> From<DrawingAreaErrorKind<E>> for PlotError {
    fn from(error: DrawingAreaErrorKind<E>) -> PlotError {
        PlotError(error.to_string())
    }
}

/// Colours by their role: what is drawn, the class it becomes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Ink {
    /// Text and axes.
    Text,
    /// Lines of the grid.
    Grid,
    /// A series, by number.
    Series(u8),
}

/// The form of a dot.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Marker {
    Disc,
    Triangle,
    Square,
}

/// Series that have colours and dashes of their own.
pub(super) const SERIES: u8 = 6;

impl Ink {
    fn colour(self) -> RGBColor {
        match self {
            Ink::Text => RGBColor(1, 2, 0),
            Ink::Grid => RGBColor(1, 2, 1),
            Ink::Series(number) => RGBColor(1, 2, 16 + number % SERIES),
        }
    }

    /// The class of what is drawn so.
    pub(super) fn class(self) -> String {
        match self {
            Ink::Text => "ink".to_string(),
            Ink::Grid => "grid".to_string(),
            Ink::Series(number) => format!("s{}", number % SERIES),
        }
    }

    /// The form of its dots, so that series differ not by colour alone.
    pub(super) fn marker(self) -> Marker {
        match self {
            Ink::Series(1 | 4) => Marker::Triangle,
            Ink::Series(2 | 5) => Marker::Square,
            _ => Marker::Disc,
        }
    }

    fn all() -> impl Iterator<Item = Ink> {
        [Ink::Text, Ink::Grid].into_iter().chain((0..SERIES).map(Ink::Series))
    }
}

/// A point in the units of the axes.
pub(super) type Point = (f64, f64);

/// What a series is drawn as.
#[derive(Debug, Clone)]
pub(super) enum Shape {
    /// A line through points.
    Line(Vec<Point>),
    /// A surface between two lines over the same x.
    Band(Vec<(f64, f64, f64)>),
    /// Dots; of a radius in units.
    Dots(Vec<Point>, u32),
    /// A ring around each point.
    Rings(Vec<Point>),
    /// Bars: left, right, bottom, top.
    Bars(Vec<(f64, f64, f64, f64)>),
}

/// A series of a plot.
#[derive(Debug, Clone)]
pub(super) struct Series {
    /// Its name in the legend; none is left out of it.
    pub(super) name: Option<String>,
    pub(super) ink: Ink,
    pub(super) shape: Shape,
}

/// How an axis is labelled.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Unit {
    /// Numbers as they are.
    Plain,
    /// Shares, as percentages.
    Percent,
}

impl Unit {
    fn format(self, value: f64) -> String {
        match self {
            // Ticks are round numbers, but for the last bits of their hundredfold.
            Unit::Percent => format!("{} %", scale::label((1e8 * value).round() / 1e6)),
            Unit::Plain => scale::label(value),
        }
    }
}

/// An axis.
#[derive(Debug, Clone)]
pub(super) struct Axis {
    pub(super) label: String,
    pub(super) unit: Unit,
    pub(super) range: Range<f64>,
    /// Names of the places 0, 1, 2 ..., where it has names instead of numbers.
    pub(super) names: Vec<String>,
}

impl Axis {
    /// An axis that holds these values; from 0 on, if it is to.
    pub(super) fn around(label: &str, unit: Unit, zero: bool, values: impl Iterator<Item = f64>) -> Axis {
        let (low, high) = scale::extent(values).unwrap_or((0.0, 1.0));
        let low = if zero { low.min(0.0) } else { low };
        // Of the halves, as their whole may be more than the greatest number.
        let room = if high > low { 0.08 * (high / 2.0 - low / 2.0) } else { 0.5 * high.abs().max(1.0) };
        let below = if zero && low == 0.0 { 0.0 } else { room };
        let (least, most) = match unit {
            // There are no shares beyond these.
            Unit::Percent => (0.0, 1.0),
            Unit::Plain => (f64::MIN, f64::MAX),
        };
        let range = (low - below).clamp(least, most)..(high + room).clamp(least, most);
        let range = if range.is_empty() { least..most } else { range };
        Axis { label: label.to_string(), unit, range, names: Vec::new() }
    }

    /// Shares from 0 to 100 %.
    pub(super) fn shares(label: &str) -> Axis {
        Axis { label: label.to_string(), unit: Unit::Percent, range: 0.0..1.0, names: Vec::new() }
    }

    /// Generations.
    pub(super) fn generations(count: usize) -> Axis {
        let range = 0.0..(count.saturating_sub(1)).max(1) as f64;
        Axis { label: "generation".to_string(), unit: Unit::Plain, range, names: Vec::new() }
    }

    /// Places with names.
    pub(super) fn named(label: &str, names: Vec<String>) -> Axis {
        let range = -0.5..names.len().max(1) as f64 - 0.5;
        Axis { label: label.to_string(), unit: Unit::Plain, range, names }
    }

    fn text(&self, value: f64) -> String {
        match self.names.get(value.max(0.0) as usize) {
            Some(name) => name.clone(),
            None => self.unit.format(value),
        }
    }

    fn scale(&self) -> Scale {
        let named: Vec<usize> = (0..self.names.len()).filter(|&i| !self.names[i].is_empty()).collect();
        let ticks = super::parts::thinned(named.len(), NAMES).into_iter().map(|i| named[i] as f64);
        Scale::linear(self.range.start, self.range.end).with_ticks(ticks.collect())
    }
}

/// A plot.
#[derive(Debug, Clone)]
pub(super) struct Plot {
    pub(super) x: Axis,
    pub(super) y: Axis,
    pub(super) series: Vec<Series>,
}

impl Plot {
    /// The plot as an SVG element with this identifier, a title, and a description for those who do not see it.
    ///
    /// # Errors
    /// If it cannot be drawn.
    pub(super) fn svg(&self, id: &str, title: &str, description: &str) -> Result<String, PlotError> {
        let mut text = String::new();
        {
            let area = SVGBackend::with_string(&mut text, SIZE).into_drawing_area();
            self.draw(&area)?;
            area.present()?;
        }
        for ink in Ink::all() {
            let RGBColor(r, g, b) = ink.colour();
            for (attribute, kind) in [("fill", "f"), ("stroke", "l")] {
                let drawn = format!("{attribute}=\"#{r:02X}{g:02X}{b:02X}\"");
                text = text.replace(&drawn, &format!("class=\"{kind}-{}\"", ink.class()));
            }
        }
        let body = text.find('>').map(|end| &text[end + 1..]);
        let body = body.ok_or_else(|| PlotError("there is no element".to_string()))?;
        Ok(format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {} {}\" role=\"img\" aria-labelledby=\"{id}-t {id}-d\">\
             <title id=\"{id}-t\">{}</title><desc id=\"{id}-d\">{}</desc>{body}",
            SIZE.0,
            SIZE.1,
            escaped(title),
            escaped(description)
        ))
    }

    fn draw(&self, area: &DrawingArea<SVGBackend<'_>, Shift>) -> Result<(), PlotError> {
        let mut chart = ChartBuilder::on(area)
            .margin(6)
            .margin_right(14)
            .x_label_area_size(46)
            .y_label_area_size(70)
            .build_cartesian_2d(self.x.scale(), self.y.scale())?;
        let font = |size: u32| ("sans-serif", size).into_font().color(&Ink::Text.colour());
        let (x, y) = (|value: &f64| self.x.text(*value), |value: &f64| self.y.text(*value));
        let labels = if self.x.names.is_empty() { TICKS.0 } else { NAMES };
        let mut mesh = chart.configure_mesh();
        mesh.x_desc(&self.x.label)
            .y_desc(&self.y.label)
            .axis_desc_style(font(13))
            .label_style(font(12))
            .axis_style(Ink::Text.colour())
            .light_line_style(TRANSPARENT)
            .bold_line_style(Ink::Grid.colour())
            .x_labels(labels)
            .y_labels(TICKS.1)
            .x_label_formatter(&x)
            .y_label_formatter(&y);
        if !self.x.names.is_empty() {
            mesh.disable_x_mesh();
        }
        mesh.draw()?;
        for series in &self.series {
            let colour = series.ink.colour();
            match &series.shape {
                Shape::Line(points) => {
                    let points = finite(points);
                    chart.draw_series([PathElement::new(points, colour.stroke_width(2))])?;
                }
                Shape::Band(band) => {
                    let band =
                        || band.iter().filter(|(x, low, high)| [x, low, high].iter().all(|v| v.is_finite()));
                    let up = band().map(|&(x, low, _)| (x, low));
                    let down = band().rev().map(|&(x, _, high)| (x, high));
                    let outline: Vec<Point> = up.chain(down).collect();
                    if outline.len() > 2 {
                        chart.draw_series([Polygon::new(outline, colour.mix(0.22).filled())])?;
                    }
                }
                Shape::Dots(points, radius) => {
                    let (points, radius) = (finite(points).into_iter(), *radius as i32);
                    match series.ink.marker() {
                        Marker::Disc => {
                            chart.draw_series(points.map(|at| Circle::new(at, radius, colour.filled())))?;
                        }
                        Marker::Triangle => {
                            let size = radius + 2;
                            chart.draw_series(
                                points.map(|at| TriangleMarker::new(at, size, colour.filled())),
                            )?;
                        }
                        Marker::Square => {
                            let corners = [(-radius, -radius), (radius, radius)];
                            let square = || Rectangle::new(corners, colour.filled());
                            chart.draw_series(points.map(|at| EmptyElement::at(at) + square()))?;
                        }
                    }
                }
                Shape::Rings(points) => {
                    let rings = finite(points).into_iter();
                    chart.draw_series(rings.map(|at| Circle::new(at, 8, colour.stroke_width(2))))?;
                }
                Shape::Bars(bars) => {
                    let finite = |bar: &&(f64, f64, f64, f64)| {
                        let (left, right, bottom, top) = bar;
                        [left, right, bottom, top].iter().all(|v| v.is_finite())
                    };
                    let bars = bars.iter().filter(finite).map(|&(left, right, bottom, top)| {
                        Rectangle::new([(left, bottom), (right, top)], colour.filled())
                    });
                    chart.draw_series(bars)?;
                }
            }
        }
        Ok(())
    }
}

fn finite(points: &[Point]) -> Vec<Point> {
    points.iter().copied().filter(|(x, y)| x.is_finite() && y.is_finite()).collect()
}

fn escaped(text: &str) -> String {
    printable::line(text).replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plot() -> Plot {
        let line = |ink, shape| Series { name: None, ink, shape };
        Plot {
            x: Axis::generations(3),
            y: Axis::around("nodes", Unit::Plain, true, [2.0, f64::NAN, 8.0].into_iter()),
            series: vec![
                line(Ink::Series(0), Shape::Line(vec![(0.0, 2.0), (1.0, f64::NAN), (2.0, 8.0)])),
                line(Ink::Series(1), Shape::Band(vec![(0.0, 1.0, 2.0), (1.0, 1.0, 3.0)])),
                line(Ink::Series(2), Shape::Dots(vec![(1.0, 4.0)], 3)),
                line(Ink::Series(3), Shape::Rings(vec![(1.0, 4.0)])),
                line(Ink::Series(4), Shape::Bars(vec![(0.0, 0.5, 0.0, 1.0)])),
            ],
        }
    }

    #[test]
    fn no_colour_is_the_plot_s_own() {
        let svg = plot().svg("p", "a < b & c", "in words").expect("drawn");
        assert!(!svg.contains('#'), "{svg}");
        for class in ["l-s0", "f-s1", "f-s2", "l-s3", "f-s4", "f-ink", "l-grid"] {
            assert!(svg.contains(&format!("class=\"{class}\"")), "{class}: {svg}");
        }
        assert!(svg.contains("<title id=\"p-t\">a &lt; b &amp; c</title>"), "{svg}");
        // An element with two classes would be no XML.
        assert!(svg.split('<').all(|tag| tag.matches("class=").count() <= 1), "{svg}");
        assert!(!svg.contains("NaN") && svg.ends_with("</svg>\n"), "{svg}");
    }

    #[test]
    fn axes_hold_what_there_is() {
        let axis = |zero, values: &[f64]| Axis::around("", Unit::Plain, zero, values.iter().copied()).range;
        assert_eq!(axis(true, &[]), 0.0..1.04);
        assert_eq!(axis(true, &[50.0]), 0.0..52.0);
        assert_eq!(axis(false, &[5.0, 5.0]), 2.5..7.5);
        assert_eq!([2.5, -0.0, 4000.0].map(|value| Unit::Plain.format(value)), ["2.5", "0", "4,000"]);
        assert_eq!([0.2, 0.29, 0.505].map(|value| Unit::Percent.format(value)), ["20 %", "29 %", "50.5 %"]);
        let named = Axis::named("", vec!["a".into(), "b".into()]);
        assert_eq!(
            named.scale().ticks(9).into_iter().map(|at| named.text(at)).collect::<Vec<_>>(),
            ["a", "b"]
        );
    }

    /// Of whatever values an axis is made, it ends, and so does a plot of them.
    #[test]
    fn every_finite_number_can_be_plotted() {
        let numbers = [f64::MIN, -1.0, -5e-324, -0.0, 5e-324, f64::MIN_POSITIVE, 0.3, 1e300, f64::MAX];
        let odd = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY];
        let pairs = numbers.iter().flat_map(|&a| numbers.iter().chain(&odd).map(move |&b| vec![a, b]));
        let lists = pairs.chain(odd.map(|odd| vec![odd])).chain(numbers.map(|one| vec![one])).chain([vec![]]);
        for values in lists {
            for (unit, zero) in [(Unit::Plain, true), (Unit::Plain, false), (Unit::Percent, false)] {
                let axis = Axis::around("", unit, zero, values.iter().copied());
                let (start, end) = (axis.range.start, axis.range.end);
                assert!(start.is_finite() && end.is_finite() && start < end, "{values:?}: {axis:?}");
                assert!(
                    unit == Unit::Percent
                        || values.iter().all(|v| !v.is_finite() || axis.range.contains(v) || *v == end)
                );
                let points: Vec<Point> = values.iter().map(|&v| (v, v)).collect();
                let shapes = [
                    Shape::Line(points.clone()),
                    Shape::Band(values.iter().map(|&v| (v, v, v)).collect()),
                    Shape::Dots(points.clone(), 4),
                    Shape::Rings(points),
                    Shape::Bars(values.iter().map(|&v| (v, v, 0.0, v)).collect()),
                ];
                let series = shapes.map(|shape| Series { name: None, ink: Ink::Series(1), shape });
                let plot = Plot { x: axis.clone(), y: axis, series: series.into() };
                let svg = plot.svg("p", "", "").expect("drawn");
                assert!(!svg.contains("NaN") && !svg.contains("inf"), "{values:?}: {svg}");
                assert!((3..=20).contains(&svg.matches("<text").count()), "{values:?}: {svg}");
            }
        }
        let many = Axis::named("", (0..5000).map(|i| i.to_string()).collect());
        assert_eq!(many.scale().ticks(NAMES).len(), NAMES);
        assert!(Axis::named("", Vec::new()).scale().ticks(NAMES).len() <= NAMES);
    }
}
