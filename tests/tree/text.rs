//! Round trips of the text form.

use proptest::prelude::*;
use vsonar::tree::{Individual, Node, NodeType, Place, Shortest};

use super::{check, parse, random_individual};

fn constant(text: &str) -> f32 {
    let individual = parse(&format!("(individual (iterate-up 2x2 0 (set-a {text})))"));
    let Node::Constant(value) = individual.second().body()[1] else { panic!("{text} is a constant") };
    value
}

#[test]
fn random_individuals_round_trip() {
    for slot in 0..1500 {
        let individual = random_individual(slot);
        for text in [individual.to_string(), format!("{individual:#}")] {
            assert_eq!(text.parse().as_ref(), Ok(&individual), "slot {slot}: {text}");
        }
        assert!(!format!("{individual:#}").contains('\n'));
        let json = serde_json::to_string(&individual).expect("text has a JSON form");
        assert_eq!(serde_json::from_str::<Individual>(&json).expect("sound text"), individual);
    }
}

#[test]
fn every_node_type_round_trips_in_every_place() {
    for node_type in NodeType::all() {
        let node = node_type.node();
        let call = match node {
            Node::Constant(_) => "0.5".to_string(),
            _ if node.is_function() => format!("({node_type}{})", " 1".repeat(node.arity())),
            _ => node_type.to_string(),
        };
        let (rect, column, body) = match node {
            Node::Iterate(_) => continue,
            Node::Rect(_) => (call.as_str(), "1", "(set-a 2)"),
            _ if node.fits(Place::Column) => ("2x2", call.as_str(), call.as_str()),
            _ => ("2x2", "1", call.as_str()),
        };
        let other = "(iterate-up 3x3 x-obstacle (set-a y))";
        let text = format!("(individual {other} (iterate-down {rect} {column} {body}))");
        let individual = parse(&text);
        check(&individual);
        assert_eq!(format!("{individual:#}"), text);
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200_000, ..ProptestConfig::default() })]

    #[test]
    fn every_finite_constant_reads_back_the_same(bits: u32) {
        let value = f32::from_bits(bits);
        prop_assume!(value.is_finite());
        let text = Shortest(value).to_string();
        prop_assert_eq!(text.parse::<f32>().map(f32::to_bits), Ok(bits));
        prop_assert!(text.len() <= 16, "{}", text);
    }
}

proptest! {
    #[test]
    fn constants_read_back_the_same_in_a_program(bits: u32) {
        let value = f32::from_bits(bits);
        prop_assume!(value.is_finite());
        prop_assert_eq!(constant(&Shortest(value).to_string()).to_bits(), bits);
    }

    #[test]
    fn no_text_makes_the_parser_panic(text in r"(\(|\)| |individual|iterate-up|2x2|9x9|y|set-a|-?[0-9.e]{1,6}|;|\PC|\n){0,40}") {
        let _ = text.parse::<Individual>();
        let _ = format!("(individual (iterate-up 2x2 {text}").parse::<Individual>();
    }
}

#[test]
fn constants_are_rounded_once() {
    // Just above the middle of 1 and its successor, by less than binary64 can tell: rounding twice gives 1.
    assert_eq!(constant("1.00000005960464477539062500000000001"), 1.0 + f32::EPSILON);
    assert_eq!(constant("1.000000059604644775390625"), 1.0);
    assert_eq!(constant("3.4028235e38"), f32::MAX);
    // Below the middle of the largest number and 2^128.
    assert_eq!(constant("3.40282356e38"), f32::MAX);
    assert_eq!(constant("1e-45").to_bits(), 1);
    assert_eq!(constant("-1e-60").to_bits(), (-0.0f32).to_bits());
    assert_eq!(constant(&format!("1{}e-400", "0".repeat(400))), 1.0);
}

#[test]
fn every_form_of_a_decimal_is_read() {
    let forms = [
        ("5", 5.0),
        ("+5", 5.0),
        ("-.5", -0.5),
        ("5.", 5.0),
        ("05", 5.0),
        ("1E+2", 100.0),
        ("-2.5e-1", -0.25),
    ];
    for (text, value) in forms {
        assert_eq!(constant(text), value, "{text}");
    }
    assert_eq!(constant("-0").to_bits(), (-0.0f32).to_bits());
}

#[test]
fn constants_print_readably() {
    let printed = [
        (0.0, "0"),
        (-0.0, "-0"),
        (-0.25, "-0.25"),
        (35.4444, "35.4444"),
        (3.402_82e38, "3.40282e38"),
        (1e9, "1e9"),
        (999_999_940.0, "999999940"),
        (1e-5, "0.00001"),
        (-9.5e-6, "-9.5e-6"),
        (f32::MIN_POSITIVE, "1.1754944e-38"),
        (f32::NAN, "NaN"),
        (f32::NEG_INFINITY, "-inf"),
    ];
    for (value, text) in printed {
        assert_eq!(Shortest(value).to_string(), text);
    }
}

#[test]
fn comments_and_space_are_skipped() {
    let plain = parse("(individual (iterate-up 2x2 x-obstacle (set-a y)))");
    let text =
        "\u{feff}; a (comment)\r\n(individual;x\n\t( iterate-up 2x2;)\n x-obstacle(set-a y )) ) ; the end";
    assert_eq!(parse(text), plain);
}

#[test]
fn long_programs_are_wrapped() {
    let individual = parse(
        "(individual (iterate-down 2x8 (+ x-obstacle 4) (prog2 (if-le gradient-sq 57121 (set-b (* read-b \
         (square (atan2 moravec-slash-sq moravec-backslash-sq)))) (prog2 (set-a y) break)) (set-c raw))))",
    );
    let expected = "\
(individual
  (iterate-down 2x8 (+ x-obstacle 4)
    (prog2
      (if-le gradient-sq 57121
        (set-b (* read-b (square (atan2 moravec-slash-sq moravec-backslash-sq))))
        (prog2 (set-a y) break))
      (set-c raw))))";
    assert_eq!(individual.to_string(), expected);
}
