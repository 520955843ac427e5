//! What no picture can be rendered by.

/// Why pictures cannot be rendered.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SetupError {
    /// The pictures are too small or too large.
    #[error(
        "pictures of {width}x{height} pixels cannot be rendered; choose {least}x{least} to {most}x{most}"
    )]
    Size {
        /// The width asked for.
        width: u32,
        /// The height asked for.
        height: u32,
        /// The least side.
        least: u32,
        /// The largest side.
        most: u32,
    },
    /// No columns, or more than there are pixels.
    #[error("{columns} columns do not fit in pictures {width} pixels wide; choose 1 to {width}")]
    Columns {
        /// The columns asked for.
        columns: u32,
        /// The width asked for.
        width: u32,
    },
    /// No frames, or more than names are made for.
    #[error("{0} frames cannot be rendered; choose 1 to {MOST_FRAMES}")]
    Frames(usize),
    /// A setting is not a number or out of its range.
    #[error("the setting {name} is {value}; choose {low} to {high}")]
    Setting {
        /// Its name.
        name: &'static str,
        /// Its value.
        value: f64,
        /// The least value allowed.
        low: f64,
        /// The largest value allowed.
        high: f64,
    },
}

/// The least side of a picture, in pixels.
const LEAST: u32 = 16;
/// The most pictures of a set: their names have four digits.
const MOST_FRAMES: usize = 10_000;

/// Whether pictures of this size, of sides up to `most`, can be rendered and labelled at so many columns.
pub(super) fn check_size(width: u32, height: u32, most: u32, columns: u32) -> Result<(), SetupError> {
    if ![width, height].iter().all(|side| (LEAST..=most).contains(side)) {
        return Err(SetupError::Size { width, height, least: LEAST, most });
    }
    if !(1..=width).contains(&columns) {
        return Err(SetupError::Columns { columns, width });
    }
    Ok(())
}

pub(super) fn check_frames(frames: usize) -> Result<(), SetupError> {
    if (1..=MOST_FRAMES).contains(&frames) { Ok(()) } else { Err(SetupError::Frames(frames)) }
}

/// Whether each of these settings, a name and a value, is within the two limits that follow.
pub(super) fn check_settings(
    settings: impl IntoIterator<Item = (&'static str, f64, f64, f64)>,
) -> Result<(), SetupError> {
    match settings.into_iter().find(|(_, value, low, high)| !(*low..=*high).contains(value)) {
        Some((name, value, low, high)) => Err(SetupError::Setting { name, value, low, high }),
        None => Ok(()),
    }
}

/// The labelled ones among the columns of a picture: so many, each in the middle of its share.
pub(super) fn labelled(width: u32, columns: u32) -> impl Iterator<Item = u32> {
    let (width, columns) = (u64::from(width), u64::from(columns));
    (0..columns).map(move |i| ((2 * (2 * i + 1) * width + 2 * columns - 1) / (4 * columns)) as u32)
}
