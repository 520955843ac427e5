//! What can be wrong with an image file.

use std::path::{Path, PathBuf};

use crate::support::printable::ShownPath as _;
use vsonar_ir::Program;

/// Most bytes of an image file, and most that decoding one may take: a small file may claim to hold an enormous image.
pub(crate) const MAX_BYTES: u64 = 512 << 20;

/// Why an image could not be used.
#[derive(Debug, thiserror::Error)]
pub enum ImageError {
    /// The file could not be opened or read at all.
    #[error("{}: {source}; check the path and the permissions", .path.shown())]
    Io {
        /// The file.
        path: PathBuf,
        /// The system's error.
        source: std::io::Error,
    },
    /// Neither the content nor the name's extension is that of a known format.
    #[error("{}: not an image of a known format; convert it to PNG", .path.shown())]
    Format {
        /// The file.
        path: PathBuf,
    },
    /// The content is damaged or cut off.
    #[error(
        "{}: {}; the file is damaged, cut off or not what its name says: get it again, or convert it to PNG",
        .path.shown(), one_line(.source)
    )]
    Decode {
        /// The file.
        path: PathBuf,
        /// The decoder's error.
        source: image::ImageError,
    },
    /// The image is of a kind of its format that is not supported.
    #[error("{}: {}; convert it to PNG with 8 or 16 bits", .path.shown(), one_line(.source))]
    Unsupported {
        /// The file.
        path: PathBuf,
        /// The decoder's error.
        source: image::ImageError,
    },
    /// The samples of a TIFF file are whole numbers of more than 16 bits.
    #[error(
        "{}: the samples are whole numbers of {bits} bits, and only those of up to 16 are read; save the image with 8 or \
         16 bits",
        .path.shown()
    )]
    Deep {
        /// The file.
        path: PathBuf,
        /// Bits of a sample.
        bits: u64,
    },
    /// A TIFF file holds floating-point samples, for which the format does not define white.
    #[error(
        "{}: the samples are floating-point numbers, and TIFF does not say which of them is white; scale them and save \
         the image with 8 or 16 bits",
        .path.shown()
    )]
    Float {
        /// The file.
        path: PathBuf,
    },
    /// A JPEG file ends before its picture does.
    #[error("{}: the JPEG file is cut off, the rest of its picture would be gray; get it again", .path.shown())]
    CutOff {
        /// The file.
        path: PathBuf,
    },
    /// The image is smaller than any detector can work with.
    #[error(
        "{}: {width}x{height} pixels are too few, at least {min}x{min} are needed; use a larger image",
        .path.shown(), min = Program::MIN_SIDE
    )]
    TooSmall {
        /// The file.
        path: PathBuf,
        /// Its width in pixels.
        width: u32,
        /// Its height in pixels.
        height: u32,
    },
    /// The image has a side of more than [`Program::MAX_SIDE`] pixels, its decoded samples are more than 512 MiB, or
    /// decoding it would take more memory than [`default_limit`](crate::memory::default_limit).
    #[error(
        "{}: {width}x{height} pixels are too many: decoding takes {} MiB, and the limits are {max} pixels a side, {} MiB \
         of samples, and three quarters of the memory; scale the image down",
        .path.shown(), .memory.div_ceil(1 << 20), MAX_BYTES >> 20, max = Program::MAX_SIDE
    )]
    TooLarge {
        /// The file.
        path: PathBuf,
        /// Its width in pixels.
        width: u32,
        /// Its height in pixels.
        height: u32,
        /// Bytes that decoding takes.
        memory: u64,
    },
    /// The file is longer than 512 MiB, or its decoder needs more than that.
    #[error(
        "{}: the file, or what reading it takes, is larger than {} MiB; scale the image down",
        .path.shown(), MAX_BYTES >> 20
    )]
    TooLong {
        /// The file.
        path: PathBuf,
    },
}

impl ImageError {
    pub(super) fn io(path: &Path, source: std::io::Error) -> ImageError {
        ImageError::Io { path: path.into(), source }
    }

    pub(super) fn decoder(path: &Path, source: image::ImageError) -> ImageError {
        let path = path.into();
        match source {
            image::ImageError::Limits(_) => ImageError::TooLong { path },
            image::ImageError::Unsupported(_) => ImageError::Unsupported { path, source },
            source => ImageError::Decode { path, source },
        }
    }
}

/// A decoder's message, which may be several lines.
fn one_line(error: &image::ImageError) -> String {
    error.to_string().split_whitespace().collect::<Vec<_>>().join(" ")
}
