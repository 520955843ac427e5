//! The parser of `.gp` text: tokens with their positions, then trees with an explicit stack, so that no text,
//! however deeply nested, can exhaust the program's own.

use vsonar_ir::Rect;

use super::error::{ParseError, ParseErrorKind as Kind, Position, quote, suggestion};
use super::individual::{Individual, MAX_DEPTH, MAX_NODES, Tree, TreeIndex};
use super::node::{Node, NodeType};
use super::place::Place;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Token<'a> {
    Open,
    Close,
    Word(&'a str),
    End,
}

impl Token<'_> {
    fn describe(self) -> String {
        match self {
            Token::Open => "`(`".to_string(),
            Token::Close => "`)`".to_string(),
            Token::Word(word) => quote(word),
            Token::End => "the end of the text".to_string(),
        }
    }
}

struct Lexer<'a> {
    rest: &'a str,
    at: Position,
}

impl<'a> Lexer<'a> {
    fn advance(&mut self) {
        let mut chars = self.rest.chars();
        if chars.next() == Some('\n') {
            self.at = Position { line: self.at.line + 1, column: 1 };
        } else {
            self.at.column += 1;
        }
        self.rest = chars.as_str();
    }

    /// The next token and where it begins.
    fn next(&mut self) -> (Token<'a>, Position) {
        loop {
            let at = self.at;
            match self.rest.chars().next() {
                None => return (Token::End, at),
                Some(';') => {
                    while !self.rest.is_empty() && !self.rest.starts_with('\n') {
                        self.advance();
                    }
                }
                Some(c) if c.is_whitespace() => self.advance(),
                Some('(') => {
                    self.advance();
                    return (Token::Open, at);
                }
                Some(')') => {
                    self.advance();
                    return (Token::Close, at);
                }
                Some(_) => {
                    let ends = |c: char| c.is_whitespace() || matches!(c, '(' | ')' | ';');
                    let length = self.rest.find(ends).unwrap_or(self.rest.len());
                    let (word, rest) = self.rest.split_at(length);
                    self.rest = rest;
                    self.at.column += word.chars().count();
                    return (Token::Word(word), at);
                }
            }
        }
    }
}

/// Parses a whole text as one individual.
pub(super) fn individual(text: &str) -> Result<Individual, ParseError> {
    // Some editors begin a file with a byte order mark.
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let mut lexer = Lexer { rest: text, at: Position { line: 1, column: 1 } };
    let (token, at) = lexer.next();
    match token {
        Token::Open => {}
        Token::End => return Err(Kind::Empty.at(at)),
        _ => return Err(Kind::NotIndividual { found: token.describe() }.at(at)),
    }
    let opened = at;
    let (token, at) = lexer.next();
    if token != Token::Word("individual") {
        return Err(Kind::NotIndividual { found: token.describe() }.at(at));
    }
    let mut trees: Vec<Tree> = Vec::new();
    loop {
        let (token, at) = lexer.next();
        match token {
            Token::Open if trees.len() == 2 => return Err(Kind::ThirdTree.at(at)),
            // The first tree is bound by the rules of a first, or of an only one, which are the same.
            Token::Open if trees.is_empty() => trees.push(tree(&mut lexer, at, TreeIndex::First)?),
            Token::Open => trees.push(tree(&mut lexer, at, TreeIndex::Second)?),
            Token::Close => break,
            Token::End => return Err(Kind::Unclosed { name: "individual".into(), opened }.at(at)),
            Token::Word(_) => return Err(Kind::NotATree { found: token.describe() }.at(at)),
        }
    }
    let Some(last) = trees.pop() else { return Err(Kind::NoTree.at(opened)) };
    let individual = Individual::new(trees.pop(), last).map_err(|error| Kind::Tree(error).at(opened))?;
    match lexer.next() {
        (Token::End, _) => Ok(individual),
        (token, at) => Err(Kind::Trailing { found: token.describe() }.at(at)),
    }
}

/// A function whose arguments are being read.
struct Open<'a> {
    node: Node,
    word: &'a str,
    place: Place,
    /// Arguments begun so far.
    given: usize,
    opened: Position,
}

/// Parses one tree, whose opening parenthesis at `opened` has been read.
fn tree(lexer: &mut Lexer<'_>, opened: Position, which: TreeIndex) -> Result<Tree, ParseError> {
    let mut nodes: Vec<Node> = Vec::new();
    let mut stack: Vec<Open<'_>> = Vec::new();
    let (mut token, mut at) = (Token::Open, opened);
    loop {
        let place = match stack.last_mut() {
            None => Place::Root,
            Some(parent) if matches!(token, Token::Open | Token::Word(_)) => parent.begin_argument(at)?,
            Some(parent) => parent.place,
        };
        match token {
            Token::Open => {
                let (head, head_at) = lexer.next();
                let Token::Word(word) = head else {
                    return Err(Kind::NoName { found: head.describe() }.at(head_at));
                };
                let node = node(word, place, which).map_err(|kind| kind.at(head_at))?;
                if !node.is_function() {
                    return Err(Kind::LeafInParentheses { name: quote(word) }.at(head_at));
                }
                push(&mut nodes, node, stack.len(), head_at)?;
                stack.push(Open { node, word, place, given: 0, opened: at });
            }
            Token::Word(word) => {
                let node = node(word, place, which).map_err(|kind| kind.at(at))?;
                if node.is_function() {
                    return Err(Kind::NeedsParentheses { name: word.into(), arity: node.arity() }.at(at));
                }
                push(&mut nodes, node, stack.len(), at)?;
            }
            Token::Close => {
                let Some(done) = stack.pop() else {
                    unreachable!("a tree begins with an opening parenthesis")
                };
                if done.given < done.node.arity() {
                    let (name, arity) = (done.word.into(), done.node.arity());
                    return Err(Kind::TooFew { name, arity, given: done.given }.at(done.opened));
                }
                if stack.is_empty() {
                    return Tree::from_nodes(nodes, which).map_err(|error| Kind::Tree(error).at(opened));
                }
            }
            Token::End => {
                let Some(open) = stack.pop() else {
                    unreachable!("a tree begins with an opening parenthesis")
                };
                return Err(Kind::Unclosed { name: open.word.into(), opened: open.opened }.at(at));
            }
        }
        (token, at) = lexer.next();
    }
}

impl Open<'_> {
    /// Counts one more argument, which begins at `at`, and tells its place.
    fn begin_argument(&mut self, at: Position) -> Result<Place, ParseError> {
        if self.given == self.node.arity() {
            return Err(Kind::TooMany { name: self.word.into(), arity: self.given }.at(at));
        }
        self.given += 1;
        Ok(match (self.node, self.given) {
            (Node::Iterate(_), 1) => Place::Rect,
            (Node::Iterate(_), 2) => Place::Column,
            (Node::Iterate(_), _) => Place::Body,
            _ => self.place,
        })
    }
}

fn push(nodes: &mut Vec<Node>, node: Node, depth: usize, at: Position) -> Result<(), ParseError> {
    if depth > MAX_DEPTH {
        return Err(Kind::TooDeep.at(at));
    }
    if nodes.len() == MAX_NODES {
        return Err(Kind::TooLarge.at(at));
    }
    nodes.push(node);
    Ok(())
}

/// The node that a word stands for, if it may stand in the place.
fn node(word: &str, place: Place, which: TreeIndex) -> Result<Node, Kind> {
    let named = NodeType::from_name(word).map(NodeType::node).filter(|n| !matches!(n, Node::Constant(_)));
    if place == Place::Rect && !matches!(named, Some(Node::Rect(_))) {
        return Err(Kind::NotARectangle { found: quote(word) });
    }
    let node = match named {
        Some(node) => node,
        None => constant(word)?,
    };
    if !node.fits(place) {
        let name = quote(word);
        return Err(match (node, place) {
            (_, Place::Root) => Kind::NotARoot { name },
            (Node::Iterate(_), _) => Kind::IterateBelowRoot { name },
            (Node::Rect(_), _) => Kind::RectangleMisplaced { name },
            _ => Kind::WindowDependent { name },
        });
    }
    if matches!(node, Node::Iter2(_)) && which == TreeIndex::First {
        return Err(Kind::Iter2 { name: quote(word) });
    }
    Ok(node)
}

/// The constant that a word stands for.
fn constant(word: &str) -> Result<Node, Kind> {
    let magnitude = word.strip_prefix(['+', '-']).unwrap_or(word);
    let found = || quote(word);
    if ["inf", "infinity", "nan"].iter().any(|name| magnitude.eq_ignore_ascii_case(name)) {
        return Err(Kind::NotFinite { found: found() });
    }
    if !magnitude.trim_start_matches('.').starts_with(|c: char| c.is_ascii_digit()) {
        return Err(Kind::Unknown { name: found(), suggestion: suggestion(word) });
    }
    if !is_decimal(magnitude) {
        let shape = magnitude.split_once('x').is_some_and(|(w, h)| {
            Rect::from_name(magnitude).is_none() && [w, h].iter().all(|s| s.parse::<u32>().is_ok())
        });
        return Err(if shape {
            Kind::NotARectangle { found: found() }
        } else {
            Kind::NotANumber { found: found() }
        });
    }
    // The standard library rounds a decimal of any length correctly, straight to binary32.
    match word.parse::<f32>() {
        Ok(value) if value.is_finite() => Ok(Node::Constant(value)),
        Ok(_) => Err(Kind::Overflow { found: found() }),
        Err(_) => Err(Kind::NotANumber { found: found() }),
    }
}

/// Whether a text without sign is digits with at most one point among them, and perhaps an exponent.
fn is_decimal(text: &str) -> bool {
    let digits = |s: &str| s.bytes().all(|b| b.is_ascii_digit());
    let (number, exponent) = match text.split_once(['e', 'E']) {
        Some((number, exponent)) => (number, Some(exponent)),
        None => (text, None),
    };
    let (whole, fraction) = number.split_once('.').unwrap_or((number, ""));
    let exponent = exponent.map(|e| e.strip_prefix(['+', '-']).unwrap_or(e));
    digits(whole)
        && digits(fraction)
        && !(whole.is_empty() && fraction.is_empty())
        && exponent.is_none_or(|e| !e.is_empty() && digits(e))
}
