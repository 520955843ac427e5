//! Runs a listing as it reads, one case at a time, and lets somebody watch.
//!
//! It knows nothing of the program that the listing is of; with the executors it shares the scalar formulas of
//! functions and the window averages, as the tree walker does.

use vsonar_ir::machine::Scalar;
use vsonar_ir::op::Value;
use vsonar_ir::{Direction, WindowAt, Windows};

use super::listing::{Cond, Course, Expr, Listing, Relation, Sign, Site, Stmt, Sweep};

/// What a listing did on one case.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outcome {
    /// The first sweep's final registers; all 0 where there is none.
    pub first: [f32; 5],
    /// The final registers of the sweep that gives the answer.
    pub second: [f32; 5],
}

impl Outcome {
    /// The answer, in rows from the top.
    pub const fn answer(&self) -> f32 {
        self.second[0]
    }
}

/// One position of a sweep, once it is over.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Position {
    /// The centre's column, in pixels.
    pub x: u32,
    /// The centre's row, in pixels from the top.
    pub y: u32,
    /// The registers as this position left them.
    pub registers: [f32; 5],
    /// Whether the sweep stopped here.
    pub stopped: bool,
}

/// Whoever watches a listing run. Sweeps are numbered among those that are there.
pub trait Observer {
    /// A place was come to: an assignment or a `stop` (`true`), or a choice, and whether its condition held.
    fn site(&mut self, _sweep: usize, _site: Site, _held: bool) {}
    /// A position is over.
    fn position(&mut self, _sweep: usize, _at: &Position) {}
}

impl Observer for () {}

impl Listing {
    /// Runs the listing in the column `x_obstacle` (in pixels) of the image behind `windows`, watched.
    pub fn run<W: Windows + ?Sized>(
        &self,
        windows: &W,
        x_obstacle: f32,
        observer: &mut impl Observer,
    ) -> Outcome {
        let size = (self.width, self.height);
        let mut number = 0;
        let mut of = |sweep: &Sweep, iter2: [f32; 5]| {
            let names = sweep.names.len();
            let mut run = Run {
                sweep,
                number,
                windows,
                observer,
                x_obstacle,
                iter2,
                x: 0,
                y: 0,
                is_first: false,
                registers: [0.0; 5],
                next: [0.0; 5],
                stopped: false,
                values: vec![0.0; names],
                conditions: vec![false; names],
            };
            number += 1;
            run.sweep(size)
        };
        let first = self.first.as_ref().map_or([0.0; 5], |sweep| of(sweep, [0.0; 5]));
        Outcome { first, second: of(&self.second, first) }
    }

    /// The answer, in rows from the top, as [`Listing::run`] gives it.
    pub fn answer<W: Windows + ?Sized>(&self, windows: &W, x_obstacle: f32) -> f32 {
        self.run(windows, x_obstacle, &mut ()).answer()
    }
}

struct Run<'a, W: ?Sized, O> {
    sweep: &'a Sweep,
    number: usize,
    windows: &'a W,
    observer: &'a mut O,
    x_obstacle: f32,
    iter2: [f32; 5],
    x: u32,
    y: u32,
    is_first: bool,
    /// As the position before left them.
    registers: [f32; 5],
    next: [f32; 5],
    stopped: bool,
    values: Vec<f32>,
    conditions: Vec<bool>,
}

impl<W: Windows + ?Sized, O: Observer> Run<'_, W, O> {
    fn sweep(&mut self, (width, height): (u32, u32)) -> [f32; 5] {
        let sweep = self.sweep;
        self.block(&sweep.before);
        let column = self.expr(&sweep.column);
        self.x = sweep.rect.resolve_column(column, width);
        let (top, bottom) = sweep.rect.rows(height);
        let (from, direction) = match sweep.course {
            Course::Moves(direction) => (0, direction),
            Course::Stands(direction) => (bottom - top, direction),
        };
        for step in from..=bottom - top {
            self.y = match direction {
                Direction::Up => bottom - step,
                Direction::Down => top + step,
            };
            self.is_first = step == 0;
            self.next = self.registers;
            self.block(&sweep.body);
            self.registers = self.next;
            let at = Position { x: self.x, y: self.y, registers: self.registers, stopped: self.stopped };
            self.observer.position(self.number, &at);
            if self.stopped {
                break;
            }
        }
        self.registers
    }

    fn site(&mut self, site: Site, held: bool) {
        self.observer.site(self.number, site, held);
    }

    fn block(&mut self, block: &[Stmt]) {
        for stmt in block {
            match stmt {
                Stmt::Let(name, expr) => self.values[*name as usize] = self.expr(expr),
                Stmt::LetCond(name, cond) => self.conditions[*name as usize] = self.cond(cond),
                Stmt::Assign(site, register, expr) => {
                    self.site(*site, true);
                    self.next[usize::from(*register)] = self.expr(expr);
                }
                Stmt::Stop(site) => {
                    self.site(*site, true);
                    self.stopped = true;
                }
                Stmt::If(arms, or_else) => {
                    let taken = arms.iter().find(|arm| {
                        let held = self.cond(&arm.cond);
                        self.site(arm.site, held);
                        held
                    });
                    self.block(taken.map_or(or_else, |arm| &arm.then));
                }
            }
        }
    }

    fn expr(&mut self, expr: &Expr) -> f32 {
        match expr {
            Expr::Const(value) => *value,
            Expr::XObstacle => self.x_obstacle,
            Expr::Iter2(k) => self.iter2[usize::from(*k)],
            Expr::X => self.x as f32,
            Expr::Y => self.y as f32,
            Expr::FirstWindow => {
                if self.is_first {
                    1.0
                } else {
                    -1.0
                }
            }
            Expr::Register(k) => self.registers[usize::from(*k)],
            Expr::Window(operand) => {
                let at = WindowAt { operand: *operand, rect: self.sweep.rect, x: self.x, y: self.y };
                self.windows.average(at)
            }
            Expr::Name(name) => self.values[*name as usize],
            Expr::Binary(sign, a, b) => {
                let (a, b) = (self.expr(a), self.expr(b));
                match sign {
                    Sign::Add => a + b,
                    Sign::Sub => a - b,
                    Sign::Mul => a * b,
                    Sign::Div => a / b,
                    Sign::Protected if b == 0.0 => 1.0,
                    Sign::Protected => a / b,
                }
            }
            Expr::Power(base, n) => {
                let base = self.expr(base);
                let square = base * base;
                match n {
                    2 => square,
                    3 => square * base,
                    4 => square * square,
                    _ => square * square * base,
                }
            }
            Expr::Call(function, args) => {
                let mut values = [Value::F32(0.0); 3];
                for (value, arg) in values.iter_mut().zip(args) {
                    *value = Value::F32(self.expr(arg));
                }
                match function.op().apply(&mut Scalar, &values[..args.len()], 0) {
                    Some(value) => value.f32(),
                    None => unreachable!("leaves are no functions"),
                }
            }
            Expr::If(site, cond, a, b) => {
                let held = self.cond(cond);
                self.site(*site, held);
                self.expr(if held { a } else { b })
            }
        }
    }

    fn cond(&mut self, cond: &Cond) -> bool {
        match cond {
            Cond::Compare(relation, a, b) => {
                let (a, b) = (self.expr(a), self.expr(b));
                match relation {
                    Relation::Lt => a < b,
                    Relation::Le => a <= b,
                    Relation::Gt => a > b,
                    Relation::Ge => a >= b,
                    Relation::Eq => a == b,
                    Relation::Ne => a != b,
                    #[allow(clippy::neg_cmp_op_on_partial_ord, reason = "a value may be no number")]
                    Relation::NotLt => !(a < b),
                    #[allow(clippy::neg_cmp_op_on_partial_ord, reason = "a value may be no number")]
                    Relation::NotLe => !(a <= b),
                }
            }
            Cond::First(first) => self.is_first == *first,
            Cond::Name(name) => self.conditions[*name as usize],
            Cond::Not(p) => !self.cond(p),
            Cond::And(p, q) => self.cond(p) && self.cond(q),
            Cond::Or(p, q) => self.cond(p) || self.cond(q),
        }
    }
}
