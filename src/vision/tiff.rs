//! The tags of a TIFF file's first picture (TIFF 6.0, sections 2 and 8; BigTIFF), and pictures with a palette, which the
//! decoder does not read.

use std::io::Cursor;

use image::error::{DecodingError, ImageFormatHint};
use image::{DynamicImage, ImageError, ImageFormat, ImageReader, Rgb, RgbImage};

use super::error::MAX_BYTES;
use super::gray::of_sixteen;

const WIDTH: u16 = 256;
const HEIGHT: u16 = 257;
const BITS: u16 = 258;
const COMPRESSION: u16 = 259;
const PHOTOMETRIC: u16 = 262;
const COLOUR_MAP: u16 = 320;
const TILE_WIDTH: u16 = 322;
const SAMPLE_FORMAT: u16 = 339;

/// A tag: its number, and the place and width in bytes of its values.
#[derive(Debug, Clone, Copy)]
struct Entry {
    tag: u16,
    size: usize,
    count: usize,
    at: usize,
}

/// The tags of the first picture of a file.
#[derive(Debug)]
pub(crate) struct Tags<'f> {
    file: &'f [u8],
    little: bool,
    entries: Vec<Entry>,
}

impl<'f> Tags<'f> {
    /// Reads the tags; none if this is no TIFF file.
    pub(crate) fn read(file: &'f [u8]) -> Option<Tags<'f>> {
        let little = match file.get(..2)? {
            b"II" => true,
            b"MM" => false,
            _ => return None,
        };
        let mut tags = Tags { file, little, entries: Vec::new() };
        let (start, count, header, length, inline) = match tags.number(2, 2)? {
            42 => {
                let start = tags.number(4, 4)? as usize;
                (start, tags.number(start, 2)?, 2, 12, 4)
            }
            43 => {
                let start = usize::try_from(tags.number(8, 8)?).ok()?;
                (start, tags.number(start, 8)?, 8, 20, 8)
            }
            _ => return None,
        };
        for i in 0..usize::try_from(count).ok()?.min(file.len() / length) {
            let entry = start.checked_add(header + i * length)?;
            let (tag, kind) = (tags.number(entry, 2)? as u16, tags.number(entry + 2, 2)?);
            let size = match kind {
                1 => 1,
                3 => 2,
                4 => 4,
                16 => 8,
                _ => continue,
            };
            let count = usize::try_from(tags.number(entry + 4, inline)?).ok()?;
            let value = entry + 4 + inline;
            let at = match count.checked_mul(size)? <= inline {
                true => value,
                false => usize::try_from(tags.number(value, inline)?).ok()?,
            };
            tags.entries.push(Entry { tag, size, count, at });
        }
        Some(tags)
    }

    /// A number of so many bytes in the file's order.
    fn number(&self, at: usize, bytes: usize) -> Option<u64> {
        let bytes = self.file.get(at..at.checked_add(bytes)?)?;
        let push = |number: u64, &byte: &u8| number << 8 | u64::from(byte);
        Some(if self.little { bytes.iter().rev().fold(0, push) } else { bytes.iter().fold(0, push) })
    }

    fn entry(&self, tag: u16) -> Option<Entry> {
        self.entries.iter().find(|entry| entry.tag == tag).copied()
    }

    /// The first value of a tag.
    fn value(&self, tag: u16) -> Option<u64> {
        let entry = self.entry(tag).filter(|entry| entry.count > 0)?;
        self.number(entry.at, entry.size)
    }

    /// Width and height in pixels.
    pub(super) fn size(&self) -> Option<(u32, u32)> {
        let side = |tag| self.value(tag).and_then(|side| u32::try_from(side).ok());
        Some((side(WIDTH)?, side(HEIGHT)?))
    }

    /// Whether the samples are floating-point numbers.
    pub(super) fn is_float(&self) -> bool {
        self.value(SAMPLE_FORMAT) == Some(3)
    }

    /// Bits of a sample, if there are more than the decoder gives for whole numbers.
    pub(super) fn many_bits(&self) -> Option<u64> {
        self.value(BITS).filter(|&bits| bits > 16)
    }

    /// Whether the compression changes samples: JPEG of either kind, JPEG 2000, lossy WebP and JPEG XL.
    pub(crate) fn is_lossy(&self) -> bool {
        matches!(self.value(COMPRESSION), Some(6 | 7 | 34_712 | 34_892 | 50_001 | 50_002 | 52_546))
    }

    /// The palette, if the samples are numbers of its colours.
    pub(crate) fn palette(&self) -> Option<Palette> {
        if self.value(PHOTOMETRIC)? != 3 {
            return None;
        }
        let bits = self.value(BITS).unwrap_or(1);
        let map = self.entry(COLOUR_MAP)?;
        if !matches!(bits, 1 | 2 | 4 | 8 | 16) || map.size != 2 || map.count < 3 << bits {
            return None;
        }
        let colours = 1usize << bits;
        // All of red first, then green, then blue.
        let level = |i: usize| Some(of_sixteen(self.number(map.at.checked_add(2 * i)?, 2)? as u16));
        let colour = |i| Some([level(i)?, level(colours + i)?, level(2 * colours + i)?]);
        let colours = (0..colours).map(colour).collect::<Option<Vec<_>>>()?;
        Some(Palette { bits: bits as u32, size: self.size()?, colours })
    }

    /// The file with another first value of a tag; as it is, if it does not have the tag.
    fn set(&self, file: &mut [u8], tag: u16, value: u64) {
        let Some(Entry { size, at, .. }) = self.entry(tag) else { return };
        let Some(place) = file.get_mut(at..at.saturating_add(size)) else { return };
        let bytes = value.to_be_bytes();
        place.copy_from_slice(&bytes[bytes.len() - size..]);
        if self.little {
            place.reverse();
        }
    }
}

/// A picture of numbered colours.
#[derive(Debug)]
pub(crate) struct Palette {
    bits: u32,
    size: (u32, u32),
    colours: Vec<[u8; 3]>,
}

impl Palette {
    /// Width and height in pixels.
    pub(crate) fn size(&self) -> (u32, u32) {
        self.size
    }

    /// The numbers as they are stored, row by row. The decoder gets them as the gray levels that they would be without
    /// the palette; those of fewer than 8 bits as the bytes that they share.
    pub(crate) fn numbers(&self, file: &[u8]) -> Result<Vec<u16>, ImageError> {
        let mut gray = file.to_vec();
        if let Some(tags) = Tags::read(file) {
            tags.set(&mut gray, PHOTOMETRIC, 1);
            if self.bits < 8 {
                tags.set(&mut gray, BITS, 8);
                for side in [WIDTH, TILE_WIDTH] {
                    let packed = tags.value(side).map(|side| (side * u64::from(self.bits)).div_ceil(8));
                    packed.into_iter().for_each(|packed| tags.set(&mut gray, side, packed));
                }
            }
        }
        let mut reader = ImageReader::with_format(Cursor::new(gray), ImageFormat::Tiff);
        let mut limits = image::Limits::no_limits();
        limits.max_alloc = Some(2 * MAX_BYTES);
        reader.limits(limits);
        let decoded = reader.decode()?;
        let (width, height) = self.size;
        let packed = (u64::from(width) * u64::from(self.bits.min(8))).div_ceil(8);
        if (u64::from(decoded.width()), decoded.height()) != (packed, height) {
            // Tags that are there twice, or of strange types.
            return Err(ImageError::Decoding(DecodingError::new(
                ImageFormatHint::Exact(ImageFormat::Tiff),
                "its size is not clear",
            )));
        }
        if self.bits == 16 {
            return Ok(decoded.into_luma16().into_raw());
        }
        let decoded = decoded.into_luma8();
        let (across, mask) = (8 / self.bits, ((1u32 << self.bits) - 1) as u8);
        let mut numbers = Vec::with_capacity(width as usize * height as usize);
        for row in decoded.as_raw().chunks_exact(decoded.width().max(1) as usize) {
            // The first pixel is in the highest bits.
            let number = |x: u32| row[(x / across) as usize] >> (8 - self.bits * (x % across + 1)) & mask;
            numbers.extend((0..width).map(|x| u16::from(number(x))));
        }
        Ok(numbers)
    }

    /// The picture in its colours.
    pub(crate) fn colours(&self, file: &[u8]) -> Result<DynamicImage, ImageError> {
        let numbers = self.numbers(file)?;
        let mut image = RgbImage::new(self.size.0, self.size.1);
        for (pixel, &number) in image.pixels_mut().zip(&numbers) {
            *pixel = Rgb(self.colours[usize::from(number)]);
        }
        Ok(DynamicImage::ImageRgb8(image))
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// An uncompressed TIFF file of one strip, classic or of 64 bits, with these samples in either order of bytes.
    pub(crate) fn file(
        little: bool,
        big: bool,
        (width, height): (u32, u32),
        bits: u32,
        more: &[(u16, u16, &[u64])],
        data: &[u8],
    ) -> Vec<u8> {
        let number = |value: u64, size: usize| {
            let bytes = value.to_be_bytes()[8 - size..].to_vec();
            if little { bytes.into_iter().rev().collect() } else { bytes }
        };
        let word = if big { 8 } else { 4 };
        let mut out = if little { b"II".to_vec() } else { b"MM".to_vec() };
        out.extend(number(if big { 43 } else { 42 }, 2));
        if big {
            out.extend([number(8, 2), number(0, 2)].concat());
        }
        let start = (out.len() + word) as u64;
        let (size, length) = ([u64::from(width), u64::from(height)], data.len() as u64);
        let mut entries: Vec<(u16, u16, &[u64])> =
            vec![(WIDTH, 4, &size[..1]), (HEIGHT, 4, &size[1..]), (278, 4, &size[1..]), (273, 4, &[0])];
        let (bits, lengths) = ([u64::from(bits)], [length]);
        entries.extend([(BITS, 3, &bits[..]), (COMPRESSION, 3, &[1]), (279, 4, &lengths[..])]);
        entries.retain(|(tag, ..)| more.iter().all(|(other, ..)| other != tag));
        entries.extend(more);
        entries.sort();
        let header = if big { 8 } else { 2 };
        let mut extra_at = start + (header + entries.len() * (4 + 2 * word) + word) as u64;
        let mut extra: Vec<u8> = Vec::new();
        out.extend(number(start, word));
        out.extend(number(entries.len() as u64, header));
        let mut strip = 0;
        for (tag, kind, values) in entries {
            let size = match kind {
                3 => 2,
                4 => 4,
                _ => 8,
            };
            out.extend(
                [number(tag.into(), 2), number(kind.into(), 2), number(values.len() as u64, word)].concat(),
            );
            let bytes: Vec<u8> = values.iter().flat_map(|&value| number(value, size)).collect();
            if tag == 273 {
                strip = out.len();
            }
            if bytes.len() <= word {
                out.extend(&bytes);
                out.resize(out.len() + word - bytes.len(), 0);
            } else {
                out.extend(number(extra_at, word));
                extra_at += bytes.len() as u64;
                extra.extend(bytes);
            }
        }
        out.extend(vec![0; word]);
        out.extend(extra);
        let at = out.len() as u64;
        out[strip..strip + 4].copy_from_slice(&number(at, 4));
        out.extend(data);
        out
    }

    /// Red of 257 times a ramp that falls, green of one that rises, no blue.
    pub(crate) fn map(colours: u64) -> Vec<u64> {
        let ramp = 0..colours;
        ramp.clone()
            .rev()
            .map(|i| 257 * i)
            .chain(ramp.map(|i| 257 * i))
            .chain(vec![0; colours as usize])
            .collect()
    }

    #[test]
    fn palettes_are_read_in_every_layout() {
        for (little, big) in [(true, false), (false, false), (true, true), (false, true)] {
            for (bits, data, numbers) in [
                (8u32, &[7, 15, 10, 0, 255, 1][..], [7, 15, 10, 0, 255, 1]),
                (4, &[0x7f, 0xa0, 0x0e, 0x10], [7, 15, 10, 0, 14, 1]),
                (2, &[0b1101_0000, 0b0010_1100], [3, 1, 0, 0, 2, 3]),
                (1, &[0b1010_0000, 0b0110_0000], [1, 0, 1, 0, 1, 1]),
            ] {
                let map = map(1 << bits);
                let more: [(u16, u16, &[u64]); 2] = [(PHOTOMETRIC, 3, &[3]), (COLOUR_MAP, 3, &map)];
                let file = file(little, big, (3, 2), bits, &more, data);
                let palette = Tags::read(&file).and_then(|tags| tags.palette()).expect("a palette");
                assert_eq!(palette.size(), (3, 2));
                assert_eq!(palette.numbers(&file).expect("sound"), numbers, "{bits} bits, {little} {big}");
                let colours = palette.colours(&file).expect("sound").into_rgb8();
                let last = (1u16 << bits) - 1;
                let expected = numbers.map(|number| [(last - number) as u8, number as u8, 0]);
                assert!(colours.pixels().map(|pixel| pixel.0).eq(expected), "{bits} bits");
            }
        }
    }

    #[test]
    fn tags_of_anything_can_be_asked_for() {
        let map = map(16);
        let more: [(u16, u16, &[u64]); 2] = [(PHOTOMETRIC, 3, &[3]), (COLOUR_MAP, 3, &map)];
        let whole = file(true, false, (3, 2), 4, &more, &[0x7f, 0xa0, 0x0e, 0x10]);
        for length in 0..whole.len() {
            if let Some(palette) = Tags::read(&whole[..length]).and_then(|tags| tags.palette()) {
                // What is cut off cannot be decoded, but for what follows the picture.
                let _ = palette.numbers(&whole[..length]);
            }
        }
        // Every byte of the header and the tags with extreme values.
        for at in 0..whole.len() {
            for byte in [0, 1, 0x7f, 0xff] {
                let mut file = whole.clone();
                file[at] = byte;
                if let Some(tags) = Tags::read(&file) {
                    let _ = (tags.is_float(), tags.is_lossy(), tags.size());
                    let fits = |palette: &Palette| palette.size().0 <= 256 && palette.size().1 <= 256;
                    let _ = tags.palette().filter(fits).map(|palette| palette.numbers(&file));
                }
            }
        }
        assert!(
            Tags::read(b"").is_none() && Tags::read(b"II").is_none() && Tags::read(&[0xff; 64]).is_none()
        );
    }

    #[test]
    fn floating_point_and_lossy_compression_are_known() {
        let data = [0; 24];
        let with = |more: &[(u16, u16, &[u64])]| file(true, false, (3, 2), 32, more, &data);
        let tags = |file: &[u8]| Tags::read(file).map(|tags| (tags.is_float(), tags.is_lossy()));
        assert_eq!(tags(&with(&[(PHOTOMETRIC, 3, &[1])])), Some((false, false)));
        assert_eq!(tags(&with(&[(PHOTOMETRIC, 3, &[1]), (SAMPLE_FORMAT, 3, &[3])])), Some((true, false)));
        for (compression, lossy) in [(1, false), (5, false), (7, true), (8, false), (34_712, true)] {
            assert_eq!(
                tags(&with(&[(COMPRESSION, 3, &[compression])])),
                Some((false, lossy)),
                "{compression}"
            );
        }
    }
}
