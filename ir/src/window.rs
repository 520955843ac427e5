//! Window operands: the image operators, their two moments, and the nineteen rectangle sizes.
//!
//! The one table of operators is here; the formula of each is in [`crate::formula::image`].

macro_rules! operators {
    ($( $(#[$doc:meta])* $operator:ident $name:literal, 0 to $max:literal, $letter:literal: $about:literal; )*) => {
        /// An image operator: a value computed at every pixel (see [`crate::formula::image`] for the formulas).
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
        #[repr(u8)]
        pub enum Operator {
            $( $(#[$doc])* $operator, )*
        }

        impl Operator {
            /// How many there are.
            pub const COUNT: usize = Operator::ALL.len();

            /// All of them, in the order of their numbers.
            pub const ALL: [Operator; [$( Operator::$operator ),*].len()] = [$( Operator::$operator ),*];

            /// The name in program text.
            pub const fn name(self) -> &'static str {
                match self { $( Operator::$operator => $name, )* }
            }

            /// The largest value a pixel can have.
            pub const fn max(self) -> u32 {
                match self { $( Operator::$operator => $max, )* }
            }

            /// The letter that short names of its averages are made of.
            pub const fn letter(self) -> char {
                match self { $( Operator::$operator => $letter, )* }
            }

            /// How it is computed, in words.
            pub const fn about(self) -> &'static str {
                match self { $( Operator::$operator => $about, )* }
            }
        }

        /// The names of operands, by their index.
        const OPERANDS: [&str; 2 * Operator::COUNT] = {
            let names = [$( [$name, concat!($name, "-sq")] ),*];
            let (mut flat, mut i) = ([""; 2 * Operator::COUNT], 0);
            while i < flat.len() {
                flat[i] = names[i / 2][i % 2];
                i += 1;
            }
            flat
        };
    };
}

operators! {
    /// The pixel itself, 0 to 255.
    Raw "raw", 0 to 255, 'l': "The pixel itself.";
    /// The truncated median of the 3 x 3 neighbourhood, 0 to 255.
    Median "median", 0 to 255, 'm':
        "The truncated median of a neighbourhood: sorted, then cut at the end farther from the median.";
    /// Absolute difference of the pixel and the median of its neighbourhood, 0 to 255.
    MedianCorner "median-corner", 0 to 255, 'k':
        "Absolute difference of a pixel and the median of its neighbourhood, which is sorted.";
    /// Sobel gradient magnitude, rounded, 0 to 1443.
    Gradient "gradient", 0 to 1443, 'g':
        "Magnitude of the Sobel gradient: the root, found bit by bit, is rounded to the nearest integer.";
    /// Squared difference to the right neighbour, 0 to 65025.
    MoravecHorizontal "moravec-horizontal", 0 to 65025, 'h':
        "Squared difference of a pixel and its neighbour in one direction.";
    /// Squared difference to the neighbour below, 0 to 65025.
    MoravecVertical "moravec-vertical", 0 to 65025, 'v':
        "Squared difference of a pixel and its neighbour in one direction.";
    /// Squared difference to the neighbour right and above, 0 to 65025.
    MoravecSlash "moravec-slash", 0 to 65025, 's':
        "Squared difference of a pixel and its neighbour in one direction.";
    /// Squared difference to the neighbour right and below, 0 to 65025.
    MoravecBackslash "moravec-backslash", 0 to 65025, 't':
        "Squared difference of a pixel and its neighbour in one direction.";
}

/// Which power of the operator's values is averaged over the window.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[repr(u8)]
pub enum Moment {
    /// The average of the values.
    Mean,
    /// The average of the squared values (written with `-sq` after the operator's name).
    MeanSquare,
}

/// What a window instruction reads: one operator's moment over the window at the current position.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Operand {
    /// The image operator.
    pub operator: Operator,
    /// The moment of it.
    pub moment: Moment,
}

impl Operand {
    /// How many operands there are.
    pub const COUNT: usize = OPERANDS.len();

    /// All of them, by [`Operand::index`].
    pub fn all() -> impl ExactSizeIterator<Item = Operand> {
        (0..Self::COUNT as u8).map(|i| Self::from_index(i).expect("below the count"))
    }

    /// `2 * operator + moment`.
    pub const fn index(self) -> u8 {
        self.operator as u8 * 2 + self.moment as u8
    }

    /// The operand with this index.
    pub const fn from_index(index: u8) -> Option<Operand> {
        if index as usize >= Self::COUNT {
            return None;
        }
        let moment = if index & 1 == 0 { Moment::Mean } else { Moment::MeanSquare };
        Some(Operand { operator: Operator::ALL[index as usize / 2], moment })
    }

    /// The largest value averaged: the operator's, or its square.
    pub const fn max(self) -> u64 {
        let max = self.operator.max() as u64;
        match self.moment {
            Moment::Mean => max,
            Moment::MeanSquare => max * max,
        }
    }

    /// The name in program text: the operator's, with `-sq` for the average of squares.
    pub const fn name(self) -> &'static str {
        OPERANDS[self.index() as usize]
    }

    /// The operand of this name.
    pub fn from_name(name: &str) -> Option<Operand> {
        Self::all().find(|o| o.name() == name)
    }
}

/// A rectangle size, one of the nineteen of the language (the first, 2x2, by default). Sizes are in pixels.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Rect(u8);

const SIZES: [(u8, u8); Rect::COUNT] = [
    (2, 2),
    (2, 3),
    (3, 2),
    (3, 3),
    (2, 4),
    (4, 2),
    (4, 4),
    (5, 5),
    (2, 6),
    (6, 2),
    (3, 6),
    (6, 3),
    (6, 6),
    (7, 7),
    (2, 8),
    (8, 2),
    (3, 8),
    (8, 3),
    (8, 8),
];

impl Rect {
    /// How many rectangle sizes there are.
    pub const COUNT: usize = 19;

    /// All sizes, by [`Rect::index`].
    pub fn all() -> impl ExactSizeIterator<Item = Rect> {
        (0..Self::COUNT as u8).map(Rect)
    }

    /// The rectangle of this size, if it is in the list.
    ///
    /// ```
    /// use vsonar_ir::Rect;
    /// assert_eq!(Rect::new(2, 3).map(|r| (r.width(), r.height())), Some((2, 3)));
    /// assert_eq!(Rect::new(5, 3), None);
    /// ```
    pub fn new(width: u32, height: u32) -> Option<Rect> {
        Self::all().find(|r| (r.width(), r.height()) == (width, height))
    }

    /// The rectangle written `WxH`, as in `3x8`.
    pub fn from_name(name: &str) -> Option<Rect> {
        let (w, h) = name.split_once('x')?;
        Self::all().find(|r| w == r.width().to_string() && h == r.height().to_string())
    }

    /// Position in the list of sizes, 0 to 18.
    pub const fn index(self) -> usize {
        self.0 as usize
    }

    /// The rectangle at this position in the list of sizes.
    pub fn from_index(index: usize) -> Option<Rect> {
        (index < Self::COUNT).then_some(Rect(index as u8))
    }

    /// Width in pixels.
    pub const fn width(self) -> u32 {
        SIZES[self.0 as usize].0 as u32
    }

    /// Height in pixels.
    pub const fn height(self) -> u32 {
        SIZES[self.0 as usize].1 as u32
    }

    /// Pixels inside.
    pub const fn area(self) -> u32 {
        self.width() * self.height()
    }

    /// Distance from the leftmost column covered to the centre: the rectangle centred on `x` covers columns
    /// `x - left()` to `x - left() + width() - 1`.
    pub const fn left(self) -> u32 {
        (self.width() - 1) / 2
    }

    /// Distance from the topmost row covered to the centre.
    pub const fn top(self) -> u32 {
        (self.height() - 1) / 2
    }

    /// Smallest and largest centre column at which the rectangle lies wholly inside an image `width` wide.
    pub const fn columns(self, width: u32) -> (u32, u32) {
        (self.left(), width - self.width() + self.left())
    }

    /// Smallest and largest centre row at which the rectangle lies wholly inside an image `height` high.
    pub const fn rows(self, height: u32) -> (u32, u32) {
        (self.top(), height - self.height() + self.top())
    }

    /// How many positions an iteration visits in an image `height` high.
    pub const fn positions(self, height: u32) -> u32 {
        height - self.height() + 1
    }

    /// The largest average there is: that of a window full of the operator's largest value
    /// ([`Operand::max`]), its sum rounded to binary32 and divided by the area. Both steps are monotone, so no
    /// window exceeds it, though for squares it may lie beside the largest value itself.
    pub const fn largest_average(self, operand: Operand) -> f32 {
        (operand.max() * self.area() as u64) as f32 / self.area() as f32
    }
}

impl std::fmt::Display for Rect {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}x{}", self.width(), self.height())
    }
}

/// One window average: which operand, over which rectangle, centred where.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct WindowAt {
    /// The operator and moment.
    pub operand: Operand,
    /// The rectangle's size.
    pub rect: Rect,
    /// The centre's column, in pixels.
    pub x: u32,
    /// The centre's row, in pixels from the top.
    pub y: u32,
}

/// What answers for window averages: an image's window sums, or any function in tests.
pub trait Windows {
    /// The average over the window: +0, or from 1 / area, rounded, to [`Rect::largest_average`], as the average of
    /// whole numbers is. The optimiser relies on it. The rectangle lies wholly inside the image.
    fn average(&self, at: WindowAt) -> f32;
}

impl<F: Fn(WindowAt) -> f32 + ?Sized> Windows for F {
    fn average(&self, at: WindowAt) -> f32 {
        self(at)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_and_indices_agree() {
        for (i, operand) in Operand::all().enumerate() {
            assert_eq!(operand.index() as usize, i);
            assert_eq!(Operand::from_name(operand.name()), Some(operand));
            let sq = operand.moment == Moment::MeanSquare;
            assert_eq!(operand.name(), format!("{}{}", operand.operator.name(), if sq { "-sq" } else { "" }));
        }
        for rect in Rect::all() {
            assert_eq!(Rect::from_name(&rect.to_string()), Some(rect));
            assert_eq!(Rect::from_index(rect.index()), Some(rect));
        }
        assert_eq!(Rect::from_name("03x3"), None);
        assert_eq!(Rect::from_name("+3x3"), None);
    }

    #[test]
    fn rectangles_stay_inside() {
        for rect in Rect::all() {
            let (lo, hi) = rect.columns(16);
            assert_eq!(lo - rect.left(), 0);
            assert_eq!(hi - rect.left() + rect.width(), 16);
            let (lo, hi) = rect.rows(16);
            assert_eq!(lo - rect.top(), 0);
            assert_eq!(hi - rect.top() + rect.height(), 16);
            assert_eq!(hi - lo + 1, rect.positions(16));
        }
    }
}
