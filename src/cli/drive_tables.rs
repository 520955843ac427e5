//! What `vsonar drive` reports, as JSON and as tables.

use std::fmt::Write as _;

use serde::Serialize;
use vsonar::drive::published::{PUBLISHED, Published};
use vsonar::drive::run::{End, Run, Settings};
use vsonar::drive::summary::Summary;

use super::output::percent;
use super::table::Table;

/// Everything.
#[derive(Debug, Serialize)]
pub(crate) struct Report {
    pub(crate) vsonar: &'static str,
    /// The building in words.
    #[serde(skip)]
    pub(crate) building: String,
    pub(crate) world: &'static str,
    /// None for the building of the training set.
    pub(crate) seed: Option<u64>,
    pub(crate) changed: bool,
    pub(crate) columns: Vec<u32>,
    pub(crate) median: bool,
    pub(crate) settings: Settings,
    pub(crate) sensors: Vec<SensorReport>,
    pub(crate) published: [Published; 2],
    pub(crate) timing: Timing,
}

/// The runs of one sensor.
#[derive(Debug, Serialize)]
pub(crate) struct SensorReport {
    pub(crate) sensor: String,
    /// What a rival was tuned to, in words.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) tuned: Option<String>,
    pub(crate) summary: Option<Summary>,
    pub(crate) runs: Vec<Run>,
}

/// How long it took: the only part that differs from one time to the next.
#[derive(Debug, Clone, Copy, Serialize)]
pub(crate) struct Timing {
    pub(crate) simulated_seconds: f64,
    pub(crate) real_seconds: f64,
}

/// A run as a line.
pub(crate) fn line(sensor: &str, run: &Run) -> String {
    format!("{sensor}, run {}: {:.1} m in {}, {}", run.number, run.metres, clock(run.seconds), end(run))
}

/// Minutes and seconds.
fn clock(seconds: f64) -> String {
    let whole = seconds.round() as u64;
    format!("{}:{:02}", whole / 60, whole % 60)
}

fn end(run: &Run) -> String {
    match (run.end, run.hit) {
        (End::Collision, Some(hit)) => {
            let seen = if hit.in_view { "in view" } else { "out of view" };
            let how = if hit.walked_into { "was walked into by" } else { "hit" };
            let thing = hit.thing.to_string();
            let article = if thing.starts_with(['a', 'e', 'i', 'o', 'u']) { "an" } else { "a" };
            format!("{how} {article} {thing}, {seen}")
        }
        (End::Stuck, _) => "stuck".to_string(),
        _ => "time over".to_string(),
    }
}

/// The tables.
pub(crate) fn text(report: &Report) -> String {
    let mut runs =
        Table::new(1, &["", "run", "metres", "time", "m/s", "turning", "squares", "rows right", "end"]);
    let mut sums = Table::new(
        1,
        &[
            "",
            "runs",
            "metres",
            "±",
            "longest",
            "time",
            "longest",
            "m/s",
            "collisions",
            "in view",
            "stuck",
            "rows right",
        ],
    );
    let mut any_unended = false;
    for SensorReport { sensor, summary, runs: each, .. } in &report.sensors {
        for run in each {
            let right = run.accuracy.and_then(|a| a.share()).map_or(String::new(), percent);
            runs.row([
                sensor.clone(),
                run.number.to_string(),
                format!("{:.1}", run.metres),
                clock(run.seconds),
                format!("{:.2}", run.metres / run.seconds.max(1e-9)),
                percent(run.turning),
                run.squares.to_string(),
                right,
                end(run),
            ]);
        }
        let Some(sum) = summary else { continue };
        any_unended |= sum.unended > 0;
        let plus = if sum.unended > 0 { "+" } else { "" };
        sums.row([
            sensor.clone(),
            sum.runs.to_string(),
            format!("{:.1}{plus}", sum.metres.mean),
            format!("{:.1}", sum.metres.deviation),
            format!("{:.1}{plus}", sum.metres.longest),
            format!("{}{plus}", clock(sum.seconds.mean)),
            format!("{}{plus}", clock(sum.seconds.longest)),
            format!("{:.2}", sum.speed),
            sum.collisions.to_string(),
            sum.in_view.to_string(),
            sum.stuck.to_string(),
            sum.accuracy.and_then(|a| a.share()).map_or(String::new(), percent),
        ]);
    }
    for Published { trained_on, building, runs, metres, seconds, longest_metres, longest_seconds } in
        PUBLISHED
    {
        sums.row([
            format!("published: trained on {trained_on}, in {building}"),
            runs.map_or(String::new(), |n| n.to_string()),
            format!("{metres:.0}"),
            String::new(),
            longest_metres.map_or(String::new(), |m| format!("{m:.0}")),
            clock(seconds),
            longest_seconds.map_or(String::new(), clock),
            format!("{:.2}", metres / seconds),
        ]);
    }
    let mut out = format!("{runs}\n{sums}\n");
    // Writing to a string cannot fail.
    if any_unended {
        let _ = writeln!(
            out,
            "+ some runs reached the limit on time, and count with what they had driven by then."
        );
    }
    for SensorReport { sensor, summary, .. } in &report.sensors {
        let Some(sum) = summary.and_then(|s| s.accuracy).filter(|sum| sum.errors > 0) else { continue };
        let wrong = (sum.answers - sum.correct) as f64;
        let _ = writeln!(
            out,
            "{sensor}: of its wrong rows {} were too near; of its errors {} were over within two frames.",
            percent(sum.too_near as f64 / wrong),
            percent(sum.transient as f64 / sum.errors as f64)
        );
    }
    for SensorReport { sensor, tuned, .. } in &report.sensors {
        if let Some(tuned) = tuned {
            let _ = writeln!(out, "{sensor}: {tuned}");
        }
    }
    let Timing { simulated_seconds, real_seconds } = report.timing;
    let _ = writeln!(
        out,
        "{} min simulated in {:.1} s: {:.0} times real time.",
        clock(simulated_seconds),
        real_seconds,
        simulated_seconds / real_seconds.max(1e-9)
    );
    out
}
