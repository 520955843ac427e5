//! A mask: a picture whose pixels tell what is seen there, by a number or by a colour.

use std::collections::BTreeSet;
use std::fmt;
use std::fs::File;
use std::io::BufReader;
use std::path::Path;
use std::str::FromStr;

use image::{DynamicImage, ImageFormat, ImageReader, RgbImage};
use png::{BitDepth, ColorType, Transformations};
use vsonar_ir::Program;

use super::{ImportError, Surface};

/// Most bytes that decoding one mask may take.
const MAX_BYTES: u64 = 512 << 20;

/// What a pixel of a mask says.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Value {
    /// A number: the stored gray level, of 1 to 16 bits, or the index into the palette.
    Id(u16),
    /// A colour: red, green and blue.
    Colour([u8; 3]),
}

impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Value::Id(id) => write!(f, "{id}"),
            Value::Colour([r, g, b]) => write!(f, "#{r:02x}{g:02x}{b:02x}"),
        }
    }
}

/// Some values, all numbers or all colours.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Values(pub BTreeSet<Value>);

/// A text that is no list of values.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("write numbers from 0 to 65535, as in 7,8, or colours, as in '#804080,#f423e8'")]
pub struct ParseValuesError;

impl FromStr for Values {
    type Err = ParseValuesError;

    /// Reads `7,8` or `#804080,#f423e8`.
    fn from_str(text: &str) -> Result<Values, ParseValuesError> {
        let hex = |text: &str, at: usize| u8::from_str_radix(text.get(at..at + 2)?, 16).ok();
        let value = |text: &str| match text.strip_prefix('#') {
            Some(digits) if digits.len() == 6 && digits.bytes().all(|b| b.is_ascii_hexdigit()) => {
                Some(Value::Colour([hex(digits, 0)?, hex(digits, 2)?, hex(digits, 4)?]))
            }
            None if text.bytes().all(|b| b.is_ascii_digit()) => text.parse().ok().map(Value::Id),
            _ => None,
        };
        let values: Option<BTreeSet<Value>> = text.split(',').map(|text| value(text.trim())).collect();
        let values = values.ok_or(ParseValuesError)?;
        let colours = values.iter().filter(|value| matches!(value, Value::Colour(_))).count();
        if colours > 0 && colours < values.len() { Err(ParseValuesError) } else { Ok(Values(values)) }
    }
}

impl Values {
    /// Whether they are colours.
    pub fn are_colours(&self) -> bool {
        self.0.iter().any(|value| matches!(value, Value::Colour(_)))
    }
}

impl fmt::Display for Values {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let values: Vec<String> = self.0.iter().map(ToString::to_string).collect();
        f.write_str(&values.join(","))
    }
}

/// A decoded mask.
#[derive(Debug)]
pub(super) enum Mask {
    /// Numbers, row by row.
    Ids { width: u32, height: u32, ids: Vec<u16> },
    /// Colours.
    Colours(RgbImage),
}

impl Mask {
    /// Reads a mask of colours, or one of numbers.
    pub(super) fn load(path: &Path, colours: bool) -> Result<Mask, ImportError> {
        let opened = ImageReader::open(path).and_then(ImageReader::with_guessed_format);
        let mut reader = opened.map_err(|e| ImportError::read(path, e))?;
        match reader.format() {
            Some(ImageFormat::Png) if !colours => return ids_of_png(path),
            Some(ImageFormat::Jpeg) => {
                let text = "is a JPEG file, which does not keep values exactly; export the masks as PNG";
                return Err(ImportError::mask(path, text));
            }
            _ => {}
        }
        let mut limits = image::Limits::default();
        limits.max_image_width = Some(Program::MAX_SIDE);
        limits.max_image_height = Some(Program::MAX_SIDE);
        limits.max_alloc = Some(MAX_BYTES);
        reader.limits(limits);
        let damaged = |e: image::ImageError| {
            ImportError::mask(path, format!("{e}; the mask is damaged or too large, export it anew as PNG"))
        };
        let image = reader.decode().map_err(damaged)?;
        match image {
            image if colours => Ok(Mask::Colours(image.into_rgb8())),
            DynamicImage::ImageLuma8(gray) => {
                let (width, height) = gray.dimensions();
                Ok(Mask::Ids { width, height, ids: gray.into_raw().into_iter().map(u16::from).collect() })
            }
            DynamicImage::ImageLuma16(gray) => {
                let (width, height) = gray.dimensions();
                Ok(Mask::Ids { width, height, ids: gray.into_raw() })
            }
            _ => Err(in_colour(path)),
        }
    }

    pub(super) fn size(&self) -> (u32, u32) {
        match self {
            Mask::Ids { width, height, .. } => (*width, *height),
            Mask::Colours(image) => image.dimensions(),
        }
    }

    /// What stands at a pixel, which is inside the mask.
    pub(super) fn value(&self, x: u32, y: u32) -> Value {
        match self {
            Mask::Ids { width, ids, .. } => Value::Id(ids[y as usize * *width as usize + x as usize]),
            Mask::Colours(image) => Value::Colour(image.get_pixel(x, y).0),
        }
    }
}

/// What a value stands for.
pub(super) fn surface(value: Value, ground: &Values, ignored: &Values) -> Surface {
    if ignored.0.contains(&value) {
        Surface::Ignored
    } else if ground.0.contains(&value) {
        Surface::Ground
    } else {
        Surface::Other
    }
}

fn in_colour(path: &Path) -> ImportError {
    ImportError::mask(path, "is in colour; say which colours are ground, as in --ground '#804080'")
}

/// The numbers of a PNG file as they are stored, before any palette and of any depth.
fn ids_of_png(path: &Path) -> Result<Mask, ImportError> {
    let damaged = |e: png::DecodingError| {
        ImportError::mask(path, format!("{e}; the mask is damaged or cut off, export it anew"))
    };
    let file = File::open(path).map_err(|e| ImportError::read(path, e))?;
    let limits = png::Limits { bytes: MAX_BYTES as usize };
    let mut decoder = png::Decoder::new_with_limits(BufReader::new(file), limits);
    decoder.set_transformations(Transformations::IDENTITY);
    let mut reader = decoder.read_info().map_err(damaged)?;
    let (width, height, depth, colour) =
        (reader.info().width, reader.info().height, reader.info().bit_depth, reader.info().color_type);
    let samples = match colour {
        ColorType::Grayscale | ColorType::Indexed => 1,
        ColorType::GrayscaleAlpha => 2,
        ColorType::Rgb | ColorType::Rgba => return Err(in_colour(path)),
    };
    let bytes = reader.output_buffer_size().filter(|&bytes| bytes as u64 <= MAX_BYTES);
    let (Some(bytes), true) = (bytes, width.max(height) <= Program::MAX_SIDE) else {
        let text = format!("the mask is too large: {} pixels a side are the limit", Program::MAX_SIDE);
        return Err(ImportError::mask(path, text));
    };
    let mut raw = vec![0; bytes];
    reader.next_frame(&mut raw).map_err(damaged)?;
    let line = reader.output_line_size(width).unwrap_or(bytes);
    let mut ids = Vec::with_capacity(width as usize * height as usize);
    for row in raw.chunks_exact(line.max(1)) {
        match depth {
            BitDepth::Sixteen => {
                let samples = row.chunks_exact(2 * samples);
                ids.extend(samples.map(|sample| u16::from_be_bytes([sample[0], sample[1]])));
            }
            BitDepth::Eight => ids.extend(row.iter().step_by(samples).map(|&id| u16::from(id))),
            // Packed, the first pixel in the highest bits; never with alpha.
            BitDepth::One | BitDepth::Two | BitDepth::Four => {
                let bits = depth as u8;
                let pixel = |x: u32| {
                    let bit = u64::from(x) * u64::from(bits);
                    let byte = row[(bit / 8) as usize];
                    u16::from(byte >> (8 - bits - (bit % 8) as u8) & ((1 << bits) - 1))
                };
                ids.extend((0..width).map(pixel));
            }
        }
    }
    Ok(Mask::Ids { width, height, ids })
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::{Luma, Rgba, RgbaImage};

    fn values(text: &str) -> Values {
        text.parse().expect("a list of values")
    }

    /// A PNG file of these bytes.
    fn png(path: &Path, size: (u32, u32), colour: ColorType, depth: BitDepth, data: &[u8]) {
        let file = File::create(path).expect("writable");
        let mut encoder = png::Encoder::new(file, size.0, size.1);
        encoder.set_color(colour);
        encoder.set_depth(depth);
        if colour == ColorType::Indexed {
            encoder.set_palette((0..16 * 3).map(|i| 255 - i as u8).collect::<Vec<_>>());
        }
        encoder.write_header().expect("sound").write_image_data(data).expect("sound");
    }

    fn ids(path: &Path) -> Vec<u16> {
        match Mask::load(path, false).expect("sound") {
            Mask::Ids { ids, .. } => ids,
            Mask::Colours(_) => panic!("colours"),
        }
    }

    #[test]
    fn lists_of_values() {
        assert_eq!(values("7, 8,7").to_string(), "7,8");
        assert_eq!(values("#00FF7f").0.first(), Some(&Value::Colour([0, 255, 127])));
        assert!(values("#00ff7f,#000000").are_colours() && !values("65535").are_colours());
        for wrong in
            ["", ",", "1,", "-1", "65536", "#12345", "#1234567", "#+12345", "#éab", "red", "1,#000000", "+1"]
        {
            assert_eq!(wrong.parse::<Values>(), Err(ParseValuesError), "{wrong}");
        }
    }

    #[test]
    fn numbers_are_those_stored_at_every_depth() {
        let dir = tempfile::tempdir().expect("a temporary folder");
        let path = dir.path().join("mask.png");
        // Three pixels a row, so that the last byte is not full.
        png(&path, (3, 2), ColorType::Grayscale, BitDepth::One, &[0b1010_0000, 0b0110_0000]);
        assert_eq!(ids(&path), [1, 0, 1, 0, 1, 1]);
        png(&path, (3, 2), ColorType::Indexed, BitDepth::Two, &[0b1101_0000, 0b0010_1100]);
        assert_eq!(ids(&path), [3, 1, 0, 0, 2, 3]);
        png(&path, (3, 1), ColorType::Indexed, BitDepth::Four, &[0x7f, 0xa0]);
        assert_eq!(ids(&path), [7, 15, 10]);
        png(&path, (3, 1), ColorType::Indexed, BitDepth::Eight, &[7, 15, 10]);
        assert_eq!(ids(&path), [7, 15, 10]);
        png(&path, (2, 1), ColorType::GrayscaleAlpha, BitDepth::Eight, &[7, 0, 200, 255]);
        assert_eq!(ids(&path), [7, 200]);
        png(&path, (2, 1), ColorType::Grayscale, BitDepth::Sixteen, &[1, 2, 255, 255]);
        assert_eq!(ids(&path), [258, 65_535]);
        let pgm = dir.path().join("mask.pgm");
        image::GrayImage::from_fn(4, 2, |x, y| Luma([(x + 4 * y) as u8])).save(&pgm).expect("writable");
        assert_eq!(ids(&pgm), (0..8).collect::<Vec<_>>());
    }

    #[test]
    fn colours_are_told_without_alpha() {
        let dir = tempfile::tempdir().expect("a temporary folder");
        let path = dir.path().join("mask.png");
        RgbaImage::from_fn(2, 1, |x, _| Rgba([x as u8, 2, 3, 100 * x as u8])).save(&path).expect("writable");
        let mask = Mask::load(&path, true).expect("sound");
        assert_eq!((mask.size(), mask.value(1, 0)), ((2, 1), Value::Colour([1, 2, 3])));
        assert!(Mask::load(&path, false).expect_err("in colour").to_string().contains("--ground '#"));
        png(&path, (2, 1), ColorType::Indexed, BitDepth::Eight, &[0, 1]);
        let mask = Mask::load(&path, true).expect("sound");
        assert_eq!(mask.value(1, 0), Value::Colour([252, 251, 250]));
    }

    #[test]
    fn damaged_masks_are_refused() {
        let dir = tempfile::tempdir().expect("a temporary folder");
        let path = dir.path().join("mask.png");
        image::GrayImage::from_fn(64, 64, |x, y| Luma([(x * y) as u8])).save(&path).expect("writable");
        let whole = std::fs::read(&path).expect("there");
        for length in [0, 10, 30, whole.len() / 2] {
            std::fs::write(&path, &whole[..length]).expect("writable");
            for colours in [false, true] {
                let error = Mask::load(&path, colours).expect_err("cut off").to_string();
                assert!(error.contains("mask.png"), "{error}");
            }
        }
        let missing = dir.path().join("none.png");
        assert!(matches!(Mask::load(&missing, false), Err(ImportError::Read { .. })));
        let jpeg = dir.path().join("mask.jpg");
        image::GrayImage::new(16, 16).save(&jpeg).expect("writable");
        assert!(Mask::load(&jpeg, false).expect_err("lossy").to_string().contains("PNG"));
    }
}
