//! Intervals never exclude a value that an operation gives, nor a leaf: every operation on special values and on
//! random ones, with intervals that are as narrow as their operands allow and wider ones.

use vsonar_ir::builder::LoopParts;
use vsonar_ir::generate::{self, Random, SPECIAL};
use vsonar_ir::machine::Scalar;
use vsonar_ir::op::Value;
use vsonar_ir::opt::interval::Interval;
use vsonar_ir::opt::ranges::Leaves;
use vsonar_ir::{Builder, Direction, Leaf, Op, Operand, Program, Rect, Span, Ty};

/// The narrowest interval around some values.
fn hull(values: &[f32]) -> Interval {
    values.iter().map(|v| Interval::of(*v)).reduce(Interval::either).expect("at least one value")
}

fn operations() -> impl Iterator<Item = Op> {
    Op::ALL.iter().copied().filter(|op| {
        let integer = op.result() == Ty::I32 || op.operands().contains(&Ty::I32);
        !op.is_leaf() && !integer
    })
}

/// The interval of one value of a type: of a mask, 0 or 1.
fn of(value: Value<Scalar>) -> Interval {
    match value {
        Value::F32(v) => Interval::of(v),
        Value::Mask(v) => Interval::of_constant(Leaf::MConst(v)),
        Value::I32(_) => Interval::ANY,
    }
}

fn holds(interval: Interval, value: Value<Scalar>) -> bool {
    match value {
        Value::F32(v) => interval.contains(v),
        Value::Mask(v) => interval.contains(if v { 1.0 } else { 0.0 }),
        Value::I32(_) => true,
    }
}

/// The choices for an operand of this type, from some f32s.
fn choices(ty: Ty, floats: &[f32]) -> Vec<Value<Scalar>> {
    match ty {
        Ty::Mask => vec![Value::Mask(false), Value::Mask(true)],
        _ => floats.iter().map(|v| Value::F32(*v)).collect(),
    }
}

/// Checks all combinations of the operands' values against the interval inferred from the operands'.
fn check(op: Op, operands: &[Vec<Value<Scalar>>], same: bool) -> usize {
    let join =
        |values: &Vec<Value<Scalar>>| values.iter().map(|v| of(*v)).reduce(Interval::either).expect("values");
    let mut intervals = [Interval::ANY; 3];
    for (interval, values) in intervals.iter_mut().zip(operands) {
        *interval = join(values);
    }
    let inferred = Interval::infer(op, intervals, same);
    let one = [Value::Mask(false)];
    let third: &[Value<Scalar>] = operands.get(2).map_or(&one, Vec::as_slice);
    let second: &[Value<Scalar>] = operands.get(1).map_or(&one, Vec::as_slice);
    let mut checked = 0;
    for a in &operands[0] {
        for b in if same { std::slice::from_ref(a) } else { second } {
            for c in third {
                let args = [*a, *b, *c];
                let result = op.apply(&mut Scalar, &args[..operands.len()], 0).expect("no leaf");
                assert!(
                    holds(inferred, result),
                    "{} {args:?} gives {result:?}, outside {inferred:?} of {intervals:?}",
                    op.name()
                );
                if let Some(constant) = inferred.constant(op.result()) {
                    let constant = of_leaf(constant);
                    assert!(
                        same_bits(constant, result),
                        "{} {args:?}: {result:?}, not {constant:?}",
                        op.name()
                    );
                }
                checked += 1;
            }
        }
    }
    checked
}

fn of_leaf(leaf: Leaf) -> Value<Scalar> {
    match leaf {
        Leaf::Const(v) => Value::F32(v),
        Leaf::MConst(v) => Value::Mask(v),
        other => panic!("{other:?} is no constant of an f32 or a mask"),
    }
}

fn same_bits(a: Value<Scalar>, b: Value<Scalar>) -> bool {
    match (a, b) {
        (Value::F32(a), Value::F32(b)) => a.to_bits() == b.to_bits() || a.is_nan() && b.is_nan(),
        (Value::Mask(a), Value::Mask(b)) => a == b,
        _ => false,
    }
}

#[test]
fn results_lie_in_the_intervals_of_special_operands() {
    // All pairs of special values as the hull of each operand: half-open at zeros, infinities, NaN and all.
    let pairs: Vec<[f32; 2]> = SPECIAL.iter().flat_map(|&a| SPECIAL.map(|b| [a, b])).collect();
    let mut checked = 0;
    for op in operations() {
        let types = op.operands();
        for a in &pairs {
            let first = choices(types[0], a);
            match types.len() {
                1 => checked += check(op, &[first], false),
                2 => {
                    for b in &pairs {
                        checked += check(op, &[first.clone(), choices(types[1], b)], false);
                    }
                    if types[0] == types[1] {
                        checked += check(op, &[first.clone(), first], true);
                    }
                }
                _ => {
                    for b in &pairs {
                        checked += check(
                            op,
                            &[choices(types[0], &[]), choices(types[1], a), choices(types[2], b)],
                            false,
                        );
                    }
                }
            }
        }
    }
    assert!(checked > 5_000_000, "only {checked} results");
}

/// A value between the bounds of an interval, often one of them.
fn within(random: &mut Random, interval: Interval) -> f32 {
    let inside = |v: f32| interval.contains(v).then_some(v);
    for _ in 0..20 {
        let guess = match random.below(5) {
            0 => interval.lo,
            1 => interval.hi,
            2 => random.pick(&SPECIAL),
            // Between: of the same order as a bound, or anywhere.
            3 => interval.lo + (interval.hi - interval.lo) * random.below(1000) as f32 / 1000.0,
            _ => random.f32(),
        };
        if let Some(value) = inside(guess) {
            return value;
        }
    }
    if interval.is_empty() { f32::NAN } else { interval.lo }
}

#[test]
fn results_lie_in_the_intervals_of_random_operands() {
    let random = &mut Random::new(2026);
    let mut narrow = 0u32;
    for _ in 0..20_000 {
        for op in operations() {
            let operand = |random: &mut Random, ty: Ty| {
                let floats: Vec<f32> = (0..1 + random.below(2)).map(|_| random.f32()).collect();
                let interval = hull(&floats);
                let mut samples = floats;
                samples.extend((0..4).map(|_| within(random, interval)));
                choices(ty, &samples)
            };
            let operands: Vec<_> = op.operands().iter().map(|ty| operand(random, *ty)).collect();
            check(op, &operands, false);
            let mut intervals = [Interval::ANY; 3];
            for (interval, values) in intervals.iter_mut().zip(&operands) {
                *interval = values.iter().map(|v| of(*v)).reduce(Interval::either).expect("values");
            }
            let inferred = Interval::infer(op, intervals, false);
            narrow += u32::from(inferred.lo > f32::NEG_INFINITY && inferred.hi < f32::INFINITY);
        }
    }
    assert!(narrow > 100_000, "the intervals say little: {narrow} are bounded");
}

#[test]
fn monotone_operations_lose_nothing_but_rounding() {
    let of = |lo: f32, hi: f32| Interval::new(lo, hi);
    let infer = |op, a, b| Interval::infer(op, [a, b, Interval::ANY], false);
    assert_eq!(infer(Op::Add, of(1.0, 2.0), of(-5.0, 3.0)), of(-4.0, 5.0));
    assert_eq!(infer(Op::Mul, of(0.0, 255.0), of(0.0, 2.0)), of(0.0, 510.0));
    assert_eq!(infer(Op::Div, of(0.0, 10.0), of(2.0, 4.0)), of(0.0, 5.0));
    assert_eq!(infer(Op::PDiv, of(0.5, 10.0), of(0.0, 4.0)), of(0.125, f32::INFINITY));
    assert_eq!(infer(Op::Max, of(0.0, 10.0), of(3.0, 4.0)), of(3.0, 10.0));
    assert_eq!(infer(Op::Lt, of(0.0, 2.0), of(2.5, 4.0)), Interval::TRUE);
    assert_eq!(infer(Op::Lt, Interval::NAN, of(2.5, 4.0)), Interval::FALSE);
    assert_eq!(infer(Op::Le, of(0.0, 2.0), of(2.0, 4.0)), Interval::TRUE);
    assert_eq!(infer(Op::Lt, of(0.0, 2.0), of(2.0, 4.0)), Interval::MASK);
}

/// What the optimiser takes a window operand's range to be in a loop with this rectangle.
fn window_interval(rect: Rect, operand: Operand) -> Interval {
    let (mut column, mut body) = (Builder::new(), Builder::new());
    let column_result = column.leaf(Leaf::XObstacle);
    body.leaf(Leaf::Window(operand));
    let parts = LoopParts {
        direction: Direction::Up,
        rect,
        span: Span::All,
        column: column.finish(),
        column_result,
        body: body.finish(),
        invariant: 0,
        uniform: 0,
        next: [None; 5],
        break_if: None,
    };
    let program = Program::new(40, 24, None, parts).expect("well formed");
    Leaves::new(program.second(), 40, 24, [Interval::ANY; 5]).of(Leaf::Window(operand))
}

#[test]
fn no_window_exceeds_the_largest_average() {
    for operand in Operand::all() {
        for rect in Rect::all() {
            let largest = rect.largest_average(operand);
            let interval = window_interval(rect, operand);
            let area = u64::from(rect.area());
            let all = operand.max() * area;
            // Where ranges end, and at the upper end rounding could go astray.
            for sum in (0..2000).flat_map(|i| [i.min(all), all - i.min(all)]) {
                let average = sum as f32 / area as f32;
                let holds = average <= largest && interval.contains(average);
                assert!(holds, "{} {rect} {sum}: {average} outside {interval:?}", operand.name());
            }
            assert!(interval.contains(largest) && !interval.contains(largest.next_up()));
        }
    }
    let mut random = Random::new(1);
    let windows = generate::windows(1);
    for _ in 0..200_000 {
        let rect = Rect::from_index(random.below(Rect::COUNT)).expect("below the count");
        let operand = Operand::from_index(random.below(Operand::COUNT) as u8).expect("below the count");
        let at =
            vsonar_ir::WindowAt { operand, rect, x: random.below(300) as u32, y: random.below(200) as u32 };
        let average = windows(at);
        assert!(average.is_sign_positive() && average <= rect.largest_average(operand), "{at:?}: {average}");
    }
}
