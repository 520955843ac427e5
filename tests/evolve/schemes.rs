//! Schemes of selection and variation: each does what it says, and no combination makes a run depend on threads or
//! interruptions.

use std::collections::BTreeMap;
use std::fs;
use std::sync::atomic::{AtomicBool, Ordering};

use vsonar::evolve::selection::Lexicase;
use vsonar::evolve::{CaseBits, Evolution, Parsimony, RunFolder, SelectionKind, Settings, State};
use vsonar::tree::Random;

use crate::common::*;

fn set(cases: usize, solved: &[usize]) -> CaseBits {
    CaseBits::from_fn(cases, |case| solved.contains(&case))
}

/// How often each is selected, as a share of `rounds`.
fn shares(count: usize, rounds: u32, mut select: impl FnMut(&mut Random) -> usize) -> Vec<f64> {
    let mut random = Random::stream(31, 1, 0);
    let mut selected = vec![0u32; count];
    (0..rounds).for_each(|_| selected[select(&mut random)] += 1);
    selected.iter().map(|&n| f64::from(n) / f64::from(rounds)).collect()
}

fn assert_near(found: &[f64], expected: &[f64], rounds: u32) {
    assert_eq!(found.len(), expected.len());
    for (i, (found, p)) in found.iter().zip(expected).enumerate() {
        let deviation = (p * (1.0 - p) / f64::from(rounds)).sqrt();
        assert!((found - p).abs() <= 5.0 * deviation, "{i}: {found} instead of {p}");
    }
}

#[test]
fn lexicase_by_hand() {
    let population = [set(3, &[0, 1]), set(3, &[0]), set(3, &[1, 2]), set(3, &[2]), set(3, &[1, 2])];
    let lexicase = Lexicase::new(population.iter(), None);
    assert_eq!(lexicase.classes(), 4);
    let rounds = 60_000;
    // 0 first: {0, 1}, then 1 decides (2 keeps nobody). 1 first: {0, 2, 4}, then 0 or 2 decides. 2 first:
    // {2, 3, 4}, then 1 decides. The third and the fifth are one class and share it.
    let expected = [0.5, 0.0, 0.25, 0.0, 0.25];
    assert_near(&shares(5, rounds, |random| lexicase.select(random)), &expected, rounds);
}

/// Against a reading of the definition by individuals and lists, over many more classes than a word has bits.
#[test]
fn lexicase_equals_the_definition() {
    let (individuals, cases) = (150, 40);
    let mut random = Random::stream(32, 0, 0);
    let mut population: Vec<CaseBits> = (0..individuals)
        .map(|i| CaseBits::from_fn(cases, |case| case != 7 && random.chance(0.6 + 0.002 * i as f64)))
        .collect();
    (0..20).for_each(|i| population[i + 20] = population[i].clone());
    let by_definition = |random: &mut Random| {
        let mut order: Vec<usize> = (0..cases).collect();
        (0..cases).for_each(|at| order.swap(at, at + random.index(cases - at)));
        let mut candidates: Vec<usize> = (0..individuals).collect();
        for case in order {
            if candidates.iter().any(|&i| population[i].contains(case)) {
                candidates.retain(|&i| population[i].contains(case));
            }
        }
        candidates[random.index(candidates.len())]
    };
    let rounds = 100_000;
    let expected = shares(individuals, rounds, by_definition);
    let lexicase = Lexicase::new(population.iter(), None);
    let found = shares(individuals, rounds, |random| lexicase.select(random));
    for (i, (a, b)) in found.iter().zip(&expected).enumerate() {
        let deviation = ((a + b).max(2e-5) / f64::from(rounds)).sqrt();
        assert!((a - b).abs() < 5.0 * deviation, "{i}: {a}, by definition {b}");
    }
    assert!(expected.iter().filter(|&&share| share > 0.0).count() > 20, "hardly anybody is ever selected");
}

#[test]
fn a_sample_hides_all_other_cases() {
    let population = [set(4, &[0, 1, 2]), set(4, &[3]), set(4, &[0, 3]), set(4, &[])];
    let rounds = 40_000;
    let of = |cases: &[usize]| {
        let lexicase = Lexicase::new(population.iter(), Some(&set(4, cases)));
        shares(4, rounds, |random| lexicase.select(random))
    };
    assert_near(&of(&[3]), &[0.0, 0.5, 0.5, 0.0], rounds);
    assert_near(&of(&[1, 2]), &[1.0, 0.0, 0.0, 0.0], rounds);
    // What nobody solves decides nothing.
    let nobody = [set(2, &[]), set(2, &[]), set(2, &[0])];
    let lexicase = Lexicase::new(nobody.iter(), Some(&set(2, &[1])));
    assert_near(&shares(3, rounds, |random| lexicase.select(random)), &[1.0 / 3.0; 3], rounds);
}

/// Runs without a folder.
fn state(settings: &Settings, threads: usize) -> State {
    let mut run = Evolution::new(&dataset(), settings.clone(), reference(), threads).expect("a run");
    run.run(&never(), |_| ()).expect("no error");
    run.state().expect("a state").clone()
}

/// The states after each generation.
fn states(settings: &Settings) -> Vec<State> {
    let mut run = Evolution::new(&dataset(), settings.clone(), reference(), 2).expect("a run");
    let mut states = Vec::new();
    while run.generations() < settings.generations {
        run.step(&never()).expect("no error");
        states.push(run.state().expect("a state").clone());
    }
    states
}

fn tiny() -> Settings {
    let mut settings = settings();
    (settings.population, settings.generations) = (31, 4);
    // So that they solve different cases, and the schemes differ.
    settings.filter.max_draws = 200;
    settings.tolerance = 6.0;
    settings
}

/// Every scheme with and without what can be switched on beside it.
fn combinations() -> Vec<(String, Settings)> {
    let mut all = Vec::new();
    for kind in [SelectionKind::Tournament, SelectionKind::Sharing, SelectionKind::Lexicase] {
        for parsimony in [Parsimony::None, Parsimony::Lexicographic, Parsimony::Double] {
            for (share, elitism, islands, mutation) in
                [(1.0, 0, 1, 0.0), (0.3, 0, 4, 0.1), (1.0, 3, 1, 0.2), (0.5, 2, 3, 0.0), (0.05, 1, 15, 0.2)]
            {
                let mut s = tiny();
                (s.selection.kind, s.selection.parsimony) = (kind, parsimony);
                (s.selection.case_share, s.selection.elitism) = (share, elitism);
                (s.islands.count, s.islands.interval, s.islands.migrants) = (islands, 2, 1);
                let b = &mut s.breeding;
                b.crossover_probability -= 4.0 * mutation * f64::from(u8::from(mutation > 0.0));
                b.subtree_mutation_probability = mutation;
                b.point_mutation_probability = mutation;
                b.constant_mutation_probability = mutation;
                b.hoist_mutation_probability = mutation;
                let name = format!("{kind:?} {parsimony:?} {share} {elitism} {islands} {mutation}");
                all.push((name, s));
            }
        }
    }
    all
}

#[test]
fn no_combination_depends_on_threads_or_interruptions() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let mut different: BTreeMap<Vec<String>, Vec<String>> = BTreeMap::new();
    for (number, (name, settings)) in combinations().into_iter().enumerate() {
        let expected = state(&settings, 1).without_timing();
        assert_eq!(expected.population.len(), 31, "{name}");
        assert!(state(&settings, 2).without_timing() == expected, "{name}: two threads");
        let path = dir.path().join(number.to_string());
        drop(RunFolder::create(&path, &settings, &toml::Table::new()).expect("a fresh folder"));
        for _ in 0..settings.generations {
            let stop = AtomicBool::new(false);
            resume(&path).run(&stop, |_| stop.store(true, Ordering::Relaxed)).expect("no error");
        }
        assert!(resume(&path).state().expect("a state").without_timing() == expected, "{name}: interrupted");
        let programs: Vec<String> = expected.population.iter().map(|m| m.individual().to_string()).collect();
        // On islands of two all schemes come to much the same.
        if settings.islands.count < 10 {
            different.entry(programs).or_default().push(name);
        }
    }
    // So no setting is without effect.
    let same: Vec<&Vec<String>> = different.values().filter(|names| names.len() > 1).collect();
    assert_eq!(different.len(), 36, "{same:#?} are the same run");
}

#[test]
fn executors_select_the_same() {
    let (_, settings) = combinations().pop().expect("there are some");
    let dir = tempfile::tempdir().expect("a temporary folder");
    let run = |executor: std::sync::Arc<dyn vsonar::exec::Executor>| {
        run_in(&dir.path().join(executor.name()), &settings, executor, 2).without_timing()
    };
    let mut states = executors().into_iter().map(run);
    let expected = states.next().expect("there are executors");
    assert!(states.all(|state| state == expected));
}

#[test]
fn the_best_are_copied_unchanged() {
    for (elitism, islands) in [(3u32, 1u32), (2, 4)] {
        let mut settings = tiny();
        (settings.population, settings.generations) = (60, 6);
        (settings.selection.elitism, settings.islands.count) = (elitism, islands);
        settings.islands.interval = 1000;
        let states = states(&settings);
        let size = (60 / islands) as usize;
        for pair in states.windows(2) {
            for island in 0..islands as usize {
                let of = |state: &State| state.population[island * size..][..size].to_vec();
                let (before, after) = (of(&pair[0]), of(&pair[1]));
                let mut best: Vec<usize> = (0..size).collect();
                best.sort_by_key(|&i| {
                    (std::cmp::Reverse(before[i].correct()), before[i].individual().len(), i)
                });
                for (slot, &i) in best.iter().take(elitism as usize).enumerate() {
                    assert!(after[slot] == before[i], "island {island}, slot {slot}");
                }
            }
            assert!(
                pair[0].records.last().map(|r| r.best_fitness)
                    <= pair[1].records.last().map(|r| r.best_fitness)
            );
        }
    }
}

/// Without migration an island never sees another: what it becomes is a matter of its own slots.
#[test]
fn islands_are_apart_but_for_migration() {
    let mut settings = tiny();
    (settings.population, settings.generations) = (60, 5);
    settings.breeding.crossover_probability = 0.0;
    settings.islands.count = 3;
    settings.islands.migrants = 4;
    // Everything is copied, so that programs tell where they come from.
    let foreign = |interval: u32| -> Vec<usize> {
        let mut settings = settings.clone();
        settings.islands.interval = interval;
        let states = states(&settings);
        let home: BTreeMap<String, usize> = states[0]
            .population
            .iter()
            .enumerate()
            .map(|(slot, m)| (m.individual().to_string(), slot / 20))
            .collect();
        let strangers = |state: &State| {
            let all = state.population.iter().enumerate();
            all.filter(|(slot, m)| home[&m.individual().to_string()] != slot / 20).count()
        };
        states.iter().map(strangers).collect()
    };
    assert_eq!(foreign(100), [0; 5]);
    let found = foreign(3);
    // Generation 3 is the first that is bred from migrants too; the best of the neighbours are selected often.
    assert!(found[..3] == [0; 3] && found[3] > 5 && found[4] > 0, "{found:?}");
}

fn mean_nodes(settings: &Settings) -> f64 {
    let seeds = 1..=4;
    let of = |seed| {
        let mut settings = settings.clone();
        settings.seed = seed;
        state(&settings, 2).records.last().expect("generations").mean_nodes
    };
    seeds.map(of).sum::<f64>() / 4.0
}

#[test]
fn parsimony_keeps_individuals_small() {
    for kind in [SelectionKind::Tournament, SelectionKind::Sharing, SelectionKind::Lexicase] {
        let mut settings = tiny();
        (settings.population, settings.generations, settings.selection.kind) = (100, 6, kind);
        let none = mean_nodes(&settings);
        for parsimony in [Parsimony::Lexicographic, Parsimony::Double] {
            settings.selection.parsimony = parsimony;
            let found = mean_nodes(&settings);
            assert!(found < 0.9 * none, "{kind:?} {parsimony:?}: {found} nodes, {none} without");
        }
        settings.selection.size_tournament = 1.0;
        let even = mean_nodes(&settings);
        assert!(even > 0.75 * none, "{kind:?}: a tournament on size without pressure: {even}, {none}");
    }
}

/// The fields that came after the first run folders.
const LATER: [&str; 13] = [
    "subtree_mutation_probability",
    "point_mutation_probability",
    "constant_mutation_probability",
    "hoist_mutation_probability",
    "mutation_depth",
    "constant_step",
    "case_share",
    "elitism",
    "parsimony",
    "size_tournament",
    "count",
    "interval",
    "migrants",
];

/// A run folder as it was written before there were these fields.
#[test]
fn a_run_from_before_these_settings_goes_on() {
    let dir = tempfile::tempdir().expect("a temporary folder");
    let (whole, begun) = (dir.path().join("whole"), dir.path().join("begun"));
    let expected = run_in(&whole, &settings(), reference(), 2).without_timing();
    drop(RunFolder::create(&begun, &settings(), &toml::Table::new()).expect("a fresh folder"));
    let stop = AtomicBool::new(false);
    resume(&begun).run(&stop, |_| stop.store(true, Ordering::Relaxed)).expect("no error");
    let text = read(&begun, "settings.toml");
    let is_later = |line: &str| line.split_once(" = ").is_some_and(|(field, _)| LATER.contains(&field));
    assert_eq!(text.lines().filter(|line| is_later(line)).count(), LATER.len());
    let lines = text.lines().filter(|line| !is_later(line) && *line != "[islands]");
    let old: String = lines.map(|line| format!("{line}\n")).collect();
    fs::write(begun.join("settings.toml"), old).expect("writable");
    resume(&begun).run(&never(), |_| ()).expect("no error");
    assert!(resume(&begun).state().expect("a state").without_timing() == expected);
    assert_eq!(content(&begun), content(&whole));
    // From now on the folder holds every field.
    assert_eq!(read(&begun, "settings.toml"), text);
}
