//! Choosing an executor by its name.

use std::sync::Arc;

use clap::ValueEnum;
use vsonar::dataset::Dataset;
use vsonar::exec::auto::AutoExecutor;
use vsonar::exec::batch::{BatchExecutor, Vectors};
use vsonar::exec::cranelift::{CraneliftExecutor, Shape};
use vsonar::exec::reference::ReferenceExecutor;
use vsonar::exec::tree::TreeExecutor;
use vsonar::exec::{Candidate, ExecError, Executor};
use vsonar::tree::Individual;

use super::CliError;

/// The executors; their names are those of the library.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Choice {
    /// For each program batch or cranelift, whichever is expected to be done first
    Auto,
    /// An interpreter on vectors of fitness cases, the widest of this machine; compiles nothing
    Batch,
    /// The same on vectors of 16 cases (AVX-512)
    #[value(name = "batch-512")]
    Batch512,
    /// The same on vectors of 8 cases (AVX2)
    #[value(name = "batch-256")]
    Batch256,
    /// The same on vectors of 4 cases (SSE 4.2, NEON)
    #[value(name = "batch-128")]
    Batch128,
    /// The same, one case at a time
    BatchScalar,
    /// Native code, four fitness cases at a time
    Cranelift,
    /// Native code, one case at a time
    CraneliftScalar,
    /// An evaluator of the compiler's intermediate form, slow and simple
    Reference,
    /// A walker of the program as it is written, slow: what all others are held against
    Tree,
}

/// Stack of the thread that runs a program: the walker recurses as deep as the program is nested.
const STACK_BYTES: usize = 64 << 20;

impl Choice {
    /// The executor.
    ///
    /// # Errors
    /// If this machine cannot run it.
    pub(crate) fn make(self) -> Result<Arc<dyn Executor>, CliError> {
        let made: Result<Arc<dyn Executor>, ExecError> = match self {
            Choice::Auto => Ok(Arc::new(AutoExecutor::new())),
            Choice::Batch => Ok(Arc::new(BatchExecutor::widest())),
            Choice::Batch512 => batch(Vectors::V512),
            Choice::Batch256 => batch(Vectors::V256),
            Choice::Batch128 => batch(Vectors::V128),
            Choice::BatchScalar => batch(Vectors::Scalar),
            Choice::Cranelift => cranelift(Shape::Lanes4),
            Choice::CraneliftScalar => cranelift(Shape::Scalar),
            Choice::Reference => Ok(Arc::new(ReferenceExecutor)),
            Choice::Tree => Ok(Arc::new(TreeExecutor)),
        };
        // A worker is tried now, before a run folder is made.
        let made = made.and_then(|executor| executor.worker().map(|_| executor));
        made.map_err(|error| unusable(self.name(), &error))
    }

    /// All executors that this machine can run, in the order of the list above, each once.
    pub(crate) fn all_runnable() -> Vec<Arc<dyn Executor>> {
        // The widest batch interpreter is there under its short name already.
        let again = Vectors::widest().executor();
        let choices = Choice::value_variants().iter().filter(|choice| choice.name() != again);
        choices.filter_map(|choice| choice.make().ok()).collect()
    }

    /// The name in `--executor`, which is the library's.
    fn name(self) -> &'static str {
        match self {
            Choice::Auto => "auto",
            Choice::Batch => "batch",
            Choice::Batch512 => Vectors::V512.executor(),
            Choice::Batch256 => Vectors::V256.executor(),
            Choice::Batch128 => Vectors::V128.executor(),
            Choice::BatchScalar => Vectors::Scalar.executor(),
            Choice::Cranelift => "cranelift",
            Choice::CraneliftScalar => "cranelift-scalar",
            Choice::Reference => "reference",
            Choice::Tree => "tree",
        }
    }
}

fn cranelift(shape: Shape) -> Result<Arc<dyn Executor>, ExecError> {
    Ok(Arc::new(CraneliftExecutor::new(shape)?))
}

fn batch(vectors: Vectors) -> Result<Arc<dyn Executor>, ExecError> {
    Ok(Arc::new(BatchExecutor::new(vectors)?))
}

fn unusable(name: &str, error: &ExecError) -> CliError {
    CliError::Failed(format!("the executor {name} cannot be used on this machine: {error}{}", remedy(error)))
}

/// What to do about it: what one executor cannot run another can.
fn remedy(error: &ExecError) -> &'static str {
    match error {
        ExecError::ImageSize { .. } | ExecError::Side { .. } => "",
        ExecError::Vectors(_) | ExecError::Compile(_) | ExecError::Memory(_) | ExecError::TooLong { .. } => {
            "; choose `--executor batch`, which compiles nothing, runs on every machine and gives the same answers"
        }
    }
}

/// The answers of an individual to all cases of a set, in their order.
pub(crate) fn answers(
    executor: &dyn Executor,
    individual: &Individual,
    set: &Dataset,
) -> Result<Vec<f32>, CliError> {
    let run = || -> Result<Vec<f32>, ExecError> {
        let cases = set.case_set();
        let candidate = Candidate::new(individual, set.width(), set.height());
        let mut answers = vec![0.0; set.cases().len()];
        executor.worker()?.answers(&candidate, &cases, &mut answers)?;
        Ok(answers)
    };
    with_stack(run)?.map_err(|error| CliError::Failed(format!("{error}{}", remedy(&error))))
}

/// Calls a function on a thread with room for deep recursion.
pub(crate) fn with_stack<T: Send>(work: impl FnOnce() -> T + Send) -> Result<T, CliError> {
    std::thread::scope(|scope| {
        let thread = std::thread::Builder::new().stack_size(STACK_BYTES).spawn_scoped(scope, work)?;
        thread.join().or_else(|panic| std::panic::resume_unwind(panic))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_the_library_s() {
        for choice in Choice::value_variants() {
            let name = choice.to_possible_value().expect("none is hidden");
            let executor = choice.make().unwrap_or_else(|e| panic!("{choice:?}: {e:?}"));
            assert_eq!((name.get_name(), choice.name()), (executor.name(), executor.name()));
        }
    }
}
