//! What is said of images whose size is out of proportion: larger than is useful, or small or large beside the tolerance.

use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};

use vsonar::dataset::scale::{LARGEST_USEFUL, in_proportion, useful_size, usual_tolerance};
use vsonar::dataset::{Dataset, has_turned_labels};

use super::output::{from_here, say, shell_word};

/// The command that scales the images of this folder and size, if they are larger than is useful.
pub(crate) fn command(dir: &Path, size: (u32, u32)) -> Option<String> {
    let (width, height) = useful_size(size)?;
    let dir = from_here(dir);
    let out = beside(&dir, &format!("-{width}x{height}"));
    // Labels count for images as they are stored.
    let stored = if has_turned_labels(&dir) { " --orientation ignore" } else { "" };
    Some(format!(
        "vsonar data resize {} --size {width}x{height}{stored} --out {}",
        shell_word(&dir),
        shell_word(&out)
    ))
}

/// What is said of images of this size in a folder, if they are larger than is useful.
pub(crate) fn advice(dir: &Path, size: (u32, u32)) -> Option<String> {
    let command = command(dir, size)?;
    let ((width, height), (most_wide, most_high)) = (size, LARGEST_USEFUL);
    Some(format!(
        "{width} x {height} pixels are more than is of use: beyond {most_wide} x {most_high} they only take memory and time. \
         Scale the images, labels and all: {command}"
    ))
}

/// What is said of a tolerance that is out of proportion to the height of the images.
pub(crate) fn tolerance(tolerance: f64, height: u32) -> Option<String> {
    let usual = usual_tolerance(tolerance, height)?;
    Some(format!(
        "an answer within {} counts as correct; the usual share is that of 10 rows of 240, which `--tolerance {usual}` asks for",
        in_proportion(tolerance, height)
    ))
}

/// Says on standard error what is out of proportion in the images of a run.
pub(crate) fn note(set: &Dataset, rows: f64) {
    let size = (set.width(), set.height());
    let large = set.folder().and_then(|dir| advice(dir, size));
    // Scaled images are judged by what they become.
    if let Some(note) = large.or_else(|| tolerance(rows, size.1)) {
        say(&format!("note: {note}"));
    }
}

/// A name beside a folder's, with more at its end.
fn beside(dir: &Path, more: &str) -> PathBuf {
    let real = || fs::canonicalize(dir).unwrap_or_else(|_| dir.to_path_buf());
    let dir = if dir.file_name().is_some() { dir.to_path_buf() } else { real() };
    let mut name = dir.file_name().map_or_else(|| OsString::from("images"), OsString::from);
    name.push(more);
    dir.with_file_name(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_names_the_folder() {
        let of = |dir: &str| command(Path::new(dir), (4032, 3024)).expect("large");
        assert_eq!(of("photos"), "vsonar data resize photos --size 320x240 --out photos-320x240");
        assert_eq!(
            of("/x/my photos/"),
            "vsonar data resize '/x/my photos/' --size 320x240 --out '/x/my photos-320x240'"
        );
        assert_eq!(of("-x"), "vsonar data resize ./-x --size 320x240 --out ./-x-320x240");
        // Never inside of itself.
        let here = fs::canonicalize(".").expect("there");
        let beside = format!("{}-320x240", here.display());
        assert!(of(".").ends_with(&beside), "{}", of("."));
        assert_eq!(command(Path::new("photos"), (640, 480)), None);
        assert_eq!(tolerance(10.0, 240), None);
        assert!(
            tolerance(10.0, 1080)
                .is_some_and(|text| text.contains("(0.9 %") && text.contains("--tolerance 45`"))
        );
    }
}
