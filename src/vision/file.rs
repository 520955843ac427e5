//! Image files of every format: what their headers say, and their pixels.
//!
//! A header is read before any pixel, so that a small file which claims to hold an enormous image costs nothing.

use std::fs::File;
use std::io::{self, BufRead, BufReader, Cursor, Read, Seek};
use std::path::Path;

use image::metadata::Orientation;
use image::{ColorType, DynamicImage, GrayImage, ImageDecoder, ImageFormat, ImageReader, Limits};
use vsonar_ir::Program;

use super::error::{ImageError, MAX_BYTES};
use super::gray::{self, DecodedImage};
use super::{jpeg, tiff};
use crate::memory;

/// What the header of an image file says.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ImageHeader {
    /// Width in pixels, at least [`Program::MIN_SIDE`].
    pub width: u32,
    /// Height in pixels, at least [`Program::MIN_SIDE`].
    pub height: u32,
    /// Whether the file stores colour; its pixels may be gray all the same.
    pub stores_colour: bool,
    memory: u64,
}

impl ImageHeader {
    /// Reads the header of a file.
    ///
    /// # Errors
    /// If the file cannot be read, is no image, or is of a size that cannot be used.
    pub fn read(path: &Path) -> Result<ImageHeader, ImageError> {
        let (file, length) = open(path)?;
        Header::read(with_format(BufReader::new(file), path)?, length, path, || contents(path))?.usable(path)
    }

    /// Pixels of the image, which are the bytes of its gray.
    pub fn pixels(&self) -> u64 {
        u64::from(self.width) * u64::from(self.height)
    }

    /// Bytes that decoding the file takes at most, those of the gray image included.
    pub fn memory_needed(&self) -> u64 {
        self.memory
    }
}

/// The header of any image, whatever its size.
struct Header {
    format: ImageFormat,
    header: ImageHeader,
    /// Bytes of the decoded samples.
    samples: u64,
    float: bool,
}

impl Header {
    /// Reads the header of a file of so many bytes; `whole` gives all of them.
    fn read<R: BufRead + Seek>(
        mut reader: ImageReader<R>,
        length: u64,
        path: &Path,
        whole: impl FnOnce() -> Result<Vec<u8>, ImageError>,
    ) -> Result<Header, ImageError> {
        let failed = |error| ImageError::decoder(path, error);
        let format = reader.format().ok_or_else(|| ImageError::Format { path: path.into() })?;
        let of = |width: u32, height: u32, samples: u64, stores_colour: bool| {
            let pixels = u64::from(width) * u64::from(height);
            let samples = samples.saturating_mul(pixels);
            // Some decoders have the samples twice.
            let memory = length.saturating_add(samples.saturating_mul(2)).saturating_add(pixels);
            Header {
                format,
                header: ImageHeader { width, height, stores_colour, memory },
                samples,
                float: false,
            }
        };
        if format == ImageFormat::Jpeg {
            let (width, height, components) = jpeg::header(reader.into_inner()).map_err(failed)?;
            let mut header = of(width, height, components.into(), components > 1);
            // The file a second time with more data, the samples of both, and the coefficients of a progressive one.
            header.header.memory = (2 * length).saturating_add(4 * header.samples + header.header.pixels());
            return Ok(header);
        }
        reader.limits(limits());
        match reader.into_decoder() {
            Ok(decoder) => {
                let ((width, height), colour) = (decoder.dimensions(), decoder.color_type());
                let header = of(width, height, colour.bytes_per_pixel().into(), colour.has_color());
                let float = matches!(colour, ColorType::Rgb32F | ColorType::Rgba32F);
                Ok(Header { float, ..header })
            }
            // What the decoder refuses may be a palette, floating point, or of many bits.
            Err(image::ImageError::Unsupported(error)) if format == ImageFormat::Tiff => {
                let file = whole()?;
                let tags = tiff::Tags::read(&file);
                if let Some((_, (width, height))) =
                    tags.as_ref().and_then(|tags| Some((tags.palette()?, tags.size()?)))
                {
                    return Ok(of(width, height, 5, true));
                }
                if tags.as_ref().is_some_and(|tags| tags.is_float()) {
                    return Err(ImageError::Float { path: path.into() });
                }
                Err(match tags.and_then(|tags| tags.many_bits()) {
                    Some(bits) => ImageError::Deep { path: path.into(), bits },
                    None => failed(image::ImageError::Unsupported(error)),
                })
            }
            Err(error) => Err(failed(error)),
        }
    }

    /// What it says, if the image is of a size, and of samples, that can be used.
    fn usable(&self, path: &Path) -> Result<ImageHeader, ImageError> {
        let ImageHeader { width, height, memory, .. } = self.header;
        if width.min(height) < Program::MIN_SIDE {
            return Err(ImageError::TooSmall { path: path.into(), width, height });
        }
        if self.float && self.format == ImageFormat::Tiff {
            return Err(ImageError::Float { path: path.into() });
        }
        self.decodable(path)?;
        Ok(ImageHeader { memory, ..self.header })
    }

    /// Refuses what would take too much to decode.
    fn decodable(&self, path: &Path) -> Result<(), ImageError> {
        let ImageHeader { width, height, memory, .. } = self.header;
        if width.max(height) > Program::MAX_SIDE
            || self.samples > MAX_BYTES
            || memory > memory::default_limit()
        {
            return Err(ImageError::TooLarge { path: path.into(), width, height, memory });
        }
        Ok(())
    }
}

/// Reads an image file as 8-bit gray (see [`gray`]). The format is known by the content, or by the name's
/// extension where the content does not tell. Of an animation the first picture counts.
///
/// # Errors
/// If the file cannot be read or decoded, or a side is not in [`Program::MIN_SIDE`] to [`Program::MAX_SIDE`].
pub fn load(path: &Path) -> Result<DecodedImage, ImageError> {
    ImageHeader::read(path)?;
    decode(&contents(path)?, path)
}

/// The gray pixels alone.
///
/// # Errors
/// As [`load`].
pub fn load_gray(path: &Path) -> Result<GrayImage, ImageError> {
    Ok(load(path)?.pixels)
}

/// Decodes the bytes of an image file; `path` is what messages call it.
///
/// # Errors
/// As [`load`].
pub fn decode(bytes: &[u8], path: &Path) -> Result<DecodedImage, ImageError> {
    let header = header_of(bytes, path)?;
    header.usable(path)?;
    if header.format == ImageFormat::Jpeg {
        let picture = jpeg::decode(bytes).map_err(|error| ImageError::decoder(path, error))?;
        return match is_whole_jpeg(bytes, &picture) {
            true => Ok(picture.into_gray()),
            false => Err(ImageError::CutOff { path: path.into() }),
        };
    }
    Ok(gray::decoded(samples(bytes, path)?))
}

/// The same, the gray pixels alone.
///
/// # Errors
/// As [`load`].
pub fn decode_gray(bytes: &[u8], path: &Path) -> Result<GrayImage, ImageError> {
    Ok(decode(bytes, path)?.pixels)
}

fn header_of(bytes: &[u8], path: &Path) -> Result<Header, ImageError> {
    Header::read(with_format(Cursor::new(bytes), path)?, bytes.len() as u64, path, || Ok(bytes.to_vec()))
}

/// Decodes the bytes of an image file of any size within the limits, with the samples as they are stored; a palette is
/// applied.
pub(crate) fn samples(bytes: &[u8], path: &Path) -> Result<DynamicImage, ImageError> {
    let failed = |error| ImageError::decoder(path, error);
    let header = header_of(bytes, path)?;
    header.decodable(path)?;
    if header.format == ImageFormat::Tiff
        && let Some(palette) = tiff::Tags::read(bytes).and_then(|tags| tags.palette())
    {
        return palette.colours(bytes).map_err(failed);
    }
    let mut reader = with_format(Cursor::new(bytes), path)?;
    reader.limits(limits());
    reader.decode().map_err(failed)
}

/// The format of an image file that is not too large to be decoded, by its content or else its name.
pub(crate) fn checked_format(bytes: &[u8], path: &Path) -> Result<ImageFormat, ImageError> {
    let header = header_of(bytes, path)?;
    header.decodable(path)?;
    Ok(header.format)
}

fn with_format<R: BufRead + Seek>(reader: R, path: &Path) -> Result<ImageReader<R>, ImageError> {
    let mut reader =
        ImageReader::new(reader).with_guessed_format().map_err(|error| ImageError::io(path, error))?;
    if let (None, Ok(named)) = (reader.format(), ImageFormat::from_path(path)) {
        reader.set_format(named);
    }
    Ok(reader)
}

/// Opens a regular file that is not too long for an image, and tells its length. A pipe would be waited for.
fn open(path: &Path) -> Result<(File, u64), ImageError> {
    let failed = |error| ImageError::io(path, error);
    let about = path.metadata().map_err(failed)?;
    if !about.is_file() {
        return Err(failed(io::Error::new(io::ErrorKind::InvalidInput, "not a regular file")));
    }
    if about.len() > MAX_BYTES {
        return Err(ImageError::TooLong { path: path.into() });
    }
    Ok((File::open(path).map_err(failed)?, about.len()))
}

/// The bytes of an image file.
pub(crate) fn contents(path: &Path) -> Result<Vec<u8>, ImageError> {
    let (file, length) = open(path)?;
    let mut bytes = Vec::with_capacity(length as usize);
    // It may grow while it is read.
    file.take(MAX_BYTES).read_to_end(&mut bytes).map_err(|error| ImageError::io(path, error))?;
    Ok(bytes)
}

/// Whether a file has a tag that asks viewers to turn or mirror the picture. Detectors see it as it is stored, so what
/// somebody has marked in a viewer would not fit it. False if the file cannot be read.
pub fn is_turned(path: &Path) -> bool {
    orientation(path) != Orientation::NoTransforms
}

/// The orientation that a file's tag asks viewers to show the picture in; that in which it is stored if there is no tag,
/// or the file cannot be read.
pub fn orientation(path: &Path) -> Orientation {
    let tag = open(path).ok().and_then(|(file, _)| tagged(ImageReader::new(BufReader::new(file))));
    tag.unwrap_or(Orientation::NoTransforms)
}

/// A picture turned and mirrored as a tag asks.
pub fn upright(image: GrayImage, orientation: Orientation) -> GrayImage {
    let mut image = DynamicImage::ImageLuma8(image);
    image.apply_orientation(orientation);
    image.into_luma8()
}

/// Whether the bytes of an image file have such a tag.
pub fn is_turned_bytes(bytes: &[u8]) -> bool {
    tagged(ImageReader::new(Cursor::new(bytes))).is_some_and(|tag| tag != Orientation::NoTransforms)
}

/// The tag of a file, if it can be read.
fn tagged<R: BufRead + Seek>(reader: ImageReader<R>) -> Option<Orientation> {
    let mut reader = reader.with_guessed_format().ok()?;
    reader.limits(limits());
    reader.into_decoder().and_then(|mut decoder| decoder.orientation()).ok()
}

/// Whether a JPEG file holds all of the picture that the decoder made of it.
fn is_whole_jpeg(file: &[u8], picture: &jpeg::Samples) -> bool {
    let Some(end) = jpeg::picture_end(file) else { return false };
    // The decoder may refuse superfluous data; then the end marker has to do.
    jpeg::decode(&jpeg::with_more_data(file, end)).map_or(true, |again| again == *picture)
}

/// Limits for decoders; sizes are judged by their headers.
fn limits() -> Limits {
    let mut limits = Limits::no_limits();
    limits.max_alloc = Some(2 * MAX_BYTES);
    limits
}

#[cfg(test)]
mod tests {
    use super::super::tiff::tests::file;
    use super::*;

    fn error(bytes: &[u8]) -> (ImageError, String) {
        let error = decode(bytes, Path::new("a.tif")).expect_err("not usable");
        let text = error.to_string();
        assert!(text.starts_with("a.tif: "), "{text}");
        (error, text)
    }

    #[test]
    fn tiff_files_that_the_decoder_does_not_read() {
        // Floating point has no white, whether gray or in colour, of 16, 32 or 64 bits.
        for (bits, samples) in [(16, 1), (32, 1), (64, 1), (32, 3)] {
            let photometric = [if samples == 3 { 2 } else { 1 }];
            let samples = [samples];
            let tags: [(u16, u16, &[u64]); 3] = [(262, 3, &photometric), (277, 3, &samples), (339, 3, &[3])];
            let data = vec![0; 16 * 16 * (u64::from(bits) * samples[0] / 8) as usize];
            let (error, text) = error(&file(true, false, (16, 16), bits, &tags, &data));
            assert!(matches!(error, ImageError::Float { .. }), "{bits} bits, {samples:?} samples: {text}");
            assert!(text.contains("floating-point") && text.contains("8 or 16 bits"), "{text}");
        }
        // Whole numbers of 32 bits are not damage.
        let tags: [(u16, u16, &[u64]); 2] = [(262, 3, &[1]), (277, 3, &[1])];
        let (wrong, text) = error(&file(false, false, (16, 16), 32, &tags, &[0; 1024]));
        assert!(matches!(wrong, ImageError::Deep { bits: 32, .. }), "{text}");
        assert!(text.contains("whole numbers of 32 bits") && text.contains("8 or 16 bits"), "{text}");
        // A palette of two colours: red, and a gray.
        let map = [65_535, 25_700, 0, 25_700, 0, 25_700];
        let tags: [(u16, u16, &[u64]); 3] = [(262, 3, &[3]), (277, 3, &[1]), (320, 3, &map)];
        let whole = file(true, false, (16, 16), 1, &tags, &[0x55; 32]);
        let image = decode(&whole, Path::new("a.tif")).unwrap_or_else(|e| panic!("{e}"));
        let expected = |x: u32| if x.is_multiple_of(2) { 76 } else { 100 };
        assert!(image.has_colour);
        assert!(image.pixels.enumerate_pixels().all(|(x, _, pixel)| pixel.0[0] == expected(x)));
        let (cut, text) = error(&whole[..whole.len() - 20]);
        assert!(matches!(cut, ImageError::Decode { .. }), "{text}");
    }
}
