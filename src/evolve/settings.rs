//! Every number of the evolutionary run: its two presets, its TOML form and its checks.
//!
//! A settings file may give any part of the fields; the rest come from the preset it names (`preset = "paper"`,
//! else the default). What a run folder records is the full list, so that a recorded run never depends on what
//! a preset's name means later.
//!
//! ```
//! use vsonar::evolve::Settings;
//!
//! let settings = Settings::from_toml("seed = 7\n[selection]\ntournament = 3\n", "my.toml")?;
//! assert_eq!((settings.seed, settings.selection.tournament, settings.population), (7, 3, 4000));
//! assert_eq!(Settings::from_toml(&settings.to_toml(), "settings.toml")?, settings);
//! # Ok::<(), vsonar::evolve::SettingsError>(())
//! ```

use std::collections::BTreeMap;
use std::fmt::Write as _;

use serde::{Deserialize, Serialize};
use toml::Spanned;
use toml::de::DeTable;

use super::selection::{Parsimony, SelectionKind};
use super::settings_check::set_weight;
use super::settings_draft::Draft;
pub use super::settings_table::{Augmentation, Breeding, Creation, Filter, Islands, Selection, Settings};
use super::settings_table::{Partial, Places};
use crate::dataset::Variation;
use crate::tree::{CreateSettings, CrossoverSettings, MutationSettings, NodeSet, NodeType};

/// Where in the file each field was given, by dotted name, as line and column.
pub(super) type Given = BTreeMap<String, (usize, usize)>;

impl Augmentation {
    /// No alteration: the training images as they are.
    pub const OFF: Augmentation = Augmentation {
        variants: 1,
        mirror: 0.0,
        gain: 0.0,
        brightness: 0.0,
        contrast: 0.0,
        gamma: 0.0,
        noise: 0.0,
        blur: 0.0,
        shift_x: 0,
        shift_y: 0,
    };

    fn variation(&self) -> Variation {
        let Augmentation {
            variants,
            mirror,
            gain,
            brightness,
            contrast,
            gamma,
            noise,
            blur,
            shift_x,
            shift_y,
        } = *self;
        let copies = variants;
        Variation { copies, mirror, gain, brightness, contrast, gamma, noise, blur, shift_x, shift_y }
    }
}

/// A named starting point of the settings.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Preset {
    /// The published method as it stands.
    Paper,
    /// With plain columns at the start, the initial filter, and selection on case-wise shared fitness: the
    /// published set-up converges too early on most seeds.
    Default,
}

/// What is wrong with settings.
#[derive(Debug, thiserror::Error)]
pub enum SettingsError {
    /// The text is not TOML, or a field is unknown or of the wrong type.
    #[error(
        "{file}:{line}:{column}: {message}; every field with its meaning stands in the settings.toml of a run folder"
    )]
    Syntax {
        /// Where the text comes from.
        file: String,
        /// Line, from 1.
        line: usize,
        /// Column in characters, from 1.
        column: usize,
        /// What the parser found.
        message: String,
    },
    /// A field has a value it cannot have, in a file.
    #[error("{file}:{line}:{column}: {fault}")]
    ValueAt {
        /// Where the text comes from.
        file: String,
        /// Line, from 1.
        line: usize,
        /// Column in characters, from 1.
        column: usize,
        /// The field and what it must be.
        fault: Box<Fault>,
    },
    /// A field has a value it cannot have.
    #[error("{0}")]
    Value(Box<Fault>),
    /// A run folder's settings are not all there.
    #[error(
        "{file}: the setting `{field}` is missing, so the file is damaged: in a run folder all of them stand; take it from a copy of the \
         folder"
    )]
    Incomplete {
        /// Where the text comes from.
        file: String,
        /// The first field that is missing, by dotted name.
        field: String,
    },
    /// A resumed run was asked for fewer generations than it was made for.
    #[error(
        "the run was made for {made} generations and cannot be cut to {asked}; only more can be asked for"
    )]
    FewerGenerations {
        /// Generations in the run folder's settings.
        made: u32,
        /// Generations asked for.
        asked: u32,
    },
}

/// A field whose value is impossible.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("the setting `{field}` is {value}, but must be {must}")]
pub struct Fault {
    /// Dotted name of the field.
    pub field: String,
    /// Its value.
    pub value: String,
    /// What it must be.
    pub must: String,
    /// Dotted name of the field that it does not go with, if each by itself would be possible.
    pub beside: Option<&'static str>,
}

impl Settings {
    /// The settings of a preset.
    pub fn preset(preset: Preset) -> Settings {
        match preset {
            Preset::Paper => Settings::paper(),
            Preset::Default => Settings::default_preset(),
        }
    }

    /// The preset `paper`: the published method, and where it is silent the classical choice.
    pub fn paper() -> Settings {
        Settings {
            seed: 1,
            population: 4000,
            generations: 51,
            trees: 2,
            tolerance: 10.0,
            creation: Creation {
                min_depth: 6,
                max_depth: 9,
                full_probability: 0.5,
                grow_leaf_probability: 0.25,
                column_depth: 3,
                plain_column_probability: 0.0,
                constant_min: 0.01,
                constant_max: 1000.0,
            },
            breeding: Breeding {
                crossover_probability: 0.9,
                subtree_mutation_probability: 0.0,
                point_mutation_probability: 0.0,
                constant_mutation_probability: 0.0,
                hoist_mutation_probability: 0.0,
                mutation_depth: 4,
                constant_step: 0.5,
                internal_probability: 0.9,
                max_depth: 17,
                redraws: 10,
            },
            selection: Selection {
                kind: SelectionKind::Tournament,
                tournament: 7,
                case_share: 1.0,
                elitism: 0,
                parsimony: Parsimony::None,
                size_tournament: 1.4,
            },
            islands: Islands { count: 1, interval: 10, migrants: 5 },
            filter: Filter { enabled: false, in_range: 0.5, distinct: 20, max_draws: 1000 },
            augmentation: Augmentation::OFF,
            nodes: NodeSet::default(),
        }
    }

    /// The preset `default`: `paper` with individuals of one tree, plain columns at the start and the initial filter;
    /// lexicase selection, of equal individuals the smaller; four tenths of the pairs crossed, 12 of 100 mutated and the
    /// others copied, which halves the programs to run at no loss; trees no deeper than 10; neither trigonometry nor
    /// averages of squares, and more weight on `if-le`, `break`, `set-a` and `prog2`; and a copy of each training image
    /// in other light, every other one mirrored. It was chosen by experiment: `examples/sweeps/screening.toml`, README, *Experiments*.
    pub fn default_preset() -> Settings {
        let mut settings = Settings::paper();
        settings.trees = 1;
        settings.creation.plain_column_probability = 0.7;
        settings.filter.enabled = true;
        settings.selection.kind = SelectionKind::Lexicase;
        settings.selection.parsimony = Parsimony::Lexicographic;
        settings.breeding.crossover_probability = 0.4;
        settings.breeding.subtree_mutation_probability = 0.06;
        settings.breeding.point_mutation_probability = 0.03;
        settings.breeding.constant_mutation_probability = 0.03;
        settings.breeding.max_depth = 10;
        settings.augmentation.mirror = 0.5;
        settings.augmentation.gain = 0.3;
        settings.augmentation.brightness = 20.0;
        settings.nodes = NodeSet::of_weights(|node| match node.name() {
            "sin" | "cos" | "tan" | "atan" | "atan2" => 0,
            name if name.ends_with("-sq") => 0,
            "if-le" => 4,
            "break" | "set-a" => 3,
            "prog2" => 2,
            _ => 1,
        });
        settings
    }

    /// The settings of a file: what `text` gives, over the preset it names (else the default).
    ///
    /// # Errors
    /// If the text is not TOML, a field is unknown, or a value impossible; `file` names the source in messages.
    pub fn from_toml(text: &str, file: &str) -> Result<Settings, SettingsError> {
        Settings::default_preset().with_toml(text, file)
    }

    /// The settings that a run folder records: fields it lacks, because an earlier revision wrote it, mean what runs
    /// did then, whatever presets say now.
    ///
    /// # Errors
    /// As [`Settings::from_toml`].
    pub fn from_record(text: &str, file: &str) -> Result<Settings, SettingsError> {
        let mut settings = Settings::default_preset();
        settings.reset_later();
        // What is no TOML is told with its place below.
        if let Ok(table) = text.parse::<toml::Table>() {
            let lacking = |(table_name, field): &(Option<String>, String)| match table_name {
                None => {
                    table.get(field).is_none_or(|value| value.as_table().is_some_and(toml::Table::is_empty))
                }
                Some(name) => table.get(name).is_none_or(|table| table.get(field).is_none()),
            };
            if let Some((table_name, field)) = settings.always_recorded().into_iter().find(lacking) {
                let field = table_name.map_or_else(|| field.clone(), |name| format!("{name}.{field}"));
                return Err(SettingsError::Incomplete { file: file.to_string(), field });
            }
        }
        settings.with_toml(text, file)
    }

    /// The fields that every run folder has had: those that stand in it whatever their values, each with its table.
    fn always_recorded(&self) -> Vec<(Option<String>, String)> {
        let mut text = String::new();
        self.write(&mut text, true);
        // The text is the library's own.
        let table: toml::Table = text.parse().unwrap_or_default();
        let mut fields = Vec::new();
        for (name, value) in table {
            match value {
                toml::Value::Table(inner) => {
                    fields.extend(inner.into_iter().map(|(field, _)| (Some(name.clone()), field)));
                }
                _ => fields.push((None, name)),
            }
        }
        fields.push((None, "nodes".to_string()));
        fields
    }

    /// These settings with what `text` gives laid over them. A preset it names counts first. To check only what
    /// several sources come to together, see [`Draft`](super::Draft).
    ///
    /// # Errors
    /// As [`Settings::from_toml`].
    pub fn with_toml(self, text: &str, file: &str) -> Result<Settings, SettingsError> {
        let mut draft = Draft::new(self);
        draft.lay_over(text, file)?;
        draft.finish()
    }

    /// Lays what `text` gives over these settings. Names and types are checked, values are not. Gives the line
    /// and the column of each field that the text gives, by dotted name, and the preset that it names.
    pub(super) fn overlay(
        &mut self,
        text: &str,
        file: &str,
    ) -> Result<(Given, Option<Preset>), SettingsError> {
        self.overlay_partial(parse(text, file)?, text, file)
    }

    /// The same with a table of the text.
    pub(super) fn overlay_table(
        &mut self,
        table: Spanned<DeTable<'_>>,
        text: &str,
        file: &str,
    ) -> Result<(Given, Option<Preset>), SettingsError> {
        let partial = Partial::deserialize(toml::Deserializer::from(table));
        self.overlay_partial(partial.map_err(|error| syntax(&error, text, file))?, text, file)
    }

    fn overlay_partial(
        &mut self,
        mut partial: Partial,
        text: &str,
        file: &str,
    ) -> Result<(Given, Option<Preset>), SettingsError> {
        let mut places = Places::new();
        let preset = partial.preset;
        if let Some(preset) = preset {
            *self = Settings::preset(preset);
        }
        let nodes = std::mem::take(&mut partial.nodes);
        self.merge_partial("", partial, &mut places);
        for (name, weight) in nodes {
            let span = weight.span();
            set_weight(&mut self.nodes, &name, weight.into_inner()).map_err(|fault| {
                let (line, column) = position(text, span.start);
                SettingsError::ValueAt { file: file.to_string(), line, column, fault: Box::new(fault) }
            })?;
            places.insert(format!("nodes.{name}"), span);
        }
        let given = places.into_iter().map(|(field, span)| (field, position(text, span.start))).collect();
        Ok((given, preset))
    }

    /// The settings in full, every field under its meaning.
    pub fn to_toml(&self) -> String {
        self.list(false)
    }

    /// The settings as TOML, without fields that came later and are off if they are to be `left_out`.
    fn list(&self, left_out: bool) -> String {
        let mut out = String::new();
        self.write(&mut out, left_out);
        out.push_str("\n# Weight of each node type beside the others that fit the same place; 0 leaves it out.\n[nodes]\n");
        for node_type in NodeType::all() {
            let _ = writeln!(out, "{:?} = {}", node_type.name(), self.nodes.weight(node_type));
        }
        out
    }

    /// Whether every value is possible.
    ///
    /// # Errors
    /// The first impossible value.
    pub fn validate(&self) -> Result<(), SettingsError> {
        self.check().map_err(|fault| SettingsError::Value(Box::new(fault)))
    }

    /// What of these settings is for the making of random individuals.
    pub fn create_settings(&self) -> CreateSettings {
        let c = &self.creation;
        CreateSettings {
            min_depth: c.min_depth as usize,
            max_depth: c.max_depth as usize,
            column_depth: c.column_depth as usize,
            full_probability: c.full_probability,
            grow_leaf_probability: c.grow_leaf_probability,
            plain_column_probability: c.plain_column_probability,
            constant_min: c.constant_min as f32,
            constant_max: c.constant_max as f32,
            trees: self.trees as usize,
            nodes: self.nodes.clone(),
        }
    }

    /// What of these settings is for the copies of training images.
    pub fn variation(&self) -> Variation {
        self.augmentation.variation()
    }

    /// What of these settings is for crossover.
    pub fn crossover_settings(&self) -> CrossoverSettings {
        CrossoverSettings {
            internal_probability: self.breeding.internal_probability,
            max_depth: self.breeding.max_depth as usize,
        }
    }

    /// What of these settings is for mutation.
    pub fn mutation_settings(&self) -> MutationSettings {
        let b = &self.breeding;
        MutationSettings {
            internal_probability: b.internal_probability,
            max_depth: b.max_depth as usize,
            subtree_depth: b.mutation_depth as usize,
            constant_step: b.constant_step,
        }
    }

    /// These settings for a resumed run that shall have `generations` in all.
    ///
    /// # Errors
    /// If that is fewer than before: a resumed run can only grow.
    pub fn extended(mut self, generations: u32) -> Result<Settings, SettingsError> {
        if generations < self.generations {
            return Err(SettingsError::FewerGenerations { made: self.generations, asked: generations });
        }
        self.generations = generations;
        Ok(self)
    }

    /// A number that differs (but for chance) between settings that give different runs. The number of
    /// generations is not part of it, for it may grow; nor is what earlier revisions did not have, while it is off.
    pub fn fingerprint(&self) -> u64 {
        let text = Settings { generations: 0, ..self.clone() }.list(true);
        let fields = text.lines().filter(|line| !line.starts_with('#'));
        super::fitness::hash64(fields.flat_map(|line| line.bytes().chain([b'\n'])).map(u64::from))
    }
}

fn parse(text: &str, file: &str) -> Result<Partial, SettingsError> {
    toml::from_str(text).map_err(|error| syntax(&error, text, file))
}

fn syntax(error: &toml::de::Error, text: &str, file: &str) -> SettingsError {
    let (line, column) = position(text, error.span().map_or(0, |span| span.start));
    let message = error.message().trim_end().replace('\n', " ");
    SettingsError::Syntax { file: file.to_string(), line, column, message }
}

/// Line and column, both from 1, of a byte of a text.
pub(super) fn position(text: &str, offset: usize) -> (usize, usize) {
    let before = text.get(..offset).unwrap_or(text);
    let line = before.matches('\n').count() + 1;
    let column = before.rsplit('\n').next().map_or(0, |tail| tail.chars().count()) + 1;
    (line, column)
}
