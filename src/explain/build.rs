//! From a program to its listing: values into expressions, those used more than once into names.

use std::collections::BTreeSet;

use vsonar_ir::opt::interval::Interval;
use vsonar_ir::opt::ranges::{self, Leaves};
use vsonar_ir::{Block, Leaf, Loop, Op, Program, Reg, Span, Ty};

use super::listing::{Cond, Course, Expr, Listing, Name, Relation, Sign, Stmt, Sweep};
use super::names::Names;
use super::order::{and, or, product, sum};
use super::structure::{Step, steps, strip};
use super::view::{View, views};

/// Of an expression longer than this, in characters, the longest parts are given names.
const LONG: usize = 104;
/// A choice longer than this inside of another expression is given a name.
const LONG_CHOICE: usize = 60;
/// A window average read so often is given a short name.
const OFTEN: usize = 5;

/// A program that has no listing: it holds an operation on bit patterns, which no tree lowers to.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("`{0}` works on bit patterns; explain the program as it was evolved (.gp)")]
pub struct NotReadable(pub &'static str);

/// The names that the carried registers of the loops go by: for each loop and register a letter's number.
pub(super) type RegisterNames = [[u8; 5]; 2];

/// The listing of an optimised program.
///
/// # Errors
/// If an operation has no readable form.
pub(super) fn listing(program: &Program, registers: &RegisterNames) -> Result<Listing, NotReadable> {
    let (width, height) = (program.width(), program.height());
    let blocks = program.loops().flat_map(|l| [l.body(), l.column().block()]);
    for inst in blocks.flat_map(Block::insts) {
        let op = inst.op();
        if op.result() == Ty::I32 || op.operands().contains(&Ty::I32) || op == Op::MConst {
            return Err(NotReadable(op.name()));
        }
    }
    let mut iter2 = [Interval::ANY; 5];
    let mut of = |l: &Loop, registers: [u8; 5]| {
        let mut values = Vec::new();
        let mut leaves = Leaves::with_column(l, width, height, iter2, &mut values);
        let column = std::mem::take(&mut values);
        leaves.find_reads(l, &mut values);
        iter2 = ranges::finals(l, &leaves, &mut values);
        sweep(l, &column, &values, registers)
    };
    let first = program.first().map(|l| of(l, registers[0]));
    let mut second = of(program.second(), registers[1]);
    rename_iter2(&mut second, &registers[0]);
    Ok(Listing { width, height, first, second })
}

/// Gives the first tree's registers their names in the second.
fn rename_iter2(sweep: &mut Sweep, names: &[u8; 5]) {
    struct Rename<'a>(&'a [u8; 5]);
    impl super::visit::Visitor for Rename<'_> {
        fn expr(&mut self, expr: &mut Expr) {
            if let Expr::Iter2(k) = expr {
                *k = self.0[usize::from(*k)];
            }
        }
    }
    sweep.visit(&mut Rename(names));
}

fn sweep(l: &Loop, column: &[Interval], body: &[Interval], registers: [u8; 5]) -> Sweep {
    let mut names = Names::default();
    let mut writer = Writer::new(l.column().block(), column, registers, &mut names);
    let (before, column) = writer.value(l.column().result());
    let steps = steps(l);
    let body = Writer::new(l.body(), body, registers, &mut names).body(&steps);
    let course = match l.span() {
        Span::All => Course::Moves(l.direction()),
        Span::Last => Course::Stands(l.direction()),
    };
    let mut sweep = Sweep { rect: l.rect(), course, before, column, body, names: names.list };
    sweep.number_sites();
    sweep
}

/// Writes the values of one block.
struct Writer<'a> {
    block: &'a Block,
    intervals: &'a [Interval],
    registers: [u8; 5],
    views: Vec<View>,
    /// Whether a value is to have a name.
    named: Vec<bool>,
    /// The name it has, once it is there.
    name: Vec<Option<Name>>,
    names: &'a mut Names,
}

impl<'a> Writer<'a> {
    fn new(
        block: &'a Block,
        intervals: &'a [Interval],
        registers: [u8; 5],
        names: &'a mut Names,
    ) -> Writer<'a> {
        let views = views(block);
        let n = block.len();
        Writer { block, intervals, registers, views, named: vec![false; n], name: vec![None; n], names }
    }

    /// One value by itself, and the names it needs.
    fn value(&mut self, reg: Reg) -> (Vec<Stmt>, Expr) {
        self.decide(&[reg]);
        let mut lets = Vec::new();
        self.lets(&self.closure(&[reg]), &mut lets);
        (lets, self.expr(reg))
    }

    fn body(&mut self, steps: &[Step]) -> Vec<Stmt> {
        let mut roots = Vec::new();
        heads(steps, &mut roots);
        self.decide(&roots);
        self.statements(steps)
    }

    /// Which values have names: those that are used more than once, unless that would be longer, and long ones.
    fn decide(&mut self, roots: &[Reg]) {
        let long = self.long(roots);
        let mut uses = vec![0usize; self.views.len()];
        roots.iter().for_each(|reg| uses[reg.index()] += 1);
        for i in (0..self.views.len()).rev() {
            let view = self.views[i];
            let leaf = |reg: &Reg| matches!(self.views[reg.index()], View::Leaf(_));
            let simple = view.operands().iter().all(leaf);
            self.named[i] = match view {
                View::Leaf(Leaf::Window(_)) => uses[i] >= OFTEN,
                View::Leaf(_) | View::Not(_) => false,
                View::Power(..) | View::Twice(_) if simple => false,
                View::Compare(..) if simple => uses[i] > 3,
                View::Binary(..) if simple => uses[i] > 2,
                _ => uses[i] > 1 || (long[i] && uses[i] > 0),
            };
            let times = if self.named[i] { uses[i].min(1) } else { uses[i] };
            view.operands().iter().for_each(|reg| uses[reg.index()] += times);
        }
    }

    /// Which values would make an expression too long.
    fn long(&self, roots: &[Reg]) -> Vec<bool> {
        let mut reached = vec![false; self.views.len()];
        roots.iter().for_each(|reg| reached[reg.index()] = true);
        for i in (0..self.views.len()).rev() {
            if reached[i] {
                self.views[i].operands().iter().for_each(|reg| reached[reg.index()] = true);
            }
        }
        let mut readers = vec![0usize; self.views.len()];
        let views = self.views.iter().zip(&reached).filter(|(_, reached)| **reached);
        views.flat_map(|(view, _)| view.operands()).for_each(|reg| readers[reg.index()] += 1);
        let mut size = vec![0usize; self.views.len()];
        let mut long = vec![false; self.views.len()];
        for (i, view) in self.views.iter().enumerate().filter(|(i, _)| reached[*i]) {
            // `else if` can be read on and on.
            let chain = if let View::Select([_, _, or_else]) = *view { Some(or_else) } else { None };
            // A `not` has no name of its own.
            let inside = |reg: Reg| strip(self.block, reg, true).0;
            let mut parts: Vec<Reg> = view.operands().into_iter().map(inside).collect();
            for reg in &parts {
                let choice = matches!(self.views[reg.index()], View::Select(_)) && Some(*reg) != chain;
                long[reg.index()] |= choice && size[reg.index()] > LONG_CHOICE;
            }
            parts.sort_by_key(|reg| size[reg.index()]);
            let of = |long: &[bool], reg: &Reg| if long[reg.index()] { 1 } else { size[reg.index()] };
            let length = |long: &[bool]| view.length() + parts.iter().map(|reg| of(long, reg)).sum::<usize>();
            for reg in parts.iter().rev() {
                let leaf = matches!(self.views[reg.index()], View::Leaf(_));
                if length(&long) > LONG && !leaf {
                    long[reg.index()] = true;
                }
            }
            // What several values read is likely to be read so often that it has a short name.
            let short = matches!(view, View::Leaf(Leaf::Window(_))) && readers[i] + 1 >= OFTEN;
            size[i] = if short { 1 } else { length(&long) };
        }
        long
    }

    /// The values with names that these need, directly or not, and that have none yet.
    fn closure(&self, roots: &[Reg]) -> BTreeSet<Reg> {
        let mut found = BTreeSet::new();
        let mut seen = vec![false; self.views.len()];
        let mut open: Vec<Reg> = roots.to_vec();
        while let Some(reg) = open.pop() {
            let i = reg.index();
            if std::mem::replace(&mut seen[i], true) || self.name[i].is_some() {
                continue;
            }
            if self.named[i] {
                found.insert(reg);
            }
            open.extend(self.views[i].operands());
        }
        found
    }

    /// Gives these values their names.
    fn lets(&mut self, regs: &BTreeSet<Reg>, out: &mut Vec<Stmt>) {
        for &reg in regs {
            let i = reg.index();
            if self.name[i].is_some() {
                continue;
            }
            let mask = self.block.inst(reg).op().result() == Ty::Mask;
            // The value is written as if it had no name.
            self.named[i] = false;
            let stmt = if mask {
                let cond = self.cond(reg, true);
                let name = self.names.condition();
                self.name[i] = Some(name);
                Stmt::LetCond(name, cond)
            } else {
                let expr = self.expr(reg);
                let name = match self.views[i] {
                    View::Leaf(Leaf::Window(operand)) => self.names.operand(operand),
                    _ => self.names.value(),
                };
                self.name[i] = Some(name);
                Stmt::Let(name, expr)
            };
            self.named[i] = true;
            out.push(stmt);
        }
    }

    /// Statements, each name given where everything that uses it sees it and not earlier.
    fn statements(&mut self, steps: &[Step]) -> Vec<Stmt> {
        let parts: Vec<[BTreeSet<Reg>; 3]> = steps.iter().map(|step| self.parts(step)).collect();
        let all = |part: &[BTreeSet<Reg>; 3]| -> BTreeSet<Reg> { part.iter().flatten().copied().collect() };
        let mut here: BTreeSet<Reg> = BTreeSet::new();
        let mut seen: BTreeSet<Reg> = BTreeSet::new();
        for part in &parts {
            here.extend(&part[0]);
            here.extend(part[1].intersection(&part[2]));
            let whole = all(part);
            here.extend(whole.intersection(&seen));
            seen.extend(&whole);
        }
        let mut out = Vec::new();
        for (step, part) in steps.iter().zip(&parts) {
            let needed: BTreeSet<Reg> = all(part).intersection(&here).copied().collect();
            self.lets(&needed, &mut out);
            out.push(match step {
                Step::Assign(k, reg) => Stmt::Assign(0, self.registers[usize::from(*k)], self.expr(*reg)),
                Step::Stop => Stmt::Stop(0),
                Step::If(mask, then, or_else) => self.choice(*mask, then, or_else),
            });
        }
        out
    }

    /// What the head of a statement and its two branches need.
    fn parts(&self, step: &Step) -> [BTreeSet<Reg>; 3] {
        let of = |steps: &[Step]| {
            let mut roots = Vec::new();
            heads(steps, &mut roots);
            self.closure(&roots)
        };
        match step {
            Step::Assign(_, reg) => [self.closure(&[*reg]), BTreeSet::new(), BTreeSet::new()],
            Step::Stop => Default::default(),
            Step::If(mask, then, or_else) => [self.closure(&[*mask]), of(then), of(or_else)],
        }
    }

    fn choice(&mut self, mask: Reg, then: &[Step], or_else: &[Step]) -> Stmt {
        // The shorter branch comes first, so that the longer one can go on with `else if`.
        let nested = |steps: &[Step]| steps.len() == 1 && matches!(steps[0], Step::If(..));
        let swap = then.is_empty() || (!or_else.is_empty() && nested(then) && !nested(or_else));
        let (mask, holds) = strip(self.block, mask, !swap);
        let (then, or_else) = if swap { (or_else, then) } else { (then, or_else) };
        let cond = self.cond(mask, holds);
        let (mut then, or_else) = (self.statements(then), self.statements(or_else));
        match &mut then[..] {
            // Two conditions of one thing.
            [Stmt::If(_, inner, deeper, others)] if others.is_empty() && or_else.is_empty() => {
                let inner = std::mem::replace(inner, Cond::First(true));
                let both = and(cond, inner);
                Stmt::If(0, both, std::mem::take(deeper), Vec::new())
            }
            _ => Stmt::If(0, cond, then, or_else),
        }
    }

    fn expr(&mut self, reg: Reg) -> Expr {
        let i = reg.index();
        if self.named[i]
            && let Some(name) = self.name[i]
        {
            return Expr::Name(name);
        }
        match self.views[i] {
            View::Leaf(leaf) => self.leaf(leaf),
            View::Power(base, n) => Expr::Power(Box::new(self.expr(base)), n),
            View::Twice(a) => product(Expr::Const(2.0), self.expr(a)),
            View::Binary(Sign::Add, a, b) => sum(self.expr(a), self.expr(b)),
            View::Binary(Sign::Mul, a, b) => product(self.expr(a), self.expr(b)),
            View::Binary(sign, a, b) => Expr::Binary(sign, Box::new(self.expr(a)), Box::new(self.expr(b))),
            View::Call(function, args) => {
                Expr::Call(function, args[..function.arity()].iter().map(|&a| self.expr(a)).collect())
            }
            View::Select([mask, a, b]) => {
                let (mask, holds) = strip(self.block, mask, true);
                let first = matches!(self.cond(mask, true), Cond::First(false));
                let swap = first == holds;
                let (a, b) = if swap { (b, a) } else { (a, b) };
                let cond = self.cond(mask, holds != swap);
                Expr::If(0, Box::new(cond), Box::new(self.expr(a)), Box::new(self.expr(b)))
            }
            View::Compare(..) | View::Logic(..) | View::Not(_) => unreachable!("a mask is no value"),
        }
    }

    fn leaf(&self, leaf: Leaf) -> Expr {
        match leaf {
            Leaf::Const(value) => Expr::Const(value),
            Leaf::XObstacle => Expr::XObstacle,
            Leaf::Iter2(k) => Expr::Iter2(k),
            Leaf::X => Expr::X,
            Leaf::Y => Expr::Y,
            Leaf::FirstWindow => Expr::FirstWindow,
            Leaf::Read(k) => Expr::Register(self.registers[usize::from(k)]),
            Leaf::Window(operand) => Expr::Window(operand),
            Leaf::IConst(_) | Leaf::MConst(_) => unreachable!("operations on bit patterns were refused"),
        }
    }

    /// The condition that a mask holds, or that it does not.
    fn cond(&mut self, mask: Reg, holds: bool) -> Cond {
        let (mask, holds) = strip(self.block, mask, holds);
        let i = mask.index();
        if self.named[i]
            && let Some(name) = self.name[i]
        {
            let name = Cond::Name(name);
            return if holds { name } else { Cond::Not(Box::new(name)) };
        }
        match self.views[i] {
            View::Compare(op, a, b) => self.compare(op, a, b, holds),
            View::Logic(op, p, q) => {
                let (p, q) = (self.cond(p, holds), self.cond(q, holds));
                if (op == Op::And) == holds { and(p, q) } else { or(p, q) }
            }
            _ => unreachable!("a value is no mask"),
        }
    }

    fn compare(&mut self, op: Op, a: Reg, b: Reg, holds: bool) -> Cond {
        let constant = |reg: Reg| match self.views[reg.index()] {
            View::Leaf(Leaf::Const(value)) => Some(value),
            _ => None,
        };
        let is_first = |reg: Reg| matches!(self.views[reg.index()], View::Leaf(Leaf::FirstWindow));
        // `first-window` is 1 or -1, and a constant between tells which.
        let between = |value: f32, strict_below: bool| match strict_below {
            true => (-1.0..1.0).contains(&value),
            false => value > -1.0 && value <= 1.0,
        };
        if is_first(a) && constant(b).is_some_and(|c| between(c, op == Op::Le)) && op != Op::Eq {
            return Cond::First(!holds);
        }
        if is_first(b) && constant(a).is_some_and(|c| between(c, op == Op::Lt)) && op != Op::Eq {
            return Cond::First(holds);
        }
        let nan = self.intervals[a.index()].nan || self.intervals[b.index()].nan;
        let mirror = constant(a).is_some() && constant(b).is_none();
        let relation = match (op, holds, nan) {
            (Op::Lt, true, _) => Relation::Lt,
            (Op::Le, true, _) => Relation::Le,
            (Op::Eq, true, _) => Relation::Eq,
            (Op::Lt, false, false) => Relation::Ge,
            (Op::Le, false, false) => Relation::Gt,
            (Op::Lt, false, true) => Relation::NotLt,
            (Op::Le, false, true) => Relation::NotLe,
            _ => Relation::Ne,
        };
        let mirrored = match relation {
            Relation::Lt => Some(Relation::Gt),
            Relation::Le => Some(Relation::Ge),
            Relation::Gt => Some(Relation::Lt),
            Relation::Ge => Some(Relation::Le),
            Relation::Eq | Relation::Ne => Some(relation),
            Relation::NotLt | Relation::NotLe => None,
        };
        match mirrored {
            Some(mirrored) if mirror => Cond::Compare(mirrored, self.expr(b), self.expr(a)),
            _ => Cond::Compare(relation, self.expr(a), self.expr(b)),
        }
    }
}

/// The values and masks at the heads of statements.
fn heads(steps: &[Step], out: &mut Vec<Reg>) {
    for step in steps {
        match step {
            Step::Assign(_, reg) => out.push(*reg),
            Step::Stop => {}
            Step::If(mask, then, or_else) => {
                out.push(*mask);
                heads(then, out);
                heads(or_else, out);
            }
        }
    }
}

impl Listing {
    /// The listing of an optimised program, its registers named as the program has them.
    ///
    /// # Errors
    /// If an operation has no readable form.
    pub fn of(program: &Program) -> Result<Listing, NotReadable> {
        listing(program, &[[0, 1, 2, 3, 4]; 2])
    }
}
