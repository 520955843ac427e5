//! Sections of a page on one run: what there is to know first, hall of fame, program, rivals, settings, commands.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use maud::{Markup, html};

use super::chart::{Axis, Ink, Plot, PlotError, Series, Shape, Unit};
use super::model::{Answers, Command, Member, Part, Picture, Program, Rivals, Run};
use super::parts::{Figure, Table, between, command, count, duration, grouped, maybe, none, percent, prose};
use crate::baseline::Rival;

/// Bytes of the texts of the hall of fame, at most.
const PROGRAM_BYTES: usize = 200_000;
/// Bytes of the picture of the trees, at most.
const TREE_BYTES: usize = 400_000;

/// What a run is, in a few lines.
pub(super) fn facts(run: &Run) -> Markup {
    let seconds: f64 = run.records.iter().map(|r| r.timing.wall).sum();
    let evaluations = run.records.last().map_or(0, |r| r.evaluations_total);
    let changed = match run.differing.len() {
        0 => String::new(),
        n => format!(", {}", count(n, "change")),
    };
    html! {
        dl.facts {
            dt { "Data" } dd { (run.data) }
            @if let Some(dir) = &run.tested_on { dt { "Tested on" } dd { (dir) ", in place of what was held out" } }
            dt { "Settings" } dd { "preset " (run.preset) (changed) ", seed " (run.seed) }
            dt { "Size" } dd {
                (grouped(f64::from(run.population))) " individuals, " (run.records.len()) " of "
                (count(run.generations as usize, "generation"))
                @if evaluations > 0 { "; " (grouped(evaluations as f64)) " evaluated in " (duration(seconds)) }
            }
            dt { "Run folder" } dd { code { (run.folder) } }
        }
    }
}

/// What went wrong with the run, and what the report lacks.
pub(super) fn notes(run: &Run) -> Markup {
    html! {
        @if let Some(warning) = &run.warning { p.note { strong { "Collapsed: " } (prose(warning)) } }
        @if !run.is_complete() && !run.records.is_empty() && run.tested_on.is_none() {
            p.note { "The run is not complete: held-out images are left alone until it is." }
        }
        @for missing in &run.missing { p.note { (prose(missing)) } }
    }
}

/// What there is to know first: how good the winner is, what it sees (in this view of its answers), and what it does.
pub(super) fn result(run: &Run, view: Option<(&Answers, &Picture)>) -> Markup {
    html! {
        (cards(run))
        div.first {
            @if let Some((answers, view)) = view { figure {
                img src={ "data:image/png;base64," (view.png) } width=(view.size.0) height=(view.size.1) alt=(view.words());
                p.soft {
                    (view.words()) ", " (percent(answers.all.fitness())) " of all on the part “" (answers.part.name())
                    "”. White bars: taken for ground; black: for an obstacle. Cross: the ideal answer; square: the program’s. \
                     Orange with a ring: wrong."
                }
            } }
            @if let Some(program) = &run.program { (listing(program)) }
        }
        (scores(run))
        (facts(run))
    }
}

/// What the winner does, in as few lines as there are.
fn listing(program: &Program) -> Markup {
    let (heading, text) = match &program.explanation {
        Some(explanation) => ("What it does", &explanation.listing),
        None => ("The program", &program.text),
    };
    html! { div.listing { h3 { (heading) } pre tabindex="0" { code { (text) } } } }
}

/// The best fitness on each part, large.
fn cards(run: &Run) -> Markup {
    if run.scores.is_empty() {
        return html! { @if let Some(best) = run.records.last() {
            ul.cards { li.card {
                b { (percent(best.best_fitness_so_far)) } span { "of the training cases, altered copies included" }
            } }
        } @else { p { "Nothing yet." } } };
    }
    html! { ul.cards { @for score in &run.scores {
        li.card {
            span { (score.part.name()) }
            b { (percent(score.fitness)) }
            span { @if let Some(interval) = score.interval { "95 %: " (between(interval)) } }
            span { "best constants " (percent(score.constant_per_column)) }
        }
    } } }
}

/// The best fitness on each part beside constants.
fn scores(run: &Run) -> Markup {
    if run.scores.is_empty() {
        return html! {};
    }
    let mut table = Table::new(
        "95 %: bootstrap interval over stretches of five images. Constants are those best on the training images.",
        &["part", "fitness", "95 %", "correct", "cases", "images", "constant per column", "one constant"],
    );
    for score in &run.scores {
        table.row([
            score.part.name().to_string(),
            percent(score.fitness),
            score.interval.map_or_else(none, between),
            score.correct.to_string(),
            score.cases.to_string(),
            score.images.to_string(),
            percent(score.constant_per_column),
            percent(score.constant),
        ]);
    }
    html! {
        (verdict(run))
        (table.html())
        p.soft {
            "An answer is correct within " (run.tolerance) " rows of the label."
            @if run.scores.iter().any(|s| s.part == Part::Validation) {
                " Validation chose the program from the hall of fame, so that its figure flatters a little."
            }
        }
    }
}

/// Whether the winner beats the constants where it counts.
fn verdict(run: &Run) -> Markup {
    let Some(last) = run.scores.last() else { return html! {} };
    let Some((low, high)) = last.interval else { return html! {} };
    let part = last.part.name();
    let constant = percent(last.constant_per_column);
    html! { p { @if low > last.constant_per_column {
        strong { "Better than constants" } " (" (part) "): the interval lies above the " (constant) " of the best constants."
    } @else if high < last.constant_per_column {
        strong { "Worse than constants" } " (" (part) "): the interval lies below the " (constant) " of the best constants."
    } @else {
        strong { "Not told apart from constants" } " (" (part) "): the interval holds the " (constant) " of the best constants."
    } } }
}

fn dots(name: &str, ink: u8, points: Vec<(f64, f64)>) -> Series {
    Series { name: Some(name.to_string()), ink: Ink::Series(ink), shape: Shape::Dots(points, 4) }
}

/// The hall of fame: fitness against size, training against the other parts, and who is in it.
pub(super) fn hall(run: &Run) -> Result<Markup, PlotError> {
    let hall = &run.hall_of_fame;
    let train = |member: &Member| member.train.unwrap_or(member.fitness);
    let mut table = Table::new(
        "The best of each size, the fittest in training first; the winner in bold",
        &["nodes", "selection saw", "training", "validation", "held out", "generation"],
    );
    for (i, member) in hall.iter().enumerate() {
        if member.winner {
            table.chosen.push(i);
        }
        table.row([
            member.nodes.to_string(),
            percent(member.fitness),
            maybe(member.train),
            maybe(member.validation),
            maybe(member.holdout),
            member.generation.to_string(),
        ]);
    }
    let nodes = |member: &Member| member.nodes as f64;
    let points = |of: &dyn Fn(&Member) -> Option<(f64, f64)>| hall.iter().filter_map(of).collect::<Vec<_>>();
    let winner = hall.iter().find(|member| member.winner);
    let mut by_size = vec![dots("training", 0, points(&|m| Some((nodes(m), train(m)))))];
    let mut against = Vec::new();
    type Reading = fn(&Member) -> Option<f64>;
    let parts: [(&str, u8, Reading); 2] =
        [("validation", 1, |m| m.validation), ("held out", 2, |m| m.holdout)];
    for (name, ink, of) in parts {
        if hall.iter().any(|member| of(member).is_some()) {
            by_size.push(dots(name, ink, points(&|m| Some((nodes(m), of(m)?)))));
            against.push(dots(name, ink, points(&|m| Some((train(m), of(m)?)))));
        }
    }
    let ring = |points: Vec<(f64, f64)>| Series {
        name: Some("the winner".to_string()),
        ink: Ink::Series(3),
        shape: Shape::Rings(points),
    };
    if let Some(winner) = winner {
        by_size.push(ring(vec![(nodes(winner), train(winner))]));
        let parts = [winner.validation, winner.holdout];
        if !against.is_empty() {
            against.push(ring(parts.into_iter().flatten().map(|y| (train(winner), y)).collect()));
        }
    }
    let values = || {
        let all = hall.iter().flat_map(|m| [Some(train(m)), m.validation, m.holdout]);
        all.flatten()
    };
    let words = |winner: &Member| {
        format!(
            "The winner has {} and solves {} in training.",
            count(winner.nodes, "node"),
            percent(train(winner))
        )
    };
    let about = winner.map_or(String::new(), words);
    let short = Table::new("Each of the hall of fame", &["nodes", "training", "validation", "held out"]);
    let mut numbers = short;
    for m in hall {
        numbers.row([m.nodes.to_string(), percent(train(m)), maybe(m.validation), maybe(m.holdout)]);
    }
    let size = Plot {
        x: Axis::around("nodes", Unit::Plain, true, hall.iter().map(nodes)),
        y: Axis::around("cases solved", Unit::Percent, false, values()),
        series: by_size,
    };
    let both = Axis::around("training", Unit::Percent, false, values());
    let line = vec![(both.range.start, both.range.start), (both.range.end, both.range.end)];
    let generalises = Plot {
        y: Axis { label: "other images".to_string(), ..both.clone() },
        x: both,
        series: {
            let equal = Series {
                name: Some("as in training".to_string()),
                ink: Ink::Series(4),
                shape: Shape::Line(line),
            };
            std::iter::once(equal).chain(against.clone()).collect()
        },
    };
    let mut room = PROGRAM_BYTES;
    let fits = |member: &&Member| {
        let rest = room.checked_sub(member.program.len());
        room = rest.unwrap_or(0);
        rest.is_some()
    };
    let texts = hall.iter().take_while(fits).count();
    Ok(html! {
        div.plots {
            (Figure {
                id: "h-size".to_string(),
                title: "Fitness and size",
                description: format!("{} of different sizes. {about}", count(hall.len(), "individual")),
                plot: size,
                numbers: numbers.clone(),
            }.html()?)
            @if !against.is_empty() {
                (Figure {
                    id: "h-parts".to_string(),
                    title: "Training and other images",
                    description: "What lies below the line does worse on images that selection has not seen.".to_string(),
                    plot: generalises,
                    numbers,
                }.html()?)
            }
        }
        (table.html())
        @if hall.iter().any(|m| m.holdout.is_some()) {
            p.soft { "Held-out figures are shown for comparison; they chose nothing, and a choice by them would need other images to test it." }
        }
        details {
            summary { "Their programs" }
            @if texts < hall.len() {
                p { "The programs of the first " (texts) "; all are in " code { "hall_of_fame.jsonl" } " of the run folder." }
            }
            @for member in &hall[..texts] {
                h3 { (count(member.nodes, "node")) ", " (percent(member.fitness)) @if member.winner { " (the winner)" } }
                pre tabindex="0" { code { (member.program) } }
            }
        }
    })
}

/// The winner's text, its measures, and what is known of its meaning.
pub(super) fn program(program: &Program) -> Markup {
    let operators = match program.operators.len() {
        0 => "none".to_string(),
        _ => program.operators.join(", "),
    };
    html! {
        dl.facts {
            dt { "Size" } dd { (count(program.nodes, "node")) ", depth " (program.depth) }
            dt { "Image operators" } dd { (operators) }
            @if let Some(compiled) = &program.compiled {
                dt { "Operations" } dd { (compiled.operations_before) " as written, " (compiled.operations) " after the optimiser" }
            }
        }
        @if let Some(text) = &program.explanation {
            p { (text.checked) }
            ul { @for line in &text.lines { li { (line) } } }
            @if let [heading, rows @ ..] = &text.contributions[..] && !rows.is_empty() {
                h3 { "Without each part" }
                (contributions(heading, rows).html())
                @if !text.more.is_empty() { p.caption { (text.more.trim()) } }
            }
            @if text.trees.len() <= TREE_BYTES {
                details {
                    summary { "The trees; what does nothing is pale" }
                    div.scroll tabindex="0" role="region" aria-label="The trees" { img.plain alt="The trees, as they are written below" src=(svg_uri(&text.trees)); }
                }
            } @else {
                p { "The trees are too large for a picture here; " (command("vsonar explain --svg")) " draws them." }
            }
        }
        @if program.explanation.is_some() {
            h3 { "As it evolved" }
            pre tabindex="0" { code { (program.text) } }
        }
        @if let Some(compiled) = &program.compiled {
            details { summary { "As it is run: the optimised program" } pre tabindex="0" { code { (compiled.text) } } }
        }
    }
}

fn contributions(heading: &[String; 5], rows: &[[String; 5]]) -> Table {
    let heading: Vec<&str> = heading.iter().map(String::as_str).collect();
    let caption = "Fitness on the images named above with each part replaced, the greatest loss first.";
    let mut table = Table::new(caption, &heading);
    table.words = vec![3, 4];
    for row in rows {
        table.row(row.clone());
    }
    table
}

/// A picture of its own, so that its style is its own too.
fn svg_uri(svg: &str) -> String {
    format!("data:image/svg+xml;base64,{}", STANDARD.encode(svg))
}

/// The table of the rivals.
pub(super) fn rivals(rivals: &Rivals) -> Markup {
    let tested = rivals.part.name();
    let names: Vec<&str> =
        Rival::ALL.into_iter().filter(|rival| rival.takes_copies()).map(Rival::name).collect();
    let copies = match rivals.copies {
        0 => String::new(),
        _ => format!(" ({} with the altered copies that evolution had of them)", names.join(", ")),
    };
    let caption = format!(
        "Rivals are tuned on the training images{copies}, never on others. Median: with a median over three frames. One frame: share of the errors \
         that are gone in the next labelled frame. Time: the labelled columns of an image."
    );
    let mut table =
        Table::new(&caption, &["detector", "training", tested, "95 %", "median", "one frame", "time"]);
    table.chosen.push(0);
    for row in &rivals.rows {
        table.row([
            row.name.clone(),
            percent(row.train),
            percent(row.test),
            row.interval.map_or_else(none, between),
            maybe(row.median),
            maybe(row.single),
            row.microseconds.map_or_else(none, |us| format!("{us:.0} µs")),
        ]);
    }
    html! {
        (table.html())
        details { summary { "How they are tuned" } dl.facts {
            @for row in &rivals.rows { @if let Some(tuned) = &row.tuned {
                dt { (row.name) @if let Some(source) = &row.source { " (" (source) ")" } } dd { (tuned) }
            } }
        } }
    }
}

/// The settings: what differs from the preset, then all.
pub(super) fn settings(run: &Run) -> Markup {
    let caption = format!("What differs from the preset {}", run.preset);
    let mut table = Table::new(&caption, &["setting", "here", run.preset]);
    for difference in &run.differing {
        table.row([difference.name.clone(), difference.value.clone(), difference.preset.clone()]);
    }
    html! {
        @if run.differing.is_empty() { p { "As the preset " (run.preset) " has them, with seed " (run.seed) "." } }
        @else { (table.html()) }
        details { summary { "All settings (settings.toml)" } pre tabindex="0" { code { (run.settings) } } }
    }
}

/// Commands to copy: a click marks the whole of one.
pub(super) fn commands(commands: &[Command], report: Option<&str>) -> Markup {
    html! {
        @if let Some(report) = report { p { "This report: " (command(report)) } }
        ol.commands { @for Command { what, command: text } in commands {
            li { (what) pre tabindex="0" { (command(text)) } }
        } }
    }
}
