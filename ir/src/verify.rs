//! Well-formedness of whole programs, with messages that say which instruction of which loop is at fault.
//!
//! The [builder](crate::builder) checks types as a block grows; the verifier checks everything again and what
//! only shows in the whole: regions, results, where a leaf may stand, the image size. It runs on every program
//! that is read from text, and in debug builds after every pass of the optimiser.

use crate::op::{Depends, Leaf, Op, Ty};
use crate::program::{Block, Loop, Program, Reg, Region};

/// Which of the two loops.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Which {
    /// The first, whose final registers the second can read.
    First,
    /// The second, whose final `a` is the answer.
    Second,
}

impl std::fmt::Display for Which {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Which::First => "loop 1",
            Which::Second => "loop 2",
        })
    }
}

/// Where in a program.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Place {
    /// The column block of a loop.
    Column(Which),
    /// The body of a loop.
    Body(Which),
}

impl std::fmt::Display for Place {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Place::Column(which) => write!(f, "{which}, column"),
            Place::Body(which) => write!(f, "{which}, body"),
        }
    }
}

/// What is wrong with a program.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum VerifyError {
    /// An image side outside [`Program::MIN_SIDE`]..=[`Program::MAX_SIDE`].
    #[error("images of {width}x{height} pixels are not possible: each side must be {min} to {max}",
        min = Program::MIN_SIDE, max = Program::MAX_SIDE)]
    ImageSize {
        /// Width in pixels.
        width: u32,
        /// Height in pixels.
        height: u32,
    },
    /// An operand that is not defined above its use.
    #[error("{place}, {reg} = {op}: operand {operand} is not defined above it")]
    Undefined {
        /// Where.
        place: Place,
        /// The instruction.
        reg: Reg,
        /// Its operation.
        op: &'static str,
        /// The operand.
        operand: Reg,
    },
    /// An operand of the wrong type.
    #[error("{place}, {reg} = {op}: operand {operand} is of type {found}, must be {expected}")]
    Type {
        /// Where.
        place: Place,
        /// The instruction.
        reg: Reg,
        /// Its operation.
        op: &'static str,
        /// The operand.
        operand: Reg,
        /// Its type.
        found: Ty,
        /// The type it must have.
        expected: Ty,
    },
    /// An immediate outside the operation's range.
    #[error("{place}, {reg} = {op}: the immediate {imm} is out of range")]
    Immediate {
        /// Where.
        place: Place,
        /// The instruction.
        reg: Reg,
        /// Its operation.
        op: &'static str,
        /// The immediate.
        imm: u32,
    },
    /// A leaf where it makes no sense.
    #[error("{place}, {reg} = {op}: not allowed here ({why})")]
    Misplaced {
        /// Where.
        place: Place,
        /// The instruction.
        reg: Reg,
        /// Its operation.
        op: &'static str,
        /// The reason.
        why: &'static str,
    },
    /// A value in a region that cannot hold it.
    #[error("{place}, {reg} = {op}: a value that changes from {changes} cannot stand in the {region} region")]
    Region {
        /// Where.
        place: Place,
        /// The instruction.
        reg: Reg,
        /// Its operation.
        op: &'static str,
        /// What it changes with.
        changes: &'static str,
        /// The region it stands in.
        region: &'static str,
    },
    /// Regions that do not fit the body.
    #[error("{which}: the invariant and uniform regions are longer than the body")]
    RegionBounds {
        /// The loop.
        which: Which,
    },
    /// A result register that is not defined, or of the wrong type.
    #[error("{place}: {role} must be {expected} that the block defines, not {reg}")]
    Result {
        /// Where.
        place: Place,
        /// What the register is for.
        role: &'static str,
        /// The type it must have.
        expected: Ty,
        /// The register.
        reg: Reg,
    },
    /// A first loop's register is read, but there is no first loop.
    #[error("{place}, {reg} = iter2: there is no first loop to read")]
    NoFirstLoop {
        /// Where.
        place: Place,
        /// The instruction.
        reg: Reg,
    },
}

/// Checks a program.
///
/// # Errors
/// The first fault found, in the order of the text form.
pub fn verify(program: &Program) -> Result<(), VerifyError> {
    let (width, height) = (program.width(), program.height());
    if !Program::fits(width, height) {
        return Err(VerifyError::ImageSize { width, height });
    }
    if let Some(first) = program.first() {
        verify_loop(first, Which::First, false)?;
    }
    verify_loop(program.second(), Which::Second, program.first().is_some())
}

fn verify_loop(l: &Loop, which: Which, has_first: bool) -> Result<(), VerifyError> {
    let column = Place::Column(which);
    verify_block(l.column().block(), column, has_first)?;
    verify_result(l.column().block(), column, "the result", Ty::F32, l.column().result())?;
    let body = Place::Body(which);
    verify_block(l.body(), body, has_first)?;
    verify_regions(l, which)?;
    for reg in l.next().iter().flatten() {
        verify_result(l.body(), body, "a register's next value", Ty::F32, *reg)?;
    }
    if let Some(reg) = l.break_if() {
        verify_result(l.body(), body, "the break", Ty::Mask, reg)?;
    }
    Ok(())
}

fn verify_block(block: &Block, place: Place, has_first: bool) -> Result<(), VerifyError> {
    for (reg, inst) in block.iter() {
        let op = inst.op().name();
        for (&operand, &expected) in inst.args().iter().zip(inst.op().operands()) {
            if operand >= reg {
                return Err(VerifyError::Undefined { place, reg, op, operand });
            }
            let found = block.inst(operand).op().result();
            if found != expected {
                return Err(VerifyError::Type { place, reg, op, operand, found, expected });
            }
        }
        match inst.leaf() {
            Some(leaf) => verify_leaf(leaf, reg, op, place, has_first)?,
            None if inst.op().is_leaf() || inst.imm() >= if inst.op().has_shift() { 32 } else { 1 } => {
                return Err(VerifyError::Immediate { place, reg, op, imm: inst.imm() });
            }
            None => {}
        }
    }
    Ok(())
}

fn verify_leaf(
    leaf: Leaf,
    reg: Reg,
    op: &'static str,
    place: Place,
    has_first: bool,
) -> Result<(), VerifyError> {
    let misplaced = |why| Err(VerifyError::Misplaced { place, reg, op, why });
    match (leaf, place) {
        (Leaf::Iter2(_), Place::Column(Which::First) | Place::Body(Which::First)) => {
            misplaced("only the second loop can read the first one's registers")
        }
        (Leaf::Iter2(_), _) if !has_first => Err(VerifyError::NoFirstLoop { place, reg }),
        (leaf, Place::Column(_)) if !leaf.in_column() => {
            misplaced("a column is evaluated before the loop, where there is no window yet")
        }
        _ => Ok(()),
    }
}

fn verify_regions(l: &Loop, which: Which) -> Result<(), VerifyError> {
    let (invariant, uniform) = (l.region(Region::Invariant), l.region(Region::Uniform));
    if invariant.end > uniform.end || uniform.end > l.body().len() {
        return Err(VerifyError::RegionBounds { which });
    }
    for ((reg, inst), depends) in l.body().iter().zip(l.body().dependences()) {
        let region = l.region_of(reg);
        let allowed = match region {
            Region::Invariant => depends.within(Depends::LANE),
            Region::Uniform => depends.within(Depends::ROW),
            Region::Varying => true,
        };
        if !allowed {
            let changes = if depends == Depends::LANE {
                "lane to lane"
            } else if depends == Depends::ROW {
                "row to row"
            } else {
                "lane to lane and row to row"
            };
            let (place, op) = (Place::Body(which), inst.op().name());
            return Err(VerifyError::Region { place, reg, op, changes, region: region.name() });
        }
    }
    Ok(())
}

fn verify_result(
    block: &Block,
    place: Place,
    role: &'static str,
    expected: Ty,
    reg: Reg,
) -> Result<(), VerifyError> {
    match block.insts().get(reg.index()).map(|inst| inst.op()).map(Op::result) {
        Some(ty) if ty == expected => Ok(()),
        _ => Err(VerifyError::Result { place, role, expected, reg }),
    }
}
