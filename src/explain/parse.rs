//! Reading a listing back from its text.
//!
//! What a reader is shown is checked as it stands: the text is read by this parser and run by the evaluator beside it,
//! neither of which knows the program it came from.

use std::str::FromStr;

use vsonar_ir::op::REGISTER_NAMES;
use vsonar_ir::{Direction, Operand, Rect};

use super::listing::{Cond, Course, Expr, Function, Listing, Name, Relation, Sign, Stmt, Sweep};

/// Why a text is no listing.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("line {line}: {what}")]
pub struct ListingError {
    /// The line, counted from 1.
    pub line: usize,
    /// What is wrong with it.
    pub what: String,
}

/// Nesting beyond this is refused, here and in the lines' indentation.
const DEEPEST: usize = 1_000;

impl FromStr for Listing {
    type Err = ListingError;

    fn from_str(text: &str) -> Result<Listing, ListingError> {
        let lines = text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty());
        let mut rows = Vec::new();
        for (number, line) in lines {
            let indent = line.len() - line.trim_start_matches(' ').len();
            let fail = |what: &str| ListingError { line: number + 1, what: what.to_string() };
            if indent % 4 != 0 || indent / 4 > DEEPEST {
                return Err(fail("lines are indented by four spaces a level"));
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

type Result1<T> = Result<T, ListingError>;

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
        let (tree, rest) = row.text.split_once(" tree: a ").ok_or_else(fail)?;
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
        let mut words = Words::new(column, row.number, &mut names, &mut scope)?;
        let column = words.expr()?;
        words.end()?;
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
            out.push(self.statement(depth, "if ", names, scope)?);
        }
        scope.truncate(outer);
        Ok(out)
    }

    fn statement(
        &mut self,
        depth: usize,
        word: &str,
        names: &mut Vec<String>,
        scope: &mut Vec<Name>,
    ) -> Result1<Stmt> {
        let row = self.next("a statement")?;
        let Some(head) = row.text.strip_prefix(word) else {
            return Words::new(row.text, row.number, names, scope)?.whole_statement();
        };
        // No colon is in a condition, and `:=` is no end of one.
        let colon = head.find(':').ok_or_else(|| fault(row.number, "`if` wants a colon"))?;
        let mut words = Words::new(&head[..colon], row.number, names, scope)?;
        let cond = words.cond()?;
        words.end()?;
        let then = self.branch(head[colon + 1..].trim(), row, depth, names, scope)?;
        let next = self.rows.get(self.at).copied().filter(|row| row.depth == depth);
        let or_else = match next {
            Some(row) if row.text.starts_with("else if ") => {
                vec![self.statement(depth, "else if ", names, scope)?]
            }
            Some(row) if row.text.starts_with("else:") => {
                self.at += 1;
                self.branch(row.text["else:".len()..].trim(), row, depth, names, scope)?
            }
            _ => Vec::new(),
        };
        Ok(Stmt::If(0, cond, then, or_else))
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

fn fault(line: usize, what: &str) -> ListingError {
    ListingError { line, what: what.to_string() }
}

/// The words and signs of a line.
struct Words<'a> {
    words: Vec<&'a str>,
    at: usize,
    depth: usize,
    line: usize,
    names: &'a mut Vec<String>,
    /// The names that can be seen.
    scope: &'a mut Vec<Name>,
}

impl<'a> Words<'a> {
    fn new(
        text: &'a str,
        line: usize,
        names: &'a mut Vec<String>,
        scope: &'a mut Vec<Name>,
    ) -> Result1<Words<'a>> {
        let mut words = Vec::new();
        let mut rest = text.trim_start();
        while let Some(first) = rest.chars().next() {
            let inside = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '.';
            let len = if inside(first) {
                rest.find(|c| !inside(c)).unwrap_or(rest.len())
            } else if rest.starts_with(":=") {
                2
            } else {
                first.len_utf8()
            };
            words.push(&rest[..len]);
            rest = rest[len..].trim_start();
        }
        Ok(Words { words, at: 0, depth: 0, line, names, scope })
    }

    fn fail<T>(&self, wanted: &str) -> Result1<T> {
        let found = self.peek().map_or("the end of the line".to_string(), |word| format!("`{word}`"));
        Err(fault(self.line, &format!("expected {wanted}, found {found}")))
    }

    fn peek(&self) -> Option<&'a str> {
        self.words.get(self.at).copied()
    }

    fn take(&mut self, word: &str) -> bool {
        let found = self.peek() == Some(word);
        self.at += usize::from(found);
        found
    }

    fn want(&mut self, word: &str) -> Result1<()> {
        if self.take(word) { Ok(()) } else { self.fail(&format!("`{word}`")) }
    }

    fn end(&self) -> Result1<()> {
        if self.peek().is_none() { Ok(()) } else { self.fail("nothing more") }
    }

    fn whole_statement(mut self) -> Result1<Stmt> {
        let stmt = if self.take("let") {
            let Some(name) = self.peek() else { return self.fail("a name") };
            self.at += 1;
            self.want("=")?;
            let number = self.names.len() as Name;
            let stmt = match name.starts_with(|c: char| c.is_ascii_uppercase()) {
                true => Stmt::LetCond(number, self.cond()?),
                false => Stmt::Let(number, self.expr()?),
            };
            self.names.push(name.to_string());
            self.scope.push(number);
            stmt
        } else if self.take("stop") {
            Stmt::Stop(0)
        } else {
            let register = self.peek().and_then(|word| REGISTER_NAMES.iter().position(|name| *name == word));
            let Some(register) = register else { return self.fail("a statement") };
            self.at += 1;
            self.want(":=")?;
            Stmt::Assign(0, register as u8, self.expr()?)
        };
        self.end()?;
        Ok(stmt)
    }

    fn deeper(&mut self) -> Result1<()> {
        self.depth += 1;
        if self.depth > DEEPEST { self.fail("less nesting") } else { Ok(()) }
    }

    fn expr(&mut self) -> Result1<Expr> {
        self.deeper()?;
        let expr = if self.take("if") {
            let cond = Box::new(self.cond()?);
            self.want("then")?;
            let then = Box::new(self.chain(1)?);
            self.want("else")?;
            Expr::If(0, cond, then, Box::new(self.expr()?))
        } else {
            self.chain(1)?
        };
        self.depth -= 1;
        Ok(expr)
    }

    /// Operands of one level and the signs between them, from the left.
    fn chain(&mut self, level: u8) -> Result1<Expr> {
        let operand = |words: &mut Self| if level == 1 { words.chain(2) } else { words.power() };
        let mut left = operand(self)?;
        loop {
            let sign = Sign::ALL.into_iter().find(|s| s.level() == level && Some(s.text()) == self.peek());
            let Some(sign) = sign else { return Ok(left) };
            self.at += 1;
            left = Expr::Binary(sign, Box::new(left), Box::new(operand(self)?));
        }
    }

    fn power(&mut self) -> Result1<Expr> {
        let base = self.atom()?;
        for (sign, n) in [("²", 2), ("³", 3), ("⁴", 4), ("⁵", 5)] {
            if self.take(sign) {
                return Ok(Expr::Power(Box::new(base), n));
            }
        }
        Ok(base)
    }

    fn atom(&mut self) -> Result1<Expr> {
        if self.take("(") {
            let inside = self.expr()?;
            self.want(")")?;
            return Ok(inside);
        }
        let Some(word) = self.peek() else { return self.fail("a value") };
        if let Some(function) = Function::ALL.into_iter().find(|f| f.name() == word) {
            self.at += 1;
            self.want("(")?;
            let mut args = vec![self.expr()?];
            while args.len() < function.arity() {
                self.want(",")?;
                args.push(self.expr()?);
            }
            self.want(")")?;
            return Ok(Expr::Call(function, args));
        }
        let register = |name: &str| REGISTER_NAMES.iter().position(|r| *r == name).map(|k| k as u8);
        let named = self.scope.iter().rev().copied().find(|&n| self.names[n as usize] == word);
        let expr = match word {
            "x-obstacle" => Expr::XObstacle,
            "x" => Expr::X,
            "y" => Expr::Y,
            "first-window" => Expr::FirstWindow,
            _ => {
                let iter2 = word.strip_prefix("iter2-").and_then(register).map(Expr::Iter2);
                let operand = || Operand::from_name(word).map(Expr::Window);
                let found = iter2.or_else(|| register(word).map(Expr::Register)).or_else(operand);
                let found = found.or(named.map(Expr::Name)).or_else(|| number(word).map(Expr::Const));
                let Some(found) = found else { return self.fail("a value") };
                found
            }
        };
        self.at += 1;
        Ok(expr)
    }

    fn cond(&mut self) -> Result1<Cond> {
        self.deeper()?;
        let mut left = self.conjunction()?;
        while self.take("or") {
            left = Cond::Or(Box::new(left), Box::new(self.conjunction()?));
        }
        self.depth -= 1;
        Ok(left)
    }

    fn conjunction(&mut self) -> Result1<Cond> {
        let mut left = self.condition()?;
        while self.take("and") {
            left = Cond::And(Box::new(left), Box::new(self.condition()?));
        }
        Ok(left)
    }

    fn condition(&mut self) -> Result1<Cond> {
        let first = |at: usize| self.words.get(at..at + 4) == Some(&["at", "the", "first", "position"]);
        if first(self.at) {
            self.at += 4;
            return Ok(Cond::First(true));
        }
        if self.peek() == Some("not") && first(self.at + 1) {
            self.at += 5;
            return Ok(Cond::First(false));
        }
        if self.take("not") {
            return Ok(Cond::Not(Box::new(self.condition()?)));
        }
        let upper = |word: &&str| word.starts_with(|c: char| c.is_ascii_uppercase()) && *word != "NaN";
        if let Some(word) = self.peek().filter(upper) {
            let named = self.scope.iter().rev().copied().find(|&n| self.names[n as usize] == word);
            let Some(name) = named else { return self.fail("a condition") };
            self.at += 1;
            return Ok(Cond::Name(name));
        }
        // A parenthesis opens a value or a condition; only what follows tells.
        let (start, depth) = (self.at, self.depth);
        let compared = self.comparison();
        if compared.is_ok() || self.words.get(start) != Some(&"(") {
            return compared;
        }
        (self.at, self.depth) = (start + 1, depth);
        let inside = self.cond()?;
        self.want(")")?;
        Ok(inside)
    }

    fn comparison(&mut self) -> Result1<Cond> {
        let left = self.chain(1)?;
        let relation = Relation::ALL.into_iter().find(|r| Some(r.text()) == self.peek());
        let Some(relation) = relation else { return self.fail("a comparison") };
        self.at += 1;
        Ok(Cond::Compare(relation, left, self.chain(1)?))
    }
}

/// A constant, rounded straight to binary32.
fn number(word: &str) -> Option<f32> {
    match word {
        "inf" => Some(f32::INFINITY),
        "-inf" => Some(f32::NEG_INFINITY),
        "NaN" => Some(f32::NAN),
        _ => word.ends_with(|c: char| c.is_ascii_digit()).then(|| word.parse().ok()).flatten(),
    }
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
    }
}
