//! Fresh individuals as text, so that everyone measures the same ones.
//!
//! The first line is a JSON object: the version, what the individuals were evolved on and how, how many there are, and
//! a CRC-32 of all further lines; then an individual a line, in the one-line form of a `.gp` file.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::population::Fresh;
use crate::support::printable::ShownPath as _;
use crate::tree::Individual;

/// The version of the format.
const VERSION: u32 = 1;

/// Why stored individuals cannot be used.
#[derive(Debug, thiserror::Error)]
#[error(
    "{}: these are not the stored individuals of generation {generation}: {fault}; remove the file, and they are evolved again",
    path.shown()
)]
pub struct StoreError {
    /// The file.
    pub path: PathBuf,
    /// The generation that was looked for.
    pub generation: u32,
    /// What is wrong with it.
    pub fault: String,
}

/// What stored individuals were evolved on and with.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct StoreKey {
    /// Fingerprint of the data.
    pub data: u64,
    /// Fingerprint of the settings.
    pub settings: u64,
    /// Seed of the run; the settings' fingerprint has it too, but a file name should show it.
    pub seed: u64,
}

/// The first line of a file.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
struct Header {
    version: u32,
    #[serde(flatten)]
    key: StoreKey,
    generation: u32,
    individuals: usize,
    crc32: u32,
}

impl StoreKey {
    /// The name of the file for a generation.
    pub fn file_name(&self, generation: u32) -> String {
        let StoreKey { data, settings, seed } = self;
        format!("fresh-{data:016x}-{settings:016x}-seed-{seed}-generation-{generation}.txt")
    }

    /// The text of the file.
    pub fn write(&self, fresh: &Fresh) -> String {
        let lines: String = fresh.individuals.iter().map(|i| format!("{i:#}\n")).collect();
        let header = Header {
            version: VERSION,
            key: *self,
            generation: fresh.generation,
            individuals: fresh.individuals.len(),
            crc32: crc32fast::hash(lines.as_bytes()),
        };
        let header = serde_json::to_string(&header).expect("numbers have a JSON form");
        format!("{header}\n{lines}")
    }

    /// The individuals of a file, whose text this is.
    ///
    /// # Errors
    /// If the file is cut or was changed, or is for another key, generation or version.
    pub fn read(&self, generation: u32, path: &Path, text: &str) -> Result<Fresh, StoreError> {
        let error = |fault: String| StoreError { path: path.to_path_buf(), generation, fault };
        let (header, lines) =
            text.split_once('\n').ok_or_else(|| error("it has no first line".to_string()))?;
        let header: Header = serde_json::from_str(header).map_err(|e| error(format!("line 1: {e}")))?;
        if (header.version, header.key, header.generation) != (VERSION, *self, generation) {
            return Err(error("line 1 is of other data, settings, seed, generation or version".to_string()));
        }
        if crc32fast::hash(lines.as_bytes()) != header.crc32 {
            return Err(error("it was cut or changed, for its checksum does not fit".to_string()));
        }
        let parse = |(number, line): (usize, &str)| {
            line.parse::<Individual>().map_err(|e| error(format!("line {}: {e}", number + 2)))
        };
        let found: Vec<Individual> = lines.lines().enumerate().map(parse).collect::<Result<_, _>>()?;
        if found.len() != header.individuals {
            return Err(error(format!(
                "it has {} individuals instead of {}",
                found.len(),
                header.individuals
            )));
        }
        Ok(Fresh { generation, individuals: found })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_stored_is_found_again_and_nothing_else() {
        let programs = ["(set-a (+ raw -0.25))", "(set-a (atan2 y gradient-sq))"];
        let program = |body| format!("(individual (iterate-up 3x3 x-obstacle {body}))").parse();
        let individuals = programs.map(|body| program(body).expect("a program")).into();
        let fresh = Fresh { generation: 4, individuals };
        let key = StoreKey { data: 1, settings: u64::MAX, seed: 3 };
        let text = key.write(&fresh);
        let read = |key: StoreKey, generation, text: &str| {
            key.read(generation, Path::new("f.txt"), text).map_err(|e| e.to_string())
        };
        assert_eq!(read(key, 4, &text), Ok(fresh.clone()));
        let none = Fresh { generation: 4, individuals: vec![] };
        assert_eq!(read(key, 4, &key.write(&none)), Ok(none));
        let others =
            [StoreKey { data: 2, ..key }, StoreKey { settings: 2, ..key }, StoreKey { seed: 4, ..key }];
        for (other, generation) in others.map(|other| (other, 4)).into_iter().chain([(key, 5)]) {
            assert!(read(other, generation, &text).expect_err("another").contains("of other data"));
            assert_ne!(other.file_name(generation), key.file_name(4));
        }
        for cut in 0..text.len() {
            let error = read(key, 4, &text[..cut]).expect_err("cut");
            assert!(error.starts_with("f.txt: ") && error.contains("remove the file"), "{error}");
        }
        let count = format!("\"individuals\":{}", fresh.individuals.len());
        for (from, to) in
            [("raw", "y"), ("\"version\":1", "\"version\":2"), ("{", "["), (&count, "\"individuals\":9")]
        {
            assert!(text.contains(from) && read(key, 4, &text.replacen(from, to, 1)).is_err(), "{from}");
        }
    }
}
