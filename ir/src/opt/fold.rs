//! Constant folding: an operation whose operands are all constants is computed once, on the [`Scalar`] machine
//! that also defines it.

use crate::machine::Scalar;
use crate::op::{Leaf, Value};
use crate::program::Inst;

/// The constant an instruction computes, if `operand` knows all of its operands' constants.
pub fn fold(inst: &Inst, operand: impl Fn(usize) -> Option<Leaf>) -> Option<Leaf> {
    if inst.op().is_leaf() {
        return None;
    }
    let mut values = [Value::Mask(false); 3];
    let count = inst.args().len();
    for (i, value) in values.iter_mut().take(count).enumerate() {
        *value = value_of(operand(i)?)?;
    }
    inst.op().apply(&mut Scalar, &values[..count], inst.imm()).map(leaf_of)
}

/// A constant leaf's value.
pub fn value_of(leaf: Leaf) -> Option<Value<Scalar>> {
    match leaf {
        Leaf::Const(v) => Some(Value::F32(v)),
        Leaf::IConst(v) => Some(Value::I32(v)),
        Leaf::MConst(v) => Some(Value::Mask(v)),
        _ => None,
    }
}

/// The constant leaf of a value.
pub fn leaf_of(value: Value<Scalar>) -> Leaf {
    match value {
        Value::F32(v) => Leaf::Const(v),
        Value::I32(v) => Leaf::IConst(v),
        Value::Mask(v) => Leaf::MConst(v),
    }
}
