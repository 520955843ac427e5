//! The answers of several detectors in one picture, side by side in every column.

use image::{GrayImage, Rgb, RgbImage, imageops};

use super::canvas::{Area, BLACK, Canvas, Colour, WHITE};
use super::font;
use super::picture::{Column, MAX_SCALE, Pen, Spot, Style};
use super::sheet::{PAPER, shorten};

/// What the marks mean, in a sentence for a sheet's heading.
pub const LEGEND_SEVERAL: &str = "A bar for each detector: wide over what it takes for ground, thin over what it takes for \
     an obstacle. Cross: ideal answer. Ring: the answer is wrong. Arrow head: it is outside the image. ?: it is not a \
     number.";

/// Colours that are told apart by every kind of colour vision (M. Okabe and K. Ito, *Color Universal Design*), lightened to
/// stand out from gray.
pub(super) const COLOURS: [Colour; 6] = [
    Rgb([90, 190, 255]),
    Rgb([255, 160, 30]),
    Rgb([60, 215, 160]),
    Rgb([245, 235, 90]),
    Rgb([240, 150, 200]),
    Rgb([125, 125, 255]),
];

/// How many detectors fit into a picture.
pub const MOST_DETECTORS: usize = COLOURS.len();

/// The colour of a detector, by its place among several.
pub(super) fn colour(detector: usize) -> Colour {
    COLOURS[detector % COLOURS.len()]
}

/// The letter of a detector, by its place among several.
///
/// ```
/// assert_eq!(vsonar::report::letter(1), 'B');
/// ```
pub fn letter(detector: usize) -> char {
    char::from(b'A' + (detector % 26) as u8)
}

/// Draws the answers of several detectors into an image: `answers` has, for each of them, the same columns in the same
/// order. The window of the style is not drawn.
///
/// In each column there is a **bar** for every detector, from left to right in their order, with its letter at the foot: in
/// the detector's colour over what it takes for ground; over what it takes for an obstacle only a thin black line with an
/// outline of that colour. A white **cross** stands at the ideal answer. A **ring** surrounds an answer that is wrong. Answers outside the
/// image and those that are no number are shown as by [`super::draw`].
///
/// ```
/// use image::{GrayImage, Luma};
/// use vsonar::report::{Column, Style, draw_several};
///
/// let image = GrayImage::from_pixel(64, 48, Luma([90]));
/// let column = |answer| vec![Column { x: 32, label: 20, answer }];
/// let picture = draw_several(&image, &[column(20.0), column(40.0)], &Style { scale: 4, ..Style::default() });
/// assert_eq!(picture.dimensions(), (256, 192));
/// ```
pub fn draw_several(image: &GrayImage, answers: &[Vec<Column>], style: &Style) -> RgbImage {
    let scale = style.scale.clamp(1, MAX_SCALE);
    let picture = RgbImage::from_fn(image.width() * scale, image.height() * scale, |x, y| {
        let [v] = image.get_pixel(x / scale, y / scale).0;
        Rgb([v, v, v])
    });
    let style = Style { window: None, scale, ..*style };
    let columns: &[Column] = answers.first().map_or(&[], Vec::as_slice);
    let mut pen = Pen::new(Canvas(picture), columns, &style, i64::from(scale));
    let count = answers.len().max(1) as i64;
    // At least a third of the image between the columns stays visible.
    let step = pen.gap.map_or(7 * pen.line, |gap| (gap * 2 / 3 / count).min(7 * pen.line)).max(1);
    let outer = (step - pen.line / 2).max(1);
    let outline = if outer >= 5 { (pen.line / 2).max(1) } else { i64::from(outer >= 3) };
    pen.bar = (outer - 2 * outline, outer);
    let bars = Bars { step, count };
    for (i, columns) in answers.iter().enumerate() {
        columns.iter().for_each(|column| bars.bar(&mut pen, i, column));
    }
    // Crosses reach out from below the marks of answers at the same place.
    columns.iter().for_each(|column| bars.cross(&mut pen, column));
    for (i, columns) in answers.iter().enumerate() {
        columns.iter().for_each(|column| bars.answer(&mut pen, i, column, style.tolerance));
    }
    pen.canvas.0
}

/// Where the bars of a column are.
struct Bars {
    /// From one to the next, in pixels of the picture.
    step: i64,
    count: i64,
}

impl Bars {
    /// The middle of a detector's bar.
    fn middle(&self, pen: &Pen, detector: usize, column: &Column) -> i64 {
        pen.middle(column.x) - (self.count - 1) * self.step / 2 + detector as i64 * self.step
    }

    fn bar(&self, pen: &mut Pen, detector: usize, column: &Column) {
        let (x, colour) = (self.middle(pen, detector, column), colour(detector));
        let height = pen.rows() * pen.scale;
        let split = match pen.spot(column.answer) {
            Spot::Inside(answer) => (answer.floor() as i64 + 1) * pen.scale,
            Spot::Above => 0,
            Spot::Below => height,
            Spot::Nowhere => {
                let dash = 4 * pen.line;
                for i in 0..(height + dash - 1) / dash {
                    let (fill, outline) = if i % 2 == 0 { (BLACK, colour) } else { (colour, BLACK) };
                    pen.piece(x, i * dash, (i + 1) * dash, fill, outline);
                }
                return;
            }
        };
        // A thin stem, so that the obstacle itself is seen.
        let whole = pen.bar;
        let stem = whole.0.min(pen.line);
        pen.bar = (stem, (stem + 2 * (pen.line / 2).max(1)).min(whole.1));
        pen.piece(x, 0, split, BLACK, colour);
        pen.bar = whole;
        pen.piece(x, split, height, colour, BLACK);
    }

    fn cross(&self, pen: &mut Pen, column: &Column) {
        let centre = (pen.middle(column.x), pen.middle(column.label));
        // As wide as the bars and a little more, so that it is seen beside them.
        let wide = self.count * self.step + 6 * pen.line;
        let arms = [Area::around(centre, wide, pen.line), Area::around(centre, pen.line, 9 * pen.line)];
        for arm in arms {
            pen.canvas.fill(arm.grown((pen.line + 1) / 2), BLACK);
        }
        for arm in arms {
            pen.canvas.fill(arm, WHITE);
        }
    }

    fn answer(&self, pen: &mut Pen, detector: usize, column: &Column, tolerance: f64) {
        let (x, line, colour) = (self.middle(pen, detector, column), pen.line, colour(detector));
        let height = pen.rows() * pen.scale;
        let size = 4 * line;
        let y = match pen.spot(column.answer) {
            Spot::Inside(answer) => {
                let y = ((answer + 0.5) * pen.scale as f64).floor() as i64;
                let dash = Area::around((x, y), pen.bar.1 + 2, line + 1);
                pen.canvas.fill(dash.grown(1), BLACK);
                pen.canvas.fill(dash, colour);
                y
            }
            Spot::Above => {
                pen.canvas.arrow((x, -2 * line), size + 3 * line, -1, BLACK);
                pen.canvas.arrow((x, 0), size, -1, colour);
                2 * line
            }
            Spot::Below => {
                pen.canvas.arrow((x, height - 1 + 2 * line), size + 3 * line, 1, BLACK);
                pen.canvas.arrow((x, height - 1), size, 1, colour);
                height - 1 - 2 * line
            }
            Spot::Nowhere => {
                pen.canvas.ring((x, height / 2), 0, size, BLACK);
                let (width, rows) = (i64::from(font::WIDTH), i64::from(font::HEIGHT - 2));
                pen.canvas.text((x - width / 2, height / 2 - rows / 2), 1, "?", colour);
                height / 2
            }
        };
        if !column.is_correct(tolerance) {
            let radius = (pen.bar.1 / 2 + line).max(4 * line);
            pen.canvas.ring((x, y), radius - 1, radius + line, BLACK);
            pen.canvas.ring((x, y), radius, radius + line - 1, colour);
        }
        self.letter(pen, x, detector);
    }

    /// The detector's letter at the foot of its bar, if it is wide enough.
    fn letter(&self, pen: &mut Pen, x: i64, detector: usize) {
        let size = pen.bar.1 / (i64::from(font::WIDTH) + 1);
        if size == 0 {
            return;
        }
        let (width, rows) = (i64::from(font::WIDTH) * size, i64::from(font::HEIGHT - 2) * size);
        let top = pen.rows() * pen.scale - rows - 2 * size;
        let plate = Area {
            left: x - width / 2 - size,
            top: top - size,
            right: x - width / 2 + width + size,
            bottom: top + rows + size,
        };
        pen.canvas.fill(plate, colour(detector));
        pen.canvas.text((x - width / 2, top), size, &letter(detector).to_string(), BLACK);
    }
}

/// The picture above a line for each detector, with its letter in its colour: what it is called, and how it does. Sides are
/// made even, as videos want them.
pub fn with_lines(picture: &RgbImage, lines: &[String]) -> RgbImage {
    let even = |side: u32| side + side % 2;
    let (width, height) = picture.dimensions();
    let size = if width >= 480 { 2 } else { 1 };
    let (margin, line) = (3 * size, (font::HEIGHT + 3) * size);
    let below = even(lines.len() as u32 * line + 2 * margin + height) - height;
    let mut canvas = Canvas(RgbImage::from_pixel(even(width), height + below, PAPER));
    imageops::replace(&mut canvas.0, picture, 0, 0);
    for (i, text) in lines.iter().enumerate() {
        let (x, y) = (i64::from(margin), i64::from(height + margin + i as u32 * line));
        key(&mut canvas, (x, y), size, i, text, width.saturating_sub(2 * margin));
    }
    canvas.0
}

/// A detector's letter on its colour, and a text beside it that is cut to a width.
pub(super) fn key(
    canvas: &mut Canvas,
    (x, y): (i64, i64),
    size: u32,
    detector: usize,
    text: &str,
    width: u32,
) {
    let scale = i64::from(size);
    let side = i64::from(font::WIDTH + 2) * scale;
    let plate = Area { left: x, top: y, right: x + side, bottom: y + i64::from(font::HEIGHT) * scale };
    canvas.fill(plate, colour(detector));
    canvas.text((x + scale, y + scale), scale, &letter(detector).to_string(), BLACK);
    let room = font::fitting(width.saturating_sub((font::WIDTH + 5) * size) / size);
    canvas.text((x + side + 3 * scale, y + scale), scale, &shorten(text, room), WHITE);
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::Luma;

    fn drawn(answers: &[f32]) -> RgbImage {
        let image = GrayImage::from_pixel(320, 240, Luma([99]));
        let one = |&answer: &f32| [80, 240].map(|x| Column { x, label: 100, answer }).to_vec();
        draw_several(
            &image,
            &answers.iter().map(one).collect::<Vec<_>>(),
            &Style { scale: 2, ..Style::default() },
        )
    }

    fn count(picture: &RgbImage, wanted: Colour, rows: std::ops::Range<u32>) -> usize {
        picture.enumerate_pixels().filter(|(_, y, p)| rows.contains(y) && **p == wanted).count()
    }

    #[test]
    fn every_detector_has_its_bar() {
        let picture = drawn(&[100.0, 105.0, 95.0]);
        for i in 0..3 {
            let x = 161 + 14 * i as u32 - 14;
            assert_eq!(*picture.get_pixel(x, 400), colour(i), "ground");
            assert_eq!(*picture.get_pixel(x, 20), BLACK, "obstacle");
            // The bars of one detector, the outline above and the plate of the letter.
            assert!(count(&picture, colour(i), 300..400) >= 2 * 100 * 5);
        }
        assert_eq!(count(&picture, colour(3), 0..480), 0);
        // The cross is seen beside the bars.
        assert!(count(&picture, WHITE, 199..204) > 2 * 6);
    }

    #[test]
    fn wrong_answers_have_rings() {
        let (right, wrong) = (drawn(&[100.0, 100.0]), drawn(&[100.0, 160.0]));
        let aside = |picture: &RgbImage| {
            let near = |x: u32| x.abs_diff(161) > 14 && x.abs_diff(161) < 40;
            picture
                .enumerate_pixels()
                .filter(|(x, y, p)| near(*x) && (300..345).contains(y) && **p == colour(1))
                .count()
        };
        assert_eq!(aside(&right), 0);
        assert!(aside(&wrong) > 0);
    }

    #[test]
    fn answers_outside_and_no_numbers() {
        let picture = drawn(&[-5.0, 1e30, f32::NAN]);
        assert_eq!((*picture.get_pixel(149, 100), *picture.get_pixel(161, 300)), (colour(0), BLACK));
        assert!(count(&picture, colour(2), 0..480) > 1000);
        // Nothing panics at the smallest size, nor with columns side by side or outside.
        let image = GrayImage::new(16, 16);
        for scale in [1, 16] {
            for answer in [0.0, 15.0, f32::NAN, f32::INFINITY, -1.0] {
                let columns: Vec<_> = (0..20).map(|x| Column { x, label: 15, answer }).collect();
                draw_several(&image, &vec![columns; MOST_DETECTORS], &Style { scale, ..Style::default() });
            }
        }
        assert_eq!(draw_several(&image, &[], &Style::default()).dimensions(), (16, 16));
    }

    #[test]
    fn lines_stand_below_the_picture() {
        let picture = RgbImage::from_pixel(641, 479, Rgb([9, 9, 9]));
        let lines = ["one".to_string(), "a name that is far too long ".repeat(9)];
        let keyed = with_lines(&picture, &lines);
        assert!(keyed.width() == 642 && keyed.height().is_multiple_of(2) && keyed.height() > 479 + 2 * 24);
        assert!(count(&keyed, colour(0), 479..510) > 50 && count(&keyed, colour(1), 500..540) > 50);
        assert!(picture.enumerate_pixels().all(|(x, y, p)| keyed.get_pixel(x, y) == p));
        assert!(COLOURS.iter().all(|a| COLOURS.iter().filter(|b| a == *b).count() == 1));
    }
}
