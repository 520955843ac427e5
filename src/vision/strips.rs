//! Fitness cases as lanes, and the window averages that their loops read.
//!
//! Executors run a group of [`LANES`] cases at a time, row by row. What a program reads at a row for all lanes of
//! a group is contiguous, and everything for one rectangle is in one arena, so that compiled code reaches every
//! operand from a single pointer:
//!
//! ```text
//! arena[o.index() * strip_len + p * LANES + l]
//!
//! o   operand                 p   position, from the top: row rect.rows(height).0 + p
//! l   lane, 0 to LANES - 1    strip_len = rect.positions(height) * LANES
//! ```
//!
//! Arenas of the columns that the cases ask for are made once and shared by all threads. Those of other columns
//! are gathered into the executor's own scratch space ([`CaseSet::gather`]).

use std::ops::Range;
use std::sync::{Arc, OnceLock};

use vsonar_ir::{Operand, Rect};

use super::arena::Arena;
use super::strip_cache::{CachedStrips, StripCache};
use super::sums::WindowSums;

/// Lanes in a group.
pub const LANES: usize = 128;

/// One fitness case, without its label.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Lane {
    /// Number of the image in the set.
    pub image: u32,
    /// The column asked for (`x-obstacle`), in pixels.
    pub column: u32,
}

/// Length of one operand's strip of a group, in binary32s: a row of [`LANES`] for each position.
pub fn strip_len(rect: Rect, height: u32) -> usize {
    rect.positions(height) as usize * LANES
}

/// Length of an arena in binary32s: strips of all sixteen operands, by [`Operand::index`].
pub fn arena_len(rect: Rect, height: u32) -> usize {
    Operand::COUNT * strip_len(rect, height)
}

/// Why images and lanes do not make a set of cases.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum CaseSetError {
    /// There is no image.
    #[error("there is no image; a set of cases needs at least one")]
    NoImages,
    /// The images are of different sizes.
    #[error(
        "image {image} has {width}x{height} pixels but image 0 has {first_width}x{first_height}; \
         all images of a set must have one size"
    )]
    ImageSize {
        /// Number of the first image that differs.
        image: usize,
        /// Its width.
        width: u32,
        /// Its height.
        height: u32,
        /// The first image's width.
        first_width: u32,
        /// The first image's height.
        first_height: u32,
    },
    /// A lane's image does not exist.
    #[error("case {lane} is of image {image}, but there are only {images} images")]
    Image {
        /// Number of the case.
        lane: usize,
        /// The image it names.
        image: u32,
        /// How many images there are.
        images: usize,
    },
    /// A lane's column is outside the image.
    #[error("case {lane} asks for column {column}, but columns are 0 to {}", .width - 1)]
    Column {
        /// Number of the case.
        lane: usize,
        /// The column it asks for.
        column: u32,
        /// The images' width.
        width: u32,
    },
}

/// The fitness cases that executors run on. Shared by all threads.
#[derive(Debug)]
pub struct CaseSet {
    images: Vec<Arc<WindowSums>>,
    lanes: Vec<Lane>,
    /// The column asked for, by group; see [`CaseSet::x_obstacle`].
    columns: Vec<[f32; LANES]>,
    /// Arenas centred on the columns asked for, by `rect.index() * groups + group`.
    arenas: Vec<OnceLock<Arena>>,
    /// Strips of other columns.
    cache: StripCache,
}

impl CaseSet {
    /// The cases `lanes` on `images`, in this order. There may be no case at all.
    ///
    /// # Errors
    /// If there is no image, the images' sizes differ, or a case's image or column does not exist.
    pub fn new(images: Vec<Arc<WindowSums>>, lanes: Vec<Lane>) -> Result<CaseSet, CaseSetError> {
        let first = images.first().ok_or(CaseSetError::NoImages)?;
        let (first_width, first_height) = (first.width(), first.height());
        for (image, sums) in images.iter().enumerate() {
            let (width, height) = (sums.width(), sums.height());
            if (width, height) != (first_width, first_height) {
                return Err(CaseSetError::ImageSize { image, width, height, first_width, first_height });
            }
        }
        for (number, &Lane { image, column }) in lanes.iter().enumerate() {
            if image as usize >= images.len() {
                return Err(CaseSetError::Image { lane: number, image, images: images.len() });
            }
            if column >= first_width {
                return Err(CaseSetError::Column { lane: number, column, width: first_width });
            }
        }
        let columns: Vec<[f32; LANES]> = lanes
            .chunks(LANES)
            .map(|group| std::array::from_fn(|l| group[l.min(group.len() - 1)].column as f32))
            .collect();
        let arenas = (0..Rect::COUNT * columns.len()).map(|_| OnceLock::new()).collect();
        let longest = Rect::all().map(|rect| strip_len(rect, images[0].height())).max().unwrap_or(0);
        let cache = StripCache::new(columns.len(), longest);
        Ok(CaseSet { images, lanes, columns, arenas, cache })
    }

    /// Bytes that all arenas of so many cases take, once programs have asked for every rectangle
    /// ([`CaseSet::x_obstacle_arena`]), on images of this height.
    pub fn arenas_memory_needed(cases: usize, height: u32) -> u64 {
        let group: u64 = Rect::all().map(|rect| arena_len(rect, height) as u64).sum();
        cases.div_ceil(LANES) as u64 * group * size_of::<f32>() as u64
    }

    /// Width of the images in pixels.
    pub fn width(&self) -> u32 {
        self.images[0].width()
    }

    /// Height of the images in pixels.
    pub fn height(&self) -> u32 {
        self.images[0].height()
    }

    /// How many cases there are.
    pub fn len(&self) -> usize {
        self.lanes.len()
    }

    /// Whether there is no case.
    pub fn is_empty(&self) -> bool {
        self.lanes.is_empty()
    }

    /// The images.
    pub fn images(&self) -> &[Arc<WindowSums>] {
        &self.images
    }

    /// The cases.
    pub fn lanes(&self) -> &[Lane] {
        &self.lanes
    }

    /// How many groups of [`LANES`] cases there are, the last perhaps with fewer.
    pub fn groups(&self) -> usize {
        self.columns.len()
    }

    /// How many cases a group has: [`LANES`] in all but the last.
    ///
    /// # Panics
    /// If there is no such group.
    pub fn group_len(&self, group: usize) -> usize {
        assert!(group < self.groups(), "there are {} groups", self.groups());
        (self.lanes.len() - group * LANES).min(LANES)
    }

    /// The window averages of a case's image; `lane` is the number of the case in the whole set.
    ///
    /// # Panics
    /// If there is no such case.
    pub fn image(&self, lane: usize) -> &WindowSums {
        &self.images[self.lanes[lane].image as usize]
    }

    /// The columns asked for by the cases of a group. In the lanes beyond the last case, that case repeats, so
    /// that they compute something harmless.
    ///
    /// # Panics
    /// If there is no such group.
    pub fn x_obstacle(&self, group: usize) -> &[f32; LANES] {
        &self.columns[group]
    }

    /// The arena of a group for windows centred on each case's own column, clamped so that the rectangle lies
    /// inside the image ([`Rect::resolve_column`]). Built at the first use; aligned to 64 bytes.
    ///
    /// # Panics
    /// If there is no such group.
    pub fn x_obstacle_arena(&self, rect: Rect, group: usize) -> &[f32] {
        assert!(group < self.groups(), "there are {} groups", self.groups());
        self.arenas[rect.index() * self.groups() + group].get_or_init(|| {
            let mut arena = Arena::zeroed(arena_len(rect, self.height()));
            let columns = self.columns[group].map(|column| rect.resolve_column(column, self.width()));
            let rows = 0..rect.positions(self.height()) as usize;
            for operand in Operand::all() {
                self.gather(group, rect, &columns, &[operand], rows.clone(), &mut arena);
            }
            arena
        })
    }

    /// Keeps strips of other columns than the cases' own ([`CaseSet::cached_strips`]) in at most about so many bytes. A
    /// new set keeps none.
    pub fn keep_strips(&self, bytes: usize) {
        self.cache.set_limit(bytes);
    }

    /// The whole strips of `operands` of a group for windows centred on an own column for each lane, if they are kept;
    /// else the caller is to [gather](CaseSet::gather) what it needs. They are kept once they are asked for again,
    /// for as long as there is room ([`CaseSet::keep_strips`]).
    ///
    /// # Panics
    /// If there is no such group, or a column is not in `rect.columns(width)`.
    pub fn cached_strips(
        &self,
        group: usize,
        rect: Rect,
        columns: &[u32; LANES],
        operands: &[Operand],
    ) -> Option<Arc<CachedStrips>> {
        assert!(group < self.groups(), "there are {} groups", self.groups());
        self.cache.get(group, rect, columns, operands, |operand, strip| {
            let rows = 0..rect.positions(self.height()) as usize;
            self.gather_strip(group, rect, columns, operand, rows, strip);
        })
    }

    /// Fills the strips of `operands` in `out`, an arena of at least [`arena_len`], for windows centred on an
    /// own column for each lane, at the positions `rows` (numbers from the top, below `rect.positions(height)`). The
    /// lanes beyond the last case read its image. The space of other operands and positions is left as it is.
    ///
    /// # Panics
    /// If there is no such group or position, `out` is too short, or a column is not in `rect.columns(width)`.
    pub fn gather(
        &self,
        group: usize,
        rect: Rect,
        columns: &[u32; LANES],
        operands: &[Operand],
        rows: Range<usize>,
        out: &mut [f32],
    ) {
        let len = strip_len(rect, self.height());
        for &operand in operands {
            let strip = &mut out[usize::from(operand.index()) * len..][..len];
            self.gather_strip(group, rect, columns, operand, rows.clone(), strip);
        }
    }

    /// Fills the positions `rows` of one operand's strip.
    fn gather_strip(
        &self,
        group: usize,
        rect: Rect,
        columns: &[u32; LANES],
        operand: Operand,
        rows: Range<usize>,
        strip: &mut [f32],
    ) {
        let first = group * LANES;
        let last = self.group_len(group) - 1;
        let mut tile = [[0.0; TILE]; LANES];
        for start in rows.clone().step_by(TILE) {
            let n = (rows.end - start).min(TILE);
            for l in 0..LANES {
                if l > last && columns[l] == columns[l - 1] {
                    // Beyond the last case all read the same.
                    tile[l] = tile[l - 1];
                } else {
                    let image = self.image(first + l.min(last));
                    image.strip_part(operand, rect, columns[l], start, &mut tile[l][..n]);
                }
            }
            interleave(&tile, &mut strip[start * LANES..][..n * LANES]);
        }
    }
}

/// Positions of a tile, which is computed lane by lane before it is interleaved: 32 KiB, about the first cache.
/// Higher or narrower tiles are slower where the tables come from memory: it is the many short streams at a time
/// that keep the memory busy.
const TILE: usize = 64;

/// Side of the squares that are turned round at a time: vector registers hold one.
const SQUARE: usize = 4;

/// Interleaves a tile: `rows[p * LANES + l] = tile[l][p]`. It goes by squares, which the compiler turns into
/// vector shuffles; positions that fill no square come one value at a time.
fn interleave(tile: &[[f32; TILE]; LANES], rows: &mut [f32]) {
    let mut bands = rows.chunks_exact_mut(LANES * SQUARE);
    let mut position = 0;
    for band in &mut bands {
        for l in (0..LANES).step_by(SQUARE) {
            let lane = |j: usize| -> [f32; SQUARE] { std::array::from_fn(|k| tile[l + j][position + k]) };
            let [a, b, c, d] = [lane(0), lane(1), lane(2), lane(3)];
            for k in 0..SQUARE {
                band[k * LANES + l..][..SQUARE].copy_from_slice(&[a[k], b[k], c[k], d[k]]);
            }
        }
        position += SQUARE;
    }
    for (p, row) in bands.into_remainder().chunks_exact_mut(LANES).enumerate() {
        for (value, lane) in row.iter_mut().zip(tile) {
            *value = lane[position + p];
        }
    }
}
