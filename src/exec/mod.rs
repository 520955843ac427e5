//! Executors: what turns a candidate program and a set of fitness cases into answers.
//!
//! All of them give the same bits. `tree` walks the individual itself, straight from the specification, and is
//! the judge of what a program means; the others start from the lowered, optimised IR program.

use std::cell::RefCell;
use std::sync::OnceLock;
use std::time::Duration;

use vsonar_ir::Program;
use vsonar_ir::opt::Optimiser;

use crate::tree::Individual;
use crate::vision::CaseSet;

pub mod auto;
pub mod batch;
pub mod cranelift;
#[cfg(test)]
mod operations;
pub mod reference;
mod strips;
pub mod tree;

/// An individual to be executed, with its program lowered and optimised when first asked for, so that the
/// walker never lowers. Threads may share it.
#[derive(Debug)]
pub struct Candidate<'a> {
    individual: &'a Individual,
    width: u32,
    height: u32,
    lowered: OnceLock<Lowered>,
}

/// What lowering and optimising gave.
#[derive(Debug)]
struct Lowered {
    program: Program,
    operations_before: usize,
    time: Duration,
}

thread_local! {
    /// The thread's optimiser, for the space it works in.
    static OPTIMISER: RefCell<Optimiser> = RefCell::default();
}

impl<'a> Candidate<'a> {
    /// A candidate for images of `width` x `height` pixels.
    pub fn new(individual: &'a Individual, width: u32, height: u32) -> Candidate<'a> {
        Candidate { individual, width, height, lowered: OnceLock::new() }
    }

    /// Width and height of the images, in pixels.
    pub fn size(&self) -> (u32, u32) {
        (self.width, self.height)
    }

    /// The individual.
    pub fn individual(&self) -> &'a Individual {
        self.individual
    }

    /// The optimised program, lowered on first use.
    ///
    /// # Panics
    /// If there cannot be programs for images of the candidate's size ([`Program::fits`]).
    pub fn program(&self) -> &Program {
        &self.lowered().program
    }

    /// How many operations of the program were live before the optimiser, to compare with
    /// [`Program::operations`] after it.
    ///
    /// # Panics
    /// As [`Candidate::program`].
    pub fn operations_before(&self) -> usize {
        self.lowered().operations_before
    }

    fn lowered(&self) -> &Lowered {
        self.lowered.get_or_init(|| {
            let start = std::time::Instant::now();
            let program = crate::lower::lower(self.individual, self.width, self.height);
            let (program, operations_before) = OPTIMISER.with_borrow_mut(|optimiser| {
                let program = optimiser.optimise(program);
                (program, optimiser.live_operations())
            });
            Lowered { program, operations_before, time: start.elapsed() }
        })
    }

    /// The time lowering and optimising took, zero if it was not done.
    pub fn lowering(&self) -> Duration {
        self.lowered.get().map_or(Duration::ZERO, |lowered| lowered.time)
    }
}

/// Where a worker's time went, summed over its candidates. Time is not part of any result.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Timing {
    /// Lowering and optimising.
    pub lower: Duration,
    /// Code generation.
    pub compile: Duration,
    /// Running the program on the cases.
    pub execute: Duration,
}

impl std::ops::AddAssign for Timing {
    fn add_assign(&mut self, other: Timing) {
        self.lower += other.lower;
        self.compile += other.compile;
        self.execute += other.execute;
    }
}

/// Why a program could not be executed.
#[derive(Debug, thiserror::Error)]
pub enum ExecError {
    /// The candidate's image size is not that of the cases.
    #[error(
        "the program is for images of {program_width}x{program_height} pixels, the cases are {width}x{height}"
    )]
    ImageSize {
        /// Width the program was lowered for.
        program_width: u32,
        /// Height the program was lowered for.
        program_height: u32,
        /// Width of the cases' images.
        width: u32,
        /// Height of the cases' images.
        height: u32,
    },
    /// No program is for images of this size.
    #[error("images of {width}x{height} pixels are not possible: each side must be {min} to {max}",
        min = Program::MIN_SIDE, max = Program::MAX_SIDE)]
    Side {
        /// Width asked for.
        width: u32,
        /// Height asked for.
        height: u32,
    },
    /// The machine has no vectors of this width.
    #[error("this machine has no vectors of {} lanes", .0.lanes())]
    Vectors(batch::Vectors),
    /// Code could not be generated.
    #[error("the program could not be compiled: {0}")]
    Compile(String),
    /// Executable memory was refused by the system.
    #[error("no executable memory: {0}")]
    Memory(std::io::Error),
    /// The program has more than [`MAX_COMPILED`] instructions.
    #[error("the program has {instructions} instructions, and native code is made of at most {MAX_COMPILED}")]
    TooLong {
        /// How many it has.
        instructions: usize,
    },
}

/// Programs of more instructions ([`Program::len`]) are not compiled to native code, which would take longer than
/// anybody waits for; interpreters run programs of any length.
pub const MAX_COMPILED: usize = 200_000;

/// Bytes of stack that compiled code may take in this process, whose threads have two megabytes.
pub(crate) const MAX_STACK: usize = 512 << 10;

/// Refuses cases whose images are not of a program's size, given as width and height.
pub(crate) fn check_size(program: (u32, u32), cases: &CaseSet) -> Result<(), ExecError> {
    let (program_width, program_height) = program;
    let (width, height) = (cases.width(), cases.height());
    if program == (width, height) {
        return Ok(());
    }
    Err(ExecError::ImageSize { program_width, program_height, width, height })
}

/// The final registers of a loop that anyone reads.
pub(crate) fn wanted(program: &Program, first: bool) -> [bool; 5] {
    if first { program.second().reads_first_loop() } else { [true, false, false, false, false] }
}

/// A way of running programs, shared by all threads.
pub trait Executor: Send + Sync {
    /// The name in `--executor`.
    fn name(&self) -> &'static str;

    /// Whether it runs lowered, optimised programs. If not, whoever uses it runs every individual, and takes no
    /// answer from the program.
    fn lowers(&self) -> bool {
        true
    }

    /// A worker for one thread, with its contexts, code memory and scratch space.
    ///
    /// # Errors
    /// If the machine cannot run this executor.
    fn worker(&self) -> Result<Box<dyn Worker>, ExecError>;
}

/// One thread's share of an executor.
pub trait Worker {
    /// Writes the answer of the candidate for every case of the set, in its order: the final register `a` of
    /// the second tree. `answers.len()` is `cases.len()`.
    ///
    /// # Errors
    /// If the program cannot be compiled or does not fit the cases.
    fn answers(
        &mut self,
        candidate: &Candidate<'_>,
        cases: &CaseSet,
        answers: &mut [f32],
    ) -> Result<Timing, ExecError>;
}
