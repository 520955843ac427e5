//! Plans: their text goes both ways, and no text does harm.

use std::cell::Cell;

use proptest::collection::vec as many;
use proptest::prelude::*;
use proptest::sample::select;
use proptest::test_runner::{Config, RngAlgorithm, TestRng, TestRunner};
use vsonar::world::geometry::Room;
use vsonar::world::office::{
    Item, ItemKind, Kind, Light, Office, OfficeError, Person, Plan, PlanError, Setup, Start, Stripe, record,
};

fn fault(text: &str) -> PlanError {
    format!("plan 1\nroom 0 10 -1 1\n{text}").parse::<Plan>().unwrap_err()
}

#[test]
fn faults_name_their_line_and_a_remedy() {
    for (text, parts) in [
        ("tree 1 2", ["line 3", "`tree`", "bin"]),
        ("bin 1 0", ["line 3", "2 numbers", "x, y, width, depth, height, albedo and perhaps turn"]),
        ("bin 1 0 0.3 0.3 tall 0.1", ["line 3", "height", "`tall`"]),
        ("bin 1 0 0.3 0.3 99 0.1", ["line 3", "height is 99", "0.05 to 5"]),
        ("bin 1 nan 0.3 0.3 0.4 0.1", ["line 3", "y is NaN", "choose"]),
        ("chair 1 0 0.4 0.4 0.3 0.1", ["line 3", "height is 0.3", "0.35 to 5"]),
        ("room 3 2 0 1", ["line 3", "empty", "less than"]),
        ("\nwall 0.5 0.1\nwall 0.5 0.1", ["line 5", "`wall`", "take one"]),
        ("door 5 0 0.9 0.2", ["line 3", "no wall", "(5, 0)"]),
        ("light 5 4 1 1 1", ["line 3", "in no room", "(5, 4)"]),
        ("person 1 0.1 2 0", ["line 3", "4 numbers", "corners"]),
        ("start 5 0", ["line 3", "2 numbers", "heading"]),
        ("seed -1", ["line 3", "`-1`", "seed"]),
    ] {
        let message = fault(text).to_string();
        assert!(parts.iter().all(|part| message.contains(part)), "{text:?}: {message}");
    }
    assert_eq!("room 0 1 0 1".parse::<Plan>(), Err(PlanError::Header { line: 1 }));
    assert_eq!("".parse::<Plan>(), Err(PlanError::Header { line: 1 }));
    assert_eq!("plan 1".parse::<Plan>(), Err(PlanError::NoRoom));
    assert!(matches!(fault("room 20 400 0 300"), PlanError::TooLarge { .. }));
    assert!(matches!(fault(&"bin 1 0 0.3 0.3 0.4 0.1\n".repeat(501)), PlanError::TooMany { line: 503, .. }));
    assert!(matches!("x".repeat(2 << 20).parse::<Plan>(), Err(PlanError::TooLong { .. })));
    let comb: String = (0..60)
        .map(|i| format!("room 0 400 {} {}\n", 2.0 + 0.1 * f64::from(i), 2.02 + 0.1 * f64::from(i)))
        .collect();
    assert!(matches!(fault(&comb), PlanError::Length { .. }), "{:?}", fault(&comb));
    let stairs: String = (0..199)
        .map(|i| format!("room 0 {} 0 {}\n", 50.0 - 0.2 * f64::from(i), 1.0 + 0.2 * f64::from(i)))
        .collect();
    assert!(matches!(fault(&stairs), PlanError::TooLarge { .. } | PlanError::Walls { .. }));
}

#[test]
fn generated_plans_are_sound_and_go_both_ways() {
    for kind in [Kind::Nsh, Kind::Fmrb] {
        for seed in 0..40 {
            for unseen in [false, true] {
                let plan = Plan::generate(kind, seed, unseen);
                assert_eq!(plan.to_string().parse::<Plan>().unwrap(), plan, "{kind:?} {seed}");
                assert_eq!(plan.items.iter().any(|item| item.kind.is_unseen()), unseen, "{kind:?} {seed}");
                assert_eq!(plan.people.is_empty(), kind == Kind::Fmrb);
                assert_eq!(plan.stripes.len(), usize::from(kind == Kind::Nsh));
            }
        }
        assert!(kind.plan().items.iter().all(|item| !item.kind.is_unseen()));
        assert_eq!(kind.plan().to_string().parse::<Plan>().unwrap(), kind.plan());
    }
    let burned = |kind: Kind| kind.plan().lights.iter().filter(|light| light.power == 0.0).count();
    assert!(burned(Kind::Nsh) == 0 && burned(Kind::Fmrb) >= 4);
}

fn place() -> impl Strategy<Value = (f64, f64)> {
    (0.0..10.0, -1.0..1.0)
}

fn plan() -> impl Strategy<Value = Plan> {
    let kinds = [ItemKind::Box, ItemKind::Chair, ItemKind::Table, ItemKind::Drawer, ItemKind::Cone];
    let item = (0..kinds.len(), place(), 0.05..20.0, 0.05..4.65, 0.01..0.95, -360.0..360.0).prop_map(
        move |(kind, (x, y), width, height, albedo, turn)| Item {
            kind: kinds[kind],
            x,
            y,
            width,
            depth: width,
            height: if kinds[kind] == ItemKind::Chair { height + 0.35 } else { height },
            albedo,
            turn,
        },
    );
    let light = (place(), 0.05..20.0, 0.0..10.0).prop_map(|((x, y), width, power)| Light {
        x,
        y,
        width,
        depth: 0.3,
        power,
    });
    let person = (0.0..5.0, proptest::collection::vec(place(), 2..9)).prop_map(|(speed, path)| Person {
        speed,
        albedo: 0.1,
        path,
    });
    let start = (place(), -360.0..360.0).prop_map(|((x, y), heading)| Start { x, y, heading });
    (any::<u64>(), many(item, 0..9), many(light, 0..9), many(person, 0..4), many(start, 0..4), 0.01..0.95)
        .prop_map(|(seed, items, lights, people, starts, albedo)| {
            let room = Room { x: (0.0, 10.0), y: (-1.0, 1.0) };
            let stripes = vec![Stripe { room, albedo }];
            Plan { seed, items, lights, people, starts, stripes, ..Plan::empty(vec![room]) }
        })
}

proptest! {
    #[test]
    fn any_plan_goes_both_ways(plan in plan()) {
        let text = plan.to_string();
        prop_assert_eq!(text.parse::<Plan>().unwrap(), plan);
    }

    #[test]
    fn no_bytes_do_harm(bytes in many(any::<u8>(), 0..300)) {
        let text = String::from_utf8_lossy(&bytes);
        let _ = text.parse::<Plan>();
        let _ = format!("plan 1\n{text}").parse::<Plan>();
    }

    #[test]
    fn no_change_of_a_character_does_harm(at in 0usize..6000, to in proptest::char::any()) {
        let mut text: Vec<char> = Kind::Nsh.plan().to_string().chars().collect();
        let at = at % text.len();
        text[at] = to;
        if let Ok(plan) = text.into_iter().collect::<String>().parse::<Plan>() {
            prop_assert_eq!(plan.to_string().parse::<Plan>().unwrap(), plan);
        }
    }
}

/// The words that lines begin with, and how many numbers follow as a rule.
const KEYWORDS: [(&str, usize); 22] = [
    ("seed", 1),
    ("ceiling", 1),
    ("carpet", 2),
    ("wall", 2),
    ("skirting", 2),
    ("room", 4),
    ("stripe", 5),
    ("door", 4),
    ("glass", 4),
    ("light", 5),
    ("person", 8),
    ("start", 3),
    ("box", 6),
    ("cabinet", 7),
    ("table", 6),
    ("chair", 7),
    ("bin", 6),
    ("pillar", 6),
    ("plant", 6),
    ("suitcase", 7),
    ("cone", 6),
    ("drawer", 7),
];

/// A number as a plan may have it: mostly an ordinary one, sometimes at or beyond a limit, sometimes none.
fn number() -> impl Strategy<Value = String> {
    let odd =
        ["0", "-0", "0.05", "0.01", "0.005", "1", "-1", "1.2", "5", "20", "360", "-500", "501", "1e9", "nan"];
    let odd = odd.into_iter().chain(["-inf", "1e-320", "x", "1,5", "0x1"]);
    prop_oneof![
        40 => (5i32..95).prop_map(|n| format!("{}", f64::from(n) / 100.0)),
        2 => select(odd.map(String::from).collect::<Vec<_>>()),
    ]
}

/// A line of a word and numbers, mostly as many as belong there.
fn line() -> impl Strategy<Value = String> {
    let numbers = |count: usize| prop_oneof![30 => many(number(), count), 1 => many(number(), 0..9)];
    select(&KEYWORDS[..]).prop_flat_map(move |(word, count)| {
        let line = move |numbers: Vec<String>| format!("{word} {}", numbers.join(" "));
        numbers(count).prop_map(line)
    })
}

/// Takes a small picture of a drive through what a plan builds; false if a robot cannot stand at its start.
fn is_recorded(plan: &Plan) -> bool {
    let small = Setup { width: 16, height: 16, columns: 3, ..Setup::default() };
    let office = Office::build(plan, &small, 1).expect("it is sound");
    match record(&office, "any", 1, 1) {
        Ok(set) => {
            assert_eq!((set.images().len(), set.cases().len()), (1, 3));
            true
        }
        Err(OfficeError::Start { .. } | OfficeError::NoStart { .. }) => false,
        Err(error) => panic!("{error}"),
    }
}

/// A runner that draws the same each time, so that what it meets is known.
fn runner(cases: u32) -> TestRunner {
    let config = Config { failure_persistence: None, ..Config::with_cases(cases) };
    TestRunner::new_with_rng(config, TestRng::deterministic_rng(RngAlgorithm::default()))
}

#[test]
fn no_lines_do_harm() {
    let (sound, recorded) = (Cell::new(0), Cell::new(0));
    let outcome = runner(400).run(&many(line(), 0..8), |lines| {
        let text = format!("plan 1\nroom 0 3 0 2\n{}\n", lines.join("\n"));
        if let Ok(plan) = text.parse::<Plan>() {
            prop_assert_eq!(&plan.to_string().parse::<Plan>().unwrap(), &plan);
            sound.set(sound.get() + 1);
            recorded.set(recorded.get() + u32::from(is_recorded(&plan)));
        }
        Ok(())
    });
    outcome.unwrap();
    let (sound, recorded) = (sound.get(), recorded.get());
    assert!(sound > 40 && recorded > 10 && recorded < sound, "{sound} are sound, {recorded} recorded");
}

#[test]
fn what_any_sound_plan_builds_can_be_recorded() {
    let recorded = Cell::new(0);
    let outcome = runner(32).run(&plan(), |plan| {
        recorded.set(recorded.get() + u32::from(is_recorded(&plan)));
        Ok(())
    });
    outcome.unwrap();
    assert!(recorded.get() > 4, "{} recorded", recorded.get());
}

#[test]
fn a_robot_can_stand_wherever_a_run_begins_in_presets_and_generated_buildings() {
    let small = Setup { width: 16, height: 16, columns: 1, ..Setup::default() };
    for kind in Kind::ALL {
        let generated = (0..6).map(|seed| Plan::generate(kind, seed, seed % 2 == 1));
        for plan in generated.chain([kind.plan()]) {
            let office = Office::build(&plan, &small, 1).unwrap();
            for run in 0..64 {
                assert_eq!(office.free_start(run, 0.24), Ok(office.start(run)), "{kind:?} {run}");
            }
        }
    }
}

#[test]
fn an_office_is_built_whose_start_is_in_the_way_but_nothing_is_recorded_there() {
    let small = Setup { width: 16, height: 16, columns: 1, ..Setup::default() };
    let office = |lines: &str| {
        let plan: Plan = format!("plan 1\nroom 0 12 -1.2 1.2\n{lines}").parse().unwrap();
        Office::build(&plan, &small, 1).unwrap()
    };
    let refused = office("box 3 0 2 1 1 0.2\nstart 6 0 0\nstart 3 0 90\nstart 6 1.2 90\nstart 6 -0.97 0\n");
    let error = |run| refused.free_start(run, 0.24).unwrap_err();
    assert_eq!(refused.free_start(0, 0.24), Ok(refused.start(0)));
    for (start, x, y) in [(1, 3.0, 0.0), (2, 6.0, 1.2), (3, 6.0, -0.97)] {
        assert_eq!(error(start as u64), OfficeError::Start { start, x, y, width: 0.48 });
    }
    assert!(refused.free_start(3, 0.2).is_ok(), "a narrower one can");
    assert!(refused.free_start(4, 0.24).is_ok(), "further starts are free places");
    let wall = office("start 6 1.2 90\n");
    assert!(matches!(record(&wall, "wall", 1, 1), Err(OfficeError::Start { start: 0, .. })));
    // Whoever walks there is no reason.
    let met = office("person 0 0.1 6 0 7 0\nstart 6 0 0\n");
    assert!(record(&met, "met", 1, 1).is_ok());
}

#[test]
fn a_plan_may_begin_with_a_byte_order_mark() {
    let text = Kind::Nsh.plan().to_string();
    assert_eq!(format!("\u{feff}{text}").parse::<Plan>().unwrap(), Kind::Nsh.plan());
    assert_eq!(
        "\u{feff}plan 1\nbin".parse::<Plan>().unwrap_err().to_string().split(':').next(),
        Some("line 2")
    );
}
