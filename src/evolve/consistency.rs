//! Whether what a checkpoint says fits together, and fits the settings and the data of its run.
//!
//! A checksum tells that a file is as it was written, not that what was written makes sense. So each part is held
//! against the others: the records against one another, the last of them against the population, the hall of fame
//! against both.

use super::checkpoint::State;
use super::hall_of_fame::{Entry, HallOfFame};
use super::record::Record;
use super::settings::Settings;
use crate::tree::Individual;

/// A contradiction in a checkpoint.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Contradiction {
    /// The records do not follow one another.
    #[error("record {place} is of generation {found}")]
    Generation {
        /// Its place, from 0.
        place: usize,
        /// The generation that it names.
        found: u32,
    },
    /// A number is outside of its range.
    #[error("generation {generation}: {field} is {value}, but must be {least} to {most}")]
    Range {
        /// The generation.
        generation: usize,
        /// The field of its record.
        field: &'static str,
        /// Its value.
        value: f64,
        /// The least it may be.
        least: f64,
        /// The most it may be.
        most: f64,
    },
    /// A number does not follow from others.
    #[error("generation {generation}: {field} is {found}, but {expected} by {of}")]
    Differs {
        /// The generation.
        generation: usize,
        /// The field of its record.
        field: &'static str,
        /// Its value.
        found: f64,
        /// What it should be.
        expected: f64,
        /// What it should be by.
        of: &'static str,
    },
    /// There is no hall of fame.
    #[error("the hall of fame is empty")]
    NoHall,
    /// The hall of fame has more entries than it keeps.
    #[error("the hall of fame has {0} entries, but {most} is the most", most = HallOfFame::CAPACITY)]
    Crowded(usize),
    /// An entry of the hall of fame cannot have come up as it says.
    #[error(
        "the hall of fame has a program of {nodes} nodes that solves {correct} cases since generation {since}, but {fault}"
    )]
    Entry {
        /// Nodes of the entry.
        nodes: usize,
        /// Cases that it solves.
        correct: u32,
        /// Its generation.
        since: u32,
        /// What speaks against it.
        fault: &'static str,
    },
    /// A member is missing in the hall of fame.
    #[error(
        "individual {place} solves {correct} cases with {nodes} nodes, which the hall of fame does not know"
    )]
    Unknown {
        /// Its place in the population, from 0.
        place: usize,
        /// Nodes of it.
        nodes: usize,
        /// Cases that it solves.
        correct: u32,
    },
    /// The population is of another size.
    #[error("there are {found} individuals, but the settings ask for {asked}")]
    Population {
        /// Individuals there are.
        found: usize,
        /// Individuals of the settings.
        asked: u32,
    },
    /// The individuals were evaluated on other cases.
    #[error("its individuals were evaluated on {found} cases, but there are {asked} training cases")]
    Cases {
        /// Cases in the checkpoint.
        found: usize,
        /// Cases of the run.
        asked: usize,
    },
    /// A program is none that the settings allow.
    #[error("{whose} has {fault}")]
    Program {
        /// Whose program.
        whose: String,
        /// What the settings do not allow.
        fault: String,
    },
}

/// Holds the parts of a state against one another.
pub(super) fn check(state: &State) -> Result<(), Contradiction> {
    let cases = state.population.first().map_or(0, |member| member.outcome.solved.len());
    for (place, record) in state.records.iter().enumerate() {
        if record.generation as usize != place {
            return Err(Contradiction::Generation { place, found: record.generation });
        }
        check_ranges(record, state.population.len(), cases)?;
    }
    check_course(&state.records)?;
    check_last(state, cases)?;
    check_hall(state, cases)
}

/// Holds a state against the settings of its run, and the number of its training cases.
pub(super) fn check_against(state: &State, settings: &Settings, cases: usize) -> Result<(), Contradiction> {
    let (found, asked) = (state.population.len(), settings.population);
    if found != asked as usize {
        return Err(Contradiction::Population { found, asked });
    }
    let found = state.population.first().map_or(0, |member| member.outcome.solved.len());
    if found != cases {
        return Err(Contradiction::Cases { found, asked: cases });
    }
    for (place, member) in state.population.iter().enumerate() {
        check_program(member.individual(), settings, || format!("individual {place}"))?;
    }
    for entry in state.hall_of_fame.entries() {
        let whose = || format!("the entry of {} nodes in the hall of fame", entry.individual.len());
        check_program(&entry.individual, settings, whose)?;
    }
    Ok(())
}

/// More than any run counts to, with room for runs that go on: counts add up without wrapping.
const COUNTED: f64 = (1u64 << 53) as f64;

/// Holds the numbers of a record against what they can be.
fn check_ranges(record: &Record, members: usize, cases: usize) -> Result<(), Contradiction> {
    let r = record;
    let (members, cases) = (members as f64, cases as f64);
    // Rounding may carry a mean beyond the largest of its numbers by a hair.
    let above = |most: f64| most * (1.0 + 1e-9);
    let t = &r.timing;
    for (field, value, least, most) in [
        ("evaluations", Some(r.evaluations as f64), 0.0, COUNTED),
        ("evaluations_total", Some(r.evaluations_total as f64), 0.0, COUNTED),
        ("distinct_optimised", r.distinct_optimised.map(|n| n as f64), 0.0, COUNTED),
        ("timing.executed", Some(t.executed as f64), 0.0, COUNTED),
        ("best_fitness", Some(r.best_fitness), 0.0, 1.0),
        ("mean_fitness", Some(r.mean_fitness), 0.0, above(r.best_fitness)),
        ("median_fitness", Some(r.median_fitness), 0.0, above(r.best_fitness)),
        ("best_fitness_so_far", Some(r.best_fitness_so_far), r.best_fitness, 1.0),
        ("best_fitness_unaltered", r.best_fitness_unaltered, 0.0, 1.0),
        ("validation_fitness", r.validation_fitness, 0.0, 1.0),
        ("max_nodes", Some(f64::from(r.max_nodes)), 1.0, f64::from(u32::MAX)),
        ("best_nodes", Some(f64::from(r.best_nodes)), 1.0, f64::from(r.max_nodes)),
        ("mean_nodes", Some(r.mean_nodes), 1.0, above(f64::from(r.max_nodes))),
        ("mean_depth", Some(r.mean_depth), 0.0, above(f64::from(r.max_depth))),
        ("distinct_programs", Some(f64::from(r.distinct_programs)), 1.0, members),
        ("distinct_behaviours", Some(f64::from(r.distinct_behaviours)), 1.0, members),
        ("constant_share", Some(r.constant_share), 0.0, 1.0),
        ("largest_behaviour", r.largest_behaviour, 0.0, 1.0),
        ("case_entropy", r.case_entropy, 0.0, 1.0),
        ("solved_by_nobody", r.solved_by_nobody.map(f64::from), 0.0, cases),
        ("hardest_case.case", r.hardest_case.map(|hardest| f64::from(hardest.case)), 0.0, cases - 1.0),
        ("hardest_case.solvers", r.hardest_case.map(|hardest| f64::from(hardest.solvers)), 0.0, members),
        ("operations_before", r.operations_before, 0.0, f64::MAX),
        ("operations_after", r.operations_after, 0.0, f64::MAX),
        ("timing.lower", Some(t.lower), 0.0, f64::MAX),
        ("timing.compile", Some(t.compile), 0.0, f64::MAX),
        ("timing.execute", Some(t.execute), 0.0, f64::MAX),
        ("timing.evaluate", Some(t.evaluate), 0.0, f64::MAX),
        ("timing.busy", Some(t.busy), 0.0, 1.0),
        ("timing.breed", Some(t.breed), 0.0, f64::MAX),
        ("timing.record", Some(t.record), 0.0, f64::MAX),
        ("timing.save", Some(t.save), 0.0, f64::MAX),
        ("timing.wall", Some(t.wall), 0.0, f64::MAX),
        ("timing.ms_per_uncached", Some(t.ms_per_uncached), 0.0, f64::MAX),
    ] {
        // What is no number is in no range.
        if let Some(value) = value.filter(|value| !(least..=most).contains(value)) {
            return Err(Contradiction::Range {
                generation: r.generation as usize,
                field,
                value,
                least,
                most,
            });
        }
    }
    Ok(())
}

/// Holds each record against those before it.
fn check_course(records: &[Record]) -> Result<(), Contradiction> {
    let (mut evaluations, mut best) = (0u64, 0.0f64);
    for (generation, record) in records.iter().enumerate() {
        evaluations = evaluations.saturating_add(record.evaluations);
        best = best.max(record.best_fitness);
        let of = "the records up to it";
        let (found, expected) = (record.evaluations_total, evaluations);
        if found != expected {
            let (found, expected, field) = (found as f64, expected as f64, "evaluations_total");
            return Err(Contradiction::Differs { generation, field, found, expected, of });
        }
        let (found, expected) = (record.best_fitness_so_far, best);
        if found != expected {
            return Err(Contradiction::Differs {
                generation,
                field: "best_fitness_so_far",
                found,
                expected,
                of,
            });
        }
    }
    Ok(())
}

/// Holds the last record against the population that it is of.
fn check_last(state: &State, cases: usize) -> Result<(), Contradiction> {
    let Some(r) = state.records.last() else { return Ok(()) };
    let p = Record::of(r.generation, &state.population, cases, 0, (0, 0), None);
    // Records of earlier revisions lack some.
    let (largest, entropy) = (p.largest_behaviour.unwrap_or_default(), p.case_entropy.unwrap_or_default());
    for (field, found, expected) in [
        ("best_fitness", r.best_fitness, p.best_fitness),
        ("mean_fitness", r.mean_fitness, p.mean_fitness),
        ("median_fitness", r.median_fitness, p.median_fitness),
        ("best_nodes", f64::from(r.best_nodes), f64::from(p.best_nodes)),
        ("mean_nodes", r.mean_nodes, p.mean_nodes),
        ("max_nodes", f64::from(r.max_nodes), f64::from(p.max_nodes)),
        ("mean_depth", r.mean_depth, p.mean_depth),
        ("max_depth", f64::from(r.max_depth), f64::from(p.max_depth)),
        ("distinct_programs", f64::from(r.distinct_programs), f64::from(p.distinct_programs)),
        ("distinct_behaviours", f64::from(r.distinct_behaviours), f64::from(p.distinct_behaviours)),
        ("largest_behaviour", r.largest_behaviour.unwrap_or(largest), largest),
        ("case_entropy", r.case_entropy.unwrap_or(entropy), entropy),
        ("constant_share", r.constant_share, p.constant_share),
    ] {
        if found != expected {
            let (generation, of) = (r.generation as usize, "its population");
            return Err(Contradiction::Differs { generation, field, found, expected, of });
        }
    }
    Ok(())
}

/// Holds the hall of fame against the records and the population.
fn check_hall(state: &State, cases: usize) -> Result<(), Contradiction> {
    let hall = &state.hall_of_fame;
    let entries = hall.entries();
    let Some(best) = hall.best() else { return Err(Contradiction::NoHall) };
    if entries.len() > HallOfFame::CAPACITY {
        return Err(Contradiction::Crowded(entries.len()));
    }
    let fitness = |entry: &Entry| f64::from(entry.correct) / cases.max(1) as f64;
    for entry in entries {
        let record = state.records.get(entry.generation as usize);
        let fault = match record {
            _ if entry.correct as usize > cases => Some("there are fewer"),
            None => Some("the run has not come so far"),
            Some(record) if fitness(entry) > record.best_fitness => Some("nobody did in that generation"),
            Some(record) if entry.individual.len() > record.max_nodes as usize => {
                Some("nobody was so large in that generation")
            }
            Some(_) => None,
        };
        if let Some(fault) = fault {
            let (nodes, correct, since) = (entry.individual.len(), entry.correct, entry.generation);
            return Err(Contradiction::Entry { nodes, correct, since, fault });
        }
    }
    if let Some(last) = state.records.last().filter(|last| last.best_fitness_so_far != fitness(best)) {
        return Err(Contradiction::Differs {
            generation: last.generation as usize,
            field: "best_fitness_so_far",
            found: last.best_fitness_so_far,
            expected: fitness(best),
            of: "the hall of fame",
        });
    }
    // A full one has let go of the smallest.
    let is_full = entries.len() == HallOfFame::CAPACITY;
    for (place, member) in state.population.iter().enumerate().filter(|_| !is_full) {
        let (nodes, correct) = (member.individual().len(), member.correct());
        if hall.admits(nodes, correct) {
            return Err(Contradiction::Unknown { place, nodes, correct });
        }
    }
    Ok(())
}

/// Holds a program against what the settings allow.
fn check_program(
    individual: &Individual,
    settings: &Settings,
    whose: impl Fn() -> String,
) -> Result<(), Contradiction> {
    let (trees, deepest) = (individual.trees().count(), settings.breeding.max_depth);
    let unwanted = || {
        let mut nodes = individual.trees().flat_map(|tree| tree.nodes());
        nodes.find(|node| settings.nodes.weight(node.node_type()) == 0)
    };
    let fault = if trees != settings.trees as usize {
        format!("{trees} trees, but the settings ask for {}", settings.trees)
    } else if individual.depth() > deepest as usize {
        format!("depth {}, but the settings allow {deepest}", individual.depth())
    } else if let Some(node) = unwanted() {
        format!("the node `{}`, which the settings leave out", node.name())
    } else {
        return Ok(());
    };
    Err(Contradiction::Program { whose: whose(), fault })
}
