//! Listings of random individuals: the printed text, read back and run by itself, gives the answers of the walker of
//! trees, bit for bit.

mod common;

use vsonar::dataset::{Case, Dataset, NamedImage};
use vsonar::explain::{Explanation, Listing, Trace, text};
use vsonar::ir::generate::Random as Small;
use vsonar::ir::{Program, reference};
use vsonar::lower::lower;
use vsonar::tree::Individual;
use vsonar::vision::WindowSums;

#[test]
fn a_printed_listing_computes_what_the_tree_does() {
    let walker = common::executors().remove(0);
    let (mut choices, mut stops, mut names, mut answers, mut not_le) = (0, 0, 0, 0, 0);
    for batch in 0..24u64 {
        let (width, height) = [(16, 16), (40, 24), (64, 48), (33, 57)][batch as usize % 4];
        let mut random = Small::new(77 + batch);
        let images: Vec<_> = (0..5).map(|_| common::image(&mut random, width, height)).collect();
        let lanes: Vec<_> = (0..21).map(|i| (i % 5, random.below(width as usize) as u32)).collect();
        let cases = common::case_set(&images, &lanes);
        for individual in common::individuals(900 + batch, 300) {
            let program = vsonar::ir::opt::optimise(&lower(&individual, width, height));
            let text = Listing::of(&program).expect("no bit patterns").to_string();
            let listing: Listing = text.parse().unwrap_or_else(|e| panic!("{e}\n{text}\n{individual}"));
            assert_eq!(listing.to_string(), text, "{individual}");
            let judged = common::answers(walker.as_ref(), &individual, &cases);
            for (i, lane) in cases.lanes().iter().enumerate() {
                let found = listing.answer(cases.image(i), lane.column as f32);
                assert!(
                    common::same(judged[i], found),
                    "batch {batch}, case {i}: {found:e} instead of {:e}\n{individual}\n{program}\n{text}",
                    judged[i]
                );
                answers += 1;
            }
            choices += text.matches("if ").count();
            stops += text.matches("stop").count();
            names += text.matches("let ").count();
            not_le += text.matches('≰').count();
        }
    }
    println!("{answers} answers, {choices} choices, {stops} stops, {names} names, {not_le} ≰");
    assert!(choices > 1000 && stops > 100 && names > 500 && not_le > 0, "the sample says little");
}

/// Calls a function on a thread with a quarter of the stack that threads have, for unoptimised frames are larger.
fn on_a_small_stack(work: impl FnOnce() + Send) {
    std::thread::scope(|scope| {
        let thread = std::thread::Builder::new().stack_size(512 << 10).spawn_scoped(scope, work);
        thread.expect("a thread").join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
    });
}

/// One after the other, as a tree that is hardly deeper than one of them.
fn in_sequence(mut parts: Vec<String>) -> String {
    while parts.len() > 1 {
        let two = |pair: &[String]| match pair {
            [a, b] => format!("(prog2 {a} {b})"),
            _ => pair.concat(),
        };
        parts = parts.chunks(2).map(two).collect();
    }
    format!("(individual (iterate-up 3x3 x-obstacle {}))", parts.concat())
}

const CHOICES: usize = 5_000;

/// Programs with very long chains of choices: what the chain is, and the program.
fn long_programs() -> Vec<(&'static str, String)> {
    let of = |part: &dyn Fn(usize, f64) -> String| -> Vec<String> {
        (0..CHOICES).map(|i| part(i, (i + 1) as f64 * 254.0 / CHOICES as f64)).collect()
    };
    let sine = |i: usize| format!("(sin (* raw {}))", i + 2);
    let mut value = of(&|i, k| format!("(set-b (if-le raw {k} {i} read-b))"));
    value.push("(set-a (sin read-b))".to_string());
    vec![
        ("else if", in_sequence(of(&|i, k| format!("(if-le raw {k} (set-a {i}) 0)")))),
        ("a value", in_sequence(value)),
        // Each `else:` has a name of its own in it.
        (
            "names",
            in_sequence(of(&|i, k| {
                let (sine, k) = (sine(i), k / 300.0 - 0.5);
                format!("(set-a (if-le {sine} {k} read-a (+ 1 (* gradient {sine}))))")
            })),
        ),
        // Two registers, changed in both branches, and a stop.
        (
            "stops",
            in_sequence(of(&|i, k| {
                let condition = format!("(+ raw (* {i} gradient)) {k}");
                format!("(if-le {condition} (prog2 (set-a (+ y {i})) break) (set-b (* read-b raw)))")
            })),
        ),
    ]
}

#[test]
fn chains_of_thousands_of_choices_have_a_listing_on_a_small_stack() {
    let walker = common::executors().remove(0);
    let mut random = Small::new(3);
    let images: Vec<_> = (0..2).map(|_| common::image(&mut random, 24, 16)).collect();
    let cases = common::case_set(&images, &[(0, 3), (1, 8), (1, 20)]);
    for (what, text) in &long_programs() {
        on_a_small_stack(|| {
            let individual: Individual = text.parse().expect("a program");
            let program = vsonar::ir::opt::optimise(&lower(&individual, 24, 16));
            let listing = Listing::of(&program).unwrap_or_else(|e| panic!("{what}: {e}"));
            assert!(listing.second.choice_sites().len() >= CHOICES / 2, "{what}: no chain is left");
            let text = listing.to_string();
            let deepest = text.lines().map(|line| line.len() - line.trim_start().len()).max();
            assert!(deepest <= Some(4 * 100), "{what}: {deepest:?}");
            assert_eq!(text.parse::<Listing>().expect(what), listing, "{what}");
            let judged = common::answers(walker.as_ref(), &individual, &cases);
            for (i, lane) in cases.lanes().iter().enumerate() {
                let found = listing.answer(cases.image(i), lane.column as f32);
                assert!(common::same(judged[i], found), "{what}, case {i}: {found} instead of {}", judged[i]);
            }
        });
    }
}

#[test]
fn a_chain_of_thousands_of_choices_is_explained_on_a_small_stack() {
    let (_, text) = &long_programs()[0];
    on_a_small_stack(|| {
        let individual: Individual = text.parse().expect("a program");
        let mut explanation = Explanation::new(&individual, 24, 16).expect("an explanation");
        assert!(explanation.listing.to_string().matches("else if ").count() >= CHOICES - 1);
        let pixels = common::image(&mut Small::new(5), 24, 16);
        let images = vec![NamedImage { name: "one".into(), pixels }];
        let set = Dataset::new("set", images, vec![Case { image: 0, x: 4, y: 5 }]).expect("sound");
        explanation.add_data(&set, 10.0).expect("the same answers");
        let trace = Trace::of(&explanation.listing, &set, 0);
        assert!(trace.sweeps[0].choices.len() >= CHOICES);
        let [text, markdown] = [text::text, text::markdown].map(|of| of(&explanation, "long"));
        assert!(text.contains("else if") && markdown.contains("else if"));
    });
}

/// A program in the compiler's form, which unlike a tree may be nested as deeply as it is long. Of each choice's number,
/// that of its condition and that of the value so far, `value` makes the lines of the value from then on, the last of
/// them that value's.
fn compiled(value: impl Fn(usize, usize, usize) -> Vec<String>) -> String {
    let mut text =
        "vir 1\nimage 24x16\nloop 2 up 3x3\ncolumn\n  v0 = x-obstacle\n  result v0\nbody\n  invariant\n"
            .to_string();
    for i in 0..CHOICES {
        text += &format!("    v{i} = const {}\n", (i + 1) as f64 * 255.0 / CHOICES as f64);
    }
    let mut lines = vec!["window raw".to_string(), "window gradient".to_string(), "read a".to_string()];
    let (raw, mut so_far) = (CHOICES, CHOICES + 2);
    for i in 0..CHOICES {
        lines.push(format!("le v{raw} v{i}"));
        lines.extend(value(i, CHOICES + lines.len() - 1, so_far));
        so_far = CHOICES + lines.len() - 1;
    }
    text += "  varying\n";
    for (i, line) in lines.iter().enumerate() {
        text += &format!("    v{} = {line}\n", CHOICES + i);
    }
    text + &format!("  next a v{so_far}\n")
}

#[test]
fn so_have_those_in_the_compiler_s_form() {
    let chain = |i: usize, held: usize, so_far: usize| vec![format!("select v{held} v{i} v{so_far}")];
    // In both branches there is a further choice, so that neither can go on as `else if` for all of them.
    let nested = |i: usize, held: usize, so_far: usize| {
        let [gradient, j] = [CHOICES + 1, (i * 7) % CHOICES];
        vec![
            format!("le v{gradient} v{i}"),
            format!("select v{} v{i} v{j}", held + 1),
            format!("select v{held} v{so_far} v{}", held + 2),
        ]
    };
    let mut random = Small::new(4);
    let images: Vec<_> = (0..2).map(|_| common::image(&mut random, 24, 16)).collect();
    for (what, text) in [("chain", compiled(chain)), ("nested", compiled(nested))] {
        on_a_small_stack(|| {
            let program: Program = text.parse().unwrap_or_else(|e| panic!("{what}: {e}"));
            let text = Listing::of(&program).expect("no bit patterns").to_string();
            assert!(text.matches("if ").count() >= CHOICES, "{what}");
            let listing: Listing = text.parse().unwrap_or_else(|e| panic!("{what}: {e}"));
            assert_eq!(listing.to_string(), text, "{what}");
            for (image, x) in images.iter().zip([3.0, 20.0]) {
                let windows = WindowSums::new(image);
                let judged = reference::run(&program, &windows, x).second[0];
                let found = listing.answer(&windows, x);
                assert!(common::same(judged, found), "{what}: {found} instead of {judged}");
            }
        });
    }
}

#[test]
fn what_is_too_large_is_told_as_a_limit() {
    // Conditions alone, by the hundred thousand.
    let mut text = "vir 1\nimage 24x16\nloop 2 up 3x3\ncolumn\n  v0 = x-obstacle\n  result v0\nbody\n  varying\n    v0 = window raw\n    v1 = window gradient\n    v2 = le v0 v1\n".to_string();
    for i in 3..150_000 {
        text += &format!("    v{i} = select v2 v{} v0\n", if i == 3 { 1 } else { i - 1 });
    }
    text += "  next a v149999\n";
    let program: Program = text.parse().expect("a program");
    let error = Listing::of(&program).expect_err("too large");
    assert_eq!(
        error.to_string(),
        "a tree with 149997 choices and conditions is too large to be explained, 131072 is the limit; explain a smaller \
         program (`vsonar ir` shows one of any size)"
    );
}

#[test]
fn registers_of_the_listing_and_of_the_tree_are_told_apart() {
    let of = |body: &str| {
        let text = format!("(individual (iterate-up 3x3 x-obstacle {body}))");
        let individual: Individual = text.parse().unwrap_or_else(|e| panic!("{e}"));
        let explanation = Explanation::new(&individual, 64, 48).expect("readable");
        let tree = explanation.uses.trees[0].clone();
        (explanation.listing.to_string(), tree, text::uses(&explanation)[1].clone())
    };
    // Of two registers alike the listing has the one that the tree needs, whatever the optimiser's number of it.
    let (listing, tree, line) = of("(prog2 (set-a (+ read-e y)) (set-b (set-e median)))");
    assert!(listing.contains("a := y + e\n    e := median"), "{listing}");
    assert_eq!((&tree.stored[..], &tree.idle_registers[..]), (&["a", "e"][..], &["b"][..]));
    assert!(line.ends_with("registers stored a, e, read e (in the tree, but not needed: b)"), "{line}");
    // Two registers of the tree that are one: the tree needs both.
    let (listing, tree, line) =
        of("(prog2 (set-a (+ read-c (* 3 read-d))) (prog2 (set-c raw) (set-d (+ raw (* 0 y)))))");
    assert!(listing.contains("c := raw") && !listing.contains("d := "), "{listing}");
    assert_eq!(tree.listing.other_letter, [["d", "c"]]);
    assert!(line.ends_with("; in the listing d is called c"), "{line}");
    // A register that is a number once optimised.
    let (listing, tree, line) = of("(prog2 (set-c 5) (set-a (+ read-c raw)))");
    assert!(listing.contains("a := raw + 5"), "{listing}");
    assert_eq!(tree.listing.without, ["c"]);
    assert!(line.ends_with("; in the listing c is not there"), "{line}");
    // A first tree that goes into the second.
    let text =
        "(individual (iterate-up 3x3 x-obstacle (set-e raw)) (iterate-down 4x4 x-obstacle (set-a iter2-e)))";
    let explanation = Explanation::new(&text.parse().expect("a program"), 64, 48).expect("readable");
    assert!(explanation.listing.first.is_none());
    let first = text::uses(&explanation)[1].clone();
    assert!(first.ends_with("; in the listing it is a part of the only tree there"), "{first}");
}
