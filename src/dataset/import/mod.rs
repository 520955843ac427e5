//! Data sets from what others have annotated: masks, LabelMe, COCO.
//!
//! ```text
//! masks:   a mask for each picture ──┐
//! labelme: a JSON file for each ─────┼──> Item ── View, columns ──> Labelled: gray picture, rows
//! coco:    one JSON file for all ────┘
//! ```
//!
//! What is ground is decided for the pixels of the original picture; then a part is cut out and scaled ([`View`]), and the
//! [`label`] of a column is that of the original pixels in whose middle the pixels of the result lie. So a label is right
//! for the picture as the detector sees it, and only the columns that are asked for are looked at.
//!
//! ```
//! use vsonar::dataset::import::{Surface, View, label};
//!
//! // a column of the original, ground below row 5, seen at half the size
//! let column: Vec<Surface> = (0..32).map(|y| if y > 5 { Surface::Ground } else { Surface::Other }).collect();
//! let view = View { crop: None, size: Some((16, 16)) };
//! let seen: Vec<Surface> = view.rows((32, 32)).map(|y| column[y as usize]).collect();
//! assert_eq!(label(&seen), Some(2));
//! ```

mod bounded;
mod classes;
pub mod coco;
mod coco_file;
mod error;
mod item;
mod json;
pub mod labelme;
mod mask;
pub mod masks;
mod names;
mod region;
mod rle;
mod surface;
mod view;

pub use classes::{Classes, Occurrence, ValueCounts};
pub use error::ImportError;
pub use item::{Found, Item, Labelled, LeftOut, SkippedObjects};
pub use mask::{ParseValuesError, Value, Values};
pub use names::{Labels, Named, Names};
pub use region::Region;
pub use rle::{Runs, RunsError};
pub use surface::{Surface, label};
pub use view::{Crop, View, ViewError};
