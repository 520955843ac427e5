//! Pictures of few colours as small PNG files: grays in steps that are hard to see, and the colours of marks.

use image::{Rgb, RgbImage};

use super::canvas::Colour;
use super::picture::{RIGHT, WRONG};
use super::several::COLOURS;

/// Colours that are kept as they are.
const MARKS: u8 = 2 + COLOURS.len() as u8;
/// Shades of gray.
const GRAYS: u8 = 32;
/// Levels of each of red, green and blue in what is not gray.
const LEVELS: u8 = 6;
/// A pixel whose parts differ by less is gray.
const GRAY_WITHIN: u8 = 12;

/// The value of a level of so many, 0 to 255.
fn value(level: u8, levels: u8) -> u8 {
    (u16::from(level) * 255 / u16::from(levels - 1)) as u8
}

/// The level nearest to a value.
fn level(value: u8, levels: u8) -> u8 {
    ((u16::from(value) * u16::from(levels - 1) + 127) / 255) as u8
}

fn marks() -> impl Iterator<Item = Colour> {
    [RIGHT, WRONG].into_iter().chain(COLOURS)
}

/// The number of the colour in the palette that a pixel is drawn in.
fn index(pixel: Colour) -> u8 {
    let Rgb([r, g, b]) = pixel;
    let (low, high) = (r.min(g).min(b), r.max(g).max(b));
    if high - low < GRAY_WITHIN {
        return level(low + (high - low) / 2, GRAYS);
    }
    if let Some(mark) = marks().position(|mark| mark == pixel) {
        return GRAYS + mark as u8;
    }
    let [r, g, b] = [r, g, b].map(|part| level(part, LEVELS));
    GRAYS + MARKS + (r * LEVELS + g) * LEVELS + b
}

/// The colours, three bytes each.
fn palette() -> Vec<u8> {
    let grays = (0..GRAYS).map(|gray| [value(gray, GRAYS); 3]);
    let each = || 0..LEVELS;
    let colours = each().flat_map(|r| each().flat_map(move |g| each().map(move |b| [r, g, b])));
    grays
        .chain(marks().map(|mark| mark.0))
        .chain(colours.map(|parts| parts.map(|part| value(part, LEVELS))))
        .flatten()
        .collect()
}

/// The picture as a PNG file with a palette.
///
/// # Errors
/// If it cannot be encoded.
pub(super) fn png(picture: &RgbImage) -> Result<Vec<u8>, png::EncodingError> {
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(&mut file, picture.width(), picture.height());
    encoder.set_color(png::ColorType::Indexed);
    encoder.set_palette(palette());
    encoder.set_compression(png::Compression::High);
    // Differences of numbers in a palette mean nothing.
    encoder.set_filter(png::Filter::NoFilter);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(&picture.pixels().map(|pixel| index(*pixel)).collect::<Vec<u8>>())?;
    writer.finish()?;
    Ok(file)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_are_near_to_what_they_stand_for() {
        let palette = palette();
        assert_eq!(palette.len(), 3 * 256);
        for r in (0..=255).step_by(5) {
            for g in (0..=255).step_by(17) {
                for b in (0..=255).step_by(3) {
                    let place = 3 * usize::from(index(Rgb([r, g, b])));
                    let most = if r == g && g == b { 5 } else { 26 };
                    for (part, drawn) in [r, g, b].into_iter().zip(&palette[place..]) {
                        assert!(
                            part.abs_diff(*drawn) <= most,
                            "{r} {g} {b}: {:?}",
                            &palette[place..place + 3]
                        );
                    }
                }
            }
        }
    }

    #[test]
    fn files_are_read_as_they_were_drawn() {
        let picture =
            RgbImage::from_fn(
                40,
                30,
                |x, y| if x < 30 { Rgb([(6 * y) as u8; 3]) } else { Rgb([255, 150, 0]) },
            );
        let read = image::load_from_memory(&png(&picture).expect("encoded")).expect("a PNG").into_rgb8();
        assert_eq!(read.dimensions(), (40, 30));
        assert_eq!((*read.get_pixel(35, 9), *read.get_pixel(2, 0)), (WRONG, Rgb([0, 0, 0])));
        assert!(read.get_pixel(2, 29).0[0].abs_diff(174) <= 5);
    }
}
