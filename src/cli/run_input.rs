//! Where the frames of `vsonar run` come from.

use std::fs::File;
use std::io::{self, Cursor, Read};
use std::path::{Path, PathBuf};

use clap::ValueEnum;
use vsonar::frames::folder::Folder;
use vsonar::frames::raw::Raw;
use vsonar::frames::y4m::{MAGIC, Reader};
use vsonar::frames::{FrameError, FrameFault, FrameSource};
use vsonar::support::printable::ShownPath as _;

use super::CliError;

/// What the input holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Format {
    /// Y4M by how it begins, images by being a folder or by the file's ending, else raw if --size is given
    Auto,
    /// Gray, 8 bits a pixel, without a header (ffmpeg -pix_fmt gray -f rawvideo); needs --size
    Raw,
    /// YUV4MPEG2 (ffmpeg -f yuv4mpegpipe)
    Y4m,
    /// An image, or the images of a folder in the order of the numbers in their names
    Images,
}

/// A source that has been opened.
pub(crate) struct Input {
    pub(crate) source: Box<dyn FrameSource>,
    /// As it is called in messages.
    pub(crate) origin: String,
    /// Whether these are image files, which have no time of their own.
    pub(crate) images: bool,
    /// Whether the stream says that its luma goes from 16 to 235 only.
    pub(crate) limited: bool,
}

/// Opens the input: `-` is standard input. `size` is that of raw frames. Waits for the first bytes of a stream.
pub(crate) fn open(path: PathBuf, format: Format, size: Option<(u32, u32)>) -> Result<Input, CliError> {
    if path == Path::new("-") {
        return stream(io::stdin(), "standard input".to_string(), format, size);
    }
    let origin = path.shown();
    let failed = |e| CliError::file(&path, "read the frames", &e);
    let folder = std::fs::metadata(&path).map_err(failed)?.is_dir();
    match (folder, format) {
        (true, Format::Auto | Format::Images) => images(Folder::open(&path)?, origin),
        (true, _) => {
            Err(CliError::Usage(format!("--format: {origin} is a folder; its images are read with `images`")))
        }
        (false, Format::Images) => images(Folder::single(&path)?, origin),
        (false, Format::Auto) if image::ImageFormat::from_path(&path).is_ok() => {
            images(Folder::single(&path)?, origin)
        }
        (false, _) => stream(File::open(&path).map_err(failed)?, origin, format, size),
    }
}

fn images(folder: Folder, origin: String) -> Result<Input, CliError> {
    Ok(Input { source: Box::new(folder), origin, images: true, limited: false })
}

fn stream(
    mut input: impl Read + Send + 'static,
    origin: String,
    format: Format,
    size: Option<(u32, u32)>,
) -> Result<Input, CliError> {
    let mut raw = format == Format::Raw;
    let mut beginning = Vec::new();
    if format == Format::Auto {
        let magic = input.by_ref().take(MAGIC.len() as u64).read_to_end(&mut beginning);
        magic.map_err(|e| failed(&origin, FrameFault::Read(e)))?;
        raw = size.is_some() && !beginning.is_empty() && beginning != MAGIC;
    }
    let input = Cursor::new(beginning).chain(input);
    let (source, limited): (Box<dyn FrameSource>, bool) = match (format, size) {
        (Format::Images, _) => {
            let text = format!("--format: {origin} cannot hold images; give a file or a folder with --input");
            return Err(CliError::Usage(text));
        }
        (Format::Raw, None) => {
            let text = "--size: raw frames do not tell their size; give it, as in --size 320x240";
            return Err(CliError::Usage(text.to_string()));
        }
        (_, Some((width, height))) if raw => (Box::new(Raw::new(input, &origin, width, height)?), false),
        _ => {
            let reader = Reader::new(input, &origin)?;
            let limited = reader.header().limited == Some(true);
            (Box::new(reader), limited)
        }
    };
    Ok(Input { source, origin, images: false, limited })
}

fn failed(origin: &str, fault: FrameFault) -> FrameError {
    FrameError { origin: origin.to_string(), frame: None, fault }
}

impl Input {
    /// Refuses an input whose frames are not of the size that the program, or `--size`, is for.
    pub(crate) fn check_size(&self, expected: Option<(u32, u32)>) -> Result<(), CliError> {
        let (width, height) = (self.source.width(), self.source.height());
        match expected {
            Some((expected_width, expected_height))
                if (expected_width, expected_height) != (width, height) =>
            {
                let fault = FrameFault::Size { width, height, expected_width, expected_height };
                Err(failed(&self.origin, fault).into())
            }
            _ => Ok(()),
        }
    }
}
