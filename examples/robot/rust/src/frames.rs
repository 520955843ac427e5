//! Frames from a stream: PGM (binary, 8 bits), one after the other, or raw gray pixels.

use std::io::{self, BufRead};

/// The frames of a stream, all of one size.
pub struct Frames<R> {
    input: R,
    width: usize,
    height: usize,
    /// Whether it is PGM; not known before the first frame.
    is_pgm: Option<bool>,
}

impl<R: BufRead> Frames<R> {
    /// The frames of a stream.
    pub fn new(input: R, width: usize, height: usize) -> Frames<R> {
        Frames { input, width, height, is_pgm: None }
    }

    /// The next frame, row by row; none where the input has ended.
    pub fn next(&mut self) -> Result<Option<Vec<u8>>, String> {
        if self.input.fill_buf().map_err(complaint)?.is_empty() {
            return Ok(None);
        }
        // Every PGM begins with these two bytes; a raw frame whose first pixels have these very values is mistaken for one.
        let mut begin = [0; 2];
        self.input.read_exact(&mut begin).map_err(complaint)?;
        let is_pgm = *self.is_pgm.get_or_insert(&begin == b"P5");
        let mut frame = vec![0; self.width * self.height];
        if is_pgm {
            if &begin != b"P5" {
                return Err("this is not where a PGM begins".into());
            }
            self.check_header()?;
            self.input.read_exact(&mut frame).map_err(complaint)?;
        } else {
            frame[..2].copy_from_slice(&begin);
            self.input.read_exact(&mut frame[2..]).map_err(complaint)?;
        }
        Ok(Some(frame))
    }

    /// Reads the numbers that follow `P5` in a PGM.
    fn check_header(&mut self) -> Result<(), String> {
        for (name, needed) in [("width", self.width), ("height", self.height), ("greatest gray value", 255)] {
            let found = self.number()?;
            if found != needed {
                return Err(format!("its {name} is {found}, but the detector needs {needed}"));
            }
        }
        Ok(())
    }

    /// The next number of the header, and the one character after it. Before it are blanks and comments.
    fn number(&mut self) -> Result<usize, String> {
        let mut c = self.byte()?;
        while c == b'#' || c.is_ascii_whitespace() {
            if c == b'#' {
                while self.byte()? != b'\n' {}
            }
            c = self.byte()?;
        }
        let mut digits = String::new();
        while !c.is_ascii_whitespace() {
            digits.push(char::from(c));
            if digits.len() > 9 {
                return Err(format!("this is no header of PGM: {digits}... is too long"));
            }
            c = self.byte()?;
        }
        digits.parse().map_err(|_| format!("this is no header of PGM: {digits:?} is no number"))
    }

    fn byte(&mut self) -> Result<u8, String> {
        let mut byte = [0];
        self.input.read_exact(&mut byte).map_err(complaint)?;
        Ok(byte[0])
    }
}

fn complaint(error: io::Error) -> String {
    match error.kind() {
        io::ErrorKind::UnexpectedEof => "the input ends before its last pixel".into(),
        _ => format!("cannot read standard input: {error}"),
    }
}
