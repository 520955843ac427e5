//! From a program to its listing.

use vsonar_ir::opt::interval::Interval;
use vsonar_ir::opt::ranges::{self, Leaves};
use vsonar_ir::{Block, Loop, Op, Program, Span, Ty};

use super::listing::{Course, Expr, Listing, Sweep};
use super::names::Names;
use super::structure::{Step, steps, values};
use super::writer::Writer;

/// Choices and conditions that a tree may have. Those of [`crate::tree::MAX_NODES`] nodes come to some 20,000 once they are
/// optimised, to 100,000 before.
const MOST: usize = 1 << 17;
/// So many of them are dealt with on the stack of whoever asks.
const FEW: usize = 256;
/// Stack for each of them where they are nested in one another, in bytes.
const STACK_BYTES: usize = 4 << 10;

/// Why a program has no listing.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum NotReadable {
    /// It holds an operation on bit patterns, which no tree lowers to.
    #[error("`{0}` works on bit patterns; explain the program as it was evolved (.gp)")]
    BitPatterns(&'static str),
    /// One of its trees is too large.
    #[error(
        "a tree with {0} choices and conditions is too large to be explained, {MOST} is the limit; explain a smaller \
         program (`vsonar ir` shows one of any size)"
    )]
    TooLarge(usize),
    /// The system gives no thread with room for so large a program.
    #[error("no thread can be had to explain so large a program: {0}; allow more threads or memory")]
    NoThread(String),
}

/// The names that the carried registers of the loops go by: for each loop and register a letter's number.
pub(super) type RegisterNames = [[u8; 5]; 2];

/// The listing of an optimised program.
///
/// # Errors
/// If an operation has no readable form, or the program is too large.
pub(super) fn listing(program: &Program, registers: &RegisterNames) -> Result<Listing, NotReadable> {
    let blocks = program.loops().flat_map(|l| [l.body(), l.column().block()]);
    for inst in blocks.flat_map(Block::insts) {
        let op = inst.op();
        if op.result() == Ty::I32 || op.operands().contains(&Ty::I32) || op == Op::MConst {
            return Err(NotReadable::BitPatterns(op.name()));
        }
    }
    let choices = |l: &Loop| {
        let of = |op: Op| matches!(op, Op::Select | Op::And | Op::Or);
        l.body().insts().iter().filter(|inst| of(inst.op())).count()
    };
    let most = program.loops().map(choices).max().unwrap_or(0);
    if most > MOST {
        return Err(NotReadable::TooLarge(most));
    }
    if most <= FEW {
        return Ok(written(program, registers));
    }
    // Choices are taken apart by recursion, one in the other.
    std::thread::scope(|scope| {
        let thread = std::thread::Builder::new().stack_size((FEW + most) * STACK_BYTES);
        let thread = thread.spawn_scoped(scope, || written(program, registers));
        let thread = thread.map_err(|error| NotReadable::NoThread(error.to_string()))?;
        thread.join().or_else(|panic| std::panic::resume_unwind(panic))
    })
}

fn written(program: &Program, registers: &RegisterNames) -> Listing {
    let (width, height) = (program.width(), program.height());
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
    Listing { width, height, first, second }
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

fn sweep(l: &Loop, column: &[Interval], intervals: &[Interval], registers: [u8; 5]) -> Sweep {
    let mut names = Names::default();
    let mut writer = Writer::new(l.column().block(), column, registers, &mut names);
    let (before, column) = writer.value(l.column().result());
    let of_column = names.clone();
    let mut body = |steps: &[Step], early: bool| {
        names = of_column.clone();
        let writer = Writer::new(l.body(), intervals, registers, &mut names);
        if early { writer.early() } else { writer }.body(steps)
    };
    let steps = steps(l);
    // What would be nested too deeply is written with names given sooner, or else with values for statements.
    let body = body(&steps, false).or_else(|| body(&steps, true)).or_else(|| body(&values(l), true));
    let Some(body) = body else { unreachable!("values are not nested") };
    let course = match l.span() {
        Span::All => Course::Moves(l.direction()),
        Span::Last => Course::Stands(l.direction()),
    };
    let mut sweep = Sweep { rect: l.rect(), course, before, column, body, names: names.list };
    sweep.number_sites();
    sweep
}

impl Listing {
    /// The listing of an optimised program, its registers named as the program has them.
    ///
    /// # Errors
    /// If an operation has no readable form, or the program is too large.
    pub fn of(program: &Program) -> Result<Listing, NotReadable> {
        listing(program, &[[0, 1, 2, 3, 4]; 2])
    }
}
