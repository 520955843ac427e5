//! A loop in C: a function from the column asked for (and the first loop's registers) to the loop's registers.

use std::fmt::Write;

use vsonar_ir::formula::arith;
use vsonar_ir::op::{REGISTER_NAMES, Value};
use vsonar_ir::{Block, Direction, Leaf, Op, Reg, Region, Span, Ty};

use super::literal;
use super::live::Live;
use super::windows::Windows;
use super::writer::Writer;

/// A loop while it is written.
pub(super) struct LoopText<'a> {
    pub(super) prefix: &'a str,
    pub(super) number: u32,
    pub(super) live: &'a Live<'a>,
    pub(super) windows: Windows<'a>,
    pub(super) size: (u32, u32),
}

impl<'a> LoopText<'a> {
    /// The loop of this number, 1 or 2, of a program for images of this size.
    pub(super) fn new(prefix: &'a str, number: u32, live: &'a Live<'a>, size: (u32, u32)) -> LoopText<'a> {
        let (rect, operands) = (live.l.rect(), live.operands());
        LoopText { prefix, number, live, windows: Windows { prefix, number, rect, size, operands }, size }
    }

    /// The window operands.
    pub(super) fn windows(&self) -> &Windows<'a> {
        &self.windows
    }

    /// Which registers of the first loop this one takes.
    pub(super) fn takes(&self) -> impl Iterator<Item = usize> + '_ {
        (0..5).filter(|&k| self.live.has(Leaf::Iter2(k as u8)))
    }

    /// The definitions: the sums of a row, the column's rounding, the loop.
    pub(super) fn definitions(&self) -> String {
        let mut out = String::new();
        if !self.windows.operands.is_empty() {
            out.push_str(&self.windows.definitions());
        }
        if self.live.has_column() {
            out.push_str(&self.resolve());
        }
        out + &self.function()
    }

    /// Rounding and clamping of the column.
    fn resolve(&self) -> String {
        let (prefix, number, rect) = (self.prefix, self.number, self.live.l.rect());
        let (lo, hi) = rect.columns(self.size.0);
        let mut w = Writer::new(prefix);
        let value = w.text("value");
        let column = arith::resolve_column(&mut w, value, lo, hi);
        let (body, names) = w.print(&[column], "    ");
        format!(
            "/* Loop {number}: the centre column, rounded to the nearest (ties to even) and kept inside the image. */\n\
             static uint32_t {prefix}_centre_{number}(float value)\n{{\n{body}    return {};\n}}\n\n",
            names[0]
        )
    }

    fn function(&self) -> String {
        let Live { l, wanted, kept, .. } = self.live;
        let (prefix, number) = (self.prefix, self.number);
        let mut out = format!(
            "/* Loop {number}: {} with a window of {}. */\nstatic void {prefix}_loop_{number}(",
            match (l.span(), l.direction()) {
                (Span::Last, Direction::Up) => "the topmost row",
                (Span::Last, Direction::Down) => "the lowest row",
                (_, Direction::Up) => "all rows from the lowest up",
                (_, Direction::Down) => "all rows from the topmost down",
            },
            l.rect()
        );
        let mut params = vec![format!("const {prefix}_image *image"), "float x_obstacle".to_string()];
        params.extend(self.takes().map(|k| format!("float {}", iter2(k))));
        params.extend((0..5).filter(|&k| wanted[k]).map(|k| format!("float *final_{}", REGISTER_NAMES[k])));
        let _ = writeln!(out, "{})\n{{", params.join(", "));

        let mut body = Body { text: self, out: String::new(), names: Vec::new() };
        let result = body.column();
        for k in (0..5).filter(|&k| kept[k]) {
            body.line(1, &format!("float {} = 0.0f;", REGISTER_NAMES[k]));
        }
        if self.live.has_column() {
            body.line(1, &format!("const uint32_t centre = {prefix}_centre_{number}({result});"));
        }
        body.start();
        body.region(Region::Invariant, 1);
        match l.span() {
            Span::All => body.all_rows(),
            Span::Last => body.last_row(),
        }
        out.push_str(&body.out);
        for k in (0..5).filter(|&k| wanted[k]) {
            let name = REGISTER_NAMES[k];
            let _ = writeln!(out, "    *final_{name} = {};", if kept[k] { name } else { "0.0f" });
        }
        if self.windows.operands.is_empty() {
            out.push_str("    (void)image;\n");
        }
        if !self.live.has(Leaf::XObstacle) {
            out.push_str("    (void)x_obstacle;\n");
        }
        out + "}\n\n"
    }
}

/// The C name of a register of the first loop.
pub(super) fn iter2(register: usize) -> String {
    format!("iter2_{}", REGISTER_NAMES[register])
}

/// The statements of a loop's function.
pub(super) struct Body<'t, 'a> {
    pub(super) text: &'t LoopText<'a>,
    out: String,
    /// What stands for each register of the block, by number.
    pub(super) names: Vec<String>,
}

impl Body<'_, '_> {
    pub(super) fn line(&mut self, depth: usize, line: &str) {
        let _ = writeln!(self.out, "{:1$}{line}", "", 4 * depth);
    }

    /// Prepares for the body's block.
    fn start(&mut self) {
        self.names = vec![String::new(); self.text.live.l.body().len()];
        if self.text.live.has(Leaf::X) {
            self.line(1, "const float x = (float)(int32_t)centre;");
        }
    }

    /// The column's expression; what stands for its value.
    fn column(&mut self) -> String {
        let live = self.text.live;
        let column = live.l.column();
        if !self.text.live.has_column() {
            return String::new();
        }
        self.names = vec![String::new(); column.block().len()];
        for index in 0..column.block().len() {
            if live.column[index] {
                self.instruction(column.block(), Reg(index as u32), 'u', 1);
            }
        }
        self.names[column.result().index()].clone()
    }

    pub(super) fn region(&mut self, region: Region, depth: usize) {
        let live = self.text.live;
        for index in live.l.region(region).filter(|&index| live.body[index]) {
            self.instruction(live.l.body(), Reg(index as u32), 'v', depth);
        }
    }

    /// One instruction: a name for most leaves, a statement for everything else.
    fn instruction(&mut self, block: &Block, reg: Reg, letter: char, depth: usize) {
        let (inst, prefix) = (block.inst(reg), self.text.prefix);
        let name = format!("{letter}{}", reg.0);
        let live = self.text.live;
        self.names[reg.index()] = match inst.leaf() {
            Some(Leaf::Const(value)) => literal::float(prefix, value),
            Some(Leaf::IConst(value)) => format!("0x{value:08x}u"),
            Some(Leaf::MConst(value)) => u8::from(value).to_string(),
            Some(Leaf::XObstacle) => "x_obstacle".into(),
            Some(Leaf::Iter2(k)) => iter2(k.into()),
            Some(Leaf::X) => "x".into(),
            Some(Leaf::Y) => "y".into(),
            Some(Leaf::FirstWindow) => "first_window".into(),
            Some(Leaf::Read(k)) if live.kept[usize::from(k)] && live.l.span() == Span::All => {
                REGISTER_NAMES[usize::from(k)].into()
            }
            Some(Leaf::Read(_)) => "0.0f".into(),
            Some(Leaf::Window(operand)) => {
                let average = self.text.windows.average(operand);
                self.line(depth, &format!("const float {name} = {average};"));
                name
            }
            None => {
                let expression = self.expression(block, reg, letter, depth);
                let ty = match inst.op().result() {
                    Ty::F32 => "float",
                    Ty::I32 => "uint32_t",
                    Ty::Mask => "int",
                };
                self.line(depth, &format!("const {ty} {name} = {expression};"));
                name
            }
        };
    }

    fn expression(&mut self, block: &Block, reg: Reg, letter: char, depth: usize) -> String {
        let (inst, prefix) = (block.inst(reg), self.text.prefix);
        // Compilers fold literals with their own arithmetic, so at least one operand has a name.
        let literal =
            |arg: &Reg| matches!(block.inst(*arg).op(), Op::Const | Op::IConst | Op::MConst | Op::Read);
        if let Some(&arg) = inst.args().first().filter(|_| inst.args().iter().all(literal)) {
            let (name, ty) = (format!("k{}_{letter}{}", reg.0, arg.0), block.inst(arg).op().result());
            let ty = match ty {
                Ty::F32 => "float",
                Ty::I32 => "uint32_t",
                Ty::Mask => "int",
            };
            self.line(depth, &format!("const {ty} {name} = {};", self.names[arg.index()]));
            self.names[arg.index()] = name;
        }
        let args: Vec<&str> = inst.args().iter().map(|arg| self.names[arg.index()].as_str()).collect();
        if inst.op().function().is_some() {
            return format!("{prefix}_{}({})", inst.op().name(), args.join(", "));
        }
        let mut w = Writer::new(prefix);
        let values: Vec<Value<Writer<'_>>> = args
            .iter()
            .zip(inst.op().operands())
            .map(|(name, ty)| {
                let id = w.text(*name);
                match ty {
                    Ty::F32 => Value::F32(id),
                    Ty::I32 => Value::I32(id),
                    Ty::Mask => Value::Mask(id),
                }
            })
            .collect();
        match inst.op().apply(&mut w, &values, inst.imm()) {
            Some(Value::F32(id) | Value::I32(id) | Value::Mask(id)) => w.expression(id),
            None => unreachable!("leaves are written by the caller"),
        }
    }
}
