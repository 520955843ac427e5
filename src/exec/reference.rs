//! The IR's reference evaluator as an executor: slow, obvious, one case at a time.

use std::time::Instant;

use crate::exec::{Candidate, ExecError, Executor, Timing, Worker, check_size};
use crate::vision::CaseSet;

/// Runs the optimised program on [`vsonar_ir::reference`].
#[derive(Debug, Clone, Copy, Default)]
pub struct ReferenceExecutor;

impl Executor for ReferenceExecutor {
    fn name(&self) -> &'static str {
        "reference"
    }

    fn worker(&self) -> Result<Box<dyn Worker>, ExecError> {
        Ok(Box::new(ReferenceWorker))
    }
}

struct ReferenceWorker;

impl Worker for ReferenceWorker {
    fn answers(
        &mut self,
        candidate: &Candidate<'_>,
        cases: &CaseSet,
        answers: &mut [f32],
    ) -> Result<Timing, ExecError> {
        let program = candidate.program();
        check_size(candidate.size(), cases)?;
        let start = Instant::now();
        for (i, (answer, lane)) in answers.iter_mut().zip(cases.lanes()).enumerate() {
            *answer = vsonar_ir::reference::answer(program, cases.image(i), lane.column as f32);
        }
        Ok(Timing { lower: candidate.lowering(), execute: start.elapsed(), ..Timing::default() })
    }
}
