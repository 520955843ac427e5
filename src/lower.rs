//! Lowering: a two-tree individual becomes an IR program.
//!
//! The body of a tree branches (`if-le`) and ends early (`break`); a program's body is a straight line. So the
//! walk keeps, beside the five registers' current values, the mask of lanes that are still running at this point
//! of the body. Both branches of an `if-le` are written out, each from the state before it, and merged by
//! selects under the comparison; a `break` leaves no lane running on its path; a `set-*` takes effect where
//! lanes are running. What no lane can reach is not written at all.
//!
//! Nothing is simplified here: that is the optimiser's work ([`vsonar_ir::opt`]).
//!
//! ```
//! use vsonar::{lower::lower, tree::Individual};
//! let individual: Individual = "(individual (iterate-down 3x3 x-obstacle (set-a y)))".parse()?;
//! let program = lower(&individual, 320, 240);
//! assert_eq!(program.second().body().len(), 6); // five register reads and y
//! # Ok::<(), vsonar::tree::ParseError>(())
//! ```

use vsonar_ir::builder::LoopParts;
use vsonar_ir::{Builder, Leaf, Op, Program, Rect, Reg, Span};

use crate::tree::{Individual, Node, Tree};

/// The program of an individual for images of `width` x `height` pixels.
///
/// # Panics
/// If there cannot be programs for images of this size ([`Program::fits`]).
pub fn lower(individual: &Individual, width: u32, height: u32) -> Program {
    assert!(Program::fits(width, height), "no program is for images of {width}x{height} pixels");
    let loop_of = |tree: &Tree| lower_tree(tree, width, height);
    // The builder checks every instruction; the whole is verified in debug builds.
    Program::vouched(width, height, individual.first().map(loop_of), loop_of(individual.second()))
}

fn lower_tree(tree: &Tree, width: u32, height: u32) -> LoopParts {
    // A node is an instruction or less, but that an `if-le` merges what its branches set.
    let writer = |nodes: usize| Writer {
        builder: Builder::with_capacity(nodes + nodes / 2 + 8),
        rect: tree.rect(),
        image_max: [width - 1, height - 1],
        registers: [Reg(0); 5],
        running: Running::All,
    };

    let mut column = writer(tree.column().len());
    let column_result = column.expression(&mut tree.column().iter());

    let mut body = writer(tree.body().len());
    body.registers = std::array::from_fn(|k| body.builder.leaf(Leaf::Read(k as u8)));
    body.expression(&mut tree.body().iter());
    let break_if = match body.running {
        Running::All => None,
        Running::Where(mask) => Some(body.op(Op::Not, &[mask])),
        Running::Nowhere => Some(body.builder.leaf(Leaf::MConst(true))),
    };
    LoopParts {
        direction: tree.direction(),
        rect: tree.rect(),
        span: Span::All,
        column: column.builder.finish(),
        column_result,
        next: body.registers.map(Some),
        break_if,
        body: body.builder.finish(),
        invariant: 0,
        uniform: 0,
    }
}

/// Which lanes are still running at a point of the body.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Running {
    All,
    Where(Reg),
    Nowhere,
}

/// Writes one block, keeping the state of the walk.
struct Writer {
    builder: Builder,
    rect: Rect,
    image_max: [u32; 2],
    registers: [Reg; 5],
    running: Running,
}

type Nodes<'a> = std::slice::Iter<'a, Node>;

impl Writer {
    /// Writes the next subtree of `nodes`; the register of its value. Where no lane is running afterwards, the
    /// value is never read and any register serves.
    fn expression(&mut self, nodes: &mut Nodes<'_>) -> Reg {
        let Some(&node) = nodes.next() else { unreachable!("a tree's nodes are complete") };
        if self.running == Running::Nowhere {
            skip(nodes, node.arity());
            return Reg(0);
        }
        match node {
            Node::IfLe => self.if_le(nodes),
            Node::Break => {
                self.running = Running::Nowhere;
                self.constant(0.0)
            }
            Node::Set(k) => self.set(k, nodes),
            Node::Read(k) => self.registers[k as usize],
            Node::Prog2 | Node::Prog3 => {
                (1..node.arity()).for_each(|_| _ = self.expression(nodes));
                self.expression(nodes)
            }
            Node::Square => {
                let a = self.expression(nodes);
                self.op(Op::Mul, &[a, a])
            }
            Node::Constant(value) => self.constant(value),
            Node::WindowArea => self.constant(self.rect.area() as f32),
            Node::ImageMaxX => self.constant(self.image_max[0] as f32),
            Node::ImageMaxY => self.constant(self.image_max[1] as f32),
            Node::XObstacle => self.builder.leaf(Leaf::XObstacle),
            Node::FirstWindow => self.builder.leaf(Leaf::FirstWindow),
            Node::X => self.builder.leaf(Leaf::X),
            Node::Y => self.builder.leaf(Leaf::Y),
            Node::Iter2(k) => self.builder.leaf(Leaf::Iter2(k)),
            Node::Image(operand) => self.builder.leaf(Leaf::Window(operand)),
            _ => match node.operation() {
                Some(op) => self.arithmetic(op, nodes),
                None => unreachable!("a tree holds {} at its root alone", node.name()),
            },
        }
    }

    fn op(&mut self, op: Op, args: &[Reg]) -> Reg {
        self.builder.push(op, args).unwrap_or_else(|fault| unreachable!("lowering is well typed: {fault}"))
    }

    fn constant(&mut self, value: f32) -> Reg {
        self.builder.leaf(Leaf::Const(value))
    }

    fn arithmetic(&mut self, op: Op, nodes: &mut Nodes<'_>) -> Reg {
        let mut args = [Reg(0); 3];
        let args = &mut args[..op.operands().len()];
        args.iter_mut().for_each(|arg| *arg = self.expression(nodes));
        if self.running == Running::Nowhere { Reg(0) } else { self.op(op, args) }
    }

    fn set(&mut self, k: u8, nodes: &mut Nodes<'_>) -> Reg {
        let value = self.expression(nodes);
        let register = self.registers[k as usize];
        self.registers[k as usize] = match self.running {
            Running::All => value,
            Running::Where(mask) => self.op(Op::Select, &[mask, value, register]),
            Running::Nowhere => register,
        };
        value
    }

    fn if_le(&mut self, nodes: &mut Nodes<'_>) -> Reg {
        let a = self.expression(nodes);
        let b = self.expression(nodes);
        if self.running == Running::Nowhere {
            skip(nodes, 2);
            return Reg(0);
        }
        let condition = self.op(Op::Le, &[a, b]);
        let before = (self.registers, self.running);

        let then_value = self.expression(nodes);
        let (then_registers, then_running) = (self.registers, self.running);

        (self.registers, self.running) = before;
        let else_value = self.expression(nodes);
        let (else_registers, else_running) = (self.registers, self.running);

        for k in 0..5 {
            // Where a branch has broken, its registers hold what they held when it did.
            self.registers[k] = self.merge(condition, then_registers[k], else_registers[k]);
        }
        self.running = self.merge_running(condition, then_running, else_running);
        match (then_running, else_running) {
            (Running::Nowhere, _) => else_value,
            (_, Running::Nowhere) => then_value,
            _ => self.merge(condition, then_value, else_value),
        }
    }

    fn merge(&mut self, condition: Reg, a: Reg, b: Reg) -> Reg {
        if a == b { a } else { self.op(Op::Select, &[condition, a, b]) }
    }

    fn merge_running(&mut self, condition: Reg, then: Running, or_else: Running) -> Running {
        use Running::{All, Nowhere, Where};
        match (then, or_else) {
            (All, All) => All,
            (Nowhere, Nowhere) => Nowhere,
            (Where(a), Where(b)) if a == b => Where(a),
            _ => {
                let then = self.under(condition, then);
                let negated = self.op(Op::Not, &[condition]);
                let or_else = self.under(negated, or_else);
                match (then, or_else) {
                    (Some(a), Some(b)) => Where(self.op(Op::Or, &[a, b])),
                    (Some(mask), None) | (None, Some(mask)) => Where(mask),
                    (None, None) => Nowhere,
                }
            }
        }
    }

    /// The lanes that took a branch and are running at its end; `None` for no lane at all.
    fn under(&mut self, taken: Reg, running: Running) -> Option<Reg> {
        match running {
            Running::All => Some(taken),
            Running::Where(mask) => Some(self.op(Op::And, &[taken, mask])),
            Running::Nowhere => None,
        }
    }
}

/// Skips this many subtrees.
fn skip(nodes: &mut Nodes<'_>, subtrees: usize) {
    let mut open = subtrees;
    while open > 0 {
        let Some(node) = nodes.next() else { unreachable!("a tree's nodes are complete") };
        open = open - 1 + node.arity();
    }
}
