//! The machine that writes C: each operation of a formula becomes one statement, equal ones one only, and those
//! that nothing needs are not printed.

use std::collections::HashMap;

use vsonar_ir::formula::image::PixelMachine;
use vsonar_ir::machine::Machine;

use super::literal;

/// A value: a name that stands for it, or the statement that computes it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) struct Id(u32);

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
enum Node {
    /// A name or literal.
    Text(String),
    /// A computation: in `template`, `$0` to `$2` stand for the arguments.
    Statement { ty: &'static str, template: String, args: Vec<Id> },
}

/// Statements while they are written.
#[derive(Debug)]
pub(super) struct Writer<'p> {
    prefix: &'p str,
    nodes: Vec<Node>,
    known: HashMap<Node, Id>,
}

/// Types of the three kinds of values, and of pixels.
const FLOAT: &str = "float";
const BITS: &str = "uint32_t";
const MASK: &str = "int";
const PIXEL: &str = "int32_t";

impl<'p> Writer<'p> {
    /// A writer that calls the helpers of this prefix.
    pub(super) fn new(prefix: &'p str) -> Writer<'p> {
        Writer { prefix, nodes: Vec::new(), known: HashMap::new() }
    }

    /// The value of a node: the one that is there already, if there is one like it.
    fn push(&mut self, node: Node) -> Id {
        *self.known.entry(node).or_insert_with_key(|node| {
            self.nodes.push(node.clone());
            Id(self.nodes.len() as u32 - 1)
        })
    }

    /// A value that a name or a literal stands for.
    pub(super) fn text(&mut self, text: impl Into<String>) -> Id {
        self.push(Node::Text(text.into()))
    }

    fn statement(&mut self, ty: &'static str, template: impl Into<String>, args: &[Id]) -> Id {
        self.push(Node::Statement { ty, template: template.into(), args: args.to_vec() })
    }

    /// Which values the results need, by number.
    fn live(&self, results: &[Id]) -> Vec<bool> {
        let mut live = vec![false; self.nodes.len()];
        results.iter().for_each(|id| live[id.0 as usize] = true);
        for (i, node) in self.nodes.iter().enumerate().rev() {
            if let (true, Node::Statement { args, .. }) = (live[i], node) {
                args.iter().for_each(|arg| live[arg.0 as usize] = true);
            }
        }
        live
    }

    /// Whether the results need a value.
    pub(super) fn needs(&self, results: &[Id], value: Id) -> bool {
        self.live(results)[value.0 as usize]
    }

    /// The expression of a value, its arguments being names.
    pub(super) fn expression(&self, id: Id) -> String {
        let names: Vec<String> = self
            .nodes
            .iter()
            .map(|node| match node {
                Node::Text(text) => text.clone(),
                Node::Statement { .. } => String::new(),
            })
            .collect();
        self.spell(id, &names)
    }

    fn spell(&self, id: Id, names: &[String]) -> String {
        match &self.nodes[id.0 as usize] {
            Node::Text(text) => text.clone(),
            Node::Statement { template, args, .. } => {
                let mut out = String::new();
                let mut rest = template.as_str();
                while let Some((before, after)) = rest.split_once('$') {
                    let (index, after) = after.split_at(1);
                    let index: usize = index.parse().unwrap_or(0);
                    out.push_str(before);
                    out.push_str(&names[args[index].0 as usize]);
                    rest = after;
                }
                out + rest
            }
        }
    }

    /// The statements that compute the results, each on a line of its own, and the names of the results.
    pub(super) fn print(&self, results: &[Id], indent: &str) -> (String, Vec<String>) {
        let live = self.live(results);
        let (mut names, mut out, mut count) = (Vec::with_capacity(self.nodes.len()), String::new(), 0);
        for (i, node) in self.nodes.iter().enumerate() {
            let name = match node {
                Node::Text(text) => text.clone(),
                Node::Statement { .. } if !live[i] => String::new(),
                Node::Statement { ty, .. } => {
                    let expression = self.spell(Id(i as u32), &names);
                    let name = format!("t{count}");
                    out.push_str(&format!("{indent}const {ty} {name} = {expression};\n"));
                    count += 1;
                    name
                }
            };
            names.push(name);
        }
        (out, results.iter().map(|id| names[id.0 as usize].clone()).collect())
    }
}

macro_rules! statements {
    ($($method:ident($($arg:ident),*) -> $ty:ident = $template:literal;)*) => {
        $( fn $method(&mut self, $($arg: Id),*) -> Id { self.statement($ty, $template, &[$($arg),*]) } )*
    };
}

/// Integers are `uint32_t`, whose arithmetic wraps; truth values are 0 and 1.
impl Machine for Writer<'_> {
    type F = Id;
    type I = Id;
    type M = Id;

    fn f32(&mut self, value: f32) -> Id {
        let text = literal::float(self.prefix, value);
        self.text(text)
    }
    fn i32(&mut self, value: i32) -> Id {
        self.text(format!("0x{value:08x}u"))
    }
    fn mask(&mut self, value: bool) -> Id {
        self.text(if value { "1" } else { "0" })
    }
    fn to_bits(&mut self, a: Id) -> Id {
        self.statement(BITS, format!("{}_bits($0)", self.prefix), &[a])
    }
    fn from_bits(&mut self, a: Id) -> Id {
        self.statement(FLOAT, format!("{}_float($0)", self.prefix), &[a])
    }
    fn ishl(&mut self, a: Id, bits: u32) -> Id {
        self.statement(BITS, format!("$0 << {bits}"), &[a])
    }
    fn iushr(&mut self, a: Id, bits: u32) -> Id {
        self.statement(BITS, format!("$0 >> {bits}"), &[a])
    }
    statements! {
        add(a, b) -> FLOAT = "$0 + $1";
        sub(a, b) -> FLOAT = "$0 - $1";
        mul(a, b) -> FLOAT = "$0 * $1";
        div(a, b) -> FLOAT = "$0 / $1";
        lt(a, b) -> MASK = "$0 < $1";
        le(a, b) -> MASK = "$0 <= $1";
        eq(a, b) -> MASK = "$0 == $1";
        select(m, a, b) -> FLOAT = "$0 ? $1 : $2";
        iselect(m, a, b) -> BITS = "$0 ? $1 : $2";
        and(a, b) -> MASK = "$0 & $1";
        or(a, b) -> MASK = "$0 | $1";
        not(a) -> MASK = "!$0";
        iadd(a, b) -> BITS = "$0 + $1";
        isub(a, b) -> BITS = "$0 - $1";
        iand(a, b) -> BITS = "$0 & $1";
        ior(a, b) -> BITS = "$0 | $1";
        ixor(a, b) -> BITS = "$0 ^ $1";
        ieq(a, b) -> MASK = "$0 == $1";
        ilt(a, b) -> MASK = "($0 ^ 0x80000000u) < ($1 ^ 0x80000000u)";
    }
}

/// Pixels are `int32_t`, in which no operator overflows.
impl PixelMachine for Writer<'_> {
    type P = Id;
    type M = Id;

    fn constant(&mut self, value: i32) -> Id {
        self.text(if value < 0 { format!("({value})") } else { value.to_string() })
    }
    statements! {
        add(a, b) -> PIXEL = "$0 + $1";
        sub(a, b) -> PIXEL = "$0 - $1";
        mul(a, b) -> PIXEL = "$0 * $1";
        lt(a, b) -> MASK = "$0 < $1";
        select(m, a, b) -> PIXEL = "$0 ? $1 : $2";
        min(a, b) -> PIXEL = "$0 < $1 ? $0 : $1";
        max(a, b) -> PIXEL = "$0 < $1 ? $1 : $0";
    }
}
