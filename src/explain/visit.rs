//! Walking the values, statements and counted places of a listing.

use vsonar_ir::Operand;

use super::listing::{Arm, Cond, Expr, Site, Stmt, Sweep};

/// Whoever walks a listing's statements in the order of the text, to number or to count.
pub(super) trait Visitor {
    /// A place that is counted.
    fn site(&mut self, _site: &mut Site) {}
    /// A value, after those that it is computed from.
    fn expr(&mut self, _expr: &mut Expr) {}
}

pub(super) fn visit_block(block: &mut [Stmt], v: &mut impl Visitor) {
    for stmt in block {
        match stmt {
            Stmt::Let(_, expr) => visit_expr(expr, v),
            Stmt::LetCond(_, cond) => visit_cond(cond, v),
            Stmt::Assign(site, _, expr) => {
                v.site(site);
                visit_expr(expr, v);
            }
            Stmt::Stop(site) => v.site(site),
            Stmt::If(arms, or_else) => {
                for Arm { site, cond, then } in arms {
                    v.site(site);
                    visit_cond(cond, v);
                    visit_block(then, v);
                }
                visit_block(or_else, v);
            }
        }
    }
}

pub(super) fn visit_expr(expr: &mut Expr, v: &mut impl Visitor) {
    match expr {
        Expr::Binary(_, a, b) => {
            visit_expr(a, v);
            visit_expr(b, v);
        }
        Expr::Power(a, _) => visit_expr(a, v),
        Expr::Call(_, args) => args.iter_mut().for_each(|a| visit_expr(a, v)),
        Expr::If(site, cond, a, b) => {
            v.site(site);
            visit_cond(cond, v);
            visit_expr(a, v);
            visit_expr(b, v);
        }
        _ => {}
    }
    v.expr(expr);
}

pub(super) fn visit_cond(cond: &mut Cond, v: &mut impl Visitor) {
    match cond {
        Cond::Compare(_, a, b) => {
            visit_expr(a, v);
            visit_expr(b, v);
        }
        Cond::Not(a) => visit_cond(a, v),
        Cond::And(a, b) | Cond::Or(a, b) => {
            visit_cond(a, v);
            visit_cond(b, v);
        }
        Cond::First(_) | Cond::Name(_) => {}
    }
}

/// Calls a function with every statement, in the order of the text.
pub(super) fn each<'a>(block: &'a [Stmt], f: &mut impl FnMut(&'a Stmt)) {
    for stmt in block {
        f(stmt);
        if let Stmt::If(arms, or_else) = stmt {
            arms.iter().for_each(|arm| each(&arm.then, f));
            each(or_else, f);
        }
    }
}

impl Sweep {
    /// Numbers the places that are counted in the order of the text; how many there are.
    pub(super) fn number_sites(&mut self) -> Site {
        struct Number(Site);
        impl Visitor for Number {
            fn site(&mut self, site: &mut Site) {
                *site = self.0;
                self.0 += 1;
            }
        }
        let mut number = Number(0);
        self.visit(&mut number);
        number.0
    }

    /// Walks everything in the order of the text.
    pub(super) fn visit(&mut self, v: &mut impl Visitor) {
        visit_block(&mut self.before, v);
        visit_expr(&mut self.column, v);
        visit_block(&mut self.body, v);
    }
}

impl Sweep {
    /// The numbers of the choices, in the order of the text.
    pub fn choice_sites(&self) -> Vec<Site> {
        struct Values(Vec<Site>);
        impl Visitor for Values {
            fn expr(&mut self, expr: &mut Expr) {
                if let Expr::If(site, ..) = expr {
                    self.0.push(*site);
                }
            }
        }
        let mut values = Values(Vec::new());
        self.clone().visit(&mut values);
        let mut out = values.0;
        each(&self.body, &mut |stmt| {
            if let Stmt::If(arms, _) = stmt {
                out.extend(arms.iter().map(|arm| arm.site));
            }
        });
        out.sort_unstable();
        out
    }

    /// The numbers of the `stop`s, in the order of the text.
    pub fn stop_sites(&self) -> Vec<Site> {
        let mut out = Vec::new();
        each(&self.body, &mut |stmt| {
            if let Stmt::Stop(site) = stmt {
                out.push(*site);
            }
        });
        out
    }

    /// The window averages that are read, each once, in the order of their numbers.
    pub fn operands(&self) -> Vec<Operand> {
        struct Used([bool; Operand::COUNT]);
        impl Visitor for Used {
            fn expr(&mut self, expr: &mut Expr) {
                if let Expr::Window(operand) = expr {
                    self.0[usize::from(operand.index())] = true;
                }
            }
        }
        let mut used = Used([false; Operand::COUNT]);
        self.clone().visit(&mut used);
        Operand::all().filter(|o| used.0[usize::from(o.index())]).collect()
    }

    /// Which registers are stored, and which are read, by number.
    pub fn registers(&self) -> [[bool; 5]; 2] {
        struct Read([bool; 5]);
        impl Visitor for Read {
            fn expr(&mut self, expr: &mut Expr) {
                if let Expr::Register(k) = expr {
                    self.0[usize::from(*k)] = true;
                }
            }
        }
        let mut written = [false; 5];
        each(&self.body, &mut |stmt| {
            if let Stmt::Assign(_, k, _) = stmt {
                written[usize::from(*k)] = true;
            }
        });
        let mut read = Read([false; 5]);
        self.clone().visit(&mut read);
        [written, read.0]
    }
}
