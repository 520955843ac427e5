//! The `.vir` text form: printed by [`print()`], read by [`parse`], an exact round trip.
//!
//! Line by line: a version, the image size, then one or two loops. Indentation is free, `;` starts a comment
//! to the end of the line, blank lines count for nothing.
//!
//! ```text
//! vir 1
//! image 320x240
//! loop 2 down 3x3          ; `loop 1` comes first if there is one; direction; rectangle; `last`: last position only
//! column
//!   v0 = x-obstacle
//!   result v0
//! body
//!   invariant              ; once for each lane       (each region's line may be left out with the region)
//!     v0 = const 239
//!   uniform                ; once for each row
//!     v1 = y
//!   varying                ; every lane at every row
//!     v2 = window gradient
//!     v3 = lt v0 v2
//!     v4 = read a
//!     v5 = select v3 v1 v4
//!   next a v5              ; what register a is after this position; registers without a line stay 0
//!   break v3               ; where this holds, the loop ends here
//! ```
//!
//! Registers count up from v0 in each block. Constants are printed in the shortest decimal form that reads back
//! the same bits; `inf`, `-inf` and `nan` are constants too.

use std::fmt::Write as _;

use crate::builder::{BuildError, Builder, LoopParts};
use crate::op::{Leaf, Op, REGISTER_NAMES};
use crate::program::{Block, Direction, Inst, Loop, Program, Reg, Region, Span};
use crate::verify::{VerifyError, Which};
use crate::window::{Operand, Rect};

/// The version of the text form.
pub const VERSION: u32 = 1;

/// Prints a program.
pub fn print(program: &Program) -> String {
    let mut out = format!("vir {VERSION}\nimage {}x{}\n", program.width(), program.height());
    if let Some(first) = program.first() {
        print_loop(&mut out, "loop 1", first);
    }
    print_loop(&mut out, "loop 2", program.second());
    out
}

impl std::fmt::Display for Program {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&print(self))
    }
}

impl std::str::FromStr for Program {
    type Err = ParseError;
    fn from_str(text: &str) -> Result<Program, ParseError> {
        parse(text)
    }
}

fn print_loop(out: &mut String, name: &str, l: &Loop) {
    let last = if l.span() == Span::Last { " last" } else { "" };
    // Writing to a String cannot fail.
    let _ = writeln!(out, "{name} {} {}{last}\ncolumn", l.direction().name(), l.rect());
    print_insts(out, l.column().block(), 0..l.column().block().len(), "  ");
    let _ = writeln!(out, "  result {}\nbody", l.column().result());
    for region in Region::ALL {
        let range = l.region(region);
        if !range.is_empty() {
            let _ = writeln!(out, "  {}", region.name());
            print_insts(out, l.body(), range, "    ");
        }
    }
    for (name, next) in REGISTER_NAMES.iter().zip(l.next()) {
        if let Some(reg) = next {
            let _ = writeln!(out, "  next {name} {reg}");
        }
    }
    if let Some(reg) = l.break_if() {
        let _ = writeln!(out, "  break {reg}");
    }
}

fn print_insts(out: &mut String, block: &Block, range: std::ops::Range<usize>, indent: &str) {
    for i in range {
        let _ = writeln!(out, "{indent}v{i} = {}", print_inst(&block.insts()[i]));
    }
}

/// Prints an instruction without its register: `add v0 v1`.
pub fn print_inst(inst: &Inst) -> String {
    let mut out = inst.op().name().to_owned();
    for arg in inst.args() {
        let _ = write!(out, " {arg}");
    }
    let payload = match inst.leaf() {
        Some(Leaf::Const(v)) => print_f32(v),
        Some(Leaf::IConst(v)) => v.to_string(),
        Some(Leaf::MConst(v)) => v.to_string(),
        Some(Leaf::Iter2(k) | Leaf::Read(k)) => REGISTER_NAMES[k as usize].to_owned(),
        Some(Leaf::Window(operand)) => operand.name().to_owned(),
        Some(Leaf::XObstacle | Leaf::X | Leaf::Y | Leaf::FirstWindow) => return out,
        None if inst.op().has_shift() => inst.imm().to_string(),
        None => return out,
    };
    let _ = write!(out, " {payload}");
    out
}

fn print_f32(v: f32) -> String {
    if v.is_nan() {
        return "nan".to_owned();
    }
    // The shorter of the two shortest-digits forms of the standard library, both of which read back exactly.
    let (plain, exponent) = (format!("{v}"), format!("{v:e}"));
    if plain.len() <= exponent.len() { plain } else { exponent }
}

/// Why a text is no program.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("line {line}: {kind}")]
pub struct ParseError {
    /// The line, counted from 1.
    pub line: usize,
    /// What is wrong there.
    pub kind: ParseErrorKind,
}

/// What is wrong in a line.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ParseErrorKind {
    /// Something else was expected.
    #[error("expected {expected}, found {found}")]
    Expected {
        /// What was expected.
        expected: String,
        /// What is there.
        found: String,
    },
    /// An instruction that the builder refuses.
    #[error(transparent)]
    Build(#[from] BuildError),
    /// A well-formed text of a malformed program.
    #[error(transparent)]
    Verify(#[from] VerifyError),
}

/// Reads a program and verifies it.
///
/// # Errors
/// The first fault, with its line.
pub fn parse(text: &str) -> Result<Program, ParseError> {
    let mut lines = Lines::new(text);
    lines.header("vir", &format!("`vir {VERSION}`"), |rest| (rest == [VERSION.to_string()]).then_some(()))?;
    let (width, height) = lines.header("image", "`image WIDTHxHEIGHT`", |rest| match rest {
        [size] => size.split_once('x').and_then(|(w, h)| Some((natural(w)?, natural(h)?))),
        _ => None,
    })?;
    let mut first = None;
    if lines.starts_with(&["loop", "1"]) {
        first = Some(parse_loop(&mut lines, Which::First)?);
    }
    let second = parse_loop(&mut lines, Which::Second)?;
    let end = lines.line;
    if lines.peek().is_some() {
        return Err(lines.expected("the end of the text"));
    }
    Program::new(width, height, first, second).map_err(|e| ParseError { line: end, kind: e.into() })
}

fn parse_loop(lines: &mut Lines<'_>, which: Which) -> Result<LoopParts, ParseError> {
    let number = if which == Which::First { "1" } else { "2" };
    let (direction, rect, span) =
        lines.header("loop", &format!("`loop {number} up|down RECTANGLE [last]`"), |rest| {
            let (span, rest) = match rest {
                [rest @ .., last] if *last == "last" => (Span::Last, rest),
                rest => (Span::All, rest),
            };
            let [n, direction, rect] = rest else { return None };
            let direction = [Direction::Up, Direction::Down].into_iter().find(|d| d.name() == *direction)?;
            (*n == number).then_some((direction, Rect::from_name(rect)?, span))
        })?;
    lines.header("column", "`column`", |rest| rest.is_empty().then_some(()))?;
    let mut column = Builder::new();
    parse_insts(lines, &mut column)?;
    let column_result =
        lines.header("result", "an instruction or `result vN`", |rest| one(rest).and_then(register))?;
    lines.header("body", "`body`", |rest| rest.is_empty().then_some(()))?;
    let mut body = Builder::new();
    let mut ends = [0; 3];
    for (region, end) in Region::ALL.into_iter().zip(&mut ends) {
        if lines.starts_with(&[region.name()]) {
            lines.header(region.name(), region.name(), |rest| rest.is_empty().then_some(()))?;
            parse_insts(lines, &mut body)?;
        }
        *end = body.insts().len();
    }
    let mut next = [None; 5];
    for (slot, name) in next.iter_mut().zip(REGISTER_NAMES) {
        if lines.starts_with(&["next", name]) {
            let reg = lines.header("next", "`next REGISTER vN`", |rest| match rest {
                [_, reg] => register(reg),
                _ => None,
            })?;
            *slot = Some(reg);
        }
    }
    let mut break_if = None;
    if lines.starts_with(&["break"]) {
        break_if = Some(lines.header("break", "`break vN`", |rest| one(rest).and_then(register))?);
    }
    let more = lines.peek().is_some_and(|words| words[0] != "loop");
    if more {
        return Err(lines.expected(
            "an instruction, a region (invariant, uniform, varying), `next` (a to e), `break`, `loop`, in this order",
        ));
    }
    Ok(LoopParts {
        direction,
        rect,
        span,
        column: column.finish(),
        column_result,
        body: body.finish(),
        invariant: ends[0],
        uniform: ends[1] - ends[0],
        next,
        break_if,
    })
}

fn parse_insts(lines: &mut Lines<'_>, builder: &mut Builder) -> Result<(), ParseError> {
    while lines.peek().is_some_and(|words| words.get(1) == Some(&"=")) {
        let reg = Reg(builder.insts().len() as u32);
        let words = lines.peek().unwrap_or_default();
        if words[0] != reg.to_string() {
            return Err(lines.expected(&format!("`{reg} = ...` (registers count up from v0)")));
        }
        let Some(op) = words.get(2).and_then(|name| Op::from_name(name)) else {
            return Err(lines.expected("`vN = OPERATION ...`"));
        };
        let rest: Vec<&str> = words[3..].to_vec();
        let parsed = if op.is_leaf() {
            parse_leaf(op, &rest).map(|leaf| (Vec::new(), leaf.encode().1))
        } else {
            let (args, shift) = match rest.split_last() {
                Some((last, args)) if op.has_shift() => (args, natural(last)),
                _ => (&rest[..], (!op.has_shift()).then_some(0)),
            };
            let args: Option<Vec<Reg>> = args.iter().map(|word| register(word)).collect();
            args.zip(shift)
        };
        let Some((args, imm)) = parsed else {
            return Err(lines.expected(&format!("operands as in {}", usage(op))));
        };
        builder.push_imm(op, &args, imm).map_err(|e| ParseError { line: lines.number(), kind: e.into() })?;
        lines.advance();
    }
    Ok(())
}

fn parse_leaf(op: Op, rest: &[&str]) -> Option<Leaf> {
    let name = |rest: &[&str]| REGISTER_NAMES.iter().position(|n| rest == [*n]).map(|k| k as u8);
    match op {
        Op::Const => one(rest).and_then(constant).map(Leaf::Const),
        Op::IConst => one(rest)?.parse().ok().map(Leaf::IConst),
        Op::MConst => one(rest)?.parse().ok().map(Leaf::MConst),
        Op::Iter2 => name(rest).map(Leaf::Iter2),
        Op::Read => name(rest).map(Leaf::Read),
        Op::Window => one(rest).and_then(Operand::from_name).map(Leaf::Window),
        _ if rest.is_empty() => Leaf::decode(op, 0),
        _ => None,
    }
}

fn usage(op: Op) -> String {
    let payload = match op {
        Op::Const => " NUMBER",
        Op::IConst => " INTEGER",
        Op::MConst => " true|false",
        Op::Iter2 | Op::Read => " a|b|c|d|e",
        Op::Window => " OPERATOR[-sq]",
        _ if op.has_shift() => " BITS",
        _ => "",
    };
    let args: String = op.operands().iter().map(|ty| format!(" vN:{ty}")).collect();
    format!("`{}{args}{payload}`", op.name())
}

fn constant(word: &str) -> Option<f32> {
    match word {
        "inf" => Some(f32::INFINITY),
        "-inf" => Some(f32::NEG_INFINITY),
        "nan" => Some(f32::NAN),
        _ if word.bytes().all(|b| matches!(b, b'0'..=b'9' | b'+' | b'-' | b'.' | b'e' | b'E')) => {
            word.parse().ok().filter(|v: &f32| v.is_finite())
        }
        _ => None,
    }
}

fn natural(word: &str) -> Option<u32> {
    word.bytes().all(|b| b.is_ascii_digit()).then(|| word.parse().ok()).flatten()
}

fn register(word: &str) -> Option<Reg> {
    word.strip_prefix('v').and_then(natural).map(Reg)
}

fn one<'a>(rest: &[&'a str]) -> Option<&'a str> {
    match rest {
        [word] => Some(word),
        _ => None,
    }
}

/// The lines that hold anything, as words, with their numbers.
struct Lines<'a> {
    lines: Vec<(usize, Vec<&'a str>)>,
    next: usize,
    /// The last line of the text, for faults that show only at its end.
    line: usize,
}

impl<'a> Lines<'a> {
    fn new(text: &'a str) -> Lines<'a> {
        let content = |line: &'a str| -> Vec<&'a str> {
            line.split(';').next().unwrap_or_default().split_whitespace().collect()
        };
        let numbered = text.lines().enumerate().map(|(i, line)| (i + 1, content(line)));
        let lines: Vec<(usize, Vec<&str>)> = numbered.filter(|(_, words)| !words.is_empty()).collect();
        Lines { next: 0, line: text.lines().count().max(1), lines }
    }

    fn peek(&self) -> Option<&[&'a str]> {
        self.lines.get(self.next).map(|(_, words)| &words[..])
    }

    fn advance(&mut self) {
        self.next += 1;
    }

    fn number(&self) -> usize {
        self.lines.get(self.next).map_or(self.line, |(number, _)| *number)
    }

    fn starts_with(&self, words: &[&str]) -> bool {
        self.peek().is_some_and(|line| line.starts_with(words))
    }

    fn expected(&self, expected: &str) -> ParseError {
        let found = self.peek().map_or("the end of the text".to_owned(), |w| format!("`{}`", w.join(" ")));
        ParseError {
            line: self.number(),
            kind: ParseErrorKind::Expected { expected: expected.to_owned(), found },
        }
    }

    /// A line that begins with `word`; `read` makes something of the rest of it.
    fn header<T>(
        &mut self,
        word: &str,
        expected: &str,
        read: impl FnOnce(&[&str]) -> Option<T>,
    ) -> Result<T, ParseError> {
        let found = match self.peek() {
            Some([first, rest @ ..]) if *first == word => read(rest),
            _ => None,
        };
        let value = found.ok_or_else(|| self.expected(expected))?;
        self.advance();
        Ok(value)
    }
}
