//! Our executors against the JIT of the crate `fidget` (AVX2 or NEON) on straight expressions, in one run.
//!
//! What is compared: random expression trees of 30 operators, half of their kind `+ - *` alone, the others with
//! `sin` and `cos` among them, each evaluated on 10,112 rows of eight binary32 variables, on one thread, every
//! expression compiled anew, the engines taking turns. GPop/s are operators of the tree as it was drawn, times rows,
//! by the time of execution; what an engine's optimiser saves counts for it.
//!
//! - `fidget`: building the expression in a `Context` and registers (front), `float_slice_tape` (compile), one
//!   `JitFloatSliceEval::eval` (execute), which fills the output with NaN, reads the variables' slices and writes a
//!   slice of results.
//! - Ours: lowering and optimising (front), code generation (compile), one run on 32 cases of an image that is 314
//!   pixels high (execute). The variables are window operands, so the same 40 KB a variable are read, from the same
//!   memory. A detector answers a number a case, not one a row, so the body is `a := a + EXPRESSION`: one addition a
//!   row more than counted, in a chain from row to row, and no results written.
//!
//! Addition, subtraction and multiplication give the same bits in both: the sums over the rows are held against each
//! other, and a difference ends the bench. Trigonometry does not: fidget calls the platform's `sinf` and `cosf` lane by
//! lane (correct to about 1 unit in the last place there), ours are vectorised polynomials, within 1e-6 or 4 units and
//! the same bits on every machine. Pixels are 0 to 3, so that the arguments stay small and `sinf` on its fast path.
//!
//! `cargo bench --bench fidget` prints the table. Medians over the rounds for each expression, then medians and
//! quartiles over the expressions; GPop/s are of all expressions together.

mod common;

use std::hint::black_box;
use std::time::{Duration, Instant};

use fidget::context::{BadNode, Context, Node};
use fidget::eval::{BulkEvaluator, Function, MathFunction, Tape};
use fidget::jit::{JitFloatSliceEval, JitFunction};
use fidget::var::Var;
use image::{GrayImage, Luma};
use vsonar::exec::{Candidate, Timing, Worker};
use vsonar::ir::{Operand, Rect};
use vsonar::tree::Individual;
use vsonar::vision::{CaseSet, LANES, Lane, WindowSums, strip_len};

/// Expressions of each kind.
const EXPRESSIONS: u64 = 100;
/// Operators of an expression.
const OPERATORS: usize = 30;
/// Rounds in which the engines take turns.
const ROUNDS: usize = 9;
const WIDTH: u32 = 256;
/// As high as 10,000 rows need.
const HEIGHT: u32 = 80;
/// What stands for the variables.
const VARIABLES: [&str; 8] = [
    "raw",
    "median",
    "median-corner",
    "gradient",
    "raw-sq",
    "moravec-horizontal",
    "moravec-vertical",
    "moravec-slash",
];

/// An expression over the variables.
enum Expression {
    Variable(usize),
    Unary(&'static str, Box<Expression>),
    Binary(&'static str, Box<[Expression; 2]>),
}

/// SplitMix64.
struct Random(u64);

impl Random {
    fn below(&mut self, n: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ z >> 31) % n as u64) as usize
    }
}

impl Expression {
    fn random(random: &mut Random, operators: usize, trigonometry: bool) -> Expression {
        if operators == 0 {
            return Expression::Variable(random.below(VARIABLES.len()));
        }
        let names = if trigonometry { &["+", "-", "*", "sin", "cos"][..] } else { &["+", "-", "*"] };
        let name = names[random.below(names.len())];
        if matches!(name, "sin" | "cos") {
            let argument = Expression::random(random, operators - 1, trigonometry);
            return Expression::Unary(name, Box::new(argument));
        }
        let left = random.below(operators);
        let arguments = [left, operators - 1 - left];
        let arguments = arguments.map(|n| Expression::random(random, n, trigonometry));
        Expression::Binary(name, Box::new(arguments))
    }

    /// As program text.
    fn text(&self) -> String {
        match self {
            Expression::Variable(number) => VARIABLES[*number].to_string(),
            Expression::Unary(name, a) => format!("({name} {})", a.text()),
            Expression::Binary(name, ab) => format!("({name} {} {})", ab[0].text(), ab[1].text()),
        }
    }

    /// As a node of a context.
    fn node(&self, context: &mut Context, variables: &[Var]) -> Result<Node, BadNode> {
        match self {
            Expression::Variable(number) => Ok(context.var(variables[*number])),
            Expression::Unary(name, a) => {
                let a = a.node(context, variables)?;
                if *name == "sin" { context.sin(a) } else { context.cos(a) }
            }
            Expression::Binary(name, ab) => {
                let (a, b) = (ab[0].node(context, variables)?, ab[1].node(context, variables)?);
                match *name {
                    "+" => context.add(a, b),
                    "-" => context.sub(a, b),
                    _ => context.mul(a, b),
                }
            }
        }
    }
}

/// Cases on one small-valued noise image, a group of them.
fn cases() -> CaseSet {
    let mut random = Random(1);
    let image = GrayImage::from_fn(WIDTH, HEIGHT, |_, _| Luma([random.below(4) as u8]));
    let lanes = (0..LANES as u32).map(|l| Lane { image: 0, column: 5 + l }).collect();
    CaseSet::new(vec![WindowSums::new(&image).into()], lanes).expect("columns inside")
}

/// fidget's side: the evaluator, its variables and their rows.
struct Fidget<'a> {
    evaluator: JitFloatSliceEval,
    variables: Vec<Var>,
    rows: Vec<&'a [f32]>,
}

impl Fidget<'_> {
    /// Times of an expression, and the sum over the rows of each lane.
    fn run(&mut self, expression: &Expression) -> (Timing, [f32; LANES]) {
        let start = Instant::now();
        let mut context = Context::new();
        let node = expression.node(&mut context, &self.variables).expect("nodes of this context");
        let function = JitFunction::new(&context, &[node]).expect("a node of this context");
        let lower = start.elapsed();
        let start = Instant::now();
        let tape = function.float_slice_tape(Default::default());
        let compile = start.elapsed();
        // It numbers the variables as it meets them.
        let mut rows = vec![self.rows[0]; tape.vars().len()];
        for (variable, &values) in self.variables.iter().zip(&self.rows) {
            if let Some(index) = tape.vars().get(variable) {
                rows[index] = values;
            }
        }
        let start = Instant::now();
        let output = self.evaluator.eval(&tape, &rows).expect("a slice for every variable");
        let execute = start.elapsed();
        let mut sums = [0.0; LANES];
        for row in output[0].chunks_exact(LANES) {
            sums.iter_mut().zip(row).for_each(|(sum, value)| *sum += value);
        }
        (Timing { lower, compile, execute }, black_box(sums))
    }
}

fn same(a: &[f32], b: &[f32]) -> bool {
    a.iter().zip(b).all(|(a, b)| a.to_bits() == b.to_bits() || a.is_nan() && b.is_nan())
}

/// First quartile, median and third quartile.
fn quartiles(mut values: Vec<Duration>) -> [Duration; 3] {
    values.sort_unstable();
    [1, 2, 3].map(|quarter| values[(values.len() - 1) * quarter / 4])
}

fn compare(title: &str, trigonometry: bool, rounds: usize, cases: &CaseSet) {
    let rect = Rect::new(2, 2).expect("in the list");
    let len = strip_len(rect, HEIGHT);
    let arena = cases.x_obstacle_arena(rect, 0);
    let strip = |name: &&str| {
        let operand = Operand::from_name(name).expect("an operand");
        &arena[usize::from(operand.index()) * len..][..len]
    };
    let mut fidget = Fidget {
        evaluator: JitFloatSliceEval::default(),
        variables: VARIABLES.iter().map(|_| Var::new()).collect(),
        rows: VARIABLES.iter().map(strip).collect(),
    };
    let executors = common::fast();
    let mut workers: Vec<Box<dyn Worker>> =
        executors.iter().map(|e| e.worker().expect("a worker can be made")).collect();
    let expressions: Vec<Expression> =
        (0..EXPRESSIONS).map(|n| Expression::random(&mut Random(n), OPERATORS, trigonometry)).collect();
    let individuals: Vec<Individual> = expressions
        .iter()
        .map(|e| format!("(individual (iterate-down 2x2 x-obstacle (set-a (+ read-a {}))))", e.text()))
        .map(|text| text.parse().expect("a program"))
        .collect();

    // By engine, expression and round; the first round is not counted.
    let mut times = vec![vec![Vec::<Timing>::new(); expressions.len()]; 1 + workers.len()];
    for round in 0..=rounds {
        for (number, (expression, individual)) in expressions.iter().zip(&individuals).enumerate() {
            let (timing, sums) = fidget.run(expression);
            let mut all = vec![timing];
            for (executor, worker) in executors.iter().zip(&mut workers) {
                let candidate = Candidate::new(individual, WIDTH, HEIGHT);
                let mut answers = [0.0; LANES];
                all.push(worker.answers(&candidate, cases, &mut answers).expect("it compiles"));
                assert!(trigonometry || same(&answers, &sums), "{} and fidget differ", executor.name());
                black_box(answers);
            }
            if round > 0 {
                times.iter_mut().zip(all).for_each(|(times, timing)| times[number].push(timing));
            }
        }
    }

    println!("\n{title}: {EXPRESSIONS} expressions of {OPERATORS} operators, {len} rows, {rounds} rounds");
    println!("  engine             GPop/s   front        compile      execute (µs: median and quartiles)");
    let names = std::iter::once("fidget").chain(executors.iter().map(|e| e.name()));
    for (name, times) in names.zip(&times) {
        let of = |part: fn(&Timing) -> Duration| -> Vec<Duration> {
            times.iter().map(|rounds| quartiles(rounds.iter().map(part).collect())[1]).collect()
        };
        let execute = of(|t| t.execute);
        let total: Duration = execute.iter().sum();
        let gpops = (EXPRESSIONS as usize * OPERATORS * len) as f64 / total.as_secs_f64() / 1e9;
        let text = |values: Vec<Duration>| {
            let [q1, median, q3] = quartiles(values).map(|d| d.as_secs_f64() * 1e6);
            format!("{median:.1} [{q1:.1}, {q3:.1}]")
        };
        let (front, compile) = (text(of(|t| t.lower)), text(of(|t| t.compile)));
        println!("  {name:<17} {gpops:7.2}   {front:<20} {compile:<20} {}", text(execute));
    }
}

fn main() {
    #[cfg(target_arch = "x86_64")]
    if !std::arch::is_x86_feature_detected!("avx2") {
        println!("fidget's code needs AVX2, which this processor has not");
        return;
    }
    // As criterion's benches do, run everything once if this is a test.
    let rounds = if std::env::args().any(|argument| argument == "--test") { 1 } else { ROUNDS };
    let cases = cases();
    compare("+ - *", false, rounds, &cases);
    compare("+ - * sin cos", true, rounds, &cases);
}
