//! Runs compiled code over a set of cases, group by group.

use vsonar_ir::{Leaf, Loop, Program};

use super::code::Code;
use super::lanes::LaneBlock;
use crate::exec::strips::Strips;
use crate::exec::wanted;
use crate::vision::{Arena, CaseSet, LANES, arena_len};

/// Scratch space for running programs, used again from one to the next.
#[derive(Debug)]
pub(crate) struct Runner {
    block: Box<LaneBlock>,
    /// Strips of columns that are not shared.
    scratch: Arena,
    /// Whether strips of the cases' own columns are worth keeping in the set, for other programs.
    shared: bool,
}

impl Runner {
    /// Empty scratch space. With `shared`, strips of the cases' own columns are taken from the set, which keeps
    /// those of all operands; else only those that a loop reads are gathered.
    pub(crate) fn new(shared: bool) -> Runner {
        Runner { block: Box::new(LaneBlock::new()), scratch: Arena::default(), shared }
    }

    /// Writes the program's answer for every case. The set's images are of the program's size.
    pub(crate) fn run(&mut self, program: &Program, code: Code<'_>, cases: &CaseSet, answers: &mut [f32]) {
        let wanted = wanted(program, true);
        for (group, answers) in answers.chunks_mut(LANES).enumerate() {
            self.block.x_obstacle = *cases.x_obstacle(group);
            self.block.iter2 = [[0.0; LANES]; 5];
            if let Some(first) = program.first() {
                self.run_loop(code, true, first, cases, group);
                for k in (0..5).filter(|&k| wanted[k]) {
                    self.block.iter2[k] = self.block.out[k];
                }
            }
            self.run_loop(code, false, program.second(), cases, group);
            answers.copy_from_slice(&self.block.out[0][..answers.len()]);
        }
    }

    /// Resolves the columns of a loop, finds its strips, and runs it.
    fn run_loop(&mut self, code: Code<'_>, first: bool, l: &Loop, cases: &CaseSet, group: usize) {
        let len = cases.group_len(group);
        let values = match l.column().as_leaf() {
            Some(Leaf::XObstacle) => self.block.x_obstacle,
            Some(Leaf::Const(value)) => [value; LANES],
            _ => {
                let done = code.run_column(first, &mut self.block, len);
                debug_assert!(done, "columns that are no such leaf have code");
                self.block.out[0]
            }
        };
        // Lanes beyond the last case hold what an earlier group left; any value resolves to some column.
        let columns = values.map(|value| l.rect().resolve_column(value, cases.width()));
        self.block.x = columns.map(|x| x as f32);
        let operands = l.operands();
        let own = l.column().as_leaf() == Some(Leaf::XObstacle);
        let (rect, height) = (l.rect(), cases.height());
        let whole = Strips::find(cases, group, rect, own && self.shared, &columns, &operands);
        let strips = whole.unwrap_or_else(|| {
            self.scratch.grow(arena_len(rect, height));
            let rows = 0..rect.positions(height) as usize;
            cases.gather(group, rect, &columns, &operands, rows, &mut self.scratch);
            Strips::Own(&self.scratch)
        });
        code.run_loop(first, &mut self.block, len, &strips.table(rect, height, &operands));
    }
}
