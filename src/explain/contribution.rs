//! What each part of a listing contributes: the fitness without it.

use std::collections::BTreeMap;

use rayon::prelude::*;
use serde::Serialize;
use vsonar_ir::op::REGISTER_NAMES;
use vsonar_ir::{Operand, WindowAt, Windows};

use super::evaluate::{Observer, Position};
use super::listing::{Arm, Expr, Listing, Site, Stmt, Sweep};
use super::visit::Visitor;
use crate::dataset::Dataset;
use crate::evolve::is_correct;
use crate::tree::Shortest;
use crate::vision::CaseSet;

/// At most so many parts are tried, whole trees and operators before statements, and these in the order of the text.
const PARTS: usize = 400;
/// What may be run for all parts together, in lines of the listing at a position in a case: about half a minute of one
/// core.
const WORK: u64 = 1_000_000_000;
/// So many parts are tried whatever they take.
const LEAST: u64 = 8;

/// A part and the fitness without it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Contribution {
    /// The line of the listing, counted from 1; of what stands on several lines, the first.
    pub line: usize,
    /// The part.
    pub part: String,
    /// What is in its place.
    pub without: String,
    /// Correct answers without it.
    pub correct: usize,
    /// Their share.
    pub fitness: f64,
    /// How much of the fitness is lost; negative if it is better without.
    pub loss: f64,
}

/// A change of a sweep.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Edit {
    /// This branch of a choice is always taken.
    Choose(Site, bool),
    /// An assignment or a `stop` is left out.
    Drop(Site),
    /// A window average is the same number everywhere.
    Operand(Operand, f32),
    /// A register is read as 0.
    Forget(u8),
    /// The first tree's registers are read as 0.
    NoFirst,
}

/// The contributions of parts, and of how many parts they are.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Contributions {
    /// The fitness without each part, the greatest loss first (equal ones in the order of the text).
    pub tried: Vec<Contribution>,
    /// Parts that were left out, for there are too many to try them all.
    pub left_out: usize,
}

/// The fitness without each part, on all cases of a set; an answer is correct within `tolerance` rows.
pub fn contributions(listing: &Listing, set: &Dataset, tolerance: f64) -> Contributions {
    let cases = set.case_set();
    let labels: Vec<f64> = set.cases().iter().map(|case| f64::from(case.y)).collect();
    let means = means(listing, &cases);
    let mut parts = parts(listing, &means);
    let there = parts.len();
    let positions = u64::from(set.height()) * labels.len() as u64;
    let one = positions.max(1) * listing.lines().len() as u64;
    parts.truncate((WORK / one).clamp(LEAST, PARTS as u64) as usize);
    let whole = solved(listing, &cases, &labels, tolerance);
    let total = labels.len().max(1) as f64;
    let of = |part: &Part| {
        let edited = part.apply(listing);
        let correct = solved(&edited, &cases, &labels, tolerance);
        let (fitness, loss) = (correct as f64 / total, (whole as f64 - correct as f64) / total);
        let (part, without) = (part.part.clone(), part.without.clone());
        Contribution { line: 0, part, without, correct, fitness, loss }
    };
    let mut out: Vec<Contribution> =
        parts.par_iter().map(|part| Contribution { line: part.line, ..of(part) }).collect();
    out.sort_by(|a, b| b.loss.total_cmp(&a.loss).then(a.line.cmp(&b.line)));
    Contributions { left_out: there - out.len(), tried: out }
}

fn solved(listing: &Listing, cases: &CaseSet, labels: &[f64], tolerance: f64) -> usize {
    let lanes = cases.lanes().iter().zip(labels).enumerate();
    lanes
        .filter(|(i, (lane, label))| {
            is_correct(listing.answer(cases.image(*i), lane.column as f32), **label, tolerance)
        })
        .count()
}

/// The mean of each window average over all positions that a sweep visits in all cases, by sweep and operand.
fn means(listing: &Listing, cases: &CaseSet) -> BTreeMap<(usize, Operand), f32> {
    struct Sums<'a, W> {
        windows: &'a W,
        sweeps: &'a [(&'a Sweep, Vec<Operand>)],
        sums: &'a mut BTreeMap<(usize, Operand), (f64, u64)>,
    }
    impl<W: Windows> Observer for Sums<'_, W> {
        fn position(&mut self, number: usize, at: &Position) {
            let (sweep, operands) = &self.sweeps[number];
            for &operand in operands {
                let value = self.windows.average(WindowAt { operand, rect: sweep.rect, x: at.x, y: at.y });
                let sum = self.sums.entry((number, operand)).or_default();
                sum.0 += f64::from(value);
                sum.1 += 1;
            }
        }
    }
    let sweeps: Vec<(&Sweep, Vec<Operand>)> =
        listing.sweeps().map(|sweep| (sweep, sweep.operands())).collect();
    let mut sums = BTreeMap::new();
    for (i, lane) in cases.lanes().iter().enumerate() {
        let windows = cases.image(i);
        let mut observer = Sums { windows, sweeps: &sweeps, sums: &mut sums };
        listing.run(windows, lane.column as f32, &mut observer);
    }
    sums.into_iter().map(|(key, (sum, n))| (key, (sum / n as f64) as f32)).collect()
}

/// A change, and how people call it.
struct Part {
    sweep: usize,
    edit: Edit,
    line: usize,
    part: String,
    without: String,
}

impl Part {
    fn apply(&self, listing: &Listing) -> Listing {
        let mut edited = listing.clone();
        if let Some(sweep) = edited.sweeps_mut().nth(self.sweep) {
            sweep.body = self.edit.block(std::mem::take(&mut sweep.body));
            sweep.visit(&mut Values(self.edit));
        }
        edited
    }
}

impl Edit {
    fn block(self, block: Vec<Stmt>) -> Vec<Stmt> {
        let mut out = Vec::with_capacity(block.len());
        for stmt in block {
            match stmt {
                Stmt::If(arms, or_else) => out.extend(self.choice(arms, or_else)),
                Stmt::Assign(site, ..) | Stmt::Stop(site) if self == Edit::Drop(site) => {}
                stmt => out.push(stmt),
            }
        }
        out
    }

    fn choice(self, mut arms: Vec<Arm>, or_else: Vec<Stmt>) -> Vec<Stmt> {
        let mut or_else = self.block(or_else);
        if let Edit::Choose(of, held) = self
            && let Some(i) = arms.iter().position(|arm| arm.site == of)
        {
            if held {
                // What comes after it is never come to.
                or_else = arms.drain(i..).next().map(|arm| arm.then).unwrap_or_default();
            } else {
                arms.remove(i);
            }
        }
        if arms.is_empty() {
            return or_else;
        }
        arms.iter_mut().for_each(|arm| arm.then = self.block(std::mem::take(&mut arm.then)));
        vec![Stmt::If(arms, or_else)]
    }
}

/// Changes values.
struct Values(Edit);

impl Visitor for Values {
    fn expr(&mut self, expr: &mut Expr) {
        let with = match (&mut *expr, self.0) {
            (Expr::If(site, _, a, b), Edit::Choose(of, held)) if *site == of => {
                std::mem::replace(if held { &mut **a } else { &mut **b }, Expr::X)
            }
            (Expr::Window(operand), Edit::Operand(of, mean)) if *operand == of => Expr::Const(mean),
            (Expr::Register(k), Edit::Forget(of)) if *k == of => Expr::Const(0.0),
            (Expr::Iter2(_), Edit::NoFirst) => Expr::Const(0.0),
            _ => return,
        };
        *expr = with;
    }
}

/// Everything that is tried.
fn parts(listing: &Listing, means: &BTreeMap<(usize, Operand), f32>) -> Vec<Part> {
    let lines = listing.lines();
    let mut out = Vec::new();
    let count = listing.sweeps().count();
    for (number, sweep) in listing.sweeps().enumerate() {
        let tree = if count == 1 { "" } else { [" in the first tree", " in the second tree"][number] };
        let of_tree = |i: &usize| lines[*i].sweep == Some(number);
        let header = (0..lines.len()).find(|i| of_tree(i) && lines[*i].text.contains(" tree: a"));
        let header = header.map_or(0, |i| i + 1);
        let mut add = |edit, line, part: String, without: String| {
            out.push(Part { sweep: number, edit, line, part, without });
        };
        for operand in sweep.operands() {
            let Some(&mean) = means.get(&(number, operand)) else { continue };
            let without = format!("is {} everywhere, its mean", Shortest(mean));
            add(Edit::Operand(operand, mean), header, format!("{}{tree}", operand.name()), without);
        }
        let [_, read] = sweep.registers();
        for (k, _) in read.iter().enumerate().filter(|(_, read)| **read) {
            let part = format!("memory of {}{tree}", REGISTER_NAMES[k]);
            add(Edit::Forget(k as u8), header, part, "read as 0".to_string());
        }
        let (conditions, stops) = (sweep.conditions(), sweep.stop_sites());
        for line in (0..lines.len()).filter(of_tree) {
            let text = lines[line].text.trim();
            // The statement, without the condition that it stands behind.
            let statement = if text.contains("if ") || text.starts_with("else:") {
                text.split_once(": ").map_or(text, |(_, statement)| statement)
            } else {
                text
            };
            for &site in &lines[line].sites {
                if let Some(cond) = conditions.get(&site) {
                    add(Edit::Choose(site, true), line + 1, cond.clone(), "always holds".to_string());
                    add(Edit::Choose(site, false), line + 1, cond.clone(), "never holds".to_string());
                } else if stops.binary_search(&site).is_ok() {
                    add(Edit::Drop(site), line + 1, statement.to_string(), "does not stop".to_string());
                } else {
                    add(Edit::Drop(site), line + 1, statement.to_string(), "is not stored".to_string());
                }
            }
        }
    }
    if listing.first.is_some() {
        let (part, without) = ("the first tree".to_string(), "its registers read as 0".to_string());
        out.push(Part { sweep: 1, edit: Edit::NoFirst, line: 3, part, without });
    }
    // What few lines tell of all the others first, for not all may be tried.
    out.sort_by_key(|part| match part.edit {
        Edit::NoFirst => 0,
        Edit::Operand(..) | Edit::Forget(_) => 1,
        Edit::Choose(..) | Edit::Drop(_) => 2,
    });
    out
}

#[cfg(test)]
mod tests {
    use image::{GrayImage, Luma};

    use super::*;
    use crate::dataset::{Case, NamedImage};

    #[test]
    fn losses_by_hand() {
        // Bright above row 8: the first tree ends with b = 1, the second stops at row 7.
        let bright = |edge: u32| GrayImage::from_fn(16, 16, |_, y| Luma([if y < edge { 200 } else { 10 }]));
        let images = vec![
            NamedImage { name: "one".into(), pixels: bright(8) },
            NamedImage { name: "two".into(), pixels: bright(0) },
        ];
        let cases = vec![Case { image: 0, x: 4, y: 7 }, Case { image: 1, x: 4, y: 0 }];
        let set = Dataset::new("hand", images, cases).expect("sound");
        let text = "images of 16 x 16 pixels\n\n\
            first tree: a 2 x 2 window stands at the top of column x-obstacle\n    b := 1\n\n\
            second tree: a 2 x 2 window moves up column x-obstacle\n    \
            if raw > 100:\n        a := y · iter2-b\n        stop\n\nanswer: a\n";
        let listing: Listing = text.parse().expect("a listing");
        let Contributions { tried: found, left_out } = contributions(&listing, &set, 1.0);
        assert_eq!(left_out, 0);
        let of = |part: &str, without: &str| {
            let c = found.iter().find(|c| c.part == part && c.without.starts_with(without));
            c.map(|c| (c.line, c.correct, c.loss)).unwrap_or_else(|| panic!("{part}, {without}: {found:?}"))
        };
        // Every sweep of the second tree visits rows 14 to 7 of image one, to 0 of image two.
        assert_eq!(of("raw in the second tree", "is "), (6, 1, 0.5)); // never above 100
        assert_eq!(of("raw > 100", "never"), (7, 1, 0.5)); // 0 and 0
        assert_eq!(of("raw > 100", "always"), (7, 0, 1.0)); // 14 and 14
        assert_eq!(of("a := y · iter2-b", "is not stored"), (8, 1, 0.5)); // 0 and 0
        assert_eq!(of("stop", "does not stop"), (9, 1, 0.5)); // 0, the top row, and 0
        assert_eq!(of("b := 1", "is not stored"), (4, 1, 0.5)); // 0 and 0
        assert_eq!(of("the first tree", "its registers"), (3, 1, 0.5)); // the same
        assert!(found.is_sorted_by(|a, b| a.loss >= b.loss), "{found:?}");
        assert_eq!(found.len(), 7);
    }

    #[test]
    fn of_a_long_chain_not_every_part_is_tried() {
        let mut text =
            String::from("images of 16 x 16 pixels\n\nthe tree: a 2 x 2 window moves up column x-obstacle\n");
        for i in 0..900 {
            let otherwise = if i == 0 { "" } else { "else " };
            text += &format!("    {otherwise}if raw > {}: a := {i}\n", 1000 - i);
        }
        text += "\nanswer: a\n";
        let listing: Listing = text.parse().expect("a listing");
        let image = NamedImage { name: "one".into(), pixels: GrayImage::from_pixel(16, 16, Luma([200])) };
        let set = Dataset::new("dark", vec![image], vec![Case { image: 0, x: 4, y: 0 }]).expect("sound");
        let found = contributions(&listing, &set, 1.0);
        assert_eq!((found.tried.len(), found.left_out), (PARTS, 1 + 2 * 900 + 900 - PARTS));
        assert_eq!(found.tried.iter().filter(|c| c.part == "raw").count(), 1, "operators before statements");
    }
}
