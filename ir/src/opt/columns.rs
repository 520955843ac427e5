//! Column expressions of nothing but the column asked for, tried on every column there is.
//!
//! What counts of a column expression is the window's column it is resolved to. If that is, for each column that
//! can be asked for, the same as for the column itself, the expression is as good as `x-obstacle`, for which
//! executors are best prepared; if it is the same column throughout, the expression is a constant.

use rustc_hash::FxHashMap;

use crate::machine::Scalar;
use crate::op::{Leaf, Op, Value};
use crate::program::{Block, Inst, Loop, Reg};
use crate::reference;
use crate::window::Rect;

/// How many instructions may be run to try an expression on all columns: fractions of a second. Expressions of up to 64
/// instructions are tried in the widest images there are, longer ones in narrower.
const MAX_TRIED: usize = 1 << 22;

/// How many expressions are remembered at most; all are forgotten then.
const MAX_KNOWN: usize = 1024;

/// What was found of expressions before, as populations repeat them.
#[derive(Debug, Default)]
pub struct Columns {
    known: FxHashMap<(Rect, u32, Reg, Vec<Inst>), Option<Leaf>>,
    values: Vec<Value<Scalar>>,
}

/// Replaces a loop's column expression by a leaf that is resolved to the same columns; whether it did.
pub fn run(l: &mut Loop, width: u32, columns: &mut Columns) -> bool {
    let block = &l.column.block;
    let too_long = block.len() * width as usize > MAX_TRIED;
    if block.len() == 1 || too_long || block.insts().iter().any(|inst| inst.op() == Op::Iter2) {
        return false;
    }
    let mut resolve = |x: u32| columns.resolve(l, width, x);
    let own = |x: u32| l.rect.resolve_column(x as f32, width);
    let (first, last) = (resolve(0), resolve(width - 1));
    if first != last && (first, last) != (own(0), own(width - 1)) {
        return false;
    }
    let key = (l.rect, width, l.column.result, block.insts().to_vec());
    let leaf = match columns.known.get(&key) {
        Some(known) => *known,
        None => {
            let leaf = columns.find(l, width, first, last);
            if columns.known.len() >= MAX_KNOWN {
                columns.known.clear();
            }
            columns.known.insert(key, leaf);
            leaf
        }
    };
    leaf.inspect(|leaf| l.column.set(*leaf)).is_some()
}

impl Columns {
    /// The leaf that serves, by trying all columns.
    fn find(&mut self, l: &Loop, width: u32, first: u32, last: u32) -> Option<Leaf> {
        if first == last {
            let same = (1..width - 1).all(|x| self.resolve(l, width, x) == first);
            return same.then_some(Leaf::Const(first as f32));
        }
        let own = |x: u32| l.rect.resolve_column(x as f32, width);
        (1..width - 1).all(|x| self.resolve(l, width, x) == own(x)).then_some(Leaf::XObstacle)
    }

    /// The column that the expression is resolved to if `x` is asked for.
    fn resolve(&mut self, l: &Loop, width: u32, x: u32) -> u32 {
        let block: &Block = &l.column.block;
        self.values.clear();
        for inst in block.insts() {
            let value = match inst.leaf() {
                Some(Leaf::Const(value)) => Value::F32(value),
                Some(Leaf::IConst(value)) => Value::I32(value),
                Some(Leaf::MConst(value)) => Value::Mask(value),
                // No other leaf is in a column expression that `run` lets through.
                Some(_) => Value::F32(x as f32),
                None => reference::apply(inst, &self.values),
            };
            self.values.push(value);
        }
        l.rect.resolve_column(self.values[l.column.result.index()].f32(), width)
    }
}
