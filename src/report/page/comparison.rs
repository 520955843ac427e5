//! Several runs compared: which belong together, their medians and quartiles, and one setting against another.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet};

use super::folder::flat;
use super::model::{Comparison, Pair, Part, Run, Setting};
use super::parts::none;
use crate::evolve::{Record, Settings};
use crate::report::short_names;
use crate::statistics::{Quartiles, a12, holm, rank_sum};

impl Comparison {
    /// Compares runs. `settings` are theirs, in the same order. Runs of the same settings but for the seed, on the same
    /// data, belong together; with the same seed too they are one run, of which the one that got further counts.
    pub fn of(runs: &[Run], settings: &[Settings]) -> Comparison {
        let keys: Vec<BTreeMap<String, String>> = (runs.iter().zip(settings))
            .map(|(run, settings)| {
                let mut key = flat(settings);
                key.remove("seed");
                key.insert("data".to_string(), run.data.clone());
                key.extend(run.data_table.clone());
                key
            })
            .collect();
        let mut groups: Vec<(usize, Vec<usize>)> = Vec::new();
        for (i, key) in keys.iter().enumerate() {
            match groups.iter_mut().find(|(first, _)| keys[*first] == *key) {
                Some((_, members)) => members.push(i),
                None => groups.push((i, vec![i])),
            }
        }
        let mut again = Vec::new();
        for (_, members) in &mut groups {
            let further = |i: usize| (runs[i].records.len(), Reverse(i));
            let same = |i: usize| members.iter().copied().filter(move |&j| runs[j].seed == runs[i].seed);
            let counts = |i: usize| same(i).max_by_key(|&j| further(j)).unwrap_or(i);
            let all = members.clone();
            again.extend(all.iter().map(|&i| (i, counts(i))).filter(|(i, first)| i != first));
            let kept: Vec<usize> = all.into_iter().filter(|&i| counts(i) == i).collect();
            *members = kept;
        }
        again.sort_unstable();
        let value = |key: &BTreeMap<String, String>, name: &str| key.get(name).cloned().unwrap_or_else(none);
        let mut names: Vec<&String> = keys.iter().flat_map(BTreeMap::keys).collect();
        names.sort_unstable();
        names.dedup();
        names.retain(|name| {
            groups.iter().any(|(first, _)| value(&keys[*first], name) != value(&keys[0], name))
        });
        // Presets are the shortest names, where they tell all settings apart.
        let preset = |i: usize| runs[groups[i].0].preset;
        let presets: BTreeSet<&str> = (0..groups.len()).map(preset).collect();
        let by_preset = presets.len() == groups.len();
        let run_names = self::names(runs);
        let setting = |(first, members): (usize, Vec<usize>)| {
            let values: Vec<(String, String)> =
                names.iter().map(|name| (name.to_string(), value(&keys[first], name))).collect();
            let words: Vec<String> = values.iter().map(|(name, value)| format!("{name} = {value}")).collect();
            let name = match &words[..] {
                [] => "all runs".to_string(),
                [one] if one.len() < 50 => one.replace("data = ", ""),
                _ if by_preset => runs[first].preset.to_string(),
                _ => together(&members.iter().map(|&run| &run_names[run][..]).collect::<Vec<_>>()),
            };
            Setting::of(name, values, members, runs)
        };
        let settings: Vec<Setting> = groups.iter().cloned().map(setting).collect();
        let parts = [Part::Holdout, Part::Validation, Part::Training];
        // A run that goes on has nothing held out yet; it does not take the test from those that have.
        let scored = |run: usize, part: Part| runs[run].scores.iter().any(|s| s.part == part);
        let everywhere = |part: &Part| {
            settings.iter().all(|setting| {
                let mut complete = setting.runs.iter().filter(|&&run| runs[run].is_complete()).peekable();
                complete.peek().is_some() && complete.all(|&run| scored(run, *part))
            })
        };
        let logged = |part: &Part| (0..runs.len()).all(|run| scored(run, *part));
        let part = parts.into_iter().find(everywhere).or_else(|| parts.into_iter().find(logged));
        let part = part.filter(|_| settings.len() > 1);
        let pairs = part.map_or_else(Vec::new, |part| pairs(&settings, runs, part));
        Comparison { settings, part, pairs, again }
    }
}

/// What runs are called on a page: the names of their folders, as long as it takes to tell them apart.
pub(super) fn names(runs: &[Run]) -> Vec<String> {
    short_names(&runs.iter().map(|run| &run.folder).collect::<Vec<_>>())
}

/// Runs by their names, in a few words.
fn together(names: &[&str]) -> String {
    match names {
        [] => none(),
        [one] => one.to_string(),
        [one, other] => format!("{one}, {other}"),
        [first, .., last] => format!("{first} to {last}"),
    }
}

/// The winners' fitnesses of a setting on a part.
pub(super) fn scores(setting: &Setting, runs: &[Run], part: Part) -> Vec<f64> {
    let of = |&run: &usize| runs[run].scores.iter().find(|s| s.part == part).map(|s| s.fitness);
    setting.runs.iter().filter_map(of).collect()
}

/// The setting with its complete runs alone, if it has any: how others do so far tells little.
fn complete(setting: &Setting, runs: &[Run]) -> Setting {
    let complete: Vec<usize> = setting.runs.iter().copied().filter(|&run| runs[run].is_complete()).collect();
    let runs = if complete.is_empty() { setting.runs.clone() } else { complete };
    Setting { runs, ..setting.clone() }
}

fn pairs(settings: &[Setting], runs: &[Run], part: Part) -> Vec<Pair> {
    let mut pairs = Vec::new();
    for first in 0..settings.len() {
        for second in first + 1..settings.len() {
            // Scores on different images tell nothing of settings.
            let data = |setting: usize| {
                settings[setting].runs.first().map(|&run| (&runs[run].data, &runs[run].data_table))
            };
            if data(first) != data(second) {
                continue;
            }
            let [a, b] =
                [first, second].map(|setting| scores(&complete(&settings[setting], runs), runs, part));
            if let (Some(effect), Some(p)) = (a12(&a, &b), rank_sum(&a, &b)) {
                pairs.push(Pair { first, second, a12: effect.0, p, corrected: p });
            }
        }
    }
    let corrected = holm(&pairs.iter().map(|pair| pair.p).collect::<Vec<_>>());
    pairs.iter_mut().zip(corrected).for_each(|(pair, corrected)| pair.corrected = corrected);
    pairs
}

impl Setting {
    fn of(name: String, values: Vec<(String, String)>, members: Vec<usize>, runs: &[Run]) -> Setting {
        let mut setting = Setting {
            name,
            values,
            parts: Vec::new(),
            best: over(&members, runs, |r| r.best_fitness_so_far),
            mean: over(&members, runs, |r| r.mean_fitness),
            nodes: over(&members, runs, |r| r.mean_nodes),
            winner_nodes: None,
            seconds: None,
            runs: members,
        };
        for part in [Part::Training, Part::Validation, Part::Holdout] {
            if let Some(quartiles) = Quartiles::of(&scores(&setting, runs, part)) {
                setting.parts.push((part, quartiles));
            }
        }
        let sample = |of: &dyn Fn(&Run) -> Option<f64>| {
            Quartiles::of(&setting.runs.iter().filter_map(|&run| of(&runs[run])).collect::<Vec<_>>())
        };
        let nodes = sample(&|run| Some(run.program.as_ref()?.nodes as f64));
        let seconds = sample(&|run| Some(run.records.iter().map(|r| r.timing.wall).sum()));
        (setting.winner_nodes, setting.seconds) = (nodes, seconds);
        setting
    }
}

/// Quartiles over the runs that have a generation, generation by generation.
fn over(members: &[usize], runs: &[Run], of: fn(&Record) -> f64) -> Vec<Quartiles> {
    let longest = members.iter().map(|&run| runs[run].records.len()).max().unwrap_or(0);
    let at = |generation: usize| {
        let there = members.iter().filter_map(|&run| runs[run].records.get(generation));
        Quartiles::of(&there.map(of).collect::<Vec<_>>())
    };
    (0..longest).filter_map(at).collect()
}
