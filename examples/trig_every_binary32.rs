//! Holds sine, cosine, tangent and arc tangent against binary64 references, on every binary32 there is.
//!
//! ```text
//! cargo run --release --example trig_every_binary32 [-- --stride N]
//! ```
//!
//! prints a table (the arguments of the largest errors in parentheses) and ends with status 1 if the contract of `vsonar_ir::formula::trig` is broken anywhere. With
//! `--stride N` it visits only every N-th bit pattern. A whole run takes minutes; the stated result is in that
//! module's documentation.

use std::process::ExitCode;

use rayon::prelude::*;
use vsonar_ir::formula::trig;
use vsonar_ir::machine::Scalar;

/// The magnitudes up to which the periodic functions promise their accuracy.
const DOMAIN: f64 = 8192.0;
/// Bit patterns of the positive binary32 numbers, infinity and the positive NaNs.
const PATTERNS: u32 = 1 << 31;
/// Patterns a task.
const CHUNK: u32 = 1 << 18;

/// A formula under test and what it promises.
struct Subject {
    name: &'static str,
    formula: fn(f32) -> f32,
    reference: fn(f64) -> f64,
    /// f(-x) is f(x), else -f(x).
    even: bool,
    /// Largest magnitude of an argument with a promised accuracy.
    domain: f64,
    /// Largest magnitude of a true value with a promised accuracy.
    accurate: f64,
    /// Largest magnitude of any result.
    range: f32,
    /// The result for positive infinity; `None` for NaN.
    infinity: Option<f32>,
}

const SUBJECTS: [Subject; 4] = [
    Subject {
        name: "sin",
        formula: |x| trig::sin(&mut Scalar, x),
        reference: libm::sin,
        even: false,
        domain: DOMAIN,
        accurate: 1.0,
        range: 1.0,
        infinity: None,
    },
    Subject {
        name: "cos",
        formula: |x| trig::cos(&mut Scalar, x),
        reference: libm::cos,
        even: true,
        domain: DOMAIN,
        accurate: 1.0,
        range: 1.0,
        infinity: None,
    },
    Subject {
        name: "tan",
        formula: |x| trig::tan(&mut Scalar, x),
        reference: libm::tan,
        even: false,
        domain: DOMAIN,
        accurate: trig::TAN_ACCURATE as f64,
        range: f32::INFINITY,
        infinity: None,
    },
    Subject {
        name: "atan",
        formula: |x| trig::atan(&mut Scalar, x),
        reference: libm::atan,
        even: false,
        domain: f64::INFINITY,
        accurate: 2.0,
        range: std::f32::consts::FRAC_PI_2,
        infinity: Some(std::f32::consts::FRAC_PI_2),
    },
];

/// A measure's largest value and the argument where it is reached first.
#[derive(Clone, Copy, Default)]
struct Worst {
    value: f64,
    at: f32,
}

impl Worst {
    fn see(&mut self, value: f64, at: f32) {
        if value > self.value {
            *self = Worst { value, at };
        }
    }
}

/// What one pass over the arguments found.
#[derive(Clone, Copy, Default)]
struct Tally {
    /// Arguments visited.
    visited: u64,
    /// Arguments held to the promised accuracy.
    judged: u64,
    /// Absolute error.
    absolute: Worst,
    /// Error in units of the last place of the true value, where 4 of them are more than 1e-6 (and so decide).
    ulps: Worst,
    /// Error as a share of what is allowed, max(4 ulp, 1e-6).
    share: Worst,
    /// Magnitude of the result.
    largest: Worst,
    /// Results that break the contract, and the first argument with one.
    broken: u64,
    first_broken: Option<f32>,
}

impl Tally {
    fn merge(mut self, other: Tally) -> Tally {
        self.visited += other.visited;
        self.judged += other.judged;
        self.absolute.see(other.absolute.value, other.absolute.at);
        self.ulps.see(other.ulps.value, other.ulps.at);
        self.share.see(other.share.value, other.share.at);
        self.largest.see(other.largest.value, other.largest.at);
        self.broken += other.broken;
        self.first_broken = self.first_broken.or(other.first_broken);
        self
    }

    /// Judges the formula at `x`, which has a positive sign, and at `-x`.
    fn visit(&mut self, subject: &Subject, x: f32) {
        let (y, mirrored) = ((subject.formula)(x), (subject.formula)(-x));
        self.visited += 2;
        let reflected = if subject.even { y } else { -y };
        let mut good = true;
        if x.is_finite() {
            good &= y.abs() <= subject.range && mirrored.abs() <= subject.range;
            self.largest.see(f64::from(y.abs().max(mirrored.abs())), x);
            if f64::from(x) <= subject.domain {
                // Exact symmetry carries the judgement over to the negative argument.
                good &= mirrored.to_bits() == reflected.to_bits() && self.measure(subject, x, y);
            }
        } else if let (Some(value), false) = (subject.infinity, x.is_nan()) {
            good &= y == value && mirrored == reflected;
        } else {
            good &= y.is_nan() && mirrored.is_nan();
        }
        if !good {
            self.broken += 1;
            self.first_broken = self.first_broken.or(Some(x));
        }
    }

    /// Records the error of `y` at `x`; whether it is allowed.
    fn measure(&mut self, subject: &Subject, x: f32, y: f32) -> bool {
        let truth = (subject.reference)(f64::from(x));
        if truth.abs() > subject.accurate {
            return true;
        }
        self.judged += 2;
        let error = (f64::from(y) - truth).abs();
        let ulp = ulp(truth);
        let allowed = (4.0 * ulp).max(1e-6);
        self.absolute.see(error, x);
        self.share.see(error / allowed, x);
        if allowed > 1e-6 {
            self.ulps.see(error / ulp, x);
        }
        error <= allowed
    }
}

/// The distance of neighbouring binary32 numbers at `value`.
fn ulp(value: f64) -> f64 {
    let exponent = ((value.to_bits() >> 52) & 0x7ff) as i32 - 1023;
    libm::ldexp(1.0, exponent.max(-126) - 23)
}

fn tally(subject: &Subject, stride: u32) -> Tally {
    (0..PATTERNS / CHUNK)
        .into_par_iter()
        .map(|chunk| {
            let mut tally = Tally::default();
            let start = (chunk * CHUNK).next_multiple_of(stride);
            for bits in (start..(chunk + 1) * CHUNK).step_by(stride as usize) {
                tally.visit(subject, f32::from_bits(bits));
            }
            tally
        })
        // In index order, so that the same arguments are named at any number of threads.
        .collect::<Vec<_>>()
        .into_iter()
        .fold(Tally::default(), Tally::merge)
}

fn stride(mut arguments: impl Iterator<Item = String>) -> Result<u32, String> {
    match (arguments.next().as_deref(), arguments.next(), arguments.next()) {
        (None, _, _) => Ok(1),
        (Some("--stride"), Some(value), None) => match value.parse() {
            Ok(stride @ 1..=CHUNK) => Ok(stride),
            _ => Err(format!("--stride takes a number from 1 to {CHUNK}, not `{value}`")),
        },
        _ => Err("usage: trig_every_binary32 [--stride N]".to_owned()),
    }
}

fn main() -> ExitCode {
    let stride = match stride(std::env::args().skip(1)) {
        Ok(stride) => stride,
        Err(message) => {
            eprintln!("{message}");
            return ExitCode::from(2);
        }
    };
    println!(
        "{:<4} {:>10} {:>10}  {:<24} {:<20} {:<21} {:<26} {:>6}",
        "", "visited", "judged", "absolute error", "in ulp", "of allowed", "largest result", "broken"
    );
    let mut broken = 0;
    for subject in &SUBJECTS {
        let t = tally(subject, stride);
        println!(
            "{:<4} {:>10} {:>10}  {:.3e} ({:<12e}) {:>5.2} ({:<12e}) {:>6.3} ({:<12e}) {:<11.9} ({:<12e}) {:>6}",
            subject.name,
            t.visited,
            t.judged,
            t.absolute.value,
            t.absolute.at,
            t.ulps.value,
            t.ulps.at,
            t.share.value,
            t.share.at,
            t.largest.value,
            t.largest.at,
            t.broken,
        );
        if let Some(x) = t.first_broken {
            println!("     first broken at ±{x:e} (bits {:#010x})", x.to_bits());
        }
        broken += t.broken;
    }
    if broken == 0 { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}
