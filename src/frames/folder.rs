//! The images of a folder as frames, in the order in which people number them.

use std::cmp::Ordering;
use std::path::{Path, PathBuf};
use std::time::Instant;
use std::{fs, io};

use image::{GrayImage, ImageFormat};

use super::{Frame, FrameError, FrameFault, FrameSource};
use crate::support::printable::ShownPath as _;
use crate::vision::load_gray;

/// Image files, all of one size, read one by one.
#[derive(Debug)]
pub struct Folder {
    files: std::vec::IntoIter<PathBuf>,
    /// The first image: its size is everybody's.
    first: Option<GrayImage>,
    width: u32,
    height: u32,
    next: u64,
}

impl Folder {
    /// The images of a folder in natural order (`frame_9.png` before `frame_10.png`): the files in it whose ending is
    /// that of an image format, or, if there is none, those of its subfolder `images`, where a data set has them.
    /// Hidden files do not count. The first image is read now.
    ///
    /// # Errors
    /// If the folder or its first image cannot be read, or there is no image.
    pub fn open(path: &Path) -> Result<Folder, FrameError> {
        let fail = |fault| FrameError { origin: path.shown(), frame: None, fault };
        let images = |folder: &Path| -> io::Result<Vec<PathBuf>> {
            Ok(images(folder)?.into_iter().filter(|path| path.is_file()).collect())
        };
        let mut files = images(path).map_err(|e| fail(FrameFault::Read(e)))?;
        let below = path.join("images");
        if files.is_empty() && below.symlink_metadata().is_ok() {
            let fail = |e| FrameError { origin: below.shown(), ..fail(FrameFault::Read(e)) };
            files = images(&below).map_err(fail)?;
        }
        if files.is_empty() {
            return Err(fail(FrameFault::NoImages));
        }
        Folder::of(files)
    }

    /// A single image.
    ///
    /// # Errors
    /// If it cannot be read.
    pub fn single(path: &Path) -> Result<Folder, FrameError> {
        Folder::of(vec![path.to_path_buf()])
    }

    fn of(files: Vec<PathBuf>) -> Result<Folder, FrameError> {
        let first = load(&files[0], 0)?;
        let (width, height) = first.dimensions();
        Ok(Folder { files: files.into_iter(), first: Some(first), width, height, next: 0 })
    }
}

/// Names of files and folders that systems leave among images: copies of other images, or no images at all.
const LEFT_BY_SYSTEMS: [&str; 2] = ["__MACOSX", "@eaDir"];

/// Whether a file or folder does not count wherever images are looked for: its name begins with a dot, as the companions
/// `._NAME` of files do that macOS copies, or it is a folder that systems fill by themselves.
pub(crate) fn is_hidden(path: &Path) -> bool {
    let name = path.file_name().unwrap_or_default();
    name.as_encoded_bytes().starts_with(b".") || LEFT_BY_SYSTEMS.iter().any(|left| name == *left)
}

/// Whether a file counts as an image by its name.
pub(crate) fn is_image(path: &Path) -> bool {
    !is_hidden(path) && ImageFormat::from_path(path).is_ok()
}

/// What is right in a folder and counts as an image by its name, in natural order; no folders, but perhaps links that
/// lead nowhere.
pub(crate) fn images(folder: &Path) -> io::Result<Vec<PathBuf>> {
    files(folder, is_image)
}

/// The same of what is `wanted`, by its path.
pub(crate) fn files(folder: &Path, wanted: impl Fn(&Path) -> bool) -> io::Result<Vec<PathBuf>> {
    let mut named = Vec::new();
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        if wanted(&path) && !path.is_dir() {
            named.push((path.file_name().unwrap_or_default().to_string_lossy().into_owned(), path));
        }
    }
    named.sort_by(|(a, _), (b, _)| natural(a, b));
    Ok(named.into_iter().map(|(_, path)| path).collect())
}

/// An image, its errors with its number; they name the file themselves.
fn load(path: &Path, number: u64) -> Result<GrayImage, FrameError> {
    load_gray(path).map_err(|error| FrameError {
        origin: leaf(path),
        frame: Some(number),
        fault: FrameFault::Image(Box::new(error)),
    })
}

fn leaf(path: &Path) -> String {
    path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
}

/// Compares names with the numbers in them taken as numbers; names that differ in leading zeros only, as text.
pub(crate) fn natural(a: &str, b: &str) -> Ordering {
    let (mut left, mut right) = (a.as_bytes(), b.as_bytes());
    while let (Some(&x), Some(&y)) = (left.first(), right.first()) {
        if x.is_ascii_digit() && y.is_ascii_digit() {
            let (m, n) = (number(&mut left), number(&mut right));
            // Of two numbers without leading zeros the longer one is larger.
            match m.len().cmp(&n.len()).then_with(|| m.cmp(n)) {
                Ordering::Equal => continue,
                other => return other,
            }
        }
        match x.cmp(&y) {
            Ordering::Equal => (left, right) = (&left[1..], &right[1..]),
            other => return other,
        }
    }
    left.len().cmp(&right.len()).then_with(|| a.cmp(b))
}

/// Takes the digits from the front, and gives them without leading zeros.
fn number<'a>(text: &mut &'a [u8]) -> &'a [u8] {
    let end = text.iter().position(|b| !b.is_ascii_digit()).unwrap_or(text.len());
    let (digits, rest) = text.split_at(end);
    *text = rest;
    let zeros = digits.iter().take_while(|&&b| b == b'0').count();
    &digits[zeros..]
}

impl FrameSource for Folder {
    fn width(&self) -> u32 {
        self.width
    }

    fn height(&self) -> u32 {
        self.height
    }

    fn read(&mut self, frame: &mut Frame) -> Result<bool, FrameError> {
        let Some(path) = self.files.next() else { return Ok(false) };
        let pixels = match self.first.take() {
            Some(first) => first,
            None => load(&path, self.next)?,
        };
        let ((width, height), expected) = (pixels.dimensions(), (self.width, self.height));
        if (width, height) != expected {
            let (expected_width, expected_height) = expected;
            let fault = FrameFault::Size { width, height, expected_width, expected_height };
            return Err(FrameError { origin: path.shown(), frame: Some(self.next), fault });
        }
        frame.pixels = pixels;
        frame.arrived = Instant::now();
        frame.index = self.next;
        frame.name = leaf(&path);
        self.next += 1;
        Ok(true)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::Luma;

    #[test]
    fn names_are_in_the_order_of_their_numbers() {
        let mut names =
            ["b1", "a10", "a9", "a", "a09", "a9b2", "a9b10", "10", "9", "a99999999999999999999999", "a1.5"];
        names.sort_by(|a, b| natural(a, b));
        let expected =
            ["9", "10", "a", "a1.5", "a09", "a9", "a9b2", "a9b10", "a10", "a99999999999999999999999", "b1"];
        assert_eq!(names, expected);
    }

    fn folder(names: &[(&str, u32)]) -> tempfile::TempDir {
        let dir = tempfile::tempdir().expect("a temporary folder");
        for (i, (name, width)) in names.iter().enumerate() {
            let path = dir.path().join(name);
            fs::create_dir_all(path.parent().expect("below")).expect("writable");
            GrayImage::from_pixel(*width, 16, Luma([i as u8])).save(path).expect("writable");
        }
        dir
    }

    fn read(folder: &mut Folder) -> Vec<(u64, String, u8)> {
        let (mut frame, mut found) = (Frame::default(), Vec::new());
        while folder.read(&mut frame).expect("sound") {
            found.push((frame.index, frame.name.clone(), frame.pixels.get_pixel(0, 0).0[0]));
        }
        found
    }

    #[test]
    fn images_follow_each_other() {
        let dir =
            folder(&[("f10.png", 17), ("f9.bmp", 17), (".f1.png", 17), ("._f9.bmp", 17), ("sub/f1.png", 17)]);
        fs::write(dir.path().join("labels.csv"), "image,x,y\n").expect("writable");
        let mut source = Folder::open(dir.path()).expect("sound");
        assert_eq!((source.width(), source.height(), source.rate()), (17, 16, None));
        assert_eq!(read(&mut source), [(0, "f9.bmp".into(), 1), (1, "f10.png".into(), 0)]);
        let mut single = Folder::single(&dir.path().join("f10.png")).expect("sound");
        assert_eq!(read(&mut single), [(0, "f10.png".into(), 0)]);
    }

    #[test]
    fn a_data_set_has_them_in_a_subfolder() {
        let dir = folder(&[("images/a.png", 16), ("images/b.png", 16)]);
        assert_eq!(read(&mut Folder::open(dir.path()).expect("sound")).len(), 2);
    }

    #[test]
    fn faults_name_the_image() {
        let error = |dir: &Path| Folder::open(dir).expect_err("faulty").to_string();
        let dir = folder(&[]);
        assert!(error(dir.path()).contains("there is no image"));
        assert!(error(&dir.path().join("no")).contains("cannot be read"));
        fs::write(dir.path().join("a.png"), "no image").expect("writable");
        assert!(error(dir.path()).starts_with("a.png, frame 0: "), "{}", error(dir.path()));

        let dir = folder(&[("a.png", 16), ("b.png", 17)]);
        let mut source = Folder::open(dir.path()).expect("sound");
        let mut frame = Frame::default();
        assert!(source.read(&mut frame).expect("sound"));
        let error = source.read(&mut frame).expect_err("another size").to_string();
        assert!(error.contains("b.png, frame 1: 17x16 pixels, where 16x16"), "{error}");
        assert!(error.contains("scale=16:16"), "{error}");
    }
}
