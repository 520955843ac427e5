//! What can be wrong with pictures and annotations.

use std::io;
use std::path::{Path, PathBuf};

use super::ViewError;
use crate::support::bounded::with_remedy;
use crate::support::printable::{ShownPath as _, line};
use crate::vision::ImageError;

/// Why a picture, or all of an annotation, cannot be imported.
#[derive(Debug, thiserror::Error)]
pub enum ImportError {
    /// A file or folder cannot be read.
    #[error("{}: cannot be read: {}", .path.shown(), with_remedy(.source))]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// There is no such folder.
    #[error("{}: there is no such folder; check the path", .0.shown())]
    NoFolder(PathBuf),
    /// An annotation is of another form than the one asked for.
    #[error("{}: {problem}", .path.shown())]
    Form {
        /// The file.
        path: PathBuf,
        /// What it is or lacks, and what to do.
        problem: String,
    },
    /// An annotation is no JSON, or not of the form expected.
    #[error("{}: {source}; export the annotations anew, or mend the file there", .path.shown())]
    Json {
        /// The file.
        path: PathBuf,
        /// What is wrong, with line and column.
        source: serde_json::Error,
    },
    /// Something in an annotation makes no sense.
    #[error("{}: {place}: {}", .path.shown(), line(.problem))]
    At {
        /// The file.
        path: PathBuf,
        /// Where in it, as `shapes[3].points[1]`.
        place: String,
        /// What is wrong, and what to do.
        problem: String,
    },
    /// An annotation names a file that is not inside the folder.
    #[error(
        "{}: {place}: `{}` is not a path below the folder of the images; only those are followed: {remedy}",
        .path.shown(), line(.name)
    )]
    Outside {
        /// The annotation.
        path: PathBuf,
        /// Where in it.
        place: String,
        /// The path that stands there.
        name: String,
        /// What to do.
        remedy: &'static str,
    },
    /// A picture is annotated twice, and differently.
    #[error(
        "{second}: tells another ground of the picture {} than {first} does; remove the wrong one of the two", .picture.shown()
    )]
    Twice {
        /// Where it is annotated again.
        second: String,
        /// Where it is annotated first.
        first: String,
        /// The picture, or the file that it is in.
        picture: PathBuf,
    },
    /// A picture cannot be decoded.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// A picture asks viewers to turn it.
    #[error(
        "{}: has an orientation tag, by which viewers turn the picture and what was marked in it, but detectors see it as it is \
         stored; save picture and annotation upright, without the tag",
        .path.shown()
    )]
    Turned {
        /// The picture, or the file that it is in.
        path: PathBuf,
    },
    /// A mask cannot be used.
    #[error("{}: {}", .path.shown(), line(.problem))]
    Mask {
        /// The mask.
        path: PathBuf,
        /// What is wrong, and what to do.
        problem: String,
    },
    /// Picture and annotation are of different sizes.
    #[error(
        "{}: is of {}x{} pixels, and the picture {} has {}x{}; {}",
        .annotation.shown(), .said.0, .said.1, .picture.shown(), .size.0, .size.1, remedy(*.said, *.size)
    )]
    Sizes {
        /// The mask, or the annotation.
        annotation: PathBuf,
        /// The size that it is of.
        said: (u64, u64),
        /// The picture.
        picture: PathBuf,
        /// The picture's size.
        size: (u32, u32),
    },
    /// The wanted part is not in the picture.
    #[error("{}: {source}", .path.shown())]
    View {
        /// The picture.
        path: PathBuf,
        /// Why not.
        source: ViewError,
    },
    /// The picture becomes one of another size than those before.
    #[error(
        "{}: becomes {}x{} pixels, and the first picture {}x{}; bring all to one size with `--size {}x{}`",
        .path.shown(), .size.0, .size.1, .first.0, .first.1, .first.0, .first.1
    )]
    Uneven {
        /// The picture.
        path: PathBuf,
        /// The size that it becomes.
        size: (u32, u32),
        /// The size of the others.
        first: (u32, u32),
    },
}

/// What to do about two sizes.
fn remedy(said: (u64, u64), (width, height): (u32, u32)) -> &'static str {
    if said == (height.into(), width.into()) {
        "if it is a photo with an orientation tag, which is ignored here, save it upright"
    } else {
        "find the one that belongs to it, or scale it before"
    }
}

impl ImportError {
    pub(super) fn read(path: &Path, source: io::Error) -> ImportError {
        ImportError::Read { path: path.into(), source }
    }

    /// Refuses what is no folder that can be searched: without this each of its files would be missing.
    pub(super) fn unless_folder(path: &Path) -> Result<(), ImportError> {
        use io::ErrorKind::{NotADirectory, NotFound};
        match path.join(".").metadata() {
            Ok(_) => Ok(()),
            Err(error) if matches!(error.kind(), NotFound | NotADirectory) => {
                Err(ImportError::NoFolder(path.into()))
            }
            Err(error) => Err(ImportError::read(path, error)),
        }
    }

    pub(super) fn form(path: &Path, problem: impl Into<String>) -> ImportError {
        ImportError::Form { path: path.into(), problem: problem.into() }
    }

    pub(super) fn at(path: &Path, place: impl Into<String>, problem: impl Into<String>) -> ImportError {
        ImportError::At { path: path.into(), place: place.into(), problem: problem.into() }
    }

    pub(super) fn mask(path: &Path, problem: impl Into<String>) -> ImportError {
        ImportError::Mask { path: path.into(), problem: problem.into() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn photos_that_lie_on_their_side_are_told() {
        let sizes = |said| ImportError::Sizes {
            annotation: "a.json".into(),
            said,
            picture: "a.jpg".into(),
            size: (40, 30),
        };
        let text = sizes((30, 40)).to_string();
        assert!(text.starts_with("a.json: is of 30x40 pixels, and the picture a.jpg has 40x30; "), "{text}");
        assert!(text.contains("upright") && !sizes((41, 30)).to_string().contains("upright"));
    }
}
