//! Where nodes stand, and how they are grouped.

/// Where in a tree a node stands. Nodes move only between like places.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Place {
    /// The iterate node itself.
    Root,
    /// Its first argument, the size of the rectangle.
    Rect,
    /// Inside its second argument, the column expression, evaluated once before the loop.
    Column,
    /// Inside its third argument, evaluated at every window position.
    Body,
}

impl std::fmt::Display for Place {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Place::Root => "root",
            Place::Rect => "rectangle",
            Place::Column => "column expression",
            Place::Body => "body",
        })
    }
}

/// What a node type is, as the published table of nodes groups them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Group {
    /// `iterate-up`, `iterate-down`.
    Root,
    /// The nineteen rectangle sizes.
    Rectangle,
    /// Pure functions of their arguments.
    Arithmetic,
    /// What is known of the case, the image and the window's position.
    Parameter,
    /// A random constant.
    Constant,
    /// Sequence, choice and early end.
    Flow,
    /// The five registers.
    Memory,
    /// The first tree's final registers, in the second tree only.
    Iter2,
    /// Averages over the window.
    Image,
}
