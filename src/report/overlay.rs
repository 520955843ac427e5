//! A detector's answers drawn over the frames of a camera, where nobody knows the right ones.

use image::{GrayImage, RgbImage};

use super::canvas::{Area, BLACK, Canvas, Colour, WHITE};
use super::font;
use super::picture::{Column, MAX_SCALE, Pen, RIGHT, Spot, Style, WRONG};

/// What is drawn into a column of a frame.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Mark {
    /// The column, 0 to width - 1.
    pub x: u32,
    /// The detector's answer; any value.
    pub answer: f32,
    /// Whether there is no obstacle as far as the camera sees.
    pub free: bool,
    /// A few characters beside the answer, as its distance; may be empty.
    pub note: String,
}

/// Draws frame after frame, in the same memory.
///
/// The bars are those of [`super::draw`]: white over what the detector takes for ground, black over what it takes for
/// an obstacle. At the answer stands a dash, orange where an obstacle begins and green where there is none in view; an
/// arrow head of the same colour at the border stands for an answer outside the image, and a question mark in the
/// middle of the column for one that is not a number. The note stands above the dash, or below it at the upper
/// border, and is left out where the columns are too close together for it.
///
/// ```
/// use image::{GrayImage, Luma, Rgb};
/// use vsonar::report::{Mark, Overlay};
///
/// let frame = GrayImage::from_pixel(64, 48, Luma([90]));
/// let mut overlay = Overlay::new(2);
/// let mark = Mark { x: 32, answer: 20.0, free: false, note: "1.4".to_string() };
/// let picture = overlay.draw(&frame, &[mark]);
/// assert_eq!(picture.dimensions(), (128, 96));
/// assert_eq!(*picture.get_pixel(65, 90), Rgb([255, 255, 255])); // ground
/// assert_eq!(*picture.get_pixel(65, 41), Rgb([255, 150, 0])); // an obstacle begins
/// ```
#[derive(Debug, Clone)]
pub struct Overlay {
    style: Style,
    picture: RgbImage,
    columns: Vec<Column>,
}

impl Overlay {
    /// Pictures of `scale` pixels for a pixel of a frame, each way: 1 to [`MAX_SCALE`], and taken into this range.
    pub fn new(scale: u32) -> Overlay {
        let style = Style { scale: scale.clamp(1, MAX_SCALE), ..Style::default() };
        Overlay { style, picture: RgbImage::default(), columns: Vec::new() }
    }

    /// Draws a frame with its marks.
    pub fn draw(&mut self, frame: &GrayImage, marks: &[Mark]) -> &RgbImage {
        let mut picture = std::mem::take(&mut self.picture);
        enlarge(frame, self.style.scale, &mut picture);
        self.columns.clear();
        self.columns.extend(marks.iter().map(|mark| Column { x: mark.x, label: 0, answer: mark.answer }));
        let mut pen = Pen::new(Canvas(picture), &self.columns, &self.style, i64::from(self.style.scale));
        // in layers, so that no bar hides a neighbouring column's mark
        self.columns.iter().for_each(|column| pen.bar(column));
        marks.iter().for_each(|mark| draw_mark(&mut pen, mark));
        let size = note_size(&pen, marks);
        marks.iter().for_each(|mark| draw_note(&mut pen, mark, size));
        self.picture = pen.canvas.0;
        &self.picture
    }
}

/// Writes a frame into a picture, each pixel as a square of `scale` x `scale`.
fn enlarge(frame: &GrayImage, scale: u32, picture: &mut RgbImage) {
    let (width, height) = (frame.width() * scale, frame.height() * scale);
    if picture.dimensions() != (width, height) {
        *picture = RgbImage::new(width, height);
    }
    let line = 3 * width as usize;
    if line == 0 {
        return;
    }
    let rows = frame.chunks_exact(frame.width() as usize);
    for (row, lines) in rows.zip(picture.chunks_exact_mut(line * scale as usize)) {
        let (first, others) = lines.split_at_mut(line);
        for (&value, square) in row.iter().zip(first.chunks_exact_mut(3 * scale as usize)) {
            square.fill(value);
        }
        others.chunks_exact_mut(line).for_each(|other| other.copy_from_slice(first));
    }
}

fn colour(mark: &Mark) -> Colour {
    if mark.free { RIGHT } else { WRONG }
}

/// The row of the picture in the middle of the answer, taken into the picture.
fn height_of(pen: &Pen, mark: &Mark) -> i64 {
    let height = pen.rows() * pen.scale;
    match pen.spot(mark.answer) {
        Spot::Inside(answer) => ((answer + 0.5) * pen.scale as f64).floor() as i64,
        Spot::Above => 0,
        Spot::Below => height - 1,
        Spot::Nowhere => height / 2,
    }
}

fn draw_mark(pen: &mut Pen, mark: &Mark) {
    let (x, y, line, colour) = (pen.middle(mark.x), height_of(pen, mark), pen.line, colour(mark));
    match pen.spot(mark.answer) {
        Spot::Inside(_) => {
            let dash = Area::around((x, y), 2 * pen.bar.1 + 1, 2 * line);
            pen.canvas.fill(dash.grown(line), BLACK);
            pen.canvas.fill(dash, colour);
        }
        Spot::Above => {
            pen.canvas.arrow((x, -2 * line), 11 * line, -1, BLACK);
            pen.canvas.arrow((x, 0), 8 * line, -1, colour);
        }
        Spot::Below => {
            pen.canvas.arrow((x, y + 2 * line), 11 * line, 1, BLACK);
            pen.canvas.arrow((x, y), 8 * line, 1, colour);
        }
        Spot::Nowhere => {
            pen.canvas.ring((x, y), 0, 7 * line, BLACK);
            let (width, rows) = (i64::from(font::WIDTH), i64::from(font::HEIGHT - 2));
            pen.canvas.text((x - width * line / 2, y - rows * line / 2), line, "?", colour);
        }
    }
}

/// Pixels of the picture for a pixel of the font, so that no note reaches into the next column's; 0 if none fits.
fn note_size(pen: &Pen, marks: &[Mark]) -> i64 {
    let longest = marks.iter().map(|mark| mark.note.chars().count()).max().unwrap_or(0);
    let width = i64::from(font::width(longest)) + 2;
    let gap = pen.gap.unwrap_or(i64::from(pen.canvas.0.width()));
    (gap / width.max(1)).min(2 * pen.line)
}

fn draw_note(pen: &mut Pen, mark: &Mark, size: i64) {
    if mark.note.is_empty() || size == 0 {
        return;
    }
    let (x, y, line) = (pen.middle(mark.x), height_of(pen, mark), pen.line);
    // letters that reach below the base line do not matter
    let width = i64::from(font::width(mark.note.chars().count())) * size;
    let height = i64::from(font::HEIGHT - 2) * size;
    let reach = match pen.spot(mark.answer) {
        Spot::Inside(_) => 2 * line,
        Spot::Above | Spot::Below => 11 * line,
        Spot::Nowhere => 8 * line,
    };
    let above = y - reach - height - 2 * size;
    let top = if above >= size { above } else { y + reach + 2 * size };
    // a note of a column at the border moves inwards
    let most = i64::from(pen.canvas.0.width()) - width - size;
    let left = (x - width / 2).min(most).max(size);
    let area = Area { left, top, right: left + width, bottom: top + height };
    pen.canvas.fill(area.grown(size), BLACK);
    pen.canvas.text((left, top), size, &mark.note, WHITE);
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::{Luma, Rgb};

    const GRAY: Rgb<u8> = Rgb([99, 99, 99]);

    fn mark(x: u32, answer: f32) -> Mark {
        Mark { x, answer, free: answer < 0.5, note: String::new() }
    }

    fn drawn(marks: &[Mark]) -> RgbImage {
        Overlay::new(1).draw(&GrayImage::from_pixel(320, 240, Luma([99])), marks).clone()
    }

    fn count(picture: &RgbImage, colour: Rgb<u8>, rows: std::ops::Range<u32>) -> usize {
        picture.enumerate_pixels().filter(|(_, y, p)| rows.contains(y) && **p == colour).count()
    }

    #[test]
    fn frames_are_enlarged_in_squares() {
        let frame = GrayImage::from_fn(17, 16, |x, y| Luma([(x * 16 + y) as u8]));
        let mut overlay = Overlay::new(3);
        for _ in 0..2 {
            let picture = overlay.draw(&frame, &[]);
            assert_eq!(picture.dimensions(), (51, 48));
            for (x, y, pixel) in picture.enumerate_pixels() {
                assert_eq!(pixel.0, [frame.get_pixel(x / 3, y / 3).0[0]; 3]);
            }
        }
        assert_eq!(overlay.draw(&GrayImage::new(20, 16), &[]).dimensions(), (60, 48), "another size");
        assert_eq!(Overlay::new(0).draw(&frame, &[]).dimensions(), (17, 16));
    }

    #[test]
    fn bars_are_those_of_pictures_and_marks_have_their_colours() {
        let picture = drawn(&[mark(160, 100.0)]);
        assert_eq!((*picture.get_pixel(160, 20), *picture.get_pixel(160, 220)), (BLACK, WHITE));
        assert_eq!((*picture.get_pixel(157, 20), *picture.get_pixel(158, 20)), (GRAY, WHITE));
        assert!(count(&picture, WRONG, 98..103) >= 20 && count(&picture, RIGHT, 0..240) == 0);
        assert_eq!(count(&picture, WRONG, 0..98) + count(&picture, WRONG, 103..240), 0);
        let free = drawn(&[mark(160, f32::NEG_INFINITY)]);
        assert!(count(&free, RIGHT, 0..12) > 10 && count(&free, WRONG, 0..240) == 0);
        assert_eq!(*free.get_pixel(160, 100), WHITE);
        let low = drawn(&[mark(160, 1e30)]);
        assert!(count(&low, WRONG, 228..240) > 10 && *low.get_pixel(160, 100) == BLACK);
        let nothing = drawn(&[mark(160, f32::NAN)]);
        assert!(count(&nothing, WRONG, 110..130) > 5 && count(&nothing, WRONG, 0..110) == 0);
    }

    #[test]
    fn notes_stand_above_or_below_and_never_in_the_next_column() {
        let note = |x, answer: f32| Mark { note: "8.88".into(), ..mark(x, answer) };
        let plain = drawn(&[mark(160, 120.0)]);
        let changed = |noted: &RgbImage, plain: &RgbImage| -> Vec<(u32, u32)> {
            let differ = noted.enumerate_pixels().filter(|(x, y, p)| plain.get_pixel(*x, *y) != *p);
            differ.map(|(x, y, _)| (x, y)).collect()
        };
        let pixels = changed(&drawn(&[note(160, 120.0)]), &plain);
        assert!(!pixels.is_empty() && pixels.iter().all(|&(x, y)| y < 120 && y > 90 && x.abs_diff(160) < 30));
        let pixels = changed(&drawn(&[note(160, 2.0)]), &drawn(&[mark(160, 2.0)]));
        assert!(!pixels.is_empty() && pixels.iter().all(|&(_, y)| (3..30).contains(&y)));
        // At a border it is there as a whole.
        let pixels = changed(&drawn(&[note(319, 120.0)]), &drawn(&[mark(319, 120.0)]));
        assert!(pixels.len() > 100);
        // Too close together for it, smaller, and as large as it gets.
        let area = |gap: u32| {
            let (one, other) =
                ([100, 100 + gap].map(|x| note(x, 120.0)), [100, 100 + gap].map(|x| mark(x, 120.0)));
            changed(&drawn(&one), &drawn(&other)).len()
        };
        assert_eq!(area(10), 0);
        assert!(area(30) > 100 && area(60) > 2 * area(30) && area(150) == area(60));
    }

    #[test]
    fn nothing_outside_the_picture_is_touched() {
        for answer in [0.0, 15.0, -1.0, 16.0, f32::NAN, f32::INFINITY] {
            let marks = [0, 15, 400].map(|x| Mark { note: "0.12".into(), ..mark(x, answer) });
            Overlay::new(16).draw(&GrayImage::new(16, 16), &marks);
        }
    }
}
