//! Frames of a camera, one after the other: a stream on a pipe, a file, or a folder of images.
//!
//! ```text
//! Y4M, raw bytes, folder ── FrameSource ──> Frame ── Detector ──> rows
//!                                             │
//!                                             └─ Recorder ──> images to label
//! ```
//!
//! * [`y4m`]: YUV4MPEG2, what `ffmpeg -f yuv4mpegpipe` and mjpegtools write, read and written;
//! * [`raw`]: 8-bit gray frames without any header;
//! * [`folder`]: the images of a folder;
//! * [`feed`]: a source read by a thread of its own, of which only the newest frame counts if one wishes;
//! * [`record`]: some of the frames as images, to be labelled.
//!
//! A detector looks at the luma only, as it stands in the stream: 8 bits, and nothing is scaled or stretched. A
//! source reads each frame into memory that the caller gives it again and again.
//!
//! ```
//! use vsonar::frames::{Frame, FrameSource, raw::Raw};
//!
//! // Two frames of 16 x 16 pixels.
//! let bytes = [[7; 256], [9; 256]].concat();
//! let mut source = Raw::new(&bytes[..], "two frames", 16, 16)?;
//! let mut frame = Frame::default();
//! assert!(source.read(&mut frame)? && source.read(&mut frame)?);
//! assert_eq!((frame.index, frame.pixels.get_pixel(3, 3).0), (1, [9]));
//! assert!(!source.read(&mut frame)?, "that was all");
//! # Ok::<(), vsonar::frames::FrameError>(())
//! ```

pub mod feed;
pub mod folder;
mod rate;
pub mod raw;
pub mod record;
pub mod y4m;

use std::io::{self, ErrorKind, Read};
use std::time::Instant;

use image::GrayImage;
use vsonar_ir::Program;

pub use rate::Rate;

use crate::vision::ImageError;

/// A picture of a camera.
#[derive(Debug, Clone)]
pub struct Frame {
    /// The luma, 8 bits a pixel.
    pub pixels: GrayImage,
    /// The number of the frame in its source, from 0. Numbers of dropped frames are missing.
    pub index: u64,
    /// When the last byte of it had been read.
    pub arrived: Instant,
    /// Name of the image file, empty for a frame of a stream.
    pub name: String,
}

impl Default for Frame {
    /// An image without a pixel, for a source to read into.
    fn default() -> Frame {
        Frame { pixels: GrayImage::default(), index: 0, arrived: Instant::now(), name: String::new() }
    }
}

/// Where frames come from. All frames of a source have one size.
pub trait FrameSource: Send {
    /// Width of every frame, in pixels.
    fn width(&self) -> u32;

    /// Height of every frame, in pixels.
    fn height(&self) -> u32;

    /// Frames a second, if the source says so.
    fn rate(&self) -> Option<Rate> {
        None
    }

    /// Reads the next frame over what was in `frame`, and says whether there was one.
    ///
    /// # Errors
    /// If the frame cannot be read or is not whole. The source is not to be read again after that.
    fn read(&mut self, frame: &mut Frame) -> Result<bool, FrameError>;
}

impl<S: FrameSource + ?Sized> FrameSource for Box<S> {
    fn width(&self) -> u32 {
        (**self).width()
    }

    fn height(&self) -> u32 {
        (**self).height()
    }

    fn rate(&self) -> Option<Rate> {
        (**self).rate()
    }

    fn read(&mut self, frame: &mut Frame) -> Result<bool, FrameError> {
        (**self).read(frame)
    }
}

/// Why there is no further frame.
#[derive(Debug, thiserror::Error)]
#[error("{origin}{}: {fault}", .frame.map_or(String::new(), |number| format!(", frame {number}")))]
pub struct FrameError {
    /// The source, as it is called in messages: a path, or `standard input`.
    pub origin: String,
    /// The frame concerned, counted from 0; none if it is the source as a whole.
    pub frame: Option<u64>,
    /// What is wrong.
    #[source]
    pub fault: FrameFault,
}

/// What can be wrong with a source of frames.
#[derive(Debug, thiserror::Error)]
pub enum FrameFault {
    /// The system refuses to read.
    #[error("cannot be read: {0}")]
    Read(io::Error),
    /// A stream without a byte.
    #[error("there is nothing in it; does the program that should write it run?")]
    Empty,
    /// Not a Y4M stream.
    #[error(
        "is not a Y4M stream, which begins with YUV4MPEG2; write one with `ffmpeg -i INPUT -pix_fmt gray \
         -f yuv4mpegpipe -`, or give raw frames with `--format raw --size WxH`"
    )]
    NotY4m,
    /// The header of a Y4M stream makes no sense.
    #[error("the Y4M header {0}; the stream is damaged, write it anew")]
    Header(String),
    /// Samples of a Y4M stream that are not of 8 bits, or not in a layout known here.
    #[error(
        "its colour space is C{0}, but 8 bits a sample are read, as C420, C422, C444 or Cmono; give ffmpeg the \
         option `-pix_fmt gray` (or `-pix_fmt yuv420p`)"
    )]
    ColourSpace(String),
    /// A size that no detector can work with.
    #[error(
        "frames of {width}x{height} pixels: each side must have {} to {} pixels, and a frame {} million at most; \
         scale them, as ffmpeg does with `-vf scale=320:240`",
        Program::MIN_SIDE, Program::MAX_SIDE, MAX_PIXELS / 1_000_000
    )]
    Side {
        /// Width in pixels.
        width: u64,
        /// Height in pixels.
        height: u64,
    },
    /// A frame of a size that is not the first one's, or not the one asked for.
    #[error(
        "{width}x{height} pixels, where {expected_width}x{expected_height} are expected; scale it, as ffmpeg does \
         with `-vf scale={expected_width}:{expected_height}`"
    )]
    Size {
        /// Width of the frame in pixels.
        width: u32,
        /// Height of the frame in pixels.
        height: u32,
        /// The width it should have.
        expected_width: u32,
        /// The height it should have.
        expected_height: u32,
    },
    /// Something else stands where a frame of a Y4M stream should begin.
    #[error(
        "begins with `{0}` instead of FRAME; the stream is damaged, or its frames have another size than its \
         header says"
    )]
    FrameHeader(String),
    /// The stream ends within a frame.
    #[error(
        "the stream ends after {got} of its {expected} bytes; it was cut off, or the size of its frames is another one"
    )]
    Truncated {
        /// Bytes of the frame that are there.
        got: u64,
        /// Bytes of a whole frame.
        expected: u64,
    },
    /// An image file that cannot be used.
    #[error(transparent)]
    Image(Box<ImageError>),
    /// A folder without an image.
    #[error("there is no image in this folder; PNG, JPEG, PNM, BMP and others are known by their endings")]
    NoImages,
}

/// More pixels than any camera's frame has: what claims more is damaged, and no memory is asked for it.
pub const MAX_PIXELS: u64 = 100_000_000;

/// The sides, if there can be a detector for frames of this size.
fn checked_size(width: u64, height: u64) -> Result<(u32, u32), FrameFault> {
    match (u32::try_from(width), u32::try_from(height)) {
        (Ok(w), Ok(h)) if Program::fits(w, h) && width * height <= MAX_PIXELS => Ok((w, h)),
        _ => Err(FrameFault::Side { width, height }),
    }
}

/// Makes `image` one of this size, if it is not.
fn resize(image: &mut GrayImage, width: u32, height: u32) {
    if image.dimensions() != (width, height) {
        *image = GrayImage::new(width, height);
    }
}

/// Fills as much of `bytes` as there is to read, and says how much that is.
fn read_full(input: &mut impl Read, bytes: &mut [u8]) -> io::Result<usize> {
    let mut got = 0;
    while got < bytes.len() {
        match input.read(&mut bytes[got..]) {
            Ok(0) => break,
            Ok(more) => got += more,
            Err(error) if error.kind() == ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
    Ok(got)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_that_cannot_be_are_refused() {
        assert!(matches!(checked_size(320, 240), Ok((320, 240))));
        for (width, height) in [(15, 240), (320, 0), (65_537, 16), (65_536, 65_536), (u64::MAX, u64::MAX)] {
            let error = checked_size(width, height).expect_err("no such size").to_string();
            assert!(error.contains("16 to 65536") && error.contains("scale="), "{error}");
        }
    }

    #[test]
    fn errors_name_the_source_and_the_frame() {
        let fault = FrameFault::Truncated { got: 5, expected: 9 };
        let error = FrameError { origin: "a.y4m".into(), frame: Some(3), fault };
        assert!(error.to_string().starts_with("a.y4m, frame 3: the stream ends after 5 of its 9 bytes"));
        let error = FrameError { origin: "standard input".into(), frame: None, fault: FrameFault::NotY4m };
        assert!(error.to_string().starts_with("standard input: is not a Y4M stream"));
    }
}
