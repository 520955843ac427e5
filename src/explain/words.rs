//! Reading a line of a listing: its words and signs as a value, a condition or a statement.

use vsonar_ir::Operand;
use vsonar_ir::op::REGISTER_NAMES;

use super::listing::{Cond, DEEPEST, Expr, Function, Name, Relation, Sign, Stmt};
use super::parse::{Result1, fault};

/// The words and signs of a line.
pub(super) struct Words<'a> {
    words: Vec<&'a str>,
    at: usize,
    depth: usize,
    line: usize,
    names: &'a mut Vec<String>,
    /// The names that can be seen.
    scope: &'a mut Vec<Name>,
}

impl<'a> Words<'a> {
    pub(super) fn new(
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

    pub(super) fn whole_expr(mut self) -> Result1<Expr> {
        let expr = self.expr()?;
        self.end()?;
        Ok(expr)
    }

    pub(super) fn whole_cond(mut self) -> Result1<Cond> {
        let cond = self.cond()?;
        self.end()?;
        Ok(cond)
    }

    pub(super) fn whole_statement(mut self) -> Result1<Stmt> {
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
        let depth = self.depth;
        loop {
            let sign = Sign::ALL.into_iter().find(|s| s.level() == level && Some(s.text()) == self.peek());
            let Some(sign) = sign else {
                self.depth = depth;
                return Ok(left);
            };
            self.at += 1;
            self.deeper()?;
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
        if let Some(function) = Function::all().find(|f| f.name() == word) {
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
        let depth = self.depth;
        self.deeper()?;
        let mut left = self.conjunction()?;
        while self.take("or") {
            self.deeper()?;
            left = Cond::Or(Box::new(left), Box::new(self.conjunction()?));
        }
        self.depth = depth;
        Ok(left)
    }

    fn conjunction(&mut self) -> Result1<Cond> {
        let depth = self.depth;
        let mut left = self.condition()?;
        while self.take("and") {
            self.deeper()?;
            left = Cond::And(Box::new(left), Box::new(self.condition()?));
        }
        self.depth = depth;
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
            self.deeper()?;
            let inside = self.condition()?;
            self.depth -= 1;
            return Ok(Cond::Not(Box::new(inside)));
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
