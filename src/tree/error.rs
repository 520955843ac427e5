//! What can be wrong with a program's text, and where.

use std::path::PathBuf;

use vsonar_ir::Rect;

use super::individual::{MAX_DEPTH, MAX_NODES, TreeError};
use super::node::{Node, NodeType};
use crate::support::printable::ShownPath as _;

/// A position in a text: line and column, both counted from 1, the column in characters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Position {
    /// The line.
    pub line: usize,
    /// The character in the line.
    pub column: usize,
}

impl std::fmt::Display for Position {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "line {}, column {}", self.line, self.column)
    }
}

/// Why a text is not a program.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{at}: {kind}")]
pub struct ParseError {
    /// Where the fault is.
    pub at: Position,
    /// What the fault is.
    pub kind: ParseErrorKind,
}

const FORM: &str = "a program is `(individual T1 T2)`, or `(individual T)` with one tree";
const TREE: &str = "a tree is `(iterate-up RECT COLUMN BODY)` or `(iterate-down RECT COLUMN BODY)`";

/// What is wrong with a program's text. Names are as the text has them, quoted, cut if long.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ParseErrorKind {
    /// There is nothing but space and comments.
    #[error("the text is empty; {FORM}")]
    Empty,
    /// The text does not begin as a program.
    #[error("expected `(individual`, found {found}; {FORM}")]
    NotIndividual {
        /// What is there.
        found: String,
    },
    /// Something else where a tree is due.
    #[error("expected a tree, found {found}; {TREE}")]
    NotATree {
        /// What is there.
        found: String,
    },
    /// `(individual)`.
    #[error("the individual has no tree; {FORM}")]
    NoTree,
    /// An individual of more than two trees.
    #[error("an individual has one tree or two, and this is a third")]
    ThirdTree,
    /// Something after the individual.
    #[error("nothing may follow the individual; found {found}")]
    Trailing {
        /// What is there.
        found: String,
    },
    /// The text ends before a parenthesis is closed.
    #[error("the text ends inside `({name}`, opened at {opened}; a `)` is missing")]
    Unclosed {
        /// What the innermost open parenthesis encloses.
        name: String,
        /// Where it is.
        opened: Position,
    },
    /// An opening parenthesis without a name after it.
    #[error("expected the name of a function after `(`, found {found}")]
    NoName {
        /// What is there.
        found: String,
    },
    /// No node has this name.
    #[error("unknown node {name}{}", .suggestion.map_or_else(String::new, |s| format!("; did you mean `{s}`?")))]
    Unknown {
        /// The name.
        name: String,
        /// The node with the nearest name, if one is near.
        suggestion: Option<&'static str>,
    },
    /// A function without parentheses.
    #[error("`{name}` takes {}: write `({name}{})`", count(*.arity), letters(*.arity))]
    NeedsParentheses {
        /// The function.
        name: String,
        /// How many arguments it takes.
        arity: usize,
    },
    /// A leaf in parentheses.
    #[error("{name} takes no arguments, and stands without parentheses")]
    LeafInParentheses {
        /// The leaf.
        name: String,
    },
    /// A function with too few arguments.
    #[error("`{name}` takes {}, and has {given}", count(*.arity))]
    TooFew {
        /// The function.
        name: String,
        /// How many arguments it takes.
        arity: usize,
        /// How many it has.
        given: usize,
    },
    /// A function with too many arguments.
    #[error("`{name}` takes {}, and here is one more", count(*.arity))]
    TooMany {
        /// The function.
        name: String,
        /// How many arguments it takes.
        arity: usize,
    },
    /// A tree that does not begin with an iterate node.
    #[error("a tree does not begin with {name}; {TREE}")]
    NotARoot {
        /// What it begins with.
        name: String,
    },
    /// An iterate node below the root.
    #[error("{name} is below the root; an iterate node is the root of a tree, and nowhere else")]
    IterateBelowRoot {
        /// The iterate node.
        name: String,
    },
    /// Something else where a rectangle size is due, or a size that is not in the list.
    #[error("{found} is not a rectangle size; the sizes are {}", sizes())]
    NotARectangle {
        /// What is there.
        found: String,
    },
    /// A rectangle size in an expression.
    #[error("the rectangle size {name} can only be the first argument of an iterate node")]
    RectangleMisplaced {
        /// The size.
        name: String,
    },
    /// A node in a column expression that makes no sense before the loop.
    #[error(
        "{name} cannot stand in a column expression, which is evaluated before there is a window; use \
         arithmetic, constants, `x-obstacle`, `window-area`, `image-max-x`, `image-max-y` and, in a second \
         tree, `iter2-a` to `iter2-e`"
    )]
    WindowDependent {
        /// The node.
        name: String,
    },
    /// `iter2-*` in a first or only tree.
    #[error("{name} reads the registers of the first tree, so only the second of two trees can hold it")]
    Iter2 {
        /// The node.
        name: String,
    },
    /// A word that begins like a number and is none.
    #[error("{found} is not a number; constants are decimal, such as `-0.25` or `3.4e38`")]
    NotANumber {
        /// The word.
        found: String,
    },
    /// An infinity or a NaN.
    #[error("{found} is not a constant; constants are finite decimal numbers, such as `-0.25` or `3.4e38`")]
    NotFinite {
        /// The word.
        found: String,
    },
    /// A number beyond the range of binary32.
    #[error("{found} is too large for a constant; the largest magnitude is `3.4028235e38`")]
    Overflow {
        /// The number.
        found: String,
    },
    /// A tree deeper than [`MAX_DEPTH`].
    #[error("nested too deeply; a tree may be {MAX_DEPTH} deep")]
    TooDeep,
    /// A tree of more than [`MAX_NODES`] nodes.
    #[error("the program is too large; a tree may have {MAX_NODES} nodes")]
    TooLarge,
    /// Any other fault of the tree as a whole.
    #[error(transparent)]
    Tree(TreeError),
}

impl ParseErrorKind {
    pub(super) fn at(self, at: Position) -> ParseError {
        ParseError { at, kind: self }
    }
}

/// Why a file is not a program. Every message begins with the file's name.
#[derive(Debug, thiserror::Error)]
pub enum ProgramFileError {
    /// The file cannot be read.
    #[error("{}: cannot be read: {source}", path.shown())]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// The file is not text.
    #[error("{}: line {line}: not valid UTF-8; a program is plain text", path.shown())]
    NotText {
        /// The file.
        path: PathBuf,
        /// The line with the first invalid byte.
        line: usize,
    },
    /// The text is not a program.
    #[error("{}: {source}", path.shown())]
    Parse {
        /// The file.
        path: PathBuf,
        /// Where and why.
        source: ParseError,
    },
}

/// A word in quotes for a message: control characters escaped, cut if long.
pub(super) fn quote(word: &str) -> String {
    const LONGEST: usize = 40;
    let mut escaped: String = word.chars().take(LONGEST).flat_map(char::escape_debug).collect();
    if word.chars().nth(LONGEST).is_some() {
        escaped.push('…');
    }
    format!("`{escaped}`")
}

fn count(arity: usize) -> String {
    format!("{arity} argument{}", if arity == 1 { "" } else { "s" })
}

fn letters(arity: usize) -> String {
    ["A", "B", "C", "D"].iter().take(arity).map(|letter| format!(" {letter}")).collect()
}

fn sizes() -> String {
    Rect::all().map(|rect| rect.to_string()).collect::<Vec<_>>().join(" ")
}

/// The name nearest to a misspelt one, if it is near.
pub(super) fn suggestion(word: &str) -> Option<&'static str> {
    let word: Vec<char> = word.chars().take(64).collect();
    let near = word.len().div_ceil(3).min(3);
    NodeType::all()
        .filter(|t| !matches!(t.node(), Node::Constant(_) | Node::Rect(_)))
        .map(|t| (edits(&word, &t.name().chars().collect::<Vec<_>>()), t.name()))
        .filter(|&(distance, name)| distance <= near && distance < name.len())
        .min_by_key(|&(distance, _)| distance)
        .map(|(_, name)| name)
}

/// The fewest insertions, deletions, substitutions and exchanges of neighbours that turn one word into the other
/// (optimal string alignment).
fn edits(from: &[char], to: &[char]) -> usize {
    let mut before: Vec<usize> = Vec::new();
    let mut last: Vec<usize> = (0..=to.len()).collect();
    for i in 1..=from.len() {
        let mut row = vec![i];
        for j in 1..=to.len() {
            let same = from[i - 1] == to[j - 1];
            let mut best = (last[j] + 1).min(row[j - 1] + 1).min(last[j - 1] + usize::from(!same));
            if i > 1 && j > 1 && from[i - 1] == to[j - 2] && from[i - 2] == to[j - 1] {
                best = best.min(before[j - 2] + 1);
            }
            row.push(best);
        }
        before = std::mem::replace(&mut last, row);
    }
    last[to.len()]
}
