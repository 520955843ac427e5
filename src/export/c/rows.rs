//! The rows of a loop in C: the sums that slide with the window, the body at each position, the registers' next values.

use std::cmp::Ordering;

use vsonar_ir::op::REGISTER_NAMES;
use vsonar_ir::{Direction, Leaf, Reg, Region};

use super::literal;
use super::loops::Body;
use super::windows::Windows;

impl Body<'_, '_> {
    /// Declares the sums over the window.
    fn sums(&mut self) {
        let (text, rect) = (self.text, self.text.live.l.rect());
        if text.windows.operands.is_empty() {
            return;
        }
        self.line(1, &format!("const uint32_t left = centre - {};", rect.left()));
        self.line(1, &format!("{}_sums_{} now;", text.prefix, text.number));
        for &operand in &text.windows.operands {
            self.line(1, &format!("{} {} = 0;", text.windows.ty(operand), Windows::name(operand)));
        }
    }

    /// Adds row `line` of the image to the sums over the window.
    fn add_line(&mut self) {
        let text = self.text;
        self.line(2, &format!("{}_row_{}(image, left, line, &now);", text.prefix, text.number));
        for &operand in &text.windows.operands {
            let name = Windows::name(operand);
            self.line(2, &format!("{name} += now.{name};"));
        }
    }

    pub(super) fn all_rows(&mut self) {
        let text = self.text;
        let (l, height) = (text.live.l, text.size.1);
        let (rect, up) = (l.rect(), l.direction() == Direction::Up);
        let has_sums = !text.windows.operands.is_empty();
        let before = rect.height() - 1;
        self.sums();
        if has_sums {
            // The loop runs over the rows of the image, and the window is full from the h-th on.
            self.line(
                1,
                &format!(
                    "{}_sums_{} past[{before}]; /* the rows before this one */",
                    text.prefix, text.number
                ),
            );
            if before > 1 {
                self.line(1, "uint32_t oldest = 0;");
            } else {
                // A single one is a variable to compilers, and they do not see that it is set before it is used.
                for &operand in &text.windows.operands {
                    self.line(1, &format!("past[0].{} = 0;", Windows::name(operand)));
                }
            }
        }
        let (start, count) = if has_sums { (before, height) } else { (0, rect.positions(height)) };
        self.line(1, "uint32_t i;");
        self.line(1, &format!("for (i = 0; i < {count}; i++) {{"));
        let oldest = if before > 1 { "oldest" } else { "0" };
        if has_sums {
            let line = if up { format!("{} - i", height - 1) } else { "i".into() };
            self.line(2, &format!("const uint32_t line = {line};"));
            self.add_line();
            self.line(2, &format!("if (i >= {before}) {{"));
        }
        let depth = if has_sums { 3 } else { 2 };
        let (lo, hi) = rect.rows(height);
        if text.live.has(Leaf::Y) {
            // Position 0 is that of row `hi` on the way up, of row `lo` on the way down.
            let y = match (up, start.cmp(&lo)) {
                (true, _) => format!("{} - i", hi + start),
                (false, Ordering::Greater) => format!("i - {}", start - lo),
                (false, Ordering::Equal) => "i".into(),
                (false, Ordering::Less) => format!("i + {}", lo - start),
            };
            self.line(depth, &format!("const float y = (float)(int32_t)({y});"));
        }
        if text.live.has(Leaf::FirstWindow) {
            self.line(depth, &format!("const float first_window = i == {start} ? 1.0f : (-1.0f);"));
        }
        self.row(depth);
        if let Some(stop) = text.live.break_if() {
            let stop = self.names[stop.index()].clone();
            self.line(depth, &format!("if ({stop})"));
            self.line(depth + 1, "break;");
        }
        if has_sums {
            for &operand in &text.windows.operands {
                let name = Windows::name(operand);
                self.line(3, &format!("{name} -= past[{oldest}].{name};"));
            }
            self.line(2, "}");
            for &operand in &text.windows.operands {
                let name = Windows::name(operand);
                self.line(2, &format!("past[{oldest}].{name} = now.{name};"));
            }
            if before > 1 {
                self.line(2, &format!("oldest = oldest < {} ? oldest + 1 : 0;", before - 1));
            }
        }
        self.line(1, "}");
    }

    pub(super) fn last_row(&mut self) {
        let text = self.text;
        let (l, height) = (text.live.l, text.size.1);
        self.sums();
        let y = l.rows(height).next().unwrap_or_default();
        if !text.windows.operands.is_empty() {
            let top = y - l.rect().top();
            self.line(1, "uint32_t line;");
            self.line(1, &format!("for (line = {top}; line < {}; line++) {{", top + l.rect().height()));
            self.add_line();
            self.line(1, "}");
        }
        if text.live.has(Leaf::Y) {
            self.line(1, &format!("const float y = {y}.0f;"));
        }
        if text.live.has(Leaf::FirstWindow) {
            let value = literal::float(text.prefix, l.first_window_at_start(height));
            self.line(1, &format!("const float first_window = {value};"));
        }
        self.row(1);
    }

    /// The row's instructions, then the registers' next values.
    fn row(&mut self, depth: usize) {
        let live = self.text.live;
        self.region(Region::Uniform, depth);
        self.region(Region::Varying, depth);
        let next: Vec<(usize, Reg)> =
            (0..5).filter(|&k| live.kept[k]).filter_map(|k| Some((k, live.l.next()[k]?))).collect();
        // All take their values at once, so one that takes another's is served first.
        let mut values = Vec::new();
        for &(k, reg) in &next {
            let mut value = self.names[reg.index()].clone();
            let is_read = matches!(live.l.body().inst(reg).leaf(), Some(Leaf::Read(_)));
            if is_read && REGISTER_NAMES.contains(&value.as_str()) && value != REGISTER_NAMES[k] {
                let name = format!("next_{}", REGISTER_NAMES[k]);
                self.line(depth, &format!("const float {name} = {value};"));
                value = name;
            }
            values.push(value);
        }
        for (&(k, _), value) in next.iter().zip(&values) {
            if value != REGISTER_NAMES[k] {
                self.line(depth, &format!("{} = {value};", REGISTER_NAMES[k]));
            }
        }
    }
}
