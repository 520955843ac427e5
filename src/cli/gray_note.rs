//! The note on programs whose images became gray by other weights than images do now.

use std::path::Path;

use vsonar::dataset::any_colour;
use vsonar::support::printable::ShownPath as _;
use vsonar::vision::GRAY_WEIGHTS;

use super::cases::other_gray;
use super::eval_cases::run_of;
use super::output::say;
use super::settings::SettingsFile;

/// Warns if a program is of a run that saw colour by other weights: the images of its folder tell, as far as they are
/// still there.
pub(crate) fn note_gray(program: &Path) {
    let Some(run) = run_of(program) else { return };
    // What is wrong with the settings is told where they are needed.
    let Ok(file) = SettingsFile::read(&run.join("settings.toml")) else { return };
    let table = file.data().cloned().unwrap_or_default();
    let Some(weights) = other_gray(&table) else { return };
    let folder = table.get("folder").and_then(|folder| folder.get("train")?.as_str());
    let colour = folder.and_then(|dir| any_colour(Path::new(dir)));
    let saw = match colour {
        Some(false) => return,
        Some(true) => "its images have colour: evolve it anew",
        None => "if its images had colour, evolve it anew",
    };
    say(&format!(
        "note: {} was evolved with gray by the weights of {weights}, and images and cameras give it by those of \
         {GRAY_WEIGHTS}; {saw}",
        run.shown()
    ));
}
