//! The numbers of a generation, held against the members themselves.

use std::collections::{HashMap, HashSet};

use vsonar::dataset::Dataset;
use vsonar::evolve::{CaseBits, Evolution, Member, Settings, SharedSet, State, is_correct};
use vsonar::exec::Candidate;

use crate::common::*;

fn state(settings: Settings) -> State {
    let mut run = Evolution::new(&dataset(), settings, reference(), 2).expect("a run");
    run.run(&never(), |_| ()).expect("no error");
    run.state().expect("a state").clone()
}

fn answers(member: &Member) -> Vec<f32> {
    let set = dataset();
    let mut answers = vec![0.0; set.cases().len()];
    let mut worker = reference().worker().expect("a worker");
    let candidate = Candidate::new(member.individual(), WIDTH, HEIGHT);
    worker.answers(&candidate, &set.case_set(), &mut answers).expect("answers");
    answers
}

#[test]
fn a_record_counts_what_is_there() {
    let state = state(settings());
    let (record, members) = (state.records.last().expect("records"), &state.population);
    let labels = dataset().labels();
    let mut correct = Vec::new();
    let mut behaviours = HashMap::new();
    let mut solvers = [0u32; 24];
    let mut constants = 0;
    for member in members {
        let answers = answers(member);
        let solved = CaseBits::from_fn(answers.len(), |i| is_correct(answers[i], f64::from(labels[i]), 3.0));
        assert_eq!(solved, member.outcome.solved);
        correct.push(f64::from(member.correct()));
        let bits = |a: &f32| if a.is_nan() { None } else { Some(a.to_bits()) };
        *behaviours.entry(answers.iter().map(bits).collect::<Vec<_>>()).or_insert(0u32) += 1;
        (0..24).filter(|&i| solved.contains(i)).for_each(|i| solvers[i] += 1);
        constants +=
            usize::from(answers.iter().all(|&a| a == answers[0] || (a.is_nan() && answers[0].is_nan())));
    }
    correct.sort_by(f64::total_cmp);
    let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-12, "{a} is not {b}");
    near(record.best_fitness, correct[59] / 24.0);
    near(record.mean_fitness, correct.iter().sum::<f64>() / 60.0 / 24.0);
    near(record.median_fitness, (correct[29] + correct[30]) / 48.0);
    near(record.constant_share, constants as f64 / 60.0);
    assert_eq!(record.distinct_behaviours as usize, behaviours.len());
    let largest = behaviours.values().max().expect("members");
    near(record.largest_behaviour.expect("counted"), f64::from(*largest) / 60.0);
    let total = f64::from(solvers.iter().sum::<u32>());
    let terms =
        solvers.iter().filter(|&&n| n > 0).map(|&n| f64::from(n) / total * (total / f64::from(n)).ln());
    near(record.case_entropy.expect("counted"), terms.sum::<f64>() / 24f64.ln());
    let nobody = solvers.iter().filter(|&&n| n == 0).count();
    assert_eq!(record.solved_by_nobody.expect("counted") as usize, nobody);
    let hardest = record.hardest_case.expect("there are cases");
    let fewest = solvers.iter().min().expect("cases");
    assert_eq!(
        (hardest.solvers, Some(hardest.case as usize)),
        (*fewest, solvers.iter().position(|n| n == fewest))
    );
    let texts: HashSet<String> = members.iter().map(|m| m.individual().to_string()).collect();
    assert_eq!(record.distinct_programs as usize, texts.len());
    let nodes = members.iter().map(|m| m.individual().len());
    assert_eq!(record.max_nodes as usize, nodes.clone().max().expect("members"));
    near(record.mean_nodes, nodes.sum::<usize>() as f64 / 60.0);
    let depths = members.iter().map(|m| m.individual().depth());
    assert_eq!(record.max_depth as usize, depths.clone().max().expect("members"));
    near(record.mean_depth, depths.sum::<usize>() as f64 / 60.0);
    let so_far = state.records.iter().map(|r| r.best_fitness).fold(0.0, f64::max);
    near(record.best_fitness_so_far, so_far);
    assert!(record.evaluations < 60 && record.evaluations > 30, "{} of 60 are no copies", record.evaluations);
}

#[test]
fn the_filter_keeps_what_looks_like_answers() {
    let mut settings = settings();
    settings.generations = 1;
    settings.filter.max_draws = 200;
    settings.filter.distinct = 5;
    let state = state(settings);
    let unfit = state.population.iter().filter(|member| {
        let answers = answers(member);
        let in_range = answers.iter().filter(|&&a| (0.0..=47.0).contains(&a)).count();
        let finite = answers.iter().filter(|a| a.is_finite());
        let distinct: HashSet<u64> = finite.map(|&a| (f64::from(a) + 0.0).to_bits()).collect();
        2 * in_range < answers.len() || distinct.len() < 5
    });
    let (unfit, initial) =
        (unfit.count() as u64, state.records[0].initial.expect("of the initial generation"));
    assert_eq!(unfit, initial.unfit_kept);
    assert!(unfit < 30, "{unfit} of 60 unfit after 200 draws");
    assert!(initial.draws > 120, "{} draws: the filter rejects most", initial.draws);
    assert_eq!(state.records[0].evaluations, initial.draws);
}

#[test]
fn without_the_filter_every_draw_is_kept() {
    let mut settings = settings();
    settings.generations = 1;
    settings.filter.enabled = false;
    let state = state(settings);
    let initial = state.records[0].initial.expect("of the initial generation");
    assert_eq!((initial.draws, initial.unfit_kept), (60, 0));
    assert_eq!(state.records[0].evaluations, 60);
}

#[test]
fn the_hall_of_fame_is_a_front() {
    let state = state(settings());
    let entries = state.hall_of_fame.entries();
    assert!(!entries.is_empty());
    for pair in entries.windows(2) {
        assert!(pair[0].individual.len() < pair[1].individual.len() && pair[0].correct < pair[1].correct);
    }
    // No member of the last generation beats it.
    for member in &state.population {
        let beaten = |e: &vsonar::evolve::Entry| {
            e.individual.len() <= member.individual().len() && e.correct >= member.correct()
        };
        assert!(entries.iter().any(beaten));
    }
}

#[test]
fn the_summary_scores_the_best() {
    let mut run = Evolution::new(&dataset(), settings(), reference(), 2).expect("a run");
    assert_eq!(run.summary(None).expect("no error"), None);
    run.run(&never(), |_| ()).expect("no error");
    let summary = run.summary(Some(&dataset())).expect("no error").expect("there are generations");
    assert_eq!(summary.holdout, Some(summary.train));
    assert_eq!(summary.generations, 5);
    let other = run.summary(Some(&dataset_with(9))).expect("no error").expect("there are generations");
    assert_eq!(other.best, summary.best);
    assert_eq!(other.holdout.map(|s| s.cases), Some(24));
}

#[test]
fn validation_changes_nothing_but_the_winner() {
    let with = |validation: Option<&Dataset>, threads: usize| {
        let mut run = Evolution::new(&dataset(), settings(), reference(), threads).expect("a run");
        validation.iter().try_for_each(|set| run.validate_on(&SharedSet::new(set))).expect("possible");
        run.run(&never(), |_| ()).expect("no error");
        run
    };
    let other = dataset_with(9);
    let (plain, validated) = (with(None, 1), with(Some(&other), 2));
    let (a, b) = (plain.state().expect("generations"), validated.state().expect("generations"));
    assert_eq!((&a.population, &a.hall_of_fame), (&b.population, &b.hall_of_fame));
    assert!(a.records.iter().all(|r| r.validation_fitness.is_none()));
    // The winner is whichever of the hall of fame solves most of the other set.
    let score =
        |entry: &vsonar::evolve::Entry| validated.score(&entry.individual, &other).expect("possible").correct;
    let most = b.hall_of_fame.entries().iter().map(score).max();
    let winner = b.hall_of_fame.entries().iter().find(|e| Some(score(e)) == most).expect("one");
    let summary = validated.summary(None).expect("no error").expect("generations");
    assert_eq!((&summary.best, summary.train.correct), (&winner.individual, winner.correct));
    assert_eq!(summary.validation.map(|s| s.correct), most);
    assert_eq!(b.records.last().and_then(|r| r.validation_fitness), summary.validation.map(|s| s.fitness));
    // On the training cases themselves the fittest in training is chosen.
    let own = with(Some(&dataset()), 1);
    let (own, plain) = (own.summary(None).expect("no error"), plain.summary(None).expect("no error"));
    assert_eq!(own.map(|s| s.best), plain.map(|s| s.best));
}

#[test]
fn a_single_tree_and_an_odd_population() {
    let mut settings = settings();
    settings.trees = 1;
    settings.population = 31;
    settings.nodes.edit("-raw").expect("a node type");
    let state = state(settings);
    assert_eq!(state.population.len(), 31);
    for member in &state.population {
        assert!(member.individual().first().is_none());
        let text = member.individual().to_string();
        assert!(!text.split([' ', '(', ')', '\n']).any(|word| word == "raw"), "{text}");
    }
}
