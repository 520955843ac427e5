//! Pictures as a video: Y4M as it is, everything else through the installed ffmpeg.

use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::process::Stdio;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use image::RgbImage;
use vsonar::frames::Rate;
use vsonar::frames::y4m::{Chroma, Header, Writer};
use vsonar::support::durable;
use vsonar::support::temporary::{self, TemporaryFolder};

use super::CliError;
use super::ffmpeg::{self, Running};
use vsonar::support::printable::ShownPath as _;

/// A video that appears complete or not at all: it is written under another name beside its place.
#[derive(Debug)]
pub(crate) struct Video {
    path: PathBuf,
    kind: Kind,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Y4m,
    /// Whether the table of frames should be moved to the front, so that it plays while it is loaded.
    Encoded {
        movable: bool,
    },
}

impl Video {
    /// Plans a video; nothing is written yet.
    pub(crate) fn check(path: &Path) -> Result<Video, CliError> {
        let ending =
            path.extension().map(|ending| ending.to_string_lossy().to_lowercase()).unwrap_or_default();
        let kind = match ending.as_str() {
            "y4m" => Kind::Y4m,
            "mp4" | "mov" => Kind::Encoded { movable: true },
            "mkv" | "webm" => Kind::Encoded { movable: false },
            _ => {
                let text =
                    format!("--video: {}: end the name with .y4m, .mp4, .mkv, .mov or .webm", path.shown());
                return Err(CliError::Usage(text));
            }
        };
        if path.symlink_metadata().is_ok() {
            let text =
                format!("{}: exists already and is never overwritten; choose another name", path.shown());
            return Err(CliError::Failed(text));
        }
        Ok(Video { path: path.into(), kind })
    }

    /// Writes the frames, which are all of one size, at least one.
    pub(crate) fn write(
        self,
        frames: impl Iterator<Item = RgbImage>,
        rate: Rate,
        stop: &Arc<AtomicBool>,
    ) -> Result<(), CliError> {
        let failed = |e: io::Error| CliError::file(&self.path, "write the video", &e);
        temporary::clear(&self.path);
        let hidden = TemporaryFolder::beside(&self.path).map_err(failed)?;
        // ffmpeg goes by the ending.
        let part =
            hidden.path().join(Path::new("video").with_extension(self.path.extension().unwrap_or_default()));
        match self.kind {
            Kind::Y4m => {
                let file = File::create_new(&part).map_err(failed)?;
                let file =
                    stream(BufWriter::new(file), frames, rate, stop).map_err(|e| self.broken(e, stop))?;
                let file = file.into_inner().map_err(|e| failed(e.into_error()))?;
                durable::sync_file(&file, &self.path).map_err(failed)?;
            }
            Kind::Encoded { movable } => {
                let running = Running::start(command(&part, movable), stop)?;
                let pipe = running.input().ok_or_else(|| failed(io::ErrorKind::BrokenPipe.into()))?;
                let mut sent = 0;
                let written = stream(pipe, frames.inspect(|_| sent += 1), rate, stop).map(drop);
                // What ffmpeg says tells more than that it no longer reads.
                match (written, running.finish()?) {
                    (written, _) if stop.load(Ordering::Relaxed) => {
                        written.map_err(|e| self.broken(e, stop))?;
                        return Err(interrupted());
                    }
                    (_, Err(said)) => {
                        let text = format!("{}: ffmpeg cannot write it: {said}", self.path.shown());
                        return Err(CliError::Failed(text));
                    }
                    (Ok(()), Ok(counts)) if counts.contradict(sent) => {
                        let text = format!(
                            "{}: {sent} frames were to be written, but ffmpeg counts {counts}; try another version of ffmpeg",
                            self.path.shown()
                        );
                        return Err(CliError::Failed(text));
                    }
                    (written, Ok(_)) => written.map_err(failed)?,
                }
            }
        }
        if self.path.symlink_metadata().is_ok() {
            let text = "something of this name has appeared";
            return Err(failed(io::Error::new(io::ErrorKind::AlreadyExists, text)));
        }
        fs::rename(&part, &self.path).map_err(failed)
    }

    fn broken(&self, error: io::Error, stop: &AtomicBool) -> CliError {
        match stop.load(Ordering::Relaxed) {
            true => interrupted(),
            false => CliError::file(&self.path, "write the video", &error),
        }
    }
}

/// ffmpeg, which makes a file of the frames that it is given.
fn command(file: &Path, movable: bool) -> std::process::Command {
    let mut command = ffmpeg::command();
    command.args(["-f", "yuv4mpegpipe", "-i", "pipe:0", "-an"]);
    // Most players want even sides and samples of colour for four pixels.
    command.args(["-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2", "-pix_fmt", "yuv420p"]);
    if movable {
        command.args(["-movflags", "+faststart"]);
    }
    command.args(ffmpeg::COUNTS).arg("-n").arg(ffmpeg::file(file));
    command.stdin(Stdio::piped()).stdout(Stdio::null());
    command
}

fn interrupted() -> CliError {
    CliError::Interrupted("interrupted; no video was written".to_string())
}

/// Writes the frames as Y4M; the output, after all of them.
fn stream<W: Write>(
    output: W,
    frames: impl Iterator<Item = RgbImage>,
    rate: Rate,
    stop: &AtomicBool,
) -> io::Result<W> {
    let mut frames = frames.peekable();
    let (width, height) = frames.peek().map_or((0, 0), RgbImage::dimensions);
    let header = Header { width, height, rate: Some(rate), chroma: Chroma::C444, limited: Some(false) };
    let mut writer = Writer::new(output, header)?;
    for frame in frames {
        if stop.load(Ordering::Relaxed) {
            return Err(io::ErrorKind::Interrupted.into());
        }
        writer.write_rgb(&frame)?;
    }
    Ok(writer.into_inner())
}
