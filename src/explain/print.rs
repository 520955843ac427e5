//! A listing as text, line by line.

use std::collections::BTreeMap;
use std::fmt::{self, Display, Write as _};

use vsonar_ir::Direction;
use vsonar_ir::op::REGISTER_NAMES;

use super::listing::{Arm, Cond, Course, Expr, Listing, Name, Site, Stmt, Sweep};
use super::visit::{Visitor, each};
use crate::tree::Shortest;

/// A branch of one statement stands on the line of its `if` where that line is no longer than this.
const WIDTH: usize = 80;

/// A line of a listing.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Line {
    /// The text, indented.
    pub text: String,
    /// Which sweep it is of, 0 or 1 counted among those that are there; none for the frame around them.
    pub sweep: Option<usize>,
    /// The places of it that are counted, in the order of the text.
    pub sites: Vec<Site>,
}

impl Display for Listing {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.lines().iter().try_for_each(|line| writeln!(f, "{}", line.text))
    }
}

impl Listing {
    /// The text, line by line. Read back it is the same listing.
    pub fn lines(&self) -> Vec<Line> {
        let frame = |text: String| Line { text, sweep: None, sites: Vec::new() };
        let mut lines = vec![frame(format!("images of {} x {} pixels", self.width, self.height))];
        for (number, sweep) in self.sweeps().enumerate() {
            lines.push(frame(String::new()));
            let tree = match (number, &self.first) {
                (_, None) => "the",
                (0, _) => "first",
                _ => "second",
            };
            Printer { sweep, number, lines: &mut lines }.sweep(tree);
        }
        lines.push(frame(String::new()));
        lines.push(frame("answer: a".to_string()));
        lines
    }
}

impl Sweep {
    /// The conditions of all choices, as they are printed, by the choice's number; of one that has a name also what is
    /// named.
    pub(super) fn conditions(&self) -> BTreeMap<Site, String> {
        struct InValues(Vec<(Site, Cond)>);
        impl Visitor for InValues {
            fn expr(&mut self, expr: &mut Expr) {
                if let Expr::If(site, cond, ..) = expr {
                    self.0.push((*site, (**cond).clone()));
                }
            }
        }
        let mut values = InValues(Vec::new());
        self.clone().visit(&mut values);
        let mut choices: Vec<(Site, &Cond)> = values.0.iter().map(|(site, cond)| (*site, cond)).collect();
        let mut named: BTreeMap<Name, &Cond> = BTreeMap::new();
        each(&self.body, &mut |stmt| match stmt {
            Stmt::If(arms, _) => choices.extend(arms.iter().map(|arm| (arm.site, &arm.cond))),
            Stmt::LetCond(name, cond) => drop(named.insert(*name, cond)),
            _ => {}
        });
        let printer = Printer { sweep: self, number: 0, lines: &mut Vec::new() };
        let text = |cond: &Cond| {
            let mut text = String::new();
            printer.cond(cond, 0, &mut text, &mut Vec::new());
            if let Cond::Name(name) = cond
                && let Some(named) = named.get(name)
            {
                text.push_str(": ");
                printer.cond(named, 0, &mut text, &mut Vec::new());
            }
            text
        };
        choices.into_iter().map(|(site, cond)| (site, text(cond))).collect()
    }
}

struct Printer<'a> {
    sweep: &'a Sweep,
    number: usize,
    lines: &'a mut Vec<Line>,
}

impl Printer<'_> {
    fn sweep(&mut self, tree: &str) {
        self.block(&self.sweep.before, 0);
        let mut text = String::new();
        let mut sites = Vec::new();
        let (w, h) = (self.sweep.rect.width(), self.sweep.rect.height());
        let way = match self.sweep.course {
            Course::Moves(Direction::Up) => "moves up",
            Course::Moves(Direction::Down) => "moves down",
            Course::Stands(Direction::Up) => "stands at the top of",
            Course::Stands(Direction::Down) => "stands at the bottom of",
        };
        let article = if w == 8 { "an" } else { "a" };
        let _ = write!(text, "{tree} tree: {article} {w} x {h} window {way} column ");
        self.expr(&self.sweep.column, 0, &mut text, &mut sites);
        self.push(0, &text, sites);
        self.block(&self.sweep.body, 1);
    }

    fn push(&mut self, depth: usize, text: &str, sites: Vec<Site>) {
        let text = format!("{:1$}{text}", "", 4 * depth);
        self.lines.push(Line { text, sweep: Some(self.number), sites });
    }

    fn block(&mut self, block: &[Stmt], depth: usize) {
        for stmt in block {
            match stmt {
                Stmt::If(arms, or_else) => self.choice(arms, or_else, depth),
                _ => {
                    let (mut text, mut sites) = (String::new(), Vec::new());
                    self.simple(stmt, &mut text, &mut sites);
                    self.push(depth, &text, sites);
                }
            }
        }
    }

    /// A statement that takes one line.
    fn simple(&self, stmt: &Stmt, text: &mut String, sites: &mut Vec<Site>) {
        let name = |name: &u32| &self.sweep.names[*name as usize];
        match stmt {
            Stmt::Let(n, expr) => {
                let _ = write!(text, "let {} = ", name(n));
                self.expr(expr, 0, text, sites);
            }
            Stmt::LetCond(n, cond) => {
                let _ = write!(text, "let {} = ", name(n));
                self.cond(cond, 0, text, sites);
            }
            Stmt::Assign(site, register, expr) => {
                sites.push(*site);
                let _ = write!(text, "{} := ", REGISTER_NAMES[usize::from(*register)]);
                self.expr(expr, 0, text, sites);
            }
            Stmt::Stop(site) => {
                sites.push(*site);
                text.push_str("stop");
            }
            Stmt::If(..) => unreachable!("a choice takes lines of its own"),
        }
    }

    fn choice(&mut self, arms: &[Arm], or_else: &[Stmt], depth: usize) {
        for (i, Arm { site, cond, then }) in arms.iter().enumerate() {
            let word = if i == 0 { "if " } else { "else if " };
            let (mut text, mut sites) = (word.to_string(), vec![*site]);
            self.cond(cond, 0, &mut text, &mut sites);
            text.push(':');
            let short = match &then[..] {
                [stmt @ (Stmt::Assign(..) | Stmt::Stop(_))] => {
                    let (mut line, mut line_sites) = (format!("{text} "), sites.clone());
                    self.simple(stmt, &mut line, &mut line_sites);
                    (4 * depth + line.chars().count() <= WIDTH).then_some((line, line_sites))
                }
                _ => None,
            };
            match short {
                Some((line, sites)) => self.push(depth, &line, sites),
                None => {
                    self.push(depth, &text, sites);
                    self.block(then, depth + 1);
                }
            }
        }
        match or_else {
            [] => {}
            [stmt @ (Stmt::Assign(..) | Stmt::Stop(_))] => {
                let (mut line, mut sites) = ("else: ".to_string(), Vec::new());
                self.simple(stmt, &mut line, &mut sites);
                self.push(depth, &line, sites);
            }
            _ => {
                self.push(depth, "else:", Vec::new());
                self.block(or_else, depth + 1);
            }
        }
    }

    /// Writes an expression, in parentheses if it binds less tightly than `least`.
    fn expr(&self, expr: &Expr, least: u8, out: &mut String, sites: &mut Vec<Site>) {
        let register = |k: &u8| REGISTER_NAMES[usize::from(*k)];
        let own = match expr {
            Expr::If(..) => 0,
            Expr::Binary(sign, ..) => sign.level(),
            Expr::Power(..) => 3,
            Expr::Const(value) if value.is_sign_negative() => 3,
            _ => 4,
        };
        let open = own < least;
        if open {
            out.push('(');
        }
        match expr {
            Expr::Const(value) => _ = write!(out, "{}", Shortest(*value)),
            Expr::XObstacle => out.push_str("x-obstacle"),
            Expr::Iter2(k) => _ = write!(out, "iter2-{}", register(k)),
            Expr::X => out.push('x'),
            Expr::Y => out.push('y'),
            Expr::FirstWindow => out.push_str("first-window"),
            Expr::Register(k) => out.push_str(register(k)),
            Expr::Window(operand) => out.push_str(operand.name()),
            Expr::Name(name) => out.push_str(&self.sweep.names[*name as usize]),
            Expr::Binary(sign, a, b) => {
                self.expr(a, own, out, sites);
                let _ = write!(out, " {} ", sign.text());
                self.expr(b, own + 1, out, sites);
            }
            Expr::Power(base, n) => {
                self.expr(base, 4, out, sites);
                out.push(['²', '³', '⁴', '⁵'][usize::from(*n) - 2]);
            }
            Expr::Call(function, args) => {
                let _ = write!(out, "{}(", function.name());
                for (i, arg) in args.iter().enumerate() {
                    out.push_str(if i > 0 { ", " } else { "" });
                    self.expr(arg, 0, out, sites);
                }
                out.push(')');
            }
            Expr::If(site, cond, a, b) => {
                sites.push(*site);
                out.push_str("if ");
                self.cond(cond, 0, out, sites);
                out.push_str(" then ");
                self.expr(a, 1, out, sites);
                out.push_str(" else ");
                self.expr(b, 0, out, sites);
            }
        }
        if open {
            out.push(')');
        }
    }

    fn cond(&self, cond: &Cond, least: u8, out: &mut String, sites: &mut Vec<Site>) {
        let own = match cond {
            Cond::Or(..) => 0,
            Cond::And(..) => 1,
            _ => 2,
        };
        let open = own < least;
        if open {
            out.push('(');
        }
        match cond {
            Cond::Compare(relation, a, b) => {
                self.expr(a, 1, out, sites);
                let _ = write!(out, " {} ", relation.text());
                self.expr(b, 1, out, sites);
            }
            Cond::First(true) => out.push_str("at the first position"),
            Cond::First(false) => out.push_str("not at the first position"),
            Cond::Name(name) => out.push_str(&self.sweep.names[*name as usize]),
            Cond::Not(p) => {
                out.push_str("not ");
                self.cond(p, 2, out, sites);
            }
            Cond::And(p, q) | Cond::Or(p, q) => {
                self.cond(p, own, out, sites);
                out.push_str(if own == 1 { " and " } else { " or " });
                self.cond(q, own + 1, out, sites);
            }
        }
        if open {
            out.push(')');
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::explain::Explanation;
    use crate::tree::Individual;

    #[test]
    fn the_published_program_reads_as_in_the_paper() {
        let individual: Individual = include_str!("../../examples/fmrb.gp").parse().expect("a program");
        let explanation = Explanation::new(&individual, 320, 240).expect("an explanation");
        let expected = "\
images of 320 x 240 pixels

first tree: a 3 x 3 window moves up column x-obstacle
    let h = moravec-horizontal
    b := ((h + 1) · (if at the first position then 3.40282e38 else b) − (h + 1 + h² + h⁴) · x-obstacle) ÷ h⁵

second tree: a 3 x 3 window moves down column x-obstacle
    if iter2-b > 9: a := y
    else if y ≤ 9: a := y
    if median > 35.4444:
        if gradient > 413.96: a := y
        if gradient > 239 and (gradient / 239)⁴ > moravec-slash: a := y

answer: a
";
        assert_eq!(explanation.listing.to_string(), expected);
    }
}
