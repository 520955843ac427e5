//! The published best program, `examples/fmrb.gp`, against its figure.

use vsonar::exec::tree::{Walk, Walker};
use vsonar::ir::WindowAt;
use vsonar::tree::Individual;

const WIDTH: u32 = 320;
const HEIGHT: u32 = 240;
const X: f32 = 100.0;

fn program() -> Individual {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/fmrb.gp");
    Individual::load(path).unwrap_or_else(|error| panic!("{error}"))
}

/// What the image operators average to at a row.
#[derive(Clone, Copy)]
struct Row {
    horizontal: f32,
    slash: f32,
    gradient: f32,
    median: f32,
}

/// Bright floor without edges or texture: b ends as 1.
const FLOOR: Row = Row { horizontal: 0.0, slash: 0.0, gradient: 0.0, median: 100.0 };

fn walk(rows: impl Fn(u32) -> Row) -> Walk {
    walk_at(X, rows)
}

fn walk_at(x: f32, rows: impl Fn(u32) -> Row) -> Walk {
    let column = (x as u32).max(1);
    let windows = |at: WindowAt| {
        assert_eq!((at.rect.width(), at.rect.height(), at.x), (3, 3, column));
        match at.operand.name() {
            "moravec-horizontal" => rows(at.y).horizontal,
            "moravec-slash" => rows(at.y).slash,
            "gradient" => rows(at.y).gradient,
            "median" => rows(at.y).median,
            other => panic!("the figure does not use {other}"),
        }
    };
    Walker::new(&program(), WIDTH, HEIGHT).walk(&windows, x)
}

/// The figure's first tree, written down a second time.
fn recurrence(h: impl Fn(u32) -> f32) -> f32 {
    let mut b = 3.40282e38f32;
    for y in (1..=238).rev() {
        let h = h(y);
        let h4 = (h * h) * (h * h);
        let dividend = b * (1.0 + h) - (((1.0 + h) + h * h) + h4) * X;
        let divisor = h4 * h;
        b = if divisor == 0.0 { 1.0 } else { dividend / divisor };
    }
    b
}

#[test]
fn the_program_is_read_as_the_figure_has_it() {
    let individual = program();
    let first = individual.first().expect("two trees");
    assert_eq!((first.direction().name(), first.rect().to_string()), ("up", "3x3".into()));
    assert_eq!(
        (individual.second().direction().name(), individual.second().rect().to_string()),
        ("down", "3x3".into())
    );
    super::check(&individual);
    assert_eq!(individual.to_string().parse(), Ok(individual));
}

#[test]
fn the_first_tree_follows_its_recurrence() {
    let last_b = |h: &dyn Fn(u32) -> f32| {
        let first = walk(|y| Row { horizontal: h(y), ..FLOOR }).first.expect("two trees");
        assert_eq!((first.positions, first.broke), (238, false));
        assert_eq!(first.registers[1].to_bits(), recurrence(h).to_bits());
        first.registers[1]
    };
    // Nowhere any texture: the divisor is 0 everywhere, and b ends as 1.
    assert_eq!(last_b(&|_| 0.0), 1.0);
    // Texture everywhere: the first product overflows, and b stays infinite.
    assert_eq!(last_b(&|_| 4.0), f32::INFINITY);
    assert_eq!(last_b(&|_| 1.0 / 9.0), f32::INFINITY);
    // A bottom row without texture starts b at 1; with h = 4 it goes to the fixed point of the recurrence,
    // b (1024 - 5) = -(1 + 4 + 16 + 256) 100.
    let fixed = last_b(&|y| if y == 238 { 0.0 } else { 4.0 });
    assert!((fixed - -277.0 * 100.0 / 1019.0).abs() < 1e-3, "{fixed}");
    // A value of h for every row.
    assert!(last_b(&|y| if y == 238 { 0.0 } else { 0.5 + (y * 37 % 101) as f32 / 13.0 }).is_finite());
    // The last rows alone decide: 1 after row 2, so b = 2 - 4 * 100 after h = 1 in row 1.
    assert_eq!(last_b(&|y| if y == 1 { 1.0 } else { 0.0 }), -398.0);
}

#[test]
fn without_an_obstacle_the_answer_is_row_nine() {
    // `if y <= 9` fires in rows 1 to 9; the last of them wins.
    assert_eq!(walk(|_| FLOOR).answer(), 9.0);
}

#[test]
fn an_obstacle_at_the_bottom_is_known_by_the_first_tree() {
    // b ends as infinity, so a := y down to the last row.
    assert_eq!(walk(|_| Row { horizontal: 1.0 / 9.0, ..FLOOR }).answer(), 238.0);
    // h = 1 in the uppermost row alone makes b 2 - 4 x-obstacle: 9, which is not above 9, or 10, which is.
    let last = |y: u32| Row { horizontal: if y == 1 { 1.0 } else { 0.0 }, ..FLOOR };
    let at_nine = walk_at(-1.75, last);
    assert_eq!((at_nine.first.map(|first| first.registers[1]), at_nine.answer()), (Some(9.0), 9.0));
    let above = walk_at(-2.0, last);
    assert_eq!((above.first.map(|first| first.registers[1]), above.answer()), (Some(10.0), 238.0));
}

#[test]
fn a_strong_gradient_is_an_obstacle_where_it_is_bright() {
    let edge = |row: Row| walk(move |y| if y == 150 { row } else { FLOOR }).answer();
    // 413.96 is not above 413.96; and (413.96 / 239)^4, about 9, is not above 10.
    assert_eq!(edge(Row { gradient: 413.96, slash: 10.0, ..FLOOR }), 9.0);
    assert_eq!(edge(Row { gradient: 413.97, slash: 10.0, ..FLOOR }), 150.0);
    // Brightness must exceed 35.4444.
    assert_eq!(edge(Row { gradient: 1000.0, median: 35.4444, ..FLOOR }), 9.0);
    assert_eq!(edge(Row { gradient: 1000.0, median: 35.45, ..FLOOR }), 150.0);
}

#[test]
fn a_medium_gradient_is_weighed_against_the_slash_operator() {
    let edge = |row: Row| walk(move |y| if y == 150 { row } else { FLOOR }).answer();
    // (358.5 / 239)^4 = 1.5^4 = 5.0625, exactly.
    assert_eq!(edge(Row { gradient: 358.5, slash: 5.0, ..FLOOR }), 150.0);
    assert_eq!(edge(Row { gradient: 358.5, slash: 5.0625, ..FLOOR }), 9.0);
    assert_eq!(edge(Row { gradient: 358.5, slash: 5.0, median: 20.0, ..FLOOR }), 9.0);
    // Not above 239, however small the slash operator is.
    assert_eq!(edge(Row { gradient: 239.0, slash: 0.0, ..FLOOR }), 9.0);
    assert_eq!(edge(Row { gradient: 239.5, slash: 1.0, ..FLOOR }), 150.0);
}

#[test]
fn the_lowest_row_that_fires_wins() {
    let answer = walk(|y| match y {
        60 | 120 => Row { gradient: 500.0, ..FLOOR },
        150 => Row { gradient: 358.5, slash: 5.0, ..FLOOR },
        180 => Row { gradient: 100.0, ..FLOOR },
        _ => FLOOR,
    });
    assert_eq!(answer.answer(), 150.0);
    assert_eq!((answer.second.positions, answer.second.broke), (238, false));
}
