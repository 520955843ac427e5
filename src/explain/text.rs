//! An explanation as plain text and as Markdown.

use std::fmt::Write as _;

use super::Explanation;
use super::listing::Course;
use super::profile::percent;
use super::uses::{Renamed, TreeUses};
use crate::dataset::scale::in_proportion;
use crate::statistics::Quartiles;

pub use super::notes::notes;

/// So many contributions are shown in a text.
const CONTRIBUTIONS: usize = 24;
/// Characters in a line of prose, unless another width is asked for.
pub const WIDTH: usize = 100;
/// Of lines that are no longer the margins stand below one another.
const MARGIN: usize = 108;
/// A part of a listing is cut to this length in a table.
const PART: usize = 60;

/// The explanation as plain text. `name` is what the program is called.
pub fn text(explanation: &Explanation, name: &str) -> String {
    text_within(explanation, name, None)
}

/// The same for a screen of so many characters: what would be longer is folded.
pub fn text_within(explanation: &Explanation, name: &str, screen: Option<usize>) -> String {
    let width = screen.map_or(WIDTH, |screen| WIDTH.min(screen.saturating_sub(2)));
    let mut out = format!("{name}\n\n");
    out += &listing_within(explanation, screen.unwrap_or(usize::MAX));
    out.push('\n');
    wrap(&checked(explanation), "", width, &mut out);
    let _ = writeln!(out, "\nHow to read it");
    notes(&explanation.listing).iter().for_each(|line| wrap(line, "  ", width, &mut out));
    let _ = writeln!(out, "\nWhat is used");
    uses(explanation).iter().for_each(|line| wrap(line, "  ", width, &mut out));
    if let Some(heading) = data(explanation) {
        let _ = writeln!(out, "\n{heading}");
        sweeps(explanation).iter().for_each(|line| wrap(line, "  ", width, &mut out));
    }
    if !explanation.contributions.tried.is_empty() {
        let _ = writeln!(out, "\n{}", without(explanation));
        let rows = contributions(explanation);
        let widths: Vec<usize> =
            (0..5).map(|i| rows.iter().map(|row| row[i].chars().count()).max().unwrap_or(0)).collect();
        for row in &rows {
            let numbers = format!(
                "  {:>w0$}  {:>w1$}  {:>w2$}  ",
                row[0],
                row[1],
                row[2],
                w0 = widths[0],
                w1 = widths[1],
                w2 = widths[2],
            );
            let whole = format!("{numbers}{:<w3$}  {}", row[3], row[4], w3 = widths[3]);
            if whole.chars().count() <= screen.unwrap_or(usize::MAX) {
                let _ = writeln!(out, "{}", whole.trim_end());
            } else {
                let room = screen.unwrap_or(usize::MAX);
                fold(&numbers, &row[3], room, &mut out);
                fold(&" ".repeat(numbers.len() + 2), &row[4], room, &mut out);
            }
        }
        out += &more(explanation);
    }
    out
}

/// Adds a line, broken between words where it is long, and indented.
fn wrap(text: &str, indent: &str, width: usize, out: &mut String) {
    let mut length = 0;
    for (i, word) in text.split(' ').enumerate() {
        let word_length = word.chars().count();
        if i == 0 {
            out.push_str(indent);
        } else if length + 1 + word_length > width {
            let _ = write!(out, "\n{indent}  ");
            length = 2;
        } else {
            out.push(' ');
            length += 1;
        }
        out.push_str(word);
        length += word_length;
    }
    out.push('\n');
}

/// Adds what stands at the beginning of a line and a text behind it, broken between words to stay there within so many
/// characters.
fn fold(head: &str, text: &str, room: usize, out: &mut String) {
    let indent = head.chars().count();
    out.push_str(head);
    let mut length = indent;
    for (i, word) in text.split(' ').enumerate() {
        let word_length = word.chars().count();
        if i > 0 && length + 1 + word_length > room {
            let _ = write!(out, "\n{:indent$}", "");
            length = indent;
        } else if i > 0 {
            out.push(' ');
            length += 1;
        }
        out.push_str(word);
        length += word_length;
    }
    out.push('\n');
}

/// The explanation as Markdown. `name` is what the program is called.
pub fn markdown(explanation: &Explanation, name: &str) -> String {
    let mut out = format!("# {}\n\n", escape(name));
    let _ = writeln!(out, "```text\n{}```\n\n{}\n", listing(explanation), escape(&checked(explanation)));
    for line in notes(&explanation.listing) {
        let _ = writeln!(out, "- {}", escape(&line));
    }
    let _ = writeln!(out, "\n## What is used\n");
    for line in uses(explanation) {
        let _ = writeln!(out, "- {}", escape(&line));
    }
    if let Some(heading) = data(explanation) {
        let _ = writeln!(out, "\n## On the data\n\n{}\n", escape(&heading));
        for line in sweeps(explanation) {
            let _ = writeln!(out, "- {}", escape(&line));
        }
    }
    if !explanation.contributions.tried.is_empty() {
        let _ = writeln!(out, "\n## {}\n", without(explanation));
        let rows = contributions(explanation);
        for (i, row) in rows.iter().enumerate() {
            let cells: Vec<String> = row.iter().map(|cell| escape(cell)).collect();
            let _ = writeln!(out, "| {} |", cells.join(" | "));
            if i == 0 {
                out += "|---:|---:|---:|---|---|\n";
            }
        }
        let _ = write!(out, "\n{}", escape(&more(explanation)));
    }
    out
}

/// Text that Markdown leaves as it is.
fn escape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        if "\\`*_[]<>|#".contains(c) {
            out.push('\\');
        }
        out.push(c);
    }
    out
}

/// The listing with numbers before the lines and, where there is data, what happens at each after them.
pub fn listing(explanation: &Explanation) -> String {
    listing_within(explanation, usize::MAX)
}

/// The same in lines of at most `room` characters: where a margin does not fit beside its line it stands below it.
pub fn listing_within(explanation: &Explanation, room: usize) -> String {
    const GAP: &str = "  │ ";
    let lines = explanation.listing.lines();
    let margins = match &explanation.profile {
        Some(profile) => profile.margins(&explanation.listing),
        None => vec![String::new(); lines.len()],
    };
    let fits = |length: usize, margin: &str| length.saturating_add(9 + margin.chars().count()) <= room;
    let with_margin = lines.iter().zip(&margins).filter(|(_, margin)| !margin.is_empty());
    let lengths = with_margin.map(|(line, margin)| (line.text.chars().count(), margin));
    let beside = lengths.filter(|(length, margin)| *length <= MARGIN && fits(*length, margin));
    let width = beside.map(|(length, _)| length).max().unwrap_or(0);
    let mut out = String::new();
    for (i, (line, margin)) in lines.iter().zip(&margins).enumerate() {
        let code = line.text.trim_start();
        let depth = line.text.len() - code.len();
        let head = format!("{:>3}  {:depth$}", i + 1, "");
        if !margin.is_empty() && fits(width.max(line.text.chars().count()), margin) {
            let _ = writeln!(out, "{:>3}  {:<width$}{GAP}{margin}", i + 1, line.text);
            continue;
        }
        fold(if code.is_empty() { head.trim_end() } else { &head }, code, room, &mut out);
        if !margin.is_empty() {
            fold(&format!("{:1$}{GAP}", "", 3 + depth), margin, room, &mut out);
        }
    }
    out
}

/// What the text was held against.
pub fn checked(explanation: &Explanation) -> String {
    let checked = &explanation.checked;
    let how = if explanation.why_interpreted.is_some() { "interpreted" } else { "compiled" };
    format!(
        "Checked: read back and run as it stands, the text above gives the same {} answers as the {how} program on {}, \
         bit for bit.",
        checked.answers, checked.on
    )
}

/// What is used, line by line.
pub fn uses(explanation: &Explanation) -> Vec<String> {
    let uses = &explanation.uses;
    let (nodes, live) = uses.nodes();
    let (at_most, more) = if uses.complete { ("", "") } else { ("at most ", " or more") };
    let mut out = vec![format!(
        "{at_most}{live} of {nodes} nodes do anything; introns: {}{more} ({}). {} operation{} before the optimiser, {} after.",
        nodes - live,
        percent((nodes - live) as f64 / nodes.max(1) as f64),
        uses.operations_before,
        if uses.operations_before == 1 { "" } else { "s" },
        uses.operations,
    )];
    let merged = |tree: &TreeUses| tree.tree == "first" && explanation.listing.first.is_none();
    out.extend(uses.trees.iter().map(|tree| tree_uses(tree, merged(tree))));
    out
}

fn tree_uses(tree: &TreeUses, merged: bool) -> String {
    let list = |names: &[&str]| if names.is_empty() { "none".to_string() } else { names.join(", ") };
    let name = if tree.tree == "only" { "the tree".to_string() } else { format!("{} tree", tree.tree) };
    if tree.live == 0 {
        return format!("{name}: {} nodes, none of which matters", tree.nodes);
    }
    let idle = |names: &[&str]| match names {
        [] => String::new(),
        names => format!(" (in the tree, but not needed: {})", names.join(", ")),
    };
    format!(
        "{name}: {} of {} nodes; operators {}{}; registers stored {}, read {}{}{}",
        tree.live,
        tree.nodes,
        list(&tree.operators),
        idle(&tree.idle_operators),
        list(&tree.stored),
        list(&tree.read),
        idle(&tree.idle_registers),
        if merged {
            "; in the listing it is a part of the only tree there".to_string()
        } else {
            renamed(&tree.listing)
        },
    )
}

/// Where the listing's registers are not those of the tree.
fn renamed(listing: &Renamed) -> String {
    let mut parts: Vec<String> =
        listing.other_letter.iter().map(|[tree, listing]| format!("{tree} is called {listing}")).collect();
    if !listing.without.is_empty() {
        parts.push(format!("{} not there", are(&listing.without)));
    }
    if !listing.own.is_empty() {
        parts.push(format!("{} the optimiser's own", are(&listing.own)));
    }
    if parts.is_empty() { String::new() } else { format!("; in the listing {}", parts.join(", ")) }
}

/// Names and a verb.
fn are(names: &[&str]) -> String {
    match names {
        [one] => format!("{one} is"),
        [some @ .., last] => format!("{} and {last} are", some.join(", ")),
        [] => String::new(),
    }
}

/// How the program does on the data.
pub fn data(explanation: &Explanation) -> Option<String> {
    let profile = explanation.profile.as_ref()?;
    let share = percent(profile.correct as f64 / profile.cases.max(1) as f64);
    Some(format!(
        "{} on {}: {} of {} cases within {}",
        share,
        profile.data,
        profile.correct,
        profile.cases,
        in_proportion(profile.tolerance, profile.height)
    ))
}

/// How far each sweep goes.
pub fn sweeps(explanation: &Explanation) -> Vec<String> {
    let Some(profile) = &explanation.profile else { return Vec::new() };
    let both = profile.sweeps.len() == 2;
    let mut out = Vec::new();
    for (i, (sweep, of)) in profile.sweeps.iter().zip(explanation.listing.sweeps()).enumerate() {
        let name = if both { ["first tree", "second tree"][i] } else { "the tree" };
        let mut line = match of.course {
            Course::Stands(_) => format!("{name}: one position in each case"),
            Course::Moves(_) => {
                let mean = sweep.positions as f64 / profile.cases.max(1) as f64;
                format!("{name}: {mean:.1} positions in a case, in the mean")
            }
        };
        if !of.stop_sites().is_empty() {
            let _ = write!(line, "; a stop ends it in {} of {} cases", sweep.stopped, profile.cases);
        }
        out.push(line);
        for (i, at) in lines_of_stops(explanation, i) {
            let Quartiles { min, lower, median, upper, max } = at;
            out.push(if min == max {
                format!("stop in line {i}: always at position {min:.0}")
            } else {
                format!(
                    "stop in line {i}: at position {min:.0}, {lower:.0}, {median:.0}, {upper:.0}, {max:.0} \
                     (least, quartiles, greatest; the first is 1)"
                )
            });
        }
    }
    let margins = profile.margins(&explanation.listing).concat();
    let signs = [
        (" | ", "of a choice how often its condition holds | does not"),
        ("×", "of what is stored how often (×)"),
        ("never come to", "never come to: no case gets there"),
    ];
    let there: Vec<&str> =
        signs.into_iter().filter(|(sign, _)| margins.contains(sign)).map(|(_, what)| what).collect();
    if !there.is_empty() {
        out.push(format!("beside the lines: {}", there.join("; ")));
    }
    out
}

/// The `stop`s of a sweep that fired, by line.
fn lines_of_stops(explanation: &Explanation, number: usize) -> Vec<(usize, Quartiles)> {
    let Some(profile) = &explanation.profile else { return Vec::new() };
    let Some(sweep) = explanation.listing.sweeps().nth(number) else { return Vec::new() };
    let stops = sweep.stop_sites();
    let mut out = Vec::new();
    for (i, line) in explanation.listing.lines().iter().enumerate().filter(|(_, l)| l.sweep == Some(number)) {
        for site in line.sites.iter().filter(|site| stops.contains(site)) {
            out.extend(profile.sweeps[number].sites[*site as usize].stops_at.map(|at| (i + 1, at)));
        }
    }
    out
}

/// The words above the table of contributions.
fn without(explanation: &Explanation) -> &'static str {
    if explanation.contributions.tried.iter().any(|c| c.loss < 0.0) {
        "Without each part, the greatest loss first (below 0: it does better without)"
    } else {
        "Without each part, the greatest loss first"
    }
}

/// The table of contributions: a heading and rows of loss, fitness, line, part and what is in its place.
pub fn contributions(explanation: &Explanation) -> Vec<[String; 5]> {
    let mut rows = vec![["loss", "fitness", "line", "part", "in its place"].map(str::to_string)];
    for c in explanation.contributions.tried.iter().take(CONTRIBUTIONS) {
        let part = match c.part.chars().count() {
            n if n > PART => c.part.chars().take(PART - 1).chain(['…']).collect(),
            _ => c.part.clone(),
        };
        rows.push([
            format!("{:.1} %", 100.0 * c.loss),
            format!("{:.1} %", 100.0 * c.fitness),
            c.line.to_string(),
            part,
            c.without.clone(),
        ]);
    }
    rows
}

/// What the table leaves out, a line each.
pub fn more(explanation: &Explanation) -> String {
    let mut out = match explanation.contributions.tried.len().saturating_sub(CONTRIBUTIONS) {
        0 => String::new(),
        n => format!("  and {n} more (`--json` has them)\n"),
    };
    if explanation.contributions.left_out > 0 {
        let n = explanation.contributions.left_out;
        let _ = writeln!(out, "  {n} further parts were not tried, for that would take too long");
    }
    out
}
