//! What `vsonar drive` reports, as JSON and as tables.

use std::fmt::Write as _;
use std::path::PathBuf;

use serde::Serialize;
use vsonar::drive::published::{PUBLISHED, Published};
use vsonar::drive::run::{End, Run, Settings};
use vsonar::drive::summary::Summary;
use vsonar::support::printable::ShownPath as _;
use vsonar::world::office::FRAME_RATE;

use super::drive_scores::{Scores, TunedOn};
use super::output::percent;
use super::table::Table;

/// Everything.
#[derive(Debug, Serialize)]
pub(crate) struct Report {
    pub(crate) vsonar: &'static str,
    /// The building in words.
    #[serde(skip)]
    pub(crate) building: String,
    /// The file of the program.
    pub(crate) program: PathBuf,
    pub(crate) world: &'static str,
    /// The one that counts; none for the building of the training set.
    pub(crate) seed: Option<u64>,
    pub(crate) changed: bool,
    pub(crate) columns: Vec<u32>,
    pub(crate) median: bool,
    /// How many runs were asked for, of all sensors together.
    pub(crate) asked: usize,
    /// Whether Ctrl-C came before all had ended.
    pub(crate) interrupted: bool,
    pub(crate) settings: Settings,
    /// What rivals are tuned on, and all are scored on; none without `--against`.
    pub(crate) tuned_on: Option<TunedOn>,
    pub(crate) sensors: Vec<SensorReport>,
    pub(crate) published: [Published; 2],
    pub(crate) timing: Timing,
}

/// The runs of one sensor.
#[derive(Debug, Serialize)]
pub(crate) struct SensorReport {
    pub(crate) sensor: &'static str,
    /// What a rival was tuned to, in words.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) tuned: Option<String>,
    /// Its fitness on labelled images, if it looks at any.
    pub(crate) scores: Option<Scores>,
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
    format!("{sensor}, run {}: {}", run.number, outcome(run))
}

/// How far a run went, how long, and how it ended.
pub(crate) fn outcome(run: &Run) -> String {
    format!("{:.1} m in {}, {}", run.metres, clock(run.seconds), end(run))
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
    let mut out = heading(report);
    // Writing to a string cannot fail.
    let _ = writeln!(out, "\n{}\n{}", runs(report), sums(report));
    out + &notes(report)
}

/// What was done, above the tables.
fn heading(report: &Report) -> String {
    let Report { building, columns, median, settings, asked, .. } = report;
    let columns: Vec<String> = columns.iter().map(u32::to_string).collect();
    let done: usize = report.sensors.iter().map(|sensor| sensor.runs.len()).sum();
    let mut out = format!(
        "{} in {building}\nColumns {}; {}; limit {} min a run\n",
        report.program.shown(),
        columns.join(","),
        if *median { "the median of the last 3 answers is believed" } else { "no median" },
        settings.seconds / 60.0
    );
    if report.interrupted {
        out += &format!("Interrupted: {done} of {asked} runs had ended, and only these are below.\n");
    } else if done < *asked {
        out += &format!("Incomplete: {done} of {asked} runs.\n");
    }
    out
}

/// A mark for what is a lower bound.
fn plus(is_lower_bound: bool) -> &'static str {
    if is_lower_bound { "+" } else { "" }
}

fn share(share: Option<f64>) -> String {
    share.map_or_else(|| "-".to_string(), percent)
}

/// Every run.
fn runs(report: &Report) -> Table {
    let headings = ["", "run", "metres", "time", "m/s", "turning", "squares", "rows right", "end"];
    let mut table = Table::new(1, &headings);
    for SensorReport { sensor, runs, .. } in &report.sensors {
        for run in runs {
            let plus = plus(run.end != End::Collision);
            table.row([
                sensor.to_string(),
                run.number.to_string(),
                format!("{:.1}{plus}", run.metres),
                format!("{}{plus}", clock(run.seconds)),
                format!("{:.2}", run.metres / run.seconds.max(1e-9)),
                percent(run.turning),
                run.squares.to_string(),
                share(run.accuracy.and_then(|a| a.share())),
                end(run),
            ]);
        }
    }
    table
}

/// Fitness, distances and transience of each sensor, and what was published.
fn sums(report: &Report) -> Table {
    let scored = report.tuned_on.is_some();
    let mut headings = vec![""];
    if scored {
        headings.extend(["training", "held out"]);
    }
    headings.extend(["runs", "metres", "± sd", "longest", "metres per collision", "time", "longest", "m/s"]);
    headings.extend(["collisions", "walked into", "in view", "stuck"]);
    headings.extend(["rows right", "median right", "one frame", "longest error"]);
    let mut table = Table::new(1, &headings);
    for SensorReport { sensor, scores, summary, .. } in &report.sensors {
        let mut cells = vec![sensor.to_string()];
        if scored {
            cells.extend([share(scores.map(|s| s.training)), share(scores.map(|s| s.held_out))]);
        }
        let Some(sum) = summary else {
            table.row(cells.into_iter().chain(["0".to_string()]));
            continue;
        };
        let plus = plus(sum.is_lower_bound());
        let per_collision = sum.metres_per_collision.map(|metres| format!("{metres:.1}"));
        cells.extend([
            sum.runs.to_string(),
            format!("{:.1}{plus}", sum.metres.mean),
            format!("{:.1}", sum.metres.deviation),
            format!("{:.1}{plus}", sum.metres.longest),
            per_collision.unwrap_or_else(|| format!("no collision in {:.1} m", sum.total_metres)),
            format!("{}{plus}", clock(sum.seconds.mean)),
            format!("{}{plus}", clock(sum.seconds.longest)),
            format!("{:.2}", sum.speed),
            sum.collisions.to_string(),
            sum.walked_into.to_string(),
            sum.in_view.to_string(),
            sum.stuck.to_string(),
        ]);
        if let Some(accuracy) = sum.accuracy {
            cells.extend([share(accuracy.share()), share(accuracy.median_share())]);
            cells.push(share(accuracy.lasting.single_of_errors()));
            cells.push(format!("{:.1} s", accuracy.lasting.longest as f64 / FRAME_RATE));
        }
        table.row(cells);
    }
    for published in PUBLISHED {
        let Published { trained_on, building, runs, metres, seconds, .. } = published;
        let mut cells = vec![format!("published: trained on {trained_on}, in {building}")];
        if scored {
            cells.extend([String::new(), String::new()]);
        }
        cells.extend([
            runs.map_or(String::new(), |n| n.to_string()),
            format!("{metres:.0}"),
            String::new(),
            published.longest_metres.map_or(String::new(), |m| format!("{m:.0}")),
            String::new(),
            clock(seconds),
            published.longest_seconds.map_or(String::new(), clock),
            format!("{:.2}", metres / seconds),
        ]);
        table.row(cells);
    }
    table
}

/// What is said below the tables.
const NOTE: &str = "\
±: standard deviation over the runs. Metres per collision: the way of all runs for each collision. Walked into: \
collisions with somebody who walked into a robot that stood still or turned in place.
Rows right: answers on the way within 10 rows of the truth. One frame: share of the wrong ones that last a single frame, \
0.1 s, those in the last frame of a run left out; longest error: most time that a column was wrong without a break.";

fn notes(report: &Report) -> String {
    let mut out = format!("{NOTE}\n");
    // Writing to a string cannot fail.
    let _ = writeln!(
        out,
        "{}",
        if report.median {
            "The robot believed the medians: `median right` is of these, all else about rows of the answers before."
        } else {
            "The robot believed the answers as they were; median right: what a median of the last three would have made \
             of them."
        }
    );
    let any =
        |which: fn(&Summary) -> bool| report.sensors.iter().filter_map(|s| s.summary.as_ref()).any(which);
    if any(Summary::is_lower_bound) {
        let _ = writeln!(
            out,
            "+: runs that got stuck or whose time was over had hit nothing yet; they count with what they had driven \
             by then, a lower bound."
        );
    }
    if let Some(tuned_on) = &report.tuned_on {
        let _ = writeln!(out, "{}", tuned_on.describe());
    }
    for SensorReport { sensor, summary, .. } in &report.sensors {
        let Some(sum) = summary.and_then(|s| s.accuracy).filter(|sum| sum.lasting.errors > 0) else {
            continue;
        };
        let part = |n: usize| percent(n as f64 / sum.lasting.errors as f64);
        let _ = writeln!(
            out,
            "{sensor}: of its wrong rows {} were too near, {} too far, {} not finite.",
            part(sum.too_near),
            part(sum.too_far),
            part(sum.not_finite)
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
