//! A mask: a picture whose pixels tell what is seen there, by a number or by a colour.

use std::collections::BTreeSet;
use std::fmt;
use std::io::Cursor;
use std::path::Path;
use std::str::FromStr;

use image::{DynamicImage, ImageFormat, RgbImage};
use png::{BitDepth, ColorType, Transformations};

use super::ImportError;
use crate::vision::ImageError;
use crate::vision::file::{checked_format, contents, samples};
use crate::vision::tiff::Tags;

/// Most bytes that decoding one mask may take.
const MAX_BYTES: usize = 512 << 20;

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
    /// Reads a mask of colours, or one of numbers: those of a palette where the format keeps them (PNG, BMP, TIFF, GIF),
    /// else the gray levels, also where they are stored as colours.
    pub(super) fn load(path: &Path, colours: bool) -> Result<Mask, ImportError> {
        let unreadable = |error| match error {
            ImageError::Io { path, source } => ImportError::Read { path, source },
            other => other.into(),
        };
        let mut file = contents(path).map_err(unreadable)?;
        let format = checked_format(&file, path)?;
        if is_lossy(format, &file) {
            let text = "is compressed with loss, which does not keep values exactly; export the masks as PNG";
            return Err(ImportError::mask(path, text));
        }
        match format {
            ImageFormat::Png if !colours => {
                if let Some(mask) = ids_of_png(path, &file)? {
                    return Ok(mask);
                }
            }
            ImageFormat::Gif if !colours => {
                if let Some(mask) = ids_of_gif(path, &file)? {
                    return Ok(mask);
                }
            }
            ImageFormat::Bmp if !colours => file = with_numbered_palette(&file).unwrap_or(file),
            ImageFormat::Tiff if !colours => {
                if let Some(palette) = Tags::read(&file).and_then(|tags| tags.palette()) {
                    let ((width, height), ids) = (palette.size(), palette.numbers(&file));
                    let ids = ids.map_err(|error| damaged(path, &error))?;
                    return Ok(Mask::Ids { width, height, ids });
                }
            }
            _ => {}
        }
        let image = samples(&file, path)?;
        let (width, height) = (image.width(), image.height());
        let ids: Vec<u16> = match image {
            image if colours => return Ok(Mask::Colours(image.into_rgb8())),
            DynamicImage::ImageLuma8(gray) => gray.into_raw().into_iter().map(u16::from).collect(),
            DynamicImage::ImageLuma16(gray) => gray.into_raw(),
            DynamicImage::ImageLumaA8(gray) => gray.pixels().map(|pixel| pixel.0[0].into()).collect(),
            DynamicImage::ImageLumaA16(gray) => gray.pixels().map(|pixel| pixel.0[0]).collect(),
            // Formats without gray, and many tools in the others, keep it as colour.
            image @ (DynamicImage::ImageRgb8(_) | DynamicImage::ImageRgba8(_)) => {
                grays(&image.into_rgb8()).ok_or_else(|| in_colour(path))?
            }
            image @ (DynamicImage::ImageRgb16(_) | DynamicImage::ImageRgba16(_)) => {
                grays(&image.into_rgb16()).ok_or_else(|| in_colour(path))?
            }
            _ => return Err(in_colour(path)),
        };
        Ok(Mask::Ids { width, height, ids })
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

/// The levels of an image of red, green and blue; none if they differ anywhere.
fn grays<T: Copy + PartialEq + Into<u16>>(samples: &[T]) -> Option<Vec<u16>> {
    let level = |pixel: &[T]| (pixel[0] == pixel[1] && pixel[1] == pixel[2]).then(|| pixel[0].into());
    samples.chunks_exact(3).map(level).collect()
}

fn in_colour(path: &Path) -> ImportError {
    ImportError::mask(path, "is in colour; say which colours are ground, as in --ground '#804080'")
}

fn damaged(path: &Path, error: &dyn fmt::Display) -> ImportError {
    ImportError::mask(path, format!("{error}; the mask is damaged or cut off, export it anew"))
}

/// Whether a file is of a format that changes samples when it is written: JPEG, WebP and TIFF where they are lossy,
/// textures, and floating point of shared exponents.
fn is_lossy(format: ImageFormat, file: &[u8]) -> bool {
    match format {
        ImageFormat::Jpeg | ImageFormat::Dds | ImageFormat::Hdr => true,
        ImageFormat::WebP => has_lossy_chunk(file.get(12..).unwrap_or_default()),
        ImageFormat::Tiff => Tags::read(file).is_some_and(|tags| tags.is_lossy()),
        _ => false,
    }
}

/// Whether one of the chunks of a WebP file is a lossy bitstream, those of an animation included.
fn has_lossy_chunk(mut chunks: &[u8]) -> bool {
    while let Some((&[a, b, c, d, l0, l1, l2, l3], rest)) = chunks.split_first_chunk::<8>() {
        let length = u32::from_le_bytes([l0, l1, l2, l3]) as usize;
        let content = &rest[..length.min(rest.len())];
        match &[a, b, c, d] {
            b"VP8 " => return true,
            // Of a frame, its chunks follow 16 bytes of numbers.
            b"ANMF" if has_lossy_chunk(content.get(16..).unwrap_or_default()) => return true,
            _ => {}
        }
        // Chunks are padded to an even length.
        chunks = rest.get(length.saturating_add(length % 2)..).unwrap_or_default();
    }
    false
}

/// A BMP file with a palette of grays that are the numbers of its colours; none if it has no palette.
fn with_numbered_palette(file: &[u8]) -> Option<Vec<u8>> {
    let word = |at: usize| Some(u32::from_le_bytes(*file.get(at..)?.first_chunk::<4>()?));
    let header = word(14)?;
    // The oldest header has sides of two bytes, and a palette of three for each colour.
    let (bits, used, entry) =
        if header == 12 { (word(22)? >> 16, 0, 3) } else { (word(26)? >> 16, word(46)?, 4) };
    if !(1..=8).contains(&bits) {
        return None;
    }
    let colours = if used == 0 { 1 << bits } else { used.min(1 << bits) };
    let mut file = file.to_vec();
    let palette = file.get_mut(14usize.checked_add(header as usize)?..)?;
    for (number, colour) in palette.chunks_exact_mut(entry).take(colours as usize).enumerate() {
        colour.fill(number as u8);
    }
    Some(file)
}

/// The numbers of a GIF file's first picture, and around it that of the background; none if the whole palette is gray, for
/// GIF has no other gray, and writers number it anew.
fn ids_of_gif(path: &Path, file: &[u8]) -> Result<Option<Mask>, ImportError> {
    let failed = |error: gif::DecodingError| damaged(path, &error);
    let mut options = gif::DecodeOptions::new();
    options.set_color_output(gif::ColorOutput::Indexed);
    options.check_frame_consistency(true);
    // The size is checked, and no frame is larger.
    options.set_memory_limit(gif::MemoryLimit::Unlimited);
    let mut decoder = options.read_info(file).map_err(failed)?;
    let (width, height) = (decoder.width(), decoder.height());
    let background = decoder.bg_color().unwrap_or_default() as u16;
    let mut ids = vec![background; usize::from(width) * usize::from(height)];
    let Some(frame) = decoder.read_next_frame().map_err(failed)? else {
        return Err(damaged(path, &"has no picture"));
    };
    let (left, across) = (usize::from(frame.left), usize::from(frame.width));
    let rows = ids.chunks_exact_mut(width.max(1).into()).skip(frame.top.into());
    for (row, numbers) in rows.zip(frame.buffer.chunks_exact(across.max(1))) {
        row[left..][..across].iter_mut().zip(numbers).for_each(|(id, &number)| *id = number.into());
    }
    let is_gray = decoder.palette().is_ok_and(|palette| grays(palette).is_some());
    Ok((!is_gray).then_some(Mask::Ids { width: width.into(), height: height.into(), ids }))
}

/// The numbers of a PNG file as they are stored, before any palette and of any depth; none if it stores colours.
fn ids_of_png(path: &Path, file: &[u8]) -> Result<Option<Mask>, ImportError> {
    let failed = |error: png::DecodingError| damaged(path, &error);
    let mut decoder = png::Decoder::new_with_limits(Cursor::new(file), png::Limits { bytes: MAX_BYTES });
    decoder.set_transformations(Transformations::IDENTITY);
    let mut reader = decoder.read_info().map_err(failed)?;
    let (width, height, depth, colour) =
        (reader.info().width, reader.info().height, reader.info().bit_depth, reader.info().color_type);
    let samples = match colour {
        ColorType::Grayscale | ColorType::Indexed => 1,
        ColorType::GrayscaleAlpha => 2,
        ColorType::Rgb | ColorType::Rgba => return Ok(None),
    };
    let mut raw =
        vec![0; reader.output_buffer_size().filter(|&bytes| bytes <= MAX_BYTES).unwrap_or_default()];
    reader.next_frame(&mut raw).map_err(failed)?;
    let line = reader.output_line_size(width).unwrap_or(raw.len());
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
    Ok(Some(Mask::Ids { width, height, ids }))
}

#[cfg(test)]
mod tests {
    use std::fs::File;

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

    /// A BMP file of 4 x 2 pixels with a palette of gray that falls, so that numbers are not levels.
    fn bmp(bits: u32, rows: [[u8; 4]; 2]) -> Vec<u8> {
        let colours = 1u32 << bits;
        let mut file = b"BM".to_vec();
        for word in [0, 0, 54 + 4 * colours, 40, 4, 2, bits << 16 | 1, 0, 0, 0, 0, colours, 0] {
            file.extend(word.to_le_bytes());
        }
        file.extend((0..colours).flat_map(|i| [255 - i as u8; 4]));
        // From the bottom up.
        rows.iter().rev().for_each(|row| file.extend(row));
        file
    }

    #[test]
    fn palettes_are_read_by_their_numbers_and_gray_by_its_levels() {
        use crate::vision::tiff::tests::{file, map};

        let dir = tempfile::tempdir().expect("a temporary folder");
        let path = dir.path().join("mask.bmp");
        for (bits, rows, numbers) in [
            (8, [[7, 2, 200, 0], [1, 2, 3, 4]], [7, 2, 200, 0, 1, 2, 3, 4]),
            (4, [[0x72, 0xf0, 0, 0], [0x12, 0x34, 0, 0]], [7, 2, 15, 0, 1, 2, 3, 4]),
            (1, [[0b1010_0000, 0, 0, 0], [0b0111_0000, 0, 0, 0]], [1, 0, 1, 0, 0, 1, 1, 1]),
        ] {
            std::fs::write(&path, bmp(bits, rows)).expect("writable");
            assert_eq!(ids(&path), numbers, "{bits} bits");
            let Ok(Mask::Colours(colours)) = Mask::load(&path, true) else { panic!("no colours") };
            assert_eq!(colours.get_pixel(0, 0).0, [255 - numbers[0] as u8; 3]);
        }
        // Runs: four times 9; 5, 6, 7 and 8 one after the other.
        let mut runs = bmp(8, [[0; 4]; 2]);
        runs.truncate(54 + 4 * 256);
        runs[30] = 1;
        runs.extend([0, 4, 5, 6, 7, 8, 0, 0, 4, 9, 0, 1]);
        std::fs::write(&path, runs).expect("writable");
        assert_eq!(ids(&path), [9, 9, 9, 9, 5, 6, 7, 8]);
        // The oldest kind of header, wider than its rows are long.
        let mut old = b"BM".to_vec();
        [0u32, 0, 26 + 48, 12].iter().for_each(|word| old.extend(word.to_le_bytes()));
        [9u16, 1, 1, 4].iter().for_each(|half| old.extend(half.to_le_bytes()));
        old.extend([77; 48]);
        old.extend([0x12, 0x34, 0x56, 0x78, 0x90, 0, 0, 0]);
        std::fs::write(&path, old).expect("writable");
        assert_eq!(ids(&path), [1, 2, 3, 4, 5, 6, 7, 8, 9]);
        let levels = image::GrayImage::from_fn(4, 2, |x, y| Luma([(x + 40 * y) as u8]));
        let expected = [0, 1, 2, 3, 40, 41, 42, 43];
        for name in ["gray.bmp", "gray.tiff", "gray.webp", "gray.tga", "gray.png"] {
            let path = dir.path().join(name);
            levels.save(&path).unwrap_or_else(|e| panic!("{name}: {e}"));
            assert_eq!(ids(&path), expected, "{name}");
        }
        // Gray that is stored as colour is gray.
        let rgb = DynamicImage::ImageLuma8(levels).to_rgb8();
        let deep = DynamicImage::ImageRgb8(rgb.clone()).to_rgb16();
        for kind in ["bmp", "tiff", "qoi", "webp", "gif", "png"] {
            let path = dir.path().join(format!("rgb.{kind}"));
            DynamicImage::ImageRgb8(rgb.clone()).save(&path).unwrap_or_else(|e| panic!("{kind}: {e}"));
            assert_eq!(ids(&path), expected, "{kind}");
            if ["tiff", "png"].contains(&kind) {
                deep.save(&path).unwrap_or_else(|e| panic!("{kind}: {e}"));
                assert_eq!(ids(&path), expected.map(|level| 257 * level), "{kind}");
            }
        }
        // A palette with any colour numbers the classes, in a picture that leaves a border of the screen.
        let path = dir.path().join("palette.gif");
        let palette: Vec<u8> = (0..24).collect();
        let mut encoder =
            gif::Encoder::new(File::create(&path).expect("writable"), 4, 2, &palette).expect("sound");
        let frame = gif::Frame {
            left: 1,
            width: 3,
            height: 2,
            buffer: (&[7, 2, 5, 1, 2, 3][..]).into(),
            ..Default::default()
        };
        encoder.write_frame(&frame).expect("sound");
        drop(encoder);
        assert_eq!(ids(&path), [0, 7, 2, 5, 0, 1, 2, 3]);
        let Ok(Mask::Colours(colours)) = Mask::load(&path, true) else { panic!("no colours") };
        assert_eq!(colours.get_pixel(1, 0).0, [21, 22, 23]);
        let path = dir.path().join("palette.tif");
        let colours = map(256);
        let tags: [(u16, u16, &[u64]); 2] = [(262, 3, &[3]), (320, 3, &colours)];
        std::fs::write(&path, file(true, false, (3, 2), 8, &tags, &[7, 8, 7, 0, 255, 1])).expect("writable");
        assert_eq!(ids(&path), [7, 8, 7, 0, 255, 1]);
        let mask = Mask::load(&path, true).expect("sound");
        assert_eq!((mask.size(), mask.value(1, 0)), ((3, 2), Value::Colour([247, 8, 0])));
    }

    #[test]
    fn formats_with_loss_are_refused_alike() {
        use base64::Engine;
        let dir = tempfile::tempdir().expect("a temporary folder");
        let webp = "UklGRiIAAABXRUJQVlA4IBYAAAAwAQCdASoBAAEADsD+JaQAA3AAAAAA";
        let webp = base64::engine::general_purpose::STANDARD.decode(webp).expect("base64");
        assert!(has_lossy_chunk(&webp[12..]) && !has_lossy_chunk(b"VP8L\x01\0\0\0x\0"));
        assert!(has_lossy_chunk(&[b"ANMF\x1a\0\0\0", &[0; 16][..], b"VP8 \x02\0\0\0xx"].concat()));
        assert!(!has_lossy_chunk(b"VP8X\xff\xff\xff\xff"));
        let tiff = crate::vision::tiff::tests::file(
            true,
            false,
            (3, 2),
            8,
            &[(259, 3, &[7]), (262, 3, &[1])],
            &[0; 6],
        );
        for (name, file) in [("mask.webp", webp), ("mask.tif", tiff)] {
            let path = dir.path().join(name);
            std::fs::write(&path, file).expect("writable");
            for colours in [false, true] {
                let error = Mask::load(&path, colours).expect_err("lossy").to_string();
                assert!(error.contains(name) && error.contains("with loss"), "{error}");
            }
        }
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
        for colours in [false, true] {
            assert!(Mask::load(&jpeg, colours).expect_err("lossy").to_string().contains("PNG"));
        }
    }
}
