//! Runs a program over a set of cases, group by group.

use vsonar_ir::{Direction, Leaf, Loop, Program, Span};

use super::plan::{LoopPlan, Planner, slots_needed};
use super::rows::{Positions, Rows, Visit};
use super::slots::{self, Slots};
use super::steps::Straight;
use super::vectors::InstructionSet;
use crate::exec::strips::{StripTable, Strips};
use crate::exec::wanted;
use crate::vision::{Arena, CaseSet, LANES, arena_len};

/// Positions that are gathered at a time, where a loop iterates in columns of its own: most lanes break early.
const GATHERED: usize = 32;

/// The interpreter of one thread: its registers, plans and tables, used again from program to program.
///
/// The plans are made for its own slots and tables by [`Interpreter::prepare`], before anything is run; they stay where
/// they are until it is called again, and a plan is complete before any of it is run. That is the ground of the
/// `unsafe` blocks here.
#[derive(Debug)]
pub(super) struct Interpreter {
    instructions: InstructionSet,
    slots: Slots,
    planner: Planner,
    plans: [LoopPlan; 2],
    /// The uniform values of both loops, by spread and position.
    tables: [Vec<u32>; 2],
    scratch: Arena,
}

impl Interpreter {
    pub(super) fn new(instructions: InstructionSet) -> Interpreter {
        Interpreter {
            instructions,
            slots: Slots::default(),
            planner: Planner::default(),
            plans: Default::default(),
            tables: Default::default(),
            scratch: Arena::default(),
        }
    }

    /// Writes the program's answer for every case. The set's images are of the program's size.
    pub(super) fn run(&mut self, program: &Program, cases: &CaseSet, answers: &mut [f32]) {
        self.prepare(program);
        let first_wanted = wanted(program, true);
        for (group, answers) in answers.chunks_mut(LANES).enumerate() {
            self.slots.fill(slots::X_OBSTACLE, cases.x_obstacle(group));
            if let Some(first) = program.first() {
                self.run_loop(0, first, cases, group);
                for k in (0..5).filter(|&k| first_wanted[k]) {
                    let value = self.slots.values(slots::out(k));
                    self.slots.fill(slots::iter2(k), &value);
                }
            }
            self.run_loop(1, program.second(), cases, group);
            let values = self.slots.values(slots::out(0));
            answers.copy_from_slice(&values[..answers.len()]);
        }
    }

    /// Plans the program's loops and computes what does not change with the case.
    fn prepare(&mut self, program: &Program) {
        let height = program.height();
        self.slots.reserve(slots_needed(program.loops()));
        self.planner.begin(&mut self.slots);
        let loops = [program.first(), Some(program.second())];
        for (i, l) in loops.into_iter().enumerate() {
            let Some(l) = l else { continue };
            let wanted = wanted(program, i == 0);
            self.planner.plan(l, &wanted, &mut self.slots, &mut self.plans[i]);
        }
        if let Some(first) = program.first() {
            // Both loops carry in the same slots.
            let written = |l: &Loop, k: usize| l.next()[k].is_some();
            let either = std::array::from_fn(|k| written(first, k) || written(program.second(), k));
            self.plans.iter_mut().for_each(|plan| plan.written = either);
        }
        // SAFETY: the steps have just been planned, for these slots.
        self.instructions.run(unsafe { Straight::new(&self.planner.prologue) });
        for (i, l) in loops.into_iter().enumerate() {
            if let Some(l) = l {
                self.tabulate(i, l, height);
            }
        }
    }

    /// Computes the values that depend on the row alone, for the positions that are visited.
    fn tabulate(&mut self, number: usize, l: &Loop, height: u32) {
        let plan = &mut self.plans[number];
        let table = &mut self.tables[number];
        if plan.tables.is_empty() {
            return;
        }
        let positions = positions(l, height);
        let padded = (l.rect().positions(height) as usize).next_multiple_of(LANES);
        table.resize(plan.tables.len() * padded, 0);
        // Constants may stand among the invariant instructions.
        // SAFETY: the steps have just been planned, for these slots.
        self.instructions.run(unsafe { Straight::new(&plan.invariant) });
        let top = l.rect().rows(height).0;
        let visited = positions.range();
        for start in (0..padded).step_by(LANES).filter(|&s| s < visited.end && s + LANES > visited.start) {
            if let Some([y, first_window]) = plan.position_slots {
                let row = |p: usize| (start + p) as f32 + top as f32;
                self.slots.fill(y, &std::array::from_fn(row));
                let at_start = l.first_window_at_start(height);
                let flag = |p: usize| if start + p == positions.first { at_start } else { -1.0 };
                self.slots.fill(first_window, &std::array::from_fn(flag));
            }
            // SAFETY: as above.
            self.instructions.run(unsafe { Straight::new(&plan.uniform) });
            for (t, slot) in plan.tables.iter().enumerate() {
                let values = self.slots.values(*slot).map(f32::to_bits);
                table[t * padded + start..][..LANES].copy_from_slice(&values);
            }
        }
        for (spread, table) in plan.spreads.iter_mut().zip(table.chunks_exact(padded)) {
            spread.table = table.as_ptr();
        }
    }

    /// Resolves the columns of a loop for a group, finds its strips, and runs it.
    fn run_loop(&mut self, number: usize, l: &Loop, cases: &CaseSet, group: usize) {
        let plan = &mut self.plans[number];
        let own = l.column().as_leaf() == Some(Leaf::XObstacle);
        let reads = !plan.operands.is_empty();
        let mut columns = [0; LANES];
        if plan.uses_x || reads && !own {
            let values = match l.column().as_leaf() {
                Some(Leaf::XObstacle) => *cases.x_obstacle(group),
                Some(Leaf::Const(value)) => [value; LANES],
                _ => {
                    // SAFETY: the steps are planned for these slots.
                    self.instructions.run(unsafe { Straight::new(&plan.column) });
                    let slot = plan.column_value.expect("other columns are computed");
                    self.slots.values(slot)
                }
            };
            columns = values.map(|value| l.rect().resolve_column(value, cases.width()));
            self.slots.fill(slots::X, &columns.map(|x| x as f32));
        }
        for k in (0..5).filter(|&k| plan.written[k]) {
            self.slots.splat(slots::carried(k), 0);
        }
        // SAFETY: the steps are planned for these slots.
        self.instructions.run(unsafe { Straight::new(&plan.invariant) });
        let (rect, height) = (l.rect(), cases.height());
        let half = cases.group_len(group) <= LANES / 2;
        let positions = positions(l, height);
        if let Some(strips) = Strips::find(cases, group, rect, own, &columns, &plan.operands) {
            let table = strips.table(rect, height, &plan.operands);
            // SAFETY: `prepare` has planned the loop for these slots and filled its tables.
            unsafe {
                run_rows(self.instructions, plan, &mut self.slots, &table, positions, positions, half);
            }
            return;
        }
        self.scratch.grow(arena_len(rect, height));
        for part in positions.parts(GATHERED) {
            cases.gather(group, rect, &columns, &plan.operands, part.range(), &mut self.scratch);
            let strips = Strips::Own(&self.scratch);
            let table = strips.table(rect, height, &plan.operands);
            // SAFETY: as above.
            if unsafe { run_rows(self.instructions, plan, &mut self.slots, &table, positions, part, half) } {
                break;
            }
        }
    }
}

/// Runs one part of a loop's positions, for a group of which perhaps only the first half is there. Whether every lane
/// has left the loop.
///
/// # Safety
/// The plan was made for these slots, which have not moved since, and its tables are filled for all positions.
unsafe fn run_rows(
    instructions: InstructionSet,
    plan: &mut LoopPlan,
    slots: &mut Slots,
    strips: &StripTable<'_>,
    all: Positions,
    part: Positions,
    half: bool,
) -> bool {
    let rows = Rows {
        steps: &mut plan.varying,
        windows: &plan.windows,
        spreads: &plan.spreads,
        finals: &plan.finals,
        break_if: plan.break_if,
        alive: slots.pointer(slots::ALIVE),
        begin: part.first == all.first,
        end: part.range().contains(&all.last()),
        strips,
        positions: part,
    };
    // SAFETY: the caller's promise is this one.
    unsafe {
        if half {
            instructions.run(Visit::<true>::new(rows))
        } else {
            instructions.run(Visit::<false>::new(rows))
        }
    }
}

/// The positions of a loop in an image `height` high, in the order they are visited.
fn positions(l: &Loop, height: u32) -> Positions {
    let count = l.rect().positions(height) as usize;
    let up = l.direction() == Direction::Up;
    match (l.span(), up) {
        (Span::All, true) => Positions { first: count - 1, count, up },
        (Span::All, false) => Positions { first: 0, count, up },
        (Span::Last, true) => Positions { first: 0, count: 1, up },
        (Span::Last, false) => Positions { first: count - 1, count: 1, up },
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use image::GrayImage;

    use super::*;
    use crate::exec::batch::Vectors;
    use crate::exec::operations::{Place, Subject, check_all};
    use crate::vision::{Lane, WindowSums};

    /// An interpreter with a group of cases.
    struct Alone(Interpreter, CaseSet);

    impl Subject for Alone {
        fn run(&mut self, program: &Program, place: Place, iter2: &[[f32; LANES]; 5]) -> [f32; LANES] {
            let Alone(interpreter, cases) = self;
            interpreter.prepare(program);
            interpreter.slots.fill(slots::X_OBSTACLE, cases.x_obstacle(0));
            for (k, values) in iter2.iter().enumerate() {
                interpreter.slots.fill(slots::iter2(k), values);
            }
            if place == Place::Column {
                let plan = &interpreter.plans[1];
                // SAFETY: the steps have just been planned, for these slots.
                interpreter.instructions.run(unsafe { Straight::new(&plan.column) });
                return interpreter.slots.values(plan.column_value.expect("the column is an expression"));
            }
            interpreter.run_loop(1, program.second(), cases, 0);
            interpreter.slots.values(slots::out(0))
        }
    }

    #[test]
    fn every_operation_means_what_the_table_says() {
        let image = Arc::new(WindowSums::new(&GrayImage::new(16, 16)));
        for vectors in Vectors::ALL {
            let Some(instructions) = InstructionSet::of(vectors) else { continue };
            let lanes = vec![Lane { image: 0, column: 8 }; LANES];
            let cases = CaseSet::new(vec![Arc::clone(&image)], lanes).expect("sound");
            check_all(&mut Alone(Interpreter::new(instructions), cases), vectors.executor());
        }
    }

    #[test]
    fn positions_come_in_order_and_in_parts() {
        let up = Positions { first: 9, count: 10, up: true };
        assert_eq!((up.last(), up.range()), (0, 0..10));
        let parts: Vec<_> = up.parts(4).map(|p| (p.first, p.count, p.range())).collect();
        assert_eq!(parts, [(9, 4, 6..10), (5, 4, 2..6), (1, 2, 0..2)]);
        let down = Positions { first: 3, count: 1, up: false };
        assert_eq!(down.parts(4).collect::<Vec<_>>(), [down]);
    }
}
