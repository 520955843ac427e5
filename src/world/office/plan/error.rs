//! Why a text is no plan.

/// Why a text is no plan: the line, counted from 1, and what to do.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PlanError {
    /// The text does not begin with its header.
    #[error("line {line}: a plan begins with the line `plan 1`")]
    Header {
        /// The line.
        line: usize,
    },
    /// The text is longer than any plan.
    #[error("the text has {bytes} bytes; a plan has at most {most}")]
    TooLong {
        /// Its length.
        bytes: usize,
        /// The most that is read.
        most: usize,
    },
    /// A word that nothing is known of.
    #[error("line {line}: nothing is known of `{word}`; a line begins with one of {known}")]
    Unknown {
        /// The line.
        line: usize,
        /// Its first word.
        word: String,
        /// What it could be.
        known: String,
    },
    /// Too few or too many numbers.
    #[error("line {line}: `{keyword}` has {found} numbers; give {wanted}")]
    Count {
        /// The line.
        line: usize,
        /// Its first word.
        keyword: String,
        /// How many follow.
        found: usize,
        /// What has to follow.
        wanted: String,
    },
    /// Something that is not a number.
    #[error("line {line}: {name} is `{text}`, which is no number")]
    Number {
        /// The line.
        line: usize,
        /// Which number it is.
        name: &'static str,
        /// What stands there.
        text: String,
    },
    /// A number out of its range.
    #[error("line {line}: {name} is {value}; choose {low} to {high}")]
    Range {
        /// The line.
        line: usize,
        /// Which number it is.
        name: &'static str,
        /// What it is.
        value: f64,
        /// The least allowed.
        low: f64,
        /// The most allowed.
        high: f64,
    },
    /// The far end of a rectangle is not beyond its near end.
    #[error("line {line}: the rectangle is empty; each `from` is less than its `to`, by 1 cm at least")]
    Empty {
        /// The line.
        line: usize,
    },
    /// Something that a plan has once stands there again.
    #[error("line {line}: there is a line `{keyword}` already; take one of them out")]
    Twice {
        /// The line.
        line: usize,
        /// Its first word.
        keyword: String,
    },
    /// More of a kind than is built.
    #[error("line {line}: more than {most} lines of this kind; a plan has at most so many")]
    TooMany {
        /// The line.
        line: usize,
        /// The most that are read.
        most: usize,
    },
    /// No free floor.
    #[error("there is no `room`; add one, as `room 0 10 -1 1`")]
    NoRoom,
    /// More floor than is lit in reasonable time and memory.
    #[error(
        "the rooms cover {area:.0} m² of floor within {bounds:.0} m²; at most {most_area:.0} within {most_bounds:.0} are built"
    )]
    TooLarge {
        /// The sum of the rooms' areas.
        area: f64,
        /// The area of the rectangle around them.
        bounds: f64,
        /// The most that is built.
        most_area: f64,
        /// The most that is built.
        most_bounds: f64,
    },
    /// Rooms that overlap in so many ways that their walls are too many.
    #[error("there are {walls} walls around the rooms; at most {most} are built: let fewer rooms overlap")]
    Walls {
        /// How many there are.
        walls: usize,
        /// The most that are built.
        most: usize,
    },
    /// More wall than is lit in reasonable time and memory: rooms that are long and thin.
    #[error(
        "the walls around the rooms are {length:.0} m long; at most {most:.0} m are built: let rooms be wider, or fewer"
    )]
    Length {
        /// How long they are together, in metres.
        length: f64,
        /// The most that is built.
        most: f64,
    },
    /// A door or pane that is on no wall.
    #[error("line {line}: no wall is within 10 cm of ({x}, {y}); give the middle of the opening, on a wall")]
    NoWall {
        /// The line.
        line: usize,
        /// Where it should be.
        x: f64,
        /// Where it should be.
        y: f64,
    },
    /// Something that stands outside of every room.
    #[error("line {line}: ({x}, {y}) is in no room; move it, or add a room")]
    Outside {
        /// The line.
        line: usize,
        /// Where it is.
        x: f64,
        /// Where it is.
        y: f64,
    },
}
