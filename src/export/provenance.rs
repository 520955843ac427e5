//! Where an exported detector comes from: what stands in the comments of `best.gp`.

use crate::support::printable;
use crate::tree::Individual;

/// What is known of a program's origin; it stands in the header and in what `NAME_info` gives.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Provenance {
    /// The program's text: an individual where there is one, else the compiler's form.
    pub program: String,
    /// Name of the data set it was evolved on.
    pub data: Option<String>,
    /// Seed of the run.
    pub seed: Option<u64>,
    /// How many training cases it answers correctly, and of how many.
    pub fitness: Option<(u32, u32)>,
    /// Width and height of the images it was evolved on, in pixels.
    pub size: Option<(u32, u32)>,
}

/// A program that meets images of another size than those it was evolved on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error(
    "was evolved on images of {}x{} pixels and knows their rows by number; these have {}x{}",
    evolved.0, evolved.1, met.0, met.1
)]
pub struct OtherSize {
    /// Width and height of the images it was evolved on, in pixels.
    pub evolved: (u32, u32),
    /// Width and height of those it meets.
    pub met: (u32, u32),
}

impl Provenance {
    /// Checks that images of this width and height are as large as those the program was evolved on. Where that is not
    /// known, any size will do.
    ///
    /// # Errors
    /// If they are of another size.
    pub fn check_size(&self, met: (u32, u32)) -> Result<(), OtherSize> {
        match self.size {
            Some(evolved) if evolved != met => Err(OtherSize { evolved, met }),
            _ => Ok(()),
        }
    }

    /// The comment that [`Provenance::of_text`] reads.
    ///
    /// ```
    /// use vsonar::export::Provenance;
    ///
    /// let comment = Provenance::comment("corridor", 7, 320, 240);
    /// let text = format!("; solves 12 of 30 training cases; 4 nodes\n{comment}\n(individual ...)");
    /// let provenance = Provenance::of_text(&text);
    /// assert_eq!((provenance.data.as_deref(), provenance.seed), (Some("corridor"), Some(7)));
    /// assert_eq!((provenance.fitness, provenance.size), (Some((12, 30)), Some((320, 240))));
    /// ```
    pub fn comment(data: &str, seed: u64, width: u32, height: u32) -> String {
        let data = printable::line(data);
        format!("; evolved with seed {seed}, on images of {width}x{height} pixels, of the data set {data}")
    }

    /// What the comments before a program say; what they do not say stays unknown. The program is the whole text
    /// without them.
    pub fn of_text(text: &str) -> Provenance {
        let mut out = Provenance::default();
        let mut rest = text;
        while let Some(comment) = rest.trim_start().strip_prefix(';') {
            let (line, after) = comment.split_once('\n').unwrap_or((comment, ""));
            out.read(line.trim());
            rest = after;
        }
        out.program = rest.trim().to_string();
        out
    }

    /// What is known of an individual that stands in no file.
    pub fn of_individual(individual: &Individual) -> Provenance {
        Provenance { program: individual.to_string(), ..Provenance::default() }
    }

    /// What `NAME_info` gives: correct answers, and of how many; -1 and -1 if they are not known.
    pub(super) fn answers(&self) -> (i32, i32) {
        let number = |n: u32| i32::try_from(n).unwrap_or(i32::MAX);
        self.fitness.map_or((-1, -1), |(correct, cases)| (number(correct), number(cases)))
    }

    fn read(&mut self, comment: &str) {
        if let Some(solved) = comment.strip_prefix("solves ") {
            let mut words = solved.split([' ', ';']);
            if let (Some(correct), Some("of"), Some(cases), Some("training")) =
                (words.next(), words.next(), words.next(), words.next())
            {
                self.fitness = correct.parse().ok().zip(cases.parse().ok());
            }
        }
        let evolved =
            comment.strip_prefix("evolved with seed ").and_then(|rest| rest.split_once(", on images of "));
        if let Some((seed, rest)) = evolved
            && let Some((size, data)) = rest.split_once(" pixels, of the data set ")
        {
            self.seed = seed.parse().ok();
            self.size = size.split_once('x').and_then(|(w, h)| w.parse().ok().zip(h.parse().ok()));
            self.data = Some(data.to_string());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn images_of_another_size_are_told_from_those_it_was_evolved_on() {
        let of = |text: &str| Provenance::of_text(text).check_size((320, 240));
        let comment = |width, height| Provenance::comment("photos", 1, width, height);
        assert_eq!(of(&comment(320, 240)), Ok(()));
        assert_eq!(of("(individual ...)"), Ok(()), "what is not known cannot differ");
        for evolved in [(240, 320), (320, 241), (64, 48)] {
            let other = OtherSize { evolved, met: (320, 240) };
            assert_eq!(of(&comment(evolved.0, evolved.1)), Err(other));
            assert!(other.to_string().ends_with("; these have 320x240"), "{other}");
        }
    }
}
