//! Long programs: compiled they keep their bits, the time to compile them grows as they do, and what is too long is
//! interpreted.

use vsonar::detector::{CompiledDetector, Detector, InterpretedDetector, ProgramDetector};
use vsonar::exec::auto::AutoExecutor;
use vsonar::exec::cranelift::Shape;
use vsonar::exec::{Candidate, ExecError, Executor, MAX_COMPILED};
use vsonar::ir::builder::LoopParts;
use vsonar::ir::generate::{self, Random};
use vsonar::ir::{Builder, Direction, Leaf, Op, Operand, Program, Rect, Reg, Span, opt, reference};
use vsonar::lower::lower;
use vsonar::tree::Individual;
use vsonar::vision::CaseSet;

use crate::common::{self, case_set, image, same};

/// A tree of programs in a row, so that it is not deep.
fn in_a_row(count: usize, one: &mut dyn FnMut() -> String) -> String {
    match count {
        0 | 1 => one(),
        _ => {
            let first = in_a_row(count / 2, one);
            format!("(prog2 {first} {})", in_a_row(count - count / 2, one))
        }
    }
}

fn operand(random: &mut Random) -> &'static str {
    let all: Vec<Operand> = Operand::all().collect();
    random.pick(&all).name()
}

fn register(random: &mut Random) -> char {
    random.pick(&['a', 'b', 'c', 'd', 'e'])
}

/// A constant in tenths.
fn number(random: &mut Random) -> String {
    format!("{:.1}", random.below(2000) as f32 / 10.0 - 100.0)
}

/// Kinds of long bodies: what lives long in them differs.
const KINDS: [&str; 4] = ["sums", "choices", "statements", "waves"];

/// The body of an individual with about `count` terms.
fn body(kind: &str, count: usize, random: &mut Random) -> String {
    match kind {
        // Many constants, few other values.
        "sums" => {
            fn sum(count: usize, random: &mut Random) -> String {
                if count <= 1 {
                    return format!("(* {} {})", operand(random), number(random));
                }
                let first = sum(count / 2, random);
                format!("(+ {first} {})", sum(count - count / 2, random))
            }
            format!("(set-a (+ (* 0.5 read-a) {}))", sum(count, random))
        }
        // Every branch has its own registers, and conditions that all branches below depend on.
        "choices" => {
            if count <= 1 {
                let (to, from) = (register(random), register(random));
                return format!("(set-{to} (+ read-{from} {}))", number(random));
            }
            // Products of their own, so that no choice is decided by those around it.
            let mut product = || format!("(* {} {})", operand(random), number(random));
            let condition = format!("{} {}", product(), product());
            let then = body(kind, count / 2, random);
            format!("(if-le {condition} {then} {})", body(kind, count - count / 2, random))
        }
        // A row of assignments, some of which end the loop.
        "statements" => in_a_row(count, &mut || {
            let (to, from) = (register(random), register(random));
            let value = format!("(% (- read-{from} {}) {})", operand(random), number(random));
            match random.below(40) {
                0 => format!("(if-le {value} -5000 break (set-{to} {value}))"),
                1..10 => format!("(if-le {} y (set-{to} {value}) read-a)", operand(random)),
                _ => format!("(set-{to} (max {value} (min x {})))", number(random)),
            }
        }),
        // Formulas that are long by themselves.
        _ => in_a_row(count / 3, &mut || {
            let (to, from) = (register(random), register(random));
            let wave = format!("(sin (* {} {}))", operand(random), number(random));
            format!("(set-{to} (+ read-{to} (+ {wave} (atan2 read-{from} x-obstacle))))")
        }),
    }
}

/// A long individual of this kind, always the same.
fn individual(kind: &str, count: usize, seed: u64) -> Individual {
    let random = &mut Random::new(seed);
    let first = body(kind, count / 4, random);
    let second = body(kind, count, random);
    let text = format!(
        "(individual (iterate-up 3x3 x-obstacle {first})\n (iterate-down 4x4 (+ x-obstacle iter2-a) (prog2 (set-e (+ \
         read-e iter2-b)) {second})))"
    );
    text.parse().unwrap_or_else(|fault| panic!("{kind}, seed {seed}: {fault}"))
}

fn program(kind: &str, count: usize, seed: u64) -> Program {
    opt::optimise(&lower(&individual(kind, count, seed), 40, 24))
}

fn cases(seed: u64) -> CaseSet {
    let random = &mut Random::new(seed);
    let images = [image(random, 40, 24), image(random, 40, 24)];
    let lanes: Vec<(usize, u32)> = (0..9).map(|i| (i % 2, random.below(40) as u32)).collect();
    case_set(&images, &lanes)
}

/// Compares a detector with the reference.
fn check(detector: &dyn Detector, program: &Program, what: &str) {
    let picture = image(&mut Random::new(5), program.width(), program.height());
    let columns: Vec<u32> = (0..program.width()).step_by(7).collect();
    let mut rows = vec![0.0; columns.len()];
    detector.detect(&picture, &columns, &mut rows).expect("sizes fit");
    let set = case_set(std::slice::from_ref(&picture), &[(0, 0)]);
    for (&column, &row) in columns.iter().zip(&rows) {
        let expected = reference::answer(program, set.image(0), column as f32);
        assert!(same(row, expected), "{what}, column {column}: {row:e}, not {expected:e}");
    }
}

#[test]
fn long_individuals_have_the_walker_s_bits_on_every_executor() {
    let executors = common::executors();
    for (seed, kind) in KINDS.into_iter().enumerate() {
        let (seed, set) = (seed as u64, cases(seed as u64));
        let individual = individual(kind, 2_500, seed);
        let program = opt::optimise(&lower(&individual, 40, 24));
        assert!(program.len() > 1_500, "{kind}: {} instructions are not long", program.len());
        let judged = common::answers(executors[0].as_ref(), &individual, &set);
        for executor in &executors[1..] {
            let found = common::answers(executor.as_ref(), &individual, &set);
            for (i, (a, b)) in judged.iter().zip(&found).enumerate() {
                assert!(same(*a, *b), "{kind}, seed {seed}, {}, case {i}: {b:e}, not {a:e}", executor.name());
            }
        }
        check(&CompiledDetector::compile(&program).expect("compiles"), &program, kind);
        check(&InterpretedDetector::new(&program), &program, kind);
    }
}

/// Random operands make values live long, masks and integers among them, in every region.
#[test]
fn long_random_programs_have_the_reference_s_bits() {
    let set = cases(77);
    let mut long = 0;
    for seed in 0..64 {
        let program = generate::program(seed, 40, 24, 5_000);
        let mut regions = program.clone();
        opt::Pass::Order.run(&mut regions);
        for program in [program, regions] {
            if program.len() < 1_500 || long == 20 {
                continue;
            }
            long += 1;
            super::compare(&mut super::workers(), &program, &set, &format!("seed {seed}"));
            let detector = CompiledDetector::compile(&program).expect("compiles");
            check(&detector, &program, &format!("seed {seed}"));
        }
    }
    assert_eq!(long, 20, "programs that are long");
}

/// Processor time of this thread, in seconds, whatever else the machine does.
#[cfg(unix)]
fn processor_time() -> f64 {
    let mut time = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    // SAFETY: the call writes one `timespec`.
    let done = unsafe { libc::clock_gettime(libc::CLOCK_THREAD_CPUTIME_ID, &raw mut time) };
    assert_eq!(done, 0, "the system has clocks of threads");
    time.tv_sec as f64 + time.tv_nsec as f64 / 1e9
}

/// Four times the program may take up to eight times as long, and not sixteen, as it is where time goes by the square.
#[cfg(unix)]
#[test]
fn the_time_to_compile_grows_as_the_program() {
    let mut worker = super::executor(Shape::Lanes4).cranelift_worker().expect("a worker can be made");
    let set = cases(1);
    for kind in ["sums", "choices"] {
        let mut time = |count: usize, detector: bool| {
            let program = program(kind, count, 9);
            let start = processor_time();
            if detector {
                CompiledDetector::compile(&program).expect("compiles");
            } else {
                worker.run(&program, &set, &mut vec![0.0; set.len()]).expect("runs");
            }
            ((processor_time() - start) / program.len() as f64, program.len())
        };
        for detector in [true, false] {
            let (short, long) = (time(600, detector), time(2_400, detector));
            assert!(long.1 > 3 * short.1, "{kind}: {} and {} instructions", short.1, long.1);
            assert!(long.0 < 2.0 * short.0, "{kind}: {short:?}, then {long:?} seconds an instruction");
        }
    }
}

/// A program of a second loop alone, whose answer is the last register.
fn of_body(body: Builder, answer: Reg) -> Program {
    let mut column = Builder::new();
    let own = column.leaf(Leaf::XObstacle);
    let parts = LoopParts {
        direction: Direction::Down,
        rect: Rect::new(3, 3).expect("in the list"),
        span: Span::All,
        column: column.finish(),
        column_result: own,
        body: body.finish(),
        invariant: 0,
        uniform: 0,
        next: [Some(answer), None, None, None, None],
        break_if: None,
    };
    Program::new(16, 16, None, parts).expect("well formed")
}

/// Registers of row and window, then `count` sums; each is the last one and the row where `chained`, else all of them
/// wait for the end.
fn sums(count: usize, chained: bool) -> Program {
    let mut b = Builder::new();
    let add = |b: &mut Builder, x, y| b.push(Op::Add, &[x, y]).expect("well typed");
    let (y, window) = (b.leaf(Leaf::Y), b.leaf(Leaf::Window(Operand::all().next().expect("there are some"))));
    let mut last = window;
    let mut waiting = Vec::new();
    for i in 0..count {
        last = if chained {
            add(&mut b, last, y)
        } else {
            let constant = b.leaf(Leaf::Const(i as f32));
            waiting.push(b.push(Op::Mul, &[window, constant]).expect("well typed"));
            window
        };
    }
    for one in waiting {
        last = add(&mut b, last, one);
    }
    of_body(b, last)
}

#[test]
fn what_is_too_long_is_interpreted() {
    let program = sums(MAX_COMPILED, true);
    let refused = |error: ExecError| {
        assert!(
            matches!(error, ExecError::TooLong { instructions } if instructions == program.len()),
            "{error}"
        );
    };
    refused(CompiledDetector::compile(&program).expect_err("too long"));
    let set = case_set(&[image(&mut Random::new(1), 16, 16)], &[(0, 3)]);
    let mut worker = super::executor(Shape::Lanes4).cranelift_worker().expect("a worker can be made");
    refused(worker.run(&program, &set, &mut [0.0]).expect_err("too long"));
    let detector = ProgramDetector::new(&program);
    refused(CompiledDetector::compile(&program).expect_err("too long"));
    assert!(detector.why_interpreted().is_some_and(|why| why.to_string().contains("200000")));
    check(&detector, &program, "a chain");
}

#[test]
fn what_takes_too_much_stack_is_interpreted() {
    let program = sums(40_000, false);
    let detector = ProgramDetector::new(&program);
    let why = detector.why_interpreted().expect("640 KB of values wait at the same time").to_string();
    assert!(why.contains("bytes of stack"), "{why}");
    check(&detector, &program, "many values");
    let set = case_set(&[image(&mut Random::new(1), 16, 16)], &[(0, 3)]);
    let mut worker = super::executor(Shape::Lanes4).cranelift_worker().expect("a worker can be made");
    assert!(matches!(worker.run(&program, &set, &mut [0.0]), Err(ExecError::Compile(_))));
}

/// The executor that chooses takes what the compiler would take too long for to the interpreter, the first time too.
#[test]
fn auto_does_not_compile_what_it_would_wait_for() {
    let executor = AutoExecutor::new();
    let individual = individual("choices", 5_000, 3);
    let set = cases(3);
    let candidate = Candidate::new(&individual, set.width(), set.height());
    let mut worker = executor.worker().expect("a worker can be made");
    for _ in 0..4 {
        let timing = worker.answers(&candidate, &set, &mut vec![0.0; set.len()]).expect("runs");
        assert_eq!(timing.compile, std::time::Duration::ZERO);
    }
    assert_eq!(executor.choices().jit, 0, "{:?}", executor.choices());
}
