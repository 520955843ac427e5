//! The individuals that `vsonar bench` measures: those it finds in the store, and for the others an evolution.

use std::path::Path;
use std::sync::atomic::AtomicBool;

use vsonar::benchmark::{Fresh, StoreKey, evolve_fresh};
use vsonar::dataset::Dataset;
use vsonar::evolve::{Evolution, Settings};
use vsonar::support::bounded::Bounded;
use vsonar::support::printable::{self, ShownPath as _};

use super::CliError;
use super::bench::interrupted;
use super::executor::Choice;
use super::output;
use super::progress::Style;
use super::view::View;

/// The fresh individuals of each generation: those that are stored, and for the others an evolution.
pub(crate) fn individuals(
    store: &Path,
    generations: &[u32],
    data: &Dataset,
    settings: &Settings,
    stop: &AtomicBool,
    style: Style,
) -> Result<Vec<Fresh>, CliError> {
    let key = StoreKey { data: data.fingerprint(), settings: settings.fingerprint(), seed: settings.seed };
    let place = |generation: u32| store.join(key.file_name(generation));
    let stored = |&generation: &u32| stored(key, generation, &place(generation));
    let stored: Vec<Option<Fresh>> = generations.iter().map(stored).collect::<Result<_, _>>()?;
    let missing: Vec<u32> =
        generations.iter().zip(&stored).filter(|(_, there)| there.is_none()).map(|(g, _)| *g).collect();
    let mut made = Vec::new();
    if let Some(last) = missing.last() {
        if style == Style::Lines {
            let store = store.shown();
            output::say(&format!("Evolving on {}, to be kept in {store}", printable::line(data.name())));
        }
        // Results do not depend on the executor; the first in the list is the fastest.
        let executor = Choice::all_runnable().into_iter().next();
        let executor = executor.map_or_else(|| Choice::Tree.make(), Ok)?;
        let mut evolution = Evolution::new(data, settings.clone(), executor, 0)?;
        let mut view = View::start(style, &evolution, last + 1, data);
        let fresh = evolve_fresh(&mut evolution, &missing, stop, |record| view.generation(record))?;
        drop(view);
        made = fresh.ok_or_else(interrupted)?;
        std::fs::create_dir_all(store).map_err(|error| CliError::file(store, "make the folder", &error))?;
        for fresh in &made {
            output::write_file(&place(fresh.generation), key.write(fresh).as_bytes())?;
        }
    }
    // Both are in ascending order of their generations.
    let mut made = made.into_iter();
    let all: Vec<Fresh> = stored.into_iter().filter_map(|stored| stored.or_else(|| made.next())).collect();
    match all.iter().find(|fresh| fresh.individuals.is_empty()) {
        None => Ok(all),
        Some(Fresh { generation, .. }) => Err(CliError::Failed(format!(
            "generation {generation} has no individual that an earlier one did not have: choose another generation, \
             a larger population or another seed"
        ))),
    }
}

/// Reads a population that is kept.
const STORED: Bounded = Bounded::to(1 << 30);

/// The individuals of a file, if it is there.
fn stored(key: StoreKey, generation: u32, path: &Path) -> Result<Option<Fresh>, CliError> {
    match STORED.bytes(path) {
        // What is no UTF-8 is no longer what the checksum is of.
        Ok(bytes) => Ok(Some(key.read(generation, path, &String::from_utf8_lossy(&bytes))?)),
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(None),
        Err(error) => Err(CliError::file(path, "read the file", &error)),
    }
}
