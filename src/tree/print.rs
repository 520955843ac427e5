//! The printer of `.gp` text: [`Display`](std::fmt::Display) of individuals, trees and constants.
//!
//! `{}` wraps and indents for reading; `{:#}` is one line. Both read back as the same individual.

use std::borrow::Cow;
use std::fmt::{Display, Formatter, Result, Write};

use super::individual::{Individual, Tree};
use super::node::Node;

/// The line length that wrapping aims at.
const WIDTH: usize = 100;

/// Indentation stops growing here, or the text of a deep tree would be mostly spaces.
const MAX_INDENT: usize = 60;

/// Arguments up to this long stay on the line of their function when the call as a whole does not fit.
const SHORT: usize = 40;

/// Prints a binary32 with the fewest digits that read back as the same bits, with an exponent where the number
/// would be long: below 0.00001, and from 10⁹. Infinities are `inf` and `-inf`, any NaN is `NaN`; neither is a
/// constant of a program.
///
/// ```
/// use vsonar::tree::Shortest;
///
/// let printed: Vec<String> = [0.1, -0.0, 16777216.0, f32::MAX, 1e-45].map(|v| Shortest(v).to_string()).into();
/// assert_eq!(printed, ["0.1", "-0", "16777216", "3.4028235e38", "1e-45"]);
/// ```
#[derive(Debug, Clone, Copy)]
pub struct Shortest(
    /// The value to print.
    pub f32,
);

impl Display for Shortest {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        let value = self.0;
        if value == 0.0 || !value.is_finite() || (1e-5..1e9).contains(&value.abs()) {
            write!(f, "{value}")
        } else {
            write!(f, "{value:e}")
        }
    }
}

impl Display for Tree {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        Printer::new(self).tree(f, 0)
    }
}

impl Display for Individual {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        f.write_str("(individual")?;
        for tree in self.trees() {
            if f.alternate() {
                f.write_char(' ')?;
            } else {
                new_line(f, 2)?;
            }
            Printer::new(tree).tree(f, 2)?;
        }
        f.write_char(')')
    }
}

fn new_line(f: &mut Formatter<'_>, indent: usize) -> Result {
    write!(f, "\n{:indent$}", "")
}

/// How a node is written.
fn word(node: Node) -> Cow<'static, str> {
    match node {
        Node::Constant(value) => Shortest(value).to_string().into(),
        _ => node.name().into(),
    }
}

struct Printer<'a> {
    nodes: &'a [Node],
    words: Vec<Cow<'static, str>>,
    /// For every subtree its length on one line.
    flat: Vec<usize>,
}

impl<'a> Printer<'a> {
    fn new(tree: &'a Tree) -> Printer<'a> {
        let nodes = tree.nodes();
        let words: Vec<_> = nodes.iter().map(|&node| word(node)).collect();
        let mut flat = vec![0; nodes.len()];
        // From the last node on, the subtrees that still want a parent lie on a stack.
        let mut pending: Vec<usize> = Vec::new();
        for (index, node) in nodes.iter().enumerate().rev() {
            flat[index] = words[index].len();
            if node.is_function() {
                let arguments = pending.split_off(pending.len() - node.arity());
                flat[index] += 2 + arguments.iter().map(|length| length + 1).sum::<usize>();
            }
            pending.push(flat[index]);
        }
        Printer { nodes, words, flat }
    }

    fn tree(&self, f: &mut Formatter<'_>, indent: usize) -> Result {
        if f.alternate() { self.on_one_line(f, 0).map(drop) } else { self.wrapped(f, 0, indent).map(drop) }
    }

    /// Prints the subtree at `index` on one line; returns the node after it.
    fn on_one_line(
        &self,
        f: &mut Formatter<'_>,
        index: usize,
    ) -> std::result::Result<usize, std::fmt::Error> {
        let node = self.nodes[index];
        if !node.is_function() {
            f.write_str(&self.words[index])?;
            return Ok(index + 1);
        }
        write!(f, "({}", self.words[index])?;
        let mut next = index + 1;
        for _ in 0..node.arity() {
            f.write_char(' ')?;
            next = self.on_one_line(f, next)?;
        }
        f.write_char(')')?;
        Ok(next)
    }

    /// Prints the subtree at `index`, wrapped if it does not fit; returns the node after it.
    fn wrapped(
        &self,
        f: &mut Formatter<'_>,
        index: usize,
        indent: usize,
    ) -> std::result::Result<usize, std::fmt::Error> {
        let node = self.nodes[index];
        // The root's arguments are laid out alike in every program.
        let root = matches!(node, Node::Iterate(_));
        if !root && indent + self.flat[index] <= WIDTH {
            return self.on_one_line(f, index);
        }
        write!(f, "({}", self.words[index])?;
        let statements = matches!(node, Node::Prog2 | Node::Prog3);
        let mut column = indent + 1 + self.words[index].len();
        let mut on_first_line = !statements;
        let deeper = (indent + 2).min(MAX_INDENT);
        let mut next = index + 1;
        for argument in 1..=node.arity() {
            column += 1 + self.flat[next];
            on_first_line &= argument < node.arity() && column <= WIDTH && self.flat[next] <= SHORT;
            if on_first_line {
                f.write_char(' ')?;
                next = self.on_one_line(f, next)?;
            } else {
                new_line(f, deeper)?;
                next = self.wrapped(f, next, deeper)?;
            }
        }
        f.write_char(')')?;
        Ok(next)
    }
}
