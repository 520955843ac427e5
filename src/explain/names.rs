//! Names for values and conditions.

use vsonar_ir::{Moment, Operand};

use super::listing::Name;

/// The names given so far in a sweep.
#[derive(Debug, Clone, Default)]
pub(super) struct Names {
    pub(super) list: Vec<String>,
    values: usize,
    conditions: usize,
}

impl Names {
    fn add(&mut self, name: String) -> Name {
        self.list.push(name);
        self.list.len() as Name - 1
    }

    /// `p`, `q`, `r` and so on, then `p2`; letters that neither a register nor an operator's short name has.
    pub(super) fn value(&mut self) -> Name {
        self.values += 1;
        let name = letter(b'p', self.values - 1);
        self.add(name)
    }

    pub(super) fn condition(&mut self) -> Name {
        self.conditions += 1;
        let name = letter(b'P', self.conditions - 1);
        self.add(name)
    }

    pub(super) fn operand(&mut self, operand: Operand) -> Name {
        let letter = operand.operator.letter();
        self.add(match operand.moment {
            Moment::Mean => letter.to_string(),
            Moment::MeanSquare => format!("{letter}{letter}"),
        })
    }
}

/// One of the letters from `p` (or `P`) on that are no operator's short name, with a number when they have been used up.
fn letter(first: u8, number: usize) -> String {
    const LETTERS: &[u8] = b"pqruwz";
    let letter = char::from(first + (LETTERS[number % LETTERS.len()] - LETTERS[0]));
    match number / LETTERS.len() {
        0 => letter.to_string(),
        round => format!("{letter}{}", round + 1),
    }
}
