//! One case, pixel by pixel: what the window sees at every position, what is stored, which branches are taken.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use serde::Serialize;
use vsonar_ir::op::REGISTER_NAMES;
use vsonar_ir::{Operand, WindowAt, Windows};

use super::evaluate::{Observer, Position};
use super::listing::{Listing, Site, Sweep};
use crate::dataset::Dataset;
use crate::support::printable;
use crate::tree::Shortest;

/// So many positions at either end are always shown.
const ENDS: usize = 5;

/// A case, traced.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Trace {
    /// The image's name.
    pub image: String,
    /// The column asked for.
    pub column: u32,
    /// The row that is right.
    pub label: u32,
    /// The answer, in rows from the top.
    pub answer: f32,
    /// The sweeps that are there, in the order they ran.
    pub sweeps: Vec<SweepTrace>,
}

/// One sweep of it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SweepTrace {
    /// `first` or `second`, or `the` where it is the only one that matters.
    pub tree: &'static str,
    /// The window's width and height in pixels.
    pub window: [u32; 2],
    /// The column of its centre.
    pub x: u32,
    /// The operators that are read, as [`TracePosition::averages`] has them.
    pub operators: Vec<&'static str>,
    /// The registers that are stored, as [`TracePosition::registers`] has them.
    pub registers: Vec<&'static str>,
    /// The lines of the listing that choose, counted from 1, as [`TracePosition::branches`] has them.
    pub lines: Vec<usize>,
    /// What these choices are called: the line's number, and, where a line chooses more than once, a letter; `a` is for
    /// the first in the margin.
    pub choices: Vec<String>,
    /// The positions in the order of the sweep.
    pub positions: Vec<TracePosition>,
}

/// One position of the window.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TracePosition {
    /// The row of its centre.
    pub y: u32,
    /// The averages over it.
    pub averages: Vec<f32>,
    /// The registers as the position left them.
    pub registers: Vec<f32>,
    /// For each line that chooses whether its condition held; none where it was not come to.
    pub branches: Vec<Option<bool>>,
    /// Whether the sweep stopped here.
    pub stopped: bool,
}

/// What of a sweep is written down.
struct Watched<'a> {
    sweep: &'a Sweep,
    operands: Vec<Operand>,
    registers: Vec<u8>,
    choices: Vec<Site>,
}

struct Watch<'a, W> {
    windows: &'a W,
    sweeps: Vec<Watched<'a>>,
    traces: Vec<SweepTrace>,
    here: BTreeMap<Site, bool>,
}

impl<W: Windows> Observer for Watch<'_, W> {
    fn site(&mut self, _: usize, site: Site, held: bool) {
        self.here.entry(site).or_insert(held);
    }

    fn position(&mut self, number: usize, at: &Position) {
        let Watched { sweep, operands, registers, choices } = &self.sweeps[number];
        let window = |&operand: &Operand| WindowAt { operand, rect: sweep.rect, x: at.x, y: at.y };
        let position = TracePosition {
            y: at.y,
            averages: operands.iter().map(|operand| self.windows.average(window(operand))).collect(),
            registers: registers.iter().map(|&k| at.registers[usize::from(k)]).collect(),
            branches: choices.iter().map(|site| self.here.get(site).copied()).collect(),
            stopped: at.stopped,
        };
        self.traces[number].x = at.x;
        self.traces[number].positions.push(position);
        self.here.clear();
    }
}

impl Trace {
    /// Traces the case of this number.
    ///
    /// # Panics
    /// If the set has no such case.
    pub fn of(listing: &Listing, set: &Dataset, case: usize) -> Trace {
        let lines = listing.lines();
        let both = listing.first.is_some();
        let mut sweeps = Vec::new();
        let mut traces = Vec::new();
        for (number, sweep) in listing.sweeps().enumerate() {
            let choices = sweep.choice_sites();
            let line_of = |site: &Site| {
                let on = |l: &super::print::Line| l.sweep == Some(number) && l.sites.contains(site);
                lines.iter().position(on).map_or(0, |i| i + 1)
            };
            let called = |site: &Site| {
                let line = line_of(site);
                let all = line.checked_sub(1).map_or(&[][..], |i| &lines[i].sites);
                let all: Vec<&Site> = all.iter().filter(|site| choices.contains(site)).collect();
                match all.iter().position(|there| *there == site) {
                    Some(i) if all.len() > 1 => format!("{line}{}", char::from(b'a' + i.min(25) as u8)),
                    _ => line.to_string(),
                }
            };
            let stored: Vec<u8> = (0..5).filter(|&k| sweep.registers()[0][usize::from(k)]).collect();
            let operands = sweep.operands();
            traces.push(SweepTrace {
                tree: if !both { "the" } else { ["first", "second"][number] },
                window: [sweep.rect.width(), sweep.rect.height()],
                x: 0,
                operators: operands.iter().map(|o| o.name()).collect(),
                registers: stored.iter().map(|&k| REGISTER_NAMES[usize::from(k)]).collect(),
                lines: choices.iter().map(line_of).collect(),
                choices: choices.iter().map(called).collect(),
                positions: Vec::new(),
            });
            sweeps.push(Watched { sweep, operands, registers: stored, choices });
        }
        let cases = set.case_set();
        let of = set.cases()[case];
        let windows = cases.image(case);
        let mut watch = Watch { windows, sweeps, traces, here: BTreeMap::new() };
        let outcome = listing.run(windows, of.x as f32, &mut watch);
        Trace {
            image: set.images()[of.image].name.clone(),
            column: of.x,
            label: of.y,
            answer: outcome.answer(),
            sweeps: watch.traces,
        }
    }

    /// The trace as tables. Unless it is to be `full`, positions at which the same branches are taken as at the one before
    /// are left out, but for those at the ends.
    pub fn text(&self, full: bool) -> String {
        let mut out = format!(
            "{}, column {}: answer {}, label {}\n",
            printable::line(&self.image),
            self.column,
            Shortest(self.answer),
            self.label
        );
        for sweep in &self.sweeps {
            let [w, h] = sweep.window;
            let _ = writeln!(out, "\n{} tree, {w} x {h} window in column {}", sweep.tree, sweep.x);
            sweep.table(full, &mut out);
        }
        out
    }
}

impl SweepTrace {
    fn table(&self, full: bool, out: &mut String) {
        let mut rows = vec![self.heading()];
        let mut left_out = 0;
        let n = self.positions.len();
        for (i, at) in self.positions.iter().enumerate() {
            let alike = i > 0 && self.positions[i - 1].branches == at.branches;
            let inside = i >= ENDS && i + ENDS < n && !at.stopped;
            if !full && alike && inside && !self.lines.is_empty() || !full && inside && self.lines.is_empty()
            {
                left_out += 1;
                continue;
            }
            if left_out > 0 {
                rows.push(vec![format!("… {left_out} alike")]);
                left_out = 0;
            }
            rows.push(self.row(at));
        }
        let cell = |row: &Vec<String>, i: usize| row.get(i).cloned().unwrap_or_default();
        let width = |i: usize| {
            let whole = rows.iter().filter(|row| row.len() > 1);
            whole.map(|row| cell(row, i).chars().count()).max().unwrap_or(0)
        };
        let widths: Vec<usize> = (0..rows[0].len()).map(width).collect();
        for row in &rows {
            let mut line = String::from(" ");
            for (i, text) in row.iter().enumerate() {
                let width = widths[i];
                let words = i + 1 == widths.len() && self.has_branches();
                let _ = if words || row.len() == 1 {
                    write!(line, " {text}")
                } else {
                    write!(line, " {text:>width$} ")
                };
            }
            let _ = writeln!(out, "{}", line.trim_end());
        }
    }

    /// Whether there is anything to say of branches.
    fn has_branches(&self) -> bool {
        !self.choices.is_empty() || self.positions.iter().any(|at| at.stopped)
    }

    fn heading(&self) -> Vec<String> {
        let names = self.operators.iter().chain(&self.registers).map(|name| name.to_string());
        let branches = self.has_branches().then(|| "branches (line, held)".to_string());
        std::iter::once("y".to_string()).chain(names).chain(branches).collect()
    }

    fn row(&self, at: &TracePosition) -> Vec<String> {
        let mut row = vec![at.y.to_string()];
        row.extend(at.averages.iter().chain(&at.registers).map(|&value| short(value)));
        if !self.has_branches() {
            return row;
        }
        let mut taken: Vec<String> = self
            .choices
            .iter()
            .zip(&at.branches)
            .filter_map(|(line, held)| held.map(|held| format!("{line} {}", if held { "yes" } else { "no" })))
            .collect();
        if at.stopped {
            taken.push("stop".to_string());
        }
        row.push(taken.join(", "));
        row
    }
}

/// A value in few digits: four of them, or all of a whole number.
pub(super) fn short(value: f32) -> String {
    if !value.is_finite() || value == value.trunc() && value.abs() < 1e6 {
        return Shortest(value).to_string();
    }
    match value.abs() {
        m if !(1e-3..1e6).contains(&m) => format!("{value:.2e}"),
        m if m >= 100.0 => format!("{value:.1}"),
        m if m >= 1.0 => format!("{value:.2}"),
        _ => format!("{value:.4}"),
    }
}
