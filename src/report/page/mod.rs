//! A report on runs as one HTML page that needs nothing else: no script, no network, no other file.
//!
//! ```text
//! run folder ──> Run::read ─────────────┐
//!   (settings, log, hall of fame)       ├──> Report ──> html ──> one file
//! data ──> answers ──> Answers::of ─────┘      └──> JSON
//! ```
//!
//! The page on a run begins with the detector: how good it is, what it sees and what it does; how it came about is below.
//! [`html()`] is a pure function of the [`Report`], and a [`Run`] is cheap to make again from its folder, or from its
//! records alone ([`Run::progress`]): so a run that still goes on can be shown by the same page, without what its data
//! would have to be evaluated for.
//!
//! ```
//! use vsonar::evolve::Settings;
//! use vsonar::report::page::{Report, Run, html};
//!
//! let settings = Settings::paper();
//! let run = Run::progress("runs/one".as_ref(), "photos".into(), &settings, settings.to_toml(), Vec::new());
//! let report = Report { title: "A <run>".into(), runs: vec![run], comparison: None, command: None };
//! let page = html(&report)?;
//! assert!(page.starts_with("<!DOCTYPE html>") && page.contains("A &lt;run&gt;"));
//! # Ok::<(), vsonar::report::page::PlotError>(())
//! ```

mod answers;
mod chart;
mod compare;
mod comparison;
mod curves;
mod errors;
mod folder;
mod model;
mod parts;
mod sections;
#[cfg(test)]
mod tests;

use maud::{DOCTYPE, Markup, PreEscaped, html};

use crate::support::printable;

pub use answers::{Look, PictureRoom, Views};
pub use chart::PlotError;
pub use folder::ReadError;
pub(crate) use folder::name;
pub use model::{
    Answers, Command, Comparison, Compiled, Difference, Group, Histogram, Measure, Member, Pair, Part,
    Picture, Program, ProgramText, Report, Rival, Rivals, Run, Score, Setting, Tally,
};

/// A section: its identifier, its heading, its content.
type Section = (&'static str, &'static str, Markup);

/// The style sheet of a report.
pub(crate) const STYLE: &str = include_str!("style.css");

/// The report as a page.
///
/// # Errors
/// If a plot cannot be drawn.
pub fn html(report: &Report) -> Result<String, PlotError> {
    Ok(document(&report.title, &html! { style { (PreEscaped(STYLE)) } }, &content(report)?))
}

/// The report as the content of an element; its style is [`STYLE`].
pub(crate) fn content(report: &Report) -> Result<Markup, PlotError> {
    match (&report.runs[..], &report.comparison) {
        ([run], None) => single(report, run),
        (runs, comparison) => compare::page(report, runs, comparison.as_ref()),
    }
}

/// A page with this in its head and this as its body.
pub(crate) fn document(title: &str, head: &Markup, body: &Markup) -> String {
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="color-scheme" content="light dark";
                title { (title) }
                (head)
            }
            body { (body) }
        }
    };
    clean(page.into_string())
}

/// The page with whatever hides in names of files shown escaped: no page may hold control characters, and an override
/// of the direction of writing would turn the words around it.
pub(crate) fn clean(page: String) -> String {
    printable::lines(&page).into_owned()
}

/// Sections with a list of them above.
fn sections(sections: Vec<Section>) -> Markup {
    html! {
        nav aria-label="Contents" { ul { @for (id, heading, _) in &sections {
            li { a href={ "#" (id) } { (heading) } }
        } } }
        main { @for (id, heading, content) in sections {
            section id=(id) { h2 { (heading) } (content) }
        } }
    }
}

fn single(report: &Report, run: &Run) -> Result<Markup, PlotError> {
    // The detector first, then how it came about.
    let view = run.answers.as_ref().and_then(|answers| Some((answers, answers.views.first()?)));
    let mut all: Vec<Section> = vec![("result", "Result", sections::result(run, view))];
    if let Some(answers) = run.answers.as_ref().filter(|answers| !answers.pictures.is_empty()) {
        all.push(("pictures", "Pictures", errors::pictures(answers)));
    }
    if let Some(program) = &run.program {
        all.push(("program", "The best program", sections::program(program)));
    }
    if let Some(rivals) = &run.rivals {
        all.push(("rivals", "Compared with the rivals", sections::rivals(rivals)));
    }
    if let Some(answers) = &run.answers {
        all.push(("errors", "Errors", errors::tables(answers, "e-", true)?));
        all.push(("transience", "How long errors last", errors::transience(answers)));
    }
    if run.records.is_empty() {
        all.push(("curves", "Over the generations", html! { p { "There is no complete generation yet." } }));
    } else {
        all.push(("curves", "Over the generations", curves::growth(run, "g-")?));
    }
    if !run.hall_of_fame.is_empty() {
        all.push(("hall", "Hall of fame", sections::hall(run)?));
    }
    if !run.records.is_empty() {
        all.push(("diversity", "Diversity and cache", curves::life(run, "g-")?));
        all.push(("time", "Time by phase", curves::time(run, "g-")?));
    }
    all.push(("settings", "Settings", sections::settings(run)));
    if !run.commands.is_empty() || report.command.is_some() {
        all.push((
            "commands",
            "To repeat it all",
            sections::commands(&run.commands, report.command.as_deref()),
        ));
    }
    Ok(html! {
        header {
            h1 { (report.title) }
            p.soft { "A run of " (parts::command("vsonar evolve")) " on " (run.data) }
            (sections::notes(run))
        }
        (sections(all))
    })
}
