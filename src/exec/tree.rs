//! The tree walker: runs an individual as it stands, one case at a time. The judge of what a program means.
//!
//! It knows nothing of lowering or the IR. With the other executors it shares the scalar formulas
//! ([`vsonar_ir::formula`]) and the window averages ([`Windows`]), and nothing else. Everything here is meant to
//! be held against the definition of the language line by line; speed is no aim beyond that of any interpreter.
//!
//! ```
//! use vsonar::exec::tree::answer;
//! use vsonar::{ir::WindowAt, tree::Individual};
//!
//! // The lowest row where the gradient exceeds 300, in an image where that is rows 5 to 20.
//! let individual: Individual =
//!     "(individual (iterate-down 3x3 x-obstacle (if-le gradient 300 read-a (set-a y))))".parse()?;
//! let windows = |at: WindowAt| if (5..=20).contains(&at.y) { 400.0 } else { 0.0 };
//! assert_eq!(answer(&individual, 64, 48, &windows, 30.0), 20.0);
//! # Ok::<(), vsonar::tree::ParseError>(())
//! ```

use std::cell::Cell;
use std::ops::ControlFlow;
use std::time::Instant;

use vsonar_ir::formula::{arith, trig};
use vsonar_ir::machine::Scalar;
use vsonar_ir::{Direction, WindowAt, Windows};

use crate::exec::{Candidate, ExecError, Executor, Timing, Worker, check_size};
use crate::tree::{Individual, Node, Tree};
use crate::vision::CaseSet;

/// How one tree ended on one case.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outcome {
    /// The final registers, `a` to `e`.
    pub registers: [f32; 5],
    /// The column it iterated in: the rectangle's centre, in pixels.
    pub column: u32,
    /// How many window positions the body was begun at.
    pub positions: u32,
    /// Whether a `break` ended it.
    pub broke: bool,
}

/// How an individual ended on one case.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Walk {
    /// The first tree, if there are two.
    pub first: Option<Outcome>,
    /// The tree that gives the answer.
    pub second: Outcome,
}

impl Walk {
    /// The answer: the final register `a` of the second tree, in rows from the top.
    pub fn answer(&self) -> f32 {
        self.second.registers[0]
    }
}

/// The individual's answer for one case, `x_obstacle` being a column in pixels, finite and at least +0. See
/// [`Walker::walk`].
pub fn answer<W: Windows + ?Sized>(
    individual: &Individual,
    width: u32,
    height: u32,
    windows: &W,
    x_obstacle: f32,
) -> f32 {
    Walker::new(individual, width, height).walk(windows, x_obstacle).answer()
}

/// An individual ready to be walked.
#[derive(Debug)]
pub struct Walker<'a> {
    individual: &'a Individual,
    width: u32,
    height: u32,
    /// For every node of the first and of the second tree, where its subtree ends, in preorder.
    ends: [Vec<usize>; 2],
}

impl<'a> Walker<'a> {
    /// A walker for images of `width` x `height` pixels, both at least 16.
    pub fn new(individual: &'a Individual, width: u32, height: u32) -> Walker<'a> {
        let ends = |tree: &Tree| {
            let mut ends = vec![0; tree.len()];
            for (index, node) in tree.nodes().iter().enumerate().rev() {
                ends[index] = (0..node.arity()).fold(index + 1, |argument, _| ends[argument]);
            }
            ends
        };
        let ends = [individual.first().map_or_else(Vec::new, ends), ends(individual.second())];
        Walker { individual, width, height, ends }
    }

    /// Runs the individual on one case: the window averages of its image, and the column asked for.
    pub fn walk<W: Windows + ?Sized>(&self, windows: &W, x_obstacle: f32) -> Walk {
        self.walk_counting(windows, x_obstacle, ())
    }

    /// As [`Walker::walk`], counting the nodes that are evaluated: each time the value of a node of a column
    /// expression or a body is asked for. A branch that is not taken does not count, nor do the iterate node and
    /// its rectangle.
    pub fn walk_and_count<W: Windows + ?Sized>(&self, windows: &W, x_obstacle: f32) -> (Walk, u64) {
        let nodes = Cell::new(0);
        (self.walk_counting(windows, x_obstacle, &nodes), nodes.get())
    }

    fn walk_counting<W: Windows + ?Sized>(&self, windows: &W, x_obstacle: f32, nodes: impl Counter) -> Walk {
        let run = |tree: &'a Tree, ends, first| {
            let (width, height) = (self.width, self.height);
            let rectangle = Rectangle { x: 0, y: 0, is_first: false };
            Run {
                tree,
                ends,
                width,
                height,
                windows,
                x_obstacle,
                first,
                registers: [0.0; 5],
                rectangle,
                nodes,
            }
            .tree()
        };
        // Only a second tree, of two, reads the registers of the first.
        let first = self.individual.first().map(|tree| run(tree, &self.ends[0], [0.0; 5]));
        let results = first.map_or([0.0; 5], |outcome| outcome.registers);
        Walk { first, second: run(self.individual.second(), &self.ends[1], results) }
    }
}

/// Where the rectangle is.
struct Rectangle {
    /// The centre's column.
    x: u32,
    /// The centre's row.
    y: u32,
    /// Whether this is the first position of the iteration.
    is_first: bool,
}

/// Counts the nodes that are evaluated, or does not: then it costs nothing.
trait Counter: Copy {
    fn count(self);
}

impl Counter for () {
    fn count(self) {}
}

impl Counter for &Cell<u64> {
    fn count(self) {
        self.set(self.get() + 1);
    }
}

/// One tree on one case.
struct Run<'a, W: ?Sized, C> {
    tree: &'a Tree,
    ends: &'a [usize],
    width: u32,
    height: u32,
    windows: &'a W,
    x_obstacle: f32,
    /// The first tree's final registers.
    first: [f32; 5],
    registers: [f32; 5],
    rectangle: Rectangle,
    nodes: C,
}

/// The value of an expression, or that a `break` ends the tree.
type Value = ControlFlow<(), f32>;

impl<W: Windows + ?Sized, C: Counter> Run<'_, W, C> {
    fn tree(mut self) -> Outcome {
        let rect = self.tree.rect();
        // The column expression comes right after the iterate node and the rectangle, then the body.
        let column = 2;
        let body = self.ends[column];
        let ControlFlow::Continue(value) = self.expression(column) else {
            unreachable!("a column expression holds no break")
        };
        self.rectangle.x = rect.resolve_column(value, self.width);

        let (top, bottom) = rect.rows(self.height);
        let mut outcome =
            Outcome { registers: [0.0; 5], column: self.rectangle.x, positions: 0, broke: false };
        for step in 0..=bottom - top {
            self.rectangle.y = match self.tree.direction() {
                Direction::Up => bottom - step,
                Direction::Down => top + step,
            };
            self.rectangle.is_first = step == 0;
            outcome.positions += 1;
            if self.expression(body).is_break() {
                outcome.broke = true;
                break;
            }
        }
        outcome.registers = self.registers;
        outcome
    }

    /// Evaluates the expression whose root is the node at `index`.
    fn expression(&mut self, index: usize) -> Value {
        self.nodes.count();
        let m = &mut Scalar;
        let first = index + 1;
        let value = match self.tree.nodes()[index] {
            Node::Iterate(_) | Node::Rect(_) => unreachable!("neither stands in an expression"),

            Node::Constant(value) => value,
            Node::XObstacle => self.x_obstacle,
            Node::WindowArea => self.tree.rect().area() as f32,
            Node::ImageMaxX => (self.width - 1) as f32,
            Node::ImageMaxY => (self.height - 1) as f32,
            Node::FirstWindow => {
                if self.rectangle.is_first {
                    1.0
                } else {
                    -1.0
                }
            }
            Node::X => self.rectangle.x as f32,
            Node::Y => self.rectangle.y as f32,
            Node::Read(register) => self.registers[usize::from(register)],
            Node::Iter2(register) => self.first[usize::from(register)],
            Node::Image(operand) => {
                let Rectangle { x, y, .. } = self.rectangle;
                self.windows.average(WindowAt { operand, rect: self.tree.rect(), x, y })
            }

            Node::Add => {
                let (a, b) = self.two(first)?;
                a + b
            }
            Node::Sub => {
                let (a, b) = self.two(first)?;
                a - b
            }
            Node::Mul => {
                let (a, b) = self.two(first)?;
                a * b
            }
            Node::Div => {
                let (a, b) = self.two(first)?;
                arith::protected_div(m, a, b)
            }
            Node::Min => {
                let (a, b) = self.two(first)?;
                arith::min(m, a, b)
            }
            Node::Max => {
                let (a, b) = self.two(first)?;
                arith::max(m, a, b)
            }
            Node::Atan2 => {
                let (a, b) = self.two(first)?;
                trig::atan2(m, a, b)
            }
            Node::Square => {
                let a = self.expression(first)?;
                a * a
            }
            Node::Sin => trig::sin(m, self.expression(first)?),
            Node::Cos => trig::cos(m, self.expression(first)?),
            Node::Tan => trig::tan(m, self.expression(first)?),
            Node::Atan => trig::atan(m, self.expression(first)?),

            Node::Prog2 => self.two(first)?.1,
            Node::Prog3 => {
                self.two(first)?;
                self.expression(self.argument(first, 2))?
            }
            Node::IfLe => {
                let (a, b) = self.two(first)?;
                let chosen = if a <= b { 2 } else { 3 };
                self.expression(self.argument(first, chosen))?
            }
            Node::Break => return ControlFlow::Break(()),
            Node::Set(register) => {
                let value = self.expression(first)?;
                self.registers[usize::from(register)] = value;
                value
            }
        };
        ControlFlow::Continue(value)
    }

    /// Where the argument `n` places after the one at `first` begins.
    fn argument(&self, first: usize, n: usize) -> usize {
        (0..n).fold(first, |argument, _| self.ends[argument])
    }

    /// The values of the argument at `first` and the one after it, evaluated in this order.
    fn two(&mut self, first: usize) -> ControlFlow<(), (f32, f32)> {
        let a = self.expression(first)?;
        let b = self.expression(self.ends[first])?;
        ControlFlow::Continue((a, b))
    }
}

/// The tree walker as an executor.
#[derive(Debug, Clone, Copy, Default)]
pub struct TreeExecutor;

impl Executor for TreeExecutor {
    fn name(&self) -> &'static str {
        "tree"
    }

    fn lowers(&self) -> bool {
        false
    }

    fn worker(&self) -> Result<Box<dyn Worker>, ExecError> {
        Ok(Box::new(TreeWorker))
    }
}

struct TreeWorker;

impl Worker for TreeWorker {
    fn answers(
        &mut self,
        candidate: &Candidate<'_>,
        cases: &CaseSet,
        answers: &mut [f32],
    ) -> Result<Timing, ExecError> {
        check_size(candidate.size(), cases)?;
        let start = Instant::now();
        let walker = Walker::new(candidate.individual(), cases.width(), cases.height());
        for (case, (answer, lane)) in answers.iter_mut().zip(cases.lanes()).enumerate() {
            *answer = walker.walk(cases.image(case), lane.column as f32).answer();
        }
        Ok(Timing { execute: start.elapsed(), ..Timing::default() })
    }
}
