//! The tree walker on small programs, with results worked out by hand from the definition of the language.

use std::cell::RefCell;

use vsonar::exec::tree::{Outcome, Walk, Walker, answer};
use vsonar::ir::{Rect, WindowAt};

use super::parse;

/// Images here are 20 x 16; with 3x3, rows 1 to 14 are visited, 14 positions, and columns 1 to 18 are valid.
const WIDTH: u32 = 20;
const HEIGHT: u32 = 16;

fn walk(program: &str, windows: impl Fn(WindowAt) -> f32, x_obstacle: f32) -> Walk {
    Walker::new(&parse(program), WIDTH, HEIGHT).walk(&windows, x_obstacle)
}

/// Walks `(iterate-down 3x3 x-obstacle BODY)` alone, with 100 in every window and column 8.
fn down(body: &str) -> Outcome {
    walk(&format!("(individual (iterate-down 3x3 x-obstacle {body}))"), |_| 100.0, 8.0).second
}

/// The final register `a` of [`down`].
fn a(body: &str) -> f32 {
    down(body).registers[0]
}

/// Whether two values are the same: bits, or both NaN.
fn assert_same(found: f32, expected: f32, what: &str) {
    let same = found.to_bits() == expected.to_bits() || found.is_nan() && expected.is_nan();
    assert!(same, "{what}: {found:?} instead of {expected:?}");
}

const NAN: &str = "(- (square 1e38) (square 1e38))";
const INF: &str = "(square 1e38)";

#[test]
fn every_position_is_visited_once_in_order() {
    for (direction, expected) in [("down", (1..=14).collect::<Vec<u32>>()), ("up", (1..=14).rev().collect())]
    {
        let seen = RefCell::new(Vec::new());
        let windows = |at: WindowAt| {
            assert_eq!((at.x, at.operand.name()), (8, "raw"));
            seen.borrow_mut().push(at.y);
            0.0
        };
        let walk =
            walk(&format!("(individual (iterate-{direction} 3x3 x-obstacle (set-a raw)))"), windows, 8.0);
        assert_eq!(seen.into_inner(), expected);
        assert_eq!((walk.second.positions, walk.second.broke, walk.second.column), (14, false, 8));
    }
    for rect in Rect::all() {
        // Rows from (h - 1) / 2, so that the rectangle lies inside.
        let program = |direction| format!("(individual (iterate-{direction} {rect} x-obstacle (set-a y)))");
        let (top, height) = ((rect.height() - 1) / 2, rect.height());
        let bottom = top + HEIGHT - height;
        assert_eq!(walk(&program("up"), |_| 0.0, 8.0).answer(), top as f32, "{rect}");
        let down = walk(&program("down"), |_| 0.0, 8.0);
        assert_eq!((down.answer(), down.second.positions), (bottom as f32, HEIGHT - height + 1), "{rect}");
    }
}

#[test]
fn parameters() {
    assert_eq!(a("(set-a image-max-x)"), 19.0);
    assert_eq!(a("(set-a image-max-y)"), 15.0);
    assert_eq!(a("(set-a window-area)"), 9.0);
    assert_eq!(a("(set-a x-obstacle)"), 8.0);
    assert_eq!(a("(set-a x)"), 8.0);
    // +1 at the first position and -1 at the thirteen others.
    assert_eq!(a("(set-a (+ read-a first-window))"), -12.0);
    assert_eq!(a("(if-le first-window 0 0 (set-a y))"), 1.0);
    let up =
        walk("(individual (iterate-up 3x3 x-obstacle (if-le first-window 0 0 (set-a y))))", |_| 0.0, 8.0);
    assert_eq!(up.answer(), 14.0);
}

#[test]
fn columns_are_rounded_to_even_and_clamped() {
    let cases = [
        ("x-obstacle", 8),
        ("(+ x-obstacle 0.5)", 8),
        ("(+ x-obstacle 1.5)", 10),
        ("(+ x-obstacle 0.6)", 9),
        ("-3", 1),
        ("1e30", 18),
        (INF, 18),
        ("(- 0 (square 1e38))", 1),
        (NAN, 1),
        ("(+ image-max-x window-area)", 18),
        ("(% image-max-y 2)", 8),
    ];
    for (column, expected) in cases {
        let program = format!("(individual (iterate-down 3x3 {column} (set-a x)))");
        let windows = |at: WindowAt| at.x as f32;
        let walk = walk(&program, windows, 8.0);
        assert_eq!((walk.second.column, walk.answer()), (expected, expected as f32), "{column}");
    }
    // 8x8 covers columns x - 3 to x + 4.
    let wide =
        |column| walk(&format!("(individual (iterate-down 8x8 {column} (set-a x)))"), |_| 0.0, 8.0).answer();
    assert_eq!((wide("0"), wide("19")), (3.0, 15.0));
    // The body sees the clamped centre in `x`, and the column asked for in `x-obstacle`.
    let body = "(individual (iterate-down 3x3 (* 10 x-obstacle) (prog2 (set-a x) (set-b x-obstacle))))";
    assert_eq!(walk(body, |_| 0.0, 8.0).second.registers[..2], [18.0, 8.0]);
}

#[test]
fn registers_start_at_zero_and_carry_over() {
    assert_eq!(down("read-a").registers, [0.0; 5]);
    assert_eq!(down("(set-b (set-e (+ read-e 1)))").registers, [0.0, 14.0, 0.0, 0.0, 14.0]);
    // Bits: zero is positive.
    assert_same(a("read-c"), 0.0, "an unset register");
    assert_eq!(a("(prog2 (set-d 3) (set-a (+ (set-c 4) (+ read-c read-d))))"), 11.0);
}

#[test]
fn each_tree_has_its_own_registers() {
    let program = "(individual
        (iterate-up 3x3 x-obstacle (prog2 (set-a y) (set-b (+ read-b 1))))
        (iterate-down 2x2 (+ iter2-b 1) (set-a (+ read-b (* 100 iter2-a)))))";
    let walk = walk(program, |_| 0.0, 8.0);
    let first = walk.first.expect("two trees");
    assert_eq!(first.registers, [1.0, 14.0, 0.0, 0.0, 0.0]);
    // The second began anew: its b is 0, and its a is 100 times the first's.
    assert_eq!((walk.second.registers, walk.second.column), ([100.0, 0.0, 0.0, 0.0, 0.0], 15));
    assert_eq!(walk.second.positions, 15);
}

#[test]
fn every_register_of_the_first_tree_is_read() {
    let first =
        "(iterate-up 3x3 1 (prog2 (prog3 (set-a 1) (set-b 2) (set-c 3)) (prog2 (set-d 4) (set-e 5))))";
    for (name, value) in [("a", 1.0), ("b", 2.0), ("c", 3.0), ("d", 4.0), ("e", 5.0)] {
        let program = format!("(individual {first} (iterate-up 3x3 1 (set-a iter2-{name})))");
        assert_eq!(walk(&program, |_| 0.0, 8.0).answer(), value);
    }
}

#[test]
fn a_break_in_the_first_tree_ends_the_first_alone() {
    let program = "(individual
        (iterate-up 3x3 x-obstacle (prog2 (set-a y) break))
        (iterate-down 3x3 x-obstacle (set-a (+ iter2-a y))))";
    let walk = walk(program, |_| 0.0, 8.0);
    let first = walk.first.expect("two trees");
    assert_eq!((first.positions, first.broke, first.registers[0]), (1, true, 14.0));
    assert_eq!((walk.second.positions, walk.second.broke, walk.answer()), (14, false, 28.0));
}

#[test]
fn a_break_inside_an_argument_stops_at_once() {
    // What was stored before stays, the store around it and what comes after it do not happen.
    let ended = down("(set-a (+ (set-b 5) (* break (set-c 6))))");
    assert_eq!((ended.registers, ended.positions, ended.broke), ([0.0, 5.0, 0.0, 0.0, 0.0], 1, true));
    assert_eq!(down("(prog3 (set-a 1) break (set-b 2))").registers, [1.0, 0.0, 0.0, 0.0, 0.0]);
    assert_eq!(down("(set-a break)").registers, [0.0; 5]);
    // In the condition of a choice, neither branch runs.
    assert_eq!(down("(if-le (set-a 1) break (set-b 2) (set-c 3))").registers, [1.0, 0.0, 0.0, 0.0, 0.0]);
    assert_eq!(down("(if-le break (set-a 1) (set-b 2) (set-c 3))").registers, [0.0; 5]);
    // At the fourth row, after that row's first store.
    let later = down("(prog2 (set-b (+ read-b 1)) (if-le y 3 (set-a y) break))");
    assert_eq!((later.registers[..2].to_vec(), later.positions), (vec![3.0, 4.0], 4));
}

#[test]
fn arguments_are_evaluated_from_left_to_right() {
    // Every argument appends its digit to b: b := 10 b + digit.
    let digit = |d: u32| format!("(set-b (+ (* 10 read-b) {d}))");
    let [one, two, three, four] = [1, 2, 3, 4].map(digit);
    for function in ["+", "-", "*", "%", "atan2", "min", "max", "prog2"] {
        let body = format!("(prog2 ({function} {one} {two}) break)");
        assert_eq!(down(&body).registers[1], 12.0, "{function}");
    }
    assert_eq!(down(&format!("(prog2 (prog3 {one} {two} {three}) break)")).registers[1], 123.0);
    // Only the chosen branch of a choice runs: 1 <= 12, and (the other way) 12 <= 1.
    assert_eq!(down(&format!("(prog2 (if-le {one} {two} {three} {four}) break)")).registers[1], 123.0);
    let greater = format!("(prog2 (if-le (* 100 {one}) {two} {three} {four}) break)");
    assert_eq!(down(&greater).registers[1], 124.0);
}

#[test]
fn flow_control_has_values() {
    assert_eq!(a("(set-a (prog2 1 2))"), 2.0);
    assert_eq!(a("(set-a (prog3 1 2 3))"), 3.0);
    assert_eq!(a("(set-a (if-le 1 1 5 6))"), 5.0);
    assert_eq!(a("(set-a (if-le 2 1 5 6))"), 6.0);
    assert_eq!(a("(set-a (if-le 0 -0 5 6))"), 5.0);
    assert_eq!(a("(set-a (set-b 4))"), 4.0);
}

#[test]
fn a_nan_takes_the_else_branch() {
    assert_eq!(a(&format!("(set-a (if-le {NAN} 1 5 6))")), 6.0);
    assert_eq!(a(&format!("(set-a (if-le 1 {NAN} 5 6))")), 6.0);
    assert_eq!(a(&format!("(set-a (if-le {NAN} {NAN} 5 6))")), 6.0);
}

#[test]
fn arithmetic() {
    let cases: [(&str, f32); 22] = [
        ("(+ 0.1 0.2)", 0.1f32 + 0.2f32),
        ("(- 1 3)", -2.0),
        ("(* 3 -0.5)", -1.5),
        ("(% 1 3)", 1.0 / 3.0),
        ("(% 5 0)", 1.0),
        ("(% 5 -0)", 1.0),
        ("(% 0 -0)", 1.0),
        ("(% 0 -4)", -0.0),
        ("(% 1e-30 1e30)", 0.0),
        ("(square -3)", 9.0),
        ("(square 1e38)", f32::INFINITY),
        ("(* 1e-30 1e-10)", 1e-40),
        ("(min 2 1)", 1.0),
        ("(min 1 2)", 1.0),
        ("(max 2 1)", 2.0),
        // Equal: the second.
        ("(min 0 -0)", -0.0),
        ("(max -0 0)", 0.0),
        ("(max 0 -0)", -0.0),
        ("(- 0 0)", 0.0),
        ("(* 0 -1)", -0.0),
        ("(+ 16777216 1)", 16_777_216.0),
        // Never contracted: the product of two times 1 + 2^-12 rounds to 1 + 2^-11 before the subtraction.
        ("(- (square 1.000244140625) 1.00048828125)", 0.0),
    ];
    for (expression, expected) in cases {
        assert_same(a(&format!("(set-a {expression})")), expected, expression);
    }
    let with_nan = [
        (format!("(min {NAN} 2)"), 2.0),
        (format!("(max {NAN} 2)"), 2.0),
        (format!("(min 2 {NAN})"), f32::NAN),
        (format!("(max 2 {NAN})"), f32::NAN),
        (format!("(% {NAN} 0)"), 1.0),
        (format!("(% 1 {NAN})"), f32::NAN),
        (format!("(% 1 {INF})"), 0.0),
    ];
    for (expression, expected) in with_nan {
        assert_same(a(&format!("(set-a {expression})")), expected, &expression);
    }
}

#[test]
fn trigonometry() {
    let near = |expression: &str, expected: f64| {
        let found = f64::from(a(&format!("(set-a {expression})")));
        assert!((found - expected).abs() <= 1e-6, "{expression}: {found} instead of {expected}");
    };
    near("(sin 1)", libm::sin(1.0));
    near("(cos 1)", libm::cos(1.0));
    near("(tan 0.5)", libm::tan(0.5));
    near("(atan 2)", libm::atan(2.0));
    // The first argument is the ordinate.
    near("(atan2 1 2)", libm::atan2(1.0, 2.0));
    near("(atan2 -1 -2)", libm::atan2(-1.0, -2.0));
    near(&format!("(atan {INF})"), std::f64::consts::FRAC_PI_2);
    for zeros in ["0 0", "-0 0", "0 -0", "-0 -0"] {
        assert_same(a(&format!("(set-a (atan2 {zeros}))")), 0.0, zeros);
    }
    assert_same(a(&format!("(set-a (sin {INF}))")), f32::NAN, "sine of infinity");
}

#[test]
fn windows_are_asked_for_what_the_program_says() {
    let windows = |at: WindowAt| {
        f32::from(at.operand.index()) * 1000.0 + (at.rect.width() * 100 + at.y * 10 + at.x) as f32
    };
    let program = "(individual (iterate-up 6x3 x-obstacle (prog2 (set-a gradient-sq) break)))";
    // gradient-sq is operand 7; the first row going up is 14, and column 8 is within 2 to 16.
    assert_eq!(walk(program, windows, 8.0).answer(), 7000.0 + 600.0 + 140.0 + 8.0);
}

#[test]
fn non_finite_answers_are_what_they_are() {
    assert_same(a(&format!("(set-a {INF})")), f32::INFINITY, "an infinite answer");
    assert_same(a(&format!("(set-a {NAN})")), f32::NAN, "no number");
}

#[test]
fn the_deepest_trees_are_walked() {
    let depth = 998;
    let body = format!("{}y{}", "(+ 1 ".repeat(depth), ")".repeat(depth));
    let individual = parse(&format!("(individual (iterate-down 3x3 1 (set-a {body})))"));
    assert_eq!(individual.depth(), 1000);
    let run = move || answer(&individual, WIDTH, HEIGHT, &|_: WindowAt| 0.0, 8.0);
    // On a thread with the usual small stack.
    let found = std::thread::Builder::new().stack_size(2 << 20).spawn(run).expect("a thread").join();
    assert_eq!(found.expect("no overflow"), 14.0 + depth as f32);
}

#[test]
fn evaluated_nodes_are_counted() {
    let count = |program: &str| {
        let individual = parse(program);
        let walker = Walker::new(&individual, WIDTH, HEIGHT);
        let (walk, nodes) = walker.walk_and_count(&|_: WindowAt| 100.0, 8.0);
        assert_eq!(walk, walker.walk(&|_: WindowAt| 100.0, 8.0), "{program}");
        nodes
    };
    let down = |body: &str| format!("(iterate-down 3x3 x-obstacle {body})");
    // The column once, the body at each of 14 positions.
    assert_eq!(count(&format!("(individual {})", down("(set-a (+ raw y))"))), 1 + 4 * 14);
    assert_eq!(count("(individual (iterate-up 3x3 (* 2 3) (square 1)))"), 3 + 2 * 14);
    // Of a choice one branch: 5 nodes at rows 1 to 7, then 4.
    let choice = "(if-le y 7 (square 1) 2)";
    assert_eq!(count(&format!("(individual {})", down(choice))), 1 + 5 * 7 + 4 * 7);
    // What a break leaves out does not count, the break itself does.
    assert_eq!(count(&format!("(individual {})", down("(prog3 raw break raw)"))), 1 + 3);
    // Both trees, whether the second asks for the first or not.
    let two = format!("(individual {} {})", down("(set-a 1)"), down("(set-a iter2-a)"));
    assert_eq!(count(&two), 2 * (1 + 2 * 14));
}
