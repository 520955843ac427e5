//! The tables of settings: every field with its type and its meaning, declared once.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::ops::Range;

use serde::{Deserialize, Serialize};
use toml::Spanned;

use super::selection::{Parsimony, SelectionKind};
use super::settings::Preset;
use crate::tree::NodeSet;

/// Where in the file each field was given, by dotted name, in bytes.
pub(super) type Places = BTreeMap<String, Range<usize>>;

/// Declares a table of settings once: its struct, the partial form that a file gives, merging the two, and the
/// commented text.
///
/// A field with `= OFF` came after the first run folders were written, and at OFF a run is what it was before there
/// was the field. Recorded settings that lack it mean OFF, and at OFF it is no part of the fingerprint: so the runs of
/// earlier revisions go on.
macro_rules! table {
    (
        $(#[$meta:meta])*
        $name:ident, $partial:ident {
            $($(#[doc = $doc:literal])+ $field:ident: $ty:ty $(= $off:expr)?,)+
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
        pub(super) struct $partial {
            $($field: Option<Spanned<$ty>>,)+
            $(
                $($table: $tpartial,)+
                pub(super) preset: Option<Preset>,
                pub(super) nodes: BTreeMap<String, Spanned<u32>>,
                data: toml::Table,
            )?
        }

        impl $name {
            pub(super) fn merge_partial(&mut self, prefix: &str, partial: $partial, places: &mut Places) {
                $(if let Some(value) = partial.$field {
                    places.insert(format!("{prefix}{}", stringify!($field)), value.span());
                    self.$field = value.into_inner();
                })+
                $($(self.$table.merge_partial(concat!(stringify!($table), "."), partial.$table, places);)+)?
            }

            /// Sets every field that came later to what it means where it is not recorded.
            pub(super) fn reset_later(&mut self) {
                $($(self.$field = $off;)?)+
                $($(self.$table.reset_later();)+)?
            }

            /// The fields under their meanings; without those that came later and are off, if they are to be `left_out`.
            pub(super) fn write(&self, out: &mut String, left_out: bool) {
                $(
                    if !(left_out && (false $(|| self.$field == $off)?)) {
                        $(let _ = writeln!(out, "#{}", $doc);)+
                        let _ = writeln!(out, "{} = {}", stringify!($field), inline(&self.$field));
                    }
                )+
                $($(
                    let mut fields = String::new();
                    self.$table.write(&mut fields, left_out);
                    if !fields.is_empty() {
                        let _ = writeln!(out);
                        $(let _ = writeln!(out, "#{}", $tdoc);)+
                        let _ = write!(out, "[{}]\n{fields}", stringify!($table));
                    }
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
        /// Probability that a pair of slots is filled by crossover. What this and the probabilities of mutation
        /// leave of 1 is that of copies of the parents.
        crossover_probability: f64,
        /// Probability that both parents of a pair are changed by subtree mutation instead: a subtree becomes a
        /// random one of the same place.
        subtree_mutation_probability: f64 = 0.0,
        /// Probability of point mutation: a node becomes another with as many arguments.
        point_mutation_probability: f64 = 0.0,
        /// Probability of constant mutation: a constant is multiplied by a log-normal factor.
        constant_mutation_probability: f64 = 0.0,
        /// Probability of hoist mutation: a subtree becomes a part of itself.
        hoist_mutation_probability: f64 = 0.0,
        /// Depth that subtree mutation grows a part of a body within, counted from its own root.
        mutation_depth: u32 = 4,
        /// Standard deviation of the natural logarithm of the factor of constant mutation.
        constant_step: f64 = 0.5,
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
        /// How a parent is selected: "tournament" on the share of cases solved; "sharing", a tournament on the
        /// case-wise shared fitness, in which a solved case counts 1 / number of individuals that solve it;
        /// "lexicase", by the cases one after the other in random order.
        kind: SelectionKind,
        /// Individuals drawn for a tournament, with replacement.
        tournament: u32,
        /// Share of the training cases, drawn afresh for each generation, that lexicase selection looks at; below
        /// 1 it is down-sampled lexicase selection. All cases are run all the same.
        case_share: f64 = 1.0,
        /// So many of the best individuals (of each island) are copied unchanged; of equal ones the smaller, then
        /// the first.
        elitism: u32 = 0,
        /// What is done against bloat: "none"; "lexicographic", of equal individuals the smaller is selected;
        /// "double", of two selected individuals the smaller is taken with probability `size_tournament` / 2.
        parsimony: Parsimony = Parsimony::None,
        /// Pressure of the tournament of two on size in double tournaments: 1 is none, 2 always takes the smaller.
        size_tournament: f64 = 1.4,
    }
}

table! {
    /// Islands: parts of the population that breed by themselves.
    Islands, PartialIslands {
        /// Number of islands, parts of the population of equal size (or one less); 1 is the population as a whole.
        count: u32 = 1,
        /// Individuals migrate every so many generations, before one is bred.
        interval: u32 = 10,
        /// How many of the best of each island migrate: copies take the places of the worst of the next island,
        /// the first being next to the last.
        migrants: u32 = 5,
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
        variants: u32 = 1,
        /// Probability that a copy is mirrored.
        mirror: f64 = 0.0,
        /// Greatest change of the light, as a share s: gray levels times a factor from 1 / (1 + s) to 1 + s.
        gain: f64 = 0.0,
        /// Greatest change of brightness, in gray levels added or taken away.
        brightness: f64 = 0.0,
        /// Greatest change of contrast, as a share s: distances from middle gray times a factor as above.
        contrast: f64 = 0.0,
        /// Greatest change of the exponent of the sensor's response, as a share s: an exponent as the factor above.
        gamma: f64 = 0.0,
        /// Greatest standard deviation of Gaussian noise, in gray levels.
        noise: f64 = 0.0,
        /// Greatest standard deviation of a Gaussian blur, in pixels.
        blur: f64 = 0.0,
        /// Greatest shift to either side, in pixels; a column that is shifted out of the image is no case.
        shift_x: u32 = 0,
        /// Greatest shift up or down, in pixels; labels move along.
        shift_y: u32 = 0,
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
        /// Islands: parts of the population that breed by themselves.
        islands: Islands, PartialIslands,
        /// The filter of initial individuals: drawn again until the answers on the training cases look like answers.
        filter: Filter, PartialFilter,
        /// Altered copies of the training images, on which individuals are evaluated beside the images themselves. All
        /// else that is said of training cases means these too, but for the filter, which looks at unaltered ones alone.
        augmentation: Augmentation, PartialAugmentation,
    }
}
