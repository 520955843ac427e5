//! Collapse: each side of each threshold, what is said of it, and runs that come to it.

use vsonar::evolve::{
    Collapse, Evolution, Parsimony, Preset, Record, RunFolder, SelectionKind, Settings, StopReason, Warning,
};

use crate::common::*;

/// Of a log whose best stays at 40 % while all else is well.
fn alive(generation: u32) -> Record {
    let line = r#"{"generation":0,"best_fitness":0.4,"mean_fitness":0.2,"median_fitness":0.2,
        "best_fitness_so_far":0.4,"evaluations":90,"evaluations_total":90,"best_nodes":70,"mean_nodes":100.0,
        "max_nodes":300,"mean_depth":8.5,"max_depth":9,"distinct_programs":99,"distinct_behaviours":50,
        "constant_share":0.1,"largest_behaviour":0.3,"case_entropy":1.0,"solved_by_nobody":0,
        "hardest_case":{"case":3,"solvers":1},"timing":{"lower":0.0,"compile":0.0,"execute":0.0,"breed":0.0,
        "record":0.0,"save":0.0,"wall":1.5,"executed":9,"ms_per_uncached":0.5}}"#;
    Record { generation, ..serde_json::from_str(line).expect("a record") }
}

fn settings_of_100() -> Settings {
    let mut settings = Settings::paper();
    settings.population = 100;
    settings
}

/// What eleven records tell of a run on 256 cases, the last so many of which are changed.
fn told(last: usize, change: impl Fn(&mut Record)) -> Option<Collapse> {
    let mut records: Vec<Record> = (0..11).map(alive).collect();
    records[11 - last..].iter_mut().for_each(change);
    Collapse::of(&records, &settings_of_100(), 256)
}

type Change<'a> = &'a dyn Fn(&mut Record);

#[test]
fn each_side_of_each_threshold() {
    let all: [(Option<Collapse>, Change); 10] = [
        (None, &|_| ()),
        (None, &|r| r.constant_share = 0.49),
        (Some(Collapse::Constants), &|r| r.constant_share = 0.5),
        (None, &|r| r.largest_behaviour = Some(0.49)),
        (Some(Collapse::Converged), &|r| r.largest_behaviour = Some(0.5)),
        (None, &|r| r.distinct_behaviours = 2),
        (Some(Collapse::Converged), &|r| r.distinct_behaviours = 1),
        // Seven bits of eight.
        (None, &|r| r.case_entropy = Some(0.875)),
        (Some(Collapse::Converged), &|r| r.case_entropy = Some(0.874)),
        (Some(Collapse::Bloat), &|r| r.mean_nodes = 301.0),
    ];
    for (i, (kind, change)) in all.iter().enumerate() {
        assert_eq!(told(5, change), *kind, "{i}");
        assert_eq!(told(4, change), None, "{i}: four generations are not enough");
    }
    let both = |r: &mut Record| (r.constant_share, r.largest_behaviour) = (0.9, Some(0.9));
    assert_eq!(told(5, both), Some(Collapse::Constants), "the more telling of two");
    let unknown = |r: &mut Record| (r.largest_behaviour, r.case_entropy) = (None, None);
    assert_eq!(told(11, unknown), None, "records of earlier releases");
}

#[test]
fn growth_counts_from_when_the_best_was_found() {
    let told = |found: f64, now: f64| {
        let mut records: Vec<Record> = (0..20).map(alive).collect();
        records[..4].iter_mut().for_each(|r| (r.best_fitness_so_far, r.mean_nodes) = (0.1, 10.0));
        records[4].mean_nodes = found;
        records[15..].iter_mut().for_each(|r| r.mean_nodes = now);
        Collapse::of(&records, &settings_of_100(), 256)
    };
    assert_eq!([told(150.0, 300.0), told(151.0, 302.0)], [None, None]);
    assert_eq!([told(150.0, 301.0), told(151.0, 303.0)], [Some(Collapse::Bloat); 2]);
}

#[test]
fn not_while_there_is_progress_or_nothing_left_to_solve() {
    let told = |then: f64, now: f64, generations: u32| {
        let mut records: Vec<Record> = (0..generations).map(alive).collect();
        records.iter_mut().for_each(|r| (r.constant_share, r.best_fitness_so_far) = (1.0, then));
        records.last_mut().expect("records").best_fitness_so_far = now;
        Collapse::of(&records, &settings_of_100(), 256)
    };
    let constants = Some(Collapse::Constants);
    assert_eq!(
        [told(0.4, 0.4, 10), told(0.4, 0.4, 11)],
        [None, constants],
        "ten generations to look back on"
    );
    // Of the 60 % that are missing, a twentieth is 3 %.
    assert_eq!([told(0.4, 0.429, 30), told(0.4, 0.431, 30)], [constants, None]);
    assert_eq!([told(0.989, 0.989, 30), told(0.99, 0.99, 30)], [constants, None]);
    assert_eq!(Collapse::of(&[], &settings_of_100(), 0), None);
}

fn warned(kind: Collapse, settings: &Settings) -> Warning {
    let mut records: Vec<Record> = (0..11).map(alive).collect();
    records[10].warning = Some(kind);
    Warning::of(&records, settings).expect("a warning")
}

#[test]
fn a_warning_says_what_was_seen() {
    assert_eq!(Warning::of(&[alive(0)], &settings_of_100()), None);
    let text = |kind| warned(kind, &settings_of_100()).to_string();
    let constants = text(Collapse::Constants);
    assert!(constants.contains("constant answers: 10.0 % of the individuals"), "{constants}");
    let converged = text(Collapse::Converged);
    for part in ["50 behaviours", "100 individuals", "30.0 % of which", "solved is 1.00", "solves 40.0 % of"]
    {
        assert!(converged.contains(part), "{converged}");
    }
    assert!(converged.ends_with("`--population 4000` or `--seed 2`"), "{converged}");
    let bloat = text(Collapse::Bloat);
    assert!(bloat.contains("100 nodes on average, 100 when the best was found in generation 0"), "{bloat}");
    let kinds = [Collapse::Constants, Collapse::Converged, Collapse::Bloat];
    let names = serde_json::to_string(&kinds).expect("JSON");
    assert_eq!(names, r#"["constants","converged","bloat"]"#, "scripts know them by these names");
}

/// Only what the run has not, and what the settings take.
#[test]
fn remedies_change_something_possible() {
    let mut seen = std::collections::BTreeSet::new();
    for i in 0..128u32 {
        let bit = |n: u32| i >> n & 1 == 1;
        let mut settings = Settings::preset(if bit(0) { Preset::Paper } else { Preset::Default });
        settings.filter.enabled ^= bit(1);
        settings.selection.kind =
            [SelectionKind::Tournament, SelectionKind::Sharing, SelectionKind::Lexicase]
                [(i as usize >> 2) % 3];
        settings.selection.parsimony =
            [Parsimony::None, Parsimony::Lexicographic, Parsimony::Double][(i as usize >> 3) % 3];
        // No room is left for mutation.
        settings.breeding = Settings::paper().breeding;
        settings.breeding.crossover_probability = if bit(5) { 1.0 } else { 0.9 };
        settings.population = if bit(6) { 6 } else { 4000 };
        settings.validate().expect("possible");
        for kind in [Collapse::Constants, Collapse::Converged, Collapse::Bloat] {
            let remedies = warned(kind, &settings).remedies;
            assert!((1..=6).contains(&remedies.len()), "{remedies:?}");
            for remedy in remedies {
                let (flag, value) = remedy.split_once(' ').expect("a flag and its value");
                let toml = match flag {
                    "--set" => {
                        let (field, value) = value.split_once('=').expect("a field");
                        let bare = value == "true" || value.parse::<f64>().is_ok();
                        if bare { format!("{field} = {value}") } else { format!("{field} = \"{value}\"") }
                    }
                    "--preset" => format!("preset = \"{value}\""),
                    _ => format!("{} = {value}", flag.trim_start_matches('-')),
                };
                let changed = settings.clone().with_toml(&toml, "remedy").expect("possible");
                assert_ne!(changed, settings, "{remedy}");
                seen.insert(remedy);
            }
        }
    }
    assert_eq!(seen.len(), 11, "{seen:?}");
}

/// A population that is too small, and selected too hard, for what it shall find.
fn hopeless() -> Settings {
    let mut settings = settings();
    settings.generations = 18;
    settings.filter.enabled = false;
    settings.selection.kind = SelectionKind::Tournament;
    settings
}

#[test]
fn a_run_that_collapses_says_so_whatever_threads_and_interruptions() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let whole = dir.path().join("whole");
    let state = run_in(&whole, &hopeless(), reference(), 2);
    let warnings: Vec<_> = state.records.iter().map(|r| r.warning).collect();
    assert!(warnings[..10].iter().all(Option::is_none), "too early: {warnings:?}");
    assert!(warnings[17].is_some(), "{warnings:?}");
    for (i, warning) in warnings.iter().enumerate() {
        assert_eq!(*warning, Collapse::of(&state.records[..=i], &hopeless(), 24));
    }
    assert_eq!(log(&whole)[17]["warning"], serde_json::to_value(warnings[17]).expect("JSON"));

    let other = dir.path().join("other");
    run_in(&other, &hopeless(), reference(), 1);
    assert_eq!(content(&whole), content(&other));

    let first = warnings.iter().position(Option::is_some).expect("a warning") as u32;
    for cut in [first - 3, first, first + 1] {
        let path = dir.path().join(format!("cut-{cut}"));
        let mut short = hopeless();
        short.generations = cut;
        run_in(&path, &short, reference(), 2);
        let (folder, recorded) = RunFolder::open(&path).expect("a run folder");
        let longer = recorded.extended(18).expect("more is allowed");
        let mut run = Evolution::in_folder(folder, &dataset(), longer, reference(), 2).expect("a run");
        assert_eq!(run.run(&never(), |_| ()).expect("no error"), StopReason::Finished);
        assert_eq!(run.warning().map(|w| w.kind), warnings[17]);
        assert_eq!(content(&whole), content(&path));
    }
}
