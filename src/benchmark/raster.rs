//! A drawing surface of pixels for plots, with text in the project's own font.

use std::convert::Infallible;

use image::{Rgb, RgbImage};
use plotters::prelude::{DrawingBackend, FontTransform};
use plotters::style::text_anchor::{HPos, VPos};
use plotters_backend::{BackendColor, BackendCoord, BackendTextStyle, DrawingErrorKind};

use crate::report::font;

/// Font size of a plot, in points, that is drawn in the glyphs' own size.
const PLAIN_SIZE: f64 = 13.0;

/// An image to plot on.
#[derive(Debug)]
pub(super) struct Raster<'a>(pub(super) &'a mut RgbImage);

/// How many pixels a pixel of the font is wide and high.
fn scale<S: BackendTextStyle>(style: &S) -> i32 {
    (style.size() / PLAIN_SIZE).round().max(1.0) as i32
}

fn extent<S: BackendTextStyle>(text: &str, style: &S) -> (i32, i32) {
    let width = i32::try_from(font::width(text.chars().count())).unwrap_or(i32::MAX / 64);
    (width.saturating_mul(scale(style)), font::HEIGHT as i32 * scale(style))
}

impl DrawingBackend for Raster<'_> {
    type ErrorType = Infallible;

    fn get_size(&self) -> (u32, u32) {
        self.0.dimensions()
    }

    fn ensure_prepared(&mut self) -> Result<(), DrawingErrorKind<Infallible>> {
        Ok(())
    }

    fn present(&mut self) -> Result<(), DrawingErrorKind<Infallible>> {
        Ok(())
    }

    fn draw_pixel(
        &mut self,
        (x, y): BackendCoord,
        colour: BackendColor,
    ) -> Result<(), DrawingErrorKind<Infallible>> {
        let (Ok(x), Ok(y)) = (u32::try_from(x), u32::try_from(y)) else { return Ok(()) };
        if let Some(Rgb(under)) = self.0.get_pixel_mut_checked(x, y) {
            let (r, g, b) = colour.rgb;
            for (under, over) in under.iter_mut().zip([r, g, b]) {
                let mixed = f64::from(*under) * (1.0 - colour.alpha) + f64::from(over) * colour.alpha;
                *under = mixed.round() as u8;
            }
        }
        Ok(())
    }

    fn draw_text<S: BackendTextStyle>(
        &mut self,
        text: &str,
        style: &S,
        (x, y): BackendCoord,
    ) -> Result<(), DrawingErrorKind<Infallible>> {
        let ((width, height), scale) = (extent(text, style), scale(style));
        let left = match style.anchor().h_pos {
            HPos::Left => 0,
            HPos::Center => -width / 2,
            HPos::Right => -width,
        };
        let top = match style.anchor().v_pos {
            VPos::Top => 0,
            VPos::Center => -height / 2,
            VPos::Bottom => -height,
        };
        let turn: FontTransform = style.transform();
        for (number, character) in text.chars().enumerate() {
            let start = left + number as i32 * font::ADVANCE as i32 * scale;
            for (column, row, part) in font::coverage(character, scale as u32) {
                let (dx, dy) = turn.transform(start + column as i32, top + row as i32);
                let colour = style.color();
                let colour = BackendColor { alpha: colour.alpha * f64::from(part), ..colour };
                self.draw_pixel((x + dx, y + dy), colour)?;
            }
        }
        Ok(())
    }

    fn estimate_text_size<S: BackendTextStyle>(
        &self,
        text: &str,
        style: &S,
    ) -> Result<(u32, u32), DrawingErrorKind<Infallible>> {
        let (width, height) = extent(text, style);
        Ok((width as u32, height as u32))
    }
}
