//! A loop's window operands in C: the sums over one row of the image between the window's sides, from which the loop
//! keeps the sums over the window.

use std::fmt::Write;

use vsonar_ir::{Moment, Operand, Operator, Rect};

use super::operators::{self, Function, PIXELS, identifier};

/// The window operands of one loop.
#[derive(Debug)]
pub(super) struct Windows<'a> {
    /// Prefix of the C names.
    pub(super) prefix: &'a str,
    /// Number of the loop, 1 or 2.
    pub(super) number: u32,
    /// Size of the window.
    pub(super) rect: Rect,
    /// Size of the image.
    pub(super) size: (u32, u32),
    /// The operands, in the order of their numbers.
    pub(super) operands: Vec<Operand>,
}

/// Whether the sum of an operand over a window can leave a signed 32-bit integer, from which every processor or its
/// library converts to binary32 with the right rounding.
fn is_wide(operand: Operand, rect: Rect) -> bool {
    operand.max() * u64::from(rect.area()) > i32::MAX as u64
}

impl Windows<'_> {
    /// The C type of an operand's sums.
    pub(super) fn ty(&self, operand: Operand) -> &'static str {
        if is_wide(operand, self.rect) { "uint64_t" } else { "uint32_t" }
    }

    /// An operand's sum in C names.
    pub(super) fn name(operand: Operand) -> String {
        identifier(operand.name())
    }

    /// The average as a C expression, from the variable that holds the sum over the window.
    pub(super) fn average(&self, operand: Operand) -> String {
        let (prefix, name, area) = (self.prefix, Self::name(operand), self.rect.area());
        if is_wide(operand, self.rect) {
            format!("{prefix}_wide({name}) / {area}.0f")
        } else {
            format!("(float)(int32_t){name} / {area}.0f")
        }
    }

    /// The type of the sums over a row and the function that computes them.
    pub(super) fn definitions(&self) -> String {
        let Windows { prefix, number, .. } = self;
        let mut out = format!("/* Loop {number}: sums over one row of the window. */\ntypedef struct {{\n");
        for &operand in &self.operands {
            let _ = writeln!(out, "    {} {};", self.ty(operand), Self::name(operand));
        }
        let _ = writeln!(out, "}} {prefix}_sums_{number};\n");
        out + &self.row_function()
    }

    /// Which pixels of a neighbourhood are read: in each of its rows from one column, 0 to 2, to another.
    fn spans(&self, functions: &[Function]) -> [Option<(usize, usize)>; 3] {
        let mut read = [false; 9];
        read[4] = self.operands.iter().any(|o| o.operator == Operator::Raw);
        for function in functions {
            for (read, taken) in read.iter_mut().zip(function.pixels()) {
                *read |= taken;
            }
        }
        std::array::from_fn(|row| {
            let columns: Vec<usize> = (0..3).filter(|column| read[3 * row + column]).collect();
            Some((*columns.first()?, (*columns.last()?).max(1)))
        })
    }

    fn row_function(&self) -> String {
        let Windows { prefix, number, rect, size: (width, height), operands } = self;
        let (last_x, last_y) = (width - 1, height - 1);
        let functions = operators::functions(operands);
        let spans = self.spans(&functions);
        let rows = [("above", "(y > 0 ? y - 1 : 0)"), ("row", "y"), ("below", "")];
        let mut out = format!(
            "/* Loop {number}: the sums over row y between the window's sides, of which the left one is given. Border\n   \
             pixels stand in for those outside the image. */\nstatic void {prefix}_row_{number}(const {prefix}_image \
             *image, uint32_t left, uint32_t y, {prefix}_sums_{number} *sums)\n{{\n    const size_t step = \
             image->pixel_stride;\n"
        );
        for ((name, y), _) in rows.iter().zip(&spans).filter(|(_, span)| span.is_some()) {
            let y = if y.is_empty() { format!("(y < {last_y} ? y + 1 : {last_y})") } else { (*y).into() };
            let _ =
                writeln!(out, "    const uint8_t *{name} = image->luma + (size_t){y} * image->row_stride;");
        }
        let _ = writeln!(out, "    size_t at = (size_t)left * step;");
        let starts = |column| spans.iter().flatten().any(|(first, _)| *first == column);
        if starts(0) {
            let _ = writeln!(out, "    const size_t before = left > 0 ? at - step : 0;");
        }
        // Pixels that the neighbourhood of the next pixel shares; the newest of each row is read in the loop.
        for (row, span) in spans.iter().enumerate() {
            let Some((first, last)) = *span else { continue };
            for column in first..last {
                let place = if column == 0 { "before" } else { "at" };
                let _ = writeln!(out, "    int32_t {} = {}[{place}];", PIXELS[3 * row + column], rows[row].0);
            }
        }
        for &operand in operands {
            let _ = writeln!(out, "    {} {} = 0;", self.ty(operand), sum(operand));
        }
        let right = spans.iter().flatten().any(|(_, last)| *last == 2);
        let _ = writeln!(out, "    uint32_t i;\n    for (i = 0; i < {}; i++) {{", rect.width());
        if right {
            let _ = writeln!(out, "        const size_t next = left + i < {last_x} ? at + step : at;");
        }
        for (row, span) in spans.iter().enumerate() {
            let Some((_, last)) = *span else { continue };
            let place = if last == 2 { "next" } else { "at" };
            let _ =
                writeln!(out, "        const int32_t {} = {}[{place}];", PIXELS[3 * row + last], rows[row].0);
        }
        self.add(&functions, &mut out);
        for (row, span) in spans.iter().enumerate() {
            let Some((first, last)) = *span else { continue };
            for column in first..last {
                let (old, new) = (PIXELS[3 * row + column], PIXELS[3 * row + column + 1]);
                let _ = writeln!(out, "        {old} = {new};");
            }
        }
        let _ = writeln!(out, "        at = {};\n    }}", if right { "next" } else { "at + step" });
        for &operand in operands {
            let _ = writeln!(out, "    sums->{} = {};", Self::name(operand), sum(operand));
        }
        out + "}\n\n"
    }

    /// Computes the operators at a pixel and adds them to the sums.
    fn add(&self, functions: &[Function], out: &mut String) {
        for function in functions {
            if *function == Function::Medians {
                out.push_str("        int32_t median_corner;\n");
            }
        }
        for function in functions {
            let value = value(function.operators()[0]);
            let _ = writeln!(out, "        const int32_t {value} = {};", function.call(self.prefix));
        }
        for &operand in &self.operands {
            let value = value(operand.operator);
            let _ = match operand.moment {
                Moment::Mean => writeln!(out, "        {} += (uint32_t){value};", sum(operand)),
                // A square has at most 32 bits.
                Moment::MeanSquare => {
                    writeln!(out, "        {} += (uint32_t){value} * (uint32_t){value};", sum(operand))
                }
            };
        }
    }
}

/// The variable of a sum over a row.
fn sum(operand: Operand) -> String {
    format!("sum_{}", Windows::name(operand))
}

/// The variable of an operator's value at the pixel.
fn value(operator: Operator) -> String {
    if operator == Operator::Raw { PIXELS[4].into() } else { identifier(operator.name()) }
}

/// The exact conversion of sums of 64 bits.
pub(super) fn wide(prefix: &str) -> String {
    format!(
        "/* A sum below 2^38 as binary32, rounded once: both parts convert exactly, and only adding them rounds. Not every\n   \
         compiler's library converts integers of 64 bits with the right rounding. */\n\
         static float {prefix}_wide(uint64_t sum)\n{{\n    \
         const float high = (float)(int32_t)(sum >> 19) * 524288.0f;\n    \
         const float low = (float)(int32_t)(sum & 0x7ffffu);\n    \
         return high + low;\n}}\n\n"
    )
}
