//! A run as a video: what the camera saw, and what the detector made of it.

use std::io::{self, Write};

use super::run::Frame;
use crate::frames::Rate;
use crate::frames::y4m::{Chroma, Header, Writer};
use crate::report::{Mark, Overlay};
use crate::world::office::FRAME_RATE;

/// Writes frames as Y4M, with the rows that were believed drawn over them.
pub struct Video<W: Write> {
    writer: Writer<W>,
    overlay: Overlay,
    marks: Vec<Mark>,
}

impl<W: Write> Video<W> {
    /// A video of pictures of this size. A frame takes half as many bytes again as it has pixels.
    ///
    /// # Errors
    /// If the output cannot be written.
    pub fn new(output: W, (width, height): (u32, u32)) -> io::Result<Video<W>> {
        let rate = Rate::new(FRAME_RATE as u32, 1);
        let header = Header { width, height, rate, chroma: Chroma::C420, limited: Some(false) };
        Ok(Video { writer: Writer::new(output, header)?, overlay: Overlay::new(1), marks: Vec::new() })
    }

    /// Writes a frame; one without a picture is left out.
    ///
    /// # Errors
    /// If the output cannot be written.
    pub fn frame(&mut self, frame: &Frame<'_>) -> io::Result<()> {
        let Some(picture) = frame.picture else { return Ok(()) };
        self.marks.clear();
        if let Some(rows) = frame.rows {
            self.marks.extend(rows.columns.iter().zip(&rows.believed).map(|(&x, &answer)| Mark {
                x,
                answer,
                free: answer < 0.5,
                note: String::new(),
            }));
        }
        self.writer.write_rgb(self.overlay.draw(picture, &self.marks))
    }

    /// The output, after all frames.
    pub fn into_inner(self) -> W {
        self.writer.into_inner()
    }
}
