//! Some of the frames as images in a folder, to be labelled.

use std::fmt;
use std::fs;
use std::io::{self, Cursor, Write};
use std::path::{Path, PathBuf};
use std::str::FromStr;

use image::ImageFormat;

use super::Frame;
use crate::support::printable::ShownPath as _;
use crate::support::temporary::{self, Access, TemporaryFile};

/// How far apart the frames are that are kept. The first one always is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Every {
    /// So many seconds.
    Seconds(f64),
    /// So many frames of the source, dropped ones included.
    Frames(u64),
}

impl FromStr for Every {
    type Err = String;

    /// Reads `1s`, `500ms`, `2min`, or `10f` for frames.
    ///
    /// ```
    /// use vsonar::frames::record::Every;
    /// assert_eq!("500ms".parse(), Ok(Every::Seconds(0.5)));
    /// assert_eq!("2min".parse(), Ok(Every::Seconds(120.0)));
    /// assert_eq!("10f".parse(), Ok(Every::Frames(10)));
    /// ```
    fn from_str(text: &str) -> Result<Every, String> {
        let wrong = || "write a time or a number of frames above 0, as in 1s, 500ms, 2min or 10f".to_string();
        let unit = text.find(|c: char| c.is_ascii_alphabetic()).ok_or_else(wrong)?;
        let (number, unit) = text.split_at(unit);
        if unit == "f" {
            return number.parse().ok().filter(|&n| n > 0).map(Every::Frames).ok_or_else(wrong);
        }
        let seconds = match unit {
            "ms" => 0.001,
            "s" => 1.0,
            "min" => 60.0,
            "h" => 3600.0,
            _ => return Err(wrong()),
        };
        let time = number.parse::<f64>().ok().map(|n| n * seconds);
        time.filter(|t| t.is_finite() && *t > 0.0).map(Every::Seconds).ok_or_else(wrong)
    }
}

impl fmt::Display for Every {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Every::Seconds(seconds) => write!(f, "{seconds}s"),
            Every::Frames(frames) => write!(f, "{frames}f"),
        }
    }
}

/// Why a frame could not be kept.
#[derive(Debug, thiserror::Error)]
pub enum RecordError {
    /// The folder holds a recording already.
    #[error(
        "{}: there are recorded frames in it already ({name}), and none is ever overwritten; choose a new folder, \
         so that a frame's number tells its time",
        .folder.shown()
    )]
    Occupied {
        /// The folder.
        folder: PathBuf,
        /// A frame in it.
        name: String,
    },
    /// The system refuses to write.
    #[error("{}: cannot {action}: {source}{}", .path.shown(), remedy(source))]
    File {
        /// The file or folder.
        path: PathBuf,
        /// What was to be done with it.
        action: &'static str,
        /// Why it failed.
        source: io::Error,
    },
}

fn remedy(error: &io::Error) -> &'static str {
    match error.kind() {
        io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded | io::ErrorKind::FileTooLarge => {
            "; make room on the disk, or keep fewer frames with `--every`"
        }
        io::ErrorKind::PermissionDenied | io::ErrorKind::ReadOnlyFilesystem => {
            "; choose a place where you may write"
        }
        _ => "",
    }
}

/// Keeps frames as PNG files, gray and without anything drawn into them: `frame_000123.png` is the source's frame
/// number 123, from 0 on, so that names tell order and, with the rate, time.
///
/// A file appears as a whole, under its name, or not at all; it is not forced to the disk, for that would keep the
/// next frame waiting. A file that exists is never replaced.
#[derive(Debug)]
pub struct Recorder {
    folder: PathBuf,
    every: Every,
    /// The frame or the time in seconds from which on the next one is kept.
    due: Option<Due>,
    png: Cursor<Vec<u8>>,
    kept: u64,
}

#[derive(Debug, Clone, Copy)]
struct Due {
    frame: u64,
    seconds: f64,
}

/// Whether a file's name is one that a [`Recorder`] gives.
fn is_recorded(name: &str) -> bool {
    let number = name.strip_prefix("frame_").and_then(|rest| rest.strip_suffix(".png"));
    number.is_some_and(|n| n.len() >= 6 && n.bytes().all(|b| b.is_ascii_digit()))
}

impl Recorder {
    /// A recording in a folder, which is made if it is not there. Other files may be in it, but no recorded frames.
    ///
    /// # Errors
    /// If there are frames in the folder, or it cannot be made or read.
    pub fn new(folder: &Path, every: Every) -> Result<Recorder, RecordError> {
        let fail = |action| move |source| RecordError::File { path: folder.to_path_buf(), action, source };
        fs::create_dir_all(folder).map_err(fail("make the folder"))?;
        temporary::clear_in(folder, is_recorded);
        for entry in fs::read_dir(folder).map_err(fail("read the folder"))? {
            let name = entry.map_err(fail("read the folder"))?.file_name().to_string_lossy().into_owned();
            if is_recorded(&name) {
                return Err(RecordError::Occupied { folder: folder.into(), name });
            }
        }
        Ok(Recorder { folder: folder.into(), every, due: None, png: Cursor::default(), kept: 0 })
    }

    /// How many frames have been kept.
    pub const fn kept(&self) -> u64 {
        self.kept
    }

    /// Keeps the frame if it is time, and says whether it was. `seconds` is the frame's time.
    ///
    /// # Errors
    /// If the file cannot be written, or there is one of its name.
    pub fn offer(&mut self, frame: &Frame, seconds: f64) -> Result<bool, RecordError> {
        let due = self.due.unwrap_or(Due { frame: frame.index, seconds });
        let due = match self.every {
            Every::Frames(step) if frame.index >= due.frame => {
                Due { frame: due.frame + step * ((frame.index - due.frame) / step + 1), ..due }
            }
            // Half a millisecond of tolerance: a rate of 30 frames a second does not divide a second exactly.
            Every::Seconds(step) if seconds + 0.0005 >= due.seconds => {
                let steps = ((seconds + 0.0005 - due.seconds) / step).floor() + 1.0;
                Due { seconds: due.seconds + step * steps, ..due }
            }
            _ => return Ok(false),
        };
        self.write(frame)?;
        self.due = Some(due);
        self.kept += 1;
        Ok(true)
    }

    fn write(&mut self, frame: &Frame) -> Result<(), RecordError> {
        let name = format!("frame_{:06}.png", frame.index);
        let path = self.folder.join(&name);
        let fail = |source| RecordError::File { path: path.clone(), action: "write the frame", source };
        self.png.get_mut().clear();
        self.png.set_position(0);
        let encoded = frame.pixels.write_to(&mut self.png, ImageFormat::Png);
        encoded.map_err(|error| fail(io::Error::other(error)))?;
        let mut new = TemporaryFile::beside(&path, &Access::Ordinary).map_err(fail)?;
        new.file().write_all(self.png.get_ref()).map_err(fail)?;
        new.place_new(&path).map_err(fail)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::{GrayImage, Luma};

    fn frame(index: u64) -> Frame {
        Frame { pixels: GrayImage::from_pixel(16, 17, Luma([index as u8])), index, ..Frame::default() }
    }

    /// The numbers of the frames that are kept of so many, at 30 frames a second.
    fn kept(every: &str, frames: impl Iterator<Item = u64>) -> Vec<u64> {
        let dir = tempfile::tempdir().expect("a temporary folder");
        let folder = dir.path().join("new");
        let mut recorder = Recorder::new(&folder, every.parse().expect("sound")).expect("writable");
        let kept: Vec<u64> =
            frames.filter(|&i| recorder.offer(&frame(i), i as f64 / 30.0).expect("writable")).collect();
        assert_eq!(recorder.kept(), kept.len() as u64);
        let mut found = Vec::new();
        for entry in fs::read_dir(&folder).expect("there") {
            let path = entry.expect("readable").path();
            let image = image::open(&path).expect("an image").into_luma8();
            let name = path.file_stem().expect("a name").to_string_lossy().into_owned();
            let number: u64 = name.strip_prefix("frame_").expect("its name").parse().expect("a number");
            assert_eq!(image, frame(number).pixels);
            found.push(number);
        }
        found.sort_unstable();
        assert_eq!(found, kept);
        kept
    }

    #[test]
    fn frames_are_kept_at_even_distances() {
        assert_eq!(kept("1s", 0..100), [0, 30, 60, 90]);
        assert_eq!(kept("500ms", 0..46), [0, 15, 30, 45]);
        assert_eq!(kept("1ms", 0..4), [0, 1, 2, 3]);
        assert_eq!(kept("10f", 0..31), [0, 10, 20, 30]);
        assert_eq!(kept("1h", 5..40), [5]);
        // Where frames were dropped, the next one takes its place.
        assert_eq!(kept("10f", [3, 9, 14, 22, 23, 60].into_iter()), [3, 14, 23, 60]);
        assert_eq!(kept("1s", [3, 31, 34, 62, 64, 200].into_iter()), [3, 34, 64, 200]);
    }

    #[test]
    fn distances_as_text() {
        for wrong in ["", "1", "s", "0s", "-1s", "0f", "1.5f", "1 s", "1d", "nans", "infs", "1s1s", "ms"] {
            assert!(wrong.parse::<Every>().is_err(), "{wrong}");
        }
        for (text, again) in [("1s", "1s"), ("250ms", "0.25s"), ("1.5min", "90s"), ("7f", "7f")] {
            assert_eq!(text.parse::<Every>().expect("sound").to_string(), again);
        }
    }

    #[test]
    fn nothing_is_overwritten() {
        let dir = tempfile::tempdir().expect("a temporary folder");
        fs::write(dir.path().join("notes.txt"), "mine").expect("writable");
        fs::write(dir.path().join("frame_1.png"), "mine").expect("writable");
        let every = Every::Frames(1);
        let mut recorder = Recorder::new(dir.path(), every).expect("other files do not matter");
        recorder.offer(&frame(0), 0.0).expect("writable");
        fs::write(dir.path().join("frame_000001.png"), "theirs").expect("writable");
        let error = recorder.offer(&frame(1), 0.0).expect_err("in the way").to_string();
        assert!(error.contains("frame_000001.png: cannot write the frame"), "{error}");
        assert_eq!(fs::read(dir.path().join("frame_000001.png")).expect("there"), b"theirs");
        assert_eq!(fs::read_dir(dir.path()).expect("there").count(), 4, "nothing else is left");
        let error = Recorder::new(dir.path(), every).expect_err("occupied").to_string();
        assert!(error.contains("recorded frames") && error.contains("new folder"), "{error}");
    }
}
