//! What an evolved program does, for people: the paper's Figure 3, made and checked by machine.
//!
//! From the optimised program comes a [`Listing`], a text of `if`s, formulas and names. It is a small language of its
//! own, with its own parser and evaluator, and every [`Explanation`] runs the printed text against the compiled
//! detector: a text that gives other answers is an error, never shown. With a data set come how often each branch is
//! taken and each `stop` fires ([`Profile`]), what each part contributes ([`Contribution`]), and a trace of one
//! case, pixel by pixel.
//!
//! ```
//! use vsonar::explain::Explanation;
//! use vsonar::tree::Individual;
//!
//! let individual: Individual =
//!     "(individual (iterate-up 3x3 x-obstacle (if-le gradient 50 read-b (prog2 (set-a y) break))))".parse()?;
//! let explanation = Explanation::new(&individual, 64, 48)?;
//! assert_eq!(
//!     explanation.listing.to_string(),
//!     "\
//! images of 64 x 48 pixels
//!
//! the tree: a 3 x 3 window moves up column x-obstacle
//!     if gradient > 50:
//!         a := y
//!         stop
//!
//! answer: a
//! "
//! );
//! // set-a, y, break and what leads to them; read-b does nothing
//! assert_eq!(explanation.uses.nodes(), (11, 10));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod build;
mod check;
mod contribution;
mod evaluate;
mod expression;
mod letters;
pub mod listing;
mod names;
mod naming;
mod notes;
mod order;
mod parse;
mod print;
mod profile;
mod reduce;
mod structure;
mod svg;
pub mod text;
mod trace;
mod trace_svg;
mod trees;
mod uses;
mod view;
mod visit;
mod words;
mod writer;

use serde::{Serialize, Serializer};
use vsonar_ir::Program;
use vsonar_ir::opt::Optimiser;

use crate::dataset::Dataset;
use crate::detector::DetectError;
use crate::exec::ExecError;
use crate::lower::lower;
use crate::tree::Individual;

pub use build::NotReadable;
pub use check::Checked;
pub use contribution::{Contribution, Contributions, contributions};
pub use evaluate::{Observer, Outcome, Position};
pub use listing::Listing;
pub use parse::ListingError;
pub use print::Line;
pub use profile::{Profile, SiteProfile, SweepProfile};
pub use reduce::Live;
pub use trace::{SweepTrace, Trace, TracePosition};
pub use trace_svg::trace_svg;
pub use trees::{dot, svg as trees_svg};
pub use uses::{Renamed, TreeUses, Uses};

/// Why a program could not be explained.
#[derive(Debug, thiserror::Error)]
pub enum ExplainError {
    /// It has no readable form.
    #[error(transparent)]
    NotReadable(#[from] NotReadable),
    /// There are no programs for images of this size.
    #[error(transparent)]
    Size(#[from] ExecError),
    /// The images are not of the size that the explanation is for.
    #[error(transparent)]
    Detect(#[from] DetectError),
    /// The listing's own text could not be read: a fault of this program.
    #[error(
        "the explanation cannot be read back: {0}; this is a fault of vsonar, please report it with the program"
    )]
    Unreadable(ListingError),
    /// The listing gives another answer than the compiled program: a fault of this program.
    #[error(
        "the explanation answers {read} in column {column} of {image}, the compiled program {compiled}; this is a fault of \
         vsonar, please report it with the program"
    )]
    Mismatch {
        /// The image.
        image: String,
        /// The column.
        column: u32,
        /// The answer of the listing's text.
        read: f32,
        /// The answer of the compiled program.
        compiled: f32,
    },
}

/// An explained program, for images of one size.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Explanation {
    /// The program in readable form.
    #[serde(serialize_with = "lines")]
    pub listing: Listing,
    /// What its text was held against.
    pub checked: Checked,
    /// What it uses.
    pub uses: Uses,
    /// How often each line counts, if there is data.
    pub profile: Option<Profile>,
    /// What each part contributes, if there is data.
    pub contributions: Contributions,
    /// Which nodes of the trees do anything.
    #[serde(skip)]
    pub live: Live,
    /// Why the program that the text was held against was interpreted and not compiled, if it was.
    #[serde(skip)]
    pub why_interpreted: Option<String>,
    #[serde(skip)]
    program: Program,
}

fn lines<S: Serializer>(listing: &Listing, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_seq(listing.lines().iter().map(|line| &line.text))
}

impl Explanation {
    /// Explains an individual on images of `width` x `height` pixels, and holds the text against the compiled program
    /// on random images.
    ///
    /// # Errors
    /// If there are no programs for images of this size, or this one has no readable form.
    pub fn new(individual: &Individual, width: u32, height: u32) -> Result<Explanation, ExplainError> {
        if !Program::fits(width, height) {
            return Err(ExecError::Side { width, height }.into());
        }
        let mut optimiser = Optimiser::default();
        let lowered = lower(individual, width, height);
        let program = optimiser.optimise(lowered.clone());
        let before = optimiser.live_operations();
        let images = check::random_images(width, height);
        let live = Live::of(individual, &program);
        let letters = letters::Letters::of(individual, &live, &lowered, &program, &images);
        let listing = build::listing(&program, &letters.names)?;
        let check = check::Check::new(&listing.to_string(), &program)?;
        let checked = check.on_images(&images)?;
        let uses = Uses::of(individual, (&program, &listing), before, &live, &letters);
        Ok(Explanation {
            listing,
            checked,
            uses,
            profile: None,
            contributions: Contributions::default(),
            live,
            why_interpreted: check.why_interpreted(),
            program,
        })
    }

    /// Adds what the program does on a data set whose images have the size of the explanation: the text is held
    /// against the compiled program on every case, and run there, whole and without each of its parts. An answer is
    /// correct within `tolerance` rows.
    ///
    /// # Errors
    /// If the images are of another size.
    pub fn add_data(&mut self, set: &Dataset, tolerance: f64) -> Result<(), ExplainError> {
        self.checked = check::Check::new(&self.listing.to_string(), &self.program)?.on_data(set)?;
        self.profile = Some(Profile::of(&self.listing, set, tolerance));
        self.contributions = contributions(&self.listing, set, tolerance);
        Ok(())
    }

    /// The optimised program that the listing is of.
    pub const fn program(&self) -> &Program {
        &self.program
    }
}
