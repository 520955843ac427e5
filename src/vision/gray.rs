//! Colour and deep samples to 8-bit gray.
//!
//! A detector meets the pictures of its training and the frames of a camera, and a red wall must be equally bright in
//! both. Colour is therefore weighted as cameras, ffmpeg, OpenCV, Pillow and JPEG's own luma do it, by ITU-R BT.601:
//!
//! ```text
//! gray = (19595 R + 38470 G + 7471 B + 32768) / 65536        in integers; the weights are 0.299, 0.587, 0.114
//! ```
//!
//! | samples | become 8 bits, before any weighting, by |
//! |---|---|
//! | 8 bits | themselves |
//! | 16 bits | (v + 128) / 257 in integers |
//! | floating point (OpenEXR, Radiance HDR) | 255 v, rounded, of v clamped to 0 to 1: linear light, 1 is white |
//!
//! So a picture has the same gray with 8 and with 16 bits, and gray samples are never changed by the weights. Alpha is
//! ignored. A JPEG file in Y'CbCr has its own luma, which is taken as it is; one in RGB or CMYK is weighted.

use image::{DynamicImage, GrayImage, ImageBuffer, Pixel};

/// Name of the weights by which colour becomes gray, as run folders record it.
pub const GRAY_WEIGHTS: &str = "BT.601";

/// An image as detectors see it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DecodedImage {
    /// The gray image.
    pub pixels: GrayImage,
    /// Whether any pixel had colour, so that its gray depends on the weights.
    pub has_colour: bool,
}

/// The gray of a colour by the weights of BT.601.
pub(super) fn luma(red: u8, green: u8, blue: u8) -> u8 {
    let sum = 19_595 * u32::from(red) + 38_470 * u32::from(green) + 7_471 * u32::from(blue);
    // The weights sum to 65536, so this is 255 at most.
    ((sum + 32_768) >> 16) as u8
}

/// 16 bits to the nearest 8.
pub(super) fn of_sixteen(sample: u16) -> u8 {
    ((u32::from(sample) + 128) / 257) as u8
}

/// Floating point to 8 bits; no number becomes 0.
fn of_float(sample: f32) -> u8 {
    (sample.clamp(0.0, 1.0) * 255.0).round() as u8
}

/// Turns an image into 8-bit gray (see the [module](self)).
///
/// ```
/// use image::{DynamicImage, ImageBuffer, Luma, Rgb};
/// use vsonar::vision::to_gray;
///
/// let deep = ImageBuffer::from_fn(16, 16, |x, _| Luma([x as u16 * 257 + 129]));
/// assert_eq!(to_gray(DynamicImage::ImageLuma16(deep)).get_pixel(7, 0).0, [8]);
/// let red = ImageBuffer::from_pixel(16, 16, Rgb([255u8, 0, 0]));
/// assert_eq!(to_gray(DynamicImage::ImageRgb8(red)).get_pixel(7, 0).0, [76]);
/// ```
pub fn to_gray(image: DynamicImage) -> GrayImage {
    decoded(image).pixels
}

/// The same, with whether there was any colour.
pub(super) fn decoded(image: DynamicImage) -> DecodedImage {
    match image {
        DynamicImage::ImageLuma8(pixels) => DecodedImage { pixels, has_colour: false },
        DynamicImage::ImageLumaA8(image) => weighted(&image, |v| v),
        DynamicImage::ImageRgb8(image) => weighted(&image, |v| v),
        DynamicImage::ImageRgba8(image) => weighted(&image, |v| v),
        DynamicImage::ImageLuma16(image) => weighted(&image, of_sixteen),
        DynamicImage::ImageLumaA16(image) => weighted(&image, of_sixteen),
        DynamicImage::ImageRgb16(image) => weighted(&image, of_sixteen),
        DynamicImage::ImageRgba16(image) => weighted(&image, of_sixteen),
        DynamicImage::ImageRgb32F(image) => weighted(&image, of_float),
        DynamicImage::ImageRgba32F(image) => weighted(&image, of_float),
        other => weighted(&other.into_rgb8(), |v| v),
    }
}

fn weighted<P: Pixel>(
    image: &ImageBuffer<P, Vec<P::Subpixel>>,
    eight_bits: impl Fn(P::Subpixel) -> u8,
) -> DecodedImage {
    let mut has_colour = false;
    let gray = image.pixels().map(|pixel| match *pixel.channels() {
        [gray] | [gray, _] => eight_bits(gray),
        [red, green, blue, ..] => {
            let [red, green, blue] = [red, green, blue].map(&eight_bits);
            has_colour |= red != green || green != blue;
            luma(red, green, blue)
        }
        [] => 0,
    });
    let mut samples = Vec::with_capacity(image.width() as usize * image.height() as usize);
    samples.extend(gray);
    let pixels = GrayImage::from_raw(image.width(), image.height(), samples).unwrap_or_default();
    DecodedImage { pixels, has_colour }
}
