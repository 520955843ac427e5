//! A small font for captions: printable ASCII, 5 pixels wide and 9 high, two of them below the base line.
//!
//! Glyphs are data, a row of the picture a number, its highest bit the leftmost pixel. They were drawn for this
//! project, so that captions need no font file and look the same everywhere. Where a glyph is enlarged, its pixels are
//! joined by round strokes with soft edges, which are easier to read than squares.

/// Width of a glyph in pixels.
pub(crate) const WIDTH: u32 = 5;

/// Height of a glyph in pixels.
pub(crate) const HEIGHT: u32 = 9;

/// From one glyph's left edge to the next one's, in pixels.
pub(crate) const ADVANCE: u32 = WIDTH + 1;

/// First character of the table.
const FIRST: char = ' ';

/// Width of an enlarged glyph's strokes, in pixels of the font.
const STROKE: f32 = 0.95;

/// Stands for every character that is not in the table.
const UNKNOWN: [u8; HEIGHT as usize] =
    [0b11111, 0b10001, 0b10001, 0b10001, 0b10001, 0b10001, 0b11111, 0b00000, 0b00000];

fn rows(character: char) -> &'static [u8; HEIGHT as usize] {
    let index = (character as usize).checked_sub(FIRST as usize);
    index.and_then(|i| GLYPHS.get(i)).unwrap_or(&UNKNOWN)
}

/// The pixels of a character that are set, from top to bottom, as (column, row) from its upper left corner.
fn pixels(character: char) -> impl Iterator<Item = (u32, u32)> {
    let rows = rows(character);
    (0..HEIGHT).flat_map(move |y| {
        (0..WIDTH).filter(move |x| rows[y as usize] >> (WIDTH - 1 - x) & 1 == 1).map(move |x| (x, y))
    })
}

/// A straight stroke from the middle of a pixel to that of a neighbour, or of itself, in pixels of the font.
type Stroke = [(f32, f32); 2];

/// What joins the pixels of a character: those side by side, and those that touch at a corner alone.
fn strokes(character: char) -> Vec<Stroke> {
    let rows = rows(character);
    let is_set = |x: u32, y: u32| x < WIDTH && y < HEIGHT && rows[y as usize] >> (WIDTH - 1 - x) & 1 == 1;
    let middle = |x: u32, y: u32| (x as f32 + 0.5, y as f32 + 0.5);
    let mut strokes = Vec::new();
    for (x, y) in pixels(character) {
        // A dot for those that have no neighbour.
        strokes.push([middle(x, y); 2]);
        let (right, below) = (is_set(x + 1, y), is_set(x, y + 1));
        if right {
            strokes.push([middle(x, y), middle(x + 1, y)]);
        }
        if below {
            strokes.push([middle(x, y), middle(x, y + 1)]);
        }
        if !right && !below && is_set(x + 1, y + 1) {
            strokes.push([middle(x, y), middle(x + 1, y + 1)]);
        }
        if x > 0 && !below && is_set(x - 1, y + 1) && !is_set(x - 1, y) {
            strokes.push([middle(x, y), middle(x - 1, y + 1)]);
        }
    }
    strokes
}

fn distance([(ax, ay), (bx, by)]: Stroke, (x, y): (f32, f32)) -> f32 {
    let (dx, dy) = (bx - ax, by - ay);
    let length = dx * dx + dy * dy;
    let part = if length > 0.0 { (((x - ax) * dx + (y - ay) * dy) / length).clamp(0.0, 1.0) } else { 0.0 };
    let (u, v) = (x - ax - part * dx, y - ay - part * dy);
    (u * u + v * v).sqrt()
}

/// The pixels that a character touches when it is `scale` times as large, as (column, row) from its upper left corner,
/// and how much of each it covers, above 0 and up to 1.
pub(crate) fn coverage(character: char, scale: u32) -> Vec<(u32, u32, f32)> {
    if scale <= 1 {
        return pixels(character).map(|(x, y)| (x, y, 1.0)).collect();
    }
    let strokes = strokes(character);
    let covered = |x: u32, y: u32| {
        let at = ((x as f32 + 0.5) / scale as f32, (y as f32 + 0.5) / scale as f32);
        let nearest = strokes.iter().map(|&stroke| distance(stroke, at)).fold(f32::INFINITY, f32::min);
        ((STROKE / 2.0 - nearest) * scale as f32 + 0.5).clamp(0.0, 1.0)
    };
    let all = (0..HEIGHT * scale).flat_map(|y| (0..WIDTH * scale).map(move |x| (x, y)));
    all.map(|(x, y)| (x, y, covered(x, y))).filter(|(_, _, part)| *part > 0.0).collect()
}

/// Width in pixels of a text of this many characters.
pub(crate) fn width(characters: usize) -> u32 {
    u32::try_from(characters)
        .map_or(u32::MAX, |n| (n.saturating_mul(ADVANCE)).saturating_sub(ADVANCE - WIDTH))
}

/// How many characters fit into a width in pixels.
pub(crate) fn fitting(width: u32) -> usize {
    (width.saturating_add(ADVANCE - WIDTH) / ADVANCE) as usize
}

/// The glyphs from the space to the tilde.
#[rustfmt::skip]
const GLYPHS: [[u8; HEIGHT as usize]; 95] = [
    [0b00000, 0b00000, 0b00000, 0b00000, 0b00000, 0b00000, 0b00000, 0b00000, 0b00000], // space
    [0b00100, 0b00100, 0b00100, 0b00100, 0b00100, 0b00000, 0b00100, 0b00000, 0b00000], // !
    [0b01010, 0b01010, 0b01010, 0b00000, 0b00000, 0b00000, 0b00000, 0b00000, 0b00000], // "
    [0b01010, 0b01010, 0b11111, 0b01010, 0b11111, 0b01010, 0b01010, 0b00000, 0b00000], // #
    [0b00100, 0b01111, 0b10100, 0b01110, 0b00101, 0b11110, 0b00100, 0b00000, 0b00000], // $
    [0b11000, 0b11001, 0b00010, 0b00100, 0b01000, 0b10011, 0b00011, 0b00000, 0b00000], // %
    [0b01100, 0b10010, 0b10100, 0b01000, 0b10101, 0b10010, 0b01101, 0b00000, 0b00000], // &
    [0b00100, 0b00100, 0b00100, 0b00000, 0b00000, 0b00000, 0b00000, 0b00000, 0b00000], // '
    [0b00010, 0b00100, 0b01000, 0b01000, 0b01000, 0b00100, 0b00010, 0b00000, 0b00000], // (
    [0b01000, 0b00100, 0b00010, 0b00010, 0b00010, 0b00100, 0b01000, 0b00000, 0b00000], // )
    [0b00000, 0b00100, 0b10101, 0b01110, 0b10101, 0b00100, 0b00000, 0b00000, 0b00000], // *
    [0b00000, 0b00100, 0b00100, 0b11111, 0b00100, 0b00100, 0b00000, 0b00000, 0b00000], // +
    [0b00000, 0b00000, 0b00000, 0b00000, 0b00000, 0b01100, 0b01100, 0b00100, 0b01000], // ,
    [0b00000, 0b00000, 0b00000, 0b11111, 0b00000, 0b00000, 0b00000, 0b00000, 0b00000], // -
    [0b00000, 0b00000, 0b00000, 0b00000, 0b00000, 0b01100, 0b01100, 0b00000, 0b00000], // .
    [0b00001, 0b00001, 0b00010, 0b00100, 0b01000, 0b10000, 0b10000, 0b00000, 0b00000], // /
    [0b01110, 0b10001, 0b10011, 0b10101, 0b11001, 0b10001, 0b01110, 0b00000, 0b00000], // 0
    [0b00100, 0b01100, 0b00100, 0b00100, 0b00100, 0b00100, 0b01110, 0b00000, 0b00000], // 1
    [0b01110, 0b10001, 0b00001, 0b00010, 0b00100, 0b01000, 0b11111, 0b00000, 0b00000], // 2
    [0b11111, 0b00010, 0b00100, 0b00010, 0b00001, 0b10001, 0b01110, 0b00000, 0b00000], // 3
    [0b00010, 0b00110, 0b01010, 0b10010, 0b11111, 0b00010, 0b00010, 0b00000, 0b00000], // 4
    [0b11111, 0b10000, 0b11110, 0b00001, 0b00001, 0b10001, 0b01110, 0b00000, 0b00000], // 5
    [0b00110, 0b01000, 0b10000, 0b11110, 0b10001, 0b10001, 0b01110, 0b00000, 0b00000], // 6
    [0b11111, 0b00001, 0b00010, 0b00100, 0b01000, 0b01000, 0b01000, 0b00000, 0b00000], // 7
    [0b01110, 0b10001, 0b10001, 0b01110, 0b10001, 0b10001, 0b01110, 0b00000, 0b00000], // 8
    [0b01110, 0b10001, 0b10001, 0b01111, 0b00001, 0b00010, 0b01100, 0b00000, 0b00000], // 9
    [0b00000, 0b01100, 0b01100, 0b00000, 0b01100, 0b01100, 0b00000, 0b00000, 0b00000], // :
    [0b00000, 0b00000, 0b01100, 0b01100, 0b00000, 0b01100, 0b01100, 0b00100, 0b01000], // ;
    [0b00010, 0b00100, 0b01000, 0b10000, 0b01000, 0b00100, 0b00010, 0b00000, 0b00000], // <
    [0b00000, 0b00000, 0b11111, 0b00000, 0b11111, 0b00000, 0b00000, 0b00000, 0b00000], // =
    [0b01000, 0b00100, 0b00010, 0b00001, 0b00010, 0b00100, 0b01000, 0b00000, 0b00000], // >
    [0b01110, 0b10001, 0b00001, 0b00010, 0b00100, 0b00000, 0b00100, 0b00000, 0b00000], // ?
    [0b01110, 0b10001, 0b10111, 0b10101, 0b10111, 0b10000, 0b01110, 0b00000, 0b00000], // @
    [0b01110, 0b10001, 0b10001, 0b11111, 0b10001, 0b10001, 0b10001, 0b00000, 0b00000], // A
    [0b11110, 0b10001, 0b10001, 0b11110, 0b10001, 0b10001, 0b11110, 0b00000, 0b00000], // B
    [0b01110, 0b10001, 0b10000, 0b10000, 0b10000, 0b10001, 0b01110, 0b00000, 0b00000], // C
    [0b11100, 0b10010, 0b10001, 0b10001, 0b10001, 0b10010, 0b11100, 0b00000, 0b00000], // D
    [0b11111, 0b10000, 0b10000, 0b11110, 0b10000, 0b10000, 0b11111, 0b00000, 0b00000], // E
    [0b11111, 0b10000, 0b10000, 0b11110, 0b10000, 0b10000, 0b10000, 0b00000, 0b00000], // F
    [0b01110, 0b10001, 0b10000, 0b10111, 0b10001, 0b10001, 0b01111, 0b00000, 0b00000], // G
    [0b10001, 0b10001, 0b10001, 0b11111, 0b10001, 0b10001, 0b10001, 0b00000, 0b00000], // H
    [0b01110, 0b00100, 0b00100, 0b00100, 0b00100, 0b00100, 0b01110, 0b00000, 0b00000], // I
    [0b00111, 0b00010, 0b00010, 0b00010, 0b00010, 0b10010, 0b01100, 0b00000, 0b00000], // J
    [0b10001, 0b10010, 0b10100, 0b11000, 0b10100, 0b10010, 0b10001, 0b00000, 0b00000], // K
    [0b10000, 0b10000, 0b10000, 0b10000, 0b10000, 0b10000, 0b11111, 0b00000, 0b00000], // L
    [0b10001, 0b11011, 0b10101, 0b10101, 0b10001, 0b10001, 0b10001, 0b00000, 0b00000], // M
    [0b10001, 0b11001, 0b10101, 0b10011, 0b10001, 0b10001, 0b10001, 0b00000, 0b00000], // N
    [0b01110, 0b10001, 0b10001, 0b10001, 0b10001, 0b10001, 0b01110, 0b00000, 0b00000], // O
    [0b11110, 0b10001, 0b10001, 0b11110, 0b10000, 0b10000, 0b10000, 0b00000, 0b00000], // P
    [0b01110, 0b10001, 0b10001, 0b10001, 0b10101, 0b10010, 0b01101, 0b00000, 0b00000], // Q
    [0b11110, 0b10001, 0b10001, 0b11110, 0b10100, 0b10010, 0b10001, 0b00000, 0b00000], // R
    [0b01111, 0b10000, 0b10000, 0b01110, 0b00001, 0b00001, 0b11110, 0b00000, 0b00000], // S
    [0b11111, 0b00100, 0b00100, 0b00100, 0b00100, 0b00100, 0b00100, 0b00000, 0b00000], // T
    [0b10001, 0b10001, 0b10001, 0b10001, 0b10001, 0b10001, 0b01110, 0b00000, 0b00000], // U
    [0b10001, 0b10001, 0b10001, 0b10001, 0b01010, 0b01010, 0b00100, 0b00000, 0b00000], // V
    [0b10001, 0b10001, 0b10001, 0b10101, 0b10101, 0b11011, 0b10001, 0b00000, 0b00000], // W
    [0b10001, 0b10001, 0b01010, 0b00100, 0b01010, 0b10001, 0b10001, 0b00000, 0b00000], // X
    [0b10001, 0b10001, 0b01010, 0b00100, 0b00100, 0b00100, 0b00100, 0b00000, 0b00000], // Y
    [0b11111, 0b00001, 0b00010, 0b00100, 0b01000, 0b10000, 0b11111, 0b00000, 0b00000], // Z
    [0b01110, 0b01000, 0b01000, 0b01000, 0b01000, 0b01000, 0b01110, 0b00000, 0b00000], // [
    [0b10000, 0b10000, 0b01000, 0b00100, 0b00010, 0b00001, 0b00001, 0b00000, 0b00000], // backslash
    [0b01110, 0b00010, 0b00010, 0b00010, 0b00010, 0b00010, 0b01110, 0b00000, 0b00000], // ]
    [0b00100, 0b01010, 0b10001, 0b00000, 0b00000, 0b00000, 0b00000, 0b00000, 0b00000], // ^
    [0b00000, 0b00000, 0b00000, 0b00000, 0b00000, 0b00000, 0b00000, 0b11111, 0b00000], // _
    [0b01000, 0b00100, 0b00010, 0b00000, 0b00000, 0b00000, 0b00000, 0b00000, 0b00000], // `
    [0b00000, 0b00000, 0b01110, 0b00001, 0b01111, 0b10001, 0b01111, 0b00000, 0b00000], // a
    [0b10000, 0b10000, 0b11110, 0b10001, 0b10001, 0b10001, 0b11110, 0b00000, 0b00000], // b
    [0b00000, 0b00000, 0b01110, 0b10000, 0b10000, 0b10001, 0b01110, 0b00000, 0b00000], // c
    [0b00001, 0b00001, 0b01111, 0b10001, 0b10001, 0b10001, 0b01111, 0b00000, 0b00000], // d
    [0b00000, 0b00000, 0b01110, 0b10001, 0b11111, 0b10000, 0b01110, 0b00000, 0b00000], // e
    [0b00110, 0b01001, 0b01000, 0b11100, 0b01000, 0b01000, 0b01000, 0b00000, 0b00000], // f
    [0b00000, 0b00000, 0b01111, 0b10001, 0b10001, 0b10001, 0b01111, 0b00001, 0b01110], // g
    [0b10000, 0b10000, 0b11110, 0b10001, 0b10001, 0b10001, 0b10001, 0b00000, 0b00000], // h
    [0b00100, 0b00000, 0b01100, 0b00100, 0b00100, 0b00100, 0b01110, 0b00000, 0b00000], // i
    [0b00010, 0b00000, 0b00110, 0b00010, 0b00010, 0b00010, 0b00010, 0b10010, 0b01100], // j
    [0b10000, 0b10000, 0b10010, 0b10100, 0b11000, 0b10100, 0b10010, 0b00000, 0b00000], // k
    [0b01100, 0b00100, 0b00100, 0b00100, 0b00100, 0b00100, 0b01110, 0b00000, 0b00000], // l
    [0b00000, 0b00000, 0b11010, 0b10101, 0b10101, 0b10101, 0b10101, 0b00000, 0b00000], // m
    [0b00000, 0b00000, 0b11110, 0b10001, 0b10001, 0b10001, 0b10001, 0b00000, 0b00000], // n
    [0b00000, 0b00000, 0b01110, 0b10001, 0b10001, 0b10001, 0b01110, 0b00000, 0b00000], // o
    [0b00000, 0b00000, 0b11110, 0b10001, 0b10001, 0b10001, 0b11110, 0b10000, 0b10000], // p
    [0b00000, 0b00000, 0b01111, 0b10001, 0b10001, 0b10001, 0b01111, 0b00001, 0b00001], // q
    [0b00000, 0b00000, 0b10110, 0b11001, 0b10000, 0b10000, 0b10000, 0b00000, 0b00000], // r
    [0b00000, 0b00000, 0b01111, 0b10000, 0b01110, 0b00001, 0b11110, 0b00000, 0b00000], // s
    [0b01000, 0b01000, 0b11100, 0b01000, 0b01000, 0b01001, 0b00110, 0b00000, 0b00000], // t
    [0b00000, 0b00000, 0b10001, 0b10001, 0b10001, 0b10011, 0b01101, 0b00000, 0b00000], // u
    [0b00000, 0b00000, 0b10001, 0b10001, 0b10001, 0b01010, 0b00100, 0b00000, 0b00000], // v
    [0b00000, 0b00000, 0b10001, 0b10001, 0b10101, 0b10101, 0b01010, 0b00000, 0b00000], // w
    [0b00000, 0b00000, 0b10001, 0b01010, 0b00100, 0b01010, 0b10001, 0b00000, 0b00000], // x
    [0b00000, 0b00000, 0b10001, 0b10001, 0b10001, 0b10001, 0b01111, 0b00001, 0b01110], // y
    [0b00000, 0b00000, 0b11111, 0b00010, 0b00100, 0b01000, 0b11111, 0b00000, 0b00000], // z
    [0b00011, 0b00100, 0b00100, 0b01000, 0b00100, 0b00100, 0b00011, 0b00000, 0b00000], // {
    [0b00100, 0b00100, 0b00100, 0b00100, 0b00100, 0b00100, 0b00100, 0b00000, 0b00000], // |
    [0b11000, 0b00100, 0b00100, 0b00010, 0b00100, 0b00100, 0b11000, 0b00000, 0b00000], // }
    [0b00000, 0b00000, 0b01000, 0b10101, 0b00010, 0b00000, 0b00000, 0b00000, 0b00000], // ~
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn letters_are_where_they_belong() {
        let l: Vec<_> = pixels('L').collect();
        let mut expected: Vec<_> = (0..6).map(|y| (0, y)).collect();
        expected.extend((0..5).map(|x| (x, 6)));
        assert_eq!(l, expected);
        let bar: Vec<_> = pixels('|').collect();
        assert_eq!(bar, (0..7).map(|y| (2, y)).collect::<Vec<_>>());
        assert_eq!(pixels(' ').count(), 0);
        assert_eq!(pixels('~').next(), Some((1, 2)));
    }

    #[test]
    fn enlarged_characters_are_of_strokes() {
        assert!(strokes(' ').is_empty());
        // A corner is round, an upright straight, and what touches at corners is joined.
        assert!(strokes('/').iter().any(|[a, b]| a.0 != b.0 && a.1 != b.1));
        assert!(strokes('|').iter().all(|[a, b]| a.0 == b.0));
        for character in '!'..='~' {
            for scale in 1..=5 {
                let covered = coverage(character, scale);
                assert!(covered.iter().all(|&(x, y, part)| {
                    x < WIDTH * scale && y < HEIGHT * scale && part > 0.0 && part <= 1.0
                }));
                // As much ink as its pixels have, give or take the corners.
                let ink: f32 = covered.iter().map(|(_, _, part)| part).sum();
                let squares = (pixels(character).count() as u32 * scale * scale) as f32;
                assert!((0.7..=1.35).contains(&(ink / squares)), "{character} x {scale}: {ink} {squares}");
                let middle = |(x, y): (u32, u32)| (x * scale + scale / 2, y * scale + scale / 2);
                let is_full = |at| covered.iter().any(|&(x, y, part)| (x, y) == at && part > 0.4);
                assert!(pixels(character).all(|pixel| is_full(middle(pixel))), "{character} x {scale}");
            }
        }
    }

    #[test]
    fn no_two_characters_look_alike() {
        for (i, a) in GLYPHS.iter().enumerate() {
            for b in &GLYPHS[i + 1..] {
                assert_ne!(a, b);
            }
            assert_ne!(*a, UNKNOWN);
            assert!(a.iter().all(|&row| row < 32));
        }
    }

    #[test]
    fn other_characters_are_a_box() {
        for character in ['\n', '\u{7f}', 'é', '語', char::MAX] {
            assert_eq!(pixels(character).count(), 20, "{character:?}");
        }
    }

    #[test]
    fn widths_and_their_inverse() {
        assert_eq!((width(0), width(1), width(2)), (0, 5, 11));
        assert_eq!((fitting(4), fitting(5), fitting(10), fitting(11)), (0, 1, 1, 2));
        assert_eq!(width(usize::MAX), u32::MAX);
    }
}
