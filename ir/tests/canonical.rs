//! Programs that differ in nothing but how they are written come out of the optimiser equal, and what the passes
//! claim to find is found.

use vsonar_ir::builder::LoopParts;
use vsonar_ir::generate::{self, Random};
use vsonar_ir::opt::{self, Optimiser};
use vsonar_ir::{Block, Builder, Leaf, Loop, Op, Program, Reg, text};

const WIDTH: u32 = 40;
const HEIGHT: u32 = 24;

/// The block's instructions in another order, commutative operands exchanged at random, carried registers and
/// those of the first loop renamed; where each register is.
fn shuffle(random: &mut Random, block: &Block, reads: [u8; 5], iter2: [u8; 5]) -> (Block, Vec<Reg>) {
    let mut b = Builder::new();
    let mut map: Vec<Option<Reg>> = vec![None; block.len()];
    let mut left: Vec<Reg> = block.iter().map(|(reg, _)| reg).collect();
    while !left.is_empty() {
        let i = random.below(left.len());
        let inst = block.inst(left[i]);
        let args: Option<Vec<Reg>> = inst.args().iter().map(|arg| map[arg.index()]).collect();
        let Some(mut args) = args else { continue };
        if inst.op().is_commutative() && random.one_in(2) {
            args.swap(0, 1);
        }
        let reg = match inst.leaf() {
            Some(Leaf::Read(k)) => b.leaf(Leaf::Read(reads[k as usize])),
            Some(Leaf::Iter2(k)) => b.leaf(Leaf::Iter2(iter2[k as usize])),
            Some(leaf) => b.leaf(leaf),
            None => b.push_imm(inst.op(), &args, inst.imm()).expect("as it was"),
        };
        map[left.swap_remove(i).index()] = Some(reg);
    }
    (b.finish(), map.into_iter().map(|reg| reg.expect("all are placed")).collect())
}

/// A random order of 0 to 4 with the first `fixed` in their places.
fn permutation(random: &mut Random, fixed: usize) -> [u8; 5] {
    let mut out = [0, 1, 2, 3, 4];
    for i in fixed..5 {
        out.swap(i, i + random.below(5 - i));
    }
    out
}

fn shuffled_loop(random: &mut Random, l: &Loop, reads: [u8; 5], iter2: [u8; 5]) -> LoopParts {
    let (column, of_column) = shuffle(random, l.column().block(), reads, iter2);
    let (body, of_body) = shuffle(random, l.body(), reads, iter2);
    let mut next = [None; 5];
    for (k, reg) in l.next().iter().enumerate() {
        next[reads[k] as usize] = reg.map(|reg| of_body[reg.index()]);
    }
    LoopParts {
        column,
        column_result: of_column[l.column().result().index()],
        body,
        invariant: 0,
        uniform: 0,
        next,
        break_if: l.break_if().map(|reg| of_body[reg.index()]),
        ..LoopParts::from(l)
    }
}

#[test]
fn the_way_a_program_is_written_does_not_matter() {
    let (mut equal, mut different) = (0, 0);
    for seed in 0..5000 {
        let program = opt::optimise(&generate::program(seed, WIDTH, HEIGHT, 8 + (seed % 40) as usize));
        let random = &mut Random::new(seed);
        let iter2 = permutation(random, 0);
        let first = program.first().map(|l| shuffled_loop(random, l, iter2, iter2));
        // Register a of the second loop is the answer.
        let reads = permutation(random, 1);
        let second = shuffled_loop(random, program.second(), reads, iter2);
        let shuffled = Program::new(WIDTH, HEIGHT, first, second).expect("well formed");
        let mut ordered = shuffled.clone();
        opt::Pass::Order.run(&mut ordered);
        assert_eq!(ordered, program, "seed {seed}\n{program}\n{shuffled}\n{ordered}");
        // The other passes work in the order they find.
        if opt::optimise(&shuffled) == program { equal += 1 } else { different += 1 }
    }
    assert!(different * 200 < equal, "{different} of {} programs depend on their order", equal + different);
}

#[test]
fn carried_registers_are_told_apart_by_what_they_are_set_to() {
    let of = |first: &str, second: &str| {
        let body = format!(
            "    v0 = read {first}\n    v1 = read {second}\n    v2 = mul v0 v1\n    v3 = window raw\n    v4 = window median\n  next a v2\n  next b v3\n  next c v4\n"
        );
        optimised("down 3x3", OWN, &body)
    };
    assert_eq!(of("b", "c"), of("c", "b"));
    assert_ne!(of("b", "c"), of("b", "b"));
}

#[test]
fn an_optimiser_remembers_nothing_that_matters() {
    let mut kept = Optimiser::default();
    for seed in 0..3000 {
        let program = generate::program(seed, WIDTH, HEIGHT, 8 + (seed % 60) as usize);
        assert_eq!(kept.optimise(program.clone()), opt::optimise(&program), "seed {seed}");
        assert!(kept.live_operations() <= program.operations());
    }
}

/// The optimised form of a second loop's text.
fn optimised(header: &str, column: &str, body: &str) -> Program {
    let source = format!("vir 1\nimage 40x24\nloop 2 {header}\ncolumn\n{column}body\n  varying\n{body}");
    opt::optimise(&text::parse(&source).unwrap_or_else(|e| panic!("{e}\n{source}")))
}

const OWN: &str = "  v0 = x-obstacle\n  result v0\n";

fn ops(program: &Program) -> Vec<Op> {
    program.second().body().insts().iter().map(|inst| inst.op()).collect()
}

#[test]
fn ranges_of_leaves_decide() {
    // A brightness is at most 255, and at least 1/9 where it is not zero.
    let body = "    v0 = window raw\n    v1 = const 255\n    v2 = min v0 v1\n    v3 = const -1\n    v4 = max v2 v3\n  next a v4\n";
    assert_eq!(ops(&optimised("down 3x3", OWN, body)), [Op::Window]);
    let body = "    v0 = window raw\n    v1 = const 1000\n    v2 = le v0 v1\n    v3 = y\n    v4 = select v2 v0 v3\n  next a v4\n";
    assert_eq!(ops(&optimised("down 3x3", OWN, body)), [Op::Window]);
    let body =
        "    v0 = window raw\n    v1 = const 1\n    v2 = add v0 v1\n    v3 = pdiv v0 v2\n  next a v3\n";
    assert!(ops(&optimised("down 3x3", OWN, body)).contains(&Op::Div));
    // The quotient is finite, so its sine is a number, and nothing times a number is a zero.
    let body = "    v0 = window gradient-sq\n    v1 = window raw\n    v2 = pdiv v0 v1\n    v3 = sin v2\n    v4 = const 0\n    v5 = mul v3 v4\n    v6 = le v5 v0\n    v7 = const 7\n    v8 = select v6 v7 v1\n  next a v8\n";
    assert_eq!(optimised("down 3x3", OWN, body).constant_answer(), Some(7.0));
    // The last row is number 22, the first number 1.
    let body = "    v0 = y\n    v1 = const 22\n    v2 = lt v1 v0\n    v3 = const 0\n    v4 = lt v0 v3\n    v5 = or v2 v4\n    v6 = window raw\n    v7 = select v5 v0 v6\n  next a v7\n";
    assert_eq!(ops(&optimised("down 3x3", OWN, body)), [Op::Window]);
}

#[test]
fn ranges_of_carried_registers_decide() {
    // Counts up from 0: never below, and so never broken off; what is counted without end has no upper bound.
    let counter =
        "    v0 = read a\n    v1 = const 1\n    v2 = add v0 v1\n    v3 = const 0\n    v4 = lt v2 v3\n";
    let program = optimised("down 3x3", OWN, &format!("{counter}  next a v2\n  break v4\n"));
    assert!(program.second().break_if().is_none() && ops(&program).contains(&Op::Add));
    let body = "    v0 = read a\n    v1 = const 300\n    v2 = lt v1 v0\n    v3 = window raw\n    v4 = read b\n    v5 = select v2 v4 v3\n  next a v5\n  next b v3\n";
    assert_eq!(ops(&optimised("down 3x3", OWN, body)), [Op::Window], "a is one brightness after the other");
    // What is sine of itself stays 0.
    let body = "    v0 = read b\n    v1 = sin v0\n    v2 = window raw\n    v3 = add v1 v2\n  next a v3\n  next b v1\n";
    assert_eq!(ops(&optimised("down 3x3", OWN, body)), [Op::Window]);
}

#[test]
fn loops_that_run_once_become_the_last_position_of_the_other_direction() {
    let body = "    v0 = first-window\n    v1 = read a\n    v2 = le v1 v0\n    v3 = window raw\n    v4 = add v1 v3\n  next a v4\n  break v2\n";
    let program = optimised("up 3x3", OWN, body);
    let expected = "vir 1\nimage 40x24\nloop 2 down 3x3 last\ncolumn\n  v0 = x-obstacle\n  result v0\nbody\n  varying\n    v0 = window raw\n  next a v0\n";
    assert_eq!(text::print(&program), expected);
}

#[test]
fn first_positions_are_judged_with_the_first_loops_ranges() {
    // Were `iter2 a` possibly a NaN, so would be the maximum, and the loop might go on.
    let first = "loop 1 up 3x3\ncolumn\n  v0 = x-obstacle\n  result v0\nbody\n  varying\n    v0 = window raw\n  next a v0\n";
    let body = "    v0 = window median\n    v1 = iter2 a\n    v2 = max v0 v1\n    v3 = read a\n    v4 = le v3 v2\n  next a v0\n  break v4\n";
    let second = format!("loop 2 up 3x3\ncolumn\n{OWN}body\n  varying\n{body}");
    let program = text::parse(&format!("vir 1\nimage 40x24\n{first}{second}")).expect("well formed");
    let optimised = opt::optimise(&program);
    assert!(optimised.first().is_none() && ops(&optimised) == [Op::Window], "{optimised}");
}

#[test]
fn columns_are_tried() {
    let body = "    v0 = window raw\n  next a v0\n";
    let column = |lines: &str| optimised("down 8x8", lines, body).second().column().as_leaf();
    let there_and_back =
        "  v0 = x-obstacle\n  v1 = const 39\n  v2 = sub v0 v1\n  v3 = add v2 v1\n  result v3\n";
    assert_eq!(column(there_and_back), Some(Leaf::XObstacle));
    // The rectangle reaches no further left than column 3.
    let clamped = "  v0 = x-obstacle\n  v1 = const 2.5\n  v2 = max v0 v1\n  result v2\n";
    assert_eq!(column(clamped), Some(Leaf::XObstacle));
    let limited = "  v0 = x-obstacle\n  v1 = const 4\n  v2 = max v0 v1\n  result v2\n";
    assert_eq!(column(limited), None);
    let far = "  v0 = x-obstacle\n  v1 = const -1\n  v2 = mul v0 v1\n  result v2\n";
    assert_eq!(column(far), Some(Leaf::Const(3.0)));
    let small = "  v0 = x-obstacle\n  v1 = sin v0\n  result v1\n";
    assert_eq!(column(small), Some(Leaf::Const(3.0)));
}

/// The program of one loop with this body, which sets `a` alone.
fn single_loop(body: Builder, result: Reg, break_if: Option<Reg>) -> Program {
    let mut column = Builder::new();
    let own = column.leaf(Leaf::XObstacle);
    let parts = LoopParts {
        direction: vsonar_ir::Direction::Down,
        rect: vsonar_ir::Rect::default(),
        span: vsonar_ir::Span::All,
        column: column.finish(),
        column_result: own,
        body: body.finish(),
        invariant: 0,
        uniform: 0,
        next: [Some(result), None, None, None, None],
        break_if,
    };
    Program::new(WIDTH, HEIGHT, None, parts).expect("well formed")
}

#[test]
fn long_columns_are_not_tried_in_wide_images() {
    // There and back again, which no range shows to be nowhere.
    let column = |width: u32, steps: usize| {
        let mut c = Builder::new();
        let mut at = c.leaf(Leaf::XObstacle);
        let there_and_back = [1.0, -1.0].map(|step| c.leaf(Leaf::Const(step)));
        for i in 0..steps {
            at = c.push(Op::Add, &[at, there_and_back[i % 2]]).expect("well typed");
        }
        let mut body = Builder::new();
        let x = body.leaf(Leaf::X);
        let parts = LoopParts {
            column: c.finish(),
            column_result: at,
            ..LoopParts::from(single_loop(body, x, None).second())
        };
        opt::optimise(&Program::new(width, HEIGHT, None, parts).expect("well formed"))
            .second()
            .column()
            .as_leaf()
    };
    assert_eq!(column(Program::MAX_SIDE, 60), Some(Leaf::XObstacle));
    assert_eq!(column(Program::MAX_SIDE, 62), None);
    assert_eq!(column(WIDTH, 62), Some(Leaf::XObstacle));
}

#[test]
fn comparisons_with_one_chain_of_choices_do_not_multiply_it() {
    let mut b = Builder::new();
    let limit = b.leaf(Leaf::Const(-5.0));
    let window = b.leaf(Leaf::Window(vsonar_ir::Operand::all().next().expect("there are some")));
    let (mut chosen, mut sum) = (b.leaf(Leaf::Y), window);
    let constant = |b: &mut Builder, i: u32| b.leaf(Leaf::Const(i as f32 / 100.0));
    for i in 0..1500 {
        let threshold = constant(&mut b, i);
        let own = b.push(Op::Le, &[window, threshold]).expect("well typed");
        chosen = b.push(Op::Select, &[own, chosen, limit]).expect("well typed");
    }
    for i in 0..300 {
        let threshold = constant(&mut b, i);
        let above = b.push(Op::Lt, &[threshold, chosen]).expect("well typed");
        let term = b.push(Op::Select, &[above, window, threshold]).expect("well typed");
        sum = b.push(Op::Add, &[sum, term]).expect("well typed");
    }
    let program = single_loop(b, sum, None);
    let before = program.len();
    let after = opt::optimise(&program).len();
    assert!(after <= before, "{before} instructions became {after}");
}

#[test]
fn long_chains_need_little_stack() {
    // Choices within choices that one side decides, and negations of alternatives, 20,000 deep.
    let mut b = Builder::new();
    let limit = b.leaf(Leaf::Const(-5.0));
    let window = b.leaf(Leaf::Window(vsonar_ir::Operand::all().next().expect("there are some")));
    let y = b.leaf(Leaf::Y);
    let mask = b.push(Op::Le, &[window, y]).expect("well typed");
    let (mut chosen, mut all) = (y, mask);
    for i in 0..20_000 {
        let threshold = b.leaf(Leaf::Const(i as f32 / 100.0));
        let own = b.push(Op::Le, &[window, threshold]).expect("well typed");
        chosen = b.push(Op::Select, &[own, chosen, limit]).expect("well typed");
        let other = b.push(Op::Not, &[all]).expect("well typed");
        all = b.push(Op::Or, &[other, own]).expect("well typed");
    }
    let above = b.push(Op::Lt, &[window, chosen]).expect("well typed");
    let none = b.push(Op::Not, &[all]).expect("well typed");
    let either = b.push(Op::And, &[above, none]).expect("well typed");
    let result = b.push(Op::Select, &[either, window, y]).expect("well typed");
    let program = single_loop(b, result, Some(all));
    let small = std::thread::Builder::new().stack_size(256 << 10);
    let optimised = small.spawn(move || opt::optimise(&program)).expect("a thread").join().expect("no panic");
    assert!(!optimised.is_empty());
}

#[test]
fn a_second_loop_that_only_repeats_the_first_is_dropped() {
    let first = "loop 1 up 3x3\ncolumn\n  v0 = x-obstacle\n  result v0\nbody\n  varying\n    v0 = read c\n    v1 = window raw\n    v2 = add v0 v1\n  next c v2\n";
    let second = "loop 2 down 5x5\ncolumn\n  v0 = const 7\n  result v0\nbody\n  invariant\n    v0 = iter2 c\n  next a v0\n";
    let both = text::parse(&format!("vir 1\nimage 40x24\n{first}{second}")).expect("well formed");
    let alone = first.replace("loop 1", "loop 2").replace("read c", "read a").replace("next c", "next a");
    let alone = text::parse(&format!("vir 1\nimage 40x24\n{alone}")).expect("well formed");
    assert_eq!(opt::optimise(&both), opt::optimise(&alone));
    assert!(opt::optimise(&both).first().is_none());
}
