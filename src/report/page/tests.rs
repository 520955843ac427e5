//! The page as a whole, of reports made by hand.

use super::*;
use crate::dataset::{Case, Constants, Dataset, NamedImage};
use crate::evolve::{Record, Settings};
use crate::explain::Explanation;
use crate::tree::Individual;

/// A generation as a full run has it.
fn record(generation: u32) -> Record {
    let x = f64::from(generation);
    let text = format!(
        r#"{{"generation":{generation},"best_fitness":{},"mean_fitness":0.41,"median_fitness":0.4,"best_fitness_so_far":{},
        "validation_fitness":0.5,"evaluations":4000,"evaluations_total":{},"best_nodes":50,"mean_nodes":{},"max_nodes":2466,
        "mean_depth":7.195,"max_depth":9,"distinct_programs":3982,"distinct_behaviours":2489,"constant_share":0.1,
        "largest_behaviour":0.003,"case_entropy":0.9,"solved_by_nobody":0,"hardest_case":{{"case":72,"solvers":1}},
        "operations_before":4.8,"operations_after":1.6,"timing":{{"lower":0.09,"compile":0.01,"execute":0.97,"evaluate":1.4,
        "busy":0.98,"breed":0.1,"record":0.001,"save":0.01,"wall":1.5,"executed":1057,"ms_per_uncached":0.2}}}}"#,
        0.4 + 0.01 * x.min(50.0),
        0.4 + 0.01 * x.min(50.0),
        4000 * (generation + 1),
        190.0 - x.min(100.0),
    );
    serde_json::from_str(&text).expect("a record")
}

/// The same gray values each time, of which none tells the next.
fn noise() -> impl FnMut() -> u8 {
    let mut state = 1u32;
    move || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 24) as u8
    }
}

fn progress(generations: u32) -> Run {
    let settings = Settings { generations, ..Settings::default_preset() };
    let records = (0..generations).map(record).collect();
    Run::progress("runs/one".as_ref(), "photos".to_string(), &settings, settings.to_toml(), records)
}

fn page(run: Run) -> String {
    html(&Report { title: "A run".into(), runs: vec![run], comparison: None, command: None }).expect("drawn")
}

/// A run of the paper's size on images that no format makes small, with a hall of fame of large programs.
#[test]
fn the_page_of_a_full_run_is_below_5_mb() {
    let mut run = progress(51);
    let mut noise = noise();
    let images = (0..71).map(|i| NamedImage {
        name: format!("image_{i}.png"),
        pixels: image::GrayImage::from_fn(640, 480, |_, _| image::Luma([noise()])),
    });
    let images: Vec<NamedImage> = images.collect();
    let case = |image: usize| (0..6).map(move |i| Case { image, x: 50 + 100 * i, y: 200 });
    let set = Dataset::new("noise", images, (0..71).flat_map(case).collect()).expect("sound");
    let answers: Vec<f32> = (0..set.cases().len()).map(|i| (i * 7 % 480) as f32).collect();
    let constants = Constants::learn(&set, 10.0);
    let look = Look {
        part: Part::Holdout,
        tolerance: 10.0,
        camera: None,
        constants: &constants,
        window: None,
        pictures: PictureRoom::of(1),
    };
    run.answers = Some(Answers::of(&set, &answers, &look));
    let body = (0..2000).fold("gradient".to_string(), |text, i| {
        if i % 2 == 0 {
            text
        } else {
            format!("{text} ; a comment of some length, as a large program has many lines\n")
        }
    });
    for i in 0..100 {
        run.hall_of_fame.push(Member {
            nodes: 10 * i,
            generation: 3,
            fitness: 0.5,
            train: Some(0.4),
            validation: Some(0.3),
            holdout: Some(0.2),
            winner: i == 99,
            program: body.clone(),
        });
    }
    let page = page(run);
    let pictures = page.matches("data:image/png;base64,").count();
    assert!(pictures >= 4, "{pictures}");
    assert!(page.len() < 5_000_000, "{}", page.len());
    assert!(page.contains("hall_of_fame.jsonl"), "says where the programs are that it leaves out");
}

#[test]
fn a_run_that_goes_on_is_shown_from_its_records_alone() {
    for generations in [0, 1, 2, 51] {
        let settings = Settings { generations: 60, ..Settings::paper() };
        let records: Vec<Record> = (0..generations).map(record).collect();
        let run = Run::progress("r".as_ref(), "photos".into(), &settings, settings.to_toml(), records);
        assert_eq!((run.preset, run.is_complete()), ("paper", false));
        assert_eq!(run.differing.iter().map(|d| d.name.as_str()).collect::<Vec<_>>(), ["generations"]);
        let page = page(run);
        assert!(!page.contains("NaN") && !page.contains("inf "), "{generations}");
        assert_eq!(page.contains("<figcaption>Fitness</figcaption>"), generations > 0);
    }
}

#[test]
fn no_control_character_comes_into_the_page() {
    let mut run = progress(1);
    run.name = "a\u{1b}[31m\u{0}b".to_string();
    run.folder = run.name.clone();
    let page = page(run);
    assert!(page.contains(r"a\u{1b}[31m\u{0}b"));
    assert!(page.chars().all(|c| !c.is_control() || c == '\n'), "none");
}

/// A long run's page does not grow with it beyond what can be read.
#[test]
fn long_runs_are_thinned() {
    let page = page(progress(5000));
    assert!(page.len() < 2_500_000, "{}", page.len());
}

#[test]
fn the_winner_s_text_is_there_as_text() {
    let mut run = progress(3);
    let winner: Individual =
        "(individual (iterate-up 3x3 x-obstacle (if-le gradient 50 read-a (prog2 (set-a y) break))))"
            .parse()
            .expect("a program");
    let mut program = Program::of(&winner);
    assert_eq!(program.operators, ["gradient"]);
    program.compiled = Some(Compiled::of(&winner, (320, 240)));
    let explanation = Explanation::new(&winner, 320, 240).expect("readable");
    program.explanation = Some(ProgramText::of(&explanation, &winner));
    run.program = Some(program);
    let page = page(run);
    for text in [
        "(if-le gradient 50",
        "if gradient &gt; 50:",
        "bit for bit",
        "after the optimiser",
        "data:image/svg+xml",
    ] {
        assert!(page.contains(text), "{text}");
    }
}

#[test]
fn no_more_pairs_than_settings() {
    let mut other = progress(5);
    other.seed = 9;
    let runs = vec![progress(5), other];
    let settings = [
        Settings { generations: 5, ..Settings::default_preset() },
        Settings { generations: 5, seed: 9, ..Settings::default_preset() },
    ];
    let comparison = Comparison::of(&runs, &settings);
    assert_eq!((comparison.settings.len(), comparison.pairs.len(), comparison.part), (1, 0, None));
    let mut apart = runs.clone();
    apart[1].data_table.insert("data.folder.gap".into(), "8".into());
    assert_eq!(Comparison::of(&apart, &settings).settings.len(), 2, "called the same, but cut otherwise");
    let paper = [settings[0].clone(), Settings { generations: 5, ..Settings::paper() }];
    let comparison = Comparison::of(&runs, &paper);
    assert_eq!(comparison.settings.len(), 2);
    let report = Report { title: "two".into(), runs, comparison: Some(comparison), command: None };
    let page = html(&report).expect("drawn");
    assert!(page.contains("selection.kind") && page.contains("c-best"));
}

fn scored(part: Part, fitness: f64) -> Score {
    let (correct, cases, images) = ((100.0 * fitness) as u32, 100, 20);
    Score { part, fitness, correct, cases, images, interval: None, constant: 0.2, constant_per_column: 0.3 }
}

#[test]
fn a_run_made_twice_counts_once() {
    let settings = [1, 1, 9].map(|seed| Settings { generations: 5, seed, ..Settings::default_preset() });
    let mut runs = vec![progress(3), progress(5), progress(5)];
    runs[2].seed = 9;
    for (run, name) in runs.iter_mut().zip(["short", "whole", "other"]) {
        run.folder = name.to_string();
        run.scores.push(scored(Part::Training, 0.5));
    }
    let comparison = Comparison::of(&runs, &settings);
    assert_eq!(comparison.settings[0].runs, [1, 2], "the one that got further");
    assert_eq!(comparison.again, [(0, 1)]);
    let report = Report { title: "again".into(), runs, comparison: Some(comparison), command: None };
    let page = html(&report).expect("drawn");
    assert!(page.contains("short is whole once more"));
    assert!(!page.contains("Not complete") && !page.contains("ended sooner"), "it does not count");
}

#[test]
fn a_run_that_goes_on_leaves_the_test_to_those_that_are_complete() {
    let settings: Vec<Settings> = (0..6)
        .map(|i| Settings {
            generations: 5,
            seed: i % 3,
            tolerance: if i < 3 { 10.0 } else { 8.0 },
            ..Settings::default_preset()
        })
        .collect();
    let mut runs: Vec<Run> = (0..6).map(|_| progress(5)).collect();
    for (run, settings) in runs.iter_mut().zip(&settings) {
        run.seed = settings.seed;
        run.scores = vec![scored(Part::Training, 0.9), scored(Part::Holdout, 0.1 * settings.tolerance / 2.0)];
    }
    assert_eq!(Comparison::of(&runs, &settings).part, Some(Part::Holdout));
    runs[4].records.truncate(2);
    runs[4].scores.pop();
    let comparison = Comparison::of(&runs, &settings);
    assert_eq!((comparison.part, comparison.pairs.len()), (Some(Part::Holdout), 1));
    assert_eq!(comparison.pairs[0].a12, 1.0, "of what is held out");
    // Nor does it count where all have scores.
    let mut everything = runs.clone();
    everything.iter_mut().for_each(|run| run.scores.truncate(1));
    everything[4].scores[0].fitness = 1.0;
    everything[3].scores[0].fitness = 0.8;
    everything[5].scores[0].fitness = 0.8;
    let comparison = Comparison::of(&everything, &settings);
    assert_eq!((comparison.part, comparison.pairs[0].a12), (Some(Part::Training), 1.0), "2 against 3");
    for run in &mut runs[3..] {
        run.records.truncate(2);
        run.scores.truncate(1);
    }
    assert_eq!(Comparison::of(&runs, &settings).part, Some(Part::Training), "of none of a setting");
}

/// Errors, pictures and curves of as many runs as have details.
#[test]
fn the_page_of_many_runs_is_below_5_mb() {
    // As grainy as what a camera gives.
    let mut noise = noise();
    let images = (0..71).map(|i| NamedImage {
        name: format!("image_{i}.png"),
        pixels: image::GrayImage::from_fn(320, 240, |x, y| {
            image::Luma([(x / 2 + y / 3) as u8 / 2 + 3 * (noise() >> 4)])
        }),
    });
    let images: Vec<NamedImage> = images.collect();
    let case = |image: usize| (0..6).map(move |i| Case { image, x: 25 + 50 * i, y: 200 });
    let set = Dataset::new("set", images, (0..71).flat_map(case).collect()).expect("sound");
    let answers: Vec<f32> = (0..set.cases().len()).map(|i| (i * 7 % 240) as f32).collect();
    let constants = Constants::learn(&set, 10.0);
    let look = Look {
        part: Part::Holdout,
        tolerance: 10.0,
        camera: None,
        constants: &constants,
        window: None,
        pictures: PictureRoom::of(compare::BRIEFS),
    };
    let looked = Answers::of(&set, &answers, &look);
    assert!(!looked.views.is_empty());
    let mut runs: Vec<Run> = (0..compare::BRIEFS).map(|_| progress(51)).collect();
    let settings: Vec<Settings> =
        (0..compare::BRIEFS as u64).map(|seed| Settings { seed, ..Settings::default_preset() }).collect();
    for (run, settings) in runs.iter_mut().zip(&settings) {
        run.seed = settings.seed;
        run.answers = Some(looked.clone());
    }
    let comparison = Comparison::of(&runs, &settings);
    let report = Report { title: "many".into(), runs, comparison: Some(comparison), command: None };
    let page = html(&report).expect("drawn");
    assert!(page.contains("r0-columns") && page.contains(&format!("r{}-errors", compare::BRIEFS - 1)));
    assert!(page.len() < 5_000_000, "{}", page.len());
}
