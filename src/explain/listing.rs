//! The readable form of a program: what the words and signs of a listing mean.
//!
//! A [`Listing`] is one sweep of a window for each tree that matters; a [`Sweep`] is a header and a block of statements,
//! run once at every position. Three rules hold besides what one expects of the notation:
//!
//! * A register on the right (`a` … `e`) has the value that the position before left in it, 0 at the first. What `:=`
//!   stores counts from the end of the position on, so that statements of different registers may stand in any order.
//! * `stop` ends the sweep after the position; what is stored there still counts.
//! * Every operation is rounded to binary32 as it stands: `x³` is x·x·x, `x⁴` is (x²)², `x⁵` is (x²)²·x. `÷` is
//!   protected division (1 where the divisor is 0), `/` the ordinary one, and `≰` is all that `≤` is not, a value that
//!   is no number included.

use vsonar_ir::{Direction, Operand, Rect};

/// A readable program for images of one size.
#[derive(Debug, Clone, PartialEq)]
pub struct Listing {
    /// Width of the images, in pixels.
    pub width: u32,
    /// Height of the images, in pixels.
    pub height: u32,
    /// The first tree's sweep, if anything of it is needed.
    pub first: Option<Sweep>,
    /// The sweep whose final register `a` is the answer.
    pub second: Sweep,
}

impl Listing {
    /// The sweeps that are there, in the order they run.
    pub fn sweeps(&self) -> impl Iterator<Item = &Sweep> {
        self.first.iter().chain(std::iter::once(&self.second))
    }

    /// The same, to be changed.
    pub(super) fn sweeps_mut(&mut self) -> impl Iterator<Item = &mut Sweep> {
        self.first.iter_mut().chain(std::iter::once(&mut self.second))
    }
}

/// Where the window goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Course {
    /// From one end of the column to the other.
    Moves(Direction),
    /// It stands at the last position of that way: all else makes no difference.
    Stands(Direction),
}

/// One tree: a window in a column, and what happens at each position.
#[derive(Debug, Clone, PartialEq)]
pub struct Sweep {
    /// The window's size.
    pub rect: Rect,
    /// Where it goes.
    pub course: Course,
    /// Values that the column is computed from.
    pub before: Vec<Stmt>,
    /// The column of the window's centre; rounded, and kept where the window is inside the image.
    pub column: Expr,
    /// What is done at each position.
    pub body: Vec<Stmt>,
    /// The names of values and conditions, by number.
    pub names: Vec<String>,
}

/// A place in a listing that is counted: a choice, an assignment or a `stop`, in the order of the text.
pub type Site = u32;

/// A statement.
#[derive(Debug, Clone, PartialEq)]
pub enum Stmt {
    /// `let p = …`: a name for a value.
    Let(Name, Expr),
    /// `let P = …`: a name for a condition.
    LetCond(Name, Cond),
    /// `a := …`.
    Assign(Site, u8, Expr),
    /// `stop`.
    Stop(Site),
    /// `if …:`, and `else:` where that branch holds anything.
    If(Site, Cond, Vec<Stmt>, Vec<Stmt>),
}

/// A number in [`Sweep::names`].
pub type Name = u32;

/// A binary32 value.
#[derive(Debug, Clone, PartialEq)]
pub enum Expr {
    /// A constant.
    Const(f32),
    /// `x-obstacle`: the column asked for.
    XObstacle,
    /// `iter2-a` … `iter2-e`: a final register of the first tree.
    Iter2(u8),
    /// `x`: the window's column.
    X,
    /// `y`: the window's row.
    Y,
    /// `first-window`: 1 at the first position, else -1.
    FirstWindow,
    /// `a` … `e`: a register, as the position before left it.
    Register(u8),
    /// An image operator's average over the window, or that of its squares.
    Window(Operand),
    /// A named value.
    Name(Name),
    /// Two values and a sign between them.
    Binary(Sign, Box<Expr>, Box<Expr>),
    /// A power of 2 to 5.
    Power(Box<Expr>, u8),
    /// A function.
    Call(Function, Vec<Expr>),
    /// `if … then … else …`.
    If(Site, Box<Cond>, Box<Expr>, Box<Expr>),
}

/// What stands between two values.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sign {
    /// `+`
    Add,
    /// `−`
    Sub,
    /// `·`
    Mul,
    /// `/`
    Div,
    /// `÷`: 1 where the divisor is 0.
    Protected,
}

impl Sign {
    /// All of them.
    pub const ALL: [Sign; 5] = [Sign::Add, Sign::Sub, Sign::Mul, Sign::Div, Sign::Protected];

    /// As it is printed.
    pub const fn text(self) -> &'static str {
        match self {
            Sign::Add => "+",
            Sign::Sub => "−",
            Sign::Mul => "·",
            Sign::Div => "/",
            Sign::Protected => "÷",
        }
    }

    /// How tightly it binds.
    pub(super) const fn level(self) -> u8 {
        match self {
            Sign::Add | Sign::Sub => 1,
            Sign::Mul | Sign::Div | Sign::Protected => 2,
        }
    }
}

/// A function of values.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Function {
    /// The lesser of two; the second where they cannot be compared.
    Min,
    /// The greater of two; the second where they cannot be compared.
    Max,
    /// Sine.
    Sin,
    /// Cosine.
    Cos,
    /// Tangent.
    Tan,
    /// Arc tangent.
    Atan,
    /// The angle of a point, the ordinate first.
    Atan2,
}

impl Function {
    /// All of them.
    pub const ALL: [Function; 7] = [
        Function::Min,
        Function::Max,
        Function::Sin,
        Function::Cos,
        Function::Tan,
        Function::Atan,
        Function::Atan2,
    ];

    /// As it is printed.
    pub const fn name(self) -> &'static str {
        match self {
            Function::Min => "min",
            Function::Max => "max",
            Function::Sin => "sin",
            Function::Cos => "cos",
            Function::Tan => "tan",
            Function::Atan => "atan",
            Function::Atan2 => "atan2",
        }
    }

    /// How many values it takes.
    pub const fn arity(self) -> usize {
        match self {
            Function::Min | Function::Max | Function::Atan2 => 2,
            _ => 1,
        }
    }
}

/// A condition.
#[derive(Debug, Clone, PartialEq)]
pub enum Cond {
    /// Two values compared.
    Compare(Relation, Expr, Expr),
    /// `at the first position`, or not.
    First(bool),
    /// A named condition.
    Name(Name),
    /// `not …`.
    Not(Box<Cond>),
    /// `… and …`.
    And(Box<Cond>, Box<Cond>),
    /// `… or …`.
    Or(Box<Cond>, Box<Cond>),
}

/// How two values compare.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Relation {
    /// `<`
    Lt,
    /// `≤`
    Le,
    /// `>`
    Gt,
    /// `≥`
    Ge,
    /// `=`
    Eq,
    /// `≮`: not `<`.
    NotLt,
    /// `≰`: not `≤`.
    NotLe,
    /// `≠`: not `=`.
    Ne,
}

impl Relation {
    /// All of them.
    pub const ALL: [Relation; 8] = [
        Relation::Lt,
        Relation::Le,
        Relation::Gt,
        Relation::Ge,
        Relation::Eq,
        Relation::NotLt,
        Relation::NotLe,
        Relation::Ne,
    ];

    /// As it is printed.
    pub const fn text(self) -> &'static str {
        match self {
            Relation::Lt => "<",
            Relation::Le => "≤",
            Relation::Gt => ">",
            Relation::Ge => "≥",
            Relation::Eq => "=",
            Relation::NotLt => "≮",
            Relation::NotLe => "≰",
            Relation::Ne => "≠",
        }
    }
}

/// Whoever walks a listing's statements in the order of the text, to number or to count.
pub(super) trait Visitor {
    /// A place that is counted.
    fn site(&mut self, _site: &mut Site) {}
    /// A value, after those that it is computed from.
    fn expr(&mut self, _expr: &mut Expr) {}
}

pub(super) fn visit_block(block: &mut [Stmt], v: &mut impl Visitor) {
    for stmt in block {
        match stmt {
            Stmt::Let(_, expr) => visit_expr(expr, v),
            Stmt::LetCond(_, cond) => visit_cond(cond, v),
            Stmt::Assign(site, _, expr) => {
                v.site(site);
                visit_expr(expr, v);
            }
            Stmt::Stop(site) => v.site(site),
            Stmt::If(site, cond, then, or_else) => {
                v.site(site);
                visit_cond(cond, v);
                visit_block(then, v);
                visit_block(or_else, v);
            }
        }
    }
}

pub(super) fn visit_expr(expr: &mut Expr, v: &mut impl Visitor) {
    match expr {
        Expr::Binary(_, a, b) => {
            visit_expr(a, v);
            visit_expr(b, v);
        }
        Expr::Power(a, _) => visit_expr(a, v),
        Expr::Call(_, args) => args.iter_mut().for_each(|a| visit_expr(a, v)),
        Expr::If(site, cond, a, b) => {
            v.site(site);
            visit_cond(cond, v);
            visit_expr(a, v);
            visit_expr(b, v);
        }
        _ => {}
    }
    v.expr(expr);
}

pub(super) fn visit_cond(cond: &mut Cond, v: &mut impl Visitor) {
    match cond {
        Cond::Compare(_, a, b) => {
            visit_expr(a, v);
            visit_expr(b, v);
        }
        Cond::Not(a) => visit_cond(a, v),
        Cond::And(a, b) | Cond::Or(a, b) => {
            visit_cond(a, v);
            visit_cond(b, v);
        }
        Cond::First(_) | Cond::Name(_) => {}
    }
}

impl Sweep {
    /// Numbers the places that are counted in the order of the text; how many there are.
    pub(super) fn number_sites(&mut self) -> Site {
        struct Number(Site);
        impl Visitor for Number {
            fn site(&mut self, site: &mut Site) {
                *site = self.0;
                self.0 += 1;
            }
        }
        let mut number = Number(0);
        self.visit(&mut number);
        number.0
    }

    /// Walks everything in the order of the text.
    pub(super) fn visit(&mut self, v: &mut impl Visitor) {
        visit_block(&mut self.before, v);
        visit_expr(&mut self.column, v);
        visit_block(&mut self.body, v);
    }
}

impl Sweep {
    /// The numbers of the choices, in the order of the text.
    pub fn choice_sites(&self) -> Vec<Site> {
        self.sites_of(|stmt| matches!(stmt, Stmt::If(..)), true)
    }

    /// The numbers of the `stop`s, in the order of the text.
    pub fn stop_sites(&self) -> Vec<Site> {
        self.sites_of(|stmt| matches!(stmt, Stmt::Stop(_)), false)
    }

    fn sites_of(&self, wanted: impl Fn(&Stmt) -> bool + Copy, with_values: bool) -> Vec<Site> {
        fn block(stmts: &[Stmt], wanted: impl Fn(&Stmt) -> bool + Copy, out: &mut Vec<Site>) {
            for stmt in stmts {
                if let Stmt::Assign(site, ..) | Stmt::Stop(site) | Stmt::If(site, ..) = stmt
                    && wanted(stmt)
                {
                    out.push(*site);
                }
                if let Stmt::If(_, _, then, or_else) = stmt {
                    block(then, wanted, out);
                    block(or_else, wanted, out);
                }
            }
        }
        struct Values(Vec<Site>);
        impl Visitor for Values {
            fn expr(&mut self, expr: &mut Expr) {
                if let Expr::If(site, ..) = expr {
                    self.0.push(*site);
                }
            }
        }
        let mut out = Vec::new();
        block(&self.body, wanted, &mut out);
        if with_values {
            let mut values = Values(Vec::new());
            self.clone().visit(&mut values);
            out.extend(values.0);
        }
        out.sort_unstable();
        out
    }

    /// The window averages that are read, each once, in the order of their numbers.
    pub fn operands(&self) -> Vec<Operand> {
        struct Used([bool; Operand::COUNT]);
        impl Visitor for Used {
            fn expr(&mut self, expr: &mut Expr) {
                if let Expr::Window(operand) = expr {
                    self.0[usize::from(operand.index())] = true;
                }
            }
        }
        let mut used = Used([false; Operand::COUNT]);
        self.clone().visit(&mut used);
        Operand::all().filter(|o| used.0[usize::from(o.index())]).collect()
    }

    /// Which registers are stored, and which are read, by number.
    pub fn registers(&self) -> [[bool; 5]; 2] {
        fn stored(stmts: &[Stmt], out: &mut [bool; 5]) {
            for stmt in stmts {
                match stmt {
                    Stmt::Assign(_, k, _) => out[usize::from(*k)] = true,
                    Stmt::If(_, _, then, or_else) => {
                        stored(then, out);
                        stored(or_else, out);
                    }
                    _ => {}
                }
            }
        }
        struct Read([bool; 5]);
        impl Visitor for Read {
            fn expr(&mut self, expr: &mut Expr) {
                if let Expr::Register(k) = expr {
                    self.0[usize::from(*k)] = true;
                }
            }
        }
        let mut written = [false; 5];
        stored(&self.body, &mut written);
        let mut read = Read([false; 5]);
        self.clone().visit(&mut read);
        [written, read.0]
    }
}
