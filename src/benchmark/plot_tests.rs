//! Plots of reports made by hand: of ordinary times, and of the oddest.

use super::super::measure::{Measured, Subject};
use super::super::report::{
    DataReport, ExecutorReport, GenerationReport, Machine, Parts, PointExecutor, PointReport, RoundTotals,
    ScalingReport, SettingsReport,
};
use super::super::spread::Spread;
use super::*;

fn spread(median: f64) -> Spread {
    Spread { q1: median, median, q3: median }
}

/// A report of these executors: the times of three individuals by executor, and the break-even of `cranelift`.
fn report(names: &[&str], seconds: [f64; 3], even: f64) -> Report {
    let cases = 8;
    let measured = Measured {
        cases,
        subjects: [1, 30, 900].map(|operations| Subject { operations, nodes: 7 }).into(),
        runs: Vec::new(),
    };
    let mut generation = GenerationReport::of(0, 3, &measured);
    let executor = |name: &&str| ExecutorReport {
        executor: name.to_string(),
        individuals: 3,
        rounds: 1,
        lower_s: spread(0.0),
        compile_s: spread(0.0),
        execute_s: spread(1.0),
        together_s: spread(1.0),
        mean_s: Parts::default(),
        round_totals_s: RoundTotals { min: 1.0, median: 1.0, max: 1.0 },
        gpops: 1.0,
        gpops_execute: 1.0,
        times_walker: None,
    };
    generation.executors = names.iter().map(executor).collect();
    for (individual, seconds) in generation.measured.iter_mut().zip(seconds) {
        individual.together_s = vec![Some(seconds); names.len()];
    }
    generation.break_even = vec![BreakEven {
        executor: "cranelift".to_string(),
        interpreter: "batch".to_string(),
        individuals: 3,
        cases: spread(even),
        always_interpret: 0.0,
        always_compile: 0.0,
        compile_here: 0.0,
    }];
    let point = |name: &&str| PointExecutor { executor: name.to_string(), together_s: spread(seconds[0]) };
    let points = [1, cases].map(|cases| PointReport { cases, executors: names.iter().map(point).collect() });
    Report {
        version: super::super::VERSION,
        vsonar: "",
        machine: Machine::this(),
        data: DataReport {
            name: "a & b".to_string(),
            fingerprint: String::new(),
            images: 1,
            cases,
            width: 1,
            height: 1,
        },
        settings: SettingsReport {
            preset: String::new(),
            fingerprint: String::new(),
            population: 3,
            seed: 1,
        },
        sample: 3,
        rounds: 1,
        generations: vec![generation],
        scaling: ScalingReport { generation: 0, individuals: 3, points: points.into() },
    }
}

#[test]
fn a_plot_shows_those_that_one_chooses_between() {
    let all = ["auto", "batch", "batch-256", "cranelift", "cranelift-scalar", "reference", "tree"];
    assert_eq!(PlotSeries::Main.of(&all), [0, 1, 3, 6]);
    assert_eq!(PlotSeries::All.of(&all), [0, 1, 2, 3, 4, 5, 6]);
    assert_eq!(PlotSeries::Main.of(&["batch-256", "reference"]), [0, 1], "variants of none that is there");
    let svg = svg(&report(&all, [0.1, 0.2, 0.3], 20.5), PlotSeries::Main).expect("drawn");
    assert!(
        svg.contains(">\ncranelift\n<") && !svg.contains("cranelift-scalar") && !svg.contains("reference")
    );
}

#[test]
fn the_break_even_is_marked_where_it_is() {
    let lines = |even: f64| {
        let svg =
            svg(&report(&["batch", "cranelift"], [0.1, 0.2, 0.3], even), PlotSeries::Main).expect("drawn");
        let words = svg.split('\n').find(|line| line.starts_with("Break-even")).expect("words").to_string();
        (svg.matches("<polyline").count() + svg.matches("<line").count(), words)
    };
    let (far, words) = lines(f64::INFINITY);
    assert_eq!(words, "Break-even: for half of the programs cranelift never beats batch");
    for (even, number) in [(20.5, "21"), (0.0, "0"), (79.0, "79")] {
        let (marked, words) = lines(even);
        // The mark itself, and a tick there with its line if there was none.
        assert_eq!(marked, far + if even == 0.0 { 1 } else { 3 }, "{even}");
        assert_eq!(
            words,
            format!("Break-even: for half of the programs cranelift beats batch from {number} cases on")
        );
    }
    let (beyond, words) = lines(12_345.0);
    assert!(beyond == far && words.contains("from 12,345 cases on"), "{words}");
}

#[test]
fn every_finite_time_can_be_plotted() {
    let numbers = [0.0, -0.0, -1.0, 5e-324, f64::MIN_POSITIVE, 1e-9, 1.0, 1e300, f64::MAX / 1e3, f64::MAX];
    for (i, a) in numbers.into_iter().enumerate() {
        for b in numbers[i..].iter().copied().chain([f64::NAN, f64::INFINITY]) {
            let report = report(&["batch", "cranelift", "tree"], [a, b, a], b);
            let svg = svg(&report, PlotSeries::All).expect("drawn");
            assert!(!svg.contains("NaN\""), "{a}, {b}");
            assert!(svg.matches("<text").count() < 60, "{a}, {b}: {svg}");
        }
    }
    assert!(png(&report(&["tree"], [f64::MAX, 5e-324, 1.0], f64::MAX), PlotSeries::All).is_ok());
    let mut nothing = report(&[], [1.0; 3], 1.0);
    nothing.scaling.points.clear();
    nothing.generations.clear();
    assert!(svg(&nothing, PlotSeries::Main).is_ok());
}

#[test]
fn sizes_are_grouped() {
    let dots = vec![(1.0, 5.0), (16.0, 1.0), (16.0, 3.0), (17.0, 2.0), (64.0, 9.0)];
    assert_eq!(by_size(&dots), [(16.0, 2.0)]);
}
