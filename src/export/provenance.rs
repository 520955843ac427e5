//! Where an exported detector comes from.

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
}
