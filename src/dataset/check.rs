//! The report on a folder: what is in it, how its labels are distributed, what a constant answer would reach,
//! and everything that is wrong.
//!
//! ```
//! let report = vsonar::dataset::check("no/such/folder");
//! assert!(!report.is_sound());
//! assert!(report.to_string().contains("there is no folder no/such/folder"));
//! assert!(serde_json::to_value(&report)?["faults"].is_array());
//! # Ok::<(), serde_json::Error>(())
//! ```

use std::fmt;
use std::path::{Path, PathBuf};

use serde::Serialize;

use super::constants::{BestConstant, Constants, Score, TOLERANCE};
use super::copies::Copies;
use super::deeper::Deeper;
use super::fault::Fault;
use super::scale::{in_proportion, useful_size};
use super::{Dataset, reading, scan};
use crate::memory;
use crate::support::printable::{ShownPath as _, line};

/// Rows of image a bin of the histogram covers, or a multiple of it where that gives too many.
const BIN: u32 = 20;
/// Most bins of a histogram, for it is to be seen at a glance.
const BINS: u32 = 24;
/// How many unlabelled images the text names before it only counts.
const NAMED: usize = 5;

/// How the labels of some cases are distributed. Rows count from the top.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Distribution {
    /// Number of labels.
    pub cases: usize,
    /// The smallest label.
    pub min: u32,
    /// The label a quarter of the way through the sorted list (nearest rank).
    pub quarter: u32,
    /// The label half way (nearest rank).
    pub median: u32,
    /// The label three quarters of the way (nearest rank).
    pub three_quarters: u32,
    /// The largest label.
    pub max: u32,
    /// The mean.
    pub mean: f64,
    /// Labels 0: ground up to the top of the image.
    pub open: usize,
    /// Labels height - 1: the obstacle fills the column's bottom pixel.
    pub blocked: usize,
    /// Rows of the image that a bin of the histogram covers: 20, or a multiple of it in images of more than 480 rows.
    pub bin: u32,
    /// Labels in the first `bin` rows, in the next ones and so on, to the bottom of the image.
    pub histogram: Vec<usize>,
}

impl Distribution {
    /// The distribution of these labels in images `height` pixels high; nothing without labels.
    pub fn of(labels: &[u32], height: u32) -> Option<Distribution> {
        let mut sorted = labels.to_vec();
        sorted.sort_unstable();
        let (&min, &max) = (sorted.first()?, sorted.last()?);
        let rank = |quarters: usize| sorted[(sorted.len() * quarters).div_ceil(4) - 1];
        let rows = height.max(max + 1);
        let bin = BIN * rows.div_ceil(BIN * BINS);
        let mut histogram = vec![0; rows.div_ceil(bin) as usize];
        for &label in labels {
            histogram[(label / bin) as usize] += 1;
        }
        let sum: u64 = labels.iter().map(|&l| u64::from(l)).sum();
        Some(Distribution {
            cases: labels.len(),
            min,
            quarter: rank(1),
            median: rank(2),
            three_quarters: rank(3),
            max,
            mean: sum as f64 / labels.len() as f64,
            open: labels.iter().filter(|&&l| l == 0).count(),
            blocked: labels.iter().filter(|&&l| l + 1 == height).count(),
            bin,
            histogram,
        })
    }
}

/// One column of the report: the cases that ask for this x.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ColumnReport {
    /// The column.
    pub x: u32,
    /// Its labels.
    pub labels: Distribution,
    /// The constant that does best in it.
    pub constant: BestConstant,
}

/// What [`check`] found. Distributions and constants are those of the sound cases.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CheckReport {
    folder: PathBuf,
    name: String,
    size: Option<(u32, u32)>,
    /// The size that the images should be scaled to, if they are larger than is useful.
    useful_size: Option<(u32, u32)>,
    images: usize,
    rows: usize,
    sound_images: usize,
    sound_cases: usize,
    labels: Option<Distribution>,
    columns: Vec<ColumnReport>,
    tolerance: f64,
    constant: Option<BestConstant>,
    constant_per_column: Option<Score>,
    unlabelled: Vec<String>,
    in_subfolders: Option<Deeper>,
    /// Images with a tag that asks viewers to turn them, which detectors do not heed.
    turned: Vec<String>,
    copies: Vec<Copies>,
    faults: Vec<Fault>,
}

/// Examines a folder as [`Dataset::load`] would and reports on all of it, with the default tolerance.
///
/// Nothing is an error here: a folder that does not exist gives a report with that fault.
pub fn check(dir: impl AsRef<Path>) -> CheckReport {
    check_within(dir, memory::default_limit())
}

/// The same, with the images and their decoding below so many bytes of memory; that they would take more is a fault.
pub fn check_within(dir: impl AsRef<Path>, limit: u64) -> CheckReport {
    let scan = scan::scan(dir.as_ref(), limit);
    let set = scan.sound.as_ref();
    let constants = set.map(|s| Constants::learn(s, TOLERANCE));
    // Before there are labels, what is to be labelled counts.
    let names = set.map_or_else(
        || scan.unlabelled.clone(),
        |set| set.images().iter().map(|image| image.name.clone()).collect(),
    );
    let size = match set {
        Some(set) => Some((set.width(), set.height())),
        None => reading::size_of(dir.as_ref(), &names),
    };
    CheckReport {
        folder: scan.dir,
        name: scan.name,
        size,
        useful_size: size.and_then(useful_size),
        images: scan.images_named,
        rows: scan.rows,
        sound_images: set.map_or(0, |s| s.images().len()),
        sound_cases: set.map_or(0, |s| s.cases().len()),
        labels: set.and_then(|s| Distribution::of(&s.labels(), s.height())),
        columns: set.zip(constants.as_ref()).map(|(s, c)| columns(s, c)).unwrap_or_default(),
        tolerance: TOLERANCE,
        constant: constants.as_ref().map(Constants::overall),
        constant_per_column: set.zip(constants.as_ref()).map(|(s, c)| c.score(s)),
        unlabelled: scan.unlabelled,
        in_subfolders: scan.in_subfolders,
        turned: reading::turned(dir.as_ref(), &names),
        copies: set.map_or_else(Vec::new, Copies::find),
        faults: scan.faults,
    }
}

fn columns(set: &Dataset, constants: &Constants) -> Vec<ColumnReport> {
    let report = |&(x, constant): &(u32, BestConstant)| {
        let labels: Vec<u32> = set.cases().iter().filter(|c| c.x == x).map(|c| c.y).collect();
        Some(ColumnReport { x, labels: Distribution::of(&labels, set.height())?, constant })
    };
    constants.columns().iter().filter_map(report).collect()
}

impl CheckReport {
    /// The same report, of a folder that has been renamed since.
    pub fn moved_to(self, dir: impl AsRef<Path>) -> CheckReport {
        let dir = dir.as_ref();
        CheckReport { folder: dir.into(), name: scan::folder_name(dir), ..self }
    }

    /// Whether [`Dataset::load`] accepts the folder.
    pub fn is_sound(&self) -> bool {
        self.faults.is_empty()
    }

    /// Everything wrong, in the order of the table.
    pub fn faults(&self) -> &[Fault] {
        &self.faults
    }

    /// The folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Width and height of the images, if any could be read; before there are labels, those of one that is to be labelled.
    pub fn size(&self) -> Option<(u32, u32)> {
        self.size
    }

    /// Distinct images the table names.
    pub fn images(&self) -> usize {
        self.images
    }

    /// Rows of the table below the header.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Cases without a fault.
    pub fn sound_cases(&self) -> usize {
        self.sound_cases
    }

    /// The labels of all sound cases.
    pub fn labels(&self) -> Option<&Distribution> {
        self.labels.as_ref()
    }

    /// The sound cases by column, ascending.
    pub fn columns(&self) -> &[ColumnReport] {
        &self.columns
    }

    /// The constant answer that does best on all cases.
    pub fn constant(&self) -> Option<BestConstant> {
        self.constant
    }

    /// What the best constants reach.
    pub fn constants_score(&self) -> Option<Score> {
        self.constant_per_column
    }

    /// Image files in the folder that no row names: a note, not a fault.
    pub fn unlabelled(&self) -> &[String] {
        &self.unlabelled
    }

    /// Images with a tag that asks viewers to turn them: a note, not a fault.
    pub fn turned(&self) -> &[String] {
        &self.turned
    }

    /// Images that are the same picture under several names: a note, not a fault.
    pub fn copies(&self) -> &[Copies] {
        &self.copies
    }

    /// Image files in subfolders that no row names: a note, not a fault.
    pub fn in_subfolders(&self) -> Option<&Deeper> {
        self.in_subfolders.as_ref()
    }
}

impl fmt::Display for CheckReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "data set  {} ({})", line(&self.name), self.folder.shown())?;
        if let Some((width, height)) = self.size {
            writeln!(f, "size      {width} x {height} pixels")?;
        }
        write!(f, "content   {} images, {} cases", self.images, self.rows)?;
        if !self.faults.is_empty() {
            write!(f, "; of these sound: {} images, {} cases", self.sound_images, self.sound_cases)?;
        }
        writeln!(f)?;
        self.write_labels(f)?;
        self.write_constants(f)?;
        if !self.unlabelled.is_empty() {
            let shown: Vec<_> = self.unlabelled.iter().take(NAMED).map(|name| line(name)).collect();
            let shown = shown.join(", ");
            let more = if self.unlabelled.len() > NAMED { ", ..." } else { "" };
            writeln!(f, "\nnote: {} image(s) without labels: {shown}{more}", self.unlabelled.len())?;
        }
        if let Some(deeper) = &self.in_subfolders {
            writeln!(f, "\nnote: {deeper}, for no row names them")?;
        }
        if let Some(first) = self.turned.first() {
            writeln!(
                f,
                "\nnote: {} image(s) with an orientation tag, {} the first: they count as they are stored, not as viewers \
                 turn them (`vsonar data resize` does)",
                self.turned.len(),
                line(first)
            )?;
        }
        if !self.copies.is_empty() {
            writeln!(f)?;
            self.copies.iter().take(NAMED).try_for_each(|copies| writeln!(f, "note: {copies}"))?;
            if self.copies.len() > NAMED {
                writeln!(f, "note: and {} more pictures have several names", self.copies.len() - NAMED)?;
            }
        }
        match self.faults.len() {
            0 => writeln!(f, "\nno faults"),
            count => {
                writeln!(f, "\n{count} fault{}:", if count == 1 { "" } else { "s" })?;
                self.faults.iter().try_for_each(|fault| writeln!(f, "  {fault}"))
            }
        }
    }
}

impl CheckReport {
    fn write_labels(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Some(labels) = &self.labels else { return Ok(()) };
        writeln!(
            f,
            "\n{:>6} {:>6} | {:>4} {:>4} {:>6} {:>4} {:>4} {:>6} {:>5} {:>7} | best constant",
            "column", "cases", "min", "25%", "median", "75%", "max", "mean", "open", "blocked"
        )?;
        let row = |f: &mut fmt::Formatter<'_>, name: &str, l: &Distribution, c: &BestConstant| {
            writeln!(
                f,
                "{name:>6} {:>6} | {:>4} {:>4} {:>6} {:>4} {:>4} {:>6.1} {:>5} {:>7} | {:>5} {:>6}",
                l.cases,
                l.min,
                l.quarter,
                l.median,
                l.three_quarters,
                l.max,
                l.mean,
                l.open,
                l.blocked,
                c.answer,
                percent(c.share())
            )
        };
        for column in &self.columns {
            row(f, &column.x.to_string(), &column.labels, &column.constant)?;
        }
        if let Some(constant) = &self.constant {
            row(f, "all", labels, constant)?;
        }
        writeln!(f, "\nlabels by row (from the top)")?;
        let most = labels.histogram.iter().copied().max().unwrap_or(0).max(1);
        for (bin, &count) in labels.histogram.iter().enumerate() {
            let from = bin as u32 * labels.bin;
            let bar = "#".repeat((count * 40).div_ceil(most));
            writeln!(f, "{:>9} {count:>6} {bar}", format!("{from}-{}", from + labels.bin - 1))?;
        }
        Ok(())
    }

    fn write_constants(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (Some(constant), Some(score), Some((_, height))) =
            (&self.constant, &self.constant_per_column, self.size)
        else {
            return Ok(());
        };
        writeln!(
            f,
            "\nthe floor to beat, within {}: {} with the answer {} everywhere, {} with the best answer of each column",
            in_proportion(self.tolerance, height),
            percent(score.overall_share()),
            constant.answer,
            percent(score.per_column_share()),
        )
    }
}

fn percent(share: f64) -> String {
    format!("{:.1} %", share * 100.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_by_nearest_rank() {
        let d = Distribution::of(&[239, 0, 10, 20, 30], 240).unwrap();
        assert_eq!((d.min, d.quarter, d.median, d.three_quarters, d.max), (0, 10, 20, 30, 239));
        assert_eq!((d.open, d.blocked, d.cases), (1, 1, 5));
        assert_eq!(d.histogram, [2, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1]);
        assert!((d.mean - 59.8).abs() < 1e-12);
        let large = Distribution::of(&[0, 139, 140, 3023], 3024).unwrap();
        assert_eq!(
            (large.bin, large.histogram.len(), large.histogram[0], large.histogram[21]),
            (140, 22, 2, 1)
        );
        let bins = |height| Distribution::of(&[height - 1], height).map(|d| (d.bin, d.histogram.len()));
        assert_eq!(
            [480, 481, u32::MAX / 2].map(bins).map(|b| b.map(|(_, bins)| bins)),
            [Some(24), Some(13), Some(24)]
        );
        assert_eq!(Distribution::of(&[], 240), None);
        let one = Distribution::of(&[7], 16).unwrap();
        assert_eq!((one.min, one.quarter, one.three_quarters, one.histogram.len()), (7, 7, 7, 1));
    }
}
