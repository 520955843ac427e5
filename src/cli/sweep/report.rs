//! What a sweep has found: medians and quartiles of the settings, and how they compare with the baseline.

use std::fmt;
use std::path::PathBuf;

use serde::Serialize;
use vsonar::evolve::rank;
use vsonar::statistics::{A12, Magnitude, Quartiles, a12, holm, rank_sum};

use super::super::output::{duration, grouped, percent};
use super::super::table::Table;
use super::row::{Part, Row};

/// The report, as text and as JSON.
#[derive(Debug, Serialize)]
pub(crate) struct Report {
    pub(crate) title: Option<String>,
    pub(crate) results: PathBuf,
    pub(crate) runs: usize,
    pub(crate) complete: bool,
    /// Whether the held-out cases were looked at.
    pub(crate) test: bool,
    pub(crate) data: Vec<OfData>,
}

/// The settings on a data set.
#[derive(Debug, Serialize)]
pub(crate) struct OfData {
    name: String,
    settings: Vec<OfSetting>,
    baseline: String,
    comparisons: Vec<Comparison>,
}

/// The runs of a setting.
#[derive(Debug, Serialize)]
struct OfSetting {
    name: String,
    runs: usize,
    train: Option<Scores>,
    validation: Option<Scores>,
    holdout: Option<Scores>,
    /// What the winner of the run that is best in validation reaches on the held-out cases.
    chosen_holdout: Option<f64>,
    /// Runs that had collapsed at their end.
    collapsed: usize,
    fresh: Option<Quartiles>,
    nodes: Option<Quartiles>,
    seconds: Option<Quartiles>,
}

/// The shares that the runs of a setting reach on a part.
#[derive(Debug, Serialize)]
struct Scores {
    #[serde(flatten)]
    quartiles: Quartiles,
    /// The share of the best constant per column; none if it differs between runs.
    constant_per_column: Option<f64>,
}

/// A setting beside the baseline.
#[derive(Debug, Serialize)]
struct Comparison {
    setting: String,
    train: Option<Difference>,
    validation: Option<Difference>,
    holdout: Option<Difference>,
}

/// How two settings differ on a part.
#[derive(Debug, Clone, Copy, Serialize)]
struct Difference {
    /// The probability that a run of the setting is better than one of the baseline.
    a12: A12,
    magnitude: Magnitude,
    p: f64,
    /// Corrected for the comparisons on this part of this data set.
    p_holm: f64,
}

fn of_part<T: Copy>(part: Part, train: T, validation: T, holdout: T) -> T {
    match part {
        Part::Train => train,
        Part::Validation => validation,
        Part::Holdout => holdout,
    }
}

/// What the winner of the run that is best in validation reaches on the held-out cases; of equal runs that which is best
/// in training, then the smallest, then the first.
fn chosen(rows: &[&Row]) -> Option<f64> {
    let validated = rows.iter().filter_map(|row| Some((row.validation_fitness?, row)));
    let (_, best) = validated.min_by_key(|(v, row)| rank(*v, row.train_fitness, row.nodes, row.seed))?;
    best.holdout_fitness
}

impl OfData {
    /// The settings of these names on a data set, the one at `baseline` being what the others are compared with. Of
    /// the held-out part nothing is said without `test`.
    pub(crate) fn new(name: &str, settings: &[&str], baseline: usize, rows: &[&Row], test: bool) -> OfData {
        let parts = Part::ALL.into_iter().filter(|&part| test || part != Part::Holdout);
        let of = |setting: &str| -> Vec<&Row> {
            rows.iter().copied().filter(|row| row.data == name && row.setting == setting).collect()
        };
        let sample = |setting: &str, part: Part| -> Vec<f64> {
            of(setting).iter().filter_map(|row| row.fitness(part)).collect()
        };
        let base = settings.get(baseline).copied().unwrap_or_default();
        let others: Vec<&str> =
            settings.iter().copied().filter(|&s| s != base && !of(s).is_empty()).collect();
        let mut comparisons: Vec<Comparison> = others
            .iter()
            .map(|&s| Comparison { setting: s.to_string(), train: None, validation: None, holdout: None })
            .collect();
        for part in parts.clone() {
            let against = sample(base, part);
            let found: Vec<(usize, A12, f64)> = (others.iter().enumerate())
                .filter_map(|(i, &s)| {
                    let sample = sample(s, part);
                    Some((i, a12(&sample, &against)?, rank_sum(&sample, &against)?))
                })
                .collect();
            let corrected = holm(&found.iter().map(|f| f.2).collect::<Vec<_>>());
            for ((i, a12, p), p_holm) in found.into_iter().zip(corrected) {
                let difference = Some(Difference { a12, magnitude: a12.magnitude(), p, p_holm });
                let Comparison { train, validation, holdout, .. } = &mut comparisons[i];
                *match part {
                    Part::Train => train,
                    Part::Validation => validation,
                    Part::Holdout => holdout,
                } = difference;
            }
        }
        comparisons.retain(|c| c.train.is_some() || c.validation.is_some() || c.holdout.is_some());
        let settings = settings.iter().filter(|s| !of(s).is_empty()).map(|&s| {
            let rows = of(s);
            let scores = |part: Part| -> Option<Scores> {
                if part == Part::Holdout && !test {
                    return None;
                }
                let constants: Vec<f64> = rows.iter().filter_map(|row| row.constant(part)).collect();
                Some(Scores {
                    quartiles: Quartiles::of(&sample(s, part))?,
                    constant_per_column: constants
                        .first()
                        .copied()
                        .filter(|c| constants.iter().all(|d| d == c)),
                })
            };
            let numbers =
                |of: &dyn Fn(&Row) -> f64| Quartiles::of(&rows.iter().map(|r| of(r)).collect::<Vec<_>>());
            OfSetting {
                name: s.to_string(),
                runs: rows.len(),
                train: scores(Part::Train),
                validation: scores(Part::Validation),
                holdout: scores(Part::Holdout),
                chosen_holdout: if test { chosen(&rows) } else { None },
                collapsed: rows.iter().filter(|row| row.warning.is_some()).count(),
                fresh: numbers(&|r| r.fresh as f64),
                nodes: numbers(&|r| r.nodes as f64),
                seconds: numbers(&|r| r.seconds),
            }
        });
        OfData {
            name: name.to_string(),
            settings: settings.collect(),
            baseline: base.to_string(),
            comparisons,
        }
    }

    fn scores(&self) -> Table {
        let scores = |s: &'_ OfSetting, part| -> Option<[String; 3]> {
            let q = of_part(part, &s.train, &s.validation, &s.holdout).as_ref()?.quartiles;
            Some([percent(q.median), between(q), percent(q.max)])
        };
        let parts: Vec<Part> =
            Part::ALL.into_iter().filter(|&p| self.settings.iter().any(|s| scores(s, p).is_some())).collect();
        let mut headings = vec!["setting", "runs"];
        parts.iter().for_each(|part| headings.extend([part.name(), "quartiles", "best"]));
        let chosen = self.settings.iter().any(|s| s.chosen_holdout.is_some());
        headings.extend(chosen.then_some("of the best in validation"));
        let collapsed = self.settings.iter().any(|s| s.collapsed > 0);
        headings.extend(collapsed.then_some("collapsed"));
        headings.extend(["programs run", "nodes", "seconds"]);
        let mut table = Table::new(1, &headings);
        let median = |q: &Option<Quartiles>| q.map_or(0.0, |q| q.median);
        for setting in &self.settings {
            let mut cells = vec![setting.name.clone(), setting.runs.to_string()];
            parts.iter().for_each(|&part| cells.extend(scores(setting, part).unwrap_or_default()));
            if chosen {
                cells.push(setting.chosen_holdout.map_or(String::new(), percent));
            }
            if collapsed {
                cells.push(format!("{} of {}", setting.collapsed, setting.runs));
            }
            cells.push(grouped(median(&setting.fresh) as u64));
            cells.push(grouped(median(&setting.nodes) as u64));
            cells.push(format!("{:.1}", median(&setting.seconds)));
            table.row(cells);
        }
        let constant = |part: Part| -> Option<f64> {
            let of = |s: &'_ OfSetting| {
                of_part(part, &s.train, &s.validation, &s.holdout).as_ref()?.constant_per_column
            };
            let first = of(self.settings.first()?)?;
            self.settings.iter().all(|s| of(s) == Some(first)).then_some(first)
        };
        let mut cells = vec!["best constant per column".to_string(), String::new()];
        for &part in &parts {
            cells.extend([constant(part).map_or(String::new(), percent), String::new(), String::new()]);
        }
        table.row(cells);
        table
    }

    fn differences(&self) -> Table {
        let of = |c: &Comparison, part| of_part(part, c.train, c.validation, c.holdout);
        let parts: Vec<Part> =
            Part::ALL.into_iter().filter(|&p| self.comparisons.iter().any(|c| of(c, p).is_some())).collect();
        let mut headings = vec!["setting"];
        parts.iter().for_each(|part| headings.extend([part.name(), "", "p"]));
        let mut table = Table::new(1, &headings);
        for comparison in &self.comparisons {
            let mut cells = vec![comparison.setting.clone()];
            for &part in &parts {
                match of(comparison, part) {
                    None => cells.extend([String::new(), String::new(), String::new()]),
                    Some(d) => {
                        cells.extend([format!("{:.2}", d.a12.0), d.magnitude.to_string(), p_value(d.p_holm)])
                    }
                }
            }
            table.row(cells);
        }
        table
    }
}

/// The quartiles as percentages.
pub(crate) fn between(q: Quartiles) -> String {
    format!("{:.1} to {:.1}", 100.0 * q.lower, 100.0 * q.upper)
}

fn p_value(p: f64) -> String {
    if p < 0.001 { "< 0.001".to_string() } else { format!("{p:.3}") }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(title) = &self.title {
            writeln!(f, "\n{title}")?;
        }
        for data in &self.data {
            writeln!(f, "\n{}: medians over the seeds\n", data.name)?;
            write!(f, "{}", data.scores())?;
            if !data.settings.is_empty() && data.settings.iter().all(|s| s.name != data.baseline) {
                writeln!(f, "\nThere is no run of the baseline `{}` to compare these with.", data.baseline)?;
            }
            if !data.comparisons.is_empty() {
                writeln!(f, "\n{}, against `{}`: A12 and p\n", data.name, data.baseline)?;
                write!(f, "{}", data.differences())?;
            }
        }
        if self.data.iter().any(|data| !data.comparisons.is_empty()) {
            writeln!(
                f,
                "\nA12 (Vargha and Delaney): how likely a run of the setting is better than one of the baseline; 0.5 is no \
                 difference. p: rank-sum test, two-sided, corrected by Holm for the comparisons in its column."
            )?;
        }
        Ok(())
    }
}

/// How a run went, in a few words.
pub(crate) fn line(row: &Row, test: bool) -> String {
    let parts = Part::ALL.into_iter().filter(|&part| test || part != Part::Holdout);
    let scores = parts.filter_map(|part| Some(format!("{} {}", part.name(), percent(row.fitness(part)?))));
    let scores: Vec<String> = scores.collect();
    format!(
        "{}, {}, seed {}: {} ({})",
        row.data,
        row.setting,
        row.seed,
        scores.join(", "),
        duration(row.seconds)
    )
}

#[cfg(test)]
mod tests {
    use super::super::results::tests::row;
    use super::*;

    fn rows() -> Vec<Row> {
        let mut rows: Vec<Row> = (1..=4).map(|seed| row("default", seed, 60 + seed as u32)).collect();
        rows.extend((1..=4).map(|seed| row("better", seed, 70 + seed as u32)));
        rows.extend((1..=4).map(|seed| row("same", seed, 60 + seed as u32)));
        rows
    }

    #[test]
    fn by_hand() {
        let rows = rows();
        let rows: Vec<&Row> = rows.iter().collect();
        let of = OfData::new("corridor", &["default", "better", "same", "never run"], 0, &rows, false);
        let default = &of.settings[0];
        let quartiles = default.train.as_ref().expect("trained").quartiles;
        assert_eq!((default.runs, quartiles.max), (4, 0.64));
        assert!((quartiles.median - 0.625).abs() < 1e-12 && (quartiles.lower - 0.6175).abs() < 1e-12);
        assert_eq!(of.comparisons.len(), 2, "not with itself, nor with what never ran");
        let better = of.comparisons[0].train.expect("both ran");
        // All 16 pairs are won: 2 of the 70 orders are as extreme; of two comparisons the smaller p counts double.
        assert_eq!((better.a12.0, better.magnitude), (1.0, Magnitude::Large));
        assert!((better.p - 2.0 / 70.0).abs() < 1e-12 && (better.p_holm - 4.0 / 70.0).abs() < 1e-12);
        let same = of.comparisons[1].train.expect("both ran");
        assert_eq!((same.a12.0, same.p_holm), (0.5, 1.0));
        assert!(of.comparisons[0].validation.is_none() && of.comparisons[0].holdout.is_none());
    }

    #[test]
    fn without_the_baseline_nothing_is_compared() {
        let rows = rows();
        let report = |baseline, rows: &[&Row]| {
            let data = vec![OfData::new("corridor", &["default", "better", "same"], baseline, rows, false)];
            Report { title: None, results: "r".into(), runs: 4, complete: true, test: false, data }
                .to_string()
        };
        let all: Vec<&Row> = rows.iter().collect();
        let text = report(0, &all);
        assert!(text.contains("against `default`") && !text.contains("no run of the baseline"), "{text}");
        let text = report(0, &all[4..8]);
        assert!(text.contains("no run of the baseline `default`") && !text.contains("A12"), "{text}");
        assert!(!report(0, &[]).contains("baseline"), "there is nothing to compare");
    }

    #[test]
    fn collapsed_runs_are_told() {
        let mut rows = rows();
        let table = |rows: &[Row]| {
            let rows: Vec<&Row> = rows.iter().collect();
            OfData::new("corridor", &["default", "better"], 0, &rows, false).scores().to_string()
        };
        assert!(!table(&rows).contains("collapsed"));
        rows[1].warning = Some(vsonar::evolve::Collapse::Bloat);
        let text = table(&rows);
        for part in ["collapsed", "1 of 4", "0 of 4"] {
            assert!(text.contains(part), "{part}: {text}");
        }
    }

    #[test]
    fn validation_chooses_among_runs() {
        let mut rows = rows();
        // Seeds 2 and 4 are best in validation, and seed 4 was fitter in training.
        for (row, (validation, holdout)) in
            rows.iter_mut().zip([(0.5, 0.9), (0.6, 0.8), (0.1, 0.7), (0.6, 0.45)])
        {
            (row.validation_fitness, row.holdout_fitness) = (Some(validation), Some(holdout));
        }
        let rows: Vec<&Row> = rows.iter().collect();
        let of = |test| OfData::new("corridor", &["default", "better"], 0, &rows, test);
        assert_eq!(of(true).settings[0].chosen_holdout, Some(0.45));
        assert_eq!(of(true).settings[1].chosen_holdout, None, "without validation nothing is chosen");
        assert_eq!(of(false).settings[0].chosen_holdout, None);
        let table = of(true).scores().to_string();
        assert!(table.contains("of the best in validation") && table.contains("45.0 %"), "{table}");
    }

    #[test]
    fn the_held_out_part_is_said_only_if_asked_for() {
        let mut rows = rows();
        rows.iter_mut().for_each(|row| row.holdout_fitness = Some(0.123));
        let rows: Vec<&Row> = rows.iter().collect();
        for test in [false, true] {
            let data = vec![OfData::new("corridor", &["default", "better"], 0, &rows, test)];
            let report = Report { title: None, results: "r".into(), runs: 8, complete: true, test, data };
            let (text, json) = (report.to_string(), serde_json::to_string(&report).expect("JSON"));
            assert_eq!(text.contains("12.3 %") && text.contains("held out"), test, "{text}");
            assert_eq!(json.contains("0.123"), test, "{json}");
            assert_eq!(line(rows[0], test).contains("12.3 %"), test);
        }
    }
}
