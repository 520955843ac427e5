//! The settings of a run from preset, file and flags, each over the one before.

use std::path::{Path, PathBuf};

use clap::ValueEnum;
use vsonar::evolve::{Draft, Preset, RunFolder, Settings, SettingsError};
use vsonar::support::bounded::Bounded;

use super::CliError;
use super::output::grouped;
use vsonar::support::printable::ShownPath as _;

/// Individuals in a generation of a run on the built-in office, unless something else is asked for.
pub(crate) const SMALL_POPULATION: u32 = 3000;
/// Generations of such a run.
pub(crate) const SMALL_GENERATIONS: u32 = 31;

/// The presets by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum PresetName {
    /// Selection that keeps different behaviours alive, and an initial generation that answers at all
    Default,
    /// The published method as it stands; it converges too early on most seeds
    Paper,
}

impl From<PresetName> for Preset {
    fn from(name: PresetName) -> Preset {
        match name {
            PresetName::Default => Preset::Default,
            PresetName::Paper => Preset::Paper,
        }
    }
}

/// A default as the help states it.
fn default_of(field: impl Fn(&Settings) -> u32, small: Option<u32>) -> String {
    let (a, b) = (field(&Settings::default_preset()), field(&Settings::paper()));
    let mut text = if a == b { grouped(a.into()) } else { format!("{a}; with --preset paper {b}") };
    if let Some(small) = small {
        text += &format!("; without --data {}", grouped(small.into()));
    }
    format!("[default: {text}]")
}

fn seed_help() -> String {
    format!(
        "Seed of every random choice; the same seed gives the same run [default: {}]",
        Settings::default_preset().seed
    )
}

fn population_help() -> String {
    format!("Individuals in a generation {}", default_of(|s| s.population, Some(SMALL_POPULATION)))
}

fn trees_help() -> String {
    let default = default_of(|s| s.trees, None);
    format!("Trees of a program: 2, or 1 to do without the first pass over the column {default}")
}

fn tolerance_help() -> String {
    format!(
        "An answer is correct within this many rows of the label [default: {}]",
        Settings::default_preset().tolerance
    )
}

fn generations_help() -> String {
    let default = default_of(|s| s.generations, Some(SMALL_GENERATIONS));
    format!("Generations, the initial one included; with --resume the new total {default}")
}

/// The flags that are settings.
#[derive(clap::Args, Clone)]
#[command(next_help_heading = "Settings")]
pub(crate) struct SettingsArgs {
    /// Where the settings start from [default: default]
    #[arg(long, value_name = "NAME")]
    preset: Option<PresetName>,
    /// Settings from a TOML file, or those of another run (its settings.toml) with its data; flags go before it
    ///
    /// The data are those of the file's table [data], unless `--data` names others.
    #[arg(long, value_name = "FILE")]
    settings: Option<PathBuf>,
    #[arg(long, value_name = "N", help = seed_help())]
    seed: Option<u64>,
    #[arg(long, value_name = "N", help = population_help())]
    population: Option<u32>,
    #[arg(long, value_name = "N", help = generations_help())]
    pub(crate) generations: Option<u32>,
    #[arg(long, value_name = "N", help = trees_help())]
    trees: Option<u32>,
    #[arg(long, value_name = "ROWS", help = tolerance_help())]
    tolerance: Option<f64>,
    /// Leave node types out (-raw), put them back (+raw) or give them a weight (if-le=2); repeatable
    ///
    /// Several edits may stand between commas, and a star at the end stands for all names that begin so:
    /// --nodes '-raw*,-tan'
    #[arg(long, value_name = "EDITS", allow_hyphen_values = true)]
    nodes: Vec<String>,
    /// Any setting by its name in settings.toml, e.g. selection.tournament=3; repeatable
    ///
    /// Every run folder has a settings.toml in which each setting stands under its meaning. How parents are selected is
    /// selection.kind: tournament, sharing or lexicase (down-sampled with selection.case_share=0.1); what is done against
    /// bloat is selection.parsimony: none, lexicographic or double; selection.elitism=N copies the N best. Islands are
    /// islands.count, islands.interval and islands.migrants. Mutations are probabilities beside
    /// breeding.crossover_probability: breeding.subtree_mutation_probability, and so on for point, constant and hoist.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
}

impl SettingsArgs {
    /// The settings: those of the preset, over them the file's, `--set` in order, and the flags. A run on the
    /// built-in office (`small`) starts from a smaller population and fewer generations.
    /// What they come to is checked at the end, so that the order of changes that go together does not matter.
    pub(crate) fn settings(&self, file: Option<&SettingsFile>, small: bool) -> Result<Settings, CliError> {
        let mut settings = Settings::preset(self.preset.unwrap_or(PresetName::Default).into());
        if small {
            (settings.population, settings.generations) = (SMALL_POPULATION, SMALL_GENERATIONS);
        }
        let mut draft = Draft::new(settings);
        if let Some(file) = file {
            if self.preset.is_some() && file.names_preset() {
                let text = format!(
                    "{}: the file names a preset itself; leave out `--preset`, or take the line out of the file",
                    file.name()
                );
                return Err(CliError::Usage(text));
            }
            draft.lay_over(&file.text, &file.name())?;
        }
        for assignment in &self.set {
            set(&mut draft, assignment)?;
        }
        for change in &self.nodes {
            let edited = draft.change("nodes", |settings| settings.nodes.edit(change));
            edited.map_err(|e| CliError::Usage(format!("--nodes: {e}")))?;
        }
        replace(&mut draft, "seed", self.seed, |s| &mut s.seed);
        replace(&mut draft, "population", self.population, |s| &mut s.population);
        replace(&mut draft, "generations", self.generations, |s| &mut s.generations);
        replace(&mut draft, "trees", self.trees, |s| &mut s.trees);
        replace(&mut draft, "tolerance", self.tolerance, |s| &mut s.tolerance);
        draft.finish().map_err(|error| match error {
            SettingsError::ValueAt { file: giver, fault, .. }
                if Some(&giver) != file.map(|f| f.name()).as_ref() =>
            {
                CliError::Usage(format!("{giver}: {fault}"))
            }
            at @ SettingsError::ValueAt { .. } => at.into(),
            other => CliError::Usage(other.to_string()),
        })
    }

    /// The settings file, if one is named.
    pub(crate) fn file(&self) -> Result<Option<SettingsFile>, CliError> {
        self.settings.as_deref().map(SettingsFile::given).transpose()
    }
}

/// A settings file as it is read, before it is looked at as settings.
pub(crate) struct SettingsFile {
    path: PathBuf,
    text: String,
    /// Its content; empty if it is no TOML, which is reported by whoever reads it as settings.
    table: toml::Table,
}

impl SettingsFile {
    /// Reads that of a run folder.
    pub(crate) fn read(path: &Path) -> Result<SettingsFile, CliError> {
        SettingsFile::read_by(RunFolder::SETTINGS, path)
    }

    /// Reads one that was typed, which may come through a pipe.
    fn given(path: &Path) -> Result<SettingsFile, CliError> {
        SettingsFile::read_by(RunFolder::SETTINGS.or_pipes(), path)
    }

    fn read_by(reader: Bounded, path: &Path) -> Result<SettingsFile, CliError> {
        let text = reader.text(path).map_err(|e| CliError::file(path, "read the file", &e))?;
        let table = toml::from_str(&text).unwrap_or_default();
        Ok(SettingsFile { path: path.to_path_buf(), text, table })
    }

    /// Where it is.
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// Its table `[data]`, if it has one.
    pub(crate) fn data(&self) -> Option<&toml::Table> {
        self.table.get("data")?.as_table()
    }

    /// The settings, if it is that of a run folder.
    pub(crate) fn recorded(&self) -> Result<Settings, CliError> {
        Ok(Settings::from_record(&self.text, &self.name())?)
    }

    fn name(&self) -> String {
        self.path.shown()
    }

    fn names_preset(&self) -> bool {
        self.table.contains_key("preset")
    }
}

/// Sets a field to what its flag says, if it is there.
fn replace<T>(draft: &mut Draft, name: &str, flag: Option<T>, field: impl FnOnce(&mut Settings) -> &mut T) {
    if let Some(value) = flag {
        draft.change(name, |settings| *field(settings) = value);
    }
}

/// Sets a field by its dotted name.
fn set(draft: &mut Draft, assignment: &str) -> Result<(), CliError> {
    let flag = format!("--set {assignment}");
    let usage = |text: String| CliError::Usage(format!("{flag}: {text}"));
    let Some((key, value)) = assignment.split_once('=') else {
        return Err(usage("write it as KEY=VALUE, e.g. `--set selection.tournament=3`".to_string()));
    };
    let (key, value) = (key.trim(), value.trim());
    if matches!(key.split('.').next(), Some("preset" | "data")) {
        return Err(usage("this is no setting; there are the flags `--preset` and `--data`".to_string()));
    }
    let table = nested(key, value_of(value));
    draft.lay_over(&table.to_string(), &flag).map_err(|error| match error {
        SettingsError::Syntax { message, .. } => usage(format!(
            "{message}; every setting with its meaning stands in the settings.toml of a run folder"
        )),
        SettingsError::ValueAt { fault, .. } | SettingsError::Value(fault) => usage(fault.to_string()),
        other => usage(other.to_string()),
    })
}

/// The table in which a field of this dotted name has this value.
pub(crate) fn nested(key: &str, value: toml::Value) -> toml::Table {
    // A name of a node type may hold anything but a dot.
    let mut parts = key.rsplit('.').map(str::to_string);
    let last = parts.next().unwrap_or_default();
    let mut table: toml::Table = std::iter::once((last, value)).collect();
    for part in parts {
        table = std::iter::once((part, toml::Value::Table(table))).collect();
    }
    table
}

/// A value as TOML has it; what is none is a name.
fn value_of(text: &str) -> toml::Value {
    let table = toml::from_str::<toml::Table>(&format!("value = {text}"));
    let alone = table.ok().filter(|t| t.len() == 1).and_then(|mut t| t.remove("value"));
    alone.unwrap_or_else(|| toml::Value::String(text.to_string()))
}

#[cfg(test)]
mod tests {
    use vsonar::evolve::{Parsimony, SelectionKind};
    use vsonar::tree::NodeType;

    use super::*;

    fn settings(args: SettingsArgs) -> Result<Settings, String> {
        let settings = args.file().and_then(|file| args.settings(file.as_ref(), false));
        settings.map_err(|error| match error {
            CliError::Usage(text) | CliError::Failed(text) => text,
            other => format!("{other:?}"),
        })
    }

    fn none() -> SettingsArgs {
        SettingsArgs {
            preset: None,
            settings: None,
            seed: None,
            population: None,
            generations: None,
            trees: None,
            tolerance: None,
            nodes: Vec::new(),
            set: Vec::new(),
        }
    }

    fn with_set(assignments: &[&str]) -> Result<Settings, String> {
        settings(SettingsArgs { set: assignments.iter().map(|a| a.to_string()).collect(), ..none() })
    }

    /// The dotted name and the value of every field that a run folder records.
    fn fields(settings: &Settings) -> Vec<(String, toml::Value)> {
        let table: toml::Table = toml::from_str(&settings.to_toml()).expect("TOML");
        let mut fields = Vec::new();
        for (key, value) in table {
            match value {
                toml::Value::Table(inner) => {
                    fields.extend(inner.into_iter().map(|(k, v)| (format!("{key}.{k}"), v)))
                }
                value => fields.push((key, value)),
            }
        }
        fields
    }

    #[test]
    fn every_setting_can_be_set_by_its_name() {
        let (target, start) = (fields(&Settings::paper()), fields(&Settings::default_preset()));
        assert!(start.len() > 80, "{}", start.len());
        let assignments: Vec<String> = target.iter().map(|(key, value)| format!("{key}={value}")).collect();
        let assignments: Vec<&str> = assignments.iter().map(String::as_str).collect();
        assert_eq!(with_set(&assignments), Ok(Settings::paper()));
    }

    /// The weight of a node type.
    fn weight(settings: &Settings, name: &str) -> u32 {
        settings.nodes.weight(NodeType::from_name(name).expect("a node type"))
    }

    #[test]
    fn names_need_no_quotes() {
        let changed =
            with_set(&["selection.kind=tournament", "nodes.+=0", " seed = 9 "]).expect("all are settings");
        assert_eq!(changed.selection.kind, Settings::paper().selection.kind);
        assert_eq!((weight(&changed, "+"), changed.seed), (0, 9));
    }

    #[test]
    fn selection_and_variation_are_settings() {
        let assignments = [
            "selection.kind=\"lexicase\"",
            "selection.case_share=0.1",
            "selection.elitism=5",
            "selection.parsimony=double",
            "islands.count=4",
            "breeding.crossover_probability=0.6",
            "breeding.hoist_mutation_probability=0.1",
        ];
        let changed = with_set(&assignments).expect("all are settings");
        let selection = &changed.selection;
        assert_eq!((selection.kind, selection.parsimony), (SelectionKind::Lexicase, Parsimony::Double));
        assert_eq!((selection.case_share, selection.elitism, changed.islands.count), (0.1, 5, 4));
        assert_eq!(changed.breeding.hoist_mutation_probability, 0.1);
    }

    /// The help names every choice there is.
    #[test]
    fn the_help_lists_the_choices() {
        let mut command = <SettingsArgs as clap::Args>::augment_args(clap::Command::new("evolve"));
        let help = command.render_long_help().to_string();
        let kinds = [SelectionKind::Tournament, SelectionKind::Sharing, SelectionKind::Lexicase];
        let parsimony = [Parsimony::None, Parsimony::Lexicographic, Parsimony::Double];
        let names = kinds.iter().map(|k| format!("{k:?}")).chain(parsimony.iter().map(|p| format!("{p:?}")));
        for name in names.map(|name| name.to_lowercase()) {
            assert!(help.contains(&name), "{name}: {help}");
        }
        for (field, _) in fields(&Settings::paper()) {
            let told = ["selection.kind", "selection.case_share", "selection.parsimony", "selection.elitism"];
            assert!(
                !(told.contains(&field.as_str()) || field.starts_with("islands.")) || help.contains(&field),
                "{field}"
            );
        }
    }

    #[test]
    fn wrong_assignments_are_named() {
        for (assignment, said) in [
            ("seed", "KEY=VALUE"),
            ("sed=1", "unknown field"),
            ("selection.size=1", "unknown field"),
            ("selection.kind=best", "best"),
            ("selection.parsimony=much", "lexicographic"),
            ("selection.case_share=0", "selection.case_share"),
            ("islands.count=0", "islands.count"),
            ("islands.size=9", "unknown field"),
            ("selection.elitism=4000", "selection.elitism"),
            ("breeding.subtree_mutation_probability=0.65", "breeding.crossover_probability"),
            ("seed=1\npopulation=5", "--set"),
            ("population=1", "2 to"),
            ("preset=paper", "--preset"),
            ("data.folder=x", "--data"),
            ("=1", "--set"),
        ] {
            let error = with_set(&[assignment]).expect_err(assignment);
            assert!(error.contains("--set") && error.contains(said), "{assignment}: {error}");
        }
    }

    #[test]
    fn only_what_changes_come_to_is_checked() {
        let deep = ["creation.min_depth=10", "creation.max_depth=10"];
        for order in [[deep[0], deep[1]], [deep[1], deep[0]]] {
            let creation = with_set(&order).expect("sound together").creation;
            assert_eq!((creation.min_depth, creation.max_depth), (10, 10));
        }
        let dir = tempfile::tempdir().expect("a temporary folder");
        let path = dir.path().join("my.toml");
        std::fs::write(&path, "seed = 2\n[creation]\nmin_depth = 10\n").expect("writable");
        let file = |set: &[&str]| {
            let set = set.iter().map(|a| a.to_string()).collect();
            settings(SettingsArgs { settings: Some(path.clone()), set, ..none() })
        };
        assert_eq!(file(&["creation.max_depth=10"]).map(|s| s.creation.min_depth), Ok(10));
        // Whoever spoke last is to blame.
        let error = file(&[]).expect_err("too deep");
        assert!(error.contains("my.toml:3:13: ") && error.contains("creation.max_depth"), "{error}");
        let error = file(&["creation.max_depth=8"]).expect_err("too deep");
        assert!(error.starts_with("--set creation.max_depth=8: ") && error.contains("min_depth"), "{error}");
        // Names and types are looked at at once.
        let error = file(&["creation.max_depth=deep", "creation.min_depth=2"]).expect_err("no number");
        assert!(error.starts_with("--set creation.max_depth=deep: "), "{error}");
    }

    #[test]
    fn plain_columns_need_their_node() {
        let nodes = vec!["-constant,-x-obstacle".to_string()];
        let error = settings(SettingsArgs { nodes: nodes.clone(), ..none() }).expect_err("left out");
        for part in ["`x-obstacle`", "`--set creation.plain_column_probability=0`"] {
            assert!(error.contains(part), "{error}");
        }
        let set = vec!["creation.plain_column_probability=0".to_string()];
        let left = settings(SettingsArgs { nodes: nodes.clone(), set, ..none() }).expect("as told");
        assert_eq!((weight(&left, "x-obstacle"), left.creation.plain_column_probability), (0, 0.0));
        let paper = Some(PresetName::Paper);
        settings(SettingsArgs { nodes, preset: paper, ..none() }).expect("no plain columns there");
    }

    #[test]
    fn flags_go_before_set() {
        let args = SettingsArgs { seed: Some(5), set: vec!["seed=4".to_string()], ..none() };
        assert_eq!(settings(args).map(|s| s.seed), Ok(5));
        let args = SettingsArgs { population: Some(1), ..none() };
        assert!(settings(args).expect_err("too few").contains("population"));
    }

    #[test]
    fn node_types_are_left_out_and_brought_back() {
        let nodes = |changes: &[&str]| {
            settings(SettingsArgs { nodes: changes.iter().map(|c| c.to_string()).collect(), ..none() })
        };
        let left = nodes(&["-raw,if-le=3", "--", "-tan", "+tan"]).expect("all there are");
        assert_eq!(["raw", "median", "-", "tan", "if-le"].map(|n| weight(&left, n)), [0, 1, 0, 1, 3]);
        assert!(nodes(&["-rawr"]).expect_err("none").contains("`raw`"));
        assert!(nodes(&["raw"]).expect_err("no sign").contains("`-name`"));
    }
}
