//! Plans: their text goes both ways, and no text does harm.

use proptest::collection::vec as many;
use proptest::prelude::*;
use vsonar::world::geometry::Room;
use vsonar::world::office::{Item, ItemKind, Kind, Light, Person, Plan, PlanError, Start, Stripe};

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
    fn no_text_does_harm(bytes in proptest::collection::vec(any::<u8>(), 0..300)) {
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
