//! The trigonometric formulas against binary64 references: ten million inputs, and the corners as a table.

use std::f32::consts::{FRAC_PI_2, FRAC_PI_4, PI};
use std::f64::consts;

use vsonar_ir::formula::trig;
use vsonar_ir::machine::Scalar;

/// Inputs for each of the five functions; ten million together.
const INPUTS: u32 = 2_000_000;

fn sin(x: f32) -> f32 {
    trig::sin(&mut Scalar, x)
}
fn cos(x: f32) -> f32 {
    trig::cos(&mut Scalar, x)
}
fn tan(x: f32) -> f32 {
    trig::tan(&mut Scalar, x)
}
fn atan(x: f32) -> f32 {
    trig::atan(&mut Scalar, x)
}
fn atan2(a: f32, b: f32) -> f32 {
    trig::atan2(&mut Scalar, a, b)
}

/// Steele, Lea and Flood's generator (2014).
struct SplitMix(u64);

impl SplitMix {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn bits(&mut self) -> u32 {
        (self.next() >> 32) as u32
    }

    fn below(&mut self, end: u32) -> u32 {
        self.bits() % end
    }

    /// Uniform in -1 to 1.
    fn unit(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    /// An argument, of the six kinds in turn: any bit pattern, log-uniform, beside a multiple of π/2, small, the
    /// domain of the periodic functions, the first turns; now and then a special value.
    fn argument(&mut self, kind: u32) -> f32 {
        if self.below(1000) == 0 {
            return SPECIAL[self.below(SPECIAL.len() as u32) as usize];
        }
        match kind % 6 {
            0 => f32::from_bits(self.bits()),
            1 => {
                let exponent = self.below(54 + 1) + 127 - 40;
                f32::from_bits((exponent << 23) | (self.bits() & 0x807f_ffff))
            }
            2 => {
                let k = (self.unit() * 5215.5) as i32;
                let nearest = (f64::from(k) * consts::FRAC_PI_2) as f32;
                f32::from_bits(nearest.to_bits().wrapping_add(self.below(33)).wrapping_sub(16))
            }
            3 => (self.unit() * 1e-3) as f32,
            4 => (self.unit() * 8192.0) as f32,
            _ => (self.unit() * 7.0) as f32,
        }
    }
}

const SPECIAL: [f32; 20] = [
    0.0,
    -0.0,
    1.0,
    -1.0,
    8192.0,
    -8192.0,
    FRAC_PI_4,
    FRAC_PI_2,
    -FRAC_PI_2,
    PI,
    f32::MIN_POSITIVE,
    -f32::MIN_POSITIVE,
    f32::from_bits(1),
    f32::from_bits(0x8000_0001),
    f32::MAX,
    f32::MIN,
    f32::INFINITY,
    f32::NEG_INFINITY,
    f32::NAN,
    f32::from_bits(0xffa5_5a5a),
];

/// The largest error the language allows of a result: 4 ulp of the true value or 1e-6.
fn allowed(truth: f64) -> f64 {
    let exponent = ((truth.to_bits() >> 52) & 0x7ff) as i32 - 1023;
    libm::ldexp(4.0, exponent.max(-126) - 23).max(1e-6)
}

fn same(a: f32, b: f32) -> bool {
    a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan())
}

/// Runs `check` on [`INPUTS`] arguments; what it finds wrong is reported with the seed and the argument.
fn each_argument(seed: u64, check: impl Fn(f32) -> Result<(), String>) {
    let mut random = SplitMix(seed);
    for i in 0..INPUTS {
        let x = random.argument(i);
        if let Err(fault) = check(x) {
            panic!("seed {seed}, input {i}, x = {x:e} (bits {:#010x}): {fault}", x.to_bits());
        }
    }
}

/// `y` against `truth`, and against the value `mirrored` that the formula's symmetry asks for.
fn judge(y: f32, truth: f64, mirrored: f32) -> Result<(), String> {
    let error = (f64::from(y) - truth).abs();
    if error > allowed(truth) || y.is_nan() {
        return Err(format!("{y:e} is {error:e} from {truth:e}, allowed {:e}", allowed(truth)));
    }
    if !same(y, mirrored) {
        return Err(format!("{y:e} is not the mirror image {mirrored:e}"));
    }
    Ok(())
}

fn within(y: f32, bound: f32) -> Result<(), String> {
    if y.abs() <= bound { Ok(()) } else { Err(format!("{y:e} is beyond {bound:e}")) }
}

fn is_nan(y: f32) -> Result<(), String> {
    if y.is_nan() { Ok(()) } else { Err(format!("{y:e} should be NaN")) }
}

#[test]
fn sine_keeps_its_bounds() {
    each_argument(1, |x| match x {
        _ if !x.is_finite() => is_nan(sin(x)),
        _ if x.abs() <= 8192.0 => judge(sin(x), libm::sin(f64::from(x)), -sin(-x)).and(within(sin(x), 1.0)),
        _ => within(sin(x), 1.0),
    });
}

#[test]
fn cosine_keeps_its_bounds() {
    each_argument(2, |x| match x {
        _ if !x.is_finite() => is_nan(cos(x)),
        _ if x.abs() <= 8192.0 => judge(cos(x), libm::cos(f64::from(x)), cos(-x)).and(within(cos(x), 1.0)),
        _ => within(cos(x), 1.0),
    });
}

#[test]
fn tangent_keeps_its_bounds() {
    each_argument(3, |x| {
        if !x.is_finite() {
            return is_nan(tan(x));
        }
        let truth = libm::tan(f64::from(x));
        if x.abs() <= 8192.0 && truth.abs() <= f64::from(trig::TAN_ACCURATE) {
            judge(tan(x), truth, -tan(-x))
        } else {
            within(tan(x), f32::INFINITY)
        }
    });
}

#[test]
fn arc_tangent_keeps_its_bounds() {
    each_argument(4, |x| match x {
        _ if x.is_nan() => is_nan(atan(x)),
        _ => judge(atan(x), libm::atan(f64::from(x)), -atan(-x)).and(within(atan(x), FRAC_PI_2)),
    });
}

#[test]
fn angle_keeps_its_bounds() {
    const SEED: u64 = 5;
    let mut random = SplitMix(SEED);
    for i in 0..INPUTS {
        let kind = random.below(6);
        let a = random.argument(kind);
        // Every kind against every other; half the time both of one size, a few steps apart at the closest.
        let kind = random.below(12);
        let b = if kind < 6 {
            random.argument(kind)
        } else {
            let near = f32::from_bits(a.to_bits().wrapping_add(random.bits() >> (8 + 4 * (kind - 6))));
            if random.below(2) == 0 { near } else { -near }
        };
        let y = atan2(a, b);
        let verdict = if a.is_nan() || b.is_nan() {
            is_nan(y)
        } else if a == 0.0 && b == 0.0 {
            if y.to_bits() == 0 { Ok(()) } else { Err(format!("{y:e} should be +0")) }
        } else {
            judge(y, libm::atan2(f64::from(a), f64::from(b)), -atan2(-a, b)).and(within(y, PI))
        };
        if let Err(fault) = verdict {
            let (a_bits, b_bits) = (a.to_bits(), b.to_bits());
            panic!("seed {SEED}, input {i}, a = {a:e} ({a_bits:#010x}), b = {b:e} ({b_bits:#010x}): {fault}");
        }
    }
}

/// Ordinate, abscissa, angle: to be met bit for bit.
const QUADRANTS: [(f32, f32, f32); 40] = {
    const INF: f32 = f32::INFINITY;
    const THREE: f32 = 2.356_194_5;
    const TINY: f32 = f32::from_bits(1);
    [
        // Two zeros of any sign: the one place where C says otherwise.
        (0.0, 0.0, 0.0),
        (0.0, -0.0, 0.0),
        (-0.0, 0.0, 0.0),
        (-0.0, -0.0, 0.0),
        // On the horizontal axis.
        (0.0, 1.0, 0.0),
        (-0.0, 1.0, -0.0),
        (0.0, -1.0, PI),
        (-0.0, -1.0, -PI),
        (0.0, TINY, 0.0),
        (-0.0, TINY, -0.0),
        (0.0, -TINY, PI),
        (-0.0, -TINY, -PI),
        (0.0, INF, 0.0),
        (-0.0, INF, -0.0),
        (0.0, -INF, PI),
        (-0.0, -INF, -PI),
        // On the vertical axis.
        (1.0, 0.0, FRAC_PI_2),
        (1.0, -0.0, FRAC_PI_2),
        (-1.0, 0.0, -FRAC_PI_2),
        (-1.0, -0.0, -FRAC_PI_2),
        (TINY, 0.0, FRAC_PI_2),
        (-TINY, -0.0, -FRAC_PI_2),
        (INF, 0.0, FRAC_PI_2),
        (-INF, -0.0, -FRAC_PI_2),
        // One infinity.
        (3.0, INF, 0.0),
        (-3.0, INF, -0.0),
        (3.0, -INF, PI),
        (-3.0, -INF, -PI),
        (INF, 3.0, FRAC_PI_2),
        (INF, -3.0, FRAC_PI_2),
        (-INF, 3.0, -FRAC_PI_2),
        (-INF, -3.0, -FRAC_PI_2),
        // Diagonals, infinite and finite, where nothing may overflow or vanish.
        (INF, INF, FRAC_PI_4),
        (INF, -INF, THREE),
        (-INF, INF, -FRAC_PI_4),
        (-INF, -INF, -THREE),
        (f32::MAX, f32::MAX, FRAC_PI_4),
        (TINY, -TINY, THREE),
        (f32::MAX, TINY, FRAC_PI_2),
        (-TINY, -f32::MAX, -PI),
    ]
};

#[test]
fn angles_at_zeros_and_infinities() {
    for (a, b, angle) in QUADRANTS {
        let y = atan2(a, b);
        assert_eq!(y.to_bits(), angle.to_bits(), "atan2({a:e}, {b:e}) = {y:e}, not {angle:e}");
    }
}

#[test]
fn one_argument_at_zeros_and_infinities() {
    type Case = (fn(f32) -> f32, f32, f32);
    let cases: [Case; 12] = [
        (sin, 0.0, 0.0),
        (sin, -0.0, -0.0),
        (cos, 0.0, 1.0),
        (cos, -0.0, 1.0),
        (tan, 0.0, 0.0),
        (tan, -0.0, -0.0),
        (atan, 0.0, 0.0),
        (atan, -0.0, -0.0),
        (atan, 1.0, FRAC_PI_4),
        (atan, -1.0, -FRAC_PI_4),
        (atan, f32::INFINITY, FRAC_PI_2),
        (atan, f32::NEG_INFINITY, -FRAC_PI_2),
    ];
    for (i, (function, x, expected)) in cases.into_iter().enumerate() {
        let y = function(x);
        assert_eq!(y.to_bits(), expected.to_bits(), "case {i}: {y:e} at {x:e}, not {expected:e}");
    }
}

#[test]
fn every_nan_gives_nan() {
    for bits in [0x7fc0_0000, 0xffc0_0000, 0x7f80_0001, 0xff80_0001, 0x7fff_ffff, 0xffff_ffff] {
        let nan = f32::from_bits(bits);
        for function in [sin, cos, tan, atan] {
            assert!(function(nan).is_nan(), "{bits:#010x}");
        }
        for other in SPECIAL {
            assert!(atan2(nan, other).is_nan() && atan2(other, nan).is_nan(), "{bits:#010x} and {other:e}");
        }
    }
}

/// Where the reduction fails, its failure must not show as a value out of range, an infinity times zero, or a NaN.
#[test]
fn huge_arguments_stay_defined() {
    let mut random = SplitMix(6);
    for _ in 0..200_000 {
        let bits = 0x4600_0000 + random.below(0x7f80_0000 - 0x4600_0000);
        for x in [f32::from_bits(bits), -f32::from_bits(bits)] {
            assert!(sin(x).abs() <= 1.0 && cos(x).abs() <= 1.0, "{x:e} (bits {bits:#010x})");
            assert!(!tan(x).is_nan(), "{x:e} (bits {bits:#010x})");
        }
    }
}

#[test]
fn tangents_are_bounded_and_arc_tangents_shrink() {
    // Beside the poles, where the tangent is largest.
    let mut largest = 0.0f32;
    for k in (1..5216).step_by(2) {
        let pole = ((f64::from(k) * consts::FRAC_PI_2) as f32).to_bits();
        for bits in pole - 40..=pole + 40 {
            let x = f32::from_bits(bits);
            if x <= trig::TAN_REDUCED {
                largest = largest.max(tan(x).abs()).max(tan(-x).abs());
                assert!(largest <= trig::TAN_LARGEST, "{x:e}: {largest:e}");
            }
        }
    }
    assert!(largest > 0.9 * trig::TAN_LARGEST, "the bound could be lower: {largest:e}");
    each_argument(31, |x| {
        let fine = x.is_nan() || atan(x).abs() <= x.abs();
        if fine { Ok(()) } else { Err(format!("its arc tangent is {:e}", atan(x))) }
    });
}
