//! The reference evaluator: slow, obvious, the oracle of the language.
//!
//! It runs one case at a time, row after row, every instruction of every region where the text says it stands
//! in meaning: invariant ones before the loop, uniform and varying ones at each row. It knows nothing of lanes.

use crate::machine::Scalar;
use crate::op::{Leaf, Value};
use crate::program::{Block, Inst, Loop, Program, Reg};
use crate::window::{WindowAt, Windows};

/// What a run of a program left behind.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outcome {
    /// The first loop's final registers; all 0 where there is no first loop.
    pub first: [f32; 5],
    /// The second loop's final registers; `second[0]` is the answer.
    pub second: [f32; 5],
    /// How many positions each loop visited.
    pub positions: [u32; 2],
}

/// The answer of the program in the column `x_obstacle` (in pixels: a whole number from +0 to the image's width
/// less 1, as the optimiser assumes) of the image behind `windows`: a row.
pub fn answer<W: Windows + ?Sized>(program: &Program, windows: &W, x_obstacle: f32) -> f32 {
    run(program, windows, x_obstacle).second[0]
}

/// Runs both loops. `x_obstacle` is as for [`answer`].
pub fn run<W: Windows + ?Sized>(program: &Program, windows: &W, x_obstacle: f32) -> Outcome {
    let case = Case { program, windows, x_obstacle };
    let (first, n1) = program.first().map_or(([0.0; 5], 0), |l| case.run_loop(l, [0.0; 5]));
    let (second, n2) = case.run_loop(program.second(), first);
    Outcome { first, second, positions: [n1, n2] }
}

struct Case<'a, W: ?Sized> {
    program: &'a Program,
    windows: &'a W,
    x_obstacle: f32,
}

/// Everything a leaf may ask for at one position.
struct Position<'a> {
    iter2: [f32; 5],
    x: u32,
    y: u32,
    first_window: f32,
    registers: &'a [f32; 5],
}

impl<W: Windows + ?Sized> Case<'_, W> {
    /// Final registers and the number of positions visited.
    fn run_loop(&self, l: &Loop, iter2: [f32; 5]) -> ([f32; 5], u32) {
        let column = l.column();
        let nowhere = Position { iter2, x: 0, y: 0, first_window: 0.0, registers: &[0.0; 5] };
        let mut values = Vec::new();
        self.run_block(column.block(), l, &nowhere, &mut values);
        let x = l.rect().resolve_column(values[column.result().index()].f32(), self.program.width());

        let mut registers = [0.0f32; 5];
        let mut positions = 0;
        let mut first_window = l.first_window_at_start(self.program.height());
        for y in l.rows(self.program.height()) {
            positions += 1;
            let position = Position { iter2, x, y, first_window, registers: &registers };
            self.run_block(l.body(), l, &position, &mut values);
            registers = l.next().map(|next| next.map_or(0.0, |reg: Reg| values[reg.index()].f32()));
            if l.break_if().is_some_and(|reg| values[reg.index()].mask()) {
                break;
            }
            first_window = -1.0;
        }
        (registers, positions)
    }

    fn run_block(&self, block: &Block, l: &Loop, at: &Position<'_>, values: &mut Vec<Value<Scalar>>) {
        values.clear();
        for inst in block.insts() {
            let value = match inst.leaf() {
                Some(leaf) => self.leaf(leaf, l, at),
                None => apply(inst, values),
            };
            values.push(value);
        }
    }

    fn leaf(&self, leaf: Leaf, l: &Loop, at: &Position<'_>) -> Value<Scalar> {
        Value::F32(match leaf {
            Leaf::Const(value) => value,
            Leaf::IConst(value) => return Value::I32(value),
            Leaf::MConst(value) => return Value::Mask(value),
            Leaf::XObstacle => self.x_obstacle,
            Leaf::Iter2(k) => at.iter2[k as usize],
            Leaf::X => at.x as f32,
            Leaf::Y => at.y as f32,
            Leaf::FirstWindow => at.first_window,
            Leaf::Read(k) => at.registers[k as usize],
            Leaf::Window(operand) => {
                self.windows.average(WindowAt { operand, rect: l.rect(), x: at.x, y: at.y })
            }
        })
    }
}

/// Computes an instruction that is no leaf from the values of the registers below it.
///
/// # Panics
/// If the instruction is a leaf or its operands are not of its types; the verifier excludes the latter.
pub fn apply(inst: &Inst, values: &[Value<Scalar>]) -> Value<Scalar> {
    let mut args = [Value::Mask(false); 3];
    for (slot, reg) in args.iter_mut().zip(inst.args()) {
        *slot = values[reg.index()];
    }
    let args = &args[..inst.args().len()];
    inst.op().apply(&mut Scalar, args, inst.imm()).expect("leaves are handled by the caller")
}
