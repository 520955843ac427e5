//! The page on several runs: how they compare, then each run in brief.

use maud::{Markup, html};

use super::Section;
use super::chart::{Axis, Ink, Plot, PlotError, Series, Shape, Unit};
use super::comparison::{names, scores};
use super::curves;
use super::model::{Answers, Comparison, Part, Report, Run, Setting};
use super::parts::{
    Figure, POINTS, Table, command, count, duration, none, number, percent, prose, quartiles, rows, thinned,
};
use super::{errors, sections};
use crate::statistics::Quartiles;

/// Runs of which a page on several shows details, at most, so that it stays small.
pub(super) const BRIEFS: usize = 30;
/// Differences between settings that are shown without being asked for, at most.
const DIFFERENCES: usize = 12;

/// A line of medians in a band of quartiles for each setting.
fn medians(
    id: &str,
    title: &str,
    y: Option<Axis>,
    label: &str,
    settings: &[Setting],
    of: fn(&Setting) -> &Vec<Quartiles>,
) -> Result<Markup, PlotError> {
    let longest = settings.iter().map(|setting| of(setting).len()).max().unwrap_or(0);
    let all = settings.iter().flat_map(|setting| of(setting).iter().map(|q| q.upper));
    let shares = y.is_some();
    let y = y.unwrap_or_else(|| Axis::around(label, Unit::Plain, true, all));
    let mut series = Vec::new();
    for (i, setting) in settings.iter().enumerate() {
        let ink = Ink::Series((i % usize::from(super::chart::SERIES)) as u8);
        let all = of(setting);
        let points = || thinned(all.len(), POINTS).into_iter().map(|x| (x as f64, &all[x]));
        let band = points().map(|(x, q)| (x, q.lower, q.upper)).collect();
        series.push(Series { name: None, ink, shape: Shape::Band(band) });
        let line: Vec<(f64, f64)> = points().map(|(x, q)| (x, q.median)).collect();
        // A line of one point is none.
        let shape = if longest == 1 { Shape::Dots(line, 4) } else { Shape::Line(line) };
        series.push(Series { name: Some(setting.name.clone()), ink, shape });
    }
    let headings: Vec<&str> =
        std::iter::once("generation").chain(settings.iter().map(|setting| setting.name.as_str())).collect();
    let mut numbers = Table::new("Median (quartiles)", &headings);
    for i in rows(longest) {
        let cell = |setting: &Setting| match of(setting).get(i) {
            Some(q) if shares => quartiles(q),
            Some(q) => format!("{} ({} to {})", number(q.median), number(q.lower), number(q.upper)),
            None => none(),
        };
        numbers.row(std::iter::once(i.to_string()).chain(settings.iter().map(cell)));
    }
    let end = |setting: &Setting| {
        let last = of(setting).last()?;
        let median = if shares { percent(last.median) } else { number(last.median) };
        Some(format!("{} {median}", setting.name))
    };
    let ends: Vec<String> = settings.iter().filter_map(end).collect();
    let description = format!(
        "Lines: medians; bands: from the lower to the upper quartile. At the end: {}.",
        ends.join("; ")
    );
    let plot = Plot { x: Axis::generations(longest), y, series };
    Figure { id: id.to_string(), title, description, plot, numbers }.html()
}

/// Every run's winner on each part, one column of dots a setting.
fn spread(settings: &[Setting], runs: &[Run]) -> Result<Markup, PlotError> {
    let parts: Vec<Part> = [Part::Training, Part::Validation, Part::Holdout]
        .into_iter()
        .filter(|&part| settings.iter().any(|setting| !scores(setting, runs, part).is_empty()))
        .collect();
    let is_long = |setting: &Setting| setting.name.chars().count() > 14;
    let names = settings
        .iter()
        .enumerate()
        .map(|(i, s)| if is_long(s) { (i + 1).to_string() } else { s.name.clone() });
    let place = |i: usize, part: usize| i as f64 + 0.25 * (part as f64 - (parts.len() as f64 - 1.0) / 2.0);
    let mut series = Vec::new();
    let mut numbers = Table::new("Each winner", &["setting", "part", "fitness"]);
    numbers.words.push(1);
    for (number, &part) in parts.iter().enumerate() {
        let points = |(i, setting): (usize, &Setting)| {
            let of = scores(setting, runs, part);
            of.into_iter().map(move |score| (place(i, number), score)).collect::<Vec<_>>()
        };
        let dots: Vec<_> = settings.iter().enumerate().flat_map(points).collect();
        series.push(Series {
            name: Some(part.name().to_string()),
            ink: Ink::Series(number as u8),
            shape: Shape::Dots(dots, 4),
        });
        for setting in settings {
            for score in scores(setting, runs, part) {
                numbers.row([setting.name.clone(), part.name().to_string(), percent(score)]);
            }
        }
    }
    let values = settings.iter().flat_map(|s| parts.iter().flat_map(|&part| scores(s, runs, part)));
    let y = Axis::around("cases solved", Unit::Percent, false, values);
    let plot = Plot { x: Axis::named("setting", names.collect()), y, series };
    let names: Vec<&str> = parts.iter().map(|part| part.name()).collect();
    let mut description =
        format!("Each dot is the winner of a run; from left to right: {}.", names.join(", "));
    for (i, setting) in settings.iter().enumerate().filter(|(_, setting)| is_long(setting)) {
        description += &format!(" {}: {}.", i + 1, setting.name);
    }
    Figure { id: "c-spread".to_string(), title: "Winners", description, plot, numbers }.html()
}

/// The table of the settings.
fn table(settings: &[Setting], runs: &[Run]) -> Table {
    let mut table = Table::new(
        "Median (quartiles) and best over the runs of a setting",
        &["setting", "runs", "part", "median (quartiles)", "best", "winner’s nodes", "time of a run"],
    );
    table.words.push(2);
    for setting in settings {
        let nodes = setting.winner_nodes.map_or_else(none, |q| number(q.median));
        let seconds = setting.seconds.map_or_else(none, |q| duration(q.median));
        let count = setting.runs.len().to_string();
        for (part, q) in &setting.parts {
            // Of a run that is not complete what is held out was not looked at.
            let scored = scores(setting, runs, *part).len();
            let of =
                if scored == setting.runs.len() { count.clone() } else { format!("{scored} of {count}") };
            table.row([
                setting.name.clone(),
                of,
                part.name().to_string(),
                quartiles(q),
                percent(q.max),
                nodes.clone(),
                seconds.clone(),
            ]);
        }
        if setting.parts.is_empty() {
            // Without data there is what the logs say.
            let last = setting.runs.iter().filter_map(|&run| runs[run].records.last());
            let best = Quartiles::of(&last.map(|r| r.best_fitness_so_far).collect::<Vec<_>>());
            table.row([
                setting.name.clone(),
                count,
                "training (log)".to_string(),
                best.as_ref().map_or_else(none, quartiles),
                best.map_or_else(none, |q| percent(q.max)),
                nodes,
                seconds,
            ]);
        }
    }
    table
}

/// Whether some of the runs that count have more generations than others.
fn lengths(settings: &[Setting], runs: &[Run]) -> bool {
    let mut lengths = settings.iter().flat_map(|setting| &setting.runs).map(|&run| runs[run].records.len());
    let first = lengths.next();
    lengths.any(|length| Some(length) != first)
}

fn p_value(p: f64) -> String {
    if p < 0.001 { "< 0.001".to_string() } else { format!("{p:.3}") }
}

fn pairs_table(comparison: &Comparison, part: Part) -> Table {
    let caption = format!(
        "Settings against each other ({}). A12: the probability that a run of the first is better; p: rank-sum test, then \
         corrected for all pairs (Holm)",
        part.name()
    );
    let mut table = Table::new(&caption, &["first", "second", "A12", "p", "corrected"]);
    table.words.push(1);
    for pair in &comparison.pairs {
        let name = |setting: usize| comparison.settings[setting].name.clone();
        let numbers = [format!("{:.2}", pair.a12), p_value(pair.p), p_value(pair.corrected)];
        table.row([name(pair.first), name(pair.second)].into_iter().chain(numbers));
    }
    table
}

/// What differs, setting by setting.
fn differences(settings: &[Setting]) -> Markup {
    let names: Vec<&str> =
        std::iter::once("setting").chain(settings.iter().map(|s| s.name.as_str())).collect();
    let mut table = Table::new("What differs", &names);
    table.words = (1..names.len()).collect();
    let values = settings.first().map_or(&[][..], |first| &first.values);
    for (i, (name, _)) in values.iter().enumerate() {
        let cells = settings.iter().map(|setting| setting.values[i].1.clone());
        table.row(std::iter::once(name.clone()).chain(cells));
    }
    if values.len() > DIFFERENCES {
        return table.folded(&format!("What differs: {}", count(values.len(), "setting")));
    }
    table.html()
}

/// The page on several runs.
pub(super) fn page(
    report: &Report,
    runs: &[Run],
    comparison: Option<&Comparison>,
) -> Result<Markup, PlotError> {
    let mut all: Vec<Section> = Vec::new();
    if let Some(comparison) = comparison {
        let settings = &comparison.settings;
        all.push(("result", "Result", html! {
            (table(settings, runs).html())
            @if settings.len() > 1 { (differences(settings)) }
            @if let Some(part) = comparison.part { @if !comparison.pairs.is_empty() { (pairs_table(comparison, part).html()) } }
        }));
        let shares = || Some(Axis::shares("cases solved"));
        all.push((
            "curves",
            "Over the generations",
            html! { @if lengths(settings, runs) { p.caption { "Runs that ended sooner count as far as they got." } } div.plots {
                (medians("c-best", "Best so far, in training", shares(), "", settings, |s| &s.best)?)
                (medians("c-mean", "Mean fitness", shares(), "", settings, |s| &s.mean)?)
                (medians("c-nodes", "Mean size", None, "nodes", settings, |s| &s.nodes)?)
                @if runs.iter().any(|run| !run.scores.is_empty()) { (spread(settings, runs)?) }
            } },
        ));
    }
    if runs.iter().any(|run| run.answers.as_ref().is_some_and(|answers| !answers.views.is_empty())) {
        all.insert(usize::from(comparison.is_some()), ("views", "What they see", seen(runs, comparison)));
    }
    all.push(("runs", "The runs", html! { (overview(runs).html()) (briefs(runs)?) }));
    let repeat: Vec<_> = runs.iter().flat_map(|run| run.commands.iter().take(1).cloned()).collect();
    if !repeat.is_empty() || report.command.is_some() {
        all.push(("commands", "To repeat it all", sections::commands(&repeat, report.command.as_deref())));
    }
    Ok(html! {
        header { h1 { (report.title) } (about(runs, comparison)) }
        (super::sections(all))
    })
}

/// The answers of all runs that count to some of the images that each is tested on.
fn seen(runs: &[Run], comparison: Option<&Comparison>) -> Markup {
    let names = names(runs);
    let again = comparison.map_or(&[][..], |comparison| &comparison.again);
    let shown: Vec<(&Answers, &String)> = (runs.iter().zip(&names).enumerate())
        .filter(|(i, _)| again.iter().all(|(run, _)| run != i))
        .filter_map(|(_, (run, name))| Some((run.answers.as_ref()?, name)))
        .collect();
    let most = shown.iter().map(|(answers, _)| answers.views.len()).max().unwrap_or(0);
    let of = |i: usize| {
        let there =
            shown.iter().filter_map(move |(answers, name)| Some((answers.views.get(i)?, answers, name)));
        there
            .map(|(view, answers, name)| (view, format!("{name}, {}, {}", answers.part.name(), view.words())))
    };
    let alike = shown.windows(2).all(|pair| pair[0].0.part == pair[1].0.part);
    html! {
        p {
            "Images evenly chosen from what the runs are tested on, whatever the answers. White bars: taken for ground; black: \
             taken for an obstacle. Cross: the ideal answer. Orange with a ring: wrong."
            @if !alike { " Not all runs have the same parts, so that their images differ." }
        }
        @for i in 0..most { (errors::gallery(of(i))) }
    }
}

/// The data, and what went wrong with runs.
fn about(runs: &[Run], comparison: Option<&Comparison>) -> Markup {
    let mut data: Vec<&str> = runs.iter().map(|run| run.data.as_str()).collect();
    data.sort_unstable();
    data.dedup();
    let settings = comparison.map_or(0, |comparison| comparison.settings.len());
    let collapsed: Vec<usize> = (0..runs.len()).filter(|&i| runs[i].warning.is_some()).collect();
    let mut missing: Vec<&String> = runs.iter().flat_map(|run| &run.missing).collect();
    missing.sort_unstable();
    missing.dedup();
    let again = comparison.map_or(&[][..], |comparison| &comparison.again);
    let names = names(runs);
    let counts = |i: usize| again.iter().all(|(run, _)| *run != i);
    let unfinished = (0..runs.len()).filter(|&i| counts(i) && !runs[i].is_complete()).count();
    html! {
        dl.facts {
            dt { "Data" } @for data in data { dd { (data) } }
            dt { "Runs" } dd { (count(runs.len(), "run")) " of " (count(settings, "setting")) }
        }
        @if let Some(&first) = collapsed.first() { p.note {
            strong { (collapsed.len()) " of " (count(runs.len(), "run")) " ended collapsed: " }
            @for (i, &run) in collapsed.iter().enumerate() { @if i > 0 { ", " } (names[run]) }
            @if let Some(warning) = &runs[first].warning { ". Of the first: " (prose(warning)) }
        } }
        @for (run, first) in again { p.note {
            (names[*run]) " is " (names[*first]) " once more: the same settings, seed and data. It counts once."
        } }
        @if unfinished > 0 { p.note {
            "Not complete, so that their held-out images are left alone: " (count(unfinished, "run")) "."
        } }
        @for missing in missing { p.note { (prose(missing)) } }
    }
}

fn overview(runs: &[Run]) -> Table {
    let mut table = Table::new(
        "Each run",
        &["run", "seed", "generations", "training", "validation", "held out", "nodes", "time"],
    );
    for (run, name) in runs.iter().zip(names(runs)) {
        let part =
            |part: Part| run.scores.iter().find(|s| s.part == part).map_or_else(none, |s| percent(s.fitness));
        table.row([
            name,
            run.seed.to_string(),
            run.records.len().to_string(),
            part(Part::Training),
            part(Part::Validation),
            part(Part::Holdout),
            run.program.as_ref().map_or_else(none, |program| program.nodes.to_string()),
            duration(run.records.iter().map(|r| r.timing.wall).sum()),
        ]);
    }
    table
}

fn briefs(runs: &[Run]) -> Result<Markup, PlotError> {
    if runs.len() > BRIEFS {
        return Ok(html! { p.soft {
            "Of more than " (BRIEFS) " runs the page shows no details; " (command("vsonar report")) " makes a page for each."
        } });
    }
    let names = names(runs);
    Ok(html! { @for (i, run) in runs.iter().enumerate() {
        details {
            summary { (names[i]) ", seed " (run.seed) }
            (sections::notes(run)) (sections::result(run, None))
            (curves::growth(run, &format!("r{i}-"))?)
            @if let Some(answers) = &run.answers {
                h3 { "Errors" }
                (errors::tables(answers, &format!("r{i}-"), false)?)
                h3 { "How long errors last" }
                (errors::transience(answers))
            }
            @if let Some(program) = &run.program { h3 { "The best program" } (sections::program(program)) }
            @if let Some(answers) = run.answers.as_ref().filter(|answers| !answers.pictures.is_empty()) {
                h3 { "Pictures" }
                (errors::pictures(answers))
            }
            h3 { "Settings" }
            (sections::settings(run))
            (sections::commands(&run.commands, None))
        }
    } })
}
