//! Reading a listing back from its text.
//!
//! What a reader is shown is checked as it stands: the text is read by this parser and run by the evaluator beside it,
//! neither of which knows the program it came from.

use std::str::FromStr;

use vsonar_ir::{Direction, Rect};

use super::listing::{Arm, Course, DEEPEST, Listing, Name, Stmt, Sweep};
use super::words::Words;

/// Why a text is no listing.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("line {line}: {what}")]
pub struct ListingError {
    /// The line, counted from 1.
    pub line: usize,
    /// What is wrong with it.
    pub what: String,
}

impl FromStr for Listing {
    type Err = ListingError;

    fn from_str(text: &str) -> Result<Listing, ListingError> {
        let lines = text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty());
        let mut rows = Vec::new();
        for (number, line) in lines {
            let indent = line.len() - line.trim_start_matches(' ').len();
            let fail = |what: &str| ListingError { line: number + 1, what: what.to_string() };
            if indent % 4 != 0 {
                return Err(fail("lines are indented by four spaces a level"));
            }
            if indent / 4 > DEEPEST {
                return Err(fail(&format!("indented by more than {DEEPEST} levels")));
            }
            rows.push(Row { number: number + 1, depth: indent / 4, text: line.trim() });
        }
        Lines { rows: &rows, at: 0 }.listing()
    }
}

#[derive(Debug, Clone, Copy)]
struct Row<'a> {
    number: usize,
    depth: usize,
    text: &'a str,
}

struct Lines<'a> {
    rows: &'a [Row<'a>],
    at: usize,
}

pub(super) type Result1<T> = Result<T, ListingError>;

impl<'a> Lines<'a> {
    fn listing(mut self) -> Result1<Listing> {
        let head = self.next("`images of W x H pixels`")?;
        let sides = head.text.strip_prefix("images of ").and_then(|t| t.strip_suffix(" pixels"));
        let sides = sides.and_then(|t| t.split_once(" x "));
        let sides = sides.and_then(|(w, h)| Some((w.parse().ok()?, h.parse().ok()?)));
        let (width, height) = sides.ok_or_else(|| fault(head.number, "expected `images of W x H pixels`"))?;
        let (mut name, mut sweep) = self.sweep()?;
        let mut first = None;
        if name == "first" {
            first = Some(sweep);
            (name, sweep) = self.sweep()?;
        }
        let end = self.next("`answer: a`")?;
        let wanted = if first.is_some() { "second" } else { "the" };
        if name != wanted || end.text != "answer: a" {
            return Err(fault(end.number, &format!("expected {wanted} tree and `answer: a`")));
        }
        match self.rows.get(self.at) {
            Some(row) => Err(fault(row.number, "nothing follows the answer")),
            None => Ok(Listing { width, height, first, second: sweep }),
        }
    }

    fn next(&mut self, wanted: &str) -> Result1<Row<'a>> {
        let last = self.rows.last().map_or(1, |row| row.number);
        let row = self.rows.get(self.at).copied();
        self.at += 1;
        row.ok_or_else(|| fault(last, &format!("expected {wanted}")))
    }

    fn sweep(&mut self) -> Result1<(&'a str, Sweep)> {
        let mut names = Vec::new();
        let mut scope = Vec::new();
        let mut before = Vec::new();
        while self.rows.get(self.at).is_some_and(|row| row.text.starts_with("let ")) {
            let row = self.next("a value")?;
            before.push(Words::new(row.text, row.number, &mut names, &mut scope)?.whole_statement()?);
        }
        let row = self.next("a tree")?;
        let fail = || fault(row.number, "expected `… tree: a W x H window … column …`");
        let tree = ["a", "an"].iter().find_map(|article| row.text.split_once(&format!(" tree: {article} ")));
        let (tree, rest) = tree.ok_or_else(fail)?;
        let (size, rest) = rest.split_once(" window ").ok_or_else(fail)?;
        let (way, column) = rest.split_once(" column ").ok_or_else(fail)?;
        let course = match way {
            "moves up" => Course::Moves(Direction::Up),
            "moves down" => Course::Moves(Direction::Down),
            "stands at the top of" => Course::Stands(Direction::Up),
            "stands at the bottom of" => Course::Stands(Direction::Down),
            _ => return Err(fail()),
        };
        let rect = Rect::from_name(&size.replace(' ', "")).ok_or_else(fail)?;
        let column = Words::new(column, row.number, &mut names, &mut scope)?.whole_expr()?;
        scope.clear();
        let body = self.block(1, &mut names, &mut scope)?;
        let mut sweep = Sweep { rect, course, before, column, body, names };
        sweep.number_sites();
        Ok((tree, sweep))
    }

    /// The statements at a depth, and what is below them. Names end with their block.
    fn block(&mut self, depth: usize, names: &mut Vec<String>, scope: &mut Vec<Name>) -> Result1<Vec<Stmt>> {
        let outer = scope.len();
        let mut out = Vec::new();
        while let Some(row) = self.rows.get(self.at).filter(|row| row.depth >= depth) {
            if row.depth > depth {
                return Err(fault(row.number, "indented without need"));
            }
            out.push(self.statement(depth, names, scope)?);
        }
        scope.truncate(outer);
        Ok(out)
    }

    fn statement(&mut self, depth: usize, names: &mut Vec<String>, scope: &mut Vec<Name>) -> Result1<Stmt> {
        let row = self.next("a statement")?;
        let Some(head) = row.text.strip_prefix("if ") else {
            return Words::new(row.text, row.number, names, scope)?.whole_statement();
        };
        let mut arms = vec![self.arm(head, row, depth, names, scope)?];
        loop {
            let next = self.rows.get(self.at).copied().filter(|row| row.depth == depth);
            let Some(row) = next else { return Ok(Stmt::If(arms, Vec::new())) };
            if let Some(head) = row.text.strip_prefix("else if ") {
                self.at += 1;
                arms.push(self.arm(head, row, depth, names, scope)?);
            } else if let Some(rest) = row.text.strip_prefix("else:") {
                self.at += 1;
                return Ok(Stmt::If(arms, self.branch(rest.trim(), row, depth, names, scope)?));
            } else {
                return Ok(Stmt::If(arms, Vec::new()));
            }
        }
    }

    /// A condition, a colon and what is done, after `if` or `else if`.
    fn arm(
        &mut self,
        head: &str,
        row: Row<'_>,
        depth: usize,
        names: &mut Vec<String>,
        scope: &mut Vec<Name>,
    ) -> Result1<Arm> {
        // No colon is in a condition, and `:=` is no end of one.
        let colon = head.find(':').ok_or_else(|| fault(row.number, "`if` wants a colon"))?;
        let cond = Words::new(&head[..colon], row.number, names, scope)?.whole_cond()?;
        let then = self.branch(head[colon + 1..].trim(), row, depth, names, scope)?;
        Ok(Arm { site: 0, cond, then })
    }

    /// What follows a colon: a statement on the same line, or a block.
    fn branch(
        &mut self,
        rest: &str,
        row: Row<'_>,
        depth: usize,
        names: &mut Vec<String>,
        scope: &mut Vec<Name>,
    ) -> Result1<Vec<Stmt>> {
        if rest.is_empty() {
            return self.block(depth + 1, names, scope);
        }
        Ok(vec![Words::new(rest, row.number, names, scope)?.whole_statement()?])
    }
}

pub(super) fn fault(line: usize, what: &str) -> ListingError {
    ListingError { line, what: what.to_string() }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A listing with this body.
    fn with(body: &str) -> String {
        let body: String = body.lines().map(|line| format!("    {line}\n")).collect();
        format!(
            "images of 64 x 48 pixels\n\nthe tree: a 3 x 3 window moves up column x-obstacle\n{body}\nanswer: a\n"
        )
    }

    #[test]
    fn texts_come_back() {
        for body in [
            "a := y",
            "a := x-obstacle − (y − 1) − 2 · (3 + a) / b · -0.5",
            "a := (y + 1)² ÷ (if a < 3 and (b ≰ 2 or c = NaN) then x else if y ≠ 3 then inf else -inf)",
            "let p = median-corner-sq³ + min(atan2(x, y), max(e, 1e-45))\na := p · p",
            "if at the first position:\n    let P = not (a ≮ 1 and b ≥ 2)\n    if P or not P: a := 1\n    else: stop\n\
             else if not at the first position:\n    b := 1\n    c := first-window",
            "if (a + 1) · 2 ≤ 3: stop",
            "if (a ≤ 3 or b ≤ 2) and c ≤ 1: stop",
        ] {
            let text = with(body);
            let listing: Listing = text.parse().unwrap_or_else(|e| panic!("{e}\n{text}"));
            assert_eq!(listing.to_string(), text);
        }
    }

    #[test]
    fn what_is_no_listing() {
        for (body, what) in [
            ("a := ", "line 4: expected a value, found the end of the line"),
            ("a := p", "line 4: expected a value, found `p`"),
            ("a := 1 2", "line 4: expected nothing more, found `2`"),
            ("f := 1", "line 4: expected a statement, found `f`"),
            ("if a: stop", "line 4: expected a comparison, found the end of the line"),
            ("if P: stop", "line 4: expected a condition, found `P`"),
            ("if a < 1 stop", "line 4: `if` wants a colon"),
            ("a := 1\n    b := 1", "line 5: indented without need"),
            (" a := 1", "line 4: lines are indented by four spaces a level"),
            ("if a < 1:\n    let p = 1\n    a := p + p\nb := p", "line 7: expected a value, found `p`"),
        ] {
            let error = with(body).parse::<Listing>().expect_err(body);
            assert_eq!(error.to_string(), what, "{body}");
        }
        for text in ["", "images of 1 pixels", "images of 64 x 48 pixels\n\nanswer: a"] {
            assert!(text.parse::<Listing>().is_err(), "{text}");
        }
        let deep = with(&format!("a := {}1{}", "(".repeat(2000), ")".repeat(2000)));
        assert!(deep.parse::<Listing>().expect_err("too deep").what.contains("less nesting"));
        // What stands side by side is one in the other as well.
        for chain in
            [format!("a := y{}", " + y".repeat(300)), format!("if y < 1{}: stop", " or y < 1".repeat(300))]
        {
            let error = with(&chain).parse::<Listing>().expect_err("too long");
            assert!(error.what.contains("less nesting"), "{error}");
        }
        let nested: String = (0..300).map(|i| format!("{}if y < 1:\n", "    ".repeat(i))).collect();
        let error =
            with(&format!("{nested}{}stop", "    ".repeat(300))).parse::<Listing>().expect_err("too deep");
        assert_eq!(error.to_string(), "line 254: indented by more than 250 levels");
    }
}
