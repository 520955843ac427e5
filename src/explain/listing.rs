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

use vsonar_ir::{Direction, Op, Operand, Rect};

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

/// Blocks in blocks, and values and conditions in one another, are at most so deep; how long a chain of `else if` or a
/// text is makes no difference. It is what keeps every walk over a listing within a thread's usual stack.
pub const DEEPEST: usize = 250;

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
    /// `if …:` and any `else if …:`, of which the first that holds is taken; `else:` where that branch holds anything. At
    /// least one arm.
    If(Vec<Arm>, Vec<Stmt>),
}

/// A condition and what is done where it holds.
#[derive(Debug, Clone, PartialEq)]
pub struct Arm {
    /// The choice's number.
    pub site: Site,
    /// The condition.
    pub cond: Cond,
    /// What is done.
    pub then: Vec<Stmt>,
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

/// A function of values: an operation that is written as a call.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Function(Op);

impl Function {
    /// All of them.
    pub fn all() -> impl Iterator<Item = Function> {
        Op::ALL.iter().filter_map(|op| Function::of(*op))
    }

    /// The operation as a function; `None` for one that is written otherwise.
    pub const fn of(op: Op) -> Option<Function> {
        match op {
            // This has a sign.
            Op::PDiv => None,
            _ if op.function().is_some() => Some(Function(op)),
            _ => None,
        }
    }

    /// The operation.
    pub const fn op(self) -> Op {
        self.0
    }

    /// As it is printed.
    pub const fn name(self) -> &'static str {
        self.0.name()
    }

    /// How many values it takes.
    pub const fn arity(self) -> usize {
        self.0.operands().len()
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
