//! What people see of a detector: pictures of its answers.
//!
//! A picture shows one image as the paper's Figures 1 and 2 do: in each column a white bar over what the
//! detector takes for ground and a black one over what it takes for an obstacle, and a cross at the ideal answer
//! ([`draw`] tells the rules), or the answers of several detectors side by side ([`draw_several`]); a contact sheet
//! shows many of them, with captions; an [`Overlay`] draws the same over the frames of a camera. All are plain images in
//! memory; whoever asked for them writes them. A [`page`] tells all of a run, or of several.
//!
//! ```
//! use image::{GrayImage, Luma, Rgb};
//! use vsonar::report::{Column, Style, Tile, contact_sheet, draw};
//!
//! // a gray wall above a dark floor
//! let image = GrayImage::from_fn(64, 48, |_, y| Luma([if y < 20 { 180 } else { 60 }]));
//! let columns = [Column { x: 16, label: 19, answer: 21.5 }, Column { x: 48, label: 19, answer: 40.0 }];
//! let style = Style { scale: 2, ..Style::default() };
//! let picture = draw(&image, &columns, &style);
//! assert_eq!(picture.dimensions(), (128, 96));
//! assert_eq!(*picture.get_pixel(2 * 16, 2 * 5), Rgb([0, 0, 0])); // obstacle, says the detector
//! assert_eq!(*picture.get_pixel(2 * 16, 2 * 45), Rgb([255, 255, 255])); // ground, says the detector
//!
//! let correct = columns.iter().filter(|c| c.is_correct(style.tolerance)).count();
//! let tile = Tile::new(&picture, "frame_1.png", correct, columns.len());
//! let sheet = contact_sheet(&[tile], 4, "one picture");
//! assert!(sheet.width() > 128);
//! ```

mod canvas;
pub(crate) mod font;
mod names;
mod overlay;
pub mod page;
mod palette;
mod picture;
pub(crate) mod scale;
mod several;
mod sheet;
#[cfg(test)]
mod tests;

pub use names::short_names;
pub use overlay::{Mark, Overlay};
pub use picture::{Column, MAX_SCALE, Style, draw, fitting_scale};
pub use several::{LEGEND_SEVERAL, MOST_DETECTORS, draw_several, letter, with_lines};
pub use sheet::{LEGEND, Tile, contact_sheet, contact_sheet_png};
