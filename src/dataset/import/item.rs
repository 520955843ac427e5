//! A picture with what tells its ground, and what becomes of it.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use image::GrayImage;
use serde::Serialize;

use super::mask::Mask;
use super::{Classes, ImportError, Region, Surface, ValueCounts, View, label, labelme};
use crate::vision::{ImageHeader, is_turned, load_gray};

/// Bytes that an embedded picture is taken to need for each byte of its file.
const EMBEDDED: u64 = 40;

/// A picture to be imported.
#[derive(Debug)]
pub struct Item {
    /// What it is called, with `/` between the parts of the path.
    pub name: String,
    pub(super) picture: Picture,
    pub(super) ground: Ground,
    /// Where its ground is told, for messages: a file, with the place in it where it tells that of several pictures.
    pub(super) source: String,
}

/// Where the picture is.
#[derive(Debug)]
pub(super) enum Picture {
    File(PathBuf),
    /// Inside a LabelMe file.
    Embedded {
        /// The file.
        path: PathBuf,
        /// Tells other pictures from it.
        digest: u64,
    },
}

/// What tells a picture from all others, however it is named.
#[derive(Debug, PartialEq, Eq, Hash)]
enum Identity {
    File(PathBuf),
    Content(u64),
}

impl Picture {
    fn identity(&self) -> Identity {
        match self {
            Picture::File(path) => Identity::File(path.canonicalize().unwrap_or_else(|_| path.clone())),
            Picture::Embedded { digest, .. } => Identity::Content(*digest),
        }
    }
}

/// What tells the ground.
#[derive(Debug)]
pub(super) enum Ground {
    Mask {
        path: PathBuf,
        classes: Arc<Classes>,
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

impl Ground {
    /// Whether the ground is the same as another one of the same picture.
    fn is(&self, other: &Ground) -> bool {
        match (self, other) {
            (Ground::Mask { path, .. }, Ground::Mask { path: other, .. }) => path == other,
            (Ground::Regions { base, regions, .. }, Ground::Regions { base: b, regions: r, .. }) => {
                base == b && regions == r
            }
            _ => false,
        }
    }
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
    /// Why objects that were asked for make no sense; their pictures are among the items, without them.
    pub faulty_objects: Vec<ImportError>,
    /// Objects that do not count.
    pub skipped: SkippedObjects,
    /// All labels that occur; of masks none.
    pub labels: BTreeSet<String>,
}

/// Objects that do not count, by the reason.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
#[serde(transparent)]
pub struct SkippedObjects(BTreeMap<String, Skipped>);

#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
struct Skipped {
    objects: usize,
    first: String,
}

impl SkippedObjects {
    /// Number of objects.
    pub fn count(&self) -> usize {
        self.0.values().map(|skipped| skipped.objects).sum()
    }

    /// Reasons, with the number of objects and where the first one is.
    pub fn reasons(&self) -> impl Iterator<Item = (&str, usize, &str)> {
        self.0.iter().map(|(reason, skipped)| (reason.as_str(), skipped.objects, skipped.first.as_str()))
    }
}

impl Found {
    /// Notes an object that does not count.
    pub(super) fn skip(&mut self, reason: impl Into<String>, place: impl FnOnce() -> String) {
        let skipped = self.skipped.0.entry(reason.into());
        skipped.or_insert_with(|| Skipped { objects: 0, first: place() }).objects += 1;
    }

    /// Takes every picture once. Of several items of one picture the first one stays if all tell the same ground; else
    /// none does, for nobody knows which is right.
    pub(super) fn unite(mut self) -> Found {
        let mut places: HashMap<Identity, usize> = HashMap::new();
        let mut kept: Vec<Option<Item>> = Vec::with_capacity(self.items.len());
        let mut contradictory = BTreeSet::new();
        for item in std::mem::take(&mut self.items) {
            let place = *places.entry(item.picture.identity()).or_insert(kept.len());
            let Some(Some(first)) = kept.get(place) else {
                kept.push(Some(item));
                continue;
            };
            if first.ground.is(&item.ground) {
                self.leave_out(item.name, format!("it is in {} already, with the same ground", first.source));
            } else {
                let (first, picture) = (first.source.clone(), item.path().into());
                self.faulty.push((item.name, ImportError::Twice { second: item.source, first, picture }));
                contradictory.insert(place);
            }
        }
        contradictory.into_iter().for_each(|place| kept[place] = None);
        self.items = kept.into_iter().flatten().collect();
        self
    }

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
    /// The values that the mask has in these columns, at the rows that the result shows.
    pub values: ValueCounts,
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
            Picture::Embedded { path, .. } => labelme::embedded(path),
        }
    }

    fn path(&self) -> &Path {
        let (Picture::File(path) | Picture::Embedded { path, .. }) = &self.picture;
        path
    }

    /// The size that the picture gets, in pixels.
    ///
    /// # Errors
    /// If its header cannot be read, or it cannot be seen so.
    pub fn size(&self, view: &View) -> Result<(u32, u32), ImportError> {
        let size = match &self.picture {
            Picture::File(path) => ImageHeader::read(path).map(|header| (header.width, header.height))?,
            Picture::Embedded { .. } => self.picture()?.dimensions(),
        };
        self.size_of(view, size)
    }

    /// Bytes that reading the picture and its mask takes at most. What cannot be read counts as nothing.
    pub fn memory_needed(&self) -> u64 {
        let decoding = |path: &Path| ImageHeader::read(path).map_or(0, |header| header.memory_needed());
        let picture = match &self.picture {
            Picture::File(path) => decoding(path),
            // Text, of which three quarters are an image; what that takes once decoded only its own header tells.
            Picture::Embedded { path, .. } => path.metadata().map_or(0, |about| EMBEDDED * about.len()),
        };
        match &self.ground {
            // A number of two bytes for each pixel, too.
            Ground::Mask { path, .. } => picture.saturating_add(2 * decoding(path)),
            Ground::Regions { .. } => picture,
        }
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
            values: ValueCounts::default(),
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
            Ground::Mask { path, classes } => {
                let mask = Mask::load(path, classes.ground.are_colours())?;
                fits(path, (mask.size().0.into(), mask.size().1.into()))?;
                let mut values = Vec::with_capacity(ys.len());
                for &column in columns {
                    values.clear();
                    values.extend(ys.iter().map(|&y| mask.value(xs[column as usize], y)));
                    out.values.add(&values);
                    seen.clear();
                    seen.extend(values.iter().map(|&value| classes.surface(value)));
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
