//! How to read a listing.

use vsonar_ir::Moment;

use super::listing::{Course, Expr, Listing, Sign, Stmt, Sweep};
use super::visit::Visitor;
use crate::tree::Shortest;

/// How to read a listing: of the rules those that it needs.
pub fn notes(listing: &Listing) -> Vec<String> {
    #[derive(Default)]
    struct Seen {
        protected: bool,
        power: bool,
        register: bool,
        iter2: bool,
        y: bool,
        x_obstacle: bool,
        window: bool,
        square: bool,
        not_finite: bool,
    }
    impl Visitor for Seen {
        fn expr(&mut self, expr: &mut Expr) {
            match expr {
                Expr::Binary(Sign::Protected, ..) => self.protected = true,
                Expr::Power(_, n) => self.power |= *n > 2,
                Expr::Register(_) => self.register = true,
                Expr::Iter2(_) => self.iter2 = true,
                Expr::Y => self.y = true,
                Expr::XObstacle => self.x_obstacle = true,
                Expr::Window(operand) => {
                    self.window = true;
                    self.square |= operand.moment == Moment::MeanSquare;
                }
                Expr::Const(value) => self.not_finite |= !value.is_finite(),
                _ => {}
            }
        }
    }
    let mut seen = Seen::default();
    listing.clone().sweeps_mut().for_each(|sweep| sweep.visit(&mut seen));
    let text = listing.to_string();
    let mut notes = Vec::new();
    let moves = |sweep: &Sweep| matches!(sweep.course, Course::Moves(_));
    if listing.sweeps().any(moves) {
        notes.push("A window that moves does so by one pixel at a time.".to_string());
    }
    if !listing.sweeps().all(moves) {
        notes.push(
            "Of a window that stands only the last position of its way makes a difference.".to_string(),
        );
    }
    if listing.sweeps().any(|sweep| sweep.operands().is_empty()) {
        notes.push(
            "A window over which nothing is averaged is shown as small as may be, and in column 0 where that makes no \
             difference."
                .to_string(),
        );
    }
    let mut words = Vec::new();
    if seen.y {
        words.push("y is the row of the window's centre, from the top");
    }
    if seen.x_obstacle {
        words.push("x-obstacle is the column asked about");
    }
    if seen.window {
        words.push(match seen.square {
            true => "an operator's name is its average over the window, with -sq that of its squares",
            false => "an operator's name is its average over the window",
        });
    }
    words.push("the answer is the last a, a row from the top");
    notes.push(sentence(&words.join("; ")));
    let constant = match &listing.second.body[..] {
        [Stmt::Assign(_, 0, Expr::Const(value))] if !moves(&listing.second) => Some(*value),
        _ => None,
    };
    if let Some(value) = constant {
        notes.push(format!("Here it is {} whatever is in the image.", Shortest(value)));
    } else if !seen.window {
        notes.push("Nothing of the image is looked at.".to_string());
    }
    if listing.sweeps().any(|sweep| !matches!(sweep.column, Expr::XObstacle | Expr::Const(_))) {
        notes.push("A column is rounded, and moved to where the window is inside the image.".to_string());
    }
    if text.contains("stop") {
        notes.push("stop ends the sweep after this position; what is stored there counts.".to_string());
    }
    if seen.register {
        notes.push(
            "A register on the right has the value that the position before left, 0 at the first."
                .to_string(),
        );
    } else if constant.is_none() {
        notes.push("A register that nothing is stored in is 0.".to_string());
    }
    if seen.iter2 {
        notes.push("iter2-… is a register of the first tree as it ended.".to_string());
    }
    if seen.protected {
        notes.push("÷ is 1 where the divisor is 0.".to_string());
    }
    if seen.power {
        notes.push("Each operation is rounded to binary32: x³ is x·x·x, x⁴ (x²)², x⁵ (x²)²·x.".to_string());
    }
    if seen.not_finite {
        notes.push(
            "inf is greater than any number, NaN is none; as an answer neither is correct.".to_string(),
        );
    }
    if text.contains('≰') || text.contains('≮') {
        notes.push("≰ and ≮ hold also where a value is not a number (NaN).".to_string());
    }
    notes
}

/// Words with a capital at the beginning, unless they begin with a name, and a stop.
fn sentence(words: &str) -> String {
    let name = words.starts_with("y ") || words.starts_with("x-");
    let mut chars = words.chars();
    match chars.next() {
        Some(first) if !name => format!("{}{}.", first.to_ascii_uppercase(), chars.as_str()),
        _ => format!("{words}."),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The notes on a listing with this head and body.
    fn of(head: &str, body: &str) -> String {
        let text = format!("images of 64 x 48 pixels\n\nthe tree: {head}\n    {body}\n\nanswer: a\n");
        let listing: Listing = text.parse().unwrap_or_else(|e| panic!("{e}\n{text}"));
        assert_eq!(listing.to_string(), text);
        notes(&listing).join("\n")
    }

    #[test]
    fn only_what_the_listing_needs_is_said() {
        let constant = of("a 2 x 2 window stands at the bottom of column 0", "a := NaN");
        assert_eq!(
            constant,
            "Of a window that stands only the last position of its way makes a difference.\n\
             A window over which nothing is averaged is shown as small as may be, and in column 0 where that makes no \
             difference.\n\
             The answer is the last a, a row from the top.\n\
             Here it is NaN whatever is in the image.\n\
             inf is greater than any number, NaN is none; as an answer neither is correct."
        );
        assert_eq!(
            of("an 8 x 8 window moves up column x-obstacle", "if raw-sq > y: stop"),
            "A window that moves does so by one pixel at a time.\n\
             y is the row of the window's centre, from the top; x-obstacle is the column asked about; an operator's name is \
             its average over the window, with -sq that of its squares; the answer is the last a, a row from the top.\n\
             stop ends the sweep after this position; what is stored there counts.\n\
             A register that nothing is stored in is 0."
        );
        let blind = of("a 2 x 2 window moves down column 0", "a := a + 1 ÷ y");
        assert!(blind.contains("Nothing of the image is looked at."), "{blind}");
        assert!(blind.contains("the position before left") && blind.contains("÷ is 1"), "{blind}");
        let column = of("a 2 x 2 window stands at the top of column x-obstacle / 2", "a := raw");
        assert!(column.contains("A column is rounded") && !column.contains("least"), "{column}");
    }
}
