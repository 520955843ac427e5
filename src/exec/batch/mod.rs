//! The batch interpreter: the lanes of vectors are fitness cases, and one decoded instruction serves a whole group.
//!
//! No code is generated, so a program costs nothing before it runs, and still each operation is as wide as the
//! machine's vectors. The instruction set is chosen at run time; one generic source, over [`pulp::Simd`] and the
//! formulas of [`vsonar_ir::op`], is compiled for each.

use std::time::Instant;

use vsonar_ir::Program;

use self::interpreter::Interpreter;
use self::vectors::InstructionSet;
use crate::exec::{Candidate, ExecError, Executor, Timing, Worker, check_size};
use crate::vision::CaseSet;

mod interpreter;
mod lanes;
mod plan;
mod rows;
mod slots;
mod steps;
mod vectors;

pub use vectors::Vectors;

/// Interprets every candidate on groups of cases.
///
/// ```
/// use vsonar::exec::{Executor, batch::{BatchExecutor, Vectors}};
/// assert_eq!(BatchExecutor::widest().name(), "batch");
/// assert_eq!(BatchExecutor::new(Vectors::Scalar)?.name(), "batch-scalar");
/// # Ok::<(), vsonar::exec::ExecError>(())
/// ```
#[derive(Debug, Clone, Copy)]
pub struct BatchExecutor {
    name: &'static str,
    instructions: InstructionSet,
}

impl BatchExecutor {
    /// With the widest vectors of this machine.
    pub fn widest() -> BatchExecutor {
        let instructions = InstructionSet::of(Vectors::widest()).unwrap_or(InstructionSet::NONE);
        BatchExecutor { name: "batch", instructions }
    }

    /// With vectors of this width.
    ///
    /// # Errors
    /// If the machine has none.
    pub fn new(vectors: Vectors) -> Result<BatchExecutor, ExecError> {
        let instructions = InstructionSet::of(vectors).ok_or(ExecError::Vectors(vectors))?;
        Ok(BatchExecutor { name: vectors.executor(), instructions })
    }

    /// A worker for one thread, which also runs programs that are not a candidate's.
    pub fn batch_worker(&self) -> BatchWorker {
        BatchWorker { interpreter: Interpreter::new(self.instructions) }
    }
}

impl Executor for BatchExecutor {
    fn name(&self) -> &'static str {
        self.name
    }

    fn worker(&self) -> Result<Box<dyn Worker>, ExecError> {
        Ok(Box::new(self.batch_worker()))
    }
}

/// One thread's interpreter with its registers.
#[derive(Debug)]
pub struct BatchWorker {
    interpreter: Interpreter,
}

impl BatchWorker {
    /// Writes the answer of `program` for every case of the set, in its order, and gives the time it took.
    /// `answers.len()` is `cases.len()`.
    ///
    /// # Errors
    /// If the images are not of the program's size.
    ///
    /// # Panics
    /// If there are not as many answers as cases.
    pub fn run(
        &mut self,
        program: &Program,
        cases: &CaseSet,
        answers: &mut [f32],
    ) -> Result<Timing, ExecError> {
        assert_eq!(answers.len(), cases.len(), "an answer for every case");
        check_size((program.width(), program.height()), cases)?;
        let start = Instant::now();
        match program.constant_answer() {
            Some(answer) => answers.fill(answer),
            None => self.interpreter.run(program, cases, answers),
        }
        Ok(Timing { execute: start.elapsed(), ..Timing::default() })
    }
}

impl Worker for BatchWorker {
    fn answers(
        &mut self,
        candidate: &Candidate<'_>,
        cases: &CaseSet,
        answers: &mut [f32],
    ) -> Result<Timing, ExecError> {
        let timing = self.run(candidate.program(), cases, answers)?;
        Ok(Timing { lower: candidate.lowering(), ..timing })
    }
}
