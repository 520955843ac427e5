//! What a sweep is to run, as a file says it: data sets, settings, seeds.

use std::collections::BTreeSet;
use std::ops::Range;
use std::path::{Path, PathBuf};

use serde::Deserialize;
use serde::de::IgnoredAny;
use toml::Spanned;
use toml::de::DeTable;
use vsonar::evolve::Preset;
use vsonar::support::bounded::Bounded;

use super::super::CliError;
use super::super::source::Source;
use super::super::source_folder::Folder;
use super::super::source_made::{Recorded, Synthetic};
use super::seeds;
use super::settings::{self, Setting};
use vsonar::support::printable::ShownPath as _;

/// A sweep.
#[derive(Debug)]
pub(crate) struct Spec {
    pub(crate) path: PathBuf,
    pub(crate) text: String,
    pub(crate) title: Option<String>,
    pub(crate) seeds: Vec<u64>,
    /// Whether the held-out cases may be looked at.
    pub(crate) test: bool,
    pub(crate) data: Vec<DataSet>,
    pub(crate) settings: Vec<Setting>,
    /// The setting that the others are compared with.
    pub(crate) baseline: usize,
}

/// Data under their name.
#[derive(Debug, Clone)]
pub(crate) struct DataSet {
    pub(crate) name: String,
    /// File, line and column of the name.
    pub(crate) place: String,
    pub(crate) source: Source,
}

/// The file, but for what is settings.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Raw {
    title: Option<String>,
    seeds: Option<Spanned<toml::Value>>,
    baseline: Option<Spanned<String>>,
    preset: Option<Preset>,
    #[serde(default)]
    test: bool,
    #[serde(default)]
    data: Vec<Spanned<RawData>>,
    // Read by themselves, where their places in the file are known.
    #[serde(rename = "settings")]
    _settings: Option<IgnoredAny>,
    #[serde(rename = "setting")]
    _setting: Option<IgnoredAny>,
    #[serde(rename = "grid")]
    _grid: Option<IgnoredAny>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawData {
    name: Spanned<String>,
    folder: Option<Folder>,
    synthetic: Option<Synthetic>,
    world: Option<Recorded>,
}

/// Seeds where a file gives none.
const SEEDS: Range<u64> = 1..11;

/// Names reports what is wrong at which line of a file.
pub(crate) struct File<'a> {
    pub(crate) name: String,
    pub(crate) text: &'a str,
}

impl File<'_> {
    pub(crate) fn place(&self, at: usize) -> String {
        let before = self.text.get(..at).unwrap_or(self.text);
        let line = before.matches('\n').count() + 1;
        let column = before.rsplit('\n').next().map_or(0, |tail| tail.chars().count()) + 1;
        format!("{}:{line}:{column}", self.name)
    }

    pub(crate) fn fault(&self, at: usize, text: impl std::fmt::Display) -> CliError {
        CliError::Failed(format!("{}: {text}", self.place(at)))
    }

    pub(crate) fn toml(&self, error: &toml::de::Error) -> CliError {
        let text = error.message().trim_end().replace('\n', " ");
        let at = error.span().map_or(0, |span| span.start);
        self.fault(at, format!("{text}; `vsonar sweep --help` shows what such a file has"))
    }
}

/// Reads a sweep. It may come through a pipe.
const SPEC: Bounded = Bounded::to(16 << 20).or_pipes();

impl Spec {
    /// Reads a file.
    ///
    /// # Errors
    /// With file, line and column of what is wrong.
    pub(crate) fn read(path: &Path) -> Result<Spec, CliError> {
        let text = SPEC.text(path).map_err(|e| CliError::file(path, "read the file", &e))?;
        Spec::parse(path, text)
    }

    fn parse(path: &Path, text: String) -> Result<Spec, CliError> {
        let file = File { name: path.shown(), text: &text };
        let raw: Raw = toml::from_str(&text).map_err(|e| file.toml(&e))?;
        let root = DeTable::parse(&text).map_err(|e| file.toml(&e))?.into_inner();
        let settings = settings::all(&file, &root, raw.preset)?;
        let baseline = match &raw.baseline {
            None => 0,
            Some(name) => {
                baseline(&settings, name.get_ref()).map_err(|e| file.fault(name.span().start, e))?
            }
        };
        let seeds = match &raw.seeds {
            None => SEEDS.collect(),
            Some(value) => seeds::of_value(value.get_ref()).map_err(|e| file.fault(value.span().start, e))?,
        };
        let data = data(&file, path, raw.data)?;
        let (title, test) = (raw.title, raw.test);
        Ok(Spec { path: path.to_path_buf(), title, seeds, test, data, settings, baseline, text })
    }

    /// The name of the file, for the folder of results.
    pub(crate) fn stem(&self) -> String {
        self.path.file_stem().unwrap_or_default().to_string_lossy().into_owned()
    }
}

/// The number of the setting of this name, or of the only one that the grid makes of it.
fn baseline(settings: &[Setting], name: &str) -> Result<usize, String> {
    if let Some(whole) = settings.iter().position(|setting| setting.name == name) {
        return Ok(whole);
    }
    let of_base = |(number, setting): (usize, &Setting)| (setting.base == name).then_some(number);
    match settings.iter().enumerate().filter_map(of_base).collect::<Vec<_>>()[..] {
        [] => Err(format!("there is no setting `{name}`")),
        [one] => Ok(one),
        ref several => {
            let names: Vec<String> = several.iter().map(|&i| format!("`{}`", settings[i].name)).collect();
            Err(format!("the grid makes several settings of `{name}`; name one of {}", names.join("; ")))
        }
    }
}

/// The name as it may stand in a table.
pub(crate) fn checked_name(file: &File<'_>, name: &Spanned<String>) -> Result<String, CliError> {
    let text = name.get_ref();
    if text.trim() != text || text.is_empty() || text.chars().any(char::is_control) {
        return Err(file.fault(name.span().start, "a name has letters, and no space at its ends"));
    }
    Ok(text.clone())
}

fn data(file: &File<'_>, path: &Path, raw: Vec<Spanned<RawData>>) -> Result<Vec<DataSet>, CliError> {
    if raw.is_empty() {
        return Err(file.fault(
            0,
            "there is no data set; add a table [[data]] with a name and [data.folder], [data.synthetic] or [data.world]",
        ));
    }
    let mut names = BTreeSet::new();
    let mut all = Vec::new();
    for one in raw {
        let at = one.span().start;
        let RawData { name: spanned, folder, synthetic, world } = one.into_inner();
        let name = checked_name(file, &spanned)?;
        let source = match (folder, synthetic, world) {
            (Some(folder), None, None) => Source::Folder(folder),
            (None, Some(synthetic), None) => Source::Synthetic(synthetic),
            (None, None, Some(world)) => Source::World(world),
            _ => {
                let text = format!(
                    "the data set `{name}` needs one of the tables [data.folder] (with `train`), [data.synthetic] and [data.world] (with `name`)"
                );
                return Err(file.fault(at, text));
            }
        };
        source.check().map_err(|e| file.fault(at, format!("the data set `{name}`: {e}")))?;
        if !names.insert(name.clone()) {
            return Err(
                file.fault(spanned.span().start, format!("there are two data sets `{name}`; rename one"))
            );
        }
        let place = file.place(spanned.span().start);
        all.push(DataSet { name, place, source: source.named_in(path)? });
    }
    Ok(all)
}
