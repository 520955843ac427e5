//! The image operators as C functions of the pixels of a neighbourhood.

use vsonar_ir::formula::image;
use vsonar_ir::{Operand, Operator};

use super::writer::{Id, Writer};

/// A C function that computes one operator, or both of the median family from one sorted neighbourhood.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Function {
    /// One operator.
    One(Operator),
    /// The truncated median as the result, the median corner through a pointer.
    Medians,
}

/// What the pixels of a neighbourhood are called in C.
pub(super) const PIXELS: [&str; 9] = ["nw", "n", "ne", "w", "here", "e", "sw", "s", "se"];

/// An operator's name, or an operand's, as part of a C identifier.
pub(super) fn identifier(name: &str) -> String {
    name.replace('-', "_")
}

/// The functions that a loop with these operands calls. The pixel itself needs none.
pub(super) fn functions(operands: &[Operand]) -> Vec<Function> {
    let mut operators: Vec<Operator> = operands.iter().map(|o| o.operator).collect();
    operators.dedup();
    operators.retain(|o| *o != Operator::Raw);
    let medians = [Operator::Median, Operator::MedianCorner];
    let both = medians.iter().all(|o| operators.contains(o));
    if both {
        operators.retain(|o| !medians.contains(o));
    }
    let family = both.then_some(Function::Medians);
    family.into_iter().chain(operators.into_iter().map(Function::One)).collect()
}

impl Function {
    /// The function's name after the prefix.
    fn name(self) -> String {
        match self {
            Function::One(operator) => identifier(operator.name()),
            Function::Medians => "medians".into(),
        }
    }

    /// The formula: its results, and the nine pixels.
    fn formula(self, w: &mut Writer<'_>) -> (Vec<Id>, [Id; 9]) {
        let pixels = PIXELS.map(|name| w.text(name));
        let results = match self {
            Function::One(operator) => {
                // Sorting does not depend on the order, so that no operator minds.
                vec![image::apply(w, operator, &pixels)]
            }
            Function::Medians => {
                let sorted = image::sorted(w, &pixels);
                let median = image::truncated_median_of_sorted(w, &sorted);
                vec![median, image::absolute_difference(w, pixels[4], sorted[4])]
            }
        };
        (results, pixels)
    }

    /// Which pixels of the neighbourhood the function takes.
    pub(super) fn pixels(self) -> [bool; 9] {
        let mut w = Writer::new("");
        let (results, pixels) = self.formula(&mut w);
        pixels.map(|pixel| w.needs(&results, pixel))
    }

    /// The operators it computes, the result first.
    pub(super) fn operators(self) -> Vec<Operator> {
        match self {
            Function::One(operator) => vec![operator],
            Function::Medians => vec![Operator::Median, Operator::MedianCorner],
        }
    }

    /// A call with the pixels by their names.
    pub(super) fn call(self, prefix: &str) -> String {
        let taken = self.pixels();
        let mut args: Vec<&str> = (0..9).filter(|&i| taken[i]).map(|i| PIXELS[i]).collect();
        if self == Function::Medians {
            args.push("&median_corner");
        }
        format!("{prefix}_{}({})", self.name(), args.join(", "))
    }

    /// The definition.
    pub(super) fn definition(self, prefix: &str) -> String {
        let mut w = Writer::new(prefix);
        let (results, pixels) = self.formula(&mut w);
        let mut params: Vec<String> = (0..9)
            .filter(|&i| w.needs(&results, pixels[i]))
            .map(|i| format!("int32_t {}", PIXELS[i]))
            .collect();
        let (mut body, names) = w.print(&results, "    ");
        if self == Function::Medians {
            params.push("int32_t *corner".into());
            body.push_str(&format!("    *corner = {};\n", names[1]));
        }
        let params = params.join(", ").replace("e, int32_t w,", "e,\n    int32_t w,");
        let (name, about) = (self.name(), self.about());
        format!(
            "/* {about} */\nstatic int32_t {prefix}_{name}({params})\n{{\n{body}    return {};\n}}\n\n",
            names[0]
        )
    }

    fn about(self) -> &'static str {
        match self {
            Function::One(operator) => operator.about(),
            Function::Medians => {
                "From one sorted neighbourhood the truncated median, and the absolute difference of pixel and median."
            }
        }
    }
}
