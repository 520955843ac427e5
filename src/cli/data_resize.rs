//! `vsonar data resize`: a folder of photographs at another size, with its labels.

use std::io::Cursor;
use std::path::PathBuf;
use std::sync::atomic::Ordering;

use image::ImageFormat;
use rayon::prelude::*;
use serde::Serialize;
use vsonar::dataset::import::Crop;
use vsonar::dataset::{self, CheckReport};
use vsonar::label::LeftOut;
use vsonar::label::resize::{Carried, ResizeError, Resized, Resizing, Tags, Wanted};
use vsonar::support::printable::{self, ShownPath as _};

use super::data_import::crop;
use super::new_folder::NewFolder;
use super::output::{self, count, shell_word};
use super::program::size;
use super::progress::{Bar, Style};
use super::{CliError, interrupt};

const EXAMPLES: &str = "\
Examples:
  vsonar data resize photos --size 320x240 --out small           before or after they are labelled
  vsonar data resize photos --size 320x240 --crop 0,600,4032,2424 --out small
      without the uppermost 600 rows, which is no longer 4 to 3: what is cut out is stretched to the size

Images become gray PNG files. Proportions are kept: what is too wide or too high is cut off on both sides. A label moves to \
the column in which the middle of its own lies, and to the lowest row whose middle is at the labelled row or above it; 0 and \
height - 1 stay what they are. Labels in what is cut off are lost, and of several that come to one column the one nearest to \
its middle stays; both are counted. The other columns of `labels.csv`, skipped columns and the columns asked for are kept.

`vsonar label` shows an image as it is stored, whatever its orientation tag says, and so detectors see it. Images without \
labels are turned as their tags ask; where an image has both, `--orientation` says of which image the labels are. The new \
folder appears complete or not at all.";

/// Scale the images of a folder, labels and all: photographs are too large
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    /// The folder of images, with or without `labels.csv`; it stays as it is
    dir: PathBuf,
    /// Width and height of the new images in pixels
    #[arg(long, value_name = "WxH", value_parser = size)]
    size: (u32, u32),
    /// The new folder; one that exists is left alone
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Cut this part out of each image first, in pixels of the turned image; it is then scaled without keeping proportions
    /// [default: the largest part in the middle with the proportions of --size]
    #[arg(long, value_name = "LEFT,TOP,WIDTH,HEIGHT", value_parser = crop)]
    crop: Option<Crop>,
    /// What becomes of orientation tags [default: images without labels are turned, labels of an image with a tag are an
    /// error]
    #[arg(long, value_name = "HOW")]
    orientation: Option<How>,
    /// Leave out images that cannot be used, and say so, instead of giving up
    #[arg(long)]
    skip_faulty: bool,
    /// Print what was done, and the report on the folder, as JSON
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Clone, Copy, clap::ValueEnum)]
enum How {
    /// Turn images as their tags ask; labels are of the turned image, as viewers show it
    Apply,
    /// Leave images as they are stored; labels are of these, as `vsonar label` shows them
    Ignore,
}

/// What was done.
#[derive(Serialize, Default)]
struct Summary {
    folder: PathBuf,
    images: usize,
    width: u32,
    height: u32,
    labels: usize,
    /// Columns that are not to be labelled.
    skipped: usize,
    /// Images that were turned as their tags ask.
    turned: usize,
    /// Images of which a part was cut off.
    cut: usize,
    lost: Lost,
    left_out: Vec<LeftOut>,
    check: Option<CheckReport>,
}

/// Marks that are not in the result.
#[derive(Serialize, Default)]
struct Lost {
    /// Those in columns that were cut off.
    beside: usize,
    /// Labels below what was cut out.
    below: usize,
    /// Those that came to the column of another one.
    merged: usize,
}

/// Images between two looks at Ctrl-C, which are in memory together.
const AT_A_TIME: usize = 8;

/// How many images that were left out are named.
const SHOWN: usize = 10;

/// Makes a folder.
pub(crate) fn run(args: Args) -> Result<(), CliError> {
    let mut folder = NewFolder::check(&args.out)?;
    let tags = match args.orientation {
        None => Tags::Unmarked,
        Some(How::Apply) => Tags::Apply,
        Some(How::Ignore) => Tags::Ignore,
    };
    let wanted = Wanted { size: args.size, crop: args.crop, tags };
    let resizing = Resizing::open(&args.dir, wanted).map_err(with_remedy)?;
    if !args.skip_faulty {
        resizing.all_usable().map_err(with_remedy)?;
    }
    let mut left_out = resizing.left_out().to_vec();
    let stop = interrupt::stop_flag()?;
    let interrupted = || CliError::Interrupted("interrupted; nothing was written".to_string());
    folder.make()?;
    let bar = Bar::counting(Style::of(args.json), resizing.images() as u64, "images");
    let mut images: Vec<Carried> = Vec::with_capacity(resizing.images());
    for start in (0..resizing.images()).step_by(AT_A_TIME) {
        let end = (start + AT_A_TIME).min(resizing.images());
        let one = |index: usize| match stop.load(Ordering::Relaxed) {
            true => Err(interrupted()),
            false => one(&resizing, index, &folder, args.skip_faulty).inspect(|_| bar.advance(1)),
        };
        let made: Vec<_> = (start..end).into_par_iter().map(one).collect();
        for made in made {
            match made? {
                Ok(carried) => images.push(carried),
                Err(fault) => left_out.push(fault),
            }
        }
    }
    drop(bar);
    if images.is_empty() {
        return Err(CliError::Failed(format!("no image is left:\n{}", named(&left_out))));
    }
    let files = resizing.files(&images);
    files.iter().try_for_each(|(name, bytes)| folder.write(name, bytes))?;
    let (width, height) = args.size;
    let (folder_name, sum) =
        (args.out.clone(), |of: fn(&Carried) -> usize| images.iter().map(of).sum::<usize>());
    let mut summary = Summary {
        folder: folder_name,
        images: images.len(),
        width,
        height,
        labels: sum(Carried::labels),
        skipped: sum(Carried::skipped),
        turned: sum(|image| image.turned.into()),
        cut: sum(|image| image.is_cut().into()),
        lost: Lost {
            beside: sum(|image| image.beside),
            below: sum(|image| image.below),
            merged: sum(|image| image.merged),
        },
        left_out,
        check: None,
    };
    if summary.labels > 0 {
        let check = dataset::check(folder.part()).moved_to(&args.out);
        if !check.is_sound() {
            return Err(CliError::Failed(format!(
                "the new folder would have faults, and is not kept:\n{check}"
            )));
        }
        summary.check = Some(check);
    }
    if stop.load(Ordering::Relaxed) {
        return Err(interrupted());
    }
    folder.finish()?;
    if args.json { output::print_json(&summary) } else { output::print(&text(&summary, args.crop.is_some())) }
}

/// Makes an image; or tells why it is left out.
fn one(
    resizing: &Resizing,
    index: usize,
    folder: &NewFolder,
    skip_faulty: bool,
) -> Result<Result<Carried, LeftOut>, CliError> {
    let Resized { file, pixels, carried } = match resizing.image(index) {
        Ok(resized) => resized,
        Err(error) if skip_faulty => {
            return Ok(Err(LeftOut { name: resizing.name(index).to_string(), why: error.to_string() }));
        }
        Err(error) => return Err(with_remedy(error)),
    };
    let mut png = Cursor::new(Vec::new());
    pixels.write_to(&mut png, ImageFormat::Png)?;
    folder.write(&file, png.get_ref())?;
    Ok(Ok(carried))
}

/// The error with the flag that helps.
fn with_remedy(error: ResizeError) -> CliError {
    let remedy = match &error {
        ResizeError::Tagged { .. } => {
            "; `--orientation ignore` takes the image as it is stored, which is right for labels made by `vsonar label`, \
             `--orientation apply` turns it, which is right for labels made in a viewer"
        }
        ResizeError::Unusable { .. } | ResizeError::Image(_) | ResizeError::View { .. } => {
            "\nnothing was written; `--skip-faulty` leaves out what cannot be used"
        }
        ResizeError::Folder(_) => "",
    };
    CliError::Failed(format!("{error}{remedy}"))
}

/// The first ones that were left out, a line each.
fn named(left_out: &[LeftOut]) -> String {
    let line =
        |LeftOut { name, why }: &LeftOut| format!("  {}: {}\n", printable::line(name), printable::line(why));
    let mut text: String = left_out.iter().take(SHOWN).map(line).collect();
    if left_out.len() > SHOWN {
        text += &format!("  and {} more (`--json` names all of them)\n", left_out.len() - SHOWN);
    }
    text
}

fn text(summary: &Summary, cropped: bool) -> String {
    let Summary { folder, images, width, height, labels, skipped, turned, cut, lost, left_out, .. } = summary;
    let image = |number: usize| count(number as u64, "image");
    let label = |number: usize| count(number as u64, "label");
    let mut text = format!("{}: {} of {width} x {height} pixels", folder.shown(), image(*images));
    if *labels > 0 {
        text += &format!(", {}", label(*labels));
    }
    if *skipped > 0 {
        text += &format!(", {}", count(*skipped as u64, "skipped column"));
    }
    text.push('\n');
    if *turned > 0 {
        text += &format!("turned    {}, as their orientation tags ask\n", image(*turned));
    }
    if *cut > 0 {
        let what = if cropped {
            "the part asked for is left"
        } else {
            "the middle is left, so that proportions are kept"
        };
        text += &format!("cut       {}: {what}\n", image(*cut));
    }
    if lost.beside > 0 {
        text += &format!("lost      {} in columns that were cut off\n", count(lost.beside as u64, "mark"));
    }
    if lost.below > 0 {
        text += &format!(
            "lost      {} below what is left, which do not tell what is above them\n",
            label(lost.below)
        );
    }
    if lost.merged > 0 {
        text += &format!(
            "lost      {} that came to the column of another one; the nearest to its middle stays\n",
            count(lost.merged as u64, "mark")
        );
    }
    if !left_out.is_empty() {
        text += &format!("left out  {}\n{}", left_out.len(), named(left_out));
    }
    let next = if *labels > 0 { "evolve --data" } else { "label" };
    format!("{text}Next: vsonar {next} {}\n", shell_word(folder))
}
