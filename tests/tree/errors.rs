//! Every fault of a program's text: what is said, and where.

use std::time::{Duration, Instant};

use vsonar::tree::{Individual, MAX_DEPTH, MAX_NODES};

fn message(text: &str) -> String {
    match text.parse::<Individual>() {
        Ok(individual) => panic!("read as {individual}"),
        Err(error) => error.to_string(),
    }
}

/// The message for a body, which begins at line 2, column 1, in the second of two trees.
fn in_body(body: &str) -> String {
    message(&format!("(individual (iterate-up 2x2 1 y) (iterate-up 2x2 x-obstacle\n{body}))"))
}

const FORM: &str = "a program is `(individual T1 T2)`, or `(individual T)` with one tree";
const TREE: &str = "a tree is `(iterate-up RECT COLUMN BODY)` or `(iterate-down RECT COLUMN BODY)`";
const SIZES: &str =
    "the sizes are 2x2 2x3 3x2 3x3 2x4 4x2 4x4 5x5 2x6 6x2 3x6 6x3 6x6 7x7 2x8 8x2 3x8 8x3 8x8";

#[test]
fn outside_of_trees() {
    let cases = [
        ("", format!("line 1, column 1: the text is empty; {FORM}")),
        (" ; nothing\n ", format!("line 2, column 2: the text is empty; {FORM}")),
        ("y", format!("line 1, column 1: expected `(individual`, found `y`; {FORM}")),
        (")", format!("line 1, column 1: expected `(individual`, found `)`; {FORM}")),
        ("(iterate-up 2x2 1 y)", format!("line 1, column 2: expected `(individual`, found `iterate-up`; {FORM}")),
        ("(", format!("line 1, column 2: expected `(individual`, found the end of the text; {FORM}")),
        ("(individual)", format!("line 1, column 1: the individual has no tree; {FORM}")),
        ("(individual y)", format!("line 1, column 13: expected a tree, found `y`; {TREE}")),
        ("(individual (set-a y))", format!("line 1, column 14: a tree does not begin with `set-a`; {TREE}")),
        ("(individual (2x2 y))", format!("line 1, column 14: a tree does not begin with `2x2`; {TREE}")),
        (
            "(individual (iterate-up 2x2 1 y)\n(iterate-up 2x2 1 y)\n(iterate-up 2x2 1 y))",
            "line 3, column 1: an individual has one tree or two, and this is a third".into(),
        ),
        (
            "(individual (iterate-up 2x2 1 y)) ; so far\n  (y)",
            "line 2, column 3: nothing may follow the individual; found `(`".into(),
        ),
        (
            "(individual (iterate-up 2x2 1 y)))",
            "line 1, column 34: nothing may follow the individual; found `)`".into(),
        ),
        (
            "(individual (iterate-up 2x2 1 y)",
            "line 1, column 33: the text ends inside `(individual`, opened at line 1, column 1; a `)` is missing"
                .into(),
        ),
        (
            "(individual\n (iterate-up 2x2 1 (set-a y)",
            "line 2, column 29: the text ends inside `(iterate-up`, opened at line 2, column 2; a `)` is missing"
                .into(),
        ),
    ];
    for (text, expected) in cases {
        assert_eq!(message(text), expected, "{text}");
    }
}

#[test]
fn in_expressions() {
    let number = "constants are decimal, such as `-0.25` or `3.4e38`";
    let finite = "constants are finite decimal numbers, such as `-0.25` or `3.4e38`";
    let cases = [
        ("(set-a gradent)", "line 2, column 8: unknown node `gradent`; did you mean `gradient`?".into()),
        ("(set-f y)", "line 2, column 2: unknown node `set-f`; did you mean `set-a`?".into()),
        ("(progn y y)", "line 2, column 2: unknown node `progn`; did you mean `prog2`?".into()),
        ("entirely-else", "line 2, column 1: unknown node `entirely-else`".into()),
        ("constant", "line 2, column 1: unknown node `constant`".into()),
        ("\n  (+ 1 \u{e9}\u{1})", "line 3, column 8: unknown node `\u{e9}\\u{1}`".into()),
        ("set-a", "line 2, column 1: `set-a` takes 1 argument: write `(set-a A)`".into()),
        ("(+ 1 if-le)", "line 2, column 6: `if-le` takes 4 arguments: write `(if-le A B C D)`".into()),
        ("(read-a)", "line 2, column 2: `read-a` takes no arguments, and stands without parentheses".into()),
        ("(3 y)", "line 2, column 2: `3` takes no arguments, and stands without parentheses".into()),
        ("(+ 1\n (if-le 1 2 3))", "line 3, column 2: `if-le` takes 4 arguments, and has 3".into()),
        ("(set-a)", "line 2, column 1: `set-a` takes 1 argument, and has 0".into()),
        ("(+ 1 2 3)", "line 2, column 8: `+` takes 2 arguments, and here is one more".into()),
        ("(sin 1 (cos 2))", "line 2, column 8: `sin` takes 1 argument, and here is one more".into()),
        ("y y", "line 2, column 3: `iterate-up` takes 3 arguments, and here is one more".into()),
        ("", "line 1, column 34: `iterate-up` takes 3 arguments, and has 2".into()),
        ("()", "line 2, column 2: expected the name of a function after `(`, found `)`".into()),
        ("((+ 1 2))", "line 2, column 2: expected the name of a function after `(`, found `(`".into()),
        (
            "(set-a (iterate-up 2x2 1 y))",
            "line 2, column 9: `iterate-up` is below the root; an iterate node is the root of a tree, and nowhere \
             else"
                .into(),
        ),
        (
            "(+ 2x2 1)",
            "line 2, column 4: the rectangle size `2x2` can only be the first argument of an iterate node".into(),
        ),
        ("(+ 5x3 1)", format!("line 2, column 4: `5x3` is not a rectangle size; {SIZES}")),
        ("1.2.3", format!("line 2, column 1: `1.2.3` is not a number; {number}")),
        ("0x1F", format!("line 2, column 1: `0x1F` is not a number; {number}")),
        ("1e", format!("line 2, column 1: `1e` is not a number; {number}")),
        ("-1_000", format!("line 2, column 1: `-1_000` is not a number; {number}")),
        ("1,5", format!("line 2, column 1: `1,5` is not a number; {number}")),
        ("2f32", format!("line 2, column 1: `2f32` is not a number; {number}")),
        ("nan", format!("line 2, column 1: `nan` is not a constant; {finite}")),
        ("-Infinity", format!("line 2, column 1: `-Infinity` is not a constant; {finite}")),
        ("+inf", format!("line 2, column 1: `+inf` is not a constant; {finite}")),
        (
            "-1e39",
            "line 2, column 1: `-1e39` is too large for a constant; the largest magnitude is `3.4028235e38`".into(),
        ),
        // The middle of the largest number and 2^128 rounds to even, which is infinite.
        (
            "340282356779733661637539395458142568448",
            "line 2, column 1: `340282356779733661637539395458142568448` is too large for a constant; the largest magnitude is \
             `3.4028235e38`"
                .into(),
        ),
    ];
    for (body, expected) in cases {
        assert_eq!(in_body(body), expected, "{body}");
    }
    let long = "9".repeat(1000);
    assert!(in_body(&long).starts_with(&format!("line 2, column 1: `{}…` is too large", "9".repeat(40))));
}

#[test]
fn in_places() {
    let column = "cannot stand in a column expression, which is evaluated before there is a window; use arithmetic, \
                  constants, `x-obstacle`, `window-area`, `image-max-x`, `image-max-y` and, in a second tree, \
                  `iter2-a` to `iter2-e`";
    for node in ["gradient-sq", "x", "y", "first-window", "read-a", "break"] {
        let text = format!("(individual (iterate-up 2x2 (+ 1 {node}) y))");
        assert_eq!(message(&text), format!("line 1, column 34: `{node}` {column}"));
    }
    for call in ["set-b", "prog2", "if-le"] {
        let text = format!("(individual (iterate-up 2x2 ({call} 1) y))");
        assert_eq!(message(&text), format!("line 1, column 30: `{call}` {column}"));
    }
    for rect in ["5x3", "02x2", "y", "7", "3X3", "+2x2"] {
        let text = format!("(individual (iterate-up {rect} 1 y))");
        assert_eq!(message(&text), format!("line 1, column 25: `{rect}` is not a rectangle size; {SIZES}"));
    }
    assert_eq!(
        message("(individual (iterate-up (set-a 1) 1 y))"),
        format!("line 1, column 26: `set-a` is not a rectangle size; {SIZES}")
    );
    let only = "reads the registers of the first tree, so only the second of two trees can hold it";
    assert_eq!(
        message("(individual (iterate-up 2x2 iter2-a y) (iterate-up 2x2 1 y))"),
        format!("line 1, column 29: `iter2-a` {only}")
    );
    assert_eq!(
        message("(individual (iterate-up 2x2 1 (set-a iter2-e)))"),
        format!("line 1, column 38: `iter2-e` {only}")
    );
}

/// A program whose deepest node has depth `depth`.
fn nested(depth: usize) -> String {
    let (open, close) = ("(sin ".repeat(depth - 1), ")".repeat(depth - 1));
    format!("(individual (iterate-up 2x2 1 {open}y{close}))")
}

#[test]
fn nesting_has_a_limit() {
    let deepest: Individual = nested(MAX_DEPTH).parse().expect("the limit itself is allowed");
    assert_eq!(deepest.depth(), 1000);
    assert_eq!(deepest.to_string().parse().as_ref(), Ok(&deepest));
    for depth in [1001, 100_000, 1_000_000] {
        let start = Instant::now();
        // Five characters for each of the 1000 levels before.
        assert_eq!(
            message(&nested(depth)),
            format!(
                "line 1, column {}: nested too deeply; a tree may be 1000 deep",
                31 + 5 * 1000 + usize::from(depth > 1001)
            )
        );
        assert!(start.elapsed() < Duration::from_secs(5));
    }
    // Nothing but parentheses.
    assert!(message(&"(".repeat(100_000)).starts_with("line 1, column 2: expected `(individual`"));
    let text = format!("(individual (iterate-up 2x2 1 {}", "(".repeat(100_000));
    assert_eq!(message(&text), "line 1, column 32: expected the name of a function after `(`, found `(`");
}

/// A body of `2 * pairs - 1` nodes, as flat as can be.
fn broad(pairs: usize) -> String {
    if pairs == 1 { "y".into() } else { format!("(+ {} {})", broad(pairs / 2), broad(pairs - pairs / 2)) }
}

#[test]
fn size_has_a_limit() {
    let text = |pairs| format!("(individual (iterate-up 2x2 1\n{}))", broad(pairs));
    // Three nodes besides the body's.
    let largest: Individual = text((MAX_NODES - 2) / 2).parse().expect("within the limit");
    assert_eq!(largest.len(), MAX_NODES);
    assert_eq!(largest.to_string().parse().as_ref(), Ok(&largest));
    let start = Instant::now();
    let message = message(&text(500_000));
    assert!(message.starts_with("line 2, column "), "{message}");
    assert!(message.ends_with(": the program is too large; a tree may have 100000 nodes"), "{message}");
    assert!(start.elapsed() < Duration::from_secs(5));
}

#[test]
fn files() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("p.gp");
    let name = path.display().to_string();
    let load = |bytes: &[u8]| {
        std::fs::write(&path, bytes).expect("the file can be written");
        Individual::load(&path).map_err(|error| error.to_string())
    };
    let sound = "(individual (iterate-up 2x2 1 y))";
    assert_eq!(load(sound.as_bytes()), Ok(super::parse(sound)));
    assert_eq!(
        load(b"(individual\n (iterate-up 2x2 1 z))"),
        Err(format!("{name}: line 2, column 20: unknown node `z`"))
    );
    assert_eq!(
        load(b"(individual\n; \xff\n"),
        Err(format!("{name}: line 2: not valid UTF-8; a program is plain text"))
    );
    drop(folder);
    let missing = Individual::load(&path).expect_err("the folder is gone").to_string();
    assert!(missing.starts_with(&format!("{name}: cannot be read: ")), "{missing}");
}

#[cfg(unix)]
#[test]
fn an_endless_file_is_refused() {
    let error = Individual::load("/dev/zero").expect_err("no program").to_string();
    assert!(error.starts_with("/dev/zero: cannot be read: it is larger than 64 MiB"), "{error}");
}
