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
use std::ops::Range;

use serde::{Deserialize, Serialize};
use toml::Spanned;

use super::selection::SelectionKind;
use super::settings_check::set_weight;
use super::settings_draft::Draft;
use crate::dataset::Variation;
use crate::tree::{CreateSettings, CrossoverSettings, NodeSet, NodeType};

/// Where in the file each field was given, by dotted name, in bytes.
type Places = BTreeMap<String, Range<usize>>;
/// The same as line and column.
pub(super) type Given = BTreeMap<String, (usize, usize)>;

/// Declares a table of settings once: its struct, the partial form that a file gives, merging the two, and the
/// commented text.
macro_rules! table {
    (
        $(#[$meta:meta])*
        $name:ident, $partial:ident {
            $($(#[doc = $doc:literal])+ $field:ident: $ty:ty,)+
        }
        $(tables { $($(#[doc = $tdoc:literal])+ $table:ident: $tname:ident, $tpartial:ident,)+ })?
    ) => {
        $(#[$meta])*
        #[derive(Debug, Clone, PartialEq)]
        pub struct $name {
            $($(#[doc = $doc])+ pub $field: $ty,)+
            $(
                $($(#[doc = $tdoc])+ pub $table: $tname,)+
                /// The node types in use and their weights.
                pub nodes: NodeSet,
            )?
        }

        #[derive(Debug, Default, Deserialize)]
        #[serde(deny_unknown_fields, default)]
        struct $partial {
            $($field: Option<Spanned<$ty>>,)+
            $($($table: $tpartial,)+ preset: Option<Preset>, nodes: BTreeMap<String, Spanned<u32>>, data: toml::Table,)?
        }

        impl $name {
            fn merge_partial(&mut self, prefix: &str, partial: $partial, places: &mut Places) {
                $(if let Some(value) = partial.$field {
                    places.insert(format!("{prefix}{}", stringify!($field)), value.span());
                    self.$field = value.into_inner();
                })+
                $($(self.$table.merge_partial(concat!(stringify!($table), "."), partial.$table, places);)+)?
            }

            fn write(&self, out: &mut String) {
                $(
                    $(let _ = writeln!(out, "#{}", $doc);)+
                    let _ = writeln!(out, "{} = {}", stringify!($field), inline(&self.$field));
                )+
                $($(
                    let _ = writeln!(out);
                    $(let _ = writeln!(out, "#{}", $tdoc);)+
                    let _ = writeln!(out, "[{}]", stringify!($table));
                    self.$table.write(out);
                )+)?
            }
        }
    };
}

fn inline(value: &impl Serialize) -> String {
    // Numbers, truth values and names always have a TOML form.
    toml::Value::try_from(value).map(|v| v.to_string()).unwrap_or_default()
}

table! {
    /// How random trees are made.
    Creation, PartialCreation {
        /// Least of the maximum depths of new trees; the root has depth 0.
        min_depth: u32,
        /// Greatest of the maximum depths of new trees.
        max_depth: u32,
        /// Probability of the full method, else grow.
        full_probability: f64,
        /// Probability that the grow method takes a leaf above the last level.
        grow_leaf_probability: f64,
        /// Depth a column expression is grown within, counted from its own root.
        column_depth: u32,
        /// Probability that a column expression starts as plain `x-obstacle`.
        plain_column_probability: f64,
        /// Least magnitude of a random constant (log-uniform, either sign).
        constant_min: f64,
        /// Greatest magnitude of a random constant.
        constant_max: f64,
    }
}

table! {
    /// How offspring are bred.
    Breeding, PartialBreeding {
        /// Probability that a pair of slots is filled by crossover, else by copies of the parents.
        crossover_probability: f64,
        /// Probability of choosing an internal point, else a leaf.
        internal_probability: f64,
        /// An offspring deeper than this is replaced by the parent it comes from.
        max_depth: u32,
        /// How often the second parent is drawn again while it is the first.
        redraws: u32,
    }
}

table! {
    /// How parents are selected.
    Selection, PartialSelection {
        /// What a tournament compares: "tournament" the share of cases solved, "sharing" the case-wise shared
        /// fitness, in which a solved case counts 1 / number of individuals that solve it.
        kind: SelectionKind,
        /// Individuals drawn for a tournament, with replacement.
        tournament: u32,
    }
}

table! {
    /// The filter of initial individuals.
    Filter, PartialFilter {
        /// Whether initial individuals are filtered at all.
        enabled: bool,
        /// Least share of the answers that lie within the image, 0 to height - 1.
        in_range: f64,
        /// Least number of distinct finite answers (or half the number of distinct labels, if that is less).
        distinct: u32,
        /// After so many draws the last is kept, and counted in the log.
        max_draws: u32,
    }
}

table! {
    /// Altered copies of the training images.
    Augmentation, PartialAugmentation {
        /// Copies of each training image, every one altered by its own draw from the limits below; none while all of
        /// those are 0.
        variants: u32,
        /// Probability that a copy is mirrored.
        mirror: f64,
        /// Greatest change of the light, as a share s: gray levels times a factor from 1 / (1 + s) to 1 + s.
        gain: f64,
        /// Greatest change of brightness, in gray levels added or taken away.
        brightness: f64,
        /// Greatest change of contrast, as a share s: distances from middle gray times a factor as above.
        contrast: f64,
        /// Greatest change of the exponent of the sensor's response, as a share s: an exponent as the factor above.
        gamma: f64,
        /// Greatest standard deviation of Gaussian noise, in gray levels.
        noise: f64,
        /// Greatest standard deviation of a Gaussian blur, in pixels.
        blur: f64,
        /// Greatest shift to either side, in pixels; a column that is shifted out of the image is no case.
        shift_x: u32,
        /// Greatest shift up or down, in pixels; labels move along.
        shift_y: u32,
    }
}

table! {
    /// Every setting that shapes a run. Threads, executor and quietness are not among them: they change no
    /// result.
    Settings, Partial {
        /// Seed of every random choice, 0 to 2^63 - 1.
        seed: u64,
        /// Individuals in a generation.
        population: u32,
        /// Generations, the initial one included.
        generations: u32,
        /// Trees of an individual: 2, or 1 for detectors without a first pass.
        trees: u32,
        /// An answer is correct within this many rows of the label.
        tolerance: f64,
    }
    tables {
        /// How random trees are made: ramped half-and-half.
        creation: Creation, PartialCreation,
        /// How offspring are bred.
        breeding: Breeding, PartialBreeding,
        /// How parents are selected.
        selection: Selection, PartialSelection,
        /// The filter of initial individuals: drawn again until the answers on the training cases look like answers.
        filter: Filter, PartialFilter,
        /// Altered copies of the training images, on which individuals are evaluated beside the images themselves. All
        /// else that is said of training cases means these too, but for the filter, which looks at unaltered ones alone.
        augmentation: Augmentation, PartialAugmentation,
    }
}

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
                internal_probability: 0.9,
                max_depth: 17,
                redraws: 10,
            },
            selection: Selection { kind: SelectionKind::Tournament, tournament: 7 },
            filter: Filter { enabled: false, in_range: 0.5, distinct: 20, max_draws: 1000 },
            augmentation: Augmentation::OFF,
            nodes: NodeSet::default(),
        }
    }

    /// The preset `default`: `paper` with plain columns at the start, the initial filter, and tournaments on
    /// case-wise shared fitness.
    pub fn default_preset() -> Settings {
        let mut settings = Settings::paper();
        settings.creation.plain_column_probability = 0.7;
        settings.filter.enabled = true;
        settings.selection.kind = SelectionKind::Sharing;
        settings
    }

    /// The settings of a file: what `text` gives, over the preset it names (else the default).
    ///
    /// # Errors
    /// If the text is not TOML, a field is unknown, or a value impossible; `file` names the source in messages.
    pub fn from_toml(text: &str, file: &str) -> Result<Settings, SettingsError> {
        Settings::default_preset().with_toml(text, file)
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
        let mut partial = parse(text, file)?;
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
        let mut out = String::new();
        self.write(&mut out);
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
    /// generations is not part of it, for it may grow.
    pub fn fingerprint(&self) -> u64 {
        let text = Settings { generations: 0, ..self.clone() }.to_toml();
        // Runs of releases that did not augment go on: while it is off, its table is as if it were not there.
        let mut counts = true;
        let fields = text.lines().filter(|line| {
            if line.starts_with('[') {
                counts = *line != "[augmentation]" || self.augmentation != Augmentation::OFF;
            }
            counts && !line.starts_with('#')
        });
        super::fitness::hash64(fields.flat_map(|line| line.bytes().chain([b'\n'])).map(u64::from))
    }
}

fn parse(text: &str, file: &str) -> Result<Partial, SettingsError> {
    toml::from_str(text).map_err(|error| {
        let (line, column) = position(text, error.span().map_or(0, |span| span.start));
        let message = error.message().trim_end().replace('\n', " ");
        SettingsError::Syntax { file: file.to_string(), line, column, message }
    })
}

fn position(text: &str, offset: usize) -> (usize, usize) {
    let before = text.get(..offset).unwrap_or(text);
    let line = before.matches('\n').count() + 1;
    let column = before.rsplit('\n').next().map_or(0, |tail| tail.chars().count()) + 1;
    (line, column)
}
