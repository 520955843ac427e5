//! Sections on the winner's errors: by column, image and distance, how far off, how long, and pictures.

use maud::{Markup, html};

use super::chart::{Axis, Ink, Plot, PlotError, Series, Shape, Unit};
use super::model::{Answers, Group, Histogram, Measure, Picture};
use super::parts::{Figure, Table, count, maybe, none, number, percent};

/// Images of the table that is not folded.
const WORST: usize = 10;

const HEADINGS: [&str; 7] =
    ["cases", "correct", "fitness", "too near", "too far", "not finite", "best constants"];

fn table<'a>(caption: &str, first: &str, groups: impl Iterator<Item = &'a Group>) -> Table {
    let mut table = Table::new(caption, &[&[first][..], &HEADINGS].concat());
    for Group { name, tally, constant } in groups {
        table.row([
            name.clone(),
            tally.cases.to_string(),
            tally.correct.to_string(),
            percent(tally.fitness()),
            tally.too_near.to_string(),
            tally.too_far.to_string(),
            tally.not_finite.to_string(),
            maybe(*constant),
        ]);
    }
    table
}

/// Fitness of groups, each beside that of the constants.
fn bars(
    id: &str,
    title: &str,
    description: String,
    (axis, first): (&str, &str),
    groups: &[Group],
) -> Result<Markup, PlotError> {
    let bar =
        |at: usize, left: f64, right: f64, share: f64| (at as f64 + left, at as f64 + right, 0.0, share);
    let program = groups.iter().enumerate().map(|(i, g)| bar(i, -0.36, 0.0, g.tally.fitness()));
    let constant = groups.iter().enumerate().filter_map(|(i, g)| Some(bar(i, 0.04, 0.36, g.constant?)));
    let series = |name: &str, ink, bars| Series {
        name: Some(name.to_string()),
        ink: Ink::Series(ink),
        shape: Shape::Bars(bars),
    };
    // Of many names one in so many is written.
    let step = groups.len().div_ceil(10).max(1);
    let short = |(i, g): (usize, &Group)| {
        // A stretch is known by where it begins.
        let (from, _) = g.name.split_once(" to ").unwrap_or((&g.name, ""));
        let name = from.replace(" m and more", "").replace(" in view", "");
        if i % step == 0 { name } else { String::new() }
    };
    let names = groups.iter().enumerate().map(short).collect();
    let plot = Plot {
        x: Axis::named(axis, names),
        y: Axis::shares("cases solved"),
        series: vec![
            series("the program", 0, program.collect()),
            series("best constants", 4, constant.collect()),
        ],
    };
    let numbers = table(title, first, groups.iter());
    Figure { id: id.to_string(), title, description, plot, numbers }.html()
}

fn weakest(kind: &str, groups: &[Group]) -> String {
    let weakest = groups.iter().min_by(|a, b| a.tally.fitness().total_cmp(&b.tally.fitness()));
    weakest.map_or(String::new(), |g| format!("Weakest: {kind}{}, {}.", g.name, percent(g.tally.fitness())))
}

fn histogram(id: &str, errors: &Histogram) -> Result<Markup, PlotError> {
    let half = 0.46 * errors.width;
    // The middle bar is cut off where it would leave no room for the others.
    let is_middle = |at: f64| at.abs() < half;
    let others = errors.bins.iter().filter(|bin| !is_middle(bin.0)).map(|bin| bin.1).max().unwrap_or(0);
    let middle = errors.bins.iter().find(|bin| is_middle(bin.0)).map_or(0, |bin| bin.1);
    let most = if others == 0 { middle } else { middle.max(others).min((3 * others).max(8)) };
    let bars = errors.bins.iter().map(|&(at, n)| (at - half, at + half, 0.0, n.min(most) as f64)).collect();
    let mut numbers =
        Table::new("Answers by error; the first and the last row hold all beyond", &["rows", "answers"]);
    errors.bins.iter().for_each(|&(at, n)| numbers.row([number(at), n.to_string()]));
    let rows = |value: Option<f64>| value.map_or_else(none, |value| format!("{value:.1} rows"));
    let cut = if middle > most { ", and is cut off" } else { "" };
    let description = format!(
        "Answer less label: right of 0 the obstacle is seen too near, left of it too far. The median is {}, that of the \
         magnitudes {}. The middle bar, {}, holds what counts as correct{cut}.",
        rows(errors.median),
        rows(errors.median_magnitude),
        count(middle, "answer")
    );
    let end = errors.bins.last().map_or(1.0, |bin| bin.0) + errors.width;
    let plot = Plot {
        x: Axis { label: "rows".to_string(), unit: Unit::Plain, range: -end..end, names: Vec::new() },
        y: Axis::around("answers", Unit::Plain, true, std::iter::once(most as f64)),
        series: vec![Series { name: None, ink: Ink::Series(0), shape: Shape::Bars(bars) }],
    };
    Figure { id: id.to_string(), title: "Signed errors", description, plot, numbers }.html()
}

/// Errors by column, distance and image, of all images or the worst alone. `ids` begins the identifiers.
pub(super) fn tables(answers: &Answers, ids: &str, all: bool) -> Result<Markup, PlotError> {
    let (axis, title) = match answers.measure {
        Measure::Metres => ("distance of the obstacle: so many metres and more", "By distance"),
        Measure::Rows => ("rows above the lower border: so many and more", "By distance, in rows"),
    };
    let wrong: Vec<&Group> = answers.images.iter().filter(|g| g.tally.correct < g.tally.cases).collect();
    let images = "image";
    Ok(html! {
        p {
            "On the images of the part “" (answers.part.name()) "”: " (answers.all.correct) " of "
            (count(answers.all.cases, "answer")) " correct, " (answers.all.too_near) " too near, "
            (answers.all.too_far) " too far, " (answers.all.not_finite) " no finite number."
        }
        div.plots {
            (bars(&format!("{ids}columns"), "By column", weakest("column ", &answers.columns), ("column", "column"), &answers.columns)?)
            (bars(&format!("{ids}distances"), title, weakest("", &answers.distances), (axis, "distance"), &answers.distances)?)
            (histogram(&format!("{ids}errors"), &answers.errors)?)
        }
        h3 { "By image" }
        @if wrong.is_empty() { p { "Every answer on every image is correct." } }
        @else {
            (table(&format!("The worst of {} with errors", count(wrong.len(), "image")), images, wrong.iter().copied().take(WORST)).html())
        }
        @if all { (table("All images, the worst first", images, answers.images.iter()).folded("All images")) }
    })
}

/// Whether errors last.
pub(super) fn transience(answers: &Answers) -> Markup {
    let Some(found) = &answers.transience else {
        return html! { p { "No column is labelled in two frames of a sequence, so nobody can tell." } };
    };
    html! {
        dl.facts {
            dt { "Errors" } dd { (found.errors) " in " (count(found.episodes, "episode")) }
            dt { "Gone in the next labelled frame" } dd {
                (maybe(found.single_of_errors)) " of the errors, " (maybe(found.single_of_episodes)) " of the episodes"
                @if found.undecided > 0 { "; " (found.undecided) " in the last frame of a sequence count neither way" }
            }
            @if let Some(longest) = &found.longest {
                dt { "The longest" } dd {
                    (count(longest.frames, "labelled frame")) ": column " (longest.column) " from " (longest.image) " on"
                }
            }
            dt { "With a median over three frames" } dd { (percent(found.median_fitness)) " (" (percent(answers.all.fitness())) " without)" }
        }
    }
}

/// The pictures.
pub(super) fn pictures(answers: &Answers) -> Markup {
    html! {
        p {
            "Images of the part “" (answers.part.name()) "”, the worst first, then some of the best. White bars: taken for ground; black: taken for an obstacle. \
             Cross: the ideal answer; square: the program’s window at its own. Orange with a ring: wrong."
        }
        (gallery(answers.pictures.iter().map(|picture| (picture, picture.words()))))
    }
}

/// Pictures with these words below each.
pub(super) fn gallery<'a>(pictures: impl Iterator<Item = (&'a Picture, String)>) -> Markup {
    html! { ul.pictures { @for (picture, words) in pictures {
        li {
            img src={ "data:image/png;base64," (picture.png) } width=(picture.size.0) height=(picture.size.1) alt=(words);
            span { (words) }
        }
    } } }
}
