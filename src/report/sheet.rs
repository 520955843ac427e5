//! Many pictures on one sheet, each with a caption.

use std::borrow::Cow;

use image::imageops::{overlay, thumbnail};
use image::{Rgb, RgbImage};

use super::canvas::{Area, Canvas, Colour, WHITE};
use super::picture::{RIGHT, WRONG};
use super::{font, palette, several};

/// What the marks of a picture mean, in a sentence for a sheet's heading.
pub const LEGEND: &str = "White bar: taken for ground. Black bar: taken for an obstacle. Cross: ideal answer. \
     Square: the answer. Ring: the answer is wrong. Arrow head: it is outside the image. ?: it is not a number.";

/// The longest side of a tile in pixels; larger pictures are reduced to it.
const SIDE: u32 = 320;

/// The longest side of a tile that is reduced for a smaller file, at least.
const LEAST_SIDE: u32 = 80;

/// Between tiles, and around all of them, in pixels.
const MARGIN: u32 = 14;

/// The narrowest place for a tile and its caption, in pixels.
const NARROWEST: u32 = 120;

/// Pixels for a pixel of the font.
const TEXT_SCALE: u32 = 2;

/// Between a picture and its caption, and between lines of text, in pixels of the font.
const LEADING: u32 = 3;

pub(super) const PAPER: Colour = Rgb([36, 36, 40]);

/// A picture on a contact sheet, with what its caption says.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Tile {
    picture: RgbImage,
    name: String,
    scores: Vec<Score>,
}

/// A text below a tile.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Score {
    text: String,
    colour: Colour,
    underlined: bool,
}

impl Tile {
    /// A tile of a picture, reduced to at most 320 pixels each way with its proportions kept, and the share of
    /// its answers that is correct.
    pub fn new(picture: &RgbImage, name: impl Into<String>, correct: usize, total: usize) -> Tile {
        // Not by colour alone.
        let (colour, underlined) = if correct == total { (RIGHT, false) } else { (WRONG, true) };
        Tile::with(
            picture,
            name.into(),
            vec![Score { text: format!("{correct}/{total}"), colour, underlined }],
        )
    }

    /// The same of several detectors, of each of which so many answers are correct.
    pub fn of_several(picture: &RgbImage, name: impl Into<String>, correct: &[usize], total: usize) -> Tile {
        let score = |(i, &correct): (usize, &usize)| Score {
            text: correct.to_string(),
            colour: several::colour(i),
            underlined: correct < total,
        };
        let mut scores: Vec<Score> = correct.iter().enumerate().map(score).collect();
        scores.push(Score { text: format!("of {total}"), colour: WHITE, underlined: false });
        Tile::with(picture, name.into(), scores)
    }

    fn with(picture: &RgbImage, name: String, scores: Vec<Score>) -> Tile {
        Tile { picture: reduced(picture, SIDE).into_owned(), name, scores }
    }
}

/// The picture with no side longer than this, its proportions kept.
fn reduced(picture: &RgbImage, most: u32) -> Cow<'_, RgbImage> {
    let (width, height) = picture.dimensions();
    let longest = width.max(height);
    if longest <= most {
        return Cow::Borrowed(picture);
    }
    let part = |side: u32| {
        let scaled = (u64::from(side) * u64::from(most) + u64::from(longest) / 2) / u64::from(longest);
        // at most `most`, since no side is longer than the longest
        (scaled as u32).max(1)
    };
    Cow::Owned(thumbnail(picture, part(width), part(height)))
}

/// The tiles in rows of `columns` (at least one), in their order, below a heading; each has its name and
/// `correct/total` below it. A name too long for its place loses its middle, and a character that is not
/// printable ASCII is drawn as a box.
pub fn contact_sheet(tiles: &[Tile], columns: usize, heading: &str) -> RgbImage {
    drawn(tiles, columns, heading, &[], SIDE)
}

/// The sheet as a PNG file of at most so many bytes: grays and colours are a few for it, and tiles become smaller as far as
/// it takes (a sheet of very many tiles may be larger all the same). Of several detectors there is a line in `keys` for
/// each, drawn below the heading: its letter in its colour, and this text.
///
/// # Errors
/// If the picture cannot be encoded.
pub fn contact_sheet_png(
    tiles: &[Tile],
    columns: usize,
    heading: &str,
    keys: &[String],
    most: usize,
) -> Result<Vec<u8>, png::EncodingError> {
    let longest = |tile: &Tile| tile.picture.width().max(tile.picture.height());
    let mut side = tiles.iter().map(longest).max().unwrap_or(SIDE).clamp(LEAST_SIDE, SIDE);
    loop {
        let file = palette::png(&drawn(tiles, columns, heading, keys, side))?;
        if file.len() <= most || side == LEAST_SIDE {
            return Ok(file);
        }
        // Bytes go with the area; a little less, as small pictures have more edges for their size.
        let fits = f64::from(side) * (0.95 * most as f64 / file.len() as f64).sqrt();
        side = (fits as u32).clamp(LEAST_SIDE, side - 1);
    }
}

/// The sheet with tiles of this side at most.
fn drawn(tiles: &[Tile], columns: usize, heading: &str, keys: &[String], side: u32) -> RgbImage {
    let columns = columns.clamp(1, tiles.len().max(1));
    let pictures: Vec<Cow<'_, RgbImage>> = tiles.iter().map(|tile| reduced(&tile.picture, side)).collect();
    let widest = pictures.iter().map(|picture| picture.width()).max().unwrap_or(0);
    let highest = pictures.iter().map(|picture| picture.height()).max().unwrap_or(0);
    let cell = widest.max(NARROWEST);
    let text = Text { scale: TEXT_SCALE, width: cell };
    let columns_u32 = columns as u32;
    let inner = columns_u32 * (cell + MARGIN) - MARGIN;
    let lines = wrap(heading, Text { width: inner, ..text }.fitting());
    let rows = (lines.len() + keys.len()) as u32;
    let heading_height = rows * text.line() + if rows == 0 { 0 } else { MARGIN };
    let row = highest + text.line() + MARGIN;
    let height = MARGIN + heading_height + tiles.len().div_ceil(columns) as u32 * row;
    let mut sheet = Canvas(RgbImage::from_pixel(inner + 2 * MARGIN, height, PAPER));
    for (i, line) in lines.iter().enumerate() {
        text.write(&mut sheet, MARGIN, MARGIN + i as u32 * text.line(), line, WHITE);
    }
    for (i, key) in keys.iter().enumerate() {
        let top = MARGIN + (lines.len() + i) as u32 * text.line();
        several::key(&mut sheet, (i64::from(MARGIN), i64::from(top)), text.scale, i, key, inner);
    }
    for (i, tile) in tiles.iter().enumerate() {
        let left = MARGIN + (i % columns) as u32 * (cell + MARGIN);
        let top = MARGIN + heading_height + (i / columns) as u32 * row;
        overlay(&mut sheet.0, &*pictures[i], i64::from(left), i64::from(top));
        let letters = tile.scores.iter().map(|score| score.text.chars().count() + 1).sum::<usize>();
        let place = text.fitting().saturating_sub(letters);
        let below = top + highest + LEADING * text.scale;
        text.write(&mut sheet, left, below, &shorten(&tile.name, place), WHITE);
        let mut end = left + cell;
        for score in tile.scores.iter().rev() {
            let width = font::width(score.text.chars().count()) * text.scale;
            let start = end.saturating_sub(width).max(left);
            text.write(&mut sheet, start, below, &score.text, score.colour);
            if score.underlined {
                let y = i64::from(below + (font::HEIGHT - 1) * text.scale);
                let line = Area {
                    left: i64::from(end) - i64::from(width),
                    top: y,
                    right: i64::from(end),
                    bottom: y + i64::from(text.scale),
                };
                sheet.fill(line, score.colour);
            }
            end = start.saturating_sub(font::ADVANCE * text.scale);
        }
    }
    sheet.0
}

/// Text of one size in a place of one width.
#[derive(Clone, Copy)]
struct Text {
    scale: u32,
    width: u32,
}

impl Text {
    /// From one line to the next, in pixels.
    fn line(self) -> u32 {
        (font::HEIGHT + LEADING) * self.scale
    }

    fn fitting(self) -> usize {
        font::fitting(self.width / self.scale)
    }

    fn write(self, sheet: &mut Canvas, x: u32, y: u32, text: &str, colour: Colour) {
        sheet.text((i64::from(x), i64::from(y)), i64::from(self.scale), text, colour);
    }
}

/// A name of at most `most` characters: what is too long loses its middle, for names of frames differ at the
/// end and belong together at the beginning.
pub(super) fn shorten(name: &str, most: usize) -> String {
    let characters: Vec<char> = name.chars().collect();
    if characters.len() <= most {
        return name.into();
    }
    let kept = most.saturating_sub(2);
    let (head, tail) = (kept / 2, kept - kept / 2);
    let dots = "..".chars().take(most);
    characters[..head]
        .iter()
        .copied()
        .chain(dots)
        .chain(characters[characters.len() - tail..].iter().copied())
        .collect()
}

/// The text in lines of at most `most` characters (at least one), broken at spaces, or in a word that is
/// longer than a line.
fn wrap(text: &str, most: usize) -> Vec<String> {
    let most = most.max(1);
    let mut lines: Vec<String> = Vec::new();
    let mut length = 0;
    for word in text.split_whitespace() {
        let characters: Vec<char> = word.chars().collect();
        for (i, piece) in characters.chunks(most).enumerate() {
            match lines.last_mut() {
                Some(line) if i == 0 && length + 1 + piece.len() <= most => {
                    line.push(' ');
                    line.extend(piece);
                    length += 1 + piece.len();
                }
                _ => {
                    lines.push(piece.iter().collect());
                    length = piece.len();
                }
            }
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_lose_their_middle() {
        assert_eq!(shorten("frame.png", 9), "frame.png");
        assert_eq!(shorten("corridor_A_046.png", 10), "corr...png");
        assert_eq!(shorten("corridor_A_046.png", 15), "corrid..046.png");
        assert_eq!(
            ["x.png"; 5].iter().enumerate().map(|(i, n)| shorten(n, i)).collect::<Vec<_>>(),
            ["", ".", "..", "..g", "x..g"]
        );
        assert_eq!(shorten("日本語の名前", 4), "日..前");
    }

    #[test]
    fn headings_are_wrapped() {
        assert_eq!(wrap("one two  three", 7), ["one two", "three"]);
        assert_eq!(wrap("abcdefgh i j", 3), ["abc", "def", "gh", "i j"]);
        assert!(wrap(" ", 3).is_empty());
        assert_eq!(wrap("ab", 0), ["a", "b"]);
    }
}
