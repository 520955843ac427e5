//! Labelling: marking the lowest pixel that is not ground, by hand, in a web page.
//!
//! ```text
//! folder of images ──> Session ──> routes ──> page, in a browser on this machine
//!                         │ ▲
//!              every mark ▼ │ what other windows and programs have written
//!                   labels.csv, labels.skip.csv
//! ```
//! A [`Session`] holds the images of a folder, the columns asked for and the marks. Each change says what it found and
//! what it makes of it ([`Change`]), so that no window undoes unseen what another one has done; it is written to the
//! table at once, under a lock that other processes respect, and everything else in the table stays as it is.
//! [`serve`] shows it in a page.
//!
//! A label of 0 means that the column is ground all the way up, as everywhere; a column that cannot be labelled is
//! skipped, which is kept in a file of its own, for a data set does not know it.
//!
//! ```
//! use image::GrayImage;
//! use vsonar::label::{Change, Columns, Mark, Session};
//!
//! let dir = tempfile::tempdir()?;
//! GrayImage::new(64, 48).save(dir.path().join("a.png"))?;
//! let session = Session::open(dir.path(), &Columns::Spread(2))?;
//! assert_eq!(session.columns(), [16, 48]);
//! let change = Change { image: "a.png".into(), x: 16, from: None, also: vec![], to: Some(Mark::Row(20)) };
//! assert!(session.apply(vec![change])?.refused.is_empty());
//! assert_eq!(std::fs::read_to_string(dir.path().join("labels.csv"))?, "image,x,y\na.png,16,20\n");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod columns;
mod images;
mod mark;
pub mod resize;
mod routes;
mod session;
mod store;
mod table;

pub use columns::Columns;
pub use images::LeftOut;
pub use mark::{Change, Mark};
pub use routes::serve;
pub use session::{Applied, Cell, Progress, Session, SessionError};
pub use store::StoreError;
