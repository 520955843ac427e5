//! What keeps a folder from being labelled, or an image from being shown.

use std::path::PathBuf;

use super::super::images::LeftOut;
use super::super::store::StoreError;
use crate::dataset::{DatasetError, Deeper};
use crate::detector::DetectError;
use crate::support::printable::{ShownPath as _, line};
use crate::vision::ImageError;

/// Why a folder cannot be labelled.
#[derive(Debug, thiserror::Error)]
pub enum SessionError {
    /// There is no such folder.
    #[error(transparent)]
    Folder(DatasetError),
    /// There is nothing to be labelled in it.
    #[error(
        "{}: there is no image that can be labelled; PNG, JPEG, PNM, BMP and others are known by their endings{}{}",
        .dir.shown(), because(.left_out), deeper(.in_subfolders)
    )]
    NoImages {
        /// The folder.
        dir: PathBuf,
        /// What there is.
        left_out: Vec<LeftOut>,
        /// What is deeper in it.
        in_subfolders: Option<Deeper>,
    },
    /// The columns are not inside the images, or too many.
    #[error("{0}")]
    Columns(String),
    /// The labels that there are cannot be read.
    #[error(transparent)]
    Store(#[from] StoreError),
}

fn because(left_out: &[LeftOut]) -> String {
    left_out
        .first()
        .map_or(String::new(), |first| format!(" (`{}`: {})", line(&first.name), line(&first.why)))
}

fn deeper(found: &Option<Deeper>) -> String {
    found.as_ref().map_or(String::new(), |found| format!("; {found}: label such a folder by itself"))
}

/// Why an image or the detector's answers to it cannot be shown.
#[derive(Debug, thiserror::Error)]
pub(in crate::label) enum ShowError {
    #[error("there is no image of this number")]
    NoImage,
    #[error("no detector has been given; start with `--suggest PROGRAM`")]
    NoDetector,
    #[error("`{0}`: {1}")]
    Moved(String, String),
    #[error(transparent)]
    Image(#[from] ImageError),
    #[error(transparent)]
    Detect(#[from] DetectError),
}
