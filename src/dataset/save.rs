//! Writing a set as a folder that [`Dataset::load`] reads back.
//!
//! The folder appears in one step, complete, or not at all: it is written beside its place under another name
//! and renamed.
//!
//! ```
//! use image::GrayImage;
//! use vsonar::dataset::{Case, Dataset, NamedImage};
//!
//! let images = vec![NamedImage { name: "a.png".into(), pixels: GrayImage::new(16, 16) }];
//! let set = Dataset::new("saved", images, vec![Case { image: 0, x: 3, y: 5 }])?;
//! let place = tempfile::tempdir()?;
//! set.save(place.path().join("saved"))?;
//! assert_eq!(Dataset::load(place.path().join("saved"))?, set);
//! assert!(set.save(place.path().join("saved")).is_err()); // never overwritten
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use std::collections::BTreeSet;
use std::fs::{self, File};
use std::io::{Cursor, Write};
use std::path::{Path, PathBuf};

use image::ImageFormat;

use super::Dataset;
use super::scan::{IMAGES, TABLE};
use crate::support::durable;
use crate::support::printable::ShownPath as _;
use crate::support::temporary::{self, TemporaryFolder};

/// Why a set could not be written.
#[derive(Debug, thiserror::Error)]
pub enum SaveError {
    /// The folder exists, or a file of that name.
    #[error("{} exists already; choose another name or remove it first", .0.shown())]
    Exists(PathBuf),
    /// The path has no last part to create, like `/` or `..`.
    #[error("{} does not name a new folder", .0.shown())]
    NoName(PathBuf),
    /// The system refused.
    #[error(
        "{} cannot be written: {cause}; is the folder it is to be in there, may one write to it, and is there room?",
        .path.shown()
    )]
    Io {
        /// What was to be written, by its final name.
        path: PathBuf,
        /// The system's words.
        cause: String,
    },
}

impl Dataset {
    /// Writes the set as a new folder: `labels.csv`, and the images as PNG in `images`. A name that does not
    /// end in `.png` gets this ending, so a set with such names comes back with longer ones. The parent
    /// folder must exist.
    ///
    /// # Errors
    /// If something of that name exists (nothing is ever overwritten), or the system refuses to write.
    pub fn save(&self, dir: impl AsRef<Path>) -> Result<(), SaveError> {
        let dir = dir.as_ref();
        if dir.file_name().is_none() {
            return Err(SaveError::NoName(dir.into()));
        }
        if dir.symlink_metadata().is_ok() {
            return Err(SaveError::Exists(dir.into()));
        }
        temporary::clear(dir);
        let part = TemporaryFolder::beside(dir).map_err(|e| io(dir, e))?;
        for (name, bytes) in self.files() {
            let path = part.path().join(&name);
            let write = || {
                path.parent().map_or(Ok(()), fs::create_dir_all)?;
                let mut file = File::create(&path)?;
                file.write_all(&bytes)?;
                if name == TABLE { durable::sync_file(&file, dir) } else { Ok(()) }
            };
            write().map_err(|e| io(&dir.join(&name), e))?;
        }
        part.place(dir).map_err(|e| io(dir, e))
    }

    /// The files of the folder that [`Dataset::save`] writes, by path in it: an image at a time, made when it is asked
    /// for, and the table as the last.
    pub fn files(&self) -> impl Iterator<Item = (String, Vec<u8>)> {
        let names = self.png_names();
        let table = self.table(&names);
        let images = self.images.iter().zip(names).map(|(image, name)| {
            let mut png = Cursor::new(Vec::new());
            image.pixels.write_to(&mut png, ImageFormat::Png).expect("memory can be written");
            (format!("{IMAGES}/{name}"), png.into_inner())
        });
        images.chain(std::iter::once((TABLE.to_string(), table)))
    }

    /// The table of the cases, with these names of the images.
    fn table(&self, names: &[String]) -> Vec<u8> {
        let mut table = csv::Writer::from_writer(Vec::new());
        let fields = if self.has_groups() { 4 } else { 3 };
        let mut row = |all: [&str; 4]| table.write_record(&all[..fields]).expect("memory can be written");
        row(["image", "x", "y", "group"]);
        for case in &self.cases {
            let (x, y, group) = (case.x.to_string(), case.y.to_string(), self.group(case.image));
            row([&names[case.image], &x, &y, group.unwrap_or_default()]);
        }
        table.into_inner().expect("memory can be written")
    }

    /// The names as PNG files, all different.
    fn png_names(&self) -> Vec<String> {
        let mut taken: BTreeSet<String> = self.images.iter().map(|i| i.name.clone()).collect();
        let png = |name: &str| name.ends_with(".png");
        let mut rename = |name: &String| {
            let mut name = name.clone();
            while !png(&name) {
                name.push_str(".png");
                if !taken.insert(name.clone()) {
                    // another image has this name: make it different and try again
                    name.push('_');
                }
            }
            name
        };
        self.images.iter().map(|i| rename(&i.name)).collect()
    }
}

fn io(path: &Path, cause: impl std::fmt::Display) -> SaveError {
    SaveError::Io { path: path.into(), cause: cause.to_string() }
}
