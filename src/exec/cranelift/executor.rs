//! The JIT as an executor.

use std::sync::Arc;
use std::time::{Duration, Instant};

use vsonar_ir::Program;

use super::compiler::Compiler;
use super::emit::Shape;
use super::helpers::Helpers;
use super::run::Runner;
use crate::exec::{Candidate, ExecError, Executor, Timing, Worker, check_size};
use crate::vision::CaseSet;

/// Compiles every candidate and runs it on all cases.
///
/// ```
/// use vsonar::exec::Executor;
/// use vsonar::exec::cranelift::{CraneliftExecutor, Shape};
/// assert_eq!(CraneliftExecutor::new(Shape::Lanes4)?.name(), "cranelift");
/// assert_eq!(CraneliftExecutor::new(Shape::Scalar)?.name(), "cranelift-scalar");
/// # Ok::<(), vsonar::exec::ExecError>(())
/// ```
#[derive(Debug)]
pub struct CraneliftExecutor {
    shape: Shape,
    helpers: Arc<Helpers>,
}

impl CraneliftExecutor {
    /// An executor that runs so many cases at once.
    ///
    /// # Errors
    /// If Cranelift has no code generator for this machine, or the system refuses executable memory.
    pub fn new(shape: Shape) -> Result<CraneliftExecutor, ExecError> {
        Ok(CraneliftExecutor { shape, helpers: Arc::new(Helpers::new()?) })
    }

    /// How many cases run at once.
    pub const fn shape(&self) -> Shape {
        self.shape
    }

    /// A worker for one thread, which also runs programs that are not a candidate's.
    ///
    /// # Errors
    /// If Cranelift has no code generator for this machine.
    pub fn cranelift_worker(&self) -> Result<CraneliftWorker, ExecError> {
        Ok(CraneliftWorker {
            compiler: Compiler::new(self.shape, Arc::clone(&self.helpers))?,
            runner: Runner::new(true),
        })
    }
}

impl Executor for CraneliftExecutor {
    fn name(&self) -> &'static str {
        match self.shape {
            Shape::Scalar => "cranelift-scalar",
            Shape::Lanes4 => "cranelift",
        }
    }

    fn worker(&self) -> Result<Box<dyn Worker>, ExecError> {
        Ok(Box::new(self.cranelift_worker()?))
    }
}

/// One thread's compiler and scratch space.
pub struct CraneliftWorker {
    compiler: Compiler,
    runner: Runner,
}

impl CraneliftWorker {
    /// Writes the answer of `program` for every case of the set, in its order, and gives the times of
    /// compiling and running. `answers.len()` is `cases.len()`, and the images are of the program's size.
    ///
    /// # Errors
    /// If the program cannot be compiled or the images are of another size.
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
        if let Some(answer) = program.constant_answer() {
            answers.fill(answer);
            return Ok(Timing::default());
        }
        let start = Instant::now();
        let code = self.compiler.compile(program)?;
        let compile = start.elapsed();
        let start = Instant::now();
        self.runner.run(program, code, cases, answers);
        Ok(Timing { lower: Duration::ZERO, compile, execute: start.elapsed() })
    }
}

impl Worker for CraneliftWorker {
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

impl std::fmt::Debug for CraneliftWorker {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("CraneliftWorker").finish_non_exhaustive()
    }
}
