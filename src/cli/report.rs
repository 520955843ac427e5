//! `vsonar report`: all of a run, or of several, as one HTML page.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use vsonar::evolve::{FolderError, Settings};
use vsonar::report::page::{self, Comparison, PictureRoom, Report, Run};
use vsonar::support::printable::ShownPath as _;

use super::CliError;
use super::executor::{Choice, with_stack};
use super::memory::MemoryArgs;
use super::output::{self, Own, count, shell_flag, shell_word};
use super::progress::{Bar, Style};
use super::report_data::{Data, Wanted};
use super::settings::SettingsFile;
use super::source::Source;

const EXAMPLES: &str = "\
Examples:
  vsonar report runs/photos-seed-1                              writes runs/photos-seed-1/report.html
  vsonar report runs/photos-seed-1 --no-rivals --out photos.html
  vsonar report runs/photos-seed-1 --no-explain                 without the program as `if`s and formulas
  vsonar report runs/photos-seed-1 --camera camera.toml         errors by distance in metres
  vsonar report runs/photos-seed-1 --holdout elsewhere          tested on other images
  vsonar report runs/photos-seed-1 runs/photos-seed-2           seeds or settings compared
  vsonar report runs/photos                                     all runs in a folder

The page needs no network and no other file. It is light or dark as the reader's browser is. Of several runs it shows \
medians and quartiles, runs of the same settings together, and each run with its errors and some pictures.";

/// The page.
const PAGE: Own = Own { what: "page", begins: "<!DOCTYPE html>", holds: "" };
/// How deep below a folder runs are looked for.
const LEVELS: u32 = 3;

/// Write a report on a run, or several, as a page
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    /// Run folders, or folders with run folders in them
    #[arg(required = true, value_name = "RUN")]
    runs: Vec<PathBuf>,
    /// The file to write [default: report.html in the (first) folder given]
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Where the training images are now, if they are no longer where the run had them
    #[arg(long, value_name = "DIR")]
    data: Option<PathBuf>,
    /// Test on these images [default: those that the run held out]
    #[arg(long, value_name = "DIR")]
    holdout: Option<PathBuf>,
    /// The camera of the images, for errors by distance [default: that of the world; of folders none]
    #[arg(long, value_name = "FILE")]
    camera: Option<PathBuf>,
    /// Leave out the table of the rivals, which takes longest
    #[arg(long)]
    no_rivals: bool,
    /// Leave out what the best program does, as `vsonar explain` shows it; a very large program takes long
    #[arg(long)]
    no_explain: bool,
    /// The heading [default: the name of the run's folder]
    #[arg(long, value_name = "TEXT")]
    title: Option<String>,
    /// What runs the programs; all give the same answers
    #[arg(long, value_name = "NAME", value_enum, default_value_t = Choice::Auto)]
    executor: Choice,
    #[command(flatten)]
    memory: MemoryArgs,
    /// Print what the page says as JSON; the page is written only with `--out`
    #[arg(long)]
    json: bool,
}

/// Reports on runs.
pub(crate) fn run(args: Args) -> Result<(), CliError> {
    let folders = folders(&args.runs)?;
    let out = match (&args.out, &args.runs[..], args.json) {
        (Some(out), ..) => Some(out.clone()),
        (None, _, true) => None,
        (None, runs, false) => runs.first().map(|first| first.join("report.html")),
    };
    out.as_deref().map_or(Ok(()), |out| PAGE.may_replace(out))?;
    let progress = Bar::spinner(Style::of(false), "reading");
    // Programs are read by recursion.
    let report = with_stack(|| report(&args, &folders, &progress));
    drop(progress);
    let report = report??;
    if let Some(out) = &out {
        let html = page::html(&report)?;
        PAGE.write(out, &html)?;
        if !args.json {
            let size = html.len().div_ceil(1024) as u64;
            output::print(&format!("{}: {} KiB\n", out.shown(), output::grouped(size)))?;
        }
    }
    if !args.json {
        for run in &report.runs {
            let folder = Path::new(&run.folder).shown();
            run.missing.iter().for_each(|missing| output::say(&format!("note: {folder}: {missing}")));
        }
    }
    if args.json { output::print_json(&report) } else { Ok(()) }
}

/// The run folders that are meant: each that is given, or those in it.
fn folders(given: &[PathBuf]) -> Result<Vec<PathBuf>, CliError> {
    let mut all: Vec<PathBuf> = Vec::new();
    let mut known = BTreeSet::new();
    for path in given {
        let mut found = Vec::new();
        below(path, LEVELS, &mut found)?;
        if found.is_empty() {
            return Err(FolderError::NotARun(path.clone()).into());
        }
        // The same folder by another name is no other run.
        let real = |folder: &PathBuf| fs::canonicalize(folder).unwrap_or_else(|_| folder.clone());
        found.retain(|folder| known.insert(real(folder)));
        all.extend(found);
    }
    Ok(all)
}

/// The entries of a table by their dotted names.
fn flatten(name: &str, value: &toml::Value, out: &mut BTreeMap<String, String>) {
    match value {
        toml::Value::Table(table) => {
            table.iter().for_each(|(key, value)| flatten(&format!("{name}.{key}"), value, out));
        }
        value => drop(out.insert(name.to_string(), value.to_string())),
    }
}

fn below(path: &Path, levels: u32, found: &mut Vec<PathBuf>) -> Result<(), CliError> {
    // Whatever it is: reading it says what it should be.
    if path.join("settings.toml").exists() {
        found.push(path.to_path_buf());
        return Ok(());
    }
    if levels == 0 || !path.is_dir() {
        return Ok(());
    }
    let failed = |e: std::io::Error| CliError::file(path, "read the folder", &e);
    let mut inside = Vec::new();
    for entry in fs::read_dir(path).map_err(failed)? {
        let entry = entry.map_err(failed)?;
        // A run that is being made has a hidden name at first.
        if entry.path().is_dir() && !entry.file_name().to_string_lossy().starts_with('.') {
            inside.push(entry.path());
        }
    }
    // seed-2 before seed-10
    inside.sort_by_key(|path| {
        let name = path.display().to_string();
        let stem = name.trim_end_matches(|c: char| c.is_ascii_digit()).to_string();
        (stem.clone(), name[stem.len()..].parse::<u64>().unwrap_or(0), name)
    });
    inside.iter().try_for_each(|path| below(path, levels - 1, found))
}

fn report(args: &Args, folders: &[PathBuf], progress: &Bar) -> Result<Report, CliError> {
    let camera = args.camera.as_deref().map(vsonar::camera::Camera::load).transpose()?;
    let wanted = Wanted {
        data: args.data.as_deref(),
        holdout: args.holdout.as_deref(),
        camera,
        rivals: !args.no_rivals && folders.len() == 1,
        pictures: PictureRoom::of(folders.len()),
        explained: !args.no_explain && folders.len() == 1,
        executor: args.executor.make()?,
        memory: args.memory,
        progress,
    };
    let mut runs: Vec<Run> = Vec::new();
    let mut all_settings: Vec<Settings> = Vec::new();
    let mut data = Data::default();
    for folder in folders {
        progress.message(&format!("{}: reading", folder.shown()));
        if folder.join("best.gp").exists() {
            super::program::file(folder)?;
        }
        let file = SettingsFile::read(&folder.join("settings.toml"))?;
        let settings = file.recorded()?;
        let table = file.data().cloned().unwrap_or_default();
        let source = Source::from_table(&table, file.path());
        let words = source.as_ref().map_or_else(|_| "not known".to_string(), Source::describe);
        let mut run = Run::read(folder, words)?;
        flatten("data", &toml::Value::Table(table.clone()), &mut run.data_table);
        match source {
            Ok(source) => data.fill(&mut run, folder, source, &table, &settings, &wanted)?,
            Err(error) => run.missing.push(format!("The data are not known: {}", error.words())),
        }
        runs.push(run);
        all_settings.push(settings);
    }
    let comparison = (runs.len() > 1).then(|| Comparison::of(&runs, &all_settings));
    let title = args.title.clone().unwrap_or_else(|| match &runs[..] {
        [run] => run.name.clone(),
        runs => count(runs.len() as u64, "run"),
    });
    Ok(Report { title, runs, comparison, command: Some(command(args)) })
}

/// What was typed, in short.
fn command(args: &Args) -> String {
    let mut command = "vsonar report".to_string();
    args.runs.iter().for_each(|run| command += &format!(" {}", shell_word(run)));
    let paths = [("--data", &args.data), ("--holdout", &args.holdout), ("--camera", &args.camera)];
    for (flag, path) in paths.into_iter().chain([("--out", &args.out)]) {
        path.iter().for_each(|path| command += &format!(" {flag} {}", shell_word(path)));
    }
    if args.no_rivals {
        command += " --no-rivals";
    }
    if args.no_explain {
        command += " --no-explain";
    }
    args.title.iter().for_each(|title| command += &format!(" {}", shell_flag("--title", title)));
    command
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_in_folders_are_found_in_the_order_of_their_seeds() {
        let dir = tempfile::tempdir().expect("a temporary folder");
        for name in ["fold-1/seed-10", "fold-1/seed-2", "alone", ".hidden/seed-1", "empty"] {
            fs::create_dir_all(dir.path().join(name)).expect("writable");
        }
        for name in ["fold-1/seed-10", "fold-1/seed-2", "alone", ".hidden/seed-1"] {
            fs::write(dir.path().join(name).join("settings.toml"), "").expect("writable");
        }
        let below = |name: &str| dir.path().join(name);
        let found = folders(&[dir.path().to_path_buf(), below("alone")]).expect("runs");
        assert_eq!(found, [below("alone"), below("fold-1/seed-2"), below("fold-1/seed-10")]);
        let same = folders(&[below("alone"), below("fold-1/../alone"), below("./alone")]).expect("a run");
        assert_eq!(same, [below("alone")], "a run counts once, whatever it is called");
        let error = folders(&[below("empty")]).expect_err("no run");
        assert!(matches!(error, CliError::Failed(text) if text.contains("not a run folder")));
    }
}
