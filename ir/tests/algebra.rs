//! Every row of the rewrite table, on the cross product of special values.

use vsonar_ir::Op;
use vsonar_ir::generate::SPECIAL;
use vsonar_ir::machine::Scalar;
use vsonar_ir::op::Value;
use vsonar_ir::opt::algebra::{Condition, Pattern, RULES, is_exactly_invertible};

/// One choice of values for a row's variables.
struct Binding {
    floats: [f32; 3],
    masks: [bool; 2],
    constant: f32,
}

impl Binding {
    fn holds(&self, condition: &Condition) -> bool {
        let value = |v: u8| self.floats[v as usize];
        match *condition {
            Condition::NotNegativeZero(v) => value(v).to_bits() != (-0.0f32).to_bits(),
            Condition::EqualIsSame(v, w) => {
                let (v, w) = (value(v), value(w));
                !v.is_nan() && !w.is_nan() && (v != w || v.to_bits() == w.to_bits())
            }
            Condition::PowerOfTwo(_) => is_exactly_invertible(self.constant),
        }
    }

    fn value(&self, pattern: &Pattern) -> Value<Scalar> {
        match *pattern {
            Pattern::Var(v @ 0..=2) => Value::F32(self.floats[v as usize]),
            Pattern::Var(v) => Value::Mask(self.masks[v as usize - 3]),
            Pattern::Const(_) => Value::F32(self.constant),
            Pattern::Is(value) => Value::F32(value),
            Pattern::Truth(value) => Value::Mask(value),
            Pattern::Negated(_) => Value::F32(-self.constant),
            Pattern::Reciprocal(_) => Value::F32(1.0 / self.constant),
            Pattern::Op(op, args) => {
                let args: Vec<Value<Scalar>> = args.iter().map(|arg| self.value(arg)).collect();
                op.apply(&mut Scalar, &args, 0).expect("rows hold no leaves")
            }
        }
    }
}

fn same(a: Value<Scalar>, b: Value<Scalar>) -> bool {
    match (a, b) {
        (Value::F32(a), Value::F32(b)) => a.to_bits() == b.to_bits() || a.is_nan() && b.is_nan(),
        (Value::Mask(a), Value::Mask(b)) => a == b,
        _ => false,
    }
}

#[test]
fn every_row_is_exact() {
    for rule in RULES {
        let mut tried = 0;
        for x in SPECIAL {
            for y in SPECIAL {
                for z in SPECIAL {
                    for masks in [[false, false], [false, true], [true, false], [true, true]] {
                        // The constant takes the role of y's values; no row has both.
                        let binding = Binding { floats: [x, y, z], masks, constant: z };
                        if !rule.when.iter().all(|condition| binding.holds(condition)) {
                            continue;
                        }
                        tried += 1;
                        let (from, to) = (binding.value(&rule.from), binding.value(&rule.to));
                        assert!(
                            same(from, to),
                            "{}: x {x:e}, y {y:e}, z or constant {z:e}, masks {masks:?}",
                            rule.name
                        );
                    }
                }
            }
        }
        assert!(tried > 100, "{}: its conditions never hold", rule.name);
    }
}

#[test]
fn side_conditions_are_needed() {
    // A condition that excludes nothing would be a mistake in the row (or in this test's reading of it).
    for rule in RULES.iter().filter(|rule| !rule.when.is_empty()) {
        let wrong = SPECIAL.iter().any(|&x| {
            SPECIAL.iter().any(|&c| {
                let binding = Binding { floats: [x, c, x], masks: [true, false], constant: c };
                !rule.when.iter().all(|condition| binding.holds(condition))
                    && !same(binding.value(&rule.from), binding.value(&rule.to))
            })
        });
        assert!(wrong, "{}: holds without its conditions too", rule.name);
    }
}

#[test]
fn rows_stand_by_operation_and_have_names() {
    let op = |pattern: &Pattern| match pattern {
        Pattern::Op(op, _) => *op,
        other => panic!("a row looks for an operation, not for {other:?}"),
    };
    let mut ops: Vec<Op> = RULES.iter().map(|rule| op(&rule.from)).collect();
    ops.dedup();
    let blocks = ops.len();
    ops.sort();
    ops.dedup();
    assert_eq!(ops.len(), blocks, "rows of an operation stand together");
    let mut names: Vec<&str> = RULES.iter().map(|rule| rule.name).collect();
    names.sort_unstable();
    names.dedup();
    assert_eq!(names.len(), RULES.len(), "a name stands twice");
}
