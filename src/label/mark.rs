//! What is said of a column of an image.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

/// A mark: a label, or that there is to be none.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(from = "Written", into = "Written")]
pub enum Mark {
    /// The label: row of the lowest pixel that is not ground, from the top; 0 for ground all the way up.
    Row(u32),
    /// Not to be labelled.
    Skip,
}

/// A mark as JSON: a number, or `"skip"`.
#[derive(Serialize, Deserialize)]
#[serde(untagged)]
enum Written {
    Row(u32),
    Word(Word),
}

#[derive(Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Word {
    Skip,
}

impl From<Written> for Mark {
    fn from(written: Written) -> Mark {
        match written {
            Written::Row(row) => Mark::Row(row),
            Written::Word(Word::Skip) => Mark::Skip,
        }
    }
}

impl From<Mark> for Written {
    fn from(mark: Mark) -> Written {
        match mark {
            Mark::Row(row) => Written::Row(row),
            Mark::Skip => Written::Word(Word::Skip),
        }
    }
}

/// One mark made, moved or taken away.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Change {
    /// Name of the image.
    pub image: String,
    /// The column, in pixels from the left.
    pub x: u32,
    /// The mark that whoever asks for the change has seen; if there is another one now, the change is refused.
    pub from: Option<Mark>,
    /// Marks that are as good as that one: those that whoever asks has made by requests to which no answer came, so that
    /// they may be there or not.
    #[serde(default)]
    pub also: Vec<Option<Mark>>,
    /// The mark that there is to be.
    pub to: Option<Mark>,
}

/// The marks of a folder, by image and column.
pub(super) type Marks = BTreeMap<(String, u32), Mark>;
