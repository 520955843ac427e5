//! JPEG files: their own luma, and where their pictures end.
//!
//! Most JPEG files store Y'CbCr, and their Y' is the gray of BT.601 that a detector wants, before any rounding to RGB.
//! The decoder is therefore asked for what is stored.
//!
//! It also goes without the end of a picture, and fills what is missing with gray, which would train detectors on
//! pictures that no camera took. Whether a file is whole is found here, by its markers (ITU-T T.81, annex B).

use std::io::{BufRead, Cursor, Seek};

use image::error::{DecodingError, ImageFormatHint, UnsupportedError, UnsupportedErrorKind};
use image::{GrayImage, ImageError, ImageFormat};
use zune_jpeg::JpegDecoder;
use zune_jpeg::errors::DecodeErrors;
use zune_jpeg::zune_core::colorspace::ColorSpace;
use zune_jpeg::zune_core::options::DecoderOptions;

use super::gray::{DecodedImage, luma};

/// Width, height and samples a pixel of a picture, without decoding it.
pub(super) fn header(file: impl BufRead + Seek) -> Result<(u32, u32, u32), ImageError> {
    let mut decoder = JpegDecoder::new_with_options(file, options());
    decoder.decode_headers().map_err(failed)?;
    let info = decoder.info().ok_or_else(|| failed(DecodeErrors::FormatStatic("no picture")))?;
    Ok((info.width.into(), info.height.into(), info.components.into()))
}

/// Decodes a picture.
pub(super) fn decode(file: &[u8]) -> Result<Samples, ImageError> {
    let mut decoder = JpegDecoder::new_with_options(Cursor::new(file), options());
    decoder.decode_headers().map_err(failed)?;
    let stored = decoder.input_colorspace().unwrap_or(ColorSpace::Unknown);
    let space = match stored {
        ColorSpace::Luma | ColorSpace::YCbCr | ColorSpace::RGB => stored,
        _ => ColorSpace::RGB,
    };
    decoder.set_options(decoder.options().jpeg_set_out_colorspace(space));
    let samples = decoder.decode().map_err(failed)?;
    let (width, height) = decoder.dimensions().unwrap_or_default();
    Ok(Samples { width: width as u32, height: height as u32, space, samples })
}

fn options() -> DecoderOptions {
    // Sizes are judged by the caller.
    DecoderOptions::default().set_strict_mode(false).set_max_width(usize::MAX).set_max_height(usize::MAX)
}

fn failed(error: DecodeErrors) -> ImageError {
    let jpeg = ImageFormatHint::Exact(ImageFormat::Jpeg);
    match error {
        DecodeErrors::Unsupported(kind) => {
            let kind = UnsupportedErrorKind::GenericFeature(format!("{kind:?}"));
            ImageError::Unsupported(UnsupportedError::from_format_and_kind(jpeg, kind))
        }
        error => ImageError::Decoding(DecodingError::new(jpeg, error)),
    }
}

/// A decoded picture: the samples of each pixel one after the other, in gray, Y'CbCr or RGB.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Samples {
    width: u32,
    height: u32,
    space: ColorSpace,
    samples: Vec<u8>,
}

impl Samples {
    /// The picture in gray: its own luma where it has one.
    pub(super) fn into_gray(self) -> DecodedImage {
        let Samples { width, height, space, samples } = self;
        let triples = samples.as_chunks::<3>().0;
        let (gray, has_colour) = match space {
            ColorSpace::YCbCr => (
                triples.iter().map(|&[y, _, _]| y).collect(),
                triples.iter().any(|&[_, blue, red]| (blue, red) != (128, 128)),
            ),
            ColorSpace::RGB => (
                triples.iter().map(|&[red, green, blue]| luma(red, green, blue)).collect(),
                triples.iter().any(|&[red, green, blue]| red != green || green != blue),
            ),
            _ => (samples, false),
        };
        let pixels = GrayImage::from_raw(width, height, gray).unwrap_or_default();
        DecodedImage { pixels, has_colour }
    }
}

/// The code of a marker, the byte behind FF.
mod code {
    /// Start of image.
    pub(super) const SOI: u8 = 0xd8;
    /// End of image.
    pub(super) const EOI: u8 = 0xd9;
    /// Start of scan.
    pub(super) const SOS: u8 = 0xda;
}

/// Whether a code is part of the data of a scan: an escaped FF, or a restart marker.
fn is_data(code: u8) -> bool {
    matches!(code, 0x00 | 0xd0..=0xd7)
}

/// Whether a segment may stand between the scans of a picture: tables, the number of lines, a further scan,
/// application data, comments.
fn is_between_scans(code: u8) -> bool {
    matches!(code, 0xc4 | 0xcc | 0xda..=0xdd | 0xe0..=0xef | 0xfe)
}

/// The position of the first end marker that belongs to the picture itself (with the fill bytes before it), or
/// `None` if the data end before, or something else begins in the middle of a scan. What follows the end marker
/// is of no account: phones append films, and other programs what they like.
///
/// The time is proportional to the number of bytes, whatever they are.
pub(super) fn picture_end(file: &[u8]) -> Option<usize> {
    let mut scan = false;
    let mut at = file.starts_with(&[0xff, code::SOI]).then_some(2)?;
    loop {
        // The decoder passes over bytes between segments, and so does this.
        let start = at + file[at..].iter().position(|&byte| byte == 0xff)?;
        let last = start + file[start..].iter().position(|&byte| byte != 0xff)?;
        at = last + 1;
        match file[last] {
            code if is_data(code) => {}
            code::EOI => return scan.then_some(start),
            code if scan && !is_between_scans(code) => return None,
            // Markers without a length, in places where they mean nothing.
            0x01 | code::SOI => {}
            code => {
                let length = file.get(at..at + 2)?;
                let length = usize::from(u16::from_be_bytes([length[0], length[1]]));
                // The length counts its own two bytes.
                at += length.max(2);
                if at > file.len() {
                    return None;
                }
                scan |= code == code::SOS;
            }
        }
    }
}

/// Bytes that continue a scan without a marker, and differently from the zero bits that the decoder reads
/// behind its end.
const FILLER: [u8; 64] = {
    let mut bytes = [0; 64];
    let mut i = 0;
    while i < bytes.len() {
        bytes[i] = [0xa5, 0x5b, 0x96, 0x6d][i % 4];
        i += 1;
    }
    bytes
};

/// The same picture with more data in its last scan than it has blocks for. A picture that is whole does not
/// change by it; one whose data end too early does, even where an end marker was put behind them.
pub(super) fn with_more_data(file: &[u8], end: usize) -> Vec<u8> {
    [&file[..end], &FILLER, &[0xff, code::EOI]].concat()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A scan of two bytes of data.
    const SCAN: [u8; 8] = [0xff, 0xda, 0, 4, 7, 7, 0x12, 0x34];

    fn end(parts: &[&[u8]]) -> Option<usize> {
        picture_end(&[&[0xff, 0xd8], &parts.concat()[..]].concat())
    }

    #[test]
    fn the_first_end_outside_of_segments_counts() {
        let eoi: &[u8] = &[0xff, 0xd9];
        assert_eq!(end(&[&SCAN, eoi]), Some(10));
        assert_eq!(end(&[&SCAN, eoi, &SCAN, eoi, &[0xff, 0xda]]), Some(10));
        // A thumbnail within a segment has an end of its own.
        let thumbnail: &[u8] = &[0xff, 0xe1, 0, 6, 0xff, 0xd8, 0xff, 0xd9];
        assert_eq!(end(&[thumbnail, &SCAN, eoi]), Some(18));
        assert_eq!(end(&[thumbnail, &SCAN]), None);
        // Escaped bytes, restarts, fill bytes.
        assert_eq!(end(&[&SCAN, &[0xff, 0, 0xff, 0xd3, 0xff, 0xff, 0xd7, 1], eoi]), Some(18));
        assert_eq!(end(&[&SCAN, &[0xff, 0xff], eoi]), Some(10), "fill bytes belong to the marker");
        // Several scans with tables between them.
        assert_eq!(end(&[&SCAN, &[0xff, 0xc4, 0, 4, 0xff, 0xd9], &SCAN, eoi]), Some(24));
    }

    #[test]
    fn what_is_no_picture_has_no_end() {
        let eoi: &[u8] = &[0xff, 0xd9];
        assert_eq!(picture_end(&[]), None);
        assert_eq!(picture_end(&[&SCAN, eoi].concat()), None, "no start");
        assert_eq!(end(&[eoi]), None, "no scan");
        assert_eq!(end(&[&SCAN, &[0xff, 0xd8], eoi]), None, "another picture begins");
        assert_eq!(end(&[&SCAN, &[0xff, 0x42], eoi]), None, "no such marker");
        assert_eq!(end(&[&SCAN, &[0xff, 0xe1, 0xff, 0xff], eoi]), None, "longer than the file");
        assert_eq!(end(&[&[0xff, 0xdb, 0, 0], &SCAN, eoi]), Some(14), "a length too short for itself");
    }

    #[test]
    fn any_bytes_will_do() {
        // Every sequence of five of the bytes that mean something.
        let bytes = [0x00, 0x01, 0x02, 0xc4, 0xd0, 0xd8, 0xd9, 0xda, 0xff];
        for number in 0..bytes.len().pow(6) {
            let file: Vec<u8> = (0..6).map(|i| bytes[number / bytes.len().pow(i) % bytes.len()]).collect();
            if let Some(end) = end(&[&file]) {
                assert!(end < file.len() + 1, "{file:x?}");
            }
        }
        // Each byte is looked at a few times, not again and again.
        for byte in [0x00, 0xd0, 0xff] {
            let many = [0xff, byte].repeat(8 << 20);
            assert_eq!(end(&[&SCAN, &many]), None);
        }
    }
}
