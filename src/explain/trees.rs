//! The trees as pictures: DOT for Graphviz, and SVG laid out here. Live nodes are solid, introns pale.

use std::fmt::Write as _;

use super::reduce::Live;
use super::svg::{escape, frame};
use crate::tree::{Group, Individual, Node, Shortest, Tree};

/// Height of a leaf's row, in pixels.
const ROW: f64 = 20.0;
/// Width of a character, in pixels.
const CHARACTER: f64 = 7.3;
/// Between the levels, in pixels.
const GAP: f64 = 26.0;
const MARGIN: f64 = 16.0;

fn label(node: Node) -> String {
    match node {
        Node::Constant(value) => Shortest(value).to_string(),
        node => node.name().to_string(),
    }
}

/// The trees in the language of Graphviz.
pub fn dot(individual: &Individual, live: &Live) -> String {
    let mut out = String::from(
        "digraph vsonar {\n  rankdir=LR;\n  ordering=out;\n  node [shape=box, style=rounded, fontname=\"monospace\"];\n",
    );
    let two = individual.first().is_some();
    for (t, tree) in individual.trees().enumerate() {
        let title = name(two, t);
        let _ = writeln!(out, "  subgraph cluster_{t} {{\n    label=\"{title}\";");
        for (i, &node) in tree.nodes().iter().enumerate() {
            let text = label(node).replace('\\', "\\\\").replace('"', "\\\"");
            let pale =
                if live.nodes[t][i] { "" } else { ", color=gray, fontcolor=gray, style=\"rounded,dashed\"" };
            let _ = writeln!(out, "    t{t}n{i} [label=\"{text}\"{pale}];");
        }
        for (parent, child) in edges(tree) {
            let pale = if live.nodes[t][child] { "" } else { " [color=gray, style=dashed]" };
            let _ = writeln!(out, "    t{t}n{parent} -> t{t}n{child}{pale};");
        }
        out += "  }\n";
    }
    out += "}\n";
    out
}

fn name(two: bool, tree: usize) -> &'static str {
    match (two, tree) {
        (false, _) => "the tree",
        (_, 0) => "first tree",
        _ => "second tree",
    }
}

/// Parents and children, as positions in preorder.
fn edges(tree: &Tree) -> Vec<(usize, usize)> {
    let mut out = Vec::new();
    // Open functions, each with the number of arguments still to come.
    let mut open: Vec<(usize, usize)> = Vec::new();
    for (i, node) in tree.nodes().iter().enumerate() {
        if let Some((parent, left)) = open.last_mut() {
            out.push((*parent, i));
            *left -= 1;
        }
        while open.last().is_some_and(|(_, left)| *left == 0) {
            open.pop();
        }
        if node.arity() > 0 {
            open.push((i, node.arity()));
        }
    }
    out
}

/// The trees as SVG: the root at the left, a row for each leaf, every node in the middle of its arguments.
pub fn svg(individual: &Individual, live: &Live) -> String {
    let two = individual.first().is_some();
    let mut content = String::new();
    let (mut top, mut width) = (MARGIN, 0f64);
    for (t, tree) in individual.trees().enumerate() {
        let title = format!("{}: {} of {} nodes do anything", name(two, t), live.count(t), tree.len());
        let _ = writeln!(content, "<text x=\"{MARGIN}\" y=\"{:.0}\">{}</text>", top + 10.0, escape(&title));
        let layout = Layout::of(tree);
        layout.draw(tree, &live.nodes[t], top + 24.0, &mut content);
        width = width.max(layout.width + 2.0 * MARGIN).max(title.len() as f64 * CHARACTER + 2.0 * MARGIN);
        top += 24.0 + layout.height + 2.0 * MARGIN;
    }
    let legend =
        "Solid: does something. Pale: an intron. Blue: image operators; green: registers; orange: flow.";
    let _ = writeln!(content, "<text class=\"small\" x=\"{MARGIN}\" y=\"{:.0}\">{legend}</text>", top);
    frame(
        width.max(legend.len() as f64 * 6.0 + 2.0 * MARGIN),
        top + MARGIN,
        "The trees of the program",
        &content,
    )
}

struct Layout {
    /// Left edge, middle and width of every node.
    boxes: Vec<(f64, f64, f64)>,
    width: f64,
    height: f64,
}

impl Layout {
    fn of(tree: &Tree) -> Layout {
        let n = tree.len();
        let edges = edges(tree);
        let (mut depth, mut middle) = (vec![0usize; n], vec![0f64; n]);
        edges.iter().for_each(|&(parent, child)| depth[child] = depth[parent] + 1);
        let widths: Vec<f64> =
            tree.nodes().iter().map(|&node| label(node).chars().count() as f64 * CHARACTER + 10.0).collect();
        let mut columns = vec![0f64; depth.iter().max().map_or(0, |d| d + 1)];
        depth.iter().zip(&widths).for_each(|(&d, &w)| columns[d] = columns[d].max(w));
        let lefts: Vec<f64> = columns
            .iter()
            .scan(MARGIN, |left, width| Some(std::mem::replace(left, *left + width + GAP)))
            .collect();
        let mut rows = 0f64;
        for (i, node) in tree.nodes().iter().enumerate() {
            if node.arity() == 0 {
                middle[i] = (rows + 0.5) * ROW;
                rows += 1.0;
            }
        }
        // Children come after their parents, so from the last node on all of them are placed.
        let mut ends = vec![(f64::INFINITY, f64::NEG_INFINITY); n];
        for &(parent, child) in edges.iter().rev() {
            if tree.nodes()[child].arity() > 0 {
                middle[child] = (ends[child].0 + ends[child].1) / 2.0;
            }
            ends[parent] = (ends[parent].0.min(middle[child]), ends[parent].1.max(middle[child]));
        }
        middle[0] = (ends[0].0 + ends[0].1) / 2.0;
        let boxes = (0..n).map(|i| (lefts[depth[i]], middle[i], widths[i])).collect();
        let width = lefts.last().zip(columns.last()).map_or(0.0, |(left, width)| left + width);
        Layout { boxes, width, height: rows * ROW }
    }

    fn draw(&self, tree: &Tree, live: &[bool], top: f64, out: &mut String) {
        for (parent, child) in edges(tree) {
            let ((px, py, pw), (cx, cy, _)) = (self.boxes[parent], self.boxes[child]);
            let (x1, y1, x2, y2) = (px + pw, top + py, cx, top + cy);
            let bend = x2 - GAP / 2.0;
            let class = if live[child] { "" } else { " class=\"quiet\" stroke-dasharray=\"3 3\"" };
            let _ = writeln!(
                out,
                "<path{class} d=\"M{x1:.1} {y1:.1}H{:.1}C{bend:.1} {y1:.1} {bend:.1} {y2:.1} {x2:.1} {y2:.1}\"/>",
                x2 - GAP
            );
        }
        for (i, &node) in tree.nodes().iter().enumerate() {
            let (x, y, w) = self.boxes[i];
            let group = match node.group() {
                Group::Image => "image",
                Group::Memory | Group::Iter2 => "memory",
                Group::Flow => "flow",
                Group::Root | Group::Rectangle => "root",
                _ => "",
            };
            let quiet = if live[i] { "" } else { " class=\"quiet\"" };
            let _ = writeln!(
                out,
                "<g{quiet}><rect class=\"{group}\" x=\"{x:.1}\" y=\"{:.1}\" width=\"{w:.1}\" height=\"{:.1}\" rx=\"4\"/>\
                 <text class=\"mono\" x=\"{:.1}\" y=\"{:.1}\">{}</text></g>",
                top + y - ROW / 2.0 + 2.0,
                ROW - 4.0,
                x + 5.0,
                top + y + 4.0,
                escape(&label(node))
            );
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn example() -> (Individual, Live) {
        let individual: Individual = "(individual (iterate-up 3x3 x-obstacle (prog2 (set-b raw) (set-a y))))"
            .parse()
            .expect("a program");
        let program = vsonar_ir::opt::optimise(&crate::lower::lower(&individual, 64, 48));
        let live = Live::of(&individual, &program);
        (individual, live)
    }

    #[test]
    fn edges_are_those_of_the_tree() {
        let (individual, _) = example();
        // iterate-up 3x3 x-obstacle prog2 set-b raw set-a y
        assert_eq!(edges(individual.second()), [(0, 1), (0, 2), (0, 3), (3, 4), (4, 5), (3, 6), (6, 7)]);
        let layout = Layout::of(individual.second());
        // Leaves in rows from the top, functions in the middle of their arguments.
        let middle = |i: usize| layout.boxes[i].1 / ROW;
        assert_eq!([1, 2, 5, 7].map(middle), [0.5, 1.5, 2.5, 3.5]);
        assert_eq!([4, 6, 3, 0].map(middle), [2.5, 3.5, 3.0, 1.75]);
        assert_eq!(layout.height, 4.0 * ROW);
    }

    #[test]
    fn what_does_nothing_is_pale() {
        let (individual, live) = example();
        let dot = dot(&individual, &live);
        assert!(
            dot.contains("t0n5 [label=\"raw\", color=gray") && dot.contains("t0n7 [label=\"y\"];"),
            "{dot}"
        );
        assert_eq!(dot.matches(" -> ").count(), 7);
        let svg = svg(&individual, &live);
        // set-b, raw, prog2, which then has nothing to put together, and the column, since nothing is seen in it
        assert_eq!(svg.matches("<g class=\"quiet\">").count(), 4);
        assert_eq!(svg.matches("<g").count(), 8);
    }
}
