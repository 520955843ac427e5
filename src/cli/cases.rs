//! The fitness cases of a run, in their parts.

use std::path::Path;

use vsonar::dataset::{Dataset, Variation};

use super::CliError;
use super::memory::Need;

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
    /// The fields of the table `[data]` with the fingerprints of the cases that the checkpoint does not guard.
    pub(crate) const FINGERPRINTS: [&str; 2] = ["holdout_fingerprint", "validation_fingerprint"];

    fn guarded(&self) -> [(&'static str, &'static str, &Option<Dataset>); 2] {
        let [holdout, validation] = Cases::FINGERPRINTS;
        [(holdout, "held-out", &self.holdout), (validation, "validation", &self.validation)]
    }

    /// The fingerprints as they are recorded.
    pub(crate) fn fingerprints(&self) -> impl Iterator<Item = (String, toml::Value)> {
        let of = |set: &Dataset| toml::Value::String(format!("{:016x}", set.fingerprint()));
        self.guarded()
            .into_iter()
            .filter_map(move |(name, _, set)| Some((name.to_string(), of(set.as_ref()?))))
    }

    /// Whether the validation and held-out cases are those that the table `[data]` of a run folder was made with; the
    /// training cases are guarded by the checkpoint.
    pub(crate) fn check(&self, table: &toml::Table, run: &Path) -> Result<(), CliError> {
        let now: toml::Table = self.fingerprints().collect();
        for (name, what, _) in self.guarded() {
            if table.get(name).is_some_and(|then| now.get(name) != Some(then)) {
                return Err(CliError::Failed(format!(
                    "{}: the run was made with other {what} data; resume with the data named there, unchanged, or \
                     start a new run",
                    run.join("settings.toml").display()
                )));
            }
        }
        Ok(())
    }

    /// What the parts there are need in a run that alters copies of the training images so. At the end of a run all
    /// are in memory.
    pub(crate) fn needs(&self, variation: &Variation) -> impl Iterator<Item = Need> {
        let others = self.validation.iter().chain(&self.holdout);
        std::iter::once(Need::grown(&self.train, variation)).chain(others.map(Need::of))
    }
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
        // What was not recorded is not held against anything.
        let table: toml::Table = cases(None, None).fingerprints().collect();
        assert!(check(cases(Some(2), None), &table).is_ok());
    }
}
