//! The compiler and the batch interpreter against the reference evaluator, on random and on chosen programs.

mod common;
#[path = "backends/long.rs"]
mod long;

use common::{case_set, image, same};
use image::GrayImage;
use vsonar::exec::batch::{BatchExecutor, Vectors};
use vsonar::exec::cranelift::{CraneliftExecutor, Shape};
use vsonar::exec::{ExecError, Timing};
use vsonar::ir::generate::{self, Random};
use vsonar::ir::{Program, opt, reference, text};
use vsonar::vision::CaseSet;

fn executor(shape: Shape) -> CraneliftExecutor {
    CraneliftExecutor::new(shape).expect("this machine has a back end")
}

/// Runs a program on a set of cases.
type Run = Box<dyn FnMut(&Program, &CaseSet, &mut [f32]) -> Result<Timing, ExecError>>;

/// All shapes of compiled code and all widths of the interpreter that this machine has.
fn workers() -> Vec<(String, Run)> {
    let mut all: Vec<(String, Run)> = Vec::new();
    for shape in Shape::ALL {
        let mut worker = executor(shape).cranelift_worker().expect("a worker can be made");
        all.push((format!("{shape:?}"), Box::new(move |p, c, a| worker.run(p, c, a))));
    }
    for vectors in Vectors::ALL.into_iter().filter(|v| v.is_available()) {
        let mut worker = BatchExecutor::new(vectors).expect("it is available").batch_worker();
        all.push((vectors.executor().to_string(), Box::new(move |p, c, a| worker.run(p, c, a))));
    }
    assert!(all.len() >= 3);
    all
}

/// A set of `n` cases on random images.
fn cases(seed: u64, n: usize, width: u32, height: u32) -> CaseSet {
    let random = &mut Random::new(seed);
    let images: Vec<GrayImage> = (0..3).map(|_| image(random, width, height)).collect();
    let lanes: Vec<(usize, u32)> =
        (0..n).map(|_| (random.below(3), random.below(width as usize) as u32)).collect();
    case_set(&images, &lanes)
}

/// Compares all answers with the reference's; how many there were.
fn compare(workers: &mut [(String, Run)], program: &Program, cases: &CaseSet, what: &str) -> usize {
    let expected: Vec<f32> = (0..cases.len())
        .map(|i| reference::answer(program, cases.image(i), cases.lanes()[i].column as f32))
        .collect();
    for (name, run) in workers.iter_mut() {
        let mut answers = vec![f32::from_bits(0x7fc0_dead); cases.len()];
        run(program, cases, &mut answers).unwrap_or_else(|e| panic!("{what}: {e}"));
        for (i, (&found, &expected)) in answers.iter().zip(&expected).enumerate() {
            assert!(
                same(found, expected),
                "{what}, {name}, case {i}: {found:?}, not {expected:?}\n{}",
                text::print(program)
            );
        }
    }
    cases.len() * workers.len()
}

#[test]
fn random_programs_give_the_answers_of_the_reference() {
    let workers = &mut workers();
    let sets: Vec<CaseSet> = [1, 3, 4, 5, 63, 64, 65, 128, 129, 200]
        .into_iter()
        .map(|n| cases(n as u64, n, 16 + n as u32 % 7, 16 + n as u32 % 11))
        .collect();
    let mut compared = 0;
    for seed in 0..1500 {
        let set = &sets[seed as usize % sets.len()];
        let size = [3, 10, 40, 120][seed as usize / 8 % 4];
        let raw = generate::program(seed, set.width(), set.height(), size);
        let optimised = opt::optimise(&raw);
        compared += compare(workers, &raw, set, &format!("seed {seed}, as generated"));
        compared += compare(workers, &optimised, set, &format!("seed {seed}, optimised"));
    }
    assert!(compared > 100_000, "only {compared} answers compared");
}

/// A program of one loop, for images of 40 x 30.
fn loop_2(header: &str, body: &str) -> String {
    format!("vir 1\nimage 40x30\nloop 2 {header}\n{body}")
}

/// A program whose second column, and what its second loop does, depend on the first loop.
fn dependent_columns() -> String {
    format!(
        "vir 1\nimage 40x30\nloop 1 down 2x2\n{OWN}{BREAK_BELOW_X}loop 2 up 5x5\ncolumn\n  v0 = iter2 a\n  \
         v1 = cos v0\n  v2 = const 30\n  v3 = mul v1 v2\n  result v3\nbody\n  varying\n    v0 = iter2 a\n    \
         v1 = window raw\n    v2 = read b\n    v3 = add v2 v1\n    v4 = lt v0 v3\n    v5 = y\n  next a v5\n  \
         next b v3\n  break v4\n"
    )
}

/// Sums brightness until the row passes the column's number: each lane breaks at another row.
const BREAK_BELOW_X: &str = "body\n  varying\n    v0 = y\n    v1 = x-obstacle\n    v2 = lt v1 v0\n    v3 = read a\n    \
                             v4 = window raw\n    v5 = add v3 v4\n  next a v5\n  break v2\n";

const OWN: &str = "column\n  v0 = x-obstacle\n  result v0\n";

#[test]
fn chosen_programs_give_the_answers_of_the_reference() {
    let body_down = "body\n  varying\n    v0 = y\n    v1 = const 12\n    v2 = lt v1 v0\n    v3 = window gradient\n    \
                     v4 = read a\n    v5 = add v4 v3\n  next a v5\n  break v2\n";
    let sum = "body\n  varying\n    v0 = window median-sq\n    v1 = read a\n    v2 = add v0 v1\n    v3 = first-window\n    \
               v4 = add v2 v3\n    v5 = x\n    v6 = add v4 v5\n  next a v6\n";
    let columns = [
        OWN.to_string(),
        "column\n  v0 = const nan\n  result v0\n".to_string(),
        "column\n  v0 = const 17.5\n  result v0\n".to_string(),
        "column\n  v0 = const -inf\n  result v0\n".to_string(),
        "column\n  v0 = x-obstacle\n  v1 = sin v0\n  v2 = const 20\n  v3 = mul v1 v2\n  result v3\n"
            .to_string(),
        "column\n  v0 = x-obstacle\n  v1 = const 0\n  v2 = div v1 v1\n  v3 = const 20\n  v4 = lt v0 v3\n  \
         v5 = select v4 v2 v0\n  result v5\n"
            .to_string(),
    ];
    let mut programs: Vec<String> = Vec::new();
    for direction in ["up", "down"] {
        for body in [BREAK_BELOW_X, body_down, sum] {
            for column in &columns {
                programs.push(loop_2(&format!("{direction} 3x8"), &format!("{column}{body}")));
                programs.push(loop_2(&format!("{direction} 3x8 last"), &format!("{column}{body}")));
            }
        }
    }
    programs.push(dependent_columns());

    let workers = &mut workers();
    for n in [1, 3, 4, 5, 64, 65, 128, 129, 200, 256] {
        let set = cases(100 + n as u64, n, 40, 30);
        // Of each two neighbours one finds the strips of odd columns kept from the second time on.
        set.keep_strips(if n % 2 == 0 { 8 << 20 } else { 0 });
        for source in &programs {
            let program = text::parse(source).unwrap_or_else(|e| panic!("{e}\n{source}"));
            compare(workers, &program, &set, "as written");
            compare(workers, &opt::optimise(&program), &set, "optimised");
        }
    }
}

#[test]
fn constant_answers_need_no_code_and_sizes_must_fit() {
    let program =
        text::parse(&loop_2("down 3x3", &format!("{OWN}body\n  varying\n    v0 = const 7\n  next a v0\n")))
            .expect("well formed");
    let set = cases(5, 9, 40, 30);
    for (_, run) in &mut workers() {
        let mut answers = [0.0; 9];
        let timing = run(&program, &set, &mut answers).expect("runs");
        assert_eq!(answers, [7.0; 9]);
        assert!(timing.compile.is_zero());
        let other = cases(5, 9, 41, 30);
        let error = run(&program, &other, &mut answers).expect_err("the size differs").to_string();
        assert!(error.contains("40x30") && error.contains("41x30"), "{error}");
    }
    for shape in Shape::ALL {
        let listing = vsonar::exec::cranelift::clif(&program, shape).expect("can be listed");
        assert!(listing.contains("the answer is 7"), "{listing}");
    }
}

#[test]
fn listings_show_every_entry() {
    let program = text::parse(&dependent_columns()).expect("well formed");
    for shape in Shape::ALL {
        let clif = vsonar::exec::cranelift::clif(&program, shape).expect("can be listed");
        for entry in ["; loop1", "; column2", "; loop2"] {
            assert!(clif.contains(entry) && clif.contains("function"), "{clif}");
        }
        assert!(!clif.contains("; column1"), "a column of the case's own needs no code: {clif}");
        let asm = vsonar::exec::cranelift::asm(&program, shape).expect("can be listed");
        assert!(asm.contains("; loop2") && asm.contains("ret"), "{asm}");
        assert_eq!(asm, vsonar::exec::cranelift::asm(&program, shape).expect("can be listed"));
    }
}

#[test]
fn threads_compile_and_run_at_the_same_time() {
    let set = cases(77, 45, 24, 20);
    let executors = Shape::ALL.map(executor);
    std::thread::scope(|scope| {
        for thread in 0..8u64 {
            let (set, executors) = (&set, &executors);
            scope.spawn(move || {
                let executor = &executors[thread as usize % 2];
                let mut worker = executor.cranelift_worker().expect("a worker can be made");
                let run: Run = Box::new(move |p, c, a| worker.run(p, c, a));
                let mut own = vec![(format!("{:?}", executor.shape()), run)];
                for seed in 0..150 {
                    let seed = 10_000 * (thread + 1) + seed;
                    let program = opt::optimise(&generate::program(seed, set.width(), set.height(), 30));
                    compare(&mut own, &program, set, &format!("thread {thread}, seed {seed}"));
                }
            });
        }
    });
}

#[test]
fn detectors_can_be_called_from_many_threads_and_freed() {
    use vsonar::detector::{CompiledDetector, DetectError, Detector};
    fn shared<T: Send + Sync>(_: &T) {}
    for seed in 0..60 {
        let program = opt::optimise(&generate::program(seed, 33, 29, 30));
        let detector = CompiledDetector::compile(&program).expect("compiles");
        shared(&detector);
        let picture = image(&mut Random::new(seed), 33, 29);
        let columns: Vec<u32> = (0..33).collect();
        let lanes: Vec<(usize, u32)> = columns.iter().map(|&c| (0, c)).collect();
        let set = case_set(std::slice::from_ref(&picture), &lanes);
        std::thread::scope(|scope| {
            for _ in 0..2 {
                scope.spawn(|| {
                    let mut rows = vec![0.0; columns.len()];
                    detector.detect(&picture, &columns, &mut rows).expect("sizes fit");
                    for (i, &row) in rows.iter().enumerate() {
                        let expected = reference::answer(&program, set.image(i), i as f32);
                        assert!(same(row, expected), "seed {seed}, column {i}: {row}, not {expected}");
                    }
                });
            }
        });
        let mut rows = [0.0; 2];
        assert_eq!(
            detector.detect(&GrayImage::new(34, 29), &[0, 1], &mut rows),
            Err(DetectError::ImageSize { width: 33, height: 29, image_width: 34, image_height: 29 })
        );
        assert_eq!(
            detector.detect(&picture, &[0, 33], &mut rows),
            Err(DetectError::Column { column: 33, width: 33 })
        );
        assert_eq!(
            detector.detect(&picture, &[0], &mut rows),
            Err(DetectError::Rows { columns: 1, rows: 2 })
        );
    }
}
