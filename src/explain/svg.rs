//! What the pictures of explanations have in common: a frame that is readable in light and dark, and escaped text.

use std::fmt::Write as _;

use crate::support::printable;

/// Colours for light and dark, by class.
const STYLE: &str = "\
svg{color:#1d2329;background:#fff;font:12px ui-sans-serif,system-ui,sans-serif}
text{fill:currentColor;stroke:none}
path,line,rect,polyline{fill:none;stroke:currentColor}
.quiet{opacity:.3}.dim{opacity:.65}.faint{stroke-opacity:.25}.mono{font-family:ui-monospace,monospace}.small{font-size:10px}
.image{stroke:#1668c4}.memory{stroke:#1e8449}.flow{stroke:#b9770e}.root{stroke-width:2}
.answer{stroke:#d35400;stroke-width:1.5}.label{stroke:#16a085;stroke-width:1.5;stroke-dasharray:5 3}
text.answer{fill:#d35400;stroke:none}text.label{fill:#16a085;stroke:none}
.held{fill:currentColor;stroke:none}.window{stroke:#f1c40f;stroke-width:1.5}
@media (prefers-color-scheme:dark){svg{color:#e6e9ec;background:#14181c}.image{stroke:#6cb2ff}.memory{stroke:#58d68d}
.flow{stroke:#f5b041}.answer{stroke:#ff9f5a}text.answer{fill:#ff9f5a}.label{stroke:#48e0c2}text.label{fill:#48e0c2}}";

/// A picture of this size around some content.
pub(super) fn frame(width: f64, height: f64, title: &str, content: &str) -> String {
    let mut out = String::new();
    let _ = write!(
        out,
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width:.0}\" height=\"{height:.0}\" \
         viewBox=\"0 0 {width:.0} {height:.0}\" role=\"img\">\n<title>{}</title>\n<style>\n{STYLE}\n</style>\n\
         {content}</svg>\n",
        escape(title)
    );
    out
}

/// Text as it may stand in an SVG document: no sign of the language, hidden characters escaped.
pub(super) fn escape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in printable::line(text).chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\u{fffe}' | '\u{ffff}' => out.push('?'),
            c => out.push(c),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_is_escaped() {
        assert_eq!(escape("a<b & \"c\"\u{7}"), "a&lt;b &amp; &quot;c&quot;\\u{7}");
    }
}
