//! Writing a Y4M stream, gray or in colour.

use std::io::{self, Write};

use image::{GrayImage, Rgb, RgbImage};

use super::{Chroma, Header};

/// A Y4M stream that is written, a frame with every call.
#[derive(Debug)]
pub struct Writer<W> {
    output: W,
    header: Header,
    /// A frame with its line.
    frame: Vec<u8>,
}

/// Y, Cb and Cr of a colour, all from 0 to 255 (ITU-T T.871, the colours of JPEG, which are those of BT.601 with
/// the full range), in fixed point, rounded.
fn ycbcr(Rgb([r, g, b]): Rgb<u8>) -> [u8; 3] {
    if r == g && g == b {
        return [r, 128, 128];
    }
    let (r, g, b) = (i32::from(r), i32::from(g), i32::from(b));
    // The factors times 2^16; each row of them sums up to 2^16 or to 0.
    let part = |red: i32, green: i32, blue: i32, middle: i32| {
        let sum = red * r + green * g + blue * b + (middle << 16) + (1 << 15);
        (sum >> 16).clamp(0, 255) as u8
    };
    [part(19_595, 38_470, 7_471, 0), part(-11_059, -21_709, 32_768, 128), part(32_768, -27_439, -5_329, 128)]
}

impl<W: Write> Writer<W> {
    /// Writes the header.
    ///
    /// # Errors
    /// If the output cannot be written.
    pub fn new(mut output: W, header: Header) -> io::Result<Writer<W>> {
        output.write_all(format!("{header}\n").as_bytes())?;
        Ok(Writer { output, header, frame: Vec::new() })
    }

    /// The output, after all frames.
    pub fn into_inner(self) -> W {
        self.output
    }

    /// Writes a gray frame and flushes it.
    ///
    /// # Errors
    /// If the image is not of the header's size, or the output cannot be written.
    pub fn write_gray(&mut self, image: &GrayImage) -> io::Result<()> {
        self.begin(image.dimensions())?;
        self.frame.extend_from_slice(image);
        let Header { width, height, chroma, .. } = self.header;
        let colours = chroma.bytes(width, height) as usize;
        self.frame.resize(self.frame.len() + colours, 128);
        self.end()
    }

    /// Writes a frame in colour, declared to be of the full range, and flushes it. A sample of colour for several
    /// pixels is their average.
    ///
    /// # Errors
    /// As [`Writer::write_gray`].
    pub fn write_rgb(&mut self, image: &RgbImage) -> io::Result<()> {
        self.begin(image.dimensions())?;
        self.frame.extend(image.pixels().map(|&pixel| ycbcr(pixel)[0]));
        match self.header.chroma.cell() {
            None => {}
            Some((1, 1)) => {
                for plane in [1, 2] {
                    self.frame.extend(image.pixels().map(|&pixel| ycbcr(pixel)[plane]));
                }
            }
            Some(cell) => self.averages(image, cell),
        }
        self.end()
    }

    fn averages(&mut self, image: &RgbImage, (across, down): (u32, u32)) {
        let (width, height) = image.dimensions();
        for plane in [1, 2] {
            for top in (0..height).step_by(down as usize) {
                for left in (0..width).step_by(across as usize) {
                    let (mut sum, mut count) = (0u32, 0u32);
                    for y in top..(top + down).min(height) {
                        for x in left..(left + across).min(width) {
                            sum += u32::from(ycbcr(*image.get_pixel(x, y))[plane]);
                            count += 1;
                        }
                    }
                    self.frame.push(((sum + count / 2) / count) as u8);
                }
            }
        }
    }

    fn begin(&mut self, size: (u32, u32)) -> io::Result<()> {
        let Header { width, height, .. } = self.header;
        if size != (width, height) {
            let text = format!("a frame of {}x{} pixels in a stream of {width}x{height}", size.0, size.1);
            return Err(io::Error::new(io::ErrorKind::InvalidInput, text));
        }
        self.frame.clear();
        self.frame.extend_from_slice(b"FRAME\n");
        Ok(())
    }

    fn end(&mut self) -> io::Result<()> {
        if self.header.chroma == Chroma::C444Alpha {
            let opaque = (self.header.frame_bytes() + 6) as usize;
            // Behind gray it is there already, with the value of the colours.
            let pixels = self.header.width as usize * self.header.height as usize;
            self.frame.truncate(opaque - pixels);
            self.frame.resize(opaque, 255);
        }
        self.output.write_all(&self.frame)?;
        self.output.flush()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_are_those_of_jpeg() {
        let of = |r, g, b| ycbcr(Rgb([r, g, b]));
        assert_eq!(of(255, 0, 0), [76, 85, 255]);
        assert_eq!(of(0, 255, 0), [150, 44, 21]);
        assert_eq!(of(0, 0, 255), [29, 255, 107]);
        for v in 0..=255 {
            assert_eq!(of(v, v, v), [v, 128, 128]);
        }
        // Against the definition in binary64.
        for i in 0..10_000u64 {
            let [r, g, b] = [i * 7919 % 256, i * 104_729 % 256, i * 1_299_709 % 256].map(|v| v as u8);
            let (red, green, blue) = (f64::from(r), f64::from(g), f64::from(b));
            let y = 0.299 * red + 0.587 * green + 0.114 * blue;
            let exact = [y, (blue - y) / 1.772 + 128.0, (red - y) / 1.402 + 128.0];
            for (value, exact) in of(r, g, b).into_iter().zip(exact) {
                assert!((f64::from(value) - exact.clamp(0.0, 255.0)).abs() < 0.51, "{r} {g} {b}");
            }
        }
    }

    #[test]
    fn samples_of_colour_are_averages() {
        // 17 x 16: the last cell of a row has one column.
        let image =
            RgbImage::from_fn(17, 16, |x, _| if x % 2 == 0 { Rgb([255, 0, 0]) } else { Rgb([0, 0, 255]) });
        let header = Header { width: 17, height: 16, rate: None, chroma: Chroma::C420, limited: None };
        let mut writer = Writer::new(Vec::new(), header).expect("room");
        writer.write_rgb(&image).expect("room");
        let bytes = writer.into_inner();
        let colours = &bytes[bytes.len() - 2 * 9 * 8..];
        assert_eq!(colours[..9], [[170; 8].as_slice(), &[85]].concat());
        assert_eq!(colours[9 * 8..][..9], [[181; 8].as_slice(), &[255]].concat());
        assert!(writer_of(header).write_gray(&GrayImage::new(16, 16)).is_err());
    }

    fn writer_of(header: Header) -> Writer<Vec<u8>> {
        Writer::new(Vec::new(), header).expect("room")
    }

    #[test]
    fn opacity_is_whole() {
        let header = Header { width: 16, height: 16, rate: None, chroma: Chroma::C444Alpha, limited: None };
        let mut writer = writer_of(header);
        writer.write_gray(&GrayImage::new(16, 16)).expect("room");
        writer.write_rgb(&RgbImage::new(16, 16)).expect("room");
        let bytes = writer.into_inner();
        let line = header.to_string().len() + 1;
        assert_eq!(bytes.len(), line + 2 * (6 + 4 * 256));
        for frame in bytes[line..].chunks(6 + 4 * 256) {
            assert!(frame[6..][..256].iter().all(|&b| b == 0));
            assert!(frame[6 + 256..][..512].iter().all(|&b| b == 128));
            assert!(frame[6 + 768..].iter().all(|&b| b == 255));
        }
    }
}
