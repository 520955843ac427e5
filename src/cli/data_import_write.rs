//! Writing a data folder from pictures that were found, and what is said about it.

use std::io::Cursor;
use std::sync::atomic::{AtomicBool, Ordering};

use image::ImageFormat;
use rayon::prelude::*;
use serde::Serialize;
use vsonar::dataset::import::{
    Classes, Found, ImportError, Item, Labelled, LeftOut, Names, SkippedObjects, ValueCounts, View,
};
use vsonar::dataset::{self, CheckReport};
use vsonar::memory::stretches;
use vsonar::support::printable;

use super::data_import::Wanted;
use super::data_import_values::ValueReport;
use super::new_folder::NewFolder;
use super::output::{self, count, shell_word};
use super::progress::{Bar, Style};
use super::{CliError, interrupt, large};

/// What was done.
#[derive(Serialize)]
struct Summary {
    images: usize,
    cases: usize,
    /// Columns without a case, because their labels depend on ignored pixels.
    undecided: usize,
    left_out: Vec<LeftOut>,
    /// Objects that do not count, by the reason.
    skipped_objects: SkippedObjects,
    /// What is wrong with objects that were asked for, and left out.
    dropped_objects: Vec<String>,
    /// The values of masks.
    #[serde(skip_serializing_if = "Option::is_none")]
    values: Option<ValueReport>,
    check: CheckReport,
}

/// Pictures between two looks at Ctrl-C, which are in memory together.
const AT_A_TIME: usize = 16;

/// How many pictures that were left out are named.
const SHOWN: usize = 10;

/// Writes the folder and reports on it. `classes` are those of masks; `no_ground` says what may be wrong if nothing is
/// ground, of the values that the masks have.
pub(super) fn write(
    found: Found,
    wanted: Wanted,
    mut folder: NewFolder,
    classes: Option<&Classes>,
    no_ground: impl Fn(&ValueCounts) -> String,
) -> Result<(), CliError> {
    let Found { items, mut left_out, faulty, faulty_objects, skipped, .. } = found;
    let mut faults = faulty.iter().map(|(_, fault)| fault).chain(&faulty_objects);
    if let Some(first) = faults.next().filter(|_| !wanted.skip_faulty) {
        let more = match faults.count() {
            0 => String::new(),
            more => format!("\nand {} more", count(more as u64, "fault")),
        };
        // Without these no image would be left.
        let skip = if items.is_empty() { "nothing was written" } else { SKIP };
        return Err(CliError::Failed(format!("{first}{more}\n{skip}")));
    }
    let dropped: Vec<String> = faulty_objects.iter().map(ToString::to_string).collect();
    left_out.extend(faulty.into_iter().map(|(name, error)| LeftOut { name, reason: error.to_string() }));
    let view = wanted.view.view();
    // A fault of the first picture is told when its turn comes.
    let Some(size) = view.size.or_else(|| items.iter().find_map(|item| item.size(&view).ok())) else {
        return Err(nothing(&items, &view, &left_out));
    };
    let columns = wanted.columns.of(size.0)?;
    if let Some(i) = (1..columns.len()).find(|&i| columns[..i].contains(&columns[i])) {
        return Err(CliError::Usage(format!("--columns: {} is there twice", columns[i])));
    }
    let stop = interrupt::stop_flag()?;
    folder.make()?;
    let mut names = Names::default();
    let mut table = csv::Writer::from_writer(Vec::new());
    table.write_record(["image", "x", "y"])?;
    let (mut images, mut cases, mut undecided, mut any_ground) = (0, 0, 0, false);
    let mut values = ValueCounts::default();
    let bar = Bar::counting(Style::of(wanted.json), items.len() as u64, "images");
    let memory: Vec<u64> = items.par_iter().map(Item::memory_needed).collect();
    let limit = wanted.memory.limit();
    if let Some((item, &bytes)) = items.iter().zip(&memory).find(|&(_, &bytes)| bytes > limit) {
        return Err(CliError::Failed(format!(
            "{}: reading the picture takes about {} of memory, more than the limit; scale it down, or raise the limit with \
             `--memory`",
            item.name,
            mib(bytes)
        )));
    }
    let stretches = stretches(&memory, limit);
    for part in stretches.iter().flat_map(|stretch| items[stretch.clone()].chunks(AT_A_TIME)) {
        if stop.load(Ordering::Relaxed) {
            return Err(CliError::Interrupted("interrupted; nothing was written".to_string()));
        }
        let made: Vec<_> = part.par_iter().map(|item| labelled(item, &view, size, &columns, &stop)).collect();
        for (item, made) in part.iter().zip(made) {
            match made {
                Err(error) if wanted.skip_faulty => {
                    left_out.push(LeftOut { name: item.name.clone(), reason: error.to_string() });
                }
                Err(error) => {
                    return Err(CliError::Failed(format!("{error}\n{SKIP}")));
                }
                Ok((labelled, png)) => {
                    undecided += labelled.undecided;
                    any_ground |= labelled.any_ground;
                    values.extend(&labelled.values);
                    if labelled.labels.is_empty() {
                        let reason = "every label asked for depends on ignored pixels".to_string();
                        left_out.push(LeftOut { name: item.name.clone(), reason });
                        continue;
                    }
                    let name = names.png(&item.name);
                    folder.write(&format!("images/{name}"), &png)?;
                    for (x, y) in &labelled.labels {
                        table.write_record([&name, &x.to_string(), &y.to_string()])?;
                    }
                    (images, cases) = (images + 1, cases + labelled.labels.len());
                }
            }
        }
        bar.advance(part.len() as u64);
    }
    drop(bar);
    if images == 0 {
        return Err(nothing(&items, &view, &left_out));
    }
    if !any_ground {
        return Err(CliError::Failed(no_ground(&values)));
    }
    let table = table.into_inner().map_err(|e| CliError::Failed(e.to_string()))?;
    folder.write("labels.csv", &table)?;
    let check = dataset::check_within(folder.part(), wanted.memory.limit()).moved_to(&wanted.out);
    if !check.is_sound() {
        return Err(CliError::Failed(format!("the new folder would have faults, and is not kept:\n{check}")));
    }
    if stop.load(Ordering::Relaxed) {
        return Err(CliError::Interrupted("interrupted; nothing was written".to_string()));
    }
    folder.finish()?;
    left_out.sort();
    let (skipped_objects, dropped_objects) = (skipped, dropped);
    let values = classes.map(|classes| ValueReport::new(&values, classes));
    let summary =
        Summary { images, cases, undecided, left_out, skipped_objects, dropped_objects, values, check };
    if wanted.json { output::print_json(&summary) } else { output::print(&text(&summary, &wanted)) }
}

const SKIP: &str = "nothing was written; `--skip-faulty` leaves out what is wrong";

/// The picture with its labels, and as a PNG file.
fn labelled(
    item: &Item,
    view: &View,
    size: (u32, u32),
    columns: &[u32],
    stop: &AtomicBool,
) -> Result<(Labelled, Vec<u8>), ImportError> {
    let labelled = item.labelled(view, size, columns)?;
    let mut png = Cursor::new(Vec::new());
    // Encoding into memory fails only where there is none; then writing the file tells.
    if !stop.load(Ordering::Relaxed) {
        let _ = labelled.pixels.write_to(&mut png, ImageFormat::Png);
    }
    Ok((labelled, png.into_inner()))
}

fn mib(bytes: u64) -> String {
    format!("{} MiB", output::grouped(bytes.div_ceil(1 << 20)))
}

/// Why there is nothing to write.
fn nothing(items: &[Item], view: &View, left_out: &[LeftOut]) -> CliError {
    let fault = items.first().and_then(|item| item.size(view).err());
    let reason = match (fault, left_out) {
        (Some(fault), _) => fault.to_string(),
        (None, []) => "nothing of this kind was found there; check the paths".to_string(),
        (None, left_out) => {
            format!("{} left out:\n{}", count(left_out.len() as u64, "file"), named(left_out))
        }
    };
    CliError::Failed(format!("there is no image to import: {reason}"))
}

/// The first ones that were left out, a line each.
fn named(left_out: &[LeftOut]) -> String {
    let line = |LeftOut { name, reason }: &LeftOut| {
        format!("  {}: {}\n", printable::line(name), printable::line(reason))
    };
    let mut text: String = left_out.iter().take(SHOWN).map(line).collect();
    if left_out.len() > SHOWN {
        text += &format!("  and {} more\n", left_out.len() - SHOWN);
    }
    text
}

fn text(summary: &Summary, wanted: &Wanted) -> String {
    let Summary { images, cases, undecided, left_out, skipped_objects, dropped_objects, values, check } =
        summary;
    let mut text =
        format!("{check}\nimported  {}, {}\n", count(*images as u64, "image"), count(*cases as u64, "case"));
    if *undecided > 0 {
        text +=
            &format!("no label  {}, which depend on ignored pixels\n", count(*undecided as u64, "column"));
    }
    if let Some(values) = values {
        text += &values.to_string();
    }
    if !left_out.is_empty() {
        text += &format!("left out  {}\n", left_out.len());
        text += &named(left_out);
        if left_out.len() > SHOWN {
            text += "  (`--json` names all of them)\n";
        }
    }
    if skipped_objects.count() > 0 {
        text += &format!("skipped   {}\n", count(skipped_objects.count() as u64, "object"));
        for (reason, objects, first) in skipped_objects.reasons().take(SHOWN) {
            text += &format!("  {objects} {reason}, the first at {first}\n");
        }
    }
    if !dropped_objects.is_empty() {
        text += &format!(
            "faulty    {}, without which the images were taken\n",
            count(dropped_objects.len() as u64, "object")
        );
        text.extend(dropped_objects.iter().take(SHOWN).map(|fault| format!("  {fault}\n")));
    }
    if let Some(large) = check.size().and_then(|size| large::advice(&wanted.out, size)) {
        text += &format!("note: {large}\n");
    }
    format!("{text}Next: vsonar evolve --data {}\n", shell_word(&wanted.out))
}
