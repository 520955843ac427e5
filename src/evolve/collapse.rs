//! Collapse: a run that has lost what selection could work on, and what to try then.
//!
//! A run has collapsed when for [`HOLD`] generations in a row its diversity is gone (or its individuals do nothing but
//! grow), and over the last [`LOOK_BACK`] generations the best has hardly come nearer to all cases. Both are needed:
//! a population may be narrow while it follows a find, and may wait long for one while it is diverse.
//!
//! The thresholds stand between runs that failed and runs that did not, on real images of a corridor and a street and on
//! the built-in ones: `paper`, and what `default` was at first (plain columns, the filter, shared fitness), populations of
//! 1,000 for 31 generations (seeds 1 to 5) and of 4,000
//! for 51 (seeds 1 and 2, on the corridor 3 too). Of the 22 runs of `paper` 21 are warned of, first in generation 10 to
//! 27; three of these found something later, so that they end without a warning. All end between 12 and 55 % of the
//! training cases; from generation 6 on, in those of seeds 1 to 3, the entropy falls 1.2 to 3.0 bits short, and one
//! behaviour holds up to 96 % of the population. Of the 22 runs of `default` none is warned of: in those of seeds 1 to 3 at most 0.93
//! bits are missing, and the up to 62 % of one behaviour never last without progress. Nor are four of lexicase selection.
//! Bloat alone was met in none of them; its thresholds only keep clear of these.

use std::fmt;

use serde::{Deserialize, Serialize};

use super::record::Record;
use super::selection::{Parsimony, SelectionKind};
use super::settings::Settings;

/// For so many generations in a row the signs must last.
const HOLD: usize = 5;
/// Progress is measured over so many generations.
const LOOK_BACK: usize = 10;
/// The least progress: the share of the cases not yet solved by the best that is solved meanwhile.
const PROGRESS: f64 = 0.05;
/// A run whose best solves this share of the cases has nothing to be warned of.
const SOLVED: f64 = 0.99;
/// Share of the members that answer a constant.
const CONSTANTS: f64 = 0.5;
/// Share of the members that show one behaviour.
const DOMINANCE: f64 = 0.5;
/// Distinct behaviours, as a share of the population.
const BEHAVIOURS: f64 = 0.02;
/// Entropy of the cases solved below the largest possible, in bits: at 1 the generation solves as few cases as if it
/// solved half of them equally often and the others never.
const MISSING_ENTROPY: f64 = 1.0;
/// Nodes of an individual on average ...
const NODES: f64 = 300.0;
/// ... and as a multiple of what they were when the best was found.
const GROWTH: f64 = 2.0;

/// How a run has collapsed. The first that holds is the one that is told.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Collapse {
    /// At least half of the members answer every case alike.
    Constants,
    /// One behaviour holds half of the population, or next to none are left, or all solve the same few cases.
    Converged,
    /// Individuals grow and grow, and are no better for it.
    Bloat,
}

impl Collapse {
    /// What the records of the generations so far, the initial one first, tell of a run on so many training cases. It is
    /// a function of its arguments alone, so that a resumed run is told the same.
    pub fn of(records: &[Record], settings: &Settings, cases: usize) -> Option<Collapse> {
        if !is_stuck(records) {
            return None;
        }
        let last = &records[records.len().checked_sub(HOLD)?..];
        let lasts = |sign: &dyn Fn(&Record) -> bool| last.iter().all(sign);
        let bits = libm::log2(cases.max(1) as f64);
        let converged = |r: &Record| {
            r.largest_behaviour.is_some_and(|share| share >= DOMINANCE)
                || f64::from(r.distinct_behaviours) < BEHAVIOURS * f64::from(settings.population)
                || r.case_entropy.is_some_and(|entropy| (1.0 - entropy) * bits > MISSING_ENTROPY)
        };
        let before = best_found(records).mean_nodes;
        if lasts(&|r| r.constant_share >= CONSTANTS) {
            Some(Collapse::Constants)
        } else if lasts(&converged) {
            Some(Collapse::Converged)
        } else if lasts(&|r| r.mean_nodes > NODES && r.mean_nodes > GROWTH * before) {
            Some(Collapse::Bloat)
        } else {
            None
        }
    }
}

/// Whether the best has hardly come nearer to all cases of late.
fn is_stuck(records: &[Record]) -> bool {
    let Some(then) = records.len().checked_sub(LOOK_BACK + 1) else { return false };
    let [then, now] = [then, records.len() - 1].map(|i| records[i].best_fitness_so_far);
    now < SOLVED && 1.0 - now > (1.0 - PROGRESS) * (1.0 - then)
}

/// The generation in which the best so far came up; there must be one.
fn best_found(records: &[Record]) -> &Record {
    let best = records[records.len() - 1].best_fitness_so_far;
    let found = records.iter().find(|r| r.best_fitness_so_far == best);
    found.unwrap_or(&records[records.len() - 1])
}

/// A collapse in words: what was seen, and what to try.
///
/// ```
/// use vsonar::evolve::{Settings, Warning};
///
/// // a run without a generation has not collapsed
/// assert_eq!(Warning::of(&[], &Settings::paper()), None);
/// ```
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Warning {
    /// How the run has collapsed.
    pub kind: Collapse,
    /// What was seen, in numbers.
    pub seen: String,
    /// Flags of `vsonar evolve` to try in a new run, the most promising first, each by itself or together; only what the
    /// run does not have already.
    pub remedies: Vec<String>,
}

impl Warning {
    /// The warning of the last of these records, which are those of all generations, the initial one first; `None` if
    /// it has none.
    pub fn of(records: &[Record], settings: &Settings) -> Option<Warning> {
        let last = records.last()?;
        let kind = last.warning?;
        let percent = |share: f64| format!("{:.1} %", 100.0 * share);
        let what = match kind {
            Collapse::Constants => {
                format!("{} of the individuals answer every case alike", percent(last.constant_share))
            }
            Collapse::Converged => format!(
                "{} behaviours are left among {} individuals, {} of which answer alike, and the entropy of the cases \
                 solved is {:.2}",
                last.distinct_behaviours,
                settings.population,
                percent(last.largest_behaviour.unwrap_or(0.0)),
                last.case_entropy.unwrap_or(0.0)
            ),
            Collapse::Bloat => {
                let found = best_found(records);
                format!(
                    "individuals have {:.0} nodes on average, {:.0} when the best was found in generation {}",
                    last.mean_nodes, found.mean_nodes, found.generation
                )
            }
        };
        let before = records[records.len().saturating_sub(LOOK_BACK + 1)].best_fitness_so_far;
        let seen = format!(
            "{what}; the best solves {} of the cases, {LOOK_BACK} generations ago {}",
            percent(last.best_fitness_so_far),
            percent(before)
        );
        Some(Warning { kind, seen, remedies: remedies(kind, settings) })
    }
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let kind = match self.kind {
            Collapse::Constants => "the run has collapsed to constant answers",
            Collapse::Converged => "the run has converged too early",
            Collapse::Bloat => "individuals grow without getting better",
        };
        write!(f, "{kind}: {}; try ", self.seen)?;
        for (i, remedy) in self.remedies.iter().enumerate() {
            let before = match i {
                0 => "",
                _ if i + 1 == self.remedies.len() => " or ",
                _ => ", ",
            };
            write!(f, "{before}`{remedy}`")?;
        }
        Ok(())
    }
}

/// How many remedies are named beside another seed.
const REMEDIES: usize = 3;

/// What to try, of what is not tried already and goes with the other settings.
fn remedies(kind: Collapse, settings: &Settings) -> Vec<String> {
    let plain = Settings::paper();
    // Whoever runs the published set-up is best served by all that the default changes at once.
    let published = !settings.filter.enabled
        && settings.selection.kind == plain.selection.kind
        && settings.creation.plain_column_probability == 0.0;
    let kind_of_selection = settings.selection.kind;
    let candidates: &[(bool, &str, &str)] = match kind {
        Collapse::Bloat => &[
            (settings.selection.parsimony == Parsimony::None, "selection.parsimony", "lexicographic"),
            (settings.selection.parsimony != Parsimony::Double, "selection.parsimony", "double"),
            (
                settings.breeding.hoist_mutation_probability == 0.0,
                "breeding.hoist_mutation_probability",
                "0.05",
            ),
        ],
        Collapse::Constants | Collapse::Converged => &[
            (!settings.filter.enabled && !published, "filter.enabled", "true"),
            (kind_of_selection == SelectionKind::Tournament && !published, "selection.kind", "sharing"),
            (kind_of_selection != SelectionKind::Lexicase, "selection.kind", "lexicase"),
            (
                settings.breeding.subtree_mutation_probability == 0.0,
                "breeding.subtree_mutation_probability",
                "0.1",
            ),
            (settings.islands.count == 1, "islands.count", "4"),
        ],
    };
    let mut found = Vec::new();
    if published && kind != Collapse::Bloat {
        found.push("--preset default".to_string());
    }
    for (missing, field, value) in candidates {
        if *missing && goes_with(settings, field, value) {
            found.push(format!("--set {field}={value}"));
        }
    }
    found.truncate(REMEDIES);
    if kind != Collapse::Bloat && settings.population < plain.population {
        found.push(format!("--population {}", plain.population));
    }
    found.push(format!("--seed {}", settings.seed.wrapping_add(1) % (1 << 63)));
    found
}

/// Whether the settings are possible with this change.
fn goes_with(settings: &Settings, field: &str, value: &str) -> bool {
    let value = if value.parse::<f64>().is_ok() || value == "true" {
        value.to_string()
    } else {
        format!("{value:?}")
    };
    settings.clone().with_toml(&format!("{field} = {value}"), field).is_ok()
}
