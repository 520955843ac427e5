//! The columns that are to be marked.

use std::collections::{BTreeMap, BTreeSet};

use super::mark::Marks;
use crate::dataset::spread;

/// Which columns are to be marked in every image.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Columns {
    /// So many, in the middle of equal parts of the image.
    Spread(u32),
    /// These.
    These(Vec<u32>),
    /// Those last asked for in the folder, which are kept there. Where none are kept, as in a data set made elsewhere:
    /// those in which at least half of the images that have labels have one; if there is none, so many spread ones.
    AsBefore(u32),
}

impl Columns {
    /// The columns of images of this width, ascending, none of them twice; `kept` are those last asked for.
    pub(super) fn of(&self, width: u32, kept: Option<Vec<u32>>, marks: &Marks) -> Result<Vec<u32>, String> {
        let mut columns = match self {
            Columns::Spread(n) | Columns::AsBefore(n) if *n > width || *n == 0 => {
                let text = format!("{n} columns: the images have {width}");
                return Err(text);
            }
            Columns::Spread(n) => spread(*n, width),
            Columns::These(columns) => {
                let twice = (1..columns.len()).find(|&i| columns[..i].contains(&columns[i]));
                if let Some(i) = twice {
                    return Err(format!("{} is there twice", columns[i]));
                }
                columns.clone()
            }
            Columns::AsBefore(n) => {
                // A few marks do not tell which columns were asked for: the rest of them may be still to come.
                let kept = kept.filter(|kept| !kept.is_empty() && kept.iter().all(|x| *x < width));
                let before = kept.unwrap_or_else(|| used(marks));
                if before.is_empty() { spread(*n, width) } else { before }
            }
        };
        columns.sort_unstable();
        columns.dedup();
        match columns.iter().find(|&&column| column >= width) {
            Some(column) => {
                let text =
                    format!("column {column} is outside the images, whose columns are 0 to {}", width - 1);
                Err(text)
            }
            None => Ok(columns),
        }
    }
}

/// Columns in which at least half of the images with a mark have one.
fn used(marks: &Marks) -> Vec<u32> {
    let images: BTreeSet<&str> = marks.keys().map(|(image, _)| image.as_str()).collect();
    let mut counts: BTreeMap<u32, usize> = BTreeMap::new();
    for (_, x) in marks.keys() {
        *counts.entry(*x).or_default() += 1;
    }
    counts.into_iter().filter(|(_, count)| 2 * count >= images.len()).map(|(x, _)| x).collect()
}
