//! What sections of a page are made of: figures with their numbers, tables, numbers in words.

use maud::{Markup, PreEscaped, html};

use super::chart::{Ink, Marker, Plot, PlotError, Shape};
use crate::statistics::Quartiles;
use crate::support::printable;

/// Points of a line, at most: more than a screen has across.
pub(super) const POINTS: usize = 600;

/// Rows of the numbers under a plot, at most; of more, one in so many.
const NUMBERS: usize = 120;

/// A table. The first cell of a row names it.
#[derive(Debug, Clone, Default)]
pub(super) struct Table {
    pub(super) caption: String,
    pub(super) headings: Vec<String>,
    pub(super) rows: Vec<Vec<String>>,
    /// Rows that stand out.
    pub(super) chosen: Vec<usize>,
    /// Columns of words, which are set from the left.
    pub(super) words: Vec<usize>,
}

impl Table {
    pub(super) fn new(caption: &str, headings: &[&str]) -> Table {
        Table {
            caption: caption.to_string(),
            headings: headings.iter().map(|heading| heading.to_string()).collect(),
            ..Table::default()
        }
    }

    pub(super) fn row(&mut self, cells: impl IntoIterator<Item = String>) {
        self.rows.push(cells.into_iter().collect());
    }

    /// The table; it scrolls in itself where there is no room.
    pub(super) fn html(&self) -> Markup {
        let class = |i: usize| self.words.contains(&i).then_some("text");
        html! {
            p.caption { (self.caption) }
            div.scroll tabindex="0" role="region" aria-label=(self.caption) {
                table aria-label=(self.caption) {
                    thead { tr { @for (i, heading) in self.headings.iter().enumerate() {
                        th scope="col" class=[class(i)] { (heading) }
                    } } }
                    tbody { @for (number, row) in self.rows.iter().enumerate() {
                        tr class=[self.chosen.contains(&number).then_some("chosen")] {
                            @for (i, cell) in row.iter().enumerate() {
                                @if i == 0 { th scope="row" { (cell) } }
                                @else { td class=[class(i)] { (cell) } }
                            }
                        }
                    } }
                }
            }
        }
    }

    /// The table behind a line to open it.
    pub(super) fn folded(&self, summary: &str) -> Markup {
        html! { details { summary { (summary) } (self.html()) } }
    }
}

/// A plot with its heading, its legend, its description and its numbers.
pub(super) struct Figure<'a> {
    /// Unique on the page.
    pub(super) id: String,
    pub(super) title: &'a str,
    /// What is to be seen, in a sentence or two.
    pub(super) description: String,
    pub(super) plot: Plot,
    pub(super) numbers: Table,
}

impl Figure<'_> {
    pub(super) fn html(&self) -> Result<Markup, PlotError> {
        let svg = self.plot.svg(&self.id, self.title, &self.description)?;
        Ok(html! {
            figure {
                figcaption { (self.title) }
                (self.legend())
                (PreEscaped(svg))
                p.soft { (self.description) }
                (self.numbers.folded("The numbers"))
            }
        })
    }

    fn legend(&self) -> Markup {
        let named: Vec<(&str, Ink, &Shape)> = (self.plot.series.iter())
            .filter_map(|series| Some((series.name.as_deref()?, series.ink, &series.shape)))
            .collect();
        html! { @if named.len() > 1 { ul.legend { @for (name, ink, shape) in named {
            li { (swatch(ink, shape)) (name) }
        } } } }
    }
}

fn swatch(ink: Ink, shape: &Shape) -> Markup {
    let class = ink.class();
    let of = |kind: &str| format!("{kind}-{class}");
    html! {
        svg viewBox="0 0 30 10" aria-hidden="true" {
            @match shape {
                Shape::Line(_) => line x1="0" y1="5" x2="30" y2="5" stroke-width="2.5" class=(of("l")) {},
                Shape::Band(_) => rect x="0" y="0" width="30" height="10" opacity="0.3" class=(of("f")) {},
                Shape::Dots(..) => { @match ink.marker() {
                    Marker::Disc => circle cx="15" cy="5" r="4" class=(of("f")) {},
                    Marker::Triangle => path d="M15 0 L20 9 L10 9 Z" class=(of("f")) {},
                    Marker::Square => rect x="11" y="1" width="8" height="8" class=(of("f")) {},
                } }
                Shape::Rings(_) => circle cx="15" cy="5" r="4" fill="none" stroke-width="2" class=(of("l")) {},
                Shape::Bars(_) => rect x="8" y="0" width="14" height="10" class=(of("f")) {},
            }
        }
    }
}

/// A command, which breaks between its words alone: a flag that is broken at its hyphen is read as another.
pub(super) fn command(text: &str) -> Markup {
    html! { code.command { @for (i, word) in text.split(' ').enumerate() {
        @if i > 0 { " " } span { (word) }
    } } }
}

/// Words in which code stands between backticks.
pub(super) fn prose(text: &str) -> Markup {
    html! { @for (i, part) in text.split('`').enumerate() {
        @if i % 2 == 1 { (command(part)) } @else { (part) }
    } }
}

/// So many places of so many, evenly, the first and the last among them.
pub(super) fn thinned(count: usize, most: usize) -> Vec<usize> {
    if count <= most || most < 2 {
        return (0..count).collect();
    }
    (0..most).map(|i| i * (count - 1) / (most - 1)).collect()
}

/// Rows of the numbers under a plot of so many points.
pub(super) fn rows(count: usize) -> Vec<usize> {
    thinned(count, NUMBERS)
}

/// A share as a percentage.
pub(super) fn percent(share: f64) -> String {
    match share.abs() {
        ..1e6 => format!("{:.1} %", 100.0 * share),
        _ => number(share),
    }
}

/// A share that may not be known.
pub(super) fn maybe(share: Option<f64>) -> String {
    share.map_or_else(none, percent)
}

/// Nothing to say in a table.
pub(super) fn none() -> String {
    "–".to_string()
}

/// From here to there, in percent.
pub(super) fn between((low, high): (f64, f64)) -> String {
    format!("{:.1} to {:.1} %", 100.0 * low, 100.0 * high)
}

/// A number with one decimal where it is small, and with an exponent where it is very large.
pub(super) fn number(value: f64) -> String {
    if value.abs() < 100.0 && value.fract() != 0.0 { format!("{value:.1}") } else { grouped(value) }
}

/// A whole number with commas between its thousands.
pub(super) fn grouped(value: f64) -> String {
    match value.abs() {
        ..1e15 => {
            let sign = if value <= -0.5 { "-" } else { "" };
            format!("{sign}{}", printable::grouped(&format!("{:.0}", value.abs())))
        }
        _ if value.is_finite() => format!("{value:.2e}"),
        _ => none(),
    }
}

/// A time in words.
pub(super) fn duration(seconds: f64) -> String {
    let whole = seconds.max(0.0).round() as u64;
    match whole {
        _ if !(..1e12).contains(&seconds) => format!("{} s", number(seconds)),
        0..10 => format!("{seconds:.1} s"),
        10..60 => format!("{whole} s"),
        60..3600 => format!("{} min {} s", whole / 60, whole % 60),
        _ => format!("{} h {} min", whole / 3600, whole % 3600 / 60),
    }
}

/// A count and what it counts.
pub(super) fn count(number: usize, noun: &str) -> String {
    format!("{} {noun}{}", grouped(number as f64), if number == 1 { "" } else { "s" })
}

/// Median and quartiles as percentages.
pub(super) fn quartiles(q: &Quartiles) -> String {
    format!("{:.1} % ({:.1} to {:.1})", 100.0 * q.median, 100.0 * q.lower, 100.0 * q.upper)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_in_words() {
        assert_eq!([1234.0, 2.5, 2.0, 123.4, -2000.0].map(number), ["1,234", "2.5", "2", "123", "-2,000"]);
        assert_eq!([0.04, 59.0, 61.0, 7265.0].map(duration), ["0.0 s", "59 s", "1 min 1 s", "2 h 1 min"]);
        let odd = [f64::MAX, -1e15, 1e300, f64::NAN, f64::INFINITY];
        assert_eq!(odd.map(number), ["1.80e308", "-1.00e15", "1.00e300", "–", "–"]);
        assert_eq!(odd.map(percent), ["1.80e308", "-1.00e15", "1.00e300", "–", "–"]);
        assert_eq!(odd.map(duration)[2..], ["1.00e300 s", "– s", "– s"]);
        assert_eq!((thinned(3, 5), thinned(11, 3)), (vec![0, 1, 2], vec![0, 5, 10]));
    }

    #[test]
    fn commands_are_words() {
        let text = command("vsonar report 'a <b>' --no-rivals").into_string();
        let words = ["vsonar", "report", "'a", "&lt;b&gt;'", "--no-rivals"]
            .map(|word| format!("<span>{word}</span>"));
        assert_eq!(text, format!("<code class=\"command\">{}</code>", words.join(" ")));
        let text = prose("see `--data DIR`, <there>").into_string();
        assert!(text.starts_with("see <code class=\"command\"><span>--data</span> <span>DIR"), "{text}");
        assert!(text.ends_with("</code>, &lt;there&gt;"), "{text}");
    }

    #[test]
    fn tables_escape_what_they_hold() {
        let mut table = Table::new("<caption>", &["<a>"]);
        table.row(["<b>&\"".to_string()]);
        let text = table.html().into_string();
        assert!(text.contains("&lt;b&gt;&amp;") && text.contains("aria-label=\"&lt;caption&gt;\""), "{text}");
        assert!(!text.contains("<b>") && !text.contains("<a>"), "{text}");
    }
}
