//! A picture with what tells its ground, and what becomes of it.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use image::GrayImage;
use serde::Serialize;

use super::mask::{Mask, surface};
use super::{ImportError, Region, Surface, Value, Values, View, label, labelme};
use crate::vision::{is_turned, load_gray};

/// Most values of a mask that are remembered for a message.
const VALUES: usize = 32;

/// A picture to be imported.
#[derive(Debug)]
pub struct Item {
    /// What it is called, with `/` between the parts of the path.
    pub name: String,
    pub(super) picture: Picture,
    pub(super) ground: Ground,
}

/// Where the picture is.
#[derive(Debug)]
pub(super) enum Picture {
    File(PathBuf),
    /// Inside this LabelMe file.
    Embedded(PathBuf),
}

/// What tells the ground.
#[derive(Debug)]
pub(super) enum Ground {
    Mask {
        path: PathBuf,
        ground: Arc<Values>,
        ignored: Arc<Values>,
    },
    /// Regions, each over those before it.
    Regions {
        /// The file that they are from.
        annotation: PathBuf,
        /// The size of the picture, as that file says.
        said: Option<(u64, u64)>,
        /// What is seen where no region is.
        base: Surface,
        regions: Vec<(Region, Surface)>,
    },
}

/// A picture that was left out.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Serialize)]
pub struct LeftOut {
    /// What it is called.
    pub name: String,
    /// Why.
    pub reason: String,
}

/// The pictures that were found.
#[derive(Debug, Default)]
pub struct Found {
    /// Those to be imported, in order.
    pub items: Vec<Item>,
    /// Those that cannot be, because something is not there.
    pub left_out: Vec<LeftOut>,
    /// Those whose annotation makes no sense.
    pub faulty: Vec<(String, ImportError)>,
    /// All labels that occur; of masks none.
    pub labels: BTreeSet<String>,
}

impl Found {
    pub(super) fn leave_out(&mut self, name: impl Into<String>, reason: impl Into<String>) {
        self.left_out.push(LeftOut { name: name.into(), reason: reason.into() });
    }
}

/// A picture as the detector sees it, with its labels.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Labelled {
    /// The gray picture.
    pub pixels: GrayImage,
    /// Columns and their labels, in the order of the columns asked for.
    pub labels: Vec<(u32, u32)>,
    /// Columns without a label, because it depends on ignored pixels.
    pub undecided: usize,
    /// Whether any pixel of these columns is ground.
    pub any_ground: bool,
    /// Some of the values that the mask has in these columns.
    pub values: BTreeSet<Value>,
}

impl Item {
    /// The picture, in gray, as it is.
    ///
    /// # Errors
    /// If it cannot be read or decoded, or asks to be turned.
    pub fn picture(&self) -> Result<GrayImage, ImportError> {
        match &self.picture {
            Picture::File(path) if is_turned(path) => Err(ImportError::Turned { path: path.clone() }),
            Picture::File(path) => Ok(load_gray(path)?),
            Picture::Embedded(path) => labelme::embedded(path),
        }
    }

    fn path(&self) -> &Path {
        let (Picture::File(path) | Picture::Embedded(path)) = &self.picture;
        path
    }

    /// The size that the picture gets, in pixels.
    ///
    /// # Errors
    /// If it cannot be read or decoded, or not be seen so.
    pub fn size(&self, view: &View) -> Result<(u32, u32), ImportError> {
        self.size_of(view, self.picture()?.dimensions())
    }

    fn size_of(&self, view: &View, original: (u32, u32)) -> Result<(u32, u32), ImportError> {
        view.size_of(original).map_err(|source| ImportError::View { path: self.path().into(), source })
    }

    /// The picture cut and scaled, and the labels of these of its columns, which are below the width of `size`, the size
    /// that every picture must get.
    ///
    /// # Errors
    /// If picture or mask cannot be read, do not fit together, or the result has another size.
    pub fn labelled(&self, view: &View, size: (u32, u32), columns: &[u32]) -> Result<Labelled, ImportError> {
        let picture = self.picture()?;
        let original = picture.dimensions();
        let own = self.size_of(view, original)?;
        if own != size {
            return Err(ImportError::Uneven { path: self.path().into(), size: own, first: size });
        }
        let (xs, ys): (Vec<u32>, Vec<u32>) =
            (view.columns(original).collect(), view.rows(original).collect());
        let fits = |annotation: &Path, said: (u64, u64)| match said == (original.0.into(), original.1.into())
        {
            true => Ok(()),
            false => Err(ImportError::Sizes {
                annotation: annotation.into(),
                said,
                picture: self.path().into(),
                size: original,
            }),
        };
        let mut out = Labelled {
            pixels: GrayImage::default(),
            labels: Vec::with_capacity(columns.len()),
            undecided: 0,
            any_ground: false,
            values: BTreeSet::new(),
        };
        let mut seen = Vec::with_capacity(ys.len());
        let mut note = |column: u32, seen: &[Surface]| {
            out.any_ground |= seen.contains(&Surface::Ground);
            match label(seen) {
                Some(row) => out.labels.push((column, row)),
                None => out.undecided += 1,
            }
        };
        match &self.ground {
            Ground::Mask { path, ground, ignored } => {
                let mask = Mask::load(path, ground.are_colours())?;
                fits(path, (mask.size().0.into(), mask.size().1.into()))?;
                for &column in columns {
                    seen.clear();
                    for &y in &ys {
                        let value = mask.value(xs[column as usize], y);
                        if out.values.len() < VALUES {
                            out.values.insert(value);
                        }
                        seen.push(surface(value, ground, ignored));
                    }
                    note(column, &seen);
                }
            }
            Ground::Regions { annotation, said, base, regions } => {
                said.map_or(Ok(()), |said| fits(annotation, said))?;
                let mut all = Vec::with_capacity(original.1 as usize);
                for &column in columns {
                    all.clear();
                    all.resize(original.1 as usize, *base);
                    regions
                        .iter()
                        .for_each(|(region, surface)| region.paint(xs[column as usize], *surface, &mut all));
                    seen.clear();
                    seen.extend(ys.iter().map(|&y| all[y as usize]));
                    note(column, &seen);
                }
            }
        }
        let pixels = view.of(picture);
        out.pixels = pixels.map_err(|source| ImportError::View { path: self.path().into(), source })?;
        Ok(out)
    }
}
