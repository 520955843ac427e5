//! The only way to make a [`Block`] and a [`Program`]: types and immediates are checked instruction by
//! instruction, whole programs by the [verifier](crate::verify).

use crate::op::{Leaf, Op, Ty};
use crate::program::{Block, Column, Direction, Inst, Loop, Program, Reg, Region, Span};
use crate::verify::{self, VerifyError};
use crate::window::Rect;

/// Why an instruction was refused.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum BuildError {
    /// Too few or too many operands.
    #[error("`{op}` takes {expected} operands, not {found}")]
    Arity {
        /// The operation's name.
        op: &'static str,
        /// How many it takes.
        expected: usize,
        /// How many were given.
        found: usize,
    },
    /// An operand that is not defined yet.
    #[error("operand {position} of `{op}` is {reg}, which is not defined above it")]
    Undefined {
        /// The operation's name.
        op: &'static str,
        /// Which operand, counted from 1.
        position: usize,
        /// The register.
        reg: Reg,
    },
    /// An operand of the wrong type.
    #[error("operand {position} of `{op}` must be of type {expected}, but {reg} is of type {found}")]
    Type {
        /// The operation's name.
        op: &'static str,
        /// Which operand, counted from 1.
        position: usize,
        /// The type it must have.
        expected: Ty,
        /// The register given.
        reg: Reg,
        /// The type it has.
        found: Ty,
    },
    /// An immediate that the operation cannot have.
    #[error("`{op}` cannot have the immediate {imm}")]
    Immediate {
        /// The operation's name.
        op: &'static str,
        /// The immediate.
        imm: u32,
    },
}

/// Builds one block, instruction by instruction.
///
/// ```
/// use vsonar_ir::{Builder, Leaf, Op};
/// let mut b = Builder::new();
/// let y = b.leaf(Leaf::Y);
/// let twice = b.push(Op::Add, &[y, y])?;
/// assert_eq!(b.block().len(), 2);
/// assert!(b.push(Op::Not, &[twice]).is_err()); // an f32 is no mask
/// # Ok::<(), vsonar_ir::builder::BuildError>(())
/// ```
#[derive(Debug, Clone, Default)]
pub struct Builder {
    insts: Vec<Inst>,
}

impl Builder {
    /// An empty block.
    pub fn new() -> Builder {
        Builder::default()
    }

    /// An empty block with room for so many instructions.
    pub fn with_capacity(count: usize) -> Builder {
        Builder { insts: Vec::with_capacity(count) }
    }

    /// Appends a leaf.
    pub fn leaf(&mut self, leaf: Leaf) -> Reg {
        let (op, imm) = leaf.encode();
        self.append(Inst::new(op, [Reg(0); 3], imm))
    }

    /// Appends an operation without an immediate.
    ///
    /// # Errors
    /// If the operands are not of the number and types the operation takes.
    pub fn push(&mut self, op: Op, args: &[Reg]) -> Result<Reg, BuildError> {
        self.push_imm(op, args, 0)
    }

    /// Appends an operation with its immediate.
    ///
    /// # Errors
    /// If the operands are not of the number and types the operation takes, or the immediate is out of range.
    pub fn push_imm(&mut self, op: Op, args: &[Reg], imm: u32) -> Result<Reg, BuildError> {
        let inst = self.check(op, args, imm)?;
        Ok(self.append(inst))
    }

    /// The instructions so far.
    pub fn insts(&self) -> &[Inst] {
        &self.insts
    }

    /// The type of a register.
    pub fn ty(&self, reg: Reg) -> Ty {
        self.insts[reg.index()].op().result()
    }

    /// A copy of the block so far.
    pub fn block(&self) -> Block {
        Block::from_insts(self.insts.clone())
    }

    /// The finished block.
    pub fn finish(self) -> Block {
        Block::from_insts(self.insts)
    }

    pub(crate) fn append(&mut self, inst: Inst) -> Reg {
        let reg = Reg(self.insts.len() as u32);
        self.insts.push(inst);
        reg
    }

    fn check(&self, op: Op, args: &[Reg], imm: u32) -> Result<Inst, BuildError> {
        let expected = op.operands();
        if args.len() != expected.len() {
            return Err(BuildError::Arity { op: op.name(), expected: expected.len(), found: args.len() });
        }
        let mut regs = [Reg(0); 3];
        for (i, (&reg, &ty)) in args.iter().zip(expected).enumerate() {
            let Some(inst) = self.insts.get(reg.index()) else {
                return Err(BuildError::Undefined { op: op.name(), position: i + 1, reg });
            };
            let found = inst.op().result();
            if found != ty {
                return Err(BuildError::Type { op: op.name(), position: i + 1, expected: ty, reg, found });
            }
            regs[i] = reg;
        }
        let stored = if op.is_leaf() {
            // Encoded again, so that every NaN constant is the one NaN.
            Leaf::decode(op, imm).map(|leaf| leaf.encode().1)
        } else {
            (imm < if op.has_shift() { 32 } else { 1 }).then_some(imm)
        };
        match stored {
            Some(imm) => Ok(Inst::new(op, regs, imm)),
            None => Err(BuildError::Immediate { op: op.name(), imm }),
        }
    }
}

/// The parts of a loop before it is verified.
#[derive(Debug, Clone)]
pub struct LoopParts {
    /// The way the rectangle moves.
    pub direction: Direction,
    /// The rectangle's size.
    pub rect: Rect,
    /// Which positions are visited.
    pub span: Span,
    /// The column expression's instructions.
    pub column: Block,
    /// The register of its value.
    pub column_result: Reg,
    /// The body's instructions, region after region.
    pub body: Block,
    /// How many instructions stand in the invariant region.
    pub invariant: usize,
    /// How many stand in the uniform region; the rest is varying.
    pub uniform: usize,
    /// The carried registers' next values.
    pub next: [Option<Reg>; 5],
    /// The break mask.
    pub break_if: Option<Reg>,
}

impl LoopParts {
    fn build(self) -> Loop {
        Loop {
            direction: self.direction,
            rect: self.rect,
            span: self.span,
            column: Column { block: self.column, result: self.column_result },
            invariant_end: self.invariant as u32,
            uniform_end: (self.invariant + self.uniform) as u32,
            body: self.body,
            next: self.next,
            break_if: self.break_if,
        }
    }
}

impl From<&Loop> for LoopParts {
    fn from(l: &Loop) -> LoopParts {
        LoopParts {
            direction: l.direction,
            rect: l.rect,
            span: l.span,
            column: l.column.block.clone(),
            column_result: l.column.result,
            body: l.body.clone(),
            invariant: l.region(Region::Invariant).len(),
            uniform: l.region(Region::Uniform).len(),
            next: l.next,
            break_if: l.break_if,
        }
    }
}

impl Program {
    /// Puts a program for images of `width` x `height` pixels together and verifies it.
    ///
    /// # Errors
    /// The first fault that the verifier finds.
    pub fn new(
        width: u32,
        height: u32,
        first: Option<LoopParts>,
        second: LoopParts,
    ) -> Result<Program, VerifyError> {
        let program = Program::assemble(width, height, first, second);
        verify::verify(&program)?;
        Ok(program)
    }

    /// Puts a program together whose maker vouches for it; debug builds verify it all the same.
    ///
    /// # Panics
    /// In debug builds, if the program is malformed. In others whoever uses it may panic.
    pub fn vouched(width: u32, height: u32, first: Option<LoopParts>, second: LoopParts) -> Program {
        let program = Program::assemble(width, height, first, second);
        if cfg!(debug_assertions)
            && let Err(fault) = verify::verify(&program)
        {
            panic!("a malformed program was vouched for: {fault}\n{program}");
        }
        program
    }

    pub(crate) fn assemble(width: u32, height: u32, first: Option<LoopParts>, second: LoopParts) -> Program {
        Program { width, height, first: first.map(LoopParts::build), second: second.build() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_nan_constant_is_the_one_nan() {
        let mut b = Builder::new();
        let with_payload = b.push_imm(Op::Const, &[], 0xffc0_0001).expect("a constant");
        let canonical = b.leaf(Leaf::Const(f32::NAN));
        let block = b.finish();
        assert_eq!(block.inst(with_payload), block.inst(canonical));
    }

    #[test]
    fn immediates_out_of_range_are_refused() {
        let mut b = Builder::new();
        let i = b.leaf(Leaf::IConst(1));
        assert!(b.push_imm(Op::IShl, &[i], 31).is_ok());
        let fault = b.push_imm(Op::IShl, &[i], 32);
        assert_eq!(fault, Err(BuildError::Immediate { op: "ishl", imm: 32 }));
        assert!(b.push_imm(Op::Read, &[], 5).is_err());
        assert!(b.push_imm(Op::IAdd, &[i, i], 1).is_err());
    }
}
