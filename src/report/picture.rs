//! One image with a detector's answers drawn into it.

use image::{GrayImage, Rgb, RgbImage};

use super::canvas::{Area, BLACK, Canvas, Colour, WHITE};
use super::font;
use crate::evolve::is_correct;
use crate::ir::Rect;

/// Bluish green, of a correct answer. This and [`WRONG`] are told apart by every kind of colour vision
/// (M. Okabe and K. Ito, *Color Universal Design*), lightened to stand out from gray.
pub(super) const RIGHT: Colour = Rgb([40, 215, 150]);

/// Orange, of a wrong answer.
pub(super) const WRONG: Colour = Rgb([255, 150, 0]);

/// The largest factor a picture is enlarged by.
pub const MAX_SCALE: u32 = 16;

/// A column of the image, what a detector answered for it, and what it should have.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Column {
    /// The column, 0 to width - 1.
    pub x: u32,
    /// The ideal answer: row of the lowest non-ground pixel, 0 to height - 1, from the top.
    pub label: u32,
    /// The detector's answer; any value.
    pub answer: f32,
}

impl Column {
    /// Whether the answer is finite and within `tolerance` rows of the label.
    pub fn is_correct(&self, tolerance: f64) -> bool {
        is_correct(self.answer, f64::from(self.label), tolerance)
    }
}

/// How a picture is drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Style {
    /// Answers further than this from the label, in rows, are wrong.
    pub tolerance: f64,
    /// The window of the program's second tree, drawn at its answers; `None` for a detector without one.
    pub window: Option<Rect>,
    /// Pixels of the picture for a pixel of the image, each way: 1 to [`MAX_SCALE`], and taken into this range.
    pub scale: u32,
}

impl Default for Style {
    /// The method's tolerance of 10 rows, no window, no enlargement.
    fn default() -> Style {
        Style { tolerance: crate::dataset::TOLERANCE, window: None, scale: 1 }
    }
}

/// The factor by which an image of this width becomes a picture of about 640 pixels, or stays as it is when it
/// is as wide already.
///
/// ```
/// use vsonar::report::fitting_scale;
/// assert_eq!([16, 160, 320, 640, 1280].map(fitting_scale), [16, 4, 2, 1, 1]);
/// ```
pub fn fitting_scale(width: u32) -> u32 {
    (640 / width.max(1)).clamp(1, MAX_SCALE)
}

/// Draws a detector's answers into an image, after the paper's Figures 1 and 2.
///
/// In each column, a **bar** is white over what the detector takes for ground, from the bottom up to its
/// answer, and black over what it takes for an obstacle: a row is black if it is at or above the answer. The
/// bars have an outline of the other colour, so that they are seen on any background.
///
/// A **cross** stands at the ideal answer, and a **square** of the window's size at the detector's. For a
/// correct answer they are green; for a wrong one they are orange, and a **ring** surrounds the answer, so that
/// nothing depends on colours.
///
/// An answer outside the image has an **arrow head** at that border instead of the square, and the bar is of
/// one colour: white under an answer above row 0 (minus infinity included), black over one below the last row
/// (plus infinity included). An answer that is not a number says nothing of any row: the bar is broken into
/// black and white dashes, and a **question mark** stands in the middle of the column.
///
/// Lines are wider in larger pictures, bars narrower where columns are close together, and what falls outside
/// the image is cut, marks of columns outside it included. The picture's size is the image's times the scale.
pub fn draw(image: &GrayImage, columns: &[Column], style: &Style) -> RgbImage {
    let scale = style.scale.clamp(1, MAX_SCALE);
    let picture = RgbImage::from_fn(image.width() * scale, image.height() * scale, |x, y| {
        let [v] = image.get_pixel(x / scale, y / scale).0;
        Rgb([v, v, v])
    });
    let mut pen = Pen::new(Canvas(picture), columns, style, i64::from(scale));
    // in layers, so that no bar hides a neighbouring column's marks; the crosses' arms reach out from below a
    // square at the same place
    columns.iter().for_each(|c| pen.bar(c));
    columns.iter().for_each(|c| pen.cross(c));
    columns.iter().for_each(|c| pen.answer(c));
    pen.canvas.0
}

/// Where an answer lies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Spot {
    Inside(f64),
    Above,
    Below,
    Nowhere,
}

/// The picture while it is drawn, with all lengths in its pixels.
pub(super) struct Pen<'a> {
    pub(super) canvas: Canvas,
    style: &'a Style,
    pub(super) scale: i64,
    /// Width of a line.
    pub(super) line: i64,
    /// Width of the lines of crosses and rings.
    bold: i64,
    /// Width of a bar without and with its outline.
    pub(super) bar: (i64, i64),
    /// Least distance of two columns, if there are two.
    pub(super) gap: Option<i64>,
    /// Length of a cross's arms.
    arm: i64,
}

impl Pen<'_> {
    pub(super) fn new<'a>(canvas: Canvas, columns: &[Column], style: &'a Style, scale: i64) -> Pen<'a> {
        let side = i64::from(canvas.0.width().min(canvas.0.height()));
        let line = ((side + 120) / 240).max(1);
        let mut xs: Vec<u32> = columns.iter().map(|c| c.x).collect();
        xs.sort_unstable();
        xs.dedup();
        let gap = xs.windows(2).map(|pair| i64::from(pair[1] - pair[0]) * scale).min();
        // at least half of the image between the columns stays visible
        let outer = gap.map_or(5 * line, |gap| (gap / 2).min(5 * line)).max(1);
        let outline = if outer >= 5 * line { line } else { i64::from(outer >= 3) };
        let arm = gap.map_or(6 * line, |gap| gap.min(6 * line)).max(2 * line);
        Pen { canvas, style, scale, line, bold: line + line / 2, bar: (outer - 2 * outline, outer), gap, arm }
    }

    pub(super) fn rows(&self) -> i64 {
        i64::from(self.canvas.0.height()) / self.scale
    }

    pub(super) fn spot(&self, answer: f32) -> Spot {
        match f64::from(answer) {
            a if a.is_nan() => Spot::Nowhere,
            a if a < 0.0 => Spot::Above,
            a if a > (self.rows() - 1) as f64 => Spot::Below,
            a => Spot::Inside(a),
        }
    }

    /// The middle of an image column or row in the picture.
    pub(super) fn middle(&self, at: u32) -> i64 {
        i64::from(at) * self.scale + self.scale / 2
    }

    fn colour(&self, column: &Column) -> Colour {
        if column.is_correct(self.style.tolerance) { RIGHT } else { WRONG }
    }

    pub(super) fn bar(&mut self, column: &Column) {
        let x = self.middle(column.x);
        let height = self.rows() * self.scale;
        // the first row of the picture that is ground
        let split = match self.spot(column.answer) {
            Spot::Inside(answer) => (answer.floor() as i64 + 1) * self.scale,
            Spot::Above => 0,
            Spot::Below => height,
            Spot::Nowhere => return self.dashes(x, height),
        };
        self.piece(x, 0, split, BLACK, WHITE);
        self.piece(x, split, height, WHITE, BLACK);
    }

    /// A piece of a bar with its outline at both sides.
    pub(super) fn piece(&mut self, x: i64, top: i64, bottom: i64, colour: Colour, outline: Colour) {
        for (width, colour) in [(self.bar.1, outline), (self.bar.0, colour)] {
            self.canvas.fill(Area { top, bottom, ..Area::around((x, 0), width, 0) }, colour);
        }
    }

    fn dashes(&mut self, x: i64, height: i64) {
        let dash = 4 * self.line;
        for i in 0..(height + dash - 1) / dash {
            let (colour, outline) = if i % 2 == 0 { (BLACK, WHITE) } else { (WHITE, BLACK) };
            self.piece(x, i * dash, (i + 1) * dash, colour, outline);
        }
    }

    fn answer(&mut self, column: &Column) {
        let (x, line, colour) = (self.middle(column.x), self.line, self.colour(column));
        let height = self.rows() * self.scale;
        let mut centre = (x, height / 2);
        let mut radius = 7 * line;
        match self.spot(column.answer) {
            Spot::Inside(answer) => {
                let area = self.window(column.x, answer.round_ties_even() as u32);
                centre.1 = ((answer + 0.5) * self.scale as f64).floor() as i64;
                if let Some(area) = area {
                    let (width, height) = (area.right - area.left, area.bottom - area.top);
                    // no corner is further from the centre than that
                    radius =
                        radius.max((width * width + height * height).isqrt() / 2 + self.scale + 2 * line);
                    self.canvas.frame(area.grown(1), 1 + line, BLACK);
                    self.canvas.frame(area, (line + 1) / 2, colour);
                }
            }
            Spot::Above => {
                centre.1 = 3 * line;
                self.canvas.arrow((x, -2 * line), 11 * line, -1, BLACK);
                self.canvas.arrow((x, 0), 8 * line, -1, colour);
            }
            Spot::Below => {
                centre.1 = height - 1 - 3 * line;
                self.canvas.arrow((x, height - 1 + 2 * line), 11 * line, 1, BLACK);
                self.canvas.arrow((x, height - 1), 8 * line, 1, colour);
            }
            Spot::Nowhere => {
                self.canvas.ring(centre, 0, 7 * line, BLACK);
                let (width, rows) = (i64::from(font::WIDTH), i64::from(font::HEIGHT - 2));
                let corner = (x - width * line / 2, centre.1 - rows * line / 2);
                self.canvas.text(corner, line, "?", colour);
            }
        }
        if !column.is_correct(self.style.tolerance) {
            let outer = radius + self.bold - 1;
            self.canvas.ring(centre, radius - 1, outer + 1, BLACK);
            self.canvas.ring(centre, radius, outer, colour);
        }
    }

    /// The window centred on a column and row, moved so that it lies inside the image, as a program's windows
    /// do.
    fn window(&self, x: u32, y: u32) -> Option<Area> {
        let rect = self.style.window?;
        let inside = |at: u32, before: u32, size: u32, pixels: i64| {
            (i64::from(at) - i64::from(before)).min(pixels - i64::from(size)).max(0) * self.scale
        };
        let columns = i64::from(self.canvas.0.width()) / self.scale;
        let left = inside(x, rect.left(), rect.width(), columns);
        let top = inside(y, rect.top(), rect.height(), self.rows());
        let (right, bottom) =
            (left + i64::from(rect.width()) * self.scale, top + i64::from(rect.height()) * self.scale);
        Some(Area { left, top, right, bottom })
    }

    fn cross(&mut self, column: &Column) {
        let centre = (self.middle(column.x), self.middle(column.label));
        let (line, long) = (self.bold, 2 * self.arm + self.bold);
        let arms = [Area::around(centre, long, line), Area::around(centre, line, long)];
        for arm in arms {
            self.canvas.fill(arm.grown((line + 1) / 2), BLACK);
        }
        for arm in arms {
            self.canvas.fill(arm, self.colour(column));
        }
    }
}
