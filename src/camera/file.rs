//! The camera's file: four numbers in TOML, each under its meaning.
//!
//! ```
//! use vsonar::camera::Camera;
//!
//! let camera = Camera::from_toml("height = 0.8\npitch = 51\nfield_of_view = 90\n", "camera.toml")?;
//! assert_eq!(camera.distortion, 0.0);
//! assert_eq!(Camera::from_toml(&camera.to_toml(""), "camera.toml")?, camera);
//! let wrong = Camera::from_toml("height = 0.8\npitch = 510\nfield_of_view = 90\n", "camera.toml");
//! assert!(wrong.unwrap_err().to_string().starts_with("camera.toml:2:9: "));
//! # Ok::<(), vsonar::camera::CameraFileError>(())
//! ```

use std::fmt::Write as _;
use std::io;
use std::path::{Path, PathBuf};

use serde::Deserialize;
use toml::Spanned;

use super::{Camera, CameraError};
use crate::support::bounded::Bounded;
use crate::support::printable::ShownPath as _;

/// Reads far more than any camera's file. It may come through a pipe.
const CAMERA: Bounded = Bounded::to(1 << 20).or_pipes();

/// A camera's file that cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum CameraFileError {
    /// It cannot be read.
    #[error("{}: cannot read the camera: {source}{}", path.shown(), remedy(source))]
    Read {
        /// The file.
        path: PathBuf,
        /// Why it failed.
        source: io::Error,
    },
    /// It is not TOML, or a number is missing, unknown or no number.
    #[error(
        "{file}:{line}:{column}: {message}; a camera's file gives `height` in metres, `pitch` and `field_of_view` in \
         degrees and, if there is any, `distortion`"
    )]
    Syntax {
        /// Where the text comes from.
        file: String,
        /// Line, from 1.
        line: usize,
        /// Column in characters, from 1.
        column: usize,
        /// What the parser found.
        message: String,
    },
    /// A number is impossible.
    #[error("{file}:{line}:{column}: {error}")]
    Value {
        /// Where the text comes from.
        file: String,
        /// Line, from 1.
        line: usize,
        /// Column in characters, from 1.
        column: usize,
        /// The number and what it may be.
        error: CameraError,
    },
}

fn remedy(error: &io::Error) -> &'static str {
    match error.kind() {
        io::ErrorKind::NotFound => "; check the path, or make the file with `vsonar calibrate`",
        _ => "",
    }
}

/// What the file may give.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Given {
    height: Spanned<f64>,
    pitch: Spanned<f64>,
    field_of_view: Spanned<f64>,
    distortion: Option<Spanned<f64>>,
}

impl Camera {
    /// Reads a camera's file. What depends on the image size is not checked yet; see [`Camera::check`].
    ///
    /// # Errors
    /// If the file cannot be read, or is larger than 1 MiB; else as [`Camera::from_toml`].
    pub fn load(path: &Path) -> Result<Camera, CameraFileError> {
        let unread = |source| CameraFileError::Read { path: path.to_path_buf(), source };
        let text = CAMERA.text(path).map_err(unread)?;
        Camera::from_toml(&text, &path.shown())
    }

    /// The camera that a text gives; `file` names it in errors.
    ///
    /// # Errors
    /// If the text is not TOML, a number is missing, unknown, of the wrong type, or outside its range
    /// ([`Camera::check_numbers`]).
    pub fn from_toml(text: &str, file: &str) -> Result<Camera, CameraFileError> {
        let given: Given = toml::from_str(text).map_err(|error| {
            let (line, column) = position(text, error.span().map_or(0, |span| span.start));
            let message = error.message().trim_end().replace('\n', " ");
            CameraFileError::Syntax { file: file.to_string(), line, column, message }
        })?;
        let camera = Camera {
            height: *given.height.get_ref(),
            pitch: *given.pitch.get_ref(),
            field_of_view: *given.field_of_view.get_ref(),
            distortion: given.distortion.as_ref().map_or(0.0, |k| *k.get_ref()),
        };
        camera.check_numbers().map_err(|error| {
            let span = match error {
                CameraError::Number { field: "height", .. } => given.height.span(),
                CameraError::Number { field: "pitch", .. } => given.pitch.span(),
                CameraError::Number { field: "field_of_view", .. } => given.field_of_view.span(),
                _ => given.distortion.map_or(0..0, |k| k.span()),
            };
            let (line, column) = position(text, span.start);
            CameraFileError::Value { file: file.to_string(), line, column, error }
        })?;
        Ok(camera)
    }

    /// The text of a camera's file, each number under its meaning. The lines of `note` become comments at its head.
    pub fn to_toml(&self, note: &str) -> String {
        let mut out = String::from("# A camera and how it is mounted, for `vsonar`.\n");
        for line in note.lines() {
            let _ = writeln!(out, "{}", format!("# {line}").trim_end());
        }
        for (meaning, name, value) in [
            ("Height of the lens above the floor, in metres.", "height", self.height),
            ("Angle of the optical axis below the horizontal, in degrees.", "pitch", self.pitch),
            (
                "Horizontal field of view, from the left edge to the right edge of the image, in degrees.",
                "field_of_view",
                self.field_of_view,
            ),
            (
                "Radial distortion (division model, half the image's width as unit): negative for a barrel, 0 for none.",
                "distortion",
                self.distortion,
            ),
        ] {
            let _ = write!(out, "\n# {meaning}\n{name} = {value:?}\n");
        }
        out
    }
}

/// Line and column, from 1.
fn position(text: &str, offset: usize) -> (usize, usize) {
    let before = text.get(..offset).unwrap_or(text);
    let line = before.matches('\n').count() + 1;
    let column = before.rsplit('\n').next().map_or(0, |tail| tail.chars().count()) + 1;
    (line, column)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn complaint(text: &str) -> String {
        Camera::from_toml(text, "my.toml").expect_err("not a camera").to_string()
    }

    #[test]
    fn what_is_written_reads_back() {
        for camera in [
            Camera { height: 0.8, pitch: 51.0, field_of_view: 90.0, distortion: 0.0 },
            Camera { height: 1.0 / 3.0, pitch: -0.1, field_of_view: 178.999, distortion: -1e-9 },
        ] {
            let text = camera.to_toml("images of 320 x 240 pixels\n\noff by 0.4 pixels");
            assert_eq!(Camera::from_toml(&text, "").expect("sound"), camera);
            assert!(text.contains("\n# images of 320 x 240 pixels\n#\n# off by 0.4 pixels\n"), "{text}");
        }
    }

    #[test]
    fn errors_name_the_place() {
        let rest = "pitch = 51\nfield_of_view = 90\n";
        for (text, place, said) in [
            (format!("height = 0.8\npich = 51\n{rest}"), ":2:1:", "unknown field `pich`"),
            (format!("height = \"tall\"\n{rest}"), ":1:10:", "invalid type"),
            (format!("height = 0\n{rest}"), ":1:10:", "`height` is 0, but must be 0.001 to 1000 metres"),
            (format!("height = nan\n{rest}"), ":1:10:", "NaN"),
            (format!("height = 1\n{rest}distortion = -1\n"), ":4:14:", "`distortion` is -1"),
            ("height = 1\npitch = 51\nfield_of_view = 180\n".to_string(), ":3:17:", "1 to 179 degrees"),
            ("height = 1\npitch = 5 1\n".to_string(), ":2:", "`pitch`"),
            ("height = 1\nheight = 1\n".to_string(), ":2:1:", "duplicate key"),
            (rest.to_string(), ":1:1:", "missing field `height`"),
            (String::new(), ":1:1:", "missing field"),
        ] {
            let complaint = complaint(&text);
            assert!(complaint.starts_with(&format!("my.toml{place}")), "{text}: {complaint}");
            assert!(complaint.contains(said), "{text}: {complaint}");
            assert!(!complaint.contains('\n'), "{complaint}");
        }
    }

    #[test]
    fn files_that_cannot_be_read() {
        let dir = tempfile::tempdir().expect("a temporary folder");
        let path = dir.path().join("camera.toml");
        let complaint = |path: &Path| Camera::load(path).expect_err("not a camera").to_string();
        assert!(complaint(&path).contains("vsonar calibrate"));
        std::fs::write(&path, b"height = \xff").expect("writable");
        assert!(complaint(&path).contains("UTF-8"), "{}", complaint(&path));
        let sound = "height = 1\npitch = 2\nfield_of_view = 3\n";
        std::fs::write(&path, sound).expect("writable");
        assert_eq!(Camera::load(&path).expect("sound").height, 1.0);
        // What is cut would be a camera without its distortion. The sign of two bytes lies across the limit.
        let filled = |bytes: usize| format!("{sound}#{}", "é".repeat(bytes / 2 - sound.len() / 2));
        std::fs::write(&path, filled(1 << 20) + "\ndistortion = -0.3\n").expect("writable");
        let said = complaint(&path);
        assert!(said.contains("camera.toml: cannot read the camera: it is larger than 1 MiB"), "{said}");
        std::fs::write(&path, filled((1 << 20) - 100) + "\ndistortion = -0.3\n").expect("writable");
        assert_eq!(Camera::load(&path).expect("sound").distortion, -0.3);
    }
}
