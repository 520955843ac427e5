//! The executor that chooses: for each program the batch interpreter or the compiler, whichever is expected to
//! be done sooner, code generation included.
//!
//! What is expected comes from a cost model that is fitted to the times measured as the run goes
//! ([`model`](self)), over what the cost is made of: instructions to be compiled, operations at each row, lanes,
//! positions and the share of them that is visited, columns whose windows must be found. The models are shared
//! by all threads. Which executor runs a program depends on the machine and its load; what comes out does not.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use vsonar_ir::Program;

use self::features::{Features, features};
use self::model::Model;
use super::batch::{BatchExecutor, BatchWorker};
use super::cranelift::{CraneliftExecutor, CraneliftWorker, Shape};
use super::{Candidate, ExecError, Executor, Timing, Worker};
use crate::vision::CaseSet;

mod features;
mod model;

/// Programs at the beginning that the two run in turns, so that both are known.
const TRIAL: u64 = 64;
/// Of so many programs one is given to the executor that seems slower, where it seems slower by less than
/// [`CLOSE`] …
const EXPLORE_CLOSE: u64 = 24;
/// … and of so many where it seems slower by more.
const EXPLORE_FAR: u64 = 256;
/// A ratio of expected times.
const CLOSE: f64 = 1.5;
/// Where the slower one is expected to lose more microseconds than this, nothing is learned from it: to compile a long
/// program takes longer than all that could be saved.
const TOO_DEAR: f64 = 20_000.0;

/// Where the models start from: microseconds on a common machine, for the units of [`features`].
const BATCH_START: Features = [2.0, 1.0, 4.0, 0.8, 3.5, 20.0, 0.4, 1.7, 10.0];
const JIT_START: Features = [40.0, 25.0, 10.0, 3.0, 4.0, 60.0, 1.5, 2.0, 30.0];

/// Chooses an executor for each program.
///
/// ```
/// use vsonar::exec::{Executor, auto::AutoExecutor};
/// assert_eq!(AutoExecutor::new().name(), "auto");
/// ```
#[derive(Debug)]
pub struct AutoExecutor {
    batch: BatchExecutor,
    /// Absent where this machine has no code generator or refuses executable memory.
    jit: Option<CraneliftExecutor>,
    chooser: Arc<Chooser>,
}

impl AutoExecutor {
    /// With the widest vectors of this machine, and the compiler if it can be used.
    #[expect(clippy::new_without_default, reason = "it looks at the machine")]
    pub fn new() -> AutoExecutor {
        AutoExecutor {
            batch: BatchExecutor::widest(),
            jit: CraneliftExecutor::new(Shape::Lanes4).ok(),
            chooser: Arc::new(Chooser::new()),
        }
    }

    /// How many programs either has run so far.
    pub fn choices(&self) -> Choices {
        self.chooser.lock().choices
    }
}

/// How many programs were given to either executor.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Choices {
    /// To the batch interpreter.
    pub batch: u64,
    /// To the compiler.
    pub jit: u64,
}

impl Executor for AutoExecutor {
    fn name(&self) -> &'static str {
        "auto"
    }

    fn worker(&self) -> Result<Box<dyn Worker>, ExecError> {
        let jit = self.jit.as_ref().and_then(|jit| jit.cranelift_worker().ok());
        Ok(Box::new(AutoWorker { batch: self.batch.batch_worker(), jit, chooser: Arc::clone(&self.chooser) }))
    }
}

/// One of the two executors.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Choice {
    Batch,
    Jit,
}

/// What all threads have learned.
#[derive(Debug)]
struct Chooser {
    state: Mutex<State>,
}

#[derive(Debug)]
struct State {
    batch: Model,
    jit: Model,
    programs: u64,
    choices: Choices,
}

impl Chooser {
    fn new() -> Chooser {
        let (batch, jit) = (Model::new(BATCH_START), Model::new(JIT_START));
        Chooser { state: Mutex::new(State { batch, jit, programs: 0, choices: Choices::default() }) }
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        // Whoever panicked in here left numbers behind, and any numbers will do.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl State {
    fn choose(&mut self, features: &Features) -> Choice {
        self.programs += 1;
        let (batch, jit) = (self.batch.predict(features), self.jit.predict(features));
        let (better, other) =
            if batch <= jit { (Choice::Batch, Choice::Jit) } else { (Choice::Jit, Choice::Batch) };
        let explore = match batch.max(jit) <= CLOSE * batch.min(jit) {
            true => EXPLORE_CLOSE,
            false => EXPLORE_FAR,
        };
        let choice = if (batch - jit).abs() > TOO_DEAR {
            better
        } else if self.programs <= TRIAL {
            if self.programs.is_multiple_of(2) { Choice::Batch } else { Choice::Jit }
        } else if self.programs.is_multiple_of(explore) {
            other
        } else {
            better
        };
        match choice {
            Choice::Batch => self.choices.batch += 1,
            Choice::Jit => self.choices.jit += 1,
        }
        choice
    }

    fn learn(&mut self, choice: Choice, features: &Features, time: Duration) {
        let model = match choice {
            Choice::Batch => &mut self.batch,
            Choice::Jit => &mut self.jit,
        };
        model.learn(features, time.as_secs_f64() * 1e6);
    }
}

struct AutoWorker {
    batch: BatchWorker,
    jit: Option<CraneliftWorker>,
    chooser: Arc<Chooser>,
}

impl AutoWorker {
    fn run(&mut self, program: &Program, cases: &CaseSet, answers: &mut [f32]) -> Result<Timing, ExecError> {
        let Some(jit) = self.jit.as_mut().filter(|_| program.constant_answer().is_none()) else {
            return self.batch.run(program, cases, answers);
        };
        let features = features(program, cases.len());
        let choice = self.chooser.lock().choose(&features);
        let timing = match choice {
            Choice::Batch => self.batch.run(program, cases, answers)?,
            Choice::Jit => match jit.run(program, cases, answers) {
                // What cannot be compiled can be interpreted.
                Err(ExecError::Memory(_) | ExecError::Compile(_) | ExecError::TooLong { .. }) => {
                    return self.batch.run(program, cases, answers);
                }
                result => result?,
            },
        };
        self.chooser.lock().learn(choice, &features, timing.compile + timing.execute);
        Ok(timing)
    }
}

impl Worker for AutoWorker {
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

#[cfg(test)]
mod tests {
    use super::*;

    /// The features of a program of so many instructions that breaks, on 400 cases.
    fn of_length(len: usize) -> Features {
        let lanes = 0.4;
        [1.0, len as f64 / 10.0, 0.0, 0.0, 0.0, 0.0, lanes, lanes * len as f64 / 20.0, 0.0]
    }

    #[test]
    fn short_programs_are_tried_on_both() {
        let chooser = Chooser::new();
        (0..TRIAL).for_each(|_| _ = chooser.lock().choose(&of_length(40)));
        assert_eq!(chooser.lock().choices, Choices { batch: TRIAL / 2, jit: TRIAL / 2 });
    }

    #[test]
    fn a_long_program_is_not_compiled_to_learn_how_long_that_takes() {
        let chooser = Chooser::new();
        let long = of_length(100_000);
        let programs = TRIAL + 2 * EXPLORE_FAR;
        (0..programs).for_each(|_| _ = chooser.lock().choose(&long));
        assert_eq!(chooser.lock().choices, Choices { batch: programs, jit: 0 });
    }
}
