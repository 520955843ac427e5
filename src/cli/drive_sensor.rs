//! What drives: the program, and what it is held against.

use clap::ValueEnum;
use vsonar::detector::CompiledDetector;
use vsonar::drive::sonar::Sonar;
use vsonar::drive::source::{Camera, RangeSource};
use vsonar::ir::Program;
use vsonar::world::office::{Kind, Office};

use super::CliError;

/// What the program can be held against.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Against {
    /// All of these
    All,
    /// A ring of ideal sonars
    Sonar,
    /// The true rows of the same columns: a detector without error
    Truth,
}

impl Against {
    /// Those asked for, each once, in the order of the list above.
    pub(crate) fn chosen(asked: &[Against]) -> Vec<Against> {
        let is_asked = |one: &Against| asked.contains(&Against::All) || asked.contains(one);
        [Against::Sonar, Against::Truth].into_iter().filter(is_asked).collect()
    }
}

/// One that drives.
#[derive(Debug, Clone)]
pub(crate) enum Sensor {
    /// A program, optimised, with the name of its file.
    Program(String, Box<Program>),
    /// What it is held against. Rivals that are tuned on a training set belong here, too.
    Other(Against),
}

impl Sensor {
    /// Its name in tables and files.
    pub(crate) fn name(&self) -> &str {
        match self {
            Sensor::Program(name, _) => name,
            Sensor::Other(Against::All) => "all",
            Sensor::Other(Against::Sonar) => "sonar",
            Sensor::Other(Against::Truth) => "truth",
        }
    }

    /// The sensor for a run; the seed is that of the building.
    pub(crate) fn make(
        &self,
        office: &Office,
        columns: &[u32],
        median: bool,
        seed: u64,
    ) -> Result<Box<dyn RangeSource>, CliError> {
        let columns = columns.to_vec();
        Ok(match self {
            Sensor::Program(_, program) => {
                let detector = CompiledDetector::compile(program)?;
                Box::new(Camera::with(Box::new(detector), office, columns, median))
            }
            Sensor::Other(Against::Sonar) => Box::new(Sonar::new(seed)),
            Sensor::Other(Against::Truth | Against::All) => Box::new(Camera::with_truth(office, columns)),
        })
    }
}

/// A world by its name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct World(pub(crate) Kind);

/// The worlds by name; the first is the default.
const WORLDS: [(&str, Kind); 2] = [("fmrb", Kind::Fmrb), ("nsh", Kind::Nsh)];

impl World {
    pub(crate) fn name(self) -> &'static str {
        WORLDS.iter().find(|(_, kind)| *kind == self.0).map_or("?", |(name, _)| name)
    }
}

/// Reads the name of a world.
pub(crate) fn world(text: &str) -> Result<World, String> {
    let found = WORLDS.iter().find(|(name, _)| *name == text).map(|&(_, kind)| World(kind));
    found.ok_or_else(|| {
        let names: Vec<String> = WORLDS.iter().map(|(name, _)| format!("`{name}`")).collect();
        format!("there is no such world; there are {}", names.join(" and "))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn worlds_by_name() {
        for (name, _) in WORLDS {
            assert_eq!(world(name).map(World::name), Ok(name));
        }
        assert!(world("mars").expect_err("none").contains("`fmrb` and `nsh`"));
    }

    #[test]
    fn each_once_and_in_order() {
        use Against::{All, Sonar, Truth};
        assert_eq!(Against::chosen(&[]), []);
        assert_eq!(Against::chosen(&[Truth, Sonar, Truth]), [Sonar, Truth]);
        assert_eq!(Against::chosen(&[Truth, All]), Against::chosen(&[All]));
        // Whoever adds a name adds it to `chosen`.
        assert_eq!(Against::chosen(&[All]).len() + 1, Against::value_variants().len());
    }
}
