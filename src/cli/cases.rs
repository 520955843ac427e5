//! The fitness cases of a run, in their parts.

use std::path::Path;

use vsonar::dataset::{Dataset, Variation};
use vsonar::vision::GRAY_WEIGHTS;

use super::CliError;
use super::memory::Need;
use vsonar::support::printable::ShownPath as _;

/// The fitness cases of a run.
pub(crate) struct Cases {
    /// What is trained on.
    pub(crate) train: Dataset,
    /// What chooses the winner from the hall of fame.
    pub(crate) validation: Option<Dataset>,
    /// What the winner is tested on at the end.
    pub(crate) holdout: Option<Dataset>,
    /// Images that are in no part, because they are neighbours of some in another.
    pub(crate) left_out: usize,
}

impl Cases {
    /// The fields of the table `[data]` with the fingerprints of the parts.
    pub(crate) const FINGERPRINTS: [&str; 3] =
        ["train_fingerprint", "holdout_fingerprint", "validation_fingerprint"];

    fn guarded(&self) -> [(&'static str, &'static str, Option<&Dataset>); 3] {
        let [train, holdout, validation] = Cases::FINGERPRINTS;
        [
            (train, "training", Some(&self.train)),
            (holdout, "held-out", self.holdout.as_ref()),
            (validation, "validation", self.validation.as_ref()),
        ]
    }

    /// The fingerprints as they are recorded.
    pub(crate) fn fingerprints(&self) -> impl Iterator<Item = (String, toml::Value)> {
        let of = |set: &Dataset| toml::Value::String(format!("{:016x}", set.fingerprint()));
        self.guarded().into_iter().filter_map(move |(name, _, set)| Some((name.to_string(), of(set?))))
    }

    /// Whether no two parts are the same cases, for then one would tell nothing of the other.
    pub(crate) fn check_apart(&self) -> Result<(), CliError> {
        let mut known: Vec<(&str, u64)> = Vec::new();
        for (_, what, set) in self.guarded() {
            let Some(fingerprint) = set.map(Dataset::fingerprint) else { continue };
            if let Some((other, _)) = known.iter().find(|(_, other)| *other == fingerprint) {
                return Err(CliError::Failed(format!(
                    "the {what} data are the {other} data, case for case, and would say nothing of other images; give other \
                     images, another building, or a part of these, such as 20%"
                )));
            }
            known.push((what, fingerprint));
        }
        Ok(())
    }

    /// Whether the cases are those that the table `[data]` of a run folder was made with. What an earlier release did
    /// not record is not held against them.
    pub(crate) fn check(&self, table: &toml::Table, run: &Path) -> Result<(), CliError> {
        self.check_recorded(table, run, |recorded| recorded)
    }

    /// Whether the cases are those, part by part, that the table `[data]` of a run folder names: neither others nor more.
    pub(crate) fn check_all(&self, table: &toml::Table, run: &Path) -> Result<(), CliError> {
        self.check_recorded(table, run, |_| true)
    }

    /// The same for the parts that count, which depends on whether they are recorded.
    fn check_recorded(
        &self,
        table: &toml::Table,
        run: &Path,
        counts: impl Fn(bool) -> bool,
    ) -> Result<(), CliError> {
        let now: toml::Table = self.fingerprints().collect();
        for (name, what, set) in self.guarded() {
            let then = table.get(name);
            if counts(then.is_some()) && now.get(name) != then {
                let folder = table.get("folder").and_then(|folder| folder.get("train")?.as_str());
                let folder = folder.map_or_else(String::new, |dir| format!(" in {dir}"));
                let (settings, run) = (run.join("settings.toml"), super::output::shell_word(run));
                if let Some(weights) = other_gray(table).filter(|_| set.is_some_and(Dataset::has_colour)) {
                    return Err(CliError::Failed(format!(
                        "{}: the {what} data have colour, and the run was made with gray by the weights of {weights}; by those \
                         of {GRAY_WEIGHTS}, as cameras have them, the images{folder} are others now: start a new run \
                         (`vsonar eval {run} --data DIR` tests its program on the images as they are seen now)",
                        settings.shown()
                    )));
                }
                return Err(CliError::Failed(format!(
                    "{}: the run was made with other {what} data than there are now{folder}; put them back as they were, or \
                     start a new run (`vsonar eval {run} --data DIR` tests its program on any images)",
                    settings.shown()
                )));
            }
        }
        Ok(())
    }

    /// What the parts there are need in so many runs at a time that alter copies of the training images so: each run
    /// has copies of its own, all else is shared. At the end of a run all parts are in memory.
    pub(crate) fn needs(&self, variation: &Variation, runs: usize) -> impl Iterator<Item = Need> {
        let others = self.validation.iter().chain(&self.holdout);
        let own = if variation.copies() > 0 { runs.max(1) } else { 1 };
        std::iter::once(Need::grown(&self.train, variation).times(own)).chain(others.map(Need::of))
    }
}

/// The field of the table `[data]` with the weights by which colour became gray.
pub(crate) const GRAY: &str = "gray";

/// The weights by which the images of a run became gray, if they are from a folder and were others than now. Releases
/// that did not record them used those of BT.709.
pub(crate) fn other_gray(table: &toml::Table) -> Option<&str> {
    table.get("folder")?;
    let weights = table.get(GRAY).map_or("BT.709", |weights| weights.as_str().unwrap_or("an unknown kind"));
    Some(weights).filter(|weights| *weights != GRAY_WEIGHTS)
}

#[cfg(test)]
mod tests {
    use vsonar::world::Corridor;

    use super::*;

    #[test]
    fn other_cases_are_told_apart() {
        let small = Corridor { width: 16, height: 16, columns: 1, ..Corridor::default() };
        let cases = |holdout: Option<u64>, validation: Option<u64>| {
            let set = |seed| small.render(seed, 1).expect("possible");
            Cases { train: set(1), validation: validation.map(set), holdout: holdout.map(set), left_out: 0 }
        };
        let table: toml::Table = cases(Some(2), Some(3)).fingerprints().collect();
        let check = |cases: Cases, table| cases.check(table, Path::new("run"));
        assert!(check(cases(Some(2), Some(3)), &table).is_ok());
        for (other, what) in [
            (cases(Some(4), Some(3)), "held-out"),
            (cases(None, Some(3)), "held-out"),
            (cases(Some(2), Some(4)), "validation"),
            (cases(Some(2), None), "validation"),
        ] {
            let error = check(other, &table).expect_err("another");
            assert!(
                matches!(error, CliError::Failed(text) if text.contains("run/settings.toml") && text.contains(what))
            );
        }
        // What was not recorded is not held against anything, unless all is to be the same.
        let table: toml::Table = cases(None, None).fingerprints().collect();
        assert!(check(cases(Some(2), None), &table).is_ok());
        assert!(cases(Some(2), None).check_all(&table, Path::new("run")).is_err());
        assert!(cases(None, None).check_all(&table, Path::new("run")).is_ok());
        let mut other = table.clone();
        other.insert("train_fingerprint".into(), "00".into());
        assert!(check(cases(None, None), &other).is_err());
    }
}
