//! What part of a picture is wanted, and of what size.

use image::imageops::{self, FilterType};
use image::{GrayImage, SubImage};
use vsonar_ir::Program;

/// A rectangle of pixels to be cut out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Crop {
    /// Its first column.
    pub left: u32,
    /// Its first row, from the top.
    pub top: u32,
    /// Its width in pixels.
    pub width: u32,
    /// Its height in pixels.
    pub height: u32,
}

/// The way from an original picture to the one that is wanted: first cut out, then scaled.
///
/// Gray levels are scaled by `image`'s triangle filter, which takes in every pixel when it makes a picture smaller.
/// What is ground at a pixel of the result is what is ground at the original pixel that holds its centre.
///
/// ```
/// use vsonar::dataset::import::{Crop, View};
///
/// let crop = Crop { left: 10, top: 20, width: 64, height: 48 };
/// let view = View { crop: Some(crop), size: Some((32, 24)) };
/// assert_eq!(view.size_of((100, 100))?, (32, 24));
/// // the middle of pixel 3 of 32 is the edge between pixels 6 and 7 of the 64 that begin at 10: the right one of them
/// assert_eq!(view.columns((100, 100)).nth(3), Some(17));
/// assert!(view.size_of((50, 100)).is_err(), "the rectangle reaches out of the picture");
/// # Ok::<(), vsonar::dataset::import::ViewError>(())
/// ```
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct View {
    /// What is cut out; nothing for all of the picture.
    pub crop: Option<Crop>,
    /// Width and height in pixels that it is then scaled to; nothing to leave it as it is. Proportions are not kept
    /// unless they are those of what was cut out.
    pub size: Option<(u32, u32)>,
}

/// A picture that cannot be seen so.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ViewError {
    /// The rectangle reaches out of the picture.
    #[error(
        "the part of {}x{} pixels at column {} and row {} reaches out of the picture, which has {width}x{height}; \
         choose another `--crop`",
        .crop.width, .crop.height, .crop.left, .crop.top
    )]
    Outside {
        /// The rectangle.
        crop: Crop,
        /// Width of the picture in pixels.
        width: u32,
        /// Height of the picture in pixels.
        height: u32,
    },
    /// The result has a size that no detector works with.
    #[error(
        "{width}x{height} pixels are left of it, and each side must have {} to {}; choose another `--crop`, or scale \
         it with `--size`",
        Program::MIN_SIDE,
        Program::MAX_SIDE
    )]
    Side {
        /// Width of the result in pixels.
        width: u32,
        /// Height of the result in pixels.
        height: u32,
    },
}

impl View {
    /// The size of the result, of a picture of this size.
    ///
    /// # Errors
    /// If the rectangle is not inside the picture, or the result has a side that no detector works with.
    pub fn size_of(&self, (width, height): (u32, u32)) -> Result<(u32, u32), ViewError> {
        if let Some(crop) = self.crop {
            let inside = |from: u32, length: u32, all: u32| u64::from(from) + u64::from(length) <= all.into();
            if !inside(crop.left, crop.width, width) || !inside(crop.top, crop.height, height) {
                return Err(ViewError::Outside { crop, width, height });
            }
        }
        let part = self.part((width, height));
        let (width, height) = self.size.unwrap_or((part.width, part.height));
        // An empty part of a picture cannot be scaled to anything.
        match Program::fits(width, height) && part.width.min(part.height) > 0 {
            true => Ok((width, height)),
            false => Err(ViewError::Side { width: width.min(part.width), height: height.min(part.height) }),
        }
    }

    fn part(&self, (width, height): (u32, u32)) -> Crop {
        self.crop.unwrap_or(Crop { left: 0, top: 0, width, height })
    }

    /// The original column that holds the centre of each column of the result, for a picture of this size.
    pub fn columns(&self, size: (u32, u32)) -> impl ExactSizeIterator<Item = u32> + use<> {
        let part = self.part(size);
        centres(part.left, part.width, self.size.map_or(part.width, |(width, _)| width))
    }

    /// The original row that holds the centre of each row of the result.
    pub fn rows(&self, size: (u32, u32)) -> impl ExactSizeIterator<Item = u32> + use<> {
        let part = self.part(size);
        centres(part.top, part.height, self.size.map_or(part.height, |(_, height)| height))
    }

    /// The largest part in the middle of a picture of this size that has the proportions of `wanted`, scaled to it.
    ///
    /// ```
    /// use vsonar::dataset::import::{Crop, View};
    ///
    /// let view = View::filling((4032, 2268), (320, 240));
    /// assert_eq!(view.crop, Some(Crop { left: 504, top: 0, width: 3024, height: 2268 }));
    /// assert_eq!(View::filling((4032, 3024), (320, 240)).crop, None);
    /// ```
    pub fn filling((width, height): (u32, u32), wanted: (u32, u32)) -> View {
        // A side in proportion to the other, rounded; at least a pixel, at most all there are.
        let part = |other: u32, num: u32, den: u32, all: u32| {
            let (num, den) = (u64::from(num), u64::from(den.max(1)));
            let side = (u64::from(other) * num + den / 2) / den;
            side.clamp(1, u64::from(all.max(1))) as u32
        };
        let (w, h) = (part(height, wanted.0, wanted.1, width), part(width, wanted.1, wanted.0, height));
        let crop =
            Crop { left: (width - w.min(width)) / 2, top: (height - h.min(height)) / 2, width: w, height: h };
        View { crop: ((w, h) != (width, height)).then_some(crop), size: Some(wanted) }
    }

    /// The column of the result in which the middle of a column of the picture lies, for a picture of this size; `None` if it
    /// is cut off.
    pub fn column_of(&self, size: (u32, u32), x: u32) -> Option<u32> {
        let part = self.part(size);
        let x = x.checked_sub(part.left).filter(|&x| x < part.width)?;
        let columns = u64::from(self.size.map_or(part.width, |(width, _)| width));
        // Below `columns`, as x is below the part's width.
        Some(((2 * u64::from(x) + 1) * columns / (2 * u64::from(part.width))) as u32)
    }

    /// The label in the result of a column whose label is `y` in a picture of this size: the lowest row whose middle is at `y`
    /// or above it, for below it all is ground.
    ///
    /// 0, ground all the way up, stays so, and a label above what is cut out becomes it. `None` for a label below what is cut
    /// out: whether the rows that are left are ground, it does not tell.
    pub fn label_of(&self, size: (u32, u32), y: u32) -> Option<u32> {
        let part = self.part(size);
        match y {
            0 => Some(0),
            y if y >= part.top.saturating_add(part.height) => None,
            y => Some((self.rows(size).take_while(|&row| row <= y).count() as u32).saturating_sub(1)),
        }
    }

    /// The picture as it is wanted.
    ///
    /// # Errors
    /// As [`View::size_of`].
    pub fn of(&self, picture: GrayImage) -> Result<GrayImage, ViewError> {
        let (width, height) = self.size_of(picture.dimensions())?;
        let part = self.part(picture.dimensions());
        let cut = match self.crop {
            None => picture,
            Some(_) => SubImage::new(&picture, part.left, part.top, part.width, part.height).to_image(),
        };
        Ok(match cut.dimensions() == (width, height) {
            true => cut,
            false => imageops::resize(&cut, width, height, FilterType::Triangle),
        })
    }
}

/// Of `from .. from + length`, divided into `parts` equal parts, the pixel in the middle of each; of two the second.
fn centres(from: u32, length: u32, parts: u32) -> impl ExactSizeIterator<Item = u32> {
    let (length, parts64) = (u64::from(length), u64::from(parts));
    // Below `length`, as i is below `parts`.
    (0..parts).map(move |i| from + ((2 * u64::from(i) + 1) * length / (2 * parts64)) as u32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::Luma;

    #[test]
    fn pixels_are_where_their_centres_are() {
        let all = View::default();
        assert_eq!(all.columns((20, 16)).collect::<Vec<_>>(), (0..20).collect::<Vec<_>>());
        let third = View { crop: None, size: Some((20, 16)) };
        assert_eq!(
            third.columns((60, 16)).collect::<Vec<_>>(),
            (0..20).map(|i| 3 * i + 1).collect::<Vec<_>>()
        );
        assert_eq!(third.rows((60, 8)).collect::<Vec<_>>(), (0..16).map(|i| i / 2).collect::<Vec<_>>());
        let crop = Crop { left: 5, top: 7, width: 40, height: 32 };
        let part = View { crop: Some(crop), size: Some((16, 16)) };
        assert_eq!(part.columns((60, 60)).map(|x| x - 5).collect::<Vec<_>>()[..4], [1, 3, 6, 8]);
        assert!(part.rows((60, 60)).all(|y| (7..39).contains(&y)));
    }

    #[test]
    fn pictures_are_cut_and_scaled() {
        let picture = GrayImage::from_fn(64, 40, |x, y| Luma([(x + 2 * y) as u8]));
        assert_eq!(View::default().of(picture.clone()), Ok(picture.clone()));
        let crop = Crop { left: 8, top: 4, width: 32, height: 36 };
        let cut = View { crop: Some(crop), size: None }.of(picture.clone()).expect("inside");
        assert_eq!((cut.dimensions(), cut.get_pixel(3, 5).0), ((32, 36), [8 + 3 + 2 * (4 + 5)]));
        let half = View { crop: Some(crop), size: Some((16, 18)) }.of(picture.clone()).expect("inside");
        // A ramp stays one: the middle of pixel 3 is between 6 and 7.
        let expected = |x: u32, y: u32| f64::from(8 + 2 * x + 2 * (4 + 2 * y)) + 1.5;
        for (x, y) in [(3, 5), (8, 8), (12, 3)] {
            assert!((f64::from(half.get_pixel(x, y).0[0]) - expected(x, y)).abs() <= 0.51);
        }
        let plain = GrayImage::from_pixel(64, 40, Luma([77]));
        let scaled = View { crop: None, size: Some((19, 33)) }.of(plain).expect("inside");
        assert!(scaled.pixels().all(|p| p.0 == [77]));
    }

    #[test]
    fn pictures_are_filled_from_their_middle() {
        let crop = |picture, wanted| View::filling(picture, wanted).crop;
        assert_eq!(
            crop((3024, 4032), (320, 240)),
            Some(Crop { left: 0, top: 882, width: 3024, height: 2268 })
        );
        assert_eq!(
            crop((1920, 1080), (320, 240)),
            Some(Crop { left: 240, top: 0, width: 1440, height: 1080 })
        );
        // Less than half a pixel too much is no reason to cut.
        assert_eq!([crop((1365, 1024), (320, 240)), crop((1920, 1080), (320, 180))], [None; 2]);
        for picture in [(1, 65_535), (65_535, 1), (17, 23), (u32::MAX, 16)] {
            for wanted in [(16, 16), (320, 240), (16, 65_535), (65_535, 16)] {
                let view = View::filling(picture, wanted);
                assert_eq!(view.size_of(picture), Ok(wanted), "{picture:?} {wanted:?}");
                let part = view.part(picture);
                assert!(part.width == picture.0 || part.height == picture.1, "{picture:?} {wanted:?}");
            }
        }
    }

    /// A label is carried as an import of the picture would have found it, with an obstacle from the label up.
    #[test]
    fn labels_are_carried_as_an_import_finds_them() {
        use super::super::Surface::{Ground, Other};
        let (width, height) = (50, 90);
        let whole = [None, Some((20, 16)), Some((160, 180)), Some((33, 91))];
        let views = whole.map(|size| View { crop: None, size }).into_iter().chain([
            View::filling((width, height), (20, 20)),
            View::filling((width, height), (16, 60)),
            View { crop: Some(Crop { left: 3, top: 10, width: 40, height: 80 }), size: None },
        ]);
        for view in views {
            let part = view.part((width, height));
            let last = view.size_of((width, height)).expect("inside").1 - 1;
            for y in 0..height {
                let surface = |row: u32| if y > 0 && row <= y { Other } else { Ground };
                let seen: Vec<_> = view.rows((width, height)).map(surface).collect();
                let expected = (y == 0 || y < part.top + part.height)
                    .then(|| super::super::label(&seen).expect("known"));
                assert_eq!(view.label_of((width, height), y), expected, "{view:?} {y}");
            }
            assert_eq!(view.label_of((width, height), 0), Some(0), "ground all the way up stays so");
            let bottom = (part.top + part.height == height).then_some(last);
            assert_eq!(
                view.label_of((width, height), height - 1),
                bottom,
                "{view:?}: an obstacle at the bottom"
            );
        }
    }

    #[test]
    fn columns_are_where_their_middles_are() {
        let half =
            View { crop: Some(Crop { left: 10, top: 0, width: 64, height: 48 }), size: Some((32, 24)) };
        let of = |x| half.column_of((100, 48), x);
        assert_eq!([9, 10, 11, 12, 73, 74].map(of), [None, Some(0), Some(0), Some(1), Some(31), None]);
        // The six columns of a photograph are the six of the small picture.
        for columns in [1, 3, 6, 12] {
            let view = View::filling((4032, 3024), (320, 240));
            let before = crate::dataset::spread(columns, 4032);
            let after: Vec<u32> = before.iter().filter_map(|&x| view.column_of((4032, 3024), x)).collect();
            assert_eq!(after, crate::dataset::spread(columns, 320), "{columns}");
        }
        // Back and forth: what shows the middle of a column is that column.
        let view = View { crop: None, size: Some((21, 16)) };
        for (column, x) in view.columns((63, 48)).enumerate() {
            assert_eq!(view.column_of((63, 48), x), Some(column as u32));
        }
    }

    #[test]
    fn what_cannot_be_seen() {
        let crop =
            |left, top, width, height| View { crop: Some(Crop { left, top, width, height }), size: None };
        for outside in
            [crop(41, 0, 60, 40), crop(0, 81, 60, 20), crop(u32::MAX, 0, 20, 20), crop(1, 1, u32::MAX, 20)]
        {
            assert!(matches!(outside.size_of((100, 100)), Err(ViewError::Outside { .. })), "{outside:?}");
        }
        for small in [crop(0, 0, 15, 40), crop(99, 0, 0, 40)] {
            assert!(matches!(small.size_of((100, 100)), Err(ViewError::Side { .. })), "{small:?}");
        }
        let empty = View { size: Some((32, 32)), ..crop(0, 0, 0, 40) };
        assert!(empty.size_of((100, 100)).is_err());
        assert_eq!(crop(40, 60, 60, 40).size_of((100, 100)), Ok((60, 40)));
    }
}
