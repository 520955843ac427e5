//! A program from a file: as evolved (.gp), or in the compiler's own text form (.vir).

use std::path::{Path, PathBuf};
use std::sync::Once;

use vsonar::detector::ProgramDetector;
use vsonar::export::Provenance;
use vsonar::ir::{Program, text};
use vsonar::support::bounded::Bounded;
use vsonar::tree::Individual;

use super::CliError;
use vsonar::support::printable::ShownPath as _;

/// Reads far more than the text of any program. It may come through a pipe.
const PROGRAM: Bounded = BEST.or_pipes();
/// The same of a run folder's program.
const BEST: Bounded = Bounded::to(64 << 20);

/// What a file holds.
#[derive(Debug)]
pub(crate) enum Loaded {
    /// As evolved, for images of any size; with the file's text.
    Individual(Individual, String),
    /// In the compiler's form, for images of the size that it states.
    Program(Box<Program>),
}

impl Loaded {
    /// Reads the file; the ending `.vir` tells the compiler's form. To be called with room for deep recursion
    /// ([`super::executor::with_stack`]), as all of this.
    pub(crate) fn load(path: &Path) -> Result<Loaded, CliError> {
        if path.extension().is_none_or(|e| e != "vir") {
            let (individual, text) = Individual::load_with_text(path)?;
            return Ok(Loaded::Individual(individual, text));
        }
        let source = PROGRAM.text(path).map_err(|e| CliError::file(path, "read the program", &e))?;
        let program = text::parse(&source);
        program
            .map(|program| Loaded::Program(Box::new(program)))
            .map_err(|e| CliError::Failed(format!("{}: {e}", path.shown())))
    }

    /// The size of images that the program states.
    pub(crate) fn size(&self) -> Option<(u32, u32)> {
        match self {
            Loaded::Individual(..) => None,
            Loaded::Program(program) => Some((program.width(), program.height())),
        }
    }

    /// Where it comes from, as far as its file says.
    pub(crate) fn provenance(&self) -> Provenance {
        match self {
            Loaded::Individual(_, text) => Provenance::of_text(text),
            Loaded::Program(program) => Provenance { program: text::print(program), ..Provenance::default() },
        }
    }

    /// The size of images that it is taken for: the one asked for, else the one that it states or was evolved on, else
    /// that of the method. `path` is its file.
    pub(crate) fn size_for(&self, path: &Path, asked: Option<(u32, u32)>) -> Result<(u32, u32), CliError> {
        self.check_size(path, asked)?;
        let (width, height) = asked.or(self.size()).or_else(|| self.provenance().size).unwrap_or(SIZE);
        if Program::fits(width, height) {
            return Ok((width, height));
        }
        Err(CliError::Failed(format!(
            "{}: its comment says that it was evolved on images of {width}x{height} pixels, but each side must have {} to \
             {}; correct or remove the comment",
            path.shown(),
            Program::MIN_SIDE,
            Program::MAX_SIDE
        )))
    }

    /// Refuses images of another size than it states.
    pub(crate) fn check_images(&self, path: &Path, (width, height): (u32, u32)) -> Result<(), CliError> {
        match self.size() {
            Some(own) if own != (width, height) => Err(CliError::Failed(format!(
                "{}: is for images of {}x{} pixels, but these have {width}x{height}; scale them, or give the .gp file that \
                 it was made of",
                path.shown(),
                own.0,
                own.1
            ))),
            _ => Ok(()),
        }
    }

    /// Warns of images of another size than it was evolved on.
    pub(crate) fn note_size(&self, path: &Path, size: (u32, u32)) {
        if let Loaded::Individual(_, text) = self {
            note_size(path, text, size);
        }
    }

    /// The program before the optimiser, for images of the size given, which must be the one it states.
    pub(crate) fn lowered(self, (width, height): (u32, u32)) -> Program {
        match self {
            Loaded::Individual(individual, _) => vsonar::lower::lower(&individual, width, height),
            Loaded::Program(program) => *program,
        }
    }

    /// Refuses a `--size` that is not the one the program at `path` states.
    pub(crate) fn check_size(&self, path: &Path, size: Option<(u32, u32)>) -> Result<(), CliError> {
        match (self.size(), size) {
            (Some((width, height)), Some(size)) if size != (width, height) => Err(CliError::Usage(format!(
                "--size: {} states its own image size, {width}x{height}; change it there",
                path.shown(),
            ))),
            _ => Ok(()),
        }
    }
}

/// The file of a program: itself, or the best one of a run folder.
pub(crate) fn file(path: &Path) -> Result<PathBuf, CliError> {
    let best = path.join("best.gp");
    match path.is_dir() {
        false => Ok(path.to_path_buf()),
        // Whoever names a folder means no pipe.
        true if best.exists() => match BEST.open(&best) {
            Ok(_) => Ok(best),
            Err(error) => Err(CliError::file(&best, "read the program", &error)),
        },
        true => Err(CliError::Failed(format!(
            "{}: this folder has no best.gp, so it is no run folder; give a program, or the folder of one run",
            path.shown()
        ))),
    }
}

/// Warns if the comment of a program says that it was evolved on images of another size than these.
pub(crate) fn note_size(path: &Path, text: &str, size: (u32, u32)) {
    if let Err(other) = Provenance::of_text(text).check_size(size) {
        let (width, height) = other.evolved;
        super::output::say(&format!(
            "note: {} {other}; scale them to {width}x{height}, as ffmpeg does by `-vf scale={width}:{height}`",
            path.shown()
        ));
    }
}

/// The size of the images that a program was evolved on, as its comment says, if there can be programs for it.
pub(crate) fn evolved_on(text: &str) -> Option<(u32, u32)> {
    Provenance::of_text(text).size.filter(|&(width, height)| Program::fits(width, height))
}

/// The detector of an optimised program. Where the program is interpreted, a note says so, unless `quiet`.
pub(crate) fn detector(program: &Program, quiet: bool) -> ProgramDetector {
    let detector = ProgramDetector::new(program);
    if let Some(why) = detector.why_interpreted().filter(|_| !quiet) {
        note_interpreted(why);
    }
    detector
}

/// Says once that a program is interpreted, and why.
pub(crate) fn note_interpreted(why: impl std::fmt::Display) {
    static SAID: Once = Once::new();
    SAID.call_once(|| {
        super::output::say(&format!(
            "note: the program is interpreted, with the same answers, only slower: {why}"
        ));
    });
}

/// The size of images unless one is given: that of the method.
pub(crate) const SIZE: (u32, u32) = (320, 240);

/// An image size, as in 320x240.
pub(crate) fn size(text: &str) -> Result<(u32, u32), String> {
    let (min, max) = (Program::MIN_SIDE, Program::MAX_SIDE);
    let sides = text.split_once('x').and_then(|(w, h)| Some((w.parse().ok()?, h.parse().ok()?)));
    sides
        .filter(|&(width, height)| Program::fits(width, height))
        .ok_or_else(|| format!("give width and height, {min} to {max} pixels each, as in 320x240"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes() {
        assert_eq!(size("64x48"), Ok((64, 48)));
        for wrong in ["64", "64x", "x48", "15x48", "64x1000000", "-64x48", "64x48x3", ""] {
            assert!(size(wrong).is_err(), "{wrong}");
        }
    }
}
