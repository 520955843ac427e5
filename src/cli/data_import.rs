//! `vsonar data import`: a data folder from annotated pictures.

use std::collections::BTreeSet;
use std::io::{Cursor, IsTerminal};
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};

use clap::Subcommand;
use image::ImageFormat;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use rayon::prelude::*;
use serde::Serialize;
use vsonar::dataset::import::{
    Crop, Found, ImportError, Item, Labelled, Labels, LeftOut, Named, Names, Value, Values, View, coco, labelme, masks,
};
use vsonar::dataset::{self, CheckReport};

use super::new_folder::NewFolder;
use super::output::{self, count, shell_word};
use super::program::size;
use super::run_columns::{self, Columns};
use super::{CliError, interrupt};

const EXAMPLES: &str = "\
Examples:
  vsonar data import masks photos masks --ground 1 --out labelled
  vsonar data import labelme photos --ground floor,rug --size 320x240 --out labelled
  vsonar data import coco instances.json --images photos --obstacle chair,person --out labelled

What is ground is decided for the pixels of the original picture. Then the part `--crop` is cut out and scaled to `--size`,
and the label of a column is the lowest row whose middle is in an original pixel that is not ground. The new folder is
checked as by `vsonar data check`; it appears complete or not at all.";

const MASKS: &str = "\
Examples:
  vsonar data import masks photos masks --ground 7,8 --out labelled
      photos/a.jpg belongs to masks/a.png, in which road (7) and pavement (8) are ground, as in Cityscapes
  vsonar data import masks leftImg8bit/val gtFine/val --image-suffix _leftImg8bit --mask-suffix _gtFine_labelIds \\
      --ground 7,8 --ignore 0,1,2,3 --crop 0,0,2048,850 --size 512x212 --out streets
      Cityscapes itself, without the bonnet of the car
  vsonar data import masks photos masks --ground '#804080' --mask-suffix _color --out labelled

Numbers are the stored gray levels of masks of 1 to 16 bits, or indices into a palette; colours are compared exactly. A
column whose label depends on what ignored pixels are gets none.";

const LABELME: &str = "\
Examples:
  vsonar data import labelme photos --ground floor --out labelled
  vsonar data import labelme a.json b.json --obstacle chair,wall --ignore mirror --out labelled

With `--ground` all is an obstacle but the shapes of these names, with `--obstacle` all is ground but them; of shapes that
cover each other the last one counts. A pixel is in a polygon if its centre is (even-odd rule).";

const COCO: &str = "\
Examples:
  vsonar data import coco instances.json --images photos --ground floor --out labelled
  vsonar data import coco instances.json --images photos --obstacle chair,person --columns 40,160,280 --out labelled

Polygons and run lengths are read, as numbers or as text. Of objects that cover each other an obstacle counts more than
ground. With `--ground`, pictures without any object are left out; with `--obstacle` all of them is ground.";

/// Make a data folder of annotated images: from masks, LabelMe or COCO
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    #[command(subcommand)]
    kind: Kind,
}

#[derive(Subcommand)]
enum Kind {
    /// A mask for each image, whose numbers or colours tell what is ground
    #[command(after_help = MASKS)]
    Masks {
        /// Folder with the images, and folders within
        images: PathBuf,
        /// Folder with the masks, by the same names
        masks: PathBuf,
        /// The numbers or the colours of the ground, as 7,8 or '#804080,#f423e8'
        #[arg(long, value_name = "VALUES")]
        ground: Values,
        /// Those of pixels of which nobody knows
        #[arg(long, value_name = "VALUES")]
        ignore: Option<Values>,
        /// What names of images end with before the ending; others do not count
        #[arg(long, value_name = "TEXT", default_value = "", hide_default_value = true)]
        image_suffix: String,
        /// What names of masks end with
        #[arg(long, value_name = "TEXT", default_value = "", hide_default_value = true)]
        mask_suffix: String,
        #[command(flatten)]
        wanted: Wanted,
    },
    /// LabelMe's JSON files, one for each image
    #[command(after_help = LABELME)]
    Labelme {
        /// JSON files, or folders with them
        #[arg(required = true, value_name = "DIR|FILE")]
        paths: Vec<PathBuf>,
        /// Folder with the images, by the last part of their names [default: beside the JSON files, or inside them]
        #[arg(long, value_name = "DIR")]
        images: Option<PathBuf>,
        #[command(flatten)]
        labels: LabelArgs,
        #[command(flatten)]
        wanted: Wanted,
    },
    /// A COCO file with the objects of many images
    #[command(after_help = COCO)]
    Coco {
        /// The JSON file
        annotations: PathBuf,
        /// Folder with the images
        #[arg(long, value_name = "DIR")]
        images: PathBuf,
        #[command(flatten)]
        labels: LabelArgs,
        #[command(flatten)]
        wanted: Wanted,
    },
}

/// Which names are ground.
#[derive(clap::Args)]
struct LabelArgs {
    #[command(flatten)]
    named: NamedArgs,
    /// The names of what nobody knows whether it is ground
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    ignore: Vec<String>,
}

#[derive(clap::Args)]
#[group(required = true, multiple = false)]
struct NamedArgs {
    /// The names of the ground; all else is an obstacle
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    ground: Vec<String>,
    /// The names of obstacles; all else is ground
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    obstacle: Vec<String>,
}

impl LabelArgs {
    fn labels(self) -> Labels {
        let (named, names) = match self.named.obstacle.is_empty() {
            true => (Named::Ground, self.named.ground),
            false => (Named::Other, self.named.obstacle),
        };
        let set = |names: Vec<String>| names.iter().map(|name| name.trim().to_string()).collect::<BTreeSet<_>>();
        Labels { named, names: set(names), ignored: set(self.ignore) }
    }
}

/// What is wanted of every picture.
#[derive(clap::Args)]
struct Wanted {
    /// The new folder; one that exists is left alone
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// How many columns of each image, in the middle of equal parts, or which, as 26,80,134; of the images as they
    /// become
    #[arg(long, value_name = "N|X,X", default_value = "6", value_parser = run_columns::parse)]
    columns: Columns,
    #[command(flatten)]
    view: ViewArgs,
    /// Leave out images of which something is damaged or makes no sense, and say so, instead of giving up
    #[arg(long)]
    skip_faulty: bool,
    /// Print what was done, and the report on the folder, as JSON
    #[arg(long)]
    json: bool,
}

/// Which part of a picture, and of what size.
#[derive(clap::Args)]
pub(super) struct ViewArgs {
    /// Cut this part out of each image first, in pixels
    #[arg(long, value_name = "LEFT,TOP,WIDTH,HEIGHT", value_parser = crop)]
    crop: Option<Crop>,
    /// Then scale it to this width and height; proportions are kept only if they are the same
    #[arg(long, value_name = "WxH", value_parser = size)]
    size: Option<(u32, u32)>,
}

impl ViewArgs {
    pub(super) fn view(&self) -> View {
        View { crop: self.crop, size: self.size }
    }
}

fn crop(text: &str) -> Result<Crop, String> {
    let wrong = || "write four whole numbers of pixels, as in 0,40,640,400".to_string();
    let numbers: Option<Vec<u32>> = text.split(',').map(|text| text.trim().parse().ok()).collect();
    match numbers.ok_or_else(wrong)?[..] {
        [left, top, width, height] if width > 0 && height > 0 => Ok(Crop { left, top, width, height }),
        _ => Err(wrong()),
    }
}

/// Makes a folder.
pub(crate) fn run(args: Args) -> Result<(), CliError> {
    match args.kind {
        Kind::Masks { images, masks, ground, ignore, image_suffix, mask_suffix, wanted } => {
            let ignored = ignore.unwrap_or_default();
            if !ignored.0.is_empty() && ignored.are_colours() != ground.are_colours() {
                let text = "--ignore: give numbers where --ground has numbers, and colours where it has colours";
                return Err(CliError::Usage(text.to_string()));
            }
            if let Some(both) = ignored.0.intersection(&ground.0).next() {
                return Err(CliError::Usage(format!("--ignore: {both} is ground too; decide for one of them")));
            }
            let folder = NewFolder::check(&wanted.out)?;
            let folders = masks::Folders { images, masks, image_suffix, mask_suffix };
            let found = masks::find(&folders, &ground, &ignored)?;
            let no_ground = |values: &BTreeSet<Value>| {
                let values: Vec<String> = values.iter().map(ToString::to_string).collect();
                format!(
                    "no mask has a pixel of --ground {ground} in the columns asked for; the values there are {}; choose \
                     among them",
                    values.join(", ")
                )
            };
            import(found, wanted, folder, no_ground)
        }
        Kind::Labelme { paths, images, labels, wanted } => {
            let folder = NewFolder::check(&wanted.out)?;
            let labels = labels.labels();
            let found = labelme::find(&paths, images.as_deref(), &labels)?;
            known(&labels, &found, "shape is labelled")?;
            import(found, wanted, folder, |_| no_ground(&labels))
        }
        Kind::Coco { annotations, images, labels, wanted } => {
            let folder = NewFolder::check(&wanted.out)?;
            let labels = labels.labels();
            let found = coco::find(&annotations, &images, &labels)?;
            known(&labels, &found, "category is named")?;
            import(found, wanted, folder, |_| no_ground(&labels))
        }
    }
}

/// Refuses names that do not occur, for then they are misspelt.
fn known(labels: &Labels, found: &Found, what: &str) -> Result<(), CliError> {
    // Where a file could not be read, its labels are unknown, and its fault is what matters.
    match labels.unknown(&found.labels).next() {
        Some(name) if found.faulty.is_empty() => {
            let there: Vec<&str> = found.labels.iter().map(String::as_str).take(40).collect();
            let there = if there.is_empty() { "none".to_string() } else { there.join(", ") };
            Err(CliError::Failed(format!("no {what} `{name}`; there are: {there}")))
        }
        _ => Ok(()),
    }
}

fn no_ground(labels: &Labels) -> String {
    let names: Vec<&str> = labels.names.iter().map(String::as_str).collect();
    match labels.named {
        Named::Ground => {
            format!("nothing is ground in the columns asked for, with --ground {}; is it all of it?", names.join(","))
        }
        Named::Other => "nothing is ground in the columns asked for; are the obstacles named right?".to_string(),
    }
}

/// What was done.
#[derive(Serialize)]
struct Summary {
    images: usize,
    cases: usize,
    /// Columns without a case, because their labels depend on ignored pixels.
    undecided: usize,
    left_out: Vec<LeftOut>,
    check: CheckReport,
}

/// Pictures between two looks at Ctrl-C, which are in memory together.
const AT_A_TIME: usize = 16;

/// How many pictures that were left out are named.
const SHOWN: usize = 10;

fn import(
    found: Found,
    wanted: Wanted,
    mut folder: NewFolder,
    no_ground: impl Fn(&BTreeSet<Value>) -> String,
) -> Result<(), CliError> {
    let Found { items, mut left_out, faulty, .. } = found;
    if !wanted.skip_faulty && !faulty.is_empty() {
        let more = match faulty.len() - 1 {
            0 => String::new(),
            more => format!("\nand {} more like it", count(more as u64, "image")),
        };
        return Err(CliError::Failed(format!("{}{more}\n{SKIP}", faulty[0].1)));
    }
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
    let mut values = BTreeSet::new();
    let bar = bar(items.len() as u64, wanted.json);
    for part in items.chunks(AT_A_TIME) {
        if stop.load(Ordering::Relaxed) {
            bar.finish_and_clear();
            return Err(CliError::Interrupted("interrupted; nothing was written".to_string()));
        }
        let made: Vec<_> = part.par_iter().map(|item| labelled(item, &view, size, &columns, &stop)).collect();
        for (item, made) in part.iter().zip(made) {
            match made {
                Err(error) if wanted.skip_faulty => {
                    left_out.push(LeftOut { name: item.name.clone(), reason: error.to_string() });
                }
                Err(error) => {
                    bar.finish_and_clear();
                    return Err(CliError::Failed(format!("{error}\n{SKIP}")));
                }
                Ok((labelled, png)) => {
                    undecided += labelled.undecided;
                    any_ground |= labelled.any_ground;
                    values.extend(labelled.values);
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
        bar.inc(part.len() as u64);
    }
    bar.finish_and_clear();
    if images == 0 {
        return Err(nothing(&items, &view, &left_out));
    }
    if !any_ground {
        return Err(CliError::Failed(no_ground(&values)));
    }
    let table = table.into_inner().map_err(|e| CliError::Failed(e.to_string()))?;
    folder.write("labels.csv", &table)?;
    let check = dataset::check(folder.part()).moved_to(&wanted.out);
    if !check.is_sound() {
        return Err(CliError::Failed(format!("the new folder would have faults, and is not kept:\n{check}")));
    }
    if stop.load(Ordering::Relaxed) {
        return Err(CliError::Interrupted("interrupted; nothing was written".to_string()));
    }
    folder.finish()?;
    left_out.sort();
    let summary = Summary { images, cases, undecided, left_out, check };
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

/// Why there is nothing to write.
fn nothing(items: &[Item], view: &View, left_out: &[LeftOut]) -> CliError {
    let fault = items.first().and_then(|item| item.size(view).err());
    let reason = match (fault, left_out.first()) {
        (Some(fault), _) => fault.to_string(),
        (None, Some(out)) => format!("{}: {} ({} in all)", out.name, out.reason, count(left_out.len() as u64, "image")),
        (None, None) => "nothing of this kind was found there; check the paths".to_string(),
    };
    CliError::Failed(format!("there is no image to import: {reason}"))
}

fn bar(steps: u64, quiet: bool) -> ProgressBar {
    let target = match !quiet && std::io::stderr().is_terminal() {
        true => ProgressDrawTarget::stderr_with_hz(10),
        false => ProgressDrawTarget::hidden(),
    };
    let bar = ProgressBar::with_draw_target(Some(steps), target);
    if let Ok(style) = ProgressStyle::with_template("{pos}/{len} images {wide_bar} {eta}") {
        bar.set_style(style.progress_chars("━╸─"));
    }
    bar
}

fn text(summary: &Summary, wanted: &Wanted) -> String {
    let Summary { images, cases, undecided, left_out, check } = summary;
    let mut text = format!("{check}\nimported  {}, {}\n", count(*images as u64, "image"), count(*cases as u64, "case"));
    if *undecided > 0 {
        text += &format!("no label  {}, which depend on ignored pixels\n", count(*undecided as u64, "column"));
    }
    if !left_out.is_empty() {
        text += &format!("left out  {}\n", left_out.len());
        for LeftOut { name, reason } in left_out.iter().take(SHOWN) {
            text += &format!("  {name}: {}\n", reason.replace('\n', " "));
        }
        if left_out.len() > SHOWN {
            text += &format!("  and {} more; `--json` names all of them\n", left_out.len() - SHOWN);
        }
    }
    // Names of files may hold what a terminal would take for commands.
    let text: String = text.chars().map(|c| if c.is_control() && c != '\n' { '?' } else { c }).collect();
    format!("{text}Next: vsonar evolve --data {}\n", shell_word(&wanted.out))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_of_pictures() {
        assert_eq!(crop("1, 2,30,40"), Ok(Crop { left: 1, top: 2, width: 30, height: 40 }));
        for wrong in ["", "1,2,3", "1,2,3,4,5", "1,2,0,4", "1,2,3,0", "-1,2,3,4", "1,2,3,4294967296", "a,b,c,d"] {
            assert!(crop(wrong).is_err(), "{wrong}");
        }
    }
}
