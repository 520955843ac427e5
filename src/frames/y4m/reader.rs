//! Reading a Y4M stream: the luma of one frame after the other.

use std::io::{self, BufRead, BufReader, Read};
use std::time::Instant;

use super::{FrameFault, Header, MAX_LINE, plain};
use crate::frames::{Frame, FrameError, FrameSource, Rate, read_full, resize};

/// A Y4M stream that is read.
#[derive(Debug)]
pub struct Reader<R> {
    input: BufReader<R>,
    origin: String,
    header: Header,
    line: Vec<u8>,
    next: u64,
}

impl<R: Read> Reader<R> {
    /// Reads the header; `origin` names the input in messages.
    ///
    /// # Errors
    /// If this is no Y4M stream, not of 8 bits a sample, or of a size that there can be no detector for.
    pub fn new(input: R, origin: &str) -> Result<Reader<R>, FrameError> {
        let fail = |fault| FrameError { origin: origin.into(), frame: None, fault };
        let mut input = BufReader::new(input);
        let mut line = Vec::new();
        read_line(&mut input, &mut line).map_err(|e| fail(FrameFault::Read(e)))?;
        let Some(text) = line.strip_suffix(b"\n") else {
            let fault = match line.as_slice() {
                [] => FrameFault::Empty,
                other if other.starts_with(super::MAGIC) => {
                    FrameFault::Header(format!("does not end within {MAX_LINE} bytes"))
                }
                _ => FrameFault::NotY4m,
            };
            return Err(fail(fault));
        };
        let header = Header::parse(text).map_err(fail)?;
        Ok(Reader { input, origin: origin.into(), header, line, next: 0 })
    }

    /// What the stream says of itself.
    pub const fn header(&self) -> &Header {
        &self.header
    }

    /// Reads the line that a frame begins with; false at the end of the stream.
    fn frame_line(&mut self) -> Result<bool, FrameFault> {
        self.line.clear();
        read_line(&mut self.input, &mut self.line).map_err(FrameFault::Read)?;
        match self.line.strip_prefix(b"FRAME") {
            // Parameters of the frame follow a space; some writers end lines as Windows does.
            Some([b'\n'] | [b'\r', b'\n'] | [b' ', .., b'\n']) => Ok(true),
            _ if self.line.is_empty() => Ok(false),
            _ if b"FRAME\r\n".starts_with(&self.line) => {
                Err(FrameFault::Truncated { got: 0, expected: self.header.frame_bytes() })
            }
            _ => Err(FrameFault::FrameHeader(plain(&self.line))),
        }
    }

    fn planes(&mut self, frame: &mut Frame) -> Result<(), FrameFault> {
        let Header { width, height, chroma, .. } = self.header;
        resize(&mut frame.pixels, width, height);
        let expected = self.header.frame_bytes();
        let luma = read_full(&mut self.input, &mut frame.pixels).map_err(FrameFault::Read)?;
        let mut colours = self.input.by_ref().take(chroma.bytes(width, height));
        let got = luma as u64 + io::copy(&mut colours, &mut io::sink()).map_err(FrameFault::Read)?;
        if got == expected { Ok(()) } else { Err(FrameFault::Truncated { got, expected }) }
    }
}

/// Reads to the end of the line, of the stream, or of what is the longest line, whichever comes first.
fn read_line(input: &mut impl BufRead, line: &mut Vec<u8>) -> io::Result<usize> {
    input.take(MAX_LINE).read_until(b'\n', line)
}

impl<R: Read + Send> FrameSource for Reader<R> {
    fn width(&self) -> u32 {
        self.header.width
    }

    fn height(&self) -> u32 {
        self.header.height
    }

    fn rate(&self) -> Option<Rate> {
        self.header.rate
    }

    fn read(&mut self, frame: &mut Frame) -> Result<bool, FrameError> {
        let read = match self.frame_line() {
            Ok(true) => self.planes(frame).map(|()| true),
            other => other,
        };
        frame.arrived = Instant::now();
        frame.index = self.next;
        frame.name.clear();
        let there =
            read.map_err(|fault| FrameError { origin: self.origin.clone(), frame: Some(self.next), fault })?;
        self.next += 1;
        Ok(there)
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Chroma, Writer};
    use super::*;
    use image::{GrayImage, Luma};

    fn picture(width: u32, height: u32, salt: u32) -> GrayImage {
        GrayImage::from_fn(width, height, |x, y| Luma([(x * 31 + y * 17 + salt * 7) as u8]))
    }

    /// A stream of three frames.
    fn stream(chroma: Chroma, width: u32, height: u32) -> Vec<u8> {
        let header = Header { width, height, rate: Rate::new(25, 1), chroma, limited: None };
        let mut writer = Writer::new(Vec::new(), header).expect("room");
        (0..3).for_each(|i| writer.write_gray(&picture(width, height, i)).expect("room"));
        writer.into_inner()
    }

    fn frames(bytes: &[u8]) -> Result<Vec<GrayImage>, String> {
        let mut reader = Reader::new(bytes, "x.y4m").map_err(|e| e.to_string())?;
        let (mut frame, mut found) = (Frame::default(), Vec::new());
        while reader.read(&mut frame).map_err(|e| e.to_string())? {
            assert_eq!(frame.index, found.len() as u64);
            found.push(frame.pixels.clone());
        }
        Ok(found)
    }

    #[test]
    fn luma_round_trips_whatever_the_colours_and_sides() {
        for chroma in Chroma::ALL {
            for (width, height) in [(16, 16), (17, 16), (16, 17), (33, 19)] {
                let bytes = stream(chroma, width, height);
                let expected: Vec<GrayImage> = (0..3).map(|i| picture(width, height, i)).collect();
                assert_eq!(frames(&bytes), Ok(expected), "{chroma:?} {width}x{height}");
            }
        }
    }

    #[test]
    fn parameters_of_frames_are_passed_over() {
        let mut bytes = b"YUV4MPEG2 W16 H16 Cmono\nFRAME Ixyz XNOTE=1\n".to_vec();
        bytes.extend([3; 256]);
        assert_eq!(frames(&bytes).expect("sound").len(), 1);
    }

    #[test]
    fn lines_may_end_as_windows_ends_them() {
        let mut bytes = b"YUV4MPEG2 W16 H16 CMONO\r\n".to_vec();
        // The first pixel looks like the end of a line.
        for line in [&b"FRAME\r\n"[..], b"FRAME\n", b"FRAME Ip\r\n", b"FRAME XNOTE=\n"] {
            bytes.extend(line);
            bytes.extend([b'\n'; 256]);
        }
        let read = frames(&bytes).expect("sound");
        assert_eq!(read, vec![GrayImage::from_pixel(16, 16, Luma([b'\n'])); 4]);
        let cut = frames(&bytes[..b"YUV4MPEG2 W16 H16 CMONO\r\nFRAME\r".len()]).expect_err("cut off");
        assert!(cut.contains("the stream ends after 0"), "{cut}");
    }

    #[test]
    fn a_stream_cut_off_anywhere_is_told_unless_between_frames() {
        for chroma in [Chroma::Mono, Chroma::C420] {
            let whole = stream(chroma, 17, 16);
            let header = whole.iter().position(|&b| b == b'\n').expect("a header") + 1;
            let frame = (whole.len() - header) / 3;
            for end in 0..whole.len() {
                let read = frames(&whole[..end]);
                if end >= header && (end - header).is_multiple_of(frame) {
                    assert_eq!(read.expect("whole frames").len(), (end - header) / frame);
                    continue;
                }
                let error = read.expect_err("cut off");
                let place = match end.checked_sub(header) {
                    None => "x.y4m: ".to_string(),
                    Some(at) => format!("x.y4m, frame {}: the stream ends after", at / frame),
                };
                assert!(error.starts_with(&place), "{end}: {error}");
            }
        }
    }

    #[test]
    fn what_is_no_stream_is_refused() {
        for (bytes, said) in [
            (&b""[..], "nothing in it"),
            (b"\x89PNG\r\n\x1a\n", "is not a Y4M stream"),
            (b"YUV4MPEG2 W16 H16", "does not end"),
            (b"YUV4MPEG2 W16 H16 C420p10\n", "-pix_fmt"),
            (b"YUV4MPEG2 W16 H16\nFRAMES\n", "instead of FRAME"),
            (b"YUV4MPEG2 W16 H16\nFRAME\rx\n", "instead of FRAME"),
            (b"YUV4MPEG2 W16 H16\nYUV4MPEG2 W16 H16\n", "frame 0: begins with `YUV4MPEG2"),
            (&[b'x'; 1 << 16], "is not a Y4M stream"),
        ] {
            let error = frames(bytes).expect_err("no stream");
            assert!(error.contains(said), "{error}");
        }
        // A line without an end is not read for ever.
        let endless = [b"YUV4MPEG2 W16 H16\nFRAME ".to_vec(), vec![b'x'; 1 << 16]].concat();
        assert!(frames(&endless).expect_err("endless").contains("instead of FRAME"));
        let endless = [b"YUV4MPEG2 W16 H16 ".to_vec(), vec![b'x'; 1 << 16]].concat();
        assert!(frames(&endless).expect_err("endless").contains("does not end within 4096"));
    }

    #[test]
    fn enormous_frames_are_refused_before_any_memory_is_asked_for() {
        let error = frames(b"YUV4MPEG2 W65536 H65536\nFRAME\n").expect_err("too large");
        assert!(error.contains("65536x65536"), "{error}");
    }

    /// An input that hands out a byte at a time, and is interrupted in between.
    struct Drops<'a>(&'a [u8], bool);

    impl Read for Drops<'_> {
        fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
            self.1 = !self.1;
            if self.1 {
                return Err(io::ErrorKind::Interrupted.into());
            }
            let some = bytes.len().min(1);
            self.0.read(&mut bytes[..some])
        }
    }

    #[test]
    fn a_pipe_that_drips_gives_the_same() {
        let bytes = stream(Chroma::C422, 17, 16);
        let mut reader = Reader::new(Drops(&bytes, false), "pipe").expect("sound");
        let mut frame = Frame::default();
        for i in 0..3 {
            assert!(reader.read(&mut frame).expect("whole"));
            assert_eq!(frame.pixels, picture(17, 16, i));
        }
        assert!(!reader.read(&mut frame).expect("the end"));
    }
}
