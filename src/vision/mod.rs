//! Images as the executors see them: everything that can be computed before any program runs.
//!
//! ```text
//! file ── load_gray ──> GrayImage ── Planes ──> eight operator planes ── WindowSums ──> summed-area tables
//!                                                                             │
//!                  executors <── arenas of strips, 128 fitness cases a group ── CaseSet
//! ```
//!
//! * [`mod@file`]: image files of any format, what their headers say and their pixels;
//! * [`gray`]: colour and deep samples to 8-bit gray, by the weights of BT.601;
//! * [`planes`]: the eight image operators at every pixel;
//! * [`sums`]: window averages in constant time, exact;
//! * [`strips`]: fitness cases as lanes, and the window averages of whole columns laid out for them.
//!
//! A *strip* is one operand's averages over one rectangle at every row of a column. An *arena* holds the strips
//! of all sixteen operands for a group of [`LANES`] cases, interleaved so that the cases at one row are
//! neighbours in memory.
//!
//! ```
//! use std::sync::Arc;
//! use vsonar::ir::{Operand, Rect, WindowAt, Windows};
//! use vsonar::vision::{CaseSet, LANES, Lane, WindowSums, strip_len};
//!
//! // A dark floor below row 30, a bright wall above it.
//! let image = image::GrayImage::from_fn(64, 48, |_, y| image::Luma([if y < 30 { 200 } else { 40 }]));
//! let sums = Arc::new(WindowSums::new(&image));
//! let rect = Rect::new(3, 3).expect("in the list of sizes");
//! let raw = Operand::from_name("raw").expect("an operand");
//! assert_eq!(sums.average(WindowAt { operand: raw, rect, x: 20, y: 29 }), (6.0 * 200.0 + 3.0 * 40.0) / 9.0);
//!
//! // Two fitness cases, columns 20 and 40; the raw averages at row 1, the topmost position.
//! let cases = CaseSet::new(vec![sums], vec![Lane { image: 0, column: 20 }, Lane { image: 0, column: 40 }])?;
//! let arena = cases.x_obstacle_arena(rect, 0);
//! let strip = &arena[usize::from(raw.index()) * strip_len(rect, 48)..][..strip_len(rect, 48)];
//! assert_eq!(strip[0], 200.0);
//! let lowest = rect.positions(48) as usize - 1;
//! assert_eq!(strip[lowest * LANES + 1], 40.0);
//! # Ok::<(), vsonar::vision::CaseSetError>(())
//! ```

pub mod arena;
mod error;
pub mod file;
pub mod gray;
mod jpeg;
pub mod planes;
mod strip_cache;
pub mod strips;
pub mod sums;
pub(crate) mod tiff;

pub use arena::Arena;
pub use error::ImageError;
pub use file::{
    ImageHeader, decode, decode_gray, is_turned, is_turned_bytes, load, load_gray, orientation, upright,
};
pub use gray::{DecodedImage, GRAY_WEIGHTS, to_gray};
pub use planes::Planes;
pub use strip_cache::CachedStrips;
pub use strips::{CaseSet, CaseSetError, LANES, Lane, arena_len, strip_len};
pub use sums::WindowSums;
