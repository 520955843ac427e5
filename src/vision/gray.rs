//! Image files to 8-bit gray.

use std::io::{self, BufRead, Cursor, Seek};
use std::path::{Path, PathBuf};

use image::metadata::Orientation;
use image::{DynamicImage, GrayImage, ImageDecoder, ImageFormat, ImageReader, Limits, Luma};
use vsonar_ir::Program;

use super::jpeg;

/// Most bytes that decoding one file may take: a small file may claim to hold an enormous image.
const MAX_BYTES: u64 = 512 << 20;

/// Why an image could not be used.
#[derive(Debug, thiserror::Error)]
pub enum ImageError {
    /// The file could not be opened or read at all.
    #[error("{}: {source}; check the path and the permissions", .path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// Neither the content nor the name's extension is that of a known format.
    #[error("{}: not an image of a known format; convert it to PNG", .path.display())]
    Format {
        /// The file.
        path: PathBuf,
    },
    /// The content is damaged, cut off, or of a kind of its format that is not supported.
    #[error(
        "{}: {}; the file is damaged, cut off or not what its name says: get it again, or convert it to PNG",
        .path.display(), one_line(.source)
    )]
    Decode {
        /// The file.
        path: PathBuf,
        /// What the decoder says.
        source: image::ImageError,
    },
    /// A JPEG file ends before its picture does.
    #[error("{}: the JPEG file is cut off, the rest of its picture would be gray; get it again", .path.display())]
    CutOff {
        /// The file.
        path: PathBuf,
    },
    /// The image is smaller than any detector can work with.
    #[error(
        "{}: {width}x{height} pixels are too few, at least {min}x{min} are needed; use a larger image",
        .path.display(), min = Program::MIN_SIDE
    )]
    TooSmall {
        /// The file.
        path: PathBuf,
        /// Its width in pixels.
        width: u32,
        /// Its height in pixels.
        height: u32,
    },
    /// The image has a side of more than [`Program::MAX_SIDE`] pixels, or decoding it would take more than
    /// 512 MiB.
    #[error(
        "{}: the image is too large, the limits are {max} pixels a side and {} MiB decoded; scale it down",
        .path.display(), MAX_BYTES >> 20, max = Program::MAX_SIDE
    )]
    TooLarge {
        /// The file.
        path: PathBuf,
    },
}

/// What a decoder says, which may be several lines.
fn one_line(error: &image::ImageError) -> String {
    error.to_string().split_whitespace().collect::<Vec<_>>().join(" ")
}

/// Reads an image file as 8-bit gray (see [`to_gray`]). The format is known by the content, or by the name's
/// extension where the content does not tell. Of an animation the first picture counts.
///
/// # Errors
/// If the file cannot be read or decoded, or a side is not in [`Program::MIN_SIDE`] to [`Program::MAX_SIDE`].
pub fn load_gray(path: &Path) -> Result<GrayImage, ImageError> {
    let io = |source| ImageError::Io { path: path.to_owned(), source };
    let reader = ImageReader::open(path).map_err(io)?.with_guessed_format().map_err(io)?;
    decode(reader, path, || std::fs::read(path))
}

/// The same from the bytes of an image file; `path` is what messages call it.
///
/// # Errors
/// As [`load_gray`].
pub fn decode_gray(bytes: &[u8], path: &Path) -> Result<GrayImage, ImageError> {
    let io = |source| ImageError::Io { path: path.to_owned(), source };
    let reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format().map_err(io)?;
    decode(reader, path, || Ok(bytes.to_vec()))
}

/// Whether a file has a tag that asks viewers to turn or mirror the picture. Detectors see it as it is stored, so what
/// somebody has marked in a viewer would not fit it. False if the file cannot be read.
pub fn is_turned(path: &Path) -> bool {
    ImageReader::open(path).is_ok_and(asks_to_be_turned)
}

/// The same of the bytes of an image file.
pub fn is_turned_bytes(bytes: &[u8]) -> bool {
    asks_to_be_turned(ImageReader::new(Cursor::new(bytes)))
}

fn asks_to_be_turned<R: BufRead + Seek>(reader: ImageReader<R>) -> bool {
    let Ok(mut reader) = reader.with_guessed_format() else { return false };
    reader.limits(limits());
    let orientation = reader.into_decoder().and_then(|mut decoder| decoder.orientation());
    orientation.is_ok_and(|orientation| orientation != Orientation::NoTransforms)
}

/// Decodes what the reader holds; `whole` gives all of its bytes.
fn decode<R: BufRead + Seek>(
    mut reader: ImageReader<R>,
    path: &Path,
    whole: impl FnOnce() -> io::Result<Vec<u8>>,
) -> Result<GrayImage, ImageError> {
    let io = |source| ImageError::Io { path: path.to_owned(), source };
    let Some(format) = reader.format() else {
        return Err(ImageError::Format { path: path.to_owned() });
    };
    reader.limits(limits());
    let image = reader.decode().map_err(|source| match source {
        image::ImageError::Limits(_) => ImageError::TooLarge { path: path.to_owned() },
        source => ImageError::Decode { path: path.to_owned(), source },
    })?;
    let (width, height) = (image.width(), image.height());
    if width.min(height) < Program::MIN_SIDE {
        return Err(ImageError::TooSmall { path: path.to_owned(), width, height });
    }
    // Not every decoder heeds the limits.
    if width.max(height) > Program::MAX_SIDE {
        return Err(ImageError::TooLarge { path: path.to_owned() });
    }
    if format == ImageFormat::Jpeg && !is_whole_jpeg(&whole().map_err(io)?, &image) {
        return Err(ImageError::CutOff { path: path.to_owned() });
    }
    Ok(to_gray(image))
}

/// Whether a JPEG file holds all of the picture that the decoder made of it.
fn is_whole_jpeg(file: &[u8], image: &DynamicImage) -> bool {
    let Some(end) = jpeg::picture_end(file) else { return false };
    let more = Cursor::new(jpeg::with_more_data(file, end));
    let mut reader = ImageReader::with_format(more, ImageFormat::Jpeg);
    reader.limits(limits());
    // The decoder may refuse superfluous data; then the end marker has to do.
    reader.decode().map_or(true, |again| again == *image)
}

/// What decoding one file may take.
fn limits() -> Limits {
    let mut limits = Limits::default();
    limits.max_image_width = Some(Program::MAX_SIDE);
    limits.max_image_height = Some(Program::MAX_SIDE);
    limits.max_alloc = Some(MAX_BYTES);
    limits
}

/// An image as 8-bit gray: colour as [`DynamicImage::to_luma8`] converts it, 16 bits as (v + 128) / 257, of
/// 16-bit colour the 16-bit luma. Floating-point images go from 0.0 and 1.0 to 0 and 255 and are clamped. Alpha
/// and orientation tags are ignored.
///
/// ```
/// use image::{DynamicImage, ImageBuffer, Luma};
/// use vsonar::vision::to_gray;
///
/// let deep = ImageBuffer::from_fn(16, 16, |x, _| Luma([x as u16 * 257 + 129]));
/// assert_eq!(to_gray(DynamicImage::ImageLuma16(deep)).get_pixel(7, 0).0, [8]);
/// ```
pub fn to_gray(image: DynamicImage) -> GrayImage {
    match image {
        DynamicImage::ImageLuma16(_)
        | DynamicImage::ImageLumaA16(_)
        | DynamicImage::ImageRgb16(_)
        | DynamicImage::ImageRgba16(_) => {
            let deep = image.into_luma16();
            GrayImage::from_fn(deep.width(), deep.height(), |x, y| {
                Luma([((u32::from(deep.get_pixel(x, y).0[0]) + 128) / 257) as u8])
            })
        }
        shallow => shallow.into_luma8(),
    }
}
