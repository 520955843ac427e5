//! A colour image to draw on: rectangles, rings, arrow heads and text, each cut at the image's borders.
//!
//! Coordinates are signed, so that a mark may stand half outside; a pixel covers `[x, x + 1) x [y, y + 1)`.

use image::{Rgb, RgbImage};

use super::font;

/// A colour.
pub(super) type Colour = Rgb<u8>;

pub(super) const BLACK: Colour = Rgb([0, 0, 0]);
pub(super) const WHITE: Colour = Rgb([255, 255, 255]);

/// An axis-parallel rectangle of pixels: columns `left .. right`, rows `top .. bottom`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Area {
    pub(super) left: i64,
    pub(super) top: i64,
    pub(super) right: i64,
    pub(super) bottom: i64,
}

impl Area {
    /// `width` x `height` pixels around a centre; of an even size the pixel right of and below the middle is
    /// the centre.
    pub(super) fn around((x, y): (i64, i64), width: i64, height: i64) -> Area {
        let (left, top) = (x - width / 2, y - height / 2);
        Area { left, top, right: left + width, bottom: top + height }
    }

    /// Larger by `by` pixels on every side.
    pub(super) fn grown(self, by: i64) -> Area {
        let Area { left, top, right, bottom } = self;
        Area { left: left - by, top: top - by, right: right + by, bottom: bottom + by }
    }
}

/// The image drawn on.
#[derive(Debug)]
pub(super) struct Canvas(pub(super) RgbImage);

impl Canvas {
    fn put(&mut self, x: i64, y: i64, colour: Colour) {
        let (Ok(x), Ok(y)) = (u32::try_from(x), u32::try_from(y)) else { return };
        if let Some(pixel) = self.0.get_pixel_mut_checked(x, y) {
            *pixel = colour;
        }
    }

    /// The part of an area that is inside the image.
    fn clip(&self, area: Area) -> Area {
        let (width, height) = (i64::from(self.0.width()), i64::from(self.0.height()));
        Area {
            left: area.left.clamp(0, width),
            top: area.top.clamp(0, height),
            right: area.right.clamp(0, width),
            bottom: area.bottom.clamp(0, height),
        }
    }

    /// Every pixel of an area that `inside` holds for.
    fn paint(&mut self, area: Area, colour: Colour, inside: impl Fn(i64, i64) -> bool) {
        let area = self.clip(area);
        for y in area.top..area.bottom {
            for x in (area.left..area.right).filter(|&x| inside(x, y)) {
                self.put(x, y, colour);
            }
        }
    }

    pub(super) fn fill(&mut self, area: Area, colour: Colour) {
        self.paint(area, colour, |_, _| true);
    }

    /// The border of an area, `pen` pixels wide, inside it.
    pub(super) fn frame(&mut self, area: Area, pen: i64, colour: Colour) {
        let hole = area.grown(-pen);
        self.paint(area, colour, |x, y| x < hole.left || x >= hole.right || y < hole.top || y >= hole.bottom);
    }

    /// A ring around a pixel, of the pixels that are `inner` to `outer` pixels from it, centre to centre and
    /// rounded; a disc if `inner` is 0.
    pub(super) fn ring(&mut self, (cx, cy): (i64, i64), inner: i64, outer: i64, colour: Colour) {
        let side = 2 * outer + 1;
        // in halves of a pixel: a ring of one pixel's width has no gaps
        let (from, to) = ((2 * inner - 1).max(0), 2 * outer + 1);
        self.paint(Area::around((cx, cy), side, side), colour, |x, y| {
            let square = 4 * ((x - cx) * (x - cx) + (y - cy) * (y - cy));
            (from * from..to * to).contains(&square)
        });
    }

    /// A filled arrow head with its tip at a pixel, `size` rows high; `down` is the direction of the tip, 1
    /// (pointing down) or -1 (pointing up).
    pub(super) fn arrow(&mut self, (x, y): (i64, i64), size: i64, down: i64, colour: Colour) {
        for row in 0..size {
            let half = row * 2 / 3;
            self.fill(Area::around((x, y - down * row), 2 * half + 1, 1), colour);
        }
    }

    /// A text with its upper left corner at a pixel, each pixel of the font `scale` x `scale` pixels.
    pub(super) fn text(&mut self, (x, y): (i64, i64), scale: i64, text: &str, colour: Colour) {
        let size = scale.clamp(1, 64) as u32;
        for (i, character) in text.chars().enumerate() {
            let left = x + i as i64 * i64::from(font::ADVANCE * size);
            for (column, row, part) in font::coverage(character, size) {
                self.blend(left + i64::from(column), y + i64::from(row), colour, part);
            }
        }
    }

    /// Covers so much of a pixel, 0 to 1.
    fn blend(&mut self, x: i64, y: i64, colour: Colour, part: f32) {
        let (Ok(x), Ok(y)) = (u32::try_from(x), u32::try_from(y)) else { return };
        if let Some(Rgb(under)) = self.0.get_pixel_mut_checked(x, y) {
            for (under, over) in under.iter_mut().zip(colour.0) {
                *under = (f32::from(*under) * (1.0 - part) + f32::from(over) * part).round() as u8;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn canvas() -> Canvas {
        Canvas(RgbImage::new(9, 9))
    }

    fn set(canvas: &Canvas) -> Vec<(u32, u32)> {
        canvas.0.enumerate_pixels().filter(|(_, _, p)| **p == WHITE).map(|(x, y, _)| (x, y)).collect()
    }

    #[test]
    fn areas_are_centred() {
        assert_eq!(Area::around((4, 4), 3, 1), Area { left: 3, top: 4, right: 6, bottom: 5 });
        assert_eq!(Area::around((4, 4), 2, 2), Area { left: 3, top: 3, right: 5, bottom: 5 });
    }

    #[test]
    fn shapes_have_their_pixels() {
        let mut c = canvas();
        c.frame(Area::around((4, 4), 3, 3), 1, WHITE);
        assert_eq!(set(&c), [(3, 3), (4, 3), (5, 3), (3, 4), (5, 4), (3, 5), (4, 5), (5, 5)]);
        let mut c = canvas();
        c.ring((4, 4), 2, 2, WHITE);
        let rows: Vec<_> = (0..9).map(|y| set(&c).iter().filter(|p| p.1 == y).count()).collect();
        assert_eq!(rows, [0, 0, 3, 2, 2, 2, 3, 0, 0]);
        assert!(set(&c).contains(&(2, 4)) && set(&c).contains(&(3, 2)) && !set(&c).contains(&(2, 2)));
        let mut c = canvas();
        c.ring((4, 4), 0, 1, WHITE);
        assert_eq!(set(&c).len(), 9);
        let mut c = canvas();
        c.arrow((4, 0), 4, -1, WHITE);
        let rows: Vec<_> = (0..4).map(|y| set(&c).iter().filter(|p| p.1 == y).count()).collect();
        assert_eq!(rows, [1, 1, 3, 5]);
        let mut c = canvas();
        c.arrow((4, 8), 4, 1, WHITE);
        assert!(set(&c).contains(&(4, 8)) && set(&c).contains(&(2, 5)) && !set(&c).contains(&(2, 8)));
    }

    #[test]
    fn everything_is_cut_at_the_borders() {
        let far = i64::from(u32::MAX) * 4;
        for at in [(-3, -3), (0, 8), (12, 4), (far, far), (-far, 4)] {
            let mut c = canvas();
            c.fill(Area::around(at, 5, 5), WHITE);
            c.frame(Area::around(at, 50, 50), 2, WHITE);
            c.ring(at, 3, 5, WHITE);
            c.arrow(at, 7, 1, WHITE);
            c.text(at, 2, "Text", WHITE);
        }
        let mut c = canvas();
        c.fill(Area::around((0, 0), far, far), WHITE);
        assert_eq!(set(&c).len(), 81);
    }
}
