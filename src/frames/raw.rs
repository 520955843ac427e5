//! Frames without a header: 8 bits a pixel, row by row, as `ffmpeg -pix_fmt gray -f rawvideo` writes them.

use std::io::Read;
use std::time::Instant;

use super::{Frame, FrameError, FrameFault, FrameSource, checked_size, read_full, resize};

/// Raw gray frames.
#[derive(Debug)]
pub struct Raw<R> {
    input: R,
    origin: String,
    width: u32,
    height: u32,
    next: u64,
}

impl<R: Read> Raw<R> {
    /// Frames of `width` x `height` pixels; `origin` names the input in messages.
    ///
    /// # Errors
    /// If there can be no detector for this size.
    pub fn new(input: R, origin: &str, width: u32, height: u32) -> Result<Raw<R>, FrameError> {
        let (width, height) = checked_size(width.into(), height.into()).map_err(|fault| FrameError {
            origin: origin.into(),
            frame: None,
            fault,
        })?;
        Ok(Raw { input, origin: origin.into(), width, height, next: 0 })
    }
}

impl<R: Read + Send> FrameSource for Raw<R> {
    fn width(&self) -> u32 {
        self.width
    }

    fn height(&self) -> u32 {
        self.height
    }

    fn read(&mut self, frame: &mut Frame) -> Result<bool, FrameError> {
        let fail = |fault| FrameError { origin: self.origin.clone(), frame: Some(self.next), fault };
        resize(&mut frame.pixels, self.width, self.height);
        let expected = frame.pixels.len();
        let got = read_full(&mut self.input, &mut frame.pixels).map_err(|e| fail(FrameFault::Read(e)))?;
        if got == 0 && self.next == 0 {
            return Err(FrameError { origin: self.origin.clone(), frame: None, fault: FrameFault::Empty });
        }
        if got != 0 && got < expected {
            return Err(fail(FrameFault::Truncated { got: got as u64, expected: expected as u64 }));
        }
        frame.arrived = Instant::now();
        frame.index = self.next;
        frame.name.clear();
        self.next += 1;
        Ok(got != 0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_follow_each_other() {
        let bytes: Vec<u8> = (0..3 * 16 * 20).map(|i| (i * 7 % 251) as u8).collect();
        let mut source = Raw::new(&bytes[..], "raw", 16, 20).expect("sound");
        let mut frame = Frame::default();
        for (i, expected) in bytes.chunks(16 * 20).enumerate() {
            assert!(source.read(&mut frame).expect("whole"));
            assert_eq!((frame.index, frame.pixels.as_raw().as_slice()), (i as u64, expected));
            assert_eq!(frame.pixels.dimensions(), (16, 20));
        }
        assert!(!source.read(&mut frame).expect("the end"));
    }

    #[test]
    fn a_part_of_a_frame_is_told() {
        let bytes = [0; 256 + 100];
        let mut source = Raw::new(&bytes[..], "pipe", 16, 16).expect("sound");
        let mut frame = Frame::default();
        assert!(source.read(&mut frame).expect("whole"));
        let error = source.read(&mut frame).expect_err("cut off").to_string();
        assert!(error.starts_with("pipe, frame 1: the stream ends after 100 of its 256 bytes"), "{error}");
    }

    #[test]
    fn nothing_at_all_is_told() {
        let mut source = Raw::new(&[][..], "pipe", 16, 16).expect("sound");
        let error = source.read(&mut Frame::default()).expect_err("empty").to_string();
        assert!(error.starts_with("pipe: there is nothing in it"), "{error}");
        assert!(Raw::new(&[][..], "pipe", 16, 15).is_err());
    }
}
